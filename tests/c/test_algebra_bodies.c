/* Quaternions, trigonometry and bodies. */
#include "model/body.h"
#include "tops.h"

static void test_trigonometry(void)
{
    double s, c, worst = 0.0, worst_norm = 0.0, worst_tangent = 0.0;
    for (int i = 0; i < 200000; i++) {
        const double x = uniform(-1, 1) * pow(10.0, uniform(-9, 5));
        sin_cos(x, &s, &c);
        worst = fmax(worst, fmax(fabs(s - sin(x)) / fmax(fabs(sin(x)), 1e-3),
                                 fabs(c - cos(x)) / fmax(fabs(cos(x)), 1e-3)));
        worst_norm = fmax(worst_norm, fabs(s * s + c * c - 1.0));
        worst_tangent = fmax(worst_tangent, fabs(arc_tangent(x) - atan(x)) / fabs(atan(x)));
    }
    NEAR(worst, 0.0, 6e-16);
    NEAR(worst_norm, 0.0, 6e-16);
    NEAR(worst_tangent, 0.0, 1e-15);
    for (double x = 1e6; x < 1e300; x *= 7.0) { /* reduced modulo the double nearest to 2 pi */
        const double rest = fmod(x, 6.283185307179586);
        sin_cos(x, &s, &c);
        NEAR(s, sin(rest), 1e-15);
        NEAR(c, cos(rest), 1e-15);
        NEAR(s * s + c * c, 1.0, 6e-16);
        if (x > 1e15) continue; /* the bound would exceed 0.1 radians */
        NEAR(atan2(s * cos(x) - c * sin(x), c * cos(x) + s * sin(x)), 0.0, 1.2e-16 * x);
    }
    for (double z = 0.0; z < 400.0; z += 0.01) {
        cos_sinc(z, &c, &s);
        NEAR(c, cos(sqrt(z)), 3e-16 * (1.0 + sqrt(z)));
        NEAR(s, z > 0.0 ? sin(sqrt(z)) / sqrt(z) : 1.0, 3e-16);
        cosm1_sinc(z, &c, &s);
        NEAR(c, -2.0 * sin(0.5 * sqrt(z)) * sin(0.5 * sqrt(z)), 3e-16 * (fmin(z, 1.0) + sqrt(z)));
        NEAR(s, z > 0.0 ? sin(sqrt(z)) / sqrt(z) : 1.0, 3e-16);
    }
    sin_cos(INFINITY, &s, &c);
    IS(isnan(s) && isnan(c));
    IS(isnan(arc_tangent(NAN)));
    NEAR(arc_tangent(INFINITY), 1.5707963267948966, 0.0);
}
static void test_quaternions(void)
{
    for (int i = 0; i < 1000; i++) {
        const kr_quat p = random_quat(), q = random_quat();
        const kr_vec3 v = random_vec(3), r = random_vec(4), a = v_scale(1.0 / v_length(v), v);
        const kr_vec3 w = q_turn(q_mul(p, q), v), u = q_turn(p, q_turn(q, v)),
                      t = q_turn(q_tilt(a), v3(0, 0, 1));
        NEAR(off(w, u), 0.0, 1e-14);
        NEAR(off(q_turn_back(q, q_turn(q, v)), v), 0.0, 1e-14);
        NEAR(off(q_turn_e3(q), q_turn(q, v3(0, 0, 1))), 0.0, 1e-15);
        NEAR(off(q_turn_e3_back(q), q_turn_back(q, v3(0, 0, 1))), 0.0, 1e-15);
        NEAR(off(t, a), 0.0, 1e-15);
        NEAR(off(q_turn(q_exp(r), r), r), 0.0, 1e-14);
        NEAR(v_dot(q_turn(q_exp(v_cross(v, r)), v), v) / v_dot(v, v), cos(v_length(v_cross(v, r))),
             1e-13);
        const kr_quat f =
            q_of_frame(q_turn(q, v3(1, 0, 0)), q_turn(q, v3(0, 1, 0)), q_turn(q, v3(0, 0, 1)));
        NEAR(kr_attitude_error(f, q), 0.0, 2e-15);
        NEAR(kr_attitude_error(q_mul(q_exp(v_scale(1e-9, a)), q), q), 1e-9, 1e-15);
    }
    NEAR(kr_attitude_error(q_one(), q_scale(-1.0, q_one())), 0.0, 0.0);
    /* e3 turns e1 to e2 */
    NEAR(q_turn(q_exp(v3(0, 0, 1.5707963267948966)), v3(1, 0, 0)).y, 1.0, 1e-15);
}

