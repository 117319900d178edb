/* The tops of a round: their creation, the choice of one, and the checks after each call. */
#include "tops.h"
#include <math.h>
#include "calls.h"
#include "random_values.h"
#include "claims.h"
#include "math/su2.h"
#include "scenes.h"

enum { PLACES = 3 };
#define X(by, bit, columns, name) | (bit)
enum { ALL_TANGENTS = 0 KR_TANGENT_LIST(X) };
#undef X
static place places[PLACES];
static kr_top *alike; /* a top to compare with one of them */
static int goes_far;

double forward(const place *p) { return p->config.step < 0.0 ? -1.0 : 1.0; }
size_t save_image(const kr_top *top, unsigned char *bytes)
{
    const size_t size = kr_top_save_size(top);
    CLAIM(size > 0 && size <= MOST_IMAGE);
    CLAIM(kr_top_save(top, size, bytes) == KR_OK);
    return size;
}
static int poll(void *context)
{
    place *p = context;
    if (p->top && !p->forged) CLAIM(!isnan(kr_top_describe(p->top).time));
    return ++p->polls >= p->patience;
}

void begin_call(place *p)
{
    p->polls = 0;
    p->patience = 1 + (int)choose(odds(90) ? 2 : 8);
    p->was = kr_top_state(p->top);
    p->was_stats = kr_top_describe(p->top).stats;
    p->imaged = odds(25);
    if (p->imaged) save_image(p->top, p->was_image);
}
static void claim_stats(const place *p, kr_status status)
{
    const kr_stats stats = kr_top_describe(p->top).stats, *was = &p->was_stats;
    CLAIM(stats.steps >= was->steps);
    CLAIM(stats.rejected >= was->rejected && stats.evaluations >= was->evaluations &&
          stats.iterations >= was->iterations);
    if (p->config.max_steps > 0 && stats.steps > was->steps)
        CLAIM(stats.steps <= p->config.max_steps);
    const unsigned flags = kr_method_describe(p->method).flags;
    if (status == KR_ERR_LIMIT)
        CLAIM(p->config.max_steps > 0 ||
              (flags & (KR_METHOD_ADAPTIVE | KR_METHOD_DENSE)) == KR_METHOD_ADAPTIVE);
}
/* Claims that a refused call changes no bit, and that a failed call leaves the state unchanged or
 * moves the top on in its direction of time. */
static void claim_failure(place *p, kr_status status)
{
    static unsigned char image[MOST_IMAGE];
    const kr_state state = kr_top_state(p->top);
    if (error_category(status) == INPUT) {
        CLAIM(same_bits(&state, &p->was, sizeof state));
        if (p->imaged) CLAIM(same_bits(image, p->was_image, save_image(p->top, image)));
    }
    if (state.t == p->was.t)
        CLAIM(same_bits(&state, &p->was, sizeof state));
    else
        CLAIM(forward(p) * (state.t - p->was.t) > 0.0);
}
void end_call(place *p, kr_status status)
{
    const kr_top_info info = kr_top_describe(p->top);
    const kr_state state = kr_top_state(p->top), low = info.low;
    print_detail("%s: t %a, q %a %a %a %a, m %a %a %a", kr_status_text(status), state.t, state.q.w,
                 state.q.x, state.q.y, state.q.z, state.m.x, state.m.y, state.m.z);
    CLAIM(is_good(state));
    CLAIM(low.t == 0.0 && isfinite(low.q.w + low.q.x + low.m.x + low.m.y + low.m.z));
    CLAIM(info.kernel != NULL && info.order >= 0);
    CLAIM(p->polls <= p->patience);
    CLAIM((status == KR_ERR_INTERRUPTED) == (p->polls == p->patience));
    claim_stats(p, status);
    if (status != KR_OK) claim_failure(p, status);
    if (status != KR_OK && error_category(status) != INPUT) p->landed = 0;
}

