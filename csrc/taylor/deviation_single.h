/* Implements the types and operations of deviation.h for single tangents: a `triple` is (0,x,y,z),
 * a `turned` is (0,y,z,x | 0,z,x,y), and a `path_term` is (0,z,x,y | 0,y,z,x). Three tangents are
 * computed in parallel, because each instruction for one tangent must wait for the previous one. */
#include "tangents.h"

enum {
    AT_ONCE = 3,    /* tangents computed in parallel */
    BLOCK = 4,      /* terms added in one pass of a loop */
    BEFORE = BLOCK, /* zeros before the coefficients of the path */
    CHAINS = 2,     /* parallel chains of a sum */
    STRUCTS = WORDS /* distance between tangents, in structs */
};
typedef quad triple;
typedef duo turned, path_term, halves;

INLINE triple load_common(const double *four) { return quad_load(four); }
INLINE triple triple_splat_reciprocal(int n) { return quad_reciprocal(n); }
INLINE triple triple_add(triple a, triple b) { return quad_add(a, b); }
INLINE triple triple_sub(triple a, triple b) { return quad_fma(quad_splat(-1.0), b, a); }
INLINE triple triple_mul(triple a, triple b) { return quad_mul(a, b); }
INLINE triple triple_fma(triple a, triple b, triple c) { return quad_fma(a, b, c); }
INLINE triple triple_yzx(triple a) { return quad_yzx(a); }
INLINE triple triple_zxy(triple a) { return quad_zxy(a); }
INLINE turned make_turned(triple a) { return duo_yzx_zxy(a); }
INLINE path_term make_path_term(const double *four) { return duo_zxy_yzx(quad_load(four)); }
INLINE path_term path_zero(void) { return duo_splat(0.0); }
INLINE turned turned_zero(void) { return duo_splat(0.0); }
INLINE halves halves_zero(void) { return duo_splat(0.0); }
INLINE halves halves_add(halves a, halves b) { return duo_add(a, b); }
INLINE halves halves_fma(turned a, path_term b, halves c) { return duo_fma(a, b, c); }
INLINE triple halves_first(halves a) { return duo_first(a); }
INLINE triple halves_second(halves a) { return duo_second(a); }

INLINE triple load_triple(const double *four) { return quad_load(four); }
INLINE triple load_momentum(const kr_tangent *g, int n) { return quad_load(g->x[n] + 4); }
INLINE void store_rotation(kr_tangent *g, int n, triple a) { quad_store(g->x[n], a); }
INLINE void store_momentum(kr_tangent *g, int n, triple a) { quad_store(g->x[n] + 4, a); }
