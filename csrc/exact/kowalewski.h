/* The closed form of a Kowalewski top, as a plan in memory of a fixed size. The axes are those of
 * kowalewski_curve.h. The attitude (w, x, y, z) of these axes in space, and the angular velocity
 * (p, q, r) along them, are
 *     w + iz = i (S - T) e/2D,   x + iy = (S + T) e/2D,   p = P/D,   q = Q/D,   r = R/D,
 *     S, T, P, Q, R = sum of c[k1, k2] exp(i (k1 theta1 + k2 theta2)/2),  2 D^2 = |S|^2 + |T|^2.
 * theta1 and theta2 grow linearly with time, and e is a complex number of modulus 1 whose phase
 * grows linearly. The coefficients c are real, except that they are imaginary for odd k2 in all
 * sums but Q. The sums P, Q and R are real. Bobenko, Reyman and Semenov-Tian-Shansky (Comm. Math.
 * Phys. 122 (1989) 321) give theta functions of the same curve. */
#ifndef KR_EXACT_KOWALEWSKI_H
#define KR_EXACT_KOWALEWSKI_H
#include "layout.h"
#include "math/isa.h"

enum { SUM_S, SUM_T, SUM_P, SUM_Q, SUM_R, SUMS };
enum { WIDE_MOST = 64 /* largest |k| */, SUM_ROWS = 768, SUM_TERMS = 4096 };

/* The row of coefficients with one k1 and with k2, k2 + 2, ... */
typedef struct kr_sum_row {
    int k1, k2, count, imaginary;
} kr_sum_row;

typedef struct kr_theta_sums {
    kr_kowalewski head;
    double begin;     /* [T] */
    double momentum;  /* unit of momentum [M L^2 T^-1] */
    kr_quat frame;    /* frame of description -> axes of the closed form */
    kr_phase turn[3]; /* theta1/2, theta2/2 and the phase of e */
    int wide[2];      /* the largest |k1| and |k2| */
    int rows[SUMS];   /* numbers of rows of the sums */
    kr_sum_row row[SUM_ROWS];
    double term[SUM_TERMS];
} kr_theta_sums;

/* Functions of kowalewski.c, which set up one plan and evaluate one state. `memory` has room for
 * kr_kowalewski_size() bytes. If `own` is nonzero, the plan is in working axes and own units and
 * begins at time 0. */
typedef struct kr_kowalewski_one {
    size_t (*size)(void);
    kr_status (*plan)(const kr_scene *scene, int own, double bound, void *memory);
    kr_state (*state)(const kr_theta_sums *plan, double t);
} kr_kowalewski_one;
extern const kr_kowalewski_one kr_kowalewski_one_base, kr_kowalewski_one_avx2;
/* Functions of kernel_kowalewski.c, which evaluate many states. */
typedef void kr_kowalewski_many(const kr_theta_sums *plan, size_t n, const double t[],
                                kr_state out[]);
kr_kowalewski_many kr_kowalewski_many_base, kr_kowalewski_many_avx2, kr_kowalewski_many_avx512;
typedef struct kr_kowalewski_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_kowalewski_one *one;
    kr_kowalewski_many *many;
} kr_kowalewski_isa;
/* Sets up a plan in working axes and own units from time 0, for the method `exact`. The memory then
 * begins with a kr_theta_sums, which can be copied. */
kr_status kr_kowalewski_own(const kr_scene *scene, void *memory);
/* Returns the i-th instruction set that was compiled in, the widest first, or NULL after the
 * last. */
const kr_kowalewski_isa *kr_kowalewski_isa_at(int i);
#endif
