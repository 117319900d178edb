/* Derivatives of quantities such as the energy with respect to the initial state and parameters,
 * computed from such derivatives of the state (tangents). Let R be the attitude of the principal
 * axes, J the inertia and h the momentum of the rotor. Along these axes, M = R* m R is the
 * momentum, W = J^-1 (M - h) the angular velocity, V = R* e3 R the vertical (quantities.c: P),
 * O = R* turning R the angular velocity of the support, and U = W - O (quantities.c: V). A small
 * rotation vector theta along the principal axes, a change dm of the momentum in space, and changes
 * dJ, dh and dturning of the parameters cause the changes
 *     dM = R* dm R + M x theta,   dW = J^-1 (dM - dh - dJ W),   dV = V x theta,
 *     dO = O x theta + R* dturning R,   dU = dW - dO,
 * and a vector R v R* in space changes by R (dv + theta x v) R*. The gravity gradient is k, the
 * damping D, and `weight` is mass times kr_acceleration_at (quantities.h). A tangent_of_<quantity>
 * function returns the derivative of the quantity at the point `at` along the change `by`. */
#include "quantities.h"
#include "math/trig.h"
#include "scene.h"

/* A state and the parameters of a top. Vectors are along the principal axes unless noted. */
typedef struct quantity_point {
    const kr_scene *scene;
    const kr_state *state;
    kr_vec3 described[3]; /* the principal axes in the frame of description (kreisel.h) */
    kr_vec3 frame[3];     /* the principal axes in space */
    kr_vec3 M, W, V, O, U;
    kr_vec3 apex;         /* kr_body_apex (body.h) */
    double reach, weight; /* reach: |com| */
} quantity_point;
/* An infinitesimal change of the state and of at most one parameter. M, W, V, O, U, apex and weight
 * are changes of the members of quantity_point with these names; moments, com, damping, rotor,
 * turning and gradient are changes of parameters (kr_body and kr_scene in kreisel.h). */
typedef struct quantity_change {
    kr_vec3 described_turn; /* theta in the frame of description */
    kr_vec3 push;           /* dm, in space */
    kr_vec3 turn;           /* theta */
    kr_vec3 M, W, V, O, U, apex;
    kr_vec3 moments, com, damping, rotor, turning; /* moments: of kr_body.inertia */
    int shaking; /* the changed parameter: 1 amplitude, 2 rate, 3 phase; 0: none */
    double weight, gradient;
    int changes_com, is_mass, is_friction; /* 1: this parameter is changed */
} quantity_change;

/* Returns the linear combination of three axes whose coefficients are the components of v. */
static kr_vec3 combine_axes(const kr_vec3 axes[3], kr_vec3 v)
{
    return v_axpy(v.x, axes[0], v_axpy(v.y, axes[1], v_scale(v.z, axes[2])));
}
/* Returns the components of v along three given orthonormal axes. */
static kr_vec3 components_along(const kr_vec3 axes[3], kr_vec3 v)
{
    return v3(v_dot(axes[0], v), v_dot(axes[1], v), v_dot(axes[2], v));
}
/* Returns the change in space of a vector with the components v along the principal axes, if these
 * components change by dv and the body rotates by by->turn. */
static kr_vec3 find_space_change(const quantity_point *at, const quantity_change *by, kr_vec3 v,
                                 kr_vec3 dv)
{
    return combine_axes(at->frame, v_add(dv, v_cross(by->turn, v)));
}

/* Returns the change of the torque k V x J V of the gravity gradient k. */
static kr_vec3 find_gradient_torque_change(const quantity_point *at, const quantity_change *by)
{
    const double k = at->scene->gradient;
    const kr_vec3 J = at->scene->body.inertia, JV = v_times(J, at->V),
                  dJV = v_add(v_times(by->moments, at->V), v_times(J, by->V));
    return v_axpy(by->gradient, v_cross(at->V, JV),
                  v_scale(k, v_add(v_cross(by->V, JV), v_cross(at->V, dJV))));
}

static kr_vec3 tangent_of_torque(const quantity_point *at, const quantity_change *by)
{
    const kr_vec3 com = at->scene->body.com, a = combine_axes(at->frame, com),
                  da = find_space_change(at, by, com, by->com);
    const kr_vec3 of_gradient = find_space_change(at, by, kr_gradient_torque(at->scene, at->V),
                                                  find_gradient_torque_change(at, by));
    return v_add(of_gradient, v3(-by->weight * a.y - at->weight * da.y,
                                 by->weight * a.x + at->weight * da.x, 0.0));
}

