/* A composition of nine Strang steps (splitting.h) with the coefficients of Kahan and Li
 * (compose.h). The method conserves the vertical momentum. For Lagrange tops and torque-free
 * symmetric bodies, the method also conserves the momentum about the symmetry axis. The energy
 * error is bounded and of order h^6. */
#include "composed.h"

COMPOSED_METHOD(kahan_li6, KAHAN_LI6, 6, 0, "composition of 9 steps of kick, free drift, kick",
                "Kahan and Li 1997")
