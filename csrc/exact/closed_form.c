/* Set-up, states and turning points of the closed-form solution for a single top. This file is
 * compiled once for each instruction set, because double-double products are three times as fast
 * with fused multiply-add. */
#include "dispatch.h"
#include "euler.h"
#include "nutation.h"
#include "scaling.h"

/* Returns the closed-form solution for a Lagrange top, in internal units. `half_turn` is half the
 * rate that a rotor adds to the rotation about the symmetry axis. */
static kr_exact_form lagrange_closed_form(const exact_top *top, dd half_turn)
{
    const int below = top->lever.hi < 0.0;
    setting s;
    s.top = below ? seen_from_below(top) : *top;
    begin_setting(&s);
    if (half_turn.hi != 0.0) s.half_spin = dd_add(s.half_spin, half_turn);
    if (is_resting_at_pole(&s.start)) {
        const dd half = dd_half(s.start.w[2]);
        memset(&s.exact, 0, sizeof s.exact);
        s.exact.constant.z = s.top.m.z;
        s.exact.side = 1.0;
        steady_closed_form(&s.exact, rounded(s.top.q), dd_add(half, s.half_spin),
                           dd_sub(half, s.half_spin));
    } else
        lagrange_moving(&s, 1);
    if (below) {
        turn_over(&s.exact);
        fill_frame_below(s.exact.frame);
        s.exact.framed = 1.0;
    }
    return s.exact;
}
/* Computes the closed-form solution for a scene. If `own` is nonzero, the solution is expressed in
 * internal axes and units. */
static kr_status set_up(const kr_scene *scene, int own, double bound, void *memory,
                        kr_exact_info *info)
{
    (void)bound;
    described_top top;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_kind kind = kr_scene_kind(scene);
    if (kind != KR_KIND_EULER && kind != KR_KIND_LAGRANGE) return KR_ERR_METHOD;
    if (kr_scene_excludes_exact(scene, own) || !kr_exact_resolves(scene)) return KR_ERR_METHOD;
    status = read_top(scene, kind, &top);
    if (status != KR_OK) return status;
    const int is_free = top.own.lever.hi == 0.0;
    kr_exact_form made = is_free ? euler_closed_form(&top.own, top.half_turn)
                                 : lagrange_closed_form(&top.own, top.half_turn);
    if (!is_free && top.behind) made.spin_angle_rate = opposite_spin(made.spin_angle_rate);
    if (!own) to_frame_and_units(&made, &top, scene->start.t, top.units.time);
    /* For extreme moments of inertia, the rates of the phases may exceed the range of doubles. */
    if (!isfinite(made.nutation.fast + made.first.fast + made.second.fast)) return KR_ERR_ARGUMENT;
    memcpy(memory, &made, sizeof made);
    info->period = made.period;
    info->precession_rate = made.precession_rate;
    info->spin_angle_rate = made.spin_angle_rate;
    info->refusal = KR_REFUSAL_NONE;
    return KR_OK;
}
/* Returns 1 if the body, with its rotor, is symmetric about its apex: the direction of the centre
 * of mass, or T. */
static int turns_about_apex(const kr_body *body, kr_kind kind)
{
    const kr_vec3 i = body->inertia, h = body->rotor;
    const double across = fmax(fabs(h.x), fabs(h.y));
    if (kind == KR_KIND_EULER && across > KR_KIND_RTOL * v_largest(h)) return 0;
    return kind == KR_KIND_LAGRANGE ||
           (kind == KR_KIND_EULER && fabs(i.x - i.y) <= KR_KIND_RTOL * fmax(i.x, i.y));
}
kr_status KR_NAME(kr_exact_limits)(const kr_scene *scene, kr_nutation_form *out)
{
    described_top top;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_kind kind = kr_body_kind(&scene->body, KR_KIND_RTOL);
    if (!turns_about_apex(&scene->body, kind) || kr_scene_is_disturbed(scene)) return KR_ERR_METHOD;
    status = read_top(scene, kind, &top);
    if (status != KR_OK) return status;
    /* Beside a rotor, powers of a much smaller momentum would underflow. Such a momentum moves the
     * apex at no time that doubles resolve. */
    if (top.own.lever.hi == 0.0 && v_largest(top.own.m) < 1e-40) top.own.m = v3(0.0, 0.0, 0.0);
    const int below = top.own.lever.hi < 0.0;
    if (below) top.own = seen_from_below(&top.own);
    kr_nutation_form r = turning_downwards(&top.own, -2.0 * top.half_turn.hi);
    /* The apex points along the third internal axis or in the opposite direction. */
    r.critical_spin += (top.behind ? -2.0 : 2.0) * top.half_turn.hi;
    if (below != top.behind) flip_turning(&r);
    turning_to_user(&r, &top.units, scene->start.t);
    memcpy(out, &r, sizeof r);
    return KR_OK;
}
static kr_state state_of_plan(const void *plan, double t) { return state_at(plan, t); }
const kr_exact_scalar KR_NAME(kr_exact_scalar) = {sizeof(kr_exact_form), set_up, state_of_plan,
                                                  NULL};
