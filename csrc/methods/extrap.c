/* Extrapolation with order and step-size control (extrapolation.h), applied to the twelve equations
 * of motion in the inertial frame (Bodack 2008, 3.9; rest_frame.h). The method does not conserve
 * the integrals of motion. */
#include "extrapolation.h"
#include "rest_frame.h"

static const gbs_form rest_frame_form = {
    .begin = rest_frame_begin,
    .rates = rest_frame_rates,
    .velocity = rest_frame_velocity,
    .momentum = rest_frame_momentum,
    .attitude = rest_frame_attitude,
};
static kr_status extrap_reset(kr_motion *motion, const kr_state *start)
{
    return gbs_reset(motion, start, &rest_frame_form);
}
static kr_status extrap_step(kr_motion *motion, double until)
{
    return gbs_step(motion, until, &rest_frame_form);
}
static void extrap_read(const kr_motion *motion, kr_state *s)
{
    gbs_read(motion, s, &rest_frame_form);
}

const kr_method kr_method_extrap = {
    .name = "extrap",
    .text = "Gragg-Bulirsch-Stoer extrapolation with order and step control for the twelve "
            "rest-frame equations",
    .conserves = "nothing",
    .reference = "Gragg 1965; Bulirsch and Stoer 1966; Hairer, Norsett, Wanner, II.9",
    .order = 0,
    .flags = KR_METHOD_ADAPTIVE | KR_METHOD_ABSOLUTE | KR_METHOD_ROTORS,
    .work = GBS_WORK,
    .reset = extrap_reset,
    .step = extrap_step,
    .read = extrap_read,
    .is_valid = gbs_is_valid,
};
