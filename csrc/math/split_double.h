/* Sums of products, computed with negligible cancellation errors. The products are computed exactly
 * (two_product, dd.h). Each sum is represented by up to four doubles, and is as accurate as if
 * computed with four times the precision of a double (SumK, Ogita, Rump and Oishi, SISC 26, 2005).
 * Sums for the three components of a vector are interleaved, so that they can run in parallel. */
#ifndef KR_SPLIT_DOUBLE_H
#define KR_SPLIT_DOUBLE_H
#include "su2_dd.h"

enum { SPLIT_MAX = 4, SPLIT_PRODUCTS = 8, SPLIT_TERMS = SPLIT_PRODUCTS * SPLIT_MAX * 4 };
/* A vector represented as the unevaluated sum part[0] + ... + part[count - 1]. */
typedef struct split_vec {
    int count;
    double part[SPLIT_MAX][3];
} split_vec;

static inline split_vec split_from_vector(kr_vec3 v) { return (split_vec){1, {{v.x, v.y, v.z}}}; }
static inline dd split_dd(const split_vec *v, int i)
{
    return dd_add(two_sum(v->part[0][i], v->part[1][i]), two_sum(v->part[2][i], v->part[3][i]));
}
/* Returns x[0] + ... + x[n - 1], and overwrites the vectors x[...]. Requires n >= 4. */
static inline split_vec split_sum(double x[][3], int n)
{
    split_vec sum = {SPLIT_MAX, {{0.0}}};
    for (int round = 0; round < SPLIT_MAX; round++) {
        for (int k = 1; k < n - round; k++)
            for (int i = 0; i < 3; i++) {
                const dd both = two_sum(x[k][i], x[k - 1][i]);
                x[k][i] = both.hi, x[k - 1][i] = both.lo;
            }
        for (int i = 0; i < 3; i++) sum.part[round][i] = x[n - 1 - round][i];
    }
    while (sum.count > 1 && v_largest(v_of(sum.part[sum.count - 1])) == 0.0) sum.count--;
    return sum;
}
/* Computes the product of a, b and component `from_component` of v exactly, as the sum of n doubles
 * terms[i][to_component] for 0 <= i < n. Here, n = 4 * v->count. */
static inline void split_product(double a, double b, const split_vec *v, int from_component,
                                 double terms[][3], int to_component)
{
    const dd ab = two_product(a, b);
    for (int k = 0; k < v->count; k++) {
        const dd high = two_product(ab.hi, v->part[k][from_component]),
                 low = two_product(ab.lo, v->part[k][from_component]);
        terms[4 * k][to_component] = high.hi, terms[4 * k + 1][to_component] = high.lo;
        terms[4 * k + 2][to_component] = low.hi, terms[4 * k + 3][to_component] = low.lo;
    }
}
/* Returns q* v q for a quaternion q of any norm: the vector v rotated by q*, times |q|^2. */
static inline split_vec split_turn_back_times_norm2(kr_quat q, const split_vec *v)
{
    const double w = q.w, u[3] = {q.x, q.y, q.z};
    const int n = 4 * v->count;
    double x[SPLIT_TERMS][3];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        split_product(w, w, v, i, x, i);
        split_product(u[i], u[i], v, i, x + n, i);
        split_product(-u[j], u[j], v, i, x + 2 * n, i);
        split_product(-u[k], u[k], v, i, x + 3 * n, i);
        split_product(2.0 * u[i], u[j], v, j, x + 4 * n, i);
        split_product(2.0 * w, u[k], v, j, x + 5 * n, i);
        split_product(2.0 * u[i], u[k], v, k, x + 6 * n, i);
        split_product(-2.0 * w, u[j], v, k, x + 7 * n, i);
    }
    return split_sum(x, SPLIT_PRODUCTS * n);
}
#endif
