/* Functions that advance a top from event to event. Each step is computed without regard to events
 * and is searched afterwards, so that events never affect the motion. For each event, the next sign
 * change of its event function (or of the derivative, for an extremum event) in the last step is
 * stored in a kr_event_search (driver/top.h). Once the time of this sign change has passed, the
 * search resumes there. `piece` has the polynomials of the last step (method.h). */
#include "model/quantities.h"
#include "sign_changes.h"
#include "event_polynomial.h"

/* Converts `clock`, a time in the last step, from internal units to the user's time. If rounding
 * moves the result out of the step, returns an adjacent double in the step, if there is one. */
static double user_time_in_step(const kr_top *top, double clock)
{
    const double t = top->scene.start.t + clock * top->time_unit,
                 later = nextafter(t, top->forward * INFINITY);
    if (top->forward * (internal_time(top, t) - top->main.clock) > 0.0)
        return nextafter(t, top->scene.start.t);
    return top->forward * (internal_time(top, t) - top->before_clock) < 0.0 &&
                   top->forward * (internal_time(top, later) - top->main.clock) <= 0.0
               ? later
               : t;
}

/* Returns 1 if the sign changes of a sum of n terms can be found along the motion of `top`. */
static int are_terms_valid(const kr_top *top, const kr_step_polynomial *piece, size_t n,
                           const kr_term terms[])
{
    if (!terms) return 0;
    for (size_t i = 0; i < n; i++) {
        const int of = terms[i].first, times = terms[i].second;
        if (!kr_component_is_valid(of) || !kr_component_is_valid(times) ||
            !isfinite(terms[i].factor))
            return 0;
        if (top->main.skip_heading && (kr_component_is_turned(of) || kr_component_is_turned(times)))
            return 0;
    }
    const double size = kr_terms_bound(top, piece, n, terms);
    return isfinite(size) && KR_TERMS_UNSURE * size > 0.0;
}
static int are_events_valid(const kr_top *top, size_t n, const kr_event events[])
{
    for (size_t i = 0; i < n; i++) {
        const kr_step_polynomial piece = top->method->polynomial(&top->main);
        const kr_event *event = &events[i];
        if (event->direction < -1 || event->direction > 1) return 0;
        if (!are_terms_valid(top, &piece, event->count, event->terms)) return 0;
        if (event->condition_count > 0 &&
            !are_terms_valid(top, &piece, event->condition_count, event->condition))
            return 0;
    }
    return 1;
}
kr_status kr_top_watch(kr_top *top, size_t n, kr_event events[])
{
    if (!top || (n > 0 && !events)) return KR_ERR_ARGUMENT;
    if (n > 0 && !top->method->polynomial) return KR_ERR_NO_EVENTS;
    kr_top_set_apex(top);
    if (!are_events_valid(top, n, events)) return KR_ERR_ARGUMENT;
    for (size_t i = 0; i < n; i++) kr_event_reset_search(&events[i]);
    top->events = events;
    top->event_count = n;
    return KR_OK;
}

/* Finds the next sign change in the direction that an event requires, after the position own->mark
 * (0 to 1) in the last step. Writes its time in internal units to own->next, and its direction or,
 * if there is none, 0 to own->sign. Updates own->mark and the last known sign own->side. */
static void find_next_sign_change(const kr_top *top, const kr_step_polynomial *piece,
                                  const kr_event *event, kr_event_search *own)
{
    double coefficients[KR_TERMS_ROOM];
    const double size = kr_terms_bound(top, piece, event->count, event->terms);
    const int degree = kr_terms_polynomial(top, piece, event, coefficients),
              turn = event->extremum || top->forward > 0.0 ? 1 : -1;
    kr_sign_search search = {.c = coefficients,
                             .degree = degree,
                             .noise = KR_TERMS_UNSURE * size,
                             .start_noise = KR_TERMS_START * size,
                             .sought = turn * event->direction,
                             .side = own->side,
                             .mark = own->mark};
    own->sign = 0;
    while (!own->sign && kr_search_next_sign_change(&search))
        if (search.side * search.sought >= 0) own->sign = turn * search.side;
    own->next = piece->begin + search.root * (piece->end - piece->begin);
    /* The onset of sliding, in either direction, is not an event. Hence the sign is discarded. */
    own->side = kr_event_is_held(piece, event) ? 0 : search.side;
    own->mark = search.mark;
}
/* Finds the first sign change of an event function in the last step, unless this step has already
 * been searched. If the previous step was searched to its end, starts at the beginning of the step
 * and keeps the last known sign. Otherwise starts at the last requested time with no known sign. */
