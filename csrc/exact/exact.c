/* The closed form as a method, for the Lagrange top and for any body on which no torque acts: it
 * needs no steps, and its error does not grow. A step goes wherever it is asked to; a step without
 * an end takes one period of the nutation. Klein and Sommerfeld (Theorie des Kreisels) give it for
 * the Lagrange top, Jacobi (1849) for the free body. It keeps every integral. */
#include "dispatch.h"
#include "method.h"

static const kr_exact *exact_of(const kr_motion *motion) { return (const kr_exact *)motion->work; }

static kr_status reset(kr_motion *motion, const kr_state *start)
{
    (void)start; /* It was rounded on its way to working axes; the scene was not. */
    return kr_exact_own(motion->scene, (kr_exact *)motion->work);
}
static kr_status step(kr_motion *motion, double until)
{
    const double period = exact_of(motion)->period;
    const double own = isfinite(period) ? period : 1.0;
    motion->clock =
        isfinite(until) ? until : motion->clock + (motion->step != 0.0 ? motion->step : own);
    motion->stats.evaluations++;
    return KR_OK;
}
static void at(kr_motion *motion, double clock, kr_state *s)
{
    *s = kr_exact_state(exact_of(motion), clock);
}
static void read(const kr_motion *motion, kr_state *s)
{
    *s = kr_exact_state(exact_of(motion), motion->clock);
}

const kr_method kr_method_exact = {
    .name = "exact",
    .text = "closed form by theta functions",
    .conserves = "all integrals",
    .reference = "Klein and Sommerfeld 1897; Jacobi 1849",
    .order = 0,
    .flags = KR_ADAPTIVE | KR_REVERSIBLE | KR_SYMPLECTIC | KR_INTEGRABLE,
    .work = sizeof(kr_exact) / sizeof(double),
    .reset = reset,
    .step = step,
    .read = read,
    .at = at,
};
