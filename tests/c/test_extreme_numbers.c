/* Numbers near the ends of the range of doubles: results equal those of ordinary units up to a
 * power of two, or the call is refused. */
#include <float.h>
#include "event_helpers.h"

static const double many_units[] = {0x1p-1040, 0x1p-700, 0x1p-300, 0x1p300, 0x1p600};

/* The direction of a lever does not depend on its length. */
static void test_levers(void)
{
    const kr_scene s = tilted();
    const kr_vec3 want = kr_state_apex(&s, &s.start);
    for (int i = 0; i < 5; i++) {
        kr_scene other = s;
        other.body.com = v_scale(many_units[i], s.body.com);
        IS(off(kr_state_apex(&other, &s.start), want) <= 1e-15);
    }
    kr_scene top = s;
    top.body =
        (kr_body){1.0, {2.0, 2.0, 1.0}, {0.5, 0.25, 0.0}, {1, 0, 0, 0}, 0.0, .rotor = {0, 0, 0}};
    kr_scene small = top;
    small.body.com = v_scale(0x1p-600, top.body.com);
    small.gravity = 0x1p600;
    const double K = kr_state_kowalewski(&top, &s.start);
    NEAR(kr_state_kowalewski(&small, &s.start) / K, 1.0, 1e-15);
}
/* A subnormal lever keeps all its digits, because the computation of the torque does not divide
 * it. */
static void test_least_levers(void)
{
    kr_scene s = tilted(), other;
    s.body =
        (kr_body){1.3, {2.0, 1.5, 1.0}, {0.5, 0.25, 0.0}, {1, 0, 0, 0}, 0.0, .rotor = {0, 0, 0}};
    s.gravity = 1.1;
    other = s;
    other.body.com = v_scale(0x1p-1060, s.body.com);
    other.body.mass = ldexp(s.body.mass, 60);
    other.gravity = ldexp(s.gravity, 1000);
    const kr_config config = {0};
    const kr_state want = state_at(3.0, &s, taylor(), config),
                   found = state_at(3.0, &other, taylor(), config);
    IS(memcmp(&want, &found, sizeof want) == 0);
}
/* Gravity and lever may be so small, or so large, that their product is outside the range of
 * doubles, as long as the mass compensates. */
static void test_products(void)
{
    const kr_scene s = tilted();
    const char *const methods[] = {"strang", "taylor", "exact"};
    for (int i = 0; i < 3; i++) {
        const kr_config config = {.step = 0x1p-6};
        const kr_state want = state_at(3.0, &s, kr_method_find(methods[i]), config);
        for (int k = -1; k < 2; k += 2) {
            kr_scene other = s;
            other.gravity = ldexp(s.gravity, -500 * k);
            other.body.com = v_scale(ldexp(1.0, -600 * k), s.body.com);
            other.body.mass = ldexp(s.body.mass, 1000 * k);
            other.body.inertia = v_scale(ldexp(1.0, -100 * k), s.body.inertia);
            other.start.m = v_scale(ldexp(1.0, -100 * k), s.start.m);
            const kr_state got = state_at(3.0, &other, kr_method_find(methods[i]), config);
            IS(memcmp(&got.q, &want.q, sizeof got.q) == 0);
        }
    }
    const kr_config deep = {.digits = 30};
    kr_scene light = s, weak = s;
    light.body.com = v_scale(0x1p-700, s.body.com), weak.body.com = v_scale(0x1p-400, s.body.com);
    light.gravity = ldexp(s.gravity, -300), weak.gravity = ldexp(s.gravity, -600);
    light.body.mass = ldexp(s.body.mass, 1000), weak.body.mass = ldexp(s.body.mass, 1000);
    IS(same(state_at(3.0, &light, taylor(), deep), state_at(3.0, &weak, taylor(), deep)));
    IS(distance(state_at(3.0, &light, taylor(), deep), state_at(3.0, &s, taylor(), deep)) <= 1e-15);
}
/* Checks that a motion scaled in time by a power of two passes through the same states. */
static void test_paces(void)
{
    const kr_scene s = tilted();
    for (int power = -480; power <= 900; power += 60) {
        kr_scene slow = s;
        const kr_exact *exact = NULL, *want = NULL;
        slow.gravity = ldexp(s.gravity, -2 * (power < 500 ? power : 500));
        slow.body.mass = ldexp(s.body.mass, power < 500 ? 0 : -2 * (power - 500));
        slow.start.m = v_scale(ldexp(1.0, -power), s.start.m);
        IS(plan_closed_form(&slow, &exact) == KR_OK && plan_closed_form(&s, &want) == KR_OK);
        const kr_state got = kr_exact_state(exact, ldexp(7.0, power));
        IS(kr_attitude_error(got.q, kr_exact_state(want, 7.0).q) == 0.0);
    }
}
static const kr_exact *closed(const kr_scene *s)
{
    const kr_exact *exact = closed_form(s);
    NEAR(kr_attitude_error(kr_exact_state(exact, s->start.t).q, s->start.q), 0.0, 1e-14);
    return exact;
}
static int is_state(kr_state s) { return fabs(q_dot(s.q, s.q) - 1.0) < 1e-14 && v_finite(s.m); }
static int is_none(kr_state s)
{
    const double sum = fabs(s.q.w) + fabs(s.q.x) + fabs(s.q.y) + fabs(s.q.z);
    return isnan(sum) && isnan(s.m.x) && isnan(s.m.y) && isnan(s.m.z);
}
/* Checks that a top has a state at every finite time, bitwise equal alone and in a batch, and no
 * state at other times. */
