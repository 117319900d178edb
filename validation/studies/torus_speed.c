/* Timed loops for torus_speed.py. `kind` is 0 for Kowalewski tops and 1 for Goryachev-Chaplygin
 * tops. */
#define _POSIX_C_SOURCE 199309L
#include <stdlib.h>
#include <time.h>
#include "exact/torus.h"
#include "kreisel.h"

void *kr_bench_torus_plan(const kr_scene *scene, int kind, double *seconds);
double kr_bench_torus_states(int kind, const void *plan, int batch, size_t n, const double t[],
                             kr_state out[]);
double kr_bench_torus_taylor(const kr_scene *scene, double t);
void kr_bench_torus_free(void *plan);

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static const kr_torus_form *form_of(int kind)
{
    return kind ? &kr_chaplygin_form : &kr_kowalewski_form;
}
/* Returns a plan and writes the time that it took, or returns NULL if the scene is refused. */
void *kr_bench_torus_plan(const kr_scene *scene, int kind, double *seconds)
{
    const kr_torus_scalar *scalar = kr_torus_widest_isa(form_of(kind))->scalar;
    void *memory = calloc(1, scalar->memory_size);
    /* The first call touches the memory for the first time. */
    if (memory && scalar->plan(scene, 0, 0.0, memory) == KR_OK) {
        const double begin = now();
        (void)scalar->plan(scene, 0, 0.0, memory);
        *seconds = now() - begin;
        return memory;
    }
    free(memory);
    return NULL;
}
void kr_bench_torus_free(void *plan) { free(plan); }
/* Returns the seconds per state of n states, one by one or in batches. */
double kr_bench_torus_states(int kind, const void *plan, int batch, size_t n, const double t[],
                             kr_state out[])
{
    const kr_torus_form *form = form_of(kind);
    const double begin = now();
    if (batch)
        kr_torus_states(form, plan, n, t, out);
    else
        for (size_t i = 0; i < n; i++)
            out[i] = kr_torus_widest_isa(form)->scalar->state(plan, t[i]);
    return (now() - begin) / (double)n;
}
/* Returns the seconds that the Taylor series takes to the time t, or a negative number. */
double kr_bench_torus_taylor(const kr_scene *scene, double t)
{
    kr_top *top;
    if (kr_top_create(scene, kr_method_find("taylor"), (kr_config){0}, &top) != KR_OK) return -1.0;
    const double begin = now();
    const kr_status status = kr_top_advance(top, t);
    const double seconds = now() - begin;
    kr_top_free(top);
    return status == KR_OK ? seconds : -1.0;
}
