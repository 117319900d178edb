/* The closed form of Kowalewski tops: comparison with references by heyoka, integrals, motions near
 * separatrices and degenerate motions, and the reasons for refusals. test_torus_forms.c has the
 * laws that the form shares with the form of Goryachev-Chaplygin tops. */
#include <stdlib.h>
#include "kowalewski_truth.h"
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
static void truths_by_heyoka_are_met(void)
{
    const size_t count = sizeof kowalewski_truths / sizeof *kowalewski_truths;
    IS(count >= 50);
    for (size_t i = 0; i < count; i++) {
        const kowalewski_truth *c = &kowalewski_truths[i];
        const kr_scene s = scene_of(c->inertia, c->com, c->gravity, c->q, c->m);
        const kr_kowalewski *top = plan_of(&s);
        IS(top);
        if (!top) continue;
        const kr_state end = kr_kowalewski_state(top, c->t);
        const kr_quat d = q_mul(q_conj(c->q_at), end.q);
        const double miss = 2.0 * v_length(q_vec(d)) + off(end.m, c->m_at) / scale_of(&s);
        if (!(miss <= 2e-14)) printf("truth %d at t = %g: %.2g\n", (int)i, c->t, miss);
        NEAR(miss, 0.0, 2e-14);
        IS(d.w > 0.0);
        IS(top->mismatch == 0.0 && top->refusal == KR_KOWALEWSKI_PLANNED);
        IS(top->certificate < 1e-13);
    }
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
            const double t = 10.0 / top->second;
            const double miss =
                error_of(&edges[k], kr_kowalewski_state(top, t), by_series(&edges[k], t));
            if (!(miss <= 1e-14 + 20.0 * top->certificate))
                printf("edge %d at 1e-%d: %.2g\n", (int)k, i, miss);
            NEAR(miss, 0.0, 1e-14 + 20.0 * top->certificate);
        }
    }
}
static int refusal_of(const kr_scene *s)
{
    const kr_kowalewski *top = NULL;
    IS(kr_kowalewski_plan(s, 0.0, memory, &top) == KR_ERR_METHOD && !top);
    return ((const kr_kowalewski *)memory)->refusal;
}
static void degenerate_motions_are_refused_by_name(void)
{
    const kr_vec3 none = v3(0.0, 0.0, 0.0);
    const kr_scene coincident[] = {
        kowalewski_top_of(v3(1.0, 0.0, 0.0), none), /* rest */
        kowalewski_top_of(v3(-1.0, 0.0, 0.0), none),
        kowalewski_top_of(v3(1.0, 0.0, 0.0), v3(1.5, 0.0, 0.0)), /* permanent rotations */
        kowalewski_top_of(v3(-1.0, 0.0, 0.0), v3(1.5, 0.0, 0.0)),
        kowalewski_top_of(v3(0.6, 0.8, 0.0), v3(0.0, 0.0, 1.25)), /* pendulums */
        kowalewski_top_of(v3(0.6, 0.8, 0.0), none),
    };
    for (size_t i = 0; i < sizeof coincident / sizeof *coincident; i++) {
        const int refusal = refusal_of(&coincident[i]);
        IS(refusal != KR_KOWALEWSKI_PLANNED && kr_kowalewski_refusal_text(refusal));
    }
    IS(!kr_kowalewski_refusal_text(-1) && !kr_kowalewski_refusal_text(KR_KOWALEWSKI_REFUSAL_COUNT));
}

int main(void)
{
    memory = malloc(kr_kowalewski_size());
    truths_by_heyoka_are_met();
    integrals_are_constant();
    edges_are_met_or_refused();
    degenerate_motions_are_refused_by_name();
    free(memory);
    return check_result();
}
