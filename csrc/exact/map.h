/* The k-th state of the Bobenko-Suris map, at once: a curve like the top's, walked in equal
 * strides. With
 *     alpha' conj(alpha) = e^{i atan c} N+ / sqrt(8 y),   beta' conj(beta) = e^{-i atan c} N- / sqrt(8 y)
 * the turn of alpha a step is arg N+(s2) - 2 arg theta2(eta/2 + i y1), of beta the like; the
 * momentum belongs to the link between two states, hence to half a stride back. Spin: the exact
 * total twist (lagrange.h). */
#ifndef KR_MAP_H
#define KR_MAP_H
#include "method.h"
#include "map_curve.h"
#include "from_scene.h"

/* arg theta2(x + i y), |x| <= pi/4; below ratio 1 by the dual series theta4(y' - i x'). */
static dd arg_theta2(const map_curve *r, dd x, dd y)
{
    const int dual = r->ratio.hi < 1.0;
    const dd one = dd_of(1.0), pi = dd_pi(), ratio = r->ratio;
    const dd nome = dd_exp(dd_neg(dual ? dd_div(pi, ratio) : dd_mul(pi, ratio))),
             qq = dd_square(nome);
    const dd turn = dual ? dd_div(y, ratio) : x, grow = dd_exp(dual ? dd_div(x, ratio) : y);
    dd s1, c1, up = one, down = one, g2 = dd_square(grow), s = dd_of(0.0), c = one, weight = one,
               power = nome;
    dd re = dual ? one : dd_of(0.0), im = dd_of(0.0);
    dd_sincos(turn, &s1, &c1);
    const dd s2 = dd_twice(dd_mul(s1, c1)), c2 = dd_sub(one, dd_twice(dd_square(s1))),
             down2 = dd_div(one, g2);
    if (!dual) s = s1, c = c1, up = grow, down = dd_div(one, grow), power = qq;
    for (int j = 0; j < 8; j++) {
        /* weight cos (up + down), weight sin (up - down) */
        if (!dual || j > 0) {
            re = dd_add(re, dd_mul(weight, dd_mul(c, dd_half(dd_add(up, down)))));
            im = dd_add(im, dd_mul(weight, dd_mul(s, dd_half(dd_sub(up, down)))));
        }
        const dd next = dd_sub(dd_mul(c, c2), dd_mul(s, s2));
        s = dd_add(dd_mul(s, c2), dd_mul(c, s2));
        c = next;
        up = dd_mul(up, g2);
        down = dd_mul(down, down2);
        weight = dd_mul(weight, dual ? dd_times(j == 0 ? -2.0 : -1.0, power) : power);
        power = dd_mul(power, qq);
    }
    if (!dual) return dd_atan2(dd_neg(im), re);
    return dd_sub(dd_atan2(im, re), dd_div(dd_twice(dd_mul(x, y)), dd_mul(pi, r->ratio)));
}
static dd turn_per_step(const map_link *k, const map_curve *r, dd s, double sign, dd y)
{
    dd re, im;
    map_linear(k, s, sign, &re, &im);
    return dd_sub(dd_atan2(im, re), dd_twice(arg_theta2(r, dd_half(r->eta), y)));
}
static void map_series(kr_exact_map *map, const map_curve *r)
{
    const double pi = 3.14159265358979323846, T = r->ratio.hi, y1 = r->y1.hi, y2 = r->y2.hi;
    const int dual = T < 1.0;
    const double nome = exp(dual ? -pi / T : -pi * T), shrink = dual ? 1.0 / T : 1.0,
                 x = 0.5 * r->eta.hi * shrink;
    const double sn = dual ? sinh(x) : sin(x), at = dual ? -sn * sn : sn * sn;
    const kr_theta three = theta_series(THETA3, nome, 0.0, dual);
    const kr_theta one = theta_series(THETA4, nome, y1 * shrink, dual);
    kr_exact *plan = &map->curve;
    map->pole = theta_series(dual ? THETA2 : THETA4, nome, 0.0, dual);
    plan->curve = dual ? LAGRANGE_DUAL : LAGRANGE;
    const dd stretch = dd_div(dd_pi(), r->ratio);
    plan->stretch = stretch.hi;
    plan->stretch_rest = stretch.lo;
    plan->slope[0] = -y1 * shrink / pi;
    plan->slope[1] = -y2 * shrink / pi;
    plan->alpha = theta_series(THETA1, nome, y1 * shrink, dual);
    plan->beta = theta_series(dual ? THETA4 : THETA2, nome, y2 * shrink, dual);
    plan->horizontal = theta_series(THETA3, nome, (y1 + y2) * shrink, dual);
    const double high = dual ? theta_at(one.even, 0.0) : theta_at(plan->alpha.even, 1.0);
    const double low = theta_at(plan->beta.even, 0.0) / (dual ? cosh(x) : 1.0);
    theta_scale(&plan->alpha, sqrt(0.5 * r->plus2) * theta_at(three.even, at) / high);
    theta_scale(&plan->beta, sqrt(0.5 * r->minus1) * theta_at(map->pole.even, at) / low);
}
/* theta4 in the middle of a link, as the kernel scales it. */
static double pole_at(const kr_exact_map *map, double k)
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
/* The momentum's scale: its size at one of the two symmetric links, its sign from W ~ alpha beta' -
 * beta alpha'. Returns the largest |W|^2. */
