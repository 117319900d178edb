/* A composition of seventeen Strang steps (splitting.h) with the coefficients of Kahan and Li
 * (compose.h). The method conserves the vertical momentum. For Lagrange tops and torque-free
 * symmetric bodies, the method also conserves the momentum about the symmetry axis. The energy
 * error is bounded and of order h^8. */
#include "composed.h"

static kr_status kahan_li8_reset(kr_motion *motion, const kr_state *start)
{
    return composed_begin(motion, start, KAHAN_LI8);
}

const kr_method kr_method_kahan_li8 = {
    .name = "kahan_li8",
    .text = "composition of 17 steps of kick, free drift, kick",
    .conserves = "<m,e3>; on Lagrange tops <m,apex>",
    .reference = "Kahan and Li 1997",
    .order = 8,
    .flags = KR_METHOD_SYMPLECTIC | KR_METHOD_REVERSIBLE | KR_METHOD_ALGEBRAIC |
             KR_METHOD_SPLITTING | KR_METHOD_ROTORS | KR_METHOD_TURNING | KR_METHOD_GRADIENT,
    .work = COMPOSED_WORK,
    .reset = kahan_li8_reset,
    .step = composed_step,
    .read = composed_read,
    .is_valid = composed_is_valid,
};
