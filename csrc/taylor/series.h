/* Implements the Taylor series declared in taylor.h: computes the coefficients, chooses the step
 * size, and evaluates the series. This source file is compiled twice for each instruction set: in
 * double precision (quat_simd.h) and in double-double precision (quat_simd_dd.h). Three
 * optimizations make the recurrence fast. Every convolution sum starts with its middle terms, so
 * that it can begin before the latest coefficients are known. The two terms of a convolution sum
 * with indices (j, m) and (m, j) are added in parallel. The order is a compile-time constant, so
 * loops can be unrolled.
 *
 * The equations of tops with dry friction or on a support that rotates or shakes are those of
 * taylor.h with
 *     q' = q U / 2,   P' = P x U,   O' = O x U,   U = W - O
 *     A W' = (AW + h) x W + P x (G c + k A P) - D U + (torque of friction) a
 * O is the angular velocity of the support, and U is the angular velocity of the body relative to
 * the support. All vectors, including the apex a (taylor.h), are in the body frame. The effective
 * gravity G = base + sway cos(...) is the acceleration along -e3 divided by a constant
 * acceleration, by which the lever arm c is multiplied. k is the gravity gradient. The coefficients
 * of U and of G are stored as `w` and as `x` of another kr_series, `own`. All lanes of own->x hold
 * G. Lane 0 of the SIMD vector W holds the friction variable. While the top slides, the friction
 * variable is the spin <U, a>. While friction holds the top, the friction variable is the friction
 * torque relative to its maximum. For a top without friction, lane 0 of W is not used. */
#include <stdint.h>
#include <string.h>
#include "taylor.h"

/* Signs and factors of the terms of quaternion and cross products, for the SIMD lanes in the order
 * produced by duo_i, duo_j and duo_k. */
static const double sign_i[8] ALIGNED = {-.5, .5, .5, -.5, 0, 0, 1, -1};
static const double sign_j[8] ALIGNED = {-.5, -.5, .5, .5, 0, -1, 0, 1};
static const double sign_k[8] ALIGNED = {-.5, .5, -.5, .5, 0, 1, -1, 0};

/* Flags of the terms in the recurrence. The argument `terms` of a function is a sum of flags, and a
 * constant at compile time. HEADLESS: the attitude q is not computed, and the SIMD lanes of q
 * remain zero. DAMPED: damping of a top without friction on a support at rest. Undamped motions
 * have separate code, which is faster. SUPPORT: all terms of a top with friction or on a moving
 * support, except the terms of a rotating support (TURNS), a shaken support (SHAKES) and a gravity
 * gradient (GRADIENT). */
enum {
    WHOLE = 0,
    HEADLESS = 1,
    DAMPED = 2,
#if defined KR_NO_SUPPORTS
    SUPPORT = 0,
    TURNS = 0,
    SHAKES = 0,
    GRADIENT = 0
#else
    SUPPORT = 4,
    TURNS = 8,
    SHAKES = 16,
    GRADIENT = 32
#endif
};
/* The two cyclic permutations of a Taylor coefficient, as duos (next | prev) and (prev | next). */
typedef struct {
    duo ahead, behind;
} turned_vector;
/* Permuted Taylor coefficients: `w` of W; `u` of U (next | prev); `fixed` (prev | next) of O if the
 * support rotates, or of P if the attitude is not computed. */
typedef struct {
    turned_vector w;
    duo u, fixed;
} turned_term;
/* The n-th coefficients of products of Taylor series: sums over all j + m = n (Cauchy products). */
typedef struct {
    duo i, j, k; /* one component of W_j or U_j times x_m; if HEADLESS, p instead */
    duo p;       /* (next(W_j) * prev(P_m) | prev(W_j) * next(P_m)) */
    duo cross;   /* the sum of both halves is next(W_j) * prev(W_m) */
    duo support; /* (next(U_j) * prev(O_m) | prev(U_j) * next(O_m)) */
    duo pulled;  /* G_j x_m */
} series_sums;

