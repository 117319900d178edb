/* A splitting method of order 6 with 14 kicks and 15 drifts, using the Runge-Kutta-Nystrom
 * coefficients of Blanes and Moan (compose.h). The coefficients are valid only if the drift is
 * exact, which requires two equal moments of inertia. The method conserves the vertical component
 * of the angular momentum.
 * For Lagrange tops and torque-free bodies, the method also conserves the momentum about the
 * symmetry axis. The energy error is bounded and O(h^6). */
#include "composed.h"

static kr_status blanes_moan6_reset(kr_motion *motion, const kr_state *start)
{
    return composed_begin(motion, start, BLANES_MOAN6);
}

const kr_method kr_method_blanes_moan6 = {
    .name = "blanes_moan6",
    .text = "14 kicks between exact free drifts, for bodies with two equal moments",
    .conserves = "<m,e3>; on Lagrange tops <m,apex>",
    .reference = "Blanes and Moan 2002, SRKN 14",
    .order = 6,
    .flags = KR_METHOD_SYMPLECTIC | KR_METHOD_REVERSIBLE | KR_METHOD_ALGEBRAIC |
             KR_METHOD_SPLITTING | KR_METHOD_ROTORS | KR_METHOD_TURNING | KR_METHOD_GRADIENT |
             KR_METHOD_SYMMETRIC_ONLY,
    .work = COMPOSED_WORK,
    .reset = blanes_moan6_reset,
    .step = composed_step,
    .read = composed_read,
    .is_valid = composed_is_valid,
};
