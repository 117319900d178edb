/* Times beyond the resolution of doubles: every method refuses them, and a step below the
 * resolution fails with a status that says so. */
#include <float.h>
#include "driver/top.h"
#include "tops.h"

enum { TOPS = 50 };

static kr_scene random_scene_for(const kr_method *method)
{
    kr_scene s = scene_for(method);
    s.start.m = v_scale(ldexp(1.0, (int)uniform(-30, 30)), random_vec(1.0));
    return s;
}
/* Checks the horizon by an independent formula with the largest of the rates |m| / moment,
 * sqrt(torque / moment) and the components of the angular velocity. */
static void horizon_of(const kr_scene *s)
{
    const double moment = v_largest(s->body.inertia),
                 torque = s->body.mass * fabs(s->gravity) * v_length(s->body.com);
    const kr_quat axes = q_mul(s->start.q, s->body.axes);
    const double velocity = v_largest(q_turn_back(axes, kr_state_velocity(s, &s->start)));
    const double rate = fmax(fmax(v_length(s->start.m) / moment, velocity), sqrt(torque / moment));
    NEAR(kr_scene_horizon(s) * rate / 9007199254740992.0, 1.0, 1e-14);
}
static void test_refusals(const kr_method *method)
{
    kr_scene s = random_scene_for(method);
    const double sign = random_bits() % 2 ? 1.0 : -1.0, horizon = kr_scene_horizon(&s);
    const double far[] = {horizon, 2.0 * horizon, DBL_MAX, INFINITY, NAN};
    const int dense = (kr_method_describe(method).flags & KR_METHOD_DENSE) != 0;
    const kr_config config = {.step = sign * horizon * 0x1p-50};
    kr_top *top = NULL;
    horizon_of(&s);
    if (kr_top_create(&s, method, config, &top) != KR_OK) return; /* such a step is too large */
    if (dense) IS(kr_top_advance(top, sign * 0x1p-52 * horizon) == KR_OK);
    const kr_state was = kr_top_state(top);
    const double time = kr_top_describe(top).time;
    for (int i = 0; i < 5; i++) {
        const kr_status want = isfinite(far[i]) ? KR_ERR_RESOLUTION : KR_ERR_ARGUMENT;
        kr_event_hit hit = {7, 7};
        IS(kr_top_advance(top, sign * far[i]) == want);
        IS(kr_top_seek(top, sign * far[i], &hit) == want && hit.index == 7);
        IS(same(kr_top_state(top), was) && kr_top_describe(top).time == time);
    }
    kr_state late = s.start;
    late.t = -horizon;
    IS(kr_top_reset(top, &late) != KR_OK && same(kr_top_state(top), was));
    kr_top_free(top);
    top = NULL;
    s.start.t = horizon;
    IS(kr_top_create(&s, method, config, &top) == KR_ERR_RESOLUTION && !top);
}
/* A slender body rotates about its axis much faster than its momentum about another axis would
 * rotate it. Beyond the horizon, the closed form is refused by both interfaces. */
static void test_slender_body(void)
{
    const kr_scene s = {.body = {.mass = 1.0, .inertia = {1.0, 1.0, 1e-6}, .axes = {1, 0, 0, 0}},
                        .gravity = 1.0,
                        .start = {0.0, {1.0, 0.0, 0.0, 0.0}, {1e-3, 0.0, 1.0}}};
    const double horizon = kr_scene_horizon(&s);
    NEAR(horizon / 9007199254.740992, 1.0, 1e-12);
    for (int i = 0; i < 2; i++) {
        const double t = (i ? 1.01 : 0.99) * horizon;
        const kr_status want = i ? KR_ERR_RESOLUTION : KR_OK;
        kr_state state;
        kr_outcome outcome;
        const kr_tops tops = {
            .n = 1, .scenes = &s, .times = 1, .t = &t, .states = &state, .outcomes = &outcome};
        kr_top *top = make(&s, kr_method_find("exact"), (kr_config){0});
        kr_worker *worker = make_worker(kr_method_find("exact"), (kr_config){0});
        IS(kr_top_advance(top, t) == want);
        IS(kr_worker_run(worker, &tops) == KR_OK && outcome.status == want);
        IS(i || same(state, kr_top_state(top)));
        kr_top_free(top);
        kr_worker_free(worker);
    }
}
/* A loaded checkpoint restores the horizon of its start. */
static void test_checkpoint(void)
{
    kr_scene s = tilted();
    static unsigned char saved[1 << 14];
    kr_top *top = make(&s, taylor(), (kr_config){0}), *other = make(&s, taylor(), (kr_config){0});
    const size_t size = kr_top_save_size(top);
    s.start.m = v_scale(1e9, s.start.m);
    IS(kr_top_reset(top, &s.start) == KR_OK && size <= sizeof saved);
    IS(kr_top_save(top, size, saved) == KR_OK && kr_top_load(other, size, saved) == KR_OK);
    IS(kr_top_advance(other, 1.01 * kr_scene_horizon(&s)) == KR_ERR_RESOLUTION);
    kr_top_free(top);
    kr_top_free(other);
}
/* Steps below the resolution of the time are refused. */
static void test_steps_below_resolution(void)
{
    const kr_scene s = kr_scene_default();
    kr_top *top = make(&s, kr_method_find("exact"), (kr_config){.step = 0.05});
    IS(kr_top_advance(top, 8e15) == KR_OK);
    for (int i = 0; i < 3; i++) IS(kr_top_step(top) == KR_ERR_STEP && kr_top_state(top).t == 8e15);
    IS(kr_top_advance(top, 8.1e15) == KR_OK && kr_top_state(top).t == 8.1e15);
    kr_top_free(top);
    for (size_t i = 0; kr_method_at(i); i++) {
        kr_scene late = s;
        kr_status status = KR_OK;
        late.start.t = 4e15;
        if (kr_top_create(&late, kr_method_at(i), (kr_config){.step = 0.5}, &top) != KR_OK)
            continue; /* not for this body, or not with such a step */
        for (int k = 0; k < 20; k++) {
            const double before = kr_top_state(top).t;
            status = kr_top_step(top);
            IS((status == KR_OK) == (kr_top_state(top).t > before));
            IS(status == KR_OK || status == KR_ERR_STEP);
        }
        kr_top_free(top);
    }
}

