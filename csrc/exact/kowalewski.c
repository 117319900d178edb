/* Set-up of the closed form of a Kowalewski top, whose states kowalewski.h computes. Double-double
 * products are three times as fast with fused multiply-add, so that this file is compiled once for
 * each instruction set.
 *
 * Units and axes: The moments are (2, 2, 1), and mass * |gravity| * |com| = 1. Axis 1 points away
 * from the centre of mass if gravity is positive, and towards it otherwise. Axis 3 is the principal
 * axis with moment 1. With the momentum m, the angular velocity (p, q, r) and the upward vertical
 * e3 = (g1, g2, g3) in the body frame,
 *     h = p^2 + q^2 + r^2/2 - g1,  l = <m, e3>,  k = |(p + iq)^2 + g1 + i g2|,  c = 1 - k^2,
 *     phi(w) = 2 (w + h)(w^2 + c) - l^2,  F(w)^2 = -(w^2 - k^2) phi(w).
 * Kowalewski's variables w1 > w2 (Acta Math. 12 (1889) 177) have the rates F(w1)/(w1 - w2) and
 * F(w2)/(w2 - w1). They move on arcs between branch points of F, which are k, -k, infinity and the
 * roots e0, e1 and e2 of phi. On an arc
 *     w = N/D,  N = A sin^2 + B cos^2,  D = C sin^2 + cos^2  of half of an angle x.
 * Let dt = |dw/F| (t is not the time). Then dt = D R dx, where R is an even periodic function of x.
 * Landen transformations replace x by an angle y. Averages of dt/dy and w dt/dy by the trapezoidal
 * rule converge exponentially. The torus angles theta1 and theta2, y1 and y2 plus sine series, grow
 * linearly with time. kowalewski.h describes the heading psi, and Koetter's formulas for states. */
#include "kowalewski.h"
enum { GRID = HARMONICS };
#include "torus_setup.h"

/* The constants of a motion. The branch points `root` are e0, e1, e2, k and -k. */
typedef struct kowalewski_curve {
    dd h, l, k, c;
    int pair; /* 1 if e1 and e2 are complex: root[1] +- i root[2] */
    dd root[ROOTS];
    int order[ROOTS], real; /* indices of the real roots, ascending; their number */
} kowalewski_curve;
/* A real pole w of the integrand of the heading, with N - w D = a sin^2 + b cos^2 of x/2. */
typedef struct heading_pole {
    dd a, b, value;  /* value: sqrt(a b)/2 if is_adjacent, or 0 */
    int is_adjacent; /* 1 if the pole is in the gap next to an end of the arc */
} heading_pole;
/* An arc from the root `high` at x = 0 to the root `low`, or to minus infinity, at x = pi. */
typedef struct kowalewski_arc {
    const kowalewski_curve *curve;
    dd A, B, C;
    int low, high;
    /* N - root D = a sin^2 + b cos^2 of x/2; the real part replaces a complex root. */
    dd a[ROOTS], b[ROOTS];
    int folds;            /* number of Landen transformations from x to y */
    dd fold[FOLDS];       /* moduli of the transformations */
    int crosswise[FOLDS]; /* 1 if one removes singularities with Re x = pi/2, not 0 or pi */
    heading_pole pole[2];
    dd p, q, turn;        /* averages over y of dt/dy, w dt/dy, and the heading's integrand */
    int points;           /* number of intervals used */
    double sine[3][GRID]; /* series of theta1 - y1, theta2 - y2 and the heading */
} kowalewski_arc;

/* Sets the constants and branch points, given a state y = (p, q, r, g1, g2, g3) and l. */
static void set_curve_from_state(kowalewski_curve *o, const dd y[6], dd l)
{
    const dd re = dd_add(dd_sub(dd_square(y[0]), dd_square(y[1])), y[3]),
             im = dd_add(dd_twice(dd_mul(y[0], y[1])), y[4]),
             k2 = dd_add(dd_square(re), dd_square(im));
    o->h = dd_sub(dd_add(dd_add(dd_square(y[0]), dd_square(y[1])), dd_half(dd_square(y[2]))), y[3]);
    o->l = l;
    o->k = dd_sqrt(k2);
    o->c = dd_sub(dd_of(1.0), k2);
    const cubic half_phi = {o->h, o->c, dd_half(dd_square(l))};
    o->pair = find_cubic_roots(&half_phi, o->root);
    o->root[ROOT_K] = o->k;
    o->root[ROOT_MINUS_K] = dd_neg(o->k);
    o->real = sort_real_roots(o->root, ROOTS, o->pair ? 1 : ROOTS, o->order);
}
static dd ordered_root(const kowalewski_curve *o, int i) { return o->root[o->order[i]]; }

/* The difference between a root e of phi and a nearby branch point a, which is k or -k, computed
 * without cancellation. As a^2 + c = 1 and e^2 + c = l^2/(2 (e + h)),
 *     (a - e)(a + e)(e + h) = e + h - l^2/2.
 * `resolution`, small if sums cancel: min(|e + h|, |e + h - l^2/2|) / max(|e|, |h|, l^2/2). */
typedef struct close_roots {
    int apply; /* 1 if this formula loses fewer digits to cancellation than a - e */
    dd apart;  /* branch point i minus branch point j, if `apply` is 1 */
    double resolution;
} close_roots;
static close_roots find_close_root_difference(const kowalewski_curve *o, int i, int j)
{
    const int first = i < j ? i : j;
    const dd e = o->root[first], sum = dd_add(o->root[i], o->root[j]), other = dd_add(e, o->h),
             square = dd_half(dd_square(o->l)), up = dd_sub(other, square);
    const double size = fmax(fmax(fabs(e.hi), fabs(o->h.hi)), square.hi),
                 plain = fabs(dd_sub(o->root[i], o->root[j]).hi);
    close_roots r = {0, {0.0, 0.0}, fmin(fabs(up.hi), fabs(other.hi)) / size};
    if ((i < ROOT_K) == (j < ROOT_K) || (o->pair && first != 0)) return r;
    if (!(plain < 0.1 * fabs(sum.hi)) || !(r.resolution * fabs(e.hi) > plain)) return r;
    r.apply = 1;
    r.apart = dd_div(up, dd_mul(sum, other));
    if (i < j) r.apart = dd_neg(r.apart);
    return r;
}
/* Returns branch point i minus branch point j, or the difference of their real parts. */
static dd subtract_roots(const kowalewski_curve *o, int i, int j)
{
    const close_roots r = find_close_root_difference(o, i, j);
    return r.apply ? r.apart : dd_sub(o->root[i], o->root[j]);
}
/* Writes w1 > w2, the roots of (2q)^2 w^2 + 2 R12 w + R1 (Kowalewski's R1 and R12), to w. */
static void find_kowalewski_variables(const kowalewski_curve *o, dd p, dd q, dd w[2])
{
    const dd y = dd_add(dd_square(p), dd_square(q)), two_h = dd_twice(o->h);
    const cdd x = cdd_of(p, q), x2 = cdd_mul(x, x);
    const cdd rx = cdd_add(cdd_sub(cdd_scale(two_h, x2), cdd_mul(x2, x2)),
                           cdd_add(cdd_scale(dd_twice(o->l), x), cdd_of_real(o->c)));
    const dd r = dd_sqrt(cdd_abs_square(rx)), lp = dd_mul(o->l, p);
    const dd r12 = dd_add(dd_add(dd_sub(dd_mul(two_h, y), dd_square(y)), dd_twice(lp)), o->c);
    const dd r1 = dd_sub(dd_sub(dd_mul(two_h, o->c), dd_square(o->l)),
                         dd_add(dd_mul(two_h, dd_square(y)),
                                dd_scale(4.0, dd_add(dd_mul(o->c, dd_square(p)), dd_mul(lp, y)))));
    const dd t = r12.hi >= 0.0 ? dd_add(r12, r) : dd_sub(r12, r), d = dd_scale(-4.0, dd_square(q));
    const dd u = t.hi != 0.0 ? dd_div(dd_neg(r1), t) : dd_of(0.0),
             v = d.hi != 0.0 ? dd_div(t, d) : dd_of(-1e60);
    const int swap = dd_less(u, v);
    w[0] = swap ? v : u;
    w[1] = swap ? u : v;
}
/* The distances of w1 and w2 from the ends of their arcs. */
typedef struct arc_gaps {
    dd up, down, below; /* k - w1; w1 minus the lower end; the upper end minus w2 */
    double mismatch;    /* relative error of the unsolved equations (refine_end_distances) */
} arc_gaps;
/* Returns q^2 (w1 - e)(e - w2), where e is branch point i, an end of an arc, but not k. If e = -k,
 * this is re_z^2, given Re z of find_end_distances. If e is a root of phi, it is the square of
 *     A (p^2 + q^2 - e)/2 + B p  with Koetter's A^2 = 2 (e + h), B^2 = e^2 + c, A B = l. */
