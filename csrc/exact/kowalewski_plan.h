/* Set-up of the theta sums of a Kowalewski top from its initial state.
 *
 * This header is compiled once for each instruction set. */
#ifndef KR_KOWALEWSKI_PLAN_H
#define KR_KOWALEWSKI_PLAN_H
#include "kowalewski_dual.h"

/* The state p, q, r, g1, g2, g3 and the constant l = <m, e3> of a top, in the notation of
 * kowalewski_curve.h. */
typedef struct kowalewski_top {
    dd state[6], l;
} kowalewski_top;

/* Intermediate results of setting up the theta sums. */
typedef struct kowalewski_work {
    kowalewski_curve curve;
    kowalewski_arc arc[2];
    cosine_table table;
    samples samples;
    kowalewski_rates rates;
    kowalewski_roots roots;
    theta_work theta;
    dual_work dual;
    double start[2];              /* theta1 and theta2 at the start */
    double rate_miss, separatrix; /* see find_heading and separatrix_error */
} kowalewski_work;

/* Returns 1 if the initial values of Kowalewski's variables w1 and w2 lie on the arcs. The arc of
 * w1 ends at k, and the arc of w2 ends at the smallest real branch point. The choice of these end
 * points was confirmed for 1e6 random tops (docs/theory/closed_form.md), but has not been proved. */
static int is_on_arcs(const kowalewski_curve *o, const dd state[6])
{
    const double slack = 1e-12;
    dd w[2];
    find_variables(o, state[0], state[1], w);
    const dd low = real_root(o, o->real - 2), least = real_root(o, 0);
    return o->order[o->real - 1] == ROOT_K &&
           dd_sub(w[0], low).hi >= -slack * (1.0 + fabs(low.hi)) &&
           dd_sub(least, w[1]).hi >= -slack * (1.0 + fabs(least.hi));
}
/* Returns the relative error of the distance between two branch points. If two roots of phi are
 * nearly equal, only about half of their digits are accurate. */
static double distance_error(const kowalewski_curve *o, int i, int j)
{
    const double size = 1.0 + o->k.hi, distance = cx_abs(root_less_root(o, i, j)) / size,
                 digits = 1e-31;
    return i < ROOT_K && j < ROOT_K ? digits / (distance * distance) : digits / distance;
}
/* Returns the largest relative error of the distances between branch points of F. The frequencies
 * of the motion depend on the logarithms of these distances. The distances considered are the
 * widths of the gaps next to the arcs, and the separation of two complex roots close to an arc. */
static double separatrix_error(const kowalewski_curve *o)
{
    const int top = o->real - 2;
    double most = fmax(distance_error(o, o->order[top], o->order[top - 1]),
                       distance_error(o, o->order[0], o->order[1]));
    if (o->pair) {
        const double re = o->root[1].hi;
        if ((re > real_root(o, top).hi && re < o->k.hi) || re < real_root(o, 0).hi)
            most = fmax(most, distance_error(o, 1, 2));
    }
    return most;
}
/* Returns the smallest distance between two branch points, divided by 1 + k. For two nearly equal
 * roots, the distance is replaced by `resolution` of close_roots, a measure of the cancellation. */
