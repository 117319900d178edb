/* Closed forms on a torus, of Kowalewski and of Goryachev-Chaplygin tops, at and near the edges of
 * their range: each motion agrees with the Taylor series of 30 digits within a multiple of its
 * certificate, or is refused by name. test_torus_forms.c has the laws that hold in the interior. */
#include <stdlib.h>
#include "exact_tops.h"

static kr_exact *memory; /* for any plan */
static const kr_vec3 none = {0.0, 0.0, 0.0}, turn = {0.3, -0.7, 0.5}, lean = {0.0, 0.6, -0.4};

/* Plans a top, and writes why it is refused if it is. Returns 1 if it is planned. */
static int plan(const kr_scene *s, int *refusal)
{
    const kr_status status = kr_exact_plan(s, 0.0, memory);
    IS(status == KR_OK || status == KR_ERR_METHOD);
    *refusal = (int)kr_exact_describe(memory).refusal;
    return status == KR_OK;
}
/* Compares a state of the plan in `memory` with the Taylor series. */
static void check_state(const kr_scene *s, double t, double floor)
{
    const double miss = error_of(s, kr_exact_state(memory, t), by_series(s, t)),
                 most = floor + 10.0 * kr_exact_describe(memory).certificate;
    if (!(miss <= most))
        printf("start (%g %g %g %g), (%g %g %g), t = %g:\n", s->start.q.w, s->start.q.x,
               s->start.q.y, s->start.q.z, s->start.m.x, s->start.m.y, s->start.m.z, t);
    NEAR(miss, 0.0, most);
}
/* Checks the state at `periods` over the rate of the top, if it is planned. Returns 1 if it is. */
static int is_met(const kr_scene *s, double periods, double floor)
{
    int refusal;
    if (!plan(s, &refusal)) return 0;
    check_state(s, periods / rate_of(s, memory), floor);
    return 1;
}
/* Checks the state at the time t of a top that must be planned. */
static void must_meet(kr_scene s, double t, double floor)
{
    int refusal = 0;
    const int is_planned = plan(&s, &refusal);
    if (!is_planned) printf("refusal %d:\n", refusal);
    IS(is_planned);
    if (is_planned) check_state(&s, t, floor);
}

/* Motions at the distance 10^-i from rest, rotations, pendulums, Delone's motions and fast ones. */
static void test_motions_near_edges(void)
{
    int met[2] = {0, 0};
    for (int i = 1; i <= 8; i++) {
        const double e = pow(10.0, -i);
        const kr_vec3 d = v_scale(e, lean), w = v_scale(e, turn);
        const kr_scene edges[2][7] = {
            {
                kowalewski_top_of(v3(-1.0, d.y, d.z), w), /* rest upright */
                kowalewski_top_of(v3(1.0, d.y, d.z), w),  /* rest hanging */
                kowalewski_top_of(v3(-1.0, d.y, d.z),
                                  v3(1.3 + w.x, w.y, w.z)), /* turning upright */
                kowalewski_top_of(v3(cos(1.0), sin(1.0), d.z), v3(w.x, w.y, 1.1)), /* pendulums */
                kowalewski_top_of(v3(cos(1.0), d.y, sin(1.0)), v3(w.x, 1.1, w.z)),
                kowalewski_top_of(v3(0.09 + e, -0.4, 0.912), v3(0.4, 0.5, 0.8)), /* Delone's */
                kowalewski_top_of(v3(0.4, -0.3, 0.7), v_scale(1.0 / e, turn)),   /* fast */
            },
            {
                chaplygin_top_of(v3(1.0, d.y, d.z), w),                           /* rest upright */
                chaplygin_top_of(v3(-1.0, d.y, d.z), w),                          /* rest hanging */
                chaplygin_top_of(v3(cos(1.0), sin(1.0), d.z), v3(w.x, w.y, 1.1)), /* pendulum */
                chaplygin_top_of(v3(0.3, e, 0.9), v3(0.3, 1.2, 0.0)), /* e3 nearly across axis 2 */
                chaplygin_top_of(v3(0.3, e, 0.9), v3(-4.0 * e, 1.2, 0.0)), /* pendulum */
                chaplygin_top_of(v3(0.3, -0.5, 0.8), v3(1.0, 0.6, e)), /* m nearly across axis 3 */
                chaplygin_top_of(v3(0.4, -0.3, 0.7), v_scale(0.1 / e, turn)), /* fast */
            },
        };
        for (int k = 0; k < 14; k++)
            met[k / 7] += is_met(&edges[k / 7][k % 7], 10.0, k < 7 ? 1e-14 : 1e-13);
        must_meet(
            kowalewski_top_of(v3(1.0, -0.4 * e, 0.3 * e), v3(1.3 + 0.5 * e, 0.7 * e, -0.6 * e)),
            90.0, 3e-14); /* nearly a uniform rotation, hanging */
    }
    IS(met[0] > 47 && met[1] > 40); /* of 56 */
}
/* At the first two starts w1 is close to an end of its arc and w2 is large, so that w1 stays close.
 * Then a branch point is on the circle through the complex roots and a pole, or beside it. Delone's
 * motions have k = 0. */
