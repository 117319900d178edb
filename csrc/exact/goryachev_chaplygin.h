/* States of a Goryachev-Chaplygin top with <m, e3> = 0 in closed form. m is the momentum, e3 the
 * upward vertical, body axes and units as in goryachev_chaplygin.c. In the rescaled time tau, with
 * d tau = dt/|m|, the two torus angles alpha1 and alpha2 grow at constant rates. The heading psi is
 * defined by m = |m| (cos psi, sin psi, 0) along space axes. The attitude (body axes -> space) is
 *     exp(k psi/2) (i + k)/sqrt2 (c1 + c2 i - s2 j + s1 k)/sqrt(|m|)  (i, j, k: quaternion units)
 * with |m| = c1^2 + s1^2 + c2^2 + s2^2. Chaplygin's variables u1 > 0 > u2 oscillate on intervals,
 * called arcs. For u1, c1 = sqrt|u1| cos(chi/2) and s1 = sqrt|u1| sin(chi/2), with the angle chi of
 * goryachev_chaplygin.c; likewise c2 and s2 for u2. Each arc has an angle x and positive constants
 * A, B (magnitudes of A, B in goryachev_chaplygin.c) and C. With s = sin(x/2) and c = cos(x/2),
 *     |u| = (A s^2 + B c^2)/D,  D = C s^2 + c^2.
 * x - alpha is a periodic function of the torus angle alpha of the arc. The time t is a multiple of
 * tau plus a periodic function of each alpha. Newton's method solves this equation for tau. Mean
 * angles are the linear parts of alpha1(t) and alpha2(t).
 *
 * psi is not a sum of functions of alpha1 and of alpha2. The N lines alpha1 = pi n/N, with n from 0
 * to N - 1 and N = plan->sections, are called sections. On each section, psi is a Fourier series in
 * alpha2. From the preceding section to a state, the change of psi is an integral over tau. */
#ifndef KR_EXACT_GORYACHEV_CHAPLYGIN_H
#define KR_EXACT_GORYACHEV_CHAPLYGIN_H
#include "torus.h"

enum {
    CELL_TERMS = 16,        /* coefficients of a polynomial */
    MOST_CELLS = 512,       /* largest number of cells of an arc */
    MOST_TERMS = 5 << 15,   /* largest number of coefficients of all cells and sections */
    MOST_SAMPLES = 1 << 11, /* largest number of values of alpha2 on a section */
    SLOW_TERMS = 256,
    HEADING_NODES = 8 /* nodes of the quadrature from a section */
};

/* The arc of one of Chaplygin's variables u, and functions of its torus angle alpha. */
typedef struct kr_chaplygin_arc {
    double A, B, C; /* of |u| and D */
    /* The factors a s^2 + b c^2 of (p+ D^3)/2 (indices 0 to 2) and (p- D^3)/2 (3 to 5), one for
     * each root of the polynomials p+ and p- (goryachev_chaplygin.c). The factor of a root at an
     * end of the arc is a constant times s^2 or c^2; a and b are both set to this constant. If
     * `pair` is 1, the factors 4 and 5 are a[4] s^2 + b[4] c^2 +- i * imaginary * D. */
    double a[6], b[6], imaginary;
    int pair;
    int has_sine[2], has_cosine[2]; /* 1 if the end at x = 0, or at x = pi, is a root of p+, p- */
    double sign;                    /* of sqrt|u| cos(chi/2) for 0 < x < pi */
    double half_rate;               /* of half of alpha [turns per unit of tau] */
    /* Cells are equal intervals between alpha = 0 and pi. Each cell has the Chebyshev coefficients
     * of two odd functions of alpha: (x - alpha)/2 [turns], then the periodic part of t. */
    int cells, first; /* `cells` is a power of two; index of the first coefficient */
} kr_chaplygin_arc;
/* A slow term (goryachev_chaplygin.c) makes the Fourier series of psi jump where alpha1 is
 * (2n + 1) pi, for each integer n. When alpha1 grows past this angle, the opposite of the jump,
 * value * sin(2 pi (phase + n * (step + step_more))) [rad], is added: psi remains continuous. */
