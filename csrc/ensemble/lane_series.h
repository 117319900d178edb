/* Taylor series of the vertical P, the angular velocity W and the heading f (lane_state.h) for the
 * tops in all SIMD lanes, and their step sizes. p, w and f with an index are Taylor coefficients.
 * `flags` is 0, KR_LANES_HEADLESS, KR_LANES_DAMPED or their sum; `headless` is nonzero if f is not
 * computed. A sum of products of the coefficients j and n - j starts with j near n / 2, so that it
 * can begin before coefficient n is known. With fused multiply-add, the results in a lane are
 * bitwise equal for all vector widths. This file is compiled once for each instruction set. */
#ifndef KR_LANE_SERIES_H
#define KR_LANE_SERIES_H
#include "lane_state.h"
#include "math/wide_functions.h"

typedef struct {
    wide x, y, z;
} lane_vec;
INLINE lane_vec lane_vec_load(kr_lane_number *const v)
{
    return (lane_vec){wide_load(v[0]), wide_load(v[1]), wide_load(v[2])};
}
INLINE lane_vec lane_vec_load_register(kr_lane_number *const v)
{
    return (lane_vec){wide_load_to_register(v[0]), wide_load_to_register(v[1]),
                      wide_load_to_register(v[2])};
}
INLINE void lane_vec_store(kr_lane_number *to, lane_vec v)
{
    wide_store(to[0], v.x);
    wide_store(to[1], v.y);
    wide_store(to[2], v.z);
}
INLINE lane_vec lane_vec_splat(double a)
{
    return (lane_vec){wide_splat(a), wide_splat(a), wide_splat(a)};
}
INLINE lane_vec lane_vec_zxy(lane_vec v) { return (lane_vec){v.z, v.x, v.y}; }
INLINE lane_vec lane_vec_yzx(lane_vec v) { return (lane_vec){v.y, v.z, v.x}; }
INLINE lane_vec lane_vec_add(lane_vec a, lane_vec b)
{
    return (lane_vec){a.x + b.x, a.y + b.y, a.z + b.z};
}
INLINE lane_vec lane_vec_sub(lane_vec a, lane_vec b)
{
    return (lane_vec){a.x - b.x, a.y - b.y, a.z - b.z};
}
INLINE lane_vec lane_vec_scale(wide s, lane_vec a) { return (lane_vec){s * a.x, s * a.y, s * a.z}; }
INLINE lane_vec lane_vec_axpy(wide s, lane_vec a, lane_vec b)
{
    return (lane_vec){wide_fma(s, a.x, b.x), wide_fma(s, a.y, b.y), wide_fma(s, a.z, b.z)};
}
/* lane_vec_times and lane_vec_fma return the componentwise products a b and a b + c. */
INLINE lane_vec lane_vec_times(lane_vec a, lane_vec b)
{
    return (lane_vec){a.x * b.x, a.y * b.y, a.z * b.z};
}
INLINE lane_vec lane_vec_fma(lane_vec a, lane_vec b, lane_vec c)
{
    return (lane_vec){wide_fma(a.x, b.x, c.x), wide_fma(a.y, b.y, c.y), wide_fma(a.z, b.z, c.z)};
}
INLINE wide lane_vec_dot(lane_vec a, lane_vec b)
{
    return wide_fma(a.x, b.x, wide_fma(a.y, b.y, a.z * b.z));
}
INLINE lane_vec lane_vec_cross(lane_vec a, lane_vec b)
{
    return (lane_vec){wide_fma(a.y, b.z, -(a.z * b.y)), wide_fma(a.z, b.x, -(a.x * b.z)),
                      wide_fma(a.x, b.y, -(a.y * b.x))};
}
INLINE lane_vec lane_vec_choose(mask m, lane_vec yes, lane_vec no)
{
    return (lane_vec){wide_choose(m, yes.x, no.x), wide_choose(m, yes.y, no.y),
                      wide_choose(m, yes.z, no.z)};
}
/* A quaternion with the scalar part w and the vector part v. */
typedef struct {
    wide w;
    lane_vec v;
} lane_quat;
INLINE lane_quat lane_quat_load(kr_lane_number *const q)
{
    return (lane_quat){wide_load(q[0]), lane_vec_load(q + 1)};
}
INLINE void lane_quat_store(kr_lane_number *to, lane_quat q)
{
    wide_store(to[0], q.w);
    lane_vec_store(to + 1, q.v);
}
INLINE lane_quat lane_quat_conj(lane_quat q) { return (lane_quat){q.w, {-q.v.x, -q.v.y, -q.v.z}}; }
INLINE lane_quat lane_quat_mul(lane_quat a, lane_quat b)
{
    return (lane_quat){wide_fma(a.w, b.w, -lane_vec_dot(a.v, b.v)),
                       lane_vec_axpy(a.w, b.v, lane_vec_axpy(b.w, a.v, lane_vec_cross(a.v, b.v)))};
}
INLINE lane_quat lane_quat_unit(lane_quat q)
{
    const wide n = 1.0 / wide_sqrt(wide_fma(q.w, q.w, lane_vec_dot(q.v, q.v)));
    return (lane_quat){n * q.w, lane_vec_scale(n, q.v)};
}

