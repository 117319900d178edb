/* The splitting of Takahashi and Imada: half a modified kick (modified_kick.h), a free drift, and
 * half a modified kick. The method has order 4 and needs only one kick per step. The free drift
 * must be computed with order 4 or higher. For symmetric bodies, the drift is exact (splitting.h).
 * For other bodies, the drift is Suzuki's composition (composition.h) of rotations about the
 * principal axes N and T and, if there is a rotor, B. The method conserves the vertical momentum,
 * and for Lagrange tops also the axial momentum. The energy error is bounded and O(h^4). The steps
 * are symplectic. The processor (modified_kick.h), which is applied when a state is read, preserves
 * the symplectic form only up to a bounded error of order h^6. Steps in which the top may rotate by
 * more than 2.5 rad are refused, except for Lagrange tops, whose drift is exact. */
#include "composition.h"
#include "modified_kick.h"

typedef struct {
    splitting s; /* m includes half of the next kick; the processor is not applied */
    modified_kick kick;
    composition c;
} takahashi_state;

static kr_status takahashi_reset(kr_motion *motion, const kr_state *start)
{
    takahashi_state *p = (takahashi_state *)motion->work;
    splitting_begin(&p->s, motion, start);
    p->kick = make_modified_kick(motion);
    p->c = make_composition(SUZUKI4);
    const int is_exact = p->kick.lagrange && splitting_is_drift_exact(&p->s);
    if (!is_exact && !modified_kick_is_step_small(&p->kick, start, 2.5)) return KR_ERR_STEP_SIZE;
    const kr_status status = modified_kick_apply_processor(&p->kick, -1.0, &p->s.q, &p->s.m);
    splitting_add_impulse(&p->s, modified_kick_impulse(&p->kick, p->s.q, 0.5));
    return status;
}
static void takahashi_drift(takahashi_state *p)
{
    if (splitting_is_drift_exact(&p->s)) {
        splitting_drift(&p->s, 1.0);
        return;
    }
    splitting_body b = splitting_rotate_to_body(&p->s);
    if (p->s.extra != 0.0) {
        for (int i = 0; i < p->c.stages; i++) splitting_rotate_gyrostat(&b, &p->s, p->c.drift[i]);
    } else {
        splitting_rotate_about_n(&b, p->c.ahead * p->s.n);
        for (int i = 0; i < p->c.stages; i++) {
            splitting_rotate_about_t(&b, p->c.drift[i] * p->s.t);
            splitting_rotate_about_n(&b,
                                     (i + 1 < p->c.stages ? p->c.kick[i] : p->c.ahead) * p->s.n);
        }
    }
    splitting_rotate_about_m(&p->s, &b, 1.0);
}
static kr_status takahashi_step(kr_motion *motion, double until)
{
    takahashi_state *p = (takahashi_state *)motion->work;
    (void)until;
    takahashi_drift(p);
    splitting_add_impulse(&p->s, modified_kick_impulse(&p->kick, p->s.q, 1.0));
    p->s.steps += 1.0;
    motion->stats.evaluations++;
    return KR_OK;
}
static void takahashi_read(const kr_motion *motion, kr_state *out)
{
    const takahashi_state *p = (const takahashi_state *)motion->work;
    splitting_read(&p->s, motion, 0.0, out);
    out->m = v_add(out->m, modified_kick_impulse(&p->kick, out->q, -0.5));
    modified_kick_apply_processor(&p->kick, 1.0, &out->q, &out->m);
}
/* Returns 1 if the number of stages fits in the arrays of a composition. */
static int takahashi_is_valid(const void *work)
{
    takahashi_state p;
    memcpy(&p, work, sizeof p);
    return p.c.stages >= 1 && p.c.stages <= COMPOSE_MOST;
}

const kr_method kr_method_takahashi_imada4 = {
    KR_METHOD_TEXTS("takahashi_imada4",
                    "modified kick, free drift, modified kick; output states are post-processed",
                    SPLITTING_CONSERVES, "Takahashi and Imada 1984; Rowlands 1991"),
    .order = 4,
    .flags = KR_METHOD_SYMPLECTIC | KR_METHOD_REVERSIBLE | KR_METHOD_ALGEBRAIC |
             KR_METHOD_SPLITTING | KR_METHOD_ROTORS,
    .work = sizeof(takahashi_state) / sizeof(double),
    .reset = takahashi_reset,
    .step = takahashi_step,
    .read = takahashi_read,
    .is_valid = takahashi_is_valid,
};
