/* Runs of the Taylor method with a given tolerance, and with a kernel that users cannot select.
 * Used by taylor_kernels.py. */
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
/* Returns the duration of a clock cycle in seconds, measured by dependent shifts and exclusive ors
 * of one cycle each. */
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
/* Integrates a top to t. kernel is an index into the kernels of each order, and then into those
 * for 20 and 30 digits. out receives the state and its low words. */
int kr_bench_run(const kr_scene *scene, int isa, int kernel, double log2_tol, double t,
                 kr_state *out, int64_t *steps)
{
    const kr_isa *use = kr_taylor_isa(isa);
    const int deep = kernel - KR_ORDERS;
    const kr_kernel *chosen = deep < 0 ? &use->plain[kernel] : &use->deep[deep];
    const kr_config config = {.digits = deep < 0 ? 16 : deep == 0 ? 20 : 30};
    kr_top *top = NULL;
    kr_status status = kr_top_create(scene, kr_method_find("taylor"), config, &top);
    if (status != KR_OK) return status;
    kr_taylor_set_kernel(&top->main, chosen, log2_tol);
    status = kr_top_record_low(top, 1, &t, &out[0], &out[1], NULL);
    *steps = kr_top_stats(top).steps;
    kr_top_free(top);
    return status;
}
