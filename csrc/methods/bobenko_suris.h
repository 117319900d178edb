/* Code shared by the Bobenko-Suris maps of the Lagrange top. Let h be the step size, q the
 * attitude, m the momentum in space, a = q e3 q* the symmetry axis in space, com_T the coordinate
 * of the centre of mass along this axis, I3 the moment about it, and I1 the moment normal to it:
 *     drift  q <- Cay(h m / I1) q R,    Cay(v) = (1, v/2) / sqrt(1 + |v|^2/4)
 *     kick   m <- m + k e3 x a,         k = h * mass * gravity * com_T
 *     twist  R = (cos s, 0, 0, sin s),  2 s = h c / I3 - 2 atan(h c / (2 I1)),   c = <m,a>
 * R rotates the body about its symmetry axis by the same angle 2 s in every step, so that the total
 * rotation about this axis is exact. R commutes with drifts and kicks. Therefore, the twists of all
 * n steps are applied together, as R^n, when the state is read. (Theorem 4.2 of Bodack 2008
 * contains 2 atan(h c / (2 I3)) instead of h c / I3.) */
#ifndef KR_BOBENKO_SURIS_H
#define KR_BOBENKO_SURIS_H
#include "method.h"

typedef struct bobenko_suris_orbit {
    kr_quat q; /* the attitude without R^n */
    kr_vec3 m;
    double kick_strength, drift_factor;                /* step * lever, step / I1 */
    double half_twist, cos_half_twist, sin_half_twist; /* s, cos(s), sin(s) */
    double steps, cosine, sine; /* the number n of steps; cos(n s) and sin(n s) */
} bobenko_suris_orbit;
/* Each step updates `cosine` and `sine` (bobenko_suris_orbit) by the addition theorems. To limit
 * rounding errors, sin_cos computes both again every BOBENKO_SURIS_REFRESH steps. */
enum {
    BOBENKO_SURIS_WORK = sizeof(bobenko_suris_orbit) / sizeof(double),
    BOBENKO_SURIS_REFRESH = 64
};

static inline kr_vec3 bobenko_suris_momentum_after_kick(const bobenko_suris_orbit *o,
                                                        double strength)
{
    const kr_vec3 a = q_turn_e3(o->q);
    return v3(o->m.x - strength * a.y, o->m.y + strength * a.x, o->m.z);
}
static inline void bobenko_suris_drift(bobenko_suris_orbit *o)
{
    const kr_vec3 v = v_scale(0.5 * o->drift_factor, o->m);
    const double c = o->cosine, s = o->sine;
    /* The factor 1.5 - |q|^2/2 corrects rounding errors of the norm of q. */
    o->q =
        q_scale((1.5 - 0.5 * q_dot(o->q, o->q)) / sqrt(1.0 + v_dot(v, v)), q_mul(q4(1.0, v), o->q));
    o->steps += 1.0;
    o->cosine = c * o->cos_half_twist - s * o->sin_half_twist;
    o->sine = s * o->cos_half_twist + c * o->sin_half_twist;
    if ((int64_t)o->steps % BOBENKO_SURIS_REFRESH == 0)
        sin_cos(o->steps * o->half_twist, &o->sine, &o->cosine);
}
/* Sets the initial state `start`, the size `step` of each step, and s = half_twist. */
static inline void bobenko_suris_begin(bobenko_suris_orbit *o, const kr_motion *motion,
                                       const kr_state *start, double step, double half_twist)
{
    *o = (bobenko_suris_orbit){.q = start->q,
                               .m = start->m,
                               .kick_strength = step * motion->lever.z,
                               .drift_factor = step / motion->inertia.x,
                               .half_twist = half_twist,
                               .cosine = 1.0};
    sin_cos(half_twist, &o->sin_half_twist, &o->cos_half_twist);
}
/* Returns s, half the twist angle, for the maps bobenko_suris and bobenko_suris2. */
static inline double bobenko_suris_half_twist(const kr_motion *motion, const kr_state *start)
{
    const double half = 0.5 * motion->step * v_dot(start->m, q_turn_e3(start->q));
    return half / motion->inertia.z - arc_tangent(half / motion->inertia.x);
}
static inline int bobenko_suris_is_valid(const void *work)
{
    bobenko_suris_orbit o;
    memcpy(&o, work, sizeof o);
    return fabs(o.steps) < 0x1p53;
}
static inline void bobenko_suris_read_orbit(const bobenko_suris_orbit *o, kr_state *s)
{
    s->q = q_mul_z(o->q, o->cosine, o->sine);
    s->m = o->m;
}
#endif
