/* The closed form of the Lagrange top, and of any body on which no torque acts: no steps, and no
 * error that grows. A step goes wherever it is asked to; one without an end is a nutation's. (Klein
 * and Sommerfeld, Theorie des Kreisels; Jacobi 1849 for the free body.) Keeps everything. */
#include "dispatch.h"
#include "method.h"

static const kr_exact *plan_of(const kr_run *run) { return (const kr_exact *)run->work; }

static kr_status reset(kr_run *run, const kr_state *start)
{
    (void)start; /* rounded on its way to working axes */
    return kr_exact_own(run->scene, (kr_exact *)run->work);
}
static kr_status step(kr_run *run, double until)
{
    const double period = plan_of(run)->period, own = isfinite(period) ? period : 1.0;
    run->clock = isfinite(until) ? until : run->clock + (run->step != 0.0 ? run->step : own);
    run->stats.evaluations++;
    return KR_OK;
}
static void at(kr_run *run, double clock, kr_state *s) { *s = kr_exact_state(plan_of(run), clock); }
static void read(const kr_run *run, kr_state *s) { *s = kr_exact_state(plan_of(run), run->clock); }

const kr_method kr_method_exact = {
    .name = "exact",
    .text = "closed form by theta functions",
    .conserves = "all integrals",
    .reference = "Klein and Sommerfeld 1897; Jacobi 1849",
    .order = 0,
    .flags = KR_ADAPTIVE | KR_DENSE | KR_REVERSIBLE | KR_SYMPLECTIC | KR_INTEGRABLE,
    .work = sizeof(kr_exact) / sizeof(double),
    .reset = reset,
    .step = step,
    .read = read,
    .at = at,
};
