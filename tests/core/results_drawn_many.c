/* Prints what comes of drawn tops that are moved together, by workers and on a stage, and of their
 * pictures, a few in a line. results_drawn_many.txt is what it printed when results were last meant
 * to change. With the word "full" it prints the numbers. */
#include "draws.h"
#include "page/picture.h"
#include "page/stage.h"

enum { TOPS = 20, TIMES = 6, KEPT = 5 };
static kr_config drawn_config(const kr_method *method)
{
    static const double tolerances[6] = {0.0, 0.0, 0.0, 1e-13, 1e-4, 0.03125};
    static const int64_t limits[4] = {5000, 400, 3, 40};
    const unsigned flags = method ? kr_method_flags(method) : 0;
    const int rounds_anyhow =
        !method || flags & KR_DIGITS; /* so that steps may be a little other */
    kr_config config = {.step = chance(50) ? 0.125 : -0.0625};
    config.tol = of_few(rounds_anyhow ? 4 : 6, tolerances);
    config.max_steps = limits[draw(rounds_anyhow ? 1 : 4)];
    if (!method || (flags & KR_ADAPTIVE && chance(70))) config.step = 0.0;
    if (!(flags & KR_DIGITS)) return config;
    config.leave_heading = chance(30);
    if (chance(10)) {
        config.digits = 20;
        config.tol = 0.0;
    }
    return config;
}
/* Tops of any kind, or all alike but for a little; some of them none at all. */
static void drawn_tops(size_t n, kr_scene scenes[])
{
    const int alike = chance(40);
    for (size_t i = 0; i < n; i++) {
        scenes[i] = alike && i > 0 ? scenes[0] : ordinary_scene();
        if (alike) scenes[i].start.m.x *= 1.0 + 0.0625 * (double)i;
        if (chance(3)) scenes[i].body.mass = NAN;
        if (chance(3)) scenes[i].start.m.y = INFINITY;
    }
}
/* The pace of the fastest that is one. */
static double least_pace(size_t n, const kr_scene scenes[])
{
    double pace = 1.0;
    for (size_t i = 0; i < n; i++)
        if (kr_scene_check(&scenes[i]) == KR_OK) pace = fmin(pace, pace_of(&scenes[i]));
    return pace;
}
/* For each top times on one side of its start, some alike, or one row of times for all. */
static int drawn_times(size_t n, size_t times, const kr_scene scenes[], double t[])
{
    const int own = chance(60);
    const double way = chance(50) ? 0.5 : -0.75, least = least_pace(n, scenes);
    for (size_t i = 0; i < (own ? n : 1); i++) {
        const double pace = own ? pace_of(&scenes[i]) : least;
        double at = scenes[i].start.t;
        for (size_t k = 0; k < times; k++) {
            at += chance(15) ? 0.0 : way * pace * uniform(0.0, 2.0);
            if (chance(1)) at = -at;
            t[i * times + k] = at;
        }
        if (chance(5)) t[i * times + times - 1] = scenes[i].start.t; /* ahead is no side of it */
    }
    return own;
}
/* What does not turn at once where the apex is upright, nor comes twice as large or small. */
static void drawn_reductions(kr_reduction kept[KEPT])
{
    static const char *const names[4] = {"apex", "velocity", "energy", "potential"};
    static const kr_reduce kinds[4] = {KR_REDUCE_MIN, KR_REDUCE_MAX, KR_REDUCE_MEAN,
                                       KR_REDUCE_LAST};
    for (int i = 0; i < KEPT; i++) {
        const kr_quantity *quantity = kr_quantity_find(names[draw(4)]);
        const size_t component = draw(kr_quantity_doubles(quantity));
        kept[i] = (kr_reduction){quantity, component, kinds[draw(4)]};
    }
}
static void tell_outcomes(const kr_tops *tops)
{
    for (size_t i = 0; i < tops->n; i++) {
        const kr_outcome *outcome = &tops->outcomes[i];
        put("%d", (int)outcome->done);
        tell_status(outcome->status);
        if (kr_scene_check(&tops->scenes[i]) != KR_OK || outcome->status == KR_ERR_LIMIT) continue;
        tell_state(&tops->scenes[i], &outcome->last);
        for (size_t k = 0; tops->states && k < tops->times; k++)
            tell_state(&tops->scenes[i], &tops->states[i * tops->times + k]);
    }
}
static void a_worker(void)
{
    static const char *const names[6] = {"taylor",        "taylor", "strang",
                                         "bobenko_suris", "extrap", "exact"};
    kr_scene scenes[TOPS];
    kr_state states[TOPS * TIMES] = {{0}};
    kr_outcome outcomes[TOPS];
    kr_reduction kept[KEPT];
    double t[TOPS * TIMES], reduced[TOPS * KEPT];
    kr_worker *worker = NULL;
    const kr_method *method = chance(25) ? NULL : kr_method_find(names[draw(6)]);
    const size_t n = 1 + draw(TOPS), times = 1 + draw(TIMES);
    const kr_config config = drawn_config(method);
    drawn_tops(n, scenes);
    drawn_reductions(kept);
    const int own = drawn_times(n, times, scenes, t), states_too = chance(70);
    const kr_status status = kr_worker_create(method, config, KEPT, kept, &worker);
    tell_status(status);
    if (status != KR_OK) return;
    kr_tops tops = {n,       scenes,   times, t,   own, states_too ? states : NULL,
                    reduced, outcomes, NULL,  NULL};
    tell_status(kr_worker_run(worker, &tops));
    tell_outcomes(&tops);
    for (size_t i = 0; i < n * KEPT; i++) tell_beside(1.0, reduced[i]);
    kr_worker_free(worker);
}
/* How tangents of drawn tops grow: but one number near none is near a rounding. */
static void a_growth(void)
{
    kr_scene scenes[TOPS];
    kr_outcome outcomes[TOPS];
    double t[TOPS * TIMES], out[TOPS * TIMES * KR_GROWTH_COUNT], direction[6];
    kr_worker *worker = NULL;
    const size_t n = 1 + draw(TOPS), times = 1 + draw(TIMES);
    kr_config config = drawn_config(kr_method_find("taylor"));
    config.tangents = KR_TANGENT_GROWTH;
    drawn_tops(n, scenes);
    const int own = drawn_times(n, times, scenes, t);
    for (int i = 0; i < 6; i++) direction[i] = simple();
    const kr_status status = kr_worker_create(kr_method_find("taylor"), config, 0, NULL, &worker);
    tell_status(status);
    if (status != KR_OK) return;
    kr_tops tops = {n,    scenes, times,    t,   own,
                    NULL, NULL,   outcomes, out, chance(50) ? direction : NULL};
    tell_status(kr_worker_run(worker, &tops));
    tell_outcomes(&tops);
    for (size_t i = 0; i < n * times; i++)
        for (int k = 0; k <= KR_GROWTH_MOST; k++)
            tell_beside(1.0, out[i * KR_GROWTH_COUNT + (size_t)k]);
    kr_worker_free(worker);
}
static void a_section(void)
{
    static const char *const names[6] = {"apex_x",          "apex_z", "body_velocity_y",
                                         "body_velocity_x", "m_x",    "q_w"};
    kr_scene scenes[TOPS];
    kr_state states[TOPS * TIMES] = {{0}};
    kr_outcome outcomes[TOPS];
    kr_worker *worker = NULL;
    const int of = kr_component_find(names[draw(6)]), times = kr_component_find(names[draw(6)]),
              extremum = chance(25), direction = (int)draw(3) - 1, bounded = chance(30);
    const kr_term terms[2] = {{1.0, of, chance(80) ? KR_ONE : times},
                              {uniform(-0.5, 0.5), KR_ONE, KR_ONE}},
                  where = {1.0, times, KR_ONE};
    const size_t n = 1 + draw(TOPS), most = 1 + draw(TIMES);
    const kr_event event = {terms,     &where,         2, bounded ? 1 : 0, extremum,
                            direction, {0, 0, 0, 0, 0}};
    const kr_config config = drawn_config(kr_method_find("taylor"));
    drawn_tops(n, scenes);
    const double longest = least_pace(n, scenes) * (chance(50) ? 9.0 : -6.0);
    const kr_status status = kr_worker_create(kr_method_find("taylor"), config, 0, NULL, &worker);
    tell_status(status);
    if (status != KR_OK) return;
    const kr_tops tops = {n, scenes, most, &longest, 0, states, NULL, outcomes, NULL, NULL};
    tell_status(kr_worker_section(worker, &event, &tops));
    tell_outcomes(&tops);
    kr_worker_free(worker);
}

