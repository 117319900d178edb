/* The closed form of Goryachev-Chaplygin tops: integrals, motions near degenerate ones, and the
 * reasons for refusals. test_torus_forms.c has the laws that the form shares with the form of
 * Kowalewski tops. */
#include <stdlib.h>
#include "torus_tops.h"

static void *memory;

static kr_scene drawn_top(void)
{
    kr_scene s = drawn_top_of_ratio(4.0);
    s.start.m.z = 0.0;
    return s;
}
static kr_scene some_top(void) { return chaplygin_top_of(v3(0.4, -0.3, 0.7), v3(0.6, 1.0, 0.8)); }

static const kr_goryachev_chaplygin *plan_of(const kr_scene *s)
{
    const kr_goryachev_chaplygin *top = NULL;
    const kr_status status = kr_goryachev_chaplygin_plan(s, 0.0, memory, &top);
    IS((status == KR_OK) == (top != NULL));
    IS(status == KR_OK || status == KR_ERR_METHOD);
    return top;
}
static int refusal_of(const kr_scene *s)
{
    const kr_goryachev_chaplygin *top = NULL;
    IS(kr_goryachev_chaplygin_plan(s, 0.0, memory, &top) == KR_ERR_METHOD && !top);
    return ((const kr_goryachev_chaplygin *)memory)->refusal;
}

