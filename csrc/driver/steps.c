/* Time stepping of a top, and recovery of the last valid state after a failure. NaN and infinity
 * persist in all later states of a fixed-step method, so its motion is checked and saved only every
 * KR_CHECK (top.h) steps. After a failure, the steps since the last save are repeated to find the
 * last valid state. The state of an adaptive method is checked after every step, by the method
 * itself if it has dense output. Without dense output, a second motion (kr_top.side) from the
 * beginning of a step computes the state at a requested time in this step. */
#include "top.h"

/* The largest number of steps of the side motion for one requested time. */
enum { SIDE_STEPS_MAX = 1024 };

/* Returns 1 if a state in internal units is valid after conversion to the user's units. */
static int is_good_state(const kr_top *top, const kr_state *state)
{
    return kr_state_is_good(state->q, v_scale(top->momentum_unit, state->m));
}
static int is_main_motion_valid(const kr_top *top)
{
    kr_state state = {0}; /* zeros are invalid, in case the method writes nothing */
    top->method->read(&top->main, &state);
    return is_good_state(top, &state);
}

/* Copies a motion and `doubles` numbers of its work array, but not the pointers work and aux. */
static void copy_motion(kr_motion *to, const kr_motion *from, size_t doubles)
{
    double *memory = to->work;
    void *aux = to->aux;
    *to = *from;
    to->work = memory;
    to->aux = aux;
    memcpy(memory, from->work, doubles * sizeof(double));
}
static void schedule_inspection(kr_top *top)
{
    const int64_t limit = top->config.max_steps, next = top->saved_steps + KR_CHECK;
    top->inspect_at = limit > 0 && limit < next ? limit : next;
}
void kr_steps_save(kr_top *top)
{
    if (!top->method->at) copy_motion(&top->saved, &top->main, top->method->work);
    top->saved_steps = top->steps;
    schedule_inspection(top);
}
/* Restores the saved motion, but keeps the counts of evaluations, rejected steps and iterations. */
static void restore_saved_motion(kr_top *top)
{
    const kr_stats spent = top->main.stats;
    copy_motion(&top->main, &top->saved, top->method->work);
    top->main.stats = spent;
    top->steps = top->saved_steps;
    schedule_inspection(top);
}
static kr_status step_main_motion_once(kr_top *top, double until)
{
    const kr_status status = top->method->step(&top->main, until);
    if (status == KR_OK) top->steps++;
    return status;
}
kr_status kr_steps_recover(kr_top *top)
{
    const int64_t failed = top->steps + 1;
    kr_status status = KR_OK;
    int64_t good = top->saved_steps;
    restore_saved_motion(top);
    while (top->steps < failed && status == KR_OK) {
        status = step_main_motion_once(top, 0.0); /* fixed-step methods ignore `until` */
        if (status == KR_OK && !is_main_motion_valid(top)) status = KR_ERR_NOT_FINITE;
        if (status == KR_OK) good = top->steps;
    }
    restore_saved_motion(top);
    while (top->steps < good) step_main_motion_once(top, 0.0);
    return status == KR_OK ? KR_ERR_NOT_FINITE : status;
}
int kr_steps_poll(kr_top *top) { return top->config.poll && top->config.poll(top->config.context); }
/* Calls the user's `poll`. Returns KR_OK, or KR_ERR_INTERRUPTED or KR_ERR_LIMIT if the computation
 * must stop after `steps` steps. */
static kr_status poll_and_check_limit(kr_top *top, int64_t steps)
{
    const int64_t limit = top->config.max_steps;
    if (kr_steps_poll(top)) return KR_ERR_INTERRUPTED;
    return limit > 0 && steps >= limit ? KR_ERR_LIMIT : KR_OK;
}
/* Checks the main motion, saves it for recovery, and calls poll_and_check_limit. If the motion is
 * invalid, restores its last valid state and returns an error code. */
static kr_status save_valid_main_and_poll(kr_top *top)
{
    if (!is_main_motion_valid(top)) return kr_steps_recover(top);
    kr_steps_save(top);
    return poll_and_check_limit(top, top->steps);
}

kr_status kr_steps_to_grid(kr_top *top, int64_t goal, kr_state *state)
{
    while (top->steps < goal) {
        const kr_status status =
            top->steps >= top->inspect_at ? save_valid_main_and_poll(top) : KR_OK;
        if (status != KR_OK) return status;
        if (step_main_motion_once(top, 0.0) != KR_OK) return kr_steps_recover(top);
    }
    top->method->read(&top->main, state);
    return KR_OK;
}
kr_status kr_steps_adaptive(kr_top *top)
{
    kr_status status = save_valid_main_and_poll(top);
    if (status != KR_OK) return status;
    const double clock = top->main.clock;
    kr_state before = {0};
    top->method->read(&top->main, &before);
    status = step_main_motion_once(top, top->forward * INFINITY);
    if (status == KR_OK && !is_main_motion_valid(top)) status = KR_ERR_NOT_FINITE;
    if (status == KR_OK) {
        top->before = before;
        top->before_clock = clock;
    } else
        restore_saved_motion(top);
    return status;
}
kr_status kr_steps_dense(kr_top *top, double until)
{
    kr_status status = KR_OK;
    if (top->steps >= top->inspect_at) {
        kr_steps_save(top);
        status = poll_and_check_limit(top, top->steps);
    }
    if (status != KR_OK) return status;
    const double clock = top->main.clock;
    status = step_main_motion_once(top, until);
    if (status != KR_OK) return status;
    top->before_clock = clock;
    return kr_tangents_advance(top);
}
/* Integrates the side motion from the state `from` over a time `span`, both in internal units. */
static kr_status run_side_motion(kr_top *top, const kr_state *from, double span)
{
    const kr_method *method = top->method;
    kr_motion *side = &top->side;
    copy_motion(side, &top->main, 0);
    side->step = span;
    side->clock = 0.0;
    side->stats = (kr_stats){0};
    kr_status status = method->reset(side, from);
    if (status == KR_ERR_STEP_SIZE) return KR_ERR_CONVERGENCE; /* not the user's step */
    if (status == KR_OK) status = method->step(side, span);
    for (int64_t n = 1;
         status == KR_OK && method->flags & KR_METHOD_ADAPTIVE && side->clock != span; n++) {
        status = poll_and_check_limit(top, n);
        if (status == KR_OK) status = n < SIDE_STEPS_MAX ? method->step(side, span) : KR_ERR_LIMIT;
    }
    return status;
}
kr_status kr_steps_off_grid(kr_top *top, const kr_state *from, double span, kr_state *end)
{
    const kr_stats *spent = &top->side.stats;
    kr_stats *total = &top->main.stats;
    kr_state state;
    kr_status status = top->steps >= top->inspect_at ? save_valid_main_and_poll(top) : KR_OK;
    if (status != KR_OK) return status;
    /* A zero quaternion would be treated as the identity, so invalid states are rejected here. */
    if (!is_good_state(top, from)) return kr_steps_recover(top);
    status = run_side_motion(top, from, span);
    total->evaluations += spent->evaluations;
    total->rejected += spent->rejected;
    total->iterations += spent->iterations;
    top->inspect_at--; /* a request between grid points counts as a step */
    if (status == KR_OK) {
        top->method->read(&top->side, &state);
        if (!is_good_state(top, &state)) status = KR_ERR_NOT_FINITE;
    }
    if (status == KR_OK)
        *end = state;
    else if (!is_main_motion_valid(top)) /* the main motion may have failed first */
        status = kr_steps_recover(top);
    return status;
}
