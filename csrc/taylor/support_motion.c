/* Initial values and steps of the Taylor series for tops with dry friction or on moving supports
 * (series.h). The spin is <U, a> for the angular velocity U = W - O of the top relative to the
 * support, and the apex a. The top slides, or friction holds the top, that is, keeps the spin zero.
 * Within a step, the friction variable, kr_series.w[n][0], is a polynomial in time: the spin while
 * the top slides, or the friction torque divided by its maximum while friction holds the top. A
 * step ends where the spin reaches zero or the torque reaches its maximum, accurate to double
 * precision, or to double-double precision with more than 16 digits. */
#include <float.h>
#include <string.h>
#include "slow.h"
#include "support_setup.h"

/* A spin below NEGLIGIBLE_SPIN, in the units of the series, counts as zero. Friction still holds
 * the top if the friction torque exceeds its maximum by a factor below 1 + NEGLIGIBLE_SPIN. For the
 * initial spin with more than 16 digits, the threshold is NEGLIGIBLE_SPIN_DEEP. */
#define NEGLIGIBLE_SPIN 0x1p-48
#define NEGLIGIBLE_SPIN_DEEP 0x1p-92
/* Rounding error of the initial spin, given in doubles, divided by the largest term of <U, a>. */
#define ROUNDED_SPIN 0x1p-44
/* is_sliding_impossible neglects spin accelerations against the direction of sliding that are below
 * OPPOSED_ACCELERATION * (1 + largest damping rate), in the units of the series. Rounding errors of
 * the spin acceleration are far smaller. */
#define OPPOSED_ACCELERATION 0x1p-32
/* Width of the intervals at which bisection stops, as a fraction of the step. */
#define NARROW_PART 0x1p-30
/* Newton's method (refine_friction_crossing) makes at most NEWTON_MOST corrections. It ends before
 * a correction above FARTHEST_PART times the step size. A correction below CONVERGED_PART times the
 * step size is the last one, unless it is among the first NEWTON_LEAST. */
#define FARTHEST_PART 0x1p-20
#define CONVERGED_PART 0x1p-50
#define NEWTON_LEAST 3
#define NEWTON_MOST 8

static double frictionless_spin_derivative(const kr_series *s)
{
    const kr_vec3 W = v_of(s->end_w + 1), O = v_of(s->turn + 1);
    return v_dot(v_of(s->apex + 1), v_sub(kr_taylor_acceleration(s), v_cross(O, W)));
}
static dd find_end_spin(const kr_series s[2])
{
    const vec_dd W = v_dd(v_of(s[0].end_w + 1), v_of(s[1].end_w + 1)),
                 O = v_dd(v_of(s[0].turn + 1), v_of(s[1].turn + 1)),
                 apex = v_dd(v_of(s[0].apex + 1), v_of(s[1].apex + 1));
    const vec_dd U = vdd_add(W, vdd_scale(dd_of(-1.0), O));
    return vdd_dot(U, apex);
}
static void remove_end_spin(kr_series s[2])
{
    const vec_dd W = v_dd(v_of(s[0].end_w + 1), v_of(s[1].end_w + 1)),
                 yield = v_dd(v_of(s[0].yield + 1), v_of(s[1].yield + 1));
    set_vector_words(s[0].end_w, s[1].end_w,
                     vdd_add(W, vdd_scale(dd_neg(find_end_spin(s)), yield)));
}
/* Sets p->sliding of a top without spin: to 0 if friction can hold the top, else to the direction
 * in which the top starts to slide. This is the direction of the torque that friction has to
 * balance; backward in time, the opposite. `torque_ratio` is this torque divided by its maximum. */
static void set_sliding_or_hold(kr_taylor *p, const kr_motion *motion, double torque_ratio)
{
    const double along = (torque_ratio > 0.0) == (motion->step >= 0.0) ? 1.0 : -1.0;
    p->sliding = fabs(torque_ratio) <= 1.0 ? 0.0 : along;
}
/* Returns the threshold, in the units of the series, below which the initial spin counts as zero:
 * NEGLIGIBLE_SPIN or, above 16 digits, NEGLIGIBLE_SPIN_DEEP. If damping makes the unit of time
 * 1 / p->rate much shorter than the time scale of the motion, the threshold is lower than these,
 * but never below rounding errors. */
