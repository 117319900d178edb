/* Motion with strong damping. If damping about an axis is much faster than all other effects, the
 * angular velocity about this axis is determined by the torque. The motion then stays on a slow
 * manifold, where the Taylor coefficients of the angular velocity about this axis satisfy
 *     D U_n - h x W_n = (AW x W + G P x c)_n - (n+1) A W_{n+1},   W_n = O_n + U_n
 * This equation is solved by iteration. O is the angular velocity of the support, and U is the
 * angular velocity of the top relative to the support. G is the effective gravity on a shaken
 * support (series.h). On a support at rest, U = W and G = 1. The rotor torque h x W is linear in
 * W, like the damping torque, and may exceed it. All other Taylor coefficients are computed by the
 * recurrence described in taylor.h. The radius of convergence of the Taylor series is that of the
 * slow motion, so steps can be long. With the explicit recurrence, steps would be limited to about
 * one damping time A / D, because the problem is stiff. The neglected transient decays as exp(-D t
 * / A), and is below the rounding errors (Fenichel 1979). Until the motion reaches the slow
 * manifold, steps are computed with the explicit recurrence. Before the slow manifold is reached,
 * the absolute error tolerance is proportional to the small angular velocity that the top has on
 * the manifold. After that, the motion stays on the manifold, whatever the rounding errors: while
 * the top comes to rest, they grow relative to its angular velocity. A top with dry friction has
 * two slow manifolds. While the top slides, the friction torque is constant. The case in which
 * friction holds the top is treated in slow_held.h. */
#include <string.h>
#include "math/dd.h"
#include "model/scene.h"
#include "slow.h"
#include "support_setup.h"

/* Rows of the table of Taylor coefficients in slow_terms.h. The table rows from ROW_U on are used
 * only for tops with friction or on moving supports. The table rows from ROW_R on hold the Taylor
 * coefficients of the velocities u_i (slow_held.h). */
enum {
    ROW_Q = 0,
    ROW_P = 4,
    ROW_W = 7,
    ROWS_AT_REST = 10,
    ROW_U = 10,
    ROW_O = 13,
    ROW_G = 16,
    ROW_GP = 17,
    ROW_R = 20,
    ROWS = 22,
    SWEEPS = 64
};
/* The rows of the relative angular velocity and of the effective gravity vector. */
#define U_OF(slow) ((slow)->turns ? ROW_U : ROW_W)
#define GP_OF(slow) ((slow)->shakes ? ROW_GP : ROW_P)
/* Damping about an axis is strong if its rate is more than STRONG times all other rates. If all
 * three axes are strongly damped, the smaller factor STRONG_ALONE is used instead of STRONG. */
#define STRONG 256.0
#define STRONG_ALONE 32.0
/* An angular velocity below TINY_VELOCITY, in the units of the series, counts as zero. */
#define TINY_VELOCITY 0x1p-400
#define LOG2_AT_REST 900.0
/* Errors of an angular velocity are relative to its magnitude, or to NEGLIGIBLE times the largest
 * angular velocity if that is larger. On a rotating support, errors are relative to at least
 * ROUNDED times the support's angular velocity, because this velocity has rounding errors. */
#define NEGLIGIBLE 0x1p-64
#define ROUNDED 0.25
/* Rounding error of the difference between two doubles, relative to the larger of them. */
#define ROUNDING 0x1p-50
/* If the motion has not reached the slow manifold, the test is repeated after PATIENCE times the
 * estimated time to reach it. */
#define PATIENCE 0.5
/* A transient has decayed after SETTLED times the damping time, because exp(-SETTLED) is below the
 * rounding errors of a double-double. */
#define SETTLED 128.0
/* A distance from the slow manifold that no motion exceeds, relative to the angular velocity. */
#define UNRESOLVED 0x1p500
#define LOG_OF_2 0.6931471805599453

