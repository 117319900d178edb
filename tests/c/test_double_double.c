/* Elementary functions and Carlson's R_F in double-double, compared with mpmath at 240-bit
 * precision. Each reference value is a pair of doubles. An error of these functions shows in a
 * motion only after about 1e6 steps. */
#include "check.h"
#include "math/dd_functions.h"

static dd pair(double hi, double lo) { return dd_make(hi, lo); }
static double apart(dd a, dd b) { return fabs(dd_sub(a, b).hi / (b.hi == 0.0 ? 1.0 : b.hi)); }
/* Carlson's integral R_F(x, x, x) is 1 / sqrt(x), and R_F is homogeneous of degree -1/2. */
static void test_carlson(void)
{
    const struct {
        double x, y, z;
        dd value;
    } of[] = {
        {0.0, 1.0, 2.0, {0x1.4f9f94f9f50b0p+0, 0x1.b9e61ddaeb023p-54}},
        {2.0, 3.0, 4.0, {0x1.2b0ce7fe50f42p-1, -0x1.4d6d0cdcadb8ap-55}},
        {0x1p-20, 1.0, 1.0, {0x1.91dfc1d29667ap+0, 0x1.67c6d1cb859b3p-54}},
        {0.125, 64.0, 3.0, {0x1.609c58e29a28dp-2, -0x1.823046c5b0fefp-58}},
        {4.0, 4.0, 4.0, {0.5, 0.0}},
    };
    for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
        const dd x = dd_of(of[i].x), y = dd_of(of[i].y), z = dd_of(of[i].z);
        const dd four = dd_of(0x1p-10);
        NEAR(apart(dd_rf(x, y, z), of[i].value), 0.0, 1e-29);
        NEAR(apart(dd_rf(z, x, y), of[i].value), 0.0, 1e-29);
        NEAR(apart(dd_rf(dd_mul(four, x), dd_mul(four, y), dd_mul(four, z)),
                   dd_scale(0x1p5, of[i].value)),
             0.0, 1e-29);
    }
}
static void test_angles(void)
{
    const struct {
        double y, x;
        dd value;
    } of[] = {
        {1.0, 2.0, {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56}},
        {-3.0, 0.25, {-0x1.7cd6f6dc59db4p+0, -0x1.69c1fed612cfcp-54}},
        {1.0, -1e-9, {0x1.921fb5488e548p+0, -0x1.8cc0cdfb03671p-56}},
        {-2.0, -5.0, {-0x1.616b466d73d60p+1, -0x1.3e5b971a806d0p-53}},
        {0.0, -1.0, {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53}},
    };
    for (size_t i = 0; i < sizeof of / sizeof *of; i++)
        NEAR(apart(dd_atan2(dd_of(of[i].y), dd_of(of[i].x)), of[i].value), 0.0, 1e-30);
    /* The low words matter, and a vector of length zero has no direction. */
    NEAR(apart(dd_atan2(pair(1.0, 0x1p-60), dd_of(1.0)),
               dd_add(dd_scale(0.25, dd_pi()), dd_of(0x1p-61))),
         0.0, 1e-30);
    IS(dd_atan2(dd_of(0.0), dd_of(0.0)).hi == 0.0);
}
static void test_sines(void)
{
    const struct {
        double angle;
        dd sine, cosine;
    } of[] = {
        {0.5,
         {0x1.eaee8744b05f0p-2, -0x1.789b43c9b027dp-58},
         {0x1.c1528065b7d50p-1, -0x1.892111312e828p-55}},
        {-3.0,
         {-0x1.210386db6d55bp-3, -0x1.3c7205d08d063p-57},
         {-0x1.fae04be85e5d2p-1, -0x1.83effc17efb54p-55}},
        {1e-5,
         {0x1.4f8b588e1e8a2p-17, 0x1.75b30450b875ep-71},
         {0x1.ffffffff920c8p-1, 0x1.3149f1007a5f5p-58}},
        {3.75,
         {-0x1.24a3af6750621p-1, -0x1.a3d145c0f88eap-55},
         {-0x1.a4205b28667f7p-1, 0x1.431eff5650152p-55}},
    };
    for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
        dd s, c;
        dd_sincos(dd_of(of[i].angle), &s, &c);
        NEAR(apart(s, of[i].sine), 0.0, 2e-29);
        NEAR(apart(c, of[i].cosine), 0.0, 2e-29);
    }
}
static void test_exponentials(void)
{
    const struct {
        double power;
        dd value;
    } of[] = {
        {1.0, {0x1.5bf0a8b145769p+1, 0x1.4d57ee2b1013ap-53}},
        {-3.75, {0x1.81509354f0d29p-6, 0x1.75db52f890742p-60}},
        {0.03125, {0x1.08205601127edp+0, -0x1.9c7d0bdf15160p-54}},
        {300.0, {0x1.c05c0a7166b4ap+432, 0x1.cf59a9e7d8cb5p+378}},
        {-500.5, {0x1.e8222ed342a1ep-723, -0x1.35a86ac77f1f1p-778}},
    };
    for (size_t i = 0; i < sizeof of / sizeof *of; i++)
        NEAR(apart(dd_exp(dd_of(of[i].power)), of[i].value), 0.0, 3e-29);
    IS(!isfinite(dd_exp(dd_of(1e36)).hi) && isnan(dd_exp(dd_of(NAN)).hi));
}
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
    test_carlson();
    test_angles();
    test_sines();
    test_exponentials();
    test_arithmetic();
    return check_result();
}
