/* Taylor coefficients of the strongly damped motion of a top that friction holds (slow_held.h).
 * This source file is included after slow_terms.h. */

static void REAL(read_words)(real *to, const dd *from, int n, double scale)
{
    for (int i = 0; i < n; i++) to[i] = r_of(scale * from[i].hi, scale * from[i].lo);
}
static void REAL(read_directions)(const held_directions *held, double rate, REAL(directions) * to)
{
    REAL(read_words)(to->moment, held->moment, 3, 1.0);
    REAL(read_words)(to->load, held->load, 2, 1.0 / rate);
    for (int i = 0; i < 2; i++) {
        REAL(read_words)(to->v[i], held->v[i], 3, 1.0);
        REAL(read_words)(to->weight[i], held->weight[i], 3, 1.0);
        REAL(read_words)(to->drag[i], held->drag[i], 2, 1.0 / rate);
    }
}
/* Computes the n-th coefficients of the angular velocities U and W from the components u_i. */
static void REAL(sum_held_velocity)(REAL(terms) * s, const REAL(directions) * held, int n)
{
    for (int j = 0; j < 3; j++) {
        const real one = r_mul(held->v[0][j], REAL(row)(s, ROW_R)[n]),
                   other = r_mul(held->v[1][j], REAL(row)(s, ROW_R + 1)[n]);
        s->c[ROW_U + j][n] = r_add(one, other);
        s->c[ROW_W + j][n] = r_add(s->c[ROW_O + j][n], s->c[ROW_U + j][n]);
    }
}
/* Returns the n-th coefficient of the torque that drives the velocity u_i. */
static real REAL(held_torque)(const REAL(terms) * s, const slow_axes *slow,
                              const REAL(directions) * held, int i, int n)
{
    real sum = r_of(0.0, 0.0);
    for (int j = 0; j < 3; j++) {
        const real turn = r_mul(r_of(n + 1, 0.0), s->c[ROW_O + j][n + 1]),
                   rate = r_sub(REAL(torque)(s, slow, j, n), turn);
        sum = r_add(sum, r_mul(held->weight[i][j], rate));
    }
    return r_sub(sum, r_mul(held->drag[i][1 - i], s->c[ROW_R + 1 - i][n]));
}
/* Recomputes the n-th Taylor coefficients of the strongly damped velocities, and those of U and W.
 * Returns the largest absolute change of an n-th coefficient of U. */
static double REAL(solve_held_velocities)(REAL(terms) * s, const slow_axes *slow,
                                          const REAL(directions) * held, int n)
{
    real off[2], last[3];
    double moved = 0.0;
    REAL(sum_held_velocity)(s, held, n);
    for (int j = 0; j < 3; j++) last[j] = s->c[ROW_U + j][n];
    for (int i = 0; i < 2; i++) {
        const real *u = s->c[ROW_R + i];
        off[i] = r_of(0.0, 0.0);
        if (!slow->is_slow[i]) continue;
        const real next = r_mul(r_of(n + 1, 0.0), u[n + 1]);
        const real torque = r_sub(REAL(held_torque)(s, slow, held, i, n), next);
        off[i] = r_sub(r_div(torque, held->drag[i][i]), u[n]);
    }
    for (int i = 0; i < 4; i++)
        if (slow->is_slow[i / 2] && slow->gain[i / 2][i % 2] != 0.0)
            s->c[ROW_R + i / 2][n] = r_add(s->c[ROW_R + i / 2][n],
                                           r_mul(r_of(slow->gain[i / 2][i % 2], 0.0), off[i % 2]));
    REAL(sum_held_velocity)(s, held, n);
    for (int j = 0; j < 3; j++)
        moved = fmax(moved, fabs(r_high(r_sub(s->c[ROW_U + j][n], last[j]))));
    return moved;
}
/* Performs one iteration, which recomputes all Taylor coefficients except those of the attitude.
 * Returns the largest change of a coefficient of U of order at most `order` / 2. */
