/* The driver's upper half: a top in motion as its user sees it. It owns the user's frame,
 * units and clock, and landing; steps.c owns limits, finiteness, interruption and the last good
 * state; methods only step. A fixed-step run stands on the grid start.t + k step, an adaptive one
 * where its own steps end. A time between two such points is read by a second run, begun anew at
 * the point before it: so where one looks does not change the path. */
#include <float.h>
#include <stdlib.h>
#include "model/scene.h"
#include "numbers/dd.h"
#include "top.h"

/* doubles on 64 bytes; states that are written without asking whether to go on */
enum { LINE = 8, POLL = 1024 };

/* In and out of working axes and own units. */
static int is_deep(const kr_top *top) { return top->main.digits > 16; }
static kr_working working_axes(const kr_top *top)
{
    const kr_body *b = &top->scene.body;
    const kr_working principal = {q_one(), b->inertia, b->com, 0};
    return is_deep(top) ? principal : kr_body_working(b);
}
static kr_status choose_units(kr_top *top)
{
    const kr_working w = working_axes(top);
    kr_units own;
    const kr_status status = kr_scene_units(&top->scene, &w, &own);
    if (status != KR_OK) return status;
    top->time_unit = top->method->flags & KR_ABSOLUTE ? 1.0 : own.time;
    top->momentum_unit = own.moment / top->time_unit;
    top->axes = q_mul(top->scene.body.axes, w.axes);
    top->turned = v_largest(q_vec(top->axes)) > 0.0;
    top->main.inertia = v_scale(1.0 / own.moment, w.inertia);
    top->main.lever = v_scale(top->time_unit * top->time_unit, own.lever);
    top->main.step = top->config.step / top->time_unit;
    top->main.tol = top->config.tol;
    top->main.scene = &top->scene;
    if (is_deep(top)) kr_deep_lever(top, own.moment);
    return isfinite(top->momentum_unit) && top->momentum_unit > 0.0 && isfinite(top->main.step)
               ? KR_OK
               : KR_ERR_ARGUMENT;
}
static kr_state to_own(const kr_top *top, const kr_state *s)
{
    const kr_state own = {0.0, q_unit(q_mul(s->q, top->axes)),
                          v_scale(1.0 / top->momentum_unit, s->m)};
    return own;
}
/* In place, for a copy of a state just written costs more than the rest of reading it; false if it
 * is not finite. */
static int to_user(kr_top *top, double t, kr_state *s)
{
    s->t = t;
    if (is_deep(top)) {
        kr_deep_out(top, s);
    } else {
        if (top->turned) s->q = q_mul(s->q, q_conj(top->axes));
        s->m = v_scale(top->momentum_unit, s->m);
    }
    return isfinite(fabs(s->q.w) + fabs(s->m.x) + fabs(s->m.y) + fabs(s->m.z));
}

