/* Variational equations of tops with dry friction, or on a support that rotates or shakes
 * (series.h), with derivatives with respect to the motion of the support and to the friction. All
 * vectors are along the internal axes:
 *     theta' = 1/A ((AW + h) x theta + N - B W - y) + theta x W - E
 *     N' = N x W + (c x theta) x G P + k P x b - E x (AW + h)
 *          + (D U) x theta - D (theta' - theta x U) - F U + f (theta x a + d) + g a
 *     theta       `turn`: the infinitesimal rotation       N  `push`: the change of the momentum
 *     c           `lever`                                  P  `vertical`     G P  `pulled`
 *     W, U, O     `velocity`, `relative`, `support`: the angular velocities of the top in the
 *                 inertial frame, of the top relative to the support, and of the support
 *     AW + h      `momentum`; D U `dragged`                f  `torque`: the friction torque
 *     y, E, d, g  the derivatives of the rotor, of O, of the apex a and of f by the parameter
 *     k, b        the acceleration and the lever per unit of acceleration; the parameter decides
 *                 which of the two is replaced by its derivative
 * While friction holds the top, g is chosen such that the spin <U, a> of the perturbed motion
 * remains zero. support_tangents.c includes this file once for doubles and once for double-doubles,
 * and defines `number`, its arithmetic (`of`, `add`, `minus`, `mul`, `over`, HIGH), WORD(x), which
 * is x or, for doubles, nothing, SET, and LOCAL, which forms the names. */

/* Taylor coefficients of a vector with three components. */
typedef struct LOCAL(series) {
    number c[3][KR_TAYLOR_MAX + 1];
} LOCAL(series);
/* Taylor series of the motion of the top (the path), expanded about the beginning of a substep.
 * `inverse_inertia` is <a / A, a>, about the apex. */
typedef struct LOCAL(moving_path) {
    LOCAL(series) velocity, relative, support, momentum, dragged, vertical, pulled;
    number cosine[KR_TAYLOR_MAX + 1], sine[KR_TAYLOR_MAX + 1];
    number torque[KR_TAYLOR_MAX + 1];
    number A[3], D[3], lever[3], apex[3], inverse_inertia;
    number q[4];
    int has_friction, is_held;
} LOCAL(moving_path);
/* Taylor series of one tangent, with `cross`, c x theta, and `apex_change`, theta x a + d.
 * `turn_by` and `push_by` are the inhomogeneous terms of theta' and N'. */
typedef struct LOCAL(moving_deviation) {
    LOCAL(series) turn, push, cross, apex_change, turn_by, push_by;
    number apex[3];
} LOCAL(moving_deviation);

typedef struct LOCAL(vector) {
    number c[3];
} LOCAL(vector);

/* Returns the n-th coefficient of the cross product of two series. The six sums are independent, so
 * the processor can compute them in parallel. */
