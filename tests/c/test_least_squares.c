/* The least-squares solver of the closed forms, with columns that depend on each other. */
#include "check.h"
#include "exact/least_squares.h"

enum { ROWS = 4 };

static lsq equal_columns(int columns)
{
    lsq m = {.rows = ROWS, .columns = columns};
    for (int j = 0; j < columns; j++) m.a[j][0] = 2.0;
    return m;
}
/* If all columns are equal, the solution has a single nonzero component. */
static void test_dependent_columns(void)
{
    lsq m = equal_columns(3);
    double right[LSQ_ROWS] = {10.0, 0.0, 0.0, 7.0}, x[LSQ_COLUMNS] = {NAN, NAN, NAN};
    lsq_factor(&m);
    lsq_solve(&m, right, x);
    NEAR(2.0 * (x[0] + x[1] + x[2]), 10.0, 1e-14);
    NEAR(fmax(fabs(x[0]), fmax(fabs(x[1]), fabs(x[2]))), 5.0, 1e-14);
    NEAR(right[3], 7.0, 1e-14);
}
/* The null vector of two equal columns has opposite components. */
static void test_null_vector(void)
{
    lsq m = equal_columns(2);
    double x[LSQ_COLUMNS];
    lsq_factor(&m);
    lsq_null(&m, x);
    NEAR(x[0] + x[1], 0.0, 1e-15);
    NEAR(2.0 * hypot(x[0], x[1]), 1.0, 1e-15);
}
/* With a single column, there is no second singular value. */
static void test_single_column(void)
{
    lsq m = equal_columns(1);
    double x[LSQ_COLUMNS];
    lsq_factor(&m);
    NEAR(lsq_null(&m, x), 1.0, 0.0);
    NEAR(fabs(x[0]), 0.5, 1e-15);
}
int main(void)
{
    test_dependent_columns();
    test_null_vector();
    test_single_column();
    return check_result();
}