/* If a step is shorter than the distance between adjacent times, the rounded time of its end may
 * lie outside the step. The state at this time is that of the nearer end, because the series is not
 * valid there. */
static void test_times_beside_a_step(double step)
{
    const kr_scene s = kr_scene_default();
    kr_top *top = make(&s, kr_method_find("taylor"), (kr_config){.step = step});
    kr_state begin, before, end, behind;
    IS(kr_top_step(top) == KR_OK && kr_top_step(top) == KR_OK);
    const kr_step_polynomial piece = top->method->polynomial(&top->main);
    const double length = piece.end - piece.begin;
    top->method->at(&top->main, piece.begin, &begin);
    top->method->at(&top->main, piece.begin - 9.0 * length, &before);
    top->method->at(&top->main, piece.end, &end);
    top->method->at(&top->main, piece.end + 9.0 * length, &behind);
    before.t = begin.t = end.t = behind.t = 0.0;
    IS(same(before, begin) && same(behind, end) && !same(begin, end));
    kr_top_free(top);
}
static int stop_at_once(void *context) { return (void)context, 1; }
/* If the resolution of times is a quarter of a step, the state of an interrupted top belongs to its
 * time. Its next steps are those of a top that was not interrupted. */
static void test_late_stops(void)
{
    kr_scene s = tilted();
    const kr_config stopped = {.poll = stop_at_once}, free = {0};
    s.start.m = v_scale(0.5, s.start.m);
    for (int i = 0; i < TOPS; i++) {
        s.start.t = -0x1p49 - ldexp(uniform(0.0, 1.0), 47);
        s.start.q = random_quat();
        kr_top *top = make(&s, taylor(), stopped);
        IS(kr_top_advance(top, s.start.t + 500.0) == KR_ERR_INTERRUPTED);
        const kr_state there = kr_top_state(top);
        IS(there.t > s.start.t && same(there, state_at(there.t, &s, taylor(), free)));
        const double later = nextafter(there.t, INFINITY);
        IS(kr_top_advance(top, there.t) == KR_OK && same(kr_top_state(top), there));
        IS(kr_top_advance(top, later) == KR_OK);
        IS(same(kr_top_state(top), state_at(later, &s, taylor(), free)));
        kr_top_free(top);
    }
}
/* A step that ends beyond the horizon fails, because doubles do not resolve its time. */
static void test_steps_beyond(void)
{
    kr_scene s = kr_scene_default();
    const double horizon = kr_scene_horizon(&s);
    kr_top *top = make(&s, kr_method_find("exact"), (kr_config){.step = 0.5 * horizon});
    IS(kr_top_step(top) == KR_OK && kr_top_step(top) == KR_ERR_STEP);
    IS(kr_top_state(top).t == 0.5 * horizon);
    kr_top_free(top);
}

int main(void)
{
    test_late_stops();
    test_steps_beyond();
    test_times_beside_a_step(0.0);
    test_times_beside_a_step(-0.1);
    for (size_t i = 0; kr_method_at(i); i++)
        for (int k = 0; k < TOPS; k++) test_refusals(kr_method_at(i));
    kr_scene s = kr_scene_default();
    s.gravity = 0.0;
    s.start.m = v3(0, 0, 0);
    IS(kr_scene_horizon(&s) == INFINITY);
    s.start.q.w = 2.0;
    IS(kr_scene_horizon(&s) == 0.0 && kr_scene_horizon(NULL) == 0.0);
    test_slender_body();
    test_checkpoint();
    test_steps_below_resolution();
    return check_result();
}
