/* Implementation of simulation.h. Time is counted in ticks. A row of the record holds the measured
 * values at its time, and their extrema since the previous row. In kr_simulation, `stride` is the
 * number of ticks between two rows, and `common` the least common multiple of the step sizes. */
#include <math.h>
#include "simulation.h"

/* Largest permitted step size in ticks, chosen so that its square fits in 64 bits. */
enum { LARGEST = INT32_MAX };

static double convert_ticks_to_time(int64_t ticks)
{
    return (double)ticks / (double)KR_SIMULATION_TICKS;
}

/* Returns the least common multiple of a and b, by Euclid's algorithm, or 0 if it is too large. */
static int64_t least_common_multiple(int64_t a, int64_t b)
{
    int64_t divisor = a, rest = b;
    while (rest) {
        const int64_t next = divisor % rest;
        divisor = rest;
        rest = next;
    }
    return a <= INT64_MAX / (b / divisor) ? a * (b / divisor) : 0;
}

const kr_quantity *kr_simulation_quantity(int k)
{
    for (size_t i = 0; kr_quantity_at(i); i++) {
        const kr_quantity *quantity = kr_quantity_at(i);
        const int turns = (quantity->flags & KR_QUANTITY_TURNS) != 0;
        if (quantity->doubles == 1 && !turns && k-- == 0) return quantity;
    }
    return NULL;
}
/* Writes the current measured values of top i. If `all` is zero, writes only the integrals of the
 * motion, the attitude error and the modified energy, and NaN for the other values. */
static void measure_top(const kr_simulation *simulation, int i, int all, double measure[])
{
    const kr_simulation_slot *a = &simulation->slots[i];
    const int compared = a->reference >= 0 && a->reference < simulation->count;
    const kr_simulation_slot *b = compared ? &simulation->slots[a->reference] : NULL;
    for (int k = 0; k < KR_SIMULATION_MEASURES; k++) measure[k] = NAN;
    if (a->status != KR_OK) return;
    for (int k = 0; k < KR_SIMULATION_ERROR; k++)
        if (a->quantity[k] && (all || a->quantity[k]->flags & KR_QUANTITY_CONSERVED))
            kr_quantity_values(a->quantity[k], &a->scene, 1, &a->now, &measure[k]);
    if (b && b->status == KR_OK && a->steps * a->step == b->steps * b->step)
        measure[KR_SIMULATION_ERROR] = kr_attitude_error(a->now.q, b->now.q);
    if (a->has_modified_energy)
        measure[KR_SIMULATION_MODIFIED] =
            kr_state_modified_energy(&a->scene, &a->now, convert_ticks_to_time(a->step), 1);
}
void kr_simulation_measure(const kr_simulation *simulation, int i,
                           double measure[KR_SIMULATION_MEASURES])
{
    measure_top(simulation, i, 1, measure);
}
/* Sets the quantities to be measured: those that are not NaN in the initial state. */
static void find_defined_quantities(kr_simulation_slot *a)
{
    for (int k = 0; k < KR_SIMULATION_ERROR; k++) {
        double value;
        a->quantity[k] = kr_simulation_quantity(k);
        kr_quantity_values(a->quantity[k], &a->scene, 1, &a->scene.start, &value);
        if (isnan(value)) a->quantity[k] = NULL;
    }
}

/* Extends the ranges of top i in `row` to the values `low` and `high`, unless they are NaN. */
static void widen_extremes(kr_record_row *row, int i, const double low[], const double high[])
{
    for (int k = 0; k < KR_SIMULATION_MEASURES; k++) {
        if (low[k] < row->low[i][k] || isnan(row->low[i][k])) row->low[i][k] = low[k];
        if (high[k] > row->high[i][k] || isnan(row->high[i][k])) row->high[i][k] = high[k];
    }
}
static void clear_incomplete_row(kr_simulation *simulation)
{
    kr_record_row *row = &simulation->record[simulation->rows];
    for (int i = 0; i < simulation->count; i++)
        for (int k = 0; k < KR_SIMULATION_MEASURES; k++)
            row->at[i][k] = row->low[i][k] = row->high[i][k] = NAN;
}
/* Doubles `stride`, and merges rows 2k - 1 and 2k into row k, with the time of row 2k, for k = 1 to
 * rows / 2. Then halves `rows`, the even number of complete rows: row `rows` is incomplete. */
