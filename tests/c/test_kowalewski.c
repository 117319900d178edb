/* The closed form of Kowalewski tops: integrals, motions near separatrices and degenerate motions,
 * and the reasons for refusals. test_torus_forms.c has the laws that the form shares with the form
 * of Goryachev-Chaplygin tops. */
#include <stdlib.h>
#include "torus_tops.h"

static void *memory;

static kr_scene drawn_top(void) { return drawn_top_of_ratio(2.0); }
static const kr_kowalewski *plan_of(const kr_scene *s)
{
    const kr_kowalewski *top = NULL;
    const kr_status status = kr_kowalewski_plan(s, 0.0, memory, &top);
    IS((status == KR_OK) == (top != NULL));
    IS(status == KR_OK || status == KR_ERR_METHOD);
    return top;
}
static void integrals_are_constant(void)
{
    for (int i = 0; i < 300; i++) {
        const kr_scene s = drawn_top();
        const kr_kowalewski *top = plan_of(&s);
        if (!top) continue;
        const double energy = kr_state_energy(&s, &s.start), scale = scale_of(&s),
                     K = kr_state_kowalewski(&s, &s.start);
        for (int k = 0; k < 8; k++) {
            const kr_state now = kr_kowalewski_state(top, pow(10.0, uniform(-2, 7)));
            NEAR(q_dot(now.q, now.q), 1.0, 2e-15);
            NEAR(now.m.z / scale, s.start.m.z / scale, 3e-14 + 30.0 * top->certificate);
            NEAR(kr_state_energy(&s, &now) / (1e-300 + fabs(energy) + scale * scale),
                 energy / (1e-300 + fabs(energy) + scale * scale), 3e-14 + 30.0 * top->certificate);
            const double size = pow(scale / v_largest(s.body.inertia), 4.0);
            NEAR(kr_state_kowalewski(&s, &now) / size, K / size, 2e-12);
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
            kowalewski_top_of(v3(-1.0, d.y, d.z), w), /* rest upright */
            kowalewski_top_of(v3(1.0, d.y, d.z), w),  /* rest hanging */
            kowalewski_top_of(v3(-1.0, d.y, d.z),
                              v_add(v3(1.3, 0.0, 0.0), w)), /* turning upright */
            kowalewski_top_of(v3(cos(1.0), sin(1.0), d.z),
                              v3(w.x, w.y, 1.1)), /* pendulum about axis 3 */
            kowalewski_top_of(v3(cos(1.0), d.y, sin(1.0)),
                              v3(w.x, 1.1, w.z)), /* pendulum about axis 2 */
            kowalewski_top_of(v3(0.09 + e, -0.4, 0.912),
                              v3(0.4, 0.5, 0.8)), /* near Delone's motions */
            kowalewski_top_of(v3(0.4, -0.3, 0.7), v_scale(1.0 / e, turn)), /* fast */
        };
        for (size_t k = 0; k < sizeof edges / sizeof *edges; k++) {
            const kr_kowalewski *top = plan_of(&edges[k]);
            if (!top) continue;
            met++;
            const double t = 10.0 / top->second;
            const double miss =
                error_of(&edges[k], kr_kowalewski_state(top, t), by_series(&edges[k], t));
            if (!(miss <= 1e-14 + 20.0 * top->certificate))
                printf("edge %d at 1e-%d: %.2g\n", (int)k, i, miss);
            NEAR(miss, 0.0, 1e-14 + 20.0 * top->certificate);
        }
    }
    IS(met > 47); /* of 56 */
}
/* Close to a uniform rotation about the axis of the hanging centre of mass, both variables move on
 * short arcs. */
