/* Runs with 20 and 30 digits, and their low words. test_support.c compares them with true states. */
#include "math/su2_dd.h"
#include "tops.h"

typedef struct {
    kr_state high, low;
} deep;

static deep run_to(const kr_scene *s, int digits, double t)
{
    const kr_config config = {.digits = digits, .step = t < s->start.t ? -1.0 : 1.0};
    deep end;
    kr_top *top = make(s, taylor(), config);
    IS(kr_top_record(top, 1, &t, &end.high, &end.low, NULL) == KR_OK);
    const kr_state high = kr_top_state(top), low = kr_top_describe(top).low;
    IS(same(high, end.high) && same(low, end.low));
    kr_top_free(top);
    return end;
}
static double apart(deep a, deep b) /* half the angle plus the difference of m */
{
    const quat_dd d = qdd_mul(qdd_conj(q_dd(a.high.q, a.low.q)), q_dd(b.high.q, b.low.q));
    const vec_dd m = v_dd(a.high.m, a.low.m),
                 n = v_dd(v_scale(-1.0, b.high.m), v_scale(-1.0, b.low.m));
    return v_length(vdd_high(d.v)) + v_length(vdd_high(vdd_add(m, n)));
}
static kr_scene heavy(void)
{
    kr_scene s = tilted();
    s.body = general_body();
    s.gravity = 9.81;
    return s;
}

/* The time elapsed since the start is exact, whatever the start and the steps are. */
static void test_exact_time(void)
{
    kr_scene s = heavy(), late = s;
    const double t = 10.3;
    late.start.t = 0.1;
    const dd span = two_sum(t, -late.start.t);
    const deep a = run_to(&late, 30, t), b = run_to(&s, 30, span.hi);
    const kr_vec3 w = kr_state_velocity(&s, &b.high), torque = kr_state_torque(&s, &b.high);
    const kr_quat rate = q_scale(0.5, q_mul(q4(0, w), b.high.q));
    const quat_dd moved = {
        dd_add(q_dd(b.high.q, b.low.q).w, dd_of(span.lo * rate.w)),
        vdd_add(q_dd(b.high.q, b.low.q).v, v_dd(v_scale(span.lo, q_vec(rate)), v3(0, 0, 0)))};
    const vec_dd pushed =
        vdd_add(v_dd(b.high.m, b.low.m), v_dd(v_scale(span.lo, torque), v3(0, 0, 0)));
    const deep want = {{t, qdd_high(moved), vdd_high(pushed)},
                       {0, qdd_low(moved), vdd_low(pushed)}};
    IS(span.lo != 0.0 && apart(a, b) > 0.1 * fabs(span.lo));
    NEAR(apart(a, want), 0.0, 1e-28);
}
/* The exact tensor of a body determines its motion, unless a program has changed a moment. */
static void test_given_tensors(void)
{
    const double tensor[9] = {3.0, -0.25, 0.5, -0.25, 2.5, 0.125, 0.5, 0.125, 1.5};
    kr_scene s = heavy();
    IS(kr_body_from_tensor(1.0, tensor, v3(0.25, -0.5, 0.75), 0.0, &s.body) == KR_OK);
    for (int is_changed = 0; is_changed < 2; is_changed++) {
        kr_scene rounded = s;
        memset(&rounded.body.given, 0, sizeof rounded.body.given);
        const double off = apart(run_to(&s, 30, 2.0), run_to(&rounded, 30, 2.0));
        IS(is_changed ? off == 0.0 : off > 1e-19 && off < 1e-13);
        s.body.inertia.x *= 1.0 + 0x1p-52;
    }
}
static void test_single_steps(void)
{
    const kr_scene s = heavy();
    const kr_config config = {.digits = 30};
    kr_top *top = make(&s, taylor(), config);
    for (int i = 0; i < 20; i++) {
        IS(kr_top_step(top) == KR_OK);
        const deep here = {kr_top_state(top), kr_top_describe(top).low},
                   there = run_to(&s, 30, here.high.t);
        /* the end of a step, in the user's time, is rounded */
        NEAR(apart(here, there), 0.0, 1e-15);
        IS(here.low.q.w != 0.0);
    }
    kr_top_free(top);
}
static void test_options(void)
{
    const kr_scene s = heavy();
    kr_top *top = NULL;
    static const kr_config wrong[] = {{.digits = -1},
                                      {.digits = 31},
                                      {.digits = 20, .tol = 1e-9},
                                      {.digits = 20, .tol = 0x1p-101},
                                      {.digits = 30, .tol = 0x1p-99}};
    const kr_config fine = {.digits = 20};
    for (int i = 0; i < 5; i++) IS(kr_top_create(&s, taylor(), wrong[i], &top) == KR_ERR_ARGUMENT);
    IS(kr_top_create(&s, kr_method_find("extrap"), fine, &top) == KR_ERR_OPTION && top == NULL);
    const int pairs[][2] = {{0, 16}, {1, 16}, {17, 20}, {21, 30}};
    for (int i = 0; i < 4; i++) {
        const deep a = run_to(&s, pairs[i][0], 3), b = run_to(&s, pairs[i][1], 3);
        IS(memcmp(&a, &b, sizeof a) == 0);
    }
}
/* A tolerance below that of 30 digits gives shorter steps with different rounding errors. */
static void test_shorter_steps(void)
{
    const kr_scene s = heavy();
    const kr_config configs[] = {{.digits = 30}, {.digits = 30, .tol = 0x1p-108}};
    const double t = 5.0;
    int64_t steps[2];
    deep ends[2];
    for (int i = 0; i < 2; i++) {
        kr_top *top = make(&s, taylor(), configs[i]);
        IS(kr_top_record(top, 1, &t, &ends[i].high, &ends[i].low, NULL) == KR_OK);
        steps[i] = kr_top_describe(top).stats.steps;
        kr_top_free(top);
    }
    IS(steps[1] > steps[0]);
    IS(apart(ends[0], ends[1]) > 0.0);
    NEAR(apart(ends[0], ends[1]), 0.0, 1e-28);
}

