/* Set-up, states and turning points of the closed-form solution for a Lagrange top or a free body.
 * This file is compiled once for each instruction set, because double-double products are three
 * times as fast with fused multiply-add. */
#include "euler.h"
#include "lagrange.h"
#include "math/exponent.h"

/* Conversion of a scene to the axes and units in which the closed-form solution is computed. The
 * internal axes are defined in method.h. The error of a state must not grow with time. No value
 * that determines a rate is therefore rounded to double precision: the attitude and mass * gravity
 * * com are double-double products, and the units are powers of two. */
/* A top in internal axes and units, and the data for converting results to the user's units. */
typedef struct described_top {
    exact_top own;
    int behind;   /* nonzero if the apex is opposite to the third internal axis */
    dd half_turn; /* half of -rotor / I3, the change of the rate of the spin by the rotor */
    kr_quat axes; /* internal axes -> frame of description */
    kr_units units;
} described_top;

/* Computes the rotation that maps the third internal axis of a spherical body to the direction of
 * its centre of mass. This small rotation corrects the rounding error in the direction of the
 * internal axis. Returns |com|. */
static dd find_axis_tilt(const kr_body *b, const kr_working *w, kr_quat *tilt)
{
    const dd axes[4] = {dd_of(w->axes.w), dd_of(w->axes.x), dd_of(w->axes.y), dd_of(w->axes.z)};
    /* The components are divided by the largest one, because their squares may overflow or
     * underflow. */
    const double size = v_largest(b->com);
    const double xyz[3] = {b->com.x, b->com.y, b->com.z};
    dd com[3], c[3];
    for (int i = 0; i < 3; i++) com[i] = dd_div(dd_of(xyz[i]), dd_of(size));
    turned_back(axes, com, c);
    const dd reach = dd_sqrt(dd_dot(c, c));
    const double twice = reach.hi + c[2].hi;
    *tilt = q4(1.0, v3(-c[1].hi / twice, c[0].hi / twice, 0.0));
    return dd_times(size, reach);
}
static double drop_tiny_momentum(double m) { return fabs(m) < LEAST_MOMENTUM ? 0.0 : m; }
/* Returns half the rate that the rotor adds to the spin, in internal units. For a spherical body
 * with rotated axes, the norm of the rotor momentum is used, because it is not affected by rounding
 * errors of the rotation. */
static dd half_turn_of_rotor(const kr_body *b, const kr_working *w, const kr_units *units)
{
    const double scale = units->time, per_moment = 1.0 / units->moment;
    const kr_vec3 h = v_scale(scale, v_scale(per_moment, b->rotor));
    const double along = drop_tiny_momentum(scale * (per_moment * w->rotor.z));
    dd size = dd_of(along);
    if (w->tilted && along != 0.0) {
        const dd xyz[3] = {dd_of(h.x), dd_of(h.y), dd_of(h.z)};
        size = dd_scale(along < 0.0 ? -1.0 : 1.0, dd_sqrt(dd_dot(xyz, xyz)));
    }
    return dd_scale(-0.5, dd_div(size, dd_of(per_moment * w->inertia.z)));
}
/* Converts a valid scene to the axes and units of the closed-form solution. */
static kr_status read_top(const kr_scene *scene, kr_kind kind, described_top *top)
{
    const kr_pull pull = kr_scene_pull(scene, scene->body.com);
    kr_working w = kr_body_working(&scene->body);
    const kr_status status = kr_scene_units(scene, &w, &top->units);
    kr_body body = scene->body, *b = &body;
    body.com = pull.com;
    w.com = q_turn_back(w.axes, body.com);
    const kr_quat q = scene->start.q;
    dd reach = dd_of(kind == KR_KIND_LAGRANGE ? w.com.z : 0.0);
    kr_quat tilt;
    if (status != KR_OK) return status;
    exact_top *own = &top->own;
    top->behind = w.com.z < 0.0;
    own->inertia = v_scale(1.0 / top->units.moment, w.inertia);
    const kr_vec3 m = v_scale(top->units.time, v_scale(1.0 / top->units.moment, scene->start.m));
    own->m = v3(drop_tiny_momentum(m.x), drop_tiny_momentum(m.y), drop_tiny_momentum(m.z));
    top->axes = q_unit(q_mul(b->axes, w.axes));
    own->q[0] = dd_of(q.w);
    own->q[1] = dd_of(q.x);
    own->q[2] = dd_of(q.y);
    own->q[3] = dd_of(q.z);
    if (!is_one(b->axes)) turn_first(own->q, b->axes);
    if (!is_one(w.axes)) turn_first(own->q, w.axes);
    if (w.tilted && kind == KR_KIND_LAGRANGE) {
        reach = find_axis_tilt(b, &w, &tilt);
        turn_first(own->q, tilt);
    }
    const int power =
        pull.power - exponent_of(top->units.moment) + 2 * exponent_of(top->units.time);
    const dd lever = dd_times(pull.mass, dd_times(pull.gravity, reach));
    own->lever = dd_make(times_power_of_2(lever.hi, power), times_power_of_2(lever.lo, power));
    if (fabs(own->lever.hi) < LEAST_LEVER) own->lever = dd_of(0.0);
    top->half_turn = half_turn_of_rotor(&scene->body, &w, &top->units);
    return KR_OK;
}
/* Converts a solution to the user's axes and units. The argument `unit` is the internal unit of
 * time, expressed in the user's units. */
