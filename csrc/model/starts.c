/* Initial states given by velocities, momenta, Euler angles or spin; steady precession; wheels. */
#include <math.h>
#include "quantities.h"
#include "scene.h"

/* Returns a + b, but keeps the components of a, even -0.0, where those of b are zero. */
static kr_vec3 add_nonzero_components(kr_vec3 a, kr_vec3 b)
{
    return v3(b.x == 0.0 ? a.x : a.x + b.x, b.y == 0.0 ? a.y : a.y + b.y,
              b.z == 0.0 ? a.z : a.z + b.z);
}
/* Returns the quaternion product a b, like q_mul (su2.h), but adds the terms in another order. This
 * order is kept, because published initial states depend on the last bits of their attitudes. */
static kr_quat q_mul_published_order(kr_quat a, kr_quat b)
{
    return q4(a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
              v3(a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                 a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                 a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w));
}
void kr_scene_set_velocity(kr_scene *scene, kr_vec3 velocity)
{
    const kr_quat q = q_mul_published_order(scene->start.q, scene->body.axes);
    const kr_vec3 W = q_turn_back(q, add_nonzero_components(velocity, scene->turning));
    scene->start.m =
        q_turn(q, add_nonzero_components(v_times(scene->body.inertia, W), scene->body.rotor));
}
void kr_scene_set_body_velocity(kr_scene *scene, kr_vec3 velocity)
{
    kr_scene_set_velocity(scene, q_turn(scene->start.q, velocity));
}
void kr_scene_set_body_momentum(kr_scene *scene, kr_vec3 momentum)
{
    scene->start.m = q_turn(scene->start.q, momentum);
}
/* Returns the rotation with the z-x-z Euler angles precession, nutation and spin. */
static kr_quat euler_rotation(kr_vec3 angles)
{
    const double c = cos(0.5 * angles.y), s = sin(0.5 * angles.y),
                 sum = 0.5 * angles.x + 0.5 * angles.z,
                 difference = 0.5 * angles.x - 0.5 * angles.z;
    return q4(c * cos(sum), v3(s * cos(difference), s * sin(difference), c * sin(sum)));
}
/* Returns the quaternion that rotates the axes of the frame of description to the body-fixed frame
 * of the Euler angles (kreisel.h), whose third axis is the apex. */
static kr_quat find_euler_frame_in_body(const kr_scene *scene)
{
    static const kr_state upright = {.q = {1.0, 0.0, 0.0, 0.0}};
    const kr_vec3 apex = kr_state_apex(scene, &upright);
    if (apex.x == 0.0 && apex.y == 0.0 && apex.z > 0.0) return q_one();
    return euler_rotation(v3(kr_state_precession_angle(scene, &upright),
                             kr_state_nutation(scene, &upright),
                             kr_state_spin_angle(scene, &upright)));
}
void kr_scene_set_euler(kr_scene *scene, kr_vec3 angles, kr_vec3 rates)
{
    const double c = cos(angles.x), s = sin(angles.x), level = rates.z * sin(angles.y);
    scene->start.q =
        q_mul_published_order(euler_rotation(angles), q_conj(find_euler_frame_in_body(scene)));
    kr_scene_set_velocity(scene, v3(rates.y * c + level * s, rates.y * s - level * c,
                                    rates.x + rates.z * cos(angles.y)));
}

/* Returns 1 if the body and its rotor are symmetric about `axis` (in the principal axes). */
static int is_symmetric_about(const kr_body *body, kr_vec3 axis)
{
    kr_body spun = *body;
    spun.rotor = axis;
    return kr_body_kind(&spun, KR_KIND_RTOL) != KR_KIND_GENERAL &&
           kr_body_is_rotor_axial(body, KR_KIND_RTOL);
}
/* Subtracts the moment `inertia` about the unit vector `axis` (in the frame of description) from
 * the inertia tensor of the body. Returns the status of kr_body_from_tensor (kreisel.h). */
