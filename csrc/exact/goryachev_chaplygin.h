/* The closed-form solution of a Goryachev-Chaplygin top without angular momentum about the
 * vertical. In terms of the rescaled time tau, d tau = dt/|m|, two angles alpha1 and alpha2 grow at
 * constant rates. The attitude (axes of the closed-form solution -> space) is the product
 *     exp(k psi/2) (i + k)/sqrt2 (c1 + c2 i - s2 j + s1 k)/sqrt(|m|),
 * where |m| = c1^2 + s1^2 + c2^2 + s2^2 and m = |m| (cos psi, sin psi, 0). Here c1 and s1 are
 * algebraic functions of an angle x of an arc (goryachev_chaplygin_curve.h), x - alpha1 is a
 * periodic function of alpha1, and the same holds for c2, s2 and alpha2. The time t is a multiple of
 * tau plus two such functions. Computing tau from t requires the numerical solution of a scalar
 * equation.
 *
 * The rate of the heading psi is a function of both angles, and a sum of a function of alpha1 and a
 * function of alpha2 does not have the same integral. On the sections alpha1 = 2 pi j/J, psi is
 * therefore a Fourier series in alpha2, and between two sections an integral along the motion. */
#ifndef KR_EXACT_GORYACHEV_CHAPLYGIN_H
#define KR_EXACT_GORYACHEV_CHAPLYGIN_H
#include "torus.h"

enum {
    CELL_TERMS = 16,        /* coefficients of a polynomial */
    MOST_CELLS = 512,       /* largest number of cells of an arc */
    MOST_TERMS = 5 << 15,   /* largest number of coefficients of all cells and sections */
    MOST_SAMPLES = 1 << 11, /* largest number of values of alpha2 on a section */
    SLOW_TERMS = 256,
    HEADING_NODES = 8 /* of the quadrature from a section */
};

/* An arc on which one of Chaplygin's variables u moves, and functions of its torus angle alpha. */
typedef struct kr_chaplygin_arc {
    /* |u| = (A s^2 + B c^2)/D with D = C s^2 + c^2, where s and c are the sine and cosine of x/2. */
    double A, B, C;
    /* The factors a s^2 + b c^2 of p+ D^3 (the first three) and p- D^3. The factor of an end of the
     * arc is a constant times s^2 or c^2; its a and b are both this constant. If there is a pair of
     * complex factors, index 4 holds their real part, and `imaginary` is their imaginary part over
     * D. */
    double a[6], b[6], imaginary;
    int pair;
    int has_sine[2], has_cosine[2]; /* is an end at x = 0, or at x = pi, a root of p+ or p-? */
    double sign;                    /* of sqrt|u| cos(chi/2) for 0 < x < pi */
    double rate;                    /* d alpha/d tau */
    double half_rate;               /* rate of half of alpha [turns] */
    /* Cells are intervals of equal length between alpha = 0 and pi. Each has the Chebyshev
     * coefficients of (x - alpha)/2 [turns], and then those of the periodic part of t. Both functions
     * are odd. */
    int cells, first; /* `cells` is a power of two; index of the first coefficient */
} kr_chaplygin_arc;
/* A term of the heading that has nearly the frequency of a resonance. Where alpha1 = (2n + 1) pi, it
 * grows by value * sin(phase + n * step). */
typedef struct kr_slow_term {
    double value, phase;    /* phase [turns] */
    double step, step_more; /* [turns] */
    double sine;            /* of half of a step */
} kr_slow_term;

typedef struct kr_chaplygin_plan {
    kr_torus torus;
    kr_chaplygin_arc arc[2];
    double mean; /* mean of |m| over tau */
    /* The slip, tau minus its mean rate times t, is the periodic part of tau. The members are its
     * bound, its rounding error, and the tolerance of Newton's method: after a smaller step, only a
     * rounding error remains. */
    double most_slip, rounding, tolerance;
    /* The value of psi/2 where the series for psi is zero, in turns, as the sum of two doubles. */
    double heading_start, heading_more;
    int is_even;  /* 1 if psi changes sign when both angles change sign */
    int is_whole; /* 1 if the multiples of alpha2 in psi are integers, 0 if they are half-odd */
    int sections; /* between alpha1 = 0 and pi, a power of two */
    int first;    /* index of the first coefficient of a section */
    int terms;    /* cosines of a section, even. The coefficients of as many sines follow. */
    int slow_terms;
    double ratio; /* of the rates of alpha2 and alpha1 */
    double span;  /* of tau in a turn of alpha1 */
    kr_slow_term slow[SLOW_TERMS];
    double term[MOST_TERMS];
} kr_chaplygin_plan;
#endif
