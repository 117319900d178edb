/* The public functions for closed forms, and the method `exact`. Each function calls the code for
 * the widest instruction set of this processor. All instruction sets give bitwise equal results. */
#include <math.h>
#include <string.h>
#include "exact.h"
#include "method.h"
#include "model/scene.h"

/* Array elements, one for each instruction set of the build, the widest first. */
#ifdef KR_WITH_AVX512
#  define ROW_AVX512(...) __VA_ARGS__,
#else
#  define ROW_AVX512(...)
#endif
#ifdef KR_WITH_AVX2
#  define ROW_AVX2(...) __VA_ARGS__,
#else
#  define ROW_AVX2(...)
#endif
#define ROWS(form)                                                                                 \
    {                                                                                              \
        ROW_AVX512({"avx512", kr_has_avx512, &KR_SCALAR_NAME(kr_##form##_scalar),                  \
                    KR_BATCHED(kr_##form##_evaluate_avx512)})                                      \
        ROW_AVX2({"avx2", kr_has_avx2, &kr_##form##_scalar_avx2,                                   \
                  KR_BATCHED(kr_##form##_evaluate_avx2)})                                          \
        {                                                                                          \
            KR_BASE_NAME, kr_has_base, &kr_##form##_scalar_base,                                   \
                KR_BATCHED(kr_##form##_evaluate_base)                                              \
        }                                                                                          \
    }

const kr_exact_isa kr_symmetric_form[KR_EXACT_ISAS] = ROWS(exact);
/* KR_NO_TORUS leaves out all closed forms except kr_symmetric_form, and so most of the code. */
#ifndef KR_NO_TORUS
const kr_exact_isa kr_kowalewski_form[KR_EXACT_ISAS] = ROWS(kowalewski);
const kr_exact_isa kr_chaplygin_form[KR_EXACT_ISAS] = ROWS(chaplygin);
const kr_exact_isa kr_gyrostat_form[KR_EXACT_ISAS] = ROWS(gyrostat);
#endif
const kr_exact_isa *kr_closed_form_of(kr_kind kind)
{
#ifndef KR_NO_TORUS
    if (kind == KR_KIND_KOWALEWSKI) return kr_kowalewski_form;
    if (kind == KR_KIND_GORYACHEV_CHAPLYGIN) return kr_chaplygin_form;
    if (kind == KR_KIND_GYROSTAT) return kr_gyrostat_form;
#endif
    return kind == KR_KIND_LAGRANGE || kind == KR_KIND_EULER ? kr_symmetric_form : NULL;
}
const kr_exact_isa *kr_exact_widest_isa(const kr_exact_isa form[])
{
    while (!form->runs_here()) form++; /* untaken: if the first one runs */
    return form;
}
void kr_exact_evaluate_widest(const kr_exact_isa *isa, const void *plan, size_t n, const double t[],
                              kr_state out[])
{
#ifdef KR_NO_BATCHES
    for (size_t i = 0; i < n; i++) out[i] = isa->scalar->state(plan, t[i]);
#else
    isa->evaluate(plan, n, t, out);
#endif
}

/* The beginning of a kr_exact; a plan (exact.h) follows. */
struct kr_exact {
    kr_exact_info info;
    const kr_exact_isa *isa;
};
KR_CHECK_LAYOUT(kr_exact_size_is_known, sizeof(kr_exact) + sizeof(kr_exact_form) <= KR_EXACT_SIZE);
static const void *get_plan(const kr_exact *exact) { return exact + 1; }

size_t kr_exact_size(const kr_scene *scene)
{
    const kr_exact_isa *form = scene ? kr_closed_form_of(kr_scene_kind(scene)) : NULL;
    if (!form) form = kr_symmetric_form;
    return sizeof(kr_exact) + kr_exact_widest_isa(form)->scalar->memory_size;
}
kr_status kr_exact_plan(const kr_scene *scene, double bound, kr_exact *exact)
{
    if (!scene || !exact || !(bound >= 0.0)) return KR_ERR_ARGUMENT;
    const kr_exact_info none = {.kind = kr_scene_kind(scene), .refusal = KR_REFUSAL_KIND};
    const kr_exact_isa *form = kr_closed_form_of(none.kind);
    if (!form) form = kr_symmetric_form; /* checks the scene, and refuses it */
    exact->info = none;
    exact->isa = kr_exact_widest_isa(form);
    const kr_status status = exact->isa->scalar->plan(
        scene, 0, bound > 0.0 ? bound : KR_EXACT_BOUND, exact + 1, &exact->info);
    if (status == KR_OK)
        exact->info.used = sizeof *exact + exact->isa->scalar->used_size(exact + 1);
    return status;
}
kr_exact_info kr_exact_describe(const kr_exact *exact) { return exact->info; }
kr_state kr_exact_state(const kr_exact *exact, double t)
{
    return exact->isa->scalar->state(get_plan(exact), t);
}
kr_state kr_exact_state_at(const kr_exact *exact, double first, double second)
{
    static const kr_state none = {NAN, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    const kr_exact_scalar *scalar = exact->isa->scalar;
    return scalar->state_at ? scalar->state_at(get_plan(exact), first, second) : none;
}
void kr_exact_states(const kr_exact *exact, size_t n, const double t[], kr_state out[])
{
    kr_exact_evaluate_widest(exact->isa, get_plan(exact), n, t, out);
}
static const char *const refusal_texts[] = {
#define X(name, text) KR_TEXT(text),
    KR_REFUSAL_LIST(X)
#undef X
};
const char *kr_refusal_text(kr_refusal refusal)
{
    return (unsigned)refusal < KR_REFUSAL_COUNT ? refusal_texts[refusal] : NULL;
}

kr_status kr_exact_nutation(const kr_scene *scene, kr_nutation *out)
{
    if (!out) return KR_ERR_ARGUMENT;
#ifdef KR_WITH_AVX2
    if (kr_has_avx2()) /* untaken: all calls give one answer */
        return kr_exact_limits_avx2(scene, out);
#endif
    return kr_exact_limits_base(scene, out);
}
void kr_exact_run_top(const kr_exact_request *request, size_t top)
{
    kr_exact_form plan;
    kr_exact_info info;
    request->status[top] = request->isa->scalar->plan(&request->scenes[top], 0, 0.0, &plan, &info);
    if (request->status[top] != KR_OK) return;
    if (request->plans) request->plans[top] = plan;
    if (request->times > 0)
        kr_exact_evaluate_widest(request->isa, &plan, request->times,
                                 kr_exact_times_of(request, top),
                                 request->states + top * request->times);
}
void kr_exact_run(const kr_exact_request *request)
{
#ifdef KR_NO_BATCHES
    for (size_t top = 0; top < request->n; top++) kr_exact_run_top(request, top);
#else
    /* Not in kr_exact_isa, so that programs for single tops do not link these functions. */
    static kr_exact_batch *const batches[] = {
        ROW_AVX512(kr_exact_batch_avx512) ROW_AVX2(kr_exact_batch_avx2) kr_exact_batch_base};
    batches[request->isa - kr_symmetric_form](request);
#endif
}

/* The method `exact`: closed forms of Lagrange tops (Klein and Sommerfeld, Theorie des Kreisels),
 * free bodies (Jacobi 1849), Kowalewski tops (Kowalevski 1889, Koetter 1893), Goryachev-Chaplygin
 * tops (Chaplygin 1901; the heading is computed by quadrature) and free gyrostats (Volterra 1899).
 * Each step extends to the next requested time, however late. Errors grow only in slow terms
 * (kr_slow_term), and integrals of motion are conserved. If no time is requested, the step size is
 * kr_exact_info.period or, if this is infinite, the internal unit of time (method.h). */
/* The array motion->work (kr_motion in method.h) contains the period, the plan (exact.h) of the
 * motion, and memory for the set-up of a new plan. motion->aux is the kr_exact_isa of the plan. */
static size_t count_plan_and_memory_doubles(const kr_exact_isa form[])
{
    const kr_exact_scalar *scalar = kr_exact_widest_isa(form)->scalar;
    return (scalar->plan_size + scalar->memory_size) / sizeof(double);
}
static size_t count_extra_doubles(const kr_scene *scene)
{
    const kr_exact_isa *form = kr_closed_form_of(kr_scene_kind(scene));
    return form ? count_plan_and_memory_doubles(form) : 0;
}
size_t kr_exact_extra_doubles(int with_torus)
{
    size_t most = count_plan_and_memory_doubles(kr_symmetric_form);
    for (int kind = 0; with_torus && kind < KR_KIND_COUNT; kind++) {
        const kr_exact_isa *form = kr_closed_form_of((kr_kind)kind);
        if (form && count_plan_and_memory_doubles(form) > most)
            most = count_plan_and_memory_doubles(form);
    }
    return most;
}
static void *get_motion_plan(const kr_motion *motion) { return (double *)motion->work + 1; }
/* Sets up the plan of motion->scene. On failure, the previous plan remains valid. The `bound` of
 * kr_exact_plan is min(motion->tol, KR_EXACT_BOUND), or KR_EXACT_BOUND if motion->tol is 0. */
static kr_status exact_reset(kr_motion *motion, const kr_state *start)
{
    (void)start; /* not used: the conversion to internal axes has rounded it */
    const kr_exact_isa *form = kr_closed_form_of(kr_scene_kind(motion->scene));
    if (!form) return KR_ERR_METHOD;
    const kr_exact_isa *isa = kr_exact_widest_isa(form);
    char *plan = get_motion_plan(motion), *made = plan + isa->scalar->plan_size;
    const double bound = motion->tol > 0.0 ? fmin(motion->tol, KR_EXACT_BOUND) : KR_EXACT_BOUND;
    kr_exact_info info;
    const kr_status status = isa->scalar->plan(motion->scene, 1, bound, made, &info);
    if (status != KR_OK) return status;
    memcpy(plan, made, isa->scalar->used_size(made));
    *(double *)motion->work = info.period;
    motion->aux = (void *)isa;
    return KR_OK;
}
static int exact_applies_to_kind(const kr_body *body, kr_kind kind)
{
    (void)body;
    return kr_closed_form_of(kind) != NULL;
}
static int exact_suits_scene(const kr_scene *scene)
{
    const kr_exact_isa *form = kr_closed_form_of(kr_scene_kind(scene));
    const kr_exact_scalar *scalar = form ? kr_exact_widest_isa(form)->scalar : NULL;
    return scalar && (!scalar->suits || scalar->suits(scene));
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
    *s = isa->scalar->state(get_motion_plan(motion), clock);
}
static void exact_at_times(const kr_motion *motion, size_t n, const double clock[], kr_state out[])
{
    kr_exact_evaluate_widest(motion->aux, get_motion_plan(motion), n, clock, out);
}
static void exact_read(const kr_motion *motion, kr_state *s)
{
    kr_motion now = *motion;
    exact_at(&now, motion->clock, s);
}

const kr_method kr_method_exact = {
    KR_METHOD_TEXTS("exact", "closed forms of the integrable tops", "all integrals",
                    "Klein and Sommerfeld 1897; Jacobi 1849; Kowalevski 1889; Chaplygin 1901; "
                    "Volterra 1899"),
    .order = 0,
    .flags = KR_METHOD_ADAPTIVE | KR_METHOD_REVERSIBLE | KR_METHOD_SYMPLECTIC |
             KR_METHOD_INTEGRABLE | KR_METHOD_ROTORS,
    .applies = exact_applies_to_kind,
    .suits = exact_suits_scene,
    .work = 1,
    .extra_doubles = count_extra_doubles,
    .reset = exact_reset,
    .step = exact_step,
    .read = exact_read,
    .at = exact_at,
    .at_times = exact_at_times,
};
