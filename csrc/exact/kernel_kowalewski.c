/* States of a Kowalewski top at many times. One time is computed in each lane, with the same bits
 * as alone. This file is compiled once for each instruction set. */
#define KR_EXACT_LANES
#include "kowalewski_state.h"

/* Writes the states of the first `count` lanes. */
static void put_states(const state_lanes *s, int count, kr_state out[])
{
    double rows[8][LANES];
    memcpy(rows, s, sizeof rows);
    for (int i = 0; i < count; i++) {
        const double none = isfinite(rows[0][i]) ? 0.0 : NAN;
        out[i].t = rows[0][i];
        out[i].q =
            q4(rows[1][i] + none, v3(rows[2][i] + none, rows[3][i] + none, rows[4][i] + none));
        out[i].m = v3(rows[5][i] + none, rows[6][i] + none, rows[7][i] + none);
    }
}
void KR_NAME(kr_kowalewski_many)(const kr_theta_sums *plan, size_t n, const double t[],
                                 kr_state out[])
{
    for (size_t from = 0; from < n; from += LANES) {
        const int count = n - from < LANES ? (int)(n - from) : LANES;
        double times[LANES];
        for (int i = 0; i < LANES; i++) times[i] = t[from + (size_t)(i < count ? i : 0)];
        const wide time = wide_load(times), zero = wide_splat(0.0);
        const dd span = two_sum(time, -wide_splat(plan->begin));
        const mask within = kowalewski_is_within(plan, span.hi);
        const state_lanes s = kowalewski_kernel(plan, time, dd_choose(within, span, dd_of(zero)));
        put_states(&s, count, out + from);
    }
    wide_leave();
}
