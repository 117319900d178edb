/* Conversion of vectors to the quaternions used in Taylor series. Private to taylor/. */
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
#endif
