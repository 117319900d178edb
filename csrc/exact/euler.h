/* Set-up of the closed-form solution for a torque-free top. Let a (axis 3) be the principal axis
 * around which the angular momentum m circulates in the body frame. The moment of inertia about
 * axis 3 is the largest or the smallest of the three. In the axes of the solution, the angular
 * momentum points along e3 and the body axis a along -e3. In this frame u = -a.e3 = c dn(X). The
 * functions alpha and beta are theta1 and theta4 in the square of the nome, with the common rate
 *     k = (m / I3 + e sum Q_n / 2) / 2,   e = 2T/m - m/I3,   p0^2 = 1/c^2.
 * D3 = |2T I3 - m^2| and D1 = |m^2 - 2T I1| are computed as sums of terms of equal sign (Jacobi
 * 1849; Whittaker, Dynamics, 69). */
#ifndef KR_EXACT_EULER_H
#define KR_EXACT_EULER_H
#include "math/trig.h"
#include "theta.h"

/* Sets up a motion in which alpha and beta have constant magnitudes and constant rates. Such
 * motions include those of sleeping, hanging and resting tops, and of symmetric bodies without
 * torque. */
static inline void steady_closed_form(kr_exact_form *exact, kr_quat q, dd first, dd second)
{
    const double a = length(q.w, q.z), b = length(q.x, q.y);
    exact->curve = LAGRANGE;
    phase_start(&exact->nutation, dd_of(0.25));
    exact->first = phase_of(first);
    exact->second = phase_of(second);
    phase_start(&exact->first, turns_of(q.z, q.w));
    phase_start(&exact->second, dd_add(turns_of(q.y, q.x), dd_of(-0.25)));
    exact->alpha.even[0] = a;
    exact->beta.odd[0] = b;
    exact->period = INFINITY;
    /* If the axis is vertical, the entire rotation is attributed to the spin. */
    exact->precession_rate = a > 0.0 && b > 0.0 ? first.hi + second.hi : 0.0;
    exact->spin_angle_rate = b == 0.0   ? 2.0 * first.hi
                             : a == 0.0 ? -2.0 * second.hi
                                        : first.hi - second.hi;
}
/* Sets the frame of the solution to q -> left * q * right. */
static inline void set_frame(kr_exact_form *exact, kr_quat left, kr_quat right)
{
    fill_frame(exact->frame, left, right);
    exact->framed = 1.0;
}

/* The principal axes, reordered so that axis 2 has the intermediate moment and the angular momentum
 * circulates around axis 3. The component of the angular momentum along axis 3 is nonnegative. */
typedef struct body_axes {
    dd inertia[3], momentum[3], square; /* [M L^2], [M L^2 T^-1], m^2 */
    dd d1, d3;                          /* D1, D3 */
    dd dm;                              /* a measure of the distance from the separatrix */
    double sense; /* 1 if I3 is the largest moment, -1 if it is the smallest */
    kr_quat turn; /* the attitude of these axes in the body */
} body_axes;

/* Returns the rotation that maps e3 to axis k, and e2 to axis `middle` or its negative. If
 * `reverse` is nonzero, the directions to which e1 and e3 are mapped are reversed. */
static kr_quat frame_of(int k, int middle, int reverse)
{
    const double h = 0.5, r = 0.70710678118654752440;
    kr_quat q = k == 2 ? q_one() : k == 0 ? q4(h, v3(h, h, h)) : q4(h, v3(-h, -h, -h));
    if (middle == (k + 1) % 3) q = q_mul(q, q4(r, v3(0.0, 0.0, r)));
    return reverse ? q_mul(q, q4(0.0, v3(0.0, 1.0, 0.0))) : q;
}
static void swap(int *a, int *b)
{
    const int t = *a;
    *a = *b;
    *b = t;
}

