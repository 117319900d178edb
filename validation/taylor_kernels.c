/* For bench_taylor.py: the Taylor method with a given kernel and tolerance, which users cannot choose. */
#include <stdlib.h>
#include "../csrc/taylor/taylor.h"
#include "../csrc/top.h"

const char *kr_bench_set(int i);
int kr_bench_run(const kr_scene *scene, int set, int kernel, double log2_tol, double t, kr_state *out, int64_t *steps);

/* The name of the i-th instruction set of this machine, NULL beyond the last. */
const char *kr_bench_set(int i)
{
    const kr_set *set = kr_taylor_set(i);
    return set && set->runs_here() ? set->name : NULL;
}
/* kernel: of orders 12, 16, 20, 28, then for 20 and 30 digits. out: the state and what it leaves out. */
int kr_bench_run(const kr_scene *scene, int set, int kernel, double log2_tol, double t, kr_state *out, int64_t *steps)
{
    const kr_config config = {.digits = kernel < KR_ORDERS ? 16 : kernel == KR_ORDERS ? 20 : 30};
    const kr_set *use = kr_taylor_set(set);
    kr_top *top = NULL;
    kr_status status = kr_top_create(scene, kr_method_find("taylor"), config, &top);
    if (status != KR_OK) return status;
    kr_taylor_use(&top->main, kernel < KR_ORDERS ? &use->plain[kernel] : &use->deep[kernel - KR_ORDERS], log2_tol);
    status = kr_top_record_low(top, 1, &t, &out[0], &out[1], NULL);
    *steps = kr_top_stats(top).steps;
    kr_top_free(top);
    return status;
}
