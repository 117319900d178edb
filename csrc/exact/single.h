/* The closed form of one top: its states, and motions without a nutation. This header is
 * source that is compiled once per instruction set, because its double-doubles want the fused
 * product. */
#ifndef KR_EXACT_SINGLE_H
#define KR_EXACT_SINGLE_H
#include "frame.h"
#include "phase.h"

/* Returns the state `span` after the beginning, as one at time t. Each kind of series calls the
 * kernel with constants, so that the compiler leaves out what that kind does not need. */
static inline kr_state state_after(const kr_exact *e, double t, dd span)
{
    kr_state r;
    switch (e->curve) {
    case LAGRANGE:
        r = kernel(e, 0, 0, t, span);
        break;
    case EULER:
        r = kernel(e, 0, 1, t, span);
        break;
    case LAGRANGE_DUAL:
        r = kernel(e, 1, 0, t, span);
        break;
    default:
        r = kernel(e, 1, 1, t, span);
        break;
    }
    if (e->framed) r.q = framed(e->frame, r.q);
    return r;
}
/* Returns the state at a time that is too late for the kernel: that of the beginning, which has
 * every integral. There is none at a time that is not finite. */
static inline kr_state state_beyond(const kr_exact *e, double t)
{
    const kr_state none = {t, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    return isfinite(t) ? state_after(e, t, dd_of(0.0)) : none;
}
/* Returns the state at time t. */
static inline kr_state state_at(const kr_exact *e, double t)
{
    const dd span = two_sum(t, -e->begin);
    return is_within(e, span.hi) ? state_after(e, t, span) : state_beyond(e, t);
}

/* Sets a motion up in which alpha and beta keep their size and turn at constant rates: that of a
 * top which sleeps, hangs or rests, or of a symmetric body without torque. */
static inline void steady_closed_form(kr_exact *exact, kr_quat q, dd first, dd second)
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
    /* Where the axis is vertical, the whole turn counts as spin. */
    exact->precession = a > 0.0 && b > 0.0 ? first.hi + second.hi : 0.0;
    exact->spin = b == 0.0 ? 2.0 * first.hi : a == 0.0 ? -2.0 * second.hi : first.hi - second.hi;
}
/* Puts the closed form into the frame q -> left q right. */
static inline void set_frame(kr_exact *exact, kr_quat left, kr_quat right)
{
    fill_frame(exact->frame, left, right);
    exact->framed = 1;
}
#endif
