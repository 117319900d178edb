/* Closed forms in a worker: times in the wrong order, and units. */
#include "check.h"
#include "tops.h"

static void run(const kr_scene *scene, const double t[3], kr_outcome *outcome, kr_state out[3])
{
    const kr_config config = {0};
    kr_worker *worker = make_worker(NULL, config);
    const kr_tops tops = {
        .n = 1, .scenes = scene, .times = 3, .t = t, .states = out, .outcomes = outcome};
    IS(kr_worker_run(worker, &tops) == KR_OK);
    kr_worker_free(worker);
}
/* If the closed form may exceed the range of doubles in the user's units, the top is computed in
 * its internal units. This holds with and without an array of states. */
static void test_units(void)
{
    const double t[3] = {1e-305, 2e-305, 3e-305};
    kr_scene s = kr_scene_default();
    kr_state out[3], truly[3];
    s.body.inertia = v3(1e-175, 1e-175, 0.5e-175), s.body.com = v3(0.0, 0.0, 0.0);
    s.start.m = v3(1e130, 2e130, 3e130);
    kr_top *alone = make(&s, kr_method_find("exact"), (kr_config){0});
    IS(kr_top_record(alone, 3, t, truly, NULL, NULL) == KR_OK);
    for (int i = 0; i < 2; i++) {
        kr_outcome outcome = {.status = KR_ERR_ARGUMENT};
        run(&s, t, &outcome, i ? NULL : out);
        IS(outcome.status == KR_OK && outcome.done == 3 && outcome.last.t == t[2]);
        NEAR(kr_attitude_error(outcome.last.q, truly[2].q), 0.0, 1e-14);
    }
    for (int k = 0; k < 3; k++) {
        NEAR(kr_attitude_error(out[k].q, truly[k].q), 0.0, 1e-14);
        NEAR(off(out[k].m, truly[k].m) / v_length(truly[k].m), 0.0, 1e-14);
    }
    kr_top_free(alone);
}
/* Times that lead away from the start are reached. A time that leads back fails, and the states
 * before it are kept. */
static void test_time_order(void)
{
    const double led[4][3] = {{1.0, 3.0, 3.0},
                              {-1.0, -1.0, -3.0},
                              {0.0, 0.0, 0.0},
                              {0.0, 1.0, 2.0}},
                 back[4][3] = {
                     {1.0, 3.0, 2.0}, {-1.0, -3.0, -2.0}, {1.0, 0.5, 2.0}, {1.0, 2.0, 0.0}};
    const kr_scene s = kr_scene_default();
    kr_outcome outcome;
    kr_state out[3];
    for (int i = 0; i < 4; i++) {
        run(&s, led[i], &outcome, out);
        IS(outcome.status == KR_OK && outcome.done == 3 && out[2].t == led[i][2]);
        run(&s, back[i], &outcome, out);
        IS(outcome.status == KR_ERR_TIME && outcome.done == (i == 2 ? 1 : 2));
        IS(outcome.last.t == back[i][outcome.done - 1]);
    }
}
int main(void)
{
    test_time_order();
    test_units();
    return check_result();
}
