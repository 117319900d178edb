/* Frequencies of a Kowalewski top, computed from averages over the two arcs on which Kowalewski's
 * variables move. The frequency of the heading follows from the periods of l w dw/(2 (w^2 + c) F).
 * The poles of this integrand, at w^2 = k^2 - 1, are close to the arcs if l is small. If the poles
 * are real, the contribution of each pole is therefore integrated in closed form:
 *     average of (|l|/2) D^2 R/(N - w D)  =  average of ((|l|/2) D^2 R - g)/(N - w D) + 1/2.
 * Here w is the pole, N - w D = a sin^2 + b cos^2, and g = sqrt(a b)/2 is the value of the
 * numerator at the pole. The last term is -1/2 if N - w D is negative.
 *
 * This header is compiled once for each instruction set. */
#ifndef KR_KOWALEWSKI_AVERAGES_H
#define KR_KOWALEWSKI_AVERAGES_H
#include "kowalewski_curve.h"

/* A pole w of the integrand of the heading, with N - w D = a sin^2 + b cos^2. */
typedef struct heading_pole {
    dd a, b, value; /* g, or 0 if the pole is not treated separately */
    double whole;   /* the average in closed form: 1/2 or -1/2, or 0 */
    int close;      /* 1 if the quotient at the arc's end is inaccurate, because the pole is near */
} heading_pole;

/* Returns root i minus the pole w, computed without cancellation. */
static dd root_less_pole(const kowalewski_curve *o, int i, dd w)
{
    const dd difference = dd_sub(o->root[i], w), sum = dd_add(o->root[i], w),
             other = dd_add(o->root[i], o->h);
    if (!(fabs(difference.hi) < 0.1 * fabs(sum.hi))) return difference;
    if (i >= ROOT_K) return dd_div(dd_of(1.0), sum);
    if (!(fabs(other.hi) > 1e-3 * fabs(difference.hi))) return difference;
    return dd_div(dd_half(dd_square(o->l)), dd_mul(other, sum));
}
/* Finds the poles that contribute to the integrand of the heading on an arc. Returns the
 * number of poles. */
static int make_poles(const kowalewski_curve *o, const kowalewski_arc *arc, heading_pole pole[2])
{
    const int infinite = arc->low == NO_ROOT, end = infinite ? arc->high : arc->low;
    const dd next = real_root(o, infinite ? 1 : o->real - 3), w0 = dd_sqrt(dd_neg(o->c));
    int count = 0;
    for (int i = 0; i < 2; i++) {
        const dd w = i ? dd_neg(w0) : w0, rest = root_less_pole(o, end, w);
        heading_pole *p = &pole[count];
        p->a = infinite ? arc->A : dd_mul(arc->C, rest);
        p->b = infinite ? rest : root_less_pole(o, arc->high, w);
        const double side = infinite ? -1.0 : 1.0; /* sign of arc - pole: poles lie in gaps */
        const int adjacent = side * dd_sub(w, next).hi >= 0.0; /* is it in the next gap? */
        if (o->l.hi == 0.0 && !(adjacent && rest.hi == 0.0)) continue;
        p->value = adjacent ? dd_half(dd_sqrt(dd_mul(p->a, p->b))) : dd_of(0.0);
        p->whole = !adjacent ? 0.0 : 0.5 * side;
        p->close = fabs(rest.hi) < 1e-18;
        count++;
    }
    return count;
}
/* Samples and weighted sums of the integrands on one arc. */
typedef struct samples {
    dd v[3][GRID + 1]; /* dt/dx, w dt/dx, and the heading's integrand */
    dd sum[3];
    double size[3];
} samples;

/* Returns the integrand of the heading for l > 0, after subtraction of the contributions of its
 * poles. */
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
/* Corrects the integrand for the heading angle at the lower end of the arc of w1, where a nearby
 * pole makes it inaccurate. No pole is near the arc of w2, which ends at or below -k.
 * The new value is interpolated by an even polynomial through the neighbouring samples. */
