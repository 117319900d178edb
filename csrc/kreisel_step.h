/* kreisel_step.h: a step of the rotation of a rigid body, for engines that store an attitude and a
 * momentum or velocity. One header in C99 and C++, without allocation, state or other files.
 *
 *     kr_stepf(moments, q, m, impulse, h, 2);       // m: angular momentum in space
 *     kr_step_velocityf(moments, q, m, w);          // w: angular velocity in space
 *
 * Equations:  dm/dt = torque,   dq/dt = w q / 2,   w = q J^-1 (q* m q) q*
 * with the principal moments J and a unit quaternion q, scalar part first, that rotates vectors
 * from the principal axes into space. The impulse is the torque times the time step h. A step adds
 * half of the impulse to m, turns the body, and adds the other half. With M = q* m q, the middle
 * moment B, the other moments N and T, and the components M_N and M_T along their axes, the energy
 *     |m|^2/(2 B) + (1/N - 1/B) M_N^2/2 + (1/T - 1/B) M_T^2/2
 * is split into terms. Their flows are rotations about m and about the principal axes of N and T
 * (McLachlan 1993, Reich 1994). The step is explicit, reversible and symplectic. Without impulse,
 * it is exact for symmetric bodies, m keeps its bits, and the error of the energy is bounded. With
 * `order` 4 (Suzuki's coefficients, 1990), the rotation is of order 4, but the effect of the torque
 * of order 2. Steps that turn the body by less than 0.75 rad use only + - * /, with the same bits
 * on machines that do not fuse sums and products.
 *
 * Each function exists for doubles and, with the suffix f, for floats. Moments must be positive, in
 * any sequence. |q| may be 0.9 .. 1.1, and is corrected. impulse is in space, or NULL.
 * Define KR_STEP_API as empty to give the functions external names. SPDX-License-Identifier: MIT */
#ifndef KREISEL_STEP_H
#  define KREISEL_STEP_H
#  include <math.h>
#  ifndef KR_STEP_API
#    define KR_STEP_API static inline
#  endif
/* The header includes itself, once for each type of numbers. */
#  define KR_REAL double
#  define KR_F(name) name
#  include "kreisel_step.h"
#  define KR_REAL float
#  define KR_F(name) name##f
#  include "kreisel_step.h"
#elif defined KR_REAL
#  define KR_C(x) ((KR_REAL)(x))

/* Writes cos(x) - 1 to *c and sin(x)/x to *s, for z = x^2. */
static inline void KR_F(kr_step_cosm1_sinc)(KR_REAL z, KR_REAL *c, KR_REAL *s)
{
    const KR_REAL z2 = z * z, z4 = z2 * z2, x = z > KR_C(0.61) ? KR_F(sqrt)(z) : KR_C(0);
    *c = (z2 * (KR_C(1.0 / 24) - z * KR_C(1.0 / 720)) - z * KR_C(0.5)) +
         z4 * (((KR_C(1.0 / 40320) - z * KR_C(1.0 / 3628800)) +
                z2 * (KR_C(1.0 / 479001600) - z * KR_C(1.0 / 87178291200.0))) +
               z4 * KR_C(1.0 / 20922789888000.0));
    *s = ((KR_C(1) - z * KR_C(1.0 / 6)) + z2 * (KR_C(1.0 / 120) - z * KR_C(1.0 / 5040))) +
         z4 * (((KR_C(1.0 / 362880) - z * KR_C(1.0 / 39916800)) +
                z2 * (KR_C(1.0 / 6227020800.0) - z * KR_C(1.0 / 1307674368000.0))) +
               z4 * KR_C(1.0 / 355687428096000.0));
    if (x > KR_C(0)) *c = KR_F(cos)(x) - KR_C(1);
    if (x > KR_C(0)) *s = KR_F(sin)(x) / x;
}
/* Writes the rotated vector q v q* to `out`, or q* v q if `sign` is -1. out may be v. */
static inline void KR_F(kr_step_rotate)(const KR_REAL q[4], KR_REAL sign, const KR_REAL v[3],
                                        KR_REAL out[3])
{
    const KR_REAL x = sign * q[1], y = sign * q[2], z = sign * q[3];
    const KR_REAL a = KR_C(2) * (y * v[2] - z * v[1]), b = KR_C(2) * (z * v[0] - x * v[2]),
                  c = KR_C(2) * (x * v[1] - y * v[0]);
    out[0] = v[0] + (q[0] * a + (y * c - z * b));
    out[1] = v[1] + (q[0] * b + (z * a - x * c));
    out[2] = v[2] + (q[0] * c + (x * b - y * a));
}
/* Adds the product p q to `out`. */
static inline void KR_F(kr_step_add_product)(const KR_REAL p[4], const KR_REAL q[4], KR_REAL out[4])
{
    out[0] += p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3];
    out[1] += p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2];
    out[2] += p[0] * q[2] + p[2] * q[0] + p[3] * q[1] - p[1] * q[3];
    out[3] += p[0] * q[3] + p[3] * q[0] + p[1] * q[2] - p[2] * q[1];
}
/* Rotates the body about a principal axis by the angle 2 * rate * M[axis]; `rate` is a multiple of
 * the step h. Updates M and r; 1 + r is the product of all rotations, the last one on the right. */
