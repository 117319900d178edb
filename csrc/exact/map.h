/* The k-th state of the Bobenko-Suris map in closed form. The states lie at equally spaced phases
 * on an elliptic curve of the same form as the curve of the continuous motion. A link is a pair of
 * consecutive states. In the notation of map_curve.h, where a prime marks the next state,
 *     alpha' conj(alpha) = e^{i atan c} N+ / sqrt(8 y),
 *     beta' conj(beta) = e^{-i atan c} N- / sqrt(8 y).
 * Hence each step of the map increases the phase of the complex number alpha by arg N+(s2) - 2 arg
 * theta2(eta/2 + i y1). The phase of beta increases by the same expression with N+, s2 and y1
 * replaced by N-, s1 and y2. The momentum of a state describes the motion during the preceding
 * step, and therefore belongs to a time half a step earlier. The rotation about the symmetry axis
 * is computed exactly, as in methods/bobenko_suris.h. This header is compiled once for each
 * instruction set, because double-double arithmetic is faster on processors with fused
 * multiply-add. */
#ifndef KR_EXACT_MAP_H
#define KR_EXACT_MAP_H
#include "method.h"
#include "map_curve.h"
#include "scaling.h"

/* Returns arg theta2(x + i y) for |x| <= pi/4. If K'/K < 1, the function is computed from the dual
 * series, which is a theta4 series. The terms are `weight` times cos(n x) cosh(n y) and sin(n x)
 * sinh(n y), with odd n for theta2 and even n for theta4. Here c and s are cos(n x) and sin(n x),
 * and `up` and `down` are e^(n y) and e^(-n y). */
static dd arg_theta2(const map_curve *r, dd x, dd y)
{
    const int dual = r->ratio.hi < 1.0;
    const dd one = dd_of(1.0), pi = dd_pi(), ratio = r->ratio;
    const dd nome = dd_exp(dd_neg(dual ? dd_div(pi, ratio) : dd_mul(pi, ratio)));
    const dd qq = dd_square(nome);
    const dd turn = dual ? dd_div(y, ratio) : x, grow = dd_exp(dual ? dd_div(x, ratio) : y);
    dd s1, c1;
    dd_sincos(turn, &s1, &c1);
    const dd s2 = dd_twice(dd_mul(s1, c1)), c2 = dd_sub(one, dd_twice(dd_square(s1)));
    const dd up2 = dd_square(grow), down2 = dd_div(one, up2);
    dd s = dual ? dd_of(0.0) : s1, c = dual ? one : c1;
    dd up = dual ? one : grow, down = dual ? one : dd_div(one, grow);
    dd weight = one, power = dual ? nome : qq;
    dd re = dual ? one : dd_of(0.0), im = dd_of(0.0);
    for (int j = 0; j < 8; j++) {
        if (!dual || j > 0) {
            re = dd_add(re, dd_mul(weight, dd_mul(c, dd_half(dd_add(up, down)))));
            im = dd_add(im, dd_mul(weight, dd_mul(s, dd_half(dd_sub(up, down)))));
        }
        const dd next = dd_sub(dd_mul(c, c2), dd_mul(s, s2));
        s = dd_add(dd_mul(s, c2), dd_mul(c, s2));
        c = next;
        up = dd_mul(up, up2);
        down = dd_mul(down, down2);
        weight = dd_mul(weight, dual ? dd_times(j == 0 ? -2.0 : -1.0, power) : power);
        power = dd_mul(power, qq);
    }
    if (!dual) return dd_atan2(dd_neg(im), re);
    return dd_sub(dd_atan2(im, re), dd_div(dd_twice(dd_mul(x, y)), dd_mul(pi, r->ratio)));
}
/* Returns the increase in the phase of alpha (sign 1) or beta (sign -1) over one step. The
 * calculation uses two consecutive states that are symmetric about a maximum or minimum of the apex
 * height. */
static dd turn_per_step(const map_link *k, const map_curve *r, dd s, double sign, dd y)
{
    dd re, im;
    map_linear(k, s, sign, &re, &im);
    return dd_sub(dd_atan2(im, re), dd_twice(arg_theta2(r, dd_half(r->eta), y)));
}
/* Sets the theta series of alpha, beta and the momentum, and the theta4 series by which the
 * momentum is divided. */
