/* The extreme nutation angles of a top, and the precession at these angles. With m3 = <m, e3>, c =
 * <m, apex> and the nutation th
 *     E = I1 th'^2/2 + U(th),   U = (m3 - c cos th)^2 / (2 I1 sin^2 th) + c^2/2 I3 + lever cos th,
 * where (m3 - c cos th)/sin th = ((m3 + c) tan th/2 + (m3 - c) cot th/2) / 2 loses no digits near a
 * pole. An axial rotor with the momentum h replaces c^2/2 I3 by (c - h)^2/2 I3. For a torque-free
 * body, u3 is infinite, but only the product g u3 is used. This header is compiled once for each
 * instruction set, because double-doubles are faster with fused multiply-add. */
#ifndef KR_EXACT_NUTATION_H
#define KR_EXACT_NUTATION_H
#include "lagrange.h"

/* Types of motion. Quantities are considered equal if they agree within KR_INPUT_RTOL. For angles,
 * the tolerance is measured in radians. For a precession rate or a momentum, the tolerance is
 * relative to the magnitude of the terms in its formula. */
enum motion_type {
    RESTING,    /* no torque, and the apex rests */
    CIRCLE,     /* no torque: a circle about the angular momentum */
    SLEEPING,   /* upright against gravity */
    HANGING,    /* straight down */
    STEADY,     /* precession without nutation */
    SEPARATRIX, /* reaches the upright position in infinite time */
    PENDULUM,   /* in a vertical plane, swinging or circling */
    ROSETTE,    /* passes through the vertical, above or below */
    LOOPS,      /* precesses in opposite senses at the highest and lowest points */
    CUSPS,      /* does not precess at the highest point */
    WAVES       /* precesses in one sense */
};
static const char *const motion_type_names[] = {"resting", "circle",     "sleeping", "hanging",
                                                "steady",  "separatrix", "pendulum", "rosette",
                                                "loops",   "cusps",      "waves"};

/* Returns the nutation angle for the height u, given 1 - u and 1 + u. Values of 1 - u and 1 + u of
 * at most 2e-36 count as zero, because the function `sharpen` replaces values below 1e-36 with
 * 1e-36. */
static double turning_angle(dd minus, dd plus)
{
    const double least = 2e-36, low = minus.hi > least ? minus.hi : 0.0,
                 high = plus.hi > least ? plus.hi : 0.0;
    return 2.0 * atan2(sqrt(low), sqrt(high));
}
/* Returns the sign of the precession rate at the height u, given 1 - u and 1 + u. Returns 0 if the
 * magnitude of the precession rate is at most `tol` times the sum of the absolute values of its
 * terms. */
static int precession_sign(const initial *s, dd minus, dd plus, double tol)
{
    const dd one = dd_mul(s->sum, minus), two = dd_mul(s->difference, plus);
    const double all = dd_add(one, two).hi, size = fabs(one.hi) + fabs(two.hi);
    return fabs(all) <= tol * size ? 0 : all < 0.0 ? -1 : 1;
}
/* Returns the type of motion of a heavy top, given its smallest and largest nutation angles.
 * Gravity must point downwards. */
static enum motion_type heavy_motion_type(const initial *s, const turning_points *r, double least,
                                          double greatest)
{
    const double pi = 3.14159265358979323846, tol = KR_INPUT_RTOL,
                 size = tol * sqrt(s->w_square.hi + s->g.hi);
    if (greatest - least <= tol)
        return greatest <= tol ? SLEEPING : pi - least <= tol ? HANGING : STEADY;
    if (least <= tol && r->g32.hi <= tol * r->g31.hi) return SEPARATRIX;
    if (fabs(s->sum.hi) <= size && fabs(s->difference.hi) <= size) return PENDULUM;
    if (least <= tol || pi - greatest <= tol) return ROSETTE;
    const int high = precession_sign(s, r->minus2, r->plus2, tol),
              low = precession_sign(s, r->minus1, r->plus1, 0.0);
    return high == 0 ? CUSPS : high == low ? WAVES : LOOPS;
}
static enum motion_type free_motion_type(const initial *s)
{
    const dd axial = dd_half(dd_sub(s->sum, s->difference));
    const dd across = dd_sqrt(dd_sub(s->w_square, dd_square(axial)));
    return across.hi <= KR_INPUT_RTOL * sqrt(s->w_square.hi) ? RESTING : CIRCLE;
}
/* Writes the earliest nonnegative times at which the apex of the top reaches its lowest and its
 * highest point. */
