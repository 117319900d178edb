/* Set-up of the closed form of a Goryachev-Chaplygin top, whose states goryachev_chaplygin.h
 * computes. This file is compiled once for each instruction set, because double-double products are
 * three times as fast with fused multiply-add.
 *
 * Units and axes: The moments are (1, 1, 1/4), and mass * |gravity| * |com| = 1. Axis 1 points
 * towards the centre of mass if gravity is positive, and away from it otherwise. Axis 3 is the
 * principal axis with moment 1/4, directed such that the integral G below is not negative. With
 * the momentum L and the upward vertical g = e3 in the body frame, and <L, g> = 0,
 *     H = (L1^2 + L2^2 + 4 L3^2)/2 + g1,  G = L3 (L1^2 + L2^2) - L1 g3,
 *     p+-(u) = 2 u^3 - (H +- 1) u - G/2,
 *     u exp(i chi) = (g1 u - L1 g3/2) + i (L2 g3/2 - g2 u)  with an angle chi.
 * Chaplygin's variables u1 > 0 > u2 are the roots of u^2 - L3 u - (L1^2 + L2^2)/4. Each moves on an
 * arc between two roots of p+ p-, with du/d tau = +-sqrt(-p+ p-) in the time d tau = dt/|L| (S. A.
 * Chaplygin, 1901). On an arc, with constants A, B and C,
 *     u = N/D,  N = A sin^2 + B cos^2,  D = C sin^2 + cos^2  of half of an angle x.
 * Then du/sqrt(-p+ p-) = P dx, where P is an even periodic function of x. The torus angle alpha of
 * an arc is x plus a sine series in x, and grows linearly with tau. The time t is a multiple of tau
 * plus a periodic function of each alpha.
 *
 * The heading psi (goryachev_chaplygin.h) is the angle of the horizontal vector L. Let rho be the
 * rate of alpha2 divided by the rate of alpha1. On the section (line) alpha1 = a, psi is the real
 * part of the sum of psi_k(a) exp(i k alpha2), with all integers or all half-integers k >= 0. On
 * the next section, alpha1 = a + h, the coefficients are
 *     psi_k(a + h) = exp(-i k rho h) (psi_k(a) + change_k),
 * where change_k are the coefficients of the change of psi between the two sections. This change is
 * computed by quadrature, for the same values of alpha2 on each section. Sections from 0 to pi
 * suffice: psi changes its sign when alpha1 grows by 2 pi, and is an even or an odd function of the
 * two angles. For the same reasons, the real or the imaginary part of psi_k(pi) is zero. This
 * condition determines psi_k(0) after a division by cos(k rho pi). If this divisor is small, the
 * term k is slow (kr_slow_term): psi_k(0) is set to 0, and the series jumps at alpha1 = pi. Errors
 * of slow terms grow linearly in time, but slower than the effect of rounding the initial state. */
#include "goryachev_chaplygin.h"
enum { GRID = 2048 };
#include "torus_setup.h"

/* The constants of a motion, and its branch points: the roots of p+ have the indices 0, 1 and 2,
 * and the roots of p- have the indices 3, 4 and 5. */
enum { CURVE_ROOTS = 6 };
typedef struct chaplygin_curve {
    dd H, G;
    int pair; /* 1 if roots 4 and 5 are complex: root[4] +- i root[5] */
    dd root[CURVE_ROOTS];
    int order[CURVE_ROOTS], real; /* indices of the real roots, ascending; their number */
} chaplygin_curve;

/* An arc from the root `high` at x = 0 to the root `low` at x = pi. */
typedef struct chaplygin_arc {
    const chaplygin_curve *curve;
    dd A, B, C;
    int low, high;
    /* N - root D = a sin^2 + b cos^2 of x/2; the real part replaces a complex root. */
    dd a[CURVE_ROOTS], b[CURVE_ROOTS];
    dd p, q;           /* averages of P and |u| P over x */
    int points, terms; /* numbers of intervals used, and of significant terms of the series */
    /* Coefficients of sin(k x) in alpha - x and in the periodic part of t. */
    double sine[2][GRID];
} chaplygin_arc;

