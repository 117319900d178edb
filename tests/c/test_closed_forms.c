/* Laws of all closed forms: their states are those of the truths and of the Taylor series at 30
 * digits, scales and axes of description do not matter, batches and instruction sets give bitwise
 * equal results, and tops, checkpoints and ensembles use them. test_exact.c and test_torus_edges.c
 * test motions near the edges of their range. */
#include <stdlib.h>
#include "exact/exact.h"
#include "exact_tops.h"
#include "truth.h"

/* A closed form, and what the tests expect of it. */
typedef struct form_case {
    const kr_exact_isa *form;
    kr_scene (*draw)(void);     /* returns a random top */
    kr_scene some, other, rest; /* two tops of the same body, and a top that is refused */
    int is_torus;               /* the motion is on a torus, and has a certificate */
    int drawn, most_refused;    /* number of random tops, and of refused ones among them */
    double truth_error, series_error, top_error; /* bounds */
    const char *family;                          /* of truths */
    int truths;                                  /* smallest number of truths */
} form_case;

static kr_scene draw_kowalewski(void) { return drawn_top_of_ratio(2.0); }
static kr_scene draw_chaplygin(void)
{
    kr_scene s = drawn_top_of_ratio(4.0);
    s.start.m.z = 0.0;
    return s;
}

/* Returns a random body without torque, some of which turn about a principal axis. */
static kr_scene draw_free(void)
{
    const int number = (int)uniform(0, 21);
    const kr_vec3 part = v3(pow(10, uniform(-2, 0)), pow(10, uniform(-2, 0)), 1.0),
                  moments = v3(part.y + part.z, part.z + part.x, part.x + part.y);
    kr_scene s = scene_of(moments, v3(0.1, 0.2, -0.3), 0.0, random_quat(), random_vec(3.0));
    if (number % 3 == 0) s.body.inertia.x = s.body.inertia.y;
    if (number % 7 == 0) s.start.m = q_turn(s.start.q, v3(0, number ? 1.0 : -1.0, 0));
    return s;
}
static kr_scene draw_gyrostat(void)
{
    kr_scene s = draw_free();
    s.body.rotor = random_vec(1.0);
    return s;
}

static kr_exact *memory; /* for any plan */