/* Returns the energy in double-double, for a body in principal axes with a lever that doubles do
 * not represent exactly. */
static dd energy(const kr_scene *s, deep at)
{
    const quat_dd q = q_dd(at.high.q, at.low.q);
    const vec_dd up = {dd_of(0.0), dd_of(0.0), dd_of(1.0)};
    const vec_dd P = qdd_turn(qdd_conj(q), up), m = v_dd(at.high.m, at.low.m),
                 M = qdd_turn(qdd_conj(q), m), lever = v_dd(s->body.com, v3(0, 0, 0));
    const vec_dd turning = {dd_div(M.x, dd_of(s->body.inertia.x)),
                            dd_div(M.y, dd_of(s->body.inertia.y)),
                            dd_div(M.z, dd_of(s->body.inertia.z))};
    return dd_add(dd_half(vdd_dot(M, turning)),
                  dd_mul(two_product(s->body.mass, s->gravity), vdd_dot(lever, P)));
}
/* An error of one bit in the lever would change the energy by 1e-16. */
static void test_energy_to_the_last_digits(void)
{
    for (int i = 0; i < 8; i++) {
        kr_scene s = tilted();
        s.body.mass = 1.3 + 0.1 * i, s.gravity = 9.81 - 0.7 * i;
        s.body.inertia = v3(2.1, 2.9 + 0.1 * i, 3.7), s.body.com = v3(0.37, -0.51 - 0.01 * i, 0.23);
        s.start.m = v3(1.1, -2.3, 3.9);
        const deep begin = {s.start, {0.0, {0, 0, 0, 0}, {0, 0, 0}}};
        const deep near = run_to(&s, 30, 0x1p-40), end = run_to(&s, 30, 3.0);
        const dd before = energy(&s, near), after = energy(&s, end);
        NEAR(dd_sub(after, before).hi / before.hi, 0.0, 1e-28);
        NEAR(dd_sub(energy(&s, begin), before).hi / before.hi, 0.0, 1e-15);
    }
}

/* All options of taylor use kernels of the same instruction set. */
static void test_instruction_sets(void)
{
    static const kr_config configs[4] = {{0}, {.skip_heading = 1}, {.digits = 20}, {.digits = 30}};
    const kr_scene s = heavy();
    const char *name = NULL;
    for (int i = 0; i < 4; i++) {
        kr_top *top = make(&s, taylor(), configs[i]);
        const kr_top_info info = kr_top_describe(top);
        IS(info.order > 0 && (i == 0 || strcmp(info.kernel, name) == 0));
        name = info.kernel;
        kr_top_free(top);
    }
}

int main(void)
{
    test_instruction_sets();
    test_exact_time();
    test_given_tensors();
    test_single_steps();
    test_options();
    test_shorter_steps();
    test_energy_to_the_last_digits();
    return check_result();
}