static LOCAL(vector) LOCAL(cross)(const LOCAL(series) * a, const LOCAL(series) * b, int n)
{
    const number zero = of(0.0, 0.0);
    number up[3] = {zero, zero, zero}, down[3] = {zero, zero, zero};
    for (int m = 0; m <= n; m++) {
        const number x = a->c[0][m], y = a->c[1][m], z = a->c[2][m], u = b->c[0][n - m],
                     v = b->c[1][n - m], w = b->c[2][n - m];
        up[0] = add(up[0], mul(y, w));
        up[1] = add(up[1], mul(z, u));
        up[2] = add(up[2], mul(x, v));
        down[0] = add(down[0], mul(z, v));
        down[1] = add(down[1], mul(x, w));
        down[2] = add(down[2], mul(y, u));
    }
    const LOCAL(vector)
        product = {{minus(up[0], down[0]), minus(up[1], down[1]), minus(up[2], down[2])}};
    return product;
}
/* Returns the i-th body-frame component of the space-fixed unit vector with index `axis`. */
static number LOCAL(seen_axis)(const number q[4], int axis, int i)
{
    const int same = axis == i, third = 3 - axis - i;
    const number two = of(2.0, 0.0), both = mul(q[1 + axis], q[1 + i]);
    if (same) {
        const number w = mul(q[0], q[0]), own = mul(q[1 + i], q[1 + i]);
        return minus(mul(two, add(w, own)), of(1.0, 0.0));
    }
    const number turned = mul(q[0], q[1 + third]);
    return mul(two, (i + 1) % 3 == axis ? add(both, turned) : minus(both, turned));
}
/* Writes the body-frame components, of order 0, of a vector along e1, e2, e3. */
static void LOCAL(see_vector)(LOCAL(series) * a, const number q[4], const double vector[3])
{
    for (int i = 0; i < 3; i++) {
        a->c[i][0] = of(0.0, 0.0);
        for (int axis = 0; axis < 3; axis++)
            a->c[i][0] = add(a->c[i][0], mul(of(vector[axis], 0.0), LOCAL(seen_axis)(q, axis, i)));
    }
}
/* Computes the next coefficients of the body-frame components of a space-fixed vector. */
static void LOCAL(turn_series)(LOCAL(series) * a, const LOCAL(series) * relative, int n)
{
    const number share = over(of(1.0, 0.0), of(n + 1, 0.0));
    const LOCAL(vector) rate = LOCAL(cross)(a, relative, n);
    for (int i = 0; i < 3; i++) a->c[i][n + 1] = mul(share, rate.c[i]);
}
/* Computes the n-th coefficients of the angular velocities and of the angular momentum. */
static void LOCAL(set_velocity)(LOCAL(moving_path) * p, const kr_series path[2], int n,
                                const number h[3])
{
    for (int i = 0; i < 3; i++) {
        const number w = of(path[0].w[n][1 + i], WORD(path[1].w[n][1 + i])), own = mul(p->A[i], w),
                     u = minus(w, p->support.c[i][n]);
        p->velocity.c[i][n] = w;
        p->relative.c[i][n] = u;
        p->momentum.c[i][n] = n == 0 ? add(own, h[i]) : own;
        p->dragged.c[i][n] = mul(p->D[i], u);
        p->vertical.c[i][n] = of(path[0].x[n][5 + i], WORD(path[1].x[n][5 + i]));
    }
}
/* Computes the n-th coefficient of the effective gravity vector G P. */
static void LOCAL(pull_vertical)(LOCAL(moving_path) * p, number base, number sway, int n)
{
    for (int i = 0; i < 3; i++) {
        number sum = of(0.0, 0.0);
        for (int j = 0; j <= n; j++) sum = add(sum, mul(p->cosine[j], p->vertical.c[i][n - j]));
        p->pulled.c[i][n] = add(mul(base, p->vertical.c[i][n]), mul(sway, sum));
    }
}
/* Sets the friction torque, which is constant while the top slides. While friction holds the top,
 * the friction torque is stored in lane 0 of W (see series.h). */
