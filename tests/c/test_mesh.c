/* Pictures of a top for the viewer: the equivalent cuboid, the trace of the apex, the rod. */
#include "viewer/mesh.h"
#include "viewer/simulation.h"
#include "tops.h"

static kr_simulation stage;
static float point[KR_MESH_RINGS * KR_MESH_SIDES][3];

static kr_vec3 at(int i) { return v3(point[i][0], point[i][1], point[i][2]); }
static kr_body cuboid(double density, kr_vec3 half, kr_vec3 pivot)
{
    kr_body body = {0};
    const double mass = kr_shape_mass(KR_SHAPE_CUBOID, half, density);
    IS(kr_body_shape(KR_SHAPE_CUBOID, half, mass, pivot, &body) == KR_OK);
    return body;
}
/* Returns the inertia tensor at the fixed point, in the frame of description, applied to a
 * vector. */
static kr_vec3 inertia(const kr_body *b, kr_vec3 v)
{
    return q_turn(b->axes, v_times(b->inertia, q_turn_back(b->axes, v)));
}

/* The cuboid from which a body was made is found, for any fixed point and orientation. */
static void test_box_of_a_cuboid(void)
{
    const kr_vec3 half = v3(0.7, 0.5, 1.1), pivot = v3(0.3, -0.2, -1.4);
    const kr_quat turn = q_unit(q4(0.9, v3(0.1, -0.3, 0.2)));
    const kr_body plain = cuboid(1.7, half, pivot);
    double j[9];
    for (int i = 0; i < 3; i++) {
        const kr_vec3 e = v3(i == 0, i == 1, i == 2),
                      column = q_turn(turn, inertia(&plain, q_turn_back(turn, e)));
        j[i] = column.x, j[3 + i] = column.y, j[6 + i] = column.z;
    }
    kr_body body;
    IS(kr_body_from_tensor(plain.mass, j, q_turn(turn, v_scale(-1.0, pivot)), 0.0, &body) == KR_OK);
    const kr_box box = kr_mesh_box(&body);
    NEAR(box.density, 1.7, 1e-12);
    NEAR(off(box.centre, q_turn(turn, v_scale(-1.0, pivot))), 0.0, 1e-12);
    /* the edges may be permuted, but the corners are the same */
    for (int corner = 0; corner < 8; corner++) {
        const kr_vec3 sign = v3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
        const kr_vec3 seen = q_turn_back(turn, q_turn(box.turn, v_times(sign, box.half)));
        NEAR(off(v3(fabs(seen.x), fabs(seen.y), fabs(seen.z)), half), 0.0, 1e-12);
    }
}
/* The thesis gives the inertia of a cuboid with density 1, but the mass 1. The cuboid is found
 * nevertheless. */
static void test_box_of_density_one(void)
{
    kr_body body = cuboid(1.0, v3(0.8, 0.8, 1.0), v3(0.0, 0.0, -1.0));
    body.com = v_scale(body.mass, body.com);
    body.mass = 1.0;
    const kr_box box = kr_mesh_box(&body);
    NEAR(box.density, 1.0, 1e-12);
    NEAR(off(box.half, v3(0.8, 0.8, 1.0)), 0.0, 1e-12);
    NEAR(off(box.centre, v3(0.0, 0.0, 1.0)), 0.0, 1e-12);
}
/* No body of this mass has its centre of mass so far away. The cuboid is that of another body with
 * the same motion, in any units. */
