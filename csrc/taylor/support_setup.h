/* Constants (support_setup.c) and steps (support_motion.c) of the Taylor series for tops with dry
 * friction or on moving supports. Private to taylor/. */
#ifndef KR_TAYLOR_SUPPORT_SETUP_H
#define KR_TAYLOR_SUPPORT_SETUP_H
#include "model/scene.h"
#include "taylor.h"

/* Returns 1 if `scene` is not NULL and has friction or a moving support (series.h). */
static inline int kr_support_moves(const kr_scene *scene)
{
    return scene && kr_scene_needs_support_terms(scene);
}
/* Returns an upper bound on the rates of the support, of the friction (unless `is_held` is nonzero)
 * and of the rotation of a top with the angular velocity W. The bound determines the unit of time
 * of the series. If shaking later increases the energy, the steps adjust the unit of time. */
double kr_support_rate(const kr_motion *motion, kr_vec3 W, int is_held);
/* Sets the constants of a Taylor series that describe the support and the friction. Returns the
 * lever arm of the effective gravity. */
vec_dd kr_support_set_constants(kr_series s[2], const kr_motion *motion, double rate);
/* Returns the lever arm of the effective gravity G in the units of the motion. Writes the constant
 * part of the effective gravity to `base`, and the amplitude of its oscillating part to `sway`. */
vec_dd kr_support_split(const kr_motion *motion, dd *base, dd *sway);
/* Writes the cosine and the sine of the shaking phase at the time `end` + `low`. The unit of time
 * is 1 / rate. */
void kr_support_phase(const kr_motion *motion, double rate, double end, double low, dd *cosine,
                      dd *sine);
/* Sets the support's angular velocity and acceleration at the beginning of the next step. */
void kr_support_place(kr_series s[2], const kr_motion *motion, double rate);
/* Limits the step size so that the support motion is resolved. */
void kr_support_limit_steps(kr_series s[2], const kr_motion *motion, double rate);
/* Sets the friction mode (sliding or held) and the friction torque of the next step. */
void kr_support_set_mode(const kr_motion *motion);
/* Returns the sign of the spin of a sliding top, or 0 if friction holds the top. */
double kr_support_sliding(const kr_series *s);
/* Upper bound on the friction torque, because larger values would overflow. Such a friction torque
 * stops a top within a time smaller than the rounding error of the time. */
#define MOST_FRICTION 1e250
/* Returns the magnitude of the friction torque, with 1 / rate as the unit of time. */
static inline double kr_support_friction(const kr_motion *motion, double rate)
{
    const double own = motion->scene->friction / motion->momentum_unit * motion->time_unit;
    return fmin(own, MOST_FRICTION) / (rate * rate);
}

/* Computes the Taylor coefficients of n tangents along the path, about the time path->t. The
 * unit of time is 1 / rate. The tangents are stored one by one, not in batches (tangents.h). */
void kr_support_expand_tangents(const kr_motion *motion, double rate, const kr_series path[2],
                                struct kr_tangent *first, size_t n, int order);
/* Changes n tangents that are stored singly (tangents.h), because the friction torque jumps at the
 * end of the last step: subtracts factor * (derivative of the spin) * apex from the momentum change
 * N of each. `factor` is written by `jumps` of kr_support_ops. A tangent whose derivative of the
 * spin is zero does not change. */
void kr_support_jump_tangents(const kr_motion *motion, double rate, const kr_series ended[2],
                              struct kr_tangent *first, size_t n, dd factor);

/* Table of all functions that only tops with friction or on moving supports need. The code for all
 * tops calls these functions through a pointer, which is NULL for the other tops. Programs without
 * supports do not refer to the table, so that the linker can omit the functions. */
typedef struct kr_support_ops {
    double (*rate)(const kr_motion *motion, kr_vec3 W, int is_held);
    vec_dd (*set_constants)(kr_series s[2], const kr_motion *motion, double rate);
    void (*place)(kr_series s[2], const kr_motion *motion, double rate);
    void (*limit_steps)(kr_series s[2], const kr_motion *motion, double rate);
    void (*set_mode)(const kr_motion *motion);
    double (*sliding)(const kr_series *s);
    /* Finds the directions of strong damping for a top that friction holds (slow.h). */
    void (*find_held)(const kr_motion *motion, struct slow_directions *slow);
    /* Determines whether the top initially slides or is held by friction. */
    void (*start)(const kr_motion *motion);
    /* Computes the next step. With friction, the step ends at the latest when the spin vanishes or
     * friction can no longer hold the top. */
    kr_status (*step)(kr_motion *motion, const kr_kernel *kernel);
    /* Writes the time derivatives of the attitude, the vertical and the angular velocity at the end
     * of the last step. The derivatives are computed for the friction mode (sliding or held) of the
     * last step. */
    void (*slopes)(const kr_motion *motion, double x[8], double w[4]);
    /* Returns 1 if the friction torque is discontinuous at the end of the last step, and then
     * writes the argument `factor` of jump_tangents. `factor` is NaN if the top starts without spin
     * and friction cannot hold the top, because the direction of the friction then depends on the
     * sign of the perturbation. */
    int (*jumps)(const kr_motion *motion, int order, dd *factor);
    void (*expand_tangents)(const kr_motion *motion, double rate, const kr_series path[2],
                            struct kr_tangent *first, size_t n, int order);
    void (*jump_tangents)(const kr_motion *motion, double rate, const kr_series ended[2],
                          struct kr_tangent *first, size_t n, dd factor);
} kr_support_ops;
extern const kr_support_ops kr_supports;
#endif
