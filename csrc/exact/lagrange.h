/* Set-up of the closed form of a Lagrange top (kernel.h). Let a be the symmetry axis, u = a.e3 its
 * height, u0 the initial height, lever * u the potential energy, m the angular momentum, I1 the
 * equal moments and W = m / I1. Then
 *     (du/dt)^2 = g (u - u1)(u - u2)(u - u3),  u1 <= u <= u2 <= 1 <= u3,  g = 2 lever / I1.
 * The moduli k and k' are given by k^2 = (u2 - u1)/(u3 - u1) and k'^2 = (u3 - u2)/(u3 - u1). The
 * roots and the rates nu, k1 and k2 are double-doubles. The rates are those of kernel.h if all
 * moments are I1. Another moment about a adds a constant rate to the spin only: half of this rate
 * (lagrange_setup.half_spin) is then added to k1 and subtracted from k2. */
#ifndef KR_EXACT_LAGRANGE_H
#define KR_EXACT_LAGRANGE_H
#include "kernel.h"

enum theta { THETA1, THETA2, THETA3, THETA4 };

/* Returns M = agm(1, kp), which is pi / (2 K) if kp = k'. For each of the n values p_0^2 in
 * `start`, writes the sum S = Q_0 + Q_1 + ... to `sum`. S gives the integral of the third kind
 *     Pi(c, k) = pi / (4 M) (2 + c / (1 - c) S),   c = 1 - p_0^2   (DLMF 19.8.7, c = alpha^2).
 * The iteration starts from means A = 1 and G = kp, p = p_0 and Q = Q_0 = 1. A step replaces
 *     A by (A + G)/2,   G by sqrt(A G),   p by (p^2 + A G) / (2 p),   Q by Q e/2,
 * where e = (p^2 - A G) / (p^2 + A G), and squares the differences between A, G and p, roughly.
 * Once they are below 1e-8 (relative), two more steps suffice; the last is done in doubles. */
static inline dd find_agm_and_sums(dd kp, int n, const dd start[], dd sum[])
{
    const wide enough = wide_splat(1e-8);
    dd a = dd_splat(1.0), g = kp, p[2], q[2];
    mask live = wide_equal(enough, enough);
    wide apart = wide_splat(0.0); /* (a - g)/2 before the latest averaging */
    for (int i = 0; i < n; i++) {
        p[i] = start[i]; /* p[i] holds p_n^2. */
        q[i] = sum[i] = dd_splat(1.0);
    }
    for (int step = 0; mask_any(live) && step < 100; step++) {
        const dd ag = dd_mul(a, g), mean = dd_half(dd_add_sloppy(a, g));
        const wide half = 0.5 * ((a.hi - g.hi) + (a.lo - g.lo));
        mask again = wide_more(wide_abs(half), enough * mean.hi);
        for (int i = 0; i < n; i++) {
            const dd both = dd_add_sloppy(p[i], ag),
                     e = dd_div_fast(dd_add_sloppy(p[i], dd_neg(ag)), both);
            q[i] = dd_choose(live, dd_half(dd_mul(q[i], e)), q[i]);
            sum[i] = dd_choose(live, dd_add_sloppy(sum[i], q[i]), sum[i]);
            p[i] = dd_choose(live, dd_scale(0.25, dd_div_fast(dd_square(both), p[i])), p[i]);
            again = mask_or(again, wide_more(wide_abs(e.hi), enough));
        }
        apart = wide_choose(live, half, apart);
        a = dd_choose(live, mean, a);
        live = mask_and(live, again);
        if (mask_any(live)) g = dd_choose(live, dd_sqrt(ag), g);
    }
    /* The last step uses a g = a^2 (1 - rest / 2), with rest = (apart / a)^2. */
    const wide part = apart / a.hi, rest = part * part;
    for (int i = 0; i < n; i++) {
        const dd square = dd_square(a);
        const wide e = (dd_sub(p[i], square).hi + 0.5 * rest * square.hi) / (2.0 * square.hi);
        sum[i] = dd_add(sum[i], dd_times(0.5 * e, q[i]));
    }
    return dd_sub(a, dd_of(0.25 * rest * a.hi));
}
static inline wide elliptic_agm(wide a, wide b)
{
    for (mask live; live = wide_more(wide_abs(a - b), 1e-8 * a), mask_any(live);) {
        const wide mean = 0.5 * (a + b);
        b = wide_choose(live, wide_sqrt(a * b), b);
        a = wide_choose(live, mean, a);
    }
    return 0.5 * (a + b);
}
/* Returns T = numerator / agm(1, k), given k_square = k^2; the nome is exp(-pi T). For a Lagrange
 * top, the numerator is agm(1, k') and T = K'/K; for a torque-free body, it is 2 agm(1, k'). If T <
 * 1 (dual series), also sets exact->stretch + stretch_rest, a double-double, to pi / T. */
