/* Two GSL methods, used as references: the Prince-Dormand Runge-Kutta pair and the semi-implicit
 * Bulirsch-Stoer method. Neither conserves any integral of the motion. They integrate
 *     q' = (q W - S q) / 2,    I W' = (I W + r) x W + P x (l + c I P),    P = q* e3 q
 * with the attitude q (body -> space) and, in the body frame, the inertial angular velocity W, the
 * upward vertical P (e3 in space), moments of inertia I, rotor momentum r and l = weight * (centre
 * of mass). c is the gravity gradient, S the support's angular velocity in space (method.h). Each
 * step size must exactly equal the end time minus the start time of the step; therefore,
 * gsl_odeiv2_evolve is not used. A failed step does not change the state. */
#include <float.h>
#include <stdlib.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>
#include "gsl.h"

enum { MAX_TRIES = 1000 };
/* Largest rotation of the top per step, in radians: less than a turn. In longer steps, GSL's error
 * estimate might be too small, and the semi-implicit method would damp the rotation. */
static const double most_turn = 4.0;
/* Upper limits on accel * step^2 (most_fall) and accel * step (most_pull) in internal units, for
 * the step size `step` and an upper bound `accel` on the angular acceleration due to gravity.
 * Beyond them, 1 - step * Jacobian might be singular, and GSL would read uninitialized memory. */
static const double most_fall = 1e12, most_pull = 1e14;

typedef struct {
    gsl_odeiv2_step *step;
    gsl_odeiv2_control *control;
} tools;
typedef struct {
    double y[GSL_SIZE], rate[GSL_SIZE];
    double h; /* the next step, negative backward in time */
} ode_work;

/* The vector y consists of the attitude q and the body-frame angular velocity W. */
static kr_quat ode_attitude(const double y[]) { return q4(y[0], v_of(y + 1)); }
static kr_vec3 ode_velocity(const double y[]) { return v_of(y + 4); }
static void set_ode_vector(double y[], kr_quat q, kr_vec3 W)
{
    y[0] = q.w;
    v_put(y + 1, q_vec(q));
    v_put(y + 4, W);
}
/* Returns GSL_EBADFUNC unless all numbers are finite, because GSL treats a NaN error as 0. */
static int check_finite(const double *a, int n)
{
    for (int i = 0; i < n; i++)
        if (!isfinite(a[i])) return GSL_EBADFUNC;
    return GSL_SUCCESS;
}

static kr_quat find_attitude_rate(const kr_motion *motion, kr_quat q, kr_quat q_times_W)
{
    const kr_vec3 S = motion_support_velocity(motion);
    return q_scale(0.5, v_largest(S) > 0.0 ? q_add(q_times_W, q_mul(q4(0.0, v_scale(-1.0, S)), q))
                                           : q_times_W);
}
int kr_gsl_rates(double t, const double y[], double rate[], void *params)
{
    kr_motion *motion = params;
    const kr_quat q = ode_attitude(y);
    const kr_vec3 W = ode_velocity(y), I = motion->inertia;
    const kr_vec3 M = motion_add_rotor(motion, v_times(I, W)), P = q_turn_e3_back(q),
                  torque = v_add(v_cross(M, W), v_cross(P, find_effective_lever(motion, P)));
    (void)t;
    set_ode_vector(rate, find_attitude_rate(motion, q, q_mul(q, q4(0.0, W))), v_over(torque, I));
    motion->stats.evaluations++;
    return check_finite(rate, GSL_SIZE);
}
/* Computes each column of the Jacobian as the derivative of the right-hand side with respect to one
 * component of y. A change (dq, dW) of y = (q, W) changes P by dP = 2 vec(q* e3 dq). */