static void map_series(kr_exact_map_form *map, const map_curve *r)
{
    const double pi = 3.14159265358979323846, T = r->ratio.hi, y1 = r->y1.hi, y2 = r->y2.hi;
    const int dual = T < 1.0;
    const double nome = exp(dual ? -pi / T : -pi * T), shrink = dual ? 1.0 / T : 1.0,
                 x = 0.5 * r->eta.hi * shrink;
    const double sn = dual ? sinh(x) : sin(x), at = dual ? -sn * sn : sn * sn;
    const kr_theta three = theta_series(THETA3, nome, 0.0, dual);
    const kr_theta one = theta_series(THETA4, nome, y1 * shrink, dual);
    kr_exact_form *curve = &map->curve;
    map->pole = theta_series(dual ? THETA2 : THETA4, nome, 0.0, dual);
    curve->curve = dual ? LAGRANGE_DUAL : LAGRANGE;
    const dd stretch = dd_div(dd_pi(), r->ratio);
    curve->stretch = stretch.hi;
    curve->stretch_rest = stretch.lo;
    curve->slope[0] = -y1 * shrink / pi;
    curve->slope[1] = -y2 * shrink / pi;
    curve->alpha = theta_series(THETA1, nome, y1 * shrink, dual);
    curve->beta = theta_series(dual ? THETA4 : THETA2, nome, y2 * shrink, dual);
    curve->horizontal = theta_series(THETA3, nome, (y1 + y2) * shrink, dual);
    const double high = dual ? theta_at(one.even, 0.0) : theta_at(curve->alpha.even, 1.0);
    const double low = theta_at(curve->beta.even, 0.0) / (dual ? cosh(x) : 1.0);
    theta_scale(&curve->alpha, sqrt(0.5 * r->plus2) * theta_at(three.even, at) / high);
    theta_scale(&curve->beta, sqrt(0.5 * r->minus1) * theta_at(map->pole.even, at) / low);
}
/* Returns the theta function theta4 after k steps of the map, on the same scale as the other theta
 * functions. */
static double pole_at(const kr_exact_map_form *map, double k)
{
    const kr_phase *f = &map->curve.nutation;
    const dd p = two_product(k, f->fast);
    double x = (p.hi - rint(p.hi)) + (p.lo + k * f->slow + f->start), s;
    if (map->curve.curve == LAGRANGE) {
        s = sin(6.283185307179586477 * x);
        return theta_at(map->pole.even, s * s);
    }
    x = 2.0 * x - rint(2.0 * x);
    s = sinh(x * map->curve.stretch);
    return theta_at(map->pole.even, -s * s) * sqrt(1.0 + s * s);
}
/* Sets the scale factor of the momentum from its value at the lowest position of the axis. The
 * momentum is larger there than at the highest position, because 1 + |W|^2 = (1 + E)/(1 + b s). The
 * sign of this scale factor follows from the relation W ~ alpha beta' - beta alpha' between two
 * successive states. Returns the largest |W|^2. */
static double set_momentum(kr_exact_map_form *map, const map_link *k)
{
    double f[6], g[6], h[6];
    kr_exact_form *curve = &map->curve;
    const dd above = dd_sub(dd_scale(k->sign, k->energy), dd_mul(k->b, k->s1));
    const double square = dd_sub(dd_div(above, map_height(k, k->s1)), dd_square(k->l)).hi,
                 across = fmax(square, 0.0);
    phase_start(&curve->nutation, dd_of(0.0));
    factors_at(curve, -0.5, f);
    factors_at(curve, 0.5, g);
    factors_at(curve, 0.0, h);
    const double re = (f[0] * g[2] - f[1] * g[3]) - (f[2] * g[0] - f[3] * g[1]);
    curve->momentum = k->unit * sqrt(across) * pole_at(map, 0.0) / length(h[4], h[5]);
    if (re * h[4] < 0.0) curve->momentum = -curve->momentum;
    return across + k->l.hi * k->l.hi;
}
/* Sets the initial phases. The phase of the momentum is the sum of the phases of alpha and beta.
 * For the two largest of alpha, beta and the momentum, the phase is computed directly; the third
 * phase follows from these two. */
