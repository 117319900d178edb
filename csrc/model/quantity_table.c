/* The table of quantities (see quantities.def), and functions that access their components. */
#include <math.h>
#include <string.h>
#include "quantities.h"

/* Each function values_of_<name> writes the values of one quantity at n states to `out`. */
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

const kr_quantity_row kr_quantity_rows[KR_QUANTITIES] = {
#define Q(name, doubles, flags, dimension, text) {values_of_##name, doubles, flags, dimension[0]},
#include "quantities.def"
#undef Q
};
static const char *const suffixes_1[] = {""};
static const char *const suffixes_3[] = {"_x", "_y", "_z"};
static const char *const suffixes_4[] = {"_w", "_x", "_y", "_z"};
static const char *const suffixes_9[] = {"_Nx", "_Ny", "_Nz", "_Bx", "_By",
                                         "_Bz", "_Tx", "_Ty", "_Tz"};
/* All texts are in one struct, because linkers do not omit single unused string literals. */
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
const kr_quantity kr_quantities[KR_QUANTITIES] = {
#define Q(name, doubles, flags, dimension, text)                                                   \
    {quantity_texts.name##_name,                                                                   \
     quantity_texts.name##_text,                                                                   \
     quantity_texts.name##_dimension,                                                              \
     suffixes_##doubles,                                                                           \
     doubles,                                                                                      \
     flags},
#include "quantities.def"
#undef Q
};
const kr_quantity *kr_quantity_at(size_t i) { return i < KR_QUANTITIES ? &kr_quantities[i] : NULL; }
const kr_quantity *kr_quantity_find(const char *name)
{
    for (size_t i = 0; name && i < KR_QUANTITIES; i++)
        if (strcmp(kr_quantities[i].name, name) == 0) return &kr_quantities[i];
    return NULL;
}
void kr_quantity_values(const kr_quantity *quantity, const kr_scene *scene, size_t n,
                        const kr_state states[], double out[])
{
    kr_quantity_rows[quantity - kr_quantities].values(scene, n, states, out);
}

int kr_component_find(const char *name)
{
    if (!name) return -1;
    if (strcmp(name, "1") == 0) return KR_COMPONENT_ONE;
    for (int number = 1; number <= KR_QUANTITIES * KR_AXES; number++) {
        if (!kr_component_is_valid(number)) continue;
        const kr_component c = kr_component_of(number);
        const kr_quantity *quantity = &kr_quantities[c.quantity];
        const size_t length = strlen(quantity->name);
        if (strncmp(name, quantity->name, length) == 0 &&
            strcmp(name + length, quantity->suffixes[c.axis]) == 0)
            return number;
    }
    return -1;
}
int kr_component_is_valid(int number)
{
    if (number <= KR_COMPONENT_ONE) return number == KR_COMPONENT_ONE;
    const kr_component c = kr_component_of(number);
    return c.quantity < KR_QUANTITIES &&
           kr_quantity_rows[c.quantity].flags & KR_QUANTITY_IN_EVENTS &&
           c.axis < kr_quantity_rows[c.quantity].doubles;
}
/* The third component of a vector is vertical, and does not change. */
int kr_component_is_turned(int number)
{
    const kr_component c = kr_component_of(number);
    const kr_quantity_row *quantity = &kr_quantity_rows[c.quantity];
    return number != KR_COMPONENT_ONE && quantity->flags & KR_QUANTITY_TURNS &&
           !(quantity->doubles == 3 && c.axis == 2);
}
double kr_component_value(int number, const kr_scene *scene, const kr_state *s)
{
    const kr_component c = kr_component_of(number);
    double values[KR_QUANTITY_DOUBLES_MAX];
    if (number == KR_COMPONENT_ONE) return 1.0;
    if (!kr_component_is_valid(number)) return NAN;
    kr_quantity_rows[c.quantity].values(scene, 1, s, values);
    return values[c.axis];
}
