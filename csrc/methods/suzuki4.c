/* A composition of five Strang steps with Suzuki's coefficients (composition.h). */
#include "composition.h"

COMPOSED_METHOD(suzuki4, SUZUKI4, 4, 0, "composition of 5 steps of kick, free drift, kick",
                "Suzuki 1990")