static void to_frame_and_units(kr_exact_form *exact, const described_top *top, double start,
                               double unit)
{
    if (!is_one(top->axes)) {
        fill_frame_axes(exact->frame, exact->framed != 0.0, top->axes);
        exact->framed = 1.0;
    }
    to_user(exact, start, unit, top->units.moment / top->units.time);
}

/* The extreme nutation angles of a top, and the precession at these angles. With m3 = <m, e3>, c =
 * <m, apex> and the nutation th
 *     E = I1 th'^2/2 + U(th),   U = (m3 - c cos th)^2 / (2 I1 sin^2 th) + c^2/2 I3 + lever cos th,
 * where (m3 - c cos th)/sin th = ((m3 + c) tan th/2 + (m3 - c) cot th/2) / 2 loses no digits near a
 * pole. An axial rotor with the momentum h replaces c^2/2 I3 by (c - h)^2/2 I3. For a torque-free
 * body, u3 is infinite, but only the product g u3 is used. */
/* Types of motion. Quantities are considered equal if they agree within KR_INPUT_RTOL. For angles,
 * the tolerance is measured in radians. For a precession rate or a momentum, the tolerance is
 * relative to the magnitude of the terms in its formula. */
enum motion_type {
    RESTING,    /* no torque, and the apex rests */
    CIRCLE,     /* no torque: a circle about the angular momentum */
    SLEEPING,   /* upright against gravity */
    HANGING,    /* straight down */
    STEADY,     /* precession without nutation */
    SEPARATRIX, /* reaches the upright position in infinite time */
    PENDULUM,   /* in a vertical plane, swinging or circling */
    ROSETTE,    /* passes through the vertical, above or below */
    LOOPS,      /* precesses in opposite senses at the highest and lowest points */
    CUSPS,      /* does not precess at the highest point */
    WAVES       /* precesses in one sense */
};
static const char *const motion_type_names[] = {"resting", "circle",     "sleeping", "hanging",
                                                "steady",  "separatrix", "pendulum", "rosette",
                                                "loops",   "cusps",      "waves"};

/* Returns the nutation angle for the height u, given 1 - u and 1 + u. Values of 1 - u and 1 + u of
 * at most 2e-36 count as zero, because the function `sharpen` replaces values below 1e-36 with
 * 1e-36. */
static double turning_angle(dd minus, dd plus)
{
    const double least = 2e-36, low = minus.hi > least ? minus.hi : 0.0,
                 high = plus.hi > least ? plus.hi : 0.0;
    return 2.0 * atan2(sqrt(low), sqrt(high));
}
/* Returns the sign of the precession rate at the height u, given 1 - u and 1 + u. Returns 0 if the
 * magnitude of the precession rate is at most `tol` times the sum of the absolute values of its
 * terms. */
