/* Physical quantities of a state, such as energies, momenta and angles. Let R be the attitude of
 * the principal axes, m the momentum in space, J the inertia, D the damping and h the momentum of
 * the rotor. Along the principal axes, M = R* m R is the momentum, P = R* e3 R the vertical, apex
 * the direction of com (body.h), W = J^-1 (M - h) the angular velocity in the inertial frame, and
 * W' the derivative of its components. Kinetic energy T, potential energy U, equation of motion:
 *     T = <V, J V> / 2,   U = mass g <com, P> + k <P, J P> / 2 - <O, J O> / 2 - <h, O>
 *     J W' = M x W + P x (mass g com + k J P) - D V + f apex
 *     force = mass R (W' x com + W x (W x com) - k (<P, com> P - com / 3)) R* + mass g e3
 * where `force` is that of the support on the body, k the gravity gradient, f the torque of dry
 * friction (kr_friction_torque), g the acceleration due to gravity and to the shaking of the
 * support, O = R* turning R the angular velocity of the support, and V = W - O. (In the file
 * quantity_tangents.c, P is called V, and V is called U.) The integrals of Kowalewski and
 * Goryachev-Chaplygin are (5.1) and (5.2) of the thesis (Bodack 2008). The z-x-z Euler angles
 * describe the attitude r of a frame that is fixed in the body and has the apex as third axis:
 *     r = exp(e3 precession_angle) exp(e1 nutation) exp(e3 spin_angle)      (q_exp in su2.h) */
#include "quantities.h"
#include "math/trig.h"
#include "map_rates.h"
#include "scene.h"

/* A spin smaller than this multiple of the terms in its sum counts as zero. */
#define SPIN_OF_HELD 0x1p-40

static kr_quat principal_attitude(const kr_scene *scene, const kr_state *s)
{
    return q_mul(s->q, scene->body.axes);
}
/* Returns M - h along the principal axes, whose attitude is q. */
static kr_vec3 momentum_without_rotor(const kr_scene *scene, const kr_state *s, kr_quat q)
{
    return v_sub(q_turn_back(q, s->m), scene->body.rotor);
}

double kr_acceleration_at(const kr_scene *scene, double t)
{
    const kr_shaking *shaking = &scene->shaking;
    double sine, cosine;
    if (!kr_support_shakes(scene)) return scene->gravity;
    sin_cos(shaking->rate * t + shaking->phase, &sine, &cosine);
    return scene->gravity - shaking->amplitude * shaking->rate * shaking->rate * cosine;
}

kr_quat kr_state_q(const kr_scene *scene, const kr_state *s)
{
    (void)scene;
    return s->q;
}
kr_vec3 kr_state_m(const kr_scene *scene, const kr_state *s)
{
    (void)scene;
    return s->m;
}
/* Returns the angular velocity in the inertial frame, along e1, e2, e3. */
static kr_vec3 find_inertial_velocity(const kr_scene *scene, const kr_state *s)
{
    const kr_quat q = principal_attitude(scene, s);
    return q_turn(q, v_over(momentum_without_rotor(scene, s, q), scene->body.inertia));
}
kr_vec3 kr_state_velocity(const kr_scene *scene, const kr_state *s)
{
    const kr_vec3 w = find_inertial_velocity(scene, s);
    return kr_support_turns(scene) ? v_sub(w, scene->turning) : w;
}
kr_vec3 kr_state_torque(const kr_scene *scene, const kr_state *s)
{
    const kr_quat q = principal_attitude(scene, s);
    const kr_vec3 a = q_turn(q, scene->body.com),
                  torque = v_scale(scene->body.mass * kr_acceleration_at(scene, s->t),
                                   v3(-a.y, a.x, 0.0));
    if (scene->gradient == 0.0) return torque;
    return v_add(torque, q_turn(q, kr_gradient_torque(scene, q_turn_e3_back(q))));
}
kr_vec3 kr_state_apex(const kr_scene *scene, const kr_state *s)
{
    return q_turn(principal_attitude(scene, s), kr_body_apex(&scene->body));
}
void kr_state_frame(const kr_scene *scene, const kr_state *s, kr_vec3 frame[3])
{
    const kr_quat q = principal_attitude(scene, s);
    frame[0] = q_turn(q, v3(1.0, 0.0, 0.0));
    frame[1] = q_turn(q, v3(0.0, 1.0, 0.0));
    frame[2] = q_turn(q, v3(0.0, 0.0, 1.0));
}
kr_vec3 kr_state_body_velocity(const kr_scene *scene, const kr_state *s)
{
    return q_turn_back(s->q, kr_state_velocity(scene, s));
}
kr_vec3 kr_state_inertial_velocity(const kr_scene *scene, const kr_state *s)
{
    return q_turn_back(s->q, find_inertial_velocity(scene, s));
}
kr_vec3 kr_state_body_momentum(const kr_scene *scene, const kr_state *s)
{
    (void)scene;
    return q_turn_back(s->q, s->m);
}
kr_vec3 kr_state_body_vertical(const kr_scene *scene, const kr_state *s)
{
    (void)scene;
    return q_turn_e3_back(s->q);
}
double kr_state_spin(const kr_scene *scene, const kr_state *s)
{
    return v_dot(kr_state_velocity(scene, s), kr_state_apex(scene, s));
}

