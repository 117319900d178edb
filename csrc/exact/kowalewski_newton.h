/* The angles y1 and y2 of the two arcs of a Kowalewski top for given torus angles. Newton's method
 * starts at values interpolated in a table. All steps but the last use only the largest terms of the
 * sine series, and take the second derivatives into account.
 *
 * If the arcs nearly touch, the Jacobian is almost singular, and Newton's method may fail. Let p_j
 * and q_j be the averages of dw/F and (w - w0) dw/F on the arcs, for a w0 between the arcs. Then
 * p1 theta1 - p2 theta2 and q1 theta1 - q2 theta2 are sums of a function of y1 and a function of
 * y2. Along a line where the first sum is constant, the second one is monotonic, because it grows
 * at the rate w1 - w2 > 0. Two nested searches with bisection therefore find the solution.
 *
 * This header is compiled once for each instruction set and number of lanes. */
#ifndef KR_KOWALEWSKI_NEWTON_H
#define KR_KOWALEWSKI_NEWTON_H
#include "kowalewski.h"
#include "math/trig.h"
#include "torus_state.h"

/* Number of series that a vector holds for a single top. */
#if defined KR_PLAIN || !(defined __SSE2__ || defined KR_NEON)
#  define LANES_OF_SERIES 1
#elif defined KR_AVX2
#  define LANES_OF_SERIES 4
#else
#  define LANES_OF_SERIES 2
#endif
enum { NEWTON_STEPS = 14, LAST_STEPS = 3 };
/* The cube of a small step is negligible. */
#define SMALL_STEP 3e-6

/* An angle y of an arc [turns], and its sine and cosine. */
typedef struct arc_angle {
    dd turns;
    wide s, c;
} arc_angle;

/* A vector that holds one of the four sine series of the torus angles in each of several lanes. If
 * there is a single top, its lanes are different series. */
#if defined KR_EXACT_LANES || LANES_OF_SERIES == 1
typedef wide series_group;
enum { GROUPS = 4 };
INLINE series_group load_series(const double *p) { return wide_splat(*p); }
INLINE void store_series(wide *out, series_group a) { *out = a; }
INLINE series_group for_arcs(int i, wide one, wide two) { return i < 2 ? one : two; }
enum { HEADING_GROUPS = 2 };
INLINE series_group for_heading(int i, wide one, wide two) { return i ? two : one; }
#else
typedef double series_group __attribute__((vector_size(8 * LANES_OF_SERIES)));
enum { GROUPS = 4 / LANES_OF_SERIES };
INLINE series_group load_series(const double *p)
{
    series_group r;
    memcpy(&r, p, sizeof r);
    return r;
}
INLINE void store_series(wide *out, series_group a) { memcpy(out, &a, sizeof a); }
INLINE series_group for_arcs(int i, wide one, wide two)
{
#  if LANES_OF_SERIES == 4
    const series_group r = {one, one, two, two};
#  else
    const series_group r = {i ? two : one, i ? two : one};
#  endif
    (void)i;
    return r;
}
enum { HEADING_GROUPS = 1 };
INLINE series_group for_heading(int i, wide one, wide two)
{
#  if LANES_OF_SERIES == 4
    const series_group r = {one, two, one, two};
#  else
    const series_group r = {one, two};
#  endif
    (void)i;
    return r;
}
#endif

/* The sines and cosines of the multiples of an angle up to 4. */
typedef struct multiples {
    series_group s[5], c[5];
} multiples;
INLINE multiples multiples_of(series_group s, series_group c)
{
    multiples m;
    m.s[1] = s, m.c[1] = c;
    m.s[2] = 2.0 * (s * c), m.c[2] = (c - s) * (c + s);
    m.s[3] = m.s[2] * c + m.c[2] * s, m.c[3] = m.c[2] * c - m.s[2] * s;
    m.s[4] = 2.0 * (m.s[2] * m.c[2]), m.c[4] = (m.c[2] - m.s[2]) * (m.c[2] + m.s[2]);
    return m;
}
/* Returns the sum of the first n terms of a sine series. Clenshaw's recurrence is applied to every
 * fourth term, because the four recurrences do not wait for each other. */
