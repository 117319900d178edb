/* Times of steps whose last terms are in single precision. single_precision.py compiles this file
 * for each instruction set. Two groups of lanes share one tail, because a vector holds twice as
 * many floats as doubles. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "taylor/quat_simd.h"
#include "taylor/series.h"
#include "ensemble/lane_series.h"

enum { ROUNDS = 101, STEPS = 400, GROUPS = 2 };
typedef float floats __attribute__((vector_size(4 * GROUPS * LANES)));
#if defined __AVX512F__
#  define FUSED(a, b, c) ((floats)_mm512_fmadd_ps(a, b, c))
#  define NARROW(a) _mm512_cvtpd_ps((__m512d)wide_load(a))
#  define JOINED(a, b) (floats) _mm512_insertf32x8(_mm512_castps256_ps512(a), b, 1)
#  define WIDENED(v, group) (wide) _mm512_cvtps_pd(_mm512_extractf32x8_ps((__m512)(v), group))
#else
#  define FUSED(a, b, c) ((floats)_mm256_fmadd_ps(a, b, c))
#  define NARROW(a) _mm256_cvtpd_ps((__m256d)wide_load(a))
#  define JOINED(a, b) (floats) _mm256_set_m128(b, a)
#  define WIDENED(v, group) (wide) _mm256_cvtps_pd(_mm256_extractf128_ps((__m256)(v), group))
#endif

/* The coefficients of lane_state.h in floats: 0 to 2 of P, 3 to 5 of W, the heading f, its rate,
 * and 1 + (P, d); and the constants. */
enum { TURN = 6, RATE, NEAR, SERIES };
static floats terms[KR_LANES_ORDER + 1][SERIES], up[3], down[3], moments[3], part[2], inverse;
static kr_lanes groups[GROUPS] ALIGNED;

static double *term(kr_lanes *l, int n, int i)
{
    double *const others[] = {l->turn[n], l->rate[n], l->near[n]};
    return i < 3 ? l->p[n][i] : i < TURN ? l->w[n][i - 3] : others[i - TURN];
}
/* Converts the corresponding numbers of both groups; `first` points to that of the first group. */
INLINE floats to_floats(const double *first)
{
    const double *second = (const double *)((const char *)first + sizeof(kr_lanes));
    return JOINED(NARROW(first), NARROW(second));
}
INLINE void begin_tail(int head)
{
    kr_lanes *l = &groups[0];
    for (int n = 0; n <= head; n++)
        for (int i = 0; i < SERIES; i++) terms[n][i] = to_floats(term(l, n, i));
    for (int i = 0; i < 3; i++) {
        moments[i] = to_floats(l->k[i]);
        up[i] = to_floats(l->up[i]);
        down[i] = to_floats(l->down[i]);
        if (i < 2) part[i] = to_floats(l->part[i]);
    }
    inverse = to_floats(l->inverse);
}
/* Adds the products of coefficients j and m to the sums of P x W (0 to 2 and 3 to 5), of Wy Wz and
 * its permutations (6 to 8), of Wx Px and Wy Py (9 and 10), and of the quotient (11). */
INLINE void add_products(floats *sums, int j, int m)
{
    const floats *p = terms[j], *w = terms[j] + 3, *v = terms[m] + 3;
    for (int i = 0; i < 3; i++) {
        const int x = (i + 1) % 3, y = (i + 2) % 3;
        sums[i] = FUSED(p[x], v[y], sums[i]);
        sums[3 + i] = FUSED(p[y], v[x], sums[3 + i]);
        sums[6 + i] = FUSED(w[x], v[y], sums[6 + i]);
        if (i < 2) sums[9 + i] = FUSED(p[i], v[i], sums[9 + i]);
    }
    if (j > 0) sums[11] = FUSED(terms[j][NEAR], terms[m][RATE], sums[11]);
}
INLINE void next_in_floats(int n)
{
    floats sums[12] = {{0}}, dot = {0}, near = {0};
    if (n % 2 == 0) add_products(sums, n / 2, n / 2);
    for (int j = (n - 1) / 2; j >= 0; j--) {
        add_products(sums, j, n - j);
        add_products(sums, n - j, j);
    }
    const floats share = (float)(1.0 / (n + 1)) - (floats){0}, *p = terms[n];
    for (int i = 0; i < 3; i++) {
        const floats torque = FUSED(up[i], p[(i + 1) % 3], down[i] * p[(i + 2) % 3]);
        const floats next = share * (sums[i] - sums[3 + i]);
        terms[n + 1][i] = next;
        terms[n + 1][3 + i] = FUSED(share * moments[i], sums[6 + i], share * torque);
        dot = FUSED(terms[n][3 + i], terms[0][i], dot);
        near = FUSED(next, terms[0][i], near);
    }
    const floats sum = FUSED(part[0], sums[9], FUSED(part[1], sums[10], dot));
    terms[n][RATE] = (sum - sums[11]) * inverse;
    terms[n + 1][TURN] = share * terms[n][RATE];
    terms[n + 1][NEAR] = near;
}
INLINE void end_tail(int head, int order)
{
    for (int n = head + 1; n <= order; n++)
        for (int i = 0; i <= TURN; i++) {
            wide_store(term(&groups[0], n, i), WIDENED(terms[n][i], 0));
            wide_store(term(&groups[1], n, i), WIDENED(terms[n][i], 1));
        }
}

