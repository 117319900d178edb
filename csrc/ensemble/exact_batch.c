/* Batched evaluation of the closed-form solutions (kr_exact_form, exact/exact.h) of many tops. The
 * states are bitwise those of kr_exact_state; a state at the initial time is kr_scene.start itself.
 * The scalar code (kr_top) repeats a top with an invalid time or state, and reports the error. */
#include "exact/exact.h"
#include "slots.h"

enum { STATES_PER_CALL = 64 };

/* Returns a lower bound on kr_scene_horizon (kreisel.h), the limit on |t|, at less cost. */
static double bound_time_horizon_below(const kr_scene *s)
{
    const kr_vec3 A = s->body.inertia, m = s->start.m;
    const double least = fmin(A.x, fmin(A.y, A.z)),
                 turning = (v_length(m) + v_length(s->body.rotor)) / least,
                 swing = sqrt(s->body.mass * fabs(s->gravity) / least * v_length(s->body.com));
    return 0x1p52 / fmax(turning, swing);
}
/* Returns 1 if the initial time and the requested times of top i are monotonic and in magnitude
 * below bound_time_horizon_below, and at most config->max_steps (if > 0) times are requested. */
static int are_times_valid(const kr_config *config, const kr_tops *tops, size_t i)
{
    const kr_scene *scene = &tops->scenes[i];
    const double *t = kr_worker_times_of(tops, i), start = scene->start.t,
                 horizon = bound_time_horizon_below(scene);
    const double forward = tops->times > 0 && t[tops->times - 1] < start ? -1.0 : 1.0;
    double before = start;
    int plain = fabs(start) < horizon &&
                (config->max_steps <= 0 || tops->times <= (uint64_t)config->max_steps);
    for (size_t k = 0; k < tops->times; k++) {
        plain &= fabs(t[k]) < horizon && forward * (t[k] - before) >= 0.0;
        before = t[k];
    }
    return plain;
}
/* Stores n states of the top in `slot`, or those before an invalid one. Returns their number. */
static size_t store_valid_states(kr_worker *worker, kr_slot *slot, kr_accumulator *accumulators,
                                 size_t n, kr_state states[])
{
    const kr_state *start = &worker->tops->scenes[slot->top].start;
    size_t k = 0;
    for (; k < n && kr_state_is_good(states[k].q, states[k].m); k++) {
        slot->steps += states[k].t != slot->last.t; /* the method counts each new time as a step */
        kr_worker_store_state(worker, slot, accumulators,
                              states[k].t == start->t ? start : &states[k]);
    }
    return k;
}
/* Stores the states and the outcome of top i. If `plan` is NULL, kr_exact_run has already written
 * the states to tops->states; else computes them from the closed form `plan`, in blocks of
 * STATES_PER_CALL. If a state is invalid, the scalar code computes the top instead. */
INLINE void finish_exact_top(kr_worker *worker, size_t i, const kr_exact_form *plan)
{
    const kr_tops *tops = worker->tops;
    const double *t = kr_worker_times_of(tops, i);
    kr_accumulator *accumulators = kr_worker_accumulators(worker, KR_LANES_MAX);
    kr_slot slot = {.top = i, .last = tops->scenes[i].start};
    kr_state block[STATES_PER_CALL];
    while (slot.states < tops->times && !worker->interrupted) {
        const size_t left = tops->times - slot.states,
                     n = !plan || left < STATES_PER_CALL ? left : STATES_PER_CALL;
        if (plan)
            kr_exact_evaluate_widest(kr_exact_widest_isa(kr_symmetric_form), plan, n,
                                     t + slot.states, block);
        if (store_valid_states(worker, &slot, accumulators, n,
                               plan ? block : tops->states + i * tops->times) < n) {
            kr_worker_run_scalar(worker, worker->exact_top, i);
            return;
        }
        if (plan) kr_worker_poll_after_states(worker);
    }
    const kr_stats stats = {.steps = slot.steps, .evaluations = slot.steps};
    kr_worker_finish_top(worker, &slot, accumulators,
                         slot.states < tops->times ? KR_ERR_INTERRUPTED : KR_OK, stats);
}
void kr_exact_batch_run(kr_worker *worker, size_t from, size_t n, kr_status status[])
{
    const kr_tops *tops = worker->tops;
    const int at_once = tops->states && tops->times <= KR_WORKER_STATES_PER_POLL / KR_BATCH;
    kr_exact_request request = {.isa = kr_exact_widest_isa(kr_symmetric_form),
                                .n = n,
                                .scenes = tops->scenes + from,
                                .status = status};
    if (at_once) {
        request.times = tops->times;
        request.t = kr_worker_times_of(tops, from);
        request.own_times = tops->own_times;
        request.states = tops->states + from * tops->times;
    } else {
        request.plans = worker->plans;
    }
    kr_exact_run(&request);
    for (size_t i = 0; i < n && !worker->interrupted; i++) {
        if (status[i] != KR_OK) continue;
        if (!are_times_valid(&worker->config, tops, from + i))
            kr_worker_run_scalar(worker, worker->exact_top, from + i);
        else
            finish_exact_top(worker, from + i, at_once ? NULL : &worker->plans[i]);
    }
    kr_worker_poll(worker);
}
