/* The closed form of a free gyrostat, and its states. With the phases `first` and `second`, the
 * attitude q = (w, x, y, z) in the axes of the plan is
 *     (w + i z, x + i y) = e^{i second} (X(u), Y(u)) / sqrt(|X|^2 + |Y|^2),  u = e^{i first},
 * where the coefficients of X and Y fall like those of theta functions. */
#ifndef KR_EXACT_FREE_GYROSTAT_H
#define KR_EXACT_FREE_GYROSTAT_H
#include "torus.h"

enum { GYROSTAT_TERMS = 48 };
typedef struct kr_gyrostat_plan {
    kr_torus torus; /* turn[0] and turn[1] are the phases `first` and `second` */
    double least;   /* the least exponent of u in X and Y, which `second` includes */
    kr_vec3 momentum;
    kr_quat map[4]; /* attitude in the axes of the plan -> attitude */
    double terms;
    double coefficient[GYROSTAT_TERMS][4]; /* real and imaginary parts in X and in Y */
} kr_gyrostat_plan;

INLINE state_lanes gyrostat_kernel(const kr_gyrostat_plan *plan, wide time, dd first, dd second)
{
    const int terms = (int)plan->terms;
    wide s, c, sum[4];
    sincos_turns(first, &s, &c);
    for (int i = 0; i < 4; i++) sum[i] = wide_splat(plan->coefficient[terms - 1][i]);
    for (int k = terms - 2; k >= 0; k--)
        for (int i = 0; i < 4; i += 2) {
            const wide re = sum[i] * c - sum[i + 1] * s, im = sum[i] * s + sum[i + 1] * c;
            sum[i] = plan->coefficient[k][i] + re;
            sum[i + 1] = plan->coefficient[k][i + 1] + im;
        }
    const wide n =
        1.0 / wide_sqrt((sum[0] * sum[0] + sum[1] * sum[1]) + (sum[2] * sum[2] + sum[3] * sum[3]));
    sincos_turns(second, &s, &c);
    const wide p[4] = {n * (sum[0] * c - sum[1] * s), n * (sum[2] * c - sum[3] * s),
                       n * (sum[2] * s + sum[3] * c), n * (sum[0] * s + sum[1] * c)};
    const kr_quat *map = plan->map;
    const quat_lanes q = {(p[0] * map[0].w + p[1] * map[1].w) + (p[2] * map[2].w + p[3] * map[3].w),
                          (p[0] * map[0].x + p[1] * map[1].x) + (p[2] * map[2].x + p[3] * map[3].x),
                          (p[0] * map[0].y + p[1] * map[1].y) + (p[2] * map[2].y + p[3] * map[3].y),
                          (p[0] * map[0].z + p[1] * map[1].z) +
                              (p[2] * map[2].z + p[3] * map[3].z)};
    const kr_vec3 m = plan->momentum;
    return (state_lanes){time, q, {wide_splat(m.x), wide_splat(m.y), wide_splat(m.z)}};
}
INLINE state_lanes gyrostat_after(const void *memory, wide time, dd span)
{
    const kr_gyrostat_plan *plan = memory;
    return gyrostat_kernel(plan, time, torus_phase_at(&plan->torus, 0, span),
                           torus_phase_at(&plan->torus, 1, span));
}
#endif
