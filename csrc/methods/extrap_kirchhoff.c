/* Extrapolation with order and step-size control (extrapolation.h), applied to Kirchhoff's
 * equations in the body frame (Bodack 2008, 3.4) and to the equations for the other two space axes:
 *     M' = M x W + E3 x L,   E1' = E1 x U,   E2' = E2 x U,   E3' = E3 x U,   U = W - S
 * with the momentum M, the angular velocity W = J^-1 (M - R) in the inertial frame, the inertia J,
 * the momentum R of the rotor, L from find_effective_lever (method.h), the axes E1, E2, E3 of
 * space, which turn with the support, and its angular velocity S. Vectors have components along the
 * body axes; y = (M, E1, E2, E3). The method `extrap` also integrates twelve equations, so the two
 * formulations can be compared. The integrals of motion are not conserved. */
#include "extrapolation.h"

static kr_vec3 rotate_to_space(const double y[GBS_SIZE], kr_vec3 v)
{
    return v3(v_dot(v_of(y + 3), v), v_dot(v_of(y + 6), v), v_dot(v_of(y + 9), v));
}
static void kirchhoff_begin(const kr_motion *motion, const kr_state *s, double y[GBS_SIZE])
{
    (void)motion;
    v_put(y, q_turn_back(s->q, s->m));
    v_put(y + 3, q_turn_back(s->q, v3(1.0, 0.0, 0.0)));
    v_put(y + 6, q_turn_back(s->q, v3(0.0, 1.0, 0.0)));
    v_put(y + 9, q_turn_back(s->q, v3(0.0, 0.0, 1.0)));
}
static void kirchhoff_rates(kr_motion *motion, const double y[GBS_SIZE], double rate[GBS_SIZE])
{
    const kr_vec3 W = motion_body_velocity(motion, v_of(y)),
                  lever = find_effective_lever(motion, v_of(y + 9));
    v_put(rate, v_add(v_cross(v_of(y), W), v_cross(v_of(y + 9), lever)));
    const kr_vec3 S = motion_support_velocity(motion),
                  U = v_sub(W, v_axpy(S.x, v_of(y + 3),
                                      v_axpy(S.y, v_of(y + 6), v_scale(S.z, v_of(y + 9)))));
    for (int i = 3; i < GBS_SIZE; i += 3) v_put(rate + i, v_cross(v_of(y + i), U));
    motion->stats.evaluations++;
}
static kr_vec3 kirchhoff_space_velocity(const kr_motion *motion, const double y[GBS_SIZE])
{
    return rotate_to_space(y, motion_body_velocity(motion, v_of(y)));
}
static kr_vec3 kirchhoff_space_momentum(const kr_motion *motion, const double y[GBS_SIZE])
{
    (void)motion;
    return rotate_to_space(y, v_of(y));
}
static kr_quat kirchhoff_attitude(const double y[GBS_SIZE], kr_quat last)
{
    return q_near(q_of_frame(v3(y[3], y[6], y[9]), v3(y[4], y[7], y[10]), v3(y[5], y[8], y[11])),
                  last);
}
static const gbs_form kirchhoff_form = {
    .begin = kirchhoff_begin,
    .rates = kirchhoff_rates,
    .velocity = kirchhoff_space_velocity,
    .momentum = kirchhoff_space_momentum,
    .attitude = kirchhoff_attitude,
};
EXTRAPOLATION_METHOD(extrap_kirchhoff, kirchhoff_form,
                     "extrap for Kirchhoff's equations in the body frame",
                     "Kirchhoff 1876; thesis 3.4; Hairer, Norsett, Wanner, II.9")
