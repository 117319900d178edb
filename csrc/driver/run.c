/* Functions that create a top and compute its state at requested times, in the user's frame and
 * units; steps.c makes the steps, in internal axes and units (method.h). A fixed-step method
 * computes states on the grid start.t + k * step, and an adaptive method at the ends of its own
 * steps. A state within a step is computed by dense output or, without it, by a separate
 * integration from the beginning of the step. The requested times thus do not affect the steps. */
#include <float.h>
#include <stdlib.h>
#include "model/scene.h"
#include "math/dd.h"
#include "top.h"

enum {
    CACHE_LINE = 8,          /* doubles in 64 bytes */
    STATES_PER_CHECK = 1024, /* largest number of states between two calls of poll */
    STATES_TOGETHER = 64     /* largest number of states that a method evaluates in one call */
};

static int has_extended_digits(const kr_top *top) { return top->main.digits > 16; }
static int is_adaptive(const kr_top *top) { return (top->method->flags & KR_METHOD_ADAPTIVE) != 0; }
/* Returns the bound that |t| of a requested time must not reach: `horizon` or, for a fixed-step
 * method, 2^50 * |step| if less: rounding then shifts grid times by less than |step| / 2. */
static double limit_horizon_to_grid(const kr_top *top, double horizon)
{
    return is_adaptive(top) ? horizon : fmin(horizon, 0x1p50 * fabs(top->config.step));
}
double kr_top_horizon_of(const kr_top *top, const kr_scene *scene)
{
    return limit_horizon_to_grid(top, kr_scene_horizon(scene));
}
/* Returns the internal axes, and the inertia, com, damping and rotor along them. These axes are the
 * working axes (body.h) or, for methods with KR_METHOD_DIGITS, the principal axes of kr_body, which
 * keep q accurate near the upright attitude. */
static kr_working find_body_along_internal_axes(const kr_top *top)
{
    const kr_scene *scene = &top->scene;
    return top->method->flags & KR_METHOD_DIGITS
               ? kr_body_principal(&scene->body, scene->damping)
               : kr_body_working_damped(&scene->body, scene->damping);
}
/* Returns the initial state, for up to 16 digits: the attitude of the internal axes, and the
 * momentum in space in internal units. If the internal axes are permuted principal axes, the small
 * tilt of a nearly upright top is the difference of two nearly equal components of q. In this case,
 * q is computed in double-double arithmetic, and top->main.low receives the low words of q. */
static kr_state find_internal_start(kr_top *top)
{
    const kr_state *start = &top->scene.start;
    const kr_working working = find_body_along_internal_axes(top);
    const int is_renamed = !working.tilted && kr_body_last_axis(&top->scene.body) != 2;
    kr_state own = {0.0, q_unit(q_mul(start->q, top->axes)),
                    v_scale(1.0 / top->momentum_unit, start->m)};
    if (is_renamed) {
        const quat_dd principal = qdd_mul(qdd_of(start->q), qdd_of(top->scene.body.axes)),
                      q = qdd_unit(qdd_mul(principal, qdd_of(working.axes)));
        own.q = qdd_high(q);
        top->main.low.q = qdd_low(q);
    }
    return own;
}
/* Sets the internal axes and units, the body in these units, and the time limit of `top`. */
static kr_status set_internal_description(kr_top *top)
{
    const kr_working working = find_body_along_internal_axes(top);
    kr_units own;
    const kr_status status = kr_scene_units(&top->scene, &working, &own);
    if (status != KR_OK) return status;
    const double start = fabs(top->scene.start.t),
                 horizon = kr_units_horizon(&own, &top->scene, &working);
    top->horizon = limit_horizon_to_grid(top, horizon);
    if (!(start < top->horizon)) return start < horizon ? KR_ERR_STEP : KR_ERR_RESOLUTION;
    top->time_unit = top->method->flags & KR_METHOD_ABSOLUTE ? 1.0 : own.time;
    top->momentum_unit = own.moment / top->time_unit;
    top->axes = q_mul(top->scene.body.axes, working.axes);
    top->is_turned = v_largest(q_vec(top->axes)) > 0.0;
    top->main.inertia = v_scale(1.0 / own.moment, working.inertia);
    const double longer = top->time_unit / own.time; /* 1 for methods without KR_METHOD_ABSOLUTE */
    top->main.lever = v_scale(longer, v_scale(longer, own.lever));
    top->main.damping = v_scale(1.0 / top->momentum_unit, working.damping);
    if (kr_body_has_rotor(&top->scene.body))
        top->main.rotor = v_scale(1.0 / top->momentum_unit, working.rotor);
    top->main.gradient = top->time_unit * (top->time_unit * top->scene.gradient);
    top->main.step = top->config.step / top->time_unit;
    top->main.tol = top->config.tol;
    top->main.scene = &top->scene;
    top->main.time_unit = top->time_unit;
    top->main.momentum_unit = top->momentum_unit;
    top->main.body = &top->body;
    if (has_extended_digits(top)) top->method->extended->set_body(top, own.moment);
    return isfinite(top->main.step) && isfinite(top->main.gradient) &&
                   v_finite(top->main.damping) && v_finite(top->main.rotor)
               ? KR_OK
               : KR_ERR_ARGUMENT;
}
/* Converts `state` in place from internal axes and units to the user's frame and units, and sets
 * its time to t. With more than 16 digits, also sets top->low. Returns 1, or 0 if the converted
 * state is invalid (kr_state_is_good, top.h); top->low is then unchanged. */
