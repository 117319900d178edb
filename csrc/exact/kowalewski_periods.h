/* The matrix B and the vector b of the theta functions of a Kowalewski top, in double precision.
 * Both are integrals of v = M^-1 (dw/F, w dw/F), where the elements of M are the periods of the two
 * arcs.
 *   B    Row j is 2 |Im int v| from the end of arc j to the root at the other end of the adjacent
 *        gap. If only three roots are real, the integral ends at a complex root instead.
 *   b    Half the sum of two integrals Im int v, from the lower end of w1's arc to the poles
 *        w^2 = k^2 - 1 of the heading, where F = i l. The integrals determine b only up to the
 *        addition of rows of B/2.
 * A path leads from a root at x = 0 towards another root at x = pi. On an integration path, w = N/D
 * has the same form as on the arcs, but with complex coefficients. Each path is therefore an arc of
 * a circle or a segment of a straight line.
 *
 * This header is compiled once for each instruction set. */
#ifndef KR_KOWALEWSKI_PERIODS_H
#define KR_KOWALEWSKI_PERIODS_H
#include "kowalewski_averages.h"

enum { OTHERS = 4, NODES_MOST = 256 /* largest number of nodes for a unit of u */ };

/* An integral counts as converged if refining the quadrature changes it by a relative amount below
 * the limit SETTLED or WELL_SETTLED. With the limit SETTLED, the error of an integral can reach
 * 1e-12, but only if the integrand has a weak singularity near the path. If the limit is
 * WELL_SETTLED, the integrals are accurate to within rounding errors. */
#define SETTLED 1e-9
#define WELL_SETTLED 1e-14

/* A path. For each of the `count` branch points that are not ends of the path, N - root D = a sin^2
 * + b cos^2. The coefficient `A` describes the deviation of w from its value at the start of the
 * path. The member `across` is the product of the coefficients A and E. The tolerance `settled` is
 * either SETTLED or WELL_SETTLED. */
typedef struct kowalewski_path {
    cx A, C, E, across, a[OTHERS], b[OTHERS];
    cx near[OTHERS], near_d;           /* reference points for the signs of square roots */
    cx near_root[OTHERS], near_d_root; /* square roots of the reference points */
    cx scale;                          /* a constant factor of dt/dx */
    int count, infinite;
    double settled;
} kowalewski_path;

/* Returns the index of the root that holds the real part of root i. */
static int real_part_of(const kowalewski_curve *o, int i) { return o->pair && i == 2 ? 1 : i; }
static double imaginary_part(const kowalewski_curve *o, int i)
{
    if (!o->pair || (i != 1 && i != 2)) return 0.0;
    return i == 1 ? o->root[2].hi : -o->root[2].hi;
}
/* Returns root i minus root j, computed without cancellation. */
static cx root_less_root(const kowalewski_curve *o, int i, int j)
{
    const dd re = root_apart(o, real_part_of(o, i), real_part_of(o, j));
    return cx_of(re.hi + 0.0, imaginary_part(o, i) - imaginary_part(o, j)); /* not -0 */
}
/* Returns the point nearest to zero on the segment from a to b. The quotient of any point of the
 * segment and the returned point has a positive real part. For accuracy, the position on the
 * segment is measured from the endpoint that is closer to zero. */
static cx nearest_on_segment(cx a, cx b)
{
    const int swap = cx_square(b) < cx_square(a);
    const cx from = swap ? b : a, way = cx_sub(swap ? a : b, from);
    const double size = cx_square(way),
                 at = size > 0.0 ? -(from.re * way.re + from.im * way.im) / size : 0.0;
    return cx_add(from, cx_scale(fmin(1.0, fmax(0.0, at)), way));
}
/* Prepares a path for numerical integration. The path is followed from its start to sin^2(x/2) =
 * `end`. Branch points beyond the end of the path do not affect the integral. */
