/* Variational equations (tangents.h) of tops with dry friction, or on a support that rotates or
 * shakes (series.h), including derivatives by parameters of the support and of the friction.
 * Vectors have components along the principal axes of inertia, and the unit of time is 1 / rate
 * (taylor.h):
 *     theta' = 1/A ((AW + h) x theta + N - B W - y) + theta x W - E
 *     N' = N x W + (c x theta) x G P + k P x b - E x (AW + h)
 *          + P x (theta x K A P + K A (P x theta) + L P)
 *          + (D U) x theta - D (theta' - theta x U) - F U + f (theta x a + d) + g a
 *     theta       `turn`: the infinitesimal rotation       N  `push`: the change of the momentum
 *     c           `lever`                                  P  `vertical`     G P  `pulled`
 *     W, U, O     `velocity`, `relative`, `support`: the angular velocities of the top in the
 *                 inertial frame, of the top relative to the support, and of the support
 *     A, D, h, a  the inertia, the damping, the momentum of the rotor, and the apex (taylor.h)
 *     AW + h      `momentum`; D U `dragged`                f  `torque`: the friction torque
 *     K           `gradient`: the gravity gradient         K A P  `steep`
 *     B of A, F of D, y of h, E of O, d of a, g of f, L of K A: derivatives by the parameter
 *     k, b        with KR_TIMING_STRENGTH (method.h), k is effective gravity, b the derivative of
 *                 mass * com; otherwise, k is the derivative of effective gravity, and b mass * com
 * While friction holds the top, g is chosen such that the spin <U, a> of the perturbed motion
 * remains zero. `real` and `real_vec` are the types of numbers and vectors (math/real.h). Arrays
 * hold Taylor coefficients; the n-th one of a product is a sum over j + m = n. */

/* Taylor series of the motion of the top (the path) about the beginning of a substep (tangents.c).
 * `stiffness` is K A, `inverse_inertia` is <a / A, a>, and `q` is the attitude. */
typedef struct REAL(moving_path) {
    real_vec velocity[TERMS], relative[TERMS], support[TERMS], momentum[TERMS], dragged[TERMS],
        vertical[TERMS], pulled[TERMS], steep[TERMS];
    real cosine[TERMS], sine[TERMS]; /* of the phase of the shaking */
    real torque[TERMS];
    real_vec A, D, lever, apex, stiffness;
    real gradient, inverse_inertia, q[4];
    int has_friction, is_held;
} REAL(moving_path);
/* Taylor series of one tangent. `cross` is c x theta, `apex_change` is theta x a + d, `apex` is d,
 * and `tilted` is theta x K A P + K A (P x theta). `turn_loss` is (B W + y) / A + E. `push_loss` is
 * F U + E x (AW + h) - k P x b - P x L P and, while the top slides, minus g a. */
typedef struct REAL(moving_deviation) {
    real_vec turn[TERMS], push[TERMS], cross[TERMS], apex_change[TERMS], turn_loss[TERMS],
        push_loss[TERMS], tilted[TERMS], apex;
} REAL(moving_deviation);

static real REAL(sum_components)(real_vec a) { return r_add(r_add(a.x, a.y), a.z); }
static real REAL(inverse_of_next)(int n) { return r_div(r_of(1.0, 0.0), r_of(n + 1, 0.0)); }
static real_vec REAL(product_term)(const real a[], const real_vec b[], int n)
{
    real_vec sum = r_vdd(vdd_of(v3(0.0, 0.0, 0.0)));
    for (int m = 0; m <= n; m++) sum = VEC(add)(sum, VEC(scale)(a[m], b[n - m]));
    return sum;
}
/* Returns the n-th coefficient of a x b. The processor can compute the six sums in parallel. */
static real_vec REAL(cross)(const real_vec a[], const real_vec b[], int n)
{
    real_vec up = r_vdd(vdd_of(v3(0.0, 0.0, 0.0))), down = up;
    for (int m = 0; m <= n; m++) {
        const real_vec u = a[m], v = b[n - m];
        up.x = r_add(up.x, r_mul(u.y, v.z));
        up.y = r_add(up.y, r_mul(u.z, v.x));
        up.z = r_add(up.z, r_mul(u.x, v.y));
        down.x = r_add(down.x, r_mul(u.z, v.y));
        down.y = r_add(down.y, r_mul(u.x, v.z));
        down.z = r_add(down.z, r_mul(u.y, v.x));
    }
    return VEC(sub)(up, down);
}
/* Returns the body-frame components of `vector`, which is given in the space frame. The attitude is
 * q[0] + q[1] i + q[2] j + q[3] k, a unit quaternion. */
