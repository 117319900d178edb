/* Even periodic functions of an angle, sampled at equal intervals. This header provides a table of
 * cosines in double-double precision and a function that integrates sampled functions. The
 * trapezoidal rule converges exponentially for analytic periodic functions.
 *
 * This header is compiled once for each instruction set. The including file must define GRID, the
 * largest number of intervals between 0 and pi. */
#ifndef KR_EXACT_COSINES_H
#define KR_EXACT_COSINES_H
#include "math/dd.h"

static inline dd dd_plus(dd a, double b) { return dd_add(a, dd_of(b)); }

/* The values cos(pi * i / GRID). Only the cosines whose index i is a multiple of `stride` have been
 * computed. */
typedef struct cosine_table {
    int stride;
    dd c[GRID + 1];
} cosine_table;

static void begin_cosines(cosine_table *t)
{
    t->stride = GRID / 2;
    t->c[0] = dd_of(1.0);
    t->c[GRID / 2] = dd_of(0.0);
    t->c[GRID] = dd_of(-1.0);
}
/* Extends the cosine table to all multiples of `stride`. */
static void refine_cosines(cosine_table *t, int stride)
{
    while (t->stride > stride) {
        const int s = t->stride /= 2;
        t->c[s] = dd_sqrt(dd_half(dd_plus(t->c[2 * s], 1.0)));
        const dd scale = dd_div(dd_of(0.5), t->c[s]);
        for (int i = 3 * s; i < GRID; i += 2 * s)
            t->c[i] = dd_mul(scale, dd_add(t->c[i - s], t->c[i + s]));
    }
}
/* Subtracts the average from an even function, and computes the sine series of the integral of the
 * remainder. The array `v` contains samples of the function at n + 1 angles from 0 to pi. */
static void integrate_samples(const dd v[], const cosine_table *table, int n, double out[])
{
    const int stride = GRID / n;
    for (int k = 1; k < n; k++) {
        const double sign = k % 2 ? -1.0 : 1.0;
        double sum = 0.5 * (v[0].hi + sign * v[GRID].hi);
        /* The values cos(k x) and cos(k (pi - x)) differ at most in sign. The loop ends at pi/2, an
         * angle that has no such partner. */
        for (int i = 1, at = k; i <= n / 2; i++) {
            const double pair =
                2 * i < n ? v[i * stride].hi + sign * v[GRID - i * stride].hi : v[i * stride].hi;
            sum += pair * table->c[(at <= n ? at : 2 * n - at) * stride].hi;
            at += k;
            if (at >= 2 * n) at -= 2 * n;
        }
        out[k] = 2.0 * sum / n / k;
    }
    out[0] = 0.0;
}
#endif
