/* Heavy tops as Taylor series in lanes: each lane of a vector holds one top with its own step.
 * Private to ensemble/.
 *     P' = P x W                  P = q* e3 q: the vertical seen from the body
 *     A W' = AW x W + P x c       W: angular velocity in the body; A: moments; c: mass gravity com
 *     q = exp(e3 f/2) g s(P)      s: the shortest turn from P to d; d and g are constant
 *     f' = (W, P + d) / (1 + (P, d))
 * f is the heading: it and P determine the attitude. A term of the series therefore takes 12
 * products of coefficients instead of the 21 that q itself would take: 3 for AW x W, 6 for P x W,
 * 1 for the quotient, and 2 for (W, P), because (AW, P) is constant. d is P at the begin of a step,
 * far from the pole of the quotient; the distance of the pole limits the step. The units are those
 * of taylor.h: W stays below one. A series conserves nothing beyond its tolerance. */
#ifndef KR_LANE_STATE_H
#define KR_LANE_STATE_H
#include "kreisel.h"
#include "math/isa.h"

enum { KR_LANES_MAX = 8, KR_LANES_ORDER = 28 };

/* Numbers, vectors and quaternions, one for each lane. */
typedef double kr_lane_number[KR_LANES_MAX];
typedef kr_lane_number kr_lane_vector[3], kr_lane_quaternion[4];

struct kr_lane_tangents;
/* Steps of all lanes, from the times t to `end`. The order of the body's axes makes the third
 * moment the largest. A lane without a top is parked: its numbers are finite, and its `goal` is
 * unreachable. */
typedef struct kr_lanes {
    kr_lane_vector p[KR_LANES_ORDER + 1], w[KR_LANES_ORDER + 1]; /* coefficients of P and W */
    kr_lane_number rate[KR_LANES_ORDER + 1];                     /* of f' */
    kr_lane_number turn[KR_LANES_ORDER + 1];                     /* of f */
    kr_lane_number near[KR_LANES_ORDER + 1];                     /* of 1 + (P, d) */
    kr_lane_number inverse;                                      /* 1 / (1 + (P, d)) at t */
    kr_lane_quaternion q;                                        /* attitude at t */
    kr_lane_vector end_p, end_w;
    kr_lane_quaternion end_q;
    kr_lane_vector k, up, down;           /* (Ay - Az) / Ax, cz / Ax, -cy / Ax; and cyclic */
    kr_lane_vector part;                  /* 1 - Ax / Az, 1 - Ay / Az: of (W, P); and 0 */
    kr_lane_number t, end, goal, forward; /* `forward` is 1, or -1 back in time */
    kr_lane_number fall;                  /* as in kr_series */
    kr_lane_number steps, max_steps;
    kr_lane_number at; /* time to sample */
    /* The event: g = along_p P + along_w W + constant, or its extrema; the coefficients of g over
     * the step, in s from 0 to 1; the last certain sign, 0 for none; and the value up to which g
     * counts as zero. */
    kr_lane_vector along_p, along_w;
    kr_lane_number constant, g[KR_LANES_ORDER + 1], side, noise;
    int has_event, extremum;
    /* Conversion to the user: the frame of description seen from these axes, and the momentum of a
     * unit of W. */
    kr_lane_quaternion axes;
    kr_lane_vector moment;
    kr_lane_quaternion out_q; /* sample: the user's q and m */
    kr_lane_vector out_m;
    int order, skip_heading;
    double log2_tol;
    struct kr_lane_tangents *tangents; /* NULL: no tangents */
} kr_lanes;

/* State of a tangent: theta and N, times 2^-power; `scale` is that power of two. */
typedef struct kr_growth {
    kr_lane_vector d[2];
    kr_lane_number power, scale;
    kr_lane_number area, moment; /* int ln|delta| dt, and of that times ln t */
    kr_lane_number max, last;    /* the largest ln|delta|, and the last */
    kr_lane_number truncation;   /* square of the largest relative last term */
} kr_growth;
/* One tangent for each lane, with the names of taylor/tangents.h. */
typedef struct kr_lane_tangents {
    kr_lane_vector x[KR_LANES_ORDER + 1][2]; /* coefficients of theta and N */
    kr_lane_number lift[KR_LANES_ORDER + 1]; /* coefficients of <c, P> */
    kr_lane_vector ahead, behind, per, moments, c;
    kr_growth begin, end;            /* at the begin and end of the step */
    kr_lane_number energy, vertical; /* dE and d<m, e3> of the tangent at the start */
    kr_lane_number out[KR_GROWTH_COUNT];
    kr_lane_vector first[2]; /* admissible initial tangent at the end of the step */
    kr_lane_number first_energy, first_vertical, first_size;
    kr_lanes part;           /* the path about a part of a step */
    double truncation_limit; /* square of the largest relative last term allowed */
    int terms[4];            /* number of terms that matter at the nodes of the integrals */
} kr_lane_tangents;

typedef struct kr_lanes_isa {
    const char *name;
    const int *lanes;
    int (*runs_here)(void);
    /* Steps all lanes at most `steps` times. Stops when a lane has passed its goal, made no
     * progress, exceeded its step limit, is not finite, or may have met its event. Returns these
     * lanes as bits. */
    unsigned (*advance)(kr_lanes *lanes, int steps);
    /* Computes the states at the times `at` inside the steps. */
    void (*sample)(kr_lanes *lanes);
    /* Makes `end` of the tangents an admissible start: of unit length, and without the known
     * solutions. */
    void (*begin)(kr_lanes *lanes);
} kr_lanes_isa;
/* KR_LANES_ISA declares what kernel_lanes.c exports for an instruction set. */
#define KR_LANES_ISA(isa)                                                                          \
    unsigned kr_lanes_advance_##isa(kr_lanes *lanes, int steps);                                   \
    void kr_lanes_look_##isa(kr_lanes *lanes);                                                     \
    void kr_lanes_begin_##isa(kr_lanes *lanes);                                                    \
    extern const int kr_lanes_count_##isa;
KR_LANES_ISA(base)
KR_LANES_ISA(avx2)
KR_LANES_ISA(avx512)
/* Returns the i-th instruction set that was compiled in, the widest first; NULL beyond the last. */
const kr_lanes_isa *kr_lanes_isa_at(int i);
#endif
