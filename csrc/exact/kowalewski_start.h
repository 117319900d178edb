/* The torus angles of a Kowalewski top at the start, and the signs of the square roots in Koetter's
 * formulas (kowalewski_state.h), in double-double precision. Here the divided differences are sums
 * over the roots e of phi, with L = 1/((e - e')(e - e'')). The signs, one for each root of phi, one
 * for each arc and one for Z (kowalewski_state.h), are chosen such that the formulas reproduce a
 * state shortly after the initial time. They are constant during the motion.
 *
 * This header is compiled once for each instruction set. */
#ifndef KR_KOWALEWSKI_START_H
#define KR_KOWALEWSKI_START_H
#include "kowalewski_averages.h"

enum { ORDER = 12 };

typedef struct kowalewski_roots {
    cdd A[3], B[3], la[3], lb[3]; /* A, B, L A, L B */
    double sign[6];
} kowalewski_roots;

/* Quantities in the formulas for the state that depend only on the position on one of the arcs. */
typedef struct start_point {
    cdd g[3], own[3], rest[3]; /* g, g h, g' g'' d */
    dd N, D, d, minus, plus;   /* minus, plus: square roots for k - w and w + k */
    double theta[2];           /* contributions of this arc to theta1 - y1 and theta2 - y2 */
    double angle;              /* y */
} start_point;

/* Returns the branch point with the index i. */
static cdd root_dd(const kowalewski_curve *o, int i)
{
    if (!o->pair || i == 0 || i >= ROOT_K) return cdd_real(o->root[i]);
    return cdd_of(o->root[1], i == 1 ? o->root[2] : dd_neg(o->root[2]));
}
static void make_roots(const kowalewski_curve *o, kowalewski_roots *out)
{
    for (int i = 0; i < 3; i++) {
        const cdd e = root_dd(o, i), one = cdd_real(dd_of(1.0));
        const cdd apart = cdd_mul(cdd_sub(e, root_dd(o, (i + 1) % 3)),
                                  cdd_sub(e, root_dd(o, (i + 2) % 3))),
                  L = cdd_div(one, apart), l = cdd_real(o->l);
        cdd A = cdd_sqrt(cdd_scale(dd_of(2.0), cdd_add(e, cdd_real(o->h)))),
            B = cdd_sqrt(cdd_add(cdd_mul(e, e), cdd_real(o->c)));
        if (cdd_square(A).hi > cdd_square(B).hi)
            B = cdd_div(l, A);
        else if (cdd_square(B).hi > 0.0)
            A = cdd_div(l, B);
        out->A[i] = A;
        out->B[i] = B;
        out->la[i] = cdd_mul(L, A);
        out->lb[i] = cdd_mul(L, B);
    }
}
/* Returns a square root of way * (w - e_i) D, given the sine and cosine of x/2. */
static cdd half_angle_root(const kowalewski_curve *o, const kowalewski_arc *arc, int i, double way,
                           dd s, dd c)
{
    const int first = o->pair && i == 2 ? 1 : i;
    const dd im = !o->pair || i == 0 || i >= ROOT_K ? dd_of(0.0)
                  : i == 1                          ? dd_neg(o->root[2])
                                                    : o->root[2];
    const cdd a = cdd_of(dd_scale(way, arc->a[first]), dd_scale(way, dd_mul(im, arc->C))),
              b = cdd_of(dd_scale(way, arc->b[first]), dd_scale(way, dd_mul(im, arc->E)));
    if (i == arc->low) return cdd_scale(c, cdd_sqrt(b));
    if (i == arc->high) return cdd_scale(s, cdd_sqrt(a));
    return cdd_sqrt(cdd_add(cdd_scale(dd_square(s), a), cdd_scale(dd_square(c), b)));
}
/* Computes all members of a start_point except `theta` and `angle`, given the sine and cosine of
 * x/2. */
