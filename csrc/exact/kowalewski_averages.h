/* The averages of a Kowalewski top over its two arcs, and with them its frequencies. The heading's
 * frequency is half the periods of l w dw/((w^2 + c) F). Its poles, w^2 = k^2 - 1, come near the
 * arcs where l is small; where they are real, each is split off:
 *     average of (|l|/2) D^2 R/(N - w D)  =  average of ((|l|/2) D^2 R - g)/(N - w D) + 1/2,
 * with g = sqrt(a b)/2, the numerator's value at the pole, and N - w D = a sin^2 + b cos^2.
 *
 * This header is source that is compiled once per instruction set. */
#ifndef KR_KOWALEWSKI_AVERAGES_H
#define KR_KOWALEWSKI_AVERAGES_H
#include "kowalewski_curve.h"

/* A pole of the heading's integrand: N - w D = a sin^2 + b cos^2. */
typedef struct heading_pole {
    dd a, b, value; /* g, or 0 where it is not split off */
    double whole;   /* what was split off: 1/2 with a sign */
    int close;      /* the arc's end is so near that a quotient there has no digits */
} heading_pole;

/* Returns a root less the pole w, with all digits of a small difference. */
static dd root_less_pole(const kowalewski_curve *o, int i, dd w)
{
    const dd difference = dd_sub(o->root[i], w), sum = dd_add(o->root[i], w),
             other = dd_add(o->root[i], o->h);
    if (i >= ROOT_K || !(fabs(difference.hi) < 0.1 * fabs(sum.hi)) ||
        !(fabs(other.hi) > 1e-3 * fabs(difference.hi)))
        return difference;
    return dd_div(dd_half(dd_square(o->l)), dd_mul(other, sum));
}
/* Makes the poles beside an arc, and returns their number. */
static int make_poles(const kowalewski_curve *o, const kowalewski_arc *arc, heading_pole pole[2])
{
    const int infinite = arc->low == NO_ROOT, end = infinite ? arc->high : arc->low;
    const dd next = real_root(o, infinite ? 1 : o->real - 3), w0 = dd_sqrt(dd_neg(o->c));
    int count = 0;
    for (int i = 0; i < 2; i++) {
        const dd w = i ? dd_neg(w0) : w0, rest = root_less_pole(o, end, w);
        heading_pole *p = &pole[count];
        p->a = infinite ? arc->A : dd_mul(arc->C, rest);
        p->b = infinite ? rest : dd_sub(arc->B, w);
        const double side =
            infinite ? -1.0 : 1.0; /* of the arc, seen from a pole in the next gap */
        const int adjacent = side * rest.hi >= 0.0 && side * dd_sub(w, next).hi >= 0.0;
        if (o->l.hi == 0.0 && !(adjacent && rest.hi == 0.0)) continue;
        p->value = adjacent ? dd_half(dd_sqrt(dd_mul(p->a, p->b))) : dd_of(0.0);
        p->whole = !adjacent ? 0.0 : 0.5 * side;
        p->close = fabs(rest.hi) < 1e-18;
        count++;
    }
    return count;
}
/* The samples of one arc, and where its sums stand. */
typedef struct samples {
    dd v[3][GRID + 1]; /* dt/dx, w dt/dx, and the heading's integrand */
    dd sum[3];
    double size[3];
} samples;

/* Returns the heading's integrand without the sign of l, less what is split off. */
static dd heading_rate(const kowalewski_curve *o, int poles, const heading_pole pole[2], dd s, dd c,
                       dd N, dd D, dd R, dd slope)
{
    const dd g = dd_mul(dd_abs(o->l), dd_mul(dd_square(D), R));
    dd sum = dd_of(0.0);
    if (o->c.hi > 0.0)
        return dd_div(dd_mul(g, N), dd_add(dd_square(N), dd_mul(o->c, dd_square(D))));
    for (int i = 0; i < poles; i++) {
        const dd under = mix(pole[i].a, s, pole[i].b, c);
        if (under.hi != 0.0)
            sum = dd_add(sum, dd_div(dd_sub(dd_half(g), dd_mul(slope, pole[i].value)), under));
    }
    return sum;
}
static void sample_at(const kowalewski_curve *o, const kowalewski_arc *arc, int poles,
                      const heading_pole pole[2], const cosine_table *t, int i, samples *out)
{
    dd N, D, sine = t->c[i < GRID / 2 ? GRID / 2 - i : i - GRID / 2], cosine = t->c[i];
    const dd slope = unfold(arc, &sine, &cosine), c = dd_half(dd_plus(cosine, 1.0)),
             s = dd_half(dd_sub(dd_of(1.0), cosine));
    const dd R = dd_mul(slope, arc_at(o, arc, s, c, &N, &D));
    const double weight = i == 0 || i == GRID ? 0.5 : 1.0;
    out->v[0][i] = dd_mul(D, R);
    out->v[1][i] = dd_mul(N, R);
    out->v[2][i] = poles ? heading_rate(o, poles, pole, s, c, N, D, R, slope) : dd_of(0.0);
    for (int k = 0; k < 3; k++) {
        out->sum[k] = dd_add(out->sum[k], dd_scale(weight, out->v[k][i]));
        out->size[k] += weight * fabs(out->v[k][i].hi);
    }
}
/* Replaces the heading's sample at an end that a pole comes so near that its quotient has lost its
 * digits, by the value of an even polynomial through its neighbours. */