/* Sets the branch points. Returns KR_REFUSAL_NONE, or the reason for a failure. */
static kr_refusal find_branch_points(chaplygin_curve *o)
{
    double gap[2]; /* (half the difference of the last two roots / root[0])^2, for p+ and p- */
    for (int j = 0; j < 2; j++) {
        dd *const root = o->root + 3 * j;
        const cubic half = {dd_of(0.0), dd_scale(-0.5, dd_plus(o->H, j ? -1.0 : 1.0)),
                            dd_scale(0.25, o->G)};
        o->pair = find_cubic_roots(&half, root);
        const double far = (o->pair ? root[2].hi : 0.5 * dd_sub(root[2], root[1]).hi) / root[0].hi;
        gap[j] = o->pair ? -far * far : far * far;
    }
    /* gap[j] (for p+, p-) is negative if the last two roots are complex. Its error is about 1e-31.
     * gap[1] has a larger limit than gap[0], because the frequencies depend on log |gap[1]|. */
    if (!(gap[0] > 1e-20)) return gap[0] > -1e-20 ? KR_REFUSAL_COINCIDENT : KR_REFUSAL_START;
    if (!(fabs(gap[1]) > 1e-15)) return KR_REFUSAL_SEPARATRIX;
    o->real = sort_real_roots(o->root, CURVE_ROOTS, o->pair ? 4 : CURVE_ROOTS, o->order);
    return KR_REFUSAL_NONE;
}
static dd ordered_root(const chaplygin_curve *o, int i) { return o->root[o->order[i]]; }

/* Sets up the arc between the real roots o->order[low] and o->order[low + 1]: A, B, C, a and b of
 * chaplygin_arc. At certain complex x, u reaches the next real root on either side, cyclically. C
 * puts these x as far from the real axis as possible: series in x converge fast. */
static void make_arc(const chaplygin_curve *o, int low, chaplygin_arc *arc)
{
    const int n = o->real;
    arc->curve = o;
    arc->low = o->order[low];
    arc->high = o->order[low + 1];
    const dd from = o->root[arc->low], to = o->root[arc->high],
             below = ordered_root(o, (low + n - 1) % n), above = ordered_root(o, (low + 2) % n);
    const dd up = dd_mul(dd_sub(to, below), dd_sub(to, above)),
             down = dd_mul(dd_sub(below, from), dd_sub(above, from));
    arc->C = dd_sqrt(dd_abs(dd_div(up, down)));
    arc->A = dd_mul(from, arc->C);
    arc->B = to;
    for (int i = 0; i < CURVE_ROOTS; i++) {
        arc->a[i] = dd_mul(arc->C, dd_sub(from, o->root[i]));
        arc->b[i] = dd_sub(to, o->root[i]);
    }
}
/* Sets up the arcs of Chaplygin's variables. Returns 0 if an initial value u is outside its arc. */
static int make_arcs(const chaplygin_curve *o, const dd u[2], chaplygin_arc arc[2])
{
    const int lower =
        o->real == 4 || u[1].hi < 0.5 * (ordered_root(o, 1).hi + ordered_root(o, 2).hi);
    make_arc(o, o->real - 2, &arc[0]);
    make_arc(o, lower ? 0 : 2, &arc[1]);
    for (int j = 0; j < 2; j++) {
        const double slack = 1e-25 * (1.0 + fabs(u[j].hi));
        if (!(dd_sub(u[j], o->root[arc[j].low]).hi >= -slack) ||
            !(dd_sub(o->root[arc[j].high], u[j]).hi >= -slack))
            return 0;
    }
    return 1;
}
/* Returns P, and writes |u| to `abs_u`. ss and cc are the squares of sin(x/2) and cos(x/2). */
static dd find_dx_factor_and_abs_u(const chaplygin_arc *arc, dd ss, dd cc, dd *abs_u)
{
    const chaplygin_curve *o = arc->curve;
    const dd D = dd_add(dd_mul(arc->C, ss), cc);
    dd product = dd_of(1.0);
    for (int i = 0; i < CURVE_ROOTS - o->pair; i++) {
        if (i == arc->low || i == arc->high) continue;
        dd factor = add_products(arc->a[i], ss, arc->b[i], cc);
        if (o->pair && i == 4) factor = dd_add(dd_square(factor), dd_square(dd_mul(o->root[5], D)));
        product = dd_mul(product, factor);
    }
    *abs_u = dd_abs(dd_div(add_products(arc->A, ss, arc->B, cc), D));
    return dd_half(dd_mul(D, dd_sqrt(dd_div(arc->C, dd_abs(product)))));
}
/* Fills an arc of the plan, except for its Chebyshev coefficients, its sign and its rate. */
static void fill_plan_arc(const chaplygin_arc *arc, kr_chaplygin_arc *out)
{
    const chaplygin_curve *o = arc->curve;
    out->A = fabs(arc->A.hi);
    out->B = fabs(arc->B.hi);
    out->C = arc->C.hi;
    out->pair = o->pair;
    out->imaginary = o->pair ? o->root[5].hi : 0.0;
    for (int i = 0; i < CURVE_ROOTS; i++) {
        out->a[i] = i == arc->low ? arc->b[i].hi : arc->a[i].hi;
        out->b[i] = i == arc->high ? arc->a[i].hi : arc->b[i].hi;
    }
    if (o->pair) out->a[5] = out->b[5] = 1.0;
    for (int k = 0; k < 2; k++) {
        out->has_sine[k] = arc->high / 3 == k;
        out->has_cosine[k] = arc->low / 3 == k;
    }
}
/* Writes the integrands P and |u| P at the angle x with the cosine t->c[i]. */
static void sample_integrands(const void *arc, const cosine_table *t, int i, dd out[3])
{
    const dd c = dd_half(dd_plus(t->c[i], 1.0)), s = dd_half(dd_sub(dd_of(1.0), t->c[i]));
    dd size;
    out[0] = find_dx_factor_and_abs_u(arc, s, c, &size);
    out[1] = dd_mul(out[0], size);
}
/* Sets the averages and the sine series of an arc. Returns 0 if the averages do not converge. */
static int find_averages_and_sines(chaplygin_arc *arc, cosine_table *table, samples *v)
{
    const double floor[3] = {0.0, 0.0, 0.0};
    dd mean[3];
    const int n = average_functions(sample_integrands, arc, 2, floor, table, v, mean);
    arc->p = mean[0];
    arc->q = mean[1];
    arc->points = n;
    if (n == 0) return 0;
    for (int k = 0; k < 2; k++) integrate_to_sines(v->v[k], table, n, arc->sine[k]);
    arc->terms = 2;
    for (int k = 0; k < n; k++) {
        arc->sine[0][k] /= arc->p.hi;
        arc->sine[1][k] -= arc->q.hi * arc->sine[0][k];
        if (fabs(arc->sine[0][k]) + fabs(arc->sine[1][k]) / arc->q.hi > 0x1p-56)
            arc->terms = k + 2 - k % 2;
    }
    return 1;
}
/* Returns alpha - x (`which` = 0) or the periodic part of t (1) at sin x = s and cos x = c. */
static double sum_sine_series_of_arc(const chaplygin_arc *arc, int which, double s, double c)
{
    const double *const term = arc->sine[which], twice = 2.0 * (c - s) * (c + s);
    double even = 0.0, even_before = 0.0, odd = 0.0, odd_before = 0.0;
    for (int k = arc->terms - 2; k >= 0; k -= 2) {
        const double e = twice * even + (term[k] - even_before),
                     o = twice * odd + (term[k + 1] - odd_before);
        even_before = even;
        odd_before = odd;
        even = e;
        odd = o;
    }
    return s * (2.0 * c * even_before + (odd + odd_before));
}

