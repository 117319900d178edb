/* Events: the search for roots by itself, and every quantity's polynomial. */
#include "events.h"
#include "events/roots.h"
#include "model/quantities.h"

/* The changes of sign of scale * prod (s - root), by the search; how many. */
static int roots_of(int n, const double *root, double scale, double *found)
{
    double c[KR_PIECE_MOST + 1] = {scale};
    for (int k = 0; k < n; k++)
        for (int i = k + 1; i >= 0; i--) c[i] = (i > 0 ? c[i - 1] : 0.0) - root[k] * c[i];
    kr_search r = {
        .c = c, .degree = n, .noise = fabs(scale) * 0x1p-48, .start_noise = fabs(scale) * 0x1p-40};
    int count = 0;
    while (count < MANY && kr_roots_next(&r)) found[count++] = r.root;
    return count;
}
static void roots(void)
{
    const double near[] = {0.3, 0.3 + 1e-6, -2.0, 3.0}, twice[] = {0.37, 0.37},
                 thrice[] = {0.37, 0.37, 0.37};
    const double ends[] = {0.0, 1.0, 0.5}, outside[] = {-0.1, 1.1}, near_end[] = {1.0 - 1e-9, 2.0};
    double found[MANY], scaled[MANY];
    IS(roots_of(4, near, 1.0, found) == 2);
    NEAR(found[0], near[0], 1e-9);
    NEAR(found[1], near[1], 1e-9);
    IS(roots_of(4, near, -0x1p-300, scaled) == 2 && scaled[0] == found[0] && scaled[1] == found[1]);
    IS(roots_of(2, twice, 1.0, found) == 0);
    IS(roots_of(3, thrice, 1.0, found) == 1);
    NEAR(found[0], 0.37, 1e-4); /* the cube root of rounding */
    /* neither the start nor the end */
    IS(roots_of(3, ends, 1.0, found) == 1 && fabs(found[0] - 0.5) < 1e-15);
    IS(roots_of(2, outside, 1.0, found) == 0);
    IS(roots_of(2, near_end, 1.0, found) == 1);
    NEAR(found[0], near_end[0], 1e-15);
    IS(roots_of(1, outside, 0.0, found) == 0);
    IS(roots_of(2, twice, INFINITY, found) == 0 && roots_of(2, twice, NAN, found) == 0);
    for (int i = 0; i < 20000; i++) {
        double root[12];
        int inside = 0;
        for (int k = 0; k < 12; k++)
            root[k] = k % 3 ? 4.0 * uniform() - 1.5 : 0.04 * k + 0.03 * uniform();
        for (int k = 0; k < 12; k++) inside += root[k] > 0.0 && root[k] < 1.0;
        for (int k = 0; k < 144; k++)
            if (k / 12 != k % 12 && fabs(root[k / 12] - root[k % 12]) < 0.01) inside = -1;
        if (inside >= 0) IS(roots_of(12, root, 1.0, found) == inside);
    }
}

/* The numbers of all components that events know; how many. */
static int all_components(int *component)
{
    int n = 0;
    for (int number = 0; number <= KR_QUANTITIES * KR_AXES && n < MANY; number++)
        if (kr_component_is(number)) component[n++] = number;
    IS(n > 20 && n < MANY);
    return n;
}
/* Every product of two quantities: its polynomial against the value of the states inside a step. */
static void polynomials(int scene, int digits)
{
    const kr_scene s = scene_of(scene);
    int component[MANY];
    const int components = all_components(component);
    kr_top *top = make(&s, (kr_config){.digits = digits}, NULL, 0);
    for (int i = 0; i < components * components; i++) {
        const kr_term product = {0.7, component[i / components], component[i % components]};
        const kr_event g = {.terms = &product, .count = 1},
                       rate = {.terms = &product, .count = 1, .extremum = 1};
        double c[KR_TERMS_ROOM], d[KR_TERMS_ROOM], there = 0.0;
        IS(kr_top_advance(top, 0.05 * i) == KR_OK);
        const kr_piece piece = top->method->piece(&top->main);
        const kr_state inside = kr_top_state(top);
        const double size = kr_terms_size(top, &piece, 1, &product);
        const double at =
            i == 0 ? 0.0 : (top->asked / top->time_unit - piece.begin) / (piece.end - piece.begin);
        const int degree = kr_terms_polynomial(top, &piece, &g, c);
        for (int n = degree; n >= 0; n--) there = there * at + c[n];
        NEAR(there, kr_terms_value(&s, &inside, 1, &product), 1e-14 * size);
        IS(at >= 0.0 && at <= 1.0 && kr_terms_polynomial(top, &piece, &rate, d) == degree - 1);
        for (int n = 0; n < degree; n++) NEAR(d[n], (n + 1) * c[n + 1], 1e-13 * size);
    }
    kr_top_free(top);
}

/* Without the heading the same is found, of what does not turn with it. */
static void headless(void)
{
    static const char *const turning[] = {"q_w", "q_z", "apex_x", "apex_y", "m_x", "m_y"};
    const kr_scene s = scene_of(1);
    const kr_term g[] = {height, term(0.2, "m_z", "body_vertical_x"),
                         term(0.1, "spin", "body_momentum_y")};
    kr_event e = {.terms = g, .count = 3, .extremum = 1}, f = e;
    double t[MANY], u[MANY];
    kr_top *whole = make(&s, (kr_config){0}, &e, 1),
           *level = make(&s, (kr_config){.leave_heading = 1}, &f, 1);
    const int n = seek_all(whole, 20.0, t, NULL);
    IS(n > 5 && seek_all(level, 20.0, u, NULL) == n);
    for (int i = 0; i < n; i++) NEAR(u[i], t[i], 1e-11);
    for (size_t i = 0; i < sizeof turning / sizeof *turning; i++) {
        const kr_term g_turns = term(1.0, "spin", turning[i]);
        kr_event turns = {.terms = &g_turns, .count = 1};
        IS(kr_top_watch(whole, 1, &turns) == KR_OK &&
           kr_top_watch(level, 1, &turns) == KR_ERR_ARGUMENT);
    }
    kr_top_free(whole);
    kr_top_free(level);
}
/* A top that is loaded where another stood, at an event, goes on to the next. */
static void loaded(void)
{
    static char memory[1 << 16];
    const kr_scene s = scene_of(2);
    kr_event e = {.terms = &height, .count = 1, .extremum = 1}, f = e;
    double t[MANY], u[MANY];
    kr_top *top = make(&s, (kr_config){0}, &e, 1), *other = make(&s, (kr_config){0}, &f, 1);
    const size_t size = kr_top_save_size(top);
    IS(seek_all(other, 3.0, u, NULL) > 0 && size <= sizeof memory);
    for (int i = 0; i < 10; i++) {
        kr_hit hit;
        IS(kr_top_seek(top, 100.0, &hit) == KR_OK && hit.which == 0 &&
           kr_top_save(top, size, memory) == KR_OK);
        IS(kr_top_load(other, size, memory) == KR_OK && other->events == &f);
    }
    const int n = seek_all(top, 40.0, t, NULL);
    IS(n > 3 && seek_all(other, 40.0, u, NULL) == n);
    for (int i = 0; i < n; i++) NEAR(u[i], t[i], 1e-12);
    kr_top_free(top);
    kr_top_free(other);
}

int main(void)
{
    begin();
    roots();
    headless();
    loaded();
    for (int scene = 0; scene < 3; scene++)
        for (int digits = 16; digits <= 30; digits += 7) polynomials(scene, digits);
    return check_result();
}
