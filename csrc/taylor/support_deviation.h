/* Variational equations of tops with dry friction, or on a support that rotates or shakes
 * (series.h), with derivatives with respect to the motion of the support and to the friction. All
 * vectors are along the internal axes:
 *     theta' = 1/A ((AW + h) x theta + N - B W - y) + theta x W - E
 *     N' = N x W + (c x theta) x G P + k P x b - E x (AW + h)
 *          + P x (theta x K A P + K A (P x theta) + (K A)' P)
 *          + (D U) x theta - D (theta' - theta x U) - F U + f (theta x a + d) + g a
 *     theta       `turn`: the infinitesimal rotation       N  `push`: the change of the momentum
 *     c           `lever`                                  P  `vertical`     G P  `pulled`
 *     W, U, O     `velocity`, `relative`, `support`: the angular velocities of the top in the
 *                 inertial frame, of the top relative to the support, and of the support
 *     AW + h      `momentum`; D U `dragged`                f  `torque`: the friction torque
 *     y, E, d, g  the derivatives of the rotor, of O, of the apex a and of f by the parameter
 *     k, b        the acceleration and the lever per unit of acceleration; the parameter decides
 *                 which of the two is replaced by its derivative
 *     K           `gradient`: the gravity gradient; K A P `steep`, (K A)' the parameter's change
 * While friction holds the top, g is chosen such that the spin <U, a> of the perturbed motion
 * remains zero. All numbers are of the type `real` (math/real.h). */

/* Taylor coefficients of a vector with three components. */
typedef struct REAL(series) {
    real c[3][KR_TAYLOR_MAX + 1];
} REAL(series);
/* Taylor series of the motion of the top (the path), expanded about the beginning of a substep.
 * `inverse_inertia` is <a / A, a>, about the apex. */
typedef struct REAL(moving_path) {
    REAL(series) velocity, relative, support, momentum, dragged, vertical, pulled, steep;
    real gradient;
    int has_gradient;
    real cosine[KR_TAYLOR_MAX + 1], sine[KR_TAYLOR_MAX + 1];
    real torque[KR_TAYLOR_MAX + 1];
    real A[3], D[3], lever[3], apex[3], inverse_inertia;
    real q[4];
    int has_friction, is_held;
} REAL(moving_path);
/* Taylor series of one tangent, with `cross`, c x theta, and `apex_change`, theta x a + d.
 * `turn_by` and `push_by` are the inhomogeneous terms of theta' and N'. */
typedef struct REAL(moving_deviation) {
    REAL(series) turn, push, cross, apex_change, turn_by, push_by, tilted;
    real apex[3];
} REAL(moving_deviation);

typedef struct REAL(vector) {
    real c[3];
} REAL(vector);

/* Returns the n-th coefficient of the cross product of two series. The six sums are independent, so
 * the processor can compute them in parallel. */
