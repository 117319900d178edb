/* Set-up of the closed-form solution for a Kowalewski top. This file is compiled once for each
 * instruction set, because double-double products are three times as fast with fused
 * multiply-add. */
#include "kowalewski_curve.h"

/* For tops with a larger k, most states need derivatives (frame_at). */
#define FAST 9.0
static const torus_kind kowalewski = {KR_KIND_KOWALEWSKI, 2.0, 1.0, -1.0};

/* The state p, q, r, g1, g2, g3 and the constant l = <m, e3> of a top, in the notation of
 * kowalewski_curve.h. */
typedef struct kowalewski_top {
    dd state[6], l;
} kowalewski_top;

/* Intermediate results of the set-up. */
typedef struct kowalewski_work {
    kowalewski_curve curve;
    kowalewski_arc arc[2];
    cosine_table table;
    samples samples[2];
    kowalewski_rates rates;
    double start[2];   /* theta1 and theta2 at the start */
    double separatrix; /* see separatrix_error */
} kowalewski_work;

/* Returns 1 if the initial values of Kowalewski's variables w1 and w2 lie on the arcs. The arc of
 * w1 ends at k, and the arc of w2 ends at the smallest real branch point. The choice of these end
 * points was confirmed for 1e6 random tops (docs/theory/closed_form.md), but has not been
 * proved. */
static int is_on_arcs(const kowalewski_curve *o, const dd state[6])
{
    const double slack = 1e-12;
    dd w[2];
    find_variables(o, state[0], state[1], w);
    const dd low = real_root(o, o->real - 2), least = real_root(o, 0);
    return o->order[o->real - 1] == ROOT_K &&
           dd_sub(w[0], low).hi >= -slack * (1.0 + fabs(low.hi)) &&
           dd_sub(least, w[1]).hi >= -slack * (1.0 + fabs(least.hi));
}
/* Returns root i minus root j. */
static cx root_minus_root(const kowalewski_curve *o, int i, int j)
{
    const cdd a = root_dd(o, i), b = root_dd(o, j);
    const int pi = o->pair && i == 2 ? 1 : i, pj = o->pair && j == 2 ? 1 : j;
    return cx_of(root_difference(o, pi, pj).hi, dd_sub(a.im, b.im).hi);
}
/* Returns the relative error of the distance between two branch points. If two roots of phi are
 * nearly equal, only about half of their digits are accurate. */
static double distance_error(const kowalewski_curve *o, int i, int j)
{
    const double size = 1.0 + o->k.hi, distance = cx_abs(root_minus_root(o, i, j)) / size,
                 digits = 1e-31;
    return i < ROOT_K && j < ROOT_K ? digits / (distance * distance) : digits / distance;
}
/* Returns the largest relative error of the distances between branch points of F. The frequencies
 * of the motion depend on the logarithms of these distances. The distances considered are the
 * widths of the gaps next to the arcs, and the separation of two complex roots close to an arc. */
static double separatrix_error(const kowalewski_curve *o)
{
    const int top = o->real - 2;
    double most = fmax(distance_error(o, o->order[top], o->order[top - 1]),
                       distance_error(o, o->order[0], o->order[1]));
    if (o->pair) {
        const double re = o->root[1].hi;
        if ((re > real_root(o, top).hi && re < o->k.hi) || re < real_root(o, 0).hi)
            most = fmax(most, distance_error(o, 1, 2));
    }
    return most;
}
/* Returns the smallest distance between two branch points, divided by 1 + k. For two nearly equal
 * roots, the distance is replaced by `resolution` of close_roots, a measure of the cancellation. */
static double least_distance(const kowalewski_curve *o)
{
    double least = INFINITY;
    for (int i = 0; i < ROOTS; i++)
        for (int j = 0; j < i; j++) {
            const close_roots r = examine_roots(o, i, j);
            least = fmin(least, r.apply ? r.resolution
                                        : cx_abs(root_minus_root(o, i, j)) / (1.0 + o->k.hi));
        }
    return least;
}
/* Returns the reason for rejecting a degenerate motion, or `refusal` if no specific reason applies.
 * The tests for degenerate motions tolerate rounding errors in the initial state. */
