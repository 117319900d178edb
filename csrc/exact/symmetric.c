/* Set-up, states and turning points of the closed form of a Lagrange top (lagrange.h) or a free
 * body: a kr_exact_form (exact.h, with the symbols of kernel.h). This file is compiled once for
 * each instruction set, because double-double products are three times as fast with fused
 * multiply-add. Internal axes and units are those of method.h.
 *
 * A torque-free body has the kinetic energy E, the angular momentum m and the principal moments I1,
 * I2 and I3, where I2 is the intermediate one. In the body, m circulates about a principal axis a,
 * called axis 3, whose moment I3 is the largest or the smallest. The closed form has e3 along m and
 * -a as third axis of the body, with the height u = -a.e3 = -c dn(F, k), F = 2 K X / pi. With
 * D1 = |m^2 - 2E I1| and D3 = |2E I3 - m^2|, computed as sums of terms of equal sign,
 *     c^2 = I3 D1 / (|I3 - I1| m^2),   k^2 = |I2 - I1| D3 / (|I3 - I2| D1).
 * alpha and beta are proportional to theta1 and theta4 of the nome exp(-2 pi K'/K). Their phases
 * grow at the rate (|m| / I3 + (E / |m| - |m| / (2 I3)) S) / 2, with the sum S of find_agm_and_sums
 * (lagrange.h) for p_0^2 = 1/c^2 (Jacobi 1849; Whittaker, Dynamics, 69). */
#include "lagrange.h"
#include "math/exponent.h"
#include "math/trig.h"

/* A top in internal axes and units, and the data for converting results to the user's axes and
 * units. The internal units are powers of two, and attitude and lever are double-doubles: rounding
 * to double precision would change rates, and cause errors that grow with time. */
typedef struct described_top {
    exact_top own;
    int behind;   /* nonzero if the apex is opposite to the third internal axis */
    dd half_turn; /* half of the rate -rotor / I3 that the rotor adds to the spin */
    kr_quat axes; /* internal axes -> frame of description */
    kr_units units;
} described_top;

/* Returns |com| of a spherical body; `com` has components along the principal axes. `tilt` becomes
 * the tiny rotation from the third internal axis, as given by the rounded w->axes, to `com`. */
static dd find_com_length_and_tilt(kr_vec3 com, const kr_working *w, kr_quat *tilt)
{
    const dd axes[4] = {dd_of(w->axes.w), dd_of(w->axes.x), dd_of(w->axes.y), dd_of(w->axes.z)};
    /* `com` is divided by its largest component, because squares may overflow or underflow. */
    const double size = v_largest(com), xyz[3] = {com.x, com.y, com.z};
    dd unit[3], c[3];
    for (int i = 0; i < 3; i++) unit[i] = dd_div(dd_of(xyz[i]), dd_of(size));
    turn_back_dd(axes, unit, c);
    const dd reach = dd_sqrt(dd_dot(c, c));
    const double twice = reach.hi + c[2].hi;
    *tilt = q4(1.0, v3(-c[1].hi / twice, c[0].hi / twice, 0.0));
    return dd_times(size, reach);
}
/* Returns half the rate -rotor / I3 that the rotor adds to the spin, in internal units. If
 * w->tilted (body.h) is 1, |b->rotor| replaces |w->rotor.z|, which rounding has changed. */
