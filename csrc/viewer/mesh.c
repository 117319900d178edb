/* The shapes of mesh.h. The apex is the unit vector from the fixed point to the centre of mass. The
 * tangent of the rod's centre line at each point is the apex at the corresponding time. */
#include <math.h>
#include "mesh.h"
#include "math/su2.h"
#include "model/quantities.h"
#include "model/scene.h"

/* Writes to `box` the homogeneous cuboid of the given mass that has the inertia of the body and the
 * same product of mass and centre of mass. Returns its volume, or 0 if there is no such cuboid. */
static double make_cuboid_of_mass(const kr_body *body, double mass, kr_box *box)
{
    const kr_vec3 c = v_scale(body->mass / mass, body->com), i = body->inertia;
    const double square = v_dot(c, c), xy = mass * c.x * c.y, yz = mass * c.y * c.z,
                 zx = mass * c.z * c.x;
    const double about_com[9] = {i.x - mass * (square - c.x * c.x), xy, zx, xy,
                                 i.y - mass * (square - c.y * c.y), yz, zx, yz,
                                 i.z - mass * (square - c.z * c.z)};
    kr_body b;
    if (kr_body_from_tensor(mass, about_com, v3(0.0, 0.0, 0.0), 0.0, &b) != KR_OK) return 0.0;
    const kr_vec3 j = b.inertia, twice = v3(j.y + j.z - j.x, j.z + j.x - j.y, j.x + j.y - j.z);
    const kr_vec3 squares = v_scale(1.5 / mass, twice);
    /* the edge of length 0 of a plate is replaced by a short edge */
    const double thin = 1e-8 * v_largest(squares);
    if (!(thin > 1e-16 * square)) return 0.0;
    box->half =
        v3(sqrt(fmax(squares.x, thin)), sqrt(fmax(squares.y, thin)), sqrt(fmax(squares.z, thin)));
    box->centre = q_turn(body->axes, c);
    box->turn = q_mul(body->axes, b.axes);
    const double volume = 8.0 * box->half.x * box->half.y * box->half.z;
    box->density = mass / volume;
    return volume;
}
/* Writes to `box` a cuboid with the inertia and the product mass * com of the body. Its mass is
 * chosen for density 1 or, if no such mass is found, for the largest volume. First, ternary search
 * finds the mass M of the largest volume: ln(volume) is a concave function of 1 / mass. Then,
 * bisection finds density 1 among masses above M, where the density increases with the mass. The
 * bisection begins at the mass M / 1.001, because ternary search is approximate. */
static void find_cuboid_with_free_mass(const kr_body *body, kr_box *box)
{
    double low = 0.0, high = 1.0 / body->mass;
    for (int i = 0; i < 90; i++) {
        const double third = (high - low) / 3.0;
        if (make_cuboid_of_mass(body, 1.0 / (low + third), box) >=
            make_cuboid_of_mass(body, 1.0 / (high - third), box))
            high -= third;
        else
            low += third;
    }
    double lightest = 1.001 * low, densest = 0.0;
    if (make_cuboid_of_mass(body, 1.0 / lightest, box) == 0.0 || box->density >= 1.0)
        densest = lightest = low;
    while (lightest - densest > 1e-15 * lightest) {
        const double middle = 0.5 * (densest + lightest);
        make_cuboid_of_mass(body, 1.0 / middle, box);
        *(box->density < 1.0 ? &lightest : &densest) = middle;
    }
    make_cuboid_of_mass(body, 1.0 / lightest, box);
}
kr_box kr_mesh_box(const kr_body *body)
{
    kr_box box = {{1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}, 1.0};
    if (make_cuboid_of_mass(body, body->mass, &box) == 0.0) find_cuboid_with_free_mass(body, &box);
    return box;
}

/* Returns the angular velocity of a frame in which the top never gains energy: 0 (inertial frame)
 * if there is no damping or friction, and either `weight` (mass * acceleration * |com|) is 0 or e3
 * is inertially constant (turning along e3); else scene->turning (the frame of the support). */
static kr_vec3 find_frame_without_energy_gain(const kr_scene *scene, double weight)
{
    const kr_vec3 turning = scene->turning;
    const int is_damped = v_largest(scene->damping) > 0.0 || scene->friction > 0.0,
              is_level = weight == 0.0 || (turning.x == 0.0 && turning.y == 0.0);
    return is_level && !is_damped ? v3(0.0, 0.0, 0.0) : turning;
}
/* Returns an upper bound on the angular speed relative to the frame with the angular velocity
 * scene->turning, if the kinetic energy in this frame is at most `energy`. The bound is closer for
 * a Lagrange top if scene->turning is 0: its spin never increases, so that all energy except that
 * of the initial spin is assigned to a rotation about a transverse axis. */