static kr_status subtract_wheel_moment(kr_body *body, double inertia, kr_vec3 axis)
{
    const kr_vec3 com = q_turn(body->axes, body->com), moments = body->inertia;
    double j[9], a[3];
    v_put(a, axis);
    for (int i = 0; i < 9; i++) {
        const kr_vec3 row = q_turn_back(body->axes, v_axis(i / 3)),
                      column = q_turn_back(body->axes, v_axis(i % 3));
        j[i] = v_dot(row, v_times(moments, column)) - inertia * a[i / 3] * a[i % 3];
    }
    return kr_body_from_tensor(body->mass, j, com, body->rounded, body);
}
kr_status kr_scene_release_wheel(kr_scene *scene, double inertia, kr_vec3 axis, double rate)
{
    kr_scene made = *scene;
    kr_body *body = &made.body;
    const kr_quat old = body->axes;
    int place = 0;
    while (place < KR_WHEELS_MAX &&
           (v_largest(made.wheels[place].axis) > 0.0 || made.wheels[place].rate != 0.0))
        place++;
    if (place == KR_WHEELS_MAX || !(inertia > 0.0 && inertia < INFINITY) || !isfinite(rate) ||
        !v_finite(axis) || v_largest(axis) == 0.0)
        return KR_ERR_ARGUMENT;
    const kr_vec3 unit = v_unit(axis), along = q_turn_back(old, unit),
                  rotor = q_turn(old, body->rotor),
                  W = kr_state_inertial_velocity(scene, &scene->start);
    const double own = v_dot(along, v_times(body->inertia, along)), about = v_dot(unit, W);
    kr_wheel *wheel = &made.wheels[place];
    if (fabs(own - inertia) <= KR_INPUT_RTOL * own) {
        if (!is_symmetric_about(body, along)) return KR_ERR_BODY;
        *wheel = (kr_wheel){.rate = rate};
    } else {
        const kr_status status = subtract_wheel_moment(body, inertia, unit);
        if (status != KR_OK) return KR_ERR_BODY;
        for (int i = 0; i < place; i++)
            made.wheels[i].axis = q_turn_back(body->axes, q_turn(old, made.wheels[i].axis));
        kr_body_set_rotor(body, v_axpy(inertia * about, unit, rotor));
        *wheel = (kr_wheel){q_turn_back(body->axes, unit), rate + about};
    }
    const kr_status status = kr_scene_check(&made);
    if (status == KR_OK) *scene = made;
    return status;
}

kr_status kr_scene_steady_precession(const kr_scene *scene, double spin, double tilt, int fast,
                                     double *precession, double *least_spin)
{
    double i1, i3;
    if (!kr_body_symmetry(&scene->body, &i1, &i3) || !isfinite(spin) || !isfinite(tilt))
        return KR_ERR_ARGUMENT;
    /* The precession rate x solves I1 cos(tilt) x^2 - I3 spin x + mass g |com| = 0 (Goldstein,
     * Classical Mechanics, 5.7). The root of larger magnitude is computed without cancellation. The
     * other is the product of the roots, mass g |com| / (I1 cos(tilt)), divided by that root. */
    const kr_vec3 com = scene->body.com;
    const double torque = scene->body.mass * scene->gravity * hypot(hypot(com.x, com.y), com.z);
    const double a = fabs(cos(tilt)) > 1e-15 ? i1 * cos(tilt) : 0.0, b = i3 * spin, size = fabs(b),
                 root = 2.0 * sqrt(fabs(a)) * sqrt(fabs(torque));
    const int is_hanging = a * torque <= 0.0,
              is_too_slow = !is_hanging && size < root * (1 - 1e-12);
    const double more =
                     is_hanging ? hypot(b, root) : sqrt(fmax(size - root, 0.0)) * sqrt(size + root),
                 larger = 0.5 * copysign(size + more, b);
    *least_spin = is_too_slow ? root / i3 : 0.0;
    *precession = 0.0;
    if (fabs(sin(tilt)) < 1e-15) return KR_OK;
    if (is_too_slow || (larger == 0.0 && torque != 0.0) || (fast && a == 0.0))
        return KR_ERR_ARGUMENT;
    if (fast) *precession = larger / a;
    if (!fast && larger != 0.0) *precession = torque / larger;
    return KR_OK;
}
kr_status kr_scene_set_spinning(kr_scene *scene, double spin, double tilt, double precession)
{
    static const double pi = 3.14159265358979323846;
    double i1, i3;
    if (!kr_body_symmetry(&scene->body, &i1, &i3) || !(tilt >= 0.0 && tilt <= pi))
        return KR_ERR_ARGUMENT;
    kr_scene_set_euler(scene, v3(0.0, tilt, 0.0),
                       v3(precession, 0.0, spin - precession * cos(tilt)));
    return KR_OK;
}
