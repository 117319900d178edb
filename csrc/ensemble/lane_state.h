/* Taylor series of heavy tops in SIMD lanes: each lane of a vector holds one top, with its own step
 * size. Private to ensemble/.
 *     P' = P x W                  P = q* e3 q: the vertical in the body frame
 *     A W' = (AW + h) x W + P x c - D W     W: angular velocity in the body; A: moments; h: rotor;
 *                                           c: mass gravity com; D: damping
 *     q = exp(e3 f/2) g s(P)      s: the shortest turn from P to d; f: the heading
 *     f' = (W, P + d) / (1 + (P, d))
 * The constants d and g are the values of the vertical P and of the attitude q at the beginning of
 * a step. The vertical P and the heading f determine the attitude, so each order needs only 12
 * products of Taylor coefficients. With a Taylor series of the quaternion q, each order would need
 * 21 products. The inner product (W, P) requires only two of the twelve products, because (AW + h,
 * P) is constant, unless the top is damped: then it requires all three. The torque of a rotor is
 * included by modifying the coefficient W_0, as described in taylor.h. The expression for f' has a
 * pole at P = -d, and the distance from this pole limits the step size. Time is scaled so that |W|
 * < 1. Energy and angular momentum are conserved only up to the tolerance. */
#ifndef KR_LANE_STATE_H
#define KR_LANE_STATE_H
#include "math/isa.h"
#include "math/su2.h"

enum { KR_LANES_MAX = 8, KR_LANES_ORDER = 28 };

/* Arrays of numbers, vectors and quaternions, with one element for each lane. */
typedef double kr_lane_number[KR_LANES_MAX];
typedef kr_lane_number kr_lane_vector[3], kr_lane_quaternion[4];
/* Stores the components of a vector in one SIMD lane of the arrays to[0], to[1] and to[2]. */
static inline void set_vector(kr_lane_number *to, int lane, kr_vec3 v)
{
    to[0][lane] = v.x;
    to[1][lane] = v.y;
    to[2][lane] = v.z;
}
static inline void set_quaternion(kr_lane_number *to, int lane, kr_quat q)
{
    to[0][lane] = q.w;
    set_vector(to + 1, lane, q_vec(q));
}
/* Returns v with its components shifted cyclically by `shift` places, 0, 1 or 2. */
static inline kr_vec3 shift_axes(kr_vec3 v, int shift)
{
    return shift == 0 ? v : shift == 1 ? v3(v.y, v.z, v.x) : v3(v.z, v.x, v.y);
}

/* Flags for the terms of the recurrence; their sum is known when a function is compiled.
 * KR_LANES_HEADLESS leaves out the heading f. KR_LANES_DAMPED includes the damping. */
enum { KR_LANES_HEADLESS = 1, KR_LANES_DAMPED = 2 };

struct kr_lane_tangents;
/* The current step of every lane, which extends from the time t to the time `end`. The body axes
 * are permuted so that the third moment of inertia is the largest. The coefficients of an unused
 * lane are finite, and its `goal` is infinite. */
typedef struct kr_lanes {
    kr_lane_vector p[KR_LANES_ORDER + 1], w[KR_LANES_ORDER + 1]; /* coefficients of P and W */
    kr_lane_number rate[KR_LANES_ORDER + 1];                     /* of f' */
    kr_lane_number turn[KR_LANES_ORDER + 1];                     /* of f */
    kr_lane_number near[KR_LANES_ORDER + 1];                     /* coefficients of 1 + (P, d) */
    kr_lane_number inverse;                                      /* 1 / (1 + (P, d)) at t */
    kr_lane_quaternion q;                                        /* attitude at t */
    kr_lane_vector end_p, end_w;
    kr_lane_quaternion end_q;
    kr_lane_vector k, up, down; /* (Ay - Az) / Ax, cz / Ax, -cy / Ax, and cyclic permutations */
    kr_lane_vector drag;        /* -Dx / Ax, and cyclic permutations */
    /* factors of Wx Px, Wy Py and Pz in (W, P): 1 - Ax / Az, 1 - Ay / Az, -hz / Az */
    kr_lane_vector inner;
    /* The members `prev` and `next` are the cyclic permutations (Wz, Wx, Wy) and (Wy, Wz, Wx) of
     * W_0 plus the rotor terms `shift_prev` and `shift_next`: -hz / (Ay - Az) and hy / (Ay - Az),
     * permuted cyclically. Without a rotor, these terms are -0, because adding -0 leaves every
     * number unchanged. */
    kr_lane_vector shift_prev, shift_next, prev, next;
    kr_lane_number t, end, goal, forward; /* `forward` is 1, or -1 backward in time */
    kr_lane_number fall;                  /* as in kr_series */
    kr_lane_number steps, max_steps;
    kr_lane_number at; /* time to sample */
    /* The event: a zero or an extremum of g = (along_p, P) + (along_w, W) + constant, with inner
     * products. g[] holds the coefficients of g, or of dg/ds, as a polynomial in s over the step, 0
     * <= s <= 1. `side` is the last sign of g known with certainty, or 0. Values of magnitude at
     * most `noise` are treated as zero. */
    kr_lane_vector along_p, along_w;
    kr_lane_number constant, g[KR_LANES_ORDER + 1], side, noise;
    int has_event, extremum;
    /* Conversion to the user's frame and units: `axes` rotates vectors from the frame of
     * description to the axes of the lane. `moment` is the momentum for W = 1 along each axis, and
     * `rotor` the momentum of the rotor. */
    kr_lane_quaternion axes;
    kr_lane_vector moment, rotor;
    kr_lane_quaternion out_q; /* result of `sample`: q and m in the user's frame and units */
    kr_lane_vector out_m;
    int order, terms;
    double log2_tol;
    struct kr_lane_tangents *tangents; /* NULL: no tangents */
} kr_lanes;

