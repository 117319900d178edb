/* The Taylor method integrates any top in double precision, or with 20 or 30 digits. Each step is
 * as long as the tolerance permits, independently of the requested times. A state within a step is
 * obtained by a single evaluation of the Taylor series. The equations and symbols are those of
 * taylor.h, and the step size follows Jorba and Zou (2005). Integrals of the motion are conserved
 * only up to the tolerance. The unit of time of the series is 1 / rate internal units (method.h).
 * `rate` is a power of two, so large that |W| < 1 and Taylor coefficients do not overflow. */
#include <float.h>
#include "model/scene.h"
#include "math/su2_dd.h"
#include "slow.h"
#include "support_setup.h"

static const kr_kernel *get_kernel(const kr_motion *motion) { return motion->aux; }

/* Returns log2 of the tolerance for one step. The values for 20 and 30 digits were chosen by the
 * measurements in docs/theory/taylor.md. */
static double step_log2_tolerance(const kr_motion *motion)
{
    if (motion->digits > 20) return motion->tol > 0.0 ? log2(motion->tol) : -100.0;
    if (motion->digits > 16) return -70.0;
    return motion->tol > 0.0 ? log2(motion->tol) : -53.0;
}
/* Returns the kernel of the order that is fastest for the tolerance 2^*log2_tol, or the kernel for
 * 20 or 30 digits. The higher the order, the larger is the truncation error relative to the last
 * Taylor term. For the higher orders, *log2_tol is therefore lowered by `less`, but not below -53.
 * The orders and the values of `less` were measured (docs/theory/taylor.md). */
static const kr_kernel *choose_kernel(const kr_isa *isa, const kr_motion *motion, double *log2_tol)
{
    static const struct {
        double until, less;
    } by_order[KR_ORDERS] = {
        {-16.0, 0.0}, {-24.0, 3.0}, {-33.0, 3.0}, {-42.0, 5.0}, {-DBL_MAX, 5.0}};
    const double tol = *log2_tol;
    int i = 0;
    if (motion->digits > 16) return &isa->deep[motion->digits > 20 ? KR_DIGITS_30 : KR_DIGITS_20];
    while (tol < by_order[i].until) i++;
    *log2_tol = fmin(tol, fmax(tol - by_order[i].less, -53.0));
    return motion->skip_heading ? &isa->headless[i] : &isa->plain[i];
}
void kr_taylor_set_kernel(kr_motion *motion, const kr_kernel *kernel, double log2_tol)
{
    motion->aux = (void *)kernel;
    taylor_of(motion)->log2_tol = log2_tol;
}

/* Returns the functions for friction, moving supports and gradients, or NULL if not needed. */
static const kr_support_ops *find_support_ops(const kr_motion *motion)
{
    return kr_support_is_needed(motion->scene) ? kr_method_taylor.supports : NULL;
}
/* Returns `rate` for the initial angular velocity W: a power of two that exceeds bounds on |W| and
 * on the rates of damping, rotor, support and friction (0 if friction holds the top: `is_held`).
 * The bound on |W|^2 is (<W, A W> + 4 |c|) / (least moment of inertia), with c = motion->lever: the
 * potential energy <c, P> changes by at most 2 |c|, and damping does not increase the energy. */
static double choose_series_rate(const kr_motion *motion, kr_vec3 W, int is_held)
{
    const kr_support_ops *supports = find_support_ops(motion);
    const kr_vec3 A = motion->inertia;
    const double twice_energy = v_dot(v_times(A, W), W) + 4.0 * v_length(motion->lever);
    const kr_vec3 D = motion->damping;
    const double drag = fmax(D.x / A.x, fmax(D.y / A.y, D.z / A.z));
    const double least = fmin(A.x, fmin(A.y, A.z)), carried = v_length(motion->rotor) / least;
    int exponent = 0;
    const double own = fmax(fmax(drag, carried), sqrt(twice_energy / least));
    frexp(supports ? fmax(own, supports->rate(motion, W, is_held)) : own, &exponent);
    return ldexp(1.0, exponent);
}
/* Returns the attitude q, given (q | P). If skip_heading (kreisel.h) is set, q is unknown. The
 * result is then a rotation of P to e3, the inverse of q_tilt(P) (math/su2.h). To normalize P, two
 * terms of the series for 1 / |P| suffice, because |P| is close to 1. */