static double initial_spin_threshold(const kr_motion *motion)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_series *s = p->series;
    const kr_vec3 W = v_scale(p->rate, v_of(s->end_w + 1)), h = motion->rotor,
                  M = v_add(v_times(motion->inertia, W), h),
                  eased = v_over(v_of(s->apex + 1), motion->inertia);
    const double part = fmin(1.0, 2.0 * kr_support_rate(motion, W, 0) / p->rate),
                 terms = v_largest(eased) * (v_largest(M) + v_largest(h)) / p->rate +
                         v_largest(v_of(s->turn + 1));
    return fmax(part * (kr_taylor_is_extended(motion) ? NEGLIGIBLE_SPIN_DEEP : NEGLIGIBLE_SPIN),
                ROUNDED_SPIN * terms);
}
static void set_initial_friction_mode(const kr_motion *motion)
{
    kr_taylor *p = taylor_of(motion);
    kr_series *s = p->series;
    p->sliding = p->before_hold = 0.0;
    /* Clear the memory, which may contain data of another top. */
    for (int i = 0; i < 2; i++) {
        memset(s[i].turn, 0, sizeof s->turn);
        memset(s[i].sway, 0, 2 * sizeof *s->sway);
        memset(s[i].rub, 0, sizeof s->rub);
        s[i].slides = s[i].holds = 0.0;
    }
    kr_support_place(s, motion, p->rate);
    if (!(motion->scene->friction > 0.0)) return;
    const double spin = find_end_spin(s).hi;
    if (fabs(spin) > initial_spin_threshold(motion)) {
        p->sliding = spin > 0.0 ? 1.0 : -1.0;
        return;
    }
    remove_end_spin(s);
    memcpy(s[0].w[0], s[0].end_w, sizeof s->end_w);
    memcpy(s[1].w[0], s[1].end_w, sizeof s->end_w);
    set_sliding_or_hold(p, motion, frictionless_spin_derivative(s) * s->per_grip);
}

/* Returns the first point in [low, high] where a polynomial of degree n becomes negative, or
 * INFINITY if there is none, by bisection down to intervals of width NARROW_PART. `bernstein`
 * contains the n + 1 Bernstein coefficients on [low, high], and is overwritten. */
static double find_first_negative(double *bernstein, int n, double low, double high)
{
    double left[KR_TAYLOR_MAX + 1], least = bernstein[0];
    for (int i = 1; i <= n; i++) least = fmin(least, bernstein[i]);
    if (least >= 0.0) return INFINITY;
    if (bernstein[0] < 0.0 || high - low <= NARROW_PART) return low;
    for (int k = 0; k <= n; k++) {
        left[k] = bernstein[0];
        for (int i = 0; i < n - k; i++) bernstein[i] = 0.5 * (bernstein[i] + bernstein[i + 1]);
    }
    const double middle = 0.5 * (low + high), first = find_first_negative(left, n, low, middle);
    return first < INFINITY ? first : find_first_negative(bernstein, n, middle, high);
}
/* Returns the fraction of the step at which `sign` times the friction variable plus `constant`
 * first becomes negative. Returns INFINITY if the sum stays nonnegative throughout the step. */
static double find_friction_crossing_part(const kr_series *s, int order, double sign,
                                          double constant)
{
    double b[KR_TAYLOR_MAX + 1], power = 1.0, binomial = 1.0, others = 0.0;
    b[0] = sign * s->w[0][0] + constant;
    for (int i = 1; i <= order; i++) {
        power *= s->end - s->t;
        b[i] = sign * power * s->w[i][0];
        others += fabs(b[i]);
    }
    if (b[0] > others) return INFINITY;
    for (int i = 0; i <= order; i++) {
        b[i] /= binomial;
        binomial = binomial * (order - i) / (i + 1);
    }
    for (int k = 1; k <= order; k++)
        for (int i = order; i >= k; i--) b[i] += b[i - 1];
    return find_first_negative(b, order, 0.0, 1.0);
}
/* Returns the time since the beginning of the step (negative backward in time) at which the
 * friction variable equals `value`. Newton's method starts at `near`, where the variable may differ
 * from `value` by 2 * `noise`, so the result may be earlier than `near`. */
