/* Set-up of the closed-form solution for a Kowalewski top. This file is compiled once for each
 * instruction set, because double-double products are three times as fast with fused
 * multiply-add. */
#include "across.h"
#include "kowalewski_plan.h"
#include "kowalewski_state.h"

/* Number of points on the torus at which solutions are tested. */
enum { POINTS = 256 };
/* A solution is tested if it consists of dual sums, if its error exceeds DOUBTFUL, or if the ratio
 * of the smallest to the largest denominator D is below CANCELLING. */
#define DOUBTFUL 5e-15
#define CANCELLING 0.05
/* If the estimated error of a closed-form solution exceeds INACCURATE, the set-up is repeated with
 * more quadrature nodes. */
#define INACCURATE 1e-14

/* A closed-form solution and the intermediate results of its set-up. */
typedef struct kowalewski_memory {
    kr_theta_sums plan;
    kowalewski_work work;
} kowalewski_memory;

/* Converts a validated scene to the axes and units of kowalewski_curve.h. */
static kr_status read_kowalewski(const kr_scene *scene, kowalewski_top *top, across_way *way)
{
    across_start start;
    const kr_status status = read_across(scene, -1.0, 1.0, &start, way);
    if (status != KR_OK) return status;
    for (int i = 0; i < 3; i++) {
        top->state[i] = dd_scale(i < 2 ? 0.5 : 1.0, start.momentum[i]);
        top->state[3 + i] = start.up[i];
    }
    top->l = start.vertical;
    return KR_OK;
}
/* Sets the initial phase of the complex factor e from the initial attitude `q`. */
static void set_phase(kr_theta_sums *plan, kr_quat q)
{
    const kr_quat at = kowalewski_kernel(plan, 0.0, dd_of(0.0)).q;
    const cx alpha = cx_mul(cx_of(q.w, q.z), cx_of(at.w, -at.z)),
             beta = cx_mul(cx_of(q.x, q.y), cx_of(at.x, -at.y)), both = cx_add(alpha, beta);
    phase_start(&plan->torus.turn[2], turns_of(both.im, both.re));
}
/* Converts the solution to the user's units, or to internal units if `own` is nonzero
 * (across.h). */
static void bring_back(kr_theta_sums *plan, const across_way *way, double start, int own)
{
    torus_to_user(&plan->torus, way, start, own);
    plan->head.first = two_pi * plan->torus.turn[0].fast;
    plan->head.second = two_pi * plan->torus.turn[1].fast;
    plan->head.heading = two_pi * plan->torus.turn[2].fast;
}
/* Returns the largest error of a solution near the initial time, in internal units. The computed
 * attitude is compared with `attitude` at the initial time. The vertical and the momentum are
 * compared with a Taylor series at the initial time and at the time `moment`. */
static double miss_of_plan(const kr_theta_sums *plan, const kowalewski_top *top, double moment,
                           kr_quat attitude)
{
    dd series[6][ORDER + 1], y[6];
    double miss = kr_attitude_error(kowalewski_kernel(plan, 0.0, dd_of(0.0)).q, attitude);
    expand(top->state, series);
    for (int i = 0; i < 2; i++) {
        const double t = i * moment;
        const kr_state s = kowalewski_kernel(plan, t, dd_of(t));
        const kr_vec3 up = q_vertical(s.q), m = q_turn_back(s.q, s.m);
        sum_series(series, t, y);
        const kr_vec3 want = v3(2.0 * y[0].hi, 2.0 * y[1].hi, y[2].hi);
        miss = fmax(miss, v_length(v_sub(up, v3(y[3].hi, y[4].hi, y[5].hi))));
        miss = fmax(miss, v_length(v_sub(m, want)) / (1.0 + v_length(want)));
    }
    return miss;
}
/* Returns the relative error of a state's energy or of its <m, e3>, whichever is larger. */
static double miss_of_integrals(const kr_state *s, const kowalewski_curve *o)
{
    const kr_vec3 up = q_vertical(s->q), m = q_turn_back(s->q, s->m);
    const double h = 0.25 * (m.x * m.x + m.y * m.y) + 0.5 * m.z * m.z - up.x,
                 energy = fabs(h - o->h.hi) / (1.0 + fabs(o->h.hi)),
                 vertical = fabs(v_dot(m, up) - o->l.hi) / (1.0 + v_length(m));
    return fmax(energy, vertical);
}
/* Returns the largest error of the integrals of motion at many points on the torus. Near saddle
 * points of the phase space, the errors can be 1e4 times as large as at the samples to which the
 * theta sums were fitted. */
static double miss_on_torus(const kr_theta_sums *plan, const kowalewski_curve *o)
{
    double miss = 0.0;
    for (int i = 1; i <= POINTS; i++) {
        /* The points are multiples of two irrational numbers, so that they fill the torus
         * evenly. */
        const dd phase[3] = {dd_of(fraction_of_turns(0.7548776662466927 * i)),
                             dd_of(fraction_of_turns(0.5698402909980532 * i)), dd_of(0.0)};
        const kr_state s = kowalewski_kernel_at(plan, 0.0, phase);
        const double here = miss_of_integrals(&s, o);
        miss = fmax(miss, isfinite(here) ? here : INFINITY);
    }
    return miss;
}
/* Computes the theta sums and the error certificate. If `dual` is nonzero, the dual sums are
 * computed instead. The function analyse_curve must be called first. Writes an error estimate to
 * `error`, or INFINITY on failure. The error estimate does not include the errors of the
 * frequencies of the motion.
 * Returns KR_KOWALEWSKI_PLANNED on success, or the reason for the failure. */