/* Returns the plan of a scene, or NULL if it is refused. */
static const kr_exact *plan_of(const kr_scene *s)
{
    const kr_status status = kr_exact_plan(s, 0.0, memory);
    IS(status == KR_OK || status == KR_ERR_METHOD);
    return status == KR_OK ? memory : NULL;
}
static void truths_are_met(const form_case *c)
{
    int count = 0;
    for (int i = 0; i < TRUTHS; i++) {
        const truth *row = &truths[i];
        if (!belongs_to(row, c->family)) continue;
        const kr_exact *plan = plan_of(&row->scene);
        IS(plan);
        if (!plan) continue;
        const kr_state end = kr_exact_state(plan, row->end.t);
        const kr_quat d = q_mul(q_conj(row->end.q), end.q);
        const double miss =
            2.0 * v_length(q_vec(d)) + off(end.m, row->end.m) / scale_of(&row->scene);
        if (!(miss <= c->truth_error)) printf("%s: %.2g\n", row->name, miss);
        NEAR(miss, 0.0, c->truth_error);
        IS(d.w > 0.0);
        const kr_exact_info info = kr_exact_describe(plan);
        IS(info.refusal == KR_REFUSAL_NONE && info.certificate < 1e-13);
        count++;
    }
    IS(count >= c->truths);
}
static void series_with_30_digits_are_met(const form_case *c)
{
    int refused = 0;
    for (int i = 0; i < 60; i++) {
        const kr_scene s = c->draw();
        const kr_exact *plan = plan_of(&s);
        if (!plan) {
            refused++;
            continue;
        }
        const kr_exact_info info = kr_exact_describe(plan);
        const double t = uniform(-1, 1) * 15.0 / rate_of(&s, plan);
        const double miss = error_of(&s, kr_exact_state(plan, t), by_series(&s, t));
        NEAR(miss, 0.0, c->series_error + 30.0 * info.certificate);
    }
    IS(refused <= 1 + c->most_refused / 4);
}
/* Nearly all random motions are planned, with a small error bound; very few are refused. */
static void drawn_tops_are_planned(const form_case *c)
{
    int refused = 0;
    for (int i = 0; i < c->drawn; i++) {
        const kr_scene s = c->draw();
        const kr_exact *plan = plan_of(&s);
        if (plan)
            NEAR(kr_attitude_error(kr_exact_state(plan, 0.0).q, s.start.q), 0.0,
                 2.0 * kr_exact_describe(plan).certificate + 5e-15);
        else
            refused++;
    }
    IS(refused <= c->most_refused);
}
/* Energy and momentum are kept for long; without torque, the momentum in every bit. */
static void integrals_are_kept(const form_case *c)
{
    for (int i = 0; i < c->drawn; i++) {
        const kr_scene s = c->draw();
        const kr_exact *plan = plan_of(&s);
        if (!plan) continue;
        const double lever = fabs(s.gravity) * v_length(s.body.com),
                     most = kr_state_kinetic(&s, &s.start) + 2.0 * lever,
                     allowed = c->top_error + 30.0 * kr_exact_describe(plan).certificate;
        const kr_state late = kr_exact_state(plan, pow(10.0, uniform(-2, 6)));
        NEAR((kr_state_energy(&s, &late) - kr_state_energy(&s, &s.start)) / most, 0.0, allowed);
        NEAR((late.m.z - s.start.m.z) / scale_of(&s), 0.0,
             c->form == kr_symmetric_form ? 0.0 : allowed);
        NEAR(q_dot(late.q, late.q), 1.0, 2e-15);
        IS(lever > 0.0 || memcmp(&late.m, &s.start.m, sizeof late.m) == 0);
    }
}
static void bad_arguments_are_refused(const form_case *c)
{
    kr_scene s = c->some;
    IS(kr_exact_plan(NULL, 0.0, memory) == KR_ERR_ARGUMENT);
    IS(kr_exact_plan(&s, 0.0, NULL) == KR_ERR_ARGUMENT);
    IS(kr_exact_plan(&s, -1.0, memory) == KR_ERR_ARGUMENT);
    IS(kr_exact_plan(&s, NAN, memory) == KR_ERR_ARGUMENT);
    IS(kr_exact_plan(&s, 1e-30, memory) == (c->is_torus ? KR_ERR_METHOD : KR_OK));
    IS(kr_exact_describe(memory).refusal ==
       (c->is_torus ? KR_REFUSAL_CERTIFICATE : KR_REFUSAL_NONE));
    s.start.q.w = 2.0;
    IS(kr_exact_plan(&s, 0.0, memory) == KR_ERR_ATTITUDE);
}
/* The closed form of `c` applies to no motion of these tops, and the refusal says so. */
static void other_tops_are_refused(const form_case *c)
{
    kr_scene s[] = {c->some, c->some};
    s[0].damping = v3(0.0, 0.0, 1e-3);
    s[1].friction = 1e-3;
    for (int i = 0; i < 2; i++)
        IS(!plan_of(&s[i]) && kr_exact_describe(memory).refusal == KR_REFUSAL_KIND);
}
/* Units of mass, length and time that are powers of two scale the results exactly. */
static void results_scale_with_powers_of_two(const form_case *c)
{
    for (int i = 0; i < c->drawn / 10; i++) {
        const double M = ldexp(1.0, (int)uniform(-60, 60)), L = ldexp(1.0, (int)uniform(-60, 60)),
                     T = ldexp(1.0, (int)uniform(-60, 60)), J = M * L * L,
                     t = pow(10.0, uniform(-2, 4));
        const kr_scene s = c->draw();
        kr_scene big = s;
        big.body.mass = M;
        big.body.inertia = v_scale(J, s.body.inertia);
        big.body.com = v_scale(L, s.body.com);
        big.body.rotor = v_scale(J / T, s.body.rotor);
        big.gravity = s.gravity * L / (T * T);
        big.start.m = v_scale(J / T, s.start.m);
        if (!plan_of(&s)) continue;
        const kr_state one = kr_exact_state(memory, t);
        const kr_exact_info small = kr_exact_describe(memory);
        kr_state other = kr_exact_state(plan_of(&big), t * T);
        other.t = t;
        other.m = v_scale(T / J, other.m);
        IS(same(one, other));
        const kr_exact_info info = kr_exact_describe(memory);
        IS(isnan(small.period) || small.period * T == info.period);
        IS(small.spin_angle_rate == info.spin_angle_rate * T);
        for (int k = 0; k < 3; k++) IS(small.frequency[k] == info.frequency[k] * T);
    }
}
/* The frame of description may be rotated, and the start may have any time. */
static void axes_of_description_change_nothing(const form_case *c)
{
    for (int i = 0; i < 20; i++) {
        kr_scene s = c->draw();
        const kr_exact *plan = plan_of(&s);
        if (!plan) continue;
        const double t = 15.0 / rate_of(&s, plan);
        const kr_state want = kr_exact_state(plan, t);
        s.body.axes = random_quat();
        s.start.q = q_unit(q_mul(s.start.q, q_conj(s.body.axes)));
        s.start.t = 0.25;
        const kr_state got = kr_exact_state(plan_of(&s), t + 0.25);
        NEAR(kr_attitude_error(q_mul(got.q, s.body.axes), want.q), 0.0, 1e-11);
        NEAR(off(got.m, want.m) / scale_of(&s), 0.0, 1e-11);
    }
}
/* Compares the plan and the states of one instruction set, at times of which some are late and some
 * are not finite, with those of the widest. */
