/* Step limit near an unstable equilibrium. Near the equilibrium, the first terms of the series do
 * not show the growth, so a step is limited by the fastest rate of growth about any axis. */
#include "tops.h"

/* Returns a body that is thin about one axis, with its centre of mass on another axis, which points
 * up. A tiny momentum makes it fall. */
static kr_scene thin(int about, int middle, int lever)
{
    double moments[3] = {1.0, 1.0, 1.0};
    moments[about] = 0.02, moments[middle] = 0.99;
    kr_scene s = kr_scene_default();
    s.body.mass = 1.0;
    s.body.inertia = v3(moments[0], moments[1], moments[2]);
    s.body.com = v3(0.01 * (lever == 0), 0.01 * (lever == 1), 0.01 * (lever == 2));
    s.start.q = q_conj(q_tilt(v_scale(100.0, s.body.com)));
    s.start.m =
        q_turn(s.start.q, v3(3e-22 * (about == 0), 3e-22 * (about == 1), 3e-22 * (about == 2)));
    s.gravity = 1.0;
    return s;
}
static void test_fall(int about, int middle, int lever)
{
    const kr_scene s = thin(about, middle, lever);
    const double t = 66.0; /* about 46 times the time in which the tilt grows by a factor e */
    kr_state many;
    kr_outcome outcome;
    const kr_tops tops = {
        .n = 1, .scenes = &s, .times = 1, .t = &t, .states = &many, .outcomes = &outcome};
    const kr_state truly = state_at(t, &s, taylor(), (kr_config){.digits = 30});
    IS(kr_state_apex(&s, &s.start).z > 1.0 - 1e-15);
    IS(kr_state_apex(&s, &truly).z < 0.9);
    NEAR(distance(state_at(t, &s, taylor(), (kr_config){0}), truly), 0.0, 1e-7);
    kr_worker *worker = make_worker(taylor(), (kr_config){0});
    IS(kr_worker_run(worker, &tops) == KR_OK && outcome.status == KR_OK);
    NEAR(distance(many, truly), 0.0, 1e-7);
    kr_worker_free(worker);
}
int main(void)
{
    for (int about = 0; about < 3; about++)
        for (int i = 0; i < 4; i++)
            test_fall(about, (about + 1 + i / 2) % 3, (about + 1 + i % 2) % 3);
    return check_result();
}