static dd refine_friction_crossing(const kr_series s[2], int order, double value, double near,
                                   double noise)
{
    const double span = s->end - s->t, far = FARTHEST_PART * fabs(span);
    dd h = dd_of(near);
    for (int step = 0; step < NEWTON_MOST; step++) {
        dd sum = dd_of(0.0);
        double slope = 0.0;
        for (int i = order; i >= 0; i--) {
            slope = slope * h.hi + sum.hi;
            sum = dd_add(dd_mul(sum, h), dd_make(s[0].w[i][0], s[1].w[i][0]));
        }
        const dd off = dd_div(dd_sub(sum, dd_of(value)), dd_of(slope));
        const double back = span < 0.0 ? -off.hi : off.hi;
        if (!(back >= -far && back <= far + 2.0 * noise / fabs(slope))) break;
        h = dd_sub(h, off);
        if (step >= NEWTON_LEAST && fabs(back) <= CONVERGED_PART * fabs(span)) break;
    }
    return h;
}
static void end_step_after_time(kr_series s[2], const kr_kernel *kernel, int deep, dd h)
{
    const dd to = dd_add(dd_add(dd_of(s[0].t), dd_of(s[1].t)), h);
    s[0].at = to.hi;
    s[1].at = deep ? to.lo : 0.0;
    kr_taylor_end_at(s, kernel);
}
static dd find_end_friction_slope(const kr_series s[2], int order)
{
    const dd h =
        dd_sub(dd_add(dd_of(s[0].end), dd_of(s[1].end)), dd_add(dd_of(s[0].t), dd_of(s[1].t)));
    dd sum = dd_of(0.0);
    for (int i = order; i > 0; i--)
        sum = dd_add(dd_mul(sum, h), dd_times(i, dd_make(s[0].w[i][0], s[1].w[i][0])));
    return sum;
}
/* Returns 1 if the spin, which begins with the sign `sliding`, changes its sign within the step. If
 * the final spin is within `noise` of zero, find_friction_crossing_part does not detect this. */
static int spin_crosses_zero(const kr_series s[2], int order, double sliding, double noise)
{
    const double span = s->end - s->t;
    if (!(sliding * s->end_w[0] < 0.0 && sliding * s->w[0][0] > 0.0)) return 0;
    if (!(sliding * find_end_friction_slope(s, order).hi * span < 0.0)) return 0;
    const double at = refine_friction_crossing(s, order, 0.0, span, noise).hi;
    return at * span > 0.0 && fabs(at) <= fabs(span);
}
/* Returns 1 if a top without spin, which is about to slide in the direction p->sliding, would be
 * accelerated in the opposite direction (OPPOSED_ACCELERATION). */
static int is_sliding_impossible(const kr_taylor *p, const kr_motion *motion)
{
    const kr_series *s = p->series;
    const double gain = p->sliding * frictionless_spin_derivative(s) - 1.0 / s->per_grip,
                 noise = OPPOSED_ACCELERATION * (1.0 + v_largest(v_of(s->drag + 1)));
    return p->sliding != 0.0 && (motion->step < 0.0 ? -gain : gain) < -noise;
}
/* Sets p->sliding and, if the spin has vanished, p->before_hold (taylor.h) where a step ends with a
 * switch. `value` is the friction variable there: 0 if the spin has vanished, 1 or -1 if friction
 * can no longer hold the top. If, at large tolerances, the top would be accelerated against the new
 * direction of sliding, p->sliding becomes 0, to avoid a step of length zero; not tested on the
 * slow manifold (`is_slow`), where accelerations are inaccurate. */
static void update_friction_mode(kr_taylor *p, const kr_motion *motion, int order, double value,
                                 int is_slow)
{
    kr_series *s = p->series;
    const double before = p->sliding,
                 slope = before != 0.0 ? find_end_friction_slope(s, order).hi : 0.0;
    p->try_slow = p->settling = 0.0;
    remove_end_spin(s);
    if (before == 0.0) {
        p->sliding = -value;
    } else {
        /* The torque to balance is computed from the slope of the spin and the friction of this
         * step. The velocity is not used, because strong damping amplifies its rounding errors. */
        p->before_hold = before;
        set_sliding_or_hold(p, motion, slope * s->per_grip + before);
    }
    if (!is_slow && is_sliding_impossible(p, motion)) p->sliding = 0.0;
}
/* If friction stops the top or ceases to hold it within the step, ends the step there and changes
 * the friction mode (update_friction_mode). A spin below NEGLIGIBLE_SPIN * spin_unit, in the units
 * of the series, counts as zero. `is_slow` is 1 if the step is on the slow manifold (slow.c). */
