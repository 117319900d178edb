/* kr_top_reset and kr_top_set_scene: a refused call leaves every bit unchanged, and low words and
 * events continue. The random calls of tests/fuzz compare the top with one created anew. */
#include <stdlib.h>
#include "exact_tops.h"

enum { MOST = 1 << 15 };

/* Writes the checkpoint of a top and returns its size, or 0 if it cannot be saved. */
static size_t bytes_of(const kr_top *top, unsigned char *bytes)
{
    const size_t size = kr_top_save_size(top);
    return size <= MOST && kr_top_save(top, size, bytes) == KR_OK ? size : 0;
}
/* A refused reset or scene, whatever the reason, changes neither the bytes of the top nor its
 * further motion. */
static void test_refusals(const kr_method *method)
{
    static unsigned char before[MOST], after[MOST];
    enum { STARTS_ALONE = 6, ALL = 10 };
    const kr_scene s = scene_for(method);
    const kr_config config = {.step = 0.3};
    kr_top *top = make(&s, method, config), *twin = make(&s, method, config);
    IS(kr_top_advance(top, 3.1) == KR_OK && kr_top_advance(twin, 3.1) == KR_OK);
    kr_scene bad[ALL];
    for (int i = 0; i < ALL; i++) bad[i] = s;
    bad[0].start.q.w = 2.0;
    bad[1].start.m.x = NAN;
    bad[2].start.t = INFINITY;
    bad[3].start.t = 1e17; /* the step is below its resolution */
    bad[4].start.m = v3(1e306, 1e308, 1e308);
    bad[5].start.m = v_scale(1e3, s.start.m); /* some methods refuse this with their step */
    bad[6].body.inertia.x = -1.0;
    bad[7].gravity = NAN;
    bad[8].damping.y = -1.0;
    bad[9].body = general_body(); /* some methods do not apply to it */
    for (int i = 0; i < ALL; i++) {
        kr_top *created = NULL;
        const kr_status status = kr_top_create(&bad[i], method, config, &created);
        kr_top_free(created);
        IS(status != KR_OK || i == 4 || i == 5 || i == 9);
        if (status == KR_OK) continue;
        const size_t size = bytes_of(top, before);
        IS(size > 0 && kr_top_set_scene(top, &bad[i], NULL) == status);
        IS(i >= STARTS_ALONE || kr_top_reset(top, &bad[i].start) == status);
        IS(bytes_of(top, after) == size && memcmp(before, after, size) == 0);
    }
    IS(kr_top_set_scene(top, NULL, NULL) == KR_ERR_ARGUMENT);
    IS(kr_top_set_scene(NULL, &s, NULL) == KR_ERR_ARGUMENT);
    IS(kr_top_advance(top, 6.7) == KR_OK && kr_top_advance(twin, 6.7) == KR_OK);
    IS(same(kr_top_state(top), kr_top_state(twin)));
    kr_top_free(top);
    kr_top_free(twin);
}
/* A closed form that needs more memory than the top has is refused. A top that was created with
 * this memory can become any other top, and return. */
static void test_memory_of_closed_forms(void)
{
    const kr_method *exact = kr_method_find("exact");
    const kr_config config = {0};
    const kr_vec3 m = {0.4, -0.3, 0.7};
    const kr_quat q = q_exp(v3(0.3, 0.5, 0.8));
    kr_scene flat = scene_of(v3(4, 4, 1), v3(1, 0, 0), 1.0, q, m);
    flat.start.m = v3(0.4, -0.3, 0.0); /* Goryachev-Chaplygin tops need <m, e3> = 0 */
    const kr_scene tops[] = {scene_of(v3(2, 2, 1), v3(0, 0, 1), 1.0, q, m),
                             scene_of(v3(2, 2, 1), v3(1, 0, 0), 1.0, q, m), flat};
    const size_t kowalewski = kr_exact_size(&tops[1]), flat_size = kr_exact_size(&flat);
    const int order[3] = {0, kowalewski > flat_size ? 2 : 1, kowalewski > flat_size ? 1 : 2};
    for (int i = 0; i < 3; i++) {
        kr_top *top = make(&tops[order[i]], exact, config);
        for (int k = 0; k < 9; k++) {
            const kr_scene *next = &tops[order[k * 2 % 3]];
            const kr_state was = kr_top_state(top);
            const int fits = k * 2 % 3 <= i;
            IS(kr_top_set_scene(top, next, NULL) == (fits ? KR_OK : KR_ERR_MEMORY));
            IS(same(kr_top_state(top), fits ? next->start : was));
            if (!fits) continue;
            IS(kr_top_advance(top, 2.5) == KR_OK);
            IS(same(kr_top_state(top), state_at(2.5, next, exact, config)));
        }
        kr_top_free(top);
    }
}
/* After a reset the top still watches for events, in the units of the new start. */
static void test_events(void)
{
    const kr_term vertical[] = {{1.0, kr_component_find("apex_z"), KR_COMPONENT_ONE},
                                {-0.5, KR_COMPONENT_ONE, KR_COMPONENT_ONE}};
    kr_event one = {.terms = vertical, .count = 2}, other = one;
    const kr_config config = {0};
    kr_scene s = tilted();
    kr_top *top = make(&s, taylor(), config);
    kr_event_hit hit = {-1, 0}, wanted = {-1, 0};
    IS(kr_top_watch(top, 1, &one) == KR_OK && kr_top_seek(top, 50.0, &hit) == KR_OK);
    s.start.m = v_scale(100.0, s.start.m);
    kr_top *fresh = make(&s, taylor(), config);
    IS(kr_top_watch(fresh, 1, &other) == KR_OK && kr_top_reset(top, &s.start) == KR_OK);
    for (int i = 0; i < 10; i++) {
        IS(kr_top_seek(top, 50.0, &hit) == KR_OK && kr_top_seek(fresh, 50.0, &wanted) == KR_OK);
        IS(hit.index == wanted.index && hit.direction == wanted.direction);
        IS(same(kr_top_state(top), kr_top_state(fresh)));
    }
    kr_top_free(top);
    kr_top_free(fresh);
}
/* Returns the distance of two states with their low words. */
static double distance_low(kr_state a, kr_state a_low, kr_state b, kr_state b_low)
{
    const kr_vec3 q = v_add(v_sub(q_vec(a.q), q_vec(b.q)), v_sub(q_vec(a_low.q), q_vec(b_low.q)));
    const kr_vec3 m = v_add(v_sub(a.m, b.m), v_sub(a_low.m, b_low.m));
    return v_length(q) + v_length(m) + fabs((a.q.w - b.q.w) + (a_low.q.w - b_low.q.w));
}
/* A top that is restarted at its own state continues its motion to as many digits as it has, if it
 * is given the low words of the state, and to 16 digits without them. */
