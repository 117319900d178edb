/* Phases and rates of the closed form, the frame around it, and one state of it. An angle
 * is counted in turns, because whole turns are then left out without a rounding. This header is
 * source that is compiled once per instruction set, because its double-doubles want the fused
 * product. */
#ifndef KR_EXACT_PHASE_H
#define KR_EXACT_PHASE_H
#include "kernel.h"

/* Gives real and imaginary parts of alpha, beta and the horizontal momentum with their phases,
 * before q is made a unit quaternion and carried into the frame. */
static void factors_at(const kr_exact *e, double span, double out[6])
{
    const int dual = e->curve == LAGRANGE_DUAL || e->curve == EULER_DUAL;
    const int euler = e->curve == EULER || e->curve == EULER_DUAL;
    const factors f = theta_factors(e, dual, euler, dd_of(span));
    double s, c;
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

static const double two_pi = 6.283185307179586477;

/* Returns a phase that grows at this rate [rad in a unit of time], from 0. */
static kr_phase phase_of(dd rate)
{
    const dd turn = dd_make(0.15915494309189534561, -9.839338337591243e-18); /* 1 / 2 pi */
    const dd f = dd_mul(rate, turn);
    kr_phase r;
    r.fast = f.hi;
    r.slow = f.lo;
    r.start = r.more = 0.0;
    return r;
}
/* Lets a phase begin at `start` [turns], less so many whole turns that it lies within 1 +- 1/2:
 * phase_at relies on that. */
static void phase_start(kr_phase *phase, dd start)
{
    const dd s = two_sum(1.0, start.hi - rint(start.hi));
    phase->start = s.hi;
    phase->more = s.lo + start.lo;
}
/* Returns the argument of x + i y in turns. Quarters are exact; the rest is an arc tangent of at
 * most an eighth, whose rounding is the smaller for it. */
static dd turns_of(double y, double x)
{
    const double ax = fabs(x), ay = fabs(y);
    const dd part = ax >= ay ? dd_of(x < 0.0 ? 0.5 : 0.0) : dd_of(y < 0.0 ? -0.25 : 0.25);
    const double small = ax >= ay ? atan2(x < 0.0 ? -y : y, ax) : atan2(y < 0.0 ? x : -x, ay);
    return two_sum(part.hi, small / two_pi);
}
/* Returns the angle from the vector (x, y) to the vector (u, v), in turns. */
static dd turns_between(double x, double y, double u, double v)
{
    const dd re = dd_add(two_product(u, x), two_product(v, y)),
             im = dd_sub(two_product(v, x), two_product(u, y));
    return turns_of(im.hi, re.hi);
}

/* Returns a quaternion in double-double as a unit quaternion in doubles. */
static kr_quat rounded(const dd q[4]) { return q_unit(q4(q[0].hi, v3(q[1].hi, q[2].hi, q[3].hi))); }

/* Gives the axis a = q e3 q* and, with its height u = a.e3, 1 + u in `plus`; returns 1 - u. Both
 * come straight from the quaternion, so that neither cancels near a pole. */
static dd axis_of(const dd q[4], dd a[3], dd *plus)
{
    const dd up = dd_add(dd_square(q[0]), dd_square(q[3])),
             side = dd_add(dd_square(q[1]), dd_square(q[2]));
    const dd scale = dd_div(dd_of(2.0), dd_add(up, side)), minus = dd_mul(scale, side);
    *plus = dd_mul(scale, up);
    a[0] = dd_mul(scale, dd_add(dd_mul(q[1], q[3]), dd_mul(q[0], q[2])));
    a[1] = dd_mul(scale, dd_sub(dd_mul(q[2], q[3]), dd_mul(q[0], q[1])));
    a[2] = dd_half(dd_sub(*plus, minus));
    return minus;
}
/* Gives q* v q, where q need not be of unit length. */
static void turned_back(const dd q[4], const dd v[3], dd r[3])
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

static double sign_of(double x) { return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0; }

/* Sets the period and the mean rates of Euler's angles, from the rates of the nutation's phase and
 * of the phases of alpha and beta. theta1 and theta2 of X + i y wind about zero themselves, against
 * the sign of y and hence with that of `slope`. A zero on the way turns by half a turn either way,
 * which counts as none. Euler's beta, a theta4, has no zeros and does not wind. */
static void set_rates(kr_exact *exact, double nu, double first, double second, int euler)
{
    const double wind1 = sign_of(exact->slope[0]), wind2 = euler ? 0.0 : sign_of(exact->slope[1]);
    exact->period = 0.5 * two_pi / nu;
    exact->precession = (first + second) + (wind1 + wind2) * nu;
    exact->spin = (first - second) + (wind1 - wind2) * nu;
}
/* Sets a motion up in which alpha and beta keep their size and turn at constant rates: that of a
 * top which sleeps, hangs or rests, or of a symmetric body without torque. */
static void steady_closed_form(kr_exact *exact, kr_quat q, dd first, dd second)
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
    /* Where the axis is vertical, the whole turn counts as spin. */
    exact->precession = a > 0.0 && b > 0.0 ? first.hi + second.hi : 0.0;
    exact->spin = b == 0.0 ? 2.0 * first.hi : a == 0.0 ? -2.0 * second.hi : first.hi - second.hi;
}
/* Returns the top as it is seen from below, q -> i q: gravity that points upwards points downwards
 * there. */
static exact_top seen_from_below(const exact_top *top)
{
    exact_top r = *top;
    r.q[0] = dd_neg(top->q[1]);
    r.q[1] = top->q[0];
    r.q[2] = dd_neg(top->q[3]);
    r.q[3] = top->q[2];
    r.m = v3(top->m.x, -top->m.y, -top->m.z);
    r.lever = dd_neg(top->lever);
    return r;
}
/* Puts the closed form into the frame q -> left q right, which is kept as what it makes of 1, i, j
 * and k. */
static void set_frame(kr_exact *exact, kr_quat left, kr_quat right)
{
    const double w = left.w, x = left.x, y = left.y, z = left.z;
    const kr_quat columns[4] = {left, {-x, w, z, -y}, {-y, -z, w, x}, {-z, y, -x, w}};
    for (int i = 0; i < 4; i++) exact->frame[i] = q_mul(columns[i], right);
    exact->framed = 1;
}
/* Turns the closed form of a top that was seen from below back. */
static void turn_over(kr_exact *exact)
{
    exact->side = -1.0;
    set_frame(exact, q4(0.0, v3(-1.0, 0.0, 0.0)), q_one());
    exact->constant.z = -exact->constant.z;
    exact->precession = -exact->precession;
}

/* Changes a phase's unit of time. */
static void slow_down(kr_phase *phase, double unit)
{
    phase->fast /= unit;
    phase->slow /= unit;
}
/* Brings the closed form from working axes and own units to the user's; `unit` is its unit of time
 * in the user's. */
static void to_user(kr_exact *exact, const exact_top *top, double start, double unit)
{
    const double momentum = top->units.moment / top->units.time;
    if (v_largest(q_vec(top->axes)) > 0.0) {
        if (!exact->framed) set_frame(exact, q_one(), q_one());
        for (int i = 0; i < 4; i++) exact->frame[i] = q_mul(exact->frame[i], q_conj(top->axes));
    }
    exact->begin = start;
    exact->period *= unit;
    exact->precession /= unit;
    exact->spin /= unit;
    exact->momentum *= momentum;
    exact->constant = v_scale(momentum, exact->constant);
    slow_down(&exact->nutation, unit);
    slow_down(&exact->first, unit);
    slow_down(&exact->second, unit);
}
#endif