static double least_distance(const kowalewski_curve *o)
{
    double least = INFINITY;
    for (int i = 0; i < ROOTS; i++)
        for (int j = 0; j < i; j++) {
            const close_roots r = examine_roots(o, i, j);
            least = fmin(least, r.apply ? r.resolution
                                        : cx_abs(root_less_root(o, i, j)) / (1.0 + o->k.hi));
        }
    return least;
}
static void make_samples(const kowalewski_work *w, torus_sample out[])
{
    static const int step[2][SAMPLES_EACH] = {{3, 14, 25, 37, 46, 59}, {5, 13, 27, 34, 44, 61}};
    arc_point point[2][SAMPLES_EACH];
    const kowalewski_curve *o = &w->curve;
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < SAMPLES_EACH; i++)
            make_sample(o, &w->arc[j], &w->table, step[j][i], &point[j][i]);
    for (int i = 0; i < SAMPLES; i++, out++) {
        const arc_point *one = &point[0][i / SAMPLES_EACH], *two = &point[1][i % SAMPLES_EACH];
        dd y[6];
        make_state(o, &w->roots, one, two, y);
        out->p = y[0].hi, out->q = y[1].hi, out->r = y[2].hi;
        out->theta[0] = one->angle + (one->theta[0] + two->theta[0]);
        out->theta[1] = two->angle + (one->theta[1] + two->theta[1]);
        const dd plus = dd_plus(y[5], 1.0), minus = dd_sub(dd_of(1.0), y[5]);
        /* The ratio S/T = y/x of two theta sums can be computed from two formulas. The terms of the
         * first one vanish where y[5] = -1, and those of the second one where y[5] = 1. */
        if (y[5].hi > 0.0) {
            out->x = cx_of(dd_sub(y[3], plus).hi, y[4].hi);
            out->y = cx_of(dd_add(y[3], plus).hi, y[4].hi);
        } else {
            out->x = cx_of(dd_sub(minus, y[3]).hi, y[4].hi);
            out->y = cx_of(dd_add(minus, y[3]).hi, -y[4].hi);
        }
    }
}
/* Returns the coefficient of a given term in one of the theta sums. */
static double coefficient(const theta_work *t, int sum, const sum_term *n, int which)
{
    return n->value[which] * t->constant[sum][class_of(t->kind, n->k1, n->k2)];
}
/* Computes the initial values of S and T and of their time derivatives. */
static void sum_start(const kowalewski_work *w, theta_work *t, cx sum[2], cx slope[2])
{
    const double first = w->rates.rate[0].hi, second = w->rates.rate[1].hi;
    for (int j = 0; j < 2; j++) {
        make_waves(w->start[j], t->terms.wide[j], t->wave[j]);
        sum[j] = slope[j] = cx_of(0.0, 0.0);
    }
    for (int i = 0; i < t->terms.count; i++) {
        const sum_term *n = &t->terms.term[i];
        const double grows = 0.5 * (n->k1 * first + n->k2 * second);
        cx wave = cx_mul(t->wave[0][WIDE_MOST + n->k1], t->wave[1][WIDE_MOST + n->k2]);
        if (odd(n->k2)) wave = cx_of(-wave.im, wave.re);
        for (int j = 0; j < 2; j++) {
            const double c = coefficient(t, spinor_sums[j], n, j);
            sum[j] = cx_add(sum[j], cx_scale(c, wave));
            slope[j] = cx_add(slope[j], cx_scale(c * grows, cx_of(-wave.im, wave.re)));
        }
    }
}
/* Returns the rate of the heading, corrected by integer multiples of half the rates of the torus
 * angles. These integers are found from the initial rate of A = S + T or of B = S - T, whichever is
 * larger. Up to the contribution of D,
 *     A' = -i r A/2 + i (p + iq) B/2,   B' = i r B/2 + i (p - iq) A/2. */
