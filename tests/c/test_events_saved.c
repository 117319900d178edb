/* Checkpoints and resets of tops that watch for events. */
#include "driver/top.h"
#include "taylor/taylor.h"
#include "event_helpers.h"

static kr_term height; /* of the apex; set by main */

static void second_is_unlike(const kr_scene *s)
{
    static char memory[1 << 16];
    kr_event e[2] = {{.terms = &height, .count = 1, .extremum = 1}, {.terms = &height, .count = 1}};
    kr_event f[2] = {e[0], e[1]};
    f[1].direction = 1;
    kr_top *top = watched(s, (kr_config){0}, e, 2), *other = watched(s, (kr_config){0}, f, 2);
    const size_t size = kr_top_save_size(top);
    IS(size <= sizeof memory && kr_top_save(top, size, memory) == KR_OK);
    IS(kr_top_load(other, size, memory) == KR_ERR_CHECKPOINT);
    IS(kr_top_load(top, size, memory) == KR_OK);
    kr_top_free(top);
    kr_top_free(other);
}
/* Checks that all nonzero values of `extremum` are equivalent. */
static void alike(const kr_scene *s)
{
    static char memory[1 << 16];
    kr_event e = {.terms = &height, .count = 1, .extremum = 1}, f = e;
    f.extremum = 2;
    kr_top *top = watched(s, (kr_config){0}, &e, 1), *other = watched(s, (kr_config){0}, &f, 1);
    const size_t size = kr_top_save_size(top);
    IS(kr_top_save(top, size, memory) == KR_OK && kr_top_load(other, size, memory) == KR_OK);
    kr_top_free(top);
    kr_top_free(other);
}
/* A checkpoint with other events, with more events, or with an impossible state of the search is
 * refused. */
static void test_refused_load(void)
{
    static char memory[1 << 16], before[1 << 16];
    const kr_scene s = event_scene(2);
    kr_event e = {.terms = &height, .count = 1, .extremum = 1};
    const kr_event unlike[] = {
        {.terms = &height, .count = 1},
        {.terms = &height, .count = 1, .extremum = 1, .direction = 1},
        {.terms = &height, .count = 1, .extremum = 1, .condition = &height, .condition_count = 1}};
    const kr_event_search odd[] = {
        {-2, 0.0, 0.0, 0, 0}, {1 << 20, 0.0, 0.0, 0, 0}, {0, NAN, 0.0, 0, 0}, {0, -1.0, 0.0, 0, 0},
        {0, 3.0, 0.0, 0, 0},  {0, 0.0, INFINITY, 0, 0},  {0, 0.0, 0.0, 2, 0}, {0, 0.0, 0.0, -2, 0},
        {0, 0.0, 0.0, 0, -2}, {0, 0.0, 0.0, 0, 2}};
    kr_top *top = watched(&s, (kr_config){0}, &e, 1);
    const size_t size = kr_top_save_size(top);
    kr_event_hit hit;
    IS(kr_top_seek(top, 9.0, &hit) == KR_OK && kr_top_save(top, size, before) == KR_OK);
    for (size_t i = 0; i < sizeof unlike / sizeof *unlike; i++) {
        kr_event f = unlike[i];
        kr_top *other = watched(&s, (kr_config){0}, &f, 1);
        IS(kr_top_save_size(other) == size);
        IS(kr_top_load(other, size, before) == KR_ERR_CHECKPOINT &&
           kr_event_load_search(&f).searched == -1);
        IS(kr_top_watch(other, 0, NULL) == KR_OK);
        IS(kr_top_load(other, kr_top_save_size(other), before) == KR_ERR_CHECKPOINT);
        kr_top_free(other);
    }
    second_is_unlike(&s);
    alike(&s);
    const kr_event_search own = kr_event_load_search(&e);
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        kr_event_store_search(&e, odd[i]);
        IS(kr_top_save(top, size, memory) == KR_OK);
        kr_event_store_search(&e, own);
        IS(kr_top_load(top, size, memory) == KR_ERR_CHECKPOINT);
        IS(memcmp(e.private_, &own, sizeof own) == 0);
    }
    IS(kr_top_load(top, size, before) == KR_OK);
    kr_top_free(top);
}

int main(void)
{
    height = term(1.0, "apex_z", "1");
    test_refused_load();
    return check_result();
}