/* Stores a Taylor coefficient of a vector, together with its cyclic permutations. */
INLINE void store_permuted(double *to, turned_vector *a, quad value)
{
    quad_store(to, value);
    a->ahead = duo_next_prev(value);
    a->behind = duo_prev_next(value);
}

/* Adds the constants of the rotor (kr_series.shift) to the permuted initial coefficient W_0. Every
 * product with W_0 then includes the torque of the rotor. */
INLINE void add_rotor(const kr_series *s, turned_vector *first)
{
    first->behind = duo_add(first->behind, duo_load(s->shift));
}
/* Returns half of next(W_j) * prev(W_j) in each half of a duo. If j is 0, the constants of the
 * rotor are added to W_0 a second time, because they are halved. */
INLINE duo half_cross_products(const kr_series *s, turned_vector w, int j)
{
    if (j == 0) add_rotor(s, &w);
    return duo_mul(duo_splat(0.5), duo_mul(w.ahead, w.behind));
}
/* Adds to `a` the products of the j-th coefficients of U (or W) and of G with the m-th coefficients
 * of the attitude q, of the vertical P, and of the support's angular velocity O. */
INLINE void add_products(series_sums *a, const kr_series *s, const kr_series *own,
                         const turned_term *turned, int j, int m, int terms)
{
    const duo x = duo_load(s->x[m]);
    if (!(terms & (HEADLESS | SUPPORT))) {
        a->i = duo_fma(duo_lane(s->w[j], 1), x, a->i);
        a->j = duo_fma(duo_lane(s->w[j], 2), x, a->j);
        a->k = duo_fma(duo_lane(s->w[j], 3), x, a->k);
        return;
    }
    const duo u = terms & TURNS ? turned[j].u : turned[j].w.ahead;
    if (terms & HEADLESS) {
        a->p = duo_fma(u, turned[m].fixed, a->p);
    } else {
        a->i = duo_fma(duo_lane_of(u, own->w[j], 1), x, a->i);
        a->j = duo_fma(duo_lane_of(u, own->w[j], 2), x, a->j);
        a->k = duo_fma(duo_lane_of(u, own->w[j], 3), x, a->k);
    }
    if (terms & TURNS) a->support = duo_fma(u, turned[m].fixed, a->support);
    if (terms & SHAKES) a->pulled = duo_fma(duo_load(own->x[j]), x, a->pulled);
}
/* Adds the products of Taylor coefficients with indices (j, m) to `a`, and those with indices (m,
 * j) to `b`. A single term of a->cross covers both pairs of indices. */
INLINE void add_pair(series_sums *a, series_sums *b, const kr_series *s, const kr_series *own,
                     const turned_term *turned, int j, int m, int terms)
{
    add_products(a, s, own, turned, j, m, terms);
    add_products(b, s, own, turned, m, j, terms);
    a->cross = duo_fma(turned[j].w.ahead, turned[m].w.behind, a->cross);
}
INLINE void add_sums(series_sums *a, const series_sums *b, int terms)
{
    if (terms & HEADLESS)
        a->p = duo_add(a->p, b->p);
    else {
        a->i = duo_add(a->i, b->i);
        a->j = duo_add(a->j, b->j);
        a->k = duo_add(a->k, b->k);
    }
    if (terms & TURNS) a->support = duo_add(a->support, b->support);
    if (terms & SHAKES) a->pulled = duo_add(a->pulled, b->pulled);
}

/* Returns the n-th coefficients of all products of Taylor series in the equations of motion. Each
 * sum starts with products of two coefficients of middle order. The products with the newest
 * coefficients are added last. */
INLINE series_sums cauchy_products(const kr_series *s, const kr_series *own,
                                   const turned_term *turned, int n, int terms)
{
    const duo zero = duo_splat(0.0);
    series_sums a = {zero, zero, zero, zero, zero, zero, zero}, b = a;
    if (n % 2 == 0) {
        add_products(&a, s, own, turned, n / 2, n / 2, terms);
        a.cross = half_cross_products(s, turned[n / 2].w, n / 2);
    }
    UNROLL
    for (int j = (n - 1) / 2; j > 0; j--)
        add_pair(&a, SIDE_BY_SIDE ? &b : &a, s, own, turned, n - j, j, terms);
    if (SIDE_BY_SIDE) add_sums(&a, &b, terms);
    if (n > 0) add_pair(&a, &a, s, own, turned, n, 0, terms);
    return a;
}

