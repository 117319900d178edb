/* Damping, dry friction, and supports that turn or shake: paths against truths, stops at the edges
 * of steps, and refusals. The tests in Python have known motions and laws. */
#include "kreisel.h"
#include "event_helpers.h"
#include "truth.h"

/* Returns a symmetric top with this moment about its axis, its other moments being 1.25. */
static kr_scene symmetric_top(double i3, double gravity, double friction, kr_vec3 m)
{
    const kr_scene s = {.body = {.mass = 1.0,
                                 .inertia = {1.25, 1.25, i3},
                                 .com = {0.0, 0.0, 0.5},
                                 .axes = {1, 0, 0, 0}},
                        .gravity = gravity,
                        .start = {0.0, {1.0, 0.0, 0.0, 0.0}, m},
                        .friction = friction};
    return s;
}
/* A motion that begins later is the same if the phase of the shaking is the same. */
static void test_truth(const char *family, int digits, double begin, double most)
{
    int count = 0;
    for (int i = 0; i < TRUTHS; i++) {
        const truth *row = &truths[i];
        if (!belongs_to(row, family)) continue;
        kr_scene s = scene_of_truth(row);
        s.start.t = begin;
        s.shaking.phase -= s.shaking.rate * begin;
        const kr_config config = {.digits = digits, .step = row->end.t < 0.0 ? -0.1 : 0.0};
        kr_top *top = make(&s, taylor(), config);
        IS(kr_top_advance(top, begin + row->end.t) == KR_OK);
        const double size = fmax(1.0, fmax(v_length(s.start.m), v_length(row->end.m))),
                     miss = error_of_truth(row, kr_top_state(top), kr_top_describe(top).low, size);
        if (!(miss <= most)) printf("%s, %d digits:\n", row->name, digits);
        NEAR(miss, 0.0, most);
        kr_top_free(top);
        count++;
    }
    IS(count > 10);
}
/* Returns a free top whose friction stops its spin after 8 * `spin`. */
static kr_scene stopping_top(double spin)
{
    return symmetric_top(0.75, 0.0, 0.125, v3(0.5, -0.25, spin));
}
/* A spin that vanishes at the end of a step, or up to some rounding errors before it or after it,
 * stops the top at that time. */
static void test_stop_at_the_end_of_a_step(void)
{
    double low = 1e-3, high = 8.0; /* spins that vanish within and after the first step */
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        const kr_scene s = stopping_top(middle);
        kr_top *top = make(&s, taylor(), kr_config_default());
        IS(kr_top_step(top) == KR_OK);
        *(kr_top_describe(top).time > 8.0 * middle - 1e-13 ? &low : &high) = middle;
        kr_top_free(top);
    }
    for (int i = -300; i <= 300; i++) {
        const double spin = low * (1.0 + i * 0x1p-50);
        const kr_scene s = stopping_top(spin);
        const kr_term terms[] = {term(1.0, "spin", "1")};
        kr_event event = {.terms = terms, .count = 1};
        double t[MANY];
        kr_top *top = watched(&s, kr_config_default(), &event, 1);
        IS(seek_all(top, 16.0 * spin, t, NULL) == 1);
        NEAR(t[0], 8.0 * spin, 1e-13);
        const kr_state end = kr_top_state(top);
        NEAR(kr_state_axial_momentum(&s, &end), 0.0, 1e-14);
        NEAR(v_length(end.m), sqrt(0.3125), 1e-14);
        kr_top_free(top);
    }
}
/* A friction that is zero in internal units changes neither the path nor the tangents. */
static void test_least_friction(void)
{
    double phi[2][36];
    kr_state end[2];
    for (int i = 0; i < 2; i++) {
        kr_scene s = stopping_top(0.5);
        s.body.mass *= 1024.0;
        s.body.inertia = v_scale(1024.0, s.body.inertia);
        s.start.m = v_scale(1024.0, s.start.m);
        s.friction = i ? 5e-324 : 0.0;
        kr_top *top = make(&s, taylor(), (kr_config){.tangents = KR_TANGENT_START});
        IS(kr_top_advance(top, 3.0) == KR_OK && kr_top_tangents(top, phi[i], NULL) == KR_OK);
        end[i] = kr_top_state(top);
        kr_top_free(top);
    }
    NEAR(off(end[0].m, end[1].m), 0.0, 1e-11);
    NEAR(kr_attitude_error(end[0].q, end[1].q), 0.0, 1e-14);
    for (int k = 0; k < 36; k++) NEAR(phi[0][k], phi[1][k], 1e-14 * (1.0 + fabs(phi[0][k])));
}
/* Events of a top that friction stops at t = 4 occur at the same times with more digits. Only a
 * multiple of the spin has an event at the stop. */
