/* The coefficients of the theta sums of a Kowalewski top. With n = (k1, k2)/2, up to a constant
 * factor for each class of n, the coefficients are
 *     c(n) = sign(n) (1, or i if k2 is odd) exp(-n B n/2 - n beta),
 * with beta = 0 for P, Q and R, and without the factor i for Q. The class and the sign of each term
 * of a theta sum depend on how the real roots of phi and the numbers k and -k are ordered. A theta
 * sum need not contain terms of every class. The rules were found numerically and have not been
 * proved, but confirmed for 1e6 random tops (docs/theory/closed_form.md). A solution is rejected if
 * its theta sums do not reproduce known states of the top. The constants of S and T are the null
 * vector of the equations
 *     (1 - g3)(S - T) = (g1 - i g2)(S + T)
 * at points of the torus. The constant factors of the theta sums P, Q and R are determined by
 * linear least squares.
 *
 * This header is compiled once for each instruction set. */
#ifndef KR_KOWALEWSKI_THETA_H
#define KR_KOWALEWSKI_THETA_H
#include <stdlib.h>
#include "kowalewski_periods.h"
#include "kowalewski_samples.h"
#include "least_squares.h"

/* The constants of the theta sums S and T count as determined if the ratio of the two smallest
 * singular values of the matrix of their equations is below SATISFIED. For a fit to only a third of
 * the samples, the less strict limit NEARLY_SATISFIED applies. */
#define SATISFIED 1e-8
#define NEARLY_SATISFIED 1e-5
enum { TERMS = 2048, CLASSES = 8, SAMPLES = SAMPLES_EACH * SAMPLES_EACH };
/* The kinds of Kowalewski curves, distinguished by the order of the real roots. If e denotes a root
 * of phi, the real roots of the six kinds have the orders -k e k, e -k k, e -k e e k, e e -k e k,
 * -k e e e k, and e e e -k k. */
enum { KIND_THREE, KIND_THREE_LOW, KIND_A, KIND_B, KIND_C, KIND_C_LOW, KINDS };

/* A term of a theta sum, without the constant factor that all terms of its class share. The array
 * `value` has one element for each of two theta sums, because the sign of the term may differ
 * between the sums. */
typedef struct sum_term {
    short k1, k2;
    double value[2];
} sum_term;
/* All significant terms of two theta sums for one value of beta, sorted by k1 and then by k2. The
 * array `wide` holds the largest |k1| and |k2|. */
typedef struct sum_terms {
    int count, wide[2];
    sum_term term[TERMS];
} sum_terms;

/* The state of a Kowalewski top at one point of its invariant torus. */
typedef struct torus_sample {
    double p, q, r;
    cx x, y; /* coefficients of the equation S x = T y */
    double theta[2];
    double size; /* D at this point */
} torus_sample;

typedef struct theta_work {
    kowalewski_matrix matrix;
    int kind;
    double rate[2], heading, certificate, misfit;
    sum_terms terms;
    double constant[SUMS][CLASSES];
    cx wave[2][2 * WIDE_MOST + 1];
    torus_sample sample[SAMPLES];
    cx column[SAMPLES][2][CLASSES]; /* sums over a class, for two sums at each sample */
    lsq lsq;
} theta_work;

static int odd(int k) { return k & 1; }
static int floor_half(int k) { return (k - odd(k)) / 2; }

