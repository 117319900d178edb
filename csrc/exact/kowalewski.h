/* The closed-form solution of a Kowalewski top. The axes are defined in kowalewski_curve.h. The
 * attitude (w, x, y, z) of these axes in space, and the angular velocity (p, q, r) along them, are
 *     w + iz = i (S - T) e/2D,   x + iy = (S + T) e/2D,   p = P/D,   q = Q/D,   r = R/D,
 *     S, T, P, Q, R = sum of c[k1, k2] exp(i (k1 theta1 + k2 theta2)/2),  2 D^2 = |S|^2 + |T|^2.
 * The angles theta1 and theta2 and the phase of the complex number e grow linearly with time. The
 * coefficients c are real, except that in S, T, P and R they are imaginary if k2 is odd. The sums
 * P, Q and R have real values. For motions near a separatrix, kowalewski_dual.h provides equivalent
 * sums whose terms do not cancel. Bobenko, Reyman and Semenov-Tian-Shansky (Communications in
 * Mathematical Physics 122, 1989, 321) give theta functions of the same algebraic curve. */
#ifndef KR_EXACT_KOWALEWSKI_H
#define KR_EXACT_KOWALEWSKI_H
#include "torus.h"

enum { SUM_S, SUM_T, SUM_P, SUM_Q, SUM_R, SUMS };
enum { WIDE_MOST = 64 /* largest |k| */, SUM_ROWS = 768, SUM_TERMS = 4096 };

/* A row of coefficients with equal k1, in which k2 increases in steps of two. */
typedef struct kr_sum_row {
    int k1, k2, count, imaginary;
} kr_sum_row;

typedef struct kr_theta_sums {
    kr_kowalewski head;
    kr_torus torus;  /* its phases are theta1/2, theta2/2 and the phase of e */
    int dual;        /* 1 if the sums are the dual sums of kowalewski_dual.h */
    int wide[2];     /* the largest |k1| and |k2| */
    double bend[3];  /* of dual sums: the elements of 2 pi^2 B^-1 */
    double twist[2]; /* of dual sums: turns of e for half a turn of each angle */
    int rows[SUMS];  /* numbers of rows of the sums */
    kr_sum_row row[SUM_ROWS];
    double term[SUM_TERMS];
} kr_theta_sums;
#endif
