/* Evaluates the closed form of one Lagrange top or free body (kr_exact_form, exact.h) at many
 * times. The compiler vectorizes the loops over a block of times. This file is compiled once for
 * each instruction set, with flags such as -DKR_ISA=avx2 -mavx2 -mfma. */
#include "kernel.h"

#if defined __SSE2__
#  include <emmintrin.h>
#endif

/* The times t, attitudes (w, x, y, z) and momenta (mx, my, mz) of one top for a block of BATCH
 * times, with one array for each component. A block of states fits into the first-level cache. */
enum { BATCH = 64 };
typedef struct batch {
    double t[BATCH], w[BATCH], x[BATCH], y[BATCH], z[BATCH], mx[BATCH], my[BATCH], mz[BATCH];
} batch;

INLINE void compute_block_of_kind(const kr_exact_form *e, int dual, int euler, batch *b, int n)
{
    for (int i = 0; i < n; i++) {
        const kr_state s = evaluate_state(e, dual, euler, b->t[i], two_sum(b->t[i], -e->begin));
        b->w[i] = s.q.w, b->x[i] = s.q.x, b->y[i] = s.q.y, b->z[i] = s.q.z;
        b->mx[i] = s.m.x, b->my[i] = s.m.y, b->mz[i] = s.m.z;
    }
}
INLINE void apply_frame_to_block(const kr_exact_form *e, batch *b, int n)
{
    for (int i = 0; i < n; i++) {
        const kr_quat r =
            apply_quaternion_map(e->frame, q4(b->w[i], v3(b->x[i], b->y[i], b->z[i])));
        b->w[i] = r.w, b->x[i] = r.x, b->y[i] = r.y, b->z[i] = r.z;
    }
}
/* Returns 1 if the n states `out` should be written with stores that bypass the cache. Such stores
 * are faster for large arrays, because ordinary stores first read each cache line. */
static int bypasses_cache(size_t n, const kr_state out[])
{
#if defined __SSE2__
    return n >= 1 << 14 && (uintptr_t)out % 16 == 0;
#else
    return (void)n, (void)out, 0;
#endif
}
INLINE void store_block(const batch *restrict b, int n, int bypasses, kr_state *restrict out)
{
    (void)bypasses; /* without SSE2 */
    for (int i = 0; i < n; i++) {
#if defined __SSE2__
        double *to = (double *)&out[i];
        if (bypasses) {
            _mm_stream_pd(to, _mm_set_pd(b->w[i], b->t[i]));
            _mm_stream_pd(to + 2, _mm_set_pd(b->y[i], b->x[i]));
            _mm_stream_pd(to + 4, _mm_set_pd(b->mx[i], b->z[i]));
            _mm_stream_pd(to + 6, _mm_set_pd(b->mz[i], b->my[i]));
            continue;
        }
#endif
        out[i].t = b->t[i];
        out[i].q.w = b->w[i], out[i].q.x = b->x[i], out[i].q.y = b->y[i], out[i].q.z = b->z[i];
        out[i].m.x = b->mx[i], out[i].m.y = b->my[i], out[i].m.z = b->mz[i];
    }
}
/* Writes the states of one top at the first `count` times b->t to the other arrays of `b`. The
 * number of computed states is rounded up to a multiple of eight, to avoid a remainder loop. */
static void compute_block(const kr_exact_form *exact, batch *b, int count)
{
    /* The compiler can keep a local copy in registers: no store through a pointer changes it. */
    const kr_exact_form e = *exact;
    const int n = (count + 7) & ~7;
    if (e.curve == LAGRANGE)
        compute_block_of_kind(&e, 0, 0, b, n);
    else if (e.curve == EULER)
        compute_block_of_kind(&e, 0, 1, b, n);
    else if (e.curve == LAGRANGE_DUAL)
        compute_block_of_kind(&e, 1, 0, b, n);
    else
        compute_block_of_kind(&e, 1, 1, b, n);
    if (e.framed != 0.0) apply_frame_to_block(&e, b, n);
}
/* Returns 1 if all n times are finite and closer to the initial time than `longest`, and no phase
 * changes by 2^49 turns or more (half the limit of is_span_computable in kernel.h, for safety). */
static int are_times_computable(const kr_exact_form *e, const double t[], int n)
{
    const double most =
                     fmax(fabs(e->nutation.fast), fmax(fabs(e->first.fast), fabs(e->second.fast))),
                 reach = fmin(longest, 0x1p49 / most), begin = e->begin;
    int late = 0;
    for (int i = 0; i < n; i++) late |= !(fabs(t[i] - begin) < reach);
    return !late;
}
void KR_NAME(kr_exact_evaluate)(const void *plan, size_t n, const double t[], kr_state out[])
{
    const kr_exact_form *e = plan;
    const int bypasses = bypasses_cache(n, out);
    batch b = {.t = {0.0}};
    for (size_t from = 0; from < n; from += BATCH) {
        const int count = n - from < BATCH ? (int)(n - from) : BATCH;
        if (!are_times_computable(e, t + from, count)) {
            for (size_t i = from; i < from + (size_t)count; i++) out[i] = state_at(e, t[i]);
            continue;
        }
        memcpy(b.t, t + from, (size_t)count * sizeof b.t[0]);
        compute_block(e, &b, count);
        if (bypasses)
            store_block(&b, count, 1, out + from);
        else
            store_block(&b, count, 0, out + from);
    }
#if defined __SSE2__
    if (bypasses) _mm_sfence();
#endif
}
