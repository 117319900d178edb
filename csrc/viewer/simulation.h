/* Simulation of several tops with a common time, and a record of their measured values. Time is
 * counted in integer ticks, so that multiples of different steps can be exactly equal. The states
 * of each top are computed at multiples of its own step size. A top may have a reference: another
 * top with which its attitude is compared, at common multiples of their steps only. Results do not
 * depend on how the simulated time is divided among calls. kr_simulation has a fixed size. */
#ifndef KR_SIMULATION_H
#define KR_SIMULATION_H
#include "kreisel.h"

/* Indices of the measured values of a top: first all scalar quantities that do not change in a
 * rotation about the vertical, in the order of quantities.def; then KR_SIMULATION_ERROR (attitude
 * error against the reference [rad]) and KR_SIMULATION_MODIFIED (kr_state_modified_energy). */
enum {
#define Q(name, doubles, flags, dimension, text) +((doubles) == 1 && !((flags) & KR_QUANTITY_TURNS))
    KR_SIMULATION_ERROR =
#include "quantities.def"
        ,
#undef Q
    KR_SIMULATION_MODIFIED,
    KR_SIMULATION_MEASURES
};
enum {
    KR_SIMULATION_TOPS = 8,
    /* Number of most recent attitudes stored for each top. */
    KR_SIMULATION_TRACE = 4096,
    /* Maximum number of rows in the record. When it is full, rows are merged in pairs. */
    KR_SIMULATION_ROWS = 1024,
    /* Largest number of times per row of the record at which the integrals of the motion, the
     * attitude errors and the modified energies are measured. */
    KR_SIMULATION_SAMPLES = 64,
    /* Largest number of times for all other quantities, whose measurement takes longer. */
    KR_SIMULATION_FULL_SAMPLES = 32,
    KR_SIMULATION_TICKS = 1000000, /* ticks in a unit of time */
    /* Values of kr_simulation_slot.reference for a top without a reference, and for a top that only
     * serves as a reference. When only tops of the second kind can continue, all tops stop. */
    KR_SIMULATION_NO_REFERENCE = -1,
    KR_SIMULATION_REFERENCE = -2,
    /* The step budget: kr_simulation_advance with `most` = n makes at most KR_SIMULATION_BUDGET +
     * KR_SIMULATION_BUDGET_PER_STEP * n + 256 internal steps of the methods; + 256, because
     * internal steps are counted in blocks. If n is small, such a call takes milliseconds. */
    KR_SIMULATION_BUDGET = 32,
    KR_SIMULATION_BUDGET_PER_STEP = 4
};

typedef struct kr_simulation_slot {
    kr_scene scene;
    kr_state now;
    kr_top *top;             /* owned by the simulation; NULL for a track */
    const kr_state *track;   /* owned by the caller; NULL for a top */
    int64_t length;          /* number of states in the track */
    int64_t step;            /* in ticks */
    int64_t steps;           /* number of steps made */
    int restarts;            /* nonzero: restarted after each step */
    int has_modified_energy; /* nonzero: the method conserves a modified energy */
    int reference;           /* index of the reference, which may be added later */
    kr_status status;        /* the top advances only while this is KR_OK and `is_down` is 0 */
    double lowest;           /* height of the apex, a cosine, at which the rim meets the floor */
    int is_down;             /* nonzero: the rim meets the floor during the next step */
    double stood;            /* time at which the rim meets the floor */
    /* the measured quantities; NULL for a quantity that is NaN at the start */
    const kr_quantity *quantity[KR_SIMULATION_ERROR];
    /* the attitude and momentum after step k have the index k % KR_SIMULATION_TRACE */
    kr_quat attitudes[KR_SIMULATION_TRACE];
    kr_vec3 momenta[KR_SIMULATION_TRACE];
} kr_simulation_slot;

typedef struct kr_record_row {
    double time;
    double at[KR_SIMULATION_TOPS][KR_SIMULATION_MEASURES]; /* NaN: not available */
    /* Minimum and maximum of each measured value since the previous row of the record. */
    double low[KR_SIMULATION_TOPS][KR_SIMULATION_MEASURES],
        high[KR_SIMULATION_TOPS][KR_SIMULATION_MEASURES];
} kr_record_row;

typedef struct kr_simulation {
    int count;
    int64_t clock;  /* time that all tops have reached, in ticks */
    int64_t common; /* the least common multiple of the steps; 0 if too large for 64 bits */
    int64_t stride; /* ticks between two rows of the record */
    int64_t rows;   /* number of rows */
    /* The row at index `rows` holds the extrema since the last complete row. */
    kr_record_row record[KR_SIMULATION_ROWS + 1];
    kr_simulation_slot slots[KR_SIMULATION_TOPS];
    int64_t budget, cost; /* remaining steps in this call; steps between two calls of poll */
    int is_late;          /* 1 if the last call ended because the budget was used up */
} kr_simulation;

/* Returns the quantity with index k among the measured values, or NULL if k is not a quantity. */
const kr_quantity *kr_simulation_quantity(int k);

/* Removes all tops. A zero-initialized simulation has none. A simulation must not be moved in
 * memory while it contains tops, because its tops point to it. */
void kr_simulation_clear(kr_simulation *simulation);
/* Adds a top in its initial state at time 0, and clears the record. `step` is the step size in
 * ticks; `against` is the index of the top's reference, KR_SIMULATION_NO_REFERENCE or
 * KR_SIMULATION_REFERENCE. An adaptive method without dense output is restarted after each step, so
 * its states depend on `step`. Returns KR_ERR_ARGUMENT after the simulation has advanced. */
kr_status kr_simulation_add(kr_simulation *simulation, const kr_scene *scene,
                            const kr_method *method, int64_t step, double tol, int against);
/* Adds a top whose motion is given: track[k] is the state after k steps, for k < length. The array
 * must outlive the simulation. The other arguments are those of kr_simulation_add. */
kr_status kr_simulation_add_track(kr_simulation *simulation, const kr_scene *scene,
                                  const kr_state track[], int64_t length, int64_t step,
                                  int against);
/* Sets a floor for the last added top. Its motion ends when the cosine of its nutation angle falls
 * below `lowest`, where the rim of the top touches the floor. The top then remains in the last
 * state above the floor. The time of contact is interpolated linearly within the next step, and
 * stored in kr_simulation_slot.stood. Without this call, there is no floor. */
void kr_simulation_set_floor(kr_simulation *simulation, double lowest);
/* Advances each top by whole steps, as far as possible without passing the time `target`, in ticks.
 * Makes at most `most` steps in total for all tops. Returns the time reached, in ticks. If the step
 * budget is exhausted within a step, sets `is_late`, and the next call continues this step. */
int64_t kr_simulation_advance(kr_simulation *simulation, int64_t target, int64_t most);
/* Writes the current measured values of top i. All are NaN if its status is not KR_OK. The attitude
 * error is NaN without a reference, or if the reference has reached a different time. */
void kr_simulation_measure(const kr_simulation *simulation, int i,
                           double measure[KR_SIMULATION_MEASURES]);
#endif