static void test_events_of_a_stopping_top(void)
{
    const kr_scene s = stopping_top(0.5);
    const kr_term turned = term(-2.0, "1", "spin"), square = term(1.0, "spin", "spin"),
                  tilt = term(1.0, "apex_z", "1"), constant = term(1.0, "1", "1"),
                  sum[2] = {term(1.0, "spin", "1"), term(-1.0, "1", "1")};
    const kr_event events[] = {
        {.terms = &turned, .count = 1}, {.terms = sum, .count = 2},
        {.terms = &square, .count = 1}, {.terms = &constant, .count = 1},
        {.terms = &tilt, .count = 1},   {.terms = &tilt, .count = 1, .extremum = 1}};
    const int count[] = {1, 0, 0, 0, 3, 2};
    for (int i = 0; i < 6; i++) {
        double t[2][MANY];
        int n[2];
        for (int k = 0; k < 2; k++) {
            kr_event event = events[i];
            kr_top *top = watched(&s, (kr_config){.digits = k ? 30 : 16}, &event, 1);
            n[k] = seek_all(top, 20.0, t[k], NULL);
            kr_top_free(top);
        }
        IS(n[0] == count[i] && n[1] == count[i]);
        for (int k = 0; k < n[0]; k++) NEAR(t[0][k], t[1][k], 1e-12);
        if (i == 0) NEAR(t[0][0], 4.0, 1e-13);
    }
}
static kr_scene damped(kr_vec3 inertia, kr_vec3 damping, kr_vec3 m)
{
    const kr_scene s = {.body = {.mass = 1.0, .inertia = inertia, .axes = {1, 0, 0, 0}},
                        .start = {0.0, {1, 0, 0, 0}, m},
                        .damping = damping};
    return s;
}
/* A damping beyond the range of doubles in the internal units of the top is refused. */
static void test_overflow(void)
{
    kr_scene s = damped(v3(1e-200, 1e-200, 1e-200), v3(1e300, 1e300, 1e300), v3(0, 0, 1e-200));
    kr_top *top = NULL;
    IS(kr_top_create(&s, taylor(), kr_config_default(), &top) == KR_ERR_ARGUMENT && !top);
}
/* Backward in time, the velocity of a free body about a principal axis grows until it exceeds the
 * range that the series allows. The run then ends, and the last state is still accurate. */
static void test_growth_backward(void)
{
    const kr_vec3 I = {1.0, 2.0, 2.5}, D = {0.125, 0.125, 0.25};
    const kr_scene s = damped(I, D, v3(0.0, 0.0, 1.0));
    kr_top *top = make(&s, taylor(), (kr_config){.step = -1.0, .skip_heading = 1});
    kr_status status = KR_OK;
    int steps = 0;
    for (; steps < 1000 && status == KR_OK; steps++) status = kr_top_step(top);
    const kr_state end = kr_top_state(top);
    IS(status == KR_ERR_NOT_FINITE && end.m.z > 1e7);
    NEAR(log(end.m.z) / (-0.1 * end.t), 1.0, 1e-9);
    kr_top_free(top);
}
/* Rotation about an axis without damping continues unchanged backward in time, although damping
 * about the other axes, if it also acted about this one, would let the velocity grow without
 * bound. */