static kr_quat read_unit_attitude(const kr_motion *motion, const double q_P[8])
{
    const kr_vec3 P = v3(q_P[5], q_P[6], q_P[7]);
    return motion->skip_heading ? q_conj(q_tilt(v_scale(1.5 - 0.5 * v_dot(P, P), P)))
                                : q_unit(q4(q_P[0], v3(q_P[1], q_P[2], q_P[3])));
}
/* Converts the values x of (q | P) and w of W to a state in double precision. */
static void read_plain_state(const kr_taylor *p, const kr_motion *motion, const double x[8],
                             const double w[4], kr_state *to)
{
    const kr_vec3 M = v_times(motion->inertia, v_scale(p->rate, v3(w[1], w[2], w[3])));
    to->q = read_unit_attitude(motion, x);
    to->m = q_turn(to->q, motion_add_rotor(motion, M));
}
/* Converts the values at_x and at_w of the series to a state in double-double precision. Stores the
 * high words of the state in `to`, and its low words in motion->low. */
static void read_extended_state(const kr_taylor *p, kr_motion *motion, kr_state *to)
{
    const kr_series *s = p->series;
    const vec_dd W = vdd_scale_exactly(p->rate, v_dd(v_of(s[0].at_w + 1), v_of(s[1].at_w + 1)));
    const vec_dd own = vdd_times(motion->body->inertia, W);
    const vec_dd M = v_largest(motion->rotor) > 0.0 ? vdd_add(own, motion->body->rotor) : own;
    const quat_dd q = qdd_unit(qdd_load(s[0].at_x, s[1].at_x));
    const vec_dd m = qdd_turn(q, M);
    to->q = qdd_high(q);
    motion->low.q = qdd_low(q);
    to->m = vdd_high(m);
    motion->low.m = vdd_low(m);
}

static int is_end_finite(const kr_series *s)
{
    double sum = 0.0;
    for (int i = 0; i < 4; i++)
        sum += fabs(s->end_x[i]) + fabs(s->end_x[4 + i]) + fabs(s->end_w[i]);
    return isfinite(sum);
}
/* Replaces the last step of the series by a step of length 0 with the same initial state. */
static void set_empty_step(kr_series s[2])
{
    for (int i = 0; i < 2; i++) {
        memcpy(s[i].end_x, s[i].x[0], sizeof s->end_x);
        memcpy(s[i].end_w, s[i].w[0], sizeof s->end_w);
        memset(s[i].x[1], 0, sizeof s->x - sizeof s->x[0]);
        memset(s[i].w[1], 0, sizeof s->w - sizeof s->w[0]);
    }
    s->end = s->t;
    s[1].end = s[1].t;
}

