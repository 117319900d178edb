/* Taylor series with 20 and 30 digits. The terms 0 to `head` of a series are computed in
 * double-double precision, and the terms head + 1 to `last`, the tail, in double precision
 * (kernel.c). The terms in double-double precision are about a third of all terms for 20 digits,
 * and about half for 30 digits. This file is compiled once for each instruction set. */
#define KR_LONG_FUNCTIONS
#include "quat_simd_dd.h"
#include "series.h"

/* Evaluates a series at the time *to. Writes (q | P) to x, and W to w (taylor.h). tail->sum returns
 * the sum of the terms after `head`, in double precision, divided by (*to - s->t)^(head + 1). */
INLINE void evaluate_mixed_precision(const kr_series *s, int head, const kr_tail *tail,
                                     const double *to, double *x, double *w)
{
    const double h = *to - s->t;
    double tail_x[8], tail_w[4], power = h;
    for (int i = 0; i < head; i++) power *= h;
    tail->sum(s, to, tail_x, tail_w);
    evaluate_terms_over_power(s, 0, head, to, x, w);
    duo_store(x, duo_fma(duo_splat(power), duo_load_doubles(tail_x), duo_load(x)));
    quad_store(w, quad_fma(quad_splat(power), quad_load_doubles(tail_w), quad_load(w)));
}
INLINE void advance_mixed_precision(kr_series *s, int head, int last, double log2_less,
                                    const kr_tail *tail, double log2_tol, double direction)
{
    begin_step(s);
    expand_series(s, 0, head, WHOLE);
    const double by_tail = step_size_for_product_size(s, head, log2_tol + log2_less);
    tail->expand(s);
    const double by_last = series_step_size(s, last, log2_tol);
    s->end = s->t + direction * (by_last < by_tail ? by_last : by_tail);
    evaluate_mixed_precision(s, head, tail, &s->end, s->end_x, s->end_w);
}

/* DIGITS defines the two functions of a kr_kernel for n = 20 or 30 digits. */
#define DIGITS(n)                                                                                  \
    static void advance_##n(kr_series *s, double log2_tol, double direction)                       \
    {                                                                                              \
        advance_mixed_precision(s, KR_HEAD_##n, KR_LAST_##n, KR_LESS_##n,                          \
                                &KR_NAME(kr_tail)[KR_DIGITS_##n], log2_tol, direction);            \
    }                                                                                              \
    static void evaluate_##n(kr_series *s)                                                         \
    {                                                                                              \
        evaluate_mixed_precision(s, KR_HEAD_##n, &KR_NAME(kr_tail)[KR_DIGITS_##n], &s->at,         \
                                 s->at_x, s->at_w);                                                \
    }
DIGITS(20)
DIGITS(30)
const kr_kernel KR_NAME(kr_kernel_dd)[KR_DEPTHS] = {{KR_LAST_20, advance_20, evaluate_20},
                                                    {KR_LAST_30, advance_30, evaluate_30}};
