/* Threads, each with tops of every method, all get bitwise equal results. A second build uses the
 * race detector of the compiler if it has one. */
#include <pthread.h>
#include "tops.h"

enum {
    THREADS = 4,
    TIMES = 8,
    METHODS = 32,
    TOPS = 11,
    MANY = 2 * TOPS,
    STATES = METHODS * (TIMES + 3) + TIMES + 2 + MANY
};
static const kr_term height = {1.0, 0, 0};

static kr_top *top_of(const kr_method *method, kr_config config)
{
    const kr_scene s = scene_for(method);
    kr_top *top = NULL;
    return kr_top_create(&s, method, config, &top) == KR_OK ? top : NULL;
}
/* Advances a top, and searches an event if the method supports events. */
static void use_top(const kr_method *method, kr_state out[TIMES + 3])
{
    static const double t[TIMES] = {0.1, 0.25, 0.3, 0.55, 0.6, 0.7, 0.95, 1.5};
    static unsigned char nothing[8];
    const kr_config config = {.step = 0.05};
    unsigned char saved[40000];
    kr_term terms[] = {height, {-0.5, KR_COMPONENT_ONE, KR_COMPONENT_ONE}};
    terms[0].first = kr_component_find("apex_z");
    kr_event event = {.terms = terms, .count = 2};
    kr_top *top = top_of(method, config), *other = top_of(method, config);
    kr_event_hit hit;
    if (!top || !other) return;
    kr_top_record(top, TIMES, t, out, NULL, NULL);
    if (kr_top_watch(top, 1, &event) == KR_OK) kr_top_seek(top, 9.0, &hit);
    out[TIMES] = kr_top_state(top);
    const size_t size = kr_top_save_size(top);
    if (size <= sizeof saved && kr_top_save(top, size, saved) == KR_OK)
        kr_top_load(other, size, saved);
    kr_top_load(other, sizeof nothing, nothing);
    kr_top_step(other);
    out[TIMES + 1] = kr_top_state(other);
    kr_top_reset(other, &out[TIMES]);
    kr_top_advance(other, out[TIMES].t + 0.2);
    out[TIMES + 2] = kr_top_state(other);
    kr_top_free(top);
    kr_top_free(other);
}
/* Computes tops of two kinds in one call, in lanes and by the closed form. */
static void use_worker(kr_state out[MANY])
{
    static const double t[2] = {0.7, 5.0};
    const kr_config config = {0};
    kr_scene scenes[TOPS];
    kr_outcome outcomes[TOPS];
    const kr_tops tops = {
        .n = TOPS, .scenes = scenes, .times = 2, .t = t, .states = out, .outcomes = outcomes};
    kr_worker *worker = NULL;
    for (int i = 0; i < TOPS; i++) {
        scenes[i] = i % 3 ? asymmetric() : tilted();
        scenes[i].start.m.x += 0.1 * i;
    }
    if (kr_worker_create(NULL, config, 0, NULL, &worker) == KR_OK) kr_worker_run(worker, &tops);
    kr_worker_free(worker);
}
static void *use_all(void *memory)
{
    static const double t[TIMES] = {-3.0, -1.0, 0.0, 1.0, 10.0, 100.0, 1000.0, 1e6};
    kr_state *out = memory;
    const kr_scene s = tilted();
    double memory_of_exact[KR_EXACT_SIZE / sizeof(double)];
    kr_exact *exact = (kr_exact *)(void *)memory_of_exact;
    memset(out, 0, STATES * sizeof *out);
    for (size_t i = 0; kr_method_at(i); i++) use_top(kr_method_at(i), out + i * (TIMES + 3));
    out += METHODS * (TIMES + 3);
    if (kr_exact_plan(&s, 0.0, exact) == KR_OK) kr_exact_states(exact, TIMES, t, out);
    kr_quantity_values(kr_quantity_find("energy"), &s, 1, &s.start, &out[TIMES + 1].t);
    use_worker(out + TIMES + 2);
    return NULL;
}

int main(void)
{
    static kr_state alone[STATES], out[THREADS][STATES];
    pthread_t thread[THREADS];
    IS(!kr_method_at(METHODS));
    for (int i = 0; i < THREADS; i++) IS(!pthread_create(&thread[i], NULL, use_all, out[i]));
    for (int i = 0; i < THREADS; i++) IS(!pthread_join(thread[i], NULL));
    use_all(alone);
    for (int i = 0; i < THREADS; i++) IS(memcmp(out[i], alone, sizeof alone) == 0);
    for (size_t i = 0; kr_method_at(i); i++) IS(alone[i * (TIMES + 3) + TIMES + 2].t > 0.2);
    for (int i = 1; i <= MANY; i++) IS(alone[STATES - i].t > 0.0);
    return check_result();
}
