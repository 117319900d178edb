/* The step, the conserved energy and the rotations of the fourth-order map bobenko_suris4 of the
 * Lagrange top. The units are chosen such that the moment I1 is 1. Let a be the symmetry axis, m
 * the momentum, e the step of the map (not a vector e1, e2, e3), u = <a,e3>, c = <m,a>, l = <m,e3>,
 * g = mass * gravity * com.z / I1, g u the potential energy, and b = e^2 g / 4. The energy is
 * H = |m|^2/2 + g u if I3 = 1; else c^2 (1/I3 - 1)/2 must be added. With Cay(e m), the rotation
 * about m by the angle 2 atan(e |m| / 2), a step of the map consists of
 *     m += (e/2) F e3 x a,    then    a -> Cay(e m) a,    then again    m += (e/2) F e3 x a,
 * where F = g (1 - b u) / (1 + b^2 u^2). The map conserves c, l and
 *     K = (1 + b^2 u^2) (|m|^2/2 + F (u + e^2 c l / 4) - e^2 F^2 (1 - u^2) / 8)
 *         + e^2 g^2 (1 + u^2) / 8
 * which equals H + e^2 g l c / 4 + O(e^4). The map follows the same orbit as the continuous motion
 * of the top, but takes another time. To first order in g and to all orders in e |m|, a step e of
 * the map equals the motion of the top during the time h, followed by rotations by the angle
 * -e g c om about e3 and by the angle -e g l om about a, with
 *     z = e^2 K / 2,    h = e (A + g l c e^4/8 (B + (1 + z) dB/dz)),    om = e^2 B / 4
 *     A = atan(sqrt z) / sqrt z,    B = (1 - A) / z
 * K, z, h and om are constant along an orbit. (Derived here; no earlier source is known.) */
#ifndef KR_MAP_RATES_H
#define KR_MAP_RATES_H
#include <float.h>
#include "math/su2.h"

typedef struct map_rates {
    /* e and K; NaN if 2 h^2 |K| > 1 or h^2 |g| > 1, because the rates may not exist then */
    double step, energy;
    double precession, spin; /* the angles -e g c om and -e g l om */
} map_rates;

/* Returns the conserved energy K for the step e, at the symmetry axis a and the momentum m. */
static inline double find_conserved_energy(double step, double g, kr_vec3 axis, kr_vec3 momentum)
{
    const double e = step, b = 0.25 * e * e * g, u = axis.z,
                 shift = 0.25 * e * e * v_dot(momentum, axis) * momentum.z;
    const double slope = g * (1.0 - b * u) / (1.0 + b * b * u * u);
    const double inner = 0.5 * v_dot(momentum, momentum) + slope * (u + shift) -
                         0.125 * e * e * slope * slope * (1.0 - u * u);
    return (1.0 + b * b * u * u) * inner + 0.125 * e * e * g * g * (1.0 + u * u);
}
/* Returns the time h of the continuous motion that corresponds to the step e = r->step of the map,
 * or NaN if |z| >= 1/2. Sets the other members of `r`; if |z| >= 1/2, only r->energy. */
static inline double find_map_time(map_rates *r, double g, kr_vec3 axis, kr_vec3 momentum)
{
    const double e = r->step, c = v_dot(momentum, axis), l = momentum.z;
    double A = 0.0, B = 0.0, D = 0.0, power = 1.0;
    r->energy = find_conserved_energy(e, g, axis, momentum);
    const double z = 0.5 * e * e * r->energy;
    if (!(fabs(z) < 0.5)) return NAN;
    for (int k = 0; k < 52; k++) {
        A += power / (2 * k + 1);
        B += power / (2 * k + 3);
        D -= power * (k + 1) / (2 * k + 5);
        power *= -z;
    }
    r->precession = -0.25 * e * e * e * B * g * c;
    r->spin = -0.25 * e * e * e * B * g * l;
    return e * (A + 0.125 * e * e * e * e * g * l * c * (B + (1.0 + z) * D));
}
/* Returns e, K and the angles of the map step that corresponds to the time h = time_step of the
 * motion. `step` and `energy` are NaN if no e is found, or if 2 h^2 |K| > 1 or h^2 |g| > 1. */
static inline map_rates find_map_step(double time_step, double g, kr_vec3 axis, kr_vec3 momentum)
{
    const double h = time_step;
    map_rates r = {h, 0.0, 0.0, 0.0};
    double last = 0.0, reached = 0.0;
    for (int i = 0; i < 20; i++) {
        const double now = find_map_time(&r, g, axis, momentum), e = r.step;
        if (fabs(now - h) <= 4.0 * DBL_EPSILON * fabs(h)) {
            if (h * h * fmax(2.0 * fabs(r.energy), fabs(g)) <= 1.0) return r;
            break;
        }
        r.step += (h - now) * (e - last) / (now - reached);
        last = e;
        reached = now;
    }
    r.step = r.energy = NAN;
    return r;
}
#endif
