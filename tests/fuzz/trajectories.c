/* Calls that move a top, compare it with another one, or read its tangents. The states must not
 * depend on the calls by which the top reached them. */
#include <math.h>
#include <stdlib.h>
#include "random_values.h"
#include "claims.h"
#include "math/su2.h"
#include "tops.h"

void call_step(place *p)
{
    begin_call(p);
    print_call("step");
    const kr_status status = kr_top_step(p->top);
    const kr_state state = kr_top_state(p->top);
    if (status == KR_OK) {
        const int fixed = !(kr_method_describe(p->method).flags & KR_METHOD_ADAPTIVE);
        const double grid =
            p->scene.start.t + (double)kr_top_describe(p->top).stats.steps * p->config.step;
        CLAIM(forward(p) * (state.t - p->was.t) > 0.0);
        if (fixed) CLAIM(state.t == grid);
        p->landed = fixed;
    }
    end_call(p, status);
}
void call_advance(place *p)
{
    const double t = any_time(p);
    begin_call(p);
    print_call("advance to %a", t);
    const kr_status status = kr_top_advance(p->top, t);
    const kr_state state = kr_top_state(p->top);
    if (status == KR_OK) {
        CLAIM(state.t == t);
        p->landed = 1;
    } else if (isfinite(t) && state.t != p->was.t)
        CLAIM(forward(p) * (state.t - t) <= 0.0);
    end_call(p, status);
}

enum { MANY = 24 };
static void claim_recorded(place *p, kr_status status, size_t n, size_t done, const double t[],
                           const kr_state out[], const kr_state low[])
{
    const kr_state state = kr_top_state(p->top);
    CLAIM(done <= n && (status == KR_OK) == (done == n));
    for (size_t i = 0; i < done; i++) CLAIM(is_good(out[i]) && out[i].t == t[i]);
    for (size_t i = 0; low && i < done; i++) CLAIM(low[i].t == 0.0);
    CLAIM(is_marked(out + done, (MANY - done) * sizeof *out));
    if (low) CLAIM(is_marked(low + done, (MANY - done) * sizeof *low));
    if (done > 0 && status == KR_OK) CLAIM(same_bits(&state, &out[n - 1], sizeof state));
    if (done == 0 || status == KR_OK) return;
    if (error_category(status) == INPUT || state.t == out[done - 1].t)
        CLAIM(same_bits(&state, &out[done - 1], sizeof state));
    else
        CLAIM(forward(p) * (state.t - out[done - 1].t) > 0.0);
    p->was = out[done - 1]; /* the last time was refused, or its call failed after this state */
    p->imaged = 0;
}
void call_record(place *p)
{
    double t[MANY];
    kr_state out[MANY], low[MANY], before = kr_top_state(p->top);
    size_t done = 99;
    const size_t n = (size_t)choose(odds(10) ? 2 : MANY);
    const int with_low = (int)choose(2), sorted = odds(80);
    for (size_t i = 0; i < n; i++) {
        const double on = forward(p) * fabs(any_time(p) - before.t) * 0.1;
        t[i] = sorted && isfinite(on) ? (i ? t[i - 1] : before.t) + on : any_time(p);
    }
    fill_with_mark(out, sizeof out);
    fill_with_mark(low, sizeof low);
    begin_call(p);
    print_call("record%s %zu times", with_low ? " low" : "", n);
    for (size_t i = 0; i < n; i++) print_detail("time %a", t[i]);
    const kr_status status = kr_top_record(p->top, n, t, out, with_low ? low : NULL, &done);
    print_detail("%zu done", done);
    claim_recorded(p, status, n, done, t, out, with_low ? low : NULL);
    if (done > 0) p->landed = 1;
    end_call(p, status);
}

void call_compare(place *p)
{
    const kr_state state = kr_top_state(p->top), low = kr_top_describe(p->top).low;
    if (!p->landed || kr_top_describe(p->top).stats.steps > longest()) return;
    print_call("compare with a top that goes there at once");
    /* Tangents may shorten the steps of a damped top. */
    const int damped = v_largest(p->scene.damping) > 0.0;
    const uint64_t tangents = odds(50) && !damped ? 0 : p->config.tangents;
    kr_top *other = make_alike(p, tangents);
    const kr_status status = kr_top_advance(other, state.t);
    CLAIM(status == KR_OK || (tangents && status == KR_ERR_TANGENT));
    if (status != KR_OK) return;
    const kr_state its = kr_top_state(other), its_low = kr_top_describe(other).low;
    print_detail("it: t %a, q %a %a %a %a, m %a %a %a", its.t, its.q.w, its.q.x, its.q.y, its.q.z,
                 its.m.x, its.m.y, its.m.z);
    CLAIM(same_bits(&state, &its, sizeof state));
    CLAIM(same_bits(&low, &its_low, sizeof low));
}

enum { NUMBERS = 6 * KR_TANGENT_COLUMNS_MAX };
/* Claims that at the start the derivative with respect to the start is the unit matrix. */
static void claim_units(const double out[], size_t columns)
{
    for (size_t i = 0; i < 6; i++)
        for (size_t k = 0; k < 6; k++)
            CLAIM(fabs(out[i * columns + k] - (i == k ? 1.0 : 0.0)) < 1e-14);
}
void call_tangents(place *p)
{
    double out[NUMBERS], low[NUMBERS], again[NUMBERS];
    const size_t columns = kr_tangent_columns(p->config.tangents), n = 6 * columns;
    const int into_nothing = odds(3), with_low = (int)choose(2);
    fill_with_mark(out, sizeof out);
    fill_with_mark(low, sizeof low);
    begin_call(p);
    print_call("tangents%s", into_nothing ? " into nothing" : with_low ? " low" : "");
    const kr_status status =
        kr_top_tangents(p->top, into_nothing ? NULL : out, with_low ? low : NULL);
    const kr_state state = kr_top_state(p->top);
    const int known = n > 0 && !into_nothing;
    CLAIM(known ? status == KR_OK || status == KR_ERR_TANGENT : status == KR_ERR_ARGUMENT);
    CLAIM(same_bits(&state, &p->was, sizeof state));
    if (status != KR_OK) {
        CLAIM(is_marked(out, sizeof out) && is_marked(low, sizeof low));
    } else {
        CLAIM(is_marked(out + n, (NUMBERS - n) * sizeof *out));
        for (size_t i = 0; i < n; i++) CLAIM(isfinite(out[i]) && (!with_low || isfinite(low[i])));
        CLAIM(kr_top_tangents(p->top, again, NULL) == KR_OK);
        CLAIM(same_bits(out, again, n * sizeof *out));
        CLAIM(kr_top_describe(p->top).truncation >= 0.0);
        const int is_start = p->landed && kr_top_describe(p->top).stats.steps == 0;
        /* Friction that holds a top at the start takes the derivative of its spin away. */
        if (is_start && p->config.tangents & KR_TANGENT_START && !(p->scene.friction > 0.0))
            claim_units(out, columns);
    }
    end_call(p, status);
}
