/* Tangents of tops with dry friction or on moving supports, in double and in double-double
 * precision. The Taylor series of the tangents are computed by the code in support_deviation.h. */
#include <string.h>
#include "support_setup.h"
#include "tangents.h"

/* Constants and current state of the motion, in the units of the Taylor series. A, D and h have the
 * same meaning as in series.h, and `turning` is the support's angular velocity. `rate`, `base` and
 * `sway` describe the shaking, and `lever` is the lever arm of the effective gravity. `q` is the
 * current attitude, and `cosine` and `sine` give the current phase of the shaking. */
typedef struct support_data {
    double D[3], turning[3];
    dd A[3], h[3], rate, base, sway, lever[3], q[4], cosine, sine;
    /* Friction data: the apex, the friction torque, and the sign of the spin while the top slides.
     * `holds` is nonzero if friction holds the top. */
    dd apex[3];
    double friction, sliding, gradient;
    int holds;
} support_data;
/* Derivatives of the equations of motion with respect to the parameter for which a tangent is
 * computed (see support_deviation.h). */
typedef struct support_drive {
    double moments[3], drags[3], turning[3], per_rate;
    dd rotor[3], pull[3], scale[4], apex[3];
    double torque, gradient;
    int has_pull;
} support_drive;

static void put_three(dd to[3], vec_dd v)
{
    to[0] = v.x;
    to[1] = v.y;
    to[2] = v.z;
}
static vec_dd words_of_vector(const kr_tangent *g, const double *high, int deep)
{
    const kr_vec3 none = {0.0, 0.0, 0.0};
    const double *low = (const double *)(const void *)((const char *)high + sizeof *g);
    return v_dd(v_of(high + 1), deep ? v_of(low + 1) : none);
}
static support_data read_support(const kr_motion *motion, double rate, const kr_series path[2])
{
    const int deep = motion->digits > 16;
    const double zero[4] = {0.0};
    const quat_dd q = qdd_unit(qdd_load(path->x[0], deep ? path[1].x[0] : zero));
    support_data data;
    memset(&data, 0, sizeof data);
    put_three(data.A, motion->body->inertia);
    v_put(data.D, v_scale(1.0 / rate, motion->damping));
    put_three(data.h, vdd_scale_exactly(1.0 / rate, motion->body->rotor));
    v_put(data.turning, v_scale(motion->time_unit / rate, motion->scene->turning));
    data.rate = dd_times(motion->time_unit / rate, dd_of(motion->scene->shaking.rate));
    put_three(data.lever, vdd_scale_exactly(1.0 / (rate * rate),
                                            kr_support_split(motion, &data.base, &data.sway)));
    data.gradient = motion->gradient / (rate * rate);
    data.q[0] = q.w;
    put_three(data.q + 1, q.v);
    kr_support_phase(motion, rate, path->t, deep ? path[1].t : 0.0, &data.cosine, &data.sine);
    if (!(motion->scene->friction > 0.0)) return data;
    put_three(data.apex, v_dd(v_of(path->apex + 1), v_of(deep ? path[1].apex + 1 : zero)));
    data.friction = kr_support_friction(motion, rate);
    data.sliding = kr_support_sliding(path);
    data.holds = path->holds != 0.0;
    return data;
}
/* Computes the coefficients of the factor k (support_deviation.h), which is the effective
 * acceleration or its derivative with respect to gravity or to the amplitude, rate or phase of the
 * shaking. */
static void set_acceleration_coefficients(const kr_motion *motion, double rate, dd since,
                                          double timing, dd scale[4])
{
    const kr_shaking *shaking = &motion->scene->shaking;
    const double unit = motion->time_unit / rate;
    const dd t = dd_add(dd_of(motion->scene->start.t), dd_scale(unit, since)),
             square = two_product(shaking->rate, shaking->rate),
             most = dd_times(shaking->amplitude, square),
             twice = two_product(2.0 * shaking->amplitude, shaking->rate);
    switch ((int)timing) {
    case KR_TIMING_STRENGTH:
        scale[0] = dd_of(motion->scene->gravity);
        scale[1] = kr_scene_shakes(motion->scene) ? dd_neg(most) : dd_of(0.0);
        break;
    case KR_TIMING_UNIFORM:
        scale[0] = dd_of(1.0);
        break;
    case KR_TIMING_AMPLITUDE:
        scale[1] = dd_neg(square);
        break;
    case KR_TIMING_RATE:
        scale[1] = dd_neg(twice);
        scale[2] = dd_mul(t, most);
        scale[3] = dd_times(unit, most);
        break;
    default:
        scale[2] = most;
        break;
    }
}
static support_drive read_drive(const kr_motion *motion, double rate, const kr_series path[2],
                                const kr_tangent *g)
{
    support_drive drive;
    const int deep = motion->digits > 16;
    const dd since = dd_make(path->t, deep ? path[1].t : 0.0);
    memset(&drive, 0, sizeof drive);
    memcpy(drive.moments, g->moments + 1, sizeof drive.moments);
    memcpy(drive.drags, g->drags + 1, sizeof drive.drags);
    memcpy(drive.turning, g->turning_of + 1, sizeof drive.turning);
    drive.per_rate = 1.0 / rate;
    put_three(drive.rotor, words_of_vector(g, g->rotor_of, deep));
    put_three(drive.pull, words_of_vector(g, g->pull, deep));
    drive.has_pull = g->timing != 0.0;
    if (drive.has_pull) set_acceleration_coefficients(motion, rate, since, g->timing, drive.scale);
    put_three(drive.apex, words_of_vector(g, g->apex_of, deep));
    drive.torque = -kr_support_sliding(path) * g->friction_of;
    drive.gradient = g->gradient_of;
    return drive;
}

#include "math/real.h"
#include "support_deviation.h"
#define KR_DEEP
#include "math/real.h"
#include "support_deviation.h"

/* Expands the tangents or, if `factor` is not NULL, lets them jump (kr_support_jump_tangents). */
static void change_tangents(const kr_motion *motion, double rate, const kr_series path[2],
                            kr_tangent *first, size_t n, int order, const dd *factor)
{
    if (motion->digits > 16)
        deep_change_tangents(motion, rate, path, first, n, order, factor);
    else
        plain_change_tangents(motion, rate, path, first, n, order, factor);
}
void kr_support_expand_tangents(const kr_motion *motion, double rate, const kr_series path[2],
                                kr_tangent *first, size_t n, int order)
{
    change_tangents(motion, rate, path, first, n, order, NULL);
}
void kr_support_jump_tangents(const kr_motion *motion, double rate, const kr_series ended[2],
                              kr_tangent *first, size_t n, dd factor)
{
    kr_series path[2];
    memcpy(path, ended, sizeof path);
    for (int word = 0; word < 2; word++) {
        memcpy(path[word].x[0], ended[word].end_x, sizeof ended->end_x);
        memcpy(path[word].w[0], ended[word].end_w, sizeof ended->end_w);
        path[word].t = ended[word].end;
    }
    path[0].slides = path[0].holds = 0.0;
    change_tangents(motion, rate, path, first, n, 1, &factor);
}
