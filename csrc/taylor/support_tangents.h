/* Tangents of tops with dry friction or on moving supports. Private to taylor/. */
#ifndef KR_TAYLOR_SUPPORT_TANGENTS_H
#define KR_TAYLOR_SUPPORT_TANGENTS_H
#include "tangents.h"

/* Computes all coefficients of n single deviations along the path. The path is expanded about
 * path->t, in units of time of 1 / rate. */
void kr_support_expand_tangents(const kr_motion *motion, double rate, const kr_series path[2],
                                kr_tangent *first, size_t n, int order);
/* Subtracts factor * (derivative of the spin) * apex from the momentum deviation of n single
 * deviations, at the end of the step of the path. Leaves deviations that do not affect the spin
 * unchanged. */
void kr_support_jump_tangents(const kr_motion *motion, double rate, const kr_series ended[2],
                              kr_tangent *first, size_t n, dd factor);
#endif
