/* Strongly damped motion of a top that friction holds. Private to slow.c. The angular velocity of
 * the top relative to the support is perpendicular to the apex a, and equals v_0 u_0 + v_1 u_1. The
 * directions v_i are orthonormal with respect to the moments of inertia A, and orthogonal with
 * respect to the damping D. In the notation of slow.c, the velocities u_i satisfy
 *     u_i' = <A v_i, X - O x U> - d_i u_i,   A X = (AW + h) x W + G P x c,   d_i = <v_i, D v_i>
 * The friction torque is along the apex and does not affect these equations. It follows from
 *     torque = <a, A (W' - X) + D U>
 * Damping is strong about a direction v_i instead of a principal axis. */

/* Directions perpendicular to the apex vector, in ascending order of their damping rates d_i. All
 * rates are expressed in the motion's unit of time. */
struct held_directions {
    dd v[2][3], weight[2][3]; /* v_i and A v_i */
    dd drag[2][2];    /* <v_i, D v_k>, where the two values for i != k are rounding errors */
    dd load[2];       /* <a, D v_i> */
    dd moment[3];     /* A a */
    double couple;    /* <v_0, h x v_1>: how the rotor couples the two directions */
    double square[2]; /* <v_i, v_i> */
};

static dd bilinear_form(const dd a[3], const dd factors[3], const dd b[3])
{
    dd sum = dd_of(0.0);
    for (int j = 0; j < 3; j++) sum = dd_add(sum, dd_mul(dd_mul(factors[j], a[j]), b[j]));
    return sum;
}
/* Replaces a by the linear combination `c` a + `s` b. */
static void combine_vectors(dd a[3], dd c, const dd b[3], dd s)
{
    for (int j = 0; j < 3; j++) a[j] = dd_add(dd_mul(c, a[j]), dd_mul(s, b[j]));
}
static void normalize_moment(dd v[3], const dd A[3])
{
    const dd per_size = dd_div(dd_of(1.0), dd_sqrt(bilinear_form(v, A, v)));
    for (int j = 0; j < 3; j++) v[j] = dd_mul(per_size, v[j]);
}
/* Rotates the directions v_0 and v_1 such that <v_0, D v_1> vanishes (Jacobi rotation). */
static void diagonalize_damping(dd v[2][3], const dd D[3])
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
    dd before[3];
    memcpy(before, v[0], sizeof before);
    combine_vectors(v[0], c, v[1], dd_neg(s));
    combine_vectors(v[1], c, before, s);
}
/* Computes two vectors that are perpendicular to the apex vector. */
static void set_directions(dd v[2][3], const dd apex[3], const dd A[3], const dd D[3])
{
    int k = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(apex[i].hi) < fabs(apex[k].hi)) k = i;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, m = (i + 2) % 3;
        v[0][i] = dd_sub(dd_of(i == k), dd_mul(apex[k], apex[i]));
        v[1][i] = i == k ? dd_of(0.0) : j == k ? dd_neg(apex[m]) : apex[j];
    }
    normalize_moment(v[0], A);
    combine_vectors(v[1], dd_of(1.0), v[0], dd_neg(bilinear_form(v[0], A, v[1])));
    normalize_moment(v[1], A);
    diagonalize_damping(v, D);
    if (!dd_less(bilinear_form(v[1], D, v[1]), bilinear_form(v[0], D, v[0]))) return;
    for (int j = 0; j < 3; j++) {
        const dd other = v[0][j];
        v[0][j] = v[1][j];
        v[1][j] = other;
    }
}
static void find_held_directions(const kr_motion *motion, held_directions *held)
{
    const kr_series *s = taylor_of(motion)->series;
    const vec_dd moments = motion->body->inertia;
    const kr_vec3 damping = motion->damping;
    const dd A[3] = {moments.x, moments.y, moments.z},
             D[3] = {dd_of(damping.x), dd_of(damping.y), dd_of(damping.z)};
    dd apex[3];
    for (int j = 0; j < 3; j++) {
        apex[j] = dd_make(s[0].apex[j + 1], s[1].apex[j + 1]);
        held->moment[j] = dd_mul(A[j], apex[j]);
    }
    set_directions(held->v, apex, A, D);
    kr_vec3 high[2];
    for (int i = 0; i < 2; i++) {
        const dd *v = held->v[i];
        for (int j = 0; j < 3; j++) held->weight[i][j] = dd_mul(A[j], v[j]);
        for (int k = 0; k < 2; k++) held->drag[i][k] = bilinear_form(v, D, held->v[k]);
        held->load[i] = bilinear_form(apex, D, v);
        high[i] = v3(v[0].hi, v[1].hi, v[2].hi);
        held->square[i] = v_dot(high[i], high[i]);
    }
    held->couple = v_dot(high[0], v_cross(motion->rotor, high[1]));
}
static int take_held_directions(const kr_motion *motion, int least, double undamped, double pull,
                                slow_axes *slow)
{
    const held_directions *held = slow->held;
    const double d[2] = {held->drag[0][0].hi, held->drag[1][1].hi}, couple = held->couple,
                 turned = couple * couple / d[1], *square = held->square,
                 others = least > 0 ? fmax(undamped, fmax(d[0], turned)) : undamped;
    slow->rate = least > 0 ? 2.0 * others : slow->fall;
    for (int i = 0; i < 2; i++) {
        slow->is_slow[i] = i >= least;
        const double falls = i < least ? sqrt(pull * square[i]) : pull * square[i] / d[i];
        slow->fall = fmax(slow->fall, falls);
        if (least == 0) slow->rate += 2.0 * falls;
    }
    slow->is_slow[2] = 0;
    if (!(d[least] > (least > 0 ? STRONG : STRONG_ALONE) * others)) return 0;
    (void)motion;
    memset(slow->gain, 0, sizeof slow->gain);
    const double part = least > 0 ? 0.0 : 1.0 / (d[0] * d[1] + couple * couple);
    slow->gain[0][0] = part * d[0] * d[1];
    slow->gain[0][1] = part * couple * d[1];
    slow->gain[1][0] = -part * couple * d[0];
    slow->gain[1][1] = least > 0 ? 1.0 : part * d[0] * d[1];
    return 1;
}