INLINE series_group sum_sines(const double *first, int n, const multiples *m)
{
    const int row = sizeof(kr_harmonic) / sizeof(double);
    const series_group twice = 2.0 * m->c[4], zero = twice - twice;
    series_group b[4] = {zero, zero, zero, zero}, next[4] = {zero, zero, zero, zero};
    for (int k = n - 4; k >= 0; k -= 4)
        for (int i = 0; i < 4; i++) {
            const series_group old = b[i];
            b[i] = twice * b[i] + (load_series(first + (k + i) * row) - next[i]);
            next[i] = old;
        }
    return ((m->s[1] * b[0] + m->s[3] * next[0]) + m->s[2] * (b[1] + next[1])) +
           ((m->s[3] * b[2] + m->s[1] * next[2]) + m->s[4] * b[3]);
}
/* Writes the sine series of the torus angles at y, with n terms, in the order of kr_harmonic. */
INLINE void sum_angles(const kr_kowalewski_torus *plan, const arc_angle y[2], wide value[4])
{
    for (int g = 0; g < GROUPS; g++) {
        const int at = 4 / GROUPS * g;
        const multiples m = multiples_of(for_arcs(g, y[0].s, y[1].s), for_arcs(g, y[0].c, y[1].c));
        store_series(&value[at], sum_sines(&plan->harmonic[0].angle[at], plan->terms, &m));
    }
}
/* Returns the sum of the two series of the heading, in turns. */
INLINE wide sum_heading(const kr_kowalewski_torus *plan, const arc_angle y[2])
{
    wide value[4];
    for (int g = 0; g < HEADING_GROUPS; g++) {
        const multiples m =
            multiples_of(for_heading(g, y[0].s, y[1].s), for_heading(g, y[0].c, y[1].c));
        store_series(&value[g], sum_sines(&plan->harmonic[0].heading[g], plan->terms, &m));
    }
    return value[0] + value[1];
}
/* The sine series of the torus angles, in the order of kr_harmonic, and their first and second
 * derivatives. */
typedef struct angle_series {
    wide value[4], slope[4], bend[4];
} angle_series;
/* Sums the first n terms of the series at y. */
INLINE angle_series sum_slopes(const kr_harmonic *harmonic, int n, const arc_angle y[2])
{
    angle_series r;
    for (int g = 0; g < GROUPS; g++) {
        const int at = 4 / GROUPS * g;
        const series_group s = for_arcs(g, y[0].s, y[1].s), c = for_arcs(g, y[0].c, y[1].c),
                           twice = 2.0 * (c * c - s * s), zero = s - s;
        /* recurrences for odd and even terms of each series, and the values before */
        series_group b[3][2], next[3][2];
        for (int i = 0; i < 6; i++) b[i / 2][i % 2] = next[i / 2][i % 2] = zero;
        for (int k = n - 1; k > 0; k -= 2) /* the terms k and k + 1 */
            for (int i = 0; i < 2; i++) {
                const double order = k + i;
                const series_group a = load_series(&harmonic[k - 1 + i].angle[at]),
                                   terms[3] = {a, order * a, order * order * a};
                for (int m = 0; m < 3; m++) {
                    const series_group old = b[m][i];
                    b[m][i] = twice * old + (terms[m] - next[m][i]);
                    next[m][i] = old;
                }
            }
        store_series(&r.value[at], s * ((b[0][0] + next[0][0]) + 2.0 * c * b[0][1]));
        store_series(&r.slope[at],
                     c * (b[1][0] - next[1][0]) + (0.5 * twice * b[1][1] - next[1][1]));
        store_series(&r.bend[at], -s * ((b[2][0] + next[2][0]) + 2.0 * c * b[2][1]));
    }
    return r;
}
/* Returns theta, in turns, plus d, which is in radians. */
INLINE dd turns_beside(dd theta, wide d)
{
    return dd_make(theta.hi, theta.lo + 0.15915494309189534561 * d);
}
INLINE arc_angle angle_beside(dd theta, wide d)
{
    arc_angle y;
    y.turns = turns_beside(theta, d);
    sincos_turns(y.turns, &y.s, &y.c);
    return y;
}