static kr_refusal find_kowalewski_degeneracy(const kowalewski_top *top, kr_refusal refusal)
{
    const double p = top->state[0].hi, q = top->state[1].hi, r = top->state[2].hi,
                 g1 = top->state[3].hi, g2 = top->state[4].hi, g3 = top->state[5].hi,
                 size = 1.0 + v_largest(v3(p, q, r)), slack = 1e-13 * size;
    const kr_vec3 w = v3(p, q, r), slope = v3(q * r, -p * r - g3, g2);
    if (v_largest(slope) < 1e-8 && v_largest(w) < 1e-8) return KR_REFUSAL_REST;
    if (v_largest(slope) < slack * size && v_largest(v_cross(v3(g1, g2, g3), w)) < slack)
        return KR_REFUSAL_ROTATION;
    if (v_largest(v3(p, q, g3 * size)) < slack || v_largest(v3(p, r, g2 * size)) < slack)
        return KR_REFUSAL_PLANAR;
    return refusal;
}
static void fill_arc(const kowalewski_curve *o, const kowalewski_arc *from, kr_kowalewski_arc *to)
{
    const int infinite = from->low == AT_INFINITY;
    const double way = infinite ? -1.0 : 1.0;
    const dd edge = infinite ? dd_neg(from->A) : from->C;
    to->A = from->A.hi, to->B = from->B.hi, to->C = from->C.hi, to->E = from->E.hi;
    to->low = from->low;
    to->high = from->high;
    to->scale = dd_sqrt(dd_half(dd_mul(edge, from->E))).hi;
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
                  b = cdd_of(dd_scale(way, from->b[1]), dd_mul(im, from->E)), apart = cdd_sub(a, b),
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
    if (o->c.hi > 0.0) return;
    heading_pole pole[2];
    const int poles = find_heading_poles(o, from, pole);
    for (int i = 0; i < poles; i++) {
        if (!pole[i].adjacent) continue;
        const dd a = dd_sqrt(dd_abs(pole[i].a));
        to->pole_a[to->poles] = o->l.hi < 0.0 ? -a.hi : a.hi;
        to->pole_b[to->poles++] = dd_sqrt(dd_abs(pole[i].b)).hi;
    }
    const dd w0 = dd_sqrt(dd_neg(o->c));
    for (int i = 0; i < 2; i++) {
        const dd w = i ? dd_neg(w0) : w0;
        to->both_a[i] =
            infinite ? from->A.hi : dd_mul(from->C, root_minus_pole(o, from->low, w)).hi;
        to->both_b[i] = root_minus_pole(o, from->high, w).hi;
    }
}
/* Writes the values of a function of e at the roots e1 and e2. */
static void fill_pair(const kowalewski_curve *o, cdd one, cdd two, double out[2])
{
    out[0] = one.re.hi;
    out[1] = o->pair ? one.im.hi : two.re.hi;
}
static void fill_roots(const kowalewski_curve *o, kr_kowalewski_torus *plan)
{
    const cdd first = cdd_sub(root_dd(o, 0), root_dd(o, 1)),
              second = cdd_sub(root_dd(o, 0), root_dd(o, 2));
    cdd A[3], B[3];
    for (int i = 0; i < 3; i++) {
        const cdd e = root_dd(o, i), l = cdd_real(o->l);
        A[i] = cdd_sqrt(cdd_scale(dd_of(2.0), cdd_add(e, cdd_real(o->h))));
        B[i] = cdd_sqrt(cdd_add(cdd_mul(e, e), cdd_real(o->c)));
        if (cdd_abs_square(A[i]).hi > cdd_abs_square(B[i]).hi)
            B[i] = cdd_div(l, A[i]);
        else if (cdd_abs_square(B[i]).hi > 0.0)
            A[i] = cdd_div(l, B[i]);
    }
    const dd square = dd_square(A[0].re);
    plan->l = o->l.hi, plan->c = o->c.hi, plan->k = o->k.hi;
    plan->pair = o->pair;
    plan->A0 = A[0].re.hi, plan->B0 = B[0].re.hi;
    fill_pair(o, A[1], A[2], plan->A);
    fill_pair(o, B[1], B[2], plan->B);
    fill_pair(o, cdd_mul(A[1], A[1]), cdd_mul(A[2], A[2]), plan->A_square);
    fill_pair(o, cdd_mul(B[1], B[1]), cdd_mul(B[2], B[2]), plan->B_square);
    /* The sum of the roots is -h, and A^2 = 2 (e + h). */
    plan->sum = -0.5 * square.hi;
    plan->apart = o->pair ? 2.0 * o->root[2].hi : dd_sub(o->root[1], o->root[2]).hi;
    plan->one_apart = 1.0 / plan->apart;
    plan->middle = dd_add(o->root[0], dd_scale(0.25, square)).hi;
    plan->one_product = 1.0 / cdd_mul(first, second).re.hi;
}
/* Finds the signs of Koetter's square roots, one for each root of phi, one for each arc and one for
 * Z (frame_at), with which his formulas reproduce a state. They are constant during the motion;
 * only one combination should reproduce p, q, r and g3. Returns the error for the best one. */
