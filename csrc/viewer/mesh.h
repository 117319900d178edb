/* What is to be seen of a top: a cuboid for a body that is known by its numbers alone, the way of
 * its apex, its elastic rod. Points are seen from the fixed point, in space, scaled as the caller
 * wants; the newest comes first. Kirchhoff: the tangent of the rod is the apex, its arc length the
 * time (Bodack 2008, 5.7). */
#ifndef KR_MESH_H
#define KR_MESH_H
#include "kreisel.h"

/* A way has so many points at most, a rod so many rings, each of so many points. */
enum { KR_MESH_POINTS = 2048, KR_MESH_RINGS = 400, KR_MESH_SIDES = 12 };

/* A cuboid in the frame in which the body was described. */
typedef struct kr_box {
    kr_vec3 half, centre; /* half edges; seen from the fixed point [L] */
    kr_quat turn;         /* along its edges -> along the axes of that frame */
    double density;       /* [M L^-3] */
} kr_box;

/* Where a top has been: its last `size` attitudes, after step k at k % size. */
typedef struct kr_trail {
    const kr_quat *attitude;
    int64_t size, steps;
    double step; /* [T] */
} kr_trail;

/* Returns the cuboid with the body's inertia, mass and lever. If no cuboid has these, as with
 * made-up numbers, it is one with the body's inertia and mass times lever, for only the product
 * moves a top: of density 1, or else the largest. If there is none at all, it is a cube of edge
 * 2. */
kr_box kr_mesh_box(const kr_body *body);
/* Tells how long momentum and velocity get: |m|^2 / 2 I <= kinetic energy now + what the fall can
 * give, for the largest moment I, and a velocity to match; 1 for what never moves. */
void kr_mesh_limits(const kr_scene *scene, double *momentum, double *velocity);
/* Finds where the apex was, on a sphere that is 2 % smaller for the oldest. Returns the number of
 * points, KR_MESH_POINTS at most. */
int kr_mesh_trail(const kr_body *body, const kr_trail *trail, double radius, float point[][3]);
/* Lays rings of KR_MESH_SIDES points about the rod's centre line, which begins at the fixed
 * point and is `scale` long for each unit of time; it is `radius` thick on the thicker side, and
 * its sides are to each other as the body's moments to this power: 0.5 is as stiff as the body, 1
 * as the thesis draws it, 0 round. Returns the number of rings, KR_MESH_RINGS at most. */
int kr_mesh_rod(const kr_body *body, const kr_trail *trail, double scale, double radius,
                double power, float point[][3]);
#endif