static void test_special_kowalewski_tops(void)
{
    const kr_scene slow[2] = {
        scene_of(v3(8.0, 4.0, 8.0), v3(0.0, 0.0, 1.5838076150419798), 1.0,
                 (kr_quat){0.4469138384788995, 0.18098687250299558, -0.34282535216903415,
                           -0.8062149532648338},
                 v3(-0.21565738291419392, -0.35312562393205915, -0.5980376352409914)),
        scene_of(v3(8.0, 16.0, 16.0), v3(0.0, 0.0, 0.3146801408140646), 1.0,
                 (kr_quat){-0.8953572710284634, 0.09986373266527335, 0.30937260232759217,
                           0.3043865717203618},
                 v3(0.19228212970655273, -0.288048672097125, -0.6373228824924703))};
    const double beside[] = {0.0, 1e-14, -1e-12, 1e-9, -1e-5};
    for (int i = 0; i < 2; i++) IS(is_met(&slow[i], 10.0, 5e-14));
    for (int i = 0; i < 5; i++)
        must_meet(
            kowalewski_top_of(v3(beside[i], -1.0, -1.0), v3(beside[i], 0.0, i % 2 ? 1.29 : 1.3)),
            9.0, 2e-14);
    const kr_scene delone =
        kowalewski_top_of(v3(0.09, -0.4, sqrt(1.0 - 0.09 * 0.09 - 0.4 * 0.4)), v3(0.4, 0.5, 0.8));
    NEAR(kr_state_kowalewski(&delone, &delone.start), 0.0, 1e-15);
    must_meet(delone, 70.0, 2e-14);
}
/* Near a saddle, most of a torus is near the saddle, and the motion away from it is quick in the
 * angles of the torus. */
static void test_saddles(void)
{
    int found = 0;
    for (int i = 0; i < 120; i++) {
        const double e = pow(10.0, uniform(-7, -1)), side = 0.7, rise = sqrt(1.0 - side * side);
        const kr_vec3 d = random_vec(e), g = random_vec(e),
                      rotation = v_scale(1.0 / sqrt(side), v3(-side, 0.0, rise));
        const kr_scene saddles[] = {
            kowalewski_top_of(v3(-1.0, g.y, g.z), v3(-1.3 + d.x, d.y, d.z)),
            kowalewski_top_of(v3(-1.0, g.y, g.z), d),
            kowalewski_top_of(v3(-side, g.y, rise + g.z), v_add(rotation, d)),
        };
        int refusal;
        if (!plan(&saddles[i % 3], &refusal)) continue;
        found++;
        for (double t = 7.0; t < 60.0; t *= 1.7) check_state(&saddles[i % 3], t, 2e-14);
        enum { TIMES = 11 };
        double t[TIMES];
        kr_state many[TIMES];
        for (int k = 0; k < TIMES; k++) t[k] = 40.0 - 11.7 * k;
        kr_exact_states(memory, TIMES, t, many);
        for (int k = 0; k < TIMES; k++) IS(same(many[k], kr_exact_state(memory, t[k])));
    }
    IS(found > 90);
    must_meet(kowalewski_top_of(v3(-1.0, 8e-9, -5e-9), v3(-0.85, 5e-9, -9.6e-9)), 20.0, 5e-14);
    must_meet(kowalewski_top_of(v3(-1.0, 0.0, -1.5e-10), v3(0.0, -9.5e-9, 2.9e-7)), 20.0, 2e-14);
}
/* Starts at turning points of u1 or u2, where rounding errors must not decide any sign; G = 0
 * without a planar motion; a term of the heading whose phase hardly changes; starts beside a quick
 * half turn of the heading. */
