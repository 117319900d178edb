/* The public functions for closed-form solutions. Each function calls the code for the widest
 * instruction set that this processor supports. All instruction sets give bitwise equal results. */
#include <math.h>
#include <string.h>
#include "goryachev_chaplygin.h"
#include "kowalewski.h"
#include "model/scene.h"

/* The rows of a closed form for the instruction sets of the build. */
#ifdef KR_WITH_AVX512
#  define ROW_AVX512(form)                                                                         \
      {"avx512", kr_has_avx512, &KR_SCALAR_NAME(kr_##form##_scalar),                               \
       KR_BATCHED(kr_##form##_evaluate_avx512)},
#else
#  define ROW_AVX512(form)
#endif
#ifdef KR_WITH_AVX2
#  define ROW_AVX2(form)                                                                           \
      {"avx2", kr_has_avx2, &kr_##form##_scalar_avx2, KR_BATCHED(kr_##form##_evaluate_avx2)},
#else
#  define ROW_AVX2(form)
#endif
#define ROWS(form)                                                                                 \
    {                                                                                              \
        ROW_AVX512(form) ROW_AVX2(form)                                                            \
        {                                                                                          \
            KR_BASE_NAME, kr_has_base, &kr_##form##_scalar_base,                                   \
                KR_BATCHED(kr_##form##_evaluate_base)                                              \
        }                                                                                          \
    }

static size_t size_of_form(const void *plan) { return (void)plan, sizeof(kr_exact_form); }
const kr_closed_form kr_symmetric_form = {sizeof(kr_exact_form), size_of_form, kr_exact_resolves,
                                          ROWS(exact)};
/* KR_NO_TORUS leaves out Kowalewski and Goryachev-Chaplygin tops, which are half of the code. */
#ifndef KR_NO_TORUS
static size_t kowalewski_used_size(const void *memory)
{
    const kr_kowalewski_torus *plan = memory;
    return offsetof(kr_kowalewski_torus, harmonic) + (size_t)plan->terms * sizeof *plan->harmonic +
           4 * (size_t)(plan->nodes * plan->nodes);
}
static size_t chaplygin_used_size(const void *memory)
{
    const kr_chaplygin_plan *plan = memory;
    const size_t terms = (size_t)(plan->first + 2 * plan->sections * plan->terms);
    return offsetof(kr_chaplygin_plan, term) + terms * sizeof *plan->term;
}
static int suits_any(const kr_scene *scene) { return (void)scene, 1; }
static int is_level(const kr_scene *scene) { return scene->start.m.z == 0.0; }
const kr_closed_form kr_kowalewski_form = {sizeof(kr_kowalewski_torus), kowalewski_used_size,
                                           suits_any, ROWS(kowalewski)};
const kr_closed_form kr_chaplygin_form = {sizeof(kr_chaplygin_plan), chaplygin_used_size, is_level,
                                          ROWS(chaplygin)};
#endif
const kr_closed_form *kr_closed_form_of(kr_kind kind)
{
#ifndef KR_NO_TORUS
    if (kind == KR_KIND_KOWALEWSKI) return &kr_kowalewski_form;
    if (kind == KR_KIND_GORYACHEV_CHAPLYGIN) return &kr_chaplygin_form;
#endif
    return kind == KR_KIND_LAGRANGE || kind == KR_KIND_EULER ? &kr_symmetric_form : NULL;
}
const kr_exact_isa *kr_exact_widest_isa(const kr_closed_form *form)
{
    const kr_exact_isa *isa = form->isas;
    while (!isa->runs_here()) isa++; /* untaken: if the first one runs */
    return isa;
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

/* The beginning of a kr_exact; a plan follows. */
struct kr_exact {
    kr_exact_info info;
    const kr_exact_isa *isa;
};
KR_CHECK_LAYOUT(kr_exact_size_is_known, sizeof(kr_exact) + sizeof(kr_exact_form) <= KR_EXACT_SIZE);
static const void *plan_after(const kr_exact *exact) { return exact + 1; }

size_t kr_exact_size(const kr_scene *scene)
{
    const kr_closed_form *form = scene ? kr_closed_form_of(kr_scene_kind(scene)) : NULL;
    if (!form) form = &kr_symmetric_form;
    return sizeof(kr_exact) + kr_exact_widest_isa(form)->scalar->memory_size;
}
kr_status kr_exact_plan(const kr_scene *scene, double bound, kr_exact *exact)
{
    if (!scene || !exact || !(bound >= 0.0)) return KR_ERR_ARGUMENT;
    const kr_exact_info none = {.kind = kr_scene_kind(scene), .refusal = KR_REFUSAL_KIND};
    const kr_closed_form *form = kr_closed_form_of(none.kind);
    if (!form) form = &kr_symmetric_form; /* checks the scene, and refuses it */
    exact->info = none;
    exact->isa = kr_exact_widest_isa(form);
    const kr_status status = exact->isa->scalar->plan(
        scene, 0, bound > 0.0 ? bound : KR_EXACT_BOUND, exact + 1, &exact->info);
    if (status == KR_OK) exact->info.used = sizeof *exact + form->used_size(exact + 1);
    return status;
}
kr_exact_info kr_exact_describe(const kr_exact *exact) { return exact->info; }
kr_state kr_exact_state(const kr_exact *exact, double t)
{
    return exact->isa->scalar->state(plan_after(exact), t);
}
kr_state kr_exact_state_at(const kr_exact *exact, double first, double second)
{
    static const kr_state none = {NAN, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    const kr_exact_scalar *scalar = exact->isa->scalar;
    return scalar->state_at ? scalar->state_at(plan_after(exact), first, second) : none;
}
void kr_exact_states(const kr_exact *exact, size_t n, const double t[], kr_state out[])
{
    kr_exact_evaluate_widest(exact->isa, plan_after(exact), n, t, out);
}
const char *kr_refusal_text(kr_refusal refusal)
{
    static const char *const texts[] = {
#define X(name, text) text,
        KR_REFUSAL_LIST(X)
#undef X
    };
    return (unsigned)refusal < KR_REFUSAL_COUNT ? texts[refusal] : NULL;
}

kr_status kr_exact_nutation(const kr_scene *scene, kr_nutation *out)
{
    if (!out) return KR_ERR_ARGUMENT;
#ifdef KR_WITH_AVX2
    if (kr_has_avx2()) /* untaken: all calls give one answer */
        return kr_exact_limits_avx2(scene, (kr_nutation_form *)(void *)out);
#endif
    return kr_exact_limits_base(scene, (kr_nutation_form *)(void *)out);
}
double kr_nutation_potential(const kr_nutation *motion, double nutation)
{
    kr_nutation_form r;
    memcpy(&r, motion, sizeof r);
    const double half = tan(0.5 * nutation), sum = r.sum != 0.0 ? r.sum * half : 0.0,
                 difference = r.difference != 0.0 ? r.difference / half : 0.0,
                 across = sum + difference;
    return across * across / (8.0 * r.inertia) + r.axial_energy + r.lever * cos(nutation);
}
/* The batch functions are listed in a separate table, so that programs that compute only single
 * tops do not link the batch code. */
const kr_exact_batch_isa *kr_exact_batch_isa_at(int i)
{
    static const kr_exact_batch_isa widths[] = {
#ifdef KR_WITH_AVX512
        {"avx512", kr_has_avx512, &KR_SCALAR_NAME(kr_exact_scalar),
         KR_BATCHED(kr_exact_batch_avx512)},
#endif
#ifdef KR_WITH_AVX2
        {"avx2", kr_has_avx2, &kr_exact_scalar_avx2, KR_BATCHED(kr_exact_batch_avx2)},
#endif
        {KR_BASE_NAME, kr_has_base, &kr_exact_scalar_base, KR_BATCHED(kr_exact_batch_base)},
    };
    return i < (int)(sizeof widths / sizeof *widths) ? &widths[i] : NULL;
}
void kr_exact_run(const kr_exact_request *request)
{
    int i = 0;
    while (!kr_exact_batch_isa_at(i)->runs_here()) i++; /* untaken: if the first one runs */
    const kr_exact_batch_isa *isa = kr_exact_batch_isa_at(i);
#ifdef KR_NO_BATCHES
    for (size_t top = 0; top < request->n; top++) {
        const double *t = request->own_times ? request->t + top * request->times : request->t;
        kr_exact_form form;
        kr_exact_info info;
        request->status[top] = isa->scalar->plan(&request->scenes[top], 0, 0.0, &form, &info);
        if (request->status[top] != KR_OK) continue;
        if (request->plans) request->plans[top] = form;
        for (size_t k = 0; k < request->times; k++)
            request->states[top * request->times + k] = isa->scalar->state(&form, t[k]);
    }
#else
    isa->batch(isa->scalar, request);
#endif
}
