/* The worker (kr_worker, kreisel.h), which computes many tops, and the functions shared by the
 * files of ensemble/. worker.c dispatches the tops: exact_batch.c evaluates closed-form solutions
 * in batches, lane_scheduler.c integrates tops in SIMD lanes (lane_state.h), and the scalar code
 * integrates the remaining tops one by one (kr_top). section.c finds events, and reduce.c computes
 * reductions: statistics of the states. A top that is being computed has a slot (kr_slot). Top i is
 * the one with index i in kr_tops. */
#ifndef KR_SLOTS_H
#define KR_SLOTS_H
#include "driver/top.h"
#include "exact/exact.h"
#include "lane_state.h"
#include "model/scene.h"

enum { KR_BATCH = 64 /* number of tops that are dispatched together */ };

/* The progress of one top. Its lane counts the time rate * ((t - start) / time_unit). */
typedef struct kr_slot {
    size_t top, states; /* index of the top; number of its valid states */
    int64_t steps;      /* steps of a closed form; lanes count their own steps */
    double start, time_unit, rate;
    double horizon, forward, requested; /* limit on |t|; direction: 1 or -1; the goal of the lane */
    double start_noise; /* in sections, smaller values count as zero until a first sign is known */
    kr_state last;
} kr_slot;

/* The partial result of a reduction after some of the states of a top: `value` is the extremum, the
 * last value or, for a mean or a variance, the mean of the quantity. `more` is the time of the
 * extremum or, for a mean or a variance, the sum of the squared deviations from the mean. */
typedef struct kr_accumulator {
    double value, more;
} kr_accumulator;
/* Updates the accumulators of n reductions with state k of a top, k = 0, 1, ... */
void kr_reduce_add(size_t n, const kr_reduction reduction[], kr_accumulator accumulators[],
                   const kr_scene *scene, const kr_state *state, size_t k);
/* Writes the results of n reductions over `states` > 0 states. */
void kr_reduce_end(size_t n, const kr_reduction reduction[], const kr_accumulator accumulators[],
                   size_t states, double out[]);

/* Largest number of states between two calls of poll. */
enum { KR_WORKER_STATES_PER_POLL = 1 << 16 };

struct kr_worker {
    kr_config config;
    const kr_method *method; /* NULL: chosen for each top */
    kr_top *fallback;        /* for tops that cannot run in lanes: uses the method, or taylor */
    kr_top *exact_top;       /* uses the closed form; NULL for other methods */
    kr_exact_form *plans;    /* the closed forms of a batch; NULL if `exact_top` is NULL */
    const kr_tops *tops;     /* the tops of the current call */
    int is_section;          /* nonzero: compute a section with `event` */
    kr_event event;
    int interrupted;
    int unpolled;            /* number of states stored since the last call of poll */
    const kr_lanes_isa *isa; /* NULL: the method has no lanes */
    kr_lanes *lanes;
    unsigned busy; /* bit i is set if lane i holds a top */
    kr_slot slots[KR_LANES_MAX];
    size_t reductions;
    kr_reduction *reduction;
    kr_accumulator *accumulators; /* one row for each lane, and one row for scalar runs */
    double memory[];
};

/* Stores the next state of the top in `slot`, and adds it to the reductions in `accumulators`. */
void kr_worker_store_state(kr_worker *worker, kr_slot *slot, kr_accumulator *accumulators,
                           const kr_state *state);
/* Calls the user's poll. Returns nonzero if the worker must stop. */
int kr_worker_poll(kr_worker *worker);
/* Polls once per KR_WORKER_STATES_PER_POLL stored states. Returns nonzero to stop the worker. */
int kr_worker_poll_after_states(kr_worker *worker);
static inline int kr_worker_has_tangents(const kr_worker *worker)
{
    return worker->lanes && worker->lanes->tangents;
}
/* Writes row[j][lane] for each growth indicator j, or 0 if `row` is NULL, to kr_tops.growth for the
 * top in `slot` at its next requested time. Without tangents or kr_tops.growth, does nothing. */
void kr_worker_store_growth(kr_worker *worker, const kr_slot *slot, kr_lane_number *row, int lane);
/* Writes the outcome and the reductions of the top in `slot`, and NaN for results not computed. */
void kr_worker_finish_top(kr_worker *worker, const kr_slot *slot,
                          const kr_accumulator *accumulators, kr_status status, kr_stats stats);
