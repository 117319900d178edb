/* The default scene, and functions that validate a scene and find its internal units (scene.h). */
#include "scene.h"
#include "math/trig.h"

kr_scene kr_scene_default(void)
{
    /* A cuboid of density 1 with half-edges (0.8, 0.8, 1), and the fixed point at (0, 0, -1) from
     * its centre. The numbers are constants, so that programs need not link kr_body_shape. */
    const kr_body body = {
        .mass = 0x1.47ae147ae147cp+2,
        .inertia = {0x1.facfcdc177bd8p+2, 0x1.facfcdc177bd8p+2, 0x1.179ec9cbd821fp+1},
        .com = {0.0, 0.0, 1.0},
        .axes = {1.0, 0.0, 0.0, 0.0}};
    return (kr_scene){
        .body = body, .gravity = 1.0, .start = {0.0, {1.0, 0.0, 0.0, 0.0}, {0.172, -1.862, 1.46}}};
}
static int is_support_input_valid(const kr_scene *scene)
{
    const kr_shaking *shaking = &scene->shaking;
    if (!v_finite(scene->turning) || !(scene->friction >= 0.0 && scene->friction < INFINITY))
        return 0;
    if (!isfinite(shaking->amplitude) || !isfinite(shaking->phase)) return 0;
    return shaking->rate >= 0.0 && shaking->rate < INFINITY &&
           isfinite(shaking->amplitude * shaking->rate * shaking->rate) &&
           (shaking->rate > 0.0 || !kr_support_shakes(scene));
}
static kr_status check_wheels_and_gradient(const kr_scene *scene)
{
    const int is_braked = v_largest(scene->damping) > 0.0 || scene->friction > 0.0;
    for (int i = 0; i < KR_WHEELS_MAX; i++) {
        const kr_wheel *wheel = &scene->wheels[i];
        if (!v_finite(wheel->axis) || !isfinite(wheel->rate)) return KR_ERR_ARGUMENT;
        if (is_braked && v_largest(wheel->axis) == 0.0 && wheel->rate != 0.0) return KR_ERR_WHEEL;
        if (scene->gradient != 0.0 && v_largest(wheel->axis) > 0.0) return KR_ERR_COMBINATION;
    }
    if (!isfinite(scene->gradient)) return KR_ERR_ARGUMENT;
    return scene->gradient != 0.0 && kr_support_shakes(scene) ? KR_ERR_COMBINATION : KR_OK;
}
kr_status kr_scene_check_start(const kr_scene *scene)
{
    const kr_state *start = &scene->start;
    const kr_vec3 damping = scene->damping;
    if (!isfinite(scene->gravity) || !isfinite(start->t) || !v_finite(start->m))
        return KR_ERR_ARGUMENT;
    if (!v_finite(damping) || !(damping.x >= 0.0 && damping.y >= 0.0 && damping.z >= 0.0))
        return KR_ERR_ARGUMENT;
    if (!is_support_input_valid(scene)) return KR_ERR_ARGUMENT;
    if (!(fabs(q_dot(start->q, start->q) - 1.0) <= KR_INPUT_RTOL)) return KR_ERR_ATTITUDE;
    return check_wheels_and_gradient(scene);
}
kr_status kr_scene_check(const kr_scene *scene)
{
    const kr_status status = scene ? kr_body_check(&scene->body) : KR_ERR_ARGUMENT;
    return status == KR_OK ? kr_scene_check_start(scene) : status;
}

kr_kind kr_scene_kind(const kr_scene *scene)
{
    if (scene->gravity != 0.0) return kr_body_kind(&scene->body, KR_KIND_RTOL);
    kr_body centred = scene->body;
    centred.com = v3(0.0, 0.0, 0.0);
    return kr_body_kind(&centred, KR_KIND_RTOL);
}

