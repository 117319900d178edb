/* The cost of recording. The time of a fixed-step run that keeps all states in reused memory is
 * divided by the time of a run without output, and by that of a run that only visits each state.
 *
 * Usage: record [steps step rounds]. All methods run on the default scene, in turn. Ratios of
 * consecutive runs are printed as medians with quartiles. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "kreisel.h"

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
enum what { END_ONLY, EACH_LOOKED_AT, ALL_KEPT, WAYS };
/* Returns the duration in seconds of one run through t[0..n-1]. */
static double run(const kr_method *method, double step, enum what what, size_t n, const double t[],
                  kr_state out[])
{
    const kr_scene scene = kr_scene_default();
    kr_config config = {0};
    kr_top *top = NULL;
    double begin;
    int bad = 0;
    config.step = step;
    if (kr_top_create(&scene, method, config, &top) != KR_OK) exit(1);
    begin = now();
    if (what == END_ONLY) bad = kr_top_advance(top, t[n - 1]) != KR_OK;
    if (what == EACH_LOOKED_AT)
        for (size_t k = 0; k < n; k++) bad |= kr_top_advance(top, t[k]) != KR_OK;
    if (what == ALL_KEPT) bad = kr_top_record(top, n, t, out, NULL) != KR_OK;
    begin = now() - begin;
    kr_top_free(top);
    if (bad) exit(1);
    return begin;
}
static void quartiles(const char *name, double *values, size_t n, double unit)
{
    qsort(values, n, sizeof *values, by_size);
    printf("  %s %.3f (%.3f .. %.3f)", name, unit * values[n / 2], unit * values[n / 4],
           unit * values[(3 * n) / 4]);
}

int main(int argc, char **argv)
{
    const size_t n = argc > 1 ? strtoul(argv[1], NULL, 10) : 100000;
    const size_t rounds = argc > 3 ? strtoul(argv[3], NULL, 10) : 25;
    const double step = argc > 2 ? strtod(argv[2], NULL) : 1.0 / 1024.0;
    double *t = calloc(n, sizeof *t), *bare = calloc(3 * rounds, sizeof *bare);
    double *to_bare = bare + rounds, *to_looked = bare + 2 * rounds;
    kr_state *out = calloc(n, sizeof *out);
    if (!t || !bare || !out || !n || !rounds) return 1;
    for (size_t k = 0; k < n; k++) t[k] = (double)(k + 1) * step;
    for (size_t i = 0; i < kr_method_count(); i++) {
        const kr_method *method = kr_method_at(i);
        const kr_scene scene = kr_scene_default();
        if (kr_method_flags(method) & KR_METHOD_ADAPTIVE || !kr_method_applies(method, &scene.body))
            continue;
        run(method, step, ALL_KEPT, n, t, out); /* makes the system allocate all pages */
        for (size_t r = 0; r < rounds; r++) {
            double seconds[WAYS];
            for (int way = 0; way < WAYS; way++)
                seconds[way] = run(method, step, (enum what)way, n, t, out);
            bare[r] = seconds[END_ONLY] / (double)n;
            to_bare[r] = seconds[ALL_KEPT] / seconds[END_ONLY];
            to_looked[r] = seconds[ALL_KEPT] / seconds[EACH_LOOKED_AT];
        }
        printf("  %-20s", kr_method_name(method));
        quartiles("over the end alone x", to_bare, rounds, 1.0);
        quartiles("  over looking at each x", to_looked, rounds, 1.0);
        quartiles("  a step, ns", bare, rounds, 1e9);
        printf("\n");
    }
    free(t);
    free(bare);
    free(out);
    return 0;
}
