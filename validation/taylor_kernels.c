/* For bench_kernels.py: the Taylor method with a given kernel and tolerance, which users cannot choose. */
#define _POSIX_C_SOURCE 199309L
#include <stdlib.h>
#include <time.h>
#include "../csrc/taylor/taylor.h"
#include "../csrc/top.h"

const char *kr_bench_set(int i);
int kr_bench_order(int i);
double kr_bench_cycle(void);
int kr_bench_run(const kr_scene *scene, int set, int kernel, double log2_tol, double t, kr_state *out, int64_t *steps);

/* The name of the i-th instruction set of this machine, NULL beyond the last. */
const char *kr_bench_set(int i)
{
    const kr_set *set = kr_taylor_set(i);
    return set && set->runs_here() ? set->name : NULL;
}
/* The order of the i-th kernel, 0 beyond the last. */
int kr_bench_order(int i) { return i < KR_ORDERS ? kr_taylor_set(0)->plain[i].order : 0; }
/* Seconds of a cycle of the clock: shifts and sums of bits that wait for each other take one each. */
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
    return ((double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec)) / (6 * ROUNDS);
}
/* kernel: of each order, then for 20 and 30 digits, then of each order without the heading. out: the state and what it leaves
 * out. */
int kr_bench_run(const kr_scene *scene, int set, int kernel, double log2_tol, double t, kr_state *out, int64_t *steps)
{
    const kr_set *use = kr_taylor_set(set);
    const kr_kernel *const groups[] = {use->plain, use->deep, use->headless};
    const int group = (kernel >= KR_ORDERS) + (kernel >= KR_ORDERS + KR_DEPTHS), first[] = {0, KR_ORDERS, KR_ORDERS + KR_DEPTHS};
    const kr_kernel *chosen = &groups[group][kernel - first[group]];
    const kr_config config = {.digits = group != 1 ? 16 : kernel == KR_ORDERS ? 20 : 30, .leave_heading = group == 2};
    kr_top *top = NULL;
    kr_status status = kr_top_create(scene, kr_method_find("taylor"), config, &top);
    if (status != KR_OK) return status;
    kr_taylor_use(&top->main, chosen, log2_tol);
    status = kr_top_record_low(top, 1, &t, &out[0], &out[1], NULL);
    *steps = kr_top_stats(top).steps;
    kr_top_free(top);
    return status;
}
