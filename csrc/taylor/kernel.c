/* Taylor series in double precision. This file is compiled once for each instruction set, with
 * options such as -DKR_ISA=avx2 -mavx2 -mfma (CMakeLists.txt). Results are bitwise equal for gcc
 * and clang, and for all instruction sets with fused multiply-add. */
#include "quat_simd.h"
#include "series.h"

PER_ORDER void expand_with_heading(kr_series *s, int from, int order)
{
    expand_series(s, from, order, WHOLE);
}
PER_ORDER void expand_without_heading(kr_series *s, int from, int order)
{
    expand_series(s, from, order, HEADLESS);
}
/* Evaluates the Taylor series at the time s->at, and writes the values to s->at_x and s->at_w. */
PER_ORDER void evaluate_series(kr_series *s, int order)
{
    evaluate_terms_over_power(s, 0, order, &s->at, s->at_x, s->at_w);
}
/* Sets the end of the step according to log2 of the tolerance, and evaluates the series there. */
PER_ORDER void end_step_by_tolerance(kr_series *s, int order, double log2_tol, double direction)
{
    s->end = s->t + direction * series_step_size(s, order, log2_tol);
    evaluate_terms_over_power(s, 0, order, &s->end, s->end_x, s->end_w);
}

/* Compilers unroll only loops of constant length, so each order n has its own functions. STEP
 * defines a function that computes a step of order n. `form` is with_heading or without_heading.
 * KERNELS(n) defines all functions of order n. ORDERS(X) expands to X(n) for every order n.
 * WHOLE_KERNEL (with q) and HEADLESS_KERNEL (without q) are elements of the tables below. */
#define STEP(form, n)                                                                              \
    static void step_##form##_##n(kr_series *s, double log2_tol, double direction)                 \
    {                                                                                              \
        begin_step(s);                                                                             \
        expand_##form(s, 0, n);                                                                    \
        end_step_by_tolerance(s, n, log2_tol, direction);                                          \
    }
#define KERNELS(n)                                                                                 \
    STEP(with_heading, n)                                                                          \
    STEP(without_heading, n)                                                                       \
    static void evaluate_##n(kr_series *s) { evaluate_series(s, n); }
#define ORDERS(X) X(12) X(16) X(18) X(22) X(28)
#define WHOLE_KERNEL(n) {n, step_with_heading_##n, evaluate_##n},
#define HEADLESS_KERNEL(n) {n, step_without_heading_##n, evaluate_##n},
ORDERS(KERNELS)
const kr_kernel KR_NAME(kr_kernel)[KR_ORDERS] = {ORDERS(WHOLE_KERNEL)};
const kr_kernel KR_NAME(kr_headless)[KR_ORDERS] = {ORDERS(HEADLESS_KERNEL)};

/* TAIL defines the functions of a kr_tail for 20 or 30 digits (kernel_dd.c). */
#define TAIL(digits)                                                                               \
    static void expand_##digits(kr_series *s)                                                      \
    {                                                                                              \
        expand_with_heading(s, KR_HEAD_##digits, KR_LAST_##digits);                                \
    }                                                                                              \
    static void sum_##digits(const kr_series *s, const double *to, double *x, double *w)           \
    {                                                                                              \
        evaluate_terms_over_power(s, KR_HEAD_##digits + 1, KR_LAST_##digits, to, x, w);            \
    }
TAIL(20)
TAIL(30)
const kr_tail KR_NAME(kr_tail)[KR_DEPTHS] = {{expand_20, sum_20}, {expand_30, sum_30}};

/* For n = 0, ..., N, adds to c[n] the n-th coefficient of the product of two power series with the
 * coefficients a and b. N + 1 is the least multiple of eight that exceeds `order`. The elements
 * b[-7] to b[-1], a[order + 1] to a[N] and b[order + 1] to b[N] must be 0. The products with a[j]
 * for even and for odd j are summed in two parallel chains. */
void KR_NAME(kr_product)(const double *a, const double *b, int order, double *c)
{
    for (int n = 0; n <= order; n += 8) {
        duo even = duo_load(c + n), odd = duo_splat(0.0);
        for (int j = 0; j < n + 8; j += 2) {
            even = duo_fma(duo_splat(a[j]), duo_load(b + n - j), even);
            odd = duo_fma(duo_splat(a[j + 1]), duo_load(b + n - j - 1), odd);
        }
        duo_store(c + n, duo_add(even, odd));
    }
}
