/* What a file needs that is compiled once per instruction set. It names what it exports by
 * KR_NAME. CMakeLists.txt passes -DKR_ISA=avx2 and the like, and defines KR_X86 where these
 * instruction sets were compiled in. */
#ifndef KR_ISA_H
#define KR_ISA_H
#include <math.h> /* FP_FAST_FMA */

/* A kernel is one loop from which nothing is called: a call would send the vectors that the loop
 * keeps in registers through memory. What a kernel seldom needs stands APART from it. KR_SMALL
 * leaves it to the compiler what is called, for small code. */
#if defined __GNUC__ && !defined KR_SMALL
#  define INLINE static inline __attribute__((always_inline))
#  define APART static __attribute__((noinline))
#else
#  define INLINE static inline
#  define APART static
#endif

/* Vectors need a compiler that can shuffle them; KR_PLAIN does without any. NEON is part of every
 * aarch64, so that the instruction set which runs everywhere has a name of its own there. */
#if !defined KR_PLAIN && (!defined __GNUC__ || (!defined __clang__ && __GNUC__ < 12))
#  define KR_PLAIN
#endif
#if defined __aarch64__ && !defined KR_PLAIN
#  define KR_NEON
#  define KR_BASE_NAME "neon"
#else
#  define KR_BASE_NAME "base"
#endif
/* KR_FUSED says that the hardware has a fused product: there are two sets of bits, not more. */
#if defined __FMA__ || defined __aarch64__ || defined FP_FAST_FMA
#  define KR_FUSED
#endif
#if !defined KR_ISA
#  define KR_ISA base
#endif
#define KR_PASTE(a, b) a##_##b
#define KR_PASTED(a, b) KR_PASTE(a, b)
#define KR_NAME(thing) KR_PASTED(thing, KR_ISA)

/* Each of these says whether this processor has the instruction set. Its features are asked for one
 * by one, because not every compiler knows the names of the levels. One machine answers in one way:
 * what is done without them is tested by name. */
static inline int kr_has_base(void) { return 1; }
#if defined KR_X86
static inline int kr_has_avx2(void)
{
    return (__builtin_cpu_supports("avx2") != 0) & (__builtin_cpu_supports("fma") != 0);
}
static inline int kr_has_avx512(void)
{
    return kr_has_avx2() & (__builtin_cpu_supports("avx512f") != 0) &
           (__builtin_cpu_supports("avx512vl") != 0) & (__builtin_cpu_supports("avx512dq") != 0);
}
#endif
#endif
