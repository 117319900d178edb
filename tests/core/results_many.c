/* Prints what many tops come to that are moved together: how tangents grow, states, what is kept of
 * numbers, sections. results_many.txt is what it printed when results were last meant to change.
 * With the word "full" it prints the numbers. */
#include "numbers/su2.h"
#include "scenes.h"

enum { TOPS = 9, TIMES = 7 };

static kr_worker *worker_of(const char *method, kr_config config, size_t n,
                            const kr_reduction *kept)
{
    kr_worker *worker = NULL;
    const kr_method *found = method ? kr_method_find(method) : NULL;
    must(kr_worker_create(found, config, n, kept, &worker) == KR_OK, "no worker");
    return worker;
}
/* The tops beside a scene, and times. */
static void spread(const kr_scene *s, double step, kr_scene out[TOPS], double t[TIMES])
{
    for (int i = 0; i < TOPS; i++) {
        out[i] = *s;
        out[i].start.m.x *= 1.0 + 0.03125 * i;
    }
    for (int k = 0; k < TIMES; k++) t[k] = unit_of(s) * step * (k + 1);
}
static void say_outcomes(const kr_outcome outcomes[TOPS])
{
    for (int i = 0; i < TOPS; i++) {
        put("%s %d", kr_status_text(outcomes[i].status), (int)outcomes[i].done);
        say_counts(outcomes[i].stats);
        say_state(&outcomes[i].last);
    }
}
/* How tangents grow, forward and back, along directions of any size. */
static void growth(const kr_scene *s, const char *name)
{
    static const double directions[4][6] = {{1.0, 0.0, 0.0, 0.0, 0.0, 0.0},
                                            {3e-200, 0.0, 1e-200, 0.0, 2e-200, 0.0},
                                            {0.0, 2e180, 0.0, 1e180, 0.0, 0.0}};
    kr_scene scenes[TOPS];
    kr_outcome outcomes[TOPS];
    double t[TIMES], out[TOPS * TIMES * KR_GROWTH_COUNT];
    const kr_config config = {.tangents = KR_TANGENT_GROWTH, .tol = 0.0};
    kr_worker *worker = worker_of("taylor", config, 0, NULL);
    kr_tops tops = {TOPS, scenes, TIMES, t, .outcomes = outcomes, .growth = out};
    for (int which = 0; which < 4; which++) {
        tops.direction = which < 3 ? directions[which] : NULL;
        spread(s, which == 1 ? -1.0 : 1.5, scenes, t);
        headline("growth", name);
        put("%s\n", kr_status_text(kr_worker_run(worker, &tops)));
        for (int i = 0; i < TOPS; i++)
            for (int number = 0; number <= KR_GROWTH_MOST; number++) {
                double one[TIMES];
                for (int k = 0; k < TIMES; k++)
                    one[k] = out[(i * TIMES + k) * KR_GROWTH_COUNT + number];
                say(TIMES, one);
            }
        say_outcomes(outcomes);
    }
    kr_worker_free(worker);
}
/* States, and all that can be kept of two numbers. */
static void many(const kr_scene *s, const char *name, const char *method, kr_config config)
{
    kr_scene scenes[TOPS];
    kr_outcome outcomes[TOPS];
    kr_state states[TOPS * TIMES] = {0};
    kr_reduction kept[2 * KR_REDUCE_COUNT];
    double t[TIMES], reduced[TOPS * 2 * KR_REDUCE_COUNT];
    const kr_tops tops = {
        TOPS, scenes, TIMES, t, 0, states, .reduced = reduced, .outcomes = outcomes};
    spread(s, config.step < 0.0 ? -0.75 : 0.75, scenes, t);
    for (int i = 0; i < 2 * KR_REDUCE_COUNT; i++) {
        const kr_quantity *quantity = kr_quantity_find(i % 2 ? "apex" : "nutation");
        kept[i] = (kr_reduction){quantity, i % 2 ? 1 : 0, (kr_reduce)(i / 2)};
    }
    kr_worker *worker = worker_of(method, config, 2 * KR_REDUCE_COUNT, kept);
    headline(method ? method : "many", name);
    put("%s\n", kr_status_text(kr_worker_run(worker, &tops)));
    say_outcomes(outcomes);
    for (int i = 0; i < TOPS * TIMES; i += 3) say_state(&states[i]);
    for (int i = 0; i < TOPS * 2 * KR_REDUCE_COUNT; i++) say_one(reduced[i]);
    kr_worker_free(worker);
}
/* More states than are recorded at a time, of one top at a time. */
static void long_rows(const kr_scene *s, const char *name)
{
    enum { LONG = 150 };
    kr_outcome outcome;
    kr_state states[LONG] = {0};
    double t[LONG];
    const kr_config config = {.step = 0.03125 * unit_of(s), .max_steps = 3 * LONG};
    const kr_tops tops = {1, s, LONG, t, 0, states, .outcomes = &outcome};
    kr_worker *worker = worker_of("strang", config, 0, NULL);
    for (int k = 0; k < LONG; k++) t[k] = config.step * 1.75 * (k + 1);
    headline("long rows", name);
    must(kr_worker_run(worker, &tops) == KR_OK, "a worker that fails");
    put("%s %d\n", kr_status_text(outcome.status), (int)outcome.done);
    for (int k = 0; k < LONG; k += 7) say_state(&states[k]);
    kr_worker_free(worker);
}
/* Where the terms pass zero. */
static void section(const kr_scene *s, const char *name, const kr_term terms[2], int direction)
{
    const double most = (direction < 0 ? -20.0 : 20.0) * unit_of(s);
    const kr_event event = {.terms = terms, .count = 2, .direction = direction};
    kr_scene scenes[TOPS];
    kr_outcome outcomes[TOPS];
    kr_state states[TOPS * TIMES];
    double t[TIMES];
    const kr_config config = {0};
    kr_worker *worker = worker_of("taylor", config, 0, NULL);
    const kr_tops tops = {TOPS, scenes, TIMES, &most, 0, states, .outcomes = outcomes};
    spread(s, 1.0, scenes, t);
    headline("section", name);
    put("%s\n", kr_status_text(kr_worker_section(worker, &event, &tops)));
    say_outcomes(outcomes);
    for (int i = 0; i < TOPS; i++)
        for (size_t k = 0; k < outcomes[i].done; k++) say_state(&states[i * TIMES + (int)k]);
    kr_worker_free(worker);
}
/* The angular velocity about an axis passes zero; and a little less than the greatest height that
 * the apex has: twice in a short time. */
