/* Prints what drawn bodies, scenes and motions of one top come to, a few of them in a line.
 * results_drawn.txt is what it printed when results were last meant to change. With the word "full"
 * it prints the numbers. */
#include "draws.h"

enum { MOST_COMPONENTS = 128, MOST_IMAGE = 1 << 18 };
static int component[MOST_COMPONENTS];
static size_t components = 0;
static const kr_method *by_method;

/* Now and then what is no number of this kind, or hardly one. */
static double spoiled(double x)
{
    static const double bad[9] = {0.0, -1.0, NAN, INFINITY, -INFINITY, 1e-310, 1e300, -0.0, 2e-10};
    return chance(6) ? of_few(9, bad) : x;
}
static kr_vec3 spoiled_vec(kr_vec3 v)
{
    const double x = spoiled(v.x), y = spoiled(v.y), z = spoiled(v.z);
    return v3(x, y, z);
}
/* A tensor of these moments about turned axes, symmetric up to a rounding, or a little less. */
static void drawn_tensor(double tensor[9])
{
    const kr_quat q = drawn_attitude();
    const kr_vec3 moments = spoiled_vec(drawn_moments()), x = q_turn(q, v3(1, 0, 0)),
                  y = q_turn(q, v3(0, 1, 0)), z = q_turn(q, v3(0, 0, 1));
    const double axis[3][3] = {{x.x, x.y, x.z}, {y.x, y.y, y.z}, {z.x, z.y, z.z}};
    for (int i = 0; i < 9; i++)
        tensor[i] = moments.x * axis[0][i / 3] * axis[0][i % 3] +
                    moments.y * axis[1][i / 3] * axis[1][i % 3] +
                    moments.z * axis[2][i / 3] * axis[2][i % 3];
    if (chance(20))
        for (int i = 0; i < 9; i++) tensor[i] = (double)draw(3) - 1.0 + (i % 4 ? 0.0 : 3.0);
    if (chance(20)) tensor[1] *= 1.0 + power_of_two(4) * 0x1p-40;
    if (chance(20)) tensor[0] += tensor[4] + tensor[8];
}
static kr_status drawn_maker(kr_body *made)
{
    double tensor[9];
    drawn_tensor(tensor);
    const double mass = spoiled(uniform(0.5, 2.0)), across = spoiled(2.0),
                 along = spoiled(chance(50) ? 1.0 : 4.0), height = spoiled(simple()),
                 rounded = spoiled(chance(50) ? 0.0 : power_of_two(6) * 0x1p-10);
    const kr_vec3 half = spoiled_vec(drawn_moments()), pivot = spoiled_vec(simple_vec()),
                  com = spoiled_vec(simple_vec());
    switch (draw(5)) {
    case 0:
        return kr_body_cuboid(mass, half, pivot, made);
    case 1:
        return kr_body_symmetric(mass, across, along, height, made);
    case 2:
        return kr_body_from_com(mass, tensor, com, pivot, made);
    case 3:
        return kr_body_from_tensor(mass, tensor, com, made);
    default:
        return kr_body_from_rounded_tensor(mass, tensor, com, rounded, made);
    }
}
static void of_body(const kr_body *body)
{
    static const double slacks[4] = {KR_KIND_RTOL, 0.0, 1e-9, 0.125};
    for (int i = 0; i < 4; i++) put("%s ", kr_kind_name(kr_body_kind(body, slacks[i])));
    put("%d ", kr_body_can_be(body));
    tell_status(kr_body_check(body));
}
static void a_made_body(void)
{
    kr_body body = {0};
    const kr_status status = drawn_maker(&body);
    tell_status(status);
    if (status != KR_OK) return;
    of_body(&body);
    const double size = v_length(body.com), moment = v_largest(body.inertia);
    tell_beside(moment, body.inertia.x);
    tell_beside(moment, body.inertia.y);
    tell_beside(moment, body.inertia.z);
    if (size > 0.0) tell(3, &body.com.x);
    tell(4, &body.axes.w);
    tell_beside(1.0, body.mass);
}
/* What is said of scenes of which one number is bad. */
static void a_bad_scene(void)
{
    kr_scene s = drawn_scene();
    double *const number[] = {
        &s.body.mass,  &s.body.inertia.x, &s.body.inertia.y, &s.body.inertia.z, &s.body.com.x,
        &s.body.com.y, &s.body.com.z,     &s.body.axes.w,    &s.body.axes.y,    &s.gravity,
        &s.start.t,    &s.start.q.w,      &s.start.q.z,      &s.start.m.x,      &s.start.m.y,
        &s.damping.x,  &s.damping.z,      &s.body.rounded};
    static const double bad[12] = {0.0,    -1.0, NAN,  INFINITY, -INFINITY, 1e-310,
                                   1e-170, 1e80, 1e16, 1e160,    1e300,     1.0 + 3e-12};
    double *const which = number[draw(sizeof number / sizeof *number)];
    const double by = of_few(12, bad);
    *which = chance(30) && isfinite(*which) ? *which * (1.0 + by * 0x1p-40) : by;
    const kr_method *method = drawn_method();
    kr_top *top = NULL;
    kr_exact exact;
    kr_turning turning;
    of_body(&s.body);
    tell_status(kr_scene_check(&s));
    tell_status(kr_top_create(&s, method, (kr_config){.step = 0.125}, &top));
    kr_top_free(top);
    tell_status(kr_exact_plan(&s, &exact));
    tell_status(kr_exact_turning(&s, &turning));
    put("%d\n", kr_method_suits(method, &s));
}
static void its_quantities(const kr_scene *s)
{
    const double pace = pace_of(s);
    for (size_t i = 0; i < kr_quantity_count(); i++) {
        const kr_quantity *quantity = kr_quantity_at(i);
        double out[10] = {0};
        kr_quantity_values(quantity, s, 1, &s->start, out);
        out[kr_quantity_doubles(quantity)] = 1.0;
        tell(kr_quantity_doubles(quantity) + 1, out);
    }
    tell_beside(1e15, kr_scene_horizon(s) / pace);
    for (int i = 0; i < 4; i++) {
        const double step = i > 0 ? pace * power_of_two(4) : 0.0;
        tell_beside(1.0, kr_state_modified_energy(s, &s->start, step));
        tell_beside(1.0, kr_state_modified_energy4(s, &s->start, step));
    }
}
static void its_turning(const kr_scene *s)
{
    kr_turning turning;
    if (kr_exact_turning(s, &turning) != KR_OK) return;
    const double angles[3] = {turning.least, turning.greatest, 1.0},
                 times[3] = {turning.t_least, turning.t_greatest, pace_of(s)};
    put("%s", turning.course);
    tell(3, angles);
    tell(3, times);
    tell_beside(1.0, kr_turning_potential(&turning, 1.0));
    tell_beside(1.0 / times[2], turning.critical_spin);
}
/* Its quantities, turning points and closed forms. */
static void a_scene(void)
{
    static const double times[6] = {0.0, 0.125, 1.0, -3.0, 20.0, 1e4};
    const kr_scene s = drawn_scene();
    const double pace = pace_of(&s);
    kr_exact exact;
    kr_exact_map map;
    its_quantities(&s);
    its_turning(&s);
    const kr_status status = kr_exact_plan(&s, &exact),
                    mapped = kr_exact_map_plan(&s, pace * power_of_two(6), &map);
    tell_status(status);
    for (int i = 0; i < 6 && status == KR_OK; i++) {
        const kr_state state = kr_exact_state(&exact, s.start.t + pace * times[i]);
        tell_state(&s, &state);
    }
    tell_status(mapped);
    for (int64_t k = -1000; k < 2000 && mapped == KR_OK; k += 1 + k * k / 3) {
        const kr_state state = kr_exact_map_state(&map, k);
        tell_state(&s, &state);
    }
}

