/* Random choices: see random_values.h. */
#include <math.h>
#include <string.h>
#include "../c/random.h"
#include "model/quantities.h"
#include "random_values.h"

static struct {
    const unsigned char *next;
    size_t left;
} given;

void choose_by_seed(uint64_t seed)
{
    given.left = 0;
    random_seed = seed;
}
/* Returns the next choice, made from at most `bytes` bytes. */
static uint64_t bits(int bytes)
{
    uint64_t word = 0;
    if (!given.left) return random_bits();
    for (; bytes > 0 && given.left; bytes--, given.left--) word = word << 8 | *given.next++;
    return word;
}
void choose_by_bytes(size_t size, const unsigned char bytes[])
{
    given.next = bytes;
    given.left = size;
    random_seed = bits(8);
}
uint64_t choose(uint64_t n) { return bits(n <= 256 ? 1 : n <= 65536 ? 2 : 8) % n; }
int odds(int percent) { return (int)choose(100) < percent; }
double between(double low, double high)
{
    return low + (high - low) * (double)(bits(4) & 0xffffffffu) * 0x1p-32;
}
double spread(double low, double high) { return exp(between(log(low), log(high))); }
double either_sign(double x) { return choose(2) ? x : -x; }

double any_double(void)
{
    uint64_t word;
    double x;
    switch (choose(10)) {
    case 0:
        return between(-3.0, 3.0);
    case 1:
        return (double)choose(7) - 3.0;
    case 2:
        return either_sign(spread(1e-300, 1e-20));
    case 3:
        return either_sign(spread(1e20, 1e300));
    case 4:
        return either_sign(0x1p-1074 * (double)(1 + choose(65536)));
    case 5:
        return either_sign(1.0 + 0x1p-52 * (double)choose(256));
    case 6:
        return either_sign(INFINITY);
    case 7:
        return NAN;
    case 8:
        return either_sign(0.0);
    default:
        break;
    }
    word = bits(8);
    memcpy(&x, &word, sizeof x);
    return x;
}
double maybe_arbitrary(double x, int percent) { return odds(percent) ? any_double() : x; }
kr_vec3 vector_between(double low, double high)
{
    const double x = between(low, high), y = between(low, high), z = between(low, high);
    return v3(x, y, z);
}
kr_quat any_attitude(void)
{
    const double lean = spread(1e-18, 1.0), w = between(-1.0, 1.0);
    const kr_vec3 v = vector_between(-1.0, 1.0);
    switch (choose(5)) {
    case 0:
        return q_one();
    case 1:
        return q4(0.0, v3(1.0, 0.0, 0.0));
    case 2:
        return q_exp(v3(0.5 * lean, 0.0, 0.0));
    case 3:
        return q_mul(q_exp(v3(0.5 * lean, 0.0, 0.0)), q4(0.0, v3(0.0, 1.0, 0.0)));
    default:
        return w == 0.0 && v_length(v) == 0.0 ? q_one() : q_unit(q4(w, v));
    }
}
const kr_method *any_method(void)
{
    size_t n = 0;
    while (kr_method_at(n)) n++;
    return kr_method_at((size_t)choose(n));
}
const kr_quantity *any_quantity(void) { return kr_quantity_at((size_t)choose(KR_QUANTITIES)); }
