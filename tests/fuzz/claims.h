/* What the header says is claimed after each call. A claim that does not hold ends its round, and
 * says the seed with which `fuzz SEED 1` makes that round again, and tells its calls. */
#ifndef KR_CLAIMS_H
#define KR_CLAIMS_H
#include "kreisel.h"

#define CLAIM(what) ((what) ? (void)0 : claim_failed(__FILE__, __LINE__, #what))
void claim_failed(const char *file, int line, const char *what);
/* Counts a call that is chosen, and tells it if the round is one to be told. */
void call(const char *format, ...);
void tell(const char *format, ...); /* tells without counting */

enum what_went_wrong { NONE, INPUT, FAILURE, MEMORY, INTERRUPT };
/* Says to which of these a status belongs; claims that it is one of the list. */
enum what_went_wrong went_wrong(kr_status status);
int same_bits(const void *one, const void *other, size_t size);
/* Fills memory with bytes that no call writes, and says whether they are all there still. */
void leave_mark(void *memory, size_t size);
int is_marked(const void *memory, size_t size);
/* Whether a state is finite and its attitude of unit length. */
int is_good(kr_state state);
void tell_scene(const kr_scene *scene);
#endif
