/* Symmetric compositions of kicks and drifts (splitting.h), and their coefficients. The methods
 * conserve the vertical momentum and, for Lagrange tops and torque-free symmetric bodies, the
 * momentum about the symmetry axis. The energy error is bounded and O(h^order), with the step size
 * h. A step is
 *     kick b_0, drift a_1, kick b_1, drift a_2, ... drift a_s, kick b_s,
 * where a_i and b_i are fractions of h. The sequences a_1 ... a_s and b_0 ... b_s are palindromic,
 * and each sums to 1. A row of compose_table therefore lists only the first half of each sequence,
 * without its one or two middle coefficients. A row without kick coefficients composes s steps of
 * Strang splitting, with b_i = (a_i + a_(i+1)) / 2 and a_0 = a_(s+1) = 0. A row with kick
 * coefficients omits b_0 = b_s = 0: the step begins and ends with a drift. Its coefficients satisfy
 * only the order conditions of Runge-Kutta-Nystrom methods, which suffice if the drift is exact. */
#ifndef KR_COMPOSITION_H
#define KR_COMPOSITION_H
#include "splitting.h"

enum { COMPOSE_MOST = 17 };
enum { SUZUKI4, KAHAN_LI6, KAHAN_LI8, BLANES_MOAN6 };

static const struct {
    int stages, kicks;
    double drift[COMPOSE_MOST / 2], kick[COMPOSE_MOST / 2];
} compose_table[] = {
    /* Suzuki, Phys. Lett. A 146 (1990): 1 / (4 - 4^(1/3)) */
    [SUZUKI4] = {.stages = 5, .drift = {0.41449077179437573714, 0.41449077179437573714}},
    /* Kahan and Li, Mathematics of Computation 66 (1997); Hairer, Lubich, Wanner V.3.2, (3.12) */
    [KAHAN_LI6] = {.stages = 9,
                   .drift = {0.39216144400731413928, 0.33259913678935943860,
                             -0.70624617255763935981, 0.08221359629355080023}},
    /* Kahan and Li, Mathematics of Computation 66 (1997); Hairer, Lubich, Wanner V.3.2, (3.13) */
    [KAHAN_LI8] = {.stages = 17,
                   .drift = {0.13020248308889008088, 0.56116298177510838456,
                             -0.38947496264484728641, 0.15884190655515560090,
                             -0.39590389413323757734, 0.18453964097831570709,
                             0.25837438768632204729, 0.29501172360931029887}},
    /* Blanes and Moan, J. Comput. Appl. Math. 142 (2002), SRKN_14^a */
    [BLANES_MOAN6] = {.stages = 15,
                      .kicks = 7,
                      .drift = {0.0378593198406116, 0.102635633102435, -0.0258678882665587,
                                0.314241403071447, -0.130144459517415, 0.106417700369543,
                                -0.00879424312851058},
                      .kick = {0.09171915262446165, 0.183983170005006, -0.05653436583288827,
                               0.004914688774712854, 0.143761127168358, 0.328567693746804}},
};

/* The coefficients of a step, as fractions of the step size, in the order drift[0], kick[0],
 * drift[1], ... Between steps, the momentum already includes the first kick of the next step, with
 * the coefficient `ahead`, merged with the last kick of the step. */
typedef struct composition {
    int stages;
    double ahead, drift[COMPOSE_MOST], kick[COMPOSE_MOST];
} composition;

/* Returns the drift and kick coefficients of the composition in one row of compose_table. */
static inline composition make_composition(int row)
{
    const int stages = compose_table[row].stages, kicks = compose_table[row].kicks,
              last = stages - 1;
    composition c = {.stages = stages};
    double left = 1.0;
    for (int i = 0; i < stages / 2; i++) {
        c.drift[i] = c.drift[last - i] = compose_table[row].drift[i];
        left -= 2.0 * c.drift[i];
    }
    c.drift[stages / 2] = left;
    c.ahead = kicks ? 0.0 : 0.5 * c.drift[0];
    c.kick[last] = 2.0 * c.ahead;
    left = 1.0;
    for (int i = 0; i < last / 2; i++) {
        const double next = i + 1 < kicks ? compose_table[row].kick[i] : 0.5 * left;
        const double b = kicks ? next : 0.5 * (c.drift[i] + c.drift[i + 1]);
        c.kick[i] = c.kick[last - 1 - i] = b;
        left -= 2.0 * b;
    }
    return c;
}

typedef struct composed {
    splitting s; /* the first kick is already applied to m */
    composition c;
} composed;
enum { COMPOSED_WORK = sizeof(composed) / sizeof(double) };

static inline kr_status composed_begin(kr_motion *motion, const kr_state *start, int row)
{
    composed *p = (composed *)motion->work;
    splitting_begin(&p->s, motion, start);
    p->c = make_composition(row);
    splitting_kick(&p->s, motion, p->c.ahead);
    return KR_OK;
}
static inline kr_status composed_step(kr_motion *motion, double until)
{
    composed *p = (composed *)motion->work;
    const int stages = p->c.stages;
    (void)until;
    /* drift_with_rotor_or_support takes the address of the state, which must then be in memory. */
    if (p->s.extra != 0.0) {
        for (int i = 0; i < stages; i++) {
            drift_with_rotor_or_support(&p->s, p->c.drift[i]);
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
