/* What the set-ups of the closed form share.
 *     alpha = w + i z,  beta = x + i y,   x(t) = x0 + nu t,   nome exp(-pi K'/K)
 *     alpha ~ theta1(x + i y1) e^{i(c1 + k1 t)},  beta ~ theta2(x + i y2) e^{i(c2 + k2 t)},
 *     m_x + i m_y ~ theta3(x + i(y1 + y2)) e^{i(c1 + c2 + (k1 + k2) t)},  all over theta4(x)
 * (Klein and Sommerfeld, Theorie des Kreisels; Jacobi for the free top.) Whatever grows with time
 * is computed in double-double, so that no error does; q is made a unit quaternion, so theta4 is
 * not needed. */
#ifndef KR_PLAN_H
#define KR_PLAN_H
#include "model/scene.h"
#include "numbers/dd.h"

#ifdef __GNUC__
#  define INLINE static inline __attribute__((always_inline))
#else
#  define INLINE static inline
#endif

static inline double length(double x, double y) { return sqrt(x * x + y * y); }

/* A scene in working axes and own units, unrounded. */
typedef struct exact_top {
    kr_vec3 inertia;
    dd q[4], lever; /* of any length; mass gravity com along T */
    kr_vec3 m;
    kr_quat axes; /* working axes -> frame of description */
    kr_units units;
} exact_top;

/* curves: of a plan's nome, or of its dual */
enum { LAGRANGE, EULER, LAGRANGE_DUAL, EULER_DUAL };
#endif