static void nearly_uniform_rotations_are_met(void)
{
    for (int i = 1; i <= 8; i++) {
        const double e = pow(10.0, -i);
        const kr_scene s =
            kowalewski_top_of(v3(1.0, -0.4 * e, 0.3 * e), v3(1.3 + 0.5 * e, 0.7 * e, -0.6 * e));
        const kr_kowalewski *top = plan_of(&s);
        IS(top);
        if (top)
            NEAR(error_of(&s, kr_kowalewski_state(top, 90.0), by_series(&s, 90.0)), 0.0, 3e-14);
    }
}
static int refusal_of(const kr_scene *s)
{
    const kr_kowalewski *top = NULL;
    IS(kr_kowalewski_plan(s, 0.0, memory, &top) == KR_ERR_METHOD && !top);
    return ((const kr_kowalewski *)memory)->refusal;
}
/* At these starts w1 is close to an end of its arc and w2 is large, so that w1 stays close. */
static void slow_starts_are_met(void)
{
    const kr_scene starts[] = {
        {{1.0, {8.0, 4.0, 8.0}, {0.0, 0.0, 1.5838076150419798}, {1, 0, 0, 0}, 0, {0.0, 0.0, 0.0}},
         1.0,
         {0.0,
          {0.4469138384788995, 0.18098687250299558, -0.34282535216903415, -0.8062149532648338},
          {-0.21565738291419392, -0.35312562393205915, -0.5980376352409914}},
         {0.0, 0.0, 0.0},
         {0, 0, 0},
         {0, 0, 0},
         0.0},
        {{1.0, {8.0, 16.0, 16.0}, {0.0, 0.0, 0.3146801408140646}, {1, 0, 0, 0}, 0, {0.0, 0.0, 0.0}},
         1.0,
         {0.0,
          {-0.8953572710284634, 0.09986373266527335, 0.30937260232759217, 0.3043865717203618},
          {0.19228212970655273, -0.288048672097125, -0.6373228824924703}},
         {0.0, 0.0, 0.0},
         {0, 0, 0},
         {0, 0, 0},
         0.0},
    };
    for (size_t i = 0; i < sizeof starts / sizeof *starts; i++) {
        const kr_kowalewski *top = plan_of(&starts[i]);
        IS(top);
        if (!top) continue;
        const double t = 10.0 / top->second;
        NEAR(error_of(&starts[i], kr_kowalewski_state(top, t), by_series(&starts[i], t)), 0.0,
             5e-14);
    }
}
/* A branch point is on the circle through the complex roots and a pole, or beside it. */
static void roots_near_a_path_are_met(void)
{
    for (int i = 0; i < 5; i++) {
        const double beside[] = {0.0, 1e-14, -1e-12, 1e-9, -1e-5};
        const kr_scene s =
            kowalewski_top_of(v3(beside[i], -1.0, -1.0), v3(beside[i], 0.0, i % 2 ? 1.29 : 1.3));
        const kr_kowalewski *top = plan_of(&s);
        IS(top);
        if (top) NEAR(error_of(&s, kr_kowalewski_state(top, 9.0), by_series(&s, 9.0)), 0.0, 2e-14);
    }
}
/* Near a saddle the terms of the theta functions cancel, and dual sums take their place. */
static void dual_sums_are_met_near_saddles(void)
{
    enum { TIMES = 11 };
    for (double e = 1e-2; e > 1e-4; e *= 0.3) {
        const kr_scene saddles[] = {
            kowalewski_top_of(v3(-1.0, 0.3 * e, -0.4 * e), v3(-1.3 + 0.7 * e, 0.5 * e, -0.6 * e)),
            kowalewski_top_of(v3(-1.0, 0.8 * e, 0.2 * e), v3(0.5 * e, -0.4 * e, e)),
            kowalewski_top_of(v3(0.6, 0.8, e), v3(0.1 * e, -0.1 * e, 4.1 + 0.1 * e)),
        };
        for (size_t i = 0; i < sizeof saddles / sizeof *saddles; i++) {
            const kr_kowalewski *top = plan_of(&saddles[i]);
            double t[TIMES];
            kr_state many[TIMES];
            IS(top && top->certificate < 1e-12);
            if (!top) continue;
            for (int k = 0; k < TIMES; k++) t[k] = 40.0 - 11.7 * k;
            kr_kowalewski_states(top, TIMES, t, many);
            for (int k = 0; k < TIMES; k++) IS(same(many[k], kr_kowalewski_state(top, t[k])));
            NEAR(error_of(&saddles[i], many[0], by_series(&saddles[i], t[0])), 0.0, 1e-12);
        }
    }
}
/* The samples of a closed form are few, and the errors of dual sums are larger between them. */
static void certificates_bound_errors_near_saddles(void)
{
    int found = 0;
    for (int i = 0; i < 300; i++) {
        const double e = pow(10.0, uniform(-7, -2)), lean = 0.7, rise = sqrt(1.0 - lean * lean);
        const kr_vec3 d = random_vec(e), g = random_vec(e);
        const kr_vec3 rotation = v_scale(1.0 / sqrt(lean), v3(-lean, 0.0, rise));
        const kr_scene saddles[] = {
            kowalewski_top_of(v3(-1.0, g.y, g.z), v3(-1.3 + d.x, d.y, d.z)),
            kowalewski_top_of(v3(-1.0, g.y, g.z), d),
            kowalewski_top_of(v3(-lean, g.y, rise + g.z), v_add(rotation, d)),
        };
        const kr_scene *s = &saddles[i % 3];
        const kr_kowalewski *top = plan_of(s);
        if (!top) continue;
        found++;
        for (double t = 7.0; t < 60.0; t *= 1.7) {
            const double miss = error_of(s, kr_kowalewski_state(top, t), by_series(s, t));
            if (!(miss <= 2e-14 + 10.0 * top->certificate)) printf("saddle %d at %g\n", i, e);
            NEAR(miss, 0.0, 2e-14 + 10.0 * top->certificate);
        }
    }
    IS(found > 100);
}
typedef struct motion {
    kr_scene scene;
    int refusal;
} motion;
static void are_refused_by_name(size_t count, const motion motions[])
{
    for (size_t i = 0; i < count; i++) {
        const int refusal = refusal_of(&motions[i].scene);
        if (refusal != motions[i].refusal) printf("motion %d: refusal %d\n", (int)i, refusal);
        IS(refusal == motions[i].refusal);
    }
}
static void degenerate_motions_are_refused_by_name(void)
{
    const kr_vec3 none = v3(0.0, 0.0, 0.0);
    const double lean = 0.7, rise = sqrt(1.0 - lean * lean), rate = 1.0 / sqrt(lean);
    const motion motions[] = {
        {kowalewski_top_of(v3(1.0, 0.0, 0.0), none), KR_KOWALEWSKI_REST},
        {kowalewski_top_of(v3(-1.0, 0.0, 0.0), none), KR_KOWALEWSKI_REST},
        {kowalewski_top_of(v3(1.0, 0.0, 0.0), v3(1.5, 0.0, 0.0)), KR_KOWALEWSKI_ROTATION},
        {kowalewski_top_of(v3(-1.0, 0.0, 0.0), v3(1.5, 0.0, 0.0)), KR_KOWALEWSKI_ROTATION},
        {kowalewski_top_of(v3(-1.0, 0.0, 0.0), v3(-3.0, 0.0, 0.0)), KR_KOWALEWSKI_ROTATION},
        {kowalewski_top_of(v3(-lean, 0.0, rise), v3(-lean * rate, 0.0, rise * rate)),
         KR_KOWALEWSKI_ROTATION},
        {kowalewski_top_of(v3(0.6, 0.8, 0.0), v3(0.0, 0.0, 1.25)), KR_KOWALEWSKI_PLANAR},
        {kowalewski_top_of(v3(0.6, 0.8, 0.0), v3(0.0, 0.0, 5.0)), KR_KOWALEWSKI_PLANAR},
        {kowalewski_top_of(v3(0.6, 0.0, 0.8), none), KR_KOWALEWSKI_PLANAR},
        {kowalewski_top_of(v3(0.6, 0.0, 0.8), v3(0.0, 3.0, 0.0)), KR_KOWALEWSKI_PLANAR},
        /* Axis 3 is vertical at the start: -k is a root of phi. */
        {kowalewski_top_of(v3(0.0, 0.0, 1.0), v3(0.0, 0.0, 1.0)), KR_KOWALEWSKI_SEPARATRIX},
        {kowalewski_top_of(v3(0.0, 0.0, 1.0), v3(0.5, 0.5, 0.5)), KR_KOWALEWSKI_SEPARATRIX},
        {kowalewski_top_of(v3(0.0, 0.0, 1.0), v3(1.0, 1.0, 1.0)), KR_KOWALEWSKI_COINCIDENT},
        /* q, r and g3 are zero: phi has a double root. */
        {kowalewski_top_of(v3(-0.6, 0.8, 0.0), v3(1.0, 0.0, 0.0)), KR_KOWALEWSKI_SEPARATRIX},
        {kowalewski_top_of(v3(0.4, -0.3, 0.7), v3(3e6, -7e6, 5e6)), KR_KOWALEWSKI_COINCIDENT},
    };
    are_refused_by_name(sizeof motions / sizeof *motions, motions);
}
/* No motion is known that is refused as START or TERMS. */
static void motions_near_degenerate_ones_are_refused_by_name(void)
{
    const double lean = 0.7, rise = sqrt(1.0 - lean * lean), rate = 1.0 / sqrt(lean);
    const motion motions[] = {
        {kowalewski_top_of(v3(-1.0, 3e-9, -6e-9), v3(7e-9, -4e-9, 5e-9)), KR_KOWALEWSKI_REST},
        {kowalewski_top_of(v3(1.0, 3e-10, -6e-10), v3(1.3 + 7e-10, -4e-10, 5e-10)),
         KR_KOWALEWSKI_INTEGRALS},
        {kowalewski_top_of(v3(-1.0, 3e-10, -6e-10), v3(-1.3 + 7e-10, -4e-10, 5e-10)),
         KR_KOWALEWSKI_SEPARATRIX},
        {kowalewski_top_of(v3(-lean, 1e-6, rise), v3(-lean * rate, -7e-7, rise * rate + 3e-7)),
         KR_KOWALEWSKI_CERTIFICATE},
        {kowalewski_top_of(v3(-lean, 0.0, rise - 8e-10),
                           v3(-lean * rate, -8e-10, rise * rate + 1.2e-9)),
         KR_KOWALEWSKI_SEPARATRIX},
    };
    are_refused_by_name(sizeof motions / sizeof *motions, motions);
}
/* A rounding error of these starts changes the state at the last time by up to 1e-7 radians. */
static void motions_next_to_the_upright_rest_are_met(void)
{
    for (int i = 0; i < 24; i++) {
        const double near = pow(10.0, -1.0 - 0.25 * i);
        const kr_vec3 a = random_vec(near), w = random_vec(near);
        const kr_scene s = kowalewski_top_of(v3(-1.0, a.y, a.z), w);
        const kr_kowalewski *top = plan_of(&s);
        IS(top);
        if (!top) continue;
        IS(top->certificate < 1e-11);
        const double t[3] = {1.0, 7.7, 50.0};
        for (int j = 0; j < 3; j++)
            NEAR(error_of(&s, kr_kowalewski_state(top, t[j]), by_series(&s, t[j])), 0.0,
                 5e-14 + 10.0 * top->certificate);
    }
}
static void fast_tops_are_met(void)
{
    for (int i = 0; i < 24; i++) {
        const double rate = pow(10.0, 1.0 + i / 6.0);
        const kr_scene s = kowalewski_top_of(random_vec(1.0), v_scale(rate, v3(0.7, -0.4, 0.5)));
        const kr_kowalewski *top = plan_of(&s);
        IS(top);
        if (top)
            NEAR(error_of(&s, kr_kowalewski_state(top, 300.0 / rate), by_series(&s, 300.0 / rate)),
                 0.0, 3e-14);
    }
}
/* Delone's motions have k = 0. Their curve is not degenerate in the library's coordinates. */
static void motions_of_delone_are_met(void)
{
    const kr_scene s =
        kowalewski_top_of(v3(0.09, -0.4, sqrt(1.0 - 0.09 * 0.09 - 0.4 * 0.4)), v3(0.4, 0.5, 0.8));
    NEAR(kr_state_kowalewski(&s, &s.start), 0.0, 1e-15);
    const kr_kowalewski *top = plan_of(&s);
    IS(top);
    if (top) NEAR(error_of(&s, kr_kowalewski_state(top, 70.0), by_series(&s, 70.0)), 0.0, 2e-14);
}
static void refusals_have_texts(void)
{
    kr_scene slight = kowalewski_top_of(v3(0.6, 0.8, 0.0), v3(0.3, 0.2, 0.1));
    slight.gravity = 1e-300;
    IS(refusal_of(&slight) == KR_KOWALEWSKI_WEIGHTLESS);
    kr_scene other = tilted();
    IS(refusal_of(&other) == KR_KOWALEWSKI_OTHER);
    other = kowalewski_top_of(v3(1.0, 0.0, 0.0), v3(0.5, 0.25, 1.0));
    IS(plan_of(&other));
    other.damping.x = 0.125;
    IS(refusal_of(&other) == KR_KOWALEWSKI_OTHER);
    for (int i = 0; i < KR_KOWALEWSKI_REFUSAL_COUNT; i++) IS(kr_kowalewski_refusal_text(i));
    IS(!kr_kowalewski_refusal_text(-1) && !kr_kowalewski_refusal_text(KR_KOWALEWSKI_REFUSAL_COUNT));
}

int main(void)
{
    memory = malloc(kr_kowalewski_size());
    integrals_are_constant();
    edges_are_met_or_refused();
    slow_starts_are_met();
    nearly_uniform_rotations_are_met();
    roots_near_a_path_are_met();
    dual_sums_are_met_near_saddles();
    certificates_bound_errors_near_saddles();
    degenerate_motions_are_refused_by_name();
    motions_near_degenerate_ones_are_refused_by_name();
    motions_next_to_the_upright_rest_are_met();
    fast_tops_are_met();
    motions_of_delone_are_met();
    refusals_have_texts();
    free(memory);
    return check_result();
}
