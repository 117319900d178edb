/* Statuses, kinds and flags by their names and texts, from the lists in kreisel.h. */
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

static const struct flag {
    unsigned bit;
    const char *name, *text;
} flags[] = {
#define X(flag, bit, name, text) {bit, name, text},
    KR_FLAG_LIST(X)
#undef X
};
enum { FLAGS = sizeof flags / sizeof *flags };

static const struct flag *flag_of(unsigned bit)
{
    for (int i = 0; i < FLAGS; i++)
        if (flags[i].bit == bit) return &flags[i];
    return NULL;
}
unsigned kr_flag_find(const char *name)
{
    for (int i = 0; name && i < FLAGS; i++)
        if (strcmp(flags[i].name, name) == 0) return flags[i].bit;
    return 0;
}
const char *kr_flag_name(unsigned bit)
{
    const struct flag *flag = flag_of(bit);
    return flag ? flag->name : NULL;
}
const char *kr_flag_text(unsigned bit)
{
    const struct flag *flag = flag_of(bit);
    return flag ? flag->text : NULL;
}