static void finish_path(kowalewski_path *p, double end)
{
    for (int i = 0; i < p->count; i++) {
        const cx to = cx_add(cx_scale(end, p->a[i]), cx_scale(1.0 - end, p->b[i]));
        p->near[i] = nearest_on_segment(to, p->b[i]);
        p->near_root[i] = cx_sqrt(p->near[i]);
    }
    p->near_d = nearest_on_segment(p->C, p->E);
    p->near_d_root = cx_sqrt(p->near_d);
    p->scale = cx_sqrt(cx_scale(p->infinite ? -0.5 : 0.5, cx_mul(p->infinite ? p->A : p->C, p->E)));
}
/* Returns the integration path from root i to root j, given its coefficients C and E. */
static kowalewski_path path_between(const kowalewski_curve *o, int i, int j, cx C, cx E)
{
    kowalewski_path p = {.C = C, .E = E, .settled = o->settled};
    const cx way = root_less_root(o, j, i);
    p.A = cx_mul(way, C);
    p.across = cx_mul(cx_mul(C, E), way);
    for (int r = 0; r < ROOTS; r++) {
        if (r == i || r == j) continue;
        p.a[p.count] = cx_mul(C, root_less_root(o, j, r));
        p.b[p.count++] = cx_mul(E, root_less_root(o, i, r));
    }
    finish_path(&p, 1.0);
    return p;
}
static cx tracked_root(cx z, cx near, cx near_root)
{
    return cx_mul(cx_sqrt(cx_div(z, near)), near_root);
}
/* Computes dt/dx and (w - base) dt/dx, where base is the value of w at the start of the path.
 * Returns D. */
static cx path_at(const kowalewski_path *p, double s, double c, cx out[2])
{
    const cx D = cx_add(cx_scale(s, p->C), cx_scale(c, p->E));
    cx under = cx_of(1.0, 0.0);
    for (int i = 0; i < p->count; i++) {
        const cx N = cx_add(cx_scale(s, p->a[i]), cx_scale(c, p->b[i]));
        under = cx_mul(under, tracked_root(N, p->near[i], p->near_root[i]));
    }
    const cx over = p->infinite ? D : tracked_root(D, p->near_d, p->near_d_root);
    out[0] = cx_div(cx_mul(p->scale, over), under);
    out[1] = cx_mul(out[0], cx_div(cx_scale(s, p->A), D));
    return D;
}
/* The segment of a path over which a function is integrated. If `all` is nonzero, the segment is
 * the whole path. Otherwise, the segment begins at the start of the path and ends where tan^2(x/2)
 * = `most`. If `backwards` is nonzero, the segment begins at the end of the path and ends where
 * cot^2(x/2) = `most`. */
typedef struct path_part {
    int all, backwards;
    double most;
} path_part;

/* Adds the contribution of one node u of the double exponential rule to the integrals of dt/dx and
 * (w - base) dt/dx. With y = exp(pi sinh u), tan^2(x/2) is y on a whole path; on a segment,
 * tan^2(x/2), or cot^2(x/2) if it runs backwards, is `most` * y/(1 + y). Returns 0 if the
 * contribution of the quadrature node is negligible. */
static int add_node(const kowalewski_path *p, path_part part, double u, cx sum[2], double size[2])
{
    const double pi = 3.14159265358979323846;
    wide sinh_u, cosh_u;
    cx v[2];
    sinhcosh(dd_of(u), &sinh_u, &cosh_u);
    const exponential e = exponential_of(dd_of(-pi * fabs(sinh_u)));
    const double small = e.plus * (e.even + e.odd), large = 1.0 / (1.0 + small),
                 share = u < 0.0 ? small * large : large, rest = u < 0.0 ? large : small * large,
                 y = part.all ? (u < 0.0 ? small : 1.0 / small) : part.most * share,
                 s = y / (1.0 + y), c = 1.0 / (1.0 + y),
                 weight = pi * cosh_u * sqrt(s * c) * (part.all ? 1.0 : rest);
    path_at(p, part.backwards ? c : s, part.backwards ? s : c, v);
    for (int k = 0; k < 2; k++) {
        sum[k] = cx_add(sum[k], cx_scale(weight, v[k]));
        size[k] += weight * cx_abs(v[k]);
    }
    return weight * cx_abs(v[0]) > 1e-18 * size[0] || weight * cx_abs(v[1]) > 1e-18 * size[1];
}
/* Integrates dt/dx and (w - base) dt/dx over a segment of a path by double exponential quadrature.
 * Returns 0 if the quadrature does not converge. */
