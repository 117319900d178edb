/* Set-up of the closed-form solution for a Goryachev-Chaplygin top. This file is compiled once for
 * each instruction set, because double-double products are three times as fast with fused
 * multiply-add. */
#include "across.h"
#include "goryachev_chaplygin_series.h"

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
/* Returns, in turns, half of the initial torus angle that corresponds to the separation variable u.
 * Writes the periodic part of the time, evaluated at the initial torus angle, to `time`. Sets the
 * sign of the arc. */
static dd start_angle(const chaplygin_arc *arc, dd u, cdd root, kr_chaplygin_arc *e, double *time)
{
    const dd up = dd_max(dd_sub(arc->B, u), dd_of(0.0)),
             down = dd_max(dd_sub(dd_mul(u, arc->C), arc->A), dd_of(0.0)), both = dd_add(up, down);
    const double way = root.re.hi * root.im.hi > 0.0 ? -1.0 : 1.0,
                 s = way * dd_sqrt(dd_div(up, both)).hi, c = dd_sqrt(dd_div(down, both)).hi,
                 sine = 2.0 * s * c, cosine = c * c - s * s;
    e->sign = 1.0;
    const arc_point p = point_of(e, s, c);
    const int first = fabs(root.re.hi) > fabs(root.im.hi);
    if ((first ? p.c * root.re.hi : p.s * root.im.hi) < 0.0) e->sign = -1.0;
    *time = sum_arc_sines(arc, 1, sine, cosine);
    return dd_add(turns_of(s, c), dd_times(0.5 * sum_arc_sines(arc, 0, sine, cosine), one_turn()));
}
/* Sets the bounds and tolerances of Newton's method for the periodic part of the rescaled time
 * tau. */
static void set_slip_search(kr_chaplygin_plan *plan)
{
    double bound = 0.0;
    for (int j = 0; j < 2; j++) {
        const kr_chaplygin_arc *arc = &plan->arc[j];
        double most = 0.0;
        for (int cell = 0; cell < arc->cells; cell++) {
            const double *time = plan->term + arc->first + (2 * cell + 1) * CELL_TERMS;
            double sum = 0.0;
            for (int k = 0; k < CELL_TERMS; k++) sum += fabs(time[k]);
            most = fmax(most, sum);
        }
        bound += most;
    }
    plan->most_slip = 1.01 * bound / plan->mean;
    plan->rounding = 0x1p-53 / fmax(plan->arc[0].rate, plan->arc[1].rate);
    plan->tolerance = 0.5 * sqrt(plan->rounding);
}
/* Sets the rates of the two torus angles with respect to tau and to time. Returns the ratio of those
 * of the second and the first. */
static dd set_angle_rates(kr_chaplygin_plan *plan, const chaplygin_arc arc[2])
{
    const dd det = dd_add(dd_mul(arc[0].p, arc[1].q), dd_mul(arc[1].p, arc[0].q));
    plan->mean = dd_div(det, dd_mul(arc[0].p, arc[1].p)).hi;
    for (int j = 0; j < 2; j++) {
        kr_chaplygin_arc *e = &plan->arc[j];
        const dd rate = dd_div(dd_of(1.0), arc[j].p);
        e->rate = rate.hi;
        e->half_rate = 0.5 * dd_mul(rate, one_turn()).hi;
        plan->torus.turn[j] = phase_of(dd_half(dd_div(arc[1 - j].p, det)));
    }
    plan->span = two_pi * arc[0].p.hi;
    const dd ratio = dd_div(arc[0].p, arc[1].p);
    plan->ratio = ratio.hi;
    return ratio;
}
/* Sets the initial values of the mean angles. A mean angle grows at a constant rate with time,
 * unlike the true angle. Returns half of alpha2 [turns] where alpha1 is pi. */
