/* The curve of the Bobenko-Suris map m' = m + step torque(a), a' = Cay(step m' / I1) a. With h =
 * step/2, u = a.e3, W = h m'/I1, b = h^2 lever/I1, the constants of map and link are
 *     l = W.e3,   c = W.a,   E = |W|^2 (1 + b s) + b s,   X = 2 (1 + c^2)/(1 + E),
 *     s = u + u',   y = X (1 + b s) = 1 + a.a',   N+- = y +- s + i(l y - c s);   then
 *     (1+u)(1+u') = |N+|^2 / 2y,   (1-u)(1-u') = |N-|^2 / 2y,   (u' - u)^2 (1 + b s) = P(s),
 * where P is a cubic with roots s1 <= s <= s2 <= s3. Both s and u are elliptic functions of a phase
 * that increases by eta in each step. If a step is so large that 1 + b s < 0, the signs of b and X
 * are reversed. A step with b < 0 is equivalent to a step of the same top under reversed gravity.
 * This header is compiled once for each instruction set, because double-doubles are faster with
 * fused multiply-add. */
#ifndef KR_EXACT_MAP_CURVE_H
#define KR_EXACT_MAP_CURVE_H
#include "math/dd_functions.h"
#include "single.h"
#include "theta.h"

/* The first step of the map, and the quantities that determine the elliptic curve. */
typedef struct map_link {
    dd l, c, b, energy, x; /* notation of the file's head; b and x are multiplied by `sign` */
    dd s, climb;           /* u + u', u' - u */
    dd w[3];               /* W */
    dd p[4];               /* the coefficients of P, multiplied by `sign` */
    dd s1, s2, third;      /* roots of P; for s3, which may be infinite, b (s3 - s) */
    dd below, above;       /* s - s1, s2 - s */
    double unit;           /* m = unit W */
    double sign;           /* sign of 1 + b s */
} map_link;
/* Parameters of the elliptic functions that describe the states of the Bobenko-Suris map. The phase
 * increases by pi in each period of the nutation. */
typedef struct map_curve {
    dd k2, kp2, mean, ratio; /* k^2, k'^2, agm(1, k'), K'/K */
    dd eta, y1, y2;          /* growth of the phase in a step; imaginary parts of the arguments */
    double plus2, minus1, start; /* 1 + u2, 1 - u1, phase at the middle of the first link */
} map_curve;

/* Returns sign * (1 + b s), which is positive. */
static dd map_height(const map_link *k, dd s) { return dd_add(dd_of(k->sign), dd_mul(k->b, s)); }

static void cross(const dd a[3], const dd b[3], dd r[3])
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        r[i] = dd_sub(dd_mul(a[j], b[k]), dd_mul(a[k], b[j]));
    }
}
/* Performs the first step of the Bobenko-Suris map, and computes the constants of its elliptic
 * curve. */
static map_link map_link_of(const exact_top *top, double step)
{
    const dd one = dd_of(1.0), i1 = equal_moment(top), scale = dd_div(dd_of(0.5 * step), i1);
    const kr_vec3 m = top->m;
    dd a[3], sum[3], turn[3], plus, n; /* sum is a + a', n is |W|^2 */
    map_link k;
    axis_of(top->q, a, &plus);
    k.unit = 2.0 * i1.hi / step;
    k.sign = 1.0;
    k.b = dd_mul(top->lever, dd_times(0.5 * step, scale));
    k.w[0] = dd_sub(dd_times(m.x, scale), dd_twice(dd_mul(k.b, a[1])));
    k.w[1] = dd_add(dd_times(m.y, scale), dd_twice(dd_mul(k.b, a[0])));
    k.l = k.w[2] = dd_times(m.z, scale);
    /* The kick is normal to a and e3, so that c and l are components of the momentum m. They cancel
     * exactly if the axis swings in a vertical plane. */
    k.c = dd_mul(dd_add(dd_add(dd_times(m.x, a[0]), dd_times(m.y, a[1])), dd_times(m.z, a[2])),
                 scale);
    n = dd_dot(k.w, k.w);
    cross(k.w, a, turn);
    for (int i = 0; i < 3; i++)
        sum[i] =
            dd_div(dd_twice(dd_add(a[i], dd_add(dd_mul(k.c, k.w[i]), turn[i]))), dd_add(one, n));
    k.s = sum[2];
    cross(k.w, sum, turn); /* W x (a + a') = a' - a */
    k.climb = turn[2];
    k.energy = dd_add(dd_mul(n, map_height(&k, k.s)), dd_mul(k.b, k.s));
    k.x = dd_div(dd_twice(dd_add(one, dd_square(k.c))), dd_add(one, k.energy));
    if (k.x.hi < 0.0) {
        k.sign = -1.0;
        k.b = dd_neg(k.b);
        k.x = dd_neg(k.x);
    }
    return k;
}
/* Sets the coefficients of the cubic polynomial sign * P(s). No terms of the size 1/h^2 cancel in
 * the form
 *     P(s) = b s^3 - D/(1+c^2) s^2 + (1 + b s)(4 D/(1+E) - 2 X b s)
 *            - 2/X (l X (1 + b s) - c s)^2,   D = E - c^2. */
