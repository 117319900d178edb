/* A worker, as the files of ensemble/ share it: worker.c gives each top to whoever moves it,
 * exact_batch.c sets up those that have a closed form, lane_scheduler.c moves tops in lanes,
 * reduce.c keeps what is wanted of their states. */
#ifndef KR_WORKER_H
#define KR_WORKER_H
#include "driver/top.h"
#include "lane_state.h"
#include "reduce.h"

enum { KR_BATCH = 64 /* tops that are set up at once */ };

/* The top in a lane. */
typedef struct kr_slot {
    size_t top, states; /* its number, and its states that are good */
    int64_t steps;      /* of a closed form; lanes count their own */
    double start, time_unit, rate, horizon, forward, requested;
    double start_noise; /* in a section, until a first sign is known */
    kr_state last;
} kr_slot;

struct kr_worker {
    kr_config config;
    const kr_method *method; /* NULL: by the top */
    kr_top *fallback;        /* moves by the method, or by taylor, what no lane does */
    kr_top *exact_top;       /* the closed form; NULL where the method is another */
    kr_exact *plans;         /* those of a block, where there is `closed` */
    const kr_tops *tops;     /* what is under way */
    int is_section;          /* it is a section, for this event */
    kr_event event;
    int interrupted;
    const kr_lanes_isa *isa; /* NULL: the method has no lanes */
    kr_lanes *lanes;
    unsigned busy; /* lanes with a top, as bits */
    kr_slot slots[KR_LANES_MAX];
    size_t reductions;
    kr_reduction *reduction;
    kr_accumulator *accumulators; /* a row for each lane, and one for the top that goes alone */
    double memory[];
};

/* Writes a state of the top `slot` is about, and counts it. */
void kr_worker_store_state(kr_worker *worker, kr_slot *slot, kr_accumulator *kept,
                           const kr_state *state);
/* Writes how the tangent of a lane has grown beside the state that comes next; NULL: not at all. */
/* Whether tangents ride along with its lanes. */
int kr_worker_has_tangents(const kr_worker *worker);
void kr_worker_store_growth(kr_worker *worker, const kr_slot *slot, kr_lane_number *row, int lane);
/* Tells what became of a top. */
void kr_worker_finish_top(kr_worker *worker, const kr_slot *slot, const kr_accumulator *kept,
                          kr_status status, kr_stats stats);
/* The row of what is kept for the top that goes by itself. */
static inline kr_accumulator *kr_worker_scalar_accumulators(const kr_worker *worker)
{
    return worker->accumulators + KR_LANES_MAX * worker->reductions;
}
/* Moves a top by itself. */
void kr_worker_run_scalar(kr_worker *worker, kr_top *top, size_t i);
/* The config for a top, whose side its last time decides. */
kr_config kr_worker_config_of(const kr_worker *worker, size_t i);
/* Moves the tops, all to their times or to their events. */
kr_status kr_worker_run_tops(kr_worker *worker, const kr_tops *tops);
static inline const double *kr_worker_times_of(const kr_tops *tops, size_t i)
{
    return tops->own_times && tops->times > 0 ? tops->t + i * tops->times : tops->t;
}

/* Moves those of at most KR_BATCH tops, from number `from` on, that have a closed form. What
 * kr_exact_plan says of each goes into `status`; the others are left. */
void kr_exact_batch_run(kr_worker *worker, size_t from, size_t n, kr_status status[]);

/* Chooses the lanes' instruction set, order and tolerance, by the config. */
void kr_scheduler_configure(kr_worker *worker);
/* Goes on with others: this is for tests and measurements. */
void kr_scheduler_set_kernel(kr_worker *worker, const kr_lanes_isa *isa, int order,
                             double log2_tol);
/* Empties the lanes. */
void kr_scheduler_reset(kr_worker *worker);
/* Takes a top in, as soon as a lane is free. */
void kr_scheduler_add(kr_worker *worker, size_t i);
/* Moves all tops that are in lanes to their ends. */
void kr_scheduler_drain(kr_worker *worker);
/* Looks at the lanes at `at`, and gives what is seen in one of them. */
kr_state kr_scheduler_sample(kr_worker *worker, int lane, double t);
/* Moves a top that cannot be moved on in its lane alone, from its start. */
void kr_scheduler_fall_back(kr_worker *worker, int lane);
/* Ends what a lane does, and tells what became of its top. */
void kr_scheduler_finish(kr_worker *worker, int lane, kr_status status);
/* Whether a lane's piece reaches to its goal. */
static inline int kr_scheduler_has_passed_goal(const kr_lanes *l, int lane)
{
    return l->forward[lane] * l->end[lane] >= l->forward[lane] * l->goal[lane];
}
static inline kr_accumulator *kr_scheduler_accumulators(const kr_worker *worker, int lane)
{
    return worker->accumulators + (size_t)lane * worker->reductions;
}

/* How long a top may take from event to event; where no event is asked for nobody has to say. */
static inline double kr_section_max_wait(const kr_worker *worker, size_t i)
{
    const kr_tops *tops = worker->tops;
    return tops->times > 0 ? tops->t[tops->own_times ? i : 0] : 0.0;
}
/* Whether the lanes can look for the event. */
int kr_section_suits_lanes(const kr_worker *worker);
/* Sets what a lane looks for, in units of this rate and with axes that go on so often; then how far
 * it may go, which cannot be told from some time on. */
void kr_section_load_event(kr_worker *worker, int lane, double rate, int shift);
int kr_section_set_goal(kr_worker *worker, int lane);
/* Takes the events in a lane's piece, and ends what it does where there is no more to do. */
void kr_section_search(kr_worker *worker, int lane);
/* Moves a top that has begun to its events. */
kr_status kr_section_record(kr_worker *worker, kr_top *top, kr_slot *slot, kr_accumulator *kept);
#endif
