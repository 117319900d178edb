/* Frequencies and sine series of a Kowalewski top, computed from averages over the two arcs on which
 * Kowalewski's variables move. The heading of the vector C (kowalewski.h) is the integral of
 * l w dw/((w^2 + c) F). The poles of this integrand, at w^2 = k^2 - 1, are close to the arcs if l is
 * small. A real pole w in the gap beside an arc contributes |l| D^2 R/2(N - w D), with N - w D =
 * a sin^2 + b cos^2 of x/2. The multiple of 1/(N - w D) that has the same residue is subtracted. Its
 * integral is the argument of sqrt(b) cos x/2 + i sqrt(a) sin x/2, which kowalewski_state.h adds to
 * the heading.
 *
 * This header is compiled once for each instruction set. */
#ifndef KR_KOWALEWSKI_AVERAGES_H
#define KR_KOWALEWSKI_AVERAGES_H
#include "kowalewski_curve.h"

/* A pole w of the integrand of the heading, with N - w D = a sin^2 + b cos^2. */
typedef struct heading_pole {
    dd a, b, value; /* sqrt(a b)/2, or 0 if the pole is not treated separately */
    int adjacent;   /* 1 if the pole is in the gap beside the arc's end */
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
    const int infinite = arc->low == AT_INFINITY, end = infinite ? arc->high : arc->low;
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
        p->adjacent = adjacent;
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
/* Computes the averages of three integrands over an arc: dt/dx, w dt/dx, and the integrand of the
 * heading. The number of intervals is doubled until each average changes by at most the rounding
 * error of a double. Convergence is exponential, so the relative error of an average is about the
 * square of its relative change in the last doubling. Returns 0 if the averages have not converged
 * when GRID intervals are used. */
static int fill_samples(const kowalewski_curve *o, kowalewski_arc *arc, cosine_table *table,
                        samples *v)
{
    heading_pole pole[2] = {{{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}, 0}};
    const int real = o->c.hi <= 0.0, poles = real ? make_poles(o, arc, pole) : o->l.hi != 0.0;
    double split = 0.0;
    for (int i = 0; real && i < poles; i++) split += pole[i].adjacent ? 0.5 : 0.0;
    dd mean[3] = {{0.0, 0.0}}, *const average[3] = {&arc->p, &arc->q, &arc->turn};
    memset(v, 0, sizeof *v);
    sample_at(o, arc, poles, pole, table, 0, v);
    sample_at(o, arc, poles, pole, table, GRID, v);
    for (int n = 1; n <= GRID; n *= 2) {
        const int stride = GRID / n;
        int settled = n >= 16;
        refine_cosines(table, stride);
        for (int i = stride; i < GRID; i += 2 * stride) sample_at(o, arc, poles, pole, table, i, v);
        for (int k = 0; k < 3; k++) {
            const dd now = dd_div(v->sum[k], dd_of(n));
            settled &=
                fabs(dd_sub(now, mean[k]).hi) <= 1e-16 * (v->size[k] / n + (k == 2 ? split : 0.0));
            mean[k] = now;
        }
        if (!settled) continue;
        for (int k = 0; k < 3; k++) *average[k] = mean[k];
        arc->points = n;
        return 1;
    }
    return 0;
}
/* The rates of the two torus angles and of the heading, without the factors of its poles. */
typedef struct kowalewski_rates {
    dd rate[2], heading;
} kowalewski_rates;

/* Computes the sine series of an arc from its samples. With F > 0 at the start of the first arc and
 * F < 0 at that of the second, the contributions of both arcs to
 *     p2 (w dt) - q2 dt,  p1 (w dt) - q1 dt  over the determinant
 * are the differentials of theta1 and theta2. The multiples of theta1 and theta2 that are contained
 * in the heading are subtracted before the integration, because they can be large. */
static void integrate_arc(const kowalewski_curve *o, kowalewski_arc arc[2], int j, dd det,
                          const cosine_table *table, samples *v)
{
    const double side = j ? -1.0 : 1.0, turn = o->l.hi < 0.0 ? -side : side;
    const dd scale = dd_div(dd_of(side), det);
    dd factor[2][2]; /* of w dt and dt in each angle */
    for (int i = 0; i < 2; i++) {
        factor[i][0] = dd_mul(scale, arc[1 - i].p);
        factor[i][1] = dd_neg(dd_mul(scale, arc[1 - i].q));
    }
    for (int i = 0; i <= GRID; i += GRID / arc[j].points) {
        const dd t = dd_sub(v->v[0][i], arc[j].p), wt = dd_sub(v->v[1][i], arc[j].q);
        const dd one = mix(wt, factor[0][0], t, factor[0][1]),
                 two = mix(wt, factor[1][0], t, factor[1][1]);
        const dd heading = dd_scale(turn, dd_sub(v->v[2][i], arc[j].turn)),
                 known = dd_sub(dd_mul(arc[0].turn, one), dd_mul(arc[1].turn, two));
        v->v[0][i] = one;
        v->v[1][i] = two;
        v->v[2][i] = dd_sub(heading, o->l.hi < 0.0 ? dd_neg(known) : known);
    }
    for (int i = 0; i < 3; i++) integrate_samples(v->v[i], table, arc[j].points, arc[j].sine[i]);
}
/* Computes the averages over both arcs, the frequencies of the motion, and the sine series. Returns
 * 0 if the average of an integrand is not accurate enough. */
static int average_arcs(const kowalewski_curve *o, kowalewski_arc arc[2], cosine_table *table,
                        samples v[2], kowalewski_rates *out)
{
    begin_cosines(table);
    for (int j = 0; j < 2; j++)
        if (!fill_samples(o, &arc[j], table, &v[j])) return 0;
    const dd det = dd_sub(dd_mul(arc[1].p, arc[0].q), dd_mul(arc[0].p, arc[1].q));
    for (int j = 0; j < 2; j++) {
        out->rate[j] = dd_div(arc[1 - j].p, det);
        integrate_arc(o, arc, j, det, table, &v[j]);
    }
    const dd heading = dd_sub(dd_mul(arc[0].turn, out->rate[0]), dd_mul(arc[1].turn, out->rate[1]));
    out->heading = o->l.hi < 0.0 ? dd_neg(heading) : heading;
    return det.hi > 0.0;
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
