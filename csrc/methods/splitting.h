/* Kicks and drifts: the flows of the potential energy and of the kinetic energy. With the momentum
 * m, the principal axes N, B, T in space and the moments of inertia about them, the energy is
 *     H = potential + |m|^2/2I_B + (1/I_N - 1/I_B) <m,N>^2/2 + (1/I_T - 1/I_B) <m,T>^2/2.
 * A kick changes only m. On a support at rest, a drift changes only the attitude (McLachlan 1993,
 * Reich 1994). The flow of |m|^2/2I_B is a rotation about m, and commutes with the flows of the
 * other two kinetic terms, which are rotations about N and T. The drift of a symmetric body (I_N =
 * I_B) is therefore exact, and consists of two rotations. The drift of another body consists of
 * four rotations: about m, about N, about T, and about N again. Its local error is of third order
 * in the step size, and is smallest if B is the axis with the intermediate moment. A rotor with
 * momentum h changes the rate of rotation about each axis i by -h_i / I_i, and adds two rotations
 * about B to the drift. The drift of a symmetric body remains exact if h is along T. A support with
 * the angular velocity S adds -<S,m> to H. The flow of this term rotates attitude and momentum
 * against the support, commutes with the kinetic energy, and is a part of the drift. Sums are
 * compensated: the rounding error of each sum is stored and added to the next sum (Kahan 1965).
 * Rounding errors then affect the energy only through the small changes of q and m per step. */
#ifndef KR_SPLITTING_H
#define KR_SPLITTING_H
#include <float.h>
#include "math/isa.h"
#include "method.h"

/* Inlining makes compositions faster, but the program longer. If the compiler optimizes for size,
 * it decides itself whether to inline these functions. */
#ifdef __OPTIMIZE_SIZE__
#  define SPLITTING_INLINE static inline
#else
#  define SPLITTING_INLINE INLINE
#endif

/* The integrals that every splitting conserves, and the flags of methods whose kicks are exact. */
#define SPLITTING_CONSERVES "<m,e3>; on Lagrange tops <m,apex>"
#define SPLITTING_FLAGS                                                                            \
    (KR_METHOD_SYMPLECTIC | KR_METHOD_REVERSIBLE | KR_METHOD_ALGEBRAIC | KR_METHOD_SPLITTING |     \
     KR_METHOD_ROTORS | KR_METHOD_TURNING | KR_METHOD_GRADIENT)

typedef struct splitting {
    kr_quat q, low_q; /* the attitude, and the rounding errors of the sums in q */
    kr_vec3 m, low_m;
    double round;    /* step / I_B */
    double n, t;     /* step (1/I_N - 1/I_B) / 2, step (1/I_T - 1/I_B) / 2 */
    double s, steps; /* Lagrange tops: half the rotation about T in a step; steps made */
    kr_vec3 rotor;   /* half of the rotation about each axis in a step due to the rotor */
    kr_vec3 turning; /* half of the rotation in a step against that of the support */
    double extra;    /* nonzero if a rotor or the support adds rotations to the drift */
} splitting;

static inline void splitting_begin(splitting *s, const kr_motion *motion, const kr_state *start)
{
    const kr_vec3 I = motion->inertia;
    *s = (splitting){.q = start->q,
                     .m = start->m,
                     .round = motion->step / I.y,
                     .t = 0.5 * motion->step * ((I.y - I.z) / (I.z * I.y)),
                     .rotor = v_scale(-0.5 * motion->step, v_over(motion->rotor, I)),
                     .turning = v_scale(-0.5 * motion->step, motion_support_velocity(motion))};
    if (fabs(I.y - I.x) > 4.0 * DBL_EPSILON * I.y)
        s->n = 0.5 * motion->step * ((I.y - I.x) / (I.x * I.y));
    else if (motion->lever.x == 0.0 && motion->lever.y == 0.0 && s->rotor.x == 0.0 &&
             s->rotor.y == 0.0) {
        /* The rotation of a Lagrange top about its symmetry axis T is the same in every step and
         * commutes with all other rotations. It is therefore applied only when a state is read. */
        s->s = s->t * v_dot(start->m, q_turn_e3(start->q)) + s->rotor.z;
        s->t = 0.0;
        s->rotor.z = 0.0;
    }
    s->extra = v_largest(s->rotor) + v_largest(s->turning);
}

