/* Tangents of the heavy top as Taylor series, beside the path's. Private to taylor/. A deviation of
 * the state, or its derivative by a parameter, is a rotation vector theta in the body, by which the
 * attitude q goes on as q theta / 2, and N, the change of the momentum seen from the body:
 *     theta' = 1/A (AW x theta + N - B W) + theta x W
 *     N' = N x W + (c x theta) x P + P x b - D W x theta - D (theta' - theta x W)
 * with the words of taylor.h, B the change of the moments and b that of c where a parameter
 * changes. It is linear in theta and N, hence 18 products of coefficients a term. What it conserves
 * are the changes of the energy and of <m, e3>, as far as its tolerance keeps them. */
#ifndef KR_TANGENTS_H
#define KR_TANGENTS_H
#include "taylor.h"

/* Series of eight numbers about the time t: on a step of the path, or on the last part of one if
 * the deviations need shorter parts. The numbers are those of one deviation, (0, theta | 0, N).
 * Many deviations form batches instead: six structs hold eight deviations, and struct k holds
 * component k of (theta, N) of each. Both layouts have the same bits. For 20 and 30 digits each
 * struct is an array of two, high words and low words, at the distance of a kr_series. */
typedef struct kr_tangent {
    double x[KR_TAYLOR_MAX + 1][8]; /* coefficients */
    double end[8], at[8];           /* sums at the end of the step, and at the sampled time */
    double begin[8];                /* values at the begin of the step */
    double ahead[4], behind[4];     /* (Ax - Az) / Ax, (Ay - Ax) / Ax; and cyclic */
    double per[4], drag[4];         /* 1 / A, D */
    double up[4], down[4];          /* next(c), -prev(c) */
    double lever[8];                /* (0, b); in a batch component k of each b, for k < 3 */
    double moments[3][4];           /* B: xx, yy, zz; then xy, yz, zx; then xz, yx, zy */
    double moment[8];               /* in a batch: the k-th of xx, yy, zz, yz, zx, xy of each B */
    double t;                       /* time of the expansion */
    double damped, changes;         /* whether D, and b or B, are not zero */
    double truncation;              /* largest relative last term so far */
    double unused[120];
} kr_tangent;
enum {
    KR_DEVIATION_BATCH = 8,        /* deviations in a batch */
    KR_DEVIATION_BATCH_MIN = 5,    /* fewer deviations are propagated singly */
    KR_DEVIATION_BATCH_STRUCTS = 6 /* structs of a batch */
};
typedef char kr_tangent_is_as_long_as_a_series[sizeof(kr_tangent) == sizeof(kr_series) ? 1 : -1];
#endif
