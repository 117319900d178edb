/* State of a Goryachev-Chaplygin top at time t, computed from its closed-form solution. The code
 * computes the state at a single time, or at a different time in each vector lane. Single and
 * vectorized evaluations give bitwise equal results.
 *
 * This header is compiled once for each instruction set and number of lanes. */
#ifndef KR_GORYACHEV_CHAPLYGIN_STATE_H
#define KR_GORYACHEV_CHAPLYGIN_STATE_H
#include "goryachev_chaplygin.h"
#include "torus_state.h"

/* Half of an angle, in turns, and the cosines and sines of its multiples. Element i of `c` or `s`
 * is the cosine or sine of i/2 times the angle. */
typedef struct angle_lanes {
    dd half;
    wide c[5], s[5];
} angle_lanes;

/* Computes the cosines and sines of the multiples of half of an angle. */
INLINE void fill_angle(angle_lanes *a)
{
    a->c[0] = wide_splat(1.0);
    a->s[0] = wide_splat(0.0);
    for (int i = 2; i < 5; i++) {
        const int low = i / 2, high = i - low;
        a->c[i] = a->c[low] * a->c[high] - a->s[low] * a->s[high];
        a->s[i] = a->c[low] * a->s[high] + a->s[low] * a->c[high];
    }
}
INLINE angle_lanes angle_of(dd half)
{
    angle_lanes a;
    a.half = half;
    sincos_turns(half, &a.s[1], &a.c[1]);
    fill_angle(&a);
    return a;
}
/* Clenshaw's recurrence for a single series, with separate sums for even and odd indices.
 * The two separate sums halve the length of the chain of dependent operations. The
 * arrays `last` and `before` hold the two most recent values of each recurrence. */
typedef struct clenshaw_sum {
    wide last[2], before[2];
} clenshaw_sum;

INLINE clenshaw_sum begin_sum(void)
{
    const wide zero = wide_splat(0.0);
    const clenshaw_sum p = {{zero, zero}, {zero, zero}};
    return p;
}
/* Performs one step of both recurrences, which adds the terms with the even index k and the odd
 * index k + 1. */
INLINE void step_sum(clenshaw_sum *p, wide twice, const double term[2])
{
    for (int i = 0; i < 2; i++) {
        const wide now = (term[i] + twice * p->last[i]) - p->before[i];
        p->before[i] = p->last[i];
        p->last[i] = now;
    }
}
/* Evaluates a series of cosines or sines of k + shift/2 times the angle. */
INLINE wide finish_sum(const clenshaw_sum *p, int is_sine, int shift, const angle_lanes *a)
{
    wide sum = wide_splat(0.0);
    for (int i = 0; i < 2; i++) {
        const int at = 2 * i + shift;
        sum = sum + (is_sine ? a->s[at] * p->last[i] + a->s[4 - at] * p->before[i]
                             : a->c[at] * p->last[i] - a->c[4 - at] * p->before[i]);
    }
    return sum;
}
/* Returns the value of the series c (`which` = 0) or s (`which` = 1) of an angle. */
INLINE wide finish_part(const kr_angle_series *e, int which, const clenshaw_sum *p,
                        const angle_lanes *a)
{
    if (e->is_whole[which]) return finish_sum(p, e->is_sine[which], 0, a);
    return finish_sum(p, e->is_sine[which], 1, a);
}
INLINE wide part_at(const kr_angle_series *e, int which, const angle_lanes *a)
{
    clenshaw_sum p = begin_sum();
    const wide twice = 2.0 * a->c[4];
    for (int k = e->count[which] - 2; k >= 0; k -= 2) step_sum(&p, twice, e->part[which] + k);
    return finish_part(e, which, &p, a);
}
/* Evaluates the Fourier series c1 and s1 in the first angle, and c2 and s2 in the second. All four
 * series have the same length, and are summed in parallel to hide the latency of the
 * recurrences. */
