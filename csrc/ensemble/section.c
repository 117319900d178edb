/* Sections of the motions of many tops: the states at which an event occurs. An event is a zero of
 * the event function g (kr_event, kreisel.h) or, for an extremum, of dg/dt. The SIMD lanes, each
 * with one top (lane_state.h), can be used if g is linear in the body-frame components of the
 * vertical and the angular velocity. A lane stops after a step in which an event is possible
 * (lane_event_test.h), and the functions of this file search this step. For all other g, the scalar
 * code searches (events/event_search.c). kr_tops.t holds the longest wait from event to event. */
#include "events/sign_changes.h"
#include "events/event_polynomial.h"
#include "slots.h"

void kr_section_load_event(kr_worker *worker, int lane, double rate, int shift)
{
    const kr_top *top = worker->fallback;
    const kr_step_polynomial piece = top->method->polynomial(&top->main);
    const kr_event *event = &worker->event;
    const kr_linear g = kr_terms_linear_form(top, rate, event);
    const double size = kr_terms_bound(top, &piece, event->count, event->terms);
    kr_lanes *l = worker->lanes;
    set_vector(l->along_p, lane, shift_axes(g.along_vertical, shift));
    set_vector(l->along_w, lane, shift_axes(g.along_velocity, shift));
    l->constant[lane] = g.constant;
    l->side[lane] = 0.0;
    l->noise[lane] = KR_TERMS_UNSURE * size;
    worker->slots[lane].start_noise = KR_TERMS_START * size;
}
/* Finishes the top in a lane, with its state at the end of the wait and the status KR_ERR_EVENT. */
static void finish_without_event(kr_worker *worker, int lane)
{
    kr_slot *slot = &worker->slots[lane];
    const kr_state s = kr_lane_sample(worker, lane, slot->requested);
    if (!kr_state_is_good(s.q, s.m)) {
        kr_lane_fall_back(worker, lane);
        return;
    }
    slot->last = s;
    kr_lane_finish(worker, lane, KR_ERR_EVENT);
}
/* An event occurs at `fraction` (0 to 1) of the last step of a lane. Stores the state there, unless
 * there is a kr_event.condition that is not positive. If the longest wait ends before the event,
 * finishes the top instead. Returns 1 if the search must go on, 0 if the top left the lane. */
static int store_event_if_condition_holds(kr_worker *worker, int lane, double fraction)
{
    const kr_lanes *l = worker->lanes;
    const kr_event *event = &worker->event;
    kr_slot *slot = &worker->slots[lane];
    const kr_scene *scene = &worker->tops->scenes[slot->top];
    const double clock = l->t[lane] + fraction * (l->end[lane] - l->t[lane]),
                 t = slot->start + clock / slot->rate * slot->time_unit;
    if (slot->forward * (t - slot->requested) > 0.0) {
        finish_without_event(worker, lane);
        return 0;
    }
    const kr_state s = kr_lane_sample(worker, lane, t);
    if (!kr_state_is_good(s.q, s.m)) {
        kr_lane_fall_back(worker, lane);
        return 0;
    }
    if (event->condition_count &&
        !(kr_terms_value(scene, &s, event->condition_count, event->condition) > 0.0))
        return 1;
    kr_worker_store_state(worker, slot, kr_worker_accumulators(worker, lane), &s);
    return kr_lane_set_goal(worker, lane);
}
void kr_section_search(kr_worker *worker, int lane)
{
    kr_lanes *l = worker->lanes;
    const kr_event *event = &worker->event;
    const kr_slot *slot = &worker->slots[lane];
    const int degree = l->order - l->extremum,
              turn = event->extremum || slot->forward > 0.0 ? 1 : -1;
    double g[KR_LANES_ORDER + 1];
    kr_sign_search search = {.c = g,
                             .degree = degree,
                             .noise = l->noise[lane],
                             .start_noise = slot->start_noise,
                             .sought = turn * event->direction,
                             .side = (int)l->side[lane]};
    for (int n = 0; n <= degree; n++) g[n] = l->g[n][lane];
    while (kr_search_next_sign_change(&search))
        if (search.side * search.sought >= 0 &&
            !store_event_if_condition_holds(worker, lane, search.root))
            return;
    l->side[lane] = search.side;
    if (kr_lane_has_passed_goal(l, lane)) finish_without_event(worker, lane);
}