static int convert_to_user(kr_top *top, double t, kr_state *state)
{
    const kr_state low = top->low;
    state->t = t;
    if (has_extended_digits(top)) {
        top->method->extended->to_user(top, state);
    } else {
        if (top->is_turned) state->q = q_mul(state->q, q_conj(top->axes));
        state->m = v_scale(top->momentum_unit, state->m);
    }
    if (top->is_carried) kr_scene_turn_state(&top->scene, state);
    if (kr_state_is_good(state->q, state->m)) return 1;
    top->low = low;
    return 0;
}

static double grid_time(const kr_top *top, int64_t k)
{
    return top->scene.start.t + (double)k * top->config.step;
}
/* Returns 1 if t equals the time of grid point k up to rounding errors. */
static int is_at_grid_point(const kr_top *top, int64_t k, double t)
{
    return fabs(grid_time(top, k) - t) <=
           2.0 * DBL_EPSILON * fmax(fabs(t), fabs(top->scene.start.t));
}
/* Returns the index of the last grid point at or before t, but at least top->steps. */
static int64_t find_grid_point_before(const kr_top *top, double t)
{
    const int64_t k = (int64_t)((t - top->scene.start.t) / top->config.step + 0.5);
    if (k <= top->steps) return top->steps;
    return k - (!is_at_grid_point(top, k, t) && top->forward * (grid_time(top, k) - t) > 0.0);
}
/* Computes the state at time t with a fixed-step method, in internal units. */
static kr_status find_state_by_fixed_steps(kr_top *top, double t, kr_state *state)
{
    const int64_t point = find_grid_point_before(top, t);
    const kr_status status = kr_steps_to_grid(top, point, state);
    if (status != KR_OK || is_at_grid_point(top, point, t)) return status;
    return kr_steps_off_grid(top, state, (t - grid_time(top, point)) / top->time_unit, state);
}
/* Computes the state at time t with an adaptive method, in internal units. */
static kr_status find_state_by_adaptive_steps(kr_top *top, double t, kr_state *state)
{
    const int dense = top->method->at != NULL;
    const double goal = internal_time(top, t);
    while (top->forward * (goal - top->main.clock) > 0.0) {
        const kr_status status = dense ? kr_steps_dense(top, goal) : kr_steps_adaptive(top);
        if (status != KR_OK) return status;
    }
    /* Rounding can place t before a step that is shorter than the spacing of doubles near t. */
    if (!(top->forward * (goal - top->before_clock) >= 0.0)) return KR_ERR_STEP;
    if (dense)
        kr_top_evaluate(top, t, state);
    else if (goal == top->main.clock)
        top->method->read(&top->main, state);
    else if (goal == top->before_clock)
        *state = top->before;
    else
        return kr_steps_off_grid(top, &top->before, goal - top->before_clock, state);
    return KR_OK;
}
/* Computes the state at time t in the user's frame and units. */
static kr_status find_state(kr_top *top, double t, kr_state *state)
{
    const int adaptive = is_adaptive(top);
    kr_status status;
    if (!(fabs(t) < top->horizon))
        return !isfinite(t)                              ? KR_ERR_ARGUMENT
               : fabs(t) < kr_scene_horizon(&top->scene) ? KR_ERR_STEP
                                                         : KR_ERR_RESOLUTION;
    /* Usually, t is the next point of the time grid, and no further checks are needed. */
    if (!adaptive && t == grid_time(top, top->steps + 1)) {
        status = kr_steps_to_grid(top, top->steps + 1, state);
    } else {
        if (top->forward * (t - top->requested) < 0.0) return KR_ERR_TIME;
        if (t == top->scene.start.t) { /* the low words are still valid */
            *state = top->scene.start;
            return KR_OK;
        }
        status = adaptive ? find_state_by_adaptive_steps(top, t, state)
                          : find_state_by_fixed_steps(top, t, state);
    }
    if (status != KR_OK) return status;
    if (!convert_to_user(top, t, state))
        return adaptive ? KR_ERR_NOT_FINITE : kr_steps_recover(top);
    top->requested = t;
    return KR_OK;
}
/* Returns the time of the end of the last step, in the user's units. */
static double find_step_end(const kr_top *top)
{
    return is_adaptive(top) ? top->scene.start.t + top->main.clock * top->time_unit
                            : grid_time(top, top->steps);
}
/* Returns the end of the last step in the user's units. If rounding has moved the end of an
 * adaptive step beyond main.clock, returns the next double towards the initial time instead. */