static void LOCAL(read_friction)(LOCAL(moving_path) * p, const kr_series path[2],
                                 const support_data *data, int order)
{
    const number friction = of(data->friction, 0.0);
    p->has_friction = data->friction > 0.0;
    p->is_held = data->holds;
    p->inverse_inertia = of(0.0, 0.0);
    for (int i = 0; i < 3; i++) {
        p->apex[i] = of(data->apex[i].hi, data->apex[i].lo);
        p->inverse_inertia =
            add(p->inverse_inertia, over(mul(p->apex[i], p->apex[i]), of(data->A[i], 0.0)));
    }
    for (int n = 0; n < order; n++)
        p->torque[n] =
            p->is_held ? mul(friction, of(path[0].w[n][0], WORD(path[1].w[n][0]))) : of(0.0, 0.0);
    if (!p->is_held) p->torque[0] = of(-data->sliding * data->friction, 0.0);
}
/* Computes the Taylor series of the path and of the support motion. */
static void LOCAL(read_path)(LOCAL(moving_path) * p, const kr_series path[2],
                             const support_data *data, int order)
{
    const number rate = of(data->rate.hi, data->rate.lo), base = of(data->base.hi, data->base.lo),
                 sway = of(data->sway.hi, data->sway.lo);
    number h[3];
    for (int i = 0; i < 3; i++) {
        p->A[i] = of(data->A[i], 0.0);
        p->D[i] = of(data->D[i], 0.0);
        p->lever[i] = of(data->lever[i].hi, data->lever[i].lo);
        h[i] = of(data->h[i], 0.0);
    }
    for (int i = 0; i < 4; i++) p->q[i] = of(data->q[i].hi, data->q[i].lo);
    LOCAL(see_vector)(&p->support, p->q, data->turning);
    p->cosine[0] = of(data->cosine.hi, data->cosine.lo);
    p->sine[0] = of(data->sine.hi, data->sine.lo);
    LOCAL(read_friction)(p, path, data, order);
    for (int n = 0; n < order; n++) {
        const number share = over(rate, of(n + 1, 0.0));
        LOCAL(set_velocity)(p, path, n, h);
        LOCAL(pull_vertical)(p, base, sway, n);
        LOCAL(turn_series)(&p->support, &p->relative, n);
        p->cosine[n + 1] = minus(of(0.0, 0.0), mul(share, p->sine[n]));
        p->sine[n + 1] = mul(share, p->cosine[n]);
    }
    if (p->is_held) LOCAL(set_velocity)(p, path, order, h);
}
/* Adds the n-th coefficient of k P x b, with
 *     k = scale[0] + scale[1] cosine + scale[2] sine + scale[3] t sine */
static void LOCAL(add_pull)(const LOCAL(moving_path) * p, LOCAL(moving_deviation) * d,
                            const support_drive *drive, int n)
{
    number k[KR_TAYLOR_MAX + 1], b[3], scale[4], sum[3];
    for (int i = 0; i < 4; i++) scale[i] = of(drive->scale[i].hi, drive->scale[i].lo);
    for (int i = 0; i < 3; i++) b[i] = of(drive->pull[i].hi, drive->pull[i].lo);
    for (int j = 0; j <= n; j++) {
        k[j] = add(mul(scale[1], p->cosine[j]), mul(scale[2], p->sine[j]));
        if (j == 0)
            k[j] = add(k[j], scale[0]);
        else
            k[j] = add(k[j], mul(scale[3], p->sine[j - 1]));
    }
    for (int i = 0; i < 3; i++) {
        sum[i] = of(0.0, 0.0);
        for (int j = 0; j <= n; j++) sum[i] = add(sum[i], mul(k[j], p->vertical.c[i][n - j]));
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, m = (i + 2) % 3;
        d->push_by.c[i][n] = add(d->push_by.c[i][n], minus(mul(sum[j], b[m]), mul(sum[m], b[j])));
    }
}
/* Subtracts the terms due to the derivative of the support's angular velocity from the variational
 * equations. */
