/* The closed form of a Kowalewski top, as a plan in memory of a fixed size. The attitude (working
 * axes -> space) has w + iz = i (S - T) e/2D and x + iy = (S + T) e/2D, and the angular velocity
 * there is P/D, Q/D, R/D, with a number e that turns at a constant rate and
 *     S, T, P, Q, R = sum of c[k1, k2] exp(i (k1 theta1 + k2 theta2)/2),  2 D^2 = |S|^2 + |T|^2.
 * theta1 and theta2 grow with time. c is real, or imaginary where k2 is odd and the sum is not Q.
 * P, Q and R are real. (Bobenko, Reyman, Semenov-Tian-Shansky, Comm. Math. Phys. 122 (1989) 321,
 * have theta functions of the same curve.) */
#ifndef KR_EXACT_KOWALEWSKI_H
#define KR_EXACT_KOWALEWSKI_H
#include "kreisel.h"
#include "math/isa.h"

enum { SUM_S, SUM_T, SUM_P, SUM_Q, SUM_R, SUMS };
enum { WIDE_MOST = 64 /* the largest |k| */, SUM_ROWS = 768, SUM_TERMS = 4096 };

/* Coefficients of k2, k2 + 2, ... for one k1. */
typedef struct kr_sum_row {
    int k1, k2, count, imaginary;
} kr_sum_row;

typedef struct kr_theta_sums {
    kr_kowalewski head;
    double begin;     /* [T] */
    double momentum;  /* [M L^2 T^-1] of a momentum of one */
    kr_quat frame;    /* frame of description -> working axes */
    kr_phase turn[3]; /* theta1/2, theta2/2 and the phase of e */
    int wide[2];      /* the largest |k1| and |k2| */
    int rows[SUMS];   /* of each sum */
    kr_sum_row row[SUM_ROWS];
    double term[SUM_TERMS];
} kr_theta_sums;

/* kowalewski.c makes these: they make one plan and read one state. `memory` has room for
 * kr_kowalewski_size() bytes. With `own` a plan is in working axes and own units, from time 0. */
typedef struct kr_kowalewski_one {
    size_t (*size)(void);
    kr_status (*plan)(const kr_scene *scene, int own, double bound, void *memory);
    kr_state (*state)(const kr_theta_sums *plan, double t);
} kr_kowalewski_one;
extern const kr_kowalewski_one kr_kowalewski_one_base, kr_kowalewski_one_avx2;
/* kernel_kowalewski.c makes these: they read many states at once. */
typedef void kr_kowalewski_many(const kr_theta_sums *plan, size_t n, const double t[],
                                kr_state out[]);
kr_kowalewski_many kr_kowalewski_many_base, kr_kowalewski_many_avx2, kr_kowalewski_many_avx512;
typedef struct kr_kowalewski_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_kowalewski_one *one;
    kr_kowalewski_many *many;
} kr_kowalewski_isa;
/* Makes a plan in working axes and own units from time 0, for the method `exact`. A plan begins
 * with kr_theta_sums, which can be copied. */
kr_status kr_kowalewski_own(const kr_scene *scene, void *memory);
/* Returns the i-th instruction set that was compiled in, the widest first; NULL beyond the last. */
const kr_kowalewski_isa *kr_kowalewski_isa_at(int i);
#endif
