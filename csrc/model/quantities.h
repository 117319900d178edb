/* The table of physical quantities, and the components that event functions use (kreisel.h). */
#ifndef KR_QUANTITIES_H
#define KR_QUANTITIES_H
#include "kreisel.h"
#include "math/su2.h"

enum {
#define Q(name, doubles, flags, dimension, text) KR_QUANTITY_##name,
#include "quantities.def"
#undef Q
    KR_QUANTITIES,
    KR_QUANTITY_DOUBLES_MAX = 9, /* largest number of doubles of a quantity */
    KR_AXES = 16                 /* number of component indices reserved for each quantity */
};
extern const kr_quantity kr_quantities[KR_QUANTITIES];
/* The part of a kr_quantity that computations use, and a function that writes the values of this
 * quantity at n states. Programs that use no texts of quantities link only kr_quantity_rows. */
typedef struct kr_quantity_row {
    void (*values)(const kr_scene *scene, size_t n, const kr_state states[], double out[]);
    unsigned char doubles, flags;
    char dimension; /* the first letter of kr_quantity.dimension */
} kr_quantity_row;
extern const kr_quantity_row kr_quantity_rows[KR_QUANTITIES];
/* Returns the acceleration along -e3 at time t due to gravity and the shaking of the support. */
double kr_acceleration_at(const kr_scene *scene, double t);
/* Returns <P, r> P - r / 3, where P is the vertical and r a position relative to the fixed point.
 * In a gravity gradient k, the additional acceleration at r is k times this vector. */
static inline kr_vec3 kr_tidal_acceleration(kr_vec3 vertical, kr_vec3 position)
{
    return v_axpy(v_dot(vertical, position), vertical, v_scale(-1.0 / 3.0, position));
}
/* Returns the torque of the gravity gradient; torque and vertical are along the principal axes. */
static inline kr_vec3 kr_gradient_torque(const kr_scene *scene, kr_vec3 vertical)
{
    return v_scale(scene->gradient, v_cross(vertical, v_times(scene->body.inertia, vertical)));
}
/* Returns the torque of dry friction about the apex. Writes 1 to `holds` if friction keeps the spin
 * (angular velocity about the apex) at zero, else 0. M is the angular momentum, O the angular
 * velocity of the support, and `gain` the angular acceleration without friction, relative to the
 * support. All vectors are along the principal axes. */
double kr_friction_torque(const kr_scene *scene, kr_vec3 M, kr_vec3 O, kr_vec3 gain, int *holds);

/* For each quantity, a function kr_state_<name> returns its value at a state. The return type
 * depends on the number of components of the quantity; 9 components are written to `rows`. */
#define FUNCTION_1(name) double kr_state_##name(const kr_scene *scene, const kr_state *s);
#define FUNCTION_3(name) kr_vec3 kr_state_##name(const kr_scene *scene, const kr_state *s);
#define FUNCTION_4(name) kr_quat kr_state_##name(const kr_scene *scene, const kr_state *s);
#define FUNCTION_9(name)                                                                           \
    void kr_state_##name(const kr_scene *scene, const kr_state *s, kr_vec3 rows[3]);
#define Q(name, doubles, flags, dimension, text) FUNCTION_##doubles(name)
#include "quantities.def"
#undef Q

/* A component of a quantity, such as one coordinate of a vector. Event functions identify it by the
 * number 1 + KR_AXES * quantity + axis. The number KR_COMPONENT_ONE = 0 means the constant 1. */
typedef struct kr_component {
    int quantity, axis; /* KR_QUANTITY_...; index of the double, from 0 */
} kr_component;
/* Returns 1 if `number` identifies a component that events can use. */
int kr_component_is_valid(int number);
/* Returns the component with this number, which must not be KR_COMPONENT_ONE. */
static inline kr_component kr_component_of(int number)
{
    return (kr_component){(number - 1) / KR_AXES, (number - 1) % KR_AXES};
}
/* Returns 1 if the component changes when the top is rotated about the vertical. */
int kr_component_is_turned(int number);
/* Returns the value of a component at a state, or NaN if `number` is invalid. */
double kr_component_value(int number, const kr_scene *scene, const kr_state *s);
#endif
