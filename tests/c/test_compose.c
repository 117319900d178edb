/* Compositions: their coefficients satisfy order conditions. test_convergence.c tests the orders of
 * the methods. */
#include "check.h"
#include "methods/compose.h"

static double power_sum(const composition *c, int power)
{
    double sum = 0.0;
    for (int i = 0; i < c->stages; i++) sum += pow(c->drift[i], power);
    return sum;
}
/* The drifts and the kicks of a composition each add up to one step, and the composition is
 * palindromic. */
static void palindrome(const composition *c)
{
    const int last = c->stages - 1;
    double kicks = c->ahead + (c->kick[last] - c->ahead);
    for (int i = 0; i < last; i++) {
        kicks += c->kick[i];
        IS(c->kick[i] == c->kick[last - 1 - i]);
    }
    for (int i = 0; i <= last; i++) IS(c->drift[i] == c->drift[last - i]);
    NEAR(kicks, 1.0, 4e-16);
    NEAR(power_sum(c, 1), 1.0, 4e-16);
}
/* Returns the sum of drift^first * middle^second * cubes^third. `middle` is the middle of a step,
 * counted from the middle of the composition, and `cubes` the sum of the cubes of the drifts up to
 * it. */
static double mixed_sum(const composition *c, int first, int second, int third)
{
    double sum = 0.0, time = -0.5, cubes = 0.0;
    for (int i = 0; i < c->stages; i++) {
        const double a = c->drift[i], half = 0.5 * a * a * a;
        sum += pow(a, first) * pow(time + 0.5 * a, second) * pow(cubes + half, third);
        time += a;
        cubes += 2.0 * half;
    }
    return sum;
}
/* The order conditions of a palindromic composition of symmetric steps of order 2. The sums of the
 * odd powers of their lengths vanish for powers from 3 to the order, but not for the next odd
 * power. From order 6 on, iterated sums vanish, too (Hairer, Lubich, Wanner V.3). */
static void test_strang_compositions(int row, int stages, int order)
{
    const composition c = compose(row);
    IS(c.stages == stages);
    palindrome(&c);
    for (int power = 3; power < order; power += 2) NEAR(power_sum(&c, power), 0.0, 2e-15);
    IS(fabs(power_sum(&c, order + 1)) > 1e-4);
    if (order >= 6) NEAR(mixed_sum(&c, 3, 2, 0), 0.0, 2e-15);
    if (order >= 8) {
        NEAR(mixed_sum(&c, 5, 2, 0), 0.0, 2e-15);
        NEAR(mixed_sum(&c, 3, 4, 0), 0.0, 2e-15);
        NEAR(mixed_sum(&c, 3, 1, 1), 0.0, 2e-15);
    }
    for (int i = 0; i + 1 < stages; i++)
        NEAR(c.kick[i], 0.5 * (c.drift[i] + c.drift[i + 1]), 1e-16);
}
/* The kicks b_i at the times c_i = a_1 + ... + a_i form a quadrature. The composition has order 6
 * only if the quadrature does. */
static void test_nystrom_compositions(void)
{
    const composition c = compose(BLANES_MOAN6);
    IS(c.stages == 15 && c.ahead == 0.0 && c.kick[14] == 0.0);
    palindrome(&c);
    for (int power = 0; power < 6; power++) {
        double sum = 0.0, time = 0.0;
        for (int i = 0; i < c.stages; i++) {
            time += c.drift[i];
            sum += c.kick[i] * pow(time, power);
        }
        NEAR(sum, 1.0 / (power + 1), 1e-14);
    }
}

int main(void)
{
    test_strang_compositions(SUZUKI4, 5, 4);
    test_strang_compositions(KAHAN_LI6, 9, 6);
    test_strang_compositions(KAHAN_LI8, 17, 8);
    test_nystrom_compositions();
    NEAR(compose(SUZUKI4).drift[0], 1.0 / (4.0 - cbrt(4.0)), 1e-16);
    return check_result();
}
