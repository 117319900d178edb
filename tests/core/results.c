/* Prints what bodies, quantities, every method and events come to; results.txt is what it printed
 * when results were last meant to change. With the word "full" it prints the numbers. */
#include "numbers/su2.h"
#include "scenes.h"

static void bodies(void)
{
    const double skew[9] = {3.0, -0.25, 0.5, -0.25, 2.5, 0.125, 0.5, 0.125, 1.5};
    const double twice[9] = {2.0, 0.5, 0.0, 0.5, 2.0, 0.0, 0.0, 0.0, 2.5};
    const double even[9] = {2.0, 0.25, 0.25, 0.25, 2.0, 0.25, 0.25, 0.25, 2.0};
    const kr_vec3 com = {0.25, -0.5, 0.75}, half = {0.5, 0.75, 1.25}, pivot = {0.5, 0.125, 0.0};
    kr_body made[6];
    must(kr_body_cuboid(2.5, half, pivot, made) == KR_OK &&
             kr_body_symmetric(2.0, 3.0, 1.0, -0.5, made + 1) == KR_OK &&
             kr_body_from_com(2.0, skew, com, pivot, made + 2) == KR_OK &&
             kr_body_from_tensor(1.0, twice, com, made + 3) == KR_OK &&
             kr_body_from_rounded_tensor(1.0, twice, com, 1e-3, made + 4) == KR_OK &&
             kr_body_from_tensor(1.0, even, (kr_vec3){1.0, 1.0, 1.0}, made + 5) == KR_OK,
         "no body");
    for (int i = 0; i < 6; i++) {
        headline("body", kr_kind_name(kr_body_kind(made + i, KR_KIND_RTOL)));
        put("%d\n", kr_body_can_be(made + i));
        say_one(made[i].mass);
        say(3, &made[i].inertia.x);
        say(3, &made[i].com.x);
        say(4, &made[i].axes.w);
    }
}
static void quantities(const kr_scene *s, const char *name)
{
    headline("quantities", name);
    for (size_t i = 0; i < kr_quantity_count(); i++) {
        const kr_quantity *quantity = kr_quantity_at(i);
        double out[9];
        kr_quantity_values(quantity, s, 1, &s->start, out);
        put("%s", kr_quantity_name(quantity));
        say(kr_quantity_doubles(quantity), out);
    }
    say_one(kr_scene_horizon(s));
    say_one(kr_state_modified_energy(s, &s->start, 0.125));
    for (double step = 0.125; step < 4.0; step *= 1.25)
        say_one(kr_state_modified_energy4(s, &s->start, step * unit_of(s)));
}

