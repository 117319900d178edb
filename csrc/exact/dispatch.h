/* What of the closed form is compiled once per instruction set, and chosen when it runs
 * (dispatch.c). Every instruction set gives the same bits: none fuses a product and a sum
 * but in two_product, which is exact either way. */
#ifndef KR_EXACT_DISPATCH_H
#define KR_EXACT_DISPATCH_H
#include "kreisel.h"
#include "math/isa.h"

/* closed_form.c makes these: they set one scene up, read one state, and
 * find the turning points. Where `own` is not 0, the
 * closed form stays in working axes and own units and begins at time 0. */
typedef struct kr_exact_scalar {
    kr_status (*plan)(const kr_scene *scene, int own, kr_exact *exact);
    kr_state (*state)(const kr_exact *exact, double t);
    kr_status (*turning)(const kr_scene *scene, kr_turning *out);
} kr_exact_scalar;
/* map.c makes these: they do for the Bobenko-Suris map what kr_exact_scalar does for the motion. */
typedef struct kr_exact_maps {
    kr_status (*plan)(const kr_scene *scene, double step, kr_exact_map *map);
    kr_state (*state)(const kr_exact_map *map, int64_t k);
} kr_exact_maps;
/* batch_eval.c makes these: they read the states at many times at once. */
typedef void kr_exact_evaluate(const kr_exact *exact, size_t n, const double t[], kr_state out[]);
/* What is asked of many tops: the closed form of each, where `plans` is not NULL, and its states at
 * `times` times, where that is not 0: at t[0], t[1], ... or, with `own_times`, the i-th top's at
 * t[i times] and on. Its states begin at states[i times]; `status` says what kr_exact_plan says of
 * each. Of a top that it refuses nothing is written but that. Every top gets the bits that
 * kr_exact_plan and kr_exact_state give it, whatever the others are. */
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
/* batch_setup.c makes these; `one` is what plans one top alone. */
typedef void kr_exact_batch(const kr_exact_scalar *one, const kr_exact_request *asked);
typedef struct kr_exact_batch_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_exact_scalar *scalar;
    kr_exact_batch *batch;
} kr_exact_batch_isa;
/* Returns the i-th instruction set for which many tops were compiled, the widest first; NULL beyond
 * the last. */
const kr_exact_batch_isa *kr_exact_batch_isa_at(int i);
/* Does what is asked, by the widest that runs here. */
void kr_exact_run(const kr_exact_request *asked);

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
/* Sets the closed form up in working axes and own units from time 0, for the method `exact`. */
kr_status kr_exact_plan_own_units(const kr_scene *scene, kr_exact *exact);
/* Whether the closed form of a checked scene tells how the axis leans and moves at the start. From
 * an upright start that is unstable the motion falls after a time that goes as the logarithm of the
 * lean, whose fourth power underflows below 1e-77. */
int kr_exact_resolves(const kr_scene *scene);
/* Returns whether gravity acts on a Kowalewski top; the scene was checked. */
int kr_exact_is_kowalewski(const kr_scene *scene);
/* Returns the doubles that the method `exact` needs behind its work for such a scene. */
size_t kr_exact_extra_doubles(void);
#endif