static void search_step_once(const kr_top *top, const kr_step_polynomial *piece,
                             const kr_event *event, kr_event_search *own)
{
    if (own->searched == top->steps) return;
    own->mark = 0.0;
    if (own->searched != top->steps - 1 || own->sign) {
        const double since = internal_time(top, top->requested) - piece->begin;
        own->side = 0;
        own->mark = fmax(0.0, since / (piece->end - piece->begin));
    } else if (own->side == 0) {
        /* Once friction no longer holds the top, the sign of the spin is known even near zero. */
        own->side = kr_event_side_by_friction(piece, event);
    }
    own->searched = top->steps;
    find_next_sign_change(top, piece, event, own);
}
/* Returns the event with the earliest sign change in the last step, not before the last requested
 * time, or NULL. Writes the state of the search for this event to `found`. */
static kr_event *find_earliest_event(const kr_top *top, const kr_step_polynomial *piece,
                                     kr_event_search *found)
{
    kr_event *first = NULL;
    for (size_t i = 0; i < top->event_count; i++) {
        kr_event *event = &top->events[i];
        kr_event_search own = kr_event_load_search(event);
        search_step_once(top, piece, event, &own);
        while (own.sign && top->forward * (user_time_in_step(top, own.next) - top->requested) < 0.0)
            find_next_sign_change(top, piece, event, &own);
        kr_event_store_search(event, own);
        if (own.sign && (!first || top->forward * (own.next - found->next) < 0.0)) {
            first = event;
            *found = own;
        }
    }
    return first;
}
/* Advances the top, not beyond the user's time t, from event to event in the last step, up to one
 * that satisfies its condition, if any (kr_event). Writes its index, or -1, to hit->index. */
static kr_status seek_event_in_step(kr_top *top, double t, kr_event_hit *hit)
{
    const kr_step_polynomial piece = top->method->polynomial(&top->main);
    kr_event *event;
    kr_event_search own;
    hit->index = -1;
    hit->direction = 0;
    while (hit->index < 0 && (event = find_earliest_event(top, &piece, &own)) != NULL) {
        const double there = user_time_in_step(top, own.next);
        if (top->forward * (there - t) > 0.0) break;
        const kr_status status = kr_top_advance(top, there);
        if (status != KR_OK) return status;
        const size_t terms = event->condition_count;
        if (!terms || kr_terms_value(&top->scene, &top->now, terms, event->condition) > 0.0) {
            hit->index = event - top->events;
            hit->direction = own.sign;
        }
        find_next_sign_change(top, &piece, event, &own);
        kr_event_store_search(event, own);
    }
    return KR_OK;
}
kr_status kr_top_seek(kr_top *top, double t, kr_event_hit *hit)
{
    kr_event_hit found = {-1, 0};
    if (!top || !hit || !isfinite(t)) return KR_ERR_ARGUMENT;
    if (!(fabs(t) < top->horizon)) return KR_ERR_RESOLUTION;
    /* A reset may change the internal units, in which the terms may exceed the range of doubles. */
    if (top->event_count > 0 && kr_event_load_search(top->events).searched < 0 &&
        !are_events_valid(top, top->event_count, top->events))
        return KR_ERR_ARGUMENT;
    if (top->forward * (t - top->requested) < 0.0) return KR_ERR_TIME;
    while (top->event_count > 0) {
        kr_status status = top->steps > 0 ? seek_event_in_step(top, t, &found) : KR_OK;
        if (status != KR_OK) return status;
        if (found.index >= 0 || !(top->forward * (internal_time(top, t) - top->main.clock) > 0.0))
            break;
        status = kr_steps_dense(top, top->forward * INFINITY); /* an event may occur before t */
        if (status == KR_OK) continue;
        kr_top_sync(top, t);
        return status;
    }
    const kr_status status = found.index >= 0 ? KR_OK : kr_top_advance(top, t);
    if (status == KR_OK) *hit = found;
    return status;
}