/* Reorders the principal axes, given the principal moments and the momentum m in the body frame. */
static body_axes body_axes_of(const double inertia[3], const dd m[3])
{
    int low = 0, middle = 1, high = 2;
    body_axes r;
    dd term[3];
    if (inertia[low] > inertia[middle]) swap(&low, &middle);
    if (inertia[middle] > inertia[high]) swap(&middle, &high);
    if (inertia[low] > inertia[middle]) swap(&low, &middle);
    const dd more = two_sum(inertia[high], -inertia[middle]),
             less = two_sum(inertia[middle], -inertia[low]);
    const dd above = dd_div(dd_mul(dd_square(m[high]), more), dd_of(inertia[high]));
    const dd below = dd_div(dd_mul(dd_square(m[low]), less), dd_of(inertia[low]));
    r.sense = dd_less(above, below) ? -1.0 : 1.0;
    r.dm = dd_abs(dd_sub(above, below));
    if (r.sense < 0.0) swap(&low, &high);
    const int reverse = m[high].hi < 0.0, odd = middle == (high + 1) % 3;
    const int index[3] = {low, middle, high};
    const double sign[3] = {reverse ? -1.0 : 1.0, odd ? -1.0 : 1.0, reverse ? -1.0 : 1.0};
    for (int i = 0; i < 3; i++) {
        r.inertia[i] = dd_of(inertia[index[i]]);
        r.momentum[i] = dd_times(sign[i], m[index[i]]);
        term[i] = dd_div(dd_square(r.momentum[i]), r.inertia[i]);
    }
    const dd i31 = dd_scale(r.sense, dd_sub(r.inertia[2], r.inertia[0]));
    const dd i32 = dd_scale(r.sense, dd_sub(r.inertia[2], r.inertia[1]));
    const dd i21 = dd_scale(r.sense, dd_sub(r.inertia[1], r.inertia[0]));
    r.d3 = dd_add(dd_mul(term[0], i31), dd_mul(term[1], i32));
    r.d1 = dd_add(dd_mul(term[1], i21), dd_mul(term[2], i31));
    r.square = dd_dot(m, m);
    r.turn = frame_of(high, middle, reverse);
    return r;
}
/* Returns a rotation that maps the direction of m to e3. A tiny m is scaled up first, because its
 * squares would underflow. It is tiny if the momentum of a rotor is much larger. */
static kr_quat rotation_to_e3(kr_vec3 m)
{
    if (v_largest(m) < 0x1p-400) m = v_scale(0x1p500, m);
    const double h = v_length(m) + fabs(m.z);
    if (m.z >= 0.0) return q_unit(q4(h, v3(m.y, -m.x, 0.0)));
    return q_unit(q4(m.y, v3(h, 0.0, m.x)));
}
/* Sets up the solution for a body that rests, rotates about a principal axis, or has two equal
 * moments of inertia. Returns 0 if the body has three distinct moments and does not rotate about a
 * principal axis. `half_turn` is half the rate that an axial rotor adds to the rotation about axis
 * 3. */
static int set_up_steady_motion(kr_exact_form *exact, const double inertia[3], const dd m[3],
                                dd square, dd half_turn, kr_quat q, kr_quat left)
{
    const dd size = dd_sqrt(square);
    /* Smaller components of the momentum are treated as zero, because their squares are
     * negligible. */
    const double least = 1e-75 * size.hi;
    const int has_rotor = half_turn.hi != 0.0;
    int k = 2, still = 0;
    for (int i = 0; i < 3; i++) still += !has_rotor && fabs(m[i].hi) <= least;
    for (int i = 0; i < 3 && !has_rotor; i++)
        if (still >= 2 ? fabs(m[i].hi) > least : inertia[(i + 1) % 3] == inertia[(i + 2) % 3])
            k = i;
    const dd across = dd_of(still >= 2 ? inertia[k] : inertia[(k + 1) % 3]);
    if (still < 2 && inertia[(k + 1) % 3] != inertia[(k + 2) % 3]) return 0;
    const dd half_precession = dd_half(dd_div(size, across));
    dd half_spin = dd_half(
        dd_mul(m[k], dd_sub(dd_div(dd_of(1.0), dd_of(inertia[k])), dd_div(dd_of(1.0), across))));
    if (has_rotor) half_spin = dd_add(half_spin, half_turn);
    const kr_quat axis = frame_of(k, (k + 2) % 3, 0);
    steady_closed_form(exact, q_mul(q_mul(q_conj(left), q), axis),
                       dd_add(half_precession, half_spin), dd_sub(half_precession, half_spin));
    set_frame(exact, left, q_conj(axis));
    if (m[k].hi < 0.0) exact->spin_angle_rate = -exact->spin_angle_rate;
    return 1;
}
/* Returns the common rate of the phases of alpha and beta, and writes agm(1, k') to `mean`. The
 * arguments `c2` and `flat` are c^2 and 1 - c^2. For small c, the sum starts from p0^2 = 1 + c^2
 * k^2 / flat, which avoids a division by c. */
