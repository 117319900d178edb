/* The stage: see simulation.h. */
#include <math.h>
#include "simulation.h"

/* The largest step in ticks. A product of two steps fits in 64 bits. */
enum { LARGEST = INT32_MAX };

/* Returns how long so many ticks take. */
static double time_of(int64_t ticks) { return (double)ticks / (double)KR_SIMULATION_TICKS; }

static int64_t greatest_common_divisor(int64_t a, int64_t b)
{
    while (b) {
        const int64_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}
static int64_t common_multiple(int64_t a, int64_t b)
{
    const int64_t share = b / greatest_common_divisor(a, b);
    return a <= INT64_MAX / share ? a * share : 0;
}

const kr_quantity *kr_simulation_quantity(int k)
{
    for (size_t i = 0; i < kr_quantity_count(); i++) {
        const kr_quantity *quantity = kr_quantity_at(i);
        const int turns = (kr_quantity_flags(quantity) & KR_QUANTITY_TURNS) != 0;
        if (kr_quantity_doubles(quantity) == 1 && !turns && k-- == 0) return quantity;
    }
    return NULL;
}
static int is_integral(const kr_quantity *quantity)
{
    return (kr_quantity_flags(quantity) & KR_QUANTITY_CONSERVED) != 0;
}
/* Measures top i: all of it, or integrals and error alone. */
static void measure_top(const kr_simulation *stage, int i, int all, double measure[])
{
    const kr_simulation_slot *a = &stage->slots[i];
    const int compared = a->reference >= 0 && a->reference < stage->count;
    const kr_simulation_slot *b = compared ? &stage->slots[a->reference] : NULL;
    for (int k = 0; k < KR_SIMULATION_MEASURES; k++) measure[k] = NAN;
    if (a->status != KR_OK) return;
    for (int k = 0; k < KR_SIMULATION_ERROR; k++)
        if (a->quantity[k] && (all || is_integral(a->quantity[k])))
            kr_quantity_values(a->quantity[k], &a->scene, 1, &a->now, &measure[k]);
    if (b && b->status == KR_OK && a->steps * a->step == b->steps * b->step)
        measure[KR_SIMULATION_ERROR] = kr_attitude_error(a->now.q, b->now.q);
    if (a->has_modified_energy)
        measure[KR_SIMULATION_MODIFIED] =
            kr_state_modified_energy(&a->scene, &a->now, time_of(a->step));
}
void kr_simulation_measure(const kr_simulation *stage, int i,
                           double measure[KR_SIMULATION_MEASURES])
{
    measure_top(stage, i, 1, measure);
}
/* Finds out what can be measured of a top: what is NaN at the start belongs to other bodies. */
static void choose_quantities(kr_simulation_slot *a)
{
    for (int k = 0; k < KR_SIMULATION_ERROR; k++) {
        double value;
        a->quantity[k] = kr_simulation_quantity(k);
        kr_quantity_values(a->quantity[k], &a->scene, 1, &a->scene.start, &value);
        if (isnan(value)) a->quantity[k] = NULL;
    }
}

/* Lets the extremes of top i take up others. What is NaN is left out. */
static void widen_extremes(kr_record_row *row, int i, const double low[], const double high[])
{
    for (int k = 0; k < KR_SIMULATION_MEASURES; k++) {
        if (low[k] < row->low[i][k] || isnan(row->low[i][k])) row->low[i][k] = low[k];
        if (high[k] > row->high[i][k] || isnan(row->high[i][k])) row->high[i][k] = high[k];
    }
}
static void begin_row(kr_simulation *stage)
{
    kr_record_row *row = &stage->record[stage->rows];
    for (int i = 0; i < stage->count; i++)
        for (int k = 0; k < KR_SIMULATION_MEASURES; k++)
            row->at[i][k] = row->low[i][k] = row->high[i][k] = NAN;
}
/* Joins each row with the one before it. The last row begins the span of the row that is to come,
 * and goes there. */
static void halve_record(kr_simulation *stage)
{
    for (int64_t k = 1; 2 * k <= stage->rows; k++) {
        stage->record[k] = stage->record[2 * k];
        const kr_record_row *before = &stage->record[2 * k - 1];
        for (int i = 0; i < stage->count; i++)
            widen_extremes(&stage->record[k], i, before->low[i], before->high[i]);
    }
    stage->rows /= 2;
    stage->stride *= 2;
}
/* Whether the clock stands where something is to be done so many times from row to row. */
static int is_sample_time(const kr_simulation *stage, int times)
{
    const int64_t part = stage->stride / times;
    return stage->clock % (part > stage->common ? part : stage->common) == 0;
}
static void record_measures(kr_simulation *stage)
{
    if (!stage->common || !is_sample_time(stage, KR_SIMULATION_SAMPLES)) return;
    if (stage->rows == KR_SIMULATION_ROWS) halve_record(stage);
    kr_record_row *row = &stage->record[stage->rows];
    const int all = is_sample_time(stage, KR_SIMULATION_FULL_SAMPLES);
    for (int i = 0; i < stage->count; i++) {
        measure_top(stage, i, all, row->at[i]);
        widen_extremes(row, i, row->at[i], row->at[i]);
    }
    if (stage->clock % stage->stride) return;
    row->time = time_of(stage->clock);
    stage->rows++;
    begin_row(stage);
}

void kr_simulation_clear(kr_simulation *stage)
{
    for (int i = 0; i < stage->count; i++) kr_top_free(stage->slots[i].top);
    stage->count = 0;
    stage->clock = stage->common = stage->rows = 0;
}
/* Makes a place for one more top, behind the others, if it can have one. */
static kr_status prepare_top(kr_simulation *stage, const kr_scene *scene, int64_t step, int against)
{
    const kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    if (stage->count == KR_SIMULATION_TOPS || stage->clock || step < 1 || step > LARGEST)
        return KR_ERR_ARGUMENT;
    if (against < KR_SIMULATION_REFERENCE || against >= KR_SIMULATION_TOPS ||
        against == stage->count)
        return KR_ERR_ARGUMENT;
    if (scene->start.t != 0.0) return KR_ERR_ARGUMENT;
    kr_simulation_slot *a = &stage->slots[stage->count];
    a->scene = *scene;
    a->now = scene->start;
    a->top = NULL;
    a->track = NULL;
    a->length = a->steps = 0;
    a->restarts = a->has_modified_energy = 0;
    a->step = step;
    a->reference = against;
    a->status = KR_OK;
    a->trace[0] = scene->start.q;
    choose_quantities(a);
    return KR_OK;
}
/* The top that has its place comes in. */
static void add_prepared_top(kr_simulation *stage)
{
    const int64_t step = stage->slots[stage->count].step;
    if (stage->count == 0)
        stage->common = step;
    else if (stage->common)
        stage->common = common_multiple(stage->common, step);
    stage->stride = stage->common;
    stage->count++;
    stage->rows = 0;
    begin_row(stage);
    record_measures(stage);
}
/* A top asks whether to go on. */
static int poll_budget(void *context)
{
    kr_simulation *stage = context;
    stage->budget -= stage->cost;
    return stage->budget <= 0;
}
kr_status kr_simulation_add(kr_simulation *stage, const kr_scene *scene, const kr_method *method,
                            int64_t step, double tol, int against)
{
    kr_config config = {.tol = tol, .poll = poll_budget, .context = stage};
    kr_status status = prepare_top(stage, scene, step, against);
    if (status != KR_OK) return status;
    if (!method) return KR_ERR_NO_METHOD;
    const unsigned flags = kr_method_flags(method);
    kr_simulation_slot *a = &stage->slots[stage->count];
    a->restarts = (flags & (KR_METHOD_ADAPTIVE | KR_METHOD_DENSE)) == KR_METHOD_ADAPTIVE;
    a->has_modified_energy = method == kr_method_find("bobenko_suris");
    if (!(flags & KR_METHOD_ADAPTIVE)) config.step = time_of(step);
    status = kr_top_create(scene, method, config, &a->top);
    if (status == KR_OK) add_prepared_top(stage);
    return status;
}
kr_status kr_simulation_add_track(kr_simulation *stage, const kr_scene *scene,
                                  const kr_state track[], int64_t length, int64_t step, int against)
{
    const kr_status status = prepare_top(stage, scene, step, against);
    if (status != KR_OK) return status;
    if (!track || length < 1) return KR_ERR_ARGUMENT;
    stage->slots[stage->count].track = track;
    stage->slots[stage->count].length = length;
    add_prepared_top(stage);
    return KR_OK;
}

/* Returns 0 if the top is left on its way. */
static int take_step(kr_simulation *stage, kr_simulation_slot *a)
{
    const int64_t k = a->steps + 1;
    stage->cost = a->restarts ? 1 : 256; /* They ask once in so many steps of their own. */
    if (a->track) {
        a->status = k < a->length ? KR_OK : KR_ERR_LIMIT;
        if (a->status == KR_OK) a->now = a->track[k];
    } else {
        const kr_status status = kr_top_advance(a->top, (double)k * time_of(a->step));
        if (status == KR_ERR_INTERRUPTED) return 0;
        a->status = status;
        a->now = kr_top_state(a->top);
        if (a->status == KR_OK && a->restarts) a->status = kr_top_reset(a->top, &a->now);
    }
    if (a->status == KR_OK) {
        a->steps = k;
        a->trace[k % KR_SIMULATION_TRACE] = a->now.q;
    }
    return 1;
}
/* Finds the time of the next step, and whose it is; INT64_MAX if no top can go on. */
static int64_t next_step(kr_simulation *stage, kr_simulation_slot **next)
{
    int64_t first = INT64_MAX;
    int goes_on = 0;
    for (int i = 0; i < stage->count; i++) {
        kr_simulation_slot *a = &stage->slots[i];
        const int64_t tick = (a->steps + 1) * a->step;
        if (a->status != KR_OK) continue;
        goes_on |= a->reference != KR_SIMULATION_REFERENCE;
        if (tick >= first) continue;
        first = tick;
        *next = a;
    }
    return goes_on ? first : INT64_MAX;
}
int64_t kr_simulation_advance(kr_simulation *stage, int64_t target, int64_t most)
{
    kr_simulation_slot *next = NULL;
    int64_t tick = next_step(stage, &next);
    stage->is_late = 0;
    stage->budget = KR_SIMULATION_BUDGET +
                    KR_SIMULATION_BUDGET_PER_STEP * (most < INT32_MAX ? most : INT32_MAX);
    while (tick <= target && most-- > 0) {
        const int64_t reached = tick;
        stage->is_late = !take_step(stage, next);
        if (stage->is_late) break;
        tick = next_step(stage, &next);
        if (tick == reached || tick == INT64_MAX) continue; /* others step to the same time */
        stage->clock = reached;
        record_measures(stage);
    }
    return stage->clock;
}
