/* Batches of tangents in double-double precision, for results with 20 and 30 digits. This file is
 * compiled once for each instruction set. */
#define KR_LONG_FUNCTIONS
#include "quat_simd_dd.h"
enum { WORDS = 2 };
#include "deviation_batch.h"
#include "deviation.h"

void KR_NAME(kr_expand_batches_dd)(const kr_series *s, kr_tangent *tangents, size_t n, int order)
{
    expand_deviations(s, tangents, n, order);
}
