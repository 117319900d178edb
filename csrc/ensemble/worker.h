/* The worker, shared by the files of ensemble/: worker.c dispatches tops, exact_batch.c evaluates
 * closed forms in batches, lane_scheduler.c moves tops in lanes, section.c finds events, reduce.c
 * reduces states. */
#ifndef KR_WORKER_H
#define KR_WORKER_H
#include "driver/top.h"
#include "lane_state.h"
#include "reduce.h"

enum { KR_BATCH = 64 /* tops that are dispatched together */ };

/* The top in a lane. */
typedef struct kr_slot {
    size_t top, states; /* its index, and its number of good states */
    int64_t steps;      /* steps of a closed form; lanes count their own */
    double start, time_unit, rate, horizon, forward, requested;
    double start_noise; /* sections: noise until a first sign is known */
    kr_state last;
} kr_slot;

struct kr_worker {
    kr_config config;
    const kr_method *method; /* NULL: chosen for each top */
    kr_top *fallback;        /* the method, or taylor, for tops that no lane can move */
    kr_top *exact_top;       /* the closed form; NULL if the method is another */
    kr_exact *plans;         /* closed forms of a batch; NULL without `exact_top` */
    const kr_tops *tops;     /* the tops of the current call */
    int is_section;          /* nonzero: compute a section with `event` */
    kr_event event;
    int interrupted;
    const kr_lanes_isa *isa; /* NULL: the method has no lanes */
    kr_lanes *lanes;
    unsigned busy; /* bits of the lanes that hold a top */
    kr_slot slots[KR_LANES_MAX];
    size_t reductions;
    kr_reduction *reduction;
    kr_accumulator *accumulators; /* one row for each lane, and one for scalar runs */
    double memory[];
};

/* Writes a state of the top of `slot`, updates its accumulators, and counts it. */
void kr_worker_store_state(kr_worker *worker, kr_slot *slot, kr_accumulator *accumulators,
                           const kr_state *state);
/* Returns 1 if the lanes carry tangents. */
int kr_worker_has_tangents(const kr_worker *worker);
/* Writes the growth of a lane's tangent at the next time; zeros if `row` is NULL. */
void kr_worker_store_growth(kr_worker *worker, const kr_slot *slot, kr_lane_number *row, int lane);
/* Writes the outcome of a top, its reductions, and NaN behind its last good state. */
void kr_worker_finish_top(kr_worker *worker, const kr_slot *slot,
                          const kr_accumulator *accumulators, kr_status status, kr_stats stats);
/* Returns the accumulators of scalar runs. */
static inline kr_accumulator *kr_worker_scalar_accumulators(const kr_worker *worker)
{
    return worker->accumulators + KR_LANES_MAX * worker->reductions;
}
/* Moves a single top with `top`. */
void kr_worker_run_scalar(kr_worker *worker, kr_top *top, size_t i);
/* Returns the config for top i. Its last time decides the direction of the step. */
kr_config kr_worker_config_of(const kr_worker *worker, size_t i);
/* Moves all tops to their times, or to their events. */
kr_status kr_worker_run_tops(kr_worker *worker, const kr_tops *tops);
/* Returns the times of top i. */
static inline const double *kr_worker_times_of(const kr_tops *tops, size_t i)
{
    return tops->own_times && tops->times > 0 ? tops->t + i * tops->times : tops->t;
}

/* Moves those of n tops from `from` on that have a closed form; n is at most KR_BATCH. Writes the
 * status of kr_exact_plan for each. */
void kr_exact_batch_run(kr_worker *worker, size_t from, size_t n, kr_status status[]);

/* Chooses instruction set, order and tolerance of the lanes from the config. */
void kr_scheduler_configure(kr_worker *worker);
/* Sets another kernel, order and tolerance, for tests and measurements. */
void kr_scheduler_set_kernel(kr_worker *worker, const kr_lanes_isa *isa, int order,
                             double log2_tol);
/* Empties all lanes. */
void kr_scheduler_reset(kr_worker *worker);
/* Adds a top as soon as a lane is free. */
void kr_scheduler_add(kr_worker *worker, size_t i);
/* Moves all tops in lanes to their ends. */
void kr_scheduler_drain(kr_worker *worker);
/* Returns the state of a lane at time t, which lies in its last step. */
kr_state kr_scheduler_sample(kr_worker *worker, int lane, double t);
/* Removes a top from its lane and moves it by a scalar run from its start, which reports the error.
 * */
void kr_scheduler_fall_back(kr_worker *worker, int lane);
/* Writes the outcome of the top in a lane and frees the lane. */
void kr_scheduler_finish(kr_worker *worker, int lane, kr_status status);
/* Returns 1 if a lane's step reaches its goal. */
static inline int kr_scheduler_has_passed_goal(const kr_lanes *l, int lane)
{
    return l->forward[lane] * l->end[lane] >= l->forward[lane] * l->goal[lane];
}
/* Returns the accumulators of a lane. */
static inline kr_accumulator *kr_scheduler_accumulators(const kr_worker *worker, int lane)
{
    return worker->accumulators + (size_t)lane * worker->reductions;
}

/* Returns the largest time to the next event of a section; 0 without times. */
static inline double kr_section_max_wait(const kr_worker *worker, size_t i)
{
    const kr_tops *tops = worker->tops;
    return tops->times > 0 ? tops->t[tops->own_times ? i : 0] : 0.0;
}
/* Returns 1 if the lanes can detect the event of the section. */
int kr_section_suits_lanes(const kr_worker *worker);
/* Sets the event of a lane, in the units of a step with this rate, and for axes that are shifted by
 * `shift`. */
void kr_section_load_event(kr_worker *worker, int lane, double rate, int shift);
/* Sets the time limit of a lane's next event. Returns 0, and frees the lane, if there is no event
 * to search. */
int kr_section_set_goal(kr_worker *worker, int lane);
/* Accepts the events in a lane's last step, and frees the lane if its top is done. */
void kr_section_search(kr_worker *worker, int lane);
/* Moves a started top to its events. */
kr_status kr_section_record(kr_worker *worker, kr_top *top, kr_slot *slot,
                            kr_accumulator *accumulators);
#endif
