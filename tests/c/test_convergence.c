/* Convergence of the methods with fixed steps. The error for a step size h is a power series in h
 * that starts at h^order. It has only even powers if the method is symmetric. Richardson
 * extrapolation therefore removes one power for each additional step size. A coefficient that is
 * wrong in its seventh digit adds a power below the order, which extrapolation does not remove. The
 * reference is taylor with 30 digits. */
#include "tops.h"

enum { LEVELS = 7, NUMBERS = 7 };
#define SPAN 4.0

/* Writes a state as numbers, with the sign of the attitude that is nearer to `like`. */
static void put_numbers(kr_state s, kr_quat like, double momentum, double out[NUMBERS])
{
    const double sign = q_dot(s.q, like) < 0.0 ? -1.0 : 1.0;
    const kr_quat q = q_scale(sign, s.q);
    const kr_vec3 m = v_scale(1.0 / momentum, s.m);
    const double numbers[NUMBERS] = {q.w, q.x, q.y, q.z, m.x, m.y, m.z};
    memcpy(out, numbers, sizeof numbers);
}
static double largest_difference(const double a[NUMBERS], const double b[NUMBERS])
{
    double most = 0.0;
    for (int i = 0; i < NUMBERS; i++) most = fmax(most, fabs(a[i] - b[i]));
    return most;
}
/* Replaces the rows for the step sizes h, h/2, h/4, ... by rows whose errors have no term in
 * h^power. */
static void remove_power(double rows[][NUMBERS], int count, int power)
{
    const double ratio = ldexp(1.0, power);
    for (int k = 0; k + 1 < count; k++)
        for (int i = 0; i < NUMBERS; i++)
            rows[k][i] = rows[k + 1][i] + (rows[k + 1][i] - rows[k][i]) / (ratio - 1.0);
}
/* Number of steps at the first level, and number of levels, each with half the step size of the one
 * before. */
typedef struct {
    int steps, levels;
} grid;
static grid grid_of(int order, int is_reversible)
{
    const grid first = {64, 7}, second = {32, 5}, fourth = {16, 5}, slow = {64, 6}, high = {6, 5};
    return order == 1      ? first
           : order == 2    ? second
           : order > 4     ? high
           : is_reversible ? fourth
                           : slow;
}
/* Checks the order of a method on a scene, by the slope of the errors at the last two levels that
 * rounding does not affect, and by the error after extrapolation. */
static void converges(const kr_method *method, const kr_scene *s)
{
    const int order = kr_method_describe(method).order,
              is_reversible = (kr_method_describe(method).flags & KR_METHOD_REVERSIBLE) != 0;
    const grid g = grid_of(order, is_reversible);
    const double momentum = v_length(s->start.m);
    const kr_state end = state_at(SPAN, s, taylor(), (kr_config){.digits = 30});
    double truth[NUMBERS], rows[LEVELS][NUMBERS], before = INFINITY, slope = NAN;
    put_numbers(end, end.q, momentum, truth);
    for (int k = 0; k < g.levels; k++) {
        const kr_config config = {.step = SPAN / (g.steps << k)};
        put_numbers(state_at(SPAN, s, method, config), end.q, momentum, rows[k]);
        const double error = largest_difference(rows[k], truth);
        if (error > 2e-13) slope = log2(before / error);
        before = error;
    }
    for (int k = 1; k < g.levels; k++)
        remove_power(rows, g.levels - k + 1, order + (k - 1) * (is_reversible ? 2 : 1));
    NEAR(slope, order, 0.1);
    NEAR(largest_difference(rows[0], truth), 0.0, 1e-13);
    if (check_failures) printf("  so far with %s\n", kr_method_describe(method).name);
}
int main(void)
{
    kr_scene scenes[3] = {tilted(), asymmetric(), asymmetric()};
    int methods = 0;
    scenes[2].gravity = 0.0;
    scenes[2].body = general_body();
    scenes[2].body.com = v3(0.0, 0.0, 0.0);
    for (size_t i = 0; kr_method_at(i); i++) {
        const kr_method *method = kr_method_at(i);
        if (kr_method_describe(method).flags & KR_METHOD_ADAPTIVE) continue;
        methods++;
        for (int k = 0; k < 3; k++)
            if (kr_method_suits(method, &scenes[k])) converges(method, &scenes[k]);
    }
    IS(methods == 14);
    return check_result();
}
