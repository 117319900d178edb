/* Test for possible events within the current step of each SIMD lane. Within a step, the event
 * function is a polynomial, and its coefficients in the Bernstein basis bound its values. If all
 * coefficients have the sign that the event function had before the step, its sign has not changed.
 * The test may report false positives, but never misses a sign change. If an event is possible in a
 * lane, section.c searches the last step of this lane for the event. This source file is compiled
 * once for each instruction set. */
#include "lane_series.h"

/* Returns the event function without its constant term. */
INLINE wide event_value(kr_lanes *l, lane_vec p, lane_vec w)
{
    return lane_vec_dot(lane_vec_load(l->along_p), p) + lane_vec_dot(lane_vec_load(l->along_w), w);
}
/* Returns the time derivative of the event function. */
INLINE wide event_rate(kr_lanes *l, lane_vec p, lane_vec w, int terms)
{
    const lane_vec k = lane_vec_load(l->k), carried = add_rotor_products(l, w, lane_vec_splat(0.0));
    lane_vec linear = lane_vec_fma(k, carried, gravity_rates(l, p));
    if (terms & KR_LANES_DAMPED) linear = lane_vec_fma(lane_vec_load(l->drag), w, linear);
    const lane_vec dp = lane_vec_cross(p, w),
                   dw = lane_vec_fma(lane_vec_times(k, lane_vec_next(w)), lane_vec_prev(w), linear);
    return event_value(l, dp, dw);
}
/* Stores in l->g the polynomial coefficients of the event function, or of its derivative for
 * extrema, over a step of size h. Returns the degree. As in events/event_polynomial.c, the last
 * coefficient is corrected so that the polynomials of consecutive steps agree at the common end. */
INLINE int expand_event(kr_lanes *l, wide h, const lane_point *end, int terms)
{
    const int first = l->extremum, degree = l->order - first;
    const wide apart = wide_load(l->constant), zero = wide_splat(0.0);
    wide power = first ? h : wide_splat(1.0), reached = zero;
    for (int n = 0; n <= degree; n++) {
        const int i = n + first;
        const wide share = first ? (double)i * power : power,
                   g = share * event_value(l, lane_vec_load(l->p[i]), lane_vec_load(l->w[i])) +
                       (i == 0 ? apart : zero);
        wide_store(l->g[n], g);
        reached = reached + g;
        power = power * h;
    }
    const wide there =
        first ? h * event_rate(l, end->p, end->w, terms) : event_value(l, end->p, end->w) + apart;
    wide_store(l->g[degree], wide_load(l->g[degree]) + (there - reached));
    return degree;
}
/* Returns a mask of the lanes in which no event can have occurred during the step. */
INLINE mask keeps_sign(kr_lanes *l, wide h, const lane_point *end, int terms)
{
    const int degree = expand_event(l, h, end, terms);
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
