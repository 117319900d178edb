/* States of a Kowalewski top in closed form, without theta functions. In the axes and units of
 * kowalewski.c, with the momentum m, the angular velocity (p, q, r) and the upward vertical
 * e3 = (g1, g2, g3) in the body frame,
 *     h = p^2 + q^2 + r^2/2 - g1,  l = <m, e3>,  k = |(p + iq)^2 + g1 + i g2|,  c = 1 - k^2,
 *     phi(w) = 2 (w + h)(w^2 + c) - l^2,  F(w)^2 = -(w^2 - k^2) phi(w).
 * The branch points of F are k, -k, a real root e0 of phi, and its roots e1 and e2, which may be
 * complex. Kowalewski's variables w1 > w2 oscillate on two real intervals, called arcs, between
 * branch points. The lower end of the second arc is minus infinity. On an arc,
 *     w = N/D,  N = A sin^2 + B cos^2,  D = C sin^2 + cos^2  of half of an angle x.
 * Landen transformations compute x from an angle y. The torus angles theta1 and theta2, with
 * theta_i = y_i + S_i1(y1) + S_i2(y2) and sine series S, grow linearly with time. Newton's method
 * solves these equations for y1 and y2. Koetter's formulas give the state at x1 and x2.
 *
 * Let z = r (p + iq) + g3. In the body frame, the vector C (not the coefficient C of D), given by
 * C2 - i C1 = (z^2 + 2 q^2 (g1 + i g2))/2, C3 = q Re((p - iq) z), has the heading (angle about e3)
 *     psi = integral of l w/(w^2 + c) dw/F over w1  +  the same integral over w2
 * (docs/theory/closed_form.md): a phase linear in time, plus one sine series for each arc, plus the
 * arguments of complex factors for poles near the arcs (set_heading_poles in kowalewski.c). */
#ifndef KR_EXACT_KOWALEWSKI_H
#define KR_EXACT_KOWALEWSKI_H
#include "math/trig.h"
#include "torus.h"

/* Indices of the branch points of F: 0, 1, 2 for the roots e0, e1, e2 of phi; k and -k. */
enum { ROOT_K = 3, ROOT_MINUS_K = 4, ROOTS = 5, AT_INFINITY = -1 };
enum {
    HARMONICS = 1024, /* largest number of terms of a series */
    FOLDS = 12,       /* largest number of Landen transformations */
    STARTS = 16,      /* values of each torus angle in the table `guess` */
    NODES = 256       /* largest number of values of y1 or y2 in the table of signs */
};

/* A Landen transformation with the modulus m. */
typedef struct kr_fold {
    double m, rest;   /* m, 1 - m */
    double crosswise; /* 1 if it removes singularities with Re x = pi/2, not 0 or pi */
} kr_fold;
/* An arc, with the coefficients A, B and C of N and D. For the real branch point e of index i,
 * way * (N - e D) = a[i] sin^2 + b[i] cos^2 of x/2, where `way` is the sign of N - e D. */
typedef struct kr_kowalewski_arc {
    double A, B, C;
    double a[ROOTS], b[ROOTS], root_a[ROOTS], root_b[ROOTS]; /* and square roots of a and b */
    double scale; /* constant factor of R, where |dw/F| = D R dx (find_differential_factor) */
    /* For complex e1, way * (N - e1 D) = half * (center[0] - cos x) - center[1] + i im D. */
    double half, center[2], im;
    /* For the poles u = sqrt(-c) and -sqrt(-c) of dpsi/dw, N - u D = both_a sin^2 + both_b cos^2 of
     * x/2. pole_a = sqrt(|both_a|) with the sign of l, and pole_b = sqrt(|both_b|), are stored only
     * for those of the two poles that are next to the arc. `poles` is their number. */
    double pole_a[2], pole_b[2], both_a[2], both_b[2];
    int poles, low, high, folds; /* low, high: the branch points at x = pi and x = 0 */
    kr_fold fold[FOLDS];         /* from x to y */
} kr_kowalewski_arc;
/* Coefficients of sin(n y1) and sin(n y2) for one n: `angle` in S_11, S_12, S_21, S_22 [rad],
 * heading[0] and [1] in the sine series of psi/2 in y1 and y2 [turns]; heading[2] = [3] = 0. */
typedef struct kr_harmonic {
    double angle[4], heading[4];
} kr_harmonic;
typedef struct kr_kowalewski_plan {
    kr_torus torus; /* its phases are theta1/2, theta2/2 and half of the heading */
    double l, c, k;
    /* Koetter's constants of a root e of phi: A^2 = 2 (e + h), B^2 = e^2 + c, A B = l (not A and B
     * of an arc). A[0], A[1]: at e1, e2; if e1 is complex, Re A, Im A at e1. A0: at e0. B alike. */
    double A[2], B[2], A0, B0;
    double A_square[2], B_square[2];
    double sum, apart, middle;     /* e1 + e2, e1 - e2 (or 2 Im e1), e0 - sum/2 */
    double one_apart, one_product; /* 1/apart, 1/((e0 - e1)(e0 - e2)) */
    double sign[6];        /* evaluate_koetter_formulas: s_0 to s_4; evaluate_frame: sign of Z2 */
    double half_turns[2];  /* 1 if the quaternion changes sign when theta grows by 4 pi */
    int pair, fast;        /* 1 if e1 and e2 are complex; 1 if derivatives are always needed */
    double p[2], q[2];     /* averages of |dw/F|/dy and (w - w0) |dw/F|/dy; w0: between the arcs */
    int some_terms, terms; /* numbers of terms: in most Newton steps, and in all */
    float guess[STARTS][STARTS][2]; /* y1 - theta1 and y2 - theta2 at equidistant theta1, theta2 */
    kr_kowalewski_arc arc[2];
    int nodes; /* number of angles of each arc in the table of signs, a power of two */
    /* The harmonics, and after them the table of signs (get_kowalewski_sign_table). */
    kr_harmonic harmonic[HARMONICS + NODES * NODES / 16];
} kr_kowalewski_plan;
/* Returns the table of signs: quaternions (w, x, y, z) times 127 for nodes^2 pairs (y1, y2) that
 * cover two turns of each angle, without the phase and the sine series of psi. At other y1, y2, the
 * right sign makes the scalar product with the entry of the nearest pair positive. */
static inline const signed char *get_kowalewski_sign_table(const kr_kowalewski_plan *plan)
{
    return (const signed char *)(plan->harmonic + plan->terms);
}

/* Number of sine series that one SIMD vector sums if a single top is evaluated. */
#if defined KR_PLAIN || !(defined __SSE2__ || defined KR_NEON)
#  define LANES_OF_SERIES 1
#elif defined KR_AVX2
#  define LANES_OF_SERIES 4
#else
#  define LANES_OF_SERIES 2
#endif
enum { NEWTON_STEPS = 14, LAST_STEPS = 3, SEARCH_STEPS = 1000 };
/* The cube of a step [rad] below this limit is negligible in double precision. */
#define SMALL_STEP 3e-6

/* An angle y of an arc [turns], and its sine and cosine. */
typedef struct arc_angle {
    dd turns;
    wide s, c;
} arc_angle;

/* Coefficients or sums of GROUP sine series (kr_harmonic). For states at many times, GROUP is 1,
 * and each lane belongs to one time. For a single state, each lane belongs to one series. */
#if defined KR_EXACT_LANES || LANES_OF_SERIES == 1
typedef wide series_group;
enum { GROUP = 1 };
INLINE series_group load_series_coefficients(const double *p) { return wide_splat(*p); }
/* Returns `one` for series in y1 and `two` for series in y2: GROUP series from this index on. */
INLINE series_group choose_by_arc(int series, wide one, wide two) { return series % 2 ? two : one; }
#else
typedef double series_group __attribute__((vector_size(8 * LANES_OF_SERIES)));
enum { GROUP = LANES_OF_SERIES };
INLINE series_group load_series_coefficients(const double *p)
{
    series_group r;
    memcpy(&r, p, sizeof r);
    return r;
}
INLINE series_group choose_by_arc(int series, wide one, wide two)
{
#  if LANES_OF_SERIES == 4
    const series_group r = {one, two, one, two};
#  else
    const series_group r = {one, two};
#  endif
    (void)series;
    return r;
}
#endif

