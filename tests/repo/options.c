/* Prints what a build of the library offers: for each method that is named on the command line, the
 * status of a run, and the statuses of a top with 20 digits and of one with tangents. Then come
 * those of a top with friction, of one on a support that turns, of one on a support that shakes,
 * and of one with derivatives by the friction. The last line lists all methods of the build. */
#include <kreisel.h>
#include <stdio.h>

static kr_status try_scene(kr_scene scene, const kr_method *method, kr_config config)
{
    kr_top *top = NULL;
    kr_status status = kr_top_create(&scene, method, config, &top);
    if (status == KR_OK) status = kr_top_advance(top, 1.0);
    kr_top_free(top);
    return status;
}
static kr_status try_config(const kr_method *method, kr_config config)
{
    return try_scene(kr_scene_default(), method, config);
}
static void try_supports(const kr_method *method, kr_config config)
{
    kr_scene rubs = kr_scene_default(), turns = rubs, shakes = rubs;
    kr_config tangents = config;
    rubs.friction = 0.01;
    turns.turning.x = 0.1;
    shakes.shaking = (kr_shaking){.amplitude = 0.1, .rate = 2.0};
    tangents.tangents = KR_TANGENT_FRICTION;
    printf(" %d %d %d %d\n", (int)try_scene(rubs, method, config),
           (int)try_scene(turns, method, config), (int)try_scene(shakes, method, config),
           (int)try_scene(rubs, method, tangents));
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
        printf("%s %d %d %d", names[i], (int)try_config(method, plain),
               (int)try_config(method, digits), (int)try_config(method, tangents));
        try_supports(method, plain);
    }
    for (size_t i = 0; kr_method_at(i); i++)
        printf("%s%s", i ? " " : "", kr_method_describe(kr_method_at(i)).name);
    printf("\n");
    return 0;
}
