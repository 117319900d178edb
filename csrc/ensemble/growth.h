/* One tangent a top, in lanes: how it grows beside the path, which it leaves as it is. It is
 * source,
 * compiled once per instruction set; the equations are those of taylor/tangents.h, without damping
 * and parameters. Two of their solutions are known, and taken out wherever a step ends: the flow
 * (W | P x c) and the turn about the vertical (P | P x AW). What is left is the growth. What it
 * conserves, as far as the tolerance keeps it:
 *     dE = <N, W> + <theta, W x AW + c x P>       d<m, e3> = <N, P>
 * MEGNO is that of Cincotta and Simo (2000), of which the mean over the time T is, by parts,
 *     2/T int ln|delta| (1 + ln(t/T)) dt. */
#include "heading.h"

/* How far above the tolerance, in powers of two, a deviation's last term may lie over its size; and
 * how many parts a step has at most. */
#define GROWTH_SLACK 9.0
enum { GROWTH_PARTS = 64 };

typedef struct {
    triple turn, push;
} deviation;
INLINE deviation deviation_load(kr_lane_vector *const v)
{
    const deviation d = {triple_load(v[0]), triple_load(v[1])};
    return d;
}
INLINE void deviation_store(kr_lane_vector *to, deviation d)
{
    triple_store(to[0], d.turn);
    triple_store(to[1], d.push);
}
INLINE triple triple_cross(triple a, triple b)
{
    const triple r = {wide_fma(a.y, b.z, -(a.z * b.y)), wide_fma(a.z, b.x, -(a.x * b.z)),
                      wide_fma(a.x, b.y, -(a.y * b.x))};
    return r;
}
INLINE triple triple_times(triple a, triple b)
{
    const triple r = {a.x * b.x, a.y * b.y, a.z * b.z};
    return r;
}
/* s a + b */
INLINE triple triple_axpy(wide s, triple a, triple b)
{
    const triple r = {wide_fma(s, a.x, b.x), wide_fma(s, a.y, b.y), wide_fma(s, a.z, b.z)};
    return r;
}
INLINE deviation deviation_axpy(wide s, deviation a, deviation b)
{
    const deviation r = {triple_axpy(s, a.turn, b.turn), triple_axpy(s, a.push, b.push)};
    return r;
}
INLINE wide deviation_dot(deviation a, deviation b)
{
    return triple_dot(a.turn, b.turn) + triple_dot(a.push, b.push);
}
INLINE triple none(void)
{
    const wide zero = wide_splat(0.0);
    const triple r = {zero, zero, zero};
    return r;
}

/* The natural logarithm, of what is positive and normal, to rounding. */
INLINE wide wide_log(wide x)
{
    const whole one = wide_bits(wide_splat(1.0)), root = wide_bits(wide_splat(0.70710678118654752));
    const whole bits = wide_bits(x) + (one - root);
    const wide m = wide_of_bits((bits & 0x000fffffffffffffu) + root);
    const wide power = wide_of_bits((bits >> 52) | 0x4330000000000000u) - (0x1p52 + 1023.0);
    const wide z = (m - 1.0) / (m + 1.0), y = z * z;
    wide sum = wide_splat(1.0 / 21.0);
    for (int n = 19; n > 1; n -= 2) sum = wide_fma(y, sum, wide_splat(1.0 / n));
    sum = wide_fma(2.0 * z * y, sum, 2.0 * z);
    return wide_fma(power, wide_splat(0.69314718055994531), sum);
}

