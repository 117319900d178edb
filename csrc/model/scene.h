/* The units of its own in which a top is moved: powers of two, so that results scale bit for bit
 * with powers of two of mass, length and time. */
#ifndef KR_SCENE_H
#define KR_SCENE_H
#include "body.h"
#include "numbers/binary.h"

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

/* What the unit of time follows from: the unit of moment, and the rate of a pendulum [T^-1]. */
typedef struct kr_swing {
    double moment, rate;
} kr_swing;
kr_swing kr_scene_swing(const kr_scene *scene, const kr_working *working);
/* What is less has no reciprocal. */
static const double kr_least_unit = 0x1p-1020;
/* Gives the unit of time of a top with this largest component of its momentum, or 0 for one that has
 * none. */
static inline double kr_swing_time(kr_swing swing, double momentum)
{
    const double turn = momentum / swing.moment, rate = turn > swing.rate ? turn : swing.rate;
    if (!(rate < INFINITY) || swing.moment < kr_least_unit) return 0.0;
    const double least = rate > kr_least_unit ? rate : kr_least_unit,
                 time = rate > 0.0 ? 1.0 / next_power_of_2(least) : 1.0, unit = swing.moment / time;
    return unit < INFINITY && unit >= kr_least_unit ? time : 0.0;
}
kr_status kr_scene_units(const kr_scene *scene, const kr_working *working, kr_units *units);
/* Gives kr_scene_horizon where these are known. */
double kr_units_horizon(const kr_units *units, const kr_scene *scene, const kr_working *working);
#endif