enum { LEAST_CELLS = 4 }; /* of an arc */
/* Coefficients of psi below LEAST_TERM [rad] are left out. The term k of psi is slow if
 * |cos(k rho pi)| is below LEAST_DIVISOR, or if |psi_k(0)| would exceed one radian. */
#define LEAST_TERM 6e-17
#define LEAST_DIVISOR 0.025

/* A closed form and the intermediate results of its set-up. */
typedef struct chaplygin_work {
    kr_chaplygin_plan plan;
    chaplygin_curve curve;
    cosine_table table;
    samples samples;
    chaplygin_arc arc[2];
    double wave_at_node[CELL_TERMS][CELL_TERMS]; /* cos(k y) at the Chebyshev nodes */
    cx wave[MOST_SAMPLES];                       /* exp(-i pi j/n) for j = 0 ... n - 1 */
    cx fourier[MOST_SAMPLES];
    /* Points of the second arc at the quadrature nodes, for n values of alpha2. */
    chaplygin_point second[MOST_SAMPLES][HEADING_NODES];
    double tail; /* largest relative size of the terms that are left out */
} chaplygin_work;
/* Replaces the n = 2^j numbers in w->fourier by their Fourier transform (Cooley and Tukey 1965). */
static void fourier_transform(chaplygin_work *w, int n)
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
/* A point of an arc: the torus angle alpha, x, slope = d alpha/dx, sine s and cosine c of x/2. */
typedef struct arc_place {
    double alpha, x, slope, s, c;
} arc_place;
/* Moves the point `at` to the torus angle `alpha`, between 0 and pi, with an error of x below 1e-9.
 * Bisection replaces Newton steps that leave an interval which contains the solution. */
