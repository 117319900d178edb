/* Conversion between the user's frame and units and the internal axes and units (method.h), for
 * more than 16 digits, in double-double arithmetic (sums of a high and a low word). For up to 16
 * digits, run.c converts. Input values are treated as exact. Quaternions are normalized. If a body
 * was given by an inertia tensor J (kr_body.given), the rotation q from its principal axes to the
 * frame of description (kreisel.h) is rounded to doubles (kr_body.axes). The tensor along the
 * rounded axes, R^T J R with the matrix R of q, is then diagonal only up to rounding errors. Its
 * elements off the diagonal are computed without cancellation, and Jacobi's method finds the
 * rotation `rest` that removes them. The product q rest rotates vectors from the internal axes to
 * the frame of description. The rotation `rest` is small unless two moments are nearly equal. */
#include "model/scene.h"
#include "math/split_double.h"
#include "top.h"

/* Elements of the inertia tensor off the diagonal count as zero up to this value, in internal
 * units. They turn the axes by at most 2^-100 if the moments differ by at least 2^-100. */
#define LEAST_ELEMENT 0x1p-200
/* Jacobi's method converges quadratically from elements that are rounding errors. */
enum { TENSOR_SWEEPS = 6 };

quat_dd kr_extended_axes(const kr_top *top)
{
    const quat_dd axes = qdd_unit(qdd_of(top->scene.body.axes));
    return top->is_turned ? qdd_mul(axes, top->body.rest) : qdd_of(q_one());
}
/* Returns q* v q for a unit quaternion q. For a small rotation angle, the error of component v_i is
 * relative to |v_i| + angle * |v|. The error of qdd_turn (math/su2_dd.h) is relative to |v|. */
static vec_dd turn_back_accurately(quat_dd q, vec_dd v)
{
    const vec_dd across = vdd_scale_exactly(2.0, vdd_cross(v, q.v));
    return vdd_add(v, vdd_add(vdd_scale(q.w, across), vdd_cross(across, q.v)));
}
/* Returns how much (q a)* m (q a) changes if `low` is added to q and m of `start`. Here, a is
 * kr_body.axes if top->is_turned, else 1. Since q and a are not normalized, (q a)* m (q a) is the
 * momentum along the principal axes, multiplied by |q a|^2. */
static vec_dd find_scaled_momentum_change(const kr_top *top, const kr_state *start,
                                          const kr_state *low)
{
    const kr_vec3 none = {0.0, 0.0, 0.0};
    const quat_dd q = q_dd(start->q, low->q), high = qdd_of(start->q), rest = qdd_of(low->q),
                  m = {dd_of(0.0), v_dd(start->m, low->m)},
                  m_rest = {dd_of(0.0), v_dd(low->m, none)};
    const quat_dd left = qdd_mul(qdd_mul(qdd_conj(q), m), rest),
                  change = qdd_add(qdd_mul(qdd_conj(rest), m), qdd_mul(qdd_conj(high), m_rest)),
                  sum = qdd_add(left, qdd_mul(change, high));
    const quat_dd axes = qdd_of(top->scene.body.axes);
    return top->is_turned ? qdd_mul(qdd_mul(qdd_conj(axes), sum), axes).v : sum.v;
}
/* Returns the momentum of the state start + low, along the internal axes. If `low` is NULL (zero),
 * the relative error of each component is about one rounding error of double-double arithmetic. A
 * thin rod needs this accuracy: dividing the momentum by its small moment amplifies errors. */