static dd find_scaled_distance_product(const kowalewski_curve *o, int i, dd p, dd q, dd re_z)
{
    const dd e = o->root[i], sum = dd_twice(dd_add(e, o->h)), other = dd_add(dd_square(e), o->c),
             size = dd_sub(dd_add(dd_square(p), dd_square(q)), e);
    dd A = dd_sqrt(dd_max(sum, dd_of(0.0))), B = dd_sqrt(dd_max(other, dd_of(0.0)));
    if (i == ROOT_MINUS_K) return dd_square(re_z);
    if (A.hi > B.hi)
        B = dd_div(o->l, A);
    else if (B.hi > 0.0)
        A = dd_div(o->l, B);
    return dd_square(dd_add(dd_half(dd_mul(A, size)), dd_mul(B, p)));
}
/* Refines the approximate distances `gap` of w1 and w2 from the ends of their arcs. `product` holds
 * accurate values of (k - w1)(k - w2), (w1 - e)(e - w2) and (w1 - f)(f - w2), with the lower end e
 * of arc 1 and the upper end f of arc 2. Each iteration computes w1 from one product and w2 from
 * another: the two that converge fastest. gap->mismatch measures how well all equations hold. */
static void refine_end_distances(const kowalewski_curve *o, const dd product[3], arc_gaps *gap)
{
    const int low = o->order[o->real - 2], least = o->order[0];
    const dd height = subtract_roots(o, ROOT_K, low), width = subtract_roots(o, ROOT_K, least),
             between = subtract_roots(o, low, least);
    const double u = gap->down.hi, v = gap->below.hi, d = between.hi, up = gap->up.hi,
                 first = u * v / ((d + v) * (u + d)), second = u * (width.hi + v) / ((d + v) * up),
                 third = up * v / ((width.hi + v) * (u + d));
    for (int i = 0; i < 40; i++) {
        const dd before = gap->below;
        if (third <= fmin(first, second))
            gap->down = dd_sub(height, dd_div(product[0], dd_add(width, before)));
        else
            gap->down = dd_div(product[1], dd_add(between, before));
        if (second < fmin(first, third))
            gap->below = dd_sub(dd_div(product[0], dd_sub(height, gap->down)), width);
        else
            gap->below = dd_div(product[2], dd_add(gap->down, between));
        if (!(fabs(dd_sub(gap->below, before).hi) > 1e-30 * fabs(before.hi))) break;
    }
    gap->up = dd_div(product[0], dd_add(width, gap->below));
    gap->down = dd_div(product[1], dd_add(between, gap->below));
    const dd ends = dd_sub(dd_add(gap->up, gap->down), height),
             rest = dd_sub(dd_mul(gap->below, dd_add(gap->down, between)), product[2]);
    /* On a short arc, an error of w1 hardly changes the state. */
    gap->mismatch = fmax(fabs(ends.hi) / sqrt(height.hi), fabs(rest.hi) / product[2].hi);
}
/* Returns the distances of w1 and w2 from the ends of their arcs, in a state (p, q, r, g1, g2, g3).
 * With v = p + iq and z = (r v + g3) conj(sqrt(v^2 + g1 + i g2)) (not the z of kowalewski.h),
 *     (k - w1)(k - w2) = (Im z)^2/q^2,   (w1 + k)(-k - w2) = (Re z)^2/q^2.
 * Such products (find_scaled_distance_product) determine the distances to full precision. */
static arc_gaps find_end_distances(const kowalewski_curve *o, const dd state[6])
{
    const int low = o->order[o->real - 2], least = o->order[0];
    const dd p = state[0], q = state[1], r = state[2], square = dd_square(q);
    const cdd x = cdd_of(p, q), root = cdd_sqrt(cdd_add(cdd_mul(x, x), cdd_of(state[3], state[4]))),
              z = cdd_mul(cdd_add(cdd_scale(r, x), cdd_of_real(state[5])),
                          cdd_of(root.re, dd_neg(root.im)));
    dd w[2];
    find_kowalewski_variables(o, p, q, w);
    arc_gaps gap = {dd_sub(o->k, w[0]), dd_sub(w[0], o->root[low]), dd_sub(o->root[least], w[1]),
                    INFINITY};
    if (!(square.hi > 0.0)) return gap;
    const dd product[3] = {dd_div(dd_square(z.im), square),
                           dd_div(find_scaled_distance_product(o, low, p, q, z.re), square),
                           dd_div(find_scaled_distance_product(o, least, p, q, z.re), square)};
    refine_end_distances(o, product, &gap);
    return gap;
}

/* Sets the coefficients A, B, C, a and b. `scale` becomes C, or -A if the arc ends at infinity. */
static void set_arc_coefficients(kowalewski_arc *arc, dd scale)
{
    const kowalewski_curve *o = arc->curve;
    const int infinite = arc->low == AT_INFINITY;
    arc->A = infinite ? dd_neg(scale) : dd_mul(o->root[arc->low], scale);
    arc->B = o->root[arc->high];
    arc->C = infinite ? dd_of(0.0) : scale;
    for (int i = 0; i < ROOTS; i++) {
        arc->a[i] = infinite ? arc->A : dd_mul(arc->C, subtract_roots(o, arc->low, i));
        arc->b[i] = subtract_roots(o, arc->high, i);
    }
}
/* The complex singularities x of an arc's integrands (sample_integrands), stored as cos x. Where x
 * is near 0 or pi, cos x is close to 1 or -1, and doubles would not resolve x. */
typedef struct singularities {
    int count;
    cdd cosine[ROOTS + 1 + FOLDS];
} singularities;
/* Returns the hyperbolic sine of |Im x|, given cos x. */
static dd sinh_of_imaginary_part(cdd cosine)
{
    const cdd one = cdd_of_real(dd_of(1.0)), c = cosine;
    const dd mean = dd_half(
        dd_add(dd_sqrt(cdd_abs_square(cdd_add(c, one))), dd_sqrt(cdd_abs_square(cdd_sub(c, one)))));
    return dd_sqrt(dd_max(dd_sub(dd_square(mean), dd_of(1.0)), dd_of(0.0)));
}
static cdd convert_cosine_to_sine(cdd cosine)
{
    const cdd one = cdd_of_real(dd_of(1.0));
    return cdd_sqrt(cdd_mul(cdd_sub(one, cosine), cdd_add(one, cosine)));
}
/* Returns 1 if Re x is pi/2, 0 if Re x is 0 or pi, and -1 otherwise, given cos x. */
static int classify_singularity_line(cdd cosine)
{
    const cx s = cdd_high(convert_cosine_to_sine(cosine)), c = cdd_high(cosine);
    const int crosswise = fabs(c.re) < fabs(c.im);
    const cx u = crosswise ? s : c;
    return fabs(u.im) > 1e-6 * fabs(u.re) ? -1 : crosswise;
}
/* Returns the smallest sinh |Im x| of all singularities x. Writes the smallest sinh |Im x| of the
 * singularities with Re x = 0, pi/2 or pi, which Landen transformations can remove, to `height`.
 * Sets `crosswise` to 1 if that singularity has Re x = pi/2, else to 0. */
