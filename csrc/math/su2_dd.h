/* Vectors and quaternions of double-doubles (dd.h), passed by value, for motions that the user
 * requests with 20 or 30 digits. A function vdd_f or qdd_f does the same as v_f or q_f of su2.h, if
 * that exists, but its arguments and results have components of type `dd`. */
#ifndef KR_SU2_DD_H
#define KR_SU2_DD_H
#include "dd.h"
#include "su2.h"

typedef struct vec_dd {
    dd x, y, z;
} vec_dd;
typedef struct quat_dd {
    dd w;
    vec_dd v;
} quat_dd;

static inline vec_dd v_dd(kr_vec3 hi, kr_vec3 lo)
{
    return (vec_dd){two_sum(hi.x, lo.x), two_sum(hi.y, lo.y), two_sum(hi.z, lo.z)};
}
/* Returns the vector whose high and low words are in two arrays of three doubles. */
static inline vec_dd vdd_load(const double high[3], const double low[3])
{
    return (vec_dd){two_sum(high[0], low[0]), two_sum(high[1], low[1]), two_sum(high[2], low[2])};
}
static inline vec_dd vdd_of(kr_vec3 a) { return (vec_dd){dd_of(a.x), dd_of(a.y), dd_of(a.z)}; }
static inline kr_vec3 vdd_high(vec_dd a) { return v3(a.x.hi, a.y.hi, a.z.hi); }
static inline kr_vec3 vdd_low(vec_dd a) { return v3(a.x.lo, a.y.lo, a.z.lo); }
static inline void vdd_put(dd y[3], vec_dd v)
{
    y[0] = v.x;
    y[1] = v.y;
    y[2] = v.z;
}
static inline vec_dd vdd_add(vec_dd a, vec_dd b)
{
    return (vec_dd){dd_add(a.x, b.x), dd_add(a.y, b.y), dd_add(a.z, b.z)};
}
static inline vec_dd vdd_sub(vec_dd a, vec_dd b)
{
    return (vec_dd){dd_sub(a.x, b.x), dd_sub(a.y, b.y), dd_sub(a.z, b.z)};
}
static inline vec_dd vdd_scale(dd s, vec_dd a)
{
    return (vec_dd){dd_mul(s, a.x), dd_mul(s, a.y), dd_mul(s, a.z)};
}
/* Returns power * a exactly, where `power` is a power of two. */
static inline vec_dd vdd_scale_exactly(double power, vec_dd a)
{
    return (vec_dd){dd_scale(power, a.x), dd_scale(power, a.y), dd_scale(power, a.z)};
}
static inline vec_dd vdd_times(vec_dd a, vec_dd b)
{
    return (vec_dd){dd_mul(a.x, b.x), dd_mul(a.y, b.y), dd_mul(a.z, b.z)};
}
static inline vec_dd vdd_over(vec_dd a, vec_dd b)
{
    return (vec_dd){dd_div(a.x, b.x), dd_div(a.y, b.y), dd_div(a.z, b.z)};
}
static inline dd vdd_dot(vec_dd a, vec_dd b)
{
    return dd_add(dd_add(dd_mul(a.x, b.x), dd_mul(a.y, b.y)), dd_mul(a.z, b.z));
}
static inline vec_dd vdd_cross(vec_dd a, vec_dd b)
{
    return (vec_dd){dd_sub(dd_mul(a.y, b.z), dd_mul(a.z, b.y)),
                    dd_sub(dd_mul(a.z, b.x), dd_mul(a.x, b.z)),
                    dd_sub(dd_mul(a.x, b.y), dd_mul(a.y, b.x))};
}

static inline quat_dd q_dd(kr_quat hi, kr_quat lo)
{
    return (quat_dd){two_sum(hi.w, lo.w), v_dd(q_vec(hi), q_vec(lo))};
}
/* Returns the quaternion whose high and low words are in two arrays of four doubles. */
static inline quat_dd qdd_load(const double high[4], const double low[4])
{
    return (quat_dd){two_sum(high[0], low[0]), vdd_load(high + 1, low + 1)};
}
static inline quat_dd qdd_of(kr_quat q) { return q_dd(q, q4(0.0, v3(0.0, 0.0, 0.0))); }
static inline kr_quat qdd_high(quat_dd q) { return q4(q.w.hi, vdd_high(q.v)); }
static inline kr_quat qdd_low(quat_dd q) { return q4(q.w.lo, vdd_low(q.v)); }
static inline quat_dd qdd_conj(quat_dd q)
{
    return (quat_dd){q.w, {dd_neg(q.v.x), dd_neg(q.v.y), dd_neg(q.v.z)}};
}
static inline quat_dd qdd_mul(quat_dd a, quat_dd b)
{
    return (quat_dd){
        dd_sub(dd_mul(a.w, b.w), vdd_dot(a.v, b.v)),
        vdd_add(vdd_add(vdd_scale(a.w, b.v), vdd_scale(b.w, a.v)), vdd_cross(a.v, b.v))};
}
static inline quat_dd qdd_add(quat_dd a, quat_dd b)
{
    return (quat_dd){dd_add(a.w, b.w), vdd_add(a.v, b.v)};
}
/* Returns |q|^2. */
static inline dd qdd_square(quat_dd q) { return dd_add(dd_mul(q.w, q.w), vdd_dot(q.v, q.v)); }
static inline quat_dd qdd_unit(quat_dd q)
{
    const dd s = dd_div(dd_of(1.0), dd_sqrt(qdd_square(q)));
    return (quat_dd){dd_mul(s, q.w), vdd_scale(s, q.v)};
}
/* Returns q v q*, for a unit quaternion q. */
static inline vec_dd qdd_turn(quat_dd q, vec_dd v)
{
    const quat_dd pure = {dd_of(0.0), v};
    return qdd_mul(qdd_mul(q, pure), qdd_conj(q)).v;
}
#endif
