/* States of the closed-form solution for a single top, and closed-form solutions for motions
 * without nutation. This header is compiled once for each instruction set, because double-doubles
 * are faster with fused multiply-add. */
#ifndef KR_EXACT_SINGLE_H
#define KR_EXACT_SINGLE_H
#include "frame.h"
#include "phase.h"

/* Returns the state at the time t, which is the initial time plus `span`. The kernel is called with
 * constants that select the kind of series, so that the compiler can remove the code for the other
 * kinds. */
static inline kr_state state_after(const kr_exact_form *e, double t, dd span)
{
    kr_state r;
    if (e->curve == LAGRANGE)
        r = kernel(e, 0, 0, t, span);
    else if (e->curve == EULER)
        r = kernel(e, 0, 1, t, span);
    else if (e->curve == LAGRANGE_DUAL)
        r = kernel(e, 1, 0, t, span);
    else
        r = kernel(e, 1, 1, t, span);
    if (e->framed != 0.0) r.q = framed(e->frame, r.q);
    return r;
}
/* If t is too large for the phases to be computed, returns the initial state, because this state at
 * least has the correct integrals of motion. Returns NaN if t is not finite. */
static inline kr_state state_beyond(const kr_exact_form *e, double t)
{
    const kr_state none = {t, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    return isfinite(t) ? state_after(e, t, dd_of(0.0)) : none;
}
/* Returns the state at time t. */
static inline kr_state state_at(const kr_exact_form *e, double t)
{
    const dd span = two_sum(t, -e->begin);
    return is_within(e, span.hi) ? state_after(e, t, span) : state_beyond(e, t);
}

/* Sets up a motion in which alpha and beta have constant magnitudes and constant rates. Such
 * motions include those of sleeping, hanging and resting tops, and of symmetric bodies without
 * torque. */
static inline void steady_closed_form(kr_exact_form *exact, kr_quat q, dd first, dd second)
{
    const double a = length(q.w, q.z), b = length(q.x, q.y);
    exact->curve = LAGRANGE;
    phase_start(&exact->nutation, dd_of(0.25));
    exact->first = phase_of(first);
    exact->second = phase_of(second);
    phase_start(&exact->first, turns_of(q.z, q.w));
    phase_start(&exact->second, dd_add(turns_of(q.y, q.x), dd_of(-0.25)));
    exact->alpha.even[0] = a;
    exact->beta.odd[0] = b;
    exact->period = INFINITY;
    /* If the axis is vertical, the entire rotation is attributed to the spin. */
    exact->precession_rate = a > 0.0 && b > 0.0 ? first.hi + second.hi : 0.0;
    exact->spin_angle_rate = b == 0.0   ? 2.0 * first.hi
                             : a == 0.0 ? -2.0 * second.hi
                                        : first.hi - second.hi;
}
/* Sets the frame of the solution to q -> left * q * right. */
static inline void set_frame(kr_exact_form *exact, kr_quat left, kr_quat right)
{
    fill_frame(exact->frame, left, right);
    exact->framed = 1.0;
}
#endif