static dd common_rate(const body_axes *a, dd c2, dd flat, dd k2, dd kp, dd *mean)
{
    const dd one = dd_of(1.0), size = dd_sqrt(a->square), ck = dd_mul(c2, k2);
    const dd excess = dd_div(dd_times(a->sense, a->d3), dd_mul(size, a->inertia[2]));
    const int far = c2.hi > 0.25;
    const dd p = far ? dd_div(one, c2) : dd_div(dd_add(flat, ck), flat);
    dd sum, k = dd_div(size, a->inertia[2]);
    *mean = elliptic_mean(kp, 1, &p, &sum);
    if (far) return dd_half(dd_add(k, dd_half(dd_mul(excess, sum))));
    const dd drop = dd_half(dd_mul(dd_div(ck, dd_add(flat, ck)), sum));
    const dd cross = dd_mul(*mean, dd_sqrt(dd_div(c2, dd_mul(flat, dd_add(flat, ck)))));
    return dd_half(dd_add(k, dd_mul(excess, dd_sub(dd_div(dd_sub(one, drop), flat), cross))));
}
/* Sets the coefficients of the theta series for alpha and beta. The arguments of both theta series
 * have the same imaginary part, an incomplete elliptic integral of the first kind. The scale
 * factors of the theta series are computed from the largest values of |alpha| and |beta|. */
static void euler_series(kr_exact_form *exact, const body_axes *a, double c2, double flat, dd k2,
                         double kp2, dd average)
{
    const double pi = 3.14159265358979323846, c = sqrt(c2), kp = sqrt(kp2),
                 quarter = sqrt(sqrt(kp));
    const double T = theta_stretch(exact, dd_twice(average), k2), limit = 0.25 * pi * T;
    const double b = sqrt(flat) * elliptic_rf(k2.hi * c2, k2.hi, flat + k2.hi * c2);
    const double y = -a->sense * fmin(average.hi * b, limit);
    const int dual = T < 1.0;
    const double nome = exp(dual ? -pi / T : -pi * T), shrink = dual ? 1.0 / T : 1.0;
    /* The largest value of |beta| is `above`, and the largest value of |alpha| is `below`. */
    const double above = sqrt(0.5 * (1.0 + c)),
                 below = sqrt(0.5 * (flat + c2 * k2.hi) / (1.0 + c * kp));
    exact->curve = dual ? EULER_DUAL : EULER;
    exact->slope[0] = exact->slope[1] = -y * shrink / pi;
    exact->alpha = theta_series(THETA1, nome, y * shrink, dual);
    exact->beta = theta_series(dual ? THETA2 : THETA4, nome, y * shrink, dual);
    if (dual) {
        const kr_theta pole = theta_series(THETA4, nome, y * shrink, 1);
        theta_scale(&exact->alpha,
                    below * 2.0 * sqrt(sqrt(nome)) / quarter / theta_at(pole.even, 0.0));
        theta_scale(&exact->beta, above / theta_at(exact->beta.even, 0.0));
    } else {
        theta_scale(&exact->alpha, below / theta_at(exact->alpha.even, 1.0));
        theta_scale(&exact->beta, above * quarter / theta_at(exact->beta.even, 0.0));
    }
}
/* LEAST_SQUARE is a lower bound imposed on k^2, k'^2 and 1 - c^2 to keep quotients finite. CLOSE is
 * the largest k'^2 at which the initial phase may be measured from the intermediate axis. */
#define LEAST_SQUARE 1e-280
#define CLOSE 1e-36

/* Returns the initial phase of the nutation, in turns. The elliptic functions cn and sn are
 * proportional to the momentum components M1 and M2. Near the intermediate axis, where sn = +-1,
 * the phase is measured from this axis by sn(K - x) = cn/dn. If the phase were measured from
 * another axis, it would be computed as the difference of two large numbers, and therefore be
 * inaccurate. */
static dd euler_start(const body_axes *a, dd i31, dd i32, double kp2, double mean)
{
    const double pi = 3.14159265358979323846, way = a->sense < 0.0 ? -1.0 : 1.0;
    const double cn = a->momentum[0].hi * sqrt(i31.hi / a->inertia[0].hi);
    const double sn = way * a->momentum[1].hi * sqrt(i32.hi / a->inertia[1].hi);
    const double r = cn * cn + sn * sn, c2 = cn * cn / r, s2 = sn * sn / r;
    if (kp2 < CLOSE && c2 < s2) {
        const double d2 = c2 + kp2 * s2;
        const double left =
            mean * sqrt(c2 / d2) * elliptic_rf(kp2 * s2 / d2, kp2 / d2, 1.0) / (2.0 * pi);
        const dd x = two_sum(0.25, cn < 0.0 ? left : -left);
        return sn < 0.0 ? dd_neg(x) : x;
    }
    double x = mean * sqrt(s2) * elliptic_rf(c2, c2 + kp2 * s2, 1.0);
    if (cn < 0.0) x = pi - x;
    return dd_of((sn < 0.0 ? -x : x) / 6.283185307179586477);
}
/* Sets up the motion of a torque-free body that has three distinct moments of inertia and does not
 * rotate about a principal axis. */
