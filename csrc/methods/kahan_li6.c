/* A composition of nine Strang steps (splitting.h) with the coefficients of Kahan and Li
 * (compose.h). The method conserves the vertical momentum. For Lagrange tops and torque-free
 * symmetric bodies, the method also conserves the momentum about the symmetry axis. The energy
 * error is bounded and of order h^6. */
#include "composed.h"

static kr_status kahan_li6_reset(kr_motion *motion, const kr_state *start)
{
    return composed_begin(motion, start, KAHAN_LI6);
}

const kr_method kr_method_kahan_li6 = {
    .name = "kahan_li6",
    .text = "composition of 9 steps of kick, free drift, kick",
    .conserves = "<m,e3>; on Lagrange tops <m,apex>",
    .reference = "Kahan and Li 1997",
    .order = 6,
    .flags = KR_METHOD_SYMPLECTIC | KR_METHOD_REVERSIBLE | KR_METHOD_ALGEBRAIC |
             KR_METHOD_SPLITTING | KR_METHOD_ROTORS | KR_METHOD_TURNING | KR_METHOD_GRADIENT,
    .work = COMPOSED_WORK,
    .reset = kahan_li6_reset,
    .step = composed_step,
    .read = composed_read,
    .is_valid = composed_is_valid,
};
