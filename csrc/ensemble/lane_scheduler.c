/* The scheduler assigns tops to SIMD lanes and integrates them (lane_state.h). Each top has its own
 * time and step sizes. The goal of a lane is the next requested time of its top. When a top has
 * reached its last requested time, the next top is loaded into its lane. If the computation in a
 * lane fails, the scalar code (kr_top) repeats it from the initial state and reports the error. The
 * units are internal (method.h), except for the unit of frequency, kr_step_polynomial.rate. */
#include <float.h>
#include "math/exponent.h"
#include "taylor/slow.h"
#include "slots.h"

enum { STEPS_PER_POLL = 64 /* largest number of steps between two calls of poll */ };

const kr_lanes_isa *kr_lanes_isa_at(int i)
{
    static const kr_lanes_isa isas[] = {
#ifdef KR_WITH_AVX512
        {"avx512", &kr_lanes_count_avx512, kr_has_avx512, kr_lanes_advance_avx512,
         kr_lanes_sample_avx512, kr_lanes_begin_avx512},
#endif
#ifdef KR_WITH_AVX2
        {"avx2", &kr_lanes_count_avx2, kr_has_avx2, kr_lanes_advance_avx2, kr_lanes_sample_avx2,
         kr_lanes_begin_avx2},
#endif
        {KR_BASE_NAME, &kr_lanes_count_base, kr_has_base, kr_lanes_advance_base,
         kr_lanes_sample_base, kr_lanes_begin_base},
    };
    return i < (int)(sizeof isas / sizeof *isas) ? &isas[i] : NULL;
}

/* Sets l->order and l->log2_tol for the tolerance `tol` (2^-53 if `tol` is 0). The first row with
 * until <= log2(tol) gives the order, and the number `less` by which log2(tol) is lowered, but not
 * beyond -54.5. In measurements (docs/theory/ensembles.md), the results are as accurate as those of
 * kr_top, and other orders are not faster. */
static void set_order_and_tolerance(kr_lanes *l, double tol)
{
    static const struct {
        double until, less;
        int order;
    } rows[] = {{-18.0, 2.5, 12},
                {-26.0, 4.5, 14},
                {-32.0, 5.5, 16},
                {-48.0, 6.0, 18},
                {-DBL_MAX, 2.0, 20}};
    const double log2_tol = tol > 0.0 ? log2(tol) : -53.0;
    int i = 0;
    while (log2_tol < rows[i].until) i++;
    l->order = rows[i].order;
    l->log2_tol = fmin(log2_tol, fmax(log2_tol - rows[i].less, -54.5));
}
void kr_scheduler_configure(kr_worker *worker)
{
    int i = 0;
    while (!kr_lanes_isa_at(i)->runs_here()) i++; /* skip unsupported sets */
    worker->isa = kr_lanes_isa_at(i);
    set_order_and_tolerance(worker->lanes, worker->config.tol);
}
void kr_scheduler_set_kernel(kr_worker *worker, const kr_lanes_isa *isa, int order, double log2_tol)
{
    worker->isa = isa;
    worker->lanes->order = order;
    worker->lanes->log2_tol = log2_tol;
}
void kr_scheduler_reset(kr_worker *worker, int damped)
{
    worker->busy = 0;
    worker->lanes->terms =
        (worker->config.skip_heading ? KR_LANES_HEADLESS : 0) | (damped ? KR_LANES_DAMPED : 0);
    worker->lanes->has_event = worker->is_section;
    worker->lanes->extremum = worker->event.extremum != 0;
    for (int i = 0; i < KR_LANES_MAX; i++) kr_lane_park(worker->lanes, i);
}

/* Sets *shift so that the largest of the principal moments A is the third component of
 * shift_axes(A, *shift). Returns the rotation from these permuted axes to the principal axes. */
