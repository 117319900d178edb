/* Steps of strongly damped motions. Private to taylor/. Damping about an axis is strong if its rate
 * is much larger than all other rates of the motion (STRONG in slow_directions.h). After a
 * transient, the damping torque about this axis balances all other torques: the motion stays on a
 * slow manifold (slow.c). The time `until` is a value of kr_motion.clock (method.h). Backward in
 * time, damping accelerates the top. */
#ifndef KR_TAYLOR_SLOW_H
#define KR_TAYLOR_SLOW_H
#include "taylor.h"

struct kr_support_ops;
/* Writes to `slow` the directions v_i while friction holds the top (slow_directions.h). */
void kr_slow_find_held(const kr_motion *motion, struct slow_directions *slow);
/* If the next step lies on a slow manifold (forward in time only), computes it and returns 1. Else
 * returns 0 and writes *log2_tol: the caller must compute the step with `kernel` and this
 * tolerance. `supports` is NULL without friction, moving support and gravity gradient. */
int kr_slow_step(kr_motion *motion, const kr_kernel *kernel, const struct kr_support_ops *supports,
                 double *log2_tol);
/* For tops without friction on a support at rest. Returns 0 if damping is certainly not strong in
 * any step from now to the time `until`, else 1. Does not test backward motions: returns 1. */
int kr_slow_is_possible(const kr_motion *motion, double until);
/* Returns 1 if the top certainly rotates by more than 2^53 rad before `until` (backward only). */
int kr_slow_drives_apart(const kr_motion *motion, double until);
/* Returns 1 if a series of this order overflows now or before `until` (backward only). */
int kr_slow_overflows(const kr_motion *motion, int order, double until);
#endif
