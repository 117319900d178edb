/* Test for possible events within the last step of each SIMD lane. The event function is g =
 * <along_p, P> + <along_w, W> + constant (kr_lanes, lane_state.h), with the vertical P and the
 * angular velocity W in the body. An event is a zero of g or, if l->extremum is 1, a zero of dg/dt.
 * Within a step, g and dg/dt are polynomials. The coefficients of a polynomial in the Bernstein
 * basis bound its values: if all of them have the sign `side` that is known from earlier steps, the
 * polynomial does not change sign. The test may report false positives, but never misses a sign
 * change. If an event is possible in a lane, section.c searches the step. This file is compiled
 * once for each instruction set. */
#include "lane_series.h"

/* Returns <along_p, p> + <along_w, w>: the event function without its constant. */
INLINE wide evaluate_event_linear_part(kr_lanes *l, lane_vec p, lane_vec w)
{
    return lane_vec_dot(lane_vec_load(l->along_p), p) + lane_vec_dot(lane_vec_load(l->along_w), w);
}
/* Returns the time derivative dg/dt of the event function at P = p and W = w. */
INLINE wide event_rate(kr_lanes *l, lane_vec p, lane_vec w, int flags)
{
    const lane_vec k = lane_vec_load(l->k), carried = add_rotor_products(l, w, lane_vec_splat(0.0));
    lane_vec linear = lane_vec_fma(k, carried, gravity_rates(l, p));
    if (flags & KR_LANES_DAMPED) linear = lane_vec_fma(lane_vec_load(l->drag), w, linear);
    const lane_vec dp = lane_vec_cross(p, w),
                   dw = lane_vec_fma(lane_vec_times(k, lane_vec_yzx(w)), lane_vec_zxy(w), linear);
    return evaluate_event_linear_part(l, dp, dw);
}
/* Writes to l->g[n] the coefficient of s^n in g or, if l->extremum is 1, in dg/ds, where s is the
 * time since the start of the step divided by the step size h. Returns the degree. Corrects the
 * last coefficient so that the value at s = 1 is the value computed from P and W in *end, with
 * which the next step begins. */
INLINE int write_event_polynomial(kr_lanes *l, wide h, const lane_point *end, int flags)
{
    const int first = l->extremum, degree = l->order - first;
    const wide apart = wide_load(l->constant), zero = wide_splat(0.0);
    wide power = first ? h : wide_splat(1.0), reached = zero;
    for (int n = 0; n <= degree; n++) {
        const int i = n + first;
        const wide share = first ? (double)i * power : power,
                   g = share * evaluate_event_linear_part(l, lane_vec_load(l->p[i]),
                                                          lane_vec_load(l->w[i])) +
                       (i == 0 ? apart : zero);
        wide_store(l->g[n], g);
        reached = reached + g;
        power = power * h;
    }
    const wide there = first ? h * event_rate(l, end->p, end->w, flags)
                             : evaluate_event_linear_part(l, end->p, end->w) + apart;
    wide_store(l->g[degree], wide_load(l->g[degree]) + (there - reached));
    return degree;
}
/* Returns a mask of lanes that certainly have no event in the step of size h that ends at *end. */
INLINE mask find_lanes_without_event(kr_lanes *l, wide h, const lane_point *end, int flags)
{
    const int degree = write_event_polynomial(l, h, end, flags);
    const wide side = wide_load(l->side);
    wide b[KR_LANES_ORDER + 1];
    double binomial = 1.0;
    for (int i = 0; i <= degree; i++) {
        b[i] = wide_load(l->g[i]) * side * (1.0 / binomial);
        binomial = binomial * (degree - i) / (i + 1);
    }
    for (int k = 1; k <= degree; k++)
        for (int i = degree; i >= k; i--) b[i] = b[i] + b[i - 1];
    wide least = b[0];
    for (int i = 1; i <= degree; i++) least = wide_min(least, b[i]);
    return wide_less(wide_load(l->noise), least);
}