static void late(const kr_scene *s)
{
    const kr_exact *exact = closed(s);
    double t[] = {1.0, 1e14, -1e17, 1e22, -1e100, DBL_MAX, -DBL_MAX, INFINITY, -INFINITY, NAN};
    kr_state out[10];
    kr_exact_states(exact, 10, t, out);
    for (int i = 0; i < 10; i++) {
        const kr_state alone = kr_exact_state(exact, t[i]);
        IS(isnan(t[i]) ? isnan(alone.t) : alone.t == t[i]);
        IS(isfinite(t[i]) ? is_state(alone) && same(alone, out[i]) : is_none(alone));
        IS(isfinite(t[i]) || is_none(out[i]));
    }
}
static void test_late_times(void)
{
    kr_scene s = tilted(), free = tilted();
    free.body = general_body();
    free.gravity = 0.0;
    late(&s);
    late(&free);
    s.gravity = 0.0;
    late(&s);
    s.start.m = v3(0, 0, 0);
    late(&s);
}
/* Components whose squares are negligible beside those of the others give valid states, or the
 * closed form is refused. */
static void test_smallest_numbers(void)
{
    kr_scene free = {
        .body = {.mass = 1.0, .inertia = {1.0, 1.5, 2.0}, .com = {0, 0, 0}, .axes = {1, 0, 0, 0}},
        .start = {0.0, {1, 0, 0, 0}, {0, 0, 0}}};
    for (int power = -40; power > -1070; power -= 29) {
        kr_scene s = tilted();
        const double little = ldexp(1.0, power);
        s.start.q = q_unit(q4(1.0, v3(little, 0.0, 0.0)));
        s.start.m = v3(0.0, little, 1.0); /* below the critical spin of a sleeping top */
        const kr_exact *exact = NULL;
        /* The top falls. If the square of its tilt is negligible, the closed form cannot determine
         * when. */
        if (little < 1e-75) IS(plan_closed_form(&s, &exact) == KR_ERR_METHOD);
        if (little > 1e-65) exact = closed(&s);
        for (double t = 0.5; little > 1e-65 && t < 4000.0; t *= 1.5)
            IS(is_state(kr_exact_state(exact, t)));
        free.start.m = v3(little, 1.0, -little);
        const kr_exact *about = closed(&free);
        for (double t = 0.5; t < 4000.0; t *= 1.5) IS(is_state(kr_exact_state(about, t)));
    }
}
/* Checks that a worker stops the top where it stops alone, with and without an array of states, and
 * in sections: when the apex reaches `height`. */
