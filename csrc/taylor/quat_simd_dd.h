/* Vectors of double-doubles: each lane is an unevaluated sum hi + lo of about 31 digits (Dekker
 * 1971). In memory, each low word follows its high word at a distance of sizeof(kr_series) bytes.
 * Macros at the end of this file redefine the names of quat_simd.h for double-double vectors. This
 * header is compiled once for each instruction set. */
#ifndef KR_QUAT_SIMD_DD_H
#define KR_QUAT_SIMD_DD_H
#include "math/dd.h"
#include "quat_simd.h"
#include "taylor.h"

/* Both functions return the address of the low words that belong to the high words at `hi`. */
INLINE const double *low_words(const double *hi)
{
    return (const double *)((const char *)hi + sizeof(kr_series));
}
INLINE double *writable_low_words(double *hi) { return (double *)((char *)hi + sizeof(kr_series)); }

/* PRODUCT_ERROR defines a function T_error(a, b, ab) for vectors of type T, which returns the exact
 * product of a and b minus the rounded product ab. Without fused multiply-add, T_error splits each
 * factor into halves of 26 bits (Dekker 1971), and T_top returns the upper half. */
#if defined KR_FMA || defined __aarch64__
#  define PRODUCT_ERROR(T)                                                                         \
      INLINE T T##_error(T a, T b, T ab) { return T##_fma(a, b, T##_sub(T##_splat(0.0), ab)); }
#else
#  define PRODUCT_ERROR(T)                                                                         \
      INLINE T T##_top(T a)                                                                        \
      {                                                                                            \
          const T c = T##_mul(T##_splat(134217729.0), a);                                          \
          return T##_sub(c, T##_sub(c, a));                                                        \
      }                                                                                            \
      INLINE T T##_error(T a, T b, T ab)                                                           \
      {                                                                                            \
          const T p = T##_top(a), q = T##_top(b), r = T##_sub(a, p), t = T##_sub(b, q);            \
          const T e = T##_add(T##_add(T##_sub(T##_mul(p, q), ab), T##_mul(p, t)), T##_mul(r, q));  \
          return T##_add(e, T##_mul(r, t));                                                        \
      }
#endif

/* DOUBLED defines a type D of double-double vectors, whose members hi and lo are vectors of type T,
 * and the operations D_add, D_mul and so on. D_mul and D_store normalize the numbers that they
 * return or write: |lo| is at most half a unit in the last place of hi. For speed, D_add and D_fma
 * do not normalize their results. D_product is D_mul without normalization. */
#define DOUBLED(D, T)                                                                              \
    PRODUCT_ERROR(T)                                                                               \
    typedef struct {                                                                               \
        T hi, lo;                                                                                  \
    } D;                                                                                           \
    INLINE D D##_of(T hi, T lo)                                                                    \
    {                                                                                              \
        D r;                                                                                       \
        r.hi = hi;                                                                                 \
        r.lo = lo;                                                                                 \
        return r;                                                                                  \
    }                                                                                              \
    INLINE D D##_normal(T hi, T lo)                                                                \
    {                                                                                              \
        const T s = T##_add(hi, lo);                                                               \
        return D##_of(s, T##_sub(lo, T##_sub(s, hi)));                                             \
    }                                                                                              \
    INLINE D D##_load_doubles(const double *p) { return D##_of(T##_load(p), T##_splat(0.0)); }     \
    INLINE D D##_load(const double *p) { return D##_of(T##_load(p), T##_load(low_words(p))); }     \
    INLINE void D##_store(double *p, D a)                                                          \
    {                                                                                              \
        const D n = D##_normal(a.hi, a.lo);                                                        \
        T##_store(p, n.hi);                                                                        \
        T##_store(writable_low_words(p), n.lo);                                                    \
    }                                                                                              \
    INLINE D D##_splat(double a) { return D##_of(T##_splat(a), T##_splat(0.0)); }                  \
    INLINE D D##_reciprocal(int n)                                                                 \
    {                                                                                              \
        const double hi = 1.0 / n;                                                                 \
        return D##_of(T##_splat(hi), T##_splat(fma(-hi, n, 1.0) / n));                             \
    }                                                                                              \
    INLINE D D##_span(const double *from, const double *to)                                        \
    {                                                                                              \
        const dd h = dd_add(two_sum(*to, -*from), dd_of(*low_words(to) - *low_words(from)));       \
        return D##_of(T##_splat(h.hi), T##_splat(h.lo));                                           \
    }                                                                                              \
    INLINE D D##_product(D a, D b)                                                                 \
    {                                                                                              \
        const T p = T##_mul(a.hi, b.hi);                                                           \
        return D##_of(p, T##_fma(a.lo, b.hi, T##_fma(a.hi, b.lo, T##_error(a.hi, b.hi, p))));      \
    }                                                                                              \
    INLINE D D##_add(D a, D b)                                                                     \
    {                                                                                              \
        const T s = T##_add(a.hi, b.hi), v = T##_sub(s, a.hi);                                     \
        const T e = T##_add(T##_sub(a.hi, T##_sub(s, v)), T##_sub(b.hi, v));                       \
        return D##_of(s, T##_add(T##_add(a.lo, b.lo), e));                                         \
    }                                                                                              \
    INLINE D D##_mul(D a, D b)                                                                     \
    {                                                                                              \
        const D p = D##_product(a, b);                                                             \
        return D##_normal(p.hi, p.lo);                                                             \
    }                                                                                              \
    INLINE D D##_fma(D a, D b, D c) { return D##_add(c, D##_product(a, b)); }
