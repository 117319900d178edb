/* Strong damping: steps on the slow manifold. Private to taylor/. */
#ifndef KR_TAYLOR_SLOW_H
#define KR_TAYLOR_SLOW_H
#include "taylor.h"

/* Makes the next step of a motion forward in time on the slow manifold, where its damping is strong
 * and the motion has come there. Returns 0 where it has not: then the next piece is one of the
 * kernel's, to the tolerance that is written. */
int kr_slow_step(kr_motion *motion, const kr_kernel *kernel, double *log2_tol);
#endif
