/* The closed-form solution of a Goryachev-Chaplygin top without angular momentum about the
 * vertical. In terms of the rescaled time tau, d tau = dt/|m|, two angles alpha1 and alpha2 grow at
 * constant rates. The attitude (axes of the closed-form solution -> space) is the product
 *     exp(k psi/2) (i + k)/sqrt2 (c1 + c2 i - s2 j + s1 k)/sqrt(|m|).
 * Here c1 and s1 are Fourier series in alpha1, and c2 and s2 are Fourier series in alpha2. Moreover
 * |m| = c1^2 + s1^2 + c2^2 + s2^2 and m = |m| (cos psi, sin psi, 0). The heading psi is a Fourier
 * series in alpha1 and alpha2. The time t is a multiple of tau plus a sine series in alpha1 and
 * another in alpha2. Computing tau from t requires the numerical solution of a scalar equation. */
#ifndef KR_EXACT_GORYACHEV_CHAPLYGIN_H
#define KR_EXACT_GORYACHEV_CHAPLYGIN_H
#include "torus.h"

enum {
    ANGLE_TERMS = 1024,     /* largest number of terms of a series in one angle */
    HEADING_ROWS = 1024,    /* largest number of multiples of the first angle */
    HEADING_WIDE = 514,     /* largest number of multiples of the second angle, even */
    HEADING_TERMS = 131072, /* largest number of coefficients; each pair has two */
    SLOW_TERMS = 64,
    GUESSES = 3 /* steps of Newton's method with the first terms of the series of the time */
};

/* The Fourier series in one of the torus angles alpha1 and alpha2. The terms of the series are
 * cosines or sines of k times the angle, or of k + 1/2 times the angle, for integers k >= 0. */
typedef struct kr_angle_series {
    int count[2], times; /* numbers of terms: of c and s, and of the time */
    int is_sine[2], is_whole[2];
    double part[2][ANGLE_TERMS]; /* coefficients of c and s */
    /* Fourier coefficients of the periodic part of t and of its derivative. */
    double time[ANGLE_TERMS], time_rate[ANGLE_TERMS];
    double rate;       /* d angle/d tau */
    double half_turns; /* rate of half of the angle [turns] */
} kr_angle_series;
/* The terms in the Fourier series of the heading that contain a given multiple of the first torus
 * angle. Each multiple of the second angle has a cosine and a sine coefficient. The member `from`
 * is the index of the first stored multiple of the second angle. */
typedef struct kr_heading_row {
    int first, from, count; /* `first` is the index of the multiple; some multiples have no row */
} kr_heading_row;
/* A term in the Fourier series of the heading that has a frequency close to zero. Such a term is
 * integrated from the initial time, because its Fourier coefficient in the integral would be very
 * large. */
typedef struct kr_slow_term {
    int first, second;          /* multiples of half of each angle */
    double rate, value, over;   /* over = value/rate */
    double phase, sine, offset; /* phase at the start and its offset [turns]; sine of the phase */
} kr_slow_term;

typedef struct kr_chaplygin_plan {
    kr_torus torus;
    kr_angle_series angle[2];
    double tau_rate; /* mean of d tau/dt */
    double mean;     /* mean of |m| over tau */
    /* The slip, tau - tau_rate * t, is the periodic part of tau. The members are its bound, its
     * initial value, its rounding error, and the tolerance of Newton's method: after a smaller
     * step, only a rounding error remains. */
    double most_slip, slip, rounding, tolerance;
    int guess_terms[GUESSES];
    /* The initial value of psi/2, in turns, as the sum of two doubles, and the initial value of the
     * series for psi, in radians. */
    double heading_start, heading_more, heading_value;
    int is_even; /* 1 if psi changes sign when both angles change sign */
    int wide;    /* terms of the longest row, counted from the first multiple */
    int rows, slow_terms;
    kr_heading_row row[HEADING_ROWS];
    kr_slow_term slow[SLOW_TERMS];
    double term[HEADING_TERMS];
} kr_chaplygin_plan;
#endif
