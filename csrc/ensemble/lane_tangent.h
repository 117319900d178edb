/* The growth of an infinitesimal perturbation (tangent) of the top in each SIMD lane. A, c, h, P, W
 * and the tolerance are those of lane_state.h, and M = AW + h is the momentum along the body axes.
 * A tangent delta = (theta, N) is a rotation vector theta, which adds q theta/2 to the attitude q,
 * and a change N of the momentum m in space. The components of both refer to the body axes:
 *     theta' = 1/A (M x theta + N) + theta x W        N' = N x W + (c x theta) x P
 * Two solutions are trivial: the flow, (W, P x c), and an infinitesimal rotation about the
 * vertical, (P, P x M). At the end of each step, the components of the tangent along the trivial
 * solutions are removed. The program stores d = delta 2^-power, where |d| is near 1, and measures
 * the growth of |delta|, with |delta|^2 = |theta|^2 + |N|^2. delta changes the energy E by
 * dE, and the vertical momentum <m, e3> by d<m, e3>, both constant in time up to the tolerance:
 *     dE = <N, W> + <theta, W x M + c x P>            d<m, e3> = <N, P>
 * The mean of the chaos indicator MEGNO (Cincotta and Simo 2000) from 0 to t is, by integration by
 * parts, 2/t int_0^t ln|delta(s)| (1 + ln(s/t)) ds. The motion is called the path. Tangents may
 * shorten its steps, but change nothing else. This file is compiled once per instruction set. */
#include "lane_series.h"

/* The truncation error of a tangent d is estimated by the last Taylor term of d, which must be at
 * most 2^GROWTH_SLACK times the tolerance times |d|. If it is larger, the step is divided into
 * substeps. If more than GROWTH_SUBSTEPS are necessary, the step ends early. The length of a
 * substep is reduced at most GROWTH_TRIES times. */
#define GROWTH_SLACK 9.0
enum { GROWTH_SUBSTEPS = 64, GROWTH_TRIES = 32 };

/* A tangent, or a Taylor coefficient of one: theta and N. */
typedef struct {
    lane_vec turn, push;
} lane_deviation;
INLINE lane_deviation deviation_load(kr_lane_vector *const v)
{
    return (lane_deviation){lane_vec_load(v[0]), lane_vec_load(v[1])};
}
INLINE void deviation_store(kr_lane_vector *to, lane_deviation d)
{
    lane_vec_store(to[0], d.turn);
    lane_vec_store(to[1], d.push);
}
INLINE lane_deviation deviation_scale(wide s, lane_deviation d)
{
    return (lane_deviation){lane_vec_scale(s, d.turn), lane_vec_scale(s, d.push)};
}
INLINE lane_deviation deviation_axpy(wide s, lane_deviation a, lane_deviation b)
{
    return (lane_deviation){lane_vec_axpy(s, a.turn, b.turn), lane_vec_axpy(s, a.push, b.push)};
}
INLINE wide deviation_dot(lane_deviation a, lane_deviation b)
{
    return lane_vec_dot(a.turn, b.turn) + lane_vec_dot(a.push, b.push);
}

