/* Step limit of methods that estimate their error: no step covers a whole turn, which would
 * invalidate the estimate. The tests use fast tops, with automatic first steps and with first steps
 * of many sizes. */
#include "tops.h"

enum { TOPS = 40, STEPS = 12 };

static kr_scene fast_scene(void)
{
    const double spin = pow(10.0, uniform(1.0, 4.0)), tilt = uniform(0.0, 1.5);
    kr_scene s = {.body = {.mass = 1.0,
                           .inertia = {1.0, 1.0, uniform(0.2, 1.9)},
                           .com = {0.0, 0.0, uniform(0.0, 1.0)},
                           .axes = {1, 0, 0, 0}},
                  .gravity = 1.0,
                  .start = {0.0, q_exp(v3(tilt, 0.0, 0.0)), {0.0, 0.0, 0.0}}};
    s.start.m =
        v_axpy(spin, q_turn_e3(s.start.q), random_vec(spin * pow(10.0, uniform(-6.0, 0.0))));
    return s;
}
static void test_turns(const kr_method *method, double tol, double most)
{
    for (int i = 0; i < TOPS; i++) {
        const kr_scene s = fast_scene();
        const double rate = v_length(kr_state_velocity(&s, &s.start));
        const kr_config config = {.tol = tol,
                                  .step = i % 2 ? pow(10.0, uniform(-2.0, 2.0)) / rate : 0.0};
        const kr_exact *exact = closed_form(&s);
        kr_top *top = make(&s, method, config);
        for (int k = 0; k < STEPS; k++) {
            const kr_state before = kr_top_state(top);
            IS(kr_top_step(top) == KR_OK);
            const kr_state now = kr_top_state(top);
            IS((now.t - before.t) * v_length(kr_state_velocity(&s, &before)) < 6.3);
        }
        const kr_state now = kr_top_state(top), truth = kr_exact_state(exact, now.t);
        NEAR(kr_attitude_error(now.q, truth.q), 0.0, most * tol * STEPS);
        kr_top_free(top);
    }
}

int main(void)
{
    for (size_t i = 0; kr_method_at(i); i++) {
        const unsigned flags = kr_method_describe(kr_method_at(i)).flags;
        if (!(flags & KR_METHOD_ADAPTIVE) || flags & KR_METHOD_DENSE) continue;
        test_turns(kr_method_at(i), 1e-4, 20.0);
        test_turns(kr_method_at(i), 1e-6, 100.0);
    }
    return check_result();
}
