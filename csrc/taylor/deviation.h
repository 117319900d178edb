/* The recurrence of tangents.h: coefficients and sum. It is source, compiled once per instruction
 * set and twice in each, as series.h is: in doubles after lanes.h, in double-doubles after
 * lanes_dd.h. A cross product of two series is one sum of products of both, turned either way. The
 * newest coefficient, for which everything waits, comes last in each sum. */
#include "tangents.h"

enum {
    AT_ONCE = 3, /* deviations side by side, for each alone would wait for itself */
    BLOCK = 4    /* terms of a sum between two questions whether it ends */
};

/* Coefficients of the path turned as (prev | next), behind a block of zeros, and those of a
 * deviation as (next | prev), before one: theta, N, and c x theta. */
typedef struct {
    duo w[KR_TAYLOR_MAX + BLOCK], p[KR_TAYLOR_MAX + BLOCK];
} turned_path;
typedef struct {
    duo turn[KR_TAYLOR_MAX + BLOCK], push[KR_TAYLOR_MAX + BLOCK], cross[KR_TAYLOR_MAX + BLOCK];
} turned_deviation;

INLINE quad less(quad a, quad b) { return quad_fma(quad_splat(-1.0), b, a); }
/* Stores the coefficients n of theta and N, plain and turned. */
INLINE void set_deviation(kr_tangent *g, turned_deviation *d, int n, quad turn, quad push)
{
    quad_store(g->x[n], turn);
    quad_store(g->x[n] + 4, push);
    d->turn[n] = duo_next_prev(turn);
    d->push[n] = duo_next_prev(push);
    d->cross[n] = duo_next_prev(
        quad_fma(quad_load(g->up), quad_prev(turn), quad_mul(quad_load(g->down), quad_next(turn))));
}
/* Returns the number n of B W. */
INLINE quad moments_times(const kr_series *s, const kr_tangent *g, int n)
{
    const quad w = quad_load(s->w[n]), own = quad_mul(quad_load(g->moments[0]), w);
    return quad_fma(quad_load(g->moments[2]), quad_prev(w),
                    quad_fma(quad_load(g->moments[1]), quad_next(w), own));
}
/* Returns the number n of P x b. */
INLINE quad pull(const kr_series *s, const kr_tangent *g, int n)
{
    const quad p = quad_load(s->x[n] + 4), b = quad_load(g->lever);
    return less(quad_mul(quad_next(p), quad_prev(b)), quad_mul(quad_prev(p), quad_next(b)));
}
/* Returns what damping takes from N', where theta' and the two halves of theta x W are known. */
INLINE quad damping(const kr_tangent *g, quad rate, quad plus, quad minus)
{
    const quad drag = quad_load(g->drag), change = less(rate, less(plus, minus));
    const quad turned = less(quad_mul(quad_prev(drag), plus), quad_mul(quad_next(drag), minus));
    return quad_fma(drag, change, turned);
}
/* Sums of products of coefficients over j + m = n, of a deviation's number j and the path's m. */
typedef struct {
    duo turn, push, cross;
} deviation_sums;
INLINE void add_products(deviation_sums *a, const turned_path *path, const turned_deviation *d,
                         int j, int m)
{
    a->turn = duo_fma(d->turn[j], path->w[BLOCK + m], a->turn);
    a->push = duo_fma(d->push[j], path->w[BLOCK + m], a->push);
    a->cross = duo_fma(d->cross[j], path->p[BLOCK + m], a->cross);
}
/* Sets the coefficients n + 1, from the two halves of the sums. */
INLINE void next_deviation(const kr_series *s, kr_tangent *g, turned_deviation *d, int n,
                           const deviation_sums *a, const deviation_sums *b)
{
    const quad share = quad_inverse(n + 1);
    const duo turned = duo_add(a->turn, b->turn),
              pushed = duo_add(duo_add(a->push, a->cross), duo_add(b->push, b->cross));
    const quad plus = quad_mul(share, duo_lo(turned)), minus = quad_mul(share, duo_hi(turned));
    quad own = quad_load(g->x[n] + 4), force = less(duo_lo(pushed), duo_hi(pushed));
    if (g->changes != 0.0) {
        own = less(own, moments_times(s, g, n));
        force = quad_add(force, pull(s, g, n));
    }
    own = quad_mul(quad_mul(share, quad_load(g->per)), own);
    const quad rate =
        quad_fma(quad_load(g->ahead), plus, quad_fma(quad_load(g->behind), minus, own));
    force = quad_mul(share, force);
    if (g->damped != 0.0) force = less(force, damping(g, rate, plus, minus));
    set_deviation(g, d, n + 1, rate, force);
}
/* Sets the coefficients n + 1 of so many deviations. Terms with odd and even numbers are summed
 * apart. */
INLINE void next_few(const kr_series *s, const turned_path *path, kr_tangent *g, int words,
                     turned_deviation *d, int few, int n)
{
    const duo zero = duo_splat(0.0);
    const deviation_sums none = {zero, zero, zero};
    deviation_sums a[AT_ONCE], b[AT_ONCE];
    for (int k = 0; k < few; k++) a[k] = b[k] = none;
    for (int first = 0; first <= n; first += BLOCK) {
        UNROLL
        for (int j = first; j < first + BLOCK; j += 2) {
            UNROLL
            for (int k = 0; k < few; k++) {
                add_products(&a[k], path, &d[k], j, n - j);
                add_products(&b[k], path, &d[k], j + 1, n - j - 1);
            }
        }
    }
    UNROLL
    for (int k = 0; k < few; k++) next_deviation(s, g + k * words, &d[k], n, &a[k], &b[k]);
}
INLINE void expand_few(const kr_series *s, const turned_path *path, kr_tangent *g, int words,
                       int few, int order)
{
    turned_deviation d[AT_ONCE];
    for (int k = 0; k < few; k++) {
        kr_tangent *own = g + k * words;
        for (int n = 1; n < order + BLOCK - 1; n++)
            d[k].turn[n] = d[k].push[n] = d[k].cross[n] = duo_splat(0.0);
        set_deviation(own, &d[k], 0, quad_load(own->x[0]), quad_load(own->x[0] + 4));
    }
    for (int n = 0; n < order; n++) next_few(s, path, g, words, d, few, n);
}
/* Computes all coefficients of so many deviations, from number 0 on, which is set. */
INLINE void expand_deviations(const kr_series *s, kr_tangent *g, int words, size_t many, int order)
{
    turned_path path;
    for (int n = 0; n < BLOCK; n++) path.w[n] = path.p[n] = duo_splat(0.0);
    for (int n = 0; n < order; n++) {
        path.w[BLOCK + n] = duo_prev_next(quad_load(s->w[n]));
        path.p[BLOCK + n] = duo_prev_next(quad_load(s->x[n] + 4));
    }
    for (; many >= AT_ONCE; many -= AT_ONCE, g += AT_ONCE * words)
        expand_few(s, &path, g, words, AT_ONCE, order);
    for (; many > 0; many--, g += words) expand_few(s, &path, g, words, 1, order);
}
/* Sums a series at a time. */
INLINE void sum_deviation(const kr_tangent *g, int order, const double *to, double *sum)
{
    const duo h = duo_span(&g->t, to);
    duo x = duo_load(g->x[order]);
    for (int n = order - 1; n >= 0; n--) x = duo_fma(h, x, duo_load(g->x[n]));
    duo_store(sum, x);
}