/* Sums of products of coefficients over j + m = n. */
typedef struct {
    triple plus, minus; /* next(theta) * prev(W), prev(theta) * next(W) */
    triple push;        /* N x W */
    triple lifted;      /* theta <c, P> */
    triple leaned;      /* theta * P */
} growth_sums;
INLINE void add_growth(growth_sums *a, kr_lanes *l, kr_lane_tangents *g, int j, int m)
{
    const triple turn = triple_load(g->x[j][0]), push = triple_load(g->x[j][1]),
                 w = triple_load(l->w[m]), p = triple_load(l->p[m]);
    a->plus.x = wide_fma(turn.y, w.z, a->plus.x);
    a->plus.y = wide_fma(turn.z, w.x, a->plus.y);
    a->plus.z = wide_fma(turn.x, w.y, a->plus.z);
    a->minus.x = wide_fma(turn.z, w.y, a->minus.x);
    a->minus.y = wide_fma(turn.x, w.z, a->minus.y);
    a->minus.z = wide_fma(turn.y, w.x, a->minus.z);
    a->push.x = wide_fma(push.y, w.z, wide_fma(-push.z, w.y, a->push.x));
    a->push.y = wide_fma(push.z, w.x, wide_fma(-push.x, w.z, a->push.y));
    a->push.z = wide_fma(push.x, w.y, wide_fma(-push.y, w.x, a->push.z));
    a->lifted = triple_axpy(wide_load(g->lift[m]), turn, a->lifted);
    a->leaned.x = wide_fma(turn.x, p.x, a->leaned.x);
    a->leaned.y = wide_fma(turn.y, p.y, a->leaned.y);
    a->leaned.z = wide_fma(turn.z, p.z, a->leaned.z);
}
/* Sets the coefficients n + 1. */
INLINE void next_growth(kr_lanes *l, kr_lane_tangents *g, int n)
{
    const wide share = wide_splat(1.0 / (n + 1));
    growth_sums a = {none(), none(), none(), none(), none()};
    wide_store(g->lift[n], triple_dot(triple_load(g->c), triple_load(l->p[n])));
    for (int j = 0; j <= n; j++) add_growth(&a, l, g, j, n - j);
    const wide lean = a.leaned.x + a.leaned.y + a.leaned.z;
    const triple ahead = triple_times(triple_load(g->ahead), a.plus),
                 behind = triple_times(triple_load(g->behind), a.minus),
                 own = triple_times(triple_load(g->per), triple_load(g->x[n][1]));
    const triple push = triple_axpy(-lean, triple_load(g->c), a.push);
    const deviation next = {{share * (ahead.x + (behind.x + own.x)),
                             share * (ahead.y + (behind.y + own.y)),
                             share * (ahead.z + (behind.z + own.z))},
                            {share * (push.x + a.lifted.x), share * (push.y + a.lifted.y),
                             share * (push.z + a.lifted.z)}};
    deviation_store(g->x[n + 1], next);
}
INLINE deviation sum_growth(kr_lane_tangents *g, int order, wide h)
{
    deviation d = deviation_load(g->x[order]);
    for (int n = order - 1; n >= 0; n--) d = deviation_axpy(h, d, deviation_load(g->x[n]));
    return d;
}

/* Takes what is along a known solution out of a deviation. Returns how much that was. */
INLINE deviation without(deviation d, deviation known)
{
    const wide size = deviation_dot(known, known), zero = wide_splat(0.0);
    const wide share = wide_choose(wide_less(zero, size), deviation_dot(d, known) / size, zero);
    return deviation_axpy(-share, known, d);
}
/* Takes the flow and the turn about the vertical out of a deviation, at a point of the path. Where
 * these two are one, to roundings, the second is left. */
INLINE deviation purified(kr_lane_tangents *g, const point *at, deviation d)
{
    const triple momentum = triple_times(triple_load(g->moments), at->w);
    const deviation flow = {at->w, triple_cross(at->p, triple_load(g->c))},
                    turn = {at->p, triple_cross(at->p, momentum)}, own = without(turn, flow),
                    nothing = {none(), none()};
    const mask is_own = wide_less(0x1p-60 * deviation_dot(turn, turn), deviation_dot(own, own));
    const wide keep = wide_choose(is_own, wide_splat(1.0), wide_splat(0.0));
    return without(without(d, flow), deviation_axpy(keep, own, nothing));
}
INLINE wide log_of_size(kr_lane_tangents *g, deviation d)
{
    return wide_fma(wide_load(g->begin.power), wide_splat(0.69314718055994531),
                    0.5 * wide_log(deviation_dot(d, d)));
}
/* How far the two conserved forms of a deviation are from what they were at the start, over its
 * size and theirs. */