static real_vec REAL(rotate_to_body)(const real q[4], const double vector[3])
{
    real sum[3];
    for (int i = 0; i < 3; i++) {
        sum[i] = r_of(0.0, 0.0);
        for (int axis = 0; axis < 3; axis++) {
            const real both = r_mul(q[1 + axis], q[1 + i]),
                       turned = r_mul(q[0], q[axis == i ? 0 : 4 - axis - i]),
                       half = axis == (i + 2) % 3 ? r_sub(both, turned) : r_add(both, turned),
                       whole = r_mul(r_of(2.0, 0.0), half),
                       cosine = axis == i ? r_sub(whole, r_of(1.0, 0.0)) : whole;
            sum[i] = r_add(sum[i], r_mul(r_of(vector[axis], 0.0), cosine));
        }
    }
    return (real_vec){sum[0], sum[1], sum[2]};
}
/* Sets a[n + 1] of a vector fixed in the support's frame: a' = a x U, U = `relative`. */
static void REAL(set_next_support_vector)(real_vec a[], const real_vec relative[], int n)
{
    a[n + 1] = VEC(scale)(REAL(inverse_of_next)(n), REAL(cross)(a, relative, n));
}
/* Sets the n-th coefficients of W, U, AW + h, D U, P and K A P, given the series `path` of the top
 * and the n-th coefficient of O. `rotor` is h. */
static void REAL(read_path_coefficients)(REAL(moving_path) * p, const kr_series path[2], int n,
                                         real_vec rotor)
{
    const real_vec W = r_get(path, w[n] + 1), own = VEC(times)(p->A, W);
    p->velocity[n] = W;
    p->relative[n] = VEC(sub)(W, p->support[n]);
    p->momentum[n] = n == 0 ? VEC(add)(own, rotor) : own;
    p->dragged[n] = VEC(times)(p->D, p->relative[n]);
    p->vertical[n] = r_get(path, x[n] + 5);
    p->steep[n] = VEC(times)(p->stiffness, p->vertical[n]);
}
/* Sets the apex, inverse_inertia, and the coefficients, of orders below `order`, of the friction
 * torque f, which is constant while the top slides. While friction holds the top, lane 0 of path->w
 * contains f divided by its maximum (series.h). */