INLINE void sum_parts(const kr_chaplygin_plan *plan, const angle_lanes a[2], wide c[2], wide s[2])
{
    const kr_angle_series *const first = &plan->angle[0], *const second = &plan->angle[1];
    const wide one = 2.0 * a[0].c[4], two = 2.0 * a[1].c[4];
    clenshaw_sum p = begin_sum(), q = p, u = p, v = p;
    for (int k = first->count[0] - 2; k >= 0; k -= 2) {
        step_sum(&p, one, first->part[0] + k);
        step_sum(&q, one, first->part[1] + k);
        step_sum(&u, two, second->part[0] + k);
        step_sum(&v, two, second->part[1] + k);
    }
    c[0] = finish_part(first, 0, &p, &a[0]);
    s[0] = finish_part(first, 1, &q, &a[0]);
    c[1] = finish_part(second, 0, &u, &a[1]);
    s[1] = finish_part(second, 1, &v, &a[1]);
}
/* Performs one step of Newton's method for the periodic part of the rescaled time tau, starting
 * from `slip`. The residual of the time equation at the starting point `slip` is written to
 * `value`. Each series is truncated to its first `terms` terms. */
INLINE wide improve_slip(const kr_chaplygin_plan *plan, const dd half[2], int terms, wide slip,
                         wide *value)
{
    const kr_angle_series *const first = &plan->angle[0], *const second = &plan->angle[1];
    const angle_lanes a = angle_of(phase_plus(half[0], slip * first->half_turns)),
                      b = angle_of(phase_plus(half[1], slip * second->half_turns));
    const wide one = 2.0 * a.c[4], two = 2.0 * b.c[4];
    clenshaw_sum p = begin_sum(), q = p, u = p, v = p;
    for (int k = terms - 2; k >= 0; k -= 2) {
        step_sum(&p, one, first->time + k);
        step_sum(&q, one, first->time_rate + k);
        step_sum(&u, two, second->time + k);
        step_sum(&v, two, second->time_rate + k);
    }
    *value = plan->mean * slip + (finish_sum(&p, 1, 0, &a) + finish_sum(&u, 1, 0, &b));
    const wide slope = plan->mean + (first->rate * finish_sum(&q, 0, 0, &a) +
                                     second->rate * finish_sum(&v, 0, 0, &b));
    return slip - *value / slope;
}
/* Returns the slip, which is the periodic part of the rescaled time tau. The array `half` contains
 * half of each mean angle, in turns. The first Newton steps use truncated series for the time.
 * Later Newton steps are confined to an interval that brackets the solution; it exists because t
 * increases monotonically with tau. A Newton step longer than half the previous one is replaced by
 * bisection. Newton's method could otherwise alternate between two points on opposite sides of the
 * solution. The torus angles that correspond to the returned slip are written to the array `a`. */
INLINE wide find_slip(const kr_chaplygin_plan *plan, const dd half[2], angle_lanes a[2])
{
    wide high = wide_splat(plan->most_slip), low = -high, moved = 4.0 * high,
         slip = wide_splat(0.0), value;
    for (int step = 0; step < GUESSES; step++)
        slip = wide_max(
            wide_min(improve_slip(plan, half, plan->guess_terms[step], slip, &value), high), low);
    mask done = wide_less(high, low);
    for (int step = 0; step < 80 && !mask_all(done); step++) {
        wide next = improve_slip(plan, half, plan->angle[0].times, slip, &value);
        const mask up = wide_less(wide_splat(0.0), value);
        high = wide_choose(up, slip, high);
        low = wide_choose(up, low, slip);
        const mask is_inside = mask_and(wide_at_most(low, next), wide_at_most(next, high)),
                   is_safe = mask_and(is_inside, wide_at_most(wide_abs(next - slip), 0.5 * moved));
        next = wide_choose(is_safe, next, 0.5 * (low + high));
        moved = wide_abs(next - slip);
        const mask settled =
            mask_or(mask_and(is_safe, wide_at_most(moved, wide_splat(plan->tolerance))),
                    wide_at_most(moved, wide_splat(plan->rounding)));
        slip = wide_choose(done, slip, next);
        done = mask_or(done, settled);
    }
    for (int j = 0; j < 2; j++)
        a[j] = angle_of(phase_plus(half[j], slip * plan->angle[j].half_turns));
    return slip;
}
/* cos(k a) and sin(k a) of the second angle a, or those of (k + 1/2) a, at indices 2k and 2k +
 * 1. */
