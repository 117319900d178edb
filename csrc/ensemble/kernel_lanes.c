/* Vectorized integration of many tops in double precision. Each SIMD lane holds one top; all lanes
 * make their steps together, each from its own time and with its own step size (lane_state.h). This
 * file is compiled once for each instruction set, with options such as -DKR_ISA=avx2 -mavx2. */
#include "lane_tangent.h"
#include "lane_event_test.h"

/* Evaluates the Taylor polynomials of every lane at the time `end`, and stores the result as the
 * end of the step. Returns the vertical, the angular velocity and the heading at `end`. */
INLINE lane_point evaluate_and_store_ends(kr_lanes *l, wide end, int headless)
{
    const lane_point r = evaluate_lane_series(l, l->order, end, headless);
    wide_store(l->end, end);
    lane_vec_store(l->end_p, r.p);
    lane_vec_store(l->end_w, r.w);
    if (!headless) lane_quat_store(l->end_q, lane_attitude(l, &r, headless));
    return r;
}
/* Advances every lane by one step. Returns the result of kr_lanes_isa.advance (lane_state.h). */
INLINE unsigned step_lanes_and_find_stopped(kr_lanes *l, int flags)
{
    const int headless = flags & KR_LANES_HEADLESS;
    const wide t = wide_load(l->end);
    wide_store(l->t, t);
    lane_vec_store(l->p[0], lane_vec_load(l->end_p));
    lane_vec_store(l->w[0], lane_vec_load(l->end_w));
    if (!headless) lane_quat_store(l->q, lane_quat_load(l->end_q));
    expand_lane_series(l, flags);
    const wide forward = wide_load(l->forward);
    wide end = wide_fma(forward, lane_step_size(l, headless), t);
    lane_point r = evaluate_and_store_ends(l, end, headless);
    if (!(flags & KR_LANES_DAMPED) && l->tangents) {
        const wide reached = propagate_tangent_over_step(l, l->tangents);
        if (!mask_all(wide_equal(reached, end))) r = evaluate_and_store_ends(l, reached, headless);
        end = reached;
    }
    const wide steps = wide_load(l->steps) + 1.0;
    wide_store(l->steps, steps);
    const wide size = lane_vec_dot(r.p, r.p) + lane_vec_dot(r.w, r.w) + wide_abs(r.turn);
    const mask well = mask_and(wide_less(size, wide_splat(INFINITY)),
                               wide_less(wide_splat(0.0), forward * (end - t)));
    const mask onward = mask_and(wide_less(forward * end, forward * wide_load(l->goal)),
                                 wide_at_most(steps, wide_load(l->max_steps)));
    unsigned called = mask_bits(mask_not(mask_and(well, onward)));
    if (l->has_event)
        called |= mask_bits(mask_not(find_lanes_without_event(l, end - t, &r, flags)));
    return called & ((1u << LANES) - 1);
}
#define ADVANCE(name, flags)                                                                       \
    static unsigned name(kr_lanes *l, int steps)                                                   \
    {                                                                                              \
        unsigned called = 0;                                                                       \
        while (!called && steps-- > 0) called = step_lanes_and_find_stopped(l, flags);             \
        return called;                                                                             \
    }
ADVANCE(advance_with_heading, 0)
ADVANCE(advance_headless, KR_LANES_HEADLESS)
ADVANCE(advance_damped, KR_LANES_DAMPED)
ADVANCE(advance_damped_headless, KR_LANES_DAMPED | KR_LANES_HEADLESS)
unsigned KR_NAME(kr_lanes_advance)(kr_lanes *l, int steps)
{
    static unsigned (*const advance[])(kr_lanes *, int) = {
        [0] = advance_with_heading,
        [KR_LANES_HEADLESS] = advance_headless,
        [KR_LANES_DAMPED] = advance_damped,
        [KR_LANES_DAMPED | KR_LANES_HEADLESS] = advance_damped_headless,
    };
    return advance[l->terms](l, steps);
}

void KR_NAME(kr_lanes_sample)(kr_lanes *l)
{
    const int headless = l->terms & KR_LANES_HEADLESS;
    const lane_point r = evaluate_lane_series(l, l->order, wide_load(l->at), headless);
    const lane_quat q = lane_attitude(l, &r, headless);
    const lane_vec M = lane_vec_fma(lane_vec_load(l->moment), r.w, lane_vec_load(l->rotor));
    const lane_quat momentum = {wide_splat(0.0), M};
    const lane_quat m = lane_quat_mul(lane_quat_mul(q, momentum), lane_quat_conj(q));
    lane_quat_store(l->out_q, lane_quat_mul(q, lane_quat_load(l->axes)));
    lane_vec_store(l->out_m, m.v);
    if (l->tangents) write_growth_at_sample_time(l, l->tangents);
}
void KR_NAME(kr_lanes_begin)(kr_lanes *l) { project_initial_tangents(l, l->tangents); }
const int KR_NAME(kr_lanes_count) = LANES;
