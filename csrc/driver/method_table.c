/* The table of methods, built from methods.def. If methods are selected at build time
 * (KREISEL_METHODS), all others are marked OMITTED in a generated methods.def. */
#include <string.h>
#include "method.h"

#ifndef KR_METHODS_FILE
#  define KR_METHODS_FILE "methods.def"
#endif
#ifdef KREISEL_GSL
extern const kr_method kr_method_gsl_rk8pd, kr_method_gsl_bsimp;
#endif
static const kr_method *const method_table[] = {
#define X(id) &kr_method_##id,
#define OMITTED(id)
#include KR_METHODS_FILE
#undef X
#undef OMITTED
};
/* The methods omitted from this build. The list ends with an entry that has no name. */
static const kr_method omitted_methods[] = {
#define X(id)
#define OMITTED(id)                                                                                \
    {.name = #id, .text = "left out of this build", .conserves = "", .reference = ""},
#include KR_METHODS_FILE
#undef X
#undef OMITTED
    {.name = NULL}};
const kr_method *kr_method_at(size_t i)
{
    return i < sizeof method_table / sizeof *method_table ? method_table[i] : NULL;
}
const kr_method *kr_method_find(const char *name)
{
    for (size_t i = 0; name && kr_method_at(i); i++)
        if (strcmp(method_table[i]->name, name) == 0) return method_table[i];
    for (size_t i = 0; name && omitted_methods[i].name; i++)
        if (strcmp(omitted_methods[i].name, name) == 0) return &omitted_methods[i];
    return NULL;
}
