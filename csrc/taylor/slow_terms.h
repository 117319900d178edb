/* Taylor coefficients of a strongly damped motion on the slow manifold (slow.c), which are of the
 * type `real` (math/real.h). */

typedef struct REAL(terms) {
    real c[ROWS][KR_TAYLOR_MAX + 2];
    real k[3], up[3], down[3], drag[3], rub[3];
    real ahead[3], behind[3]; /* the rotor's terms: factors of next(W) and prev(W) */
} REAL(terms);
/* Members of the struct held_directions, converted to the unit of time of the Taylor series. */
typedef struct REAL(directions) {
    real v[2][3], weight[2][3], drag[2][2], load[2], moment[3];
} REAL(directions);

static real *REAL(row)(REAL(terms) * s, int row) { return s->c[row]; }
/* Returns the n-th coefficient of the product of the series in rows `a` and `b`. */
static real REAL(product)(const REAL(terms) * s, int a, int b, int n)
{
    real sum = r_of(0.0, 0.0);
    for (int j = 0; j <= n; j++) sum = r_add(sum, r_mul(s->c[a][j], s->c[b][n - j]));
    return sum;
}
/* Computes the n-th coefficient of the effective gravity vector G P. */
static void REAL(multiply_gravity)(REAL(terms) * s, int n)
{
    for (int i = 0; i < 3; i++) s->c[ROW_GP + i][n] = REAL(product)(s, ROW_G, ROW_P + i, n);
}
/* Returns the n-th coefficient of the angular acceleration about an axis, without damping. */
static real REAL(torque)(const REAL(terms) * s, const slow_axes *slow, int axis, int n)
{
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    const int p = GP_OF(slow);
    const real weight =
        r_add(r_mul(s->up[axis], s->c[p + j][n]), r_mul(s->down[axis], s->c[p + k][n]));
    real sum = r_add(r_mul(s->k[axis], REAL(product)(s, ROW_W + j, ROW_W + k, n)), weight);
    if (n == 0 && slow->slides) sum = r_add(sum, s->rub[axis]);
    if (!slow->has_rotor) return sum;
    sum = r_add(sum, r_mul(s->ahead[axis], s->c[ROW_W + j][n]));
    return r_add(sum, r_mul(s->behind[axis], s->c[ROW_W + k][n]));
}
/* Solves for the strongly damped components of the angular velocity when a rotor couples the axes.
 * The array `follows` holds the torque about each axis divided by the damping constant of the
 * axis. */
static void REAL(solve_rotor_coupling)(REAL(terms) * s, const slow_axes *slow,
                                       const real follows[3], int n)
{
    const int u = U_OF(slow);
    real off[3];
    for (int i = 0; i < 3; i++)
        off[i] = slow->is_slow[i] ? r_sub(follows[i], s->c[u + i][n]) : r_of(0.0, 0.0);
    for (int i = 0; i < 9; i++)
        if (slow->is_slow[i / 3] && slow->is_slow[i % 3])
            s->c[u + i / 3][n] =
                r_add(s->c[u + i / 3][n], r_mul(r_of(slow->gain[i / 3][i % 3], 0.0), off[i % 3]));
}
/* Computes the (n + 1)-th coefficients of the body-frame components of a space-fixed vector. */
static void REAL(next_body_vector)(REAL(terms) * s, int row, int u, int n)
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const real rate =
            r_sub(REAL(product)(s, row + j, u + k, n), REAL(product)(s, row + k, u + j, n));
        s->c[row + i][n + 1] = r_div(rate, r_of(n + 1, 0.0));
    }
}
/* Computes the (n + 1)-th coefficient of the attitude. */
static void REAL(turn_attitude)(REAL(terms) * s, int u, int n)
{
    real rate = r_of(0.0, 0.0);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const real along = REAL(product)(s, ROW_Q, u + i, n),
                   across = r_sub(REAL(product)(s, ROW_Q + 1 + j, u + k, n),
                                  REAL(product)(s, ROW_Q + 1 + k, u + j, n));
        rate = r_sub(rate, REAL(product)(s, ROW_Q + 1 + i, u + i, n));
        s->c[ROW_Q + 1 + i][n + 1] = r_div(r_add(along, across), r_of(2 * (n + 1), 0.0));
    }
    s->c[ROW_Q][n + 1] = r_div(rate, r_of(2 * (n + 1), 0.0));
}
/* Recomputes the n-th strongly damped velocities. Returns the largest change. */
static double REAL(solve_slow_velocities)(REAL(terms) * s, const slow_axes *slow, int n)
{
    const int u = U_OF(slow);
    real last[3], follows[3];
    double moved = 0.0;
    for (int i = 0; i < 3; i++) {
        last[i] = s->c[u + i][n];
        follows[i] = r_of(0.0, 0.0);
        if (!slow->is_slow[i]) continue;
        const real next = r_mul(r_of(n + 1, 0.0), s->c[ROW_W + i][n + 1]);
        follows[i] = r_div(r_sub(next, REAL(torque)(s, slow, i, n)), s->drag[i]);
        if (!slow->has_rotor) s->c[u + i][n] = follows[i];
    }
    if (slow->has_rotor) REAL(solve_rotor_coupling)(s, slow, follows, n);
    for (int i = 0; i < 3; i++) {
        const real change = r_sub(s->c[u + i][n], last[i]);
        if (slow->is_slow[i]) moved = fmax(moved, fabs(r_high(change)));
        if (u == ROW_W) continue;
        if (slow->is_slow[i])
            s->c[ROW_W + i][n] = r_add(s->c[ROW_O + i][n], s->c[ROW_U + i][n]);
        else
            s->c[ROW_U + i][n] = r_sub(s->c[ROW_W + i][n], s->c[ROW_O + i][n]);
    }
    return moved;
}
/* Performs one iteration: recomputes the strongly damped angular velocities, and all coefficients
 * that depend on them. Returns the largest change, in this iteration, of a coefficient of order at
 * most `order` / 2. */
