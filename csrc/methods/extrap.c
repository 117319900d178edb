/* Extrapolation with order and step-size control (extrapolation.h), applied to the twelve equations
 * of motion in space (Bodack 2008, 3.9; space_frame.h). No integral of motion is conserved. */
#include "extrapolation.h"
#include "space_frame.h"

static const gbs_form space_frame_form = {
    .begin = space_frame_begin,
    .rates = space_frame_rates,
    .velocity = space_frame_velocity,
    .momentum = space_frame_momentum,
    .attitude = space_frame_attitude,
};
EXTRAPOLATION_METHOD(
    extrap, space_frame_form,
    "Gragg-Bulirsch-Stoer extrapolation with order and step control for the twelve "
    "space-frame equations",
    "Gragg 1965; Bulirsch and Stoer 1966; Hairer, Norsett, Wanner, II.9")
