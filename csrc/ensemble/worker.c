/* A worker computes the motions of many tops (kr_tops). The worker allocates memory once, and
 * dispatches each top to the batch code for closed-form solutions (exact_batch.c), to a SIMD lane
 * (lane_scheduler.c), or to the scalar code (kr_top). Each result is independent of other tops. */
#include "events/event_polynomial.h"
#include "slots.h"
#include <stdlib.h>

/* Bytes in a cache line. Loading a vector that spans two cache lines takes twice as long. */
enum { LINE = 64 };

/* Returns the error for a top that cannot have a tangent, because it is damped or disturbed. */
static kr_status explain_tangent_refusal(const kr_scene *scene)
{
    if (v_largest(scene->damping) > 0.0) return KR_ERR_DAMPING;
    if (scene->friction > 0.0) return KR_ERR_FRICTION;
    if (kr_support_shakes(scene)) return KR_ERR_SHAKING;
    return scene->gradient != 0.0 ? KR_ERR_GRADIENT : KR_ERR_TURNING;
}
/* Returns the kr_top of the worker for a top outside the SIMD lanes: `exact_top` if the motion has
 * a closed form that the batch code (exact_batch.c) does not evaluate, because the support rotates;
 * else `fallback`. If the worker has only one of them, returns it. */
static kr_top *choose_scalar_top(const kr_worker *worker, const kr_scene *scene)
{
    if (!worker->fallback || !worker->exact_top || !kr_support_turns(scene))
        return worker->fallback ? worker->fallback : worker->exact_top;
    const int has_torus = kr_scene_kind(scene) > KR_KIND_LAGRANGE;
    const int is_closed = !has_torus && kr_method_suits(&kr_method_exact, scene);
    return is_closed ? worker->exact_top : worker->fallback;
}
/* Returns 1 if the top of `scene` can be integrated in a SIMD lane. This includes an undamped top
 * on a support that rotates about the vertical: its states are computed for a support at rest and
 * then rotated. */
static int suits_lanes(const kr_worker *worker, const kr_scene *scene)
{
    kr_scene undamped = *scene;
    undamped.damping = v3(0.0, 0.0, 0.0);
    if (!worker->isa ||
        (worker->is_section && !kr_terms_are_linear(worker->event.count, worker->event.terms)))
        return 0;
    return !kr_scene_is_disturbed(&undamped) ||
           (!worker->is_section && !kr_scene_excludes_closed_form(scene, 1));
}
/* Computes top i, which the batch code has not computed, in a lane or by the scalar code. Leaves a
 * damped top that suits lanes to the second pass of run_tops, in which the lanes are damped. */
static void dispatch_top(kr_worker *worker, size_t i)
{
    const kr_scene *scene = &worker->tops->scenes[i];
    kr_top *top = choose_scalar_top(worker, scene);
    if (kr_worker_has_tangents(worker) && kr_scene_is_disturbed(scene)) {
        const kr_slot slot = {.top = i, .last = scene->start};
        kr_worker_finish_top(worker, &slot, NULL, explain_tangent_refusal(scene), (kr_stats){0});
    } else if (top != worker->fallback || !suits_lanes(worker, scene))
        kr_worker_run_scalar(worker, top, i);
    else if (!(v_largest(scene->damping) > 0.0))
        kr_scheduler_add(worker, i);
}
/* Computes the tops `from` to from + n - 1, where n <= KR_BATCH: those with closed forms in the
 * batch code, and then the others by dispatch_top. */
static void compute_block_of_tops(kr_worker *worker, size_t from, size_t n)
{
    kr_status status[KR_BATCH];
    for (size_t i = 0; i < n; i++) status[i] = KR_ERR_METHOD;
    if (worker->exact_top) kr_exact_batch_run(worker, from, n, status);
    for (size_t i = 0; i < n && !worker->interrupted; i++)
        if (status[i] != KR_OK) dispatch_top(worker, from + i);
}
static void mark_unfinished_as_interrupted(kr_worker *worker, const kr_tops *tops)
{
    const kr_stats none = {0};
    for (int lane = 0; lane < KR_LANES_MAX; lane++)
        if (worker->busy >> lane & 1)
            kr_worker_finish_top(worker, &worker->slots[lane], NULL, KR_ERR_INTERRUPTED, none);
    for (size_t i = 0; i < tops->n; i++) {
        const kr_slot slot = {.top = i, .last = tops->scenes[i].start};
        if (tops->outcomes[i].status == KR_STATUS_COUNT)
            kr_worker_finish_top(worker, &slot, NULL, KR_ERR_INTERRUPTED, none);
    }
}
/* Computes all tops up to their last requested times or events. */
static kr_status run_tops(kr_worker *worker, const kr_tops *tops)
{
    if (tops->n > 0 && (!tops->scenes || !tops->outcomes || (tops->times > 0 && !tops->t)))
        return KR_ERR_ARGUMENT;
    worker->tops = tops;
    worker->interrupted = worker->unpolled = 0;
    if (worker->lanes) kr_scheduler_reset(worker, 0);
    for (size_t i = 0; i < tops->n; i++) tops->outcomes[i].status = KR_STATUS_COUNT;
    for (size_t i = 0; i < tops->n && !worker->interrupted; i += KR_BATCH)
        compute_block_of_tops(worker, i, tops->n - i < KR_BATCH ? tops->n - i : KR_BATCH);
    if (worker->lanes) kr_scheduler_drain(worker);
    if (worker->lanes && !worker->interrupted) {
        kr_scheduler_reset(worker, 1);
        for (size_t i = 0; i < tops->n && !worker->interrupted; i++)
            if (tops->outcomes[i].status == KR_STATUS_COUNT) kr_scheduler_add(worker, i);
        kr_scheduler_drain(worker);
    }
    if (worker->interrupted) mark_unfinished_as_interrupted(worker, tops);
    return worker->interrupted ? KR_ERR_INTERRUPTED : KR_OK;
}
kr_status kr_worker_run(kr_worker *worker, const kr_tops *tops)
{
    return worker && tops ? run_tops(worker, tops) : KR_ERR_ARGUMENT;
}

