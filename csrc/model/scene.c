/* Scenes: the one to begin with, what a scene must be, and the top's own units. */
#include "scene.h"

kr_scene kr_scene_default(void)
{
    kr_scene s = {.gravity = 1.0, .start = {0.0, {1.0, 0.0, 0.0, 0.0}, {0.172, -1.862, 1.46}}};
    kr_body_cuboid(1.0, v3(0.8, 0.8, 1.0), v3(0.0, 0.0, -1.0), &s.body);
    return s;
}
kr_status kr_scene_check(const kr_scene *scene)
{
    const kr_status status = scene ? kr_body_check(&scene->body) : KR_ERR_ARGUMENT;
    if (status != KR_OK) return status;
    const kr_state *start = &scene->start;
    const kr_vec3 damping = scene->damping;
    if (!isfinite(scene->gravity) || !isfinite(start->t) || !v_finite(start->m))
        return KR_ERR_ARGUMENT;
    if (!v_finite(damping) || !(fmin(damping.x, fmin(damping.y, damping.z)) >= 0.0))
        return KR_ERR_ARGUMENT;
    return fabs(q_dot(start->q, start->q) - 1.0) <= KR_INPUT_RTOL ? KR_OK : KR_ERR_ATTITUDE;
}

/* The power of two that is x or somewhat more; 1 for zero. */
static double power_of_two(double x)
{
    int exponent = 0;
    frexp(x, &exponent);
    return ldexp(1.0, exponent);
}
kr_status kr_scene_units(const kr_scene *scene, const kr_working *working, kr_units *units)
{
    const kr_body *body = &scene->body;
    const double moment = power_of_two(v_largest(working->inertia)),
                 mass = power_of_two(body->mass);
    const kr_vec3 lever =
        v_scale(mass / moment, v_scale(scene->gravity * (body->mass / mass), working->com));
    const double rate = fmax(v_largest(scene->start.m) / moment, sqrt(v_largest(lever)));
    if (!isfinite(rate)) return KR_ERR_ARGUMENT;
    units->moment = moment;
    units->time = 1.0 / power_of_two(rate);
    units->lever = lever;
    return KR_OK;
}
double kr_units_horizon(const kr_units *units, const kr_scene *scene, const kr_working *working)
{
    /* In own units no square overflows. */
    const double moment = v_largest(working->inertia) / units->moment;
    const kr_vec3 m = v_scale(units->time, v_scale(1.0 / units->moment, scene->start.m)),
                  lever = v_scale(units->time, v_scale(units->time, units->lever));
    return 0x1p53 * units->time / fmax(v_length(m) / moment, sqrt(v_length(lever) / moment));
}
double kr_scene_horizon(const kr_scene *scene)
{
    kr_units units;
    if (kr_scene_check(scene) != KR_OK) return 0.0;
    const kr_working working = kr_body_working(&scene->body);
    const kr_status status = kr_scene_units(scene, &working, &units);
    return status == KR_OK ? kr_units_horizon(&units, scene, &working) : 0.0;
}
