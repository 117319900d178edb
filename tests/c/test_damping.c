/* Damped tops, compared with motions in closed form, with the power balance, and with general
 * properties of tops. */
#include <stdlib.h>
#include "kreisel.h"
#include "random.h"
#include "tops.h"

static const kr_config PLAIN = {0};

static kr_scene damped(kr_vec3 inertia, kr_vec3 damping, kr_vec3 m)
{
    const kr_scene s = {.body = {1.0, inertia, {0.0, 0.0, 0.0}, {1, 0, 0, 0}, 0, {0.0, 0.0, 0.0}},
                        .start = {0.0, {1, 0, 0, 0}, m},
                        .damping = damping};
    return s;
}
static kr_scene heavy(void)
{
    kr_scene s = tilted();
    s.body = general_body();
    s.gravity = 1.5;
    s.start.m = v3(0.5, 2.0, -1.0);
    s.damping = v3(0.125, 0.5, 0.25);
    return s;
}
static kr_vec3 body_velocity(const kr_scene *s, const kr_state *at)
{
    return q_turn_back(q_mul(at->q, s->body.axes), kr_state_velocity(s, at));
}

/* Without gravity a sphere rotates about a fixed axis: w = w0 exp(-D t / I), and the angle is the
 * integral of w. */
static void test_sphere(void)
{
    const double I = 1.75, D = 0.3;
    for (int i = -3; i < 12; i++) {
        const kr_vec3 m = random_vec(2.0);
        const double t = 1.0 + i, left = exp(-D * t / I), size = fmax(1.0, left);
        const kr_scene s = damped(v3(I, I, I), v3(D, D, D), m);
        const kr_config back = {.step = i < -1 ? -0.01 : 0.0};
        const kr_state end = state_at(t, &s, taylor(), back);
        const kr_quat turn = q_exp(v_scale((1.0 - left) / D, m));
        NEAR(off(end.m, v_scale(left, m)), 0.0, 1e-14 * size);
        NEAR(kr_attitude_error(end.q, turn), 0.0, 1e-14 * size);
    }
}
/* In a free symmetric body, W3 decays. W1 and W2 decay, and (W1, W2) rotates by the integral of
 * (I3 - I1) W3 / I1. */
static void test_symmetric_body(void)
{
    const double I1 = 2.0, I3 = 0.75, D1 = 0.25, D3 = 0.125, t = 9.0;
    const kr_scene s = damped(v3(I1, I1, I3), v3(D1, D1, D3), v3(1.0, 0.0, 2.0));
    const kr_state end = state_at(t, &s, taylor(), PLAIN);
    const double axial = 2.0 / I3 * exp(-D3 * t / I3), across = 1.0 / I1 * exp(-D1 * t / I1),
                 phase = (I3 - I1) / I1 * (2.0 / I3 - axial) * I3 / D3;
    const kr_vec3 W = body_velocity(&s, &end),
                  want = v3(across * cos(phase), across * sin(phase), axial);
    NEAR(off(W, want), 0.0, 3e-14);
}
/* A rotation of a free body about a principal axis decays at the rate of that axis. This holds for
 * four orders of three moments, for a sphere, with the centre of mass aside, and in a worker. */
