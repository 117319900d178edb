/* Shapes that the viewer draws for a top: a cuboid for the body, the trails of the apex and of the
 * momentum, and an elastic rod. The apex is the unit vector from the fixed point to the centre of
 * mass. All points are in the space frame, relative to the fixed point, the most recent ones first.
 * By Kirchhoff's analogy, the apex corresponds to the tangent of the rod, and time to its arc
 * length (Bodack 2008, 5.7). */
#ifndef KR_MESH_H
#define KR_MESH_H
#include "kreisel.h"

/* Maximum numbers of points in a trail and of rings in a rod; number of points in a ring. */
enum { KR_MESH_POINTS = 2048, KR_MESH_RINGS = 400, KR_MESH_SIDES = 12 };

/* A cuboid, described in the user's body frame. */
typedef struct kr_box {
    kr_vec3 half, centre; /* half edges; centre relative to the fixed point [L] */
    kr_quat turn;         /* axes along the edges -> frame of description */
    double density;       /* [M L^-3] */
} kr_box;

/* The last `size` attitudes and momenta of a top; those after step k have the index k % size. */
typedef struct kr_trail {
    const kr_quat *attitude;
    const kr_vec3 *momentum;
    int64_t size, steps; /* `steps`: number of steps made */
    double step;         /* [T] */
} kr_trail;

/* Returns a cuboid with the inertia, mass and centre of mass of the body. If there is none,
 * replaces mass and centre of mass by others with the same product, such that the density is 1 if
 * possible, or else the volume is largest. If that is impossible, returns a cube of edge 2. */
kr_box kr_mesh_box(const kr_body *body);
/* Writes upper bounds on the magnitudes of the momentum and the angular velocity, forward in time,
 * for the scale of the picture. The bounds follow from the largest possible kinetic energy in a
 * frame in which the top never gains energy, and from the largest and smallest moments of inertia.
 * The spin of a Lagrange top never increases, which gives a closer bound in an inertial frame. On a
 * shaken support, the bounds are estimates from the peak acceleration. 1 replaces a bound of 0. */
void kr_mesh_limits(const kr_scene *scene, double *momentum, double *velocity);
/* Writes the trail of the apex on a sphere with the given radius. Older points of the trail are up
 * to 2 % closer to the centre of the sphere. Returns the number of points, <= KR_MESH_POINTS. */
int kr_mesh_trail(const kr_body *body, const kr_trail *trail, double radius, float point[][3]);
/* Writes the trail of scale * momentum. Returns the number of points, <= KR_MESH_POINTS. */
int kr_mesh_momentum_trail(const kr_trail *trail, double scale, float point[][3]);
/* Writes the rings of a rod: ellipses of KR_MESH_SIDES points around its centre line, which starts
 * at the fixed point. A unit of time corresponds to the length `scale`. The larger semi-axis of a
 * ring is `radius`. The ratio of the semi-axes is the ratio, raised to `power`, of the moments of
 * inertia about the two principal axes farthest from the apex. With `power` 0.5, the bending
 * stiffnesses of the rod have the ratio of these moments; with `power` 0, the rings are circles.
 * Returns the number of rings, which is at most KR_MESH_RINGS. */
int kr_mesh_rod(const kr_body *body, const kr_trail *trail, double scale, double radius,
                double power, float point[][3]);
#endif
