/* Scenes of all sorts: of every kind and nearly so, at rest, near the motions that are not stable,
 * in units of any size, and some with a number that no scene has. */
#ifndef KR_SCENES_H
#define KR_SCENES_H
#include "kreisel.h"

kr_scene any_scene(void);
/* Another damping along each axis, some zero, from hardly any to far above all rates. */
kr_vec3 any_damping(const kr_scene *scene);
/* A time in which such a top turns by about one radian, or is slowed down; 1 if there is none. */
double pace_of(const kr_scene *scene);
#endif
