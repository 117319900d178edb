/* The modified kick of Takahashi and Imada, with which a splitting (splitting.h) has order 4 up to
 * a change of variables. Let q be the attitude, m the momentum in space, h the step size, A the
 * lever (method.h), J the inertia, R the momentum of the rotor and, in the body frame, P = q* e3 q
 * the vertical, M = q* m q the momentum and W = J^-1 (M - R) the angular velocity. The kick is
 *     m += h e3 x q L q*,   L = A + k A x J^-1 N,   N = P x A,   k = -h^2/12
 * with the torque N. It is the kick of a modified potential: the potential <A,P> minus h^2/24 <N,
 * J^-1 N>. A step (half kick, drift, half kick) is conjugate to a method of order 4. The
 * conjugating map, called the processor, is the flow of the Hamiltonian G = k d<A,P>/dt from s = 0
 * to s = 1, where s is not the time t of the motion:
 *     angular velocity (per s) in the body frame: -k J^-1 N,   dm/ds = q (k P x (W x A)) q*
 * The flow is integrated by the implicit midpoint rule: the map for -k is then the inverse of the
 * map for k (Takahashi and Imada 1984; Rowlands 1991). The processor is applied when a state is
 * read, and its inverse when a state is set; the steps in between do not need it. The modified kick
 * conserves the vertical momentum, and for a Lagrange top also the axial momentum. */
#ifndef KR_MODIFIED_KICK_H
#define KR_MODIFIED_KICK_H
#include <float.h>
#include "method.h"

enum { PROCESSOR_MOST = 40 };

typedef struct modified_kick {
    kr_vec3 lever;
    kr_vec3 inverse; /* reciprocal moments */
    kr_vec3 rotor;   /* momentum of the rotor */
    double h, k;
    int lagrange; /* nonzero: the body is a Lagrange top */
} modified_kick;

static inline modified_kick make_modified_kick(const kr_motion *motion)
{
    const kr_vec3 I = motion->inertia;
    const double h = motion->step;
    const int lagrange = motion->lever.x == 0.0 && motion->lever.y == 0.0 &&
                         fabs(I.y - I.x) <= 4.0 * DBL_EPSILON * I.y;
    return (modified_kick){motion->lever, v3(1.0 / I.x, 1.0 / I.y, 1.0 / I.z),
                           motion->rotor, h,
                           -h * h / 12.0, lagrange};
}
/* Returns the change of m by `part` times a kick. For a Lagrange top with equatorial moment I, A =
 * (0, 0, b) and the symmetry axis a in space, (b - k b^2 <a,e3> / I) a replaces q L q*. This vector
 * has the same cross product with the vertical and costs less. */
static inline kr_vec3 modified_kick_impulse(const modified_kick *kick, kr_quat q, double part)
{
    const kr_vec3 A = kick->lever;
    kr_vec3 a = q_turn_e3(q);
    if (kick->lagrange)
        a = v_scale(A.z - kick->k * kick->inverse.x * (A.z * A.z) * a.z, a);
    else
        a = q_turn(q, v_axpy(kick->k,
                             v_cross(A, v_times(kick->inverse, v_cross(q_turn_e3_back(q), A))), A));
    return v3(-part * kick->h * a.y, part * kick->h * a.x, 0.0);
}
/* Returns 1 if the top rotates by at most max_angle radians per step, else 0. The estimated rate of
 * rotation is the larger of two rates: the largest that the energy of `start` permits, and the
 * largest that the momentum of the rotor alone can cause. */
static inline int modified_kick_is_step_small(const modified_kick *kick, const kr_state *start,
                                              double max_angle)
{
    const kr_vec3 M = v_sub(q_turn_back(start->q, start->m), kick->rotor), A = kick->lever;
    /* potential energy of `start` minus the smallest potential energy */
    const double above = v_dot(A, q_turn_e3_back(start->q)) + v_length(A);
    const double rate2 =
        (v_dot(M, v_times(kick->inverse, M)) + 2.0 * above) * v_largest(kick->inverse);
    const double carried = v_length(kick->rotor) * v_largest(kick->inverse);
    return kick->h * kick->h * fmax(rate2, carried * carried) <= max_angle * max_angle;
}
/* Applies the processor, or its inverse if `sign` is -1, to q and m. Returns KR_ERR_STEP_SIZE, and
 * leaves q and m unchanged, if the midpoint iteration does not converge, or if the modification of
 * the potential is not small: if h^2 |A| exceeds twice the smallest moment of inertia. */
static inline kr_status modified_kick_apply_processor(const modified_kick *kick, double sign,
                                                      kr_quat *q, kr_vec3 *m)
{
    const double k = sign * kick->k, size = v_largest(*m) + v_largest(kick->rotor);
    if (!(6.0 * fabs(k) * v_length(kick->lever) * v_largest(kick->inverse) <= 1.0))
        return KR_ERR_STEP_SIZE;
    kr_vec3 turn = v3(0.0, 0.0, 0.0), change = turn;
    for (int i = 0; i < PROCESSOR_MOST; i++) {
        const kr_vec3 last = turn, before = change;
        const kr_quat middle = q_mul(*q, q_exp(v_scale(0.5, turn)));
        const kr_vec3 P = q_turn_e3_back(middle), M = q_turn_back(middle, v_axpy(0.5, change, *m)),
                      W = v_times(kick->inverse, v_sub(M, kick->rotor));
        turn = v_scale(k, v_times(kick->inverse, v_cross(kick->lever, P)));
        change = q_turn(middle, v_scale(k, v_cross(P, v_cross(W, kick->lever))));
        if (v_largest(v_sub(turn, last)) <= DBL_EPSILON &&
            v_largest(v_sub(change, before)) <= DBL_EPSILON * size) {
            *q = q_mul(*q, q_exp(turn));
            *m = v_add(*m, change);
            return KR_OK;
        }
    }
    return KR_ERR_STEP_SIZE;
}
#endif