static inline wide find_period_ratio_and_stretch(exact_lanes *exact, dd numerator, dd k_square)
{
    const wide T = numerator.hi / elliptic_agm(wide_splat(1.0), wide_sqrt(k_square.hi));
    const mask dual = wide_less(T, wide_splat(1.0));
    if (mask_any(dual)) {
        const dd stretch = dd_div_fast(
            dd_mul(dd_pi(), find_agm_and_sums(dd_sqrt(k_square), 0, NULL, NULL)), numerator);
        exact->stretch = wide_choose(dual, stretch.hi, exact->stretch);
        exact->stretch_rest = wide_choose(dual, stretch.lo, exact->stretch_rest);
    }
    return T;
}
/* Returns Carlson's R_F(x, y, z). Duplication stops when a series in the relative differences
 * between x, y and z has double precision (DLMF 19.26.18, 19.36.1). */
static inline wide elliptic_rf(wide x, wide y, wide z)
{
    wide mean = (x + y + z) * (1.0 / 3), inverse, dx, dy, dz, e2, e3;
    for (int i = 0; i < 60; i++) {
        const wide most =
            wide_max(wide_abs(mean - x), wide_max(wide_abs(mean - y), wide_abs(mean - z)));
        const mask live = wide_at_most(8e-3 * mean, most);
        if (!mask_any(live)) break;
        const wide sx = wide_sqrt(x), sy = wide_sqrt(y), sz = wide_sqrt(z),
                   l = sx * (sy + sz) + sy * sz;
        x = wide_choose(live, 0.25 * (x + l), x);
        y = wide_choose(live, 0.25 * (y + l), y);
        z = wide_choose(live, 0.25 * (z + l), z);
        mean = wide_choose(live, 0.25 * (mean + l), mean);
    }
    inverse = 1.0 / mean;
    dx = 1.0 - x * inverse;
    dy = 1.0 - y * inverse;
    dz = -(dx + dy);
    e2 = dx * dy - dz * dz;
    e3 = dx * dy * dz;
    const wide squares = e2 * (1.0 / 24 - e2 * (5.0 / 208)) + e3 * (1.0 / 16 * e2 - 3.0 / 44);
    return (1.0 + (e2 * (squares - 1.0 / 10) + e3 * (1.0 / 14 + e3 * (3.0 / 104)))) /
           wide_sqrt(mean);
}

/* Returns cos(acos(c) / 3) for 0 <= c <= 1. This is the largest root of 4 x^3 - 3 x = c, found by
 * two Newton steps from an approximation with an error of 4e-5. */
static inline wide cos_third_of_arc_cosine(wide c)
{
    wide x =
        (0.866066329533 + c * 0.165330350221) + c * c * (-0.0406911974229 + c * 0.00931968389748);
    for (int i = 0; i < 2; i++) {
        const wide xx = x * x;
        x = x - (x * (4.0 * xx - 3.0) - c) / (12.0 * xx - 3.0);
    }
    return x;
}
/* Returns the isolated root of x^3 + c2 x^2 + c1 x + c0: the root farthest from the other two. All
 * roots must be real up to rounding errors. Sets `is_largest` to 1 if the isolated root is the
 * largest, and to 0 if it is the smallest. */
static inline wide find_isolated_cubic_root(wide c2, wide c1, wide c0, mask *is_largest)
{
    const wide zero = wide_splat(0.0), square = c2 * c2 - 3.0 * c1, d = wide_sqrt(square),
               r = (-2.0 * c2 * c2 * c2 + 9.0 * c2 * c1 - 27.0 * c0) / (2.0 * d * d * d);
    const mask apart = is_positive(square); /* else all three roots coincide */
    const wide third = cos_third_of_arc_cosine(wide_min(wide_abs(r), wide_splat(1.0)));
    *is_largest = mask_or(mask_not(apart), wide_at_most(zero, r));
    const wide way = sign_from_mask(mask_not(*is_largest));
    return (wide_choose(apart, 2.0 * d * way * third, zero) - c2) * (1.0 / 3);
}
/* Returns a root of lead x^3 + c[2] x^2 + c[1] x + c[0] in double-double precision, by two Newton
 * steps from its double-precision value `start`. Both steps use the slope at `start`. */
static inline dd refine_cubic_root(dd lead, const dd c[3], wide start)
{
    const wide slope = (3.0 * lead.hi * start + 2.0 * c[2].hi) * start + c[1].hi,
               zero = wide_splat(0.0),
               inverse = wide_choose(wide_equal(slope, zero), zero, 1.0 / slope);
    dd x = dd_of(start);
    for (int i = 0; i < 2; i++) {
        const dd f =
            dd_add(dd_mul(dd_add(dd_mul(dd_add(dd_mul(lead, x), c[2]), x), c[1]), x), c[0]);
        x = dd_sub(x, dd_of(f.hi * inverse));
    }
    return x;
}

/* The functions sin((2j+1)x) / sin x, cos((2j+1)x) / cos x, cos(2jx) and sin(2jx) / (sin x cos x),
 * one for each table, as polynomials in sin^2 x. Row j of a table holds the coefficients of the
 * polynomial for index j in ascending order. */
