/* The functions of stdlib.h that kreisel.c names. */
#ifndef BARE_STDLIB_H
#define BARE_STDLIB_H
#include <stddef.h>

int abs(int n);
void *calloc(size_t count, size_t size);
void free(void *memory);
#endif
