/* Prints named numbers of the whole library to six significant digits: a scene, a method, a
 * quantity and its value in each row. snapshot.txt holds the expected output; .ci/snapshots
 * rewrites it. The digits are the same for all compilers and processors. */
#include <stdlib.h>
#include "bits.h"
#include "math/su2.h"

static void row(const char *scene, const char *method, const char *quantity, double value)
{
    printf("%-10s %-17s %-26s %.6g\n", scene, method, quantity, value);
}
static void must(kr_status status)
{
    if (status == KR_OK) return;
    fprintf(stderr, "snapshot: %s\n", kr_status_text(status));
    exit(1);
}
static double norm(size_t n, const double x[])
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += x[i] * x[i];
    return sqrt(sum);
}

/* Scenes: a body without symmetry, a Lagrange top, a body without torque. */
enum { GENERAL, LAGRANGE, FREE, SCENES };
static const char *const scene_names[SCENES] = {"general", "lagrange", "free"};

static kr_scene scene_at(int which)
{
    kr_scene s = kr_scene_default();
    const double tensor[9] = {3.0, -0.25, 0.5, -0.25, 2.5, 0.125, 0.5, 0.125, 1.5};
    s.start.q = (kr_quat){0.8, 0.36, -0.48, 0.0};
    s.gravity = 2.0;
    s.start.m = v3(0.5, -0.25, 2.0);
    if (which == LAGRANGE) must(kr_body_symmetric(1.5, 2.0, 1.0, 0.75, &s.body));
    if (which == FREE)
        must(kr_body_from_tensor(1.5, (double[9]){1, 0, 0, 0, 2, 0, 0, 0, 2.5}, v3(0, 0, 0),
                                 &s.body));
    if (which == GENERAL) must(kr_body_from_tensor(2.0, tensor, v3(0.25, -0.5, 0.75), &s.body));
    return s;
}
static kr_top *top_of(const kr_scene *s, const char *method, kr_config config)
{
    kr_top *top = NULL;
    must(kr_top_create(s, kr_method_find(method), config, &top));
    return top;
}

static void bodies(void)
{
    kr_body cuboid;
    const kr_scene s = scene_at(GENERAL);
    must(kr_body_cuboid(2.5, v3(0.5, 0.75, 1.25), v3(0.5, 0.125, 0.0), &cuboid));
    row("cuboid", "-", "inertia.x", cuboid.inertia.x);
    row("cuboid", "-", "com.y", cuboid.com.y);
    row("general", "-", "inertia.z", s.body.inertia.z);
    row("general", "-", "axes.w", s.body.axes.w);
}
static void quantities(void)
{
    const kr_scene lagrange = scene_at(LAGRANGE), general = scene_at(GENERAL);
    kr_scene kowalewski = lagrange;
    must(kr_body_from_tensor(1.5, (double[9]){2, 0, 0, 0, 2, 0, 0, 0, 1}, v3(0.5, 0, 0),
                             &kowalewski.body));
    const kr_state *start = &general.start;
    row("general", "-", "energy", kr_state_energy(&general, start));
    row("general", "-", "nutation", kr_state_nutation(&general, start));
    row("general", "-", "axial_momentum", kr_state_axial_momentum(&general, start));
    row("general", "-", "torque.x", kr_state_torque(&general, start).x);
    row("kowalewski", "-", "kowalewski", kr_state_kowalewski(&kowalewski, start));
    row("lagrange", "-", "modified_energy(0.125)",
        kr_state_modified_energy(&lagrange, start, 0.125));
    row("lagrange", "-", "modified_energy4(0.125)",
        kr_state_modified_energy4(&lagrange, start, 0.125));
    row("lagrange", "-", "horizon", kr_scene_horizon(&lagrange));
}

/* Prints a component of the attitude by every method except those of GSL, for the first scene that
 * the method suits. */
