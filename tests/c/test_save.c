/* Checkpoints: every method resumes bitwise as in an uninterrupted run, and damaged checkpoints are
 * refused. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include "driver/top.h"
#include "random.h"
#include "tops.h"

enum { BEFORE = 7, AFTER = 6, MOST = 1 << 15 };
static const double times[BEFORE + AFTER] = {0.5,   0.75, 0.8,   2.3,  9.99,   10.0, 10.01,
                                             10.01, 10.3, 12.75, 20.0, 20.003, 77.7};

static kr_config config_for(const kr_method *method, double sign, int digits)
{
    const int adaptive = (kr_method_flags(method) & KR_METHOD_ADAPTIVE) != 0;
    const kr_config config = {
        .step = sign * 0.0625, .tol = adaptive && !digits ? 1e-8 : 0.0, .digits = digits};
    return config;
}
static void save(const kr_top *top, unsigned char *saved)
{
    IS(kr_top_save_size(top) < MOST && kr_top_save(top, kr_top_save_size(top), saved) == KR_OK);
}
static void load(kr_top *top, const unsigned char *saved)
{
    IS(kr_top_load(top, kr_top_save_size(top), saved) == KR_OK);
}
/* One top runs without a stop. Another top stops before each of the times and is saved to an odd
 * address, and a third top continues from the checkpoint. */
static void test_continuation(const kr_method *method, double sign, int digits, int leave_heading)
{
    static unsigned char saved[MOST];
    const kr_scene s = scene_for(method);
    kr_config config = config_for(method, sign, digits);
    kr_state whole[BEFORE + AFTER], low[BEFORE + AFTER], part, rest;
    double t[BEFORE + AFTER];
    config.skip_heading = leave_heading;
    kr_top *top = make(&s, method, config), *one = make(&s, method, config);
    for (int i = 0; i < BEFORE + AFTER; i++) t[i] = sign * times[i];
    IS(kr_top_record_low(top, BEFORE + AFTER, t, whole, low, NULL) == KR_OK);
    for (int i = 0; i < BEFORE + AFTER; i++) {
        kr_top *other = make(&s, method, config);
        save(one, saved + 1);
        load(other, saved + 1);
        IS(same(kr_top_state(one), kr_top_state(other)));
        kr_top_free(one);
        one = other;
        IS(kr_top_record_low(one, 1, &t[i], &part, &rest, NULL) == KR_OK);
        IS(same(part, whole[i]) && same(rest, low[i]));
    }
    const kr_stats all = kr_top_stats(top), parts = kr_top_stats(one);
    IS(memcmp(&all, &parts, sizeof all) == 0);
    kr_top_free(top);
    kr_top_free(one);
}

/* After a checkpoint at the last valid state, the loaded top behaves like the saved top: a side
 * step off the grid may succeed, and the next step fails. */
