/* Macros for source files that are compiled once for each instruction set: base, avx2 and avx512.
 * KR_NAME(f) is the name f_base, f_avx2 or f_avx512 of an exported function f. The set base, the
 * baseline, is the compiler's default set, or the lowest set in the CMake option KREISEL_ISA. For
 * the other sets, CMakeLists.txt defines KR_ISA as avx2 or avx512. The build also defines
 * KR_WITH_AVX2 and KR_WITH_AVX512 if it includes these sets besides the baseline. */
#ifndef KR_ISA_H
#define KR_ISA_H
#include <math.h> /* FP_FAST_FMA */

/* KR_FMA, KR_AVX2 and KR_AVX512 are defined if the compiler may use FMA, AVX2 or AVX-512
 * instructions. kreisel.c, the library in one file (cmake/amalgamate.py), permits these
 * instructions by function attributes instead of compiler options. Because clang then does not
 * define macros such as __AVX2__, kreisel.c defines KR_TARGET_AVX2 and similar macros. */
#if defined __FMA__ || defined KR_TARGET_FMA
#  define KR_FMA
#endif
#if defined __AVX2__ || defined KR_TARGET_AVX2
#  define KR_AVX2
#endif
#if defined __AVX512F__ || defined KR_TARGET_AVX512F
#  define KR_AVX512
#endif
/* KR_FUSED is defined if the compiler may use fused multiply-add. Two instruction sets give bitwise
 * identical results if both use fused multiply-add or if neither does. */
#if defined KR_FMA || defined __aarch64__ || defined FP_FAST_FMA
#  define KR_FUSED
#endif

/* INLINE forces the compiler to inline a function, because a call in a loop of SIMD code would save
 * all vector registers to memory. APART keeps rarely called code out of its callers. If KR_SMALL or
 * KR_SMALL_FILE is defined, the compiler decides what to inline, which gives smaller code. A file
 * with KR_LONG_FUNCTIONS is compiled with KR_SMALL_FILE if it is compiled without FMA, and the
 * build either includes AVX2 or AVX-512, or is limited to one instruction set (KR_ONE_ISA). */
#if defined KR_LONG_FUNCTIONS && !defined KR_FUSED
#  if defined KR_WITH_AVX2 || defined KR_WITH_AVX512 || defined KR_ONE_ISA
#    define KR_SMALL_FILE
#  endif
#endif
#if defined __GNUC__ && !defined KR_SMALL && !defined KR_SMALL_FILE
#  define INLINE static inline __attribute__((always_inline))
#  define APART static __attribute__((noinline))
#else
#  define INLINE static inline
#  define APART static
#endif

/* KR_BATCHED(function) is `function`, which computes several tops or times at once, or NULL if
 * KR_NO_BATCHES is defined. Callers then compute each top and time alone, with the same result. */
#ifdef KR_NO_BATCHES
#  define KR_BATCHED(function) NULL
#else
#  define KR_BATCHED(function) function
#endif

/* KR_PLAIN selects standard C99 without SIMD vector types. This header defines KR_PLAIN if the
 * compiler lacks __builtin_shufflevector. KR_BASE_NAME is the baseline's name for users: "neon" on
 * aarch64 without KR_PLAIN, else the name that the build (isa.cmake) defines, if any, or "base". */
#if !defined KR_PLAIN && (!defined __GNUC__ || (!defined __clang__ && __GNUC__ < 12))
#  define KR_PLAIN
#endif
#if defined __aarch64__ && !defined KR_PLAIN
#  define KR_NEON
#  define KR_BASE_NAME "neon"
#elif !defined KR_BASE_NAME
#  define KR_BASE_NAME "base"
#endif
#if !defined KR_ISA
#  define KR_ISA base
#endif
#define KR_PASTE(a, b) a##_##b
#define KR_PASTED(a, b) KR_PASTE(a, b)
#define KR_NAME(thing) KR_PASTED(thing, KR_ISA)

/* KR_SCALAR_NAME(thing) is the variant of the scalar function `thing` that is called with AVX-512:
 * that for AVX2, which would not be slower, or that for the baseline if AVX2 is no separate set. */
#if defined KR_WITH_AVX2
#  define KR_SCALAR_NAME(thing) thing##_avx2
#else
#  define KR_SCALAR_NAME(thing) thing##_base
#endif

/* kr_has_base returns 1. kr_has_avx2 and kr_has_avx512 return 1 if the processor supports the set,
 * else 0; they test single features, because some compilers do not know levels like x86-64-v4. */
static inline int kr_has_base(void) { return 1; }
#if defined KR_WITH_AVX2 || defined KR_WITH_AVX512
static inline int kr_has_avx2(void)
{
    return (__builtin_cpu_supports("avx2") != 0) & (__builtin_cpu_supports("fma") != 0);
}
#endif
#if defined KR_WITH_AVX512
static inline int kr_has_avx512(void)
{
    return kr_has_avx2() & (__builtin_cpu_supports("avx512f") != 0) &
           (__builtin_cpu_supports("avx512vl") != 0) & (__builtin_cpu_supports("avx512dq") != 0);
}
#endif
#endif
