/* Implements the Taylor series declared in taylor.h: computes the coefficients, chooses the step
 * size, and evaluates the series. This source file is compiled twice for each instruction set: in
 * double precision (quat_simd.h) and in double-double precision (quat_simd_dd.h). Three
 * optimizations make the recurrence fast. Every convolution sum starts with its middle terms, so
 * that it can begin before the latest coefficients are known. The two terms of a convolution sum
 * with indices (j, m) and (m, j) are added in parallel. The order is a compile-time constant, so
 * loops can be unrolled. */
#include <stdint.h>
#include <string.h>
#include "taylor.h"

/* Signs and factors of the terms of quaternion and cross products, for the SIMD lanes in the order
 * produced by duo_i, duo_j and duo_k. */
static const double sign_i[8] ALIGNED = {-.5, .5, .5, -.5, 0, 0, 1, -1};
static const double sign_j[8] ALIGNED = {-.5, -.5, .5, .5, 0, -1, 0, 1};
static const double sign_k[8] ALIGNED = {-.5, .5, -.5, .5, 0, 1, -1, 0};

/* The variant HEADLESS does not compute the attitude q, so the SIMD lanes of q remain zero.
 * Separate code for damped motions keeps the computation of undamped motions fast. */
typedef enum { WHOLE, HEADLESS } form;
typedef enum { PLAIN, DAMPED } linear_terms;
/* The two cyclic permutations of a vector coefficient: (next | prev) and (prev | next). */
typedef struct {
    duo ahead, behind;
} turned_vector;
/* The permuted coefficients of W and P are adjacent in memory, so that one instruction can load
 * both. The permuted coefficients of the vertical P are needed only if the attitude is not computed
 * (HEADLESS). */
typedef struct {
    turned_vector w, p;
} turned_pair;
/* The n-th coefficients of products of Taylor series (Cauchy products). */
typedef struct {
    duo i, j, k; /* of W_j x_m for each axis; the headless variant uses p instead */
    duo p;       /* of (next(W_j) * prev(P_m) | prev(W_j) * next(P_m)) */
    duo cross;   /* of next(W_j) * prev(W_m), in two halves */
} series_sums;

/* Stores a Taylor coefficient of a vector, together with its cyclic permutations. */
INLINE void set_turned(double *to, turned_vector *a, quad value)
{
    quad_store(to, value);
    a->ahead = duo_next_prev(value);
    a->behind = duo_prev_next(value);
}

/* Adds the rotor terms to the initial coefficient of the angular velocity. As a result, every
 * product with the initial coefficient of the angular velocity includes the torque of the rotor. */
INLINE void add_rotor(const kr_series *s, turned_vector *first)
{
    first->behind = duo_add(first->behind, duo_load(s->shift));
}
/* For a vector coefficient (x, y, z), returns half the componentwise product of (y, z, x) and (z,
 * x, y). If j is 0, the contribution of the rotor is first added to the coefficient. */
INLINE duo half_square(const kr_series *s, turned_vector w, int j)
{
    if (j == 0) add_rotor(s, &w);
    return duo_mul(duo_splat(0.5), duo_mul(w.ahead, w.behind));
}
/* Adds to `a` the products of the j-th coefficient of W with the m-th coefficients of the attitude
 * and the vertical. */
INLINE void add_term(series_sums *a, const kr_series *s, const turned_pair *of, int j, int m,
                     form what)
{
    const duo x = duo_load(s->x[m]);
    if (what == HEADLESS) {
        a->p = duo_fma(of[j].w.ahead, of[m].p.behind, a->p);
    } else {
        a->i = duo_fma(duo_lane(s->w[j], 1), x, a->i);
        a->j = duo_fma(duo_lane(s->w[j], 2), x, a->j);
        a->k = duo_fma(duo_lane(s->w[j], 3), x, a->k);
    }
}
/* Adds the products of Taylor coefficients with indices (j, m) to `a`, and those with indices (m,
 * j) to `b`. */
INLINE void add_pair(series_sums *a, series_sums *b, const kr_series *s, const turned_pair *of,
                     int j, int m, form what)
{
    add_term(a, s, of, j, m, what);
    add_term(b, s, of, m, j, what);
    a->cross = duo_fma(of[j].w.ahead, of[m].w.behind, a->cross);
}
INLINE void add_chains(series_sums *a, const series_sums *b, form what)
{
    if (what == HEADLESS)
        a->p = duo_add(a->p, b->p);
    else {
        a->i = duo_add(a->i, b->i);
        a->j = duo_add(a->j, b->j);
        a->k = duo_add(a->k, b->k);
    }
}

