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
/* Returns the sum of the series c or s (`which` 0 or 1) of an angle. */
INLINE wide part_at(const kr_angle_series *e, int which, const angle_lanes *a)
{
    wide before;
    const wide last = clenshaw(e->part[which], e->count[which], a->cosine, &before);
    if (e->is_whole[which]) return e->is_sine[which] ? a->sine * before : last - a->cosine * before;
    return e->is_sine[which] ? a->s * (last + before) : a->c * (last - before);
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
        wide value = plan->mean * slip, slope = wide_splat(plan->mean);
        for (int j = 0; j < 2; j++) {
            const kr_angle_series *e = &plan->angle[j];
            const angle_lanes at = angle_of(phase_plus(half[j], slip * e->half_turns));
            wide before;
            (void)clenshaw(e->time, e->times, at.cosine, &before);
            value = value + at.sine * before;
            const wide last = clenshaw(e->time_rate, e->times, at.cosine, &before);
            slope = slope + e->rate * (last - at.cosine * before);
        }
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
/* Returns the sum of the integrals of the slow terms, value cos(phase + rate tau), over the time
 * `tau` since the start. */
INLINE wide sum_slow_terms(const kr_chaplygin_plan *plan, const angle_lanes a[2], wide tau)
{
    wide sum = wide_splat(0.0);
    for (int i = 0; i < plan->slow_terms; i++) {
        const kr_slow_term *n = &plan->slow[i];
        const wide x = n->rate * tau;
        const mask near = wide_less(wide_abs(x), wide_splat(1.0));
        const wide half = wide_choose(near, 0.5 * x, wide_splat(0.0)), hh = half * half,
                   sinc =
                       1.0 -
                       hh * (1.0 / 6 -
                             hh * (1.0 / 120 - hh * (1.0 / 5040 -
                                                     hh * (1.0 / 362880 - hh * (1.0 / 39916800)))));
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
    const wide c1 = part_at(&plan->angle[0], 0, &a[0]), s1 = part_at(&plan->angle[0], 1, &a[0]),
               c2 = part_at(&plan->angle[1], 0, &a[1]), s2 = part_at(&plan->angle[1], 1, &a[1]);
    const wide size = (c1 * c1 + s1 * s1) + (c2 * c2 + s2 * s2);
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
