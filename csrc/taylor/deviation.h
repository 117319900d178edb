/* Implements the Taylor series declared in tangents.h: computes the coefficients and evaluates the
 * series. This source file is compiled for single tangents (deviation_single.h) and for batches of
 * eight (deviation_batch.h), each in double and in double-double precision. In the comments, a
 * tangent `g` is a single tangent or a batch, and the path is the motion of the top. Both headers
 * define four types. A `triple` holds the three components of a vector of a tangent. A `path_term`
 * gives a Taylor coefficient of W or P of the path. A `turned` is a `triple` prepared for a product
 * with a `path_term`. A `halves` holds two sums over pairs of a `turned` a and a `path_term` b: of
 * next(a) * prev(b), and of prev(a) * next(b) (taylor.h). The first sum minus the second is the sum
 * of a x b. Constants (AT_ONCE, BLOCK, BEFORE, CHAINS, STRUCTS): see deviation_single.h. */
#include "tangents.h"

/* Taylor coefficients, prepared for products. w[BEFORE + n] and p[BEFORE + n] are W_n and P_n of
 * the path (taylor.h), and 0 for n < 0, because the last block of BLOCK terms of a sum can reach
 * n < 0. turn[n], push[n], cross[n]: n-th coefficients of theta, N (tangents.h) and c x theta. */
typedef struct {
    path_term w[KR_TAYLOR_MAX + BEFORE], p[KR_TAYLOR_MAX + BEFORE];
} turned_path;
typedef struct {
    turned turn[KR_TAYLOR_MAX + BLOCK], push[KR_TAYLOR_MAX + BLOCK], cross[KR_TAYLOR_MAX + BLOCK];
} turned_deviation;

/* Stores the n-th Taylor coefficients of theta (`turn`) and N (`push`) in g, and, prepared for
 * products, the n-th coefficients of theta, N and c x theta in d. */
INLINE void store_coefficients(kr_tangent *g, turned_deviation *d, int n, triple turn, triple push)
{
    const triple up = load_common(g->up), down = load_common(g->down);
    store_rotation(g, n, turn);
    store_momentum(g, n, push);
    d->turn[n] = make_turned(turn);
    d->push[n] = make_turned(push);
    d->cross[n] = make_turned(triple_fma(up, triple_zxy(turn), triple_mul(down, triple_yzx(turn))));
}
INLINE triple triple_cross(triple a, triple b)
{
    return triple_sub(triple_mul(triple_yzx(a), triple_zxy(b)),
                      triple_mul(triple_zxy(a), triple_yzx(b)));
}
/* Returns 1 / (n + 1) times the n-th coefficient of D (theta' - theta x W) + theta x (D W), which
 * is subtracted in N' (tangents.h). The arguments are 1 / (n + 1) times the n-th coefficients of
 * theta' (`rate`), next(theta) * prev(W) (`plus`), and prev(theta) * next(W) (`minus`). */
INLINE triple damping_torque_change(const kr_tangent *g, triple rate, triple plus, triple minus)
{
    const triple drag = load_common(g->drag), change = triple_sub(rate, triple_sub(plus, minus));
    const triple turned_by =
        triple_sub(triple_mul(triple_zxy(drag), plus), triple_mul(triple_yzx(drag), minus));
    return triple_fma(drag, change, turned_by);
}
/* Cauchy products: sums over j + m = n of theta_j x W_m, N_j x W_m and (c x theta_j) x P_m. */
typedef struct {
    halves turn, push, cross;
} deviation_sums;
INLINE void add_products(deviation_sums *a, const turned_path *path, const turned_deviation *d,
                         int j, int m)
{
    a->turn = halves_fma(d->turn[j], path->w[BEFORE + m], a->turn);
    a->push = halves_fma(d->push[j], path->w[BEFORE + m], a->push);
    a->cross = halves_fma(d->cross[j], path->p[BEFORE + m], a->cross);
}
/* Computes the Taylor coefficients of order n + 1 of the tangent g, and stores them in g and d. `a`
 * and `b` contain the terms of the sums over j (deviation_sums) with even j and with odd j. */
