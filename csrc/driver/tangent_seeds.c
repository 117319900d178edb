/* Initialization of tangents, which the integration methods propagate, and their conversion to the
 * user's frame and units. The tangent matrix has 6 rows (rotation vector, change of momentum) and
 * the columns of the groups in KR_TANGENT_LIST (kreisel.h). A seed (kr_seed, method.h) is the input
 * for one column: an initial perturbation, and derivatives of the equations by a parameter. */
#include <math.h>
#include <string.h>
#include "model/scene.h"
#include "math/su2_dd.h"
#include "top.h"

size_t kr_tangent_columns(uint64_t tangents)
{
    size_t columns = 0;
#define X(by, bit, count, name) columns += tangents & bit ? count : 0;
    KR_TANGENT_LIST(X)
#undef X
    return columns;
}
size_t kr_tangents_size(const kr_method *method, const kr_config *config)
{
    const size_t n = kr_tangent_columns(config->tangents);
    return n > 0 ? method->tangents->doubles(config->digits, n) : 0;
}

/* The seeds of all columns of the tangent matrix. `next` points to the first unused element of
 * `seeds`. time_unit and inertia_unit are the internal units, in the user's units. */
typedef struct {
    kr_seed seeds[KR_TANGENT_COLUMNS_MAX], *next;
    double time_unit, inertia_unit;
} seed_list;
/* Appends a seed filled with zeros to the list, and returns its address. */
static kr_seed *add_seed(seed_list *to)
{
    *to->next = (kr_seed){.timing = KR_TIMING_NONE};
    return to->next++;
}
static void add_start_seeds(seed_list *to, const kr_top *top)
{
    const quat_dd back = qdd_conj(kr_extended_axes(top));
    for (int i = 0; i < 6; i++) {
        kr_seed *seed = add_seed(to);
        if (i < 3)
            seed->at_start.turn = qdd_turn(back, vdd_of(v_axis(i)));
        else
            seed->at_start.push = vdd_of(v_axis(i - 3));
    }
}
static vec_dd find_com_along_internal_axes(const kr_top *top)
{
    int reach;
    fraction_of(v_largest(top->scene.body.com), &reach);
    return vdd_scale_exactly(times_power_of_2(1.0, reach - 1),
                             vdd_scale_exactly(2.0, top->body.com));
}
static vec_dd find_internal_lever(const seed_list *to, dd weight, vec_dd com)
{
    const dd own =
        dd_scale(to->time_unit, dd_scale(to->time_unit, dd_scale(1.0 / to->inertia_unit, weight)));
    return vdd_scale(own, com);
}
/* Adds and returns the seed of a parameter on which lever = mass * gravity * com depends. Arguments
 * are in the user's units. The derivative of the lever by the parameter must be weight * arm for a
 * support at rest. On a shaken support, the derivative is mass * arm times the function of time
 * `timing` (kr_timing, method.h). */
static kr_seed *add_lever_seed(seed_list *to, dd weight, double mass, vec_dd arm, kr_timing timing)
{
    kr_seed *seed = add_seed(to);
    seed->lever = find_internal_lever(to, weight, arm);
    seed->pull = find_internal_lever(to, dd_of(mass), arm);
    seed->timing = timing;
    return seed;
}
/* Adds the three seeds of the components of kr_body.com along the principal axes. Unless com is
 * zero, the direction of the apex depends on com, and kr_seed.apex is set. */
static void add_com_seeds(seed_list *to, const kr_top *top)
{
    const kr_body *body = &top->scene.body;
    const double size = v_largest(body->com);
    const dd weight = two_product(body->mass, top->scene.gravity);
    for (int i = 0; i < 3; i++) {
        const vec_dd by = vdd_of(v_axis(i));
        kr_seed *seed = add_lever_seed(to, weight, body->mass, by, KR_TIMING_STRENGTH);
        if (!(size > 0.0)) continue;
        const double unit = times_power_of_2(1.0, -exponent_of(size));
        const vec_dd com = vdd_scale_exactly(unit, find_com_along_internal_axes(top));
        const dd square = vdd_dot(com, com), along = dd_div(vdd_dot(com, by), square);
        const vec_dd across = vdd_add(by, vdd_scale(dd_neg(along), com));
        seed->apex = vdd_scale(dd_div(dd_of(unit), dd_sqrt(square)), across);
    }
}
static void add_support_seeds(seed_list *to, const kr_top *top, uint64_t flags)
{
    static const kr_timing timings[] = {KR_TIMING_AMPLITUDE, KR_TIMING_RATE, KR_TIMING_PHASE};
    if (flags & KR_TANGENT_TURNING)
        for (int i = 0; i < 3; i++) add_seed(to)->turning = v_axis(i);
    /* The shaking changes the acceleration of the support, but not the lever at rest. */
    if (flags & KR_TANGENT_SHAKING)
        for (int i = 0; i < 3; i++)
            add_lever_seed(to, dd_of(0.0), top->scene.body.mass, find_com_along_internal_axes(top),
                           timings[i]);
}
static void fill_seed_list(seed_list *to, const kr_top *top)
{
    const uint64_t by = top->config.tangents;
    const double g = top->scene.gravity, mass = top->scene.body.mass;
    to->next = to->seeds;
    to->time_unit = top->time_unit;
    to->inertia_unit = top->momentum_unit * top->time_unit;
    if (by & KR_TANGENT_START) add_start_seeds(to, top);
    for (int i = 0; i < 3 && by & KR_TANGENT_MOMENTS; i++) add_seed(to)->moments = v_axis(i);
    if (by & KR_TANGENT_COM) add_com_seeds(to, top);
    if (by & KR_TANGENT_GRAVITY)
        add_lever_seed(to, dd_of(mass), mass, find_com_along_internal_axes(top), KR_TIMING_UNIFORM);
    if (by & KR_TANGENT_MASS)
        add_lever_seed(to, dd_of(g), 1.0, find_com_along_internal_axes(top), KR_TIMING_STRENGTH);
    for (int i = 0; i < 3 && by & KR_TANGENT_DAMPING; i++) add_seed(to)->damping = v_axis(i);
    for (int i = 0; i < 3 && by & KR_TANGENT_ROTOR; i++) add_seed(to)->rotor = vdd_of(v_axis(i));
    add_support_seeds(to, top, by);
    if (by & KR_TANGENT_FRICTION) add_seed(to)->friction = 1.0;
    if (by & KR_TANGENT_GRADIENT) add_seed(to)->gradient = 1.0;
}
void kr_tangents_start(kr_top *top)
{
    seed_list to;
    fill_seed_list(&to, top);
    top->method->tangents->begin(&top->main, top->tangents,
                                 kr_tangent_columns(top->config.tangents), to.seeds);
}
kr_status kr_tangents_advance(kr_top *top)
{
    const size_t n = kr_tangent_columns(top->config.tangents);
    return n > 0 ? top->method->tangents->advance(&top->main, top->tangents, n) : KR_OK;
}