/* The contributions of arc j at y to the two sums of the nested searches, and their slopes. */
typedef struct separate_sums {
    double value[2], slope[2];
} separate_sums;
static separate_sums separate_at(const kr_kowalewski_torus *plan, int j, double y)
{
    double s, c, value[2] = {0.0, 0.0}, slope[2] = {0.0, 0.0};
    separate_sums r;
    sin_cos(y, &s, &c);
    for (int i = 0; i < 2; i++) {
        double b1 = 0.0, b2 = 0.0, d1 = 0.0, d2 = 0.0, old;
        for (int k = plan->terms; k > 0; k--) {
            const double a = plan->harmonic[k - 1].angle[2 * j + i];
            old = b1, b1 = 2.0 * c * b1 + (a - b2), b2 = old;
            old = d1, d1 = 2.0 * c * d1 + (k * a - d2), d2 = old;
        }
        value[i] = s * b1 + (i == j ? y : 0.0);
        slope[i] = (c * d1 - d2) + (i == j);
    }
    for (int i = 0; i < 2; i++) {
        const double *average = i ? plan->q : plan->p;
        r.value[i] = average[0] * value[0] - average[1] * value[1];
        r.slope[i] = average[0] * slope[0] - average[1] * slope[1];
    }
    return r;
}
/* Returns the middle of an interval if x, a step of Newton's method, lies outside. */
static double keep_inside(double x, double low, double high)
{
    return x >= low && x <= high ? x : 0.5 * (low + high);
}
/* Writes y1 and y2 for the angles theta, in radians, by nested searches. */
APART void search_angles(const kr_kowalewski_torus *plan, const double theta[2], double y[2])
{
    const double sum[2] = {plan->p[0] * theta[0] - plan->p[1] * theta[1],
                           plan->q[0] * theta[0] - plan->q[1] * theta[1]};
    double reach[2] = {0.5, 0.5}; /* bounds of |y - theta|, a little enlarged */
    for (int k = 0; k < plan->terms; k++) {
        const double *a = plan->harmonic[k].angle;
        reach[0] += fabs(a[0]) + fabs(a[2]) + plan->p[1] / plan->p[0] * (fabs(a[1]) + fabs(a[3]));
        reach[1] += fabs(a[1]) + fabs(a[3]);
    }
    double low = theta[1] - reach[1], high = theta[1] + reach[1], step = 1.0;
    y[0] = theta[0], y[1] = theta[1];
    for (int i = 0; i < 100 && step > 1e-16; i++) {
        const separate_sums two = separate_at(plan, 1, y[1]);
        const double want = sum[0] - two.value[0], middle = want / plan->p[0];
        double below = middle - reach[0], above = middle + reach[0];
        separate_sums one = separate_at(plan, 0, y[0]);
        step = 1.0;
        for (int k = 0; k < 100 && step > 1e-16; k++) {
            *(one.value[0] > want ? &above : &below) = y[0];
            const double next =
                keep_inside(y[0] - (one.value[0] - want) / one.slope[0], below, above);
            step = fabs(next - y[0]);
            y[0] = next;
            one = separate_at(plan, 0, y[0]);
        }
        const double miss = one.value[1] + two.value[1] - sum[1],
                     slide = two.slope[0] / one.slope[0]; /* -dy1/dy2 */
        *(miss > 0.0 ? &high : &low) = y[1];
        const double next =
            keep_inside(y[1] - miss / (two.slope[1] - one.slope[1] * slide), low, high);
        step = fabs(next - y[1]);
        y[0] -= (next - y[1]) * slide;
        y[1] = next;
    }
}
/* Applies search_angles to the lanes that are not in `found`. */
INLINE void search_lanes(const kr_kowalewski_torus *plan, const dd theta[2], mask found, wide d[2])
{
    const double turn = 6.283185307179586;
    double angle[2][LANES], out[2][LANES];
    for (int j = 0; j < 2; j++) {
        wide_store(angle[j], turn * (theta[j].hi + theta[j].lo));
        wide_store(out[j], d[j]);
    }
    for (int i = 0; i < LANES; i++) {
        if (mask_bits(found) >> i & 1) continue;
        const double at[2] = {angle[0][i], angle[1][i]};
        double y[2];
        search_angles(plan, at, y);
        for (int j = 0; j < 2; j++) out[j][i] = y[j] - at[j];
    }
    for (int j = 0; j < 2; j++) d[j] = wide_load(out[j]);
}
/* The weights of a cubic polynomial through four equidistant values, between the two in the middle,
 * where x grows from 0 to 1. */
