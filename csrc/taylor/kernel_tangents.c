/* Tangents in doubles. This file is compiled once for each instruction set. */
#include "quat_simd.h"
enum { WORDS = 1 };
#include "deviation_single.h"
#include "deviation.h"

static void expand_all(const kr_series *s, kr_tangent *tangents, size_t n, int order)
{
    expand_deviations(s, tangents, n, order);
}
static void sum_one(const kr_tangent *tangent, int order, const double *to, double *sum)
{
    sum_deviation(tangent, order, to, sum);
}
const kr_tangents_kernel KR_NAME(kr_tangents) = {expand_all, KR_BATCHED(KR_NAME(kr_expand_batches)),
                                                 sum_one};