static double find_least_singularity_heights(const singularities *v, dd *height, int *crosswise)
{
    double least = INFINITY;
    *height = dd_of(INFINITY);
    *crosswise = 0;
    for (int i = 0; i < v->count; i++) {
        const dd here = sinh_of_imaginary_part(v->cosine[i]);
        const int line = classify_singularity_line(v->cosine[i]);
        least = fmin(least, here.hi);
        if (line >= 0 && here.hi < height->hi) *height = here, *crosswise = line;
    }
    return least;
}
static singularities find_singularities(const kowalewski_arc *arc)
{
    const kowalewski_curve *o = arc->curve;
    singularities v = {0};
    for (int i = 0; i < ROOTS + 1; i++) {
        const int end = i < ROOTS && (i == arc->low || i == arc->high);
        if (end || (i == 2 && o->pair) || (i == ROOTS && arc->low == AT_INFINITY)) continue;
        const dd im = o->pair && i == 1 ? dd_neg(o->root[2]) : dd_of(0.0);
        const cdd a = i == ROOTS ? cdd_of_real(arc->C) : cdd_of(arc->a[i], dd_mul(im, arc->C)),
                  b = i == ROOTS ? cdd_of_real(dd_of(1.0)) : cdd_of(arc->b[i], im),
                  apart = cdd_sub(a, b);
        if (cdd_abs_square(apart).hi > 0.0) v.cosine[v.count++] = cdd_div(cdd_add(a, b), apart);
    }
    return v;
}
/* Returns the singularities after a Landen transformation of modulus m from x to a new variable y.
 * With u = cos x and v = cos y (if `crosswise` is nonzero, u = sin x and v = sin y), the
 * transformation is m u v^2 - (1 + m) v + u = 0. A singularity at u disappears if this equation for
 * v has a double root. There is a new singularity at v = 1/m. */
static singularities apply_landen_to_singularities(const singularities *from, dd m, int crosswise)
{
    const dd plus = dd_plus(m, 1.0), minus = dd_sub(dd_of(1.0), m);
    singularities to = {0};
    for (int i = 0; i < from->count; i++) {
        const cdd u = crosswise ? convert_cosine_to_sine(from->cosine[i]) : from->cosine[i];
        const cdd square =
            cdd_sub(cdd_of_real(dd_square(plus)), cdd_scale(dd_scale(4.0, m), cdd_mul(u, u)));
        if (cx_abs(cdd_high(square)) < 1e-12 * minus.hi * minus.hi) continue;
        const cdd v =
            cdd_div(cdd_scale(dd_of(2.0), u), cdd_add(cdd_of_real(plus), cdd_sqrt(square)));
        to.cosine[to.count++] = crosswise ? convert_cosine_to_sine(v) : v;
    }
    const cdd last = cdd_of_real(dd_div(dd_of(1.0), m));
    to.cosine[to.count++] = crosswise ? convert_cosine_to_sine(last) : last;
    return to;
}
/* Chooses the Landen transformations of an arc, which remove singularities of its integrands near
 * the real axis. Each transformation removes one singularity, but roughly halves the distances of
 * the others from the axis. Returns the smallest sinh |Im y| of all singularities y that remain. */
static double choose_landen_transformations(kowalewski_arc *arc)
{
    singularities now = find_singularities(arc);
    dd height;
    int crosswise, folds = 0;
    double best = find_least_singularity_heights(&now, &height, &crosswise);
    for (arc->folds = 0; arc->folds < FOLDS && best < 0.6;) {
        if (!(height.hi > 1e-12)) break;
        /* tanh |Im x|, and the modulus that removes this singularity x */
        const dd slope = dd_div(height, dd_sqrt(dd_plus(dd_square(height), 1.0))),
                 m = dd_div(dd_sub(dd_of(1.0), slope), dd_plus(slope, 1.0));
        arc->fold[arc->folds] = m;
        arc->crosswise[arc->folds++] = crosswise;
        now = apply_landen_to_singularities(&now, m, crosswise);
        const double least = find_least_singularity_heights(&now, &height, &crosswise);
        if (least > 1.2 * best) {
            best = least;
            folds = arc->folds;
        }
    }
    arc->folds = folds;
    return best;
}
/* Sets coefficients and Landen transformations of an arc. With `scale` (set_arc_coefficients), sums
 * converge fastest if all branch points are real. For complex e1, may choose a better scale. */
static void choose_arc_scale(kowalewski_arc *arc, dd scale)
{
    set_arc_coefficients(arc, scale);
    const double plain = choose_landen_transformations(arc);
    const kowalewski_curve *o = arc->curve;
    if (!o->pair || plain > 0.6) return;
    /* The following scale moves the complex branch points to Re x = pi/2. */
    const kowalewski_arc old = *arc;
    const dd im = dd_square(o->root[2]),
             up = dd_add(dd_square(dd_sub(o->root[arc->high], o->root[1])), im);
    if (arc->low == AT_INFINITY)
        scale = dd_sqrt(up);
    else
        scale = dd_sqrt(dd_div(up, dd_add(dd_square(dd_sub(o->root[arc->low], o->root[1])), im)));
    set_arc_coefficients(arc, scale);
    if (choose_landen_transformations(arc) < plain) *arc = old;
}
/* Sets up the arc of w1, between the largest two real branch points, and the arc of w2, from minus
 * infinity to the smallest one. */
static void make_arcs(const kowalewski_curve *o, kowalewski_arc arc[2])
{
    const int top = o->real - 1;
    const int high = o->order[top], low = o->order[top - 1], below = o->order[top - 2],
              least = o->order[0], above = o->order[1];
    arc[0].curve = arc[1].curve = o;
    arc[0].low = low;
    arc[0].high = high;
    arc[1].low = AT_INFINITY;
    arc[1].high = least;
    choose_arc_scale(
        &arc[0], dd_sqrt(dd_div(subtract_roots(o, high, below), subtract_roots(o, low, below))));
    choose_arc_scale(
        &arc[1], dd_sqrt(dd_mul(subtract_roots(o, above, least), subtract_roots(o, high, least))));
}
/* Replaces the sine and cosine of y by those of x, and returns dx/dy. dd_choose copies values:
 * pointers to *s and *c instead run into an optimizer error of gcc 12.2 at -O1. */
