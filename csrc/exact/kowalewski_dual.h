/* Theta sums of a Kowalewski top after Poisson summation. Near a separatrix, an eigenvalue of B is
 * small, and the terms of the theta sums nearly cancel. Poisson summation transforms the theta sums
 * into series whose terms do not cancel. With z = theta + i beta, the sum of the terms of a class r
 * is
 *     const sum_k exp(2 pi i k r - (z - 2 pi k) B^-1 (z - 2 pi k)/2),
 * where k runs over the dual of the lattice of the class, shifted according to its signs. A factor
 * that all theta sums have in common is omitted. The factor exp(-i theta B^-1 beta) is omitted from
 * the sums, because it is already contained in the complex factor e. With theta between -2 pi and 2
 * pi and k = (k1, k2)/4, the remaining sum is
 *     sum of c[k1, k2] exp((k1 a1 + k2 a2) / 4),  a = 2 pi B^-1 theta.
 * One constant factor is fitted for each linear combination of term classes, because these
 * combinations contain fewer terms than the classes themselves. Poisson summation is exact. The
 * rules that determine the class and the sign of each term were found numerically and have not been
 * proved (kowalewski_theta.h). docs/theory/closed_form.md gives the errors near separatrices.
 *
 * This header is compiled once for each instruction set. */
#ifndef KR_KOWALEWSKI_DUAL_H
#define KR_KOWALEWSKI_DUAL_H
#include "kowalewski_state.h"
#include "kowalewski_theta.h"

/* Linear combinations of partial theta sums, where each partial sum contains the terms of one
 * residue class of (k1, k2). The element weight[b][i] is the coefficient of the i-th class of terms
 * in linear combination b. The basis contains as many linear combinations as there are classes of
 * terms. */
typedef struct dual_basis {
    int count, first[CLASSES], second[CLASSES]; /* 2 r of each class */
    int half[2][CLASSES];                       /* twice the shifts of each class */
    double weight[CLASSES][CLASSES];
    cx factor[CLASSES][8][8]; /* of term k1, k2 in each combination, at k1 and k2 modulo 8 */
} dual_basis;
typedef struct dual_term {
    int k1, k2;
    cx size;
} dual_term;
/* The terms of the dual theta sums for one value of beta, sorted by k1 and then by k2. */
typedef struct dual_work {
    double bend[3]; /* 2 pi^2 B^-1 */
    double lift;    /* logarithm of a factor of all terms */
    int count, wide[2];
    dual_term term[TERMS];
    dual_basis basis[SUMS];
    growth_lanes growth[SAMPLES]; /* at each sample */
} dual_work;

/* Returns the root of unity exp(2 pi i n/8). */
static cx eighth_turn(int n)
{
    const double half = 0.70710678118654752440;
    const double c[8] = {1.0, half, 0.0, -half, -1.0, -half, 0.0, half};
    return cx_of(c[n & 7], c[(n + 6) & 7]);
}
/* Returns the factor of the term with the indices (k1, k2) in class i of a theta sum; the factor is
 * zero or an eighth root of unity. */
static cx factor_of_class(const dual_basis *b, int kind, int sum, int i, int k1, int k2)
{
    const int pairs = has_pairs(kind), one = 2 * b->half[0][i], two = 2 * b->half[1][i];
    const int is_in = pairs ? ((k1 - one) & 3) == 0 && ((k2 - two) & 3) == 0
                            : ((k1 + k2 - one) & 3) == 0 && ((2 * k2 - two) & 3) == 0;
    if (!is_in) return cx_of(0.0, 0.0);
    return eighth_turn(k1 * b->first[i] + k2 * b->second[i] +
                       (is_imaginary(sum, b->second[i]) ? 2 : 0));
}
/* Appends the part of a linear combination that is orthogonal to the combinations already in the
 * list, unless this part is too small. */