static void move_to_alpha(const chaplygin_arc *arc, const kr_chaplygin_arc *e, double alpha,
                          arc_place *at)
{
    const double ends = fabs(e->b[arc->low] * e->a[arc->high]);
    double low = 0.0, high = 0.5 * two_pi;
    for (int step = 0; step < 80; step++) {
        double products[2];
        at->x += (alpha - at->alpha) / at->slope;
        if (!(at->x >= low && at->x <= high)) at->x = 0.5 * (low + high);
        sincos_turns(dd_times(0.5 * at->x, turns_per_radian()), &at->s, &at->c);
        const double s = at->s, c = at->c, D = e->C * (s * s) + c * c;
        multiply_root_factors(e, s * s, c * c, D, products);
        at->alpha = at->x + sum_sine_series_of_arc(arc, 0, 2.0 * s * c, c * c - s * s);
        at->slope = 0.5 * D * sqrt(e->C * ends / (products[0] * products[1])) / arc->p.hi;
        if (at->alpha > alpha)
            high = at->x;
        else
            low = at->x;
        if (fabs(alpha - at->alpha) < 1e-9 * at->slope) break;
    }
}
static void fill_cosines_at_nodes(chaplygin_work *w)
{
    for (int k = 0; k < CELL_TERMS; k++)
        for (int i = 0; i < CELL_TERMS; i++) {
            double unused;
            sincos_turns(dd_of(0.25 * k * (2 * i + 1) / CELL_TERMS), &unused,
                         &w->wave_at_node[k][i]);
        }
}
/* Writes to `out` the Chebyshev coefficients of (x - alpha)/2 [turns], then of the periodic part of
 * t, on a cell (kr_chaplygin_arc). `at` is moved to each node, in descending order of alpha if
 * `is_falling` is 1. Returns the largest magnitude of the last two coefficients of both functions,
 * those of t relative to the largest sample or, if larger, to arc->q. */
static double fit_cell_series(const chaplygin_work *w, const chaplygin_arc *arc,
                              const kr_chaplygin_arc *e, int cell, int is_falling, arc_place *at,
                              double out[])
{
    double value[2][CELL_TERMS], scale[2] = {1.0, arc->q.hi}, tail = 0.0;
    for (int k = 0; k < CELL_TERMS; k++) {
        const int i = is_falling ? k : CELL_TERMS - 1 - k;
        const double alpha = 0.5 * two_pi * (cell + 0.5 + 0.5 * w->wave_at_node[1][i]) / e->cells;
        move_to_alpha(arc, e, alpha, at);
        const double s = at->s, c = at->c, rest = alpha - at->alpha;
        value[0][i] = 0.5 * turns_per_radian().hi * ((at->x - alpha) + rest / at->slope);
        value[1][i] = sum_sine_series_of_arc(arc, 1, 2.0 * s * c, c * c - s * s) +
                      rest * (arc->p.hi * evaluate_arc_at_x(e, s, c).size - arc->q.hi);
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
/* Fills the cells (kr_chaplygin_arc) of arc j in the plan, in passes with twice as many cells each.
 * The tail is the largest result of fit_cell_series in a pass. A pass starts at the largest |u|,
 * where results are largest, and stops at a tail of 1e-11. The last pass has a tail below 4e-15, or
 * follows a tail below 1e-11. Returns 0 if MOST_CELLS is too small or the last tail is >= 1e-13. */
static int make_cells(chaplygin_work *w, int j)
{
    kr_chaplygin_plan *const plan = &w->plan;
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
            tail = fmax(tail, fit_cell_series(w, &w->arc[j], e, cell, j, &at, out));
        }
        if (tail < 4e-15 || before < 1e-11) break;
    }
    plan->first += 2 * CELL_TERMS * e->cells;
    w->tail = fmax(w->tail, tail);
    return e->cells <= MOST_CELLS && tail < 1e-13;
}
/* Fills w->second for n values alpha2 = 2 pi i/n, and w->wave for the Fourier transform. */
static void sample_second_arc(chaplygin_work *w, int n)
{
    const kr_chaplygin_plan *const plan = &w->plan;
    for (int i = 0; i < n; i++) {
        sincos_turns(dd_of(-0.5 * i / n), &w->wave[i].im, &w->wave[i].re);
        for (int g = 0; g < HEADING_NODES; g++) {
            const dd half =
                two_sum(0.5 * i / n, 0.25 * plan->ratio / plan->sections * gauss_node[g]);
            find_chaplygin_points(plan, 1, 1, &half, &w->second[i][g], NULL);
        }
    }
}
/* Writes to growth[i] the change of psi [rad] until the next section, if alpha2 is 2 pi i/n on this
 * one. Returns an error estimate: the largest magnitude, over all i, of the Legendre coefficient of
 * degree 7 of the integrand. The error of the quadrature is about the square of this magnitude. */
static double find_heading_growth(const chaplygin_work *w, int section, int n, double growth[])
{
    const kr_chaplygin_plan *const plan = &w->plan;
    const double h = 0.5 / plan->sections;
    double weight[HEADING_NODES], seventh[HEADING_NODES], most = 0.0;
    chaplygin_point p[2], first[HEADING_NODES];
    for (int g = 0; g < HEADING_NODES; g++) {
        const double x = 2.0 * gauss_node[g] - 1.0, xx = x * x;
        const dd half = dd_of(0.5 * h * (section + gauss_node[g]));
        weight[g] = plan->span * h * gauss_weight[g];
        seventh[g] = 15.0 / 16.0 * x * (-35.0 + xx * (315.0 + xx * (-693.0 + xx * 429.0)));
        find_chaplygin_points(plan, 0, 0, &half, &first[g], NULL);
    }
    for (int i = 0; i < n; i++) {
        double highest = growth[i] = 0.0;
        for (int g = 0; g < HEADING_NODES; g++) {
            p[0] = first[g];
            p[1] = w->second[i][g];
            const double part = weight[g] * find_heading_rate(p);
            growth[i] += part;
            highest += seventh[g] * part;
        }
        most = fmax(most, fabs(highest));
    }
    return most;
}
/* Replaces the n samples v of a function of alpha2 by its Fourier coefficients: n/2 of cosines,
 * then n/2 of sines. Returns the largest magnitude in the last eighth of each half of v. */
