/* The closed form of a scene, one state of it at a time, and its turning points. This file is
 * compiled once per instruction set, because products in double-double are three times as fast
 * where a fused product gives what the rounded one leaves out. */
#include "dispatch.h"
#include "euler.h"
#include "turning.h"
#include "from_scene.h"

/* Returns the closed form of a Lagrange top, in its own units. */
static kr_exact lagrange_closed_form(const exact_top *top)
{
    const int below = top->lever.hi < 0.0;
    const exact_top seen = below ? seen_from_below(top) : *top;
    const dd i1 = equal_moment(&seen);
    const initial s = initial_of(&seen, i1);
    const dd half_spin = half_spin_of(&seen, &s, i1);
    kr_exact exact = {0};
    if (stands(&s)) {
        const dd half = dd_half(s.w[2]);
        exact.constant.z = seen.m.z;
        exact.side = 1.0;
        steady_closed_form(&exact, rounded(seen.q), dd_add(half, half_spin),
                           dd_sub(half, half_spin));
    } else
        lagrange_moving(&exact, &seen, &s, i1, half_spin);
    if (below) {
        turn_over(&exact);
        fill_frame_below(exact.frame);
        exact.framed = 1;
    }
    return exact;
}
/* Sets the closed form up for a user's scene. Where `own` is not 0, it stays in working axes and
 * own units and begins at time 0, as the method `exact` wants it. */
static kr_status set_up(const kr_scene *scene, int own, kr_exact *exact)
{
    described_top top;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_kind kind =
        scene->gravity == 0.0 ? KR_EULER : kr_body_kind(&scene->body, KR_KIND_RTOL);
    if (kind != KR_EULER && kind != KR_LAGRANGE) return KR_ERR_METHOD;
    if (v_largest(scene->damping) > 0.0 || !kr_exact_resolves(scene)) return KR_ERR_METHOD;
    status = read_top(scene, kind, &top);
    if (status != KR_OK) return status;
    kr_exact made = top.own.lever.hi == 0.0 ? euler_closed_form(&top.own)
                                            : lagrange_closed_form(&top.own);
    if (!own) to_frame_and_units(&made, &top, scene->start.t, top.units.time);
    /* A moment beyond all others may make a rate beyond all numbers. */
    if (!isfinite(made.nutation.fast + made.first.fast + made.second.fast)) return KR_ERR_ARGUMENT;
    *exact = made;
    return KR_OK;
}
/* Says whether the turning points are those of a symmetric body whose apex is its axis. */
static int turns_about_apex(const kr_body *body, kr_kind kind)
{
    const kr_vec3 i = body->inertia;
    return kind == KR_LAGRANGE ||
           (kind == KR_EULER && fabs(i.x - i.y) <= KR_KIND_RTOL * fmax(i.x, i.y));
}
static kr_status find_turning(const kr_scene *scene, kr_turning *out)
{
    described_top top;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_kind kind = kr_body_kind(&scene->body, KR_KIND_RTOL);
    if (!turns_about_apex(&scene->body, kind) || v_largest(scene->damping) > 0.0)
        return KR_ERR_METHOD;
    status = read_top(scene, kind, &top);
    if (status != KR_OK) return status;
    const int below = top.own.lever.hi < 0.0, behind = kr_body_working(&scene->body).com.z < 0.0;
    if (below) top.own = seen_from_below(&top.own);
    kr_turning r = turning_downwards(&top.own);
    if (below != behind) turning_over(&r);
    turning_to_user(&r, &top.units, scene->start.t);
    *out = r;
    return KR_OK;
}
const kr_exact_one KR_NAME(kr_exact_one) = {set_up, state_at, find_turning};