static void methods(void)
{
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_method *method = kr_method_at(i);
        const char *name = kr_method_name(method);
        const int is_adaptive = (kr_method_flags(method) & KR_METHOD_ADAPTIVE) != 0;
        int which = 0;
        kr_scene s = scene_at(which);
        if (strncmp(name, "gsl", 3) == 0) continue;
        while (!kr_method_suits(method, &s)) s = scene_at(++which);
        kr_top *top = top_of(&s, name, (kr_config){.step = is_adaptive ? 0.0 : 0.25});
        must(kr_top_advance(top, 3.05));
        row(scene_names[which], name, "q_x(3.05)", kr_top_state(top).q.x);
        kr_top_free(top);
    }
}
static void tangents(void)
{
    static const char *const names[] = {"|d/d start|(3)", "|d/d moments|(3)", "|d/d com|(3)",
                                        "|d/d gravity|(3)", "|d/d mass|(3)"};
    const kr_scene s = scene_at(GENERAL);
    for (int i = 0; i < 5; i++) {
        const unsigned by = 1u << i;
        double out[6 * KR_TANGENT_COLUMNS_MAX];
        kr_top *top = top_of(&s, "taylor", (kr_config){.tangents = by});
        must(kr_top_advance(top, 3.0));
        must(kr_top_tangents(top, out, NULL));
        row("general", "taylor tangents", names[i], norm(6 * kr_tangent_columns(by), out));
        kr_top_free(top);
    }
}
/* Prints results of the method taylor with 30 digits, without the heading, and with damping. */
static void taylor(void)
{
    kr_scene s = scene_at(GENERAL);
    kr_top *precise = top_of(&s, "taylor", (kr_config){.digits = 30});
    must(kr_top_advance(precise, 3.0));
    row("general", "taylor 30 digits", "low word of m_x(3)", kr_top_low(precise).m.x);
    kr_top_free(precise);
    kr_top *headless = top_of(&s, "taylor", (kr_config){.skip_heading = 1});
    must(kr_top_advance(headless, 3.0));
    const kr_state state = kr_top_state(headless);
    row("general", "taylor headless", "nutation(3)", kr_state_nutation(&s, &state));
    kr_top_free(headless);
    s.damping = v3(0.125, 0.25, 0.0625);
    kr_top *damped = top_of(&s, "taylor", (kr_config){0});
    must(kr_top_advance(damped, 3.0));
    row("damped", "taylor", "m_y(3)", kr_top_state(damped).m.y);
    kr_top_free(damped);
}

static void closed_forms(void)
{
    for (int which = LAGRANGE; which <= FREE; which++) {
        const kr_scene s = scene_at(which);
        const char *name = scene_names[which];
        kr_exact exact;
        must(kr_exact_plan(&s, &exact));
        row(name, "exact", "period", exact.period);
        row(name, "exact", "precession", exact.precession_rate);
        row(name, "exact", "spin", exact.spin_angle_rate);
        row(name, "exact", "q_x(-40)", kr_exact_state(&exact, -40.0).q.x);
        row(name, "exact", "q_w(1e4)", kr_exact_state(&exact, 1e4).q.w);
    }
    const kr_scene s = scene_at(LAGRANGE);
    kr_turning turning;
    kr_exact_map map;
    must(kr_exact_turning(&s, &turning));
    row("lagrange", "exact", "least nutation", turning.least);
    row("lagrange", "exact", "greatest nutation", turning.greatest);
    row("lagrange", "exact", "time of the greatest", turning.t_greatest);
    row("lagrange", "exact", "critical spin", turning.critical_spin);
    row("lagrange", "exact", "potential(1)", kr_turning_potential(&turning, 1.0));
    must(kr_exact_map_plan(&s, 0.125, &map));
    row("lagrange", "exact map", "period", map.period);
    row("lagrange", "exact map", "m_x after -301 steps", kr_exact_map_state(&map, -301).m.x);
}

