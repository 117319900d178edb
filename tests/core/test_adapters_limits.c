/* The adaptive methods at their limits: landing, first steps, tolerances, failures, and the same
 * bits again. */
#include "adapters.h"

static void lands(const kr_method *method, const problem *p)
{
    static const double times[] = {0.0123456789, 0.7, 1.0 / 3.0 + 0.5, 2.7182818284590452, 9.1};
    for (double way = -1.0; way <= 1.0; way += 2.0) {
        kr_motion run = open_run(method, p, 0.05 * way, 1e-10);
        for (size_t i = 0; i < sizeof times / sizeof *times; i++) to(method, &run, way * times[i]);
        close_run(method, &run);
    }
}
/* A step cut short to land leaves the next as long as it would have been. */
static void landing_spoils_nothing(const kr_method *method)
{
    kr_motion run = open_run(method, &thesis, 0.0, 1e-8);
    double natural;
    for (int i = 0; i < 20; i++) IS(method->step(&run, INFINITY) == KR_OK);
    natural = run.clock;
    IS(method->step(&run, INFINITY) == KR_OK);
    natural = run.clock - natural;
    to(method, &run, run.clock + 1e-6);
    const double landed = run.clock;
    IS(method->step(&run, INFINITY) == KR_OK);
    IS(run.clock - landed > 0.2 * natural && run.clock - landed < 5.0 * natural);
    close_run(method, &run);
}
/* Ends with this status, soon, and leaves q, m and the clock as they were. */
static void fails(const kr_method *method, const problem *p, double tol, kr_status want)
{
    kr_motion run = {.inertia = p->inertia, .lever = p->lever, .step = 0.01, .tol = tol};
    kr_state before = {0}, after = {0};
    run.work = calloc(method->work, sizeof(double));
    kr_status status = method->reset(&run, &p->start);
    if (status == KR_OK) {
        method->read(&run, &before);
        status = method->step(&run, INFINITY);
        method->read(&run, &after);
        IS(same(&before, &after));
    }
    IS(status == want);
    IS(run.clock == 0.0);
    IS(run.stats.evaluations < 100000);
    close_run(method, &run);
}
static void failures(const kr_method *method)
{
    problem p = thesis;
    p.start.m.y = NAN;
    fails(method, &p, 1e-10, KR_ERR_NOT_FINITE);
    p = thesis;
    p.start.q.x = INFINITY;
    fails(method, &p, 1e-10, KR_ERR_NOT_FINITE);
    p = thesis;
    p.lever.z = NAN;
    fails(method, &p, 1e-10, KR_ERR_NOT_FINITE);
    fails(method, &thesis, 1e-20, KR_ERR_STEP);
    fails(method, &thesis, 1e-300, KR_ERR_STEP);
}
/* Where time is so late that no step of the needed length can be told, there is no step. */
static void no_resolution(const kr_method *method)
{
    kr_motion run = open_run(method, &thesis, 0.01, 1e-10);
    run.clock = 0x1p60;
    IS(method->step(&run, INFINITY) == KR_ERR_STEP);
    IS(run.clock == 0x1p60);
    close_run(method, &run);
}
/* Tolerances about rounding are met, or not, with no more work than is due. */
static void limit_of_tol(const kr_method *method, const problem *p)
{
    for (double tol = 8.0 * DBL_EPSILON; tol >= DBL_EPSILON; tol *= 0.5) {
        kr_motion run = open_run(method, p, 0.0, tol);
        kr_status status = KR_OK;
        while (status == KR_OK && run.clock != 1.0 && run.stats.evaluations < 10000)
            status = method->step(&run, 1.0);
        IS(status == KR_ERR_STEP || run.clock == 1.0);
        close_run(method, &run);
    }
}
/* A first step far too long is cut down; one far too short grows. */
static void first_steps(const kr_method *method)
{
    static const double steps[] = {1e-12, 1e3, 1e9};
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        kr_motion run = open_run(method, &thesis, steps[i], 1e-10);
        const kr_state s = to(method, &run, 10.0);
        NEAR(apart(s.q, thesis.at_10.q), 0.0, 1e-7);
        IS(run.stats.evaluations < 6000);
        close_run(method, &run);
    }
}
/* At rest the error is zero and the step grows: until time ends. */
static void rest(const kr_method *method)
{
    problem p = thesis;
    p.start.m = v3(0.0, 0.0, 0.0);
    kr_motion run = open_run(method, &p, 0.0, 1e-10);
    kr_state s = {0};
    kr_status status = KR_OK;
    for (int i = 0; i < 500 && status == KR_OK; i++) status = method->step(&run, INFINITY);
    method->read(&run, &s);
    IS(status == KR_OK || status == KR_ERR_STEP);
    IS(run.clock > 1e15 && isfinite(run.clock));
    IS(s.q.w == 1.0 && v_length(s.m) == 0.0);
    close_run(method, &run);
}

static void same_bits(const kr_method *method, const problem *p)
{
    kr_motion run = open_run(method, p, 0.0, 1e-10);
    const kr_state first = to(method, &run, 5.0);
    for (int i = 0; i < 3; i++) {
        run.clock = 0.0;
        IS(method->reset(&run, &p->start) == KR_OK);
        const kr_state again = to(method, &run, 5.0);
        IS(same(&first, &again));
    }
    close_run(method, &run);
    run = open_run(method, p, 0.0, 1e-10);
    const kr_state other = to(method, &run, 5.0);
    IS(same(&first, &other));
    close_run(method, &run);
}

int main(void)
{
    for (size_t i = 0; i < METHODS; i++) {
        const kr_method *method = methods[i];
        lands(method, &asymmetric);
        landing_spoils_nothing(method);
        failures(method);
        no_resolution(method);
        limit_of_tol(method, &asymmetric);
        first_steps(method);
        rest(method);
        same_bits(method, &asymmetric);
    }
    return check_result();
}
