/* Set-up of the closed forms of Kowalewski and Goryachev-Chaplygin tops: their axes and units,
 * complex numbers, and averages of even periodic functions.
 *
 * Both tops have two equal principal moments of inertia. Axis 3 is the principal axis whose moment
 * differs from the other two. The centre of mass lies in the plane perpendicular to axis 3. Axis 1
 * passes through the centre of mass; its direction depends on the kind of top and on the sign of
 * gravity (torus_kind). The units are such that mass * |gravity| * |com| = 1, with the moments of
 * torus_kind. These are the axes and units of the closed form. The internal axes are those of
 * kr_working (model/body.h). e3 is the upward vertical, and m the angular momentum.
 *
 * The including file must define GRID, a power of two. Averages use up to GRID intervals between 0
 * and pi. The trapezoidal rule converges exponentially for analytic periodic functions. */
#ifndef KR_EXACT_TORUS_SETUP_H
#define KR_EXACT_TORUS_SETUP_H
#include "torus.h"

/* Complex arithmetic in double (cx_) and double-double (cdd_) precision, because not every C
 * compiler supports the complex types of C. Square roots have a nonnegative real part. */
typedef struct cx {
    double re, im;
} cx;
typedef struct cdd {
    dd re, im;
} cdd;

static inline cx cx_of(double re, double im) { return (cx){re, im}; }
static inline cx cx_add(cx a, cx b) { return cx_of(a.re + b.re, a.im + b.im); }
static inline cx cx_sub(cx a, cx b) { return cx_of(a.re - b.re, a.im - b.im); }
static inline cx cx_scale(double s, cx a) { return cx_of(s * a.re, s * a.im); }
static inline cx cx_mul(cx a, cx b)
{
    return cx_of(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
}
static inline double cx_abs(cx a) { return sqrt(a.re * a.re + a.im * a.im); }

static inline cdd cdd_of(dd re, dd im) { return (cdd){re, im}; }
static inline cdd cdd_of_real(dd re) { return cdd_of(re, dd_of(0.0)); }
static inline cx cdd_high(cdd a) { return cx_of(a.re.hi, a.im.hi); }
static inline cdd cdd_neg(cdd a) { return cdd_of(dd_neg(a.re), dd_neg(a.im)); }
static inline cdd cdd_add(cdd a, cdd b) { return cdd_of(dd_add(a.re, b.re), dd_add(a.im, b.im)); }
static inline cdd cdd_sub(cdd a, cdd b) { return cdd_add(a, cdd_neg(b)); }
static inline cdd cdd_scale(dd s, cdd a) { return cdd_of(dd_mul(s, a.re), dd_mul(s, a.im)); }
static inline cdd cdd_mul(cdd a, cdd b)
{
    return cdd_of(dd_sub(dd_mul(a.re, b.re), dd_mul(a.im, b.im)),
                  dd_add(dd_mul(a.re, b.im), dd_mul(a.im, b.re)));
}
static inline dd cdd_abs_square(cdd a) { return dd_add(dd_square(a.re), dd_square(a.im)); }
static inline cdd cdd_div(cdd a, cdd b)
{
    const cdd up = cdd_mul(a, cdd_of(b.re, dd_neg(b.im)));
    const dd down = cdd_abs_square(b);
    return cdd_of(dd_div(up.re, down), dd_div(up.im, down));
}
static inline cdd cdd_sqrt(cdd a)
{
    const dd t = dd_sqrt(dd_half(dd_add(dd_sqrt(cdd_abs_square(a)), dd_abs(a.re))));
    if (t.hi == 0.0) return cdd_of_real(dd_of(0.0));
    const dd other = dd_half(dd_div(a.im, t));
    if (a.re.hi >= 0.0) return cdd_of(t, other);
    return a.im.hi < 0.0 ? cdd_of(dd_neg(other), dd_neg(t)) : cdd_of(other, t);
}

static inline dd dd_plus(dd a, double b) { return dd_add(a, dd_of(b)); }

/* A table of c[i] = cos(pi * i / GRID), which is filled for the multiples i of `stride`. */
typedef struct cosine_table {
    int stride;
    dd c[GRID + 1];
} cosine_table;

static void start_cosine_table(cosine_table *t)
{
    t->stride = GRID / 2;
    t->c[0] = dd_of(1.0);
    t->c[GRID / 2] = dd_of(0.0);
    t->c[GRID] = dd_of(-1.0);
}
/* Fills the cosine table at all multiples of `stride`, which is a power of two. */
static void fill_cosine_table_to_stride(cosine_table *t, int stride)
{
    while (t->stride > stride) {
        const int s = t->stride /= 2;
        t->c[s] = dd_sqrt(dd_half(dd_plus(t->c[2 * s], 1.0)));
        const dd scale = dd_div(dd_of(0.5), t->c[s]);
        for (int i = 3 * s; i < GRID; i += 2 * s)
            t->c[i] = dd_mul(scale, dd_add(t->c[i - s], t->c[i + s]));
    }
}
static dd add_products(dd a, dd s, dd b, dd c) { return dd_add(dd_mul(a, s), dd_mul(b, c)); }

/* The cubic polynomial (w + h)(w^2 + c) - rest in w. */
typedef struct cubic {
    dd h, c, rest;
} cubic;
static dd refine_root(const cubic *o, dd w, int steps)
{
    for (int i = 0; i < steps; i++) {
        const dd sum = dd_add(w, o->h), other = dd_add(dd_square(w), o->c),
                 slope = dd_add(other, dd_twice(dd_mul(w, sum)));
        if (slope.hi != 0.0) w = dd_sub(w, dd_div(dd_sub(dd_mul(sum, other), o->rest), slope));
    }
    return w;
}
/* Writes the roots of the cubic polynomial `o` to `root`. root[0] is the real root farthest from
 * the mean of all roots. Returns 0 if the other two roots are real: root[1] <= root[2]. Returns 1
 * if they are complex: root[1] +- i root[2], with root[2] > 0. Newton's method for root[0] starts
 * farther from the mean than root[0], and therefore converges monotonically. */
static int find_cubic_roots(const cubic *o, dd root[3])
{
    const double h = o->h.hi, c = o->c.hi, rest = o->rest.hi, bend = -h / 3.0,
                 there = (bend + h) * (bend * bend + c) - rest, side = there > 0.0 ? -1.0 : 1.0,
                 slope = c - h * h / 3.0;
    /* A bound on |v| for all roots w = bend + v, where v^3 + slope v + there = 0. */
    double x = sqrt(fabs(slope)) + 1.0;
    while (x * x * x < 2.0 * (fabs(slope) * x + fabs(there))) x *= 1.5;
    double w = bend + side * x;
    for (double next;; w = next) {
        const double f = (w + h) * (w * w + c) - rest, d = (w * w + c) + 2.0 * w * (w + h);
        next = d != 0.0 ? w - f / d : w;
        if (!(side * (w - next) > 1e-14 * x)) break;
    }
    root[0] = refine_root(o, dd_of(w), 4);
    const dd sum = dd_add(o->h, root[0]), product = dd_add(o->c, dd_mul(root[0], sum)),
             half = dd_half(sum), square = dd_sub(dd_square(half), product),
             far = dd_sqrt(dd_abs(square));
    if (square.hi < 0.0) {
        root[1] = dd_neg(half);
        root[2] = far;
        return 1;
    }
    root[1] = refine_root(o, dd_sub(dd_neg(half), far), 1);
    root[2] = refine_root(o, dd_add(dd_neg(half), far), 1);
    return 0;
}
/* Writes the indices of the real roots among n roots to `order`, in ascending order of the roots,
 * and returns their number. If complex_at < n, root[complex_at] and the next root are complex. */
static int sort_real_roots(const dd root[], int n, int complex_at, int order[])
{
    int real = 0;
    for (int i = 0; i < n; i++) {
        if (i == complex_at || i == complex_at + 1) continue;
        int at = real++;
        for (; at > 0 && dd_less(root[i], root[order[at - 1]]); at--) order[at] = order[at - 1];
        order[at] = i;
    }
    return real;
}
/* Values v[k][i] of up to three even functions at the angles pi * i / GRID, and their sums. */
typedef struct samples {
    dd v[3][GRID + 1];
    dd sum[3];
    double size[3]; /* sum of the absolute values */
} samples;
/* Writes the values of up to three functions of an arc at the angle pi * i / GRID to `out`. */
typedef void sample_function(const void *arc, const cosine_table *table, int i, dd out[3]);
/* Averages the first `count` functions that `function` computes for `arc` over the angles from 0 to
 * pi. Writes the averages to `mean`, and samples to `v`. Doubles the number of intervals until no
 * average k changes by more than 1e-16 * (average of the absolute value + floor[k]). The relative
 * error of an average is then about the square of its last relative change (exponential
 * convergence). Returns the number of intervals, or 0 if GRID intervals are too few. */
static int average_functions(sample_function *function, const void *arc, int count,
                             const double floor[3], cosine_table *table, samples *v, dd mean[3])
{
    memset(v, 0, sizeof *v);
    for (int k = 0; k < count; k++) mean[k] = dd_of(0.0);
    for (int n = 1; n <= GRID; n *= 2) {
        const int stride = GRID / n, first = n > 1 ? stride : 0, step = n > 1 ? 2 * stride : GRID;
        int settled = n >= 16;
        fill_cosine_table_to_stride(table, stride);
        for (int i = first; i <= GRID; i += step) {
            const double weight = i == 0 || i == GRID ? 0.5 : 1.0;
            dd now[3];
            function(arc, table, i, now);
            for (int k = 0; k < count; k++) {
                v->v[k][i] = now[k];
                v->sum[k] = dd_add(v->sum[k], dd_scale(weight, now[k]));
                v->size[k] += weight * fabs(now[k].hi);
            }
        }
        for (int k = 0; k < count; k++) {
            const dd now = dd_div(v->sum[k], dd_of(n));
            settled &= fabs(dd_sub(now, mean[k]).hi) <= 1e-16 * (v->size[k] / n + floor[k]);
            mean[k] = now;
        }
        if (settled) return n;
    }
    return 0;
}
/* Integrates an even function of x minus its average. Writes the coefficient of sin(k x) to out[k]
 * for k < n. v[i] is the function at x = pi * i / GRID, for multiples i of GRID / n. */
static void integrate_to_sines(const dd v[], const cosine_table *table, int n, double out[])
{
    const int stride = GRID / n;
    for (int k = 1; k < n; k++) {
        const double sign = k % 2 ? -1.0 : 1.0;
        double sum = 0.5 * (v[0].hi + sign * v[GRID].hi);
        /* cos(k (pi - x)) is cos(k x) for even k, and -cos(k x) for odd k. Therefore, sums or
         * differences of the values at x and pi - x are multiplied by cos(k x), up to x = pi/2. */
        for (int i = 1, at = k; i <= n / 2; i++) {
            const double mirrored =
                2 * i < n ? v[i * stride].hi + sign * v[GRID - i * stride].hi : v[i * stride].hi;
            sum += mirrored * table->c[(at <= n ? at : 2 * n - at) * stride].hi;
            at += k;
            if (at >= 2 * n) at -= 2 * n;
        }
        out[k] = 2.0 * sum / n / k;
    }
    out[0] = 0.0;
}

/* A kind of top. In units of the closed form, the moments of inertia are ratio/factor, ratio/factor
 * and 1/factor, where `ratio` and `factor` are powers of two. `side` is 1 or -1: if side * gravity
 * is positive, axis 1 points towards the centre of mass, otherwise away from it. */
typedef struct torus_kind {
    kr_kind kind;
    double ratio, factor, side;
} torus_kind;
/* The initial state of a scene, in the axes and units of the closed form. */
typedef struct torus_start {
    dd momentum[3], up[3]; /* the angular momentum, and e3 */
    dd vertical;           /* <m, e3> */
    int has_small_G;       /* 1 if the integral G of a Goryachev-Chaplygin top is nearly 0 */
} torus_start;
/* The conversion from the axes and units of the closed form to those of the scene. */
typedef struct torus_units {
    dd time;                       /* unit of time divided by `units.time`, a power of two */
    double momentum, own_momentum; /* unit of momentum: in the user's units, in units of `units` */
    kr_units units;
    kr_quat attitude; /* initial attitude of the closed form's axes */
    kr_quat turn;     /* closed form's axes -> internal axes */
    kr_quat axes;     /* closed form's axes -> frame of description */
} torus_units;
/* Writes the plan (torus.h) of a motion with the initial state `start` to the beginning of
 * `memory`, and the largest relative error found by checks to `certificate`. May turn the axes of
 * the closed form, and then converts `start` and `way` to the new axes. Returns KR_REFUSAL_NONE, or
 * the reason for a failure. */
typedef kr_refusal make_torus_plan(void *memory, torus_start *start, torus_units *way,
                                   double *certificate);
static kr_quat make_rotation_about_axis_3(double cosine, double sine)
{
    const double half = sqrt(0.5 * (1.0 + fabs(cosine))), other = 0.5 * sine / half;
    return cosine >= 0.0 ? q4(half, v3(0.0, 0.0, other))
                         : q4(fabs(other), v3(0.0, 0.0, sine < 0.0 ? -half : half));
}
/* Writes the components of the space vector v along body axes: the internal axes, turned about axis
 * 3 by the angle with the given cosine and sine. `attitude` rotates internal axes into space. */
static void turn_vector_to_body_axes(const dd attitude[4], const dd v[3], dd cosine, dd sine,
                                     dd out[3])
{
    dd r[3];
    turn_back_dd(attitude, v, r);
    out[0] = dd_add(dd_mul(cosine, r[0]), dd_mul(sine, r[1]));
    out[1] = dd_sub(dd_mul(cosine, r[1]), dd_mul(sine, r[0]));
    out[2] = r[2];
}
/* Checks that a scene describes an undamped top of this kind under gravity. The support may rotate
 * about the vertical if `own` is nonzero (plan in internal units, exact.h). Writes the initial
 * state to `start`, conversions of axes and units to `way`, the reason for errors to `refusal`. */
static kr_status read_torus_scene(const kr_scene *scene, int own, const torus_kind *kind,
                                  kr_refusal *refusal, torus_start *start, torus_units *way)
{
    *refusal = KR_REFUSAL_KIND;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_body *body = &scene->body;
    if (scene->gravity == 0.0 || kr_body_kind(body, KR_KIND_RTOL) != kind->kind ||
        kr_scene_excludes_closed_form(scene, own))
        return KR_ERR_METHOD;
    *refusal = KR_REFUSAL_VERTICAL;
    if (kind->kind == KR_KIND_GORYACHEV_CHAPLYGIN && scene->start.m.z != 0.0) return KR_ERR_METHOD;
    *refusal = KR_REFUSAL_ROUNDED;
    /* The conditions of the integrable case must hold exactly. Axis 3 has the smallest moment. */
    const kr_pull pull = kr_scene_pull(scene, body->com);
    const kr_vec3 i = body->inertia;
    const double inertia[3] = {i.x, i.y, i.z}, com[3] = {pull.com.x, pull.com.y, pull.com.z};
    int third = inertia[1] < inertia[0];
    if (inertia[2] < inertia[third]) third = 2;
    const int first = (third + 1) % 3, second = (third + 2) % 3;
    const double equal = kind->ratio * inertia[third],
                 side = scene->gravity < 0.0 ? -kind->side : kind->side;
    if (inertia[first] != equal || inertia[second] != equal || com[third] != 0.0)
        return KR_ERR_METHOD;
    *refusal = KR_REFUSAL_WEIGHTLESS;
    const kr_working working = kr_body_working(body);
    status = kr_scene_units(scene, &working, &way->units);
    if (status != KR_OK) return status;
    const kr_units *u = &way->units;
    const int power = pull.power - exponent_of(u->moment) + 2 * exponent_of(u->time);
    const dd reach = dd_sqrt(dd_add(dd_square(dd_of(com[first])), dd_square(dd_of(com[second])))),
             c = dd_div(dd_of(side * com[first]), reach),
             s = dd_div(dd_of(side * com[second]), reach),
             lever = dd_times(pull.mass, dd_times(fabs(pull.gravity), reach)),
             weight = dd_make(times_power_of_2(lever.hi, power), times_power_of_2(lever.lo, power)),
             moment = dd_of(kind->factor * (inertia[third] / u->moment));
    if (!(weight.hi > LEAST_LEVER)) return KR_ERR_METHOD;
    way->time = dd_sqrt(dd_div(moment, weight));
    const dd unit = dd_div(moment, way->time);
    way->own_momentum = unit.hi;
    way->momentum = unit.hi * (u->moment / u->time);
    const kr_quat q = scene->start.q;
    const kr_vec3 m = v_scale(u->time, v_scale(1.0 / u->moment, scene->start.m));
    dd turn[4] = {dd_of(q.w), dd_of(q.x), dd_of(q.y), dd_of(q.z)};
    multiply_from_right(turn, body->axes);
    multiply_from_right(turn, working.axes);
    const dd momentum[3] = {dd_of(m.x), dd_of(m.y), dd_of(m.z)},
             up[3] = {dd_of(0.0), dd_of(0.0), dd_of(1.0)};
    turn_vector_to_body_axes(turn, momentum, c, s, start->momentum);
    for (int k = 0; k < 3; k++) start->momentum[k] = dd_div(start->momentum[k], unit);
    turn_vector_to_body_axes(turn, up, c, s, start->up);
    start->vertical = dd_div(momentum[2], unit);
    start->has_small_G = 0;
    way->turn = make_rotation_about_axis_3(c.hi, s.hi);
    way->axes = q_unit(q_mul(q_mul(body->axes, working.axes), way->turn));
    way->attitude = q_unit(q_mul(q, way->axes));
    return KR_OK;
}
/* Converts `torus` to the user's axes and units, and sets torus->begin to `begin`. If `own` is
 * nonzero, converts to internal axes and units instead, and sets torus->begin to 0. Writes the
 * period and the frequencies to `info`. */
static void convert_torus_units(kr_torus *torus, const torus_units *way, double begin, int own,
                                kr_exact_info *info)
{
    const double unit = own ? 1.0 : way->units.time;
    for (int i = 0; i < 3; i++) {
        kr_phase *phase = &torus->turn[i];
        const dd turns = dd_div(dd_make(phase->fast, phase->slow), way->time);
        phase->fast = turns.hi / unit;
        phase->slow = turns.lo / unit;
        info->frequency[i] = (i < 2 ? 1.0 : 2.0) * (two_pi * phase->fast);
    }
    info->period = 0.5 / torus->turn[0].fast;
    torus->begin = own ? 0.0 : begin;
    torus->momentum = own ? way->own_momentum : way->momentum;
    torus->frame = q_conj(own ? way->turn : way->axes);
}
/* Returns the initial angular velocity about axes 1 and 2, and initial momentum along axis 3. */
static kr_vec3 find_rates_12_and_momentum_3(const torus_kind *kind, const torus_start *start)
{
    const dd *m = start->momentum;
    return v_times(v3(kind->factor / kind->ratio, kind->factor / kind->ratio, 1.0),
                   v3(m[0].hi, m[1].hi, m[2].hi));
}
/* Returns 1 if the top swings like a pendulum: axis 2 or 3 stays horizontal, up to rounding errors,
 * and the top rotates about this axis. `rates` is the result of find_rates_12_and_momentum_3. */
static int is_planar(const torus_start *start, kr_vec3 rates)
{
    const double size = 1.0 + v_largest(rates), slack = 1e-13 * size;
    return v_largest(v3(rates.x, rates.y, start->up[2].hi * size)) < slack ||
           v_largest(v3(rates.x, rates.z, start->up[1].hi * size)) < slack;
}
/* Returns the reason for refusing a degenerate motion: rest, uniform rotation, planar motion, or a
 * small G (torus_start). Allows for rounding errors. Returns `refusal` for other motions. */
static kr_refusal find_degeneracy_or_refusal(const torus_kind *kind, const torus_start *start,
                                             kr_refusal refusal)
{
    const kr_vec3 w = find_rates_12_and_momentum_3(kind, start),
                  up = v3(start->up[0].hi, start->up[1].hi, start->up[2].hi),
                  /* the time derivative of the momentum in the body frame */
        change = v3((kind->ratio - 1.0) * w.y * w.z,
                    kind->side * up.z - (kind->ratio - 1.0) * w.x * w.z, -kind->side * up.y);
    const double size = 1.0 + v_largest(w), slack = 1e-13 * size;
    if (v_largest(change) < 1e-8 && v_largest(w) < 1e-8) return KR_REFUSAL_REST;
    if (v_largest(change) < slack * size && v_largest(v_cross(up, w)) < slack)
        return KR_REFUSAL_ROTATION;
    if (is_planar(start, w)) return KR_REFUSAL_PLANAR;
    return start->has_small_G ? KR_REFUSAL_ZERO : refusal;
}
/* Checks a scene, and writes its plan to `memory` by `make_plan`: in the user's axes and units or,
 * if `own` is nonzero, in internal ones. Writes period, frequencies and certificate to `info`.
 * Returns an error and sets info->refusal if a check fails or the certificate exceeds `bound`. */
static kr_status plan_torus(const kr_scene *scene, int own, double bound, const torus_kind *kind,
                            make_torus_plan *make_plan, void *memory, kr_exact_info *info)
{
    kr_torus *torus = memory;
    torus_start start;
    torus_units way;
    const kr_status status = read_torus_scene(scene, own, kind, &info->refusal, &start, &way);
    if (status != KR_OK) return status;
    memset(torus, 0, sizeof *torus);
    torus->momentum = 1.0;
    torus->frame = q_one();
    info->refusal = make_plan(memory, &start, &way, &info->certificate);
    if (info->refusal == KR_REFUSAL_NONE) {
        convert_torus_units(torus, &way, scene->start.t, own, info);
        if (info->certificate <= bound) return KR_OK;
        info->refusal = KR_REFUSAL_CERTIFICATE;
    }
    info->refusal = find_degeneracy_or_refusal(kind, &start, info->refusal);
    return KR_ERR_METHOD;
}

/* The angular velocity w and the space axes e[i], along the axes of the closed form. */
typedef struct body_view {
    double w[3], e[3][3];
} body_view;
static body_view find_rates_and_axes(const torus_kind *kind, kr_state s)
{
    const kr_vec3 m = v_scale(kind->factor, q_turn_back(s.q, s.m));
    body_view r = {.w = {m.x / kind->ratio, m.y / kind->ratio, m.z}};
    for (int i = 0; i < 3; i++) {
        const kr_vec3 e = q_turn_back(s.q, v3(i == 0, i == 1, i == 2));
        r.e[i][0] = e.x, r.e[i][1] = e.y, r.e[i][2] = e.z;
    }
    return r;
}
static kr_vec3 get_angular_velocity(const body_view *r) { return v3(r->w[0], r->w[1], r->w[2]); }
/* Returns a span in which the series of advance_by_taylor_series has a negligible remainder. */
static double choose_taylor_span(const body_view *r)
{
    return 0.03125 / (1.0 + v_length(get_angular_velocity(r)));
}
enum { VIEW_ORDER = 12 };
/* Advances `view` by the time `span` with the Taylor series of the equations of motion. */
static void advance_by_taylor_series(const torus_kind *kind, double span, body_view *view)
{
    const double bend = 1.0 - 1.0 / kind->ratio, across = kind->side * kind->factor / kind->ratio,
                 along = kind->side * kind->factor;
    double w[3][VIEW_ORDER + 1], e[3][3][VIEW_ORDER + 1];
    for (int i = 0; i < 3; i++) w[i][0] = view->w[i];
    for (int a = 0; a < 3; a++)
        for (int i = 0; i < 3; i++) e[a][i][0] = view->e[a][i];
    for (int n = 0; n < VIEW_ORDER; n++) {
        double d[3] = {0.0, across * e[2][2][n], -along * e[2][1][n]};
        for (int i = 0; i <= n; i++) {
            d[0] += bend * (w[1][i] * w[2][n - i]);
            d[1] -= bend * (w[0][i] * w[2][n - i]);
        }
        for (int i = 0; i < 3; i++) w[i][n + 1] = d[i] / (n + 1.0);
        for (int a = 0; a < 3; a++)
            for (int i = 0; i < 3; i++) {
                const int j = (i + 1) % 3, k = (i + 2) % 3;
                double turn = 0.0;
                for (int m = 0; m <= n; m++)
                    turn += e[a][j][m] * w[k][n - m] - e[a][k][m] * w[j][n - m];
                e[a][i][n + 1] = turn / (n + 1.0);
            }
    }
    memset(view, 0, sizeof *view);
    for (int n = VIEW_ORDER; n >= 0; n--)
        for (int i = 0; i < 3; i++) {
            view->w[i] = w[i][n] + span * view->w[i];
            for (int a = 0; a < 3; a++) view->e[a][i] = e[a][i][n] + span * view->e[a][i];
        }
}
/* Returns the error of the state `later`, computed with the closed form: the larger of the errors
 * of the space axes [rad] and of the angular velocity w (relative to 1 + |w|). The correct values
 * are `now`, advanced by the time `span` with a Taylor series. */
static double find_taylor_error(const torus_kind *kind, body_view now, double span, kr_state later)
{
    const body_view got = find_rates_and_axes(kind, later);
    double square = 0.0;
    advance_by_taylor_series(kind, span, &now);
    for (int i = 0; i < 9; i++) {
        const double d = now.e[i / 3][i % 3] - got.e[i / 3][i % 3];
        square += 0.5 * d * d;
    }
    const kr_vec3 w = get_angular_velocity(&now);
    const double miss =
        fmax(sqrt(square), v_length(v_sub(w, get_angular_velocity(&got))) / (1.0 + v_length(w)));
    return isfinite(miss) ? miss : INFINITY;
}
/* Returns the larger of the errors of the attitude [rad] and of the momentum m (relative to
 * 1 + |m|) of the state s. `attitude` and `momentum` (m along body axes) are the correct values. */
static double find_state_error(kr_state s, kr_quat attitude, kr_vec3 momentum)
{
    const double off = v_length(v_sub(q_turn_back(s.q, s.m), momentum)),
                 miss = fmax(kr_attitude_error(s.q, attitude), off / (1.0 + v_length(momentum)));
    return isfinite(miss) ? miss : INFINITY;
}
#endif
