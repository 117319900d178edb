/* Set-up of the closed forms: cubics with coinciding roots, vanishing slopes, and
 * arithmetic-geometric means that do not converge. */
#include "check.h"
#include "exact/theta.h"
#include "random.h"

static dd pair(double a) { return dd_of(a); }
/* The lone root of a cubic with roots of any size is found on either side of the others. If all
 * three roots coincide, their common value is returned. */
static void test_lone_roots(void)
{
    int top = -1;
    NEAR(lone_root(-3.0, 3.0, -1.0, &top), 1.0, 0.0);
    IS(top == 1);
    for (double size = 1e-40; size < 1e41; size *= 1e10) {
        NEAR(lone_root(-6.0 * size, 9.0 * size * size, -4.0 * size * size * size, &top) / size, 4.0,
             1e-7);
        IS(top == 1);
        NEAR(lone_root(-9.0 * size, 24.0 * size * size, -16.0 * size * size * size, &top) / size,
             1.0, 1e-7);
        IS(top == 0);
        NEAR(lone_root(-7.0 * size, 14.0 * size * size, -8.0 * size * size * size, &top) / size,
             4.0, 1e-14);
        IS(top == 1);
    }
}
/* Newton's method leaves a start with slope zero unchanged. The iteration for a mean ends even if
 * it does not converge. */
static void test_means_without_convergence(void)
{
    const dd square[3] = {pair(-1.0), pair(0.0), pair(0.0)};
    NEAR(newton_cubic(pair(1.0), square, 0.0).hi, 0.0, 0.0);
    NEAR(newton_cubic(pair(1.0), square, 1.0625).hi, 1.0, 1e-3);
    NEAR(elliptic_agm(1.0, 0.0), 0.0, 1e-12);
    NEAR(elliptic_agm(1.0, 1.0), 1.0, 0.0);
}
/* Returns the mean, and writes the sum of Q_n, after so many steps that further steps change
 * nothing. */
static dd all_steps(dd kp, dd p2, dd *sum)
{
    dd a = dd_of(1.0), g = kp, p = dd_sqrt(p2), q = a;
    *sum = q;
    for (int step = 0; step < 60; step++) {
        const dd ag = dd_mul(a, g), both = dd_add(dd_square(p), ag);
        const dd e = dd_div(dd_sub(dd_square(p), ag), both);
        q = dd_half(dd_mul(q, e));
        *sum = dd_add(*sum, q);
        p = dd_div(both, dd_twice(p));
        a = dd_half(dd_add(a, g));
        g = dd_sqrt(ag);
    }
    return a;
}
/* Integrals of the third kind are accurate, whichever step of the iteration is the last. */
static void test_means(void)
{
    for (int i = 0; i < 20000; i++) {
        const double near = i % 2 ? 1.0 : pow(10.0, -uniform(0.0, 12.0));
        const dd kp = dd_of(1.0 - near * uniform(0.0, 0.99));
        const dd start[2] = {dd_of(1.0 - near * uniform(0.0, 0.99)),
                             dd_of(1.0 + near * uniform(0.0, 2.0))};
        dd sum[2], truth;
        const dd mean = elliptic_mean(kp, 2, start, sum);
        for (int k = 0; k < 2; k++) {
            NEAR(dd_sub(mean, all_steps(kp, start[k], &truth)).hi, 0.0, 1e-31);
            NEAR(dd_sub(sum[k], truth).hi, 0.0, 1e-30);
        }
    }
}

int main(void)
{
    (void)elliptic_rf, (void)theta_stretch;
    (void)theta_series, (void)theta_scale, (void)theta_at;
    test_lone_roots();
    test_means_without_convergence();
    test_means();
    return check_result();
}
