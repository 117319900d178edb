/* The viewer's simulation: tops with a common time that is counted in ticks. */
#include "viewer/simulation.h"
#include "tops.h"

static kr_simulation stage, other;
static const int64_t step1 = 10000, step2 = 70000; /* 0.01, 0.07; the common multiple is 0.07 */

static void set(kr_simulation *s, int64_t first, int64_t second)
{
    const kr_scene scene = kr_scene_default();
    kr_simulation_clear(s);
    IS(kr_simulation_add(s, &scene, kr_method_find("bobenko_suris"), first, 0.0, -1) == KR_OK);
    IS(kr_simulation_add(s, &scene, kr_method_find("bobenko_suris"), second, 0.0, 0) == KR_OK);
    IS(kr_simulation_add(s, &scene, kr_method_find("extrap"), second, 1e-10, 0) == KR_OK);
}

/* Returns the index of the measure of this quantity. */
static int number_of(const char *name)
{
    int k = 0;
    while (k < KR_SIMULATION_ERROR && kr_simulation_quantity(k) != kr_quantity_find(name)) k++;
    IS(k < KR_SIMULATION_ERROR);
    return k;
}
static double measured(int i, int k)
{
    double measure[KR_SIMULATION_MEASURES];
    kr_simulation_measure(&stage, i, measure);
    return measure[k];
}

/* The states are bitwise equal to those of a separate top. */
static void test_states(void)
{
    const kr_scene scene = kr_scene_default();
    const kr_config config = {.step = 0.07};
    kr_state alone;
    set(&stage, step1, step2);
    IS(kr_simulation_advance(&stage, 7000000, INT64_MAX) == 7000000);
    kr_top *top = make(&scene, kr_method_find("bobenko_suris"), config);
    IS(kr_top_advance(top, 100 * 0.07) == KR_OK);
    alone = kr_top_state(top);
    IS(same(alone, stage.slots[1].now));
    IS(memcmp(&stage.slots[1].attitudes[100], &alone.q, sizeof alone.q) == 0);
    IS(stage.slots[0].steps == 700 && stage.slots[1].steps == 100 && stage.slots[2].steps == 100);
    kr_top_free(top);
}
static void test_any_division_is_the_same(void)
{
    int64_t t = 0;
    set(&stage, step1, step2);
    set(&other, step1, step2);
    kr_simulation_advance(&stage, 20000000, INT64_MAX);
    for (unsigned i = 1; t < 20000000; i++) {
        t += (int64_t)(i * 2654435761u % 99991u);
        kr_simulation_advance(&other, t < 20000000 ? t : 20000000, i % 3 ? 5 : INT64_MAX);
    }
    kr_simulation_advance(&other, 20000000, INT64_MAX);
    IS(stage.clock == other.clock && stage.rows == other.rows);
    for (int i = 0; i < stage.count; i++) IS(same(stage.slots[i].now, other.slots[i].now));
    for (int64_t r = 0; r < stage.rows; r++)
        IS(memcmp(&stage.record[r], &other.record[r], sizeof(kr_record_row)) == 0);
}
/* Between common multiples of their steps the tops are at different times. No error is defined
 * at these times, and none is recorded. */
