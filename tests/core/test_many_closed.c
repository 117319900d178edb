/* Closed forms of many tops: which times they refuse, as the tops alone do. */
#include "check.h"
#include "tops.h"

static void run(const kr_scene *scene, const double t[3], kr_outcome *outcome, kr_state out[3])
{
    const kr_config config = {0};
    kr_worker *worker = NULL;
    const kr_tops tops = {
        .n = 1, .scenes = scene, .times = 3, .t = t, .states = out, .outcomes = outcome};
    IS(kr_worker_create(NULL, config, 0, NULL, &worker) == KR_OK);
    IS(kr_worker_run(worker, &tops) == KR_OK);
    kr_worker_free(worker);
}
/* One top at one time needs all that many need. */
static void nothing_is_left_out(void)
{
    const kr_scene s = kr_scene_default();
    const double t = 1.0;
    kr_outcome outcome;
    kr_worker *worker = NULL;
    IS(kr_worker_create(NULL, (kr_config){0}, 0, NULL, &worker) == KR_OK);
    for (int missing = 0; missing < 4; missing++) {
        const kr_tops tops = {.n = 1,
                              .scenes = missing == 0 ? NULL : &s,
                              .times = 1,
                              .t = missing == 1 ? NULL : &t,
                              .outcomes = missing == 2 ? NULL : &outcome};
        IS(kr_worker_run(worker, &tops) == (missing < 3 ? KR_ERR_ARGUMENT : KR_OK));
    }
    kr_worker_free(worker);
}
int main(void)
{
    nothing_is_left_out();
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
    return check_result();
}