static const double SIN_ODD[][KR_THETA_TERMS] = {{1}, {3, -4}, {5, -20, 16}, {7, -56, 112, -64}};
static const double COS_ODD[][KR_THETA_TERMS] = {{1}, {1, -4}, {1, -12, 16}, {1, -24, 80, -64}};
static const double COS_EVEN[][KR_THETA_TERMS] = {
    {1}, {1, -2}, {1, -8, 8}, {1, -18, 48, -32}, {1, -32, 160, -256, 128}};
static const double SIN_EVEN[][KR_THETA_TERMS] = {
    {0}, {2}, {4, -8}, {6, -32, 32}, {8, -80, 192, -128}};

/* Adds `weight` times the coefficients in a row of a table to those in `sum`. */
static inline void add_table_row(wide sum[], wide weight, int degree, const double row[])
{
    for (int i = 0; i <= degree; i++) sum[i] = sum[i] + weight * row[i];
}
/* Writes sinh y and cosh y, with full relative precision even for small y, unlike sinhcosh. */
static inline void sinhcosh_accurate(wide y, wide *s, wide *c)
{
    const exponential e = split_exponential(dd_of(y));
    const wide even = 0.5 * (e.plus + e.minus), odd = 0.5 * (e.plus - e.minus);
    *s = e.even * odd + e.odd * even;
    *c = e.even * even + e.odd * odd;
}
/* Returns the theta function `which` of x + i y for constant y, without the factor 2 nome^(1/4) of
 * theta1 and theta2. With the polynomials E (`even`) and O (`odd`) in sin^2 x, it is
 *     theta1: E sin x + i O cos x;             theta2: E cos x + i O sin x;
 *     theta3 and theta4: E + i O sin x cos x.
 * If `dual` is nonzero, it is the function of y + i x, times i for THETA1. Then sinh x, cosh x and
 * -sinh^2 x replace sin x, cos x and sin^2 x in these expressions. */
static inline theta_lanes make_theta_series(enum theta which, wide nome, wide y, int dual)
{
    const int odd = which == THETA1 || which == THETA2;
    const double sign = which == THETA1 || which == THETA4 ? -1.0 : 1.0, way = dual ? -1.0 : 1.0;
    const wide zero = wide_splat(0.0), one = wide_splat(1.0);
    wide c1, s1;
    if (dual)
        sincos_turns(dd_mul(dd_of(y), turns_per_radian()), &s1, &c1);
    else
        sinhcosh_accurate(y, &s1, &c1);
    const wide c2 = 1.0 + way * 2.0 * s1 * s1, s2 = 2.0 * s1 * c1;
    wide c = odd ? c1 : one, s = odd ? s1 : zero, weight = one, ratio = odd ? nome * nome : nome;
    theta_lanes r;
    for (int i = 0; i < KR_THETA_TERMS; i++) r.even[i] = r.odd[i] = zero;
    for (int j = 0; j < (odd ? KR_THETA_TERMS - 1 : KR_THETA_TERMS); j++) {
        const double twice = !odd && j > 0 ? 2.0 : 1.0;
        const wide next = c * c2 + way * s * s2;
        if (which == THETA1) {
            add_table_row(r.even, dual ? -weight * c : weight * c, j, SIN_ODD[j]);
            add_table_row(r.odd, weight * s, j, COS_ODD[j]);
        } else {
            add_table_row(r.even, twice * weight * c, j, odd ? COS_ODD[j] : COS_EVEN[j]);
            add_table_row(r.odd, -twice * weight * s, j, odd ? SIN_ODD[j] : SIN_EVEN[j]);
        }
        s = s * c2 + c * s2;
        c = next;
        weight = weight * (sign * ratio);
        ratio = ratio * (nome * nome);
    }
    return r;
}
static inline wide evaluate_poly(const wide poly[KR_THETA_TERMS], wide s)
{
    wide r = poly[KR_THETA_TERMS - 1];
    for (int i = KR_THETA_TERMS - 2; i >= 0; i--) r = r * s + poly[i];
    return r;
}
static inline void scale_theta(theta_lanes *series, wide factor)
{
    for (int i = 0; i < KR_THETA_TERMS; i++) {
        series->even[i] = series->even[i] * factor;
        series->odd[i] = series->odd[i] * factor;
    }
}

/* Quantities derived from the initial state. u0 is the initial height of the axis a. */
typedef struct initial {
    dd w[3], g;         /* W [T^-1] and g [T^-2] */
    dd w_square;        /* |W|^2 */
    dd a[3];            /* the symmetry axis */
    dd plus, minus;     /* 1 + u0, 1 - u0, computed directly from the quaternion */
    dd sum, difference; /* W.e3 + W.a, W.e3 - W.a */
    dd climb;           /* initial du/dt */
} initial;

/* Distances between the roots u1, u2 and u3, the initial height u0 and the poles u = -1 and 1.
 * Distances from u3 are multiplied by g, because u3 becomes infinite if the torque vanishes. */
