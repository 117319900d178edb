/* Functions for the phases, rates and attitudes of closed-form solutions. Angles are measured in
 * turns, because whole turns can then be dropped without rounding errors. This header is compiled
 * once for each instruction set and number of lanes (lane_types.h). */
#ifndef KR_EXACT_PHASE_H
#define KR_EXACT_PHASE_H
#include "kernel.h"

/* The functions factors_of_kind and factors_at write the real and imaginary parts of alpha, beta
 * and the horizontal momentum. The values include the phase factors, but the attitude q is not yet
 * normalized, and the map `frame` of the solution has not been applied to it. If factors_of_kind is
 * used, the theta series of all SIMD lanes must be of the same kind; factors_at has no such
 * restriction. */
static inline void factors_of_kind(const exact_lanes *e, int dual, int euler, wide span,
                                   wide out[6])
{
    const factors f = theta_factors(e, dual, euler, dd_of(span));
    wide s, c;
    sincos_turns(f.first, &s, &c);
    out[0] = f.a_re * c - f.a_im * s;
    out[1] = f.a_re * s + f.a_im * c;
    sincos_turns(f.second, &s, &c);
    out[2] = f.b_re * c - f.b_im * s;
    out[3] = f.b_re * s + f.b_im * c;
    sincos_turns(dd_add(f.first, f.second), &s, &c);
    out[4] = f.h_re * c - f.h_im * s;
    out[5] = f.h_re * s + f.h_im * c;
}
static inline void factors_at(const exact_lanes *e, double span, wide out[6])
{
    const mask dual = is_dual(e);
    const wide at = wide_splat(span);
    wide some[6];
    if (mask_all(dual)) {
        factors_of_kind(e, 1, is_euler(e), at, out);
        return;
    }
    factors_of_kind(e, 0, is_euler(e), at, out);
    if (!mask_any(dual)) return;
    factors_of_kind(e, 1, is_euler(e), at, some);
    take_lanes(out, some, sizeof some, dual);
}

static const double two_pi = 6.283185307179586477;

/* Returns a phase with initial value zero and the given rate [rad per unit of time]. */
static inline phase_lanes phase_of(dd rate)
{
    const dd f = dd_mul(rate, one_turn());
    const phase_lanes r = {.fast = f.hi, .slow = f.lo};
    return r;
}
/* Sets the initial value of a phase, in turns, after adding whole turns such that it lies between
 * 1/2 and 3/2, as phase_at requires. */
static inline void phase_start(phase_lanes *phase, dd start)
{
    const dd s = two_sum(wide_splat(1.0), start.hi - nearest(start.hi));
    phase->start = s.hi;
    phase->more = s.lo + start.lo;
}
/* Returns the arc tangent of u in turns, for |u| <= tan(pi/8), with an error of at most 1 ulp. */
static inline wide turns_of_tangent(wide u)
{
    const dd turn = one_turn();
    const wide z = u * u, zz = z * z;
    const wide low = (-0.0530516476972984402 + z * 0.0318309886183719381) +
                     zz * (-0.0227364204400317979 + z * 0.0176838824132084663);
    const wide high = (-0.0144686240078471209 + z * 0.0122424897797794527) +
                      zz * ((-0.0106068993999666122 + z * 0.00932353355566516922) +
                            zz * ((-0.00809374456969824621 + z * 0.00624391215077724649) +
                                  zz * -0.00305209614217111548));
    return u * turn.hi + u * (turn.lo + z * (low + zz * zz * high));
}
/* Returns the argument of x + i y in turns. The result is an exact multiple of an eighth of a turn
 * plus an arc tangent of at most a sixteenth of a turn. */
