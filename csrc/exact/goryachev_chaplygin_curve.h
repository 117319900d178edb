/* The algebraic curve of a Goryachev-Chaplygin top, and averages over its arcs in double-double
 * precision.
 *
 * Units and axes: The moments are (1, 1, 1/4), and mass * |gravity| * |com| = 1. Axis 1 points
 * towards the centre of mass if gravity is positive, and away from it otherwise. Axis 3 is the
 * principal axis with moment 1/4, directed such that G is not negative. With the momentum L in the
 * body frame, g = e3 in the body frame, and <L, g> = 0,
 *     H = (L1^2 + L2^2 + 4 L3^2)/2 + g1,  G = L3 (L1^2 + L2^2) - L1 g3,
 *     p+-(u) = 2 u^3 - (H +- 1) u - G/2.
 * Chaplygin's variables u1 > 0 > u2 are the roots of u^2 - L3 u - (L1^2 + L2^2)/4. Each moves on an
 * arc between roots of p+ and p-, with du/d tau = +-sqrt(-p+ p-) in the time d tau = dt/|L| (S. A.
 * Chaplygin, 1901). On an arc
 *     u = N/D,  N = A sin^2 + B cos^2,  D = C sin^2 + cos^2  of half of an angle x.
 * Then du/sqrt(-p+ p-) = P dx, where P is an even periodic function of x. The averages can
 * therefore be computed by the trapezoidal rule, which converges exponentially for periodic
 * functions.
 *
 * This header is compiled once for each instruction set. */
#ifndef KR_GORYACHEV_CHAPLYGIN_CURVE_H
#define KR_GORYACHEV_CHAPLYGIN_CURVE_H
#include "complex.h"
#include "goryachev_chaplygin.h"
#include "phase.h"
enum { GRID = 2048 /* largest number of intervals from x = 0 to pi */ };
#include "cosines.h"

/* The roots of p+ have the indices 0, 1 and 2, and those of p- have the indices 3, 4 and 5. */
enum { CURVE_ROOTS = 6 };

typedef struct chaplygin_curve {
    dd H, G;
    int pair; /* 1 if roots 4 and 5 are complex: root[4] +- i root[5] */
    dd root[CURVE_ROOTS];
    int order[CURVE_ROOTS], real; /* indices of the real roots, ascending; their number */
} chaplygin_curve;

/* An arc from the root `high` at x = 0 to the root `low` at x = pi. */
typedef struct chaplygin_arc {
    dd A, B, C;
    int low, high;
    /* N - root D = a sin^2 + b cos^2. For a complex root, a and b are computed from its real
     * part. */
    dd a[CURVE_ROOTS], b[CURVE_ROOTS];
    dd p, q;           /* averages of P and |u| P */
    int points, terms; /* numbers of intervals used, and of significant terms of the series */
    /* Sine series of the periodic parts of the integrals of P/p and, as a function of tau, |u| P. */
    double sine[2][GRID];
} chaplygin_arc;

/* Finds the roots of 2 u^3 - h u - G/2. The largest root is computed first, by Newton's method from
 * above, where the cubic is convex. Returns the discriminant of the remaining quadratic factor,
 * divided by four times the square of the largest root. */
static double find_cubic_roots(dd h, dd G, dd root[3])
{
    const dd p = dd_half(dd_neg(h)), q = dd_times(-0.25, G);
    double x = sqrt(fabs(p.hi)) + 1.0;
    while (x * x * x < fabs(p.hi) * x + fabs(q.hi)) x *= 1.5;
    for (double next;; x = next) {
        next = x - ((x * x + p.hi) * x + q.hi) / (3.0 * x * x + p.hi);
        if (!(x - next > 1e-14 * x)) break;
    }
    dd u = dd_of(x);
    for (int i = 0; i < 4; i++)
        u = dd_sub(u, dd_div(dd_add(dd_mul(dd_add(dd_square(u), p), u), q),
                             dd_add(dd_times(3.0, dd_square(u)), p)));
    const dd product = dd_div(dd_neg(q), u), half = dd_half(u),
             square = dd_sub(dd_square(half), product), far = dd_sqrt(dd_abs(square));
    root[0] = u;
    if (square.hi < 0.0) {
        root[1] = dd_neg(half);
        root[2] = far;
    } else {
        root[1] = dd_neg(dd_add(half, far));
        root[2] = dd_div(product, root[1]);
    }
    return square.hi / (u.hi * u.hi);
}
static void sort_curve_roots(chaplygin_curve *o)
{
    o->real = 0;
    for (int i = 0; i < CURVE_ROOTS - 2 * o->pair; i++) {
        int at = o->real++;
        while (at > 0 && dd_less(o->root[i], o->root[o->order[at - 1]])) {
            o->order[at] = o->order[at - 1];
            at--;
        }
        o->order[at] = i;
    }
}
/* Finds the branch points. Returns KR_REFUSAL_NONE on success, or the reason for the
 * failure. */
