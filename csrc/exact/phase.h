/* Phases and rates of a plan, and the frame around it; one state. */
#ifndef KR_PHASE_H
#define KR_PHASE_H
#include "kernel.h"

static inline kr_state state_at(const kr_exact *e, double t)
{
    const dd span = two_sum(t, -e->begin);
    kr_state r;
    switch (e->curve) {
    case LAGRANGE:
        r = kernel(e, 0, 0, t, span);
        break;
    case EULER:
        r = kernel(e, 0, 1, t, span);
        break;
    case LAGRANGE_DUAL:
        r = kernel(e, 1, 0, t, span);
        break;
    default:
        r = kernel(e, 1, 1, t, span);
        break;
    }
    if (e->framed) r.q = framed(e->frame, r.q);
    return r;
}
/* alpha, beta and momentum, q not yet of length 1 and without frame. */
static void factors_at(const kr_exact *e, double span, double out[6])
{
    const int dual = e->curve == LAGRANGE_DUAL || e->curve == EULER_DUAL;
    const factors f =
        theta_factors(e, dual, e->curve == EULER || e->curve == EULER_DUAL, dd_of(span));
    double s, c;
    sincos_turns(f.first, &s, &c);
    out[0] = f.a_re * c - f.a_im * s, out[1] = f.a_re * s + f.a_im * c;
    sincos_turns(f.second, &s, &c);
    out[2] = f.b_re * c - f.b_im * s, out[3] = f.b_re * s + f.b_im * c;
    sincos_turns(dd_add(f.first, f.second), &s, &c);
    out[4] = f.h_re * c - f.h_im * s, out[5] = f.h_re * s + f.h_im * c;
}

static const double two_pi = 6.283185307179586477;

static kr_phase phase_of(dd rate)
{
    const dd turn = dd_make(0.15915494309189534561, -9.839338337591243e-18); /* 1 / 2 pi */
    const dd f = dd_mul(rate, turn);
    kr_phase r;
    r.fast = f.hi, r.slow = f.lo, r.start = r.more = 0.0;
    return r;
}
/* Of whole turns as many as put it at a distance of 1 +- 1/2, where phase_at wants it. */
static void phase_start(kr_phase *phase, dd start)
{
    const dd s = two_sum(1.0, start.hi - rint(start.hi));
    phase->start = s.hi, phase->more = s.lo + start.lo;
}
/* The argument of x + i y in turns: quarters exactly, the rest by an arc tangent of at most an
 * eighth. */
static dd turns_of(double y, double x)
{
    const double ax = fabs(x), ay = fabs(y);
    const dd part = ax >= ay ? dd_of(x < 0.0 ? 0.5 : 0.0) : dd_of(y < 0.0 ? -0.25 : 0.25);
    const double small = ax >= ay ? atan2(x < 0.0 ? -y : y, ax) : atan2(y < 0.0 ? x : -x, ay);
    return two_sum(part.hi, small / two_pi);
}
/* From the argument of (x, y) to that of (u, v), in turns. */
static dd turns_between(double x, double y, double u, double v)
{
    const dd re = dd_add(two_product(u, x), two_product(v, y)),
             im = dd_sub(two_product(v, x), two_product(u, y));
    return turns_of(im.hi, re.hi);
}

static kr_quat rounded(const dd q[4]) { return q_unit(q4(q[0].hi, v3(q[1].hi, q[2].hi, q[3].hi))); }

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

/* Rates of x and of the phases of alpha and beta. theta1 and theta2 of x + i y wind about zero,
 * too, against y: y and slope are of opposite sign. A zero on the way counts half a turn either
 * way, hence none. Euler's beta, a theta4, has no zeros. */
static void set_rates(kr_exact *plan, double nu, double first, double second, int euler)
{
    const double wind1 = sign_of(plan->slope[0]), wind2 = euler ? 0.0 : sign_of(plan->slope[1]);
    plan->period = 0.5 * two_pi / nu;
    plan->precession = (first + second) + (wind1 + wind2) * nu;
    plan->spin = (first - second) + (wind1 - wind2) * nu;
}
/* alpha and beta of constant size that turn at constant rates: sleeping, hanging, at rest,
 * symmetric and free. */
static void steady_plan(kr_exact *plan, kr_quat q, dd first, dd second)
{
    const double a = length(q.w, q.z), b = length(q.x, q.y);
    plan->curve = LAGRANGE;
    phase_start(&plan->nutation, dd_of(0.25));
    plan->first = phase_of(first);
    plan->second = phase_of(second);
    phase_start(&plan->first, turns_of(q.z, q.w));
    phase_start(&plan->second, dd_add(turns_of(q.y, q.x), dd_of(-0.25)));
    plan->alpha.even[0] = a;
    plan->beta.odd[0] = b;
    plan->period = INFINITY;
    /* a vertical axis has only a spin */
    plan->precession = a > 0.0 && b > 0.0 ? first.hi + second.hi : 0.0;
    plan->spin = b == 0.0 ? 2.0 * first.hi : a == 0.0 ? -2.0 * second.hi : first.hi - second.hi;
}
/* Gravity upwards: the same top seen from below, q -> i q. */
static exact_top seen_from_below(const exact_top *top)
{
    exact_top r = *top;
    r.q[0] = dd_neg(top->q[1]), r.q[1] = top->q[0];
    r.q[2] = dd_neg(top->q[3]), r.q[3] = top->q[2];
    r.m = v3(top->m.x, -top->m.y, -top->m.z);
    r.lever = dd_neg(top->lever);
    return r;
}
/* The frame of a plan is where it carries 1, i, j, k. */
static void set_frame(kr_exact *plan, kr_quat left, kr_quat right)
{
    const double w = left.w, x = left.x, y = left.y, z = left.z;
    const kr_quat columns[4] = {left, {-x, w, z, -y}, {-y, -z, w, x}, {-z, y, -x, w}};
    for (int i = 0; i < 4; i++) plan->frame[i] = q_mul(columns[i], right);
    plan->framed = 1;
}
static void turn_over(kr_exact *plan)
{
    plan->side = -1.0;
    set_frame(plan, q4(0.0, v3(-1.0, 0.0, 0.0)), q_one());
    plan->constant.z = -plan->constant.z;
    plan->precession = -plan->precession;
}

static void slow_down(kr_phase *phase, double unit)
{
    phase->fast /= unit;
    phase->slow /= unit;
}
/* From working axes and own units to the user's, whose unit of time in the plan is `unit`. */
static void to_user(kr_exact *plan, const exact_top *top, double start, double unit)
{
    const double momentum = top->units.moment / top->units.time;
    if (v_largest(q_vec(top->axes)) > 0.0) {
        if (!plan->framed) set_frame(plan, q_one(), q_one());
        for (int i = 0; i < 4; i++) plan->frame[i] = q_mul(plan->frame[i], q_conj(top->axes));
    }
    plan->begin = start;
    plan->period *= unit;
    plan->precession /= unit;
    plan->spin /= unit;
    plan->momentum *= momentum;
    plan->constant = v_scale(momentum, plan->constant);
    slow_down(&plan->nutation, unit);
    slow_down(&plan->first, unit);
    slow_down(&plan->second, unit);
}
#endif
