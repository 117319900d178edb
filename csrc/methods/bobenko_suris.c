/* The Bobenko-Suris map, an integrable discretization of the Lagrange top in the space frame:
 *     m' = m + h M p x a,    a' = Cay(h m' / I1) a
 * with the momentum m, a = q com q* (in bobenko_suris.h, a has unit length), the step size h, the
 * mass M and p = gravity * e3. I1 is the moment about axes normal to the symmetry axis. Cay(v) is
 * the rotation whose quaternion is parallel to (1, v/2). The map conserves the vertical and axial
 * momenta, and E + h M <p x a, m> / (2 I1), where E is the energy. Half a kick conjugates the maps
 * bobenko_suris and bobenko_suris2. (Bobenko and Suris, Communications in Mathematical Physics 204,
 * 1999; Bodack 2008, 4.2.) */
#include "bobenko_suris.h"

static kr_status bobenko_suris_reset(kr_motion *motion, const kr_state *start)
{
    bobenko_suris_begin((bobenko_suris_orbit *)motion->work, motion, start, motion->step,
                        bobenko_suris_half_twist(motion, start));
    return KR_OK;
}
static kr_status bobenko_suris_step(kr_motion *motion, double until)
{
    bobenko_suris_orbit *o = (bobenko_suris_orbit *)motion->work;
    (void)until;
    o->m = bobenko_suris_momentum_after_kick(o, o->kick_strength);
    bobenko_suris_drift(o);
    motion->stats.evaluations++;
    return KR_OK;
}
static void bobenko_suris_read(const kr_motion *motion, kr_state *s)
{
    bobenko_suris_read_orbit((const bobenko_suris_orbit *)motion->work, s);
}

const kr_method kr_method_bobenko_suris = {
    KR_METHOD_TEXTS("bobenko_suris",
                    "integrable discretization of the Lagrange top in the space frame",
                    "<m,e3>, <m,apex>, a modified energy", "Bobenko and Suris 1999; thesis 4.2"),
    .order = 1,
    .flags = KR_METHOD_SYMPLECTIC | KR_METHOD_ALGEBRAIC | KR_METHOD_LAGRANGE_ONLY,
    .work = BOBENKO_SURIS_WORK,
    .reset = bobenko_suris_reset,
    .step = bobenko_suris_step,
    .read = bobenko_suris_read,
    .is_valid = bobenko_suris_is_valid,
};
