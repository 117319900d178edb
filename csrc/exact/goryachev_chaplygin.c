/* Set-up of the closed-form solution for a Goryachev-Chaplygin top. This file is compiled once for
 * each instruction set, because double-double products are three times as fast with fused
 * multiply-add. */
#include "across.h"
#include "goryachev_chaplygin_series.h"
#include "math/trig.h"

/* A closed-form solution and the intermediate results of its set-up. */
typedef struct chaplygin_memory {
    kr_chaplygin_plan plan;
    chaplygin_curve curve;
    series_work work;
} chaplygin_memory;

/* The initial state and Chaplygin's variables of a top, in the notation of
 * goryachev_chaplygin_curve.h. */
typedef struct chaplygin_top {
    dd L[3], g[3], u[2];
    cdd root[2];
} chaplygin_top;

/* Sets H and G. Makes G nonnegative by a rotation through pi about the first axis if necessary.
 * Returns 1 if the axes were rotated, and 0 otherwise. */
static int set_integrals(chaplygin_top *y, chaplygin_curve *o)
{
    const dd across = dd_add(dd_square(y->L[0]), dd_square(y->L[1]));
    o->H = dd_add(dd_half(dd_add(across, dd_scale(4.0, dd_square(y->L[2])))), y->g[0]);
    o->G = dd_sub(dd_mul(y->L[2], across), dd_mul(y->L[0], y->g[2]));
    if (o->G.hi >= 0.0) return 0;
    o->G = dd_neg(o->G);
    for (int i = 1; i < 3; i++) {
        y->L[i] = dd_neg(y->L[i]);
        y->g[i] = dd_neg(y->g[i]);
    }
    return 1;
}
/* Computes Chaplygin's separation variables u1 and u2, and for each of them a square root of |u|
 * exp(i chi). With A(u) = g1 u - L1 g3/2 and C(u) = -g2 u + L2 g3/2, A + i C = u exp(i chi). The
 * sign of the second square root follows from L1 - i L2 = -2i * product of the two square roots. */
static void separate(chaplygin_top *y)
{
    const dd square = dd_times(0.25, dd_add(dd_square(y->L[0]), dd_square(y->L[1]))),
             half = dd_half(y->L[2]), root = dd_sqrt(dd_add(dd_square(half), square));
    if (half.hi >= 0.0) {
        y->u[0] = dd_add(half, root);
        y->u[1] = dd_neg(dd_div(square, y->u[0]));
    } else {
        y->u[1] = dd_sub(half, root);
        y->u[0] = dd_neg(dd_div(square, y->u[1]));
    }
    for (int j = 0; j < 2; j++) {
        const dd A = dd_sub(dd_mul(y->g[0], y->u[j]), dd_half(dd_mul(y->L[0], y->g[2]))),
                 C = dd_sub(dd_half(dd_mul(y->L[1], y->g[2])), dd_mul(y->g[1], y->u[j]));
        y->root[j] = cdd_sqrt(j ? cdd_of(dd_neg(A), dd_neg(C)) : cdd_of(A, C));
    }
    const cdd product = cdd_mul(y->root[0], y->root[1]);
    /* -2i times the product, times the conjugate of L1 - i L2 */
    if (product.im.hi * y->L[0].hi + product.re.hi * y->L[1].hi < 0.0)
        y->root[1] = cdd_neg(y->root[1]);
}
/* Pads the Fourier series in the two torus angles with zeros to equal lengths. */
static void equalise_series(kr_angle_series angle[2])
{
    int parts = 0, times = 0;
    for (int j = 0; j < 2; j++) {
        if (angle[j].times > times) times = angle[j].times;
        for (int i = 0; i < 2; i++)
            if (angle[j].count[i] > parts) parts = angle[j].count[i];
    }
    for (int j = 0; j < 2; j++) {
        kr_angle_series *e = &angle[j];
        for (; e->times < times; e->times++) e->time[e->times] = e->time_rate[e->times] = 0.0;
        for (int i = 0; i < 2; i++)
            while (e->count[i] < parts) e->part[i][e->count[i]++] = 0.0;
    }
}
/* Returns, in turns, half of the initial torus angle that corresponds to the separation variable u.
 * Writes the periodic part of the time, evaluated at the initial torus angle, to `time`. Writes
 * the signs of c and s between the torus angles 0 and pi that match the initial state to `signs`,
 * and applies them to the Fourier coefficients in `e`. */