typedef struct kr_slow_term {
    double value, phase;    /* phase [turns] */
    double step, step_more; /* [turns] */
    double sine;            /* of half of a step */
} kr_slow_term;
typedef struct kr_chaplygin_plan {
    kr_torus torus;
    kr_chaplygin_arc arc[2];
    double mean; /* mean of |m| over tau */
    /* The slip is the periodic part of tau: tau minus t / mean, with the member `mean` above.
     * |slip| <= most_slip. If the error of the slip is below `rounding`, errors of torus angles
     * are below 2^-53 rad. This is so after a Newton step (find_true_angles) below `tolerance`. */
    double most_slip, rounding, tolerance;
    /* heading_start + heading_more: the constant of psi/2 [turns] that find_heading leaves out. */
    double heading_start, heading_more;
    int is_psi_odd; /* 1 if psi changes sign, 0 if it is unchanged, when both angles change sign */
    int is_whole;   /* 1 if the multiples of alpha2 in psi are integers, 0: half-integers */
    int sections;   /* between alpha1 = 0 and pi, a power of two */
    int first;      /* index of the first coefficient of a section */
    int terms;      /* cosines of a section, even. The coefficients of as many sines follow. */
    int slow_terms;
    double ratio; /* of the rates of alpha2 and alpha1 */
    double span;  /* of tau in a turn of alpha1 */
    kr_slow_term slow[SLOW_TERMS];
    double term[MOST_TERMS];
} kr_chaplygin_plan;

/* The coefficients of each lane's cell, and the position y in the cell, from -1 to 1. */
typedef struct cell_place {
    const double *row[LANES];
    wide y, side; /* side: -1 where alpha is between -pi and 0, and 1 elsewhere */
} cell_place;
INLINE cell_place find_cell(const kr_chaplygin_plan *plan, int j, dd half_alpha)
{
    const kr_chaplygin_arc *const arc = &plan->arc[j];
    const double all = 2.0 * arc->cells;
    const wide ahead = all * (2.0 * half_alpha.hi - nearest(2.0 * half_alpha.hi)),
               side = sign_from_mask(is_negative(ahead)), place = side * ahead,
               last = wide_splat(arc->cells - 1.0),
               cell = wide_max(wide_min(nearest(place - 0.5), last), wide_splat(0.0));
    double at[LANES];
    cell_place r;
    r.side = side;
    r.y = 2.0 * ((place - cell) + side * (all * (2.0 * half_alpha.lo))) - 1.0;
    wide_store(at, cell);
    for (int lane = 0; lane < LANES; lane++)
        r.row[lane] = plan->term + arc->first + 2 * CELL_TERMS * (int)at[lane];
    return r;
}
/* Writes to out[j], for j < `arcs`, the value at the place p[j] of (x - alpha)/2 [turns] if `which`
 * is 0, of the periodic part of t if it is 1. Even and odd Chebyshev terms have separate Clenshaw
 * recurrences in z = T_2(y), y = p[j].y: T_{2k} = T_k(z), T_{2k+1} = y (U_k(z) - U_{k-1}(z)). */
INLINE void evaluate_cell_series(const cell_place p[], int arcs, int which, wide out[])
{
    const int first = which * CELL_TERMS;
    wide twice[2], sum[2][2], before[2][2];
    for (int j = 0; j < arcs; j++) {
        twice[j] = 4.0 * (p[j].y * p[j].y) - 2.0;
        for (int i = 0; i < 2; i++) sum[j][i] = before[j][i] = wide_splat(0.0);
    }
    for (int k = first + CELL_TERMS - 2; k >= first; k -= 2)
        for (int j = 0; j < arcs; j++)
            for (int i = 0; i < 2; i++) {
                const wide now =
                    twice[j] * sum[j][i] + (wide_gather(p[j].row, k + i) - before[j][i]);
                before[j][i] = sum[j][i];
                sum[j][i] = now;
            }
    for (int j = 0; j < arcs; j++)
        out[j] = p[j].side * ((sum[j][0] - 0.5 * twice[j] * before[j][0]) +
                              p[j].y * (sum[j][1] - before[j][1]));
}
/* A point of an arc: sqrt|u| cos(chi/2), sqrt|u| sin(chi/2), and |u|. */
typedef struct chaplygin_point {
    wide c, s, size;
} chaplygin_point;
/* Writes (|p+| D^3)/2 and (|p-| D^3)/2 to `p_plus_minus`. Factors s^2 and c^2, from roots at the
 * ends of the arc, are left out. `ss` and `cc` are s^2 and c^2 (opening comment). */
