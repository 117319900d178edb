/* SIMD vectors of doubles. Each lane is computed independently, for a different top or a different
 * time. The bits of a lane depend on whether KR_FUSED (isa.h) is defined, but not on the number of
 * lanes. The type `wide` has as many lanes as a vector of the instruction set: 8 for AVX-512, 4 for
 * AVX2, 2 for SSE2 and NEON, but 1 in plain C99 or if KR_ONE_LANE is defined. The operators + - * /
 * and unary - apply to values of type `wide`; one operand of + - * / may be a double. A `mask` has
 * one Boolean value per lane. wide_fma(a, b, c) returns a * b + c, with one rounding if KR_FUSED is
 * defined, else with two. This header is compiled once for each instruction set. */
#ifndef KR_SIMD_H
#define KR_SIMD_H
#include <stdint.h>
#include <string.h>
#include "isa.h"

#if defined KR_ONE_LANE || defined KR_PLAIN || !(defined __SSE2__ || defined KR_NEON)
enum { LANES = 1 };
#  define WIDE_LANE(a, i) (a)
typedef double wide;
typedef uint64_t wide_integer; /* the bit patterns of the lanes, as integers */
typedef int mask;
static inline wide wide_splat(double a) { return a; }
static inline wide wide_sqrt(wide a) { return sqrt(a); }
static inline mask wide_less(wide a, wide b) { return a < b; }
static inline mask wide_at_most(wide a, wide b) { return a <= b; }
static inline mask wide_equal(wide a, wide b) { return a == b; }
static inline mask mask_and(mask a, mask b) { return a & b; }
static inline mask mask_or(mask a, mask b) { return a | b; }
static inline mask mask_not(mask a) { return !a; }
/* Returns the mask as an integer: bit i is set if lane i is true. */
static inline unsigned mask_bits(mask a) { return (unsigned)a; }
static inline wide wide_choose(mask m, wide yes, wide no) { return m ? yes : no; }
#  if defined KR_FUSED
static inline wide wide_fma(wide a, wide b, wide c) { return fma(a, b, c); }
#  else
static inline wide wide_fma(wide a, wide b, wide c) { return a * b + c; }
#  endif
#elif defined KR_NEON
#  include <arm_neon.h>
enum { LANES = 2 };
typedef double wide __attribute__((vector_size(8 * LANES)));
typedef uint64_t wide_integer __attribute__((vector_size(8 * LANES)));
typedef uint64x2_t mask;
INLINE wide wide_splat(double a) { return a - (wide){0}; }
INLINE wide wide_sqrt(wide a) { return (wide)vsqrtq_f64(a); }
INLINE mask wide_less(wide a, wide b) { return vcltq_f64(a, b); }
INLINE mask wide_at_most(wide a, wide b) { return vcleq_f64(a, b); }
INLINE mask wide_equal(wide a, wide b) { return vceqq_f64(a, b); }
INLINE mask mask_and(mask a, mask b) { return a & b; }
INLINE mask mask_or(mask a, mask b) { return a | b; }
INLINE mask mask_not(mask a) { return ~a; }
INLINE unsigned mask_bits(mask a) { return (unsigned)((a[0] & 1) | (a[1] & 2)); }
INLINE wide wide_choose(mask m, wide yes, wide no) { return (wide)vbslq_f64(m, yes, no); }
INLINE wide wide_fma(wide a, wide b, wide c) { return (wide)vfmaq_f64(c, a, b); }
#else
#  include <immintrin.h>
#  if defined KR_AVX512
enum { LANES = 8 };
#    define WIDE_DO(what, ...) _mm512_##what(__VA_ARGS__)
#    define WIDE_LESS(a, b) _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ)
#    define WIDE_AT_MOST(a, b) _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ)
#    define WIDE_EQUAL(a, b) _mm512_cmp_pd_mask(a, b, _CMP_EQ_OQ)
typedef __mmask8 mask;
#  elif defined KR_AVX2
enum { LANES = 4 };
#    define WIDE_DO(what, ...) _mm256_##what(__VA_ARGS__)
#    define WIDE_LESS(a, b) _mm256_cmp_pd(a, b, _CMP_LT_OQ)
#    define WIDE_AT_MOST(a, b) _mm256_cmp_pd(a, b, _CMP_LE_OQ)
#    define WIDE_EQUAL(a, b) _mm256_cmp_pd(a, b, _CMP_EQ_OQ)
typedef __m256d mask;
#  else
enum { LANES = 2 };
#    define WIDE_DO(what, ...) _mm_##what(__VA_ARGS__)
#    define WIDE_LESS(a, b) _mm_cmplt_pd(a, b)
#    define WIDE_AT_MOST(a, b) _mm_cmple_pd(a, b)
#    define WIDE_EQUAL(a, b) _mm_cmpeq_pd(a, b)
typedef __m128d mask;
#  endif
typedef double wide __attribute__((vector_size(8 * LANES)));
typedef uint64_t wide_integer __attribute__((vector_size(8 * LANES)));
INLINE wide wide_splat(double a) { return a - (wide){0}; }
INLINE wide wide_sqrt(wide a) { return (wide)WIDE_DO(sqrt_pd, a); }
INLINE mask wide_less(wide a, wide b) { return WIDE_LESS(a, b); }
INLINE mask wide_at_most(wide a, wide b) { return WIDE_AT_MOST(a, b); }
INLINE mask wide_equal(wide a, wide b) { return WIDE_EQUAL(a, b); }
#  if defined KR_AVX512
INLINE mask mask_and(mask a, mask b) { return (mask)(a & b); }
INLINE mask mask_or(mask a, mask b) { return (mask)(a | b); }
INLINE mask mask_not(mask a) { return (mask)~a; }
INLINE unsigned mask_bits(mask a) { return a; }
INLINE wide wide_choose(mask m, wide yes, wide no) { return _mm512_mask_blend_pd(m, no, yes); }
#  else
INLINE mask mask_and(mask a, mask b) { return WIDE_DO(and_pd, a, b); }
INLINE mask mask_or(mask a, mask b) { return WIDE_DO(or_pd, a, b); }
INLINE mask mask_not(mask a) { return WIDE_DO(xor_pd, a, (mask)((wide_integer){0} - 1)); }
INLINE unsigned mask_bits(mask a) { return (unsigned)WIDE_DO(movemask_pd, a); }
INLINE wide wide_choose(mask m, wide yes, wide no)
{
    return (wide)WIDE_DO(or_pd, WIDE_DO(and_pd, m, yes), WIDE_DO(andnot_pd, m, no));
}
#  endif
#  if defined KR_FMA
INLINE wide wide_fma(wide a, wide b, wide c) { return (wide)WIDE_DO(fmadd_pd, a, b, c); }
#  else
INLINE wide wide_fma(wide a, wide b, wide c) { return a * b + c; }
#  endif
#endif

