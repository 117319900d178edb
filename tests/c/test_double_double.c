/* Arithmetic in double-double. An error shows in a motion only after about 1e6 steps. */
#include "check.h"
#include "math/dd.h"

static dd pair(double hi, double lo) { return dd_make(hi, lo); }
static double apart(dd a, dd b) { return fabs(dd_sub(a, b).hi / (b.hi == 0.0 ? 1.0 : b.hi)); }
/* Roots, quotients and comparisons use the low words. */
static void test_arithmetic(void)
{
    const dd third = dd_div(dd_of(1.0), dd_of(3.0)), two = dd_of(2.0), root = dd_sqrt(two);
    NEAR(apart(dd_times(3.0, third), dd_of(1.0)), 0.0, 1e-31);
    NEAR(apart(dd_square(root), two), 0.0, 2e-31);
    NEAR(apart(dd_mul(root, dd_sqrt(pair(3.0, 0x1p-60))), dd_sqrt(pair(6.0, 0x1p-59))), 0.0, 2e-31);
    IS(dd_sqrt(dd_of(-1.0)).hi == 0.0 && dd_sqrt(dd_of(-1.0)).lo == 0.0);
    IS(dd_less(pair(1.0, -0x1p-60), dd_of(1.0)) && !dd_less(dd_of(1.0), pair(1.0, -0x1p-60)));
    IS(!dd_less(dd_of(1.0), dd_of(1.0)) && !dd_less(pair(2.0, 0.0), pair(1.0, 1e-17)));
    IS(dd_max(pair(1.0, -0x1p-60), dd_of(1.0)).lo == 0.0);
    IS(dd_abs(pair(-1.0, 0x1p-60)).lo == -0x1p-60 && dd_abs(two).hi == 2.0);
}

int main(void)
{
    test_arithmetic();
    return check_result();
}
