/* A composition of 17 Strang steps with the coefficients of Kahan and Li (composition.h). */
#include "composition.h"

COMPOSED_METHOD(kahan_li8, KAHAN_LI8, 8, 0, "composition of 17 steps of kick, free drift, kick",
                "Kahan and Li 1997")
