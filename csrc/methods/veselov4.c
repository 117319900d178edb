/* A splitting method: half a modified kick (modified_kick.h), a discrete Moser-Veselov drift
 * (veselov.h) with modified moments of inertia, and half a modified kick. With the step size h, the
 * drift has order 4 if the following I~_N, I~_B, I~_T replace the principal moments I_N, I_B, I_T:
 *     1/I~_j = (1 + h^2 s) / I_j + h^2 d,
 *     s = S C / 6 - (1/I_N + 1/I_B + 1/I_T) H / 3,    d = S H / 6 - P C / 3,
 *     C = |M|^2/2,    H = <M, I^-1 M> / 2,    P = 1 / (I_N I_B I_T),    S = (I_N + I_B + I_T) P
 * with M = q* m q; P is not the vertical (Hairer and Vilmart, J. Phys. A 39, 2006). A drift, unlike
 * a kick, conserves |M| and the kinetic energy H. The method conserves the vertical momentum, the
 * axial momentum of Lagrange tops, and the energy of torque-free bodies. Steps in which the top may
 * rotate by more than 1.25 rad are refused, because the series for the modified moments of inertia
 * would be inaccurate. */
#include "modified_kick.h"
#include "veselov.h"

typedef struct {
    kr_quat q;
    kr_vec3 m; /* includes half of the next kick; the processor is not applied */
    kr_vec3 r; /* solution of the last step, the initial guess for the next one */
    modified_kick kick;
} veselov4_state;

static kr_vec3 find_modified_moments(const veselov4_state *p)
{
    const kr_vec3 M = q_turn_back(p->q, p->m), i = p->kick.inverse, one = v3(1.0, 1.0, 1.0);
    const double P = i.x * i.y * i.z, S = i.x * i.y + i.y * i.z + i.z * i.x,
                 h2 = p->kick.h * p->kick.h;
    const double C = 0.5 * v_dot(M, M), H = 0.5 * v_dot(M, v_times(i, M));
    const double s = S * C / 6.0 - v_dot(i, one) * H / 3.0, d = S * H / 6.0 - P * C / 3.0;
    const kr_vec3 inverse = v_axpy(1.0 + h2 * s, i, v_scale(h2 * d, one));
    return v3(1.0 / inverse.x, 1.0 / inverse.y, 1.0 / inverse.z);
}
static kr_status veselov4_reset(kr_motion *motion, const kr_state *start)
{
    veselov4_state *p = (veselov4_state *)motion->work;
    p->q = start->q;
    p->m = start->m;
    p->r = v3(0.0, 0.0, 0.0);
    p->kick = make_modified_kick(motion);
    if (!modified_kick_is_step_small(&p->kick, start, 1.25)) return KR_ERR_STEP_SIZE;
    const kr_status status = modified_kick_apply_processor(&p->kick, -1.0, &p->q, &p->m);
    p->m = v_add(p->m, modified_kick_impulse(&p->kick, p->q, 0.5));
    return status;
}
static kr_status veselov4_step(kr_motion *motion, double until)
{
    veselov4_state *p = (veselov4_state *)motion->work;
    (void)until;
    const kr_status status =
        veselov_solve_drift(motion, find_modified_moments(p), p->m, &p->q, &p->r);
    p->m = v_add(p->m, modified_kick_impulse(&p->kick, p->q, 1.0));
    motion->stats.evaluations++;
    return status;
}
static void veselov4_read(const kr_motion *motion, kr_state *s)
{
    const veselov4_state *p = (const veselov4_state *)motion->work;
    s->q = p->q;
    s->m = v_add(p->m, modified_kick_impulse(&p->kick, p->q, -0.5));
    modified_kick_apply_processor(&p->kick, 1.0, &s->q, &s->m);
}

const kr_method kr_method_veselov4 = {
    KR_METHOD_TEXTS(
        "veselov4", "modified kick, preprocessed discrete Moser-Veselov drift, modified kick",
        "<m,e3>; up to the tolerance of each step, on Lagrange tops <m,apex> and on free "
        "tops the energy",
        "Hairer and Vilmart 2006; Takahashi and Imada 1984"),
    .order = 4,
    .flags = KR_METHOD_REVERSIBLE | KR_METHOD_IMPLICIT | KR_METHOD_ALGEBRAIC,
    .work = sizeof(veselov4_state) / sizeof(double),
    .reset = veselov4_reset,
    .step = veselov4_step,
    .read = veselov4_read,
};
