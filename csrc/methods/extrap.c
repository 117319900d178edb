/* Extrapolation with control of order and step, on the thesis' twelve equations in the rest frame (3.9). The midpoint
 * rule with n_j = 2 j substeps and Gragg's smoothing errs in even powers of 1 / n_j; hence, by Aitken and Neville,
 *     T(j,1) = midpoint with n_j,    T(j,k+1) = T(j,k) + (T(j,k) - T(j-1,k)) / ((n_j / n_(j-k))^2 - 1)
 * A step ends at a row j where T(j,j) - T(j,j-1) is within tol in the thesis' norm (4.1.1); the next aims at the row
 * with the least work per unit of time. Logic and constants are ODEX's. Keeps nothing. */
#include <float.h>
#include "../rest_frame.h"

enum { ROWS = 9, TRIES = 1000, REJECTED = 0, UNSTABLE = -1 };

typedef struct {
    double h;                       /* length of the next step */
    int target;                     /* the row it aims at */
    int first;
} control;
typedef struct {
    double y[REST_FRAME];
    kr_quat q;
    control next;
} path;
typedef struct {                    /* to make a step of h; rows count from 1, as in the book */
    kr_run *run;
    const double *y;
    double rate[REST_FRAME], speed; /* at y */
    double tol, h, err;
    double table[ROWS + 1][REST_FRAME];     /* after row j: [k] is T(j, j + 1 - k) */
    double length[ROWS + 1], work[ROWS + 1];        /* of the step that a row suggests; and per unit of time */
    int row;                        /* the last made */
} attempt;

static double cost(int row) { return 1.0 + row * (row + 1); }      /* evaluations up to this row */
static int least(int a, int b) { return a < b ? a : b; }
static double square(double x) { return x * x; }

/* Root mean square of a difference on the scale 1 + |y|; over tol it is the thesis' norm. */
static double size(const double a[REST_FRAME], const double b[REST_FRAME], const double y[REST_FRAME],
                   const double z[REST_FRAME])
{
    double sum = 0.0;
    for (int i = 0; i < REST_FRAME; i++) sum += square((a[i] - b[i]) / (1.0 + fmax(fabs(y[i]), fabs(z[i]))));
    return sqrt(sum / REST_FRAME);
}

/* T(row, 1). False where a substep changes the rates by more than twice their size: no row will converge then. */
static int midpoint(attempt *a, int row)
{
    const int n = 2 * row;
    const double h = a->h / n;
    double before[REST_FRAME], now[REST_FRAME], rate[REST_FRAME];
    for (int i = 0; i < REST_FRAME; i++) before[i] = a->y[i], now[i] = a->y[i] + h * a->rate[i];
    for (int k = 1; k < n; k++) {
        rest_frame_rates(a->run, now, rate);
        if (k == 1 && row <= 2 && size(rate, a->rate, a->y, a->y) > 2.0 * a->speed) return 0;
        for (int i = 0; i < REST_FRAME; i++) {
            const double next = before[i] + 2.0 * h * rate[i];
            before[i] = now[i];
            now[i] = next;
        }
    }
    rest_frame_rates(a->run, now, rate);
    for (int i = 0; i < REST_FRAME; i++) a->table[row][i] = 0.5 * ((before[i] + now[i]) + h * rate[i]);
    return 1;
}
static void extrapolate(attempt *a, int row)
{
    for (int k = row; k > 1; k--) {
        const double divisor = square((double)row / (k - 1)) - 1.0;
        const double *better = a->table[k];
        double *worse = a->table[k - 1];
        for (int i = 0; i < REST_FRAME; i++) worse[i] = better[i] + (better[i] - worse[i]) / divisor;
    }
}
/* False where the rows do not converge, or are no numbers. */
static int add_row(attempt *a, int row)
{
    const double exponent = 1.0 / (2 * row - 1), shrink = pow(0.02, exponent), last = a->err;
    if (!midpoint(a, row)) return 0;
    a->row = row;
    a->work[row] = INFINITY;        /* a single row tells nothing of its error */
    if (row == 1) return 1;
    extrapolate(a, row);
    a->err = size(a->table[1], a->table[2], a->table[1], a->table[2]) / a->tol;
    if (!(a->err < 1e15) || (row > 2 && a->err >= fmax(4.0 * last, 1.0))) return 0;
    a->length[row] = fabs(a->h) / fmin(4.0 / shrink, fmax(shrink, pow(a->err / 0.65, exponent) / 0.94));
    a->work[row] = cost(row) / a->length[row];
    return 1;
}
/* The row that meets the tolerance, sought from row `from` to target + 1; given up where the rows that are left are
 * not expected to reduce the error enough. */
static int converge(attempt *a, int from, int target)
{
    for (int row = 1; row <= target + 1; row++) {
        if (!add_row(a, row)) return UNSTABLE;
        if (row < from) continue;
        if (a->err <= 1.0) return row;
        if (row == target - 1 && row == from && a->err > square(target * (target + 1.0))) return REJECTED;
        if (row == target && a->err > square(target + 1.0)) return REJECTED;
    }
    return REJECTED;
}

