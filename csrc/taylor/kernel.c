/* The series in doubles. Compiled once per instruction set: -DKR_SET=avx2 -mavx2 -mfma, and so on
 * (CMakeLists.txt); without any of that, the set that runs everywhere. Equal bits from gcc and
 * clang, and on every set with fma. */
#include "lanes.h"
#include "series.h"

PER_ORDER void whole(kr_series *s, int from, int order) { expand(s, from, order, WHOLE); }
PER_ORDER void headless(kr_series *s, int from, int order) { expand(s, from, order, HEADLESS); }
PER_ORDER void look(kr_series *s, int order) { sum_series(s, 0, order, &s->at, s->at_x, s->at_w); }
PER_ORDER void go(kr_series *s, int order, double log2_tol, double direction)
{
    s->end = s->t + direction * step_size(s, order, log2_tol);
    sum_series(s, 0, order, &s->end, s->end_x, s->end_w);
}
#define STEP(form, n)                                                                              \
    static void form##_##n(kr_series *s, double log2_tol, double direction)                        \
    {                                                                                              \
        begin_at_end(s);                                                                           \
        form(s, 0, n);                                                                             \
        go(s, n, log2_tol, direction);                                                             \
    }
#define ORDER(n)                                                                                   \
    STEP(whole, n) STEP(headless, n) static void look_##n(kr_series *s) { look(s, n); }
ORDER(12)
ORDER(16)
ORDER(18)
ORDER(22)
ORDER(28)
#define EACH(kind)                                                                                 \
    {12, kind##_12, look_12}, {16, kind##_16, look_16}, {18, kind##_18, look_18},                  \
        {22, kind##_22, look_22},                                                                  \
    {                                                                                              \
        28, kind##_28, look_28                                                                     \
    }
const kr_kernel KR_NAME(kr_kernel)[KR_ORDERS] = {EACH(whole)};
const kr_kernel KR_NAME(kr_headless)[KR_ORDERS] = {EACH(headless)};

/* What follows a head of double-doubles (kernel_dd.c). */
#define TAIL(digits)                                                                               \
    static void expand_##digits(kr_series *s) { whole(s, KR_HEAD_##digits, KR_LAST_##digits); }    \
    static void sum_##digits(const kr_series *s, const double *to, double *x, double *w)           \
    {                                                                                              \
        sum_series(s, KR_HEAD_##digits + 1, KR_LAST_##digits, to, x, w);                           \
    }
TAIL(20)
TAIL(30)
const kr_tail KR_NAME(kr_tail)[KR_DEPTHS] = {{expand_20, sum_20}, {expand_30, sum_30}};

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
