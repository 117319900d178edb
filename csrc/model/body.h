/* The axes that methods work in. */
#ifndef KR_BODY_H
#define KR_BODY_H
#include "math/su2.h"

typedef struct kr_working {
    /* Working -> principal axes. T lies along the odd axis of a symmetric body, along the centre of
     * mass of a spherical one; else B lies along the axis of the middle moment. */
    kr_quat axes;
    kr_vec3 inertia, com, damping;
    int tilted; /* the body is spherical: its axes follow the centre of mass, and are rounded */
} kr_working;
/* Carries all data along the principal axes of `body` into working axes. The axes of a spherical
 * body with unequal `damping` stay principal, because damping is diagonal along these alone. */
kr_working kr_body_working_damped(const kr_body *body, kr_vec3 damping);
/* Returns the working axes of a body without damping. */
kr_working kr_body_working(const kr_body *body);
/* Returns the number of the principal axis along which T lies; of a spherical body, of the one
 * nearest its centre of mass. */
int kr_body_last_axis(const kr_body *body);
/* Returns the principal axes as working axes. */
kr_working kr_body_principal(const kr_body *body, kr_vec3 damping);
#endif
