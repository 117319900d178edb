/* The state of a Goryachev-Chaplygin top at time t, from its plan. The same kernel evaluates one
 * time, or one time in each lane. A time gives bitwise equal results in a lane and alone.
 *
 * This header is compiled once for each instruction set and number of lanes. */
#ifndef KR_GORYACHEV_CHAPLYGIN_STATE_H
#define KR_GORYACHEV_CHAPLYGIN_STATE_H
#include "goryachev_chaplygin.h"
#include "torus_state.h"

/* Half of an angle [turns], with the sines and cosines that depend on it. */
typedef struct angle_lanes {
    dd half;
    wide s, c, sine, cosine; /* sine and cosine of the half angle, and of the angle */
} angle_lanes;

INLINE angle_lanes angle_of(dd half)
{
    angle_lanes a;
    a.half = half;
    sincos_turns(half, &a.s, &a.c);
    a.sine = 2.0 * a.s * a.c;
    a.cosine = a.c * a.c - a.s * a.s;
    return a;
}
/* Sums a series by Clenshaw's recurrence, from the last term to the first. Returns the last value
 * of the recurrence and writes the one before it to `before`. */
INLINE wide clenshaw(const double a[], int count, wide cosine, wide *before)
{
    const wide twice = 2.0 * cosine;
    wide one = wide_splat(0.0), two = one;
    for (int k = count - 1; k >= 0; k--) {
        const wide now = (a[k] + twice * one) - two;
        two = one;
        one = now;
    }
    *before = two;
    return one;
}
/* Returns the sum of the series c or s (`which` 0 or 1) of an angle from the last two values of
 * Clenshaw's recurrence. */
INLINE wide finish_part(const kr_angle_series *e, int which, const angle_lanes *a, wide last,
                        wide before)
{
    if (e->is_whole[which]) return e->is_sine[which] ? a->sine * before : last - a->cosine * before;
    return e->is_sine[which] ? a->s * (last + before) : a->c * (last - before);
}
INLINE wide part_at(const kr_angle_series *e, int which, const angle_lanes *a)
{
    wide before;
    const wide last = clenshaw(e->part[which], e->count[which], a->cosine, &before);
    return finish_part(e, which, a, last, before);
}
/* Two recurrences of Clenshaw with the same argument: the last values and the ones before. */
typedef struct clenshaw_pair {
    wide twice, one, other, one_before, other_before;
} clenshaw_pair;

INLINE clenshaw_pair begin_pair(wide cosine)
{
    const wide zero = wide_splat(0.0);
    const clenshaw_pair p = {2.0 * cosine, zero, zero, zero, zero};
    return p;
}
INLINE void step_pair(clenshaw_pair *p, double one, double other)
{
    const wide next = (one + p->twice * p->one) - p->one_before,
               other_next = (other + p->twice * p->other) - p->other_before;
    p->one_before = p->one;
    p->other_before = p->other;
    p->one = next;
    p->other = other_next;
}
/* Writes the sums c and s of both angles. The four series have the same number of terms. They are
 * summed together, because the steps of a single recurrence wait for each other. */
INLINE void sum_parts(const kr_chaplygin_plan *plan, const angle_lanes a[2], wide c[2], wide s[2])
{
    const kr_angle_series *const first = &plan->angle[0], *const second = &plan->angle[1];
    clenshaw_pair p = begin_pair(a[0].cosine), q = begin_pair(a[1].cosine);
    for (int k = first->count[0] - 1; k >= 0; k--) {
        step_pair(&p, first->part[0][k], first->part[1][k]);
        step_pair(&q, second->part[0][k], second->part[1][k]);
    }
    c[0] = finish_part(first, 0, &a[0], p.one, p.one_before);
    s[0] = finish_part(first, 1, &a[0], p.other, p.other_before);
    c[1] = finish_part(second, 0, &a[1], q.one, q.one_before);
    s[1] = finish_part(second, 1, &a[1], q.other, q.other_before);
}
/* Adds the time series of both angles to `value`, and their derivatives in tau to `slope`. The four
 * series have the same number of terms. */
INLINE void sum_times(const kr_chaplygin_plan *plan, const angle_lanes a[2], wide *value,
                      wide *slope)
{
    const kr_angle_series *const first = &plan->angle[0], *const second = &plan->angle[1];
    clenshaw_pair p = begin_pair(a[0].cosine), q = begin_pair(a[1].cosine);
    for (int k = first->times - 1; k >= 0; k--) {
        step_pair(&p, first->time[k], first->time_rate[k]);
        step_pair(&q, second->time[k], second->time_rate[k]);
    }
    *value = *value + (a[0].sine * p.one_before + a[1].sine * q.one_before);
    *slope = *slope + (first->rate * (p.other - a[0].cosine * p.other_before) +
                       second->rate * (q.other - a[1].cosine * q.other_before));
}
/* Returns the slip, which is the difference between tau and its mean growth. `half` has the halves
 * of the mean angles. Newton's method in a bracket is safe, because t grows with tau everywhere. A
 * step of Newton's method that is not at most half of the last step is replaced by bisection,
 * because Newton's method can alternate between two points on both sides of the solution. Writes
 * the true angles to `a`. */
