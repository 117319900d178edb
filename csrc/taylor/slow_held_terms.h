/* Taylor coefficients of the strongly damped motion of a top that friction holds (slow_held.h).
 * This source file is included once for doubles and once for double-doubles, each time after
 * slow_terms.h. */

static void NAME(read_words)(number *to, const dd *from, int n, double scale)
{
    for (int i = 0; i < n; i++) to[i] = of(scale * from[i].hi, scale * from[i].lo);
}
static void NAME(read_directions)(const held_directions *held, double rate, NAME(directions) * to)
{
    NAME(read_words)(to->moment, held->moment, 3, 1.0);
    NAME(read_words)(to->load, held->load, 2, 1.0 / rate);
    for (int i = 0; i < 2; i++) {
        NAME(read_words)(to->v[i], held->v[i], 3, 1.0);
        NAME(read_words)(to->weight[i], held->weight[i], 3, 1.0);
        NAME(read_words)(to->drag[i], held->drag[i], 2, 1.0 / rate);
    }
}
/* Computes the n-th coefficients of the angular velocities U and W from the components u_i. */
static void NAME(compose)(NAME(terms) * s, const NAME(directions) * held, int n)
{
    for (int j = 0; j < 3; j++) {
        const number one = mul(held->v[0][j], NAME(row)(s, ROW_R)[n]),
                     other = mul(held->v[1][j], NAME(row)(s, ROW_R + 1)[n]);
        s->c[ROW_U + j][n] = add(one, other);
        s->c[ROW_W + j][n] = add(s->c[ROW_O + j][n], s->c[ROW_U + j][n]);
    }
}
/* Returns the n-th Taylor coefficient of the torque that drives the angular velocity component
 * u_i. */
static number NAME(held_torque)(const NAME(terms) * s, const slow_axes *slow,
                                const NAME(directions) * held, int i, int n)
{
    number sum = of(0.0, 0.0);
    for (int j = 0; j < 3; j++) {
        const number turn = mul(of(n + 1, 0.0), s->c[ROW_O + j][n + 1]),
                     rate = minus(NAME(torque)(s, slow, j, n), turn);
        sum = add(sum, mul(held->weight[i][j], rate));
    }
    return minus(sum, mul(held->drag[i][1 - i], s->c[ROW_R + 1 - i][n]));
}
/* Recomputes the n-th Taylor coefficients of the strongly damped velocities, and those of U and W.
 * Returns the largest absolute change of an n-th coefficient of U. */
static double NAME(follow_held)(NAME(terms) * s, const slow_axes *slow,
                                const NAME(directions) * held, int n)
{
    number off[2], last[3];
    double moved = 0.0;
    NAME(compose)(s, held, n);
    for (int j = 0; j < 3; j++) last[j] = s->c[ROW_U + j][n];
    for (int i = 0; i < 2; i++) {
        const number *u = s->c[ROW_R + i];
        off[i] = of(0.0, 0.0);
        if (!slow->is_slow[i]) continue;
        const number next = mul(of(n + 1, 0.0), u[n + 1]);
        const number torque = minus(NAME(held_torque)(s, slow, held, i, n), next);
        off[i] = minus(over(torque, held->drag[i][i]), u[n]);
    }
    for (int i = 0; i < 4; i++)
        if (slow->is_slow[i / 2] && slow->gain[i / 2][i % 2] != 0.0)
            s->c[ROW_R + i / 2][n] =
                add(s->c[ROW_R + i / 2][n], mul(of(slow->gain[i / 2][i % 2], 0.0), off[i % 2]));
    NAME(compose)(s, held, n);
    for (int j = 0; j < 3; j++) moved = fmax(moved, fabs(high(minus(s->c[ROW_U + j][n], last[j]))));
    return moved;
}
/* Performs one iteration, which recomputes all Taylor coefficients except those of the attitude.
 * Returns the largest change of a coefficient of U of order at most `order` / 2. */