static void make_point(const kowalewski_curve *o, const kowalewski_arc *arc, dd s, dd c,
                       start_point *out)
{
    const double way = arc->low == AT_INFINITY ? -1.0 : 1.0;
    const dd ss = dd_square(s), cc = dd_square(c);
    out->minus = half_angle_root(o, arc, ROOT_K, -1.0, s, c).re;
    out->plus = half_angle_root(o, arc, ROOT_MINUS_K, way, s, c).re;
    const dd h = dd_mul(out->minus, out->plus);
    out->N = mix(arc->A, ss, arc->B, cc);
    out->D = mix(arc->C, ss, arc->E, cc);
    out->d = arc->low == AT_INFINITY ? c : dd_sqrt(out->D);
    for (int i = 0; i < 3; i++) out->g[i] = half_angle_root(o, arc, i, way, s, c);
    for (int i = 0; i < 3; i++) {
        out->own[i] = cdd_scale(h, out->g[i]);
        out->rest[i] = cdd_scale(out->d, cdd_mul(out->g[(i + 1) % 3], out->g[(i + 2) % 3]));
    }
}
static cdd with_sign(double sign, cdd a) { return sign < 0.0 ? cdd_neg(a) : a; }

/* Computes the common denominator a of the components of the state, and the products a p and a
 * q. */
static void make_pq(const kowalewski_roots *k, const start_point *one, const start_point *two,
                    dd *a, dd *p, dd *q)
{
    cdd sum_a = cdd_real(dd_of(0.0)), sum_b = sum_a;
    for (int i = 0; i < 3; i++) {
        const cdd G = with_sign(k->sign[i], cdd_mul(one->g[i], two->g[i]));
        sum_a = cdd_add(sum_a, cdd_mul(k->la[i], G));
        sum_b = cdd_add(sum_b, cdd_mul(k->lb[i], G));
    }
    *a = sum_a.re;
    *p = dd_neg(sum_b.re);
    *q = dd_neg(dd_mul(one->d, two->d));
}
/* Computes the state p, q, r, g1, g2, g3 from one point on each arc. */
static void make_state(const kowalewski_curve *o, const kowalewski_roots *k, const start_point *one,
                       const start_point *two, dd out[6])
{
    const dd two_root = dd_sqrt(dd_of(2.0));
    cdd r = cdd_real(dd_of(0.0)), g = r;
    dd a, p, q;
    make_pq(k, one, two, &a, &p, &q);
    for (int i = 0; i < 3; i++) {
        const double sign = k->sign[(i + 1) % 3] * k->sign[(i + 2) % 3];
        const cdd V = cdd_sub(with_sign(sign * k->sign[3], cdd_mul(two->rest[i], one->own[i])),
                              with_sign(sign * k->sign[4], cdd_mul(one->rest[i], two->own[i])));
        r = cdd_add(r, cdd_mul(k->la[i], V));
        g = cdd_add(g, cdd_mul(k->lb[i], V));
    }
    const dd Dl = dd_sub(dd_mul(one->N, two->D), dd_mul(two->N, one->D)),
             under = dd_div(two_root, dd_mul(a, Dl));
    out[0] = p = dd_div(p, a);
    out[1] = q = dd_div(q, a);
    out[2] = dd_mul(under, r.re);
    out[5] = dd_mul(under, g.re);
    out[3] = dd_sub(dd_add(dd_add(dd_square(p), dd_square(q)), dd_half(dd_square(out[2]))), o->h);
    const dd rest = dd_sub(dd_sub(o->l, dd_mul(out[2], out[5])), dd_twice(dd_mul(p, out[3])));
    out[4] = dd_div(rest, dd_twice(q));
}
/* Computes the Taylor coefficients of the state p, q, r, g1, g2, g3. */
static void expand(const dd y[6], dd c[6][ORDER + 1])
{
    for (int i = 0; i < 6; i++) c[i][0] = y[i];
    for (int n = 0; n < ORDER; n++) {
        dd d[6] = {{0.0, 0.0}};
        for (int i = 0; i <= n; i++) {
            const int j = n - i;
            d[0] = dd_add(d[0], dd_half(dd_mul(c[1][i], c[2][j])));
            d[1] = dd_sub(d[1], dd_half(dd_mul(c[0][i], c[2][j])));
            d[3] = dd_add(d[3], dd_sub(dd_mul(c[4][i], c[2][j]), dd_mul(c[5][i], c[1][j])));
            d[4] = dd_add(d[4], dd_sub(dd_mul(c[5][i], c[0][j]), dd_mul(c[3][i], c[2][j])));
            d[5] = dd_add(d[5], dd_sub(dd_mul(c[3][i], c[1][j]), dd_mul(c[4][i], c[0][j])));
        }
        d[1] = dd_sub(d[1], dd_half(c[5][n]));
        d[2] = c[4][n];
        for (int i = 0; i < 6; i++) c[i][n + 1] = dd_div(d[i], dd_of(n + 1.0));
    }
}
static void sum_series(dd c[6][ORDER + 1], double span, dd out[6])
{
    for (int i = 0; i < 6; i++) {
        out[i] = c[i][ORDER];
        for (int n = ORDER - 1; n >= 0; n--) out[i] = dd_add(dd_times(span, out[i]), c[i][n]);
    }
}
/* Computes the point on an arc where Kowalewski's variable has the distance `gap` from the upper
 * end. If the lower end of the arc is finite, `rest` is the distance of Kowalewski's variable from
 * this end. The argument `next` is the value of `gap` at a later time, and determines in which
 * direction the variable moves along the arc.
 * Returns 0 if the point is so close to an end of the arc that sin(x/2) or cos(x/2) is at most
 * `least`. */