static kr_refusal find_branch_points(chaplygin_curve *o)
{
    const double plus = find_cubic_roots(dd_plus(o->H, 1.0), o->G, o->root),
                 minus = find_cubic_roots(dd_plus(o->H, -1.0), o->G, o->root + 3);
    /* The discriminants of the cubic polynomials p+ and p- are accurate to about 31 digits. The
     * frequencies depend on the logarithm of the discriminant of p-. */
    if (!(plus > 1e-20)) return plus > -1e-20 ? KR_REFUSAL_COINCIDENT : KR_REFUSAL_START;
    if (!(fabs(minus) > 1e-15)) return KR_REFUSAL_SEPARATRIX;
    o->pair = minus < 0.0;
    sort_curve_roots(o);
    return KR_REFUSAL_NONE;
}
static dd ordered_root(const chaplygin_curve *o, int i) { return o->root[o->order[i]]; }

/* Computes the coefficients A, B and C of the arc between two adjacent real roots. The argument
 * `low` is the index of the lower root in the ascending list of real roots. The coefficient C of
 * the arc is chosen so that the neighbouring roots are as far from the arc as possible. */
static void make_arc(const chaplygin_curve *o, int low, chaplygin_arc *arc)
{
    const int n = o->real;
    arc->low = o->order[low];
    arc->high = o->order[low + 1];
    const dd from = o->root[arc->low], to = o->root[arc->high],
             below = ordered_root(o, (low + n - 1) % n), above = ordered_root(o, (low + 2) % n);
    const dd up = dd_mul(dd_sub(to, below), dd_sub(to, above)),
             down = dd_mul(dd_sub(below, from), dd_sub(above, from));
    arc->C = dd_sqrt(dd_abs(dd_div(up, down)));
    arc->A = dd_mul(from, arc->C);
    arc->B = to;
    for (int i = 0; i < CURVE_ROOTS; i++) {
        arc->a[i] = dd_mul(arc->C, dd_sub(from, o->root[i]));
        arc->b[i] = dd_sub(to, o->root[i]);
    }
}
/* Sets up the arcs on which Chaplygin's variables u1 and u2 move. Returns 0 if the initial value of
 * u1 or u2 lies outside its arc. */
static int make_arcs(const chaplygin_curve *o, dd u1, dd u2, chaplygin_arc arc[2])
{
    const int lower = o->real == 4 || u2.hi < 0.5 * (ordered_root(o, 1).hi + ordered_root(o, 2).hi);
    make_arc(o, o->real - 2, &arc[0]);
    make_arc(o, lower ? 0 : 2, &arc[1]);
    for (int j = 0; j < 2; j++) {
        const dd u = j ? u2 : u1;
        const double slack = 1e-25 * (1.0 + fabs(u.hi));
        if (!(dd_sub(u, o->root[arc[j].low]).hi >= -slack) ||
            !(dd_sub(o->root[arc[j].high], u).hi >= -slack))
            return 0;
    }
    return 1;
}
static dd mix(dd a, dd s, dd b, dd c) { return dd_add(dd_mul(a, s), dd_mul(b, c)); }
/* Returns P, and writes |u| to `size`. s and c are sin^2 and cos^2 of x/2. */
static dd arc_rate(const chaplygin_curve *o, const chaplygin_arc *arc, dd s, dd c, dd *size)
{
    const dd D = mix(arc->C, s, dd_of(1.0), c);
    dd product = dd_of(1.0);
    for (int i = 0; i < CURVE_ROOTS - o->pair; i++) {
        if (i == arc->low || i == arc->high) continue;
        dd factor = mix(arc->a[i], s, arc->b[i], c);
        if (o->pair && i == 4) factor = dd_add(dd_square(factor), dd_square(dd_mul(o->root[5], D)));
        product = dd_mul(product, factor);
    }
    *size = dd_abs(dd_div(mix(arc->A, s, arc->B, c), D));
    return dd_half(dd_mul(D, dd_sqrt(dd_div(arc->C, dd_abs(product)))));
}
/* Fills the arc of the plan, except for its series and its sign. */
static void fill_arc(const chaplygin_curve *o, const chaplygin_arc *arc, kr_chaplygin_arc *out)
{
    out->A = fabs(arc->A.hi);
    out->B = fabs(arc->B.hi);
    out->C = arc->C.hi;
    out->pair = o->pair;
    out->imaginary = o->pair ? o->root[5].hi : 0.0;
    for (int i = 0; i < CURVE_ROOTS; i++) {
        out->a[i] = i == arc->low ? arc->b[i].hi : arc->a[i].hi;
        out->b[i] = i == arc->high ? arc->a[i].hi : arc->b[i].hi;
    }
    if (o->pair) out->a[5] = out->b[5] = 1.0;
    for (int k = 0; k < 2; k++) {
        out->has_sine[k] = arc->high / 3 == k;
        out->has_cosine[k] = arc->low / 3 == k;
    }
}
/* Samples of the integrands P and |u| P on an arc, and their weighted sums. */
typedef struct arc_samples {
    dd v[2][GRID + 1]; /* P and |u| P */
    dd sum[2];
} arc_samples;

