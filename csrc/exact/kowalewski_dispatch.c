/* The public functions of the closed form of Kowalewski tops. Each calls the code of the widest
 * instruction set that this processor has. All instruction sets give the same bits. */
#include "kowalewski.h"

const kr_kowalewski_isa *kr_kowalewski_isa_at(int i)
{
    static const kr_kowalewski_isa isas[] = {
#ifdef KR_WITH_AVX512
        {"avx512", kr_has_avx512, &KR_SCALAR_NAME(kr_kowalewski_one), kr_kowalewski_many_avx512},
#endif
#ifdef KR_WITH_AVX2
        {"avx2", kr_has_avx2, &kr_kowalewski_one_avx2, kr_kowalewski_many_avx2},
#endif
        {KR_BASE_NAME, kr_has_base, &kr_kowalewski_one_base, kr_kowalewski_many_base},
    };
    return i < (int)(sizeof isas / sizeof *isas) ? &isas[i] : NULL;
}
/* Returns the first instruction set of the table that this processor supports. Every processor
 * supports the last one. */
static const kr_kowalewski_isa *here(void)
{
    int i = 0;
    while (!kr_kowalewski_isa_at(i)->runs_here()) i++; /* untaken: if the first one runs */
    return kr_kowalewski_isa_at(i);
}
size_t kr_kowalewski_size(void) { return here()->one->size(); }
kr_status kr_kowalewski_plan(const kr_scene *scene, double bound, void *memory,
                             const kr_kowalewski **out)
{
    if (!memory || !out || !(bound >= 0.0)) return KR_ERR_ARGUMENT;
    const kr_status status = here()->one->plan(scene, 0, bound, memory);
    if (status == KR_OK) *out = memory;
    return status;
}
kr_status kr_kowalewski_own(const kr_scene *scene, void *memory)
{
    return here()->one->plan(scene, 1, 0.0, memory);
}
static const kr_theta_sums *plan_of(const kr_kowalewski *top)
{
    return (const kr_theta_sums *)(const void *)top;
}
kr_state kr_kowalewski_state(const kr_kowalewski *top, double t)
{
    return here()->one->state(plan_of(top), t);
}
void kr_kowalewski_states(const kr_kowalewski *top, size_t n, const double t[], kr_state out[])
{
    here()->many(plan_of(top), n, t, out);
}
const char *kr_kowalewski_refusal_text(int refusal)
{
    static const char *const texts[] = {
#define X(name, text) text,
        KR_KOWALEWSKI_REFUSAL_LIST(X)
#undef X
    };
    return refusal >= 0 && refusal < (int)(sizeof texts / sizeof *texts) ? texts[refusal] : NULL;
}
