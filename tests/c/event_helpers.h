/* Helpers of the event tests: they make a term from the names of its components, and a top that
 * watches for events. */
#ifndef KR_TEST_WATCHED_H
#define KR_TEST_WATCHED_H
#include "tops.h"

static inline kr_term term(double factor, const char *of, const char *times)
{
    const kr_term t = {factor, kr_component_find(of), kr_component_find(times)};
    IS(t.first >= 0 && t.second >= 0);
    return t;
}
static inline kr_top *watched(const kr_scene *s, kr_config config, kr_event *events, size_t n)
{
    kr_top *top = make(s, taylor(), config);
    IS(kr_top_watch(top, n, events) == KR_OK);
    return top;
}
enum { MANY = 64 };
/* Returns the top of the thesis, or one with a general body. */
static inline kr_scene event_scene(int i)
{
    kr_scene s = kr_scene_default();
    if (i == 0) return s;
    s.body = general_body();
    s.start.q = q_unit(q4(0.3, v3(0.2 * i, -0.5, 0.4)));
    s.start.m = v3(0.7, -1.0 * i, 1.9);
    s.gravity = i == 2 ? -2.5 : 1.5;
    return s;
}
/* Writes the times of the events up to `end`, at most MANY. Returns their number. */
static inline int seek_all(kr_top *top, double end, double *t, kr_event_hit *hits)
{
    int n = 0;
    kr_event_hit hit;
    while (n < MANY && kr_top_seek(top, end, &hit) == KR_OK && hit.index >= 0) {
        t[n] = kr_top_state(top).t;
        if (hits) hits[n] = hit;
        n++;
    }
    return n;
}
#endif
