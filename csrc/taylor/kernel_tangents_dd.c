/* deviation.h for single tangents in double-double precision (20 and 30 digits). This file is
 * compiled once for each instruction set. */
#define KR_LONG_FUNCTIONS
#include "quat_simd_dd.h"
enum { WORDS = 2 };
#include "deviation_single.h"
#include "deviation.h"

const kr_tangents_kernel KR_NAME(kr_tangents_dd) = {
    expand_deviations, KR_BATCHED(KR_NAME(kr_expand_batches_dd)), evaluate_deviation};