/* Returns sum + change + low, and writes the rounding error of this sum to `low`. */
static inline double splitting_add_compensated(double sum, double change, double *low)
{
    const double all = change + *low, next = sum + all;
    *low = all - (next - sum);
    return next;
}
/* Adds `change` to the horizontal components of m. Gravity does not change the vertical component
 * of the angular momentum m. */
static inline void splitting_add_impulse(splitting *s, kr_vec3 change)
{
    s->m.x = splitting_add_compensated(s->m.x, change.x, &s->low_m.x);
    s->m.y = splitting_add_compensated(s->m.y, change.y, &s->low_m.y);
}
/* Adds the torque, multiplied by the fraction `part` of the step size, to the momentum. */
static inline void splitting_kick(splitting *s, const kr_motion *motion, double part)
{
    splitting_add_impulse(s, v_scale(part * motion->step, motion_torque(motion, s->q)));
}

/* A rotation of the body by the quaternion p = 1 + r since the beginning of the drift, from the
 * attitude q to q p, and the momentum m along the axes of the body after this rotation. */
typedef struct splitting_body {
    kr_vec3 m;
    kr_quat r;
} splitting_body;

static inline splitting_body splitting_rotate_to_body(const splitting *s)
{
    return (splitting_body){.m = q_turn_back(s->q, s->m)};
}
/* Rotates the body by the angle 2 * half_angle about axis i, where (i, j, k) is a cyclic
 * permutation of the axes. Updates the components mj and mk of the momentum in the body, and the
 * components w, ri, rj and rk of r (splitting_body). */
static inline void splitting_rotate_about_axis(double half_angle, double *mj, double *mk, double *w,
                                               double *ri, double *rj, double *rk)
{
    const double y = *mj, z = *mk, a = *w, b = *ri, p = *rj, q = *rk;
    double c, s;
    cosm1_sinc(half_angle * half_angle, &c, &s);
    s *= half_angle;
    const double turn = 2.0 * (s + s * c), back = 2.0 * s * s;
    *mj = y + (turn * z - back * y);
    *mk = z - (turn * y + back * z);
    *w = a + (c + (c * a - s * b));
    *ri = b + (s + (c * b + s * a));
    *rj = p + (c * p + s * q);
    *rk = q + (c * q - s * p);
}
static inline void splitting_rotate_about_n(splitting_body *b, double half_angle_per_momentum)
{
    splitting_rotate_about_axis(half_angle_per_momentum * b->m.x, &b->m.y, &b->m.z, &b->r.w,
                                &b->r.x, &b->r.y, &b->r.z);
}
static inline void splitting_rotate_about_t(splitting_body *b, double half_angle_per_momentum)
{
    splitting_rotate_about_axis(half_angle_per_momentum * b->m.z, &b->m.x, &b->m.y, &b->r.w,
                                &b->r.z, &b->r.x, &b->r.y);
}
/* Rotates the attitude q about the momentum m by the angle part * step * |m| / I_B, and normalizes
 * q. Unless `b` is NULL, the rotation 1 + b->r of the body is applied as well. The factor that
 * corrects |q| is computed from the old q, independently of the angles of rotation. */
