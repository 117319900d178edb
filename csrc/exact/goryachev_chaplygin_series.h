/* Set-up of the functions of the torus angles, and of the heading, of a Goryachev-Chaplygin top.
 *
 * With the ratio rho of the rates of alpha2 and alpha1, the heading psi on a section alpha1 = a is
 * the real part of the sum of B_k(a) exp(i k alpha2). Its coefficients at the next section are
 * B_k(a + h) = exp(-i k rho h) (B_k(a) + the coefficient of the growth of psi from a to a + h). The
 * growth is computed by quadrature, from the same values of alpha2 for each section. As psi changes
 * its sign when alpha1 grows by 2 pi, and is even or odd in both angles together, sections from 0 to
 * pi suffice, and the real or imaginary part of B_k vanishes at alpha1 = pi. Its value at alpha1 = 0
 * follows from division by cos(k rho pi). If this divisor is small, B_k(0) = 0 instead, and psi
 * jumps at alpha1 = pi (kr_slow_term). The error of such a term grows linearly with time, but more
 * slowly than the effect of rounding the initial state.
 *
 * This header is compiled once for each instruction set. */
#ifndef KR_GORYACHEV_CHAPLYGIN_SERIES_H
#define KR_GORYACHEV_CHAPLYGIN_SERIES_H
#include "goryachev_chaplygin_curve.h"
#include "goryachev_chaplygin_state.h"

enum { LEAST_CELLS = 4 };
/* Terms of the heading below LEAST_TERM are left out. Terms with a divisor below LEAST_DIVISOR, or
 * with an amplitude above one radian, are slow. */
#define LEAST_TERM 6e-17
#define LEAST_DIVISOR 0.025

/* Intermediate results of the set-up. */
typedef struct series_work {
    cosine_table table;
    arc_samples samples;
    chaplygin_arc arc[2];
    double wave_at_node[CELL_TERMS][CELL_TERMS]; /* cos(k y) at the Chebyshev nodes */
    cx wave[MOST_SAMPLES];                       /* exp(-i pi j/n) for j = 0 ... n - 1 */
    cx fourier[MOST_SAMPLES];
    /* Points of the second arc for n values of alpha2, advanced to each node of a section. */
    arc_point second[MOST_SAMPLES][HEADING_NODES];
    double tail; /* largest relative size of the terms that are left out */
} series_work;

/* Computes the discrete Fourier transform of the n = 2^j numbers in w->fourier in place (Cooley and
 * Tukey 1965). */
static void transform(series_work *w, int n)
{
    cx *const v = w->fourier;
    for (int i = 1, j = 0; i < n; i++) {
        int bit = n / 2;
        for (; j & bit; bit /= 2) j ^= bit;
        j ^= bit;
        if (i < j) {
            const cx other = v[i];
            v[i] = v[j];
            v[j] = other;
        }
    }
    for (int half = 1; half < n; half *= 2)
        for (int from = 0; from < n; from += 2 * half)
            for (int k = 0; k < half; k++) {
                cx *const one = &v[from + k], *const two = one + half;
                const cx other = cx_mul(w->wave[n / half * k], *two);
                *two = cx_sub(*one, other);
                *one = cx_add(*one, other);
            }
}
/* A torus angle alpha of an arc, its variable x, d alpha/dx, and the sine and cosine of x/2. */
typedef struct arc_place {
    double alpha, x, slope, s, c;
} arc_place;

/* Moves to a place less than 1e-9 away from the given alpha, between 0 and pi, in x. Uses bracketed
 * Newton iteration. */
