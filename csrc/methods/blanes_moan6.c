/* A splitting method of order 6 with 14 kicks and 15 drifts, using the Runge-Kutta-Nystrom
 * coefficients of Blanes and Moan (compose.h). The coefficients are valid only if the drift is
 * exact, which requires two equal moments of inertia. The method conserves the vertical component
 * of the angular momentum.
 * For Lagrange tops and torque-free bodies, the method also conserves the momentum about the
 * symmetry axis. The energy error is bounded and O(h^6). */
#include "composed.h"

COMPOSED_METHOD(blanes_moan6, BLANES_MOAN6, 6, KR_METHOD_SYMMETRIC_ONLY,
                "14 kicks between exact free drifts, for bodies with two equal moments",
                "Blanes and Moan 2002, SRKN 14")
