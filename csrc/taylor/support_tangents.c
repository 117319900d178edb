/* Tangents of tops with dry friction or on moving supports, in double and in double-double
 * precision. The Taylor series of the tangents are computed by the code in support_deviation.h. */
#include <string.h>
#include "support_setup.h"
#include "tangents.h"

enum { TERMS = KR_TAYLOR_MAX + 1 /* coefficients of a series */ };

/* Writes the constants `scale` in k = scale[0] + scale[1] cos u + scale[2] sin u + scale[3] t
 * sin u, where u is the phase of the shaking, and t is counted from `since` (unit of both:
 * 1 / rate). As `timing` selects (kr_timing, method.h), k is the effective gravity g(t), in the
 * user's units, or its derivative by gravity or by amplitude, rate or phase of the shaking. */
static void set_timing_constants(const kr_motion *motion, double rate, dd since, double timing,
                                 dd scale[4])
{
    const kr_shaking *shaking = &motion->scene->shaking;
    const double unit = motion->time_unit / rate;
    const dd t = dd_add(dd_of(motion->scene->start.t), dd_scale(unit, since)),
             square = two_product(shaking->rate, shaking->rate),
             most = dd_times(shaking->amplitude, square),
             twice = two_product(2.0 * shaking->amplitude, shaking->rate);
    switch ((int)timing) {
    case KR_TIMING_STRENGTH:
        scale[0] = dd_of(motion->scene->gravity);
        scale[1] = kr_support_shakes(motion->scene) ? dd_neg(most) : dd_of(0.0);
        break;
    case KR_TIMING_UNIFORM:
        scale[0] = dd_of(1.0);
        break;
    case KR_TIMING_AMPLITUDE:
        scale[1] = dd_neg(square);
        break;
    case KR_TIMING_RATE:
        scale[1] = dd_neg(twice);
        scale[2] = dd_mul(t, most);
        scale[3] = dd_times(unit, most);
        break;
    default:
        scale[2] = most;
        break;
    }
}

#include "math/real.h"
#include "support_deviation.h"
#define KR_DEEP
#include "math/real.h"
#include "support_deviation.h"

/* Expands n tangents or, if `jump_factor` is not NULL, applies kr_support_jump_tangents to them. */
static void expand_or_jump_tangents(const kr_motion *motion, double rate, const kr_series path[2],
                                    kr_tangent *first, size_t n, int order, const dd *jump_factor)
{
    if (motion->digits > 16)
        deep_expand_or_jump_tangents(motion, rate, path, first, n, order, jump_factor);
    else
        plain_expand_or_jump_tangents(motion, rate, path, first, n, order, jump_factor);
}
void kr_support_expand_tangents(const kr_motion *motion, double rate, const kr_series path[2],
                                kr_tangent *first, size_t n, int order)
{
    expand_or_jump_tangents(motion, rate, path, first, n, order, NULL);
}
void kr_support_jump_tangents(const kr_motion *motion, double rate, const kr_series ended[2],
                              kr_tangent *first, size_t n, dd factor)
{
    kr_series path[2];
    memcpy(path, ended, sizeof path);
    for (int word = 0; word < 2; word++) {
        memcpy(path[word].x[0], ended[word].end_x, sizeof ended->end_x);
        memcpy(path[word].w[0], ended[word].end_w, sizeof ended->end_w);
        path[word].t = ended[word].end;
    }
    path[0].slides = path[0].holds = 0.0;
    expand_or_jump_tangents(motion, rate, path, first, n, 1, &factor);
}
