/* The functions of libm that kreisel.c names, for a compiler without a C library. The programs that
 * call only some functions of kreisel need only some of these: `make needs` lists them. */
#ifndef BARE_MATH_H
#define BARE_MATH_H
#define INFINITY __builtin_inff()
#define NAN __builtin_nanf("")
#define isfinite(x) __builtin_isfinite(x)
#define isnan(x) __builtin_isnan(x)
#define signbit(x) __builtin_signbit(x)

double atan2(double y, double x);
double ceil(double x);
double copysign(double magnitude, double sign);
double cos(double x);
double cosh(double x);
double exp(double x);
double exp2(double x);
double fabs(double x);
double floor(double x);
double fma(double x, double y, double z);
double fmax(double x, double y);
double fmin(double x, double y);
double fmod(double x, double y);
double frexp(double x, int *exponent);
double hypot(double x, double y);
int ilogb(double x);
double ldexp(double x, int exponent);
double log10(double x);
double log2(double x);
double nextafter(double x, double y);
double pow(double x, double y);
double rint(double x);
double sin(double x);
double sinh(double x);
double sqrt(double x);
double tan(double x);
#endif
