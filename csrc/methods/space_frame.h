/* The twelve equations of motion in space (Bodack 2008, 3.9), for rk4 and extrap. With the angular
 * velocity w in the inertial frame, the principal axes N, B, T, the inertia tensor J, the momentum
 * m, which includes the momentum R of the rotor, and the torque n of weight and gravity gradient,
 *     J w' = m x w + n,   N' = w x N,   B' = w x B,   T' = w x T   (on a support at rest)
 *     J = I_N N N^t + I_B B B^t + I_T T T^t,   m = J w + R_N N + R_B B + R_T T.
 * On a support with the angular velocity S, all vectors have components along the axes of the
 * support. In this case, w - S replaces w in N', B' and T', and w' has the further term -S x w.
 * After numerical integration, (N, B, T) is orthonormal only up to the error of the method. */
#ifndef KR_SPACE_FRAME_H
#define KR_SPACE_FRAME_H
#include "method.h"

enum { SPACE_FRAME = 12 }; /* w, N, B, T */

static inline kr_vec3 space_frame_momentum(const kr_motion *motion, const double y[SPACE_FRAME])
{
    const kr_vec3 w = v_of(y), N = v_of(y + 3), B = v_of(y + 6), T = v_of(y + 9),
                  I = motion->inertia;
    const kr_vec3 M =
        motion_add_rotor(motion, v3(I.x * v_dot(w, N), I.y * v_dot(w, B), I.z * v_dot(w, T)));
    return v_axpy(M.x, N, v_axpy(M.y, B, v_scale(M.z, T)));
}
static inline kr_vec3 space_frame_velocity(const kr_motion *motion, const double y[SPACE_FRAME])
{
    (void)motion;
    return v_of(y);
}
static inline void space_frame_rates(kr_motion *motion, const double y[SPACE_FRAME],
                                     double rate[SPACE_FRAME])
{
    const kr_vec3 w = v_of(y), N = v_of(y + 3), B = v_of(y + 6), T = v_of(y + 9);
    const kr_vec3 I = motion->inertia, c = find_effective_lever(motion, v3(N.z, B.z, T.z));
    const kr_vec3 a = v_axpy(c.x, N, v_axpy(c.y, B, v_scale(c.z, T))); /* mass * gravity * a */
    const kr_vec3 f = v_add(v_cross(space_frame_momentum(motion, y), w), v3(-a.y, a.x, 0.0));
    const kr_vec3 turning = motion_support_velocity(motion), u = v_sub(w, turning);
    v_put(rate, v_axpy(v_dot(f, N) / I.x, N,
                       v_axpy(v_dot(f, B) / I.y, B, v_scale(v_dot(f, T) / I.z, T))));
    if (v_largest(turning) > 0.0) v_put(rate, v_sub(v_of(rate), v_cross(turning, w)));
    v_put(rate + 3, v_cross(u, N));
    v_put(rate + 6, v_cross(u, B));
    v_put(rate + 9, v_cross(u, T));
    motion->stats.evaluations++;
}
static inline void space_frame_begin(const kr_motion *motion, const kr_state *s,
                                     double y[SPACE_FRAME])
{
    const kr_vec3 M = q_turn_back(s->q, s->m);
    v_put(y, q_turn(s->q, motion_body_velocity(motion, M)));
    v_put(y + 3, q_turn(s->q, v3(1.0, 0.0, 0.0)));
    v_put(y + 6, q_turn(s->q, v3(0.0, 1.0, 0.0)));
    v_put(y + 9, q_turn(s->q, v3(0.0, 0.0, 1.0)));
}
static inline kr_quat space_frame_attitude(const double y[SPACE_FRAME], kr_quat last)
{
    return q_near(q_of_frame(v_of(y + 3), v_of(y + 6), v_of(y + 9)), last);
}
#endif
