/* Implements the Taylor series declared in taylor.h: computes the coefficients, chooses the step
 * size, and evaluates the series. This source file is compiled twice for each instruction set: in
 * double precision (quat_simd.h) and in double-double precision (quat_simd_dd.h). Three
 * optimizations make the recurrence fast. Every Cauchy product, a sum over j + m = n, starts with
 * its middle terms, so that it can begin before the latest coefficients are known. The terms with
 * the indices (j, m) and (m, j) are added in parallel. The order is a compile-time constant, so
 * loops can be unrolled. W_n is the n-th Taylor coefficient of W, and so on. The argument `s` of a
 * function is the series of q, P and W: s->x[n] is (q_n | P_n), and s->w[n] is W_n.
 *
 * With the symbols of taylor.h, but space axes fixed to the support (kreisel.h), the equations with
 * dry friction, a gravity gradient K, or a support that rotates or shakes are
 *     q' = q U / 2,   P' = P x U,   O' = O x U,   U = W - O
 *     A W' = (AW + h) x W + P x (G c + K A P) - D U + (torque of friction) apex
 * All vectors are in the body frame. O is the angular velocity of the support, U that of the body
 * relative to the support, and `apex` a unit vector (kreisel.h). Here, c is mass * g0 * (center of
 * mass), where g0 is gravity or, if larger, the amplitude of the support's acceleration. G, the
 * effective gravity (g in kreisel.h) divided by g0, is a constant plus a cosine. In a second
 * kr_series, `own`, own->w[n] is U_n, and all lanes of own->x[n] are G_n. With friction, lane 0 of
 * W is the friction variable: while the top slides, the spin <U, apex> (scalar product); while
 * friction holds the top (spin zero), the torque of friction divided by its maximum. */
#include <stdint.h>
#include <string.h>
#include "taylor.h"

/* The products (q i / 2 | P x i), (q j / 2 | P x j) and (q k / 2 | P x k) are duo_permute_i(x),
 * duo_permute_j(x) and duo_permute_k(x) (quat_simd.h) times these factors, for x = (q | P). */
static const double sign_i[8] ALIGNED = {-.5, .5, .5, -.5, 0, 0, 1, -1};
static const double sign_j[8] ALIGNED = {-.5, -.5, .5, .5, 0, -1, 0, 1};
static const double sign_k[8] ALIGNED = {-.5, .5, -.5, .5, 0, 1, -1, 0};

/* Flags of the terms in the equations. The argument `terms` of a function is a sum of flags. WHOLE
 * is the sum of no flags. With HEADLESS, q is not computed, and its lanes remain zero. DAMPED adds
 * the term - D W of taylor.h. SUPPORT selects the equations above, with damping and friction. In
 * these equations, O is 0 without TURNS, G is 1 without SHAKES, and K is 0 without GRADIENT. */
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
/* The cyclic permutations (taylor.h) of a Taylor coefficient: (next | prev) and (prev | next). */
typedef struct {
    duo ahead, behind;
} turned_vector;
/* Order n: `w` permutes W_n. With the flag TURNS, `u` is (next(U_n) | prev(U_n)) and `fixed`
 * (prev(O_n) | next(O_n)). With HEADLESS (never with TURNS), `fixed` is (prev(P_n) | next(P_n)). */
typedef struct {
    turned_vector w;
    duo u, fixed;
} turned_term;
/* Sums, over all j + m = n, of the products below: the n-th coefficients of products of Taylor
 * series. V is U with TURNS, and W otherwise. x_m is (q_m | P_m). */
typedef struct {
    duo i, j, k; /* unless HEADLESS: the x, y and z component of V_j times x_m */
    duo p;       /* if HEADLESS: (next(V_j) * prev(P_m) | prev(V_j) * next(P_m)) */
    duo cross;   /* its halves add up to next(W_j) * prev(W_m) */
    duo support; /* if TURNS: (next(U_j) * prev(O_m) | prev(U_j) * next(O_m)) */
    duo pulled;  /* if SHAKES: G_j x_m */
} series_sums;

