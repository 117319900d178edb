/* Declares the struct slow_axes and the constants for steps on the slow manifold (slow.c). Private
 * to slow.c. */
#ifndef KR_TAYLOR_SLOW_AXES_H
#define KR_TAYLOR_SLOW_AXES_H
#include <string.h>
#include "math/dd.h"
#include "support_setup.h"

/* Rows of the table of Taylor coefficients in slow_terms.h. The table rows from ROW_U on are used
 * only for tops with friction or on moving supports. The table rows from ROW_R on hold the Taylor
 * coefficients of the velocities u_i (slow_held.h). */
enum {
    ROW_Q = 0,
    ROW_P = 4,
    ROW_W = 7,
    ROWS_AT_REST = 10,
    ROW_U = 10,
    ROW_O = 13,
    ROW_G = 16,
    ROW_GP = 17,
    ROW_R = 20,
    ROWS = 22,
    SWEEPS = 64
};
/* U_OF and GP_OF select the rows of the relative angular velocity and of the effective gravity
 * vector. */
#define U_OF(slow) ((slow)->turns ? ROW_U : ROW_W)
#define GP_OF(slow) ((slow)->shakes ? ROW_GP : ROW_P)
/* Damping about an axis is strong if its rate is more than STRONG times all other rates. If all
 * three axes are strongly damped, the smaller factor STRONG_ALONE is used instead of STRONG. */
#define STRONG 256.0
#define STRONG_ALONE 32.0
/* An angular velocity below TINY_VELOCITY, in the units of the series, counts as zero. */
#define TINY_VELOCITY 0x1p-400
#define LOG2_AT_REST 900.0
/* Errors of an angular velocity are relative to its magnitude, or to NEGLIGIBLE times the largest
 * angular velocity if that is larger. On a rotating support, errors are relative to at least
 * ROUNDED times the support's angular velocity, because this velocity has rounding errors. */
#define NEGLIGIBLE 0x1p-64
#define ROUNDED 0.25
/* Rounding error of the difference between two doubles, relative to the larger of them. */
#define ROUNDING 0x1p-50
/* If the motion has not reached the slow manifold, the test is repeated after PATIENCE times the
 * estimated time to reach it. */
#define PATIENCE 0.5
/* A transient has decayed after SETTLED times the damping time, because exp(-SETTLED) is below the
 * rounding errors of a double-double. */
#define SETTLED 128.0
/* A distance from the slow manifold that no motion exceeds, relative to the angular velocity. */
#define UNRESOLVED 0x1p500
#define LOG_OF_2 0.6931471805599453

/* Data of the strongly damped axes, in the units of the motion. `rate` is the largest rate of the
 * motion on the slow manifold, and `fall` is the largest rate at which the top falls over or its
 * support shakes. */
typedef struct held_directions held_directions;
typedef struct slow_axes {
    int is_slow[3], has_rotor, turns, shakes, slides;
    const struct kr_slow_kind *kind;
    const kr_support_ops *supports; /* NULL: the series has no terms of a support */
    /* Directions that replace the principal axes while friction holds the top; otherwise NULL. */
    const held_directions *held;
    double rate, fall;
    /* Matrix of the angular velocities about the strongly damped axes that result from normalized
     * torques. Each torque is normalized so that it causes the angular velocity 1 if no rotor
     * couples the axes. */
    double gain[3][3];
} slow_axes;

/* How damping acts: about the principal axes or, if friction holds the top, about the directions of
 * slow_held.h. */
struct kr_slow_kind {
    int count; /* of axes or directions */
    /* Finds the directions. NULL for the principal axes. */
    void (*find)(const kr_motion *motion, held_directions *held);
    /* Marks as strongly damped all axes but the `rank` with the weakest damping. Returns 1
     * if their damping dominates all effects with rates up to `undamped` and torques up to
     * `pull`. */
    int (*take)(const kr_motion *motion, int rank, double undamped, double pull, slow_axes *slow);
    /* Returns the smallest nonzero angular velocity about a strongly damped axis, or a negligible
     * velocity if that is larger. */
    double (*least_size)(const kr_series *s, const slow_axes *slow);
    /* Returns the damping rate about axis i, in the unit of time of the Taylor series. */
    double (*drag)(const kr_series *s, const slow_axes *slow, int i);
    /* Returns 1 if the motion is close enough to the slow manifold to attempt an expansion. Angular
     * velocities up to `noise` are treated as zero, and may differ from those on the slow manifold
     * by the fraction `share`. */
    int (*is_near)(const kr_series *s, const slow_axes *slow, double noise, double share);
    /* Expands the motion on the slow manifold about the end of the last step (slow_terms.h). */
    int (*expand)(kr_taylor *p, const kr_motion *motion, int order, const slow_axes *slow,
                  double near, double *wait);
};

/* Returns the component of the support's angular velocity along a body axis. */
static inline double turning_about(const kr_series *s, const slow_axes *slow, int axis)
{
    return slow->turns ? s->turn[axis + 1] : 0.0;
}
/* Returns the largest magnitude of the effective gravity G. */
static inline double largest_pull(const kr_series *s)
{
    return s->linear > 1.0 ? fabs(s->sway[3]) + fabs(s->sway_most) : 1.0;
}
#endif