static void check_instruction_set(const form_case *c, const kr_exact_isa *isa, const kr_scene *s)
{
    enum { TIMES = 37 };
    const kr_exact_isa *widest = kr_exact_widest_isa(c->form);
    double t[TIMES];
    kr_state many[TIMES];
    kr_exact_info info;
    void *plan = calloc(1, isa->scalar->memory_size), *other = calloc(1, isa->scalar->memory_size);
    for (int i = 0; i < TIMES; i++) t[i] = i % 2 ? -0.37 * i : 1e3 * i;
    t[5] = 1e300, t[11] = INFINITY, t[20] = NAN, t[TIMES - 1] = 1e40;
    const kr_status status = widest->scalar->plan(s, 0, KR_EXACT_BOUND, plan, &info);
    IS(isa->scalar->plan(s, 0, KR_EXACT_BOUND, other, &info) == status);
    IS(status != KR_OK || memcmp(other, plan, widest->scalar->plan_size) == 0);
    if (status == KR_OK) isa->evaluate(other, TIMES, t, many);
    for (int k = 0; k < TIMES && status == KR_OK; k++) {
        const kr_state want = widest->scalar->state(plan, t[k]),
                       one = isa->scalar->state(other, t[k]);
        IS(isfinite(t[k]) ? same(many[k], want) && same(one, want)
                          : isnan(many[k].q.w) && isnan(one.q.w) && isnan(want.m.x));
    }
    free(plan);
    free(other);
}
static void batches_and_instruction_sets_agree(const form_case *c)
{
    for (int n = 0; n < (c->is_torus ? 12 : 500); n++) {
        /* The last Kowalewski tops are near a saddle. */
        kr_scene s = n < 10 || c->form != kr_kowalewski_form
                         ? c->draw()
                         : kowalewski_top_of(v3(-1.0, 1e-3, 4e-4 * n), v3(0.0, 2e-3, 1e-3));
        for (const kr_exact_isa *isa = c->form; isa->name; isa++)
            if (isa->runs_here()) check_instruction_set(c, isa, &s);
    }
}
/* Many states at once have the sign of a zero that a state alone has. */
static void zeros_keep_their_sign(void)
{
    int zeros = 0;
    for (int i = 0; i < 64; i++) {
        const kr_quat half_turn = {0.0, 0.0, 1.0, 0x1p-36};
        const kr_vec3 m = {1.0 + 0.01 * i, -2.0, 0.0};
        const kr_scene s = scene_of(v3(1.0, 1.0, 0.25), v3(0.5, 0.0, 0.0), 1.0, half_turn, m);
        const double t = 0.0;
        kr_state many;
        if (!plan_of(&s)) continue;
        kr_exact_states(memory, 1, &t, &many);
        const kr_state one = kr_exact_state(memory, t);
        IS(memcmp(&one, &many, sizeof one) == 0);
        zeros += one.q.x == 0.0 && signbit(one.q.x);
    }
    IS(zeros > 0);
}
/* A copy of the used part of a plan is a plan. */
static void a_copy_of_the_used_part_is_a_plan(const form_case *c)
{
    for (int i = 0; i < 5; i++) {
        const kr_scene s = c->draw();
        const kr_exact *plan = plan_of(&s);
        if (!plan) continue;
        const size_t size = kr_exact_describe(plan).used;
        kr_exact *copy = malloc(size);
        memcpy(copy, plan, size);
        IS(size <= kr_exact_size(&s));
        IS(same(kr_exact_state(copy, 7.0), kr_exact_state(plan, 7.0)));
        free(copy);
    }
}
enum { TOPS = 5, TIMES_OF_TOPS = 4 };
/* Writes states that a worker with the method `exact` computes at the times t. */
static void run_worker(const kr_scene scenes[TOPS], const double t[],
                       kr_state states[TOPS][TIMES_OF_TOPS])
{
    kr_outcome outcomes[TOPS];
    kr_worker *worker = NULL;
    const kr_tops tops = {.n = TOPS,
                          .scenes = scenes,
                          .times = TIMES_OF_TOPS,
                          .t = t,
                          .states = states[0],
                          .outcomes = outcomes};
    IS(kr_worker_create(kr_method_find("exact"), (kr_config){0}, 0, NULL, &worker) == KR_OK);
    IS(kr_worker_run(worker, &tops) == KR_OK);
    kr_worker_free(worker);
    for (int i = 0; i < TOPS; i++)
        IS(outcomes[i].status == KR_OK && outcomes[i].done == TIMES_OF_TOPS);
}
/* The method `exact` gives the states of the plan, in tops and ensembles. */
static void tops_and_workers_give_the_same_states(const form_case *c)
{
    kr_scene scenes[TOPS];
    double t[TIMES_OF_TOPS];
    kr_state states[TOPS][TIMES_OF_TOPS];
    for (int i = 0; i < TOPS; i++) scenes[i] = c->draw();
    for (int k = 0; k < TIMES_OF_TOPS; k++) t[k] = -2.0 * k * k - 1.0;
    run_worker(scenes, t, states);
    for (int i = 0; i < TOPS; i++) {
        const kr_exact *plan = plan_of(&scenes[i]);
        kr_top *own = make(&scenes[i], kr_method_find("exact"), (kr_config){.step = -1.0});
        for (int k = 0; k < TIMES_OF_TOPS; k++) {
            IS(kr_top_advance(own, t[k]) == KR_OK);
            const kr_state now = kr_top_state(own);
            NEAR(error_of(&scenes[i], now, states[i][k]), 0.0, c->is_torus ? 0.0 : c->top_error);
            NEAR(error_of(&scenes[i], now, kr_exact_state(plan, t[k])), 0.0, c->top_error);
        }
        kr_top_free(own);
    }
}
enum { MANY = 300 };
/* Fills t with times of which some are equal, and one is the start. */
static void fill_times(double t[MANY])
{
    for (int i = 0; i < MANY; i++) t[i] = i % 70 == 69 ? t[i - 1] : 0.1 * i;
}
/* A poll function that stops a run when the number of remaining calls becomes zero. */
static int stop_at_last_call(void *left) { return --*(int *)left == 0; }
/* A top that records many times at once has the states, the steps and the failures of a top that
 * records each time alone. */