static void fill_cubic(map_link *k)
{
    const dd one = dd_of(1.0), cc = dd_square(k->c), d = dd_sub(k->energy, cc),
             lx = dd_mul(k->l, k->x);
    const dd level = dd_div(dd_times(4.0, d), dd_add(one, k->energy)),
             xb = dd_twice(dd_mul(k->x, k->b));
    const dd e = dd_sub(dd_mul(lx, k->b), k->c), two = dd_div(dd_of(2.0), k->x);
    k->p[3] = k->b;
    const dd flat = dd_scale(k->sign, dd_div(d, dd_add(one, cc)));
    k->p[2] = dd_neg(dd_add(dd_add(flat, dd_mul(k->b, xb)), dd_mul(two, dd_square(e))));
    k->p[1] = dd_sub(dd_mul(level, k->b),
                     dd_scale(k->sign, dd_add(xb, dd_mul(dd_twice(two), dd_mul(e, lx)))));
    k->p[0] = dd_sub(dd_scale(k->sign, level), dd_mul(two, dd_square(lx)));
}
/* Computes the roots of the cubic P from its expansion about the value s0 of the first step.
 * The isolated root, which is farthest from the other two, is computed by Newton's method. The
 * other two roots of P are the solutions of a quadratic equation, and are computed without
 * cancellation. */
static void find_map_roots(map_link *k)
{
    const dd c[3] = {
        dd_mul(map_height(k, k->s), dd_square(k->climb)),
        dd_add(dd_mul(dd_add(dd_times(3.0, dd_mul(k->b, k->s)), dd_twice(k->p[2])), k->s), k->p[1]),
        dd_add(dd_times(3.0, dd_mul(k->b, k->s)), k->p[2])};
    mask top;
    const double guess = lone_root(c[2].hi, k->b.hi * c[1].hi, k->b.hi * k->b.hi * c[0].hi, &top);
    if (top) { /* also if b = 0, where P is a quadratic */
        /* Division by the isolated root V = b v3 leaves v^2 - B v - C for the other two, with C =
         * c0 / V >= 0. */
        const dd scaled[3] = {dd_mul(dd_square(k->b), c[0]), dd_mul(k->b, c[1]), c[2]};
        const dd third = newton_cubic(dd_of(1.0), scaled, guess), product = dd_div(c[0], third);
        const dd b = dd_div(dd_mul(k->b, product), third);
        const dd sum = dd_add(b, dd_div(c[1], third)),
                 span = dd_sqrt(dd_add(dd_square(sum), dd_times(4.0, product)));
        k->above = dd_half(dd_add(span, sum));
        k->below = dd_half(dd_sub(span, sum));
        if (k->above.hi > k->below.hi)
            k->below = dd_div(product, k->above);
        else if (k->below.hi > 0.0)
            k->above = dd_div(product, k->below);
        k->third = third;
    } else {
        const dd v1 = newton_cubic(k->b, c, guess / k->b.hi);
        const dd e1 = dd_add(c[2], dd_mul(k->b, v1)), e0 = dd_div(c[0], dd_neg(v1));
        const dd root = dd_sqrt(dd_sub(dd_square(e1), dd_times(4.0, dd_mul(k->b, e0))));
        const dd big = dd_half(dd_sub(root, e1)); /* b v3; the other root is v2 = e0 / (b v3) */
        k->below = dd_neg(v1);
        k->third = big;
        k->above = dd_div(e0, big);
    }
    k->s1 = dd_sub(k->s, k->below);
    k->s2 = dd_add(k->s, k->above);
}
/* Writes s and (u' - u)^2 = P(s)/(1 + b s) for the link at the phase with the given values of sn^2
 * and cn^2. To avoid cancellation, the calculation uses only the distances between s and the
 * roots. */