static void test_decay_along_axes(void)
{
    static const double moments[5][3] = {
        {1, 1.5, 2}, {1.5, 2, 1}, {2, 1, 1.5}, {2, 1.5, 1}, {1.5, 1.5, 1.5}};
    const double D[3] = {0.125, 0.25, 0.75}, t = 3.0;
    kr_worker *worker = make_worker(NULL, PLAIN);
    for (int i = 0; i < 15; i++) {
        const int axis = i % 3;
        const double *I = moments[i / 3];
        const kr_vec3 e = v3(axis == 0, axis == 1, axis == 2);
        kr_scene s = damped(v_of(I), v_of(D), v_scale(I[axis], e));
        s.body.com = v3(0.25, -0.5, 0.125);
        kr_state many;
        kr_outcome outcome;
        const kr_tops tops = {
            .n = 1, .scenes = &s, .times = 1, .t = &t, .states = &many, .outcomes = &outcome};
        const kr_state end = state_at(t, &s, taylor(), PLAIN);
        const double left = exp(-D[axis] / I[axis] * t);
        NEAR(off(body_velocity(&s, &end), v_scale(left, e)), 0.0, 1e-15);
        IS(kr_worker_run(worker, &tops) == KR_OK && outcome.status == KR_OK);
        IS(same(many, end));
    }
    kr_worker_free(worker);
}
/* The energy obeys dE/dt = -w D w, integrated by Simpson's rule. */
static void test_power_balance(void)
{
    enum { LOOKS = 4001 };
    static kr_state at[LOOKS];
    static double t[LOOKS];
    const kr_scene s = heavy();
    kr_top *top = make(&s, taylor(), PLAIN);
    double lost = 0.0;
    for (int i = 0; i < LOOKS; i++) t[i] = 0.005 * i;
    IS(kr_top_record(top, LOOKS, t, at, NULL) == KR_OK);
    for (int i = 0; i < LOOKS; i++) {
        const kr_vec3 W = body_velocity(&s, &at[i]);
        const int weight = i == 0 || i == LOOKS - 1 ? 1 : i % 2 ? 4 : 2;
        lost += weight * 0.005 / 3.0 * v_dot(v_times(s.damping, W), W);
    }
    NEAR(kr_state_energy(&s, &at[0]) - kr_state_energy(&s, &at[LOOKS - 1]), lost, 1e-9);
    IS(lost > 1.0);
    kr_top_free(top);
}
static void test_reversal(void)
{
    kr_scene s = heavy();
    const kr_state start = s.start;
    s.start = state_at(8.0, &s, taylor(), PLAIN);
    const kr_config back = {.step = -0.01};
    NEAR(distance(state_at(0.0, &s, taylor(), back), start), 0.0, 1e-11);
    const kr_config deep = {.digits = 30}, less = {.digits = 20};
    s = heavy();
    const kr_state more = state_at(8.0, &s, taylor(), deep);
    NEAR(distance(more, state_at(8.0, &s, taylor(), less)), 0.0, 0.0);
    NEAR(distance(more, state_at(8.0, &s, taylor(), PLAIN)), 0.0, 1e-13);
    const kr_config level = {.skip_heading = 1};
    const kr_state headless = state_at(8.0, &s, taylor(), level);
    NEAR(off(body_velocity(&s, &more), body_velocity(&s, &headless)), 0.0, 1e-13);
}
/* Changing the units of mass, length and time by powers of two scales all numbers exactly. */
static void test_scaling(void)
{
    const double mass = 0x1p20, length = 0x1p-7, time = 0x1p11, moment = mass * length * length,
                 momentum = moment / time;
    const kr_scene s = heavy();
    kr_scene big = s;
    big.body.mass *= mass;
    big.body.inertia = v_scale(moment, s.body.inertia);
    big.body.com = v_scale(length, s.body.com);
    big.gravity *= length / (time * time);
    big.start.m = v_scale(momentum, s.start.m);
    big.damping = v_scale(momentum, s.damping);
    const kr_state a = state_at(5.0, &s, taylor(), PLAIN);
    kr_state b = state_at(5.0 * time, &big, taylor(), PLAIN);
    b.t /= time;
    b.m = v_scale(1.0 / momentum, b.m);
    IS(same(a, b));
}
/* With damping far above the rates of the top, it falls slowly, at the rate m g l sin(tilt) / D. */
static void test_creep(void)
{
    kr_scene s = damped(v3(1, 1, 0.5), v3(1e4, 1e4, 1e4), v3(0, 0, 0));
    s.body.com = v3(0, 0, 1);
    s.gravity = 1.0;
    s.start.q = q_exp(v3(0.5, 0.0, 0.0));
    const kr_state end = state_at(100.0, &s, taylor(), PLAIN);
    const double tilt = 2.0 * atan(tan(0.25) * exp((100.0 - 1e-4) / 1e4));
    NEAR(kr_state_nutation(&s, &end), tilt, 1e-8);
}