static inline void cubic_weights(double x, double out[4])
{
    const double a = x + 1.0, b = x - 1.0, c = x - 2.0;
    out[0] = -(1.0 / 6.0) * x * (b * c);
    out[1] = 0.5 * a * (b * c);
    out[2] = -0.5 * a * (x * c);
    out[3] = (1.0 / 6.0) * a * (x * b);
}
/* Interpolates y - theta [rad] in the table of the plan, for angles theta in turns. */
static inline void guess_angles(const kr_kowalewski_torus *plan, const double theta[2], double d[2])
{
    double weight[2][4];
    int from[2];
    for (int j = 0; j < 2; j++) {
        const double at = STARTS * (theta[j] + 2.0);
        from[j] = at >= 0.0 && at < 4.0 * STARTS ? (int)at : 0; /* NaN: any */
        cubic_weights(at - from[j], weight[j]);
    }
    d[0] = d[1] = 0.0;
    for (int i = 0; i < 4; i++) {
        const float (*row)[2] = plan->guess[(from[0] + i - 1) & (STARTS - 1)];
        double sum[2] = {0.0, 0.0};
        for (int k = 0; k < 4; k++) {
            const float *value = row[(from[1] + k - 1) & (STARTS - 1)];
            sum[0] += weight[1][k] * value[0];
            sum[1] += weight[1][k] * value[1];
        }
        d[0] += weight[0][i] * sum[0];
        d[1] += weight[0][i] * sum[1];
    }
}
INLINE void guess_lanes(const kr_kowalewski_torus *plan, const dd theta[2], wide d[2])
{
    double angle[2][LANES], out[2][LANES];
    for (int j = 0; j < 2; j++) wide_store(angle[j], theta[j].hi);
    for (int i = 0; i < LANES; i++) {
        const double at[2] = {angle[0][i], angle[1][i]};
        double some[2];
        guess_angles(plan, at, some);
        for (int j = 0; j < 2; j++) out[j][i] = some[j];
    }
    for (int j = 0; j < 2; j++) d[j] = wide_load(out[j]);
}
/* The inverse of the Jacobian of theta by y. */
typedef struct jacobian {
    wide one[2], two[2];
} jacobian;
/* Computes the inverse of the Jacobian at y + step, to first order in the step. */
INLINE jacobian invert_jacobian(const angle_series *series, wide step_1, wide step_2)
{
    const wide a = 1.0 + (series->slope[0] + step_1 * series->bend[0]),
               b = series->slope[2] + step_2 * series->bend[2],
               c = series->slope[1] + step_1 * series->bend[1],
               e = 1.0 + (series->slope[3] + step_2 * series->bend[3]), n = 1.0 / (a * e - b * c);
    const jacobian r = {{e * n, -b * n}, {-c * n, a * n}};
    return r;
}
/* Computes a step of Chebyshev's method, which is Newton's method with a correction for the second
 * derivatives, from y = theta + d. It is at most one radian. Writes the inverse Jacobian after the
 * step. Returns the size of Newton's step. */
