/* Replacements of libm functions in the set-up of the closed form, compared with libm. */
#include <float.h>
#include "check.h"
#include "exact/phase.h"
#include "exact/theta.h"
#include "math/exponent.h"
#include "random.h"

static double of_any_size(double least, double most) { return pow(10.0, uniform(least, most)); }

/* Arguments are accurate to a few units in the last place of a turn, and exact at multiples of an
 * eighth. */
static void test_arguments(void)
{
    const double pi = 3.14159265358979323846;
    double worst = 0.0;
    for (int i = 0; i < 20000; i++) {
        const double x = uniform(-1, 1) * of_any_size(-8, 0), y = uniform(-1, 1);
        const dd turns = turns_of(y, x);
        const double apart = (turns.hi + turns.lo) - atan2(y, x) / (2.0 * pi);
        worst = fmax(worst, fabs(apart - rint(apart)));
    }
    NEAR(worst, 0.0, 2.5e-16);
    for (int i = -4; i < 5; i++) {
        const double x[] = {-1, -1, 0, 1, 1, 1, 0, -1, -1}, y[] = {0, -1, -1, -1, 0, 1, 1, 1, 0};
        const dd turns = turns_of(y[i + 4], x[i + 4]);
        const double apart = turns.hi - i / 8.0;
        NEAR(apart, rint(apart), 0.0);
    }
    IS(turns_of(0.0, 0.0).hi == 0.0);
}
static void test_small_arguments(void)
{
    for (int i = 0; i < 1000; i++) {
        const double y = uniform(-1, 1) * of_any_size(-300, -10);
        NEAR(turns_of(y, 1.0).hi / y, 0.15915494309189534, 1e-16);
    }
}
static void test_exponentials(void)
{
    for (int i = 0; i < 20000; i++) {
        const double y = uniform(-1, 1) * of_any_size(-20, 2.3);
        double s, c;
        sinhcosh_all(y, &s, &c);
        NEAR(s / sinh(y), 1.0, 8.0 * DBL_EPSILON);
        NEAR(c / cosh(y), 1.0, 8.0 * DBL_EPSILON);
    }
    for (double a = -690.0; a < 0.0; a += 0.37) {
        const exponential e = exponential_of(dd_of(a));
        NEAR(e.plus * (e.even + e.odd) / exp(a), 1.0, 4.0 * DBL_EPSILON);
    }
}
static void test_cube_roots(void)
{
    for (double c = 0.0; c <= 1.0; c += 1.0 / 4096)
        NEAR(third_of_angle(c), cos(acos(c) / 3.0), 2.0 * DBL_EPSILON);
}
/* Powers of two are exact in the whole range; libm is called near its ends. */
static void test_powers_of_two(void)
{
    const double ends[] = {0.0, -0.0, 0x1p-1074, 0x1.8p-1030, 0x1p-1022, DBL_MAX, -0x1p1023};
    for (int i = 0; i < 20000; i++) {
        const double x = i < 7 ? ends[i] : uniform(-1, 1) * of_any_size(-320, 308);
        const int power = (int)uniform(-2200, 2200);
        int exponent = 1, expected = 2;
        IS(fraction_of(x, &exponent) == frexp(x, &expected) && exponent == expected);
        IS(times_power_of_2(x, power) == ldexp(x, power));
        IS(x == 0.0 || exponent_of(x) == ilogb(x));
    }
    IS(power_above(1.0) == 1 && power_above(0.0) == 0 && power_above(DBL_MAX) == 1023);
    IS(fraction_of(INFINITY, &(int){0}) == INFINITY);
}
/* Quotients and sums with fewer operations are equally accurate. */
static void test_short_forms(void)
{
    for (int i = 0; i < 20000; i++) {
        const dd a = two_sum(uniform(-1, 1), 1e-17 * uniform(-1, 1)),
                 b = two_sum(of_any_size(-100, 100), 0.0);
        const dd quotient = dd_div(a, b), sum = dd_add(a, quotient);
        NEAR(dd_sub(dd_over(a, b), quotient).hi / quotient.hi, 0.0, 1e-31);
        NEAR(dd_sub(dd_add_near(a, quotient), sum).hi / (fabs(a.hi) + fabs(quotient.hi)), 0.0,
             1e-31);
    }
}
int main(void)
{
    test_arguments();
    test_small_arguments();
    test_exponentials();
    test_cube_roots();
    test_powers_of_two();
    test_short_forms();
    return check_result();
}
