/* Unit conversion for computations in extended precision (more than 16 digits). Computations with
 * up to 16 digits use the conversion in run.c. Input values are treated as exact. Quaternions are
 * normalized in double-double arithmetic. The inertia tensor need not be rotated, because the
 * methods use the principal axes. */
#include "model/scene.h"
#include "math/split_double.h"
#include "top.h"

quat_dd kr_extended_axes(const kr_top *top)
{
    return top->is_turned ? qdd_unit(qdd_of(top->axes)) : qdd_of(q_one());
}
/* Returns the contribution of the digits of q and m beyond double precision to q* m q. The norm of
 * q is arbitrary. */
static vec_dd change_by_low_words(const kr_top *top, const kr_state *start, const kr_state *low)
{
    const kr_vec3 none = {0.0, 0.0, 0.0};
    const quat_dd q = q_dd(start->q, low->q), high = qdd_of(start->q), rest = qdd_of(low->q),
                  m = {dd_of(0.0), v_dd(start->m, low->m)},
                  m_rest = {dd_of(0.0), v_dd(low->m, none)};
    const quat_dd left = qdd_mul(qdd_mul(qdd_conj(q), m), rest),
                  change = qdd_add(qdd_mul(qdd_conj(rest), m), qdd_mul(qdd_conj(high), m_rest)),
                  sum = qdd_add(left, qdd_mul(change, high));
    const quat_dd axes = qdd_of(top->axes);
    return top->is_turned ? qdd_mul(qdd_mul(qdd_conj(axes), sum), axes).v : sum.v;
}
/* Returns the body-frame components of the momentum. If `low` is NULL, the relative error of each
 * component is about one rounding error of double-double arithmetic. Errors that are small only
 * relative to the norm would be amplified by the small moment of inertia of a thin rod. */
static vec_dd momentum_in_body(const kr_top *top, const kr_state *start, const kr_state *low)
{
    const split_vec in_space = split_vec_of(start->m), given = split_turn_back(start->q, &in_space),
                    own = top->is_turned ? split_turn_back(top->axes, &given) : given;
    dd square = qdd_square(low ? q_dd(start->q, low->q) : qdd_of(start->q));
    if (top->is_turned) square = dd_mul(square, qdd_square(qdd_of(top->axes)));
    vec_dd M = {split_dd(&own, 0), split_dd(&own, 1), split_dd(&own, 2)};
    if (low) M = vdd_add(M, change_by_low_words(top, start, low));
    return (vec_dd){dd_div(M.x, square), dd_div(M.y, square), dd_div(M.z, square)};
}

static void set_lever(kr_top *top, double moment)
{
    const kr_pull pull = kr_scene_pull(&top->scene, top->scene.body.com);
    const int power = pull.power - ilogb(moment) + 2 * ilogb(top->time_unit);
    const dd given = two_product(pull.gravity, pull.mass),
             weight = dd_make(ldexp(given.hi, power), ldexp(given.lo, power));
    const dd lever[3] = {dd_times(pull.com.x, weight), dd_times(pull.com.y, weight),
                         dd_times(pull.com.z, weight)};
    top->main.lever = v3(lever[0].hi, lever[1].hi, lever[2].hi);
    top->main.lever_low = v3(lever[0].lo, lever[1].lo, lever[2].lo);
}
static kr_state state_from_user(kr_top *top, const kr_state *start, const kr_state *low)
{
    const quat_dd given = low ? q_dd(start->q, low->q) : qdd_of(start->q),
                  q = qdd_unit(top->is_turned ? qdd_mul(given, kr_extended_axes(top)) : given);
    const double unit = 1.0 / top->momentum_unit;
    kr_state scaled = *start, rest = {0};
    scaled.m = v_scale(unit, start->m);
    if (low) rest = (kr_state){0.0, low->q, v_scale(unit, low->m)};
    const vec_dd M = momentum_in_body(top, &scaled, low ? &rest : NULL);
    const kr_state own_low = {0.0, qdd_low(q), vdd_low(M)};
    const kr_state own = {0.0, qdd_high(q), vdd_high(M)};
    top->main.low = own_low;
    return own;
}
static void state_to_user(kr_top *top, kr_state *state)
{
    const kr_state *low = &top->main.low;
    const quat_dd own = q_dd(state->q, low->q),
                  q = top->is_turned ? qdd_mul(own, qdd_conj(kr_extended_axes(top))) : own;
    state->q = qdd_high(q);
    state->m = v_scale(top->momentum_unit, state->m);
    top->low.t = 0.0;
    top->low.q = qdd_low(q);
    top->low.m = v_scale(top->momentum_unit, low->m);
}

const kr_extended_ops kr_extended = {set_lever, state_from_user, state_to_user};
