/* A stage: tops side by side on one clock, with the record of what is measured of them. Time is
 * counted in whole ticks, so that steps of different length meet exactly. A top stands at multiples
 * of its own step only. Tops are compared at common multiples of their steps only: elsewhere they
 * stand at different times, and that difference would be taken for an error. Nothing depends on how
 * the way is divided into calls. Memory is bounded. */
#ifndef KR_SIMULATION_H
#define KR_SIMULATION_H
#include "kreisel.h"

/* The measures of a top are the quantities of one number that do not turn with the heading, in the
 * order of their table. After them come the attitude error against another top, in radians, and
 * the modified energy, which bobenko_suris keeps at its step and no other method has. */
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
    /* The stage keeps so many attitudes of each top, one a step; then the oldest goes. */
    KR_SIMULATION_TRACE = 4096,
    /* The record has so many rows at most; when it is full two become one, and from then on. */
    KR_SIMULATION_ROWS = 1024,
    /* From one row to the next integrals and errors are measured so often, if the tops meet that
     * often; */
    KR_SIMULATION_SAMPLES = 64,
    /* and the others so often, for angles cost more than integrals. */
    KR_SIMULATION_FULL_SAMPLES = 32,
    KR_SIMULATION_TICKS = 1000000, /* ticks to the unit of time */
    /* What stands for the top with which one is compared: there is none, or it is itself a truth
     * for the others, which goes on only while one of those does. */
    KR_SIMULATION_NO_REFERENCE = -1,
    KR_SIMULATION_REFERENCE = -2,
    /* In one call the methods take so many steps of their own, and so many more for each step: a
     * call for few steps is over in milliseconds, however fast a top may be. */
    KR_SIMULATION_BUDGET = 32,
    KR_SIMULATION_BUDGET_PER_STEP = 4
};

typedef struct kr_simulation_slot {
    kr_scene scene;
    kr_state now;
    kr_top *top;             /* belongs to the stage; NULL for a track */
    const kr_state *track;   /* belongs to the caller; NULL for a top */
    int64_t length;          /* states of the track */
    int64_t step;            /* in ticks */
    int64_t steps;           /* done so far */
    int restarts;            /* begins anew after each step */
    int has_modified_energy; /* has a modified energy */
    int reference;           /* the top with which it is compared, which may come later */
    kr_status status;        /* not KR_OK: it stays where it is */
    /* what is measured of it; NULL for what is NaN at the start, as K of a body that has none */
    const kr_quantity *quantity[KR_SIMULATION_ERROR];
    kr_quat trace[KR_SIMULATION_TRACE]; /* attitude after step k at k % KR_SIMULATION_TRACE */
} kr_simulation_slot;

typedef struct kr_record_row {
    double time;
    double at[KR_SIMULATION_TOPS][KR_SIMULATION_MEASURES]; /* NaN: not to be had */
    /* A measure may have swung often since the row before: these are its extremes. */
    double low[KR_SIMULATION_TOPS][KR_SIMULATION_MEASURES],
        high[KR_SIMULATION_TOPS][KR_SIMULATION_MEASURES];
} kr_record_row;

typedef struct kr_simulation {
    int count;
    int64_t clock;  /* ticks that all tops have reached, up to their steps */
    int64_t common; /* the least common multiple of the steps; 0 if it does not fit */
    int64_t stride; /* ticks from row to row of the record */
    int64_t rows;   /* how many rows the record has */
    kr_record_row
        record[KR_SIMULATION_ROWS + 1]; /* the row behind the last has the extremes since then */
    kr_simulation_slot slots[KR_SIMULATION_TOPS];
    int64_t budget, cost; /* own steps that are left in this call; what asking takes of them */
    int is_late;          /* whether none were left */
} kr_simulation;

/* Measure k, if it is a quantity of the state; NULL for the attitude error and what follows it. */
const kr_quantity *kr_simulation_quantity(int k);

/* A stage of zeros is empty, and so is one after this. While it has tops it stays where it is. */
void kr_simulation_clear(kr_simulation *stage);
/* Adds a top, at the start, and begins the record anew. An adaptive method begins anew after each
 * step, as in the thesis: else its states would not depend on the step. One with dense output only
 * gives its state there. */
kr_status kr_simulation_add(kr_simulation *stage, const kr_scene *scene, const kr_method *method,
                            int64_t step, double tol, int against);
/* Adds a top whose states were computed elsewhere, a step apart, the start first. They must outlive
 * the stage. */
kr_status kr_simulation_add_track(kr_simulation *stage, const kr_scene *scene,
                                  const kr_state track[], int64_t length, int64_t step,
                                  int against);
/* Takes all tops on to their last step not after `target`, but takes at most so many steps in all.
 * Returns the clock then. A top so fast that its method would take thousands of steps for one of
 * these is left on its way, `is_late` says so, and the next call takes it on from there. */
int64_t kr_simulation_advance(kr_simulation *stage, int64_t target, int64_t most);
/* What is measured of top i now. A measure is NaN where it is not to be had: for a top that failed,
 * and the attitude error where there is no other top or where it stands at another time. */
void kr_simulation_measure(const kr_simulation *stage, int i,
                           double measure[KR_SIMULATION_MEASURES]);
#endif
