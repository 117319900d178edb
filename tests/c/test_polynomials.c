/* Polynomials of an event within a step: sign changes, and the products of two components. */
#include "events/sign_changes.h"
#include "events/event_polynomial.h"
#include "model/quantities.h"
#include "tops.h"

enum { MANY = 64 };

/* Finds the sign changes of scale * prod (s - root), and returns their number. */
static int roots_of(int n, const double *root, double scale, double *found)
{
    double c[KR_POLYNOMIAL_ORDER_MAX + 1] = {scale};
    for (int k = 0; k < n; k++)
        for (int i = k + 1; i >= 0; i--) c[i] = (i > 0 ? c[i - 1] : 0.0) - root[k] * c[i];
    kr_sign_search r = {
        .c = c, .degree = n, .noise = fabs(scale) * 0x1p-48, .start_noise = fabs(scale) * 0x1p-40};
    int count = 0;
    while (count < MANY && kr_search_next_sign_change(&r)) found[count++] = r.root;
    return count;
}
static void test_named_roots(void)
{
    const double near[] = {0.3, 0.3 + 1e-6, -2.0, 3.0}, twice[] = {0.37, 0.37},
                 thrice[] = {0.37, 0.37, 0.37};
    const double ends[] = {0.0, 1.0, 0.5}, outside[] = {-0.1, 1.1}, near_end[] = {1.0 - 1e-9, 2.0};
    double found[MANY], scaled[MANY];
    IS(roots_of(4, near, 1.0, found) == 2);
    NEAR(found[0], near[0], 1e-9);
    NEAR(found[1], near[1], 1e-9);
    IS(roots_of(4, near, -0x1p-300, scaled) == 2 && scaled[0] == found[0] && scaled[1] == found[1]);
    IS(roots_of(2, twice, 1.0, found) == 0);
    IS(roots_of(3, thrice, 1.0, found) == 1);
    /* A triple root has an error of the order of the cube root of the rounding error. */
    NEAR(found[0], 0.37, 1e-4);
    /* neither the start nor the end */
    IS(roots_of(3, ends, 1.0, found) == 1 && fabs(found[0] - 0.5) < 1e-15);
    IS(roots_of(2, outside, 1.0, found) == 0);
    IS(roots_of(2, near_end, 1.0, found) == 1);
    NEAR(found[0], near_end[0], 1e-15);
    IS(roots_of(1, outside, 0.0, found) == 0);
    IS(roots_of(2, twice, INFINITY, found) == 0 && roots_of(2, twice, NAN, found) == 0);
}
/* Exactly the roots inside the step are found; up to eight of the twelve roots lie outside. Cases
 * with two roots closer than 0.01 are skipped. */
static void test_random_roots(void)
{
    double found[MANY];
    int tried = 0;
    for (int i = 0; i < 20000; i++) {
        double root[12];
        int inside = 0;
        for (int k = 0; k < 12; k++)
            root[k] = k % 3 ? uniform(-1.5, 2.5) : 0.04 * k + uniform(0.0, 0.03);
        for (int k = 0; k < 12; k++) inside += root[k] > 0.0 && root[k] < 1.0;
        for (int k = 0; k < 144; k++)
            if (k / 12 != k % 12 && fabs(root[k / 12] - root[k % 12]) < 0.01) inside = -1;
        if (inside < 0) continue;
        IS(roots_of(12, root, 1.0, found) == inside);
        tried++;
    }
    IS(tried > 1000);
}
/* The test for the possibility of a sign change takes every term into account. */
static void test_single_terms(void)
{
    for (int n = 1; n <= KR_POLYNOMIAL_ORDER_MAX; n++) {
        double c[KR_POLYNOMIAL_ORDER_MAX + 1] = {1.0};
        c[n] = -1.5;
        kr_sign_search r = {.c = c, .degree = n, .noise = 0x1p-48, .start_noise = 0x1p-40};
        IS(kr_search_next_sign_change(&r));
        NEAR(r.root, pow(1.0 / 1.5, 1.0 / n), 1e-14);
    }
}