static void REAL(read_friction)(REAL(moving_path) * p, const kr_motion *motion, double rate,
                                const kr_series path[2], int order)
{
    const double friction = kr_support_friction_torque(motion, rate);
    p->apex = r_get(path, apex + 1);
    p->inverse_inertia = REAL(sum_components)(VEC(over)(VEC(times)(p->apex, p->apex), p->A));
    for (int n = 0; n < order; n++)
        p->torque[n] = p->is_held
                           ? r_mul(r_of(friction, 0.0), r_of(path[0].w[n][0], path[1].w[n][0]))
                           : r_of(0.0, 0.0);
    if (!p->is_held) p->torque[0] = r_of(-kr_support_sliding(path) * friction, 0.0);
}
/* Sets all members of p, for orders below `order`, given the Taylor series `path` of the top. */
static void REAL(read_path)(REAL(moving_path) * p, const kr_motion *motion, double rate,
                            const kr_series path[2], int order)
{
    const double low[4] = {0.0}, unit = motion->time_unit / rate;
    double turning[3];
    dd base, sway, cosine, sine;
    const int deep = motion->digits > 16;
    const quat_dd q = qdd_unit(qdd_load(path->x[0], deep ? path[1].x[0] : low));
    const vec_dd lever = kr_support_split(motion, &base, &sway);
    const real_vec rotor = r_vdd(vdd_scale_exactly(1.0 / rate, motion->body->rotor));
    const dd shaking = dd_times(unit, dd_of(motion->scene->shaking.rate));
    kr_support_phase(motion, rate, path->t, deep ? path[1].t : 0.0, &cosine, &sine);
    p->A = r_vdd(motion->body->inertia);
    p->D = r_vdd(vdd_of(v_scale(1.0 / rate, motion->damping)));
    p->lever = r_vdd(vdd_scale_exactly(1.0 / (rate * rate), lever));
    p->gradient = r_of(motion->gradient / (rate * rate), 0.0);
    p->stiffness = VEC(scale)(p->gradient, p->A);
    p->q[0] = r_dd(q.w), p->q[1] = r_dd(q.v.x), p->q[2] = r_dd(q.v.y), p->q[3] = r_dd(q.v.z);
    v_put(turning, v_scale(unit, motion->scene->turning));
    p->support[0] = REAL(rotate_to_body)(p->q, turning);
    p->cosine[0] = r_dd(cosine);
    p->sine[0] = r_dd(sine);
    p->has_friction = motion->scene->friction > 0.0;
    p->is_held = p->has_friction && path->holds != 0.0;
    if (p->has_friction) REAL(read_friction)(p, motion, rate, path, order);
    for (int n = 0; n < order; n++) {
        const real share = r_div(r_dd(shaking), r_of(n + 1, 0.0));
        REAL(read_path_coefficients)(p, path, n, rotor);
        p->pulled[n] =
            VEC(add)(VEC(scale)(r_dd(base), p->vertical[n]),
                     VEC(scale)(r_dd(sway), REAL(product_term)(p->cosine, p->vertical, n)));
        REAL(set_next_support_vector)(p->support, p->relative, n);
        p->cosine[n + 1] = r_sub(r_of(0.0, 0.0), r_mul(share, p->sine[n]));
        p->sine[n + 1] = r_mul(share, p->cosine[n]);
    }
    if (p->is_held) REAL(read_path_coefficients)(p, path, order, rotor);
}
/* Subtracts k P x b from `push_loss`. b is the member `pull` of the tangent, and k a function of
 * time with the constants `scale` (set_timing_constants). */
static void REAL(add_weight_derivative)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                                        const kr_tangent *g, const dd scale[4], int order)
{
    real k[TERMS];
    for (int n = 0; n < order; n++) {
        const real phase =
            r_add(r_mul(r_dd(scale[1]), p->cosine[n]), r_mul(r_dd(scale[2]), p->sine[n]));
        k[n] = r_add(phase, n == 0 ? r_dd(scale[0]) : r_mul(r_dd(scale[3]), p->sine[n - 1]));
        d->push_loss[n] = VEC(sub)(
            d->push_loss[n], VEC(cross)(REAL(product_term)(k, p->vertical, n), r_get(g, pull + 1)));
    }
}
/* Adds E to `turn_loss` and E x (AW + h) to `push_loss`. The variable `turned` is E in internal
 * units, and E = turned / rate in the units of the series. */
