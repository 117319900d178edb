/* The directions v_i about which damping may be strong, and the choice of the strongly damped ones.
 * All vectors have components along the principal axes. A are the moments of inertia, D the damping
 * coefficients, W the angular velocity of the top, h the momentum of a rotor, P the vertical, c the
 * lever arm (taylor.h), O the angular velocity of the support, G the effective gravity, and the
 * unit vector a the apex (series.h); the a_i are numbers. The v_i are orthogonal with respect to
 * both A and D, and 1 <= |v_i| < 2. U = W - O is the sum of the two or three u_i v_i:
 *     u_i' = <A v_i, X - O'> / a_i - d_i u_i,   a_i = <v_i, A v_i>,   d_i = <v_i, D v_i> / a_i,
 *     A X = (AW + h) x W + G P x c
 * X is the angular acceleration without damping. While the top slides with dry friction, A X also
 * contains the friction torque. In general, the v_i are the principal axes. While friction holds
 * the top, U and the two v_i are perpendicular to a. The friction torque is then along a, with the
 * component <a, A (W' - X) + D U>, and does not change the u_i. */

/* The directions v_i, and a set of strongly damped ones. Rates are in internal units (method.h). */
typedef struct slow_directions {
    int count, is_held;             /* number of directions; 1 if friction holds the top */
    dd v[3][3], dual[3][3];         /* v_i and A v_i / a_i */
    dd drag[3];                     /* d_i */
    double ease[3], couple[3][3];   /* 1 / a_i; <v_i, h x v_k> / a_i (h: rotor) */
    dd moment[3], load[2];          /* A a and <a, D v_i>, if friction holds the top */
    const kr_support_ops *supports; /* NULL: the series has no terms of a support */
    int has_rotor, turns, shakes, slides;
    double shaking; /* rate at which the support shakes */
    int is_slow[3]; /* 1 if damping about the direction is strong */
    /* rate: largest on the slow manifold; fall: largest of falling over or of shaking */
    double rate, fall;
    /* A rotor couples the directions. A steady torque that causes u_k = 1 without a rotor causes
     * u_i = gain[i][k] with the rotor. Without a rotor, `gain` is the unit matrix. */
    double gain[3][3];
} slow_directions;

/* Damping about a set of directions is strong if its rates d_i are more than STRONG times the rates
 * of the undamped motion, of the damping about other directions and of a rotor (bound_rotor_rate).
 * If the set contains all directions, the smaller factor STRONG_ALONE replaces STRONG. */
#define STRONG 256.0
#define STRONG_ALONE 32.0

static kr_vec3 high_words(const dd v[3]) { return v3(v[0].hi, v[1].hi, v[2].hi); }
/* Returns <a, M b> for the diagonal matrix M. */
static dd bilinear_form(vec_dd a, vec_dd M, vec_dd b) { return vdd_dot(vdd_times(M, a), b); }
static vec_dd normalize_by_inertia(vec_dd v, vec_dd A)
{
    return vdd_scale(dd_div(dd_of(1.0), dd_sqrt(bilinear_form(v, A, v))), v);
}
static vec_dd combine_vectors(dd c, vec_dd a, dd s, vec_dd b)
{
    return vdd_add(vdd_scale(c, a), vdd_scale(s, b));
}
/* Replaces v[0] and v[1] by linear combinations for which <v[0], D v[1]> = 0 (Jacobi rotation). */
static void diagonalize_damping(vec_dd v[2], vec_dd D)
{
    const dd cross = bilinear_form(v[0], D, v[1]),
             apart = dd_sub(bilinear_form(v[1], D, v[1]), bilinear_form(v[0], D, v[0]));
    if (!(fabs(cross.hi) > 0.0)) return;
    const dd slope = dd_div(apart, dd_scale(2.0, cross)), one = dd_of(1.0),
             root = dd_sqrt(dd_add(dd_mul(slope, slope), one)),
             sum = slope.hi < 0.0 ? dd_sub(slope, root) : dd_add(slope, root),
             tangent = fabs(sum.hi) < INFINITY ? dd_div(one, sum) : dd_of(0.0),
             c = dd_div(one, dd_sqrt(dd_add(dd_mul(tangent, tangent), one))),
             s = dd_mul(c, tangent);
    const vec_dd before = v[0];
    v[0] = combine_vectors(c, v[0], dd_neg(s), v[1]);
    v[1] = combine_vectors(c, v[1], s, before);
}
static void set_rotor_coupling(slow_directions *slow, kr_vec3 rotor)
{
    slow->has_rotor = v_largest(rotor) > 0.0;
    for (int i = 0; i < slow->count && slow->has_rotor; i++)
        for (int k = 0; k < slow->count; k++)
            slow->couple[i][k] = slow->ease[i] * v_dot(high_words(slow->v[i]),
                                                       v_cross(rotor, high_words(slow->v[k])));
}
static void set_principal_directions(const kr_motion *motion, slow_directions *slow)
{
    slow->count = 3;
    for (int i = 0; i < 3; i++) slow->v[i][i] = slow->dual[i][i] = dd_of(1.0);
    vdd_put(slow->drag, vdd_over(vdd_of(motion->damping), motion->body->inertia));
    v_put(slow->ease, v_over(v3(1.0, 1.0, 1.0), motion->inertia));
    set_rotor_coupling(slow, motion->rotor);
}
void kr_slow_find_held(const kr_motion *motion, slow_directions *slow)
{
    const kr_series *s = taylor_of(motion)->series;
    const vec_dd A = motion->body->inertia, D = vdd_of(motion->damping),
                 apex = v_dd(v_of(s[0].apex + 1), v_of(s[1].apex + 1));
    const double x = fabs(apex.x.hi), y = fabs(apex.y.hi), z = fabs(apex.z.hi),
                 least = fmin(x, fmin(y, z));
    const kr_vec3 axis = v3(x == least, x != least && y == least, x != least && y != least);
    const vec_dd e = vdd_of(axis);
    vec_dd v[2] = {combine_vectors(dd_of(1.0), e, dd_neg(vdd_dot(e, apex)), apex),
                   vdd_cross(e, apex)};
    v[0] = normalize_by_inertia(v[0], A);
    v[1] = combine_vectors(dd_of(1.0), v[1], dd_neg(bilinear_form(v[0], A, v[1])), v[0]);
    v[1] = normalize_by_inertia(v[1], A);
    diagonalize_damping(v, D);
    slow->count = 2;
    slow->is_held = 1;
    vdd_put(slow->moment, vdd_times(A, apex));
    for (int i = 0; i < 2; i++) {
        const double size = ldexp(1.0, ilogb(v_length(vdd_high(v[i]))));
        const vec_dd own = vdd_scale_exactly(1.0 / size, v[i]);
        vdd_put(slow->v[i], own);
        vdd_put(slow->dual[i], vdd_scale_exactly(size, vdd_times(A, v[i])));
        slow->drag[i] = bilinear_form(v[i], D, v[i]);
        slow->ease[i] = size * size;
        slow->load[i] = bilinear_form(apex, D, own);
    }
    set_rotor_coupling(slow, motion->rotor);
}