static double set_momentum(kr_exact_map *map, const map_link *k)
{
    double size[2], f[6], g[6], h[6];
    kr_exact *plan = &map->curve;
    for (int i = 0; i < 2; i++) {
        const dd s = i == 0 ? k->s1 : k->s2,
                 above = dd_sub(dd_scale(k->sign, k->energy), dd_mul(k->b, s));
        size[i] = dd_sub(dd_div(above, map_height(k, s)), dd_square(k->l)).hi;
    }
    const int high = size[1] > size[0];
    phase_start(&plan->nutation, dd_of(high ? 0.25 : 0.0));
    factors_at(plan, -0.5, f);
    factors_at(plan, 0.5, g);
    factors_at(plan, 0.0, h);
    const double re = (f[0] * g[2] - f[1] * g[3]) - (f[2] * g[0] - f[3] * g[1]);
    plan->momentum = k->unit * sqrt(fmax(size[high], 0.0)) * pole_at(map, 0.0) / length(h[4], h[5]);
    if (re * h[4] < 0.0) plan->momentum = -plan->momentum;
    return fmax(size[high], 0.0) + k->l.hi * k->l.hi;
}
static void set_phases(kr_exact *plan, const map_link *k, const map_curve *r, double most,
                       const dd p[4])
{
    const kr_quat q = rounded(p);
    const double ra = length(q.w, q.z) / sqrt(0.5 * r->plus2),
                 rb = length(q.x, q.y) / sqrt(0.5 * r->minus1);
    const double rm = length(k->w[0].hi, k->w[1].hi) / sqrt(most > 0.0 ? most : 1.0);
    double f[6], h[6];
    phase_start(&plan->nutation,
                dd_div(dd_sub(dd_of(r->start), dd_half(r->eta)), dd_twice(dd_pi())));
    factors_at(plan, 0.0, f);
    factors_at(plan, 0.5, h); /* the first link: phases of half a step are taken off again */
    const double sign = plan->momentum * k->unit < 0.0 ? -1.0 : 1.0;
    const dd both = turns_between(sign * h[4], sign * h[5], k->w[0].hi, k->w[1].hi);
    dd first = turns_between(f[0], f[1], p[0].hi, p[3].hi);
    dd second = turns_between(f[2], f[3], p[1].hi, p[2].hi);
    if (ra < rb && ra < rm)
        first = dd_sub(both, second);
    else if (rb < rm)
        second = dd_sub(both, first);
    phase_start(&plan->first, first);
    phase_start(&plan->second, second);
}
/* As in lagrange.c; or there is neither gravity nor momentum. */
static int stands_still(const map_link *k, dd plus, dd minus)
{
    const double least = 1e-200, wh = k->w[0].hi * k->w[0].hi + k->w[1].hi * k->w[1].hi,
                 w = wh + k->l.hi * k->l.hi;
    return wh <= least * (w + fabs(k->b.hi)) &&
           (fmin(plus.hi, minus.hi) <= least || (w == 0.0 && k->b.hi == 0.0));
}
/* In own units, a step at a time; 0 if 1 + b s = 0, or so near a separatrix that the roots are not
 * known well enough. */
