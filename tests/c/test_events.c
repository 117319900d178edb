/* Event search: the times of events, the path, which a search does not change, refusals and
 * failures. */
#include "driver/top.h"
#include "events/event_polynomial.h"
#include "model/quantities.h"
#include "taylor/taylor.h"
#include "event_helpers.h"

static kr_term height; /* of the apex; set by main */

/* Without the heading, events of quantities that do not depend on the heading are found at the same
 * times. */
static void test_headless(void)
{
    static const char *const turning[] = {"q_w", "q_z", "apex_x", "apex_y", "m_x", "m_y"};
    const kr_scene s = event_scene(1);
    const kr_term g[] = {height, term(0.2, "m_z", "body_vertical_x"),
                         term(0.1, "spin", "body_momentum_y")};
    kr_event e = {.terms = g, .count = 3, .extremum = 1}, f = e;
    double t[MANY], u[MANY];
    kr_top *whole = watched(&s, (kr_config){0}, &e, 1),
           *level = watched(&s, (kr_config){.skip_heading = 1}, &f, 1);
    const int n = seek_all(whole, 20.0, t, NULL);
    IS(n > 5 && seek_all(level, 20.0, u, NULL) == n);
    for (int i = 0; i < n; i++) NEAR(u[i], t[i], 1e-11);
    for (size_t i = 0; i < sizeof turning / sizeof *turning; i++) {
        const kr_term product = term(1.0, "spin", turning[i]);
        const kr_term turned = term(1.0, turning[i], "spin");
        kr_event turns = {.terms = &product, .count = 1}, other = {.terms = &turned, .count = 1};
        IS(kr_top_watch(whole, 1, &turns) == KR_OK &&
           kr_top_watch(level, 1, &turns) == KR_ERR_ARGUMENT);
        IS(kr_top_watch(level, 1, &other) == KR_ERR_ARGUMENT);
    }
    kr_top_free(whole);
    kr_top_free(level);
}

static void test_unchanged_path(void)
{
    const kr_term precession[] = {term(1.0, "body_vertical_x", "body_velocity_x"),
                                  term(1.0, "body_vertical_y", "body_velocity_y"),
                                  term(1.0, "body_vertical_z", "body_velocity_z"),
                                  term(-1.0, "apex_z", "spin")};
    for (int digits = 16; digits <= 30; digits += 7) {
        const kr_scene s = event_scene(1);
        kr_event e[2] = {{.terms = precession, .count = 4},
                         {.terms = &height, .count = 1, .extremum = 1}};
        const kr_config config = {.digits = digits};
        kr_top *top = watched(&s, config, e, 2), *plain = watched(&s, config, NULL, 0);
        kr_event_hit hit = {-1, 0};
        int found = 0;
        for (int i = 1; i <= 200; i++) {
            const double t = 0.1 * i;
            while (kr_top_seek(top, t, &hit) == KR_OK && hit.index >= 0) found++;
            IS(hit.index == -1 && kr_top_advance(plain, t) == KR_OK);
            const kr_state a[2] = {kr_top_state(top), kr_top_describe(top).low};
            const kr_state b[2] = {kr_top_state(plain), kr_top_describe(plain).low};
            IS(memcmp(a, b, sizeof a) == 0);
        }
        IS(found > 5 && kr_top_describe(top).stats.steps == kr_top_describe(plain).stats.steps);
        kr_top_free(top);
        kr_top_free(plain);
    }
}

/* The apex passes a height exactly once, even if a step ends at this height up to the last bits. */
static void test_step_borders(double start, double apart, double step)
{
    kr_scene s = event_scene(1);
    const kr_config config = {.step = step};
    s.start.t = start;
    kr_top *top = watched(&s, config, NULL, 0);
    for (int k = 0; k < 60; k++) {
        IS(kr_top_step(top) == KR_OK);
        const kr_state border = kr_top_state(top);
        const double level = kr_terms_value(&s, &border, 1, &height);
        for (int off = -20; off <= 20; off++) {
            const kr_term g[] = {height, term(-(level + off * apart), "1", "1")};
            kr_event e = {.terms = g, .count = 2};
            double t[MANY];
            int here = 0;
            kr_top *other = watched(&s, config, &e, 1);
            const int n = seek_all(other, border.t + (step < 0.0 ? -0.5 : 0.5), t, NULL);
            for (int i = 0; i < n; i++) here += fabs(t[i] - border.t) < 1e-7;
            IS(here == 1);
            kr_top_free(other);
        }
    }
    kr_top_free(top);
}
/* Events that were passed between two searches, in the same step or in later ones, are not found
 * again. Later events are found at the same times. */