/* Returns the Taylor coefficients of order n + 1 of the attitude and the vertical, given the
 * products `a` of order n. `share` is 1 / (n + 1). */
INLINE duo next_attitude_coefficient(const series_sums *a, duo share)
{
    const duo i = duo_mul(duo_scale(sign_i, share), duo_i(a->i));
    const duo ij = duo_fma(duo_scale(sign_j, share), duo_j(a->j), i);
    return duo_fma(duo_scale(sign_k, share), duo_k(a->k), ij);
}

INLINE quad next_vertical_coefficient(const series_sums *a, int n)
{
    return quad_fma(quad_reciprocal(-n), duo_first(a->p),
                    quad_mul(quad_reciprocal(n), duo_second(a->p)));
}

INLINE quad next_velocity_coefficient(const series_sums *a, const kr_series *s, quad p, quad share)
{
    const quad up = quad_mul(quad_mul(share, quad_load(s->up)), quad_next(p));
    const quad torque = quad_fma(quad_mul(share, quad_load(s->down)), quad_prev(p), up);
    return quad_fma(quad_mul(share, quad_load(s->k)),
                    quad_add(duo_first(a->cross), duo_second(a->cross)), torque);
}

/* Stores the n-th Taylor coefficient of the vertical P if the attitude is not computed. */
INLINE void set_vertical(kr_series *s, turned_term *turned, int n, quad p)
{
    quad_store(s->x[n] + 4, p);
    turned[n].fixed = duo_prev_next(p);
}

/* Returns the n-th coefficient of the support's angular velocity in the body frame. */
INLINE quad support_velocity(duo support, int n)
{
    return quad_fma(quad_reciprocal(-n), duo_first(support),
                    quad_mul(quad_reciprocal(n), duo_second(support)));
}
/* Returns the dot product of lanes 1 to 3 of two vectors, copied to every lane. */
INLINE quad dot_lanes(kr_series *own, quad a, quad b)
{
    quad_store(own->end_w, quad_mul(a, b));
    const quad x = duo_first(duo_lane(own->end_w, 1)), y = duo_first(duo_lane(own->end_w, 2));
    return quad_add(duo_first(duo_lane(own->end_w, 3)), quad_add(x, y));
}
/* Stores the n-th coefficient of the friction variable in lane 0 of W_n. The vector `number` must
 * hold this coefficient in all SIMD lanes. */
INLINE void set_lane0(kr_series *s, kr_series *own, int n, quad number)
{
    quad_store(own->end_w, number);
    copy_number(s->w[n], own->end_w);
}
/* Returns W_{n+1} with the friction torque that keeps the spin constant, and stores the n-th
 * coefficient of this torque in W_n. `w` is W_{n+1} without friction, and `o` is O_{n+1}. */
INLINE quad add_holding_torque(kr_series *s, kr_series *own, int n, quad w, quad o)
{
    const quad minus = quad_splat(-1.0), gained = quad_fma(minus, o, w),
               lost = quad_mul(minus, dot_lanes(own, gained, quad_load(s->apex)));
    const quad torque = quad_mul(duo_first(duo_lane(&s->per_grip, 0)), lost);
    set_lane0(s, own, n, quad_mul(quad_splat((double)(n + 1)), torque));
    return quad_fma(lost, quad_load(s->yield), w);
}
/* Returns W_{n+1} of a top with friction or on a moving support, without a friction torque that
 * holds the top. `p` is the n-th coefficient of G P. */
