/* Sums of products that lose nothing to cancellation: all products are exact, and their sum is as
 * good as one with four times the digits of a double (Ogita, Rump, Oishi, SIAM J. Sci. Comput. 26,
 * 2005, SumK). */
#ifndef KR_PARTS_H
#define KR_PARTS_H
#include "su2_dd.h"

enum { PARTS = 4, PARTS_TERMS = 8 * 4 * PARTS };
/* An unevaluated sum. */
typedef struct parts {
    double part[PARTS];
} parts;

static inline parts parts_of(double a)
{
    const parts p = {{a, 0.0, 0.0, 0.0}};
    return p;
}
static inline dd parts_dd(parts a)
{
    return dd_add(two_sum(a.part[0], a.part[1]), two_sum(a.part[2], a.part[3]));
}
/* Returns the sum of n numbers, which do not outlive it: each round leaves their errors behind. */
static inline parts parts_sum(double x[], int n)
{
    parts sum;
    for (int round = 0; round < PARTS; round++) {
        for (int i = 1; i < n - round; i++) {
            const dd both = two_sum(x[i], x[i - 1]);
            x[i] = both.hi, x[i - 1] = both.lo;
        }
        sum.part[round] = x[n - 1 - round];
    }
    return sum;
}
/* Writes a b c as a sum of doubles; returns how many. */
static inline int parts_product(double a, double b, const parts *c, double to[])
{
    const dd ab = two_product(a, b);
    int n = 0;
    for (int i = 0; i < PARTS; i++) {
        if (c->part[i] == 0.0) continue;
        const dd high = two_product(ab.hi, c->part[i]), low = two_product(ab.lo, c->part[i]);
        to[n++] = high.hi, to[n++] = high.lo, to[n++] = low.hi, to[n++] = low.lo;
    }
    return n;
}
/* Returns one component of q* v q, for a q of any length. */
static inline parts parts_turned_back(kr_quat q, const parts v[3], int i)
{
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double w = q.w, u[3] = {q.x, q.y, q.z};
    double x[PARTS_TERMS];
    int n = parts_product(w, w, &v[i], x);
    n += parts_product(u[i], u[i], &v[i], x + n);
    n += parts_product(-u[j], u[j], &v[i], x + n);
    n += parts_product(-u[k], u[k], &v[i], x + n);
    n += parts_product(2.0 * u[i], u[j], &v[j], x + n);
    n += parts_product(2.0 * w, u[k], &v[j], x + n);
    n += parts_product(2.0 * u[i], u[k], &v[k], x + n);
    n += parts_product(-2.0 * w, u[j], &v[k], x + n);
    return n > 0 ? parts_sum(x, n) : parts_of(0.0);
}
#endif
