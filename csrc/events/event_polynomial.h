/* Functions of the state: their values, and their polynomials over a step. */
#ifndef KR_EVENT_POLYNOMIAL_H
#define KR_EVENT_POLYNOMIAL_H
#include "driver/top.h"

enum { KR_TERMS_ROOM = KR_POLYNOMIAL_ORDER_MAX + 16 };
/* Gives a bound of the function in the units of this step. If it is 0 or not finite, there is
 * nothing to look for. */
double kr_terms_bound(const kr_top *top, const kr_step_polynomial *piece, size_t n,
                      const kr_term terms[]);
/* Gives g, or for an extremum dg/ds, as a polynomial in s = 0 .. 1 over the step, and returns its
 * degree. The polynomial ends where that of the next step begins, to rounding, however loose the
 * tolerance. c has KR_TERMS_ROOM. */
int kr_terms_polynomial(const kr_top *top, const kr_step_polynomial *piece, const kr_event *event,
                        double c[]);
/* What is below this part of the function's size cannot be told from zero; in the start, which may
 * be off the event that it was put on, below the second one. */
#define KR_TERMS_UNSURE 0x1p-50
#define KR_TERMS_START 0x1p-40
/* Whether the function is linear in the vertical and the velocity as the body sees them. */
int kr_terms_are_linear(size_t n, const kr_term terms[]);
/* Gives one that is, in working axes and the units of a step of this rate. */
typedef struct kr_linear {
    kr_vec3 along_vertical, along_velocity;
    double constant;
} kr_linear;
kr_linear kr_terms_linear_form(const kr_top *top, double rate, const kr_event *event);
#endif