static double REAL(iterate_axes)(REAL(terms) * s, const slow_axes *slow, int order)
{
    const int u = U_OF(slow);
    double moved = 0.0;
    for (int n = 0;; n++) {
        if (GP_OF(slow) != ROW_P) REAL(multiply_gravity)(s, n);
        const double change = REAL(solve_slow_velocities)(s, slow, n);
        if (2 * n <= order) moved = fmax(moved, change);
        if (n == order) break;
        for (int i = 0; i < 3; i++)
            if (!slow->is_slow[i])
                s->c[ROW_W + i][n + 1] =
                    r_div(r_add(REAL(torque)(s, slow, i, n), r_mul(s->drag[i], s->c[u + i][n])),
                          r_of(n + 1, 0.0));
        REAL(next_body_vector)(s, ROW_P, u, n);
        if (u != ROW_W) REAL(next_body_vector)(s, ROW_O, u, n);
    }
    return moved;
}
static void REAL(read_vector)(real to[3], const double a[4], const double b[4])
{
    (void)b; /* for doubles */
    for (int i = 0; i < 3; i++) to[i] = r_of(a[1 + i], b[1 + i]);
}
/* Computes the Taylor coefficients of the effective gravity, which is a constant plus a cosine. */
static void REAL(expand_gravity)(REAL(terms) * s, const kr_series from[2])
{
    real *g = REAL(row)(s, ROW_G), sine = r_of(from[0].sway[1], from[1].sway[1]);
    const real rate = r_of(from[0].sway[2], from[1].sway[2]);
    g[0] = r_of(from[0].sway[0], from[1].sway[0]);
    for (int n = 1; n <= KR_TAYLOR_MAX; n++) {
        const real share = r_div(rate, r_of(n, 0.0));
        g[n] = r_sub(r_of(0.0, 0.0), r_mul(share, sine));
        sine = r_mul(share, g[n - 1]);
    }
    g[0] = r_add(g[0], r_of(from[0].sway[3], from[1].sway[3]));
}
/* Starts a new Taylor expansion about the end of the last step. Copies the constant terms of the
 * series, and sets its higher-order coefficients to zero. */