static int kind_of(const kowalewski_curve *o)
{
    static const int five[] = {KIND_C, KIND_A, KIND_B, KIND_C_LOW};
    int at = 0; /* of -k */
    while (o->order[at] != ROOT_MINUS_K) at++;
    if (o->real == 3) return at == 0 ? KIND_THREE : KIND_THREE_LOW;
    return five[at];
}
static int has_pairs(int kind) { return kind == KIND_A || kind == KIND_B; }
static int class_of(int kind, int k1, int k2)
{
    if (has_pairs(kind)) return 2 * odd(k1) + odd(k2);
    return 4 * odd(k1) + ((k2 - 2 * floor_half(k1)) & 3);
}
/* Returns 1 if any term of the given theta sum belongs to the class with the given index. */
static int has_class(int kind, int sum, int index)
{
    /* In each table entry, bit i is set if the theta sum contains terms whose indices (k1, k2)
     * belong to residue class i. */
    static const unsigned char classes[KINDS][SUMS] = {
        {0x55, 0xaa, 0x55, 0x0a, 0xaa}, {0x0f, 0x0f, 0x0f, 0x0a, 0x0f},
        {0x0f, 0x0f, 0x07, 0x02, 0x0d}, {0x0f, 0x0f, 0x07, 0x02, 0x0d},
        {0x55, 0xaa, 0x55, 0x0a, 0xaa}, {0x0f, 0x0f, 0x0f, 0x0a, 0x0f},
    };
    return classes[kind][sum] >> index & 1;
}
/* Returns the sign of the term with the indices (k1, k2) in a given theta sum. */
static double sign_of_term(int kind, int sum, int k1, int k2)
{
    static const double signs[KINDS][SUMS][2] = {
        {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {-1, 1}},
        {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {-1, 1}},
        {{-1, 1}, {-1, -1}, {1, 1}, {1, -1}, {1, -1}},
        {{-1, 1}, {-1, -1}, {-1, -1}, {-1, 1}, {-1, 1}},
        {{-1, 1}, {1, 1}, {1, 1}, {-1, 1}, {-1, 1}},
        {{-1, 1}, {1, 1}, {1, 1}, {-1, 1}, {-1, 1}},
    };
    const int i = floor_half(k1), pairs = has_pairs(kind), rest = k2 - 2 * i - ((k2 - 2 * i) & 3),
              j = pairs ? floor_half(k2) : rest / 4,
              three = kind == KIND_THREE || kind == KIND_THREE_LOW,
              turned = odd(kind == KIND_A   ? k2
                           : kind == KIND_B ? k1
                           : three          ? k1 - k2
                                            : 0);
    const double first = signs[kind][sum][0], second = signs[kind][sum][1];
    double sign = 1.0;
    if (odd(i)) sign *= pairs && turned ? -first : first;
    if (odd(j)) sign *= turned ? -second : second;
    return sign;
}
static int is_imaginary(int sum, int k2) { return sum != SUM_Q && odd(k2); }

/* Returns exp(-x) for x >= 0. */
static double decay(dd x)
{
    const exponential e = exponential_of(dd_neg(x));
    return e.plus * (e.even + e.odd);
}
/* Lists the terms of two theta sums whose magnitude is at least e^-40 times the largest possible
 * magnitude. Returns 0 if the work arrays are too small for the terms. */
static int list_terms(const kowalewski_matrix *m, int kind, const int sum[2], const double beta[2],
                      sum_terms *out)
{
    const double det = m->b11 * m->b22 - m->b12 * m->b12, cut = 40.0,
                 x0 = -(m->b22 * beta[0] - m->b12 * beta[1]) / det,
                 y0 = -(m->b11 * beta[1] - m->b12 * beta[0]) / det,
                 rim = sqrt(2.0 * cut * m->b22 / det);
    out->count = out->wide[0] = out->wide[1] = 0;
    if (!(rim + fabs(x0) < 0.5 * WIDE_MOST)) return 0;
    for (int k1 = (int)ceil(2.0 * (x0 - rim)); k1 <= 2.0 * (x0 + rim); k1++) {
        const double x = 0.5 * k1 - x0, middle = y0 - m->b12 * x / m->b22,
                     left = cut - 0.5 * det / m->b22 * x * x,
                     half = sqrt(fmax(2.0 * left / m->b22, 0.0));
        if (!(half + fabs(middle) < 0.5 * WIDE_MOST)) return 0;
        const dd exact = two_sum(0.5 * k1, -x0), slope = dd_times(m->b12, exact),
                 base = dd_times(0.5 * m->b11, dd_square(exact));
        for (int k2 = (int)ceil(2.0 * (middle - half)); k2 <= 2.0 * (middle + half); k2++) {
            const dd y = two_sum(0.5 * k2, -y0);
            const int index = class_of(kind, k1, k2);
            if (!has_class(kind, sum[0], index) && !has_class(kind, sum[1], index)) continue;
            const double size =
                decay(dd_add(base, dd_mul(y, dd_add(dd_times(0.5 * m->b22, y), slope))));
            if (out->count == TERMS) return 0;
            sum_term *term = &out->term[out->count++];
            term->k1 = (short)k1;
            term->k2 = (short)k2;
            for (int i = 0; i < 2; i++) term->value[i] = size * sign_of_term(kind, sum[i], k1, k2);
            if (abs(k1) > out->wide[0]) out->wide[0] = abs(k1);
            if (abs(k2) > out->wide[1]) out->wide[1] = abs(k2);
        }
    }
    return out->count > 0;
}
/* Computes exp(i k theta/2) for all integers k from -`most` to `most`. To limit rounding errors,
 * each power is the product of two powers with nearly equal exponents. */
static void make_waves(double theta, int most, cx wave[])
{
    cx *w = wave + WIDE_MOST;
    w[0] = cx_of(1.0, 0.0);
    sin_cos(0.5 * theta, &w[1].im, &w[1].re);
    for (int k = 2; k <= most; k++) w[k] = cx_mul(w[k / 2], w[k - k / 2]);
    for (int k = 1; k <= most; k++) w[-k] = cx_conj(w[k]);
}
/* Adds up the terms of two theta sums at one point of the torus, separately for each class of
 * terms. Terms of a theta sum with the same index k1 belong to the same class if their indices k2
 * differ by a multiple of 4. */
