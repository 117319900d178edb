/* Functions of the state: their values, and their polynomials over a step. */
#ifndef KR_TERMS_H
#define KR_TERMS_H
#include "driver/top.h"

enum { KR_TERMS_ROOM = KR_PIECE_MOST + 16 };
/* Gives a bound of the function in the units of this step. If it is 0 or not finite, there is
 * nothing to look for. */
double kr_terms_size(const kr_top *top, const kr_piece *piece, size_t n, const kr_term terms[]);
/* Gives g, or for an extremum dg/ds, as a polynomial in s = 0 .. 1 over the step, and returns its
 * degree. The polynomial ends where that of the next step begins, to rounding, however loose the
 * tolerance. c has KR_TERMS_ROOM. */
int kr_terms_polynomial(const kr_top *top, const kr_piece *piece, const kr_event *event,
                        double c[]);
#endif
