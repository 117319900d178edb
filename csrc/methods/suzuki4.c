/* A composition of five Strang steps (splitting.h) with Suzuki's coefficients (compose.h). The
 * method conserves the vertical component of the angular momentum. For Lagrange tops and
 * torque-free symmetric bodies, the method also conserves the momentum about the symmetry axis. The
 * energy error is bounded and O(h^4). */
#include "composed.h"

static kr_status suzuki4_reset(kr_motion *motion, const kr_state *start)
{
    return composed_begin(motion, start, SUZUKI4);
}

const kr_method kr_method_suzuki4 = {
    .name = "suzuki4",
    .text = "composition of 5 steps of kick, free drift, kick",
    .conserves = "<m,e3>; on Lagrange tops <m,apex>",
    .reference = "Suzuki 1990",
    .order = 4,
    .flags = KR_METHOD_SYMPLECTIC | KR_METHOD_REVERSIBLE | KR_METHOD_ALGEBRAIC |
             KR_METHOD_SPLITTING | KR_METHOD_ROTORS | KR_METHOD_TURNING | KR_METHOD_GRADIENT,
    .work = COMPOSED_WORK,
    .reset = suzuki4_reset,
    .step = composed_step,
    .read = composed_read,
    .is_valid = composed_is_valid,
};