static void append_combination(dual_basis *b, int *found, const double weight[])
{
    double rest[CLASSES], size = 0.0, left = 0.0;
    for (int i = 0; i < b->count; i++) size += weight[i] * weight[i];
    memcpy(rest, weight, sizeof rest);
    for (int j = 0; j < *found; j++) {
        double dot = 0.0, square = 0.0;
        for (int i = 0; i < b->count; i++) {
            dot += rest[i] * b->weight[j][i];
            square += b->weight[j][i] * b->weight[j][i];
        }
        for (int i = 0; i < b->count; i++) rest[i] -= dot / square * b->weight[j][i];
    }
    for (int i = 0; i < b->count; i++) left += rest[i] * rest[i];
    if (*found < b->count && size > 0.25 && left > 0.25 * size)
        memcpy(b->weight[(*found)++], rest, sizeof rest);
}
/* Finds linear combinations of the term classes of a theta sum in which (k1, k2) takes only one or
 * two values modulo 8. */
static void make_basis(int kind, int sum, dual_basis *b)
{
    const int pairs = has_pairs(kind);
    int found = 0;
    memset(b, 0, sizeof *b);
    for (int k1 = 0; k1 < 2; k1++)
        for (int k2 = 0; k2 < (pairs ? 2 : 4); k2++) {
            if (!has_class(kind, sum, class_of(kind, k1, k2))) continue;
            const int i = b->count++;
            b->first[i] = k1;
            b->second[i] = k2;
            b->half[0][i] = sign_of_term(kind, sum, k1 + 2, k2 + (pairs ? 0 : 2)) < 0.0;
            b->half[1][i] = sign_of_term(kind, sum, k1, k2 + (pairs ? 2 : 4)) < 0.0;
        }
    for (int k = 0; found < b->count; k++) /* at most 64 in all kinds and sums */
        for (int which = 0; which < b->count; which++)
            for (int part = 0; part < 2; part++) {
                double weight[CLASSES] = {0.0};
                for (int i = 0; i < b->count; i++) {
                    /* Two classes of terms can be combined only if their lattices have equal
                     * shifts. */
                    if (b->half[0][i] != b->half[0][which] || b->half[1][i] != b->half[1][which])
                        continue;
                    const cx f = factor_of_class(b, kind, sum, i, k / 8, k % 8);
                    weight[i] = part ? -f.im : f.re;
                }
                append_combination(b, &found, weight);
            }
}
/* Computes the factor of each term of the theta sum in each linear combination of term classes.
 * Factors that differ from zero only by rounding errors are set to zero. */
static void find_factors(int kind, int sum, dual_basis *b)
{
    for (int k = 0; k < 64; k++) {
        cx of_class[CLASSES];
        for (int i = 0; i < b->count; i++)
            of_class[i] = factor_of_class(b, kind, sum, i, k / 8, k % 8);
        for (int which = 0; which < b->count; which++) {
            cx f = cx_of(0.0, 0.0);
            for (int i = 0; i < b->count; i++)
                f = cx_add(f, cx_scale(b->weight[which][i], of_class[i]));
            b->factor[which][k / 8][k % 8] = cx_square(f) > 1e-20 ? f : cx_of(0.0, 0.0);
        }
    }
}
static cx factor_of(const dual_basis *b, int which, const dual_term *n)
{
    return b->factor[which][n->k1 & 7][n->k2 & 7];
}
/* Returns the minimum of (theta - 2 pi k) B^-1 (theta - 2 pi k)/2 over all theta with components
 * between -2 pi and 2 pi. */
static double distance_to_cell(const double bend[3], double k1, double k2)
{
    /* With theta = 2 pi x, |x| <= 1. The minimum is found by alternating minimization over the two
     * coordinates. */
    double x = fmax(-1.0, fmin(1.0, k1)), y = fmax(-1.0, fmin(1.0, k2));
    for (int i = 0; i < 40; i++) {
        const double before = y;
        x = fmax(-1.0, fmin(1.0, k1 - bend[1] / bend[0] * (y - k2)));
        y = fmax(-1.0, fmin(1.0, k2 - bend[1] / bend[2] * (x - k1)));
        if (y == before) break;
    }
    return bend[0] * (x - k1) * (x - k1) + bend[2] * (y - k2) * (y - k2) +
           2.0 * bend[1] * (x - k1) * (y - k2);
}
/* Returns the negative logarithm of the magnitude of the coefficient of one term of a dual theta
 * sum. */
