/* A composition of five Strang steps (splitting.h) with Suzuki's coefficients (compose.h). The
 * method conserves the vertical component of the angular momentum. For Lagrange tops and
 * torque-free symmetric bodies, the method also conserves the momentum about the symmetry axis. The
 * energy error is bounded and O(h^4). */
#include "composed.h"

COMPOSED_METHOD(suzuki4, SUZUKI4, 4, 0, "composition of 5 steps of kick, free drift, kick",
                "Suzuki 1990")
