/* Motion with strong damping. If damping about an axis is much faster than all other effects, the
 * torque determines the angular velocity about this axis, after a transient that decays as
 * exp(-D t / A) (Fenichel 1979). The motion then stays on a slow manifold, where the Taylor
 * coefficients of the angular velocity about this axis satisfy, in the notation of taylor.h,
 *     D U_n - h x W_n = (AW x W + G P x c)_n - (n+1) A W_{n+1},   W_n = O_n + U_n
 * This equation is solved by iteration (slow_terms.h). O is the angular velocity of the support,
 * and U that of the top relative to the support. G is the effective gravity on a shaken support
 * (series.h). On a support at rest, U = W and G = 1. The rotor torque h x W is on the left side,
 * because it is linear in W and may exceed the damping torque. All other coefficients are computed
 * by the explicit recurrence of taylor.h. The radius of convergence is that of the slow motion, so
 * steps can be long. The explicit recurrence alone would limit steps to about one damping time
 * A / D, because the problem is stiff. It is used until the motion reaches the manifold, with an
 * absolute tolerance proportional to the small angular velocity that the top has on the manifold. A
 * motion that has reached the manifold stays there, although rounding errors grow relative to the
 * angular velocity while the top comes to rest. While a top with dry friction slides, the friction
 * torque is constant. While friction holds the top, that is, keeps the spin about the apex zero,
 * damping acts only about the two directions normal to the apex. u_i is the component of U along a
 * direction v_i, and d_i its damping rate (slow_directions.h). */
#include <string.h>
#include "math/dd.h"
#include "model/scene.h"
#include "slow.h"
#include "support_setup.h"

/* First rows of the table of Taylor coefficients in slow_terms.h: of q, P, the friction variable,
 * W, U, O, G, G P, and the u_i while friction holds the top. The first ROWS_OF_SERIES rows are
 * those of x and w in kr_series. The rows from ROW_U on are for support terms (series.h) only. */
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
/* The first rows of U, of the u_i and of G P. U shares the rows of W if O = 0, the u_i share those
 * of U unless friction holds the top, and G P shares those of P unless the support shakes. */
#define U_OF(slow) ((slow)->turns ? ROW_U : ROW_W)
#define U_ROW(slow) ((slow)->is_held ? ROW_R : U_OF(slow))
#define GP_OF(slow) ((slow)->shakes ? ROW_GP : ROW_P)
/* Angular velocities below TINY_VELOCITY, in the units of the series, are treated as zero. */
#define TINY_VELOCITY 0x1p-400
#define LOG2_AT_REST 900.0
/* An error of an angular velocity is compared with its magnitude, but at least with NEGLIGIBLE
 * times the largest angular velocity. On a rotating support, it is compared with at least ROUNDED
 * times the support's angular velocity, which has rounding errors. */
#define NEGLIGIBLE 0x1p-64
#define ROUNDED 0.25
/* Rounding error of the difference between two doubles, relative to the larger of them. */
#define ROUNDING 0x1p-50
/* The test for the slow manifold is repeated after this part of the time estimated to reach it. */
#define PATIENCE 0.5
/* A transient has decayed after SETTLED / d_i: exp(-SETTLED) is below any rounding error. */
#define SETTLED 128.0
/* Larger than any relative distance from the slow manifold (choose_manifold_tolerance). */
#define UNRESOLVED 0x1p500
#define LOG_OF_2 0.6931471805599453

#include "slow_directions.h"

static kr_vec3 get_support_velocity(const kr_series *s, const slow_directions *slow)
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
    const kr_vec3 O = get_support_velocity(s, slow), U = v_sub(v_of(s->end_w + 1), O);
    kr_vec3 sum = O;
    for (int i = 0; i < slow->count; i++)
        if (!slow->is_slow[i])
            sum = v_axpy(v_dot(high_words(slow->dual[i]), U), high_words(slow->v[i]), sum);
    return sum;
}
/* Writes to bound[i], in the units of the series, an upper bound on the strongly damped u_i that
 * the torques at the end of the last step cause on the slow manifold, or 0 for a weakly damped u_i.
 * Products of two strongly damped u_i are neglected. */
