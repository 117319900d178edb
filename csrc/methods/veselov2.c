/* Half kick, discrete Moser-Veselov drift (veselov.h), half kick. The two half kicks that meet
 * between steps are one. The method keeps <m,p>, on Lagrange tops <m,a>, and the energy: exactly
 * that of a free body, else up to a bounded O(h^2). */
#include "veselov.h"

typedef struct {
    kr_quat q;
    kr_vec3 m; /* half a kick ahead */
    kr_vec3 r; /* the last step's solution, which is the next one's guess */
} path;

/* Returns the momentum after this part of a kick. */
static kr_vec3 kicked(const path *p, const kr_motion *motion, double part)
{
    return v_axpy(part * motion->step, motion_torque(motion, p->q), p->m);
}
static kr_status reset(kr_motion *motion, const kr_state *start)
{
    path *p = (path *)motion->work;
    p->q = start->q;
    p->m = start->m;
    p->r = v3(0.0, 0.0, 0.0);
    p->m = kicked(p, motion, 0.5);
    return KR_OK;
}
static kr_status step(kr_motion *motion, double until)
{
    path *p = (path *)motion->work;
    (void)until;
    const kr_status status = veselov_drift(motion, motion->inertia, p->m, &p->q, &p->r);
    p->m = kicked(p, motion, 1.0);
    motion->stats.evaluations++;
    return status;
}
static void read(const kr_motion *motion, kr_state *s)
{
    const path *p = (const path *)motion->work;
    s->q = p->q;
    s->m = kicked(p, motion, -0.5);
}

const kr_method kr_method_veselov2 = {
    .name = "veselov2",
    .text = "kick, discrete Moser-Veselov drift, kick",
    .conserves = "<m,p>; to its tolerance a step, on Lagrange tops <m,a>, on free tops the energy",
    .reference = "Moser and Veselov 1991",
    .order = 2,
    .flags = KR_SYMPLECTIC | KR_REVERSIBLE | KR_IMPLICIT | KR_ALGEBRAIC,
    .work = sizeof(path) / sizeof(double),
    .reset = reset,
    .step = step,
    .read = read,
};
