/* Tangents of tops on moving supports. Private to taylor/. */
#ifndef KR_TAYLOR_SUPPORT_TANGENTS_H
#define KR_TAYLOR_SUPPORT_TANGENTS_H
#include "tangents.h"

/* Computes all coefficients of n single deviations along the path, which is expanded about its time
 * t in units of 1 / rate. */
void kr_support_expand_tangents(const kr_motion *motion, double rate, const kr_series path[2],
                                kr_tangent *first, size_t n, int order);
#endif
