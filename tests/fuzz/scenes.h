/* Random scenes of all kinds and nearly so, at rest, near unstable motions, in units of any size,
 * and some with an invalid number. */
#ifndef KR_SCENES_H
#define KR_SCENES_H
#include "kreisel.h"

kr_scene any_scene(void);
/* Returns another damping along each axis: zero, hardly any, or far above all rates. */
kr_vec3 any_damping(const kr_scene *scene);
/* Returns the time in which the top turns by about one radian or is slowed down; 1 if there is
 * none. */
double time_scale(const kr_scene *scene);
#endif
