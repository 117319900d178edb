/* A round: a few dozen calls, made of the choices that come next (random_values.h). */
#ifndef KR_ROUNDS_H
#define KR_ROUNDS_H
#include <stdint.h>

extern uint64_t calls_made;   /* all that compute, with those of the checks (step_counts.h) */
extern uint64_t calls_chosen; /* those that rounds are made of */

typedef struct failed_claim {
    const char *file, *what;
    int line;
} failed_claim;
/* Makes a round, and tells its calls if it is asked to. Returns the claim that did not hold, with
 * which it ended; NULL if all did. */
const failed_claim *make_round(int telling);
#endif
