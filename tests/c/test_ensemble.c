/* Workers: the results of a top depend on that top alone, failures lose no states, and results in
 * lanes are as accurate as those of a single top. */
#include <stdlib.h>
#include "ensemble/slots.h"
#include "tops.h"

enum { TOPS = 141, TIMES = 7 }; /* more tops than are set up together */

typedef struct {
    kr_scene scenes[TOPS];
    double t[TOPS * TIMES];
    kr_state states[TOPS * TIMES];
    kr_outcome outcomes[TOPS];
    kr_tops tops;
} ensemble;
static void ask(ensemble *f, size_t n)
{
    const kr_tops tops = {.n = n,
                          .scenes = f->scenes,
                          .times = TIMES,
                          .t = f->t,
                          .own_times = 1,
                          .states = f->states,
                          .outcomes = f->outcomes};
    f->tops = tops;
    memset(f->states, 0, sizeof f->states);
    memset(f->outcomes, 0, sizeof f->outcomes);
}
/* Each top has its own times, in either direction of time; some of them are the time of the start.
 * Some tops are damped, one of them strongly, and some are on a support that rotates about e3. */
static void random_ensemble(ensemble *f)
{
    for (int i = 0; i < TOPS; i++) {
        const double span = uniform(0.5, 30.0) * (i % 5 == 2 ? -1.0 : 1.0);
        f->scenes[i] = random_scene(i);
        if (i % 6 == 4) f->scenes[i].damping = v3(0.01, i == 10 ? 1e4 : 0.02, 0.0);
        if (i % 6 == 5) f->scenes[i].turning.z = 0.7;
        for (int k = 0; k < TIMES; k++)
            f->t[i * TIMES + k] = i % 3 == 1 && k < 2 ? 0.0 : span * (k + 1) / TIMES;
    }
    ask(f, TOPS);
}
static int same_row(const ensemble *f, size_t i, const ensemble *g, size_t j)
{
    const size_t row = TIMES * sizeof(kr_state);
    return memcmp(f->states + i * TIMES, g->states + j * TIMES, row) == 0 &&
           same_outcome(&f->outcomes[i], &g->outcomes[j]);
}
/* Computes the states of one top of an ensemble alone. */
static ensemble one_of(const ensemble *f, size_t i, const kr_method *method, kr_config config)
{
    ensemble one;
    kr_worker *worker = make_worker(method, config);
    one.scenes[0] = f->scenes[i];
    memcpy(one.t, f->t + i * TIMES, TIMES * sizeof *one.t);
    ask(&one, 1);
    IS(kr_worker_run(worker, &one.tops) == KR_OK);
    kr_worker_free(worker);
    return one;
}
static void test_independence(const kr_method *method, kr_config config)
{
    ensemble f, g;
    random_ensemble(&f);
    g = f;
    ask(&g, TOPS);
    kr_worker *worker = make_worker(method, config);
    IS(kr_worker_run(worker, &f.tops) == KR_OK);
    for (size_t i = 0; i < TOPS; i++) {
        const ensemble one = one_of(&f, i, method, config);
        IS(f.outcomes[i].status == KR_OK && f.outcomes[i].done == TIMES);
        IS(same_row(&f, i, &one, 0));
    }
    /* in another order, and beside tops that fail */
    for (size_t i = 0; i < TOPS; i++) {
        const size_t from = TOPS - 1 - i;
        g.scenes[i] = f.scenes[from];
        memcpy(g.t + i * TIMES, f.t + from * TIMES, TIMES * sizeof *g.t);
        if (i % 7 == 0) g.scenes[i].start.m.y = NAN;
        if (i % 7 == 1) g.scenes[i].body.inertia.z = -1.0;
        if (i % 7 == 2) g.t[i * TIMES + 3] = INFINITY;
        if (i % 7 == 3) g.t[i * TIMES + 5] = -g.t[i * TIMES + 5];
    }
    ask(&g, TOPS);
    IS(kr_worker_run(worker, &g.tops) == KR_OK);
    for (size_t i = 0; i < TOPS; i++) {
        if (i % 7 > 3) IS(same_row(&g, i, &f, TOPS - 1 - i));
        IS(i % 7 > 3 || g.outcomes[i].status != KR_OK);
    }
    kr_worker_free(worker);
}
static void test_instruction_sets(void)
{
    const kr_config config = {0};
    ensemble f, g;
    random_ensemble(&f);
    g = f;
    ask(&g, TOPS);
    kr_worker *worker = make_worker(taylor(), config);
    IS(kr_worker_run(worker, &f.tops) == KR_OK);
    ask(&g, TOPS);
    for (int i = 0; kr_lanes_isa_at(i); i++) {
        const kr_lanes_isa *isa = kr_lanes_isa_at(i);
        const int is_fused = strcmp(isa->name, "base") != 0;
        if (!isa->runs_here()) continue;
        kr_scheduler_set_kernel(worker, isa, worker->lanes->order, worker->lanes->log2_tol);
        IS(kr_worker_run(worker, &g.tops) == KR_OK);
        for (size_t k = 0; k < TOPS; k++) {
            IS(!is_fused || strcmp(kr_lanes_isa_at(0)->name, "base") == 0 ||
               same_row(&f, k, &g, k));
            IS(distance(f.states[k * TIMES + 6], g.states[k * TIMES + 6]) < 1e-6);
        }
    }
    kr_worker_free(worker);
}
/* Results in lanes are as accurate as those of a single top; both are compared with a run of 20
 * digits. */
