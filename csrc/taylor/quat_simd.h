/* Vectors of doubles: a `quad` holds one quaternion (w,x,y,z), and a `duo` holds two. Each type is
 * a single hardware vector if the instruction set has vectors of its width, and else a pair of
 * vectors of half the width. Hardware vectors have 8 lanes on x86-64-v4, 4 lanes on x86-64-v3, and
 * 2 lanes on baseline x86-64 and on arm64. With KR_PLAIN (math/isa.h), the smallest vectors are
 * single doubles. The operation fma is a fused multiply-add if the hardware has one, and a product
 * followed by a sum otherwise. Numerical results depend on the hardware only through the
 * availability of a fused multiply-add. This header is compiled once for each instruction set. */
#ifndef KR_QUAT_SIMD_H
#define KR_QUAT_SIMD_H
#include "math/isa.h"

#if defined KR_NEON
#  include <arm_neon.h>
#elif defined __x86_64__ && !defined KR_PLAIN
#  include <immintrin.h>
#endif
#if defined __GNUC__
#  define ALIGNED __attribute__((aligned(64)))
#else
#  define ALIGNED
#endif
/* UNROLL, before a loop over the terms of a series, requests that the compiler unroll the loop,
 * whose length must be a compile-time constant. PER_ORDER declares an inline function with such
 * loops, so that each order of a series has its own copy. UNROLL has no effect, and a PER_ORDER
 * function is compiled only once, if vectors have fewer than eight lanes (unrolled loops would not
 * fit in the instruction cache), or if the build defines KR_ROLLED. */
#if !defined KR_AVX512 || defined KR_PLAIN || defined KR_ROLLED
#  define UNROLL
#  define PER_ORDER static
#elif defined __clang__
#  define UNROLL _Pragma("clang loop unroll_count(32)")
#else
#  define UNROLL _Pragma("GCC unroll 32")
#endif
#if !defined PER_ORDER
#  define PER_ORDER INLINE
#endif

/* NATIVE(T, lanes, fused) defines T as a hardware vector of doubles, and PAIRED(T, half, lanes)
 * defines T as a pair of vectors of type `half`. Both define T_load, T_store, T_splat (copies a
 * number to all lanes), T_add, T_sub, T_mul, and T_fma(a, b, c), which returns a * b + c. NATIVE
 * computes T_fma by the expression `fused`. */
#define NATIVE(T, lanes, fused)                                                                    \
    typedef double T __attribute__((vector_size(8 * lanes)));                                      \
    typedef double T##_at __attribute__((vector_size(8 * lanes), aligned(8), may_alias));          \
    INLINE T T##_load(const double *p) { return *(const T##_at *)p; }                              \
    INLINE void T##_store(double *p, T a) { *(T##_at *)p = a; }                                    \
    INLINE T T##_splat(double a) { return a - (T){0}; }                                            \
    INLINE T T##_add(T a, T b) { return a + b; }                                                   \
    INLINE T T##_sub(T a, T b) { return a - b; }                                                   \
    INLINE T T##_mul(T a, T b) { return a * b; }                                                   \
    INLINE T T##_fma(T a, T b, T c) { return (T)(fused); }
#define PAIRED(T, half, lanes)                                                                     \
    typedef struct {                                                                               \
        half lo, hi;                                                                               \
    } T;                                                                                           \
    INLINE T T##_of(half lo, half hi)                                                              \
    {                                                                                              \
        T r;                                                                                       \
        r.lo = lo;                                                                                 \
        r.hi = hi;                                                                                 \
        return r;                                                                                  \
    }                                                                                              \
    INLINE T T##_load(const double *p)                                                             \
    {                                                                                              \
        return T##_of(half##_load(p), half##_load(p + lanes / 2));                                 \
    }                                                                                              \
    INLINE void T##_store(double *p, T a)                                                          \
    {                                                                                              \
        half##_store(p, a.lo);                                                                     \
        half##_store(p + lanes / 2, a.hi);                                                         \
    }                                                                                              \
    INLINE T T##_splat(double a) { return T##_of(half##_splat(a), half##_splat(a)); }              \
    INLINE T T##_add(T a, T b) { return T##_of(half##_add(a.lo, b.lo), half##_add(a.hi, b.hi)); }  \
    INLINE T T##_sub(T a, T b) { return T##_of(half##_sub(a.lo, b.lo), half##_sub(a.hi, b.hi)); }  \
    INLINE T T##_mul(T a, T b) { return T##_of(half##_mul(a.lo, b.lo), half##_mul(a.hi, b.hi)); }  \
    INLINE T T##_fma(T a, T b, T c)                                                                \
    {                                                                                              \
        return T##_of(half##_fma(a.lo, b.lo, c.lo), half##_fma(a.hi, b.hi, c.hi));                 \
    }

