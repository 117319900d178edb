/* Random numbers for the C tests, by splitmix64, which are the same on every machine and with every
 * compiler. A test may set the seed. */
#ifndef KR_RANDOM_H
#define KR_RANDOM_H
#include "math/su2.h"

static uint64_t random_seed = 1;

static inline uint64_t random_bits(void)
{
    uint64_t z = random_seed += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}
static inline double uniform(double low, double high)
{
    return low + (high - low) * (double)(random_bits() >> 11) * 0x1p-53;
}
static inline kr_vec3 random_vec(double size) /* in a cube; components drawn in order */
{
    const double x = uniform(-size, size), y = uniform(-size, size), z = uniform(-size, size);
    return v3(x, y, z);
}
static inline kr_quat random_quat(void)
{
    const double w = uniform(-1, 1);
    return q_unit(q4(w, random_vec(1)));
}
#endif
