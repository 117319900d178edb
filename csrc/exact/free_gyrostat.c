/* Set-up of the closed form of a free gyrostat: a torque-free body with rotors along any axis
 * (Zhukovsky, Volterra). This file is compiled once for each instruction set, because double-double
 * products are three times as fast with fused multiply-add.
 *
 * All vectors have components along the principal axes of the body. Let J be the principal moments,
 * A = diag(1/J), h the momentum of the rotors, m the angular momentum and W the angular velocity:
 *     m' = m x W,   W = A (m - h).
 * The attitude (body -> space) is a product q0 R S: a constant rotation q0, the rotation R about a
 * constant unit vector a by the angle phi, and the shortest rotation S from m to |m| a, with
 *     phi' = (2 E + W.(h + |m| a)) / (|m| + m.a),   2 E = W.(m - h).
 * First, the period T of m is computed in double precision. A Taylor series in double-doubles over
 * this time gives a more accurate T, the growth Om T of phi in a period, and samples of m and phi.
 * The samples determine two Fourier series X and Y in theta = 2 pi t/T. If (w, x, y, z) is the
 * quaternion of R S in axes whose third axis is a,
 *     (X, Y) = sqrt(D) e^{-i Om t/2} (w + i z, x + i y)
 * with a periodic D(t) > 0 that removes the poles of X and Y at complex t: few terms suffice. */
#include "torus.h"

enum {
    LAST_DEEP = 20,   /* the last Taylor coefficient that is needed in double-doubles */
    LAST = 36,        /* the last Taylor coefficient */
    LAST_ROUGH = 18,  /* the last one of the series in doubles */
    MOST_STEPS = 400, /* of the Taylor series; more are needed only near separatrices */
    SAMPLES = 128,    /* in a period */
    DIRECTIONS = 27   /* of a: all vectors with components -1, 0 and 1 */
};
/* A gyrostat in internal units. */
typedef struct gyrostat {
    dd rate[3], bend[3]; /* A; A3 - A2, and cyclic permutations */
    dd h[3], rest[3];    /* h, A h */
    dd start[3], size;   /* m at the initial time, |m| */
    dd axis[3], up[3];   /* a, A (h + |m| a) */
    dd energy;           /* 2 E - A h.(h + |m| a) */
    dd period;           /* T, as far as it is known */
} gyrostat;
/* Taylor coefficients hi + lo of m (0 to 2), phi' and |m| + m.a. Above order `deep`, lo is 0. */
enum { ANGLE_RATE = 3, BELOW, UNKNOWNS };
typedef struct gyrostat_series {
    int deep;
    double hi[UNKNOWNS][LAST + 1], lo[UNKNOWNS][LAST + 1];
} gyrostat_series;
typedef struct gyrostat_memory {
    kr_gyrostat_plan plan;
    gyrostat top;
    gyrostat_series series;
    dd growth; /* of phi in the time T */
    /* values at the times k T / SAMPLES; `sample` holds X and Y (set_spinor_samples) */
    kr_vec3 m[SAMPLES];
    dd phi[SAMPLES];
    double log_d[SAMPLES], sample[SAMPLES][4], cosine[SAMPLES], sine[SAMPLES];
} gyrostat_memory;

static kr_vec3 v_round(const dd v[3]) { return v3(v[0].hi, v[1].hi, v[2].hi); }
static kr_vec3 find_angular_velocity(const gyrostat *top, kr_vec3 m)
{
    return v_sub(v_times(v_round(top->rate), m), v_round(top->rest));
}
static kr_vec3 find_momentum_rate(const gyrostat *top, kr_vec3 m)
{
    return v_cross(m, find_angular_velocity(top, m));
}
static double find_attitude_angle_rate(const gyrostat *top, kr_vec3 m)
{
    return (top->energy.hi + v_dot(v_round(top->up), m)) /
           (top->size.hi + v_dot(v_round(top->axis), m));
}
static dd get_coefficient(const gyrostat_series *s, int series, int order)
{
    return dd_make(s->hi[series][order], s->lo[series][order]);
}
static void set_coefficient(gyrostat_series *s, int series, int order, dd value)
{
    s->hi[series][order] = value.hi;
    s->lo[series][order] = order > s->deep ? 0.0 : value.lo;
}
/* Returns the coefficient of order n of the product of two series in `s`, with the indices `a` and
 * `b` (not the vector a). Coefficients of series `a` below the order `first` count as zero. */