static dd invert_landen_transformations(const kowalewski_arc *arc, dd *s, dd *c)
{
    dd slope = dd_of(1.0);
    for (int i = arc->folds - 1; i >= 0; i--) {
        const int crosswise = arc->crosswise[i];
        const dd u = dd_choose(crosswise, *s, *c), v = dd_choose(crosswise, *c, *s);
        const dd m = arc->fold[i], square = dd_mul(m, dd_square(u)), plus = dd_plus(square, 1.0),
                 root = dd_sqrt(dd_sub(dd_of(1.0), dd_mul(m, square)));
        slope = dd_mul(
            slope, dd_div(dd_mul(dd_plus(m, 1.0), dd_sub(dd_of(1.0), square)), dd_mul(plus, root)));
        const dd one = dd_div(dd_mul(dd_plus(m, 1.0), u), plus),
                 other = dd_div(dd_mul(v, root), plus);
        *s = dd_choose(crosswise, one, other);
        *c = dd_choose(crosswise, other, one);
    }
    return slope;
}
/* Replaces the sine and cosine of x by those of y. */
static void apply_landen_transformations(const kowalewski_arc *arc, dd *s, dd *c)
{
    for (int i = 0; i < arc->folds; i++) {
        const int crosswise = arc->crosswise[i];
        const dd u = dd_choose(crosswise, *s, *c), v = dd_choose(crosswise, *c, *s);
        const dd m = arc->fold[i], plus = dd_plus(m, 1.0), minus = dd_sub(dd_of(1.0), m);
        const dd root = dd_sqrt(dd_add(dd_square(minus), dd_scale(4.0, dd_mul(m, dd_square(v)))));
        const dd one = dd_div(dd_twice(u), dd_add(plus, root)), square = dd_mul(m, dd_square(one));
        const dd other =
            dd_div(dd_mul(v, dd_plus(square, 1.0)), dd_sqrt(dd_sub(dd_of(1.0), dd_mul(m, square))));
        *s = dd_choose(crosswise, one, other);
        *c = dd_choose(crosswise, other, one);
    }
}
/* Writes N and D, and returns R. ss and cc are the squares of sin(x/2) and cos(x/2). */
static dd evaluate_N_D_R(const kowalewski_arc *arc, dd ss, dd cc, dd *N, dd *D)
{
    const kowalewski_curve *o = arc->curve;
    dd product = dd_of(1.0);
    *N = add_products(arc->A, ss, arc->B, cc);
    *D = dd_add(dd_mul(arc->C, ss), cc);
    for (int i = 0; i < ROOTS; i++) {
        dd factor;
        if (i == arc->low || i == arc->high || (o->pair && i == 2)) continue;
        factor = add_products(arc->a[i], ss, arc->b[i], cc);
        if (o->pair && i == 1)
            factor = dd_add(dd_square(factor), dd_square(dd_mul(o->root[2], *D)));
        product = dd_mul(product, factor);
    }
    product = dd_twice(dd_abs(product));
    if (arc->low == AT_INFINITY) return dd_sqrt(dd_div(dd_neg(arc->A), product));
    return dd_sqrt(dd_div(arc->C, dd_mul(product, *D)));
}

/* Returns branch point i minus the pole w, computed without cancellation. */
static dd subtract_pole_from_root(const kowalewski_curve *o, int i, dd w)
{
    const dd difference = dd_sub(o->root[i], w), sum = dd_add(o->root[i], w),
             other = dd_add(o->root[i], o->h);
    if (!(fabs(difference.hi) < 0.1 * fabs(sum.hi))) return difference;
    if (i >= ROOT_K) return dd_div(dd_of(1.0), sum);
    if (!(fabs(other.hi) > 1e-3 * fabs(difference.hi))) return difference;
    return dd_div(dd_half(dd_square(o->l)), dd_mul(other, sum));
}
/* Sets the poles w = sqrt(-c) and -sqrt(-c) of l w/(w^2 + c) dw/F, the integrand of the heading. If
 * l is small, they are close to the arcs. For l > 0, a real pole u next to an arc contributes
 * l D^2 R dx/(2 (N - u D)), where N - u D = a sin^2 + b cos^2 of x/2. From this, sample_integrands
 * subtracts sqrt(a b) dx/(2 (N - u D)), which has the same residue, and whose integral is the
 * argument of sqrt(b) cos(x/2) + i sqrt(a) sin(x/2). evaluate_frame adds this argument. */
static void set_heading_poles(kowalewski_arc *arc)
{
    const kowalewski_curve *o = arc->curve;
    const int infinite = arc->low == AT_INFINITY, end = infinite ? arc->high : arc->low;
    const dd next = ordered_root(o, infinite ? 1 : o->real - 3), w0 = dd_sqrt(dd_neg(o->c));
    for (int i = 0; i < 2; i++) {
        const dd w = i ? dd_neg(w0) : w0, rest = subtract_pole_from_root(o, end, w);
        const double side = infinite ? -1.0 : 1.0; /* sign of arc - pole: poles lie in gaps */
        heading_pole *p = &arc->pole[i];
        p->a = infinite ? arc->A : dd_mul(arc->C, rest);
        p->b = infinite ? rest : subtract_pole_from_root(o, arc->high, w);
        /* If l = 0, the heading changes only if the pole is at the end of the arc. */
        p->is_adjacent = o->c.hi <= 0.0 && side * dd_sub(w, next).hi >= 0.0 &&
                         (o->l.hi != 0.0 || rest.hi == 0.0);
        p->value = p->is_adjacent ? dd_half(dd_sqrt(dd_mul(p->a, p->b))) : dd_of(0.0);
    }
}
/* Writes the integrands of an arc, at the angle y whose cosine is element i of the table, to `out`:
 * dt/dy, w dt/dy, and |l| w/(w^2 + c) dt/dy minus terms for poles nearby (set_heading_poles). */
static void sample_integrands(const void *data, const cosine_table *t, int i, dd out[3])
{
    const kowalewski_arc *arc = data;
    const kowalewski_curve *o = arc->curve;
    dd N, D, sine = t->c[i < GRID / 2 ? GRID / 2 - i : i - GRID / 2], cosine = t->c[i];
    const dd slope = invert_landen_transformations(arc, &sine, &cosine),
             c = dd_half(dd_plus(cosine, 1.0)), s = dd_half(dd_sub(dd_of(1.0), cosine)),
             R = dd_mul(slope, evaluate_N_D_R(arc, s, c, &N, &D)),
             g = dd_mul(dd_abs(o->l), dd_mul(dd_square(D), R));
    out[0] = dd_mul(D, R);
    out[1] = dd_mul(N, R);
    if (o->c.hi > 0.0) {
        out[2] = dd_div(dd_mul(g, N), dd_add(dd_square(N), dd_mul(o->c, dd_square(D))));
        return;
    }
    out[2] = dd_of(0.0);
    for (int k = 0; k < 2; k++) {
        const heading_pole *p = &arc->pole[k];
        const dd under = add_products(p->a, s, p->b, c);
        if (under.hi != 0.0)
            out[2] = dd_add(out[2], dd_div(dd_sub(dd_half(g), dd_mul(slope, p->value)), under));
    }
}
/* Sets the averages and the poles of an arc. Returns 0 if the averages do not converge. */
static int average_integrands(kowalewski_arc *arc, cosine_table *table, samples *v)
{
    double floor[3] = {0.0, 0.0, 0.0};
    set_heading_poles(arc);
    for (int i = 0; i < 2; i++) floor[2] += arc->pole[i].is_adjacent ? 0.5 : 0.0;
    dd mean[3];
    arc->points = average_functions(sample_integrands, arc, 3, floor, table, v, mean);
    arc->p = mean[0];
    arc->q = mean[1];
    arc->turn = mean[2];
    return arc->points > 0;
}
/* Computes the sine series of arc j, for theta1, theta2 and the heading, from the samples v of the
 * arc's integrands. Let p1, q1, turn1 and p2, q2, turn2 be members of the two arcs: averages over y
 * of dt/dy, w dt/dy and the heading's integrand. With det = p2 q1 - p1 q2, dtheta1 and dtheta2 are
 *     (p2 w dt - q2 dt)/det  and  (p1 w dt - q1 dt)/det
 * on the first arc. On the second arc, where F has the opposite sign, their signs are opposite. The
 * heading is sign(l) (turn1 theta1 - turn2 theta2) plus its sine series. */
