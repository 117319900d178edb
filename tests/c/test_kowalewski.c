/* The closed form of Kowalewski tops: against truths by heyoka and against the Taylor series with
 * 30 digits, its integrals, near separatrices and degenerate motions, refusals by name; batches and
 * instruction sets give the same bits. */
#include <stdlib.h>
#include "exact/kowalewski.h"
#include "kowalewski_truth.h"
#include "torus_tops.h"

static void *memory;

/* Returns a top with moments 2, 2, 1 and mass gravity |com| = 1, whose body sees e3 and its angular
 * velocity so; the axes are those of the closed form. */
static kr_scene seen_so(kr_vec3 up, kr_vec3 velocity)
{
    const kr_vec3 e3 = v_unit(up);
    const kr_quat q = q_conj(q_tilt(e3));
    const kr_vec3 m = q_turn(q, v_times(v3(2.0, 2.0, 1.0), velocity));
    return scene_of(v3(2.0, 2.0, 1.0), v3(-1.0, 0.0, 0.0), 1.0, q, m);
}
static kr_scene drawn_top(void) { return drawn_top_of_ratio(2.0); }
static const kr_kowalewski *plan_of(const kr_scene *s)
{
    const kr_kowalewski *top = NULL;
    const kr_status status = kr_kowalewski_plan(s, 0.0, memory, &top);
    IS((status == KR_OK) == (top != NULL));
    IS(status == KR_OK || status == KR_ERR_METHOD);
    return top;
}
static void truths_by_heyoka_are_met(void)
{
    const size_t count = sizeof kowalewski_truths / sizeof *kowalewski_truths;
    IS(count >= 50);
    for (size_t i = 0; i < count; i++) {
        const kowalewski_truth *c = &kowalewski_truths[i];
        const kr_scene s = scene_of(c->inertia, c->com, c->gravity, c->q, c->m);
        const kr_kowalewski *top = plan_of(&s);
        IS(top);
        if (!top) continue;
        const kr_state end = kr_kowalewski_state(top, c->t);
        const kr_quat d = q_mul(q_conj(c->q_at), end.q);
        const double miss = 2.0 * v_length(q_vec(d)) + off(end.m, c->m_at) / scale_of(&s);
        if (!(miss <= 2e-14)) printf("truth %d at t = %g: %.2g\n", (int)i, c->t, miss);
        NEAR(miss, 0.0, 2e-14);
        IS(d.w > 0.0);
        IS(top->mismatch == 0.0 && top->refusal == KR_KOWALEWSKI_PLANNED);
        IS(top->certificate < 1e-13);
    }
}
static void series_with_30_digits_are_met(void)
{
    int refused = 0;
    for (int i = 0; i < 60; i++) {
        const kr_scene s = drawn_top();
        const kr_kowalewski *top = plan_of(&s);
        if (!top) {
            refused++;
            continue;
        }
        const double t = uniform(-1, 1) * 15.0 / top->second;
        const double miss = error_of(&s, kr_kowalewski_state(top, t), by_series(&s, t));
        NEAR(miss, 0.0, 5e-15 + 30.0 * top->certificate);
    }
    IS(refused == 0);
}
static void integrals_are_constant(void)
{
    for (int i = 0; i < 300; i++) {
        const kr_scene s = drawn_top();
        const kr_kowalewski *top = plan_of(&s);
        if (!top) continue;
        const double energy = kr_state_energy(&s, &s.start), scale = scale_of(&s),
                     K = kr_state_kowalewski(&s, &s.start);
        for (int k = 0; k < 8; k++) {
            const kr_state now = kr_kowalewski_state(top, pow(10.0, uniform(-2, 7)));
            NEAR(q_dot(now.q, now.q), 1.0, 2e-15);
            NEAR(now.m.z / scale, s.start.m.z / scale, 3e-14 + 30.0 * top->certificate);
            NEAR(kr_state_energy(&s, &now) / (1e-300 + fabs(energy) + scale * scale),
                 energy / (1e-300 + fabs(energy) + scale * scale), 3e-14 + 30.0 * top->certificate);
            const double size = pow(scale / v_largest(s.body.inertia), 4.0);
            NEAR(kr_state_kowalewski(&s, &now) / size, K / size, 2e-12);
        }
    }
}
/* Every drawn motion is planned with a small certificate; hardly any is refused. */
static void drawn_tops_are_planned(void)
{
    int refused = 0;
    for (int i = 0; i < 2000; i++) {
        const kr_scene s = drawn_top();
        const kr_kowalewski *top = plan_of(&s);
        if (!top) {
            refused++;
            continue;
        }
        NEAR(kr_attitude_error(kr_kowalewski_state(top, 0.0).q, s.start.q), 0.0,
             2.0 * top->certificate + 3e-15);
    }
    IS(refused <= 6);
}
static void edges_are_met_or_refused(void)
{
    const kr_vec3 turn = v3(0.3, -0.7, 0.5), lean = v3(0.0, 0.6, -0.4);
    for (int i = 1; i <= 8; i++) {
        const double e = pow(10.0, -i);
        const kr_vec3 d = v_scale(e, lean), w = v_scale(e, turn);
        const kr_scene edges[] = {
            seen_so(v3(-1.0, d.y, d.z), w),                           /* rest upright */
            seen_so(v3(1.0, d.y, d.z), w),                            /* rest hanging */
            seen_so(v3(-1.0, d.y, d.z), v_add(v3(1.3, 0.0, 0.0), w)), /* turning upright */
            seen_so(v3(cos(1.0), sin(1.0), d.z), v3(w.x, w.y, 1.1)),  /* pendulum about axis 3 */
            seen_so(v3(cos(1.0), d.y, sin(1.0)), v3(w.x, 1.1, w.z)),  /* pendulum about axis 2 */
            seen_so(v3(0.09 + e, -0.4, 0.912), v3(0.4, 0.5, 0.8)),    /* near Delone's motions */
            seen_so(v3(0.4, -0.3, 0.7), v_scale(1.0 / e, turn)),      /* fast */
        };
        for (size_t k = 0; k < sizeof edges / sizeof *edges; k++) {
            const kr_kowalewski *top = plan_of(&edges[k]);
            if (!top) continue;
            const double t = 10.0 / top->second;
            const double miss =
                error_of(&edges[k], kr_kowalewski_state(top, t), by_series(&edges[k], t));
            if (!(miss <= 1e-14 + 20.0 * top->certificate))
                printf("edge %d at 1e-%d: %.2g\n", (int)k, i, miss);
            NEAR(miss, 0.0, 1e-14 + 20.0 * top->certificate);
        }
    }
}
static int refusal_of(const kr_scene *s)
{
    const kr_kowalewski *top = NULL;
    IS(kr_kowalewski_plan(s, 0.0, memory, &top) == KR_ERR_METHOD && !top);
    return ((const kr_kowalewski *)memory)->refusal;
}
static void degenerate_motions_are_refused_by_name(void)
{
    const kr_vec3 none = v3(0.0, 0.0, 0.0);
    const kr_scene coincident[] = {
        seen_so(v3(1.0, 0.0, 0.0), none), /* rest */
        seen_so(v3(-1.0, 0.0, 0.0), none),
        seen_so(v3(1.0, 0.0, 0.0), v3(1.5, 0.0, 0.0)), /* permanent rotations */
        seen_so(v3(-1.0, 0.0, 0.0), v3(1.5, 0.0, 0.0)),
        seen_so(v3(0.6, 0.8, 0.0), v3(0.0, 0.0, 1.25)), /* pendulums */
        seen_so(v3(0.6, 0.8, 0.0), none),
    };
    for (size_t i = 0; i < sizeof coincident / sizeof *coincident; i++) {
        const int refusal = refusal_of(&coincident[i]);
        IS(refusal != KR_KOWALEWSKI_PLANNED && kr_kowalewski_refusal_text(refusal));
    }
    kr_scene s = seen_so(v3(0.4, -0.3, 0.7), v3(0.3, 0.5, 0.8));
    IS(plan_of(&s));
    s.damping = v3(0.0, 0.0, 1e-3);
    IS(refusal_of(&s) == KR_KOWALEWSKI_PLANNED); /* it is no question of the motion */
    s.damping = none;
    s.gravity = 0.0;
    IS(refusal_of(&s) == KR_KOWALEWSKI_PLANNED);
    s = tilted();
    IS(refusal_of(&s) == KR_KOWALEWSKI_PLANNED);
    IS(!kr_kowalewski_refusal_text(-1) && !kr_kowalewski_refusal_text(KR_KOWALEWSKI_REFUSAL_COUNT));
}
static void bad_arguments_are_refused(void)
{
    const kr_kowalewski *top = NULL;
    kr_scene s = seen_so(v3(0.4, -0.3, 0.7), v3(0.3, 0.5, 0.8));
    IS(kr_kowalewski_plan(NULL, 0.0, memory, &top) == KR_ERR_ARGUMENT);
    IS(kr_kowalewski_plan(&s, 0.0, NULL, &top) == KR_ERR_ARGUMENT);
    IS(kr_kowalewski_plan(&s, 0.0, memory, NULL) == KR_ERR_ARGUMENT);
    IS(kr_kowalewski_plan(&s, -1.0, memory, &top) == KR_ERR_ARGUMENT);
    IS(kr_kowalewski_plan(&s, NAN, memory, &top) == KR_ERR_ARGUMENT && !top);
    IS(kr_kowalewski_plan(&s, 1e-30, memory, &top) == KR_ERR_METHOD && !top);
    IS(((const kr_kowalewski *)memory)->refusal == KR_KOWALEWSKI_CERTIFICATE);
    s.start.q.w = 2.0;
    IS(kr_kowalewski_plan(&s, 0.0, memory, &top) == KR_ERR_ATTITUDE && !top);
}
/* A body that misses the ratio by a rounding is planned, and its plan says so. */
static void a_rounded_body_is_told(void)
{
    kr_scene s = seen_so(v3(0.4, -0.3, 0.7), v3(0.3, 0.5, 0.8));
    s.body.inertia = v3(0.2, 0.2, nextafter(0.1, 1.0));
    const kr_kowalewski *top = plan_of(&s);
    IS(top && top->mismatch > 1e-17 && top->mismatch < KR_KIND_RTOL);
}
/* Powers of two as units of mass, length and time change no bit. */
static void results_scale_with_powers_of_two(void)
{
    const kr_scene s = seen_so(v3(0.4, -0.3, 0.7), v3(0.3, 0.5, 0.8));
    kr_scene big = s;
    const double M = 0x1p40, L = 0x1p-7, T = 0x1p30;
    big.body.mass = M;
    big.body.inertia = v_scale(M * L * L, s.body.inertia);
    big.body.com = v_scale(L, s.body.com);
    big.gravity = L / (T * T);
    big.start.m = v_scale(M * L * L / T, s.start.m);
    const kr_kowalewski *top = plan_of(&s);
    const kr_state one = kr_kowalewski_state(top, 77.0);
    top = plan_of(&big);
    kr_state other = kr_kowalewski_state(top, 77.0 * T);
    other.t = 77.0;
    other.m = v_scale(T / (M * L * L), other.m);
    IS(same(one, other));
}
static void axes_of_description_change_nothing(void)
{
    for (int i = 0; i < 20; i++) {
        kr_scene s = drawn_top();
        const kr_kowalewski *top = plan_of(&s);
        const double t = 15.0 / top->second;
        const kr_state want = kr_kowalewski_state(top, t);
        s.body.axes = random_quat();
        s.start.q = q_unit(q_mul(s.start.q, q_conj(s.body.axes)));
        top = plan_of(&s);
        const kr_state got = kr_kowalewski_state(top, t);
        NEAR(kr_attitude_error(q_mul(got.q, s.body.axes), want.q), 0.0, 1e-11);
        NEAR(off(got.m, want.m) / scale_of(&s), 0.0, 1e-11);
    }
}
static void batches_and_instruction_sets_agree(void)
{
    enum { TIMES = 37 };
    double t[TIMES];
    kr_state many[TIMES];
    void *other = malloc(kr_kowalewski_size());
    for (int i = 0; i < TIMES; i++) t[i] = i % 2 ? -0.37 * i : 1e3 * i;
    t[5] = 1e300, t[11] = INFINITY, t[20] = NAN, t[TIMES - 1] = 1e40;
    for (int n = 0; n < 12; n++) {
        const kr_scene s = drawn_top();
        const kr_kowalewski *top = plan_of(&s);
        const kr_theta_sums *sums = (const kr_theta_sums *)(const void *)top;
        for (int i = 0; kr_kowalewski_isa_at(i); i++) {
            const kr_kowalewski_isa *isa = kr_kowalewski_isa_at(i);
            if (!isa->runs_here()) continue;
            memset(other, 0, isa->one->size());
            IS(isa->one->plan(&s, 0, 0.0, other) == KR_OK);
            const kr_theta_sums *its = other;
            IS(memcmp(its->turn, sums->turn, sizeof sums->turn) == 0);
            IS(memcmp(its->rows, sums->rows, sizeof sums->rows) == 0);
            isa->many(its, TIMES, t, many);
            for (int k = 0; k < TIMES; k++) {
                const kr_state want = kr_kowalewski_state(top, t[k]),
                               one = isa->one->state(its, t[k]);
                const int finite = isfinite(t[k]);
                IS(finite ? same(many[k], want) && same(one, want)
                          : isnan(many[k].q.w) && isnan(one.q.w) && isnan(want.m.x));
            }
        }
    }
    free(other);
}
/* The method `exact` gives the states of the plan, in tops, checkpoints and ensembles. */
static void tops_and_workers_give_the_same_states(void)
{
    enum { TOPS = 5, TIMES = 4 };
    const kr_method *exact = kr_method_find("exact");
    kr_scene scenes[TOPS];
    double t[TIMES];
    kr_state states[TOPS][TIMES];
    kr_outcome outcomes[TOPS];
    for (int i = 0; i < TOPS; i++) scenes[i] = drawn_top();
    for (int k = 0; k < TIMES; k++) t[k] = -2.0 * k * k - 1.0;
    kr_worker *worker = NULL;
    IS(kr_worker_create(exact, (kr_config){0}, 0, NULL, &worker) == KR_OK);
    const kr_tops tops = {.n = TOPS,
                          .scenes = scenes,
                          .times = TIMES,
                          .t = t,
                          .states = states[0],
                          .outcomes = outcomes};
    IS(kr_worker_run(worker, &tops) == KR_OK);
    kr_worker_free(worker);
    for (int i = 0; i < TOPS; i++) {
        const kr_kowalewski *top = plan_of(&scenes[i]);
        kr_top *own = make(&scenes[i], exact, (kr_config){.step = -1.0});
        IS(outcomes[i].status == KR_OK && outcomes[i].done == TIMES);
        for (int k = 0; k < TIMES; k++) {
            IS(kr_top_advance(own, t[k]) == KR_OK);
            const kr_state now = kr_top_state(own);
            IS(same(now, states[i][k]));
            NEAR(error_of(&scenes[i], now, kr_kowalewski_state(top, t[k])), 0.0, 3e-15);
        }
        kr_top_free(own);
    }
}
static void a_refused_reset_leaves_the_top_as_it_was(void)
{
    const kr_scene s = seen_so(v3(0.4, -0.3, 0.7), v3(0.3, 0.5, 0.8));
    kr_top *top = make(&s, kr_method_find("exact"), (kr_config){0}), *other = NULL;
    const kr_scene rest = seen_so(v3(1.0, 0.0, 0.0), v3(0.0, 0.0, 0.0));
    IS(kr_top_create(&rest, kr_method_find("exact"), (kr_config){0}, &other) == KR_ERR_METHOD);
    IS(kr_top_advance(top, 1.0) == KR_OK);
    IS(kr_top_reset(top, &rest.start) == KR_ERR_METHOD);
    IS(kr_top_advance(top, 5.0) == KR_OK);
    kr_top *fresh = make(&s, kr_method_find("exact"), (kr_config){0});
    IS(kr_top_advance(fresh, 5.0) == KR_OK);
    IS(same(kr_top_state(top), kr_top_state(fresh)));
    kr_top_free(fresh);
    kr_top_free(top);
}
static void checkpoints_go_on(void)
{
    const kr_scene s = seen_so(v3(0.4, -0.3, 0.7), v3(0.3, 0.5, 0.8)),
                   start = seen_so(v3(-0.4, 0.3, 0.7), v3(0.3, -0.5, 1.8));
    const kr_method *exact = kr_method_find("exact");
    kr_top *top = make(&s, exact, (kr_config){0}), *loaded = make(&s, exact, (kr_config){0});
    IS(kr_top_reset(top, &start.start) == KR_OK && kr_top_advance(top, 3.0) == KR_OK);
    const size_t size = kr_top_save_size(top);
    void *saved = malloc(size);
    IS(kr_top_save(top, size, saved) == KR_OK && kr_top_load(loaded, size, saved) == KR_OK);
    IS(kr_top_advance(top, 9.0) == KR_OK && kr_top_advance(loaded, 9.0) == KR_OK);
    IS(same(kr_top_state(top), kr_top_state(loaded)));
    free(saved);
    kr_top_free(top);
    kr_top_free(loaded);
}

int main(void)
{
    memory = malloc(kr_kowalewski_size());
    truths_by_heyoka_are_met();
    series_with_30_digits_are_met();
    integrals_are_constant();
    drawn_tops_are_planned();
    edges_are_met_or_refused();
    degenerate_motions_are_refused_by_name();
    bad_arguments_are_refused();
    a_rounded_body_is_told();
    results_scale_with_powers_of_two();
    axes_of_description_change_nothing();
    batches_and_instruction_sets_agree();
    tops_and_workers_give_the_same_states();
    a_refused_reset_leaves_the_top_as_it_was();
    checkpoints_go_on();
    free(memory);
    return check_result();
}
