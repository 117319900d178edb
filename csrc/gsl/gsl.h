/* The right-hand side of the equations of motion and its Jacobian, for the GSL methods. A test
 * checks the Jacobian against the right-hand side. */
#ifndef KR_GSL_H
#define KR_GSL_H
#include "method.h"

enum { GSL_SIZE = 7 };

/* Functions with the signatures that GSL requires. y is (q, W): attitude, angular velocity in the
 * body frame; `params` is the kr_motion. They write rate[i] = dy[i]/dt and d rate[i] / d y[j] =
 * jacobian[GSL_SIZE * i + j], and return GSL_EBADFUNC if a result is not finite. */
int kr_gsl_rates(double t, const double y[], double rate[], void *params);
int kr_gsl_jacobian(double t, const double y[], double *jacobian, double rate_t[], void *params);
#endif
