/* Stops a top whenever its axis is lowest. The times are as accurate as the states, whatever the
 * steps. */
#include <kreisel.h>
#include <stdio.h>

int main(void)
{
    kr_scene scene = {.gravity = 9.81, .start.q = {0.8660254037844387, 0.5, 0.0, 0.0}};
    kr_status status = kr_body_symmetric(0.5, 7.5125e-3, 6.25e-4, 0.12, &scene.body);
    const kr_vec3 apex = kr_state_apex(&scene, &scene.start);
    const double m = 314.159 * 6.25e-4; /* spin times moment */
    scene.start.m = (kr_vec3){m * apex.x, m * apex.y, m * apex.z};

    /* The function is the height of the apex. The event is a minimum of this function. */
    const kr_term height = {1.0, kr_component_find("apex_z"), KR_COMPONENT_ONE};
    kr_event lowest = {.terms = &height, .count = 1, .extremum = 1, .direction = 1};
    kr_top *top = NULL;
    if (status == KR_OK)
        status = kr_top_create(&scene, &kr_method_taylor, kr_config_default(), &top);
    if (status == KR_OK) status = kr_top_watch(top, 1, &lowest);
    kr_event_hit hit = {0, 0};
    while (status == KR_OK && hit.index >= 0) {
        status = kr_top_seek(top, 2.0, &hit); /* stops at 2.0 with the index -1 */
        const kr_state s = kr_top_state(top);
        if (status == KR_OK)
            printf("%s at t = %.12f: tilt %.12f\n", hit.index < 0 ? "end" : "lowest", s.t,
                   kr_state_nutation(&scene, &s));
    }
    kr_top_free(top);
    if (status != KR_OK) fprintf(stderr, "%s\n", kr_status_text(status));
    return status != KR_OK;
}
