/* Step control: the choice of steps and rows changes no result beyond the tolerance. A wrong choice
 * affects only the number of evaluations. */
#include "tops.h"

static double cost(const char *method, const kr_scene *s, double tol, double first, double t)
{
    const kr_config config = {.tol = tol, .step = first};
    kr_top *top = make(s, kr_method_find(method), config);
    IS(kr_top_advance(top, t) == KR_OK);
    const kr_stats stats = kr_top_stats(top);
    kr_top_free(top);
    return (double)(stats.evaluations + stats.rejected);
}
static void test_costs(const char *method, const double wanted[3][4], double within)
{
    kr_scene tops[3] = {tilted(), asymmetric(), tilted()};
    tops[2].body = general_body();
    tops[2].gravity = 9.81;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            const double tol = pow(10.0, -4.0 - 3.0 * j);
            const double number = cost(method, &tops[i], tol, 0.0, 100.0);
            NEAR(number / wanted[i][j], 1.0, within);
        }
}

/* A first step that is far too long is abandoned before all rows are tried. */
static void test_long_first_step(const char *method, const double wanted[4])
{
    const kr_scene s = asymmetric();
    for (int i = 0; i < 4; i++) {
        const double number = cost(method, &s, 1e-9, pow(10.0, i), 100.0);
        NEAR(number / wanted[i], 1.0, 0.002);
    }
}

/* With the loosest tolerances a run begins with the fewest rows. */
static void test_loosest_tolerance(const char *method, const double wanted[2])
{
    const kr_scene s = asymmetric();
    for (int i = 0; i < 2; i++)
        NEAR(cost(method, &s, 0.15, 0.2 * (1 + i), 5.0) / wanted[i], 1.0, 0.02);
}

/* After a failed attempt, the target of the next one is the previous row if this needs less
 * work. */
static void test_after_a_failure(const char *method, const double wanted[2])
{
    kr_scene s = tilted();
    s.body = general_body();
    s.gravity = 9.81;
    NEAR(cost(method, &s, 1e-2, 1.0, 5.0) / wanted[0], 1.0, 0.01);
    NEAR(cost(method, &s, 1e-9, 10.0, 5.0) / wanted[1], 1.0, 0.01);
}

int main(void)
{
    const double space_frame[3][4] = {
        {3510, 6252, 9974, 14235}, {3423, 6057, 10095, 14821}, {10452, 19911, 31117, 46768}};
    const double kirchhoff[3][4] = {
        {2784, 4881, 8008, 11045}, {2743, 4381, 7604, 10757}, {8333, 15883, 25367, 37396}};
    const double series[3][4] = {{116, 158, 159, 151}, {120, 166, 170, 163}, {424, 575, 600, 572}};
    test_costs("extrap", space_frame, 0.01);
    test_costs("extrap_kirchhoff", kirchhoff, 0.01);
    test_costs("taylor", series, 0.03); /* in some cases the order depends on the last bits */
    const double first[2][4] = {{8684, 8787, 8676, 8541}, {6789, 6889, 6870, 6876}};
    test_long_first_step("extrap", first[0]);
    test_long_first_step("extrap_kirchhoff", first[1]);
    const double few[2][2] = {{82, 79}, {58, 47}};
    test_loosest_tolerance("extrap", few[0]);
    test_loosest_tolerance("extrap_kirchhoff", few[1]);
    const double failed[2][2] = {{349, 1633}, {240, 1314}};
    test_after_a_failure("extrap", failed[0]);
    test_after_a_failure("extrap_kirchhoff", failed[1]);
    return check_result();
}
