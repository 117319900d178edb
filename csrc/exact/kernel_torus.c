/* States of a Kowalewski top, a Goryachev-Chaplygin top or a free gyrostat (torus.h) at many times.
 * Each vector lane computes the state at a different time. The results are bitwise equal to those
 * of kr_exact_scalar.state (exact.h). This file is compiled once for each instruction set. */
#define KR_EXACT_LANES
#include "goryachev_chaplygin.h"
#include "kowalewski.h"

void KR_NAME(kr_gyrostat_evaluate)(const void *plan, size_t n, const double t[], kr_state out[])
{
    evaluate_torus(gyrostat_state_after_span, plan, n, t, out);
}
void KR_NAME(kr_chaplygin_evaluate)(const void *plan, size_t n, const double t[], kr_state out[])
{
    evaluate_torus(chaplygin_state_after_span, plan, n, t, out);
}
void KR_NAME(kr_kowalewski_evaluate)(const void *plan, size_t n, const double t[], kr_state out[])
{
    evaluate_torus(kowalewski_state_after_span, plan, n, t, out);
}
