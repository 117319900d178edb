/* Prints what a build of the library offers: for each method that is named on the command line, the
 * status of a run, and the statuses of a top with 20 digits and of one with tangents. */
#include <kreisel.h>
#include <stdio.h>

static kr_status try_config(const kr_method *method, kr_config config)
{
    const kr_scene scene = kr_scene_default();
    kr_top *top = NULL;
    kr_status status = kr_top_create(&scene, method, config, &top);
    if (status == KR_OK) status = kr_top_advance(top, 1.0);
    kr_top_free(top);
    return status;
}
int main(int count, char **names)
{
    for (int i = 1; i < count; i++) {
        const kr_method *method = kr_method_find(names[i]);
        kr_config plain = kr_config_default();
        plain.step = 0.01;
        kr_config digits = plain, tangents = plain;
        digits.digits = 20;
        tangents.tangents = KR_TANGENT_START;
        printf("%s %d %d %d\n", names[i], (int)try_config(method, plain),
               (int)try_config(method, digits), (int)try_config(method, tangents));
    }
    for (size_t i = 0; i < kr_method_count(); i++)
        printf("%s%s", i ? " " : "", kr_method_name(kr_method_at(i)));
    printf("\n");
    return 0;
}