/* Writes (precession_angle + spin_angle) / 2 and (precession_angle - spin_angle) / 2. If the apex
 * is vertical, the state determines only one of the two, and the other is set to 0. Adding 0.0
 * turns negative zeros into positive zeros, because atan2(0, -0) would be pi. */
static void find_euler_half_sums(const kr_scene *scene, const kr_state *s, double *half_sum,
                                 double *half_difference)
{
    static const kr_state unturned = {.q = {1.0, 0.0, 0.0, 0.0}};
    const kr_quat r = q_mul(s->q, q_tilt(kr_state_apex(scene, &unturned)));
    *half_sum = atan2(r.z + 0.0, r.w + 0.0);
    *half_difference = atan2(r.y + 0.0, r.x + 0.0);
}
/* Returns an angle between -2 pi and 2 pi, reduced to the interval (-pi, pi]. */
static double wrap_angle(double angle)
{
    static const double pi = 3.14159265358979323846;
    return angle > pi ? angle - 2.0 * pi : angle <= -pi ? angle + 2.0 * pi : angle;
}
double kr_state_precession_angle(const kr_scene *scene, const kr_state *s)
{
    double sum, difference;
    find_euler_half_sums(scene, s, &sum, &difference);
    return wrap_angle(sum + difference);
}
double kr_state_nutation(const kr_scene *scene, const kr_state *s)
{
    const kr_vec3 a = kr_state_apex(scene, s);
    return atan2(sqrt(a.x * a.x + a.y * a.y), a.z);
}
double kr_state_spin_angle(const kr_scene *scene, const kr_state *s)
{
    double sum, difference;
    find_euler_half_sums(scene, s, &sum, &difference);
    return wrap_angle(sum - difference);
}

double kr_state_kinetic(const kr_scene *scene, const kr_state *s)
{
    const kr_quat q = principal_attitude(scene, s);
    kr_vec3 m = momentum_without_rotor(scene, s, q);
    if (kr_support_turns(scene))
        m = v_sub(m, v_times(scene->body.inertia, q_turn_back(q, scene->turning)));
    return 0.5 * v_dot(m, v_over(m, scene->body.inertia));
}
double kr_state_potential(const kr_scene *scene, const kr_state *s)
{
    const kr_quat q = principal_attitude(scene, s);
    const kr_vec3 P = q_turn_e3_back(q);
    const double weight = scene->body.mass * kr_acceleration_at(scene, s->t);
    double of_weight = weight * v_dot(scene->body.com, P);
    if (scene->gradient != 0.0)
        of_weight += 0.5 * scene->gradient * v_dot(P, v_times(scene->body.inertia, P));
    if (!kr_support_turns(scene)) return of_weight;
    const kr_vec3 O = q_turn_back(q, scene->turning),
                  carried = v_axpy(0.5, v_times(scene->body.inertia, O), scene->body.rotor);
    return of_weight - v_dot(carried, O);
}
double kr_state_energy(const kr_scene *scene, const kr_state *s)
{
    return kr_state_kinetic(scene, s) + kr_state_potential(scene, s);
}
double kr_state_vertical_momentum(const kr_scene *scene, const kr_state *s)
{
    (void)scene;
    return s->m.z;
}
double kr_state_axial_momentum(const kr_scene *scene, const kr_state *s)
{
    return v_dot(s->m, kr_state_apex(scene, s));
}

