/* Attributes of methods, and checks whether a method applies to a body or scene. */
#include "method.h"
#include "model/scene.h"

kr_method_info kr_method_describe(const kr_method *m)
{
    return (kr_method_info){
        m->name,      m->text,  m->conserves,
        m->reference, m->order, m->flags | (m->at ? (unsigned)KR_METHOD_DENSE : 0),
    };
}

int kr_method_applies(const kr_method *method, const kr_body *body)
{
    if (!method || !method->reset || kr_body_check(body) != KR_OK) return 0;
    const unsigned flags = method->flags;
    const kr_kind kind = kr_body_kind(body, KR_KIND_RTOL);
    if (kr_body_has_rotor(body) && !(flags & KR_METHOD_ROTORS)) return 0;
    if (method->applies) return method->applies(body, kind);
    const kr_vec3 moments = kr_body_working(body).inertia;
    const int symmetric = fabs(moments.x - moments.y) <= KR_KIND_RTOL * moments.x;
    if (flags & KR_METHOD_LAGRANGE_ONLY)
        return kind == KR_KIND_LAGRANGE || (kind == KR_KIND_EULER && symmetric);
    /* The drift of these methods must be exact, so the rotor must be along the symmetry axis. */
    if (flags & KR_METHOD_SYMMETRIC_ONLY)
        return symmetric && kr_body_is_rotor_axial(body, KR_KIND_RTOL);
    return !(flags & KR_METHOD_EULER_ONLY) || kind == KR_KIND_EULER;
}
kr_status kr_refusal_by_method(const kr_method *method, const kr_scene *scene)
{
    const unsigned flags = method->flags;
    if (v_largest(scene->damping) > 0.0 && !(flags & KR_METHOD_DAMPED)) return KR_ERR_DAMPING;
    if (scene->friction > 0.0 && !(flags & KR_METHOD_FRICTION)) return KR_ERR_FRICTION;
    if (kr_support_shakes(scene) && !(flags & KR_METHOD_SHAKING)) return KR_ERR_SHAKING;
    if (scene->gradient != 0.0 && !(flags & KR_METHOD_GRADIENT)) return KR_ERR_GRADIENT;
    if (flags & KR_METHOD_FRICTION && !method->supports && kr_scene_has_support_terms(scene))
        return KR_ERR_NOT_BUILT;
    if (!kr_support_turns(scene) || flags & KR_METHOD_TURNING) return KR_OK;
    return kr_support_turns_about_vertical(scene) ? KR_OK : KR_ERR_TURNING;
}
int kr_method_suits(const kr_method *method, const kr_scene *scene)
{
    if (!method || !method->reset || kr_scene_check(scene) != KR_OK) return 0;
    if (kr_refusal_by_method(method, scene) != KR_OK) return 0;
    if (kr_body_has_rotor(&scene->body) && !(method->flags & KR_METHOD_ROTORS)) return 0;
    return method->suits ? method->suits(scene) : kr_method_applies(method, &scene->body);
}