/* The type `two` is a vector of two doubles, and `one` is a double with the operations of vectors.
 * The macro two_mix(a, i, b, j) returns the vector (a[i], b[j]), where i and j are 0 or 1. */
#if defined KR_PLAIN
INLINE double one_load(const double *p) { return *p; }
INLINE void one_store(double *p, double a) { *p = a; }
INLINE double one_splat(double a) { return a; }
INLINE double one_add(double a, double b) { return a + b; }
INLINE double one_sub(double a, double b) { return a - b; }
INLINE double one_mul(double a, double b) { return a * b; }
#  if defined KR_FUSED
INLINE double one_fma(double a, double b, double c) { return fma(a, b, c); }
#  else
INLINE double one_fma(double a, double b, double c) { return a * b + c; }
#  endif
typedef double one;
PAIRED(two, one, 2)
#  define two_mix(a, i, b, j) two_of((i) ? (a).hi : (a).lo, (j) ? (b).hi : (b).lo)
#else
#  if defined KR_FMA
NATIVE(two, 2, _mm_fmadd_pd(a, b, c))
#  elif defined KR_NEON
NATIVE(two, 2, vfmaq_f64(c, a, b))
#  else
NATIVE(two, 2, a *b + c)
#  endif
#  define two_mix(a, i, b, j) __builtin_shufflevector(a, b, i, 2 + j)
#endif

/* A `quad` is a quaternion (w,x,y,z). quad_permute_i, quad_permute_j and quad_permute_k return
 * (x,w,z,y), (y,z,w,x) and (z,y,x,w). Up to the signs of components, these are the products of the
 * quaternion with i, j and k. quad_yzx and quad_zxy return (w,y,z,x) and (w,z,x,y). */
#if defined KR_AVX2 && !defined KR_PLAIN
NATIVE(quad, 4, _mm256_fmadd_pd(a, b, c))
#  define quad_lanes(a, ...) __builtin_shufflevector(a, a, __VA_ARGS__)
INLINE quad quad_permute_i(quad a) { return quad_lanes(a, 1, 0, 3, 2); }
INLINE quad quad_permute_j(quad a) { return quad_lanes(a, 2, 3, 0, 1); }
INLINE quad quad_permute_k(quad a) { return quad_lanes(a, 3, 2, 1, 0); }
INLINE quad quad_yzx(quad a) { return quad_lanes(a, 0, 2, 3, 1); }
INLINE quad quad_zxy(quad a) { return quad_lanes(a, 0, 3, 1, 2); }
#else
PAIRED(quad, two, 4)
INLINE two two_swap(two a) { return two_mix(a, 1, a, 0); }
INLINE quad quad_permute_i(quad a) { return quad_of(two_swap(a.lo), two_swap(a.hi)); }
INLINE quad quad_permute_j(quad a) { return quad_of(a.hi, a.lo); }
INLINE quad quad_permute_k(quad a) { return quad_of(two_swap(a.hi), two_swap(a.lo)); }
INLINE quad quad_yzx(quad a)
{
    return quad_of(two_mix(a.lo, 0, a.hi, 0), two_mix(a.hi, 1, a.lo, 1));
}
INLINE quad quad_zxy(quad a)
{
    return quad_of(two_mix(a.lo, 0, a.hi, 1), two_mix(a.lo, 1, a.hi, 0));
}
#endif

/* A `duo` is a pair of quaternions. duo_permute_i applies quad_permute_i to both quaternions, and
 * so on. duo_first and duo_second return the first and the second quaternion. duo_yzx_zxy(a) is the
 * pair of quad_yzx(a) and quad_zxy(a), and duo_zxy_yzx(a) is this pair in reverse order.
 * duo_splat_lane_of returns w[lane] in all SIMD lanes, for lane = 1, 2 or 3. `permuted_w` must be
 * duo_yzx_zxy(quad_load(w)). If vectors have eight lanes, the number is taken from `permuted_w`,
 * because a load of w[lane] from memory would be slower. */