static REAL(vector) REAL(cross)(const REAL(series) * a, const REAL(series) * b, int n)
{
    const real zero = r_of(0.0, 0.0);
    real up[3] = {zero, zero, zero}, down[3] = {zero, zero, zero};
    for (int m = 0; m <= n; m++) {
        const real x = a->c[0][m], y = a->c[1][m], z = a->c[2][m], u = b->c[0][n - m],
                   v = b->c[1][n - m], w = b->c[2][n - m];
        up[0] = r_add(up[0], r_mul(y, w));
        up[1] = r_add(up[1], r_mul(z, u));
        up[2] = r_add(up[2], r_mul(x, v));
        down[0] = r_add(down[0], r_mul(z, v));
        down[1] = r_add(down[1], r_mul(x, w));
        down[2] = r_add(down[2], r_mul(y, u));
    }
    return (REAL(vector)){{r_sub(up[0], down[0]), r_sub(up[1], down[1]), r_sub(up[2], down[2])}};
}
/* Returns the i-th body-frame component of the space-fixed unit vector with index `axis`. */
static real REAL(body_component)(const real q[4], int axis, int i)
{
    const int same = axis == i, third = 3 - axis - i;
    const real two = r_of(2.0, 0.0), both = r_mul(q[1 + axis], q[1 + i]);
    if (same) {
        const real w = r_mul(q[0], q[0]), own = r_mul(q[1 + i], q[1 + i]);
        return r_sub(r_mul(two, r_add(w, own)), r_of(1.0, 0.0));
    }
    const real turned = r_mul(q[0], q[1 + third]);
    return r_mul(two, (i + 1) % 3 == axis ? r_add(both, turned) : r_sub(both, turned));
}
/* Writes the body-frame components, of order 0, of a vector along e1, e2, e3. */
static void REAL(rotate_to_body)(REAL(series) * a, const real q[4], const double vector[3])
{
    for (int i = 0; i < 3; i++) {
        a->c[i][0] = r_of(0.0, 0.0);
        for (int axis = 0; axis < 3; axis++)
            a->c[i][0] =
                r_add(a->c[i][0], r_mul(r_of(vector[axis], 0.0), REAL(body_component)(q, axis, i)));
    }
}
/* Computes the next coefficients of the body-frame components of a space-fixed vector. */
static void REAL(next_space_vector)(REAL(series) * a, const REAL(series) * relative, int n)
{
    const real share = r_div(r_of(1.0, 0.0), r_of(n + 1, 0.0));
    const REAL(vector) rate = REAL(cross)(a, relative, n);
    for (int i = 0; i < 3; i++) a->c[i][n + 1] = r_mul(share, rate.c[i]);
}
/* Computes the n-th coefficients of the angular velocities and of the angular momentum. */
static void REAL(set_velocity)(REAL(moving_path) * p, const kr_series path[2], int n,
                               const real h[3])
{
    for (int i = 0; i < 3; i++) {
        const real w = r_of(path[0].w[n][1 + i], path[1].w[n][1 + i]), own = r_mul(p->A[i], w),
                   u = r_sub(w, p->support.c[i][n]);
        p->velocity.c[i][n] = w;
        p->relative.c[i][n] = u;
        p->momentum.c[i][n] = n == 0 ? r_add(own, h[i]) : own;
        p->dragged.c[i][n] = r_mul(p->D[i], u);
        p->vertical.c[i][n] = r_of(path[0].x[n][5 + i], path[1].x[n][5 + i]);
        p->steep.c[i][n] = r_mul(r_mul(p->gradient, p->A[i]), p->vertical.c[i][n]);
    }
}
/* Computes the n-th coefficient of the effective gravity vector G P. */
static void REAL(pull_vertical)(REAL(moving_path) * p, real base, real sway, int n)
{
    for (int i = 0; i < 3; i++) {
        real sum = r_of(0.0, 0.0);
        for (int j = 0; j <= n; j++) sum = r_add(sum, r_mul(p->cosine[j], p->vertical.c[i][n - j]));
        p->pulled.c[i][n] = r_add(r_mul(base, p->vertical.c[i][n]), r_mul(sway, sum));
    }
}
/* Sets the friction torque, which is constant while the top slides. While friction holds the top,
 * the friction torque is stored in lane 0 of W (see series.h). */
static void REAL(read_friction)(REAL(moving_path) * p, const kr_series path[2],
                                const support_data *data, int order)
{
    const real friction = r_of(data->friction, 0.0);
    p->has_friction = data->friction > 0.0;
    p->is_held = data->holds;
    p->inverse_inertia = r_of(0.0, 0.0);
    for (int i = 0; i < 3; i++) {
        p->apex[i] = r_of(data->apex[i].hi, data->apex[i].lo);
        p->inverse_inertia = r_add(p->inverse_inertia, r_div(r_mul(p->apex[i], p->apex[i]),
                                                             r_of(data->A[i].hi, data->A[i].lo)));
    }
    for (int n = 0; n < order; n++)
        p->torque[n] =
            p->is_held ? r_mul(friction, r_of(path[0].w[n][0], path[1].w[n][0])) : r_of(0.0, 0.0);
    if (!p->is_held) p->torque[0] = r_of(-data->sliding * data->friction, 0.0);
}
/* Computes the Taylor series of the path and of the support motion. */
static void REAL(read_path)(REAL(moving_path) * p, const kr_series path[2],
                            const support_data *data, int order)
{
    const real rate = r_of(data->rate.hi, data->rate.lo), base = r_of(data->base.hi, data->base.lo),
               sway = r_of(data->sway.hi, data->sway.lo);
    real h[3];
    p->gradient = r_of(data->gradient, 0.0);
    p->has_gradient = data->gradient != 0.0;
    for (int i = 0; i < 3; i++) {
        p->A[i] = r_of(data->A[i].hi, data->A[i].lo);
        p->D[i] = r_of(data->D[i], 0.0);
        p->lever[i] = r_of(data->lever[i].hi, data->lever[i].lo);
        h[i] = r_of(data->h[i].hi, data->h[i].lo);
    }
    for (int i = 0; i < 4; i++) p->q[i] = r_of(data->q[i].hi, data->q[i].lo);
    REAL(rotate_to_body)(&p->support, p->q, data->turning);
    p->cosine[0] = r_of(data->cosine.hi, data->cosine.lo);
    p->sine[0] = r_of(data->sine.hi, data->sine.lo);
    REAL(read_friction)(p, path, data, order);
    for (int n = 0; n < order; n++) {
        const real share = r_div(rate, r_of(n + 1, 0.0));
        REAL(set_velocity)(p, path, n, h);
        REAL(pull_vertical)(p, base, sway, n);
        REAL(next_space_vector)(&p->support, &p->relative, n);
        p->cosine[n + 1] = r_sub(r_of(0.0, 0.0), r_mul(share, p->sine[n]));
        p->sine[n + 1] = r_mul(share, p->cosine[n]);
    }
    if (p->is_held) REAL(set_velocity)(p, path, order, h);
}
/* Adds the n-th coefficient of k P x b, with
 *     k = scale[0] + scale[1] cosine + scale[2] sine + scale[3] t sine */
