/* Evaluates the closed form of a symmetric top: any time costs the same, and errors do not grow.
 * Nothing is allocated. */
#include <kreisel.h>
#include <stdio.h>

int main(void)
{
    kr_scene scene = {.gravity = 9.81, .start.q = {0.8660254037844387, 0.5, 0.0, 0.0}};
    kr_status status = kr_body_symmetric(0.5, 7.5125e-3, 6.25e-4, 0.12, &scene.body);
    const kr_vec3 apex = kr_state_apex(&scene, &scene.start);
    const double m = 314.159 * 6.25e-4; /* spin times moment */
    scene.start.m = (kr_vec3){m * apex.x, m * apex.y, m * apex.z};

    kr_exact exact;
    kr_turning turning;
    if (status == KR_OK) status = kr_exact_plan(&scene, &exact);
    if (status == KR_OK) status = kr_exact_turning(&scene, &turning);
    if (status != KR_OK) {
        fprintf(stderr, "%s\n", kr_status_text(status));
        return 1;
    }
    printf("motion: %s\n", turning.motion_type);
    printf("tilt: %.12f to %.12f\n", turning.least, turning.greatest);
    printf("period: %.12f\nprecession: %.12f\n", exact.period, exact.precession_rate);
    const double times[] = {0.0, 1.0, 60.0, 86400.0};
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        const kr_state s = kr_exact_state(&exact, times[i]);
        printf("t = %.0f: tilt %.9f\n", s.t, kr_state_nutation(&scene, &s));
    }
    return 0;
}
