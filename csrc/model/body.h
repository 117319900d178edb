/* The axes that methods work in. */
#ifndef KR_BODY_H
#define KR_BODY_H
#include "numbers/su2.h"

typedef struct kr_working {
    /* Working -> principal axes. T lies along the odd axis of a symmetric body, along the centre of
     * mass of a spherical one; else B lies along the axis of the middle moment. */
    kr_quat axes;
    kr_vec3 inertia, com;
    int tilted; /* the body is spherical: its axes follow the centre of mass, and are rounded */
} kr_working;
kr_working kr_body_working(const kr_body *body);
#endif
