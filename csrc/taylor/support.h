/* Taylor series for tops with dry friction or on a support that rotates or shakes. The equations
 * are those of taylor.h with
 *     q' = q U / 2,   P' = P x U,   O' = O x U,   U = W - O
 *     A W' = (AW + h) x W + G P x c - D U + (torque of friction) a
 *
 * O is the angular velocity of the support, and U is the angular velocity of the body relative to
 * the support. All vectors, including the apex a, are in the body frame. The effective gravity G =
 * base + sway cos(...) is the acceleration along -e3 divided by a constant acceleration, by which
 * the lever arm c is multiplied. This source file is included by series.h, and is compiled in
 * double and in double-double precision. Lane 0 of the SIMD vector W holds the friction variable.
 * While the top slides, the friction variable is the spin <U, a>. While friction holds the top, the
 * friction variable is the friction torque relative to its maximum. For a top without friction,
 * lane 0 of the vector W is not used. */

/* Auxiliary Taylor series: the relative angular velocity is stored in `w`, and the effective
 * gravity in all SIMD lanes of `x`. In double-double precision, `words` consists of one struct of
 * high words and one struct of low words. */
typedef struct {
    kr_series words[2];
} support_series;
/* Taylor coefficients of W, U, O and P with cyclically permuted components. The cyclic permutations
 * of U are stored in the order (next | prev), and those of O and P in the order (prev | next). The
 * permuted coefficients of P are used only if the attitude is not computed (HEADLESS). */
typedef struct {
    turned_vector w;
    duo u, o, p;
} turned_support;
/* The n-th coefficients of all products of Taylor series, including O x U and G P. */
typedef struct {
    series_sums plain;
    duo turned, pulled;
} support_sums;

INLINE void add_support_term(support_sums *a, const kr_series *s, const kr_series *own,
                             const turned_support *of, int j, int m, form what, int turns,
                             int shakes)
{
    const duo x = duo_load(s->x[m]), u = turns ? of[j].u : of[j].w.ahead;
    if (what == HEADLESS) {
        a->plain.p = duo_fma(u, of[m].p, a->plain.p);
    } else {
        a->plain.i = duo_fma(duo_lane_of(u, own->w[j], 1), x, a->plain.i);
        a->plain.j = duo_fma(duo_lane_of(u, own->w[j], 2), x, a->plain.j);
        a->plain.k = duo_fma(duo_lane_of(u, own->w[j], 3), x, a->plain.k);
    }
    if (turns) a->turned = duo_fma(u, of[m].o, a->turned);
    if (shakes) a->pulled = duo_fma(duo_load(own->x[j]), x, a->pulled);
}
/* Adds the products of Taylor coefficients with indices (j, m) to `a`, and those with indices (m,
 * j) to `b`. */
INLINE void add_support_pair(support_sums *a, support_sums *b, const kr_series *s,
                             const kr_series *own, const turned_support *of, int j, int m,
                             form what, int turns, int shakes)
{
    add_support_term(a, s, own, of, j, m, what, turns, shakes);
    add_support_term(b, s, own, of, m, j, what, turns, shakes);
    a->plain.cross = duo_fma(of[j].w.ahead, of[m].w.behind, a->plain.cross);
}
/* Returns the n-th coefficients of all products of Taylor series in the equations of motion. The
 * terms of each sum are added in the same order as in cauchy_products. */
