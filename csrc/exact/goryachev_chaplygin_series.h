/* Set-up of the Fourier series for a Goryachev-Chaplygin top. The angles alpha1 and alpha2 grow at
 * constant rates with respect to the rescaled time tau. Functions of an angle are sampled at the
 * multiples of pi/M between 0 and pi. Each sampled function is even or odd about 0, and also even
 * or odd about pi. Each Fourier series therefore contains only sines or only cosines, of either
 * integer or half-integer multiples of the angle.
 *
 * The rate of the heading in tau is 2 (c1 s2 + s1 c2)/(c1^2 + s1^2 + c2^2 + s2^2). Integration
 * divides each Fourier term by its frequency, which is a sum or difference of multiples of the two
 * angles' rates. Terms whose frequency is close to zero are integrated separately, as definite
 * integrals from the initial time (kr_slow_term). The error of a term with a frequency near zero
 * grows linearly with time, but more slowly than the effect of rounding the initial state.
 *
 * This header is compiled once for each instruction set. */
#ifndef KR_GORYACHEV_CHAPLYGIN_SERIES_H
#define KR_GORYACHEV_CHAPLYGIN_SERIES_H
#include "goryachev_chaplygin_curve.h"
#include "goryachev_chaplygin_state.h"

enum { LEAST_POINTS = 16, MOST_POINTS = 1024, LARGE_TERM = 4 };
/* The largest number of samples of the heading rate. The limit permits grids of 256 by 1024 or 512
 * by 512 intervals. */
enum { GRID_SAMPLES = (MOST_POINTS / 4 + 1) * (MOST_POINTS + 1) };

/* Intermediate results of the computation of the Fourier series. */
typedef struct series_work {
    cosine_table table;
    arc_samples samples;
    chaplygin_arc arc[2];
    double row[3][MOST_POINTS + 1];
    /* Samples of |c|, |s| and the periodic part of the time in each angle from 0 to pi, and the
     * number of their intervals. */
    double part[2][3][MOST_POINTS + 1];
    int points[2];
    double sign[2][2]; /* signs of c and s of each angle between 0 and pi */
    double grid[2][GRID_SAMPLES];
    cx fourier[2 * MOST_POINTS];
    double tail; /* largest relative size of the terms that a series leaves out */
} series_work;

/* Returns the cosine of pi * order * i/2M, or its sine if `is_sine` is nonzero. */
static double wave_at(const cosine_table *t, int M, int is_sine, int order, int i)
{
    const int at = (order * i + (is_sine ? 3 * M : 0)) % (4 * M),
              up = at <= 2 * M ? at : 4 * M - at;
    return t->c[up * (GRID / (2 * M))].hi;
}
/* Returns exp(-i pi j/2M) for j = `at`, using the table of cosines. */
static cx unit_at(const cosine_table *t, int M, int at)
{
    return cx_of(wave_at(t, M, 0, 1, at), -wave_at(t, M, 1, 1, at));
}
/* Computes the discrete Fourier transform of n = 2^j numbers in place (Cooley and Tukey 1965). */
static void fourier_transform(const cosine_table *t, int M, int n, cx v[])
{
    for (int i = 1, j = 0; i < n; i++) {
        int bit = n / 2;
        for (; j & bit; bit /= 2) j ^= bit;
        j ^= bit;
        if (i < j) {
            const cx other = v[i];
            v[i] = v[j];
            v[j] = other;
        }
    }
    for (int size = 2; size <= n; size *= 2)
        for (int k = 0; k < size / 2; k++) {
            const cx turn = unit_at(t, M, 4 * M / size * k);
            for (int i = k; i < n; i += size) {
                const cx other = cx_mul(turn, v[i + size / 2]);
                v[i + size / 2] = cx_sub(v[i], other);
                v[i] = cx_add(v[i], other);
            }
        }
}
/* Replaces M + 1 samples, stored at intervals of `stride`, with their Fourier coefficients. Term k
 * contains the sine or cosine of k times the angle, or of k + 1/2 times the angle if `is_whole` is
 * 0. If `is_whole` is 0, the symmetry of the samples permits a discrete Fourier transform of half
 * the length. */