/* Returns the infinitesimal vector v with q_tilt(a + da) = q_exp(v) q_tilt(a) (su2.h). */
static kr_vec3 find_rotation_change_of_tilt(kr_vec3 a, kr_vec3 da)
{
    if (a.z < -0.5) return find_rotation_change_of_tilt(v_scale(-1.0, a), v_scale(-1.0, da));
    const double w = 1.0 + a.z;
    const kr_vec3 v = v3(-a.y, a.x, 0.0), dv = v3(-da.y, da.x, 0.0),
                  turn = v_add(v_sub(v_scale(w, dv), v_scale(da.z, v)), v_cross(v, dv));
    return v_scale(1.0 / w, turn);
}
/* Returns the infinitesimal rotation vector, in space, of the frame of the Euler angles: the frame
 * with the attitude r (quantities.c), whose third axis is the apex. */
static kr_vec3 find_euler_frame_turn(const quantity_point *at, const quantity_change *by)
{
    const kr_vec3 turn = combine_axes(at->frame, by->turn);
    if (!by->changes_com) return turn;
    const kr_vec3 tilt = find_rotation_change_of_tilt(combine_axes(at->described, at->apex),
                                                      combine_axes(at->described, by->apex));
    return v_add(turn, q_turn(at->state->q, tilt));
}
/* Returns the unit vector along the horizontal projection of the apex; its x and y are NaN if the
 * apex is vertical. Writes the length of this projection, and the apex in space. */
static kr_vec3 find_horizontal_apex_direction(const quantity_point *at, double *length,
                                              kr_vec3 *apex)
{
    *apex = combine_axes(at->frame, at->apex);
    *length = sqrt(apex->x * apex->x + apex->y * apex->y);
    return v3(apex->x / *length, apex->y / *length, 0.0);
}
/* If the Euler angles change, their frame rotates by turn = dprecession * e3 + dnutation * n +
 * dspin * apex, n being horizontal and normal to the apex. find_horizontal_apex_direction returns
 * `along` and `length`: dspin = <along, turn> / length, dprecession = turn.z - dspin * apex.z. */
static double tangent_of_precession_angle(const quantity_point *at, const quantity_change *by)
{
    double length;
    kr_vec3 apex;
    const kr_vec3 along = find_horizontal_apex_direction(at, &length, &apex),
                  turn = find_euler_frame_turn(at, by);
    return turn.z - apex.z / length * v_dot(along, turn);
}
static double tangent_of_nutation(const quantity_point *at, const quantity_change *by)
{
    double length;
    kr_vec3 apex;
    const kr_vec3 along = find_horizontal_apex_direction(at, &length, &apex),
                  change = find_space_change(at, by, at->apex, by->apex);
    return apex.z * v_dot(along, change) - length * change.z;
}
static double tangent_of_spin_angle(const quantity_point *at, const quantity_change *by)
{
    double length;
    kr_vec3 apex;
    const kr_vec3 along = find_horizontal_apex_direction(at, &length, &apex);
    return v_dot(along, find_euler_frame_turn(at, by)) / length;
}

static double tangent_of_kinetic(const quantity_point *at, const quantity_change *by)
{
    const kr_vec3 carried = v_add(v_add(by->rotor, v_times(by->moments, at->O)),
                                  v_times(at->scene->body.inertia, by->O));
    return v_dot(by->M, at->U) - 0.5 * v_dot(v_times(by->moments, at->U), at->U) -
           v_dot(carried, at->U);
}
static double tangent_of_potential(const quantity_point *at, const quantity_change *by)
{
    const kr_vec3 com = at->scene->body.com;
    double change =
        by->weight * v_dot(com, at->V) + at->weight * (v_dot(by->com, at->V) + v_dot(com, by->V));
    const kr_vec3 J = at->scene->body.inertia, h = at->scene->body.rotor, JV = v_times(J, at->V);
    const double k = at->scene->gradient;
    if (k != 0.0 || by->gradient != 0.0)
        change += 0.5 * by->gradient * v_dot(JV, at->V) +
                  k * (v_dot(JV, by->V) + 0.5 * v_dot(v_times(by->moments, at->V), at->V));
    if (!kr_support_turns(at->scene) && v_largest(by->turning) == 0.0) return change;
    return change -
           (v_dot(v_times(J, at->O), by->O) + 0.5 * v_dot(v_times(by->moments, at->O), at->O) +
            v_dot(by->rotor, at->O) + v_dot(h, by->O));
}