/* Data of the strongly damped axes, in the units of the motion. `rate` is the largest rate of the
 * motion on the slow manifold, and `fall` is the largest rate at which the top falls over or its
 * support shakes. */
typedef struct held_directions held_directions;
typedef struct slow_axes {
    int is_slow[3], has_rotor, turns, shakes, slides;
    const struct kr_slow_kind *kind;
    const kr_support_ops *supports; /* NULL: the series has no terms of a support */
    /* Directions that replace the principal axes while friction holds the top; otherwise NULL. */
    const held_directions *held;
    double rate, fall;
    /* Matrix of the angular velocities about the strongly damped axes that result from normalized
     * torques. Each torque is normalized so that it causes the angular velocity 1 if no rotor
     * couples the axes. */
    double gain[3][3];
} slow_axes;

/* The directions about which strong damping is considered: the principal axes or, if friction holds
 * the top, the directions of slow_held.h. */
struct kr_slow_kind {
    int count; /* of axes or directions */
    /* Finds the directions. NULL for the principal axes. */
    void (*find)(const kr_motion *motion, held_directions *held);
    /* Marks all axes as strongly damped, except for the `rank` axes with the weakest damping.
     * Returns 1 if the damping of the marked axes dominates all effects with rates up to `undamped`
     * and torques up to `pull`. */
    int (*take)(const kr_motion *motion, int rank, double undamped, double pull, slow_axes *slow);
    /* Returns the smallest nonzero angular velocity about a strongly damped axis, or a negligible
     * velocity if that is larger. */
    double (*least_size)(const kr_series *s, const slow_axes *slow);
    /* Returns the damping rate about axis i, in the unit of time of the Taylor series. */
    double (*drag)(const kr_series *s, const slow_axes *slow, int i);
    /* Returns 1 if the motion is close enough to the slow manifold to attempt an expansion. Angular
     * velocities up to `noise` are treated as zero, and may differ from those on the slow manifold
     * by the fraction `share`. */
    int (*is_near)(const kr_series *s, const slow_axes *slow, double noise, double share);
    /* Expands the motion on the slow manifold about the end of the last step (slow_terms.h). */
    int (*expand)(kr_taylor *p, const kr_motion *motion, int order, const slow_axes *slow,
                  double near, double *wait);
};

/* Returns the component of the support's angular velocity along a body axis. */
static inline double turning_about(const kr_series *s, const slow_axes *slow, int axis)
{
    return slow->turns ? s->turn[axis + 1] : 0.0;
}
/* Returns the largest magnitude of the effective gravity G. */
static inline double largest_pull(const kr_series *s)
{
    return s->linear > 1.0 ? fabs(s->sway[3]) + fabs(s->sway_most) : 1.0;
}
#include "slow_held.h"

/* Returns the time derivative of one body-frame component of the support's angular velocity. */
static double turning_derivative(const kr_series *s, const slow_axes *slow, int axis)
{
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    const double *w = s->end_w + 1;
    return turning_about(s, slow, j) * w[k] - turning_about(s, slow, k) * w[j];
}
/* Returns the part of the angular acceleration about a strongly damped axis that is due to the
 * rotor. About the other strongly damped axes, the top is assumed to rotate with the support. */
static double rotor_torque(const kr_series *s, const slow_axes *slow, int axis)
{
    const int i = axis + 1, j = (axis + 1) % 3, k = (axis + 2) % 3;
    const double *w = s->end_w + 1;
    if (!slow->has_rotor) return 0.0;
    return s->k[i] * ((slow->is_slow[j] ? turning_about(s, slow, j) : w[j]) * s->shift[i] +
                      (slow->is_slow[k] ? turning_about(s, slow, k) : w[k]) * s->shift[i + 4]);
}
/* Returns an upper bound on the angular velocity, relative to the support, about a strongly damped
 * axis. If the support does not rotate, the product of two strongly damped components of the
 * angular velocity is negligible. */
