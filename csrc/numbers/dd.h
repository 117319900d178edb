/* Double-double numbers: an unevaluated sum hi + lo of two doubles, about 32 digits. From libc
 * and libm only. Sums and products err by a few 2^-104 (Joldes, Muller, Popescu, ACM Trans. Math.
 * Softw. 44, 2017). They need strict evaluation: -ffp-contract=off, and never -ffast-math. A name
 * that begins with dd_ rounds to a double-double; two_sum and two_product are exact. */
#ifndef KR_DD_H
#define KR_DD_H
#include <math.h>

typedef struct dd {
    double hi, lo;
} dd;

static inline dd dd_make(double hi, double lo)
{
    dd r;
    r.hi = hi, r.lo = lo;
    return r;
}
static inline dd dd_of(double a) { return dd_make(a, 0.0); }
static inline dd dd_neg(dd a) { return dd_make(-a.hi, -a.lo); }
static inline dd dd_abs(dd a) { return a.hi < 0.0 ? dd_neg(a) : a; }

/* Returns a + b exactly, where |a| >= |b|. */
static inline dd two_sum_ordered(double a, double b)
{
    const double sum = a + b;
    return dd_make(sum, b - (sum - a));
}
/* Returns a + b exactly, in any order of their sizes. */
static inline dd two_sum(double a, double b)
{
    const double sum = a + b, v = sum - a;
    return dd_make(sum, (a - (sum - v)) + (b - v));
}
/* Returns a b exactly. Processors with and without a fused product get the same bits, because the
 * rounding error of a product is itself a double. */
static inline dd two_product(double a, double b)
{
    const double product = a * b;
#if defined __FMA__ || defined __aarch64__
    return dd_make(product, fma(a, b, -product));
#else
    /* Veltkamp splits each factor into halves of 26 bits, whose products Dekker adds up. */
    const double split = 134217729.0, p = split * a, q = split * b;
    const double ah = p - (p - a), al = a - ah, bh = q - (q - b), bl = b - bh;
    return dd_make(product, ((ah * bh - product) + ah * bl + al * bh) + al * bl);
#endif
}
static inline dd dd_add(dd a, dd b)
{
    dd s = two_sum(a.hi, b.hi), t = two_sum(a.lo, b.lo);
    s = two_sum_ordered(s.hi, s.lo + t.hi);
    return two_sum_ordered(s.hi, s.lo + t.lo);
}
static inline dd dd_sub(dd a, dd b) { return dd_add(a, dd_neg(b)); }
static inline dd dd_mul(dd a, dd b)
{
    const dd p = two_product(a.hi, b.hi);
    return two_sum_ordered(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}
static inline dd dd_times(double a, dd b)
{
    const dd p = two_product(a, b.hi);
    return two_sum_ordered(p.hi, p.lo + a * b.lo);
}
/* Returns power a exactly, where `power` is a power of two. */
static inline dd dd_scale(double power, dd a) { return dd_make(power * a.hi, power * a.lo); }
static inline dd dd_twice(dd a) { return dd_scale(2.0, a); }
static inline dd dd_half(dd a) { return dd_scale(0.5, a); }
static inline dd dd_square(dd a)
{
    const dd p = two_product(a.hi, a.hi);
    return two_sum_ordered(p.hi, p.lo + 2.0 * (a.hi * a.lo));
}
static inline dd dd_div(dd a, dd b)
{
    const double q = a.hi / b.hi;
    const dd p = two_product(q, b.hi);
    const double rest = ((a.hi - p.hi) - p.lo) + (a.lo - q * b.lo);
    return two_sum_ordered(q, rest / b.hi);
}
/* Returns zero for a <= 0, because an argument below zero is a zero that rounding has moved. */
static inline dd dd_sqrt(dd a)
{
    if (!(a.hi > 0.0)) return dd_of(0.0);
    const double x = sqrt(a.hi);
    const dd p = two_product(x, x);
    return two_sum_ordered(x, (((a.hi - p.hi) - p.lo) + a.lo) / (2.0 * x));
}
static inline int dd_less(dd a, dd b) { return a.hi < b.hi || (a.hi == b.hi && a.lo < b.lo); }
static inline dd dd_max(dd a, dd b) { return dd_less(a, b) ? b : a; }
static inline dd dd_dot(const dd a[3], const dd b[3])
{
    return dd_add(dd_add(dd_mul(a[0], b[0]), dd_mul(a[1], b[1])), dd_mul(a[2], b[2]));
}
static inline dd dd_pi(void) { return dd_make(3.141592653589793116, 1.224646799147353207e-16); }
#endif
