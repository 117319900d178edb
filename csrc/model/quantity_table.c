/* The table of quantities (see quantities.def), and functions that access their components. */
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "quantities.h"

/* Each function values_of_<name> writes the values of one quantity at n states. */
#define PUT_1(name) out[i] = kr_state_##name(scene, &s[i])
#define PUT_3(name) ((kr_vec3 *)out)[i] = kr_state_##name(scene, &s[i])
#define PUT_4(name) ((kr_quat *)out)[i] = kr_state_##name(scene, &s[i])
#define PUT_9(name) kr_state_##name(scene, &s[i], (kr_vec3 *)out + 3 * i)
#define Q(name, doubles, flags, dimension, text)                                                   \
    static void values_of_##name(const kr_scene *scene, size_t n, const kr_state s[],              \
                                 double out[])                                                     \
    {                                                                                              \
        for (size_t i = 0; i < n; i++) PUT_##doubles(name);                                        \
    }
#include "quantities.def"
#undef Q

static const struct quantity_texts {
#define Q(name, doubles, flags, dimension, text)                                                   \
    char name##_name[sizeof #name], name##_dimension[sizeof dimension], name##_text[sizeof text];
#include "quantities.def"
#undef Q
} quantity_texts = {
#define Q(name, doubles, flags, dimension, text) #name, dimension, text,
#include "quantities.def"
#undef Q
};
static const char *text_at(unsigned short offset) { return (const char *)&quantity_texts + offset; }

#define OFFSET(member) offsetof(struct quantity_texts, member)
const kr_quantity kr_quantities[KR_QUANTITIES] = {
#define Q(name, doubles, flags, dimension, text)                                                   \
    {OFFSET(name##_name), OFFSET(name##_dimension), OFFSET(name##_text), doubles, flags,           \
     values_of_##name},
#include "quantities.def"
#undef Q
};
size_t kr_quantity_count(void) { return KR_QUANTITIES; }
const kr_quantity *kr_quantity_at(size_t i) { return i < KR_QUANTITIES ? &kr_quantities[i] : NULL; }
const kr_quantity *kr_quantity_find(const char *name)
{
    for (size_t i = 0; name && i < KR_QUANTITIES; i++)
        if (strcmp(text_at(kr_quantities[i].name), name) == 0) return &kr_quantities[i];
    return NULL;
}
const char *kr_quantity_name(const kr_quantity *quantity) { return text_at(quantity->name); }
const char *kr_quantity_text(const kr_quantity *quantity) { return text_at(quantity->text); }
const char *kr_quantity_dimension(const kr_quantity *quantity)
{
    return text_at(quantity->dimension);
}
size_t kr_quantity_doubles(const kr_quantity *quantity) { return quantity->doubles; }
unsigned kr_quantity_flags(const kr_quantity *quantity) { return quantity->flags; }
void kr_quantity_values(const kr_quantity *quantity, const kr_scene *scene, size_t n,
                        const kr_state states[], double out[])
{
    quantity->values(scene, n, states, out);
}

const char *kr_quantity_axis(const kr_quantity *quantity, size_t i)
{
    static const char *const one[] = {""}, *const vector[] = {"_x", "_y", "_z"},
                             *const quaternion[] = {"_w", "_x", "_y", "_z"},
                             *const rows[] = {"_Nx", "_Ny", "_Nz", "_Bx", "_By",
                                              "_Bz", "_Tx", "_Ty", "_Tz"};
    const size_t n = quantity->doubles;
    const char *const *axes = n == 1 ? one : n == 3 ? vector : n == 4 ? quaternion : rows;
    return i < n ? axes[i] : NULL;
}
int kr_component_find(const char *name)
{
    if (!name) return -1;
    if (strcmp(name, "1") == 0) return KR_COMPONENT_ONE;
    for (int number = 1; number <= KR_QUANTITIES * KR_AXES; number++) {
        if (!kr_component_is_valid(number)) continue;
        const kr_component c = kr_component_of(number);
        const kr_quantity *quantity = &kr_quantities[c.quantity];
        const char *own = text_at(quantity->name);
        const size_t length = strlen(own);
        if (strncmp(name, own, length) == 0 &&
            strcmp(name + length, kr_quantity_axis(quantity, (size_t)c.axis)) == 0)
            return number;
    }
    return -1;
}
int kr_component_is_valid(int number)
{
    if (number <= KR_COMPONENT_ONE) return number == KR_COMPONENT_ONE;
    const kr_component c = kr_component_of(number);
    return c.quantity < KR_QUANTITIES && kr_quantities[c.quantity].flags & KR_QUANTITY_IN_EVENTS &&
           (size_t)c.axis < kr_quantities[c.quantity].doubles;
}
/* The third component of a vector in the space frame is the vertical one, and is unchanged when the
 * top is rotated about the vertical. */
int kr_component_is_turned(int number)
{
    const kr_component c = kr_component_of(number);
    const kr_quantity *quantity = &kr_quantities[c.quantity];
    return number != KR_COMPONENT_ONE && quantity->flags & KR_QUANTITY_TURNS &&
           !(quantity->doubles == 3 && c.axis == 2);
}
double kr_component_value(int number, const kr_scene *scene, const kr_state *s)
{
    const kr_component c = kr_component_of(number);
    double values[KR_QUANTITY_DOUBLES_MAX];
    if (number == KR_COMPONENT_ONE) return 1.0;
    if (!kr_component_is_valid(number)) return NAN;
    kr_quantities[c.quantity].values(scene, 1, s, values);
    return values[c.axis];
}
