/* Control of order and step size of the extrapolation in limiting cases: an error equal to the
 * tolerance, and equal work of two rows. */
#include <string.h>
#include "methods/extrapolation.h"
#include "check.h"

/* An equation of motion in which only one variable changes, at a rate that is prescribed for each
 * row. */
static double rate_of_row[GBS_ROWS + 1];
static int asked;
static void rates(kr_motion *motion, const double y[GBS_SIZE], double rate[GBS_SIZE])
{
    (void)motion;
    (void)y;
    int row = 1;
    for (asked++; row * (row + 1) < asked;) row++;
    memset(rate, 0, GBS_SIZE * sizeof *rate);
    rate[0] = rate_of_row[row];
}
static const gbs_form told = {.rates = rates};
static const double zero[GBS_SIZE];
static gbs_attempt attempt(double tol)
{
    asked = 0;
    return (gbs_attempt){.form = &told, .y = zero, .tol = tol, .h = -1.0, .speed = INFINITY};
}
static gbs_attempt with_rows(int rows)
{
    gbs_attempt a = attempt(1.0);
    for (int row = 1; row <= rows; row++) IS(gbs_add_row(&a, row));
    return a;
}
/* Returns a tolerance such that the error is exactly `times` times the tolerance. */
static double tolerance(double error, double times)
{
    double tol = error / times * (1.0 - 4.0 * DBL_EPSILON);
    while (error / tol > times) tol = nextafter(tol, INFINITY);
    IS(error / tol == times);
    return tol;
}
/* Sets the rate so that a row gives this value of T(row, 1). */
static void set_row(int row, double value)
{
    gbs_attempt a = attempt(1.0);
    rate_of_row[row] = 1.0, asked = row * (row - 1);
    IS(gbs_midpoint(&a, row));
    rate_of_row[row] = value / a.table[row][0];
}
static void set_rows(double one, double two, double three, double four)
{
    set_row(1, one);
    set_row(2, two);
    set_row(3, three);
    set_row(4, four);
}

/* In the first two rows the rates may change by at most twice their size after the first
 * substep. */
static void test_stability(void)
{
    for (int row = 1; row <= GBS_ROWS; row++) rate_of_row[row] = 2.0;
    for (int row = 1; row <= 3; row++) {
        gbs_attempt a = attempt(1.0);
        a.speed = 0.5 * sqrt(4.0 / GBS_SIZE);
        IS(gbs_midpoint(&a, row) == 1);
        a.speed *= 1.0 - DBL_EPSILON;
        IS(gbs_midpoint(&a, row) == (row > 2));
    }
    rate_of_row[1] = 1.0, rate_of_row[2] = 1e6; /* large from the second substep on */
    gbs_attempt a = attempt(1.0);
    a.speed = 1.0, asked = 1;
    IS(gbs_midpoint(&a, 2) == 1);
}
/* A third row is accepted if its error is below four times that of the second, or below the
 * tolerance. A second row is accepted if its error is below 1e15 times the tolerance. */
static void test_failed_row(void)
{
    set_rows(1.0, 2.5, 5.0, 5.0);
    const double second = with_rows(2).err, third = with_rows(3).err;
    for (int i = 0; i < 2; i++) {
        const double more = i ? 1.0 + DBL_EPSILON : 1.0;
        gbs_attempt a = with_rows(2);
        a.tol = third / 8.0, a.err = 2.0 * more;
        IS(gbs_add_row(&a, 3) == i && a.row == 3);
        a = with_rows(2);
        a.tol = third * more, a.err = 0.0;
        IS(gbs_add_row(&a, 3) == i);
        a = with_rows(1);
        a.tol = tolerance(second, 1e15) * more, a.err = 0.0;
        IS(gbs_add_row(&a, 2) == i);
    }
}
/* The step size that a row suggests depends on the error, within bounds. */
static void test_step_lengths(void)
{
    set_rows(1.0, 2.0, 2.5, 2.6);
    const double errors[] = {0.0, 1e-30, 0.3, 7.0, 1e12};
    for (int row = 2; row <= 4; row++)
        for (int i = 0; i < 5; i++) {
            gbs_attempt a = with_rows(row - 1);
            const double exponent = 1.0 / (2 * row - 1), shrink = pow(0.02, exponent);
            a.tol = i ? with_rows(row).err / errors[i] : INFINITY;
            a.err = INFINITY, asked = row * (row - 1);
            IS(gbs_add_row(&a, row));
            const double length = i < 2   ? 1.0 / shrink
                                  : i > 3 ? shrink / 4.0
                                          : 0.94 / pow(errors[i] / 0.65, exponent);
            NEAR(a.length[row] / length, 1.0, 1e-12);
            NEAR(a.work[row] * length, 1.0 + row * (row + 1), 1e-10);
        }
}

static void converges(int from, int target, double tol, int row, int last)
{
    gbs_attempt a = attempt(tol);
    IS(gbs_converge(&a, from, target) == row);
    IS(a.row == last);
}
static void test_convergence(void)
{
    set_rows(2.0, 1.25, 1.0 + 1.0 / 9.0, 1.0625); /* 1 + 1 / row^2: the second row is exact */
    const double second = with_rows(2).err, less = 1.0 - DBL_EPSILON;
    converges(2, 3, second, 2, 2);
    converges(2, 3, second * less, 3, 3);
    converges(3, 3, second, 3, 3);
    converges(2, 3, tolerance(second, 144.0), 3, 3);
    converges(2, 3, tolerance(second, 144.0) * less, GBS_REJECTED, 2);
    converges(3, 3, tolerance(second, 144.0) * less, 3, 3);
    converges(2, 2, tolerance(second, 9.0), 3, 3);
    converges(2, 2, tolerance(second, 9.0) * less, GBS_REJECTED, 2);
    converges(2, 4, tolerance(second, 144.0) * less, 3, 3);
    set_rows(1.0, 2.0, 1.5, 1.8);
    converges(2, 2, 1e-3, GBS_REJECTED, 2);
    converges(2, 2, 0.02, GBS_REJECTED, 3);
    set_rows(1.0, 1.001, 3.0, 9.0);
    converges(2, 3, 1e-6, GBS_UNSTABLE, 3);
}