/* The sines s[k] and cosines c[k] of the multiples k = 1, 2, 3, 4 of an angle. */
typedef struct multiples {
    series_group s[5], c[5];
} multiples;
INLINE multiples expand_multiples_of_angle(series_group s, series_group c)
{
    multiples m;
    m.s[1] = s, m.c[1] = c;
    m.s[2] = 2.0 * (s * c), m.c[2] = (c - s) * (c + s);
    m.s[3] = m.s[2] * c + m.c[2] * s, m.c[3] = m.c[2] * c - m.s[2] * s;
    m.s[4] = 2.0 * (m.s[2] * m.c[2]), m.c[4] = (m.c[2] - m.s[2]) * (m.c[2] + m.s[2]);
    return m;
}
/* Returns the sums of the terms k = 1, ..., n of GROUP sine series, given the sines and cosines m
 * of multiples of their angles. n is a multiple of 4. `first` points to the coefficients for k = 1
 * in a kr_harmonic. For speed, each of four Clenshaw recurrences takes every fourth term. */
INLINE series_group sum_series_group(const double *first, int n, const multiples *m)
{
    const int row = sizeof(kr_harmonic) / sizeof(double);
    const series_group twice = 2.0 * m->c[4], zero = twice - twice;
    series_group b[4] = {zero, zero, zero, zero}, next[4] = {zero, zero, zero, zero};
    for (int k = n - 4; k >= 0; k -= 4)
        for (int i = 0; i < 4; i++) {
            const series_group old = b[i];
            b[i] = twice * b[i] + (load_series_coefficients(first + (k + i) * row) - next[i]);
            next[i] = old;
        }
    return ((m->s[1] * b[0] + m->s[3] * next[0]) + m->s[2] * (b[1] + next[1])) +
           ((m->s[3] * b[2] + m->s[1] * next[2]) + m->s[4] * b[3]);
}
/* Writes the sums of `count` sine series, 2 or 4, to `value`: series 0 and 2 at the angle y[0], and
 * series 1 and 3 at y[1]. `first` points to the coefficient of series 0 in plan->harmonic[0]. */
INLINE void sum_sine_series(const kr_kowalewski_plan *plan, const double *first, int count,
                            const arc_angle y[2], wide value[4])
{
    for (int at = 0; at < count; at += GROUP) {
        const multiples m = expand_multiples_of_angle(choose_by_arc(at, y[0].s, y[1].s),
                                                      choose_by_arc(at, y[0].c, y[1].c));
        const series_group sum = sum_series_group(first + at, plan->terms, &m);
        memcpy(&value[at], &sum, sizeof sum);
    }
}
/* The sums of the series S_11, S_12, S_21 and S_22, and their first and second derivatives. */
typedef struct angle_series {
    wide value[4], slope[4], bend[4];
} angle_series;
INLINE angle_series sum_series_and_derivatives(const kr_harmonic *harmonic, int n,
                                               const arc_angle y[2])
{
    angle_series r;
    for (int at = 0; at < 4; at += GROUP) {
        const series_group s = choose_by_arc(at, y[0].s, y[1].s),
                           c = choose_by_arc(at, y[0].c, y[1].c), twice = 2.0 * (c * c - s * s),
                           zero = s - s;
        /* b: recurrences for odd and even terms of each series; next: their previous values */
        series_group b[3][2], next[3][2];
        for (int i = 0; i < 6; i++) b[i / 2][i % 2] = next[i / 2][i % 2] = zero;
        for (int k = n - 1; k > 0; k -= 2) /* the terms k and k + 1 */
            for (int i = 0; i < 2; i++) {
                const double order = k + i;
                const series_group a = load_series_coefficients(&harmonic[k - 1 + i].angle[at]),
                                   terms[3] = {a, order * a, order * order * a};
                for (int m = 0; m < 3; m++) {
                    const series_group old = b[m][i];
                    b[m][i] = twice * old + (terms[m] - next[m][i]);
                    next[m][i] = old;
                }
            }
        const series_group value = s * ((b[0][0] + next[0][0]) + 2.0 * c * b[0][1]),
                           slope =
                               c * (b[1][0] - next[1][0]) + (0.5 * twice * b[1][1] - next[1][1]),
                           bend = -s * ((b[2][0] + next[2][0]) + 2.0 * c * b[2][1]);
        memcpy(&r.value[at], &value, sizeof value);
        memcpy(&r.slope[at], &slope, sizeof slope);
        memcpy(&r.bend[at], &bend, sizeof bend);
    }
    return r;
}
INLINE dd turns_plus_radians(dd turns, wide radians)
{
    return dd_make(turns.hi, turns.lo + 0.15915494309189534561 * radians);
}
INLINE arc_angle make_arc_angle(dd turns, wide radians)
{
    arc_angle y;
    y.turns = turns_plus_radians(turns, radians);
    sincos_turns(y.turns, &y.s, &y.c);
    return y;
}

/* Writes the weights of four values, at -1, 0, 1 and 2, for cubic interpolation at x. */
static inline void find_interpolation_weights(double x, double out[4])
{
    const double a = x + 1.0, b = x - 1.0, c = x - 2.0;
    out[0] = -(1.0 / 6.0) * x * (b * c);
    out[1] = 0.5 * a * (b * c);
    out[2] = -0.5 * a * (x * c);
    out[3] = (1.0 / 6.0) * a * (x * b);
}
/* Interpolates d = y - theta [rad] in the table `guess`, for theta between -2 and 2 turns. */
INLINE void guess_angle_offsets(const kr_kowalewski_plan *plan, const dd theta[2], wide d[2])
{
    double angle[2][LANES], out[2][LANES];
    for (int j = 0; j < 2; j++) wide_store(angle[j], theta[j].hi);
    for (int lane = 0; lane < LANES; lane++) {
        double weight[2][4], guess[2] = {0.0, 0.0};
        int from[2];
        for (int j = 0; j < 2; j++) {
            const double at = STARTS * (angle[j][lane] + 2.0);
            from[j] = at >= 0.0 && at < 4.0 * STARTS ? (int)at : 0; /* NaN: any */
            find_interpolation_weights(at - from[j], weight[j]);
        }
        for (int i = 0; i < 4; i++) {
            const float (*row)[2] = plan->guess[(from[0] + i - 1) & (STARTS - 1)];
            double sum[2] = {0.0, 0.0};
            for (int k = 0; k < 4; k++) {
                const float *value = row[(from[1] + k - 1) & (STARTS - 1)];
                sum[0] += weight[1][k] * value[0];
                sum[1] += weight[1][k] * value[1];
            }
            guess[0] += weight[0][i] * sum[0];
            guess[1] += weight[0][i] * sum[1];
        }
        for (int j = 0; j < 2; j++) out[j][lane] = guess[j];
    }
    for (int j = 0; j < 2; j++) d[j] = wide_load(out[j]);
}
/* The inverse of the Jacobian matrix d theta_i / d y_j: its rows `one` and `two`. */
typedef struct jacobian {
    wide one[2], two[2];
} jacobian;
/* Returns the inverse Jacobian matrix at y + step, to first order, given the series at y. */
INLINE jacobian invert_jacobian_after_step(const angle_series *series, wide step_1, wide step_2)
{
    const wide a = 1.0 + (series->slope[0] + step_1 * series->bend[0]),
               b = series->slope[1] + step_2 * series->bend[1],
               c = series->slope[2] + step_1 * series->bend[2],
               e = 1.0 + (series->slope[3] + step_2 * series->bend[3]), n = 1.0 / (a * e - b * c);
    return (jacobian){{e * n, -b * n}, {-c * n, a * n}};
}
/* Writes a Newton step [rad], to be subtracted from d in y = theta + d, to `step`, and the inverse
 * Jacobian matrix at y - step to `inverse_after`. Uses the first `terms` terms of each series.
 * Returns the size (the larger component) of the plain Newton step. A step of size below 0.1 is
 * corrected for second derivatives (Chebyshev), and a step of size above 1 is shortened to 1. */