static dd exponent_of_term(const dual_work *d, const dual_term *n)
{
    const dd a = dd_times(n->k1 * n->k1 / 16.0, dd_of(d->bend[0])),
             b = dd_times(n->k1 * n->k2 / 8.0, dd_of(d->bend[1])),
             c = dd_times(n->k2 * n->k2 / 16.0, dd_of(d->bend[2]));
    return dd_add(dd_add(a, c), b);
}
/* Chooses a scale factor for all terms that keeps the smallest one within the range of doubles.
 * Returns 0 if the growth factors or the squares of the sums would overflow. */
static int scale_dual_terms(dual_work *d)
{
    const double across = fabs(d->bend[1]), first = d->bend[0] + across,
                 second = d->bend[2] + across;
    double most = 0.0;
    for (int i = 0; i < d->count; i++) most = fmax(most, exponent_of_term(d, &d->term[i]).hi);
    d->lift = fmax(most - 690.0, 0.0);
    return d->wide[0] * first < 1380.0 && d->wide[1] * second < 1380.0 &&
           d->lift + first + second < 340.0;
}
/* Lists the terms of the dual theta sums that are significant at some point of the torus. Returns 0
 * if an array is too small for the terms, or if a term would exceed the range of doubles. */
static int list_dual_terms(const kowalewski_matrix *m, dual_work *d)
{
    const double pi = 3.14159265358979323846, det = m->b11 * m->b22 - m->b12 * m->b12,
                 mean = 0.5 * (m->b11 + m->b22), least = det / (mean + sqrt(mean * mean - det)),
                 cut = 37.0 + 5.0 / least, b[2] = {m->b11, m->b22};
    int most[2];
    d->bend[0] = 2.0 * pi * pi * m->b22 / det;
    d->bend[1] = -2.0 * pi * pi * m->b12 / det;
    d->bend[2] = 2.0 * pi * pi * m->b11 / det;
    d->count = d->wide[0] = d->wide[1] = 0;
    for (int j = 0; j < 2; j++) {
        const double reach = 4.0 * (1.0 + sqrt(2.0 * cut * b[j]) / (2.0 * pi));
        if (!(reach < WIDE_MOST)) return 0;
        most[j] = (int)reach;
    }
    for (int k1 = -most[0]; k1 <= most[0]; k1++)
        for (int k2 = -most[1]; k2 <= most[1]; k2++) {
            if (!(distance_to_cell(d->bend, 0.25 * k1, 0.25 * k2) < cut)) continue;
            if (d->count == TERMS) return 0;
            dual_term *n = &d->term[d->count++];
            n->k1 = k1;
            n->k2 = k2;
            if (abs(k1) > d->wide[0]) d->wide[0] = abs(k1);
            if (abs(k2) > d->wide[1]) d->wide[1] = abs(k2);
        }
    return scale_dual_terms(d);
}
/* Computes the coefficients of the dual theta sums for one value of beta, without the constant
 * factors. */
