/* What a method is: how to step. One method = one file in methods/ and one line in
 * methods.def. A method sees a run: the top in its working axes and own units. Everything above
 * that - the user's frame, his units and clock, landing, limits, finiteness, interruption, the last
 * good state - belongs to the driver (top.c). */
#ifndef KR_METHOD_H
#define KR_METHOD_H
#include "numbers/su2.h"

typedef struct kr_motion {
    /* Working axes: principal; T along the odd axis of a symmetric body, else B along that of the
     * middle moment. Units: powers of two in which the largest moment and the top's rate are about
     * one (KR_ABSOLUTE: the user's time). */
    kr_vec3 inertia;
    kr_vec3 lever;    /* mass * gravity * centre of mass: the torque is e3 x (q lever q*) */
    double step, tol; /* from the config; tol 0: the method's own */
    double clock;     /* time since the start; kept by adaptive methods only */
    /* KR_HEADLESS only: q and m up to a turn about the vertical, the same for both */
    int leave_heading;
    /* KR_DIGITS only, 0: as `tol` says. Above 16 also what doubles leave out: */
    int digits;
    kr_vec3 lever_low; /* of the lever, */
    /* of the start at `reset`; of the clock at `at`, and of the state that it gives */
    kr_state low;
    kr_stats stats;
    /* the user's, as it was last set: for what must not lose a bit on the way to own units */
    const kr_scene *scene;
    /* the method's, too, but no number: what another library keeps, a kernel; freed by `done` */
    void *aux;
    /* the method's memory: method->work doubles, no pointers; the main run's on a multiple of 64
     * bytes */
    double *work;
} kr_motion;

/* The last step of a method that has one: a polynomial in tau = (clock - begin) * rate, up to tau =
 * span. */
enum { KR_PIECE_MOST = 40 };
typedef struct kr_piece {
    int order; /* at most KR_PIECE_MOST */
    /* coefficients of (q | 0, P) and (0, W): attitude, vertical in the body, */
    const double (*x)[8], (*w)[4];
    /* angular velocity there over `rate`, less than 1; their values at the end */
    double end_x[8], end_w[4];
    double rate, begin, end, span; /* begin, end: clocks */
    /* c += a b, up to number `order` and somewhat further; zeros before b and after all three. */
    void (*product)(const double *a, const double *b, int order, double *c);
} kr_piece;

struct kr_method {
    const char *name, *text, *conserves, *reference;
    int order;
    unsigned flags;
    size_t work;
    /* Begin anew at a state (q, m; its t is not used): at the start, and whenever the state is
     * set. */
    kr_status (*reset)(kr_motion *motion, const kr_state *start);
    /* One step: of run->step, or of an adaptive method's own choice, which ends at clock = until
     * where that comes first. A KR_DENSE one may pass `until`; it sees to finiteness itself and
     * leaves the run as it was where it fails. */
    kr_status (*step)(kr_motion *motion, double until);
    /* q and m after the last step; q of unit length. Changes nothing. */
    void (*read)(const kr_motion *motion, kr_state *s);
    /* KR_DENSE only: the same at a clock inside the last step. */
    void (*at)(kr_motion *motion, double clock, kr_state *s);
    kr_piece (*piece)(const kr_motion *motion); /* KR_DENSE only; NULL: it has none */
    void (*done)(kr_motion *motion);            /* give back aux; may be NULL */
    /* that the run uses, and its order; may be NULL */
    const char *(*kernel)(const kr_motion *motion, int *order);
};

#define X(id) extern const kr_method kr_method_##id;
#include "methods.def"
#undef X

static inline kr_vec3 motion_torque(const kr_motion *motion, kr_quat q)
{
    const kr_vec3 a = q_turn(q, motion->lever);
    return v3(-a.y, a.x, 0.0);
}
#endif