static dd find_half_spin_due_to_rotor(const kr_body *b, const kr_working *w, const kr_units *units)
{
    const double scale = units->time, per_moment = 1.0 / units->moment;
    const kr_vec3 h = v_scale(scale, v_scale(per_moment, b->rotor));
    const double along = drop_tiny_momentum(scale * (per_moment * w->rotor.z));
    dd size = dd_of(along);
    if (w->tilted && along != 0.0) {
        const dd xyz[3] = {dd_of(h.x), dd_of(h.y), dd_of(h.z)};
        size = dd_scale(along < 0.0 ? -1.0 : 1.0, dd_sqrt(dd_dot(xyz, xyz)));
    }
    return dd_scale(-0.5, dd_div(size, dd_of(per_moment * w->inertia.z)));
}
static kr_status convert_to_internal(const kr_scene *scene, kr_kind kind, described_top *top)
{
    const kr_body *b = &scene->body;
    const kr_pull pull = kr_scene_pull(scene, b->com);
    const kr_working w = kr_body_working(b);
    const kr_status status = kr_scene_units(scene, &w, &top->units);
    if (status != KR_OK) return status;
    const double moment = top->units.moment, time = top->units.time,
                 along = q_turn_back(w.axes, pull.com).z;
    const kr_quat q = scene->start.q;
    const kr_vec3 m = v_scale(time, v_scale(1.0 / moment, scene->start.m));
    exact_top *own = &top->own;
    top->behind = along < 0.0;
    top->axes = q_unit(q_mul(b->axes, w.axes));
    top->half_turn = find_half_spin_due_to_rotor(b, &w, &top->units);
    own->inertia = v_scale(1.0 / moment, w.inertia);
    own->m = v3(drop_tiny_momentum(m.x), drop_tiny_momentum(m.y), drop_tiny_momentum(m.z));
    own->q[0] = dd_of(q.w);
    own->q[1] = dd_of(q.x);
    own->q[2] = dd_of(q.y);
    own->q[3] = dd_of(q.z);
    if (!is_identity(b->axes)) multiply_from_right(own->q, b->axes);
    if (!is_identity(w.axes)) multiply_from_right(own->q, w.axes);
    dd reach = dd_of(kind == KR_KIND_LAGRANGE ? along : 0.0);
    if (w.tilted && kind == KR_KIND_LAGRANGE) {
        kr_quat tilt;
        reach = find_com_length_and_tilt(pull.com, &w, &tilt);
        multiply_from_right(own->q, tilt);
    }
    const int power = pull.power - exponent_of(moment) + 2 * exponent_of(time);
    const dd lever = dd_times(pull.mass, dd_times(pull.gravity, reach));
    own->lever = dd_make(times_power_of_2(lever.hi, power), times_power_of_2(lever.lo, power));
    if (fabs(own->lever.hi) < LEAST_LEVER) own->lever = dd_of(0.0);
    return KR_OK;
}
/* Sets `exact` to a motion with constant |alpha| and |beta|: of a sleeping, hanging or resting top,
 * or a free body that is symmetric or rotates about a principal axis. The phases of alpha and beta
 * grow at the rates `first` and `second` [rad per unit of time]. `q` is the initial attitude. */
static inline void set_up_steady_form(kr_exact_form *exact, kr_quat q, dd first, dd second)
{
    const double a = length(q.w, q.z), b = length(q.x, q.y);
    exact->curve = LAGRANGE;
    set_initial_phase(&exact->nutation, dd_of(0.25));
    exact->first = make_phase(first);
    exact->second = make_phase(second);
    set_initial_phase(&exact->first, argument_in_turns(q.z, q.w));
    set_initial_phase(&exact->second, dd_add(argument_in_turns(q.y, q.x), dd_of(-0.25)));
    exact->alpha.even[0] = a;
    exact->beta.odd[0] = b;
    exact->period = INFINITY;
    /* If the axis is vertical, the entire rotation is attributed to the spin. */
    exact->precession_rate = a > 0.0 && b > 0.0 ? first.hi + second.hi : 0.0;
    exact->spin_angle_rate = b == 0.0   ? 2.0 * first.hi
                             : a == 0.0 ? -2.0 * second.hi
                                        : first.hi - second.hi;
}
/* Sets the linear map exact->frame (kernel.h) of a closed form to q -> left * q * right. */
static inline void set_form_map(kr_exact_form *exact, kr_quat left, kr_quat right)
{
    set_left_right_map(exact->frame, left, right);
    exact->framed = 1.0;
}

/* The principal axes of a free body. Axis 2 has the intermediate moment, and m circulates about
 * axis 3 (opening comment). The component of m along axis 3 is nonnegative. */