/* The members m and p are the vectors of find_integral_vectors (quantities.c), momentum / I1 and
 * vertical * weight |com| / I1. dm and dp are their changes (not dm of the opening comment). */
typedef struct integral_vectors {
    kr_vec3 m, p, dm, dp;
} integral_vectors;
/* Returns the change of the components v of a vector along axes that rotate about the third axis by
 * an infinitesimal angle. `dv` is the change of the components along axes that do not rotate. */
static kr_vec3 change_in_rotating_axes(double dangle, kr_vec3 v, kr_vec3 dv)
{
    return v3(dv.x + dangle * v.y, dv.y - dangle * v.x, dv.z);
}
/* Writes the vectors m and p of find_integral_vectors and their changes to `f`, and returns 1; or 0
 * if the integral of the case `kind` is undefined for the top or the parameter change in `by`. */
static int find_integral_vector_changes(const quantity_point *at, const quantity_change *by,
                                        kr_kind kind, integral_vectors *f)
{
    const kr_body *body = &at->scene->body;
    if (kr_body_kind(body, KR_KIND_RTOL) != kind || v_largest(by->moments) > 0.0) return 0;
    if (at->scene->gradient != 0.0 || by->gradient != 0.0) return 0;
    if (kr_support_shakes(at->scene) || by->shaking || v_largest(by->rotor) > 0.0) return 0;
    const kr_working w = kr_body_working(body);
    if (fabs(q_turn_back(w.axes, by->com).z) > 0.5) return 0;
    const kr_vec3 first = v_scale(-1.0, v_unit(w.com)),
                  axes[3] = {first, v3(-first.y, first.x, 0.0), v3(0.0, 0.0, 1.0)};
    const double share = 1.0 / w.inertia.x, size = at->weight * at->reach * share,
                 change = by->weight * at->reach + at->weight * v_dot(at->apex, by->com),
                 turn = -v_dot(axes[1], q_turn_back(w.axes, by->apex));
    const kr_vec3 vertical = components_along(axes, q_turn_back(w.axes, at->V)),
                  dm = components_along(axes, q_turn_back(w.axes, by->M)),
                  dp = components_along(axes, q_turn_back(w.axes, by->V));
    f->m = v_scale(share, components_along(axes, q_turn_back(w.axes, at->M)));
    f->p = v_scale(size, vertical);
    f->dm = change_in_rotating_axes(turn, f->m, v_scale(share, dm));
    f->dp =
        change_in_rotating_axes(turn, f->p, v_axpy(size, dp, v_scale(change * share, vertical)));
    return 1;
}
static double tangent_of_kowalewski(const quantity_point *at, const quantity_change *by)
{
    integral_vectors f;
    if (!find_integral_vector_changes(at, by, KR_KIND_KOWALEWSKI, &f)) return NAN;
    const double re = f.m.x * f.m.x - f.m.y * f.m.y + 2.0 * f.p.x,
                 im = 2.0 * (f.m.x * f.m.y + f.p.y),
                 dre = 2.0 * (f.m.x * f.dm.x - f.m.y * f.dm.y + f.dp.x),
                 dim = 2.0 * (f.m.x * f.dm.y + f.m.y * f.dm.x + f.dp.y);
    return 2.0 * (re * dre + im * dim);
}
static double tangent_of_goryachev_chaplygin(const quantity_point *at, const quantity_change *by)
{
    integral_vectors f;
    if (!find_integral_vector_changes(at, by, KR_KIND_GORYACHEV_CHAPLYGIN, &f)) return NAN;
    return f.dm.z * (f.m.x * f.m.x + f.m.y * f.m.y) +
           2.0 * f.m.z * (f.m.x * f.dm.x + f.m.y * f.dm.y) + f.dm.x * f.p.z + f.m.x * f.dp.z;
}
/* Adds J^-1 (torque * a), the effect of dry friction about the apex a, to alpha = *acceleration.
 * Given `dacceleration`, the derivative of alpha, returns that of the sum. If friction keeps the
 * spin at zero, torque = -<alpha, a> / <a, J^-1 a>; else, it is -friction or friction. */