static kr_quat rotation_from_lane_axes(kr_vec3 A, int *shift)
{
    *shift = A.z >= A.x && A.z >= A.y ? 0 : A.x >= A.y ? 1 : 2;
    const double h = *shift == 1 ? 0.5 : -0.5;
    return *shift == 0 ? q_one() : q4(0.5, v3(h, h, h));
}
/* Returns v with -0 in place of zero components; adding -0 leaves every number unchanged. */
static kr_vec3 make_zeros_negative(kr_vec3 v)
{
    return v3(-(0.0 - v.x), -(0.0 - v.y), -(0.0 - v.z));
}
/* Returns `difference`, the difference of two moments of inertia, as a divisor for rotor_1 and
 * rotor_2. If one of these is not 0, and |difference| < KR_LEAST_FACTOR * moment + DBL_MIN
 * (taylor.h), returns this limit instead. `moment` is the remaining moment of inertia. */
static double avoid_zero_moment_difference(double difference, double moment, double rotor_1,
                                           double rotor_2)
{
    const double least = KR_LEAST_FACTOR * moment + DBL_MIN;
    return (rotor_1 != 0.0 || rotor_2 != 0.0) && fabs(difference) < least ? least : difference;
}
/* Returns rotor / difference, componentwise, but -0 for each component of `rotor` that is 0. */
static kr_vec3 divide_with_negative_zeros(kr_vec3 rotor, kr_vec3 difference)
{
    return v3(rotor.x == 0.0 ? -0.0 : rotor.x / difference.x,
              rotor.y == 0.0 ? -0.0 : rotor.y / difference.y,
              rotor.z == 0.0 ? -0.0 : rotor.z / difference.z);
}
/* The constants A, c and h of lane_state.h, drag = -D / A, and apart = (Ay - Az, Az - Ax, Ax - Ay),
 * along the permuted axes of a lane and in its units. */
typedef struct {
    kr_vec3 A, c, h, drag, apart;
} shifted_constants;
/* Returns the constants of `motion`, converted from internal units and principal axes to a lane
 * with the unit of frequency `rate` and permuted axes: a vector v becomes shift_axes(v, shift). */
static shifted_constants convert_constants_to_lane(const kr_motion *motion, double rate, int shift)
{
    const kr_vec3 A = shift_axes(motion->inertia, shift),
                  h = v_scale(1.0 / rate, shift_axes(motion->rotor, shift));
    return (shifted_constants){
        .A = A,
        .c = v_scale(1.0 / (rate * rate), shift_axes(motion->lever, shift)),
        .h = h,
        .drag = v_scale(-1.0 / rate, v_over(shift_axes(motion->damping, shift), A)),
        .apart = v3(avoid_zero_moment_difference(A.y - A.z, A.x, h.y, h.z),
                    avoid_zero_moment_difference(A.z - A.x, A.y, h.z, h.x),
                    avoid_zero_moment_difference(A.x - A.y, A.z, h.x, h.y))};
}
static void set_lane_constants(kr_lanes *l, int lane, const shifted_constants *from)
{
    const kr_vec3 A = from->A, c = from->c, h = from->h, apart = from->apart;
    const kr_vec3 up = v_over(shift_axes(c, 2), A),
                  down = v_over(v_scale(-1.0, shift_axes(c, 1)), A);
    set_vector(l->k, lane, v_over(apart, A));
    set_vector(l->inner, lane, v3(apart.y / A.z, -apart.x / A.z, -h.z / A.z));
    set_vector(l->shift_prev, lane,
               divide_with_negative_zeros(v_scale(-1.0, shift_axes(h, 2)), apart));
    set_vector(l->shift_next, lane, divide_with_negative_zeros(shift_axes(h, 1), apart));
    set_vector(l->up, lane, up);
    set_vector(l->down, lane, down);
    set_vector(l->drag, lane, from->drag);
    const double rates = v_largest(up) + v_largest(down);
    l->fall[lane] = rates > 0.0 ? 1.0 / sqrt(rates) : INFINITY;
}
static kr_vec3 v_times_power_of_2(kr_vec3 a, int power)
{
    return v3(times_power_of_2(a.x, power), times_power_of_2(a.y, power),
              times_power_of_2(a.z, power));
}
/* Writes the initial tangent (theta, N) = (turn, push) (lane_tangent.h) along the principal axes,
 * in the units of a lane: the user's tangent, times a power of two that prevents overflow of its
 * squared norm; or, without one, arbitrary numbers that are unlikely to be a trivial solution. */