static int integrate_part(const kowalewski_path *p, path_part part, cx out[2])
{
    cx sum[2] = {{0.0, 0.0}}, old[2] = {{0.0, 0.0}};
    double size[2] = {0.0, 0.0};
    out[0] = out[1] = cx_of(0.0, 0.0);
    add_node(p, part, 0.0, sum, size);
    for (int n = 2; n <= NODES_MOST; n *= 2) {
        const double step = 1.0 / n;
        double change = 0.0;
        for (int side = -1; side <= 1; side += 2)
            for (int i = 1; i * step < 4.3; i += n == 2 ? 1 : 2)
                if (!add_node(p, part, side * i * step, sum, size)) break;
        for (int k = 0; k < 2; k++) {
            out[k] = cx_scale(step, sum[k]);
            change = fmax(change, cx_abs(cx_sub(out[k], old[k])) / (step * size[k] + 1e-300));
            old[k] = out[k];
        }
        /* With the largest number of nodes, rounding errors require the looser tolerance
         * SETTLED. */
        if (n >= 8 && change < (n < NODES_MOST ? p->settled : SETTLED)) return 1;
    }
    return 0;
}
/* Integrates over a path from its beginning to tan^2(x/2) = `most`. Returns 0 if the double
 * exponential quadrature does not converge. */
static int integrate_path(const kowalewski_path *p, double most, cx out[2])
{
    const path_part all = {1, 0, 0.0}, start = {0, 0, most}, end = {0, 1, 1.0 / most};
    cx rest[2] = {{0.0, 0.0}};
    if (most <= 1e8) return integrate_part(p, start, out);
    if (!integrate_part(p, all, out)) return 0;
    if (most < INFINITY && !integrate_part(p, end, rest)) return 0;
    for (int k = 0; k < 2; k++) out[k] = cx_sub(out[k], rest[k]);
    return 1;
}
/* The periods of dw/F and (w - base) dw/F over both arcs. */
typedef struct based_periods {
    double p1, q1, p2, q2, det;
} based_periods;

static based_periods periods_from(const kowalewski_arc arc[2], const kowalewski_rates *rates,
                                  dd base)
{
    const based_periods r = {arc[0].p.hi, dd_sub(arc[0].q, dd_mul(base, arc[0].p)).hi, arc[1].p.hi,
                             dd_sub(arc[1].q, dd_mul(base, arc[1].p)).hi, rates->det.hi};
    return r;
}
/* Normalizes the integrals (x, y) by multiplying them by the inverse of the period matrix M. */
static void normalise(const based_periods *m, double x, double y, double v[2])
{
    v[0] = (m->p2 * y - m->q2 * x) / m->det;
    v[1] = (m->p1 * y - m->q1 * x) / m->det;
}
/* The matrix B, its relative asymmetry, and the vector b (`shift`). */
typedef struct kowalewski_matrix {
    double b11, b12, b22, asymmetry, shift[2];
} kowalewski_matrix;

/* Returns the integration path from the real root with index i to the complex root in the upper
 * half plane. In the variable z = (w - real)/(w - complex), the path is a ray. The map to z takes
 * the upper half plane to the outside of a circle through 0. The ray points away from the centre of
 * this circle, so it makes an angle of at least pi/2 with the directions to all other branch
 * points. */