INLINE wide find_newton_step_size(const kr_kowalewski_plan *plan, int terms, const arc_angle y[2],
                                  const wide d[2], jacobian *inverse_after, wide step[2])
{
    const wide one = wide_splat(1.0), zero = wide_splat(0.0);
    const angle_series series = sum_series_and_derivatives(plan->harmonic, terms, y);
    const jacobian inverse = invert_jacobian_after_step(&series, zero, zero);
    const wide r = d[0] + (series.value[0] + series.value[1]),
               s = d[1] + (series.value[2] + series.value[3]);
    const wide u = inverse.one[0] * r + inverse.one[1] * s,
               v = inverse.two[0] * r + inverse.two[1] * s;
    const wide uu = 0.5 * u * u, vv = 0.5 * v * v,
               bend_1 = uu * series.bend[0] + vv * series.bend[1],
               bend_2 = uu * series.bend[2] + vv * series.bend[3];
    const wide size = wide_max(wide_abs(u), wide_abs(v));
    step[0] = u + (inverse.one[0] * bend_1 + inverse.one[1] * bend_2);
    step[1] = v + (inverse.two[0] * bend_1 + inverse.two[1] * bend_2);
    const mask is_close = wide_less(size, wide_splat(0.1));
    if (!mask_all(is_close)) {
        const wide shorter = wide_choose(wide_less(size, one), one, 1.0 / size);
        step[0] = wide_choose(is_close, step[0], shorter * u);
        step[1] = wide_choose(is_close, step[1], shorter * v);
    }
    *inverse_after = invert_jacobian_after_step(&series, -step[0], -step[1]);
    return size;
}
/* Sets the angles y, which are theta [turns] + d + step [rad], to theta + d. In the lanes of
 * `are_small`, with steps below SMALL_STEP, Taylor polynomials update sine and cosine of y. */
INLINE void update_arc_angles(const dd theta[2], const wide d[2], const wide step[2],
                              mask are_small, arc_angle y[2])
{
    for (int j = 0; j < 2; j++) {
        const wide u = step[j], s = y[j].s - u * (y[j].c + 0.5 * u * y[j].s),
                   c = y[j].c + u * (y[j].s - 0.5 * u * y[j].c);
        if (mask_all(are_small)) {
            y[j].turns = turns_plus_radians(theta[j], d[j]);
            y[j].s = s;
            y[j].c = c;
        } else {
            y[j] = make_arc_angle(theta[j], d[j]);
            y[j].s = wide_choose(are_small, s, y[j].s);
            y[j].c = wide_choose(are_small, c, y[j].c);
        }
    }
}
INLINE wide bisect_if_outside(wide x, wide low, wide high)
{
    const mask is_inside = mask_and(wide_at_most(low, x), wide_at_most(x, high));
    return wide_choose(is_inside, x, 0.5 * (low + high));
}
/* Writes d = y - theta [rad], given theta [turns], in the lanes that are not in `found`, where
 * Newton's method failed: if the arcs nearly touch, the Jacobian matrix is almost singular. Two
 * nested searches are slower, but do not fail. For trial values of y, let E_i be theta_i(y) minus
 * the given theta_i. With plan->p = {p1, p2}, plan->q = {q1, q2} and w0 of kr_kowalewski_plan,
 * P = p1 E1 - p2 E2 and Q = q1 E1 - q2 E2 change by
 *     dP = |dw1/F| - |dw2/F|,  dQ = (w1 - w0) |dw1/F| - (w2 - w0) |dw2/F|  if y1 and y2 grow.
 * For any y2, P grows with y1. Along the curve P = 0, Q grows with y2, because w1 > w2. Each step
 * moves y1 towards this curve or, once (y1, y2) is on the curve, moves both along it to Q = 0. */
APART void search_arc_angles(const kr_kowalewski_plan *plan, const dd theta[2], mask found,
                             wide d[2])
{
    const wide zero = wide_splat(0.0), least = wide_splat(1e-15);
    double bound[2] = {0.5, 0.5}; /* of |y - theta| [rad], with a margin */
    for (int k = 0; k < 4 * plan->terms; k++)
        bound[k % 4 / 2] += fabs(plan->harmonic[k / 4].angle[k % 4]);
    bound[0] += 2.0 * plan->p[1] / plan->p[0] * bound[1];
    const wide most[2] = {wide_splat(bound[0]), wide_splat(bound[1])};
    wide at[2] = {zero, zero}, low[2] = {-most[0], -most[1]}, high[2] = {most[0], most[1]};
    for (int j = 0; j < 2; j++) /* NaN has no solution */
        found = mask_or(found, mask_not(wide_equal(theta[j].hi, theta[j].hi)));
    for (int i = 0; i < SEARCH_STEPS && !mask_all(found); i++) {
        arc_angle y[2];
        for (int j = 0; j < 2; j++) y[j] = make_arc_angle(theta[j], at[j]);
        const angle_series series = sum_series_and_derivatives(plan->harmonic, plan->terms, y);
        const wide *v = series.value, *u = series.slope, one = at[0] + (v[0] + v[1]),
                   two = at[1] + (v[2] + v[3]);
        const double *p = plan->p, *q = plan->q;
        const wide P = p[0] * one - p[1] * two, Q = q[0] * one - q[1] * two,
                   P1 = p[0] * (1.0 + u[0]) - p[1] * u[2], Q1 = q[0] * (1.0 + u[0]) - q[1] * u[2],
                   P2 = p[0] * u[1] - p[1] * (1.0 + u[3]), Q2 = q[0] * u[1] - q[1] * (1.0 + u[3]),
                   slope = P2 / P1;
        const mask right = wide_less(zero, P), above = wide_less(zero, Q);
        high[0] = wide_choose(right, at[0], high[0]);
        low[0] = wide_choose(right, low[0], at[0]);
        const wide y1 = bisect_if_outside(at[0] - P / P1, low[0], high[0]);
        const mask is_on_line = wide_at_most(wide_abs(y1 - at[0]), least);
        high[1] = wide_choose(mask_and(is_on_line, above), at[1], high[1]);
        low[1] = wide_choose(mask_and(is_on_line, mask_not(above)), at[1], low[1]);
        const wide y2 = bisect_if_outside(at[1] - Q / (Q2 - Q1 * slope), low[1], high[1]),
                   step = wide_choose(is_on_line, y2 - at[1], zero);
        at[0] = y1 - slope * step;
        at[1] = at[1] + step;
        low[0] = wide_choose(is_on_line, -most[0], low[0]);
        high[0] = wide_choose(is_on_line, most[0], high[0]);
        for (int j = 0; j < 2; j++) d[j] = wide_choose(found, d[j], at[j]);
        found = mask_or(found, mask_and(is_on_line, wide_at_most(wide_abs(step), least)));
    }
}
/* Writes y1 and y2, given the torus angles theta in turns, -1 to 1. Newton's method starts at
 * angles interpolated in plan->guess. Its first steps use plan->some_terms terms of each series,
 * and its last steps all terms. Where Newton's method fails, search_arc_angles is called. */