static void test_passed_events(void)
{
    const kr_scene s = event_scene(1);
    double all[MANY];
    kr_event e = {.terms = &height, .count = 1, .extremum = 1}, f = e;
    kr_top *whole = watched(&s, (kr_config){0}, &e, 1);
    const int n = seek_all(whole, 20.0, all, NULL);
    for (int i = 0; i + 1 < n; i++)
        for (double gap = 1e-6; gap < 20.0; gap *= 2.0) {
            const double before = all[i] - 1e-6, after = all[i] + gap;
            int next = i + 1;
            kr_event_hit hit;
            kr_top *top = watched(&s, (kr_config){0}, &f, 1);
            IS(kr_top_advance(top, before) == KR_OK);
            IS(kr_top_seek(top, before + 1e-9, &hit) == KR_OK && hit.index < 0);
            IS(kr_top_advance(top, after) == KR_OK);
            while (next < n && all[next] < after) next++;
            IS(kr_top_seek(top, 20.0, &hit) == KR_OK || after > 20.0);
            if (next < n) NEAR(kr_top_state(top).t, all[next], 1e-11);
            kr_top_free(top);
        }
    kr_top_free(whole);
}
static void test_two_in_one_step(void)
{
    const kr_scene s = event_scene(1);
    kr_event top_most = {.terms = &height, .count = 1, .extremum = 1, .direction = -1};
    double at[MANY], t[MANY];
    kr_event_hit hits[MANY];
    kr_top *top = watched(&s, (kr_config){0}, &top_most, 1);
    const int n = seek_all(top, 40.0, at, NULL);
    IS(n > 5);
    kr_top_free(top);
    for (int i = 0; i < n; i++) {
        const double steps[] = {1e-2, 1e-4, 1e-6};
        kr_top *to = watched(&s, (kr_config){0}, NULL, 0);
        IS(kr_top_advance(to, at[i]) == KR_OK);
        const kr_step_polynomial piece = to->method->polynomial(&to->main);
        const double length = (piece.end - piece.begin) * to->time_unit;
        const kr_state peak = kr_top_state(to);
        for (int k = 0; k < 3; k++) {
            const double aside = 0.5 * steps[k] * length;
            IS(kr_top_reset(to, &s.start) == KR_OK && kr_top_advance(to, at[i] - aside) == KR_OK);
            const kr_state before = kr_top_state(to);
            const kr_term g[] = {height, term(-kr_terms_value(&s, &before, 1, &height), "1", "1")};
            kr_event e = {.terms = g, .count = 2};
            kr_top *other = watched(&s, (kr_config){0}, &e, 1);
            const int m = seek_all(other, at[i] + length, t, hits);
            int up = 0, down = 0;
            for (int j = 0; j < m; j++) {
                up += fabs(t[j] - peak.t) < 2.0 * aside && hits[j].direction == 1;
                down += fabs(t[j] - peak.t) < 2.0 * aside && hits[j].direction == -1;
            }
            IS(up == 1 && down == 1);
            kr_top_free(other);
        }
        kr_top_free(to);
    }
}

/* Each event is found once by a top that starts at a late time, and by a top for which kr_top_watch
 * is called again. */
