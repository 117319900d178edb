/* Claims of the header that are checked after each call. A false claim ends its round and reports
 * the seed. `fuzz SEED 1` repeats this round and prints its calls. */
#ifndef KR_CLAIMS_H
#define KR_CLAIMS_H
#include "kreisel.h"

#define CLAIM(what) ((what) ? (void)0 : claim_failed(__FILE__, __LINE__, #what))
void claim_failed(const char *file, int line, const char *what);
/* Counts a chosen call, and prints the call if the round is printed. */
void print_call(const char *format, ...);
void print_detail(const char *format, ...); /* prints without counting */

enum error_kind { NONE, INPUT, FAILURE, MEMORY, INTERRUPT };
/* Returns the category of a status, and claims that kreisel.h lists the status. */
enum error_kind error_category(kr_status status);
int same_bits(const void *one, const void *other, size_t size);
/* Fills memory with a byte pattern that no call writes. is_marked returns 1 if the pattern is
 * intact. */
void fill_with_mark(void *memory, size_t size);
int is_marked(const void *memory, size_t size);
/* Returns 1 if a state is finite and its attitude of unit length. */
int is_good(kr_state state);
void tell_scene(const kr_scene *scene);
#endif