static void test_failure_after_load(double share)
{
    static unsigned char saved[MOST];
    const kr_scene s = kr_scene_default();
    const kr_method *rk4 = kr_method_find("rk4");
    const kr_config config = {.step = 1.0};
    kr_state elsewhere = s.start;
    kr_top *never = make(&s, rk4, config), *top = make(&s, rk4, config),
           *other = make(&s, rk4, config);
    IS(kr_top_advance(never, 1e4) == KR_ERR_NOT_FINITE);
    const kr_state last = kr_top_state(never);
    IS(last.t > 8.0 && kr_top_advance(top, last.t) == KR_OK);
    save(top, saved);
    elsewhere.m = v_scale(0.5, elsewhere.m);
    IS(kr_top_reset(other, &elsewhere) == KR_OK && kr_top_advance(other, 4.0) == KR_OK);
    load(other, saved);
    const double end = last.t + share;
    const kr_status status = kr_top_advance(top, end);
    IS(status != KR_OK || share < 1.0);
    IS(kr_top_advance(other, end) == status && same(kr_top_state(other), kr_top_state(top)));
    IS(other->steps == top->steps);
    IS(memcmp(other->main.work, top->main.work, rk4->work * sizeof(double)) == 0);
    kr_top_free(never);
    kr_top_free(top);
    kr_top_free(other);
}
static void test_after_a_limit(void)
{
    static unsigned char saved[MOST];
    const kr_scene s = tilted();
    const kr_method *rk4 = kr_method_find("rk4");
    const kr_config limited = {.step = 0.0625, .max_steps = 1000}, config = {.step = 0.0625};
    kr_top *top = make(&s, rk4, limited), *on = make(&s, rk4, config);
    IS(kr_top_advance(top, 50.0) == KR_OK && kr_top_advance(top, 100.0) == KR_ERR_LIMIT);
    save(top, saved);
    load(on, saved);
    IS(kr_top_advance(on, 100.0) == KR_OK);
    IS(same(kr_top_state(on), state_at(100.0, &s, rk4, config)));
    kr_top_free(top);
    kr_top_free(on);
}
static int stop(void *context) { return --*(int *)context < 0; }
static void test_after_an_interruption(void)
{
    static unsigned char saved[MOST];
    const kr_scene s = tilted();
    const kr_method *rk4 = kr_method_find("rk4");
    const double late[] = {1.0, 100.0};
    int left = 1;
    const kr_config plain = {.step = 0.0625},
                    config = {.step = 0.0625, .poll = stop, .context = &left};
    kr_state out[2];
    kr_top *top = make(&s, rk4, config), *on = make(&s, rk4, config);
    IS(kr_top_record(top, 2, late, out, NULL) == KR_ERR_INTERRUPTED);
    IS(kr_top_time(top) == 512 * 0.0625);
    save(top, saved);
    left = 1000;
    load(on, saved);
    IS(kr_top_advance(on, 100.0) == KR_OK);
    IS(same(kr_top_state(on), state_at(100.0, &s, rk4, plain)));
    kr_top_free(top);
    kr_top_free(on);
}
static void test_after_a_failure(void)
{
    static unsigned char saved[MOST];
    const kr_method *rk4 = kr_method_find("rk4");
    const kr_config config = {.step = 3.0};
    const double wild[] = {3.0, 1e4};
    kr_scene s = tilted();
    kr_state out[2];
    s.start.m = v3(20.0, 30.0, 5.0);
    kr_top *top = make(&s, rk4, config), *on = make(&s, rk4, config);
    IS(kr_top_record(top, 2, wild, out, NULL) == KR_ERR_NOT_FINITE);
    save(top, saved);
    load(on, saved);
    IS(kr_top_advance(on, 1e4) == KR_ERR_NOT_FINITE);
    IS(same(kr_top_state(on), kr_top_state(top)));
    kr_top_free(top);
    kr_top_free(on);
}