static void transform(series_work *w, int M, int is_sine, int is_whole, int stride, double v[])
{
    cx *const f = w->fourier;
    const int n = is_whole ? 2 * M : M;
    memset(f, 0, sizeof(cx) * (size_t)n);
    for (int i = 0; i <= M; i++) {
        const double sample = (i % M ? 1.0 : 0.5) * v[i * stride];
        const cx turn = is_whole ? cx_of(1.0, 0.0) : unit_at(&w->table, M, i);
        f[i % n] = cx_add(f[i % n], cx_scale(sample, turn));
    }
    fourier_transform(&w->table, M, n, f);
    for (int k = 0; k < M; k++) {
        const cx c = is_whole ? f[k] : k % 2 ? cx_conj(f[M - 1 - k / 2]) : f[k / 2];
        v[k * stride] = (is_whole && k == 0 ? 1.0 : 2.0) / M * (is_sine ? -c.im : c.re);
    }
    v[M * stride] = 0.0;
}
/* Estimates the relative truncation error from the last quarter of the coefficients. */
static double tail_of(const double v[], int M)
{
    double most = 0.0, last = 0.0;
    for (int k = 0; k < M; k++) {
        most = fmax(most, fabs(v[k]));
        if (4 * k >= 3 * M) last = fmax(last, fabs(v[k]));
    }
    return last / most;
}
/* Returns the number of coefficients up to the last significant one, rounded up to an even number.
 * A coefficient is significant if its magnitude exceeds 2^-53 times the largest magnitude or 2^-53
 * times `scale`, whichever is greater. M is even. */
static int count_terms(const double v[], int M, double scale)
{
    int count = M;
    double most = scale;
    for (int k = 0; k < M; k++) most = fmax(most, fabs(v[k]));
    while (count > 1 && !(fabs(v[count - 1]) > 0x1p-53 * most)) count--;
    return count + count % 2;
}
/* Uses bracketed Newton iteration to find the x in [0, pi] that corresponds to the angle pi i/M.
 * Writes the sine and cosine of x/2. */
static void find_variable(const chaplygin_curve *o, const chaplygin_arc *arc, int i, int M,
                          double *s, double *c)
{
    const double alpha = 0.5 * two_pi * i / M;
    double low = 0.0, high = 0.5 * two_pi, x = alpha;
    for (int step = 0; step < 80; step++) {
        dd size;
        sincos_turns(dd_times(0.5 * x, one_turn()), s, c);
        const double sine = 2.0 * *s * *c, cosine = *c * *c - *s * *s,
                     value = x + sum_arc_sines(arc, 0, sine, cosine) / arc->p.hi - alpha,
                     slope = arc_rate(o, arc, dd_of(*s * *s), dd_of(*c * *c), &size).hi / arc->p.hi;
        if (value > 0.0)
            high = x;
        else
            low = x;
        double next = x - value / slope;
        if (!(next >= low && next <= high)) next = 0.5 * (low + high);
        const double change = fabs(next - x);
        x = next;
        if (change < 1e-13) break;
    }
    sincos_turns(dd_times(0.5 * x, one_turn()), s, c);
    if (i == 0) *s = 0.0, *c = 1.0;
    if (i == M) *s = 1.0, *c = 0.0;
}
/* Returns the periodic part of the integral of |u| over tau, given the sine and cosine of x. */
static double arc_time(const chaplygin_arc *arc, double sine, double cosine)
{
    return sum_arc_sines(arc, 1, sine, cosine) -
           arc->q.hi / arc->p.hi * sum_arc_sines(arc, 0, sine, cosine);
}
/* Computes c, s and the periodic part of the time at M + 1 values of angle j, from 0 to pi, and
 * keeps the samples that are known for M/2 intervals. Where c and s are both close to zero, the
 * heading rate is largest, and their relative errors matter. These are small in arc_halves, but not
 * in the Fourier series of c and s. */
static void sample_angle(const chaplygin_curve *o, series_work *w, int j, int M)
{
    const chaplygin_arc *arc = &w->arc[j];
    double (*const part)[MOST_POINTS + 1] = w->part[j];
    const int is_finer = 2 * w->points[j] == M;
    for (int k = 0; k < 3 && is_finer; k++)
        for (int i = M / 2; i > 0; i--) part[k][2 * i] = part[k][i];
    for (int i = is_finer; i <= M; i += 1 + is_finer) {
        double s, c, half[2];
        find_variable(o, arc, i, M, &s, &c);
        arc_halves(o, arc, s, c, half);
        part[0][i] = half[0];
        part[1][i] = half[1];
        part[2][i] = arc_time(arc, 2.0 * s * c, c * c - s * s);
    }
    refine_cosines(&w->table, GRID / (2 * M));
    w->points[j] = M;
}
/* Computes the Fourier series in one of the angles alpha1 and alpha2. Returns 0 if a series
 * converges too slowly. */