static void test_compares_at_common_multiples_only(void)
{
    set(&stage, step1, step2);
    IS(stage.common == 70000);
    kr_simulation_advance(&stage, 80000, INT64_MAX);
    IS(stage.clock == 80000 && stage.slots[0].steps == 8 && stage.slots[1].steps == 1);
    IS(isnan(measured(1, KR_SIMULATION_ERROR)) && isnan(measured(0, KR_SIMULATION_ERROR)));
    IS(measured(1, number_of("energy")) > 0.0);
    kr_simulation_advance(&stage, 50000000, INT64_MAX);
    for (int64_t row = 0; row < stage.rows; row++) {
        NEAR(fmod(stage.record[row].time + 1e-9, 0.07), 0.0, 2e-9);
        IS(stage.record[row].at[1][KR_SIMULATION_ERROR] < 0.1 &&
           stage.record[row].at[2][KR_SIMULATION_ERROR] < 0.01);
    }
    IS(stage.record[stage.rows - 1].at[1][KR_SIMULATION_ERROR] > 1e-4);
}
/* The measures are exactly the quantities with one component that do not depend on the heading. */
static void test_measures_are_those_of_the_table(void)
{
    int k = 0;
    for (size_t i = 0; kr_quantity_at(i); i++) {
        const kr_quantity *quantity = kr_quantity_at(i);
        if (quantity->doubles > 1 || quantity->flags & KR_QUANTITY_TURNS) continue;
        IS(kr_simulation_quantity(k++) == quantity);
    }
    IS(k == KR_SIMULATION_ERROR && kr_simulation_quantity(k) == NULL);
    IS(KR_SIMULATION_MODIFIED == k + 1 && KR_SIMULATION_MEASURES == k + 2);
}
/* Only bobenko_suris has a modified energy, which it conserves; the energy itself oscillates. */
static void test_modified_energy(void)
{
    const double own_step = (double)step2 / KR_SIMULATION_TICKS;
    set(&stage, step1, step2);
    const double start = measured(1, KR_SIMULATION_MODIFIED);
    kr_simulation_advance(&stage, 7000000, INT64_MAX);
    const kr_simulation_slot *actor = &stage.slots[1];
    const double now = measured(1, KR_SIMULATION_MODIFIED);
    IS(now == kr_state_modified_energy(&actor->scene, &actor->now, own_step, 1));
    IS(fabs(now - start) < 1e-12 * fabs(start) && isnan(measured(2, KR_SIMULATION_MODIFIED)));
    IS(now != measured(0, KR_SIMULATION_MODIFIED));
}
static void test_record_is_bounded(void)
{
    const int energy = number_of("energy");
    set(&stage, step1, step1);
    kr_simulation_advance(&stage, 100000000, INT64_MAX); /* 10,000 steps */
    IS(stage.rows > KR_SIMULATION_ROWS / 2 && stage.rows <= KR_SIMULATION_ROWS);
    IS(stage.stride == 16 * stage.common);
    for (int64_t row = 0; row < stage.rows; row++)
        NEAR(stage.record[row].time, 0.16 * (double)row, 1e-12);
    NEAR(stage.record[stage.rows - 1].at[2][energy], stage.record[0].at[2][energy], 1e-7);
}
/* Energy and nutation oscillate more than twice between two rows, but the record contains their
 * extremes. Those of the nutation are approximate, because it is sampled less often. */
