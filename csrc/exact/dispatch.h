/* Parts of the closed form that are compiled for each instruction set. dispatch.c chooses among
 * them at run time. All instruction sets give bitwise equal results, because only two_product uses
 * fused multiply-add, and its result is exact with and without it. */
#ifndef KR_EXACT_DISPATCH_H
#define KR_EXACT_DISPATCH_H
#include "layout.h"
#include "math/isa.h"

/* Functions of closed_form.c: set up one scene, evaluate one state, find the turning points. If
 * `own` is nonzero, the closed form stays in working axes and internal units and begins at time
 * 0. */
typedef struct kr_exact_scalar {
    kr_status (*plan)(const kr_scene *scene, int own, kr_exact_form *exact);
    kr_state (*state)(const kr_exact_form *exact, double t);
    kr_status (*turning)(const kr_scene *scene, kr_turning_form *out);
} kr_exact_scalar;
/* Functions of map.c for the closed form of the Bobenko-Suris map: set up one scene, evaluate one
 * state. */
typedef struct kr_exact_maps {
    kr_status (*plan)(const kr_scene *scene, double step, kr_exact_map_form *map);
    kr_state (*state)(const kr_exact_map_form *map, int64_t k);
} kr_exact_maps;
/* Evaluates many states (batch_eval.c). */
typedef void kr_exact_evaluate(const kr_exact_form *exact, size_t n, const double t[],
                               kr_state out[]);
/* A request for n tops. If `plans` is not NULL, it receives the closed forms of these tops.
 * `states` receives the states of each top at `times` times; those of top i begin at index i *
 * times. If `own_times` is zero, all tops have the times t[0], t[1], ... Otherwise the times of
 * top i begin at t[i * times]. `status` receives the result of kr_exact_plan for each top. Nothing
 * else is written for a refused top. All results are bitwise equal to those of kr_exact_plan and
 * kr_exact_state. */
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
/* Processes a request (batch_setup.c). `one` has the functions for tops that lanes cannot
 * handle. */
typedef void kr_exact_batch(const kr_exact_scalar *one, const kr_exact_request *request);
typedef struct kr_exact_batch_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_exact_scalar *scalar;
    kr_exact_batch *batch; /* NULL: without batches */
} kr_exact_batch_isa;
/* Returns the i-th instruction set that batches were compiled for, the widest first, or NULL after
 * the last. */
const kr_exact_batch_isa *kr_exact_batch_isa_at(int i);
/* Processes a request with the widest instruction set of this processor. */
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
/* Returns the i-th instruction set that was compiled in, the widest first, or NULL after the
 * last. */
const kr_exact_isa *kr_exact_isa_at(int i);
/* The functions of kreisel.h for a closed form in the memory of the library. */
kr_state kr_exact_form_state(const kr_exact_form *form, double t);
void kr_exact_form_states(const kr_exact_form *form, size_t n, const double t[], kr_state out[]);
/* Computes the closed form in working axes and internal units from time 0, for the method
 * `exact`. */
kr_status kr_exact_plan_own_units(const kr_scene *scene, kr_exact_form *exact);
/* Returns 1 if the closed form can resolve the tilt and the motion of the axis at the start of a
 * checked scene. From an unstable upright start, the time of the fall depends on the logarithm of
 * the tilt. The fourth power of the tilt underflows if the tilt is below 1e-77. */
int kr_exact_resolves(const kr_scene *scene);
/* Returns the largest number of doubles that the method `exact` needs after its kr_exact_form, for
 * a Kowalewski or a Goryachev-Chaplygin top. */
size_t kr_exact_extra_doubles(void);
#endif
