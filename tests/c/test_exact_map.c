/* The closed form of the Bobenko-Suris map compared with stepping, and refusals. */
#include "tops.h"

static const double pi = 3.14159265358979323846;

static kr_scene thesis(kr_quat q, kr_vec3 m, double gravity)
{
    kr_scene s = kr_scene_default();
    s.start.q = q, s.start.m = m, s.gravity = gravity;
    return s;
}
static kr_scene scene(int i)
{
    switch (i) {
    case 0:
        return kr_scene_default();
    case 1:
        return thesis(q_exp(v3(0.6, -0.4, 0.3)), v3(1, 2, 30), 1.0);
    case 2:
        return thesis(q_exp(v3(0.6, -0.4, 0.3)), v3(0.5, -0.3, -3), -2.0);
    case 3:
        return thesis(q_exp(v3(1e-7, 0, 0)), v3(0.3, 0.2, 4), 1.0);
    case 4:
        return thesis(q_exp(v3(pi - 1e-6, 0, 0)), v3(3, -2, 5), 1.0);
    case 5:
        return thesis(q_exp(v3(0, 1.1, 0)), v3(0, 1.5, 0), 1.0);
    case 6:
        return thesis(q_exp(v3(0, 1.1, 0)), v3(0, 40, 0), 1.0);
    case 7:
        return thesis(q_exp(v3(0.6, -0.4, 0.3)), v3(1, 2, 3), 0.0);
    case 8:
        return thesis(q_one(), v3(0, 0, 9), 1.0);
    case 9:
        return thesis(q_exp(v3(0.6, -0.4, 0.3)), v3(0, 0, 3), 0.0);
    default:
        return thesis(q4(0.0, v3(0.6, 0.8, 0.0)), v3(3, 1, 9), -1.0);
    }
}
enum { SCENES = 11 };
static void test_map_states(void)
{
    const double steps[] = {0.1, -0.1, 0.02, 1.0};
    for (int i = 0; i < 4 * SCENES; i++) {
        const kr_scene s = scene(i / 4);
        const kr_config config = {.step = steps[i % 4]};
        kr_exact_map closed;
        IS(kr_exact_map_plan(&s, config.step, &closed) == KR_OK);
        kr_top *top = make(&s, kr_method_find("bobenko_suris"), config);
        for (int k = 0; k <= 100; k += k < 5 ? 1 : 19) {
            IS(kr_top_advance(top, k * config.step) == KR_OK);
            const kr_state a = kr_top_state(top), b = kr_exact_map_state(&closed, k);
            NEAR(kr_attitude_error(a.q, b.q), 0.0, 2e-11);
            NEAR(off(a.m, b.m), 0.0, 2e-11 * (1.0 + v_length(b.m)));
            IS(a.t == b.t);
        }
        kr_top_free(top);
    }
}
/* On a separatrix the period is infinite, and the roots are not known accurately. */
static void test_near_separatrix(void)
{
    kr_exact_map closed;
    for (double tilt = 1e-13; tilt > 1e-17; tilt *= 0.1) {
        const kr_scene s = thesis(q_exp(v3(0.5 * tilt, 0, 0)), v3(0, 0, 1), 1.0);
        IS(kr_exact_map_plan(&s, 0.1, &closed) == KR_ERR_STEP_SIZE);
    }
}
/* Near a pole one phase is inaccurate and follows from the other two. With small steps the
 * Bobenko-Suris map approaches the motion of the top. */
static void test_near_pole(void)
{
    const double step = 1e-7, t = 1.7;
    for (double tilt = 1e-10; tilt > 1e-15; tilt *= 0.1) {
        const kr_scene s = thesis(q_exp(v3(0.5 * tilt, 0, 0)), v3(0.6, 0.5, -0.2), 1.0);
        kr_exact_map closed;
        const kr_exact *exact = closed_form(&s);
        IS(kr_exact_map_plan(&s, step, &closed) == KR_OK);
        const kr_state end = kr_exact_map_state(&closed, (int64_t)rint(t / step));
        NEAR(distance(end, kr_exact_state(exact, end.t)), 0.0, step);
    }
}
/* At late times the integrals of the Bobenko-Suris map still hold, and one step of the map leads to
 * the next state. A large step amplifies rounding errors. */
static void test_far_away(kr_scene s, double step, double within)
{
    const kr_config config = {.step = step};
    kr_exact_map closed;
    IS(kr_exact_map_plan(&s, config.step, &closed) == KR_OK);
    const double energy = kr_state_modified_energy(&s, &s.start, config.step),
                 axial = kr_state_axial_momentum(&s, &s.start);
    const double most = fabs(energy) + kr_state_kinetic(&s, &s.start), size = v_length(s.start.m);
    for (int64_t k = 1; k < 1000000000000; k *= -7) {
        const kr_state e = kr_exact_map_state(&closed, k);
        NEAR(kr_state_modified_energy(&s, &e, config.step), energy, 1e-14 * most);
        NEAR(kr_state_axial_momentum(&s, &e), axial, 1e-14 * size);
        kr_scene here = s;
        here.start = e;
        kr_top *top = NULL;
        IS(kr_top_create(&here, kr_method_find("bobenko_suris"), config, &top) == KR_OK &&
           kr_top_step(top) == KR_OK);
        NEAR(kr_attitude_error(kr_top_state(top).q, kr_exact_map_state(&closed, k + 1).q), 0.0,
             within);
        kr_top_free(top);
    }
}
/* A million steps of the Bobenko-Suris map lead to the state of the closed form, up to their
 * accumulated rounding errors. This requires phases in double-double. */