/* Makes a step of all lanes. The terms after `head` are in floats. */
static void step_lanes(int head, int order)
{
    for (int g = 0; g < GROUPS; g++) {
        kr_lanes *l = &groups[g];
        l->order = head;
        wide_store(l->t, wide_load(l->end));
        lane_vec_store(l->p[0], lane_vec_load(l->end_p));
        lane_vec_store(l->w[0], lane_vec_load(l->end_w));
        lane_quat_store(l->q, lane_quat_load(l->end_q));
        expand_lanes(l, 0);
        l->order = order;
    }
    if (head < order) {
        begin_tail(head);
        for (int n = head; n < order; n++) next_in_floats(n);
        end_tail(head, order);
    }
    for (int g = 0; g < GROUPS; g++) {
        kr_lanes *l = &groups[g];
        const wide end = wide_load(l->t) + lane_step_size(l, 0);
        const lane_point r = sum_lanes(l, end, 0);
        wide_store(l->end, end);
        lane_vec_store(l->end_p, r.p);
        lane_vec_store(l->end_w, r.w);
        lane_quat_store(l->end_q, lane_attitude(l, &r, 0));
    }
}
static void start_lanes(double log2_tol)
{
    for (int i = 0; i < GROUPS * LANES; i++) {
        kr_lanes *l = &groups[i / LANES];
        const int at = i % LANES;
        const double angle = 0.4 * i, A[3] = {0.6 + 0.02 * i, 0.8, 1.0};
        l->log2_tol = log2_tol;
        l->end[at] = 0.0;
        l->fall[at] = 100.0;
        for (int x = 0; x < 3; x++) {
            const int y = (x + 1) % 3, z = (x + 2) % 3;
            l->end_p[x][at] = x < 2 ? 0.6 * (x ? sin(angle) : cos(angle)) : -0.8;
            l->end_w[x][at] = 0.3 - 0.02 * i * x;
            l->end_q[1 + x][at] = 0.0;
            l->k[x][at] = (A[y] - A[z]) / A[x];
            l->up[x][at] = 0.1 * (z + 1) / A[x];
            l->down[x][at] = -0.1 * (y + 1) / A[x];
            l->part[x][at] = 1.0 - A[x] / A[2];
        }
        l->end_q[0][at] = 1.0;
    }
}
/* Returns the sums with about half of their products. */
INLINE series_sums half_the_products(const kr_series *s, const turned_pair *of, int n)
{
    const duo zero = duo_splat(0.0);
    series_sums a = {zero, zero, zero, zero, zero}, b = a;
    if (n % 2 == 0) add_term(&a, s, of, n / 2, n / 2, WHOLE);
    UNROLL
    for (int j = (n - 1) / 2; j > 0; j -= 2) add_pair(&a, &b, s, of, n - j, j, WHOLE);
    add_chains(&a, &b, WHOLE);
    add_pair(&a, &a, s, of, n, 0, WHOLE);
    return a;
}
/* Makes a step of one top with half of the products of the terms after `head`. No arithmetic with
 * twice as many lanes can take less time. The result is not a motion. */