typedef struct turning_points {
    dd down, up;                     /* u0 - u1, u2 - u0 */
    dd third;                        /* g (u3 - u0) */
    dd span, g31, g32;               /* u2 - u1, g (u3 - u1), g (u3 - u2) */
    dd plus1, plus2, minus1, minus2; /* 1 + u1, 1 + u2, 1 - u1, 1 - u2 */
    dd plus3, minus3;                /* g (u3 + 1), g (u3 - 1) */
} turning_points;

static inline initial find_initial_quantities(const exact_top *top, dd i1)
{
    const dd i = dd_div_fast(dd_splat(1.0), i1);
    initial s;
    s.minus = find_axis_and_pole_distances(top->q, s.a, &s.plus);
    s.w[0] = dd_times(top->m.x, i);
    s.w[1] = dd_times(top->m.y, i);
    s.w[2] = dd_times(top->m.z, i);
    s.g = dd_twice(dd_mul(top->lever, i));
    const dd h = dd_add(dd_mul(s.w[0], s.a[0]), dd_mul(s.w[1], s.a[1]));
    s.sum = dd_add(dd_mul(s.w[2], s.plus), h);
    s.difference = dd_sub(dd_mul(s.w[2], s.minus), h);
    s.climb = dd_sub(dd_mul(s.w[0], s.a[1]), dd_mul(s.w[1], s.a[0]));
    s.w_square = dd_dot(s.w, s.w);
    return s;
}
/* Replaces the smaller of the distances a and b by product / (third * the larger one), which does
 * not suffer from cancellation. `product` must be a * b * third. Leaves a = b = 0 unchanged. */
static inline void recompute_smaller_factor(dd *a, dd *b, mask is_a_smaller, dd product, dd third)
{
    const dd larger = dd_choose(is_a_smaller, *b, *a),
             smaller = dd_div_fast(product, dd_mul(larger, third));
    const mask known = is_positive(larger.hi); /* else all three heights coincide */
    *a = dd_choose(mask_and(is_a_smaller, known), smaller, *a);
    *b = dd_choose(mask_and(mask_not(is_a_smaller), known), smaller, *b);
}
/* Recomputes distances that suffer from cancellation, from the initial W, a and du/dt:
 *     (W.e3 + W.a)^2 = g (1 + u1)(1 + u2)(1 + u3),   (W.e3 - W.a)^2 = g (1 - u1)(1 - u2)(u3 - 1),
 *     (du/dt)^2 = g (u0 - u1)(u2 - u0)(u3 - u0).
 * These give 1 + u1 and, if the roots were found about u0 (`about_initial`), the smaller of 1 - u2
 * and u3 - 1, else that of u0 - u1 and u2 - u0. Also sets plus2, plus3 and least distances. */
static inline void recompute_small_distances(const initial *s, turning_points *r, int about_initial)
{
    const dd plus = dd_square(s->sum), minus = dd_square(s->difference),
             climb = dd_square(s->climb);
    /* A lower bound on distances, which keeps quotients finite. It is far below rounding errors. */
    const dd level = dd_splat(1e-36);
    if (!about_initial)
        recompute_smaller_factor(&r->up, &r->down, wide_more(r->down.hi, r->up.hi), climb,
                                 r->third);
    r->plus2 = dd_max(dd_add(s->plus, r->up), level);
    r->plus3 = dd_add(r->third, dd_mul(s->g, s->plus));
    r->plus1 = dd_div_fast(plus, dd_mul(r->plus2, r->plus3));
    r->minus1 = dd_max(r->minus1, level);
    if (about_initial)
        recompute_smaller_factor(&r->minus2, &r->minus3,
                                 wide_less(s->g.hi * r->minus2.hi, r->minus3.hi), minus, r->minus1);
    r->span = dd_max(r->span, level);
    r->g32 = dd_max(r->g32, dd_times(wide_splat(1e-150), r->g31));
}
/* Fills r (turning_points). u3 must be the root farthest from the other two. `c` contains the
 * coefficients of (du/dt)^2 = c[0] + c[1] v + c[2] v^2 + g v^3, v = u - u0. This expansion keeps
 * small distances between u0, u1 and u2 accurate. `guess` approximates g (u3 - u0). */
static inline void find_roots_about_initial_height(const initial *s, const dd c[3], wide guess,
                                                   turning_points *r)
{
    const dd scaled[3] = {dd_mul(dd_square(s->g), c[0]), dd_mul(s->g, c[1]), c[2]};
    r->third = refine_cubic_root(dd_splat(1.0), scaled, guess);
    const dd product = dd_div_fast(c[0], r->third),
             b = dd_div_fast(dd_add(dd_mul(s->g, product), c[1]), r->third);
    /* The roots v = u1 - u0 and u2 - u0 solve v^2 - b v - product = 0, where product >= 0. */
    r->span = dd_sqrt(dd_add(dd_square(b), dd_scale(4.0, product)));
    const dd large = dd_half(dd_add(r->span, dd_abs(b))),
             small = dd_choose(is_positive(large.hi), dd_div_fast(product, large), dd_splat(0.0));
    const mask upwards = is_positive(b.hi);
    r->up = dd_choose(upwards, large, small);
    r->down = dd_choose(upwards, small, large);
    r->g31 = dd_add(r->third, dd_mul(s->g, r->down));
    r->g32 = dd_sub(r->third, dd_mul(s->g, r->up));
    r->minus2 = dd_sub(s->minus, r->up);
    r->minus3 = dd_sub(r->third, dd_mul(s->g, s->minus));
    r->minus1 = dd_add(s->minus, r->down);
    recompute_small_distances(s, r, 1);
}
/* Writes all distances to r, if u1 is the root farthest from the other two. The polynomial
 * (du/dt)^2 is expanded in powers of u - 1, because u2 <= 1 <= u3 can coincide only at u = 1 (axis
 * upright). `guess` is an approximation of u1 - u0. */