static void merge_record_rows_in_pairs(kr_simulation *simulation)
{
    for (int64_t k = 1; 2 * k <= simulation->rows; k++) {
        simulation->record[k] = simulation->record[2 * k];
        const kr_record_row *before = &simulation->record[2 * k - 1];
        for (int i = 0; i < simulation->count; i++)
            widen_extremes(&simulation->record[k], i, before->low[i], before->high[i]);
    }
    simulation->rows /= 2;
    simulation->stride *= 2;
}
/* Returns 1 if the current time is a sample time. The interval between two rows of the record has
 * up to `samples` equidistant sample times, all multiples of `common`. */
static int is_sample_time(const kr_simulation *simulation, int samples)
{
    const int64_t part = simulation->stride / samples;
    return simulation->clock % (part > simulation->common ? part : simulation->common) == 0;
}
/* Measures all tops at a sample time. Completes a row of the record at a multiple of `stride`. */
static void record_measures_if_due(kr_simulation *simulation)
{
    if (!simulation->common || !is_sample_time(simulation, KR_SIMULATION_SAMPLES)) return;
    if (simulation->rows == KR_SIMULATION_ROWS) merge_record_rows_in_pairs(simulation);
    kr_record_row *row = &simulation->record[simulation->rows];
    const int all = is_sample_time(simulation, KR_SIMULATION_FULL_SAMPLES);
    for (int i = 0; i < simulation->count; i++) {
        measure_top(simulation, i, all, row->at[i]);
        widen_extremes(row, i, row->at[i], row->at[i]);
    }
    if (simulation->clock % simulation->stride) return;
    row->time = convert_ticks_to_time(simulation->clock);
    simulation->rows++;
    clear_incomplete_row(simulation);
}

void kr_simulation_clear(kr_simulation *simulation)
{
    for (int i = 0; i < simulation->count; i++) kr_top_free(simulation->slots[i].top);
    simulation->count = 0;
    simulation->clock = simulation->common = simulation->rows = 0;
}
/* Stores the current attitude and momentum of a top for its trails. */
static void store_trail_state(kr_simulation_slot *a)
{
    a->attitudes[a->steps % KR_SIMULATION_TRACE] = a->now.q;
    a->momenta[a->steps % KR_SIMULATION_TRACE] = a->now.m;
}
/* Initializes the slot after the last top, but does not add the top to the simulation. `step` and
 * `against` are those of kr_simulation_add. Returns KR_OK or an error. */
static kr_status prepare_top_in_slot(kr_simulation *simulation, const kr_scene *scene, int64_t step,
                                     int against)
{
    const kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    if (simulation->count == KR_SIMULATION_TOPS || simulation->clock || step < 1 ||
        step > LARGEST || against < KR_SIMULATION_REFERENCE || against >= KR_SIMULATION_TOPS ||
        against == simulation->count || scene->start.t != 0.0)
        return KR_ERR_ARGUMENT;
    kr_simulation_slot *a = &simulation->slots[simulation->count];
    a->scene = *scene;
    a->now = scene->start;
    a->top = NULL;
    a->track = NULL;
    a->length = a->steps = 0;
    a->restarts = a->has_modified_energy = 0;
    a->step = step;
    a->reference = against;
    a->status = KR_OK;
    a->lowest = -INFINITY;
    a->is_down = 0;
    a->stood = NAN;
    store_trail_state(a);
    find_defined_quantities(a);
    return KR_OK;
}
static void add_prepared_top(kr_simulation *simulation)
{
    const int64_t step = simulation->slots[simulation->count].step;
    if (simulation->count == 0)
        simulation->common = step;
    else if (simulation->common)
        simulation->common = least_common_multiple(simulation->common, step);
    simulation->stride = simulation->common;
    simulation->count++;
    simulation->rows = 0;
    clear_incomplete_row(simulation);
    record_measures_if_due(simulation);
}
/* Reduces the step budget by the steps since the last call. Returns nonzero if it is exhausted. */
static int poll_budget(void *context)
{
    kr_simulation *simulation = context;
    simulation->budget -= simulation->cost;
    return simulation->budget <= 0;
}
kr_status kr_simulation_add(kr_simulation *simulation, const kr_scene *scene,
                            const kr_method *method, int64_t step, double tol, int against)
{
    kr_config config = {.tol = tol, .poll = poll_budget, .context = simulation};
    kr_status status = prepare_top_in_slot(simulation, scene, step, against);
    if (status != KR_OK) return status;
    if (!method) return KR_ERR_NO_METHOD;
    const unsigned flags = kr_method_describe(method).flags;
    kr_simulation_slot *a = &simulation->slots[simulation->count];
    a->restarts = (flags & (KR_METHOD_ADAPTIVE | KR_METHOD_DENSE)) == KR_METHOD_ADAPTIVE;
    a->has_modified_energy = method == kr_method_find("bobenko_suris");
    if (!(flags & KR_METHOD_ADAPTIVE)) config.step = convert_ticks_to_time(step);
    status = kr_top_create(scene, method, config, &a->top);
    if (status == KR_OK) add_prepared_top(simulation);
    return status;
}
kr_status kr_simulation_add_track(kr_simulation *simulation, const kr_scene *scene,
                                  const kr_state track[], int64_t length, int64_t step, int against)
{
    const kr_status status = prepare_top_in_slot(simulation, scene, step, against);
    if (status != KR_OK) return status;
    if (!track || length < 1) return KR_ERR_ARGUMENT;
    simulation->slots[simulation->count].track = track;
    simulation->slots[simulation->count].length = length;
    add_prepared_top(simulation);
    return KR_OK;
}
void kr_simulation_set_floor(kr_simulation *simulation, double lowest)
{
    if (simulation->count) simulation->slots[simulation->count - 1].lowest = lowest;
}

