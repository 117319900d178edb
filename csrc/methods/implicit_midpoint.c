/* The implicit midpoint rule for the attitude q and the momentum m in space, for comparison on
 * stiff problems. A step of size h is
 *     (q' - q) / h = q_ V / 2,    m' = m + h torque(q_ / |q_|),    q_ = (q + q') / 2
 * with the mean q_ of q and q', and the torque from motion_torque. The first equation is equivalent
 * to q_ / |q_| = q r and q' = q r^2. Here, V is the angular velocity at the midpoint, in the body
 * frame, and r is the unit quaternion parallel to (1, h V/4). With the inertia J and the momentum R
 * of the rotor, V = J^-1 (r* q* (m + m')/2 q r - R). This nonlinear equation for V is solved by
 * Newton's method (Hairer, Lubich, Wanner, VII.5). The method conserves the norm of q and the
 * vertical momentum. For small h |V|, the errors of the energy and the axial momentum are bounded
 * and O(h^2). */
#include "method.h"

enum { MOST = 30 };

typedef struct {
    kr_quat q;
    kr_vec3 m;
    kr_vec3 V; /* solution of the last step, the initial guess for the next one */
} midpoint_state;
/* The quantities of one Newton iteration for an approximate angular velocity V. */
typedef struct {
    kr_vec3 y;        /* h V / 4 */
    kr_quat r;        /* half of the rotation in the step */
    kr_vec3 M, P;     /* momentum and vertical at the midpoint, in the body frame */
    kr_vec3 residual; /* J V - (M - R) */
} midpoint_trial;

/* Returns all members of midpoint_trial for the angular velocity V. The arguments M and P are the
 * momentum and the vertical at the beginning of the step; the members M and P, at the midpoint. */
static midpoint_trial evaluate_midpoint_residual(const kr_motion *motion, kr_vec3 M, kr_vec3 P,
                                                 kr_vec3 V)
{
    midpoint_trial a = {.y = v_scale(0.25 * motion->step, V)};
    a.r = q_unit(q4(1.0, a.y));
    a.P = q_turn_back(a.r, P);
    a.M = v_axpy(0.5 * motion->step, v_cross(a.P, find_effective_lever(motion, a.P)),
                 q_turn_back(a.r, M));
    a.residual = v_sub(v_times(motion->inertia, V), v_sub(a.M, motion->rotor));
    return a;
}
/* Returns the Newton correction to subtract from V: the solution of a linear system whose columns
 * are the derivatives of the residual by the components of V. */
static kr_vec3 find_newton_correction(const kr_motion *motion, const midpoint_trial *a)
{
    const double half = 0.5 * motion->step, scale = half / (1.0 + v_dot(a->y, a->y));
    /* M without the contribution of the torque */
    const kr_vec3 lever = find_effective_lever(motion, a->P),
                  spun = v_axpy(-half, v_cross(a->P, lever), a->M);
    kr_vec3 columns[3];
    for (int i = 0; i < 3; i++) {
        const kr_vec3 turn = v_scale(scale, v_sub(v_axis(i), v_cross(a->y, v_axis(i))));
        const kr_vec3 change = v_cross(a->P, turn);
        kr_vec3 torque = v_cross(change, lever);
        if (motion->gradient != 0.0)
            torque =
                v_axpy(motion->gradient, v_cross(a->P, v_times(motion->inertia, change)), torque);
        columns[i] =
            v_sub(v_times(motion->inertia, v_axis(i)), v_axpy(half, torque, v_cross(spun, turn)));
    }
    return v_solve(columns, a->residual);
}
static kr_status midpoint_reset(kr_motion *motion, const kr_state *start)
{
    midpoint_state *p = (midpoint_state *)motion->work;
    p->q = start->q;
    p->m = start->m;
    p->V = motion_body_velocity(motion, q_turn_back(start->q, start->m));
    return KR_OK;
}
static kr_status midpoint_step(kr_motion *motion, double until)
{
    midpoint_state *p = (midpoint_state *)motion->work;
    const kr_vec3 M = q_turn_back(p->q, p->m), P = q_turn_e3_back(p->q);
    const double size = v_largest(M) + v_largest(motion->rotor) +
                        fabs(motion->step) * (v_largest(motion->lever) +
                                              fabs(motion->gradient) * v_largest(motion->inertia));
    const double tol = (motion->tol > 0.0 ? motion->tol : 1e-14) * size;
    kr_vec3 V = p->V;
    (void)until;
    for (int i = 0; i < MOST; i++) {
        const midpoint_trial a = evaluate_midpoint_residual(motion, M, P, V);
        motion->stats.iterations++;
        motion->stats.evaluations++;
        if (v_largest(a.residual) <= tol) {
            const kr_quat middle = q_mul(p->q, a.r);
            const kr_vec3 lever =
                q_turn(middle, find_effective_lever(motion, q_turn_e3_back(middle)));
            p->m = v_axpy(motion->step, v3(-lever.y, lever.x, 0.0), p->m);
            p->q = q_renormalize(q_mul(middle, a.r));
            p->V = V;
            return KR_OK;
        }
        V = v_sub(V, find_newton_correction(motion, &a));
    }
    return KR_ERR_CONVERGENCE;
}
static void midpoint_read(const kr_motion *motion, kr_state *s)
{
    const midpoint_state *p = (const midpoint_state *)motion->work;
    s->q = p->q;
    s->m = p->m;
}

const kr_method kr_method_implicit_midpoint = {
    KR_METHOD_TEXTS("implicit_midpoint",
                    "midpoint rule for attitude and momentum, solved by Newton's method", "<m,e3>",
                    "Hairer, Lubich, Wanner, VII.5"),
    .order = 2,
    .flags = KR_METHOD_REVERSIBLE | KR_METHOD_IMPLICIT | KR_METHOD_ALGEBRAIC | KR_METHOD_ROTORS |
             KR_METHOD_GRADIENT,
    .work = sizeof(midpoint_state) / sizeof(double),
    .reset = midpoint_reset,
    .step = midpoint_step,
    .read = midpoint_read,
};
