/* Taylor series of heavy tops in SIMD lanes: each lane of a vector holds one top, with its own time
 * and step size. Private to ensemble/.
 *     P' = P x W                           q: attitude, body -> space, a unit quaternion
 *     A W' = (AW + h) x W + P x c - D W    P = q* e3 q: the vertical e3 in the body frame
 *     q = exp(e3 f/2) q0 s(P)              W: angular velocity in the body; A: moments of inertia
 *     f' = <W, P + P0> / (1 + <P, P0>)     h: angular momentum of the rotor; D: damping
 *                                          c: weight * center of mass
 * P0 and q0 are the values of P and q at the beginning of a step. s(P) is the rotation by the
 * smallest angle that takes P to P0. The heading f is the angle of a rotation about the vertical.
 * Because P and f determine q, each order needs only 12 sums of products of coefficients, instead
 * of 21 with a series of q. Two of the 12 are for <W, P>: Wx Px and Wy Py, because <AW + h, P> is
 * constant; with damping, it is not, and Wz Pz is added. The rotor costs no products (taylor.h).
 * The step size is limited by the singularity of f' at P = -P0. The unit of time is such that
 * |W| < 1. Energy and angular momentum are conserved only up to the tolerance. */
#ifndef KR_LANE_STATE_H
#define KR_LANE_STATE_H
#include "math/isa.h"
#include "math/su2.h"

enum { KR_LANES_MAX = 8, KR_LANES_ORDER = 28 };

/* A number, a vector and a quaternion for each lane; the index of the lane is the last index. */
typedef double kr_lane_number[KR_LANES_MAX];
typedef kr_lane_number kr_lane_vector[3], kr_lane_quaternion[4];
/* Stores the components of v in the elements to[0][lane], to[1][lane] and to[2][lane]. */
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
/* Returns (x, y, z), (y, z, x) or (z, x, y) for v = (x, y, z) and `shift` = 0, 1 or 2. */
static inline kr_vec3 shift_axes(kr_vec3 v, int shift)
{
    return shift == 0 ? v : shift == 1 ? v3(v.y, v.z, v.x) : v3(v.z, v.x, v.y);
}

/* Flags of the Taylor recurrence. KR_LANES_HEADLESS: the heading f and the attitude are not
 * computed. KR_LANES_DAMPED: the damping D is taken into account; otherwise it must be 0. */
enum { KR_LANES_HEADLESS = 1, KR_LANES_DAMPED = 2 };

struct kr_lane_tangents;
/* The last computed step of every lane, from the time t to the time `end`. A lane must stop at the
 * first step that reaches its `goal`. The lane's axes are the principal axes, permuted cyclically
 * so that the third moment of inertia is the largest. An unused lane is stepped, too, but never
 * stops the others: its coefficients are finite, and its goal is infinite. */
