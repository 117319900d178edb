/* The rounds of fuzz.c, with choices made by libFuzzer, which searches for bytes that reach new
 * code. */
#include <stdio.h>
#include <stdlib.h>
#include "random_values.h"
#include "rounds.h"

int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size);
int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size)
{
    choose_by_bytes(size, bytes);
    const failed_claim *claim = make_round(0);
    if (!claim) return 0;
    choose_by_bytes(size, bytes);
    make_round(1);
    printf("%s:%d  not so: %s\n", claim->file, claim->line, claim->what);
    fflush(stdout);
    abort();
}
