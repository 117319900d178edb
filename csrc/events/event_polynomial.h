/* Event functions as polynomials over a step, and their bounds. */
#ifndef KR_EVENT_POLYNOMIAL_H
#define KR_EVENT_POLYNOMIAL_H
#include "driver/top.h"

enum { KR_TERMS_ROOM = KR_POLYNOMIAL_ORDER_MAX + 16 };
/* Returns a bound of the function with these n terms, in the units of the step `piece`. The
 * function can be searched for sign changes only if the bound is finite and not 0. */
double kr_terms_bound(const kr_top *top, const kr_step_polynomial *piece, size_t n,
                      const kr_term terms[]);
/* Writes g, or dg/ds for an extremum, as a polynomial in s = 0 .. 1 over the step, and returns the
 * degree. The polynomials of two consecutive steps agree up to rounding at their common time, for
 * any tolerance. c has KR_TERMS_ROOM elements. */
int kr_terms_polynomial(const kr_top *top, const kr_step_polynomial *piece, const kr_event *event,
                        double c[]);
/* Values below this fraction of the function's bound count as zero. At the start, KR_TERMS_START is
 * used instead, because the start may meet the event up to rounding errors. */
#define KR_TERMS_UNSURE 0x1p-50
#define KR_TERMS_START 0x1p-40
/* Returns 1 if the function is linear in the vertical and the velocity seen from the body. */
int kr_terms_are_linear(size_t n, const kr_term terms[]);
/* A linear function of the vertical and the velocity seen from the body. */
typedef struct kr_linear {
    kr_vec3 along_vertical, along_velocity;
    double constant;
} kr_linear;
/* Returns `event` as a linear function in working axes; `rate` is the unit of frequency of the
 * step. The terms must be linear (kr_terms_are_linear). */
kr_linear kr_terms_linear_form(const kr_top *top, double rate, const kr_event *event);
#endif