static void test_extremes_are_not_lost(const char *name, double share)
{
    const kr_scene scene = kr_scene_default();
    const int what = number_of(name);
    double low = INFINITY, high = -INFINITY, all_low = INFINITY, all_high = -INFINITY;
    kr_simulation_clear(&stage);
    IS(kr_simulation_add(&stage, &scene, kr_method_find("bobenko_suris"), step1, 0.0, -1) == KR_OK);
    /* up to 8: one oscillation, with each step in the record */
    kr_simulation_advance(&stage, 8000000, INT64_MAX);
    for (int64_t k = 0; k < stage.rows; k++) {
        const double at = stage.record[k].at[0][what];
        IS(stage.record[k].low[0][what] == at &&
           isnan(stage.record[k].high[0][KR_SIMULATION_ERROR]));
        all_low = fmin(all_low, at), all_high = fmax(all_high, at);
    }
    /* up to 20,000: rows are 20.48 apart, more than two oscillations */
    kr_simulation_advance(&stage, 20000000000, INT64_MAX);
    IS(stage.stride == 2048 * stage.common);
    for (int64_t k = 1; k < stage.rows; k++) {
        const double at = stage.record[k].at[0][what], tol = share * (all_high - all_low);
        IS(stage.record[k].low[0][what] <= at && at <= stage.record[k].high[0][what]);
        NEAR(stage.record[k].low[0][what], all_low, tol);
        NEAR(stage.record[k].high[0][what], all_high, tol);
        low = fmin(low, at), high = fmax(high, at);
    }
    IS(high - low > 0.5 * (all_high - all_low));
}
static void test_track(void)
{
    const kr_scene scene = kr_scene_default();
    static kr_state track[51];
    const kr_config config = {.step = 0.1};
    kr_top *top = make(&scene, kr_method_find("strang"), config);
    track[0] = scene.start;
    for (int k = 1; k <= 50; k++) {
        IS(kr_top_step(top) == KR_OK);
        track[k] = kr_top_state(top);
    }
    kr_top_free(top);
    kr_simulation_clear(&stage);
    IS(kr_simulation_add(&stage, &scene, kr_method_find("strang"), 100000, 0.0, -1) == KR_OK);
    IS(kr_simulation_add_track(&stage, &scene, track, 51, 100000, 0) == KR_OK);
    kr_simulation_advance(&stage, 5000000, INT64_MAX);
    IS(measured(1, KR_SIMULATION_ERROR) == 0.0 && same(stage.slots[1].now, track[50]));
    /* beyond the end of one top: it stops, and the other continues */
    kr_simulation_advance(&stage, 6000000, INT64_MAX);
    IS(stage.slots[1].status == KR_ERR_LIMIT && isnan(measured(1, number_of("energy"))));
    IS(stage.slots[0].steps == 60);
}
static void test_refusals(void)
{
    kr_scene scene = kr_scene_default();
    const kr_method *method = kr_method_find("rk4");
    kr_simulation_clear(&stage);
    IS(kr_simulation_add(&stage, &scene, NULL, step1, 0.0, -1) == KR_ERR_NO_METHOD);
    IS(kr_simulation_add(&stage, &scene, method, 0, 0.0, -1) == KR_ERR_ARGUMENT);
    IS(kr_simulation_add(&stage, &scene, method, step1, 0.0, 0) == KR_ERR_ARGUMENT);
    IS(kr_simulation_add(&stage, &scene, method, step1, 0.0, -3) == KR_ERR_ARGUMENT);
    IS(kr_simulation_add(&stage, &scene, method, INT64_MAX, 0.0, -1) == KR_ERR_ARGUMENT);
    IS(kr_simulation_add(&stage, &scene, method, step1, NAN, -1) == KR_ERR_ARGUMENT);
    IS(kr_simulation_add_track(&stage, &scene, NULL, 1, step1, -1) == KR_ERR_ARGUMENT);
    IS(kr_simulation_add_track(&stage, &scene, &scene.start, 0, step1, -1) == KR_ERR_ARGUMENT);
    IS(kr_simulation_add_track(&stage, &scene, &scene.start, 1, 0, -1) == KR_ERR_ARGUMENT);
    scene.start.t = 1.0;
    IS(kr_simulation_add(&stage, &scene, method, step1, 0.0, -1) == KR_ERR_ARGUMENT);
    scene.start.t = 0.0;
    scene.body.inertia.x = -1.0;
    IS(kr_simulation_add(&stage, &scene, method, step1, 0.0, -1) == KR_ERR_BODY);
    IS(stage.count == 0 && kr_simulation_advance(&stage, 1000000, INT64_MAX) == 0);
    scene = kr_scene_default();
    for (int i = 0; i < KR_SIMULATION_TOPS; i++)
        IS(kr_simulation_add(&stage, &scene, method, step1, 0.0, -1) == KR_OK);
    IS(kr_simulation_add(&stage, &scene, method, step1, 0.0, -1) == KR_ERR_ARGUMENT);
    kr_simulation_clear(&stage);
    IS(kr_simulation_add(&stage, &scene, method, step1, 0.0, -1) == KR_OK);
    IS(kr_simulation_advance(&stage, step1, INT64_MAX) == step1);
    IS(kr_simulation_add(&stage, &scene, method, step1, 0.0, -1) == KR_ERR_ARGUMENT);
}
/* Steps whose common multiple no clock counts have no common times, and no record. */
static void test_steps_without_a_common_multiple(void)
{
    const kr_scene scene = kr_scene_default();
    kr_simulation_clear(&stage);
    for (int i = 0; i < 4; i++)
        IS(kr_simulation_add(&stage, &scene, taylor(), INT32_MAX - 2 * i, 0.0, -1) == KR_OK);
    IS(stage.common == 0 && stage.rows == 0);
}
/* A top that fails stays at its last valid state; the others continue. */
static void test_failure(void)
{
    kr_scene scene = kr_scene_default();
    kr_simulation_clear(&stage);
    IS(kr_simulation_add(&stage, &scene, kr_method_find("bobenko_suris"), 1000000, 0.0, 1) ==
       KR_OK);
    scene.start.m = (kr_vec3){1e3, -2e3, 1e3};
    IS(kr_simulation_add(&stage, &scene, kr_method_find("rk4"), 1000000, 0.0, -1) == KR_OK);
    IS(kr_simulation_advance(&stage, 1000000000, INT64_MAX) == 1000000000);
    IS(stage.slots[1].status == KR_ERR_NOT_FINITE && isfinite(stage.slots[1].now.q.w));
    IS(stage.slots[0].status == KR_OK && stage.slots[0].steps == 1000);
    IS(isnan(measured(0, KR_SIMULATION_ERROR)));
}
/* A reference may be added after the top that is compared with it. A reference does not continue
 * alone. */