static void sample_arc(const chaplygin_curve *o, const chaplygin_arc *arc, const cosine_table *t,
                       int i, arc_samples *out)
{
    const dd c = dd_half(dd_plus(t->c[i], 1.0)), s = dd_half(dd_sub(dd_of(1.0), t->c[i]));
    const double weight = i == 0 || i == GRID ? 0.5 : 1.0;
    dd size;
    out->v[0][i] = arc_rate(o, arc, s, c, &size);
    out->v[1][i] = dd_mul(out->v[0][i], size);
    for (int k = 0; k < 2; k++) out->sum[k] = dd_add(out->sum[k], dd_scale(weight, out->v[k][i]));
}
/* Computes the averages of the integrands P and |u| P over an arc. The number of intervals is
 * doubled until no average changes by more than the rounding error of a double. Convergence is
 * exponential, so the relative error of an average is about the square of its relative change in
 * the last doubling. Returns 0 if the averages have not converged when the arc is divided into GRID
 * intervals. */
static int average_arc(const chaplygin_curve *o, chaplygin_arc *arc, cosine_table *table,
                       arc_samples *v)
{
    dd mean[2] = {{0.0, 0.0}};
    memset(v, 0, sizeof *v);
    sample_arc(o, arc, table, 0, v);
    sample_arc(o, arc, table, GRID, v);
    for (int n = 1; n <= GRID; n *= 2) {
        const int stride = GRID / n;
        int settled = n >= 16;
        refine_cosines(table, stride);
        for (int i = stride; i < GRID; i += 2 * stride) sample_arc(o, arc, table, i, v);
        for (int k = 0; k < 2; k++) {
            const dd now = dd_div(v->sum[k], dd_of(n));
            settled &= fabs(dd_sub(now, mean[k]).hi) <= 1e-16 * now.hi;
            mean[k] = now;
        }
        if (!settled) continue;
        arc->p = mean[0];
        arc->q = mean[1];
        arc->points = n;
        for (int k = 0; k < 2; k++) integrate_samples(v->v[k], table, n, arc->sine[k]);
        arc->terms = 2;
        for (int k = 0; k < n; k++) {
            arc->sine[0][k] /= arc->p.hi;
            arc->sine[1][k] -= arc->q.hi * arc->sine[0][k];
            if (fabs(arc->sine[0][k]) + fabs(arc->sine[1][k]) / arc->q.hi > 0x1p-56)
                arc->terms = k + 2 - k % 2;
        }
        return 1;
    }
    return 0;
}
/* Evaluates one of the two sine series of an arc; `which` is its index. Even and odd terms have
 * separate recurrences, which do not wait for each other. */
static double sum_arc_sines(const chaplygin_arc *arc, int which, double s, double c)
{
    const double *const term = arc->sine[which], twice = 2.0 * (c - s) * (c + s);
    double even = 0.0, even_before = 0.0, odd = 0.0, odd_before = 0.0;
    for (int k = arc->terms - 2; k >= 0; k -= 2) {
        const double e = twice * even + (term[k] - even_before),
                     o = twice * odd + (term[k + 1] - odd_before);
        even_before = even;
        odd_before = odd;
        even = e;
        odd = o;
    }
    return s * (2.0 * c * even_before + (odd + odd_before));
}
#endif