static void size_dual_terms(dual_work *d, const double beta[2])
{
    const double pi = 3.14159265358979323846,
                 one = (d->bend[0] * beta[0] + d->bend[1] * beta[1]) / (8.0 * pi * pi),
                 two = (d->bend[1] * beta[0] + d->bend[2] * beta[1]) / (8.0 * pi * pi);
    for (int i = 0; i < d->count; i++) {
        dual_term *n = &d->term[i];
        const exponential e = exponential_of(dd_sub(dd_of(d->lift), exponent_of_term(d, n)));
        double s, t;
        sincos_turns(dd_of(n->k1 * one + n->k2 * two), &s, &t);
        n->size = cx_scale(e.plus * (e.even + e.odd), cx_of(t, s));
    }
}
/* Computes the powers exp(k a1/4) and exp(k a2/4) at a point on the torus. */
static void make_growth(const dual_work *d, const double theta[2], growth_lanes *w)
{
    const double fourth = 0.25 * 0.31830988618379067154; /* 1/(4 pi) */
    dd x[2];
    for (int j = 0; j < 2; j++) x[j] = dd_of(fourth * theta[j] - nearest(fourth * theta[j]));
    fill_growth(d->bend, d->wide, x, w);
}
/* Returns the factor exp((k1 a1 + k2 a2)/4) of a term in a dual theta sum. */
static double growth_at(const growth_lanes *w, const dual_term *n)
{
    return w->one[WIDE_MOST + n->k1] * w->two[n->k2 & 3][(n->k2 + WIDE_MOST) / 4];
}
/* Adds one term of a dual theta sum to each linear combination of term classes, at the selected
 * sample points. */
static void add_dual_term(theta_work *w, const dual_work *d, int sum, int which, const dual_term *n,
                          sample_choice choice)
{
    const dual_basis *b = &d->basis[sum];
    for (int c = 0, at = 0; c < b->count; c++, at++) {
        while (!has_class(w->kind, sum, at)) at++;
        const cx f = cx_mul(n->size, factor_of(b, c, n));
        if (cx_square(f) == 0.0) continue;
        for (int i = 0; i < SAMPLES; i++) {
            if (!is_chosen(i, choice)) continue;
            cx *to = &w->column[i][which][at];
            *to = cx_add(*to, cx_scale(growth_at(&d->growth[i], n), f));
        }
    }
}
/* For two theta sums, evaluates the linear combinations of the classes of terms at the selected
 * sample points. */
static void fill_dual_columns(theta_work *w, const dual_work *d, const int sum[2],
                              sample_choice choice)
{
    for (int i = 0; i < SAMPLES; i++)
        if (is_chosen(i, choice)) memset(w->column[i], 0, sizeof w->column[i]);
    for (int i = 0; i < d->count; i++)
        for (int j = 0; j < 2; j++) add_dual_term(w, d, sum[j], j, &d->term[i], choice);
}
/* Estimates the magnitude of the dual theta sums at each selected sample point. */
static void size_dual_samples(theta_work *w, sample_choice choice)
{
    for (int i = 0; i < SAMPLES; i++) {
        double size = 0.0;
        if (!is_chosen(i, choice)) continue;
        for (int j = 0; j < 2; j++)
            for (int c = 0; c < CLASSES; c++) size += cx_square(w->column[i][j][c]);
        w->sample[i].size = sqrt(size);
    }
}
/* Fits the constant factors of the dual theta sums S and T for a given value of beta. */
static double find_dual_spinor(theta_work *w, dual_work *d, const double beta[2], int thorough)
{
    size_dual_terms(d, beta);
    fill_dual_columns(w, d, spinor_sums, THIRD_OF_SAMPLES);
    size_dual_samples(w, THIRD_OF_SAMPLES);
    if (!thorough && !(solve_spinor(w, THIRD_OF_SAMPLES) < NEARLY_SATISFIED)) return INFINITY;
    fill_dual_columns(w, d, spinor_sums, OTHER_SAMPLES);
    size_dual_samples(w, OTHER_SAMPLES);
    return solve_spinor_twice(w);
}
/* Computes the coefficient of one term in a dual theta sum. Returns 0 if the sum does not contain
 * the term. */
static int dual_coefficient(const theta_work *t, const dual_work *d, int sum, const dual_term *n,
                            cx *out)
{
    const dual_basis *b = &d->basis[sum];
    int has = 0;
    *out = cx_of(0.0, 0.0);
    for (int c = 0, at = 0; c < b->count; c++, at++) {
        while (!has_class(t->kind, sum, at)) at++;
        const cx f = factor_of(b, c, n);
        has |= cx_square(f) > 0.0;
        *out = cx_add(*out, cx_scale(t->constant[sum][at], f));
    }
    *out = cx_mul(*out, n->size);
    return has;
}
#endif
