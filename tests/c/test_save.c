/* Checkpoints after failures, and refusals of damaged and forged ones. The random calls of tests/fuzz
 * compare continued tops with uninterrupted ones, and load checkpoints into other tops. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include "driver/top.h"
#include "tops.h"

enum { MOST = 1 << 15 };

static kr_config config_for(const kr_method *method)
{
    const int adaptive = (kr_method_describe(method).flags & KR_METHOD_ADAPTIVE) != 0;
    return (kr_config){.step = 0.0625, .tol = adaptive ? 1e-8 : 0.0};
}
static void save(const kr_top *top, unsigned char *saved)
{
    IS(kr_top_save_size(top) < MOST && kr_top_save(top, kr_top_save_size(top), saved) == KR_OK);
}
static void load(kr_top *top, const unsigned char *saved)
{
    IS(kr_top_load(top, kr_top_save_size(top), saved) == KR_OK);
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
/* A top that was saved after a failure goes on, if the loaded top has no such limit, with the bits
 * of an uninterrupted run. A state that is not finite fails again. */
static void test_after_failures(void)
{
    static unsigned char saved[MOST];
    const kr_method *rk4 = kr_method_find("rk4");
    const kr_config plain = {.step = 0.0625}, wild = {.step = 3.0};
    int left = 1;
    const struct {
        kr_config config, loaded;
        kr_status status;
    } runs[] = {{{.step = 0.0625, .max_steps = 1000}, plain, KR_ERR_LIMIT},
                {{.step = 0.0625, .poll = stop_at, .context = &left}, plain, KR_ERR_INTERRUPTED},
                {wild, wild, KR_ERR_NOT_FINITE}};
    for (int i = 0; i < 3; i++) {
        kr_scene s = tilted();
        if (i == 2) s.start.m = v3(20.0, 30.0, 5.0);
        kr_top *top = make(&s, rk4, runs[i].config), *on = make(&s, rk4, runs[i].loaded);
        IS(kr_top_advance(top, 3.0) == KR_OK && kr_top_advance(top, 1e4) == runs[i].status);
        save(top, saved);
        load(on, saved);
        IS(same(kr_top_state(on), kr_top_state(top)));
        if (i < 2)
            IS(kr_top_advance(on, 1e3) == KR_OK &&
               same(kr_top_state(on), state_at(1e3, &s, rk4, plain)));
        else
            IS(kr_top_advance(on, 1e4) == KR_ERR_NOT_FINITE);
        kr_top_free(top);
        kr_top_free(on);
    }
}

/* If any byte was changed or is missing, the checkpoint is refused and the top is unchanged. */
static void test_refusals(const char *name)
{
    static unsigned char saved[MOST], bad[MOST];
    const kr_method *method = kr_method_find(name);
    const kr_scene s = scene_for(method);
    kr_top *top = make(&s, method, config_for(method)),
           *whole = make(&s, method, config_for(method));
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
enum {
    HEADER = 104,
    TOP = offsetof(kr_top, body) + sizeof(body_dd),
    MAIN = HEADER + offsetof(kr_top, main)
};
/* Checks that a checkpoint with this number at this place is refused, although the checksum is
 * correct. */
static void check_forged(kr_top *top, const unsigned char *saved, size_t at, int64_t number,
                         size_t width)
{
    static unsigned char bad[MOST];
    const size_t size = kr_top_save_size(top);
    memcpy(bad, saved, size);
    forge(bad, size, at, number, width);
    if (kr_top_load(top, size, bad) != KR_ERR_CHECKPOINT)
        printf("%s: %d at %d\n", top->method->name, (int)number, (int)at);
    IS(kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT);
}
/* Counts, indices, times and steps outside their ranges are refused, in each stored motion. */
static void test_hostile_numbers(const kr_method *method)
{
    static unsigned char saved[MOST], good[MOST];
    const kr_scene s = scene_for(method);
    kr_top *top = make(&s, method, config_for(method));
    const size_t size = kr_top_save_size(top), stats = offsetof(kr_motion, stats),
                 steps = HEADER + offsetof(kr_top, steps);
    const int64_t endless = ((int64_t)1 << 62) + 1, back = (int64_t)0xbff0000000000000u;
    const double late = 1e300;
    int64_t late_bits;
    memcpy(&late_bits, &late, sizeof late_bits);
    save(top, saved);
    memcpy(good, saved, size);
    forge(good, size, MAIN + 168, 0, sizeof(int));
    IS(kr_top_load(top, size, good) == KR_OK); /* the checksum of this test is correct */
    for (int kept = 0; kept < (method->at ? 1 : 2); kept++) {
        const size_t motion = HEADER + (kept ? offsetof(kr_top, saved) : offsetof(kr_top, main));
        for (size_t i = 8; i <= 24; i += 8) {
            check_forged(top, saved, motion + stats + i, -1, 8);
            check_forged(top, saved, motion + stats + i, endless, 8);
        }
        check_forged(top, saved, motion + offsetof(kr_motion, step), back, 8);
    }
    check_forged(top, saved, steps, endless, 8);
    check_forged(top, saved, steps, (int64_t)1 << 40, 8); /* more than recovery would repeat */
    check_forged(top, saved, HEADER + offsetof(kr_top, saved_steps), 1, 8);
    check_forged(top, saved, HEADER + offsetof(kr_scene, start.q), endless, 8);
    check_forged(top, saved, HEADER + offsetof(kr_scene, start.t), late_bits, 8);
    check_forged(top, saved, MAIN + 168, 77, sizeof(int));
    check_forged(top, saved, MAIN + 172, 77, sizeof(int));
    const size_t numbers[] = {HEADER + offsetof(kr_top, steps),
                              HEADER + offsetof(kr_top, saved_steps),
                              HEADER + offsetof(kr_top, forward)};
    for (int i = 0; i < 3; i++) check_forged(top, saved, numbers[i], -77, 8);
    kr_top_free(top);
}
/* Loop counts in the work of a method are refused if they are below 1 or large. */
static void test_hostile_work(const char *name)
{
    static unsigned char saved[MOST], bad[MOST];
    static const int32_t numbers[] = {-1, 0, 100000};
    const kr_method *method = kr_method_find(name);
    const kr_scene s = scene_for(method);
    kr_top *top = make(&s, method, config_for(method));
    const size_t size = kr_top_save_size(top);
    int refused[3] = {0};
    save(top, saved);
    for (size_t at = HEADER + TOP; at + 4 <= HEADER + TOP + 8 * method->work; at += 4)
        for (int i = 0; i < 3; i++) {
            memcpy(bad, saved, size);
            forge(bad, size, at, numbers[i], 4);
            refused[i] += kr_top_load(top, size, bad) == KR_ERR_CHECKPOINT;
        }
    IS(refused[0] > 0 && refused[1] > 0 && refused[2] > 0);
    kr_top_free(top);
}

int main(void)
{
    test_hostile_work("suzuki4");
    test_hostile_work("kahan_li8");
    test_hostile_work("takahashi_imada4");
    test_hostile_work("extrap");
    test_hostile_work("extrap_kirchhoff");
    for (size_t i = 0; kr_method_at(i); i++) test_hostile_numbers(kr_method_at(i));
    for (double share = 0.125; share <= 2.0; share += 0.125) test_failure_after_load(share);
    test_after_failures();
    test_refusals("taylor");
    test_refusals("extrap");
    return check_result();
}
