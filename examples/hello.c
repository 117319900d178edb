/* Moves a spinning top for one second and prints its tilt every tenth of a second.
 *
 * The top is a disk on a light axle, in kilograms, metres and seconds. One end of the axle is
 * fixed. The top is tilted by 60 degrees, spins with 3000 turns a minute, and is released. */
#include <kreisel.h>
#include <stdio.h>

int main(void)
{
    const double spin = 314.159, moment = 6.25e-4; /* [1/s], about the axle [kg m^2] */
    kr_scene scene = kr_scene_default();
    kr_status status = kr_body_symmetric(0.5, 7.5125e-3, moment, 0.12, &scene.body);
    scene.gravity = 9.81;
    scene.start.q.w = 0.8660254037844387; /* cos(30 degrees): turned by 60 degrees about e1 */
    scene.start.q.x = 0.5;                /* sin(30 degrees) */
    scene.start.q.y = scene.start.q.z = 0.0;
    /* The angular momentum points along the axle: spin * moment * apex. */
    const kr_vec3 apex = kr_state_apex(&scene, &scene.start);
    scene.start.m.x = spin * moment * apex.x;
    scene.start.m.y = spin * moment * apex.y;
    scene.start.m.z = spin * moment * apex.z;

    kr_top *top = NULL;
    if (status == KR_OK)
        status = kr_top_create(&scene, &kr_method_taylor, kr_config_default(), &top);
    printf("kreisel %s\n", kr_version());
    for (int i = 0; status == KR_OK && i <= 10; i++) {
        status = kr_top_advance(top, 0.1 * i);
        const kr_state s = kr_top_state(top);
        printf("t = %.1f s: tilt %.9f rad\n", s.t, kr_state_nutation(&scene, &s));
    }
    kr_top_free(top); /* ignores NULL */
    if (status == KR_OK) return 0;
    fprintf(stderr, "%s\n", kr_status_text(status));
    return 1;
}
