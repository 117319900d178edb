/* The quantities as a table, and the single numbers of those that events know. */
#ifndef KR_QUANTITIES_H
#define KR_QUANTITIES_H
#include "kreisel.h"

enum {
#define Q(name, doubles, flags, dimension, text) KR_QUANTITY_##name,
#include "quantities.def"
#undef Q
    KR_QUANTITIES,
    KR_QUANTITY_DOUBLES_MAX = 9, /* doubles of the widest */
    KR_AXES = 16                 /* numbers kept for the components of each */
};
struct kr_quantity {
    const char *name, *dimension, *text;
    size_t doubles;
    unsigned flags;
    void (*values)(const kr_scene *scene, size_t n, const kr_state states[], double out[]);
};
extern const kr_quantity kr_quantities[KR_QUANTITIES];

/* Every quantity is computed by kr_state_<name>, whose type its doubles tell. */
#define FUNCTION_1(name) double kr_state_##name(const kr_scene *scene, const kr_state *s);
#define FUNCTION_3(name) kr_vec3 kr_state_##name(const kr_scene *scene, const kr_state *s);
#define FUNCTION_4(name) kr_quat kr_state_##name(const kr_scene *scene, const kr_state *s);
#define FUNCTION_9(name)                                                                           \
    void kr_state_##name(const kr_scene *scene, const kr_state *s, kr_vec3 rows[3]);
#define Q(name, doubles, flags, dimension, text) FUNCTION_##doubles(name)
#include "quantities.def"
#undef Q

/* One number of a quantity: which quantity, and which of its doubles. KR_COMPONENT_ONE apart,
 * components are numbered by both, from 1 on. */
typedef struct kr_component {
    int quantity, axis; /* KR_QUANTITY_..., from 0 */
} kr_component;
/* Whether kr_component_find may have given this number. */
int kr_component_is_valid(int number);
/* What such a number other than KR_COMPONENT_ONE stands for. */
static inline kr_component kr_component_of(int number)
{
    const kr_component component = {(number - 1) / KR_AXES, (number - 1) % KR_AXES};
    return component;
}
/* Whether the component changes when the top is turned about the vertical. */
int kr_component_is_turned(int number);
double kr_component_value(int number, const kr_scene *scene, const kr_state *s);
#endif
