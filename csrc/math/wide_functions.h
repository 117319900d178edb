/* Sine, cosine and natural logarithm of each lane of a SIMD vector (`wide`, simd.h). */
#ifndef KR_WIDE_FUNCTIONS_H
#define KR_WIDE_FUNCTIONS_H
#include "simd.h"

/* Writes the sine and cosine of x, for |x| < 2^51. Let n pi/2 be the multiple of pi/2 nearest to x.
 * The polynomials of trig.h give the sine and cosine of y = x - n pi/2. They are swapped if n is
 * odd. Their signs depend on n mod 4, the low two bits of n and of u = n + 1.5 * 2^52. */
INLINE void wide_sin_cos(wide x, wide *sine, wide *cosine)
{
    const wide u = wide_fma(x, wide_splat(0.63661977236758138), wide_splat(0x1.8p52)),
               turns = u - 0x1.8p52;
    const wide y = wide_fma(turns, wide_splat(-6.123233995736766e-17),
                            wide_fma(turns, wide_splat(-1.5707963267948966), x));
    const wide z = y * y;
    static const double sines[] = {-1.0 / 1307674368000.0,
                                   1.0 / 6227020800.0,
                                   -1.0 / 39916800,
                                   1.0 / 362880,
                                   -1.0 / 5040,
                                   1.0 / 120,
                                   -1.0 / 6},
                        cosines[] = {
                            -1.0 / 87178291200.0, 1.0 / 479001600, -1.0 / 3628800, 1.0 / 40320,
                            -1.0 / 720,           1.0 / 24,        -1.0 / 2};
    wide s = wide_splat(1.0 / 355687428096000.0), c = wide_splat(1.0 / 20922789888000.0);
    for (int n = 0; n < 7; n++) {
        s = wide_fma(z, s, wide_splat(sines[n]));
        c = wide_fma(z, c, wide_splat(cosines[n]));
    }
    s = wide_fma(y * z, s, y);
    c = wide_fma(z, c, wide_splat(1.0));
    const wide_integer quarter = wide_bits(u),
                       swap = (wide_bits(s) ^ wide_bits(c)) & (0 - (quarter & 1));
    *sine = wide_of_bits((wide_bits(s) ^ swap) ^ ((quarter & 2) << 62));
    *cosine = wide_of_bits((wide_bits(c) ^ swap) ^ (((quarter + 1) & 2) << 62));
}
#define LN_2 0.69314718055994531
/* Returns m and writes `exponent` such that x = m * 2^exponent and sqrt(1/2) <= m < sqrt(2).
 * Requires that x is a positive normal number. */
INLINE wide wide_split_exponent(wide x, wide *exponent)
{
    const wide_integer one = wide_bits(wide_splat(1.0)),
                       root = wide_bits(wide_splat(0.70710678118654752));
    const wide_integer bits = wide_bits(x) + (one - root);
    *exponent = wide_of_bits((bits >> 52) | 0x4330000000000000u) - (0x1p52 + 1023.0);
    return wide_of_bits((bits & 0x000fffffffffffffu) + root);
}
/* Returns the natural logarithm of x to full precision. Requires that x is positive and normal. */
INLINE wide wide_log(wide x)
{
    wide exponent;
    const wide m = wide_split_exponent(x, &exponent), z = (m - 1.0) / (m + 1.0), y = z * z;
    wide sum = wide_splat(1.0 / 21.0);
    for (int n = 19; n > 1; n -= 2) sum = wide_fma(y, sum, wide_splat(1.0 / n));
    sum = wide_fma(2.0 * z * y, sum, 2.0 * z);
    return wide_fma(exponent, wide_splat(LN_2), sum);
}
/* Returns the natural logarithm of x, computed without a division. Its absolute error of at most
 * 1e-8 is small enough for Lyapunov exponents. Here, m is one less than in wide_split_exponent. A
 * polynomial interpolates ln(1 + m) / m at Chebyshev nodes. Requires that x > 0 is normal. */
INLINE wide wide_approx_log(wide x)
{
    static const double terms[] = {-0.143773305674, 0.149490954762, -0.165606959921,
                                   0.199569774831,  -0.25002153461, 0.333341833385,
                                   -0.499999870323, 0.999999974267};
    wide exponent, sum = wide_splat(0.0874394535206);
    const wide m = wide_split_exponent(x, &exponent) - 1.0;
    for (int n = 0; n < 8; n++) sum = wide_fma(m, sum, wide_splat(terms[n]));
    return wide_fma(exponent, wide_splat(LN_2), m * sum);
}
#endif
