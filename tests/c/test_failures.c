/* The state after a failed run is the last valid one, outputs are unchanged, and the top continues
 * as if it had not failed. */
#include <stdlib.h>
#include "driver/top.h"
#include "tops.h"

enum { TOPS = 60, TIMES = 5 };

static int is_state(const kr_state *s)
{
    return fabs(q_dot(s->q, s->q) - 1.0) < 1e-6 && v_finite(s->m) && isfinite(s->t);
}
static kr_scene wild_scene(const kr_method *method)
{
    kr_scene s = tilted();
    if (!kr_method_applies(method, &s.body)) s.body.com = v3(0, 0, 0); /* free */
    s.start.q = random_quat();
    s.start.m = v_scale(ldexp(1.0, (int)uniform(-3, 9)), random_vec(1.0));
    return s;
}
/* Returns 1 if the state after a failure belongs to the path: on the grid, or at a time requested
 * before. */
static int is_on_path(const kr_state *state, const kr_scene *s, const kr_method *method,
                      kr_config config)
{
    return same(*state, state_at(state->t, s, method, config));
}
/* Advances a top to random times until it fails. Returns 1 if it has failed. */
static int run_until_failure(const kr_method *method, kr_config config)
{
    const kr_scene s = wild_scene(method);
    kr_state out[TIMES], marked[TIMES];
    double t[TIMES];
    size_t done = 0;
    kr_top *top = NULL;
    if (kr_top_create(&s, method, config, &top) != KR_OK) return 0;
    for (int i = 0; i < TIMES; i++) t[i] = (i ? t[i - 1] : 0.0) + config.step * uniform(0.2, 40.0);
    memset(out, 0x55, sizeof out);
    memcpy(marked, out, sizeof out);
    const kr_status why = kr_top_record(top, TIMES, t, out, NULL, &done);
    if (why != KR_OK) {
        const kr_state last = kr_top_state(top);
        IS(is_state(&last) && is_on_path(&last, &s, method, config));
        IS(memcmp(out + done, marked + done, sizeof *out * (TIMES - done)) == 0);
        IS(!done || last.t * config.step >= t[done - 1] * config.step);
        for (size_t i = 0; i < done; i++) IS(is_state(&out[i]));
        /* A side step off the grid may fail while a later time succeeds. */
        const kr_status again = kr_top_advance(top, t[TIMES - 1]);
        const kr_state then = kr_top_state(top);
        IS(is_state(&then) && (again == KR_OK || is_on_path(&then, &s, method, config)));
    }
    kr_top_free(top);
    return why != KR_OK;
}
static void test_wild_steps(void)
{
    int failed = 0;
    for (size_t i = 0; kr_method_at(i); i++) {
        const kr_method *method = kr_method_at(i);
        if (kr_method_describe(method).flags & KR_METHOD_ADAPTIVE) continue;
        for (int k = 0; k < TOPS; k++)
            failed +=
                run_until_failure(method, (kr_config){.step = ldexp(k % 2 ? 1.0 : -1.0, k % 7)});
    }
    IS(failed > 50);
}
/* The state overflows between two inspections, and the requested time lies off the grid. */
static void test_failure_between_inspections(void)
{
    const kr_scene s = kr_scene_default();
    const kr_config config = {.step = 4.0};
    for (double end = 4.0; end < 200.0; end += 4.0) {
        kr_top *top = make(&s, kr_method_find("rk4"), config);
        const kr_status status = kr_top_advance(top, end + 1.0);
        const kr_state last = kr_top_state(top);
        IS(status == KR_OK || status == KR_ERR_NOT_FINITE);
        IS(is_state(&last) && (status != KR_OK || last.t == end + 1.0));
        kr_top_free(top);
    }
}

