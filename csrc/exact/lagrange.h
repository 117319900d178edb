/* Set-up of the Lagrange top's closed form. With the potential energy U u of the axis' height u =
 * a.e3, and with W = m / I1, g = 2 U / I1, the nutation obeys
 *     (du/dt)^2 = g (u - u1)(u - u2)(u - u3),   u1 <= u <= u2 <= 1 <= u3.
 * Whatever grows with time (the nutation's rate nu, the rates k1 and k2 of alpha and beta) and the
 * roots for it are computed in double-double from differences that do not cancel. The moment about
 * the axis adds a constant spin only. This header is source that is compiled once per instruction
 * set, because its double-doubles want the fused product. */
#ifndef KR_EXACT_LAGRANGE_H
#define KR_EXACT_LAGRANGE_H
#include "phase.h"
#include "theta.h"

/* What the set-up takes from the start, in the letters of the file's head. */
typedef struct initial {
    dd w[3], g;         /* W [T^-1] and g [T^-2] */
    dd w_square;        /* |W|^2 */
    dd a[3];            /* the axis */
    dd plus, minus;     /* 1 + u0, 1 - u0, straight from the quaternion */
    dd sum, difference; /* W.e3 + W.a, W.e3 - W.a */
    dd climb;           /* du/dt */
} initial;

/* The distances of the turning heights u1, u2 and of u3 from the start u0, from the poles, and from
 * each other. Those that grow without bound for a weak torque are multiplied by g. */
typedef struct turning {
    dd down, up;                     /* u0 - u1, u2 - u0 */
    dd third;                        /* g (u3 - u0) */
    dd span, g31, g32;               /* u2 - u1, g (u3 - u1), g (u3 - u2) */
    dd plus1, plus2, minus1, minus2; /* 1 + u1, 1 + u2, 1 - u1, 1 - u2 */
    dd plus3, minus3;                /* g (u3 + 1), g (u3 - 1) */
} turning;

static initial initial_of(const exact_top *top, dd i1)
{
    const dd i = dd_div(dd_of(1.0), i1);
    initial s;
    s.minus = axis_of(top->q, s.a, &s.plus);
    s.w[0] = dd_times(top->m.x, i);
    s.w[1] = dd_times(top->m.y, i);
    s.w[2] = dd_times(top->m.z, i);
    s.g = dd_twice(dd_mul(top->lever, i));
    const dd h = dd_add(dd_mul(s.w[0], s.a[0]), dd_mul(s.w[1], s.a[1]));
    s.sum = dd_add(dd_mul(s.w[2], s.plus), h);
    s.difference = dd_sub(dd_mul(s.w[2], s.minus), h);
    s.climb = dd_sub(dd_mul(s.w[0], s.a[1]), dd_mul(s.w[1], s.a[0]));
    s.w_square = dd_dot(s.w, s.w);
    return s;
}
/* Finds the heights where u3 is the lone root, from the cubic about the start in v = u - u0,
 * because u1 and u2 may be close to u0. Newton's method gives V = g (u3 - u0), the two others
 * follow. */
static void about_start(const initial *s, const dd c[3], double guess, turning *r)
{
    const dd scaled[3] = {dd_mul(dd_square(s->g), c[0]), dd_mul(s->g, c[1]), c[2]};
    r->third = newton_cubic(dd_of(1.0), scaled, guess);
    const dd product = dd_div(c[0], r->third),
             b = dd_div(dd_add(dd_mul(s->g, product), c[1]), r->third);
    /* The others solve v^2 - b v - product = 0, where product >= 0. */
    r->span = dd_sqrt(dd_add(dd_square(b), dd_scale(4.0, product)));
    if (b.hi > 0.0) {
        r->up = dd_half(dd_add(r->span, b));
        r->down = dd_div(product, r->up);
    } else {
        r->down = dd_half(dd_sub(r->span, b));
        r->up = r->down.hi > 0.0 ? dd_div(product, r->down) : dd_of(0.0);
    }
    r->g31 = dd_add(r->third, dd_mul(s->g, r->down));
    r->g32 = dd_sub(r->third, dd_mul(s->g, r->up));
    r->minus2 = dd_sub(s->minus, r->up);
    r->minus3 = dd_sub(r->third, dd_mul(s->g, s->minus));
    r->minus1 = dd_add(s->minus, r->down);
}
/* Finds the heights where u1 is the lone root, from the cubic about the upper pole, because that is
 * the only height where u2 and u3 can meet. */
