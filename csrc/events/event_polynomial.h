/* Event functions as polynomials over one time step, and bounds on their values. */
#ifndef KR_EVENT_POLYNOMIAL_H
#define KR_EVENT_POLYNOMIAL_H
#include "driver/top.h"

enum { KR_TERMS_ROOM = KR_POLYNOMIAL_ORDER_MAX + 16 };
/* Returns an upper bound on the magnitude of a sum of n terms during a step. The search for sign
 * changes of the event function requires this bound to be finite and nonzero. */
double kr_terms_bound(const kr_top *top, const kr_step_polynomial *piece, size_t n,
                      const kr_term terms[]);
/* Writes the event function g as a polynomial in s over the step, 0 <= s <= 1, and returns the
 * degree. For an extremum event, the polynomial is the derivative of the event function g. The
 * polynomials of two consecutive steps agree, up to rounding errors, at the time that both steps
 * share. The array c has KR_TERMS_ROOM elements. */
int kr_terms_polynomial(const kr_top *top, const kr_step_polynomial *piece, const kr_event *event,
                        double c[]);
/* Returns 1 if the event function is a multiple of the spin, which is zero in this step because
 * friction has stopped the top. */
int kr_event_is_held(const kr_step_polynomial *piece, const kr_event *event);
/* Returns the sign of an event function that is a multiple of the spin, in a step in which friction
 * acts on a sliding top. Returns 0 for all other steps and event functions. */
int kr_event_side_by_friction(const kr_step_polynomial *piece, const kr_event *event);
/* Values of an event function below KR_TERMS_UNSURE times its upper bound are treated as zero.
 * Until a first sign is known, the larger threshold KR_TERMS_START is used instead, because an
 * event function may be exactly zero at the initial state. */
#define KR_TERMS_UNSURE 0x1p-50
#define KR_TERMS_START 0x1p-40
/* Returns 1 if an event function has the form of kr_linear. */
int kr_terms_are_linear(size_t n, const kr_term terms[]);
/* A function that is linear in the body-frame components of the vertical and the angular
 * velocity. */
typedef struct kr_linear {
    kr_vec3 along_vertical, along_velocity;
    double constant;
} kr_linear;
/* Returns the coefficients of a linear event function (see kr_terms_are_linear), in the axes that
 * the method uses. `rate` is the unit of frequency. */
kr_linear kr_terms_linear_form(const kr_top *top, double rate, const kr_event *event);
#endif
