/* Complex arithmetic in double (cx_) and double-double (cdd_) precision. C's complex types are not
 * used, because not every C compiler supports them. Square roots are principal values, with
 * nonnegative real part. */
#ifndef KR_EXACT_COMPLEX_H
#define KR_EXACT_COMPLEX_H
#include "math/dd.h"

typedef struct cx {
    double re, im;
} cx;
typedef struct cdd {
    dd re, im;
} cdd;

static inline cx cx_of(double re, double im)
{
    const cx r = {re, im};
    return r;
}
static inline cx cx_add(cx a, cx b) { return cx_of(a.re + b.re, a.im + b.im); }
static inline cx cx_sub(cx a, cx b) { return cx_of(a.re - b.re, a.im - b.im); }
static inline cx cx_scale(double s, cx a) { return cx_of(s * a.re, s * a.im); }
static inline cx cx_mul(cx a, cx b)
{
    return cx_of(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
}
static inline double cx_square(cx a) { return a.re * a.re + a.im * a.im; }
static inline double cx_abs(cx a) { return sqrt(cx_square(a)); }

static inline cdd cdd_of(dd re, dd im)
{
    const cdd r = {re, im};
    return r;
}
static inline cdd cdd_real(dd re) { return cdd_of(re, dd_of(0.0)); }
static inline cx cdd_high(cdd a) { return cx_of(a.re.hi, a.im.hi); }
static inline cdd cdd_neg(cdd a) { return cdd_of(dd_neg(a.re), dd_neg(a.im)); }
static inline cdd cdd_add(cdd a, cdd b) { return cdd_of(dd_add(a.re, b.re), dd_add(a.im, b.im)); }
static inline cdd cdd_sub(cdd a, cdd b) { return cdd_add(a, cdd_neg(b)); }
static inline cdd cdd_scale(dd s, cdd a) { return cdd_of(dd_mul(s, a.re), dd_mul(s, a.im)); }
static inline cdd cdd_mul(cdd a, cdd b)
{
    return cdd_of(dd_sub(dd_mul(a.re, b.re), dd_mul(a.im, b.im)),
                  dd_add(dd_mul(a.re, b.im), dd_mul(a.im, b.re)));
}
static inline dd cdd_square(cdd a) { return dd_add(dd_square(a.re), dd_square(a.im)); }
static inline cdd cdd_div(cdd a, cdd b)
{
    const cdd up = cdd_mul(a, cdd_of(b.re, dd_neg(b.im)));
    const dd down = cdd_square(b);
    return cdd_of(dd_div(up.re, down), dd_div(up.im, down));
}
static inline cdd cdd_sqrt(cdd a)
{
    const dd t = dd_sqrt(dd_half(dd_add(dd_sqrt(cdd_square(a)), dd_abs(a.re))));
    if (t.hi == 0.0) return cdd_real(dd_of(0.0));
    const dd other = dd_half(dd_div(a.im, t));
    if (a.re.hi >= 0.0) return cdd_of(t, other);
    return a.im.hi < 0.0 ? cdd_of(dd_neg(other), dd_neg(t)) : cdd_of(other, t);
}
#endif
