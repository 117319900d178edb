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
#endif