static inline void find_roots_by_pole_expansion(const initial *s, wide guess, turning_points *r)
{
    const dd wh = dd_add(dd_square(s->w[0]), dd_square(s->w[1]));
    const dd wa = dd_add(dd_mul(s->w[0], s->a[0]), dd_mul(s->w[1], s->a[1]));
    const dd tilt = dd_sub(dd_mul(s->minus, dd_sub(dd_square(s->w[2]), s->g)), dd_mul(s->w[2], wa));
    const dd c[3] = {dd_neg(dd_square(s->difference)), dd_scale(-2.0, dd_add(wh, tilt)),
                     dd_sub(dd_mul(s->g, dd_add(dd_splat(2.0), s->minus)), s->w_square)};
    r->minus1 = dd_neg(refine_cubic_root(s->g, c, guess - s->minus.hi));
    /* The roots s = u2 - 1 and u3 - 1 solve g s^2 + e1 s + e0 = 0, where e0 <= 0. */
    const dd e0 = dd_div_fast(c[0], r->minus1), e1 = dd_div_fast(dd_sub(c[1], e0), r->minus1);
    r->g32 = dd_sqrt(dd_sub(dd_square(e1), dd_scale(4.0, dd_mul(s->g, e0))));
    const dd large = dd_half(dd_add(r->g32, dd_abs(e1))), small = dd_neg(dd_div_fast(e0, large));
    const mask beyond = is_positive(e1.hi);
    r->minus3 = large;
    r->minus2 = dd_choose(is_positive(large.hi), small, dd_splat(0.0));
    if (mask_any(beyond)) {
        r->minus3 = dd_choose(beyond, dd_mul(s->g, small), r->minus3);
        r->minus2 = dd_choose(beyond, dd_div(large, s->g), r->minus2);
    }
    r->third = dd_add(r->minus3, dd_mul(s->g, s->minus));
    r->down = dd_max(dd_sub(r->minus1, s->minus), dd_splat(0.0));
    r->up = dd_max(dd_sub(s->minus, r->minus2), dd_splat(0.0));
    r->span = dd_sub(r->minus1, r->minus2);
    r->g31 = dd_add(r->minus3, dd_mul(s->g, r->minus1));
    recompute_small_distances(s, r, 0);
}
/* Returns the distances between u1, u2, u3, u0 and the poles. (du/dt)^2 is expanded at u0 if u3
 * is the isolated root (u1 and u2 may coincide there), else at u = 1 (u2 and u3 may coincide). */
static turning_points find_turning_point_distances(const initial *s)
{
    /* b is the horizontal part of W x a. */
    const dd b[2] = {dd_sub(dd_mul(s->w[1], s->a[2]), dd_mul(s->w[2], s->a[1])),
                     dd_sub(dd_mul(s->w[2], s->a[0]), dd_mul(s->w[0], s->a[2]))};
    const dd flat = dd_add(dd_square(s->a[0]), dd_square(s->a[1]));
    const dd twist = dd_sub(dd_mul(b[0], s->w[1]), dd_mul(b[1], s->w[0]));
    const dd c[3] = {dd_square(s->climb), dd_neg(dd_add(dd_mul(s->g, flat), dd_twice(twist))),
                     dd_sub(dd_twice(dd_mul(s->g, s->a[2])), s->w_square)};
    mask top;
    const wide guess =
        find_isolated_cubic_root(c[2].hi, s->g.hi * c[1].hi, s->g.hi * s->g.hi * c[0].hi, &top);
    turning_points r, some;
    if (mask_all(top)) {
        find_roots_about_initial_height(s, c, guess, &r);
        return r;
    }
    find_roots_by_pole_expansion(s, guess / s->g.hi, &r);
    if (!mask_any(top)) return r;
    find_roots_about_initial_height(s, c, guess, &some);
    copy_selected_lanes(&r, &some, sizeof r, top);
    return r;
}
/* Writes the rates nu, k1 and k2 (without half_spin) [rad per unit of time]. Returns agm(1, k').
 * Each formula contains the sum S of find_agm_and_sums for the p_0^2 that stands beside it:
 *     k1 = (W.e3 + W.a) / (4 (1 + u3)) S,   p_0^2 = (1 + u3)/(u3 - u1),
 *     k2 = (W.e3 - W.a) / (4 (1 - u3)) S,   p_0^2 = (u3 - 1)/(u3 - u1).
 * If 1 - u2 > u3 - 1, k2 has another formula, with -nu if W.e3 >= W.a, else +nu:
 *     k2 = (W.e3 - W.a) / (2 (1 - u1)) (1 + (u2 - u1) / (2 (1 - u2)) S) -+ nu,
 *     p_0^2 = (1 - u2)/(1 - u1). */