static void set_sine_series_of_arc(kowalewski_arc arc[2], int j, dd det, const cosine_table *table,
                                   samples *v)
{
    const kowalewski_curve *o = arc->curve;
    const double side = j ? -1.0 : 1.0, turn = o->l.hi < 0.0 ? -side : side;
    const dd scale = dd_div(dd_of(side), det);
    dd factor[2][2]; /* factors of w dt and dt in each torus angle */
    for (int i = 0; i < 2; i++) {
        factor[i][0] = dd_mul(scale, arc[1 - i].p);
        factor[i][1] = dd_neg(dd_mul(scale, arc[1 - i].q));
    }
    for (int i = 0; i <= GRID; i += GRID / arc[j].points) {
        const dd t = dd_sub(v->v[0][i], arc[j].p), wt = dd_sub(v->v[1][i], arc[j].q);
        const dd one = add_products(wt, factor[0][0], t, factor[0][1]),
                 two = add_products(wt, factor[1][0], t, factor[1][1]);
        const dd heading = dd_scale(turn, dd_sub(v->v[2][i], arc[j].turn)),
                 known = dd_sub(dd_mul(arc[0].turn, one), dd_mul(arc[1].turn, two));
        v->v[0][i] = one;
        v->v[1][i] = two;
        v->v[2][i] = dd_sub(heading, o->l.hi < 0.0 ? dd_neg(known) : known);
    }
    for (int i = 0; i < 3; i++) integrate_to_sines(v->v[i], table, arc[j].points, arc[j].sine[i]);
}
/* Computes averages and sine series of both arcs, and the rates [rad per unit of time] of theta1,
 * theta2 and the heading minus its pole terms (set_heading_poles). `table` and `v` are work memory.
 * Returns 0 if an average does not converge or det (set_sine_series_of_arc) <= 0. */
static int set_series_and_rates(const kowalewski_curve *o, kowalewski_arc arc[2],
                                cosine_table *table, samples v[2], dd rate[3])
{
    start_cosine_table(table);
    for (int j = 0; j < 2; j++)
        if (!average_integrands(&arc[j], table, &v[j])) return 0;
    const dd det = dd_sub(dd_mul(arc[1].p, arc[0].q), dd_mul(arc[0].p, arc[1].q));
    for (int j = 0; j < 2; j++) {
        rate[j] = dd_div(arc[1 - j].p, det);
        set_sine_series_of_arc(arc, j, det, table, &v[j]);
    }
    const dd heading = dd_sub(dd_mul(arc[0].turn, rate[0]), dd_mul(arc[1].turn, rate[1]));
    rate[2] = o->l.hi < 0.0 ? dd_neg(heading) : heading;
    return det.hi > 0.0;
}
/* Adds the arc's sine series in theta1 and theta2, at sin y = s and cos y = c, to `theta`. */
static void add_sine_series(const kowalewski_arc *arc, double s, double c, double theta[2])
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

enum { ORDER = 12 }; /* of Taylor series */

/* A point of an arc: sine and cosine of x/2, y, and the arc's sine series in theta1 and theta2. */
typedef struct start_point {
    double s, c, angle, theta[2];
} start_point;
static cdd get_root_as_complex(const kowalewski_curve *o, int i)
{
    if (!o->pair || i == 0 || i >= ROOT_K) return cdd_of_real(o->root[i]);
    return cdd_of(o->root[1], i == 1 ? o->root[2] : dd_neg(o->root[2]));
}
/* Writes the Taylor coefficients of the motion with the initial state (p, q, r, g1, g2, g3). */
static void expand_taylor_series(const dd y[6], dd c[6][ORDER + 1])
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
static void sum_taylor_series(dd c[6][ORDER + 1], double span, dd out[6])
{
    for (int i = 0; i < 6; i++) {
        out[i] = c[i][ORDER];
        for (int n = ORDER - 1; n >= 0; n--) out[i] = dd_add(dd_times(span, out[i]), c[i][n]);
    }
}
/* Computes the point of an arc whose w is `upper` below the upper end and `lower` above the lower
 * end of the arc. If the lower end is at infinity, `lower` is not used. `next_upper` is the value
 * of `upper` a short time later, and determines the sign of x. Returns 0 if the point is too close
 * to an end: |sin(x/2)| or |cos(x/2)| is at most `least`. */
static int locate_on_arc(const kowalewski_arc *arc, dd upper, dd lower, dd next_upper, double least,
                         start_point *out)
{
    const dd none = dd_of(0.0), up = dd_max(upper, none),
             down = arc->low == AT_INFINITY ? dd_neg(arc->A) : dd_mul(arc->C, dd_max(lower, none)),
             both = dd_add(up, down);
    dd s = dd_sqrt(dd_div(up, both)), c = dd_sqrt(dd_div(down, both));
    if (!(s.hi > least && c.hi > least)) return 0;
    dd sine = dd_twice(dd_mul(s, c)), cosine = dd_sub(dd_square(c), dd_square(s));
    if (dd_less(next_upper, upper)) {
        s = dd_neg(s);
        sine = dd_neg(sine);
    }
    out->s = s.hi;
    out->c = c.hi;
    apply_landen_transformations(arc, &sine, &cosine);
    /* The signs chosen for the square roots are correct for angles between -pi and pi. */
    const double turns = argument_in_turns(sine.hi, cosine.hi).hi;
    out->angle = two_pi * (sine.hi < 0.0 && turns > 0.0 ? turns - 1.0 : turns);
    out->theta[0] = out->theta[1] = 0.0;
    add_sine_series(arc, sine.hi, cosine.hi, out->theta);
    return 1;
}
/* Finds the first state `at` after the initial state `start` in which neither w1 nor w2 is close to
 * an end of its arc. After 8, 32 and 96 time steps, points closer to the ends are accepted. A state
 * shortly after `at` gives the directions of w1 and w2. Writes the points of w1 and w2 in the state
 * `at` to `point`, and theta1 and theta2 [rad] of the initial state to `theta`, given their `rate`.
 * Returns arc_gaps.mismatch of the state `at`, or infinity if there is no such state. */
static double find_angles_and_mismatch(const kowalewski_curve *o, const kowalewski_arc arc[2],
                                       const dd rate[3], const dd start[6], start_point point[2],
                                       dd at[6], double theta[2])
{
    const double moment = 0.00390625 / (1.0 + sqrt(fabs(o->h.hi)));
    dd series[6][ORDER + 1], later[6];
    memcpy(at, start, 6 * sizeof *at);
    for (int step = 0; step < 160; step++) {
        const int i = step % 8;
        const double least = step < 8 ? 0.02 : step < 32 ? 0.002 : step < 96 ? 1e-5 : 1e-9;
        if (i == 0) expand_taylor_series(at, series);
        sum_taylor_series(series, (i + 1) * moment, at);
        sum_taylor_series(series, (i + 1 + 0x1p-20) * moment, later);
        const arc_gaps gap = find_end_distances(o, at), next = find_end_distances(o, later);
        if (!locate_on_arc(&arc[0], gap.up, gap.down, next.up, least, &point[0])) continue;
        if (!locate_on_arc(&arc[1], gap.below, gap.below, next.below, least, &point[1])) continue;
        for (int j = 0; j < 2; j++)
            theta[j] = point[j].angle + (point[0].theta[j] + point[1].theta[j]) -
                       (step + 1) * moment * rate[j].hi;
        return gap.mismatch;
    }
    return INFINITY;
}

/* For k > FAST, most states need time derivatives (evaluate_frame). */
#define FAST 9.0
static const torus_kind kowalewski = {KR_KIND_KOWALEWSKI, 2.0, 1.0, -1.0};

