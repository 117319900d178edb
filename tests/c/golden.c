/* Prints a hash of the final state of each algebraic method, and hashes of the closed forms of a
 * Kowalewski top and a Goryachev-Chaplygin top. The hashes are equal for every compiler,
 * optimization level and machine. */
#include <stdlib.h>
#include "bits.h"

enum { TIMES = 200 };

/* Returns a top with the moments ratio, ratio and 1, and com normal to the symmetry axis. */
static kr_scene scene_of_ratio(double ratio)
{
    const double tensor[9] = {ratio, 0.0, 0.0, 0.0, ratio, 0.0, 0.0, 0.0, 1.0};
    kr_scene s = kr_scene_default();
    if (kr_body_from_tensor(1.0, tensor, (kr_vec3){1.0, 0.0, 0.0}, 0.0, &s.body) != KR_OK) exit(1);
    s.gravity = 1.0;
    s.start.q = (kr_quat){0.5, 0.5, -0.5, 0.5};
    return s;
}
static void print_states(const char *name, const kr_state states[])
{
    printf("%-16s %-8s %016" PRIx64 "\n", name, "closed",
           hash_of(states, TIMES * sizeof states[0]));
}
static void print_closed_form(const char *name, double ratio, kr_vec3 momentum, const double t[])
{
    kr_scene s = scene_of_ratio(ratio);
    kr_state states[TIMES];
    kr_exact *exact = malloc(kr_exact_size(&s));
    s.start.m = momentum;
    if (!exact || kr_exact_plan(&s, 0.0, exact) != KR_OK) exit(1);
    kr_exact_states(exact, TIMES, t, states);
    print_states(name, states);
    free(exact);
}

int main(void)
{
    for (size_t i = 0; kr_method_at(i); i++) {
        const kr_method *method = kr_method_at(i);
        if (!(kr_method_describe(method).flags & KR_METHOD_ALGEBRAIC)) continue;
        for (int which = 0; which < 4; which++) {
            const kr_scene s = golden_scene(which);
            const kr_config config = {.step = 0.01};
            kr_top *top = NULL;
            if (!kr_method_applies(method, &s.body)) continue;
            if (kr_top_create(&s, method, config, &top) != KR_OK ||
                kr_top_advance(top, 300.0025) != KR_OK)
                return 1;
            const kr_state end = kr_top_state(top);
            printf("%-16s %-8s %016" PRIx64 "\n", kr_method_describe(method).name,
                   golden_names[which], hash_of(&end, sizeof end));
            kr_top_free(top);
        }
    }
    double t[TIMES];
    for (int k = 0; k < TIMES; k++) t[k] = 0.375 * (k - 50);
    print_closed_form("kowalewski", 2.0, (kr_vec3){0.5, -0.25, 0.75}, t);
    print_closed_form("goryachev_chaplygin", 4.0, (kr_vec3){0.5, 1.75, 0.0}, t);
    return 0;
}