static kr_vec3 high_words(const dd v[3]) { return v3(v[0].hi, v[1].hi, v[2].hi); }
/* Returns the angular velocity without its strongly damped components. */
static kr_vec3 velocity_without_slow(const kr_series *s, const slow_axes *slow)
{
    const kr_vec3 O = v_of(s->turn + 1), U = v_sub(v_of(s->end_w + 1), O);
    kr_vec3 sum = O;
    for (int i = 0; i < 2; i++)
        if (!slow->is_slow[i])
            sum = v_axpy(v_dot(high_words(slow->held->weight[i]), U), high_words(slow->held->v[i]),
                         sum);
    return sum;
}
/* Returns the damping rate d_i along direction i, which is perpendicular to the axis of the top, in
 * the time unit of the Taylor series. */
static double held_drag(const kr_series *s, const slow_axes *slow, int i)
{
    double sum = 0.0;
    for (int j = 0; j < 3; j++)
        sum -= slow->held->v[i][j].hi * s->drag[j + 1] * slow->held->weight[i][j].hi;
    return sum;
}
/* Returns an upper bound on the velocity along a strongly damped direction. */
static double bound_held_velocity(const kr_series *s, const slow_axes *slow, int direction)
{
    const double *p = s->end_x + 5, most = largest_pull(s);
    double own[3], turn[3], size = 0.0;
    v_put(own, velocity_without_slow(s, slow));
    v_put(turn, v_cross(v_of(s->turn + 1), v_of(own)));
    for (int k = 0; k < 2; k++) {
        double torque = 0.0;
        if (!slow->is_slow[k] || slow->gain[direction][k] == 0.0) continue;
        for (int j = 0; j < 3; j++) {
            const int i = j + 1, next = (j + 1) % 3, prev = (j + 2) % 3;
            const double rotor = s->shift[i] * own[next] + s->shift[i + 4] * own[prev];
            torque += fabs(slow->held->weight[k][j].hi) *
                      (most * (fabs(s->up[i] * p[next]) + fabs(s->down[i] * p[prev])) +
                       fabs(s->k[i]) * (fabs(own[next] * own[prev]) + fabs(rotor)) + fabs(turn[j]));
        }
        size += fabs(slow->gain[direction][k]) * torque / held_drag(s, slow, k);
    }
    return size;
}
/* Returns the magnitude of the angular velocity on the slow manifold. */
static double held_velocity_size(const kr_series *s, const slow_axes *slow)
{
    double size = v_largest(velocity_without_slow(s, slow));
    for (int i = 0; i < 2; i++)
        if (slow->is_slow[i])
            size = fmax(size, sqrt(slow->held->square[i]) * bound_held_velocity(s, slow, i));
    return size;
}
/* Returns the smallest nonzero velocity along any strongly damped direction, or a negligible
 * velocity if that is larger. Velocities along damped directions are computed from W, so their
 * rounding errors are proportional to the largest component of W. */
static double least_held_size(const kr_series *s, const slow_axes *slow)
{
    const double size = held_velocity_size(s, slow), most = v_largest(v_of(s->end_w + 1));
    double least = 1.0;
    for (int i = 0; i < 2; i++)
        if (slow->is_slow[i] && bound_held_velocity(s, slow, i) > 0.0)
            least = fmin(least, bound_held_velocity(s, slow, i));
    least = fmin(fmax(least, NEGLIGIBLE * most), fmax(most, size));
    return fmax(fmax(least, ROUNDED * size), TINY_VELOCITY);
}
/* Returns 1 if the motion of a held top is close to the slow manifold. */
static int is_held_near(const kr_series *s, const slow_axes *slow, double noise, double share)
{
    (void)share;
    const kr_vec3 O = v_of(s->turn + 1), W = v_of(s->end_w + 1),
                  rate = v_sub(slow->supports->acceleration(s), v_cross(O, W));
    double off[2];
    for (int i = 0; i < 2; i++)
        off[i] = v_dot(high_words(slow->held->weight[i]), rate) / held_drag(s, slow, i);
    for (int i = 0; i < 2; i++) {
        double change = 0.0;
        for (int k = 0; k < 2; k++)
            if (slow->gain[i][k] != 0.0) change += slow->gain[i][k] * off[k];
        if (slow->is_slow[i] && fabs(change) > fmax(0.25 * bound_held_velocity(s, slow, i), noise))
            return 0;
    }
    return 1;
}
