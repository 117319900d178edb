/* The units of its own in which a top is moved: powers of two, so that results scale bit for bit
 * with powers of two of mass, length and time. */
#ifndef KR_SCENE_H
#define KR_SCENE_H
#include "body.h"
#include "math/exponent.h"

/* In these units the largest moment and the top's rate are about one. */
typedef struct kr_units {
    double moment, time; /* [M L^2], [T] */
    kr_vec3 lever;       /* mass gravity com in these units, along working axes */
} kr_units;
/* mass gravity com with its size apart, for the products of these may be beyond all doubles:
 * mass gravity com 2^power. */
typedef struct kr_pull {
    double mass, gravity;
    kr_vec3 com;
    int power;
} kr_pull;
kr_pull kr_scene_pull(const kr_scene *scene, kr_vec3 com);

/* Says of all but the body what kr_scene_check says. */
kr_status kr_scene_check_start(const kr_scene *scene);

/* What the unit of time follows from: the unit of moment, 1 of that, and the rate of a pendulum
 * [T^-1]. */
typedef struct kr_swing {
    double moment, per_moment, rate;
} kr_swing;
kr_swing kr_scene_swing(const kr_scene *scene, const kr_working *working);
/* What is less has no reciprocal. */
static const double kr_min_unit = 0x1p-1020;
/* Gives the unit of time, 2^power, of a top with this largest component of its momentum, and
 * returns whether there is one. Powers of two take no division. */
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
kr_status kr_scene_units(const kr_scene *scene, const kr_working *working, kr_units *units);
/* Gives kr_scene_horizon where these are known. */
double kr_units_horizon(const kr_units *units, const kr_scene *scene, const kr_working *working);
#endif
