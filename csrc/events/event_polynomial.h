/* Event functions as polynomials over a step, and their bounds. */
#ifndef KR_EVENT_POLYNOMIAL_H
#define KR_EVENT_POLYNOMIAL_H
#include "driver/top.h"

enum { KR_TERMS_ROOM = KR_POLYNOMIAL_ORDER_MAX + 16 };
/* Returns an upper bound on the magnitude of the function with these n terms, in the units of the
 * step `piece`. Sign changes can be searched for only if the bound is finite and nonzero. */
double kr_terms_bound(const kr_top *top, const kr_step_polynomial *piece, size_t n,
                      const kr_term terms[]);
/* Writes the event function g as a polynomial in s over the step, 0 <= s <= 1, and returns the
 * degree. If the event is an extremum, writes dg/ds instead. At their common time, the polynomials
 * of two consecutive steps agree up to rounding errors, whatever the tolerance. The array c has
 * KR_TERMS_ROOM elements. */
int kr_terms_polynomial(const kr_top *top, const kr_step_polynomial *piece, const kr_event *event,
                        double c[]);
/* Values smaller than KR_TERMS_UNSURE times the bound of the function are treated as zero. At the
 * initial state the threshold is KR_TERMS_START, because the event may occur there up to rounding
 * errors. */
#define KR_TERMS_UNSURE 0x1p-50
#define KR_TERMS_START 0x1p-40
/* Returns 1 if the function is linear in the body-frame components of the vertical and the angular
 * velocity. */
int kr_terms_are_linear(size_t n, const kr_term terms[]);
/* A function that is linear in the body-frame components of the vertical and the angular
 * velocity. */
typedef struct kr_linear {
    kr_vec3 along_vertical, along_velocity;
    double constant;
} kr_linear;
/* Returns the function of `event` as a linear function of components in working axes. `rate` is the
 * unit of frequency of the step. The function must be linear (kr_terms_are_linear). */
kr_linear kr_terms_linear_form(const kr_top *top, double rate, const kr_event *event);
#endif
