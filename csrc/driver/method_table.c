/* The table of methods, built from methods.def, and a check whether a method accepts a body. */
#include "method.h"
#include "exact/dispatch.h"
#include "exact/goryachev_chaplygin.h"
#include "model/body.h"

#define X(id) extern const kr_method kr_method_##id;
#include "methods.def"
#undef X
static const kr_method *const method_table[] = {
#define X(id) &kr_method_##id,
#include "methods.def"
#undef X
};
size_t kr_method_count(void) { return sizeof method_table / sizeof *method_table; }
const kr_method *kr_method_at(size_t i) { return i < kr_method_count() ? method_table[i] : NULL; }
const kr_method *kr_method_find(const char *name)
{
    for (size_t i = 0; name && i < kr_method_count(); i++)
        if (strcmp(method_table[i]->name, name) == 0) return method_table[i];
    return NULL;
}
const char *kr_method_name(const kr_method *method) { return method->name; }
const char *kr_method_text(const kr_method *method) { return method->text; }
const char *kr_method_conserves(const kr_method *method) { return method->conserves; }
const char *kr_method_reference(const kr_method *method) { return method->reference; }
int kr_method_order(const kr_method *method) { return method->order; }
unsigned kr_method_flags(const kr_method *method)
{
    return method->flags | (method->at ? KR_METHOD_DENSE : 0);
}

int kr_method_applies(const kr_method *method, const kr_body *body)
{
    if (!method || kr_body_check(body) != KR_OK) return 0;
    const unsigned flags = method->flags;
    const kr_kind kind = kr_body_kind(body, KR_KIND_RTOL);
    const kr_vec3 moments = kr_body_working(body).inertia;
    const int symmetric = fabs(moments.x - moments.y) <= KR_KIND_RTOL * moments.x;
    if (flags & KR_METHOD_LAGRANGE_ONLY)
        return kind == KR_KIND_LAGRANGE || (kind == KR_KIND_EULER && symmetric);
    if (flags & KR_METHOD_INTEGRABLE)
        return kind == KR_KIND_LAGRANGE || kind == KR_KIND_EULER ||
               /* The size is 0 in builds without this closed form. */
               (kind == KR_KIND_KOWALEWSKI && kr_kowalewski_size() > 0) ||
               (kind == KR_KIND_GORYACHEV_CHAPLYGIN && kr_goryachev_chaplygin_size() > 0);
    if (flags & KR_METHOD_SYMMETRIC_ONLY) return symmetric;
    return !(flags & KR_METHOD_EULER_ONLY) || kind == KR_KIND_EULER;
}
int kr_method_suits(const kr_method *method, const kr_scene *scene)
{
    if (!method || kr_scene_check(scene) != KR_OK) return 0;
    if (v_largest(scene->damping) > 0.0 && !(method->flags & KR_METHOD_DAMPED)) return 0;
    if (method->flags & KR_METHOD_INTEGRABLE) {
        if (scene->gravity != 0.0 && !kr_method_applies(method, &scene->body)) return 0;
        const kr_kind torus = kr_exact_torus(scene);
        return torus == KR_KIND_GENERAL
                   ? kr_exact_resolves(scene)
                   : torus == KR_KIND_KOWALEWSKI || kr_chaplygin_is_level(scene);
    }
    return kr_method_applies(method, &scene->body);
}