typedef struct kr_lanes {
    kr_lane_vector p[KR_LANES_ORDER + 1], w[KR_LANES_ORDER + 1]; /* coefficients of P and W */
    kr_lane_number rate[KR_LANES_ORDER + 1];                     /* of f' */
    kr_lane_number turn[KR_LANES_ORDER + 1];                     /* of f */
    kr_lane_number near[KR_LANES_ORDER + 1];                     /* coefficients of 1 + <P, P0> */
    kr_lane_number inverse;                                      /* 1 / (1 + <P, P0>) at t */
    kr_lane_quaternion q;                                        /* attitude at t */
    kr_lane_vector end_p, end_w;
    kr_lane_quaternion end_q;
    kr_lane_vector k, up, down; /* (Ay - Az) / Ax, cz / Ax, -cy / Ax, and cyclic permutations */
    kr_lane_vector drag;        /* -Dx / Ax, and cyclic permutations */
    /* factors of Wx Px, Wy Py and Pz in <W, P>: 1 - Ax / Az, 1 - Ay / Az, -hz / Az */
    kr_lane_vector inner;
    /* Terms of the rotor. The x components are -hz / (Ay - Az) in shift_prev and hy / (Ay - Az)
     * in shift_next; a cyclic permutation of x, y, z gives the others. Without a rotor, these two
     * vectors are -0, because adding -0 leaves every number unchanged. With W at the time t, prev
     * is (Wz, Wx, Wy) + shift_prev, and next is (Wy, Wz, Wx) + shift_next. */
    kr_lane_vector shift_prev, shift_next, prev, next;
    kr_lane_number t, end, goal, forward; /* `forward` is 1, or -1 backward in time */
    kr_lane_number fall;                  /* as in kr_series (taylor.h) */
    kr_lane_number steps, max_steps;
    kr_lane_number at; /* time to sample */
    /* The event: a zero of the event function <along_p, P> + <along_w, W> + constant or, if
     * `extremum` is 1, of its derivative. In the last step, this function or derivative is the
     * polynomial sum g[n] s^n, 0 <= s <= 1. The sign of a value is certain if its magnitude is
     * above `noise`. `side` is the most recent certain sign, 1 or -1, or 0 if there is none. */
    kr_lane_vector along_p, along_w;
    kr_lane_number constant, g[KR_LANES_ORDER + 1], side, noise;
    int has_event, extremum;
    /* Conversion to the user's frame and units: `axes` rotates from the frame of description to the
     * lane's axes. In these axes, the user's momentum is moment * W + rotor, componentwise. */
    kr_lane_quaternion axes;
    kr_lane_vector moment, rotor;
    kr_lane_quaternion out_q; /* from `sample`: the user's q and m (kr_state) */
    kr_lane_vector out_m;
    int order, terms;
    double log2_tol;
    struct kr_lane_tangents *tangents; /* NULL: no tangents */
} kr_lanes;

/* The tangents delta = (theta, N) (lane_tangent.h): d is delta times `scale` = 2^-power. */
typedef struct kr_growth {
    kr_lane_vector d[2];
    kr_lane_number power, scale;
    kr_lane_number area, moment; /* integrals of ln|delta| and of ln|delta| ln t over t */
    kr_lane_number max, last;    /* the largest and the last ln|delta| */
    kr_lane_number truncation;   /* square of the largest |last Taylor term| / |delta| */
} kr_growth;
/* Data of the tangents, one per SIMD lane. */
typedef struct kr_lane_tangents {
    kr_lane_vector x[KR_LANES_ORDER + 1][2]; /* coefficients of theta and N */
    kr_lane_number lift[KR_LANES_ORDER + 1]; /* coefficients of <c, P> */
    kr_lane_vector ahead, behind; /* (Ax - Az) / Ax, (Ay - Ax) / Ax, and cyclic permutations */
    kr_lane_vector per, moments, c, rotor; /* 1 / A, A, c, h */
    kr_growth begin, end;                  /* at the start and at the end of the step */
    kr_lane_number energy, vertical;       /* dE and d<m, e3> of the initial tangent */
    kr_lane_number out[KR_GROWTH_COUNT];
    kr_lane_vector first[2]; /* result of the kernel's `begin`: an initial tangent of unit length */
    kr_lane_number first_energy, first_vertical, first_size;
    kr_lanes substep;        /* the path, expanded at the start of a substep */
    double truncation_limit; /* largest allowed value of kr_growth.truncation */
    int terms[4];            /* degree of the polynomials at each interior quadrature node */
} kr_lane_tangents;

typedef struct kr_lanes_isa {
    const char *name;
    const int *lanes;
    int (*runs_here)(void);
    /* Advances the tops in all SIMD lanes by at most `steps` integration steps. Stops after a step
     * in which a lane has reached its goal, has made no progress, has exceeded max_steps, is not
     * finite, or may have met its event. Returns the mask of these lanes: bit i for lane i. */
    unsigned (*advance)(kr_lanes *lanes, int steps);
    /* Writes the state of each lane i at the time lanes->at[i], which lies within its last step, to
     * lanes->out_q and out_m. With tangents, writes their growth to tangents->out. */
    void (*sample)(kr_lanes *lanes);
    /* Removes the components along the trivial solutions (lane_tangent.h) from the initial tangents
     * tangents->end.d, scales the results to unit length, and writes them to tangents->first. */
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
/* Returns the i-th instruction set in the build, widest vectors first; NULL if i is too large. */
const kr_lanes_isa *kr_lanes_isa_at(int i);
#endif