static void set_initial_tangent(const kr_worker *worker, const kr_top *top, double rate,
                                kr_vec3 *turn, kr_vec3 *push)
{
    const double *given = worker->tops->direction;
    const kr_quat to_body = q_conj(q_mul(top->scene.start.q, top->axes));
    *turn = v3(0.37, -0.53, 0.29);
    *push = v3(0.47, 0.31, -0.41);
    if (!given) return;
    *turn = q_turn_back(top->axes, v_of(given));
    *push = v_scale(1.0 / (top->momentum_unit * rate), q_turn(to_body, v_of(given + 3)));
    const double size = fmax(v_largest(*turn), v_largest(*push));
    if (!(size > 0.0 && size < INFINITY)) return;
    *turn = v_times_power_of_2(*turn, -exponent_of(size));
    *push = v_times_power_of_2(*push, -exponent_of(size));
}
/* Upper limit on the sum of the reciprocals of the moments of inertia, in internal units. Above
 * this limit, the squared norm of a tangent could overflow. */
#define MAX_INVERSE_MOMENT 0x1p300
/* Writes the initial tangent for the top in worker->fallback to element `lane` of tangents->end.
 * Returns 0 if it is not finite, if the removal of the trivial solutions (lane_tangent.h) leaves
 * less than 1e-10 of its length, or if a moment of inertia is too small. */
static int initialize_lane_tangent(kr_worker *worker, int lane, double rate, int shift,
                                   const shifted_constants *constants)
{
    const kr_top *top = worker->fallback;
    kr_lanes *l = worker->lanes;
    kr_lane_tangents *g = l->tangents;
    const kr_vec3 A = constants->A, apart = constants->apart;
    kr_vec3 turn, push;
    set_initial_tangent(worker, top, rate, &turn, &push);
    set_vector(g->ahead, lane, v_over(v_scale(-1.0, shift_axes(apart, 1)), A));
    set_vector(g->behind, lane, v_over(v_scale(-1.0, shift_axes(apart, 2)), A));
    set_vector(g->per, lane, v_over(v3(1.0, 1.0, 1.0), A));
    set_vector(g->moments, lane, A);
    set_vector(g->c, lane, constants->c);
    set_vector(g->rotor, lane, make_zeros_negative(constants->h));
    kr_growth others = g->end;
    set_vector(g->end.d[0], lane, shift_axes(turn, shift));
    set_vector(g->end.d[1], lane, shift_axes(push, shift));
    worker->isa->begin(l);
    for (int i = 0; i < 6; i++) others.d[i / 3][i % 3][lane] = g->first[i / 3][i % 3][lane];
    g->end = others;
    kr_lane_reset_growth(&g->end, lane);
    g->energy[lane] = g->first_energy[lane];
    g->vertical[lane] = g->first_vertical[lane];
    const double size = v_length(turn) + v_length(push), per = 1.0 / A.x + 1.0 / A.y + 1.0 / A.z;
    return g->first_size[lane] > 1e-10 * size && size < INFINITY && per < MAX_INVERSE_MOMENT;
}
/* Loads the top in worker->fallback into a SIMD lane. Returns 0 if its tangent is invalid. */
static int load_top_into_lane(kr_worker *worker, int lane)
{
    const kr_top *top = worker->fallback;
    const kr_motion *motion = &top->main;
    const kr_step_polynomial p = top->method->polynomial(motion);
    kr_lanes *l = worker->lanes;
    kr_slot *slot = &worker->slots[lane];
    int shift;
    const kr_quat turn = rotation_from_lane_axes(motion->inertia, &shift);
    const shifted_constants constants = convert_constants_to_lane(motion, p.rate, shift);
    set_lane_constants(l, lane, &constants);
    set_vector(l->end_p, lane, shift_axes(v_of(p.end_x + 5), shift));
    set_vector(l->end_w, lane, shift_axes(v_of(p.end_w + 1), shift));
    set_quaternion(l->end_q, lane, q_mul(q4(p.end_x[0], v_of(p.end_x + 1)), turn));
    set_quaternion(l->axes, lane, q_conj(q_mul(top->axes, turn)));
    set_vector(l->moment, lane,
               v_scale(top->momentum_unit * p.rate, shift_axes(motion->inertia, shift)));
    set_vector(l->rotor, lane,
               make_zeros_negative(v_scale(top->momentum_unit, shift_axes(motion->rotor, shift))));
    l->end[lane] = l->steps[lane] = 0.0;
    l->forward[lane] = slot->forward = top->forward;
    l->max_steps[lane] = worker->config.max_steps > 0 ? (double)worker->config.max_steps : INFINITY;
    slot->start = slot->requested = top->scene.start.t;
    slot->time_unit = top->time_unit;
    slot->rate = p.rate;
    slot->horizon = top->horizon;
    slot->last = top->scene.start;
    if (worker->is_section) kr_section_load_event(worker, lane, p.rate, shift);
    return !l->tangents || initialize_lane_tangent(worker, lane, p.rate, shift, &constants);
}