typedef struct body_axes {
    dd inertia[3], momentum[3], square; /* [M L^2], [M L^2 T^-1], m^2 */
    dd d1, d3;                          /* D1, D3 */
    dd dm;                              /* |2E I2 - m^2|, which is 0 on the separatrix */
    double sense; /* 1 if I3 is the largest moment, -1 if it is the smallest */
    kr_quat turn; /* these axes -> internal axes */
} body_axes;

/* Returns the rotation that maps z to the axis `third`, and y to the axis `middle` or its negative
 * (axes 0, 1 and 2 are x, y and z). If `reverse` is nonzero, the images of x and z are reversed. */
static kr_quat find_axis_permutation(int third, int middle, int reverse)
{
    const double h = 0.5, r = 0.70710678118654752440;
    kr_quat q = third == 2 ? q_one() : third == 0 ? q4(h, v3(h, h, h)) : q4(h, v3(-h, -h, -h));
    if (middle == (third + 1) % 3) q = q_mul(q, q4(r, v3(0.0, 0.0, r)));
    return reverse ? q_mul(q, q4(0.0, v3(0.0, 1.0, 0.0))) : q;
}
/* Returns the reordered axes, given three different moments and the momentum m along them. */
static body_axes reorder_axes(const double inertia[3], const dd m[3])
{
    int low = 0, high = 0;
    body_axes r;
    dd term[3];
    for (int i = 1; i < 3; i++) {
        if (inertia[i] < inertia[low]) low = i;
        if (inertia[i] > inertia[high]) high = i;
    }
    const int middle = 3 - low - high;
    const dd more = two_sum(inertia[high], -inertia[middle]),
             less = two_sum(inertia[middle], -inertia[low]);
    const dd above = dd_div(dd_mul(dd_square(m[high]), more), dd_of(inertia[high]));
    const dd below = dd_div(dd_mul(dd_square(m[low]), less), dd_of(inertia[low]));
    r.sense = dd_less(above, below) ? -1.0 : 1.0;
    r.dm = dd_abs(dd_sub(above, below));
    if (r.sense < 0.0) {
        low = high;
        high = 3 - low - middle;
    }
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
    r.turn = find_axis_permutation(high, middle, reverse);
    return r;
}
/* Returns a rotation that maps m / |m| to e3. A tiny m is scaled up: squares would underflow. */
static kr_quat find_rotation_to_e3(kr_vec3 m)
{
    if (v_largest(m) < 0x1p-400) m = v_scale(0x1p500, m);
    const double h = v_length(m) + fabs(m.z);
    if (m.z >= 0.0) return q_unit(q4(h, v3(m.y, -m.x, 0.0)));
    return q_unit(q4(m.y, v3(h, 0.0, m.x)));
}
/* Sets up the closed form of a torque-free body that rests, rotates about a principal axis, or has
 * two equal moments, and returns 1. Returns 0 for all other motions. `m` contains the components of
 * the momentum along the internal axes, and `square` is |m|^2. `q` is the initial attitude. `left`
 * rotates e3 to the direction of the momentum in space. `half_turn` is half the rate that an axial
 * rotor adds to the rotation about the third internal axis. */
static int set_up_free_motion_if_steady(kr_exact_form *exact, const double inertia[3],
                                        const dd m[3], dd square, dd half_turn, kr_quat q,
                                        kr_quat left)
{
    const dd size = dd_sqrt(square);
    /* Smaller components of the momentum count as zero: their squares are negligible. */
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
    const kr_quat axis = find_axis_permutation(k, (k + 2) % 3, 0);
    set_up_steady_form(exact, q_mul(q_mul(q_conj(left), q), axis),
                       dd_add(half_precession, half_spin), dd_sub(half_precession, half_spin));
    set_form_map(exact, left, q_conj(axis));
    if (m[k].hi < 0.0) exact->spin_angle_rate = -exact->spin_angle_rate;
    return 1;
}
/* Returns the common rate of the phases of alpha and beta [rad per unit of time], and writes agm(1,
 * k') to `mean`. `c2`, `flat`, `k2` and `kp` are c^2, 1 - c^2, k^2 and k'. If c^2 <= 1/4, the
 * formula of the opening comment is transformed to avoid the division by c (DLMF 19.7.8). The
 * transformed formula contains the sum of Q_n for p0^2 = 1 + c^2 k^2 / (1 - c^2). */