static void LOCAL(subtract_turning)(const LOCAL(moving_path) * p, LOCAL(moving_deviation) * d,
                                    const support_drive *drive, int order)
{
    LOCAL(series) turned;
    const number per_rate = of(drive->per_rate, 0.0);
    LOCAL(see_vector)(&turned, p->q, drive->turning);
    /* While friction holds the top, spin_change requires one more coefficient. */
    for (int n = 0; n < order + p->is_held; n++) {
        const LOCAL(vector) carried = LOCAL(cross)(&turned, &p->momentum, n);
        for (int i = 0; i < 3; i++) {
            d->turn_by.c[i][n] = minus(d->turn_by.c[i][n], mul(per_rate, turned.c[i][n]));
            d->push_by.c[i][n] = minus(d->push_by.c[i][n], mul(per_rate, carried.c[i]));
        }
        if (n < order) LOCAL(turn_series)(&turned, &p->relative, n);
    }
}
/* Computes the inhomogeneous terms of the variational equations. */
static void LOCAL(set_drive)(const LOCAL(moving_path) * p, LOCAL(moving_deviation) * d,
                             const support_drive *drive, int order)
{
    const double *turning = drive->turning;
    for (int n = 0; n < order + p->is_held; n++) {
        for (int i = 0; i < 3; i++) {
            number moved = mul(of(drive->moments[i], 0.0), p->velocity.c[i][n]);
            const number dragged = mul(of(drive->drags[i], 0.0), p->relative.c[i][n]);
            if (n == 0) moved = add(moved, of(drive->rotor[i].hi, drive->rotor[i].lo));
            d->turn_by.c[i][n] = over(minus(of(0.0, 0.0), moved), p->A[i]);
            d->push_by.c[i][n] = minus(of(0.0, 0.0), dragged);
        }
        if (drive->has_pull && n < order) LOCAL(add_pull)(p, d, drive, n);
    }
    if (turning[0] != 0.0 || turning[1] != 0.0 || turning[2] != 0.0)
        LOCAL(subtract_turning)(p, d, drive, order);
}
/* Sets the derivative of the apex with respect to a parameter, and adds that of the sliding
 * friction torque to N'. */
