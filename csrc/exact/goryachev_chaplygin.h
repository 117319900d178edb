/* The closed form of a Goryachev-Chaplygin top with <m, e3> = 0, as a plan in memory of a fixed
 * size. In the time tau with d tau = dt/|m| two angles alpha1 and alpha2 grow at constant rates,
 * and the attitude (closed form's axes -> space) is the product
 *     exp(k psi/2) (i + k)/sqrt2 (c1 + c2 i - s2 j + s1 k)/sqrt(|m|),
 * with cosine and sine series c and s of one angle each, |m| = c1^2 + s1^2 + c2^2 + s2^2 and
 * m = |m| (cos psi, sin psi, 0). The heading psi is a series in both angles. The time t is tau's
 * multiple plus a sine series of each angle, an equation with one unknown. */
#ifndef KR_EXACT_GORYACHEV_CHAPLYGIN_H
#define KR_EXACT_GORYACHEV_CHAPLYGIN_H
#include "kreisel.h"
#include "math/isa.h"

enum {
    ANGLE_TERMS = 1024,     /* of a series of one angle, at most */
    HEADING_ROWS = 1024,    /* multiples of the first angle, at most */
    HEADING_WIDE = 512,     /* and of the second */
    HEADING_TERMS = 131072, /* pairs of coefficients are two of these */
    SLOW_TERMS = 64
};

/* The series of one angle. They go by multiples of the angle, or by those and a half. */
typedef struct kr_angle_series {
    int count[2], times; /* of c and s, and of the time's series */
    int is_sine[2], is_whole[2];
    double part[2][ANGLE_TERMS];                      /* c and s */
    double time[ANGLE_TERMS], time_rate[ANGLE_TERMS]; /* and k times the coefficients */
    double rate;                                      /* of the angle in tau */
    double half_turns;                                /* the rate of half of it, in turns */
} kr_angle_series;
/* The heading's terms of one multiple of the first angle: pairs of coefficients of the cosine and
 * the sine of the second's multiples `from`, from + 1, ... */
typedef struct kr_heading_row {
    int first, from, count; /* `first` may be left out of the series */
} kr_heading_row;
/* A term of the heading whose frequency is nearly zero: it is integrated from the start on. */
typedef struct kr_slow_term {
    int first, second;          /* orders, in halves */
    double rate, value, over;   /* over = value/rate */
    double phase, sine, offset; /* at the start [turns], its sine, and that of the orders' sum */
} kr_slow_term;

typedef struct kr_chaplygin_plan {
    kr_goryachev_chaplygin head;
    double begin;    /* [T] */
    double momentum; /* [M L^2 T^-1] of a momentum of one */
    double vertical; /* <m, e3> of the scene, a rounding [M L^2 T^-1] */
    kr_quat frame;   /* frame of description -> axes of the closed form */
    kr_phase turn[2];
    kr_angle_series angle[2];
    double tau_rate;                   /* mean growth of tau in t */
    double mean;                       /* of |m| over tau */
    double most_slip, slip, tolerance; /* of tau less its mean growth: bound, start, accuracy */
    double heading_start, heading_more, heading_value; /* psi/2 [turns], and the series there */
    int is_even;                                       /* psi is an odd function of both angles */
    int wide; /* terms of the longest row, from the first multiple on */
    int rows, slow_terms;
    kr_heading_row row[HEADING_ROWS];
    kr_slow_term slow[SLOW_TERMS];
    double term[HEADING_TERMS];
} kr_chaplygin_plan;

/* goryachev_chaplygin.c makes these: they make one plan and read one state. `memory` has room for
 * kr_goryachev_chaplygin_size() bytes. With `own` a plan is in working axes and own units, from
 * time 0. */
typedef struct kr_chaplygin_one {
    size_t (*size)(void);
    kr_status (*plan)(const kr_scene *scene, int own, double bound, void *memory);
    kr_state (*state)(const kr_chaplygin_plan *plan, double t);
} kr_chaplygin_one;
extern const kr_chaplygin_one kr_chaplygin_one_base, kr_chaplygin_one_avx2;
/* kernel_goryachev_chaplygin.c makes these: they read many states at once. */
typedef void kr_chaplygin_many(const kr_chaplygin_plan *plan, size_t n, const double t[],
                               kr_state out[]);
kr_chaplygin_many kr_chaplygin_many_base, kr_chaplygin_many_avx2, kr_chaplygin_many_avx512;
typedef struct kr_chaplygin_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_chaplygin_one *one;
    kr_chaplygin_many *many;
} kr_chaplygin_isa;
/* Makes a plan in working axes and own units from time 0, for the method `exact`. A plan begins
 * with kr_chaplygin_plan, which can be copied. */
kr_status kr_chaplygin_own(const kr_scene *scene, void *memory);
/* Returns whether <m, e3> of a checked scene is zero within the rounding of its momentum. */
int kr_chaplygin_is_level(const kr_scene *scene);
/* Returns the i-th instruction set that was compiled in, the widest first; NULL beyond the last. */
const kr_chaplygin_isa *kr_chaplygin_isa_at(int i);
#endif
