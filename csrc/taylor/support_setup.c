/* Terms of the support and of the friction in a Taylor series (series.h): constants, friction mode
 * (support_setup.h), and the angular velocity of the support and the effective gravity at the
 * beginning of each step. The user's units are those of kr_scene, internal units those of kr_motion
 * (method.h). The unit of time of a series is 1 / rate internal units. */
#include "math/dd.h"
#include "math/trig.h"
#include "support_setup.h"

/* Returns first * (1 + z / (a (a+1)) + z^2 / (a (a+1) (a+2) (a+3)) + ...), without the terms whose
 * denominators contain a factor greater than `to`. */
static dd dd_sum_trig_series(dd first, int a, int to, dd z)
{
    dd term = first, sum = first;
    for (int i = a; i < to; i += 2) {
        term = dd_div(dd_mul(term, z), dd_of((double)(i * (i + 1))));
        sum = dd_add(sum, term);
    }
    return sum;
}
/* Writes the sine and the cosine of an angle, |angle| < 4: power series and four doublings. */
static void dd_sincos(dd angle, dd *s, dd *c)
{
    const dd r = dd_times(0.0625, angle), rr = dd_neg(dd_square(r));
    dd sn = dd_sum_trig_series(r, 2, 22, rr), cs = dd_sum_trig_series(dd_of(1.0), 1, 22, rr);
    for (int i = 0; i < 4; i++) {
        const dd twice = dd_twice(dd_mul(sn, cs));
        cs = dd_sub(dd_of(1.0), dd_twice(dd_square(sn)));
        sn = twice;
    }
    *s = sn;
    *c = cs;
}
/* Returns the angular velocity of the support along e1, e2, e3 (kreisel.h), in internal units. */
static kr_vec3 support_angular_velocity(const kr_motion *motion)
{
    return v_scale(motion->time_unit, motion->scene->turning);
}
static double shaking_rate(const kr_motion *motion)
{
    return kr_support_shakes(motion->scene) ? motion->time_unit * motion->scene->shaking.rate : 0.0;
}
/* Returns mass * acceleration * (center of mass) in internal units, along the principal axes. The
 * argument `acceleration` is in the user's units. */
static vec_dd lever_at_acceleration(const kr_motion *motion, dd acceleration)
{
    kr_scene scene = *motion->scene;
    scene.gravity = acceleration.hi;
    const kr_pull pull = kr_scene_pull(&scene, scene.body.com);
    const double moment = motion->momentum_unit * motion->time_unit;
    const int power = pull.power - ilogb(moment) + 2 * ilogb(motion->time_unit);
    const dd rest = dd_div(acceleration, dd_of(acceleration.hi)),
             weight =
                 dd_scale(ldexp(1.0, power), dd_mul(rest, two_product(pull.gravity, pull.mass)));
    return vdd_scale(weight, motion->body->com);
}
/* Returns the amplitude of the support's acceleration in the user's units. */
static dd shaking_acceleration_amplitude(const kr_scene *scene)
{
    const kr_shaking *shaking = &scene->shaking;
    return dd_times(shaking->amplitude, two_product(shaking->rate, shaking->rate));
}
vec_dd kr_support_split(const kr_motion *motion, dd *base, dd *sway)
{
    const dd gravity = dd_of(motion->scene->gravity),
             most = shaking_acceleration_amplitude(motion->scene);
    *base = dd_of(1.0);
    *sway = dd_of(0.0);
    if (!(fabs(most.hi) > 0.0)) return motion->body->lever;
    if (fabs(gravity.hi) >= fabs(most.hi)) {
        *sway = dd_neg(dd_div(most, gravity));
        return lever_at_acceleration(motion, gravity);
    }
    *base = dd_div(gravity, most);
    *sway = dd_of(-1.0);
    return lever_at_acceleration(motion, most);
}
double kr_support_rate(const kr_motion *motion, kr_vec3 W, int is_held)
{
    const kr_vec3 A = motion->inertia;
    dd base, sway;
    const double turning = v_length(support_angular_velocity(motion)),
                 least = fmin(A.x, fmin(A.y, A.z));
    const vec_dd lever = kr_support_split(motion, &base, &sway);
    const double pull = v_length(vdd_high(lever)), carried = v_length(motion->rotor),
                 root = sqrt(v_dot(v_times(A, W), W)) + sqrt(v_largest(A)) * turning,
                 energy = root * root + v_largest(A) * turning * turning + 4.0 * carried * turning +
                          4.0 * pull * (1.0 + fabs(sway.hi)) +
                          fabs(motion->gradient) * v_largest(A);
    const double stop = is_held ? 0.0 : sqrt(kr_support_friction_torque(motion, 1.0) / least);
    return fmax(fmax(shaking_rate(motion), stop), turning + sqrt(energy / least));
}
/* Returns the apex (kreisel.h), a unit vector, along the principal axes. */
static vec_dd find_apex_in_body(const kr_motion *motion)
{
    const vec_dd along = motion->body->com;
    if (!(v_largest(vdd_high(along)) > 0.0)) return vdd_of(v3(0.0, 0.0, 1.0));
    return vdd_scale(dd_div(dd_of(1.0), dd_sqrt(vdd_dot(along, along))), along);
}
static void set_friction_constants(kr_series s[2], const kr_motion *motion, double rate)
{
    const vec_dd apex = find_apex_in_body(motion), eased = vdd_over(apex, motion->body->inertia);
    const dd ease = vdd_dot(apex, eased), per_ease = dd_div(dd_of(1.0), ease);
    const double friction = kr_support_friction_torque(motion, rate);
    set_vector_words(s[0].apex, s[1].apex, apex);
    set_vector_words(s[0].yield, s[1].yield, vdd_scale(per_ease, eased));
    store_both_words(&s[0].per_grip, dd_div(per_ease, dd_of(friction)));
}
vec_dd kr_support_set_constants(kr_series s[2], const kr_motion *motion, double rate)
{
    dd base, sway;
    const vec_dd lever = kr_support_split(motion, &base, &sway);
    const dd per_rate = dd_times(motion->time_unit / rate, dd_of(motion->scene->shaking.rate));
    store_both_words(&s[0].sway[2], per_rate);
    store_both_words(&s[0].sway[3], base);
    store_both_words(&s[0].sway_most, sway);
    s[0].turns = kr_support_turns(motion->scene);
    s[0].shakes = kr_support_shakes(motion->scene);
    if (motion->scene->friction > 0.0) set_friction_constants(s, motion, rate);
    return lever;
}
void kr_support_limit_steps(kr_series s[2], const kr_motion *motion, double rate)
{
    const double turning = v_length(support_angular_velocity(motion)) / rate,
                 shaking = shaking_rate(motion) / rate, steep = sqrt(v_largest(v_of(s->steep + 1))),
                 most = fmax(fmax(turning, shaking), steep);
    if (most > 0.0) s[0].fall = s[1].fall = fmin(s[0].fall, 1.0 / most);
}

