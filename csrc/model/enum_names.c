/* Names and texts of statuses, kinds and flags, from the lists in kreisel.h. */
#include <string.h>
#include "kreisel.h"

const char *kr_version(void) { return KR_VERSION; }

const char *kr_status_text(kr_status status)
{
    static const char *const texts[] = {
#define X(name, what, text) text,
        KR_STATUS_LIST(X)
#undef X
    };
    return (unsigned)status < KR_STATUS_COUNT ? texts[status] : "unknown status";
}
const char *kr_kind_name(kr_kind kind)
{
    static const char *const names[] = {
#define X(kind, name) name,
        KR_KIND_LIST(X)
#undef X
    };
    return (unsigned)kind < KR_KIND_COUNT ? names[kind] : "unknown kind";
}

static const struct flag_entry {
    unsigned bit;
    const char *name, *text;
} flag_table[] = {
#define X(flag, bit, name, text) {bit, name, text},
    KR_FLAG_LIST(X)
#undef X
};
enum { FLAG_COUNT = sizeof flag_table / sizeof *flag_table };

static const struct flag_entry *flag_of(unsigned bit)
{
    for (int i = 0; i < FLAG_COUNT; i++)
        if (flag_table[i].bit == bit) return &flag_table[i];
    return NULL;
}
unsigned kr_flag_find(const char *name)
{
    for (int i = 0; name && i < FLAG_COUNT; i++)
        if (strcmp(flag_table[i].name, name) == 0) return flag_table[i].bit;
    return 0;
}
const char *kr_flag_name(unsigned bit)
{
    const struct flag_entry *flag = flag_of(bit);
    return flag ? flag->name : NULL;
}
const char *kr_flag_text(unsigned bit)
{
    const struct flag_entry *flag = flag_of(bit);
    return flag ? flag->text : NULL;
}