static void test_refusals(void)
{
    const double bad[] = {-1.0, -0x1p-1074, INFINITY, NAN};
    kr_scene s = kr_scene_default();
    kr_exact exact;
    kr_exact_map map;
    for (int i = 0; i < 12; i++) {
        s.damping = v3(i / 4 == 0 ? bad[i % 4] : 0.0, i / 4 == 1 ? bad[i % 4] : 0.0,
                       i / 4 == 2 ? bad[i % 4] : 0.0);
        IS(kr_scene_check(&s) == KR_ERR_ARGUMENT);
    }
    s.damping = v3(0.0, 0.0, 0x1p-1074);
    IS(kr_scene_check(&s) == KR_OK);
    IS(kr_exact_plan(&s, &exact) == KR_ERR_METHOD);
    IS(kr_exact_map_plan(&s, 0.01, &map) == KR_ERR_METHOD);
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_method *method = kr_method_at(i);
        const int moves = (kr_method_flags(method) & KR_METHOD_DAMPED) != 0;
        const kr_config config = {.step = 0.01};
        kr_top *top = NULL;
        IS(kr_method_suits(method, &s) == moves);
        IS(kr_top_create(&s, method, config, &top) == (moves ? KR_OK : KR_ERR_DAMPING));
        kr_top_free(top);
    }
}
static void test_checkpoint(void)
{
    const kr_scene s = heavy();
    kr_scene other = s;
    other.damping.y *= 2.0;
    kr_top *a = make(&s, taylor(), PLAIN), *b = make(&s, taylor(), PLAIN),
           *c = make(&other, taylor(), PLAIN);
    IS(kr_top_advance(a, 3.0) == KR_OK);
    const size_t size = kr_top_save_size(a);
    void *memory = malloc(size);
    IS(kr_top_save(a, size, memory) == KR_OK);
    IS(kr_top_load(c, size, memory) == KR_ERR_CHECKPOINT);
    IS(kr_top_load(b, size, memory) == KR_OK);
    IS(kr_top_advance(a, 7.0) == KR_OK && kr_top_advance(b, 7.0) == KR_OK);
    IS(same(kr_top_state(a), kr_top_state(b)));
    IS(kr_top_reset(b, &s.start) == KR_OK && kr_top_advance(b, 7.0) == KR_OK);
    IS(same(kr_top_state(a), kr_top_state(b)));
    free(memory);
    kr_top_free(a);
    kr_top_free(b);
    kr_top_free(c);
}
/* Each component of the momentum of a sphere decays to one half at the time (I / D) log 2, where an
 * event is found. */
static void test_half_momentum(void)
{
    const double I = 1.75, D = 0.3;
    const kr_scene s = damped(v3(I, I, I), v3(D, D, D), v3(0.5, -0.25, 1.0));
    static const char *const names[] = {"m_x", "m_y", "m_z"};
    const double half[] = {0.25, -0.125, 0.5};
    for (int i = 0; i < 3; i++) {
        const kr_term terms[] = {{1.0, kr_component_find(names[i]), kr_component_find("1")},
                                 {-half[i], kr_component_find("1"), kr_component_find("1")}};
        kr_event event = {.terms = terms, .count = 2};
        kr_event_hit hit = {0};
        kr_top *top = make(&s, taylor(), PLAIN);
        IS(kr_top_watch(top, 1, &event) == KR_OK && kr_top_seek(top, 20.0, &hit) == KR_OK);
        IS(hit.index == 0 && hit.direction == (i == 1 ? 1 : -1));
        NEAR(kr_top_state(top).t, I / D * log(2.0), 1e-13);
        kr_top_free(top);
    }
}
/* A damping beyond the range of doubles in the internal units of the top is refused. */
static void test_overflow(void)
{
    kr_scene s = damped(v3(1e-200, 1e-200, 1e-200), v3(1e300, 1e300, 1e300), v3(0, 0, 1e-200));
    kr_top *top = NULL;
    IS(kr_top_create(&s, taylor(), PLAIN, &top) == KR_ERR_ARGUMENT && !top);
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
int main(void)
{
    test_rotation_about_the_undamped_axis();
    test_growth_backward();
    test_half_momentum();
    test_overflow();
    test_sphere();
    test_symmetric_body();
    test_decay_along_axes();
    test_power_balance();
    test_reversal();
    test_scaling();
    test_creep();
    test_refusals();
    test_checkpoint();
    return check_result();
}
