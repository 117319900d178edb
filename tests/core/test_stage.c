/* The stage: tops on one clock in ticks. */
#include "page/stage.h"
#include "tops.h"

static kr_stage stage, other;
static const int64_t eps1 = 10000, eps2 = 70000; /* 0.01, 0.07; the common multiple is 0.07 */

static void set(kr_stage *s, int64_t first, int64_t second)
{
    const kr_scene scene = kr_scene_default();
    kr_stage_clear(s);
    IS(kr_stage_add(s, &scene, kr_method_find("bobenko_suris"), first, 0.0, -1) == KR_OK);
    IS(kr_stage_add(s, &scene, kr_method_find("bobenko_suris"), second, 0.0, 0) == KR_OK);
    IS(kr_stage_add(s, &scene, kr_method_find("extrap"), second, 1e-10, 0) == KR_OK);
}

/* The states are those of a top on its own, to the last bit. */
static void test_states(void)
{
    const kr_scene scene = kr_scene_default();
    const kr_config config = {.step = 0.07};
    kr_top *top = NULL;
    kr_state alone;
    set(&stage, eps1, eps2);
    IS(kr_stage_advance(&stage, 7000000, INT64_MAX) == 7000000);
    IS(kr_top_create(&scene, kr_method_find("bobenko_suris"), config, &top) == KR_OK);
    IS(kr_top_advance(top, 100 * 0.07) == KR_OK);
    alone = kr_top_state(top);
    IS(same(alone, stage.actor[1].now));
    IS(memcmp(&stage.actor[1].trace[100], &alone.q, sizeof alone.q) == 0);
    IS(stage.actor[0].steps == 700 && stage.actor[1].steps == 100 && stage.actor[2].steps == 100);
    kr_top_free(top);
}
/* An adaptive method stands at multiples of eps, from each of which it begins as if new: so eps
 * counts. */
static void test_restarts(void)
{
    kr_scene scene = kr_scene_default();
    const kr_method *extrap = kr_method_find("extrap");
    const kr_config config = {.tol = 1e-5};
    kr_stage_clear(&stage);
    IS(kr_stage_add(&stage, &scene, extrap, 10000, 1e-5, -1) == KR_OK);
    IS(kr_stage_add(&stage, &scene, extrap, 200000, 1e-5, 0) == KR_OK);
    IS(kr_stage_add(&stage, &scene, kr_method_find("taylor"), 200000, 0.0, 0) == KR_OK);
    kr_stage_advance(&stage, 4000000, INT64_MAX);
    for (int k = 1; k <= 20; k++) {
        kr_top *top = NULL;
        IS(kr_top_create(&scene, extrap, config, &top) == KR_OK);
        IS(kr_top_advance(top, k * 0.2) == KR_OK);
        scene.start = kr_top_state(top);
        kr_top_free(top);
    }
    IS(same(scene.start, stage.actor[1].now));
    IS(stage.actor[0].steps == 400 && kr_stage_measure(&stage, 1).error > 1e-9);
    IS(kr_stage_measure(&stage, 1).error < 1e-4 && kr_stage_measure(&stage, 2).error < 1e-4);
}
static void test_any_division_is_the_same(void)
{
    int64_t t = 0;
    set(&stage, eps1, eps2);
    set(&other, eps1, eps2);
    kr_stage_advance(&stage, 20000000, INT64_MAX);
    for (unsigned i = 1; t < 20000000; i++) {
        t += (int64_t)(i * 2654435761u % 99991u);
        kr_stage_advance(&other, t < 20000000 ? t : 20000000, i % 3 ? 5 : INT64_MAX);
    }
    kr_stage_advance(&other, 20000000, INT64_MAX);
    IS(stage.clock == other.clock && stage.rows == other.rows);
    for (int i = 0; i < stage.tops; i++) IS(same(stage.actor[i].now, other.actor[i].now));
    for (int64_t r = 0; r < stage.rows; r++)
        IS(memcmp(&stage.row[r], &other.row[r], sizeof(kr_row)) == 0);
}
/* Off the grid the two stand at different times: no error is to be had there, and none is
 * recorded. */
static void test_compares_at_common_multiples_only(void)
{
    set(&stage, eps1, eps2);
    IS(stage.common == 70000);
    kr_stage_advance(&stage, 80000, INT64_MAX);
    IS(stage.clock == 80000 && stage.actor[0].steps == 8 && stage.actor[1].steps == 1);
    IS(isnan(kr_stage_measure(&stage, 1).error) && isnan(kr_stage_measure(&stage, 0).error));
    IS(kr_stage_measure(&stage, 1).energy > 0.0);
    kr_stage_advance(&stage, 50000000, INT64_MAX);
    for (int64_t row = 0; row < stage.rows; row++) {
        NEAR(fmod(stage.row[row].time + 1e-9, 0.07), 0.0, 2e-9);
        IS(stage.row[row].at[1].error < 0.1 && stage.row[row].at[2].error < 0.01);
    }
    IS(stage.row[stage.rows - 1].at[1].error > 1e-4);
}
static void test_record_is_bounded(void)
{
    set(&stage, eps1, eps1);
    kr_stage_advance(&stage, 100000000, INT64_MAX); /* 10,000 steps */
    IS(stage.rows > KR_STAGE_ROWS / 2 && stage.rows <= KR_STAGE_ROWS);
    IS(stage.stride == 16 * stage.common);
    for (int64_t row = 0; row < stage.rows; row++)
        NEAR(stage.row[row].time, 0.16 * (double)row, 1e-12);
    NEAR(stage.row[stage.rows - 1].at[2].energy, stage.row[0].at[2].energy, 1e-7);
}
/* Between two rows the energy swings many times. What it swings to is in the record all the
 * same. */
