/* Prints a hash of the results of each instruction set that this processor has: the Taylor kernels,
 * ensembles in lanes with and without tangents, and the closed form. Results depend only on whether
 * there is fused multiply-add, not on the width of the vectors. The results of the closed form
 * depend on neither. */
#include <stdlib.h>
#include "bits.h"
#include "driver/top.h"
#include "ensemble/slots.h"
#include "exact/exact.h"
#include "taylor/taylor.h"

static void say(const char *isa, const char *what, int number, const char *scene, uint64_t hash)
{
#if defined KR_FUSED
    const char *sums = "fused";
#else
    const char *sums = strcmp(isa, "base") != 0 ? "fused" : "apart";
#endif
    printf("%-7s %-5s %-9s %2d %-8s %016" PRIx64 "\n", isa, sums, what, number, scene, hash);
}
static void must(int holds, const char *what)
{
    if (holds) return;
    fprintf(stderr, "kernels: %s\n", what);
    exit(1);
}
/* Returns the hash of the states of a top that one kernel computes. */
static uint64_t hash_of_kernel_states(const kr_scene *scene, kr_config config,
                                      const kr_kernel *kernel, double log2_tol)
{
    kr_state states[80]; /* each followed by its low words */
    kr_top *top = NULL;
    must(kr_top_create(scene, kr_method_find("taylor"), config, &top) == KR_OK, "no top");
    kr_taylor_set_kernel(&top->main, kernel, log2_tol);
    for (int i = 0; i < 40; i++) {
        must(kr_top_advance(top, 0.5 * (i + 1)) == KR_OK, "a top has not come to its time");
        states[2 * i] = kr_top_state(top);
        states[2 * i + 1] = kr_top_describe(top).low;
    }
    kr_top_free(top);
    return hash_of(states, sizeof states);
}
static void print_kernel_hashes(const kr_isa *isa, int which)
{
    const kr_scene s = golden_scene(which);
    for (int i = 0; i < KR_ORDERS; i++) {
        const kr_config whole = {0}, headless = {.skip_heading = 1};
        say(isa->name, "whole", isa->plain[i].order, golden_names[which],
            hash_of_kernel_states(&s, whole, &isa->plain[i], -40.0));
        say(isa->name, "headless", isa->headless[i].order, golden_names[which],
            hash_of_kernel_states(&s, headless, &isa->headless[i], -40.0));
    }
    for (int i = 0; i < KR_DEPTHS; i++) {
        const kr_config config = {.digits = i == KR_DIGITS_20 ? 20 : 30};
        say(isa->name, "digits", config.digits, golden_names[which],
            hash_of_kernel_states(&s, config, &isa->deep[i], i == KR_DIGITS_20 ? -70.0 : -100.0));
    }
}
/* Prints hashes of general tops with damping, a rotor, dry friction, and moving supports. */
static void print_effect_hashes(const kr_isa *isa)
{
    static const char *const names[] = {"damped", "rotor", "friction", "turning", "shaken"};
    for (int i = 0; i < 5; i++) {
        kr_scene s = golden_scene(2);
        if (i == 0) s.damping = (kr_vec3){0.0625, 0.125, 0.25};
        if (i == 1) s.body.rotor = (kr_vec3){0.5, -0.25, 0.75};
        if (i == 2) s.friction = 0.125;
        if (i == 3) s.turning = (kr_vec3){0.25, -0.5, 0.375};
        if (i == 4) s.shaking = (kr_shaking){0.125, 3.0, 0.5};
        const kr_config whole = {0}, deep = {.digits = 20};
        say(isa->name, "effect", isa->plain[2].order, names[i],
            hash_of_kernel_states(&s, whole, &isa->plain[2], -40.0));
        say(isa->name, "effect", deep.digits, names[i],
            hash_of_kernel_states(&s, deep, &isa->deep[KR_DIGITS_20], -70.0));
    }
}
/* Prints the hash of the states of tops in lanes, and of the growth of their tangents if the config
 * has any. */
static void print_lanes_hash(const kr_lanes_isa *isa, kr_config config, const char *what, int which)
{
    enum { TOPS = 19, TIMES = 20 };
    kr_scene scenes[TOPS];
    double t[TIMES];
    struct {
        kr_state states[TOPS * TIMES];
        double growth[TOPS * TIMES * KR_GROWTH_COUNT];
    } came;
    kr_outcome outcomes[TOPS];
    kr_worker *worker = NULL;
    const size_t size = config.tangents ? sizeof came : sizeof came.states;
    const kr_tops tops = {TOPS,
                          scenes,
                          TIMES,
                          t,
                          .states = came.states,
                          .outcomes = outcomes,
                          .growth = config.tangents ? came.growth : NULL};
    for (int i = 0; i < TOPS; i++) {
        scenes[i] = golden_scene(which);
        scenes[i].start.m.x += 0.125 * i;
    }
    for (int k = 0; k < TIMES; k++) t[k] = k + 1.0;
    must(kr_worker_create(kr_method_find("taylor"), config, 0, NULL, &worker) == KR_OK,
         "no worker");
    kr_scheduler_set_kernel(worker, isa, 20, -53.0);
    must(kr_worker_run(worker, &tops) == KR_OK, "tops in lanes have not come to their times");
    kr_worker_free(worker);
    say(isa->name, what, 20, golden_names[which], hash_of(&came, size));
}
static void closed(const kr_exact_isa *isa, int which)
{
    enum { TIMES = 200 };
    static double t[TIMES];
    static kr_state states[TIMES], same[TIMES];
    const kr_scene s = golden_scene(which);
    kr_exact_form plan;
    kr_exact_info info;
    kr_status status = KR_OK;
    const kr_exact_request asked = {isa, 1, &s, NULL, TIMES, t, 0, same, &status};
    for (int k = 0; k < TIMES; k++) t[k] = 0.375 * (k - 50);
    memset(&plan, 0, sizeof plan);
    must(isa->scalar->plan(&s, 0, 0.0, &plan, &info) == KR_OK, "no closed form");
    isa->evaluate(&plan, TIMES, t, states);
    kr_exact_run(&asked);
    must(status == KR_OK && memcmp(same, states, sizeof states) == 0, "tops and times differ");
    say(isa->name, "closed", TIMES, golden_names[which], hash_of(states, sizeof states));
}
int main(void)
{
    const kr_config whole = {0}, growing = {.skip_heading = 1, .tangents = KR_TANGENT_GROWTH};
    for (int which = 0; which < 4; which++) {
        for (int i = 0; kr_taylor_isa(i); i++)
            if (kr_taylor_isa(i)->runs_here()) {
                print_kernel_hashes(kr_taylor_isa(i), which);
                if (which == 2) print_effect_hashes(kr_taylor_isa(i));
            }
        for (int i = 0; kr_lanes_isa_at(i); i++)
            if (kr_lanes_isa_at(i)->runs_here()) {
                print_lanes_hash(kr_lanes_isa_at(i), whole, "lanes", which);
                print_lanes_hash(kr_lanes_isa_at(i), growing, "growth", which);
            }
        for (int i = 0; which != 2 && kr_symmetric_form[i].name; i++)
            if (kr_symmetric_form[i].runs_here()) closed(&kr_symmetric_form[i], which);
    }
    return 0;
}
