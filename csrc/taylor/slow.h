/* Steps of strongly damped motions on the slow manifold. Private to taylor/. */
#ifndef KR_TAYLOR_SLOW_H
#define KR_TAYLOR_SLOW_H
#include "taylor.h"

struct kr_support_ops;
/* Finds the directions about which damping may be strong if friction holds the top
 * (slow_directions.h). */
void kr_slow_find_held(const kr_motion *motion, struct slow_directions *slow);
/* Computes the next step of a strongly damped motion on the slow manifold, forward in time.
 * `supports` is NULL if the series has no terms of a support. Returns 0 if the motion has not
 * reached the slow manifold. If the result is 0, the caller must compute the step with `kernel` and
 * the tolerance written to `log2_tol`. */
int kr_slow_step(kr_motion *motion, const kr_kernel *kernel, const struct kr_support_ops *supports,
                 double *log2_tol);
/* Returns 0 only if damping is not strong in any step from now until the clock `until`, for a
 * top on a support at rest. Backward in time, the result is 1, because damping may accelerate
 * the top without bound. */
int kr_slow_is_possible(const kr_motion *motion, double until);
/* Returns 1 if the top rotates by more than 2^53 rad before the time `until`. Fast rotations are
 * possible backward in time, where damping accelerates the top. */
int kr_slow_drives_apart(const kr_motion *motion, double until);
/* Returns 1 if a damped top turns too fast for a series of the given order, now or before the time
 * `until`. Taylor coefficients can overflow only backward in time, where damping accelerates the
 * top. */
int kr_slow_overflows(const kr_motion *motion, int order, double until);
#endif
