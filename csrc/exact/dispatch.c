/* The public functions for closed-form solutions. Each function calls the code for the widest
 * instruction set that this processor supports. */
#include <math.h>
#include <string.h>
#include "dispatch.h"

const kr_exact_isa *kr_exact_isa_at(int i)
{
    static const kr_exact_isa isas[] = {
#ifdef KR_WITH_AVX512
        {"avx512", kr_has_avx512, &KR_SCALAR_NAME(kr_exact_scalar),
         KR_BATCHED(kr_exact_evaluate_avx512)},
#endif
#ifdef KR_WITH_AVX2
        {"avx2", kr_has_avx2, &kr_exact_scalar_avx2, KR_BATCHED(kr_exact_evaluate_avx2)},
#endif
        {KR_BASE_NAME, kr_has_base, &kr_exact_scalar_base, KR_BATCHED(kr_exact_evaluate_base)},
    };
    return i < (int)(sizeof isas / sizeof *isas) ? &isas[i] : NULL;
}
/* Returns the widest instruction set that this processor supports. The last instruction set in the
 * table runs on every processor. */
static const kr_exact_isa *widest_isa(void)
{
    int i = 0;
    while (!kr_exact_isa_at(i)->runs_here()) i++; /* untaken: if the first one runs */
    return kr_exact_isa_at(i);
}
kr_status kr_exact_plan_own_units(const kr_scene *scene, kr_exact_form *form)
{
    return widest_isa()->scalar->plan(scene, 1, form);
}
kr_state kr_exact_form_state(const kr_exact_form *form, double t)
{
    return widest_isa()->scalar->state(form, t);
}
void kr_exact_form_states(const kr_exact_form *form, size_t n, const double t[], kr_state out[])
{
    const kr_exact_isa *isa = widest_isa();
#ifdef KR_NO_BATCHES
    for (size_t i = 0; i < n; i++) out[i] = isa->scalar->state(form, t[i]);
#else
    isa->evaluate(form, n, t, out);
#endif
}
/* The aliasing rules described in layout.h permit the cast from kr_exact to kr_exact_form. */
static const kr_exact_form *form_of(const kr_exact *exact)
{
    return (const kr_exact_form *)(const void *)exact;
}
kr_status kr_exact_plan(const kr_scene *scene, kr_exact *exact)
{
    if (!exact) return KR_ERR_ARGUMENT;
    return widest_isa()->scalar->plan(scene, 0, (kr_exact_form *)(void *)exact);
}
kr_state kr_exact_state(const kr_exact *exact, double t)
{
    return kr_exact_form_state(form_of(exact), t);
}
void kr_exact_states(const kr_exact *exact, size_t n, const double t[], kr_state out[])
{
    kr_exact_form_states(form_of(exact), n, t, out);
}
kr_status kr_exact_turning(const kr_scene *scene, kr_turning *turning)
{
    if (!turning) return KR_ERR_ARGUMENT;
    return widest_isa()->scalar->turning(scene, (kr_turning_form *)(void *)turning);
}
double kr_turning_potential(const kr_turning *turning, double nutation)
{
    kr_turning_form r;
    memcpy(&r, turning, sizeof r);
    const double half = tan(0.5 * nutation), sum = r.sum != 0.0 ? r.sum * half : 0.0,
                 difference = r.difference != 0.0 ? r.difference / half : 0.0,
                 across = sum + difference;
    return across * across / (8.0 * r.inertia) + r.axial_energy + r.lever * cos(nutation);
}
/* The Bobenko-Suris map is evaluated one state at a time, so AVX-512 would not be faster than
 * AVX2. */
static const kr_exact_maps *widest_maps(void)
{
#ifdef KR_WITH_AVX2
    if (kr_has_avx2()) return &kr_exact_maps_avx2; /* untaken: all calls give one answer */
#endif
    return &kr_exact_maps_base;
}
kr_status kr_exact_map_plan(const kr_scene *scene, double step, kr_exact_map *map)
{
    if (!map) return KR_ERR_ARGUMENT;
    return widest_maps()->plan(scene, step, (kr_exact_map_form *)(void *)map);
}
kr_state kr_exact_map_state(const kr_exact_map *map, int64_t k)
{
    return widest_maps()->state((const kr_exact_map_form *)(const void *)map, k);
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
        request->status[top] = isa->scalar->plan(&request->scenes[top], 0, &form);
        if (request->status[top] != KR_OK) continue;
        if (request->plans) request->plans[top] = form;
        for (size_t k = 0; k < request->times; k++)
            request->states[top * request->times + k] = isa->scalar->state(&form, t[k]);
    }
#else
    isa->batch(isa->scalar, request);
#endif
}
