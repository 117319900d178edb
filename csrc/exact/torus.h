/* Closed-form solutions for tops whose motion lies on an invariant torus (Kowalewski,
 * Goryachev-Chaplygin). The two angles that parametrize the torus grow at constant rates. A
 * structure of fixed size, called a plan, stores the data of a closed-form solution. This structure
 * begins with the members declared in kreisel.h and ends with the coefficients of the series. The
 * set-up of a closed-form solution needs working memory, which is placed directly after its
 * plan. */
#ifndef KR_EXACT_TORUS_H
#define KR_EXACT_TORUS_H
#include "kernel.h"

/* Members common to the solutions of Kowalewski and Goryachev-Chaplygin tops. */
typedef struct kr_torus {
    double begin;    /* [T] */
    double momentum; /* unit of momentum [M L^2 T^-1] */
    kr_quat frame;   /* frame of description -> axes of the closed form */
    /* The phases of half of each torus angle and, for a Kowalewski top, of half of the heading.
     * For a Goryachev-Chaplygin top, the third phase is zero. */
    kr_phase turn[3];
} kr_torus;

/* Lower limit of every certificate: a tenth of the largest rounding error of a state that was
 * found within 300 radians, in random and degenerate motions. */
#define KR_TORUS_ROUNDING 0x1p-48

/* Returns the i-th phase, in turns, at the time `span` after the initial time. */
INLINE dd torus_phase_at(const kr_torus *torus, int i, dd span)
{
    const kr_phase *p = &torus->turn[i];
    const phase_lanes phase = {wide_splat(p->fast), wide_splat(p->slow), wide_splat(p->start),
                               wide_splat(p->more)};
    return phase_at(&phase, span);
}
/* Returns the fractional part of an angle in turns, or NaN if the angle is not finite. */
INLINE double fraction_of_turns(double turns)
{
    return isfinite(turns) ? turns - floor(turns) : NAN;
}
/* Returns t minus the initial time, or 0 if t is not finite or too large for the phases to be
 * computed. If the result is 0, the caller evaluates the solution at the initial time, where at
 * least the integrals of motion are correct. */
INLINE dd torus_span(const kr_torus *torus, wide t)
{
    const dd span = two_sum(t, wide_splat(-torus->begin));
    const wide most = wide_splat(0x1p50);
    mask within = wide_less(wide_abs(span.hi), wide_splat(longest));
    for (int i = 0; i < 3; i++)
        within = mask_and(within, wide_less(wide_abs(span.hi * torus->turn[i].fast), most));
    return dd_choose(within, span, dd_of(wide_splat(0.0)));
}
/* Converts an attitude from the axes of the closed-form solution to the user's axes. */
INLINE quat_lanes torus_attitude(const kr_torus *torus, quat_lanes q)
{
    const kr_quat f = torus->frame;
    quat_lanes r;
    r.w = (q.w * f.w - q.x * f.x) - (q.y * f.y + q.z * f.z);
    r.x = (q.w * f.x + q.x * f.w) + (q.y * f.z - q.z * f.y);
    r.y = (q.w * f.y - q.x * f.z) + (q.y * f.w + q.z * f.x);
    r.z = (q.w * f.z + q.x * f.y) + (q.z * f.w - q.y * f.x);
    return r;
}
#if defined KR_EXACT_LANES
/* Loads one time of the array t into each SIMD lane. If there are fewer times than SIMD lanes, the
 * remaining lanes are filled with the first time. */
INLINE wide load_time_lanes(size_t n, const double t[])
{
    double times[LANES];
    for (size_t i = 0; i < LANES; i++) times[i] = t[i < n ? i : 0];
    return wide_load(times);
}
/* Writes the states in the first n SIMD lanes, or in all lanes if there are fewer than n. States at
 * non-finite times are set to NaN. */
INLINE void store_state_lanes(const state_lanes *s, size_t n, kr_state out[])
{
    double rows[8][LANES];
    memcpy(rows, s, sizeof rows);
    for (size_t i = 0; i < LANES && i < n; i++) {
        const double none = isfinite(rows[0][i]) ? -0.0 : NAN; /* -0: x + -0 is x, also for -0 */
        out[i].t = rows[0][i];
        out[i].q =
            q4(rows[1][i] + none, v3(rows[2][i] + none, rows[3][i] + none, rows[4][i] + none));
        out[i].m = v3(rows[5][i] + none, rows[6][i] + none, rows[7][i] + none);
    }
}
#endif
#endif
