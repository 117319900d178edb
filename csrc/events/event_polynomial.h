/* Event functions as polynomials over one time step, and bounds on their values. An event function
 * is a sum of terms. Each term is a factor times two state components (kr_term, kreisel.h). A step
 * `piece` has the Taylor polynomials of the state (kr_step_polynomial, method.h). The spin is the
 * angular velocity along the apex (a unit vector, kreisel.h), relative to the support. */
#ifndef KR_EVENT_POLYNOMIAL_H
#define KR_EVENT_POLYNOMIAL_H
#include "driver/top.h"

enum { KR_TERMS_ROOM = KR_POLYNOMIAL_ORDER_MAX + 16 };
/* Returns an upper bound on the magnitude of a sum of n terms during a step. To find sign changes,
 * the bound must be finite, and KR_TERMS_UNSURE times the bound, the noise, must not underflow. */
double kr_terms_bound(const kr_top *top, const kr_step_polynomial *piece, size_t n,
                      const kr_term terms[]);
/* Writes the event function, or for an extremum event its derivative, as a polynomial in s over the
 * step, 0 <= s <= 1. c[n] is the coefficient of s^n; c has KR_TERMS_ROOM elements. Returns the
 * degree. The polynomials of consecutive steps agree at their common time, up to rounding. */
int kr_terms_polynomial(const kr_top *top, const kr_step_polynomial *piece, const kr_event *event,
                        double c[]);
/* Returns 1 if the event function is a multiple of the spin, and friction keeps the spin zero. */
int kr_event_is_held(const kr_step_polynomial *piece, const kr_event *event);
/* Returns the sign of the event function in this step, if it is a multiple of the spin and the top
 * slides with dry friction. Otherwise returns 0. */
int kr_event_side_by_friction(const kr_step_polynomial *piece, const kr_event *event);
/* Magnitudes of an event function below KR_TERMS_UNSURE * kr_terms_bound count as zero. Until a
 * first sign is known, the limit is KR_TERMS_START * kr_terms_bound, because the function may be
 * zero initially, up to rounding errors. */
#define KR_TERMS_UNSURE 0x1p-50
#define KR_TERMS_START 0x1p-40
/* Returns 1 if a sum of n terms has the form of kr_linear. */
int kr_terms_are_linear(size_t n, const kr_term terms[]);
/* A linear function of two vectors in the body, the vertical P and the angular velocity W:
 * <along_vertical, P> + <along_velocity, W> + constant. */
typedef struct kr_linear {
    kr_vec3 along_vertical, along_velocity;
    double constant;
} kr_linear;
/* Returns the coefficients of an event function that has the form of kr_linear, along internal axes
 * (method.h). W is in units of `rate` / (internal unit of time). */
kr_linear kr_terms_linear_form(const kr_top *top, double rate, const kr_event *event);
#endif
