/* Step control: the choice of steps and rows changes no result beyond the tolerance. A wrong choice
 * affects only the number of evaluations. */
#include "tops.h"

static double cost(const char *method, const kr_scene *s, double tol, double t)
{
    const kr_config config = {.tol = tol};
    kr_top *top = make(s, kr_method_find(method), config);
    IS(kr_top_advance(top, t) == KR_OK);
    const kr_stats stats = kr_top_describe(top).stats;
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
            const double number = cost(method, &tops[i], tol, 100.0);
            NEAR(number / wanted[i][j], 1.0, within);
        }
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
    return check_result();
}