/* If the apex is below the floor, restores the previous state `before` and stops the top there. */
static void stop_below_floor(kr_simulation_slot *a, const kr_state *before)
{
    const double high = kr_state_apex(&a->scene, before).z,
                 low = kr_state_apex(&a->scene, &a->now).z;
    if (!(low < a->lowest)) return;
    a->is_down = 1;
    a->stood = convert_ticks_to_time(a->steps * a->step) +
               convert_ticks_to_time(a->step) * (high - a->lowest) / (high - low);
    a->now = *before;
}
/* Advances a top by one step. Returns 0 if the step budget was exhausted before its end, else 1. */
static int take_step_within_budget(kr_simulation *simulation, kr_simulation_slot *a)
{
    const int64_t k = a->steps + 1;
    const kr_state before = a->now;
    simulation->cost = a->restarts ? 1 : 256; /* steps of the method between two calls of poll */
    if (a->track) {
        a->status = k < a->length ? KR_OK : KR_ERR_LIMIT;
        if (a->status == KR_OK) a->now = a->track[k];
    } else {
        const kr_status status = kr_top_advance(a->top, (double)k * convert_ticks_to_time(a->step));
        if (status == KR_ERR_INTERRUPTED) return 0;
        a->status = status;
        a->now = kr_top_state(a->top);
        if (a->status == KR_OK && a->restarts) a->status = kr_top_reset(a->top, &a->now);
    }
    if (a->status == KR_OK) stop_below_floor(a, &before);
    if (a->status == KR_OK && !a->is_down) {
        a->steps = k;
        store_trail_state(a);
    }
    return 1;
}
/* Sets *next to the top whose next step ends first, and returns the time of this end in ticks.
 * Returns INT64_MAX if no top can continue, or only tops that merely serve as references can. */
static int64_t find_next_step(kr_simulation *simulation, kr_simulation_slot **next)
{
    int64_t first = INT64_MAX;
    int goes_on = 0;
    for (int i = 0; i < simulation->count; i++) {
        kr_simulation_slot *a = &simulation->slots[i];
        const int64_t tick = (a->steps + 1) * a->step;
        if (a->status != KR_OK || a->is_down) continue;
        goes_on |= a->reference != KR_SIMULATION_REFERENCE;
        if (tick >= first) continue;
        first = tick;
        *next = a;
    }
    return goes_on ? first : INT64_MAX;
}
int64_t kr_simulation_advance(kr_simulation *simulation, int64_t target, int64_t most)
{
    kr_simulation_slot *next = NULL;
    int64_t tick = find_next_step(simulation, &next);
    simulation->is_late = 0;
    simulation->budget = KR_SIMULATION_BUDGET +
                         KR_SIMULATION_BUDGET_PER_STEP * (most < INT32_MAX ? most : INT32_MAX);
    while (tick <= target && most-- > 0) {
        const int64_t reached = tick;
        simulation->is_late = !take_step_within_budget(simulation, next);
        if (simulation->is_late) break;
        tick = find_next_step(simulation, &next);
        if (tick == reached || tick == INT64_MAX) continue; /* another step ends at `reached` */
        simulation->clock = reached;
        record_measures_if_due(simulation);
    }
    return simulation->clock;
}
