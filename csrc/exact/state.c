/* One state of a plan. Floor 3. */
#include "kernel.h"

static int is_hyperbolic(const kr_exact *e) { return e->curve == HYPERBOLIC_COSINE || e->curve == HYPERBOLIC_EVEN; }
static int is_even(const kr_exact *e) { return e->curve == CIRCULAR_EVEN || e->curve == HYPERBOLIC_EVEN; }

kr_state kr_exact_after(const kr_exact *e, dd span)
{
    kr_state r;
    switch (e->curve) {
    case CIRCULAR_COSINE: r = kernel(e, 0, 0, span); break;
    case CIRCULAR_EVEN: r = kernel(e, 0, 1, span); break;
    case HYPERBOLIC_COSINE: r = kernel(e, 1, 0, span); break;
    default: r = kernel(e, 1, 1, span); break;
    }
    if (e->framed) r.q = q_mul(q_mul(e->left, r.q), e->right);
    return r;
}
kr_state kr_exact_state(const kr_exact *e, double t)
{
    kr_state r = kr_exact_after(e, two_sum(t, -e->begin));
    r.t = t;
    return r;
}
void kr_exact_factors(const kr_exact *e, double span, double out[6])
{
    const factors f = theta_factors(e, is_hyperbolic(e), is_even(e), dd_of(span));
    const dd both = dd_add(f.first, f.second);
    double s, c;
    sincos_turns(f.first, &s, &c);
    out[0] = f.a_re * c - f.a_im * s, out[1] = f.a_re * s + f.a_im * c;
    sincos_turns(f.second, &s, &c);
    out[2] = f.b_re * c - f.b_im * s, out[3] = f.b_re * s + f.b_im * c;
    sincos_turns(dd_make(both.hi - nearest(both.hi), both.lo), &s, &c);
    out[4] = f.h_re * c - f.h_im * s, out[5] = f.h_re * s + f.h_im * c;
}
