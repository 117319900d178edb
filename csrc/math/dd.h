/* Double-double numbers: unevaluated sums hi + lo of two doubles, with about 32 digits, where hi is
 * the double nearest to the sum. The relative errors of dd_add and dd_mul are at most small
 * multiples of 2^-104 (Joldes, Muller, Popescu, ACM TOMS 44, 2017). All functions assume that no
 * intermediate result overflows or underflows. They require strict floating-point evaluation:
 * compile with -ffp-contract=off, and never with -ffast-math. If KR_DD_LANES is defined, hi and lo
 * are SIMD vectors (simd.h), and each lane is bitwise equal to the result for scalars. */
#ifndef KR_DD_H
#define KR_DD_H
#include <math.h>
#include "isa.h"

/* dd_word is the type of hi and lo: double, or a SIMD vector of doubles. dd_truth is the type of
 * comparison results: int, or a SIMD mask with one Boolean value per lane. */
#if defined KR_DD_LANES
#  include "simd.h"
typedef wide dd_word;
typedef mask dd_truth;
static inline dd_word word_of(double a) { return wide_splat(a); }
static inline dd_word word_sqrt(dd_word a) { return wide_sqrt(a); }
static inline dd_word word_fma(dd_word a, dd_word b, dd_word c) { return wide_fma(a, b, c); }
static inline dd_truth word_less(dd_word a, dd_word b) { return wide_less(a, b); }
static inline dd_truth word_equal(dd_word a, dd_word b) { return wide_equal(a, b); }
static inline dd_truth truth_and(dd_truth a, dd_truth b) { return mask_and(a, b); }
static inline dd_truth truth_or(dd_truth a, dd_truth b) { return mask_or(a, b); }
static inline dd_word word_choose(dd_truth m, dd_word yes, dd_word no)
{
    return wide_choose(m, yes, no);
}
#else
typedef double dd_word;
typedef int dd_truth;
static inline dd_word word_of(double a) { return a; }
static inline dd_word word_sqrt(dd_word a) { return sqrt(a); }
static inline dd_word word_fma(dd_word a, dd_word b, dd_word c) { return fma(a, b, c); }
static inline dd_truth word_less(dd_word a, dd_word b) { return a < b; }
static inline dd_truth word_equal(dd_word a, dd_word b) { return a == b; }
static inline dd_truth truth_and(dd_truth a, dd_truth b) { return a && b; }
static inline dd_truth truth_or(dd_truth a, dd_truth b) { return a || b; }
static inline dd_word word_choose(dd_truth m, dd_word yes, dd_word no) { return m ? yes : no; }
#endif

typedef struct dd {
    dd_word hi, lo;
} dd;

static inline dd dd_make(dd_word hi, dd_word lo)
{
    dd r;
    r.hi = hi, r.lo = lo;
    return r;
}
static inline dd dd_of(dd_word a) { return dd_make(a, word_of(0.0)); }
static inline dd dd_splat(double a) { return dd_of(word_of(a)); }
static inline dd dd_neg(dd a) { return dd_make(-a.hi, -a.lo); }
static inline dd dd_choose(dd_truth m, dd yes, dd no)
{
    return dd_make(word_choose(m, yes.hi, no.hi), word_choose(m, yes.lo, no.lo));
}
static inline dd dd_abs(dd a) { return dd_choose(word_less(a.hi, word_of(0.0)), dd_neg(a), a); }

/* Returns a + b exactly. Requires |a| >= |b| or a = 0. */
static inline dd two_sum_ordered(dd_word a, dd_word b)
{
    const dd_word sum = a + b;
    return dd_make(sum, b - (sum - a));
}
/* Returns a + b exactly, for any a and b. */
static inline dd two_sum(dd_word a, dd_word b)
{
    const dd_word sum = a + b, v = sum - a;
    return dd_make(sum, (a - (sum - v)) + (b - v));
}
/* Returns a * b exactly: `hi` is the rounded product, and `lo` its rounding error. With and without
 * fused multiply-add, the results are bitwise equal, because both variants are exact. */
static inline dd two_product(dd_word a, dd_word b)
{
    const dd_word product = a * b;
#if defined KR_FMA || defined __aarch64__
    return dd_make(product, word_fma(a, b, -product));
#else
    /* Veltkamp's splitting into halves of 26 bits, followed by Dekker's product. */
    const double split = 134217729.0;
    const dd_word p = split * a, q = split * b;
    const dd_word ah = p - (p - a), al = a - ah, bh = q - (q - b), bl = b - bh;
    return dd_make(product, ((ah * bh - product) + ah * bl + al * bh) + al * bl);
#endif
}
static inline dd dd_add(dd a, dd b)
{
    dd s = two_sum(a.hi, b.hi), t = two_sum(a.lo, b.lo);
    s = two_sum_ordered(s.hi, s.lo + t.hi);
    return two_sum_ordered(s.hi, s.lo + t.lo);
}
/* Returns a + b with an error of at most 2^-104 * (|a| + |b|), in half the time of dd_add. The
 * relative error can be large if a and b have opposite signs. */
static inline dd dd_add_sloppy(dd a, dd b)
{
    const dd s = two_sum(a.hi, b.hi);
    return two_sum_ordered(s.hi, s.lo + (a.lo + b.lo));
}
static inline dd dd_sub(dd a, dd b) { return dd_add(a, dd_neg(b)); }
static inline dd dd_mul(dd a, dd b)
{
    const dd p = two_product(a.hi, b.hi);
    return two_sum_ordered(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}
static inline dd dd_times(dd_word a, dd b)
{
    const dd p = two_product(a, b.hi);
    return two_sum_ordered(p.hi, p.lo + a * b.lo);
}
/* Returns power * a exactly, where `power` is a power of two. */
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
    const dd_word q = a.hi / b.hi;
    const dd p = two_product(q, b.hi);
    const dd_word rest = ((a.hi - p.hi) - p.lo) + (a.lo - q * b.lo);
    return two_sum_ordered(q, rest / b.hi);
}
/* Returns a / b, faster than dd_div. Requires that the double 1 / b.hi is normal. */
static inline dd dd_div_fast(dd a, dd b)
{
    const dd_word inverse = 1.0 / b.hi, q = a.hi * inverse;
    const dd p = two_product(q, b.hi);
    const dd_word rest = ((a.hi - p.hi) - p.lo) + (a.lo - q * b.lo);
    return two_sum_ordered(q, rest * inverse);
}
/* Returns the square root of a, or 0 if a is negative (by rounding errors), zero or NaN. */
static inline dd dd_sqrt(dd a)
{
    const dd_word x = word_sqrt(a.hi);
    const dd p = two_product(x, x),
             root = two_sum_ordered(x, (((a.hi - p.hi) - p.lo) + a.lo) / (2.0 * x));
    return dd_choose(word_less(word_of(0.0), a.hi), root, dd_splat(0.0));
}
static inline dd_truth dd_less(dd a, dd b)
{
    return truth_or(word_less(a.hi, b.hi),
                    truth_and(word_equal(a.hi, b.hi), word_less(a.lo, b.lo)));
}
static inline dd dd_max(dd a, dd b) { return dd_choose(dd_less(a, b), b, a); }
static inline dd dd_dot(const dd a[3], const dd b[3])
{
    return dd_add(dd_add(dd_mul(a[0], b[0]), dd_mul(a[1], b[1])), dd_mul(a[2], b[2]));
}
static inline dd dd_pi(void)
{
    return dd_make(word_of(3.141592653589793116), word_of(1.224646799147353207e-16));
}
#endif