static void test_events_at_the_start(void)
{
    const kr_scene s = event_scene(1);
    kr_scene late = s;
    kr_event e[2] = {{.terms = &height, .count = 1, .extremum = 1},
                     {.terms = &height, .count = 1, .extremum = 1}};
    double t[MANY], u[MANY];
    late.start.t = 12345.6789;
    kr_top *top = watched(&s, (kr_config){0}, e, 1),
           *other = watched(&late, (kr_config){0}, e + 1, 1);
    const int n = seek_all(top, 30.0, t, NULL);
    IS(n > 5 && seek_all(other, late.start.t + 30.0, u, NULL) == n);
    /* late times are rounded */
    for (int i = 0; i < n; i++) NEAR(u[i] - late.start.t, t[i], 4e-12);
    IS(kr_top_reset(top, &s.start) == KR_OK && seek_all(top, 30.0, u, NULL) == n);
    IS(memcmp(t, u, (size_t)n * sizeof *t) == 0);
    IS(kr_top_reset(top, &s.start) == KR_OK);
    for (int i = 0; i < n; i++) {
        kr_event_hit hit;
        IS(kr_top_seek(top, 30.0, &hit) == KR_OK && hit.index == 0);
        NEAR(kr_top_state(top).t, t[i], 1e-13);
        IS(kr_top_watch(top, 1, e) == KR_OK);
    }
    kr_scene on = s;
    on.start = kr_top_state(top);
    on.start.q = q_unit(on.start.q);
    kr_top *again = watched(&on, (kr_config){0}, e, 1);
    kr_event_hit hit;
    IS(kr_top_seek(again, 60.0, &hit) == KR_OK && hit.index == 0 &&
       kr_top_state(again).t > t[n - 1] + 0.1);
    kr_top_free(top);
    kr_top_free(other);
    kr_top_free(again);
}
static void test_simultaneous_events(void)
{
    const kr_scene s = event_scene(1);
    kr_event e[3] = {
        {.terms = &height, .count = 1, .extremum = 1},
        {.terms = &height, .count = 1, .extremum = 1},
        {.terms = &height, .count = 1, .extremum = 1, .condition = &height, .condition_count = 1}};
    double t[MANY];
    kr_event_hit hits[MANY];
    int above = 0;
    kr_top *top = watched(&s, (kr_config){0}, e, 3);
    const int n = seek_all(top, 20.0, t, hits);
    for (int i = 0; i < n; i++) {
        if (hits[i].index == 0) IS(hits[i + 1].index == 1 && t[i + 1] == t[i]);
        above += hits[i].index == 2;
    }
    IS(above > 0 && above < n / 3);
    kr_top_free(top);
}
static void test_agreement_of_kernels(void)
{
    const kr_term g[] = {term(1.0, "m_x", "apex_y"), term(-1.0, "m_y", "apex_x")};
    const kr_scene s = event_scene(2);
    double first[MANY], t[MANY];
    int n = 0;
    for (int i = 0; kr_taylor_isa(i) != NULL; i++) {
        kr_event e = {.terms = g, .count = 2};
        kr_top *top = watched(&s, (kr_config){0}, &e, 1);
        if (kr_taylor_isa(i)->runs_here()) {
            kr_taylor_set_kernel(&top->main, &kr_taylor_isa(i)->plain[KR_ORDER_28], -53.0);
            const int m = seek_all(top, 10.0, n ? t : first, NULL);
            IS(m > 3 && (!n || m == n));
            for (int k = 0; n && k < n; k++) NEAR(t[k], first[k], 1e-11);
            n = m;
        }
        kr_top_free(top);
    }
}

static void test_refusals(void)
{
    const kr_scene s = event_scene(0);
    const kr_term nothing = term(0.0, "apex_z", "1"), bad = term(NAN, "apex_z", "1");
    const kr_term odd = {1.0, kr_component_find("apex_z") + 100 * KR_QUANTITIES, KR_COMPONENT_ONE},
                  odder = {1.0, KR_COMPONENT_ONE, odd.first};
    const kr_term vast[2] = {term(1e308, "m_x", "1"), term(1e308, "m_y", "1")};
    kr_event good = {.terms = &height, .count = 1},
             wrong[] = {{.terms = NULL, .count = 1},
                        {.terms = &height, .count = 0},
                        {.terms = &nothing, .count = 1},
                        {.terms = &bad, .count = 1},
                        {.terms = &odd, .count = 1},
                        {.terms = &odder, .count = 1},
                        {.terms = vast, .count = 2},
                        {.terms = &height, .count = 1, .direction = 2},
                        {.terms = &height, .count = 1, .condition = &bad, .condition_count = 1}};
    kr_event_hit hit = {7, 7};
    kr_top *top = watched(&s, (kr_config){0}, &good, 1), *rk4 = NULL;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        IS(kr_top_watch(top, 1, &wrong[i]) == KR_ERR_ARGUMENT);
    IS(top->event_count == 1 && top->events == &good);
    IS(kr_top_watch(NULL, 0, NULL) == KR_ERR_ARGUMENT &&
       kr_top_watch(top, 1, NULL) == KR_ERR_ARGUMENT);
    IS(kr_top_seek(NULL, 1.0, &hit) == KR_ERR_ARGUMENT &&
       kr_top_seek(top, 1.0, NULL) == KR_ERR_ARGUMENT);
    IS(kr_top_seek(top, NAN, &hit) == KR_ERR_ARGUMENT &&
       kr_top_seek(top, -1.0, &hit) == KR_ERR_TIME);
    IS(hit.index == 7 && kr_top_watch(top, 0, NULL) == KR_OK);
    IS(kr_top_seek(top, 50.0, &hit) == KR_OK && hit.index == -1 && kr_top_state(top).t == 50.0);
    kr_top_free(top);
    IS(kr_top_create(&s, kr_method_find("rk4"), (kr_config){.step = 0.1}, &rk4) == KR_OK);
    IS(kr_top_watch(rk4, 1, &good) == KR_ERR_NO_EVENTS && kr_top_watch(rk4, 0, NULL) == KR_OK);
    IS(kr_top_seek(rk4, 1.0, &hit) == KR_OK && hit.index == -1 && kr_top_state(rk4).t == 1.0);
    kr_top_free(rk4);
}
/* Every event is searched from the beginning, whatever the memory that the user provides
 * contains. */