static void test_special_chaplygin_tops(void)
{
    const kr_scene turning[] = {
        chaplygin_top_of(v3(0.0, 0.6, 0.8), v3(1.1, 0.0, 0.0)),
        chaplygin_top_of(v3(0.6, 0.0, 0.8), v3(0.8, 0.0, -0.6)),
        chaplygin_top_of(v3(-0.6, 0.0, 0.8), v3(0.8, 0.0, 0.6)),
        chaplygin_top_of(v3(0.0, 0.0, 1.0), v3(1.5, 0.0, 0.0)),
        chaplygin_top_of(v3(0.0, 0.0, 1.0), v3(1.0, 1.7, 0.0)),
    };
    const kr_scene without_G[] = {
        chaplygin_top_of(v3(0.0, -0.6, 0.8), v3(0.0, 2.0, 1.5)),
        chaplygin_top_of(v3(0.0, 0.8, 0.6), v3(0.0, -1.2, 1.6)),
        chaplygin_top_of(v3(-0.6, 0.8, 0.0), v3(1.6, 1.2, 0.0)),
        chaplygin_top_of(v3(0.6, 1e-11, 0.8), v3(1e-11, 2.0, 0.0)),
        chaplygin_top_of(v3(0.6, 0.8, 1e-9), v3(1e-9, 0.0, 1.25)),
    };
    for (int i = 0; i < 5; i++) {
        IS(is_met(&turning[i], 3.0, 2e-14) && is_met(&turning[i], -3.0, 2e-14));
        must_meet(without_G[i], 9.0, 3e-14);
    }
    must_meet(chaplygin_top_of(v3(1.0, -0.5, -0.45), v3(-0.5, 0.84, 0.0)), 30.0, 3e-14);
    must_meet(chaplygin_top_of(v3(cos(1.0), sin(1.0), 3e-4), v3(5e-4, -4e-4, 0.275)), 9.0, 3e-14);
    for (int i = 0; i < 4; i++) {
        const double a = i & 1 ? -0.5 : 0.5, b = i & 2 ? -1.0 : 1.0;
        const kr_vec3 up = v_unit(v3(1.0, -b, 0.0)), L = v3(a, a * b, 0.125);
        must_meet(chaplygin_top_of(up, v_sub(L, v_scale(v_dot(L, up), up))), -40.0, 2e-14);
    }
    kr_scene quick[] = {
        scene_of(v3(0.8533732882976663, 0.8533732882976663, 0.21334332207441659),
                 v3(3.922908266969125, 2.8748975450782583, 0.0), -0.293264530697308,
                 (kr_quat){-0.39795741206403334, -0.6930484630047241, -0.03256489423839981,
                           -0.6002110077075634},
                 v3(-0.5824155178201763, -0.9748701649070326, 0.0)),
        scene_of(v3(21.933997591516157, 5.483499397879039, 21.933997591516157),
                 v3(-5.451130205507806, 0.0, 0.0), 1.0,
                 (kr_quat){-0.5461195326878039, 0.7067974237321547, -0.020914101402384814,
                           0.44916974317620095},
                 v3(8.558978183163026, 9.800516424800104, 0.0)),
    };
    quick[0].body.mass = 1.6944244049895523, quick[1].body.mass = 1.3037891295177786;
    for (double t = 1.0; t < 18.0; t *= 1.7)
        for (int i = 0; i < 2; i++) must_meet(quick[i], t, 1e-14);
}
/* Bisects for the separatrix between the two kinds of motion of u2, in which chi librates or
 * rotates. */
static void test_separatrix_of_chaplygin_tops(void)
{
    double low = 0.2, high = 2.5;
    int refused[KR_REFUSAL_COUNT] = {0};
    for (int i = 0; i < 50; i++) {
        const double size = 0.5 * (low + high);
        const kr_scene s = chaplygin_top_of(v3(0.4, -0.3, 0.7), v_scale(size, v3(0.6, 1.0, 0.8)));
        const kr_vec3 L = q_turn_back(s.start.q, s.start.m), g = q_turn_e3_back(s.start.q);
        const double across = L.x * L.x + L.y * L.y, H = 0.5 * (across + 4.0 * L.z * L.z) + g.x,
                     G = fabs(L.z * across - L.x * g.z);
        int refusal;
        *(H - 1.0 > 6.0 * pow(G / 8.0, 2.0 / 3.0) ? &high : &low) = size;
        if (plan(&s, &refusal))
            check_state(&s, 5.0 / rate_of(&s, memory), 1e-13);
        else
            refused[refusal]++;
    }
    IS(refused[KR_REFUSAL_SEPARATRIX] > 0 && refused[KR_REFUSAL_INTEGRALS] > 0);
    IS(!refused[KR_REFUSAL_KIND] && !refused[KR_REFUSAL_REST]);
}
/* Starts as users write them: the vertical and the angular velocity have components 0, 1 and -1,
 * times a simple number. Every other pair is tried. Many of these motions are degenerate. Nearly
 * all others are planned. */