static double find_step_end_rounded_inward(const kr_top *top)
{
    const double at = find_step_end(top);
    if (!is_adaptive(top) || !(top->forward * (internal_time(top, at) - top->main.clock) > 0.0))
        return at;
    return nextafter(at, top->scene.start.t);
}
kr_status kr_top_sync(kr_top *top, double t)
{
    const double at = find_step_end_rounded_inward(top);
    kr_state state;
    if (!(top->forward * (at - top->requested) > 0.0 && top->forward * (t - at) >= 0.0))
        return KR_OK;
    if (is_adaptive(top) && !(top->forward * (internal_time(top, at) - top->before_clock) > 0.0))
        return KR_OK;
    top->main.low = (kr_state){0};
    if (top->method->at)
        kr_top_evaluate(top, at, &state);
    else
        top->method->read(&top->main, &state);
    if (!convert_to_user(top, at, &state)) return KR_ERR_NOT_FINITE;
    top->now = state;
    top->requested = at;
    return KR_OK;
}

static size_t count_work_doubles(const kr_method *method)
{
    return (method->at ? 1 : 3) * method->work;
}
#define X(by, bit, columns, name) | (bit)
enum { ALL_TANGENTS = 0 KR_TANGENT_LIST(X) };
#undef X
/* Returns KR_OK if the numbers in a configuration are valid for some method. */
static kr_status check_config_numbers(const kr_config *config)
{
    const int digits = config->digits;
    if (!isfinite(config->step) || !(config->tol >= 0.0 && config->tol < 1.0))
        return KR_ERR_ARGUMENT;
    if (digits < 0 || digits > 30) return KR_ERR_ARGUMENT;
    if (digits > 0 && config->tol > (digits > 20 ? 0x1p-100 : 0.0)) return KR_ERR_ARGUMENT;
    return config->tangents & ~(uint64_t)ALL_TANGENTS ? KR_ERR_ARGUMENT : KR_OK;
}
/* Returns KR_OK if `method` supports all options that `config` requests. */
static kr_status check_options(const kr_method *method, const kr_config *config)
{
    const unsigned flags = method->flags;
    if (config->digits > 0 && !(flags & KR_METHOD_DIGITS)) return KR_ERR_OPTION;
    if (config->tangents && !(flags & KR_METHOD_TANGENTS)) return KR_ERR_OPTION;
    if (config->skip_heading && !(flags & KR_METHOD_SKIPS_HEADING)) return KR_ERR_OPTION;
    if (config->skip_heading && (config->tangents || config->digits > 16)) return KR_ERR_OPTION;
    const uint64_t of_supports =
        KR_TANGENT_TURNING | KR_TANGENT_SHAKING | KR_TANGENT_FRICTION | KR_TANGENT_GRADIENT;
    const int is_built = (config->digits <= 16 || method->extended) &&
                         (!config->tangents || method->tangents) &&
                         (method->supports || !(config->tangents & of_supports));
    return is_built ? KR_OK : KR_ERR_NOT_BUILT;
}
/* Returns KR_OK if `method` applies to `scene` with `config`, else an error code. */
static kr_status check_config(const kr_scene *scene, const kr_method *method,
                              const kr_config *config)
{
    const double step = config->step, start = scene->start.t;
    kr_status status = method->reset ? check_config_numbers(config) : KR_ERR_NOT_BUILT;
    if (status == KR_OK) status = check_options(method, config);
    if (status != KR_OK) return status;
    if (step == 0.0 && !(method->flags & KR_METHOD_ADAPTIVE)) return KR_ERR_NO_STEP;
    status = kr_refusal_by_method(method, scene);
    if (status != KR_OK) return status;
    /* On a rotating support, the motion depends on the heading (the angle about the vertical). */
    if (config->skip_heading && kr_support_turns(scene)) return KR_ERR_OPTION;
    /* The derivative by friction does not exist if friction is 0. The derivative by com does not
     * exist if friction is positive and com is 0. */
    const uint64_t missing = !(scene->friction > 0.0)           ? KR_TANGENT_FRICTION
                             : v_largest(scene->body.com) > 0.0 ? 0
                                                                : KR_TANGENT_COM;
    if (config->tangents & missing) return KR_ERR_OPTION;
    if (kr_method_suits(method, scene))
        return step != 0.0 && start + step == start ? KR_ERR_STEP : KR_OK;
    kr_scene without = *scene;
    without.body.rotor = v3(0.0, 0.0, 0.0);
    return kr_body_has_rotor(&scene->body) && kr_method_suits(method, &without) ? KR_ERR_ROTOR
                                                                                : KR_ERR_METHOD;
}
/* Initializes a top from arguments that check_config accepts. The work arrays of `top` are already
 * assigned. `low` has the low words of the initial state, or is NULL. */
