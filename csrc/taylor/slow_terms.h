/* Taylor series of a strongly damped motion on the slow manifold (slow.c), for numbers of the type
 * `real` (math/real.h). All vectors have components along the principal axes. W, O and U = W - O
 * are the angular velocities of the top, of its support, and of the top relative to the support. q
 * is the attitude, P the vertical (taylor.h), and G the effective gravity (series.h). The
 * components u_i of U along the directions v_i (slow_directions.h) satisfy
 *     u_i' = <A v_i, X - O'> / a_i - d_i u_i,   a_i = <v_i, A v_i>
 * where A is the inertia, X the angular acceleration without damping, and d_i a damping rate. The
 * friction variable is the spin <U, a> about the apex a while the top slides, and the ratio of the
 * friction torque to its maximum while friction holds the top. s->c[row][n] is the n-th Taylor
 * coefficient of the number in a row. The rows are listed in slow.c (ROW_Q, U_OF). */

typedef struct REAL(terms) {
    real c[ROWS][KR_TAYLOR_MAX + 2];
    real k[3], up[3], down[3], rub[3];
    real ahead[3], behind[3]; /* factors of next(W) and prev(W) due to a rotor */
    /* v_i, A v_i / a_i, and d_i in the unit of frequency of the series */
    real v[3][3], dual[3][3], drag[3];
} REAL(terms);

/* Returns the n-th coefficient of the product of the series in two rows. */
static inline real REAL(product)(const REAL(terms) * s, int row_a, int row_b, int n)
{
    real sum = r_of(0.0, 0.0);
    for (int j = 0; j <= n; j++) sum = r_add(sum, r_mul(s->c[row_a][j], s->c[row_b][n - j]));
    return sum;
}
/* Sets the n-th coefficient of G P, given the coefficients 0 to n of G and of P. */
static void REAL(set_gravity_vector)(REAL(terms) * s, int n)
{
    for (int i = 0; i < 3; i++) s->c[ROW_GP + i][n] = REAL(product)(s, ROW_G, ROW_P + i, n);
}
/* Writes the n-th coefficient of X, given the coefficients 0 to n of W and of G P. */
static void REAL(find_undamped_acceleration)(const REAL(terms) * s, const slow_directions *slow,
                                             int n, real acceleration[3])
{
    const real *p[3] = {s->c[GP_OF(slow)], s->c[GP_OF(slow) + 1], s->c[GP_OF(slow) + 2]};
    real square[3] = {r_of(0.0, 0.0), r_of(0.0, 0.0), r_of(0.0, 0.0)};
    for (int m = 0; m <= n; m++)
        for (int i = 0; i < 3; i++)
            square[i] = r_add(
                square[i], r_mul(s->c[ROW_W + (i + 1) % 3][m], s->c[ROW_W + (i + 2) % 3][n - m]));
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const real weight = r_add(r_mul(s->up[i], p[j][n]), r_mul(s->down[i], p[k][n]));
        acceleration[i] = r_add(r_mul(s->k[i], square[i]), weight);
        if (n == 0 && slow->slides) acceleration[i] = r_add(acceleration[i], s->rub[i]);
        if (!slow->has_rotor) continue;
        acceleration[i] = r_add(acceleration[i], r_mul(s->ahead[i], s->c[ROW_W + j][n]));
        acceleration[i] = r_add(acceleration[i], r_mul(s->behind[i], s->c[ROW_W + k][n]));
    }
}
/* Returns <A v_i, vector> / a_i, which is called the component of the vector along v_i. */
static real REAL(find_component)(const REAL(terms) * s, int i, const real vector[3])
{
    real sum = r_of(0.0, 0.0);
    for (int j = 0; j < 3; j++) sum = r_add(sum, r_mul(s->dual[i][j], vector[j]));
    return sum;
}
/* Writes the n-th coefficients of the components of X - O' along the v_i, given the coefficients 0
 * to n of W and of G P, and 0 to n + 1 of O. */
static void REAL(find_relative_acceleration)(const REAL(terms) * s, const slow_directions *slow,
                                             int n, real components[3])
{
    real acceleration[3];
    REAL(find_undamped_acceleration)(s, slow, n, acceleration);
    for (int i = 0; i < 3 && slow->turns; i++)
        acceleration[i] = r_sub(acceleration[i], r_mul(r_of(n + 1, 0.0), s->c[ROW_O + i][n + 1]));
    for (int i = 0; i < slow->count; i++)
        components[i] = slow->is_held ? REAL(find_component)(s, i, acceleration) : acceleration[i];
}
/* Sets the n-th coefficients of U and of W = O + U, given those of the u_i and of O. Unless
 * friction holds the top, the weakly damped components of W_0 (order 0) are not changed, because
 * rounding errors of O + U would accumulate from step to step. */
