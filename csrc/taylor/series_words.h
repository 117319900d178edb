/* Conversion of vectors to the quaternions used in Taylor series, and scaling of vectors. Private
 * to taylor/. */
#ifndef KR_TAYLOR_SERIES_WORDS_H
#define KR_TAYLOR_SERIES_WORDS_H
#include "math/su2_dd.h"

/* Stores a vector as a pure quaternion in an array of four doubles. */
static inline void set_lanes(double lanes[4], kr_vec3 v)
{
    lanes[0] = 0.0;
    v_put(lanes + 1, v);
}
/* Stores the high and the low words of a double-double vector as two pure quaternions. */
static inline void set_vector_words(double high[4], double low[4], vec_dd v)
{
    set_lanes(high, vdd_high(v));
    set_lanes(low, vdd_low(v));
}
/* Divides each component of a vector by the moment of inertia about its axis. */
static inline vec_dd divide_by_axes(vec_dd a, kr_vec3 A)
{
    const vec_dd v = {dd_div(a.x, dd_of(A.x)), dd_div(a.y, dd_of(A.y)), dd_div(a.z, dd_of(A.z))};
    return v;
}
/* Multiplies a vector by `rate`, a power of two. */
static inline vec_dd scale_by_power(double rate, vec_dd a)
{
    const vec_dd v = {dd_scale(rate, a.x), dd_scale(rate, a.y), dd_scale(rate, a.z)};
    return v;
}
#endif
