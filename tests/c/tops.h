/* Bodies, scenes and helpers that the C tests share: creation of a top, its state at a time,
 * distance of two states. */
#ifndef KR_TOPS_H
#define KR_TOPS_H
#include <string.h>
#include "check.h"
#include "model/quantities.h"
#include "random.h"

/* Returns the top of the thesis with a tilted start. At an upright start no torque acts, which
 * would hide errors. */
static inline kr_scene tilted(void)
{
    kr_scene s = kr_scene_default();
    s.start.q = q_exp(v3(0.6, -0.4, 0.3));
    return s;
}
/* Returns the body of the thesis, bitwise as used for the references of the report: mass and
 * gravity are 1. */
static inline kr_body thesis_body(void)
{
    const kr_body body = {1.0,
                          {0x1.facfcdc177bd9p+2, 0x1.facfcdc177bd9p+2, 0x1.179ec9cbd8220p+1},
                          {0.0, 0.0, 0x1.47ae147ae147cp+2},
                          {1, 0, 0, 0},
                          0,
                          .rotor = {0, 0, 0}};
    return body;
}
/* Returns the scene `asymmetric` of the report, bitwise as used for its references. */
static inline kr_scene asymmetric(void)
{
    const kr_scene s = {
        .body = {.mass = 1.0,
                 .inertia = {0x1.4d669d9224628p+0, 0x1.706d8fd9bbb39p+2, 0x1.87ff70b158e5fp+2},
                 .com = {-0x1.f77e3fdded5b4p+1, -0x1.44a20db1e5f57p-4, 0x1.fce417e16b363p-5},
                 .axes = {1, 0, 0, 0}},
        .gravity = 1.0,
        .start = {0.0,
                  {0x1.2acb3a9f5a815p-4, 0x1.76a377f2b3869p-1, -0x1.b151475e75147p-5,
                   -0x1.59ebd9ae039eep-1},
                  {0.172, -1.862, 1.46}}};
    return s;
}
/* Returns a body with three different moments, principal axes different from those of description,
 * and the centre of mass on none of them. */
static inline kr_body general_body(void)
{
    const double tensor[9] = {3.0, -0.25, 0.5, -0.25, 2.5, 0.125, 0.5, 0.125, 1.5};
    kr_body body = {0};
    IS(kr_body_from_tensor(2.0, tensor, v3(0.25, -0.5, 0.75), 0.0, &body) == KR_OK);
    return body;
}

/* Returns a tilted top to which the method applies. */
static inline kr_scene scene_for(const kr_method *method)
{
    kr_scene s = tilted();
    if (!kr_method_applies(method, &s.body)) s.body.com = v3(0, 0, 0); /* free */
    return s;
}
/* Returns a Lagrange top of mass 1 with |gravity| = 1. */
static inline kr_scene lagrange_top(double i1, double i3, double lever, kr_quat q, kr_vec3 m)
{
    const kr_scene s = {.body = {.mass = 1.0,
                                 .inertia = {i1, i1, i3},
                                 .com = {0.0, 0.0, fabs(lever)},
                                 .axes = {1, 0, 0, 0}},
                        .gravity = lever < 0.0 ? -1.0 : 1.0,
                        .start = {0.0, q, m}};
    return s;
}

/* Returns a scene with three different moments and the centre of mass off the axes. Every fourth
 * body is symmetric, two of five have a rotor, and every seventh is described in other axes than
 * its principal axes. */
static inline kr_scene random_scene(int i)
{
    kr_scene s = kr_scene_default();
    const kr_vec3 half = v3(uniform(0.2, 2.0), uniform(0.2, 2.0), uniform(0.2, 2.0));
    const double mass = kr_shape_mass(KR_SHAPE_CUBOID, half, 1.0);
    if (i % 4 != 3) kr_body_shape(KR_SHAPE_CUBOID, half, mass, random_vec(1.5), &s.body);
    if (i % 7 == 6) s.body.axes = random_quat();
    s.gravity = uniform(-2.0, 3.0);
    s.start.q = random_quat();
    s.start.m = v_scale(s.body.inertia.x, random_vec(1.5));
    if (i % 5 < 2) s.body.rotor = v_scale(i % 5 ? 0.1 : 1.0, s.start.m);
    return s;
}
/* Computes the closed form of a free body or Lagrange top, which lasts for 16 more calls. */
static inline kr_status plan_closed_form(const kr_scene *s, const kr_exact **out)
{
    static double memory[16][KR_EXACT_SIZE / sizeof(double)];
    static int calls;
    kr_exact *closed = (kr_exact *)(void *)memory[calls++ % 16];
    const int fits = kr_exact_size(s) <= sizeof memory[0];
    IS(fits);
    *out = closed;
    return fits ? kr_exact_plan(s, 0.0, closed) : KR_ERR_MEMORY;
}
static inline const kr_exact *closed_form(const kr_scene *s)
{
    const kr_exact *closed;
    IS(plan_closed_form(s, &closed) == KR_OK);
    return closed;
}
static inline kr_nutation limits_of_nutation(const kr_scene *s)
{
    kr_nutation turning = {0};
    IS(kr_exact_nutation(s, &turning) == KR_OK);
    return turning;
}
/* A poll that stops after a number of calls. */
static inline int stop_at(void *context) { return --*(int *)context < 0; }

static inline const kr_method *taylor(void) { return kr_method_find("taylor"); }
static inline kr_top *make(const kr_scene *s, const kr_method *method, kr_config config)
{
    kr_top *top = NULL;
    IS(kr_top_create(s, method, config, &top) == KR_OK && top);
    return top;
}
static inline kr_worker *make_worker(const kr_method *method, kr_config config)
{
    kr_worker *worker = NULL;
    IS(kr_worker_create(method, config, 0, NULL, &worker) == KR_OK && worker);
    return worker;
}
static inline kr_state state_at(double t, const kr_scene *s, const kr_method *method,
                                kr_config config)
{
    kr_top *top = make(s, method, config);
    IS(kr_top_advance(top, t) == KR_OK);
    const kr_state state = top ? kr_top_state(top) : s->start;
    kr_top_free(top);
    return state;
}

/* Returns 1 if two states are bitwise equal; a state has no padding. */
static inline int same(kr_state a, kr_state b) { return memcmp(&a, &b, sizeof a) == 0; }
/* Returns 1 if two outcomes are bitwise equal, except for the padding after the status. */
static inline int same_outcome(const kr_outcome *a, const kr_outcome *b)
{
    return a->status == b->status && a->done == b->done && same(a->last, b->last) &&
           memcmp(&a->stats, &b->stats, sizeof a->stats) == 0;
}
static inline double off(kr_vec3 a, kr_vec3 b) { return v_length(v_sub(a, b)); }
static inline double distance(kr_state a, kr_state b)
{
    return kr_attitude_error(a.q, b.q) + off(a.m, b.m);
}
#endif
