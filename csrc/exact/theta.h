/* Elliptic integrals, the roots of a cubic, and theta functions as polynomials. A complete integral
 * comes from the arithmetic-geometric mean M, that of the third kind as (DLMF 19.8.6)
 *     Pi(alpha^2, k) = pi/4M (2 + alpha^2/(1 - alpha^2) sum Q_n);
 * an incomplete one of the first kind is Carlson's R_F, by duplication. This header is source that
 * is compiled once per instruction set, because its double-doubles want the fused product. */
#ifndef KR_EXACT_THETA_H
#define KR_EXACT_THETA_H
#include "setup.h"

enum theta { THETA1, THETA2, THETA3, THETA4 };

/* Returns agm(1, kp) and gives the sum of Q_n for each start p0^2 = 1 - alpha^2. At first a = Q = 1
 * and g = kp; a step is
 *     a' = (a + g)/2,   g' = sqrt(a g),   p' = (p^2 + a g)/2p,
 *     Q' = Q e/2,   e = (p^2 - a g)/(p^2 + a g).
 * Every step squares the distances, so the step after they fall below 1e-8 is the last, and needs
 * doubles only. */
static dd elliptic_mean(dd kp, int n, const dd start[], dd sum[])
{
    const double enough = 1e-8;
    dd a = dd_of(1.0), g = kp, p[2], q[2];
    int again = 1;
    double rest = 0.0; /* (a - g)^2 / 4 a^2 at the last step */
    for (int i = 0; i < n; i++) {
        p[i] = start[i]; /* p[i] holds p_n^2. */
        q[i] = sum[i] = dd_of(1.0);
    }
    for (int step = 0; again && step < 100; step++) {
        const dd ag = dd_mul(a, g), mean = dd_half(dd_add(a, g));
        const double apart = dd_half(dd_sub(a, g)).hi / mean.hi;
        again = fabs(apart) > enough;
        for (int i = 0; i < n; i++) {
            const dd both = dd_add(p[i], ag), e = dd_div(dd_sub(p[i], ag), both);
            q[i] = dd_half(dd_mul(q[i], e));
            sum[i] = dd_add(sum[i], q[i]);
            p[i] = dd_scale(0.25, dd_div(dd_square(both), p[i]));
            again |= fabs(e.hi) > enough;
        }
        rest = apart * apart;
        a = mean;
        if (again) g = dd_sqrt(ag);
    }
    /* The last step takes a g = a^2 (1 - rest / 2). */
    for (int i = 0; i < n; i++) {
        const dd square = dd_square(a);
        const double e = (dd_sub(p[i], square).hi + 0.5 * rest * square.hi) / (2.0 * square.hi);
        sum[i] = dd_add(sum[i], dd_times(0.5 * e, q[i]));
    }
    return dd_sub(a, dd_of(0.25 * rest * a.hi));
}
/* Returns agm(a, b) in doubles. */
static double elliptic_agm(double a, double b)
{
    for (int i = 0; i < 40 && fabs(a - b) > 1e-8 * a; i++) {
        const double mean = 0.5 * (a + b);
        b = sqrt(a * b);
        a = mean;
    }
    return 0.5 * (a + b);
}
/* Returns T = numerator / agm(1, k): that is K'/K where the numerator is agm(1, k'), and twice as
 * much, for the square of the nome, where it is 2 agm(1, k'). The dual series multiply a phase by
 * pi / T, hence that is kept in double-double where they serve. */
static inline double theta_stretch(kr_exact *exact, dd numerator, dd k2)
{
    const double T = numerator.hi / elliptic_agm(1.0, sqrt(k2.hi));
    if (T < 1.0) {
        const dd stretch =
            dd_div(dd_mul(dd_pi(), elliptic_mean(dd_sqrt(k2), 0, NULL, NULL)), numerator);
        exact->stretch = stretch.hi;
        exact->stretch_rest = stretch.lo;
    }
    return T;
}
/* Returns Carlson's R_F(x, y, z): duplication brings the arguments together, until the series about
 * their mean is exact to rounding (DLMF 19.26.18, 19.36.1). */
static double elliptic_rf(double x, double y, double z)
{
    double mean = (x + y + z) / 3.0, dx, dy, dz, e2, e3;
    for (int i = 0; i < 60; i++) {
        const double sx = sqrt(x), sy = sqrt(y), sz = sqrt(z), l = sx * (sy + sz) + sy * sz;
        if (fmax(fabs(mean - x), fmax(fabs(mean - y), fabs(mean - z))) < 4e-3 * mean) break;
        x = 0.25 * (x + l);
        y = 0.25 * (y + l);
        z = 0.25 * (z + l);
        mean = 0.25 * (mean + l);
    }
    dx = 1.0 - x / mean;
    dy = 1.0 - y / mean;
    dz = -(dx + dy);
    e2 = dx * dy - dz * dz;
    e3 = dx * dy * dz;
    return (1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0 -
            5.0 * e2 * e2 * e2 / 208.0 + 3.0 * e3 * e3 / 104.0 + e2 * e2 * e3 / 16.0) /
           sqrt(mean);
}

