/* What the set-ups of the closed form share. With q = (w, x, y, z), alpha = w + i z and
 * beta = x + i y, a phase X(t) = X0 + nu t and the nome exp(-pi K'/K)
 *     alpha ~ theta1(X + i y1) e^{i(c1 + k1 t)},  beta ~ theta2(X + i y2) e^{i(c2 + k2 t)},
 *     m_x + i m_y ~ theta3(X + i(y1 + y2)) e^{i(c1 + c2 + (k1 + k2) t)},  all over theta4(X)
 * (Klein and Sommerfeld, Theorie des Kreisels; Jacobi for the free top.) Whatever grows with time
 * is computed in double-double, so that no error does. theta4 is not needed, because q is made a
 * unit quaternion. This header is part of what is compiled once per instruction set, because its
 * users are. */
#ifndef KR_EXACT_SETUP_H
#define KR_EXACT_SETUP_H
#include "model/scene.h"
#include "numbers/dd.h"
#include "numbers/isa.h"

static inline double length(double x, double y) { return sqrt(x * x + y * y); }

/* A scene in working axes and own units, where nothing is rounded. */
typedef struct exact_top {
    kr_vec3 inertia;
    dd q[4];  /* the attitude, which need not be of unit length */
    dd lever; /* mass gravity com along T */
    kr_vec3 m;
    kr_quat axes; /* working axes -> frame of description */
    kr_units units;
} exact_top;

/* The kinds of series: of the heavy and of the free top, in the nome or in its dual. The dual is
 * the smaller where the period K' is the shorter, near a separatrix. */
enum { LAGRANGE, EULER, LAGRANGE_DUAL, EULER_DUAL };
#endif
