/* Batches of tangents in double precision. This file is compiled once for each instruction set. */
#include "quat_simd.h"
enum { WORDS = 1 };
#include "deviation_batch.h"
#include "deviation.h"

void KR_NAME(kr_expand_batches)(const kr_series *s, kr_tangent *tangents, size_t n, int order)
{
    expand_deviations(s, tangents, n, order);
}