INLINE void set_next_deviation(const kr_series *s, kr_tangent *g, turned_deviation *d, int n,
                               const deviation_sums *a, const deviation_sums *b)
{
    const triple share = triple_splat_reciprocal(n + 1);
    const halves crossed = halves_add(a->turn, b->turn),
                 pushed = halves_add(halves_add(a->push, a->cross), halves_add(b->push, b->cross));
    const triple plus = triple_mul(share, halves_first(crossed)),
                 minus = triple_mul(share, halves_second(crossed));
    triple own = load_momentum(g, n),
           force = triple_sub(halves_first(pushed), halves_second(pushed));
    if (g->changes != 0.0) {
        own = triple_sub(own, triple_mul(load_triple(g->moments), load_common(s->w[n])));
        force = triple_add(force, triple_cross(load_common(s->x[n] + 4), load_triple(g->lever)));
    }
    if (g->gyrostat != 0.0)
        own = triple_add(own, triple_cross(load_common(g->rotor), load_triple(g->x[n])));
    if (n == 0 && g->rotor_changes != 0.0) own = triple_sub(own, load_triple(g->rotor_of));
    if (g->drag_changes != 0.0)
        force = triple_sub(force, triple_mul(load_triple(g->drags), load_common(s->w[n])));
    own = triple_mul(triple_mul(share, load_common(g->per)), own);
    const triple rate =
        triple_fma(load_common(g->ahead), plus, triple_fma(load_common(g->behind), minus, own));
    force = triple_mul(share, force);
    if (g->damped != 0.0) force = triple_sub(force, damping_torque_change(g, rate, plus, minus));
    store_coefficients(g, d, n + 1, rate, force);
}
/* For each tangent k < count, adds to a[k] the products (deviation_sums) of the j-th coefficients
 * of the tangent and the (n - j)-th of the path, for those j from `first` to n for which
 * j - first is even. If CHAINS is 2, adds the products with odd j - first to b[k]. */
INLINE void add_alternate_products(deviation_sums *a, deviation_sums *b, const turned_path *path,
                                   const turned_deviation *d, int count, int first, int n)
{
    for (; first <= n; first += BLOCK) {
        UNROLL
        for (int j = first; j < first + BLOCK; j += 2) {
            UNROLL
            for (int k = 0; k < count; k++) {
                add_products(&a[k], path, &d[k], j, n - j);
                if (CHAINS > 1) add_products(&b[k], path, &d[k], j + 1, n - j - 1);
            }
        }
    }
}
/* Computes the Taylor coefficients of order n + 1 of `count` tangents, of which g is the first. */
INLINE void set_next_group_coefficients(const kr_series *s, const turned_path *path, kr_tangent *g,
                                        turned_deviation *d, int count, int n)
{
    const halves zero = halves_zero();
    const deviation_sums none = {zero, zero, zero};
    deviation_sums a[AT_ONCE], b[AT_ONCE];
    for (int k = 0; k < count; k++) a[k] = b[k] = none;
    add_alternate_products(a, b, path, d, count, 0, n);
    if (CHAINS == 1) add_alternate_products(b, b, path, d, count, 1, n);
    UNROLL
    for (int k = 0; k < count; k++) set_next_deviation(s, g + k * STRUCTS, &d[k], n, &a[k], &b[k]);
}
INLINE void expand_tangents_together(const kr_series *s, const turned_path *path, kr_tangent *g,
                                     int count, int order)
{
    turned_deviation d[AT_ONCE];
    for (int k = 0; k < count; k++) {
        kr_tangent *own = g + k * STRUCTS;
        for (int n = 1; n < order + BLOCK - 1 && BLOCK > 2; n++)
            d[k].turn[n] = d[k].push[n] = d[k].cross[n] = turned_zero();
        store_coefficients(own, &d[k], 0, load_triple(own->x[0]), load_momentum(own, 0));
    }
    for (int n = 0; n < order; n++) set_next_group_coefficients(s, path, g, d, count, n);
}
/* Computes the Taylor coefficients 1 to `order` of `count` tangents, of which g is the first. Given
 * are their coefficients of order 0, and the series `s` of the path. */
INLINE void expand_deviations(const kr_series *s, kr_tangent *g, size_t count, int order)
{
    turned_path path;
    for (int n = 0; n < BEFORE; n++) path.w[n] = path.p[n] = path_zero();
    for (int n = 0; n < order; n++) {
        path.w[BEFORE + n] = make_path_term(s->w[n]);
        path.p[BEFORE + n] = make_path_term(s->x[n] + 4);
    }
    for (; count >= AT_ONCE; count -= AT_ONCE, g += AT_ONCE * STRUCTS)
        expand_tangents_together(s, &path, g, AT_ONCE, order);
    for (; count > 0; count--, g += STRUCTS) expand_tangents_together(s, &path, g, 1, order);
}
/* Writes the values of the eight Taylor series of one kr_tangent at the time `to` to `sum`. */
INLINE void evaluate_deviation(const kr_tangent *g, int order, const double *to, double *sum)
{
    const duo h = duo_span(&g->t, to);
    duo x = duo_load(g->x[order]);
    for (int n = order - 1; n >= 0; n--) x = duo_fma(h, x, duo_load(g->x[n]));
    duo_store(sum, x);
}
