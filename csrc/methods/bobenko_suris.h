/* What the Bobenko-Suris maps of the Lagrange top share. With I1 = I_N = I_B, I3 = I_T, a
 * = q e3 q*:
 *     drift  q <- Cay(h m / I1) q Spin,    Cay(v) = (1, v/2) / sqrt(1 + |v|^2/4)
 *     kick   m <- m + k e3 x a
 * Spin is a turn about the body's own axis by the constant angle 2 s,
 *     2 s = h c / I3 - 2 atan(h c / 2 I1),   c = <m, a>,
 * so that the whole twist about the axis is exact. (Theorem 4.2 of the thesis has 2 atan(h c / 2
 * I3) for h c / I3.) It commutes with both, hence Spin^n is kept apart and applied only where the
 * state is read. */
#ifndef KR_LAGRANGE_H
#define KR_LAGRANGE_H
#include "method.h"

typedef struct lagrange_orbit {
    kr_quat q; /* attitude without the spin */
    kr_vec3 m;
    double kick, turn;       /* step * lever, step / I1 */
    double spin, cos1, sin1; /* half the angle of Spin */
    /* n times it: each from the one before, for that is cheap; anew every SEED steps */
    double n, cosine, sine;
} lagrange_orbit;
enum { LAGRANGE_WORK = sizeof(lagrange_orbit) / sizeof(double), LAGRANGE_SEED = 64 };

static inline kr_vec3 lagrange_kicked(const lagrange_orbit *o, double k)
{
    const kr_vec3 a = q_axis(o->q);
    return v3(o->m.x - k * a.y, o->m.y + k * a.x, o->m.z);
}
static inline void lagrange_drift(lagrange_orbit *o)
{
    const kr_vec3 v = v_scale(0.5 * o->turn, o->m);
    const double c = o->cosine, s = o->sine;
    /* and |q| = 1 again */
    o->q =
        q_scale((1.5 - 0.5 * q_dot(o->q, o->q)) / sqrt(1.0 + v_dot(v, v)), q_mul(q4(1.0, v), o->q));
    o->n += 1.0;
    o->cosine = c * o->cos1 - s * o->sin1;
    o->sine = s * o->cos1 + c * o->sin1;
    if ((int64_t)o->n % LAGRANGE_SEED == 0) sin_cos(o->n * o->spin, &o->sine, &o->cosine);
}
static inline void lagrange_set_spin(lagrange_orbit *o, double spin)
{
    o->spin = spin;
    sin_cos(o->spin, &o->sin1, &o->cos1);
    o->n = o->sine = 0.0;
    o->cosine = 1.0;
}
static inline void lagrange_begin(lagrange_orbit *o, const kr_motion *motion, const kr_state *s)
{
    const double h = motion->step, c = v_dot(s->m, q_axis(s->q));
    o->q = s->q;
    o->m = s->m;
    o->kick = h * motion->lever.z;
    o->turn = h / motion->inertia.x;
    lagrange_set_spin(o, 0.5 * h * c / motion->inertia.z -
                             arc_tangent(0.5 * h * c / motion->inertia.x));
}
static inline void lagrange_read(const lagrange_orbit *o, kr_state *s)
{
    s->q = q_mul_z(o->q, o->cosine, o->sine);
    s->m = o->m;
}
#endif