static void check_recording(const kr_scene *s, kr_config config, kr_status expected)
{
    double t[MANY];
    kr_state out[MANY], own;
    size_t done = 0;
    int left[2] = {1, 1};
    fill_times(t);
    memset(out, 0, sizeof out);
    config.context = &left[0];
    kr_top *together = make(s, kr_method_find("exact"), config);
    config.context = &left[1];
    kr_top *alone = make(s, kr_method_find("exact"), config);
    IS(kr_top_record(together, MANY, t, out, NULL, &done) == expected);
    IS((done == MANY) == (expected == KR_OK) && done > 100);
    for (size_t i = 0; i < done; i++) {
        IS(kr_top_record(alone, 1, &t[i], &own, NULL, NULL) == KR_OK);
        IS(same(own, out[i]));
    }
    IS(same(kr_top_state(together), kr_top_state(alone)));
    IS(kr_top_describe(together).stats.steps == kr_top_describe(alone).stats.steps);
    if (done < MANY) {
        IS(kr_top_advance(alone, t[done]) == expected);
        IS(out[done].q.w == 0.0 && out[done].t == 0.0);
    }
    kr_top_free(together);
    kr_top_free(alone);
}
static void many_times_are_recorded_as_each_alone(const form_case *c)
{
    const kr_scene scenes[] = {c->some, kr_scene_default()};
    for (int i = 0; i < 2; i++) {
        check_recording(&scenes[i], (kr_config){0}, KR_OK);
        check_recording(&scenes[i], (kr_config){.max_steps = 130}, KR_ERR_LIMIT);
        check_recording(&scenes[i], (kr_config){.poll = stop_at_last_call}, KR_ERR_INTERRUPTED);
    }
}
/* A worker polls after each top, because a set-up takes long. */
static void a_worker_can_stop_after_each_top(const form_case *c)
{
    const double t = 1.0;
    kr_scene scenes[TOPS];
    kr_outcome outcomes[TOPS];
    int left = 1 + 2; /* one call after the batch of other closed forms, and two tops */
    const kr_config config = {.poll = stop_at_last_call, .context = &left};
    kr_worker *worker = NULL;
    const kr_tops tops = {.n = TOPS, .scenes = scenes, .times = 1, .t = &t, .outcomes = outcomes};
    for (int i = 0; i < TOPS; i++) scenes[i] = c->some;
    IS(kr_worker_create(kr_method_find("exact"), config, 0, NULL, &worker) == KR_OK);
    IS(kr_worker_run(worker, &tops) == KR_ERR_INTERRUPTED);
    for (int i = 0; i < TOPS; i++) IS(outcomes[i].status == (i < 2 ? KR_OK : KR_ERR_INTERRUPTED));
    kr_worker_free(worker);
}
/* Without a requested end, a step is a period of the first angle. */
static void a_step_is_a_period_of_the_first_angle(const form_case *c)
{
    kr_top *top = make(&c->some, kr_method_find("exact"), (kr_config){0});
    IS(kr_top_step(top) == KR_OK);
    NEAR(kr_top_state(top).t / kr_exact_describe(plan_of(&c->some)).period, 1.0, 1e-14);
    kr_top_free(top);
}
static void a_refused_reset_leaves_the_top_as_it_was(const form_case *c)
{
    const kr_method *exact = kr_method_find("exact");
    kr_top *top = make(&c->some, exact, (kr_config){0}), *other = NULL;
    IS(kr_top_create(&c->rest, exact, (kr_config){0}, &other) == KR_ERR_METHOD);
    IS(kr_top_advance(top, 1.0) == KR_OK);
    IS(kr_top_reset(top, &c->rest.start) == KR_ERR_METHOD);
    IS(kr_top_advance(top, 5.0) == KR_OK);
    kr_top *fresh = make(&c->some, exact, (kr_config){0});
    IS(kr_top_advance(fresh, 5.0) == KR_OK);
    IS(same(kr_top_state(top), kr_top_state(fresh)));
    kr_top_free(fresh);
    kr_top_free(top);
}
static void a_tolerance_bounds_the_certificate(const form_case *c)
{
    const kr_method *exact = kr_method_find("exact");
    const double certificate = kr_exact_describe(plan_of(&c->some)).certificate;
    kr_top *strict = NULL, *plain = make(&c->some, exact, (kr_config){0}),
           *bounded = make(&c->some, exact, (kr_config){.tol = certificate}),
           *loose = make(&c->some, exact, (kr_config){.tol = 0.5});
    const kr_config below = {.tol = 0.5 * certificate};
    IS(certificate > 0.0);
    IS(kr_top_create(&c->some, exact, below, &strict) == KR_ERR_METHOD && !strict);
    kr_top *const tops[] = {plain, bounded, loose};
    for (int i = 0; i < 3; i++) {
        IS(kr_top_advance(tops[i], 5.0) == KR_OK);
        IS(same(kr_top_state(tops[i]), kr_top_state(plain)));
    }
    for (int i = 0; i < 3; i++) kr_top_free(tops[i]);
}
static void checkpoints_go_on(const form_case *c)
{
    const kr_method *exact = kr_method_find("exact");
    kr_top *top = make(&c->some, exact, (kr_config){0}),
           *loaded = make(&c->some, exact, (kr_config){0});
    IS(kr_top_reset(top, &c->other.start) == KR_OK && kr_top_advance(top, 3.0) == KR_OK);
    const size_t size = kr_top_save_size(top);
    void *saved = malloc(size);
    IS(kr_top_save(top, size, saved) == KR_OK && kr_top_load(loaded, size, saved) == KR_OK);
    IS(kr_top_advance(top, 9.0) == KR_OK && kr_top_advance(loaded, 9.0) == KR_OK);
    IS(same(kr_top_state(top), kr_top_state(loaded)));
    free(saved);
    kr_top_free(top);
    kr_top_free(loaded);
}
/* Returns the difference between two states as seen from the body, where the heading does not
 * matter. */