/* Returns the rate of the free wheel i relative to the body, or NaN if there is no such wheel. */
static double find_wheel_rate(const kr_scene *scene, const kr_state *s, int i)
{
    const kr_wheel *wheel = &scene->wheels[i];
    if (v_largest(wheel->axis) == 0.0) return wheel->rate != 0.0 ? wheel->rate : NAN;
    const kr_vec3 M = momentum_without_rotor(scene, s, principal_attitude(scene, s));
    return wheel->rate - v_dot(wheel->axis, v_over(M, scene->body.inertia));
}
double kr_state_wheel_rate(const kr_scene *scene, const kr_state *s)
{
    return find_wheel_rate(scene, s, 0);
}
double kr_state_second_wheel_rate(const kr_scene *scene, const kr_state *s)
{
    return find_wheel_rate(scene, s, 1);
}
double kr_state_third_wheel_rate(const kr_scene *scene, const kr_state *s)
{
    return find_wheel_rate(scene, s, 2);
}

/* Writes the vectors of Kowalewski's equations: momentum / I1 to `m`, and the vertical times mass *
 * gravity * |com| / I1 to `p`. Their components are along a = -com / |com|, o x a and o, where o is
 * the symmetry axis of the inertia tensor, and I1 the moment about a. Returns 0 if the kind of the
 * body is not `kind`, if the support is shaken, or if there is a gravity gradient. */
