/* A stage: tops side by side on one clock, with what is to be seen of them. Time is
 * counted in whole ticks, so that steps of different length meet exactly. A top stands at multiples
 * of its own step only. Tops are compared at common multiples only: elsewhere they stand at
 * different times, and that difference would be taken for an error. Nothing depends on how the way
 * is divided into calls. Memory is bounded. */
#ifndef KR_STAGE_H
#define KR_STAGE_H
#include "kreisel.h"

enum {
    KR_STAGE_TOPS = 8,
    /* attitudes kept of each top, one a step; then the oldest goes */
    KR_STAGE_TRACE = 4096,
    /* rows of the record; when it is full two become one, and from then on */
    KR_STAGE_ROWS = 1024,
    /* at the tops from one row to the next, if they meet that often */
    KR_STAGE_LOOKS = 64,
    KR_STAGE_TICKS = 1000000 /* ticks to the unit of time */
};

typedef struct kr_measure { /* of one top */
    double energy, vertical, axial;
    double fourth; /* K or G; NaN for a body that has none */
    double error; /* frame error (half the attitude error) against another top; NaN without one, and
                                     * where the two are at different times */
} kr_measure;

typedef struct kr_actor {
    kr_scene scene;
    kr_state now;
    kr_top *top;                   /* the stage's own; NULL for a track, */
    const kr_state *track;         /* whose states are the caller's */
    int64_t length, eps, steps;    /* states of the track; ticks to the step; steps done */
    int restarts;                  /* begins anew after each step */
    int against;                   /* the top with which it is compared; -1: none */
    kr_status status;              /* not KR_OK: it stays where it is */
    kr_quat trace[KR_STAGE_TRACE]; /* attitude after step k at k % KR_STAGE_TRACE */
} kr_actor;

typedef struct kr_row {
    double time;
    kr_measure at[KR_STAGE_TOPS];
    /* the extremes since the row before: it may have swung often */
    kr_measure low[KR_STAGE_TOPS], high[KR_STAGE_TOPS];
} kr_row;

typedef struct kr_stage {
    int tops;
    int64_t clock; /* ticks that all tops have reached, up to their steps */
    /* the least common multiple of the steps; 0 if it does not fit */
    int64_t common;
    int64_t stride, rows;          /* ticks from row to row of the record; how many there are */
    kr_row row[KR_STAGE_ROWS + 1]; /* behind the last: the extremes since then */
    kr_actor actor[KR_STAGE_TOPS];
} kr_stage;

/* An empty stage: one of zeros, or after this. */
void kr_stage_clear(kr_stage *stage);
/* One more top, at the start; begins the record anew. An adaptive method begins anew at each eps,
 * as in the thesis: else its states would not depend on eps. One with dense output is only looked
 * at there. */
kr_status kr_stage_add(kr_stage *stage, const kr_scene *scene, const kr_method *method, int64_t eps,
                       double tol, int against);
/* States computed elsewhere, eps apart, first the start. They must outlive the stage. */
kr_status kr_stage_add_track(kr_stage *stage, const kr_scene *scene, const kr_state track[],
                             int64_t length, int64_t eps, int against);
/* All tops on to their last step not after `target`, but at most so many steps in all. The clock
 * then. */
int64_t kr_stage_advance(kr_stage *stage, int64_t target, int64_t most);
kr_measure kr_stage_measure(const kr_stage *stage, int i);
#endif