/* Where a top ends, what it cost, and how its end depends on its start. */
static void way(const kr_scene *s, const kr_method *method, kr_config config, double to)
{
    kr_top *top = NULL;
    const kr_status status = kr_top_create(s, method, config, &top);
    put("%s\n", kr_status_text(status));
    if (status != KR_OK) return;
    if (!(kr_method_flags(method) & KR_ADAPTIVE)) put("%s\n", kr_status_text(kr_top_step(top)));
    put("%s\n", kr_status_text(kr_top_advance(top, 0.5 * to)));
    put("%s\n", kr_status_text(kr_top_advance(top, to)));
    const kr_state high = kr_top_state(top), low = kr_top_low(top);
    say_state(&high);
    say_counts(kr_top_stats(top));
    say_low(4, &high.q.w, &low.q.w, config.digits);
    say_low(3, &high.m.x, &low.m.x, config.digits);
    if (config.tangents) {
        double out[6 * KR_TANGENT_MOST], rest[6 * KR_TANGENT_MOST];
        const size_t n = 6 * kr_tangent_columns(config.tangents);
        must(kr_top_tangents(top, out, rest) == KR_OK, "no tangents");
        say_sum(n, out);
        say_low(n, out, rest, config.digits);
        put("%.1e\n", kr_top_tangent_rest(top));
    }
    kr_top_free(top);
}
static void method_words(const kr_method *method)
{
    headline("method", kr_method_name(method));
    put("%u %d\n", kr_method_flags(method), kr_method_order(method));
}
/* Every method, forward to a time between two steps and back, by default and loosely. */
static void by_all(const kr_scene *s, const char *name)
{
    const double unit = unit_of(s);
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_method *method = kr_method_at(i);
        if (strncmp(kr_method_name(method), "gsl", 3) == 0) continue;
        if (!kr_method_suits(method, s)) continue;
        const int adapts = (kr_method_flags(method) & KR_ADAPTIVE) != 0;
        const kr_config plain = {.step = adapts ? 0.0 : 0.03125 * unit},
                        back = {.step = adapts ? -0.0625 * unit : -0.03125 * unit},
                        loose = {.step = plain.step, .tol = 1e-5};
        headline(kr_method_name(method), name);
        way(s, method, plain, 3.011 * unit);
        way(s, method, back, -1.007 * unit);
        if (kr_method_flags(method) & (KR_ADAPTIVE | KR_IMPLICIT))
            way(s, method, loose, 2.0 * unit);
    }
}
/* What taylor alone can do. */
static void by_taylor(const kr_scene *s, const char *name)
{
    static const kr_config ways[] = {{.digits = 20},
                                     {.digits = 30},
                                     {.digits = 30, .tol = 0x1p-110},
                                     {.leave_heading = 1},
                                     {.tangents = 31},
                                     {.tangents = 1, .digits = 20},
                                     {.tangents = 31, .digits = 30},
                                     {.tangents = 2, .tol = 1e-9},
                                     {.tangents = KR_TANGENT_GRAVITY, .digits = 20},
                                     {.tangents = KR_TANGENT_MASS, .digits = 30}};
    static const char *const names[] = {
        "20 digits",           "30 digits",    "short steps",     "headless", "tangents",
        "tangents, 20 digits", "tangents, 30", "tangents, loose", "gravity",  "mass"};
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        headline(names[i], name);
        kr_config config = ways[i];
        config.step = (i % 2 ? -0.0625 : 0.0625) * unit_of(s);
        way(s, kr_method_find("taylor"), config, 64.0 * config.step);
    }
}

