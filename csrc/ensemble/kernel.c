/* The lanes of lanes.h, in doubles. This file is compiled once per instruction set: -DKR_ISA=avx2
 * -mavx2 -mfma, and so on (CMakeLists.txt). */
#include "growth.h"
#include "screen.h"

/* Ends the piece of every lane at a time. */
INLINE point end_piece(kr_lanes *l, wide end, int headless)
{
    const point r = sum_series(l, end, headless);
    wide_store(l->end, end);
    triple_store(l->end_p, r.p);
    triple_store(l->end_w, r.w);
    if (!headless) quat_store(l->end_q, attitude(l, &r, headless));
    return r;
}
/* Computes the next piece of every lane, from the end of this one. Returns the lanes that need
 * somebody's attention. */
INLINE unsigned step(kr_lanes *l, int headless)
{
    const wide t = wide_load(l->end);
    wide_store(l->t, t);
    triple_store(l->p[0], triple_load(l->end_p));
    triple_store(l->w[0], triple_load(l->end_w));
    if (!headless) quat_store(l->q, quat_load(l->end_q));
    expand(l, headless);
    const wide forward = wide_load(l->forward);
    wide end = wide_fma(forward, step_size(l, headless), t);
    point r = end_piece(l, end, headless);
    if (l->tangents) {
        const wide reached = follow(l, l->tangents);
        if (!mask_all(wide_equal(reached, end))) r = end_piece(l, reached, headless);
        end = reached;
    }
    const wide steps = wide_load(l->steps) + 1.0;
    wide_store(l->steps, steps);
    const wide size = triple_dot(r.p, r.p) + triple_dot(r.w, r.w) + wide_abs(r.turn);
    const mask well = mask_and(wide_less(size, wide_splat(INFINITY)),
                               wide_less(wide_splat(0.0), forward * (end - t)));
    const mask onward = mask_and(wide_less(forward * end, forward * wide_load(l->goal)),
                                 wide_at_most(steps, wide_load(l->most_steps)));
    unsigned called = mask_bits(mask_not(mask_and(well, onward)));
    if (l->watches) called |= mask_bits(mask_not(keeps_sign(l, end - t, &r)));
    return called & ((1u << LANES) - 1);
}
static unsigned advance_whole(kr_lanes *l, int steps)
{
    unsigned called = 0;
    while (!called && steps-- > 0) called = step(l, 0);
    return called;
}
static unsigned advance_headless(kr_lanes *l, int steps)
{
    unsigned called = 0;
    while (!called && steps-- > 0) called = step(l, 1);
    return called;
}
unsigned KR_NAME(kr_lanes_advance)(kr_lanes *l, int steps)
{
    return l->leave_heading ? advance_headless(l, steps) : advance_whole(l, steps);
}

void KR_NAME(kr_lanes_look)(kr_lanes *l)
{
    const int headless = l->leave_heading;
    const point r = sum_series(l, wide_load(l->at), headless);
    const quat q = attitude(l, &r, headless);
    const triple moment = triple_load(l->moment);
    const quat momentum = {wide_splat(0.0), moment.x * r.w.x, moment.y * r.w.y, moment.z * r.w.z};
    const quat m = quat_mul(quat_mul(q, momentum), quat_conj(q));
    const triple m_vector = {m.x, m.y, m.z};
    quat_store(l->out_q, quat_mul(q, quat_load(l->axes)));
    triple_store(l->out_m, m_vector);
    if (l->tangents) tell_growth(l, l->tangents);
}
void KR_NAME(kr_lanes_begin)(kr_lanes *l) { begin_growth(l, l->tangents); }
const int KR_NAME(kr_lanes_count) = LANES;