static void invert_matrix(double m[3][3], double inverse[3][3])
{
    double sum = 0.0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
            inverse[j][i] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
        }
    for (int i = 0; i < 3; i++) sum += m[0][i] * inverse[i][0];
    for (int i = 0; i < 9; i++) inverse[i / 3][i % 3] /= sum;
}
/* Sets slow->gain to the inverse of the matrix 1 - couple[i][k] / d_i (i, k: strongly damped). */
static void set_rotor_gain(slow_directions *slow)
{
    double m[3][3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            const int both = slow->has_rotor && slow->is_slow[i] && slow->is_slow[k];
            m[i][k] = (i == k) - (both ? slow->couple[i][k] / slow->drag[i].hi : 0.0);
        }
    invert_matrix(m, slow->gain);
}
/* Returns the largest rate, over weakly damped u_i and all u_k, at which a rotor couples both. With
 * C = slow->couple, it is sqrt|C_ik C_ki| if u_k is weakly damped, else |C_ik C_ki| / d_k. */
static double bound_rotor_rate(const slow_directions *slow)
{
    double most = 0.0;
    for (int i = 0; i < slow->count && slow->has_rotor; i++)
        for (int k = 0; k < slow->count && !slow->is_slow[i]; k++) {
            const double square = fabs(slow->couple[i][k] * slow->couple[k][i]);
            most = fmax(most, slow->is_slow[k] ? square / slow->drag[k].hi : sqrt(square));
        }
    return most;
}
/* Marks all directions as strongly damped, except for the `weak_count` ones with the weakest
 * damping. Returns 1, and sets slow->gain, if their damping is strong (STRONG), else 0. Sets the
 * rates slow->rate and slow->fall from bounds on the undamped rates and the torques. */
static int try_strong_directions(slow_directions *slow, int weak_count, double undamped_rate,
                                 double most_torque)
{
    double others = undamped_rate, weakest = INFINITY, creep = 0.0;
    slow->fall = slow->shaking;
    for (int i = 0; i < slow->count; i++) {
        const double d = slow->drag[i].hi, torque = most_torque * slow->ease[i];
        int weaker = 0;
        for (int k = 0; k < slow->count; k++)
            weaker += slow->drag[k].hi < d || (slow->drag[k].hi == d && k < i);
        slow->is_slow[i] = weaker >= weak_count;
        if (slow->is_slow[i]) {
            weakest = fmin(weakest, d);
            creep = fmax(creep, torque / d);
        } else {
            others = fmax(others, d);
            slow->fall = fmax(slow->fall, sqrt(torque));
        }
    }
    slow->fall = fmax(slow->fall, creep);
    others = fmax(others, bound_rotor_rate(slow));
    slow->rate = 2.0 * creep + (weak_count > 0 ? 2.0 * others : slow->shaking);
    if (!(weakest > (weak_count > 0 ? STRONG : STRONG_ALONE) * others)) return 0;
    set_rotor_gain(slow);
    return 1;
}
