/* Binary fractions and exponents of doubles, extracted from their bits. fraction_of and
 * times_power_of_2(x, power) return the same results as frexp and ldexp of libm, in a fifth of the
 * time. They call libm only if x (fraction_of) or 2^power as a double is not a normal number. */
#ifndef KR_EXPONENT_H
#define KR_EXPONENT_H
#include <math.h>
#include <stdint.h>
#include <string.h>

/* Returns 2^power. Requires -1022 <= power <= 1023. */
static inline double power_of_2(int power)
{
    const uint64_t bits = (uint64_t)(1023 + power) << 52;
    double r;
    memcpy(&r, &bits, sizeof r);
    return r;
}
/* Returns f and writes e such that x = f * 2^e and 1/2 <= |f| < 1, like frexp. */
static inline double fraction_of(double x, int *exponent)
{
    const uint64_t field = (uint64_t)0x7ff << 52, half = (uint64_t)0x3fe << 52;
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    const int biased = (int)((bits & field) >> 52);
    if (biased == 0 || biased == 0x7ff) return frexp(x, exponent);
    *exponent = biased - 1022;
    bits = (bits & ~field) | half;
    memcpy(&x, &bits, sizeof x);
    return x;
}
static inline double times_power_of_2(double x, int power)
{
    return power < -1022 || power > 1023 ? ldexp(x, power) : x * power_of_2(power);
}
/* Returns the least exponent e with 2^e > |x|, but at most 1023; 0 if x = 0. */
static inline int exponent_above(double x)
{
    int exponent = 0;
    fraction_of(x, &exponent);
    return exponent < 1024 ? exponent : 1023;
}
/* Returns the exponent e with 2^e <= |x| < 2^(e + 1). x must not be zero. */
static inline int exponent_of(double x)
{
    int exponent;
    fraction_of(x, &exponent);
    return exponent - 1;
}
#endif