kr_status kr_worker_section(kr_worker *worker, const kr_event *event, const kr_tops *tops)
{
    const int is_one = event && event->count > 0 && event->terms;
    if (!worker || !tops || !is_one || kr_worker_has_tangents(worker)) return KR_ERR_ARGUMENT;
    if (worker->method != &kr_method_taylor) return KR_ERR_NO_EVENTS;
    worker->is_section = 1;
    worker->event = *event;
    const kr_status status = run_tops(worker, tops);
    worker->is_section = 0;
    return status;
}

/* Returns 1 if all n reductions have a valid quantity, component and kind. */
static int are_valid_reductions(size_t n, const kr_reduction reduction[])
{
    size_t i = 0;
    while (i < n && reduction && reduction[i].quantity &&
           reduction[i].component < reduction[i].quantity->doubles &&
           (unsigned)reduction[i].kind < KR_REDUCE_COUNT)
        i++;
    return i == n;
}
/* Allocates a worker for the given number of reductions, in one block of zeros, or returns NULL. It
 * has lanes if `in_lanes`, closed forms if `is_closed`, and tangents if `grows` is nonzero. */
static kr_worker *allocate_worker(size_t reductions, int in_lanes, int is_closed, int grows)
{
    const size_t rows = KR_LANES_MAX + 1,
                 lanes = in_lanes ? (sizeof(kr_lanes) + LINE - 1) / LINE * LINE : 0,
                 plans = is_closed ? KR_BATCH * sizeof(kr_exact_form) : 0,
                 tangents = grows ? sizeof(kr_lane_tangents) : 0,
                 size = sizeof(kr_worker) + LINE + lanes + tangents + plans +
                        reductions * (sizeof(kr_reduction) + rows * sizeof(kr_accumulator));
    kr_worker *worker = reductions < SIZE_MAX / 1024 ? calloc(1, size) : NULL;
    if (!worker) return NULL;
    char *memory = (char *)worker->memory + (LINE - (uintptr_t)worker->memory % LINE) % LINE;
    if (in_lanes) worker->lanes = (kr_lanes *)(void *)memory;
    if (grows) worker->lanes->tangents = (kr_lane_tangents *)(void *)(memory + lanes);
    if (is_closed) worker->plans = (kr_exact_form *)(void *)(memory + lanes);
    worker->accumulators = (kr_accumulator *)(void *)(memory + lanes + tangents + plans);
    worker->reduction = (kr_reduction *)(void *)(worker->accumulators + rows * reductions);
    return worker;
}
/* Allocates worker->fallback and worker->exact_top, if needed. Returns an error if the allocation
 * fails or the configuration suits no top. */
static kr_status create_scalar_tops(kr_worker *worker)
{
    const kr_method *method = worker->method ? worker->method : &kr_method_taylor;
    const kr_scene scene = kr_scene_default();
    kr_status status = KR_OK;
    if (worker->method != &kr_method_exact)
        status = kr_top_alloc(method, &worker->config, 0, &worker->fallback);
    if (status == KR_OK && worker->plans) {
        /* If the worker has no method, tops whose motion is on a torus use taylor. */
        const size_t extra = kr_exact_extra_doubles(worker->method != NULL);
        status = kr_top_alloc(&kr_method_exact, &worker->config, extra, &worker->exact_top);
    }
    if (status != KR_OK) return status;
    status = kr_top_init(worker->fallback ? worker->fallback : worker->exact_top, &scene, NULL,
                         &worker->config);
    const int suits_no_top = status == KR_ERR_ARGUMENT || status == KR_ERR_NO_STEP ||
                             status == KR_ERR_OPTION || status == KR_ERR_NOT_BUILT;
    return suits_no_top || status == KR_ERR_MEMORY ? status : KR_OK;
}
kr_status kr_worker_create(const kr_method *method, kr_config config, size_t reductions,
                           const kr_reduction reduction[], kr_worker **out)
{
    const int in_lanes = (!method || method == &kr_method_taylor) && config.digits <= 16,
              is_closed = !method || method == &kr_method_exact,
              grows = config.tangents == KR_TANGENT_GROWTH;
    if (!out || !are_valid_reductions(reductions, reduction)) return KR_ERR_ARGUMENT;
    if (config.tangents && !(grows && in_lanes && !is_closed)) return KR_ERR_OPTION;
    kr_worker *worker = allocate_worker(reductions, in_lanes, is_closed, grows);
    if (!worker) return KR_ERR_MEMORY;
    config.tangents = 0;
    worker->config = config;
    worker->method = method;
    worker->reductions = reductions;
    if (in_lanes) kr_scheduler_configure(worker);
    if (reductions) memcpy(worker->reduction, reduction, reductions * sizeof *reduction);
    const kr_status status = create_scalar_tops(worker);
    if (status == KR_OK)
        *out = worker;
    else
        kr_worker_free(worker);
    return status;
}
const char *kr_worker_kernel(const kr_worker *worker, int *order)
{
    const kr_top *top = worker->fallback ? worker->fallback : worker->exact_top;
    *order = worker->isa ? worker->lanes->order : top->method->order;
    return worker->isa ? worker->isa->name : "";
}
void kr_worker_free(kr_worker *worker)
{
    if (!worker) return;
    if (worker->fallback) kr_top_free(worker->fallback);
    if (worker->exact_top) kr_top_free(worker->exact_top);
    free(worker);
}
