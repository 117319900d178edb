/* What the driver asks of a body. Floor 1. */
#ifndef KR_BODY_H
#define KR_BODY_H
#include "su2.h"

typedef struct kr_working {     /* the axes that methods work in */
    kr_quat axes;               /* working -> principal: T lies along the odd axis of a symmetric body, along the centre of
                                 * mass of a spherical one; else B along the axis of the middle moment */
    kr_vec3 inertia, com;
} kr_working;
kr_working kr_body_working(const kr_body *body);
#endif
