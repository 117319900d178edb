/* Calls of the closed forms: the states of all kinds of tops, and turning points. */
#include <math.h>
#include <string.h>
#include "calls.h"
#include "random_values.h"
#include "claims.h"
#include "math/su2.h"
#include "model/quantities.h"
#include "scenes.h"

enum { MOST_MEMORY = 1 << 23, BEYOND = 1000 };
static double memory[MOST_MEMORY / sizeof(double)], other_memory[MOST_MEMORY / sizeof(double)];
/* A plan in `memory`, and its numbers. */
typedef struct plan {
    kr_scene scene;
    double bound;
    kr_exact_info info;
} plan;

/* Returns a scene whose top is often a Kowalewski or a Goryachev-Chaplygin top. */
static kr_scene closed_scene(void)
{
    const int is_kowalewski = (int)choose(2);
    const double lone = is_kowalewski ? 0.5 : 0.25, turn = odds(50) ? 0.0 : between(-3.2, 3.2);
    kr_scene scene = any_scene();
    kr_body *body = &scene.body;
    const double moment = v_largest(body->inertia), lever = v_largest(body->com);
    if (odds(30)) return scene;
    body->inertia = v3(moment, moment, lone * moment);
    body->com = v3(lever * cos(turn), lever * sin(turn), 0.0);
    if (odds(95)) body->rotor = scene.damping = scene.turning = v3(0, 0, 0);
    if (odds(95)) scene.shaking.amplitude = scene.friction = 0.0;
    if (!is_kowalewski && odds(95)) scene.start.m.z = 0.0;
    return scene;
}
static kr_exact *in(double *place) { return (kr_exact *)(void *)place; }
static kr_status make_plan(plan *p)
{
    const size_t size = kr_exact_size(&p->scene);
    CLAIM(size + BEYOND <= sizeof memory);
    fill_with_mark((char *)memory + size, BEYOND);
    const kr_status status = kr_exact_plan(&p->scene, p->bound, in(memory));
    CLAIM(is_marked((char *)memory + size, BEYOND));
    if (isnan(p->bound) || p->bound < 0.0) return status;
    p->info = kr_exact_describe(in(memory));
    return status;
}
/* Claims that a state has the energy of the start, unless doubles do not resolve the energy. */
static void claim_energy(const plan *p, kr_state s)
{
    const kr_scene *scene = &p->scene;
    const double energy = kr_state_energy(scene, &scene->start), rest = kr_state_energy(scene, &s),
                 size = kr_state_kinetic(scene, &scene->start) +
                        fabs(scene->body.mass * scene->gravity) * v_length(scene->body.com);
    print_detail("energy %a, then %a", energy, rest);
    if (size > 1e-290 && size < 1e290) CLAIM(fabs(rest - energy) <= 1e-9 * size);
}
/* Claims that every state is valid, and bitwise equal whether it is computed alone, with others, or
 * from a copy of the plan. */
static void check_states(const plan *p)
{
    enum { MANY = 11 };
    double t[MANY];
    kr_state out[MANY];
    const size_t n = (size_t)choose(MANY + 1);
    const double pace = time_scale(&p->scene), start = p->scene.start.t;
    for (size_t i = 0; i < n; i++) {
        t[i] = start + either_sign(pace * spread(1e-6, 1e6));
        t[i] = maybe_arbitrary(odds(10) ? start : t[i], 5);
    }
    fill_with_mark(out, sizeof out);
    print_call("%zu states of it, at %a ...", n, n ? t[0] : 0.0);
    kr_exact_states(in(memory), n, t, out);
    CLAIM(is_marked(out + n, (MANY - n) * sizeof *out));
    memcpy(other_memory, memory, p->info.used);
    for (size_t i = 0; i < n; i++) {
        const kr_state s = kr_exact_state(in(memory), t[i]),
                       copied = kr_exact_state(in(other_memory), t[i]);
        print_detail("at %a", t[i]);
        CLAIM(isnan(t[i]) ? isnan(s.t) : s.t == t[i]);
        CLAIM(is_good(s) || (isnan(s.q.w) && isnan(s.m.z)));
        CLAIM(isfinite(t[i]) || isnan(s.q.w));
        CLAIM(isnan(s.q.w) ? isnan(copied.q.w) && isnan(out[i].q.w)
                           : same_bits(&s, &copied, sizeof s) && same_bits(&s, &out[i], sizeof s));
        if (is_good(s) && p->info.certificate > 0.0) claim_energy(p, s);
        if (fabs(t[i]) + fabs(start) < 0x1p40 * pace) CLAIM(is_good(s));
    }
}
/* Claims that two angles on the torus give a state of the same energy. */
static void check_angles(const plan *p)
{
    const double first = maybe_arbitrary(between(-2.0, 2.0), 5),
                 second = maybe_arbitrary(between(-2.0, 2.0), 5);
    print_call("its state at the angles %a, %a", first, second);
    const kr_state s = kr_exact_state_at(in(memory), first, second);
    if (p->info.kind < KR_KIND_KOWALEWSKI) {
        CLAIM(isnan(s.q.w));
        return;
    }
    CLAIM(s.t == p->scene.start.t);
    CLAIM(is_good(s) || !isfinite(first) || !isfinite(second));
    if (is_good(s)) claim_energy(p, s);
}
static void call_turning(const kr_scene *scene)
{
    kr_nutation turning;
    fill_with_mark(&turning, sizeof turning);
    print_call("find the turning points");
    const kr_status status = kr_exact_nutation(scene, &turning);
    const enum error_kind wrong = error_category(status);
    CLAIM(wrong == NONE || wrong == INPUT);
    CLAIM(status == KR_OK || is_marked(&turning, sizeof turning));
    if (status != KR_OK) return;
    CLAIM(kr_scene_check(scene) == KR_OK && turning.motion_type != NULL);
    CLAIM(turning.least >= 0.0 && turning.least <= turning.greatest && turning.greatest <= 3.1416);
    CLAIM(turning.t_least >= scene->start.t && turning.t_greatest >= scene->start.t);
}
void call_closed_forms(void)
{
    plan p = {.bound = odds(70) ? 0.0 : maybe_arbitrary(spread(1e-16, 1e-6), 10)};
    p.scene = closed_scene();
    tell_scene(&p.scene);
    call_turning(&p.scene);
    print_call("plan the closed form, bound %a", p.bound);
    const kr_status status = make_plan(&p);
    const enum error_kind wrong = error_category(status);
    CLAIM(wrong == NONE || wrong == INPUT);
    if (status == KR_ERR_METHOD)
        CLAIM(p.info.refusal != KR_REFUSAL_NONE && kr_refusal_text(p.info.refusal));
    if (status != KR_OK) return;
    CLAIM(kr_scene_check(&p.scene) == KR_OK && p.info.refusal == KR_REFUSAL_NONE);
    CLAIM(!(p.info.period <= 0.0) &&
          p.info.certificate <= (p.bound > 0.0 ? p.bound : KR_EXACT_BOUND));
    const kr_state start = kr_exact_state(in(memory), p.scene.start.t);
    if (fabs(p.scene.start.t) < 0x1p40 * time_scale(&p.scene))
        CLAIM(kr_attitude_error(start.q, p.scene.start.q) <= 1e-7);
    check_states(&p);
    check_angles(&p);
}
