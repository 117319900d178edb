/* The closed form as a method, for Lagrange tops, Kowalewski tops and any body without torque. It
 * needs no steps, and its error does not grow with time. A step ends wherever it must; a step
 * without an end takes one period of the nutation, or of the first angle of a Kowalewski top.
 * Sources: Klein and Sommerfeld (Theorie des Kreisels) for the Lagrange top, Jacobi (1849) for the
 * free body, Kowalevski (1889) and Koetter (1893) for hers, up to the heading. It conserves all
 * integrals. */
#include "dispatch.h"
#include "kowalewski.h"
#include "method.h"
#include "model/scene.h"

/* Value of kr_exact.curve for Kowalewski tops, behind the kinds of series. */
enum { KOWALEWSKI = 16 };

int kr_exact_resolves(const kr_scene *scene)
{
    const kr_working w = kr_body_working(&scene->body);
    const kr_quat q = q_mul(scene->start.q, q_mul(scene->body.axes, w.axes));
    const double lean = fmin(fmax(fabs(q.x), fabs(q.y)), fmax(fabs(q.w), fabs(q.z))),
                 push = fmax(fabs(scene->start.m.x), fabs(scene->start.m.y));
    kr_units units;
    if ((lean == 0.0 && push == 0.0) || scene->gravity == 0.0 || v_largest(w.com) == 0.0) return 1;
    if (kr_scene_units(scene, &w, &units) != KR_OK) return 1; /* other functions report this */
    return fmax(lean, push * (units.time / units.moment)) >= 1e-70;
}

/* The work is a kr_exact. For a Kowalewski top only its period is used; the sums of its plan and
 * the memory for a new plan follow. */
static const kr_exact *exact_of(const kr_motion *motion) { return (const kr_exact *)motion->work; }
static kr_theta_sums *sums_of(const kr_motion *motion)
{
    return (kr_theta_sums *)(void *)((kr_exact *)motion->work + 1);
}
int kr_exact_is_kowalewski(const kr_scene *scene)
{
    return scene->gravity != 0.0 && kr_body_kind(&scene->body, KR_KIND_RTOL) == KR_KIND_KOWALEWSKI;
}
/* Returns the doubles behind the work that a scene needs. */
static size_t extra_doubles_of(const kr_scene *scene)
{
    return kr_exact_is_kowalewski(scene) ? kr_exact_extra_doubles() : 0;
}
size_t kr_exact_extra_doubles(void)
{
    return (sizeof(kr_theta_sums) + kr_kowalewski_size()) / sizeof(double);
}

/* Computes a new plan beside the present one, which stays in use on failure. */
static kr_status reset_kowalewski(kr_motion *motion)
{
    kr_exact form = {0};
    kr_theta_sums *sums = sums_of(motion), *made = sums + 1;
    const kr_status status = kr_kowalewski_own(motion->scene, made);
    if (status != KR_OK) return status;
    *sums = *made;
    form.curve = KOWALEWSKI;
    form.period = 0.5 / sums->turn[0].fast; /* of the first angle */
    memcpy(motion->work, &form, sizeof form);
    return KR_OK;
}
static kr_status exact_reset(kr_motion *motion, const kr_state *start)
{
    (void)start; /* It was rounded in working axes; the scene was not. */
    if (kr_exact_is_kowalewski(motion->scene)) return reset_kowalewski(motion);
    return kr_exact_plan_own_units(motion->scene, (kr_exact *)motion->work);
}
static kr_status exact_step(kr_motion *motion, double until)
{
    const double period = exact_of(motion)->period;
    const double own = isfinite(period) ? period : 1.0;
    motion->clock =
        isfinite(until) ? until : motion->clock + (motion->step != 0.0 ? motion->step : own);
    motion->stats.evaluations++;
    return KR_OK;
}
static void exact_at(kr_motion *motion, double clock, kr_state *s)
{
    *s = exact_of(motion)->curve == KOWALEWSKI ? kr_kowalewski_state(&sums_of(motion)->head, clock)
                                               : kr_exact_state(exact_of(motion), clock);
}
static void exact_read(const kr_motion *motion, kr_state *s)
{
    kr_motion now = *motion;
    exact_at(&now, motion->clock, s);
}

const kr_method kr_method_exact = {
    .name = "exact",
    .text = "closed form by theta functions",
    .conserves = "all integrals",
    .reference = "Klein and Sommerfeld 1897; Jacobi 1849; Kowalevski 1889",
    .order = 0,
    .flags =
        KR_METHOD_ADAPTIVE | KR_METHOD_REVERSIBLE | KR_METHOD_SYMPLECTIC | KR_METHOD_INTEGRABLE,
    .work = sizeof(kr_exact) / sizeof(double),
    .extra_doubles = extra_doubles_of,
    .reset = exact_reset,
    .step = exact_step,
    .read = exact_read,
    .at = exact_at,
};
