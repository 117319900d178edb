/* What the set-ups of the closed form share. With q = (w, x, y, z), alpha = w + i z and
 * beta = x + i y, a phase X(t) = X0 + nu t and the nome exp(-pi K'/K)
 *     alpha ~ theta1(X + i y1) e^{i(c1 + k1 t)},  beta ~ theta2(X + i y2) e^{i(c2 + k2 t)},
 *     m_x + i m_y ~ theta3(X + i(y1 + y2)) e^{i(c1 + c2 + (k1 + k2) t)},  all over theta4(X)
 * (Klein and Sommerfeld, Theorie des Kreisels; Jacobi for the free top.) Whatever grows with time
 * is computed in double-double, so that no error does. theta4 is not needed, because q is made a
 * unit quaternion.
 *
 * This header is part of what is compiled once per instruction set, because its users are; and once
 * more with KR_EXACT_LANES, where each number is a vector whose lanes are tops (math/simd.h).
 * That gives each top the bits which it has alone: a branch that some lanes take and others do not
 * is taken both ways, and each lane chooses; a loop goes on until all lanes are done, and leaves
 * those that are as they were. With one lane that is the branch, and the loop, of one top. */
#ifndef KR_EXACT_LANE_TYPES_H
#define KR_EXACT_LANE_TYPES_H
#if defined KR_EXACT_LANES
#  define KR_DD_LANES
#else
#  define KR_ONE_LANE
#endif
#include "model/scene.h"
#include "math/dd.h"
#include "math/isa.h"
#include "math/simd.h"

/* The kinds of series: of the heavy and of the free top, in the nome or in its dual. The dual is
 * the smaller where the period K' is the shorter, near a separatrix. */
enum { LAGRANGE, EULER, LAGRANGE_DUAL, EULER_DUAL };

/* What kreisel.h has for one top, for as many as there are lanes. */
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
/* The members are those of kr_exact, in its order, but for the frame. */
typedef struct exact_lanes {
    wide period, precession, spin, begin, curve;
    phase_lanes nutation, first, second;
    wide stretch, stretch_rest, slope[2];
    theta_lanes alpha, beta, horizontal;
    wide momentum, side;
    vec3_lanes constant;
} exact_lanes;
/* Lanes hold heavy tops only. */
INLINE int is_euler(const exact_lanes *e) { return (void)e, 0; }
INLINE mask is_dual(const exact_lanes *e)
{
    return wide_equal(e->curve, wide_splat(LAGRANGE_DUAL));
}
INLINE void set_curve(exact_lanes *e, int curve) { e->curve = wide_splat(curve); }
#else
typedef kr_vec3 vec3_lanes;
typedef kr_quat quat_lanes;
typedef kr_state state_lanes;
typedef kr_theta theta_lanes;
typedef kr_phase phase_lanes;
typedef kr_exact exact_lanes;
INLINE int is_euler(const kr_exact *e) { return e->curve == EULER || e->curve == EULER_DUAL; }
INLINE mask is_dual(const kr_exact *e)
{
    return e->curve == LAGRANGE_DUAL || e->curve == EULER_DUAL;
}
INLINE void set_curve(kr_exact *e, int curve) { e->curve = curve; }
#endif
/* Replaces lanes of `to` by those of `from` where m holds; each is a structure of `bytes` that has
 * nothing but lanes. */
INLINE void take_lanes(void *to, const void *from, size_t bytes, mask m)
{
    for (size_t at = 0; at < bytes; at += sizeof(wide)) {
        wide *old = (wide *)(void *)((char *)to + at);
        *old = wide_choose(m, *(const wide *)(const void *)((const char *)from + at), *old);
    }
}

/* What pulls less than this, in own units, where either the momentum or the pull is about one,
 * moves nothing at any time that a double resolves: it is no pull. And what is so small of the
 * momentum is none: its square underflows. */
#define LEAST_LEVER 1e-100
#define LEAST_MOMENTUM 1e-160

/* A scene in working axes and own units, where nothing is rounded. */
typedef struct exact_top {
    vec3_lanes inertia;
    dd q[4];  /* the attitude, which need not be of unit length */
    dd lever; /* mass gravity com along T */
    vec3_lanes m;
} exact_top;

/* Returns a > b; false for NaN. */
INLINE mask wide_more(wide a, wide b) { return wide_less(b, a); }
INLINE mask is_negative(wide a) { return wide_less(a, wide_splat(0.0)); }
INLINE mask is_positive(wide a) { return wide_less(wide_splat(0.0), a); }
/* Returns -1 where m holds, else 1. */
INLINE wide minus_where(mask m) { return wide_choose(m, wide_splat(-1.0), wide_splat(1.0)); }
INLINE wide length(wide x, wide y) { return wide_sqrt(x * x + y * y); }
#endif
