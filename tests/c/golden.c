/* Prints a hash of the final state of each algebraic method. The hashes are equal for every
 * compiler, optimization level and machine. */
#include "bits.h"

int main(void)
{
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_method *method = kr_method_at(i);
        if (!(kr_method_flags(method) & KR_METHOD_ALGEBRAIC)) continue;
        for (int which = 0; which < 4; which++) {
            const kr_scene s = golden_scene(which);
            const kr_config config = {.step = 0.01};
            kr_top *top = NULL;
            if (!kr_method_applies(method, &s.body)) continue;
            if (kr_top_create(&s, method, config, &top) != KR_OK ||
                kr_top_advance(top, 300.0025) != KR_OK)
                return 1;
            const kr_state end = kr_top_state(top);
            printf("%-16s %-8s %016" PRIx64 "\n", kr_method_name(method), golden_names[which],
                   hash_of(&end, sizeof end));
            kr_top_free(top);
        }
    }
    return 0;
}