static double find_signs(kr_kowalewski_torus *plan, const start_point point[2], const dd state[6])
{
    arc_point at[2];
    double best = INFINITY, sign[6] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    const double p = state[0].hi, q = state[1].hi, r = state[2].hi, g3 = state[5].hi,
                 size = fmax(1.0, v_largest(v3(p, q, r)));
    for (int j = 0; j < 2; j++) {
        const double s = point[j].s, c = point[j].c;
        at[j] = point_at(&plan->arc[j], plan->pair, (half_angle){s, c, c * c - s * s}, 0.0);
    }
    for (int all = 0; all < 32; all++) {
        for (int i = 0; i < 5; i++) plan->sign[i] = all >> i & 1 ? -1.0 : 1.0;
        if (plan->pair && plan->sign[1] != plan->sign[2]) continue;
        const koetter_state s = evaluate_koetter(plan, plan->pair, &at[0], &at[1]);
        const double miss =
            fmax(v_largest(v3(s.p.v - p, s.q.v - q, s.r.v - r)) / size, fabs(s.g3.v - g3));
        if (!(miss < best)) continue;
        best = miss;
        memcpy(sign, plan->sign, sizeof sign);
    }
    /* For the right sign of Im Z, xi = x^2 + g1 + i g2 has the argument of z^2 conj(Z^2). */
    const cx x = cx_of(p, q), xi = cx_add(cx_mul(x, x), cx_of(state[3].hi, state[4].hi)),
             z = cx_add(cx_scale(r, x), cx_of(g3, 0.0)),
             Z = cx_of(at[0].plus.v * at[1].plus.v, at[0].minus.v * at[1].minus.v),
             rest = cx_mul(cx_mul(z, z), cx_of(xi.re, -xi.im)), square = cx_mul(Z, Z),
             one = cx_mul(rest, cx_of(square.re, -square.im)), other = cx_mul(rest, square);
    sign[5] = one.re - fabs(one.im) >= other.re - fabs(other.im) ? 1.0 : -1.0;
    memcpy(plan->sign, sign, sizeof sign);
    return best;
}
/* Computes all quantities that determine the plan: roots, arcs, series, rates, signs and angles.
 * Returns KR_REFUSAL_NONE on success, or the reason for the failure. */
static kr_refusal analyse_curve(const kowalewski_top *top, kowalewski_work *w,
                                kr_kowalewski_torus *plan)
{
    kowalewski_curve *o = &w->curve;
    set_constants(o, top->state, top->l);
    /* Relative to a larger h, k^2 and -c = k^2 - 1 coincide. */
    if (!(fabs(o->h.hi) < 1e12)) return KR_REFUSAL_COINCIDENT;
    find_roots(o);
    w->separatrix = separatrix_error(o);
    if (!(w->separatrix < 1e-14)) return KR_REFUSAL_SEPARATRIX;
    const double distance = least_distance(o);
    if (!(distance > 1e-24)) return KR_REFUSAL_COINCIDENT;
    /* The formulas for the initial state contain divisions by the distances between branch
     * points. */
    const int unresolved = distance < 1e-12;
    if (!is_on_arcs(o, top->state)) return unresolved ? KR_REFUSAL_COINCIDENT : KR_REFUSAL_START;
    make_arcs(o, w->arc);
    if (!average_arcs(o, w->arc, &w->table, w->samples, &w->rates)) return KR_REFUSAL_INTEGRALS;
    fill_roots(o, plan);
    for (int j = 0; j < 2; j++) fill_arc(o, &w->arc[j], &plan->arc[j]);
    start_point point[2];
    dd state[6];
    const double mismatch = find_start(o, w->arc, &w->rates, top->state, point, state, w->start);
    const int is_known = mismatch < 1e-13;
    if (is_known && find_signs(plan, point, state) < 1e-6) return KR_REFUSAL_NONE;
    return unresolved                    ? KR_REFUSAL_COINCIDENT
           : !is_known && mismatch < 1.0 ? KR_REFUSAL_SEPARATRIX
                                         : KR_REFUSAL_START;
}
/* Returns the smallest number of terms, a multiple of four, such that all later terms are at
 * most `least`. */