/* Adds a multiple of 2 pi to an angle such that the sum lies between -pi and pi. */
static dd reduce_angle(dd angle)
{
    const dd turn = dd_scale(2.0, dd_pi());
    dd rest = angle;
    for (int i = 0; i < 2; i++) rest = dd_sub(rest, dd_times(rint(rest.hi / turn.hi), turn));
    return rest;
}
/* Writes the cosine and sine of the angle rate * t + phase of the shaking (kr_shaking), in double
 * precision, with low words zero. `since` is the time since scene->start.t, in the user's unit. */
static void find_shaking_phase(const kr_scene *scene, double since, dd *cosine, dd *sine)
{
    const dd t = two_sum(scene->start.t, since), turned = two_product(scene->shaking.rate, t.hi),
             angle = two_sum(turned.hi, scene->shaking.phase), turn = dd_scale(2.0, dd_pi());
    const double turns = rint(angle.hi / turn.hi);
    const dd whole = two_product(turns, turn.hi), rest = two_sum(angle.hi, -whole.hi);
    const double low = (angle.lo + (turned.lo + scene->shaking.rate * t.lo)) +
                       (rest.lo - (whole.lo + turns * turn.lo));
    const dd small = two_sum(rest.hi, low);
    double s, c;
    sin_cos(small.hi, &s, &c);
    *sine = dd_of(s + small.lo * c);
    *cosine = dd_of(c - small.lo * s);
}
void kr_support_phase(const kr_motion *motion, double rate, double end, double low, dd *cosine,
                      dd *sine)
{
    const kr_scene *scene = motion->scene;
    const double unit = motion->time_unit / rate;
    if (!kr_taylor_is_extended(motion)) {
        find_shaking_phase(scene, unit * end, cosine, sine);
        return;
    }
    const dd since = dd_add(dd_of(unit * end), dd_of(unit * low)),
             t = dd_add(dd_of(scene->start.t), since),
             angle = reduce_angle(
                 dd_add(dd_times(scene->shaking.rate, t), dd_of(scene->shaking.phase)));
    dd_sincos(angle, sine, cosine);
}
static void set_gravity_oscillation(kr_series s[2], const kr_motion *motion, double rate)
{
    const dd sway = dd_make(s[0].sway_most, s[1].sway_most);
    dd sine, cosine;
    kr_support_phase(motion, rate, s[0].end, s[1].end, &cosine, &sine);
    store_both_words(&s[0].sway[0], dd_mul(sway, cosine));
    store_both_words(&s[0].sway[1], dd_mul(sway, sine));
}
static void set_support_angular_velocity(kr_series s[2], const kr_motion *motion, double rate)
{
    const kr_vec3 own = v_scale(motion->time_unit / rate, motion->scene->turning);
    if (!kr_taylor_is_extended(motion)) {
        const kr_quat at_end = q4(s->end_x[0], v_of(s->end_x + 1));
        v_put(s->turn + 1, q_turn_back(q_unit(at_end), own));
        return;
    }
    const quat_dd q = qdd_unit(qdd_load(s[0].end_x, s[1].end_x));
    set_vector_words(s[0].turn, s[1].turn, qdd_turn(qdd_conj(q), vdd_of(own)));
}
void kr_support_place(kr_series s[2], const kr_motion *motion, double rate)
{
    if (s->turns != 0.0) set_support_angular_velocity(s, motion, rate);
    if (s->shakes != 0.0) set_gravity_oscillation(s, motion, rate);
}

void kr_support_set_mode(const kr_motion *motion)
{
    kr_taylor *p = taylor_of(motion);
    kr_series *s = p->series;
    if (!(motion->scene->friction > 0.0)) return;
    const double friction = kr_support_friction_torque(motion, p->rate);
    const vec_dd apex = v_dd(v_of(s[0].apex + 1), v_of(s[1].apex + 1)),
                 eased = vdd_over(apex, motion->body->inertia);
    s[0].slides = p->sliding != 0.0;
    s[0].holds = p->sliding == 0.0;
    set_vector_words(s[0].rub, s[1].rub, vdd_scale(dd_of(-p->sliding * friction), eased));
}
double kr_support_sliding(const kr_series *s)
{
    int k = 1;
    if (s->slides == 0.0) return 0.0;
    for (int i = 2; i < 4; i++)
        if (fabs(s->apex[i]) > fabs(s->apex[k])) k = i;
    return (s->rub[k] > 0.0) == (s->apex[k] > 0.0) ? -1.0 : 1.0;
}
