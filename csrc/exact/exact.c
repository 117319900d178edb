/* The method `exact`: closed-form solutions for Lagrange, Kowalewski and Goryachev-Chaplygin tops
 * and for torque-free bodies. The method needs no intermediate steps, its error does not grow with
 * time, and it conserves all integrals of motion. Each step extends to the next requested time,
 * however far away that time is. The default step size is the nutation period or, for motions on a
 * torus, the period of the first torus angle. The solution for Lagrange tops follows Klein and
 * Sommerfeld (Theorie des Kreisels), and that for free bodies follows Jacobi (1849). The solution
 * for Kowalewski tops follows Kowalevski (1889) and Koetter (1893). The solution for
 * Goryachev-Chaplygin tops follows Chaplygin (1901), except for the heading. */
#include "dispatch.h"
#include "method.h"
#include "model/scene.h"

int kr_exact_resolves(const kr_scene *scene)
{
    const kr_working w = kr_body_working(&scene->body);
    const kr_quat q = q_mul(scene->start.q, q_mul(scene->body.axes, w.axes));
    const double lean = fmin(fmax(fabs(q.x), fabs(q.y)), fmax(fabs(q.w), fabs(q.z))),
                 push = fmax(fabs(scene->start.m.x), fabs(scene->start.m.y));
    kr_units units;
    if ((lean == 0.0 && push == 0.0) || scene->gravity == 0.0 || v_largest(w.com) == 0.0) return 1;
    if (kr_scene_units(scene, &w, &units) != KR_OK) return 1; /* reported by other functions */
    return fmax(lean, push * (units.time / units.moment)) >= 1e-70;
}

/* The memory of a motion: its period, its plan and, while a new plan is set up, also the new one.
 * The pointer motion->aux is the kr_exact_isa of the plan. */
static size_t doubles_of_form(const kr_closed_form *form)
{
    return (form->plan_size + kr_exact_widest_isa(form)->scalar->memory_size) / sizeof(double);
}
static size_t extra_doubles_of(const kr_scene *scene)
{
    const kr_closed_form *form = kr_closed_form_of(kr_scene_kind(scene));
    return form ? doubles_of_form(form) : 0;
}
size_t kr_exact_extra_doubles(int with_torus)
{
    size_t most = doubles_of_form(&kr_symmetric_form);
    for (int kind = 0; with_torus && kind < KR_KIND_COUNT; kind++) {
        const kr_closed_form *form = kr_closed_form_of((kr_kind)kind);
        if (form && doubles_of_form(form) > most) most = doubles_of_form(form);
    }
    return most;
}
static void *plan_of_motion(const kr_motion *motion) { return (double *)motion->work + 1; }
/* Sets up a new plan without overwriting the old one, which remains valid if the set-up fails. The
 * bound of the certificate is the smaller of the tolerance and the default. */
static kr_status exact_reset(kr_motion *motion, const kr_state *start)
{
    (void)start; /* not used: the conversion to internal axes has rounded it */
    const kr_closed_form *form = kr_closed_form_of(kr_scene_kind(motion->scene));
    if (!form) return KR_ERR_METHOD;
    const kr_exact_isa *isa = kr_exact_widest_isa(form);
    char *plan = plan_of_motion(motion), *made = plan + form->plan_size;
    const double bound = motion->tol > 0.0 ? fmin(motion->tol, KR_EXACT_BOUND) : KR_EXACT_BOUND;
    kr_exact_info info;
    const kr_status status = isa->scalar->plan(motion->scene, 1, bound, made, &info);
    if (status != KR_OK) return status;
    memcpy(plan, made, form->used_size(made));
    *(double *)motion->work = info.period;
    motion->aux = (void *)isa;
    return KR_OK;
}
static int exact_applies(const kr_body *body, kr_kind kind)
{
    (void)body;
    return kr_closed_form_of(kind) != NULL;
}
static int exact_suits(const kr_scene *scene)
{
    const kr_closed_form *form = kr_closed_form_of(kr_scene_kind(scene));
    return form && form->suits(scene);
}
static kr_status exact_step(kr_motion *motion, double until)
{
    const double period = *(const double *)motion->work;
    const double own = isfinite(period) ? period : 1.0;
    motion->clock =
        isfinite(until) ? until : motion->clock + (motion->step != 0.0 ? motion->step : own);
    motion->stats.evaluations++;
    return KR_OK;
}
static void exact_at(kr_motion *motion, double clock, kr_state *s)
{
    const kr_exact_isa *isa = motion->aux;
    *s = isa->scalar->state(plan_of_motion(motion), clock);
}
static void exact_at_times(const kr_motion *motion, size_t n, const double clock[], kr_state out[])
{
    kr_exact_evaluate_widest(motion->aux, plan_of_motion(motion), n, clock, out);
}
static void exact_read(const kr_motion *motion, kr_state *s)
{
    kr_motion now = *motion;
    exact_at(&now, motion->clock, s);
}

const kr_method kr_method_exact = {
    .name = "exact",
    .text = "closed forms of the integrable tops",
    .conserves = "all integrals",
    .reference = "Klein and Sommerfeld 1897; Jacobi 1849; Kowalevski 1889; Chaplygin 1901",
    .order = 0,
    .flags = KR_METHOD_ADAPTIVE | KR_METHOD_REVERSIBLE | KR_METHOD_SYMPLECTIC |
             KR_METHOD_INTEGRABLE | KR_METHOD_ROTORS,
    .applies = exact_applies,
    .suits = exact_suits,
    .work = 1,
    .extra_doubles = extra_doubles_of,
    .reset = exact_reset,
    .step = exact_step,
    .read = exact_read,
    .at = exact_at,
    .at_times = exact_at_times,
};