static int count_terms(const kowalewski_arc arc[2], int series, double least)
{
    int terms = 4;
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < series; i++)
            for (int k = arc[j].points - 1; k > terms; k--)
                if (fabs(arc[j].sine[i][k]) > least) terms = (k + 3) / 4 * 4;
    return terms;
}
static void fill_series(const kowalewski_arc arc[2], kr_kowalewski_torus *plan)
{
    plan->some_terms = count_terms(arc, 2, 1e-9);
    plan->terms = count_terms(arc, 3, 1e-18);
    for (int k = 1; k <= plan->terms; k++) {
        kr_harmonic *to = &plan->harmonic[k - 1];
        for (int j = 0; j < 2; j++) {
            const int has = k < arc[j].points;
            for (int i = 0; i < 2; i++) to->angle[2 * j + i] = has ? arc[j].sine[i][k] : 0.0;
            to->heading[2 + j] = 0.0;
            to->heading[j] = has ? arc[j].sine[2][k] / (2.0 * two_pi) : 0.0;
        }
    }
}
/* Fills the table that starts Newton's method. Each entry is found from the one before. */
static void fill_start_table(kr_kowalewski_torus *plan)
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
                for (int n = 0; n < 2; n++) y[n] = angle_plus_radians(theta[n], d[n]);
                size = newton_step(plan, plan->some_terms, y, d, &unused, step);
                for (int n = 0; n < 2; n++) d[n] -= step[n];
            }
            for (int n = 0; n < 2; n++) plan->guess[i][j][n] = (float)d[n];
        }
}
static double dot_of_nodes(const signed char a[4], const signed char b[4])
{
    int dot = 0;
    for (int i = 0; i < 4; i++) dot += a[i] * b[i];
    return dot / (127.0 * 127.0);
}
/* Fills the table of signs with quaternions that change continuously from node to node. Determines
 * whether they change their sign when an angle grows by two turns. Returns the smallest scalar
 * product of neighbours. */
static double fill_sign_table(kr_kowalewski_torus *plan, int n)
{
    signed char *const node = (signed char *)(plan->harmonic + plan->terms);
    arc_angle angle[NODES];
    double least = 1.0;
    plan->nodes = n;
    for (int i = 0; i < n; i++) angle[i] = angle_plus_radians(dd_of(first_node + 2.0 * i / n), 0.0);
    for (int i = 0; i < n * n; i++) {
        const arc_angle y[2] = {angle[i / n], angle[i % n]};
        const frame_state f = find_frame(plan, y);
        const kr_quat q = quaternion_of(&f);
        const double part[4] = {q.w, q.x, q.y, q.z};
        signed char *to = node + 4 * i, *before = to - 4 * (i % n > 0 ? 1 : i > 0 ? n : 0);
        for (int k = 0; k < 4; k++)
            to[k] = (signed char)(fabs(part[k]) <= 1.0 ? nearest(127.0 * part[k]) : 0.0);
        if (dot_of_nodes(before, to) < 0.0)
            for (int k = 0; k < 4; k++) to[k] = (signed char)-to[k];
    }
    const int corner[2] = {n * (n - 1), n - 1};
    for (int j = 0; j < 2; j++)
        plan->half_turns[j] = dot_of_nodes(node + 4 * corner[j], node) < 0.0;
    for (int i = 0; i < n * n; i++) {
        const int one = (i + n) % (n * n), two = (i + 1) % n + i / n * n;
        const double across = dot_of_nodes(node + 4 * i, node + 4 * one),
                     along = dot_of_nodes(node + 4 * i, node + 4 * two);
        least = fmin(least, one < i && plan->half_turns[0] != 0.0 ? -across : across);
        least = fmin(least, two < i && plan->half_turns[1] != 0.0 ? -along : along);
    }
    return least;
}
/* Sets the rates of the phases, and the initial values of the two torus angles. */
static void set_torus_phases(const kowalewski_work *w, kr_kowalewski_torus *plan)
{
    dd rate[3] = {dd_half(w->rates.rate[0]), dd_half(w->rates.rate[1]), dd_half(w->rates.heading)};
    for (int j = 0; j < 2; j++)
        rate[2] = dd_add(rate[2], dd_scale(0.5 * plan->half_turns[j], rate[j]));
    for (int i = 0; i < 3; i++) {
        plan->torus.turn[i] = phase_of(rate[i]);
        phase_start(&plan->torus.turn[i],
                    i < 2 ? dd_times(0.5 * w->start[i], one_turn()) : dd_of(0.0));
    }
}
/* Fills the plan, except for the initial phase of the heading and the certificate. Returns the
 * smallest scalar product of quaternions of neighbouring nodes. If it exceeds 1/4, each quaternion
 * of the motion is less than a right angle from the nearest node, so that the node determines the
 * sign of the quaternion. */