/* Stores a Taylor coefficient of a vector at `to`, and its cyclic permutations in `permuted`. */
INLINE void store_and_permute(double *to, turned_vector *permuted, quad value)
{
    quad_store(to, value);
    permuted->ahead = duo_yzx_zxy(value);
    permuted->behind = duo_zxy_yzx(value);
}

/* Adds the constants of the rotor, s->shift (taylor.h), to w0->behind = (prev(W_0) | next(W_0)), so
 * that the products in series_sums.cross include the torque of the rotor. */
INLINE void add_rotor_terms(const kr_series *s, turned_vector *w0)
{
    w0->behind = duo_add(w0->behind, duo_load(s->shift));
}
/* Returns the term of series_sums.cross with m = j, where `w` is turned[j].w. Without a rotor, both
 * halves of w.ahead * w.behind are next(W_j) * prev(W_j), so each is multiplied by 1/2. s->shift,
 * which w.behind contains if j = 0, must not be halved, so it is first added once more. */
INLINE duo find_middle_cross_term(const kr_series *s, turned_vector w, int j)
{
    if (j == 0) add_rotor_terms(s, &w);
    return duo_mul(duo_splat(0.5), duo_mul(w.ahead, w.behind));
}
/* Adds the products of series_sums with the indices j and m to the members of `a` that `terms`
 * requires, except `cross`. */
INLINE void add_products(series_sums *a, const kr_series *s, const kr_series *own,
                         const turned_term *turned, int j, int m, int terms)
{
    const duo x = duo_load(s->x[m]);
    if (!(terms & (HEADLESS | SUPPORT))) {
        a->i = duo_fma(duo_splat_lane(s->w[j], 1), x, a->i);
        a->j = duo_fma(duo_splat_lane(s->w[j], 2), x, a->j);
        a->k = duo_fma(duo_splat_lane(s->w[j], 3), x, a->k);
        return;
    }
    const duo u = terms & TURNS ? turned[j].u : turned[j].w.ahead;
    if (terms & HEADLESS) {
        a->p = duo_fma(u, turned[m].fixed, a->p);
    } else {
        a->i = duo_fma(duo_splat_lane_of(u, own->w[j], 1), x, a->i);
        a->j = duo_fma(duo_splat_lane_of(u, own->w[j], 2), x, a->j);
        a->k = duo_fma(duo_splat_lane_of(u, own->w[j], 3), x, a->k);
    }
    if (terms & TURNS) a->support = duo_fma(u, turned[m].fixed, a->support);
    if (terms & SHAKES) a->pulled = duo_fma(duo_load(own->x[j]), x, a->pulled);
}
/* Adds the products with the indices (j, m) to `a`, and those with (m, j) to `b`, except those of
 * `cross`: a->cross receives next(W_j) * prev(W_m) (taylor.h) in its first half, and next(W_m) *
 * prev(W_j) in its second. */
INLINE void add_product_pair(series_sums *a, series_sums *b, const kr_series *s,
                             const kr_series *own, const turned_term *turned, int j, int m,
                             int terms)
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

/* Returns the sums of order n that `terms` requires. Each sum starts with the products of two
 * coefficients of orders near n / 2. The products with the coefficients of order n, which are known
 * last, are added last. */
INLINE series_sums cauchy_products(const kr_series *s, const kr_series *own,
                                   const turned_term *turned, int n, int terms)
{
    const duo zero = duo_splat(0.0);
    series_sums a = {zero, zero, zero, zero, zero, zero, zero}, b = a;
    if (n % 2 == 0) {
        add_products(&a, s, own, turned, n / 2, n / 2, terms);
        a.cross = find_middle_cross_term(s, turned[n / 2].w, n / 2);
    }
    UNROLL
    for (int j = (n - 1) / 2; j > 0; j--)
        add_product_pair(&a, SIDE_BY_SIDE ? &b : &a, s, own, turned, n - j, j, terms);
    if (SIDE_BY_SIDE) add_sums(&a, &b, terms);
    if (n > 0) add_product_pair(&a, &a, s, own, turned, n, 0, terms);
    return a;
}

/* Returns (q_{n+1} | P_{n+1}), given the sums `a` of order n. `share` is 1 / (n + 1). */
INLINE duo next_attitude_and_vertical(const series_sums *a, duo share)
{
    const duo i = duo_mul(duo_scale(sign_i, share), duo_permute_i(a->i));
    const duo ij = duo_fma(duo_scale(sign_j, share), duo_permute_j(a->j), i);
    return duo_fma(duo_scale(sign_k, share), duo_permute_k(a->k), ij);
}

