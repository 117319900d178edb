/* Motion with strong damping. A are the moments of inertia, D the damping coefficients, P is the
 * vertical, c the lever arm, h the momentum of a rotor, and W the angular velocity of the top, all
 * along the principal axes (taylor.h). O is the angular velocity of the support, U = W - O that of
 * the top relative to the support, and G the effective gravity (series.h). On a support at rest,
 * U = W and G = 1. The unit of time of the series is 1 / p->rate (kr_taylor). Let damping about an
 * axis be much faster than all other effects. After a transient that decays as exp(-D t / A), the
 * damping torque about this axis balances all other torques: the motion stays on a slow manifold
 * (Fenichel 1979). Without dry friction, the n-th Taylor coefficients about this axis satisfy
 *     D U_n - h x W_n = (AW x W + G P x c)_n - (n+1) A W_{n+1}
 * This equation is solved by iteration (slow_terms.h). The rotor torque h x W is on the left side,
 * because it is linear in W and may exceed the damping torque. The attitude, P, and the angular
 * velocities about weakly damped axes are expanded by the explicit recurrence of taylor.h. For all
 * axes, it would limit steps to about one damping time A / D (the problem is stiff). On the
 * manifold, steps are much longer. Before the motion reaches the manifold, steps are computed by
 * that recurrence, with an absolute tolerance: the relative one times a bound on the angular
 * velocity (log2_transient_tolerance, log2_absolute_tolerance). The component of U along v_i is
 * u_i, its damping rate d_i (slow_directions.h). The v_i are the principal axes or, while dry
 * friction holds the top, perpendicular to the apex (kreisel.h). */
#include <string.h>
#include "math/dd.h"
#include "model/scene.h"
#include "slow.h"
#include "support_setup.h"

/* Index of the first row of each quantity in the table of Taylor coefficients (slow_terms.h): q, P,
 * the friction variable (series.h), W, U, O, G, G P, and the u_i while friction holds the top. Rows
 * below ROWS_OF_SERIES are copied to kr_series.x and kr_series.w. */
enum {
    ROW_Q = 0,
    ROW_P = 5,
    ROW_FRICTION = 8,
    ROW_W = 9,
    ROWS_OF_SERIES = 12,
    ROW_U = 12,
    ROW_O = 15,
    ROW_G = 18,
    ROW_GP = 19,
    ROW_R = 22,
    ROWS = 24,
    SWEEPS = 64
};
/* First row of U (U_OF), the u_i (U_ROW) and G P (GP_OF) in that table. Equal quantities share
 * rows: u_i = U_i unless friction holds the top, U = W unless the support rotates, and G P = P
 * unless the support shakes. */
#define U_OF(slow) ((slow)->turns ? ROW_U : ROW_W)
#define U_ROW(slow) ((slow)->is_held ? ROW_R : U_OF(slow))
#define GP_OF(slow) ((slow)->shakes ? ROW_GP : ROW_P)
/* Angular velocities below TINY_VELOCITY, in the units of the series, are treated as zero. */
#define TINY_VELOCITY 0x1p-400
#define LOG2_AT_REST 900.0
/* Lower limits of find_error_scale: NEGLIGIBLE times the largest bound or component of W; ROUNDED
 * times that of O or, while friction holds the top, that of W without its strongly damped part. */
#define NEGLIGIBLE 0x1p-64
#define ROUNDED 0.25
/* Rounding error of the difference between two doubles, relative to the larger of them. */
#define ROUNDING 0x1p-50
/* The test for the slow manifold is repeated after this part of the time estimated to reach it. */
#define PATIENCE 0.5
/* A transient has decayed after SETTLED / d_i: exp(-SETTLED) is below any rounding error. */
#define SETTLED 128.0
/* Larger than any relative distance from the slow manifold (choose_manifold_threshold). */
#define UNRESOLVED 0x1p500
#define LOG_OF_2 0.6931471805599453

#include "slow_directions.h"