static double fill_plan(const kowalewski_work *w, kr_kowalewski_torus *plan)
{
    const kowalewski_curve *o = &w->curve;
    const dd base = dd_half(dd_add(real_root(o, o->real - 2), real_root(o, 0)));
    for (int j = 0; j < 2; j++) {
        const kowalewski_arc *arc = &w->arc[j];
        plan->p[j] = arc->p.hi;
        plan->q[j] = dd_sub(arc->q, dd_mul(base, arc->p)).hi;
    }
    fill_series(w->arc, plan);
    fill_start_table(plan);
    plan->fast = plan->k > FAST;
    double least = -1.0;
    for (int n = 16; n <= NODES && !(least > 0.5); n *= 2) least = fill_sign_table(plan, n);
    set_torus_phases(w, plan);
    return least;
}
/* Numbers of points on the torus at which a solution is tested. The solution is tested at
 * FEW_POINTS points. If an error exceeds KR_TORUS_ROUNDING, it is tested at MANY_POINTS points. */
enum { FEW_POINTS = 16, MANY_POINTS = 64 };

/* A closed-form solution and the intermediate results of its set-up. */
typedef struct kowalewski_memory {
    kr_kowalewski_torus plan;
    kowalewski_work work;
} kowalewski_memory;

/* Sets the initial phase of the heading from the initial attitude `q`. */
static void set_heading_phase(kr_kowalewski_torus *plan, kr_quat q)
{
    const kr_quat at = kowalewski_kernel(plan, 0.0, dd_of(0.0)).q;
    const cx alpha = cx_mul(cx_of(q.w, q.z), cx_of(at.w, -at.z)),
             beta = cx_mul(cx_of(q.x, q.y), cx_of(at.x, -at.y)), both = cx_add(alpha, beta);
    phase_start(&plan->torus.turn[2], turns_of(both.im, both.re));
}
/* Returns the largest error of the closed form at `points` points of the torus. The error is
 * the difference between the closed form after a short time and a Taylor series that starts
 * from the closed form. */
static double largest_error_on_torus(const kr_kowalewski_torus *plan, int points)
{
    double miss = 0.0;
    for (int i = 1; i <= points; i++) {
        /* The points are multiples of two irrational numbers, so that they fill the torus
         * evenly. */
        dd phase[3] = {dd_of(fraction_of_turns(0.7548776662466927 * i)),
                       dd_of(fraction_of_turns(0.5698402909980532 * i)), dd_of(0.0)};
        const body_view now = view_top(&kowalewski, kowalewski_kernel_at(plan, 0.0, phase));
        const double span = short_span(&now);
        for (int j = 0; j < 3; j++) {
            const kr_phase *p = &plan->torus.turn[j];
            phase[j] = dd_add(phase[j], dd_times(span, dd_make(p->fast, p->slow)));
        }
        const kr_state later = kowalewski_kernel_at(plan, 0.0, phase);
        miss = fmax(miss, error_after_span(&kowalewski, now, span, later));
    }
    return miss;
}
/* Computes the closed-form solution in internal units. Returns KR_REFUSAL_NONE, or the reason
 * for the failure. */