static int best_row(const attempt *a, int target, int rejected)
{
    const double *work = a->work;
    const int row = a->row;
    int best = row;
    if (row == 2) return rejected ? 2 : 3;
    if (row <= target) {
        if (work[row - 1] < 0.8 * work[row]) best = row - 1;
        if (work[row] < 0.9 * work[row - 1]) best = rejected ? row : least(row + 1, ROWS - 1);
    } else {
        best = row > 3 && work[row - 2] < 0.8 * work[row - 1] ? row - 2 : row - 1;
        if (work[row] < 0.9 * work[best]) best = least(row, ROWS - 1);
    }
    return best;
}
static control after_accepted(const attempt *a, int target, int rejected)
{
    const int row = a->row, best = best_row(a, target, rejected);
    control next = {.h = a->length[best <= row ? best : row], .target = best};
    if (best > row)     /* a row not made yet: its work per unit of time is taken for that of the last */
        next.h *= cost(row < target && a->work[row] < 0.9 * a->work[row - 1] ? best + 1 : best) / cost(row);
    if (rejected) next.h = fmin(next.h, fabs(a->h));
    return next;
}
static control after_failed(const attempt *a, control tried, int outcome)
{
    int row = least(tried.target, a->row);
    tried.first = 0;
    if (outcome == UNSTABLE) {
        tried.h = 0.5 * fabs(a->h);
        return tried;
    }
    if (row > 2 && a->work[row - 1] < 0.8 * a->work[row]) row--;
    tried.h = a->length[row];
    tried.target = row;
    return tried;
}

static double tolerance(const kr_run *run) { return run->tol > 0.0 ? run->tol : 1e-10; }
static kr_status reset(kr_run *run, const kr_state *start)
{
    path *p = (path *)run->work;
    const double row = fmin(0.6 * -log10(tolerance(run)) + 1.5, ROWS - 1);
    const double h = run->step != 0.0 ? fabs(run->step) : 0.1;
    const control next = {.h = h, .target = row < 2.0 ? 2 : (int)row, .first = 1};
    rest_frame_begin(run, start, p->y);
    p->q = start->q;
    p->next = next;
    return KR_OK;
}
/* A step may turn the top by more than half a turn, hence q is taken near where its velocity leads. */
static void arrive(kr_run *run, const attempt *a, double end)
{
    path *p = (path *)run->work;
    const kr_vec3 w = v_add(rest_vec(p->y), rest_vec(a->table[1]));
    p->q = rest_frame_attitude(a->table[1], q_mul(q_exp(v_scale(0.5 * a->h, w)), p->q));
    memcpy(p->y, a->table[1], sizeof p->y);
    run->clock = end;
}
static kr_status step(kr_run *run, double until)
{
    static const double zero[REST_FRAME];
    path *p = (path *)run->work;
    const double forward = run->step < 0.0 ? -1.0 : 1.0;
    attempt a = {.run = run, .y = p->y, .tol = tolerance(run)};
    control now = p->next;
    rest_frame_rates(run, p->y, a.rate);
    a.speed = size(a.rate, zero, p->y, p->y);
    if (!isfinite(a.speed)) return KR_ERR_NOT_FINITE;
    if (a.tol < DBL_EPSILON) return KR_ERR_STEP;        /* no step in doubles can meet it */
    for (int rejected = 0; rejected < TRIES; rejected++) {
        const int lands = forward * (until - run->clock) <= 1.01 * now.h;
        const int anywhere = now.target == 2 || (!rejected && (now.first || lands));
        const double end = lands ? until : run->clock + forward * now.h;
        a.h = end - run->clock;
        if (a.h == 0.0 || !isfinite(a.h)) return KR_ERR_STEP;
        const int outcome = converge(&a, anywhere ? 2 : rejected ? now.target : now.target - 1, now.target);
        if (outcome > REJECTED) {
            arrive(run, &a, end);
            /* a step cut short to land says nothing about the next */
            if (!lands || rejected) p->next = after_accepted(&a, now.target, rejected > 0);
            return KR_OK;
        }
        now = after_failed(&a, now, outcome);
        run->stats.rejected++;
    }
    return KR_ERR_STEP;
}
static void read(const kr_run *run, kr_state *s)
{
    const path *p = (const path *)run->work;
    s->q = p->q;
    s->m = rest_frame_momentum(run, p->y);
}

const kr_method kr_method_extrap = {
    .name = "extrap",
    .text = "Gragg-Bulirsch-Stoer extrapolation with order and step control on the twelve rest-frame equations",
    .conserves = "nothing",
    .reference = "Gragg 1965; Bulirsch and Stoer 1966; Hairer, Norsett, Wanner, II.9",
    .order = 0,
    .flags = KR_ADAPTIVE | KR_ABSOLUTE,
    .work = sizeof(path) / sizeof(double), .reset = reset, .step = step, .read = read,
};