static dd start_angle(const chaplygin_curve *o, const chaplygin_arc *arc, dd u, cdd root,
                      kr_angle_series *e, double signs[2], double *time)
{
    const dd up = dd_max(dd_sub(arc->B, u), dd_of(0.0)),
             down = dd_max(dd_sub(dd_mul(u, arc->C), arc->A), dd_of(0.0)), both = dd_add(up, down);
    const double sign = root.re.hi * root.im.hi > 0.0 ? -1.0 : 1.0,
                 s = sign * dd_sqrt(dd_div(up, both)).hi, c = dd_sqrt(dd_div(down, both)).hi,
                 sine = 2.0 * s * c, cosine = c * c - s * s;
    double half[2];
    arc_halves(o, arc, s, c, half);
    const int first = fabs(root.re.hi) > fabs(root.im.hi);
    const double one = first ? half[0] * root.re.hi : -half[1] * root.im.hi;
    signs[0] = one < 0.0 ? -1.0 : 1.0;
    signs[1] = -signs[0];
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < e->count[k]; i++) e->part[k][i] *= signs[k];
    *time = arc_time(arc, sine, cosine);
    return dd_add(turns_of(s, c),
                  dd_times(0.5 * (sum_arc_sines(arc, 0, sine, cosine) / arc->p.hi), one_turn()));
}
/* Returns the smallest value of |m|: the distance between the arcs of u1 and u2. */
static double least_momentum(const chaplygin_curve *o, const chaplygin_arc arc[2])
{
    return dd_sub(o->root[arc[0].low], o->root[arc[1].high]).hi;
}
/* Sets the bounds and tolerances of Newton's method for the periodic part of the rescaled time
 * tau. */
static void set_slip_search(const chaplygin_curve *o, const chaplygin_arc arc[2],
                            kr_chaplygin_plan *plan)
{
    static const double rest[GUESSES] = {1e-2, 1e-4, 1e-7};
    const kr_angle_series *const e = plan->angle;
    const double rate = fmax(e[0].rate, e[1].rate), least = least_momentum(o, arc);
    double bound = 0.0, bend = 0.0;
    int step = GUESSES - 1;
    for (int k = e[0].times - 1; k > 0; k--) {
        bound += fabs(e[0].time[k]) + fabs(e[1].time[k]);
        for (int j = 0; j < 2; j++) bend += k * fabs(e[j].time_rate[k]) * e[j].rate * e[j].rate;
        for (; step >= 0 && bound * rate > rest[step] * plan->mean; step--)
            plan->guess_terms[step] = k + 1 + (k + 1) % 2;
    }
    for (; step >= 0; step--) plan->guess_terms[step] = 0;
    plan->most_slip = 1.01 * bound / plan->mean;
    plan->rounding = 0x1p-53 / rate;
    plan->tolerance = sqrt(0.25 * plan->rounding * (2.0 * least / bend));
}
/* Sets the rates of the two torus angles with respect to tau and to time. */
static void set_angle_rates(kr_chaplygin_plan *plan, const chaplygin_arc arc[2], dd rate[2])
{
    const dd det = dd_add(dd_mul(arc[0].p, arc[1].q), dd_mul(arc[1].p, arc[0].q));
    plan->mean = dd_div(det, dd_mul(arc[0].p, arc[1].p)).hi;
    plan->tau_rate = 1.0 / plan->mean;
    for (int j = 0; j < 2; j++) {
        kr_angle_series *e = &plan->angle[j];
        rate[j] = dd_div(dd_of(1.0), arc[j].p);
        e->rate = rate[j].hi;
        e->half_turns = 0.5 * dd_mul(rate[j], one_turn()).hi;
        plan->torus.turn[j] = phase_of(dd_half(dd_div(arc[1 - j].p, det)));
    }
}
/* Sets the initial values of the mean angles and of the periodic part of the rescaled time tau. A
 * mean angle grows at a constant rate with time, unlike the true angle. */
static void set_start(kr_chaplygin_plan *plan, const dd half[2], const double time[2])
{
    plan->slip = -(time[0] + time[1]) / plan->mean;
    for (int j = 0; j < 2; j++)
        phase_start(&plan->torus.turn[j],
                    dd_sub(half[j], dd_of(plan->slip * plan->angle[j].half_turns)));
}
/* Returns 1 if the top swings like a plane pendulum about its second or third axis, up to rounding
 * errors. */
