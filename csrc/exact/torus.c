/* The public functions of the closed-form solutions for Kowalewski and Goryachev-Chaplygin tops.
 * The functions that compute solutions and states call the code for the widest instruction set that
 * the processor supports. All instruction sets give bitwise equal results. */
#include <math.h>
#include "goryachev_chaplygin.h"
#include "kowalewski.h"

static size_t kowalewski_used_size(const void *memory)
{
    const kr_kowalewski_torus *plan = memory;
    return offsetof(kr_kowalewski_torus, harmonic) + (size_t)plan->terms * sizeof *plan->harmonic +
           4 * (size_t)(plan->nodes * plan->nodes);
}
static size_t chaplygin_used_size(const void *memory)
{
    const kr_chaplygin_plan *plan = memory;
    size_t terms = 0;
    for (int i = 0; i < plan->rows; i++) terms += 2 * (size_t)plan->row[i].count;
    return offsetof(kr_chaplygin_plan, term) + terms * sizeof *plan->term;
}
const kr_torus_form kr_kowalewski_form = {
    KR_KIND_KOWALEWSKI,
    KR_KOWALEWSKI_BOUND,
    sizeof(kr_kowalewski_torus),
    offsetof(kr_kowalewski_torus, torus),
    NULL,
    kowalewski_used_size,
    {
#ifdef KR_WITH_AVX512
        {"avx512", kr_has_avx512, &KR_SCALAR_NAME(kr_kowalewski_scalar),
         KR_BATCHED(kr_kowalewski_evaluate_avx512)},
#endif
#ifdef KR_WITH_AVX2
        {"avx2", kr_has_avx2, &kr_kowalewski_scalar_avx2, KR_BATCHED(kr_kowalewski_evaluate_avx2)},
#endif
        {KR_BASE_NAME, kr_has_base, &kr_kowalewski_scalar_base,
         KR_BATCHED(kr_kowalewski_evaluate_base)},
        {NULL, NULL, NULL, NULL},
    },
};
const kr_torus_form kr_chaplygin_form = {
    KR_KIND_GORYACHEV_CHAPLYGIN,
    KR_CHAPLYGIN_BOUND,
    sizeof(kr_chaplygin_plan),
    offsetof(kr_chaplygin_plan, torus),
    kr_chaplygin_is_level,
    chaplygin_used_size,
    {
#ifdef KR_WITH_AVX512
        {"avx512", kr_has_avx512, &KR_SCALAR_NAME(kr_chaplygin_scalar),
         KR_BATCHED(kr_chaplygin_evaluate_avx512)},
#endif
#ifdef KR_WITH_AVX2
        {"avx2", kr_has_avx2, &kr_chaplygin_scalar_avx2, KR_BATCHED(kr_chaplygin_evaluate_avx2)},
#endif
        {KR_BASE_NAME, kr_has_base, &kr_chaplygin_scalar_base,
         KR_BATCHED(kr_chaplygin_evaluate_base)},
        {NULL, NULL, NULL, NULL},
    },
};

static kr_status plan_of_user(const kr_torus_form *form, const kr_scene *scene, double bound,
                              void *memory)
{
    if (!memory || !(bound >= 0.0)) return KR_ERR_ARGUMENT;
    return kr_torus_widest_isa(form)->scalar->plan(scene, 0, bound, memory);
}
/* Returns the message with the index `refusal`, or NULL if the index is invalid. */
static const char *find_text(const char *const texts[], int count, int refusal)
{
    return refusal >= 0 && refusal < count ? texts[refusal] : NULL;
}

size_t kr_kowalewski_size(void)
{
    return kr_torus_widest_isa(&kr_kowalewski_form)->scalar->memory_size;
}
kr_status kr_kowalewski_plan(const kr_scene *scene, double bound, void *memory,
                             const kr_kowalewski **out)
{
    if (!out) return KR_ERR_ARGUMENT;
    const kr_status status = plan_of_user(&kr_kowalewski_form, scene, bound, memory);
    if (status == KR_OK) *out = memory;
    return status;
}
kr_state kr_kowalewski_state(const kr_kowalewski *top, double t)
{
    return kr_torus_widest_isa(&kr_kowalewski_form)->scalar->state(top, t);
}
kr_state kr_kowalewski_state_at(const kr_kowalewski *top, double first, double second)
{
    return kr_torus_widest_isa(&kr_kowalewski_form)->scalar->state_at(top, first, second);
}
void kr_kowalewski_states(const kr_kowalewski *top, size_t n, const double t[], kr_state out[])
{
    kr_torus_states(&kr_kowalewski_form, top, n, t, out);
}
const char *kr_kowalewski_refusal_text(int refusal)
{
    static const char *const texts[] = {
#define KR_X_(name, text) text,
        KR_KOWALEWSKI_REFUSAL_LIST(KR_X_)
#undef KR_X_
    };
    return find_text(texts, KR_KOWALEWSKI_REFUSAL_COUNT, refusal);
}

size_t kr_goryachev_chaplygin_size(void)
{
    return kr_torus_widest_isa(&kr_chaplygin_form)->scalar->memory_size;
}
kr_status kr_goryachev_chaplygin_plan(const kr_scene *scene, double bound, void *memory,
                                      const kr_goryachev_chaplygin **out)
{
    if (!out) return KR_ERR_ARGUMENT;
    const kr_status status = plan_of_user(&kr_chaplygin_form, scene, bound, memory);
    if (status == KR_OK) *out = memory;
    return status;
}
kr_state kr_goryachev_chaplygin_state(const kr_goryachev_chaplygin *top, double t)
{
    return kr_torus_widest_isa(&kr_chaplygin_form)->scalar->state(top, t);
}
kr_state kr_goryachev_chaplygin_state_at(const kr_goryachev_chaplygin *top, double first,
                                         double second)
{
    return kr_torus_widest_isa(&kr_chaplygin_form)->scalar->state_at(top, first, second);
}
void kr_goryachev_chaplygin_states(const kr_goryachev_chaplygin *top, size_t n, const double t[],
                                   kr_state out[])
{
    kr_torus_states(&kr_chaplygin_form, top, n, t, out);
}
const char *kr_goryachev_chaplygin_refusal_text(int refusal)
{
    static const char *const texts[] = {
#define KR_X_(name, text) text,
        KR_CHAPLYGIN_REFUSAL_LIST(KR_X_)
#undef KR_X_
    };
    return find_text(texts, KR_CHAPLYGIN_REFUSAL_COUNT, refusal);
}

int kr_chaplygin_is_level(const kr_scene *scene) { return scene->start.m.z == 0.0; }
