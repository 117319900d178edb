/* What a fuzzed round does is a sequence of choices, which a generator makes from a seed, or which
 * are read from bytes. */
#ifndef KR_CHOICE_H
#define KR_CHOICE_H
#include "kreisel.h"

void choose_by_seed(uint64_t seed);
/* By these bytes, and when they are used up by a seed, which the first eight of them are. */
void choose_by_bytes(size_t size, const unsigned char bytes[]);

uint64_t choose(uint64_t n);             /* one of 0 .. n - 1 */
int odds(int percent);                   /* 1 so often */
double between(double low, double high); /* evenly */
double spread(double low, double high);  /* evenly in the logarithm */
double either_sign(double x);
/* Any double: ordinary, whole, tiny, huge, denormal, next to one, infinite, NaN, or of any bits. */
double any_double(void);
/* Puts into the place of x, once in so many times, any double. */
double spoiled(double x, int percent);
kr_vec3 vector_between(double low, double high);
kr_quat any_attitude(void); /* a unit quaternion; some are half turns, upright, or nearly so */
#endif
