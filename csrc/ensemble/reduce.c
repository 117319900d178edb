/* Statistics of a quantity of one top over its requested times, such as the mean. The states of a
 * top are added in the order of its requested times, so its results do not depend on other tops.
 * Mean and variance use Welford's update (Technometrics 4, 1962), which avoids cancellation. */
#include "slots.h"

/* Sets the extremum to x and its time to t if `is_new` is nonzero; both to NaN if x is NaN. */
static void update_extremum(kr_accumulator *accumulator, double x, double t, int is_new)
{
    if (!is_new && !isnan(x)) return;
    accumulator->value = x;
    accumulator->more = isnan(x) ? x : t;
}
/* Adds x, the value of the quantity in state k = 0, 1, ... at the time t, to an accumulator. */
static void add_value(kr_reduce kind, kr_accumulator *accumulator, double x, double t, size_t k)
{
    const double far = x - accumulator->value;
    switch (kind) {
    case KR_REDUCE_MIN:
    case KR_REDUCE_WHERE_MIN:
        update_extremum(accumulator, x, t, k == 0 || x < accumulator->value);
        break;
    case KR_REDUCE_MAX:
    case KR_REDUCE_WHERE_MAX:
        update_extremum(accumulator, x, t, k == 0 || x > accumulator->value);
        break;
    case KR_REDUCE_LAST:
        accumulator->value = x;
        break;
    default:
        accumulator->value = k == 0 ? x : accumulator->value + far / (double)(k + 1);
        accumulator->more = k == 0 ? 0.0 * x : accumulator->more + far * (x - accumulator->value);
        break;
    }
}
void kr_reduce_add(size_t n, const kr_reduction reduction[], kr_accumulator accumulators[],
                   const kr_scene *scene, const kr_state *state, size_t k)
{
    double values[9]; /* a quantity has at most 9 numbers */
    for (size_t i = 0; i < n; i++) {
        const kr_reduction *r = &reduction[i];
        if (i == 0 || r->quantity != r[-1].quantity)
            kr_quantity_values(r->quantity, scene, 1, state, values);
        add_value(r->kind, &accumulators[i], values[r->component], state->t, k);
    }
}
void kr_reduce_end(size_t n, const kr_reduction reduction[], const kr_accumulator accumulators[],
                   size_t states, double out[])
{
    for (size_t i = 0; i < n; i++) {
        const kr_reduce kind = reduction[i].kind;
        const int is_place = kind == KR_REDUCE_WHERE_MIN || kind == KR_REDUCE_WHERE_MAX;
        out[i] = kind == KR_REDUCE_VARIANCE ? accumulators[i].more / (double)states
                 : is_place                 ? accumulators[i].more
                                            : accumulators[i].value;
    }
}