static void events(void)
{
    const kr_scene s = scene_at(GENERAL);
    const kr_term height = {1.0, kr_component_find("apex_z"), KR_COMPONENT_ONE},
                  product[2] = {
                      {2.0, kr_component_find("body_velocity_x"), kr_component_find("q_w")},
                      {-0.5, kr_component_find("apex_x"), KR_COMPONENT_ONE}};
    kr_event event[2] = {{.terms = &height, .count = 1, .extremum = 1},
                         {.terms = product, .count = 2, .direction = -1}};
    const char *const names[2] = {"time of extremum", "time of product = 0"};
    kr_event_hit hit;
    for (int i = 0; i < 2; i++) {
        kr_top *top = top_of(&s, "taylor", (kr_config){0});
        must(kr_top_watch(top, 1, &event[i]));
        for (int k = 0; k < 3; k++) must(kr_top_seek(top, 100.0, &hit));
        row("general", "third event", names[i], kr_top_time(top));
        kr_top_free(top);
    }
}
/* A worker, and the times of its tops. */
enum { TIMES = 7 };
static kr_worker *worker_of(const char *method, kr_config config, size_t n,
                            const kr_reduction reduction[], double t[TIMES])
{
    kr_worker *worker = NULL;
    for (int k = 0; k < TIMES; k++) t[k] = 0.75 * (k + 1);
    must(kr_worker_create(kr_method_find(method), config, n, reduction, &worker));
    return worker;
}
static void reductions(void)
{
    const kr_scene s = scene_at(GENERAL);
    double t[TIMES], reduced[KR_REDUCE_COUNT];
    kr_reduction reduction[KR_REDUCE_COUNT];
    kr_outcome outcome;
    const kr_tops tops = {1, &s, TIMES, t, .reduced = reduced, .outcomes = &outcome};
    for (int i = 0; i < KR_REDUCE_COUNT; i++)
        reduction[i] = (kr_reduction){kr_quantity_find("nutation"), 0, (kr_reduce)i};
    kr_worker *worker = worker_of("taylor", (kr_config){0}, KR_REDUCE_COUNT, reduction, t);
    must(kr_worker_run(worker, &tops));
    must(outcome.status);
    for (int i = 0; i < KR_REDUCE_COUNT; i++) {
        char name[40];
        snprintf(name, sizeof name, "%s of nutation", kr_reduce_name((kr_reduce)i));
        row("general", "worker", name, reduced[i]);
    }
    kr_worker_free(worker);
}
static void growth(void)
{
    static const char *const names[] = {"growth: log", "growth: megno", "growth: most"};
    const kr_scene s = scene_at(GENERAL);
    double t[TIMES], out[TIMES * KR_GROWTH_COUNT];
    kr_outcome outcome;
    const kr_config config = {.tangents = KR_TANGENT_GROWTH};
    const kr_tops tops = {1, &s, TIMES, t, .growth = out, .outcomes = &outcome};
    kr_worker *worker = worker_of("taylor", config, 0, NULL, t);
    must(kr_worker_run(worker, &tops));
    must(outcome.status);
    for (int i = 0; i <= KR_GROWTH_MAX; i++)
        row("general", "worker", names[i], out[(TIMES - 1) * KR_GROWTH_COUNT + i]);
    kr_worker_free(worker);
}
static void section(void)
{
    const kr_scene s = scene_at(GENERAL);
    const kr_term spin = {1.0, kr_component_find("body_velocity_x"), KR_COMPONENT_ONE};
    const kr_event event = {.terms = &spin, .count = 1, .direction = 1};
    const double wait = 50.0;
    double t[TIMES];
    kr_state states[3];
    kr_outcome outcome;
    const kr_tops tops = {1, &s, 3, &wait, .states = states, .outcomes = &outcome};
    kr_worker *worker = worker_of("taylor", (kr_config){0}, 0, NULL, t);
    must(kr_worker_section(worker, &event, &tops));
    must(outcome.status);
    row("general", "section", "time of the third", states[2].t);
    row("general", "section", "m_x of the third", states[2].m.x);
    kr_worker_free(worker);
}
int main(void)
{
    bodies();
    quantities();
    methods();
    taylor();
    tangents();
    closed_forms();
    events();
    reductions();
    growth();
    section();
    return 0;
}