static double bound_relative_angular_speed(const kr_scene *scene, double energy)
{
    const kr_vec3 i = scene->body.inertia, a = v_unit(scene->body.com);
    if (kr_support_turns(scene) || kr_body_kind(&scene->body, KR_KIND_RTOL) != KR_KIND_LAGRANGE)
        return sqrt(2.0 * energy / fmin(i.x, fmin(i.y, i.z)));
    const double axial = v_dot(v_times(a, a), i), transverse = 0.5 * (i.x + i.y + i.z - axial),
                 spin = v_dot(kr_state_velocity(scene, &scene->start),
                              kr_state_apex(scene, &scene->start)),
                 rest = 2.0 * energy - axial * spin * spin;
    return sqrt(spin * spin + fmax(rest, 0.0) / transverse);
}
void kr_mesh_limits(const kr_scene *scene, double *momentum, double *velocity)
{
    const kr_body *b = &scene->body;
    const kr_shaking shaking = scene->shaking;
    const double acceleration =
        fabs(scene->gravity) + fabs(shaking.amplitude) * shaking.rate * shaking.rate;
    const double weight = b->mass * acceleration * v_length(b->com), rotor = v_length(b->rotor),
                 largest = v_largest(b->inertia),
                 smallest = fmin(b->inertia.x, fmin(b->inertia.y, b->inertia.z));
    kr_scene seen = *scene;
    seen.turning = find_frame_without_energy_gain(scene, weight);
    const double turning = v_length(seen.turning),
                 centrifugal = turning * (0.5 * turning * (largest - smallest) + 2.0 * rotor),
                 energy = kr_state_kinetic(&seen, &scene->start) + 2.0 * weight + centrifugal;
    *momentum = rotor + sqrt(2.0 * energy * largest) + largest * turning;
    *momentum = fmax(v_length(scene->start.m), *momentum);
    *velocity =
        bound_relative_angular_speed(&seen, energy) + v_length(v_sub(scene->turning, seen.turning));
    *velocity = fmax(v_length(kr_state_velocity(scene, &scene->start)), *velocity);
    if (!(*momentum > 0.0)) *momentum = 1.0;
    if (!(*velocity > 0.0)) *velocity = 1.0;
}

/* Returns the apex in the user's body frame. */
static kr_vec3 apex_in_body(const kr_body *body)
{
    const kr_scene scene = {.body = *body, .start = {.q = {1.0, 0.0, 0.0, 0.0}}};
    return kr_state_apex(&scene, &scene.start);
}
static void put_point(float point[3], kr_vec3 v)
{
    point[0] = (float)v.x;
    point[1] = (float)v.y;
    point[2] = (float)v.z;
}
/* Writes the trail of the points scale * apex, where `apex` is fixed in the body; older points are
 * up to 2 % closer to the fixed point. If `apex` is NULL, writes the points scale * momentum
 * instead. Returns the number of points. */
static int write_trail(const kr_trail *trail, const kr_vec3 *apex, double scale, float point[][3])
{
    const int64_t stride = trail->steps < KR_MESH_POINTS ? 1 : 2,
                  oldest = trail->steps - trail->size;
    int n = 0;
    for (int64_t k = trail->steps; k >= 0 && k > oldest && n < KR_MESH_POINTS; k -= stride, n++) {
        const double out = apex ? scale * (1.0 - 0.02 * n / (double)KR_MESH_POINTS) : scale;
        put_point(point[n], v_scale(out, apex ? q_turn(trail->attitude[k % trail->size], *apex)
                                              : trail->momentum[k % trail->size]));
    }
    return n;
}
int kr_mesh_trail(const kr_body *body, const kr_trail *trail, double radius, float point[][3])
{
    const kr_vec3 apex = apex_in_body(body);
    return write_trail(trail, &apex, radius, point);
}
int kr_mesh_momentum_trail(const kr_trail *trail, double scale, float point[][3])
{
    return write_trail(trail, NULL, scale, point);
}

/* Writes the semi-axes of the rod's cross section, in the frame of description (kreisel.h). They
 * lie along the two principal axes farthest from the apex. The semi-axis along each is proportional
 * to the moment of inertia about the other, raised to `power`. The larger semi-axis is `radius`. */
static void find_rod_cross_section(const kr_body *body, kr_vec3 apex, double radius, double power,
                                   kr_vec3 semi_axis[2])
{
    const double moment[3] = {body->inertia.x, body->inertia.y, body->inertia.z};
    const kr_vec3 a = q_turn_back(body->axes, apex);
    const double along[3] = {fabs(a.x), fabs(a.y), fabs(a.z)};
    const int k = along[2] >= fmax(along[0], along[1]) ? 2 : along[1] >= along[0], i = (k + 1) % 3,
              j = (k + 2) % 3;
    const double most = fmax(moment[i], moment[j]);
    semi_axis[0] = q_turn(body->axes, v_scale(radius * pow(moment[j] / most, power), v_axis(i)));
    semi_axis[1] = q_turn(body->axes, v_scale(radius * pow(moment[i] / most, power), v_axis(j)));
}
int kr_mesh_rod(const kr_body *body, const kr_trail *trail, double scale, double radius,
                double power, float point[][3])
{
    const double round = 6.28318530717958648;
    const kr_vec3 apex = apex_in_body(body);
    const int64_t stride = (int64_t)fmax(1.0, 0.05 / trail->step + 0.5),
                  oldest = trail->steps - trail->size;
    kr_vec3 side[2], at = v3(0.0, 0.0, 0.0);
    int n = 0;
    find_rod_cross_section(body, apex, radius, power, side);
    for (int64_t k = trail->steps; k >= 0 && k > oldest && n < KR_MESH_RINGS; k -= stride, n++) {
        const kr_quat q = trail->attitude[k % trail->size];
        for (int s = 0; s < KR_MESH_SIDES; s++) {
            double sine, cosine;
            sin_cos(round * s / (double)KR_MESH_SIDES, &sine, &cosine);
            const kr_vec3 out = v_axpy(cosine, side[0], v_scale(sine, side[1]));
            put_point(point[n * KR_MESH_SIDES + s], v_add(at, q_turn(q, out)));
        }
        at = v_axpy(-scale * trail->step * (double)stride, q_turn(q, apex), at);
    }
    return n;
}