static void test_extremes_are_not_lost(void)
{
    const kr_scene scene = kr_scene_default();
    double low = INFINITY, high = -INFINITY, all_low = INFINITY, all_high = -INFINITY;
    kr_stage_clear(&stage);
    IS(kr_stage_add(&stage, &scene, kr_method_find("bobenko_suris"), eps1, 0.0, -1) == KR_OK);
    /* 8: one swing, each step of it in the record */
    kr_stage_advance(&stage, 8000000, INT64_MAX);
    for (int64_t k = 0; k < stage.rows; k++) {
        IS(stage.row[k].low[0].energy == stage.row[k].at[0].energy &&
           isnan(stage.row[k].high[0].error));
        all_low = fmin(all_low, stage.row[k].at[0].energy),
        all_high = fmax(all_high, stage.row[k].at[0].energy);
    }
    /* 20,000: rows 20.48 apart, more than two swings */
    kr_stage_advance(&stage, 20000000000, INT64_MAX);
    IS(stage.stride == 2048 * stage.common);
    for (int64_t k = 1; k < stage.rows; k++) {
        const kr_row *row = &stage.row[k];
        IS(row->low[0].energy <= row->at[0].energy && row->at[0].energy <= row->high[0].energy);
        NEAR(row->low[0].energy, all_low, 0.02 * (all_high - all_low));
        NEAR(row->high[0].energy, all_high, 0.02 * (all_high - all_low));
        low = fmin(low, row->at[0].energy), high = fmax(high, row->at[0].energy);
    }
    IS(high - low > 0.5 * (all_high - all_low));
}
static void test_common_multiples(void)
{
    static const int64_t of[][3] = {
        {10000, 200000, 200000}, {30000, 200000, 600000}, {70000, 200000, 1400000}};
    for (int i = 0; i < 3; i++) {
        set(&stage, of[i][0], of[i][1]);
        IS(stage.common == of[i][2]);
    }
}
static void test_track(void)
{
    const kr_scene scene = kr_scene_default();
    static kr_state track[51];
    kr_top *top = NULL;
    const kr_config config = {.step = 0.1};
    IS(kr_top_create(&scene, kr_method_find("strang"), config, &top) == KR_OK);
    track[0] = scene.start;
    for (int k = 1; k <= 50; k++) {
        IS(kr_top_step(top) == KR_OK);
        track[k] = kr_top_state(top);
    }
    kr_top_free(top);
    kr_stage_clear(&stage);
    IS(kr_stage_add(&stage, &scene, kr_method_find("strang"), 100000, 0.0, -1) == KR_OK);
    IS(kr_stage_add_track(&stage, &scene, track, 51, 100000, 0) == KR_OK);
    kr_stage_advance(&stage, 5000000, INT64_MAX);
    IS(kr_stage_measure(&stage, 1).error == 0.0 && same(stage.actor[1].now, track[50]));
    /* past its end: it stays, the other goes on */
    kr_stage_advance(&stage, 6000000, INT64_MAX);
    IS(stage.actor[1].status == KR_ERR_LIMIT && isnan(kr_stage_measure(&stage, 1).energy));
    IS(stage.actor[0].steps == 60);
}
static void test_refusals(void)
{
    kr_scene scene = kr_scene_default();
    const kr_method *method = kr_method_find("rk4");
    kr_stage_clear(&stage);
    IS(kr_stage_add(&stage, &scene, NULL, eps1, 0.0, -1) == KR_ERR_ARGUMENT);
    IS(kr_stage_add(&stage, &scene, method, 0, 0.0, -1) == KR_ERR_ARGUMENT);
    IS(kr_stage_add(&stage, &scene, method, eps1, 0.0, 0) == KR_ERR_ARGUMENT);
    IS(kr_stage_add_track(&stage, &scene, NULL, 1, eps1, -1) == KR_ERR_ARGUMENT);
    scene.body.inertia.x = -1.0;
    IS(kr_stage_add(&stage, &scene, method, eps1, 0.0, -1) == KR_ERR_BODY);
    IS(stage.tops == 0 && kr_stage_advance(&stage, 1000000, INT64_MAX) == 0);
    scene = kr_scene_default();
    for (int i = 0; i < KR_STAGE_TOPS; i++)
        IS(kr_stage_add(&stage, &scene, method, eps1, 0.0, -1) == KR_OK);
    IS(kr_stage_add(&stage, &scene, method, eps1, 0.0, -1) == KR_ERR_ARGUMENT);
}
/* One that fails stays at its last good state; the others go on. */
static void test_failure(void)
{
    kr_scene scene = kr_scene_default();
    kr_stage_clear(&stage);
    IS(kr_stage_add(&stage, &scene, kr_method_find("bobenko_suris"), 1000000, 0.0, -1) == KR_OK);
    scene.start.m = (kr_vec3){1e3, -2e3, 1e3};
    IS(kr_stage_add(&stage, &scene, kr_method_find("rk4"), 1000000, 0.0, -1) == KR_OK);
    IS(kr_stage_advance(&stage, 1000000000, INT64_MAX) == 1000000000);
    IS(stage.actor[1].status == KR_ERR_NOT_FINITE && isfinite(stage.actor[1].now.q.w));
    IS(stage.actor[0].status == KR_OK && stage.actor[0].steps == 1000);
}

int main(void)
{
    test_states();
    test_restarts();
    test_any_division_is_the_same();
    test_compares_at_common_multiples_only();
    test_record_is_bounded();
    test_extremes_are_not_lost();
    test_common_multiples();
    test_track();
    test_refusals();
    test_failure();
    kr_stage_clear(&stage);
    kr_stage_clear(&other);
    return check_result();
}