static void REAL(set_velocities_from_components)(REAL(terms) * s, const slow_directions *slow,
                                                 int n)
{
    if (!slow->is_held && !slow->turns) return;
    for (int j = 0; j < 3; j++) {
        real *U = &s->c[U_OF(slow) + j][n];
        if (slow->is_held)
            *U = r_add(r_mul(s->v[0][j], s->c[ROW_R][n]), r_mul(s->v[1][j], s->c[ROW_R + 1][n]));
        if (slow->turns && (n > 0 || slow->is_held || slow->is_slow[j]))
            s->c[ROW_W + j][n] = r_add(s->c[ROW_O + j][n], *U);
    }
}
/* Sets the (n + 1)-th coefficient of a vector b at rest relative to the support (O or P), by b' = b
 * x U. The rows of b and of U begin at `row` and `u_row`. */
static void REAL(set_next_support_fixed_vector)(REAL(terms) * s, int row, int u_row, int n)
{
    const real zero = r_of(0.0, 0.0);
    real ahead[3] = {zero, zero, zero}, behind[3] = {zero, zero, zero};
    for (int m = 0; m <= n; m++)
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            ahead[i] = r_add(ahead[i], r_mul(s->c[row + j][m], s->c[u_row + k][n - m]));
            behind[i] = r_add(behind[i], r_mul(s->c[row + k][m], s->c[u_row + j][n - m]));
        }
    for (int i = 0; i < 3; i++)
        s->c[row + i][n + 1] = r_div(r_sub(ahead[i], behind[i]), r_of(n + 1, 0.0));
}
static void REAL(set_next_attitude)(REAL(terms) * s, int u_row, int n)
{
    real rate = r_of(0.0, 0.0);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const real along = REAL(product)(s, ROW_Q, u_row + i, n),
                   across = r_sub(REAL(product)(s, ROW_Q + 1 + j, u_row + k, n),
                                  REAL(product)(s, ROW_Q + 1 + k, u_row + j, n));
        rate = r_sub(rate, REAL(product)(s, ROW_Q + 1 + i, u_row + i, n));
        s->c[ROW_Q + 1 + i][n + 1] = r_div(r_add(along, across), r_of(2 * (n + 1), 0.0));
    }
    s->c[ROW_Q][n + 1] = r_div(rate, r_of(2 * (n + 1), 0.0));
}
/* Sets the n-th coefficients of the strongly damped u_i by solving the equations at the top of this
 * file, with u_i' from the previous iteration. A rotor couples the equations (slow->gain). Returns
 * the largest change of a coefficient. */
static double REAL(update_damped_velocities)(REAL(terms) * s, const slow_directions *slow, int n)
{
    real force[3], off[3];
    double moved = 0.0;
    REAL(find_relative_acceleration)(s, slow, n, force);
    for (int i = 0; i < slow->count; i++) {
        const real *u = s->c[U_ROW(slow) + i], next = r_mul(r_of(n + 1, 0.0), u[n + 1]);
        if (slow->is_slow[i]) off[i] = r_sub(r_div(r_sub(force[i], next), s->drag[i]), u[n]);
    }
    for (int i = 0; i < slow->count; i++) {
        real *u = s->c[U_ROW(slow) + i], change = r_of(0.0, 0.0);
        if (!slow->is_slow[i]) continue;
        for (int k = 0; k < slow->count; k++)
            if (slow->is_slow[k] && slow->gain[i][k] != 0.0)
                change = r_add(change, r_mul(r_of(slow->gain[i][k], 0.0), off[k]));
        u[n] = r_add(u[n], change);
        moved = fmax(moved, fabs(r_high(change)));
    }
    return moved;
}
/* Performs one iteration: computes the coefficients of all rows but q and the friction variable.
 * Returns the largest change of a strongly damped u_i in orders up to `order` / 2. */
