/* A round: a few dozen calls, determined by the next choices (random_values.h). */
#ifndef KR_ROUNDS_H
#define KR_ROUNDS_H
#include <stdint.h>

extern uint64_t calls_made; /* by rounds, without those of the checks */

typedef struct failed_claim {
    const char *file, *what;
    int line;
} failed_claim;
/* Makes a round, and prints its calls if `telling` is nonzero. Returns the claim that failed and
 * ended the round, or NULL. */
const failed_claim *make_round(int telling);
#endif
