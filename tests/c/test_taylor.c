/* The Taylor series: coefficients, kernels, extreme tops and failures. */
#include <stdlib.h>
#include "driver/top.h"
#include "taylor/taylor.h"
#include "tops.h"

static kr_state run_to(const kr_scene *s, double tol, double t)
{
    const kr_config config = {.tol = tol, .step = t < s->start.t ? -1.0 : 1.0};
    return state_at(t, s, taylor(), config);
}
static double energy(const kr_scene *s, kr_state a)
{
    return kr_state_kinetic(s, &a) + kr_state_potential(s, &a);
}

static kr_series example(void)
{
    kr_series s = {.k = {0, -.28, .84, -.73},
                   .up = {0, -.02, .68, -.01},
                   .down = {0, .06, .01, -.64},
                   .fall = INFINITY};
    const double x[8] = {.6, 0, .8, 0, 0, -.96, 0, -.28}, w[4] = {0, .8, .4, .1};
    memcpy(s.end_x, x, sizeof x);
    memcpy(s.end_w, w, sizeof w);
    return s;
}
static kr_quat quat(const double a[4]) { return q4(a[0], v3(a[1], a[2], a[3])); }
static double apart(const double a[4], kr_quat b)
{
    const kr_quat d = q4(a[0] - b.w, v_sub(v3(a[1], a[2], a[3]), q_vec(b)));
    return sqrt(q_dot(d, d));
}
static kr_vec3 next(kr_vec3 v) { return v3(v.y, v.z, v.x); }
static kr_vec3 prev(kr_vec3 v) { return v3(v.z, v.x, v.y); }

/* Every coefficient obeys the equations at the head of taylor.h. */
static void coefficients(const kr_kernel *kernel)
{
    kr_series pair[2] = {example()}, *s = pair;
    kernel->advance(s, -2.0 * kernel->order, 1.0);
    for (int n = 0; n < kernel->order; n++) {
        kr_quat q = q4(0, v3(0, 0, 0)), P = q;
        kr_vec3 W = v3(0, 0, 0);
        for (int j = 0; j <= n; j++) {
            const kr_vec3 w = q_vec(quat(s->w[j])), p = q_vec(quat(s->x[n - j] + 4));
            const kr_quat turn = q_mul(quat(s->x[n - j]), q4(0, w));
            q = q4(q.w + .5 * turn.w, v_axpy(.5, q_vec(turn), q_vec(q)));
            P = q4(0, v_add(q_vec(P), v_cross(p, w)));
            W = v_add(W, v_times(next(w), prev(q_vec(quat(s->w[n - j])))));
        }
        const kr_vec3 p = q_vec(quat(s->x[n] + 4));
        W = v_add(v_times(q_vec(quat(s->k)), W), v_add(v_times(q_vec(quat(s->up)), next(p)),
                                                       v_times(q_vec(quat(s->down)), prev(p))));
        NEAR(apart(s->x[n + 1], q_scale(1.0 / (n + 1), q)), 0.0, 4e-16);
        NEAR(apart(s->x[n + 1] + 4, q_scale(1.0 / (n + 1), P)), 0.0, 4e-16);
        NEAR(apart(s->w[n + 1], q4(0, v_scale(1.0 / (n + 1), W))), 0.0, 4e-16);
    }
    double sum = 0.0;
    for (int n = kernel->order; n >= 0; n--) sum = sum * s->end + s->x[n][0];
    NEAR(s->end_x[0], sum, 4e-16);
    s->at = s->end;
    kernel->evaluate(s);
    IS(s->end > 0.2 && memcmp(s->at_x, s->end_x, sizeof s->at_x) == 0 &&
       memcmp(s->at_w, s->end_w, sizeof s->at_w) == 0);
}
/* All kernels give the same states up to rounding, and those with fma give bitwise equal states. */
static void test_kernels(void)
{
    for (int order = 0; order < KR_ORDERS; order++) {
        kr_series first = example();
        const kr_isa *isa, *widest = NULL;
        for (int i = 0; (isa = kr_taylor_isa(i)) != NULL; i++) {
            kr_series s = example();
            if (!isa->runs_here()) continue;
            for (int n = 0; n < 100; n++) isa->plain[order].advance(&s, -40.0, 1.0);
            if (!widest) widest = isa, first = s;
            if (strcmp(widest->name, "avx512") == 0 && strcmp(isa->name, "avx2") == 0)
                IS(s.end == first.end && memcmp(s.end_x, first.end_x, sizeof s.end_x) == 0);
            NEAR(s.end, first.end, 1e-12);
            for (int j = 0; j < 8; j++) NEAR(s.end_x[j], first.end_x[j], 2e-12);
        }
        if (strcmp(widest->name, "base") != 0 && order == KR_ORDER_28)
            IS(first.end_x[0] == 0x1.f4fae93612feap-5);
    }
}
static void test_single_kernels(void)
{
    const kr_isa *isa;
    for (int i = 0; (isa = kr_taylor_isa(i)) != NULL; i++) {
        if (!isa->runs_here()) continue;
        for (int order = 0; order < KR_ORDERS; order++) coefficients(&isa->plain[order]);
        for (int depth = 0; depth < KR_DEPTHS; depth++) coefficients(&isa->deep[depth]);
    }
}

