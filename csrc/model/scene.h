/* Internal units of a top: powers of two times the user's units. Scaling the user's units of mass,
 * length and time by powers of two therefore scales all results exactly. */
#ifndef KR_SCENE_H
#define KR_SCENE_H
#include "body.h"
#include "math/exponent.h"

/* Internal units, in which the largest moment of inertia and the rate of rotation are about one. */
typedef struct kr_units {
    double moment, time; /* [M L^2], [T] */
    kr_vec3 lever;       /* mass * gravity * com in these units, along internal axes */
} kr_units;
/* The factors of lever = mass * gravity * com * 2^power. The product itself may overflow. */
typedef struct kr_pull {
    double mass, gravity;
    kr_vec3 com;
    int power;
} kr_pull;
/* Returns the mass, the gravity and the vector `com`, scaled by powers of two. */
kr_pull kr_scene_pull(const kr_scene *scene, kr_vec3 com);

/* Returns the kind of a top. Without gravity, the top is of the kind of a torque-free body,
 * wherever the centre of mass is and whether the support is shaken or not. */
kr_kind kr_scene_kind(const kr_scene *scene);
static inline int kr_scene_turns(const kr_scene *scene) { return v_largest(scene->turning) > 0.0; }
static inline int kr_scene_shakes(const kr_scene *scene) { return scene->shaking.amplitude != 0.0; }
/* Returns 1 if the top has dry friction or is in a gravity gradient, or if its support moves. */
static inline int kr_scene_needs_support_terms(const kr_scene *scene)
{
    return scene->friction > 0.0 || kr_scene_turns(scene) || kr_scene_shakes(scene) ||
           scene->gradient != 0.0;
}
/* Returns 1 if the top is damped, or if kr_scene_needs_support_terms returns 1. */
static inline int kr_scene_is_disturbed(const kr_scene *scene)
{
    return v_largest(scene->damping) > 0.0 || kr_scene_needs_support_terms(scene);
}
/* Returns 1 if the support rotates about the vertical only. In the inertial frame, an undamped top
 * then moves as if the support were at rest. */
static inline int kr_scene_turns_about_vertical(const kr_scene *scene)
{
    return scene->turning.z != 0.0 && scene->turning.x == 0.0 && scene->turning.y == 0.0;
}
/* Converts a state from the inertial frame to the frame of a support that rotates about e3. The two
 * frames coincide at the initial time. */
void kr_scene_turn_state(const kr_scene *scene, kr_state *state);
/* Returns 1 if damping, friction, a gravity gradient or a moving support rules out a closed form.
 * If `own` is nonzero, a rotation of the support about the vertical is permitted. */
static inline int kr_scene_excludes_exact(const kr_scene *scene, int own)
{
    kr_scene at_rest = *scene;
    if (own && kr_scene_turns_about_vertical(scene)) at_rest.turning.z = 0.0;
    return kr_scene_is_disturbed(&at_rest);
}
/* Validates a scene like kr_scene_check, but without checking the body. */
kr_status kr_scene_check_start(const kr_scene *scene);

/* The unit of moments of inertia, its reciprocal, and the pendulum frequency [T^-1]. */
typedef struct kr_swing {
    double moment, per_moment, rate;
} kr_swing;
kr_swing kr_scene_swing(const kr_scene *scene, const kr_working *working);
/* The smallest permitted internal unit; the reciprocal of a smaller unit might overflow. */
static const double kr_min_unit = 0x1p-1020;
/* Writes the exponent of the unit of time 2^power, in which the rate of the motion is about one,
 * for momenta up to `momentum`. Returns 0 if the units exceed the range of doubles. */
static inline int kr_swing_time(const kr_swing *swing, double momentum, int *power)
{
    const double turn = momentum * swing->per_moment,
                 rate = turn > swing->rate ? turn : swing->rate;
    if (!(rate < INFINITY) || swing->moment < kr_min_unit) return 0;
    *power = 0;
    if (rate > 0.0) *power = -power_above(rate > kr_min_unit ? rate : kr_min_unit);
    const double unit = times_power_of_2(swing->moment, -*power);
    return unit < INFINITY && unit >= kr_min_unit;
}
/* Writes the internal units. Returns KR_ERR_ARGUMENT if one exceeds the range of doubles. */
kr_status kr_scene_units(const kr_scene *scene, const kr_working *working, kr_units *units);
/* Returns the horizon (kr_scene_horizon) for known units and axes. */
double kr_units_horizon(const kr_units *units, const kr_scene *scene, const kr_working *working);
#endif