static inline dd find_agm_and_phase_rates(const initial *s, const turning_points *r, dd *nu, dd *k1,
                                          dd *k2)
{
    const dd kp = dd_sqrt(dd_div_fast(r->g32, r->g31)), zero = dd_splat(0.0);
    const mask far = wide_at_most(s->g.hi * r->minus2.hi, r->minus3.hi);
    const dd p[2] = {
        dd_div_fast(r->plus3, r->g31),
        dd_div_fast(dd_choose(far, r->minus3, r->minus2), dd_choose(far, r->g31, r->minus1))};
    dd sum[2], mean = find_agm_and_sums(kp, 2, p, sum);
    *nu = dd_mul(dd_half(dd_sqrt(r->g31)), mean);
    *k1 = dd_div_fast(dd_mul(dd_mul(s->sum, s->g), sum[0]), dd_scale(4.0, r->plus3));
    *k2 = zero;
    if (mask_any(far)) {
        const dd rate =
            dd_div_fast(dd_mul(dd_mul(s->difference, s->g), sum[1]), dd_scale(-4.0, r->minus3));
        *k2 = dd_choose(is_positive(r->minus3.hi), rate, zero);
    }
    if (!mask_all(far)) {
        const dd extra = dd_half(dd_mul(dd_div_fast(r->span, r->minus2), sum[1]));
        const dd rate =
            dd_div_fast(dd_mul(dd_half(s->difference), dd_add(dd_splat(1.0), extra)), r->minus1);
        const dd wound = dd_choose(is_negative(s->difference.hi), *nu, dd_neg(*nu));
        *k2 = dd_choose(far, *k2, dd_add(rate, wound));
    }
    return mean;
}
/* The imaginary parts y1 and y2 in the arguments of theta1 and theta2 (kernel.h), and T = K'/K. */
typedef struct arguments {
    wide y1, y2, T;
} arguments;

/* Returns T = K'/K, y1 and y2. |y1| and |y2| are `average`, which is agm(1, k'), times elliptic
 * integrals. y1 is negative if W.e3 + W.a >= 0, y2 if W.e3 - W.a >= 0. If T < 1, sets `stretch`. */
static inline arguments find_theta_imaginary_parts(exact_lanes *exact, const initial *s,
                                                   const turning_points *r, dd average)
{
    const wide third = r->g31.hi, mean = average.hi, one = wide_splat(1.0);
    const dd k2 = dd_max(dd_div_fast(dd_mul(s->g, r->span), r->g31), dd_splat(1e-36));
    const wide d = r->span.hi, p1 = r->plus1.hi, p2 = r->plus2.hi, m1 = r->minus1.hi,
               m2 = r->minus2.hi, per_m32 = 1.0 / (m1 * r->g32.hi);
    const wide b1 = wide_sqrt(p1) * elliptic_rf(d, d * r->plus3.hi / third, p2);
    const wide b2 = wide_sqrt(m2 * third * per_m32) *
                    elliptic_rf(d * r->minus3.hi * per_m32, d * r->g32.hi * per_m32, one);
    arguments a;
    a.T = find_period_ratio_and_stretch(exact, average, k2);
    const wide limit = 1.57079632679489661923 * a.T;
    a.y1 = -sign_from_mask(is_negative(s->sum.hi)) * wide_min(mean * b1, limit);
    a.y2 = -sign_from_mask(is_negative(s->difference.hi)) * wide_min(mean * b2, limit);
    return a;
}
/* Sets the theta series, in powers of the dual nome if `dual` is nonzero, else of the nome. Their
 * scales make max |alpha / theta4(X)| : max |beta / theta4(X)| = sqrt(1 + u2) : sqrt(1 - u1). */