INLINE void find_arc_angles(const kr_kowalewski_plan *plan, const dd theta[2], arc_angle y[2])
{
    const wide one = wide_splat(1.0), zero = wide_splat(0.0);
    wide d[2], step[2], inexact = one; /* the relative error of the Jacobian */
    jacobian inverse = {{one, one}, {one, one}};
    const mask none = wide_less(one, one);
    mask found = none, near = none;
    guess_angle_offsets(plan, theta, d);
    for (int j = 0; j < 2; j++) y[j] = make_arc_angle(theta[j], d[j]);
    for (int i = 0; i < NEWTON_STEPS && !mask_all(near); i++) {
        jacobian after;
        const wide size = find_newton_step_size(plan, plan->some_terms, y, d, &after, step);
        const mask moves = mask_not(LANES == 1 ? none : near);
        copy_selected_lanes(&inverse, &after, sizeof inverse, moves);
        inexact = wide_choose(moves, size * size, inexact);
        for (int j = 0; j < 2; j++) {
            d[j] = wide_choose(moves, d[j] - step[j], d[j]);
            y[j] = make_arc_angle(theta[j], d[j]);
        }
        /* The error after the step is about the cube of the size of the step. */
        near = mask_or(near, wide_less(size, wide_splat(2e-3)));
    }
    for (int i = 0; i < LAST_STEPS && !mask_all(mask_or(found, mask_not(near))); i++) {
        wide value[4];
        sum_sine_series(plan, plan->harmonic[0].angle, 4, y, value);
        const wide r = d[0] + (value[0] + value[1]), s = d[1] + (value[2] + value[3]);
        const mask moves = mask_not(LANES == 1 ? none : found);
        step[0] = wide_choose(moves, inverse.one[0] * r + inverse.one[1] * s, zero);
        step[1] = wide_choose(moves, inverse.two[0] * r + inverse.two[1] * s, zero);
        const wide size = wide_max(wide_abs(step[0]), wide_abs(step[1]));
        for (int j = 0; j < 2; j++) d[j] = d[j] - step[j];
        update_arc_angles(theta, d, step, wide_less(size, wide_splat(SMALL_STEP)), y);
        found =
            mask_or(found, mask_and(near, wide_less(size * (inexact + 1e-8), wide_splat(3e-16))));
    }
    if (mask_all(found)) return;
    search_arc_angles(plan, theta, found, d);
    for (int j = 0; j < 2; j++) {
        const arc_angle other = make_arc_angle(theta[j], d[j]);
        copy_selected_lanes(&y[j], &other, sizeof other, mask_not(found));
    }
}

/* A quantity v and its time derivative d, which evaluate_frame uses where v loses digits. */
typedef struct dual {
    wide v, d;
} dual;
INLINE dual dual_of(wide v, wide d) { return (dual){v, d}; }
INLINE dual dual_constant(double v) { return dual_of(wide_splat(v), wide_splat(0.0)); }
INLINE dual dual_add(dual a, dual b) { return dual_of(a.v + b.v, a.d + b.d); }
INLINE dual dual_sub(dual a, dual b) { return dual_of(a.v - b.v, a.d - b.d); }
INLINE dual dual_mul(dual a, dual b) { return dual_of(a.v * b.v, a.d * b.v + a.v * b.d); }
INLINE dual dual_scale(double s, dual a) { return dual_of(s * a.v, s * a.d); }
INLINE dual dual_div(dual a, dual b)
{
    const wide q = a.v / b.v;
    return dual_of(q, (a.d - q * b.d) / b.v);
}
/* The values `one` and `two` of a function at the roots e1 and e2 of phi. If these roots are a
 * complex pair, so are the values, and `one` and `two` are the real and imaginary parts of the
 * value at e1. In this case, the argument `complex` of the functions below is 1, otherwise 0. */
typedef struct pair {
    dual one, two;
} pair;
INLINE pair pair_of(const double a[2]) { return (pair){dual_constant(a[0]), dual_constant(a[1])}; }
INLINE pair pair_times(dual s, pair a) { return (pair){dual_mul(s, a.one), dual_mul(s, a.two)}; }
INLINE pair pair_mul(int complex, pair a, pair b)
{
    pair r = {dual_mul(a.one, b.one), dual_mul(a.two, b.two)};
    if (complex) {
        r.one = dual_sub(r.one, r.two);
        r.two = dual_add(dual_mul(a.one, b.two), dual_mul(a.two, b.one));
    }
    return r;
}
/* Multiplies the values at e1 and e2 by `one` and `two`, which must be equal for complex roots. */
INLINE pair pair_scale_each(double one, double two, pair a)
{
    return (pair){dual_scale(one, a.one), dual_scale(two, a.two)};
}
INLINE pair pair_swap(int complex, pair a)
{
    const pair conjugate = {a.one, dual_scale(-1.0, a.two)}, other = {a.two, a.one};
    return complex ? conjugate : other;
}
INLINE dual pair_sum(int complex, pair a)
{
    return complex ? dual_scale(2.0, a.one) : dual_add(a.one, a.two);
}
INLINE dual pair_product(int complex, pair a)
{
    return complex ? dual_add(dual_mul(a.one, a.one), dual_mul(a.two, a.two))
                   : dual_mul(a.one, a.two);
}
/* Returns the divided difference (f1 - f2)/(e1 - e2) of the values f = (f1, f2) at e1 and e2. It
 * is computed as square/(f1 + f2) where this is more accurate: `square` is (f1^2 - f2^2)/(e1 - e2),
 * and `terms` is the sum of the magnitudes of the terms of `square`. */
INLINE dual find_divided_difference(const kr_kowalewski_plan *plan, int complex, pair f,
                                    dual square, wide terms)
{
    const dual sum = pair_sum(complex, f),
               way = complex ? dual_scale(2.0, f.two) : dual_sub(f.one, f.two),
               plain = dual_scale(plan->one_apart, way), other = dual_div(square, sum);
    const wide zero = wide_splat(0.0), same = complex ? f.one.v * f.one.v : f.one.v * f.two.v;
    const mask better =
        mask_and(wide_less(zero, same), wide_less(terms * fabs(plan->apart), sum.v * sum.v));
    return dual_of(wide_choose(better, other.v, plain.v), wide_choose(better, other.d, plain.d));
}

/* The sine s and the cosine c of half of the angle x of a point on an arc, and the cosine of x. */
typedef struct half_angle {
    wide s, c, cosine;
} half_angle;
INLINE half_angle convert_y_to_half_x(const kr_kowalewski_arc *arc, const arc_angle *y)
{
    const wide zero = wide_splat(0.0), one = wide_splat(1.0);
    wide s = y->s, c = y->c;
    for (int i = arc->folds - 1; i >= 0; i--) {
        const kr_fold *f = &arc->fold[i];
        const int crosswise = f->crosswise != 0.0;
        const wide u = crosswise ? s : c, v = crosswise ? c : s;
        const wide plus = 1.0 + f->m * (u * u),
                   root = wide_sqrt(f->rest * (1.0 + f->m) + f->m * f->m * (v * v));
        const wide first = (1.0 + f->m) * u / plus, second = v * root / plus;
        s = crosswise ? first : second;
        c = crosswise ? second : first;
    }
    /* s and c change their signs if y grows by a whole turn. */
    const wide whole = nearest(y->turns.hi + y->turns.lo),
               rest = (y->turns.hi - whole) + y->turns.lo,
               odd = wide_abs(whole - 2.0 * nearest(0.5 * whole)), sign = 1.0 - 2.0 * odd;
    const wide large = wide_sqrt(0.5 * (1.0 + wide_abs(c))), small = 0.5 * s / large;
    const mask front = wide_at_most(zero, c), below = wide_less(rest, zero);
    const wide side = wide_choose(below, -one, one);
    half_angle r;
    r.s = sign * wide_choose(front, small, side * large);
    r.c = sign * wide_choose(front, large, side * small);
    r.cosine = c;
    return r;
}
/* N, D and square roots at a point of an arc: d is the root of D, `minus` of |k D - N|, `plus` of
 * |k D + N|, and g0, g.one and g.two of way * (N - e D) for e = e0, e1 and e2. Roots that vanish at
 * an end of the arc change sign there. h = minus * plus (no energy). Arguments `rate` are dx/dt. */
typedef struct arc_point {
    dual N, D, d, g0, h, minus, plus;
    pair g;
} arc_point;
/* Returns the square root of way * (N - e D) for the real branch point e of index i. */
INLINE dual find_real_factor_root(const kr_kowalewski_arc *arc, int i, half_angle x, wide rate)
{
    const wide half = 0.5 * rate;
    if (i == arc->low) return dual_of(arc->root_b[i] * x.c, -half * x.s * arc->root_b[i]);
    if (i == arc->high) return dual_of(arc->root_a[i] * x.s, half * x.c * arc->root_a[i]);
    const wide square = arc->a[i] * (x.s * x.s) + arc->b[i] * (x.c * x.c),
               root = wide_sqrt(wide_max(square, wide_splat(0.0)));
    return dual_of(root, (arc->a[i] - arc->b[i]) * (x.s * x.c) * half / root);
}
/* Returns the square root, with positive real part, of way * (N - e1 D) for complex e1. The formula
 * has no cancellation if e1 is close to the arc. */