static void bound_damped_velocities(const kr_taylor *p, const slow_directions *slow,
                                    double bound[3])
{
    const kr_series *s = p->series;
    const double *P = s->end_x + 5, *w = s->end_w + 1, most = largest_effective_gravity(s);
    double torque[3], own[3], turn[3];
    const kr_vec3 rest = find_weakly_damped_velocity(s, slow);
    v_put(own, rest);
    v_put(turn, v_cross(get_support_velocity(s, slow), rest));
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
/* Writes `bound` (bound_damped_velocities). Returns the velocity by which the relative tolerance
 * is multiplied: the smallest non-negligible bound[i] on a strongly damped u_i, or the largest
 * angular velocity if all are 0. On a rotating support or while friction holds the top, the result
 * is at least ROUNDED times the other velocities whose rounding errors enter u_i. */
static double find_error_scale(const kr_taylor *p, const slow_directions *slow, double bound[3])
{
    const kr_series *s = p->series;
    const kr_vec3 known =
        slow->is_held ? find_weakly_damped_velocity(s, slow) : get_support_velocity(s, slow);
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
/* Returns the velocity to which distances from the slow manifold are relative, given the error
 * scale of its directions. After a step with the larger set `strong` has failed, the tolerance of a
 * step is relative to the error scale of `strong`, and a distance may be an error of such steps. */
static double find_distance_scale(const kr_taylor *p, double error_scale,
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

/* Returns an upper bound, in internal units (method.h), on the rates of the support and of the
 * undamped top, now and later, if its angular velocity now is `velocity`. */
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
/* Returns an upper bound on the sum of the torques due to weight, gravity gradient, sliding
 * friction and the rotation of the support, in internal units (method.h). */
static double bound_undamped_torque(const kr_motion *motion)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_series *s = p->series;
    if (s->linear == 1.0) return v_length(motion->lever);
    const kr_vec3 A = motion->inertia;
    const double turning = support_angular_speed(p), square = p->rate * p->rate,
                 pull = square * v_length(v_times(A, v_of(s->up + 1))) +
                        fabs(motion->gradient) * v_largest(A),
                 friction = s->slides != 0.0 ? kr_support_friction(motion, 1.0) : 0.0;
    return pull * largest_effective_gravity(s) + friction +
           turning * (2.0 * v_largest(A) * turning + v_length(motion->rotor));
}
/* Returns log2 of the largest absolute n-th coefficient of q, P and W, or -LOG2_AT_REST if all are
 * zero. In log2_step_size, h^n is then about 2^LOG2_AT_REST, which does not overflow. */
static double log2_norm(const kr_series *s, int n)
{
    double size = 0.0;
    for (int i = 0; i < 8; i++) size = fmax(size, fabs(s->x[n][i]));
    for (int i = 0; i < 4; i++) size = fmax(size, fabs(s->w[n][i]));
    return size > 0.0 ? log2(size) : -LOG2_AT_REST;
}
/* Returns log2 of the largest step size h for which h^n times the largest absolute Taylor
 * coefficient of order n or n - 1 does not exceed the tolerance. */
static double log2_step_size(const kr_series *s, int n, double log2_tol)
{
    return fmin((log2_tol - log2_norm(s, n)) / n, (log2_tol - log2_norm(s, n - 1)) / n);
}
static double log2_absolute_tolerance(const kr_taylor *p, const slow_directions *slow)
{
    double bound[3];
    return p->log2_tol + log2(find_error_scale(p, slow, bound));
}

/* Ends the step where the last Taylor terms are 2^log2_tol, and evaluates the series there. With
 * more than 16 digits, the terms after the order `head` are evaluated in double precision, so they
 * must be less than 2^52 times 2^log2_tol. */
static void end_step_by_tolerance(kr_taylor *p, const kr_motion *motion, const kr_kernel *kernel,
                                  const slow_directions *slow, double log2_tol)
{
    kr_series *s = p->series;
    const int order = kernel->order, head = motion->digits > 20 ? KR_HEAD_30 : KR_HEAD_20;
    double step = log2_step_size(s, order, log2_tol);
    if (motion->digits > 16) step = fmin(step, log2_step_size(s, head + 2, log2_tol + 52.0));
    /* The low words of the terms after the head must be zero for refine_friction_crossing, because
     * the evaluation of the series ignores them. */
    for (int n = head + 1; n <= order; n++) s[1].w[n][0] = 0.0;
    const double longest = slow->fall > 0.0 ? order / 6.0 * (p->rate / slow->fall) : INFINITY;
    s[0].t = s[0].end;
    s[1].t = s[1].end;
    s[0].at = s[0].t + fmin(exp2(step), longest);
    s[1].at = 0.0;
    kr_taylor_end_at(s, kernel);
    if (slow->supports) slow->supports->place(s, motion, p->rate);
}
/* Returns 1 if an expansion on the slow manifold is worth trying: the distance |u_i'| / d_i of each
 * strongly damped u_i from it is at most the largest of bound[i] / 4 (bound_damped_velocities),
 * `near` times find_distance_scale and, after the transient (`is_settled`), |u_i| / 4. */
static int may_be_near_manifold(const kr_taylor *p, const slow_directions *slow,
                                const slow_directions *strong, double near, int is_settled)
{
    const kr_series *s = p->series;
    const kr_vec3 O = get_support_velocity(s, slow), W = v_of(s->end_w + 1),
                  rub = slow->slides ? v_of(s->rub + 1) : v3(0.0, 0.0, 0.0),
                  rate = v_add(v_sub(kr_taylor_acceleration(s), v_cross(O, W)), rub);
    /* Rounding error of the change of u_i, which is computed from differences of velocities. */
    const double rounding = slow->turns || slow->is_held ? ROUNDING * v_largest(W) : 0.0,
                 share = is_settled ? 0.25 : 0.0;
    double change[3] = {0.0, 0.0, 0.0}, bound[3];
    const double scale = find_distance_scale(p, find_error_scale(p, slow, bound), strong),
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
/* Returns the largest distance from the slow manifold, relative to the bounds on the u_i, at which
 * the motion counts as on the manifold: `near` while the transient decays, and 1 after damping
 * about the same axes has been strong for SETTLED damping times. The remaining distance is then a
 * rounding error, which is large relative to the angular velocity of a top almost at rest. If the
 * damping time is below the resolution of the time `clock`, the result is UNRESOLVED. */
static double choose_manifold_tolerance(kr_taylor *p, const slow_directions *slow, double clock,
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
/* Tries to compute a step on the slow manifold that results from strong damping about the axes
 * marked in `slow`. `strong` is NULL if these are all strongly damped axes. Otherwise, `strong`
 * marks all of them, and a step with all of them has failed. Returns 1 on success. */
static int step_on_manifold(kr_taylor *p, const kr_motion *motion, const kr_kernel *kernel,
                            const slow_directions *slow, const slow_directions *strong)
{
    const double before = p->rate, near = exp2(p->log2_tol + 6.0), clock = p->series->end / p->rate;
    const double off = strong ? near : choose_manifold_tolerance(p, slow, clock, near);
    double wait = 0.0;
    int exponent;
    if (!strong && clock < p->try_slow) return 0;
    if (off < UNRESOLVED && !may_be_near_manifold(p, slow, strong, near, off >= 1.0)) return 0;
    frexp(slow->rate, &exponent);
    if (slow->rate > 0.0) kr_taylor_set_rate(p, motion, ldexp(1.0, exponent), slow->supports);
    const double friction = slow->is_held ? kr_support_friction(motion, p->rate) : 0.0;
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
/* Returns 0 if the next step certainly does not lie on a slow manifold. On a moving support, the
 * damping rates are compared with the angular velocity, because this comparison often makes the
 * more expensive bound_undamped_rate unnecessary. */
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
/* Initializes all members of `slow` except for the choice of the strongly damped directions.
 * Returns 0 if no damping rate is large compared with `undamped`, the rate of the undamped top. */
static int find_damping_directions(const kr_motion *motion, double undamped,
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
/* Returns log2 of the tolerance for strongly damped steps that are not on a slow manifold. Errors
 * are relative to the angular velocity, which is about the rate `undamped` of other effects, and
 * thus less than p->rate, the unit of the series. */
static double log2_transient_tolerance(const kr_taylor *p, double undamped)
{
    return p->log2_tol + log2(fmax(fmin(undamped / p->rate, 1.0), NEGLIGIBLE));
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
    const int is_damped = find_damping_directions(motion, undamped, supports, &slow),
              count = p->has_tangents == 0.0 ? slow.count : 0;
    for (int i = 0; i < count; i++) {
        if (!mark_strong_directions(&slow, i, undamped, pull)) continue;
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
/* Torques that change the growth rate of the angular momentum by less than the fraction
 * SMALL_TORQUE are neglected. The computed growth rate is multiplied by CERTAIN < 1 as a margin. */
#define SMALL_TORQUE 0.0025
#define CERTAIN 0.98
/* Let y^2 = <U, A U>, and let tau be the time counted backward. Damping increases y: dy/dtau >=
 * `growth` y - `loss`, where `loss` bounds the effect of all other torques. The function tests
 * whether the integral of the resulting lower bound on |U| >= y / sqrt(most) exceeds 2^53. */
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
/* Backward in time, damping makes the magnitude L of the angular momentum grow. If the damping D is
 * the same about all axes and no other torque acts, the relative growth rate is D <W, A W> / L^2,
 * which does not decrease backward in time. Small additional torques hardly change this rate. Hence
 * the angular velocity exceeds `limit` in time if exponential growth at the initial rate does. */
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
