/* kr_top_reset: for every method, the top then equals one that was created with the new start. A
 * refused reset leaves every bit unchanged. */
#include <stdlib.h>
#include "random.h"
#include "tops.h"

enum { STARTS = 12, TIMES = 4, MOST = 1 << 15 };

static kr_scene scene_for(const kr_method *method)
{
    kr_scene s = tilted();
    if (!kr_method_applies(method, &s.body)) s.body.com = v3(0, 0, 0); /* free */
    return s;
}
/* Returns a start with a momentum of any size, so that the internal units differ. */
static kr_state random_start(const kr_scene *s)
{
    const kr_state start = {uniform(-2, 2), random_quat(),
                            v_scale(ldexp(1.0, (int)uniform(-9, 7)), s->start.m)};
    return start;
}
static void times_after(const kr_state *start, double sign, double t[TIMES])
{
    const double after[TIMES] = {0.01, 0.0625, 0.7, 1.51};
    for (int i = 0; i < TIMES; i++) t[i] = start->t + sign * after[i];
}
/* Compares the states and counts of a top after a reset with those of a new top. Both calls may
 * refuse the start. */
static void as_created(kr_top *top, kr_scene s, const kr_method *method, kr_config config,
                       const kr_state *start)
{
    kr_state got[TIMES], want[TIMES], got_low[TIMES], want_low[TIMES];
    double t[TIMES];
    size_t done = 0, whole = 0;
    kr_top *fresh = NULL;
    s.start = *start;
    const kr_status created = kr_top_create(&s, method, config, &fresh);
    IS(kr_top_reset(top, start) == created);
    if (created != KR_OK) return;
    const kr_stats none = kr_top_stats(top), also = kr_top_stats(fresh);
    IS(none.steps == 0 && memcmp(&none, &also, sizeof none) == 0);
    IS(same(kr_top_state(top), *start) && kr_top_time(top) == start->t);
    times_after(start, config.step < 0.0 ? -1.0 : 1.0, t);
    const kr_status status = kr_top_record_low(fresh, TIMES, t, want, want_low, &whole);
    IS(kr_top_record_low(top, TIMES, t, got, got_low, &done) == status && done == whole);
    for (size_t i = 0; i < whole; i++) IS(same(got[i], want[i]) && same(got_low[i], want_low[i]));
    IS(same(kr_top_state(top), kr_top_state(fresh)));
    const kr_stats stats = kr_top_stats(top), wanted = kr_top_stats(fresh);
    IS(memcmp(&stats, &wanted, sizeof stats) == 0);
    kr_top_free(fresh);
}
static void test_reset_states(const kr_method *method, kr_config config)
{
    const kr_scene s = scene_for(method);
    kr_top *top = make(&s, method, config);
    for (int i = 0; i < STARTS; i++) {
        const kr_state start = random_start(&s);
        as_created(top, s, method, config, &start);
    }
    as_created(top, s, method, config, &s.start);
    /* so fast that most methods fail before the end */
    for (int power = 3; power < 60 && !(kr_method_flags(method) & KR_METHOD_ADAPTIVE); power += 7) {
        const kr_state start = {0.0, s.start.q, v_scale(ldexp(1.0, power), s.start.m)};
        as_created(top, s, method, config, &start);
    }
    kr_top_free(top);
}

/* Writes the bytes of a top and returns their number, or 0 if it has none. */
static size_t bytes_of(const kr_top *top, unsigned char *bytes)
{
    const size_t size = kr_top_save_size(top);
    return size <= MOST && kr_top_save(top, size, bytes) == KR_OK ? size : 0;
}
/* A refused reset, whatever the reason, changes neither the bytes of the top nor its further
 * motion. */