static kr_vec3 add_friction_to_acceleration(const quantity_point *at, const quantity_change *by,
                                            kr_vec3 *acceleration, kr_vec3 dacceleration)
{
    int holds;
    const double torque = kr_friction_torque(at->scene, at->M, at->O, *acceleration, &holds);
    const kr_vec3 a = at->apex, da = by->apex, J = at->scene->body.inertia, eased = v_over(a, J),
                  deased = v_over(v_sub(da, v_times(by->moments, eased)), J);
    double dtorque = by->is_friction ? copysign(1.0, torque) : 0.0;
    if (holds)
        dtorque = -(v_dot(dacceleration, a) + v_dot(*acceleration, da) +
                    torque * (v_dot(da, eased) + v_dot(a, deased))) /
                  v_dot(a, eased);
    *acceleration = v_axpy(torque, eased, *acceleration);
    return v_axpy(dtorque, eased, v_axpy(torque, deased, dacceleration));
}
/* Writes the angular acceleration U' = W' - O x W to `acceleration`, and returns its derivative.
 * Without friction, J W' = M x W + weight V x com + k V x J V - D U. The derivative with respect to
 * friction is NaN if friction is 0. */
static kr_vec3 find_angular_acceleration_change(const quantity_point *at, const quantity_change *by,
                                                kr_vec3 *acceleration)
{
    const kr_vec3 J = at->scene->body.inertia, com = at->scene->body.com, D = at->scene->damping,
                  pull = v_cross(at->V, com),
                  torque = v_add(
                      v_sub(v_axpy(at->weight, pull, v_cross(at->M, at->W)), v_times(D, at->U)),
                      kr_gradient_torque(at->scene, at->V)),
                  dpull = v_add(v_cross(by->V, com), v_cross(at->V, by->com)),
                  gyric = v_add(v_cross(by->M, at->W), v_cross(at->M, by->W)),
                  drag = v_add(v_times(by->damping, at->U), v_times(D, by->U)),
                  dtorque = v_add(v_add(v_axpy(by->weight, pull, v_scale(at->weight, dpull)),
                                        v_sub(gyric, drag)),
                                  find_gradient_torque_change(at, by)),
                  turned = v_add(v_cross(by->O, at->W), v_cross(at->O, by->W)),
                  gain = v_sub(v_over(torque, J), v_cross(at->O, at->W));
    kr_vec3 change =
        v_sub(v_over(v_sub(dtorque, v_times(by->moments, v_over(torque, J))), J), turned);
    *acceleration = gain;
    if (at->scene->friction > 0.0)
        change = add_friction_to_acceleration(at, by, acceleration, change);
    else if (by->is_friction)
        change = v3(NAN, NAN, NAN);
    return change;
}
static kr_vec3 tangent_of_body_acceleration(const quantity_point *at, const quantity_change *by)
{
    kr_vec3 acceleration;
    return combine_axes(at->described, find_angular_acceleration_change(at, by, &acceleration));
}
/* Returns the derivative of the force R (mass A + weight V) R* of the support on the body, with
 * A = W' x com + W x (W x com) - k kr_tidal_acceleration(V, com) and W' = U' + O x W. */
static kr_vec3 tangent_of_pivot_force(const quantity_point *at, const quantity_change *by)
{
    kr_vec3 gain, dgain = find_angular_acceleration_change(at, by, &gain);
    const kr_vec3 com = at->scene->body.com, W = at->W, moved = v_cross(W, com),
                  dmoved = v_add(v_cross(by->W, com), v_cross(W, by->com));
    gain = v_add(gain, v_cross(at->O, W));
    dgain = v_add(dgain, v_add(v_cross(by->O, W), v_cross(at->O, by->W)));
    const double k = at->scene->gradient;
    const kr_vec3 tide = kr_tidal_acceleration(at->V, com),
                  dtide = v_add(v_axpy(v_dot(by->V, com), at->V, v_scale(v_dot(at->V, com), by->V)),
                                kr_tidal_acceleration(at->V, by->com)),
                  A = v_axpy(-k, tide, v_add(v_cross(gain, com), v_cross(W, moved))),
                  dA = v_add(v_add(v_add(v_cross(dgain, com), v_cross(gain, by->com)),
                                   v_add(v_cross(by->W, moved), v_cross(W, dmoved))),
                             v_axpy(-k, dtide, v_scale(-by->gradient, tide)));
    const double mass = at->scene->body.mass;
    const kr_vec3 force = v_axpy(mass, A, v_scale(at->weight, at->V)),
                  dforce = v_axpy(mass, dA, v_axpy(by->weight, at->V, v_scale(at->weight, by->V)));
    return find_space_change(at, by, force, by->is_mass ? v_add(dforce, A) : dforce);
}