INLINE wide newton_step(const kr_kowalewski_torus *plan, int terms, const arc_angle y[2],
                        const wide d[2], jacobian *after, wide step[2])
{
    const wide one = wide_splat(1.0), zero = wide_splat(0.0);
    const angle_series series = sum_slopes(plan->harmonic, terms, y);
    const jacobian inverse = invert_jacobian(&series, zero, zero);
    const wide r = d[0] + (series.value[0] + series.value[2]),
               s = d[1] + (series.value[1] + series.value[3]);
    const wide u = inverse.one[0] * r + inverse.one[1] * s,
               v = inverse.two[0] * r + inverse.two[1] * s;
    const wide uu = 0.5 * u * u, vv = 0.5 * v * v,
               bend_1 = uu * series.bend[0] + vv * series.bend[2],
               bend_2 = uu * series.bend[1] + vv * series.bend[3];
    const wide size = wide_max(wide_abs(u), wide_abs(v));
    step[0] = u + (inverse.one[0] * bend_1 + inverse.one[1] * bend_2);
    step[1] = v + (inverse.two[0] * bend_1 + inverse.two[1] * bend_2);
    /* Far from the solution, the correction may be too large. */
    const mask is_close = wide_less(size, wide_splat(0.1));
    if (!mask_all(is_close)) {
        const wide shorter = wide_choose(wide_less(size, one), one, 1.0 / size);
        step[0] = wide_choose(is_close, step[0], shorter * u);
        step[1] = wide_choose(is_close, step[1], shorter * v);
    }
    *after = invert_jacobian(&series, -step[0], -step[1]);
    return size;
}
/* Sets the angles y to theta + d, after steps of which those in the lanes of `are_small` are below
 * SMALL_STEP. */
INLINE void move_angles(const dd theta[2], const wide d[2], const wide step[2], mask are_small,
                        arc_angle y[2])
{
    for (int j = 0; j < 2; j++) {
        const wide u = step[j], s = y[j].s - u * (y[j].c + 0.5 * u * y[j].s),
                   c = y[j].c + u * (y[j].s - 0.5 * u * y[j].c);
        if (mask_all(are_small)) {
            y[j].turns = turns_beside(theta[j], d[j]);
            y[j].s = s;
            y[j].c = c;
        } else {
            y[j] = angle_beside(theta[j], d[j]);
            y[j].s = wide_choose(are_small, s, y[j].s);
            y[j].c = wide_choose(are_small, c, y[j].c);
        }
    }
}
/* Writes y1 and y2 for the angles theta, in turns between -1 and 1. */
INLINE void find_angles(const kr_kowalewski_torus *plan, const dd theta[2], arc_angle y[2])
{
    const wide one = wide_splat(1.0), zero = wide_splat(0.0);
    wide d[2], step[2], inexact = one; /* the relative error of the Jacobian */
    jacobian inverse = {{one, one}, {one, one}};
    const mask none = wide_less(one, one);
    mask found = none, near = none;
    guess_lanes(plan, theta, d);
    for (int j = 0; j < 2; j++) y[j] = angle_beside(theta[j], d[j]);
    for (int i = 0; i < NEWTON_STEPS && !mask_all(near); i++) {
        jacobian after;
        const wide size = newton_step(plan, plan->some_terms, y, d, &after, step);
        const mask moves = mask_not(LANES == 1 ? none : near);
        take_lanes(&inverse, &after, sizeof inverse, moves);
        inexact = wide_choose(moves, size * size, inexact);
        for (int j = 0; j < 2; j++) {
            d[j] = wide_choose(moves, d[j] - step[j], d[j]);
            y[j] = angle_beside(theta[j], d[j]);
        }
        /* The error of the step is about the cube of its size. */
        near = mask_or(near, wide_less(size, wide_splat(2e-3)));
    }
    for (int i = 0; i < LAST_STEPS && !mask_all(mask_or(found, mask_not(near))); i++) {
        wide value[4];
        sum_angles(plan, y, value);
        const wide r = d[0] + (value[0] + value[2]), s = d[1] + (value[1] + value[3]);
        const mask moves = mask_not(LANES == 1 ? none : found);
        step[0] = wide_choose(moves, inverse.one[0] * r + inverse.one[1] * s, zero);
        step[1] = wide_choose(moves, inverse.two[0] * r + inverse.two[1] * s, zero);
        const wide size = wide_max(wide_abs(step[0]), wide_abs(step[1]));
        for (int j = 0; j < 2; j++) d[j] = d[j] - step[j];
        move_angles(theta, d, step, wide_less(size, wide_splat(SMALL_STEP)), y);
        found =
            mask_or(found, mask_and(near, wide_less(size * (inexact + 1e-8), wide_splat(3e-16))));
    }
    if (mask_all(found)) return;
    search_lanes(plan, theta, found, d);
    for (int j = 0; j < 2; j++) {
        const arc_angle other = angle_beside(theta[j], d[j]);
        take_lanes(&y[j], &other, sizeof other, mask_not(found));
    }
}
#endif
