/* deviation.h for single tangents in doubles. Compiled once for each instruction set. */
#include "quat_simd.h"
enum { WORDS = 1 };
#include "deviation_single.h"
#include "deviation.h"

const kr_tangents_kernel KR_NAME(kr_tangents) = {
    expand_deviations, KR_BATCHED(KR_NAME(kr_expand_batches)), evaluate_deviation};
