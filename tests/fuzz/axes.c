/* Tops that are described with their axes in another order must have the same motion. */
#include <math.h>
#include "calls.h"
#include "random_values.h"
#include "claims.h"
#include "math/su2.h"
#include "scenes.h"

static kr_vec3 next_axes(kr_vec3 v) { return v3(v.y, v.z, v.x); }
/* Returns `scene` with its axes permuted cyclically. */
static kr_scene renamed(const kr_scene *scene)
{
    kr_scene other = *scene;
    other.body.inertia = next_axes(scene->body.inertia);
    other.body.com = next_axes(scene->body.com);
    other.body.rotor = next_axes(scene->body.rotor);
    other.body.axes = q_mul(scene->body.axes, q4(0.5, v3(0.5, 0.5, 0.5)));
    other.damping = next_axes(scene->damping);
    return other;
}
/* Returns an upper bound of all rates except those of damping. */
static double fastest(const kr_scene *scene)
{
    const kr_vec3 A = scene->body.inertia;
    const double least = fmin(A.x, fmin(A.y, A.z)),
                 shaken = scene->shaking.rate * scene->shaking.rate * scene->shaking.amplitude,
                 pull = (fabs(scene->gravity) + fabs(shaken)) * scene->body.mass *
                        v_length(scene->body.com);
    return (v_length(scene->start.m) + v_length(scene->body.rotor)) / least +
           v_length(scene->turning) + scene->shaking.rate + sqrt((pull + scene->friction) / least);
}
static kr_status move(const kr_scene *scene, double t, int digits, kr_state *end)
{
    const kr_config config = {.digits = digits, .max_steps = 2000};
    kr_top *top = NULL;
    kr_status status = kr_top_create(scene, kr_method_find("taylor"), config, &top);
    if (status == KR_OK) status = kr_top_advance(top, t);
    if (status == KR_OK) *end = kr_top_state(top);
    kr_top_free(top);
    return status;
}
void call_axes(void)
{
    kr_scene scene = any_scene();
    scene.start.t = 0.0;
    const double rate = fastest(&scene), t = between(0.1, 1.0) / rate;
    if (kr_scene_check(&scene) != KR_OK || !isfinite(t) || !(t > 0.0)) return;
    const kr_vec3 A = scene.body.inertia;
    /* Without a centre of mass off the fixed point, friction acts about the last axis. */
    if (!(v_largest(scene.body.com) > 0.0)) scene.friction = 0.0;
    if (odds(60)) scene.damping = any_damping(&scene);
    const kr_scene other = renamed(&scene);
    const int digits = odds(80) ? 16 : odds(50) ? 20 : 30;
    kr_state end[2];
    print_call("move in another order of axes to %a with %d digits", t, digits);
    tell_scene(&scene);
    if (kr_scene_check(&other) != KR_OK) return;
    if (move(&scene, t, digits, &end[0]) != KR_OK || move(&other, t, digits, &end[1]) != KR_OK)
        return;
    const double size = v_length(scene.start.m) + t * rate * rate * v_largest(A);
    CLAIM(kr_attitude_error(end[0].q, end[1].q) < 1e-10);
    CLAIM(v_largest(v_sub(end[0].m, end[1].m)) <= 1e-10 * size);
}