DOUBLED(duo2, duo)
DOUBLED(quad2, quad)

/* BOTH_WORDS defines an operation D_name that permutes the lanes of both words like T_name. */
#define BOTH_WORDS(D, T, name)                                                                     \
    INLINE D D##_##name(D a) { return D##_of(T##_##name(a.hi), T##_##name(a.lo)); }
BOTH_WORDS(duo2, duo, permute_i)
BOTH_WORDS(duo2, duo, permute_j)
BOTH_WORDS(duo2, duo, permute_k)
BOTH_WORDS(quad2, quad, yzx)
BOTH_WORDS(quad2, quad, zxy)
INLINE duo2 duo2_yzx_zxy(quad2 a) { return duo2_of(duo_yzx_zxy(a.hi), duo_yzx_zxy(a.lo)); }
INLINE duo2 duo2_zxy_yzx(quad2 a) { return duo2_of(duo_zxy_yzx(a.hi), duo_zxy_yzx(a.lo)); }
INLINE quad2 duo2_first(duo2 a) { return quad2_of(duo_first(a.hi), duo_first(a.lo)); }
INLINE quad2 duo2_second(duo2 a) { return quad2_of(duo_second(a.hi), duo_second(a.lo)); }
INLINE duo2 duo2_splat_lane(const double *w, int lane)
{
    return duo2_of(duo_splat_lane(w, lane), duo_splat_lane(low_words(w), lane));
}
INLINE duo2 duo2_splat_lane_of(duo2 permuted_w, const double *w, int lane)
{
    (void)permuted_w;
    return duo2_splat_lane(w, lane);
}
INLINE void copy_both_words(double *to, const double *from)
{
    *to = *from;
    *writable_low_words(to) = *low_words(from);
}
INLINE duo2 duo2_scale(const double exact[8], duo2 a)
{
    return duo2_of(duo_scale(exact, a.hi), duo_scale(exact, a.lo));
}

/* series.h and deviation.h use the names of quat_simd.h: duo, quad, and their functions. The macros
 * below redefine these names, so that both headers can be compiled in double-double precision.
 * Loops are not unrolled, because the loop bodies are too long. */
#undef UNROLL
#define UNROLL
#define duo duo2
#define duo_load_doubles duo2_load_doubles
#define duo_load duo2_load
#define duo_store duo2_store
#define duo_splat duo2_splat
#define duo_span duo2_span
#define duo_reciprocal duo2_reciprocal
#define duo_add duo2_add
#define duo_mul duo2_mul
#define duo_fma duo2_fma
#define duo_permute_i duo2_permute_i
#define duo_permute_j duo2_permute_j
#define duo_permute_k duo2_permute_k
#define duo_yzx_zxy duo2_yzx_zxy
#define duo_zxy_yzx duo2_zxy_yzx
#define duo_first duo2_first
#define duo_second duo2_second
#define duo_splat_lane duo2_splat_lane
#define duo_splat_lane_of duo2_splat_lane_of
#define duo_scale duo2_scale
#define copy_number copy_both_words
#define quad quad2
#define quad_load_doubles quad2_load_doubles
#define quad_load quad2_load
#define quad_store quad2_store
#define quad_splat quad2_splat
#define quad_span quad2_span
#define quad_reciprocal quad2_reciprocal
#define quad_add quad2_add
#define quad_mul quad2_mul
#define quad_fma quad2_fma
#define quad_yzx quad2_yzx
#define quad_zxy quad2_zxy
#endif
