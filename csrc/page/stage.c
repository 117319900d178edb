/* The stage: see stage.h. */
#include <math.h>
#include "stage.h"

enum { LARGEST = INT32_MAX }; /* ticks to a step: then a product of two fits */

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

kr_measure kr_stage_measure(const kr_stage *stage, int i)
{
    const kr_actor *a = &stage->actor[i], *b = a->against >= 0 ? &stage->actor[a->against] : NULL;
    kr_measure m = {NAN, NAN, NAN, NAN, NAN};
    if (a->status != KR_OK) return m;
    m.energy = kr_state_kinetic(&a->scene, &a->now) + kr_state_potential(&a->scene, &a->now);
    m.vertical = kr_state_vertical_momentum(&a->scene, &a->now);
    m.axial = kr_state_axial_momentum(&a->scene, &a->now);
    m.fourth = kr_state_kowalewski(&a->scene, &a->now);
    if (isnan(m.fourth)) m.fourth = kr_state_goryachev_chaplygin(&a->scene, &a->now);
    if (b && b->status == KR_OK && a->steps * a->eps == b->steps * b->eps)
        m.error = 0.5 * kr_attitude_error(a->now.q, b->now.q);
    return m;
}
/* fmin and fmax leave out what is not a number */
static kr_measure least(kr_measure a, kr_measure b)
{
    const kr_measure m = {fmin(a.energy, b.energy), fmin(a.vertical, b.vertical),
                          fmin(a.axial, b.axial), fmin(a.fourth, b.fourth), fmin(a.error, b.error)};
    return m;
}
static kr_measure greatest(kr_measure a, kr_measure b)
{
    const kr_measure m = {fmax(a.energy, b.energy), fmax(a.vertical, b.vertical),
                          fmax(a.axial, b.axial), fmax(a.fourth, b.fourth), fmax(a.error, b.error)};
    return m;
}
static void widen(kr_row *row, const kr_measure low[], const kr_measure high[])
{
    for (int i = 0; i < KR_STAGE_TOPS; i++) {
        row->low[i] = least(row->low[i], low[i]);
        row->high[i] = greatest(row->high[i], high[i]);
    }
}
static void begin_row(kr_row *row)
{
    const kr_measure none = {NAN, NAN, NAN, NAN, NAN};
    for (int i = 0; i < KR_STAGE_TOPS; i++) row->at[i] = row->low[i] = row->high[i] = none;
}
/* Each row takes up the one before it: the last, which begins its span, goes to the row that is to
 * come. */
static void halve_record(kr_stage *stage)
{
    for (int64_t k = 1; 2 * k <= stage->rows; k++) {
        stage->row[k] = stage->row[2 * k];
        widen(&stage->row[k], stage->row[2 * k - 1].low, stage->row[2 * k - 1].high);
    }
    stage->rows /= 2;
    stage->stride *= 2;
}
static void record(kr_stage *stage)
{
    const int64_t often = stage->stride / KR_STAGE_LOOKS;
    if (!stage->common || stage->clock % (often > stage->common ? often : stage->common)) return;
    if (stage->rows == KR_STAGE_ROWS) halve_record(stage);
    kr_row *row = &stage->row[stage->rows];
    for (int i = 0; i < stage->tops; i++) row->at[i] = kr_stage_measure(stage, i);
    widen(row, row->at, row->at);
    if (stage->clock % stage->stride) return;
    row->time = (double)stage->clock / KR_STAGE_TICKS;
    stage->rows++;
    begin_row(&stage->row[stage->rows]);
}