INLINE pair find_complex_factor_root(const kr_kowalewski_arc *arc, half_angle x, dual D, wide rate)
{
    const wide zero = wide_splat(0.0),
               re = arc->half * (arc->center[0] - x.cosine) - arc->center[1], im = arc->im * D.v,
               size = wide_sqrt(re * re + im * im), large = wide_sqrt(0.5 * (size + wide_abs(re))),
               small = 0.5 * im / large;
    const mask right = wide_at_most(zero, re), below = wide_less(im, zero);
    const wide u = wide_choose(right, large, wide_abs(small)),
               v = wide_choose(right, small, wide_choose(below, -large, large));
    const wide re_rate = (arc->a[1] - arc->b[1]) * (x.s * x.c) * rate, im_rate = arc->im * D.d,
               n = 0.5 / size;
    return (pair){dual_of(u, (re_rate * u + im_rate * v) * n),
                  dual_of(v, (im_rate * u - re_rate * v) * n)};
}
INLINE arc_point find_arc_point(const kr_kowalewski_arc *arc, int complex, half_angle x, wide rate)
{
    const wide ss = x.s * x.s, cc = x.c * x.c, sc = x.s * x.c * rate;
    arc_point r;
    r.N = dual_of(arc->A * ss + arc->B * cc, (arc->A - arc->B) * sc);
    r.D = dual_of(arc->C * ss + cc, (arc->C - 1.0) * sc);
    if (arc->low == AT_INFINITY)
        r.d = dual_of(x.c, -0.5 * x.s * rate);
    else {
        const wide d = wide_sqrt(r.D.v);
        r.d = dual_of(d, 0.5 * r.D.d / d);
    }
    r.minus = find_real_factor_root(arc, ROOT_K, x, rate);
    r.plus = find_real_factor_root(arc, ROOT_MINUS_K, x, rate);
    r.h = dual_mul(r.minus, r.plus);
    r.g0 = find_real_factor_root(arc, 0, x, rate);
    if (complex)
        r.g = find_complex_factor_root(arc, x, r.D, rate);
    else
        r.g.one = find_real_factor_root(arc, 1, x, rate),
        r.g.two = find_real_factor_root(arc, 2, x, rate);
    return r;
}
/* Returns R of |dw/F| = D R dx: arc->scale divided by the product of those roots d, g0, g, `minus`,
 * `plus` (arc_point) that vanish at neither end of the arc. */
INLINE wide find_differential_factor(const kr_kowalewski_arc *arc, int complex, const arc_point *at)
{
    wide product = arc->low == AT_INFINITY ? wide_splat(1.0) : at->d.v;
    if (arc->low != 0 && arc->high != 0) product = product * at->g0.v;
    if (complex) product = product * (at->g.one.v * at->g.one.v + at->g.two.v * at->g.two.v);
    if (!complex && arc->low != 1 && arc->high != 1) product = product * at->g.one.v;
    if (!complex && arc->low != 2 && arc->high != 2) product = product * at->g.two.v;
    if (arc->low != ROOT_K && arc->high != ROOT_K) product = product * at->minus.v;
    if (arc->low != ROOT_MINUS_K && arc->high != ROOT_MINUS_K) product = product * at->plus.v;
    return arc->scale / product;
}

/* p, q, r and g3 by Koetter's formulas, and the common denominator a. */
typedef struct koetter_state {
    dual p, q, r, g3, a;
    wide r_terms; /* the size of the terms of r */
} koetter_state;
/* Returns f[e0, e1, e2], given f0 = f(e0), first = f[e1, e2] and sum = f(e1) + f(e2). */
INLINE dual find_second_difference(const kr_kowalewski_plan *plan, dual f0, dual first, dual sum)
{
    return dual_scale(plan->one_product, dual_sub(dual_sub(f0, dual_scale(0.5, sum)),
                                                  dual_scale(plan->middle, first)));
}
/* Koetter's three constants A or B, one for each root e0, e1, e2, here called F0, F1, F2 (not
 * F(w)). `F` holds F1 and F2, `square` their squares; slope = (F1^2 - F2^2)/(e1 - e2). */
typedef struct koetter_terms {
    pair F, square;
    double F0, slope;
} koetter_terms;
/* Products in evaluate_koetter_formulas (symbols: see there). At e_i (i = 1 or 2, and j = 3 - i),
 * G = s_i g_i g_i', U = g_i^2, W = g_i'^2, X = s_j g_i g_j', Y = s_j g_i' g_j, V = x X - y Y, where
 * x = s_0 s_3 h d' g_0', y = s_0 s_4 h' d g_0. Exchanging 0 and i in G and V gives G0 and V0. */
typedef struct koetter_products {
    pair G, U, W, X, Y;
    dual G0, V0, x, y, Dl;
} koetter_products;
/* Returns the divided difference (F G)[e0, e1, e2]. */
INLINE dual find_second_difference_of_FG(const kr_kowalewski_plan *plan, int complex,
                                         const koetter_terms *t, const koetter_products *k, dual D1,
                                         dual D2)
{
    const pair f = pair_mul(complex, t->F, k->G), UW = pair_mul(complex, k->U, k->W),
               other = pair_swap(complex, t->square),
               up = pair_mul(complex, other, pair_times(D2, pair_swap(complex, k->U))),
               down = pair_mul(complex, other, pair_times(D1, k->W));
    const dual main = dual_scale(t->slope, UW.one),
               square = dual_add(main, dual_sub(up.one, down.one));
    const wide terms = wide_abs(main.v) + (wide_abs(up.one.v) + wide_abs(down.one.v));
    return find_second_difference(plan, dual_scale(t->F0, k->G0),
                                  find_divided_difference(plan, complex, f, square, terms),
                                  pair_sum(complex, f));
}
/* Returns the divided difference (F V)[e0, e1, e2], with F of koetter_terms (not F(w)) and V of
 * koetter_products. `size` shows cancellation: |x (F X)[e1, e2]| + |y (F Y)[e1, e2]|. */
INLINE dual find_second_difference_of_FV(const kr_kowalewski_plan *plan, int complex,
                                         const koetter_terms *t, const koetter_products *k,
                                         wide *size)
{
    const pair X = pair_mul(complex, t->F, k->X), Y = pair_mul(complex, t->F, k->Y),
               UW = pair_mul(complex, k->U, pair_swap(complex, k->W)),
               WU = pair_mul(complex, k->W, pair_swap(complex, k->U));
    const dual rest = dual_mul(pair_swap(complex, t->square).one, k->Dl),
               up = dual_scale(t->slope, UW.one), down = dual_scale(t->slope, WU.one);
    const dual DX = find_divided_difference(plan, complex, X, dual_sub(up, rest),
                                            wide_abs(up.v) + wide_abs(rest.v)),
               DY = find_divided_difference(plan, complex, Y, dual_add(down, rest),
                                            wide_abs(down.v) + wide_abs(rest.v));
    const dual x = dual_mul(k->x, DX), y = dual_mul(k->y, DY);
    *size = wide_abs(x.v) + wide_abs(y.v);
    return find_second_difference(
        plan, dual_scale(t->F0, k->V0), dual_sub(x, y),
        dual_sub(dual_mul(k->x, pair_sum(complex, X)), dual_mul(k->y, pair_sum(complex, Y))));
}
/* Returns Dl = N1 D2 - N2 D1, the numerator of w1 - w2. */
INLINE dual find_w_difference_numerator(const arc_point *one, const arc_point *two)
{
    return dual_add(dual_mul(dual_mul(one->g0, one->g0), two->D),
                    dual_mul(dual_mul(two->g0, two->g0), one->D));
}
/* Koetter's formulas (Acta Math. 17 (1893) 209) are a = (A G)[], p = -(B G)[]/a, q = -d d'/a,
 * r = sqrt(2) (A V)[]/(a Dl) and g3 = sqrt(2) (B V)[]/(a Dl), where f[] = f[e0, e1, e2], A, B are
 * constants (plan), and Dl = N D' - N' D. N, D, d, h, g_0 = g0 and g_1, g_2 = g (arc_point) belong
 * to `one` on the first arc. Primes (no derivatives) denote `two` on the second. s: plan->sign. */