/* The n-th coefficients of products of Taylor series; * multiplies vectors componentwise. */
typedef struct {
    lane_vec plus, minus; /* (thetay Wz, ...), (thetaz Wy, ...), cyclic; with rotor terms in W_0 */
    lane_vec push;        /* N x W */
    lane_vec lifted;      /* theta <c, P> */
    lane_vec leaned;      /* theta * P */
} growth_sums;
/* Adds the products of coefficient j of the tangent and coefficient m of the path. */
INLINE void add_tangent_products(growth_sums *a, kr_lanes *l, kr_lane_tangents *g, int j, int m)
{
    const lane_vec turn = lane_vec_load(g->x[j][0]), push = lane_vec_load(g->x[j][1]),
                   minus_push = {-push.x, -push.y, -push.z}, w = lane_vec_load(l->w[m]),
                   p = lane_vec_load(l->p[m]);
    const lane_vec next = m > 0 ? lane_vec_yzx(w) : lane_vec_load(l->next),
                   prev = m > 0 ? lane_vec_zxy(w) : lane_vec_load(l->prev);
    a->plus = lane_vec_fma(lane_vec_yzx(turn), lane_vec_yzx(next), a->plus);
    a->minus = lane_vec_fma(lane_vec_zxy(turn), lane_vec_zxy(prev), a->minus);
    a->push = lane_vec_fma(lane_vec_yzx(push), lane_vec_zxy(w),
                           lane_vec_fma(lane_vec_zxy(minus_push), lane_vec_yzx(w), a->push));
    a->lifted = lane_vec_axpy(wide_load(g->lift[m]), turn, a->lifted);
    a->leaned = lane_vec_fma(turn, p, a->leaned);
}
/* Writes the Taylor coefficient of order n + 1 of the tangent to g->x. */
INLINE void next_tangent_coefficient(kr_lanes *l, kr_lane_tangents *g, int n)
{
    const wide share = wide_splat(1.0 / (n + 1));
    const lane_vec none = lane_vec_splat(0.0);
    growth_sums a = {none, none, none, none, none};
    wide_store(g->lift[n], lane_vec_dot(lane_vec_load(g->c), lane_vec_load(l->p[n])));
    for (int j = 0; j < n; j++) add_tangent_products(&a, l, g, j, n - j);
    add_tangent_products(&a, l, g, n, 0);
    const wide lean = a.leaned.x + a.leaned.y + a.leaned.z;
    const lane_vec ahead = lane_vec_times(lane_vec_load(g->ahead), a.plus),
                   behind = lane_vec_times(lane_vec_load(g->behind), a.minus),
                   own = lane_vec_times(lane_vec_load(g->per), lane_vec_load(g->x[n][1]));
    const lane_vec push = lane_vec_axpy(-lean, lane_vec_load(g->c), a.push);
    const lane_deviation next = {
        lane_vec_scale(share, lane_vec_add(ahead, lane_vec_add(behind, own))),
        lane_vec_scale(share, lane_vec_add(push, a.lifted))};
    deviation_store(g->x[n + 1], next);
}
INLINE lane_deviation evaluate_tangent(kr_lane_tangents *g, int order, wide h)
{
    lane_deviation d = deviation_load(g->x[order]);
    for (int n = order - 1; n >= 0; n--) d = deviation_axpy(h, d, deviation_load(g->x[n]));
    return d;
}

/* Returns the component of `d` orthogonal to `known`, or `d` if `known` is zero. */
INLINE lane_deviation remove_component(lane_deviation d, lane_deviation known)
{
    const wide size = deviation_dot(known, known), zero = wide_splat(0.0);
    const wide share = wide_choose(wide_less(zero, size), deviation_dot(d, known) / size, zero);
    return deviation_axpy(-share, known, d);
}
INLINE lane_vec find_body_momentum(kr_lane_tangents *g, const lane_point *at)
{
    return lane_vec_fma(lane_vec_load(g->moments), at->w, lane_vec_load(g->rotor));
}
/* The two trivial solutions: the flow (W, P x c), and the rotation (P, P x M). */
typedef struct {
    lane_deviation flow, turn;
} trivial_solutions;
INLINE trivial_solutions find_trivial_solutions(kr_lane_tangents *g, const lane_point *at)
{
    return (trivial_solutions){{at->w, lane_vec_cross(at->p, lane_vec_load(g->c))},
                               {at->p, lane_vec_cross(at->p, find_body_momentum(g, at))}};
}
/* Returns the component of `d` orthogonal to both trivial solutions at the point `at` of the path.
 * If these are parallel within rounding errors, removes only the component along the flow. */
INLINE lane_deviation remove_trivial_solutions(kr_lane_tangents *g, const lane_point *at,
                                               lane_deviation d)
{
    const trivial_solutions known = find_trivial_solutions(g, at);
    const lane_deviation own = remove_component(known.turn, known.flow);
    const mask is_own =
        wide_less(0x1p-60 * deviation_dot(known.turn, known.turn), deviation_dot(own, own));
    const wide keep = wide_choose(is_own, wide_splat(1.0), wide_splat(0.0));
    return remove_component(remove_component(d, known.flow), deviation_scale(keep, own));
}
/* Returns the squared norm of the component of `d` orthogonal to the two trivial solutions at the
 * point `at` of the path, but at least 2^-40 |d|^2: rounding errors could make it negative. */
