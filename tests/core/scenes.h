/* The scenes whose results are printed: one on each side of what the library tells apart. */
#ifndef KR_SCENES_H
#define KR_SCENES_H
#include "say.h"

enum { SCENES = 12 };

static inline kr_scene scene_of(double a, double b, double c, kr_vec3 com, kr_vec3 m)
{
    kr_scene s = kr_scene_default();
    const double tensor[9] = {a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c};
    must(kr_body_from_tensor(1.5, tensor, com, &s.body) == KR_OK, "no body");
    s.gravity = 2.0;
    s.start.q = (kr_quat){0.8, 0.36, -0.48, 0.0};
    s.start.m = m;
    return s;
}
static inline kr_scene scene_at(int which, const char **name)
{
    static const char *const names[SCENES - 4] = {"kowalewski", "chaplygin", "free",  "round",
                                                  "damped",     "small",     "spins", "pendulum"};
    const kr_vec3 across = {0.5, 0.0, 0.0}, along = {0.0, 0.0, 0.75}, none = {0.0, 0.0, 0.0};
    const kr_vec3 m = {0.5, -0.25, 2.0}, slow = {0.25, 0.125, -0.5}, tiny = {5e-5, 2e-5, -3e-5};
    *name = which < 4 ? golden_names[which] : names[which - 4];
    kr_scene s = which < 4 ? golden_scene(which) : kr_scene_default();
    if (which == 4) s = scene_of(2.0, 2.0, 1.0, across, m);
    if (which == 5) s = scene_of(4.0, 4.0, 1.0, across, slow);
    if (which == 6) s = scene_of(1.0, 2.0, 2.5, none, m);
    if (which == 7) s = scene_of(2.0, 2.0, 2.0, (kr_vec3){0.25, -0.5, 0.75}, slow);
    if (which == 8) s = scene_of(1.5, 2.0, 3.0, across, m);
    if (which == 8) s.damping = (kr_vec3){0.125, 0.25, 0.0625};
    if (which == 9) s = scene_of(1.5e-9, 2e-9, 3e-9, along, tiny);
    if (which == 10) s = scene_of(2.0, 2.0, 1.0, along, (kr_vec3){3.0, -20.0, 40.0});
    if (which == 10) s.gravity = 1.0;
    if (which == 11) s = scene_of(2.0, 2.0, 1.0, along, none);
    return s;
}
/* About the time in which a top turns by a radian. */
static inline double unit_of(const kr_scene *s) { return sqrt(s->body.inertia.y / 2.0); }
#endif
