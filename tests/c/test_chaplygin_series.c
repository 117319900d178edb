/* Limits of the series of Goryachev-Chaplygin tops: slow terms, and full arrays. */
#ifdef __GNUC__
#  pragma GCC diagnostic ignored "-Wunused-function"
#endif
#include "check.h"
#include "exact/goryachev_chaplygin_series.h"

static kr_chaplygin_plan plan;
static series_work work;

/* A term becomes slow if its frequency is small or zero. Too many slow terms are refused. */
static void test_slow_terms(void)
{
    const heading_pair pair = {{1.0, 3.0}, {0.125, 0.0}};
    const int order[2] = {3, 5};
    const dd half[2] = {{0.0625, 0.0}, {0.125, 0.0}};
    double out[2];
    plan.is_even = 1;
    plan.slow_terms = 0;
    IS(make_pair(&plan, &pair, order, half, out));
    IS(plan.slow_terms == 2 && out[0] == 0.0 && out[1] == 0.0);
    const kr_slow_term *one = &plan.slow[0], *two = &plan.slow[1];
    IS(one->over == 8.0 && two->over == 0.0);
    IS(one->first == 3 && one->second == 5 && two->first == 3 && two->second == -5);
    NEAR(one->sine, sin(0.8125 * two_pi), 1e-15);
    NEAR(two->sine, sin(-0.4375 * two_pi), 1e-15);
    plan.slow_terms = SLOW_TERMS;
    IS(!make_pair(&plan, &pair, order, half, out));
    IS(plan.slow_terms == SLOW_TERMS);
}
/* Fills both grids with one number, and integrates them. */
static int integrate_grid(double value, const int M[2], double rate)
{
    const dd rates[2] = {{rate, 0.0}, {sqrt(2.0) * rate, 0.0}}, half[2] = {{0.0, 0.0}, {0.0, 0.0}};
    for (int g = 0; g < 2; g++)
        for (int i = 0; i < GRID_SAMPLES; i++) work.grid[g][i] = value;
    return fill_heading_rows(&plan, &work, M, rates, half);
}
/* A series fits if it has at most HEADING_TERMS coefficients and few slow terms. */
static void test_heading_terms(void)
{
    const int most[2] = {HEADING_TERMS / 512, 256}, more[2] = {HEADING_TERMS / 512 + 1, 256};
    IS(integrate_grid(1.0, most, 1e3));
    IS(plan.rows == most[0] && plan.wide == most[1] && plan.row[most[0] - 1].count == most[1]);
    IS(!integrate_grid(1.0, more, 1e3));
    IS(!integrate_grid(1.0, most, 1e-6));
    IS(plan.slow_terms == SLOW_TERMS);
    IS(integrate_grid(0.0, more, 1.25) && plan.rows == 0);
}
/* A grid grows along an axis only as far as memory permits. */
static void test_room(void)
{
    const int small[2] = {16, 16}, tall[2] = {MOST_POINTS, 16}, square[2] = {512, 512};
    IS(has_room(small, 0) && has_room(small, 1));
    IS(!has_room(tall, 0) && has_room(tall, 1));
    IS(!has_room(square, 0) && !has_room(square, 1));
}
int main(void)
{
    test_slow_terms();
    test_heading_terms();
    test_room();
    return check_result();
}