#if !defined WIDE_LANE
#  define WIDE_LANE(a, i) (a)[i]
#endif
/* Returns from[i][k] in each lane i. */
INLINE wide wide_gather(const double *const from[], int k)
{
    wide r = wide_splat(0.0);
    for (int i = 0; i < LANES; i++) WIDE_LANE(r, i) = from[i][k];
    return r;
}
/* Loads one double per SIMD lane; the address need not be aligned. */
INLINE wide wide_load(const double *p)
{
    wide a;
    memcpy(&a, p, sizeof a);
    return a;
}
/* Loads a vector like wide_load, and forces gcc to keep the vector in a register. With AVX-512, gcc
 * would load the vector again at each use, and the loads would take longer than the arithmetic. */
INLINE wide wide_load_to_register(const double *p)
{
    wide a = wide_load(p);
#if defined KR_AVX512 && !defined KR_PLAIN && !defined __clang__
    __asm__("" : "+v"(a));
#endif
    return a;
}
INLINE void wide_store(double *p, wide a) { memcpy(p, &a, sizeof a); }
/* Returns the bit patterns of the lanes. wide_of_bits is the inverse. */
INLINE wide_integer wide_bits(wide a)
{
    wide_integer r;
    memcpy(&r, &a, sizeof r);
    return r;
}
INLINE wide wide_of_bits(wide_integer a)
{
    wide r;
    memcpy(&r, &a, sizeof r);
    return r;
}
/* Zeroes the upper halves of the AVX registers. Must be called after code that uses `wide`, because
 * later SSE code would otherwise run slowly on some processors. */
INLINE void wide_zero_upper(void)
{
#if defined KR_AVX2 && !defined KR_ONE_LANE && !defined KR_PLAIN
    _mm256_zeroupper();
#endif
}
INLINE int mask_any(mask a) { return mask_bits(a) != 0; }
INLINE int mask_all(mask a) { return (mask_bits(a) & ((1u << LANES) - 1)) == (1u << LANES) - 1; }
INLINE wide wide_abs(wide a) { return wide_of_bits(wide_bits(a) & (UINT64_MAX >> 1)); }
/* wide_min and wide_max return b in lanes where a or b is NaN, unlike fmin and fmax. */
INLINE wide wide_min(wide a, wide b) { return wide_choose(wide_less(a, b), a, b); }
INLINE wide wide_max(wide a, wide b) { return wide_choose(wide_less(b, a), a, b); }
#endif
