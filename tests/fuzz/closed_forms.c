/* Calls of the closed forms: of the motion, and of the Bobenko-Suris map. */
#include <math.h>
#include "calls.h"
#include "random_values.h"
#include "claims.h"
#include "math/su2.h"
#include "scenes.h"

static int same(kr_state one, kr_state other) { return same_bits(&one, &other, sizeof one); }
static int is_nan(kr_state s)
{
    return isnan(s.q.w) && isnan(s.q.x) && isnan(s.q.y) && isnan(s.q.z) && isnan(s.m.x) &&
           isnan(s.m.y) && isnan(s.m.z);
}
/* Claims that every state is valid, and bitwise equal whether it is computed alone or with
 * others. */
static void check_states(const kr_scene *scene, const kr_exact *exact)
{
    enum { MANY = 11 };
    double t[MANY];
    kr_state out[MANY];
    const size_t n = (size_t)choose(MANY + 1);
    const double pace = time_scale(scene), horizon = kr_scene_horizon(scene);
    for (size_t i = 0; i < n; i++) {
        t[i] = scene->start.t + either_sign(pace * spread(1e-6, 1e6));
        t[i] = maybe_arbitrary(odds(10) ? scene->start.t : t[i], 5);
    }
    fill_with_mark(out, sizeof out);
    print_call("%zu states of it, at %a ...", n, n ? t[0] : 0.0);
    kr_exact_states(exact, n, t, out);
    CLAIM(is_marked(out + n, (MANY - n) * sizeof *out));
    for (size_t i = 0; i < n; i++) {
        const kr_state s = kr_exact_state(exact, t[i]);
        print_detail("at %a", t[i]);
        CLAIM(isnan(t[i]) ? isnan(s.t) : s.t == t[i]);
        CLAIM(isfinite(t[i]) || is_nan(s));
        CLAIM(fabs(t[i]) < horizon || is_nan(s) || is_good(s));
        CLAIM(fabs(t[i]) >= horizon || is_nan(s) || is_good(s));
        CLAIM(is_nan(s) ? is_nan(out[i]) : same(s, out[i]));
        /* There is a state at every time at which doubles resolve the motion. */
        if (fabs(t[i]) + fabs(scene->start.t) < 0x1p40 * pace) CLAIM(is_good(s));
    }
}
static void call_exact(const kr_scene *scene)
{
    static double memory[1 << 20];
    kr_exact *exact = (kr_exact *)(void *)memory;
    CLAIM(kr_exact_size(scene) <= sizeof memory);
    print_call("plan the closed form");
    const kr_status status = kr_exact_plan(scene, 0.0, exact);
    const enum error_kind wrong = error_category(status);
    CLAIM(wrong == NONE || wrong == INPUT);
    if (status != KR_OK) return;
    CLAIM(kr_scene_check(scene) == KR_OK);
    CLAIM(kr_exact_describe(exact).period > 0.0);
    const kr_state start = kr_exact_state(exact, scene->start.t);
    if (fabs(scene->start.t) < 0x1p40 * time_scale(scene))
        CLAIM(kr_attitude_error(start.q, scene->start.q) <= 1e-7);
    check_states(scene, exact);
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
    const kr_scene scene = any_scene();
    tell_scene(&scene);
    call_exact(&scene);
    call_turning(&scene);
}
