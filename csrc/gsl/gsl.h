/* The right-hand side of the equations of motion and its Jacobian, for the GSL methods (gsl.c). */
#ifndef KR_GSL_H
#define KR_GSL_H
#include "method.h"

enum { GSL_SIZE = 7 };

/* Functions with the signatures that GSL requires. y is (q, W): the attitude, and the angular
 * velocity in the body frame. `params` is the kr_motion, and the time t is not used. They write
 * rate[i] = dy[i]/dt, jacobian[GSL_SIZE * i + j] = d rate[i] / d y[j], and rate_t[i] = 0. They
 * return GSL_SUCCESS, or GSL_EBADFUNC if a result is not finite. */
int kr_gsl_rates(double t, const double y[], double rate[], void *params);
int kr_gsl_jacobian(double t, const double y[], double *jacobian, double rate_t[], void *params);
#endif