static void set_initial_state(kr_taylor *p, const kr_motion *motion, const kr_state *start)
{
    kr_series *high = &p->series[0], *low = &p->series[1];
    const kr_support_ops *supports = find_support_ops(motion);
    const quat_dd q = q_dd(start->q, motion->low.q);
    const vec_dd vertical = {dd_of(0.0), dd_of(0.0), dd_of(1.0)};
    const vec_dd m = v_dd(start->m, motion->low.m),
                 M = motion->digits > 16 ? m : qdd_turn(qdd_conj(q), m),
                 h = vdd_scale_exactly(-1.0, motion->body->rotor),
                 own = v_largest(motion->rotor) > 0.0 ? vdd_add(M, h) : M,
                 W = vdd_over(own, motion->body->inertia);
    const kr_quat q_high = qdd_high(q), q_low = qdd_low(q);
    p->rate = p->first_rate = choose_series_rate(motion, vdd_high(W), 0);
    p->try_slow = motion->clock;
    p->settling = 0.0;
    if (!motion->skip_heading) {
        memcpy(high->x[0], &q_high, sizeof q_high);
        memcpy(low->x[0], &q_low, sizeof q_low);
    }
    set_vector_words(high->x[0] + 4, low->x[0] + 4, qdd_turn(qdd_conj(q), vertical));
    set_vector_words(high->w[0], low->w[0], vdd_scale_exactly(1.0 / p->rate, W));
    kr_taylor_set_constants(p->series, motion, p->rate, supports);
    high->t = p->rate * motion->clock;
    low->t = low->end = 0.0;
    set_empty_step(p->series);
    if (!supports) return;
    p->held_rate = choose_series_rate(motion, vdd_high(W), 1);
    if (p->held_rate > p->first_rate * 0x1p-10) p->held_rate = p->first_rate;
    supports->start(motion);
}
static kr_status taylor_reset(kr_motion *motion, const kr_state *start)
{
    double log2_tol = step_log2_tolerance(motion);
    int i = 0;
    if (motion->digits <= 16)
        *motion->body =
            make_body_dd(motion, kr_scene_pull(motion->scene, motion->scene->body.com).com);
    while (!kr_taylor_isa(i)->runs_here()) i++; /* untaken: if the first one runs */
    const kr_kernel *kernel = choose_kernel(kr_taylor_isa(i), motion, &log2_tol);
    kr_taylor_set_kernel(motion, kernel, log2_tol);
    set_initial_state(taylor_of(motion), motion, start);
    return KR_OK;
}
static kr_status taylor_step(kr_motion *motion, double until)
{
    kr_taylor *p = taylor_of(motion);
    kr_series *s = p->series;
    const double forward = motion->step < 0.0 ? -1.0 : 1.0;
    double log2_tol;
    if (s->linear != 0.0 && kr_slow_drives_apart(motion, until))
        return motion->clock == 0.0 ? KR_ERR_RESOLUTION : KR_ERR_NOT_FINITE;
    if (s->linear == 1.0 && kr_slow_overflows(motion, get_kernel(motion)->order, until))
        return KR_ERR_NOT_FINITE;
    /* In double precision, no step can attain a tolerance below 2^-54. */
    if (motion->digits <= 16 && p->log2_tol < -54.0) return KR_ERR_STEP;
    if (s->linear > 1.0) {
        const kr_status status = kr_method_taylor.supports->step(motion, get_kernel(motion));
        if (status != KR_OK) return status;
    } else if (!kr_slow_step(motion, get_kernel(motion), NULL, &log2_tol))
        get_kernel(motion)->advance(s, log2_tol, forward);
    motion->stats.evaluations++;
    const kr_status status = !is_end_finite(s)                 ? KR_ERR_NOT_FINITE
                             : forward * (s->end - s->t) > 0.0 ? KR_OK
                                                               : KR_ERR_STEP;
    if (status == KR_OK)
        motion->clock = s->end / p->rate;
    else
        set_empty_step(s);
    return status;
}
static void taylor_read(const kr_motion *motion, kr_state *s)
{
    const kr_taylor *p = taylor_of(motion);
    read_plain_state(p, motion, p->series->end_x, p->series->end_w, s);
}
static void taylor_evaluate(kr_motion *motion, double clock, kr_state *s)
{
    kr_taylor *p = taylor_of(motion);
    const double begin = p->series->t, end = p->series->end;
    p->series[0].at = p->rate * clock;
    p->series[1].at = p->rate * motion->low.t;
    /* Replaces a time outside the step by the nearer end of the step, because the Taylor series is
     * accurate only within the step. Only rounding errors can place `clock` outside the step. */
    const double before = begin - p->series->at, behind = p->series->at - end;
    if (before * behind < 0.0) {
        p->series[0].at = fabs(before) < fabs(behind) ? begin : end;
        p->series[1].at = 0.0;
    }
    get_kernel(motion)->evaluate(p->series);
    if (motion->digits > 16)
        read_extended_state(p, motion, s);
    else
        read_plain_state(p, motion, p->series->at_x, p->series->at_w, s);
}
static const char *taylor_kernel(const kr_motion *motion, int *order)
{
    const kr_isa *isa = kr_taylor_isa_of(motion);
    *order = get_kernel(motion)->order;
    return isa ? isa->name : "other";
}
static kr_step_polynomial taylor_polynomial(const kr_motion *motion)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_series *s = p->series;
    const kr_isa *isa = kr_taylor_isa_of(motion);
    kr_step_polynomial piece = {.order = get_kernel(motion)->order,
                                .x = s->x,
                                .w = s->w,
                                .rate = p->rate,
                                .begin = s->t / p->rate};
    memcpy(piece.end_x, s->end_x, sizeof piece.end_x);
    memcpy(piece.end_w, s->end_w, sizeof piece.end_w);
    piece.end = s->end / p->rate;
    piece.span = s->end - s->t;
    piece.product = isa ? isa->product : kr_product_base;
    if (s->linear > 1.0) {
        const kr_support_ops *supports = kr_method_taylor.supports;
        piece.is_disturbed = 1;
        piece.held = s->holds != 0.0 ? p->before_hold : 0.0;
        piece.sliding = supports->sliding(s);
        supports->slopes(motion, piece.slope_x, piece.slope_w);
    }
    return piece;
}

const kr_method kr_method_taylor = {
    KR_METHOD_TEXTS(
        "taylor",
        "Taylor series with dense output, of order 12 to 28 depending on the tolerance; 20 or "
        "30 digits with double-double numbers",
        "nothing", "Jorba and Zou, Exp. Math. 14, 2005"),
    .order = 0,
    .flags = KR_METHOD_ADAPTIVE | KR_METHOD_DIGITS | KR_METHOD_SKIPS_HEADING | KR_METHOD_DAMPED |
             KR_METHOD_TANGENTS | KR_METHOD_ROTORS | KR_METHOD_TURNING | KR_METHOD_SHAKING |
             KR_METHOD_FRICTION | KR_METHOD_GRADIENT,
    .work = sizeof(kr_taylor) / sizeof(double),
    .reset = taylor_reset,
    .step = taylor_step,
    .read = taylor_read,
    .at = taylor_evaluate,
    .kernel = taylor_kernel,
    .polynomial = taylor_polynomial,
    .tangents = FOR_TANGENTS(&kr_taylor_tangents),
    .supports = FOR_SUPPORTS(&kr_supports),
    .extended = FOR_DIGITS(&kr_extended),
};