/* Returns the accumulators of a lane or, for KR_LANES_MAX, those of the scalar code. */
static inline kr_accumulator *kr_worker_accumulators(const kr_worker *worker, int lane)
{
    return worker->accumulators + (size_t)lane * worker->reductions;
}
/* Returns the longest wait for the next event of a top (kr_worker_section), or 0 without times. */
static inline double kr_worker_event_wait_limit(const kr_worker *worker, size_t top)
{
    const kr_tops *tops = worker->tops;
    return tops->times > 0 ? tops->t[tops->own_times ? top : 0] : 0.0;
}
/* Integrates top i with the scalar code, using `top` as workspace, and writes its results. */
void kr_worker_run_scalar(kr_worker *worker, kr_top *top, size_t i);
/* Returns the worker's configuration for top i. Its step is negative if the last requested time
 * precedes the initial time or, in a section, if the longest wait for an event is negative. */
kr_config kr_worker_config_of(const kr_worker *worker, size_t i);
static inline const double *kr_worker_times_of(const kr_tops *tops, size_t i)
{
    return tops->own_times && tops->times > 0 ? tops->t + i * tops->times : tops->t;
}

/* Fills a SIMD lane with a top at rest that has no goal and no event. */
void kr_lane_park(kr_lanes *l, int lane);
/* Sets the growth of the tangent in a lane to that of an initial tangent of length 1. */
void kr_lane_reset_growth(kr_growth *growth, int lane);
/* Stores the initial state for all requested times that equal the initial time. Then sets the goal
 * of a lane: the next requested time or, in a section, the end of the longest wait for the next
 * event. Returns 1 if the top stays in the lane, and 0 if it has left: it was finished or, because
 * the goal was invalid, computed by the scalar code. */
int kr_lane_set_goal(kr_worker *worker, int lane);
/* Computes the state of a lane at the user's time t, which must lie within its last step. */
kr_state kr_lane_sample(kr_worker *worker, int lane, double t);
/* Removes a top from its lane, and integrates it from the start with the scalar code. */
void kr_lane_fall_back(kr_worker *worker, int lane);
/* Writes the outcome and the reductions of the top in a SIMD lane, and frees the lane. */
void kr_lane_finish(kr_worker *worker, int lane, kr_status status);
/* Returns 1 if the last step of a lane reaches its goal. */
static inline int kr_lane_has_passed_goal(const kr_lanes *l, int lane)
{
    return l->forward[lane] * l->end[lane] >= l->forward[lane] * l->goal[lane];
}
/* Returns the state that kr_lanes_isa.sample has computed for a lane, with the user's time t. */
static inline kr_state kr_lane_read_sample(const kr_worker *worker, int lane, double t)
{
    const kr_lanes *l = worker->lanes;
    const kr_scene *scene = &worker->tops->scenes[worker->slots[lane].top];
    kr_state s = {t,
                  {l->out_q[0][lane], l->out_q[1][lane], l->out_q[2][lane], l->out_q[3][lane]},
                  {l->out_m[0][lane], l->out_m[1][lane], l->out_m[2][lane]}};
    if (scene->turning.z != 0.0) kr_scene_turn_state(scene, &s);
    return s;
}

/* Computes the closed forms of the tops `from` to from + n - 1, with n <= KR_BATCH, and writes the
 * results. Sets status[i] to KR_OK, or to an error if top from + i has no closed form. */
void kr_exact_batch_run(kr_worker *worker, size_t from, size_t n, kr_status status[]);

/* Sets the instruction set, Taylor order and tolerance of the lanes for the worker's config. */
void kr_scheduler_configure(kr_worker *worker);
/* Replaces the instruction set, order and tolerance of the lanes, for tests and benchmarks. */
void kr_scheduler_set_kernel(kr_worker *worker, const kr_lanes_isa *isa, int order,
                             double log2_tol);
/* Empties all lanes, and prepares them for damped (`damped` nonzero) or undamped tops. */
void kr_scheduler_reset(kr_worker *worker, int damped);
/* Integrates the tops in the SIMD lanes until one lane is free, and loads top i into this lane. If
 * top i may be strongly damped, the scalar code integrates it. An invalid top gets an error. */
void kr_scheduler_add(kr_worker *worker, size_t i);
/* Advances the tops in all SIMD lanes until each has reached its last requested time or event. */
void kr_scheduler_drain(kr_worker *worker);

/* Writes the event function for the top in worker->fallback to a lane. `rate` is the lane's unit of
 * frequency (lane_scheduler.c). A vector v along principal axes becomes shift_axes(v, shift). */
void kr_section_load_event(kr_worker *worker, int lane, double rate, int shift);
/* Stores the states at the events in the last step of a lane. Frees the lane if the top is finished
 * or the longest wait is over. */
void kr_section_search(kr_worker *worker, int lane);
#endif
