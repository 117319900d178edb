/* Internal units of a top: powers of two times the user's units. If a user scales the units of
 * mass, length and time by powers of two, all results are therefore scaled exactly. The term lever
 * is short for the vector mass * gravity * com, with the vector com to the centre of mass. */
#ifndef KR_SCENE_H
#define KR_SCENE_H
#include "body.h"
#include "math/exponent.h"

/* Units in which the largest moment of inertia and the rate of the motion are about one. */
typedef struct kr_units {
    double moment, time; /* [M L^2], [T] */
    kr_vec3 lever;       /* mass * gravity * com in these units, along the working axes (body.h) */
} kr_units;
/* The factors of lever = mass * gravity * com * 2^power, whose product may overflow. */
typedef struct kr_pull {
    double mass, gravity;
    kr_vec3 com;
    int power;
} kr_pull;
/* Returns the factors: mass, gravity and `com` scaled by powers of two to magnitudes below one. */
kr_pull kr_scene_pull(const kr_scene *scene, kr_vec3 com);

/* Returns the kind (integrable case) of a top without disturbances (kr_scene_is_disturbed). Without
 * gravity, the centre of mass has no effect, and the kind is that of a body with com = 0. */
kr_kind kr_scene_kind(const kr_scene *scene);
static inline int kr_support_turns(const kr_scene *scene)
{
    return v_largest(scene->turning) > 0.0;
}
static inline int kr_support_shakes(const kr_scene *scene)
{
    return scene->shaking.amplitude != 0.0;
}
/* Returns 1 if there is dry friction or a gravity gradient, or if the support moves. */
static inline int kr_scene_has_support_terms(const kr_scene *scene)
{
    return scene->friction > 0.0 || kr_support_turns(scene) || kr_support_shakes(scene) ||
           scene->gradient != 0.0;
}
static inline int kr_scene_is_disturbed(const kr_scene *scene)
{
    return v_largest(scene->damping) > 0.0 || kr_scene_has_support_terms(scene);
}
/* Returns 1 if the support rotates about the vertical only. In the inertial frame, a top without
 * damping and friction then moves as if the support did not rotate. */
static inline int kr_support_turns_about_vertical(const kr_scene *scene)
{
    return scene->turning.z != 0.0 && scene->turning.x == 0.0 && scene->turning.y == 0.0;
}
/* Converts `state` from the inertial frame to the frame of a support that rotates about e3. Both
 * frames coincide at the initial time of the scene. */
void kr_scene_turn_state(const kr_scene *scene, kr_state *state);
/* Returns 1 if damping, friction, a gravity gradient or a moving support rules out a closed form of
 * the motion. If allow_turning is nonzero, the support may rotate about the vertical. */
static inline int kr_scene_excludes_closed_form(const kr_scene *scene, int allow_turning)
{
    kr_scene at_rest = *scene;
    if (allow_turning && kr_support_turns_about_vertical(scene)) at_rest.turning.z = 0.0;
    return kr_scene_is_disturbed(&at_rest);
}
/* Validates a scene like kr_scene_check, but without checking the body. */
kr_status kr_scene_check_start(const kr_scene *scene);

/* The unit of moments of inertia, its reciprocal, and about the frequency of a pendulum [T^-1]. */
typedef struct kr_swing {
    double moment, per_moment, rate;
} kr_swing;
kr_swing kr_scene_swing(const kr_scene *scene, const kr_working *working);
/* The smallest permitted internal unit: reciprocals of smaller ones might overflow. */
static const double kr_min_unit = 0x1p-1020;
/* Writes the exponent of the unit of time 2^exponent, in which the larger of swing->rate and the
 * angular velocity max_momentum * swing->per_moment is about one. Returns 0 if the units exceed the
 * range of doubles, else 1. */
static inline int kr_find_time_unit(const kr_swing *swing, double max_momentum, int *exponent)
{
    const double turn = max_momentum * swing->per_moment,
                 rate = turn > swing->rate ? turn : swing->rate;
    if (!(rate < INFINITY) || swing->moment < kr_min_unit) return 0;
    *exponent = 0;
    if (rate > 0.0) *exponent = -exponent_above(rate > kr_min_unit ? rate : kr_min_unit);
    const double unit = times_power_of_2(swing->moment, -*exponent);
    return unit < INFINITY && unit >= kr_min_unit;
}
/* Writes the internal units. Returns KR_ERR_ARGUMENT if one exceeds the range of doubles. */
kr_status kr_scene_units(const kr_scene *scene, const kr_working *working, kr_units *units);
/* Returns kr_scene_horizon(scene), given the internal units and the working axes. */
double kr_units_horizon(const kr_units *units, const kr_scene *scene, const kr_working *working);
#endif
