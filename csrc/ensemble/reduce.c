/* Reductions over the times of one top, in their order, so that the bits depend on that top alone.
 * Mean and variance follow Welford (Technometrics 4, 1962) and do not cancel. */
#include "reduce.h"
#include <math.h>

const char *kr_reduce_name(kr_reduce kind)
{
    static const char *const names[] = {
#define X(kind, name) name,
        KR_REDUCE_LIST(X)
#undef X
    };
    return (unsigned)kind < KR_REDUCE_COUNT ? names[kind] : NULL;
}
/* Replaces the extreme value if `is_more_so`, or if x is NaN. */
static void add_extreme(kr_accumulator *kept, double x, double t, int is_more_so)
{
    if (isnan(x)) kept->value = kept->more = x;
    if (is_more_so) {
        kept->value = x;
        kept->more = t;
    }
}
/* Adds the k-th value x to an accumulator. */
static void add_value(kr_reduce kind, kr_accumulator *kept, double x, double t, size_t k)
{
    const double far = x - kept->value;
    switch (kind) {
    case KR_REDUCE_MIN:
    case KR_REDUCE_WHERE_MIN:
        add_extreme(kept, x, t, k == 0 || x < kept->value);
        break;
    case KR_REDUCE_MAX:
    case KR_REDUCE_WHERE_MAX:
        add_extreme(kept, x, t, k == 0 || x > kept->value);
        break;
    case KR_REDUCE_LAST:
        kept->value = x;
        break;
    default:
        kept->value = k == 0 ? x : kept->value + far / (double)(k + 1);
        kept->more = k == 0 ? 0.0 * x : kept->more + far * (x - kept->value);
        break;
    }
}
void kr_reduce_add(size_t n, const kr_reduction reduction[], kr_accumulator kept[],
                   const kr_scene *scene, const kr_state *state, size_t k)
{
    double values[9]; /* the largest kr_quantity_doubles */
    for (size_t i = 0; i < n; i++) {
        const kr_reduction *r = &reduction[i];
        if (i == 0 || r->quantity != r[-1].quantity)
            kr_quantity_values(r->quantity, scene, 1, state, values);
        add_value(r->kind, &kept[i], values[r->component], state->t, k);
    }
}
void kr_reduce_end(size_t n, const kr_reduction reduction[], const kr_accumulator kept[],
                   size_t states, double out[])
{
    for (size_t i = 0; i < n; i++) {
        const kr_reduce kind = reduction[i].kind;
        const int is_place = kind == KR_REDUCE_WHERE_MIN || kind == KR_REDUCE_WHERE_MAX;
        out[i] = kind == KR_REDUCE_VARIANCE ? kept[i].more / (double)states
                 : is_place                 ? kept[i].more
                                            : kept[i].value;
    }
}