static void test_box_of_numbers_that_fit_no_body(void)
{
    kr_body body, small;
    IS(kr_body_symmetric(1.0, 1.0, 0.9, 2.0, &body) == KR_OK &&
       kr_body_symmetric(1.0, 1e-8, 0.9e-8, 2e-4, &small) == KR_OK);
    const kr_box box = kr_mesh_box(&body), little = kr_mesh_box(&small);
    const kr_body drawn =
        cuboid(box.density, box.half, v_scale(-1.0, q_turn_back(box.turn, box.centre)));
    NEAR(off(v_scale(drawn.mass, q_turn(drawn.axes, drawn.com)), v3(0.0, 0.0, 2.0)), 0.0, 1e-12);
    NEAR(off(drawn.inertia, body.inertia), 0.0, 1e-12);
    NEAR(off(v_scale(1e4, little.half), box.half), 0.0, 1e-7);
    IS(box.half.x == box.half.y && box.half.z > 0.2 * box.half.x);
}
/* A body too small for its distance from the fixed point has no cuboid of the same mass. */
static void test_box_of_a_small_ball_far_away(void)
{
    const kr_body ball = {1.0,
                          {1.0 + 1e-9, 1.0 + 1e-9, 1e-9},
                          {0.0, 0.0, 1.0},
                          {1.0, 0.0, 0.0, 0.0},
                          0.0,
                          .rotor = {0, 0, 0}};
    const kr_box box = kr_mesh_box(&ball);
    NEAR(8.0 * box.half.x * box.half.y * box.half.z * box.density * box.centre.z, 1.0, 1e-9);
}
static void test_box_of_a_plate_and_of_none(void)
{
    const kr_body plate = cuboid(1.0, v3(1.0, 0.5, 1e-3), v3(0.0, 0.0, 0.0));
    const kr_body flat = {1.0, {1.0, 2.0, 3.0},   {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0},
                          0.0, .rotor = {0, 0, 0}};
    const kr_body mass_point = {1.0, {1.0, 1.0, 0.0},   {0.0, 0.0, 1.0}, {1.0, 0.0, 0.0, 0.0},
                                0.0, .rotor = {0, 0, 0}};
    NEAR(off(kr_mesh_box(&plate).half, v3(1.0, 0.5, 1e-3)), 0.0, 1e-9);
    NEAR(off(kr_mesh_box(&flat).half, v3(sqrt(6.0), sqrt(3.0), sqrt(6.0) * 1e-4)), 0.0, 1e-9);
    const kr_box none = kr_mesh_box(&mass_point);
    NEAR(off(none.half, v3(1.0, 1.0, 1.0)), 0.0, 0.0);
    IS(none.turn.w == 1.0 && v_length(q_vec(none.turn)) == 0.0 && v_length(none.centre) == 0.0);
    IS(none.density == 1.0);
}

static const kr_simulation_slot *top(kr_scene scene, int64_t step, int64_t target)
{
    kr_simulation_clear(&stage);
    IS(kr_simulation_add(&stage, &scene, kr_method_find("strang"), step, 0.0, -1) == KR_OK);
    kr_simulation_advance(&stage, target, INT64_MAX);
    return &stage.slots[0];
}
/* The scale of the arrows is the bound that the energy gives. The motion comes near this bound but
 * never exceeds it. */
static void test_reach(void)
{
    double momentum, velocity, longest = 0.0;
    const kr_simulation_slot *actor = top(kr_scene_default(), 10000, 0);
    kr_mesh_limits(&actor->scene, &momentum, &velocity);
    for (int i = 1; i <= 5000; i++) {
        kr_simulation_advance(&stage, 10000 * i, INT64_MAX);
        longest = fmax(longest, v_length(actor->now.m));
    }
    IS(longest <= momentum && longest > 0.5 * momentum && velocity > 0.0);
    kr_scene still = kr_scene_default();
    still.gravity = 0.0;
    still.start.m = v3(0.0, 0.0, 0.0);
    kr_mesh_limits(&still, &momentum, &velocity);
    IS(momentum == 1.0 && velocity == 1.0);
    still.body.rotor = still.start.m = v3(0.0, 0.0, 3.0);
    kr_mesh_limits(&still, &momentum, &velocity);
    IS(momentum == 3.0 && velocity == 1.0);
    still.turning = v3(0.0, 2.0, 0.0);
    kr_mesh_limits(&still, &momentum, &velocity);
    IS(momentum == 3.0 && velocity == 2.0); /* seen from the support, the body turns backwards */
}
/* Asserts that a motion never exceeds the limits, and that its largest angular velocity is more
 * than the fraction `near` of the limit. */