static void LOCAL(set_friction_drive)(const LOCAL(moving_path) * p, LOCAL(moving_deviation) * d,
                                      const support_drive *drive)
{
    for (int i = 0; i < 3; i++) {
        d->apex[i] = of(drive->apex[i].hi, drive->apex[i].lo);
        d->push_by.c[i][0] = add(d->push_by.c[i][0], mul(of(drive->torque, 0.0), p->apex[i]));
    }
}
/* Returns the n-th coefficient of the time derivative of the rotation vector theta. */
static LOCAL(vector)
    LOCAL(turn_rate)(const LOCAL(moving_path) * p, const LOCAL(moving_deviation) * d, int n)
{
    const LOCAL(vector) gained = LOCAL(cross)(&p->momentum, &d->turn, n),
                        turned = LOCAL(cross)(&d->turn, &p->velocity, n);
    LOCAL(vector) rate;
    for (int i = 0; i < 3; i++) {
        const number own = over(add(d->push.c[i][n], gained.c[i]), p->A[i]);
        rate.c[i] = add(add(own, d->turn_by.c[i][n]), turned.c[i]);
    }
    return rate;
}
/* Returns the n-th coefficient of the perturbation of the spin <U, a>. */
static number LOCAL(spin_change)(const LOCAL(moving_path) * p, const LOCAL(moving_deviation) * d,
                                 int n)
{
    const LOCAL(vector) rate = LOCAL(turn_rate)(p, d, n),
                        turned = LOCAL(cross)(&d->turn, &p->relative, n);
    number sum = of(0.0, 0.0);
    for (int i = 0; i < 3; i++) {
        const number slipped = minus(rate.c[i], turned.c[i]);
        sum = add(sum, add(mul(p->apex[i], slipped), mul(d->apex[i], p->relative.c[i][n])));
    }
    return sum;
}
/* Adds the effect of friction to the (n + 1)-th coefficient of the momentum part N of a tangent. */
static void LOCAL(add_friction)(const LOCAL(moving_path) * p, LOCAL(moving_deviation) * d, int n)
{
    const number share = over(of(1.0, 0.0), of(n + 1, 0.0));
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        number sum = minus(mul(d->turn.c[j][n], p->apex[k]), mul(d->turn.c[k][n], p->apex[j]));
        d->apex_change.c[i][n] = n == 0 ? add(sum, d->apex[i]) : sum;
        sum = mul(p->torque[0], d->apex_change.c[i][n]);
        for (int m = 1; m <= n && p->is_held; m++)
            sum = add(sum, mul(p->torque[m], d->apex_change.c[i][n - m]));
        d->push.c[i][n + 1] = add(d->push.c[i][n + 1], mul(share, sum));
    }
    if (!p->is_held) return;
    const number lost = over(LOCAL(spin_change)(p, d, n + 1), p->inverse_inertia);
    for (int i = 0; i < 3; i++)
        d->push.c[i][n + 1] = minus(d->push.c[i][n + 1], mul(lost, p->apex[i]));
}
/* Computes the Taylor coefficients of order n + 1 of a tangent. */
static void LOCAL(next_deviation)(const LOCAL(moving_path) * p, LOCAL(moving_deviation) * d, int n)
{
    const number share = over(of(1.0, 0.0), of(n + 1, 0.0));
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        d->cross.c[i][n] =
            minus(mul(p->lever[j], d->turn.c[k][n]), mul(p->lever[k], d->turn.c[j][n]));
    }
    const LOCAL(vector) rate = LOCAL(turn_rate)(p, d, n),
                        turned = LOCAL(cross)(&d->turn, &p->relative, n),
                        pushed = LOCAL(cross)(&d->push, &p->velocity, n),
                        pulled = LOCAL(cross)(&d->cross, &p->pulled, n),
                        dragged = LOCAL(cross)(&p->dragged, &d->turn, n);
    for (int i = 0; i < 3; i++) {
        const number slipped = minus(rate.c[i], turned.c[i]),
                     force = add(add(pushed.c[i], d->push_by.c[i][n]), pulled.c[i]),
                     drag = minus(mul(p->D[i], slipped), dragged.c[i]);
        d->turn.c[i][n + 1] = mul(share, rate.c[i]);
        d->push.c[i][n + 1] = mul(share, minus(force, drag));
    }
    if (p->has_friction) LOCAL(add_friction)(p, d, n);
}
/* Initializes the Taylor series of a tangent and its inhomogeneous terms. */
static void LOCAL(begin_deviation)(const LOCAL(moving_path) * p, LOCAL(moving_deviation) * d,
                                   const support_drive *drive, const kr_tangent *g,
                                   const double *high, int order)
{
    /* The low words are those of the next kr_tangent. For doubles, WORD does not use them. */
    const double *low = (const double *)(const void *)((const char *)high + sizeof *g);
    (void)low;
    for (int i = 0; i < 3; i++) {
        d->turn.c[i][0] = of(high[1 + i], WORD(low[1 + i]));
        d->push.c[i][0] = of(high[5 + i], WORD(low[5 + i]));
        d->apex[i] = of(0.0, 0.0);
    }
    LOCAL(set_drive)(p, d, drive, order);
    if (p->has_friction) LOCAL(set_friction_drive)(p, d, drive);
}
/* Subtracts factor * (derivative of the spin) * a from N at the end of the step. */
static void LOCAL(jump)(const LOCAL(moving_path) * p, const support_drive *drive, kr_tangent *g,
                        dd factor)
{
    LOCAL(moving_deviation) d;
    LOCAL(begin_deviation)(p, &d, drive, g, g->end, 1);
    const number change = LOCAL(spin_change)(p, &d, 0),
                 lost = mul(change, of(factor.hi, factor.lo));
    if (HIGH(change) == 0.0) return;
    for (int i = 0; i < 3; i++) {
        const number rest = minus(d.push.c[i][0], mul(lost, p->apex[i]));
        SET(g, end[5 + i], rest);
    }
}
/* Computes all Taylor coefficients of a tangent from those of order 0. */
static void LOCAL(expand_deviation)(const LOCAL(moving_path) * p, const support_drive *drive,
                                    kr_tangent *g, int order)
{
    LOCAL(moving_deviation) d;
    LOCAL(begin_deviation)(p, &d, drive, g, g->x[0], order);
    for (int n = 0; n < order; n++) {
        LOCAL(next_deviation)(p, &d, n);
        for (int i = 0; i < 3; i++) {
            SET(g, x[n + 1][1 + i], d.turn.c[i][n + 1]);
            SET(g, x[n + 1][5 + i], d.push.c[i][n + 1]);
        }
    }
}