static double NAME(improve_held)(NAME(terms) * s, const slow_axes *slow,
                                 const NAME(directions) * held, int order)
{
    double moved = 0.0;
    for (int n = 0;; n++) {
        if (slow->shakes) NAME(pull)(s, n);
        const double change = NAME(follow_held)(s, slow, held, n);
        if (2 * n <= order) moved = fmax(moved, change);
        if (n == order) break;
        NAME(turn_back)(s, ROW_P, ROW_U, n);
        if (slow->turns) NAME(turn_back)(s, ROW_O, ROW_U, n);
        for (int i = 0; i < 2; i++) {
            number *u = s->c[ROW_R + i];
            if (slow->is_slow[i]) continue;
            const number torque = NAME(held_torque)(s, slow, held, i, n);
            u[n + 1] = over(minus(torque, mul(held->drag[i][i], u[n])), of(n + 1, 0.0));
        }
    }
    return moved;
}
/* Returns the component u_i of the angular velocity relative to the support at the end of a Taylor
 * step. */
static number NAME(held_velocity)(const NAME(terms) * s, const NAME(directions) * held,
                                  const kr_series from[2], int i)
{
    number sum = of(0.0, 0.0);
    for (int j = 0; j < 3; j++) {
        const number end = of(from[0].end_w[1 + j], from[1].end_w[1 + j]);
        sum = add(sum, mul(held->weight[i][j], minus(end, s->c[ROW_O + j][0])));
    }
    return sum;
}
/* Writes the Taylor coefficients of the ratio of the friction torque to its limit. */
static void NAME(write_grip)(const NAME(terms) * s, const slow_axes *slow,
                             const NAME(directions) * held, number friction, int order,
                             kr_series to[2])
{
    for (int n = 0; n <= order; n++) {
        number sum = of(0.0, 0.0);
        for (int j = 0; j < 3 && n < order; j++) {
            const number next = mul(of(n + 1, 0.0), s->c[ROW_W + j][n + 1]),
                         rate = minus(next, NAME(torque)(s, slow, j, n));
            sum = add(sum, mul(held->moment[j], rate));
        }
        for (int i = 0; i < 2 && n < order; i++)
            sum = add(sum, mul(held->load[i], s->c[ROW_R + i][n]));
        const number torque = over(sum, friction);
        to[0].w[n][0] = high(torque);
        to[1].w[n][0] = low(torque);
    }
}
/* Returns 1 if the strongly damped velocities at the end of a Taylor series agree with their values
 * on the slow manifold.
 * If the motion has not reached the slow manifold, `wait` receives an estimate of the remaining
 * time. */
static int NAME(is_held_on_manifold)(const NAME(terms) * s, const kr_series series[2],
                                     const slow_axes *slow, const NAME(directions) * held,
                                     double least, double near, double *wait)
{
    double last = 0.0;
    for (int i = 0; i < 2; i++) {
        const number end = NAME(held_velocity)(s, held, series, i);
        const double off = fabs(high(minus(end, s->c[ROW_R + i][0]))),
                     size = fmax(near * held_size(series, slow, i), least),
                     allowed = fmax(size, TINY_VELOCITY);
        if (slow->is_slow[i] && !(off <= allowed))
            last = fmax(last, LOG_OF_2 * log2(off / allowed) / high(held->drag[i][i]));
    }
    if (last > 0.0) *wait = last;
    return last == 0.0;
}
/* Expands the motion of a top that friction holds about one axis on the slow manifold in a Taylor
 * series. */
static int NAME(expand_held)(kr_series series[2], const slow_axes *slow, int order, double near,
                             double noise, double *wait, double rate, double friction)
{
    NAME(directions) held;
    NAME(read_directions)(slow->held, rate, &held);
    const double least = least_held_size(series, slow);
    const double size = ROUNDED * held_velocity_size(series, slow);
    NAME(terms) s;
    double moved = INFINITY;
    NAME(begin)(&s, slow, series);
    for (int i = 0; i < 2; i++) s.c[ROW_R + i][0] = NAME(held_velocity)(&s, &held, series, i);
    for (int sweep = 0; sweep < SWEEPS && moved > noise * size; sweep++)
        moved = NAME(improve_held)(&s, slow, &held, order);
    *wait = 1.0 / high(held.drag[slow->is_slow[0] ? 0 : 1][slow->is_slow[0] ? 0 : 1]);
    if (moved > noise * size) return 0;
    /* Iterate once more, because the friction torque is inaccurate if large terms nearly cancel. */
    NAME(improve_held)(&s, slow, &held, order);
    if (!NAME(is_held_on_manifold)(&s, series, slow, &held, near * least, near, wait)) return 0;
    for (int n = 0; n < order; n++) NAME(turn_attitude)(&s, ROW_U, n);
    NAME(write)(&s, order, series);
    NAME(write_grip)(&s, slow, &held, of(friction, 0.0), order, series);
    return 1;
}