INLINE wide norm2_without_trivial(kr_lane_tangents *g, const lane_point *at, lane_deviation d)
{
    const wide zero = wide_splat(0.0), one = wide_splat(1.0);
    const trivial_solutions known = find_trivial_solutions(g, at);
    const wide f = deviation_dot(known.flow, known.flow);
    const mask moves = wide_less(wide_splat(0x1p-1000), f);
    const wide per = wide_choose(moves, one, zero) / wide_choose(moves, f, one),
               slope = per * deviation_dot(known.turn, known.flow);
    const lane_deviation own = deviation_axpy(-slope, known.flow, known.turn);
    const wide all = deviation_dot(d, d), along = deviation_dot(d, known.flow),
               about = deviation_dot(d, own), u = deviation_dot(own, own),
               least = 0x1p-60 * deviation_dot(known.turn, known.turn);
    const mask is_own = wide_less(least, u);
    const wide share = wide_choose(is_own, about * about, zero) / wide_max(u, least);
    return wide_max(wide_fma(-per * along, along, all) - share, 0x1p-40 * all);
}
/* Returns ln|delta|, given log_square = ln(|d|^2), where d = delta 2^-power (g->begin.power). */
INLINE wide find_tangent_log_norm(kr_lane_tangents *g, wide log_square)
{
    return wide_fma(wide_load(g->begin.power), wide_splat(LN_2), 0.5 * log_square);
}
/* Returns the derivative W x M + c x P of the energy with respect to theta at the point `at`. */
INLINE lane_vec find_energy_gradient_in_theta(kr_lane_tangents *g, const lane_point *at)
{
    const lane_vec pull = lane_vec_cross(lane_vec_load(g->c), at->p);
    return lane_vec_add(pull, lane_vec_cross(at->w, find_body_momentum(g, at)));
}
/* Writes the errors of dE and d<m, e3> of the tangent `d` at the point `at` of the path to g->out.
 * The error of dE is its change since the initial time (0 if exact), relative to the largest |dE|
 * that a tangent of length |d| can have at this point; the error of d<m, e3> likewise. */
INLINE void write_conservation_errors(kr_lane_tangents *g, const lane_point *at, lane_deviation d)
{
    const lane_vec lean = find_energy_gradient_in_theta(g, at);
    const wide size = deviation_dot(d, d), down = wide_load(g->begin.scale),
               energy = lane_vec_dot(d.push, at->w) + lane_vec_dot(d.turn, lean),
               vertical = lane_vec_dot(d.push, at->p);
    const wide weight = lane_vec_dot(at->w, at->w) + lane_vec_dot(lean, lean),
               zero = wide_splat(0.0);
    wide_store(
        g->out[KR_GROWTH_ENERGY],
        wide_choose(wide_less(zero, weight),
                    wide_abs(energy - down * wide_load(g->energy)) / wide_sqrt(weight * size),
                    zero));
    wide_store(g->out[KR_GROWTH_MOMENTUM], wide_abs(vertical - down * wide_load(g->vertical)) /
                                               wide_sqrt(size * lane_vec_dot(at->p, at->p)));
}

/* The interior nodes of the six-point Gauss-Lobatto quadrature rule on [0, 1], and their weights.
 * The weight of the nodes 0 and 1 is END_WEIGHT. */
static const double places[] = {0.11747233803526765, 0.35738424175967745, 0.64261575824032255,
                                0.88252766196473235},
                    weights[] = {0.18923747814892349, 0.27742918851774318, 0.27742918851774318,
                                 0.18923747814892349};
#define END_WEIGHT (1.0 / 30.0)

/* Integrals of the growth of a tangent delta from the initial time t = 0: `area` = int ln|delta|
 * d|t| and `moment` = int ln|delta| ln|t| d|t|. `last` is ln|delta| at the newest time, `most` its
 * maximum so far, and `rest` the maximum so far of |highest Taylor term|^2 / |delta|^2. */