static void test_rotation_about_the_undamped_axis(void)
{
    for (int axis = 0; axis < 3; axis++) {
        const kr_vec3 along = v3(axis == 0, axis == 1, axis == 2);
        const kr_scene s =
            damped(v3(1.0, 1.25, 1.5), v3(along.x < 1.0, along.y < 1.0, along.z < 1.0), along);
        const kr_state end = state_at(-900.0, &s, taylor(), (kr_config){.step = -0.1});
        IS(memcmp(&end.m, &s.start.m, sizeof end.m) == 0);
    }
}
static void test_refusals(void)
{
    const kr_config config = {.step = 0.01};
    kr_scene plain = symmetric_top(0.75, 1.0, 0.0, v3(0.5, -0.25, 1.5)),
             tops[4] = {plain, plain, plain, plain};
    const kr_status status[] = {KR_ERR_TURNING, KR_ERR_SHAKING, KR_ERR_FRICTION, KR_ERR_DAMPING};
    const unsigned flags[] = {KR_METHOD_TURNING, KR_METHOD_SHAKING, KR_METHOD_FRICTION,
                              KR_METHOD_DAMPED};
    tops[0].turning = v3(0.0, 0.1, 0.2);
    tops[1].shaking = (kr_shaking){0.1, 1.0, 0.0};
    tops[2].friction = 0.1;
    tops[3].damping.z = 0x1p-1074;
    for (size_t i = 0; kr_method_at(i); i++) {
        const kr_method *method = kr_method_at(i);
        for (int k = 0; k < 4 && kr_method_suits(method, &plain); k++) {
            kr_top *top = NULL;
            const int moves = (kr_method_describe(method).flags & flags[k]) != 0;
            IS(kr_method_suits(method, &tops[k]) == moves);
            IS(kr_top_create(&tops[k], method, config, &top) == (moves ? KR_OK : status[k]));
            kr_top_free(top);
        }
    }
    const kr_exact *plan;
    kr_nutation turning;
    for (int k = 0; k < 4; k++) {
        IS(plan_closed_form(&tops[k], &plan) == KR_ERR_METHOD);
        IS(kr_exact_nutation(&tops[k], &turning) == KR_ERR_METHOD);
    }
    kr_top *top = NULL;
    kr_config tangents = {.tangents = KR_TANGENT_FRICTION}, headless = {.skip_heading = 1};
    IS(kr_top_create(&tops[0], taylor(), headless, &top) == KR_ERR_OPTION);
    IS(kr_top_create(&plain, taylor(), tangents, &top) == KR_ERR_OPTION);
    tangents.tangents = KR_TANGENT_COM;
    tops[2].body.com = v3(0.0, 0.0, 0.0);
    IS(kr_top_create(&tops[2], taylor(), tangents, &top) == KR_ERR_OPTION);
}
static void test_bad_numbers(void)
{
    const double bad[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        kr_scene s[11];
        for (int k = 0; k < 11; k++) {
            s[k] = kr_scene_default();
            s[k].shaking = (kr_shaking){0.25, 4.0, 0.5};
        }
        s[0].turning.x = s[1].turning.z = bad[i];
        s[2].shaking.amplitude = s[3].shaking.rate = s[4].shaking.phase = bad[i];
        s[5].friction = bad[i];
        s[6].friction = -1e-300;
        s[7].shaking.rate = i == 0 ? 0.0 : i == 1 ? -1.0 : 1e200;
        s[8].damping.x = s[9].damping.y = bad[i];
        s[10].damping.z = -0x1p-1074;
        for (int k = 0; k < 11; k++) IS(kr_scene_check(&s[k]) == KR_ERR_ARGUMENT);
    }
    kr_scene still = kr_scene_default();
    still.shaking.phase = 1.0;
    IS(kr_scene_check(&still) == KR_OK);
}
int main(void)
{
    test_truth("support", 0, 0.0, 2e-14);
    test_truth("support", 16, 0.25, 2e-14);
    test_truth("support", 20, 0.0, 1e-19);
    test_truth("support", 30, 0.0, 1e-28);
    test_truth("stiff", 0, 0.0, 1e-13);
    test_stop_at_the_end_of_a_step();
    test_events_of_a_stopping_top();
    test_least_friction();
    test_refusals();
    test_bad_numbers();
    test_overflow();
    test_growth_backward();
    test_rotation_about_the_undamped_axis();
    return check_result();
}