#if defined KR_AVX512 && !defined KR_PLAIN
NATIVE(duo, 8, _mm512_fmadd_pd(a, b, c))
#  define duo_lanes(a, ...) __builtin_shufflevector(a, a, __VA_ARGS__)
INLINE duo duo_permute_i(duo a) { return duo_lanes(a, 1, 0, 3, 2, 5, 4, 7, 6); }
INLINE duo duo_permute_j(duo a) { return duo_lanes(a, 2, 3, 0, 1, 6, 7, 4, 5); }
INLINE duo duo_permute_k(duo a) { return duo_lanes(a, 3, 2, 1, 0, 7, 6, 5, 4); }
INLINE duo duo_yzx_zxy(quad a) { return duo_lanes(a, 0, 2, 3, 1, 0, 3, 1, 2); }
INLINE duo duo_zxy_yzx(quad a) { return duo_lanes(a, 0, 3, 1, 2, 0, 2, 3, 1); }
INLINE quad duo_first(duo a) { return duo_lanes(a, 0, 1, 2, 3); }
INLINE quad duo_second(duo a) { return duo_lanes(a, 4, 5, 6, 7); }
INLINE duo duo_splat_lane_of(duo permuted_w, const double *w, int lane)
{
    (void)w;
    if (lane == 1) return duo_lanes(permuted_w, 3, 3, 3, 3, 3, 3, 3, 3);
    return lane == 2 ? duo_lanes(permuted_w, 1, 1, 1, 1, 1, 1, 1, 1)
                     : duo_lanes(permuted_w, 2, 2, 2, 2, 2, 2, 2, 2);
}
#else
PAIRED(duo, quad, 8)
INLINE duo duo_permute_i(duo a) { return duo_of(quad_permute_i(a.lo), quad_permute_i(a.hi)); }
INLINE duo duo_permute_j(duo a) { return duo_of(quad_permute_j(a.lo), quad_permute_j(a.hi)); }
INLINE duo duo_permute_k(duo a) { return duo_of(quad_permute_k(a.lo), quad_permute_k(a.hi)); }
INLINE duo duo_yzx_zxy(quad a) { return duo_of(quad_yzx(a), quad_zxy(a)); }
INLINE duo duo_zxy_yzx(quad a) { return duo_of(quad_zxy(a), quad_yzx(a)); }
INLINE quad duo_first(duo a) { return a.lo; }
INLINE quad duo_second(duo a) { return a.hi; }
INLINE duo duo_splat_lane_of(duo permuted_w, const double *w, int lane)
{
    (void)permuted_w;
    return duo_splat(w[lane]);
}
#endif

/* If SIDE_BY_SIDE is 1, series.h adds the terms of a sum in two parallel chains, which hides
 * latency. Instruction sets without fused multiply-add have too few vector registers for two
 * chains. scalar_fma returns a * b + c, by a fused multiply-add if the hardware has one. */
#if defined KR_FUSED
enum { SIDE_BY_SIDE = 1 };
INLINE double scalar_fma(double a, double b, double c) { return fma(a, b, c); }
#else
enum { SIDE_BY_SIDE = 0 };
INLINE double scalar_fma(double a, double b, double c) { return a * b + c; }
#endif

/* duo_splat_lane returns w[lane] in all SIMD lanes. duo_scale multiplies the lanes of `a` by eight
 * doubles. In all lanes, duo_span and quad_span return *to - *from, and duo_reciprocal and
 * quad_reciprocal return 1 / n. copy_number copies *from to *to. In quat_simd_dd.h, `w`, `from` and
 * `to` point to the high words of double-doubles, but `exact` points to doubles. */
INLINE duo duo_splat_lane(const double *w, int lane) { return duo_splat(w[lane]); }
INLINE duo duo_scale(const double exact[8], duo a) { return duo_mul(duo_load(exact), a); }
INLINE duo duo_span(const double *from, const double *to) { return duo_splat(*to - *from); }
INLINE quad quad_span(const double *from, const double *to) { return quad_splat(*to - *from); }
INLINE void copy_number(double *to, const double *from) { *to = *from; }
INLINE duo duo_reciprocal(int n) { return duo_splat(1.0 / n); }
INLINE quad quad_reciprocal(int n) { return quad_splat(1.0 / n); }
#endif
