/* The parts of the closed-form solutions that are compiled for each instruction set. dispatch.c
 * selects one at run time. Results are bitwise equal for all instruction sets: only two_product
 * uses fused multiply-add, and its result is exact either way. */
#ifndef KR_EXACT_DISPATCH_H
#define KR_EXACT_DISPATCH_H
#include "layout.h"
#include "math/isa.h"

/* Functions of closed_form.c: set up the solution for a scene, evaluate a state, find the turning
 * points. If `own` is nonzero, the solution stays in working axes and internal units, with initial
 * time zero. */
typedef struct kr_exact_scalar {
    kr_status (*plan)(const kr_scene *scene, int own, kr_exact_form *exact);
    kr_state (*state)(const kr_exact_form *exact, double t);
    kr_status (*turning)(const kr_scene *scene, kr_turning_form *out);
} kr_exact_scalar;
/* Functions of map.c for the closed-form Bobenko-Suris map: set up the solution for a scene,
 * evaluate a state. */
typedef struct kr_exact_maps {
    kr_status (*plan)(const kr_scene *scene, double step, kr_exact_map_form *map);
    kr_state (*state)(const kr_exact_map_form *map, int64_t k);
} kr_exact_maps;
/* Evaluates many states (batch_eval.c). */
typedef void kr_exact_evaluate(const kr_exact_form *exact, size_t n, const double t[],
                               kr_state out[]);
/* A request for the states of n tops. If `plans` is not NULL, it receives the closed-form solutions
 * for these tops. `states` receives `times` states for each top; those of top i start at index i *
 * times. If `own_times` is zero, all tops share the times t[0], t[1], ... Otherwise the times of
 * top i start at t[i * times]. `status` receives the result of kr_exact_plan for each top. For a
 * refused top, nothing else is written. All results are bitwise equal to those of kr_exact_plan and
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
/* Processes a request (batch_setup.c). `one` contains the functions for tops that the vectorized
 * code cannot handle. */
typedef void kr_exact_batch(const kr_exact_scalar *one, const kr_exact_request *request);
typedef struct kr_exact_batch_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_exact_scalar *scalar;
    kr_exact_batch *batch; /* NULL: without batches */
} kr_exact_batch_isa;
/* Returns the i-th instruction set for which batches were compiled, widest first, or NULL after the
 * last one. */
const kr_exact_batch_isa *kr_exact_batch_isa_at(int i);
/* Processes a request with the widest instruction set that this processor supports. */
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
/* Returns the i-th instruction set that was compiled in, widest first, or NULL after the last
 * one. */
const kr_exact_isa *kr_exact_isa_at(int i);
/* The functions of kreisel.h for a closed-form solution stored in the library's memory. */
kr_state kr_exact_form_state(const kr_exact_form *form, double t);
void kr_exact_form_states(const kr_exact_form *form, size_t n, const double t[], kr_state out[]);
/* Computes the closed-form solution in working axes and internal units from time zero, for the
 * method `exact`. */
kr_status kr_exact_plan_own_units(const kr_scene *scene, kr_exact_form *exact);
/* Returns 1 if the closed-form solution can resolve the initial tilt and motion of the axis in a
 * validated scene. Near an unstable upright initial state, the time of the fall depends on the
 * logarithm of the tilt. The fourth power of the tilt underflows if the tilt is below 1e-77. */
int kr_exact_resolves(const kr_scene *scene);
/* Returns the largest number of doubles that the method `exact` stores after a kr_exact_form for a
 * Kowalewski or Goryachev-Chaplygin top. */
size_t kr_exact_extra_doubles(void);
#endif
