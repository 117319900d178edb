/* Points for the viewer's picture of a top: a cuboid that represents the body, the trail of the
 * apex, and the elastic rod of the motion. Points are in space, relative to the fixed point. The
 * caller sets the lengths. The newest point comes first. By Kirchhoff's analogy the tangent of the
 * rod is the apex, and the arc length is the time (Bodack 2008, 5.7). */
#ifndef KR_MESH_H
#define KR_MESH_H
#include "kreisel.h"

/* Largest number of points of a trail, largest number of rings of a rod, and number of points of a
 * ring. */
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

/* Returns a cuboid with the inertia, mass and centre of mass of the body. Unphysical bodies have no
 * such cuboid. For unphysical bodies, returns a cuboid with the inertia and the product mass * com
 * of the body. Its density is 1 if possible; otherwise the largest such cuboid is returned. If
 * there is no such cuboid either, returns a cube with edges of length 2. */
kr_box kr_mesh_box(const kr_body *body);
/* Writes the lengths of momentum and angular velocity that set the scale of the picture. The
 * momentum is bounded by (|m| - |rotor|)^2 / (2 I) <= initial kinetic energy + largest possible
 * loss of potential energy, with the largest moment I. The scale of the angular velocity is the
 * bound of |m| - |rotor| divided by I, plus the rate of the support, but at least the initial
 * value. Energies are computed in the inertial frame. A scale that would be zero, as for a top that
 * cannot move, is 1. */
void kr_mesh_limits(const kr_scene *scene, double *momentum, double *velocity);
/* Writes the trail of the apex on a sphere with this radius. Older points are up to 2 % nearer the
 * centre. Returns the number of points, at most KR_MESH_POINTS. */
int kr_mesh_trail(const kr_body *body, const kr_trail *trail, double radius, float point[][3]);
/* Writes the trail of the tip of `scale` times the momentum. Returns the number of points, at most
 * KR_MESH_POINTS. */
int kr_mesh_momentum_trail(const kr_trail *trail, double scale, float point[][3]);
/* Writes rings of KR_MESH_SIDES points about the rod's centre line. The line begins at the fixed
 * point and has the length `scale` for each unit of time. The larger half axis of a ring is
 * `radius`. The ratio of the half axes is the ratio of the body's moments, raised to `power`. With
 * `power` 0.5 the stiffness of the rod corresponds to the moments of the body; 1 is the choice of
 * the thesis (Bodack 2008); 0 gives a round rod. Returns the number of rings, at most
 * KR_MESH_RINGS. */
int kr_mesh_rod(const kr_body *body, const kr_trail *trail, double scale, double radius,
                double power, float point[][3]);
#endif