static int find_integral_vectors(const kr_scene *scene, const kr_state *s, kr_kind kind, kr_vec3 *m,
                                 kr_vec3 *p)
{
    if (kr_body_kind(&scene->body, KR_KIND_RTOL) != kind || kr_support_shakes(scene) ||
        scene->gradient != 0.0)
        return 0;
    const kr_working w = kr_body_working(&scene->body);
    const kr_quat q = q_mul(principal_attitude(scene, s), w.axes);
    const kr_vec3 M = q_turn_back(q, s->m), P = q_turn_e3_back(q);
    const double i1 = w.inertia.x, reach = v_dot(v_unit(w.com), w.com);
    const kr_vec3 axis1 = v_scale(-1.0, v_unit(w.com)), axis2 = v3(-axis1.y, axis1.x, 0.0);
    *m = v_scale(1.0 / i1, v3(v_dot(axis1, M), v_dot(axis2, M), M.z));
    *p = v_scale(scene->body.mass * scene->gravity * reach / i1,
                 v3(v_dot(axis1, P), v_dot(axis2, P), P.z));
    return 1;
}
double kr_state_kowalewski(const kr_scene *scene, const kr_state *s)
{
    kr_vec3 m, p;
    if (!find_integral_vectors(scene, s, KR_KIND_KOWALEWSKI, &m, &p)) return NAN;
    const double re = m.x * m.x - m.y * m.y + 2.0 * p.x, im = 2.0 * (m.x * m.y + p.y);
    return re * re + im * im;
}
double kr_state_goryachev_chaplygin(const kr_scene *scene, const kr_state *s)
{
    kr_vec3 m, p;
    if (!find_integral_vectors(scene, s, KR_KIND_GORYACHEV_CHAPLYGIN, &m, &p)) return NAN;
    return m.z * (m.x * m.x + m.y * m.y) + m.x * p.z;
}
double kr_friction_torque(const kr_scene *scene, kr_vec3 M, kr_vec3 O, kr_vec3 gain, int *holds)
{
    const kr_vec3 apex = kr_body_apex(&scene->body), h = scene->body.rotor,
                  eased = v_over(apex, scene->body.inertia);
    const double spin = v_dot(v_sub(M, h), eased) - v_dot(O, apex), most = scene->friction,
                 needed = -v_dot(gain, apex) / v_dot(apex, eased),
                 size = v_largest(eased) * (v_largest(M) + v_largest(h)) + v_largest(O);
    /* The torque `needed` keeps a zero spin at zero if |needed| <= most. Else, the torque is most
     * or -most, against the spin or, if the spin is zero, towards `needed`. `spin` is a sum of
     * terms up to `size` that may cancel; below SPIN_OF_HELD * size, it counts as zero. */
    const int is_zero = fabs(spin) <= SPIN_OF_HELD * size;
    *holds = is_zero && fabs(needed) <= most;
    if (is_zero) return fmax(-most, fmin(needed, most));
    return spin > 0.0 ? -most : most;
}
/* Returns the angular acceleration V' along the principal axes, whose attitude is q. */
static kr_vec3 find_angular_acceleration(const kr_scene *scene, const kr_state *s, kr_quat q)
{
    const kr_vec3 J = scene->body.inertia, M = q_turn_back(q, s->m),
                  W = v_over(v_sub(M, scene->body.rotor), J), P = q_turn_e3_back(q),
                  pull = v_cross(P, scene->body.com), O = q_turn_back(q, scene->turning),
                  V = kr_support_turns(scene) ? v_sub(W, O) : W;
    const double weight = scene->body.mass * kr_acceleration_at(scene, s->t);
    int holds;
    kr_vec3 torque = v_sub(v_axpy(weight, pull, v_cross(M, W)), v_times(scene->damping, V));
    if (scene->gradient != 0.0) torque = v_add(torque, kr_gradient_torque(scene, P));
    kr_vec3 gain = v_over(torque, J);
    if (kr_support_turns(scene)) gain = v_sub(gain, v_cross(O, W));
    if (scene->friction > 0.0)
        gain = v_axpy(kr_friction_torque(scene, M, O, gain, &holds),
                      v_over(kr_body_apex(&scene->body), J), gain);
    return gain;
}
kr_vec3 kr_state_body_acceleration(const kr_scene *scene, const kr_state *s)
{
    return q_turn(scene->body.axes,
                  find_angular_acceleration(scene, s, principal_attitude(scene, s)));
}
kr_vec3 kr_state_pivot_force(const kr_scene *scene, const kr_state *s)
{
    const kr_quat q = principal_attitude(scene, s);
    const kr_vec3 com = scene->body.com,
                  W = v_over(momentum_without_rotor(scene, s, q), scene->body.inertia),
                  gain = v_add(find_angular_acceleration(scene, s, q),
                               v_cross(q_turn_back(q, scene->turning), W)),
                  tide = kr_tidal_acceleration(q_turn_e3_back(q), com),
                  of_com = v_axpy(-scene->gradient, tide,
                                  v_add(v_cross(gain, com), v_cross(W, v_cross(W, com))));
    kr_vec3 force = q_turn(q, v_scale(scene->body.mass, of_com));
    force.z += scene->body.mass * kr_acceleration_at(scene, s->t);
    return force;
}
double kr_state_modified_energy(const kr_scene *scene, const kr_state *s, double step, int order)
{
    const kr_working w = kr_body_working(&scene->body);
    const double weight = scene->body.mass * scene->gravity, i1 = w.inertia.x;
    if (kr_body_kind(&scene->body, KR_KIND_RTOL) != KR_KIND_LAGRANGE) return NAN;
    if (kr_body_has_rotor(&scene->body) || kr_support_shakes(scene) || scene->gradient != 0.0)
        return NAN;
    const kr_quat q = principal_attitude(scene, s);
    const kr_vec3 M = momentum_without_rotor(scene, s, q), a = q_turn_e3(q_mul(q, w.axes));
    if (order == 1)
        return 0.5 * v_dot(M, v_over(M, scene->body.inertia)) +
               weight * v_dot(scene->body.com, q_turn_e3_back(q)) +
               0.5 * step * v_dot(kr_state_torque(scene, s), s->m) / i1;
    if (order != 4) return NAN;
    const double c = kr_state_axial_momentum(scene, s);
    const map_rates r = find_map_step(step, weight * w.com.z / i1, a, v_scale(1.0 / i1, s->m));
    return i1 * r.energy + 0.5 * (1.0 / w.inertia.z - 1.0 / i1) * c * c;
}
double kr_attitude_error(kr_quat a, kr_quat b)
{
    const kr_quat d = q_mul(q_conj(a), b);
    return 2.0 * atan2(v_length(q_vec(d)), fabs(d.w));
}