INLINE void weigh_forms(kr_lane_tangents *g, const point *at, deviation d)
{
    const triple momentum = triple_times(triple_load(g->moments), at->w),
                 pull = triple_cross(triple_load(g->c), at->p),
                 lean = triple_axpy(wide_splat(1.0), pull, triple_cross(at->w, momentum));
    const wide size = deviation_dot(d, d), down = wide_load(g->begin.scale),
               energy = triple_dot(d.push, at->w) + triple_dot(d.turn, lean),
               vertical = triple_dot(d.push, at->p);
    const wide weight = triple_dot(at->w, at->w) + triple_dot(lean, lean), zero = wide_splat(0.0);
    wide_store(
        g->out[KR_GROWTH_ENERGY],
        wide_choose(wide_less(zero, weight),
                    wide_abs(energy - down * wide_load(g->energy)) / wide_sqrt(weight * size),
                    zero));
    wide_store(g->out[KR_GROWTH_MOMENTUM], wide_abs(vertical - down * wide_load(g->vertical)) /
                                               wide_sqrt(size * triple_dot(at->p, at->p)));
}

/* What a part of a step adds: the integrals of ln|delta| and of it times ln t, and the largest. */
typedef struct {
    wide area, moment, most;
} growth_areas;
/* Adds the part of the path from l->t over h, by Gauss' five points: the logarithm turns sharply
 * where the deviation is short, and three of them err by 1e-3 of MEGNO at t = 10. */
INLINE growth_areas add_part(kr_lanes *l, kr_lane_tangents *g, wide h, growth_areas a)
{
    static const double places[] = {0.04691007703066802, 0.23076534494715845, 0.5,
                                    0.76923465505284155, 0.95308992296933193},
                        weights[] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444,
                                     0.23931433524968324, 0.11846344252809454};
    const wide forward = wide_load(l->forward), t = wide_load(l->t), tiny = wide_splat(0x1p-1000);
    for (int i = 0; i < 5; i++) {
        const wide span = places[i] * h, at = t + span;
        const point here = sum_series(l, at, 1);
        const wide size = log_of_size(g, purified(g, &here, sum_growth(g, l->order, span)));
        const wide share = weights[i] * (forward * h) * size;
        a.area = a.area + share;
        a.moment = wide_fma(share, wide_log(wide_max(forward * at, tiny)), a.moment);
        a.most = wide_max(a.most, size);
    }
    return a;
}

/* The share of h at whose end the last terms of a deviation, which is `all` after h, are small
 * enough. */
INLINE wide share_allowed(kr_lane_tangents *g, int order, wide h, deviation all, double log2_most)
{
    const wide one = wide_splat(1.0), zero = wide_splat(0.0);
    wide power = wide_splat(1.0);
    for (int n = 0; n < order; n++) power = power * h;
    const deviation last = deviation_load(g->x[order]);
    const wide size = deviation_dot(all, all), rest = power * power * deviation_dot(last, last);
    const wide most = wide_splat(exp2(2.0 * log2_most)) * size;
    const mask is_small = mask_or(wide_at_most(rest, most), wide_equal(size, zero));
    const wide share =
        0.9 * rough_exp2((rough_log2(most) - rough_log2(wide_max(rest, wide_splat(0x1p-1000)))) *
                         (0.5 / order));
    return wide_choose(is_small, one, wide_min(wide_max(share, wide_splat(0.01)), one));
}
INLINE void expand_growth(kr_lanes *l, kr_lane_tangents *g, deviation start)
{
    deviation_store(g->x[0], start);
    for (int n = 0; n < l->order; n++) next_growth(l, g, n);
}
/* Expands the path anew about a time inside the piece, where it is not at its goal yet. */
APART void begin_part(kr_lanes *l, kr_lane_tangents *g, const double *at)
{
    kr_lanes *part = &g->part;
    const wide time = wide_load(at);
    const point here = sum_series(l, time, 1);
    part->order = l->order;
    memcpy(part->k, l->k, sizeof l->k);
    memcpy(part->up, l->up, sizeof l->up);
    memcpy(part->down, l->down, sizeof l->down);
    memcpy(part->forward, l->forward, sizeof l->forward);
    wide_store(part->t, time);
    triple_store(part->p[0], here.p);
    triple_store(part->w[0], here.w);
    expand(part, 1);
}
/* Takes the deviation from where the piece begins to a time inside it, in parts where its series
 * asks for shorter ones than the path's. A lane that has arrived stays where it is, to the bit. */
