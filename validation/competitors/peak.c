/* Prints the peak of one core in floating-point operations per second: the largest rate of fused
 * multiply-adds, each counted as two operations. Compiled for the processor at hand by peak.py. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>

/* The widest vectors, and enough independent sums to hide the latency, all in registers. */
#if defined __AVX512F__
enum { LANES = 8, SUMS = 16 };
#elif defined __AVX__
enum { LANES = 4, SUMS = 12 };
#elif defined __x86_64__
enum { LANES = 2, SUMS = 12 };
#else
enum { LANES = 2, SUMS = 16 };
#endif
enum { ROUNDS = 100000, REPEATS = 50 };
#if defined __clang__
#  define UNROLL _Pragma("clang loop unroll(full)")
#else
#  define UNROLL _Pragma("GCC unroll 16")
#endif
typedef double vector __attribute__((vector_size(8 * LANES)));

static double processor_time(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
int main(void)
{
    vector sums[SUMS] = {{0}}, factor = {0};
    double best = 0.0, total = 0.0;
    for (int i = 0; i < LANES; i++) factor[i] = 0.5;
    for (int repeat = 0; repeat < REPEATS; repeat++) {
        const double begin = processor_time();
        for (int n = 0; n < ROUNDS; n++) UNROLL
        for (int i = 0; i < SUMS; i++) sums[i] = sums[i] * factor + factor;
        const double rate = 2.0 * LANES * SUMS * ROUNDS / (processor_time() - begin);
        if (rate > best) best = rate;
    }
    for (int i = 0; i < SUMS; i++) total += sums[i][0];
    printf("%.17g %g\n", best, total);
    return 0;
}
