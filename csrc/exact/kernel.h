/* The state of the closed form at a time. One kernel serves one time and many: it has no
 * branch and calls nothing but sqrt, so that compilers turn a loop over times into vectors, and it
 * gives the same bits at every width. This header is source that is compiled once per instruction
 * set, because that loop takes the width of the vectors. In formulas e is the closed form, a, b and
 * h are alpha, beta and the horizontal momentum (setup.h). */
#ifndef KR_EXACT_KERNEL_H
#define KR_EXACT_KERNEL_H
#include "setup.h"

/* bits_of and of_bits read a double as the integer that its bits are, and back. A kernel chooses by
 * masks of bits where a branch would keep the loop from becoming vectors. */
INLINE uint64_t bits_of(double x)
{
    union {
        double value;
        uint64_t bits;
    } r;
    r.value = x;
    return r.bits;
}
INLINE double of_bits(uint64_t bits)
{
    union {
        double value;
        uint64_t bits;
    } r;
    r.bits = bits;
    return r.value;
}
/* Returns the integer next to x, for |x| < 2^51: adding 1.5 2^52 leaves no bits for a fraction. */
INLINE double nearest(double x)
{
    const double shift = 6755399441055744.0;
    return (x + shift) - shift;
}
/* Returns a phase at time t [turns], less whole turns. Its high word lies in 0 .. 2 and its sum may
 * be taken in order, because |start| is no less than 1/2. The low word keeps what the high one
 * rounds off, which would be half of a state's error. */
INLINE dd phase_at(const kr_phase *f, dd t)
{
    const dd p = two_product(t.hi, f->fast), s = two_sum_ordered(f->start, p.hi - nearest(p.hi));
    return dd_make(s.hi, ((p.lo + f->more) + (t.hi * f->slow + t.lo * f->fast)) + s.lo);
}
/* Returns x + extra, whose low word need not be normalised. */
INLINE dd phase_plus(dd x, double extra)
{
    const dd s = two_sum(x.hi, extra);
    return dd_make(s.hi, s.lo + x.lo);
}
/* Gives sine and cosine of x turns. The quarter next to x is an integer in the low bits of u; the
 * polynomials then see y, which is at most an eighth. */
INLINE void sincos_turns(dd x, double *s, double *c)
{
    const double shift = 1688849860263936.0, u = (x.hi + x.lo) + shift,
                 y = (x.hi - (u - shift)) + x.lo;
    const double z = y * y, zz = z * z;
    const double odd = (-41.341702240399755 + z * 81.6052492760517) +
                       zz * ((-76.70585973561397 + z * 42.05868917945876) +
                             zz * (-15.094054064726203 + z * 3.786430011879243));
    const double even =
        (-19.739208802178716 + z * 64.93939402266824) +
        zz * ((-85.45681720664378 + z * 60.24464135269435) +
              zz * ((-26.426253274804587 + z * 7.903206845861561) + zz * -1.6990328650055457));
    const double sine = y * 6.283185307179586 + y * (2.4492935982947064e-16 + z * odd),
                 cosine = 1.0 + z * even;
    const uint64_t quarter = bits_of(u),
                   swap = (bits_of(sine) ^ bits_of(cosine)) & (0 - (quarter & 1));
    *s = of_bits((bits_of(sine) ^ swap) ^ ((quarter & 2) << 62));
    *c = of_bits((bits_of(cosine) ^ swap) ^ (((quarter + 1) & 2) << 62));
}
/* Gives sinh and cosh of a, by exp(a) = 2^k exp(r) and its inverse; |r| is at most (ln 2)/2. */
INLINE void sinhcosh(dd a, double *s, double *c)
{
    const double shift = 6755399441055744.0, up = a.hi * 1.44269504088896340736 + shift,
                 k = up - shift;
    const double r = (a.hi - k * 0.693147180369123816490) - (k * 1.90821492927058770002e-10 - a.lo),
                 rr = r * r;
    const double odd =
        r + r * rr *
                (1.0 / 6 +
                 rr * (1.0 / 120 +
                       rr * (1.0 / 5040 + rr * (1.0 / 362880 + rr * (1.0 / 39916800 +
                                                                     rr * (1.0 / 6227020800.0))))));
    const double even =
        1.0 +
        rr * (0.5 + rr * (1.0 / 24 +
                          rr * (1.0 / 720 + rr * (1.0 / 40320 + rr * (1.0 / 3628800 +
                                                                      rr * (1.0 / 479001600.0))))));
    /* The low bits of k + 1.5 2^52, moved into the exponent of one, make 2^k. */
    const uint64_t one = 0x3ff0000000000000u;
    const double plus = of_bits((bits_of(up) << 52) + one) * (even + odd);
    const double minus = of_bits((bits_of(shift - k) << 52) + one) * (even - odd);
    *s = 0.5 * (plus - minus);
    *c = 0.5 * (plus + minus);
}
/* poly4 and poly5 sum polynomials of four and of five terms in s, where ss is its square. */
INLINE double poly4(const double a[], double s, double ss)
{
    return (a[0] + s * a[1]) + ss * (a[2] + s * a[3]);
}
INLINE double poly5(const double a[], double s, double ss)
{
    return (a[0] + s * a[1]) + ss * ((a[2] + s * a[3]) + ss * a[4]);
}

