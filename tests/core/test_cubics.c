/* What the closed forms' set-up does where roots coincide, slopes vanish and means do not meet. */
#include "check.h"
#include "exact/theta.h"

static dd pair(double a) { return dd_of(a); }
/* The lone root of a cubic of any size, on either side; of three that are one it is that one. */
static void lone_roots(void)
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
/* Newton's method leaves a start without a slope alone; means that do not meet have an end. */
static void without_an_end(void)
{
    const dd square[3] = {pair(-1.0), pair(0.0), pair(0.0)};
    NEAR(newton_cubic(pair(1.0), square, 0.0).hi, 0.0, 0.0);
    NEAR(newton_cubic(pair(1.0), square, 1.0625).hi, 1.0, 1e-3);
    NEAR(elliptic_agm(1.0, 0.0), 0.0, 1e-12);
    NEAR(elliptic_agm(1.0, 1.0), 1.0, 0.0);
}

int main(void)
{
    (void)elliptic_rf, (void)elliptic_mean, (void)theta_stretch;
    (void)theta_series, (void)theta_scale, (void)theta_at;
    lone_roots();
    without_an_end();
    return check_result();
}
