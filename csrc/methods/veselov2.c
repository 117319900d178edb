/* A splitting method: half a kick, a discrete Moser-Veselov drift (veselov.h), and half a kick. The
 * second half kick of each step is merged with the first half kick of the next step. The method
 * conserves the vertical momentum, and for Lagrange tops also the axial momentum. The energy of a
 * torque-free body is also conserved. In general, the energy error is bounded and O(h^2). */
#include "veselov.h"

typedef struct {
    kr_quat q;
    kr_vec3 m; /* includes half of the next kick */
    kr_vec3 r; /* solution of the last step, the initial guess for the next one */
} veselov2_state;

/* Returns the momentum after a kick over the fraction `part` of a step. */
static kr_vec3 momentum_after_kick(const veselov2_state *p, const kr_motion *motion, double part)
{
    return v_axpy(part * motion->step, motion_torque(motion, p->q), p->m);
}
static kr_status veselov2_reset(kr_motion *motion, const kr_state *start)
{
    veselov2_state *p = (veselov2_state *)motion->work;
    p->q = start->q;
    p->m = start->m;
    p->r = v3(0.0, 0.0, 0.0);
    p->m = momentum_after_kick(p, motion, 0.5);
    return KR_OK;
}
static kr_status veselov2_step(kr_motion *motion, double until)
{
    veselov2_state *p = (veselov2_state *)motion->work;
    (void)until;
    const kr_status status = veselov_solve_drift(motion, motion->inertia, p->m, &p->q, &p->r);
    p->m = momentum_after_kick(p, motion, 1.0);
    motion->stats.evaluations++;
    return status;
}
static void veselov2_read(const kr_motion *motion, kr_state *s)
{
    const veselov2_state *p = (const veselov2_state *)motion->work;
    s->q = p->q;
    s->m = momentum_after_kick(p, motion, -0.5);
}

const kr_method kr_method_veselov2 = {
    KR_METHOD_TEXTS(
        "veselov2", "kick, discrete Moser-Veselov drift, kick",
        "<m,e3>; up to the tolerance of each step, on Lagrange tops <m,apex> and on free "
        "tops the energy",
        "Moser and Veselov 1991"),
    .order = 2,
    .flags = KR_METHOD_SYMPLECTIC | KR_METHOD_REVERSIBLE | KR_METHOD_IMPLICIT | KR_METHOD_ALGEBRAIC,
    .work = sizeof(veselov2_state) / sizeof(double),
    .reset = veselov2_reset,
    .step = veselov2_step,
    .read = veselov2_read,
};
