/* Instruction sets. A file compiled once per set names what it exports by KR_NAME;
 * -DKR_SET=avx2 and the like come from CMakeLists.txt, which defines KR_X86 where these sets were
 * compiled in. */
#ifndef KR_SETS_H
#define KR_SETS_H

#if !defined KR_ISA
#  define KR_ISA base
#endif
#define KR_PASTE(a, b) a##_##b
#define KR_PASTED(a, b) KR_PASTE(a, b)
#define KR_NAME(thing) KR_PASTED(thing, KR_ISA)

static inline int kr_has_base(void) { return 1; }
#if defined KR_X86
static inline int kr_has_avx2(void)
{
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}
static inline int kr_has_avx512(void)
{
    return kr_has_avx2() && __builtin_cpu_supports("avx512f") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq");
}
#endif
#endif
