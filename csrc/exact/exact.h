/* Types and functions of closed-form solutions. The constants that describe one motion in closed
 * form are called its plan: a kr_exact_form, or a structure that begins with a kr_torus (torus.h).
 * The functions are compiled for each instruction set, and exact.c selects a set at run time. All
 * sets give equal bits, because fused multiply-add is used only to compute exact products. */
#ifndef KR_EXACT_EXACT_H
#define KR_EXACT_EXACT_H
#include <stddef.h>
#include "kreisel.h"
#include "math/isa.h"

/* A theta function of x + i y for constant y: the coefficients of two polynomials in sin^2 x, which
 * are factors of its real (even) and imaginary (odd) part (make_theta_series in lagrange.h). */
enum { KR_THETA_TERMS = 5 };
typedef struct kr_theta {
    double even[KR_THETA_TERMS], odd[KR_THETA_TERMS];
} kr_theta;
/* A phase that grows at the constant rate fast + slow [turns per unit of time] from the initial
 * value start + more [turns]. Each of these sums is a double-double. */
typedef struct kr_phase {
    double fast, slow, start, more;
} kr_phase;

/* The plan of a Lagrange top or a free body (symbols: kernel.h), with only doubles as members. */
typedef struct kr_exact_form {
    double period, precession_rate, spin_angle_rate; /* as in kr_exact_info */
    double begin;                                    /* initial time [T] */
    double curve;                                    /* the kind of the series (kernel.h) */
    kr_phase nutation, first, second;
    /* For series in the dual nome: stretch + stretch_rest, a double-double, is pi K / K' or, for
     * torque-free bodies, pi K / (2 K'). For `slope`, see evaluate_theta_series (kernel.h). */
    double stretch, stretch_rest, slope[2];
    kr_theta alpha, beta, horizontal;
    double momentum, side; /* scale of the horizontal momentum; -1 if up and down are exchanged */
    kr_vec3 constant;      /* the constant part of the momentum */
    double framed;         /* 1 if `frame` is set */
    kr_quat frame[4];      /* linear map of attitudes (apply_quaternion_map) */
} kr_exact_form;
/* Stops the compilation if the condition is false, by an array type of negative size. */
#define KR_CHECK_LAYOUT(name, condition) typedef char name[(condition) ? 1 : -1]
/* The functions for one of the four types of closed forms: of Lagrange tops and free bodies
 * (symmetric.c), of Kowalewski tops, of Goryachev-Chaplygin tops, or of free gyrostats. */
typedef struct kr_exact_scalar {
    size_t plan_size, memory_size; /* bytes of a plan, and of `memory` in its set-up */
    /* Returns the size of the used part of a plan in bytes. A copy of this part is a plan, too. */
    size_t (*used_size)(const void *plan);
    /* Returns 1 if the closed form applies to a valid scene of its kind. NULL: it always does. */
    int (*suits)(const kr_scene *scene);
    /* Writes the plan to the start of `memory`, and the members of `info` that this form has, but
     * not `kind` and `used`. If `own`, the plan is in internal axes and units (method.h), else in
     * the user's. `bound` limits info->certificate. For `state_at`, see kr_exact_state_at. */
    kr_status (*plan)(const kr_scene *scene, int own, double bound, void *memory,
                      kr_exact_info *info);
    kr_state (*state)(const void *plan, double t);
    kr_state (*state_at)(const void *plan, double first, double second); /* NULL: no torus */
} kr_exact_scalar;
/* Writes the states at n times t, which are bitwise equal to those of kr_exact_scalar.state. */
typedef void kr_exact_evaluate(const void *plan, size_t n, const double t[], kr_state out[]);
/* A closed form for one instruction set. */
typedef struct kr_exact_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_exact_scalar *scalar;
    kr_exact_evaluate *evaluate; /* NULL: without batches */
} kr_exact_isa;
/* The implementations of a type of closed form, one for each instruction set of the build, the
 * widest first. The last one runs on every processor. Empty elements follow it. */
enum { KR_EXACT_ISAS = 4 };
extern const kr_exact_isa kr_symmetric_form[KR_EXACT_ISAS], kr_kowalewski_form[KR_EXACT_ISAS],
    kr_chaplygin_form[KR_EXACT_ISAS], kr_gyrostat_form[KR_EXACT_ISAS];
/* Returns the implementations of the closed form for a kind of top, or NULL. */
const kr_exact_isa *kr_closed_form_of(kr_kind kind);
/* Returns the element of `form` for the widest instruction set that the processor supports. */
const kr_exact_isa *kr_exact_widest_isa(const kr_exact_isa form[]);
/* Writes the n states of a plan at the times t. */
void kr_exact_evaluate_widest(const kr_exact_isa *isa, const void *plan, size_t n, const double t[],
                              kr_state out[]);
/* Writes the extreme nutation angles and the other members of kr_nutation (symmetric.c). */
typedef kr_status kr_exact_limits(const kr_scene *scene, kr_nutation *out);
/* A batch of n tops, computed with the element `isa` of kr_symmetric_form. For each top, `states`
 * receives `times` consecutive states, `status` the result of kr_exact_plan and, if `plans` is not
 * NULL, `plans` the closed form. For a top without a closed form, only its status is written. If
 * `own_times` is nonzero, the times of top i start at t[i * times]; otherwise all tops share the
 * first `times` elements of t. All results have the bits of kr_exact_plan and kr_exact_state. */
typedef struct kr_exact_request {
    const kr_exact_isa *isa;
    size_t n;
    const kr_scene *scenes;
    kr_exact_form *plans;
    size_t times;
    const double *t;
    int own_times;
    kr_state *states;
    kr_status *status;
} kr_exact_request;
static inline const double *kr_exact_times_of(const kr_exact_request *request, size_t top)
{
    return request->own_times ? request->t + top * request->times : request->t;
}
void kr_exact_run(const kr_exact_request *request);
/* Computes one top of a batch without vectors of tops. */
void kr_exact_run_top(const kr_exact_request *request, size_t top);
/* Computes a batch with vectors of tops (batch_setup.c). */
typedef void kr_exact_batch(const kr_exact_request *request);

extern const kr_exact_scalar kr_exact_scalar_base, kr_exact_scalar_avx2, kr_kowalewski_scalar_base,
    kr_kowalewski_scalar_avx2, kr_chaplygin_scalar_base, kr_chaplygin_scalar_avx2,
    kr_gyrostat_scalar_base, kr_gyrostat_scalar_avx2;
kr_exact_batch kr_exact_batch_base, kr_exact_batch_avx2, kr_exact_batch_avx512;
kr_exact_limits kr_exact_limits_base, kr_exact_limits_avx2;
kr_exact_evaluate kr_exact_evaluate_base, kr_exact_evaluate_avx2, kr_exact_evaluate_avx512,
    kr_kowalewski_evaluate_base, kr_kowalewski_evaluate_avx2, kr_kowalewski_evaluate_avx512,
    kr_chaplygin_evaluate_base, kr_chaplygin_evaluate_avx2, kr_chaplygin_evaluate_avx512,
    kr_gyrostat_evaluate_base, kr_gyrostat_evaluate_avx2, kr_gyrostat_evaluate_avx512;
/* Returns the largest number of doubles that the method `exact` needs for a top, in addition to
 * kr_method.work. If `with_torus` is 0, only tops with a kr_exact_form are considered. */
size_t kr_exact_extra_doubles(int with_torus);
#endif
