/* Runs without the heading: quantities that do not depend on the heading equal those of a run with
 * the heading. */
#include "taylor/taylor.h"
#include "tops.h"

static kr_scene scene(int i)
{
    kr_scene s = kr_scene_default();
    s.body = general_body();
    s.gravity = 1.0 + i;
    s.start.q = q_unit(q4(cos(i), v3(sin(2.0 * i), 0.4 * i - 1.0, cos(3.0 * i))));
    s.start.m = v3(0.5 - 0.2 * i, 0.3 * i, 1.0);
    return s;
}
static double height_error(kr_quat a, kr_quat b) /* difference of the heights of the body axes */
{
    return off(q_vertical(a), q_vertical(b));
}

enum { LOOKS = 400 };
static void test_invariants(const kr_scene *s, double t_end, double bound)
{
    static kr_state whole[LOOKS], some[LOOKS];
    static double t[LOOKS];
    const kr_config with = {.step = t_end}, without = {.step = t_end, .skip_heading = 1};
    kr_top *a = make(s, taylor(), with), *b = make(s, taylor(), without);
    for (int i = 0; i < LOOKS; i++) t[i] = t_end * (i + 1) / LOOKS;
    IS(kr_top_record(a, LOOKS, t, whole, NULL) == KR_OK &&
       kr_top_record(b, LOOKS, t, some, NULL) == KR_OK);
    const double size =
        kr_state_kinetic(s, &s->start) + s->body.mass * s->gravity * v_length(s->body.com);
    for (int i = 0; i < LOOKS; i++) {
        NEAR(q_dot(some[i].q, some[i].q), 1.0, 1e-15);
        NEAR(height_error(whole[i].q, some[i].q), 0.0, bound);
        NEAR(kr_state_apex(s, &some[i]).z, kr_state_apex(s, &whole[i]).z, bound);
        NEAR(kr_state_kinetic(s, &some[i]), kr_state_kinetic(s, &whole[i]), bound * size);
        NEAR(kr_state_potential(s, &some[i]), kr_state_potential(s, &whole[i]), bound * size);
        NEAR(kr_state_axial_momentum(s, &some[i]), kr_state_axial_momentum(s, &whole[i]),
             bound * v_length(s->start.m) + bound * size);
        NEAR(some[i].m.z, s->friction > 0.0 ? whole[i].m.z : s->start.m.z, bound);
        NEAR(v_length(some[i].m), v_length(whole[i].m), bound * size);
    }
    IS(kr_attitude_error(whole[LOOKS - 1].q, some[LOOKS - 1].q) > 1e-3);
    kr_top_free(a);
    kr_top_free(b);
}
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
    kr_scene s = kr_scene_default();
    test_kernels();
    test_invariants(&s, 20.0, 1e-12);
    for (int i = 0; i < 5; i++) {
        s = scene(i);
        test_invariants(&s, i % 2 ? -10.0 : 10.0, 1e-11);
        s.shaking = (kr_shaking){.amplitude = 0.05, .rate = 3.0, .phase = 0.5};
        test_invariants(&s, i % 2 ? -10.0 : 10.0, 1e-11);
        s.friction = 0.01;
        test_invariants(&s, i % 2 ? -10.0 : 10.0, 1e-11);
    }
    test_refusals();
    return check_result();
}