static dd set_start(kr_chaplygin_plan *plan, dd ratio, const dd half[2], const double time[2])
{
    const double slip = -(time[0] + time[1]) / plan->mean;
    dd angle[2];
    for (int j = 0; j < 2; j++) {
        kr_phase *turn = &plan->torus.turn[j];
        const dd extra = dd_of(slip * plan->arc[j].half_rate);
        phase_start(turn, dd_sub(half[j], extra));
        angle[j] = dd_add(dd_make(turn->start, turn->more), extra);
    }
    return dd_add(angle[1], dd_mul(ratio, dd_sub(dd_of(0.25), angle[0])));
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
    dd half[2];
    double time[2];
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
    plan->first = 0;
    fill_chebyshev(w);
    for (int j = 0; j < 2; j++) {
        fill_arc(o, &w->arc[j], &plan->arc[j]);
        if (!make_cells(plan, w, j)) return KR_REFUSAL_INTEGRALS;
    }
    const dd ratio = set_angle_rates(plan, w->arc);
    set_slip_search(plan);
    for (int j = 0; j < 2; j++)
        half[j] = start_angle(&w->arc[j], y->u[j], y->root[j], &plan->arc[j], &time[j]);
    plan->is_even = plan->arc[0].has_sine[0] == plan->arc[1].has_sine[1];
    plan->is_whole = plan->arc[1].has_sine[0] == plan->arc[1].has_cosine[0];
    const dd second = set_start(plan, ratio, half, time);
    return make_sections(plan, w, ratio, second) ? KR_REFUSAL_NONE : KR_REFUSAL_HEADING;
}
/* Sets the initial heading from the initial attitude `q`. */
static void set_heading(kr_chaplygin_plan *plan, kr_quat q)
{
    plan->heading_start = plan->heading_more = 0.0;
    const kr_quat turn = q_mul(q, q_conj(chaplygin_kernel(plan, 0.0, dd_of(0.0)).q));
    const dd half = turns_of(turn.z, turn.w);
    plan->heading_start = half.hi;
    plan->heading_more = half.lo;
}
/* Returns the largest error of a solution at the initial time, and of its change within a short
 * span, in internal units. The change is compared with the integral of its rate: the torque e3 x
 * axis 1, and half of the product of the attitude and the angular velocity in the body. */
static double miss_of_plan(const kr_chaplygin_plan *plan, const chaplygin_top *top,
                           kr_quat attitude)
{
    const kr_vec3 L = v3(top->L[0].hi, top->L[1].hi, top->L[2].hi);
    const double size = v_length(L), span = 0.03125 * fmin(1.0, size) / (1.0 + size);
    const kr_state s = chaplygin_kernel(plan, 0.0, dd_of(0.0)),
                   end = chaplygin_kernel(plan, span, dd_of(span));
    const double miss = fmax(kr_attitude_error(s.q, attitude),
                             v_length(v_sub(q_turn_back(s.q, s.m), L)) / (1.0 + size));
    double m[2] = {s.m.x - end.m.x, s.m.y - end.m.y},
           q[4] = {s.q.w - end.q.w, s.q.x - end.q.x, s.q.y - end.q.y, s.q.z - end.q.z};
    for (int g = 0; g < HEADING_NODES; g++) {
        const double t = gauss_node[g] * span, weight = gauss_weight[g] * span;
        const kr_state now = chaplygin_kernel(plan, t, dd_of(t));
        const kr_vec3 l = q_turn_back(now.q, now.m), axis = q_turn(now.q, v3(1.0, 0.0, 0.0));
        const kr_quat rate = q_mul(now.q, q4(0.0, v3(l.x, l.y, 4.0 * l.z)));
        m[0] -= weight * axis.y;
        m[1] += weight * axis.x;
        q[0] += 0.5 * weight * rate.w;
        q[1] += 0.5 * weight * rate.x;
        q[2] += 0.5 * weight * rate.y;
        q[3] += 0.5 * weight * rate.z;
    }
    const double turned = 2.0 * hypot(hypot(q[0], q[1]), hypot(q[2], q[3]));
    return fmax(miss, fmax(hypot(m[0], m[1]) / (1.0 + size), turned));
}
/* Returns the certificate of a closed-form solution, which is an estimate of its error: the largest
 * of the truncation error, the error near the initial time, and the rounding error of a state. */
static double certify_plan(const chaplygin_memory *m, const chaplygin_top *top, kr_quat attitude)
{
    return fmax(fmax(m->work.tail, KR_TORUS_ROUNDING), miss_of_plan(&m->plan, top, attitude));
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
        torus_to_user(&plan->torus, &way, scene->start.t, own);
        torus_info(&plan->torus, plan->is_whole ? 2.0 : 1.0, info);
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
    const double part = plan->is_whole ? 0.5 : 1.0;
    const dd mean[2] = {dd_of(fraction_of_turns(first)), dd_of(part * fraction_of_turns(second))};
    return chaplygin_kernel_at(plan, plan->torus.begin, mean, 0.0);
}
const kr_exact_scalar KR_NAME(kr_chaplygin_scalar) = {sizeof(chaplygin_memory), plan_scene,
                                                      chaplygin_state, chaplygin_state_at};