static void test_low_words(kr_body body, int digits, double tol)
{
    const kr_config config = {.digits = digits};
    kr_scene s = tilted();
    s.body = body;
    kr_top *top = make(&s, taylor(), config), *whole = make(&s, taylor(), config);
    IS(kr_top_advance(whole, 7.0) == KR_OK);
    for (double t = 0.5; t < 7.0; t += 1.25) {
        IS(kr_top_advance(top, t) == KR_OK);
        const kr_state low = kr_top_describe(top).low;
        s.start = kr_top_state(top);
        IS(kr_top_set_scene(top, &s, &low) == KR_OK);
        IS(same(kr_top_state(top), s.start) && same(kr_top_describe(top).low, low));
        IS(kr_top_advance(top, t) == KR_OK && same(kr_top_describe(top).low, low));
    }
    IS(kr_top_advance(top, 7.0) == KR_OK);
    NEAR(distance_low(kr_top_state(top), kr_top_describe(top).low, kr_top_state(whole),
                      kr_top_describe(whole).low),
         0.0, tol);
    IS(kr_top_set_scene(top, &s, NULL) == KR_OK && kr_top_advance(top, 7.0) == KR_OK);
    IS(distance_low(kr_top_state(top), kr_top_describe(top).low, kr_top_state(whole),
                    kr_top_describe(whole).low) > 1e-19);
    kr_top_free(top);
    kr_top_free(whole);
}
static void test_invalid_low_words(void)
{
    const kr_config config = {.digits = 30};
    const kr_scene s = tilted();
    kr_top *top = make(&s, taylor(), config), *plain = make(&s, taylor(), (kr_config){0});
    kr_state low = {.m = {1e-20, 0.0, 0.0}};
    IS(kr_top_set_scene(top, &s, &low) == KR_OK && kr_top_describe(top).low.m.x == 1e-20);
    IS(kr_top_set_scene(top, &s, NULL) == KR_OK && kr_top_describe(top).low.m.x == 0.0);
    IS(kr_top_set_scene(plain, &s, &low) == KR_OK && kr_top_describe(plain).low.m.x == 0.0);
    kr_state bad[4] = {{.t = 1e-20}, {.q = {1e-15, 0, 0, 0}}, {.m = {0, NAN, 0}}, {.m = {0, 0, 1}}};
    for (int i = 0; i < 4; i++)
        IS(kr_top_set_scene(top, &s, &bad[i]) == KR_ERR_ARGUMENT &&
           kr_top_describe(top).low.m.x == 0.0);
    kr_top_free(top);
    kr_top_free(plain);
}
/* In the units of this start the event exceeds the range of doubles, so the search is refused. */
static void test_event_out_of_reach(void)
{
    const kr_term fast[] = {{1e200, kr_component_find("body_velocity_x"), KR_COMPONENT_ONE}};
    kr_event event = {.terms = fast, .count = 1};
    const kr_config config = {0};
    kr_scene s = tilted();
    kr_event_hit hit = {7, 7};
    s.gravity = 0.0;
    kr_top *top = make(&s, taylor(), config);
    IS(kr_top_watch(top, 1, &event) == KR_OK);
    s.start.m = v_scale(1e120, s.start.m);
    IS(kr_top_reset(top, &s.start) == KR_OK && kr_top_watch(top, 1, &event) == KR_ERR_ARGUMENT);
    IS(kr_top_seek(top, 1e-120, &hit) == KR_ERR_ARGUMENT && hit.index == 7);
    kr_top_free(top);
}

int main(void)
{
    for (size_t i = 0; kr_method_at(i); i++) test_refusals(kr_method_at(i));
    test_memory_of_closed_forms();
    test_low_words(thesis_body(), 30, 1e-28);
    test_low_words(general_body(), 30, 1e-28);
    test_low_words(general_body(), 20, 1e-19);
    test_invalid_low_words();
    test_events();
    test_event_out_of_reach();
    return check_result();
}
