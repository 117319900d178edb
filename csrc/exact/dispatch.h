/* Parts of the closed form that each instruction set compiles; dispatch.c chooses at run time. All
 * instruction sets have the same bits: only two_product uses fused multiply-add, and it is exact
 * either way. */
#ifndef KR_EXACT_DISPATCH_H
#define KR_EXACT_DISPATCH_H
#include "kreisel.h"
#include "math/isa.h"

/* Functions of closed_form.c: set up one scene, evaluate one state, find the turning points. If
 * `own` is nonzero, the closed form stays in working axes and own units and begins at time 0. */
typedef struct kr_exact_scalar {
    kr_status (*plan)(const kr_scene *scene, int own, kr_exact *exact);
    kr_state (*state)(const kr_exact *exact, double t);
    kr_status (*turning)(const kr_scene *scene, kr_turning *out);
} kr_exact_scalar;
/* Functions of map.c: the same for the Bobenko-Suris map. */
typedef struct kr_exact_maps {
    kr_status (*plan)(const kr_scene *scene, double step, kr_exact_map *map);
    kr_state (*state)(const kr_exact_map *map, int64_t k);
} kr_exact_maps;
/* Evaluates many states (batch_eval.c). */
typedef void kr_exact_evaluate(const kr_exact *exact, size_t n, const double t[], kr_state out[]);
/* A request for many tops. `plans`, if not NULL, gets their closed forms. `states` gets their
 * states at `times` times, if that is not 0: at t[0], t[1], ... or, with `own_times`, at t[i times]
 * and on for top i. The states of top i begin at states[i times]. `status` gets the result of
 * kr_exact_plan for each top; nothing else is written for a refused top. All bits are those of
 * kr_exact_plan and kr_exact_state. */
typedef struct kr_exact_request {
    size_t n;
    const kr_scene *scenes;
    kr_exact *plans;
    size_t times;
    const double *t;
    int own_times;
    kr_state *states;
    kr_status *status;
} kr_exact_request;
/* Processes a request (batch_setup.c); `one` handles tops one by one. */
typedef void kr_exact_batch(const kr_exact_scalar *one, const kr_exact_request *request);
typedef struct kr_exact_batch_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_exact_scalar *scalar;
    kr_exact_batch *batch;
} kr_exact_batch_isa;
/* Returns the i-th instruction set that batches were compiled for, the widest first; NULL beyond
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
    kr_exact_evaluate *evaluate;
} kr_exact_isa;
/* Returns the i-th instruction set that was compiled in, the widest first; NULL beyond the last. */
const kr_exact_isa *kr_exact_isa_at(int i);
/* Computes the closed form in working axes and own units from time 0, for the method `exact`. */
kr_status kr_exact_plan_own_units(const kr_scene *scene, kr_exact *exact);
/* Returns 1 if the closed form of a checked scene resolves the tilt and motion of the axis at the
 * start. From an unstable upright start, the time of the fall depends on the logarithm of the tilt,
 * whose fourth power underflows below 1e-77. */
int kr_exact_resolves(const kr_scene *scene);
/* Returns the kind of a top whose closed form is a plan in memory of its own, a Kowalewski or a
 * Goryachev-Chaplygin top under gravity, else KR_KIND_GENERAL; the scene was checked. */
kr_kind kr_exact_torus(const kr_scene *scene);
/* Returns the doubles that the method `exact` needs behind its work for such a scene. */
size_t kr_exact_extra_doubles(void);
#endif