INLINE void multiply_root_factors(const kr_chaplygin_arc *arc, wide ss, wide cc, wide D,
                                  wide p_plus_minus[2])
{
    for (int k = 0; k < 2; k++) {
        p_plus_minus[k] = wide_splat(1.0);
        for (int i = 3 * k; i < 3 * k + 3; i++) {
            wide factor = arc->a[i] * ss + arc->b[i] * cc;
            const wide far = arc->imaginary * D;
            if (arc->pair && i == 4) factor = factor * factor + far * far;
            p_plus_minus[k] = p_plus_minus[k] * factor;
        }
        p_plus_minus[k] = wide_abs(p_plus_minus[k]);
    }
}
/* Returns the point of the arc where x/2 has the sine s and the cosine c. Every member of the
 * result has a small relative error, even where u is close to zero. */
INLINE chaplygin_point evaluate_arc_at_x(const kr_chaplygin_arc *arc, wide s, wide c)
{
    const wide ss = s * s, cc = c * c, D = arc->C * ss + cc, one = 1.0 / D;
    const wide scale = arc->sign * (one * wide_sqrt(one));
    wide half[2];
    multiply_root_factors(arc, ss, cc, D, half);
    for (int k = 0; k < 2; k++) {
        wide ends = k ? -scale : scale;
        if (arc->has_sine[k]) ends = ends * s;
        if (arc->has_cosine[k]) ends = ends * c;
        half[k] = ends * wide_sqrt(half[k]);
    }
    return (chaplygin_point){half[0], half[1], (arc->A * ss + arc->B * cc) * one};
}
/* Writes points and, unless `time` is NULL, periodic parts of t for the arcs `from` to `to`, given
 * half of the torus angle of each arc [turns]. Element 0 of each array belongs to arc `from`. */
INLINE void find_chaplygin_points(const kr_chaplygin_plan *plan, int from, int to, const dd half[],
                                  chaplygin_point out[], wide time[])
{
    const int arcs = 1 + to - from;
    cell_place p[2];
    wide turns[2], s[2], c[2];
    for (int j = 0; j < arcs; j++) p[j] = find_cell(plan, from + j, half[j]);
    evaluate_cell_series(p, arcs, 0, turns);
    if (time) evaluate_cell_series(p, arcs, 1, time);
    for (int j = 0; j < arcs; j++) sincos_turns(phase_plus(half[j], turns[j]), &s[j], &c[j]);
    for (int j = 0; j < arcs; j++) out[j] = evaluate_arc_at_x(&plan->arc[from + j], s[j], c[j]);
}
/* Writes half of each torus angle, given half of each mean angle [turns]. The slip is the root of
 * f(slip) = mean * slip + (sum of the periodic parts of t), with f' = |m|. Because log |m| changes
 * by at most one in a unit of tau, the error after a short Newton step d is at most about d^2/2.
 * Bisection replaces Newton steps that leave an interval which contains the root. It also replaces
 * Newton steps longer than half of the previous step, because these could alternate forever. */
INLINE void find_true_angles(const kr_chaplygin_plan *plan, const dd mean[2], dd half[2])
{
    wide high = wide_splat(plan->most_slip), low = -high, moved = 4.0 * high,
         slip = wide_splat(0.0);
    mask done = wide_less(high, low);
    for (int step = 0; step < 80 && !mask_all(done); step++) {
        chaplygin_point p[2];
        wide time[2];
        for (int j = 0; j < 2; j++) half[j] = phase_plus(mean[j], slip * plan->arc[j].half_rate);
        find_chaplygin_points(plan, 0, 1, half, p, time);
        const wide value = plan->mean * slip + (time[0] + time[1]), slope = p[0].size + p[1].size;
        const mask up = wide_less(wide_splat(0.0), value);
        high = wide_choose(up, slip, high);
        low = wide_choose(up, low, slip);
        wide next = slip - value / slope;
        const mask is_inside = mask_and(wide_at_most(low, next), wide_at_most(next, high)),
                   is_safe = mask_and(is_inside, wide_at_most(wide_abs(next - slip), 0.5 * moved));
        next = wide_choose(is_safe, next, 0.5 * (low + high));
        moved = wide_abs(next - slip);
        const mask settled =
            mask_or(mask_and(is_safe, wide_at_most(moved, wide_splat(plan->tolerance))),
                    wide_at_most(moved, wide_splat(plan->rounding)));
        slip = wide_choose(done, slip, next);
        done = mask_or(done, settled);
    }
    for (int j = 0; j < 2; j++) half[j] = phase_plus(mean[j], slip * plan->arc[j].half_rate);
}
/* Returns the derivative of psi with respect to tau at the points p of both arcs. */
INLINE wide find_heading_rate(const chaplygin_point p[2])
{
    return 2.0 * (p[0].c * p[1].s + p[0].s * p[1].c) / (p[0].size + p[1].size);
}
/* The nodes and weights of Gauss and Legendre's quadrature on the interval from 0 to 1. */
static const double gauss_node[HEADING_NODES] = {0.019855071751231884, 0.10166676129318664,
                                                 0.2372337950418355,   0.40828267875217511,
                                                 0.59171732124782489,  0.7627662049581645,
                                                 0.89833323870681336,  0.98014492824876812},
                    gauss_weight[HEADING_NODES] = {0.050614268145188129, 0.11119051722668724,
                                                   0.15685332293894364,  0.18134189168918099,
                                                   0.18134189168918099,  0.15685332293894364,
                                                   0.11119051722668724,  0.050614268145188129};