static void stop_in_ensemble(const kr_scene *s, const kr_method *method, double height)
{
    enum { TIMES = 1000 };
    static kr_state out[TIMES];
    double t[TIMES], wait = 2.4e-7;
    size_t done;
    kr_outcome outcome;
    kr_top *top = make(s, method, (kr_config){0});
    kr_worker *worker = make_worker(method, (kr_config){0});
    for (int k = 0; k < TIMES; k++) t[k] = 2.5e-10 * (k + 1);
    kr_tops tops = {.n = 1, .scenes = s, .times = TIMES, .t = t, .outcomes = &outcome};
    IS(kr_top_record(top, TIMES, t, out, NULL, &done) == KR_ERR_NOT_FINITE && done > 0);
    for (int i = 0; i < 2; i++) {
        IS(kr_worker_run(worker, &tops) == KR_OK && outcome.status == KR_ERR_NOT_FINITE);
        IS(outcome.done == done && same(outcome.last, kr_top_state(top)));
        tops.states = out;
    }
    const kr_term level[] = {term(1.0, "apex_z", "1"), term(-height, "1", "1")};
    const kr_event event = {.terms = level, .count = 2};
    tops.t = &wait;
    tops.times = 2;
    if (method == taylor())
        IS(kr_worker_section(worker, &event, &tops) == KR_OK &&
           outcome.status == KR_ERR_NOT_FINITE);
    kr_worker_free(worker);
    kr_top_free(top);
}
/* A pendulum whose momentum leaves the range of doubles in the user's units stops at its last valid
 * state, even between two points of its grid. */
static void test_overflows(void)
{
    kr_scene s = tilted();
    s.body.inertia = v3(0x.fp1000, 0x.fp1000, 0x.8p1000);
    s.body.mass = 0x.fp1000;
    s.body.com = v3(0, 0, 1);
    s.gravity = 0x.fp46;
    s.start = (kr_state){0.0, q_exp(v3(0.05, 0, 0)), v3(0x.e8p1023, 0, 0)};
    int fell = 0;
    for (size_t i = 0; kr_method_at(i); i++) {
        kr_top *top = NULL;
        if (kr_top_create(&s, kr_method_at(i), (kr_config){.step = 1e-9}, &top) != KR_OK) continue;
        kr_state before = s.start;
        kr_status status = KR_OK;
        for (int k = 1; k < 1000 && status == KR_OK; k++) {
            before = kr_top_state(top);
            status = kr_top_advance(top, 2.5e-10 * k);
        }
        const kr_state state = kr_top_state(top);
        IS(status == KR_ERR_NOT_FINITE && is_state(state) && state.t >= before.t);
        IS(state.m.x > 1e308);
        kr_top_free(top);
        fell++;
    }
    IS(fell > 15);
    stop_in_ensemble(&s, kr_method_find("exact"), 0.0);
    for (int i = 0; i < 2; i++) stop_in_ensemble(&s, taylor(), i ? -0.95 : -2.0);
}
/* Rates and units outside the range of doubles are refused. */
static void test_refusals(void)
{
    kr_scene s = tilted();
    const kr_exact *exact;
    kr_top *top = NULL;
    kr_scene thin = s;
    thin.body.com = v3(0, 0, 0);
    thin.body.inertia = v3(1.0, 1.0, 0x1p-1050);
    IS(plan_closed_form(&thin, &exact) == KR_ERR_ARGUMENT);
    const int powers[3][2] = {{-1050, -1050}, {-1024, -1024}, {-900, -1060}};
    for (int k = 0; k < 3; k++) {
        kr_scene small = s;
        kr_nutation turning;
        small.body.inertia = v_scale(ldexp(1.0, powers[k][0]), s.body.inertia);
        small.start.m = v_scale(ldexp(1.0, powers[k][1]), s.start.m);
        small.gravity = 0.0;
        IS(kr_scene_horizon(&small) == 0.0);
        IS(plan_closed_form(&small, &exact) == KR_ERR_ARGUMENT);
        IS(kr_exact_nutation(&small, &turning) == KR_ERR_ARGUMENT);
        for (size_t i = 0; kr_method_at(i); i++) {
            const kr_status status =
                kr_top_create(&small, kr_method_at(i), (kr_config){.step = 0.01}, &top);
            IS((status == KR_ERR_ARGUMENT || status == KR_ERR_METHOD) && top == NULL);
        }
    }
}

int main(void)
{
    test_levers();
    test_least_levers();
    test_products();
    test_paces();
    test_late_times();
    test_smallest_numbers();
    test_overflows();
    test_refusals();
    return check_result();
}