static double convert_samples_to_fourier(chaplygin_work *w, int n, double v[])
{
    const kr_chaplygin_plan *const plan = &w->plan;
    double last = 0.0;
    for (int i = 0; i < n; i++)
        w->fourier[i] = cx_scale(v[i], plan->is_whole ? cx_of(1.0, 0.0) : w->wave[i]);
    fourier_transform(w, n);
    for (int k = 0; k < n / 2; k++) {
        const cx c = cx_scale((plan->is_whole && k == 0 ? 1.0 : 2.0) / n, w->fourier[k]);
        v[k] = c.re;
        v[n / 2 + k] = -c.im;
        if (16 * k >= 7 * n) last = fmax(last, fmax(fabs(c.re), fabs(c.im)));
    }
    return last;
}
/* Returns the growth [turns] of the phase of term k of psi in `alpha1_turns` turns of alpha1. */
static dd find_term_phase_growth(const kr_chaplygin_plan *plan, dd rho, int k, double alpha1_turns)
{
    const dd turns = dd_times(alpha1_turns * (k + 0.5 * !plan->is_whole), rho);
    return dd_make(turns.hi - nearest(turns.hi), turns.lo);
}
/* Appends the slow term k of psi to the plan. `miss` is the part of psi_k(pi), real or imaginary,
 * that should be zero. At alpha1 = pi, where half of alpha2 is `half_alpha2` turns, the term jumps
 * with the amplitude 2 * miss. Returns 0 if there is no room. */
static int append_slow_term(kr_chaplygin_plan *plan, dd rho, int k, double miss, dd half_alpha2)
{
    if (plan->slow_terms == SLOW_TERMS) return 0;
    kr_slow_term *e = &plan->slow[plan->slow_terms++];
    double unused;
    const dd phase = dd_times(2 * k + !plan->is_whole, half_alpha2);
    dd step = dd_plus(find_term_phase_growth(plan, rho, k, 1.0), 0.5);
    step.hi -= nearest(step.hi);
    e->value = 2.0 * miss;
    e->phase = (phase.hi - nearest(phase.hi)) + phase.lo + (plan->is_psi_odd ? 0.0 : 0.25);
    e->step = step.hi;
    e->step_more = step.lo;
    sincos_turns(dd_half(step), &e->sine, &unused);
    return 1;
}
/* Replaces the change of psi from each section to the next by psi on the section. Both are n/2
 * cosine, then n/2 sine coefficients: real and imaginary parts of conj(change_k) or conj(psi_k). At
 * alpha1 = pi, alpha2/2 of this motion is half_alpha2 turns. Returns 0 for too many slow terms. */
static int convert_changes_to_series(kr_chaplygin_plan *plan, dd rho, int n, dd half_alpha2)
{
    plan->slow_terms = 0;
    for (int k = 0; k < n / 2; k++) {
        double *const re = plan->term + plan->first + k, *const im = re + n / 2;
        cx step, across, sum = cx_of(0.0, 0.0);
        sincos_turns(find_term_phase_growth(plan, rho, k, 0.5 / plan->sections), &step.im,
                     &step.re);
        sincos_turns(find_term_phase_growth(plan, rho, k, 0.5), &across.im, &across.re);
        for (int at = 0; at < plan->sections * n; at += n)
            sum = cx_mul(step, cx_add(sum, cx_of(re[at], im[at])));
        const double miss = plan->is_psi_odd ? sum.im : sum.re;
        double start = 0.0;
        if (fabs(across.re) > fmax(LEAST_DIVISOR, fabs(miss)))
            start = -miss / across.re;
        else if (fabs(miss) > LEAST_TERM && !append_slow_term(plan, rho, k, miss, half_alpha2))
            return 0;
        sum = plan->is_psi_odd ? cx_of(0.0, start) : cx_of(start, 0.0);
        for (int at = 0; at < plan->sections * n; at += n) {
            const cx growth = cx_of(re[at], im[at]);
            re[at] = sum.re;
            im[at] = sum.im;
            sum = cx_mul(step, cx_add(sum, growth));
        }
    }
    return 1;
}
/* Removes small last terms from the n/2 cosines and n/2 sines of each section. */
static void drop_small_terms(kr_chaplygin_plan *plan, int n)
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
/* Computes the Fourier series of psi on the sections. At alpha1 = pi, this motion has alpha2/2 =
 * half_alpha2 turns. Doubles the number of sections until quadrature errors are negligible, then
 * the number n of samples on a section until the last coefficients are below 1e-16 or n is at its
 * limit. Returns 0 if sections or slow terms are too many, or the last coefficients >= 1e-14. */