static double bound_slow_velocity(const kr_series *s, const slow_axes *slow, int axis)
{
    const double *p = s->end_x + 5, *w = s->end_w + 1;
    const double most = largest_pull(s);
    double size = 0.0;
    for (int a = 0; a < 3; a++) {
        const int i = a + 1, j = (a + 1) % 3, k = (a + 2) % 3;
        if (!slow->is_slow[a] || slow->gain[axis][a] == 0.0) continue;
        const int is_small = slow->is_slow[j] && slow->is_slow[k] && !slow->turns;
        const double turning = is_small ? 0.0 : s->k[i] * w[j] * w[k],
                     rub = slow->slides ? s->rub[i] : 0.0;
        size +=
            fabs(slow->gain[axis][a]) *
            (most * (fabs(s->up[i] * p[j]) + fabs(s->down[i] * p[k])) + fabs(turning) + fabs(rub) +
             fabs(turning_derivative(s, slow, a)) + fabs(rotor_torque(s, slow, a))) /
            fabs(s->drag[i]);
    }
    return size;
}

/* Returns the smallest non-negligible angular velocity about a strongly damped axis. If no torque
 * acts about any strongly damped axis, returns the largest angular velocity instead. */
static double least_size(const kr_series *s, const slow_axes *slow)
{
    double least = 1.0, most = 0.0, turning = 0.0;
    for (int i = 0; i < 3; i++) {
        const double size = slow->is_slow[i] ? bound_slow_velocity(s, slow, i) : 0.0;
        most = fmax(most, fmax(size, fabs(s->end_w[i + 1])));
        if (size > 0.0) least = fmin(least, size);
        turning = fmax(turning, fabs(turning_about(s, slow, i)));
    }
    least = fmax(fmin(fmax(least, NEGLIGIBLE * most), most), TINY_VELOCITY);
    return fmax(least, ROUNDED * turning);
}

#include "math/real.h"
#include "slow_terms.h"
#include "slow_held_terms.h"
#define KR_DEEP
#include "math/real.h"
#include "slow_terms.h"
#include "slow_held_terms.h"

/* Returns an upper bound on the rates of the undamped top and of its support. */
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
/* Returns an upper bound on the torques of weight, sliding friction and a rotating support. */
static double largest_torque(const kr_motion *motion)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_series *s = p->series;
    if (s->linear == 1.0) return v_length(motion->lever);
    const kr_vec3 A = motion->inertia;
    const double turning = support_angular_speed(p), square = p->rate * p->rate,
                 pull = square * v_length(v_times(A, v_of(s->up + 1))) +
                        fabs(motion->gradient) * v_largest(A),
                 friction = s->slides != 0.0 ? kr_support_friction(motion, 1.0) : 0.0;
    return pull * largest_pull(s) + friction +
           turning * (2.0 * v_largest(A) * turning + v_length(motion->rotor));
}
/* Inverts a 3 x 3 matrix with ones on its diagonal. The off-diagonal elements of row i are ahead[i]
 * in column i + 1 and behind[i] in column i - 1 (modulo 3). Off-diagonal elements in the row or
 * column of a weakly damped axis are replaced by zero. */
static void invert_matrix(const double ahead[3], const double behind[3], const int is_slow[3],
                          double inverse[3][3])
{
    double m[3][3], sum = 0.0;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        m[i][i] = 1.0;
        m[i][j] = is_slow[i] && is_slow[j] ? ahead[i] : 0.0;
        m[i][k] = is_slow[i] && is_slow[k] ? behind[i] : 0.0;
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
            inverse[j][i] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
        }
    for (int i = 0; i < 3; i++) sum += m[0][i] * inverse[i][0];
    for (int i = 0; i < 9; i++) inverse[i / 3][i % 3] /= sum;
}
/* Computes the matrix `gain` of the angular velocities about the strongly damped axes that result
 * from normalized torques. */
