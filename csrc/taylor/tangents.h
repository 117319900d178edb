/* Taylor series of the tangents of a heavy top. Private to taylor/. A tangent is an infinitesimal
 * perturbation of the state, or the derivative of the state with respect to a parameter. A tangent
 * consists of two vectors in the body frame: a rotation vector theta, which changes the attitude q
 * by q theta / 2, and the change N of the angular momentum in space:
 *     theta' = 1/A ((AW + h) x theta + N - B W - y) + theta x W
 *     N' = N x W + (c x theta) x P + P x b + (D W) x theta - D (theta' - theta x W) - F W
 * A are the moments of inertia, D the damping coefficients, W the angular velocity, P the vertical,
 * c the lever arm, and h the momentum of a rotor (taylor.h). B, b, F and y are derivatives of A, c,
 * D and h by the parameter. Friction, gravity gradients and moving supports add terms
 * (support_deviation.h). The equations are linear in theta and N. An order needs 18 product sums: 6
 * for N x W, 6 for (c x theta) x P, 6 shared by theta x W, AW x theta and D W x theta. If energy
 * and vertical momentum are conserved, their changes are constant up to the tolerance. */
#ifndef KR_TANGENTS_H
#define KR_TANGENTS_H
#include "taylor.h"

/* Eight Taylor series about the time t, the beginning of a step or substep. They describe a single
 * tangent, stored as (0, theta | 0, N), or component k of (theta, N) of each tangent in a batch of
 * eight. A batch occupies six structs, one for each k; arrays of 8 have the index i for tangent i.
 * With more than 16 digits, a struct of low words follows each struct of high words. */
typedef struct kr_tangent {
    double x[KR_TAYLOR_MAX + 1][8]; /* coefficients */
    double end[8], at[8];           /* values at the end of the step, and at the sampled time */
    double begin[8];                /* values at the start of the step */
    double substep_end[8];          /* values at the end of the substep in memory */
    double ahead[4], behind[4];     /* (Ax - Az) / Ax, (Ay - Ax) / Ax; and cyclic */
    double per[4], drag[4];         /* 1 / A, D */
    double up[4], down[4];          /* next(c), -prev(c) */
    double lever[8];                /* (0, b); in a batch component k of each b, for k < 3 */
    double moments[8], drags[8];    /* B and F, like b */
    double rotor[4];                /* h */
    double t;                       /* time of the expansion */
    double damped, changes;         /* nonzero if D is not zero; nonzero if b or B is not zero */
    double drag_changes, gyrostat;  /* nonzero if F is not zero; nonzero if h is not zero */
    double truncation;              /* largest relative truncation error so far */
    double rotor_of[8];             /* (0, y); in a batch component k of each y, for k < 3 */
    double rotor_changes;           /* nonzero if y is not zero */
    /* For single tangents only: `pull` is (0, b); the kr_timing `timing` selects k
     * (support_deviation.h). `turning_of` is (0, derivative of O), in the frame e1, e2, e3. */
    double pull[4], turning_of[4], timing;
    double apex_of[4], friction_of; /* the derivatives of the apex, (0, d), and of the friction */
    double gradient_of;             /* the derivative of the gravity gradient */
    double unused[118];
} kr_tangent;
enum {
    KR_DEVIATION_BATCH = 8,        /* tangents in a batch */
    KR_DEVIATION_BATCH_MIN = 5,    /* fewer tangents than this are propagated one by one */
    KR_DEVIATION_BATCH_STRUCTS = 6 /* structs of a batch */
};
typedef char kr_tangent_is_as_long_as_a_series[sizeof(kr_tangent) == sizeof(kr_series) ? 1 : -1];
#endif
