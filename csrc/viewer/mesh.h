/* Points that the viewer draws for a top: a cuboid that represents the body, the trail of the apex,
 * and the corresponding elastic rod. Points are in space, relative to the fixed point. The scale is
 * chosen by the caller. The newest point comes first. By Kirchhoff's analogy, the tangent of the
 * rod is the apex, and the arc length is the time (Bodack 2008, 5.7). */
#ifndef KR_MESH_H
#define KR_MESH_H
#include "kreisel.h"

/* The maximum number of points of a trail, the maximum number of rings of a rod, and the number of
 * points of a ring. */
enum { KR_MESH_POINTS = 2048, KR_MESH_RINGS = 400, KR_MESH_SIDES = 12 };

/* A cuboid in the frame of description. */
typedef struct kr_box {
    kr_vec3 half, centre; /* half edges; centre relative to the fixed point [L] */
    kr_quat turn;         /* axes along the edges -> frame of description */
    double density;       /* [M L^-3] */
} kr_box;

/* The last `size` attitudes and momenta of a top. The values after step k are at index k % size. */
typedef struct kr_trail {
    const kr_quat *attitude;
    const kr_vec3 *momentum;
    int64_t size, steps;
    double step; /* [T] */
} kr_trail;

/* Returns a cuboid with the same inertia, mass and centre of mass as the body. If the body is
 * unphysical, there is no such cuboid. The function then returns a cuboid with the same inertia and
 * the same product mass * com. The density of this cuboid is 1 if possible; otherwise, the cuboid
 * is the largest possible one. If this is also impossible, returns a cube with edges of length
 * 2. */
kr_box kr_mesh_box(const kr_body *body);
/* Writes the magnitudes of momentum and angular velocity that determine the scale of the picture.
 * The momentum is bounded by (|m| - |rotor|)^2 / (2 I) <= initial kinetic energy + largest possible
 * loss of potential energy, with the largest moment I. The angular velocity is the bound on |m| -
 * |rotor| divided by I, plus the angular velocity of the support. The written value is at least the
 * initial value. Energies are computed in the inertial frame. A zero result, as for a top that
 * cannot move, is replaced by 1. */
void kr_mesh_limits(const kr_scene *scene, double *momentum, double *velocity);
/* Writes the trail of the apex on a sphere with the given radius. Older points are up to 2 % closer
 * to the centre. Returns the number of points, at most KR_MESH_POINTS. */
int kr_mesh_trail(const kr_body *body, const kr_trail *trail, double radius, float point[][3]);
/* Writes the trail of the tip of the momentum vector, multiplied by `scale`. Returns the number of
 * points, at most KR_MESH_POINTS. */
int kr_mesh_momentum_trail(const kr_trail *trail, double scale, float point[][3]);
/* Writes rings of KR_MESH_SIDES points around the centre line of the rod. The line starts at the
 * fixed point, and each unit of time corresponds to a length of `scale`. The larger semi-axis of a
 * ring is `radius`. The ratio of the semi-axes is the ratio of the moments of the body, raised to
 * the power `power`. With 0.5, the stiffness of the rod corresponds to the moments; 1 is the choice
 * of the thesis (Bodack 2008); 0 gives a round rod. Returns the number of rings, at most
 * KR_MESH_RINGS. */
int kr_mesh_rod(const kr_body *body, const kr_trail *trail, double scale, double radius,
                double power, float point[][3]);
#endif
