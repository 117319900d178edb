/* Extrapolation with order and step-size control (extrapolation.h), applied to the twelve equations
 * of motion in the inertial frame (Bodack 2008, 3.9; space_frame.h). The method does not conserve
 * the integrals of motion. */
#include "extrapolation.h"
#include "space_frame.h"

static const gbs_form space_frame_form = {
    .begin = space_frame_begin,
    .rates = space_frame_rates,
    .velocity = space_frame_velocity,
    .momentum = space_frame_momentum,
    .attitude = space_frame_attitude,
};
static kr_status extrap_reset(kr_motion *motion, const kr_state *start)
{
    return gbs_reset(motion, start, &space_frame_form);
}
static kr_status extrap_step(kr_motion *motion, double until)
{
    return gbs_step(motion, until, &space_frame_form);
}
static void extrap_read(const kr_motion *motion, kr_state *s)
{
    gbs_read(motion, s, &space_frame_form);
}

const kr_method kr_method_extrap = {
    .name = "extrap",
    .text = "Gragg-Bulirsch-Stoer extrapolation with order and step control for the twelve "
            "space-frame equations",
    .conserves = "nothing",
    .reference = "Gragg 1965; Bulirsch and Stoer 1966; Hairer, Norsett, Wanner, II.9",
    .order = 0,
    .flags = KR_METHOD_ADAPTIVE | KR_METHOD_ABSOLUTE | KR_METHOD_ROTORS | KR_METHOD_TURNING |
             KR_METHOD_GRADIENT,
    .work = GBS_WORK,
    .reset = extrap_reset,
    .step = extrap_step,
    .read = extrap_read,
    .is_valid = gbs_is_valid,
};
