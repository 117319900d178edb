/* Runs without the heading: their kernels, and what refuses them. */
#include "taylor/taylor.h"
#include "tops.h"

static void test_refusals(void)
{
    const kr_scene s = kr_scene_default();
    const kr_config deep = {.skip_heading = 1, .digits = 20};
    kr_top *top = NULL;
    IS(kr_top_create(&s, taylor(), deep, &top) == KR_ERR_OPTION && top == NULL);
    for (size_t i = 0; kr_method_at(i); i++) {
        const kr_method *method = kr_method_at(i);
        const kr_config config = {.skip_heading = 1, .step = 0.1};
        if (method == taylor()) continue;
        IS(!(kr_method_describe(method).flags & KR_METHOD_SKIPS_HEADING));
        IS(kr_top_create(&s, method, config, &top) == KR_ERR_OPTION && top == NULL);
    }
}

/* P and W agree with those of the kernels with heading up to rounding. All kernels with fma give
 * bitwise equal results. */
static void test_kernels(void)
{
    const kr_series start = {.fall = INFINITY,
                             .k = {0, -.28, .84, -.73},
                             .up = {0, -.02, .68, -.01},
                             .down = {0, .06, .01, -.64},
                             .end_x = {0, 0, 0, 0, 0, -.96, 0, -.28},
                             .end_w = {0, .8, .4, .1}};
    for (int order = 0; order < KR_ORDERS; order++) {
        kr_series first = start;
        const kr_isa *isa, *widest = NULL;
        for (int i = 0; (isa = kr_taylor_isa(i)) != NULL; i++) {
            kr_series a = start, b = start;
            if (!isa->runs_here()) continue;
            isa->plain[order].advance(&a, -40.0, 1.0);
            isa->headless[order].advance(&b, -40.0, 1.0);
            /* from a start without attitude both series are the same */
            NEAR(b.end, a.end, 1e-14);
            for (int n = 0; n <= isa->plain[order].order; n++)
                for (int j = 0; j < 4; j++) {
                    NEAR(b.x[n][4 + j], a.x[n][4 + j], 4e-16);
                    NEAR(b.w[n][j], a.w[n][j], 4e-16);
                    IS(b.x[n][j] == 0.0);
                }
            for (int n = 0; n < 100; n++) isa->headless[order].advance(&b, -40.0, 1.0);
            if (!widest) widest = isa, first = b;
            if (strcmp(widest->name, "avx512") == 0 && strcmp(isa->name, "avx2") == 0)
                IS(b.end == first.end && memcmp(b.end_x, first.end_x, sizeof b.end_x) == 0);
            NEAR(b.end, first.end, 1e-12);
            for (int j = 0; j < 8; j++) NEAR(b.end_x[j], first.end_x[j], 2e-12);
        }
    }
}

int main(void)
{
    test_kernels();
    test_refusals();
    return check_result();
}