static void REAL(add_turning_derivative)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                                         const kr_tangent *g, double rate, int order)
{
    real_vec turned[TERMS];
    const real per_rate = r_of(1.0 / rate, 0.0);
    turned[0] = REAL(rotate_to_body)(p->q, g->turning_of + 1);
    /* While friction holds the top, find_spin_change requires one more coefficient. */
    for (int n = 0; n < order + p->is_held; n++) {
        const real_vec carried = REAL(cross)(turned, p->momentum, n);
        d->turn_loss[n] = VEC(add)(d->turn_loss[n], VEC(scale)(per_rate, turned[n]));
        d->push_loss[n] = VEC(add)(d->push_loss[n], VEC(scale)(per_rate, carried));
        if (n < order) REAL(set_next_support_vector)(turned, p->relative, n);
    }
}
/* Subtracts P x L P from `push_loss`. */
static void REAL(add_gradient_derivative)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                                          const kr_tangent *g, int order)
{
    real_vec change[TERMS];
    const real_vec moments = r_vdd(vdd_of(v_of(g->moments + 1))),
                   by = VEC(add)(VEC(scale)(r_of(g->gradient_of, 0.0), p->A),
                                 VEC(scale)(p->gradient, moments));
    for (int n = 0; n < order; n++) {
        change[n] = VEC(times)(by, p->vertical[n]);
        d->push_loss[n] = VEC(sub)(d->push_loss[n], REAL(cross)(p->vertical, change, n));
    }
}
/* Sets the members turn_loss, push_loss and apex of the argument `d` from the derivatives (B, F and
 * so on) by the parameter, which are members of the tangent `g` (kr_tangent, tangents.h). */
static void REAL(set_parameter_terms)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                                      const kr_motion *motion, double rate, const kr_series path[2],
                                      const kr_tangent *g, int order)
{
    const real_vec moments = r_vdd(vdd_of(v_of(g->moments + 1))),
                   drags = r_vdd(vdd_of(v_of(g->drags + 1)));
    for (int n = 0; n < order + p->is_held; n++) {
        const real_vec own = VEC(times)(moments, p->velocity[n]),
                       moved = n == 0 ? VEC(add)(own, r_get(g, rotor_of + 1)) : own;
        d->turn_loss[n] = VEC(over)(moved, p->A);
        d->push_loss[n] = VEC(times)(drags, p->relative[n]);
    }
    if (g->timing != 0.0) {
        const dd since = dd_make(path->t, motion->digits > 16 ? path[1].t : 0.0);
        dd scale[4] = {{0.0, 0.0}};
        set_timing_constants(motion, rate, since, g->timing, scale);
        REAL(add_weight_derivative)(p, d, g, scale, order);
    }
    if (v_largest(v_of(g->turning_of + 1)) > 0.0)
        REAL(add_turning_derivative)(p, d, g, rate, order);
    if (motion->gradient != 0.0 || g->gradient_of != 0.0)
        REAL(add_gradient_derivative)(p, d, g, order);
    if (!p->has_friction) return;
    const real torque = r_of(-kr_support_sliding(path) * g->friction_of, 0.0);
    d->apex = r_get(g, apex_of + 1);
    d->push_loss[0] = VEC(sub)(d->push_loss[0], VEC(scale)(torque, p->apex));
}
static real_vec REAL(find_theta_rate)(const REAL(moving_path) * p, const REAL(moving_deviation) * d,
                                      int n)
{
    const real_vec gained = VEC(add)(d->push[n], REAL(cross)(p->momentum, d->turn, n));
    return VEC(add)(VEC(sub)(VEC(over)(gained, p->A), d->turn_loss[n]),
                    REAL(cross)(d->turn, p->velocity, n));
}
static real REAL(find_spin_change)(const REAL(moving_path) * p, const REAL(moving_deviation) * d,
                                   int n)
{
    const real_vec slipped =
        VEC(sub)(REAL(find_theta_rate)(p, d, n), REAL(cross)(d->turn, p->relative, n));
    return REAL(sum_components)(
        VEC(add)(VEC(times)(p->apex, slipped), VEC(times)(d->apex, p->relative[n])));
}
/* Adds the friction terms to the (n + 1)-th coefficient of N: f (theta x a + d) and, while friction
 * holds the top, g a, where g makes the (n + 1)-th coefficient of the change of the spin zero. */
