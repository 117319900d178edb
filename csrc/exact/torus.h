/* The common part of the closed forms of Kowalewski and Goryachev-Chaplygin tops and of free
 * gyrostats. A motion covers an invariant torus, on which two angles grow at constant rates. A plan
 * contains the numbers of one motion: it is a struct of fixed size that begins with a kr_torus. The
 * axes of a closed form are body axes. The user's axes are the frame of description (kreisel.h). e3
 * is the upward vertical. */
#ifndef KR_EXACT_TORUS_H
#define KR_EXACT_TORUS_H
#include "kernel.h"

typedef struct kr_torus {
    double begin;    /* [T] */
    double momentum; /* unit of momentum [M L^2 T^-1] */
    kr_quat frame;   /* user's axes -> axes of the closed form */
    /* Phases [turns], linear in time. Kowalewski top (kowalewski.h): theta1/2, theta2/2, and the
     * linear part of half of the heading. Goryachev-Chaplygin top (goryachev_chaplygin.h): halves
     * of both mean angles, and 0. Free gyrostat (kr_gyrostat_plan): `first`, `second`, and 0. */
    kr_phase turn[3];
} kr_torus;

/* The smallest value of kr_exact_info.certificate, a tenth of a bound on the attitude error: in
 * tests of random and degenerate motions, rounding errors were up to 10 * KR_TORUS_ROUNDING. */
#define KR_TORUS_ROUNDING 0x1p-48

/* Returns the i-th phase, in turns, at the time `span` after the initial time. */
INLINE dd find_torus_phase(const kr_torus *torus, int i, dd span)
{
    const kr_phase *p = &torus->turn[i];
    const phase_lanes phase = {wide_splat(p->fast), wide_splat(p->slow), wide_splat(p->start),
                               wide_splat(p->more)};
    return evaluate_phase(&phase, span);
}
/* Returns the fractional part of an angle in turns, or NaN if the angle is not finite. */
INLINE double fraction_of_turns(double turns)
{
    return isfinite(turns) ? turns - floor(turns) : NAN;
}
/* Returns the time t - torus->begin. If |t - torus->begin| is 2^990 or more, or if a phase would
 * change by 2^50 turns or more, returns 0: the initial state is computed instead. */
INLINE dd find_elapsed_time(const void *plan, wide t)
{
    const kr_torus *torus = plan;
    const dd span = two_sum(t, wide_splat(-torus->begin));
    const wide most = wide_splat(0x1p50);
    mask within = wide_less(wide_abs(span.hi), wide_splat(longest));
    for (int i = 0; i < 3; i++)
        within = mask_and(within, wide_less(wide_abs(span.hi * torus->turn[i].fast), most));
    return dd_choose(within, span, dd_of(wide_splat(0.0)));
}
/* Turns the attitude q (axes of the closed form -> space) about e3 by an angle, given the sine and
 * cosine of half of this angle. Returns the new attitude (user's axes -> space). */
INLINE quat_lanes turn_and_convert_attitude(const kr_torus *torus, wide half_sine, wide half_cosine,
                                            quat_lanes q)
{
    const kr_quat f = torus->frame;
    const wide s = half_sine, c = half_cosine;
    const wide w = c * q.w - s * q.z, x = c * q.x - s * q.y, y = c * q.y + s * q.x,
               z = c * q.z + s * q.w;
    quat_lanes r;
    r.w = (w * f.w - x * f.x) - (y * f.y + z * f.z);
    r.x = (w * f.x + x * f.w) + (y * f.z - z * f.y);
    r.y = (w * f.y - x * f.z) + (y * f.w + z * f.x);
    r.z = (w * f.z + x * f.y) + (z * f.w - y * f.x);
    return r;
}
/* Returns the state at `time`, the initial time plus `span`. `plan` begins with a kr_torus. */
typedef state_lanes torus_kernel(const void *plan, wide time, dd span);
#if defined KR_EXACT_LANES
/* Writes the states at the n times t[] to out[]. Each call of `kernel` computes LANES states; if
 * fewer times are left, a time is repeated. Attitude and momentum are NaN if t is not finite. */
