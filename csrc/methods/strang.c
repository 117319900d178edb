/* Kick, free drift, kick: the splitting of second order of H = potential + |m|^2/2I_B + residual, with
 *     residual = (1/I_N - 1/I_B) <m,N>^2/2 + (1/I_T - 1/I_B) <m,T>^2/2
 * (McLachlan 1993, Reich 1994). A kick changes m only, a drift q only. The |m|^2 part is a turn about m itself and commutes
 * with the others, so a symmetric body (I_N = I_B) drifts without error, in two turns; a general one takes four.
 * Keeps <m,p>, for symmetric bodies <m,T> if the torque leaves it, and the energy up to a bounded O(h^2). */
#include <float.h>
#include "../method.h"

typedef struct {
    kr_quat q;
    kr_vec3 m;                      /* half a kick ahead */
    double round, n, t;             /* step / I_B, step (1/I_N - 1/I_B) / 2, step (1/I_T - 1/I_B) */
} strang;

static kr_vec3 kicked(const strang *s, const kr_run *run, double h) { return v_axpy(h, run_torque(run, s->q), s->m); }

static void turn_n(strang *s)       /* half of it before the turn about T, half after */
{
    const double half = 0.5 * s->n * v_dot(s->m, q_first_axis(s->q));
    double c, sinc;
    cos_sinc(half * half, &c, &sinc);
    s->q = q_mul_x(s->q, c, half * sinc);
}
static void turn_t(strang *s)
{
    const double half = 0.5 * s->t * v_dot(s->m, q_axis(s->q));
    double c, sinc;
    cos_sinc(half * half, &c, &sinc);
    s->q = q_mul_z(s->q, c, half * sinc);
}

static kr_status reset(kr_run *run, const kr_state *start)
{
    const kr_vec3 I = run->inertia;
    strang *s = (strang *)run->work;
    s->q = start->q;
    s->m = start->m;
    s->round = run->step / I.y;
    s->n = fabs(I.y - I.x) > 4.0 * DBL_EPSILON * I.y ? 0.5 * run->step * ((I.y - I.x) / (I.x * I.y)) : 0.0;
    s->t = run->step * ((I.y - I.z) / (I.z * I.y));
    s->m = kicked(s, run, 0.5 * run->step);
    return KR_OK;
}
static kr_status step(kr_run *run, double until)
{
    strang *s = (strang *)run->work;
    (void)until;
    if (s->n != 0.0) turn_n(s);
    turn_t(s);
    if (s->n != 0.0) turn_n(s);
    s->q = q_renew(q_mul(q_exp(v_scale(s->round, s->m)), s->q));
    s->m = kicked(s, run, run->step);
    run->stats.evaluations++;
    return KR_OK;
}
static void read(const kr_run *run, kr_state *out)
{
    const strang *s = (const strang *)run->work;
    out->q = s->q;
    out->m = kicked(s, run, -0.5 * run->step);
}

const kr_method kr_method_strang = {
    .name = "strang",
    .text = "kick, free drift, kick; the drift is exact for symmetric bodies",
    .conserves = "<m,p>; on Lagrange tops <m,a>",
    .reference = "McLachlan 1993; Reich 1994",
    .order = 2,
    .flags = KR_SYMPLECTIC | KR_REVERSIBLE | KR_ALGEBRAIC,
    .work = sizeof(strang) / sizeof(double), .reset = reset, .step = step, .read = read,
};
