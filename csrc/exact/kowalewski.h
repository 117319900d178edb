/* The closed-form solution of a Kowalewski top, without theta functions. The axes, units and
 * constants are defined in kowalewski_curve.h. Kowalewski's variables w1 and w2 move on arcs, on
 * which w = N/D is a function of an angle x (kowalewski_curve.h). Let y be the angle from which x
 * follows by Landen transformations. The torus angles
 *     theta_i = y_i + S_i1(y1) + S_i2(y2)
 * with sine series S grow linearly with time. These two equations are solved for y1 and y2
 * (kowalewski_newton.h). The state follows from x1 and x2 by the formulas of Koetter (Acta Math. 17
 * (1893) 209), and the heading from the body vector C with
 *     C2 - i C1 = (z^2 + 2 q^2 zeta)/2,  C3 = q Re(conj(x) z),
 *     x = p + iq,  z = r x + g3,  zeta = g1 + i g2,
 * whose heading psi separates (docs/theory/closed_form.md):
 *     dpsi/dt = sum of l w/(w^2 + c) dw/F over both variables.
 * The heading is the sum of a phase that grows linearly with time, of one sine series for each arc,
 * and of the arguments of factors for poles near the ends of the arcs. */
#ifndef KR_EXACT_KOWALEWSKI_H
#define KR_EXACT_KOWALEWSKI_H
#include "torus.h"

/* The roots of phi have the indices 0, 1 and 2, and k and -k have the indices 3 and 4. */
enum { ROOT_K = 3, ROOT_MINUS_K = 4, ROOTS = 5, AT_INFINITY = -1 };
enum {
    HARMONICS = 1024, /* largest number of terms of a series */
    FOLDS = 12,
    STARTS = 16, /* number of torus angles in the table that starts Newton's method */
    NODES = 256  /* largest number of angles of each arc in the table of signs */
};

/* A Landen transformation with the modulus m. */
typedef struct kr_fold {
    double m, rest;   /* m, 1 - m */
    double crosswise; /* 1 if it moves singularities near pi/2, not 0 or pi */
} kr_fold;
/* An arc: N = A sin^2 + B cos^2 and D = C sin^2 + E cos^2 of x/2. For a real root e, and a sign
 * `way` that makes the value positive on the arc, way * (N - e D) = a sin^2 + b cos^2. */
typedef struct kr_kowalewski_arc {
    double A, B, C, E;
    double a[ROOTS], b[ROOTS], root_a[ROOTS], root_b[ROOTS]; /* and square roots of a and b */
    double scale; /* dw/F = scale D dx / (product of the square roots of all way * (N - e D)) */
    /* For complex roots e, way * (N - e D) = half * (center[0] - cos x) - center[1] + i im D. */
    double half, center[2], im;
    /* The poles w of the heading, which satisfy w^2 = -c. For those next to the arc, the square
     * roots of a and b; if both poles are real, a and b of each. */
    double pole_a[2], pole_b[2], both_a[2], both_b[2];
    int poles, low, high, folds;
    kr_fold fold[FOLDS]; /* from x to y */
} kr_kowalewski_arc;
/* The coefficients of sin(k y1) and of sin(k y2) in theta1 and theta2 [rad], and in half of the
 * heading [turns]. */
typedef struct kr_harmonic {
    double angle[4];   /* theta1, theta2 of arc 1; theta1, theta2 of arc 2 */
    double heading[4]; /* two, and two zeros that fill a vector */
} kr_harmonic;

typedef struct kr_kowalewski_torus {
    kr_torus torus; /* its phases are theta1/2, theta2/2 and half of the heading */
    double l, c, k;
    /* Koetter's constants for the roots e1 and e2 of phi: A^2 = 2 (e + h), B^2 = e^2 + c, A B = l.
     * The two elements belong to e1 and e2, or are real and imaginary parts for complex e1. */
    double A[2], B[2], A0, B0; /* A0, B0: the same for e0 */
    double A_square[2], B_square[2];
    double sum, apart, middle;     /* e1 + e2, e1 - e2 (or 2 Im e1), e0 - sum/2 */
    double one_apart, one_product; /* 1/apart, 1/((e0 - e1)(e0 - e2)) */
    double sign[6];       /* of Koetter's square roots: for e0, for e1 and e2, for each arc; of Z */
    double half_turns[2]; /* 1 if the quaternion changes sign when theta grows by 4 pi */
    int pair, fast;       /* 1 if e1 and e2 are complex; 1 if derivatives are always needed */
    double p[2], q[2];    /* averages of dw/F and (w - w0) dw/F on the arcs (kowalewski_newton.h) */
    int some_terms, terms;          /* numbers of terms: in steps of Newton's method, and of all */
    float guess[STARTS][STARTS][2]; /* y1 - theta1 and y2 - theta2 at equidistant theta1, theta2 */
    kr_kowalewski_arc arc[2];
    int nodes; /* number of angles of each arc in the table of signs, a power of two */
    /* The harmonics, and after them the table of signs (kr_kowalewski_nodes). */
    kr_harmonic harmonic[HARMONICS + NODES * NODES / 16];
} kr_kowalewski_torus;
/* Returns the table of signs: for nodes * nodes pairs of angles y1 and y2 within two turns each, a
 * quaternion without the phase and series of the heading, times 127. */
static inline const signed char *kr_kowalewski_nodes(const kr_kowalewski_torus *plan)
{
    return (const signed char *)(plan->harmonic + plan->terms);
}
#endif