static int fit_heading_series(chaplygin_work *w, dd rho, dd half_alpha2)
{
    kr_chaplygin_plan *const plan = &w->plan;
    const int room = MOST_TERMS - plan->first;
    int n = 8 * plan->arc[1].cells < MOST_SAMPLES ? 8 * plan->arc[1].cells : MOST_SAMPLES;
    plan->sections = plan->arc[0].cells;
    while (n * plan->sections <= room) {
        double *const section = plan->term + plan->first, highest = 0.0, tail = 0.0;
        sample_second_arc(w, n);
        for (int j = 0; j < plan->sections; j++)
            highest = fmax(highest, find_heading_growth(w, j, n, section + j * n));
        if (highest > 2e-8) {
            plan->sections *= 2;
            continue;
        }
        for (int j = 0; j < plan->sections; j++)
            tail = fmax(tail, convert_samples_to_fourier(w, n, section + j * n));
        if (tail > 1e-16 && n < MOST_SAMPLES && 2 * n * plan->sections <= room) {
            n *= 2;
            continue;
        }
        w->tail = fmax(w->tail, tail);
        if (!convert_changes_to_series(plan, rho, n, half_alpha2)) return 0;
        drop_small_terms(plan, n);
        return tail < 1e-14;
    }
    return 0;
}

static const torus_kind chaplygin = {KR_KIND_GORYACHEV_CHAPLYGIN, 4.0, 4.0, 1.0};

/* The initial values of Chaplygin's variables u, and for each a square root of |u| exp(i chi). */
typedef struct separation {
    dd u[2];
    cdd root[2];
} separation;
/* Sets o->H, o->G and start->has_small_G. If G is negative, reverses the sign of G: turns the axes
 * of the closed form through pi about axis 1, and converts `start` and `way` to the new axes. */
static void set_integrals_with_positive_G(torus_start *start, torus_units *way, chaplygin_curve *o)
{
    dd *const L = start->momentum, *const g = start->up;
    const dd across = dd_add(dd_square(L[0]), dd_square(L[1]));
    o->H = dd_add(dd_half(dd_add(across, dd_scale(4.0, dd_square(L[2])))), g[0]);
    o->G = dd_sub(dd_mul(L[2], across), dd_mul(L[0], g[2]));
    if (o->G.hi < 0.0) {
        const kr_quat over = q4(0.0, v3(1.0, 0.0, 0.0));
        o->G = dd_neg(o->G);
        for (int i = 1; i < 3; i++) {
            L[i] = dd_neg(L[i]);
            g[i] = dd_neg(g[i]);
        }
        way->turn = q_mul(way->turn, over);
        way->axes = q_mul(way->axes, over);
        way->attitude = q_mul(way->attitude, over);
    }
    start->has_small_G = o->G.hi < 1e-9;
}
/* Returns the initial u1 and u2 and, for each of them, a square root of |u| exp(i chi). The sign of
 * the second square root follows from L1 - i L2 = -2i * (product of the two square roots). */
static separation find_separation_variables(const torus_start *start)
{
    const dd *const L = start->momentum, *const g = start->up;
    const dd square = dd_times(0.25, dd_add(dd_square(L[0]), dd_square(L[1]))),
             half = dd_half(L[2]), root = dd_sqrt(dd_add(dd_square(half), square));
    separation y;
    const int lower = half.hi < 0.0; /* which of u1 and u2 is larger */
    y.u[lower] = lower ? dd_sub(half, root) : dd_add(half, root);
    y.u[!lower] = dd_neg(dd_div(square, y.u[lower]));
    for (int j = 0; j < 2; j++) {
        const dd A = dd_sub(dd_mul(g[0], y.u[j]), dd_half(dd_mul(L[0], g[2]))),
                 C = dd_sub(dd_half(dd_mul(L[1], g[2])), dd_mul(g[1], y.u[j]));
        y.root[j] = cdd_sqrt(j ? cdd_of(dd_neg(A), dd_neg(C)) : cdd_of(A, C));
    }
    const cdd product = cdd_mul(y.root[0], y.root[1]);
    /* -2i times the product, times the conjugate of L1 - i L2 */
    if (product.im.hi * L[0].hi + product.re.hi * L[1].hi < 0.0) y.root[1] = cdd_neg(y.root[1]);
    return y;
}
/* Returns half of the initial torus angle [turns] of an arc, given u and `root` from
 * find_separation_variables. Writes the periodic part of t to `periodic_t`. Sets e->sign. */