static void sections(const kr_scene *s, const char *name)
{
    const kr_term rest = {0.0, KR_ONE, KR_ONE},
                  still[2] = {{1.0, kr_component_find("body_velocity_x"), KR_ONE}, rest};
    kr_term high[2] = {{1.0, kr_component_find("apex_z"), KR_ONE}, rest};
    double most = -1.0, least = 1.0;
    kr_top *top = NULL;
    must(kr_top_create(s, kr_method_find("taylor"), (kr_config){0}, &top) == KR_OK, "no top");
    for (int i = 0; i < 500; i++) {
        const kr_state state = kr_top_state(top);
        const double z = kr_state_apex(s, &state).z;
        most = fmax(most, z);
        least = fmin(least, z);
        must(kr_top_advance(top, 0.02 * unit_of(s) * i) == KR_OK, "no way");
    }
    kr_top_free(top);
    for (int direction = -1; direction <= 1; direction++) {
        section(s, name, still, direction);
        for (int part = 0; part < 3; part++) {
            static const double below[3] = {0.01, 0.003, 0.1};
            high[1].factor = -(most - below[part] * (most - least));
            if (most - least > 1e-3) section(s, name, high, direction);
        }
    }
}
/* Tops that stand upright, exactly or almost, whether they sleep there or leave: the tangents grow
 * where the path does not, and the heading turns by much in a step. */
static void upright(const char *name, double spin, double tilt)
{
    const kr_config plain = {0}, back = {.step = -0.0625};
    kr_scene s = scene_of(2.0, 2.0, 1.0, v3(0.0, 0.0, 0.75), v3(0.0, 0.0, spin));
    s.start.q = q_exp(v3(tilt, 0.0, 0.0));
    growth(&s, name);
    if (tilt == 0.0) return; /* What stays alike is least and most at any time. */
    many(&s, name, NULL, plain);
    many(&s, name, "taylor", plain);
    many(&s, name, "strang", back);
}
int main(int n, char **words)
{
    in_full = n > 1 && strcmp(words[1], "full") == 0;
    for (int which = 0; which < SCENES; which++) {
        const char *name;
        const kr_scene s = scene_at(which, &name);
        const kr_config plain = {0}, headless = {.leave_heading = 1}, loose = {.tol = 1e-7},
                        digits = {.digits = 20}, fixed = {.step = 0.0625 * unit_of(&s)},
                        back = {.step = -0.0625 * unit_of(&s)}, least = {.max_steps = 1},
                        tolerances[5] = {{.tol = 1e-3},
                                         {.tol = 3e-6},
                                         {.tol = 1e-9},
                                         {.tol = 3e-12},
                                         {.tol = 1e-14}};
        growth(&s, name);
        many(&s, name, NULL, plain);
        many(&s, name, "taylor", plain);
        many(&s, name, "taylor", headless);
        many(&s, name, "taylor", loose);
        many(&s, name, "taylor", back);
        many(&s, name, "taylor", digits);
        many(&s, name, "strang", fixed);
        many(&s, name, "strang", back);
        many(&s, name, "taylor", least);
        for (int i = 0; i < 5; i++) many(&s, name, "taylor", tolerances[i]);
        long_rows(&s, name);
        sections(&s, name);
    }
    upright("sleeps", 24.0, 0.0);
    upright("wakes", 0.25, 0.0);
    upright("leaves", 0.25, 1e-7);
    upright("stays", 0.0, 0.0);
    all_is_said();
    return 0;
}
