/* Tops with dry friction, or on a support that turns or shakes: constants and steps of the series
 * of support.h. Private to taylor/. */
#ifndef KR_TAYLOR_SUPPORT_MOTION_H
#define KR_TAYLOR_SUPPORT_MOTION_H
#include "model/scene.h"
#include "taylor.h"

/* Returns 1 if the series of a scene needs the terms of support.h. Returns 0 for a motion without a
 * scene. */
static inline int kr_support_moves(const kr_scene *scene)
{
    return scene && kr_scene_needs_support_terms(scene);
}
/* Returns the largest rate of the support's motion, of the friction, and of the angular velocity
 * that the energy at the angular velocity W allows. Returns 0 if the series does not need the terms
 * of support.h. A shaken support may add energy, and kr_support_step then changes the unit of
 * time. */
double kr_support_rate(const kr_motion *motion, kr_vec3 W, int is_held);
/* Sets the constants of the support and of the friction. Returns the lever to which G refers. */
vec_dd kr_support_set_constants(kr_series s[2], const kr_motion *motion, double rate);
/* Returns the lever to which G refers, in the units of the motion. Writes the parts of G: the
 * constant part, and the factor of the cosine. */
vec_dd kr_support_split(const kr_motion *motion, dd *base, dd *sway);
/* Writes the cosine and the sine of the shaking at the time `end` + `low`, in units of 1 / rate. */
void kr_support_phase(const kr_motion *motion, double rate, double end, double low, dd *cosine,
                      dd *sine);
/* Sets the position of the support at the end of the last step of a series, where the next step
 * begins. */
void kr_support_place(kr_series s[2], const kr_motion *motion, double rate);
/* Limits the steps by the rates of the support. */
void kr_support_limit_steps(kr_series s[2], const kr_motion *motion, double rate);
/* Determines whether the top slides or is held by friction at the start. */
void kr_support_start(const kr_motion *motion);
/* Sets the mode of a step: whether the top slides or is held, and the friction. */
void kr_support_set_mode(const kr_motion *motion);
/* Returns the derivative of W at the end of the last step, without friction. */
kr_vec3 kr_support_acceleration(const kr_series *s);
/* Returns the friction in units of a series. */
double kr_support_friction(const kr_motion *motion, double rate);
/* Returns the sign of the spin of a top that slides in this step, 0 if friction holds the top. */
double kr_support_sliding(const kr_series *s);
/* Returns 1 if friction changes its direction at the end of the last step, or holds the top from
 * then on. Writes the factor of kr_support_jump_tangents. The factor is NaN at the start of a top
 * without spin that friction cannot hold, because the direction of the friction then depends on the
 * sign of the change. */
int kr_support_jumps(const kr_motion *motion, int order, dd *factor);
/* Makes the next step. With friction, a step ends where the spin reaches 0, and where friction can
 * no longer hold the top. */
kr_status kr_support_step(kr_motion *motion, const kr_kernel *kernel);
/* Writes the derivatives of (q | P) and W at the end of the last step, computed from the forces in
 * this step. */
void kr_support_slopes(const kr_motion *motion, double x[8], double w[4]);
#endif