/* If any byte was changed or is missing, the checkpoint is refused and the top is unchanged. */
static void test_refusals(const char *name)
{
    static unsigned char saved[MOST], bad[MOST];
    const kr_method *method = kr_method_find(name);
    const kr_scene s = scene_for(method);
    kr_top *top = make(&s, method, config_for(method, 1.0, 0)),
           *whole = make(&s, method, config_for(method, 1.0, 0));
    const size_t size = kr_top_save_size(top);
    IS(kr_top_advance(top, 5.01) == KR_OK && kr_top_advance(whole, 5.01) == KR_OK);
    IS(kr_top_save(whole, size, saved) == KR_OK);
    for (size_t i = 0; i < size; i++) {
        memcpy(bad, saved, size);
        bad[i] = (unsigned char)(bad[i] ^ (1 << random_bits() % 8));
        IS(kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT);
    }
    for (int round = 0; round < 1000; round++) {
        memcpy(bad, saved, size);
        for (size_t i = random_bits() % size; i < size; i++) bad[i] = (unsigned char)random_bits();
        IS(kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT);
    }
    for (size_t n = 0; n < size; n++) IS(kr_top_load(top, n, saved) == KR_ERR_CHECKPOINT);
    IS(kr_top_load(top, size + 8, bad) == KR_ERR_CHECKPOINT &&
       kr_top_save(top, size - 8, bad) == KR_ERR_ARGUMENT);
    IS(kr_top_load(NULL, size, saved) == KR_ERR_ARGUMENT &&
       kr_top_load(top, size, NULL) == KR_ERR_ARGUMENT);
    IS(kr_top_save(NULL, size, bad) == KR_ERR_ARGUMENT &&
       kr_top_save(top, size, NULL) == KR_ERR_ARGUMENT);
    IS(kr_top_save_size(NULL) == 0);
    IS(kr_top_advance(top, 9.0) == KR_OK && kr_top_advance(whole, 9.0) == KR_OK);
    IS(same(kr_top_state(top), kr_top_state(whole)));
    kr_top_free(top);
    kr_top_free(whole);
}
static void test_foreign_checkpoint(void)
{
    static unsigned char saved[MOST];
    const kr_method *strang = kr_method_find("strang");
    kr_scene s = scene_for(strang), heavier = s;
    const kr_config config = {.step = 0.0625}, finer = {.step = 0.03125};
    heavier.gravity = 1.5;
    kr_top *top = make(&s, strang, config);
    kr_top *others[] = {make(&heavier, strang, config), make(&s, strang, finer),
                        make(&s, kr_method_find("rk4"), config)};
    IS(kr_top_save(top, kr_top_save_size(top), saved) == KR_OK);
    for (int i = 0; i < 3; i++) {
        IS(kr_top_load(others[i], kr_top_save_size(top), saved) == KR_ERR_CHECKPOINT);
        kr_top_free(others[i]);
    }
    kr_top_free(top);
}

static void forget_pointers(kr_top *top)
{
    kr_motion *motions[] = {&top->main, &top->side, &top->saved};
    top->method = NULL;
    top->config.poll = NULL;
    top->config.context = NULL;
    for (int i = 0; i < 3; i++) {
        motions[i]->work = NULL;
        motions[i]->aux = NULL;
        motions[i]->scene = NULL;
    }
}
static int same_bytes(const void *a, const void *b, size_t size) { return memcmp(a, b, size) == 0; }
static double double_at(const unsigned char *saved, size_t at)
{
    double number;
    memcpy(&number, saved + at, sizeof number);
    return number;
}
/* The bytes of a checkpoint are the fields of the top, each at the place that top.h gives. */
static void test_format(const kr_method *method)
{
    enum { HEADER = 104, TOP = 1496, MAIN = HEADER + 400, KEPT = HEADER + 976 };
    static unsigned char saved[MOST];
    const kr_scene s = scene_for(method);
    const size_t work = sizeof(double) * method->work;
    int left = MOST; /* none of the bytes belongs to a pointer */
    kr_config config = config_for(method, 1.0, 0);
    config.poll = stop, config.context = &left;
    kr_top *top = make(&s, method, config);
    const size_t size = HEADER + TOP + (method->at ? 1 : 2) * work;
    IS(kr_top_advance(top, 5.01) == KR_OK && kr_top_save_size(top) == size);
    IS(kr_top_save(top, size, saved) == KR_OK);
    IS(memcmp(saved, "kreisel top\0\0\0\0\0" KR_VERSION, 16 + sizeof KR_VERSION) == 0);
    IS(same_bytes(saved + HEADER + TOP, top->main.work, work));
    if (!method->at) IS(same_bytes(saved + HEADER + TOP + work, top->saved.work, work));
    IS(double_at(saved, HEADER) == s.body.mass && double_at(saved, HEADER + 1360) == 5.01);
    IS(double_at(saved, HEADER + 1368) == 5.01 &&
       double_at(saved, HEADER + 1368 + 40) == kr_top_state(top).m.x);
    kr_top image = *top;
    forget_pointers(&image);
#define X(field, at) IS(same_bytes(saved + HEADER + (at), &image.field, sizeof image.field));
    KR_SAVED_TOP(X)
#undef X
#define X(field, at)                                                                               \
    IS(same_bytes(saved + MAIN + (at), &image.main.field, sizeof image.main.field));               \
    IS(same_bytes(saved + KEPT + (at), &image.saved.field, sizeof image.saved.field));
    KR_SAVED_MOTION(X)
#undef X
    kr_top_free(top);
}

