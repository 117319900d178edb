/* Phases and rates of a plan, and the frame around it. Floor 3. */
#include "plan.h"

static const double two_pi = 6.283185307179586477;

kr_phase kr_phase_of(dd rate)
{
    const dd turn = dd_make(0.15915494309189534561, -9.839338337591243e-18);    /* 1 / 2 pi */
    const dd f = dd_mul(rate, turn);
    kr_phase r;
    r.fast = f.hi, r.slow = f.lo, r.start = r.more = 0.0;
    return r;
}
void kr_phase_start(kr_phase *phase, dd start) { phase->start = start.hi, phase->more = start.lo; }
/* The argument of x + i y in turns: quarters exactly, the rest by an arc tangent of at most an eighth. */
dd kr_turns(double y, double x)
{
    const double ax = fabs(x), ay = fabs(y);
    const dd part = ax >= ay ? dd_of(x < 0.0 ? 0.5 : 0.0) : dd_of(y < 0.0 ? -0.25 : 0.25);
    const double small = ax >= ay ? atan2(x < 0.0 ? -y : y, ax) : atan2(y < 0.0 ? x : -x, ay);
    return two_sum(part.hi, small / two_pi);
}
/* From the argument of (x, y) to that of (u, v), in turns. */
dd kr_turns_between(double x, double y, double u, double v)
{
    const dd re = dd_add(two_product(u, x), two_product(v, y)), im = dd_sub(two_product(v, x), two_product(u, y));
    return kr_turns(im.hi, re.hi);
}

kr_quat kr_exact_rounded(const dd q[4]) { return q_unit(q4(q[0].hi, v3(q[1].hi, q[2].hi, q[3].hi))); }

dd kr_exact_axis(const dd q[4], dd a[3], dd *plus)
{
    const dd up = dd_add(dd_square(q[0]), dd_square(q[3])), side = dd_add(dd_square(q[1]), dd_square(q[2]));
    const dd scale = dd_div(dd_of(2.0), dd_add(up, side)), minus = dd_mul(scale, side);
    *plus = dd_mul(scale, up);
    a[0] = dd_mul(scale, dd_add(dd_mul(q[1], q[3]), dd_mul(q[0], q[2])));
    a[1] = dd_mul(scale, dd_sub(dd_mul(q[2], q[3]), dd_mul(q[0], q[1])));
    a[2] = dd_half(dd_sub(*plus, minus));
    return minus;
}
void kr_exact_back(const dd q[4], const dd v[3], dd r[3])
{
    dd p[4][4];
    for (int i = 0; i < 4; i++)
        for (int j = 0; j <= i; j++) p[i][j] = p[j][i] = dd_mul(q[i], q[j]);
    const dd norm = dd_add(dd_add(p[0][0], p[1][1]), dd_add(p[2][2], p[3][3]));
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3, a = i + 1, b = j + 1, c = k + 1;
        const dd along = dd_sub(dd_add(p[0][0], p[a][a]), dd_add(p[b][b], p[c][c]));
        const dd left = dd_twice(dd_add(p[a][b], p[0][c])), right = dd_twice(dd_sub(p[a][c], p[0][b]));
        const dd turned = dd_add(dd_add(dd_mul(v[i], along), dd_mul(v[j], left)), dd_mul(v[k], right));
        r[i] = dd_div(turned, norm);
    }
}

static double sign_of(double x) { return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0; }

/* Rates of x and of the phases of alpha and beta. theta1 and theta2 of x + i y wind about zero, too, against y: y and
 * slope are of opposite sign. A zero on the way counts half a turn either way, hence none. Euler's beta, a theta4, has
 * no zeros. */
void kr_exact_rates(kr_exact *plan, double nu, double first, double second, int euler)
{
    const double wind1 = sign_of(plan->slope[0]), wind2 = euler ? 0.0 : sign_of(plan->slope[1]);
    plan->period = 0.5 * two_pi / nu;
    plan->precession = (first + second) + (wind1 + wind2) * nu;
    plan->spin = (first - second) + (wind1 - wind2) * nu;
}
/* alpha and beta of constant size that turn at constant rates: sleeping, hanging, at rest, symmetric and free. */
void kr_exact_steady(kr_exact *plan, kr_quat q, dd first, dd second)
{
    const double a = length(q.w, q.z), b = length(q.x, q.y);
    plan->curve = CIRCULAR_COSINE;
    plan->nutation.start = 0.25;
    plan->first = kr_phase_of(first);
    plan->second = kr_phase_of(second);
    kr_phase_start(&plan->first, kr_turns(q.z, q.w));
    kr_phase_start(&plan->second, dd_add(kr_turns(q.y, q.x), dd_of(-0.25)));
    plan->alpha.even[0] = a;
    plan->beta.odd[0] = b;
    plan->period = INFINITY;
    plan->precession = a > 0.0 && b > 0.0 ? first.hi + second.hi : 0.0;         /* a vertical axis has only a spin */
    plan->spin = b == 0.0 ? 2.0 * first.hi : a == 0.0 ? -2.0 * second.hi : first.hi - second.hi;
}
/* Gravity upwards: the same top seen from below, q -> i q. */
exact_top kr_exact_from_below(const exact_top *top)
{
    exact_top r = *top;
    r.q[0] = dd_neg(top->q[1]), r.q[1] = top->q[0];
    r.q[2] = dd_neg(top->q[3]), r.q[3] = top->q[2];
    r.m = v3(top->m.x, -top->m.y, -top->m.z);
    r.lever = dd_neg(top->lever);
    return r;
}
void kr_exact_turn_over(kr_exact *plan)
{
    plan->framed = 1;
    plan->side = -1.0;
    plan->left = q4(0.0, v3(-1.0, 0.0, 0.0));
    plan->right = q_one();
    plan->constant.z = -plan->constant.z;
    plan->precession = -plan->precession;
}

static void slow_down(kr_phase *phase, double unit)
{
    phase->fast /= unit;
    phase->slow /= unit;
}
/* From working axes and own units to the user's, whose unit of time in the plan is `unit`. */
void kr_exact_to_user(kr_exact *plan, const exact_top *top, double start, double unit)
{
    const double momentum = top->units.moment / top->units.time;
    if (v_largest(q_vec(top->axes)) > 0.0) {
        if (!plan->framed) plan->left = plan->right = q_one();
        plan->right = q_mul(plan->right, q_conj(top->axes));
        plan->framed = 1;
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
