/* What the two halves of the map's set-up share: curve.c finds its curve, map.c makes the plan. Floor 3. */
#ifndef KR_MAP_H
#define KR_MAP_H
#include "plan.h"

typedef struct map_link {       /* of the first step */
    dd l, c, b, energy, x;      /* constants of the map */
    dd s, climb;                /* u + u', u' - u */
    dd w[3], p[4];              /* its momentum; the cubic's coefficients */
    dd s1, s2, s3, below, above;            /* roots; s - s1, s2 - s */
    double unit;                /* m = unit w */
} map_link;
typedef struct map_curve {      /* phases with half period pi */
    dd k2, kp2, mean, ratio;    /* k^2, k'^2, agm(1, k'), K'/K */
    dd eta, y1, y2;
    double plus2, minus1, start;            /* 1 + u2, 1 - u1, phase of the first link's middle */
} map_curve;

map_link kr_map_link(const exact_top *top, dd i1, double step);
dd kr_map_height(const map_link *k, dd s);              /* 1 + b s */
map_curve kr_map_curve(map_link *k);                    /* finds the roots, too */
void kr_map_linear(const map_link *k, dd s, double sign, dd *re, dd *im);       /* N+ or N- */
#endif
