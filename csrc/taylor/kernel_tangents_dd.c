/* Tangents in double-double precision, for results with 20 and 30 digits. This file is compiled
 * once for each instruction set. */
#define KR_LONG_FUNCTIONS
#include "quat_simd_dd.h"
enum { WORDS = 2 };
#include "deviation_single.h"
#include "deviation.h"

static void expand_all_dd(const kr_series *s, kr_tangent *tangents, size_t n, int order)
{
    expand_deviations(s, tangents, n, order);
}
static void sum_one_dd(const kr_tangent *tangent, int order, const double *to, double *sum)
{
    sum_deviation(tangent, order, to, sum);
}
const kr_tangents_kernel KR_NAME(kr_tangents_dd) = {
    expand_all_dd, KR_BATCHED(KR_NAME(kr_expand_batches_dd)), sum_one_dd};