static double any_step(double pace)
{
    const double step = either_sign(pace * spread(odds(90) ? 1e-2 : 1e-4, 1.0));
    return maybe_arbitrary(odds(10) ? 0.0 : step, 4);
}
static kr_config any_config(const kr_scene *scene, const kr_method *method)
{
    static const int digits[8] = {16, 20, 30, 17, 40, -1, 1, 29};
    const unsigned flags = method ? kr_method_describe(method).flags : 0;
    kr_config config = {.step = any_step(time_scale(scene)), .poll = poll};
    if (flags & KR_METHOD_ADAPTIVE && odds(60)) config.step = 0.0;
    if (odds(60)) config.tol = odds(30) ? between(0.0, 1.0) : spread(1e-16, 0.9);
    config.tol = maybe_arbitrary(config.tol, 3);
    if (flags & KR_METHOD_DIGITS ? odds(50) : odds(2)) {
        config.digits = digits[choose(odds(80) ? 3 : 8)];
        if (odds(90)) config.tol = 0.0;
    }
    config.skip_heading = flags & KR_METHOD_SKIPS_HEADING ? odds(40) : odds(2);
    config.max_steps = odds(70) ? 0 : (int64_t)choose(goes_far ? 2000 : 20);
    if (odds(2)) config.max_steps = -(int64_t)choose(9);
    if (flags & KR_METHOD_TANGENTS && !config.skip_heading ? odds(30) : odds(2))
        config.tangents =
            odds(95) ? choose(2 * KR_TANGENT_FRICTION) & ALL_TANGENTS : choose(UINT64_MAX);
    return config;
}
static void claim_created(place *p, kr_status status, kr_top *top, kr_top *mark)
{
    CLAIM(status == KR_OK || top == mark);
    p->top = status == KR_OK ? top : NULL;
    const kr_status scene = kr_scene_check(&p->scene);
    if (scene != KR_OK) CLAIM(status == scene);
    /* Some motions on a torus have no closed form. */
    kr_body body = p->scene.body;
    if (p->scene.gravity == 0.0) body.com = v3(0.0, 0.0, 0.0);
    if (status == KR_ERR_METHOD)
        CLAIM(!kr_method_suits(p->method, &p->scene) ||
              kr_body_kind(&body, KR_KIND_RTOL) >= KR_KIND_KOWALEWSKI);
    if (status != KR_OK) return;
    const kr_state state = kr_top_state(top);
    CLAIM(kr_method_suits(p->method, &p->scene));
    const unsigned carries = kr_method_describe(p->method).flags & KR_METHOD_TANGENTS;
    if (p->config.tangents) CLAIM(carries && (p->config.tangents & ~(uint64_t)ALL_TANGENTS) == 0);
    CLAIM(same_bits(&state, &p->scene.start, sizeof state));
    CLAIM(kr_top_describe(top).stats.steps == 0);
}
static void create(place *p)
{
    kr_top *mark = (kr_top *)(void *)p, *top = mark;
    p->scene = any_scene();
    p->start_low = (kr_state){0};
    p->method = odds(30) ? kr_method_find("taylor") : any_method();
    p->config = any_config(&p->scene, p->method);
    p->config.context = p;
    p->landed = 1;
    p->forged = 0;
    p->search[0].count = p->search[1].count = 0;
    p->watched = 0;
    tell_scene(&p->scene);
    print_call(
        "top %d: create %s, step %a, tol %a, digits %d, heading %d, tangents %llu, most %lld",
        (int)(p - places), kr_method_describe(p->method).name, p->config.step, p->config.tol,
        p->config.digits, p->config.skip_heading, (unsigned long long)p->config.tangents,
        (long long)p->config.max_steps);
    const kr_status status = kr_top_create(&p->scene, p->method, p->config, &top);
    const enum error_kind wrong = error_category(status);
    CLAIM(wrong == NONE || wrong == INPUT || wrong == FAILURE);
    claim_created(p, status, top, mark);
}
kr_top *make_alike(const place *p, uint64_t tangents)
{
    kr_config config = p->config;
    config.tangents = tangents;
    config.poll = NULL;
    config.max_steps = 0;
    kr_top_free(alike);
    alike = NULL;
    CLAIM(kr_top_create(&p->scene, p->method, config, &alike) == KR_OK);
    CLAIM(kr_top_set_scene(alike, &p->scene, &p->start_low) == KR_OK);
    return alike;
}

