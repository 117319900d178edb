/* Closed forms in a worker: times in the wrong order, limits of steps, and units. */
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
    IS(kr_top_record(alone, 3, t, truly, NULL) == KR_OK);
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
/* A limit on the number of steps has the same meaning for a top of an ensemble as for a single
 * top. */
static void test_limits_of_steps(void)
{
    const double t[4] = {1.0, 2.0, 2.0, 5.0};
    const kr_scene scenes[2] = {kr_scene_default(), kr_scene_default()};
    for (int64_t most = 0; most < 6; most++) {
        const kr_config config = {.max_steps = most};
        kr_state out[8], truly[4];
        kr_outcome outcomes[2];
        const kr_tops tops = {
            .n = 2, .scenes = scenes, .times = 4, .t = t, .states = out, .outcomes = outcomes};
        kr_top *alone = make(&scenes[0], kr_method_find("exact"), config);
        size_t done = 0;
        const kr_status status = kr_top_record(alone, 4, t, truly, &done);
        kr_worker *worker = make_worker(NULL, config);
        IS(kr_worker_run(worker, &tops) == KR_OK);
        for (size_t i = 0; i < 2; i++) {
            IS(outcomes[i].status == status && outcomes[i].done == done);
            IS(outcomes[i].stats.steps == kr_top_stats(alone).steps);
            for (size_t k = 0; k < done; k++) IS(same(out[4 * i + k], truly[k]));
        }
        IS((status == KR_ERR_LIMIT) == (most == 1 || most == 2));
        kr_worker_free(worker);
        kr_top_free(alone);
    }
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
    test_limits_of_steps();
    test_time_order();
    test_units();
    return check_result();
}