/* Returns b_n for a vector b with b' = b x U, such as P or O. `products` is the sum of order n - 1
 * of (next(U) * prev(b) | prev(U) * next(b)), whose second half minus first half is b x U. */
INLINE quad integrate_cross_product(duo products, int n)
{
    return quad_fma(quad_reciprocal(-n), duo_first(products),
                    quad_mul(quad_reciprocal(n), duo_second(products)));
}
INLINE quad next_angular_velocity(const series_sums *a, const kr_series *s, quad p, quad share)
{
    const quad up = quad_mul(quad_mul(share, quad_load(s->up)), quad_yzx(p));
    const quad torque = quad_fma(quad_mul(share, quad_load(s->down)), quad_zxy(p), up);
    return quad_fma(quad_mul(share, quad_load(s->k)),
                    quad_add(duo_first(a->cross), duo_second(a->cross)), torque);
}

INLINE void store_and_permute_vertical(kr_series *s, turned_term *turned, int n, quad p)
{
    quad_store(s->x[n] + 4, p);
    turned[n].fixed = duo_zxy_yzx(p);
}

/* Returns the dot product of lanes 1 to 3 of a and b in all lanes. Overwrites scratch->end_w. */
INLINE quad dot_lanes(kr_series *scratch, quad a, quad b)
{
    quad_store(scratch->end_w, quad_mul(a, b));
    const quad x = duo_first(duo_splat_lane(scratch->end_w, 1)),
               y = duo_first(duo_splat_lane(scratch->end_w, 2));
    return quad_add(duo_first(duo_splat_lane(scratch->end_w, 3)), quad_add(x, y));
}
/* Sets lane 0 of W_n, the n-th coefficient of the friction variable, to the number that is in all
 * lanes of `number`. Overwrites scratch->end_w. */
INLINE void store_friction_variable(kr_series *s, kr_series *scratch, int n, quad number)
{
    quad_store(scratch->end_w, number);
    copy_number(s->w[n], scratch->end_w);
}
/* Returns W_{n+1} if friction keeps the spin <U, apex> constant. `w` is W_{n+1} without friction,
 * and `o` is O_{n+1}. Stores in lane 0 of W_n the n-th coefficient of the torque of friction,
 * divided by its maximum (the torque on a sliding top). Overwrites own->end_w. */
INLINE quad add_friction_holding_spin(kr_series *s, kr_series *own, int n, quad w, quad o)
{
    const quad minus = quad_splat(-1.0), gained = quad_fma(minus, o, w),
               lost = quad_mul(minus, dot_lanes(own, gained, quad_load(s->apex)));
    const quad torque = quad_mul(duo_first(duo_splat_lane(&s->per_grip, 0)), lost);
    store_friction_variable(s, own, n, quad_mul(quad_splat((double)(n + 1)), torque));
    return quad_fma(lost, quad_load(s->yield), w);
}
/* Returns W_{n+1} without the torques of the gravity gradient and of friction that holds the top.
 * `a` contains the sums of order n, and `p` is the n-th coefficient of G P. */
INLINE quad next_velocity_with_support(const series_sums *a, const kr_series *s,
                                       const kr_series *own, int n, quad p)
{
    const quad share = quad_reciprocal(n + 1),
               drag = quad_mul(quad_mul(share, quad_load(s->drag)), quad_load(own->w[n])),
               other = n == 0 ? quad_add(drag, quad_load(s->rub)) : drag,
               up = quad_fma(quad_mul(share, quad_load(s->up)), quad_yzx(p), other),
               torque = quad_fma(quad_mul(share, quad_load(s->down)), quad_zxy(p), up);
    return quad_fma(quad_mul(share, quad_load(s->k)),
                    quad_add(duo_first(a->cross), duo_second(a->cross)), torque);
}
/* Returns the n-th Taylor coefficient of next(P) * prev(P). The gravity gradient exerts the torque
 * P x (K A P) = K * (prev(A) - next(A)) * next(P) * prev(P). */