INLINE quad next_top_velocity(const series_sums *a, const kr_series *s, const kr_series *own, int n,
                              quad p)
{
    const quad share = quad_reciprocal(n + 1),
               drag = quad_mul(quad_mul(share, quad_load(s->drag)), quad_load(own->w[n])),
               other = n == 0 ? quad_add(drag, quad_load(s->rub)) : drag,
               up = quad_fma(quad_mul(share, quad_load(s->up)), quad_next(p), other),
               torque = quad_fma(quad_mul(share, quad_load(s->down)), quad_prev(p), up);
    return quad_fma(quad_mul(share, quad_load(s->k)),
                    quad_add(duo_first(a->cross), duo_second(a->cross)), torque);
}
/* Returns the n-th Taylor coefficient of next(P) * prev(P), to which the torque of a gravity
 * gradient is proportional. */
INLINE quad gradient_products(const kr_series *s, int n)
{
    quad sum = quad_splat(0.0);
    for (int j = 0; j <= n; j++)
        sum =
            quad_fma(quad_next(quad_load(s->x[j] + 4)), quad_prev(quad_load(s->x[n - j] + 4)), sum);
    return sum;
}
/* Stores the n-th Taylor coefficients of W (`w`) and O (`o`), and that of U = W - O. For a sliding
 * top, also stores the n-th coefficient of the spin, unless `is_known` is nonzero. */
INLINE void set_velocities(kr_series *s, kr_series *own, turned_term *turned, int n, quad w, quad o,
                           int turns, int is_known)
{
    const quad u = turns ? quad_fma(quad_splat(-1.0), o, w) : w;
    quad_store(own->w[n], u);
    if (turns) {
        turned[n].u = duo_next_prev(u);
        turned[n].fixed = duo_prev_next(o);
    }
    store_permuted(s->w[n], &turned[n].w, w);
    if (s->slides != 0.0 && !is_known) set_lane0(s, own, n, dot_lanes(own, u, quad_load(s->apex)));
}
/* Computes the Taylor coefficients of the effective gravity G, a constant plus a cosine. */
INLINE void expand_effective_gravity(const kr_series *s, kr_series *own, int order)
{
    duo cosine = duo_lane(s->sway, 0), sine = duo_lane(s->sway, 1);
    duo_store(own->x[0], duo_add(cosine, duo_lane(s->sway, 3)));
    for (int n = 1; n < order; n++) {
        const duo rate = duo_mul(duo_reciprocal(n), duo_lane(s->sway, 2)),
                  next = duo_mul(rate, cosine);
        cosine = duo_mul(duo_splat(-1.0), duo_mul(rate, sine));
        sine = next;
        duo_store(own->x[n], cosine);
    }
}
/* Computes the Taylor coefficients of order n + 1 of the angular velocities W, U and O of a top
 * with friction or on a moving support. `vertical` is the n-th coefficient of P. */
INLINE void set_next_velocities(kr_series *s, kr_series *own, turned_term *turned, int n,
                                quad vertical, const series_sums *a, int terms)
{
    const quad o = terms & TURNS ? support_velocity(a->support, n + 1) : quad_splat(0.0);
    quad w = next_top_velocity(a, s, own, n, terms & SHAKES ? duo_second(a->pulled) : vertical);
    if (terms & GRADIENT)
        w = quad_fma(quad_mul(quad_reciprocal(n + 1), quad_load(s->steep)), gradient_products(s, n),
                     w);
    if (s->holds != 0.0) w = add_holding_torque(s, own, n, w, o);
    set_velocities(s, own, turned, n + 1, w, o, terms & TURNS, 0);
}

/* Computes the Taylor coefficients of order n + 1. */
INLINE void next_series_coefficient(kr_series *s, kr_series *own, turned_term *turned, int n,
                                    int terms)
{
    const series_sums a = cauchy_products(s, own, turned, n, terms);
    const quad p = terms & HEADLESS ? quad_load(s->x[n] + 4) : duo_second(duo_load(s->x[n]));
    if (terms & HEADLESS)
        set_vertical(s, turned, n + 1, next_vertical_coefficient(&a, n + 1));
    else
        duo_store(s->x[n + 1], next_attitude_coefficient(&a, duo_reciprocal(n + 1)));
    if (terms & SUPPORT) {
        set_next_velocities(s, own, turned, n, p, &a, terms);
        return;
    }
    quad w = next_velocity_coefficient(&a, s, p, quad_reciprocal(n + 1));
    if (terms & DAMPED)
        w = quad_fma(quad_mul(quad_reciprocal(n + 1), quad_load(s->drag)), quad_load(s->w[n]), w);
    store_permuted(s->w[n + 1], &turned[n + 1].w, w);
}