static int is_planar(const chaplygin_top *y)
{
    const kr_vec3 L = v3(y->L[0].hi, y->L[1].hi, y->L[2].hi);
    const double size = 1.0 + v_largest(L), slack = 1e-13 * size;
    return v_largest(v3(L.x, L.y, y->g[2].hi * size)) < slack ||
           v_largest(v3(L.x, L.z, y->g[1].hi * size)) < slack;
}
/* Returns the reason for rejecting a degenerate motion, or `refusal` if no specific reason
 * applies. */
static kr_refusal name_motion(const chaplygin_top *y, const chaplygin_curve *o, kr_refusal refusal)
{
    const kr_vec3 L = v3(y->L[0].hi, y->L[1].hi, y->L[2].hi);
    const double slack = 1e-8;
    if (v_largest(L) < slack && v_largest(v3(0.0, y->g[1].hi, y->g[2].hi)) < slack)
        return KR_REFUSAL_REST;
    if (is_planar(y)) return KR_REFUSAL_PLANAR;
    return o->G.hi < 1e-9 ? KR_REFUSAL_ZERO : refusal;
}
static kr_refusal make_plan(chaplygin_top *y, chaplygin_memory *m)
{
    chaplygin_curve *o = &m->curve;
    series_work *w = &m->work;
    kr_chaplygin_plan *plan = &m->plan;
    const double least = 1e-24;
    dd rate[2], half[2];
    double time[2];
    int M[2];
    if (!(fabs(o->H.hi) < 1e10)) return KR_REFUSAL_COINCIDENT;
    /* Two branch points coincide at G = 0, where a motion with a slightly larger G is computed
     * instead. The two motions differ by less than rounding errors, unless the motion is planar and
     * unstable. */
    if (o->G.hi < least && is_planar(y)) return KR_REFUSAL_PLANAR;
    if (o->G.hi < least) o->G = dd_of(least);
    const kr_refusal degenerate = find_branch_points(o);
    if (degenerate != KR_REFUSAL_NONE) return degenerate;
    separate(y);
    if (!make_arcs(o, y->u[0], y->u[1], w->arc)) return KR_REFUSAL_START;
    begin_cosines(&w->table);
    for (int j = 0; j < 2; j++)
        if (!average_arc(o, &w->arc[j], &w->table, &w->samples)) return KR_REFUSAL_INTEGRALS;
    w->tail = 0.0;
    for (int j = 0; j < 2; j++)
        if (!make_angle_series(o, w, j, &plan->angle[j])) return KR_REFUSAL_INTEGRALS;
    equalise_series(plan->angle);
    set_angle_rates(plan, w->arc, rate);
    set_slip_search(o, w->arc, plan);
    for (int j = 0; j < 2; j++)
        half[j] =
            start_angle(o, &w->arc[j], y->u[j], y->root[j], &plan->angle[j], w->sign[j], &time[j]);
    const double tail = make_heading_grid(o, w, plan->angle, M);
    if (!(tail < 1e-13)) return KR_REFUSAL_HEADING;
    w->tail = fmax(w->tail, tail);
    plan->is_even = plan->angle[0].is_sine[0] == plan->angle[1].is_sine[1];
    set_start(plan, half, time);
    return fill_heading_rows(plan, w, M, rate, half) ? KR_REFUSAL_NONE : KR_REFUSAL_HEADING;
}
/* Sets the initial heading from the initial attitude `q`. */
static void set_heading(kr_chaplygin_plan *plan, kr_quat q)
{
    const dd mean[2] = {torus_phase_at(&plan->torus, 0, dd_of(0.0)),
                        torus_phase_at(&plan->torus, 1, dd_of(0.0))};
    angle_lanes a[2];
    (void)find_slip(plan, mean, a);
    plan->heading_value = sum_heading(plan, a);
    plan->heading_start = plan->heading_more = 0.0;
    const kr_quat at = chaplygin_kernel(plan, 0.0, dd_of(0.0)).q, turn = q_mul(q, q_conj(at));
    const dd half = turns_of(turn.z, turn.w);
    plan->heading_start = half.hi;
    plan->heading_more = half.lo;
}
enum { SERIES_ORDER = 12 };