/* Taylor coefficients of the angular velocity and of the vertical. */
typedef struct {
    lane_vec w, p;
} lane_pair;
/* The n-th coefficients of products of Taylor series (Cauchy products). */
typedef struct {
    lane_vec ww;          /* Wy Wz, Wz Wx, Wx Wy */
    lane_vec plus, minus; /* plus - minus is P x W */
    lane_vec wp;          /* Wx Px, Wy Py, and with damping Wz Pz */
    wide quotient;        /* (1 + <P, P0>) f', without the product of near[0] and rate[n] */
} lane_sums;

/* Adds the cross product pj x wm of coefficients of P and W to a->plus - a->minus. */
INLINE void add_cross_products(lane_sums *a, lane_vec wm, lane_vec pj)
{
    a->plus = lane_vec_fma(lane_vec_yzx(pj), lane_vec_zxy(wm), a->plus);
    a->minus = lane_vec_fma(lane_vec_zxy(pj), lane_vec_yzx(wm), a->minus);
}
/* Adds the products wjy wmz, wjz wmx and wjx wmy of two coefficients of W to a->ww. */
INLINE void add_velocity_products(lane_sums *a, lane_vec wj, lane_vec wm)
{
    a->ww = lane_vec_fma(lane_vec_yzx(wj), lane_vec_zxy(wm), a->ww);
}
/* Adds wmx pjx, wmy pjy and, with damping, wmz pjz to a->wp, for coefficients of W and P. */
INLINE void add_heading_products(lane_sums *a, lane_vec wm, lane_vec pj, int flags)
{
    a->wp.x = wide_fma(pj.x, wm.x, a->wp.x);
    a->wp.y = wide_fma(pj.y, wm.y, a->wp.y);
    if (flags & KR_LANES_DAMPED) a->wp.z = wide_fma(pj.z, wm.z, a->wp.z);
}
/* Returns `to` plus what the rotor and the Taylor coefficient w of W contribute to lane_sums.ww:
 * l->shift_next * (wz, wx, wy) + l->shift_prev * (wy, wz, wx), componentwise. */
INLINE lane_vec add_rotor_products(kr_lanes *l, lane_vec w, lane_vec to)
{
    const lane_vec of_prev = lane_vec_fma(lane_vec_load(l->shift_next), lane_vec_zxy(w), to);
    return lane_vec_fma(lane_vec_load(l->shift_prev), lane_vec_yzx(w), of_prev);
}
/* Adds to sums of even order n the products of coefficients n / 2; if n = 0, also rotor terms. */
INLINE void add_middle_term(lane_sums *a, kr_lanes *l, int n, int flags)
{
    const lane_vec w = lane_vec_load(l->w[n / 2]), p = lane_vec_load(l->p[n / 2]);
    if (n == 0) a->ww = add_rotor_products(l, w, a->ww);
    add_velocity_products(a, w, w);
    add_cross_products(a, w, p);
    if (flags & KR_LANES_HEADLESS) return;
    add_heading_products(a, w, p, flags);
    if (n > 0) a->quotient = wide_load(l->near[n / 2]) * wide_load(l->rate[n / 2]);
}
/* Adds to the sums `a` of order n > 0 the products of the coefficients of orders 0 and n, and the
 * contribution of the rotor. `newest` holds the coefficients n of W and P. */
