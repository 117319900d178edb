/* Conversion of a scene to the axes and units in which the closed-form solution is computed. The
 * internal axes are defined in method.h. The error of a state must not grow with time. No value
 * that determines a rate is therefore rounded to double precision: the attitude and mass * gravity
 * * com are double-double products, and the units are powers of two. This header is compiled once
 * for each instruction set, because double-doubles are faster with fused multiply-add. */
#ifndef KR_EXACT_SCALING_H
#define KR_EXACT_SCALING_H
#include "math/exponent.h"
#include "single.h"

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
static dd tilt_on(const kr_body *b, const kr_working *w, kr_quat *tilt)
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
        reach = tilt_on(b, &w, &tilt);
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
#endif
