/* Bodies, scenes and times that are drawn, and how their results are told. A number is often a
 * simple one, alike to another, or none: what the library tells apart by equality is met. Nothing
 * that is drawn depends on the mathematical library. */
#ifndef KR_DRAWS_H
#define KR_DRAWS_H
#include <string.h>
#include "random.h"
#include "say.h"

static inline uint64_t draw(uint64_t n) { return random_bits() % n; }
static inline int chance(int percent) { return (int)draw(100) < percent; }
static inline double of_few(size_t n, const double x[]) { return x[draw(n)]; }
static inline double power_of_two(int most)
{
    return ldexp(1.0, (int)draw((uint64_t)(2 * most + 1)) - most);
}
static inline double simple(void)
{
    static const double few[10] = {0.0, 0.0, 0.0, 0.5, 1.0, 1.0, -1.0, -0.25, 2.0, -1.5};
    return chance(60) ? of_few(10, few) : uniform(-2.0, 2.0);
}
static inline kr_vec3 simple_vec(void)
{
    const double x = simple(), y = simple(), z = simple();
    return v3(x, y, z);
}
static inline kr_vec3 in_any_order(kr_vec3 v)
{
    const double x[3] = {v.x, v.y, v.z};
    const size_t first = draw(3), next = (first + 1 + draw(2)) % 3;
    return v3(x[first], x[next], x[3 - first - next]);
}
/* Upright, upside down, a little beside that, in simple numbers, or any. */
static inline kr_quat drawn_attitude(void)
{
    const double lean = power_of_two(30) * 0x1p-31;
    switch (draw(6)) {
    case 0:
        return q_one();
    case 1:
        return q4(0.0, v3(1.0, 0.0, 0.0));
    case 2:
        return q_unit(q4(1.0, v3(lean, 0.0, 0.0)));
    case 3:
        return q_unit(q4(lean, v3(0.6, -0.8, 0.0)));
    case 4:
        return (kr_quat){0.5, -0.5, 0.5, chance(50) ? 0.5 : -0.5};
    default:
        return random_quat();
    }
}
static inline kr_vec3 drawn_moments(void)
{
    static const double ratio[9][3] = {{1, 1, 2},       {2, 2, 1}, {4, 4, 1},
                                       {1, 1, 1},       {2, 1, 1}, {1, 1, 0.0009765625},
                                       {1.5, 2.0, 2.5}, {3, 4, 5}, {1, 1.25, 2.25}};
    const double a = uniform(0.1, 2.0), b = uniform(0.1, 2.0), c = uniform(0.0, 2.0);
    const double *of = ratio[draw(9)];
    if (chance(25)) return v3(b + c, c + a, a + b);
    return chance(60) ? v3(of[0], of[1], of[2]) : in_any_order(v3(of[0], of[1], of[2]));
}
static inline kr_body drawn_body(void)
{
    const double lever = simple(), mass = chance(50) ? 1.0 : uniform(0.5, 2.0);
    const kr_vec3 moments = drawn_moments(),
                  com[5] = {{0, 0, 0}, {0, 0, lever}, {lever, 0, 0}, {0, lever, 0}, {0, 0, lever}};
    kr_body body = {mass, moments, com[draw(5)], q_one(), 0.0};
    if (chance(20)) body.com = simple_vec();
    if (chance(30)) body.axes = drawn_attitude();
    if (chance(15)) body.inertia.x *= 1.0 + 0x1p-33 * power_of_two(20);
    return body;
}
/* None, along the axis, upright, about a principal axis, or any; slow or fast. */
static inline kr_vec3 drawn_momentum(const kr_scene *s)
{
    static const double sizes[6] = {0.0009765625, 0.25, 1.0, 2.0, 3.0, 16.0};
    const double size = (chance(50) ? 1.0 : -1.0) * of_few(6, sizes);
    const kr_quat q = q_mul(s->start.q, s->body.axes);
    switch (draw(6)) {
    case 0:
        return v3(0.0, 0.0, 0.0);
    case 1:
        return q_turn(q, v3(0.0, 0.0, size));
    case 2:
        return v3(0.0, 0.0, size);
    case 3:
        return q_turn(q, in_any_order(v3(size, 0.0, 0.0)));
    case 4:
        return v_scale(size, simple_vec());
    default:
        return random_vec(2.0);
    }
}
static inline kr_scene drawn_scene(void)
{
    static const double gravities[6] = {1.0, 1.0, 0.0, -1.0, 2.0, 0.5},
                        beginnings[6] = {0.0, 0.0, 0.0, 1.5, -3.0, 1e5};
    kr_scene s = kr_scene_default();
    s.body = drawn_body();
    s.gravity = of_few(6, gravities);
    s.start.q = drawn_attitude();
    s.start.m = drawn_momentum(&s);
    s.start.t = of_few(6, beginnings);
    if (chance(8)) s.damping = in_any_order(v3(0.25, 0.0, uniform(0.0, 0.5)));
    return s;
}
/* One that moves as most do: far from rest, from the poles and from every steady motion, beside
 * which roundings would grow, or tell whether an event comes. */