static double REAL(update_coefficients)(REAL(terms) * s, const slow_directions *slow, int order)
{
    const int u = U_OF(slow);
    real force[3];
    double moved = 0.0;
    int has_weak = 0;
    for (int i = 0; i < slow->count; i++) has_weak += !slow->is_slow[i];
    for (int n = 0;; n++) {
        if (slow->shakes) REAL(set_gravity_vector)(s, n);
        REAL(set_velocities_from_components)(s, slow, n);
        const double change = REAL(update_damped_velocities)(s, slow, n);
        REAL(set_velocities_from_components)(s, slow, n);
        if (2 * n <= order) moved = fmax(moved, change);
        if (n == order) break;
        if (slow->turns) REAL(set_next_support_fixed_vector)(s, ROW_O, u, n);
        if (has_weak) REAL(find_relative_acceleration)(s, slow, n, force);
        for (int i = 0; i < slow->count; i++) {
            real *own = s->c[U_ROW(slow) + i];
            if (!slow->is_slow[i])
                own[n + 1] = r_div(r_sub(force[i], r_mul(s->drag[i], own[n])), r_of(n + 1, 0.0));
        }
        REAL(set_next_support_fixed_vector)(s, ROW_P, u, n);
    }
    return moved;
}
/* Returns u_i at the end of the last step, given the series `from` of this step and O_0. */
static real REAL(find_end_relative_velocity)(const REAL(terms) * s, const slow_directions *slow,
                                             const kr_series from[2], int i)
{
    real U[3];
    for (int j = 0; j < 3; j++)
        U[j] = r_sub(r_of(from[0].end_w[1 + j], from[1].end_w[1 + j]), s->c[ROW_O + j][0]);
    return slow->is_held ? REAL(find_component)(s, i, U) : U[i];
}
static void REAL(read_vector)(real vector[3], const double high[4], const double low[4])
{
    (void)low; /* for doubles */
    for (int i = 0; i < 3; i++) vector[i] = r_of(high[1 + i], low[1 + i]);
}
/* Sets all coefficients of G, a constant plus a cosine (kr_series.sway, taylor.h). */
static void REAL(expand_gravity)(REAL(terms) * s, const kr_series from[2])
{
    real *g = s->c[ROW_G], sine = r_of(from[0].sway[1], from[1].sway[1]);
    const real rate = r_of(from[0].sway[2], from[1].sway[2]);
    g[0] = r_of(from[0].sway[0], from[1].sway[0]);
    for (int n = 1; n <= KR_TAYLOR_MAX; n++) {
        const real share = r_div(rate, r_of(n, 0.0));
        g[n] = r_sub(r_of(0.0, 0.0), r_mul(share, sine));
        sine = r_mul(share, g[n - 1]);
    }
    g[0] = r_add(g[0], r_of(from[0].sway[3], from[1].sway[3]));
}
/* Copies constants and end values from `from`, the series of the last step, and constants from
 * `slow`. The unit of time is 1 / rate. Expands G, and sets all other coefficients to zero. */
static void REAL(begin_expansion)(REAL(terms) * s, const slow_directions *slow,
                                  const kr_series from[2], double rate)
{
    memset(s, 0, sizeof *s);
    REAL(read_vector)(s->k, from[0].k, from[1].k);
    REAL(read_vector)(s->up, from[0].up, from[1].up);
    REAL(read_vector)(s->down, from[0].down, from[1].down);
    REAL(read_vector)(s->rub, from[0].rub, from[1].rub);
    REAL(read_vector)(s->ahead, from[0].shift, from[1].shift);
    REAL(read_vector)(s->behind, from[0].shift + 4, from[1].shift + 4);
    for (int i = 0; i < 3 && slow->has_rotor; i++) {
        s->ahead[i] = r_mul(s->k[i], s->ahead[i]);
        s->behind[i] = r_mul(s->k[i], s->behind[i]);
    }
    for (int i = 0; i < 9; i++) {
        s->v[i / 3][i % 3] = r_dd(slow->v[i / 3][i % 3]);
        s->dual[i / 3][i % 3] = r_dd(slow->dual[i / 3][i % 3]);
    }
    for (int i = 0; i < 8; i++) s->c[ROW_Q + i][0] = r_of(from[0].end_x[i], from[1].end_x[i]);
    for (int i = 0; i < 3; i++) {
        s->drag[i] = r_of(slow->drag[i].hi / rate, slow->drag[i].lo / rate);
        s->c[ROW_W + i][0] = r_of(from[0].end_w[1 + i], from[1].end_w[1 + i]);
        if (slow->turns) s->c[ROW_O + i][0] = r_of(from[0].turn[1 + i], from[1].turn[1 + i]);
    }
    for (int i = 0; i < slow->count; i++)
        s->c[U_ROW(slow) + i][0] = REAL(find_end_relative_velocity)(s, slow, from, i);
    if (slow->shakes) REAL(expand_gravity)(s, from);
}
/* Sets the coefficients, of orders 0 to `order`, of the friction variable of a sliding top: the
 * spin <U, a>. These coefficients must be zero before the call. The rows of U begin at `u_row`. */
static void REAL(expand_spin_while_sliding)(REAL(terms) * s, int u_row, int order,
                                            const kr_series from[2])
{
    for (int n = 0; n <= order; n++)
        for (int i = 0; i < 3; i++)
            s->c[ROW_FRICTION][n] =
                r_add(s->c[ROW_FRICTION][n],
                      r_mul(r_of(from[0].apex[1 + i], from[1].apex[1 + i]), s->c[u_row + i][n]));
}
/* Sets the coefficients, of orders below `order`, of the friction variable while friction holds the
 * top: the friction torque divided by its maximum `friction`, both in the unit of time 1 / rate. */