/* Computes the Taylor coefficients of the angular momentum and of e3 in the body frame. */
static void expand_top(const chaplygin_top *y, dd c[6][SERIES_ORDER + 1])
{
    for (int i = 0; i < 6; i++) c[i][0] = i < 3 ? y->L[i] : y->g[i - 3];
    for (int n = 0; n < SERIES_ORDER; n++) {
        dd d[6] = {{0.0, 0.0}};
        for (int i = 0; i <= n; i++) {
            const int j = n - i;
            const dd four = dd_scale(4.0, c[2][j]);
            d[0] = dd_add(d[0], dd_times(3.0, dd_mul(c[1][i], c[2][j])));
            d[1] = dd_sub(d[1], dd_times(3.0, dd_mul(c[0][i], c[2][j])));
            d[3] = dd_add(d[3], dd_sub(dd_mul(c[4][i], four), dd_mul(c[5][i], c[1][j])));
            d[4] = dd_add(d[4], dd_sub(dd_mul(c[5][i], c[0][j]), dd_mul(c[3][i], four)));
            d[5] = dd_add(d[5], dd_sub(dd_mul(c[3][i], c[1][j]), dd_mul(c[4][i], c[0][j])));
        }
        d[1] = dd_add(d[1], c[5][n]);
        d[2] = dd_neg(c[4][n]);
        for (int i = 0; i < 6; i++) c[i][n + 1] = dd_div(d[i], dd_of(n + 1.0));
    }
}
static void sum_top(dd c[6][SERIES_ORDER + 1], double span, double out[6])
{
    for (int i = 0; i < 6; i++) {
        dd sum = c[i][SERIES_ORDER];
        for (int n = SERIES_ORDER - 1; n >= 0; n--) sum = dd_add(dd_times(span, sum), c[i][n]);
        out[i] = sum.hi;
    }
}
/* Returns the change in heading between the initial time and `moment`, computed by 5-point Gauss
 * quadrature of L1/|L|^2. */
static double heading_growth(dd c[6][SERIES_ORDER + 1], double moment)
{
    static const double place[5] = {0.04691007703066800, 0.23076534494715845, 0.5,
                                    0.76923465505284155, 0.95308992296933200},
                        weight[5] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444,
                                     0.23931433524968324, 0.11846344252809454};
    double sum = 0.0, y[6];
    for (int i = 0; i < 5; i++) {
        sum_top(c, place[i] * moment, y);
        sum += weight[i] * moment * y[0] / (y[0] * y[0] + (y[1] * y[1] + y[2] * y[2]));
    }
    return sum;
}
/* Returns the largest error of a solution near the initial time, in internal units. The attitude is
 * checked at the initial time only. Shortly after the initial time, the momentum, the vertical and
 * the heading are compared with values computed from Taylor series. */
static double miss_of_plan(const kr_chaplygin_plan *plan, const chaplygin_top *top,
                           kr_quat attitude)
{
    dd series[6][SERIES_ORDER + 1];
    double y[6], miss = 0.0;
    const kr_vec3 L = v3(top->L[0].hi, top->L[1].hi, top->L[2].hi);
    const double size = v_length(L), moment = 0.03125 * fmin(1.0, size) / (1.0 + size);
    kr_state s[2];
    expand_top(top, series);
    for (int i = 0; i < 2; i++) {
        const double t = i * moment;
        s[i] = chaplygin_kernel(plan, t, dd_of(t));
        const kr_vec3 up = q_vertical(s[i].q), m = q_turn_back(s[i].q, s[i].m);
        sum_top(series, t, y);
        miss = fmax(miss, v_length(v_sub(up, v3(y[3], y[4], y[5]))));
        miss = fmax(miss, v_length(v_sub(m, v3(y[0], y[1], y[2]))) / (1.0 + size));
    }
    miss = fmax(miss, kr_attitude_error(s[0].q, attitude));
    const double grown = (s[0].m.x * s[1].m.y - s[0].m.y * s[1].m.x) /
                         (v_length(s[0].m) * v_length(s[1].m)),
                 growth = heading_growth(series, moment);
    double sine, cosine;
    sin_cos(growth, &sine, &cosine);
    return fmax(miss, fabs(grown - sine));
}
/* Returns the certificate of a closed-form solution, which is an estimate of its error. The
 * certificate is the largest of five errors: the truncation error, the error of a state near the
 * initial time, and three rounding errors. That of a state is KR_TORUS_ROUNDING. That of the heading
 * is inversely proportional to the rate of the slower torus angle. Both torus angles change slowly
 * if the angular momentum is small. That of the attitude is largest where |m| is smallest, because
 * the attitude is a quotient of sums of the size sqrt|m|, whose errors do not become smaller with
 * |m|. */