static int adapts(void) { return (kr_method_flags(by_method) & KR_ADAPTIVE) != 0; }
static int is_dense(void) { return (kr_method_flags(by_method) & KR_DENSE) != 0; }
static int polls_left;
static int poll(void *context)
{
    (void)context;
    return polls_left-- <= 0;
}
static kr_config drawn_config(const kr_scene *s, unsigned flags)
{
    static const double steps[6] = {0.03125, 0.03125, 0.125, -0.125, 0.75, 2.0},
                        tolerances[6] = {0.0, 0.0, 1e-13, 1e-15, 1e-4, 0.125};
    static const int digits[3] = {16, 20, 30};
    static const int64_t limits[6] = {5000, 1000, 1000, 1, 7, 60};
    const int rounds_anyhow = (flags & KR_DIGITS) != 0; /* so that steps may be a little other */
    kr_config config = {.step = pace_of(s) * of_few(6, steps)};
    config.tol = of_few(rounds_anyhow ? 4 : 6, tolerances);
    config.max_steps = limits[draw(rounds_anyhow ? 1 : 6)];
    if (chance(50) && flags & KR_ADAPTIVE) config.step *= chance(50) ? 0.0 : -1.0;
    if (chance(15) && !rounds_anyhow) config.poll = poll;
    polls_left = (int)draw(20);
    if (chance(40) && flags & KR_DIGITS) {
        config.digits = digits[draw(3)];
        config.tol = config.digits == 30 && chance(30) ? 0x1p-110 : 0.0;
    }
    if (chance(25) && flags & KR_HEADLESS) config.leave_heading = 1;
    if (chance(50) && flags & KR_TANGENTS && !config.leave_heading) config.tangents = draw(32);
    return config;
}
/* Times ahead, on the grid or between, some alike, and seldom one behind. */
static double a_time_from(double now, double pace, const kr_config *config)
{
    const double ahead = config->step < 0.0 ? -1.0 : 1.0;
    if (chance(15)) return now;
    if (chance(25) && !adapts()) return now + (double)draw(6) * config->step;
    if (chance(4)) return now - ahead * 0.5 * pace;
    return now + ahead * uniform(0.0, 0.75) * pace;
}
static void record(kr_top *top, const kr_scene *s, const kr_config *config)
{
    enum { TIMES = 5 };
    double t[TIMES], now = kr_top_state(top).t;
    kr_state out[TIMES] = {{0}}, low[TIMES] = {{0}};
    size_t done = 0;
    for (int i = 0; i < TIMES; i++) now = t[i] = a_time_from(now, 0.25 * pace_of(s), config);
    tell_status(kr_top_record_low(top, TIMES, t, out, low, &done));
    put("%d\n", (int)done);
    for (size_t i = 0; i < done; i++) tell_state(s, &out[i]);
}
/* The same top from a checkpoint, in place of it; another start may come into its place first. */
static kr_top *saved_and_loaded(kr_top *top, const kr_scene *s, kr_config config)
{
    static unsigned char image[MOST_IMAGE];
    kr_top *other = NULL;
    const size_t size = kr_top_save_size(top);
    must(size <= sizeof image && kr_top_save(top, size, image) == KR_OK, "no image");
    must(kr_top_create(s, by_method, config, &other) == KR_OK, "no other top");
    if (chance(50) && !config.poll) tell_status(kr_top_advance(other, s->start.t + config.step));
    tell_status(kr_top_load(other, size, image));
    kr_top_free(top);
    return other;
}
static void tangents(kr_top *top, const kr_config *config)
{
    double out[6 * KR_TANGENT_MOST];
    if (!config->tangents || kr_top_tangents(top, out, NULL) != KR_OK) return;
    const size_t columns = kr_tangent_columns(config->tangents);
    tell(6 * columns, out);
}
/* A start from which it is begun again. */
static void begin_again(kr_top *top, const kr_scene *s)
{
    const double unit = v_largest(s->body.inertia) / pace_of(s);
    kr_scene other = *s;
    if (chance(50)) other.start.q = is_dense() ? random_quat() : drawn_attitude();
    if (chance(70))
        other.start.m = v_scale(unit, is_dense() ? random_vec(2.0) : drawn_momentum(&other));
    if (chance(30)) other.start.t += 0.5 * pace_of(s);
    tell_status(kr_top_reset(top, &other.start));
}
static kr_top *moved(kr_top *top, const kr_scene *s, const kr_config *config)
{
    switch (is_dense() ? 2 + draw(6) : draw(8)) {
    case 0:
    case 1:
        tell_status(kr_top_step(top));
        break;
    case 2:
    case 3:
        record(top, s, config);
        break;
    case 4:
        begin_again(top, s);
        break;
    case 5:
        top = saved_and_loaded(top, s, *config);
        break;
    default:
        tell_status(kr_top_advance(top, a_time_from(kr_top_state(top).t, pace_of(s), config)));
    }
    return top;
}
static void a_way(void)
{
    kr_top *top = NULL;
    kr_scene s = is_dense() ? ordinary_scene() : drawn_scene();
    for (int i = 0; i < 20 && !kr_method_suits(by_method, &s); i++) s = drawn_scene();
    if (chance(10)) change_units(&s);
    const kr_config config = drawn_config(&s, kr_method_flags(by_method));
    const kr_status status = kr_top_create(&s, by_method, config, &top);
    tell_status(status);
    for (int i = 0; i < 6 && status == KR_OK; i++) {
        top = moved(top, &s, &config);
        const kr_state state = kr_top_state(top);
        tell_state(&s, &state);
        if (!is_dense()) say_counts(kr_top_stats(top));
        tangents(top, &config);
    }
    kr_top_free(top);
}