INLINE void add_newest_products(lane_sums *a, kr_lanes *l, int n, const lane_pair *newest,
                                int flags)
{
    const lane_vec w0 = lane_vec_load(l->w[0]), p0 = lane_vec_load(l->p[0]), wn = newest->w,
                   pn = newest->p;
    const lane_vec next = lane_vec_load(l->next), prev = lane_vec_load(l->prev);
    a->ww = lane_vec_fma(lane_vec_yzx(wn), prev, lane_vec_fma(next, lane_vec_zxy(wn), a->ww));
    add_cross_products(a, wn, p0);
    add_cross_products(a, w0, pn);
    if (flags & KR_LANES_HEADLESS) return;
    /* W_0, with rotor terms in its first two components */
    const lane_vec shifted = {prev.y, next.x, w0.z};
    add_heading_products(a, wn, p0, flags);
    add_heading_products(a, flags & KR_LANES_DAMPED ? w0 : shifted, pn, flags);
    a->quotient = wide_fma(wide_load(l->near[n]), wide_load(l->rate[0]), a->quotient);
}
/* Returns all sums of order n. `newest` holds the coefficients n of W and P. */
INLINE lane_sums sum_products(kr_lanes *l, int n, const lane_pair *newest, int flags)
{
    const lane_vec none = lane_vec_splat(0.0);
    lane_sums a = {none, none, none, none, wide_splat(0.0)};
    if (n % 2 == 0) add_middle_term(&a, l, n, flags);
    for (int j = (n - 1) / 2; j > 0; j--) {
        const int m = n - j;
        const lane_vec wj = lane_vec_load_register(l->w[j]), wm = lane_vec_load_register(l->w[m]);
        const lane_vec pj = lane_vec_load_register(l->p[j]), pm = lane_vec_load_register(l->p[m]);
        /* The order of these independent sums was the fastest in measurements. */
        add_cross_products(&a, wm, pj);
        add_cross_products(&a, wj, pm);
        add_velocity_products(&a, wj, wm);
        add_velocity_products(&a, wm, wj);
        if (flags & KR_LANES_HEADLESS) continue;
        add_heading_products(&a, wm, pj, flags);
        add_heading_products(&a, wj, pm, flags);
        a.quotient = wide_fma(wide_load(l->near[m]), wide_load(l->rate[j]), a.quotient);
        a.quotient = wide_fma(wide_load(l->near[j]), wide_load(l->rate[m]), a.quotient);
    }
    if (n > 0) add_newest_products(&a, l, n, newest, flags);
    return a;
}

/* Writes coefficient n of f' to l->rate, and coefficient n + 1 of f to l->turn. `a` holds the sums
 * of order n, `newest` the coefficients n of W and P, and `share` is 1 / (n + 1). */
