/* Sections of a worker: no state is missed, and a top whose event does not occur is reported. */
#include "ensemble/slots.h"
#include "events/event_polynomial.h"
#include "event_helpers.h"

enum { TOPS = 37, MOST = 24 };
typedef struct {
    kr_scene scenes[TOPS];
    double wait[TOPS];
    kr_state states[TOPS * MOST];
    kr_outcome outcomes[TOPS];
} cut;

static void random_tops(cut *c, double wait)
{
    for (int i = 0; i < TOPS; i++) {
        c->scenes[i] = random_scene(i);
        if (i % 10 == 8) c->scenes[i].damping = v3(0.01, 0.02, 0.03);
        c->wait[i] = i % 5 == 2 ? -wait : wait;
    }
}
static kr_tops all_of(cut *c, size_t n)
{
    const kr_tops tops = {.n = n,
                          .scenes = c->scenes,
                          .times = MOST,
                          .t = c->wait,
                          .own_times = 1,
                          .states = c->states,
                          .outcomes = c->outcomes};
    memset(c->states, 0, sizeof c->states);
    memset(c->outcomes, 0, sizeof c->outcomes);
    return tops;
}
static void run(cut *c, size_t n, const kr_event *event, kr_config config)
{
    kr_worker *worker = make_worker(taylor(), config);
    const kr_tops tops = all_of(c, n);
    IS(kr_worker_section(worker, event, &tops) == KR_OK);
    kr_worker_free(worker);
}

static int same_row(const cut *a, size_t i, const cut *b, size_t j)
{
    for (size_t k = 0; k < a->outcomes[i].done; k++)
        if (!same(a->states[i * MOST + k], b->states[j * MOST + k])) return 0;
    return same_outcome(&a->outcomes[i], &b->outcomes[j]);
}

/* Checks that the states lie on the section, in the order of time. A single top that begins at the
 * start or at one of these states finds the next state, or no state after the last one. */
static void is_complete(const cut *c, size_t i, const kr_event *event)
{
    const kr_scene *s = &c->scenes[i];
    const kr_outcome *o = &c->outcomes[i];
    const double wait = c->wait[i];
    kr_event mine = *event;
    kr_top *top = watched(s, (kr_config){.step = kr_step_directed(0.0, wait < 0.0)}, &mine, 1);
    kr_state last = s->start;
    kr_event_hit hit;
    for (size_t k = 0; k < o->done; k++) {
        const kr_state *x = &c->states[i * MOST + k];
        IS(kr_top_reset(top, &last) == KR_OK);
        IS(kr_top_seek(top, last.t + wait, &hit) == KR_OK && hit.index == 0);
        NEAR(kr_top_state(top).t - last.t, x->t - last.t, 1e-7 * fabs(x->t - last.t));
        if (!event->extremum)
            NEAR(kr_terms_value(s, x, event->count, event->terms), 0.0,
                 1e-8 * (1.0 + v_length(x->m)));
        last = *x;
    }
    if (o->status == KR_ERR_EVENT) {
        IS(kr_top_reset(top, &last) == KR_OK && o->done < MOST);
        IS(kr_top_seek(top, last.t + wait, &hit) == KR_OK && hit.index < 0);
        NEAR(o->last.t, last.t + wait, 1e-12 * fabs(o->last.t));
        IS(isnan(c->states[i * MOST + o->done].t) && isnan(c->states[i * MOST + o->done].q.w));
    }
    kr_top_free(top);
}
static int none_is_missed(const kr_event *event, double wait)
{
    int failed = 0;
    cut c;
    random_tops(&c, wait);
    run(&c, TOPS, event, (kr_config){0});
    for (size_t i = 0; i < TOPS; i++) {
        const kr_status status = c.outcomes[i].status;
        IS((status == KR_OK && c.outcomes[i].done == MOST) || status == KR_ERR_EVENT);
        failed += status != KR_OK;
        is_complete(&c, i, event);
    }
    return failed;
}
static void test_instruction_sets(const kr_event *event)
{
    cut c, d;
    random_tops(&c, 40.0);
    d = c;
    run(&c, TOPS, event, (kr_config){0});
    kr_worker *worker = make_worker(taylor(), (kr_config){0});
    for (int i = 0; kr_lanes_isa_at(i); i++) {
        const kr_lanes_isa *isa = kr_lanes_isa_at(i);
        const int is_fused = strcmp(isa->name, "base") != 0;
        if (!isa->runs_here()) continue;
        kr_scheduler_set_kernel(worker, isa, worker->lanes->order, worker->lanes->log2_tol);
        const kr_tops tops = all_of(&d, TOPS);
        IS(kr_worker_section(worker, event, &tops) == KR_OK);
        for (size_t k = 0; k < TOPS; k++) {
            IS(!is_fused || strcmp(kr_lanes_isa_at(0)->name, "base") == 0 ||
               same_row(&c, k, &d, k));
            if (c.outcomes[k].done > 0)
                NEAR(d.states[k * MOST].t, c.states[k * MOST].t, 1e-8 * fabs(c.states[k * MOST].t));
        }
    }
    kr_worker_free(worker);
}
/* A Lagrange top has one lowest point in each period, at the largest nutation. */
static void test_lowest_points_of_lagrange_tops(const kr_event *event, double tol)
{
    cut c;
    c.scenes[0] = kr_scene_default();
    c.wait[0] = 100.0;
    const kr_exact *exact = closed_form(&c.scenes[0]);
    const kr_nutation turning = limits_of_nutation(&c.scenes[0]);
    run(&c, 1, event, (kr_config){.tol = tol});
    for (int k = 0; k < MOST; k++) {
        const double looser = 20.0 * fmax(tol, 1e-14);
        NEAR(c.states[k].t, turning.t_greatest + k * kr_exact_describe(exact).period,
             MOST * 100.0 * looser);
        NEAR(kr_state_nutation(&c.scenes[0], &c.states[k]), turning.greatest, looser);
    }
}
/* A top without an event is reported, in both directions of time, and so is a top that reaches its
 * limit of steps. */