/* Times. */
static double grid(const kr_top *top, int64_t k)
{
    return top->scene.start.t + (double)k * top->config.step;
}
static int meets(const kr_top *top, int64_t k, double t) /* up to the rounding of either */
{
    return fabs(grid(top, k) - t) <= 2.0 * DBL_EPSILON * fmax(fabs(t), fabs(top->scene.start.t));
}
/* The last point of the grid not after t. */
static kr_status locate(const kr_top *top, double t, int64_t *k)
{
    const double n = (t - top->scene.start.t) / top->config.step;
    if (!(n < 9007199254740992.0)) return KR_ERR_STEP;
    *k = (int64_t)(n + 0.5);
    if (*k < top->k) *k = top->k;
    if (*k > top->k && !meets(top, *k, t) && top->forward * (grid(top, *k) - t) > 0.0) --*k;
    return KR_OK;
}
static kr_status fixed_at(kr_top *top, double t, kr_state *s)
{
    int64_t k;
    kr_status status = locate(top, t, &k);
    if (status == KR_OK) status = kr_steps_walk(top, k, s);
    if (status != KR_OK || meets(top, k, t)) return status;
    return kr_steps_detour(top, s, (t - grid(top, k)) / top->time_unit, s);
}
static kr_status adaptive_at(kr_top *top, double t, kr_state *s)
{
    const int dense = top->method->at != NULL;
    const dd span = two_sum(t, -top->scene.start.t);
    const double goal = span.hi / top->time_unit;
    while (top->forward * (goal - top->main.clock) > 0.0) {
        const kr_status status = dense ? kr_steps_dense(top, goal) : kr_steps_adaptive(top);
        if (status != KR_OK) return status;
    }
    top->main.low.t = span.lo / top->time_unit;
    if (dense)
        top->method->at(&top->main, goal, s);
    else if (goal == top->main.clock)
        top->method->read(&top->main, s);
    else
        return kr_steps_detour(top, &top->before, goal - top->before_clock, s);
    return KR_OK;
}
static const kr_state none;
static kr_status state_at(kr_top *top, double t, kr_state *s)
{
    const int adaptive = (top->method->flags & KR_ADAPTIVE) != 0;
    kr_status status;
    /* what is asked for most often, without the questions */
    if (!adaptive && t == grid(top, top->k + 1)) {
        status = kr_steps_walk(top, top->k + 1, s);
    } else {
        if (!isfinite(t)) return KR_ERR_ARGUMENT;
        if (top->forward * (t - top->asked) < 0.0) return KR_ERR_TIME;
        if (t == top->scene.start.t) {
            *s = top->scene.start;
            top->low = none;
            return KR_OK;
        }
        status = adaptive ? adaptive_at(top, t, s) : fixed_at(top, t, s);
    }
    if (status != KR_OK) return status;
    if (!to_user(top, t, s)) return adaptive ? KR_ERR_NOT_FINITE : kr_steps_recover(top);
    top->asked = t;
    return KR_OK;
}
double kr_top_time(const kr_top *top)
{
    return top->method->flags & KR_ADAPTIVE ? top->scene.start.t + top->main.clock * top->time_unit
                                            : grid(top, top->k);
}
void kr_top_come_up(kr_top *top, double t)
{
    const double at = kr_top_time(top);
    if (!(top->forward * (at - top->asked) > 0.0 && top->forward * (t - at) >= 0.0)) return;
    top->main.low = none;
    if (is_deep(top))
        top->method->at(&top->main, top->main.clock, &top->now);
    else
        top->method->read(&top->main, &top->now);
    to_user(top, at, &top->now);
    top->asked = at;
}