INLINE koetter_state evaluate_koetter_formulas(const kr_kowalewski_plan *plan, int complex,
                                               const arc_point *one, const arc_point *two)
{
    const double *sign = plan->sign, sqrt2 = 1.41421356237309504880;
    const koetter_terms A = {pair_of(plan->A), pair_of(plan->A_square), plan->A0, 2.0},
                        B = {pair_of(plan->B), pair_of(plan->B_square), plan->B0, plan->sum};
    const dual H1 = dual_scale(sign[3], dual_mul(one->h, two->d)),
               H2 = dual_scale(sign[4], dual_mul(two->h, one->d)),
               up = dual_mul(dual_mul(H1, pair_product(complex, two->g)), one->g0),
               down = dual_mul(dual_mul(H2, pair_product(complex, one->g)), two->g0);
    koetter_products k;
    k.G = pair_scale_each(sign[1], sign[2], pair_mul(complex, one->g, two->g));
    k.X = pair_scale_each(sign[2], sign[1], pair_mul(complex, one->g, pair_swap(complex, two->g)));
    k.Y = pair_scale_each(sign[2], sign[1], pair_mul(complex, two->g, pair_swap(complex, one->g)));
    k.U = pair_mul(complex, one->g, one->g);
    k.W = pair_mul(complex, two->g, two->g);
    k.G0 = dual_scale(sign[0], dual_mul(one->g0, two->g0));
    k.V0 = dual_scale(sign[1] * sign[2], dual_sub(up, down));
    k.x = dual_scale(sign[0], dual_mul(H1, two->g0));
    k.y = dual_scale(sign[0], dual_mul(H2, one->g0));
    k.Dl = find_w_difference_numerator(one, two);
    wide size, unused;
    koetter_state s;
    s.a = find_second_difference_of_FG(plan, complex, &A, &k, one->D, two->D);
    const dual b = find_second_difference_of_FG(plan, complex, &B, &k, one->D, two->D),
               under = dual_mul(s.a, k.Dl),
               v = find_second_difference_of_FV(plan, complex, &A, &k, &size),
               u = find_second_difference_of_FV(plan, complex, &B, &k, &unused);
    s.p = dual_div(dual_scale(-1.0, b), s.a);
    s.q = dual_div(dual_scale(-1.0, dual_mul(one->d, two->d)), s.a);
    s.r = dual_div(dual_scale(sqrt2, v), under);
    s.g3 = dual_div(dual_scale(sqrt2, u), under);
    s.r_terms = sqrt2 *
                (fabs(plan->A0) * (wide_abs(up.v) + wide_abs(down.v)) + fabs(plan->middle) * size) *
                fabs(plan->one_product) / wide_abs(under.v);
    return s;
}

/* The state in the body frame: angular velocity (p, q, r), and e3 = (g1, g2, g3). */
typedef struct body_state {
    wide p, q, r, g1, g2, g3;
} body_state;
/* The horizontal part (x, y, z), along body axes, of a vector whose heading is psi plus the
 * argument of re + i im. `square` is the squared length of (x, y, z). `terms` is the square of the
 * sum of the magnitudes of all terms of the vector. A small square/terms indicates cancellation. */
typedef struct heading_vector {
    wide x, y, z, square, terms, re, im;
} heading_vector;
/* Removes the vertical part of v. `terms` is the sum of the magnitudes of the terms of v. */
INLINE void remove_vertical(heading_vector *v, const body_state *b, wide terms)
{
    const wide n = v->x * b->g1 + v->y * b->g2 + v->z * b->g3;
    v->x = v->x - n * b->g1;
    v->y = v->y - n * b->g2;
    v->z = v->z - n * b->g3;
    v->square = v->x * v->x + v->y * v->y + v->z * v->z;
    v->terms = terms * terms;
}
INLINE void keep_better_vector(heading_vector *best, const heading_vector *v)
{
    copy_selected_lanes(best, v, sizeof *v,
                        wide_less(best->square * v->terms, v->square * best->terms));
}
INLINE heading_vector find_vector_C(const body_state *b, wide S, wide S_terms)
{
    const wide Q2 = b->q * b->q, Q = wide_abs(b->q), R = wide_abs(b->r), P = wide_abs(b->p);
    heading_vector v;
    v.x = -(b->q * b->r * S + Q2 * b->g2);
    v.y = 0.5 * (S - b->q * b->r) * (S + b->q * b->r) + Q2 * b->g1;
    v.z = b->q * (b->p * S + Q2 * b->r);
    v.re = wide_splat(1.0), v.im = wide_splat(0.0);
    remove_vertical(&v, b,
                    Q * R * S_terms + Q2 * (wide_abs(b->g1) + wide_abs(b->g2)) +
                        wide_abs(S) * S_terms + 0.5 * Q2 * R * R + Q * (P * S_terms + Q2 * R));
    return v;
}
/* Returns the horizontal part of the vector B (not B of N), which replaces a nearly vertical C:
 *     B = S (-r g2, r g1 - 2 p g3, 2 p g2) + q (-2 (g2^2 + 2 p (p g1 + q g2)), 2 (g1 g2 - q l),
 *         -r (l + 2 p g1)),   S = Re z;  `S_terms` is the sum of the magnitudes of the terms of S.
 * Up to half a turn, the heading of B is psi minus the arguments of l (k^2 - w^2) + i F(w) at w1
 * and w2. F(w1) has the sign of dw1/dt, and F(w2) has that of -dw2/dt. `a` is koetter_state.a. */
INLINE heading_vector find_vector_B(const kr_kowalewski_plan *plan, int complex,
                                    const body_state *b, wide S, wide S_terms, const arc_point *one,
                                    const arc_point *two, wide a)
{
    const double l = plan->l, sqrt2 = 1.41421356237309504880;
    const wide p2 = 2.0 * b->p, g22 = b->g2 * b->g2;
    heading_vector v;
    v.x = -b->g2 * b->r * S - 2.0 * b->q * (g22 + p2 * (b->p * b->g1 + b->q * b->g2));
    v.y = S * (b->r * b->g1 - p2 * b->g3) + 2.0 * b->q * (b->g1 * b->g2 - b->q * l);
    v.z = p2 * b->g2 * S - b->q * b->r * (l + p2 * b->g1);
    const wide P = wide_abs(b->p), Q = wide_abs(b->q), R = wide_abs(b->r), G1 = wide_abs(b->g1),
               G2 = wide_abs(b->g2), L = wide_splat(fabs(l));
    const wide terms = S_terms * (R * (G1 + G2) + 2.0 * P * (wide_abs(b->g3) + G2)) +
                       2.0 * Q * (g22 + 2.0 * P * (P * G1 + Q * G2) + G1 * G2 + Q * L) +
                       Q * R * (L + 2.0 * P * G1);
    remove_vertical(&v, b, terms);
    const wide F1 = sqrt2 * one->g0.v * pair_product(complex, one->g).v,
               F2 = sqrt2 * two->g0.v * pair_product(complex, two->g).v,
               u1 = l * one->h.v * one->d.v, u2 = l * two->h.v * two->d.v;
    const wide side = sign_from_mask(is_negative(plan->sign[5] * a));
    v.re = side * (u1 * u2 - F1 * F2);
    v.im = side * (u1 * F2 + u2 * F1);
    return v;
}
/* Returns the horizontal part of dC/dt + (p, q, r) x C, the derivative of C in the space frame.
 * This vector replaces C where C and B (find_vector_B) are nearly vertical. Complex numbers denote
 * horizontal space vectors: C is rho exp(i psi), and the result is its derivative by t. With a
 * of koetter_state, rho^2 = K1 K2/a^4, where K = N^2 + c D^2 on each arc. */