static kr_status initialize_top(kr_top *top, const kr_scene *scene, const kr_state *low,
                                const kr_method *method, const kr_config *config)
{
    const int digits = config->digits;
    top->scene = *scene;
    top->method = method;
    top->config = *config;
    top->forward = config->step < 0.0 ? -1.0 : 1.0;
    top->main.digits = digits <= 0 ? 0 : digits <= 16 ? 16 : digits <= 20 ? 20 : 30;
    top->main.skip_heading = config->skip_heading;
    top->is_carried = kr_support_turns_about_vertical(scene) && !method->supports;
    top->now = scene->start;
    top->requested = scene->start.t;
    const kr_status status = set_internal_description(top);
    if (status != KR_OK) return status;
    const kr_state own = has_extended_digits(top)
                             ? method->extended->from_user(top, &scene->start, low)
                             : find_internal_start(top);
    if (low && has_extended_digits(top)) top->low = *low;
    return method->reset(&top->main, &own);
}
static double *align64(double *memory)
{
    return memory + (CACHE_LINE - (uintptr_t)memory / sizeof(double) % CACHE_LINE) % CACHE_LINE;
}
kr_config kr_config_default(void) { return (kr_config){0}; }
kr_status kr_top_alloc(const kr_method *method, const kr_config *config, size_t extra, kr_top **top)
{
    const size_t tangents = kr_tangents_size(method, config),
                 doubles = 2 * CACHE_LINE + count_work_doubles(method) + tangents + extra;
    kr_top *made = calloc(1, sizeof *made + doubles * sizeof(double));
    if (!made) return KR_ERR_MEMORY;
    made->method = method;
    made->extra = extra;
    made->main.work = align64(made->memory);
    if (tangents > 0) made->tangents = align64(made->main.work + count_work_doubles(method));
    if (!method->at) {
        made->saved.work = made->main.work + method->work;
        made->side.work = made->saved.work + method->work;
    }
    *top = made;
    return KR_OK;
}
static size_t count_doubles_beyond_work(const kr_method *method, const kr_scene *scene)
{
    return method->extra_doubles ? method->extra_doubles(scene) : 0;
}
kr_status kr_top_create(const kr_scene *scene, const kr_method *method, kr_config config,
                        kr_top **out)
{
    kr_top *top = NULL;
    kr_status status = kr_scene_check(scene);
    if (status == KR_OK && !method) status = KR_ERR_NO_METHOD;
    if (status == KR_OK) status = out ? check_config(scene, method, &config) : KR_ERR_ARGUMENT;
    if (status == KR_OK)
        status = kr_top_alloc(method, &config, count_doubles_beyond_work(method, scene), &top);
    if (status != KR_OK) return status;
    status = initialize_top(top, scene, NULL, method, &config);
    if (status == KR_OK) {
        kr_steps_save(top);
        kr_tangents_begin(top);
        *out = top;
    } else {
        kr_top_free(top);
    }
    return status;
}
void kr_top_free(kr_top *top)
{
    if (top && top->method->release) {
        top->method->release(&top->main);
        top->method->release(&top->side);
    }
    free(top);
}
/* Replaces `top` by the newly initialized top `begun`, but keeps the work arrays of `top`. Without
 * dense output, copies the work array of begun->main (top->side.work) to top->main.work. */