/* A lower row is chosen if it needs less than 0.8 times the work of the next row. A higher row is
 * chosen if the last row needs less than 0.9 times the work of a lower one. */
typedef struct {
    int row, target, rejected;
    double work[3]; /* of the last row and of the rows before it */
    int best;
} choice;
static gbs_attempt attempt_of(const choice *c)
{
    gbs_attempt a = {.row = c->row, .h = -2.0};
    for (int i = 0; i < 3; i++)
        if (i < c->row) a.work[c->row - i] = c->work[i];
    for (int row = 1; row <= GBS_ROWS; row++) a.length[row] = 0.5 * row;
    return a;
}
static void test_row_choice(void)
{
    const double most = 0.8 * 10.0, little = 0.9 * 10.0, less = 1.0 - DBL_EPSILON;
    const choice all[] = {
        {2, 5, 0, {1.0, 1.0, 1.0}, 3},
        {2, 5, 1, {1.0, 1.0, 1.0}, 2},
        {4, 5, 0, {10.0, most, 1.0}, 4},
        {4, 5, 0, {10.0, most * less, 1.0}, 3},
        {4, 4, 0, {10.0, most * less, 1.0}, 3},
        {4, 5, 0, {little, 10.0, 1.0}, 4},
        {4, 5, 0, {little * less, 10.0, 1.0}, 5},
        {4, 4, 1, {little * less, 10.0, 1.0}, 4},
        {8, 8, 0, {1.0, 10.0, 1.0}, 8},
        {7, 8, 0, {1.0, 10.0, 1.0}, 8},
        {4, 3, 0, {10.0, 10.0, most}, 3},
        {4, 3, 0, {10.0, 10.0, most * less}, 2},
        {3, 2, 0, {10.0, 10.0, 1.0}, 2},
        {4, 3, 1, {little, 10.0, 10.0}, 3},
        {4, 3, 1, {little * less, 10.0, 10.0}, 4},
        {4, 3, 0, {0.9 * 5.0, 10.0, 5.0}, 2},
        {4, 3, 0, {0.9 * 5.0 * less, 10.0, 5.0}, 4},
        {9, 8, 0, {1.0, 10.0, 10.0}, 8},
    };
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        const gbs_attempt a = attempt_of(&all[i]);
        IS(gbs_best_row(&a, all[i].target, all[i].rejected) == all[i].best);
    }
}
static void test_control_after_acceptance(void)
{
    const choice better = {4, 5, 0, {1.0, 10.0, 1.0}, 5}, same = {4, 4, 0, {1.0, 10.0, 1.0}, 5},
                 fewer = {4, 5, 0, {10.0, 1.0, 1.0}, 3};
    gbs_attempt a = attempt_of(&better);
    gbs_control next = gbs_after_accepted(&a, better.target, 0);
    IS(next.target == 5 && !next.first && next.h == 2.0 * (gbs_cost(6) / gbs_cost(4)));
    a = attempt_of(&same);
    next = gbs_after_accepted(&a, same.target, 0);
    IS(next.target == 5 && next.h == 2.0 * (gbs_cost(5) / gbs_cost(4)));
    a = attempt_of(&fewer);
    next = gbs_after_accepted(&a, fewer.target, 0);
    IS(next.target == 3 && next.h == 1.5);
    const choice alike = {4, 5, 0, {10.0, 10.0, 1.0}, 4};
    const gbs_attempt even = attempt_of(&alike);
    IS(gbs_after_accepted(&even, alike.target, 0).h == 2.0);
    a.h = -1.0;
    IS(gbs_after_accepted(&a, fewer.target, 1).h == 1.0);
    IS(gbs_after_accepted(&a, fewer.target, 0).h == 1.5);
}
static void test_control_after_failure(void)
{
    const double most = 0.8 * 10.0;
    const choice alike = {4, 6, 0, {10.0, most, 1.0}, 4},
                 less = {4, 6, 0, {10.0, most * (1.0 - DBL_EPSILON), 1.0}, 3};
    const gbs_control tried = {.h = 9.0, .target = 6, .first = 1},
                      lower = {.h = 9.0, .target = 3, .first = 1};
    gbs_attempt a = attempt_of(&alike);
    gbs_control next = gbs_after_failed(&a, tried, GBS_REJECTED);
    IS(next.h == 2.0 && next.target == 4 && next.first == 0);
    next = gbs_after_failed(&a, lower, GBS_REJECTED);
    IS(next.h == 1.0 && next.target == 2);
    next = gbs_after_failed(&a, tried, GBS_UNSTABLE);
    IS(next.h == 1.0 && next.target == 6 && next.first == 0);
    a = attempt_of(&less);
    next = gbs_after_failed(&a, tried, GBS_REJECTED);
    IS(next.h == 1.5 && next.target == 3);
    set_rows(1.0, 2.0, 1.5, 1.8);
    a = attempt(1.0);
    IS(gbs_add_row(&a, 1) == 1 && a.work[1] == INFINITY); /* one row alone has no estimate */
}

int main(void)
{
    test_stability();
    test_failed_row();
    test_step_lengths();
    test_convergence();
    test_row_choice();
    test_control_after_acceptance();
    test_control_after_failure();
    return check_result();
}