static dd product_coefficient(const gyrostat_series *s, int a, int b, int first, int n)
{
    dd sum = dd_of(0.0);
    for (int i = first; i <= n && n >= s->deep; i++) sum.hi += s->hi[a][i] * s->hi[b][n - i];
    for (int i = first; i <= n && n < s->deep; i++) {
        const double x = s->hi[a][i], y = s->hi[b][n - i];
        const dd p = two_product(x, y), t = two_sum(sum.hi, p.hi);
        sum = dd_make(t.hi, sum.lo + (t.lo + p.lo + (x * s->lo[b][n - i] + s->lo[a][i] * y)));
    }
    return two_sum_ordered(sum.hi, sum.lo);
}
/* Writes to `s` the Taylor series of m with the initial value `m`, up to the order `last`. If
 * `with_angle` is 1, also writes the series of phi' and of |m| + m.a (order last - 1). Returns the
 * longest time for which the last two terms of m / |m| (and of phi) are at most `tol`. */
static double expand_momentum_and_angle(const gyrostat *top, gyrostat_series *s, const dd m[3],
                                        int with_angle, int last, double tol)
{
    double step = INFINITY;
    for (int i = 0; i < 3; i++) set_coefficient(s, i, 0, m[i]);
    for (int n = 0; n < last; n++) {
        dd over = n == 0 ? top->energy : dd_of(0.0), below = n == 0 ? top->size : dd_of(0.0);
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            const dd linear = dd_sub(dd_mul(top->rest[j], get_coefficient(s, k, n)),
                                     dd_mul(top->rest[k], get_coefficient(s, j, n))),
                     square = dd_mul(top->bend[i], product_coefficient(s, j, k, 0, n));
            set_coefficient(s, i, n + 1,
                            dd_div_fast(dd_add_sloppy(square, linear), dd_of(n + 1.0)));
            if (!with_angle) continue;
            over = dd_add_sloppy(over, dd_mul(top->up[i], get_coefficient(s, i, n)));
            below = dd_add_sloppy(below, dd_mul(top->axis[i], get_coefficient(s, i, n)));
        }
        if (!with_angle) continue;
        set_coefficient(s, BELOW, n, below);
        over = dd_sub(over, product_coefficient(s, BELOW, ANGLE_RATE, 1, n));
        set_coefficient(s, ANGLE_RATE, n, dd_div_fast(over, get_coefficient(s, BELOW, 0)));
    }
    for (int i = 0; i < (with_angle ? 4 : 3); i++)
        for (int n = last - 1; n <= last; n++) {
            const double size =
                i < 3 ? fabs(s->hi[i][n]) / top->size.hi : fabs(s->hi[ANGLE_RATE][n - 1]) / n;
            if (size > 0.0) step = fmin(step, pow(tol / size, 1.0 / n));
        }
    return step;
}
static kr_vec3 evaluate_momentum(const gyrostat_series *s, int last, double t)
{
    kr_vec3 m = v3(0.0, 0.0, 0.0);
    for (int n = last; n >= 0; n--) m = v_axpy(t, m, v3(s->hi[0][n], s->hi[1][n], s->hi[2][n]));
    return m;
}
static double find_frequency_square(const gyrostat *top, kr_vec3 equilibrium)
{
    const kr_vec3 a = v_round(top->rate), w = find_angular_velocity(top, equilibrium),
                  am = v_times(a, equilibrium);
    return v_dot(v_times(equilibrium, equilibrium), v3(a.y * a.z, a.z * a.x, a.x * a.y)) +
           v_dot(w, v_add(w, am)) - v_dot(w, equilibrium) * (a.x + a.y + a.z);
}
static kr_vec3 get_axis_candidate(int d) { return v3(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1); }
/* Sets the unit vector a, and the members of `top` that depend on it. least_component[d] is the
 * minimum over a period of the component of m along the candidate d (get_axis_candidate). The
 * direction of a is the candidate with the largest minimum. */