static void test_truth(void)
{
    kr_scene scene = tilted();
    const kr_method *strang = kr_method_find("strang"), *taylor = kr_method_find("taylor");
    kr_simulation_clear(&stage);
    IS(kr_simulation_add(&stage, &scene, strang, 100000, 0.0, 1) == KR_OK);
    IS(isnan(measured(0, KR_SIMULATION_ERROR)));
    IS(kr_simulation_add(&stage, &scene, taylor, 100000, 0.0, KR_SIMULATION_REFERENCE) == KR_OK);
    IS(measured(0, KR_SIMULATION_ERROR) == 0.0);
    IS(kr_simulation_advance(&stage, 1000000, INT64_MAX) == 1000000);
    const double error = kr_attitude_error(stage.slots[0].now.q, stage.slots[1].now.q);
    IS(error > 0.0 && measured(0, KR_SIMULATION_ERROR) == error);
    IS(isnan(measured(1, KR_SIMULATION_ERROR)));
    kr_simulation_clear(&stage);
    IS(kr_simulation_add_track(&stage, &scene, &scene.start, 1, 100000, 1) == KR_OK);
    IS(kr_simulation_add(&stage, &scene, taylor, 100000, 0.0, KR_SIMULATION_REFERENCE) == KR_OK);
    IS(kr_simulation_advance(&stage, 1000000, INT64_MAX) <= 100000);
    IS(stage.slots[0].status == KR_ERR_LIMIT && stage.slots[1].steps <= 1);
}
/* A top that is too fast for its step does not block the caller, and reaches its time
 * eventually. */
static void test_step_budget(void)
{
    kr_scene scene = tilted();
    const char *const methods[] = {"taylor", "extrap"};
    for (int i = 0; i < 2; i++) {
        const kr_method *method = kr_method_find(methods[i]);
        int calls = 0, late = 0;
        kr_simulation_clear(&stage);
        scene.start.m = v3(0.0, 0.0, 1e12);
        IS(kr_simulation_add(&stage, &scene, method, 1000000, 0.0, -1) == KR_OK);
        IS(kr_simulation_advance(&stage, 1000000, INT64_C(100)) == 0 && stage.is_late);
        /* After a call without work, no top counts as late. */
        IS(kr_simulation_advance(&stage, 0, 1) == 0 && !stage.is_late);
        IS(kr_top_describe(stage.slots[0].top).stats.steps <=
           KR_SIMULATION_BUDGET + 100 * KR_SIMULATION_BUDGET_PER_STEP + 256);
        kr_simulation_clear(&stage);
        scene.start.m = v3(0.0, 0.0, 1e5);
        IS(kr_simulation_add(&stage, &scene, method, 1000000, 0.0, -1) == KR_OK);
        for (; stage.clock < 1000000 && calls < 1000; calls++) {
            IS(kr_simulation_advance(&stage, 1000000, 1) == (stage.is_late ? 0 : 1000000));
            late += stage.is_late;
        }
        IS(late > 0 && late == calls - 1 && stage.slots[0].steps == 1);
        IS(same(stage.slots[0].now, state_at(1.0, &scene, method, (kr_config){0})));
    }
}

static double height(const kr_state *s)
{
    const kr_scene scene = kr_scene_default();
    return kr_state_apex(&scene, s).z;
}
/* A top ends at its last state above the floor. Another top goes on. */
static void test_floor(void)
{
    const kr_scene scene = kr_scene_default();
    const kr_method *method = kr_method_find("exact");
    const double lowest = 0.3;
    kr_simulation_set_floor(&other, lowest); /* no top yet */
    kr_simulation_clear(&stage);
    IS(kr_simulation_add(&stage, &scene, method, step1, 0.0, -1) == KR_OK);
    kr_simulation_set_floor(&stage, lowest);
    IS(kr_simulation_add(&stage, &scene, method, step2, 0.0, -1) == KR_OK);
    kr_simulation_advance(&stage, 70 * step2, INT64_MAX);
    const kr_simulation_slot *down = &stage.slots[0];
    const double last = (double)down->steps * 0.01, next = last + 0.01;
    const kr_state after = state_at(next, &scene, method, (kr_config){0}),
                   end = state_at(down->stood, &scene, method, (kr_config){0});
    IS(down->is_down && down->status == KR_OK && down->now.t == last);
    IS(height(&down->now) >= lowest && height(&after) < lowest);
    IS(down->stood > last && down->stood < next);
    NEAR(height(&end), lowest, 1e-4);
    IS(stage.slots[1].steps == 70 && !stage.slots[1].is_down && isnan(stage.slots[1].stood));
    IS(kr_simulation_advance(&stage, 80 * step2, INT64_MAX) == 80 * step2);
    IS((double)down->steps * 0.01 == last);
}

int main(void)
{
    test_floor();
    test_truth();
    test_step_budget();
    test_states();
    test_any_division_is_the_same();
    test_compares_at_common_multiples_only();
    test_measures_are_those_of_the_table();
    test_modified_energy();
    test_record_is_bounded();
    test_extremes_are_not_lost("energy", 0.02);
    test_extremes_are_not_lost("nutation", 0.1);
    test_track();
    test_refusals();
    test_steps_without_a_common_multiple();
    test_failure();
    kr_simulation_clear(&stage);
    kr_simulation_clear(&other);
    return check_result();
}