static void set_gain(const kr_motion *motion, slow_axes *slow)
{
    double D[3], h[3], ahead[3], behind[3];
    v_put(D, motion->damping);
    v_put(h, motion->rotor);
    for (int i = 0; i < 3; i++) {
        ahead[i] = h[(i + 2) % 3] / D[i];
        behind[i] = -h[(i + 1) % 3] / D[i];
    }
    invert_matrix(ahead, behind, slow->is_slow, slow->gain);
}
/* Returns the largest rate at which a rotor changes the weakly damped velocities. */
static double rotor_rate(const kr_motion *motion, const slow_axes *slow, double weakest)
{
    const kr_vec3 A = motion->inertia;
    const double least = fmin(A.x, fmin(A.y, A.z)), carried = v_length(motion->rotor);
    const int count = slow->is_slow[0] + slow->is_slow[1] + slow->is_slow[2];
    double h[3], direct = 0.0;
    v_put(h, motion->rotor);
    for (int i = 0; i < 3; i++)
        if (count == 1 && slow->is_slow[i]) direct = fabs(h[i]);
    return fmax(direct, carried / weakest * carried) / least;
}
static void sort_axes_by_damping(const kr_motion *motion, int axes[3])
{
    const kr_vec3 rate = v_over(motion->damping, motion->inertia);
    double rates[3];
    v_put(rates, rate);
    for (int i = 0; i < 3; i++) {
        int place = 0;
        for (int j = 0; j < 3; j++) place += rates[j] < rates[i] || (rates[j] == rates[i] && j < i);
        axes[place] = i;
    }
}
/* Implements kr_slow_kind.take for the principal axes. On entry, slow->fall is the rate at
 * which the support shakes. */
static int take_slow_axes(const kr_motion *motion, int rank, double undamped, double pull,
                          slow_axes *slow)
{
    double A[3], D[3], others = undamped, weakest = INFINITY;
    const double shaking = slow->fall;
    int axes[3], count = 0;
    sort_axes_by_damping(motion, axes);
    const int least = axes[rank];
    v_put(A, motion->inertia);
    v_put(D, motion->damping);
    for (int i = 0; i < 3; i++) {
        slow->is_slow[i] = D[i] / A[i] >= D[least] / A[least];
        count += slow->is_slow[i];
        if (slow->is_slow[i])
            weakest = fmin(weakest, D[i]);
        else
            others = fmax(others, D[i] / A[i]);
        slow->fall = fmax(slow->fall, slow->is_slow[i] ? pull / D[i] : sqrt(pull / A[i]));
    }
    if (count < 3) others = fmax(others, rotor_rate(motion, slow, weakest));
    slow->rate = 2.0 * pull / weakest + (count < 3 ? 2.0 * others : shaking);
    if (!(D[least] / A[least] > (count < 3 ? STRONG : STRONG_ALONE) * others)) return 0;
    set_gain(motion, slow);
    return 1;
}

/* Returns log2 of the largest n-th Taylor coefficient, or -LOG2_AT_REST if all are zero.
 * LOG2_AT_REST is chosen so that powers of the resulting step size do not overflow. */
static double log2_size(const kr_series *s, int n)
{
    double size = 0.0;
    for (int i = 0; i < 8; i++) size = fmax(size, fabs(s->x[n][i]));
    for (int i = 0; i < 4; i++) size = fmax(size, fabs(s->w[n][i]));
    return size > 0.0 ? log2(size) : -LOG2_AT_REST;
}
/* Returns log2 of the largest step size h for which h^n times the coefficients n - 1 and n does not
 * exceed the tolerance. */
static double log2_step(const kr_series *s, int n, double log2_tol)
{
    return fmin((log2_tol - log2_size(s, n)) / n, (log2_tol - log2_size(s, n - 1)) / n);
}
/* Returns log2 of the absolute tolerance: the relative tolerance times the smallest angular
 * velocity on the slow manifold. */
static double log2_absolute_tolerance(const kr_taylor *p, const slow_axes *slow)
{
    return p->log2_tol + log2(slow->kind->least_size(p->series, slow));
}

