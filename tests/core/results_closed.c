/* Prints what the closed forms come to: of tops of all kinds, at ordinary starts and beside every
 * special one. results_closed.txt is what it printed when results were last meant to change. With
 * the word "full" it prints the numbers. */
#include "random.h"
#include "scenes.h"

enum { STARTS = 40 };

static void closed(const kr_scene *s)
{
    enum { TIMES = 12 };
    static const double times[TIMES] = {-1e3, -40.0, -2.5, 0.0,  0.125, 1.0,
                                        7.0,  300.0, 1e4,  2e12, 1e14,  -3e15};
    const double unit = unit_of(s);
    double t[TIMES];
    kr_state states[TIMES];
    kr_exact exact;
    const kr_status status = kr_exact_plan(s, &exact);
    put("%s\n", kr_status_text(status));
    if (status != KR_OK) return;
    say_one(exact.period);
    say_one(exact.precession);
    say_one(exact.spin);
    for (int i = 0; i < TIMES; i++) t[i] = s->start.t + unit * times[i];
    kr_exact_states(&exact, TIMES, t, states);
    for (int i = 0; i < TIMES; i++) say_state(states + i);
}
static void turning(const kr_scene *s)
{
    kr_turning turning;
    const kr_status status = kr_exact_turning(s, &turning);
    put("%s\n", kr_status_text(status));
    if (status != KR_OK) return;
    put("%s\n", turning.course);
    say_one(turning.least);
    say_one(turning.greatest);
    say_one(turning.t_least);
    say_one(turning.t_greatest);
    say_one(turning.critical_spin);
    say_one(kr_turning_potential(&turning, 1.0));
}
static void mapped(const kr_scene *s, double step)
{
    static const int64_t steps[] = {-100000, -301, -1, 0, 1, 2, 77, 5000};
    kr_exact_map map;
    const kr_status status = kr_exact_map_plan(s, step, &map);
    put("%s\n", kr_status_text(status));
    if (status != KR_OK) return;
    say_one(map.curve.period);
    say_one(map.curve.precession);
    say_one(map.curve.spin);
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        const kr_state state = kr_exact_map_state(&map, steps[i]);
        say_state(&state);
    }
}
static void all_of(const kr_scene *s, const char *what, const char *name)
{
    headline(what, name);
    closed(s);
    turning(s);
    mapped(s, 0.03125 * unit_of(s));
    mapped(s, -0.5 * unit_of(s));
}
static double one_of(size_t n, const double x[]) { return x[random_bits() % n]; }

/* A heavy symmetric top whose axis leans a little, much or not at all, and which spins and turns
 * not at all, slowly or fast. */
static kr_scene heavy(void)
{
    static const double tilts[] =
        {0.0, 1e-9, 1e-3, 0.5, 1.5707963267948966, 2.5, 3.14, 3.1415926535897931},
                        spins[] = {0.0, 0.0, 1e-3, 0.7, -2.0, 4.0, 50.0},
                        turns[] = {0.0, 0.0, 1e-4, 0.3, -1.5}, axials[] = {0.4, 1.0, 3.5, 2.0};
    const kr_vec3 along = {0.0, 0.0, random_bits() % 2 ? 0.75 : -0.5};
    const double axial = one_of(4, axials), tilt = one_of(8, tilts), spin = one_of(7, spins),
                 turn = one_of(5, turns), side = one_of(5, turns);
    kr_scene s = scene_of(2.0, 2.0, axial, along, (kr_vec3){0.0, 0.0, 0.0});
    s.start.q = q_mul(q_exp(v3(tilt, 0.0, 0.0)), q_exp(v3(0.0, 0.0, uniform(-3.0, 3.0))));
    s.start.m = q_turn(s.start.q, v3(side, turn, spin * axial));
    s.start.t = random_bits() % 4 ? 0.0 : 1.5;
    if (random_bits() % 8 == 0) s.gravity = -2.0;
    return s;
}
/* A body on which no torque acts, that turns about or beside an axis, or anyhow. */
static kr_scene free_body(void)
{
    static const double moments[] = {1.0, 1.25, 1.5, 1.75, 1.0 + 1e-9},
                        parts[] = {0.0, 0.0, 1e-10, 1e-3, 1.0, -2.0};
    const double a = one_of(5, moments), b = one_of(5, moments), c = one_of(5, moments),
                 x = one_of(6, parts), y = one_of(6, parts), z = one_of(6, parts);
    kr_scene s = scene_of(a, b, c, v3(0.0, 0.0, 0.0), v3(x, y, z));
    s.start.q = q_one();
    if (random_bits() % 2) return s;
    s.start.q = random_quat();
    s.start.m = q_turn(s.start.q, s.start.m);
    return s;
}
int main(int n, char **words)
{
    in_full = n > 1 && strcmp(words[1], "full") == 0;
    for (int which = 0; which < SCENES; which++) {
        const char *name;
        const kr_scene s = scene_at(which, &name);
        all_of(&s, "closed", name);
    }
    for (int i = 0; i < 5 * STARTS; i++) {
        char name[16];
        const kr_scene s = i < 2 * STARTS ? heavy() : free_body();
        snprintf(name, sizeof name, "%d", i);
        all_of(&s, i < 2 * STARTS ? "heavy" : "free", name);
    }
    all_is_said();
    return 0;
}
