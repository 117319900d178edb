/* Evaluates a closed-form solution at time t. The same code is used for a single time and for an
 * array of times. The kernel has no branches and calls no function other than sqrt, so compilers
 * can vectorize loops over times. Results are bitwise identical for all vector widths. This header
 * is compiled once for each instruction set, so that its loops use the available vector
 * instructions. In the code, e denotes the closed-form solution. The letters a, b and h denote
 * alpha, beta and the horizontal momentum (lane_types.h). */
#ifndef KR_EXACT_KERNEL_H
#define KR_EXACT_KERNEL_H
#include "lane_types.h"

/* bits_of and of_bits reinterpret the bits of a double as an integer, and back. The kernel selects
 * values by bit masks, because branches would prevent vectorization. */
INLINE wide_integer bits_of(wide x)
{
    union {
        wide value;
        wide_integer bits;
    } r;
    r.value = x;
    return r.bits;
}
INLINE wide of_bits(wide_integer bits)
{
    union {
        wide value;
        wide_integer bits;
    } r;
    r.bits = bits;
    return r.value;
}
/* Returns the integer nearest to x, for |x| < 2^51. Adding 1.5 * 2^52 leaves no bits for a
 * fraction. */
INLINE wide nearest(wide x)
{
    const double shift = 6755399441055744.0;
    return (x + shift) - shift;
}
/* Returns the phase at time t in turns, up to a whole number of turns. The high-order part of the
 * returned double-double lies between 0 and 2. The condition |start| >= 1/2 makes two_sum_ordered
 * exact. The low-order part is the rounding error of the high-order part. If the low-order part of
 * the phase were omitted, the errors of the states would be about twice as large. */
INLINE dd phase_at(const phase_lanes *f, dd t)
{
    const dd p = two_product(t.hi, f->fast), s = two_sum_ordered(f->start, p.hi - nearest(p.hi));
    return dd_make(s.hi, ((p.lo + f->more) + (t.hi * f->slow + t.lo * f->fast)) + s.lo);
}
/* Returns x + extra. The result is not necessarily a normalized double-double. */
INLINE dd phase_plus(dd x, wide extra)
{
    const dd s = two_sum(x.hi, extra);
    return dd_make(s.hi, s.lo + x.lo);
}
/* Returns 1 / (2 pi) in double-double precision. */
INLINE dd one_turn(void)
{
    return dd_make(wide_splat(0.15915494309189534561), wide_splat(-9.839338337591243e-18));
}
/* Writes the sine and cosine of an angle of x turns. The low bits of u contain the number of
 * quarter turns nearest to x. The polynomials are evaluated at the remainder y, whose magnitude is
 * at most an eighth of a turn. */
INLINE void sincos_turns(dd x, wide *s, wide *c)
{
    const double shift = 1688849860263936.0;
    const wide u = (x.hi + x.lo) + shift, y = (x.hi - (u - shift)) + x.lo;
    const wide z = y * y, zz = z * z;
    const wide odd = (-41.341702240399755 + z * 81.6052492760517) +
                     zz * ((-76.70585973561397 + z * 42.05868917945876) +
                           zz * (-15.094054064726203 + z * 3.786430011879243));
    const wide even =
        (-19.739208802178716 + z * 64.93939402266824) +
        zz * ((-85.45681720664378 + z * 60.24464135269435) +
              zz * ((-26.426253274804587 + z * 7.903206845861561) + zz * -1.6990328650055457));
    const wide sine = y * 6.283185307179586 + y * (2.4492935982947064e-16 + z * odd),
               cosine = 1.0 + z * even;
    const wide_integer quarter = bits_of(u),
                       swap = (bits_of(sine) ^ bits_of(cosine)) & (0 - (quarter & 1));
    *s = of_bits((bits_of(sine) ^ swap) ^ ((quarter & 2) << 62));
    *c = of_bits((bits_of(cosine) ^ swap) ^ (((quarter + 1) & 2) << 62));
}
/* An exponential, computed as exp(a) = 2^k exp(r) with |r| <= (ln 2)/2. Adding the low bits of k +
 * 1.5 * 2^52 to the exponent of 1.0 gives 2^k. */
typedef struct exponential {
    wide plus, minus; /* 2^k, 2^-k */
    wide even, odd;   /* cosh r, sinh r */
} exponential;

INLINE exponential exponential_of(dd a)
{
    const double shift = 6755399441055744.0;
    const wide up = a.hi * 1.44269504088896340736 + shift, k = up - shift;
    const wide r = (a.hi - k * 0.693147180369123816490) - (k * 1.90821492927058770002e-10 - a.lo),
               rr = r * r;
    const uint64_t one = 0x3ff0000000000000u;
    exponential e;
    e.odd =
        r + r * rr *
                (1.0 / 6 +
                 rr * (1.0 / 120 +
                       rr * (1.0 / 5040 + rr * (1.0 / 362880 + rr * (1.0 / 39916800 +
                                                                     rr * (1.0 / 6227020800.0))))));
    e.even =
        1.0 +
        rr * (0.5 + rr * (1.0 / 24 +
                          rr * (1.0 / 720 + rr * (1.0 / 40320 + rr * (1.0 / 3628800 +
                                                                      rr * (1.0 / 479001600.0))))));
    e.plus = of_bits((bits_of(up) << 52) + one);
    e.minus = of_bits((bits_of(shift - k) << 52) + one);
    return e;
}
/* Writes the hyperbolic sine and cosine of a. */
INLINE void sinhcosh(dd a, wide *s, wide *c)
{
    const exponential e = exponential_of(a);
    const wide plus = e.plus * (e.even + e.odd), minus = e.minus * (e.even - e.odd);
    *s = 0.5 * (plus - minus);
    *c = 0.5 * (plus + minus);
}
/* poly4 and poly5 evaluate polynomials of four and of five terms in s; ss is the square of s. */
INLINE wide poly4(const wide a[], wide s, wide ss)
{
    return (a[0] + s * a[1]) + ss * (a[2] + s * a[3]);
}
INLINE wide poly5(const wide a[], wide s, wide ss)
{
    return (a[0] + s * a[1]) + ss * ((a[2] + s * a[3]) + ss * a[4]);
}

