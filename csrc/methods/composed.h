/* Code shared by all compositions of kicks and free drifts with the coefficients of compose.h. The
 * methods conserve the vertical momentum. For Lagrange tops and torque-free symmetric bodies, the
 * methods also conserve the momentum about the symmetry axis. The energy error is bounded and
 * O(h^order). */
#ifndef KR_COMPOSED_H
#define KR_COMPOSED_H
#include "compose.h"
#include "splitting.h"

typedef struct composed {
    splitting s; /* the first kick is already applied to m */
    composition c;
} composed;
enum { COMPOSED_WORK = sizeof(composed) / sizeof(double) };

static inline kr_status composed_begin(kr_motion *motion, const kr_state *start, int row)
{
    composed *p = (composed *)motion->work;
    splitting_begin(&p->s, motion, start);
    p->c = compose(row);
    splitting_kick(&p->s, motion, p->c.ahead);
    return KR_OK;
}
static inline kr_status composed_step(kr_motion *motion, double until)
{
    composed *p = (composed *)motion->work;
    const int stages = p->c.stages;
    (void)until;
    /* splitting_drift_extra takes the address of the state, which must then be in memory. */
    if (p->s.extra != 0.0) {
        for (int i = 0; i < stages; i++) {
            splitting_drift_extra(&p->s, p->c.drift[i]);
            splitting_kick(&p->s, motion, p->c.kick[i]);
        }
    } else {
        splitting s = p->s; /* a local copy stays in registers */
        for (int i = 0; i < stages; i++) {
            splitting_drift_plain(&s, p->c.drift[i]);
            splitting_kick(&s, motion, p->c.kick[i]);
        }
        p->s.q = s.q;
        p->s.low_q = s.low_q;
        p->s.m = s.m;
        p->s.low_m = s.low_m;
    }
    p->s.steps += 1.0;
    motion->stats.evaluations += stages;
    return KR_OK;
}
/* Returns 1 if the number of stages fits in the arrays of a composition. */
static inline int composed_is_valid(const void *work)
{
    composed p;
    memcpy(&p, work, sizeof p);
    return p.c.stages >= 1 && p.c.stages <= COMPOSE_MOST;
}
static inline void composed_read(const kr_motion *motion, kr_state *out)
{
    const composed *p = (const composed *)motion->work;
    splitting_read(&p->s, motion, p->c.ahead, out);
}
/* Defines the method with the coefficients in a row of compose_table. */
#define COMPOSED_METHOD(id, row, its_order, further_flags, its_text, its_source)                   \
    static kr_status id##_reset(kr_motion *motion, const kr_state *start)                          \
    {                                                                                              \
        return composed_begin(motion, start, row);                                                 \
    }                                                                                              \
    const kr_method kr_method_##id = {                                                             \
        KR_METHOD_TEXTS(#id, its_text, SPLITTING_CONSERVES, its_source),                           \
        .order = its_order,                                                                        \
        .flags = SPLITTING_FLAGS | (further_flags),                                                \
        .work = COMPOSED_WORK,                                                                     \
        .reset = id##_reset,                                                                       \
        .step = composed_step,                                                                     \
        .read = composed_read,                                                                     \
        .is_valid = composed_is_valid,                                                             \
    };
#endif