static int stop(void *context) { return (void)context, 1; }
/* After a failure between two grid points, the top does not return to the first of them. */
static void test_no_way_back(void)
{
    const kr_scene s = tilted();
    const kr_config config = {.step = 0.1, .poll = stop};
    kr_top *top = make(&s, kr_method_find("strang"), config);
    kr_status status = KR_OK;
    double t = 0.25, last = 0.0;
    while (status == KR_OK && t < 0.29) {
        last = t;
        status = kr_top_advance(top, t += 1e-4);
    }
    IS(status == KR_ERR_INTERRUPTED && kr_top_state(top).t == last &&
       kr_top_describe(top).time < last);
    kr_top_free(top);
}
/* After a failure the top stands at its last valid state and cannot go to an earlier time. */
static void test_state_after_failure(void)
{
    const kr_scene s = tilted();
    const kr_config config = {.step = 0.1, .max_steps = 30};
    kr_top *top = make(&s, kr_method_find("strang"), config);
    IS(kr_top_advance(top, 0.25) == KR_OK && kr_top_advance(top, 9.0) == KR_ERR_LIMIT);
    NEAR(kr_top_state(top).t, 3.0, 1e-14);
    IS(kr_top_advance(top, 2.9) == KR_ERR_TIME);
    IS(same(kr_top_state(top),
            state_at(30 * 0.1, &s, kr_method_find("strang"), (kr_config){.step = 0.1})));
    kr_top_free(top);
}
static int stop_once(void *context) { return --*(int *)context == 0; }
/* The poll is also called if many states lie in one step. */
static void test_stop_within_a_step(void)
{
    enum { MANY = 3000, EVERY = 1024 };
    static double t[MANY];
    static kr_state out[MANY];
    const kr_scene s = kr_scene_default();
    size_t done = 0;
    kr_top *top = make(&s, kr_method_find("exact"), (kr_config){0});
    for (int i = 0; i < MANY; i++) t[i] = 1e-6 * (i + 1);
    IS(kr_top_record(top, MANY, t, out, NULL, &done) == KR_OK && done == MANY);
    kr_top_free(top);
    top = make(&s, kr_method_find("exact"), (kr_config){.poll = stop});
    IS(kr_top_record(top, MANY, t, out, NULL, &done) == KR_ERR_INTERRUPTED && done < EVERY);
    kr_top_free(top);
    int left = 1;
    top = make(&s, taylor(), (kr_config){.poll = stop_once, .context = &left});
    IS(kr_top_record(top, MANY, t, out, NULL, &done) == KR_ERR_INTERRUPTED && done == EVERY - 1);
    kr_top_free(top);
}
/* Units outside the range of doubles are refused. */
static void test_missing_units(void)
{
    kr_scene s = tilted();
    kr_top *top = NULL;
    s.body.inertia = v_scale(1e298, s.body.inertia), s.start.m = v3(0.0, 1e308, 0.0);
    IS(kr_top_create(&s, taylor(), (kr_config){0}, &top) == KR_ERR_ARGUMENT && !top);
    s.body.inertia = v3(1e-200, 1e-200, 1e-200), s.start.m = v3(0.0, 1e200, 0.0);
    IS(kr_top_create(&s, taylor(), (kr_config){0}, &top) != KR_OK && !top);
}

static int count_calls(void *context)
{
    ++*(int *)context;
    return 0;
}
/* Returns a random top, with or without gravity. With a loose tolerance, its side steps do not
 * always succeed. */
static kr_scene loose_scene(void)
{
    const kr_vec3 a = v3(uniform(0.3, 1.3), uniform(0.3, 1.3), uniform(0.3, 1.3));
    const kr_scene s = {.body = {.mass = 1.0,
                                 .inertia = {a.y + a.z, a.z + a.x, a.x + a.y},
                                 .com = random_vec(1.0),
                                 .axes = {1, 0, 0, 0}},
                        .gravity = random_bits() % 2 ? 1.0 : 0.0,
                        .start = {0.0, {1, 0, 0, 0}, random_vec(3.0)}};
    return s;
}
/* With a loose tolerance a step may be accepted although the side motion within it does not reach
 * its end. The side motion polls in every step, and ends at a limit. */
static void test_no_resolution_between_steps(const char *name, int limit)
{
    enum { SCENES = 400, LOOKS = 20 };
    int64_t most = 0;
    int stuck = 0;
    for (int k = 0; k < SCENES; k++) {
        const kr_scene s = loose_scene();
        int calls = 0;
        const kr_config config = {
            .tol = uniform(0.25, 0.99), .max_steps = limit, .poll = count_calls, .context = &calls};
        kr_top *top = make(&s, kr_method_find(name), config);
        kr_status status = KR_OK;
        double t = 0.0;
        int64_t before = 0;
        for (int i = 0; i < LOOKS && status == KR_OK; i++) {
            before = kr_top_describe(top).stats.steps - calls;
            status = kr_top_advance(top, t += uniform(0.0, 20.0));
        }
        const kr_state last = kr_top_state(top);
        const kr_stats stats = kr_top_describe(top).stats;
        if (status == KR_ERR_LIMIT && stats.steps < limit)
            IS(before - (stats.steps - calls) == (limit < 1024 ? limit : 1024));
        IS(status == KR_OK || status == KR_ERR_LIMIT || status == KR_ERR_STEP ||
           status == KR_ERR_NOT_FINITE);
        IS(is_state(&last) && calls >= stats.steps);
        stuck += status != KR_OK;
        if (stats.evaluations > most) most = stats.evaluations;
        kr_top_free(top);
    }
    IS(stuck > 0 && most < 100 * (limit + 1024) * LOOKS);
}
/* Checks that after an interrupted side step the state at the end of the previous step can still be
 * reached, with the same bits. Returns 1 if a side step was interrupted. */
