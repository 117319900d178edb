/* What is to be seen of a top: a cuboid for a body that is known by its numbers alone, the way of
 * its apex, its elastic rod. Lengths as the caller scales them, from the fixed point, in space;
 * newest first. Kirchhoff: the tangent of the rod is the apex, its arc length the time
 * (Bodack 2008, 5.7). */
#ifndef KR_PICTURE_H
#define KR_PICTURE_H
#include "kreisel.h"

enum { KR_PICTURE_POINTS = 2048, KR_PICTURE_RINGS = 400, KR_PICTURE_SIDES = 12 };

typedef struct kr_box {
    /* half edges; where its centre is in the frame in which the body was described, */
    kr_vec3 half, centre;
    kr_quat turn; /* and how its edges lie there */
    double density;
} kr_box;

typedef struct kr_trail {    /* where a top has been */
    const kr_quat *attitude; /* after step k at k % size: the last `size` of them */
    int64_t size, steps;
    double eps; /* from step to step [T] */
} kr_trail;

/* The cuboid with the body's inertia, mass and lever. If no body has these, as with made-up
 * numbers, one with its inertia and mass times lever, for only the product moves a top: of density
 * 1, or else the largest. If there is none at all, a cube of edge 2. */
kr_box kr_picture_box(const kr_body *body);
/* How long momentum and velocity get: |m|^2 / 2 I <= kinetic energy now + what the fall can give,
 * for the largest moment I, and a velocity to match; 1 for what never moves. */
void kr_picture_reach(const kr_scene *scene, double *momentum, double *velocity);
/* Where the apex was, on a sphere that is 2 % smaller for the oldest: KR_PICTURE_POINTS at most.
 * How many. */
int kr_picture_way(const kr_body *body, const kr_trail *trail, double radius, float point[][3]);
/* Rings of KR_PICTURE_SIDES points about the rod's centre line, which begins at the fixed point and
 * is `scale` long for each unit of time; `radius` on the thicker side. KR_PICTURE_RINGS at most.
 * How many. */
int kr_picture_rod(const kr_body *body, const kr_trail *trail, double scale, double radius,
                   float point[][3]);
#endif
