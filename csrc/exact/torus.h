/* Closed-form solutions for tops whose motion lies on an invariant torus (Kowalewski,
 * Goryachev-Chaplygin). The two angles that parametrize the torus grow at constant rates. A
 * structure of fixed size, called a plan, stores the data of a closed-form solution. This structure
 * begins with the members declared in kreisel.h and ends with the coefficients of the series. The
 * set-up of a closed-form solution needs working memory, which is placed directly after its plan.
 * */
#ifndef KR_EXACT_TORUS_H
#define KR_EXACT_TORUS_H
#include "dispatch.h"

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

#endif
