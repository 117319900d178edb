/* The driver: landing, grids, times between grid points, limits, interruption, the last valid
 * state, units. */
#include <stdlib.h>
#include "tops.h"

enum { MANY = 700 };

static kr_top *fixed(const kr_scene *s, const char *name, double step)
{
    return make(s, kr_method_find(name), (kr_config){.step = step});
}

/* A state is bitwise independent of the times requested before it, on the grid or off it. */
static void test_division(const kr_method *method)
{
    const kr_scene s = tilted();
    const kr_config config = {
        .step = 0.03125,
        .tol = method && kr_method_describe(method).flags & KR_METHOD_ADAPTIVE ? 1e-7 : 0.0};
    const double t[] = {0.0, 0.01, 0.03125, 0.04,    0.05, 0.0625,
                        1.0, 1.0,  2.3,     2.34375, 20.0, 21.001};
    enum { N = sizeof t / sizeof *t };
    kr_state at_once[N];
    size_t done = 0;
    kr_top *top = NULL, *steps = NULL;
    IS(kr_top_create(&s, method, config, &top) == KR_OK &&
       kr_top_create(&s, method, config, &steps) == KR_OK);
    IS(kr_top_record(top, N, t, at_once, &done) == KR_OK && done == N);
    for (int i = 0; i < N; i++) {
        IS(same(at_once[i], state_at(t[i], &s, method, config)) && at_once[i].t == t[i]);
        IS(kr_top_advance(steps, t[i]) == KR_OK && same(at_once[i], kr_top_state(steps)));
    }
    IS(same(at_once[0], s.start));
    IS(kr_top_reset(top, &s.start) == KR_OK && kr_top_advance(top, 21.001) == KR_OK &&
       same(kr_top_state(top), at_once[N - 1]));
    IS(kr_top_stats(top).steps > 0 && kr_top_stats(top).evaluations >= kr_top_stats(top).steps);
    kr_top_free(top);
    kr_top_free(steps);
}

/* Units of mass, length and time that are powers of two scale the results exactly. */
static void test_scaling(const kr_method *method, int mass, int length, int time)
{
    const kr_scene s = tilted();
    const int clock = kr_method_describe(method).flags & KR_METHOD_ABSOLUTE ? 0 : time;
    const double kg = ldexp(1, mass), m = ldexp(1, length), sec = ldexp(1, clock);
    const kr_config config = {.step = 0.01}, scaled = {.step = 0.01 * sec};
    kr_scene big = s;
    big.body.mass *= kg;
    big.body.inertia = v_scale(kg * m * m, s.body.inertia);
    big.body.com = v_scale(m, s.body.com);
    big.gravity = s.gravity * m / (sec * sec);
    big.start.m = v_scale(kg * m * m / sec, s.start.m);
    const kr_state a = state_at(5.003, &s, method, config),
                   b = state_at(5.003 * sec, &big, method, scaled);
    kr_state back = b;
    back.t /= sec;
    back.m = v_scale(sec / (kg * m * m), b.m);
    IS(same(a, back));
}

/* Neither the frame of description nor the choice of the symmetry axis matters. */
static void test_frames(const kr_method *method)
{
    const kr_scene s = tilted();
    const kr_config config = {.step = 0.01};
    const kr_state a = state_at(10.0, &s, method, config);
    const kr_quat turns[3] = {q4(0.5, v3(0.5, 0.5, 0.5)), q4(0.5, v3(-0.5, -0.5, -0.5)),
                              q_exp(v3(1.0, 0.3, -0.7))};
    for (int i = 0; i < 3; i++) {
        kr_scene other = s;
        other.body.axes = turns[i];
        other.start.q = q_mul(s.start.q, q_conj(turns[i]));
        kr_state b = state_at(10.0, &other, method, config);
        b.q = q_mul(b.q, turns[i]);
        NEAR(distance(a, b), 0.0,
             kr_method_describe(method).flags & KR_METHOD_ADAPTIVE ? 1e-6 : 1e-11);
    }
    for (int i = 0; i < 2; i++) { /* the same top with its axis along N and along B */
        kr_scene other = s;
        const kr_vec3 I = s.body.inertia;
        other.body.inertia = i == 0 ? v3(I.z, I.x, I.y) : v3(I.y, I.z, I.x);
        other.body.com = i == 0 ? v3(1, 0, 0) : v3(0, 1, 0);
        other.start.q = q_mul(s.start.q, q_conj(turns[i]));
        kr_state b = state_at(10.0, &other, method, config);
        b.q = q_mul(b.q, turns[i]);
        NEAR(distance(a, b), 0.0,
             kr_method_describe(method).flags & KR_METHOD_ADAPTIVE ? 1e-6 : 1e-11);
    }
}

