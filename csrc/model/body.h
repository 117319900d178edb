/* Working axes of a body: the principal axes in the order that the integration methods require. */
#ifndef KR_BODY_H
#define KR_BODY_H
#include "math/su2.h"

static inline double component_at(kr_vec3 v, int i) { return i == 0 ? v.x : i == 1 ? v.y : v.z; }
typedef struct kr_working {
    /* The rotation from working to principal axes. T is the axis of the moment that differs from
     * the other two. For a spherical body, T passes through the centre of mass or along the rotor.
     * If all moments differ, B is the axis of the intermediate one. */
    kr_quat axes;
    kr_vec3 inertia, com, damping, rotor;
    int tilted; /* nonzero: T of a spherical body has been rotated */
} kr_working;
/* Return the working axes, and the inertia, centre of mass, damping and rotor along them. A
 * spherical body with unequal components of `damping` keeps its principal axes, because the matrix
 * of damping is diagonal only in the principal axes. */
kr_working kr_body_working_damped(const kr_body *body, kr_vec3 damping);
kr_working kr_body_working(const kr_body *body);
/* Returns KR_OK if the body is valid, else KR_ERR_ARGUMENT or KR_ERR_BODY. */
kr_status kr_body_check(const kr_body *body);
/* Returns the index of the principal axis that becomes the third working axis. For a spherical
 * body, this is the axis nearest to the centre of mass. */
int kr_body_last_axis(const kr_body *body);
/* Returns the principal axes N, B, T as working axes. */
kr_working kr_body_principal(const kr_body *body, kr_vec3 damping);
static inline int kr_body_has_rotor(const kr_body *body) { return v_largest(body->rotor) > 0.0; }
/* Returns 1 if the body has no rotor, or is symmetric about the rotor. The rotor of a spherical
 * body must be parallel to the vector `com`, unless `com` is zero. */
int kr_body_is_rotor_axial(const kr_body *body, double rtol);
/* Returns the unit vector to the centre of mass along the principal axes, or T if the centre of
 * mass is at the fixed point. */
static inline kr_vec3 kr_body_apex(const kr_body *body)
{
    return v_largest(body->com) > 0.0 ? v_unit(body->com) : v3(0.0, 0.0, 1.0);
}
#endif