static inline kr_scene ordinary_scene(void)
{
    kr_scene s = drawn_scene();
    s.start.q = random_quat();
    s.start.m = random_vec(2.0);
    s.start.t = chance(75) ? 0.0 : 1.5;
    s.damping = v3(0.0, 0.0, 0.0);
    return s;
}
/* The same in other units of mass, length and time, which are powers of two. */
static inline void change_units(kr_scene *s)
{
    const double mass = power_of_two(60), length = power_of_two(40), time = power_of_two(40),
                 moment = mass * length * length;
    s->body.mass *= mass;
    s->body.inertia = v_scale(moment, s->body.inertia);
    s->body.com = v_scale(length, s->body.com);
    s->gravity *= length / time / time;
    s->start.m = v_scale(moment / time, s->start.m);
    s->damping = v_scale(moment / time, s->damping);
    s->start.t *= time;
}
/* A method of the library's own: others may be built in or not. */
static inline const kr_method *drawn_method(void)
{
    const kr_method *own[64];
    size_t count = 0;
    for (size_t i = 0; i < kr_method_count() && count < 64; i++) {
        own[count] = kr_method_at(i);
        count += strncmp(kr_method_name(own[count]), "gsl", 3) != 0;
    }
    return own[draw(count)];
}
/* About the time in which a top turns by a radian; 1 for what does not move. */
static inline double pace_of(const kr_scene *s)
{
    const double moment = v_largest(s->body.inertia),
                 pull = fabs(s->gravity) * s->body.mass * v_length(s->body.com),
                 rate = v_length(s->start.m) / moment + sqrt(pull / moment);
    return rate > 0.0 ? 1.0 / rate : 1.0;
}

/* Lines of so many draws each: no line depends on another. */
static inline void lines(const char *what, int count, int draws, void (*one)(void))
{
    for (int i = 0; i < count; i++) {
        char name[16];
        snprintf(name, sizeof name, "%d", i);
        headline(what, name);
        random_seed = (uint64_t)i * 1000003u;
        for (const char *c = what; *c; c++) random_seed = 31 * random_seed + (unsigned char)*c;
        for (int k = 0; k < draws; k++) one();
    }
}
/* Six digits of numbers, as shares of the largest: fewer than say has, for there are so many that
 * some would stand beside a rounding. */
static inline void tell(size_t n, const double x[])
{
    double most = 0.0;
    for (size_t i = 0; i < n; i++) most = isfinite(x[i]) ? fmax(most, fabs(x[i])) : most;
    say_shares(n, x, most > 0.0 ? 1e-6 * most : 1.0);
    put("\n");
}
/* A number beside the size that it has in this scene. */
static inline void tell_beside(double size, double x)
{
    const double both[2] = {x, size};
    tell(2, both);
}
static inline void tell_state(const kr_scene *s, const kr_state *state)
{
    const double pace = pace_of(s), unit = v_largest(s->body.inertia) / pace;
    const kr_vec3 m = v_scale(1.0 / unit, state->m);
    const double all[8] = {state->q.w, state->q.x, state->q.y, state->q.z, m.x, m.y, m.z, 1.0};
    tell(8, all);
    tell_beside(pace, state->t - s->start.t);
}
static inline void tell_status(kr_status status) { put("%s\n", kr_status_text(status)); }
#endif