static void REAL(add_friction_change)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                                      int n)
{
    const real_vec turned = VEC(cross)(d->turn[n], p->apex);
    d->apex_change[n] = n == 0 ? VEC(add)(turned, d->apex) : turned;
    d->push[n + 1] =
        VEC(add)(d->push[n + 1], VEC(scale)(REAL(inverse_of_next)(n),
                                            REAL(product_term)(p->torque, d->apex_change, n)));
    if (!p->is_held) return;
    const real lost = r_div(REAL(find_spin_change)(p, d, n + 1), p->inverse_inertia);
    d->push[n + 1] = VEC(sub)(d->push[n + 1], VEC(scale)(lost, p->apex));
}
/* Returns the n-th coefficient of P x (theta x K A P + K A (P x theta)). */
static real_vec REAL(find_gradient_torque_by_turn)(const REAL(moving_path) * p,
                                                   REAL(moving_deviation) * d, int n)
{
    d->tilted[n] = VEC(add)(REAL(cross)(d->turn, p->steep, n),
                            VEC(times)(p->stiffness, REAL(cross)(p->vertical, d->turn, n)));
    return REAL(cross)(p->vertical, d->tilted, n);
}
static void REAL(set_next_tangent_terms)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                                         int has_gradient, int n)
{
    const real share = REAL(inverse_of_next)(n);
    d->cross[n] = VEC(cross)(p->lever, d->turn[n]);
    const real_vec rate = REAL(find_theta_rate)(p, d, n),
                   slipped = VEC(sub)(rate, REAL(cross)(d->turn, p->relative, n)),
                   pushed = VEC(sub)(REAL(cross)(d->push, p->velocity, n), d->push_loss[n]),
                   dragged = REAL(cross)(p->dragged, d->turn, n);
    real_vec pulled = REAL(cross)(d->cross, p->pulled, n);
    if (has_gradient) pulled = VEC(add)(pulled, REAL(find_gradient_torque_by_turn)(p, d, n));
    d->turn[n + 1] = VEC(scale)(share, rate);
    d->push[n + 1] = VEC(scale)(
        share, VEC(sub)(VEC(add)(pushed, pulled), VEC(sub)(VEC(times)(p->D, slipped), dragged)));
    if (p->has_friction) REAL(add_friction_change)(p, d, n);
}
/* Computes the coefficients of orders 1 to `order` of n single tangents (tangents.h). If
 * `jump_factor` is not NULL, instead subtracts jump_factor * (change of the spin) * a from N in
 * kr_tangent.end; `path` must then begin at the end of the last step. */
static void REAL(expand_or_jump_tangents)(const kr_motion *motion, double rate,
                                          const kr_series path[2], kr_tangent *first, size_t n,
                                          int order, const dd *jump_factor)
{
    REAL(moving_path) p;
    REAL(moving_deviation) d;
    REAL(read_path)(&p, motion, rate, path, order);
    for (kr_tangent *g = first; n > 0; n--, g += motion->digits > 16 ? 2 : 1) {
        REAL(set_parameter_terms)(&p, &d, motion, rate, path, g, order);
        d.turn[0] = jump_factor ? r_get(g, end + 1) : r_get(g, x[0] + 1);
        d.push[0] = jump_factor ? r_get(g, end + 5) : r_get(g, x[0] + 5);
        if (jump_factor) {
            const real change = REAL(find_spin_change)(&p, &d, 0),
                       lost = r_mul(change, r_dd(*jump_factor));
            if (r_high(change) == 0.0) continue;
            r_put(g, end + 5, VEC(sub)(d.push[0], VEC(scale)(lost, p.apex)));
            continue;
        }
        for (int k = 0; k < order; k++) {
            REAL(set_next_tangent_terms)(&p, &d, motion->gradient != 0.0, k);
            r_put(g, x[k + 1] + 1, d.turn[k + 1]);
            r_put(g, x[k + 1] + 5, d.push[k + 1]);
        }
    }
}
