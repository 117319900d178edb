/* What is kept of a number over a top's times, while they pass. Private to ensemble/. */
#ifndef KR_REDUCE_H
#define KR_REDUCE_H
#include "kreisel.h"

/* The result so far, and what some kinds need beside it: of a variance the mean and the sum of
 * squares about it, of a place the extreme value and its time. */
typedef struct kr_accumulator {
    double value, more;
} kr_accumulator;
/* Takes in the state number k of a top, whose numbers before are in `kept`. */
void kr_reduce_add(size_t n, const kr_reduction reduction[], kr_accumulator kept[],
                   const kr_scene *scene, const kr_state *state, size_t k);
/* Gives the results over so many states. */
void kr_reduce_end(size_t n, const kr_reduction reduction[], const kr_accumulator kept[],
                   size_t states, double out[]);
#endif