int kr_gsl_jacobian(double t, const double y[], double *jacobian, double rate_t[], void *params)
{
    kr_motion *motion = params;
    const kr_quat q = ode_attitude(y), e3 = q4(0.0, v3(0.0, 0.0, 1.0));
    const kr_vec3 W = ode_velocity(y), I = motion->inertia,
                  M = motion_add_rotor(motion, v_times(I, W)), P = q_turn_e3_back(q),
                  lever = find_effective_lever(motion, P);
    (void)t;
    for (int j = 0; j < GSL_SIZE; j++) {
        double along[GSL_SIZE] = {0.0}, column[GSL_SIZE];
        along[j] = 1.0;
        const kr_quat dq = ode_attitude(along),
                      turn = q_add(q_mul(dq, q4(0.0, W)), q_mul(q, q4(0.0, ode_velocity(along))));
        const kr_vec3 dW = ode_velocity(along),
                      dP = v_scale(2.0, q_vec(q_mul(q_conj(q), q_mul(e3, dq))));
        kr_vec3 gyration = v_add(v_cross(v_times(I, dW), W), v_cross(M, dW));
        if (motion->gradient != 0.0)
            gyration = v_add(gyration, v_scale(motion->gradient, v_cross(P, v_times(I, dP))));
        set_ode_vector(column, find_attitude_rate(motion, dq, turn),
                       v_over(v_add(gyration, v_cross(dP, lever)), I));
        for (int i = 0; i < GSL_SIZE; i++) jacobian[GSL_SIZE * i + j] = column[i];
        rate_t[j] = 0.0;
    }
    motion->stats.evaluations++;
    return check_finite(jacobian, GSL_SIZE * GSL_SIZE);
}

static double tolerance(const kr_motion *motion) { return motion->tol > 0.0 ? motion->tol : 1e-12; }
static void release_gsl_objects(kr_motion *motion)
{
    tools *use = motion->aux;
    if (!use) return;
    gsl_odeiv2_step_free(use->step);
    gsl_odeiv2_control_free(use->control);
    free(use);
    motion->aux = NULL;
}
/* Allocates GSL's step and control objects on the first call, and sets the initial state. */
static kr_status ode_begin(kr_motion *motion, const kr_state *start,
                           const gsl_odeiv2_step_type *type)
{
    ode_work *p = (ode_work *)motion->work;
    if (!motion->aux) {
        tools *use = motion->aux = calloc(1, sizeof *use);
        if (!use) return KR_ERR_MEMORY;
        /* GSL's default error handler aborts the program. It remains switched off, because all
         * threads of the process share it. */
        gsl_set_error_handler_off();
        use->step = gsl_odeiv2_step_alloc(type, GSL_SIZE);
        use->control = gsl_odeiv2_control_y_new(tolerance(motion), tolerance(motion));
        if (!use->step || !use->control) {
            release_gsl_objects(motion);
            return KR_ERR_MEMORY;
        }
    }
    gsl_odeiv2_step_reset(((tools *)motion->aux)->step);
    set_ode_vector(p->y, start->q, motion_body_velocity(motion, q_turn_back(start->q, start->m)));
    p->h = motion->step != 0.0 ? motion->step : 1e-3;
    return kr_gsl_rates(0.0, p->y, p->rate, motion) == GSL_SUCCESS ? KR_OK : KR_ERR_NOT_FINITE;
}
static kr_status reset_rk8pd(kr_motion *motion, const kr_state *start)
{
    return ode_begin(motion, start, gsl_odeiv2_step_rk8pd);
}
static kr_status reset_bsimp(kr_motion *motion, const kr_state *start)
{
    return ode_begin(motion, start, gsl_odeiv2_step_bsimp);
}

/* Returns the largest step size that most_turn, most_fall and most_pull permit at the angular
 * velocity W. A rotor of momentum r rotates W at a rate up to |r| / (least moment of inertia). */
static double find_longest_step(const kr_motion *motion, kr_vec3 W)
{
    const kr_vec3 I = motion->inertia, l = motion->lever;
    const double rate = v_length(W) + v_length(motion_support_velocity(motion)) +
                        v_length(motion->rotor) / fmin(I.x, fmin(I.y, I.z));
    const double x = fabs(l.x), y = fabs(l.y), z = fabs(l.z),
                 steep = fabs(motion->gradient) * v_largest(I) / fmin(I.x, fmin(I.y, I.z)),
                 a = fmax(fmax((y + z) / I.x, (z + x) / I.y), (x + y) / I.z) + steep;
    return fmin(most_turn / rate, fmin(sqrt(most_fall / a), most_pull / a));
}
/* Tries a step of size h from the state p. If the step is accepted, returns 1, and writes the new
 * state and the suggested size of the following step to `next`. If the step is rejected, returns 0,
 * and next->h is the size for the next attempt. */
