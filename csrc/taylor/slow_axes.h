/* The axes about which damping is strong, and constants of the steps on the slow manifold (slow.c).
 * Private to slow.c. */
#ifndef KR_TAYLOR_SLOW_AXES_H
#define KR_TAYLOR_SLOW_AXES_H
#include <string.h>
#include "math/dd.h"
#include "support_motion.h"

/* Only friction and moving supports have rows for U, O, G and G P. ROW_R contains the u_i of a held
 * top (slow_held.h). */
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
    ROWS = KR_HAS_SUPPORTS ? 22 : ROWS_AT_REST,
    SWEEPS = 64
};
/* The rows of U and of G P. */
#define U_OF(slow) (KR_HAS_SUPPORTS && (slow)->turns ? ROW_U : ROW_W)
#define GP_OF(slow) (KR_HAS_SUPPORTS && (slow)->shakes ? ROW_GP : ROW_P)
/* Damping about some axes is strong if its rate exceeds all other rates by this factor.
 * STRONG_ALONE is the factor if damping is strong about all three axes, because the other rates are
 * then only those of the undamped motion. */
#define STRONG 256.0
#define STRONG_ALONE 32.0
/* An angular velocity below this fraction of the rate of damping counts as zero. */
#define TINY_VELOCITY 0x1p-400
#define LOG2_AT_REST 900.0
/* An angular velocity below this fraction of the largest one need not be accurate. The angular
 * velocity of the support is rounded, so that U is not accurate below this fraction of it. */
#define NEGLIGIBLE 0x1p-64
#define ROUNDED 0.25
/* Differences of doubles may have errors of this fraction of their terms. */
#define ROUNDING 0x1p-50
/* After this part of the time in which damping takes the motion to the slow manifold, it is
 * compared with the manifold again. */
#define PATIENCE 0.5
#define LOG_OF_2 0.6931471805599453

/* The slow axes, which are the axes about which damping is strong, and rates in the units of the
 * motion. `rate` is the largest rate of the motion on the slow manifold, and `fall` the largest
 * rate at which a top falls there. */
typedef struct held_directions held_directions;
typedef struct slow_axes {
    int is_slow[3], has_rotor, turns, shakes, slides;
    /* The directions that replace the axes while friction holds the top, otherwise NULL. */
    const held_directions *held;
    double rate, fall;
    /* The response of the angular velocities about the slow axes to a torque. Each torque is such
     * that without the rotor, which couples the axes, its angular velocity would be 1. */
    double gain[3][3];
} slow_axes;

/* Returns the angular velocity of the support about an axis. */
static inline double turning_about(const kr_series *s, const slow_axes *slow, int axis)
{
    return KR_HAS_SUPPORTS && slow->turns ? s->turn[axis + 1] : 0.0;
}
/* Returns the largest size of G. */
static inline double largest_pull(const kr_series *s)
{
    return KR_HAS_SUPPORTS && s->linear > 1.0 ? fabs(s->sway[3]) + fabs(s->sway_most) : 1.0;
}
#endif