static void integrals_are_constant(void)
{
    for (int i = 0; i < 200; i++) {
        const kr_scene s = drawn_top();
        const kr_goryachev_chaplygin *top = plan_of(&s);
        if (!top) continue;
        const double energy = kr_state_energy(&s, &s.start), scale = scale_of(&s),
                     G = kr_state_goryachev_chaplygin(&s, &s.start),
                     unit = scale * scale / v_largest(s.body.inertia);
        for (int k = 0; k < 8; k++) {
            const kr_state now = kr_goryachev_chaplygin_state(top, pow(10.0, uniform(-2, 7)));
            NEAR(q_dot(now.q, now.q), 1.0, 2e-15);
            IS(now.m.z == 0.0);
            NEAR(kr_state_energy(&s, &now) / unit, energy / unit, 3e-14 + 30.0 * top->certificate);
            const double size = pow(scale / v_largest(s.body.inertia), 3.0);
            NEAR(kr_state_goryachev_chaplygin(&s, &now) / size, G / size, 2e-13);
        }
    }
}
static void edges_are_met_or_refused(void)
{
    int met = 0;
    const kr_vec3 turn = v3(0.3, -0.7, 0.5), lean = v3(0.0, 0.6, -0.4);
    for (int i = 1; i <= 8; i++) {
        const double e = pow(10.0, -i);
        const kr_vec3 d = v_scale(e, lean), w = v_scale(e, turn);
        const kr_scene edges[] = {
            chaplygin_top_of(v3(1.0, d.y, d.z), w),  /* rest upright */
            chaplygin_top_of(v3(-1.0, d.y, d.z), w), /* rest hanging */
            chaplygin_top_of(v3(cos(1.0), sin(1.0), d.z),
                             v3(w.x, w.y, 1.1)),                       /* pendulum about axis 3 */
            chaplygin_top_of(v3(0.3, e, 0.9), v3(0.3, 1.2, 0.0)),      /* e3 nearly across axis 2 */
            chaplygin_top_of(v3(0.3, e, 0.9), v3(-4.0 * e, 1.2, 0.0)), /* pendulum about axis 2 */
            chaplygin_top_of(v3(0.3, -0.5, 0.8),
                             v3(1.0, 0.6, e)), /* momentum nearly across axis 3 */
            chaplygin_top_of(v3(0.4, -0.3, 0.7), v_scale(0.1 / e, turn)), /* fast */
        };
        for (size_t k = 0; k < sizeof edges / sizeof *edges; k++) {
            const kr_goryachev_chaplygin *top = plan_of(&edges[k]);
            if (!top) continue;
            met++;
            const double t = 10.0 / top->first,
                         miss = error_of(&edges[k], kr_goryachev_chaplygin_state(top, t),
                                         by_series(&edges[k], t));
            if (!(miss <= 1e-13 + 20.0 * top->certificate))
                printf("edge %d at 1e-%d: %.2g\n", (int)k, i, miss);
            NEAR(miss, 0.0, 1e-13 + 20.0 * top->certificate);
        }
    }
    IS(met > 40); /* of 56 */
}
/* If the start is a turning point of u1 or u2, rounding errors do not decide any sign. */
static void starts_at_turning_points_are_met(void)
{
    const kr_scene starts[] = {
        chaplygin_top_of(v3(0.0, 0.6, 0.8), v3(1.1, 0.0, 0.0)),
        chaplygin_top_of(v3(0.6, 0.0, 0.8), v3(0.8, 0.0, -0.6)),
        chaplygin_top_of(v3(-0.6, 0.0, 0.8), v3(0.8, 0.0, 0.6)),
        chaplygin_top_of(v3(0.0, 0.0, 1.0), v3(1.5, 0.0, 0.0)),
        chaplygin_top_of(v3(0.0, 0.0, 1.0), v3(1.0, 1.7, 0.0)),
    };
    for (size_t i = 0; i < sizeof starts / sizeof *starts; i++) {
        const kr_goryachev_chaplygin *top = plan_of(&starts[i]);
        IS(top);
        for (int way = -1; way <= 1 && top; way += 2) {
            const double t = way * 3.0 / top->first;
            const kr_state got = kr_goryachev_chaplygin_state(top, t);
            NEAR(error_of(&starts[i], got, by_series(&starts[i], t)), 0.0, 2e-14);
        }
    }
}
/* If G is zero but the motion is not planar, u2 moves on an arc far from zero, or not at all. */
static void tops_without_G_are_met(void)
{
    const kr_scene starts[] = {
        chaplygin_top_of(v3(0.0, -0.6, 0.8), v3(0.0, 2.0, 1.5)),
        chaplygin_top_of(v3(0.0, 0.8, 0.6), v3(0.0, -1.2, 1.6)),
        chaplygin_top_of(v3(-0.6, 0.8, 0.0), v3(1.6, 1.2, 0.0)),
        chaplygin_top_of(v3(0.6, 1e-11, 0.8), v3(1e-11, 2.0, 0.0)),
        chaplygin_top_of(v3(0.6, 0.8, 1e-9), v3(1e-9, 0.0, 1.25)),
    };
    for (size_t i = 0; i < sizeof starts / sizeof *starts; i++) {
        const kr_goryachev_chaplygin *top = plan_of(&starts[i]);
        IS(top);
        if (!top) continue;
        NEAR(error_of(&starts[i], kr_goryachev_chaplygin_state(top, 9.0), by_series(&starts[i], 9)),
             0.0, 3e-14);
    }
}
/* The heading of these tops has a term whose phase changes by about one radian until t = -40. */
static void slow_terms_are_met(void)
{
    for (int i = 0; i < 4; i++) {
        const double a = i & 1 ? -0.5 : 0.5, b = i & 2 ? -1.0 : 1.0;
        const kr_vec3 up = v_unit(v3(1.0, -b, 0.0)), L = v3(a, a * b, 0.125);
        const kr_scene s = chaplygin_top_of(up, v_sub(L, v_scale(v_dot(L, up), up)));
        const kr_goryachev_chaplygin *top = plan_of(&s);
        IS(top);
        if (!top) continue;
        NEAR(error_of(&s, kr_goryachev_chaplygin_state(top, -40.0), by_series(&s, -40.0)), 0.0,
             2e-14);
    }
}
static void degenerate_motions_are_refused_by_name(void)
{
    const kr_vec3 none = v3(0.0, 0.0, 0.0);
    const struct {
        kr_scene scene;
        int refusal;
    } motions[] = {
        {chaplygin_top_of(v3(1.0, 0.0, 0.0), none), KR_CHAPLYGIN_REST},
        {chaplygin_top_of(v3(-1.0, 0.0, 0.0), none), KR_CHAPLYGIN_REST},
        {chaplygin_top_of(v3(-1.0, 1e-9, 0.0), none), KR_CHAPLYGIN_REST},
        {chaplygin_top_of(v3(0.6, 0.8, 0.0), v3(0.0, 0.0, 1.25)), KR_CHAPLYGIN_PLANAR},
        {chaplygin_top_of(v3(0.6, 0.8, 0.0), none), KR_CHAPLYGIN_PLANAR},
        {chaplygin_top_of(v3(0.6, 0.0, 0.8), v3(0.0, 1.0, 0.0)), KR_CHAPLYGIN_PLANAR},
        {chaplygin_top_of(v3(1.0, 0.0, 0.0), v3(0.0, 2.0, 0.0)), KR_CHAPLYGIN_PLANAR},
        {chaplygin_top_of(v3(1.0, 1e-5, 2e-5), v3(1e-5, 0.0, 1e-5)), KR_CHAPLYGIN_ZERO},
        {chaplygin_top_of(v3(1.0, 3e-3, -6e-3), v3(7e-3, -4e-3, 1.25e-3)), KR_CHAPLYGIN_INTEGRALS},
        {chaplygin_top_of(v3(cos(1.0), sin(1.0), 3e-4), v3(5e-4, -4e-4, 0.275)),
         KR_CHAPLYGIN_HEADING},
        {chaplygin_top_of(v3(0.0, 0.0, 1.0), v3(1.0, 0.0, 0.0)), KR_CHAPLYGIN_COINCIDENT},
        {chaplygin_top_of(v3(0.4, -0.3, 0.7), v3(6e5, 1e6, 8e5)), KR_CHAPLYGIN_COINCIDENT},
    };
    for (size_t i = 0; i < sizeof motions / sizeof *motions; i++) {
        const int refusal = refusal_of(&motions[i].scene);
        if (refusal != motions[i].refusal) printf("motion %d: refusal %d\n", (int)i, refusal);
        IS(refusal == motions[i].refusal);
    }
    kr_scene s = some_top();
    IS(plan_of(&s));
    s.start.m.z = 1e-6;
    IS(refusal_of(&s) == KR_CHAPLYGIN_VERTICAL);
    s = some_top();
    s.gravity = 1e-300;
    IS(refusal_of(&s) == KR_CHAPLYGIN_WEIGHTLESS);
    s = some_top();
    s.damping.x = 0.125;
    IS(refusal_of(&s) == KR_CHAPLYGIN_OTHER);
    for (int i = 0; i < KR_CHAPLYGIN_REFUSAL_COUNT; i++) IS(kr_goryachev_chaplygin_refusal_text(i));
    IS(!kr_goryachev_chaplygin_refusal_text(-1) &&
       !kr_goryachev_chaplygin_refusal_text(KR_CHAPLYGIN_REFUSAL_COUNT));
}
/* A separatrix lies between the two kinds of motion of u2, in which chi librates or rotates. */
static void motions_beside_the_separatrix_are_met_or_refused(void)
{
    double low = 0.2, high = 2.5;
    int refused[KR_CHAPLYGIN_REFUSAL_COUNT] = {0};
    const kr_vec3 up = v3(0.4, -0.3, 0.7), momentum = v3(0.6, 1.0, 0.8);
    for (int i = 0; i < 50; i++) {
        const double size = 0.5 * (low + high);
        const kr_scene s = chaplygin_top_of(up, v_scale(size, momentum));
        const kr_vec3 L = q_turn_back(s.start.q, s.start.m), g = q_vertical(s.start.q);
        const double across = L.x * L.x + L.y * L.y, H = 0.5 * (across + 4.0 * L.z * L.z) + g.x,
                     G = fabs(L.z * across - L.x * g.z);
        if (H - 1.0 > 6.0 * pow(G / 8.0, 2.0 / 3.0))
            high = size;
        else
            low = size;
        const kr_goryachev_chaplygin *top = plan_of(&s);
        if (!top) {
            const int refusal = ((const kr_goryachev_chaplygin *)memory)->refusal;
            IS(refusal == KR_CHAPLYGIN_SEPARATRIX || refusal == KR_CHAPLYGIN_INTEGRALS ||
               refusal == KR_CHAPLYGIN_HEADING || refusal == KR_CHAPLYGIN_CERTIFICATE);
            refused[refusal]++;
            continue;
        }
        const double t = 5.0 / top->first;
        NEAR(error_of(&s, kr_goryachev_chaplygin_state(top, t), by_series(&s, t)), 0.0,
             1e-13 + 20.0 * top->certificate);
    }
    IS(refused[KR_CHAPLYGIN_SEPARATRIX] > 0 && refused[KR_CHAPLYGIN_INTEGRALS] > 0);
}
static void only_level_scenes_suit_the_method(void)
{
    const kr_method *exact = kr_method_find("exact");
    kr_scene s = some_top();
    IS(kr_method_applies(exact, &s.body) && kr_method_suits(exact, &s));
    s.start.m.z = 1e-16;
    kr_top *top = NULL;
    IS(!kr_method_suits(exact, &s));
    IS(kr_top_create(&s, exact, (kr_config){0}, &top) == KR_ERR_METHOD && !top);
    s.gravity = 0.0;
    IS(kr_method_suits(exact, &s));
}

int main(void)
{
    memory = malloc(kr_goryachev_chaplygin_size());
    integrals_are_constant();
    edges_are_met_or_refused();
    starts_at_turning_points_are_met();
    tops_without_G_are_met();
    slow_terms_are_met();
    degenerate_motions_are_refused_by_name();
    motions_beside_the_separatrix_are_met_or_refused();
    only_level_scenes_suit_the_method();
    free(memory);
    return check_result();
}