void kr_stage_clear(kr_stage *stage)
{
    for (int i = 0; i < stage->tops; i++) kr_top_free(stage->actor[i].top);
    stage->tops = 0;
    stage->clock = stage->common = stage->rows = 0;
}
/* A place for one more, if it can have one. */
static kr_status place(kr_stage *stage, const kr_scene *scene, int64_t eps, int against)
{
    const kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    if (stage->tops == KR_STAGE_TOPS || stage->clock || eps < 1 || eps > LARGEST)
        return KR_ERR_ARGUMENT;
    if (against < -1 || against >= stage->tops || scene->start.t != 0.0) return KR_ERR_ARGUMENT;
    kr_actor *a = &stage->actor[stage->tops];
    a->scene = *scene;
    a->now = scene->start;
    a->top = NULL;
    a->track = NULL;
    a->length = a->steps = 0;
    a->restarts = 0;
    a->eps = eps;
    a->against = against;
    a->status = KR_OK;
    a->trace[0] = scene->start.q;
    return KR_OK;
}
static void enter(kr_stage *stage)
{
    const int64_t eps = stage->actor[stage->tops].eps;
    stage->common = stage->tops == 0 ? eps
                    : stage->common  ? common_multiple(stage->common, eps)
                                     : 0;
    stage->stride = stage->common;
    stage->tops++;
    stage->rows = 0;
    begin_row(&stage->row[0]);
    record(stage);
}
kr_status kr_stage_add(kr_stage *stage, const kr_scene *scene, const kr_method *method, int64_t eps,
                       double tol, int against)
{
    kr_config config = {.tol = tol};
    kr_status status = place(stage, scene, eps, against);
    if (status != KR_OK) return status;
    if (!method) return KR_ERR_ARGUMENT;
    const unsigned flags = kr_method_flags(method);
    kr_actor *a = &stage->actor[stage->tops];
    a->restarts = (flags & (KR_ADAPTIVE | KR_DENSE)) == KR_ADAPTIVE;
    if (!(flags & KR_ADAPTIVE)) config.step = (double)eps / KR_STAGE_TICKS;
    status = kr_top_create(scene, method, config, &a->top);
    if (status == KR_OK) enter(stage);
    return status;
}
kr_status kr_stage_add_track(kr_stage *stage, const kr_scene *scene, const kr_state track[],
                             int64_t length, int64_t eps, int against)
{
    const kr_status status = place(stage, scene, eps, against);
    if (status != KR_OK) return status;
    if (!track || length < 1) return KR_ERR_ARGUMENT;
    stage->actor[stage->tops].track = track;
    stage->actor[stage->tops].length = length;
    enter(stage);
    return KR_OK;
}

static void step(kr_actor *a)
{
    const int64_t k = a->steps + 1;
    if (a->track) {
        a->status = k < a->length ? KR_OK : KR_ERR_LIMIT;
        if (a->status == KR_OK) a->now = a->track[k];
    } else {
        a->status = kr_top_advance(a->top, (double)k * ((double)a->eps / KR_STAGE_TICKS));
        a->now = kr_top_state(a->top);
        if (a->status == KR_OK && a->restarts) a->status = kr_top_reset(a->top, &a->now);
    }
    if (a->status != KR_OK) return;
    a->steps = k;
    a->trace[k % KR_STAGE_TRACE] = a->now.q;
}
/* The time of the next step, and whose it is; INT64_MAX if no top can go on. */
static int64_t next_step(kr_stage *stage, kr_actor **next)
{
    int64_t first = INT64_MAX;
    for (int i = 0; i < stage->tops; i++) {
        kr_actor *a = &stage->actor[i];
        const int64_t tick = (a->steps + 1) * a->eps;
        if (a->status != KR_OK || tick >= first) continue;
        first = tick;
        *next = a;
    }
    return first;
}
int64_t kr_stage_advance(kr_stage *stage, int64_t target, int64_t most)
{
    kr_actor *next = NULL;
    int64_t tick = next_step(stage, &next);
    while (tick <= target && most-- > 0) {
        const int64_t reached = tick;
        step(next);
        tick = next_step(stage, &next);
        if (tick == reached || tick == INT64_MAX) continue; /* others step to the same time */
        stage->clock = reached;
        record(stage);
    }
    return stage->clock;
}
