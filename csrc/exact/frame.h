/* The frame of a closed-form solution: the map q -> left * q * right, stored as its values at 1, i,
 * j and k. This header is compiled once for each instruction set, as part of the source files that
 * include it. */
#ifndef KR_EXACT_FRAME_H
#define KR_EXACT_FRAME_H
#include "math/isa.h"
#include "math/su2.h"

static inline int is_one(kr_quat q) { return v_largest(q_vec(q)) == 0.0; }
/* Applies the linear map `f`, called a frame, to the quaternion q. */
INLINE kr_quat framed(const kr_quat f[4], kr_quat q)
{
    return q4((q.w * f[0].w + q.x * f[1].w) + (q.y * f[2].w + q.z * f[3].w),
              v3((q.w * f[0].x + q.x * f[1].x) + (q.y * f[2].x + q.z * f[3].x),
                 (q.w * f[0].y + q.x * f[1].y) + (q.y * f[2].y + q.z * f[3].y),
                 (q.w * f[0].z + q.x * f[1].z) + (q.y * f[2].z + q.z * f[3].z)));
}
/* Writes the frame q -> left * q * right. */
static inline void fill_frame(kr_quat frame[4], kr_quat left, kr_quat right)
{
    const double w = left.w, x = left.x, y = left.y, z = left.z;
    const kr_quat columns[4] = {left, {-x, w, z, -y}, {-y, -z, w, x}, {-z, y, -x, w}};
    for (int i = 0; i < 4; i++) frame[i] = q_mul(columns[i], right);
}
/* Writes the linear map q -> -i q, which interchanges up and down. */
static inline void fill_frame_below(kr_quat frame[4])
{
    fill_frame(frame, q4(0.0, v3(-1.0, 0.0, 0.0)), q_one());
}
/* Composes the linear map `frame` with the conversion from internal axes to the user's axes. `axes`
 * must not be the identity rotation. If `framed` is 0, the map is first set to the identity. */
static inline void fill_frame_axes(kr_quat frame[4], int framed, kr_quat axes)
{
    if (!framed) fill_frame(frame, q_one(), q_one());
    for (int i = 0; i < 4; i++) frame[i] = q_mul(frame[i], q_conj(axes));
}
#endif