static int make_point_at(const kowalewski_curve *o, const kowalewski_arc *arc, dd gap, dd rest,
                         dd next, double least, start_point *out)
{
    const dd none = dd_of(0.0), up = dd_max(gap, none),
             down = arc->low == AT_INFINITY ? dd_neg(arc->A) : dd_mul(arc->C, dd_max(rest, none)),
             both = dd_add(up, down);
    dd s = dd_sqrt(dd_div(up, both)), c = dd_sqrt(dd_div(down, both));
    if (!(s.hi > least && c.hi > least)) return 0;
    dd sine = dd_twice(dd_mul(s, c)), cosine = dd_sub(dd_square(c), dd_square(s));
    if (dd_less(next, gap)) {
        s = dd_neg(s);
        sine = dd_neg(sine);
    }
    make_point(o, arc, s, c, out);
    fold(arc, &sine, &cosine);
    /* The signs chosen for the square roots are correct for angles between -pi and pi. */
    const double turns = turns_of(sine.hi, cosine.hi).hi;
    out->angle = two_pi * (sine.hi < 0.0 && turns > 0.0 ? turns - 1.0 : turns);
    out->theta[0] = out->theta[1] = 0.0;
    add_sines(arc, sine.hi, cosine.hi, out->theta);
    return 1;
}
static double miss_of(const dd got[6], const dd want[6])
{
    static const int all[4] = {0, 1, 2, 5};
    double most = 0.0, size = 1.0;
    for (int i = 0; i < 3; i++) size = fmax(size, fabs(want[i].hi));
    for (int i = 0; i < 4; i++) {
        const double miss = fabs(dd_sub(got[all[i]], want[all[i]]).hi);
        most = fmax(most, all[i] == 5 ? miss : miss / size);
        if (!(miss < INFINITY)) return INFINITY;
    }
    return most;
}
/* Returns the sign of the imaginary part of Z for which xi = x^2 + g1 + i g2 has the argument of
 * z^2 conj(Z^2) (see frame_at). */
static double sign_of_Z(const start_point point[2], const dd y[6])
{
    const cdd x = cdd_of(y[0], y[1]), xi = cdd_add(cdd_mul(x, x), cdd_of(y[3], y[4])),
              z = cdd_add(cdd_scale(y[2], x), cdd_real(y[5])),
              Z = cdd_of(dd_mul(point[0].plus, point[1].plus),
                         dd_mul(point[0].minus, point[1].minus));
    /* For the right sign, this product is positive. */
    const cdd rest = cdd_mul(cdd_mul(z, z), cdd_of(xi.re, dd_neg(xi.im))),
              one = cdd_mul(rest, cdd_mul(cdd_of(Z.re, dd_neg(Z.im)), cdd_of(Z.re, dd_neg(Z.im)))),
              other = cdd_mul(rest, cdd_mul(Z, Z));
    return one.re.hi - fabs(one.im.hi) >= other.re.hi - fabs(other.im.hi) ? 1.0 : -1.0;
}
/* Determines the signs of the square roots by comparison with a single state of the top. Only
 * one combination should reproduce p, q, r and g3 of this state.
 * Returns the error of the reconstructed state for the combination of signs that fits best. */