/* Returns the n-th coefficients of all products of Taylor series in the equations of motion. Each
 * sum starts with the products of middle-order coefficients, and the products with the newest
 * coefficients are added last. */
INLINE series_sums cauchy_products(const kr_series *s, const turned_pair *of, int n, form what)
{
    const duo zero = duo_splat(0.0);
    series_sums a = {zero, zero, zero, zero, zero}, b = a;
    if (n % 2 == 0) {
        add_term(&a, s, of, n / 2, n / 2, what);
        a.cross = half_square(s, of[n / 2].w, n / 2);
    }
    UNROLL
    for (int j = (n - 1) / 2; j > 0; j--)
        add_pair(&a, SIDE_BY_SIDE ? &b : &a, s, of, n - j, j, what);
    if (SIDE_BY_SIDE) add_chains(&a, &b, what);
    if (n > 0) add_pair(&a, &a, s, of, n, 0, what);
    return a;
}

/* Returns the next Taylor coefficients of the attitude and the vertical, where `share` is 1 / (n +
 * 1). */
INLINE duo attitude_rates(const series_sums *a, duo share)
{
    const duo i = duo_mul(duo_scale(sign_i, share), duo_i(a->i));
    const duo ij = duo_fma(duo_scale(sign_j, share), duo_j(a->j), i);
    return duo_fma(duo_scale(sign_k, share), duo_k(a->k), ij);
}

INLINE quad vertical_rates(const series_sums *a, int n)
{
    return quad_fma(quad_inverse(-n), duo_lo(a->p), quad_mul(quad_inverse(n), duo_hi(a->p)));
}

INLINE quad velocity_rates(const series_sums *a, const kr_series *s, quad p, quad share)
{
    const quad up = quad_mul(quad_mul(share, quad_load(s->up)), quad_next(p));
    const quad torque = quad_fma(quad_mul(share, quad_load(s->down)), quad_prev(p), up);
    return quad_fma(quad_mul(share, quad_load(s->k)), quad_add(duo_lo(a->cross), duo_hi(a->cross)),
                    torque);
}

/* Computes the Taylor coefficients of order n + 1 for a top without friction on a support at
 * rest. */
INLINE void next_series_coefficient(kr_series *s, turned_pair *of, int n, form what,
                                    linear_terms linear)
{
    const series_sums a = cauchy_products(s, of, n, what);
    const quad p = what == HEADLESS ? quad_load(s->x[n] + 4) : duo_hi(duo_load(s->x[n]));
    if (what == HEADLESS)
        set_turned(s->x[n + 1] + 4, &of[n + 1].p, vertical_rates(&a, n + 1));
    else
        duo_store(s->x[n + 1], attitude_rates(&a, duo_inverse(n + 1)));
    quad w = velocity_rates(&a, s, p, quad_inverse(n + 1));
    if (linear == DAMPED)
        w = quad_fma(quad_mul(quad_inverse(n + 1), quad_load(s->drag)), quad_load(s->w[n]), w);
    set_turned(s->w[n + 1], &of[n + 1].w, w);
}

/* approx_log2 and approx_exp2 operate on the bits of a double, and are much faster than libm. Two
 * correct digits suffice for a step size. The function approx_log2 replaces the logarithm of the
 * mantissa by the mantissa itself. The error of approx_log2 hardly affects the step size, because
 * the logarithm is later divided by the order. */
INLINE double approx_log2(double x)
{
    int64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return lone_fma((double)bits, 0x1p-52, -1022.957);
}
INLINE double approx_exp2(double x)
{
    const double whole = x + 0x1.8p52, f = x - (whole - 0x1.8p52);
    uint64_t bits;
    double power;
    memcpy(&bits, &whole, sizeof bits);
    bits = (bits + 1023) << 52;
    memcpy(&power, &bits, sizeof power);
    return power * lone_fma(f, lone_fma(f, 0.2384, 0.7035), 1.0004);
}

/* Returns log2 of the radius of convergence, estimated from the n-th Taylor term. */
INLINE double series_log2_radius(const kr_series *s, int n)
{
    const double *x = s->x[n], *w = s->w[n];
    double a[4];
    for (int i = 0; i < 4; i++)
        a[i] = lone_fma(x[i], x[i], lone_fma(x[4 + i], x[4 + i], w[i] * w[i]));
    return approx_log2((a[0] + a[2]) + (a[1] + a[3])) * (-0.5 / n);
}
/* Returns the step size for which the last retained Taylor term equals the tolerance. The radius of
 * convergence is estimated from two terms (Jorba and Zou 2005), because every other term of an even
 * or odd series vanishes. The estimate does not use the last Taylor term, so that the processor can
 * compute the step size and the last coefficients in parallel. Very close to an unstable
 * equilibrium, all Taylor terms are below the tolerance, so they do not determine the step size.
 * The step size is therefore also limited by the rate at which a falling top leaves the
 * equilibrium. */