static kr_vec3 get_support_angular_velocity(const kr_series *s, const slow_directions *slow)
{
    return slow->turns ? v_of(s->turn + 1) : v3(0.0, 0.0, 0.0);
}
static double largest_effective_gravity(const kr_series *s)
{
    return s->linear > 1.0 ? fabs(s->sway[3]) + fabs(s->sway_most) : 1.0;
}
/* Returns W at the end of the last step without the strongly damped components u_i v_i. */
static kr_vec3 find_weakly_damped_velocity(const kr_series *s, const slow_directions *slow)
{
    const kr_vec3 O = get_support_angular_velocity(s, slow), U = v_sub(v_of(s->end_w + 1), O);
    kr_vec3 sum = O;
    for (int i = 0; i < slow->count; i++)
        if (!slow->is_slow[i])
            sum = v_axpy(v_dot(high_words(slow->dual[i]), U), high_words(slow->v[i]), sum);
    return sum;
}
/* Writes to bound[i] an approximate upper bound, in the units of the series, on |u_i| on the slow
 * manifold at the end of the last step, or 0 for a weakly damped u_i. The u_i' and products of two
 * strongly damped u_i are neglected. */
static void bound_damped_velocities(const kr_taylor *p, const slow_directions *slow,
                                    double bound[3])
{
    const kr_series *s = p->series;
    const double *P = s->end_x + 5, *w = s->end_w + 1, most = largest_effective_gravity(s);
    double torque[3], own[3], turn[3];
    const kr_vec3 rest = find_weakly_damped_velocity(s, slow);
    v_put(own, rest);
    v_put(turn, v_cross(get_support_angular_velocity(s, slow), rest));
    for (int a = 0; a < 3; a++) {
        const int lane = a + 1, j = (a + 1) % 3, k = (a + 2) % 3;
        const double product = w[j] * w[k] - (w[j] - own[j]) * (w[k] - own[k]),
                     rotor = own[j] * s->shift[lane] + own[k] * s->shift[lane + 4];
        torque[a] = most * (fabs(s->up[lane] * P[j]) + fabs(s->down[lane] * P[k])) +
                    fabs(s->k[lane]) * (fabs(product) + fabs(rotor)) + fabs(turn[a]) +
                    (slow->slides ? fabs(s->rub[lane]) : 0.0);
    }
    for (int i = 0; i < 3; i++) bound[i] = 0.0;
    for (int k = 0; k < slow->count; k++) {
        double alone = 0.0;
        if (!slow->is_slow[k]) continue;
        for (int a = 0; a < 3; a++) alone += fabs(slow->dual[k][a].hi) * torque[a];
        alone *= p->rate / slow->drag[k].hi;
        for (int i = 0; i < slow->count; i++)
            bound[i] += slow->is_slow[i] ? fabs(slow->gain[i][k]) * alone : 0.0;
    }
}
/* Writes `bound` (bound_damped_velocities). Returns the velocity, in the units of the series, that
 * multiplies the relative tolerance: the smallest positive bound[i] or, without one, the largest
 * component of W. NEGLIGIBLE, ROUNDED and TINY_VELOCITY set lower limits. */
static double find_error_scale(const kr_taylor *p, const slow_directions *slow, double bound[3])
{
    const kr_series *s = p->series;
    const kr_vec3 known = slow->is_held ? find_weakly_damped_velocity(s, slow)
                                        : get_support_angular_velocity(s, slow);
    double least = 1.0, largest = 0.0;
    bound_damped_velocities(p, slow, bound);
    for (int i = 0; i < slow->count; i++) {
        largest = fmax(largest, bound[i]);
        if (bound[i] > 0.0) least = fmin(least, bound[i]);
    }
    const double most = fmax(largest, v_largest(v_of(s->end_w + 1))),
                 rounded = fmax(v_largest(known), slow->is_held ? largest : 0.0);
    least = fmax(fmin(fmax(least, NEGLIGIBLE * most), most), ROUNDED * rounded);
    return fmax(least, TINY_VELOCITY);
}
/* Returns the velocity that divides distances from the slow manifold: `error_scale`
 * (find_error_scale). If a step with a larger set of directions, `strong`, has failed: at least the
 * error scale of `strong`, on which the tolerance of earlier steps depends. */
static double find_manifold_distance_scale(const kr_taylor *p, double error_scale,
                                           const slow_directions *strong)
{
    double bound[3];
    return strong ? fmax(error_scale, find_error_scale(p, strong, bound)) : error_scale;
}