/* A closed form and the intermediate results of its set-up. */
typedef struct kowalewski_work {
    kr_kowalewski_plan plan;
    kowalewski_curve curve;
    kowalewski_arc arc[2];
    cosine_table table;
    samples samples[2];
    dd rate[3];        /* of theta1, theta2 and the heading */
    double start[2];   /* initial theta1 and theta2 */
    double separatrix; /* see estimate_frequency_error */
} kowalewski_work;
/* Returns 1 if the upper end of the first arc is k, and w1 and w2 lie on their arcs. This condition
 * has not been proved, but holds for 1e6 random tops (docs/theory/closed_form.md). */
static int is_state_on_arcs(const kowalewski_curve *o, const dd state[6])
{
    const double slack = 1e-12;
    dd w[2];
    find_kowalewski_variables(o, state[0], state[1], w);
    const dd low = ordered_root(o, o->real - 2), least = ordered_root(o, 0);
    return o->order[o->real - 1] == ROOT_K &&
           dd_sub(w[0], low).hi >= -slack * (1.0 + fabs(low.hi)) &&
           dd_sub(least, w[1]).hi >= -slack * (1.0 + fabs(least.hi));
}
/* Returns the distance of branch points i and j in the complex plane, divided by 1 + k. */
static double find_root_distance(const kowalewski_curve *o, int i, int j)
{
    const int pi = o->pair && i == 2 ? 1 : i, pj = o->pair && j == 2 ? 1 : j;
    return cx_abs(cx_of(subtract_roots(o, pi, pj).hi,
                        dd_sub(get_root_as_complex(o, i).im, get_root_as_complex(o, j).im).hi)) /
           (1.0 + o->k.hi);
}
/* Returns the relative error of the distance of branch points i and j: 1e-31/distance or, for two
 * roots of phi, 1e-31/distance^2, because nearly equal roots lose up to half of their digits. */
static double estimate_distance_error(const kowalewski_curve *o, int i, int j)
{
    const double distance = find_root_distance(o, i, j), digits = 1e-31;
    return i < ROOT_K && j < ROOT_K ? digits / (distance * distance) : digits / distance;
}
/* Returns the largest relative error of the distances on whose logarithms the frequencies depend:
 * from each arc to the next branch point and, if an arc passes between e1 and e2, from e1 to e2. */
static double estimate_frequency_error(const kowalewski_curve *o)
{
    const int top = o->real - 2;
    double most = fmax(estimate_distance_error(o, o->order[top], o->order[top - 1]),
                       estimate_distance_error(o, o->order[0], o->order[1]));
    if (o->pair) {
        const double re = o->root[1].hi;
        if ((re > ordered_root(o, top).hi && re < o->k.hi) || re < ordered_root(o, 0).hi)
            most = fmax(most, estimate_distance_error(o, 1, 2));
    }
    return most;
}
/* Returns the least find_root_distance of two branch points. For a pair with close_roots.apply = 1,
 * close_roots.resolution limits the accuracy and replaces the distance. */
static double find_least_root_distance(const kowalewski_curve *o)
{
    double least = INFINITY;
    for (int i = 0; i < ROOTS; i++)
        for (int j = 0; j < i; j++) {
            const close_roots r = find_close_root_difference(o, i, j);
            least = fmin(least, r.apply ? r.resolution : find_root_distance(o, i, j));
        }
    return least;
}
static void fill_plan_arc(const kowalewski_arc *from, kr_kowalewski_arc *to)
{
    const kowalewski_curve *o = from->curve;
    const int infinite = from->low == AT_INFINITY;
    const double way = infinite ? -1.0 : 1.0;
    const dd edge = infinite ? dd_neg(from->A) : from->C;
    to->A = from->A.hi, to->B = from->B.hi, to->C = from->C.hi;
    to->low = from->low;
    to->high = from->high;
    to->scale = dd_sqrt(dd_half(edge)).hi;
    for (int i = 0; i < ROOTS; i++) {
        const double side = i == ROOT_K ? -1.0 : way;
        to->a[i] = side * from->a[i].hi;
        to->b[i] = side * from->b[i].hi;
        to->root_a[i] = dd_sqrt(dd_scale(side, from->a[i])).hi;
        to->root_b[i] = dd_sqrt(dd_scale(side, from->b[i])).hi;
    }
    if (o->pair) {
        const dd im = dd_scale(-way, o->root[2]);
        const cdd a = cdd_of(dd_scale(way, from->a[1]), dd_mul(im, from->C)),
                  b = cdd_of(dd_scale(way, from->b[1]), im), apart = cdd_sub(a, b),
                  center = cdd_div(cdd_add(a, b), apart);
        to->im = im.hi;
        to->half = 0.5 * apart.re.hi;
        to->center[0] = center.re.hi;
        to->center[1] = dd_half(dd_mul(apart.im, center.im)).hi;
    }
    to->folds = from->folds;
    for (int i = 0; i < from->folds; i++) {
        to->fold[i].m = from->fold[i].hi;
        to->fold[i].rest = dd_sub(dd_of(1.0), from->fold[i]).hi;
        to->fold[i].crosswise = from->crosswise[i];
    }
    to->poles = 0;
    for (int i = 0; i < 2; i++) {
        const heading_pole *pole = &from->pole[i];
        to->both_a[i] = pole->a.hi;
        to->both_b[i] = pole->b.hi;
        if (!pole->is_adjacent) continue;
        const double a = dd_sqrt(dd_abs(pole->a)).hi;
        to->pole_a[to->poles] = o->l.hi < 0.0 ? -a : a;
        to->pole_b[to->poles++] = dd_sqrt(dd_abs(pole->b)).hi;
    }
}
/* Writes the values `one` and `two` of a function at e1 and e2 as a struct pair (kowalewski.h). */
static void store_values_as_pair(const kowalewski_curve *o, cdd one, cdd two, double out[2])
{
    out[0] = one.re.hi;
    out[1] = o->pair ? one.im.hi : two.re.hi;
}
static void fill_koetter_constants(const kowalewski_curve *o, kr_kowalewski_plan *plan)
{
    const cdd first = cdd_sub(get_root_as_complex(o, 0), get_root_as_complex(o, 1)),
              second = cdd_sub(get_root_as_complex(o, 0), get_root_as_complex(o, 2));
    cdd A[3], B[3];
    for (int i = 0; i < 3; i++) {
        const cdd e = get_root_as_complex(o, i), l = cdd_of_real(o->l);
        A[i] = cdd_sqrt(cdd_scale(dd_of(2.0), cdd_add(e, cdd_of_real(o->h))));
        B[i] = cdd_sqrt(cdd_add(cdd_mul(e, e), cdd_of_real(o->c)));
        if (cdd_abs_square(A[i]).hi > cdd_abs_square(B[i]).hi)
            B[i] = cdd_div(l, A[i]);
        else if (cdd_abs_square(B[i]).hi > 0.0)
            A[i] = cdd_div(l, B[i]);
    }
    const dd square = dd_square(A[0].re);
    plan->l = o->l.hi, plan->c = o->c.hi, plan->k = o->k.hi;
    plan->pair = o->pair;
    plan->A0 = A[0].re.hi, plan->B0 = B[0].re.hi;
    store_values_as_pair(o, A[1], A[2], plan->A);
    store_values_as_pair(o, B[1], B[2], plan->B);
    store_values_as_pair(o, cdd_mul(A[1], A[1]), cdd_mul(A[2], A[2]), plan->A_square);
    store_values_as_pair(o, cdd_mul(B[1], B[1]), cdd_mul(B[2], B[2]), plan->B_square);
    /* The sum of the roots is -h, and A^2 = 2 (e + h). */
    plan->sum = -0.5 * square.hi;
    plan->apart = o->pair ? 2.0 * o->root[2].hi : dd_sub(o->root[1], o->root[2]).hi;
    plan->one_apart = 1.0 / plan->apart;
    plan->middle = dd_add(o->root[0], dd_scale(0.25, square)).hi;
    plan->one_product = 1.0 / cdd_mul(first, second).re.hi;
}
/* Sets plan->sign, the signs s_0 to s_4 of Koetter's formulas (evaluate_koetter_formulas) and the
 * sign of Z2 (evaluate_frame, kowalewski.h). With these signs, the formulas give p, q, r and g3 of
 * `state`, at the points `point` of the arcs, with the smallest error. Returns this error. */
