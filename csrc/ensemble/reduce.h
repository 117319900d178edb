/* Accumulators for reductions over the times of a top. Private to ensemble/. */
#ifndef KR_REDUCE_H
#define KR_REDUCE_H
#include "kreisel.h"

/* The current value of a reduction, and one additional number. The additional number is the sum of
 * squared deviations for a variance, and the time for an extremum. */
typedef struct kr_accumulator {
    double value, more;
} kr_accumulator;
/* Adds the k-th state of a top to its accumulators. */
void kr_reduce_add(size_t n, const kr_reduction reduction[], kr_accumulator accumulators[],
                   const kr_scene *scene, const kr_state *state, size_t k);
/* Writes the final results of the reductions, once `states` states have been added. */
void kr_reduce_end(size_t n, const kr_reduction reduction[], const kr_accumulator accumulators[],
                   size_t states, double out[]);
#endif
