/* Tangents of tops with dry friction or on moving supports. Private to taylor/. */
#ifndef KR_TAYLOR_SUPPORT_TANGENTS_H
#define KR_TAYLOR_SUPPORT_TANGENTS_H
#include "tangents.h"

/* Computes all coefficients of n single deviations along the path, which is expanded about its time
 * t in units of 1 / rate. */
void kr_support_expand_tangents(const kr_motion *motion, double rate, const kr_series path[2],
                                kr_tangent *first, size_t n, int order);
/* Subtracts factor * (derivative of the spin) * apex from the change of the momentum of n single
 * deviations, at the end of the path's step. Deviations that do not change the spin are left
 * unchanged. */
void kr_support_jump_tangents(const kr_motion *motion, double rate, const kr_series ended[2],
                              kr_tangent *first, size_t n, dd factor);
#endif
