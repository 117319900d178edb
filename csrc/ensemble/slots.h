/* The worker and the functions that the source files in ensemble/ share. The file worker.c
 * dispatches the tops: exact_batch.c evaluates closed-form solutions in batches, and
 * lane_scheduler.c integrates other tops in SIMD lanes. Events are found by section.c. Each top in
 * progress has a slot (slots.c). The file reduce.c computes statistics of the states. */
#ifndef KR_SLOTS_H
#define KR_SLOTS_H
#include "driver/top.h"
#include "exact/exact.h"
#include "lane_state.h"
#include "model/scene.h"

enum { KR_BATCH = 64 /* number of tops that are dispatched together */ };

/* The progress of one top, which is integrated in a lane or by the scalar code. */
typedef struct kr_slot {
    size_t top, states; /* index of the top; number of its valid states */
    int64_t steps;      /* steps of a closed form; lanes count their own steps */
    double start, time_unit, rate, horizon, forward, requested;
    double start_noise; /* in sections, smaller values count as zero until a first sign is known */
    kr_state last;
} kr_slot;

/* State of a reduction: the number `value`, and an auxiliary number `more`. For a variance, `value`
 * is the mean, and `more` is the sum of the squared deviations from the mean. For other reductions,
 * `value` is the current extremum, mean or last value, and `more` is the time of an extremum. */
typedef struct kr_accumulator {
    double value, more;
} kr_accumulator;
/* Updates the accumulators of all reductions with the k-th state of a top. */
void kr_reduce_add(size_t n, const kr_reduction reduction[], kr_accumulator accumulators[],
                   const kr_scene *scene, const kr_state *state, size_t k);
/* Writes the final results of the reductions, where `states` is the number of states. */
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

/* Stores a state of the top described by `slot`, and adds it to the statistics in
 * `accumulators`. */
void kr_worker_store_state(kr_worker *worker, kr_slot *slot, kr_accumulator *accumulators,
                           const kr_state *state);
/* Calls the user's poll. Returns nonzero if the worker must stop. */
int kr_worker_poll(kr_worker *worker);
/* Calls the user's poll if many states have been stored since its last call. Returns nonzero if the
 * worker must stop. */
int kr_worker_poll_after_states(kr_worker *worker);
static inline int kr_worker_has_tangents(const kr_worker *worker)
{
    return worker->lanes && worker->lanes->tangents;
}
/* Stores the growth of a lane's tangent for the next requested time, or zeros if `row` is NULL. */
void kr_worker_store_growth(kr_worker *worker, const kr_slot *slot, kr_lane_number *row, int lane);
/* Writes the outcome of a top and the results of its reductions. Sets all output elements that
 * were not computed to NaN. */
void kr_worker_finish_top(kr_worker *worker, const kr_slot *slot,
                          const kr_accumulator *accumulators, kr_status status, kr_stats stats);
/* Returns the accumulators of a lane or, for KR_LANES_MAX, those of the scalar code. */
static inline kr_accumulator *kr_worker_accumulators(const kr_worker *worker, int lane)
{
    return worker->accumulators + (size_t)lane * worker->reductions;
}
/* Returns the maximum waiting time for the next event of top i, or 0 if no times are requested. */
static inline double kr_worker_max_wait(const kr_worker *worker, size_t i)
{
    const kr_tops *tops = worker->tops;
    return tops->times > 0 ? tops->t[tops->own_times ? i : 0] : 0.0;
}
/* Integrates top i with the scalar code, using `top` as workspace. */
void kr_worker_run_scalar(kr_worker *worker, kr_top *top, size_t i);
/* Returns the configuration for top i. The step is negative if the last requested time precedes the
 * initial time, or if the waiting time of a section is negative. */
kr_config kr_worker_config_of(const kr_worker *worker, size_t i);
static inline const double *kr_worker_times_of(const kr_tops *tops, size_t i)
{
    return tops->own_times && tops->times > 0 ? tops->t + i * tops->times : tops->t;
}

/* Fills an unused SIMD lane with a top at rest, which never reaches its goal. */
void kr_lane_park(kr_lanes *l, int lane);
/* Sets the growth of the tangent in a lane to zero. */
void kr_lane_reset_growth(kr_growth *growth, int lane);
/* Sets the time at which a lane must stop (its goal): the next requested time, or in a section the
 * latest time of the next event. If a requested time equals the initial time, stores the initial
 * state itself. Returns 0 and frees the lane if the top is finished, or if the scalar code must
 * integrate it. */
int kr_lane_set_goal(kr_worker *worker, int lane);
/* Returns the state of a lane at time t, which must lie within its last step. */
kr_state kr_lane_sample(kr_worker *worker, int lane, double t);
/* Removes a top from its lane and repeats the integration with the scalar code, which reports the
 * error. */
void kr_lane_fall_back(kr_worker *worker, int lane);
/* Writes the status and statistics of the top in a SIMD lane, and frees the lane. */
void kr_lane_finish(kr_worker *worker, int lane, kr_status status);
/* Returns 1 if the current step of a lane reaches the time at which the lane must stop (its
 * goal). */
static inline int kr_lane_has_passed_goal(const kr_lanes *l, int lane)
{
    return l->forward[lane] * l->end[lane] >= l->forward[lane] * l->goal[lane];
}
/* Returns the state of a lane that was sampled last, with its time set to t. */
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

/* Evaluates the closed forms of the tops `from` to from + n - 1, with n <= KR_BATCH. Sets status[i]
 * to KR_OK if top from + i has a closed form, else to an error code. */
void kr_exact_batch_run(kr_worker *worker, size_t from, size_t n, kr_status status[]);

/* Chooses the instruction set, order and tolerance of the lanes from the configuration. */
void kr_scheduler_configure(kr_worker *worker);
/* Replaces the instruction set, Taylor order and tolerance of the vectorized integration, for tests
 * and benchmarks. */
void kr_scheduler_set_kernel(kr_worker *worker, const kr_lanes_isa *isa, int order,
                             double log2_tol);
/* Empties all lanes, for damped or for undamped tops. */
void kr_scheduler_reset(kr_worker *worker, int damped);
/* Integrates the tops in the SIMD lanes until one lane is free, and loads top i into this lane. */
void kr_scheduler_add(kr_worker *worker, size_t i);
/* Advances the tops in all SIMD lanes until each has reached its last requested time or event. */
void kr_scheduler_drain(kr_worker *worker);

/* Stores the event function for the top in one SIMD lane, given the frequency unit `rate` and the
 * cyclic shift of the axes. */
void kr_section_load_event(kr_worker *worker, int lane, double rate, int shift);
/* Stores the events in the last step of a lane, and frees the lane if the top is finished. */
void kr_section_search(kr_worker *worker, int lane);
#endif
