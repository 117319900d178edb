/* The rates of bobenko_suris4, and the energy that it keeps, in units of I1 = 1 without the spin's
 * energy. With u = <a,e3>, c = <m,a>, l = <m,e3>, g the torque at its largest, and b = e^2 g / 4,
 * the map of step e
 *     half kick m += (e/2) V'(u) e3 x a,    a' = Cay(e m) a,    half kick,
 *     V'(u) = g (1 - b u) / (1 + b^2 u^2)
 * keeps c, l and
 *     I = (1 + b^2 u^2) (|m|^2/2 + V' (u + e^2 c l / 4) - e^2 V'^2 (1 - u^2) / 8)
 *         + e^2 g^2 (1 + u^2) / 8
 * which is H + e^2 g l c / 4 + O(e^4); e^2 g^2 may be added to it, but would err in the rates at
 * e^4. It follows the top's orbit, but at another rate. To first order in g and all orders in e
 * |m|, a step e of the map is a step h of the top, turned by -e g c om about e3 and by -e g l om
 * about a, with
 *     z = e^2 I / 2,    h = e (A + g l c e^4/8 (B + (1 + z) B')),    om = e^2 B / 4
 *     A = atan(sqrt z) / sqrt z,    B = (1 - A) / z
 * All are constants of the orbit. (Derived for this library; no earlier source is known to us.) */
#ifndef KR_RESUMMED_H
#define KR_RESUMMED_H
#include <float.h>
#include "math/su2.h"

typedef struct resummed {
    /* e, I; NaN where h^2 times 2 |I| or |g| is above 1: the rates need not exist */
    double step, energy;
    double precession, spin; /* of a step: -e g c om, -e g l om */
} resummed;

static inline double resummed_energy(double e, double g, kr_vec3 a, kr_vec3 m)
{
    const double b = 0.25 * e * e * g, u = a.z, shift = 0.25 * e * e * v_dot(m, a) * m.z;
    const double slope = g * (1.0 - b * u) / (1.0 + b * b * u * u);
    const double inner =
        0.5 * v_dot(m, m) + slope * (u + shift) - 0.125 * e * e * slope * slope * (1.0 - u * u);
    return (1.0 + b * b * u * u) * inner + 0.125 * e * e * g * g * (1.0 + u * u);
}
/* Returns the step h of the top for which r->step stands. */
static inline double resummed_step(resummed *r, double g, kr_vec3 a, kr_vec3 m)
{
    const double e = r->step, c = v_dot(m, a), l = m.z;
    double A = 0.0, B = 0.0, D = 0.0, power = 1.0;
    r->energy = resummed_energy(e, g, a, m);
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
/* Finds the map's step for a step h of the top, by the secant. */
static inline resummed resum(double h, double g, kr_vec3 a, kr_vec3 m)
{
    resummed r = {h, 0.0, 0.0, 0.0};
    double last = 0.0, reached = 0.0;
    for (int i = 0; i < 20; i++) {
        const double now = resummed_step(&r, g, a, m), e = r.step;
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
