/* A composition of seventeen Strang steps (splitting.h) with the coefficients of Kahan and Li
 * (compose.h). The method conserves the vertical momentum. For Lagrange tops and torque-free
 * symmetric bodies, the method also conserves the momentum about the symmetry axis. The energy
 * error is bounded and of order h^8. */
#include "composed.h"

COMPOSED_METHOD(kahan_li8, KAHAN_LI8, 8, 0, "composition of 17 steps of kick, free drift, kick",
                "Kahan and Li 1997")