static double REAL(iterate_held)(REAL(terms) * s, const slow_axes *slow,
                                 const REAL(directions) * held, int order)
{
    double moved = 0.0;
    for (int n = 0;; n++) {
        if (slow->shakes) REAL(multiply_gravity)(s, n);
        const double change = REAL(solve_held_velocities)(s, slow, held, n);
        if (2 * n <= order) moved = fmax(moved, change);
        if (n == order) break;
        REAL(next_body_vector)(s, ROW_P, ROW_U, n);
        if (slow->turns) REAL(next_body_vector)(s, ROW_O, ROW_U, n);
        for (int i = 0; i < 2; i++) {
            real *u = s->c[ROW_R + i];
            if (slow->is_slow[i]) continue;
            const real torque = REAL(held_torque)(s, slow, held, i, n);
            u[n + 1] = r_div(r_sub(torque, r_mul(held->drag[i][i], u[n])), r_of(n + 1, 0.0));
        }
    }
    return moved;
}
/* Returns the velocity u_i relative to the support at the end of a step. */
static real REAL(held_angular_velocity)(const REAL(terms) * s, const REAL(directions) * held,
                                        const kr_series from[2], int i)
{
    real sum = r_of(0.0, 0.0);
    for (int j = 0; j < 3; j++) {
        const real end = r_of(from[0].end_w[1 + j], from[1].end_w[1 + j]);
        sum = r_add(sum, r_mul(held->weight[i][j], r_sub(end, s->c[ROW_O + j][0])));
    }
    return sum;
}
/* Writes the Taylor coefficients of the ratio of the friction torque to its limit. */
static void REAL(write_friction_ratio)(const REAL(terms) * s, const slow_axes *slow,
                                       const REAL(directions) * held, real friction, int order,
                                       kr_series to[2])
{
    for (int n = 0; n <= order; n++) {
        real sum = r_of(0.0, 0.0);
        for (int j = 0; j < 3 && n < order; j++) {
            const real next = r_mul(r_of(n + 1, 0.0), s->c[ROW_W + j][n + 1]),
                       rate = r_sub(next, REAL(torque)(s, slow, j, n));
            sum = r_add(sum, r_mul(held->moment[j], rate));
        }
        for (int i = 0; i < 2 && n < order; i++)
            sum = r_add(sum, r_mul(held->load[i], s->c[ROW_R + i][n]));
        const real torque = r_div(sum, friction);
        to[0].w[n][0] = r_high(torque);
        to[1].w[n][0] = r_low(torque);
    }
}
/* Returns 1 if the strongly damped velocities at the end of a Taylor series agree with their values
 * on the slow manifold.
 * If the motion has not reached the slow manifold, `wait` receives an estimate of the remaining
 * time. */
static int REAL(is_held_on_manifold)(const REAL(terms) * s, const kr_series series[2],
                                     const slow_axes *slow, const REAL(directions) * held,
                                     double least, double near, double *wait)
{
    double last = 0.0;
    for (int i = 0; i < 2; i++) {
        const real end = REAL(held_angular_velocity)(s, held, series, i);
        const double off = fabs(r_high(r_sub(end, s->c[ROW_R + i][0]))),
                     size = fmax(near * bound_held_velocity(series, slow, i), least),
                     allowed = fmax(size, TINY_VELOCITY);
        if (slow->is_slow[i] && !(off <= allowed))
            last = fmax(last, LOG_OF_2 * log2(off / allowed) / r_high(held->drag[i][i]));
    }
    if (last > 0.0) *wait = last;
    return last == 0.0;
}
/* Expands in a Taylor series the motion on the slow manifold of a top that friction holds about
 * its axis. The arguments are those of `expand` (slow_terms.h); `rate` is the unit of frequency
 * of the series, and `friction` the largest friction torque. */
static int REAL(expand_held)(kr_series series[2], const slow_axes *slow, int order, double near,
                             double noise, double *wait, double rate, double friction)
{
    REAL(directions) held;
    REAL(read_directions)(slow->held, rate, &held);
    const double least = least_held_size(series, slow);
    const double size = ROUNDED * held_velocity_size(series, slow);
    REAL(terms) s;
    double moved = INFINITY;
    REAL(begin)(&s, slow, series);
    for (int i = 0; i < 2; i++)
        s.c[ROW_R + i][0] = REAL(held_angular_velocity)(&s, &held, series, i);
    for (int sweep = 0; sweep < SWEEPS && moved > noise * size; sweep++)
        moved = REAL(iterate_held)(&s, slow, &held, order);
    *wait = 1.0 / r_high(held.drag[slow->is_slow[0] ? 0 : 1][slow->is_slow[0] ? 0 : 1]);
    if (moved > noise * size) return 0;
    /* Iterate once more, because the friction torque is inaccurate if large terms nearly cancel. */
    REAL(iterate_held)(&s, slow, &held, order);
    if (!REAL(is_held_on_manifold)(&s, series, slow, &held, near * least, near, wait)) return 0;
    for (int n = 0; n < order; n++) REAL(turn_attitude)(&s, ROW_U, n);
    REAL(write)(&s, order, series);
    REAL(write_friction_ratio)(&s, slow, &held, r_of(friction, 0.0), order, series);
    return 1;
}