static int make_angle_series(const chaplygin_curve *o, series_work *w, int j, kr_angle_series *e)
{
    const chaplygin_arc *arc = &w->arc[j];
    w->points[j] = 0;
    for (int k = 0; k < 2; k++) {
        const int has_sine = arc->high / 3 == k, has_cosine = arc->low / 3 == k;
        e->is_sine[k] = has_sine;
        e->is_whole[k] = has_sine == has_cosine;
    }
    for (int M = LEAST_POINTS;; M *= 2) {
        double tail = 0.0;
        sample_angle(o, w, j, M);
        memcpy(w->row, w->part[j], sizeof w->row);
        for (int k = 0; k < 3; k++) {
            transform(w, M, k == 2 || e->is_sine[k], k == 2 || e->is_whole[k], 1, w->row[k]);
            tail = fmax(tail, k == 2 ? tail_of(w->row[2], M) : tail_of(w->row[k], M));
        }
        if (tail > 4e-16 && M < MOST_POINTS) continue;
        w->tail = fmax(w->tail, tail);
        for (int k = 0; k < 2; k++) {
            e->count[k] = count_terms(w->row[k], M, 0.0);
            memcpy(e->part[k], w->row[k], sizeof(double) * (size_t)e->count[k]);
        }
        /* On average, the time increases by q per radian of the torus angle of this arc. */
        e->times = count_terms(w->row[2], M, arc->q.hi);
        for (int k = 0; k < e->times; k++) {
            e->time[k] = w->row[2][k];
            e->time_rate[k] = k * w->row[2][k];
        }
        return tail < 1e-13;
    }
}
/* Computes the two-dimensional Fourier coefficients of the heading rate. The first grid holds the
 * coefficients of sines of the first angle, and the second grid those of cosines. Each row of a
 * grid corresponds to a multiple of the first angle, and each column to a multiple of the
 * second. */
static void transform_heading(series_work *w, const kr_angle_series angle[2], const int M[2])
{
    const int width = M[1] + 1, sine = !angle[0].is_sine[0], up = w->points[0] / M[0],
              along = w->points[1] / M[1];
    for (int g = 0; g < 2; g++) {
        const int one = g ? !sine : sine; /* c of angle 1 times s of angle 2, or s times c */
        double *v = w->grid[g];
        const double *const first[2] = {w->part[0][one], w->part[0][!one]}, *const second[2] = {
                                                                                w->part[1][!one],
                                                                                w->part[1][one]};
        const double signs = w->sign[0][one] * w->sign[1][!one];
        for (int i = 0; i <= M[0]; i++) {
            double *row = v + i * width;
            const double c = first[0][i * up], s = first[1][i * up];
            for (int j = 0; j <= M[1]; j++) {
                const double C = second[0][j * along], S = second[1][j * along];
                row[j] = 2.0 * signs * c * C / ((c * c + s * s) + (C * C + S * S));
            }
            transform(w, M[1], angle[1].is_sine[!one], angle[1].is_whole[!one], 1, row);
        }
        for (int k = 0; k < M[1]; k++) transform(w, M[0], !g, angle[0].is_whole[one], width, v + k);
    }
}
/* Estimates the relative truncation error in each of the two angles from the last eighth of the
 * coefficients. */
static void find_heading_tails(const series_work *w, const int M[2], double tail[2])
{
    double most = 0.0, last[2] = {0.0, 0.0};
    for (int k1 = 0; k1 < M[0]; k1++)
        for (int k2 = 0; k2 < M[1]; k2++) {
            const double size = fmax(fabs(w->grid[0][k1 * (M[1] + 1) + k2]),
                                     fabs(w->grid[1][k1 * (M[1] + 1) + k2]));
            most = fmax(most, size);
            if (8 * k1 >= 7 * M[0]) last[0] = fmax(last[0], size);
            if (8 * k2 >= 7 * M[1]) last[1] = fmax(last[1], size);
        }
    for (int j = 0; j < 2; j++) tail[j] = last[j] / most;
}
/* Returns 1 if memory suffices for twice as many grid points along axis j. */
static int has_room(const int M[2], int j)
{
    return M[j] < MOST_POINTS && (2 * M[j] + 1) * (M[1 - j] + 1) <= GRID_SAMPLES;
}
/* Refines the grid until the last Fourier coefficients are at rounding level, or the memory for
 * samples is exhausted.
 * Returns an estimate of the relative truncation error. */
static double make_heading_grid(const chaplygin_curve *o, series_work *w,
                                const kr_angle_series angle[2], int M[2])
{
    double tail[2];
    M[0] = M[1] = LEAST_POINTS;
    for (;;) {
        transform_heading(w, angle, M);
        find_heading_tails(w, M, tail);
        int grows = 0;
        for (int j = 0; j < 2; j++)
            if (tail[j] > 1e-15 && has_room(M, j)) {
                M[j] *= 2;
                if (M[j] > w->points[j]) sample_angle(o, w, j, M[j]);
                grows = 1;
            }
        if (!grows) return fmax(tail[0], tail[1]);
    }
}
/* Amplitudes and frequencies of a pair of terms of the heading rate. The two frequencies are the
 * sum and the difference of a multiple of the first angle's rate and a multiple of the second
 * angle's rate. */
