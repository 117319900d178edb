/* Where a polynomial on [0, 1] changes its sign, from left to right. */
#ifndef KR_ROOTS_H
#define KR_ROOTS_H
#include "method.h"

typedef struct kr_search {
    const double *c;    /* sum c[n] s^n */
    int degree;         /* at most KR_PIECE_MOST */
    double noise;       /* what is not above this cannot be told from zero; */
    double start_noise; /* before any sign is known, from this */
    int side;           /* the last sign that was sure; 0: none so far */
    double mark;        /* the search goes on from here */
    double root;        /* the last change of sign found, into `side` */
    /* Of the terms that are searched: how many, and what those after them can add to the value and
     * to the slope. */
    int used;
    double tail, tail_slope;
} kr_search;
/* On to the next change of sign; false if there is none up to 1. */
int kr_roots_next(kr_search *search);
#endif
