/* Implements the types and operations of deviation.h for batches of eight tangents. Each lane of a
 * SIMD vector holds one tangent. A `triple` consists of three vectors, one for each axis, so cyclic
 * permutations take no time. A `turned` is the `triple` itself. A `path_term` is a pointer to a
 * coefficient. The terms of deviation_sums (deviation.h) with even j are summed before those with
 * odd j (CHAINS = 1), because there are too few vector registers to sum both at once. */
#include "tangents.h"

enum {
    AT_ONCE = 1,
    BLOCK = 2,
    BEFORE = 0,
    CHAINS = 1,
    STRUCTS = KR_DEVIATION_BATCH_STRUCTS * WORDS /* distance between batches, in structs */
};
typedef struct {
    duo x, y, z;
} triple;
typedef triple turned;
typedef const double *path_term;
typedef struct {
    triple lo, hi;
} halves;

INLINE triple triple_of(duo x, duo y, duo z) { return (triple){x, y, z}; }
/* Returns the vector (four[1], four[2], four[3]), the same for every tangent of a batch. */
INLINE triple load_common(const double *four)
{
    return triple_of(duo_splat_lane(four, 1), duo_splat_lane(four, 2), duo_splat_lane(four, 3));
}
INLINE triple triple_splat(duo a) { return triple_of(a, a, a); }
INLINE triple triple_splat_reciprocal(int n) { return triple_splat(duo_reciprocal(n)); }
INLINE triple triple_add(triple a, triple b)
{
    return triple_of(duo_add(a.x, b.x), duo_add(a.y, b.y), duo_add(a.z, b.z));
}
INLINE triple triple_mul(triple a, triple b)
{
    return triple_of(duo_mul(a.x, b.x), duo_mul(a.y, b.y), duo_mul(a.z, b.z));
}
INLINE triple triple_fma(triple a, triple b, triple c)
{
    return triple_of(duo_fma(a.x, b.x, c.x), duo_fma(a.y, b.y, c.y), duo_fma(a.z, b.z, c.z));
}
INLINE triple triple_sub(triple a, triple b)
{
    return triple_fma(triple_splat(duo_splat(-1.0)), b, a);
}
INLINE triple triple_yzx(triple a) { return triple_of(a.y, a.z, a.x); }
INLINE triple triple_zxy(triple a) { return triple_of(a.z, a.x, a.y); }
INLINE turned make_turned(triple a) { return a; }
INLINE path_term make_path_term(const double *four) { return four; }
INLINE path_term path_zero(void) { return NULL; }
INLINE turned turned_zero(void) { return triple_splat(duo_splat(0.0)); }
INLINE halves halves_zero(void) { return (halves){turned_zero(), turned_zero()}; }
INLINE halves halves_add(halves a, halves b)
{
    return (halves){triple_add(a.lo, b.lo), triple_add(a.hi, b.hi)};
}
INLINE halves halves_fma(turned a, path_term four, halves c)
{
    const triple b = load_common(four);
    return (halves){triple_fma(triple_yzx(a), triple_zxy(b), c.lo),
                    triple_fma(triple_zxy(a), triple_yzx(b), c.hi)};
}
INLINE triple halves_first(halves a) { return a.lo; }
INLINE triple halves_second(halves a) { return a.hi; }

/* Loads one vector of each tangent. Its x, y and z components are in successive structs. */
INLINE triple load_triple(const double *numbers)
{
    const size_t apart = WORDS * sizeof(kr_tangent) / sizeof(double);
    return triple_of(duo_load(numbers), duo_load(numbers + apart), duo_load(numbers + 2 * apart));
}
INLINE triple load_momentum(const kr_tangent *g, int n) { return load_triple(g[3 * WORDS].x[n]); }
INLINE void store_rotation(kr_tangent *g, int n, triple a)
{
    duo_store(g->x[n], a.x);
    duo_store(g[WORDS].x[n], a.y);
    duo_store(g[2 * WORDS].x[n], a.z);
}
INLINE void store_momentum(kr_tangent *g, int n, triple a) { store_rotation(g + 3 * WORDS, n, a); }