static void end_step_at_friction_switch(kr_taylor *p, const kr_motion *motion,
                                        const kr_kernel *kernel, double spin_unit, int is_slow)
{
    kr_series *s = p->series;
    const int n = kernel->order, slides = s->slides != 0.0, deep = kr_taylor_is_extended(motion);
    const double noise = spin_unit * NEGLIGIBLE_SPIN, most = 1.0 + NEGLIGIBLE_SPIN;
    const double first = slides ? find_friction_crossing_part(s, n, p->sliding, noise)
                                : find_friction_crossing_part(s, n, 1.0, most),
                 second = slides ? INFINITY : find_friction_crossing_part(s, n, -1.0, most);
    const double span = s->end - s->t;
    const int passes = slides && !(first < INFINITY) && spin_crosses_zero(s, n, p->sliding, noise);
    const double part = passes ? 1.0 : fmin(first, second);
    if (part < INFINITY) {
        const double value = slides            ? 0.0
                             : first <= second ? -1.0
                                               : 1.0,
                     beyond = slides ? -p->sliding * noise : most * value;
        dd h = refine_friction_crossing(s, n, value, part * span, noise);
        /* At the beginning of the step, a spin below `noise` may already have the opposite sign. */
        if (!(h.hi * span > 0.0)) h = refine_friction_crossing(s, n, beyond, part * span, 0.0);
        if (!(h.hi * span > 0.0)) h = dd_of(NARROW_PART * span);
        end_step_after_time(s, kernel, deep, h);
        kr_support_place(s, motion, p->rate);
        update_friction_mode(p, motion, n, value, is_slow);
    } else if (!slides) {
        remove_end_spin(s);
    }
    s[0].end_w[0] = s[1].end_w[0] = 0.0;
}
static int find_tangent_jump_factor(const kr_motion *motion, int order, dd *factor)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_series *s = p->series;
    const double before = kr_support_sliding(s),
                 friction = kr_support_friction_torque(motion, p->rate);
    const int is_start = s->slides == 0.0 && s->holds == 0.0;
    if (!(friction > 0.0) || s->holds != 0.0 || (!is_start && p->sliding == before)) return 0;
    if (p->sliding == 0.0) {
        *factor = dd_times(friction, dd_make(s[0].per_grip, s[1].per_grip));
        return motion->step >= 0.0;
    }
    if (is_start) {
        *factor = dd_of(NAN);
        return fabs(find_end_spin(s).hi) <= initial_spin_threshold(motion);
    }
    *factor = dd_div(dd_of(-2.0 * before * friction), find_end_friction_slope(s, order));
    return 1;
}
static void find_end_derivatives(const kr_motion *motion, double x_rate[8], double w_rate[4])
{
    const kr_series *s = taylor_of(motion)->series;
    const kr_vec3 W = v_of(s->end_w + 1), O = v_of(s->turn + 1), P = v_of(s->end_x + 5),
                  U = v_sub(W, O);
    const kr_quat q = q4(s->end_x[0], v_of(s->end_x + 1)),
                  rate = q_scale(0.5, q_mul(q, q4(0.0, U)));
    kr_vec3 gain = kr_taylor_acceleration(s);
    if (s->slides != 0.0) gain = v_add(gain, v_of(s->rub + 1));
    if (s->holds != 0.0) gain = v_axpy(-frictionless_spin_derivative(s), v_of(s->yield + 1), gain);
    x_rate[0] = rate.w;
    v_put(x_rate + 1, q_vec(rate));
    x_rate[4] = w_rate[0] = 0.0;
    v_put(x_rate + 5, v_cross(P, U));
    v_put(w_rate + 1, gain);
}
static kr_status step_with_support(kr_motion *motion, const kr_kernel *kernel)
{
    kr_taylor *p = taylor_of(motion);
    kr_series *s = p->series;
    const double forward = motion->step < 0.0 ? -1.0 : 1.0;
    const int rubs = motion->scene->friction > 0.0;
    double log2_tol = p->log2_tol, unit = 1.0;
    if (rubs && p->sliding == 0.0 && forward < 0.0) return KR_ERR_STOPPED;
    const int is_slow = kr_slow_step(motion, kernel, &kr_supports, &log2_tol);
    if (!is_slow) {
        /* While the top slides, choose a unit of time in which friction does not shorten steps. */
        if (rubs)
            kr_taylor_set_rate(p, motion,
                               p->sliding == 0.0 ? p->held_rate : fmax(p->rate, p->first_rate),
                               &kr_supports);
        kr_support_set_mode(motion);
        s[1].t = s[1].end;
        s[1].end = 0.0;
        /* With strong damping, the spin is of the size of the lowered tolerance. */
        if (log2_tol < p->log2_tol)
            unit = fmax(exp2(log2_tol - p->log2_tol), fmin(v_largest(v_of(s->end_w + 1)), 1.0));
        kernel->advance(s, log2_tol, forward);
        kr_support_place(s, motion, p->rate);
    }
    if (rubs) end_step_at_friction_switch(p, motion, kernel, unit, is_slow);
    return KR_OK;
}

const kr_support_ops kr_supports = {.rate = kr_support_rate,
                                    .set_constants = kr_support_set_constants,
                                    .place = kr_support_place,
                                    .limit_steps = kr_support_limit_steps,
                                    .set_mode = kr_support_set_mode,
                                    .sliding = kr_support_sliding,
                                    .find_held = kr_slow_find_held,
                                    .start = set_initial_friction_mode,
                                    .step = step_with_support,
                                    .slopes = find_end_derivatives,
                                    .jumps = find_tangent_jump_factor,
                                    .expand_tangents = FOR_TANGENTS(kr_support_expand_tangents),
                                    .jump_tangents = FOR_TANGENTS(kr_support_jump_tangents)};