static kr_status begin(kr_top *top, const kr_state *start)
{
    const kr_state own = is_deep(top) ? kr_deep_in(top, start) : to_own(top, start);
    const kr_stats nothing = {0, 0, 0, 0};
    top->scene.start = top->now = *start;
    top->low = none;
    top->asked = start->t;
    top->main.clock = 0.0;
    top->main.stats = nothing;
    top->k = 0;
    for (size_t i = 0; i < top->watched; i++) top->events[i].piece = -1;
    const kr_status status = top->method->reset(&top->main, &own);
    if (status != KR_OK) return status;
    kr_steps_keep(top);
    return KR_OK;
}
/* 16, 20 or 30 for what they include; 0 where the tolerance decides; -1 where that cannot be. */
static int digits_of(const kr_method *method, const kr_config *config)
{
    if (config->digits == 0) return 0;
    if (config->digits < 0 || config->digits > 30 || config->tol > 0.0 ||
        !(method->flags & KR_DIGITS))
        return -1;
    return config->digits <= 16 ? 16 : config->digits <= 20 ? 20 : 30;
}
/* Of all runs. */
static size_t words(const kr_method *method) { return (method->at ? 1 : 3) * method->work; }
kr_status kr_top_create(const kr_scene *scene, const kr_method *method, kr_config config,
                        kr_top **out)
{
    kr_status status = kr_scene_check(scene);
    kr_top *top;
    if (status != KR_OK) return status;
    if (!method || !out || !isfinite(config.step) || !isfinite(config.tol) || config.tol < 0.0)
        return KR_ERR_ARGUMENT;
    if (digits_of(method, &config) < 0) return KR_ERR_ARGUMENT;
    if (config.leave_heading && (!(method->flags & KR_HEADLESS) || config.digits > 16))
        return KR_ERR_ARGUMENT;
    if (config.step == 0.0 && !(method->flags & KR_ADAPTIVE)) return KR_ERR_ARGUMENT;
    if (!kr_method_suits(method, scene)) return KR_ERR_METHOD;
    if (config.step != 0.0 && scene->start.t + config.step == scene->start.t) return KR_ERR_STEP;
    top = calloc(1, sizeof *top + (LINE + words(method)) * sizeof(double));
    if (!top) return KR_ERR_MEMORY;
    top->scene = *scene;
    top->method = method;
    top->config = config;
    top->forward = config.step < 0.0 ? -1.0 : 1.0;
    top->main.digits = digits_of(method, &config);
    top->main.leave_heading = config.leave_heading;
    top->main.work = top->memory + (LINE - (uintptr_t)top->memory / sizeof(double) % LINE) % LINE;
    if (!method->at) {
        top->kept.work = top->main.work + method->work;
        top->side.work = top->kept.work + method->work;
    }
    status = choose_units(top);
    if (status == KR_OK) status = begin(top, &scene->start);
    if (status == KR_OK)
        *out = top;
    else
        kr_top_free(top);
    return status;
}
void kr_top_free(kr_top *top)
{
    if (top && top->method->done) {
        top->method->done(&top->main);
        top->method->done(&top->side);
    }
    free(top);
}
kr_status kr_top_reset(kr_top *top, const kr_state *state)
{
    kr_scene scene;
    if (!top || !state) return KR_ERR_ARGUMENT;
    scene = top->scene;
    scene.start = *state;
    const kr_status status = kr_scene_check(&scene);
    return status == KR_OK ? begin(top, state) : status;
}
kr_status kr_top_advance(kr_top *top, double t)
{
    kr_state s;
    return kr_top_record(top, 1, &t, &s, NULL);
}
kr_status kr_top_record_low(kr_top *top, size_t n, const double t[], kr_state out[], kr_state low[],
                            size_t *done)
{
    kr_status status = top && (!n || (t && out)) ? KR_OK : KR_ERR_ARGUMENT;
    size_t i = 0;
    while (i < n && status == KR_OK) {
        status = i % POLL == POLL - 1 && kr_steps_stopped(top) ? KR_ERR_INTERRUPTED
                                                               : state_at(top, t[i], &out[i]);
        if (status == KR_OK && low) low[i] = top->low;
        i += status == KR_OK;
    }
    if (i > 0) top->now = out[i - 1];
    if (status != KR_OK && i < n && top && t) kr_top_come_up(top, t[i]);
    if (done) *done = i;
    return status;
}
kr_status kr_top_record(kr_top *top, size_t n, const double t[], kr_state out[], size_t *done)
{
    return kr_top_record_low(top, n, t, out, NULL, done);
}
kr_status kr_top_step(kr_top *top)
{
    kr_status status = KR_OK;
    if (!top) return KR_ERR_ARGUMENT;
    if (!(top->method->flags & KR_ADAPTIVE)) return kr_top_advance(top, grid(top, top->k + 1));
    if (!(top->forward * (kr_top_time(top) - top->asked) > 0.0))
        status =
            top->method->at ? kr_steps_dense(top, top->forward * INFINITY) : kr_steps_adaptive(top);
    kr_top_come_up(top, top->forward * INFINITY);
    return status;
}
kr_state kr_top_state(const kr_top *top) { return top->now; }
kr_state kr_top_low(const kr_top *top) { return top->low; }
const char *kr_top_kernel(const kr_top *top, int *order)
{
    *order = top->method->order;
    return top->method->kernel ? top->method->kernel(&top->main, order) : "";
}
kr_stats kr_top_stats(const kr_top *top)
{
    kr_stats stats = top->main.stats;
    stats.steps = top->k;
    return stats;
}