static dd find_heading(kowalewski_work *w, const dd state[6], const cx sum[2], const cx slope[2])
{
    const double first = w->rates.rate[0].hi, second = w->rates.rate[1].hi;
    cx a = cx_add(sum[0], sum[1]), b = cx_sub(sum[0], sum[1]), da = cx_add(slope[0], slope[1]),
       x = cx_of(state[0].hi, state[1].hi);
    double spin = -0.5 * state[2].hi;
    if (cx_square(b) > cx_square(a)) {
        const cx other = a;
        a = b, b = other;
        da = cx_sub(slope[0], slope[1]);
        x = cx_conj(x);
        spin = -spin;
    }
    const cx turn = cx_mul(cx_of(-0.5 * x.im, 0.5 * x.re), cx_div(b, a));
    const double need = spin + turn.im - cx_div(da, a).im - w->rates.heading.hi;
    double best = INFINITY;
    int n1 = 0, n2 = 0;
    for (int i = -6; i <= 6; i++)
        for (int j = -6; j <= 6; j++) {
            const double miss =
                fabs(need - 0.5 * (i * first + j * second)) + 1e-9 * (abs(i) + abs(j));
            if (miss < best) best = miss, n1 = i, n2 = j;
        }
    w->rate_miss = fabs(need - 0.5 * (n1 * first + n2 * second));
    return dd_add(w->rates.heading,
                  dd_half(dd_add(dd_times(n1, w->rates.rate[0]), dd_times(n2, w->rates.rate[1]))));
}
/* Appends a theta sum to the solution, row by row. Negligible terms at both ends of a row of
 * coefficients are omitted. For a sum with real values, only one term of each complex conjugate
 * pair is stored, multiplied by two. Returns 0 if the array of terms or the array of rows is
 * full. */
static int append_rows(kr_theta_sums *plan, const theta_work *t, int sum, int which, double scale,
                       int *rows, int *terms)
{
    const int real = sum >= SUM_P, count = t->terms.count;
    double most = 0.0;
    plan->rows[sum] = 0;
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(coefficient(t, sum, &t->terms.term[i], which)));
    for (int from = 0, to; from < count; from = to) {
        const int k1 = t->terms.term[from].k1;
        for (to = from; to < count && t->terms.term[to].k1 == k1;) to++;
        for (int parity = 0; parity < 2 && (!real || k1 >= 0); parity++) {
            kr_sum_row row = {k1, 0, 0, is_imaginary(sum, parity)};
            const int begin = *terms;
            int end = begin;
            for (int i = from; i < to; i++) {
                const sum_term *n = &t->terms.term[i];
                const double c = coefficient(t, sum, n, which);
                if (odd(n->k2) != parity || (real && k1 == 0 && n->k2 < 0)) continue;
                if (end == begin && !(fabs(c) > 1e-18 * most)) continue;
                if (end == begin) row.k2 = n->k2;
                if (*terms == SUM_TERMS) return 0;
                plan->term[(*terms)++] = scale * (real && (k1 != 0 || n->k2 != 0) ? 2.0 * c : c);
                if (fabs(c) > 1e-18 * most) end = *terms;
            }
            *terms = end;
            row.count = end - begin;
            if (row.count == 0) continue;
            if (*rows == SUM_ROWS) return 0;
            plan->row[(*rows)++] = row;
            plan->rows[sum]++;
        }
    }
    return 1;
}
static void widen(kr_theta_sums *plan, const int most[2])
{
    for (int j = 0; j < 2; j++)
        if (most[j] > plan->wide[j]) plan->wide[j] = most[j];
}
/* Computes all theta sums of a Kowalewski top, and stores them in `plan`. Returns 0 if a theta sum
 * has more terms or rows than the arrays can hold. */
static int fill_sums(kr_theta_sums *plan, theta_work *t)
{
    static const int velocity_sums[2][2] = {{SUM_P, SUM_Q}, {SUM_P, SUM_R}};
    static const double none[2] = {0.0, 0.0};
    int rows = 0, terms = 0;
    double most = 0.0;
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < t->terms.count; i++)
            most = fmax(most, fabs(coefficient(t, spinor_sums[j], &t->terms.term[i], j)));
    plan->wide[0] = plan->wide[1] = 1;
    widen(plan, t->terms.wide);
    for (int j = 0; j < 2; j++)
        if (!append_rows(plan, t, spinor_sums[j], j, 1.0 / most, &rows, &terms)) return 0;
    t->misfit = 0.0;
    for (int sum = SUM_P; sum < SUMS; sum++) {
        const int *const two = velocity_sums[sum == SUM_R], which = sum != SUM_P;
        if (which == 0 || sum == SUM_R) {
            if (!list_terms(&t->matrix, t->kind, two, none, &t->terms)) return 0;
            widen(plan, t->terms.wide);
            fill_columns(t, two, ALL_SAMPLES);
        }
        find_velocity(t, two, which);
        if (!append_rows(plan, t, sum, which, 1.0 / most, &rows, &terms)) return 0;
    }
    return 1;
}
/* Appends the terms of a dual theta sum to the solution, grouped into rows of equal k1 and equal k2
 * modulo 4. Returns 0 if the array of terms or the array of rows is full. */