INLINE deviation carry(kr_lanes *l, kr_lane_tangents *g, wide to, growth_areas *areas)
{
    kr_lanes *path = l;
    deviation d = deviation_load(g->begin.d);
    for (int parts = 0;; parts++) {
        const wide t = wide_load(path->t), left = to - t;
        expand_growth(path, g, d);
        const deviation all = sum_growth(g, l->order, left);
        const wide share = share_allowed(g, l->order, left, all, l->log2_tol + GROWTH_SLACK);
        const mask whole_way = wide_equal(share, wide_splat(1.0));
        const wide h = share * left;
        *areas = add_part(path, g, h, *areas);
        if (mask_all(whole_way)) return all;
        d = sum_growth(g, l->order, h);
        if (parts == GROWTH_PARTS) return d;
        kr_lane_number at;
        wide_store(at, wide_choose(whole_way, to, t + h));
        begin_part(l, g, at);
        path = &g->part;
    }
}
INLINE growth_areas areas_of(kr_lane_tangents *g)
{
    const growth_areas a = {wide_load(g->begin.area), wide_load(g->begin.moment),
                            wide_load(g->begin.most)};
    return a;
}
/* Takes the deviation over the step that has just been made: without what is known, and by a power
 * of two about as large as it was. */
INLINE void follow(kr_lanes *l, kr_lane_tangents *g)
{
    const point at = {triple_load(l->end_p), triple_load(l->end_w), wide_splat(0.0)};
    memcpy(&g->begin, &g->end, sizeof g->end);
    growth_areas areas = areas_of(g);
    const deviation d = purified(g, &at, carry(l, g, wide_load(l->end), &areas)),
                    nothing = {none(), none()};
    wide_store(g->end.area, areas.area);
    wide_store(g->end.moment, areas.moment);
    wide_store(g->end.most, wide_max(areas.most, log_of_size(g, d)));
    const wide moved = 0x1.8p52 - 0.5 * rough_log2(deviation_dot(d, d)),
               power = wide_of_bits((wide_bits(moved) + 1023) << 52);
    deviation_store(g->end.d, deviation_axpy(power, d, nothing));
    wide_store(g->end.power, wide_load(g->begin.power) - (moved - 0x1.8p52));
    wide_store(g->end.scale, wide_load(g->begin.scale) * power);
}
/* Tells of the growth at the times `at`, which lie inside the pieces. */
INLINE void tell_growth(kr_lanes *l, kr_lane_tangents *g)
{
    const wide at = wide_load(l->at), tiny = wide_splat(0x1p-1000);
    const wide t = wide_max(wide_load(l->forward) * at, tiny);
    const point here = sum_series(l, at, 1);
    growth_areas areas = areas_of(g);
    const deviation d = purified(g, &here, carry(l, g, at, &areas));
    const wide size = log_of_size(g, d);
    wide_store(g->out[KR_GROWTH_LOG], size);
    wide_store(g->out[KR_GROWTH_MEGNO],
               2.0 * wide_fma(areas.area, 1.0 - wide_log(t), areas.moment) / t);
    wide_store(g->out[KR_GROWTH_MOST], wide_max(areas.most, size));
    weigh_forms(g, &here, d);
}
/* Begins with a deviation of unit length in every lane that has none yet. */
INLINE void begin_growth(kr_lanes *l, kr_lane_tangents *g)
{
    const point at = {triple_load(l->end_p), triple_load(l->end_w), wide_splat(0.0)};
    const deviation d = purified(g, &at, deviation_load(g->end.d)), nothing = {none(), none()};
    const wide size = wide_sqrt(deviation_dot(d, d));
    const deviation one = deviation_axpy(1.0 / size, d, nothing);
    const triple momentum = triple_times(triple_load(g->moments), at.w),
                 pull = triple_cross(triple_load(g->c), at.p),
                 lean = triple_axpy(wide_splat(1.0), pull, triple_cross(at.w, momentum));
    deviation_store(g->first, one);
    wide_store(g->first_energy, triple_dot(one.push, at.w) + triple_dot(one.turn, lean));
    wide_store(g->first_vertical, triple_dot(one.push, at.p));
    wide_store(g->first_size, size);
}