static void set_best_axis(gyrostat *top, const double least_component[DIRECTIONS])
{
    int best = 0;
    for (int d = 1; d < DIRECTIONS; d++)
        if (least_component[d] > least_component[best]) best = d;
    const kr_vec3 v = get_axis_candidate(best);
    const dd a[3] = {dd_of(v.x), dd_of(v.y), dd_of(v.z)}, length = dd_sqrt(dd_dot(a, a));
    top->energy = dd_of(0.0);
    for (int i = 0; i < 3; i++) {
        top->axis[i] = dd_div(a[i], length);
        const dd arm = dd_add(top->h[i], dd_mul(top->size, top->axis[i])),
                 w = dd_sub(dd_mul(top->rate[i], top->start[i]), top->rest[i]);
        top->up[i] = dd_mul(top->rate[i], arm);
        top->energy = dd_add(top->energy, dd_sub(dd_mul(w, dd_sub(top->start[i], top->h[i])),
                                                 dd_mul(top->rest[i], arm)));
    }
}
/* Sets the vector a and, in double precision, the period T. If m is near an equilibrium, T is the
 * period of small oscillations. Otherwise, T is the time until m returns to its initial value m0: a
 * zero of the component of m - m0 along the initial rate of m. Returns 1, or 0 if m does not return
 * within MOST_STEPS steps of the Taylor series, as near separatrices. */
static int find_axis_and_period(gyrostat *top, gyrostat_series *s)
{
    const kr_vec3 start = v_round(top->start), along = find_momentum_rate(top, start);
    const double square = find_frequency_square(top, start);
    const int is_small = square > 0.0 && v_length(along) < 1e-4 * (top->size.hi * sqrt(square));
    double least[DIRECTIONS], t = 0.0, far = 0.0;
    kr_vec3 m = start;
    int has_returned = is_small;
    for (int d = 0; d < DIRECTIONS; d++) least[d] = d == DIRECTIONS / 2 ? -INFINITY : INFINITY;
    if (is_small) top->period = dd_of(two_pi / sqrt(square));
    s->deep = 0;
    for (int steps = 0; steps < MOST_STEPS; steps++) {
        for (int d = 0; d < DIRECTIONS; d++)
            least[d] = fmin(least[d], v_dot(v_unit(get_axis_candidate(d)), m));
        if (has_returned) break;
        const dd here[3] = {dd_of(m.x), dd_of(m.y), dd_of(m.z)};
        const double step = expand_momentum_and_angle(top, s, here, 0, LAST_ROUGH, 1e-14);
        if (!(step < INFINITY)) return 0;
        const double before = v_dot(v_sub(m, start), along);
        const kr_vec3 next = evaluate_momentum(s, LAST_ROUGH, step);
        const double after = v_dot(v_sub(next, start), along);
        if (before < 0.0 && after >= 0.0) {
            double x = step * (before / (before - after));
            for (int k = 0; k < 8; k++) {
                m = evaluate_momentum(s, LAST_ROUGH, x);
                x -= v_dot(v_sub(m, start), along) / v_dot(find_momentum_rate(top, m), along);
                x = fmin(fmax(x, 0.0), step);
            }
            has_returned = v_length(v_sub(m, start)) < 1e-3 * far;
            top->period = dd_of(t + x);
        }
        m = next;
        t += step;
        far = fmax(far, v_length(v_sub(m, start)));
    }
    set_best_axis(top, least);
    return has_returned;
}
/* Integrates m and phi over the approximate period. Adds to top->period the time that m then still
 * needs to return to its initial value. For this corrected period, writes samples of m and phi, and
 * the growth of phi. Returns |correction| / period, or infinity if m does not return. */