static void about_top(const initial *s, double guess, turning *r)
{
    const dd wh = dd_add(dd_square(s->w[0]), dd_square(s->w[1]));
    const dd wa = dd_add(dd_mul(s->w[0], s->a[0]), dd_mul(s->w[1], s->a[1]));
    const dd tilt = dd_sub(dd_mul(s->minus, dd_sub(dd_square(s->w[2]), s->g)), dd_mul(s->w[2], wa));
    const dd c[3] = {dd_neg(dd_square(s->difference)), dd_times(-2.0, dd_add(wh, tilt)),
                     dd_sub(dd_mul(s->g, dd_add(dd_of(2.0), s->minus)), s->w_square)};
    r->minus1 = dd_neg(newton_cubic(s->g, c, guess - s->minus.hi));
    /* The others solve g s^2 + e1 s + e0 = 0 for s = u - 1, where e0 <= 0. */
    const dd e0 = dd_div(c[0], r->minus1), e1 = dd_div(dd_sub(c[1], e0), r->minus1);
    r->g32 = dd_sqrt(dd_sub(dd_square(e1), dd_times(4.0, dd_mul(s->g, e0))));
    if (e1.hi <= 0.0) {
        r->minus3 = dd_half(dd_sub(r->g32, e1));
        r->minus2 = r->minus3.hi > 0.0 ? dd_neg(dd_div(e0, r->minus3)) : dd_of(0.0);
    } else {
        const dd t = dd_half(dd_add(r->g32, e1));
        r->minus2 = dd_div(t, s->g);
        r->minus3 = dd_neg(dd_mul(s->g, dd_div(e0, t)));
    }
    r->third = dd_add(r->minus3, dd_mul(s->g, s->minus));
    r->down = dd_max(dd_sub(r->minus1, s->minus), dd_of(0.0));
    r->up = dd_max(dd_sub(s->minus, r->minus2), dd_of(0.0));
    r->span = dd_sub(r->minus1, r->minus2);
    r->g31 = dd_add(r->minus3, dd_mul(s->g, r->minus1));
}
/* Replaces small distances, whose differences have cancelled, by quotients of exact products:
 *     (W.e3 + W.a)^2 = (1 + u1)(1 + u2) g(1 + u3),   (W.e3 - W.a)^2 = (1 - u1)(1 - u2) g(u3 - 1),
 *     (du/dt)^2 = (u0 - u1)(u2 - u0) g(u3 - u0). */