INLINE heading_vector find_derivative_of_C(const kr_kowalewski_plan *plan, const koetter_state *s,
                                           const body_state *b, wide S, const arc_point *one,
                                           const arc_point *two, const half_angle x[2],
                                           const wide rate[2])
{
    const wide P = b->p, Q = b->q, R = b->r, g1 = b->g1, g2 = b->g2, Pd = s->p.d, Qd = s->q.d,
               Rd = g2, Sd = (g1 * Q - g2 * P) + Pd * R + P * Rd, g1d = g2 * R - b->g3 * Q,
               g2d = b->g3 * P - g1 * R;
    const wide C1 = -(Q * R * S + Q * Q * g2), C2 = 0.5 * (S - Q * R) * (S + Q * R) + Q * Q * g1,
               C3 = Q * (P * S + Q * Q * R);
    heading_vector v;
    v.x =
        Q * C3 - R * C2 - (Qd * R * S + Q * Rd * S + Q * R * Sd + 2.0 * Q * Qd * g2 + Q * Q * g2d);
    v.y = R * C1 - P * C3 + S * Sd - Q * R * (Qd * R + Q * Rd) + 2.0 * Q * Qd * g1 + Q * Q * g1d;
    v.z = P * C2 - Q * C1 + Qd * (P * S + Q * Q * R) +
          Q * (Pd * S + P * Sd + 2.0 * Q * Qd * R + Q * Q * Rd);
    const wide aS = wide_abs(S), aSd = wide_abs(Sd), aP = wide_abs(P), aQ = wide_abs(Q),
               aR = wide_abs(R), bP = wide_abs(Pd), bQ = wide_abs(Qd), bR = wide_abs(Rd);
    const wide terms = (bQ * aR + aQ * bR) * (aS + aQ * aR) + aQ * aR * aSd + aS * aSd +
                       2.0 * aQ * bQ * (wide_abs(g1) + wide_abs(g2)) +
                       Q * Q * (wide_abs(g1d) + wide_abs(g2d)) + bQ * (aP * aS + Q * Q * aR) +
                       aQ * (bP * aS + aP * aSd + 2.0 * aQ * bQ * aR + Q * Q * bR) +
                       (aP + aQ + aR) * (wide_abs(C1) + wide_abs(C2) + wide_abs(C3));
    remove_vertical(&v, b, terms);
    wide K[2], K_rate[2];
    for (int j = 0; j < 2; j++) {
        const kr_kowalewski_arc *arc = &plan->arc[j];
        const arc_point *at = j ? two : one;
        const wide ss = x[j].s * x[j].s, cc = x[j].c * x[j].c, sc = x[j].s * x[j].c * rate[j],
                   u = arc->both_a[0] * ss + arc->both_b[0] * cc,
                   w = arc->both_a[1] * ss + arc->both_b[1] * cc;
        if (plan->c > 0.0) {
            K[j] = at->N.v * at->N.v + plan->c * (at->D.v * at->D.v);
            K_rate[j] = 2.0 * (at->N.v * at->N.d + plan->c * (at->D.v * at->D.d));
        } else {
            K[j] = wide_max(u * w, wide_splat(1e-290));
            K_rate[j] = (arc->both_a[0] - arc->both_b[0]) * sc * w +
                        u * ((arc->both_a[1] - arc->both_b[1]) * sc);
        }
    }
    const wide D = one->D.v * two->D.v;
    v.re = 0.5 * (K_rate[0] / K[0] + K_rate[1] / K[1]) - 2.0 * s->a.d / s->a.v;
    v.im = plan->l * (plan->c * D - one->N.v * two->N.v) * D / (K[0] * K[1]);
    return v;
}

/* The angular velocity, and the space axes along body axes: `row`. The caller still has to turn the
 * attitude about e3 by the phase and the sine series of the heading. */
typedef struct frame_state {
    wide row[3][3];
    wide p, q, r;
} frame_state;
/* Returns the space axes and the angular velocity at the angles y. `complex` is 1 if e1 is complex.
 * If `with_rates` is 1, formulas with time derivatives prevent cancellation. If `with_rates` is 0,
 * writes the set of lanes in which a result loses digits to cancellation to `inaccurate`. */
INLINE frame_state evaluate_frame(const kr_kowalewski_plan *plan, int complex, int with_rates,
                                  const arc_angle y[2], mask *inaccurate)
{
    const wide zero = wide_splat(0.0);
    half_angle x[2];
    wide rate[2] = {zero, zero};
    arc_point one, two;
    for (int j = 0; j < 2; j++) x[j] = convert_y_to_half_x(&plan->arc[j], &y[j]);
    if (with_rates) { /* dw/F = D R dx, so that x1' = D2/(Dl R1) and x2' = D1/(Dl R2) */
        one = find_arc_point(&plan->arc[0], complex, x[0], zero);
        two = find_arc_point(&plan->arc[1], complex, x[1], zero);
        const wide Dl = find_w_difference_numerator(&one, &two).v;
        rate[0] = two.D.v / (Dl * find_differential_factor(&plan->arc[0], complex, &one));
        rate[1] = one.D.v / (Dl * find_differential_factor(&plan->arc[1], complex, &two));
    }
    one = find_arc_point(&plan->arc[0], complex, x[0], rate[0]);
    two = find_arc_point(&plan->arc[1], complex, x[1], rate[1]);
    const koetter_state s = evaluate_koetter_formulas(plan, complex, &one, &two);
    const wide P = s.p.v, Q = s.q.v, g3 = s.g3.v;
    wide R = s.r.v;
    const mask is_lost = wide_less(12.0 * (1.0 + wide_abs(R)), s.r_terms);
    if (with_rates)
        R = wide_choose(mask_and(is_lost, wide_less(wide_splat(0.3), wide_abs(Q))), 2.0 * s.p.d / Q,
                        R);
    /* xi = (p + iq)^2 + g1 + i g2 has the absolute value k and the argument of (z/Z)^2, where Z =
     * Z1 + i Z2 up to a positive factor, Z1^2 = (w1 + k)(-k - w2) and Z2^2 = (k - w1)(k - w2). */
    const wide S = with_rates ? -2.0 * s.q.d : g3 + P * s.r.v; /* Re z */
    const wide Z1 = one.plus.v * two.plus.v, Z2 = plan->sign[5] * one.minus.v * two.minus.v;
    const wide Z_re = (Z1 - Z2) * (Z1 + Z2), Z_im = 2.0 * Z1 * Z2, z_re = S, z_im = R * Q,
               z2_re = (z_re - z_im) * (z_re + z_im), z2_im = 2.0 * z_re * z_im;
    const wide xi_re = Z_re * z2_re + Z_im * z2_im, xi_im = Z_re * z2_im - Z_im * z2_re,
               unit = plan->k / wide_sqrt(xi_re * xi_re + xi_im * xi_im);
    const wide square = P * P + Q * Q, size = wide_sqrt(square),
               z_size = wide_sqrt(z_re * z_re + z_im * z_im),
               lost = (wide_abs(R) * size + wide_abs(g3)) / z_size,
               there = (fabs(plan->l) + wide_abs(R * g3) + size) / size,
               here = with_rates ? plan->k + square : plan->k * lost + plan->k + square;
    body_state b = {P, Q, R, xi_re * unit - (P - Q) * (P + Q), xi_im * unit - 2.0 * P * Q, g3};
    if (with_rates) { /* (p - iq)(g1 + i g2) = (l - r g3)/2 - i g3' */
        const mask better = wide_less(there, here);
        const wide n = 1.0 / square, re = 0.5 * (plan->l - R * g3), im = -s.g3.d;
        b.g1 = wide_choose(better, (P * re - Q * im) * n, b.g1);
        b.g2 = wide_choose(better, (P * im + Q * re) * n, b.g2);
    }
    const wide S_terms = with_rates ? wide_abs(S) : wide_abs(R * P) + wide_abs(g3);
    heading_vector best = find_vector_C(&b, S, S_terms);
    const heading_vector B = find_vector_B(plan, complex, &b, S, S_terms, &one, &two, s.a.v);
    keep_better_vector(&best, &B);
    const mask is_poor = wide_less(best.square, 1e-3 * best.terms);
    if (with_rates && mask_any(is_poor)) {
        const heading_vector V = find_derivative_of_C(plan, &s, &b, S, &one, &two, x, rate);
        heading_vector other = best;
        keep_better_vector(&other, &V);
        copy_selected_lanes(&best, &other, sizeof best, is_poor);
    }
    if (!with_rates) {
        const mask cancels =
            mask_or(mask_not(wide_at_most(lost, wide_splat(100.0))),
                    mask_and(wide_less(wide_splat(12.0), here), wide_less(3.0 * there, here)));
        *inaccurate = mask_or(mask_or(is_lost, is_poor), cancels);
    }
    /* the factors for poles of the heading */
    wide re = best.re, im = best.im;
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < plan->arc[j].poles; i++) {
            const wide u = plan->arc[j].pole_b[i] * x[j].c, v = plan->arc[j].pole_a[i] * x[j].s,
                       n = 1.0 / wide_sqrt(u * u + v * v), turned = (re * u - im * v) * n;
            im = (re * v + im * u) * n;
            re = turned;
        }
    const wide n = 1.0 / wide_sqrt(best.square * (re * re + im * im));
    /* The vector has the heading arg(re + i im). A rotation by minus this angle gives e1. */
    const wide across[3] = {b.g2 * best.z - b.g3 * best.y, b.g3 * best.x - b.g1 * best.z,
                            b.g1 * best.y - b.g2 * best.x},
               along[3] = {best.x, best.y, best.z};
    frame_state f = {.p = P, .q = Q, .r = R};
    for (int i = 0; i < 3; i++) {
        f.row[0][i] = n * (re * along[i] - im * across[i]);
        f.row[1][i] = n * (im * along[i] + re * across[i]);
    }
    f.row[2][0] = b.g1, f.row[2][1] = b.g2, f.row[2][2] = b.g3;
    return f;
}
APART void evaluate_frame_by_root_type(const kr_kowalewski_plan *plan, int with_rates,
                                       const arc_angle y[2], frame_state *out, mask *inaccurate)
{
    if (with_rates)
        *out =
            plan->pair ? evaluate_frame(plan, 1, 1, y, NULL) : evaluate_frame(plan, 0, 1, y, NULL);
    else
        *out = plan->pair ? evaluate_frame(plan, 1, 0, y, inaccurate)
                          : evaluate_frame(plan, 0, 0, y, inaccurate);
}
INLINE frame_state find_accurate_frame(const kr_kowalewski_plan *plan, const arc_angle y[2])
{
    const wide one = wide_splat(1.0);
    mask again = wide_equal(one, one);
    frame_state f, other;
    if (!plan->fast) evaluate_frame_by_root_type(plan, 0, y, &f, &again);
    if (!mask_any(again)) return f;
    evaluate_frame_by_root_type(plan, 1, y, &other, NULL);
    if (mask_all(again)) return other;
    copy_selected_lanes(&f, &other, sizeof f, again);
    return f;
}
/* Returns the unit quaternion, of arbitrary sign, of the rotation matrix in f. */
INLINE quat_lanes convert_frame_to_quaternion(const frame_state *f)
{
    const wide xx = f->row[0][0], yy = f->row[1][1], zz = f->row[2][2];
    const wide wx = f->row[2][1] - f->row[1][2], wy = f->row[0][2] - f->row[2][0],
               wz = f->row[1][0] - f->row[0][1], xy = f->row[1][0] + f->row[0][1],
               xz = f->row[0][2] + f->row[2][0], yz = f->row[2][1] + f->row[1][2];
    /* products of each component with the largest one, times 4 */
    wide largest = 1.0 + ((xx + yy) + zz);
    quat_lanes q = {largest, wx, wy, wz};
    const quat_lanes others[3] = {{wx, 1.0 + ((xx - yy) - zz), xy, xz},
                                  {wy, xy, 1.0 + ((yy - xx) - zz), yz},
                                  {wz, xz, yz, 1.0 + ((zz - xx) - yy)}};
    const wide squares[3] = {others[0].x, others[1].y, others[2].z};
    for (int i = 0; i < 3; i++) {
        copy_selected_lanes(&q, &others[i], sizeof q, wide_less(largest, squares[i]));
        largest = wide_max(largest, squares[i]);
    }
    const wide n = 1.0 / wide_sqrt((q.w * q.w + q.x * q.x) + (q.y * q.y + q.z * q.z));
    return (quat_lanes){n * q.w, n * q.x, n * q.y, n * q.z};
}
/* The smallest y in the table of signs [turns]. No y in the table is at an end of an arc. */
static const double first_node = -0.99;
/* Returns the sign (-1 or 1) of the scalar product of q and the nearest entry of the table of
 * signs, given y1 and y2 from -1 to 1 turn in `turns`. If the angle nearest to y1 is before or
 * after the table, uses that two turns away and adds -1 or 1 to wraps[0] (for y2, wraps[1]). */