/* Returns 1 if the last step of a lane is finite, has a length > 0, and is within max_steps. */
static int is_good_step(const kr_lanes *l, int lane)
{
    double sum = l->turn[l->order][lane];
    for (int i = 0; i < 3; i++) sum += fabs(l->end_p[i][lane]) + fabs(l->end_w[i][lane]);
    return isfinite(sum) && l->forward[lane] * (l->end[lane] - l->t[lane]) > 0.0 &&
           l->steps[lane] <= l->max_steps[lane];
}
/* Returns 1 if the lanes have no tangents, or if the last sampled growth in the lane is finite. */
static int is_growth_finite(const kr_lanes *l, int lane)
{
    double sum = 0.0;
    for (int i = 0; l->tangents && i < KR_GROWTH_COUNT; i++) sum += l->tangents->out[i][lane];
    return isfinite(sum);
}
/* Stores the state and the growth that kr_lanes_isa.sample has computed for a lane, and sets the
 * next goal. If one of them is invalid, the scalar code computes the top instead. Returns 1 if the
 * top is still in the lane, and the step just made also reaches the new goal. */
static int store_sample_and_check_next(kr_worker *worker, int lane)
{
    const kr_lanes *l = worker->lanes;
    kr_slot *slot = &worker->slots[lane];
    const kr_state s = kr_lane_read_sample(worker, lane, slot->requested);
    if (!kr_state_is_good(s.q, s.m) || !is_growth_finite(l, lane)) {
        kr_lane_fall_back(worker, lane);
        return 0;
    }
    if (l->tangents) kr_worker_store_growth(worker, slot, worker->lanes->tangents->out, lane);
    kr_worker_store_state(worker, slot, kr_worker_accumulators(worker, lane), &s);
    return kr_lane_set_goal(worker, lane) && kr_lane_has_passed_goal(l, lane);
}
/* Stores the states of the lanes in the mask `lanes` at all requested times in their last steps. */
static void store_samples_in_last_steps(kr_worker *worker, unsigned lanes)
{
    kr_lanes *l = worker->lanes;
    while (lanes && !kr_worker_poll_after_states(worker)) {
        for (int lane = 0; lane < KR_LANES_MAX; lane++)
            l->at[lane] = lanes >> lane & 1 ? l->goal[lane] : l->t[lane];
        worker->isa->sample(l);
        for (int lane = 0; lane < KR_LANES_MAX; lane++)
            if (lanes >> lane & 1 && !store_sample_and_check_next(worker, lane))
                lanes &= ~(1u << lane);
    }
}
/* Advances all lanes by up to STEPS_PER_POLL steps. Then, for each lane in the mask returned by
 * kr_lanes_isa.advance, stores the states or events within the last step or, if this step failed,
 * leaves the top to the scalar code. */