static int try_step(kr_motion *motion, double h, const ode_work *p, ode_work *next)
{
    const gsl_odeiv2_system system = {kr_gsl_rates, kr_gsl_jacobian, GSL_SIZE, motion};
    const tools *use = motion->aux;
    double *y = next->y, *rate = next->rate, error[GSL_SIZE];
    *next = *p;
    next->h = h;
    if (gsl_odeiv2_step_apply(use->step, 0.0, h, y, error, p->rate, rate, &system) == GSL_SUCCESS)
        return gsl_odeiv2_control_hadjust(use->control, use->step, y, error, rate, &next->h) !=
               GSL_ODEIV_HADJ_DEC;
    next->h = 0.5 * h;
    return 0;
}
static kr_status ode_step(kr_motion *motion, double until)
{
    ode_work *p = (ode_work *)motion->work, next = *p;
    /* In double precision, no step can meet a tolerance smaller than the machine epsilon. */
    if (tolerance(motion) < DBL_EPSILON) return KR_ERR_STEP;
    const double longest = find_longest_step(motion, ode_velocity(p->y));
    for (int rejected = 0; rejected < MAX_TRIES; rejected++) {
        if (fabs(next.h) > longest) next.h = copysign(longest, next.h);
        const int lands =
            motion->step < 0.0 ? motion->clock + next.h <= until : motion->clock + next.h >= until;
        const double end = lands ? until : motion->clock + next.h, h = end - motion->clock;
        if (h == 0.0 || !isfinite(h)) return KR_ERR_STEP;
        if (try_step(motion, h, p, &next)) {
            /* A step shortened to end at `until` does not affect the size of the next step. */
            if (lands) next.h = p->h;
            *p = next;
            motion->clock = end;
            return KR_OK;
        }
        motion->stats.rejected++;
    }
    return KR_ERR_STEP;
}
static void ode_read(const kr_motion *motion, kr_state *s)
{
    const ode_work *p = (const ode_work *)motion->work;
    s->q = q_unit(ode_attitude(p->y));
    const kr_vec3 M = v_times(motion->inertia, ode_velocity(p->y));
    s->m = q_turn(s->q, motion_add_rotor(motion, M));
}

const kr_method kr_method_gsl_rk8pd = {
    KR_METHOD_TEXTS("gsl_rk8pd", "GSL's embedded Runge-Kutta pair of orders 8 and 9", "nothing",
                    "Prince and Dormand 1981; GSL 2.7"),
    .order = 8,
    .flags = KR_METHOD_ADAPTIVE | KR_METHOD_ABSOLUTE | KR_METHOD_ROTORS | KR_METHOD_TURNING |
             KR_METHOD_GRADIENT,
    .work = sizeof(ode_work) / sizeof(double),
    .reset = reset_rk8pd,
    .step = ode_step,
    .read = ode_read,
    .release = release_gsl_objects,
};
const kr_method kr_method_gsl_bsimp = {
    KR_METHOD_TEXTS("gsl_bsimp",
                    "GSL's semi-implicit Bulirsch-Stoer method with the analytic Jacobian",
                    "nothing", "Bader and Deuflhard 1983; GSL 2.7"),
    .order = 0,
    .flags = KR_METHOD_ADAPTIVE | KR_METHOD_ABSOLUTE | KR_METHOD_IMPLICIT | KR_METHOD_ROTORS |
             KR_METHOD_TURNING | KR_METHOD_GRADIENT,
    .work = sizeof(ode_work) / sizeof(double),
    .reset = reset_bsimp,
    .step = ode_step,
    .read = ode_read,
    .release = release_gsl_objects,
};
