/* Events: tops that watch for events, and searches from one event to the next. */
#include <math.h>
#include <stdio.h>
#include "random_values.h"
#include "claims.h"
#include "tops.h"
#include "scenes.h"

/* Returns a component: mostly a valid one that does not depend on the heading. */
static int any_component(void)
{
    static const char *const level[] = {"apex_z", "spin", "body_vertical_x", "body_momentum_y",
                                        "body_velocity_z"};
    char name[64];
    const kr_quantity *quantity = any_quantity();
    const size_t i = (size_t)choose(quantity->doubles);
    if (odds(30)) return KR_COMPONENT_ONE;
    if (odds(1)) return (int)choose(100) - 10;
    snprintf(name, sizeof name, "%s%s", quantity->name, quantity->suffixes[i]);
    const int component = odds(30) ? kr_component_find(name) : -1;
    return component >= 0 ? component
                          : kr_component_find(level[choose(sizeof level / sizeof *level)]);
}
static size_t any_terms(kr_term terms[TERMS])
{
    const size_t n = odds(50) ? 1 : 1 + (size_t)choose(TERMS);
    for (size_t i = 0; i < n; i++) {
        terms[i].factor = maybe_arbitrary(between(-1.0, 1.0), 1);
        terms[i].first = any_component();
        terms[i].second = any_component();
        print_detail("term %a * %d * %d", terms[i].factor, terms[i].first, terms[i].second);
    }
    return n;
}
void any_search(search *s)
{
    s->count = (size_t)choose(SEARCHES + 1);
    for (size_t i = 0; i < s->count; i++) {
        kr_event event = {.terms = s->term[i], .condition = s->where[i]};
        event.count = any_terms(s->term[i]);
        event.condition_count = odds(70) ? 0 : any_terms(s->where[i]);
        event.extremum = (int)choose(2);
        event.direction = odds(98) ? (int)choose(3) - 1 : 2;
        if (odds(2)) event.terms = NULL;
        s->event[i] = event;
    }
}
void call_watch(place *p)
{
    search *next = &p->search[1 - p->watched];
    any_search(next);
    begin_call(p);
    print_call("watch for %zu", next->count);
    const kr_status status = kr_top_watch(p->top, next->count, next->event);
    const enum error_kind wrong = error_category(status);
    CLAIM(wrong == NONE || wrong == INPUT);
    const kr_state state = kr_top_state(p->top);
    CLAIM(same_bits(&state, &p->was, sizeof state));
    if (status == KR_OK) p->watched = 1 - p->watched;
    end_call(p, status);
}
static void claim_hit(const place *p, double t, kr_event_hit hit)
{
    const search *s = &p->search[p->watched];
    const kr_state state = kr_top_state(p->top);
    CLAIM(hit.index >= -1 && hit.index < (ptrdiff_t)s->count);
    CLAIM(forward(p) * (state.t - p->was.t) >= 0.0 && forward(p) * (t - state.t) >= 0.0);
    if (hit.index < 0) {
        CLAIM(hit.direction == 0 && state.t == t);
        return;
    }
    const kr_event *event = &s->event[hit.index];
    CLAIM(hit.direction == 1 || hit.direction == -1);
    CLAIM(event->direction == 0 || event->direction == hit.direction);
    if (event->condition_count)
        CLAIM(kr_terms_value(&p->scene, &state, event->condition_count, event->condition) > 0.0);
}
/* Searches for one event. Returns 1 if there may be more events. */
static int seek(place *p, double t)
{
    kr_event_hit hit;
    fill_with_mark(&hit, sizeof hit);
    begin_call(p);
    print_call("seek to %a", t);
    const kr_status status = kr_top_seek(p->top, t, &hit);
    print_detail("hit %td, %d", hit.index, hit.direction);
    if (status == KR_OK) {
        claim_hit(p, t, hit);
        p->landed = 1;
    } else
        CLAIM(is_marked(&hit, sizeof hit));
    /* If doubles resolve the times inside a step, a search fails only if a run fails as well. */
    const int apart = fabs(p->was.t) < 0x1p-8 * kr_scene_horizon(&p->scene);
    if (status == KR_ERR_STEP && p->search[p->watched].count > 0 && apart)
        CLAIM(kr_top_advance(make_alike(p, p->config.tangents), t) != KR_OK);
    end_call(p, status);
    return status == KR_OK && hit.index >= 0;
}
void call_seek(place *p)
{
    enum { MOST = 8 };
    const int far = p->search[p->watched].count > 0 && odds(50);
    const double now = kr_top_state(p->top).t,
                 t = far ? now + forward(p) * time_scale(&p->scene) * between(1.0, 20.0)
                         : any_time(p);
    for (int i = 0; seek(p, t) && i < MOST;) i++;
}
