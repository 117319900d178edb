/* A user's program, compiled as C99 and as C++. It integrates the top of the thesis for one unit of
 * time, and prints the version of the library. */
#include <kreisel.h>
#include <math.h>
#include <stdio.h>

int main(void)
{
    const kr_scene scene = kr_scene_default();
    const kr_config config = {0.01, 0.0, 0, NULL, NULL, 0, 0, 0};
    const double energy = kr_state_modified_energy(&scene, &scene.start, config.step);
    kr_top *top = NULL;
    kr_status status = kr_top_create(&scene, kr_method_find("bobenko_suris"), config, &top);
    if (status == KR_OK) status = kr_top_advance(top, 1.0);
    if (status != KR_OK) {
        printf("%s\n", kr_status_text(status));
        return 1;
    }
    const kr_state end = kr_top_state(top);
    kr_top_free(top);
    if (!(kr_attitude_error(end.q, scene.start.q) > 0.1)) {
        printf("the top stands still\n");
        return 1;
    }
    if (!(fabs(kr_state_modified_energy(&scene, &end, config.step) - energy) <
          1e-12 * fabs(energy))) {
        printf("the top lost energy\n");
        return 1;
    }
    printf("%s\n", kr_version());
    return 0;
}