static void link_at_phase(const map_link *k, dd sn2, dd cn2, dd *s, dd *climb_square)
{
    const dd span = dd_add(k->below, k->above), w = dd_div(dd_mul(sn2, span), map_height(k, k->s2));
    const dd scale = dd_sub(dd_of(1.0), dd_mul(k->b, w));
    const dd up = dd_div(dd_mul(w, map_height(k, k->s1)), scale),
             down = dd_div(dd_mul(span, cn2), scale);
    const dd third = dd_add(dd_sub(k->third, dd_mul(k->b, k->above)), dd_mul(k->b, down));
    *s = dd_add(k->s1, up);
    *climb_square = dd_div(dd_mul(dd_mul(up, down), third), map_height(k, *s));
}
/* Computes the real and imaginary parts of N+ (if `sign` is 1) or of N- (if `sign` is -1). */
static void map_linear(const map_link *k, dd s, double sign, dd *re, dd *im)
{
    const dd y = dd_mul(k->x, map_height(k, s));
    *re = dd_add(y, dd_times(sign, s));
    *im = dd_sub(dd_mul(k->l, y), dd_mul(k->c, s));
}
/* Computes the distances of the extreme height u1 (sign -1) or u2 (sign 1) from the poles. 1 + sign
 * * u is a sum. 1 - sign * u is a quotient of the product (1 - sign * u)(1 - sign * u') for the
 * link that begins at the extreme height. */
static void turning_height(const map_link *k, dd sn2, dd cn2, double sign, dd *far, dd *near)
{
    dd s, square, re, im;
    link_at_phase(k, sn2, cn2, &s, &square);
    const dd other = dd_sqrt(square), y = dd_mul(k->x, map_height(k, s));
    const dd u = dd_half(dd_add(s, dd_times(sign, other))),
             v = dd_half(dd_sub(s, dd_times(sign, other)));
    map_linear(k, s, -sign, &re, &im);
    *far = dd_add(dd_of(1.0), dd_times(sign, u));
    *near = dd_div(dd_add(dd_square(re), dd_square(im)),
                   dd_twice(dd_mul(y, dd_sub(dd_of(1.0), dd_times(sign, v)))));
}
/* Returns u3 - 1, the distance of the third root u3 from the pole u = 1, computed without
 * cancellation. This distance must be small. */
static dd third_height_above_pole(const map_link *k, dd sn2, dd cn2)
{
    dd s, square, re, im;
    link_at_phase(k, sn2, cn2, &s, &square);
    const dd y = dd_mul(k->x, map_height(k, s)), climb = dd_sqrt(square);
    /* The other height of the link is farther from the pole, on either side of it. */
    const dd other = dd_half(s.hi > 2.0 ? dd_add(s, climb) : dd_sub(s, climb));
    map_linear(k, s, -1.0, &re, &im);
    return dd_div(dd_add(dd_square(re), dd_square(im)),
                  dd_twice(dd_mul(y, dd_sub(other, dd_of(1.0)))));
}
/* The squares of the elliptic functions sn, cn and dn at half the phase increment of a step. */
typedef struct half_stride {
    dd sn2, cn2, dn2;
} half_stride;

/* Computes the modulus, the periods and the phase increment eta per step from the roots of the
 * cubic. */
static half_stride set_periods(const map_link *k, map_curve *r)
{
    const dd one = dd_of(1.0), least = dd_of(1e-36);
    const dd span = dd_max(dd_add(k->below, k->above), least);
    const dd h1 = map_height(k, k->s1), h2 = map_height(k, k->s2);
    const dd h3 = dd_add(map_height(k, k->s), k->third);
    const dd b31 = dd_add(k->third, dd_mul(k->b, k->below));
    const dd b32 = dd_sub(k->third, dd_mul(k->b, k->above));
    const dd den = dd_mul(b31, h2);
    r->k2 = dd_max(dd_div(dd_mul(dd_mul(k->b, span), h3), den), least);
    r->kp2 = dd_max(dd_div(dd_mul(b32, h1), den), least);
    r->mean = elliptic_mean(dd_sqrt(r->kp2), 0, NULL, NULL);
    r->ratio = dd_div(r->mean, elliptic_mean(dd_sqrt(r->k2), 0, NULL, NULL));
    /* Here sn2, cn2 and dn2 are the squares of sn, cn and dn at eta. The squares at eta/2 follow
     * from the half-argument formulas. */
    const dd sn2 = dd_div(b31, h3), cn2 = dd_div(h1, h3), dn2 = dd_div(h1, h2);
    const dd cn = dd_sqrt(cn2), dn = dd_sqrt(dn2);
    const half_stride half = {dd_div(sn2, dd_mul(dd_add(one, cn), dd_add(one, dn))),
                              dd_div(dd_add(cn, dn), dd_add(one, dn)),
                              dd_div(dd_add(cn, dn), dd_add(one, cn))};
    r->eta = dd_mul(dd_mul(r->mean, dd_sqrt(sn2)), dd_rf(cn2, dn2, one));
    return half;
}
/* Sets the imaginary parts y1 and y2 of the arguments of alpha and beta, which are incomplete
 * elliptic integrals of the first kind. Also sets the distances 1 + u2 and 1 - u1 of the extreme
 * heights from the poles. */