static kowalewski_path path_upwards(const kowalewski_curve *o, int i)
{
    const cx way = root_less_root(o, i, 1), from = cx_of(way.im, way.re);
    double least = INFINITY, most = 0.0;
    for (int r = 0; r < ROOTS; r++) {
        if (r == i || r == 1) continue;
        const double size = cx_square(root_less_root(o, r, i)) / cx_square(root_less_root(o, r, 1));
        least = fmin(least, size);
        most = fmax(most, size);
    }
    const double scale = sqrt(sqrt(least * most)) / cx_abs(way);
    return path_between(o, i, 1, cx_scale(-scale, from), cx_of(1.0, 0.0));
}
/* Returns the path from the i-th real root in ascending order, which is not the last one, to the
 * next lower real root. */
static kowalewski_path path_over_gap(const kowalewski_curve *o, int i)
{
    const int high = o->order[i], low = o->order[i - 1];
    double mu = 1.0;
    if (i >= 2)
        mu *= root_less_root(o, high, o->order[i - 2]).re /
              root_less_root(o, low, o->order[i - 2]).re;
    mu *= root_less_root(o, o->order[i + 1], high).re / root_less_root(o, o->order[i + 1], low).re;
    return path_between(o, high, low, cx_of(sqrt(mu), 0.0), cx_of(1.0, 0.0));
}
/* Computes B. Returns 0 if an integral does not converge or B is not positive definite. */
static int make_matrix(const kowalewski_curve *o, const kowalewski_arc arc[2],
                       const kowalewski_rates *rates, kowalewski_matrix *out)
{
    double row[2][2];
    for (int j = 0; j < 2; j++) {
        const int at = j == 0 ? o->real - 2 : o->pair ? 0 : 1, root = o->order[at];
        const kowalewski_path p = o->pair ? path_upwards(o, root) : path_over_gap(o, at);
        const based_periods m = periods_from(arc, rates, o->root[root]);
        cx r[2];
        if (!integrate_path(&p, INFINITY, r)) return 0;
        normalise(&m, r[0].im, r[1].im, row[j]);
        const double scale = row[j][j] < 0.0 ? -2.0 : 2.0;
        row[j][0] *= scale;
        row[j][1] *= scale;
    }
    out->b11 = row[0][0];
    out->b22 = row[1][1];
    out->b12 = 0.5 * (row[0][1] + row[1][0]);
    out->asymmetry = fabs(row[0][1] - row[1][0]) / sqrt(out->b11 * out->b22);
    return out->b11 * out->b22 > out->b12 * out->b12;
}
/* Adds `part` times the normalized integral along a path to the vector b (`shift`). The integral is
 * taken on the sheet of the Riemann surface on which F = i l at the pole. At the pole, tan^2(x/2) =
 * `most`. The path of integration leads from the branch point with index `from` to a pole. */
static int add_path(const kowalewski_curve *o, const kowalewski_arc arc[2],
                    const kowalewski_rates *rates, const kowalewski_path *p, int from, double most,
                    double part, kowalewski_matrix *out)
{
    const based_periods m = periods_from(arc, rates, o->root[from]);
    cx r[2], v[2];
    double shift[2];
    if (most == 0.0) return 1;
    if (!integrate_path(p, most, r)) return 0;
    /* The integrals over the path use w - root, but the periods use w minus the real part of the
     * root. */
    r[1] = cx_add(r[1], cx_mul(cx_of(0.0, imaginary_part(o, from)), r[0]));
    const double c = 1.0 / (1.0 + most), s = most < INFINITY ? most * c : 1.0;
    const cx D = path_at(p, s, c, v),
             F = cx_div(cx_scale(sqrt(s * c), p->across), cx_mul(v[0], cx_mul(D, D)));
    normalise(&m, r[0].im, r[1].im, shift);
    const double way = F.im * o->l.hi < 0.0 ? -part : part;
    for (int i = 0; i < 2; i++) out->shift[i] += way * shift[i];
    return 1;
}
/* Returns the straight integration path that starts at a branch point e and passes through the
 * point e + way. */
