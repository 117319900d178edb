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
#include "torus.h"

/* Closed-form solutions for tops whose motion lies on an invariant torus (Kowalewski,
 * Goryachev-Chaplygin). Define KR_NO_TORUS to omit these solutions, which account for half of the
 * code of the method `exact`. */
static const kr_torus_form *const torus_forms[] = {
#ifndef KR_NO_TORUS
    &kr_kowalewski_form,
    &kr_chaplygin_form,
#endif
    NULL, /* the end */
};

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

/* Returns the entry of torus_forms for bodies of the given kind, or NULL if there is none. */
static const kr_torus_form *find_torus_form(kr_kind kind)
{
    const kr_torus_form *const *form = torus_forms;
    while (*form && (*form)->kind != kind) form++;
    return *form;
}
/* Returns the number of doubles that must be stored for a top in addition to its kr_exact_form.
 * This memory holds the current closed-form solution and, while a new solution is being set up,
 * also the new one. */
static size_t torus_doubles(const kr_torus_form *form)
{
    return (form->plan_size + kr_torus_widest_isa(form)->scalar->memory_size) / sizeof(double);
}
static size_t extra_doubles_of(const kr_scene *scene)
{
    const kr_torus_form *form = find_torus_form(kr_scene_kind(scene));
    return form ? torus_doubles(form) : 0;
}
size_t kr_exact_extra_doubles(void)
{
    size_t most = 0;
    for (const kr_torus_form *const *form = torus_forms; *form; form++)
        if (torus_doubles(*form) > most) most = torus_doubles(*form);
    return most;
}

/* Returns the kr_exact_form at the beginning of the work array. If the motion lies on a torus, only
 * the member `period` of this structure is used. */
static const kr_exact_form *form_of_motion(const kr_motion *motion)
{
    return (const kr_exact_form *)motion->work;
}
static void *plan_of_motion(const kr_motion *motion) { return (kr_exact_form *)motion->work + 1; }
/* Sets up a new solution without overwriting the old one, which remains valid if the set-up fails.
 * The error bound is the smaller of the tolerance and the default bound. */
static kr_status reset_torus(kr_motion *motion, const kr_torus_form *form)
{
    char *plan = plan_of_motion(motion), *made = plan + form->plan_size;
    const double bound = motion->tol < form->bound ? motion->tol : 0.0;
    const kr_status status = kr_torus_widest_isa(form)->scalar->plan(motion->scene, 1, bound, made);
    if (status != KR_OK) return status;
    memcpy(plan, made, form->used_size(made));
    kr_torus torus;
    memcpy(&torus, plan + form->torus_offset, sizeof torus);
    const kr_exact_form period = {.period = 0.5 / torus.turn[0].fast};
    memcpy(motion->work, &period, sizeof period);
    return KR_OK;
}
static kr_status exact_reset(kr_motion *motion, const kr_state *start)
{
    (void)start; /* not used: the conversion to internal axes has rounded it */
    const kr_torus_form *form = find_torus_form(kr_scene_kind(motion->scene));
    const kr_status status =
        form ? reset_torus(motion, form)
             : kr_exact_plan_own_units(motion->scene, (kr_exact_form *)motion->work);
    if (status == KR_OK) motion->aux = (void *)form;
    return status;
}
static int exact_applies(const kr_body *body, kr_kind kind)
{
    (void)body;
    return kind == KR_KIND_LAGRANGE || kind == KR_KIND_EULER || find_torus_form(kind);
}
static int exact_suits(const kr_scene *scene)
{
    const kr_kind kind = kr_scene_kind(scene);
    const kr_torus_form *form = find_torus_form(kind);
    if (form) return !form->suits || form->suits(scene);
    return exact_applies(&scene->body, kind) && kr_exact_resolves(scene);
}
static kr_status exact_step(kr_motion *motion, double until)
{
    const double period = form_of_motion(motion)->period;
    const double own = isfinite(period) ? period : 1.0;
    motion->clock =
        isfinite(until) ? until : motion->clock + (motion->step != 0.0 ? motion->step : own);
    motion->stats.evaluations++;
    return KR_OK;
}
static void exact_at(kr_motion *motion, double clock, kr_state *s)
{
    const kr_torus_form *form = motion->aux;
    *s = form ? kr_torus_widest_isa(form)->scalar->state(plan_of_motion(motion), clock)
              : kr_exact_form_state(form_of_motion(motion), clock);
}
static void exact_at_times(const kr_motion *motion, size_t n, const double clock[], kr_state out[])
{
    const kr_torus_form *form = motion->aux;
    if (form)
        kr_torus_states(form, plan_of_motion(motion), n, clock, out);
    else
        kr_exact_form_states(form_of_motion(motion), n, clock, out);
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
    .reference = "Klein and Sommerfeld 1897; Jacobi 1849; Kowalevski 1889; Chaplygin 1901",
    .order = 0,
    .flags = KR_METHOD_ADAPTIVE | KR_METHOD_REVERSIBLE | KR_METHOD_SYMPLECTIC |
             KR_METHOD_INTEGRABLE | KR_METHOD_ROTORS,
    .applies = exact_applies,
    .suits = exact_suits,
    .work = sizeof(kr_exact_form) / sizeof(double),
    .extra_doubles = extra_doubles_of,
    .reset = exact_reset,
    .step = exact_step,
    .read = exact_read,
    .at = exact_at,
    .at_times = exact_at_times,
};
