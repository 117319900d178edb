/* States of one top on a torus, or of one free gyrostat, at many times. Each vector lane computes
 * the state at a different time. The results are bitwise equal to those of the scalar code. This
 * file is compiled once for each instruction set. */
#define KR_EXACT_LANES
#include "free_gyrostat.h"
#include "goryachev_chaplygin.h"
#include "kowalewski.h"

void KR_NAME(kr_gyrostat_evaluate)(const void *memory, size_t n, const double t[], kr_state out[])
{
    const kr_gyrostat_plan *plan = memory;
    for (size_t from = 0; from < n; from += LANES) {
        const wide time = load_time_lanes(n - from, t + from);
        const state_lanes s = gyrostat_after(plan, time, torus_span(&plan->torus, time));
        store_state_lanes(&s, n - from, out + from);
    }
    wide_leave();
}
void KR_NAME(kr_chaplygin_evaluate)(const void *memory, size_t n, const double t[], kr_state out[])
{
    const kr_chaplygin_plan *plan = memory;
    for (size_t from = 0; from < n; from += LANES) {
        const wide time = load_time_lanes(n - from, t + from);
        const state_lanes s = chaplygin_kernel(plan, time, torus_span(&plan->torus, time));
        store_state_lanes(&s, n - from, out + from);
    }
    wide_leave();
}
void KR_NAME(kr_kowalewski_evaluate)(const void *memory, size_t n, const double t[], kr_state out[])
{
    const kr_kowalewski_torus *plan = memory;
    for (size_t from = 0; from < n; from += LANES) {
        const wide time = load_time_lanes(n - from, t + from);
        const state_lanes s = kowalewski_kernel(plan, time, torus_span(&plan->torus, time));
        store_state_lanes(&s, n - from, out + from);
    }
    wide_leave();
}
