/* What bench_exact.py times beside heyoka: loops in C, with their own clock. It includes states.c to reach its variants. */
#define _POSIX_C_SOURCE 199309L
#include <time.h>
#include "exact/states.c"

double bench_plan(const kr_scene *scene, int n);
double bench_plan_and_state(const kr_scene *scene, double t, int n);
double bench_states(const kr_scene *scene, int n, const double t[], kr_state out[]);
double bench_batch(const kr_scene *scene, int width, int n, const double t[], kr_state out[]);
double bench_map_state(const kr_scene *scene, double step, int n);

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static volatile double keep;

double bench_plan(const kr_scene *scene, int n)
{
    kr_exact plan;
    const double begin = now();
    for (int i = 0; i < n; i++) keep = kr_exact_plan(scene, &plan) == KR_OK ? plan.period : 0.0;
    return (now() - begin) / n;
}
double bench_plan_and_state(const kr_scene *scene, double t, int n)
{
    kr_exact plan;
    const double begin = now();
    for (int i = 0; i < n; i++) keep = kr_exact_plan(scene, &plan) == KR_OK ? kr_exact_state(&plan, t).q.w : 0.0;
    return (now() - begin) / n;
}
double bench_states(const kr_scene *scene, int n, const double t[], kr_state out[])
{
    kr_exact plan;
    if (kr_exact_plan(scene, &plan) != KR_OK) return -1.0;
    const double begin = now();
    for (int i = 0; i < n; i++) out[i] = kr_exact_state(&plan, t[i]);
    return (now() - begin) / n;
}
/* width: 2, 4, 8 doubles; -1 if this processor has not got it. n whole blocks. */
double bench_batch(const kr_scene *scene, int width, int n, const double t[], kr_state out[])
{
    kernel_of *const kernel = width == 8 ? __builtin_cpu_supports("avx512f") ? avx512 : NULL
                              : width == 4 ? __builtin_cpu_supports("avx2") ? avx2 : NULL : plain;
    kr_exact plan;
    block b;
    if (!kernel || kr_exact_plan(scene, &plan) != KR_OK) return -1.0;
    const double begin = now();
    for (int from = 0; from < n; from += BLOCK) {
        memcpy(b.t, t + from, sizeof b.t);
        kernel(&plan, &b);
        for (int i = 0; i < BLOCK; i++) {
            const kr_state s = {b.t[i], {b.w[i], b.x[i], b.y[i], b.z[i]}, {b.mx[i], b.my[i], b.mz[i]}};
            out[from + i] = s;
        }
    }
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