/* Writes the divisor of each column of the tangent matrix, in the order of KR_TANGENT_LIST: the
 * internal unit of its parameter in the user's units, or 1 if its seed already uses the latter. */
static void write_column_divisors(const kr_top *top, double unit[KR_TANGENT_COLUMNS_MAX])
{
    const uint64_t by = top->config.tangents;
    const double momentum = top->momentum_unit, time = top->time_unit;
    for (int i = 0; i < KR_TANGENT_COLUMNS_MAX; i++) unit[i] = 1.0;
    for (int i = 3; i < 6 && by & KR_TANGENT_START; i++) unit[i] = momentum;
    unit += kr_tangent_columns(by & KR_TANGENT_START);
    for (int i = 0; i < 3 && by & KR_TANGENT_MOMENTS; i++) *unit++ = momentum * time;
    unit += kr_tangent_columns(by & (KR_TANGENT_COM | KR_TANGENT_GRAVITY | KR_TANGENT_MASS));
    for (int i = 0; i < 3 && by & KR_TANGENT_DAMPING; i++) *unit++ = momentum;
    for (int i = 0; i < 3 && by & KR_TANGENT_ROTOR; i++) *unit++ = momentum;
    for (int i = 0; i < 3 && by & KR_TANGENT_TURNING; i++) *unit++ = 1.0 / time;
    unit += kr_tangent_columns(by & KR_TANGENT_SHAKING);
    if (by & KR_TANGENT_FRICTION) *unit++ = momentum / time;
    if (by & KR_TANGENT_GRADIENT) *unit = 1.0 / (time * time);
}
/* Writes a column of the tangent matrix of n columns in the user's frame and units: high words to
 * out[0], out[n], ..., out[5 n], low words to low[0], ..., low[5 n]. `from` is the column in
 * internal units, and `unit` is from write_column_divisors. The rotation from internal axes to the
 * frame of description is `axes` (kr_extended_axes) with more than 16 digits, else top->axes. */
static void write_tangent_column(const kr_top *top, quat_dd axes, const kr_deviation *from,
                                 double unit, size_t n, double *out, double *low)
{
    vec_dd turn = from->turn;
    if (top->is_turned && top->main.digits > 16)
        turn = qdd_turn(axes, turn);
    else if (top->is_turned)
        turn = v_dd(q_turn(top->axes, vdd_high(turn)), v3(0.0, 0.0, 0.0));
    const dd axis[6] = {turn.x, turn.y, turn.z, from->push.x, from->push.y, from->push.z};
    const double factors[2] = {1.0 / unit, top->momentum_unit / unit};
    for (size_t i = 0; i < 6; i++) {
        const dd v = dd_scale(factors[i / 3], axis[i]);
        out[i * n] = v.hi;
        low[i * n] = v.lo;
    }
}
kr_status kr_top_tangents(kr_top *top, double out[], double low[])
{
    const size_t n = top ? kr_tangent_columns(top->config.tangents) : 0;
    kr_deviation came[KR_TANGENT_COLUMNS_MAX];
    double unit[KR_TANGENT_COLUMNS_MAX], high[6 * KR_TANGENT_COLUMNS_MAX],
        rest[6 * KR_TANGENT_COLUMNS_MAX];
    kr_state state;
    if (n == 0 || !out) return KR_ERR_ARGUMENT;
    const quat_dd axes = kr_extended_axes(top);
    kr_top_evaluate(top, top->requested, &state);
    top->method->tangents->evaluate(&top->main, state.q, top->tangents, n, came);
    write_column_divisors(top, unit);
    for (size_t i = 0; i < n; i++)
        write_tangent_column(top, axes, &came[i], unit[i], n, high + i, rest + i);
    for (size_t i = 0; i < 6 * n; i++)
        if (!isfinite(high[i] + rest[i])) return KR_ERR_TANGENT;
    memcpy(out, high, 6 * n * sizeof *out);
    if (low) memcpy(low, rest, 6 * n * sizeof *low);
    return KR_OK;
}
