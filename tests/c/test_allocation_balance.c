/* Heap use of tops: every method frees what it allocates, whichever way a run ends (tested with
 * glibc 2.33 or later; AddressSanitizer has its own heap, and reports memory that is lost), and
 * working memory is aligned to cache lines. */
#include <stdlib.h>
#include "driver/top.h"
#include "tops.h"
#if defined __SANITIZE_ADDRESS__ /* gcc */
#  define OTHER_HEAP
#elif defined __has_feature /* clang */
#  if __has_feature(address_sanitizer)
#    define OTHER_HEAP
#  endif
#endif
#if defined __GLIBC__ && (__GLIBC__ > 2 || __GLIBC_MINOR__ >= 33) && !defined OTHER_HEAP
#  include <malloc.h>
enum { IS_MEASURED = 1 };
static size_t in_use(void) { return mallinfo2().uordblks; }
#else
enum { IS_MEASURED = 0 };
static size_t in_use(void) { return 0; }
#endif

enum { MOST = 1 << 15, LIVES = 200, LEAST = 32 /* least bytes that an allocation takes */ };

static int stop(void *context) { return ++*(int *)context > 2; }
/* Creates a top and frees it again. In between, the top advances, searches, saves, loads, resets,
 * fails and refuses calls. */
static void use_and_free_top(const kr_method *method, const kr_scene *s)
{
    static unsigned char saved[MOST];
    const kr_term turning[] = {{1.0, kr_component_find("apex_z"), KR_COMPONENT_ONE}};
    kr_event event = {.terms = turning, .count = 1, .extremum = 1};
    int calls = 0;
    const kr_config config = {.step = 0.05, .max_steps = 300, .poll = stop, .context = &calls},
                    wrong = {.step = NAN};
    kr_scene bad = *s;
    kr_state out[2];
    kr_event_hit hit;
    size_t done;
    const double t[2] = {0.5, 1e3};
    kr_top *top = NULL, *none = NULL;
    bad.start.m.x = NAN;
    IS(kr_top_create(&bad, method, config, &none) != KR_OK && !none);
    IS(kr_top_create(s, method, wrong, &none) != KR_OK && !none);
    if (kr_top_create(s, method, config, &top) != KR_OK) return;
    (void)kr_top_watch(top, 1, &event);
    const size_t size = kr_top_save_size(top);
    IS(size <= MOST && kr_top_save(top, size, saved) == KR_OK);
    (void)kr_top_seek(top, 0.3, &hit);
    (void)kr_top_record(top, 2, t, out, NULL, &done);
    (void)kr_top_reset(top, &bad.start);
    (void)kr_top_reset(top, &s->start);
    (void)kr_top_step(top);
    IS(kr_top_load(top, size, saved) == KR_OK && kr_top_load(top, size - 1, saved) != KR_OK);
    kr_top_free(top);
}
/* The loss of one block with each top would be measured. The heap counts a few blocks that were
 * freed before as in use, so the blocks are larger than necessary. */
static void test_measure(void)
{
    void *lost[LIVES];
    const size_t before = in_use();
    for (int i = 0; i < LIVES; i++) lost[i] = malloc(2 * LEAST);
    IS(in_use() >= before + LIVES * LEAST);
    for (int i = 0; i < LIVES; i++) free(lost[i]);
}
/* The heap may make a few blocks larger than requested, but memory lost with each top would
 * accumulate. */
static void test_balance(const kr_method *method)
{
    kr_scene s = tilted();
    if (!kr_method_applies(method, &s.body)) s.body.com = v3(0, 0, 0);
    for (int i = 0; i < 3; i++) use_and_free_top(method, &s);
    const size_t before = in_use();
    for (int i = 0; i < LIVES; i++) use_and_free_top(method, &s);
    IS(in_use() < before + LIVES * LEAST);
}
/* The memory of steps and tangents is aligned to cache lines, wherever the heap places a top. */
static void test_cache_line_alignment(void)
{
    enum { TOPS = 8, LINE = 64 };
    const kr_scene s = tilted();
    const kr_config config = {.tangents = KR_TANGENT_START};
    kr_top *tops[TOPS];
    void *between[TOPS];
    for (int i = 0; i < TOPS; i++) {
        tops[i] = make(&s, taylor(), config);
        between[i] = malloc(24 + 16 * (size_t)i);
        IS((uintptr_t)tops[i]->main.work % LINE == 0 && (uintptr_t)tops[i]->tangents % LINE == 0);
    }
    for (int i = 0; i < TOPS; i++) {
        kr_top_free(tops[i]);
        free(between[i]);
    }
}

int main(void)
{
    if (IS_MEASURED) test_measure();
    for (size_t i = 0; kr_method_at(i); i++) test_balance(kr_method_at(i));
    test_cache_line_alignment();
    kr_top_free(NULL);
    return check_result();
}