static kr_refusal make_plan(kowalewski_memory *memory, const kowalewski_top *top, kr_quat attitude,
                            double *certificate)
{
    kr_kowalewski_torus *plan = &memory->plan;
    const kr_refusal refusal = analyse_curve(top, &memory->work, plan);
    if (refusal != KR_REFUSAL_NONE) return refusal;
    if (!(fill_plan(&memory->work, plan) > 0.25)) return KR_REFUSAL_SEPARATRIX;
    set_heading_phase(plan, attitude);
    const kr_state start = kowalewski_kernel(plan, 0.0, dd_of(0.0));
    const kr_vec3 momentum = v3(2.0 * top->state[0].hi, 2.0 * top->state[1].hi, top->state[2].hi);
    double error =
        fmax(error_of_state(start, attitude, momentum), largest_error_on_torus(plan, FEW_POINTS));
    if (error > KR_TORUS_ROUNDING) error = fmax(error, largest_error_on_torus(plan, MANY_POINTS));
    /* The last argument of fmax is the effect of the frequency errors after 1000 radians. It
     * matters only near separatrices, where a rounding error of the start changes the motion far
     * more. */
    *certificate = fmax(fmax(error, KR_TORUS_ROUNDING), 1e3 * memory->work.separatrix);
    return KR_REFUSAL_NONE;
}
static kr_status plan_scene(const kr_scene *scene, int own, double bound, void *space,
                            kr_exact_info *info)
{
    kowalewski_memory *memory = space;
    kr_kowalewski_torus *plan = &memory->plan;
    kowalewski_top top;
    torus_start start;
    torus_units way;
    const kr_status status =
        read_torus_scene(scene, own, &kowalewski, &info->refusal, &start, &way);
    if (status != KR_OK) return status;
    for (int i = 0; i < 3; i++) {
        top.state[i] = dd_scale(i < 2 ? 0.5 : 1.0, start.momentum[i]);
        top.state[3 + i] = start.up[i];
    }
    top.l = start.vertical;
    begin_torus(&plan->torus);
    info->refusal = make_plan(memory, &top, way.attitude, &info->certificate);
    if (info->refusal != KR_REFUSAL_NONE) {
        info->refusal = find_kowalewski_degeneracy(&top, info->refusal);
        return KR_ERR_METHOD;
    }
    torus_to_user(&plan->torus, &way, scene->start.t, own);
    torus_info(&plan->torus, 1.0, info);
    if (info->certificate <= bound) return KR_OK;
    info->refusal = find_kowalewski_degeneracy(&top, KR_REFUSAL_CERTIFICATE);
    return KR_ERR_METHOD;
}
static kr_state kowalewski_state(const void *memory, double t)
{
    const kr_kowalewski_torus *plan = memory;
    const kr_state none = {t, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    return isfinite(t) ? kowalewski_kernel(plan, t, torus_span(&plan->torus, t)) : none;
}
static kr_state kowalewski_state_at(const void *memory, double first, double second)
{
    const kr_kowalewski_torus *plan = memory;
    const kr_torus *torus = &plan->torus;
    const dd phase[3] = {dd_of(fraction_of_turns(first)), dd_of(fraction_of_turns(second)),
                         torus_phase_at(torus, 2, dd_of(0.0))};
    return kowalewski_kernel_at(plan, torus->begin, phase);
}
static size_t used_size(const void *memory)
{
    const kr_kowalewski_torus *plan = memory;
    return offsetof(kr_kowalewski_torus, harmonic) + (size_t)plan->terms * sizeof *plan->harmonic +
           4 * (size_t)(plan->nodes * plan->nodes);
}
static int suits_any(const kr_scene *scene) { return (void)scene, 1; }
const kr_exact_scalar KR_NAME(kr_kowalewski_scalar) = {sizeof(kr_kowalewski_torus),
                                                       sizeof(kowalewski_memory),
                                                       used_size,
                                                       suits_any,
                                                       plan_scene,
                                                       kowalewski_state,
                                                       kowalewski_state_at};
