/* Search for the sign changes of a polynomial on [0, 1], from left to right. */
#ifndef KR_SIGN_CHANGES_H
#define KR_SIGN_CHANGES_H
#include "method.h"

typedef struct kr_sign_search {
    const double *c;    /* sum c[n] s^n */
    int degree;         /* at most KR_POLYNOMIAL_ORDER_MAX */
    double noise;       /* values up to this size count as zero */
    double start_noise; /* as `noise`, until a first sign is known */
    int sought;         /* search for changes to this sign only; 0: to either sign */
    int side;           /* the last sign known with certainty; 0: none so far */
    double mark;        /* where the search continues */
    double root;        /* position of the last sign change to a sought sign */
    int used;           /* number of terms in use, minus one */
    double tail;        /* bound of the sum of the omitted terms */
    double tail_slope;  /* bound of the slope of the omitted terms */
} kr_sign_search;
/* Finds the next sign change of the polynomial. Returns 0 if there is none left in [0, 1]. */
int kr_search_next_sign_change(kr_sign_search *search);
#endif