static void move_to(const chaplygin_arc *arc, const kr_chaplygin_arc *e, double alpha,
                    arc_place *at)
{
    const double ends = fabs(e->b[arc->low] * e->a[arc->high]);
    double low = 0.0, high = 0.5 * two_pi;
    for (int step = 0; step < 80; step++) {
        double products[2];
        at->x += (alpha - at->alpha) / at->slope;
        if (!(at->x >= low && at->x <= high)) at->x = 0.5 * (low + high);
        sincos_turns(dd_times(0.5 * at->x, one_turn()), &at->s, &at->c);
        const double s = at->s, c = at->c, D = e->C * (s * s) + c * c;
        arc_products(e, s * s, c * c, D, products);
        at->alpha = at->x + sum_arc_sines(arc, 0, 2.0 * s * c, c * c - s * s);
        at->slope = 0.5 * D * sqrt(e->C * ends / (products[0] * products[1])) / arc->p.hi;
        if (at->alpha > alpha)
            high = at->x;
        else
            low = at->x;
        if (fabs(alpha - at->alpha) < 1e-9 * at->slope) break;
    }
}
static void fill_chebyshev(series_work *w)
{
    for (int k = 0; k < CELL_TERMS; k++)
        for (int i = 0; i < CELL_TERMS; i++) {
            double unused;
            sincos_turns(dd_of(0.25 * k * (2 * i + 1) / CELL_TERMS), &unused,
                         &w->wave_at_node[k][i]);
        }
}
/* Computes the polynomials of a cell, beginning at its upper end if `is_falling`. Returns the larger
 * of their last coefficients, relative to a turn and to the time or q, by which the time increases
 * per radian of alpha on average. */
static double make_cell(const series_work *w, const chaplygin_arc *arc, const kr_chaplygin_arc *e,
                        int cell, int is_falling, arc_place *at, double out[])
{
    double value[2][CELL_TERMS], scale[2] = {1.0, arc->q.hi}, tail = 0.0;
    for (int k = 0; k < CELL_TERMS; k++) {
        const int i = is_falling ? k : CELL_TERMS - 1 - k;
        const double alpha = 0.5 * two_pi * (cell + 0.5 + 0.5 * w->wave_at_node[1][i]) / e->cells;
        move_to(arc, e, alpha, at);
        const double s = at->s, c = at->c, rest = alpha - at->alpha;
        value[0][i] = 0.5 * one_turn().hi * ((at->x - alpha) + rest / at->slope);
        value[1][i] = sum_arc_sines(arc, 1, 2.0 * s * c, c * c - s * s) +
                      rest * (arc->p.hi * point_of(e, s, c).size - arc->q.hi);
        scale[1] = fmax(scale[1], fabs(value[1][i]));
    }
    for (int j = 0; j < 2; j++)
        for (int k = 0; k < CELL_TERMS; k++) {
            double sum = 0.0;
            for (int i = 0; i < CELL_TERMS; i++) sum += value[j][i] * w->wave_at_node[k][i];
            *out++ = (k ? 2.0 : 1.0) / CELL_TERMS * sum;
            if (k >= CELL_TERMS - 2) tail = fmax(tail, fabs(2.0 / CELL_TERMS * sum) / scale[j]);
        }
    return tail;
}
/* Computes the functions of the torus angle of arc j. The cells become smaller until the last
 * coefficients are at rounding level. If they are below 1e-11, those of half a cell are below 1e-15
 * apart from rounding errors, so that it is halved only once. The singularities are nearest to the
 * end where |u| is largest, which comes first. Returns 0 if the last coefficients remain too
 * large. */
static int make_cells(kr_chaplygin_plan *plan, series_work *w, int j)
{
    const double end = j ? 0.5 * two_pi : 0.0;
    kr_chaplygin_arc *const e = &plan->arc[j];
    double tail = 1.0, before = 1.0;
    e->first = plan->first;
    for (e->cells = LEAST_CELLS; e->cells <= MOST_CELLS; e->cells *= 2) {
        arc_place at = {end, end, 1.0, 0.0, 1.0};
        before = tail;
        tail = 0.0;
        for (int i = 0; i < e->cells && tail < 1e-11; i++) {
            const int cell = j ? e->cells - 1 - i : i;
            double *const out = plan->term + e->first + 2 * CELL_TERMS * cell;
            tail = fmax(tail, make_cell(w, &w->arc[j], e, cell, j, &at, out));
        }
        if (tail < 4e-15 || before < 1e-11) break;
    }
    plan->first += 2 * CELL_TERMS * e->cells;
    w->tail = fmax(w->tail, tail);
    return e->cells <= MOST_CELLS && tail < 1e-13;
}
/* Fills the points of the second arc, and the waves of the Fourier transform. */
static void sample_second(const kr_chaplygin_plan *plan, series_work *w, int n)
{
    for (int i = 0; i < n; i++) {
        sincos_turns(dd_of(-0.5 * i / n), &w->wave[i].im, &w->wave[i].re);
        for (int g = 0; g < HEADING_NODES; g++) {
            const dd half =
                two_sum(0.5 * i / n, 0.25 * plan->ratio / plan->sections * gauss_node[g]);
            find_points(plan, 1, 1, &half, &w->second[i][g], NULL);
        }
    }
}
/* Computes the growth of the heading from a section to the next one for n values of alpha2. Returns
 * the largest Legendre coefficient of degree 7, which is about the square root of the error of the
 * quadrature. */