/* Returns J_ij in the frame of description: J = axes diag(inertia) axes^t. */
static double inertia_as_described(const kr_body *b, int i, int j)
{
    const kr_vec3 u = q_turn_back(b->axes, v3(i == 0, i == 1, i == 2)),
                  w = q_turn_back(b->axes, v3(j == 0, j == 1, j == 2));
    return v_dot(u, v_times(b->inertia, w));
}
static void test_tensors(void)
{
    for (int trial = 0; trial < 3000; trial++) {
        const double scale = ldexp(1.0, (int)uniform(-120, 120));
        const int equal = trial % 4; /* number of equal moments: none, two, nearly two, three */
        const double a = uniform(1, 2), b = equal == 0   ? uniform(1, 2)
                                            : equal == 2 ? a * (1 + 1e-9)
                                                         : a;
        kr_body made = {2.0,
                        {scale * a, scale * b, scale * (equal == 3 ? a : uniform(0.9, 1.9))},
                        {0, 0, 0},
                        {1, 0, 0, 0},
                        0,
                        .rotor = {0, 0, 0}},
                found;
        const kr_vec3 com = random_vec(1);
        double j[9];
        made.axes = random_quat();
        for (int i = 0; i < 9; i++)
            j[i] = i / 3 <= i % 3 ? inertia_as_described(&made, i / 3, i % 3) : 0.0;
        j[3] = j[1], j[6] = j[2], j[7] = j[5];
        IS(kr_body_from_tensor(2.0, j, com, 0.0, &found) == KR_OK);
        for (int i = 0; i < 9; i++)
            NEAR(inertia_as_described(&found, i / 3, i % 3) / scale, j[i] / scale, 3e-15);
        NEAR(off(q_turn(found.axes, found.com), com), 0.0, 2e-15);
        /* The nearest axes need a rotation of at most 62.8 degrees, and of at most 54.8 degrees
         * if they can be rotated about an axis of symmetry. */
        IS(found.axes.w >= (equal % 2 == 0 ? 0.853 : 0.888));
    }
}
/* With the tolerance 0, the kind of a body depends on the last bits of its numbers. */
static void test_exact_kinds(void)
{
    kr_body b;
    IS(kr_body_symmetric(2.0, 2.0, 1.0, 0.5, &b) == KR_OK &&
       kr_body_kind(&b, 0.0) == KR_KIND_LAGRANGE);
    b.com = v3(0.5, 0.0, 0.0);
    IS(kr_body_kind(&b, 0.0) == KR_KIND_KOWALEWSKI);
}
static void test_bodies(void)
{
    const double diagonal[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1.5};
    double tensor[9] = {0.234375, 0, 0, 0, 0.46875, 0, 0, 0, 0.234375};
    /* size, mass over pi for the density 1; moments across and along the axis for the mass 1 */
    const double solids[][6] = {{1, 1, 2, 16.0 / 3.14159265358979323846, 5.0 / 3.0, 2.0 / 3.0},
                                {5, 5, 5, 500.0 / 3.0, 10.0, 10.0},
                                {3, 5, 6, 96.0, 11.5, 17.0},
                                {3, 0, 0, 0.0, 6.0, 6.0},
                                {2, 4, 0, 16.0 / 3.0, 10.2, 1.2}};
    kr_body b;
    for (int i = 0; i < 5; i++) {
        const double *one = solids[i];
        const kr_vec3 size = v3(one[0], one[1], one[2]), moments = v3(one[4], one[4], one[5]);
        IS(kr_body_shape((kr_shape)i, size, 1.0, v3(0, 0, 0), &b) == KR_OK);
        NEAR(off(b.inertia, moments), 0.0, 1e-14);
        NEAR(kr_shape_mass((kr_shape)i, size, 1.0), 3.14159265358979323846 * one[3], 1e-12);
    }
    IS(kr_body_shape(KR_SHAPE_TUBE, v3(6, 5, 1), 1.0, v3(0, 0, 0), &b) == KR_ERR_ARGUMENT &&
       kr_body_shape((kr_shape)5, v3(1, 1, 1), 1.0, v3(0, 0, 0), &b) == KR_ERR_ARGUMENT);
    IS(kr_body_shape(KR_SHAPE_CUBOID, v3(0.8, 0.8, 1.0), 1.0, v3(0, 0, -1.0), &b) == KR_OK);
    IS(b.com.z == 1.0 && b.axes.w == 1.0 && kr_body_kind(&b, 1e-12) == KR_KIND_LAGRANGE);
    IS(kr_body_shape(KR_SHAPE_CUBOID, v3(sqrt(3.0), 1.0, 0.5), 1.0, v3(0, 0, -0.5), &b) == KR_OK &&
       kr_body_kind(&b, 1e-12) == KR_KIND_KOWALEWSKI);
    IS(kr_body_shape(KR_SHAPE_CUBOID, v3(sqrt(7.0), 1.0, 0.5), 1.0, v3(0, 0, -0.5), &b) == KR_OK &&
       kr_body_kind(&b, 1e-12) == KR_KIND_GORYACHEV_CHAPLYGIN);
    IS(kr_body_shape(KR_SHAPE_CUBOID, v3(0.6, 0.8, 1.0), 1.0, v3(0.1, -0.2, -1.0), &b) == KR_OK &&
       kr_body_kind(&b, 1e-12) == KR_KIND_GENERAL);
    NEAR(inertia_as_described(&b, 0, 1), b.mass * 0.1 * 0.2, 1e-14);
    NEAR(inertia_as_described(&b, 1, 2), -b.mass * 0.2 * 1.0, 1e-14);
    kr_inertia_add_point(tensor, 15.0, v3(0, 1, 0)); /* it was about the centre of mass */
    IS(kr_body_from_tensor(15.0, tensor, v3(0, 1, 0), 0.0, &b) == KR_OK);
    IS(b.inertia.x == 15.234375 && b.inertia.y == 0.46875 && b.axes.w == 1.0 &&
       kr_body_kind(&b, 1e-12) == KR_KIND_LAGRANGE);
    NEAR(off(kr_body_working(&b).com, v3(0, 0, 1)), 0.0, 0.0);
    IS(kr_body_from_tensor(1.0, diagonal, v3(0.3, 0, 0), 0.0, &b) == KR_OK &&
       kr_body_kind(&b, 1e-12) == KR_KIND_GENERAL);
    IS(kr_body_symmetric(1.0, 1.0, 1.0, 0.0, &b) == KR_OK &&
       kr_body_kind(&b, 1e-12) == KR_KIND_EULER);
    b.com = v3(0.3, -0.4, 1.2);
    IS(kr_body_kind(&b, 1e-12) == KR_KIND_LAGRANGE);
    NEAR(off(kr_body_working(&b).com, v3(0, 0, 1.3)), 0.0, 1e-15);
}
/* Starts given by Euler angles, spin, and velocities agree with the quantities of the state. */
static void test_starts(void)
{
    kr_scene s = kr_scene_default();
    double out[3], rate, least;
    const kr_vec3 angles = v3(0.3, 1.2, -0.7), rates = v3(0.4, -0.5, 6.0), wish = v3(1, 2, 3);
    s.turning = v3(0.1, 0.2, 0.3);
    kr_scene_set_euler(&s, angles, rates);
    kr_quantity_values(kr_quantity_find("precession_angle"), &s, 1, &s.start, out);
    NEAR(out[0], angles.x, 1e-15);
    kr_quantity_values(kr_quantity_find("nutation"), &s, 1, &s.start, out);
    NEAR(out[0], angles.y, 1e-15);
    kr_quantity_values(kr_quantity_find("spin"), &s, 1, &s.start, out);
    NEAR(out[0], rates.z + rates.x * cos(angles.y), 1e-14);
    kr_scene_set_velocity(&s, wish);
    kr_quantity_values(kr_quantity_find("velocity"), &s, 1, &s.start, out);
    NEAR(off(v_of(out), wish), 0.0, 1e-14);
    kr_scene_set_body_velocity(&s, wish);
    kr_quantity_values(kr_quantity_find("body_velocity"), &s, 1, &s.start, out);
    NEAR(off(v_of(out), wish), 0.0, 1e-14);
    kr_scene_set_body_momentum(&s, wish);
    NEAR(off(q_turn_back(s.start.q, s.start.m), wish), 0.0, 1e-14);
    /* In a steady precession, the rate of the momentum is its precession. */
    s.turning = v3(0, 0, 0);
    for (int fast = 0; fast < 2; fast++) {
        IS(kr_scene_steady_precession(&s, 20.0, 1.0, fast, &rate, &least) == KR_OK);
        IS(kr_scene_set_spinning(&s, 20.0, 1.0, rate) == KR_OK);
        kr_quantity_values(kr_quantity_find("torque"), &s, 1, &s.start, out);
        NEAR(off(v_of(out), v_cross(v3(0, 0, rate), s.start.m)), 0.0, 1e-12);
    }
    IS(kr_scene_steady_precession(&s, 0.1, 1.0, 0, &rate, &least) == KR_ERR_ARGUMENT);
    IS(kr_scene_steady_precession(&s, least * (1 + 1e-9), 1.0, 0, &rate, &least) == KR_OK);
    IS(kr_scene_set_spinning(&s, 1.0, 4.0, 0.0) == KR_ERR_ARGUMENT);
    s.body.inertia.x *= 1.1;
    IS(kr_scene_set_spinning(&s, 1.0, 1.0, 0.0) == KR_ERR_ARGUMENT);
}
/* The moments of inertia of a water molecule, given to three digits, violate the triangle
 * inequality by 0.002. */