static kowalewski_path path_along_line(const kowalewski_curve *o, int from, cx way)
{
    kowalewski_path p = {
        .infinite = 1, .E = {1.0, 0.0}, .A = way, .across = way, .settled = o->settled};
    for (int r = 0; r < ROOTS; r++) {
        if (r == from) continue;
        p.a[p.count] = p.A;
        p.b[p.count++] = root_less_root(o, from, r);
    }
    finish_path(&p, 1.0);
    return p;
}
/* Adds to b half the integral from the end point of the arc that contains w1 to a real pole. The
 * integration path starts at the nearest real root that is larger than the pole. If the pole lies
 * to the left of a pair of complex roots, the path of integration starts at one of these roots
 * instead. The integral from the end of the arc to the starting point of the integration path is
 * zero or half a row of the matrix B. */
static int add_real_pole(const kowalewski_curve *o, const kowalewski_arc arc[2],
                         const kowalewski_rates *rates, dd pole, kowalewski_matrix *out)
{
    const int top = o->real - 2;
    const dd middle = dd_half(dd_add(real_root(o, top - 1), real_root(o, o->real == 5 ? 1 : 0)));
    const int past = o->pair && dd_less(pole, o->root[1]),
              gap = o->real == 5 && dd_less(pole, middle) ? 1 : top, high = o->order[gap],
              low = o->order[gap - 1];
    if (past || gap != top) {
        out->shift[0] += 0.25 * out->b11;
        out->shift[1] += 0.25 * out->b12;
    }
    if (past) {
        const cx way = cx_of(dd_sub(pole, o->root[1]).hi, -o->root[2].hi);
        const kowalewski_path p = path_along_line(o, 1, way);
        return add_path(o, arc, rates, &p, 1, 1.0, 0.5, out);
    }
    const kowalewski_path p = path_over_gap(o, gap);
    const double down = fmax(root_less_pole(o, high, pole).hi, 0.0),
                 up = fmax(-root_less_pole(o, low, pole).hi, 0.0);
    return add_path(o, arc, rates, &p, high, down / (p.C.re * up), 0.5, out);
}
/* Adds to the vector b the contributions of the complex pole i y and of its conjugate, which are
 * equal. The path is part of the circle through a complex root, the pole i y and the conjugate
 * root. If all roots are real, the path is the straight line that joins the root nearest to zero to
 * the pole. */
static int add_complex_pole(const kowalewski_curve *o, const kowalewski_arc arc[2],
                            const kowalewski_rates *rates, dd y, kowalewski_matrix *out)
{
    if (o->pair) {
        const cx z = cx_div(cx_of(-o->root[1].hi, dd_sub(y, o->root[2]).hi),
                            cx_of(-o->root[1].hi, y.hi + o->root[2].hi));
        const double size = cx_abs(z);
        const cx C = size > 0.0 ? cx_sqrt(cx_scale(-1.0 / size, z)) : cx_of(1.0, 0.0);
        kowalewski_path p = path_between(o, 1, 2, C, cx_conj(C));
        finish_path(&p, size / (1.0 + size)); /* the rest crosses the real axis */
        return add_path(o, arc, rates, &p, 1, size, 1.0, out);
    }
    int from = 0;
    for (int i = 1; i < ROOTS; i++)
        if (fabs(o->root[i].hi) < fabs(o->root[from].hi)) from = i;
    const kowalewski_path p = path_along_line(o, from, cx_of(-o->root[from].hi, y.hi));
    return add_path(o, arc, rates, &p, from, 1.0, 1.0, out);
}
/* Computes B and b. Returns 0 if an integral does not converge. */
static int make_periods(const kowalewski_curve *o, const kowalewski_arc arc[2],
                        const kowalewski_rates *rates, kowalewski_matrix *out)
{
    memset(out, 0, sizeof *out);
    if (!make_matrix(o, arc, rates, out)) return 0;
    if (o->c.hi > 0.0) return add_complex_pole(o, arc, rates, dd_sqrt(o->c), out);
    const dd pole = dd_sqrt(dd_neg(o->c));
    return add_real_pole(o, arc, rates, pole, out) &&
           add_real_pole(o, arc, rates, dd_neg(pole), out);
}
#endif