static void test_million_steps(void)
{
    enum { STEPS = 1000000 };
    for (int i = 1; i < 3; i++) {
        const kr_scene s = scene(i);
        const kr_config config = {.step = 0.02};
        kr_exact_map closed;
        IS(kr_exact_map_plan(&s, config.step, &closed) == KR_OK);
        const kr_state a = kr_exact_map_state(&closed, STEPS),
                       b = state_at(STEPS * config.step, &s, kr_method_find("bobenko_suris"),
                                    config);
        NEAR(kr_attitude_error(a.q, b.q), 0.0, 5e-10);
    }
}
static void test_refusals(void)
{
    const kr_config config = {.step = 0.0};
    const kr_method *exact = kr_method_find("exact");
    kr_scene s = kr_scene_default(), bad = s;
    const kr_exact *plan;
    kr_exact_map closed = {.step = 7.0};
    kr_top *top = NULL;
    IS(plan_closed_form(NULL, &plan) == KR_ERR_ARGUMENT &&
       kr_exact_plan(&s, 0.0, NULL) == KR_ERR_ARGUMENT);
    bad.start.q.w = 1.1;
    IS(plan_closed_form(&bad, &plan) == KR_ERR_ATTITUDE);
    bad = s, bad.start.m.x = INFINITY;
    IS(plan_closed_form(&bad, &plan) == KR_ERR_ARGUMENT);
    bad = s, bad.body.inertia.x *= 1.1;
    IS(plan_closed_form(&bad, &plan) == KR_ERR_METHOD &&
       kr_exact_map_plan(&bad, 0.1, &closed) == KR_ERR_METHOD);
    IS(kr_top_create(&bad, exact, config, &top) == KR_ERR_METHOD && !kr_method_suits(exact, &bad));
    bad.gravity = 0.0; /* every free body has a closed form */
    IS(plan_closed_form(&bad, &plan) == KR_OK && kr_method_suits(exact, &bad) &&
       !kr_method_applies(exact, &bad.body));
    IS(kr_top_create(&bad, exact, config, &top) == KR_OK);
    kr_top_free(top);
    bad = s, bad.body.inertia = v3(1e-30, 1e-30, 1e-30), bad.start.m.x = 1e300;
    IS(plan_closed_form(&bad, &plan) == KR_ERR_ARGUMENT);
    IS(kr_exact_map_plan(&s, 0.0, &closed) == KR_ERR_NO_STEP &&
       kr_exact_map_plan(&s, NAN, &closed) == KR_ERR_ARGUMENT);
    /* next to the separatrix */
    bad = thesis(q_exp(v3(1e-14, 0, 0)), v3(0, 0, 0), 1.0);
    IS(kr_exact_map_plan(&bad, 0.1, &closed) == KR_ERR_STEP_SIZE && closed.step == 7.0);
}
/* Steps of any size are refused or give states, without converting a NaN or an infinity to an
 * integer. */
static void test_huge_steps(void)
{
    const kr_scene s = kr_scene_default();
    for (double step = 1.0; step < 1e300; step *= 7.0) {
        kr_exact_map map;
        const kr_status status = kr_exact_map_plan(&s, step, &map);
        const kr_state state = status == KR_OK ? kr_exact_map_state(&map, 10) : s.start;
        IS(status != KR_OK || state.t == 10.0 * step);
    }
}
/* Tiny steps follow the motion of the top, or are refused where the start is so close to a pole
 * that the solution would miss it. */
static void test_tiny_steps(void)
{
    const kr_vec3 m[3] = {{0.0, 0.0, 20.0}, {1e-3, 0.2, 1.0}, {0.0, 0.0, 0.0}};
    int planned = 0, refused = 0, all = 0;
    for (double tilt = 1e-4; tilt > 1e-60; tilt *= 0.1)
        for (double step = 1e-6; step > 1e-25; step *= 0.1)
            for (int k = 0; k < 9; k++, all++) {
                const kr_scene s = thesis(q_exp(v3(tilt, 0, 0)), m[k % 3], k / 3 - 1);
                kr_exact_map map;
                const kr_exact *plan = closed_form(&s);
                const kr_status status = kr_exact_map_plan(&s, step, &map);
                planned += status == KR_OK, refused += status == KR_ERR_STEP_SIZE;
                if (status != KR_OK) continue;
                const kr_state a = kr_exact_map_state(&map, 10), b = kr_exact_state(plan, a.t);
                NEAR(kr_attitude_error(a.q, b.q), 0.0, 2e-9 + 10.0 * step);
            }
    IS(planned > all / 2 && refused > all / 20 && planned + refused == all);
}

int main(void)
{
    test_huge_steps();
    test_tiny_steps();
    test_map_states();
    test_near_separatrix();
    test_near_pole();
    test_far_away(scene(1), 0.1, 2e-15);
    /* hangs: step^2 lever / I1 > 2 */
    test_far_away(thesis(q4(0.0, v3(1, 0, 0)), v3(0.1, 0.2, 0.3), 1.0), 3.0, 5e-14);
    test_far_away(thesis(q4(0.0, v3(0.6, 0.8, 0)), v3(2, -3, 1), 1.0), -7.0, 5e-14);
    test_million_steps();
    test_refusals();
    return check_result();
}
