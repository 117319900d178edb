/* Kick and free drift, the parts of H = potential + |m|^2/2I_B + residual, for every method made of them. Floor 2.
 *     residual = (1/I_N - 1/I_B) <m,N>^2/2 + (1/I_T - 1/I_B) <m,T>^2/2
 * (McLachlan 1993, Reich 1994). A kick changes m only, a drift q only. The |m|^2 part is a turn about m itself and
 * commutes with the others, so a symmetric body (I_N = I_B) drifts without error, in two turns. A general one takes
 * four, N before and after T, and errs in third order; the middle moment, which is on B, makes that least. */
#ifndef KR_SPLITTING_H
#define KR_SPLITTING_H
#include <float.h>
#include "method.h"

typedef struct splitting {
    kr_quat q;
    kr_vec3 m;
    double round, n, t;             /* step / I_B, step (1/I_N - 1/I_B), step (1/I_T - 1/I_B) */
} splitting;

static inline void splitting_begin(splitting *s, const kr_run *run, const kr_state *start)
{
    const kr_vec3 I = run->inertia;
    s->q = start->q;
    s->m = start->m;
    s->round = run->step / I.y;
    s->n = fabs(I.y - I.x) > 4.0 * DBL_EPSILON * I.y ? run->step * ((I.y - I.x) / (I.x * I.y)) : 0.0;
    s->t = run->step * ((I.y - I.z) / (I.z * I.y));
}

/* The parts are given in parts of the step. */
static inline kr_vec3 splitting_kicked(const splitting *s, const kr_run *run, double part)
{
    return v_axpy(part * run->step, run_torque(run, s->q), s->m);
}
static void splitting_turn_n(splitting *s, double part)  /* not inline: symmetric bodies do without, and faster */
{
    const double half = 0.5 * part * s->n * v_dot(s->m, q_first_axis(s->q));
    double c, sinc;
    cos_sinc(half * half, &c, &sinc);
    s->q = q_mul_x(s->q, c, half * sinc);
}
static inline void splitting_turn_t(splitting *s, double part)
{
    const double half = 0.5 * part * s->t * v_dot(s->m, q_axis(s->q));
    double c, sinc;
    cos_sinc(half * half, &c, &sinc);
    s->q = q_mul_z(s->q, c, half * sinc);
}
static inline void splitting_turn_round(splitting *s, double part)
{
    s->q = q_renew(q_mul(q_exp(v_scale(part * s->round, s->m)), s->q));
}
static inline void splitting_drift(splitting *s, double part)
{
    if (s->n != 0.0) splitting_turn_n(s, 0.5 * part);
    splitting_turn_t(s, part);
    if (s->n != 0.0) splitting_turn_n(s, 0.5 * part);
    splitting_turn_round(s, part);
}
#endif
