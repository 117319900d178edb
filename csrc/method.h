/* The interface of a method. A method is one file in methods/ and one line in methods.def. It steps
 * a motion: the top in working axes and own units. The driver handles everything else: the user's
 * frame, units and clock, requested times, limits, finiteness, interruption, and the last good
 * state. */
#ifndef KR_METHOD_H
#define KR_METHOD_H
#include "math/su2_dd.h"

/* Working axes are principal; T lies along the odd axis of a symmetric body, else B along that of
 * the middle moment. Units are powers of two in which the largest moment and the top's rate are
 * about one; for KR_METHOD_ABSOLUTE the unit of time is the user's. */
typedef struct kr_motion {
    kr_vec3 inertia;
    kr_vec3 lever;    /* mass * gravity * centre of mass: the torque is e3 x (q lever q*) */
    kr_vec3 damping;  /* torque -damping W in the body, for KR_METHOD_DAMPED methods; else 0 */
    double step, tol; /* from the config; tol 0: the method's default */
    double clock;     /* time since the start; used by adaptive methods only */
    kr_stats stats;
    /* The method's memory: method->work doubles, no pointers, in the main motion on a multiple of
     * 64 bytes. */
    double *work;
    /* Memory other than doubles: a kernel, or memory of another library. `release` frees it. */
    void *aux;
    /* Nonzero for KR_METHOD_SKIPS_HEADING methods: q and m are known up to one rotation about the
     * vertical. */
    int skip_heading;
    /* Digits for KR_METHOD_DIGITS methods; 0: use `tol`. Above 16, lever_low holds the low words of
     * the lever. `low` holds those of the start at `reset`, whose momentum is then seen from the
     * body, and those of the clock and the result of `at`. */
    int digits;
    kr_vec3 lever_low;
    kr_state low;
    /* The user's scene with its last start, for closed forms, which must not round on the way to
     * own units. */
    const kr_scene *scene;
} kr_motion;

/* The last step of a dense method as a polynomial in tau = (clock - begin) * rate, 0 <= tau <=
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
    /* Computes c += a b up to coefficient `order`, and possibly some more. Zeros must stand before
     * b and behind all arrays. */
    void (*product)(const double *a, const double *b, int order, double *c);
} kr_step_polynomial;

/* Deviations from a motion, in working axes and own units: a rotation vector in the body, and a
 * change of the momentum in space. A seed is an initial deviation, with the derivatives of the
 * lever and of the moments (xx, yy, zz, yz, zx, xy) by its parameter. Deviations never change the
 * motion, except that a strongly damped one is restricted to short steps. */
typedef struct kr_deviation {
    vec_dd turn, push;
} kr_deviation;
typedef struct kr_seed {
    kr_deviation at_start;
    vec_dd lever;
    double moments[6];
} kr_seed;
/* Functions of a method that propagate deviations. */
typedef struct kr_tangent_ops {
    /* Returns the doubles that n deviations take, in multiples of 64 bytes. */
    size_t (*doubles)(int digits, size_t n);
    /* Starts n deviations at the current state. The memory holds zeros. */
    void (*begin)(const kr_motion *motion, double *memory, size_t n, const kr_seed seeds[]);
    /* Propagates the deviations over the last step. Returns KR_ERR_TANGENT if one exceeds the range
     * of doubles. */
    kr_status (*advance)(const kr_motion *motion, double *memory, size_t n);
    /* Writes the deviations at `clock` inside the last step; motion->low.t holds its low word. */
    void (*evaluate)(kr_motion *motion, double clock, double *memory, size_t n, kr_deviation out[]);
    /* Returns the largest last term of a series so far, relative to its deviation. */
    double (*truncation)(const kr_motion *motion, double *memory);
} kr_tangent_ops;

struct kr_method {
    const char *name, *text, *conserves, *reference;
    int order;
    unsigned flags; /* without KR_METHOD_DENSE, which follows from `at` */
    size_t work;
    /* Returns the doubles that a scene needs behind `work`. Checkpoints omit them: `reset` at the
     * start of the scene computes them. NULL: none. */
    size_t (*extra_doubles)(const kr_scene *scene);
    /* Starts the motion at a state (q, m; its t is ignored). A dense method that fails leaves
     * `work` and `aux` unchanged. */
    kr_status (*reset)(kr_motion *motion, const kr_state *start);
    /* Makes one step of motion->step, or one of an adaptive method's choice that ends at clock =
     * `until` at the latest. A dense method may pass `until`. It checks that its state is finite,
     * and leaves the motion unchanged on failure. */
    kr_status (*step)(kr_motion *motion, double until);
    /* Writes q and m after the last step; q has unit length. Does not change the motion. */
    void (*read)(const kr_motion *motion, kr_state *s);
    /* Writes q and m at `clock` inside the last step. NULL: the method is not dense. */
    void (*at)(kr_motion *motion, double clock, kr_state *s);
    /* Returns the last step as a polynomial. NULL: not available. */
    kr_step_polynomial (*polynomial)(const kr_motion *motion);
    /* Propagation of deviations, for KR_METHOD_TANGENTS. */
    const kr_tangent_ops *tangents;
    /* Returns 1 if all numbers in `work` that count, index or bound a loop are in range, as those
     * of a damaged checkpoint may not be. NULL: there are none. */
    int (*is_valid)(const void *work);
    /* Frees `aux`. May be NULL. */
    void (*release)(kr_motion *motion);
    /* Returns the name of the kernel in use and writes its order. May be NULL. */
    const char *(*kernel)(const kr_motion *motion, int *order);
};

/* Methods that other files than driver/method_table.c name. */
extern const kr_method kr_method_bobenko_suris, kr_method_exact, kr_method_taylor;

/* Returns the torque at attitude q: e3 x (q lever q*). */
static inline kr_vec3 motion_torque(const kr_motion *motion, kr_quat q)
{
    const kr_vec3 a = q_turn(q, motion->lever);
    return v3(-a.y, a.x, 0.0);
}
#endif