static double integrate_and_correct_period(gyrostat_memory *memory)
{
    gyrostat *top = &memory->top;
    gyrostat_series *s = &memory->series;
    dd m[3] = {top->start[0], top->start[1], top->start[2]}, phi = dd_of(0.0), t = dd_of(0.0);
    const dd period = dd_of(top->period.hi);
    s->deep = LAST_DEEP;
    for (int steps = 0, k = 0; t.hi < period.hi; steps++) {
        if (steps == MOST_STEPS) return INFINITY;
        const double step = expand_momentum_and_angle(top, s, m, 1, LAST, 1e-32);
        const dd left = dd_sub(period, t);
        const int is_last = !(step < left.hi);
        const dd x = is_last ? left : dd_of(step);
        for (; k < SAMPLES; k++) {
            const double here = (period.hi * (k / (double)SAMPLES) - t.hi) - t.lo;
            if (here > x.hi) break;
            memory->m[k] = evaluate_momentum(s, LAST, here);
            double sum = 0.0;
            for (int n = LAST - 1; n > 0; n--)
                sum = here * (sum + s->hi[ANGLE_RATE][n] / (n + 1.0));
            memory->phi[k] = dd_add(dd_add(phi, dd_times(here, get_coefficient(s, ANGLE_RATE, 0))),
                                    dd_of(here * sum));
        }
        for (int i = 0; i < 4; i++) {
            dd sum = dd_of(0.0);
            for (int n = i < 3 ? LAST : LAST - 1; n >= 0; n--) {
                const dd c = get_coefficient(s, i, n);
                sum = dd_add_sloppy(dd_mul(sum, x), i < 3 ? c : dd_div_fast(c, dd_of(n + 1.0)));
            }
            if (i < 3)
                m[i] = sum;
            else
                phi = dd_add(phi, dd_mul(x, sum));
        }
        t = is_last ? period : dd_add(t, x);
    }
    const kr_vec3 along = find_momentum_rate(top, v_round(top->start));
    const double speed = v_length(along);
    dd miss[3], late = dd_of(0.0);
    for (int i = 0; i < 3; i++) {
        miss[i] = dd_sub(top->start[i], m[i]);
        const double part = i == 0 ? along.x : i == 1 ? along.y : along.z;
        if (speed > 0.0) late = dd_add(late, dd_times(part / speed / speed, miss[i]));
    }
    top->period = dd_add(period, late);
    memory->growth =
        dd_add(phi, dd_times(find_attitude_angle_rate(top, v_round(top->start)), late));
    for (int k = 0; k < SAMPLES; k++) {
        const double by = late.hi * (k / (double)SAMPLES);
        memory->phi[k] =
            dd_add(memory->phi[k], dd_of(by * find_attitude_angle_rate(top, memory->m[k])));
        memory->m[k] = v_axpy(by, find_momentum_rate(top, memory->m[k]), memory->m[k]);
    }
    const double beside = v_length(v_sub(v_round(miss), v_scale(late.hi, along)));
    return beside < 1e-10 * top->size.hi ? fabs(late.hi) / period.hi : INFINITY;
}
/* Writes to `out` the real and imaginary parts of the Fourier coefficients of e^{i n theta} of two
 * complex functions, sampled in memory->sample. Returns the sum of the magnitudes of all parts. */
