/* The closed form of a scene, and one state of it at a time. This file is compiled once per
 * instruction set, because products in double-double are three times as fast where a fused product
 * gives what the rounded one leaves out. */
#include "dispatch.h"
#include "euler.h"
#include "lagrange.h"
#include "from_scene.h"

/* Sets the closed form up for a user's scene. Where `own` is not 0, it stays in working axes and
 * own units and begins at time 0, as the method `exact` wants it. */
static kr_status set_up(const kr_scene *scene, int own, kr_exact *exact)
{
    exact_top top;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_kind kind =
        scene->gravity == 0.0 ? KR_EULER : kr_body_kind(&scene->body, KR_KIND_RTOL);
    if (kind != KR_EULER && kind != KR_LAGRANGE) return KR_ERR_METHOD;
    if (v_largest(scene->damping) > 0.0) return KR_ERR_METHOD;
    status = read_top(scene, kind, &top);
    if (status != KR_OK) return status;
    *exact = top.lever.hi == 0.0 ? euler_closed_form(&top) : lagrange_closed_form(&top);
    if (!own) to_user(exact, &top, scene->start.t, top.units.time);
    return KR_OK;
}
const kr_exact_one KR_NAME(kr_exact_one) = {set_up, state_at};