static int precession_sign(const initial *s, dd minus, dd plus, double tol)
{
    const dd one = dd_mul(s->sum, minus), two = dd_mul(s->difference, plus);
    const double all = dd_add(one, two).hi, size = fabs(one.hi) + fabs(two.hi);
    return fabs(all) <= tol * size ? 0 : all < 0.0 ? -1 : 1;
}
/* Returns the type of motion of a heavy top, given its smallest and largest nutation angles.
 * Gravity must point downwards. */
static enum motion_type heavy_motion_type(const initial *s, const turning_points *r, double least,
                                          double greatest)
{
    const double pi = 3.14159265358979323846, tol = KR_INPUT_RTOL,
                 size = tol * sqrt(s->w_square.hi + s->g.hi);
    if (greatest - least <= tol)
        return greatest <= tol ? SLEEPING : pi - least <= tol ? HANGING : STEADY;
    if (least <= tol && r->g32.hi <= tol * r->g31.hi) return SEPARATRIX;
    if (fabs(s->sum.hi) <= size && fabs(s->difference.hi) <= size) return PENDULUM;
    if (least <= tol || pi - greatest <= tol) return ROSETTE;
    const int high = precession_sign(s, r->minus2, r->plus2, tol),
              low = precession_sign(s, r->minus1, r->plus1, 0.0);
    return high == 0 ? CUSPS : high == low ? WAVES : LOOPS;
}
static enum motion_type free_motion_type(const initial *s)
{
    const dd axial = dd_half(dd_sub(s->sum, s->difference));
    const dd across = dd_sqrt(dd_sub(s->w_square, dd_square(axial)));
    return across.hi <= KR_INPUT_RTOL * sqrt(s->w_square.hi) ? RESTING : CIRCLE;
}
/* Writes the earliest nonnegative times at which the apex of the top reaches its lowest and its
 * highest point. */
static void turning_times(const initial *s, const turning_points *r, double *low, double *high)
{
    const double kp = sqrt(r->g32.hi / r->g31.hi);
    const dd mean = elliptic_mean(dd_of(kp), 0, NULL, NULL), here = phase_at_start(r, mean.hi);
    const dd rise = dd_sub(dd_of(0.25), here);
    const double turn = 2.0 * two_pi / (sqrt(r->g31.hi) * mean.hi);
    const int falls = s->climb.hi < 0.0;
    *low = turn * (falls || here.hi <= 0.0 ? here.hi : dd_sub(dd_of(0.5), here).hi);
    *high = turn * (!falls || rise.hi <= 0.0 ? rise.hi : dd_add(dd_of(0.25), here).hi);
    if (kp <= 1e-74) *high = INFINITY;
    if (kp <= 1e-74 && !falls && here.hi > 0.0) *low = INFINITY;
}
/* Sets the members of kr_nutation that do not depend on the turning points, in internal units,
 * and sets both extreme angles to the initial nutation.
 * Gravity must point downwards. The argument `rotor` is the momentum of an axial rotor divided by
 * I3. */
static kr_nutation turning_of_body(const exact_top *top, const initial *s, dd i1, double rotor)
{
    kr_nutation r = {0};
    const double axial = i1.hi * dd_half(dd_sub(s->sum, s->difference)).hi;
    r.inertia = i1.hi;
    r.sum = i1.hi * s->sum.hi;
    r.difference = i1.hi * s->difference.hi;
    const double own = axial - rotor * top->inertia.z;
    r.axial_energy = own * own / (2.0 * top->inertia.z);
    r.lever = top->lever.hi;
    r.critical_spin = 2.0 * sqrt(i1.hi * top->lever.hi) / top->inertia.z;
    r.least = r.greatest = turning_angle(s->minus, s->plus);
    return r;
}
/* Returns the turning points, in internal units, of a top whose weight * com along its axis is
 * nonnegative. Times are measured from the initial time. The argument `rotor` is the momentum of an
 * axial rotor divided by I3. */