INLINE void next_heading_coefficients(kr_lanes *l, const lane_sums *a, int n,
                                      const lane_pair *newest, wide share, int flags)
{
    const lane_vec w = newest->w, p0 = lane_vec_load(l->p[0]), inner = lane_vec_load(l->inner);
    const wide rest = n == 0                    ? wide_splat(0.0)
                      : flags & KR_LANES_DAMPED ? a->wp.x + (a->wp.y + a->wp.z)
                                                : inner.z * newest->p.z;
    wide sum = wide_fma(w.x, p0.x, wide_fma(w.y, p0.y, wide_fma(w.z, p0.z, rest)));
    if (n == 0)
        sum = sum + sum;
    else if (!(flags & KR_LANES_DAMPED))
        sum = wide_fma(inner.x, a->wp.x, wide_fma(inner.y, a->wp.y, sum));
    const wide rate = (sum - a->quotient) * wide_load(l->inverse);
    wide_store(l->rate[n], rate);
    wide_store(l->turn[n + 1], share * rate);
}
/* Returns A^-1 (p x c) for a Taylor coefficient p of P. */
INLINE lane_vec gravity_rates(kr_lanes *l, lane_vec p)
{
    return lane_vec_fma(lane_vec_load(l->up), lane_vec_yzx(p),
                        lane_vec_times(lane_vec_load(l->down), lane_vec_zxy(p)));
}
/* Writes to `l` the coefficients n + 1 of W and P and, unless headless, those of f and 1 + <P, P0>,
 * and coefficient n of f'. `newest` holds coefficients n of W and P, the result those n + 1. */
INLINE lane_pair next_lane_coefficient(kr_lanes *l, int n, lane_pair newest, int flags)
{
    const lane_sums a = sum_products(l, n, &newest, flags);
    const wide share = wide_splat(1.0 / (n + 1));
    lane_vec linear = gravity_rates(l, newest.p);
    if (flags & KR_LANES_DAMPED) linear = lane_vec_fma(lane_vec_load(l->drag), newest.w, linear);
    /* The convolution sums are added last, because they become available last. */
    const lane_pair next = {lane_vec_fma(lane_vec_scale(share, lane_vec_load(l->k)), a.ww,
                                         lane_vec_scale(share, linear)),
                            lane_vec_scale(share, lane_vec_sub(a.plus, a.minus))};
    lane_vec_store(l->w[n + 1], next.w);
    lane_vec_store(l->p[n + 1], next.p);
    if (flags & KR_LANES_HEADLESS) return next;
    next_heading_coefficients(l, &a, n, &newest, share, flags);
    wide_store(l->near[n + 1], lane_vec_dot(next.p, lane_vec_load(l->p[0])));
    return next;
}

INLINE void expand_lane_series(kr_lanes *l, int flags)
{
    const lane_vec w = lane_vec_load(l->w[0]), p = lane_vec_load(l->p[0]);
    lane_pair newest = {w, p};
    lane_vec_store(l->prev, lane_vec_add(lane_vec_zxy(w), lane_vec_load(l->shift_prev)));
    lane_vec_store(l->next, lane_vec_add(lane_vec_yzx(w), lane_vec_load(l->shift_next)));
    if (!(flags & KR_LANES_HEADLESS)) {
        const wide near = 1.0 + lane_vec_dot(p, p);
        wide_store(l->near[0], near);
        wide_store(l->inverse, 1.0 / near);
        wide_store(l->turn[0], wide_splat(0.0));
    }
    for (int n = 0; n < l->order; n++) newest = next_lane_coefficient(l, n, newest, flags);
}

/* approx_log2_lanes returns log2 x for a normal number x > 0, with an error below 0.05.
 * approx_exp2_lanes returns 2^x, with a relative error below 0.002. */
INLINE wide approx_log2_lanes(wide x)
{
    const wide bits = wide_of_bits((wide_bits(x) >> 20) | 0x4330000000000000u) - 0x1p52;
    return wide_fma(bits, wide_splat(0x1p-32), wide_splat(-1022.957));
}
INLINE wide approx_exp2_lanes(wide x)
{
    const wide moved = x + 0x1.8p52, f = x - (moved - 0x1.8p52);
    const wide power = wide_of_bits((wide_bits(moved) + 1023) << 52);
    return power *
           wide_fma(f, wide_fma(f, wide_splat(0.2384), wide_splat(0.7035)), wide_splat(1.0004));
}
/* Returns log2 of the radius of convergence, estimated as -log2(|x_n|) / n from the n-th
 * coefficients x_n = (p_n, w_n, 16 f_n). The factor 16 shortens the steps: the omitted terms of f
 * may all have the same sign, so that their sum is much larger than the last term. */
