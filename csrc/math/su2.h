/* Vectors and unit quaternions (SU(2)), passed by value. Names of vector functions begin with v_,
 * and names of quaternion functions with q_. A unit quaternion q with the conjugate q* rotates the
 * vector v to q v q*. If q is an attitude, v has components along axes fixed in the body, and q v
 * q* along the axes of space; the third of these, e3, is vertical. (Bodack 2008: q is Phi^-1.) */
#ifndef KR_SU2_H
#define KR_SU2_H
#include "kreisel.h"
#include "trig.h"

static inline kr_vec3 v3(double x, double y, double z)
{
    kr_vec3 v;
    v.x = x, v.y = y, v.z = z;
    return v;
}
/* Returns the unit vector along axis i, or zero if i is not 0, 1 or 2. */
static inline kr_vec3 v_axis(int i) { return v3(i == 0, i == 1, i == 2); }
/* v_of reads a vector from an array y of three doubles, and v_put writes a vector to y. */
static inline kr_vec3 v_of(const double *y) { return v3(y[0], y[1], y[2]); }
static inline void v_put(double *y, kr_vec3 v)
{
    y[0] = v.x;
    y[1] = v.y;
    y[2] = v.z;
}
static inline kr_vec3 v_add(kr_vec3 a, kr_vec3 b) { return v3(a.x + b.x, a.y + b.y, a.z + b.z); }
static inline kr_vec3 v_sub(kr_vec3 a, kr_vec3 b) { return v3(a.x - b.x, a.y - b.y, a.z - b.z); }
static inline kr_vec3 v_scale(double s, kr_vec3 a) { return v3(s * a.x, s * a.y, s * a.z); }
/* v_times and v_over multiply and divide a by b componentwise. */
static inline kr_vec3 v_times(kr_vec3 a, kr_vec3 b) { return v3(a.x * b.x, a.y * b.y, a.z * b.z); }
static inline kr_vec3 v_over(kr_vec3 a, kr_vec3 b) { return v3(a.x / b.x, a.y / b.y, a.z / b.z); }
static inline kr_vec3 v_axpy(double s, kr_vec3 a, kr_vec3 b)
{
    return v3(s * a.x + b.x, s * a.y + b.y, s * a.z + b.z);
}
static inline double v_dot(kr_vec3 a, kr_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline double v_length(kr_vec3 a) { return sqrt(v_dot(a, a)); }
static inline double v_largest(kr_vec3 a) { return fmax(fabs(a.x), fmax(fabs(a.y), fabs(a.z))); }
/* Returns a / |a|; a must not be zero. If all components are below 2^-1000 in magnitude, a is first
 * scaled up, because the reciprocal of its norm could overflow. */
static inline kr_vec3 v_unit(kr_vec3 a)
{
    const double size = v_largest(a), up = size < 0x1p-1000 ? 0x1p200 : 1.0;
    const kr_vec3 r = v_scale(1.0 / (up * size), v_scale(up, a));
    return v_scale(1.0 / v_length(r), r);
}
static inline int v_finite(kr_vec3 a) { return isfinite(a.x) && isfinite(a.y) && isfinite(a.z); }
static inline kr_vec3 v_cross(kr_vec3 a, kr_vec3 b)
{
    return v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
/* Returns the solution (x, y, z) of x c[0] + y c[1] + z c[2] = b, computed by Cramer's rule. */
static inline kr_vec3 v_solve(const kr_vec3 c[3], kr_vec3 b)
{
    const kr_vec3 yz = v_cross(c[1], c[2]), zx = v_cross(c[2], c[0]), xy = v_cross(c[0], c[1]);
    return v_scale(1.0 / v_dot(c[0], yz), v3(v_dot(b, yz), v_dot(b, zx), v_dot(b, xy)));
}

static inline kr_quat q4(double w, kr_vec3 v)
{
    kr_quat q;
    q.w = w, q.x = v.x, q.y = v.y, q.z = v.z;
    return q;
}
static inline kr_quat q_one(void) { return q4(1.0, v3(0.0, 0.0, 0.0)); }
static inline kr_vec3 q_vec(kr_quat q) { return v3(q.x, q.y, q.z); }
static inline kr_quat q_conj(kr_quat q) { return q4(q.w, v3(-q.x, -q.y, -q.z)); }
static inline kr_quat q_scale(double s, kr_quat q) { return q4(s * q.w, v_scale(s, q_vec(q))); }
static inline kr_quat q_add(kr_quat a, kr_quat b)
{
    return q4(a.w + b.w, v_add(q_vec(a), q_vec(b)));
}
static inline double q_dot(kr_quat a, kr_quat b) { return a.w * b.w + v_dot(q_vec(a), q_vec(b)); }
/* Returns q or -q, whichever is closer to `last`. Both describe the same attitude. If `last` is the
 * previous attitude, the choice avoids a change of sign between successive attitudes. */
static inline kr_quat q_near(kr_quat q, kr_quat last)
{
    return q_dot(q, last) < 0.0 ? q_scale(-1.0, q) : q;
}
static inline kr_quat q_unit(kr_quat q) { return q_scale(1.0 / sqrt(q_dot(q, q)), q); }
/* Returns q / |q|, if |q| differs from 1 only by rounding errors. A step of Newton's method gives q
 * + e q with e = (1 - |q|^2) / 2. In the product (1 + e) q, rounding errors would not average out:
 * the energy of a top would drift by a relative 1e-12 in 1e6 time steps. */
static inline kr_quat q_renormalize(kr_quat q)
{
    const double e = 0.5 - 0.5 * q_dot(q, q);
    return q4(q.w + e * q.w, v_axpy(e, q_vec(q), q_vec(q)));
}
static inline kr_quat q_mul(kr_quat a, kr_quat b)
{
    return q4(a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
              v3(a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                 a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
                 a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x));
}

/* Returns q v q*: if q is an attitude, v converted from the body frame to the space frame. */
static inline kr_vec3 q_turn(kr_quat q, kr_vec3 v)
{
    const kr_vec3 u = q_vec(q), s = v_scale(2.0, v_cross(u, v));
    return v_add(v, v_axpy(q.w, s, v_cross(u, s)));
}
static inline kr_vec3 q_turn_back(kr_quat q, kr_vec3 v) { return q_turn(q_conj(q), v); }
/* Returns q e3 q*: the third body axis in the space frame. */
static inline kr_vec3 q_turn_e3(kr_quat q)
{
    return v3(2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x),
              (q.w * q.w + q.z * q.z) - (q.x * q.x + q.y * q.y));
}
/* Returns q* e3 q: the vertical in the body frame. */
static inline kr_vec3 q_turn_e3_back(kr_quat q)
{
    return v3(2.0 * (q.x * q.z - q.w * q.y), 2.0 * (q.y * q.z + q.w * q.x),
              (q.w * q.w + q.z * q.z) - (q.x * q.x + q.y * q.y));
}

/* Returns the unit quaternion of the rotation about `rotation` by the angle |rotation|. */
static inline kr_quat q_exp(kr_vec3 rotation)
{
    double c, s;
    cos_sinc(0.25 * v_dot(rotation, rotation), &c, &s);
    return q4(c, v_scale(0.5 * s, rotation));
}
/* Returns q (c + s k), where k is the third imaginary unit. If c and s are the cosine and sine of
 * half an angle, the result is the rotation about e3 by this angle, followed by the rotation q. */
static inline kr_quat q_mul_z(kr_quat q, double c, double s)
{
    return q4(c * q.w - s * q.z, v3(c * q.x + s * q.y, c * q.y - s * q.x, c * q.z + s * q.w));
}

/* Returns a rotation that maps e3 to the unit vector a. If a.z >= -1/2, its angle is the smallest
 * possible. Otherwise, it is a half turn about e1, then the smallest rotation from -e3 to a. */
static inline kr_quat q_tilt(kr_vec3 a)
{
    if (a.z < -0.5) return q_mul(q_tilt(v3(-a.x, -a.y, -a.z)), q4(0.0, v3(1.0, 0.0, 0.0)));
    return q_unit(q4(1.0 + a.z, v3(-a.y, a.x, 0.0)));
}
/* Returns a unit quaternion q that rotates e1, e2, e3 to the right-handed orthonormal set n, b, t.
 * First computes 4 c q, and then normalizes it. Here, c is the component of q with the largest
 * magnitude, because a small c could cause cancellation (Shepperd 1978). */
static inline kr_quat q_of_frame(kr_vec3 n, kr_vec3 b, kr_vec3 t)
{
    const double w = 1.0 + n.x + b.y + t.z, x = 1.0 + n.x - b.y - t.z, y = 1.0 - n.x + b.y - t.z,
                 z = 1.0 - n.x - b.y + t.z;
    if (w >= x && w >= y && w >= z) return q_unit(q4(w, v3(b.z - t.y, t.x - n.z, n.y - b.x)));
    if (x >= y && x >= z) return q_unit(q4(b.z - t.y, v3(x, n.y + b.x, n.z + t.x)));
    if (y >= z) return q_unit(q4(t.x - n.z, v3(n.y + b.x, y, b.z + t.y)));
    return q_unit(q4(n.y - b.x, v3(n.z + t.x, b.z + t.y, z)));
}
#endif