#include "math/real.h"
#include "slow_terms.h"
#define KR_DEEP
#include "math/real.h"
#include "slow_terms.h"

/* Returns an upper bound, in internal units (method.h), on the rates of the undamped motion: on the
 * angular speed that the top can reach from the angular velocity `velocity` and, if `supports` is
 * not NULL, also on the rate at which the support rotates and on that at which it shakes. */
static double bound_undamped_rate(const kr_motion *motion, kr_vec3 velocity,
                                  const kr_support_ops *supports)
{
    const kr_vec3 A = motion->inertia;
    const double twice = v_dot(v_times(A, velocity), velocity) + 4.0 * v_length(motion->lever),
                 own = sqrt(twice / fmin(A.x, fmin(A.y, A.z)));
    return supports ? fmax(own, supports->rate(motion, velocity, 1)) : own;
}
static double support_angular_speed(const kr_taylor *p)
{
    const kr_series *s = p->series;
    return s->linear > 1.0 ? p->rate * v_length(v_of(s->turn + 1)) : 0.0;
}
/* Returns an upper bound, in internal units (method.h), on the sum of the torques due to weight,
 * gravity gradient, sliding friction and the rotation of the support. */
static double bound_undamped_torque(const kr_motion *motion)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_series *s = p->series;
    if (s->linear == 1.0) return v_length(motion->lever);
    const kr_vec3 A = motion->inertia;
    const double turning = support_angular_speed(p), square = p->rate * p->rate,
                 pull = square * v_length(v_times(A, v_of(s->up + 1))) +
                        fabs(motion->gradient) * v_largest(A),
                 friction = s->slides != 0.0 ? kr_support_friction_torque(motion, 1.0) : 0.0;
    return pull * largest_effective_gravity(s) + friction +
           turning * (2.0 * v_largest(A) * turning + v_length(motion->rotor));
}
/* Returns log2 of the largest absolute n-th coefficient, or -LOG2_AT_REST if all are zero. */
static double log2_norm(const kr_series *s, int n)
{
    double size = 0.0;
    for (int i = 0; i < 8; i++) size = fmax(size, fabs(s->x[n][i]));
    for (int i = 0; i < 4; i++) size = fmax(size, fabs(s->w[n][i]));
    return size > 0.0 ? log2(size) : -LOG2_AT_REST;
}
/* Returns log2 of the step size h for which h^n times the largest coefficient (log2_norm) of orders
 * n - 1 and n is at most 2^log2_tol. In even or odd series, one order has only zeros. */
static double log2_step_size(const kr_series *s, int n, double log2_tol)
{
    return fmin((log2_tol - log2_norm(s, n)) / n, (log2_tol - log2_norm(s, n - 1)) / n);
}
static double log2_absolute_tolerance(const kr_taylor *p, const slow_directions *slow)
{
    double bound[3];
    return p->log2_tol + log2(find_error_scale(p, slow, bound));
}

/* Ends the step where the last Taylor terms are 2^log2_tol, and evaluates the series there. The
 * step is at most order / (6 slow->fall) in internal units: `fall` is the largest rate of falling
 * over or shaking. With more than 16 digits, terms after the index `head` are evaluated in double
 * precision; the step is short enough that they are at most 2^(log2_tol + 52). */
static void end_step_by_tolerance(kr_taylor *p, const kr_motion *motion, const kr_kernel *kernel,
                                  const slow_directions *slow, double log2_tol)
{
    kr_series *s = p->series;
    const int order = kernel->order, head = motion->digits > 20 ? KR_HEAD_30 : KR_HEAD_20;
    double step = log2_step_size(s, order, log2_tol);
    if (motion->digits > 16) step = fmin(step, log2_step_size(s, head + 2, log2_tol + 52.0));
    /* The evaluation of the series ignores low words after the head, but refine_friction_crossing
     * (support_motion.c) does not. So low words of the friction variable are set to 0. */
    for (int n = head + 1; n <= order; n++) s[1].w[n][0] = 0.0;
    const double longest = slow->fall > 0.0 ? order / 6.0 * (p->rate / slow->fall) : INFINITY;
    s[0].t = s[0].end;
    s[1].t = s[1].end;
    s[0].at = s[0].t + fmin(exp2(step), longest);
    s[1].at = 0.0;
    kr_taylor_end_at(s, kernel);
    if (slow->supports) slow->supports->place(s, motion, p->rate);
}
/* Returns 0 if an expansion on the slow manifold is not worth trying: if a strongly damped u_i
 * differs from its estimated value there by more than bound[i] / 4, its rounding error, `near`
 * times find_manifold_distance_scale and, if `is_settled` is 1, 1/4 of the component of W along v_i
 * there. The estimated difference is the sum over the strong u_k of slow->gain[i][k] u_k' / d_k. */