INLINE void step_one(kr_series *s, int head, int order)
{
    turned_pair of[KR_TAYLOR_MAX + 1];
    begin_at_end(s);
    permute_known_coefficients(s, of, 0, WHOLE);
    UNROLL
    for (int n = 0; n < head; n++) next_series_coefficient(s, of, n, WHOLE, PLAIN);
    UNROLL
    for (int n = head; n < order; n++) {
        const series_sums a = half_the_products(s, of, n);
        duo_store(s->x[n + 1], attitude_rates(&a, duo_inverse(n + 1)));
        set_turned(s->w[n + 1], &of[n + 1].w,
                   velocity_rates(&a, s, duo_hi(duo_load(s->x[n])), quad_inverse(n + 1)));
    }
    s->end = s->t + series_step_size(s, order, -40.0);
    evaluate_sums(s, 0, order, &s->end, s->end_x, s->end_w);
}
/* Each order is a function, as in taylor/kernel.c. */
#define STEP(head, order)                                                                          \
    static void step_##head##_##order(kr_series *s) { step_one(s, head, order); }
#define PAIR(head, order)                                                                          \
    STEP(head, order)                                                                              \
    STEP(order, order)
PAIR(4, 12)
PAIR(5, 16)
PAIR(10, 18)
PAIR(14, 22)
PAIR(18, 28)
static const struct {
    int head, order;
    void (*half)(kr_series *s), (*whole)(kr_series *s);
} one_top[] = {{4, 12, step_4_12, step_12_12},
               {5, 16, step_5_16, step_16_16},
               {10, 18, step_10_18, step_18_18},
               {14, 22, step_14_22, step_22_22},
               {18, 28, step_18_28, step_28_28}};
static const struct {
    int head, order;
    double log2_tol;
} many_tops[] = {{4, 12, -14.5},  {6, 14, -24.5},  {8, 16, -32.5},
                 {11, 18, -46.0}, {12, 18, -53.0}, {14, 20, -54.5}};

static double processor_time(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
static double time_one(void (*step)(kr_series *s))
{
    static const double x[8] = {.6, 0, .8, 0, 0, -.96, 0, -.28}, w[4] = {0, .8, .4, .1};
    static kr_series s ALIGNED = {.k = {0, -.28, .84, -.73},
                                  .up = {0, -.02, .68, -.01},
                                  .down = {0, .06, .01, -.64},
                                  .fall = 100.0};
    const double begin = processor_time();
    for (int i = 0; i < STEPS; i++) {
        /* Each step begins at the same state, but waits for the step before. */
        duo_store(s.end_x, duo_fma(duo_splat(0.0), duo_load(s.end_x), duo_load(x)));
        quad_store(s.end_w, quad_fma(quad_splat(0.0), quad_load(s.end_w), quad_load(w)));
        step(&s);
    }
    return processor_time() - begin;
}
static double time_many(int head, int order, double log2_tol)
{
    start_lanes(log2_tol);
    const double begin = processor_time();
    for (int i = 0; i < STEPS; i++) step_lanes(head, order);
    return processor_time() - begin;
}
static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
/* Prints the time of a step, and the median of its ratio to that of another step. */
static void print_row(int head, int order, double now[ROUNDS], double other[ROUNDS], int steps)
{
    double ratio[ROUNDS];
    for (int i = 0; i < ROUNDS; i++) ratio[i] = now[i] / other[i];
    qsort(now, ROUNDS, sizeof *now, compare);
    qsort(ratio, ROUNDS, sizeof *ratio, compare);
    printf("    order %d, %d in doubles: %.0f ns, %.2f\n", order, head,
           1e9 * now[ROUNDS / 2] / steps, ratio[ROUNDS / 2]);
}
int main(void)
{
    double now[ROUNDS], other[ROUNDS];
    puts("  one top: the step, and its time over that with half of the tail's products");
    for (size_t k = 0; k < sizeof one_top / sizeof *one_top; k++) {
        for (int i = 0; i < ROUNDS; i++) {
            now[i] = time_one(one_top[k].whole);
            other[i] = time_one(one_top[k].half);
        }
        print_row(one_top[k].head, one_top[k].order, now, other, STEPS);
    }
    puts("  lanes: a step of a group, and its time over that with a tail in floats");
    for (size_t k = 0; k < sizeof many_tops / sizeof *many_tops; k++) {
        const int head = many_tops[k].head, order = many_tops[k].order;
        for (int i = 0; i < ROUNDS; i++) {
            now[i] = time_many(order, order, many_tops[k].log2_tol);
            other[i] = time_many(head, order, many_tops[k].log2_tol);
        }
        print_row(head, order, now, other, GROUPS * STEPS);
    }
    return 0;
}