static dd find_initial_half_alpha(const chaplygin_arc *arc, dd u, cdd root, kr_chaplygin_arc *e,
                                  double *periodic_t)
{
    const dd up = dd_max(dd_sub(arc->B, u), dd_of(0.0)),
             down = dd_max(dd_sub(dd_mul(u, arc->C), arc->A), dd_of(0.0)), both = dd_add(up, down);
    const double way = root.re.hi * root.im.hi > 0.0 ? -1.0 : 1.0,
                 s = way * dd_sqrt(dd_div(up, both)).hi, c = dd_sqrt(dd_div(down, both)).hi,
                 sine = 2.0 * s * c, cosine = c * c - s * s;
    e->sign = 1.0;
    const chaplygin_point p = evaluate_arc_at_x(e, s, c);
    const int first = fabs(root.re.hi) > fabs(root.im.hi);
    if ((first ? p.c * root.re.hi : p.s * root.im.hi) < 0.0) e->sign = -1.0;
    *periodic_t = sum_sine_series_of_arc(arc, 1, sine, cosine);
    return dd_add(argument_in_turns(s, c),
                  dd_times(0.5 * sum_sine_series_of_arc(arc, 0, sine, cosine), turns_per_radian()));
}
static void bound_periodic_part_of_tau(kr_chaplygin_plan *plan)
{
    double bound = 0.0;
    for (int j = 0; j < 2; j++) {
        const kr_chaplygin_arc *arc = &plan->arc[j];
        double most = 0.0;
        for (int cell = 0; cell < arc->cells; cell++) {
            const double *time = plan->term + arc->first + (2 * cell + 1) * CELL_TERMS;
            double sum = 0.0;
            for (int k = 0; k < CELL_TERMS; k++) sum += fabs(time[k]);
            most = fmax(most, sum);
        }
        bound += most;
    }
    plan->most_slip = 1.01 * bound / plan->mean;
}
/* Sets the rates of the torus angles with respect to tau and of the mean angles with respect to t,
 * and the members of the plan that depend on these rates. Returns rho. */
static dd set_angle_rates(kr_chaplygin_plan *plan, const chaplygin_arc arc[2])
{
    const dd det = dd_add(dd_mul(arc[0].p, arc[1].q), dd_mul(arc[1].p, arc[0].q));
    double most = 0.0;
    plan->mean = dd_div(det, dd_mul(arc[0].p, arc[1].p)).hi;
    for (int j = 0; j < 2; j++) {
        kr_chaplygin_arc *e = &plan->arc[j];
        const dd rate = dd_div(dd_of(1.0), arc[j].p);
        most = fmax(most, rate.hi);
        e->half_rate = 0.5 * dd_mul(rate, turns_per_radian()).hi;
        plan->torus.turn[j] = make_phase(dd_half(dd_div(arc[1 - j].p, det)));
    }
    plan->rounding = 0x1p-53 / most;
    plan->tolerance = 0.5 * sqrt(plan->rounding);
    plan->span = two_pi * arc[0].p.hi;
    const dd ratio = dd_div(arc[0].p, arc[1].p);
    plan->ratio = ratio.hi;
    return ratio;
}
/* Sets the initial mean angles, given half of each initial torus angle [turns] and the initial
 * periodic parts of t. Returns half of alpha2 [turns] where alpha1 is pi. */