INLINE double series_step_size(const kr_series *s, int order, double log2_tol)
{
    const double a = series_log2_radius(s, order - 1), b = series_log2_radius(s, order - 2);
    const double step = approx_exp2(lone_fma(log2_tol, 1.0 / order, a < b ? a : b)),
                 longest = order / 6.0 * s->fall;
    return step < longest ? step : longest;
}

/* Returns the step size at which products of Taylor terms of middle order have the magnitude
 * 2^log2_size. The tail of a Taylor series consists of the terms that are computed in doubles. The
 * first coefficient of the tail is a sum of products of lower coefficients, some of them of about
 * half its order. If these products nearly cancel, the tail is small, but still contains the
 * rounding errors of the large products. A step size based only on the last Taylor term would then
 * be too large. */
INLINE double step_to_tail(const kr_series *s, int head, double log2_size)
{
    const double a = series_log2_radius(s, head / 2), b = series_log2_radius(s, head / 2 + 1);
    return approx_exp2(lone_fma(log2_size, 1.0 / head, a < b ? a : b));
}

INLINE void permute_known_coefficients(kr_series *s, turned_pair *of, int from, form what)
{
    for (int n = 0; n <= from; n++) {
        set_turned(s->w[n], &of[n].w, quad_load(s->w[n]));
        if (what == HEADLESS) set_turned(s->x[n] + 4, &of[n].p, duo_hi(duo_load(s->x[n])));
    }
    add_rotor(s, &of[0].w);
}
INLINE void expand_damped_form(kr_series *s, int from, int order, form what)
{
    turned_pair of[KR_TAYLOR_MAX + 1];
    permute_known_coefficients(s, of, from, what);
    for (int n = from; n < order; n++) next_series_coefficient(s, of, n, what, DAMPED);
}
APART void expand_damped(kr_series *s, int from, int order, form what)
{
    if (what == HEADLESS)
        expand_damped_form(s, from, order, HEADLESS);
    else
        expand_damped_form(s, from, order, WHOLE);
}
#ifndef KR_NO_SUPPORTS
#  include "support.h"
#endif
/* Computes the Taylor coefficients of orders `from` + 1 to `order`. */
INLINE void expand_series(kr_series *s, int from, int order, form what)
{
    turned_pair of[KR_TAYLOR_MAX + 1];
    if (s->linear != 0.0) {
#ifndef KR_NO_SUPPORTS
        if (s->linear > 1.0) {
            expand_support(s, from, order, what);
            return;
        }
#endif
        expand_damped(s, from, order, what);
        return;
    }
    permute_known_coefficients(s, of, from, what);
    UNROLL
    for (int n = from; n < order; n++) next_series_coefficient(s, of, n, what, PLAIN);
}

/* Sums x_n h^(n - from) for n >= from, with h = to - t. Even and odd powers are summed in two
 * parallel chains of fused multiply-adds. */
INLINE void evaluate_sums(const kr_series *s, int from, int order, const double *to, double *sum_x,
                          double *sum_w)
{
    const duo h = duo_span(&s->t, to), hh = duo_mul(h, h);
    const quad h4 = quad_span(&s->t, to), hh4 = quad_mul(h4, h4);
    duo x = duo_load(s->x[order]), x_odd = duo_load(s->x[order - 1]);
    quad w = quad_load(s->w[order]), w_odd = quad_load(s->w[order - 1]);
    UNROLL
    for (int n = order - 2; n > from; n -= 2) {
        x = duo_fma(hh, x, duo_load(s->x[n]));
        x_odd = duo_fma(hh, x_odd, duo_load(s->x[n - 1]));
        w = quad_fma(hh4, w, quad_load(s->w[n]));
        w_odd = quad_fma(hh4, w_odd, quad_load(s->w[n - 1]));
    }
    x = duo_fma(h, x, x_odd);
    w = quad_fma(h4, w, w_odd);
    if ((order - from) % 2 == 0) {
        x = duo_fma(h, x, duo_load(s->x[from]));
        w = quad_fma(h4, w, quad_load(s->w[from]));
    }
    duo_store(sum_x, x);
    quad_store(sum_w, w);
}

/* Begins a step at the end of the previous step. */
INLINE void begin_at_end(kr_series *s)
{
    s->t = s->end;
    duo_store(s->x[0], duo_load(s->end_x));
    quad_store(s->w[0], quad_load(s->end_w));
}