/* The momentum and the axis of a wheel do not depend on the parameters. */
static double tangent_of_wheel_rate(const quantity_point *at, const quantity_change *by, int i)
{
    const kr_wheel *wheel = &at->scene->wheels[i];
    const int is_none = v_largest(wheel->axis) == 0.0 && wheel->rate == 0.0;
    return is_none ? NAN : -v_dot(wheel->axis, by->W);
}

static double tangent_of_scalar(size_t index, const quantity_point *at, const quantity_change *by)
{
    switch (index) {
    case KR_QUANTITY_spin:
        return v_dot(by->U, at->apex) + v_dot(at->U, by->apex);
    case KR_QUANTITY_precession_angle:
        return tangent_of_precession_angle(at, by);
    case KR_QUANTITY_nutation:
        return tangent_of_nutation(at, by);
    case KR_QUANTITY_spin_angle:
        return tangent_of_spin_angle(at, by);
    case KR_QUANTITY_kinetic:
        return tangent_of_kinetic(at, by);
    case KR_QUANTITY_potential:
        return tangent_of_potential(at, by);
    case KR_QUANTITY_energy:
        return tangent_of_kinetic(at, by) + tangent_of_potential(at, by);
    case KR_QUANTITY_vertical_momentum:
        return by->push.z;
    case KR_QUANTITY_axial_momentum:
        return v_dot(by->M, at->apex) + v_dot(at->M, by->apex);
    case KR_QUANTITY_kowalewski:
        return tangent_of_kowalewski(at, by);
    case KR_QUANTITY_goryachev_chaplygin:
        return tangent_of_goryachev_chaplygin(at, by);
    case KR_QUANTITY_wheel_rate:
        return tangent_of_wheel_rate(at, by, 0);
    case KR_QUANTITY_second_wheel_rate:
        return tangent_of_wheel_rate(at, by, 1);
    case KR_QUANTITY_third_wheel_rate:
        return tangent_of_wheel_rate(at, by, 2);
    default:
        return NAN;
    }
}
/* Returns the derivative of the vector kr_quantities[index], or by->described_turn for q. */
static kr_vec3 tangent_of_vector(size_t index, const quantity_point *at, const quantity_change *by)
{
    switch (index) {
    case KR_QUANTITY_q:
        return by->described_turn;
    case KR_QUANTITY_m:
        return by->push;
    case KR_QUANTITY_velocity:
        return find_space_change(at, by, at->U, by->U);
    case KR_QUANTITY_torque:
        return tangent_of_torque(at, by);
    case KR_QUANTITY_apex:
        return find_space_change(at, by, at->apex, by->apex);
    case KR_QUANTITY_body_velocity:
        return combine_axes(at->described, by->U);
    case KR_QUANTITY_inertial_velocity:
        return combine_axes(at->described, by->W);
    case KR_QUANTITY_body_momentum:
        return combine_axes(at->described, by->M);
    case KR_QUANTITY_body_vertical:
        return combine_axes(at->described, by->V);
    case KR_QUANTITY_body_acceleration:
        return tangent_of_body_acceleration(at, by);
    case KR_QUANTITY_pivot_force:
        return tangent_of_pivot_force(at, by);
    default:
        return v3(NAN, NAN, NAN);
    }
}
static void write_tangent(size_t index, const quantity_point *at, const quantity_change *by,
                          double out[])
{
    const kr_vec3 none = {0.0, 0.0, 0.0};
    if (index == KR_QUANTITY_frame)
        for (int i = 0; i < 3; i++) v_put(out + 3 * i, find_space_change(at, by, v_axis(i), none));
    else if (kr_quantities[index].doubles == 1)
        *out = tangent_of_scalar(index, at, by);
    else
        v_put(out, tangent_of_vector(index, at, by));
}

static quantity_point make_point(const kr_scene *scene, const kr_state *s)
{
    const kr_body *body = &scene->body;
    quantity_point at = {
        .scene = scene, .state = s, .weight = body->mass * kr_acceleration_at(scene, s->t)};
    kr_state_frame(scene, s, at.frame);
    for (int i = 0; i < 3; i++) at.described[i] = q_turn(body->axes, v_axis(i));
    at.M = components_along(at.frame, s->m);
    at.W = v_over(v_sub(at.M, body->rotor), body->inertia);
    at.O = components_along(at.frame, scene->turning);
    at.U = v_sub(at.W, at.O);
    at.V = v3(at.frame[0].z, at.frame[1].z, at.frame[2].z);
    at.apex = kr_body_apex(body);
    at.reach = v_dot(at.apex, body->com);
    return at;
}
/* Returns the derivative of kr_acceleration_at by the amplitude (1), rate (2) or phase (3). */
static double find_acceleration_derivative(const quantity_point *at, int shaking_parameter)
{
    const kr_shaking *by = &at->scene->shaking;
    const double square = by->rate * by->rate, t = at->state->t;
    double sine, cosine;
    sin_cos(by->rate * t + by->phase, &sine, &cosine);
    if (shaking_parameter == 1) return -square * cosine;
    const double by_phase = by->amplitude * square * sine;
    return shaking_parameter == 3 ? by_phase
                                  : by_phase * t - 2.0 * by->amplitude * by->rate * cosine;
}
/* Sets the changes of the state (and of `weight`) in `by`, given its parameter change and a column
 * of the tangent matrix: theta in the frame of description, followed by dm. */