static kr_stage stage;
static void add_tops(void)
{
    static kr_state track[40];
    const int count = 1 + (int)draw(5);
    for (int i = 0; i < 40; i++) track[i] = (kr_state){0.125 * i, drawn_attitude(), {1, 2, i}};
    for (int i = 0; i < count; i++) {
        const kr_method *method = drawn_method();
        const int64_t step = 10000 * (int64_t)(1 + draw(6)) * (1 + 2 * chance(20));
        const int against = (int)draw(5) - 2;
        kr_scene s = drawn_scene();
        const double tol = kr_method_flags(method) & KR_DENSE || chance(50) ? 0.0 : 1e-6;
        if (chance(95)) s.start.t = 0.0;
        if (!kr_method_suits(method, &s)) method = kr_method_find("strang");
        if (chance(15))
            tell_status(kr_stage_add_track(&stage, &s, track, (int64_t)draw(41), step, against));
        else
            tell_status(kr_stage_add(&stage, &s, method, step, tol, against));
    }
}
static void tell_row(const kr_row *row)
{
    tell_beside(1.0, row->time);
    for (int i = 0; i < stage.tops; i++)
        for (int k = 0; k < KR_STAGE_MEASURES; k++) {
            tell_beside(1.0, row->at[i][k]);
            tell_beside(1.0, row->low[i][k]);
            tell_beside(1.0, row->high[i][k]);
        }
}
static void a_stage(void)
{
    kr_stage_clear(&stage);
    add_tops();
    for (int i = 0; i < 3; i++) {
        const int64_t target = stage.clock + (int64_t)draw(3000000), most = (int64_t)draw(200);
        put("%lld", (long long)kr_stage_advance(&stage, target, most));
        put(" %lld %d\n", (long long)stage.rows, stage.is_late);
    }
    for (int64_t i = 0; i < stage.rows; i += 7) tell_row(&stage.row[i]);
    for (int i = 0; i < stage.tops; i++) {
        double measures[KR_STAGE_MEASURES];
        tell_status(stage.actor[i].status);
        tell_state(&stage.actor[i].scene, &stage.actor[i].now);
        kr_stage_measure(&stage, i, measures);
        for (int k = 0; k < KR_STAGE_MEASURES; k++) tell_beside(1.0, measures[k]);
    }
}
/* So many steps to a row of the record that not all of them are looked at. */
static void a_long_stage(void)
{
    kr_stage_clear(&stage);
    for (int i = 0; i < 2; i++) {
        const kr_scene s = ordinary_scene();
        const kr_method *method = kr_method_find(i ? "suzuki4" : "strang");
        if (s.start.t == 0.0) tell_status(kr_stage_add(&stage, &s, method, 1000, 0.0, i - 1));
    }
    (void)kr_stage_advance(&stage, 120000000, 1000000);
    for (int64_t i = 0; i < stage.rows; i += 97) tell_row(&stage.row[i]);
}
static void tell_points(int n, float point[][3])
{
    put("%d\n", n);
    for (int i = 0; i < n; i += 1 + n / 9) {
        const double all[4] = {point[i][0], point[i][1], point[i][2], 100.0}; /* of a float */
        tell(4, all);
    }
}
static void a_picture(void)
{
    enum { LONGEST = 900 };
    static kr_quat attitude[LONGEST];
    static float points[KR_PICTURE_RINGS * KR_PICTURE_SIDES + KR_PICTURE_POINTS][3];
    static const double powers[4] = {0.0, 0.5, 1.0, 0.25};
    const kr_scene s = drawn_scene();
    const kr_trail trail = {attitude, LONGEST, (int64_t)draw(3) * (int64_t)draw(LONGEST), 0.0625};
    const kr_vec3 turn = v_scale(0.0625, simple_vec()), more = v_scale(0.03125, simple_vec());
    const kr_box box = kr_picture_box(&s.body);
    double reach[3] = {0.0, 0.0, 1.0};
    kr_quat q = s.start.q;
    for (int i = 0; i < LONGEST; i++) {
        attitude[i] = q;
        q = q_unit(q_mul(q_unit(q4(1.0, i % 40 < 20 ? turn : more)), q));
    }
    tell(3, &box.half.x);
    tell(3, &box.centre.x);
    tell(4, &box.turn.w);
    tell_beside(1.0, box.density);
    kr_picture_reach(&s, &reach[0], &reach[1]);
    tell(3, reach);
    tell_points(kr_picture_way(&s.body, &trail, uniform(0.5, 2.0), points), points);
    const double scale = uniform(0.1, 1.0), power = of_few(4, powers);
    tell_points(kr_picture_rod(&s.body, &trail, scale, 0.0625, power, points), points);
}
int main(int n, char **words)
{
    in_full = n > 1 && strcmp(words[1], "full") == 0;
    lines("worker", 30, 60, a_worker);
    lines("growth", 20, 30, a_growth);
    lines("section", 20, 45, a_section);
    lines("stage", 20, 20, a_stage);
    lines("long stage", 4, 1, a_long_stage);
    lines("picture", 10, 100, a_picture);
    all_is_said();
    return 0;
}
