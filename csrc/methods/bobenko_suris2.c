/* The symmetric form of the Bobenko-Suris map: half kick, Cayley drift, half kick.
 *     m+ = m + (h/2) M p x a,    a' = Cay(h m+ / I1) a,    m' = m+ + (h/2) M p x a'
 * with the momentum m, a = q com q* (in bobenko_suris.h, a has unit length), the step size h, the
 * mass M and p = gravity * e3. I1 is the moment about axes normal to the symmetry axis. Cay(v) is
 * the rotation whose quaternion is parallel to (1, v/2). The map is integrable, because it is
 * conjugate to bobenko_suris. The composition is symmetric, and is therefore of order 2. The map
 * conserves <m,p>, <m,a> and E - h^2 M^2 |p x a|^2 / (8 I1), where E is the energy. The last half
 * kick of a step is merged with the first half kick of the next step. */
#include "bobenko_suris.h"

static kr_status bobenko_suris2_reset(kr_motion *motion, const kr_state *start)
{
    bobenko_suris_orbit *o = (bobenko_suris_orbit *)motion->work;
    bobenko_suris_begin(o, motion, start, motion->step, bobenko_suris_half_twist(motion, start));
    o->m = bobenko_suris_momentum_after_kick(o, 0.5 * o->kick_strength);
    return KR_OK;
}
static kr_status bobenko_suris2_step(kr_motion *motion, double until)
{
    bobenko_suris_orbit *o = (bobenko_suris_orbit *)motion->work;
    (void)until;
    bobenko_suris_drift(o);
    o->m = bobenko_suris_momentum_after_kick(o, o->kick_strength);
    motion->stats.evaluations++;
    return KR_OK;
}
static void bobenko_suris2_read(const kr_motion *motion, kr_state *s)
{
    const bobenko_suris_orbit *o = (const bobenko_suris_orbit *)motion->work;
    bobenko_suris_read_orbit(o, s);
    s->m = bobenko_suris_momentum_after_kick(o, -0.5 * o->kick_strength);
}

const kr_method kr_method_bobenko_suris2 = {
    KR_METHOD_TEXTS("bobenko_suris2",
                    "symmetric form of the Bobenko-Suris map: half kick, Cayley drift, half kick",
                    "<m,e3>, <m,apex>, a modified energy", "conjugate to Bobenko and Suris 1999"),
    .order = 2,
    .flags =
        KR_METHOD_SYMPLECTIC | KR_METHOD_REVERSIBLE | KR_METHOD_ALGEBRAIC | KR_METHOD_LAGRANGE_ONLY,
    .work = BOBENKO_SURIS_WORK,
    .reset = bobenko_suris2_reset,
    .step = bobenko_suris2_step,
    .read = bobenko_suris2_read,
    .is_valid = bobenko_suris_is_valid,
};