static double off_in_body(const kr_scene *s, kr_state one, kr_state other)
{
    return off(q_turn_e3_back(one.q), q_turn_e3_back(other.q)) +
           off(q_turn_back(one.q, one.m), q_turn_back(other.q, other.m)) / scale_of(s);
}
/* Both angles grow at the frequencies of the plan, and whole turns of them change nothing. */
static void angles_of_the_torus_grow_linearly(const form_case *c)
{
    const double turn = 6.283185307179586;
    for (int i = 0; i < 20; i++) {
        const kr_scene s = c->draw();
        const kr_exact *plan = plan_of(&s);
        if (!plan) continue;
        const kr_exact_info info = kr_exact_describe(plan);
        const double a = uniform(0, 1), b = uniform(0, 1), t = 5.0 / rate_of(&s, plan);
        kr_scene there = s;
        there.start = kr_exact_state_at(plan, a, b);
        IS(there.start.t == s.start.t);
        there.start.q = q_unit(there.start.q);
        const kr_state want = by_series(&there, t),
                       got = kr_exact_state_at(plan, a + info.frequency[0] * t / turn,
                                               b + info.frequency[1] * t / turn);
        NEAR(off_in_body(&s, got, want), 0.0, 2e-12);
        NEAR(off_in_body(&s, kr_exact_state_at(plan, a - 3.0, b + 2.0), there.start), 0.0, 1e-12);
        IS(isnan(kr_exact_state_at(plan, INFINITY, b).q.w) &&
           isnan(kr_exact_state_at(plan, a, NAN).q.w));
    }
}
static void check_form(const form_case *c)
{
    truths_are_met(c);
    series_with_30_digits_are_met(c);
    drawn_tops_are_planned(c);
    integrals_are_kept(c);
    bad_arguments_are_refused(c);
    other_tops_are_refused(c);
    results_scale_with_powers_of_two(c);
    axes_of_description_change_nothing(c);
    batches_and_instruction_sets_agree(c);
    a_copy_of_the_used_part_is_a_plan(c);
    tops_and_workers_give_the_same_states(c);
    many_times_are_recorded_as_each_alone(c);
    a_step_is_a_period_of_the_first_angle(c);
    checkpoints_go_on(c);
    if (c->rest.body.mass > 0.0) a_refused_reset_leaves_the_top_as_it_was(c);
    if (!c->is_torus) return;
    a_worker_can_stop_after_each_top(c);
    a_tolerance_bounds_the_certificate(c);
    angles_of_the_torus_grow_linearly(c);
}