static double find_fourier_coefficient(const gyrostat_memory *memory, int n, double out[4])
{
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    for (int k = 0; k < SAMPLES; k++) {
        const int at = (n + SAMPLES) * k % SAMPLES;
        const double c = memory->cosine[at], s = memory->sine[at], *z = memory->sample[k];
        for (int i = 0; i < 4; i += 2) {
            sum[i] += z[i] * c + z[i + 1] * s;
            sum[i + 1] += z[i + 1] * c - z[i] * s;
        }
    }
    for (int i = 0; i < 4; i++) out[i] = sum[i] / SAMPLES;
    return fabs(out[0]) + fabs(out[1]) + fabs(out[2]) + fabs(out[3]);
}
/* Writes samples of ln D (opening comment) to memory->log_d, from the Fourier series of the second
 * time derivative of ln D. With d = m - h and B = A - tr(A)/3, this derivative is
 *     |B d|^2 - m.(tr(A) B/3 - B^2) h
 * minus the average of this expression over a period. For a nearly spherical body, B is small, and
 * nothing cancels. Returns a bound on max ln D - min ln D, or infinity if SAMPLES is too small. */
static double set_log_norm_and_bound_range(gyrostat_memory *memory)
{
    const gyrostat *top = &memory->top;
    const kr_vec3 a = v_round(top->rate), bend = v_round(top->bend), h = v_round(top->h),
                  b = v_scale(1.0 / 3.0, v3(bend.y - bend.z, bend.z - bend.x, bend.x - bend.y)),
                  c = v_times(v_sub(v_scale((a.x + a.y + a.z) / 3.0, b), v_times(b, b)), h);
    const double turn = top->period.hi / two_pi;
    memset(memory->sample, 0, sizeof memory->sample);
    for (int k = 0; k < SAMPLES; k++) {
        const kr_vec3 d = v_times(b, v_sub(memory->m[k], h));
        memory->sample[k][0] = turn * turn * (v_dot(d, d) - v_dot(memory->m[k], c));
        memory->log_d[k] = 0.0;
    }
    double largest = 0.0, total = 0.0;
    for (int n = 1, small = 0; small < 3; n++) {
        double f[4];
        if (n == SAMPLES / 2) return INFINITY;
        const double scale = -2.0 / (n * n),
                     size = find_fourier_coefficient(memory, n, f) / (n * n);
        for (int k = 0; k < SAMPLES; k++) {
            const int at = n * k % SAMPLES;
            memory->log_d[k] += scale * (f[0] * memory->cosine[at] - f[1] * memory->sine[at]);
        }
        largest = fmax(largest, size);
        total += size;
        small = size <= 1e-17 + 1e-16 * largest ? small + 1 : 0;
    }
    return 4.0 * total;
}
/* Writes samples of X and Y (opening comment) to memory->sample. `tilt` rotates the principal axes
 * to the axes in which R S has the components (w, x, y, z); the third of these axes is a. */
static void set_spinor_samples(gyrostat_memory *memory, kr_quat tilt)
{
    for (int k = 0; k < SAMPLES; k++) {
        const kr_vec3 n = v_unit(q_turn_back(tilt, memory->m[k]));
        const dd mean = dd_times(k / (double)SAMPLES, memory->growth);
        const double half = 0.5 * dd_sub(memory->phi[k], mean).hi, c = cos(half), s = sin(half),
                     root = exp(0.5 * memory->log_d[k]) / sqrt(2.0 * (1.0 + n.z));
        const double spinor[4] = {c * (1.0 + n.z), s * (1.0 + n.z), c * n.y + s * n.x,
                                  s * n.y - c * n.x};
        for (int i = 0; i < 4; i++) memory->sample[k][i] = root * spinor[i];
    }
}
/* Writes the significant coefficients of X and Y to the plan. Returns 0 if there are too many. */
static int set_plan_coefficients(gyrostat_memory *memory)
{
    enum { HIGHEST = GYROSTAT_TERMS / 2, COUNTED = 2 * HIGHEST + 1 };
    double all[COUNTED][4], size[COUNTED];
    int peak = 0;
    for (int i = 0; i < COUNTED; i++) {
        size[i] = find_fourier_coefficient(memory, i - HIGHEST, all[i]);
        peak = size[i] > size[peak] ? i : peak;
    }
    const double least = 3e-16 * size[peak]; /* a bound on rounding errors of the samples */
    int first = peak, last = peak;
    while (first > 1 && fmax(size[first - 1], size[first - 2]) > least) first--;
    while (last < COUNTED - 2 && fmax(size[last + 1], size[last + 2]) > least) last++;
    if (first <= 1 || last >= COUNTED - 2) return 0;
    memory->plan.least = first - HIGHEST;
    memory->plan.terms = last + 1 - first;
    memcpy(memory->plan.coefficient, all[first], (size_t)(last + 1 - first) * sizeof *all);
    return 1;
}
/* Computes the closed form in internal units. Writes to `tilt` a rotation of the third principal
 * axis to a, and to `certificate` the largest error of R S at some samples, at least
 * KR_TORUS_ROUNDING. Returns KR_REFUSAL_NONE, or the reason for a failure. */