static void sharpen(const initial *s, turning *r, int top)
{
    const dd plus = dd_square(s->sum), minus = dd_square(s->difference),
             climb = dd_square(s->climb);
    /* A distance is kept above this level, far below rounding, so that quotients stay finite. */
    const dd level = dd_of(1e-36);
    if (!top) {
        if (r->down.hi > r->up.hi)
            r->up = dd_div(climb, dd_mul(r->down, r->third));
        else if (r->up.hi > 0.0) /* untaken: where not, all three heights are one */
            r->down = dd_div(climb, dd_mul(r->up, r->third));
    }
    r->plus2 = dd_max(dd_add(s->plus, r->up), level);
    r->plus3 = dd_add(r->third, dd_mul(s->g, s->plus));
    r->plus1 = dd_div(plus, dd_mul(r->plus2, r->plus3));
    r->minus1 = dd_max(r->minus1, level);
    if (top) {
        if (s->g.hi * r->minus2.hi < r->minus3.hi)
            r->minus2 = dd_div(minus, dd_mul(r->minus1, r->minus3));
        else if (r->minus2.hi > 0.0) /* untaken: as above */
            r->minus3 = dd_div(minus, dd_mul(r->minus1, r->minus2));
    }
    r->span = dd_max(r->span, level);
    r->g32 = dd_max(r->g32, dd_times(1e-150, r->g31));
}
/* Finds the turning heights, by that cubic in which the two roots that are close lose no digits. */
static turning turning_heights(const initial *s)
{
    /* b is the horizontal part of W x a. */
    const dd b[2] = {dd_sub(dd_mul(s->w[1], s->a[2]), dd_mul(s->w[2], s->a[1])),
                     dd_sub(dd_mul(s->w[2], s->a[0]), dd_mul(s->w[0], s->a[2]))};
    const dd flat = dd_add(dd_square(s->a[0]), dd_square(s->a[1]));
    const dd twist = dd_sub(dd_mul(b[0], s->w[1]), dd_mul(b[1], s->w[0]));
    const dd c[3] = {dd_square(s->climb), dd_neg(dd_add(dd_mul(s->g, flat), dd_twice(twist))),
                     dd_sub(dd_twice(dd_mul(s->g, s->a[2])), s->w_square)};
    int top;
    const double guess = lone_root(c[2].hi, s->g.hi * c[1].hi, s->g.hi * s->g.hi * c[0].hi, &top);
    turning r;
    if (top)
        about_start(s, c, guess, &r);
    else
        about_top(s, guess / s->g.hi, &r);
    sharpen(s, &r, top);
    return r;
}
/* Gives the rates nu, k1 and k2, and returns agm(1, k'). k1 is
 *     (W.e3 + W.a) / (4 (1 + u3)) sum Q_n,   p0^2 = (1 + u3)/(u3 - u1),
 * and k2 is the like at the upper pole, with 1 - u in place of 1 + u. There the sum may start from
 * u3 or from u2, whichever is farther from the pole and hence has the larger p0. */
static dd lagrange_rates(const initial *s, const turning *r, dd *nu, dd *k1, dd *k2)
{
    const dd kp = dd_sqrt(dd_div(r->g32, r->g31));
    const int far = r->minus3.hi >= s->g.hi * r->minus2.hi;
    const dd p[2] = {dd_div(r->plus3, r->g31),
                     far ? dd_div(r->minus3, r->g31) : dd_div(r->minus2, r->minus1)};
    dd sum[2], mean = elliptic_mean(kp, 2, p, sum);
    *nu = dd_mul(dd_half(dd_sqrt(r->g31)), mean);
    *k1 = dd_div(dd_mul(dd_mul(s->sum, s->g), sum[0]), dd_times(4.0, r->plus3));
    if (far) {
        *k2 = r->minus3.hi > 0.0
                  ? dd_div(dd_mul(dd_mul(s->difference, s->g), sum[1]), dd_times(-4.0, r->minus3))
                  : dd_of(0.0);
    } else {
        const dd extra = dd_half(dd_mul(dd_div(r->span, r->minus2), sum[1]));
        *k2 = dd_div(dd_mul(dd_half(s->difference), dd_add(dd_of(1.0), extra)), r->minus1);
        *k2 = s->difference.hi < 0.0 ? dd_add(*k2, *nu) : dd_sub(*k2, *nu);
    }
    return mean;
}
/* Sets the theta series of alpha, beta and the horizontal momentum. The imaginary parts y1 and y2
 * of their arguments are incomplete integrals of the first kind; the sizes follow at the turning
 * heights from |alpha|^2 = (1 + u)/2 and |beta|^2 = (1 - u)/2. p1 and p2 stand for 1 + u1 and 1 +
 * u2, m1 and m2 for 1 - u1 and 1 - u2. */
