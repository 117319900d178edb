/* Random choices of a round, from a generator with a seed, or from given bytes. */
#ifndef KR_RANDOM_VALUES_H
#define KR_RANDOM_VALUES_H
#include "kreisel.h"

void choose_by_seed(uint64_t seed);
/* Makes further choices from the bytes after the first eight. After the last byte, choices come
 * from a generator that is seeded with the first eight bytes. */
void choose_by_bytes(size_t size, const unsigned char bytes[]);

uint64_t choose(uint64_t n);             /* one of 0 .. n - 1 */
int odds(int percent);                   /* 1 with this probability */
double between(double low, double high); /* uniform */
double spread(double low, double high);  /* uniform in the logarithm */
double either_sign(double x);
/* Returns any double: ordinary, integer, tiny, huge, subnormal, next to one, infinite, NaN, zero,
 * or of random bits. */
double any_double(void);
/* Returns x, or with probability `percent` an arbitrary double. */
double maybe_arbitrary(double x, int percent);
kr_vec3 vector_between(double low, double high);
const kr_method *any_method(void);
const kr_quantity *any_quantity(void);
/* Returns a unit quaternion, sometimes a half turn, upright or nearly upright. */
kr_quat any_attitude(void);
#endif
