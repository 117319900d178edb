/* A fourth-order variant of the Bobenko-Suris map of the Lagrange top. With the symmetry axis a (a
 * unit vector in space), the momentum m and u = <a,e3>, a step of size h consists of constant
 * rotations about e3 and a (model/map_rates.h), and of the following map with another step size e:
 *     m+ = m + (e/2) V'(u) e3 x a,    a' = Cay(e m+ / I1) a,    m' = m+ + (e/2) V'(u') e3 x a'
 * Here, a', m' and u' are new values, but V' = dV/du for a modified potential V
 * (bobenko_suris4_state). I1 is the moment normal to a, and Cay(v) the rotation whose quaternion is
 * parallel to (1, v/2). The method is explicit and integrable, and needs one kick per step. It
 * conserves the vertical and axial momenta and a modified energy (kr_state_modified_energy). The
 * step size e and the rotations are computed only once, from the initial state. They depend on the
 * orbit, so each step conserves the symplectic form only up to O(h^7). A step size h is refused if
 * 2 h^2 |K| or h^2 * mass * |gravity| * |com| exceeds 1, in units with I1 = 1, because e might not
 * exist. K is the invariant of the map in model/map_rates.h. */
#include "bobenko_suris.h"
#include "model/map_rates.h"

/* Each step also includes constant rotations about the vertical and the symmetry axis. The
 * rotations in all steps are applied together, but only when a state is read. */
typedef struct {
    bobenko_suris_orbit o; /* o.m includes half of the next kick */
    double b;              /* V'(u) = lever (1 - b u) / (1 + b^2 u^2) */
    double precession;     /* angle of the rotation about e3 in a step */
} bobenko_suris4_state;

/* Returns the momentum after a modified kick of `part` times the full strength. */
static kr_vec3 momentum_after_modified_kick(const bobenko_suris4_state *p, double part)
{
    const double bu = p->b * q_turn_e3(p->o.q).z;
    return bobenko_suris_momentum_after_kick(&p->o, part * p->o.kick_strength *
                                                        ((1.0 - bu) / (1.0 + bu * bu)));
}
static kr_status bobenko_suris4_reset(kr_motion *motion, const kr_state *start)
{
    bobenko_suris4_state *p = (bobenko_suris4_state *)motion->work;
    const double i1 = motion->inertia.x, g = motion->lever.z / i1;
    const kr_vec3 a = q_turn_e3(start->q);
    const map_rates r = find_map_step(motion->step, g, a, v_scale(1.0 / i1, start->m));
    if (!isfinite(r.step)) return KR_ERR_STEP_SIZE;
    const double turned = motion->step * v_dot(start->m, a) * (1.0 / motion->inertia.z - 1.0 / i1);
    bobenko_suris_begin(&p->o, motion, start, r.step, 0.5 * (turned + r.spin));
    p->b = 0.25 * r.step * r.step * g;
    p->precession = r.precession;
    p->o.m = momentum_after_modified_kick(p, 0.5);
    return KR_OK;
}
static kr_status bobenko_suris4_step(kr_motion *motion, double until)
{
    bobenko_suris4_state *p = (bobenko_suris4_state *)motion->work;
    (void)until;
    bobenko_suris_drift(&p->o);
    p->o.m = momentum_after_modified_kick(p, 1.0);
    motion->stats.evaluations++;
    return KR_OK;
}
static void bobenko_suris4_read(const kr_motion *motion, kr_state *s)
{
    const bobenko_suris4_state *p = (const bobenko_suris4_state *)motion->work;
    kr_quat turn = q_one();
    sin_cos(0.5 * p->o.steps * p->precession, &turn.z, &turn.w);
    bobenko_suris_read_orbit(&p->o, s);
    s->q = q_mul(turn, s->q);
    s->m = q_turn(turn, momentum_after_modified_kick(p, -0.5));
}

const kr_method kr_method_bobenko_suris4 = {
    KR_METHOD_TEXTS("bobenko_suris4",
                    "Bobenko-Suris map with kick and rates corrected to order 4, still integrable",
                    "<m,e3>, <m,apex>, a modified energy", "after Bobenko and Suris 1999"),
    .order = 4,
    .flags = KR_METHOD_REVERSIBLE | KR_METHOD_ALGEBRAIC | KR_METHOD_LAGRANGE_ONLY,
    .work = sizeof(bobenko_suris4_state) / sizeof(double),
    .reset = bobenko_suris4_reset,
    .step = bobenko_suris4_step,
    .read = bobenko_suris4_read,
    .is_valid = bobenko_suris_is_valid,
};
