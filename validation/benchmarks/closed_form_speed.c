/* Timed loops for closed_form_speed.py. They call the public functions, or those of a given
 * instruction set. */
#define _POSIX_C_SOURCE 199309L
#include <string.h>
#include <time.h>
#include "exact/dispatch.h"

const char *bench_isa(int isa);
double bench_closed_form(const kr_scene *scene, int n);
double bench_closed_form_and_state(const kr_scene *scene, double t, int n);
double bench_states(const kr_scene *scene, int isa, int n, const double t[], kr_state out[]);
double bench_batch(const kr_scene *scene, int isa, int batch, int n, const double t[],
                   kr_state out[]);
double bench_map_state(const kr_scene *scene, double step, int n);

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static volatile double keep;

/* Writes the members of a closed form, and returns 1 if the scene has one. */
static int plan_form(const kr_scene *scene, kr_exact_form *form)
{
    kr_exact exact;
    if (kr_exact_plan(scene, &exact) != KR_OK) return 0;
    memcpy(form, &exact, sizeof *form);
    return 1;
}

double bench_closed_form(const kr_scene *scene, int n)
{
    kr_exact form;
    const double begin = now();
    for (int i = 0; i < n; i++) keep = kr_exact_plan(scene, &form) == KR_OK ? form.period : 0.0;
    return (now() - begin) / n;
}
double bench_closed_form_and_state(const kr_scene *scene, double t, int n)
{
    kr_exact form;
    const double begin = now();
    for (int i = 0; i < n; i++)
        keep = kr_exact_plan(scene, &form) == KR_OK ? kr_exact_state(&form, t).q.w : 0.0;
    return (now() - begin) / n;
}
const char *bench_isa(int isa) /* NULL beyond the last */
{
    const kr_exact_isa *found = kr_exact_isa_at(isa);
    return found ? found->runs_here() ? found->name : "" : NULL;
}
/* isa is an index for kr_exact_isa_at, or -1 for the instruction set that kr_exact_state uses. */
double bench_states(const kr_scene *scene, int isa, int n, const double t[], kr_state out[])
{
    kr_state (*const state)(const kr_exact_form *, double) =
        isa < 0 ? kr_exact_form_state : kr_exact_isa_at(isa)->scalar->state;
    kr_exact_form form;
    if (!plan_form(scene, &form)) return -1.0;
    const double begin = now();
    for (int i = 0; i < n; i++) out[i] = state(&form, t[i]);
    return (now() - begin) / n;
}
/* Returns the seconds per state if n states are computed in batches. */
double bench_batch(const kr_scene *scene, int isa, int batch, int n, const double t[],
                   kr_state out[])
{
    kr_exact_evaluate *const states =
        isa < 0 ? kr_exact_form_states : kr_exact_isa_at(isa)->evaluate;
    kr_exact_form form;
    if (!plan_form(scene, &form)) return -1.0;
    const double begin = now();
    for (int from = 0; from < n; from += batch)
        states(&form, (size_t)(n - from < batch ? n - from : batch), t + from, out + from);
    return (now() - begin) / n;
}
double bench_map_state(const kr_scene *scene, double step, int n)
{
    kr_exact_map map;
    if (kr_exact_map_plan(scene, step, &map) != KR_OK) return -1.0;
    const double begin = now();
    for (int i = 0; i < n; i++) keep = kr_exact_map_state(&map, i).q.w;
    return (now() - begin) / n;
}