static vec_dd find_internal_momentum(const kr_top *top, const kr_state *start, const kr_state *low)
{
    const kr_quat axes = top->scene.body.axes;
    const split_vec in_space = split_from_vector(start->m),
                    given = split_turn_back_times_norm2(start->q, &in_space),
                    own = top->is_turned ? split_turn_back_times_norm2(axes, &given) : given;
    dd square = qdd_square(low ? q_dd(start->q, low->q) : qdd_of(start->q));
    if (top->is_turned) square = dd_mul(square, qdd_square(qdd_of(axes)));
    vec_dd M = {split_dd(&own, 0), split_dd(&own, 1), split_dd(&own, 2)};
    if (low) M = vdd_add(M, find_scaled_momentum_change(top, start, low));
    M = (vec_dd){dd_div(M.x, square), dd_div(M.y, square), dd_div(M.z, square)};
    return top->is_turned ? turn_back_accurately(top->body.rest, M) : M;
}
/* Returns the components along the internal axes of a vector v in the frame of description. */
static vec_dd rotate_to_internal_axes(const kr_top *top, kr_vec3 v)
{
    const kr_state unturned = {0.0, q_one(), v};
    return find_internal_momentum(top, &unturned, NULL);
}

/* Returns 1 if the tensor, com and rotor in body->given result in the numbers of `body`, else 0. */
static int is_made_from_given(const kr_body *body)
{
    const kr_given *given = &body->given;
    kr_body made;
    if (kr_body_from_tensor(body->mass, given->inertia, given->com, body->rounded, &made) != KR_OK)
        return 0;
    kr_body_set_rotor(&made, given->rotor);
    return memcmp(&made, body, sizeof made) == 0;
}
/* Writes to `a` the matrix R^T J R / inertia_unit minus the diagonal matrix of `moments`. R is
 * |q|^2 times the rotation matrix of q = body->axes, and J is the inertia tensor in body->given. */
static void find_diagonalization_residual(const kr_body *body, double inertia_unit,
                                          const double moments[3], dd a[3][3])
{
    split_vec rows[3], turned[3];
    for (int i = 0; i < 3; i++)
        rows[i] = split_from_vector(v_scale(1.0 / inertia_unit, v_of(body->given.inertia + 3 * i)));
    for (int side = 0; side < 2; side++) {
        for (int i = 0; i < 3; i++) turned[i] = split_turn_back_times_norm2(body->axes, &rows[i]);
        for (int i = 0; i < 3; i++) {
            rows[i].count = SPLIT_MAX;
            for (int k = 0; k < SPLIT_MAX; k++)
                for (int j = 0; j < 3; j++) rows[i].part[k][j] = turned[j].part[k][i];
        }
    }
    for (int i = 0; i < 3; i++) rows[i].part[0][i] -= moments[i]; /* exact, as both nearly agree */
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            a[i][j] = dd_half(dd_add(split_dd(&rows[i], j), split_dd(&rows[j], i)));
}
/* Applies to the symmetric matrix a + diag(moments) the Jacobi rotation that annihilates its
 * element (p, p + 1), with indices modulo 3. Updates `a` and the product `rest` of all rotations.
 * Storing `moments` apart from `a` keeps the digits of small moments and of their differences. */
static void apply_jacobi_rotation_dd(const double moments[3], dd a[3][3], quat_dd *rest, int p)
{
    const int q = (p + 1) % 3, r = (p + 2) % 3;
    const dd apq = a[p][q], apr = a[p][r], aqr = a[q][r], one = dd_of(1.0), none = dd_of(0.0);
    if (!(fabs(apq.hi) > LEAST_ELEMENT)) return;
    const dd apart = dd_add(two_sum(moments[q], -moments[p]), dd_sub(a[q][q], a[p][p])),
             theta = dd_div(apart, dd_twice(apq)), root = dd_sqrt(dd_add(dd_square(theta), one)),
             t = dd_div(one, theta.hi < 0.0 ? dd_sub(theta, root) : dd_add(theta, root)),
             c = dd_div(one, dd_sqrt(dd_add(dd_square(t), one))), s = dd_mul(t, c);
    dd half[3] = {none, none, none};
    half[r] = dd_neg(s);
    *rest = qdd_unit(qdd_mul(*rest, (quat_dd){dd_add(one, c), {half[0], half[1], half[2]}}));
    a[p][p] = dd_sub(a[p][p], dd_mul(t, apq));
    a[q][q] = dd_add(a[q][q], dd_mul(t, apq));
    a[p][q] = a[q][p] = none;
    a[p][r] = a[r][p] = dd_sub(dd_mul(c, apr), dd_mul(s, aqr));
    a[q][r] = a[r][q] = dd_add(dd_mul(s, apr), dd_mul(c, aqr));
}
/* Corrects the rounded principal axes and moments of a body that was given by a tensor. The
 * correction of two axes with equal moments is arbitrary (it depends on rounding errors only). It
 * is omitted if results depend on these axes: with tangents, or with unequal damping along them. */