static double certify_plan(const chaplygin_memory *m, const chaplygin_top *top, kr_quat attitude)
{
    const kr_chaplygin_plan *plan = &m->plan;
    const double heading = 0x1p-59 / fmin(plan->angle[0].rate, plan->angle[1].rate),
                 quotient = 0x1p-57 / sqrt(least_momentum(&m->curve, m->work.arc));
    const double rounding = fmax(KR_TORUS_ROUNDING, fmax(heading, quotient));
    return fmax(fmax(m->work.tail, rounding), miss_of_plan(plan, top, attitude));
}
/* Converts the solution to the user's units, or to internal units if `own` is nonzero
 * (across.h). */
static void bring_back(kr_chaplygin_plan *plan, const across_way *way, const kr_state *start,
                       int own)
{
    const kr_units *u = &way->units;
    torus_to_user(&plan->torus, way, start->t, own);
    plan->tau_rate = plan->tau_rate / way->time.hi / (own ? 1.0 : u->time);
}
/* Converts a validated scene to the axes and units of the closed-form solution. */
static kr_status read_chaplygin(const kr_scene *scene, chaplygin_memory *m, chaplygin_top *top,
                                across_way *way)
{
    across_start start;
    const kr_status status = read_across(scene, 1.0, 4.0, &start, way);
    if (status != KR_OK) return status;
    for (int i = 0; i < 3; i++) {
        top->L[i] = start.momentum[i];
        top->g[i] = start.up[i];
    }
    if (set_integrals(top, &m->curve)) {
        const kr_quat over = q4(0.0, v3(1.0, 0.0, 0.0));
        way->turn = q_mul(way->turn, over);
        way->axes = q_mul(way->axes, over);
        way->attitude = q_mul(way->attitude, over);
    }
    return KR_OK;
}
static kr_status plan_scene(const kr_scene *scene, int own, double bound, void *space,
                            kr_exact_info *info)
{
    chaplygin_memory *memory = space;
    kr_chaplygin_plan *plan = &memory->plan;
    chaplygin_top top;
    across_way way;
    info->refusal = KR_REFUSAL_KIND;
    kr_status status = check_torus_scene(scene, KR_KIND_GORYACHEV_CHAPLYGIN, own);
    if (status != KR_OK) return status;
    info->refusal = KR_REFUSAL_VERTICAL;
    if (scene->start.m.z != 0.0) return KR_ERR_METHOD;
    info->refusal = KR_REFUSAL_ROUNDED;
    if (!is_integrable(&scene->body, 4.0)) return KR_ERR_METHOD;
    info->refusal = KR_REFUSAL_WEIGHTLESS;
    status = read_chaplygin(scene, memory, &top, &way);
    if (status != KR_OK) return status;
    begin_torus(&plan->torus);
    kr_refusal refusal = make_plan(&top, memory);
    if (refusal == KR_REFUSAL_NONE) {
        set_heading(plan, way.attitude);
        info->certificate = certify_plan(memory, &top, way.attitude);
        bring_back(plan, &way, &scene->start, own);
        torus_info(&plan->torus, plan->angle[1].is_whole[0] ? 2.0 : 1.0, info);
        if (!(info->certificate <= bound)) refusal = KR_REFUSAL_CERTIFICATE;
    }
    info->refusal = KR_REFUSAL_NONE;
    if (refusal == KR_REFUSAL_NONE) return KR_OK;
    info->refusal = name_motion(&top, &memory->curve, refusal);
    return KR_ERR_METHOD;
}
static kr_state chaplygin_state(const void *memory, double t)
{
    const kr_chaplygin_plan *plan = memory;
    const kr_state none = {t, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    return isfinite(t) ? chaplygin_kernel(plan, t, torus_span(&plan->torus, t)) : none;
}
static kr_state chaplygin_state_at(const void *memory, double first, double second)
{
    const kr_chaplygin_plan *plan = memory;
    /* The phases are half the angles, except that `second` is the whole angle if only integer
     * multiples of it occur. */
    const double part = plan->angle[1].is_whole[0] ? 0.5 : 1.0;
    const dd mean[2] = {dd_of(fraction_of_turns(first)), dd_of(part * fraction_of_turns(second))};
    return chaplygin_kernel_at(plan, plan->torus.begin, mean, 0.0);
}
const kr_exact_scalar KR_NAME(kr_chaplygin_scalar) = {sizeof(chaplygin_memory), plan_scene,
                                                      chaplygin_state, chaplygin_state_at};
