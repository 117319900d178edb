/* State of a Kowalewski top at time t, computed from its closed-form solution. The code computes
 * the state at a single time, or at a different time in each vector lane. Scalar and vectorized
 * evaluations give bitwise equal results.
 *
 * This header is compiled once for each instruction set and number of lanes. */
#ifndef KR_KOWALEWSKI_STATE_H
#define KR_KOWALEWSKI_STATE_H
#include "kowalewski.h"
#include "torus_state.h"

/* Powers of exp(i theta1/2) and exp(i theta2/2), as real and imaginary parts. The power exp(i k
 * theta1/2) is stored at index k of re1 and im1. The power exp(i k theta2/2) is stored at index (k
 * + WIDE_MOST)/2 of re2 and im2. Powers with even and odd k are stored separately, so that each row
 * of coefficients uses contiguous powers. */
typedef struct wave_lanes {
    wide re1[WIDE_MOST + 1], im1[WIDE_MOST + 1];
    wide re2[2][WIDE_MOST + 1], im2[2][WIDE_MOST + 1];
} wave_lanes;

/* Computes the powers of c + i s up to the exponent `most`. To limit rounding errors, each power is
 * the product of two powers with nearly equal exponents. */
INLINE void fill_powers(wide s, wide c, int most, wide re[], wide im[])
{
    re[0] = wide_splat(1.0);
    im[0] = wide_splat(0.0);
    re[1] = c;
    im[1] = s;
    for (int k = 2; k <= most; k++) {
        const int a = k / 2, b = k - a;
        re[k] = re[a] * re[b] - im[a] * im[b];
        im[k] = re[a] * im[b] + im[a] * re[b];
    }
}
INLINE void fill_waves(const kr_theta_sums *plan, const dd phase[2], wave_lanes *w)
{
    wide s, c, re[WIDE_MOST + 1], im[WIDE_MOST + 1];
    sincos_turns(phase[0], &s, &c);
    fill_powers(s, c, plan->wide[0], w->re1, w->im1);
    sincos_turns(phase[1], &s, &c);
    fill_powers(s, c, plan->wide[1], re, im);
    for (int k = 0; k <= plan->wide[1]; k++) {
        const int up = (WIDE_MOST + k) / 2, down = (WIDE_MOST - k) / 2;
        w->re2[k & 1][up] = w->re2[k & 1][down] = re[k];
        w->im2[k & 1][down] = -im[k];
        w->im2[k & 1][up] = im[k];
    }
}
/* Powers of the growth factors exp(a1/4) and exp(a2/4) of the dual sums (kowalewski_dual.h). The
 * power exp(k a1/4) is stored at index k + WIDE_MOST of `one`. The power exp(k a2/4) is stored at
 * index (k + WIDE_MOST)/4 of the array two[k mod 4]. */
typedef struct growth_lanes {
    wide one[2 * WIDE_MOST + 1];
    wide two[4][WIDE_MOST / 2 + 1];
} growth_lanes;

/* Writes exp(k a) for |k| <= most to index k + WIDE_MOST of `out`. */
INLINE void fill_growth_powers(dd a, int most, wide out[])
{
    const exponential e = exponential_of(a);
    wide *const up = out + WIDE_MOST;
    up[0] = wide_splat(1.0);
    up[1] = e.plus * (e.even + e.odd);
    up[-1] = e.minus * (e.even - e.odd);
    for (int k = 2; k <= most; k++) {
        up[k] = up[k / 2] * up[k - k / 2];
        up[-k] = up[-(k / 2)] * up[k / 2 - k];
    }
}
/* Computes the powers of the growth factors exp(a1/4) and exp(a2/4). The array x contains half of
 * each torus angle, in turns. `bend` has the elements of 2 pi^2 B^-1. */
INLINE void fill_growth(const double bend[3], const int most[2], const dd x[2], growth_lanes *w)
{
    wide power[2 * WIDE_MOST + 1];
    const dd one = dd_add(dd_times(wide_splat(bend[0]), x[0]), dd_times(wide_splat(bend[1]), x[1])),
             two = dd_add(dd_times(wide_splat(bend[1]), x[0]), dd_times(wide_splat(bend[2]), x[1]));
    fill_growth_powers(one, most[0], w->one);
    fill_growth_powers(two, most[1], power);
    for (int k = -most[1]; k <= most[1]; k++)
        w->two[k & 3][(k + WIDE_MOST) / 4] = power[k + WIDE_MOST];
}
/* Evaluates a dual theta sum, whose coefficients are stored in an array that begins at `term`. The
 * coefficients of a complex sum are stored as pairs of real and imaginary parts. Returns a pointer
 * to the first double after the coefficients. */
INLINE const double *sum_dual_rows(const kr_sum_row *row, int rows, int is_complex,
                                   const double *term, const growth_lanes *w, wide *re, wide *im)
{
    wide sum_re = wide_splat(0.0), sum_im = wide_splat(0.0);
    for (int i = 0; i < rows; i++, row++) {
        const wide *y = &w->two[row->k2 & 3][(row->k2 + WIDE_MOST) / 4];
        const wide x = w->one[row->k1 + WIDE_MOST];
        wide u = wide_splat(0.0), v = wide_splat(0.0);
        if (is_complex)
            for (int k = 0; k < row->count; k++, term += 2) {
                u = u + term[0] * y[k];
                v = v + term[1] * y[k];
            }
        else
            for (int k = 0; k < row->count; k++) u = u + *term++ * y[k];
        sum_re = sum_re + x * u;
        sum_im = sum_im + x * v;
    }
    *re = sum_re;
    *im = sum_im;
    return term;
}
/* Evaluates all dual theta sums, and adds the contribution of the torus angles to the phase of the
 * factor e. */
