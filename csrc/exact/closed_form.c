/* Plans, and one state of them at a time. Compiled once per instruction set, as states.c; products
 * in double-double are three times as fast where a fused one gives what the rounded one leaves
 * out. */
#include "dispatch.h"
#include "euler.h"
#include "lagrange.h"
#include "from_scene.h"

static kr_status plan_of(const kr_scene *scene, int own, kr_exact *plan)
{
    exact_top top;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_kind kind =
        scene->gravity == 0.0 ? KR_EULER : kr_body_kind(&scene->body, KR_KIND_RTOL);
    if (kind != KR_EULER && kind != KR_LAGRANGE) return KR_ERR_METHOD;
    status = read_top(scene, kind, &top);
    if (status != KR_OK) return status;
    *plan = top.lever.hi == 0.0 ? euler_plan(&top) : lagrange_plan(&top);
    if (!own) to_user(plan, &top, scene->start.t, top.units.time);
    return KR_OK;
}
const kr_exact_one KR_NAME(kr_exact_one) = {plan_of, state_at};