static int append_dual_rows(kr_theta_sums *plan, const theta_work *t, const dual_work *d, int sum,
                            int *rows, int *terms)
{
    const int words = sum < SUM_P ? 2 : 1;
    plan->rows[sum] = 0;
    for (int from = 0, to; from < d->count; from = to) {
        const int k1 = d->term[from].k1;
        for (to = from; to < d->count && d->term[to].k1 == k1;) to++;
        for (int rest = 0; rest < 4; rest++) {
            kr_sum_row row = {k1, 0, 0, 0};
            for (int i = from; i < to; i++) {
                const dual_term *n = &d->term[i];
                cx c;
                if ((n->k2 & 3) != rest || !dual_coefficient(t, d, sum, n, &c)) continue;
                if (row.count == 0) row.k2 = n->k2;
                if (*terms + words > SUM_TERMS) return 0;
                plan->term[(*terms)++] = c.re;
                if (words == 2) plan->term[(*terms)++] = c.im;
                row.count++;
            }
            if (row.count == 0) continue;
            if (*rows == SUM_ROWS) return 0;
            plan->row[(*rows)++] = row;
            plan->rows[sum]++;
        }
    }
    return 1;
}
/* Computes the initial values of the theta sums S and T and of their time derivatives from the dual
 * sums. A growth rate that is common to S and T is omitted from the derivatives, because it does
 * not affect the heading. */
static void sum_dual_start(const kowalewski_work *w, const double beta[2], cx sum[2], cx slope[2])
{
    const dual_work *d = &w->dual;
    const double pi = 3.14159265358979323846, first = w->rates.rate[0].hi,
                 second = w->rates.rate[1].hi,
                 one = (d->bend[0] * first + d->bend[1] * second) / (4.0 * pi),
                 two = (d->bend[1] * first + d->bend[2] * second) / (4.0 * pi),
                 turn = -(one * beta[0] + two * beta[1]) * 2.0 / pi;
    growth_lanes growth;
    make_growth(d, w->start, &growth);
    for (int j = 0; j < 2; j++) {
        sum[j] = slope[j] = cx_of(0.0, 0.0);
        for (int i = 0; i < d->count; i++) {
            const dual_term *n = &d->term[i];
            cx c;
            if (!dual_coefficient(&w->theta, d, spinor_sums[j], n, &c)) continue;
            c = cx_scale(growth_at(&growth, n), c);
            sum[j] = cx_add(sum[j], c);
            slope[j] = cx_add(slope[j], cx_scale(n->k1 * one + n->k2 * two, c));
        }
        slope[j] = cx_add(slope[j], cx_scale(turn, cx_of(-sum[j].im, sum[j].re)));
    }
}
/* Computes and stores the coefficients of all dual theta sums for one value of beta. The constant
 * factors of the theta sums S and T must already have been fitted for this value of beta. Returns 0
 * if the array of terms or the array of rows is full. */