static inline void set_theta_series_of_kind(exact_lanes *exact, const turning_points *r,
                                            const arguments *a, int dual)
{
    const double pi = 3.14159265358979323846;
    const wide kp = wide_sqrt(r->g32.hi / r->g31.hi), zero = wide_splat(0.0),
               shrink = dual ? 1.0 / a->T : wide_splat(1.0);
    const exponential e = split_exponential(dd_of(-pi * (dual ? shrink : a->T)));
    const wide nome = e.plus * (e.even + e.odd), y1 = a->y1 * shrink, y2 = a->y2 * shrink;
    const wide high = wide_sqrt(0.5 * r->plus2.hi), low = wide_sqrt(0.5 * r->minus1.hi);
    exact->curve = wide_splat(dual ? LAGRANGE_DUAL : LAGRANGE);
    exact->slope[0] = y1 * (-1.0 / pi);
    exact->slope[1] = y2 * (-1.0 / pi);
    exact->alpha = make_theta_series(THETA1, nome, y1, dual);
    exact->beta = make_theta_series(dual ? THETA4 : THETA2, nome, y2, dual);
    exact->horizontal = make_theta_series(THETA3, nome, y1 + y2, dual);
    if (dual) {
        const theta_lanes pole = make_theta_series(THETA4, nome, y1, 1);
        const wide quarter = wide_sqrt(wide_sqrt(nome));
        scale_theta(&exact->alpha,
                    high * 2.0 * quarter / wide_sqrt(kp) / evaluate_poly(pole.even, zero));
        scale_theta(&exact->beta, low / evaluate_poly(exact->beta.even, zero));
    } else {
        scale_theta(&exact->alpha, high / evaluate_poly(exact->alpha.even, wide_splat(1.0)));
        scale_theta(&exact->beta, low * wide_sqrt(kp) / evaluate_poly(exact->beta.even, zero));
    }
}
static inline void set_theta_series(exact_lanes *exact, const turning_points *r, const arguments *a)
{
    const mask dual = wide_less(a->T, wide_splat(1.0));
    if (mask_all(dual)) {
        set_theta_series_of_kind(exact, r, a, 1);
        return;
    }
    if (mask_any(dual)) {
        exact_lanes some = *exact;
        set_theta_series_of_kind(&some, r, a, 1);
        set_theta_series_of_kind(exact, r, a, 0);
        copy_selected_lanes(exact, &some, sizeof some, dual);
    } else
        set_theta_series_of_kind(exact, r, a, 0);
}
/* Sets exact->momentum, the factor of theta3 in m_x + i m_y, from the lowest position of the axis
 * (X = 0), where |m_x + i m_y| is largest. The factor is at most 0: at X = 0, theta3 is positive,
 * but (m_x + i m_y) e^{-i(c1 + c2 + (k1 + k2) t)} is at most 0. */
static inline void set_momentum_scale(exact_lanes *exact, const initial *s, const turning_points *r,
                                      wide i1)
{
    const wide way =
        sign_from_mask(is_negative(s->sum.hi)) * sign_from_mask(is_negative(s->difference.hi));
    const wide lowest = -0.5 * (wide_sqrt(r->minus1.hi * r->plus2.hi * r->plus3.hi) -
                                way * wide_sqrt(r->plus1.hi * r->minus2.hi * r->minus3.hi));
    wide f[6];
    set_initial_phase(&exact->nutation, dd_splat(0.0));
    evaluate_alpha_beta_momentum(exact, 0.0, f);
    const wide norm = f[0] * f[0] + f[1] * f[1] + f[2] * f[2] + f[3] * f[3];
    exact->momentum = i1 * lowest * wide_sqrt(norm) / length(f[4], f[5]);
}
/* Returns the absolute value of the initial phase of the nutation, in turns. The phase is 0 at the
 * lowest and 1/4 at the highest position of the axis, and is computed from the distance to the
 * nearer one. A nutation takes half a turn. `mean` is agm(1, k'). */
static inline dd find_initial_phase_magnitude(const turning_points *r, wide mean)
{
    const wide zero = wide_splat(0.0), one = wide_splat(1.0), per_span = 1.0 / r->span.hi,
               per_g31 = 1.0 / r->g31.hi, low = r->down.hi * per_span;
    const wide high =
        wide_max(r->up.hi * per_span, wide_choose(is_positive(r->down.hi), zero, one));
    const wide dn = r->third.hi * per_g31, kp = r->g32.hi * per_g31, per_dn = 1.0 / dn,
               turn = mean * (1.0 / 6.283185307179586477);
    const mask below = wide_at_most(low * dn, high);
    const wide away = turn * wide_sqrt(wide_choose(below, low, high * per_dn)) *
                      elliptic_rf(wide_choose(below, high, kp * low * per_dn),
                                  wide_choose(below, dn, kp * per_dn), one);
    return dd_choose(below, dd_of(away), two_sum(wide_splat(0.25), -away));
}
/* Sets the initial phases of nutation, alpha and beta, such that alpha and beta have the arguments
 * given by the initial attitude. Let A, B and H be |alpha|^2, |beta|^2 and |m_x + i m_y|^2, each
 * divided by its maximum. Arguments of small numbers are inaccurate. If A < min(B, H/4), the phase
 * of alpha is computed as arg(m_x + i m_y) - arg(-theta3) minus the phase of beta. Otherwise, if B
 * < H/4, the phase of beta is computed as the same difference minus the phase of alpha. */