static int own_map(const exact_top *top, map_link k, kr_exact_map *map)
{
    const dd i1 = equal_moment(top);
    kr_exact *plan = &map->curve;
    dd a[3], plus;
    const dd minus = axis_of(top->q, a, &plus), angle = dd_atan2(k.c, dd_of(1.0));
    const dd spin = dd_div(dd_mul(i1, k.c), dd_of(top->inertia.z)); /* half of step c / I3 */
    plan->constant.z = top->m.z;
    plan->side = 1.0;
    if (!(map_height(&k, k.s).hi > 0.0)) return 0;
    if (stands_still(&k, plus, minus)) {
        const dd turn = dd_atan2(k.l, dd_of(1.0)), twist = dd_sub(spin, angle);
        steady_plan(plan, rounded(top->q), dd_add(turn, twist), dd_sub(turn, twist));
        return 1;
    }
    const map_curve r = map_curve_of(&k);
    if (!(r.kp2.hi > 1e-26)) return 0;
    const dd k1 = turn_per_step(&k, &r, k.s2, 1.0, r.y1),
             k2 = turn_per_step(&k, &r, k.s1, -1.0, r.y2);
    const dd first = dd_add(k1, spin), second = dd_sub(k2, spin);
    map_series(map, &r);
    plan->nutation = phase_of(r.eta);
    plan->first = phase_of(dd_add(k1, angle)); /* the turn without further spin */
    plan->second = phase_of(dd_sub(k2, angle));
    const double most = set_momentum(map, &k);
    plan->first = phase_of(first);
    plan->second = phase_of(second);
    set_phases(plan, &k, &r, most, top->q);
    set_rates(plan, r.eta.hi, first.hi, second.hi, 0);
    return isfinite(plan->momentum + plan->first.start + plan->second.start);
}
static kr_status map_plan(const kr_scene *scene, double step, kr_exact_map *map)
{
    const kr_exact_map empty = {.pole = {{1.0}, {0.0}}};
    exact_top top;
    if (!isfinite(step) || step == 0.0) return KR_ERR_ARGUMENT;
    kr_status status = kr_scene_check(scene);
    if (status == KR_OK && !kr_method_applies(&kr_method_bobenko_suris, &scene->body))
        status = KR_ERR_METHOD;
    if (status == KR_OK) status = read_top(scene, KR_LAGRANGE, &top);
    if (status != KR_OK) return status;
    kr_exact_map r = empty;
    exact_top seen;
    map_link k;
    int below = top.lever.hi < 0.0;
    for (int i = 0; i < 2; i++) { /* where 1 + b s < 0 the other view has b > 0 */
        seen = below ? seen_from_below(&top) : top;
        k = map_link_of(&seen, step / top.units.time);
        if (k.b.hi < 0.0) below = !below;
    }
    if (!own_map(&seen, k, &r)) return KR_ERR_STEP_SIZE;
    if (below) turn_over(&r.curve);
    to_user(&r.curve, &top, scene->start.t, 1.0);
    r.curve.period *= fabs(step);
    r.curve.precession /= step;
    r.curve.spin /= step;
    r.step = step;
    *map = r;
    return KR_OK;
}
static kr_state map_state(const kr_exact_map *map, int64_t k)
{
    const kr_exact *plan = &map->curve;
    const double at = (double)k, half = at - 0.5, scale = plan->momentum / pole_at(map, half);
    double f[6], h[6];
    factors_at(plan, at, f);
    factors_at(plan, half, h);
    const kr_quat q = q_unit(q4(f[0], v3(f[2], f[3], f[1])));
    const kr_state r = {plan->begin + at * map->step,
                        plan->framed ? framed(plan->frame, q) : q,
                        {scale * h[4], plan->side * scale * h[5], plan->constant.z}};
    return r;
}
#endif