static void set_state_changes(const quantity_point *at, const double tangent_column[6],
                              quantity_change *by)
{
    const kr_vec3 none = {0.0, 0.0, 0.0};
    by->described_turn = v_of(tangent_column);
    by->push = v_of(tangent_column + 3);
    by->turn = components_along(at->described, by->described_turn);
    by->M = v_add(components_along(at->frame, by->push), v_cross(at->M, by->turn));
    by->W = v_over(v_sub(v_sub(by->M, by->rotor), v_times(by->moments, at->W)),
                   at->scene->body.inertia);
    by->V = v_cross(at->V, by->turn);
    by->O = v_add(v_cross(at->O, by->turn), components_along(at->frame, by->turning));
    by->U = v_sub(by->W, by->O);
    if (by->shaking)
        by->weight = at->scene->body.mass * find_acceleration_derivative(at, by->shaking);
    if (by->is_mass) by->weight = kr_acceleration_at(at->scene, at->state->t);
    by->apex = none;
    if (!by->changes_com) return;
    by->apex = at->reach > 0.0
                   ? v_scale(1.0 / at->reach, v_axpy(-v_dot(at->apex, by->com), at->apex, by->com))
                   : v3(NAN, NAN, NAN);
}
/* Sets the parameter change of each column of the tangent matrix, for KR_TANGENT_... flags. */
static void set_column_parameters(const kr_scene *scene, uint64_t tangents, quantity_change *by)
{
    if (tangents & KR_TANGENT_START) by += 6;
    for (int i = 0; i < 3 && tangents & KR_TANGENT_MOMENTS; i++, by++) by->moments = v_axis(i);
    for (int i = 0; i < 3 && tangents & KR_TANGENT_COM; i++, by++) {
        by->com = v_axis(i);
        by->changes_com = 1;
    }
    if (tangents & KR_TANGENT_GRAVITY) by++->weight = scene->body.mass;
    if (tangents & KR_TANGENT_MASS) by++->is_mass = 1;
    for (int i = 0; i < 3 && tangents & KR_TANGENT_DAMPING; i++, by++) by->damping = v_axis(i);
    for (int i = 0; i < 3 && tangents & KR_TANGENT_ROTOR; i++, by++) by->rotor = v_axis(i);
    for (int i = 0; i < 3 && tangents & KR_TANGENT_TURNING; i++, by++) by->turning = v_axis(i);
    for (int i = 0; i < 3 && tangents & KR_TANGENT_SHAKING; i++) by++->shaking = 1 + i;
    if (tangents & KR_TANGENT_FRICTION) by++->is_friction = 1;
    if (tangents & KR_TANGENT_GRADIENT) by->gradient = 1.0;
}
void kr_quantity_tangents(const kr_quantity *quantity, const kr_scene *scene, size_t n,
                          const kr_state states[], uint64_t by, const double tangents[],
                          double out[])
{
    const size_t index = (size_t)(quantity - kr_quantities), columns = kr_tangent_columns(by),
                 rows = index == KR_QUANTITY_q ? 3 : quantity->doubles;
    quantity_change changes[KR_TANGENT_COLUMNS_MAX] = {0};
    double value[KR_QUANTITY_DOUBLES_MAX], column[6];
    set_column_parameters(scene, by, changes);
    for (size_t i = 0; i < n; i++, tangents += 6 * columns, out += rows * columns) {
        const quantity_point at = make_point(scene, &states[i]);
        for (size_t c = 0; c < columns; c++) {
            for (size_t row = 0; row < 6; row++) column[row] = tangents[row * columns + c];
            set_state_changes(&at, column, &changes[c]);
            write_tangent(index, &at, &changes[c], value);
            for (size_t row = 0; row < rows; row++) out[row * columns + c] = value[row];
        }
    }
}
