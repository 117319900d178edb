/* Functions shared by all parts of the Taylor method: the table of instruction sets, and functions
 * that set the constants of a Taylor series and that end a step. The symbols are those of taylor.h.
 * An array s[2] holds the high and the low words of a series in double-double numbers. */
#include <string.h>
#include "support_setup.h"
#include "taylor.h"

#define KERNELS(name, isa)                                                                         \
    {name,                                                                                         \
     kr_has_##isa,                                                                                 \
     kr_kernel_##isa,                                                                              \
     kr_headless_##isa,                                                                            \
     FOR_DIGITS(kr_kernel_dd_##isa),                                                               \
     FOR_TANGENTS(&kr_tangents_##isa),                                                             \
     FOR_DIGITS(FOR_TANGENTS(&kr_tangents_dd_##isa)),                                              \
     kr_product_##isa}
const kr_isa *kr_taylor_isa(int i)
{
    static const kr_isa isas[] = {
#ifdef KR_WITH_AVX512
        KERNELS("avx512", avx512),
#endif
#ifdef KR_WITH_AVX2
        KERNELS("avx2", avx2),
#endif
        KERNELS(KR_BASE_NAME, base),
    };
    return i < (int)(sizeof isas / sizeof *isas) ? &isas[i] : NULL;
}

static int is_in_table(const kr_kernel *kernels, int n, const kr_kernel *wanted)
{
    while (n > 0 && &kernels[n - 1] != wanted) n--;
    return n > 0;
}
const kr_isa *kr_taylor_isa_of(const kr_motion *motion)
{
    const kr_kernel *k = motion->aux;
    const kr_isa *isa = kr_taylor_isa(0);
    for (int i = 1; isa; isa = kr_taylor_isa(i++))
        if (is_in_table(isa->plain, KR_ORDERS, k) || is_in_table(isa->headless, KR_ORDERS, k) ||
            FOR_DIGITS(is_in_table(isa->deep, KR_DEPTHS, k)))
            break;
    return isa;
}

/* Sets s->shift, the terms of the rotor (taylor.h), for the unit of time 1 / rate. Those of
 * axis i = 1, 2, 3 are divided by s->k[i], which is 0 if the moments of inertia of the other two
 * axes are equal. If these terms exist, sets s->k[i] to KR_LEAST_FACTOR if |s->k[i]| is smaller. */
static void set_rotor_terms(kr_series s[2], const kr_motion *motion, double rate)
{
    const vec_dd moments = motion->body->inertia,
                 rotor = vdd_scale_exactly(1.0 / rate, motion->body->rotor);
    const dd A[3] = {moments.x, moments.y, moments.z}, h[3] = {rotor.x, rotor.y, rotor.z};
    for (int lane = 0; lane < 8; lane++) s[0].shift[lane] = s[1].shift[lane] = -0.0;
    for (int i = 0; i < 3; i++) {
        const dd own[2] = {dd_neg(h[(i + 2) % 3]), h[(i + 1) % 3]};
        dd k = dd_make(s[0].k[i + 1], s[1].k[i + 1]);
        if (own[0].hi == 0.0 && own[1].hi == 0.0) continue;
        if (!(fabs(k.hi) >= KR_LEAST_FACTOR)) k = dd_of(KR_LEAST_FACTOR);
        store_both_words(&s->k[i + 1], k);
        for (int j = 0; j < 2; j++)
            if (own[j].hi != 0.0)
                store_both_words(&s->shift[i + 1 + 4 * j], dd_div(dd_div(own[j], A[i]), k));
    }
}
/* Sets the members `gradient` and `steep`, given s->k. */
static void set_gravity_gradient_terms(kr_series s[2], double gradient)
{
    s[0].gradient = s[1].gradient = gradient;
    for (int i = 1; i < 4; i++)
        store_both_words(&s->steep[i], dd_times(-gradient, dd_make(s[0].k[i], s[1].k[i])));
}
void kr_taylor_set_constants(kr_series s[2], const kr_motion *motion, double rate,
                             const struct kr_support_ops *supports)
{
    const vec_dd A = motion->body->inertia;
    const vec_dd lever = supports ? supports->set_constants(s, motion, rate) : motion->body->lever,
                 c = vdd_scale_exactly(1.0 / (rate * rate), lever);
    const vec_dd up = {c.z, c.x, c.y}, down = {dd_neg(c.y), dd_neg(c.z), dd_neg(c.x)};
    set_vector_words(s[0].k, s[1].k, vdd_over(motion->body->differences, A));
    set_vector_words(s[0].up, s[1].up, vdd_over(up, A));
    set_vector_words(s[0].down, s[1].down, vdd_over(down, A));
    const kr_vec3 drag = v_scale(-1.0 / rate, motion->damping);
    set_vector_words(s[0].drag, s[1].drag, vdd_over(vdd_of(drag), A));
    s[0].linear = v_largest(drag) > 0.0 ? 1.0 : 0.0;
    set_gravity_gradient_terms(s, motion->gradient / (rate * rate));
    set_rotor_terms(s, motion, rate);
    if (supports) s[0].linear = 2.0;
    const double rates =
        v_largest(vdd_high(vdd_over(up, A))) + v_largest(vdd_high(vdd_over(down, A)));
    s[0].fall = s[1].fall = rates > 0.0 ? 1.0 / sqrt(rates) : INFINITY;
    if (supports) supports->limit_steps(s, motion, rate);
}
static void rescale_step_end(kr_series s[2], double factor)
{
    for (int i = 0; i < 2; i++) {
        s[i].t *= factor;
        s[i].end *= factor;
        for (int k = 0; k < 4; k++) {
            s[i].end_w[k] /= factor;
            s[i].rub[k] /= factor * factor;
        }
    }
}
void kr_taylor_set_rate(kr_taylor *p, const kr_motion *motion, double rate,
                        const struct kr_support_ops *supports)
{
    if (rate == p->rate || p->has_tangents != 0.0) return;
    rescale_step_end(p->series, rate / p->rate);
    p->rate = rate;
    kr_taylor_set_constants(p->series, motion, rate, supports);
    if (supports) supports->place(p->series, motion, rate);
}
void kr_taylor_end_at(kr_series s[2], const kr_kernel *kernel)
{
    kernel->evaluate(s);
    for (int i = 0; i < 2; i++) {
        memcpy(s[i].end_x, s[i].at_x, sizeof s->end_x);
        memcpy(s[i].end_w, s[i].at_w, sizeof s->end_w);
        s[i].end = s[i].at;
    }
}
kr_vec3 kr_taylor_acceleration(const kr_series *s)
{
    const int moves = s->linear > 1.0;
    const kr_vec3 W = v_of(s->end_w + 1), P = v_of(s->end_x + 5),
                  U = moves ? v_sub(W, v_of(s->turn + 1)) : W;
    const double G = moves && s->shakes != 0.0 ? s->sway[3] + s->sway[0] : 1.0;
    double sum[3];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double w[3] = {W.x, W.y, W.z}, p[3] = {P.x, P.y, P.z}, u[3] = {U.x, U.y, U.z};
        sum[i] = s->k[i + 1] * w[j] * w[k] + G * (s->up[i + 1] * p[j] + s->down[i + 1] * p[k]) +
                 s->drag[i + 1] * u[i] + s->steep[i + 1] * p[j] * p[k] +
                 s->k[i + 1] * (s->shift[i + 1] * w[j] + s->shift[i + 5] * w[k]);
    }
    return v_of(sum);
}
