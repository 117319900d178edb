/* Claims: see claims.h. */
#include "claims.h"
#include <math.h>
#include <string.h>

enum { MARK = 0xa5 };

enum error_kind error_category(kr_status status)
{
    static const enum error_kind of[] = {
#define X(name, what, text) what,
        KR_STATUS_LIST(X)
#undef X
    };
    CLAIM((int)status >= 0 && status < KR_STATUS_COUNT);
    CLAIM(kr_status_text(status) != NULL);
    return of[status];
}
int same_bits(const void *one, const void *other, size_t size)
{
    return memcmp(one, other, size) == 0;
}
void fill_with_mark(void *memory, size_t size) { memset(memory, MARK, size); }
int is_marked(const void *memory, size_t size)
{
    const unsigned char *bytes = memory;
    for (size_t i = 0; i < size; i++)
        if (bytes[i] != MARK) return 0;
    return 1;
}
int is_good(kr_state s)
{
    const double length = s.q.w * s.q.w + s.q.x * s.q.x + s.q.y * s.q.y + s.q.z * s.q.z;
    return isfinite(s.t) && isfinite(s.m.x) && isfinite(s.m.y) && isfinite(s.m.z) &&
           fabs(sqrt(length) - 1.0) <= 1e-12;
}
void tell_scene(const kr_scene *scene)
{
    const kr_body *b = &scene->body;
    const kr_state *s = &scene->start;
    print_detail("body %a, {%a, %a, %a}, {%a, %a, %a}, {%a, %a, %a, %a}", b->mass, b->inertia.x,
                 b->inertia.y, b->inertia.z, b->com.x, b->com.y, b->com.z, b->axes.w, b->axes.x,
                 b->axes.y, b->axes.z);
    print_detail("rotor %a, %a, %a", b->rotor.x, b->rotor.y, b->rotor.z);
    print_detail("damping %a, %a, %a", scene->damping.x, scene->damping.y, scene->damping.z);
    print_detail("turning %a, %a, %a, shaking %a, %a, %a, friction %a", scene->turning.x,
                 scene->turning.y, scene->turning.z, scene->shaking.amplitude, scene->shaking.rate,
                 scene->shaking.phase, scene->friction);
    print_detail("gravity %a, start %a, {%a, %a, %a, %a}, {%a, %a, %a}", scene->gravity, s->t,
                 s->q.w, s->q.x, s->q.y, s->q.z, s->m.x, s->m.y, s->m.z);
}
