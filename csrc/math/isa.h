/* Support for files that are compiled once for each instruction set. KR_NAME appends the name of
 * the instruction set to the names of exported functions. For each additional instruction set,
 * CMakeLists.txt passes an option such as -DKR_ISA=avx2. CMakeLists.txt also defines KR_WITH_AVX2
 * and KR_WITH_AVX512 if these instruction sets are included in the build. KR_BASE_NAME is the name
 * of the baseline instruction set. */
#ifndef KR_ISA_H
#define KR_ISA_H
#include <math.h> /* FP_FAST_FMA */

/* Macros that are defined if the compiler may use FMA, AVX2 and AVX-512 instructions. The
 * amalgamated kreisel.c (cmake/amalgamate.py) selects x86 features by function attributes. Because
 * clang defines no macros for function attributes, kreisel.c defines KR_TARGET_AVX2 and similar
 * macros. */
#if defined __FMA__ || defined KR_TARGET_FMA
#  define KR_FMA
#endif
#if defined __AVX2__ || defined KR_TARGET_AVX2
#  define KR_AVX2
#endif
#if defined __AVX512F__ || defined KR_TARGET_AVX512F
#  define KR_AVX512
#endif
/* KR_FUSED is defined if the hardware has fused multiply-add. Two instruction sets give bitwise
 * identical results if KR_FUSED is defined for both or for neither. */
#if defined KR_FMA || defined __aarch64__ || defined FP_FAST_FMA
#  define KR_FUSED
#endif

/* INLINE forces the compiler to inline a function. A function call in the loop of a kernel would
 * force all vector registers to be saved to memory. APART prevents the compiler from inlining
 * functions that kernels rarely call. If KR_SMALL is defined, the compiler decides what to inline,
 * which makes the code smaller. Source files that contain long functions define KR_LONG_FUNCTIONS.
 * In some builds without fused multiply-add, the compiler also decides in such files. */
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

/* If KR_NO_BATCHES is defined, the elements of a batch are computed one by one. KR_NO_BATCHES makes
 * the code smaller, but does not change the results. */
#ifdef KR_NO_BATCHES
#  define KR_BATCHED(function) NULL
#else
#  define KR_BATCHED(function) function
#endif

/* Vector code requires a compiler with __builtin_shufflevector. If KR_PLAIN is defined, the code is
 * standard C99 without SIMD vector types. On aarch64, the base instruction set is called neon,
 * because every aarch64 processor has NEON. */
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

/* KR_SCALAR_NAME forms the name of the scalar version of a function. The AVX-512 code uses the AVX2
 * versions of scalar functions, because wider registers would not make scalar code faster. */
#if defined KR_WITH_AVX2
#  define KR_SCALAR_NAME(thing) thing##_avx2
#else
#  define KR_SCALAR_NAME(thing) thing##_base
#endif

/* Each function returns nonzero if the current processor supports the instruction set. CPU features
 * are tested individually, because some compilers do not recognize the names of processor levels,
 * such as x86-64-v4. */
static inline int kr_has_base(void) { return 1; }
#if defined KR_WITH_AVX2 || defined KR_WITH_AVX512
/* Returns 1 if the processor supports AVX2 and FMA. */
static inline int kr_has_avx2(void)
{
    return (__builtin_cpu_supports("avx2") != 0) & (__builtin_cpu_supports("fma") != 0);
}
#endif
#if defined KR_WITH_AVX512
/* Returns 1 if the processor supports AVX2, FMA, and the parts F, VL and DQ of AVX-512. */
static inline int kr_has_avx512(void)
{
    return kr_has_avx2() & (__builtin_cpu_supports("avx512f") != 0) &
           (__builtin_cpu_supports("avx512vl") != 0) & (__builtin_cpu_supports("avx512dq") != 0);
}
#endif
#endif
