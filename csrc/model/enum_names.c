/* Names and descriptions of status codes, kinds of tops and method flags, generated from the lists
 * in kreisel.h. Except for the names of kinds, all strings of a table are members of one struct,
 * and the table contains their offsets in this struct. An offset takes less memory than a pointer,
 * and needs no relocation when the library is loaded. */
#include <stddef.h>
#include <string.h>
#include "kreisel.h"

const char *kr_version(void) { return KR_VERSION; }

static const struct status_texts {
#define X(name, what, text) char name[sizeof text];
    KR_STATUS_LIST(X)
#undef X
} status_texts = {
#define X(name, what, text) text,
    KR_STATUS_LIST(X)
#undef X
};
const char *kr_status_text(kr_status status)
{
    static const unsigned short offsets[] = {
#define X(name, what, text) offsetof(struct status_texts, name),
        KR_STATUS_LIST(X)
#undef X
    };
    return (unsigned)status < KR_STATUS_COUNT ? (const char *)&status_texts + offsets[status]
                                              : "unknown status";
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

static const struct flag_texts {
#define X(flag, bit, name, text) char flag##_name[sizeof name], flag##_text[sizeof text];
    KR_FLAG_LIST(X)
#undef X
} flag_texts = {
#define X(flag, bit, name, text) name, text,
    KR_FLAG_LIST(X)
#undef X
};
static const struct flag_entry {
    unsigned bit;
    unsigned short name, text; /* offsets in flag_texts */
} flag_table[] = {
#define X(flag, bit, name, text)                                                                   \
    {bit, offsetof(struct flag_texts, flag##_name), offsetof(struct flag_texts, flag##_text)},
    KR_FLAG_LIST(X)
#undef X
};
enum { FLAG_COUNT = sizeof flag_table / sizeof *flag_table };

static const char *flag_text_at(unsigned short offset)
{
    return (const char *)&flag_texts + offset;
}
static const struct flag_entry *flag_of(unsigned bit)
{
    for (int i = 0; i < FLAG_COUNT; i++)
        if (flag_table[i].bit == bit) return &flag_table[i];
    return NULL;
}
unsigned kr_flag_find(const char *name)
{
    for (int i = 0; name && i < FLAG_COUNT; i++)
        if (strcmp(flag_text_at(flag_table[i].name), name) == 0) return flag_table[i].bit;
    return 0;
}
const char *kr_flag_name(unsigned bit)
{
    const struct flag_entry *flag = flag_of(bit);
    return flag ? flag_text_at(flag->name) : NULL;
}
const char *kr_flag_text(unsigned bit)
{
    const struct flag_entry *flag = flag_of(bit);
    return flag ? flag_text_at(flag->text) : NULL;
}
