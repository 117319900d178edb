/* The tops that a worker computes now (kr_slot), each in a SIMD lane (lane_state.h) or by the
 * scalar code (kr_top), and the storage of their states, growth of tangents and outcomes. */
#include "model/scene.h"
#include "slots.h"

void kr_worker_store_state(kr_worker *worker, kr_slot *slot, kr_accumulator *accumulators,
                           const kr_state *state)
{
    const kr_tops *tops = worker->tops;
    if (tops->states) tops->states[slot->top * tops->times + slot->states] = *state;
    if (tops->reduced)
        kr_reduce_add(worker->reductions, worker->reduction, accumulators, &tops->scenes[slot->top],
                      state, slot->states);
    slot->last = *state;
    slot->states++;
    worker->unpolled++;
}
int kr_worker_poll(kr_worker *worker)
{
    const kr_config *config = &worker->config;
    worker->unpolled = 0;
    if (config->poll && config->poll(config->context)) worker->interrupted = 1;
    return worker->interrupted;
}
int kr_worker_poll_after_states(kr_worker *worker)
{
    if (worker->unpolled >= KR_WORKER_STATES_PER_POLL) kr_worker_poll(worker);
    return worker->interrupted;
}
/* Returns the address in kr_tops.growth for a top at its requested time k, or NULL. */
static double *find_growth_row(const kr_worker *worker, size_t top, size_t k)
{
    double *growth = kr_worker_has_tangents(worker) ? worker->tops->growth : NULL;
    return growth ? growth + (top * worker->tops->times + k) * KR_GROWTH_COUNT : NULL;
}
void kr_worker_store_growth(kr_worker *worker, const kr_slot *slot, kr_lane_number *row, int lane)
{
    double *to = find_growth_row(worker, slot->top, slot->states);
    for (int i = 0; to && i < KR_GROWTH_COUNT; i++) to[i] = row ? row[i][lane] : 0.0;
}
void kr_worker_finish_top(kr_worker *worker, const kr_slot *slot,
                          const kr_accumulator *accumulators, kr_status status, kr_stats stats)
{
    const kr_tops *tops = worker->tops;
    const double *t = kr_worker_times_of(tops, slot->top);
    kr_state *states = tops->states ? tops->states + slot->top * tops->times : NULL;
    double *row = tops->reduced ? tops->reduced + slot->top * worker->reductions : NULL;
    const kr_outcome outcome = {status, slot->states, slot->last, stats};
    tops->outcomes[slot->top] = outcome;
    for (size_t k = slot->states; states && k < tops->times; k++) {
        const kr_state none = {
            worker->is_section ? NAN : t[k], {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
        states[k] = none;
    }
    for (size_t k = slot->states; k < tops->times; k++) {
        double *growth = find_growth_row(worker, slot->top, k);
        for (int i = 0; growth && i < KR_GROWTH_COUNT; i++) growth[i] = NAN;
    }
    if (row && status == KR_OK && slot->states > 0)
        kr_reduce_end(worker->reductions, worker->reduction, accumulators, slot->states, row);
    else
        for (size_t r = 0; row && r < worker->reductions; r++) row[r] = NAN;
}
kr_config kr_worker_config_of(const kr_worker *worker, size_t i)
{
    const kr_tops *tops = worker->tops;
    const double *t = kr_worker_times_of(tops, i);
    kr_config config = worker->config;
    const int back = worker->is_section
                         ? kr_worker_event_wait_limit(worker, i) < 0.0
                         : tops->times > 0 && t[tops->times - 1] < tops->scenes[i].start.t;
    config.step = kr_step_directed(config.step, back);
    return config;
}

/* Integrates `top` by the scalar code to its requested times, and stores the states. */
static kr_status record_requested_states(kr_worker *worker, kr_top *top, kr_slot *slot,
                                         kr_accumulator *accumulators)
{
    const kr_tops *tops = worker->tops;
    const double *t = kr_worker_times_of(tops, slot->top);
    kr_state piece[64];
    kr_status status = KR_OK;
    while (status == KR_OK && slot->states < tops->times) {
        const size_t left = tops->times - slot->states, n = left < 64 ? left : 64;
        size_t good = 0;
        status = kr_top_record(top, n, t + slot->states, piece, NULL, &good);
        for (size_t k = 0; k < good; k++)
            kr_worker_store_state(worker, slot, accumulators, &piece[k]);
        if (status == KR_OK && slot->states < tops->times && kr_worker_poll_after_states(worker))
            status = KR_ERR_INTERRUPTED;
    }
    slot->last = kr_top_state(top);
    return status;
}
/* Integrates `top` by the scalar code from event to event, and stores the states at the events. */
static kr_status record_event_states(kr_worker *worker, kr_top *top, kr_slot *slot,
                                     kr_accumulator *accumulators)
{
    kr_event event = worker->event;
    kr_status status = kr_top_watch(top, 1, &event);
    const double wait = kr_worker_event_wait_limit(worker, slot->top);
    while (status == KR_OK && slot->states < worker->tops->times) {
        kr_event_hit hit;
        status = kr_top_seek(top, slot->last.t + wait, &hit);
        const kr_state state = kr_top_state(top);
        if (status == KR_OK && hit.index < 0) status = KR_ERR_EVENT;
        if (status == KR_OK) kr_worker_store_state(worker, slot, accumulators, &state);
    }
    slot->last = kr_top_state(top);
    kr_top_watch(top, 0, NULL);
    return status;
}
void kr_worker_run_scalar(kr_worker *worker, kr_top *top, size_t i)
{
    const kr_scene *scene = &worker->tops->scenes[i];
    kr_config config = kr_worker_config_of(worker, i);
    kr_accumulator *accumulators = kr_worker_accumulators(worker, KR_LANES_MAX);
    kr_slot slot = {.top = i, .last = scene->start};
    kr_stats stats = {0};
    /* Skipping the heading would not make closed forms faster, and needs a support at rest. */
    if (top == worker->exact_top || kr_support_turns(scene)) config.skip_heading = 0;
    kr_status status = kr_top_init(top, scene, NULL, &config);
    if (status == KR_OK) {
        status = worker->is_section ? record_event_states(worker, top, &slot, accumulators)
                                    : record_requested_states(worker, top, &slot, accumulators);
        stats = kr_top_describe(top).stats;
    }
    if (kr_worker_has_tangents(worker)) {
        slot.states = 0; /* a top outside the lanes has no tangent */
        if (status == KR_OK) status = KR_ERR_TANGENT;
    }
    kr_worker_finish_top(worker, &slot, accumulators, status, stats);
    if (status == KR_ERR_INTERRUPTED) worker->interrupted = 1;
    /* The set-up of a closed form on a torus takes as long as thousands of steps, without poll. */
    if (top == worker->exact_top) kr_worker_poll(worker);
}

void kr_lane_reset_growth(kr_growth *growth, int lane)
{
    growth->power[lane] = growth->area[lane] = growth->moment[lane] = 0.0;
    growth->max[lane] = growth->last[lane] = growth->truncation[lane] = 0.0;
    growth->scale[lane] = 1.0;
}
void kr_lane_park(kr_lanes *l, int lane)
{
    kr_lane_number *const none[] = {l->end_w,   l->k,       l->up,         l->down,
                                    l->drag,    l->inner,   l->moment,     l->rotor,
                                    l->along_p, l->along_w, l->shift_prev, l->shift_next};
    for (size_t i = 0; i < sizeof none / sizeof *none; i++)
        set_vector(none[i], lane, v3(0.0, 0.0, 0.0));
    set_vector(l->end_p, lane, v3(0.0, 0.0, 1.0));
    set_quaternion(l->end_q, lane, q_one());
    set_quaternion(l->axes, lane, q_one());
    l->end[lane] = l->steps[lane] = 0.0;
    l->forward[lane] = 1.0;
    l->goal[lane] = l->fall[lane] = l->max_steps[lane] = INFINITY;
    l->side[lane] = l->constant[lane] = 0.0;
    l->noise[lane] = -1.0; /* no event */
    kr_lane_tangents *g = l->tangents;
    if (!g) return;
    kr_lane_number *const also[] = {g->ahead, g->behind, g->per,     g->moments,
                                    g->c,     g->rotor,  g->end.d[1]};
    for (size_t i = 0; i < sizeof also / sizeof *also; i++)
        set_vector(also[i], lane, v3(0.0, 0.0, 0.0));
    set_vector(g->end.d[0], lane, v3(1.0, 0.0, 0.0));
    kr_lane_reset_growth(&g->end, lane);
}
/* Marks a lane as unused, and fills the lane with a top at rest. */
static void release_lane(kr_worker *worker, int lane)
{
    worker->busy &= ~(1u << lane);
    kr_lane_park(worker->lanes, lane);
}
void kr_lane_fall_back(kr_worker *worker, int lane)
{
    const size_t i = worker->slots[lane].top;
    release_lane(worker, lane);
    kr_worker_run_scalar(worker, worker->fallback, i);
}
void kr_lane_finish(kr_worker *worker, int lane, kr_status status)
{
    kr_stats stats = {0};
    stats.steps = stats.evaluations = (int64_t)worker->lanes->steps[lane];
    kr_worker_finish_top(worker, &worker->slots[lane], kr_worker_accumulators(worker, lane), status,
                         stats);
    release_lane(worker, lane);
}
/* Converts the user's time t to the time of a lane, which starts at 0 (kr_slot). */
static double convert_to_lane_time(const kr_slot *slot, double t)
{
    return slot->rate * ((t - slot->start) / slot->time_unit);
}
int kr_lane_set_goal(kr_worker *worker, int lane)
{
    kr_slot *slot = &worker->slots[lane];
    const kr_tops *tops = worker->tops;
    const double *t = kr_worker_times_of(tops, slot->top);
    while (!worker->is_section && slot->states < tops->times && t[slot->states] == slot->start &&
           slot->requested == slot->start) {
        kr_worker_store_growth(worker, slot, NULL, 0);
        kr_worker_store_state(worker, slot, kr_worker_accumulators(worker, lane),
                              &tops->scenes[slot->top].start);
    }
    if (slot->states == tops->times) {
        kr_lane_finish(worker, lane, KR_OK);
        return 0;
    }
    const double until = worker->is_section
                             ? slot->last.t + kr_worker_event_wait_limit(worker, slot->top)
                             : t[slot->states];
    if (!(fabs(until) < slot->horizon) || !(slot->forward * (until - slot->requested) >= 0.0)) {
        kr_lane_fall_back(worker, lane);
        return 0;
    }
    slot->requested = until;
    worker->lanes->goal[lane] = convert_to_lane_time(slot, until);
    return 1;
}
kr_state kr_lane_sample(kr_worker *worker, int lane, double t)
{
    const kr_slot *slot = &worker->slots[lane];
    kr_lanes *l = worker->lanes;
    memcpy(l->at, l->end, sizeof l->at);
    l->at[lane] = convert_to_lane_time(slot, t);
    worker->isa->sample(l);
    return kr_lane_read_sample(worker, lane, t);
}