static int fill_dual_sums(kr_theta_sums *plan, theta_work *t, dual_work *d, const double beta[2])
{
    static const int velocity_sums[2][2] = {{SUM_P, SUM_Q}, {SUM_P, SUM_R}};
    static const double none[2] = {0.0, 0.0};
    const double pi = 3.14159265358979323846;
    int rows = 0, terms = 0;
    plan->dual = 1;
    memcpy(plan->bend, d->bend, sizeof plan->bend);
    memcpy(plan->wide, d->wide, sizeof plan->wide);
    for (int j = 0; j < 2; j++) {
        plan->twist[j] = -(d->bend[j] * beta[0] + d->bend[1 + j] * beta[1]) / (pi * pi);
        if (!append_dual_rows(plan, t, d, spinor_sums[j], &rows, &terms)) return 0;
    }
    size_dual_terms(d, none);
    t->misfit = 0.0;
    for (int sum = SUM_P; sum < SUMS; sum++) {
        const int *const two = velocity_sums[sum == SUM_R], which = sum != SUM_P;
        if (which == 0 || sum == SUM_R) fill_dual_columns(t, d, two, ALL_SAMPLES);
        find_velocity(t, two, which);
        if (!append_dual_rows(plan, t, d, sum, &rows, &terms)) return 0;
    }
    return 1;
}
/* Returns the largest of several error estimates for the theta sums. The estimates include the
 * residual of the fitted angular velocity, the asymmetry of B and the error of the heading rate. */
static double error_of_sums(const kowalewski_work *w)
{
    const theta_work *t = &w->theta;
    const double rates = 1.0 + fabs(w->rates.rate[0].hi) + fabs(w->rates.rate[1].hi);
    return fmax(fmax(t->certificate, t->misfit), fmax(t->matrix.asymmetry, w->rate_miss / rates));
}
/* Computes the theta sums and the rate of the heading. */
static kr_kowalewski_refusal make_sums(kowalewski_work *w, const dd state[6], kr_theta_sums *plan,
                                       dd *heading)
{
    cx sum[2], slope[2];
    plan->dual = 0;
    if (!find_spinor_class(&w->theta)) return KR_KOWALEWSKI_SUMS;
    sum_start(w, &w->theta, sum, slope);
    *heading = find_heading(w, state, sum, slope);
    return fill_sums(plan, &w->theta) ? KR_KOWALEWSKI_PLANNED : KR_KOWALEWSKI_TERMS;
}
/* Computes the dual theta sums and the rate of the heading angle. Returns 0 if the dual theta sums
 * are not accurate enough, or have more terms than the arrays can hold. */
static int make_dual_sums(kowalewski_work *w, const dd state[6], kr_theta_sums *plan, dd *heading)
{
    theta_work *t = &w->theta;
    dual_work *d = &w->dual;
    double least = INFINITY, beta[2];
    cx sum[2], slope[2];
    int best = 0;
    if (!list_dual_terms(&t->matrix, d)) return 0;
    for (int i = 0; i < SUMS; i++) {
        make_basis(t->kind, i, &d->basis[i]);
        find_factors(t->kind, i, &d->basis[i]);
    }
    for (int i = 0; i < SAMPLES; i++) make_growth(d, t->sample[i].theta, &d->growth[i]);
    for (int i = 0; i < 8 && !(least < 1e-12); i++) {
        find_beta(&t->matrix, i % 4, beta);
        t->certificate = find_dual_spinor(t, d, beta, i >= 4);
        if (t->certificate < least) least = t->certificate, best = i % 4;
    }
    if (!(least < SATISFIED)) return 0;
    if (least < t->certificate) {
        find_beta(&t->matrix, best, beta);
        t->certificate = find_dual_spinor(t, d, beta, 1);
    }
    sum_dual_start(w, beta, sum, slope);
    *heading = find_heading(w, state, sum, slope);
    return fill_dual_sums(plan, t, d, beta);
}
/* Returns the reason for rejecting a degenerate motion, or `refusal` if no specific reason applies.
 * The tests for degenerate motions tolerate rounding errors in the initial state. */