static kr_vec3 scale_by_power_of_2(kr_vec3 a, int power)
{
    return v3(times_power_of_2(a.x, power), times_power_of_2(a.y, power),
              times_power_of_2(a.z, power));
}
kr_pull kr_scene_pull(const kr_scene *scene, kr_vec3 com)
{
    int mass, gravity, reach;
    kr_pull pull = {fraction_of(scene->body.mass, &mass), fraction_of(scene->gravity, &gravity),
                    com, 0};
    fraction_of(v_largest(com), &reach);
    pull.com = scale_by_power_of_2(com, -reach);
    pull.power = mass + gravity + reach;
    return pull;
}
void kr_scene_turn_state(const kr_scene *scene, kr_state *state)
{
    const double angle = scene->turning.z * (state->t - scene->start.t);
    kr_quat turn = q_one();
    sin_cos(-0.5 * angle, &turn.z, &turn.w);
    state->q = q_mul(turn, state->q);
    state->m = q_turn(turn, state->m);
}
kr_swing kr_scene_swing(const kr_scene *scene, const kr_working *working)
{
    const double moment = times_power_of_2(1.0, exponent_above(v_largest(working->inertia)));
    const kr_pull pull = kr_scene_pull(scene, working->com);
    const double part = v_largest(v_scale(pull.gravity * pull.mass, pull.com));
    const int power = pull.power - exponent_of(moment), odd = power & 1;
    return (kr_swing){moment, 1.0 / moment,
                      times_power_of_2(sqrt(times_power_of_2(part, odd)), (power - odd) / 2)};
}
static double largest_support_frequency(const kr_scene *scene)
{
    const double shaking = kr_support_shakes(scene) ? scene->shaking.rate : 0.0;
    return fmax(v_largest(scene->turning), shaking);
}
/* Returns the unit of moments and the pendulum frequency like kr_scene_swing (scene.h), but with
 * the larger of gravity and the greatest acceleration of the shaken support. In a gravity gradient
 * k, the frequency is at least sqrt(|k|), the upper bound of the frequency of librations. */
static kr_swing find_disturbed_swing(const kr_scene *scene, const kr_working *working)
{
    const kr_shaking *shaking = &scene->shaking;
    if (!kr_support_shakes(scene)) {
        kr_swing swing = kr_scene_swing(scene, working);
        if (scene->gradient != 0.0) swing.rate = fmax(swing.rate, sqrt(fabs(scene->gradient)));
        return swing;
    }
    kr_scene strongest = *scene;
    strongest.gravity =
        fmax(fabs(scene->gravity), fabs(shaking->amplitude) * shaking->rate * shaking->rate);
    return kr_scene_swing(&strongest, working);
}
kr_status kr_scene_units(const kr_scene *scene, const kr_working *working, kr_units *units)
{
    const kr_swing swing = find_disturbed_swing(scene, working);
    const kr_pull pull = kr_scene_pull(scene, working->com);
    int time;
    const double turning = largest_support_frequency(scene) * swing.moment,
                 momentum =
                     fmax(fmax(v_largest(scene->start.m), v_largest(scene->body.rotor)), turning);
    if (!kr_find_time_unit(&swing, momentum, &time)) return KR_ERR_ARGUMENT;
    units->moment = swing.moment;
    units->time = times_power_of_2(1.0, time);
    units->lever = scale_by_power_of_2(v_scale(pull.gravity * pull.mass, pull.com),
                                       pull.power - exponent_of(swing.moment) + 2 * time);
    return KR_OK;
}
double kr_units_horizon(const kr_units *units, const kr_scene *scene, const kr_working *working)
{
    /* Computed in internal units, because squares of values in the user's units could overflow. */
    const double moment = v_largest(working->inertia) / units->moment;
    const kr_vec3 m = v_scale(units->time, v_scale(1.0 / units->moment, scene->start.m)),
                  h = v_scale(units->time, v_scale(1.0 / units->moment, scene->body.rotor)),
                  lever = units->lever,
                  W = v_over(v_sub(q_turn_back(q_mul(scene->start.q, scene->body.axes), m), h),
                             v_scale(1.0 / units->moment, scene->body.inertia));
    const double swing = sqrt(v_length(lever) / moment),
                 shaking = find_disturbed_swing(scene, working).rate * units->time,
                 turning = units->time * largest_support_frequency(scene),
                 moved = kr_support_shakes(scene) ? fmax(shaking, turning) : turning;
    const double rotation = fmax(v_largest(W), (v_length(m) + v_length(h)) / moment);
    return 0x1p53 * units->time / fmax(rotation, fmax(swing, moved));
}
double kr_scene_horizon(const kr_scene *scene)
{
    kr_units units;
    if (kr_scene_check(scene) != KR_OK) return 0.0;
    const kr_working working = kr_body_working(&scene->body);
    const kr_status status = kr_scene_units(scene, &working, &units);
    return status == KR_OK ? kr_units_horizon(&units, scene, &working) : 0.0;
}