/* Returns the change of psi [rad] while alpha1 grows by `alpha1_growth` turns from a section. On
 * this section, alpha1 is `alpha1` turns, and half of alpha2 is `half_alpha2` turns. */
INLINE wide integrate_heading_from_section(const kr_chaplygin_plan *plan, wide alpha1,
                                           wide alpha1_growth, wide half_alpha2)
{
    wide sum = wide_splat(0.0);
    for (int g = 0; g < HEADING_NODES; g++) {
        const wide way = (0.5 * gauss_node[g]) * alpha1_growth;
        const dd node[2] = {dd_of(0.5 * alpha1 + way), dd_of(half_alpha2 + plan->ratio * way)};
        chaplygin_point p[2];
        find_chaplygin_points(plan, 0, 1, node, p, NULL);
        sum = sum + gauss_weight[g] * find_heading_rate(p);
    }
    return plan->span * alpha1_growth * sum;
}
/* Returns psi [rad] on the section with the index `section`, from its Fourier series, given half of
 * alpha2 [turns]. Clenshaw's recurrences for even and for odd terms are independent. */
INLINE wide sum_heading_series(const kr_chaplygin_plan *plan, wide section, dd half_alpha2)
{
    const int terms = plan->terms, shift = !plan->is_whole;
    wide c[5], s[5]; /* of multiples of alpha2/2 */
    c[0] = wide_splat(1.0);
    s[0] = wide_splat(0.0);
    sincos_turns(half_alpha2, &s[1], &c[1]);
    for (int i = 2; i < 5; i++) {
        const int low = i / 2, high = i - low;
        c[i] = c[low] * c[high] - s[low] * s[high];
        s[i] = c[low] * s[high] + s[low] * c[high];
    }
    const wide twice = 2.0 * c[4], zero = s[0];
    wide sum[2][2] = {{zero, zero}, {zero, zero}}, before[2][2] = {{zero, zero}, {zero, zero}};
    const double *row[LANES];
    double at[LANES];
    wide_store(at, section);
    for (int lane = 0; lane < LANES; lane++)
        row[lane] = plan->term + plan->first + 2 * terms * (int)at[lane];
    for (int k = terms - 2; k >= 0; k -= 2)
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2; j++) {
                const wide now =
                    twice * sum[i][j] + (wide_gather(row, j * terms + k + i) - before[i][j]);
                before[i][j] = sum[i][j];
                sum[i][j] = now;
            }
    wide total = zero;
    for (int i = 0; i < 2; i++) {
        const int up = 2 * i + shift, down = 4 - up;
        total = total + ((c[up] * sum[i][0] - c[down] * before[i][0]) +
                         (s[up] * sum[i][1] + s[down] * before[i][1]));
    }
    return total;
}
INLINE wide signed_fraction(dd x) { return (x.hi - nearest(x.hi)) + x.lo; }
/* Returns what all slow terms (kr_slow_term) add to psi in a number of turns of alpha1. */
INLINE wide sum_slow_heading_terms(const kr_chaplygin_plan *plan, wide turns)
{
    wide sum = wide_splat(0.0);
    for (int i = 0; i < plan->slow_terms; i++) {
        const kr_slow_term *e = &plan->slow[i];
        const dd step = dd_make(wide_splat(0.5 * e->step), wide_splat(0.5 * e->step_more));
        const wide far = signed_fraction(dd_times(turns, step)),
                   middle = e->phase + signed_fraction(dd_times(turns - 1.0, step));
        wide s, wave, unused;
        sincos_turns(dd_of(far), &s, &unused);
        sincos_turns(dd_of(middle), &wave, &unused);
        const wide growth = e->sine != 0.0 ? s / e->sine : turns;
        sum = sum + e->value * wave * growth;
    }
    return sum;
}
/* Returns psi [rad], up to a constant, at the torus angles 2 half[0] + `turns` and 2 half[1], in
 * turns. `turns` is even: it changes only the sum of the slow terms, and not the sign of psi. */
