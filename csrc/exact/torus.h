/* Closed-form solutions for tops whose motion lies on an invariant torus (Kowalewski,
 * Goryachev-Chaplygin). The two angles that parametrize the torus grow at constant rates. A
 * structure of fixed size, called a plan, stores the data of a closed-form solution. This structure
 * begins with the members declared in kreisel.h and ends with the coefficients of the series. The
 * set-up of a closed-form solution needs working memory, which is placed directly after its plan.
 * */
#ifndef KR_EXACT_TORUS_H
#define KR_EXACT_TORUS_H
#include "layout.h"
#include "math/isa.h"

/* Members common to the solutions of Kowalewski and Goryachev-Chaplygin tops. */
typedef struct kr_torus {
    double begin;    /* [T] */
    double momentum; /* unit of momentum [M L^2 T^-1] */
    kr_quat frame;   /* frame of description -> axes of the closed form */
    /* Half of each torus angle and, for a Kowalewski top, the phase of the complex factor e. For
     * other tops, the third phase is zero. */
    kr_phase turn[3];
} kr_torus;

/* A tenth of the largest rounding error of a state within 300 radians, in random and degenerate
 * motions. No certificate is smaller. */
#define KR_TORUS_ROUNDING 0x1p-48

/* Functions that set up a single solution and evaluate a single state. If `own` is nonzero, the
 * solution is expressed in internal axes and units. For the argument `bound`, see
 * kr_kowalewski_plan. */
typedef struct kr_torus_scalar {
    size_t memory_size; /* of the plan and its set-up, in bytes */
    kr_status (*plan)(const kr_scene *scene, int own, double bound, void *memory);
    kr_state (*state)(const void *plan, double t);
    /* Returns the state for two given torus angles, like kr_kowalewski_state_at. */
    kr_state (*state_at)(const void *plan, double first, double second);
} kr_torus_scalar;
/* Evaluates many states with vector instructions. */
typedef void kr_torus_evaluate(const void *plan, size_t n, const double t[], kr_state out[]);
typedef struct kr_torus_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_torus_scalar *scalar;
    kr_torus_evaluate *evaluate; /* NULL: without batches */
} kr_torus_isa;
typedef struct kr_torus_form {
    kr_kind kind;                   /* of the body */
    double bound;                   /* the default bound of the certificate */
    size_t plan_size, torus_offset; /* of a plan, and of the kr_torus in a plan, in bytes */
    /* Returns 1 if the closed-form solution applies to the initial state of a checked scene with a
     * body of this kind. The function pointer is NULL if the solution applies to all initial
     * states. */
    int (*suits)(const kr_scene *scene);
    /* Returns the size in bytes of the used part of a plan, which is all that must be copied to
     * copy the plan. */
    size_t (*used_size)(const void *plan);
    /* The instruction sets in the build, starting with the widest. The table ends with a NULL
     * name. */
    kr_torus_isa isas[4];
} kr_torus_form;
extern const kr_torus_form kr_kowalewski_form, kr_chaplygin_form;

extern const kr_torus_scalar kr_kowalewski_scalar_base, kr_kowalewski_scalar_avx2;
extern const kr_torus_scalar kr_chaplygin_scalar_base, kr_chaplygin_scalar_avx2;
kr_torus_evaluate kr_kowalewski_evaluate_base, kr_kowalewski_evaluate_avx2,
    kr_kowalewski_evaluate_avx512;
kr_torus_evaluate kr_chaplygin_evaluate_base, kr_chaplygin_evaluate_avx2,
    kr_chaplygin_evaluate_avx512;

/* Returns the widest instruction set in form->isas that the processor supports. The last
 * instruction set in the table is supported by every processor. */
static inline const kr_torus_isa *kr_torus_widest_isa(const kr_torus_form *form)
{
    const kr_torus_isa *isa = form->isas;
    while (!isa->runs_here()) isa++; /* untaken: if the first one runs */
    return isa;
}
/* Writes n states of a closed-form solution, faster than kr_torus_scalar but with bitwise equal
 * results. */
static inline void kr_torus_states(const kr_torus_form *form, const void *plan, size_t n,
                                   const double t[], kr_state out[])
{
    const kr_torus_isa *isa = kr_torus_widest_isa(form);
#ifdef KR_NO_BATCHES
    for (size_t i = 0; i < n; i++) out[i] = isa->scalar->state(plan, t[i]);
#else
    isa->evaluate(plan, n, t, out);
#endif
}
/* Returns 1 if the initial vertical momentum of a validated scene is zero. */
int kr_chaplygin_is_level(const kr_scene *scene);
#endif