INLINE quad sum_vertical_products(const kr_series *s, int n)
{
    quad sum = quad_splat(0.0);
    for (int j = 0; j <= n; j++)
        sum = quad_fma(quad_yzx(quad_load(s->x[j] + 4)), quad_zxy(quad_load(s->x[n - j] + 4)), sum);
    return sum;
}
/* Stores W_n (`w`) in s->w[n], U_n = W_n - O_n in own->w[n], and permutations (turned_term) in
 * turned[n]. O_n is `o` if `turns` is nonzero, and 0 otherwise. If the top slides, sets lane 0 of
 * W_n to the n-th coefficient of the spin, unless lane 0 of `w` already has it (`is_known`). */
INLINE void set_coefficients_of_W_and_U(kr_series *s, kr_series *own, turned_term *turned, int n,
                                        quad w, quad o, int turns, int is_known)
{
    const quad u = turns ? quad_fma(quad_splat(-1.0), o, w) : w;
    quad_store(own->w[n], u);
    if (turns) {
        turned[n].u = duo_yzx_zxy(u);
        turned[n].fixed = duo_zxy_yzx(o);
    }
    store_and_permute(s->w[n], &turned[n].w, w);
    if (s->slides != 0.0 && !is_known)
        store_friction_variable(s, own, n, dot_lanes(own, u, quad_load(s->apex)));
}
/* Computes the Taylor coefficients 0 to order - 1 of the effective gravity G (kr_series.sway). */
INLINE void expand_effective_gravity(const kr_series *s, kr_series *own, int order)
{
    duo cosine = duo_splat_lane(s->sway, 0), sine = duo_splat_lane(s->sway, 1);
    duo_store(own->x[0], duo_add(cosine, duo_splat_lane(s->sway, 3)));
    for (int n = 1; n < order; n++) {
        const duo rate = duo_mul(duo_reciprocal(n), duo_splat_lane(s->sway, 2)),
                  next = duo_mul(rate, cosine);
        cosine = duo_mul(duo_splat(-1.0), duo_mul(rate, sine));
        sine = next;
        duo_store(own->x[n], cosine);
    }
}
/* Computes W, U and O of order n + 1. `vertical` is P_n, and `a` contains the sums of order n. */
INLINE void set_next_angular_velocities(kr_series *s, kr_series *own, turned_term *turned, int n,
                                        quad vertical, const series_sums *a, int terms)
{
    const quad o = terms & TURNS ? integrate_cross_product(a->support, n + 1) : quad_splat(0.0);
    quad w =
        next_velocity_with_support(a, s, own, n, terms & SHAKES ? duo_second(a->pulled) : vertical);
    if (terms & GRADIENT)
        w = quad_fma(quad_mul(quad_reciprocal(n + 1), quad_load(s->steep)),
                     sum_vertical_products(s, n), w);
    if (s->holds != 0.0) w = add_friction_holding_spin(s, own, n, w, o);
    set_coefficients_of_W_and_U(s, own, turned, n + 1, w, o, terms & TURNS, 0);
}

/* Computes the Taylor coefficients of order n + 1 of q, P and W, with SUPPORT also of U and O. */
INLINE void set_next_coefficients(kr_series *s, kr_series *own, turned_term *turned, int n,
                                  int terms)
{
    const series_sums a = cauchy_products(s, own, turned, n, terms);
    const quad p = terms & HEADLESS ? quad_load(s->x[n] + 4) : duo_second(duo_load(s->x[n]));
    if (terms & HEADLESS)
        store_and_permute_vertical(s, turned, n + 1, integrate_cross_product(a.p, n + 1));
    else
        duo_store(s->x[n + 1], next_attitude_and_vertical(&a, duo_reciprocal(n + 1)));
    if (terms & SUPPORT) {
        set_next_angular_velocities(s, own, turned, n, p, &a, terms);
        return;
    }
    quad w = next_angular_velocity(&a, s, p, quad_reciprocal(n + 1));
    if (terms & DAMPED)
        w = quad_fma(quad_mul(quad_reciprocal(n + 1), quad_load(s->drag)), quad_load(s->w[n]), w);
    store_and_permute(s->w[n + 1], &turned[n + 1].w, w);
}

