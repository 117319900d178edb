/* Scenes: see scenes.h. */
#include "scenes.h"
#include <math.h>
#include "random_values.h"
#include "math/su2.h"

static kr_body known_kind(void)
{
    static const double ratio[6][3] = {{1, 1, 2}, {2, 2, 1}, {4, 4, 1},
                                       {1, 1, 1}, {2, 1, 1}, {1, 1, 1e-3}};
    const double *i = ratio[choose(6)], size = spread(0.1, 10.0), lever = between(-2.0, 2.0);
    const kr_vec3 axis = odds(50) ? v3(0, 0, 1) : odds(50) ? v3(1, 0, 0) : vector_between(-1, 1);
    const kr_body body = {spread(0.1, 10.0),
                          v3(size * i[0], size * i[1], size * i[2]),
                          v_scale(odds(30) ? 0.0 : lever, axis),
                          q_one(),
                          0.0,
                          .rotor = {0, 0, 0}};
    return body;
}
static kr_body any_three_moments(void)
{
    const double a = spread(1e-6, 3.0), b = spread(0.1, 3.0), c = spread(0.1, 3.0);
    const double flat = odds(10) ? 0.0 : a;
    const kr_body body = {spread(0.1, 10.0),
                          v3(b + c, c + flat, flat + b),
                          vector_between(-1, 1),
                          any_attitude(),
                          0.0,
                          .rotor = {0, 0, 0}};
    return body;
}
/* Changes moments and centre of mass slightly, sometimes only by rounding errors. */
static void move_a_little(kr_body *body)
{
    const double by = either_sign(spread(1e-17, 1e-5));
    if (choose(2)) body->inertia.x *= 1.0 + by;
    if (choose(2)) body->com.x += by;
}
/* Adds a rotor of random momentum to a body. The axis of the rotor is the first or the third
 * principal axis, the direction of the centre of mass, or random. */
static void add_rotor(kr_body *body)
{
    const double size = v_largest(body->inertia) * (odds(80) ? 1.0 : spread(1e-9, 1e3));
    const kr_vec3 any = v_scale(size, vector_between(-1, 1));
    switch (choose(5)) {
    case 0:
        body->rotor = v3(0, 0, any.z);
        break;
    case 1:
        body->rotor = v3(any.x, 0, 0);
        break;
    case 2:
        body->rotor = v_scale(either_sign(size), body->com);
        break;
    default:
        kr_body_set_rotor(body, any);
        break;
    }
}
static kr_body any_body(void)
{
    kr_body body = odds(50) ? known_kind() : any_three_moments();
    if (odds(30)) move_a_little(&body);
    if (odds(10)) {
        body.rounded = spread(1e-6, 0.5);
        if (odds(50)) body.inertia.x = (body.inertia.y + body.inertia.z) * (1.0 + body.rounded);
    }
    if (odds(25)) add_rotor(&body);
    return body;
}