static dd find_common_phase_rate(const body_axes *a, dd c2, dd flat, dd k2, dd kp, dd *mean)
{
    const dd one = dd_of(1.0), size = dd_sqrt(a->square), ck = dd_mul(c2, k2);
    const dd excess = dd_div(dd_times(a->sense, a->d3), dd_mul(size, a->inertia[2]));
    const int far = c2.hi > 0.25;
    const dd p = far ? dd_div(one, c2) : dd_div(dd_add(flat, ck), flat);
    dd sum, k = dd_div(size, a->inertia[2]);
    *mean = find_agm_and_sums(kp, 1, &p, &sum);
    if (far) return dd_half(dd_add(k, dd_half(dd_mul(excess, sum))));
    const dd drop = dd_half(dd_mul(dd_div(ck, dd_add(flat, ck)), sum));
    const dd cross = dd_mul(*mean, dd_sqrt(dd_div(c2, dd_mul(flat, dd_add(flat, ck)))));
    return dd_half(dd_add(k, dd_mul(excess, dd_sub(dd_div(dd_sub(one, drop), flat), cross))));
}
/* Sets the theta series of alpha and beta. Their arguments have the same imaginary part y, which an
 * incomplete elliptic integral of the first kind determines. `c2`, `flat`, `k2` and `kp2` are c^2,
 * 1 - c^2, k^2 and k'^2, and `average` is agm(1, k'). */
static void set_euler_series(kr_exact_form *exact, const body_axes *a, double c2, double flat,
                             dd k2, double kp2, dd average)
{
    const double pi = 3.14159265358979323846, c = sqrt(c2), kp = sqrt(kp2),
                 T = find_period_ratio_and_stretch(exact, dd_twice(average), k2),
                 limit = 0.25 * pi * T,
                 b = sqrt(flat) * elliptic_rf(k2.hi * c2, k2.hi, flat + k2.hi * c2);
    const int dual = T < 1.0;
    const double shrink = dual ? 1.0 / T : 1.0, nome = exp(dual ? -pi / T : -pi * T),
                 y = -a->sense * fmin(average.hi * b, limit);
    const double below = sqrt(0.5 * (flat + c2 * k2.hi) / (1.0 + c * kp)), /* largest |alpha| */
        above = sqrt(0.5 * (1.0 + c)),                                     /* largest |beta| */
        quarter = sqrt(sqrt(kp));
    exact->curve = dual ? EULER_DUAL : EULER;
    exact->slope[0] = exact->slope[1] = -y * shrink / pi;
    exact->alpha = make_theta_series(THETA1, nome, y * shrink, dual);
    exact->beta = make_theta_series(dual ? THETA2 : THETA4, nome, y * shrink, dual);
    if (dual) {
        const kr_theta pole = make_theta_series(THETA4, nome, y * shrink, 1);
        scale_theta(&exact->alpha,
                    below * 2.0 * sqrt(sqrt(nome)) / quarter / evaluate_poly(pole.even, 0.0));
        scale_theta(&exact->beta, above / evaluate_poly(exact->beta.even, 0.0));
    } else {
        scale_theta(&exact->alpha, below / evaluate_poly(exact->alpha.even, 1.0));
        scale_theta(&exact->beta, above * quarter / evaluate_poly(exact->beta.even, 0.0));
    }
}
/* LEAST_SQUARE replaces smaller values of k^2, k'^2 and 1 - c^2, to keep quotients finite. */
#define LEAST_SQUARE 1e-280
#define NEAR_SEPARATRIX_KP2 1e-36

/* Returns the initial phase of the nutation, F / (4 K) [turns]. The initial m is cn F along axis 1
 * and a->sense * sn F along axis 2, times positive factors. `i31` and `i32` are |I3 - I1| and |I3 -
 * I2|, `kp2` is k'^2, `mean` is agm(1, k'). Near a separatrix, K is large: then F near K is
 * computed as K minus the solution of sn(K - F) = cn F / dn F. */