static void advance_lanes_and_store(kr_worker *worker)
{
    const unsigned called = worker->isa->advance(worker->lanes, STEPS_PER_POLL) & worker->busy;
    unsigned passed = 0;
    for (int lane = 0; lane < KR_LANES_MAX; lane++) {
        if (!(called >> lane & 1)) continue;
        if (!is_good_step(worker->lanes, lane))
            kr_lane_fall_back(worker, lane);
        else if (worker->is_section)
            kr_section_search(worker, lane);
        else
            passed |= 1u << lane;
    }
    store_samples_in_last_steps(worker, passed);
    kr_worker_poll(worker);
}
/* Returns the first lane without a top, or the number of lanes if there is none. */
static int find_free_lane(const kr_worker *worker)
{
    int lane = 0;
    while (lane < *worker->isa->lanes && worker->busy >> lane & 1) lane++;
    return lane;
}
/* Returns 1 if top i (in worker->fallback) may be strongly damped (taylor/slow.h) in a step before
 * the last requested time or, if worker->is_section, in any step. */
static int may_be_strongly_damped(const kr_worker *worker, size_t i)
{
    const kr_top *top = worker->fallback;
    double until = INFINITY;
    if (!worker->is_section) {
        const size_t times = worker->tops->times;
        const double last = times > 0 ? kr_worker_times_of(worker->tops, i)[times - 1] : 0.0;
        until = (last - top->scene.start.t) / top->time_unit;
    }
    return worker->lanes->terms & KR_LANES_DAMPED && kr_slow_is_possible(&top->main, until);
}
void kr_scheduler_add(kr_worker *worker, size_t i)
{
    int lane = find_free_lane(worker);
    for (; lane == *worker->isa->lanes && !worker->interrupted; lane = find_free_lane(worker))
        advance_lanes_and_store(worker);
    if (worker->interrupted) return;
    kr_slot *slot = &worker->slots[lane];
    const kr_config config = kr_worker_config_of(worker, i);
    const kr_scene *scene = &worker->tops->scenes[i];
    kr_scene unturned;
    double horizon = INFINITY;
    *slot = (kr_slot){.top = i, .last = scene->start};
    if (kr_support_turns(scene)) {
        horizon = kr_scene_horizon(scene);
        unturned = *scene;
        unturned.turning.z = 0.0;
        scene = &unturned;
    }
    kr_status status = kr_top_init(worker->fallback, scene, NULL, &config);
    if (!(fabs(scene->start.t) < horizon) ||
        (status == KR_OK && may_be_strongly_damped(worker, i))) {
        kr_worker_run_scalar(worker, worker->fallback, i);
        return;
    }
    if (status == KR_OK && worker->is_section) {
        status = kr_top_watch(worker->fallback, 1, &worker->event);
        kr_top_watch(worker->fallback, 0, NULL);
    }
    if (status == KR_OK && !load_top_into_lane(worker, lane)) status = KR_ERR_ARGUMENT;
    if (status != KR_OK) {
        kr_lane_park(worker->lanes, lane);
        kr_worker_finish_top(worker, slot, NULL, status, (kr_stats){0});
        return;
    }
    slot->horizon = fmin(slot->horizon, horizon);
    worker->busy |= 1u << lane;
    kr_lane_set_goal(worker, lane);
}
void kr_scheduler_drain(kr_worker *worker)
{
    while (worker->busy && !worker->interrupted) advance_lanes_and_store(worker);
}
