/* Event functions as polynomials over one time step, and bounds on their values. */
#ifndef KR_EVENT_POLYNOMIAL_H
#define KR_EVENT_POLYNOMIAL_H
#include "driver/top.h"

enum { KR_TERMS_ROOM = KR_POLYNOMIAL_ORDER_MAX + 16 };
/* Returns an upper bound on the magnitude of a sum of n terms during a step. Sign changes can be
 * found if it is finite and not zero. */
double kr_terms_bound(const kr_top *top, const kr_step_polynomial *piece, size_t n,
                      const kr_term terms[]);
/* Writes the event function, or its derivative for an extremum, as a polynomial in s over the step,
 * 0 <= s <= 1, and returns the degree. The polynomials of consecutive steps agree, up to rounding
 * errors, at the time that both share. The array c has KR_TERMS_ROOM elements. */
int kr_terms_polynomial(const kr_top *top, const kr_step_polynomial *piece, const kr_event *event,
                        double c[]);
/* Returns 1 if the event function is a multiple of the spin, which is zero in this step because
 * friction has stopped the top. */
int kr_event_is_held(const kr_step_polynomial *piece, const kr_event *event);
/* Returns the sign of an event function that is a multiple of the spin while the top slides, else
 * 0. */
int kr_event_side_by_friction(const kr_step_polynomial *piece, const kr_event *event);
/* Values below KR_TERMS_UNSURE times the upper bound count as zero, and before a first sign is
 * known those below KR_TERMS_START times it, because an event function may be exactly zero at the
 * start. */
#define KR_TERMS_UNSURE 0x1p-50
#define KR_TERMS_START 0x1p-40
/* Returns 1 if an event function has the form of kr_linear. */
int kr_terms_are_linear(size_t n, const kr_term terms[]);
/* A linear function of the components in the body of the vertical and of the angular velocity. */
typedef struct kr_linear {
    kr_vec3 along_vertical, along_velocity;
    double constant;
} kr_linear;
/* Returns the coefficients of an event function of this form along internal axes. `rate` is the
 * unit of frequency. */
kr_linear kr_terms_linear_form(const kr_top *top, double rate, const kr_event *event);
#endif