/* Writes a number into a checkpoint, and the corresponding checksum. */
static void forge(unsigned char *saved, size_t size, size_t at, int64_t number, size_t width)
{
    uint64_t sum = 0xcbf29ce484222325, word;
    memcpy(saved + at, &number, width);
    for (size_t i = 104; i + sizeof word <= size; i += sizeof word) {
        memcpy(&word, saved + i, sizeof word);
        sum = (sum ^ word) * 0x100000001b3;
        sum ^= sum >> 29;
    }
    memcpy(saved + 96, &sum, sizeof sum);
}
/* Invalid counts and a step against the direction of time are refused in each stored motion of a
 * top. Invalid step numbers and an invalid start are refused, too, although the checksum is
 * correct. */
static void test_hostile_counts(const kr_method *method)
{
    enum { HEADER = 104 };
    const size_t step = offsetof(kr_motion, step), stats = offsetof(kr_motion, stats);
    static unsigned char saved[MOST], bad[MOST];
    const kr_scene s = scene_for(method);
    kr_top *top = make(&s, method, config_for(method, 1.0, 0));
    const size_t size = kr_top_save_size(top);
    const int64_t endless = ((int64_t)1 << 62) + 1, back = (int64_t)0xbff0000000000000u;
    save(top, saved);
    for (int kept = 0; kept < (method->at ? 1 : 2); kept++) {
        const size_t motion = HEADER + (kept ? offsetof(kr_top, saved) : offsetof(kr_top, main));
        for (int i = 0; i < 7; i++) {
            memcpy(bad, saved, size);
            forge(bad, size, motion + (i == 6 ? step : stats + 8 + 8 * ((size_t)i % 3)),
                  i == 6  ? back
                  : i < 3 ? -1
                          : endless,
                  8);
            IS(kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT);
        }
    }
    const size_t places[] = {HEADER + offsetof(kr_top, steps),
                             HEADER + offsetof(kr_top, saved_steps),
                             HEADER + offsetof(kr_scene, start.q)};
    for (int i = 0; i < 3; i++) {
        memcpy(bad, saved, size);
        forge(bad, size, places[i], i == 1 ? 1 : endless, 8);
        IS(kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT);
    }
    kr_top_free(top);
}
/* Indices and loop counts outside their ranges are refused, although the checksum is correct. */
static void test_hostile_numbers(const kr_method *method)
{
    enum { HEADER = 104, TOP = 1496, MAIN = HEADER + 400 };
    static unsigned char saved[MOST], bad[MOST];
    static const char *const counting[] = {"extrap", "extrap_kirchhoff", "kahan_li8", "suzuki4"};
    const kr_scene s = scene_for(method);
    kr_top *top = make(&s, method, config_for(method, 1.0, 0));
    const size_t size = kr_top_save_size(top);
    save(top, saved);
    memcpy(bad, saved, size);
    forge(bad, size, MAIN + 168, 0, sizeof(int));
    IS(kr_top_load(top, size, bad) == KR_OK); /* the checksum of this test is correct */
    const size_t numbers[] = {MAIN + 168, MAIN + 172, HEADER + 1264, HEADER + 1272, HEADER + 392};
    for (int i = 0; i < 5; i++) {
        memcpy(bad, saved, size);
        forge(bad, size, numbers[i], i < 2 ? 77 : -77, i < 2 ? sizeof(int) : 8);
        IS(kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT);
    }
    /* For methods with loop counts in their work, some integer from 1 to 99 is refused if it is
     * replaced by a large one. */
    int refused = 0;
    for (size_t at = HEADER + TOP; at + 4 <= HEADER + TOP + 8 * method->work; at += 4) {
        int32_t number;
        memcpy(&number, saved + at, sizeof number);
        if (number < 1 || number > 99) continue;
        memcpy(bad, saved, size);
        forge(bad, size, at, 100000, sizeof number);
        refused += kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT;
    }
    for (int i = 0; i < 4; i++) IS(strcmp(counting[i], method->name) != 0 || refused > 0);
    kr_top_free(top);
}
/* A start beyond the horizon is refused, and so are more steps than recovery would repeat. */
static void test_hostile_times(const kr_method *method)
{
    enum { HEADER = 104 };
    static unsigned char saved[MOST], bad[MOST];
    const kr_scene s = scene_for(method);
    kr_top *top = make(&s, method, config_for(method, 1.0, 0));
    const size_t size = kr_top_save_size(top);
    const double late = 1e300;
    int64_t bits;
    save(top, saved);
    memcpy(&bits, &late, sizeof bits);
    memcpy(bad, saved, size);
    forge(bad, size, HEADER + offsetof(kr_scene, start.t), bits, 8);
    IS(kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT);
    memcpy(bad, saved, size);
    forge(bad, size, HEADER + offsetof(kr_top, steps), (int64_t)1 << 40, 8);
    IS(kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT);
    forge(bad, size, HEADER + offsetof(kr_top, steps), ((int64_t)1 << 53) + 1, 8);
    forge(bad, size, HEADER + offsetof(kr_top, saved_steps), ((int64_t)1 << 53) + 1, 8);
    IS(kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT);
    kr_top_free(top);
}
/* Loop counts below 1 in the work of a method are refused. */
static void test_hostile_work(const char *name)
{
    enum { HEADER = 104, TOP = 1496 };
    static unsigned char saved[MOST], bad[MOST];
    const kr_method *method = kr_method_find(name);
    const kr_scene s = scene_for(method);
    kr_top *top = make(&s, method, config_for(method, 1.0, 0));
    const size_t size = kr_top_save_size(top);
    int refused = 0;
    save(top, saved);
    for (size_t at = HEADER + TOP; at + 4 <= HEADER + TOP + 8 * method->work; at += 4)
        for (int number = -1; number < 1; number++) {
            memcpy(bad, saved, size);
            forge(bad, size, at, number, 4);
            refused += kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT;
        }
    IS(refused > 0);
    kr_top_free(top);
}

int main(void)
{
    test_hostile_work("suzuki4");
    test_hostile_work("takahashi_imada4");
    test_hostile_work("extrap");
    for (size_t i = 0; i < kr_method_count(); i++) {
        test_hostile_numbers(kr_method_at(i));
        test_hostile_counts(kr_method_at(i));
        test_hostile_times(kr_method_at(i));
    }
    if (sizeof(void *) == 8)
        for (size_t i = 0; i < kr_method_count(); i++) test_format(kr_method_at(i));

    for (size_t i = 0; i < kr_method_count(); i++)
        for (double sign = 1.0; sign > -2.0; sign -= 2.0)
            test_continuation(kr_method_at(i), sign, 0, 0);
    for (int digits = 16; digits <= 30; digits += 7)
        test_continuation(kr_method_find("taylor"), 1.0, digits, 0);
    test_continuation(kr_method_find("taylor"), -1.0, 0, 1);
    for (double share = 0.125; share <= 2.0; share += 0.125) test_failure_after_load(share);
    test_after_a_limit();
    test_after_an_interruption();
    test_after_a_failure();
    test_refusals("taylor");
    test_refusals("extrap");
    test_foreign_checkpoint();
    return check_result();
}