SPLITTING_INLINE void splitting_rotate_about_m(splitting *s, const splitting_body *b, double part)
{
    const kr_vec3 turn = v_scale(part * s->round, s->m);
    double c, sinc;
    cosm1_sinc(0.25 * v_dot(turn, turn), &c, &sinc);
    kr_quat change = q_mul(q4(c, v_scale(0.5 * sinc, turn)), s->q);
    if (b) change = q_add(change, q_mul(q_add(s->q, change), b->r));
    change = q_add(change, q_scale(0.5 - 0.5 * q_dot(s->q, s->q), q_add(s->q, change)));
    s->q.w = splitting_add_compensated(s->q.w, change.w, &s->low_q.w);
    s->q.x = splitting_add_compensated(s->q.x, change.x, &s->low_q.x);
    s->q.y = splitting_add_compensated(s->q.y, change.y, &s->low_q.y);
    s->q.z = splitting_add_compensated(s->q.z, change.z, &s->low_q.z);
}
/* Rotates the attitude and the momentum against the support for `part` times the step size. */
static inline void splitting_turn_against_support(splitting *s, double part)
{
    const kr_vec3 half = v_scale(part, s->turning);
    if (v_largest(half) == 0.0) return;
    double c, sinc;
    cosm1_sinc(v_dot(half, half), &c, &sinc);
    const kr_vec3 axis = v_scale(sinc, half), across = v_scale(2.0, v_cross(axis, s->m)),
                  push = v_add(v_axpy(1.0 + c, across, v_cross(axis, across)), s->low_m);
    const kr_quat turn = q_add(q_mul(q4(c, axis), s->q), s->low_q), q = q_add(s->q, turn);
    const kr_vec3 m = v_add(s->m, push);
    s->low_q = q_add(turn, q_add(s->q, q_scale(-1.0, q)));
    s->low_m = v_sub(push, v_sub(m, s->m));
    s->q = q;
    s->m = m;
}
/* Returns 1 if the drift is the exact free motion of the body and its rotor. */
static inline int splitting_is_drift_exact(const splitting *s)
{
    return s->n == 0.0 && s->rotor.x == 0.0 && s->rotor.y == 0.0;
}
/* Rotates a body with a rotor about N, B, T, B and N in turn, for `part` times the step size. */
static void splitting_rotate_gyrostat(splitting_body *b, const splitting *s, double part)
{
    static const int axes[] = {0, 1, 2, 1, 0};
    const double slopes[] = {s->n, 0.0, s->t}, rotor[] = {s->rotor.x, s->rotor.y, s->rotor.z};
    double *const m[] = {&b->m.x, &b->m.y, &b->m.z}, *const r[] = {&b->r.x, &b->r.y, &b->r.z};
    for (int turn = 0; turn < 5; turn++) {
        const int i = axes[turn], j = (i + 1) % 3, k = (i + 2) % 3;
        const double share = i == 2 ? part : 0.5 * part;
        splitting_rotate_about_axis(share * (slopes[i] * *m[i] + rotor[i]), m[j], m[k], &b->r.w,
                                    r[i], r[j], r[k]);
    }
}
/* Applies the drift of a body without a rotor, on a support at rest, for `part` of a step. This
 * function is inlined in loops that keep *s in registers. */
SPLITTING_INLINE void splitting_drift_plain(splitting *s, double part)
{
    splitting_body b;
    if (s->t == 0.0 && s->n == 0.0) {
        splitting_rotate_about_m(s, NULL, part);
        return;
    }
    b = splitting_rotate_to_body(s);
    if (s->n != 0.0) splitting_rotate_about_n(&b, 0.5 * part * s->n);
    splitting_rotate_about_t(&b, part * s->t);
    if (s->n != 0.0) splitting_rotate_about_n(&b, 0.5 * part * s->n);
    splitting_rotate_about_m(s, &b, part);
}
/* Applies the drift of a body with a rotor or on a turning support for `part` of a step. */
APART void drift_with_rotor_or_support(splitting *s, double part)
{
    splitting_body b = splitting_rotate_to_body(s);
    splitting_rotate_gyrostat(&b, s, part);
    splitting_rotate_about_m(s, &b, part);
    splitting_turn_against_support(s, part);
}
static inline void splitting_drift(splitting *s, double part)
{
    if (s->extra != 0.0)
        drift_with_rotor_or_support(s, part);
    else
        splitting_drift_plain(s, part);
}
/* Writes the state to `out`. Undoes the part of the next kick that m already includes (a fraction
 * `kick_part` of the kick), and applies the accumulated rotation about the principal axis T. */
static inline void splitting_read(const splitting *s, const kr_motion *motion, double kick_part,
                                  kr_state *out)
{
    double sine, cosine;
    sin_cos(s->steps * s->s, &sine, &cosine);
    out->m = v_axpy(-kick_part * motion->step, motion_torque(motion, s->q), s->m);
    out->q = q_mul_z(s->q, cosine, sine);
}
#endif