static void reaches(kr_scene scene, double near)
{
    double momentum, velocity, longest = 0.0, fastest = 0.0;
    kr_simulation_clear(&stage);
    IS(kr_simulation_add(&stage, &scene, kr_method_find("taylor"), 50000, 1e-12, -1) == KR_OK);
    kr_mesh_limits(&scene, &momentum, &velocity);
    const kr_simulation_slot *actor = &stage.slots[0];
    for (int i = 0; i <= 2000; i++) {
        kr_simulation_advance(&stage, 50000 * i, INT64_MAX);
        longest = fmax(longest, v_length(actor->now.m));
        fastest = fmax(fastest, v_length(kr_state_velocity(&scene, &actor->now)));
    }
    IS(actor->status == KR_OK && actor->steps == 2000);
    IS(longest <= momentum * (1.0 + 1e-9) && fastest <= velocity * (1.0 + 1e-9));
    IS(fastest > near * velocity);
}
/* The limits hold for every body and support, and are not far above the largest values. A body that
 * turns mainly about the axis of its smallest moment is faster than one of the same energy that
 * turns about another axis; a symmetric top keeps its spin; damping and friction only slow it down;
 * a turning support carries the top along. */
static void test_limits(void)
{
    const kr_scene plain = kr_scene_default();
    const kr_body flat = cuboid(1.0, v3(0.8 * sqrt(3.0), 0.8, 0.4), v3(0.0, 0.0, -0.4));
    kr_body turned = plain.body, long_axis = plain.body, free = plain.body;
    turned.axes = q_exp(v3(0.3, -0.2, 0.5));
    long_axis.inertia = v3(plain.body.inertia.z, plain.body.inertia.x, plain.body.inertia.x);
    long_axis.com = v3(-plain.body.com.z, 0.0, 0.0);
    free.inertia = v3(1.0, 10.0, 10.5), free.com = v3(0.0, 0.0, 0.0);
    const struct {
        kr_body body;
        kr_vec3 rotor, damping, turning;
        double friction, near;
    } tops[] = {
        {.body = plain.body, .near = 0.98},
        {.body = turned, .near = 0.98},
        {.body = turned, .rotor = {0.0, 0.0, -1.0}, .near = 0.7},
        {plain.body, {0.0, 0.0, -1.0}, {0.1, 0.3, 0.2}, {0.0, 0.0, 0.0}, 0.1, 0.7},
        {.body = long_axis, .near = 0.7},
        {.body = free, .near = 0.37},
        {.body = free, .rotor = {1.0, -0.5, 0.2}, .near = 0.37},
        {.body = flat, .near = 0.8},
        {.body = flat, .damping = {0.1, 0.2, 0.05}, .near = 0.5},
        {.body = plain.body, .turning = {0.0, 0.0, 0.7}, .near = 0.7},
        {.body = plain.body, .turning = {0.9, -0.6, 0.7}, .near = 0.3},
        {.body = plain.body, .rotor = {1.0, 2.0, -1.0}, .turning = {0.0, -0.9, 0.7}, .near = 0.2},
        {.body = plain.body, .damping = {3.0, 3.0, 3.0}, .turning = {0.0, 0.0, 20.0}, .near = 0.2},
    };
    for (size_t i = 0; i < sizeof tops / sizeof *tops; i++) {
        kr_scene scene = plain;
        scene.body = tops[i].body;
        scene.body.rotor = tops[i].rotor;
        scene.damping = tops[i].damping;
        scene.turning = tops[i].turning;
        scene.friction = tops[i].friction;
        scene.start.q = q_mul(plain.start.q, q_conj(scene.body.axes));
        if (v_length(scene.body.com) == 0.0) scene.start.m = v3(1e-4, 10.0, 0.0);
        reaches(scene, tops[i].near);
    }
}
/* A shaken support has no limits, but the estimates allow for its greatest acceleration. */
static void test_limits_on_a_shaken_support(void)
{
    kr_scene scene = kr_scene_default(), shaken = scene;
    double momentum, velocity, more_momentum, more_velocity;
    shaken.shaking = (kr_shaking){-0.3, 2.0, 0.5};
    scene.gravity = 1.0 + 0.3 * 4.0;
    kr_mesh_limits(&scene, &momentum, &velocity);
    kr_mesh_limits(&shaken, &more_momentum, &more_velocity);
    NEAR(more_momentum, momentum, 1e-12 * momentum);
    NEAR(more_velocity, velocity, 1e-12 * velocity);
}
static kr_trail trail_of(const kr_simulation_slot *a)
{
    const kr_trail trail = {a->attitudes, a->momenta, KR_SIMULATION_TRACE, a->steps,
                            (double)a->step / KR_SIMULATION_TICKS};
    return trail;
}
static int way(const kr_simulation_slot *a, double radius)
{
    const kr_trail trail = trail_of(a);
    return kr_mesh_trail(&a->scene.body, &trail, radius, point);
}
static int rod(const kr_simulation_slot *a, double scale, double radius)
{
    const kr_trail trail = trail_of(a);
    return kr_mesh_rod(&a->scene.body, &trail, scale, radius, 0.5, point);
}
static void test_way(void)
{
    const kr_simulation_slot *actor = top(kr_scene_default(), 10000, 0);
    IS(way(actor, 2.0) == 1);
    NEAR(off(at(0), v3(0.0, 0.0, 2.0)), 0.0, 1e-6);
    actor = top(kr_scene_default(), 10000, 1000000);
    IS(way(actor, 2.0) == 101);
    NEAR(off(v_scale(0.5, at(0)), kr_state_apex(&actor->scene, &actor->now)), 0.0, 1e-6);
    NEAR(off(v_scale(0.5 / (1.0 - 2.0 / KR_MESH_POINTS), at(100)), v3(0.0, 0.0, 1.0)), 0.0, 1e-6);
    /* the ring buffer has wrapped around: every other step, newest first */
    actor = top(kr_scene_default(), 10000, 100000000);
    IS(way(actor, 1.0) == KR_MESH_POINTS);
    NEAR(off(at(0), kr_state_apex(&actor->scene, &actor->now)), 0.0, 1e-6);
    NEAR(v_length(at(KR_MESH_POINTS - 1)), 0.98 + 0.02 / KR_MESH_POINTS, 1e-6);
}
/* The tip of the momentum moves level, at the rate of the torque. */
static void test_momentum_way(void)
{
    const kr_simulation_slot *actor = top(kr_scene_default(), 10000, 1000000);
    const kr_trail trail = trail_of(actor);
    const kr_body body = actor->scene.body;
    IS(kr_mesh_momentum_trail(&trail, 2.0, point) == 101);
    NEAR(off(v_scale(0.5, at(0)), actor->now.m), 0.0, 1e-6);
    NEAR(off(v_scale(0.5, at(100)), actor->scene.start.m), 0.0, 1e-6);
    const kr_vec3 lever = q_turn(actor->attitudes[99], body.com),
                  weight = v3(0.0, 0.0, -body.mass * actor->scene.gravity),
                  change = v_scale(0.5 / (2.0 * 0.01), v_sub(at(0), at(2)));
    NEAR(off(change, v_cross(lever, weight)), 0.0, 1e-3);
    NEAR(change.z, 0.0, 1e-4);
}
/* A trail may hold more points than are drawn, or may have lost its beginning. */
static void test_trails(void)
{
    enum { LONG = 5 * KR_MESH_POINTS };
    static kr_quat attitude[LONG];
    static kr_vec3 momentum[LONG];
    const kr_body body = kr_scene_default().body;
    for (int k = 0; k < LONG; k++) attitude[k] = q_exp(v3(0.0, 0.0, 0.001 * k));
    for (int k = 0; k < LONG; k++) momentum[k] = v3(k, 2.0, -1.0);
    const kr_trail all = {attitude, momentum, LONG, LONG - 1, 0.01},
                   last = {attitude, momentum, 3, 100, 0.1};
    IS(kr_mesh_momentum_trail(&all, 0.5, point) == KR_MESH_POINTS);
    NEAR(off(at(1), v3(0.5 * (LONG - 3), 1.0, -0.5)), 0.0, 1e-3); /* every other step */
    IS(kr_mesh_momentum_trail(&last, 1.0, point) == 3);
    NEAR(off(at(0), v3(100 % 3, 2.0, -1.0)), 0.0, 0.0);
    IS(kr_mesh_trail(&body, &all, 1.0, point) == KR_MESH_POINTS);
    IS(kr_mesh_rod(&body, &last, 1.0, 0.1, 0.5, point) == 3);
    IS(kr_mesh_trail(&body, &last, 1.0, point) == 3);
}