static double find_koetter_signs(kr_kowalewski_plan *plan, const start_point point[2],
                                 const dd state[6])
{
    arc_point at[2];
    double best = INFINITY, sign[6] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    const double p = state[0].hi, q = state[1].hi, r = state[2].hi, g3 = state[5].hi,
                 size = fmax(1.0, v_largest(v3(p, q, r)));
    for (int j = 0; j < 2; j++) {
        const double s = point[j].s, c = point[j].c;
        at[j] = find_arc_point(&plan->arc[j], plan->pair, (half_angle){s, c, c * c - s * s}, 0.0);
    }
    for (int all = 0; all < 32; all++) {
        for (int i = 0; i < 5; i++) plan->sign[i] = all >> i & 1 ? -1.0 : 1.0;
        if (plan->pair && plan->sign[1] != plan->sign[2]) continue;
        const koetter_state s = evaluate_koetter_formulas(plan, plan->pair, &at[0], &at[1]);
        const double miss =
            fmax(v_largest(v3(s.p.v - p, s.q.v - q, s.r.v - r)) / size, fabs(s.g3.v - g3));
        if (!(miss < best)) continue;
        best = miss;
        memcpy(sign, plan->sign, sizeof sign);
    }
    /* For the right sign of Im Z, xi = (p + iq)^2 + g1 + i g2 has the argument of (z/Z)^2. */
    const cx x = cx_of(p, q), xi = cx_add(cx_mul(x, x), cx_of(state[3].hi, state[4].hi)),
             z = cx_add(cx_scale(r, x), cx_of(g3, 0.0)),
             Z = cx_of(at[0].plus.v * at[1].plus.v, at[0].minus.v * at[1].minus.v),
             rest = cx_mul(cx_mul(z, z), cx_of(xi.re, -xi.im)), square = cx_mul(Z, Z),
             one = cx_mul(rest, cx_of(square.re, -square.im)), other = cx_mul(rest, square);
    sign[5] = one.re - fabs(one.im) >= other.re - fabs(other.im) ? 1.0 : -1.0;
    memcpy(plan->sign, sign, sizeof sign);
    return best;
}
/* Sets `w`, given the initial state `start` = (p, q, r, g1, g2, g3). In w->plan, only the arcs,
 * Koetter's constants and the signs are set. Returns KR_REFUSAL_NONE or why there is no plan. */
static kr_refusal prepare_closed_form(const dd start[6], dd l, kowalewski_work *w)
{
    kr_kowalewski_plan *plan = &w->plan;
    kowalewski_curve *o = &w->curve;
    set_curve_from_state(o, start, l);
    /* Relative to a larger h, k^2 and -c = k^2 - 1 coincide. */
    if (!(fabs(o->h.hi) < 1e12)) return KR_REFUSAL_COINCIDENT;
    w->separatrix = estimate_frequency_error(o);
    if (!(w->separatrix < 1e-14)) return KR_REFUSAL_SEPARATRIX;
    const double distance = find_least_root_distance(o);
    if (!(distance > 1e-24)) return KR_REFUSAL_COINCIDENT;
    /* The formulas for the initial state divide by the distances between branch points. */
    const int unresolved = distance < 1e-12;
    if (!is_state_on_arcs(o, start)) return unresolved ? KR_REFUSAL_COINCIDENT : KR_REFUSAL_START;
    make_arcs(o, w->arc);
    if (!set_series_and_rates(o, w->arc, &w->table, w->samples, w->rate))
        return KR_REFUSAL_INTEGRALS;
    fill_koetter_constants(o, plan);
    for (int j = 0; j < 2; j++) fill_plan_arc(&w->arc[j], &plan->arc[j]);
    start_point point[2];
    dd state[6];
    const double mismatch =
        find_angles_and_mismatch(o, w->arc, w->rate, start, point, state, w->start);
    const int is_known = mismatch < 1e-13;
    if (is_known && find_koetter_signs(plan, point, state) < 1e-6) return KR_REFUSAL_NONE;
    return unresolved                    ? KR_REFUSAL_COINCIDENT
           : !is_known && mismatch < 1.0 ? KR_REFUSAL_SEPARATRIX
                                         : KR_REFUSAL_START;
}
/* Returns a number of terms, a multiple of 4, after which all coefficients of the first
 * `series_count` sine series of both arcs are at most `least` in magnitude. */
static int count_terms(const kowalewski_arc arc[2], int series_count, double least)
{
    int terms = 4;
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < series_count; i++)
            for (int k = arc[j].points - 1; k > terms; k--)
                if (fabs(arc[j].sine[i][k]) > least) terms = (k + 3) / 4 * 4;
    return terms;
}
static void fill_series(const kowalewski_arc arc[2], kr_kowalewski_plan *plan)
{
    plan->some_terms = count_terms(arc, 2, 1e-9);
    plan->terms = count_terms(arc, 3, 1e-18);
    for (int k = 1; k <= plan->terms; k++) {
        kr_harmonic *to = &plan->harmonic[k - 1];
        for (int j = 0; j < 2; j++) {
            const int has = k < arc[j].points;
            for (int i = 0; i < 2; i++) to->angle[j + 2 * i] = has ? arc[j].sine[i][k] : 0.0;
            to->heading[2 + j] = 0.0;
            to->heading[j] = has ? arc[j].sine[2][k] / (2.0 * two_pi) : 0.0;
        }
    }
}
/* Fills the table plan->guess. Newton's method for each entry starts at an adjacent entry. */
static void fill_guess_table(kr_kowalewski_plan *plan)
{
    jacobian unused;
    for (int i = 0; i < STARTS; i++)
        for (int j = 0; j < STARTS; j++) {
            const dd theta[2] = {dd_of(i / (double)STARTS), dd_of(j / (double)STARTS)};
            const float *before = plan->guess[j > 0 ? i : i > 0 ? i - 1 : 0][j > 0 ? j - 1 : 0];
            double d[2] = {0.0, 0.0}, step[2], size = 1.0;
            arc_angle y[2];
            if (i + j > 0) d[0] = before[0], d[1] = before[1];
            for (int k = 0; k < NEWTON_STEPS && !(size < 1e-3); k++) {
                for (int n = 0; n < 2; n++) y[n] = make_arc_angle(theta[n], d[n]);
                size = find_newton_step_size(plan, plan->some_terms, y, d, &unused, step);
                for (int n = 0; n < 2; n++) d[n] -= step[n];
            }
            for (int n = 0; n < 2; n++) plan->guess[i][j][n] = (float)d[n];
        }
}
static double dot_sign_table_quaternions(const signed char a[4], const signed char b[4])
{
    int dot = 0;
    for (int i = 0; i < 4; i++) dot += a[i] * b[i];
    return dot / (127.0 * 127.0);
}
/* Fills the sign table: quaternions at n * n pairs (y1, y2), with signs so that no scalar product
 * with a predecessor in y2 (first y2: in y1) is negative. half_turns[j] is set to 1 if two turns of
 * y_(j+1) change the sign. Returns the least scalar product of neighbours with these signs. */
