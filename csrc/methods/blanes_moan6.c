/* A splitting method of order 6 with 14 kicks and 15 drifts, using the Runge-Kutta-Nystrom
 * coefficients of Blanes and Moan (composition.h). The coefficients are valid only if the drift is
 * exact, which requires two equal moments of inertia. */
#include "composition.h"

COMPOSED_METHOD(blanes_moan6, BLANES_MOAN6, 6, KR_METHOD_SYMMETRIC_ONLY,
                "14 kicks between exact free drifts, for bodies with two equal moments",
                "Blanes and Moan 2002, SRKN 14")
