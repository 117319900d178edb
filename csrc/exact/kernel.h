/* The state of a plan. Floor 3. One kernel serves one time and many: it has no branch and calls nothing but sqrt, so
 * that compilers turn a loop over times into vectors, and it gives the same bits at every width. */
#ifndef KR_KERNEL_H
#define KR_KERNEL_H
#include "plan.h"

#ifdef __GNUC__
#  define INLINE static inline __attribute__((always_inline))
#else
#  define INLINE static inline
#endif

INLINE double nearest(double x)                      /* |x| < 2^51 */
{
    const double shift = 6755399441055744.0;
    return (x + shift) - shift;
}
/* A phase at time t, plus `extra`, in turns, -1/2 .. 1/2. Its rounding is kept: it would be half of the error. */
INLINE dd fold(const kr_phase *f, dd t, double extra)
{
    const dd p = two_product(t.hi, f->fast), s = two_sum(p.hi - nearest(p.hi), f->start), sum = two_sum(s.hi, extra);
    const double rest = (p.lo + (t.hi * f->slow + t.lo * f->fast)) + (s.lo + sum.lo + f->more);
    const dd r = two_sum(sum.hi, rest);
    return dd_make(r.hi - nearest(r.hi), r.lo);
}
INLINE void sincos_turns(dd x, double *s, double *c)
{
    const double two_pi = 6.283185307179586477, rest = 2.44929359829470635e-16;
    const double j = nearest(4.0 * x.hi), d = x.hi - 0.25 * j;                  /* j = -2 .. 2 quarter turns */
    const dd p = two_product(d, two_pi);
    const double r = p.hi, e = p.lo + (d * rest + x.lo * two_pi), rr = r * r;
    const double sin_r = r + r * rr * (-1.0 / 6 + rr * (1.0 / 120 + rr * (-1.0 / 5040 + rr * (1.0 / 362880 +
        rr * (-1.0 / 39916800 + rr * (1.0 / 6227020800.0 + rr * (-1.0 / 1307674368000.0)))))));
    const double cos_r = 1.0 + rr * (-0.5 + rr * (1.0 / 24 + rr * (-1.0 / 720 + rr * (1.0 / 40320 +
        rr * (-1.0 / 3628800 + rr * (1.0 / 479001600.0 + rr * (-1.0 / 87178291200.0 +
        rr * (1.0 / 20922789888000.0))))))));
    const double sine = sin_r + e * cos_r, cosine = cos_r - e * sin_r;
    const double stay = 1.0 - fabs(j), swap = j * (2.0 - fabs(j));
    *s = stay * sine + swap * cosine;
    *c = stay * cosine - swap * sine;
}
INLINE double power_of_two(double shifted)           /* 2^k from k + 1.5 2^52 */
{
    union { double value; uint64_t bits; } r;
    r.value = shifted;
    r.bits = (r.bits << 52) + 0x3ff0000000000000u;
    return r.value;
}
INLINE void sinhcosh(dd a, double *s, double *c)
{
    const double shift = 6755399441055744.0, up = a.hi * 1.44269504088896340736 + shift, k = up - shift;
    const double r = (a.hi - k * 0.693147180369123816490) - (k * 1.90821492927058770002e-10 - a.lo), rr = r * r;
    const double odd = r + r * rr * (1.0 / 6 + rr * (1.0 / 120 + rr * (1.0 / 5040 + rr * (1.0 / 362880 +
        rr * (1.0 / 39916800 + rr * (1.0 / 6227020800.0))))));
    const double even = 1.0 + rr * (0.5 + rr * (1.0 / 24 + rr * (1.0 / 720 + rr * (1.0 / 40320 +
        rr * (1.0 / 3628800 + rr * (1.0 / 479001600.0))))));
    const double plus = power_of_two(up) * (even + odd), minus = power_of_two(shift - k) * (even - odd);
    *s = 0.5 * (plus - minus);
    *c = 0.5 * (plus + minus);
}
INLINE double poly4(const double a[], double s) { return a[0] + s * (a[1] + s * (a[2] + s * a[3])); }
INLINE double poly5(const double a[], double s) { return a[0] + s * (a[1] + s * (a[2] + s * (a[3] + s * a[4]))); }

typedef struct factors {        /* alpha, beta, horizontal momentum without their phases; the phases [turns] */
    double a_re, a_im, b_re, b_im, h_re, h_im;
    dd first, second;
} factors;

INLINE factors theta_factors(const kr_exact *e, int hyperbolic, int even, dd t)
{
    const dd x = fold(&e->nutation, t, 0.0);
    double s, c, ss, flip = 1.0, z = 0.0;
    factors f;
    if (hyperbolic) {
        const double n = nearest(2.0 * x.hi);
        z = 2.0 * x.hi - n;
        flip = 1.0 - 2.0 * n * n;                           /* theta1 and theta2 change sign from period to period */
        const dd p = two_product(z, e->stretch);
        sinhcosh(dd_make(-p.hi, -(p.lo + (z * e->stretch_rest + 2.0 * x.lo * e->stretch))), &s, &c);
        ss = -s * s;
    } else {
        sincos_turns(x, &s, &c);
        ss = s * s;
    }
    f.a_re = flip * s * poly4(e->alpha.even, ss);
    f.a_im = flip * c * poly4(e->alpha.odd, ss);
    if (even) {
        f.b_re = poly5(e->beta.even, ss);
        f.b_im = s * c * poly5(e->beta.odd, ss);
    } else {
        f.b_re = c * poly4(e->beta.even, ss);
        f.b_im = s * poly4(e->beta.odd, ss);
    }
    if (hyperbolic && even) {
        f.b_re *= flip;
        f.b_im *= flip;
    }
    f.h_re = poly5(e->horizontal.even, ss);
    f.h_im = s * c * poly5(e->horizontal.odd, ss);
    f.first = fold(&e->first, t, hyperbolic ? z * e->slope[0] : 0.0);
    f.second = fold(&e->second, t, hyperbolic ? z * e->slope[1] : 0.0);
    return f;
}
INLINE kr_state kernel(const kr_exact *e, int hyperbolic, int even, dd t)
{
    const factors f = theta_factors(e, hyperbolic, even, t);
    const double n = 1.0 / sqrt(f.a_re * f.a_re + f.a_im * f.a_im + f.b_re * f.b_re + f.b_im * f.b_im);
    double s1, c1, s2, c2, re, im;
    kr_state r;
    sincos_turns(f.first, &s1, &c1);
    sincos_turns(f.second, &s2, &c2);
    r.t = 0.0;
    r.q.w = n * (f.a_re * c1 - f.a_im * s1);
    r.q.x = n * (f.b_re * c2 - f.b_im * s2);
    r.q.y = n * (f.b_re * s2 + f.b_im * c2);
    r.q.z = n * (f.a_re * s1 + f.a_im * c1);
    re = n * e->momentum * (c1 * c2 - s1 * s2);
    im = n * e->momentum * (s1 * c2 + c1 * s2);
    r.m.x = e->constant.x + (f.h_re * re - f.h_im * im);
    r.m.y = e->constant.y + e->side * (f.h_re * im + f.h_im * re);
    r.m.z = e->constant.z;
    return r;
}
#endif