INLINE wide find_heading(const kr_chaplygin_plan *plan, const dd half[2], wide turns)
{
    const wide turn = nearest(2.0 * half[0].hi), ahead = 2.0 * half[0].hi - turn,
               side = sign_from_mask(is_negative(ahead));
    /* psi is even or odd in both angles together, and changes its sign after a turn of alpha1. */
    const double all = 2.0 * plan->sections;
    const wide place = side * ahead,
               section =
                   wide_max(wide_min(nearest(place * all - 0.5), wide_splat(plan->sections - 1.0)),
                            wide_splat(0.0)),
               at = section / all, left = (place - at) + side * (2.0 * half[0].lo);
    const dd second =
        phase_plus(dd_make(side * half[1].hi, side * half[1].lo), -0.5 * plan->ratio * left);
    const wide value = sum_heading_series(plan, section, second) +
                       integrate_heading_from_section(plan, at, left, signed_fraction(second));
    const mask is_odd = wide_less(wide_splat(0.0), wide_abs(0.5 * turn - nearest(0.5 * turn)));
    const wide sign = sign_from_mask(is_odd) * (plan->is_psi_odd ? side : wide_splat(1.0));
    return sign * value + sum_slow_heading_terms(plan, turns + turn);
}
/* Returns the state at the mean angles 2 mean[0] + `turns` and 2 mean[1], in turns, in the units of
 * plan->torus. `turns` is even (find_heading). `time` is only copied to the result. */
INLINE state_lanes chaplygin_state_at_phases(const kr_chaplygin_plan *plan, wide time,
                                             const dd mean[2], wide turns)
{
    dd half[2];
    chaplygin_point p[2];
    find_true_angles(plan, mean, half);
    find_chaplygin_points(plan, 0, 1, half, p, NULL);
    const wide c1 = p[0].c, c2 = p[1].c, s1 = p[0].s, s2 = p[1].s,
               size = (c1 * c1 + s1 * s1) + (c2 * c2 + s2 * s2);
    /* psi/2 in turns; the low part of turns_per_radian is below the error of the series */
    const wide near = 0.5 * (find_heading(plan, half, turns) * turns_per_radian().hi);
    dd heading = two_sum(wide_splat(plan->heading_start), near - nearest(near));
    heading.lo = heading.lo + plan->heading_more;
    wide s, c;
    sincos_turns(heading, &s, &c);
    const wide n = wide_sqrt(wide_splat(0.5)) / wide_sqrt(size);
    /* The attitude for zero heading is (i + k)/sqrt2 (c1 + c2 i - s2 j + s1 k). */
    const quat_lanes q = {-n * (c2 + s1), n * (c1 + s2), n * (c2 - s1), n * (c1 - s2)};
    const wide unit = plan->torus.momentum * size;
    state_lanes r;
    r.t = time;
    r.m.x = unit * (c * c - s * s);
    r.m.y = unit * (2.0 * c * s);
    r.m.z = wide_splat(0.0);
    r.q = turn_and_convert_attitude(&plan->torus, s, c, q);
    return r;
}
INLINE state_lanes chaplygin_state_after_span(const void *memory, wide time, dd span)
{
    const kr_chaplygin_plan *plan = memory;
    const dd mean[2] = {find_torus_phase(&plan->torus, 0, span),
                        find_torus_phase(&plan->torus, 1, span)};
    return chaplygin_state_at_phases(plan, time, mean,
                                     2.0 * nearest(span.hi * plan->torus.turn[0].fast));
}
#endif
