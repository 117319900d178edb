/* Types and constants shared by the set-up code of the closed-form solutions. With q = (w, x, y,
 * z), alpha = w + i z and beta = x + i y, a phase X(t) = X0 + nu t and the nome exp(-pi K'/K)
 *     alpha ~ theta1(X + i y1) e^{i(c1 + k1 t)},  beta ~ theta2(X + i y2) e^{i(c2 + k2 t)},
 *     m_x + i m_y ~ theta3(X + i(y1 + y2)) e^{i(c1 + c2 + (k1 + k2) t)},  all over theta4(X)
 * (Klein and Sommerfeld, Theorie des Kreisels). For torque-free tops (Jacobi), beta contains theta4
 * instead of theta2, and the momentum is constant. All quantities that grow with time are
 * double-doubles, so that the errors of states do not grow. The common denominator theta4(X)
 * cancels when q is normalized.
 *
 * This header is compiled for each instruction set, both with and without KR_EXACT_LANES. With
 * KR_EXACT_LANES, each number is a vector with one lane per top (math/simd.h). The result in each
 * lane is bitwise equal to that of the scalar code. If lanes take different branches, both branches
 * are computed, and each lane selects its own result. A loop runs until all lanes are finished,
 * leaving finished lanes unchanged. Without KR_EXACT_LANES, a single top is processed with ordinary
 * branches and loops. */
#ifndef KR_EXACT_LANE_TYPES_H
#define KR_EXACT_LANE_TYPES_H
#if defined KR_EXACT_LANES
#  define KR_DD_LANES
#else
#  define KR_ONE_LANE
#endif
#include "layout.h"
#include "model/scene.h"
#include "math/dd.h"
#include "math/isa.h"
#include "math/simd.h"

/* The kinds of theta series, for heavy (LAGRANGE) and torque-free (EULER) tops, in powers of the
 * nome or of the dual nome. The dual nome is smaller than the nome if K' < K, for example near a
 * separatrix. */
enum { LAGRANGE, EULER, LAGRANGE_DUAL, EULER_DUAL };

/* Vector versions of the types in kreisel.h and layout.h, with one lane per top. */
#if defined KR_EXACT_LANES
typedef struct vec3_lanes {
    wide x, y, z;
} vec3_lanes;
typedef struct quat_lanes {
    wide w, x, y, z;
} quat_lanes;
typedef struct state_lanes {
    wide t;
    quat_lanes q;
    vec3_lanes m;
} state_lanes;
typedef struct theta_lanes {
    wide even[KR_THETA_TERMS], odd[KR_THETA_TERMS];
} theta_lanes;
typedef struct phase_lanes {
    wide fast, slow, start, more;
} phase_lanes;
/* The vector version of kr_exact_form, without the members `framed` and `frame`. */
typedef struct exact_lanes {
    wide period, precession_rate, spin_angle_rate, begin, curve;
    phase_lanes nutation, first, second;
    wide stretch, stretch_rest, slope[2];
    theta_lanes alpha, beta, horizontal;
    wide momentum, side;
    vec3_lanes constant;
} exact_lanes;
/* Only heavy tops are processed in vector lanes. */
INLINE int is_euler(const exact_lanes *e) { return (void)e, 0; }
INLINE mask is_dual(const exact_lanes *e)
{
    return wide_equal(e->curve, wide_splat(LAGRANGE_DUAL));
}
#else
typedef kr_vec3 vec3_lanes;
typedef kr_quat quat_lanes;
typedef kr_state state_lanes;
typedef kr_theta theta_lanes;
typedef kr_phase phase_lanes;
typedef kr_exact_form exact_lanes;
INLINE int is_euler(const kr_exact_form *e) { return e->curve == EULER || e->curve == EULER_DUAL; }
INLINE mask is_dual(const kr_exact_form *e)
{
    return e->curve == LAGRANGE_DUAL || e->curve == EULER_DUAL;
}
#endif
/* Copies the lanes selected by the mask m to `to`, and leaves the other lanes of `to` unchanged.
 * Both arguments must point to structures whose members are all SIMD vectors. */
INLINE void take_lanes(void *to, const void *from, size_t bytes, mask m)
{
    for (size_t at = 0; at < bytes; at += sizeof(wide)) {
        wide *old = (wide *)(void *)((char *)to + at);
        *old = wide_choose(m, *(const wide *)(const void *)((const char *)from + at), *old);
    }
}

/* In internal units, the larger of the momentum and weight * |com| is about one. If weight * |com|
 * is below LEAST_LEVER, it is treated as zero, because its effect is negligible at all times that
 * doubles can resolve. Momentum components below LEAST_MOMENTUM are treated as zero, because their
 * squares underflow. */
#define LEAST_LEVER 1e-100
#define LEAST_MOMENTUM 1e-160

/* A top and its initial state in internal axes and units. The attitude in these axes and the
 * component of weight * com along T are stored in double-double precision. */
typedef struct exact_top {
    vec3_lanes inertia;
    dd q[4];  /* the attitude, which need not be of unit length */
    dd lever; /* mass * gravity * com along T */
    vec3_lanes m;
} exact_top;

/* Returns a > b, which is false for NaN. */
INLINE mask wide_more(wide a, wide b) { return wide_less(b, a); }
INLINE mask is_negative(wide a) { return wide_less(a, wide_splat(0.0)); }
INLINE mask is_positive(wide a) { return wide_less(wide_splat(0.0), a); }
/* Returns -1 in the lanes selected by the mask m, and 1 in all others. */
INLINE wide minus_where(mask m) { return wide_choose(m, wide_splat(-1.0), wide_splat(1.0)); }
INLINE wide length(wide x, wide y) { return wide_sqrt(x * x + y * y); }
#endif