static inline void KR_F(kr_step_turn_about_axis)(int axis, KR_REAL rate, KR_REAL M[3], KR_REAL r[4])
{
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    const KR_REAL half = rate * M[axis], y = M[j], z = M[k], a = r[0], b = r[1 + axis],
                  p = r[1 + j], q = r[1 + k];
    KR_REAL c, s;
    KR_F(kr_step_cosm1_sinc)(half * half, &c, &s);
    s *= half;
    const KR_REAL turn = KR_C(2) * (s + s * c), back = KR_C(2) * s * s;
    M[j] = y + (turn * z - back * y);
    M[k] = z - (turn * y + back * z);
    r[0] = a + (c + (c * a - s * b));
    r[1 + axis] = b + (s + (c * b + s * a));
    r[1 + j] = p + (c * p + s * q);
    r[1 + k] = q + (c * q - s * p);
}
/* Advances the attitude q and the angular momentum m in space by a step h of order 2 or 4. */
KR_STEP_API void KR_F(kr_step)(const KR_REAL moments[3], KR_REAL q[4], KR_REAL m[3],
                               const KR_REAL impulse[3], KR_REAL h, int order)
{
    /* Rotations about T for the fractions part[i] of h alternate with rotations about N. */
    const KR_REAL a = order < 4 ? KR_C(0) : KR_C(0.41449077179437573714);
    const KR_REAL part[] = {KR_C(0), a, a, KR_C(1) - KR_C(2) * a - KR_C(2) * a, a, a, KR_C(0)};
    const int first = order < 4 ? 2 : 0, last = order < 4 ? 3 : 5;
    int b = 1; /* index of the axis B; N precedes B cyclically, T follows; N = B if two are equal */
    for (int i = 3; i > 0; i--) {
        const KR_REAL N = moments[(i + 2) % 3], B = moments[i % 3], T = moments[(i + 1) % 3];
        if (N == B || (B != T && (N < B) == (B < T))) b = i % 3;
    }
    const int axis[3] = {(b + 2) % 3, b, (b + 1) % 3};
    KR_REAL p[4] = {q[0]}, v[3], M[3], r[4] = {0}, change[4] = {0}, e[4], sinc;
    for (int i = 0; i < 3; i++) {
        if (impulse) m[axis[i]] += KR_C(0.5) * impulse[axis[i]];
        p[1 + i] = q[1 + axis[i]];
        v[i] = m[axis[i]];
    }
    const KR_REAL N = moments[axis[0]], B = moments[axis[1]], T = moments[axis[2]];
    const KR_REAL n = KR_C(0.5) * h * ((B - N) / (N * B)), t = KR_C(0.5) * h * ((B - T) / (T * B));
    KR_F(kr_step_rotate)(p, KR_C(-1), v, M);
    for (int i = first; i <= last; i++) {
        if (i > first) KR_F(kr_step_turn_about_axis)(2, part[i] * t, M, r);
        if (B != N) KR_F(kr_step_turn_about_axis)(0, KR_C(0.5) * (part[i] + part[i + 1]) * n, M, r);
    }
    for (int i = 0; i < 3; i++) v[i] *= h / B;
    KR_F(kr_step_cosm1_sinc)(KR_C(0.25) * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]), &e[0], &sinc);
    for (int i = 0; i < 3; i++) e[1 + i] = KR_C(0.5) * sinc * v[i];
    KR_F(kr_step_add_product)(e, p, change);
    for (int i = 0; i < 4; i++) e[i] = p[i] + change[i];
    KR_F(kr_step_add_product)(e, r, change);
    const KR_REAL norm = p[0] * p[0] + (p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
    for (int i = 0; i < 4; i++) /* with a step of Newton's method for |q| = 1 */
        p[i] += change[i] + KR_C(0.5) * (KR_C(1) - norm) * (p[i] + change[i]);
    q[0] = p[0];
    for (int i = 0; i < 3; i++) {
        if (impulse) m[axis[i]] += KR_C(0.5) * impulse[axis[i]];
        q[1 + axis[i]] = p[1 + i];
    }
}
/* Writes the angular momentum in space of a body with the angular velocity w in space to m. */
KR_STEP_API void KR_F(kr_step_momentum)(const KR_REAL moments[3], const KR_REAL q[4],
                                        const KR_REAL w[3], KR_REAL m[3])
{
    KR_F(kr_step_rotate)(q, KR_C(-1), w, m);
    for (int i = 0; i < 3; i++) m[i] *= moments[i];
    KR_F(kr_step_rotate)(q, KR_C(1), m, m);
}
/* Writes the angular velocity in space of a body with the angular momentum m in space to w. */
KR_STEP_API void KR_F(kr_step_velocity)(const KR_REAL moments[3], const KR_REAL q[4],
                                        const KR_REAL m[3], KR_REAL w[3])
{
    KR_F(kr_step_rotate)(q, KR_C(-1), m, w);
    for (int i = 0; i < 3; i++) w[i] /= moments[i];
    KR_F(kr_step_rotate)(q, KR_C(1), w, w);
}
#  undef KR_REAL
#  undef KR_F
#  undef KR_C
#endif
