/* Constants (support_setup.c) and steps (support_motion.c) of the Taylor series for tops with dry
 * friction or on moving supports. Private to taylor/. The unit of time of a series is 1 / rate
 * internal units (method.h). The spin is the angular velocity about the apex, relative to the
 * support. In one friction mode, the top slides. In the other mode, friction holds it (keeps the
 * spin zero). */
#ifndef KR_TAYLOR_SUPPORT_SETUP_H
#define KR_TAYLOR_SUPPORT_SETUP_H
#include "model/scene.h"
#include "taylor.h"

/* Returns 1 if `scene` has friction, a gravity gradient or a moving support, 0 if it is NULL. */
static inline int kr_support_is_needed(const kr_scene *scene)
{
    return scene && kr_scene_has_support_terms(scene);
}
/* Returns an approximate upper bound, in internal units, on the rates of the support, the angular
 * speed that the top can reach from W and, if is_held is 0, sqrt(friction torque / inertia). */
double kr_support_rate(const kr_motion *motion, kr_vec3 W, int is_held);
/* Sets the constants in `s` that describe the support and the friction. Returns the lever arm c of
 * the equations in series.h, in internal units. */
vec_dd kr_support_set_constants(kr_series s[2], const kr_motion *motion, double rate);
/* Returns the lever arm c of the equations in series.h, in internal units. Writes `base` and `sway`
 * of the effective gravity G = base + sway * cos(phase of the shaking). */
vec_dd kr_support_split(const kr_motion *motion, dd *base, dd *sway);
/* Writes the cosine and sine of the phase of the shaking at the time `end` + `low` of a series. */
void kr_support_phase(const kr_motion *motion, double rate, double end, double low, dd *cosine,
                      dd *sine);
/* Sets s->turn, s->sway[0] and s->sway[1] (kr_series in taylor.h) to the values at the end of the
 * last step, where the next step begins. */
void kr_support_place(kr_series s[2], const kr_motion *motion, double rate);
/* Lowers s->fall, which limits the step size (taylor.h), so that the support motion is resolved. */
void kr_support_limit_steps(kr_series s[2], const kr_motion *motion, double rate);
/* Sets the friction mode of the next step, and `rub`, the acceleration by sliding friction. */
void kr_support_set_mode(const kr_motion *motion);
/* Returns the sign of the spin of a sliding top, or 0 while friction holds the top. */
double kr_support_sliding(const kr_series *s);
/* Upper limit of the friction torque in internal units, because larger torques might overflow. */
#define MOST_FRICTION 1e250
/* Returns the magnitude of the friction torque, with 1 / rate as the unit of time. */
static inline double kr_support_friction_torque(const kr_motion *motion, double rate)
{
    const double own = motion->scene->friction / motion->momentum_unit * motion->time_unit;
    return fmin(own, MOST_FRICTION) / (rate * rate);
}

/* Computes the Taylor coefficients, about the time path->t, of n single tangents (tangents.h) along
 * the series `path` of the top. The coefficients of order 0 are given. */
void kr_support_expand_tangents(const kr_motion *motion, double rate, const kr_series path[2],
                                struct kr_tangent *first, size_t n, int order);
/* Changes n single tangents where the friction torque jumps, at the end of the last step, whose
 * series is `ended`: subtracts factor * (change of the spin) * apex from the momentum change N of
 * each tangent that changes the spin (tangents.h). `factor` comes from kr_support_ops.jumps. */
void kr_support_jump_tangents(const kr_motion *motion, double rate, const kr_series ended[2],
                              struct kr_tangent *first, size_t n, dd factor);

/* Functions that only tops with friction, a gravity gradient or a moving support need. For other
 * tops, the pointer to this struct is NULL, so that the linker can omit them from programs without
 * such tops. */
typedef struct kr_support_ops {
    double (*rate)(const kr_motion *motion, kr_vec3 W, int is_held);
    vec_dd (*set_constants)(kr_series s[2], const kr_motion *motion, double rate);
    void (*place)(kr_series s[2], const kr_motion *motion, double rate);
    void (*limit_steps)(kr_series s[2], const kr_motion *motion, double rate);
    void (*set_mode)(const kr_motion *motion);
    double (*sliding)(const kr_series *s);
    void (*find_held)(const kr_motion *motion, struct slow_directions *slow);
    void (*start)(const kr_motion *motion);
    /* Computes the next step, at most until the spin vanishes or friction cannot hold the top. */
    kr_status (*step)(kr_motion *motion, const kr_kernel *kernel);
    /* Writes derivatives by time, in the units of the series, at the end of the last step, with the
     * friction mode of this step: of (q | P) to x, and of (0, W) to w (kr_series in taylor.h). */
    void (*slopes)(const kr_motion *motion, double x[8], double w[4]);
    /* Returns 1 if the friction torque jumps at the end of the last step, and then writes the
     * `factor` of jump_tangents. Before the first step, it is NaN if a top without spin begins to
     * slide, because the sign of the friction depends on the perturbation. */
    int (*jumps)(const kr_motion *motion, int order, dd *factor);
    void (*expand_tangents)(const kr_motion *motion, double rate, const kr_series path[2],
                            struct kr_tangent *first, size_t n, int order);
    void (*jump_tangents)(const kr_motion *motion, double rate, const kr_series ended[2],
                          struct kr_tangent *first, size_t n, dd factor);
} kr_support_ops;
extern const kr_support_ops kr_supports;
#endif
