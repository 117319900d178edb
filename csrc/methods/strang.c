/* Strang splitting, of second order: half a kick, a free drift, half a kick (splitting.h). The last
 * half kick of a step is merged with the first half kick of the next step. The method conserves the
 * vertical momentum. For Lagrange tops and torque-free symmetric bodies, the method also conserves
 * the momentum about the symmetry axis. The energy error is bounded and O(h^2). */
#include "splitting.h"

/* Between steps, the momentum already includes half of the next kick. */
static kr_status strang_reset(kr_motion *motion, const kr_state *start)
{
    splitting *s = (splitting *)motion->work;
    splitting_begin(s, motion, start);
    splitting_kick(s, motion, 0.5);
    return KR_OK;
}
static kr_status strang_step(kr_motion *motion, double until)
{
    splitting *s = (splitting *)motion->work;
    (void)until;
    splitting_drift(s, 1.0);
    splitting_kick(s, motion, 1.0);
    s->steps += 1.0;
    motion->stats.evaluations++;
    return KR_OK;
}
static void strang_read(const kr_motion *motion, kr_state *out)
{
    splitting_read((const splitting *)motion->work, motion, 0.5, out);
}

const kr_method kr_method_strang = {
    KR_METHOD_TEXTS("strang", "kick, free drift, kick; the drift is exact for symmetric bodies",
                    SPLITTING_CONSERVES, "McLachlan 1993; Reich 1994"),
    .order = 2,
    .flags = SPLITTING_FLAGS,
    .work = sizeof(splitting) / sizeof(double),
    .reset = strang_reset,
    .step = strang_step,
    .read = strang_read,
};