static double sample_section(const kr_chaplygin_plan *plan, series_work *w, int section, int n,
                             double growth[])
{
    const double h = 0.5 / plan->sections;
    double weight[HEADING_NODES], seventh[HEADING_NODES], most = 0.0;
    arc_point p[2], first[HEADING_NODES];
    for (int g = 0; g < HEADING_NODES; g++) {
        const double x = 2.0 * gauss_node[g] - 1.0, xx = x * x;
        const dd half = dd_of(0.5 * h * (section + gauss_node[g]));
        weight[g] = plan->span * h * gauss_weight[g];
        seventh[g] = 15.0 / 16.0 * x * (-35.0 + xx * (315.0 + xx * (-693.0 + xx * 429.0)));
        find_points(plan, 0, 0, &half, &first[g], NULL);
    }
    for (int i = 0; i < n; i++) {
        double highest = growth[i] = 0.0;
        for (int g = 0; g < HEADING_NODES; g++) {
            p[0] = first[g];
            p[1] = w->second[i][g];
            const double part = weight[g] * heading_rate(p);
            growth[i] += part;
            highest += seventh[g] * part;
        }
        most = fmax(most, fabs(highest));
    }
    return most;
}
/* Replaces n samples of a function of alpha2 by its coefficients of n/2 cosines and n/2 sines.
 * Returns the largest of the last eighth of them. */
static double transform_section(const kr_chaplygin_plan *plan, series_work *w, int n, double v[])
{
    double last = 0.0;
    for (int i = 0; i < n; i++)
        w->fourier[i] = cx_scale(v[i], plan->is_whole ? cx_of(1.0, 0.0) : w->wave[i]);
    transform(w, n);
    for (int k = 0; k < n / 2; k++) {
        const cx c = cx_scale((plan->is_whole && k == 0 ? 1.0 : 2.0) / n, w->fourier[k]);
        v[k] = c.re;
        v[n / 2 + k] = -c.im;
        if (16 * k >= 7 * n) last = fmax(last, fmax(fabs(c.re), fabs(c.im)));
    }
    return last;
}
/* Returns the phase [turns] of the term with index k after `way` turns of alpha1, for the same sum of
 * alpha2 and the angle that alpha2 grows by. */
static dd phase_after(const kr_chaplygin_plan *plan, dd ratio, int k, double way)
{
    const dd turns = dd_times(way * (k + 0.5 * !plan->is_whole), ratio);
    return dd_make(turns.hi - nearest(turns.hi), turns.lo);
}
/* Appends a slow term, which grows at alpha1 = pi by twice `miss`, the coefficient that should
 * vanish. `half` is half of alpha2 [turns] where alpha1 is pi. Returns 0 if there are too many. */