/* Chooses the end of the step according to the tolerance, and evaluates the series there. In
 * double-double precision, all terms except the leading ones are rounded to doubles, so they must
 * be small. */
static void end_step(kr_taylor *p, const kr_motion *motion, const kr_kernel *kernel,
                     const slow_axes *slow, double log2_tol)
{
    kr_series *s = p->series;
    const int order = kernel->order, head = motion->digits > 20 ? KR_HEAD_30 : KR_HEAD_20;
    double step = log2_step(s, order, log2_tol);
    if (motion->digits > 16) step = fmin(step, log2_step(s, head + 2, log2_tol + 52.0));
    /* Clear the low words of the terms after the head, which refine_friction_limit reads although
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
static int is_near(const kr_series *s, const slow_axes *slow, double noise, double share)
{
    const double *p = s->end_x + 5, *w = s->end_w + 1;
    const double G = slow->shakes ? s->sway[3] + s->sway[0] : 1.0;
    double alone[3];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double weight = s->up[i + 1] * p[j] + s->down[i + 1] * p[k],
                     rub = slow->slides ? s->rub[i + 1] : 0.0;
        alone[i] = (turning_derivative(s, slow, i) -
                    (s->k[i + 1] * w[j] * w[k] + G * weight + rub + rotor_torque(s, slow, i))) /
                   s->drag[i + 1];
    }
    for (int i = 0; i < 3; i++) {
        double follows = turning_about(s, slow, i);
        for (int j = 0; j < 3; j++)
            if (slow->gain[i][j] != 0.0) follows += slow->gain[i][j] * alone[j];
        const double allowed =
            fmax(fmax(0.25 * bound_slow_velocity(s, slow, i), noise), share * fabs(follows));
        if (slow->is_slow[i] && fabs(w[i] - follows) > allowed) return 0;
    }
    return 1;
}
static int expand_on_axes(kr_taylor *p, const kr_motion *motion, int order, const slow_axes *slow,
                          double near, double *wait)
{
    return kr_taylor_is_deep(motion) ? deep_expand(p->series, slow, order, near, 0x1p-96, wait)
                                     : plain_expand(p->series, slow, order, near, 0x1p-48, wait);
}
static int expand_held(kr_taylor *p, const kr_motion *motion, int order, const slow_axes *slow,
                       double near, double *wait)
{
    const double friction = kr_support_friction(motion, p->rate);
    return kr_taylor_is_deep(motion)
               ? deep_expand_held(p->series, slow, order, near, 0x1p-96, wait, p->rate, friction)
               : plain_expand_held(p->series, slow, order, near, 0x1p-48, wait, p->rate, friction);
}
static double drag_about_axis(const kr_series *s, const slow_axes *slow, int axis)
{
    (void)slow;
    return fabs(s->drag[axis + 1]);
}
static const struct kr_slow_kind principal_axes = {
    3, NULL, take_slow_axes, least_size, drag_about_axis, is_near, expand_on_axes};
const struct kr_slow_kind kr_slow_held = {
    2,         find_held_directions, take_held_directions, least_held_size,
    held_drag, is_held_near,         expand_held};
/* Returns 1 if the motion may be within a relative distance `near` of the slow manifold, or, if the
 * transient has decayed, if it is roughly on the slow manifold. */
static int may_be_near(const kr_taylor *p, const slow_axes *slow, double near, int is_settled)
{
    /* is_near computes with doubles, and subtracts velocities if the support turns. */
    const double most = v_largest(v_of(p->series->end_w + 1)),
                 rounding = slow->turns || slow->held ? ROUNDING * most : 0.0,
                 noise = fmax(near * slow->kind->least_size(p->series, slow), rounding);
    return slow->kind->is_near(p->series, slow, fmax(noise, TINY_VELOCITY),
                               is_settled ? 0.25 : 0.0);
}
/* Returns the largest distance from the slow manifold, relative to the angular velocity, at
 * which the motion still counts as on the manifold. The result is `near` while the transient
 * decays. After damping about the same axes has been strong for SETTLED damping times, the
 * result is 1: the remaining distance is a rounding error, which is large relative to the
 * angular velocity of a top that is almost at rest. If the damping time is below the resolution
 * of time, the result is UNRESOLVED. */
static double largest_distance(kr_taylor *p, const slow_axes *slow, double clock, double near)
{
    double axes = 0.0, weakest = INFINITY;
    for (int i = 0; i < slow->kind->count; i++) {
        if (!slow->is_slow[i]) continue;
        axes += 1 << i;
        weakest = fmin(weakest, slow->kind->drag(p->series, slow, i) * p->rate);
    }
    if (p->settling != axes) p->settled = clock + SETTLED / weakest;
    p->settling = axes;
    if (clock + 0.5 / weakest == clock) return UNRESOLVED;
    return clock >= p->settled ? 1.0 : near;
}
/* Computes a step on the slow manifold that results from strong damping about a given set of axes.
 * `strong` is the largest set of strongly damped axes if a step with this set has failed, and NULL
 * otherwise. */
static int step_on_manifold(kr_taylor *p, const kr_motion *motion, const kr_kernel *kernel,
                            const slow_axes *slow, const slow_axes *strong)
{
    const double before = p->rate, near = exp2(p->log2_tol + 6.0), clock = p->series->end / p->rate;
    const double off = strong ? near : largest_distance(p, slow, clock, near);
    double wait = 0.0;
    int exponent;
    if (!strong && clock < p->try_slow) return 0;
    if (off < UNRESOLVED && !may_be_near(p, slow, near, off >= 1.0)) return 0;
    frexp(slow->rate, &exponent);
    if (slow->rate > 0.0) kr_taylor_set_rate(p, motion, ldexp(1.0, exponent), slow->supports);
    if (slow->kind->expand(p, motion, kernel->order, slow, off, &wait)) {
        end_step(p, motion, kernel, slow,
                 strong ? log2_absolute_tolerance(p, strong) : p->log2_tol);
        return 1;
    }
    if (!strong) p->try_slow = clock + PATIENCE * wait / p->rate;
    kr_taylor_set_rate(p, motion, before, slow->supports);
    return 0;
}
/* Returns 1 if the next step may lie on a slow manifold, and 0 otherwise. If the support moves,
 * comparing the damping rates with the angular velocity often excludes a slow manifold without a
 * more expensive computation. */
static int may_be_slow(const kr_motion *motion)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_series *s = p->series;
    const double *w = s->end_w + 1, *drag = s->drag + 1;
    if (s->linear == 0.0 || motion->step < 0.0 || motion->gradient != 0.0) return 0;
    if (s->linear == 1.0) return 1;
    return -fmin(drag[0], fmin(drag[1], drag[2])) >
           STRONG_ALONE * fmax(fabs(w[0]), fmax(fabs(w[1]), fabs(w[2])));
}
/* Initializes the members of `slow` that do not depend on the choice of the strongly damped axes.
 * Returns 0 if no axis is strongly damped. */
