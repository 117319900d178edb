/* The modified kick and its processor: order 4 for bodies whose lever lies along an axis, nearly
 * equal moments, a top at rest, and the longest step. */
#include "methods/modified_kick.h"
#include "random.h"
#include "tops.h"

static kr_scene along_an_axis(double i1, double i2, double i3)
{
    kr_scene s = tilted();
    s.body.mass = 1.0, s.body.inertia = v3(i1, i2, i3), s.body.com = v3(0.0, 0.0, 0.9);
    s.start.m = v3(1.0, 2.0, 3.0);
    return s;
}
static double error_of(const kr_scene *s, const char *method, double step)
{
    const kr_config truly = {.tol = 1e-15}, config = {.step = step};
    return distance(state_at(2.0, s, kr_method_find(method), config),
                    state_at(2.0, s, taylor(), truly));
}
static void test_order(const char *method)
{
    const kr_scene tops[] = {along_an_axis(1.0, 1.7, 2.2), along_an_axis(1.7, 1.0, 2.2),
                             along_an_axis(1.5, 1.5, 2.2)};
    for (int i = 0; i < 3; i++) {
        const double coarse = error_of(&tops[i], method, 0.05),
                     fine = error_of(&tops[i], method, 0.025);
        NEAR(coarse / fine, 16.0, 1.5);
        IS(coarse < 3e-4);
    }
}
/* Tiny differences of the moments have tiny effects, whether or not the moments are treated as
 * equal. */
static void test_nearly_a_lagrange_top(const char *method)
{
    const kr_config config = {.step = 0.1};
    const kr_scene top = along_an_axis(1.5, 1.5, 2.2);
    const kr_state end = state_at(2.0, &top, kr_method_find(method), config);
    for (double more = 1e-16; more < 1e-5; more *= 10.0) {
        const kr_scene near = along_an_axis(1.5, 1.5 * (1.0 + more), 2.2);
        NEAR(distance(state_at(2.0, &near, kr_method_find(method), config), end), 0.0,
             20.0 * more + 1e-11);
    }
}
/* If the processor does not find its midpoint, it reports this and leaves the state unchanged. */
static void test_missing_midpoint(void)
{
    const kr_vec3 m = v3(1.0, 2.0, 3.0);
    for (int i = 0; i < 2; i++) {
        const kr_motion motion = {
            .inertia = {1.0, 1.7, 2.2}, .lever = {0.0, 0.0, i ? 0.9 : 90.0}, .step = i ? 0.1 : 1.0};
        const modified_kick kick = modified_kick_begin(&motion);
        kr_quat q = q_exp(v3(0.6, -0.4, 0.3));
        const kr_quat before = q;
        kr_vec3 left = i ? v3(NAN, 2.0, 3.0) : m;
        IS(modified_kick_process(&kick, -1.0, &q, &left) == KR_ERR_STEP_SIZE);
        IS(memcmp(&q, &before, sizeof q) == 0 && left.y == m.y && left.z == m.z);
    }
}
/* For a top at rest the processor only rotates the axis, and rotates it back. */
static void test_top_at_rest(void)
{
    const kr_motion motion = {.inertia = {1.0, 1.7, 2.2}, .lever = {0.3, 0.0, 0.9}, .step = 0.1};
    const modified_kick kick = modified_kick_begin(&motion);
    const kr_quat start = q_exp(v3(0.6, -0.4, 0.3));
    kr_quat q = start;
    kr_vec3 m = v3(0.0, 0.0, 0.0);
    IS(modified_kick_process(&kick, 1.0, &q, &m) == KR_OK && v_largest(m) == 0.0);
    IS(fabs(q.x - start.x) > 1e-5);
    IS(modified_kick_process(&kick, -1.0, &q, &m) == KR_OK);
    NEAR(fabs(q.w - start.w) + v_largest(v_sub(v3(q.x, q.y, q.z), v3(start.x, start.y, start.z))),
         0.0, 1e-15);
}
/* If the angular momentum is small and a rotor rotates, rounding errors are proportional to the
 * momentum of the rotor. */
static void test_rotor_of_a_top_at_rest(void)
{
    for (int i = 0; i < 20000; i++) {
        const kr_vec3 A = random_vec(0.7), m = v_scale(i % 4 * 1e-9, random_vec(1.0));
        const kr_motion motion = {
            .inertia = {uniform(1.0, 1.9), uniform(1.0, 1.9), uniform(1.0, 1.9)},
            .lever = {A.x, A.y, A.z},
            .rotor = {uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-0.5, 0.5)},
            .step = uniform(0.1, 0.7)};
        const modified_kick kick = modified_kick_begin(&motion);
        const kr_quat start = random_quat();
        kr_quat q = start;
        kr_vec3 own = m;
        IS(modified_kick_process(&kick, 1.0, &q, &own) == KR_OK);
        IS(modified_kick_process(&kick, -1.0, &q, &own) == KR_OK);
        NEAR(kr_attitude_error(q, start) + off(own, m), 0.0, 4e-15);
    }
}

/* The processor works up to h^2 |A| / (least moment) = 2. */
static void test_longest_step(void)
{
    for (int i = 0; i < 2; i++) {
        const kr_motion motion = {.inertia = {1.0, 1.7, 2.2},
                                  .lever = {0.0, 0.0, i ? 2.0 * (1.0 + 4.0 * DBL_EPSILON) : 2.0},
                                  .step = 1.0};
        const modified_kick kick = modified_kick_begin(&motion);
        kr_quat q = q_exp(v3(0.6, -0.4, 0.3));
        kr_vec3 m = v3(1.0, 2.0, 3.0);
        IS(modified_kick_process(&kick, 1.0, &q, &m) == (i ? KR_ERR_STEP_SIZE : KR_OK));
    }
}

int main(void)
{
    test_longest_step();
    test_missing_midpoint();
    test_top_at_rest();
    test_rotor_of_a_top_at_rest();
    test_order("takahashi_imada4");
    test_order("veselov4");
    test_nearly_a_lagrange_top("takahashi_imada4");
    test_nearly_a_lagrange_top("veselov4");
    return check_result();
}