static void set_phases(kr_exact_form *curve, const map_link *k, const map_curve *r, double most,
                       const dd p[4])
{
    const kr_quat q = rounded(p);
    const double ra = length(q.w, q.z) / sqrt(0.5 * r->plus2),
                 rb = length(q.x, q.y) / sqrt(0.5 * r->minus1);
    const double rm = length(k->w[0].hi, k->w[1].hi) / sqrt(most > 0.0 ? most : 1.0);
    double f[6], h[6];
    phase_start(&curve->nutation,
                dd_div(dd_sub(dd_of(r->start), dd_half(r->eta)), dd_twice(dd_pi())));
    factors_at(curve, 0.0, f);
    /* The middle of the first link is half a step after the initial state. h includes the increase
     * of the phases during this half step, so `both` does not. */
    factors_at(curve, 0.5, h);
    const double sign = curve->momentum * k->unit < 0.0 ? -1.0 : 1.0;
    const dd both = turns_between(sign * h[4], sign * h[5], k->w[0].hi, k->w[1].hi);
    dd first = turns_between(f[0], f[1], p[0].hi, p[3].hi);
    dd second = turns_between(f[2], f[3], p[1].hi, p[2].hi);
    if (ra < rb && ra < rm)
        first = dd_sub(both, second);
    else if (rb < rm)
        second = dd_sub(both, first);
    phase_start(&curve->first, first);
    phase_start(&curve->second, second);
}
/* Returns 1 if the symmetry axis of the top is at rest. A top is considered at rest at a pole if
 * its tilt and its velocity are both below 1e-100. Without gravity and momentum, a top is at rest
 * in every attitude. */
static int is_axis_at_rest(const map_link *k, dd plus, dd minus)
{
    const double least = 1e-200, wh = k->w[0].hi * k->w[0].hi + k->w[1].hi * k->w[1].hi,
                 w = wh + k->l.hi * k->l.hi;
    return wh <= least * (w + fabs(k->b.hi)) &&
           (fmin(plus.hi, minus.hi) <= least || (w == 0.0 && k->b.hi == 0.0));
}
/* Sets up the closed-form solution of the map in internal units, using the step size as the unit of
 * time. Returns 0 if 1 + b s = 0, or if the motion is too close to a separatrix. */
static int own_map(const exact_top *top, map_link k, kr_exact_map_form *map)
{
    const dd i1 = equal_moment(top);
    kr_exact_form *curve = &map->curve;
    dd a[3], plus;
    const dd minus = axis_of(top->q, a, &plus), angle = dd_atan2(k.c, dd_of(1.0));
    /* half of step * <m, a> / I3 */
    const dd twist = dd_div(dd_mul(i1, k.c), dd_of(top->inertia.z));
    curve->constant.z = top->m.z;
    curve->side = 1.0;
    if (!(map_height(&k, k.s).hi > 0.0)) return 0;
    if (is_axis_at_rest(&k, plus, minus)) {
        const dd turn = dd_atan2(k.l, dd_of(1.0)), rest = dd_sub(twist, angle);
        steady_closed_form(curve, rounded(top->q), dd_add(turn, rest), dd_sub(turn, rest));
        return 1;
    }
    const map_curve r = map_curve_of(&k);
    if (!(r.kp2.hi > 1e-18)) return 0; /* the error grows like 1e-31 / kp2 */
    const dd k1 = turn_per_step(&k, &r, k.s2, 1.0, r.y1),
             k2 = turn_per_step(&k, &r, k.s1, -1.0, r.y2);
    const dd first = dd_add(k1, twist), second = dd_sub(k2, twist);
    map_series(map, &r);
    curve->nutation = phase_of(r.eta);
    /* set_momentum needs phases that include the rotation by the Cayley drift, but not the twist
     * about the axis. */
    curve->first = phase_of(dd_add(k1, angle));
    curve->second = phase_of(dd_sub(k2, angle));
    const double most = set_momentum(map, &k);
    curve->first = phase_of(first);
    curve->second = phase_of(second);
    set_phases(curve, &k, &r, most, top->q);
    set_rates(curve, r.eta.hi, first.hi, second.hi);
    return isfinite(curve->momentum + curve->first.start + curve->second.start);
}
/* Returns the attitude after k steps and the momentum during the last step. Returns the initial
 * state if k is too large for the phases to be computed. */