/* Two directions of e3. */
static const kr_vec3 up = {0.4, -0.3, 0.7}, other_up = {-0.4, 0.3, 0.7};

static form_case kowalewski_case(void)
{
    return (form_case){
        .form = kr_kowalewski_form,
        .draw = draw_kowalewski,
        .some = kowalewski_top_of(up, v3(0.3, 0.5, 0.8)),
        .other = kowalewski_top_of(other_up, v3(0.3, -0.5, 1.8)),
        .rest = kowalewski_top_of(v3(1.0, 0.0, 0.0), v3(0.0, 0.0, 0.0)),
        .is_torus = 1,
        .drawn = 500,
        .most_refused = 2,
        .truth_error = 2e-14,
        .series_error = 5e-15,
        .top_error = 3e-15,
        .family = "kowalewski",
        .truths = 30,
    };
}
static form_case chaplygin_case(void)
{
    return (form_case){
        .form = kr_chaplygin_form,
        .draw = draw_chaplygin,
        .some = chaplygin_top_of(up, v3(0.6, 1.0, 0.8)),
        .other = chaplygin_top_of(other_up, v3(0.6, -1.0, 1.8)),
        .rest = chaplygin_top_of(v3(1.0, 0.0, 0.0), v3(0.0, 0.0, 0.0)),
        .is_torus = 1,
        .drawn = 250,
        .most_refused = 2,
        .truth_error = 2e-14,
        .series_error = 3e-14,
        .top_error = 5e-15,
        .family = "goryachev_chaplygin",
        .truths = 20,
    };
}