static kr_kowalewski_refusal name_motion(const kowalewski_top *top, kr_kowalewski_refusal refusal)
{
    const double p = top->state[0].hi, q = top->state[1].hi, r = top->state[2].hi,
                 g1 = top->state[3].hi, g2 = top->state[4].hi, g3 = top->state[5].hi,
                 size = 1.0 + v_largest(v3(p, q, r)), slack = 1e-13 * size;
    const kr_vec3 w = v3(p, q, r), slope = v3(q * r, -p * r - g3, g2);
    if (v_largest(slope) < 1e-8 && v_largest(w) < 1e-8) return KR_KOWALEWSKI_REST;
    if (v_largest(slope) < slack * size && v_largest(v_cross(v3(g1, g2, g3), w)) < slack)
        return KR_KOWALEWSKI_ROTATION;
    if (v_largest(v3(p, q, g3 * size)) < slack || v_largest(v3(p, r, g2 * size)) < slack)
        return KR_KOWALEWSKI_PLANAR;
    return refusal;
}
/* Computes all quantities that determine the theta sums: roots, arcs, periods, samples and rates.
 * Returns KR_KOWALEWSKI_PLANNED on success, or the reason for the failure. */
static kr_kowalewski_refusal analyse_curve(const kowalewski_top *top, kowalewski_work *w)
{
    kowalewski_curve *o = &w->curve;
    set_constants(o, top->state, top->l);
    o->settled = SETTLED;
    /* Relative to a larger h, k^2 and -c = k^2 - 1 coincide. */
    if (!(fabs(o->h.hi) < 1e12)) return KR_KOWALEWSKI_COINCIDENT;
    find_roots(o);
    w->separatrix = separatrix_error(o);
    if (!(w->separatrix < 1e-14)) return KR_KOWALEWSKI_SEPARATRIX;
    const double distance = least_distance(o);
    if (!(distance > 1e-24)) return KR_KOWALEWSKI_COINCIDENT;
    /* The formulas for the initial state contain divisions by the distances between branch
     * points. */
    const kr_kowalewski_refusal unresolved =
        distance < 1e-12 ? KR_KOWALEWSKI_COINCIDENT : KR_KOWALEWSKI_START;
    if (!is_on_arcs(o, top->state)) return unresolved;
    make_arcs(o, w->arc);
    if (!average_arcs(o, w->arc, &w->table, &w->samples, &w->rates) ||
        !make_periods(o, w->arc, &w->rates, &w->theta.matrix))
        return KR_KOWALEWSKI_INTEGRALS;
    refine_cosines(&w->table, GRID / SAMPLE_STEPS);
    const double miss = find_start(o, w->arc, &w->rates, top->state, &w->roots, w->start);
    if (!(miss < 1e-14)) return miss < 1e-6 ? KR_KOWALEWSKI_SEPARATRIX : unresolved;
    w->theta.kind = kind_of(o);
    make_samples(w, w->theta.sample);
    return KR_KOWALEWSKI_PLANNED;
}
/* Returns the ratio of the smallest to the largest value of the denominator D at the sample points.
 * A small ratio indicates cancellation between the terms of the theta sums. */
static double least_size(const theta_work *t)
{
    double least = INFINITY, most = 0.0;
    for (int i = 0; i < SAMPLES; i++) {
        least = fmin(least, t->sample[i].size);
        most = fmax(most, t->sample[i].size);
    }
    return least / most;
}
/* Sets the rates and the initial phases of the two torus angles. Also sets the rate of the phase of
 * the factor e to `heading`; the caller must set the initial value of this phase. */
static void set_phases(const kowalewski_work *w, dd heading, kr_theta_sums *plan)
{
    const dd rate[3] = {dd_half(w->rates.rate[0]), dd_half(w->rates.rate[1]), heading};
    for (int i = 0; i < 3; i++) {
        plan->torus.turn[i] = phase_of(rate[i]);
        phase_start(&plan->torus.turn[i],
                    i < 2 ? dd_times(0.5 * w->start[i], one_turn()) : dd_of(0.0));
    }
}
#endif