/* The energy is conserved for bodies as thin as a needle, slow and fast. */
static void test_extremes(void)
{
    for (double thin = 1e-3; thin > 1e-7; thin *= 0.1)
        for (double speed = 1e-100; speed < 1e101; speed *= 1e50) {
            kr_scene s = kr_scene_default();
            s.body.inertia = v3(1.0, 1.0 - 0.5 * thin, thin);
            s.body.com = v3(0.3, 0.1, 1.0);
            s.start.q = q_exp(v3(0.3, 0.8, -0.4));
            s.start.m = v_scale(speed, q_turn(s.start.q, v3(1.0, -0.5, 0.1 * thin)));
            s.gravity = speed * speed;
            const kr_state end = run_to(&s, 0, 3.0 / speed);
            const double scale = kr_state_kinetic(&s, &end) + s.gravity * v_length(s.body.com);
            NEAR((energy(&s, end) - energy(&s, s.start)) / scale, 0.0, 1e-9);
        }
}
/* Checks that a step fails with the status `why` and leaves the motion unchanged. */
static void check_step_fails(double lever, double tol, double clock, kr_status why)
{
    const kr_vec3 inertia = {1.0, 0.75, 0.5}, pull = {0, 0, lever};
    const kr_scene scene = kr_scene_default();
    body_dd body;
    kr_motion motion = {.inertia = inertia,
                        .lever = pull,
                        .tol = tol,
                        .clock = clock,
                        .body = &body,
                        .scene = &scene};
    kr_state start = {0, {1, 0, 0, 0}, {0.5, 0.25, 0.5}}, before = start, after = start,
             there = start;
    motion.work = calloc(taylor()->work, sizeof(double));
    IS(motion.work && taylor()->reset(&motion, &start) == KR_OK);
    taylor()->read(&motion, &before);
    for (int i = 0; i < 2; i++) {
        IS(taylor()->step(&motion, INFINITY) == why && motion.clock == clock);
        taylor()->read(&motion, &after);
        taylor()->at(&motion, clock, &there);
        IS(same(before, after) && same(before, there));
    }
    free(motion.work);
}
static void test_refusals(void)
{
    const kr_scene s = kr_scene_default();
    const kr_config loose = {.tol = 1.0};
    kr_top *top = NULL;
    IS(kr_top_create(&s, taylor(), loose, &top) == KR_ERR_ARGUMENT && top == NULL);
    check_step_fails(NAN, 0, 0, KR_ERR_NOT_FINITE);
    check_step_fails(INFINITY, 0, 0, KR_ERR_NOT_FINITE);
    check_step_fails(1.0, 1e-17, 0, KR_ERR_STEP);
    check_step_fails(1.0, 0, 0x1p60, KR_ERR_STEP);
    check_step_fails(1.0, 0, -0x1p60, KR_ERR_STEP);
}
/* Returns the widest instruction set that this processor has. */
static const kr_isa *widest_isa(void)
{
    int i = 0;
    while (!kr_taylor_isa(i)->runs_here()) i++;
    return kr_taylor_isa(i);
}
/* A kernel outside the tables is named "other". It finds the same events as the kernel of which it
 * is a copy. */