static kr_kowalewski_refusal fill_plan(kowalewski_memory *memory, const kowalewski_top *top,
                                       kr_quat attitude, int dual, double *error)
{
    kr_theta_sums *plan = &memory->plan;
    kowalewski_work *w = &memory->work;
    const double moment = 0.03125 / (1.0 + sqrt(fabs(w->curve.h.hi)));
    kr_kowalewski_refusal refusal = KR_KOWALEWSKI_PLANNED;
    dd heading;
    *error = INFINITY;
    if (!dual)
        refusal = make_sums(w, top->state, plan, &heading);
    else if (!make_dual_sums(w, top->state, plan, &heading))
        refusal = KR_KOWALEWSKI_SUMS;
    if (refusal != KR_KOWALEWSKI_PLANNED) return refusal;
    set_phases(w, heading, plan);
    set_phase(plan, attitude);
    const double of_sums = error_of_sums(w);
    *error = fmax(of_sums, miss_of_plan(plan, top, moment, attitude));
    if (dual || *error > DOUBTFUL || least_size(&w->theta) < CANCELLING)
        *error = fmax(*error, miss_on_torus(plan, &w->curve));
    /* Between the sample points on the torus, the error of dual theta sums is up to six times as
     * large as at these points. The last argument of fmax is the effect of the frequency errors
     * after 1000 radians.
     * It matters only near separatrices, where a rounding error of the start changes the motion far
     * more. */
    plan->head.certificate =
        fmax(fmax(*error, dual ? 6.0 * of_sums : KR_TORUS_ROUNDING), 1e3 * w->separatrix);
    return refusal;
}
/* Computes the closed-form solution in internal units. If the error exceeds INACCURATE, the periods
 * are computed again with more quadrature nodes. If the error remains too large, dual sums are
 * used, provided that they are more accurate. Returns KR_KOWALEWSKI_PLANNED, or the reason for the
 * failure. */
static kr_kowalewski_refusal make_plan(kowalewski_memory *memory, const kowalewski_top *top,
                                       kr_quat attitude)
{
    kowalewski_work *w = &memory->work;
    double error, error_of_dual;
    kr_kowalewski_refusal refusal = analyse_curve(top, w);
    if (refusal != KR_KOWALEWSKI_PLANNED) return refusal;
    fill_plan(memory, top, attitude, 0, &error);
    if (error <= INACCURATE) return KR_KOWALEWSKI_PLANNED;
    w->curve.settled = WELL_SETTLED;
    if (!make_periods(&w->curve, w->arc, &w->rates, &w->theta.matrix))
        return KR_KOWALEWSKI_INTEGRALS;
    refusal = fill_plan(memory, top, attitude, 0, &error);
    if (error <= INACCURATE) return KR_KOWALEWSKI_PLANNED;
    fill_plan(memory, top, attitude, 1, &error_of_dual);
    if (error_of_dual < error) return KR_KOWALEWSKI_PLANNED;
    return refusal == KR_KOWALEWSKI_PLANNED ? fill_plan(memory, top, attitude, 0, &error) : refusal;
}
static kr_status plan_scene(const kr_scene *scene, int own, double bound, void *space)
{
    kowalewski_memory *memory = space;
    kr_theta_sums *plan = &memory->plan;
    kr_kowalewski *head = &plan->head;
    kowalewski_top top;
    across_way way;
    memset(head, 0, sizeof *head);
    head->refusal = KR_KOWALEWSKI_OTHER;
    kr_status status = check_torus_scene(scene, KR_KIND_KOWALEWSKI, own);
    if (status != KR_OK) return status;
    head->refusal = KR_KOWALEWSKI_ROUNDED;
    if (!is_integrable(&scene->body, 2.0)) return KR_ERR_METHOD;
    head->refusal = KR_KOWALEWSKI_WEIGHTLESS;
    status = read_kowalewski(scene, &top, &way);
    if (status != KR_OK) return status;
    begin_torus(&plan->torus);
    head->refusal = (int)make_plan(memory, &top, way.attitude);
    if (head->refusal != KR_KOWALEWSKI_PLANNED) {
        head->refusal = (int)name_motion(&top, (kr_kowalewski_refusal)head->refusal);
        return KR_ERR_METHOD;
    }
    bring_back(plan, &way, scene->start.t, own);
    head->used = kr_kowalewski_form.used_size(plan);
    if (head->certificate <= (bound > 0.0 ? bound : KR_KOWALEWSKI_BOUND)) return KR_OK;
    head->refusal = (int)name_motion(&top, KR_KOWALEWSKI_CERTIFICATE);
    return KR_ERR_METHOD;
}
static kr_state kowalewski_state(const void *memory, double t)
{
    const kr_theta_sums *plan = memory;
    const kr_state none = {t, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    return isfinite(t) ? kowalewski_kernel(plan, t, torus_span(&plan->torus, t)) : none;
}
static kr_state kowalewski_state_at(const void *memory, double first, double second)
{
    const kr_theta_sums *plan = memory;
    const kr_torus *torus = &plan->torus;
    const dd phase[3] = {dd_of(fraction_of_turns(first)), dd_of(fraction_of_turns(second)),
                         torus_phase_at(torus, 2, dd_of(0.0))};
    return kowalewski_kernel_at(plan, torus->begin, phase);
}
const kr_torus_scalar KR_NAME(kr_kowalewski_scalar) = {sizeof(kowalewski_memory), plan_scene,
                                                       kowalewski_state, kowalewski_state_at};