static int append_slow(kr_chaplygin_plan *plan, dd ratio, int k, double miss, dd half)
{
    if (plan->slow_terms == SLOW_TERMS) return 0;
    kr_slow_term *e = &plan->slow[plan->slow_terms++];
    double unused;
    const dd phase = dd_times(2 * k + !plan->is_whole, half);
    dd step = dd_plus(phase_after(plan, ratio, k, 1.0), 0.5);
    step.hi -= nearest(step.hi);
    e->value = 2.0 * miss;
    e->phase = (phase.hi - nearest(phase.hi)) + phase.lo + (plan->is_even ? 0.0 : 0.25);
    e->step = step.hi;
    e->step_more = step.lo;
    sincos_turns(dd_half(step), &e->sine, &unused);
    return 1;
}
/* Replaces the coefficients of the growths between sections by those of the heading on each section.
 * In complex numbers, they are the conjugates of B_k. Returns 0 if there are too many slow terms. */
static int sum_sections(kr_chaplygin_plan *plan, dd ratio, int n, dd half)
{
    plan->slow_terms = 0;
    for (int k = 0; k < n / 2; k++) {
        double *const re = plan->term + plan->first + k, *const im = re + n / 2;
        cx step, across, sum = cx_of(0.0, 0.0);
        sincos_turns(phase_after(plan, ratio, k, 0.5 / plan->sections), &step.im, &step.re);
        sincos_turns(phase_after(plan, ratio, k, 0.5), &across.im, &across.re);
        for (int at = 0; at < plan->sections * n; at += n)
            sum = cx_mul(step, cx_add(sum, cx_of(re[at], im[at])));
        const double miss = plan->is_even ? sum.im : sum.re;
        double start = 0.0;
        if (fabs(across.re) > fmax(LEAST_DIVISOR, fabs(miss)))
            start = -miss / across.re;
        else if (fabs(miss) > LEAST_TERM && !append_slow(plan, ratio, k, miss, half))
            return 0;
        sum = plan->is_even ? cx_of(0.0, start) : cx_of(start, 0.0);
        for (int at = 0; at < plan->sections * n; at += n) {
            const cx growth = cx_of(re[at], im[at]);
            re[at] = sum.re;
            im[at] = sum.im;
            sum = cx_mul(step, cx_add(sum, growth));
        }
    }
    return 1;
}
/* Leaves out the small last terms of all sections, whose length is n/2. */
static void pack_sections(kr_chaplygin_plan *plan, int n)
{
    double *const from = plan->term + plan->first;
    const int rows = 2 * plan->sections;
    plan->terms = 2;
    for (int at = 0; at < rows * n / 2; at++)
        if (at % (n / 2) >= plan->terms && fabs(from[at]) > LEAST_TERM)
            plan->terms = at % (n / 2) / 2 * 2 + 2;
    for (int j = 0; j < rows; j++)
        memmove(from + j * plan->terms, from + j * (n / 2), sizeof(double) * (size_t)plan->terms);
}
/* Computes the heading on sections of alpha1. The number of sections grows until the error of the
 * quadrature is negligible, and the number of samples until the last coefficients are. Returns 0 if
 * the memory does not suffice. `half` is half of alpha2 [turns] where alpha1 is pi. */
static int make_sections(kr_chaplygin_plan *plan, series_work *w, dd ratio, dd half)
{
    const int room = MOST_TERMS - plan->first;
    int n = 8 * plan->arc[1].cells < MOST_SAMPLES ? 8 * plan->arc[1].cells : MOST_SAMPLES;
    plan->sections = plan->arc[0].cells;
    while (n * plan->sections <= room) {
        double *const section = plan->term + plan->first, highest = 0.0, tail = 0.0;
        sample_second(plan, w, n);
        for (int j = 0; j < plan->sections; j++)
            highest = fmax(highest, sample_section(plan, w, j, n, section + j * n));
        if (highest > 2e-8) {
            plan->sections *= 2;
            continue;
        }
        for (int j = 0; j < plan->sections; j++)
            tail = fmax(tail, transform_section(plan, w, n, section + j * n));
        if (tail > 1e-16 && n < MOST_SAMPLES && 2 * n * plan->sections <= room) {
            n *= 2;
            continue;
        }
        w->tail = fmax(w->tail, tail);
        if (!sum_sections(plan, ratio, n, half)) return 0;
        pack_sections(plan, n);
        return tail < 1e-14;
    }
    return 0;
}
#endif
