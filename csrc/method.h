/* What a method is: how to step. One method is one file in methods/ and one line in methods.def. A
 * method sees a motion: the top in its working axes and own units. Everything above that - the
 * user's frame, his units and clock, landing, limits, finiteness, interruption, the last good state
 * - belongs to the driver. */
#ifndef KR_METHOD_H
#define KR_METHOD_H
#include "math/su2_dd.h"

/* Working axes are principal; T lies along the odd axis of a symmetric body, else B along that of
 * the middle moment. Units are powers of two in which the largest moment and the top's rate are
 * about one; for KR_ABSOLUTE the unit of time is the user's. */
typedef struct kr_motion {
    kr_vec3 inertia;
    kr_vec3 lever;    /* mass * gravity * centre of mass: the torque is e3 x (q lever q*) */
    kr_vec3 damping;  /* and -damping W in the body, for KR_DAMPED methods; 0 for all others */
    double step, tol; /* from the config; tol 0: the method's own */
    double clock;     /* time since the start; kept by adaptive methods only */
    kr_stats stats;
    /* The method's memory: method->work doubles, no pointers, in the main motion on a multiple of
     * 64 bytes. */
    double *work;
    /* What the method keeps beside numbers: another library's memory, a kernel. `done` frees it. */
    void *aux;
    /* KR_HEADLESS methods give q and m up to a turn about the vertical, the same for both. */
    int skip_heading;
    /* KR_DIGITS methods go by these where they are not 0, instead of by tol. Above 16 they add what
     * doubles leave out: of the lever; in `low` of the start at `reset`, whose momentum is then
     * that seen from the body; of the clock at `at`, and there of the state that it gives. */
    int digits;
    kr_vec3 lever_low;
    kr_state low;
    /* The user's scene as it was last set, for a closed form, which must not lose a bit on the way
     * to own units. */
    const kr_scene *scene;
} kr_motion;

/* The last step of a method that has one: a polynomial in tau = (clock - begin) * rate, up to tau =
 * span. */
enum { KR_POLYNOMIAL_ORDER_MAX = 40 };
typedef struct kr_step_polynomial {
    int order; /* at most KR_POLYNOMIAL_ORDER_MAX */
    /* Coefficients of (q | 0, P) and of (0, W): the attitude, the vertical seen from the body, and
     * the angular velocity there over `rate`, which is less than 1. */
    const double (*x)[8], (*w)[4];
    double end_x[8], end_w[4]; /* their values at the end */
    double rate, span;
    double begin, end; /* clocks */
    /* c += a b, up to number `order` and somewhat further; zeros stand before b and after all. */
    void (*product)(const double *a, const double *b, int order, double *c);
} kr_step_polynomial;

/* Deviations that ride along with a motion, in working axes and own units: a rotation vector in the
 * body and a change of the momentum, seen from space. A seed is what one begins with, and how a
 * parameter that it is the derivative by changes the lever and the moments (xx, yy, zz, yz, zx,
 * xy). They never change the motion, except that a strongly damped one keeps to short steps. */
typedef struct kr_deviation {
    vec_dd turn, push;
} kr_deviation;
typedef struct kr_seed {
    kr_deviation at_start;
    vec_dd lever;
    double moments[6];
} kr_seed;
typedef struct kr_tangent_ops {
    /* The doubles that n deviations take, on a multiple of 64 bytes. */
    size_t (*doubles)(int digits, size_t n);
    /* Begins n deviations where the motion stands, of zeros. */
    void (*begin)(const kr_motion *motion, double *memory, size_t n, const kr_seed seeds[]);
    /* Takes them over the step that the motion has just made. KR_ERR_TANGENT where one grows beyond
     * doubles. */
    kr_status (*advance)(const kr_motion *motion, double *memory, size_t n);
    /* Gives them at a clock inside the last step, and of the clock what `low` of the motion says.
       */
    void (*evaluate)(kr_motion *motion, double clock, double *memory, size_t n, kr_deviation out[]);
    /* The largest last term of a series so far, over the size of its deviation. */
    double (*truncation)(const kr_motion *motion, double *memory);
} kr_tangent_ops;

struct kr_method {
    const char *name, *text, *conserves, *reference;
    int order;
    unsigned flags; /* without KR_DENSE, which follows from `at` */
    size_t work;
    /* The doubles that a scene needs behind `work`. They are no part of a checkpoint: `reset` at a
     * scene's start makes them. NULL: none. */
    size_t (*extra_doubles)(const kr_scene *scene);
    /* Begins anew at a state (q, m; its t is not used): at the start, and whenever the state is
     * set. A dense method that refuses leaves work and aux as they were. */
    kr_status (*reset)(kr_motion *motion, const kr_state *start);
    /* Makes one step: of motion->step, or of an adaptive method's own choice, which ends at clock =
     * until where that comes first. A dense method may pass `until`; it sees to finiteness itself
     * and leaves the motion as it was where it fails. */
    kr_status (*step)(kr_motion *motion, double until);
    /* Gives q and m after the last step, q of unit length. Changes nothing. */
    void (*read)(const kr_motion *motion, kr_state *s);
    /* Gives q and m at a clock inside the last step. NULL: the method is not dense. */
    void (*at)(kr_motion *motion, double clock, kr_state *s);
    /* Gives the last step of a dense method as a polynomial. NULL: it has none. */
    kr_step_polynomial (*polynomial)(const kr_motion *motion);
    /* How deviations ride along, for KR_TANGENTS. */
    const kr_tangent_ops *tangents;
    /* Says whether the numbers in work that count, index or loop are in their ranges, which those
     * of a checkpoint need not be. NULL: there are none. */
    int (*is_valid)(const void *work);
    /* Gives back aux. May be NULL. */
    void (*release)(kr_motion *motion);
    /* Names the kernel in use, and its order. May be NULL. */
    const char *(*kernel)(const kr_motion *motion, int *order);
};

/* Those that others than the table (driver/method_table.c) know by name. */
extern const kr_method kr_method_bobenko_suris, kr_method_exact, kr_method_taylor;

/* The torque at an attitude: e3 x (q lever q*). */
static inline kr_vec3 motion_torque(const kr_motion *motion, kr_quat q)
{
    const kr_vec3 a = q_turn(q, motion->lever);
    return v3(-a.y, a.x, 0.0);
}
#endif
