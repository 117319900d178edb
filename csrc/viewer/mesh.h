/* Shapes that the viewer draws for a top: a cuboid for the body, the trail of the apex, and an
 * elastic rod. All points are given in the space frame relative to the fixed point, beginning with
 * the most recent point of the motion. By Kirchhoff's analogy, the apex direction corresponds to
 * the tangent of the rod, and time corresponds to arc length (Bodack 2008, 5.7). */
#ifndef KR_MESH_H
#define KR_MESH_H
#include "kreisel.h"

/* Maximum number of points in a trail, maximum number of rings in a rod, and number of points in a
 * ring. */
enum { KR_MESH_POINTS = 2048, KR_MESH_RINGS = 400, KR_MESH_SIDES = 12 };

/* A cuboid, described in the user's body frame. */
typedef struct kr_box {
    kr_vec3 half, centre; /* half edges; centre relative to the fixed point [L] */
    kr_quat turn;         /* axes along the edges -> frame of description */
    double density;       /* [M L^-3] */
} kr_box;

/* The last `size` attitudes and momenta of a top. The array index of the state after step k is k
 * modulo `size`. */
typedef struct kr_trail {
    const kr_quat *attitude;
    const kr_vec3 *momentum;
    int64_t size, steps;
    double step; /* [T] */
} kr_trail;

/* Returns a cuboid with the same inertia, mass and centre of mass as the body. For an unphysical
 * body, the cuboid has only the same inertia and the same product of mass and centre of mass. In
 * this case, its density is 1 if possible; otherwise, the function returns the largest possible
 * cuboid. If no suitable cuboid exists, the function returns a cube with edges of length 2. */
kr_box kr_mesh_box(const kr_body *body);
/* Writes upper bounds on the momentum and the angular velocity, forward in time, which determine
 * the scale of the picture. The bounds are derived from a bound on the kinetic energy in a frame in
 * which the top never gains energy: the initial kinetic energy plus the largest possible loss of
 * potential energy. On a turning support, the potential energy includes the centrifugal potential.
 * The momentum is largest in a rotation about the axis of the largest moment of inertia, and the
 * angular velocity about that of the smallest; for a Lagrange top, the constant spin gives a closer
 * bound. On a shaken support, the energy has no bound: both numbers are then estimates with the
 * greatest acceleration. A bound of zero, as for a top that cannot move, is replaced by 1. */
void kr_mesh_limits(const kr_scene *scene, double *momentum, double *velocity);
/* Writes the trail of the apex on a sphere with the given radius. Older points of the trail are up
 * to 2 % closer to the centre of the sphere. Returns the number of points written, which is at most
 * KR_MESH_POINTS. */
int kr_mesh_trail(const kr_body *body, const kr_trail *trail, double radius, float point[][3]);
/* Writes the trail of the tip of the momentum vector, multiplied by `scale`. Returns the number of
 * points written, which is at most KR_MESH_POINTS. */
int kr_mesh_momentum_trail(const kr_trail *trail, double scale, float point[][3]);
/* Writes rings of KR_MESH_SIDES points around the centre line of the rod. The centre line starts at
 * the fixed point, and a unit of time corresponds to the length `scale`. The larger semi-axis of a
 * ring is `radius`. The ratio of the semi-axes is the ratio of the moments of inertia, raised to
 * the exponent `power`. With `power` 0.5, the bending stiffness of the rod is proportional to the
 * moments of inertia of the body. The rod in the thesis (Bodack 2008) has `power` 1. With `power`
 * 0, the rod has circular cross-sections. Returns the number of rings of the rod, which is at most
 * KR_MESH_RINGS. */
int kr_mesh_rod(const kr_body *body, const kr_trail *trail, double scale, double radius,
                double power, float point[][3]);
#endif