static form_case lagrange_case(void)
{
    const kr_quat lean = q_exp(v3(0.6, -0.4, 0.3));
    return (form_case){
        .form = kr_symmetric_form,
        .draw = draw_lagrange,
        .some = lagrange_top(2.0, 1.5, 3.0, lean, v3(1.0, 2.0, 3.0)),
        .other = lagrange_top(2.0, 1.5, 3.0, q_conj(lean), v3(-1.0, 2.0, 0.5)),
        .rest = lagrange_top(2.0, 1.5, 3.0, q_one(), v3(1e-75, 0.0, 3.0)),
        .drawn = 20000,
        .truth_error = 6e-15, /* of which 1e-15 is the rounding of the truth to doubles */
        .series_error = 1e-14,
        .top_error = 1e-14,
        .family = "closed form",
        .truths = 84,
    };
}
static form_case free_case(void)
{
    form_case c = lagrange_case();
    c.draw = draw_free;
    c.some = scene_of(v3(2.0, 3.0, 4.5), v3(0.1, 0.2, -0.3), 0.0, c.some.start.q, v3(1, 2, 3));
    c.other = scene_of(v3(2.0, 3.0, 4.5), v3(0.1, 0.2, -0.3), 0.0, q_one(), v3(-1.0, 0.5, 0.2));
    c.rest.body.mass = 0.0; /* none is refused */
    c.drawn = 4000;
    return c;
}
static form_case gyrostat_case(void)
{
    form_case c = free_case();
    c.form = kr_gyrostat_form;
    c.draw = draw_gyrostat;
    c.some.body.rotor = c.other.body.rotor = v3(0.3, -0.4, 0.8);
    c.is_torus = 1;
    c.drawn = 500;
    c.most_refused = 10;
    c.family = "gyrostat";
    c.truths = 6;
    return c;
}

int main(void)
{
    const form_case cases[] = {lagrange_case(), free_case(), gyrostat_case(), kowalewski_case(),
                               chaplygin_case()};
    size_t size = 0;
    for (int i = 0; i < 5; i++) size += kr_exact_size(&cases[i].some);
    memory = malloc(size);
    for (int i = 0; i < 5; i++) check_form(&cases[i]);
    zeros_keep_their_sign();
    free(memory);
    return check_result();
}
