/* Points for the page's picture of a top: a cuboid for a body given by numbers, the trail of the
 * apex, and its elastic rod. Points are in space, seen from the fixed point, and scaled by the
 * caller; the newest comes first. By Kirchhoff's analogy the tangent of the rod is the apex, and
 * its arc length the time (Bodack 2008, 5.7). */
#ifndef KR_MESH_H
#define KR_MESH_H
#include "kreisel.h"

/* Largest numbers of points of a trail, of rings of a rod, and the points of a ring. */
enum { KR_MESH_POINTS = 2048, KR_MESH_RINGS = 400, KR_MESH_SIDES = 12 };

/* A cuboid in the frame of description. */
typedef struct kr_box {
    kr_vec3 half, centre; /* half edges; seen from the fixed point [L] */
    kr_quat turn;         /* axes of its edges -> frame of description */
    double density;       /* [M L^-3] */
} kr_box;

/* The last `size` attitudes of a top; that after step k at k % size. */
typedef struct kr_trail {
    const kr_quat *attitude;
    int64_t size, steps;
    double step; /* [T] */
} kr_trail;

/* Returns a cuboid with the body's inertia, mass and lever. If there is none, as for unphysical
 * bodies, returns one with the body's inertia and mass times lever, of density 1 or else the
 * largest. If there is none either, returns a cube of edge 2. */
kr_box kr_mesh_box(const kr_body *body);
/* Writes bounds of momentum and velocity: |m|^2 / 2 I <= present kinetic energy + energy of the
 * fall, with the largest moment I. Both are 1 for a top that cannot move. */
void kr_mesh_limits(const kr_scene *scene, double *momentum, double *velocity);
/* Writes the trail of the apex on a sphere; the oldest point is 2 % nearer the centre. Returns the
 * number of points, at most KR_MESH_POINTS. */
int kr_mesh_trail(const kr_body *body, const kr_trail *trail, double radius, float point[][3]);
/* Writes rings of KR_MESH_SIDES points about the rod's centre line. It begins at the fixed point,
 * is `scale` long for each unit of time, and `radius` thick on its thicker side. The ratio of its
 * sides is that of the body's moments to the given power: 0.5 for the stiffness of the body, 1 as
 * in the thesis, 0 for a round rod. Returns the number of rings, at most KR_MESH_RINGS. */
int kr_mesh_rod(const kr_body *body, const kr_trail *trail, double scale, double radius,
                double power, float point[][3]);
#endif