/* Returns log2(x), much faster than libm, for a normal number x > 0, and about -1023 for x = 0. The
 * error is less than 0.05. Step sizes depend on log2(x) / order, so the error hardly matters. */
INLINE double approx_log2(double x)
{
    int64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return scalar_fma((double)bits, 0x1p-52, -1022.957);
}
/* Returns 2^x with a relative error below 0.002, for |x| < 1022, much faster than libm. */
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

/* Returns log2 of the radius of convergence, estimated as |(q_n, P_n, W_n)|^(-1 / n). */
INLINE double series_log2_radius(const kr_series *s, int n)
{
    const double *x = s->x[n], *w = s->w[n];
    double a[4];
    for (int i = 0; i < 4; i++)
        a[i] = scalar_fma(x[i], x[i], scalar_fma(x[4 + i], x[4 + i], w[i] * w[i]));
    return approx_log2((a[0] + a[2]) + (a[1] + a[3])) * (-0.5 / n);
}
/* Returns the step size at which the last Taylor term, of index `order`, is about 2^log2_tol, but
 * at most order / 6 times s->fall (taylor.h). The radius of convergence is estimated from two terms
 * (Jorba and Zou 2005), because every other term of an even or odd series vanishes. These are the
 * two terms before the last one, so that the processor can compute the step size and the last
 * coefficients in parallel. Very close to an unstable equilibrium, all Taylor terms are below the
 * tolerance, and only s->fall limits the step size. */
INLINE double series_step_size(const kr_series *s, int order, double log2_tol)
{
    const double a = series_log2_radius(s, order - 1), b = series_log2_radius(s, order - 2);
    const double step = approx_exp2(scalar_fma(log2_tol, 1.0 / order, a < b ? a : b)),
                 longest = order / 6.0 * s->fall;
    return step < longest ? step : longest;
}

/* Returns the step size at which a product of two Taylor terms of orders near head / 2, typical of
 * the products in the sums of order `head`, is 2^log2_size. The terms after `head` are computed in
 * double precision from sums of products. If the products nearly cancel, the sums are small, but
 * contain the rounding errors of the large products. A step size based only on the last Taylor term
 * would then be too large. */
INLINE double step_size_for_product_size(const kr_series *s, int head, double log2_size)
{
    const double a = series_log2_radius(s, head / 2), b = series_log2_radius(s, head / 2 + 1);
    return approx_exp2(scalar_fma(log2_size, 1.0 / head, a < b ? a : b));
}

/* Stores permutations of the coefficients of W (without SUPPORT) and, with HEADLESS, of P. */
INLINE void permute_coefficients_up_to(kr_series *s, turned_term *turned, int from, int terms)
{
    for (int n = 0; n <= from; n++) {
        if (!(terms & SUPPORT)) store_and_permute(s->w[n], &turned[n].w, quad_load(s->w[n]));
        if (terms & HEADLESS) store_and_permute_vertical(s, turned, n, quad_load(s->x[n] + 4));
    }
}
/* Computes the coefficients of orders 0 to `from` of U and O, given those of W, and s->turn. */
INLINE void set_known_relative_velocities(kr_series *s, kr_series *own, turned_term *turned,
                                          int from, int terms)
{
    set_coefficients_of_W_and_U(s, own, turned, 0, quad_load(s->w[0]), quad_load(s->turn),
                                terms & TURNS, from > 0);
    for (int n = 0; n < from; n++) {
        duo support = duo_splat(0.0);
        if (terms & TURNS)
            for (int j = 0; j <= n; j++)
                support = duo_fma(turned[j].u, turned[n - j].fixed, support);
        set_coefficients_of_W_and_U(s, own, turned, n + 1, quad_load(s->w[n + 1]),
                                    integrate_cross_product(support, n + 1), terms & TURNS, 1);
    }
}
/* Computes the coefficients of orders `from` + 1 to `order`, given those of orders 0 to `from`.
 * `terms` includes DAMPED or SUPPORT. In double-double precision, own[1] holds the low words. */
