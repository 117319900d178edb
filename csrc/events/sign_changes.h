/* Where a polynomial on [0, 1] changes its sign, from left to right. */
#ifndef KR_SIGN_CHANGES_H
#define KR_SIGN_CHANGES_H
#include "method.h"

typedef struct kr_sign_search {
    const double *c;    /* sum c[n] s^n */
    int degree;         /* at most KR_POLYNOMIAL_ORDER_MAX */
    double noise;       /* what is not above this cannot be told from zero */
    double start_noise; /* its value until a first sign is known */
    int sought;         /* the sign into which changes are sought; 0: either */
    int side;           /* the last sign that was sure; 0: none so far */
    double mark;        /* the search goes on from here */
    double root;        /* the last change of sign found, into `side`, where that is sought */
    int used;           /* the degree up to which terms are searched */
    double tail;        /* what the terms after these can add to the value */
    double tail_slope;  /* and to the slope */
} kr_sign_search;
/* Goes on to the next change of sign; false if there is none up to 1. */
int kr_search_next_sign_change(kr_sign_search *search);
#endif