static void find_components(void)
{
    for (size_t i = 0; i < kr_quantity_count(); i++) {
        const kr_quantity *quantity = kr_quantity_at(i);
        if (!(kr_quantity_flags(quantity) & KR_SERIES)) continue;
        for (size_t k = 0; k < kr_quantity_doubles(quantity); k++) {
            char word[64];
            snprintf(word, sizeof word, "%s%s", kr_quantity_name(quantity),
                     kr_quantity_axis(quantity, k));
            must(components < MOST_COMPONENTS, "too many components");
            component[components++] = kr_component_find(word);
        }
    }
}
static int any_component(void) { return component[draw(components)]; }
static size_t drawn_terms(kr_term terms[3])
{
    const size_t count = 1 + draw(3);
    for (size_t i = 0; i < count; i++) {
        terms[i].factor = uniform(-1.5, 1.5);
        terms[i].of = chance(15) && i > 0 ? KR_ONE : any_component();
        terms[i].times = chance(60) ? KR_ONE : any_component();
    }
    return count;
}
/* A top is followed from event to event. */
static void a_search(void)
{
    kr_term terms[3][3], where[3][4];
    kr_event events[3] = {{0}};
    kr_hit hit = {0, 0};
    kr_top *top = NULL;
    kr_scene s = ordinary_scene();
    const size_t count = 1 + draw(3);
    while (s.gravity * v_length(s.body.com) == 0.0) s = ordinary_scene(); /* its momentum stays */
    for (size_t i = 0; i < count; i++) {
        events[i].terms = terms[i];
        events[i].count = drawn_terms(terms[i]);
        events[i].where = where[i];
        events[i].where_count = chance(25) ? drawn_terms(where[i]) : 0;
        if (events[i].where_count > 0) /* so that it is not zero where the event is */
            where[i][events[i].where_count++] = (kr_term){0.125, KR_ONE, KR_ONE};
        events[i].extremum = chance(30);
        events[i].direction = (int)draw(3) - 1;
        tell_beside(1.0, kr_terms_value(&s, &s.start, events[i].count, terms[i]));
    }
    by_method = kr_method_find("taylor");
    const kr_config config = drawn_config(&s, KR_HEADLESS | KR_ADAPTIVE | KR_DIGITS);
    kr_status status = kr_top_create(&s, by_method, config, &top);
    tell_status(status);
    if (status == KR_OK) tell_status(status = kr_top_watch(top, count, events));
    for (int i = 0; i < 6 && status == KR_OK; i++) {
        const double way = uniform(0.0, 4.0) * pace_of(&s);
        status = kr_top_seek(top, kr_top_state(top).t + (config.step < 0.0 ? -way : way), &hit);
        put("%s %d %d\n", kr_status_text(status), (int)hit.which, hit.direction);
        const kr_state state = kr_top_state(top);
        tell_state(&s, &state);
    }
    kr_top_free(top);
}
int main(int n, char **words)
{
    in_full = n > 1 && strcmp(words[1], "full") == 0;
    find_components();
    lines("made", 20, 100, a_made_body);
    lines("bad", 20, 200, a_bad_scene);
    lines("scene", 30, 40, a_scene);
    for (size_t i = 0; i < kr_method_count(); i++) {
        by_method = kr_method_at(i);
        const char *name = kr_method_name(by_method);
        if (strncmp(name, "gsl", 3) != 0)
            lines(name, strcmp(name, "taylor") == 0 ? 30 : 8, 40, a_way);
    }
    lines("search", 30, 40, a_search);
    all_is_said();
    return 0;
}
