/* Names of kinds of tops and texts of statuses, generated from the lists in kreisel.h. All texts of
 * statuses are members of one struct, and a table contains the offset of each text in the struct.
 * Offsets take less memory than pointers, and need no relocation when the library is loaded. */
#include <stddef.h>
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