INLINE support_sums support_products(const kr_series *s, const kr_series *own,
                                     const turned_support *of, int n, form what, int turns,
                                     int shakes)
{
    const duo zero = duo_splat(0.0);
    const series_sums none = {zero, zero, zero, zero, zero};
    support_sums a = {none, zero, zero}, b = a;
    if (n % 2 == 0) {
        add_support_term(&a, s, own, of, n / 2, n / 2, what, turns, shakes);
        a.plain.cross = half_square(s, of[n / 2].w, n / 2);
    }
    UNROLL
    for (int j = (n - 1) / 2; j > 0; j--)
        add_support_pair(&a, SIDE_BY_SIDE ? &b : &a, s, own, of, n - j, j, what, turns, shakes);
    if (SIDE_BY_SIDE) {
        add_chains(&a.plain, &b.plain, what);
        if (turns) a.turned = duo_add(a.turned, b.turned);
        if (shakes) a.pulled = duo_add(a.pulled, b.pulled);
    }
    if (n > 0) add_support_pair(&a, &a, s, own, of, n, 0, what, turns, shakes);
    return a;
}
/* Returns the next coefficient of the support's angular velocity in the body frame. */
INLINE quad turning_rates(duo turned, int n)
{
    return quad_fma(quad_inverse(-n), duo_lo(turned), quad_mul(quad_inverse(n), duo_hi(turned)));
}
/* Returns the dot product of lanes 1 to 3 of two vectors, copied to every lane. */
INLINE quad dot_lanes(kr_series *own, quad a, quad b)
{
    quad_store(own->end_w, quad_mul(a, b));
    const quad x = duo_lo(duo_lane(own->end_w, 1)), y = duo_lo(duo_lane(own->end_w, 2));
    return quad_add(duo_lo(duo_lane(own->end_w, 3)), quad_add(x, y));
}
/* Stores a number in SIMD lane 0 of the vector that holds the n-th coefficient of the angular
 * velocity. The vector `number` must hold the same value in all SIMD lanes. */
INLINE void set_lane0(kr_series *s, kr_series *own, int n, quad number)
{
    quad_store(own->end_w, number);
    copy_number(s->w[n], own->end_w);
}
/* Adds to coefficient n + 1 of W the effect of the friction torque that keeps the spin constant,
 * and returns the sum. */
INLINE quad hold_spin(kr_series *s, kr_series *own, int n, quad w, quad o)
{
    const quad minus = quad_splat(-1.0), gained = quad_fma(minus, o, w),
               lost = quad_mul(minus, dot_lanes(own, gained, quad_load(s->apex)));
    const quad torque = quad_mul(duo_lo(duo_lane(&s->per_grip, 0)), lost);
    set_lane0(s, own, n, quad_mul(quad_splat((double)(n + 1)), torque));
    return quad_fma(lost, quad_load(s->yield), w);
}
/* Returns the next Taylor coefficient of the angular velocity, given the coefficient `p` of the
 * effective gravity vector. */
INLINE quad support_velocity(const support_sums *a, const kr_series *s, const kr_series *own, int n,
                             quad p)
{
    const quad share = quad_inverse(n + 1),
               drag = quad_mul(quad_mul(share, quad_load(s->drag)), quad_load(own->w[n])),
               other = n == 0 ? quad_add(drag, quad_load(s->rub)) : drag,
               up = quad_fma(quad_mul(share, quad_load(s->up)), quad_next(p), other),
               torque = quad_fma(quad_mul(share, quad_load(s->down)), quad_prev(p), up);
    return quad_fma(quad_mul(share, quad_load(s->k)),
                    quad_add(duo_lo(a->plain.cross), duo_hi(a->plain.cross)), torque);
}
/* Stores the n-th Taylor coefficients of the angular velocities of the top and of its support. For
 * a sliding top, also stores the n-th coefficient of the spin, unless `is_known` is nonzero. */
INLINE void set_velocities(kr_series *s, kr_series *own, turned_support *of, int n, quad w, quad o,
                           int turns, int is_known)
{
    const quad u = turns ? quad_fma(quad_splat(-1.0), o, w) : w;
    quad_store(own->w[n], u);
    if (turns) {
        of[n].u = duo_next_prev(u);
        of[n].o = duo_prev_next(o);
    }
    set_turned(s->w[n], &of[n].w, w);
    if (s->slides != 0.0 && !is_known) set_lane0(s, own, n, dot_lanes(own, u, quad_load(s->apex)));
}
/* Computes the Taylor coefficients of the effective gravity, which is a constant plus a cosine. */
INLINE void set_acceleration(const kr_series *s, kr_series *own, int order)
{
    duo cosine = duo_lane(s->sway, 0), sine = duo_lane(s->sway, 1);
    duo_store(own->x[0], duo_add(cosine, duo_lane(s->sway, 3)));
    for (int n = 1; n < order; n++) {
        const duo rate = duo_mul(duo_inverse(n), duo_lane(s->sway, 2)),
                  next = duo_mul(rate, cosine);
        cosine = duo_mul(duo_splat(-1.0), duo_mul(rate, sine));
        sine = next;
        duo_store(own->x[n], cosine);
    }
}
/* Stores the permuted n-th coefficient of the vertical P, which is needed if the attitude is not
 * computed. */
