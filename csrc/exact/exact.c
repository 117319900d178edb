/* The closed form as a method, for Lagrange, Kowalewski and Goryachev-Chaplygin tops, and for any
 * body without torque. It needs no intermediate steps, its error does not grow, and it conserves
 * all integrals. A step ends at the requested time. Without a requested end, a step is one period
 * of the nutation, or one period of the first angle for a Kowalewski or Goryachev-Chaplygin top.
 * Sources: Klein and Sommerfeld (Theorie des Kreisels) for the Lagrange top; Jacobi (1849) for the
 * free body; Kowalevski (1889) and Koetter (1893) for the Kowalewski top; Chaplygin (1901) for the
 * Goryachev-Chaplygin top, except for its heading. */
#include "dispatch.h"
#include "goryachev_chaplygin.h"
#include "kowalewski.h"
#include "method.h"
#include "model/scene.h"

/* Further values of `curve` in a kr_exact_form, after the kinds of its series. They mean that the closed
 * form is a plan stored behind the kr_exact_form. */
enum { KOWALEWSKI = 16, CHAPLYGIN };

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

/* The work of the method begins with a kr_exact_form. For a Kowalewski or Goryachev-Chaplygin top, only
 * the members `curve` and `period` of the kr_exact_form are used. The plan follows it, and then the
 * memory in which a new plan is set up. */
static const kr_exact_form *exact_of(const kr_motion *motion)
{
    return (const kr_exact_form *)motion->work;
}
static void *plan_of(const kr_motion *motion) { return (kr_exact_form *)motion->work + 1; }
kr_kind kr_exact_torus(const kr_scene *scene)
{
    const kr_kind kind =
        scene->gravity == 0.0 ? KR_KIND_EULER : kr_body_kind(&scene->body, KR_KIND_RTOL);
    return kind == KR_KIND_KOWALEWSKI || kind == KR_KIND_GORYACHEV_CHAPLYGIN ? kind
                                                                             : KR_KIND_GENERAL;
}
/* Returns the number of doubles in the plan and the set-up memory of a kind of top. */
static size_t torus_doubles(kr_kind kind)
{
    return (kind == KR_KIND_KOWALEWSKI
                ? sizeof(kr_theta_sums) + kr_kowalewski_size()
                : sizeof(kr_chaplygin_plan) + kr_goryachev_chaplygin_size()) /
           sizeof(double);
}
/* Returns the number of doubles that a scene needs after the kr_exact_form. */
static size_t extra_doubles_of(const kr_scene *scene)
{
    const kr_kind kind = kr_exact_torus(scene);
    return kind == KR_KIND_GENERAL ? 0 : torus_doubles(kind);
}
size_t kr_exact_extra_doubles(void)
{
    const size_t one = torus_doubles(KR_KIND_KOWALEWSKI),
                 other = torus_doubles(KR_KIND_GORYACHEV_CHAPLYGIN);
    return one > other ? one : other;
}

/* Writes a kr_exact_form for a Kowalewski or Goryachev-Chaplygin top. `half_turns` is half of the first
 * angle's rate, in turns per unit of time. */
static void set_torus(kr_motion *motion, int curve, double half_turns)
{
    kr_exact_form form = {0};
    form.curve = curve;
    form.period = 0.5 / half_turns;
    memcpy(motion->work, &form, sizeof form);
}
/* Both functions set up a new plan in separate memory. If the scene is refused, the old plan stays
 * in use. */
static kr_status reset_kowalewski(kr_motion *motion)
{
    kr_theta_sums *sums = plan_of(motion), *made = sums + 1;
    const kr_status status = kr_kowalewski_own(motion->scene, made);
    if (status != KR_OK) return status;
    memcpy(sums, made, sizeof *sums);
    set_torus(motion, KOWALEWSKI, sums->turn[0].fast);
    return KR_OK;
}
static kr_status reset_chaplygin(kr_motion *motion)
{
    kr_chaplygin_plan *plan = plan_of(motion), *made = plan + 1;
    const kr_status status = kr_chaplygin_own(motion->scene, made);
    if (status != KR_OK) return status;
    memcpy(plan, made, sizeof *plan);
    set_torus(motion, CHAPLYGIN, plan->turn[0].fast);
    return KR_OK;
}
static kr_status exact_reset(kr_motion *motion, const kr_state *start)
{
    (void)start; /* `start` was rounded by the conversion to working axes; the scene was not. */
    const kr_kind kind = kr_exact_torus(motion->scene);
    if (kind == KR_KIND_KOWALEWSKI) return reset_kowalewski(motion);
    if (kind == KR_KIND_GORYACHEV_CHAPLYGIN) return reset_chaplygin(motion);
    return kr_exact_plan_own_units(motion->scene, (kr_exact_form *)motion->work);
}
/* Returns 1 for bodies of the integrable kinds. The size of a plan is 0 in builds without it. */
static int exact_applies(const kr_body *body, kr_kind kind)
{
    (void)body;
    return kind == KR_KIND_LAGRANGE || kind == KR_KIND_EULER ||
           (kind == KR_KIND_KOWALEWSKI && kr_kowalewski_size() > 0) ||
           (kind == KR_KIND_GORYACHEV_CHAPLYGIN && kr_goryachev_chaplygin_size() > 0);
}
static int exact_suits(const kr_scene *scene)
{
    const kr_kind kind = kr_body_kind(&scene->body, KR_KIND_RTOL), torus = kr_exact_torus(scene);
    if (scene->gravity != 0.0 && !exact_applies(&scene->body, kind)) return 0;
    if (torus == KR_KIND_GENERAL) return kr_exact_resolves(scene);
    return torus == KR_KIND_KOWALEWSKI || kr_chaplygin_is_level(scene);
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
    const int curve = exact_of(motion)->curve;
    if (curve == KOWALEWSKI)
        *s = kr_kowalewski_state(plan_of(motion), clock);
    else if (curve == CHAPLYGIN)
        *s = kr_goryachev_chaplygin_state(plan_of(motion), clock);
    else
        *s = kr_exact_form_state(exact_of(motion), clock);
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
    .flags =
        KR_METHOD_ADAPTIVE | KR_METHOD_REVERSIBLE | KR_METHOD_SYMPLECTIC | KR_METHOD_INTEGRABLE,
    .applies = exact_applies,
    .suits = exact_suits,
    .work = sizeof(kr_exact_form) / sizeof(double),
    .extra_doubles = extra_doubles_of,
    .reset = exact_reset,
    .step = exact_step,
    .read = exact_read,
    .at = exact_at,
};