static kr_nutation turning_downwards(const exact_top *top, double rotor)
{
    const dd i1 = dd_half(two_sum(top->inertia.x, top->inertia.y));
    const initial s = find_initial(top, i1);
    const int free = s.g.hi == 0.0;
    kr_nutation r = turning_of_body(top, &s, i1, rotor);
    if (free ? free_motion_type(&s) == RESTING : is_resting_at_pole(&s)) {
        r.motion_type = motion_type_names[free ? RESTING : s.a[2].hi > 0.0 ? SLEEPING : HANGING];
        return r;
    }
    const turning_points heights = find_turning_heights(&s);
    r.least = turning_angle(heights.minus2, heights.plus2);
    r.greatest = turning_angle(heights.minus1, heights.plus1);
    r.motion_type =
        motion_type_names[free ? CIRCLE : heavy_motion_type(&s, &heights, r.least, r.greatest)];
    if (r.greatest - r.least > KR_INPUT_RTOL)
        turning_times(&s, &heights, &r.t_greatest, &r.t_least);
    return r;
}
static void swap_doubles(double *a, double *b)
{
    const double c = *a;
    *a = *b;
    *b = c;
}
/* Converts turning points to the correct orientation if they were computed with up and down
 * interchanged. */
static void flip_nutation(kr_nutation *r)
{
    const double pi = 3.14159265358979323846, least = pi - r->greatest;
    r->greatest = pi - r->least;
    r->least = least;
    swap_doubles(&r->t_least, &r->t_greatest);
    swap_doubles(&r->sum, &r->difference);
    r->sum = -r->sum;
    r->difference = -r->difference;
    r->lever = -r->lever;
}
/* Converts turning points from internal units to the user's units. */
static void convert_nutation_to_user(kr_nutation *r, const kr_units *units, double start)
{
    const double momentum = units->moment / units->time, energy = momentum / units->time;
    r->t_least = start + units->time * r->t_least;
    r->t_greatest = start + units->time * r->t_greatest;
    r->critical_spin /= units->time;
    r->inertia *= units->moment;
    r->sum *= momentum;
    r->difference *= momentum;
    r->axial_energy *= energy;
    r->lever *= energy;
}

/* Returns the closed-form solution for a Lagrange top, in internal units. `half_turn` is half the
 * rate that a rotor adds to the rotation about the symmetry axis. */
static kr_exact_form lagrange_closed_form(const exact_top *top, dd half_turn)
{
    const int below = top->lever.hi < 0.0;
    lagrange_setup s;
    s.top = below ? seen_from_below(top) : *top;
    begin_setup(&s);
    if (half_turn.hi != 0.0) s.half_spin = dd_add(s.half_spin, half_turn);
    if (is_resting_at_pole(&s.start)) {
        const dd half = dd_half(s.start.w[2]);
        memset(&s.exact, 0, sizeof s.exact);
        s.exact.constant.z = s.top.m.z;
        s.exact.side = 1.0;
        steady_closed_form(&s.exact, rounded(s.top.q), dd_add(half, s.half_spin),
                           dd_sub(half, s.half_spin));
    } else
        lagrange_moving(&s, 1);
    if (below) {
        undo_turn_over(&s.exact);
        fill_frame_below(s.exact.frame);
        s.exact.framed = 1.0;
    }
    return s.exact;
}
/* Returns 0 if the initial tilt and velocity of the axis are not both zero, but too small for the
 * closed-form solution. The time that an upright top takes to fall depends on the logarithm of its
 * initial tilt. The fourth power of the tilt underflows if the tilt is below 1e-77. */
static int is_resolved(const kr_scene *scene)
{
    const kr_working w = kr_body_working(&scene->body);
    const kr_quat q = q_mul(scene->start.q, q_mul(scene->body.axes, w.axes));
    const double lean = fmin(fmax(fabs(q.x), fabs(q.y)), fmax(fabs(q.w), fabs(q.z))),
                 push = fmax(fabs(scene->start.m.x), fabs(scene->start.m.y));
    kr_units units;
    if ((lean == 0.0 && push == 0.0) || scene->gravity == 0.0 || v_largest(w.com) == 0.0) return 1;
    if (kr_scene_units(scene, &w, &units) != KR_OK) return 1; /* reported by other functions */
    return fmax(lean, push * (units.time / units.moment)) >= 1e-70;
}
/* Computes the closed-form solution for a scene. If `own` is nonzero, the solution is expressed in
 * internal axes and units. */