static void test_rounded_moments(void)
{
    const double water[9] = {0.345, 0, 0, 0, 0.653, 0, 0, 0, 1.0};
    const double slack[] = {0.0021, 0.0020, 0.0, -0.1, 1.0, NAN};
    const kr_status expected[] = {KR_OK,           KR_ERR_BODY,     KR_ERR_BODY,
                                  KR_ERR_ARGUMENT, KR_ERR_ARGUMENT, KR_ERR_ARGUMENT};
    kr_body b;
    for (int i = 0; i < 6; i++)
        IS(kr_body_from_tensor(1.0, water, v3(0, 0, 0), slack[i], &b) == expected[i]);
    IS(kr_body_from_tensor(1.0, water, v3(0, 0, 0), 0.0, &b) == KR_ERR_BODY);
    IS(kr_body_from_tensor(1.0, water, v3(0, 0, 0), 0.0021, &b) == KR_OK);
    IS(b.inertia.x == 0.345 && b.inertia.y == 0.653 && b.inertia.z == 1.0 && b.rounded == 0.0021);
    const kr_scene scene = {.body = b, .start = {0.0, {1, 0, 0, 0}, {1, 2, 3}}};
    kr_scene strict = scene;
    strict.body.rounded = 0.0;
    kr_top *top = NULL;
    IS(kr_top_create(&strict, kr_method_find("taylor"), (kr_config){0}, &top) == KR_ERR_BODY);
    IS(kr_top_create(&scene, kr_method_find("taylor"), (kr_config){0}, &top) == KR_OK);
    IS(kr_top_advance(top, 10.0) == KR_OK);
    const kr_state there = kr_top_state(top);
    NEAR(kr_state_kinetic(&scene, &there), kr_state_kinetic(&scene, &scene.start), 1e-13);
    kr_top_free(top);
}
/* Damping that differs between the axes keeps the principal axes of a sphere. Equal damping lets
 * the third axis point to the centre of mass. */
