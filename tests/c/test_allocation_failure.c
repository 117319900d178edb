/* Failing allocations: each allocation fails in turn. The linker redirects calloc to this file. */
#include <stdlib.h>
#include "method.h"
#include "viewer/simulation.h"
#include "tops.h"

void *__real_calloc(size_t n, size_t size);
void *__wrap_calloc(size_t n, size_t size);
static int left = -1; /* number of allocations that still succeed; negative if all do */
static int asked;

void *__wrap_calloc(size_t n, size_t size)
{
    asked++;
    return left >= 0 && left-- == 0 ? NULL : __real_calloc(n, size);
}
/* A top allocates memory once, when it is created. If this fails, no top is created and nothing is
 * written. The methods of GSL allocate more than once, and each allocation may fail: on creation,
 * in side steps, and on a reset. */
static void test_top_without_memory(const kr_method *method)
{
    const kr_scene s = scene_for(method);
    const kr_config config = {.step = 0.01};
    kr_top *const mark = (kr_top *)(void *)&left, *top = mark;
    const int own = strncmp(method->name, "gsl_", 4) != 0;
    int needed = 0;
    for (left = 0; kr_top_create(&s, method, config, &top) == KR_ERR_MEMORY; left = ++needed)
        IS(top == mark && needed < 9);
    IS(own ? needed == 1 : needed > 1);
    asked = 0;
    for (int i = 0; i < 9; i++) {
        left = i;
        const kr_status status = kr_top_advance(top, 0.1 * i + 0.105);
        IS(status == KR_OK || (!own && status == KR_ERR_MEMORY));
        left = i;
        const kr_status again = i == 4 ? kr_top_reset(top, &s.start) : KR_OK;
        IS(again == KR_OK || (!own && again == KR_ERR_MEMORY));
    }
    IS(!own || asked == 0);
    left = -1;
    IS(kr_top_advance(top, 2.0) == KR_OK);
    kr_top_free(top);
}
/* A worker allocates memory for itself and for its tops when it is created. If any of these
 * allocations fails, nothing is written and no memory is lost. */
static void test_worker_without_memory(const kr_method *method, int needs)
{
    kr_worker *const mark = (kr_worker *)(void *)&left, *worker = mark;
    const kr_config config = {0};
    const kr_scene s[2] = {asymmetric(), tilted()};
    const double t = 3.0;
    kr_state states[2];
    kr_outcome outcomes[2];
    const kr_tops tops = {
        .n = 2, .scenes = s, .times = 1, .t = &t, .states = states, .outcomes = outcomes};
    int needed = 0;
    for (left = 0; kr_worker_create(method, config, 0, NULL, &worker) == KR_ERR_MEMORY;
         left = ++needed)
        IS(worker == mark && needed < needs);
    IS(needed == needs);
    left = asked = 0;
    IS(kr_worker_run(worker, &tops) == KR_OK && asked == 0);
    IS(outcomes[1].status == KR_OK);
    left = -1;
    kr_worker_free(worker);
}
static void test_stage_without_memory(void)
{
    static kr_simulation stage;
    const kr_scene s = tilted();
    IS(kr_simulation_add(&stage, &s, taylor(), 10000, 0.0, -1) == KR_OK);
    left = 0;
    IS(kr_simulation_add(&stage, &s, taylor(), 10000, 0.0, 0) == KR_ERR_MEMORY && stage.count == 1);
    IS(kr_simulation_add(&stage, &s, taylor(), 10000, 0.0, 0) == KR_OK && stage.count == 2);
    IS(kr_simulation_advance(&stage, 100000, 100) == 100000);
    kr_simulation_clear(&stage);
}

int main(void)
{
    for (size_t i = 0; kr_method_at(i); i++) test_top_without_memory(kr_method_at(i));
    test_worker_without_memory(NULL, 3);
    test_worker_without_memory(taylor(), 2);
    test_worker_without_memory(kr_method_find("exact"), 2);
    test_stage_without_memory();
    return check_result();
}