static void sum_classes(theta_work *w, const int sum[2], const double theta[2], cx out[2][CLASSES])
{
    const sum_term *t = w->terms.term, *const end = t + w->terms.count;
    memset(out, 0, 2 * sizeof *out);
    for (int j = 0; j < 2; j++) make_waves(theta[j], w->terms.wide[j], w->wave[j]);
    while (t < end) {
        const int k1 = t->k1;
        cx row[2][4] = {{{0.0, 0.0}}};
        for (; t < end && t->k1 == k1; t++) {
            const cx wave = w->wave[1][WIDE_MOST + t->k2];
            for (int j = 0; j < 2; j++) {
                cx *to = &row[j][t->k2 & 3];
                to->re += t->value[j] * wave.re;
                to->im += t->value[j] * wave.im;
            }
        }
        for (int j = 0; j < 2; j++)
            for (int k2 = 0; k2 < 4; k2++) {
                const cx part = cx_mul(row[j][k2], w->wave[0][WIDE_MOST + k1]);
                cx *to = &out[j][class_of(w->kind, k1, k2)];
                *to = cx_add(*to, is_imaginary(sum[j], k2) ? cx_of(-part.im, part.re) : part);
            }
    }
}
static cx weigh(const cx column[CLASSES], const double constant[CLASSES])
{
    cx sum = {0.0, 0.0};
    for (int i = 0; i < CLASSES; i++) sum = cx_add(sum, cx_scale(constant[i], column[i]));
    return sum;
}
static const int spinor_sums[2] = {SUM_S, SUM_T};

/* Subsets of the samples used for fitting. The subset THIRD_OF_SAMPLES contains samples from all
 * rows and columns of the grid. A fit to a third of the samples suffices to reject a wrong
 * candidate for the vector b. */
typedef enum sample_choice { THIRD_OF_SAMPLES, OTHER_SAMPLES, ALL_SAMPLES } sample_choice;
static int is_chosen(int i, sample_choice choice)
{
    const int is_third = (i / SAMPLES_EACH + i) % 3 == 0;
    return choice == ALL_SAMPLES || is_third == (choice == THIRD_OF_SAMPLES);
}
static void fill_columns(theta_work *w, const int sum[2], sample_choice choice)
{
    for (int i = 0; i < SAMPLES; i++)
        if (is_chosen(i, choice)) sum_classes(w, sum, w->sample[i].theta, w->column[i]);
}
/* Fits the constant factors of the theta sums S and T to the samples selected by `choice`. The
 * equation for each sample point is divided by the approximate magnitude of S and T at this point.
 * Returns the ratio of the smallest singular value of the matrix of equations to the second
 * smallest one. */
static double solve_spinor(theta_work *w, sample_choice choice)
{
    lsq *m = &w->lsq;
    double null[LSQ_COLUMNS];
    m->columns = 0;
    for (int j = 0; j < 2; j++)
        for (int index = 0; index < CLASSES; index++) {
            if (!has_class(w->kind, spinor_sums[j], index)) continue;
            double *const a = m->a[m->columns++];
            m->rows = 0;
            for (int i = 0; i < SAMPLES; i++) {
                const torus_sample *s = &w->sample[i];
                if (!is_chosen(i, choice)) continue;
                const cx factor = cx_scale((j ? -1.0 : 1.0) / s->size, j ? s->y : s->x),
                         value = cx_mul(w->column[i][j][index], factor);
                a[m->rows++] = value.re;
                a[m->rows++] = value.im;
            }
        }
    lsq_factor(m);
    const double ratio = lsq_null(m, null);
    for (int j = 0, at = 0; j < 2; j++)
        for (int index = 0; index < CLASSES; index++)
            w->constant[spinor_sums[j]][index] =
                has_class(w->kind, spinor_sums[j], index) ? null[at++] : 0.0;
    return ratio;
}
/* Computes D, the common denominator of the components of the state, at all sample points. */
static void find_sizes(theta_work *w)
{
    for (int i = 0; i < SAMPLES; i++)
        w->sample[i].size = sqrt(0.5 * (cx_square(weigh(w->column[i][0], w->constant[SUM_S])) +
                                        cx_square(weigh(w->column[i][1], w->constant[SUM_T]))));
}
/* Fits the constant factors of the theta sums S and T to all samples. The fit is repeated with each
 * equation divided by D, the common denominator of the state, so that all errors are small relative
 * to D. Returns the ratio of the smallest singular value to the second smallest. */