static void mend_end(samples *v, int end, int stride)
{
    const int way = end ? -stride : stride;
    const dd *f = &v->v[2][end];
    const dd near = dd_add(dd_scale(4.0, dd_times(0.4, f[way])), dd_times(-0.8, f[2 * way])),
             far = dd_div(dd_sub(dd_scale(8.0, f[3 * way]), f[4 * way]), dd_of(35.0));
    const dd value = dd_add(near, far), change = dd_sub(value, f[0]);
    v->v[2][end] = value;
    v->sum[2] = dd_add(v->sum[2], dd_half(change));
}
/* Halves the intervals until doubling their number changes no average by more than rounding of a
 * double: the error is the square of that. Returns 0 if GRID intervals do not suffice. */
static int fill_samples(const kowalewski_curve *o, kowalewski_arc *arc, cosine_table *table,
                        samples *v)
{
    heading_pole pole[2];
    const int real = o->c.hi <= 0.0, poles = real ? make_poles(o, arc, pole) : o->l.hi != 0.0;
    double split = 0.0;
    int mends = 0;
    for (int i = 0; real && i < poles; i++) {
        split += pole[i].whole;
        mends |= pole[i].close;
    }
    dd mean[3] = {{0.0, 0.0}}, *const average[3] = {&arc->p, &arc->q, &arc->pole};
    memset(v, 0, sizeof *v);
    sample_at(o, arc, poles, pole, table, 0, v);
    sample_at(o, arc, poles, pole, table, GRID, v);
    for (int n = 1; n <= GRID; n *= 2) {
        const int stride = GRID / n;
        int settled = n >= (mends ? 64 : 16);
        refine_cosines(table, stride);
        for (int i = stride; i < GRID; i += 2 * stride) sample_at(o, arc, poles, pole, table, i, v);
        if (mends && n >= 8) mend_end(v, arc->low == NO_ROOT ? 0 : GRID, stride);
        for (int k = 0; k < 3; k++) {
            const dd now = dd_div(v->sum[k], dd_of(n));
            settled &= fabs(dd_sub(now, mean[k]).hi) <=
                       1e-16 * (v->size[k] / n + (k == 2 ? fabs(split) : 0.0));
            mean[k] = now;
        }
        if (!settled) continue;
        mean[2] = dd_plus(mean[2], split);
        for (int k = 0; k < 3; k++) *average[k] = mean[k];
        if (o->l.hi < 0.0) arc->pole = dd_neg(arc->pole);
        arc->points = n;
        return 1;
    }
    return 0;
}
/* Turns the series of the two integrals into those of theta1 - x and theta2 - x. */
static void set_sines(kowalewski_arc *arc, double way, double p1, double q1, double p2, double q2,
                      double det)
{
    for (int k = 1; k < arc->points; k++) {
        const double u = way * arc->sine[0][k], v = way * arc->sine[1][k];
        arc->sine[0][k] = (p2 * v - q2 * u) / det;
        arc->sine[1][k] = (p1 * v - q1 * u) / det;
    }
}
/* The sums over both arcs. The angles of the torus grow by `rate`, the heading by `heading`, in a
 * unit of time. */
typedef struct kowalewski_rates {
    dd det, rate[2], heading;
} kowalewski_rates;

/* Averages over both arcs. Returns 0 if they cannot be had to all digits. */
static int average_arcs(const kowalewski_curve *o, kowalewski_arc arc[2], cosine_table *table,
                        samples *v, kowalewski_rates *out)
{
    begin_cosines(table);
    for (int j = 0; j < 2; j++) {
        if (!fill_samples(o, &arc[j], table, v)) return 0;
        for (int i = 0; i < 2; i++)
            integrate_samples(v->v[i], table, arc[j].points, arc[j].sine[i]);
    }
    out->det = dd_sub(dd_mul(arc[1].p, arc[0].q), dd_mul(arc[0].p, arc[1].q));
    for (int j = 0; j < 2; j++) {
        out->rate[j] = dd_div(arc[1 - j].p, out->det);
        set_sines(&arc[j], j ? -1.0 : 1.0, arc[0].p.hi, arc[0].q.hi, arc[1].p.hi, arc[1].q.hi,
                  out->det.hi);
    }
    out->heading =
        dd_half(dd_sub(dd_mul(arc[0].pole, out->rate[0]), dd_mul(arc[1].pole, out->rate[1])));
    return out->det.hi > 0.0;
}
/* Gives both angles of the torus where x has this sine and cosine, less x1 and x2. */
static void add_sines(const kowalewski_arc *arc, double s, double c, double theta[2])
{
    for (int i = 0; i < 2; i++) {
        double b1 = 0.0, b2 = 0.0;
        for (int k = arc->points - 1; k > 0; k--) {
            const double b = arc->sine[i][k] + 2.0 * c * b1 - b2;
            b2 = b1;
            b1 = b;
        }
        theta[i] += b1 * s;
    }
}
#endif
