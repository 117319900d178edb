/* The numbers of a closed form, and the private layout of kr_nutation. */
#ifndef KR_EXACT_LAYOUT_H
#define KR_EXACT_LAYOUT_H
#include <stddef.h>
#include "kreisel.h"

/* A theta function, stored as two polynomials in sin^2 of the argument, one for the real and one
 * for the imaginary part. */
enum { KR_THETA_TERMS = 5 };
typedef struct kr_theta {
    double even[KR_THETA_TERMS], odd[KR_THETA_TERMS];
} kr_theta;
/* A phase that grows at a constant rate. The rate [turns per unit of time] and the initial value
 * [turns] of a phase are each stored as a sum of two doubles. */
typedef struct kr_phase {
    double fast, slow, start, more;
} kr_phase;

/* The closed-form solution, with the symbols defined in lane_types.h. All members consist of
 * doubles. */
typedef struct kr_exact_form {
    double period, precession_rate, spin_angle_rate; /* as in kr_exact_info */
    double begin;                                    /* [T] */
    double curve;                                    /* the kind of the series (lane_types.h) */
    kr_phase nutation, first, second;
    /* For series in the dual nome: pi K/K', or half of it for torque-free bodies, in two words, and
     * the slopes of the phases of alpha and beta. */
    double stretch, stretch_rest, slope[2];
    kr_theta alpha, beta, horizontal;
    double momentum, side; /* scale of the horizontal momentum; -1 if up and down are exchanged */
    kr_vec3 constant;      /* the constant part of the momentum */
    double framed;         /* 1 if `frame` is set */
    kr_quat frame[4];      /* see frame.h */
} kr_exact_form;
typedef struct kr_nutation_form {
    double least, greatest, t_least, t_greatest, critical_spin; /* as in kr_nutation */
    const char *motion_type;
    /* <m, e3> + <m, apex>, <m, e3> - <m, apex>, I1, the energy of the rotation about the apex, and
     * mass * gravity * com along the apex. */
    double sum, difference, inertia, axial_energy, lever;
} kr_nutation_form;

/* Causes a compilation error if the condition is false, by declaring an array type of negative
 * size. */
#define KR_CHECK_LAYOUT(name, condition) typedef char name[(condition) ? 1 : -1]
KR_CHECK_LAYOUT(kr_nutation_is_laid_out,
                sizeof(kr_nutation) == sizeof(kr_nutation_form) &&
                    offsetof(kr_nutation, least) == offsetof(kr_nutation_form, least) &&
                    offsetof(kr_nutation, greatest) == offsetof(kr_nutation_form, greatest) &&
                    offsetof(kr_nutation, t_least) == offsetof(kr_nutation_form, t_least) &&
                    offsetof(kr_nutation, t_greatest) == offsetof(kr_nutation_form, t_greatest) &&
                    offsetof(kr_nutation, critical_spin) ==
                        offsetof(kr_nutation_form, critical_spin) &&
                    offsetof(kr_nutation, motion_type) == offsetof(kr_nutation_form, motion_type) &&
                    offsetof(kr_nutation, private_) == offsetof(kr_nutation_form, sum));
#endif
