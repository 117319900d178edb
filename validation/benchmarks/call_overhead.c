/* The cost of a short call within the core: it makes a top, records its states and frees the top.
 *
 * Usage: call_overhead METHOD STEP BLOCK T ..., where BLOCK is a kr_scene in hexadecimal. Prints
 * the duration of one call in nanoseconds, the shortest of several rounds. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "kreisel.h"

enum { ROUNDS = 51, CALLS = 2000, MOST = 64 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}
static kr_scene scene_of(const char *block)
{
    kr_scene scene;
    unsigned char *to = (unsigned char *)&scene;
    for (size_t i = 0; i < sizeof scene; i++) {
        const char byte[3] = {block[2 * i], block[2 * i + 1], 0};
        to[i] = (unsigned char)strtoul(byte, NULL, 16);
    }
    return scene;
}
static void print_call(const kr_scene *scene, const kr_method *method, kr_config config, size_t n,
                       const double t[], kr_state out[])
{
    kr_top *top = NULL;
    if (kr_top_create(scene, method, config, &top) != KR_OK) exit(1);
    if (kr_top_record(top, n, t, out, NULL) != KR_OK) exit(1);
    kr_top_free(top);
}

int main(int argc, char **argv)
{
    double t[MOST], least = 1e300;
    kr_state out[MOST];
    kr_config config = {0};
    if (argc < 5 || argc > 4 + MOST) return 1;
    const kr_method *method = kr_method_find(argv[1]);
    const kr_scene scene = scene_of(argv[3]);
    const size_t n = (size_t)argc - 4;
    config.step = strtod(argv[2], NULL);
    for (size_t i = 0; i < n; i++) t[i] = strtod(argv[4 + i], NULL);
    for (int round = 0; round < ROUNDS; round++) {
        const double begin = now();
        for (int i = 0; i < CALLS; i++) print_call(&scene, method, config, n, t, out);
        const double each = (now() - begin) / CALLS;
        least = each < least ? each : least;
    }
    printf("%.1f\n", least);
    return 0;
}
