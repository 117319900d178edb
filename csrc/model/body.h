/* Working axes of a body, in which methods work. */
#ifndef KR_BODY_H
#define KR_BODY_H
#include "math/su2.h"

typedef struct kr_working {
    /* Working -> principal axes. T lies along the odd axis of a symmetric body, along the centre of
     * mass of a spherical one; else B lies along the axis of the middle moment. */
    kr_quat axes;
    kr_vec3 inertia, com, damping;
    int tilted; /* the body is spherical, and its axes follow the centre of mass, rounded */
} kr_working;
/* Returns working axes, and all data of `body` along them. A spherical body with unequal `damping`
 * keeps its principal axes, because damping is diagonal along these alone. */
kr_working kr_body_working_damped(const kr_body *body, kr_vec3 damping);
/* Returns the working axes of a body without damping. */
kr_working kr_body_working(const kr_body *body);
/* Returns the index of the principal axis that becomes T. Of a spherical body, this is the axis
 * nearest its centre of mass. */
int kr_body_last_axis(const kr_body *body);
/* Returns the principal axes as working axes. */
kr_working kr_body_principal(const kr_body *body, kr_vec3 damping);
#endif
