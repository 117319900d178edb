/* Solves small dense least-squares problems in double precision by Householder QR factorization
 * with column pivoting. The columns of the matrix are first scaled to unit length. A column shorter
 * than 1e-12 times the longest one is treated as zero. */
#ifndef KR_EXACT_LEAST_SQUARES_H
#define KR_EXACT_LEAST_SQUARES_H
#include <math.h>
#include <string.h>

enum { LSQ_ROWS = 72, LSQ_COLUMNS = 8 };

/* A matrix in column-major order. `rank` is the number of columns that are not treated as zero. */
typedef struct lsq {
    int rows, columns, rank;
    double a[LSQ_COLUMNS][LSQ_ROWS];
    double size[LSQ_COLUMNS]; /* original lengths; 0 for a column that counts as zero */
    int from[LSQ_COLUMNS];    /* index of each column before the exchanges */
    double diagonal[LSQ_COLUMNS];
} lsq;

static inline double lsq_length(const double *x, int from, int to)
{
    double sum = 0.0;
    for (int i = from; i < to; i++) sum += x[i] * x[i];
    return sqrt(sum);
}
static inline void lsq_exchange(lsq *m, int i, int j)
{
    double column[LSQ_ROWS];
    const double size = m->size[i];
    const int from = m->from[i];
    if (i == j) return;
    memcpy(column, m->a[i], sizeof column);
    memcpy(m->a[i], m->a[j], sizeof column);
    memcpy(m->a[j], column, sizeof column);
    m->size[i] = m->size[j];
    m->size[j] = size;
    m->from[i] = m->from[j];
    m->from[j] = from;
}
/* Scales the columns of the matrix to unit length, and moves all columns that are treated as zero
 * to the end. */
static inline void lsq_scale(lsq *m)
{
    double size = 0.0;
    m->rank = m->columns;
    for (int j = 0; j < m->columns; j++) {
        m->from[j] = j;
        m->size[j] = lsq_length(m->a[j], 0, m->rows);
        size = fmax(size, m->size[j]);
    }
    for (int j = 0; j < m->rank; j++)
        if (!(m->size[j] > 1e-12 * size)) {
            m->size[j] = 0.0;
            lsq_exchange(m, j--, --m->rank);
        }
    for (int j = 0; j < m->rank; j++)
        for (int i = 0; i < m->rows; i++) m->a[j][i] /= m->size[j];
}
/* Applies the k-th Householder reflection to x. Column k stores the reflection vector in its
 * elements from the diagonal downwards. */
static inline void lsq_reflect(const lsq *m, int k, double *x)
{
    const double *v = m->a[k];
    double dot = 0.0, square = 0.0;
    for (int i = k; i < m->rows; i++) {
        dot += v[i] * x[i];
        square += v[i] * v[i];
    }
    if (square == 0.0) return;
    const double s = 2.0 * dot / square;
    for (int i = k; i < m->rows; i++) x[i] -= s * v[i];
}
/* Factors the matrix. The elements of column k above the diagonal become elements of R; the
 * remaining elements of the column store the k-th Householder reflection. */
static inline void lsq_factor(lsq *m)
{
    lsq_scale(m);
    for (int k = 0; k < m->rank; k++) {
        int pivot = k;
        double most = -1.0;
        for (int j = k; j < m->rank; j++) {
            const double rest = lsq_length(m->a[j], k, m->rows);
            if (rest > most) most = rest, pivot = j;
        }
        lsq_exchange(m, k, pivot);
        const double beta = m->a[k][k] < 0.0 ? most : -most;
        m->a[k][k] -= beta;
        m->diagonal[k] = beta;
        for (int j = k + 1; j < m->rank; j++) lsq_reflect(m, k, m->a[j]);
    }
}
/* Solves R x = y for the first n unknowns. */
static inline void lsq_back(const lsq *m, int n, double *y)
{
    for (int j = n - 1; j >= 0; j--) {
        y[j] /= m->diagonal[j];
        for (int i = 0; i < j; i++) y[i] -= m->a[j][i] * y[j];
    }
}
/* Solves R^t x = y. */
static inline void lsq_forward(const lsq *m, double *y)
{
    for (int j = 0; j < m->rank; j++) {
        for (int i = 0; i < j; i++) y[j] -= m->a[j][i] * y[i];
        y[j] /= m->diagonal[j];
    }
}
/* Writes the unknowns in the order of the original columns, with the column scaling undone. */
static inline void lsq_unscale(const lsq *m, const double *x, double *out)
{
    for (int j = 0; j < m->columns; j++) out[m->from[j]] = j < m->rank ? x[j] / m->size[j] : 0.0;
}
/* Solves a least-squares problem for a factored matrix, overwriting the right-hand side. A column
 * is omitted if its diagonal element in the triangular factor R is at most 1e-13 times the first
 * one. */
static inline void lsq_solve(const lsq *m, double *right, double *out)
{
    int n = 0;
    while (n < m->rank && fabs(m->diagonal[n]) > 1e-13 * fabs(m->diagonal[0])) n++;
    for (int k = 0; k < n; k++) lsq_reflect(m, k, right);
    lsq_back(m, n, right);
    for (int j = n; j < m->columns; j++) right[j] = 0.0;
    lsq_unscale(m, right, out);
}
static inline double lsq_normalise(double *x, int n)
{
    const double size = lsq_length(x, 0, n);
    for (int i = 0; i < n; i++) x[i] /= size;
    return size;
}
/* Replaces x by (R^t R)^-1 x, scaled to unit length. Returns the length of the vector before
 * scaling. */
static inline double lsq_iterate(const lsq *m, double *x)
{
    lsq_forward(m, x);
    lsq_back(m, m->rank, x);
    return lsq_normalise(x, m->rank);
}
/* Writes the singular vector for the smallest singular value of a factored matrix. Returns the
 * ratio of the smallest singular value of the matrix to the second smallest one. The singular
 * vectors for the two smallest singular values are computed by inverse iteration, with the second
 * vector kept orthogonal to the first. */
static inline double lsq_null(lsq *m, double *out)
{
    double x[LSQ_COLUMNS] = {0.0}, y[LSQ_COLUMNS], last = 0.0, second = 0.0;
    const int n = m->rank;
    for (int j = 0; j < n; j++)
        if (fabs(m->diagonal[j]) < 1e-30) m->diagonal[j] = 1e-30;
    for (int i = 0; i < n; i++) x[i] = 1.0 + 0.1 * i;
    for (int step = 0; step < 4; step++) last = lsq_iterate(m, x);
    for (int i = 0; i < n; i++) y[i] = i % 2 ? 1.0 : -0.7 + 0.01 * i;
    for (int step = 0; step < 4 && n > 1; step++) {
        double dot = 0.0;
        for (int i = 0; i < n; i++) dot += x[i] * y[i];
        for (int i = 0; i < n; i++) y[i] -= dot * x[i];
        lsq_normalise(y, n);
        lsq_forward(m, y);
        second = lsq_length(y, 0, n);
        lsq_back(m, n, y);
        dot = 0.0;
        for (int i = 0; i < n; i++) dot += x[i] * y[i];
        for (int i = 0; i < n; i++) y[i] -= dot * x[i];
        lsq_normalise(y, n);
    }
    lsq_unscale(m, x, out);
    return n > 1 ? second / sqrt(last) : 1.0;
}
#endif
