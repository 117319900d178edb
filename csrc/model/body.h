/* Working axes of a body: the principal axes in the order that the integration methods require. If
 * all moments differ, the second is the axis of the middle one; if one differs, the third is its
 * axis; if all are equal, the third is along kr_body.com or kr_body.rotor, unless both are 0. */
#ifndef KR_BODY_H
#define KR_BODY_H
#include "math/su2.h"

static inline double component_at(kr_vec3 v, int i) { return i == 0 ? v.x : i == 1 ? v.y : v.z; }
typedef struct kr_working {
    kr_quat axes; /* the rotation from working to principal axes */
    kr_vec3 inertia, com, damping, rotor;
    int tilted; /* 1: the body is spherical, and its third axis is along com or the rotor */
} kr_working;
/* Return the working axes of a body, and its inertia, centre of mass, damping and rotor along these
 * axes; kr_body_working is for zero damping. A spherical body with unequal components of `damping`
 * keeps its principal axes, because the damping matrix is diagonal only along these. */
kr_working kr_body_working_damped(const kr_body *body, kr_vec3 damping);
kr_working kr_body_working(const kr_body *body);
/* Returns KR_OK if the body is valid, else KR_ERR_ARGUMENT or KR_ERR_BODY. */
kr_status kr_body_check(const kr_body *body);
/* Returns the index of the principal axis that becomes the third working axis (if not tilted). */
int kr_body_last_axis(const kr_body *body);
/* Returns the principal axes in their given order as working axes. */
kr_working kr_body_principal(const kr_body *body, kr_vec3 damping);
static inline int kr_body_has_rotor(const kr_body *body) { return v_largest(body->rotor) > 0.0; }
/* Returns 1 if the body has no rotor, or is symmetric about the rotor up to the relative tolerance
 * rtol. If the body is spherical, returns 1 if com = 0, or if rotor and com are parallel. */
int kr_body_is_rotor_axial(const kr_body *body, double rtol);
/* Returns the apex as components along the principal axes: the unit vector from the fixed point to
 * the centre of mass, or the third axis (0, 0, 1) if these points coincide. */
static inline kr_vec3 kr_body_apex(const kr_body *body)
{
    return v_largest(body->com) > 0.0 ? v_unit(body->com) : v3(0.0, 0.0, 1.0);
}
#endif