static void lagrange_series(kr_exact *exact, const initial *s, const turning *r, double i1,
                            dd average)
{
    const double pi = 3.14159265358979323846, kp = sqrt(r->g32.hi / r->g31.hi), third = r->g31.hi,
                 mean = average.hi;
    const dd k2 = dd_max(dd_div(dd_mul(s->g, r->span), r->g31), dd_of(1e-36));
    const double T = theta_stretch(exact, average, k2);
    const double d = r->span.hi, p1 = r->plus1.hi, p2 = r->plus2.hi, m1 = r->minus1.hi,
                 m2 = r->minus2.hi;
    const double m32 = m1 * r->g32.hi, limit = 0.5 * pi * T, up = s->sum.hi < 0.0 ? -1.0 : 1.0;
    const double down = s->difference.hi < 0.0 ? -1.0 : 1.0;
    const double b1 = sqrt(p1) * elliptic_rf(d, d * r->plus3.hi / third, p2);
    const double b2 = sqrt(m2 * third / m32) * elliptic_rf(d * r->minus3.hi / m32, d / m1, 1.0);
    const double y1 = -up * fmin(mean * b1, limit), y2 = -down * fmin(mean * b2, limit);
    const int dual = T < 1.0;
    const double nome = exp(dual ? -pi / T : -pi * T), shrink = dual ? 1.0 / T : 1.0,
                 quarter = sqrt(sqrt(nome));
    double f[6];
    exact->curve = dual ? LAGRANGE_DUAL : LAGRANGE;
    exact->slope[0] = -y1 * shrink / pi;
    exact->slope[1] = -y2 * shrink / pi;
    exact->alpha = theta_series(THETA1, nome, y1 * shrink, dual);
    exact->beta = theta_series(dual ? THETA4 : THETA2, nome, y2 * shrink, dual);
    exact->horizontal = theta_series(THETA3, nome, (y1 + y2) * shrink, dual);
    if (dual) {
        const kr_theta pole = theta_series(THETA4, nome, y1 * shrink, 1);
        theta_scale(&exact->alpha,
                    sqrt(0.5 * p2) * 2.0 * quarter / sqrt(kp) / theta_at(pole.even, 0.0));
    } else
        theta_scale(&exact->alpha, sqrt(0.5 * p2) / theta_at(exact->alpha.even, 1.0));
    theta_scale(&exact->beta,
                sqrt(0.5 * m1) * (dual ? 1.0 : sqrt(kp)) / theta_at(exact->beta.even, 0.0));
    /* The momentum's size is taken at the lower turning height, where it is the larger: m1 p2 >= p1
     * m2 and plus3 >= minus3. Its series, theta3 on an axis, is positive. */
    const double lowest =
        -0.5 * (sqrt(m1 * p2 * r->plus3.hi) - up * down * sqrt(p1 * m2 * r->minus3.hi));
    phase_start(&exact->nutation, dd_of(0.0));
    factors_at(exact, 0.0, f);
    const double norm = f[0] * f[0] + f[1] * f[1] + f[2] * f[2] + f[3] * f[3];
    exact->momentum = i1 * lowest * sqrt(norm) / length(f[4], f[5]);
}
/* Returns the phase of the start [turns], 0 .. 1/4, by its distance from the nearer turning
 * height. */
static dd place(const turning *r, double mean)
{
    const double low = r->down.hi / r->span.hi,
                 high = fmax(r->up.hi / r->span.hi, r->down.hi > 0.0 ? 0.0 : 1.0);
    const double dn = r->third.hi / r->g31.hi, kp = r->g32.hi / r->g31.hi,
                 turn = mean / 6.283185307179586477;
    if (low * dn <= high) return dd_of(turn * sqrt(low) * elliptic_rf(high, dn, 1.0));
    return two_sum(0.25, -turn * sqrt(high / dn) * elliptic_rf(kp * low / dn, kp / dn, 1.0));
}
/* Sets where on the curve the start lies, and the two phases there. alpha, beta and the horizontal
 * momentum have three phases, of which one is the sum of the others. Each is poorly known where its
 * size is near zero, so the two largest are used; but the momentum's, which is known less well
 * where it is nearly vertical, is used only if it is larger by far. */