static void test_accuracy_of_lanes(double tol)
{
    const kr_config config = {.tol = tol};
    ensemble f;
    random_ensemble(&f);
    double lanes = 0.0, alone = 0.0;
    kr_worker *worker = make_worker(taylor(), config);
    IS(kr_worker_run(worker, &f.tops) == KR_OK);
    for (size_t i = 0; i < TOPS; i++) {
        const double t = f.t[i * TIMES + TIMES - 1];
        const double led = kr_step_directed(0.0, t < 0.0);
        const kr_config there = {.step = led, .digits = 20}, same_way = {.step = led, .tol = tol};
        const kr_state truth = state_at(t, &f.scenes[i], taylor(), there),
                       one = state_at(t, &f.scenes[i], taylor(), same_way);
        const double floor = 1e-14;
        lanes += log(floor + distance(f.states[i * TIMES + TIMES - 1], truth));
        alone += log(floor + distance(one, truth));
    }
    kr_worker_free(worker);
    IS(lanes / TOPS < alone / TOPS + log(2.0));
}

/* Interrupts a worker after `after` polls, and checks that all tops keep their states. Returns
 * twice the number of tops that were stopped after their first state, minus the number of lanes. */
static int interrupt_worker(int after)
{
    int left = after, on_the_way = 0, lanes;
    ensemble f;
    random_ensemble(&f);
    const kr_config config = {.poll = stop_at, .context = &left}, free = {0};
    kr_worker *worker = make_worker(NULL, config);
    memset(f.outcomes, 0, sizeof f.outcomes);
    IS(kr_worker_run(worker, &f.tops) == KR_ERR_INTERRUPTED);
    size_t done = 0;
    for (size_t i = 0; i < TOPS; i++) {
        const kr_outcome *o = &f.outcomes[i];
        done += o->status == KR_OK;
        IS(o->status == KR_OK ? o->done == TIMES : o->status == KR_ERR_INTERRUPTED);
        if (o->status != KR_OK && o->done > 0) {
            const ensemble one = one_of(&f, i, NULL, free);
            IS(memcmp(one.states, f.states + i * TIMES, o->done * sizeof(kr_state)) == 0);
        }
        IS(o->done == TIMES || isnan(f.states[i * TIMES + o->done].q.w));
        on_the_way += o->status != KR_OK && o->done > 0;
        IS(o->last.t == (o->done > 0 ? f.t[i * TIMES + o->done - 1] : 0.0));
    }
    IS(done < TOPS && (after == 0 || done > 0));
    left = 1 << 30;
    IS(kr_worker_run(worker, &f.tops) == KR_OK); /* The worker can be used again. */
    for (size_t i = 0; i < TOPS; i++) IS(f.outcomes[i].status == KR_OK);
    lanes = *worker->isa->lanes;
    kr_worker_free(worker);
    return 2 * on_the_way - lanes;
}
static int count_polls(void *context)
{
    ++*(int *)context;
    return 0;
}
/* A worker polls while it evaluates many states of a step, or of a closed form. */
static void test_polls_between_states(void)
{
    enum { MANY = 40000, FEW = 4 };
    static double t[MANY];
    static kr_state states[FEW * MANY];
    for (int k = 0; k < MANY; k++) t[k] = 1e-6 * (k + 1);
    for (int i = 0; i < 3; i++) {
        kr_scene s[FEW];
        kr_outcome outcomes[FEW];
        int polls = 0;
        for (int k = 0; k < FEW; k++) {
            s[k] = i == 0 ? tilted() : asymmetric(); /* closed form, scalar, lanes */
            if (i == 1) s[k].friction = 0.125;
        }
        const kr_config config = {.poll = count_polls, .context = &polls};
        const kr_tops tops = {
            .n = FEW, .scenes = s, .times = MANY, .t = t, .states = states, .outcomes = outcomes};
        kr_worker *worker = make_worker(NULL, config);
        IS(kr_worker_run(worker, &tops) == KR_OK);
        const int steps = i == 0 ? 1 : (int)outcomes[0].stats.steps * FEW;
        IS(polls >= FEW * MANY / 65536 && polls <= 2 * FEW + 3 * steps);
        for (int after = polls; after-- > 0;) { /* each poll can stop the worker */
            int left = after;
            kr_worker *other = make_worker(NULL, (kr_config){.poll = stop_at, .context = &left});
            IS(kr_worker_run(other, &tops) == KR_ERR_INTERRUPTED);
            kr_worker_free(other);
        }
        kr_worker_free(worker);
    }
}
static void test_refusals(void)
{
    kr_worker *worker = NULL;
    const kr_config config = {0}, no_tol = {.tol = NAN}, digits = {.digits = 40};
    const kr_reduction none = {NULL, 0, KR_REDUCE_MIN},
                       beyond = {kr_quantity_find("apex"), 3, KR_REDUCE_MIN},
                       kind = {kr_quantity_find("apex"), 0, KR_REDUCE_COUNT};
    ensemble f;
    random_ensemble(&f);
    IS(kr_worker_create(taylor(), no_tol, 0, NULL, &worker) == KR_ERR_ARGUMENT);
    IS(kr_worker_create(taylor(), digits, 0, NULL, &worker) == KR_ERR_ARGUMENT);
    IS(kr_worker_create(kr_method_find("rk4"), config, 0, NULL, &worker) == KR_ERR_NO_STEP);
    IS(kr_worker_create(NULL, config, 1, &none, &worker) == KR_ERR_ARGUMENT);
    IS(kr_worker_create(NULL, config, 1, NULL, &worker) == KR_ERR_ARGUMENT);
    IS(kr_worker_create(NULL, config, 1, &beyond, &worker) == KR_ERR_ARGUMENT);
    IS(kr_worker_create(NULL, config, 1, &kind, &worker) == KR_ERR_ARGUMENT);
    IS(kr_worker_create(NULL, config, 0, NULL, NULL) == KR_ERR_ARGUMENT && !worker);
    worker = make_worker(NULL, config);
    int order;
    IS(strcmp(kr_worker_kernel(worker, &order), worker->isa->name) == 0 && order == 20);
    IS(kr_worker_run(worker, NULL) == KR_ERR_ARGUMENT);
    IS(kr_worker_run(NULL, &f.tops) == KR_ERR_ARGUMENT);
    f.tops.outcomes = NULL;
    IS(kr_worker_run(worker, &f.tops) == KR_ERR_ARGUMENT);
    f.tops.outcomes = f.outcomes;
    f.tops.scenes = NULL;
    IS(kr_worker_run(worker, &f.tops) == KR_ERR_ARGUMENT);
    f.tops.scenes = f.scenes;
    f.tops.t = NULL;
    IS(kr_worker_run(worker, &f.tops) == KR_ERR_ARGUMENT);
    f.tops.times = 0;
    IS(kr_worker_run(worker, &f.tops) == KR_OK && f.outcomes[3].status == KR_OK);
    IS(f.outcomes[3].done == 0 && same(f.outcomes[3].last, f.scenes[3].start));
    f.tops.n = 0;
    f.tops.scenes = NULL;
    f.tops.outcomes = NULL;
    IS(kr_worker_run(worker, &f.tops) == KR_OK);
    kr_worker_free(worker);
    kr_worker_free(NULL);
}

int main(void)
{
    int on_the_way = 0;
    const kr_config plain = {0}, rough = {.tol = 1e-6};
    test_independence(taylor(), plain);
    test_independence(taylor(), rough);
    test_independence(NULL, plain);
    test_instruction_sets();
    test_accuracy_of_lanes(0.0);
    test_accuracy_of_lanes(1e-9);
    test_accuracy_of_lanes(1e-5);
    test_polls_between_states();
    for (int after = 0; after < 60; after++) on_the_way += interrupt_worker(after);
    IS(on_the_way >= 0);
    test_refusals();
    return check_result();
}