/* The theta functions of alpha, beta and the horizontal momentum, and apart from them the phases of
 * alpha and beta [turns]. */
typedef struct factors {
    double a_re, a_im, b_re, b_im, h_re, h_im;
    dd first, second;
} factors;

/* Sums the theta series at time t. Where `dual` is not 0, the series are those in the dual nome:
 * they have hyperbolic functions for sine and cosine, and Jacobi's transformation, which leads to
 * them, leaves a phase that is linear in the nutation's (`slope`). Where `euler` is not 0, beta is
 * a theta4 in place of a theta2. */
INLINE factors theta_factors(const kr_exact *e, int dual, int euler, dd t)
{
    const dd x = phase_at(&e->nutation, t);
    double s, c, sign = 1.0, square, quartic;
    factors f;
    f.first = phase_at(&e->first, t);
    f.second = phase_at(&e->second, t);
    if (dual) {
        /* The half turn next to x is an integer in the low bits of u; y is at most a quarter. */
        const double shift = 3377699720527872.0, u = (x.hi + x.lo) + shift,
                     near = x.hi - (u - shift), y = near + x.lo;
        const double z = 2.0 * y, rest = 2.0 * ((near - y) + x.lo);
        const dd p = two_product(z, e->stretch);
        sinhcosh(dd_make(-p.hi, -(p.lo + (z * e->stretch_rest + rest * e->stretch))), &s, &c);
        f.first = phase_plus(f.first, z * e->slope[0]);
        f.second = phase_plus(f.second, z * e->slope[1]);
        /* theta1 and theta2 change sign after half a turn of the phase, which is one nutation. */
        sign = of_bits(bits_of(1.0) ^ (bits_of(u) << 63));
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
/* Returns the state at `time`, which lies `span` behind the beginning, without the frame around it.
 * The momentum of the free (Euler's) body stands still, and its alpha and beta turn alike. */
INLINE kr_state kernel(const kr_exact *e, int dual, int euler, double time, dd span)
{
    const factors f = theta_factors(e, dual, euler, span);
    const double n =
        1.0 / sqrt((f.a_re * f.a_re + f.a_im * f.a_im) + (f.b_re * f.b_re + f.b_im * f.b_im));
    double s1, c1, s2, c2;
    sincos_turns(f.first, &s1, &c1);
    if (euler) {
        s2 = s1;
        c2 = c1;
    } else
        sincos_turns(f.second, &s2, &c2);
    const kr_quat q = {n * (f.a_re * c1 - f.a_im * s1), n * (f.b_re * c2 - f.b_im * s2),
                       n * (f.b_re * s2 + f.b_im * c2), n * (f.a_re * s1 + f.a_im * c1)};
    kr_vec3 m = e->constant;
    if (!euler) {
        const double re = n * e->momentum * (c1 * c2 - s1 * s2),
                     im = n * e->momentum * (s1 * c2 + c1 * s2);
        m.x += f.h_re * re - f.h_im * im;
        m.y += e->side * (f.h_re * im + f.h_im * re);
    }
    const kr_state r = {time, q, m};
    return r;
}
/* Carries q into a frame f, which is given by what it makes of 1, i, j and k. */
INLINE kr_quat framed(const kr_quat f[4], kr_quat q)
{
    return q4((q.w * f[0].w + q.x * f[1].w) + (q.y * f[2].w + q.z * f[3].w),
              v3((q.w * f[0].x + q.x * f[1].x) + (q.y * f[2].x + q.z * f[3].x),
                 (q.w * f[0].y + q.x * f[1].y) + (q.y * f[2].y + q.z * f[3].y),
                 (q.w * f[0].z + q.x * f[1].z) + (q.y * f[2].z + q.z * f[3].z)));
}

/* A longer time overflows where a product is made without a fused one. */
static const double longest = 0x1p990;
/* Says whether the kernel serves so long after the beginning: so many turns have a fraction. */
INLINE int is_within(const kr_exact *e, double span)
{
    const double most = 0x1p50;
    return fabs(span) < longest && fabs(span * e->nutation.fast) < most &&
           fabs(span * e->first.fast) < most && fabs(span * e->second.fast) < most;
}
/* Returns the state `span` after the beginning, as one at time t. Each kind of series calls the
 * kernel with constants, so that the compiler leaves out what that kind does not need. */
static inline kr_state state_after(const kr_exact *e, double t, dd span)
{
    kr_state r;
    switch (e->curve) {
    case LAGRANGE:
        r = kernel(e, 0, 0, t, span);
        break;
    case EULER:
        r = kernel(e, 0, 1, t, span);
        break;
    case LAGRANGE_DUAL:
        r = kernel(e, 1, 0, t, span);
        break;
    default:
        r = kernel(e, 1, 1, t, span);
        break;
    }
    if (e->framed) r.q = framed(e->frame, r.q);
    return r;
}
/* Returns the state at a time that is too late for the kernel: that of the beginning, which has
 * every integral. There is none at a time that is not finite. */
static inline kr_state state_beyond(const kr_exact *e, double t)
{
    const kr_state none = {t, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    return isfinite(t) ? state_after(e, t, dd_of(0.0)) : none;
}
/* Returns the state at time t. */
static inline kr_state state_at(const kr_exact *e, double t)
{
    const dd span = two_sum(t, -e->begin);
    return is_within(e, span.hi) ? state_after(e, t, span) : state_beyond(e, t);
}
#endif
