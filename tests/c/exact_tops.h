/* Helpers for the tests of closed forms: random tops, and the errors of their states relative to the
 * Taylor series with 30 digits. */
#ifndef KR_EXACT_TOPS_H
#define KR_EXACT_TOPS_H
#include "tops.h"

static inline kr_scene scene_of(kr_vec3 inertia, kr_vec3 com, double gravity, kr_quat q, kr_vec3 m)
{
    const kr_body body = {1.0, inertia, com, {1, 0, 0, 0}, 0, .rotor = {0, 0, 0}};
    const kr_scene s = {.body = body, .gravity = gravity, .start = {0.0, q, m}};
    return s;
}
/* Returns a random Lagrange top, every second of which starts near a pole, with the axis of
 * symmetry along any axis of description, or a spherical top with its centre of mass anywhere. */
static inline kr_scene draw_lagrange(void)
{
    static const kr_quat cycle = {0.5, 0.5, 0.5, 0.5}, pole = {0.0, 1.0, 0.0, 0.0};
    const int number = (int)uniform(0, 12);
    const double i1 = pow(10.0, uniform(-1, 1)), size = pow(10.0, uniform(-3, 3));
    kr_quat q = random_quat();
    if (number % 2)
        q = q_mul(number % 4 == 1 ? q_one() : pole,
                  q_exp(v_scale(pow(10.0, uniform(-9, 0)), random_vec(1))));
    kr_scene s =
        lagrange_top(i1, i1 * pow(10.0, uniform(-2, 0.3)),
                     (number % 3 ? 1.0 : -1.0) * pow(10.0, uniform(-4, 3)), q, random_vec(size));
    if (number % 5 == 0) s.body.inertia = v3(i1, i1, i1), s.body.com = random_vec(1.0);
    for (int turns = number % 3; turns > 0; turns--) {
        const kr_vec3 i = s.body.inertia, com = s.body.com;
        s.body.inertia = v3(i.z, i.x, i.y), s.body.com = v3(com.z, com.x, com.y);
        s.start.q = q_mul(s.start.q, q_conj(cycle));
    }
    return s;
}
/* Returns a random top with moments in the ratio `ratio` : `ratio` : 1, in any order. Its centre of
 * mass lies on the axis of one of the two equal moments, and gravity has either sign. */
static inline kr_scene drawn_top_of_ratio(double ratio)
{
    const double unit = ldexp(1.0, (int)uniform(-3, 4)), reach = exp(uniform(-1.4, 1.4)),
                 gravity = uniform(0, 1) < 0.5 ? -2.5 : 9.81, side = uniform(0, 1) < 0.5 ? -1 : 1;
    const int odd = (int)uniform(0, 3), which = (int)uniform(1, 3);
    const double pair = ratio * unit;
    double inertia[3] = {pair, pair, pair}, com[3] = {0.0, 0.0, 0.0};
    inertia[odd] = unit;
    com[(odd + which) % 3] = side * reach;
    const double rate = sqrt(fabs(gravity) * reach / unit);
    const kr_quat q = random_quat();
    const double size = pair * rate * pow(10.0, uniform(-1, 1));
    return scene_of(v3(inertia[0], inertia[1], inertia[2]), v3(com[0], com[1], com[2]), gravity, q,
                    random_vec(size));
}
/* Returns a Kowalewski top with moments 2, 2, 1 and mass * gravity * |com| = 1, given e3 and the
 * angular velocity in the body frame of the closed form. */
static inline kr_scene kowalewski_top_of(kr_vec3 up, kr_vec3 velocity)
{
    const kr_quat q = q_conj(q_tilt(v_unit(up)));
    const kr_vec3 m = q_turn(q, v_times(v3(2.0, 2.0, 1.0), velocity));
    return scene_of(v3(2.0, 2.0, 1.0), v3(-1.0, 0.0, 0.0), 1.0, q, m);
}
/* Returns a Goryachev-Chaplygin top with moments 1, 1, 1/4 and mass * gravity * |com| = 1, given e3
 * and the part of its momentum across e3, both in the body frame of the closed form. */
static inline kr_scene chaplygin_top_of(kr_vec3 up, kr_vec3 momentum)
{
    const kr_quat q = q_conj(q_tilt(v_unit(up)));
    kr_vec3 m = q_turn(q, momentum);
    m.z = 0.0;
    return scene_of(v3(1.0, 1.0, 0.25), v3(1.0, 0.0, 0.0), 1.0, q, m);
}
/* Returns the unit for errors of m: an upper bound of |m| for a top of mass 1 with this energy. */
static inline double scale_of(const kr_scene *s)
{
    const double lever = fabs(s->gravity) * v_length(s->body.com);
    return sqrt(2.0 * v_largest(s->body.inertia) * (kr_state_kinetic(s, &s->start) + 2.0 * lever));
}
/* Returns a frequency of the motion, which sets the times at which states are compared. */
static inline double rate_of(const kr_scene *s, const kr_exact *plan)
{
    const kr_exact_info info = kr_exact_describe(plan);
    const double frequency = info.frequency[info.kind == KR_KIND_KOWALEWSKI];
    return frequency > 0.0 ? frequency : scale_of(s) / fmin(s->body.inertia.x, s->body.inertia.z);
}
static inline double error_of(const kr_scene *s, kr_state got, kr_state want)
{
    return kr_attitude_error(got.q, want.q) + off(got.m, want.m) / scale_of(s);
}
static inline kr_state by_series(const kr_scene *s, double t)
{
    const kr_config config = {.digits = 30, .step = t < s->start.t ? -1.0 : 0.0};
    return state_at(t, s, taylor(), config);
}
#endif
