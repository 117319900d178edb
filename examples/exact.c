/* Evaluates the closed form of a symmetric top: any time costs the same, and errors do not grow.
 * The closed form is in memory of the program. */
#include <kreisel.h>
#include <stdio.h>
#include <stdlib.h>

int main(void)
{
    kr_scene scene = {.gravity = 9.81, .start.q = {0.8660254037844387, 0.5, 0.0, 0.0}};
    kr_status status = kr_body_symmetric(0.5, 7.5125e-3, 6.25e-4, 0.12, &scene.body);
    const kr_vec3 apex = kr_state_apex(&scene, &scene.start);
    const double m = 314.159 * 6.25e-4; /* spin times moment */
    scene.start.m = (kr_vec3){m * apex.x, m * apex.y, m * apex.z};

    kr_exact *exact = malloc(kr_exact_size(&scene));
    kr_nutation nutation;
    if (status == KR_OK) status = kr_exact_plan(&scene, 0.0, exact);
    if (status == KR_OK) status = kr_exact_nutation(&scene, &nutation);
    if (status != KR_OK) {
        fprintf(stderr, "%s\n", kr_status_text(status));
        return 1;
    }
    printf("motion: %s\n", nutation.motion_type);
    printf("tilt: %.12f to %.12f\n", nutation.least, nutation.greatest);
    const kr_exact_info info = kr_exact_describe(exact);
    printf("period: %.12f\nprecession: %.12f\n", info.period, info.precession_rate);
    const double times[] = {0.0, 1.0, 60.0, 86400.0};
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        const kr_state s = kr_exact_state(exact, times[i]);
        printf("t = %.0f: tilt %.9f\n", s.t, kr_state_nutation(&scene, &s));
    }
    free(exact);
    return 0;
}
