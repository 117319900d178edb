/* The units of its own in which a top is moved: powers of two, so that results scale bit for bit
 * with powers of two of mass, length and time. */
#ifndef KR_SCENE_H
#define KR_SCENE_H
#include "body.h"

/* In these units the largest moment and the top's rate are about one. */
typedef struct kr_units {
    double moment, time; /* [M L^2], [T] */
    kr_vec3 lever;       /* mass gravity com in these units, along working axes */
} kr_units;
/* mass gravity com with its size apart, for the products of these may be beyond all doubles:
 * mass gravity com 2^power. */
typedef struct kr_pull {
    double mass, gravity;
    kr_vec3 com;
    int power;
} kr_pull;
kr_pull kr_scene_pull(const kr_scene *scene, kr_vec3 com);

/* Says of all but the body what kr_scene_check says. */
kr_status kr_scene_check_start(const kr_scene *scene);

kr_status kr_scene_units(const kr_scene *scene, const kr_working *working, kr_units *units);
/* Gives kr_scene_horizon where these are known. */
double kr_units_horizon(const kr_units *units, const kr_scene *scene, const kr_working *working);
#endif
