/* States of a free gyrostat at many times, one in each vector lane, bitwise equal to those of the
 * scalar code. This file is compiled once for each instruction set. */
#define KR_EXACT_LANES
#include "free_gyrostat.h"

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