static kr_state map_state(const kr_exact_map_form *map, int64_t k)
{
    const kr_exact_form *curve = &map->curve;
    const double at = is_within(curve, (double)k) ? (double)k : 0.0, half = at - 0.5,
                 scale = curve->momentum / pole_at(map, half);
    double f[6], h[6];
    factors_at(curve, at, f);
    factors_at(curve, half, h);
    const kr_quat q = q_unit(q4(f[0], v3(f[2], f[3], f[1])));
    const kr_state r = {curve->begin + (double)k * map->step,
                        curve->framed != 0.0 ? framed(curve->frame, q) : q,
                        {scale * h[4], curve->side * scale * h[5], curve->constant.z}};
    return r;
}
/* Returns 1 if the closed-form solution reproduces the initial attitude `start`. For step sizes of
 * 1e-8 or less, the solution may be inaccurate if the initial axis is very close to a pole.
 * Double-double arithmetic cannot resolve very small distances from a pole. */
static int begins_at(const kr_exact_map_form *map, kr_quat start)
{
    return kr_attitude_error(map_state(map, 0).q, start) <= 1e-9;
}
/* Sets up the closed-form solution of the Bobenko-Suris map for a scene. If 1 + b s < 0, the
 * solution of the equivalent top with up and down interchanged is computed instead. */
static kr_status map_plan(const kr_scene *scene, double step, kr_exact_map_form *map)
{
    const kr_exact_map_form empty = {.pole = {{1.0}, {0.0}}};
    described_top top;
    if (step == 0.0) return KR_ERR_NO_STEP;
    if (!isfinite(step)) return KR_ERR_ARGUMENT;
    kr_status status = kr_scene_check(scene);
    if (status == KR_OK && !(kr_method_applies(&kr_method_bobenko_suris, &scene->body) &&
                             !kr_scene_is_disturbed(scene)))
        status = KR_ERR_METHOD;
    if (status == KR_OK) status = read_top(scene, KR_KIND_LAGRANGE, &top);
    if (status != KR_OK) return status;
    kr_exact_map_form r = empty;
    exact_top seen;
    map_link k;
    int below = top.own.lever.hi < 0.0;
    /* The first pass determines whether up and down are exchanged, and the second pass uses the
     * result. More than two passes through this loop would not change the result. */
    for (int i = 0; i < 2; i++) {
        seen = below ? seen_from_below(&top.own) : top.own;
        k = map_link_of(&seen, step / top.units.time);
        if (k.b.hi < 0.0) below = !below;
    }
    if (!(fabs(step) > 0x1p-100 * top.units.time && fabs(step) < 0x1p40 * top.units.time))
        return KR_ERR_ARGUMENT; /* Powers of this step size could overflow or underflow. */
    if (!own_map(&seen, k, &r) || !is_within(&r.curve, 1.0)) return KR_ERR_STEP_SIZE;
    if (below) {
        turn_over(&r.curve);
        fill_frame_below(r.curve.frame);
        r.curve.framed = 1.0;
    }
    to_frame_and_units(&r.curve, &top, scene->start.t, 1.0);
    r.period = r.curve.period * fabs(step);
    r.precession_rate = r.curve.precession_rate / step;
    r.spin_angle_rate =
        (top.behind ? opposite_spin(r.curve.spin_angle_rate) : r.curve.spin_angle_rate) / step;
    r.step = step;
    if (!begins_at(&r, scene->start.q)) return KR_ERR_STEP_SIZE;
    memcpy(map, &r, sizeof r);
    return KR_OK;
}
#endif