static void test_working_axes_of_damped_spheres(void)
{
    const kr_vec3 com = {0.3, -0.4, 0.5}, none = {0.0, 0.0, 0.0};
    const kr_body sphere = {1.0, {2.0, 2.0, 2.0}, com, {1, 0, 0, 0}, 0, .rotor = none};
    const kr_vec3 damping[3] = {{0.1, 0.1, 0.1}, {0.1, 0.1, 0.2}, {0.1, 0.2, 0.2}};
    for (int i = 0; i < 3; i++) {
        const kr_working w = kr_body_working_damped(&sphere, damping[i]);
        const kr_vec3 own = i ? com : v3(0.0, 0.0, v_length(com));
        NEAR(off(w.com, own), 0.0, 1e-15);
        NEAR(off(q_turn(w.axes, w.com), com), 0.0, 1e-15);
        NEAR(off(w.damping, damping[i]), 0.0, 0.0);
    }
}
/* A point mass on a massless rod is an extreme case of a physical body. */
static void test_body_can_be(void)
{
    const double utmost = 2.0 * 9.0;
    for (int k = -100; k <= 100; k += 50) {
        const double mass = ldexp(2.0, 3 * k), size = ldexp(1.0, k);
        for (int i = 0; i < 2; i++) {
            const double moment = (i ? 0.99 : 1.0) * utmost * ldexp(1.0, 5 * k);
            const kr_body b = {mass,
                               {moment, moment, 1e-9 * moment},
                               {0, 0, 3.0 * size},
                               {1, 0, 0, 0},
                               0.0,
                               .rotor = {0, 0, 0}};
            IS(kr_body_is_physical(&b) == (i == 0));
        }
    }
    const kr_body plate = {1.0, {1.0, 2.0, 3.0},   {0.5, 0.5, 0.0}, {1, 0, 0, 0},
                           0.0, .rotor = {0, 0, 0}};
    kr_body beside = plate;
    beside.com.z = 0.01;
    IS(kr_body_is_physical(&plate) && !kr_body_is_physical(&beside));
}

int main(void)
{
    test_trigonometry();
    test_quaternions();
    test_tensors();
    test_bodies();
    test_starts();
    test_exact_kinds();
    test_rounded_moments();
    test_body_can_be();
    test_working_axes_of_damped_spheres();
    return check_result();
}