static double find_signs(const kowalewski_curve *o, kowalewski_roots *k, const start_point point[2],
                         const dd state[6])
{
    double best = INFINITY, sign[6] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    for (int all = 0; all < 32; all++) {
        dd got[6];
        for (int i = 0; i < 5; i++) k->sign[i] = all >> i & 1 ? -1.0 : 1.0;
        if (o->pair && k->sign[1] != k->sign[2]) continue;
        make_pq(k, &point[0], &point[1], &got[0], &got[1], &got[2]);
        const double rest = fabs(dd_sub(dd_mul(got[0], state[1]), got[2]).hi);
        if (rest > 1e-8 * (fabs(got[2].hi) + fabs(got[0].hi))) continue;
        make_state(o, k, &point[0], &point[1], got);
        const double miss = miss_of(got, state);
        if (miss < best) {
            best = miss;
            memcpy(sign, k->sign, sizeof sign);
        }
    }
    memcpy(k->sign, sign, sizeof sign);
    k->sign[5] = sign_of_Z(point, state);
    return best;
}
/* Computes the points on the two arcs of the Kowalewski curve that correspond to a given state of
 * the top. The directions of motion of w1 and w2 are inferred from a later state. Returns 0 if w1
 * or w2 is too close to an end of its arc for an accurate result. */
static int make_points_at(const kowalewski_curve *o, const kowalewski_arc arc[2], const dd at[6],
                          const dd later[6], double least, start_point point[2])
{
    const arc_gaps gap = separate(o, at), next = separate(o, later);
    return make_point_at(o, &arc[0], gap.up, gap.down, next.up, least, &point[0]) &&
           make_point_at(o, &arc[1], gap.below, gap.below, next.below, least, &point[1]);
}
/* Determines the signs of the square roots and the initial angles on the torus. These signs are
 * determined at the first state at which w1 and w2 are not close to the ends of their arcs. If w1
 * or w2 moves very slowly, no such state may be found; points closer to the ends of the arcs are
 * then accepted. The returned error is divided by the state's rate of change if this rate is below
 * 1, because errors in the angles of a slow motion change the state only slightly. */
static double find_start(const kowalewski_curve *o, const kowalewski_arc arc[2],
                         const kowalewski_rates *rates, const dd start[6], kowalewski_roots *k,
                         double theta[2])
{
    const double moment = 0.00390625 / (1.0 + sqrt(fabs(o->h.hi)));
    dd series[6][ORDER + 1], at[6], later[6];
    make_roots(o, k);
    memcpy(at, start, sizeof at);
    for (int step = 0; step < 160; step++) {
        const int i = step % 8;
        const double least = step < 8 ? 0.02 : step < 32 ? 0.002 : step < 96 ? 1e-5 : 1e-9;
        start_point point[2];
        if (i == 0) expand(at, series);
        sum_series(series, (i + 1) * moment, at);
        sum_series(series, (i + 1 + 0x1p-20) * moment, later);
        if (!make_points_at(o, arc, at, later, least, point)) continue;
        for (int j = 0; j < 2; j++)
            theta[j] = point[j].angle + (point[0].theta[j] + point[1].theta[j]) -
                       (step + 1) * moment * rates->rate[j].hi;
        double velocity = 0.0;
        for (int j = 0; j < 6; j++) velocity = fmax(velocity, fabs(series[j][1].hi));
        return find_signs(o, k, point, at) / fmin(velocity, 1.0);
    }
    return INFINITY;
}
#endif