static kr_vec3 any_momentum(const kr_scene *scene)
{
    const kr_vec3 axis = v3(choose(2) ? 1.0 : 0.0, choose(2) ? 1.0 : 0.0, 1.0);
    const double size = spread(1e-3, 1e2);
    switch (choose(6)) {
    case 0:
        return v3(0, 0, 0);
    case 1:
        return v_scale(either_sign(size), q_turn(scene->start.q, axis));
    case 2:
        return v3(0, 0, either_sign(size));
    case 3:
        return v_scale(spread(1e-170, 1e-6), vector_between(-1, 1));
    default:
        return v_scale(odds(20) ? size : 3.0, vector_between(-1, 1));
    }
}
kr_vec3 any_damping(const kr_scene *scene)
{
    const double most = odds(20) ? 1e9 : 30.0, moment = v_largest(scene->body.inertia);
    double along[3];
    for (int i = 0; i < 3; i++) along[i] = odds(70) ? moment * spread(1e-8, most) : 0.0;
    if (odds(15)) along[1] = along[2] = along[0];
    return v_of(along);
}
/* Lets the support of a scene turn or shake, or gives the top dry friction. */
static void add_support(kr_scene *scene)
{
    const double moment = v_largest(scene->body.inertia);
    if (odds(50))
        scene->turning = v_scale(odds(80) ? 1.0 : spread(1e-9, 30.0), vector_between(-1, 1));
    if (odds(30)) scene->turning.x = scene->turning.y = 0.0;
    if (odds(50)) {
        const kr_shaking shaking = {either_sign(spread(1e-6, 1.0)), spread(0.1, 30.0),
                                    between(-9.0, 9.0)};
        scene->shaking = shaking;
    }
    if (odds(40)) scene->friction = moment * spread(1e-6, 3.0);
    if (odds(20)) {
        scene->gradient = either_sign(spread(1e-3, 10.0));
        scene->shaking.amplitude = 0.0;
    }
}
static double any_beginning(void)
{
    return odds(60) ? 0.0 : odds(70) ? between(-9.0, 9.0) : either_sign(spread(1e3, 1e18));
}
/* Converts a scene to other units of mass, length and time. */
static void change_units(kr_scene *scene)
{
    const double mass = spread(1e-40, 1e40), length = spread(1e-30, 1e30),
                 time = spread(1e-30, 1e30), moment = mass * length * length;
    scene->body.mass *= mass;
    scene->body.inertia = v_scale(moment, scene->body.inertia);
    scene->body.com = v_scale(length, scene->body.com);
    scene->body.rotor = v_scale(moment / time, scene->body.rotor);
    scene->gravity *= length / time / time;
    scene->start.m = v_scale(moment / time, scene->start.m);
    scene->damping = v_scale(moment / time, scene->damping);
    scene->turning = v_scale(1.0 / time, scene->turning);
    scene->shaking.amplitude *= length;
    scene->shaking.rate /= time;
    scene->friction *= moment / time / time;
    scene->gradient /= time * time;
    scene->start.t *= time;
}
/* Replaces one number of the scene by an arbitrary double. */
static void spoil(kr_scene *scene)
{
    double *const place[] = {
        &scene->body.mass,         &scene->body.inertia.x, &scene->body.inertia.z,
        &scene->body.com.x,        &scene->body.com.z,     &scene->body.axes.w,
        &scene->gravity,           &scene->start.t,        &scene->start.q.w,
        &scene->start.q.z,         &scene->start.m.x,      &scene->start.m.z,
        &scene->damping.x,         &scene->damping.z,      &scene->turning.x,
        &scene->friction,          &scene->shaking.rate,   &scene->shaking.phase,
        &scene->shaking.amplitude, &scene->body.rotor.x,   &scene->body.rotor.z};
    *place[choose(sizeof place / sizeof *place)] = any_double();
}
kr_scene any_scene(void)
{
    kr_scene scene = kr_scene_default();
    if (odds(90)) scene.body = any_body();
    scene.gravity = odds(60) ? 1.0 : odds(40) ? 0.0 : either_sign(spread(1e-3, 1e3));
    scene.start.q = any_attitude();
    scene.start.m = any_momentum(&scene);
    scene.start.t = any_beginning();
    if (odds(10)) scene.damping = any_damping(&scene);
    if (odds(10)) add_support(&scene);
    if (odds(15)) change_units(&scene);
    if (odds(12)) spoil(&scene);
    return scene;
}
double time_scale(const kr_scene *scene)
{
    const kr_body *body = &scene->body;
    const kr_vec3 A = body->inertia, D = scene->damping;
    const double moment = v_largest(A), drag = fmax(D.x / A.x, fmax(D.y / A.y, D.z / A.z)),
                 turning = (v_length(scene->start.m) + v_length(body->rotor)) / moment +
                           sqrt(fabs(scene->gravity) * body->mass / moment * v_length(body->com)),
                 moved = v_length(scene->turning) + scene->shaking.rate,
                 rate = turning + (isfinite(drag) ? drag : 0.0) + (isfinite(moved) ? moved : 0.0);
    return isfinite(1.0 / rate) && rate > 0.0 ? 1.0 / rate : 1.0;
}