static double solve_spinor_twice(theta_work *w)
{
    const double ratio = solve_spinor(w, ALL_SAMPLES);
    if (!(ratio < SATISFIED)) return ratio;
    find_sizes(w);
    const double better = solve_spinor(w, ALL_SAMPLES);
    find_sizes(w);
    return better;
}
/* Fits the constant factors of the theta sums S and T for a given value of beta. If `thorough` is
 * 0, the function first fits only a third of the samples, and fails if this fit is inaccurate.
 * Returns the ratio of the two smallest singular values, or INFINITY on failure. */
static double find_spinor(theta_work *w, const double beta[2], int thorough)
{
    if (!list_terms(&w->matrix, w->kind, spinor_sums, beta, &w->terms)) return INFINITY;
    for (int i = 0; i < SAMPLES; i++) w->sample[i].size = 1.0;
    fill_columns(w, spinor_sums, THIRD_OF_SAMPLES);
    if (!thorough && !(solve_spinor(w, THIRD_OF_SAMPLES) < NEARLY_SATISFIED)) return INFINITY;
    fill_columns(w, spinor_sums, OTHER_SAMPLES);
    return solve_spinor_twice(w);
}
/* Computes the vector beta from one of four candidates for the vector b, which differ by rows of
 * the matrix B/2. Multiples of the rows of B are added to beta such that the terms of the theta
 * sums become as small as possible. */
static void find_beta(const kowalewski_matrix *m, int i, double beta[2])
{
    const double det = m->b11 * m->b22 - m->b12 * m->b12,
                 x = (m->b22 * m->shift[0] - m->b12 * m->shift[1]) / det,
                 y = (m->b11 * m->shift[1] - m->b12 * m->shift[0]) / det;
    const int try1 = (i & 1) ^ 1, try2 = i >> 1;
    const double m1 = try1 + 2.0 * floor(0.5 * (2.0 * x - try1) + 0.5),
                 m2 = try2 + 2.0 * floor(0.5 * (2.0 * y - try2) + 0.5);
    beta[0] = 0.5 * (m->b11 * m1 + m->b12 * m2) - m->shift[0];
    beta[1] = 0.5 * (m->b12 * m1 + m->b22 * m2) - m->shift[1];
}
/* Fits the constant factors of the theta sums S and T for one of the four candidates for the vector
 * b. Returns the ratio of the two smallest singular values, or INFINITY on failure. */
static double try_spinor_class(theta_work *w, int i, int thorough)
{
    double beta[2];
    find_beta(&w->matrix, i, beta);
    return find_spinor(w, beta, thorough);
}
/* Tries the four candidates for the vector b until one of them satisfies the equations for S and T
 * to high accuracy. If no candidate for b reaches this accuracy, the candidate with the smallest
 * error is used.
 * Returns 0 if no candidate for the vector b satisfies the equations for S and T. */
static int find_spinor_class(theta_work *w)
{
    int best = 0;
    double least = INFINITY;
    for (int i = 0; i < 8; i++) {
        const double ratio = w->certificate = try_spinor_class(w, i % 4, i >= 4);
        if (ratio < 1e-13) return 1;
        if (ratio < least) least = ratio, best = i % 4;
    }
    if (!(least < SATISFIED)) return 0;
    w->certificate = try_spinor_class(w, best, 1);
    return 1;
}
/* Fits the constant factors of one of the theta sums P, Q and R. The largest residual is recorded
 * in `misfit`. */
static void find_velocity(theta_work *w, const int sum[2], int which)
{
    double right[LSQ_ROWS] = {0.0}, most = 0.0, miss = 0.0, solution[LSQ_COLUMNS];
    double *const constant = w->constant[sum[which]];
    lsq *m = &w->lsq;
    m->rows = 2 * SAMPLES;
    m->columns = 0;
    for (int index = 0; index < CLASSES; index++) {
        if (!has_class(w->kind, sum[which], index)) continue;
        double *const a = m->a[m->columns++];
        for (int i = 0; i < SAMPLES; i++) {
            const cx value = cx_scale(1.0 / w->sample[i].size, w->column[i][which][index]);
            a[2 * i] = value.re;
            a[2 * i + 1] = value.im;
        }
    }
    for (int i = 0; i < SAMPLES; i++) {
        const torus_sample *s = &w->sample[i];
        right[2 * i] = sum[which] == SUM_P ? s->p : sum[which] == SUM_Q ? s->q : s->r;
        most = fmax(most, fabs(right[2 * i]));
    }
    lsq_factor(m);
    lsq_solve(m, right, solution);
    for (int index = 0, at = 0; index < CLASSES; index++)
        constant[index] = has_class(w->kind, sum[which], index) ? solution[at++] : 0.0;
    /* After the reflections, the elements of the right-hand side beyond the columns are the
     * reflected residual, whose length is unchanged. */
    for (int i = m->columns; i < m->rows; i++) miss = fmax(miss, fabs(right[i]));
    w->misfit = fmax(w->misfit, miss / most);
}
#endif
