/* The driver: single steps, limits, interruption, the last valid state, tops at rest. The laws in
 * tests/python and random calls in tests/fuzz test times, units and frames. */
#include <stdlib.h>
#include "tops.h"

enum { MANY = 700 };

static kr_top *fixed(const kr_scene *s, const char *name, double step)
{
    return make(s, kr_method_find(name), (kr_config){.step = step});
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
    IS(kr_top_record(top, MANY, t, out, NULL, &done) == KR_ERR_LIMIT && done == 301 &&
       kr_top_describe(top).stats.steps == 300);
    IS(same(kr_top_state(top), out[300]) && kr_top_advance(top, 7.0) == KR_ERR_LIMIT &&
       same(kr_top_state(top), out[300]));
    kr_top_free(top);
    config.max_steps = 0, config.poll = stop_at, config.context = &left;
    IS(kr_top_create(&s, map, config, &top) == KR_OK);
    IS(kr_top_advance(top, 7.0) == KR_ERR_INTERRUPTED && kr_top_state(top).t == 512 * 0.01 &&
       kr_top_describe(top).stats.steps == 512);
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
    const kr_status why = kr_top_record(top, MANY, t, out, NULL, &done);
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
    IS(kr_top_step(top) == KR_OK && kr_top_describe(top).stats.steps == 4);
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
    for (size_t i = 0; kr_method_at(i); i++) {
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
    test_limits();
    test_overflow();
    test_steps_and_reversal();
    test_top_at_rest();
    return check_result();
}