static kr_status set_up(const kr_scene *scene, int own, double bound, void *memory,
                        kr_exact_info *info)
{
    (void)bound;
    described_top top;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_kind kind = kr_scene_kind(scene);
    if (kind != KR_KIND_EULER && kind != KR_KIND_LAGRANGE) return KR_ERR_METHOD;
    if (kr_scene_excludes_exact(scene, own) || !is_resolved(scene)) return KR_ERR_METHOD;
    status = read_top(scene, kind, &top);
    if (status != KR_OK) return status;
    const int is_free = top.own.lever.hi == 0.0;
    kr_exact_form made = is_free ? euler_closed_form(&top.own, top.half_turn)
                                 : lagrange_closed_form(&top.own, top.half_turn);
    if (!is_free && top.behind) made.spin_angle_rate = opposite_spin(made.spin_angle_rate);
    if (!own) to_frame_and_units(&made, &top, scene->start.t, top.units.time);
    /* For extreme moments of inertia, the rates of the phases may exceed the range of doubles. */
    if (!isfinite(made.nutation.fast + made.first.fast + made.second.fast)) return KR_ERR_ARGUMENT;
    memcpy(memory, &made, sizeof made);
    info->period = made.period;
    info->precession_rate = made.precession_rate;
    info->spin_angle_rate = made.spin_angle_rate;
    info->refusal = KR_REFUSAL_NONE;
    return KR_OK;
}
/* Returns 1 if the body, with its rotor, is symmetric about its apex: the direction of the centre
 * of mass, or T. */
static int turns_about_apex(const kr_body *body, kr_kind kind)
{
    const kr_vec3 i = body->inertia, h = body->rotor;
    const double across = fmax(fabs(h.x), fabs(h.y));
    if (kind == KR_KIND_EULER && across > KR_KIND_RTOL * v_largest(h)) return 0;
    return kind == KR_KIND_LAGRANGE ||
           (kind == KR_KIND_EULER && fabs(i.x - i.y) <= KR_KIND_RTOL * fmax(i.x, i.y));
}
kr_status KR_NAME(kr_exact_limits)(const kr_scene *scene, kr_nutation *out)
{
    described_top top;
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    const kr_kind kind = kr_body_kind(&scene->body, KR_KIND_RTOL);
    if (!turns_about_apex(&scene->body, kind) || kr_scene_is_disturbed(scene)) return KR_ERR_METHOD;
    status = read_top(scene, kind, &top);
    if (status != KR_OK) return status;
    /* Beside a rotor, powers of a much smaller momentum would underflow. Such a momentum moves the
     * apex at no time that doubles resolve. */
    if (top.own.lever.hi == 0.0 && v_largest(top.own.m) < 1e-40) top.own.m = v3(0.0, 0.0, 0.0);
    const int below = top.own.lever.hi < 0.0;
    if (below) top.own = seen_from_below(&top.own);
    kr_nutation r = turning_downwards(&top.own, -2.0 * top.half_turn.hi);
    /* The apex points along the third internal axis or in the opposite direction. */
    r.critical_spin += (top.behind ? -2.0 : 2.0) * top.half_turn.hi;
    if (below != top.behind) flip_nutation(&r);
    convert_nutation_to_user(&r, &top.units, scene->start.t);
    memcpy(out, &r, sizeof r);
    return KR_OK;
}
static kr_state state_of_plan(const void *plan, double t) { return state_at(plan, t); }
static size_t size_of_plan(const void *plan) { return (void)plan, sizeof(kr_exact_form); }
const kr_exact_scalar KR_NAME(kr_exact_scalar) = {sizeof(kr_exact_form),
                                                  sizeof(kr_exact_form),
                                                  size_of_plan,
                                                  is_resolved,
                                                  set_up,
                                                  state_of_plan,
                                                  NULL};