static int stopped_aside(const char *name, const kr_scene *s, double tol, int calls)
{
    int left = 0, back = 0;
    const kr_config config = {.tol = tol, .poll = stop_once, .context = &left};
    kr_top *top = make(s, kr_method_find(name), config),
           *twin = make(s, kr_method_find(name), config);
    kr_status status = kr_top_step(twin);
    const kr_state first = kr_top_state(twin);
    if (status == KR_OK) status = kr_top_step(twin);
    const double second = kr_top_state(twin).t;
    if (status == KR_OK && kr_top_advance(top, 0.5 * first.t) == KR_OK) {
        left = calls;
        status = kr_top_advance(top, first.t + 0.9 * (second - first.t));
        left = 0;
        if (status == KR_ERR_INTERRUPTED && top->main.clock == second) {
            back = 1;
            IS(kr_top_advance(top, first.t) == KR_OK && same(kr_top_state(top), first));
        }
    }
    kr_top_free(top);
    kr_top_free(twin);
    return back;
}
static void test_stops_between_steps(const char *name)
{
    int back = 0;
    for (int i = 0; i < 4000; i++) {
        const kr_scene s = loose_scene();
        const double tol = uniform(0.25, 0.99);
        for (int calls = 1; calls < 6; calls++) back += stopped_aside(name, &s, tol, calls);
    }
    IS(back > 0);
}

/* Statistics include the work of failed steps. */
static void test_counts(void)
{
    const kr_config config = {.step = 4.0};
    const kr_scene s = tilted();
    kr_top *top = make(&s, kr_method_find("rk4"), config);
    int64_t last = 0;
    for (int i = 1; i < 40; i++) {
        const kr_status status = kr_top_advance(top, i < 39 ? 0.1 * i : 400.0);
        const int64_t now = kr_top_describe(top).stats.evaluations;
        IS(now > last && status == (i < 39 ? KR_OK : KR_ERR_NOT_FINITE));
        last = now;
    }
    kr_top_free(top);
}

static kr_worker *exactly(kr_config config)
{
    kr_worker *worker = make_worker(kr_method_find("exact"), config);
    return worker;
}
/* Many states of closed forms are computed in pieces, and a run can be stopped between two
 * pieces. */
static void test_stop_among_states(void)
{
    enum { MANY = 3 << 15 };
    static double t[MANY];
    static kr_state whole[2 * MANY], states[2 * MANY];
    const kr_scene scenes[2] = {kr_scene_default(), tilted()};
    kr_outcome outcomes[2];
    int left = 1;
    const kr_config config = {.poll = stop_once, .context = &left};
    for (int k = 0; k < MANY; k++) t[k] = 1e-3 * k;
    kr_tops tops = {
        .n = 2, .scenes = scenes, .times = MANY, .t = t, .states = whole, .outcomes = outcomes};
    kr_worker *worker = exactly((kr_config){0}), *stopped = exactly(config);
    int order = 7;
    IS(strcmp(kr_worker_kernel(worker, &order), "") == 0 && order == 0);
    IS(kr_worker_run(worker, &tops) == KR_OK && outcomes[1].done == MANY);
    tops.states = states;
    IS(kr_worker_run(stopped, &tops) == KR_ERR_INTERRUPTED);
    const size_t done = outcomes[0].done;
    IS(outcomes[0].status == KR_ERR_INTERRUPTED && done > 0 && done < MANY);
    IS(memcmp(states, whole, done * sizeof *states) == 0 && isnan(states[done].q.w));
    IS(same(outcomes[0].last, whole[done - 1]));
    IS(outcomes[1].status == KR_ERR_INTERRUPTED && outcomes[1].done == 0);
    kr_worker_free(worker);
    kr_worker_free(stopped);
}

int main(void)
{
    test_stops_between_steps("extrap");
    test_counts();
    test_wild_steps();
    test_failure_between_inspections();
    test_no_way_back();
    test_state_after_failure();
    test_stop_within_a_step();
    test_stop_among_states();
    test_missing_units();
    test_no_resolution_between_steps("extrap_kirchhoff", 1000);
    test_no_resolution_between_steps("extrap", 1000);
    test_no_resolution_between_steps("extrap_kirchhoff", 3000);
    return check_result();
}