static void refine_principal_axes(kr_top *top, double inertia_unit)
{
    const kr_body *given = &top->scene.body;
    body_dd *body = &top->body;
    double moments[3], D[3];
    dd a[3][3];
    v_put(moments, top->main.inertia);
    v_put(D, top->main.damping);
    find_diagonalization_residual(given, inertia_unit, moments, a);
    for (int sweep = 0; sweep < TENSOR_SWEEPS; sweep++)
        for (int p = 0; p < 3; p++) {
            const int q = (p + 1) % 3, is_kept = D[p] != D[q] || top->config.tangents;
            if (moments[p] != moments[q] || !is_kept)
                apply_jacobi_rotation_dd(moments, a, &body->rest, p);
        }
    const dd square = qdd_square(qdd_of(given->axes)),
             per_norm = dd_div(dd_of(1.0), dd_square(square));
    const dd x = a[0][0], y = a[1][1], z = a[2][2];
    const vec_dd diagonal = {x, y, z}, apart = {dd_sub(y, z), dd_sub(z, x), dd_sub(x, y)};
    body->inertia = vdd_scale(per_norm, vdd_add(body->inertia, diagonal));
    body->differences = vdd_scale(per_norm, vdd_add(body->differences, apart));
    top->main.inertia = vdd_high(body->inertia);
    top->is_turned = 1;
    top->axes = qdd_high(kr_extended_axes(top));
}
static void set_body(kr_top *top, double inertia_unit)
{
    const kr_body *body = &top->scene.body;
    const kr_pull pull = kr_scene_pull(&top->scene, body->com);
    const int power = pull.power - ilogb(inertia_unit) + 2 * ilogb(top->time_unit);
    const dd product = two_product(pull.gravity, pull.mass),
             weight = dd_make(ldexp(product.hi, power), ldexp(product.lo, power));
    top->body = make_body_dd(&top->main, pull.com);
    if (is_made_from_given(body)) {
        const kr_pull given = kr_scene_pull(&top->scene, body->given.com);
        refine_principal_axes(top, inertia_unit);
        top->body.com = vdd_scale_exactly(ldexp(1.0, given.power - pull.power),
                                          rotate_to_internal_axes(top, given.com));
        if (kr_body_has_rotor(body))
            top->body.rotor =
                rotate_to_internal_axes(top, v_scale(1.0 / top->momentum_unit, body->given.rotor));
        top->main.rotor = vdd_high(top->body.rotor);
    }
    top->body.lever = vdd_scale(weight, top->body.com);
    top->main.lever = vdd_high(top->body.lever);
}
static kr_state state_from_user(kr_top *top, const kr_state *start, const kr_state *low)
{
    const quat_dd given = low ? q_dd(start->q, low->q) : qdd_of(start->q),
                  q = qdd_unit(top->is_turned ? qdd_mul(given, kr_extended_axes(top)) : given);
    const double unit = 1.0 / top->momentum_unit;
    kr_state scaled = *start, rest = {0};
    scaled.m = v_scale(unit, start->m);
    if (low) rest = (kr_state){0.0, low->q, v_scale(unit, low->m)};
    const vec_dd M = find_internal_momentum(top, &scaled, low ? &rest : NULL);
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

const kr_extended_ops kr_extended = {set_body, state_from_user, state_to_user};
