/* Elementary functions and Carlson's R_F in double-double precision. Arguments must be moderate:
 * |a| < 600 for dd_exp, |a| < 4 for dd_sincos. The exponential and trigonometric functions reduce
 * the argument, sum a power series, and undo the reduction by repeated squaring or angle
 * doubling. */
#ifndef KR_DD_FUNCTIONS_H
#define KR_DD_FUNCTIONS_H
#include "dd.h"

/* Returns first (1 + z/a(a+1) + z^2/a(a+1)(a+2)(a+3) + ...) with z = square and a = from. The sum
 * omits all terms that have a factor greater than `to` in the denominator. */
static inline dd dd_series(dd first, int from, int to, dd square)
{
    dd term = first, sum = first;
    for (int i = from; i < to; i += 2) {
        term = dd_div(dd_mul(term, square), dd_of((double)(i * (i + 1))));
        sum = dd_add(sum, term);
    }
    return sum;
}
static inline dd dd_exp(dd a)
{
    const dd ln2 = dd_make(0.693147180559945286227, 2.319046813846299558e-17);
    /* The exponent k is limited to a range outside which 2^k is zero or infinite. If `a` is NaN, so
     * is r, while k is a number. */
    const double k = fmax(-2200.0, fmin(2200.0, rint(a.hi / ln2.hi)));
    const dd r = dd_times(0.03125, dd_sub(a, dd_times(k, ln2))), rr = dd_square(r);
    dd e = dd_add(dd_series(dd_of(1.0), 1, 18, rr), dd_series(r, 2, 18, rr));
    for (int i = 0; i < 5; i++) e = dd_square(e);
    return dd_scale(ldexp(1.0, (int)k), e);
}
static inline void dd_sincos(dd a, dd *s, dd *c)
{
    const dd r = dd_times(0.0625, a), rr = dd_neg(dd_square(r));
    dd sn = dd_series(r, 2, 22, rr), cs = dd_series(dd_of(1.0), 1, 22, rr);
    for (int i = 0; i < 4; i++) {
        const dd twice = dd_twice(dd_mul(sn, cs));
        cs = dd_sub(dd_of(1.0), dd_twice(dd_square(sn)));
        sn = twice;
    }
    *s = sn;
    *c = cs;
}
/* Returns the polar angle of the point (x, y). A single Newton step after atan2 gives double-double
 * accuracy, because the step squares the error. */
static inline dd dd_atan2(dd y, dd x)
{
    const double guess = atan2(y.hi, x.hi);
    const dd r = dd_sqrt(dd_add(dd_square(x), dd_square(y)));
    dd s, c;
    if (!(r.hi > 0.0)) return dd_of(0.0);
    dd_sincos(dd_of(guess), &s, &c);
    return dd_add(dd_of(guess), dd_div(dd_sub(dd_mul(y, c), dd_mul(x, s)), r));
}
/* Returns Carlson's R_F(x, y, z), the symmetric elliptic integral of the first kind. The
 * duplication theorem is applied repeatedly until a short series suffices (DLMF 19.26.18,
 * 19.36.1). */
static inline dd dd_rf(dd x, dd y, dd z)
{
    dd mean = dd_div(dd_add(dd_add(x, y), z), dd_of(3.0));
    for (int i = 0; i < 120; i++) {
        const dd sx = dd_sqrt(x), sy = dd_sqrt(y), sz = dd_sqrt(z);
        const dd l = dd_add(dd_mul(sx, dd_add(sy, sz)), dd_mul(sy, sz));
        if (fmax(fabs(mean.hi - x.hi), fmax(fabs(mean.hi - y.hi), fabs(mean.hi - z.hi))) <
            6e-5 * mean.hi)
            break;
        x = dd_times(0.25, dd_add(x, l));
        y = dd_times(0.25, dd_add(y, l));
        z = dd_times(0.25, dd_add(z, l));
        mean = dd_times(0.25, dd_add(mean, l));
    }
    const dd one = dd_of(1.0), dx = dd_sub(one, dd_div(x, mean)), dy = dd_sub(one, dd_div(y, mean));
    const dd dz = dd_neg(dd_add(dx, dy));
    const dd e2 = dd_sub(dd_mul(dx, dy), dd_square(dz)), e3 = dd_mul(dd_mul(dx, dy), dz);
    const double a = e2.hi, b = e3.hi;
    const double small =
        a * a * (1.0 / 24 - 5.0 / 208 * a) + 3.0 / 104 * b * b - 3.0 / 44 * a * b + a * a * b / 16;
    const dd tail = dd_add(dd_sub(dd_div(e3, dd_of(14.0)), dd_div(e2, dd_of(10.0))), dd_of(small));
    return dd_div(dd_add(one, tail), dd_sqrt(mean));
}
#endif