static void test_simple_starts(void)
{
    const double rates[3] = {0.5, 1.0, 1.3}, times[2] = {7.0, -20.0};
    int planned[2] = {0, 0}, all = 0;
    for (int i = 0; i < 27; i++)
        for (int j = i % 2; j < 27 && i != 13; j += 2, all++) { /* number 13 is the zero vector */
            const kr_vec3 up = v3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1), e = v_unit(up),
                          w = v_scale(rates[(i + j) % 3], v3(j % 3 - 1, j / 3 % 3 - 1, j / 9 - 1)),
                          L = v_times(v3(1.0, 1.0, 0.25), w);
            const kr_scene starts[2] = {kowalewski_top_of(up, w),
                                        chaplygin_top_of(up, v_axpy(-v_dot(L, e), e, L))};
            for (int k = 0; k < 2; k++) {
                int refusal;
                if (!plan(&starts[k], &refusal)) continue;
                planned[k]++;
                check_state(&starts[k], times[(i + 2 * j) % 2], 3e-14);
            }
        }
    IS(planned[0] > 0.8 * all && planned[1] > 0.75 * all);
}
static kr_scene with_gravity(kr_scene s, double gravity) { return s.gravity = gravity, s; }
static kr_scene with_moment(kr_scene s, double i) { return s.body.inertia.y = i, s; }
static kr_scene with_damping(kr_scene s) { return s.damping.x = 0.125, s; }
static kr_scene with_vertical_momentum(kr_scene s) { return s.start.m.z = 1e-6, s; }
/* Degenerate motions, and motions near them, are refused by name. */
static void test_refusals(void)
{
    const double side = 0.7, rise = sqrt(1.0 - side * side), rate = 1.0 / sqrt(side);
    const kr_scene kowalewski = kowalewski_top_of(v3(0.6, 0.8, 0.0), v3(0.3, 0.2, 0.1)),
                   chaplygin = chaplygin_top_of(v3(0.4, -0.3, 0.7), v3(0.6, 1.0, 0.8));
    const struct {
        kr_scene scene;
        int refusal;
    } motions[] = {
        {kowalewski_top_of(v3(1.0, 0.0, 0.0), none), KR_REFUSAL_REST},
        {kowalewski_top_of(v3(-1.0, 0.0, 0.0), none), KR_REFUSAL_REST},
        {kowalewski_top_of(v3(-1.0, 3e-9, -6e-9), v3(7e-9, -4e-9, 5e-9)), KR_REFUSAL_REST},
        {kowalewski_top_of(v3(1.0, 0.0, 0.0), v3(1.5, 0.0, 0.0)), KR_REFUSAL_ROTATION},
        {kowalewski_top_of(v3(-1.0, 0.0, 0.0), v3(-3.0, 0.0, 0.0)), KR_REFUSAL_ROTATION},
        {kowalewski_top_of(v3(-side, 0.0, rise), v3(-side * rate, 0.0, rise * rate)),
         KR_REFUSAL_ROTATION},
        {kowalewski_top_of(v3(0.6, 0.8, 0.0), v3(0.0, 0.0, 1.25)), KR_REFUSAL_PLANAR},
        {kowalewski_top_of(v3(0.6, 0.0, 0.8), none), KR_REFUSAL_PLANAR},
        {kowalewski_top_of(v3(0.6, 0.0, 0.8), v3(0.0, 3.0, 0.0)), KR_REFUSAL_PLANAR},
        /* Axis 3 is vertical at the start: -k is a root of phi. */
        {kowalewski_top_of(v3(0.0, 0.0, 1.0), v3(0.5, 0.5, 0.5)), KR_REFUSAL_SEPARATRIX},
        /* q, r and g3 are zero: phi has a double root. */
        {kowalewski_top_of(v3(-0.6, 0.8, 0.0), v3(1.0, 0.0, 0.0)), KR_REFUSAL_SEPARATRIX},
        {kowalewski_top_of(v3(-1.0, 3e-10, -6e-10), v3(-1.3 + 7e-10, -4e-10, 5e-10)),
         KR_REFUSAL_SEPARATRIX},
        {kowalewski_top_of(v3(0.0, 0.0, 1.0), v3(1.0, 1.0, 1.0)), KR_REFUSAL_COINCIDENT},
        {kowalewski_top_of(v3(0.4, -0.3, 0.7), v3(3e6, -7e6, 5e6)), KR_REFUSAL_COINCIDENT},
        {kowalewski_top_of(v3(1.0, 3e-10, -6e-10), v3(1.3 + 7e-10, -4e-10, 5e-10)),
         KR_REFUSAL_COINCIDENT},
        {kowalewski_top_of(v3(2.0, -0.5, 0.0), v3(-1.680985356248839, 0.0, 0.0)),
         KR_REFUSAL_COINCIDENT},
        {with_moment(kowalewski, 2.0 + 1e-15), KR_REFUSAL_ROUNDED},
        {with_gravity(kowalewski, 1e-300), KR_REFUSAL_WEIGHTLESS},
        {with_damping(kowalewski), KR_REFUSAL_KIND},
        {chaplygin_top_of(v3(1.0, 0.0, 0.0), none), KR_REFUSAL_REST},
        {chaplygin_top_of(v3(-1.0, 0.0, 0.0), none), KR_REFUSAL_REST},
        {chaplygin_top_of(v3(-1.0, 1e-9, 0.0), none), KR_REFUSAL_REST},
        {chaplygin_top_of(v3(0.6, 0.8, 0.0), v3(0.0, 0.0, 1.25)), KR_REFUSAL_PLANAR},
        {chaplygin_top_of(v3(0.6, 0.8, 0.0), none), KR_REFUSAL_PLANAR},
        {chaplygin_top_of(v3(1.0, 0.0, 0.0), v3(0.0, 2.0, 0.0)), KR_REFUSAL_PLANAR},
        {chaplygin_top_of(v3(1.0, 1e-5, 2e-5), v3(1e-5, 0.0, 1e-5)), KR_REFUSAL_ZERO},
        {chaplygin_top_of(v3(-1.0, 2e-8, 2e-8), v3(-1e-9, 1e-9, -1e-9)), KR_REFUSAL_ZERO},
        {chaplygin_top_of(v3(1.0, 3e-3, -6e-3), v3(7e-3, -4e-3, 1.25e-3)), KR_REFUSAL_INTEGRALS},
        {chaplygin_top_of(v3(1.0, 2e-2, -4e-2), v3(5e-2, -3e-2, 1e-2)), KR_REFUSAL_HEADING},
        {chaplygin_top_of(v3(0.0, 0.0, 1.0), v3(1.0, 0.0, 0.0)), KR_REFUSAL_COINCIDENT},
        {chaplygin_top_of(v3(0.4, -0.3, 0.7), v3(6e5, 1e6, 8e5)), KR_REFUSAL_COINCIDENT},
        {with_vertical_momentum(chaplygin), KR_REFUSAL_VERTICAL},
        {with_gravity(chaplygin, 1e-300), KR_REFUSAL_WEIGHTLESS},
        {with_damping(chaplygin), KR_REFUSAL_KIND},
    };
    for (size_t i = 0; i < sizeof motions / sizeof *motions; i++) {
        int refusal = -1;
        IS(!plan(&motions[i].scene, &refusal));
        if (refusal != motions[i].refusal) printf("motion %d: refusal %d\n", (int)i, refusal);
        IS(refusal == motions[i].refusal);
    }
    for (int i = -1; i <= KR_REFUSAL_COUNT; i++)
        IS(!kr_refusal_text((kr_refusal)i) == (i < 0 || i == KR_REFUSAL_COUNT));
}
/* The method `exact` needs <m, e3> = 0 exactly. Without gravity it does not. */
static void test_level_starts(void)
{
    const kr_method *exact = kr_method_find("exact");
    kr_scene s = chaplygin_top_of(v3(0.4, -0.3, 0.7), v3(0.6, 1.0, 0.8));
    kr_top *top = NULL;
    IS(kr_method_applies(exact, &s.body) && kr_method_suits(exact, &s));
    s.start.m.z = 1e-16;
    IS(!kr_method_suits(exact, &s));
    IS(kr_top_create(&s, exact, (kr_config){0}, &top) == KR_ERR_METHOD && !top);
    s.gravity = 0.0;
    IS(kr_method_suits(exact, &s));
}

int main(void)
{
    const kr_scene tops[] = {kowalewski_top_of(lean, turn), chaplygin_top_of(lean, turn)};
    memory = malloc(kr_exact_size(&tops[0]) + kr_exact_size(&tops[1]));
    test_motions_near_edges();
    test_special_kowalewski_tops();
    test_saddles();
    test_special_chaplygin_tops();
    test_separatrix_of_chaplygin_tops();
    test_simple_starts();
    test_refusals();
    test_level_starts();
    free(memory);
    return check_result();
}
