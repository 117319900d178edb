/* Random scenes: of every kind or nearly so, at rest, near unstable motions, in units of any size,
 * and some with an invalid number. */
#ifndef KR_SCENES_H
#define KR_SCENES_H
#include "kreisel.h"

kr_scene any_scene(void);
/* Returns a damping, mostly with different values along the axes. Each value is zero or of any
 * strength, from very weak to far above all rates. */
kr_vec3 any_damping(const kr_scene *scene);
/* Returns the time in which the top or its support moves by about one radian or damping slows the
 * top, or 1 if there is no such time. */
double time_scale(const kr_scene *scene);
#endif