static kr_vec3 centre(int ring)
{
    kr_vec3 sum = v3(0.0, 0.0, 0.0);
    for (int s = 0; s < KR_MESH_SIDES; s++) sum = v_add(sum, at(ring * KR_MESH_SIDES + s));
    return v_scale(1.0 / KR_MESH_SIDES, sum);
}
/* The vector between adjacent rings is the apex times the time between them and the scale. */
static void test_rod(void)
{
    const kr_simulation_slot *actor = top(kr_scene_default(), 10000, 3000000);
    const int n = rod(actor, 0.8, 0.1);
    IS(n == 61); /* every fifth step, 0.05 apart */
    NEAR(off(centre(0), v3(0.0, 0.0, 0.0)), 0.0, 1e-6);
    for (int ring = 0; ring + 1 < n; ring++) {
        kr_state then = actor->now;
        then.q = actor->attitudes[300 - 5 * ring];
        const kr_vec3 step = v_sub(centre(ring), centre(ring + 1));
        NEAR(off(step, v_scale(0.8 * 0.05, kr_state_apex(&actor->scene, &then))), 0.0, 1e-6);
    }
    IS(rod(top(kr_scene_default(), 10000, 100000000), 1.0, 0.1) == KR_MESH_RINGS);
    IS(rod(top(kr_scene_default(), 400000, 4000000), 1.0, 0.1) == 11);
    IS(rod(top(kr_scene_default(), 1, 100), 1.0, 0.1) == 1);
}
/* The section is round for a body that is symmetric about its axis. For a Kowalewski top the
 * stiffnesses have the ratio 2 : 1, and the sides sqrt(2) : 1. */
