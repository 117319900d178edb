/* Prints a hash of where each algebraic method ends: equal from every compiler, at every level of
 * optimization. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include "kreisel.h"

static uint64_t hash(const void *data, size_t size) /* FNV-1a */
{
    uint64_t h = 14695981039346656037u;
    for (size_t i = 0; i < size; i++) h = (h ^ ((const unsigned char *)data)[i]) * 1099511628211u;
    return h;
}
static kr_scene scene(int which)
{
    kr_scene s = kr_scene_default();
    const double tensor[9] = {3.0, -0.25, 0.5, -0.25, 2.5, 0.125, 0.5, 0.125, 1.5};
    const kr_vec3 com = {0.25, -0.5, 0.75};
    s.start.q = (kr_quat){0.5, 0.5, -0.5, 0.5};
    if (which == 1) s.start.m.z = 200.0;
    if (which == 2) kr_body_from_tensor(2.0, tensor, com, &s.body);
    if (which == 3) s.gravity = -10.0;
    return s;
}
int main(void)
{
    static const char *const names[] = {"thesis", "fast", "general", "hanging"};
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_method *method = kr_method_at(i);
        if (!(kr_method_flags(method) & KR_ALGEBRAIC)) continue;
        for (int which = 0; which < 4; which++) {
            const kr_scene s = scene(which);
            const kr_config config = {.step = 0.01};
            kr_top *top = NULL;
            if (!kr_method_applies(method, &s.body)) continue;
            if (kr_top_create(&s, method, config, &top) != KR_OK ||
                kr_top_advance(top, 300.0025) != KR_OK)
                return 1;
            const kr_state end = kr_top_state(top);
            printf("%-16s %-8s %016" PRIx64 "\n", kr_method_name(method), names[which],
                   hash(&end, sizeof end));
            kr_top_free(top);
        }
    }
    return 0;
}