typedef struct {
    wide area, moment, most, last, rest;
} growth_integrals;
/* Returns `a` with the contribution of a quadrature node at the time t, where ln|delta| is a.last.
 * `share` is the weight of the node times the step; in lanes where it is 0, `a` is unchanged. */
INLINE growth_integrals add_integral_node(kr_lanes *l, growth_integrals a, wide share, wide t)
{
    const wide forward = wide_load(l->forward), span = share * forward, weight = span * a.last;
    a.area = a.area + weight;
    a.moment =
        wide_fma(weight, wide_approx_log(wide_max(forward * t, wide_splat(0x1p-1000))), a.moment);
    a.most = wide_choose(wide_less(wide_splat(0.0), span), wide_max(a.most, a.last), a.most);
    return a;
}
/* Raises a->rest to last / |d|^2, where `last` is the squared norm of the last Taylor term of d. */
INLINE void update_largest_truncation(growth_integrals *a, wide last, lane_deviation d)
{
    const wide size = deviation_dot(d, d), zero = wide_splat(0.0);
    const wide rest = wide_choose(wide_less(zero, last), last / size, zero);
    a->rest = wide_max(rest, a->rest);
}
/* Returns `a` with the growth over a substep of length h of the path `l`. `d` is the tangent at the
 * end of the substep, without its components along the trivial solutions. Six quadrature nodes are
 * used because ln|delta| may have a sharp minimum within the substep. */
INLINE growth_integrals add_substep_growth(kr_lanes *l, kr_lane_tangents *g, wide h,
                                           lane_deviation d, growth_integrals a)
{
    const wide t = wide_load(l->t);
    a = add_integral_node(l, a, END_WEIGHT * h, t);
    for (int i = 0; i < 4; i++) {
        const wide span = places[i] * h, time = t + span;
        const int order = g->terms[i];
        const lane_point here = evaluate_lane_series(l, order, time, 1);
        const wide square = norm2_without_trivial(g, &here, evaluate_tangent(g, order, span));
        a.last = find_tangent_log_norm(g, wide_approx_log(square));
        a = add_integral_node(l, a, weights[i] * h, time);
    }
    a.last = find_tangent_log_norm(g, wide_log(deviation_dot(d, d)));
    return add_integral_node(l, a, END_WEIGHT * h, t + h);
}

/* Returns the squared norm of the last Taylor term of the tangent, x[order] h^order. */
INLINE wide last_term_norm2(kr_lane_tangents *g, int order, wide h)
{
    wide power = wide_splat(1.0);
    for (int n = 0; n < order; n++) power = power * h;
    const lane_deviation last = deviation_load(g->x[order]);
    return power * power * deviation_dot(last, last);
}
/* Returns 1 if the truncation error of a substep of length h is small enough, else an estimate of
 * the permitted fraction of h, 0.01 to 0.99. `all` is the tangent at the end of the substep. */
INLINE wide allowed_step_fraction(kr_lane_tangents *g, int order, wide h, lane_deviation all)
{
    const wide one = wide_splat(1.0), zero = wide_splat(0.0), least = wide_splat(0.01);
    const wide size = deviation_dot(all, all), rest = last_term_norm2(g, order, h);
    const wide most = wide_splat(g->truncation_limit) * size;
    const mask is_finite = wide_less(size, wide_splat(INFINITY));
    const mask is_small =
        mask_and(is_finite, mask_or(wide_at_most(rest, most), wide_equal(size, zero)));
    const wide share =
        0.9 * approx_exp2_lanes((approx_log2_lanes(most) -
                                 approx_log2_lanes(wide_max(rest, wide_splat(0x1p-1000)))) *
                                (0.5 / order));
    const wide estimate = wide_min(wide_max(share, least), wide_splat(0.99));
    return wide_choose(is_small, one, wide_choose(is_finite, estimate, least));
}
/* Returns a length of the substep, at most h, for which the truncation error is small enough, or 0
 * if GROWTH_TRIES reductions do not suffice. */