/* Returns the root of x^3 + c2 x^2 + c1 x + c0, all of whose roots are real, that lies farthest
 * from the two others; `top` says whether it is the largest or the smallest. */
static double lone_root(double c2, double c1, double c0, int *top)
{
    const double square = c2 * c2 - 3.0 * c1;
    *top = 1;
    if (!(square > 0.0)) return -c2 / 3.0; /* All are one. */
    const double d = sqrt(square),
                 r = (-2.0 * c2 * c2 * c2 + 9.0 * c2 * c1 - 27.0 * c0) / (2.0 * d * d * d);
    *top = r >= 0.0;
    return (2.0 * d * (*top ? 1.0 : -1.0) * cos(acos(fmin(1.0, fabs(r))) / 3.0) - c2) / 3.0;
}
/* Improves a root of lead x^3 + c[2] x^2 + c[1] x + c[0] from doubles to double-double, by Newton's
 * method. The slope at the start serves for both steps, because it need not be better than that. */
static dd newton_cubic(dd lead, const dd c[3], double start)
{
    const double slope = (3.0 * lead.hi * start + 2.0 * c[2].hi) * start + c[1].hi;
    dd x = dd_of(start);
    for (int i = 0; i < 2 && slope != 0.0; i++) {
        const dd f =
            dd_add(dd_mul(dd_add(dd_mul(dd_add(dd_mul(lead, x), c[2]), x), c[1]), x), c[0]);
        x = dd_sub(x, dd_of(f.hi / slope));
    }
    return x;
}

/* These are sin(2j+1)x / sin x, cos(2j+1)x / cos x, cos 2jx and sin 2jx / (sin x cos x) as
 * polynomials in sin^2 x: row j has the coefficients, from the constant on. */
static const double SIN_ODD[][KR_THETA_TERMS] = {{1}, {3, -4}, {5, -20, 16}, {7, -56, 112, -64}};
static const double COS_ODD[][KR_THETA_TERMS] = {{1}, {1, -4}, {1, -12, 16}, {1, -24, 80, -64}};
static const double COS_EVEN[][KR_THETA_TERMS] = {
    {1}, {1, -2}, {1, -8, 8}, {1, -18, 48, -32}, {1, -32, 160, -256, 128}};
static const double SIN_EVEN[][KR_THETA_TERMS] = {
    {0}, {2}, {4, -8}, {6, -32, 32}, {8, -80, 192, -128}};

static void accumulate(double sum[], double weight, const double term[])
{
    for (int i = 0; i < KR_THETA_TERMS; i++) sum[i] += weight * term[i];
}
/* Returns theta(x + i y) as polynomials in sin^2 x for the real and the imaginary part. Where
 * `dual` is not 0, it returns theta(y + i x), times i for theta1, in the same form with sinh for
 * sine. The common factor 2 nome^(1/4) of theta1 and theta2 is left out. */
static kr_theta theta_series(enum theta which, double nome, double y, int dual)
{
    const int odd = which == THETA1 || which == THETA2;
    const double sign = which == THETA1 || which == THETA4 ? -1.0 : 1.0, way = dual ? -1.0 : 1.0;
    double c1, s1;
    if (dual) {
        sin_cos(y, &s1, &c1);
    } else {
        const double grow = expm1(fabs(y)), part = 0.5 * grow / (1.0 + grow);
        c1 = 1.0 + grow * part;
        s1 = copysign(0.5 * grow + part, y);
    }
    const double c2 = 1.0 + way * 2.0 * s1 * s1, s2 = 2.0 * s1 * c1;
    double c = odd ? c1 : 1.0, s = odd ? s1 : 0.0, weight = 1.0, ratio = odd ? nome * nome : nome;
    kr_theta r = {{0}, {0}};
    for (int j = 0; j < (odd ? KR_THETA_TERMS - 1 : KR_THETA_TERMS); j++) {
        const double twice = !odd && j > 0 ? 2.0 : 1.0, next = c * c2 + way * s * s2;
        if (which == THETA1) {
            accumulate(r.even, dual ? -weight * c : weight * c, SIN_ODD[j]);
            accumulate(r.odd, weight * s, COS_ODD[j]);
        } else {
            accumulate(r.even, twice * weight * c, odd ? COS_ODD[j] : COS_EVEN[j]);
            accumulate(r.odd, -twice * weight * s, odd ? SIN_ODD[j] : SIN_EVEN[j]);
        }
        s = s * c2 + c * s2;
        c = next;
        weight *= sign * ratio;
        ratio *= nome * nome;
    }
    return r;
}
/* Returns the value of a polynomial at s. */
static double theta_at(const double poly[KR_THETA_TERMS], double s)
{
    double r = poly[KR_THETA_TERMS - 1];
    for (int i = KR_THETA_TERMS - 2; i >= 0; i--) r = r * s + poly[i];
    return r;
}
static void theta_scale(kr_theta *series, double factor)
{
    for (int i = 0; i < KR_THETA_TERMS; i++) {
        series->even[i] *= factor;
        series->odd[i] *= factor;
    }
}
#endif
