/* What the tests of events share: tops, and runs from event to event. */
#ifndef KR_EVENTS_TEST_H
#define KR_EVENTS_TEST_H
#include "check.h"
#include "events/terms.h"

enum { MANY = 64 };
static unsigned long long seed = 1;
static inline double uniform(void) /* in 0 .. 1 */
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(seed >> 11) * 0x1p-53;
}
static inline kr_scene scene_of(int i)
{
    const double inertia[9] = {2.0, 0.1, -0.2, 0.1, 2.6, 0.3, -0.2, 0.3, 3.1};
    kr_scene s = kr_scene_default();
    if (i == 0) return s;
    kr_body_from_tensor(1.3, inertia, v3(0.3, -0.4, 0.6), &s.body);
    s.start.q = q_unit(q4(0.3, v3(0.2 * i, -0.5, 0.4)));
    s.start.m = v3(0.7, -1.0 * i, 1.9);
    s.gravity = i == 2 ? -2.5 : 1.5;
    return s;
}
static inline kr_top *make(const kr_scene *s, kr_config config, kr_event *events, size_t n)
{
    kr_top *top = NULL;
    IS(kr_top_create(s, kr_method_find("taylor"), config, &top) == KR_OK);
    IS(kr_top_watch(top, n, events) == KR_OK);
    return top;
}
/* Times of the events up to `end`, at most MANY; how many. */
static inline int seek_all(kr_top *top, double end, double *t, kr_hit *hits)
{
    int n = 0;
    kr_hit hit;
    while (n < MANY && kr_top_seek(top, end, &hit) == KR_OK && hit.which >= 0) {
        t[n] = kr_top_state(top).t;
        if (hits) hits[n] = hit;
        n++;
    }
    return n;
}
static inline kr_term term(double factor, const char *of, const char *times)
{
    const kr_term t = {factor, kr_component_find(of), kr_component_find(times)};
    IS(t.of >= 0 && t.times >= 0);
    return t;
}
/* The height of the apex: begin() sets it, first of all. */
static kr_term height;
static inline void begin(void) { height = term(1.0, "apex_z", "1"); }
#endif
