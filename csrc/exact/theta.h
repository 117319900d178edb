/* Elliptic integrals, roots of cubic polynomials, and theta functions as polynomials. Complete
 * elliptic integrals are computed by the arithmetic-geometric mean M. The integral of the third
 * kind is (DLMF 19.8.6)
 *     Pi(alpha^2, k) = pi/4M (2 + alpha^2/(1 - alpha^2) sum Q_n).
 * Incomplete elliptic integrals of the first kind are computed from Carlson's R_F by
 * duplication. */
#ifndef KR_EXACT_THETA_H
#define KR_EXACT_THETA_H
#include "kernel.h"

enum theta { THETA1, THETA2, THETA3, THETA4 };

/* Returns agm(1, kp) and writes the sum of Q_n for each start p0^2 = 1 - alpha^2. Initially a = Q =
 * 1 and g = kp. A step is
 *     a' = (a + g)/2,   g' = sqrt(a g),   p' = (p^2 + a g)/2p,
 *     Q' = Q e/2,   e = (p^2 - a g)/(p^2 + a g).
 * Each step of the iteration squares the relative differences between its variables. The iteration
 * stops one step after the differences fall below 1e-8; double precision suffices for the last
 * step. */
static inline dd elliptic_mean(dd kp, int n, const dd start[], dd sum[])
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
        const dd ag = dd_mul(a, g), mean = dd_half(dd_add_near(a, g));
        const wide half = 0.5 * ((a.hi - g.hi) + (a.lo - g.lo));
        mask again = wide_more(wide_abs(half), enough * mean.hi);
        for (int i = 0; i < n; i++) {
            const dd both = dd_add_near(p[i], ag), e = dd_over(dd_add_near(p[i], dd_neg(ag)), both);
            q[i] = dd_choose(live, dd_half(dd_mul(q[i], e)), q[i]);
            sum[i] = dd_choose(live, dd_add_near(sum[i], q[i]), sum[i]);
            p[i] = dd_choose(live, dd_scale(0.25, dd_over(dd_square(both), p[i])), p[i]);
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
/* Returns agm(a, b) in double precision. */
static inline wide elliptic_agm(wide a, wide b)
{
    for (mask live; live = wide_more(wide_abs(a - b), 1e-8 * a), mask_any(live);) {
        const wide mean = 0.5 * (a + b);
        b = wide_choose(live, wide_sqrt(a * b), b);
        a = wide_choose(live, mean, a);
    }
    return 0.5 * (a + b);
}
/* Returns T = numerator / agm(1, k). If the numerator is agm(1, k'), T is K'/K. If the series is in
 * powers of the square of the nome, the numerator is 2 agm(1, k'), and T is 2 K'/K. In a dual theta
 * series, the phase is multiplied by pi / T. For dual series, pi / T is stored in double-double
 * precision. */
static inline wide theta_stretch(exact_lanes *exact, dd numerator, dd k2)
{
    const wide T = numerator.hi / elliptic_agm(wide_splat(1.0), wide_sqrt(k2.hi));
    const mask dual = wide_less(T, wide_splat(1.0));
    if (mask_any(dual)) {
        const dd stretch =
            dd_over(dd_mul(dd_pi(), elliptic_mean(dd_sqrt(k2), 0, NULL, NULL)), numerator);
        exact->stretch = wide_choose(dual, stretch.hi, exact->stretch);
        exact->stretch_rest = wide_choose(dual, stretch.lo, exact->stretch_rest);
    }
    return T;
}
/* Returns Carlson's R_F(x, y, z). Duplication stops when the series about the mean of the arguments
 * is accurate to double precision (DLMF 19.26.18, 19.36.1). */
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

/* Returns cos(acos(c) / 3) for 0 <= c <= 1: the largest root of 4 x^3 - 3 x = c, by Newton's method
 * from an approximation with an error of 4e-5. */
static inline wide third_of_angle(wide c)
{
    wide x =
        (0.866066329533 + c * 0.165330350221) + c * c * (-0.0406911974229 + c * 0.00931968389748);
    for (int i = 0; i < 2; i++) {
        const wide xx = x * x;
        x = x - (x * (4.0 * xx - 3.0) - c) / (12.0 * xx - 3.0);
    }
    return x;
}
/* Returns the isolated root of x^3 + c2 x^2 + c1 x + c0, the one farthest from the other two. All
 * three roots must be real up to rounding errors. Sets `top` to 1 if the isolated root is the
 * largest, and to 0 if it is the smallest. */
static inline wide lone_root(wide c2, wide c1, wide c0, mask *top)
{
    const wide zero = wide_splat(0.0), square = c2 * c2 - 3.0 * c1, d = wide_sqrt(square),
               r = (-2.0 * c2 * c2 * c2 + 9.0 * c2 * c1 - 27.0 * c0) / (2.0 * d * d * d);
    const mask apart = is_positive(square); /* else all three roots coincide */
    const wide third = third_of_angle(wide_min(wide_abs(r), wide_splat(1.0)));
    *top = mask_or(mask_not(apart), wide_at_most(zero, r));
    const wide way = minus_where(mask_not(*top));
    return (wide_choose(apart, 2.0 * d * way * third, zero) - c2) * (1.0 / 3);
}
/* Refines a root of lead x^3 + c[2] x^2 + c[1] x + c[0] from double to double-double precision by
 * two Newton steps. Both Newton steps use the slope at the initial guess, which is accurate
 * enough. */
static inline dd newton_cubic(dd lead, const dd c[3], wide start)
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

/* The functions sin(2j+1)x / sin x, cos(2j+1)x / cos x, cos 2jx and sin 2jx / (sin x cos x), as
 * polynomials in sin^2 x. Row j of each table holds the coefficients of one polynomial in ascending
 * order. */
static const double SIN_ODD[][KR_THETA_TERMS] = {{1}, {3, -4}, {5, -20, 16}, {7, -56, 112, -64}};
static const double COS_ODD[][KR_THETA_TERMS] = {{1}, {1, -4}, {1, -12, 16}, {1, -24, 80, -64}};
static const double COS_EVEN[][KR_THETA_TERMS] = {
    {1}, {1, -2}, {1, -8, 8}, {1, -18, 48, -32}, {1, -32, 160, -256, 128}};
static const double SIN_EVEN[][KR_THETA_TERMS] = {
    {0}, {2}, {4, -8}, {6, -32, 32}, {8, -80, 192, -128}};

/* Adds `weight` times row j of a table to `sum`. All coefficients after the j-th in row j of the
 * table are zero. */
static inline void accumulate(wide sum[], wide weight, int j, const double row[])
{
    for (int i = 0; i <= j; i++) sum[i] = sum[i] + weight * row[i];
}
/* Computes sinh y and cosh y to full precision, even for small y. With exp y = 2^k exp r
 *     sinh y = cosh r sinh(k ln 2) + sinh r cosh(k ln 2),   cosh y likewise. */
static inline void sinhcosh_all(wide y, wide *s, wide *c)
{
    const exponential e = exponential_of(dd_of(y));
    const wide even = 0.5 * (e.plus + e.minus), odd = 0.5 * (e.plus - e.minus);
    *s = e.even * odd + e.odd * even;
    *c = e.even * even + e.odd * odd;
}
/* Returns the real and imaginary parts of theta(x + i y) as polynomials in sin^2 x. If `dual`
 * is nonzero, returns theta(y + i x) as polynomials in sinh^2 x instead. In this case, the result
 * for theta1 is also multiplied by i. The common factor 2 nome^(1/4) of theta1 and theta2 is
 * omitted. */
static inline theta_lanes theta_series(enum theta which, wide nome, wide y, int dual)
{
    const int odd = which == THETA1 || which == THETA2;
    const double sign = which == THETA1 || which == THETA4 ? -1.0 : 1.0, way = dual ? -1.0 : 1.0;
    const wide zero = wide_splat(0.0), one = wide_splat(1.0);
    wide c1, s1;
    if (dual)
        sincos_turns(dd_mul(dd_of(y), one_turn()), &s1, &c1);
    else
        sinhcosh_all(y, &s1, &c1);
    const wide c2 = 1.0 + way * 2.0 * s1 * s1, s2 = 2.0 * s1 * c1;
    wide c = odd ? c1 : one, s = odd ? s1 : zero, weight = one, ratio = odd ? nome * nome : nome;
    theta_lanes r;
    for (int i = 0; i < KR_THETA_TERMS; i++) r.even[i] = r.odd[i] = zero;
    for (int j = 0; j < (odd ? KR_THETA_TERMS - 1 : KR_THETA_TERMS); j++) {
        const double twice = !odd && j > 0 ? 2.0 : 1.0;
        const wide next = c * c2 + way * s * s2;
        if (which == THETA1) {
            accumulate(r.even, dual ? -weight * c : weight * c, j, SIN_ODD[j]);
            accumulate(r.odd, weight * s, j, COS_ODD[j]);
        } else {
            accumulate(r.even, twice * weight * c, j, odd ? COS_ODD[j] : COS_EVEN[j]);
            accumulate(r.odd, -twice * weight * s, j, odd ? SIN_ODD[j] : SIN_EVEN[j]);
        }
        s = s * c2 + c * s2;
        c = next;
        weight = weight * (sign * ratio);
        ratio = ratio * (nome * nome);
    }
    return r;
}
/* Returns the value of a polynomial at s. */
static inline wide theta_at(const wide poly[KR_THETA_TERMS], wide s)
{
    wide r = poly[KR_THETA_TERMS - 1];
    for (int i = KR_THETA_TERMS - 2; i >= 0; i--) r = r * s + poly[i];
    return r;
}
static inline void theta_scale(theta_lanes *series, wide factor)
{
    for (int i = 0; i < KR_THETA_TERMS; i++) {
        series->even[i] = series->even[i] * factor;
        series->odd[i] = series->odd[i] * factor;
    }
}
#endif