static void test_outcomes(const kr_event *event)
{
    cut c;
    c.scenes[0] = c.scenes[1] = kr_scene_default();
    c.scenes[0].start.m = v3(0.0, 0.0, 1.0); /* exactly upright: it never reaches a lowest point */
    c.wait[0] = -7.0;
    c.wait[1] = 1000.0;
    run(&c, 2, event, (kr_config){.max_steps = 60});
    IS(c.outcomes[0].status == KR_ERR_EVENT && c.outcomes[0].done == 0);
    NEAR(c.outcomes[0].last.t, -7.0, 1e-14);
    IS(c.outcomes[1].status == KR_ERR_LIMIT && c.outcomes[1].done > 0 &&
       c.outcomes[1].done < MOST && isnan(c.states[MOST + c.outcomes[1].done].t));
}
static void test_interruption(const kr_event *event)
{
    int left = 40;
    cut c, d;
    random_tops(&c, 40.0);
    d = c;
    kr_worker *worker = make_worker(taylor(), (kr_config){.poll = stop_at, .context = &left});
    left = 40;
    kr_tops tops = all_of(&c, TOPS);
    IS(kr_worker_section(worker, event, &tops) == KR_ERR_INTERRUPTED);
    left = 1 << 30;
    tops = all_of(&d, TOPS);
    IS(kr_worker_section(worker, event, &tops) == KR_OK);
    size_t kept = 0;
    for (size_t i = 0; i < TOPS; i++) {
        const kr_outcome *o = &c.outcomes[i];
        if (o->status == KR_ERR_INTERRUPTED) kept += o->done;
        for (size_t k = 0; k < o->done; k++)
            IS(same(c.states[i * MOST + k], d.states[i * MOST + k]));
    }
    IS(kept > 0);
    kr_worker_free(worker);
}
static void test_refusals(const kr_event *good)
{
    cut c;
    kr_worker *worker = make_worker(taylor(), (kr_config){0}),
              *other = make_worker(NULL, (kr_config){0}),
              *level = make_worker(taylor(), (kr_config){.skip_heading = 1}),
              *grows = make_worker(taylor(), (kr_config){.tangents = KR_TANGENT_GROWTH});
    random_tops(&c, 40.0);
    const kr_tops tops = all_of(&c, 2);
    kr_event none = *good, bare = *good, aslant = *good, turning = *good;
    const kr_term apex_x = term(1.0, "apex_x", "1");
    none.count = 0;
    bare.terms = NULL;
    turning.terms = &apex_x;
    IS(kr_worker_section(worker, NULL, &tops) == KR_ERR_ARGUMENT);
    IS(kr_worker_section(worker, good, NULL) == KR_ERR_ARGUMENT);
    IS(kr_worker_section(NULL, good, &tops) == KR_ERR_ARGUMENT);
    IS(kr_worker_section(worker, &none, &tops) == KR_ERR_ARGUMENT);
    IS(kr_worker_section(worker, &bare, &tops) == KR_ERR_ARGUMENT);
    IS(kr_worker_section(grows, good, &tops) == KR_ERR_ARGUMENT);
    for (int i = 0; i < 4; i++) { /* no such direction or component */
        kr_term lost = term(1.0, "apex_z", "1");
        *(i == 2 ? &lost.first : &lost.second) = -7;
        aslant.direction = i == 0 ? -2 : i == 1 ? 2 : 0;
        if (i > 1) aslant.terms = &lost;
        IS(kr_worker_section(worker, &aslant, &tops) == KR_OK);
        IS(c.outcomes[0].status == KR_ERR_ARGUMENT && c.outcomes[1].status == KR_ERR_ARGUMENT);
    }
    const kr_tops none_asked = {.n = 2, .scenes = c.scenes, .outcomes = c.outcomes};
    IS(kr_worker_section(worker, good, &none_asked) == KR_OK);
    IS(c.outcomes[1].status == KR_OK && c.outcomes[1].done == 0);
    IS(kr_worker_section(other, good, &tops) == KR_ERR_NO_EVENTS);
    IS(kr_worker_section(level, &turning, &tops) == KR_OK);
    IS(c.outcomes[0].status == KR_ERR_ARGUMENT);
    IS(kr_worker_section(level, good, &tops) == KR_OK && c.outcomes[0].status == KR_OK);
    kr_worker_free(worker);
    kr_worker_free(other);
    kr_worker_free(level);
    kr_worker_free(grows);
}
int main(void)
{
    const kr_term height = term(1.0, "apex_z", "1"), level[] = {height, term(0.1, "1", "1")},
                  forms[] = {term(1.0, "body_velocity_x", "1"), term(0.5, "body_vertical_y", "1"),
                             term(-0.3, "spin", "1"), term(-0.05, "1", "1")},
                  square[] = {term(1.0, "apex_z", "spin"), term(0.2, "body_momentum_x", "1")},
                  turning[] = {term(1.0, "apex_x", "1")}, vertical[] = {term(1.0, "m_z", "1")},
                  above[] = {term(1.0, "m_x", "1")};
    const kr_event low = {.terms = &height, .count = 1, .extremum = 1, .direction = 1},
                   passing = {.terms = level, .count = 2},
                   mixed = {.terms = forms, .count = 4, .direction = -1},
                   fastest = {.terms = forms, .count = 4, .extremum = 1},
                   half = {.terms = &height,
                           .count = 1,
                           .extremum = 1,
                           .condition = above,
                           .condition_count = 1},
                   products = {.terms = square, .count = 2, .extremum = 1},
                   turns = {.terms = turning, .count = 1, .direction = 1},
                   constant = {.terms = vertical, .count = 1};
    IS(none_is_missed(&low, 60.0) == 0);
    IS(none_is_missed(&passing, 10.0) > 0);
    IS(none_is_missed(&mixed, 20.0) < TOPS);
    IS(none_is_missed(&fastest, 20.0) < TOPS);
    IS(none_is_missed(&half, 40.0) < TOPS);
    IS(none_is_missed(&products, 20.0) < TOPS);
    IS(none_is_missed(&turns, 40.0) < TOPS);
    IS(none_is_missed(&constant, 5.0) == TOPS);
    test_instruction_sets(&low);
    test_instruction_sets(&mixed);
    test_lowest_points_of_lagrange_tops(&low, 0.0);
    test_lowest_points_of_lagrange_tops(&low, 1e-6);
    test_outcomes(&low);
    test_interruption(&low);
    test_refusals(&low);
    return check_result();
}