static int begin_slow_axes(const kr_motion *motion, double undamped, const kr_support_ops *supports,
                           held_directions *held, slow_axes *slow)
{
    const kr_series *s = taylor_of(motion)->series;
    const kr_vec3 ratio = v_over(motion->damping, motion->inertia);
    memset(slow, 0, sizeof *slow);
    if (!(v_largest(ratio) > STRONG_ALONE * undamped)) return 0;
    slow->kind = supports && s->holds != 0.0 ? supports->held : &principal_axes;
    slow->has_rotor = v_largest(motion->rotor) > 0.0;
    if (!supports) return 1;
    slow->supports = supports;
    slow->turns = s->turns != 0.0;
    slow->shakes = s->shakes != 0.0;
    slow->slides = s->slides != 0.0;
    slow->fall = slow->shakes ? motion->time_unit * motion->scene->shaking.rate : 0.0;
    if (!slow->kind->find) return 1;
    slow->kind->find(motion, held);
    slow->held = held;
    return 1;
}
/* Returns log2 of the tolerance for steps that are not on a slow manifold. The tolerance is
 * lowered, because the permitted error is proportional to the angular velocity, which is small
 * compared with the damping rate. */
static double log2_transient_tolerance(const kr_taylor *p, double undamped)
{
    return p->log2_tol + log2(fmax(fmin(undamped / p->rate, 1.0), NEGLIGIBLE));
}
int kr_slow_step(kr_motion *motion, const kr_kernel *kernel, const kr_support_ops *supports,
                 double *log2_tol)
{
    kr_taylor *p = taylor_of(motion);
    const kr_vec3 velocity = v_scale(p->rate, v_of(p->series->end_w + 1));
    const slow_axes *strong = NULL; /* the largest set of axes with strong damping */
    slow_axes slow[4];
    held_directions held;
    *log2_tol = p->log2_tol;
    if (!may_be_slow(motion)) {
        p->settling = 0.0;
        return 0;
    }
    const double undamped = bound_undamped_rate(motion, velocity, supports),
                 pull = largest_torque(motion);
    if (supports) supports->set_mode(motion);
    const int is_damped = begin_slow_axes(motion, undamped, supports, &held, &slow[3]),
              count = is_damped && p->has_tangents == 0.0 ? slow[3].kind->count : 0;
    for (int i = 0; i < count; i++) {
        slow[i] = slow[3];
        if (!slow[i].kind->take(motion, i, undamped, pull, &slow[i])) continue;
        if (step_on_manifold(p, motion, kernel, &slow[i], strong)) return 1;
        if (!strong) strong = &slow[i];
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
/* If the angular velocity exceeds 2^(OVERFLOW_LEAST + OVERFLOW_SHARE / (n - 1)), squares of the
 * Taylor coefficients of a series of order n may overflow. */
#define OVERFLOW_LEAST 5.0
#define OVERFLOW_SHARE 512.0
/* Torques smaller than SMALL_TORQUE times the damping torque are neglected. As a safety margin, the
 * computed growth rate is multiplied by CERTAIN, which is less than 1. */
#define SMALL_TORQUE 0.0025
#define CERTAIN 0.98
/* Let y be the magnitude of the angular velocity U relative to the support, with y^2 = <U, A U>.
 * Backward in time, damping increases y, which satisfies the inequality dy/dt >= `growth` y -
 * `loss`. */
int kr_slow_drives_apart(const kr_motion *motion, double until)
{
    const kr_taylor *p = taylor_of(motion);
    const kr_vec3 A = motion->inertia, ratio = v_over(motion->damping, A);
    const double least = fmin(A.x, fmin(A.y, A.z)), most = v_largest(A);
    if (motion->step >= 0.0 || !(v_largest(motion->damping) > 0.0) || !isfinite(until)) return 0;
    const double turning = support_angular_speed(p),
                 growth = fmin(ratio.x, fmin(ratio.y, ratio.z)) - 4.0 * turning * most / least,
                 loss = largest_torque(motion) / sqrt(least);
    const kr_vec3 W = v_scale(p->rate, v_of(p->series->end_w + 1));
    const double y = sqrt(v_dot(v_times(A, W), W)) - sqrt(most) * turning - loss / growth;
    if (!(growth > 0.0 && y > 0.0)) return 0;
    return y / sqrt(most) * (exp(growth * fabs(until - motion->clock)) - 1.0) > 0x1p53 * growth;
}
/* Backward in time, damping makes the angular momentum grow. If the damping D is the same about
 * all axes and no other torque acts, the magnitude L grows at the relative rate D <W, A W> /
 * L^2, which does not decrease with time. Small additional torques change this rate only
 * slightly. The angular velocity therefore exceeds `limit` before the time `until` if
 * exponential growth at the initial rate does. */
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