static void test_own_kernel(void)
{
    const kr_scene s = tilted();
    const kr_isa *isa = widest_isa();
    const kr_kernel mine = isa->plain[KR_ORDER_28];
    const kr_term height = {1.0, kr_component_find("apex_z"), KR_COMPONENT_ONE};
    double found[2];
    for (int i = 0; i < 2; i++) {
        kr_event event = {.terms = &height, .count = 1, .extremum = 1};
        kr_event_hit hit = {0};
        kr_top *top = make(&s, taylor(), (kr_config){0});
        kr_taylor_set_kernel(&top->main, i ? &mine : &isa->plain[KR_ORDER_28], -53.0);
        IS(strcmp(kr_top_describe(top).kernel, i ? "other" : isa->name) == 0);
        IS(kr_top_describe(top).order == mine.order && kr_top_watch(top, 1, &event) == KR_OK);
        IS(kr_top_seek(top, 20.0, &hit) == KR_OK && hit.index == 0);
        found[i] = kr_top_state(top).t;
        kr_top_free(top);
    }
    NEAR(found[1], found[0], 1e-13);
}
/* Tangents with a kernel outside the tables are those of the baseline instruction set. */
static void test_tangents_of_own_kernel(void)
{
    const kr_scene s = tilted();
    const kr_isa *isa = widest_isa();
    const kr_kernel mine = isa->plain[KR_ORDER_28];
    double phi[2][36];
    for (int i = 0; i < 2; i++) {
        kr_top *top = make(&s, taylor(), (kr_config){.tangents = KR_TANGENT_START});
        kr_taylor_set_kernel(&top->main, i ? &mine : &isa->plain[KR_ORDER_28], -53.0);
        IS(kr_top_advance(top, 3.0) == KR_OK && kr_top_tangents(top, phi[i], NULL) == KR_OK);
        kr_top_free(top);
    }
    for (int k = 0; k < 36; k++) NEAR(phi[1][k], phi[0][k], 1e-12);
}
/* An event search up to the end of a step makes no further step. */
static void test_search_to_the_end_of_a_step(void)
{
    const kr_scene s = tilted();
    const kr_term height = {1.0, kr_component_find("apex_z"), KR_COMPONENT_ONE};
    kr_event event = {.terms = &height, .count = 1};
    kr_event_hit hit = {0};
    kr_top *top = make(&s, taylor(), (kr_config){0}), *twin = make(&s, taylor(), (kr_config){0});
    IS(kr_top_step(twin) == KR_OK && kr_top_watch(top, 1, &event) == KR_OK);
    IS(kr_top_seek(top, kr_top_state(twin).t, &hit) == KR_OK && hit.index < 0);
    IS(same(kr_top_state(top), kr_top_state(twin)));
    IS(kr_top_describe(top).stats.steps == 1 && kr_top_describe(twin).stats.steps == 1);
    kr_top_free(top);
    kr_top_free(twin);
}

int main(void)
{
    test_search_to_the_end_of_a_step();
    test_own_kernel();
    test_tangents_of_own_kernel();
    test_single_kernels();
    test_kernels();
    test_extremes();
    test_refusals();
    return check_result();
}