static void test_limits(void)
{
    const kr_scene s = tilted();
    const kr_method *rk4 = kr_method_find("rk4"), *map = kr_method_find("bobenko_suris");
    kr_state out[MANY];
    double t[MANY];
    size_t done = 0;
    int left = 1;
    kr_config config = {.step = 0.01, .max_steps = 300};
    for (int i = 0; i < MANY; i++) t[i] = i * 0.01;
    kr_top *top = make(&s, rk4, config);
    IS(kr_top_record(top, MANY, t, out, &done) == KR_ERR_LIMIT && done == 301 &&
       kr_top_stats(top).steps == 300);
    IS(same(kr_top_state(top), out[300]) && kr_top_advance(top, 7.0) == KR_ERR_LIMIT &&
       same(kr_top_state(top), out[300]));
    kr_top_free(top);
    config.max_steps = 0, config.poll = stop_at, config.context = &left;
    IS(kr_top_create(&s, map, config, &top) == KR_OK);
    IS(kr_top_advance(top, 7.0) == KR_ERR_INTERRUPTED && kr_top_state(top).t == 512 * 0.01 &&
       kr_top_stats(top).steps == 512);
    left = 9;
    IS(kr_top_advance(top, 7.0) == KR_OK); /* and continues from there */
    const kr_config plain = {.step = 0.01};
    IS(same(kr_top_state(top), state_at(7.0, &s, map, plain)));
    kr_top_free(top);
}
/* A step far beyond the limit of stability fails. The last finite state is kept, wherever in a
 * batch of steps it lies. */
static void test_overflow(void)
{
    kr_scene s = tilted();
    kr_state out[MANY], last;
    double t[MANY];
    size_t done = 0;
    s.start.m = v3(20.0, 30.0, 5.0);
    for (int i = 0; i < MANY; i++) t[i] = i * 3.0;
    kr_top *top = fixed(&s, "rk4", 3.0), *again = fixed(&s, "rk4", 3.0);
    const kr_status why = kr_top_record(top, MANY, t, out, &done);
    IS(why == KR_ERR_NOT_FINITE && done > 1 && done < MANY);
    last = kr_top_state(top);
    IS(same(last, out[done - 1]) && isfinite(v_length(last.m)));
    IS(kr_top_advance(again, 1e4) == KR_ERR_NOT_FINITE && same(kr_top_state(again), last));
    IS(kr_top_reset(again, &s.start) == KR_OK && kr_top_advance(again, 3.0) == KR_OK &&
       same(kr_top_state(again), out[1]));
    kr_top_free(top);
    kr_top_free(again);
}
static void test_steps_and_reversal(void)
{
    const kr_scene s = tilted();
    kr_top *top = fixed(&s, "bobenko_suris2", 0.1);
    IS(kr_top_advance(top, 0.25) == KR_OK && kr_top_step(top) == KR_OK);
    NEAR(kr_top_state(top).t, 0.3, 1e-15);
    IS(kr_top_step(top) == KR_OK && kr_top_stats(top).steps == 4);
    IS(kr_top_advance(top, 0.1) == KR_ERR_TIME && kr_top_state(top).t == 0.4 &&
       kr_top_advance(top, NAN) == KR_ERR_ARGUMENT);
    kr_scene from = s;
    from.start = kr_top_state(top);
    kr_top_free(top);
    top = fixed(&from, "bobenko_suris2", -0.1);
    IS(kr_top_advance(top, 0.5) == KR_ERR_TIME && kr_top_advance(top, 0.0) == KR_OK);
    NEAR(distance(kr_top_state(top), s.start), 0.0, 2e-15);
    kr_top_free(top);
    top = fixed(&s, "extrap", 0.0);
    IS(kr_top_advance(top, 1e-3) == KR_OK && kr_top_step(top) == KR_OK &&
       kr_top_state(top).t > 1e-3);
    kr_top_free(top);
}
/* With every method, a top at rest without torque keeps its state in every bit. */
static void test_top_at_rest(void)
{
    kr_scene s = kr_scene_default();
    s.start.m = v3(0, 0, 0);
    s.gravity = 0.0;
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_config config = {.step = 0.1};
        if (!kr_method_applies(kr_method_at(i), &s.body)) continue;
        const kr_state a = state_at(30.0, &s, kr_method_at(i), config);
        NEAR(distance(a, s.start), 0.0, 0.0);
    }
}
/* A free sphere that takes more than 1e311 units of time for a turn still turns by the exact
 * angle. */
static void test_slowest_turns(void)
{
    kr_scene s = tilted();
    s.body.inertia = v3(2.0, 2.0, 2.0);
    s.body.com = v3(0.0, 0.0, 0.0);
    s.start.m = v3(0.0, 0.0, 0x1p-1030);
    const kr_state end = state_at(0x1p1020, &s, taylor(), (kr_config){0});
    NEAR(kr_attitude_error(end.q, s.start.q) / 0x1p-11, 1.0, 1e-12);
    NEAR(end.m.z, 0x1p-1030, 0.0);
}

int main(void)
{
    test_slowest_turns();
    const kr_scene thesis = tilted();
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_method *method = kr_method_at(i);
        if (!kr_method_applies(method, &thesis.body)) continue;
        test_division(method);
        test_frames(method);
        test_scaling(method, 3, -5, 7);
        test_scaling(method, -80, -30, -20);
        test_scaling(method, 100, 40, 12);
        test_scaling(method, 0, -300, 0);
    }
    test_limits();
    test_overflow();
    test_steps_and_reversal();
    test_top_at_rest();
    return check_result();
}