INLINE wide lane_log2_radius(kr_lanes *l, int n, int headless)
{
    const lane_vec p = lane_vec_load(l->p[n]), w = lane_vec_load(l->w[n]);
    wide square = lane_vec_dot(p, p) + lane_vec_dot(w, w);
    if (!headless) {
        const wide turn = 16.0 * wide_load(l->turn[n]);
        square = wide_fma(turn, turn, square);
    }
    return approx_log2_lanes(square) * (-0.5 / n);
}
/* Returns the step size (> 0) at which the last Taylor term is about 2^l->log2_tol, but at most
 * l->order / 6 times l->fall. A deviation from an equilibrium grows by at most a factor e in the
 * time l->fall. Very close to an unstable equilibrium, only this limit matters. */
INLINE wide lane_step_size(kr_lanes *l, int headless)
{
    const int order = l->order;
    const wide radius = wide_min(lane_log2_radius(l, order - 1, headless),
                                 lane_log2_radius(l, order - 2, headless));
    const wide step = approx_exp2_lanes(wide_splat(l->log2_tol / order) + radius),
               longest = (order / 6.0) * wide_load(l->fall);
    return wide_min(step, longest);
}

/* The vertical P, the angular velocity W and the heading f (`turn`) at one time in each lane. */
typedef struct {
    lane_vec p, w;
    wide turn;
} lane_point;
/* Evaluates the Taylor polynomials of degree `order` at the time `at` (l->t: start of the step). */
INLINE lane_point evaluate_lane_series(kr_lanes *l, int order, wide at, int headless)
{
    const wide h = at - wide_load(l->t);
    int n = order;
    lane_point r = {lane_vec_load(l->p[n]), lane_vec_load(l->w[n]), wide_splat(0.0)};
    if (!headless) r.turn = wide_load(l->turn[n]);
    while (--n >= 0) {
        r.p = lane_vec_axpy(h, r.p, lane_vec_load(l->p[n]));
        r.w = lane_vec_axpy(h, r.w, lane_vec_load(l->w[n]));
        if (!headless) r.turn = wide_fma(h, r.turn, wide_load(l->turn[n]));
    }
    return r;
}

/* Returns an unnormalized quaternion of the smallest rotation that takes unit vector p to d. */
INLINE lane_quat unscaled_shortest_rotation(lane_vec p, lane_vec d)
{
    return (lane_quat){1.0 + lane_vec_dot(p, d), lane_vec_cross(p, d)};
}
/* Returns the attitude (lane's axes -> space) at the point (P, W, f) = *at. If `headless` is
 * nonzero, returns a rotation that takes P to e3, with an arbitrary heading. */
INLINE lane_quat lane_attitude(kr_lanes *l, const lane_point *at, int headless)
{
    if (headless) {
        const wide zero = wide_splat(0.0),
                   sign = wide_choose(wide_less(at->p.z, zero), wide_splat(-1.0), wide_splat(1.0));
        /* If Pz < 0, P is first rotated to -e3, and then to e3 by a half turn about e1. */
        const lane_vec d = {zero, zero, sign};
        const lane_quat s = lane_quat_unit(unscaled_shortest_rotation(at->p, d)),
                        over = {-s.v.x, {s.w, -s.v.z, s.v.y}};
        const mask up = wide_less(zero, sign);
        return (lane_quat){wide_choose(up, s.w, over.w), lane_vec_choose(up, s.v, over.v)};
    }
    const lane_quat here = lane_quat_mul(lane_quat_load(l->q),
                                         unscaled_shortest_rotation(at->p, lane_vec_load(l->p[0])));
    wide s, c;
    wide_sin_cos(0.5 * at->turn, &s, &c);
    const lane_vec v = here.v, across = {-(s * v.y), s * v.x, s * here.w};
    const lane_quat turned = {wide_fma(c, here.w, -(s * v.z)), lane_vec_axpy(c, v, across)};
    return lane_quat_unit(turned);
}
#endif