static void replace_top(kr_top *top, const kr_top *begun)
{
    const kr_motion main = top->main, side = top->side, kept = top->saved;
    *top = *begun;
    top->main.scene = &top->scene;
    top->main.body = &top->body;
    top->main.work = main.work;
    top->side.work = side.work;
    top->saved.work = kept.work;
    top->side.aux = main.aux;
    if (side.work) memcpy(main.work, side.work, top->method->work * sizeof(double));
    for (size_t i = 0; i < top->event_count; i++) kr_event_reset_search(&top->events[i]);
    if (top->event_count > 0) kr_top_set_apex(top);
    kr_steps_save(top);
    kr_tangents_begin(top);
}
void kr_top_set_apex(kr_top *top)
{
    static const kr_state unturned = {.q = {1.0, 0.0, 0.0, 0.0}};
    top->apex = q_turn_back(top->axes, kr_state_apex(&top->scene, &unturned));
}
kr_status kr_top_init(kr_top *top, const kr_scene *scene, const kr_state *low,
                      const kr_config *config)
{
    kr_motion *spare = top->method->at ? &top->main : &top->side;
    kr_status status = kr_scene_check(scene);
    if (status == KR_OK) status = check_config(scene, top->method, config);
    if (status == KR_OK && count_doubles_beyond_work(top->method, scene) > top->extra)
        status = KR_ERR_MEMORY;
    if (status != KR_OK) return status;
    kr_top begun = {.events = top->events,
                    .event_count = top->event_count,
                    .tangents = top->tangents,
                    .extra = top->extra};
    begun.main.work = spare->work;
    begun.main.aux = spare->aux;
    status = initialize_top(&begun, scene, low, top->method, config);
    if (status == KR_OK)
        replace_top(top, &begun);
    else
        spare->aux = begun.main.aux;
    return status;
}
/* Returns 1 if low.t is 0 and start + low rounds to `start` in every component, else 0. */
static int are_low_words(const kr_state *start, const kr_state *low)
{
    const kr_quat q = q_add(start->q, low->q);
    const kr_vec3 m = v_add(start->m, low->m);
    return low->t == 0.0 && q.w == start->q.w && q.x == start->q.x && q.y == start->q.y &&
           q.z == start->q.z && m.x == start->m.x && m.y == start->m.y && m.z == start->m.z;
}
kr_status kr_top_reset(kr_top *top, const kr_state *state)
{
    if (!top || !state) return KR_ERR_ARGUMENT;
    kr_scene scene = top->scene;
    scene.start = *state;
    return kr_top_init(top, &scene, NULL, &top->config);
}
kr_status kr_top_set_scene(kr_top *top, const kr_scene *scene, const kr_state *low)
{
    if (!top || !scene) return KR_ERR_ARGUMENT;
    if (low && !are_low_words(&scene->start, low)) return KR_ERR_ARGUMENT;
    return kr_top_init(top, scene, low, &top->config);
}
kr_status kr_top_advance(kr_top *top, double t)
{
    kr_state state;
    return kr_top_record(top, 1, &t, &state, NULL, NULL);
}
/* Writes the states at up to n times t[0], t[1], ... to `out`, by one call of kr_method.at_times.
 * Stops before a time that is not after main.clock and the preceding times. Returns the number of
 * states; 0: use find_state (also if only one time is left). Writes a step's error to `status`. */