INLINE void evaluate_torus(torus_kernel *kernel, const void *plan, size_t n, const double t[],
                           kr_state out[])
{
    for (size_t from = 0; from < n; from += LANES) {
        double row[8][LANES];
        for (size_t i = 0; i < LANES; i++) row[0][i] = t[from + i < n ? from + i : from];
        const wide time = wide_load(row[0]);
        const state_lanes s = kernel(plan, time, find_elapsed_time(plan, time));
        memcpy(row, &s, sizeof row);
        for (size_t i = 0; i < LANES && from + i < n; i++) {
            kr_state *to = &out[from + i];
            const double none = isfinite(row[0][i]) ? -0.0 : NAN; /* -0: x + -0 is x, also for -0 */
            to->t = row[0][i];
            to->q = q4(row[1][i] + none, v3(row[2][i] + none, row[3][i] + none, row[4][i] + none));
            to->m = v3(row[5][i] + none, row[6][i] + none, row[7][i] + none);
        }
    }
    wide_zero_upper();
}
#else
/* Returns the state at the time t, or NaN if t is not finite. */
INLINE kr_state evaluate_torus(torus_kernel *kernel, const void *plan, double t)
{
    const kr_state none = {t, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    return isfinite(t) ? kernel(plan, t, find_elapsed_time(plan, t)) : none;
}
#endif

/* The closed form of a free gyrostat. The angles `first` and `second` [turns] grow at constant
 * rates. X and Y are polynomials in u = e^{2 pi i first}. The attitude is a linear map `map` of
 * q = (w, x, y, z) with (w + i z, x + i y) = e^{2 pi i second} (X(u), Y(u)) / sqrt(|X|^2 + |Y|^2).
 * In free_gyrostat.c, X and Y include a factor u^least; here, e^{2 pi i second} includes it. */
enum { GYROSTAT_TERMS = 48 };
typedef struct kr_gyrostat_plan {
    kr_torus torus; /* turn[0] and turn[1] are the phases `first` and `second` */
    double least;   /* e^{i second} includes u^least, so that all exponents of u are >= 0 */
    kr_vec3 momentum;
    kr_quat map[4]; /* the attitude is q.w map[0] + q.x map[1] + q.y map[2] + q.z map[3] */
    double terms;
    double coefficient[GYROSTAT_TERMS][4]; /* real and imaginary parts in X and in Y */
} kr_gyrostat_plan;

INLINE state_lanes gyrostat_state_at_phases(const kr_gyrostat_plan *plan, wide time, dd first,
                                            dd second)
{
    const int terms = (int)plan->terms;
    wide s, c, sum[4];
    sincos_turns(first, &s, &c);
    for (int i = 0; i < 4; i++) sum[i] = wide_splat(plan->coefficient[terms - 1][i]);
    for (int k = terms - 2; k >= 0; k--)
        for (int i = 0; i < 4; i += 2) {
            const wide re = sum[i] * c - sum[i + 1] * s, im = sum[i] * s + sum[i + 1] * c;
            sum[i] = plan->coefficient[k][i] + re;
            sum[i + 1] = plan->coefficient[k][i + 1] + im;
        }
    const wide n =
        1.0 / wide_sqrt((sum[0] * sum[0] + sum[1] * sum[1]) + (sum[2] * sum[2] + sum[3] * sum[3]));
    sincos_turns(second, &s, &c);
    const wide p[4] = {n * (sum[0] * c - sum[1] * s), n * (sum[2] * c - sum[3] * s),
                       n * (sum[2] * s + sum[3] * c), n * (sum[0] * s + sum[1] * c)};
    const kr_quat *map = plan->map;
    const quat_lanes q = {(p[0] * map[0].w + p[1] * map[1].w) + (p[2] * map[2].w + p[3] * map[3].w),
                          (p[0] * map[0].x + p[1] * map[1].x) + (p[2] * map[2].x + p[3] * map[3].x),
                          (p[0] * map[0].y + p[1] * map[1].y) + (p[2] * map[2].y + p[3] * map[3].y),
                          (p[0] * map[0].z + p[1] * map[1].z) +
                              (p[2] * map[2].z + p[3] * map[3].z)};
    const kr_vec3 m = plan->momentum;
    return (state_lanes){time, q, {wide_splat(m.x), wide_splat(m.y), wide_splat(m.z)}};
}
INLINE state_lanes gyrostat_state_after_span(const void *memory, wide time, dd span)
{
    const kr_gyrostat_plan *plan = memory;
    return gyrostat_state_at_phases(plan, time, find_torus_phase(&plan->torus, 0, span),
                                    find_torus_phase(&plan->torus, 1, span));
}
#endif