static void set_arguments(const map_link *k, half_stride half, map_curve *r)
{
    const dd one = dd_of(1.0), sh = half.sn2, ch = half.cn2, dh = half.dn2;
    dd minus1, plus1, plus2, minus2;
    turning_height(k, sh, ch, -1.0, &minus1, &plus1);
    turning_height(k, dd_div(ch, dh), dd_div(dd_mul(r->kp2, sh), dh), 1.0, &plus2, &minus2);
    const dd d = dd_max(dd_sub(plus2, plus1), dd_of(1e-36));
    const double below = k->sign * dd_add(k->l, k->c).hi, above = k->sign * dd_sub(k->l, k->c).hi;
    /* If l + c = 0 or l - c = 0, a root of the curve lies at a pole. Either the axis passes exactly
     * through this pole, and the argument is 0, or the argument is at its limit, where cd = 0. */
    const int is_through_lower = below == 0.0 && plus1.hi < 1e-40,
              is_through_upper = above == 0.0 && minus2.hi < 1e-40;
    dd cd = dd_sub(dd_mul(d, dh), dd_mul(dd_mul(plus1, r->k2), sh));
    if (below == 0.0 && !is_through_lower) cd = dd_of(0.0);
    r->y1 = dd_mul(dd_mul(r->mean, dd_sqrt(plus1)),
                   dd_rf(cd, dd_add(cd, plus1), dd_add(cd, dd_mul(r->k2, plus1))));
    const dd far = dd_add(d, dd_mul(dd_mul(minus2, r->k2), sh));
    const dd rho = dd_div(dd_mul(minus2, dh), far);
    cd = dd_max(dd_sub(one, dd_div(dd_mul(rho, r->k2), r->kp2)), dd_of(0.0));
    /* If y2 is close to its limit and u3 is close to 1, the difference above suffers from
     * cancellation, and is therefore computed by another formula. */
    if (cd.hi < 1e-6) {
        const dd kc = dd_mul(r->k2, ch);
        const dd gap = third_height_above_pole(k, dd_div(dh, kc), dd_neg(dd_div(r->kp2, kc)));
        const dd nearby = dd_div(dd_mul(kc, gap), dd_mul(r->kp2, far));
        if (nearby.hi >= 0.0) cd = nearby;
    }
    if (above == 0.0 && !is_through_upper) cd = dd_of(0.0);
    r->y2 = dd_mul(dd_mul(r->mean, dd_sqrt(dd_div(rho, r->kp2))), dd_rf(cd, one, dd_add(one, rho)));
    if (below >= 0.0) r->y1 = dd_neg(r->y1);
    if (above >= 0.0) r->y2 = dd_neg(r->y2);
    if (is_through_lower) r->y1 = dd_of(0.0);
    if (is_through_upper) r->y2 = dd_of(0.0);
    r->plus2 = plus2.hi;
    r->minus1 = minus1.hi;
}
/* Returns the phase in the middle of the first step, computed from the distances between s and the
 * roots s1 and s2. */
static double start_phase(const map_link *k, const map_curve *r)
{
    const dd low = dd_mul(k->below, map_height(k, k->s2));
    const dd high = dd_mul(k->above, map_height(k, k->s1));
    const dd all = dd_add(low, high);
    const double s2 = all.hi > 0.0 ? low.hi / all.hi : 0.0;
    const double c2 = all.hi > 0.0 ? high.hi / all.hi : 1.0;
    return r->mean.hi * sqrt(s2) * elliptic_rf(c2, c2 + r->kp2.hi * s2, 1.0) *
           (k->climb.hi < 0.0 ? -1.0 : 1.0);
}
static map_curve map_curve_of(map_link *k)
{
    map_curve r;
    fill_cubic(k);
    find_map_roots(k);
    const half_stride half = set_periods(k, &r);
    set_arguments(k, half, &r);
    r.start = start_phase(k, &r);
    return r;
}
#endif
