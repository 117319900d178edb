/* Taylor series of the motion of a heavy top. Private to taylor/.
 *     q' = q W / 2                q: attitude, body -> space, a unit quaternion
 *     P' = P x W                  P = q* e3 q: the vertical e3 in the body frame
 *     A W' = (AW + h) x W + P x c - D W    W: angular velocity in the body; A: moments of inertia;
 *                                          c: weight * center of mass; D: damping coefficients;
 *                                          h: angular momentum of a rotor fixed in the body
 * The right-hand sides consist of linear terms and of products of two unknowns. The Taylor
 * coefficients of q, P and W (q_n in q = sum q_n t^n) therefore satisfy, with sums over j = 0 to n:
 *     (n+1) q_{n+1} = 1/2 sum q_{n-j} W_j         (n+1) P_{n+1} = sum P_{n-j} x W_j
 *     (n+1) W_{n+1} = k * sum next(W_j) * prev(W_{n-j})  +  up * next(P_n)  +  down * prev(P_n)
 *                     +  drag * W_n
 *     with next(x,y,z) = (y,z,x), prev(x,y,z) = (z,x,y), the constants k, up, down and drag of
 *     kr_series, and the product * of vectors by components
 * The term h x W_n of the rotor costs no extra time, because it arises from constants added to
 * prev(W_0) and next(W_0) (kr_series.shift). If skip_heading (kreisel.h) is set, only the equations
 * for P and W are solved, with 9 instead of 21 sums of products per order. The integrals of the
 * motion are conserved only up to the tolerance. */
#ifndef KR_TAYLOR_H
#define KR_TAYLOR_H
#include "method.h"
#include "math/isa.h"

/* Constants for d = 20 and 30 digits (measured: docs/theory/taylor.md). The terms 0 to KR_HEAD_d
 * of a Taylor series are computed in double-double precision, the later ones up to KR_LAST_d in
 * double precision, as sums of products of earlier terms. A step is so short that the products are
 * at most 2^KR_LESS_d times the tolerance (2^-70 for d = 20; by default 2^-100 for d = 30). Their
 * rounding errors, 2^-53 times as large, are at most 2^-65 = 3e-20 (d = 20) and 2^-101 (d = 30). */
#define KR_HEAD_20 8
#define KR_LAST_20 28
#define KR_HEAD_30 20
#define KR_LAST_30 36
#define KR_LESS_20 58.0
#define KR_LESS_30 52.0
enum { KR_TAYLOR_MAX = KR_LAST_30 };
/* Replaces smaller |k| (kr_series) by which rotor terms are divided; negligible at 30 digits. */
#define KR_LEAST_FACTOR 0x1p-120

/* Taylor series of one step, from the time t to the time `end` (unit of time: 1 / kr_taylor.rate).
 * Access is fastest if the struct is aligned to 64 bytes. At 20 and 30 digits, two adjacent structs
 * hold the high and the low words of the double-double numbers. A vector of eight lanes, (q | P),
 * holds the attitude q and the pure quaternion P. With eight-lane vectors, P takes no extra time:
 * q u and P x u permute components in the same way for u = i, j, k (with other signs, and zeros).
 * If skip_heading (kreisel.h) is set, q is not computed, but zero. */