static void test_section(void)
{
    kr_scene scene = kr_scene_default();
    rod(top(scene, 10000, 0), 1.0, 0.1);
    NEAR(off(at(0), v3(0.1, 0.0, 0.0)), 0.0, 1e-6);
    NEAR(off(at(KR_MESH_SIDES / 4), v3(0.0, 0.1, 0.0)), 0.0, 1e-6);
    scene.body = cuboid(1.0, v3(0.8 * sqrt(3.0), 0.8, 0.4), v3(0.0, 0.0, -0.4));
    IS(kr_body_kind(&scene.body, 1e-12) == KR_KIND_KOWALEWSKI);
    rod(top(scene, 10000, 0), 1.0, 0.1);
    NEAR(off(at(0), v3(0.1, 0.0, 0.0)), 0.0, 1e-6);
    NEAR(off(at(KR_MESH_SIDES / 4), v3(0.0, 0.1 * sqrt(0.5), 0.0)), 0.0, 1e-6);
}

int main(void)
{
    test_box_of_a_cuboid();
    test_box_of_density_one();
    test_box_of_numbers_that_fit_no_body();
    test_box_of_a_plate_and_of_none();
    test_box_of_a_small_ball_far_away();
    test_reach();
    test_limits();
    test_limits_on_a_shaken_support();
    test_way();
    test_momentum_way();
    test_trails();
    test_rod();
    test_section();
    kr_simulation_clear(&stage);
    return check_result();
}
