/* Sine, cosine and arc tangent with errors of at most 2 units in the last place (if |x| < 2^19).
 * The functions in this file sum power series with + - * / and sqrt, which are correctly rounded,
 * and fmod, which is exact. They use neither tables nor fused multiply-add. Unlike libm, they give
 * bitwise identical results for all compilers and processors, and in WebAssembly. */
#ifndef KR_TRIG_H
#define KR_TRIG_H
#include <math.h>
#include <stdint.h>
#include <string.h>

/* Writes cos(x) - 1 to `c` and sin(x)/x to `s`, given x_squared = x^2 <= (pi/4)^2. Divides by no
 * power of x, so x = 0 is no special case. */
static inline void cosm1_sinc_small(double x_squared, double *c, double *s)
{
    const double z = x_squared, z2 = z * z, z4 = z2 * z2;
    *c = (z2 * (1.0 / 24 - z * (1.0 / 720)) - z * (1.0 / 2)) +
         z4 * (((1.0 / 40320 - z * (1.0 / 3628800)) +
                z2 * (1.0 / 479001600 - z * (1.0 / 87178291200.0))) +
               z4 * (1.0 / 20922789888000.0));
    *s = ((1.0 - z * (1.0 / 6)) + z2 * (1.0 / 120 - z * (1.0 / 5040))) +
         z4 * (((1.0 / 362880 - z * (1.0 / 39916800)) +
                z2 * (1.0 / 6227020800.0 - z * (1.0 / 1307674368000.0))) +
               z4 * (1.0 / 355687428096000.0));
}
static inline void cos_sinc_small(double x_squared, double *c, double *s)
{
    cosm1_sinc_small(x_squared, c, s);
    *c += 1.0;
}

/* Writes the sine and cosine of x. If |x| >= 2^19, x is first reduced modulo the double nearest to
 * 2 pi. The resulting error of the angle is smaller than one unit in the last place of x. */
static inline void sin_cos(double x, double *sine, double *cosine)
{
    /* The low bits of the sum of a number and 1.5 * 2^52 are the integer nearest to the number. */
    const double to_integer = 6755399441055744.0;
    double turns, r, s, c;
    uint64_t quadrant;
    if (!(fabs(x) < 524288.0)) x = fmod(x, 6.283185307179586);
    turns = x * 0.63661977236758138 + to_integer;
    memcpy(&quadrant, &turns, sizeof quadrant);
    turns -= to_integer;
    /* pi/2 is split into three parts (from fdlibm), of which the first two have 33 bits. Their
     * products with `turns` are exact, because |turns| is an integer below 2^20. */
    r = ((x - turns * 1.57079632673412561417e+00) - turns * 6.07710050630396597660e-11) -
        turns * 2.02226624879595063154e-21;
    cos_sinc_small(r * r, &c, &s);
    s *= r;
    *sine = quadrant & 1 ? c : s;
    *cosine = quadrant & 1 ? s : c;
    if (quadrant & 2) *sine = -*sine;
    if ((quadrant + 1) & 2) *cosine = -*cosine;
}

/* Writes cos(x) to `c` and sin(x)/x to `s`, given x_squared = x^2. */
static inline void cos_sinc(double x_squared, double *c, double *s)
{
    if (x_squared <= 0.61) {
        cos_sinc_small(x_squared, c, s);
    } else {
        const double x = sqrt(x_squared);
        sin_cos(x, s, c);
        *s /= x;
    }
}

/* Writes cos(x) - 1 to `c` and sin(x)/x to `s`, given x_squared = x^2. For small x, cos(x) - 1 is
 * computed without the cancellation of a subtraction. */
static inline void cosm1_sinc(double x_squared, double *c, double *s)
{
    if (x_squared <= 0.61) {
        cosm1_sinc_small(x_squared, c, s);
    } else {
        cos_sinc(x_squared, c, s);
        *c -= 1.0;
    }
}

static inline double arc_tangent(double x)
{
    const double a = fabs(x), inverse = 1.0 / a;
    double t = a > 1.0 ? inverse : a, sum = 0.0, z;
    int k;
    /* Each line replaces t by the tangent of half the angle arctan(t); then t < 0.2. */
    t = t / (1.0 + sqrt(1.0 + t * t));
    t = t / (1.0 + sqrt(1.0 + t * t));
    z = t * t;
    for (k = 21; k > 1; k -= 2) sum = z * (1.0 / k - sum);
    t = 4.0 * (t - t * sum);
    if (a > 1.0) t = 1.5707963267948966 - t;
    return x < 0.0 ? -t : t;
}
#endif
