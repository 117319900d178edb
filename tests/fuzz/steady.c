/* Motions with a known formula: tangents of steady rotations, and free bodies that leave their
 * middle axis. */
#include <math.h>
#include "calls.h"
#include "random_values.h"
#include "claims.h"
#include "math/su2.h"

/* A rotation about a fixed axis, and the growth rate of its tangents. */
typedef struct {
    kr_scene scene;
    double pace, growth; /* rates */
} rotation;

static double component(kr_vec3 v, int i) { return i == 0 ? v.x : i == 1 ? v.y : v.z; }
static kr_vec3 along_axis(int axis, double size)
{
    return v3(axis == 0 ? size : 0.0, axis == 1 ? size : 0.0, axis == 2 ? size : 0.0);
}
/* Returns a free body whose moments differ by at least a tenth, in any order. */
static kr_body free_body(void)
{
    const double low = 1.0, middle = between(1.1, 1.6), high = between(middle * 1.1, middle + 0.9);
    const double all[3] = {low, middle, high};
    const int first = (int)choose(3), way = 1 + (int)choose(2);
    const kr_vec3 inertia = v3(all[first], all[(first + way) % 3], all[(first + 2 * way) % 3]);
    const kr_body body = {1.0, inertia, v3(0, 0, 0), q_one(), 0.0, {0, 0, 0}};
    return body;
}
/* Returns the square of the rate at which a free body leaves an axis; negative for a stable axis.
 * */
static double square_rate(kr_vec3 A, int axis, double momentum)
{
    const double own = component(A, axis), one = component(A, (axis + 1) % 3),
                 other = component(A, (axis + 2) % 3), spin = momentum / own;
    return spin * spin * (own - one) * (other - own) / (one * other);
}
/* Returns an attitude that permutes the axes, without rounding errors. */
static kr_quat exact_attitude(void)
{
    const kr_quat all[4] = {q_one(), q4(0.0, v3(1.0, 0.0, 0.0)), q4(0.5, v3(0.5, 0.5, 0.5)),
                            q4(0.5, v3(-0.5, -0.5, -0.5))};
    return all[choose(4)];
}
static rotation about_principal_axis(void)
{
    const int axis = (int)choose(3);
    const double momentum = either_sign(spread(1e-3, 1e4));
    rotation r = {.scene = kr_scene_default()};
    r.scene.body = free_body();
    r.scene.start.q = exact_attitude();
    r.scene.start.m = q_turn(r.scene.start.q, along_axis(axis, momentum));
    r.pace = fabs(momentum);
    r.growth = sqrt(fmax(0.0, square_rate(r.scene.body.inertia, axis, momentum)));
    return r;
}
/* Returns a symmetric top that hangs, or stands upright with a spin at least 1.3 times or at most
 * 0.8 times the critical spin. */
static rotation about_vertical(void)
{
    const double inertia = between(0.5, 2.0), lever = between(0.5, 2.0);
    const double slowest = sqrt(4.0 * inertia * lever);
    const int hangs = odds(30), falls = !hangs && odds(20);
    const double momentum = falls ? between(0.0, 0.8) * slowest : spread(1.3, 1e4) * slowest,
                 half = momentum / (2.0 * inertia);
    const kr_body body = {
        1.0,      v3(inertia, inertia, inertia * between(0.1, 1.9)), v3(0, 0, lever), q_one(), 0.0,
        {0, 0, 0}};
    rotation r = {.scene = kr_scene_default()};
    r.scene.body = body;
    r.scene.gravity = 1.0;
    r.scene.start.q = hangs ? q4(0.0, v3(1.0, 0.0, 0.0)) : q_one();
    r.scene.start.m = v3(0.0, 0.0, either_sign(momentum));
    r.pace = momentum / fmin(inertia, body.inertia.z) + 1.0;
    r.growth = falls ? sqrt(lever / inertia - half * half) : 0.0;
    return r;
}
/* Claims that the logarithm of a tangent's size follows the formula, up to linear growth. */
static void call_growth(void)
{
    const rotation r = choose(2) ? about_principal_axis() : about_vertical();
    const double turns = r.growth > 0.0 ? fmin(2000.0 / r.pace, 300.0 / r.growth) : 2000.0 / r.pace;
    const double t = either_sign(turns * spread(1e-2, 1.0));
    double growth[KR_GROWTH_COUNT];
    kr_outcome outcome;
    kr_worker *worker = NULL;
    const kr_config config = {.tangents = KR_TANGENT_GROWTH, .skip_heading = odds(50)};
    const kr_tops tops = {
        .n = 1, .scenes = &r.scene, .times = 1, .t = &t, .outcomes = &outcome, .growth = growth};
    tell_scene(&r.scene);
    print_call("growth of a steady rotation to %a, at the rate %g", t, r.growth);
    CLAIM(kr_worker_create(kr_method_find("taylor"), config, 0, NULL, &worker) == KR_OK);
    const kr_status status = kr_worker_run(worker, &tops);
    kr_worker_free(worker);
    CLAIM(status == KR_OK && outcome.status == KR_OK);
    const double more = growth[KR_GROWTH_LOG] - r.growth * fabs(t);
    print_detail("off by %g", more);
    CLAIM(fabs(more) <= 12.0 + log(1.0 + r.pace * fabs(t)));
    for (int i = KR_GROWTH_ENERGY; i <= KR_GROWTH_TRUNCATION; i++) CLAIM(growth[i] <= 1e-10);
}
/* Claims that the closed form of a free body near its middle axis agrees with taylor at 30 digits.
 * */
static void call_beside_middle_axis(void)
{
    const int axis = (int)choose(3), way = 1 + (int)choose(2);
    const double lean = spread(1e-70, 1e-8);
    kr_scene scene = kr_scene_default();
    kr_exact exact;
    kr_top *top = NULL;
    scene.body = free_body();
    const double square = square_rate(scene.body.inertia, axis, 1.0);
    if (!(square > 0.0)) return;
    scene.start.q = q_one();
    scene.start.m = v_add(along_axis(axis, either_sign(1.0)),
                          v_add(along_axis((axis + way) % 3, lean),
                                along_axis((axis + 2 * way) % 3, lean * between(-2.0, 2.0))));
    const double t = either_sign(between(0.0, 1.2) * -log(lean) / sqrt(square));
    tell_scene(&scene);
    print_call("closed form of a body that leans by %g, at %a", lean, t);
    CLAIM(kr_exact_plan(&scene, &exact) == KR_OK);
    const kr_config config = {.digits = 30, .step = t < 0.0 ? -1.0 : 0.0};
    CLAIM(kr_top_create(&scene, kr_method_find("taylor"), config, &top) == KR_OK);
    const kr_status status = kr_top_advance(top, t);
    const kr_state truth = kr_top_state(top), one = kr_exact_state(&exact, t);
    kr_state many[1];
    kr_top_free(top);
    kr_exact_states(&exact, 1, &t, many);
    CLAIM(status == KR_OK && same_bits(&one, many, sizeof one));
    print_detail("off by %g", kr_attitude_error(one.q, truth.q));
    CLAIM(kr_attitude_error(one.q, truth.q) <= 1e-12);
}
void call_steady(void)
{
    if (odds(80))
        call_growth();
    else
        call_beside_middle_axis();
}