static dd find_free_nutation_phase(const body_axes *a, dd i31, dd i32, double kp2, double mean)
{
    const double pi = 3.14159265358979323846, way = a->sense < 0.0 ? -1.0 : 1.0;
    const double cn = a->momentum[0].hi * sqrt(i31.hi / a->inertia[0].hi);
    const double sn = way * a->momentum[1].hi * sqrt(i32.hi / a->inertia[1].hi);
    const double r = cn * cn + sn * sn, c2 = cn * cn / r, s2 = sn * sn / r;
    if (kp2 < NEAR_SEPARATRIX_KP2 && c2 < s2) {
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
/* Sets up the closed form of a torque-free body with three distinct moments that does not rotate
 * about a principal axis. `q` is the initial attitude. `left` rotates e3 to m in space. */
static void set_up_asymmetric_free_motion(kr_exact_form *exact, const body_axes *a, kr_quat q,
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
    const dd k = find_common_phase_rate(a, c2, flat, k2, dd_sqrt(kp2), &mean);
    const double pi = 3.14159265358979323846;
    double f[6], s, c;
    set_euler_series(exact, a, c2.hi, flat.hi, k2, kp2.hi, mean);
    exact->nutation = make_phase(dd_mul(lambda, mean));
    set_initial_phase(&exact->nutation, find_free_nutation_phase(a, i31, i32, kp2.hi, mean.hi));
    evaluate_alpha_beta_momentum(exact, 0.0, f);
    exact->first = exact->second = make_phase(k);
    const dd first = angle_between_in_turns(f[0], f[1], target.w, target.z),
             second = angle_between_in_turns(f[2], f[3], target.x, target.y);
    set_initial_phase(&exact->first, first);
    set_initial_phase(&exact->second, first);
    /* The linear map exact->frame includes the multiplication of beta by
     * exp(2 pi i (second - first)), so that alpha and beta use the same phase. */
    sin_cos(pi * dd_sub(second, first).hi, &s, &c);
    set_form_map(exact, q_mul(left, q4(c, v3(0.0, 0.0, s))),
                 q_mul(q4(c, v3(0.0, 0.0, -s)), q_conj(turn)));
    set_period_and_mean_rates(exact, dd_mul(lambda, mean).hi, k.hi, k.hi);
    /* The spin is the rotation about a, but the third axis of the solution is -a. */
    exact->spin_angle_rate = -exact->spin_angle_rate;
}
/* `half_turn` is half the rate that an axial rotor adds to the rotation about the third axis. */
static kr_exact_form make_euler_form(const exact_top *top, dd half_turn)
{
    const double pair = 0.5 * (top->inertia.x + top->inertia.y);
    const int has_rotor = half_turn.hi != 0.0;
    const double moments[3] = {has_rotor ? pair : top->inertia.x, has_rotor ? pair : top->inertia.y,
                               top->inertia.z};
    const dd m[3] = {dd_of(top->m.x), dd_of(top->m.y), dd_of(top->m.z)};
    const kr_quat q = round_to_unit_quaternion(top->q);
    kr_exact_form exact = {0};
    dd body[3];
    turn_back_dd(top->q, m, body);
    exact.constant = top->m;
    const kr_quat left = v_largest(top->m) == 0.0 ? q_one() : q_conj(find_rotation_to_e3(top->m));
    if (!set_up_free_motion_if_steady(&exact, moments, body, dd_dot(body, body), half_turn, q,
                                      left)) {
        const body_axes a = reorder_axes(moments, body);
        set_up_asymmetric_free_motion(&exact, &a, q, left);
    }
    return exact;
}
/* Returns the angle between the apex of height u and e3 [rad], given 1 - u and 1 + u. Values up to
 * 2e-36 count as zero, because recompute_small_distances (lagrange.h) raises zeros to 1e-36. */
static double find_nutation_angle(dd one_minus_u, dd one_plus_u)
{
    const double least = 2e-36, low = one_minus_u.hi > least ? one_minus_u.hi : 0.0,
                 high = one_plus_u.hi > least ? one_plus_u.hi : 0.0;
    return 2.0 * atan2(sqrt(low), sqrt(high));
}
/* Returns the sign of the precession rate at the height u of the apex, or 0 if the rate is zero up
 * to the relative error `tol`. The rate is proportional to the sum of the terms `one` and `two`. */
static int find_precession_sign(const initial *s, dd one_minus_u, dd one_plus_u, double tol)
{
    const dd one = dd_mul(s->sum, one_minus_u), two = dd_mul(s->difference, one_plus_u);
    const double all = dd_add(one, two).hi, size = fabs(one.hi) + fabs(two.hi);
    return fabs(all) <= tol * size ? 0 : all < 0.0 ? -1 : 1;
}
/* Returns the type of motion (kr_nutation) of a heavy top with a nonnegative lever, given its least
 * and greatest nutation angles [rad]. Angles that differ by at most KR_INPUT_RTOL count as equal.
 * With the same tolerance, the motion has cusps if the precession rate at u2 is zero. */
static const char *classify_heavy_motion(const initial *s, const turning_points *r, double least,
                                         double greatest)
{
    const double pi = 3.14159265358979323846, tol = KR_INPUT_RTOL,
                 size = tol * sqrt(s->w_square.hi + s->g.hi);
    if (greatest - least <= tol)
        return greatest <= tol ? "sleeping" : pi - least <= tol ? "hanging" : "steady";
    if (least <= tol && r->g32.hi <= tol * r->g31.hi) return "separatrix";
    if (fabs(s->sum.hi) <= size && fabs(s->difference.hi) <= size) return "pendulum";
    if (least <= tol || pi - greatest <= tol) return "rosette";
    const int high = find_precession_sign(s, r->minus2, r->plus2, tol),
              low = find_precession_sign(s, r->minus1, r->plus1, 0.0);
    return high == 0 ? "cusps" : high == low ? "waves" : "loops";
}
/* Writes the first times >= 0, or infinity, at which the apex is lowest and highest. */
static void find_turning_times(const initial *s, const turning_points *r, double *low, double *high)
{
    const double kp = sqrt(r->g32.hi / r->g31.hi);
    const dd mean = find_agm_and_sums(dd_of(kp), 0, NULL, NULL),
             here = find_initial_phase_magnitude(r, mean.hi);
    const dd rise = dd_sub(dd_of(0.25), here);
    const double turn = 2.0 * two_pi / (sqrt(r->g31.hi) * mean.hi);
    const int falls = s->climb.hi < 0.0;
    *low = turn * (falls || here.hi <= 0.0 ? here.hi : dd_sub(dd_of(0.5), here).hi);
    *high = turn * (!falls || rise.hi <= 0.0 ? rise.hi : dd_add(dd_of(0.25), here).hi);
    if (kp <= 1e-74) *high = INFINITY;
    if (kp <= 1e-74 && !falls && here.hi > 0.0) *low = INFINITY;
}
/* Returns the turning points (kr_nutation) of a top with a nonnegative lever, in internal units,
 * with times counted from the initial time. `rotor` is the rotor momentum along the third internal
 * axis, divided by I3. The member critical_spin is computed without the rotor. */
static kr_nutation describe_nutation(const exact_top *top, double rotor)
{
    const dd i1 = find_equatorial_moment(top);
    const initial s = find_initial_quantities(top, i1);
    const dd spin = dd_half(dd_sub(s.sum, s.difference)),
             across = dd_sqrt(dd_sub(s.w_square, dd_square(spin)));
    const double own = i1.hi * spin.hi - rotor * top->inertia.z;
    const int is_free = s.g.hi == 0.0;
    kr_nutation r = {.sum = i1.hi * s.sum.hi,
                     .difference = i1.hi * s.difference.hi,
                     .inertia = i1.hi,
                     .axial_energy = own * own / (2.0 * top->inertia.z),
                     .lever = top->lever.hi,
                     .critical_spin = 2.0 * sqrt(i1.hi * top->lever.hi) / top->inertia.z};
    r.least = r.greatest = find_nutation_angle(s.minus, s.plus);
    r.motion_type = is_free ? "resting" : s.a[2].hi > 0.0 ? "sleeping" : "hanging";
    if (is_free ? across.hi <= KR_INPUT_RTOL * sqrt(s.w_square.hi)
                : has_stationary_vertical_axis(&s))
        return r;
    const turning_points heights = find_turning_point_distances(&s);
    r.least = find_nutation_angle(heights.minus2, heights.plus2);
    r.greatest = find_nutation_angle(heights.minus1, heights.plus1);
    r.motion_type = is_free ? "circle" : classify_heavy_motion(&s, &heights, r.least, r.greatest);
    if (r.greatest - r.least > KR_INPUT_RTOL)
        find_turning_times(&s, &heights, &r.t_greatest, &r.t_least);
    return r;
}
static kr_nutation exchange_up_down_in_nutation(kr_nutation r)
{
    const double pi = 3.14159265358979323846;
    kr_nutation s = r;
    s.least = pi - r.greatest;
    s.greatest = pi - r.least;
    s.t_least = r.t_greatest;
    s.t_greatest = r.t_least;
    s.sum = -r.difference;
    s.difference = -r.sum;
    s.lever = -r.lever;
    return s;
}
/* `half_turn` is half the rate that a rotor adds to the rotation about the symmetry axis. */
static kr_exact_form make_lagrange_form(const exact_top *top, dd half_turn)
{
    const int below = top->lever.hi < 0.0;
    lagrange_setup s;
    s.top = below ? exchange_up_and_down(top) : *top;
    set_initial_quantities(&s);
    if (half_turn.hi != 0.0) s.half_spin = dd_add(s.half_spin, half_turn);
    if (has_stationary_vertical_axis(&s.start)) {
        const dd half = dd_half(s.start.w[2]);
        memset(&s.exact, 0, sizeof s.exact);
        s.exact.constant.z = s.top.m.z;
        s.exact.side = 1.0;
        set_up_steady_form(&s.exact, round_to_unit_quaternion(s.top.q), dd_add(half, s.half_spin),
                           dd_sub(half, s.half_spin));
    } else
        set_up_tops_with_moving_axis(&s, 1);
    if (below) {
        undo_exchange_up_and_down(&s.exact);
        set_up_down_map(s.exact.frame);
        s.exact.framed = 1.0;
    }
    return s.exact;
}
/* Returns 0, to refuse a heavy top, if half its initial tilt [rad] and its horizontal momentum
 * [internal units] are below 1e-70 and not both zero: their logarithms determine the time of the
 * fall, but fourth powers of still smaller values underflow. Returns 1 for other tops. */
static int is_fall_time_computable(const kr_scene *scene)
{
    const kr_working w = kr_body_working(&scene->body);
    const kr_quat q = q_mul(scene->start.q, q_mul(scene->body.axes, w.axes));
    const double lean = fmin(fmax(fabs(q.x), fabs(q.y)), fmax(fabs(q.w), fabs(q.z))),
                 push = fmax(fabs(scene->start.m.x), fabs(scene->start.m.y));
    kr_units units;
    if ((lean == 0.0 && push == 0.0) || scene->gravity == 0.0 || v_largest(w.com) == 0.0) return 1;
    if (kr_scene_units(scene, &w, &units) != KR_OK) return 1; /* reported by other functions */
    return fmax(lean, push * (units.time / units.moment)) >= 1e-70;
}
static kr_status plan_scene(const kr_scene *scene, int own, double bound, void *memory,
                            kr_exact_info *info)
{
    (void)bound;
    described_top top;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_kind kind = kr_scene_kind(scene);
    if (kind != KR_KIND_EULER && kind != KR_KIND_LAGRANGE) return KR_ERR_METHOD;
    if (kr_scene_excludes_closed_form(scene, own) || !is_fall_time_computable(scene))
        return KR_ERR_METHOD;
    status = convert_to_internal(scene, kind, &top);
    if (status != KR_OK) return status;
    const int is_free = top.own.lever.hi == 0.0;
    kr_exact_form made = is_free ? make_euler_form(&top.own, top.half_turn)
                                 : make_lagrange_form(&top.own, top.half_turn);
    if (!is_free && top.behind) made.spin_angle_rate = 0.0 - made.spin_angle_rate; /* never -0 */
    if (!own) {
        if (!is_identity(top.axes)) {
            multiply_map_by_inverse_axes(made.frame, made.framed != 0.0, top.axes);
            made.framed = 1.0;
        }
        convert_form_to_user(&made, scene->start.t, top.units.time,
                             top.units.moment / top.units.time);
    }
    /* For extreme moments of inertia, the rates of the phases may exceed the range of doubles. */
    if (!isfinite(made.nutation.fast + made.first.fast + made.second.fast)) return KR_ERR_ARGUMENT;
    memcpy(memory, &made, sizeof made);
    info->period = made.period;
    info->precession_rate = made.precession_rate;
    info->spin_angle_rate = made.spin_angle_rate;
    info->refusal = KR_REFUSAL_NONE;
    return KR_OK;
}
/* Returns 1 if the body, with its rotor, is symmetric about its apex (kreisel.h), else 0. */
static int is_symmetric_about_apex(const kr_body *body, kr_kind kind)
{
    const kr_vec3 i = body->inertia, h = body->rotor;
    const double across = fmax(fabs(h.x), fabs(h.y));
    if (kind == KR_KIND_EULER && across > KR_KIND_RTOL * v_largest(h)) return 0;
    return kind == KR_KIND_LAGRANGE ||
           (kind == KR_KIND_EULER && fabs(i.x - i.y) <= KR_KIND_RTOL * fmax(i.x, i.y));
}
kr_status KR_NAME(kr_exact_limits)(const kr_scene *scene, kr_nutation *out)
{
    described_top top;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_kind kind = kr_body_kind(&scene->body, KR_KIND_RTOL);
    if (!is_symmetric_about_apex(&scene->body, kind) || kr_scene_is_disturbed(scene))
        return KR_ERR_METHOD;
    status = convert_to_internal(scene, kind, &top);
    if (status != KR_OK) return status;
    /* If the weight is zero and |m| below 1e-40, the rotor momentum is about 1 [internal units].
     * Then m has no effect in 2^50 turns of the body. It is set to 0, as its powers underflow. */
    if (top.own.lever.hi == 0.0 && v_largest(top.own.m) < 1e-40) top.own.m = v3(0.0, 0.0, 0.0);
    const int below = top.own.lever.hi < 0.0;
    if (below) top.own = exchange_up_and_down(&top.own);
    kr_nutation r = describe_nutation(&top.own, -2.0 * top.half_turn.hi);
    /* The apex points along the third internal axis or in the opposite direction. */
    r.critical_spin += (top.behind ? -2.0 : 2.0) * top.half_turn.hi;
    if (below != top.behind) r = exchange_up_down_in_nutation(r);
    const double time = top.units.time, momentum = top.units.moment / time,
                 energy = momentum / time;
    r.t_least = scene->start.t + time * r.t_least;
    r.t_greatest = scene->start.t + time * r.t_greatest;
    r.critical_spin /= time;
    r.inertia *= top.units.moment;
    r.sum *= momentum;
    r.difference *= momentum;
    r.axial_energy *= energy;
    r.lever *= energy;
    *out = r;
    return KR_OK;
}
static kr_state evaluate_plan(const void *plan, double t) { return state_at(plan, t); }
static size_t find_plan_size(const void *plan) { return (void)plan, sizeof(kr_exact_form); }
const kr_exact_scalar KR_NAME(kr_exact_scalar) = {sizeof(kr_exact_form),
                                                  sizeof(kr_exact_form),
                                                  find_plan_size,
                                                  is_fall_time_computable,
                                                  plan_scene,
                                                  evaluate_plan,
                                                  NULL};