static dd set_phases_and_half_alpha2(kr_chaplygin_plan *plan, dd rho, const dd half_alpha[2],
                                     const double periodic_t[2])
{
    const double slip = -(periodic_t[0] + periodic_t[1]) / plan->mean;
    dd angle[2];
    for (int j = 0; j < 2; j++) {
        kr_phase *turn = &plan->torus.turn[j];
        const dd extra = dd_of(slip * plan->arc[j].half_rate);
        set_initial_phase(turn, dd_sub(half_alpha[j], extra));
        angle[j] = dd_add(dd_make(turn->start, turn->more), extra);
    }
    return dd_add(angle[1], dd_mul(rho, dd_sub(dd_of(0.25), angle[0])));
}
/* Computes the plan, except for the initial heading. Returns KR_REFUSAL_NONE, or why it failed. */
static kr_refusal fill_plan_except_heading(const torus_start *start, chaplygin_work *w)
{
    chaplygin_curve *o = &w->curve;
    kr_chaplygin_plan *plan = &w->plan;
    const double least = 1e-24;
    dd half[2];
    double time[2];
    if (!(fabs(o->H.hi) < 1e10)) return KR_REFUSAL_COINCIDENT;
    /* Two branch points coincide at G = 0. The motion is then computed with a slightly larger G.
     * The change is below rounding errors, unless the motion is planar and unstable. */
    if (o->G.hi < least) {
        if (is_planar(start, find_rates_12_and_momentum_3(&chaplygin, start)))
            return KR_REFUSAL_PLANAR;
        o->G = dd_of(least);
    }
    const kr_refusal degenerate = find_branch_points(o);
    if (degenerate != KR_REFUSAL_NONE) return degenerate;
    const separation y = find_separation_variables(start);
    if (!make_arcs(o, y.u, w->arc)) return KR_REFUSAL_START;
    start_cosine_table(&w->table);
    for (int j = 0; j < 2; j++)
        if (!find_averages_and_sines(&w->arc[j], &w->table, &w->samples))
            return KR_REFUSAL_INTEGRALS;
    w->tail = 0.0;
    plan->first = 0;
    fill_cosines_at_nodes(w);
    for (int j = 0; j < 2; j++) {
        fill_plan_arc(&w->arc[j], &plan->arc[j]);
        if (!make_cells(w, j)) return KR_REFUSAL_INTEGRALS;
    }
    const dd ratio = set_angle_rates(plan, w->arc);
    bound_periodic_part_of_tau(plan);
    for (int j = 0; j < 2; j++)
        half[j] = find_initial_half_alpha(&w->arc[j], y.u[j], y.root[j], &plan->arc[j], &time[j]);
    plan->is_psi_odd = plan->arc[0].has_sine[0] == plan->arc[1].has_sine[1];
    plan->is_whole = plan->arc[1].has_sine[0] == plan->arc[1].has_cosine[0];
    const dd second = set_phases_and_half_alpha2(plan, ratio, half, time);
    return fit_heading_series(w, ratio, second) ? KR_REFUSAL_NONE : KR_REFUSAL_HEADING;
}
static kr_refusal make_plan(void *memory, torus_start *start, torus_units *way, double *certificate)
{
    chaplygin_work *w = memory;
    kr_chaplygin_plan *plan = &w->plan;
    set_integrals_with_positive_G(start, way, &w->curve);
    const kr_refusal refusal = fill_plan_except_heading(start, w);
    if (refusal != KR_REFUSAL_NONE) return refusal;
    plan->heading_start = plan->heading_more = 0.0;
    const kr_quat attitude = chaplygin_state_after_span(plan, 0.0, dd_of(0.0)).q,
                  turn = q_mul(way->attitude, q_conj(attitude));
    const dd half = argument_in_turns(turn.z, turn.w), *m = start->momentum;
    plan->heading_start = half.hi;
    plan->heading_more = half.lo;
    const kr_state now = chaplygin_state_after_span(plan, 0.0, dd_of(0.0));
    const body_view view = find_rates_and_axes(&chaplygin, now);
    const double span = choose_taylor_span(&view),
                 miss = find_taylor_error(&chaplygin, view, span,
                                          chaplygin_state_after_span(plan, span, dd_of(span))),
                 error = find_state_error(now, way->attitude, v3(m[0].hi, m[1].hi, m[2].hi));
    *certificate = fmax(fmax(w->tail, KR_TORUS_ROUNDING), fmax(miss, error));
    return KR_REFUSAL_NONE;
}
static kr_status plan_scene(const kr_scene *scene, int own, double bound, void *memory,
                            kr_exact_info *info)
{
    const kr_chaplygin_plan *plan = memory;
    const kr_status status = plan_torus(scene, own, bound, &chaplygin, make_plan, memory, info);
    if (status == KR_OK && plan->is_whole) info->frequency[1] *= 2.0;
    return status;
}
static kr_state chaplygin_state(const void *plan, double t)
{
    return evaluate_torus(chaplygin_state_after_span, plan, t);
}
static kr_state chaplygin_state_at_angles(const void *memory, double first, double second)
{
    const kr_chaplygin_plan *plan = memory;
    /* `first` is half of the first mean angle [turns]. `second` is half of the second mean angle
     * or, if plan->is_whole is 1, the whole second mean angle. */
    const double part = plan->is_whole ? 0.5 : 1.0;
    const dd mean[2] = {dd_of(fraction_of_turns(first)), dd_of(part * fraction_of_turns(second))};
    return chaplygin_state_at_phases(plan, plan->torus.begin, mean, 0.0);
}
static size_t used_size(const void *memory)
{
    const kr_chaplygin_plan *plan = memory;
    const size_t terms = (size_t)(plan->first + 2 * plan->sections * plan->terms);
    return offsetof(kr_chaplygin_plan, term) + terms * sizeof *plan->term;
}
static int has_level_momentum(const kr_scene *scene) { return scene->start.m.z == 0.0; }
const kr_exact_scalar KR_NAME(kr_chaplygin_scalar) = {
    sizeof(kr_chaplygin_plan), sizeof(chaplygin_work),   used_size, has_level_momentum, plan_scene,
    chaplygin_state,           chaplygin_state_at_angles};
