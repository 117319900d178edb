/* The Taylor series in doubles. This file is compiled once per instruction set: -DKR_ISA=avx2
 * -mavx2 -mfma, and so on (CMakeLists.txt); without any of that, for the one that runs everywhere.
 * gcc and clang give the same bits, and so does every instruction set with a fused product. */
#include "lanes.h"
#include "series.h"

/* whole and headless expand the series with and without the heading. */
PER_ORDER void whole(kr_series *s, int from, int order) { expand(s, from, order, WHOLE); }
PER_ORDER void headless(kr_series *s, int from, int order) { expand(s, from, order, HEADLESS); }
/* Sums the series at any time inside the piece. */
PER_ORDER void look(kr_series *s, int order) { sum_series(s, 0, order, &s->at, s->at_x, s->at_w); }
/* Chooses where the piece ends, and sums the series there. */
PER_ORDER void go(kr_series *s, int order, double log2_tol, double direction)
{
    s->end = s->t + direction * step_size(s, order, log2_tol);
    sum_series(s, 0, order, &s->end, s->end_x, s->end_w);
}

/* A compiler lays out loops whose length it knows, and a kernel is reached by a pointer without an
 * order. So every order n has functions of its own, in which n is a constant: STEP writes one that
 * steps, whole_n or headless_n; ORDER writes these two and look_n, which reads a state. ORDERS
 * lists the orders; WHOLE_KERNEL and HEADLESS_KERNEL make the rows of the tables from the same
 * list. */
#define STEP(form, n)                                                                              \
    static void form##_##n(kr_series *s, double log2_tol, double direction)                        \
    {                                                                                              \
        begin_at_end(s);                                                                           \
        form(s, 0, n);                                                                             \
        go(s, n, log2_tol, direction);                                                             \
    }
#define ORDER(n)                                                                                   \
    STEP(whole, n)                                                                                 \
    STEP(headless, n)                                                                              \
    static void look_##n(kr_series *s) { look(s, n); }
#define ORDERS(X) X(12) X(16) X(18) X(22) X(28)
#define WHOLE_KERNEL(n) {n, whole_##n, look_##n},
#define HEADLESS_KERNEL(n) {n, headless_##n, look_##n},
ORDERS(ORDER)
const kr_kernel KR_NAME(kr_kernel)[KR_ORDERS] = {ORDERS(WHOLE_KERNEL)};
const kr_kernel KR_NAME(kr_headless)[KR_ORDERS] = {ORDERS(HEADLESS_KERNEL)};

/* TAIL writes the functions for the terms in doubles that follow a head of double-doubles
 * (kernel_dd.c). */
#define TAIL(digits)                                                                               \
    static void expand_##digits(kr_series *s) { whole(s, KR_HEAD_##digits, KR_LAST_##digits); }    \
    static void sum_##digits(const kr_series *s, const double *to, double *x, double *w)           \
    {                                                                                              \
        sum_series(s, KR_HEAD_##digits + 1, KR_LAST_##digits, to, x, w);                           \
    }
TAIL(20)
TAIL(30)
const kr_tail KR_NAME(kr_tail)[KR_DEPTHS] = {{expand_20, sum_20}, {expand_30, sum_30}};

/* Adds the product of two series to c, even and odd terms of a in two chains of fma side by side.
 * It is the `product` of a kr_piece. */
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