static kr_refusal compute_closed_form(gyrostat_memory *memory, kr_quat *tilt, double *certificate)
{
    for (int k = 0; k < SAMPLES; k++)
        sincos_turns(dd_of(k / (double)SAMPLES), &memory->sine[k], &memory->cosine[k]);
    if (!find_axis_and_period(&memory->top, &memory->series)) return KR_REFUSAL_SEPARATRIX;
    double late = INFINITY;
    for (int tries = 0; tries < 4 && late > 1e-12; tries++) {
        late = integrate_and_correct_period(memory);
        if (!(late < 1e-3)) return KR_REFUSAL_SEPARATRIX;
    }
    *tilt = q_tilt(v_round(memory->top.axis));
    if (!(set_log_norm_and_bound_range(memory) < 9.0)) return KR_REFUSAL_SEPARATRIX;
    set_spinor_samples(memory, *tilt);
    if (!set_plan_coefficients(memory)) return KR_REFUSAL_SEPARATRIX;
    *certificate = KR_TORUS_ROUNDING;
    for (int k = 1; k < SAMPLES; k += 3) {
        const double turns = k / (double)SAMPLES, *s = memory->sample[k];
        const dd second = two_product(turns, memory->plan.least);
        const kr_quat q = gyrostat_state_at_phases(&memory->plan, 0.0, dd_of(turns), second).q,
                      sample = q_unit(q4(s[0], v3(s[2], s[3], s[1])));
        const double miss = kr_attitude_error(q, sample);
        *certificate = miss <= 1.0 ? fmax(*certificate, miss) : INFINITY;
    }
    return KR_REFUSAL_NONE;
}
static kr_status plan_scene(const kr_scene *scene, int own, double bound, void *space,
                            kr_exact_info *info)
{
    gyrostat_memory *memory = space;
    kr_gyrostat_plan *plan = &memory->plan;
    gyrostat *top = &memory->top;
    kr_units units;
    info->refusal = KR_REFUSAL_KIND;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    if (kr_scene_kind(scene) != KR_KIND_GYROSTAT || kr_scene_excludes_closed_form(scene, own))
        return KR_ERR_METHOD;
    const kr_body *body = &scene->body;
    const kr_working working = kr_body_working(body);
    status = kr_scene_units(scene, &working, &units);
    if (status != KR_OK) return status;
    const double per_moment = 1.0 / units.moment;
    const kr_vec3 m = v_scale(units.time, v_scale(per_moment, scene->start.m)),
                  rotor = v_scale(units.time, v_scale(per_moment, body->rotor));
    const kr_quat q = scene->start.q;
    dd turn[4] = {dd_of(q.w), dd_of(q.x), dd_of(q.y), dd_of(q.z)};
    const dd space_m[3] = {dd_of(m.x), dd_of(m.y), dd_of(m.z)};
    multiply_from_right(turn, body->axes);
    turn_back_dd(turn, space_m, top->start);
    top->size = dd_sqrt(dd_dot(space_m, space_m));
    info->refusal = KR_REFUSAL_ROTATION; /* without momentum, J W = -h is constant */
    if (!(top->size.hi > 1e-100)) return KR_ERR_METHOD;
    const kr_vec3 j = v_scale(per_moment, body->inertia);
    const double of_axis[3][2] = {{j.x, rotor.x}, {j.y, rotor.y}, {j.z, rotor.z}};
    for (int i = 0; i < 3; i++) {
        top->rate[i] = dd_div(dd_of(1.0), dd_of(of_axis[i][0]));
        top->h[i] = dd_of(of_axis[i][1]);
        top->rest[i] = dd_mul(top->rate[i], top->h[i]);
    }
    for (int i = 0; i < 3; i++)
        top->bend[i] = dd_sub(top->rate[(i + 2) % 3], top->rate[(i + 1) % 3]);
    memset(plan, 0, sizeof *plan);
    set_left_right_map(plan->map, q_one(),
                       q_one()); /* with which compute_closed_form evaluates R S */
    kr_quat tilt;
    info->refusal = compute_closed_form(memory, &tilt, &info->certificate);
    if (info->refusal != KR_REFUSAL_NONE) return KR_ERR_METHOD;
    const dd period = top->period,
             rates[2] = {dd_div(dd_of(1.0), period),
                         dd_div(dd_add(dd_half(dd_mul(memory->growth, turns_per_radian())),
                                       dd_of(plan->least)),
                                period)};
    const double unit = own ? 1.0 : units.time;
    for (int i = 0; i < 2; i++) {
        kr_phase *phase = &plan->torus.turn[i];
        phase->fast = rates[i].hi / unit;
        phase->slow = rates[i].lo / unit;
        set_initial_phase(phase, dd_of(0.0));
    }
    plan->torus.begin = own ? 0.0 : scene->start.t;
    plan->momentum = own ? m : scene->start.m;
    const kr_quat first = gyrostat_state_after_span(plan, 0.0, dd_of(0.0)).q,
                  left = q_mul(q_mul(round_to_unit_quaternion(turn), tilt), q_conj(first)),
                  axes = own ? working.axes : q_conj(body->axes);
    set_left_right_map(plan->map, left, q_mul(q_conj(tilt), axes));
    info->period = period.hi * unit;
    info->frequency[0] = two_pi / info->period;
    info->frequency[1] = memory->growth.hi / info->period;
    info->refusal = KR_REFUSAL_CERTIFICATE;
    if (!(info->certificate <= bound)) return KR_ERR_METHOD;
    info->refusal = KR_REFUSAL_NONE;
    return isfinite(info->frequency[0] + info->frequency[1]) ? KR_OK : KR_ERR_ARGUMENT;
}
static kr_state gyrostat_state(const void *plan, double t)
{
    return evaluate_torus(gyrostat_state_after_span, plan, t);
}
static kr_state gyrostat_state_at_angles(const void *memory, double first, double second)
{
    const kr_gyrostat_plan *plan = memory;
    const double turns = fraction_of_turns(first);
    const dd whole = two_product(turns, plan->least), half = dd_of(0.5 * fraction_of_turns(second));
    return gyrostat_state_at_phases(plan, plan->torus.begin, dd_of(turns), dd_add(whole, half));
}
static size_t used_size(const void *memory)
{
    const kr_gyrostat_plan *plan = memory;
    return offsetof(kr_gyrostat_plan, coefficient) +
           (size_t)plan->terms * sizeof *plan->coefficient;
}
const kr_exact_scalar KR_NAME(kr_gyrostat_scalar) = {
    sizeof(kr_gyrostat_plan), sizeof(gyrostat_memory), used_size, NULL, plan_scene,
    gyrostat_state,           gyrostat_state_at_angles};