typedef struct heading_waves {
    wide w[2 * HEADING_WIDE];
} heading_waves;

/* Multiplies exp(i k a) by c + i s, and writes the real and imaginary parts of the product. */
INLINE void turn_wave(const wide from[2], wide c, wide s, wide to[2])
{
    to[0] = from[0] * c - from[1] * s;
    to[1] = from[1] * c + from[0] * s;
}
/* Computes the cosines and sines of the multiples of the second angle by recurrences with a stride
 * of four. Four independent recurrences are faster than one, because each step of a recurrence
 * depends on the previous steps. */
INLINE void fill_heading_waves(const kr_chaplygin_plan *plan, const angle_lanes *a,
                               heading_waves *wave)
{
    const int shift = !plan->angle[1].is_whole[0];
    const wide c = a->c[4] * a->c[4] - a->s[4] * a->s[4], s = 2.0 * a->s[4] * a->c[4];
    wide *const w = wave->w;
    w[0] = shift ? a->c[1] : a->c[0];
    w[1] = shift ? a->s[1] : a->s[0];
    turn_wave(w, a->c[2], a->s[2], w + 2);
    turn_wave(w, a->c[4], a->s[4], w + 4);
    turn_wave(w + 2, a->c[4], a->s[4], w + 6);
    for (int k = 8; k < 2 * plan->wide; k += 2) turn_wave(w + k - 8, c, s, w + k);
}
/* Sums the terms of a two-dimensional Fourier series that share one multiple of the first angle.
 * Terms with even and odd indices are summed separately, so that vector instructions can be used.
 * The number of terms, `count`, must be even. */
INLINE void sum_heading_row(const double *term, int count, const wide *w, wide *u, wide *v)
{
#if defined KR_ONE_LANE && defined __GNUC__
    typedef double four __attribute__((vector_size(32)));
    four sum = {0.0, 0.0, 0.0, 0.0};
    for (int j = 0; j < count; j += 2, term += 4, w += 4) {
        four t, x;
        memcpy(&t, term, sizeof t);
        memcpy(&x, w, sizeof x);
        sum = sum + t * x;
    }
#else
    wide sum[4];
    for (int i = 0; i < 4; i++) sum[i] = wide_splat(0.0);
    for (int j = 0; j < count; j += 2, term += 4, w += 4)
        for (int i = 0; i < 4; i++) sum[i] = sum[i] + term[i] * w[i];
#endif
    *u = sum[0] + sum[2];
    *v = sum[1] + sum[3];
}
/* Returns the sum of the heading's Fourier series except for the slow terms, which are integrated
 * separately. */