INLINE wide shorten_growth_substep(kr_lane_tangents *g, int order, wide h)
{
    const wide one = wide_splat(1.0);
    mask is_long = wide_less(one, one);
    for (int i = 0; i < GROWTH_TRIES; i++) {
        const wide share = allowed_step_fraction(g, order, h, evaluate_tangent(g, order, h));
        is_long = wide_less(share, one);
        if (!mask_any(is_long)) return h;
        h = share * h;
    }
    return wide_choose(is_long, wide_splat(0.0), h);
}
/* Writes the Taylor series of P and W about the times at[lane] in the step `l` to g->substep. */
APART void begin_path_substep(kr_lanes *l, kr_lane_tangents *g, const double *at)
{
    kr_lanes *substep = &g->substep;
    const wide time = wide_load(at);
    const lane_point here = evaluate_lane_series(l, l->order, time, 1);
    substep->order = l->order;
    memcpy(substep->k, l->k, sizeof l->k);
    memcpy(substep->up, l->up, sizeof l->up);
    memcpy(substep->down, l->down, sizeof l->down);
    memcpy(substep->shift_prev, l->shift_prev, sizeof l->shift_prev);
    memcpy(substep->shift_next, l->shift_next, sizeof l->shift_next);
    memcpy(substep->forward, l->forward, sizeof l->forward);
    wide_store(substep->t, time);
    lane_vec_store(substep->p[0], here.p);
    lane_vec_store(substep->w[0], here.w);
    expand_lane_series(substep, KR_LANES_HEADLESS);
}
/* Propagates the tangent g->begin.d from the beginning of the step to the time `to`, in at most
 * `most` substeps. `at` is the point of the path at the time `to`. Adds the growth to `areas`, and
 * sets `reached` to the time that the tangent in each lane has reached. Returns the tangent at that
 * time, without its components along the trivial solutions. */
INLINE lane_deviation propagate_deviation(kr_lanes *l, kr_lane_tangents *g, wide to,
                                          const lane_point *at, int most, growth_integrals *areas,
                                          wide *reached)
{
    kr_lanes *path = l;
    lane_deviation d = deviation_load(g->begin.d);
    for (int parts = 1;; parts++) {
        const wide t = wide_load(path->t), left = to - t;
        deviation_store(g->x[0], d);
        for (int n = 0; n < l->order; n++) next_tangent_coefficient(path, g, n);
        const lane_deviation all = evaluate_tangent(g, l->order, left);
        const wide share = allowed_step_fraction(g, l->order, left, all);
        const mask whole_way = wide_equal(share, wide_splat(1.0));
        const int arrived = mask_all(whole_way);
        const wide h = arrived ? left : shorten_growth_substep(g, l->order, share * left);
        kr_lane_number time;
        *reached = wide_choose(whole_way, to, t + h);
        wide_store(time, *reached);
        d = arrived ? all : evaluate_tangent(g, l->order, h);
        lane_point here = *at;
        if (!arrived) {
            const lane_point there = evaluate_lane_series(path, path->order, wide_load(time), 1);
            here.p = lane_vec_choose(whole_way, at->p, there.p);
            here.w = lane_vec_choose(whole_way, at->w, there.w);
        }
        const lane_deviation own = remove_trivial_solutions(g, &here, d);
        update_largest_truncation(areas, last_term_norm2(g, l->order, h), d);
        *areas = add_substep_growth(path, g, h, own, *areas);
        if (arrived || parts == most) return own;
        begin_path_substep(l, g, time);
        path = &g->substep;
    }
}
INLINE growth_integrals load_growth_integrals(kr_lane_tangents *g)
{
    return (growth_integrals){wide_load(g->begin.area), wide_load(g->begin.moment),
                              wide_load(g->begin.max), wide_load(g->begin.last),
                              wide_load(g->begin.truncation)};
}
/* Propagates the tangent over the last step, removes its components along the trivial solutions,
 * and scales it by a power of two to a norm near 1. Writes the result and the growth to g->end.
 * Returns the time that the tangent in each lane has reached: the end of the step, or an earlier
 * time if the tangent needs more than GROWTH_SUBSTEPS substeps. */