INLINE void expand_with_terms(kr_series *s, int from, int order, int terms)
{
    kr_series own[2];
    turned_term turned[KR_TAYLOR_MAX + 1];
    permute_coefficients_up_to(s, turned, from, terms);
    if (terms & SHAKES) expand_effective_gravity(s, own, order);
    if (terms & SUPPORT) set_known_relative_velocities(s, own, turned, from, terms);
    add_rotor_terms(s, &turned[0].w);
    for (int n = from; n < order; n++)
        set_next_coefficients(s, terms & SUPPORT ? own : s, turned, n, terms);
}
APART void expand_damped(kr_series *s, int from, int order, int terms)
{
    if (terms & HEADLESS)
        expand_with_terms(s, from, order, HEADLESS | DAMPED);
    else
        expand_with_terms(s, from, order, DAMPED);
}
#if !defined KR_NO_SUPPORTS
#  if defined KR_LONG_FUNCTIONS
APART void expand_with_moving_support(kr_series *s, int from, int order)
{
    expand_with_terms(s, from, order,
                      SUPPORT | (s->turns != 0.0 ? TURNS : 0) | (s->shakes != 0.0 ? SHAKES : 0) |
                          (s->gradient != 0.0 ? GRADIENT : 0));
}
INLINE void expand_with_support(kr_series *s, int from, int order, int terms)
{
    (void)terms;
    expand_with_moving_support(s, from, order);
}
#  else
APART void expand_with_turning_support(kr_series *s, int from, int order)
{
    expand_with_terms(s, from, order, SUPPORT | TURNS);
}
APART void expand_with_shaking_support(kr_series *s, int from, int order)
{
    expand_with_terms(s, from, order, SUPPORT | SHAKES);
}
APART void expand_with_moving_support(kr_series *s, int from, int order)
{
    expand_with_terms(s, from, order, SUPPORT | TURNS | SHAKES);
}
APART void expand_with_gravity_gradient(kr_series *s, int from, int order)
{
    expand_with_terms(s, from, order, SUPPORT | TURNS | GRADIENT);
}
APART void expand_headless_with_support(kr_series *s, int from, int order)
{
    if (s->gradient != 0.0)
        expand_with_terms(s, from, order, SUPPORT | GRADIENT | HEADLESS);
    else
        expand_with_terms(s, from, order, SUPPORT | SHAKES | HEADLESS);
}
INLINE void expand_with_support(kr_series *s, int from, int order, int terms)
{
    if (terms & HEADLESS)
        expand_headless_with_support(s, from, order);
    else if (s->gradient != 0.0)
        expand_with_gravity_gradient(s, from, order);
    else if (s->turns == 0.0)
        expand_with_shaking_support(s, from, order);
    else if (s->shakes == 0.0)
        expand_with_turning_support(s, from, order);
    else
        expand_with_moving_support(s, from, order);
}
#  endif
#endif
/* Computes the coefficients of orders `from` + 1 to `order`, given those of orders 0 to `from`.
 * `terms` is WHOLE or HEADLESS, and the members of `s` determine the other flags. */
INLINE void expand_series(kr_series *s, int from, int order, int terms)
{
    turned_term turned[KR_TAYLOR_MAX + 1];
#if !defined KR_NO_SUPPORTS
    if (s->linear > 1.0) {
        expand_with_support(s, from, order, terms);
        return;
    }
#endif
    if (s->linear != 0.0) {
        expand_damped(s, from, order, terms);
        return;
    }
    permute_coefficients_up_to(s, turned, from, terms);
    add_rotor_terms(s, &turned[0].w);
    UNROLL
    for (int n = from; n < order; n++) set_next_coefficients(s, s, turned, n, terms);
}

/* Writes the sums of s->x[n] * h^(n - from) and s->w[n] * h^(n - from) over n = from, ..., order to
 * sum_x and sum_w. Here, h is the time *to - s->t. Even and odd powers are summed in parallel. */
INLINE void evaluate_terms_over_power(const kr_series *s, int from, int order, const double *to,
                                      double *sum_x, double *sum_w)
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

/* Begins a step at the time s->end, with the values of q, P and W at the end of the last step. */
INLINE void begin_step(kr_series *s)
{
    s->t = s->end;
    duo_store(s->x[0], duo_load(s->end_x));
    quad_store(s->w[0], quad_load(s->end_w));
}