INLINE wide sum_heading(const kr_chaplygin_plan *plan, const angle_lanes a[2])
{
    heading_waves waves;
    wide now[2] = {a[0].c[1], a[0].s[1]}, sum = wide_splat(0.0);
    const double *term = plan->term;
    fill_heading_waves(plan, &a[1], &waves);
    for (int i = 0, k = 0; i < plan->rows; i++, k++) {
        const kr_heading_row *row = &plan->row[i];
        wide u, v, next[2];
        for (; k < row->first; k++) {
            turn_wave(now, a[0].c[2], a[0].s[2], next);
            memcpy(now, next, sizeof now);
        }
        sum_heading_row(term, row->count, waves.w + 2 * row->from, &u, &v);
        term += 2 * row->count;
        sum = sum + (plan->is_even ? now[1] * u + now[0] * v : now[0] * u + now[1] * v);
        turn_wave(now, a[0].c[2], a[0].s[2], next);
        memcpy(now, next, sizeof now);
    }
    return sum;
}
/* Returns sin x / x for |x| <= 1/2. The first omitted term of the Taylor series is below 5e-17. */
INLINE wide sinc_of(wide x)
{
    const wide xx = x * x, last = 1.0 / 362880 - xx * (1.0 / 39916800 - xx * (1.0 / 6227020800.0));
    return 1.0 - xx * (1.0 / 6 - xx * (1.0 / 120 - xx * (1.0 / 5040 - xx * last)));
}
/* Integrates the slow terms of the heading rate from 0 to `tau`. */
INLINE wide sum_slow_terms(const kr_chaplygin_plan *plan, const angle_lanes a[2], wide tau)
{
    wide sum = wide_splat(0.0);
    for (int i = 0; i < plan->slow_terms; i++) {
        const kr_slow_term *n = &plan->slow[i];
        const wide x = n->rate * tau;
        const mask near = wide_less(wide_abs(x), wide_splat(1.0));
        const wide half = wide_choose(near, 0.5 * x, wide_splat(0.0)), sinc = sinc_of(half);
        wide s, c, unused;
        const dd turn = one_turn();
        sincos_turns(dd_add(dd_of(wide_splat(n->phase)), dd_times(half, turn)), &unused, &c);
        const dd one = dd_times(wide_splat(n->first), a[0].half),
                 two = dd_times(wide_splat(n->second), a[1].half);
        dd now = dd_add(dd_add(dd_make(one.hi - nearest(one.hi), one.lo),
                               dd_make(two.hi - nearest(two.hi), two.lo)),
                        dd_of(wide_splat(n->offset)));
        sincos_turns(now, &s, &unused);
        sum = sum + wide_choose(near, n->value * tau * c * sinc, n->over * (s - n->sine));
    }
    return sum;
}
/* Returns the state at `time`. The array `mean` contains half of each mean angle. The argument
 * `elapsed` is the time since the initial time, multiplied by the mean rate of tau. */
INLINE state_lanes chaplygin_kernel_at(const kr_chaplygin_plan *plan, wide time, const dd mean[2],
                                       wide elapsed)
{
    const dd turn = one_turn();
    angle_lanes a[2];
    const wide slip = find_slip(plan, mean, a), tau = elapsed + (slip - plan->slip);
    wide part[2], other[2];
    sum_parts(plan, a, part, other);
    const wide c1 = part[0], c2 = part[1], s1 = other[0], s2 = other[1],
               size = (c1 * c1 + s1 * s1) + (c2 * c2 + s2 * s2);
    const wide grown = (sum_heading(plan, a) - plan->heading_value) + sum_slow_terms(plan, a, tau);
    /* psi/2 in turns. The low-order part of the product is smaller than the rounding error of the
     * series. */
    const wide half = 0.5 * (grown * turn.hi);
    dd heading = two_sum(wide_splat(plan->heading_start), half - nearest(half));
    heading.lo = heading.lo + plan->heading_more;
    wide s, c;
    sincos_turns(heading, &s, &c);
    const wide n = wide_sqrt(wide_splat(0.5)) / wide_sqrt(size);
    /* The attitude for zero heading is (i + k)/sqrt2 (c1 + c2 i - s2 j + s1 k). The rotation by the
     * heading follows below. */
    const wide uw = -n * (c2 + s1), ux = n * (c1 + s2), uy = n * (c2 - s1), uz = n * (c1 - s2);
    const quat_lanes q = {c * uw - s * uz, c * ux - s * uy, c * uy + s * ux, c * uz + s * uw};
    const wide unit = plan->torus.momentum * size;
    state_lanes r;
    r.t = time;
    r.m.x = unit * (c * c - s * s);
    r.m.y = unit * (2.0 * c * s);
    r.m.z = wide_splat(0.0);
    r.q = torus_attitude(&plan->torus, q);
    return r;
}
/* Returns the state at `time`, which is the initial time plus `span`. */
INLINE state_lanes chaplygin_kernel(const kr_chaplygin_plan *plan, wide time, dd span)
{
    const dd mean[2] = {torus_phase_at(&plan->torus, 0, span),
                        torus_phase_at(&plan->torus, 1, span)};
    return chaplygin_kernel_at(plan, time, mean, span.hi * plan->tau_rate);
}
#endif