static void turning_times(const initial *s, const turning_points *r, double *low, double *high)
{
    const double kp = sqrt(r->g32.hi / r->g31.hi);
    const dd mean = elliptic_mean(dd_of(kp), 0, NULL, NULL), here = phase_at_start(r, mean.hi);
    const dd rise = dd_sub(dd_of(0.25), here);
    const double turn = 2.0 * two_pi / (sqrt(r->g31.hi) * mean.hi);
    const int falls = s->climb.hi < 0.0;
    *low = turn * (falls || here.hi <= 0.0 ? here.hi : dd_sub(dd_of(0.5), here).hi);
    *high = turn * (!falls || rise.hi <= 0.0 ? rise.hi : dd_add(dd_of(0.25), here).hi);
    if (kp <= 1e-74) *high = INFINITY;
    if (kp <= 1e-74 && !falls && here.hi > 0.0) *low = INFINITY;
}
/* Sets the members of kr_nutation_form that do not depend on the turning points, in internal units,
 * and sets both extreme angles to the initial nutation.
 * Gravity must point downwards. The argument `rotor` is the momentum of an axial rotor divided by
 * I3. */
static kr_nutation_form turning_of_body(const exact_top *top, const initial *s, dd i1, double rotor)
{
    kr_nutation_form r = {0};
    const double axial = i1.hi * dd_half(dd_sub(s->sum, s->difference)).hi;
    r.inertia = i1.hi;
    r.sum = i1.hi * s->sum.hi;
    r.difference = i1.hi * s->difference.hi;
    const double own = axial - rotor * top->inertia.z;
    r.axial_energy = own * own / (2.0 * top->inertia.z);
    r.lever = top->lever.hi;
    r.critical_spin = 2.0 * sqrt(i1.hi * top->lever.hi) / top->inertia.z;
    r.least = r.greatest = turning_angle(s->minus, s->plus);
    return r;
}
/* Returns the turning points, in internal units, of a top whose weight * com along its axis is
 * nonnegative. Times are measured from the initial time. The argument `rotor` is the momentum of an
 * axial rotor divided by I3. */
static kr_nutation_form turning_downwards(const exact_top *top, double rotor)
{
    const dd i1 = dd_half(two_sum(top->inertia.x, top->inertia.y));
    const initial s = initial_of(top, i1);
    const int free = s.g.hi == 0.0;
    kr_nutation_form r = turning_of_body(top, &s, i1, rotor);
    if (free ? free_motion_type(&s) == RESTING : is_resting_at_pole(&s)) {
        r.motion_type = motion_type_names[free ? RESTING : s.a[2].hi > 0.0 ? SLEEPING : HANGING];
        return r;
    }
    const turning_points heights = turning_heights(&s);
    r.least = turning_angle(heights.minus2, heights.plus2);
    r.greatest = turning_angle(heights.minus1, heights.plus1);
    r.motion_type =
        motion_type_names[free ? CIRCLE : heavy_motion_type(&s, &heights, r.least, r.greatest)];
    if (r.greatest - r.least > KR_INPUT_RTOL)
        turning_times(&s, &heights, &r.t_greatest, &r.t_least);
    return r;
}
static void swap_doubles(double *a, double *b)
{
    const double c = *a;
    *a = *b;
    *b = c;
}
/* Converts turning points to the correct orientation if they were computed with up and down
 * interchanged. */
static void flip_turning(kr_nutation_form *r)
{
    const double pi = 3.14159265358979323846, least = pi - r->greatest;
    r->greatest = pi - r->least;
    r->least = least;
    swap_doubles(&r->t_least, &r->t_greatest);
    swap_doubles(&r->sum, &r->difference);
    r->sum = -r->sum;
    r->difference = -r->difference;
    r->lever = -r->lever;
}
/* Converts turning points from internal units to the user's units. */
static void turning_to_user(kr_nutation_form *r, const kr_units *units, double start)
{
    const double momentum = units->moment / units->time, energy = momentum / units->time;
    r->t_least = start + units->time * r->t_least;
    r->t_greatest = start + units->time * r->t_greatest;
    r->critical_spin /= units->time;
    r->inertia *= units->moment;
    r->sum *= momentum;
    r->difference *= momentum;
    r->axial_energy *= energy;
    r->lever *= energy;
}
#endif