INLINE void sum_dual(const kr_theta_sums *plan, const dd phase[2], dd *turn, wide re[], wide im[])
{
    growth_lanes w;
    dd x[2];
    const kr_sum_row *row = plan->row;
    const double *term = plan->term;
    for (int j = 0; j < 2; j++) {
        x[j] = dd_make(phase[j].hi - nearest(phase[j].hi), phase[j].lo);
        x[j] = two_sum_ordered(x[j].hi, x[j].lo);
        *turn = dd_add(*turn, dd_times(wide_splat(plan->twist[j]), x[j]));
    }
    fill_growth(plan->bend, plan->wide, x, &w);
    for (int i = 0; i < SUMS; i++) {
        term = sum_dual_rows(row, plan->rows[i], i < SUM_P, term, &w, &re[i], &im[i]);
        row += plan->rows[i];
    }
}
/* Evaluates a theta sum whose coefficients start at `term`. Returns a pointer to the first double
 * after the coefficients. */
INLINE const double *sum_rows(const kr_sum_row *row, int rows, const double *term,
                              const wave_lanes *w, wide *re, wide *im)
{
    wide sum_re = wide_splat(0.0), sum_im = wide_splat(0.0);
    for (int i = 0; i < rows; i++, term += row++->count) {
        const int k1 = row->k1, at = k1 < 0 ? -k1 : k1, from = (row->k2 + WIDE_MOST) / 2;
        const wide *x = &w->re2[row->k2 & 1][from], *y = &w->im2[row->k2 & 1][from];
        const wide a = w->re1[at], b = k1 < 0 ? -w->im1[at] : w->im1[at];
        wide u = wide_splat(0.0), v = wide_splat(0.0);
        for (int k = 0; k < row->count; k++) {
            u = u + term[k] * x[k];
            v = v + term[k] * y[k];
        }
        if (row->imaginary) {
            sum_re = sum_re - (u * b + v * a);
            sum_im = sum_im + (u * a - v * b);
        } else {
            sum_re = sum_re + (u * a - v * b);
            sum_im = sum_im + (u * b + v * a);
        }
    }
    *re = sum_re;
    *im = sum_im;
    return term;
}
INLINE void sum_all(const kr_theta_sums *plan, const dd phase[2], wide re[], wide im[])
{
    wave_lanes w;
    const kr_sum_row *row = plan->row;
    const double *term = plan->term;
    fill_waves(plan, phase, &w);
    for (int i = 0; i < SUMS; i++) {
        term = sum_rows(row, plan->rows[i], term, &w, &re[i], &im[i]);
        row += plan->rows[i];
    }
}
/* Returns the state at `time`, given half of each torus angle and the phase of e, all in turns. */
INLINE state_lanes kowalewski_kernel_at(const kr_theta_sums *plan, wide time, const dd phase[3])
{
    wide re[SUMS], im[SUMS], s, c;
    dd turn = phase[2];
    if (plan->dual)
        sum_dual(plan, phase, &turn, re, im);
    else
        sum_all(plan, phase, re, im);
    sincos_turns(turn, &s, &c);
    const wide S2 = re[SUM_S] * re[SUM_S] + im[SUM_S] * im[SUM_S],
               T2 = re[SUM_T] * re[SUM_T] + im[SUM_T] * im[SUM_T],
               n = 1.0 / wide_sqrt(0.5 * (S2 + T2)), half = 0.5 * n;
    /* alpha = i (S - T) e/2D, beta = (S + T) e/2D */
    const wide ar = -half * (im[SUM_S] - im[SUM_T]), ai = half * (re[SUM_S] - re[SUM_T]),
               br = half * (re[SUM_S] + re[SUM_T]), bi = half * (im[SUM_S] + im[SUM_T]);
    const quat_lanes q = {ar * c - ai * s, br * c - bi * s, br * s + bi * c, ar * s + ai * c};
    const wide unit = plan->torus.momentum * n, m1 = 2.0 * unit * re[SUM_P],
               m2 = 2.0 * unit * re[SUM_Q], m3 = unit * re[SUM_R];
    const wide xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z, ww = q.w * q.w;
    state_lanes r;
    r.t = time;
    r.m.x = ((ww + xx) - (yy + zz)) * m1 +
            2.0 * ((q.x * q.y - q.w * q.z) * m2 + (q.x * q.z + q.w * q.y) * m3);
    r.m.y = ((ww + yy) - (xx + zz)) * m2 +
            2.0 * ((q.x * q.y + q.w * q.z) * m1 + (q.y * q.z - q.w * q.x) * m3);
    r.m.z = ((ww + zz) - (xx + yy)) * m3 +
            2.0 * ((q.x * q.z - q.w * q.y) * m1 + (q.y * q.z + q.w * q.x) * m2);
    r.q = torus_attitude(&plan->torus, q);
    return r;
}
/* Returns the state at `time`, which is the initial time plus `span`. */
INLINE state_lanes kowalewski_kernel(const kr_theta_sums *plan, wide time, dd span)
{
    dd phase[3];
    for (int i = 0; i < 3; i++) phase[i] = torus_phase_at(&plan->torus, i, span);
    return kowalewski_kernel_at(plan, time, phase);
}
#endif