/* Writes the indices of all components that events accept, and returns their number. */
static int all_components(int *component)
{
    int n = 0;
    for (int number = 0; number <= KR_QUANTITIES * KR_AXES && n < MANY; number++)
        if (kr_component_is_valid(number)) component[n++] = number;
    IS(n > 20 && n < MANY);
    return n;
}
/* The polynomial of every product of two components agrees with the states inside a step. */
static void test_products(const kr_scene *s, int digits)
{
    int component[MANY];
    const int components = all_components(component);
    kr_top *top = make(s, taylor(), (kr_config){.digits = digits});
    IS(kr_top_watch(top, 0, NULL) == KR_OK);
    for (int i = 0; i < components * components; i++) {
        const kr_term product = {0.7, component[i / components], component[i % components]};
        const kr_event g = {.terms = &product, .count = 1},
                       rate = {.terms = &product, .count = 1, .extremum = 1};
        double c[KR_TERMS_ROOM], d[KR_TERMS_ROOM], there = 0.0;
        IS(kr_top_advance(top, 0.05 * i) == KR_OK);
        const kr_step_polynomial piece = top->method->polynomial(&top->main);
        const kr_state inside = kr_top_state(top);
        const double size = kr_terms_bound(top, &piece, 1, &product);
        const double at =
            i == 0 ? 0.0
                   : (top->requested / top->time_unit - piece.begin) / (piece.end - piece.begin);
        const int degree = kr_terms_polynomial(top, &piece, &g, c);
        for (int n = degree; n >= 0; n--) there = there * at + c[n];
        NEAR(there, kr_terms_value(s, &inside, 1, &product), 1e-14 * size);
        IS(at >= 0.0 && at <= 1.0 && kr_terms_polynomial(top, &piece, &rate, d) == degree - 1);
        for (int n = 0; n < degree; n++) NEAR(d[n], (n + 1) * c[n + 1], 1e-13 * size);
    }
    kr_top_free(top);
}
/* The polynomials of adjacent steps agree at the border up to rounding, however inaccurate the
 * state is. Therefore no event there is lost or found twice. */
static void test_continuity_of_steps(const kr_scene *s, double tol)
{
    int component[MANY];
    const int components = all_components(component);
    double ends[2 * MANY], c[KR_TERMS_ROOM];
    kr_top *top = make(s, taylor(), (kr_config){.tol = tol});
    IS(kr_top_watch(top, 0, NULL) == KR_OK);
    for (int step = 0; step < 20; step++) {
        IS(kr_top_step(top) == KR_OK);
        const kr_step_polynomial piece = top->method->polynomial(&top->main);
        for (int i = 0; i < 2 * components; i++) {
            const kr_term product = {0.7, component[i / 2], component[(7 * i + 3) % components]};
            const kr_event g = {.terms = &product, .count = 1, .extremum = i % 2};
            const double size = kr_terms_bound(top, &piece, 1, &product),
                         per = i % 2 ? piece.span : 1.0;
            double end = 0.0;
            const int degree = kr_terms_polynomial(top, &piece, &g, c);
            for (int n = 0; n <= degree; n++) end += c[n] / per;
            if (step > 0) NEAR(c[0] / per, ends[i], 0x1p-48 * size);
            ends[i] = end;
        }
    }
    kr_top_free(top);
}

int main(void)
{
    kr_scene scenes[3] = {kr_scene_default(), tilted(), tilted()};
    test_named_roots();
    test_random_roots();
    test_single_terms();
    scenes[1].body = scenes[2].body = general_body();
    scenes[2].gravity = -2.5;
    for (int i = 0; i < 3; i++)
        for (int digits = 16; digits <= 30; digits += 7) test_products(&scenes[i], digits);
    for (double tol = 1e-1; tol > 1e-16; tol *= 1e-5) test_continuity_of_steps(&scenes[1], tol);
    return check_result();
}
