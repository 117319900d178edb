/* A composition of nine Strang steps with the coefficients of Kahan and Li (composition.h). */
#include "composition.h"

COMPOSED_METHOD(kahan_li6, KAHAN_LI6, 6, 0, "composition of 9 steps of kick, free drift, kick",
                "Kahan and Li 1997")