static inline void set_initial_phases(exact_lanes *exact, const initial *s, const turning_points *r,
                                      wide i1, wide mean, const exact_top *top)
{
    const dd *p = top->q, here = find_initial_phase_magnitude(r, mean);
    const wide zero = wide_splat(0.0);
    const wide alpha = p[0].hi * p[0].hi + p[3].hi * p[3].hi,
               beta = p[1].hi * p[1].hi + p[2].hi * p[2].hi, per_all = 2.0 / (alpha + beta);
    const wide mh = top->m.x * top->m.x + top->m.y * top->m.y;
    const wide top_square =
        s->w[0].hi * s->w[0].hi + s->w[1].hi * s->w[1].hi + s->g.hi * r->down.hi;
    /* The squared magnitudes of alpha, beta and m_x + i m_y, relative to their maxima. */
    const wide of_first = alpha * per_all / r->plus2.hi, of_second = beta * per_all / r->minus1.hi,
               of_both = wide_choose(is_positive(mh), mh / (i1 * i1 * top_square), zero);
    wide f[6];
    set_initial_phase(&exact->nutation, dd_choose(is_negative(s->climb.hi), dd_neg(here), here));
    evaluate_alpha_beta_momentum(exact, 0.0, f);
    const dd both =
        angle_between_in_turns(-f[4], -f[5], top->m.x, top->m.y); /* exact->momentum <= 0 */
    const dd first = angle_between_in_turns(f[0], f[1], p[0].hi, p[3].hi);
    const dd second = angle_between_in_turns(f[2], f[3], p[1].hi, p[2].hi);
    const mask least = wide_less(of_first, of_second);
    const mask by_second = mask_and(least, wide_less(4.0 * of_first, of_both)),
               by_first = mask_and(mask_not(least), wide_less(4.0 * of_second, of_both));
    set_initial_phase(&exact->first, dd_choose(by_second, dd_sub(both, second), first));
    set_initial_phase(&exact->second, dd_choose(by_first, dd_sub(both, first), second));
}
/* Returns 1 if the symmetry axis stays vertical. Tops whose axis is almost but not exactly vertical
 * and almost at rest have been refused before (is_fall_time_computable in symmetric.c). */
static inline mask has_stationary_vertical_axis(const initial *s)
{
    const wide least = wide_splat(1e-150), wh = s->w[0].hi * s->w[0].hi + s->w[1].hi * s->w[1].hi;
    return mask_and(wide_at_most(wh, least * (s->w_square.hi + s->g.hi)),
                    wide_at_most(wide_min(s->plus.hi, s->minus.hi), least));
}
typedef struct lagrange_setup {
    exact_lanes exact;
    exact_top top;
    dd i1, half_spin; /* I1; <m, a> (1/I3 - 1/I1) / 2, to be added to k1 and subtracted from k2 */
    initial start;
    turning_points heights;
    dd mean, nu, k1, k2; /* see find_agm_and_phase_rates */
    arguments at;
} lagrange_setup;

/* Sets i1, half_spin and start from s->top. All other stages of the set-up depend on them. */
static void set_initial_quantities(lagrange_setup *s)
{
    s->i1 = find_equatorial_moment(&s->top);
    s->start = find_initial_quantities(&s->top, s->i1);
    const dd axial = dd_half(dd_sub(s->start.sum, s->start.difference)),
             ratio = dd_div_fast(s->i1, dd_of(s->top.inertia.z));
    s->half_spin = dd_half(dd_mul(dd_sub(ratio, dd_splat(1.0)), axial));
}
static void set_phases_and_mean_rates(lagrange_setup *s)
{
    const dd first = dd_add(s->k1, s->half_spin), second = dd_sub(s->k2, s->half_spin);
    exact_lanes *exact = &s->exact;
    set_momentum_scale(exact, &s->start, &s->heights, s->i1.hi);
    exact->nutation = make_phase(s->nu);
    exact->first = make_phase(first);
    exact->second = make_phase(second);
    set_initial_phases(exact, &s->start, &s->heights, s->i1.hi, s->mean.hi, &s->top);
    set_period_and_mean_rates(exact, s->nu.hi, first.hi, second.hi);
}
/* Computes the closed forms of n tops in internal units, after set_initial_quantities for each top.
 * s[i].top.lever must be positive, and the axis must not stay vertical. Each stage is completed for
 * all tops before the next: the code of all stages does not fit into the first-level cache. */
INLINE void set_up_tops_with_moving_axis(lagrange_setup s[], int n)
{
    for (int i = 0; i < n; i++) s[i].heights = find_turning_point_distances(&s[i].start);
    for (int i = 0; i < n; i++)
        s[i].mean =
            find_agm_and_phase_rates(&s[i].start, &s[i].heights, &s[i].nu, &s[i].k1, &s[i].k2);
    for (int i = 0; i < n; i++) {
        memset(&s[i].exact, 0, sizeof s[i].exact);
        s[i].exact.constant.z = s[i].top.m.z;
        s[i].exact.side = wide_splat(1.0);
        s[i].at = find_theta_imaginary_parts(&s[i].exact, &s[i].start, &s[i].heights, s[i].mean);
    }
    for (int i = 0; i < n; i++) set_theta_series(&s[i].exact, &s[i].heights, &s[i].at);
    for (int i = 0; i < n; i++) set_phases_and_mean_rates(&s[i]);
}
#endif
