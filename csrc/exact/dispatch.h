/* Functions that are compiled once for each instruction set; dispatch.c selects among them at run
 * time. All instruction sets give bitwise equal results, because fused multiply-add is used only to
 * compute exact products. */
#ifndef KR_EXACT_DISPATCH_H
#define KR_EXACT_DISPATCH_H
#include "layout.h"
#include "math/isa.h"

/* Scalar functions of the closed-form solution, implemented in closed_form.c. If `own` is nonzero,
 * the solution is expressed in internal axes and units. */
typedef struct kr_exact_scalar {
    kr_status (*plan)(const kr_scene *scene, int own, kr_exact_form *exact);
    kr_state (*state)(const kr_exact_form *exact, double t);
    kr_status (*turning)(const kr_scene *scene, kr_turning_form *out);
} kr_exact_scalar;
/* The functions for the closed-form Bobenko-Suris map, implemented in map.c. */
typedef struct kr_exact_maps {
    kr_status (*plan)(const kr_scene *scene, double step, kr_exact_map_form *map);
    kr_state (*state)(const kr_exact_map_form *map, int64_t k);
} kr_exact_maps;
/* Evaluates many states (batch_eval.c). */
typedef void kr_exact_evaluate(const kr_exact_form *exact, size_t n, const double t[],
                               kr_state out[]);
/* Arguments and results of a batch computation for n tops. If `plans` is not NULL, the closed-form
 * solutions are written to this array. The array `states` receives `times` consecutive states for
 * each top. If `own_times` is nonzero, the times of top i start at t[i * times]; otherwise all tops
 * share the same times. The array `status` receives the result of kr_exact_plan for each top. No
 * solution and no states are written for a top whose set-up fails. All results are bitwise equal to
 * those of kr_exact_plan and kr_exact_state. */
typedef struct kr_exact_request {
    size_t n;
    const kr_scene *scenes;
    kr_exact_form *plans;
    size_t times;
    const double *t;
    int own_times;
    kr_state *states;
    kr_status *status;
} kr_exact_request;
/* Processes a request (batch_setup.c). The argument `one` contains scalar functions for tops that
 * the SIMD code cannot process. */
typedef void kr_exact_batch(const kr_exact_scalar *one, const kr_exact_request *request);
typedef struct kr_exact_batch_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_exact_scalar *scalar;
    kr_exact_batch *batch; /* NULL: without batches */
} kr_exact_batch_isa;
/* Returns the i-th instruction set of the batch code, starting with the widest, or NULL after the
 * last one. */
const kr_exact_batch_isa *kr_exact_batch_isa_at(int i);
/* Performs a batch computation with the widest instruction set that this processor supports. */
void kr_exact_run(const kr_exact_request *request);

extern const kr_exact_scalar kr_exact_scalar_base, kr_exact_scalar_avx2;
extern const kr_exact_maps kr_exact_maps_base, kr_exact_maps_avx2;
kr_exact_batch kr_exact_batch_base, kr_exact_batch_avx2, kr_exact_batch_avx512;
kr_exact_evaluate kr_exact_evaluate_base, kr_exact_evaluate_avx2, kr_exact_evaluate_avx512;

typedef struct kr_exact_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_exact_scalar *scalar;
    kr_exact_evaluate *evaluate; /* NULL: without batches */
} kr_exact_isa;
/* Returns the i-th instruction set in the build, starting with the widest, or NULL after the last
 * one. */
const kr_exact_isa *kr_exact_isa_at(int i);
/* Equivalents of kr_exact_state and kr_exact_states for a kr_exact_form. */
kr_state kr_exact_form_state(const kr_exact_form *form, double t);
void kr_exact_form_states(const kr_exact_form *form, size_t n, const double t[], kr_state out[]);
/* Computes the closed-form solution for the method `exact`, in internal axes and units. */
kr_status kr_exact_plan_own_units(const kr_scene *scene, kr_exact_form *exact);
/* Returns 0 if the initial tilt and velocity of the axis are not both zero, but too small for the
 * closed-form solution. The time that an upright top takes to fall depends on the logarithm of its
 * initial tilt. The fourth power of the tilt underflows if the tilt is below 1e-77. */
int kr_exact_resolves(const kr_scene *scene);
/* Returns an upper bound on the number of doubles that the method `exact` stores in addition to a
 * kr_exact_form. */
size_t kr_exact_extra_doubles(void);
#endif