static void set_up_asymmetric_motion(kr_exact_form *exact, const body_axes *a, kr_quat q,
                                     kr_quat left)
{
    const dd i31 = dd_abs(dd_sub(a->inertia[2], a->inertia[0])),
             i32 = dd_abs(dd_sub(a->inertia[2], a->inertia[1]));
    const dd i21 = dd_abs(dd_sub(a->inertia[1], a->inertia[0])), den = dd_mul(i32, a->d1),
             least = dd_of(LEAST_SQUARE);
    const dd k2 = dd_max(dd_div(dd_mul(i21, a->d3), den), least);
    const dd kp2 = dd_max(dd_div(dd_mul(i31, a->dm), den), least);
    /* c2 is c^2, and `flat` is 1 - c^2. */
    const dd c2 = dd_div(dd_mul(a->inertia[2], a->d1), dd_mul(i31, a->square));
    const dd flat = dd_max(dd_div(dd_mul(a->inertia[0], a->d3), dd_mul(i31, a->square)), least);
    const dd lambda =
        dd_sqrt(dd_div(den, dd_mul(dd_mul(a->inertia[0], a->inertia[1]), a->inertia[2])));
    const kr_quat turn = q_mul(a->turn, q4(0.0, v3(1.0, 0.0, 0.0)));
    const kr_quat target = q_mul(q_mul(q_conj(left), q), turn);
    dd mean;
    const dd k = common_rate(a, c2, flat, k2, dd_sqrt(kp2), &mean);
    const double pi = 3.14159265358979323846;
    double f[6], s, c;
    euler_series(exact, a, c2.hi, flat.hi, k2, kp2.hi, mean);
    exact->nutation = phase_of(dd_mul(lambda, mean));
    phase_start(&exact->nutation, euler_start(a, i31, i32, kp2.hi, mean.hi));
    factors_at(exact, 0.0, f);
    exact->first = exact->second = phase_of(k);
    const dd first = turns_between(f[0], f[1], target.w, target.z),
             second = turns_between(f[2], f[3], target.x, target.y);
    phase_start(&exact->first, first);
    phase_start(&exact->second, first);
    /* alpha and beta use the same phase. The constant difference between their phases is included
     * in the frame, as a rotation about m. */
    sin_cos(pi * dd_sub(second, first).hi, &s, &c);
    set_frame(exact, q_mul(left, q4(c, v3(0.0, 0.0, s))),
              q_mul(q4(c, v3(0.0, 0.0, -s)), q_conj(turn)));
    set_mean_rates(exact, dd_mul(lambda, mean).hi, k.hi, k.hi);
    /* The mean spin refers to the axis direction on the side of the momentum, but here the axis
     * points along -e3. */
    exact->spin_angle_rate = -exact->spin_angle_rate;
}
/* Returns the closed-form solution for a torque-free body, in internal units. `half_turn` is half
 * the rate that an axial rotor adds to the rotation about axis 3. */
static kr_exact_form euler_closed_form(const exact_top *top, dd half_turn)
{
    const double pair = 0.5 * (top->inertia.x + top->inertia.y);
    const int has_rotor = half_turn.hi != 0.0;
    const double moments[3] = {has_rotor ? pair : top->inertia.x, has_rotor ? pair : top->inertia.y,
                               top->inertia.z};
    const dd m[3] = {dd_of(top->m.x), dd_of(top->m.y), dd_of(top->m.z)};
    const kr_quat q = rounded(top->q);
    kr_exact_form exact = {0};
    dd body[3];
    turned_back(top->q, m, body);
    exact.constant = top->m;
    const kr_quat left = v_largest(top->m) == 0.0 ? q_one() : q_conj(rotation_to_e3(top->m));
    if (!set_up_steady_motion(&exact, moments, body, dd_dot(body, body), half_turn, q, left)) {
        const body_axes a = body_axes_of(moments, body);
        set_up_asymmetric_motion(&exact, &a, q, left);
    }
    return exact;
}
#endif
