/* Names of kinds, flags and statuses. */
#include <string.h>
#include "check.h"
#include "method.h"

static void test_kinds(void)
{
    const kr_scene thesis = kr_scene_default();
    for (int kind = 0; kind < KR_KIND_COUNT; kind++)
        for (int other = 0; other < kind; other++)
            IS(strcmp(kr_kind_name((kr_kind)kind), kr_kind_name((kr_kind)other)) != 0);
    IS(strcmp(kr_kind_name(kr_body_kind(&thesis.body, KR_KIND_RTOL)), "lagrange") == 0);
    IS(strcmp(kr_kind_name(KR_KIND_COUNT), "unknown kind") == 0);
}
static void test_flags(void)
{
    unsigned all = 0;
    for (unsigned flag = 1; kr_flag_name(flag); flag *= 2) {
        IS(kr_flag_find(kr_flag_name(flag)) == flag && strlen(kr_flag_text(flag)) > 10);
        all |= flag;
    }
    IS(kr_flag_find("adaptive") == KR_METHOD_ADAPTIVE &&
       kr_flag_find("skips_heading") == KR_METHOD_SKIPS_HEADING);
    IS(kr_flag_find("slow") == 0 && kr_flag_find(NULL) == 0);
    IS(!kr_flag_name(0) && !kr_flag_name(KR_METHOD_ADAPTIVE | KR_METHOD_DENSE) &&
       !kr_flag_text(~all));
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_method *method = kr_method_at(i);
        IS((kr_method_flags(method) & ~all) == 0);
        IS(((kr_method_flags(method) & KR_METHOD_DENSE) != 0) == (method->at != NULL));
    }
    IS(kr_method_flags(kr_method_find("taylor")) & KR_METHOD_DENSE);
    IS(!(kr_method_flags(kr_method_find("rk4")) & KR_METHOD_DENSE));
}
static void test_statuses(void)
{
    for (int status = 0; status < KR_STATUS_COUNT; status++)
        IS(strcmp(kr_status_text((kr_status)status), "unknown status") != 0);
    IS(strcmp(kr_status_text(KR_STATUS_COUNT), "unknown status") == 0);
    IS(strcmp(kr_version(), KR_VERSION) == 0);
}

int main(void)
{
    test_kinds();
    test_flags();
    test_statuses();
    return check_result();
}