/* Follows a top to its first events. */
static void watch(const kr_scene *s, size_t n, kr_event events[], int headless)
{
    kr_top *top = NULL;
    kr_hit hit = {0, 0};
    const kr_config config = {.leave_heading = headless};
    must(kr_top_create(s, kr_method_find("taylor"), config, &top) == KR_OK &&
             kr_top_watch(top, n, events) == KR_OK,
         "no watch");
    for (int i = 0; i < 10 && hit.which >= 0; i++) {
        put("%s", kr_status_text(kr_top_seek(top, 8.0 * unit_of(s), &hit)));
        put(" %d %d", (int)hit.which, hit.direction);
        say_one(kr_top_time(top) / unit_of(s));
    }
    kr_top_free(top);
}
/* Where the apex is highest and lowest, a product passes zero, and both on one side alone. */
static void events(const kr_scene *s, const char *name)
{
    const kr_term high = {1.0, kr_component_find("apex_z"), KR_ONE},
                  both[] = {{2.0, kr_component_find("body_velocity_x"), kr_component_find("q_w")},
                            {-0.5, kr_component_find("apex_x"), KR_ONE}},
                  spin[] = {{1.0, kr_component_find("spin"), KR_ONE}, {-0.5, KR_ONE, KR_ONE}};
    kr_event mixed[] = {{.terms = &high, .count = 1, .extremum = 1},
                        {.terms = both, .count = 2, .where = &high, .where_count = 1},
                        {.terms = both + 1, .count = 1, .direction = -1},
                        {.terms = both, .count = 2, .extremum = 1, .direction = 1}},
             level[] = {{.terms = &high, .count = 1, .direction = 1},
                        {.terms = spin, .count = 2},
                        {.terms = &high, .count = 1, .extremum = 1, .direction = -1}};
    headline("events", name);
    watch(s, 4, mixed, 0);
    watch(s, 3, level, 1);
}
/* Each component by itself, and beside another. */
static void components(const kr_scene *s, const char *name)
{
    for (size_t i = 0; i < kr_quantity_count(); i++) {
        const kr_quantity *quantity = kr_quantity_at(i);
        if (!(kr_quantity_flags(quantity) & KR_SERIES)) continue;
        headline(kr_quantity_name(quantity), name);
        for (size_t k = 0; k < kr_quantity_doubles(quantity); k++) {
            char word[64];
            snprintf(word, sizeof word, "%s%s", kr_quantity_name(quantity),
                     kr_quantity_axis(quantity, k));
            const int one = kr_component_find(word);
            const kr_term terms[] = {
                {1.0, one, KR_ONE}, {0.75, one, kr_component_find("m_x")}, {0.25, KR_ONE, KR_ONE}};
            kr_event events[] = {{.terms = terms, .count = 1, .extremum = 1},
                                 {.terms = terms + 1, .count = 2}};
            say_one(kr_terms_value(s, &s->start, 3, terms));
            watch(s, 2, events, 0);
        }
    }
}
/* Tangents at many times of a way, inside steps and parts of steps. */
static void on_the_way(const kr_scene *s, kr_config config, const char *name)
{
    kr_top *top = NULL;
    must(kr_top_create(s, kr_method_find("taylor"), config, &top) == KR_OK, "no top");
    headline("on the way", name);
    for (int i = 1; i <= 40; i++) {
        double out[6 * KR_TANGENT_MOST], rest[6 * KR_TANGENT_MOST];
        const size_t n = 6 * kr_tangent_columns(config.tangents);
        must(kr_top_advance(top, s->start.t + 0.0625 * i * unit_of(s)) == KR_OK &&
                 kr_top_tangents(top, out, rest) == KR_OK,
             "no tangents");
        say_sum(n, out);
        say_low(n, out, rest, config.digits);
    }
    kr_top_free(top);
}
/* Extrapolation that is told to begin with steps that are far too long. */
static void rough(const kr_scene *s, const char *name)
{
    static const char *const methods[] = {"extrap", "extrap_kirchhoff"};
    for (int i = 0; i < 2; i++) {
        const kr_method *method = kr_method_find(methods[i]);
        if (!kr_method_suits(method, s)) continue;
        headline("rough", name);
        for (double tol = 1e-9; tol < 0.1; tol *= 10.0)
            for (double step = 0.25; step < 40.0; step *= 2.5)
                way(s, method, (kr_config){.tol = tol, .step = step * unit_of(s)},
                    3.0 * unit_of(s));
    }
}
/* Steps in which a body turns by one about an axis, exactly, beside others. */
static void whole_turns(void)
{
    const kr_vec3 m = {0.25, -0.5, 0.75}, across = {0.5, 0.0, 0.0};
    const kr_scene scenes[2] = {scene_of(1.0, 1.0, 0.5, across, m),
                                scene_of(0.5, 1.0, 1.25, across, m)};
    for (int i = 0; i < 2; i++)
        for (double step = 0.5; step <= 4.0; step *= 2.0) {
            headline("strang", i ? "steps about N" : "steps about T");
            way(scenes + i, kr_method_find("strang"), (kr_config){.step = step}, 16.0);
        }
}
int main(int n, char **words)
{
    in_full = n > 1 && strcmp(words[1], "full") == 0;
    bodies();
    for (size_t i = 0; i < kr_method_count(); i++)
        if (strncmp(kr_method_name(kr_method_at(i)), "gsl", 3) != 0) method_words(kr_method_at(i));
    for (int which = 0; which < SCENES; which++) {
        const char *name;
        const kr_scene s = scene_at(which, &name);
        quantities(&s, name);
        by_all(&s, name);
        by_taylor(&s, name);
        events(&s, name);
        rough(&s, name);
        if (which == 2 || which == 4) components(&s, name);
    }
    /* It sleeps: its tangents take shorter steps than it does. */
    kr_scene asleep = scene_of(2.0, 2.0, 1.0, v3(0.0, 0.0, 0.75), v3(0.0, 0.0, 9.0));
    asleep.start.q = q_one();
    by_taylor(&asleep, "asleep");
    asleep.start.t = 0.1; /* no time since then is a double */
    on_the_way(&asleep, (kr_config){.tangents = KR_TANGENT_START}, "16 digits");
    on_the_way(&asleep, (kr_config){.tangents = KR_TANGENT_MASS, .digits = 20}, "20 digits");
    on_the_way(&asleep, (kr_config){.tangents = KR_TANGENT_START, .digits = 30}, "30 digits");
    whole_turns();
    all_is_said();
    return 0;
}
