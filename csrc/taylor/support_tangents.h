/* Tangents of tops with dry friction or on moving supports. Private to taylor/. */
#ifndef KR_TAYLOR_SUPPORT_TANGENTS_H
#define KR_TAYLOR_SUPPORT_TANGENTS_H
#include "tangents.h"

/* Computes all Taylor coefficients of n single tangents along the path. The Taylor series of the
 * path is expanded about the time path->t, given in units of 1 / rate. */
void kr_support_expand_tangents(const kr_motion *motion, double rate, const kr_series path[2],
                                kr_tangent *first, size_t n, int order);
/* Subtracts factor * (derivative of the spin) * apex from the momentum part of n single tangents,
 * at the end of the last step. Tangents for which the derivative of the spin is zero remain
 * unchanged. */
void kr_support_jump_tangents(const kr_motion *motion, double rate, const kr_series ended[2],
                              kr_tangent *first, size_t n, dd factor);
#endif