static void test_refused_reset(const kr_method *method)
{
    static unsigned char before[MOST], after[MOST];
    const kr_scene s = scene_for(method);
    const kr_config config = {.step = 0.3};
    kr_top *top = make(&s, method, config), *twin = make(&s, method, config);
    IS(kr_top_advance(top, 3.1) == KR_OK && kr_top_advance(twin, 3.1) == KR_OK);
    kr_state bad[6];
    for (int i = 0; i < 6; i++) bad[i] = s.start;
    bad[0].q.w = 2.0;
    bad[1].m.x = NAN;
    bad[2].t = INFINITY;
    bad[3].t = 1e17; /* the step is below its resolution */
    bad[4].m = v3(1e306, 1e308, 1e308);
    bad[5].m = v_scale(1e3, s.start.m); /* some methods refuse this with their step */
    for (int i = 0; i < 6; i++) {
        kr_scene other = s;
        kr_top *created = NULL;
        other.start = bad[i];
        const kr_status status = kr_top_create(&other, method, config, &created);
        kr_top_free(created);
        IS(i > 3 || status != KR_OK);
        if (status == KR_OK) continue;
        const size_t size = bytes_of(top, before);
        IS(size > 0 && kr_top_reset(top, &bad[i]) == status);
        IS(bytes_of(top, after) == size && memcmp(before, after, size) == 0);
    }
    IS(kr_top_advance(top, 6.7) == KR_OK && kr_top_advance(twin, 6.7) == KR_OK);
    IS(same(kr_top_state(top), kr_top_state(twin)));
    kr_top_free(top);
    kr_top_free(twin);
}
/* A checkpoint that was taken before a reset still restores the motion before the reset. */
static void test_checkpoint_before(const kr_method *method)
{
    static unsigned char saved[MOST];
    const kr_scene s = scene_for(method);
    const kr_config config = {.step = 0.0625};
    kr_state start = s.start;
    kr_top *top = make(&s, method, config), *twin = make(&s, method, config);
    start.m = v_scale(1.0 / 64, start.m);
    IS(kr_top_advance(top, 2.01) == KR_OK && kr_top_advance(twin, 2.01) == KR_OK);
    const size_t size = bytes_of(top, saved);
    IS(kr_top_reset(top, &start) == KR_OK && kr_top_advance(top, 5.0) == KR_OK);
    IS(kr_top_load(top, size, saved) == KR_OK && same(kr_top_state(top), kr_top_state(twin)));
    IS(kr_top_advance(top, 9.3) == KR_OK && kr_top_advance(twin, 9.3) == KR_OK);
    IS(same(kr_top_state(top), kr_top_state(twin)));
    as_created(top, s, method, config, &start);
    kr_top_free(top);
    kr_top_free(twin);
}
/* After a reset the top still watches for events, in the units of the new start. */
static void test_events(void)
{
    const kr_term vertical[] = {{1.0, kr_component_find("apex_z"), KR_COMPONENT_ONE},
                                {-0.5, KR_COMPONENT_ONE, KR_COMPONENT_ONE}};
    kr_event one = {.terms = vertical, .count = 2}, other = one;
    const kr_config config = {0};
    kr_scene s = tilted();
    kr_top *top = make(&s, taylor(), config);
    kr_event_hit hit = {-1, 0}, wanted = {-1, 0};
    IS(kr_top_watch(top, 1, &one) == KR_OK && kr_top_seek(top, 50.0, &hit) == KR_OK);
    s.start.m = v_scale(100.0, s.start.m);
    kr_top *fresh = make(&s, taylor(), config);
    IS(kr_top_watch(fresh, 1, &other) == KR_OK && kr_top_reset(top, &s.start) == KR_OK);
    for (int i = 0; i < 10; i++) {
        IS(kr_top_seek(top, 50.0, &hit) == KR_OK && kr_top_seek(fresh, 50.0, &wanted) == KR_OK);
        IS(hit.index == wanted.index && hit.direction == wanted.direction);
        IS(same(kr_top_state(top), kr_top_state(fresh)));
    }
    kr_top_free(top);
    kr_top_free(fresh);
}
/* In the units of this start the event exceeds the range of doubles, so the search is refused. */
static void test_event_out_of_reach(void)
{
    const kr_term fast[] = {{1e200, kr_component_find("body_velocity_x"), KR_COMPONENT_ONE}};
    kr_event event = {.terms = fast, .count = 1};
    const kr_config config = {0};
    kr_scene s = tilted();
    kr_event_hit hit = {7, 7};
    s.gravity = 0.0;
    kr_top *top = make(&s, taylor(), config);
    IS(kr_top_watch(top, 1, &event) == KR_OK);
    s.start.m = v_scale(1e120, s.start.m);
    IS(kr_top_reset(top, &s.start) == KR_OK && kr_top_watch(top, 1, &event) == KR_ERR_ARGUMENT);
    IS(kr_top_seek(top, 1e-120, &hit) == KR_ERR_ARGUMENT && hit.index == 7);
    kr_top_free(top);
}

int main(void)
{
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_method *method = kr_method_at(i);
        const int adaptive = (kr_method_flags(method) & KR_METHOD_ADAPTIVE) != 0;
        for (double sign = 1.0; sign > -2.0; sign -= 2.0)
            test_reset_states(method,
                              (kr_config){.step = sign * 0.03, .tol = adaptive ? 1e-7 : 0.0});
        if (adaptive) test_reset_states(method, (kr_config){0});
        test_refused_reset(method);
        test_checkpoint_before(method);
    }
    for (int digits = 16; digits <= 30; digits += 7)
        test_reset_states(taylor(), (kr_config){.digits = digits});
    test_reset_states(taylor(), (kr_config){.skip_heading = 1});
    test_events();
    test_event_out_of_reach();
    return check_result();
}