static int may_be_near_manifold(const kr_taylor *p, const slow_directions *slow,
                                const slow_directions *strong, double near, int is_settled)
{
    const kr_series *s = p->series;
    const kr_vec3 O = get_support_angular_velocity(s, slow), W = v_of(s->end_w + 1),
                  rub = slow->slides ? v_of(s->rub + 1) : v3(0.0, 0.0, 0.0),
                  rate = v_add(v_sub(kr_taylor_acceleration(s), v_cross(O, W)), rub);
    /* Rounding error of the change of u_i, which is computed from differences of velocities. */
    const double rounding = slow->turns || slow->is_held ? ROUNDING * v_largest(W) : 0.0,
                 share = is_settled ? 0.25 : 0.0;
    double change[3] = {0.0, 0.0, 0.0}, bound[3];
    const double scale = find_manifold_distance_scale(p, find_error_scale(p, slow, bound), strong),
                 noise = fmax(fmax(near * scale, rounding), TINY_VELOCITY);
    for (int k = 0; k < slow->count; k++) {
        if (!slow->is_slow[k]) continue;
        const double off = v_dot(high_words(slow->dual[k]), rate) * p->rate / slow->drag[k].hi;
        for (int i = 0; i < slow->count; i++) change[i] += slow->gain[i][k] * off;
    }
    for (int i = 0; i < slow->count; i++) {
        const double own = v_dot(high_words(slow->dual[i]), W) + change[i],
                     allowed = fmax(fmax(0.25 * bound[i], noise), share * fabs(own));
        if (slow->is_slow[i] && fabs(change[i]) > allowed) return 0;
    }
    return 1;
}
/* Returns the relative distance (is_on_manifold in slow_terms.h) up to which the motion counts as
 * on the manifold: `near` during the transient, and 1 after it, that is, after damping about the
 * same axes has been strong for SETTLED damping times (p->settled). A rounding error may then be
 * large relative to the velocity of a top almost at rest. If the damping time is below the rounding
 * error of the time `clock`, returns UNRESOLVED, which accepts any distance. Updates p->settling
 * and p->settled. */
static double choose_manifold_threshold(kr_taylor *p, const slow_directions *slow, double clock,
                                        double near)
{
    double axes = 0.0, weakest = INFINITY;
    for (int i = 0; i < slow->count; i++) {
        if (!slow->is_slow[i]) continue;
        axes += 1 << i;
        weakest = fmin(weakest, slow->drag[i].hi);
    }
    if (p->settling != axes) p->settled = clock + SETTLED / weakest;
    p->settling = axes;
    if (clock + 0.5 / weakest == clock) return UNRESOLVED;
    return clock >= p->settled ? 1.0 : near;
}
/* Tries to compute a step on the slow manifold due to strong damping about the directions marked in
 * `slow`. Returns 1 on success. If a step with a larger set of directions has failed before,
 * `strong` marks that set, else `strong` is NULL. */