/* The values of the theta functions for alpha, beta and the horizontal momentum. The phases of
 * alpha and beta, in turns, are stored separately. */
typedef struct factors {
    wide a_re, a_im, b_re, b_im, h_re, h_im;
    dd first, second;
} factors;

/* Evaluates the theta series at time t. If `dual` is nonzero, the series use the dual nome, and
 * hyperbolic functions replace the sine and cosine. Jacobi's transformation adds a phase that is
 * proportional to the phase of the nutation. For torque-free bodies (`euler`), the function beta
 * contains theta4 instead of theta2. */
INLINE factors theta_factors(const exact_lanes *e, int dual, int euler, dd t)
{
    const dd x = phase_at(&e->nutation, t);
    wide s, c, sign = wide_splat(1.0), square, quartic;
    factors f;
    f.first = phase_at(&e->first, t);
    f.second = phase_at(&e->second, t);
    if (dual) {
        /* The low bits of u contain the number of half turns nearest to x. The remainder |y| is at
         * most a quarter of a turn. */
        const double shift = 3377699720527872.0;
        const wide u = (x.hi + x.lo) + shift, near = x.hi - (u - shift), y = near + x.lo;
        const wide z = 2.0 * y, rest = 2.0 * ((near - y) + x.lo);
        const dd p = two_product(z, e->stretch);
        sinhcosh(dd_make(-p.hi, -(p.lo + (z * e->stretch_rest + rest * e->stretch))), &s, &c);
        f.first = phase_plus(f.first, z * e->slope[0]);
        f.second = phase_plus(f.second, z * e->slope[1]);
        /* theta1 and theta2 change sign after half a turn of the phase, which is one nutation. */
        sign = of_bits(bits_of(sign) ^ (bits_of(u) << 63));
        square = -s * s;
    } else {
        sincos_turns(x, &s, &c);
        square = s * s;
    }
    quartic = square * square;
    f.a_re = sign * s * poly4(e->alpha.even, square, quartic);
    f.a_im = sign * c * poly4(e->alpha.odd, square, quartic);
    if (dual != euler) {
        f.b_re = sign * poly5(e->beta.even, square, quartic);
        f.b_im = sign * s * c * poly5(e->beta.odd, square, quartic);
    } else {
        f.b_re = c * poly4(e->beta.even, square, quartic);
        f.b_im = s * poly4(e->beta.odd, square, quartic);
    }
    f.h_re = poly5(e->horizontal.even, square, quartic);
    f.h_im = s * c * poly5(e->horizontal.odd, square, quartic);
    return f;
}
/* Returns the state at `time`, which is the initial time plus `span`. The attitude is not in the
 * user's frame: the caller must apply the map `frame` of the solution to it. For a torque-free body
 * (`euler`), the momentum is constant, and the functions alpha and beta have the same phase. */
INLINE state_lanes kernel(const exact_lanes *e, int dual, int euler, wide time, dd span)
{
    const factors f = theta_factors(e, dual, euler, span);
    const wide n =
        1.0 / wide_sqrt((f.a_re * f.a_re + f.a_im * f.a_im) + (f.b_re * f.b_re + f.b_im * f.b_im));
    wide s1, c1, s2, c2;
    sincos_turns(f.first, &s1, &c1);
    if (euler) {
        s2 = s1;
        c2 = c1;
    } else
        sincos_turns(f.second, &s2, &c2);
    const quat_lanes q = {n * (f.a_re * c1 - f.a_im * s1), n * (f.b_re * c2 - f.b_im * s2),
                          n * (f.b_re * s2 + f.b_im * c2), n * (f.a_re * s1 + f.a_im * c1)};
    /* 0, or NaN if the attitude is NaN. Adding this to the constant momentum makes the momentum NaN
     * as well. */
    const wide none = q.w - q.w;
    vec3_lanes m = {e->constant.x - none, e->constant.y - none, e->constant.z - none};
    if (!euler) {
        const wide re = n * e->momentum * (c1 * c2 - s1 * s2),
                   im = n * e->momentum * (s1 * c2 + c1 * s2);
        m.x += f.h_re * re - f.h_im * im;
        m.y += e->side * (f.h_re * im + f.h_im * re);
    }
    const state_lanes r = {time, q, m};
    return r;
}

/* The longest time span for which exact products (two_product) do not overflow without fused
 * multiply-add. */
static const double longest = 0x1p990;
/* Returns 1 if the state at the time `span` after the initial time can be computed. The phases must
 * not exceed 2^50 turns, because doubles must resolve their fractional parts. */
INLINE mask is_within(const exact_lanes *e, wide span)
{
    const wide most = wide_splat(0x1p50);
    return mask_and(mask_and(wide_less(wide_abs(span), wide_splat(longest)),
                             wide_less(wide_abs(span * e->nutation.fast), most)),
                    mask_and(wide_less(wide_abs(span * e->first.fast), most),
                             wide_less(wide_abs(span * e->second.fast), most)));
}
#endif