INLINE wide find_slip(const kr_chaplygin_plan *plan, const dd half[2], angle_lanes a[2])
{
    wide slip = wide_splat(0.0), high = wide_splat(plan->most_slip), low = -high,
         moved = 4.0 * high;
    mask done = wide_less(high, low);
    for (int step = 0; step < 80 && !mask_all(done); step++) {
        const angle_lanes at[2] = {angle_of(phase_plus(half[0], slip * plan->angle[0].half_turns)),
                                   angle_of(phase_plus(half[1], slip * plan->angle[1].half_turns))};
        wide value = plan->mean * slip, slope = wide_splat(plan->mean);
        sum_times(plan, at, &value, &slope);
        const mask up = wide_less(wide_splat(0.0), value);
        high = wide_choose(up, slip, high);
        low = wide_choose(up, low, slip);
        const wide newton = value / slope;
        wide next = slip - newton;
        const mask is_inside = mask_and(wide_at_most(low, next), wide_at_most(next, high)),
                   is_short = wide_at_most(wide_abs(newton), 0.5 * moved);
        next = wide_choose(mask_and(is_inside, is_short), next, 0.5 * (low + high));
        moved = wide_abs(next - slip);
        const mask settled = wide_at_most(moved, wide_splat(plan->tolerance));
        slip = wide_choose(done, slip, next);
        done = mask_or(done, settled);
    }
    for (int j = 0; j < 2; j++)
        a[j] = angle_of(phase_plus(half[j], slip * plan->angle[j].half_turns));
    return slip;
}
/* Cosines and sines of the multiples of the second angle. */
typedef struct heading_waves {
    wide c[HEADING_WIDE], s[HEADING_WIDE];
} heading_waves;

INLINE void fill_heading_waves(const kr_chaplygin_plan *plan, const angle_lanes *a,
                               heading_waves *w)
{
    const int is_whole = plan->angle[1].is_whole[0];
    w->c[0] = is_whole ? wide_splat(1.0) : a->c;
    w->s[0] = is_whole ? wide_splat(0.0) : a->s;
    for (int k = 1; k < plan->wide; k++) {
        w->c[k] = w->c[k - 1] * a->cosine - w->s[k - 1] * a->sine;
        w->s[k] = w->s[k - 1] * a->cosine + w->c[k - 1] * a->sine;
    }
}
/* Returns the sum of all terms of the heading that are not slow. */
INLINE wide sum_heading(const kr_chaplygin_plan *plan, const angle_lanes a[2])
{
    heading_waves w;
    wide c = a[0].c, s = a[0].s, sum = wide_splat(0.0);
    const double *term = plan->term;
    fill_heading_waves(plan, &a[1], &w);
    for (int i = 0, k = 0; i < plan->rows; i++, k++) {
        const kr_heading_row *row = &plan->row[i];
        wide u = wide_splat(0.0), v = wide_splat(0.0);
        for (; k < row->first; k++) {
            const wide next = c * a[0].cosine - s * a[0].sine;
            s = s * a[0].cosine + c * a[0].sine;
            c = next;
        }
        for (int j = 0; j < row->count; j++, term += 2) {
            u = u + term[0] * w.c[row->from + j];
            v = v + term[1] * w.s[row->from + j];
        }
        sum = sum + (plan->is_even ? s * u + c * v : c * u + s * v);
        const wide next = c * a[0].cosine - s * a[0].sine;
        s = s * a[0].cosine + c * a[0].sine;
        c = next;
    }
    return sum;
}
/* Returns sin x / x for |x| <= 1/2. The first term left out is below 5e-17. */
INLINE wide sinc_of(wide x)
{
    const wide xx = x * x, last = 1.0 / 362880 - xx * (1.0 / 39916800 - xx * (1.0 / 6227020800.0));
    return 1.0 - xx * (1.0 / 6 - xx * (1.0 / 120 - xx * (1.0 / 5040 - xx * last)));
}
/* Returns the sum of the integrals of the slow terms, value cos(phase + rate tau), over the time
 * `tau` since the start. */
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
/* Returns the state at `time`, when the halves of the mean angles are `mean`. `elapsed` is the mean
 * growth of tau since the start. The frame of the plan makes it a state of the frame of
 * description. */
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
    /* psi/2 [turns]. The low word of the product is smaller than the rounding error of the
     * series. */
    const wide half = 0.5 * (grown * turn.hi);
    dd heading = two_sum(wide_splat(plan->heading_start), half - nearest(half));
    heading.lo = heading.lo + plan->heading_more;
    wide s, c;
    sincos_turns(heading, &s, &c);
    const wide n = wide_sqrt(wide_splat(0.5)) / wide_sqrt(size);
    /* The product (i + k)/sqrt2 (c1 + c2 i - s2 j + s1 k). The rotation by the heading follows
     * below. */
    const wide uw = -n * (c2 + s1), ux = n * (c1 + s2), uy = n * (c2 - s1), uz = n * (c1 - s2);
    const quat_lanes q = {c * uw - s * uz, c * ux - s * uy, c * uy + s * ux, c * uz + s * uw};
    const wide unit = plan->torus.momentum * size;
    state_lanes r;
    r.t = time;
    r.m.x = unit * (c * c - s * s);
    r.m.y = unit * (2.0 * c * s);
    r.m.z = wide_splat(plan->vertical);
    r.q = torus_attitude(&plan->torus, q);
    return r;
}
/* Returns the state at `time`, which is `span` after the beginning. */
INLINE state_lanes chaplygin_kernel(const kr_chaplygin_plan *plan, wide time, dd span)
{
    const dd mean[2] = {torus_phase_at(&plan->torus, 0, span),
                        torus_phase_at(&plan->torus, 1, span)};
    return chaplygin_kernel_at(plan, time, mean, span.hi * plan->tau_rate);
}
#endif