static size_t record_states_by_closed_form(kr_top *top, size_t n, const double t[], kr_state out[],
                                           kr_status *status)
{
    double clock[STATES_TOGETHER], last = top->main.clock;
    kr_state piece[STATES_TOGETHER];
    size_t count = 0, done = 0;
    if (!top->method->at_times) return 0;
    for (; count < n && count < STATES_TOGETHER && fabs(t[count]) < top->horizon; count++) {
        clock[count] = internal_time(top, t[count]);
        if (!(top->forward * (clock[count] - last) > 0.0)) break;
        last = clock[count];
    }
    if (count < 2) return 0;
    top->method->at_times(&top->main, count, clock, piece);
    while (done < count && convert_to_user(top, t[done], &piece[done])) {
        *status = kr_steps_dense(top, clock[done]);
        if (*status != KR_OK) break;
        out[done] = piece[done];
        top->requested = t[done++];
    }
    return done;
}
kr_status kr_top_record(kr_top *top, size_t n, const double t[], kr_state out[], kr_state low[],
                        size_t *done)
{
    kr_status status = top && (!n || (t && out)) ? KR_OK : KR_ERR_ARGUMENT;
    size_t i = 0;
    while (i < n && status == KR_OK) {
        size_t found = record_states_by_closed_form(top, n - i, t + i, out + i, &status);
        if (status == KR_OK && found == 0) {
            const kr_state before = out[i];
            status = i % STATES_PER_CHECK == STATES_PER_CHECK - 1 && kr_steps_poll(top)
                         ? KR_ERR_INTERRUPTED
                         : find_state(top, t[i], &out[i]);
            found = status == KR_OK;
            if (!found) out[i] = before;
        }
        for (size_t k = 0; low && k < found; k++) low[i + k] = top->low;
        i += found;
    }
    if (i > 0) top->now = out[i - 1];
    if (status != KR_OK && i < n && top && t && out && fabs(t[i]) < top->horizon)
        kr_top_sync(top, t[i]);
    if (done) *done = i;
    return status;
}
/* Advances a top by one step of an adaptive method or, if the last requested time lies within the
 * last step, to the end of that step. */
static kr_status step_adaptive(kr_top *top)
{
    const double end = top->forward * INFINITY, requested = top->requested;
    kr_status status = KR_OK;
    if (!(top->forward * (find_step_end_rounded_inward(top) - requested) > 0.0))
        status = top->method->at ? kr_steps_dense(top, end) : kr_steps_adaptive(top);
    if (status == KR_OK && !(fabs(find_step_end(top)) < top->horizon)) return KR_ERR_STEP;
    const kr_status up = kr_top_sync(top, end);
    if (status == KR_OK) status = up;
    return status == KR_OK && top->requested == requested ? KR_ERR_STEP : status;
}
kr_status kr_top_step(kr_top *top)
{
    if (!top) return KR_ERR_ARGUMENT;
    if (is_adaptive(top)) return step_adaptive(top);
    return kr_top_advance(
        top,
        grid_time(top, top->steps + 1)); /* before the horizon, grid points are distinct doubles */
}
kr_state kr_top_state(const kr_top *top) { return top->now; }
kr_top_info kr_top_describe(const kr_top *top)
{
    const kr_method *method = top->method;
    kr_top_info info = {.low = top->low,
                        .time = find_step_end(top),
                        .stats = top->main.stats,
                        .kernel = "",
                        .order = method->order};
    info.stats.steps = top->steps;
    if (top->tangents) info.truncation = method->tangents->truncation(&top->main, top->tangents);
    if (method->kernel) info.kernel = method->kernel(&top->main, &info.order);
    return info;
}
