/* The functions of bare.c. */
#ifndef BARE_H
#define BARE_H
#include <kreisel.h>

/* Creates the top. The step is the time between two calls of tick [s]. */
kr_status begin(double step);
/* Moves the top by one step. */
kr_status tick(void);
/* Returns the height of the apex, from -1 to 1. */
double height(void);
/* Returns the bytes of the pool that are in use. */
size_t memory_used(void);
#endif