static int step_on_manifold(kr_taylor *p, const kr_motion *motion, const kr_kernel *kernel,
                            const slow_directions *slow, const slow_directions *strong)
{
    const double before = p->rate, near = exp2(p->log2_tol + 6.0), clock = p->series->end / p->rate;
    const double off = strong ? near : choose_manifold_threshold(p, slow, clock, near);
    double wait = 0.0;
    int exponent;
    if (!strong && clock < p->try_slow) return 0;
    if (off < UNRESOLVED && !may_be_near_manifold(p, slow, strong, near, off >= 1.0)) return 0;
    frexp(slow->rate, &exponent);
    if (slow->rate > 0.0) kr_taylor_set_rate(p, motion, ldexp(1.0, exponent), slow->supports);
    const double friction = slow->is_held ? kr_support_friction_torque(motion, p->rate) : 0.0;
    if (kr_taylor_is_extended(motion)
            ? deep_expand_on_manifold(p, slow, strong, kernel->order, off, 0x1p-96, friction, &wait)
            : plain_expand_on_manifold(p, slow, strong, kernel->order, off, 0x1p-48, friction,
                                       &wait)) {
        end_step_by_tolerance(p, motion, kernel, slow,
                              strong ? log2_absolute_tolerance(p, strong) : p->log2_tol);
        return 1;
    }
    if (!strong) p->try_slow = clock + PATIENCE * wait / p->rate;
    kr_taylor_set_rate(p, motion, before, slow->supports);
    return 0;
}
/* Returns 0 if the next step certainly does not lie on a slow manifold. With friction or a moving
 * support, the largest damping rate is compared with the angular velocity, because this often saves
 * the more expensive bound_undamped_rate. */
static int may_step_on_manifold(const kr_motion *motion)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_series *s = p->series;
    const double *w = s->end_w + 1, *drag = s->drag + 1;
    if (s->linear == 0.0 || motion->step < 0.0 || motion->gradient != 0.0) return 0;
    if (s->linear == 1.0) return 1;
    return -fmin(drag[0], fmin(drag[1], drag[2])) >
           STRONG_ALONE * fmax(fabs(w[0]), fmax(fabs(w[1]), fabs(w[2])));
}
/* Initializes `slow`, except for the members that try_strong_directions sets. Returns 0 if no
 * damping rate exceeds STRONG_ALONE times `undamped`, a bound on the rate of the undamped top. */
static int find_directions_if_damped(const kr_motion *motion, double undamped,
                                     const kr_support_ops *supports, slow_directions *slow)
{
    const kr_series *s = taylor_of(motion)->series;
    memset(slow, 0, sizeof *slow);
    if (!(v_largest(v_over(motion->damping, motion->inertia)) > STRONG_ALONE * undamped)) return 0;
    if (supports) {
        slow->supports = supports;
        slow->turns = s->turns != 0.0;
        slow->shakes = s->shakes != 0.0;
        slow->slides = s->slides != 0.0;
        slow->shaking = slow->shakes ? motion->time_unit * motion->scene->shaking.rate : 0.0;
    }
    if (supports && s->holds != 0.0)
        supports->find_held(motion, slow);
    else
        set_principal_directions(motion, slow);
    return 1;
}
/* Returns log2 of the absolute tolerance for steps of a damped motion that are not on a slow
 * manifold: the relative tolerance times the largest undamped angular speed in the units of the
 * series, undamped_rate / p->rate. kr_slow_step may lower it (log2_absolute_tolerance). */
static double log2_transient_tolerance(const kr_taylor *p, double undamped_rate)
{
    return p->log2_tol + log2(fmax(fmin(undamped_rate / p->rate, 1.0), NEGLIGIBLE));
}
int kr_slow_step(kr_motion *motion, const kr_kernel *kernel, const kr_support_ops *supports,
                 double *log2_tol)
{
    kr_taylor *p = taylor_of(motion);
    const kr_vec3 velocity = v_scale(p->rate, v_of(p->series->end_w + 1));
    slow_directions slow, largest_set;
    const slow_directions *strong = NULL; /* the largest set of strongly damped directions */
    *log2_tol = p->log2_tol;
    if (!may_step_on_manifold(motion)) {
        p->settling = 0.0;
        return 0;
    }
    const double undamped = bound_undamped_rate(motion, velocity, supports),
                 pull = bound_undamped_torque(motion);
    if (supports) supports->set_mode(motion);
    const int is_damped = find_directions_if_damped(motion, undamped, supports, &slow),
              count = p->has_tangents == 0.0 ? slow.count : 0;
    for (int i = 0; i < count; i++) {
        if (!try_strong_directions(&slow, i, undamped, pull)) continue;
        if (step_on_manifold(p, motion, kernel, &slow, strong)) return 1;
        if (strong) continue;
        largest_set = slow;
        strong = &largest_set;
    }
    if (!strong) p->settling = 0.0;
    /* Reset the unit of time for steps that are not computed on a slow manifold. */
    const int is_held = supports && p->series->holds != 0.0;
    kr_taylor_set_rate(p, motion, is_held ? p->held_rate : fmax(p->rate, p->first_rate), supports);
    if (is_damped) *log2_tol = log2_transient_tolerance(p, undamped);
    if (strong) *log2_tol = fmin(*log2_tol, log2_absolute_tolerance(p, strong));
    return 0;
}
/* Without gravity, damping reduces the angular velocity at most at the rate `drag`. */
int kr_slow_is_possible(const kr_motion *motion, double until)
{
    const kr_taylor *p = taylor_of(motion);
    const double drag = v_largest(v_over(motion->damping, motion->inertia)),
                 left = v_largest(motion->lever) > 0.0 ? 0.0 : p->rate * exp(-drag * until);
    const kr_vec3 velocity = v_scale(left, v_of(p->series->end_w + 1));
    return motion->step < 0.0 ||
           !(drag <= STRONG_ALONE * bound_undamped_rate(motion, velocity, NULL));
}
/* If the angular velocity in the unit of the series exceeds 2^(OVERFLOW_LEAST + OVERFLOW_SHARE /
 * (n - 1)), squares of the Taylor coefficients of a series of order n may overflow. */
