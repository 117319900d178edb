/* Invalid bodies, scenes, options and queries: each invalid number alone is refused, and a refusal
 * changes nothing. */
#include <stddef.h>
#include <string.h>
#include "driver/top.h"
#include "events/event_polynomial.h"
#include "tops.h"

enum { NUMBERS = sizeof(kr_scene) / sizeof(double), MOST = 1 << 15 };
/* The first number in `given`, and the first after it. */
enum { GIVEN = offsetof(kr_scene, body.given) / sizeof(double), START = GIVEN + 15 };

static kr_scene with_number(const kr_scene *s, int place, double number)
{
    double numbers[NUMBERS];
    kr_scene other;
    memcpy(numbers, s, sizeof numbers);
    numbers[place] = number;
    memcpy(&other, numbers, sizeof other);
    return other;
}
/* A scene consists of doubles, all of which must be finite, except those in kr_body.given, which
 * count only if they make the body. */
static void test_scenes(void)
{
    const double none[3] = {NAN, INFINITY, -INFINITY};
    const kr_scene s = tilted();
    const kr_method *exact = kr_method_find("exact");
    const kr_exact *plan;
    kr_top *top = NULL;
    IS(kr_scene_check(&s) == KR_OK && kr_method_suits(exact, &s) && kr_scene_horizon(&s) > 0.0);
    for (int i = 0; i < NUMBERS; i += i == GIVEN - 1 ? START - i : 1)
        for (int k = 0; k < 3; k++) {
            const kr_scene bad = with_number(&s, i, none[k]);
            const kr_status status = kr_scene_check(&bad);
            IS(status == KR_ERR_ARGUMENT || status == KR_ERR_BODY || status == KR_ERR_ATTITUDE);
            IS(plan_closed_form(&bad, &plan) == status);
            IS(kr_top_create(&bad, taylor(), (kr_config){0}, &top) == status && !top);
            IS(!kr_method_suits(exact, &bad) && kr_scene_horizon(&bad) == 0.0);
        }
    IS(kr_scene_check(NULL) != KR_OK && kr_scene_horizon(NULL) == 0.0);
    IS(kr_exact_plan(&s, 0.0, NULL) != KR_OK);
    IS(!kr_method_suits(NULL, &s) && !kr_method_suits(exact, NULL));
}
static void test_bodies(void)
{
    const kr_vec3 wrong[] = {{0, 1, 1},  {1, 0, 1}, {1, 1, 0}, {-1, 1, 1}, {1, -1, 1},
                             {1, 1, -1}, {3, 1, 1}, {1, 3, 1}, {1, 1, 3}};
    const kr_body good = thesis_body();
    const kr_method *strang = kr_method_find("strang");
    kr_body body = good;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        body.inertia = wrong[i];
        IS(kr_body_check(&body) == KR_ERR_BODY && !kr_method_applies(strang, &body));
    }
    for (int i = 0; i < 2; i++) {
        body = good, body.mass = -i;
        IS(kr_body_check(&body) == KR_ERR_ARGUMENT);
    }
    body = good, body.axes.w = 1.0 + 1e-9;
    IS(kr_body_check(&body) == KR_ERR_ARGUMENT && kr_body_check(NULL) != KR_OK);
    IS(!kr_method_applies(NULL, &good) && kr_method_applies(strang, &good));
}
/* Constructors of bodies leave the body unchanged if they refuse their arguments. */
static void test_makers(void)
{
    const double diagonal[9] = {3, 0, 0, 0, 3, 0, 0, 0, 3};
    const kr_vec3 half = v3(1, 2, 3), pivot = v3(0, 0, -1), zero = v3(0, 0, 0);
    const kr_body marked = {-7.0, {1, 2, 3}, {4, 5, 6}, {7, 8, 9, 10}, 11, .rotor = {0, 0, 0}};
    kr_body body = marked;
    for (int i = 0; i < 3; i++) {
        double skew[9];
        memcpy(skew, diagonal, sizeof skew);
        skew[i == 0 ? 1 : i == 1 ? 2 : 5] = 0.1;
        IS(kr_body_from_tensor(1.0, skew, zero, 0.0, &body) == KR_ERR_ARGUMENT);
        kr_vec3 edges = half;
        *(i == 0 ? &edges.x : i == 1 ? &edges.y : &edges.z) = -1.0;
        IS(kr_body_shape(KR_SHAPE_CUBOID, edges, 1.0, pivot, &body) != KR_OK);
    }
    IS(kr_body_from_tensor(1.0, NULL, zero, 0.0, &body) == KR_ERR_ARGUMENT);
    IS(kr_body_from_tensor(0.0, diagonal, zero, 0.0, &body) == KR_ERR_ARGUMENT);
    IS(kr_body_shape(KR_SHAPE_CUBOID, half, NAN, pivot, &body) != KR_OK);
    IS(kr_body_symmetric(1.0, 1.0, 2.0 * (1 + 1e-11), 1.0, &body) == KR_ERR_BODY);
    IS(kr_body_symmetric(1.0, 1.0, 0.0, 1.0, &body) == KR_ERR_BODY); /* all mass on the axis */
    IS(kr_body_symmetric(-1.0, 1.0, 1.0, 1.0, &body) == KR_ERR_ARGUMENT);
    IS(kr_body_symmetric(1.0, NAN, 1.0, 1.0, &body) == KR_ERR_ARGUMENT);
    IS(memcmp(&body, &marked, sizeof body) == 0);
    IS(kr_body_symmetric(1.0, 1.0, 1.0, 1.0, NULL) == KR_ERR_ARGUMENT);
    IS(kr_body_from_tensor(1.0, diagonal, zero, 0.0, NULL) == KR_ERR_ARGUMENT);
}
static void test_configs(void)
{
    const kr_scene s = tilted();
    const kr_method *strang = kr_method_find("strang"), *extrap = kr_method_find("extrap");
    const kr_config good = {.step = 0.1},
                    wrong[] = {{.step = 0.0}, {.step = NAN}, {.step = INFINITY}},
                    loose[] = {{.tol = NAN}, {.tol = -1e-9}, {.tol = INFINITY}, {.step = NAN}};
    kr_top *top = NULL;
    for (int i = 0; i < 3; i++)
        IS(kr_top_create(&s, strang, wrong[i], &top) ==
           (i == 0 ? KR_ERR_NO_STEP : KR_ERR_ARGUMENT));
    for (int i = 0; i < 4; i++) IS(kr_top_create(&s, extrap, loose[i], &top) != KR_OK);
    /* Tolerances that are as large as any error, or larger, are refused. */
    for (size_t i = 0; kr_method_at(i); i++) {
        const kr_config none = {.step = 0.1, .tol = i % 2 ? 1.0 : 18.0};
        IS(kr_top_create(&s, kr_method_at(i), none, &top) != KR_OK && !top);
    }
    /* a step that the time of the start does not resolve, and a rate beyond the range of doubles */
    kr_scene bad = s;
    bad.start.t = 1e17;
    IS(kr_top_create(&bad, strang, good, &top) == KR_ERR_STEP);
    bad = s, bad.start.m.x = 1e300, bad.body.inertia = v_scale(1e-30, s.body.inertia);
    IS(kr_top_create(&bad, strang, good, &top) == KR_ERR_ARGUMENT);
    IS(!kr_method_find("nope") && !kr_method_find(NULL) && !kr_method_at(1000));
    for (int i = 0; i <= KR_STATUS_COUNT; i++) IS(strlen(kr_status_text((kr_status)i)) > 3);
    IS(strlen(kr_kind_name((kr_kind)KR_KIND_COUNT)) > 3);
    IS(kr_top_create(NULL, strang, good, &top) == KR_ERR_ARGUMENT);
    IS(kr_top_create(&s, NULL, good, &top) == KR_ERR_NO_METHOD);
    IS(kr_top_create(&s, strang, good, NULL) == KR_ERR_ARGUMENT && !top);
}
static void test_queries(void)
{
    const kr_scene s = tilted();
    kr_top *top = make(&s, kr_method_find("strang"), (kr_config){.step = 0.1});
    const double t[1] = {0.35};
    kr_state out[1];
    size_t done = 7;
    IS(kr_top_reset(NULL, &s.start) == KR_ERR_ARGUMENT && kr_top_reset(top, NULL) != KR_OK);
    IS(kr_top_record(NULL, 1, t, out, NULL, &done) == KR_ERR_ARGUMENT && done == 0);
    IS(kr_top_record(top, 1, NULL, out, NULL, NULL) == KR_ERR_ARGUMENT);
    IS(kr_top_record(top, 1, t, NULL, NULL, NULL) == KR_ERR_ARGUMENT);
    IS(kr_top_record(top, 0, NULL, NULL, NULL, NULL) == KR_OK && same(kr_top_state(top), s.start));
    IS(kr_top_record(top, 1, t, out, NULL, NULL) == KR_OK && out[0].t == 0.35);
    IS(kr_top_step(NULL) == KR_ERR_ARGUMENT && kr_top_advance(NULL, 1.0) == KR_ERR_ARGUMENT);
    IS(kr_top_tangents(NULL, NULL, NULL) != KR_OK);
    IS(kr_top_save(top, kr_top_save_size(top), NULL) == KR_ERR_ARGUMENT);
    IS(kr_top_load(top, kr_top_save_size(top), NULL) == KR_ERR_ARGUMENT);
    IS(strcmp(kr_top_describe(top).kernel, "") == 0 && kr_top_describe(top).order == 2);
    kr_top_free(top);
}
/* A top with another body, gravity or config refuses the checkpoint. */
static void test_checkpoints(void)
{
    static unsigned char saved[MOST];
    const kr_scene s = tilted();
    const kr_method *method = kr_method_find("implicit_midpoint");
    const kr_config config = {.step = 0.1, .tol = 1e-12};
    kr_top *top = make(&s, method, config);
    const size_t size = kr_top_save_size(top);
    IS(size <= MOST && kr_top_save(top, size, saved) == KR_OK);
    const kr_config others[] = {{.step = 0.2, .tol = 1e-12}, {.step = 0.1, .tol = 1e-13}};
    for (int i = 0; i < 2; i++) {
        kr_top *other = make(&s, method, others[i]);
        IS(kr_top_load(other, size, saved) == KR_ERR_CHECKPOINT);
        kr_top_free(other);
    }
    for (size_t i = 0; i < offsetof(kr_scene, start) / sizeof(double); i++) {
        double number;
        memcpy(&number, (const double *)(const void *)&s + i, sizeof number);
        const kr_scene changed =
            with_number(&s, (int)i, number == 0.0 ? 1e-13 : number * (1.0 + 1e-15));
        kr_top *other = make(&changed, method, config);
        IS(kr_top_load(other, size, saved) == KR_ERR_CHECKPOINT);
        kr_top_free(other);
    }
    IS(kr_top_load(top, size, saved) == KR_OK);
    kr_top_free(top);
}
static void test_more_digits(void)
{
    static unsigned char saved[MOST];
    const kr_scene s = tilted();
    const kr_config configs[5] = {{.digits = 0},
                                  {.digits = 30},
                                  {.skip_heading = 1},
                                  {.tangents = KR_TANGENT_GRAVITY},
                                  {.tangents = KR_TANGENT_MASS}};
    kr_top *tops[5];
    for (int i = 0; i < 5; i++) tops[i] = make(&s, taylor(), configs[i]);
    for (int i = 0; i < 5; i++) {
        const size_t size = kr_top_save_size(tops[i]);
        IS(size <= MOST && kr_top_save(tops[i], size, saved) == KR_OK);
        for (int k = 0; k < 5; k++)
            IS(kr_top_load(tops[k], size, saved) == (k == i ? KR_OK : KR_ERR_CHECKPOINT));
    }
    for (int i = 0; i < 5; i++) kr_top_free(tops[i]);
}
/* Methods that a build omits, and options of omitted parts, are refused. Other options work. */
static void test_omitted_parts(void)
{
    const kr_scene s = tilted();
    const kr_method omitted = {.name = "omitted"};
    kr_method small = *taylor();
    kr_top *top = NULL;
    kr_worker *worker = NULL;
    small.extended = NULL;
    small.tangents = NULL;
    IS(!kr_method_suits(&omitted, &s) && !kr_method_applies(&omitted, &s.body));
    IS(kr_top_create(&s, &omitted, (kr_config){.step = 0.1}, &top) == KR_ERR_NOT_BUILT);
    IS(kr_worker_create(&omitted, (kr_config){.step = 0.1}, 0, NULL, &worker) == KR_ERR_NOT_BUILT);
    IS(kr_top_create(&s, &small, (kr_config){.digits = 20}, &top) == KR_ERR_NOT_BUILT);
    IS(kr_top_create(&s, &small, (kr_config){.tangents = KR_TANGENT_START}, &top) ==
       KR_ERR_NOT_BUILT);
    IS(!top && !worker);
    IS(same(state_at(3.0, &s, &small, (kr_config){0}),
            state_at(3.0, &s, taylor(), (kr_config){0})));
}
/* Each low word of a start must be smaller than half the spacing of doubles. The time has none. */
static void test_low_words(void)
{
    const kr_scene s = tilted();
    kr_top *top = make(&s, taylor(), (kr_config){.digits = 30});
    for (int i = 0; i < 8; i++)
        for (int fits = 0; fits < 2; fits++) {
            double words[8] = {0.0};
            kr_state low;
            words[i] = fits ? 1e-40 : 1e-3;
            memcpy(&low, words, sizeof low);
            IS(kr_top_set_scene(top, &s, &low) == (fits && i > 0 ? KR_OK : KR_ERR_ARGUMENT));
        }
    kr_top_free(top);
}
/* A step or damping beyond the range of doubles in internal units is refused. */
static void test_internal_units(void)
{
    kr_scene s = tilted();
    kr_top *top = NULL;
    s.gravity = 1e200;
    IS(kr_top_create(&s, kr_method_find("rk4"), (kr_config){.step = 1e300}, &top) ==
       KR_ERR_ARGUMENT);
    IS(kr_top_create(&s, taylor(), (kr_config){.step = -1e300}, &top) == KR_ERR_ARGUMENT && !top);
    s = tilted();
    s.body.inertia = v_scale(1e-20, s.body.inertia);
    s.start.m = v_scale(1e-20, s.start.m);
    s.damping.z = 1e300;
    IS(kr_top_create(&s, taylor(), (kr_config){0}, &top) == KR_ERR_ARGUMENT && !top);
}
int main(void)
{
    test_omitted_parts();
    test_low_words();
    test_internal_units();
    test_scenes();
    test_bodies();
    test_makers();
    test_configs();
    test_queries();
    test_checkpoints();
    test_more_digits();
    return check_result();
}