static inline dd turns_of(wide y, wide x)
{
    const wide ax = wide_abs(x), ay = wide_abs(y), zero = wide_splat(0.0);
    const mask flat = wide_at_most(ay, ax), left = is_negative(x), below = is_negative(y);
    /* After subtraction of a multiple of a quarter turn, the angle is the argument of a + i b with
     * |b| <= a. */
    const wide a = wide_choose(flat, ax, ay),
               b = wide_choose(flat, wide_choose(left, -y, y), wide_choose(below, x, -x));
    const wide quarters =
        wide_choose(flat, wide_choose(left, wide_splat(0.5), zero), 0.25 * minus_where(below));
    const wide up = minus_where(is_negative(b));
    const mask far = wide_more(up * b, 0.41421356237309503 * a);
    const wide over = wide_choose(far, b - up * a, b), under = wide_choose(far, a + up * b, a);
    const wide eighth = wide_choose(far, 0.125 * up, zero);
    const wide tangent = wide_choose(is_positive(under), over / under, zero);
    return two_sum(quarters + eighth, turns_of_tangent(tangent));
}
/* Returns the angle from the vector (x, y) to the vector (u, v), in turns. */
static inline dd turns_between(wide x, wide y, wide u, wide v)
{
    const dd re = dd_add(two_product(u, x), two_product(v, y)),
             im = dd_sub(two_product(v, x), two_product(u, y));
    return turns_of(im.hi, re.hi);
}

/* Returns the dot product of four double-doubles with four doubles. */
static inline dd dot(const dd a[4], wide w, wide x, wide y, wide z)
{
    return dd_add(dd_add(dd_times(w, a[0]), dd_times(x, a[1])),
                  dd_add(dd_times(y, a[2]), dd_times(z, a[3])));
}
/* Multiplies q by `by` from the right, so that the rotation `by` is applied first. */
static inline void turn_first(dd q[4], quat_lanes by)
{
    const dd a[4] = {q[0], q[1], q[2], q[3]};
    q[0] = dot(a, by.w, -by.x, -by.y, -by.z);
    q[1] = dot(a, by.x, by.w, by.z, -by.y);
    q[2] = dot(a, by.y, -by.z, by.w, by.x);
    q[3] = dot(a, by.z, by.y, -by.x, by.w);
}

/* Normalizes a double-double quaternion, and returns it rounded to double precision. */
static inline quat_lanes rounded(const dd q[4])
{
    const wide w = q[0].hi, x = q[1].hi, y = q[2].hi, z = q[3].hi,
               n = 1.0 / wide_sqrt(w * w + (x * x + y * y + z * z));
    const quat_lanes r = {n * w, n * x, n * y, n * z};
    return r;
}

/* Writes the axis a = q e3 q*, whose height is u = a.e3. Writes 1 + u to `plus` and returns 1 - u.
 * The values 1 + u and 1 - u are computed directly from the quaternion, so no digits are lost near
 * a pole. */
static inline dd axis_of(const dd q[4], dd a[3], dd *plus)
{
    const dd up = dd_add(dd_square(q[0]), dd_square(q[3])),
             side = dd_add(dd_square(q[1]), dd_square(q[2]));
    const dd scale = dd_over(dd_splat(2.0), dd_add(up, side)), minus = dd_mul(scale, side);
    *plus = dd_mul(scale, up);
    a[0] = dd_mul(scale, dd_add(dd_mul(q[1], q[3]), dd_mul(q[0], q[2])));
    a[1] = dd_mul(scale, dd_sub(dd_mul(q[2], q[3]), dd_mul(q[0], q[1])));
    a[2] = dd_half(dd_sub(*plus, minus));
    return minus;
}
/* Writes q* v q / |q|^2; q need not have unit length. */
static inline void turned_back(const dd q[4], const dd v[3], dd r[3])
{
    dd p[4][4];
    for (int i = 0; i < 4; i++)
        for (int j = 0; j <= i; j++) p[i][j] = p[j][i] = dd_mul(q[i], q[j]);
    const dd norm = dd_add(dd_add(p[0][0], p[1][1]), dd_add(p[2][2], p[3][3]));
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3, a = i + 1, b = j + 1, c = k + 1;
        const dd along = dd_sub(dd_add(p[0][0], p[a][a]), dd_add(p[b][b], p[c][c]));
        const dd left = dd_twice(dd_add(p[a][b], p[0][c])),
                 right = dd_twice(dd_sub(p[a][c], p[0][b]));
        const dd turned =
            dd_add(dd_add(dd_mul(v[i], along), dd_mul(v[j], left)), dd_mul(v[k], right));
        r[i] = dd_div(turned, norm);
    }
}

