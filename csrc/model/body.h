/* What the driver asks of a body. */
#ifndef KR_BODY_H
#define KR_BODY_H
#include "numbers/su2.h"

typedef struct kr_working { /* the axes that methods work in */
    kr_quat
        axes; /* working -> principal: T lies along the odd axis of a symmetric body, along the centre of
                                 * mass of a spherical one; else B along the axis of the middle moment */
    kr_vec3 inertia, com;
    int tilted; /* spherical: the axes follow the centre of mass, and are rounded */
} kr_working;
kr_working kr_body_working(const kr_body *body);

/* powers of two in which the largest moment and the top's rate are about one */
typedef struct kr_units {
    double moment, time; /* [M L^2], [T] */
    kr_vec3 lever;       /* mass gravity com / moment, in working axes [T^-2] */
} kr_units;
kr_status kr_scene_units(const kr_scene *scene, const kr_working *w, kr_units *units);
#endif