static void REAL(begin)(REAL(terms) * s, const slow_axes *slow, const kr_series from[2])
{
    memset(s, 0, sizeof *s);
    REAL(read_vector)(s->k, from[0].k, from[1].k);
    REAL(read_vector)(s->up, from[0].up, from[1].up);
    REAL(read_vector)(s->down, from[0].down, from[1].down);
    REAL(read_vector)(s->drag, from[0].drag, from[1].drag);
    REAL(read_vector)(s->rub, from[0].rub, from[1].rub);
    REAL(read_vector)(s->ahead, from[0].shift, from[1].shift);
    REAL(read_vector)(s->behind, from[0].shift + 4, from[1].shift + 4);
    for (int i = 0; i < 3 && slow->has_rotor; i++) {
        s->ahead[i] = r_mul(s->k[i], s->ahead[i]);
        s->behind[i] = r_mul(s->k[i], s->behind[i]);
    }
    for (int i = 0; i < 4; i++) s->c[ROW_Q + i][0] = r_of(from[0].end_x[i], from[1].end_x[i]);
    for (int i = 0; i < 3; i++) {
        s->c[ROW_P + i][0] = r_of(from[0].end_x[5 + i], from[1].end_x[5 + i]);
        s->c[ROW_W + i][0] = r_of(from[0].end_w[1 + i], from[1].end_w[1 + i]);
    }
    if (slow->turns || slow->held)
        for (int i = 0; i < 3; i++) {
            s->c[ROW_O + i][0] = r_of(from[0].turn[1 + i], from[1].turn[1 + i]);
            s->c[ROW_U + i][0] = r_sub(s->c[ROW_W + i][0], s->c[ROW_O + i][0]);
        }
    if (slow->shakes) REAL(expand_gravity)(s, from);
}
/* Copies the Taylor coefficients of orders 0 to `order` into the high and low words of a series. */
static void REAL(write)(const REAL(terms) * s, int order, kr_series to[2])
{
    for (int n = 0; n <= order; n++)
        for (int row = 0; row < ROWS_AT_REST; row++) {
            const real value = s->c[row][n];
            double *hi = row < ROW_P   ? &to[0].x[n][row]
                         : row < ROW_W ? &to[0].x[n][row + 1]
                                       : &to[0].w[n][row - ROW_W + 1];
            double *lo = row < ROW_P   ? &to[1].x[n][row]
                         : row < ROW_W ? &to[1].x[n][row + 1]
                                       : &to[1].w[n][row - ROW_W + 1];
            *hi = r_high(value);
            *lo = r_low(value);
        }
}
/* Writes the Taylor coefficients of the spin of a sliding top. */
static void REAL(write_spin)(const REAL(terms) * s, int u, int order, kr_series to[2])
{
    for (int n = 0; n <= order; n++) {
        real sum = r_of(0.0, 0.0);
        for (int i = 0; i < 3; i++)
            sum = r_add(sum, r_mul(r_of(to[0].apex[1 + i], to[1].apex[1 + i]), s->c[u + i][n]));
        to[0].w[n][0] = r_high(sum);
        to[1].w[n][0] = r_low(sum);
    }
}
/* Returns 1 if the angular velocity at the end of a series agrees with that on the slow manifold.
 * The components of the two angular velocities along each strongly damped axis may differ by at
 * most `near` times the larger of bound_slow_velocity and least_size. If the motion has not reached
 * the slow manifold, `wait` receives an estimate of the remaining time. */
static int REAL(is_on_manifold)(const REAL(terms) * s, const kr_series series[2],
                                const slow_axes *slow, double near, double *wait)
{
    const double least = least_size(series, slow);
    double last = 0.0;
    for (int i = 0; i < 3; i++) {
        const real end = r_of(series[0].end_w[1 + i], series[1].end_w[1 + i]);
        const double off = fabs(r_high(r_sub(end, s->c[ROW_W + i][0]))),
                     size = fmax(bound_slow_velocity(series, slow, i), least),
                     allowed = fmax(near * size, TINY_VELOCITY);
        if (slow->is_slow[i] && !(off <= allowed))
            last = fmax(last, LOG_OF_2 * log2(off / allowed) / fabs(series->drag[1 + i]));
    }
    if (last > 0.0) *wait = last;
    return last == 0.0;
}
/* Expands the motion on the slow manifold in a Taylor series about the end of the last step. The
 * iteration ends when no coefficient of low order changes by more than `noise` times the strongly
 * damped angular velocity. Returns 0 if the iteration does not converge, or if the motion has not
 * reached the slow manifold. On failure, sets `wait` to the time after which the expansion should
 * be tried again. */
static int REAL(expand)(kr_series series[2], const slow_axes *slow, int order, double near,
                        double noise, double *wait)
{
    REAL(terms) s;
    double moved = INFINITY, size = 0.0;
    REAL(begin)(&s, slow, series);
    for (int i = 0; i < 3; i++)
        if (slow->is_slow[i]) {
            size = fmax(size, bound_slow_velocity(series, slow, i));
            *wait = fmax(*wait, 1.0 / fabs(series->drag[1 + i]));
        }
    for (int sweep = 0; sweep < SWEEPS && moved > noise * size; sweep++)
        moved = REAL(iterate_axes)(&s, slow, order);
    if (moved > noise * size || !REAL(is_on_manifold)(&s, series, slow, near, wait)) return 0;
    for (int n = 0; n < order; n++) REAL(turn_attitude)(&s, U_OF(slow), n);
    REAL(write)(&s, order, series);
    if (slow->slides) REAL(write_spin)(&s, U_OF(slow), order, series);
    return 1;
}