void allow_long_runs(int far) { goes_far = far; }
int longest(void) { return goes_far ? 3000 : 100; }
/* Returns 1 if t is so near that a round can make the steps to it, or if t is refused. */
static int is_near(const place *p, double t)
{
    const int fixed = !(kr_method_describe(p->method).flags & KR_METHOD_ADAPTIVE), few = 24;
    const double way = forward(p) * (t - kr_top_state(p->top).t),
                 step = fixed ? fabs(p->config.step) : time_scale(&p->scene);
    const int is_limited = p->config.max_steps > 0 && p->config.max_steps < few;
    return is_limited || !(way < INFINITY) || way <= few * step;
}
/* Returns any time, often a near one and rarely an invalid one. */
static double wild_time(const place *p)
{
    const kr_state now = kr_top_state(p->top);
    const double pace = time_scale(&p->scene), far = forward(p) * pace * spread(1e-5, 30.0);
    switch (choose(12)) {
    case 0:
        return now.t;
    case 1:
        return nextafter(now.t, forward(p) * INFINITY);
    case 2:
        return now.t + p->config.step * (double)choose(20);
    case 3:
        return now.t - far;
    case 4:
        return now.t + forward(p) * pace * spread(1.0, 1e20);
    case 5:
        return any_double();
    default:
        return now.t + far;
    }
}
double any_time(const place *p)
{
    const double t = wild_time(p);
    if (goes_far || is_near(p, t)) return t;
    const double now = kr_top_state(p->top).t, step = fabs(p->config.step),
                 reach = step > 0.0 ? step : time_scale(&p->scene);
    return now + forward(p) * reach * spread(1e-3, 8.0);
}
void call_reset(place *p)
{
    kr_state start = odds(40) ? kr_top_state(p->top) : any_scene().start;
    kr_scene scene = p->scene;
    kr_top *other = NULL;
    kr_config config = p->config;
    config.poll = NULL;
    if (odds(40)) start.m = v_scale(spread(1e-4, 1e4), start.m);
    scene.start = start;
    begin_call(p);
    tell_scene(&scene);
    print_call("top %d: reset", (int)(p - places));
    const kr_status would = kr_top_create(&scene, p->method, config, &other),
                    status = kr_top_reset(p->top, odds(2) ? NULL : &start);
    kr_top_free(other);
    if (status == KR_OK) {
        CLAIM(would == KR_OK);
        p->was_stats = (kr_stats){0};
        p->scene.start = start;
        p->start_low = (kr_state){0};
        p->landed = 1;
        const kr_state state = kr_top_state(p->top);
        CLAIM(same_bits(&state, &start, sizeof state));
        CLAIM(kr_top_describe(p->top).stats.steps == 0);
    } else {
        const kr_state state = kr_top_state(p->top);
        CLAIM(same_bits(&state, &p->was, sizeof state));
    }
    end_call(p, status);
}

/* Restarts a top with another scene, often at its own state, as a push or a change of body does. */
void call_set_scene(place *p)
{
    const kr_state now = kr_top_state(p->top);
    kr_scene scene = odds(50) ? p->scene : any_scene();
    kr_top *other = NULL;
    kr_config config = p->config;
    config.poll = NULL;
    if (odds(50)) scene.start = now;
    if (odds(20)) scene.start.m = v_scale(spread(1e-4, 1e4), scene.start.m);
    begin_call(p);
    tell_scene(&scene);
    print_call("top %d: set scene", (int)(p - places));
    const kr_state low = kr_top_describe(p->top).low, was = p->was;
    const int has_low = odds(30), is_null = !has_low && odds(2),
              is_own_low = same_bits(&scene.start, &was, sizeof was);
    const kr_status would = kr_top_create(&scene, p->method, config, &other),
                    status = has_low ? kr_top_set_scene(p->top, &scene, &low)
                                     : kr_top_set_scene(p->top, is_null ? NULL : &scene, NULL);
    const kr_state state = kr_top_state(p->top), kept = kr_top_describe(p->top).low;
    kr_top_free(other);
    if (status == KR_OK) {
        CLAIM(would == KR_OK);
        p->was_stats = (kr_stats){0};
        p->scene = scene;
        p->start_low = kept;
        p->landed = 1;
        CLAIM(same_bits(&state, &scene.start, sizeof state));
        CLAIM(kr_top_describe(p->top).stats.steps == 0);
        if (!has_low) CLAIM(kept.q.w == 0.0 && kept.m.x == 0.0);
    } else {
        CLAIM(same_bits(&state, &was, sizeof state) && same_bits(&low, &kept, sizeof low));
        /* The low words of another state may be invalid for this one. */
        const int may_be_invalid = is_null || (has_low && !is_own_low);
        if (would == KR_OK)
            CLAIM(status == KR_ERR_MEMORY || (status == KR_ERR_ARGUMENT && may_be_invalid));
    }
    end_call(p, status);
}

static void release(place *p)
{
    kr_top_free(p->top);
    p->top = NULL;
}
void call_top(void)
{
    static void (*const calls[])(place *) = {
        call_step,    call_step,    call_advance,  call_advance, call_advance,   call_record,
        call_record,  call_watch,   call_seek,     call_seek,    call_seek,      call_save,
        call_load,    call_damage,  call_forge,    call_reset,   call_set_scene, call_repeat,
        call_compare, call_compare, call_tangents, release};
    place *p = &places[choose(PLACES)];
    if (!p->top)
        create(p);
    else {
        print_detail("top %d:", (int)(p - places));
        calls[choose(sizeof calls / sizeof *calls)](p);
    }
}
void clear_tops(void)
{
    for (int i = 0; i < PLACES; i++) release(&places[i]);
    kr_top_free(alike);
    alike = NULL;
    discard_checkpoint();
}