static void lagrange_start(kr_exact *exact, const initial *s, const turning *r, double i1,
                           double mean, const exact_top *top)
{
    const dd *p = top->q, here = place(r, mean);
    const kr_quat q = rounded(p);
    const double mh = length(top->m.x, top->m.y);
    const double top_square =
        s->w[0].hi * s->w[0].hi + s->w[1].hi * s->w[1].hi + s->g.hi * r->down.hi;
    const double size[3] = {length(q.w, q.z) / sqrt(0.5 * r->plus2.hi),
                            length(q.x, q.y) / sqrt(0.5 * r->minus1.hi),
                            mh > 0.0 ? mh / (i1 * sqrt(top_square)) : 0.0};
    double f[6];
    phase_start(&exact->nutation, s->climb.hi < 0.0 ? dd_neg(here) : here);
    factors_at(exact, 0.0, f);
    const dd both = turns_between(-f[4], -f[5], top->m.x, top->m.y); /* momentum <= 0 */
    dd first = turns_between(f[0], f[1], p[0].hi, p[3].hi);
    dd second = turns_between(f[2], f[3], p[1].hi, p[2].hi);
    if (size[0] < size[1] && 2.0 * size[0] < size[2])
        first = dd_sub(both, second);
    else if (size[1] <= size[0] && 2.0 * size[1] < size[2])
        second = dd_sub(both, first);
    phase_start(&exact->first, first);
    phase_start(&exact->second, second);
}
/* Says whether the axis rests at a pole. Where it leans or moves, it does so by more than what
 * kr_exact_resolves asks for. */
static int stands(const initial *s)
{
    const double least = 1e-150, wh = s->w[0].hi * s->w[0].hi + s->w[1].hi * s->w[1].hi;
    return wh <= least * (s->w_square.hi + s->g.hi) && fmin(s->plus.hi, s->minus.hi) <= least;
}
/* Returns the closed form of a Lagrange top, in its own units. */
static kr_exact lagrange_closed_form(const exact_top *top)
{
    kr_exact exact = {0};
    if (top->lever.hi < 0.0) {
        const exact_top below = seen_from_below(top);
        exact = lagrange_closed_form(&below);
        turn_over(&exact);
        return exact;
    }
    const dd i1 = dd_half(two_sum(top->inertia.x, top->inertia.y));
    const initial s = initial_of(top, i1);
    const dd axial = dd_half(dd_sub(s.sum, s.difference));
    /* The spin beyond W's is c (1/I3 - 1/I1) with c = <m, a>; alpha and beta turn by half of it. */
    const dd half_spin =
        dd_half(dd_mul(dd_sub(dd_div(i1, dd_of(top->inertia.z)), dd_of(1.0)), axial));
    exact.constant.z = top->m.z;
    exact.side = 1.0;
    if (stands(&s)) {
        const dd half = dd_half(s.w[2]);
        steady_closed_form(&exact, rounded(top->q), dd_add(half, half_spin),
                           dd_sub(half, half_spin));
        return exact;
    }
    const turning r = turning_heights(&s);
    dd nu, k1, k2;
    const dd mean = lagrange_rates(&s, &r, &nu, &k1, &k2);
    lagrange_series(&exact, &s, &r, i1.hi, mean);
    exact.nutation = phase_of(nu);
    exact.first = phase_of(dd_add(k1, half_spin));
    exact.second = phase_of(dd_sub(k2, half_spin));
    lagrange_start(&exact, &s, &r, i1.hi, mean.hi, top);
    set_rates(&exact, nu.hi, dd_add(k1, half_spin).hi, dd_sub(k2, half_spin).hi, 0);
    return exact;
}
#endif