/* The state of a tangent delta = (theta, N), a rotation vector and a change of the momentum: d is
 * delta times `scale` = 2^-power. */
typedef struct kr_growth {
    kr_lane_vector d[2];
    kr_lane_number power, scale;
    kr_lane_number area, moment; /* integrals of ln|delta| and of ln|delta| ln t over t */
    kr_lane_number max, last;    /* the largest and the last ln|delta| */
    kr_lane_number truncation;   /* square of the largest relative last term */
} kr_growth;
/* Data of the tangents, one per SIMD lane, in the notation of taylor/tangents.h. */
typedef struct kr_lane_tangents {
    kr_lane_vector x[KR_LANES_ORDER + 1][2]; /* coefficients of theta and N */
    kr_lane_number lift[KR_LANES_ORDER + 1]; /* coefficients of <c, P> */
    kr_lane_vector ahead, behind, per, moments, c, rotor;
    kr_growth begin, end;            /* the tangents at the start and at the end of the step */
    kr_lane_number energy, vertical; /* dE and d<m, e3> of the initial tangent */
    kr_lane_number out[KR_GROWTH_COUNT];
    kr_lane_vector first[2]; /* result of the kernel's `begin`: an initial tangent of unit length */
    kr_lane_number first_energy, first_vertical, first_size;
    kr_lanes substep;        /* the path, expanded at the start of a substep */
    double truncation_limit; /* largest allowed square of a relative last term */
    int terms[4];            /* number of terms that matter at each node of the integrals */
} kr_lane_tangents;

typedef struct kr_lanes_isa {
    const char *name;
    const int *lanes;
    int (*runs_here)(void);
    /* Advances the tops in all SIMD lanes by at most `steps` integration steps. Stops as soon as a
     * lane has passed its goal, has made no progress, has exceeded its number of steps, is not
     * finite, or may have met its event. Returns the set of these lanes, with one bit for each
     * lane. */
    unsigned (*advance)(kr_lanes *lanes, int steps);
    /* Computes the state of each lane at the time `at` within its last step. */
    void (*sample)(kr_lanes *lanes);
    /* Removes the trivial solutions (lane_tangent.h) from the initial tangent tangents->end.d,
     * scales the remainder to unit length, and writes the result to tangents->first. */
    void (*begin)(kr_lanes *lanes);
} kr_lanes_isa;
/* KR_LANES_ISA declares the functions that kernel_lanes.c exports for an instruction set. */
#define KR_LANES_ISA(isa)                                                                          \
    unsigned kr_lanes_advance_##isa(kr_lanes *lanes, int steps);                                   \
    void kr_lanes_sample_##isa(kr_lanes *lanes);                                                   \
    void kr_lanes_begin_##isa(kr_lanes *lanes);                                                    \
    extern const int kr_lanes_count_##isa;
KR_LANES_ISA(base)
KR_LANES_ISA(avx2)
KR_LANES_ISA(avx512)
/* Returns the i-th instruction set of the build, from the widest on, or NULL if i is too large. */
const kr_lanes_isa *kr_lanes_isa_at(int i);
#endif