INLINE wide find_quaternion_sign(const kr_kowalewski_plan *plan, quat_lanes q, const wide turns[2],
                                 wide wraps[2])
{
    const int n = plan->nodes;
    const wide zero = wide_splat(0.0), one = wide_splat(1.0);
    double at[2][LANES], node[4][LANES];
    for (int j = 0; j < 2; j++) {
        const wide i = nearest(0.5 * n * (turns[j] - first_node)),
                   after = wide_choose(wide_less(i, wide_splat(n)), zero, one);
        wraps[j] = wraps[j] + wide_choose(wide_less(i, zero), -one, after);
        wide_store(at[j], wide_choose(wide_equal(i, i), i, zero)); /* NaN: any node */
    }
    for (int i = 0; i < LANES; i++) {
        const int row = (int)at[0][i] & (n - 1), column = (int)at[1][i] & (n - 1);
        const signed char *from = get_kowalewski_sign_table(plan) + 4 * (row * n + column);
        for (int k = 0; k < 4; k++) node[k][i] = from[k];
    }
    const wide dot = (q.w * wide_load(node[0]) + q.x * wide_load(node[1])) +
                     (q.y * wide_load(node[2]) + q.z * wide_load(node[3]));
    return sign_from_mask(is_negative(dot));
}
/* Returns the state. `phase` is theta1/2, theta2/2 and the phase part of psi/2, in turns. */
INLINE state_lanes kowalewski_state_at_phases(const kr_kowalewski_plan *plan, wide time,
                                              const dd phase[3])
{
    dd theta[2], heading = phase[2];
    arc_angle y[2];
    wide turns[2], wraps[2], series[4], s, c;
    for (int j = 0; j < 2; j++)
        theta[j] = dd_make(2.0 * (phase[j].hi - nearest(phase[j].hi)), 2.0 * phase[j].lo);
    find_arc_angles(plan, theta, y);
    const frame_state f = find_accurate_frame(plan, y);
    const quat_lanes q = convert_frame_to_quaternion(&f);
    for (int j = 0; j < 2; j++) {
        wraps[j] = nearest(0.5 * (y[j].turns.hi + y[j].turns.lo));
        turns[j] = (y[j].turns.hi - 2.0 * wraps[j]) + y[j].turns.lo;
    }
    const wide sign = find_quaternion_sign(plan, q, turns, wraps);
    /* If the quaternion changes its sign when y grows by two turns, a phase compensates this. */
    for (int j = 0; j < 2; j++) {
        const wide half = wide_splat(0.5 * plan->half_turns[j]);
        heading = dd_add(heading,
                         dd_make(half * (wraps[j] - 0.5 * theta[j].hi), -0.5 * half * theta[j].lo));
    }
    sum_sine_series(plan, plan->harmonic[0].heading, 2, y, series);
    heading = dd_add(heading, dd_of(series[0] + series[1]));
    sincos_turns(heading, &s, &c);
    s = sign * s;
    c = sign * c;
    const double unit = plan->torus.momentum;
    const wide m1 = 2.0 * unit * f.p, m2 = 2.0 * unit * f.q, m3 = unit * f.r,
               turn_c = (c - s) * (c + s), turn_s = 2.0 * s * c;
    wide m[3];
    for (int i = 0; i < 3; i++) m[i] = (f.row[i][0] * m1 + f.row[i][1] * m2) + f.row[i][2] * m3;
    state_lanes r;
    r.t = time;
    r.m.x = turn_c * m[0] - turn_s * m[1];
    r.m.y = turn_s * m[0] + turn_c * m[1];
    r.m.z = m[2];
    r.q = turn_and_convert_attitude(&plan->torus, s, c, q);
    return r;
}
INLINE state_lanes kowalewski_state_after_span(const void *memory, wide time, dd span)
{
    const kr_kowalewski_plan *plan = memory;
    dd phase[3];
    for (int i = 0; i < 3; i++) phase[i] = find_torus_phase(&plan->torus, i, span);
    return kowalewski_state_at_phases(plan, time, phase);
}
#endif
