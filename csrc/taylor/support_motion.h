/* Tops with dry friction, or on a support that rotates or shakes: constants and steps of the series
 * of support.h. Private to taylor/. */
#ifndef KR_TAYLOR_SUPPORT_MOTION_H
#define KR_TAYLOR_SUPPORT_MOTION_H
#include "model/scene.h"
#include "taylor.h"

/* Returns 1 if the series for a scene needs the terms of support.h. Returns 0 if `scene` is
 * NULL. */
static inline int kr_support_moves(const kr_scene *scene)
{
    return scene && kr_scene_needs_support_terms(scene);
}
/* Returns the largest of three rates: those of the support motion and of the friction, and the
 * largest angular velocity permitted by the energy. W is the current angular velocity. Returns 0 if
 * the series does not need the terms of support.h. A shaken support may increase the energy;
 * kr_support_step then changes the unit of time. */
double kr_support_rate(const kr_motion *motion, kr_vec3 W, int is_held);
/* Sets the constants of the support and of the friction. Returns the lever that is multiplied by
 * G. */
vec_dd kr_support_set_constants(kr_series s[2], const kr_motion *motion, double rate);
/* Returns the lever that is multiplied by G, in the units of the motion. Writes the constant part
 * of G to `base`, and the coefficient of the cosine in G to `sway`. */
vec_dd kr_support_split(const kr_motion *motion, dd *base, dd *sway);
/* Writes the cosine and the sine of the phase of the shaking at the time `end` + `low`, in units of
 * 1 / rate. */
void kr_support_phase(const kr_motion *motion, double rate, double end, double low, dd *cosine,
                      dd *sine);
/* Sets the position of the support at the end of the last step of a series, which is where the next
 * step begins. */
void kr_support_place(kr_series s[2], const kr_motion *motion, double rate);
/* Limits the step size according to the rates of the support motion. */
void kr_support_limit_steps(kr_series s[2], const kr_motion *motion, double rate);
/* Determines whether the top initially slides or is held by friction. */
void kr_support_start(const kr_motion *motion);
/* Sets the mode of a step: whether the top slides or is held, and the friction. */
void kr_support_set_mode(const kr_motion *motion);
/* Returns the derivative of W at the end of the last step, without friction. */
kr_vec3 kr_support_acceleration(const kr_series *s);
/* Returns the friction in units of a series. */
double kr_support_friction(const kr_motion *motion, double rate);
/* Returns the sign of the spin if the top slides in this step, or 0 if friction holds the top. */
double kr_support_sliding(const kr_series *s);
/* Returns 1 if friction changes direction at the end of the last step, or holds the top from then
 * on. Writes the factor for kr_support_jump_tangents. The factor is NaN if the top starts without
 * spin and friction cannot hold it. In that case, the direction of the friction depends on the sign
 * of the deviation. */
int kr_support_jumps(const kr_motion *motion, int order, dd *factor);
/* Computes the next step. With friction, the step ends where the spin reaches 0, or where friction
 * can no longer hold the top. */
kr_status kr_support_step(kr_motion *motion, const kr_kernel *kernel);
/* Writes the derivatives of (q | P) and W at the end of the last step, computed with the forces
 * that act during that step. */
void kr_support_slopes(const kr_motion *motion, double x[8], double w[4]);
#endif
