/* Runs of ensembles with a given tolerance, and with an instruction set and an order that users
 * cannot select.
 * Used by lane_orders.py. */
#include <stdlib.h>
#include "ensemble/worker.h"

const char *kr_bench_lanes_isa(int i);
int kr_bench_lanes(size_t n, const kr_scene scenes[], int isa, int order, double log2_tol, double t,
                   kr_state out[], int64_t *steps);

/* Returns the name of the i-th instruction set of this machine, or NULL beyond the last. */
const char *kr_bench_lanes_isa(int i)
{
    const kr_lanes_isa *isa = kr_lanes_isa_at(i);
    return isa && isa->runs_here() ? isa->name : NULL;
}
/* Computes the states of all tops at t. Order 0 selects the order that users get. */
int kr_bench_lanes(size_t n, const kr_scene scenes[], int isa, int order, double log2_tol, double t,
                   kr_state out[], int64_t *steps)
{
    const kr_config config = {.tol = exp2(log2_tol)};
    kr_worker *worker = NULL;
    kr_outcome *outcomes = malloc(n * sizeof *outcomes);
    kr_status status = outcomes
                           ? kr_worker_create(kr_method_find("taylor"), config, 0, NULL, &worker)
                           : KR_ERR_MEMORY;
    const kr_tops tops = {
        .n = n, .scenes = scenes, .times = 1, .t = &t, .states = out, .outcomes = outcomes};
    if (status == KR_OK && order > 0)
        kr_scheduler_set_kernel(worker, kr_lanes_isa_at(isa), order, log2_tol);
    if (status == KR_OK) status = kr_worker_run(worker, &tops);
    *steps = 0;
    for (size_t i = 0; status == KR_OK && i < n; i++) *steps += outcomes[i].stats.steps;
    kr_worker_free(worker);
    free(outcomes);
    return status;
}