INLINE void turn_vertical(const kr_series *s, turned_support *of, int n)
{
    of[n].p = duo_prev_next(quad_load(s->x[n] + 4));
}
/* Computes the (n + 1)-th coefficients of the support motion from known coefficients of the top's
 * motion. */
INLINE void next_known_coefficient(kr_series *s, kr_series *own, turned_support *of, int n,
                                   form what, int turns)
{
    duo turned = duo_splat(0.0);
    if (turns)
        for (int j = 0; j <= n; j++) turned = duo_fma(of[j].u, of[n - j].o, turned);
    if (what == HEADLESS) turn_vertical(s, of, n + 1);
    set_velocities(s, own, of, n + 1, quad_load(s->w[n + 1]), turning_rates(turned, n + 1), turns,
                   1);
}
/* Computes the Taylor coefficients of order n + 1 for a top with friction or on a moving
 * support. */
INLINE void next_support_coefficient(kr_series *s, kr_series *own, turned_support *of, int n,
                                     form what, int turns, int shakes)
{
    const support_sums a = support_products(s, own, of, n, what, turns, shakes);
    const quad o = turns ? turning_rates(a.turned, n + 1) : quad_splat(0.0);
    const quad vertical = what == HEADLESS ? quad_load(s->x[n] + 4) : duo_hi(duo_load(s->x[n]));
    quad w = support_velocity(&a, s, own, n, shakes ? duo_hi(a.pulled) : vertical);
    if (s->holds != 0.0) w = hold_spin(s, own, n, w, o);
    if (what == HEADLESS) {
        quad_store(s->x[n + 1] + 4, vertical_rates(&a.plain, n + 1));
        turn_vertical(s, of, n + 1);
    } else
        duo_store(s->x[n + 1], attitude_rates(&a.plain, duo_inverse(n + 1)));
    set_velocities(s, own, of, n + 1, w, o, turns, 0);
}
/* Computes the Taylor coefficients of orders `from` + 1 to `order`. */
INLINE void expand_support_form(kr_series *s, int from, int order, form what, int turns, int shakes)
{
    support_series series;
    kr_series *own = series.words;
    turned_support of[KR_TAYLOR_MAX + 1];
    if (shakes) set_acceleration(s, own, order);
    if (what == HEADLESS) turn_vertical(s, of, 0);
    set_velocities(s, own, of, 0, quad_load(s->w[0]), quad_load(s->turn), turns, from > 0);
    for (int n = 0; n < from; n++) next_known_coefficient(s, own, of, n, what, turns);
    add_rotor(s, &of[0].w);
    for (int n = from; n < order; n++) next_support_coefficient(s, own, of, n, what, turns, shakes);
}
#if defined KR_LONG_FUNCTIONS
APART void expand_moving(kr_series *s, int from, int order)
{
    expand_support_form(s, from, order, WHOLE, s->turns != 0.0, s->shakes != 0.0);
}
/* Computes the Taylor coefficients of orders `from` + 1 to `order` for a top with friction or on a
 * moving support. */
INLINE void expand_support(kr_series *s, int from, int order, form what)
{
    (void)what;
    expand_moving(s, from, order);
}
#else
APART void expand_turning(kr_series *s, int from, int order)
{
    expand_support_form(s, from, order, WHOLE, 1, 0);
}
APART void expand_shaking(kr_series *s, int from, int order)
{
    expand_support_form(s, from, order, WHOLE, 0, 1);
}
APART void expand_moving(kr_series *s, int from, int order)
{
    expand_support_form(s, from, order, WHOLE, 1, 1);
}
APART void expand_support_headless(kr_series *s, int from, int order)
{
    expand_support_form(s, from, order, HEADLESS, 0, 1);
}
/* Computes the Taylor coefficients of orders `from` + 1 to `order` for a top with friction or on a
 * moving support. */
INLINE void expand_support(kr_series *s, int from, int order, form what)
{
    if (what == HEADLESS)
        expand_support_headless(s, from, order);
    else if (s->turns == 0.0)
        expand_shaking(s, from, order);
    else if (s->shakes == 0.0)
        expand_turning(s, from, order);
    else
        expand_moving(s, from, order);
}
#endif
