/* Accumulators for reductions (such as the maximum) over the times at which a top is sampled.
 * Private to ensemble/. */
#ifndef KR_REDUCE_H
#define KR_REDUCE_H
#include "kreisel.h"

/* State of a reduction: the number `value`, and an auxiliary number `more`. For a variance, `value`
 * is the mean, and `more` is the sum of the squared deviations from the mean. For other reductions,
 * `value` is the current extremum, mean or last value, and `more` is the time of an extremum. */
typedef struct kr_accumulator {
    double value, more;
} kr_accumulator;
/* Updates the accumulators of all reductions with the k-th state of a top. */
void kr_reduce_add(size_t n, const kr_reduction reduction[], kr_accumulator accumulators[],
                   const kr_scene *scene, const kr_state *state, size_t k);
/* Writes the final results of the reductions, where `states` is the number of states. */
void kr_reduce_end(size_t n, const kr_reduction reduction[], const kr_accumulator accumulators[],
                   size_t states, double out[]);
#endif
