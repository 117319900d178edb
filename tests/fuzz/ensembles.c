/* Calls of workers: the result of a top does not depend on the other tops. */
#include <math.h>
#include <string.h>
#include "calls.h"
#include "random_values.h"
#include "claims.h"
#include "scenes.h"
#include "tops.h"

enum { MOST = 19, TIMES = 4, REDUCTIONS = 3 };
static struct {
    kr_scene scenes[MOST];
    double t[MOST * TIMES];
    kr_reduction reduction[REDUCTIONS];
    kr_config config;
    const kr_method *method;
    size_t n, times, reductions;
    int own_times, directed;
    double direction[6]; /* direction of the tangents, if given */
    search watched;      /* for a section: its first event, if it has one */
    int watches;
} asked;
typedef struct answer {
    kr_state states[MOST * TIMES];
    double reduced[MOST * REDUCTIONS];
    double growth[MOST * TIMES * KR_GROWTH_COUNT];
    kr_outcome outcomes[MOST];
} answer;

static void choose_times(size_t i)
{
    const double pace = time_scale(&asked.scenes[i]), start = asked.scenes[i].start.t;
    double t = start;
    const double way = either_sign(pace);
    for (size_t k = 0; k < TIMES; k++) {
        t += odds(15) ? 0.0 : way * spread(1e-3, 30.0);
        asked.t[i * asked.times + k] = maybe_arbitrary(t, 3);
        if (k + 1 == asked.times) break;
    }
}
/* Chooses tangents, which only taylor supports; other methods refuse them. */
static void choose_tangents(void)
{
    asked.config.tangents = odds(20) ? KR_TANGENT_GROWTH : odds(2) ? choose(128) : 0;
    asked.directed = odds(30);
    for (int i = 0; i < 6; i++) asked.direction[i] = maybe_arbitrary(between(-1.0, 1.0), 3);
}
static void choose_all(void)
{
    const int alike = odds(60);
    asked.n = (size_t)choose(MOST + 1);
    asked.times = 1 + (size_t)choose(TIMES);
    asked.own_times = odds(60);
    asked.watches = odds(30);
    if (asked.watches) any_search(&asked.watched);
    for (size_t i = 0; i < MOST; i++) {
        asked.scenes[i] = any_scene();
        if (alike && i > 0) asked.scenes[i].body = asked.scenes[0].body;
    }
    for (size_t i = 0; i < MOST; i++) choose_times(i);
    asked.method = odds(50) ? any_method() : odds(50) ? kr_method_find("taylor") : NULL;
    const kr_config config = {.step =
                                  odds(50) ? 0.0 : time_scale(&asked.scenes[0]) * spread(1e-2, 1.0),
                              .tol = odds(50) ? 0.0 : maybe_arbitrary(spread(1e-16, 1e-2), 3),
                              .max_steps = 10 + longest() / 20,
                              .digits = odds(85) ? 0 : (int)choose(32),
                              .skip_heading = odds(10)};
    asked.config = config;
    choose_tangents();
    asked.reductions = (size_t)choose(REDUCTIONS + 1);
    for (size_t r = 0; r < REDUCTIONS; r++) {
        const kr_quantity *quantity = any_quantity();
        const kr_reduction reduction = {quantity, (size_t)choose(quantity->doubles),
                                        (kr_reduce)choose(KR_REDUCE_COUNT)};
        asked.reduction[r] = reduction;
    }
}
static const double *times_of(size_t i)
{
    return asked.t + (asked.own_times ? i * (asked.watches ? 1 : asked.times) : 0);
}
/* Runs n tops, from the i-th on. Returns 1 if the worker accepted the tops. */
static int move(kr_worker *worker, size_t i, size_t n, answer *a)
{
    const kr_tops tops = {.n = n,
                          .scenes = asked.scenes + i,
                          .times = asked.times,
                          .t = times_of(i),
                          .own_times = asked.own_times,
                          .states = a->states,
                          .reduced = a->reduced,
                          .growth = a->growth,
                          .direction = asked.directed ? asked.direction : NULL,
                          .outcomes = a->outcomes};
    fill_with_mark(a, sizeof *a);
    if (!asked.watches) {
        CLAIM(kr_worker_run(worker, &tops) == KR_OK);
        return 1;
    }
    const kr_event *event = asked.watched.count > 0 ? asked.watched.event : NULL;
    const int is_one = event && event->terms, fits = asked.method == kr_method_find("taylor");
    const kr_status status = kr_worker_section(worker, event, &tops);
    CLAIM(status == (!is_one || asked.config.tangents ? KR_ERR_ARGUMENT
                     : !fits                          ? KR_ERR_NO_EVENTS
                                                      : KR_OK));
    return status == KR_OK;
}
static void claim_top(size_t i, const answer *a)
{
    const kr_outcome *o = &a->outcomes[i];
    const double *t = times_of(i);
    const enum error_kind wrong = error_category(o->status);
    CLAIM((o->status == KR_OK) == (o->done == asked.times) && wrong != INTERRUPT);
    CLAIM(is_good(o->last) || wrong == INPUT);
    for (size_t k = 0; k < asked.times; k++) {
        const kr_state s = a->states[i * asked.times + k];
        CLAIM(asked.watches ? isnan(s.t) == (k >= o->done)
                            : s.t == t[k] || (isnan(s.t) && isnan(t[k])));
        CLAIM(k < o->done ? is_good(s) : isnan(s.q.w) && isnan(s.m.z));
    }
    for (size_t r = 0; r < asked.reductions && wrong != NONE; r++)
        CLAIM(isnan(a->reduced[i * asked.reductions + r]));
    const double *growth = a->growth + i * asked.times * KR_GROWTH_COUNT;
    for (size_t j = 0; asked.config.tangents && j < asked.times * KR_GROWTH_COUNT; j++)
        CLAIM(isnan(growth[j]) == (j >= o->done * KR_GROWTH_COUNT));
}
/* Returns 1 if the numbers are equal; NaNs count as equal. */
static int alike(const double *one, const double *other, size_t n)
{
    size_t i = 0;
    while (i < n && (one[i] == other[i] || (isnan(one[i]) && isnan(other[i])))) i++;
    return i == n;
}
static void claim_same(size_t i, const answer *a, const answer *one)
{
    const size_t row = asked.times * sizeof(kr_state) / sizeof(double);
    const kr_outcome *o = &a->outcomes[i], *p = &one->outcomes[0];
    CLAIM(alike((const double *)(a->states + i * asked.times), (const double *)one->states, row));
    CLAIM(alike(a->reduced + i * asked.reductions, one->reduced, asked.reductions));
    const size_t grown = asked.times * KR_GROWTH_COUNT;
    if (asked.config.tangents) CLAIM(alike(a->growth + i * grown, one->growth, grown));
    CLAIM(o->status == p->status && o->done == p->done);
    CLAIM(
        alike((const double *)&o->last, (const double *)&p->last, sizeof o->last / sizeof(double)));
    CLAIM(same_bits(&o->stats, &p->stats, sizeof o->stats));
}
void call_ensembles(void)
{
    static answer all, one;
    kr_worker *worker = NULL;
    choose_all();
    print_call("%zu tops at once by %s, step %a, tol %a, digits %d, tangents %d", asked.n,
               asked.method ? kr_method_describe(asked.method).name : "auto", asked.config.step,
               asked.config.tol, asked.config.digits, (int)asked.config.tangents);
    const kr_status status =
        kr_worker_create(asked.method, asked.config, asked.reductions, asked.reduction, &worker);
    CLAIM((status == KR_OK) == (worker != NULL) && (!status || error_category(status) == INPUT));
    if (status != KR_OK) return;
    int order = -1;
    CLAIM(kr_worker_kernel(worker, &order) != NULL && order >= 0);
    const int moved = move(worker, 0, asked.n, &all);
    for (size_t i = 0; i < asked.n && moved; i++) claim_top(i, &all);
    for (size_t i = 0; i < asked.n && moved; i++) {
        tell_scene(&asked.scenes[i]);
        print_detail("%s, %zu states of %zu", kr_status_text(all.outcomes[i].status),
                     all.outcomes[i].done, asked.times);
        move(worker, i, 1, &one);
        claim_same(i, &all, &one);
    }
    kr_worker_free(worker);
}