static void REAL(expand_friction_ratio)(REAL(terms) * s, const slow_directions *slow, double rate,
                                        double friction, int order)
{
    for (int n = 0; n < order; n++) {
        real sum = r_of(0.0, 0.0), torque[3];
        REAL(find_undamped_acceleration)(s, slow, n, torque);
        for (int j = 0; j < 3; j++) {
            const real next = r_mul(r_of(n + 1, 0.0), s->c[ROW_W + j][n + 1]);
            sum = r_add(sum, r_mul(r_dd(slow->moment[j]), r_sub(next, torque[j])));
        }
        for (int i = 0; i < 2; i++)
            sum = r_add(sum, r_mul(r_dd(dd_scale(1.0 / rate, slow->load[i])), s->c[ROW_R + i][n]));
        s->c[ROW_FRICTION][n] = r_div(sum, r_of(friction, 0.0));
    }
}
/* Copies the first rows, q to W, up to `order`: the high words to to[0], the low words to to[1]. */
static void REAL(write_coefficients)(const REAL(terms) * s, int order, kr_series to[2])
{
    for (int n = 0; n <= order; n++)
        for (int row = 0; row < ROWS_OF_SERIES; row++) {
            const int is_x = row < ROW_FRICTION, i = is_x ? row : row - ROW_FRICTION;
            *(is_x ? &to[0].x[n][i] : &to[0].w[n][i]) = r_high(s->c[row][n]);
            *(is_x ? &to[1].x[n][i] : &to[1].w[n][i]) = r_low(s->c[row][n]);
        }
}
/* Returns 1 if the motion at the end of the last step, whose series is `from`, is on the manifold:
 * each strongly damped u_i differs from its value on the manifold, the coefficient of order 0 in
 * s->c, by at most `near` times the larger of bound[i] (bound_damped_velocities) and `scale`.
 * Otherwise returns 0, and writes to `wait` the estimated time to reach the manifold, in the units
 * of the series. */
static int REAL(is_on_manifold)(const REAL(terms) * s, const kr_series from[2],
                                const slow_directions *slow, const double bound[3], double scale,
                                double near, double *wait)
{
    double last = 0.0;
    for (int i = 0; i < slow->count; i++) {
        const real end = REAL(find_end_relative_velocity)(s, slow, from, i);
        const double off = fabs(r_high(r_sub(end, s->c[U_ROW(slow) + i][0]))),
                     size = fmax(bound[i], scale), allowed = fmax(near * size, TINY_VELOCITY);
        if (slow->is_slow[i] && !(off <= allowed))
            last = fmax(last, LOG_OF_2 * log2(off / allowed) / r_high(s->drag[i]));
    }
    if (last > 0.0) *wait = last;
    return last == 0.0;
}
/* Expands the motion on the slow manifold about the end of the last step, and writes the
 * coefficients to p->series. Iterates update_coefficients until the change is at most `noise` times
 * the largest of find_error_scale and bound[i] (bound_damped_velocities). Returns 0 and leaves p
 * unchanged if there is no convergence or is_on_manifold returns 0 (find_manifold_distance_scale
 * uses `strong`), else 1. After 0, `wait` is the estimated time to the manifold in the units of the
 * series. `friction` is the maximum friction torque while friction holds the top, else unused. */
static int REAL(expand_on_manifold)(kr_taylor *p, const slow_directions *slow,
                                    const slow_directions *strong, int order, double near,
                                    double noise, double friction, double *wait)
{
    double bound[3], moved = INFINITY, size = find_error_scale(p, slow, bound);
    const double scale = find_manifold_distance_scale(p, size, strong);
    REAL(terms) s;
    REAL(begin_expansion)(&s, slow, p->series, p->rate);
    for (int i = 0; i < slow->count; i++)
        if (slow->is_slow[i]) {
            size = fmax(size, bound[i]);
            *wait = fmax(*wait, 1.0 / r_high(s.drag[i]));
        }
    for (int sweep = 0; sweep < SWEEPS && moved > noise * size; sweep++)
        moved = REAL(update_coefficients)(&s, slow, order);
    if (moved > noise * size) return 0;
    /* Iterate once more, because the friction torque is inaccurate if large terms nearly cancel. */
    if (slow->is_held) REAL(update_coefficients)(&s, slow, order);
    if (!REAL(is_on_manifold)(&s, p->series, slow, bound, scale, near, wait)) return 0;
    for (int n = 0; n < order; n++) REAL(set_next_attitude)(&s, U_OF(slow), n);
    if (slow->slides) REAL(expand_spin_while_sliding)(&s, U_OF(slow), order, p->series);
    if (slow->is_held) REAL(expand_friction_ratio)(&s, slow, p->rate, friction, order);
    REAL(write_coefficients)(&s, order, p->series);
    return 1;
}