static inline wide sign_of(wide x)
{
    const wide zero = wide_splat(0.0), one = wide_splat(1.0);
    return wide_choose(is_positive(x), one, wide_choose(is_negative(x), -one, zero));
}

/* Sets the nutation period and the mean rates of precession and spin from the rates of the phases.
 * The complex values of theta1 and theta2 rotate about zero as X increases. The sign of `slope`,
 * which is opposite to the sign of y, determines the direction of rotation. If theta1 or theta2
 * passes through zero, its phase jumps by half a turn, and its winding number is defined as zero.
 * For a torque-free top, beta is a theta4 function, whose values do not wind around zero. */
static inline void set_rates(exact_lanes *exact, wide nu, wide first, wide second)
{
    const wide wind1 = sign_of(exact->slope[0]),
               wind2 = is_euler(exact) ? wide_splat(0.0) : sign_of(exact->slope[1]);
    exact->period = 0.5 * two_pi / nu;
    exact->precession_rate = (first + second) + (wind1 + wind2) * nu;
    exact->spin_angle_rate = (first - second) + (wind1 - wind2) * nu;
}
/* Converts the mean spin about the third internal axis to the mean spin about the apex, for an apex
 * opposite to this axis. The mean precession rates of both directions are equal. */
static inline wide opposite_spin(wide spin)
{
    return 0.0 - spin; /* a zero spin stays a positive zero */
}
/* Returns I1, the mean of the two equal principal moments. */
static inline dd equal_moment(const exact_top *top)
{
    return dd_half(two_sum(top->inertia.x, top->inertia.y));
}
/* Returns the same top with up and down interchanged (q -> i q), and therefore with gravity
 * reversed. */
static inline exact_top seen_from_below(const exact_top *top)
{
    exact_top r = *top;
    r.q[0] = dd_neg(top->q[1]);
    r.q[1] = top->q[0];
    r.q[2] = dd_neg(top->q[3]);
    r.q[3] = top->q[2];
    r.m.y = -top->m.y;
    r.m.z = -top->m.z;
    r.lever = dd_neg(top->lever);
    return r;
}
/* Undoes the interchange of up and down in a solution, but leaves its frame unchanged. */
static inline void turn_over(exact_lanes *exact)
{
    exact->side = wide_splat(-1.0);
    exact->constant.z = -exact->constant.z;
    exact->precession_rate = -exact->precession_rate;
}

/* Converts a solution from internal units to the user's units, but leaves its frame unchanged. The
 * arguments `unit` and `momentum` are the internal units of time and momentum, expressed in the
 * user's units. */
static inline void to_user(exact_lanes *exact, wide start, wide unit, wide momentum)
{
    const wide rate = 1.0 / unit;
    phase_lanes *const phases[3] = {&exact->nutation, &exact->first, &exact->second};
    for (int i = 0; i < 3; i++) {
        phases[i]->fast = phases[i]->fast * rate;
        phases[i]->slow = phases[i]->slow * rate;
    }
    exact->begin = start;
    exact->period = exact->period * unit;
    exact->precession_rate = exact->precession_rate * rate;
    exact->spin_angle_rate = exact->spin_angle_rate * rate;
    exact->momentum = exact->momentum * momentum;
    exact->constant.x = momentum * exact->constant.x;
    exact->constant.y = momentum * exact->constant.y;
    exact->constant.z = momentum * exact->constant.z;
}
#endif
