/* Gragg-Bulirsch-Stoer (GBS) extrapolation with order and step-size control, for any formulation of
 * the motion as twelve differential equations. T(j,1) is the result of the midpoint rule for one
 * step, with n_j = 2 j substeps and Gragg's smoothing. The asymptotic expansion of its error
 * contains only even powers of 1 / n_j. The Aitken-Neville scheme therefore gives better
 * approximations:
 *     T(j,k+1) = T(j,k) + (T(j,k) - T(j-1,k)) / ((n_j / n_(j-k))^2 - 1).
 * A step is accepted at row j of the table T if the scaled norm (gbs_scaled_distance) of T(j,j) -
 * T(j,j-1) is at most tol (Bodack 2008, 4.1.1). Each step has a target row, at which it is expected
 * to be accepted: the row with the least expected work per unit of time. The rules and constants of
 * the step-size control follow ODEX (Hairer, Norsett, Wanner, II.9). No integrals are conserved. */
#ifndef KR_EXTRAPOLATION_H
#define KR_EXTRAPOLATION_H
#include <float.h>
#include "method.h"

enum { GBS_SIZE = 12, GBS_ROWS = 9, GBS_TRIES = 1000, GBS_REJECTED = 0, GBS_UNSTABLE = -1 };

/* A formulation of the equations of motion as twelve first-order differential equations for y. The
 * function `begin` converts a state to y, and `rates` computes dy/dt. The other functions compute
 * from y the angular velocity and the momentum in space, and the attitude. */
typedef struct {
    void (*begin)(const kr_motion *motion, const kr_state *s, double y[GBS_SIZE]);
    void (*rates)(kr_motion *motion, const double y[GBS_SIZE], double rate[GBS_SIZE]);
    kr_vec3 (*velocity)(const kr_motion *motion, const double y[GBS_SIZE]);
    kr_vec3 (*momentum)(const kr_motion *motion, const double y[GBS_SIZE]);
    /* Returns q or -q, whichever is closer to `last`. */
    kr_quat (*attitude)(const double y[GBS_SIZE], kr_quat last);
} gbs_form;

typedef struct {
    double h;   /* the length of the next step */
    int target; /* the target row of the next step */
    int first;  /* nonzero: the first step, whose length is a guess */
} gbs_control;
typedef struct {
    double y[GBS_SIZE];
    kr_quat q;
    gbs_control next;
} gbs_path;
enum { GBS_WORK = sizeof(gbs_path) / sizeof(double) };
/* A trial step of length h that starts from y. Rows of the extrapolation table are numbered from 1,
 * as in the book by Hairer, Norsett and Wanner. */
typedef struct {
    kr_motion *motion;
    const gbs_form *form;
    const double *y;
    double rate[GBS_SIZE], speed; /* the rates at y, and their norm */
    double tol, h, err;
    double table[GBS_ROWS + 1][GBS_SIZE]; /* after row j, table[k] is T(j, j + 1 - k) */
    double length[GBS_ROWS + 1];          /* length of the next step, suggested by each row */
    double work[GBS_ROWS + 1];            /* work per unit of time of steps with this length */
    int row;                              /* the last row that was computed */
} gbs_attempt;

/* Returns the number of evaluations of the right-hand side for rows 1 to `row` of the table. */
static inline double gbs_evaluations_up_to(int row) { return 1.0 + row * (row + 1); }
static inline int gbs_min(int a, int b) { return a < b ? a : b; }
static inline double gbs_square(double x) { return x * x; }

/* Returns the scaled norm of a - b, the root mean square of (a - b) / (1 + max(|y|, |z|)). */
static inline double gbs_scaled_distance(const double a[GBS_SIZE], const double b[GBS_SIZE],
                                         const double y[GBS_SIZE], const double z[GBS_SIZE])
{
    double sum = 0.0;
    for (int i = 0; i < GBS_SIZE; i++)
        sum += gbs_square((a[i] - b[i]) / (1.0 + fmax(fabs(y[i]), fabs(z[i]))));
    return sqrt(sum / (double)GBS_SIZE);
}

/* Computes T(row, 1). Returns 1, or 0 if row <= 2 and the first substep changes dy/dt by more than
 * 2 * a->speed (in the scaled norm), which shows that the extrapolation would diverge. */