static void mend_end(samples *v, int stride)
{
    const dd *f = &v->v[2][GRID];
    const dd near =
                 dd_add(dd_scale(4.0, dd_times(0.4, f[-stride])), dd_times(-0.8, f[-2 * stride])),
             far = dd_div(dd_sub(dd_scale(8.0, f[-3 * stride]), f[-4 * stride]), dd_of(35.0));
    const dd value = dd_add(near, far), change = dd_sub(value, f[0]);
    v->v[2][GRID] = value;
    v->sum[2] = dd_add(v->sum[2], dd_half(change));
}
/* Computes the averages of three integrands over an arc: dt/dx, w dt/dx, and the integrand of the
 * heading. The number of intervals is doubled until each average changes by at most the rounding
 * error of a double. Convergence is exponential, so the relative error of an average is about the
 * square of its relative change in the last doubling. Returns 0 if the averages have not converged
 * when GRID intervals are used.
 * */
static int fill_samples(const kowalewski_curve *o, kowalewski_arc *arc, cosine_table *table,
                        samples *v)
{
    heading_pole pole[2] = {{{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}, 0.0, 0}};
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
        if (mends && n >= 8) mend_end(v, stride);
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
/* The determinant of the matrix of averages, and the rates of the two torus angles and of the
 * heading. */
typedef struct kowalewski_rates {
    dd det, rate[2], heading;
} kowalewski_rates;

/* Computes the sine series of the integrals of dt/dx and (w - base) dt/dx over an arc. Here base is
 * the value of w at the upper end of the arc. The samples of w dt/dx are overwritten. */
static void integrate_arc(const kowalewski_curve *o, kowalewski_arc *arc, const cosine_table *table,
                          samples *v)
{
    for (int i = 0; i <= GRID; i += GRID / arc->points)
        v->v[1][i] = dd_sub(v->v[1][i], dd_mul(o->root[arc->high], v->v[0][i]));
    for (int i = 0; i < 2; i++) integrate_samples(v->v[i], table, arc->points, arc->sine[i]);
}
/* Computes the Fourier coefficients that arc j contributes to the periodic functions theta1 - x1
 * and theta2 - x2.
 * Subtracting the value of w at the upper end of the arc avoids cancellation if w varies little
 * along the arc. */
static void set_sines(const kowalewski_curve *o, kowalewski_arc arc[2], int j, double det)
{
    const dd base = o->root[arc[j].high];
    const double p1 = arc[0].p.hi, q1 = dd_sub(arc[0].q, dd_mul(base, arc[0].p)).hi,
                 p2 = arc[1].p.hi, q2 = dd_sub(arc[1].q, dd_mul(base, arc[1].p)).hi;
    for (int k = 1; k < arc[j].points; k++) {
        const double u = j ? -arc[j].sine[0][k] : arc[j].sine[0][k],
                     v = j ? -arc[j].sine[1][k] : arc[j].sine[1][k];
        arc[j].sine[0][k] = (p2 * v - q2 * u) / det;
        arc[j].sine[1][k] = (p1 * v - q1 * u) / det;
    }
}
/* Computes the averages of dt/dx and two related integrands over both arcs, and from these averages
 * the frequencies of the motion. Returns 0 if the average of an integrand is not accurate
 * enough. */
static int average_arcs(const kowalewski_curve *o, kowalewski_arc arc[2], cosine_table *table,
                        samples *v, kowalewski_rates *out)
{
    begin_cosines(table);
    for (int j = 0; j < 2; j++) {
        if (!fill_samples(o, &arc[j], table, v)) return 0;
        integrate_arc(o, &arc[j], table, v);
    }
    out->det = dd_sub(dd_mul(arc[1].p, arc[0].q), dd_mul(arc[0].p, arc[1].q));
    for (int j = 0; j < 2; j++) {
        out->rate[j] = dd_div(arc[1 - j].p, out->det);
        set_sines(o, arc, j, out->det.hi);
    }
    out->heading =
        dd_half(dd_sub(dd_mul(arc[0].pole, out->rate[0]), dd_mul(arc[1].pole, out->rate[1])));
    return out->det.hi > 0.0;
}
/* Adds the values of the two sine series of an arc to the torus angles `theta`. `s` and `c` are the
 * sine and cosine of the variable of the series. */
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