/* approx_log2 and approx_exp2 operate on the bits of a double, and are much faster than libm. Two
 * correct digits suffice for a step size. approx_log2 replaces the logarithm of the mantissa by a
 * linear function of the mantissa. Its error hardly affects the step size, because the logarithm is
 * later divided by the order. */
INLINE double approx_log2(double x)
{
    int64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return scalar_fma((double)bits, 0x1p-52, -1022.957);
}
INLINE double approx_exp2(double x)
{
    const double whole = x + 0x1.8p52, f = x - (whole - 0x1.8p52);
    uint64_t bits;
    double power;
    memcpy(&bits, &whole, sizeof bits);
    bits = (bits + 1023) << 52;
    memcpy(&power, &bits, sizeof power);
    return power * scalar_fma(f, scalar_fma(f, 0.2384, 0.7035), 1.0004);
}

/* Returns log2 of the radius of convergence, estimated from the n-th Taylor term. */
INLINE double series_log2_radius(const kr_series *s, int n)
{
    const double *x = s->x[n], *w = s->w[n];
    double a[4];
    for (int i = 0; i < 4; i++)
        a[i] = scalar_fma(x[i], x[i], scalar_fma(x[4 + i], x[4 + i], w[i] * w[i]));
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
    const double step = approx_exp2(scalar_fma(log2_tol, 1.0 / order, a < b ? a : b)),
                 longest = order / 6.0 * s->fall;
    return step < longest ? step : longest;
}

/* Returns the step size at which products of two Taylor terms of order about head / 2 have the
 * magnitude 2^log2_size. The tail of a Taylor series consists of the terms after the term `head`,
 * which are computed in double precision. The first coefficient of the tail is a sum of products of
 * lower coefficients, some of them of order about head / 2. If these products nearly cancel, the
 * tail is small, but still contains the rounding errors of the large products. A step size based
 * only on the last Taylor term would then be too large. */
INLINE double step_size_for_tail(const kr_series *s, int head, double log2_size)
{
    const double a = series_log2_radius(s, head / 2), b = series_log2_radius(s, head / 2 + 1);
    return approx_exp2(scalar_fma(log2_size, 1.0 / head, a < b ? a : b));
}

/* Permutes the coefficients of orders 0 to `from`, which are known. */
INLINE void permute_known_coefficients(kr_series *s, turned_term *turned, int from, int terms)
{
    for (int n = 0; n <= from; n++) {
        if (!(terms & SUPPORT)) store_permuted(s->w[n], &turned[n].w, quad_load(s->w[n]));
        if (terms & HEADLESS) set_vertical(s, turned, n, quad_load(s->x[n] + 4));
    }
}
/* Computes the coefficients of orders 0 to `from` of U and of O from the known coefficients of the
 * top's motion. */
INLINE void find_known_velocities(kr_series *s, kr_series *own, turned_term *turned, int from,
                                  int terms)
{
    set_velocities(s, own, turned, 0, quad_load(s->w[0]), quad_load(s->turn), terms & TURNS,
                   from > 0);
    for (int n = 0; n < from; n++) {
        duo support = duo_splat(0.0);
        if (terms & TURNS)
            for (int j = 0; j <= n; j++)
                support = duo_fma(turned[j].u, turned[n - j].fixed, support);
        set_velocities(s, own, turned, n + 1, quad_load(s->w[n + 1]),
                       support_velocity(support, n + 1), terms & TURNS, 1);
    }
}
/* Computes the Taylor coefficients of orders `from` + 1 to `order` of a top with damping, friction
 * or a moving support. In double-double precision, own[0] holds high and own[1] low words. */