static void REAL(add_pull)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                           const support_drive *drive, int n)
{
    real k[KR_TAYLOR_MAX + 1], b[3], scale[4], sum[3];
    for (int i = 0; i < 4; i++) scale[i] = r_of(drive->scale[i].hi, drive->scale[i].lo);
    for (int i = 0; i < 3; i++) b[i] = r_of(drive->pull[i].hi, drive->pull[i].lo);
    for (int j = 0; j <= n; j++) {
        k[j] = r_add(r_mul(scale[1], p->cosine[j]), r_mul(scale[2], p->sine[j]));
        if (j == 0)
            k[j] = r_add(k[j], scale[0]);
        else
            k[j] = r_add(k[j], r_mul(scale[3], p->sine[j - 1]));
    }
    for (int i = 0; i < 3; i++) {
        sum[i] = r_of(0.0, 0.0);
        for (int j = 0; j <= n; j++) sum[i] = r_add(sum[i], r_mul(k[j], p->vertical.c[i][n - j]));
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, m = (i + 2) % 3;
        d->push_by.c[i][n] =
            r_add(d->push_by.c[i][n], r_sub(r_mul(sum[j], b[m]), r_mul(sum[m], b[j])));
    }
}
/* Subtracts the terms of the derivative of the support's angular velocity. */
static void REAL(subtract_turning)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                                   const support_drive *drive, int order)
{
    REAL(series) turned;
    const real per_rate = r_of(drive->per_rate, 0.0);
    REAL(rotate_to_body)(&turned, p->q, drive->turning);
    /* While friction holds the top, spin_change requires one more coefficient. */
    for (int n = 0; n < order + p->is_held; n++) {
        const REAL(vector) carried = REAL(cross)(&turned, &p->momentum, n);
        for (int i = 0; i < 3; i++) {
            d->turn_by.c[i][n] = r_sub(d->turn_by.c[i][n], r_mul(per_rate, turned.c[i][n]));
            d->push_by.c[i][n] = r_sub(d->push_by.c[i][n], r_mul(per_rate, carried.c[i]));
        }
        if (n < order) REAL(next_space_vector)(&turned, &p->relative, n);
    }
}
/* Adds the terms due to changes of the gravity gradient, or of the moments in it. */
static void REAL(add_gradient)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                               const support_drive *drive, int order)
{
    REAL(series) change;
    for (int n = 0; n < order; n++) {
        for (int i = 0; i < 3; i++) {
            const real by = r_add(r_mul(r_of(drive->gradient, 0.0), p->A[i]),
                                  r_mul(p->gradient, r_of(drive->moments[i], 0.0)));
            change.c[i][n] = r_mul(by, p->vertical.c[i][n]);
        }
        const REAL(vector) torque = REAL(cross)(&p->vertical, &change, n);
        for (int i = 0; i < 3; i++) d->push_by.c[i][n] = r_add(d->push_by.c[i][n], torque.c[i]);
    }
}
/* Computes the inhomogeneous terms of the variational equations. */
static void REAL(set_parameter_terms)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                                      const support_drive *drive, int order)
{
    const double *turning = drive->turning;
    for (int n = 0; n < order + p->is_held; n++) {
        for (int i = 0; i < 3; i++) {
            real moved = r_mul(r_of(drive->moments[i], 0.0), p->velocity.c[i][n]);
            const real dragged = r_mul(r_of(drive->drags[i], 0.0), p->relative.c[i][n]);
            if (n == 0) moved = r_add(moved, r_of(drive->rotor[i].hi, drive->rotor[i].lo));
            d->turn_by.c[i][n] = r_div(r_sub(r_of(0.0, 0.0), moved), p->A[i]);
            d->push_by.c[i][n] = r_sub(r_of(0.0, 0.0), dragged);
        }
        if (drive->has_pull && n < order) REAL(add_pull)(p, d, drive, n);
    }
    if (turning[0] != 0.0 || turning[1] != 0.0 || turning[2] != 0.0)
        REAL(subtract_turning)(p, d, drive, order);
    if (p->has_gradient || drive->gradient != 0.0) REAL(add_gradient)(p, d, drive, order);
}
/* Sets the derivative of the apex by a parameter, and adds that of sliding friction to N'. */
static void REAL(set_friction_drive)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                                     const support_drive *drive)
{
    for (int i = 0; i < 3; i++) {
        d->apex[i] = r_of(drive->apex[i].hi, drive->apex[i].lo);
        d->push_by.c[i][0] = r_add(d->push_by.c[i][0], r_mul(r_of(drive->torque, 0.0), p->apex[i]));
    }
}
/* Returns the n-th coefficient of the time derivative of the rotation vector theta. */
static REAL(vector)
    REAL(turn_rate)(const REAL(moving_path) * p, const REAL(moving_deviation) * d, int n)
{
    const REAL(vector) gained = REAL(cross)(&p->momentum, &d->turn, n),
                       turned = REAL(cross)(&d->turn, &p->velocity, n);
    REAL(vector) rate;
    for (int i = 0; i < 3; i++) {
        const real own = r_div(r_add(d->push.c[i][n], gained.c[i]), p->A[i]);
        rate.c[i] = r_add(r_add(own, d->turn_by.c[i][n]), turned.c[i]);
    }
    return rate;
}
/* Returns the n-th coefficient of the perturbation of the spin <U, a>. */
static real REAL(spin_change)(const REAL(moving_path) * p, const REAL(moving_deviation) * d, int n)
{
    const REAL(vector) rate = REAL(turn_rate)(p, d, n),
                       turned = REAL(cross)(&d->turn, &p->relative, n);
    real sum = r_of(0.0, 0.0);
    for (int i = 0; i < 3; i++) {
        const real slipped = r_sub(rate.c[i], turned.c[i]);
        sum = r_add(sum, r_add(r_mul(p->apex[i], slipped), r_mul(d->apex[i], p->relative.c[i][n])));
    }
    return sum;
}
/* Adds the effect of friction to the (n + 1)-th coefficient of the momentum part N of a tangent. */
static void REAL(add_friction)(const REAL(moving_path) * p, REAL(moving_deviation) * d, int n)
{
    const real share = r_div(r_of(1.0, 0.0), r_of(n + 1, 0.0));
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        real sum = r_sub(r_mul(d->turn.c[j][n], p->apex[k]), r_mul(d->turn.c[k][n], p->apex[j]));
        d->apex_change.c[i][n] = n == 0 ? r_add(sum, d->apex[i]) : sum;
        sum = r_mul(p->torque[0], d->apex_change.c[i][n]);
        for (int m = 1; m <= n && p->is_held; m++)
            sum = r_add(sum, r_mul(p->torque[m], d->apex_change.c[i][n - m]));
        d->push.c[i][n + 1] = r_add(d->push.c[i][n + 1], r_mul(share, sum));
    }
    if (!p->is_held) return;
    const real lost = r_div(REAL(spin_change)(p, d, n + 1), p->inverse_inertia);
    for (int i = 0; i < 3; i++)
        d->push.c[i][n + 1] = r_sub(d->push.c[i][n + 1], r_mul(lost, p->apex[i]));
}
/* Returns the n-th coefficient of the change of the gravity gradient's torque due to the turn. */
static REAL(vector)
    REAL(gradient_change)(const REAL(moving_path) * p, REAL(moving_deviation) * d, int n)
{
    const REAL(vector) tipped = REAL(cross)(&d->turn, &p->steep, n),
                       moved = REAL(cross)(&p->vertical, &d->turn, n);
    for (int i = 0; i < 3; i++)
        d->tilted.c[i][n] = r_add(tipped.c[i], r_mul(r_mul(p->gradient, p->A[i]), moved.c[i]));
    return REAL(cross)(&p->vertical, &d->tilted, n);
}
static void REAL(next_deviation)(const REAL(moving_path) * p, REAL(moving_deviation) * d, int n)
{
    const real share = r_div(r_of(1.0, 0.0), r_of(n + 1, 0.0));
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        d->cross.c[i][n] =
            r_sub(r_mul(p->lever[j], d->turn.c[k][n]), r_mul(p->lever[k], d->turn.c[j][n]));
    }
    const REAL(vector) rate = REAL(turn_rate)(p, d, n),
                       turned = REAL(cross)(&d->turn, &p->relative, n),
                       pushed = REAL(cross)(&d->push, &p->velocity, n),
                       pulled = REAL(cross)(&d->cross, &p->pulled, n),
                       dragged = REAL(cross)(&p->dragged, &d->turn, n);
    REAL(vector) pulls = pulled;
    if (p->has_gradient) {
        const REAL(vector) by_gradient = REAL(gradient_change)(p, d, n);
        for (int i = 0; i < 3; i++) pulls.c[i] = r_add(pulls.c[i], by_gradient.c[i]);
    }
    for (int i = 0; i < 3; i++) {
        const real slipped = r_sub(rate.c[i], turned.c[i]),
                   force = r_add(r_add(pushed.c[i], d->push_by.c[i][n]), pulls.c[i]),
                   drag = r_sub(r_mul(p->D[i], slipped), dragged.c[i]);
        d->turn.c[i][n + 1] = r_mul(share, rate.c[i]);
        d->push.c[i][n + 1] = r_mul(share, r_sub(force, drag));
    }
    if (p->has_friction) REAL(add_friction)(p, d, n);
}
/* Initializes the Taylor series of a tangent and its inhomogeneous terms. */
static void REAL(begin_deviation)(const REAL(moving_path) * p, REAL(moving_deviation) * d,
                                  const support_drive *drive, const kr_tangent *g,
                                  const double *high, int order)
{
    /* The low words are those of the next kr_tangent. Doubles have none. */
    const double *low = (const double *)(const void *)((const char *)high + sizeof *g);
    (void)low;
    for (int i = 0; i < 3; i++) {
        d->turn.c[i][0] = r_of(high[1 + i], low[1 + i]);
        d->push.c[i][0] = r_of(high[5 + i], low[5 + i]);
        d->apex[i] = r_of(0.0, 0.0);
    }
    REAL(set_parameter_terms)(p, d, drive, order);
    if (p->has_friction) REAL(set_friction_drive)(p, d, drive);
}
/* Subtracts factor * (derivative of the spin) * a from N at the end of the step. */
static void REAL(jump)(const REAL(moving_path) * p, const support_drive *drive, kr_tangent *g,
                       dd factor)
{
    REAL(moving_deviation) d;
    REAL(begin_deviation)(p, &d, drive, g, g->end, 1);
    const real change = REAL(spin_change)(p, &d, 0),
               lost = r_mul(change, r_of(factor.hi, factor.lo));
    if (r_high(change) == 0.0) return;
    for (int i = 0; i < 3; i++) {
        const real rest = r_sub(d.push.c[i][0], r_mul(lost, p->apex[i]));
        r_put(g, end[5 + i], rest);
    }
}
/* Computes all Taylor coefficients of a tangent from those of order 0. */
static void REAL(expand_deviation)(const REAL(moving_path) * p, const support_drive *drive,
                                   kr_tangent *g, int order)
{
    REAL(moving_deviation) d;
    REAL(begin_deviation)(p, &d, drive, g, g->x[0], order);
    for (int n = 0; n < order; n++) {
        REAL(next_deviation)(p, &d, n);
        for (int i = 0; i < 3; i++) {
            r_put(g, x[n + 1][1 + i], d.turn.c[i][n + 1]);
            r_put(g, x[n + 1][5 + i], d.push.c[i][n + 1]);
        }
    }
}
/* Expands n tangents or, if `factor` is not NULL, changes their momentum part. */
static void REAL(change_tangents)(const kr_motion *motion, double rate, const kr_series path[2],
                                  kr_tangent *first, size_t n, int order, const dd *factor)
{
    const support_data data = read_support(motion, rate, path);
    const size_t words = motion->digits > 16 ? 2 : 1;
    REAL(moving_path) p;
    REAL(read_path)(&p, path, &data, order);
    for (size_t i = 0; i < n; i++) {
        kr_tangent *g = first + words * i;
        const support_drive drive = read_drive(motion, rate, path, g);
        if (factor)
            REAL(jump)(&p, &drive, g, *factor);
        else
            REAL(expand_deviation)(&p, &drive, g, order);
    }
}