static inline int gbs_try_midpoint_rule(gbs_attempt *a, int row)
{
    const int n = 2 * row;
    const double h = a->h / n;
    double before[GBS_SIZE], now[GBS_SIZE], rate[GBS_SIZE];
    for (int i = 0; i < GBS_SIZE; i++) {
        before[i] = a->y[i];
        now[i] = a->y[i] + h * a->rate[i];
    }
    for (int k = 1; k < n; k++) {
        a->form->rates(a->motion, now, rate);
        if (k == 1 && row <= 2 && gbs_scaled_distance(rate, a->rate, a->y, a->y) > 2.0 * a->speed)
            return 0;
        for (int i = 0; i < GBS_SIZE; i++) {
            const double next = before[i] + 2.0 * h * rate[i];
            before[i] = now[i];
            now[i] = next;
        }
    }
    a->form->rates(a->motion, now, rate);
    for (int i = 0; i < GBS_SIZE; i++)
        a->table[row][i] = 0.5 * ((before[i] + now[i]) + h * rate[i]);
    return 1;
}
/* Computes T(row, 2) to T(row, row), which overwrite the values of the previous row. */
static inline void gbs_extrapolate(gbs_attempt *a, int row)
{
    for (int k = row; k > 1; k--) {
        const double divisor = gbs_square((double)row / (k - 1)) - 1.0;
        const double *better = a->table[k];
        double *worse = a->table[k - 1];
        for (int i = 0; i < GBS_SIZE; i++) worse[i] = better[i] + (better[i] - worse[i]) / divisor;
    }
}
/* Computes a row of the table, its error divided by tol, and the length of the next step that this
 * error suggests. Returns 0 if the extrapolation diverges or its result is not finite, else 1. */
static inline int gbs_compute_row(gbs_attempt *a, int row)
{
    const double exponent = 1.0 / (2 * row - 1), shrink = pow(0.02, exponent), last = a->err;
    if (!gbs_try_midpoint_rule(a, row)) return 0;
    a->row = row;
    a->work[row] = INFINITY; /* a single row gives no estimate of its error */
    if (row == 1) return 1;
    gbs_extrapolate(a, row);
    a->err = gbs_scaled_distance(a->table[1], a->table[2], a->table[1], a->table[2]) / a->tol;
    if (!(a->err < 1e15) || (row > 2 && a->err >= fmax(4.0 * last, 1.0))) return 0;
    a->length[row] =
        fabs(a->h) / fmin(4.0 / shrink, fmax(shrink, pow(a->err / 0.65, exponent) / 0.94));
    a->work[row] = gbs_evaluations_up_to(row) / a->length[row];
    return 1;
}
/* Computes the table up to row target + 1, and returns the first row, not before row `from`, that
 * meets the tolerance. Returns GBS_REJECTED as soon as the remaining rows are unlikely to meet the
 * tolerance, and GBS_UNSTABLE if the extrapolation diverges. */
static inline int gbs_find_converged_row(gbs_attempt *a, int from, int target)
{
    for (int row = 1; row <= target + 1; row++) {
        if (!gbs_compute_row(a, row)) return GBS_UNSTABLE;
        if (row < from) continue;
        if (a->err <= 1.0) return row;
        if (row == target - 1 && row == from && a->err > gbs_square(target * (target + 1.0)))
            return GBS_REJECTED;
        if (row == target && a->err > gbs_square(target + 1.0)) return GBS_REJECTED;
    }
    return GBS_REJECTED;
}

/* Returns the row with the least expected work per unit of time in the next step. `target` is the
 * target row of the step in `a`. If earlier trials were `rejected`, returns at most a->row. */
static inline int gbs_best_row(const gbs_attempt *a, int target, int rejected)
{
    const double *work = a->work;
    const int row = a->row;
    int best = row;
    if (row == 2) return rejected ? 2 : 3;
    if (row <= target) {
        if (work[row - 1] < 0.8 * work[row]) best = row - 1;
        if (work[row] < 0.9 * work[row - 1]) best = rejected ? row : gbs_min(row + 1, GBS_ROWS - 1);
    } else {
        best = row > 3 && work[row - 2] < 0.8 * work[row - 1] ? row - 2 : row - 1;
        if (work[row] < 0.9 * work[best]) best = gbs_min(row, GBS_ROWS - 1);
    }
    return best;
}
static inline gbs_control gbs_plan_next_step(const gbs_attempt *a, int target, int rejected)
{
    const int row = a->row, best = gbs_best_row(a, target, rejected);
    gbs_control next = {.h = a->length[best <= row ? best : row], .target = best};
    /* The step size of a row not yet computed follows from the costs of the rows, as in ODEX. */
    if (best > row)
        next.h *=
            gbs_evaluations_up_to(row < target ? best + 1 : best) / gbs_evaluations_up_to(row);
    if (rejected) next.h = fmin(next.h, fabs(a->h));
    return next;
}
/* Returns the step size and target row to try after the trial step `tried` failed. */
static inline gbs_control gbs_plan_retry(const gbs_attempt *a, gbs_control tried, int outcome)
{
    int row = gbs_min(tried.target, a->row);
    tried.first = 0;
    if (outcome == GBS_UNSTABLE) {
        tried.h = 0.5 * fabs(a->h);
        return tried;
    }
    if (a->work[row - 1] < 0.8 * a->work[row]) row--;
    tried.h = a->length[row];
    tried.target = row;
    return tried;
}