typedef struct heading_pair {
    double value[2], rate[2];
} heading_pair;

/* Appends a slow term for the sum (`way` = 1) or the difference (`way` = -1) of the multiples.
 * Returns 0 if the array plan->slow has no room for another term. */
static int append_slow(kr_chaplygin_plan *plan, double value, double rate, const int order[2],
                       int way, const dd half[2])
{
    if (plan->slow_terms == SLOW_TERMS) return 0;
    kr_slow_term *n = &plan->slow[plan->slow_terms++];
    double s, c;
    n->first = order[0];
    n->second = way * order[1];
    n->value = value;
    n->rate = rate;
    n->over = rate != 0.0 ? value / rate : 0.0;
    n->offset = plan->is_even ? 0.0 : -0.25;
    const dd sum =
        dd_plus(dd_add(dd_times(n->first, half[0]), dd_times(n->second, half[1])), n->offset);
    n->phase = (sum.hi - nearest(sum.hi)) + sum.lo;
    sincos_turns(dd_of(n->phase), &s, &c);
    n->sine = s;
    return 1;
}
/* Integrates a pair of terms of the heading rate, and writes the resulting cosine and sine
 * coefficients. Returns 0 if the array plan->slow has no room for another term. */
static int make_pair(kr_chaplygin_plan *plan, const heading_pair *pair, const int order[2],
                     const dd half[2], double out[2])
{
    double d[2];
    for (int i = 0; i < 2; i++) {
        const double value = pair->value[i], rate = pair->rate[i];
        d[i] = 0.0;
        if (value == 0.0) continue;
        if (fabs(value) > LARGE_TERM * fabs(rate)) {
            if (!append_slow(plan, value, rate, order, i ? -1 : 1, half)) return 0;
        } else
            d[i] = value / rate;
    }
    out[0] = plan->is_even ? d[0] + d[1] : -(d[0] + d[1]);
    out[1] = d[0] - d[1];
    return 1;
}
/* Integrates the heading rate, and writes the terms of the heading series. The array `half`
 * contains half of each initial angle, in turns. Returns 0 if the series has too many terms. */
static int fill_heading_rows(kr_chaplygin_plan *plan, const series_work *w, const int M[2],
                             const dd rate[2], const dd half[2])
{
    const int is_whole = plan->angle[1].is_whole[0];
    int terms = 0;
    plan->rows = plan->wide = plan->slow_terms = 0;
    for (int k1 = 0; k1 < M[0]; k1++) {
        kr_heading_row row = {k1, 0, 0};
        const int begin = terms;
        int end = begin;
        for (int k2 = 0; k2 < M[1]; k2++) {
            const int order[2] = {2 * k1 + 1, 2 * k2 + !is_whole}, at = k1 * (M[1] + 1) + k2;
            const double sine = 0.5 * w->grid[0][at], cosine = 0.5 * w->grid[1][at];
            const dd one = dd_times(0.5 * order[0], rate[0]),
                     two = dd_times(0.5 * order[1], rate[1]);
            const heading_pair pair = {{plan->is_even ? cosine - sine : sine + cosine,
                                        plan->is_even ? cosine + sine : sine - cosine},
                                       {dd_add(one, two).hi, dd_sub(one, two).hi}};
            double c[2];
            if (!(fabs(sine) + fabs(cosine) > 1e-18))
                c[0] = c[1] = 0.0;
            else if (!make_pair(plan, &pair, order, half, c))
                return 0;
            const int matters = fabs(c[0]) + fabs(c[1]) > 1e-17;
            if (end == begin && !matters) continue;
            if (end == begin) terms = begin, row.from = k2;
            if (terms + 2 > HEADING_TERMS) return 0;
            plan->term[terms++] = c[0];
            plan->term[terms++] = c[1];
            if (matters) end = terms;
        }
        terms = end;
        row.count = (end - begin) / 2;
        if (row.count == 0) continue;
        if (row.count % 2) { /* the number of pairs is even */
            if (terms + 2 > HEADING_TERMS) return 0;
            plan->term[terms] = plan->term[terms + 1] = 0.0;
            terms += 2;
            row.count++;
        }
        plan->row[plan->rows++] = row;
        if (row.from + row.count > HEADING_WIDE) return 0;
        if (row.from + row.count > plan->wide) plan->wide = row.from + row.count;
    }
    return 1;
}
#endif