static void test_lent_memory(void)
{
    enum { EVENTS = 3 };
    const kr_scene s = event_scene(0);
    const kr_term rise = term(1.0, "apex_z", "1");
    kr_event dirty[EVENTS], clean[EVENTS];
    kr_event_hit hit, wanted;
    kr_top *top = make(&s, taylor(), (kr_config){0}), *other = make(&s, taylor(), (kr_config){0});
    for (int i = 0; i < EVENTS; i++) {
        clean[i] = (kr_event){.terms = &rise, .count = 1, .extremum = 1, .direction = i - 1};
        dirty[i] = clean[i];
        kr_event_store_search(
            &dirty[i], (kr_event_search){.searched = 1, .mark = 0.9, .next = 0.5, .side = 1});
    }
    IS(kr_top_watch(top, EVENTS, dirty) == KR_OK && kr_top_watch(other, EVENTS, clean) == KR_OK);
    for (int i = 0; i < 8; i++) {
        IS(kr_top_seek(top, 30.0, &hit) == KR_OK && kr_top_seek(other, 30.0, &wanted) == KR_OK);
        IS(hit.index == wanted.index && hit.direction == wanted.direction);
        IS(same(kr_top_state(top), kr_top_state(other)));
    }
    kr_top_free(top);
    kr_top_free(other);
}
static void test_failures(void)
{
    const kr_scene s = event_scene(0);
    const kr_term still = term(1.0, "m_z", "1");
    kr_event e[2] = {{.terms = &height, .count = 1, .extremum = 1},
                     {.terms = &still, .count = 1, .extremum = 1}};
    kr_event_hit hit = {7, 7};
    kr_top *top = watched(&s, (kr_config){.max_steps = 3}, e, 2);
    for (; kr_top_seek(top, 100.0, &hit) == KR_OK; hit.index = 7) IS(hit.index == 0);
    IS(kr_top_seek(top, 100.0, &hit) == KR_ERR_LIMIT && hit.index == 7 &&
       kr_top_describe(top).stats.steps == 3);
    kr_top *other = make(&s, kr_method_find("taylor"), (kr_config){.max_steps = 3});
    IS(kr_top_advance(other, 100.0) == KR_ERR_LIMIT);
    IS(same(kr_top_state(top), kr_top_state(other)) && kr_top_describe(top).time > 0.0);
    kr_top_free(other);
    kr_top_free(top);
}

int main(void)
{
    height = term(1.0, "apex_z", "1");
    test_unchanged_path();
    test_step_borders(0.0, 0x1p-54, 0.0);
    test_step_borders(1e6 + 0.3, 0x1p-37, 0.0); /* times are farther apart than internal times */
    test_step_borders(-1e5 - 0.1, 0x1p-40, -1.0);
    test_passed_events();
    test_two_in_one_step();
    test_events_at_the_start();
    test_simultaneous_events();
    test_headless();
    test_agreement_of_kernels();
    test_refusals();
    test_lent_memory();
    test_failures();
    return check_result();
}