static inline double gbs_tolerance(const kr_motion *motion)
{
    return motion->tol > 0.0 ? motion->tol : 1e-10;
}
static inline kr_status gbs_reset(kr_motion *motion, const kr_state *start, const gbs_form *form)
{
    gbs_path *p = (gbs_path *)motion->work;
    const double row = fmin(0.6 * -log10(gbs_tolerance(motion)) + 1.5, GBS_ROWS - 1);
    const double h = motion->step != 0.0 ? fabs(motion->step) : 0.1;
    form->begin(motion, start, p->y);
    p->q = start->q;
    p->next = (gbs_control){.h = h, .target = row < 2.0 ? 2 : (int)row, .first = 1};
    return KR_OK;
}
/* Accepts a trial step, which ends at the time `end` in internal units. The top may rotate by more
 * than half a turn per step. The sign of the new quaternion is therefore chosen by comparison with
 * the previous quaternion, rotated at the mean angular velocity. */
static inline void gbs_accept_step(kr_motion *motion, const gbs_attempt *a, double end)
{
    gbs_path *p = (gbs_path *)motion->work;
    const kr_vec3 twice =
        v_add(a->form->velocity(motion, p->y), a->form->velocity(motion, a->table[1]));
    p->q = a->form->attitude(a->table[1], q_mul(q_exp(v_scale(0.5 * a->h, twice)), p->q));
    memcpy(p->y, a->table[1], sizeof p->y);
    motion->clock = end;
}
static inline kr_status gbs_step(kr_motion *motion, double until, const gbs_form *form)
{
    static const double zero[GBS_SIZE];
    gbs_path *p = (gbs_path *)motion->work;
    const double forward = motion->step < 0.0 ? -1.0 : 1.0;
    gbs_attempt a = {.motion = motion, .form = form, .y = p->y, .tol = gbs_tolerance(motion)};
    gbs_control now = p->next;
    form->rates(motion, p->y, a.rate);
    a.speed = gbs_scaled_distance(a.rate, zero, p->y, p->y);
    if (!isfinite(a.speed)) return KR_ERR_NOT_FINITE;
    if (a.tol < DBL_EPSILON) return KR_ERR_STEP; /* below rounding errors */
    for (int rejected = 0; rejected < GBS_TRIES; rejected++) {
        const int lands = forward * (until - motion->clock) <= 1.01 * now.h;
        const int anywhere = now.target == 2 || (!rejected && (now.first || lands));
        const double end = lands ? until : motion->clock + forward * now.h;
        a.h = end - motion->clock;
        if (a.h == 0.0 || !isfinite(a.h)) return KR_ERR_STEP;
        const int from = anywhere ? 2 : rejected ? now.target : now.target - 1;
        const int outcome = gbs_find_converged_row(&a, from, now.target);
        if (outcome > GBS_REJECTED) {
            gbs_accept_step(motion, &a, end);
            /* A step shortened to end at `until` does not affect the size of the next step. */
            if (!lands || rejected) p->next = gbs_plan_next_step(&a, now.target, rejected > 0);
            return KR_OK;
        }
        now = gbs_plan_retry(&a, now, outcome);
        motion->stats.rejected++;
    }
    return KR_ERR_STEP;
}
static inline int gbs_is_valid(const void *work)
{
    gbs_path p;
    memcpy(&p, work, sizeof p);
    return p.next.target >= 2 && p.next.target < GBS_ROWS && p.next.h > 0.0;
}
static inline void gbs_read(const kr_motion *motion, kr_state *s, const gbs_form *form)
{
    const gbs_path *p = (const gbs_path *)motion->work;
    s->q = p->q;
    s->m = form->momentum(motion, p->y);
}
/* Defines the method that extrapolates a formulation of the equations of motion. */
#define EXTRAPOLATION_METHOD(id, form, its_text, its_source)                                       \
    static kr_status id##_reset(kr_motion *motion, const kr_state *start)                          \
    {                                                                                              \
        return gbs_reset(motion, start, &form);                                                    \
    }                                                                                              \
    static kr_status id##_step(kr_motion *motion, double until)                                    \
    {                                                                                              \
        return gbs_step(motion, until, &form);                                                     \
    }                                                                                              \
    static void id##_read(const kr_motion *motion, kr_state *s) { gbs_read(motion, s, &form); }    \
    const kr_method kr_method_##id = {                                                             \
        KR_METHOD_TEXTS(#id, its_text, "nothing", its_source),                                     \
        .order = 0,                                                                                \
        .flags = KR_METHOD_ADAPTIVE | KR_METHOD_ABSOLUTE | KR_METHOD_ROTORS | KR_METHOD_TURNING |  \
                 KR_METHOD_GRADIENT,                                                               \
        .work = GBS_WORK,                                                                          \
        .reset = id##_reset,                                                                       \
        .step = id##_step,                                                                         \
        .read = id##_read,                                                                         \
        .is_valid = gbs_is_valid,                                                                  \
    };
#endif
