/* Runs of the Taylor method with a given kernel and tolerance, which users cannot select. Used by
 * taylor_kernels.py. */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdlib.h>
#include <time.h>
#include "taylor/taylor.h"
#include "driver/top.h"

const char *kr_bench_isa(int i);
int kr_bench_order(int i);
double kr_bench_cycle(void);
int kr_bench_run(const kr_scene *scene, int isa, int kernel, double log2_tol, double t,
                 kr_state *out, int64_t *steps);

/* Returns the name of the i-th instruction set of this machine, or NULL beyond the last. */
const char *kr_bench_isa(int i)
{
    const kr_isa *isa = kr_taylor_isa(i);
    return isa && isa->runs_here() ? isa->name : NULL;
}
/* Returns the order of the i-th kernel, or 0 beyond the last. */
int kr_bench_order(int i) { return i < KR_ORDERS ? kr_taylor_isa(0)->plain[i].order : 0; }
/* Returns the duration of a clock cycle in seconds, measured by dependent shifts and additions of
 * one cycle each. */
double kr_bench_cycle(void)
{
    enum { ROUNDS = 10000 };
    struct timespec from, to;
    volatile uint64_t seed = 1;
    uint64_t x = seed;
    clock_gettime(CLOCK_MONOTONIC, &from);
    for (int i = 0; i < ROUNDS; i++) {
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
    }
    clock_gettime(CLOCK_MONOTONIC, &to);
    seed = x;
    return ((double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec)) /
           (6 * ROUNDS);
}
/* Integrates the heading separately in a step without heading, by psi' (1 + <P, d>) = <W, P + d>,
 * where d is the axis nearest to P. The rotation itself is not included. Used only for timing: such
 * a step is not cheaper than a step of the whole attitude. */
static const kr_kernel *without;
static volatile double heading;
#if defined KR_WITH_AVX512
#  include <immintrin.h>
__attribute__((target("avx2,fma"))) static void add_heading(kr_series *s, double log2_tol,
                                                            double direction)
{
    const double *P = s->x[0] + 4;
    double rate[KR_TAYLOR_MAX + 1], sum = 0.0;
    int d = 1;
    without->advance(s, log2_tol, direction);
    const double h = s->end - s->t;
    for (int i = 2; i < 4; i++) d = fabs(P[i]) > fabs(P[d]) ? i : d;
    const double sign = P[d] < 0.0 ? -1.0 : 1.0, inverse = 1.0 / (1.0 + sign * P[d]);
    for (int n = 0; n < without->order; n++) {
        __m256d product = _mm256_setzero_pd();
        double known = sign * s->w[n][d];
        for (int j = 0; j <= n; j++)
            product = _mm256_fmadd_pd(_mm256_loadu_pd(s->w[j]), _mm256_loadu_pd(s->x[n - j] + 4),
                                      product);
        for (int j = 0; j < n; j++)
            known = __builtin_fma(-rate[j], sign * s->x[n - j][4 + d], known);
        rate[n] = (known + (product[1] + product[2] + product[3])) * inverse;
    }
    for (int n = without->order - 1; n >= 0; n--) sum = __builtin_fma(sum, h, rate[n] / (n + 1));
    heading = sum * h;
}
#else
static void add_heading(kr_series *s, double log2_tol, double direction)
{
    without->advance(s, log2_tol, direction);
}
#endif
/* Integrates a top to t. kernel is an index into the kernels of each order, those for 20 and 30
 * digits, those of each order without heading, and those with the heading added. out receives the
 * state and its low words. */
int kr_bench_run(const kr_scene *scene, int isa, int kernel, double log2_tol, double t,
                 kr_state *out, int64_t *steps)
{
    const kr_isa *use = kr_taylor_isa(isa);
    const kr_kernel *const groups[] = {use->plain, use->deep, use->headless, use->headless};
    const int first[] = {0, KR_ORDERS, KR_ORDERS + KR_DEPTHS, 2 * KR_ORDERS + KR_DEPTHS};
    const int group = (kernel >= first[1]) + (kernel >= first[2]) + (kernel >= first[3]);
    const kr_kernel *chosen = &groups[group][kernel - first[group]],
                    added = {chosen->order, add_heading, chosen->evaluate};
    const kr_config config = {.digits = group != 1            ? 16
                                        : kernel == KR_ORDERS ? 20
                                                              : 30,
                              .skip_heading = group >= 2};
    kr_top *top = NULL;
    kr_status status = kr_top_create(scene, kr_method_find("taylor"), config, &top);
    if (status != KR_OK) return status;
    without = chosen;
    kr_taylor_set_kernel(&top->main, group == 3 ? &added : chosen, log2_tol);
    status = kr_top_record_low(top, 1, &t, &out[0], &out[1], NULL);
    *steps = kr_top_stats(top).steps;
    kr_top_free(top);
    return status;
}