typedef struct kr_series {
    double x[KR_TAYLOR_MAX + 1][8]; /* coefficients of (q | P) */
    double end_x[8], at_x[8];       /* values at `end`, where the next step begins, and at `at` */
    double w[KR_TAYLOR_MAX + 1][4]; /* coefficients of W: (0, x, y, z) */
    double end_w[4], at_w[4];
    double k[4], up[4], down[4]; /* (Ay - Az) / Ax, cz / Ax, -cy / Ax; and cyclic permutations */
    double drag[4];              /* -Dx / Ax; and cyclic permutations */
    /* The terms of the rotor. shift[1] = -hz / (Ay - Az) is added to the x component of prev(W_0),
     * and shift[5] = hy / (Ay - Az) to the x component of next(W_0); and cyclic permutations. An
     * element whose component of h is 0 is -0, because a + -0 equals a, even for a = -0. */
    double shift[8];
    double t, end, at;
    double linear; /* linear terms in W: 0 none; 1 drag; 2 drag and those of series.h */
    double fall;   /* a deviation from an equilibrium grows by at most a factor e in this time */
    /* Support motion and friction (series.h) at the end of the last step, where the next begins:
     * `turn` is the angular velocity O of the support, `rub` the contribution of sliding friction
     * to W'. G is sway[3] + sway[0]. sway[0] and sway[1] are sway_most times cosine and sine of
     * the phase of the support's oscillation. sway[2] is the time derivative of the phase. */
    double turn[4], sway[4], rub[4];
    /* the apex (kreisel.h); (apex / A) / r with r = <apex / A, apex>; 1 / (r * friction) */
    double apex[4], yield[4], per_grip;
    double sway_most;          /* amplitude of the oscillating part of G, with sign */
    double turns, shakes;      /* nonzero if the support rotates; nonzero if it oscillates */
    double slides, holds;      /* nonzero if the top slides; nonzero if friction holds the top */
    double gradient, steep[4]; /* the gravity gradient; -gradient * k */
} kr_series;

/* State of the Taylor method for one motion. */
typedef struct kr_taylor {
    kr_series series[2]; /* high and low words */
    double log2_tol;
    double rate;         /* unit of time of the series = 1 / rate, in units of the motion */
    double first_rate;   /* initial rate; strong damping lowers `rate` (slow.h) */
    double has_tangents; /* nonzero if there are tangents; the slow manifold is then not used */
    double sliding;      /* sign of the spin while the top slides; 0 while dry friction holds it */
    double before_hold;  /* sign of the spin before friction held the top; 0 if held initially */
    double held_rate;    /* `rate` while large friction, which then does not count, holds the top */
    double try_slow;     /* clock before which the motion cannot reach the slow manifold (slow.h) */
    double settling;     /* sum of 2^i over the strongly damped axes i (slow.c) */
    double settled;      /* clock at which the transient about these axes has decayed */
    double unused[6];    /* the next struct is aligned to 64 bytes, too */
} kr_taylor;

static inline kr_taylor *taylor_of(const kr_motion *motion) { return (kr_taylor *)motion->work; }

/* Functions that compute steps of one Taylor order with one instruction set. */
typedef struct kr_kernel {
    int order;
    /* Computes the next step, which is as long as the tolerance 2^log2_tol permits. `direction` is
     * 1 forward in time, and -1 backward in time. */
    void (*advance)(kr_series *s, double log2_tol, double direction);
    /* Evaluates the series at the time `at`, and writes the values to at_x and at_w. */
    void (*evaluate)(kr_series *s);
} kr_kernel;

/* Functions that propagate tangents (tangents.h) with one instruction set. */
struct kr_tangent;
typedef void kr_tangents_expand(const kr_series *s, struct kr_tangent *tangents, size_t n,
                                int order);
typedef struct kr_tangents_kernel {
    /* Compute the Taylor coefficients of n tangents, or of n batches of tangents. */
    kr_tangents_expand *expand, *expand_batches;
    /* Evaluates the eight Taylor series of a kr_tangent at the time `to`. */
    void (*sum)(const struct kr_tangent *tangent, int order, const double *to, double *sum);
} kr_tangents_kernel;

/* Functions for the high-order terms of a double-double series, in double precision. */
typedef struct kr_tail {
    void (*expand)(kr_series *s);
    void (*sum)(const kr_series *s, const double *to, double x[8], double w[4]);
} kr_tail;

enum { KR_ORDER_12, KR_ORDER_16, KR_ORDER_18, KR_ORDER_22, KR_ORDER_28, KR_ORDERS };
enum { KR_DIGITS_20, KR_DIGITS_30, KR_DEPTHS };
/* Declares what the files kernel*.c export for an instruction set. */
#define KR_TAYLOR_ISA(isa)                                                                         \
    extern const kr_kernel kr_kernel_##isa[KR_ORDERS], kr_headless_##isa[KR_ORDERS];               \
    extern const kr_kernel kr_kernel_dd_##isa[KR_DEPTHS];                                          \
    extern const kr_tail kr_tail_##isa[KR_DEPTHS];                                                 \
    extern const kr_tangents_kernel kr_tangents_##isa, kr_tangents_dd_##isa;                       \
    kr_tangents_expand kr_expand_batches_##isa, kr_expand_batches_dd_##isa;                        \
    void kr_product_##isa(const double *a, const double *b, int order, double *c);