INLINE void expand_terms(kr_series *s, int from, int order, int terms)
{
    kr_series own[2];
    turned_term turned[KR_TAYLOR_MAX + 1];
    permute_known_coefficients(s, turned, from, terms);
    if (terms & SHAKES) expand_effective_gravity(s, own, order);
    if (terms & SUPPORT) find_known_velocities(s, own, turned, from, terms);
    add_rotor(s, &turned[0].w);
    for (int n = from; n < order; n++)
        next_series_coefficient(s, terms & SUPPORT ? own : s, turned, n, terms);
}
APART void expand_damped(kr_series *s, int from, int order, int terms)
{
    if (terms & HEADLESS)
        expand_terms(s, from, order, HEADLESS | DAMPED);
    else
        expand_terms(s, from, order, DAMPED);
}
#if !defined KR_NO_SUPPORTS
#  if defined KR_LONG_FUNCTIONS
APART void expand_moving(kr_series *s, int from, int order)
{
    expand_terms(s, from, order,
                 SUPPORT | (s->turns != 0.0 ? TURNS : 0) | (s->shakes != 0.0 ? SHAKES : 0) |
                     (s->gradient != 0.0 ? GRADIENT : 0));
}
INLINE void expand_support(kr_series *s, int from, int order, int terms)
{
    (void)terms;
    expand_moving(s, from, order);
}
#  else
APART void expand_turning(kr_series *s, int from, int order)
{
    expand_terms(s, from, order, SUPPORT | TURNS);
}
APART void expand_shaking(kr_series *s, int from, int order)
{
    expand_terms(s, from, order, SUPPORT | SHAKES);
}
APART void expand_moving(kr_series *s, int from, int order)
{
    expand_terms(s, from, order, SUPPORT | TURNS | SHAKES);
}
APART void expand_gradient(kr_series *s, int from, int order)
{
    expand_terms(s, from, order, SUPPORT | TURNS | GRADIENT);
}
APART void expand_support_headless(kr_series *s, int from, int order)
{
    if (s->gradient != 0.0)
        expand_terms(s, from, order, SUPPORT | GRADIENT | HEADLESS);
    else
        expand_terms(s, from, order, SUPPORT | SHAKES | HEADLESS);
}
INLINE void expand_support(kr_series *s, int from, int order, int terms)
{
    if (terms & HEADLESS)
        expand_support_headless(s, from, order);
    else if (s->gradient != 0.0)
        expand_gradient(s, from, order);
    else if (s->turns == 0.0)
        expand_shaking(s, from, order);
    else if (s->shakes == 0.0)
        expand_turning(s, from, order);
    else
        expand_moving(s, from, order);
}
#  endif
#endif
/* Computes the Taylor coefficients of orders `from` + 1 to `order`, given those of lower order. */
INLINE void expand_series(kr_series *s, int from, int order, int terms)
{
    turned_term turned[KR_TAYLOR_MAX + 1];
#if !defined KR_NO_SUPPORTS
    if (s->linear > 1.0) {
        expand_support(s, from, order, terms);
        return;
    }
#endif
    if (s->linear != 0.0) {
        expand_damped(s, from, order, terms);
        return;
    }
    permute_known_coefficients(s, turned, from, terms);
    add_rotor(s, &turned[0].w);
    UNROLL
    for (int n = from; n < order; n++) next_series_coefficient(s, s, turned, n, terms);
}

/* Computes the sums of x_n h^(n - from) and of w_n h^(n - from) for n >= from, with h = to - t.
 * Even and odd powers are summed in two parallel chains of fused multiply-adds. */
INLINE void evaluate_terms(const kr_series *s, int from, int order, const double *to, double *sum_x,
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
INLINE void begin_step(kr_series *s)
{
    s->t = s->end;
    duo_store(s->x[0], duo_load(s->end_x));
    quad_store(s->w[0], quad_load(s->end_w));
}