static double fill_sign_table(kr_kowalewski_plan *plan, int n)
{
    signed char *const node = (signed char *)(plan->harmonic + plan->terms);
    arc_angle angle[NODES];
    double least = 1.0;
    plan->nodes = n;
    for (int i = 0; i < n; i++) angle[i] = make_arc_angle(dd_of(first_node + 2.0 * i / n), 0.0);
    for (int i = 0; i < n * n; i++) {
        const arc_angle y[2] = {angle[i / n], angle[i % n]};
        const frame_state f = find_accurate_frame(plan, y);
        const kr_quat q = convert_frame_to_quaternion(&f);
        const double part[4] = {q.w, q.x, q.y, q.z};
        signed char *to = node + 4 * i, *before = to - 4 * (i % n > 0 ? 1 : i > 0 ? n : 0);
        for (int k = 0; k < 4; k++)
            to[k] = (signed char)(fabs(part[k]) <= 1.0 ? nearest(127.0 * part[k]) : 0.0);
        if (dot_sign_table_quaternions(before, to) < 0.0)
            for (int k = 0; k < 4; k++) to[k] = (signed char)-to[k];
    }
    const int corner[2] = {n * (n - 1), n - 1};
    for (int j = 0; j < 2; j++)
        plan->half_turns[j] = dot_sign_table_quaternions(node + 4 * corner[j], node) < 0.0;
    for (int i = 0; i < n * n; i++) {
        const int one = (i + n) % (n * n), two = (i + 1) % n + i / n * n;
        const double across = dot_sign_table_quaternions(node + 4 * i, node + 4 * one),
                     along = dot_sign_table_quaternions(node + 4 * i, node + 4 * two);
        least = fmin(least, one < i && plan->half_turns[0] != 0.0 ? -across : across);
        least = fmin(least, two < i && plan->half_turns[1] != 0.0 ? -along : along);
    }
    return least;
}
/* Fills the members of the plan that prepare_closed_form does not set, except the initial phase of
 * the heading. Returns the least scalar product (fill_sign_table) in the final table of signs. If
 * it is above 1/4, find_quaternion_sign finds the right sign in every state of the motion. */
static double complete_plan_and_test_signs(kowalewski_work *w)
{
    kr_kowalewski_plan *plan = &w->plan;
    const kowalewski_curve *o = &w->curve;
    const dd base = dd_half(dd_add(ordered_root(o, o->real - 2), ordered_root(o, 0)));
    for (int j = 0; j < 2; j++) {
        const kowalewski_arc *arc = &w->arc[j];
        plan->p[j] = arc->p.hi;
        plan->q[j] = dd_sub(arc->q, dd_mul(base, arc->p)).hi;
    }
    fill_series(w->arc, plan);
    fill_guess_table(plan);
    plan->fast = plan->k > FAST;
    double least = -1.0;
    for (int n = 16; n <= NODES && !(least > 0.5); n *= 2) least = fill_sign_table(plan, n);
    dd rate[3];
    for (int i = 0; i < 3; i++) rate[i] = dd_half(w->rate[i]);
    for (int j = 0; j < 2; j++)
        rate[2] = dd_add(rate[2], dd_scale(0.5 * plan->half_turns[j], rate[j]));
    for (int i = 0; i < 3; i++) plan->torus.turn[i] = make_phase(rate[i]);
    for (int j = 0; j < 2; j++)
        set_initial_phase(&plan->torus.turn[j], dd_times(0.5 * w->start[j], turns_per_radian()));
    set_initial_phase(&plan->torus.turn[2], dd_of(0.0));
    return least;
}
/* Numbers of points of the torus at which the closed form is tested. If the error at FEW_POINTS
 * points exceeds KR_TORUS_ROUNDING (torus.h), MANY_POINTS points are tested. */
enum { FEW_POINTS = 16, MANY_POINTS = 64 };
/* Returns the largest error of the closed form (find_taylor_error) at this number of points. */
static double find_error_of_closed_form(const kr_kowalewski_plan *plan, int points)
{
    double miss = 0.0;
    for (int i = 1; i <= points; i++) {
        /* Multiples of two irrational numbers fill the torus evenly. */
        dd phase[3] = {dd_of(fraction_of_turns(0.7548776662466927 * i)),
                       dd_of(fraction_of_turns(0.5698402909980532 * i)), dd_of(0.0)};
        const body_view now =
            find_rates_and_axes(&kowalewski, kowalewski_state_at_phases(plan, 0.0, phase));
        const double span = choose_taylor_span(&now);
        for (int j = 0; j < 3; j++) {
            const kr_phase *p = &plan->torus.turn[j];
            phase[j] = dd_add(phase[j], dd_times(span, dd_make(p->fast, p->slow)));
        }
        const kr_state later = kowalewski_state_at_phases(plan, 0.0, phase);
        miss = fmax(miss, find_taylor_error(&kowalewski, now, span, later));
    }
    return miss;
}
static kr_refusal make_plan(void *memory, torus_start *start, torus_units *way, double *certificate)
{
    kowalewski_work *w = memory;
    kr_kowalewski_plan *plan = &w->plan;
    const dd *m = start->momentum, *up = start->up,
             state[6] = {dd_half(m[0]), dd_half(m[1]), m[2], up[0], up[1], up[2]};
    const kr_refusal refusal = prepare_closed_form(state, start->vertical, w);
    if (refusal != KR_REFUSAL_NONE) return refusal;
    if (!(complete_plan_and_test_signs(w) > 0.25)) return KR_REFUSAL_SEPARATRIX;
    const kr_quat q = way->attitude, at = kowalewski_state_after_span(plan, 0.0, dd_of(0.0)).q;
    const cx alpha = cx_mul(cx_of(q.w, q.z), cx_of(at.w, -at.z)),
             beta = cx_mul(cx_of(q.x, q.y), cx_of(at.x, -at.y)), both = cx_add(alpha, beta);
    set_initial_phase(&plan->torus.turn[2], argument_in_turns(both.im, both.re));
    const kr_state now = kowalewski_state_after_span(plan, 0.0, dd_of(0.0));
    double error = fmax(find_state_error(now, q, v3(m[0].hi, m[1].hi, m[2].hi)),
                        find_error_of_closed_form(plan, FEW_POINTS));
    if (error > KR_TORUS_ROUNDING)
        error = fmax(error, find_error_of_closed_form(plan, MANY_POINTS));
    /* The last argument is the effect of the errors of the frequencies after 1000 radians. */
    *certificate = fmax(fmax(error, KR_TORUS_ROUNDING), 1e3 * w->separatrix);
    return KR_REFUSAL_NONE;
}
static kr_status plan_scene(const kr_scene *scene, int own, double bound, void *memory,
                            kr_exact_info *info)
{
    return plan_torus(scene, own, bound, &kowalewski, make_plan, memory, info);
}
static kr_state kowalewski_state(const void *plan, double t)
{
    return evaluate_torus(kowalewski_state_after_span, plan, t);
}
static kr_state kowalewski_state_at_angles(const void *memory, double first, double second)
{
    const kr_kowalewski_plan *plan = memory;
    const kr_torus *torus = &plan->torus;
    const dd phase[3] = {dd_of(fraction_of_turns(first)), dd_of(fraction_of_turns(second)),
                         find_torus_phase(torus, 2, dd_of(0.0))};
    return kowalewski_state_at_phases(plan, torus->begin, phase);
}
static size_t used_size(const void *memory)
{
    const kr_kowalewski_plan *plan = memory;
    return offsetof(kr_kowalewski_plan, harmonic) + (size_t)plan->terms * sizeof *plan->harmonic +
           4 * (size_t)(plan->nodes * plan->nodes);
}
const kr_exact_scalar KR_NAME(kr_kowalewski_scalar) = {
    sizeof(kr_kowalewski_plan), sizeof(kowalewski_work),   used_size, NULL, plan_scene,
    kowalewski_state,           kowalewski_state_at_angles};