KR_TAYLOR_ISA(base)
KR_TAYLOR_ISA(avx2)
KR_TAYLOR_ISA(avx512)

/* Returns 1 if the motion is computed with more than 16 digits. */
static inline int kr_taylor_is_extended(const kr_motion *motion)
{
#ifdef KR_NO_DIGITS
    (void)motion;
    return 0;
#else
    return motion->digits > 16;
#endif
}
/* An instruction set that is included in the build. `plain` and `headless` contain one kernel for
 * each order. The kernels of `headless` do not compute the attitude q (skip_heading in kreisel.h).
 * `deep` contains one kernel for 20 digits and one kernel for 30 digits, or is NULL (FOR_DIGITS).
 * `product` is kr_step_polynomial.product (method.h). */
typedef struct kr_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_kernel *plain, *headless, *deep;
    const kr_tangents_kernel *tangents, *deep_tangents;
    void (*product)(const double *a, const double *b, int order, double *c);
} kr_isa;

/* A build may omit the functions for more than 16 digits (FOR_DIGITS), for tangents (FOR_TANGENTS),
 * or for friction, moving supports and a gravity gradient (FOR_SUPPORTS). Each macro expands to its
 * argument, or to NULL if the build omits the functions. */
#ifdef KR_NO_DIGITS
#  define FOR_DIGITS(what) NULL
#else
#  define FOR_DIGITS(what) what
#endif
#ifdef KR_NO_TANGENTS
#  define FOR_TANGENTS(what) NULL
#else
#  define FOR_TANGENTS(what) what
#endif
#ifdef KR_NO_SUPPORTS
#  define FOR_SUPPORTS(what) NULL
#else
#  define FOR_SUPPORTS(what) what
#endif

extern const kr_tangent_ops kr_taylor_tangents;
/* Stores the vector v as a pure quaternion (0, v) in four doubles. */
static inline void store_as_pure_quaternion(double lanes[4], kr_vec3 v)
{
    lanes[0] = 0.0;
    v_put(lanes + 1, v);
}
/* Stores a.hi at `high`, inside a kr_series, and a.lo at the same place of the next kr_series. */
static inline void store_both_words(double *high, dd a)
{
    *high = a.hi;
    *(double *)(void *)((char *)high + sizeof(kr_series)) = a.lo;
}
/* Stores the high and the low words of the vector v as two pure quaternions. */
static inline void set_vector_words(double high[4], double low[4], vec_dd v)
{
    store_as_pure_quaternion(high, vdd_high(v));
    store_as_pure_quaternion(low, vdd_low(v));
}
/* Returns the time derivative of W at the end of the last step, in the unit of time of the series,
 * without the contribution of friction. */
kr_vec3 kr_taylor_acceleration(const kr_series *s);
/* Evaluates the series at the time s->at, and moves the end of the step to this time. */
void kr_taylor_end_at(kr_series s[2], const kr_kernel *kernel);
struct kr_support_ops;
struct slow_directions;
/* Sets all constants of the Taylor series s (high and low words), with the unit of time 1 / rate.
 * `supports` is NULL without friction, moving support and gravity gradient. */
void kr_taylor_set_constants(kr_series s[2], const kr_motion *motion, double rate,
                             const struct kr_support_ops *supports);
/* Changes the unit of time of a series to 1 / rate, where `rate` is a power of two. Converts the
 * end of the last step, but not the Taylor coefficients. Does nothing if there are tangents. */
void kr_taylor_set_rate(kr_taylor *p, const kr_motion *motion, double rate,
                        const struct kr_support_ops *supports);
/* Returns the i-th instruction set of the build, the widest first, or NULL after the last. */
const kr_isa *kr_taylor_isa(int i);
/* Returns the instruction set of the kernel of a motion, or NULL if it is unknown. */
const kr_isa *kr_taylor_isa_of(const kr_motion *motion);
/* Sets the kernel and log2 of the tolerance of a motion. */
void kr_taylor_set_kernel(kr_motion *motion, const kr_kernel *kernel, double log2_tol);
#endif