INLINE wide propagate_tangent_over_step(kr_lanes *l, kr_lane_tangents *g)
{
    const lane_point at = {lane_vec_load(l->end_p), lane_vec_load(l->end_w), wide_splat(0.0)};
    memcpy(&g->begin, &g->end, sizeof g->end);
    growth_integrals areas = load_growth_integrals(g);
    wide reached;
    const lane_deviation d =
        propagate_deviation(l, g, wide_load(l->end), &at, GROWTH_SUBSTEPS, &areas, &reached);
    wide_store(g->end.area, areas.area);
    wide_store(g->end.moment, areas.moment);
    wide_store(g->end.max, areas.most);
    wide_store(g->end.last, areas.last);
    wide_store(g->end.truncation, areas.rest);
    const wide moved = 0x1.8p52 - 0.5 * approx_log2_lanes(deviation_dot(d, d)),
               power = wide_of_bits((wide_bits(moved) + 1023) << 52);
    deviation_store(g->end.d, deviation_scale(power, d));
    wide_store(g->end.power, wide_load(g->begin.power) - (moved - 0x1.8p52));
    wide_store(g->end.scale, wide_load(g->begin.scale) * power);
    return reached;
}
/* Writes the growth of the tangents up to the times l->at, which lie in the last step, to g->out.
 * Writes NaN to g->out[KR_GROWTH_LOG] in a lane whose tangent cannot be propagated that far. */
INLINE void write_growth_at_sample_time(kr_lanes *l, kr_lane_tangents *g)
{
    const wide at = wide_load(l->at), tiny = wide_splat(0x1p-1000);
    const wide t = wide_max(wide_load(l->forward) * at, tiny);
    const lane_point here = evaluate_lane_series(l, l->order, at, 1);
    growth_integrals areas = load_growth_integrals(g);
    wide reached;
    const lane_deviation d =
        propagate_deviation(l, g, at, &here, 2 * GROWTH_SUBSTEPS, &areas, &reached);
    const mask is_there = wide_equal(reached, at);
    wide_store(g->out[KR_GROWTH_LOG], wide_choose(is_there, areas.last, wide_splat(NAN)));
    wide_store(g->out[KR_GROWTH_TRUNCATION], wide_sqrt(areas.rest));
    wide_store(g->out[KR_GROWTH_MEGNO],
               2.0 * wide_fma(areas.area, 1.0 - wide_log(t), areas.moment) / t);
    wide_store(g->out[KR_GROWTH_MAX], areas.most);
    write_conservation_errors(g, &here, d);
}
/* Sets g->truncation_limit, and g->terms[i], the degree of the Taylor polynomials at x = places[i].
 * Term n of the tangent d is about x^n tol^(n/order) |d|; terms below 2^-24 |d| are omitted. */
static void set_truncation_and_degrees(const kr_lanes *l, kr_lane_tangents *g)
{
    g->truncation_limit = exp2(2.0 * (l->log2_tol + GROWTH_SLACK));
    for (int i = 0; i < 4; i++) {
        const double fall = -log2(places[i]) - l->log2_tol / l->order;
        g->terms[i] = (int)fmin(ceil(24.0 / fall), l->order);
    }
}
/* Removes from the initial tangents g->end.d their components along the trivial solutions. Writes
 * the norms of the results to g->first_size, and the results, scaled to unit length, to g->first.
 * Writes dE and d<m, e3> of the scaled tangents to g->first_energy and g->first_vertical. */
INLINE void project_initial_tangents(kr_lanes *l, kr_lane_tangents *g)
{
    set_truncation_and_degrees(l, g);
    const lane_point at = {lane_vec_load(l->end_p), lane_vec_load(l->end_w), wide_splat(0.0)};
    const lane_deviation d = remove_trivial_solutions(g, &at, deviation_load(g->end.d));
    const wide size = wide_sqrt(deviation_dot(d, d));
    const lane_deviation one = deviation_scale(1.0 / size, d);
    const lane_vec lean = find_energy_gradient_in_theta(g, &at);
    deviation_store(g->first, one);
    wide_store(g->first_energy, lane_vec_dot(one.push, at.w) + lane_vec_dot(one.turn, lean));
    wide_store(g->first_vertical, lane_vec_dot(one.push, at.p));
    wide_store(g->first_size, size);
}