#define OVERFLOW_LEAST 5.0
#define OVERFLOW_SHARE 512.0
/* kr_slow_overflows neglects torques that change the growth rate of the angular momentum by less
 * than SMALL_TORQUE times this rate. It multiplies the growth rate by CERTAIN < 1 as a margin. */
#define SMALL_TORQUE 0.0025
#define CERTAIN 0.98
/* Let tau be the time counted backward, U the angular velocity relative to the support, A the
 * moments of inertia, `most` the largest, y^2 = <U, A U>. Due to damping, dy/dtau >= `growth` * y -
 * `loss`, where `loss` bounds the effect of other torques. As |U| >= y / sqrt(most), the integral
 * of |U| up to `until` has a lower bound. Returns 1 if it exceeds 2^53. */
int kr_slow_drives_apart(const kr_motion *motion, double until)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_vec3 A = motion->inertia, ratio = v_over(motion->damping, A);
    const double least = fmin(A.x, fmin(A.y, A.z)), most = v_largest(A);
    if (motion->step >= 0.0 || !(v_largest(motion->damping) > 0.0) || !isfinite(until)) return 0;
    const double turning = support_angular_speed(p),
                 growth = fmin(ratio.x, fmin(ratio.y, ratio.z)) - 4.0 * turning * most / least,
                 loss = bound_undamped_torque(motion) / sqrt(least);
    const kr_vec3 W = v_scale(p->rate, v_of(p->series->end_w + 1));
    const double y = sqrt(v_dot(v_times(A, W), W)) - sqrt(most) * turning - loss / growth;
    if (!(growth > 0.0 && y > 0.0)) return 0;
    return y / sqrt(most) * (exp(growth * fabs(until - motion->clock)) - 1.0) > 0x1p53 * growth;
}
/* Backward in time, damping makes the magnitude L of the angular momentum grow. If D is the same
 * about all axes and no other torque acts, the growth rate D <W, A W> / L^2 of log L does not
 * decrease. Small torques hardly change it. So L grows at least exponentially, with the initial
 * rate. Returns 1 if |W|, in the units of the series, exceeds `limit` before the time `until`. */
int kr_slow_overflows(const kr_motion *motion, int order, double until)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_vec3 A = motion->inertia, D = motion->damping, W = v_of(p->series->end_w + 1),
                  L = v_times(A, W);
    const double limit = exp2(OVERFLOW_LEAST + OVERFLOW_SHARE / (order - 1)), most = v_largest(A),
                 least = fmin(A.x, fmin(A.y, A.z)), square = v_dot(L, L), size = sqrt(square);
    if (motion->step >= 0.0) return 0;
    if (v_largest(W) > limit) return 1;
    if (D.x != D.y || D.y != D.z || v_largest(motion->rotor) > 0.0 || !isfinite(until)) return 0;
    const double growth = CERTAIN * D.x * (v_dot(W, L) / square),
                 loss = v_length(motion->lever) * most / least;
    if (!(loss < SMALL_TORQUE * growth * size * p->rate)) return 0;
    return size / most * exp(growth * fabs(until - motion->clock)) > limit;
}
