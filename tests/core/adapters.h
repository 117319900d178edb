/* What the tests of the adaptive methods share: two tops, and runs without the driver. */
#ifndef KR_ADAPTERS_H
#define KR_ADAPTERS_H
#include <float.h>
#include <stdlib.h>
#include "method.h"
#include "check.h"

static const kr_method *const methods[] = {
    &kr_method_extrap,
#ifdef KREISEL_GSL
    &kr_method_gsl_rk8pd,
    &kr_method_gsl_bsimp,
#endif
};
enum { METHODS = sizeof methods / sizeof *methods };

typedef struct {
    kr_vec3 inertia, lever;
    kr_state start, at_10; /* the second from a Taylor series of order 40 with 45 digits */
} problem;
static const problem thesis = {
    {0x1.facfcdc177bd9p+2, 0x1.facfcdc177bd9p+2, 0x1.179ec9cbd8220p+1},
    {0.0, 0.0, 0x1.47ae147ae147cp+2},
    {0.0, {1.0, 0.0, 0.0, 0.0}, {0.172, -1.862, 1.46}},
    {10.0,
     {0.95778047096818769, 0.20792894694422817, -0.1964128488164547, -0.02905366197961001},
     {2.5647341391753806, -3.1917221901811318, 1.46}}};
static const problem asymmetric = {
    {0x1.4d669d9224628p+0, 0x1.706d8fd9bbb39p+2, 0x1.87ff70b158e5fp+2},
    {-0x1.f77e3fdded5b4p+1, -0x1.44a20db1e5f57p-4, 0x1.fce417e16b363p-5},
    {0.0,
     {0x1.2acb3a9f5a815p-4, 0x1.76a377f2b3869p-1, -0x1.b151475e75147p-5, -0x1.59ebd9ae039eep-1},
     {0.172, -1.862, 1.46}},
    {10.0,
     {0.1611762213863433, 0.26546751270182839, 0.46221260169745422, 0.83060745011804197},
     {-4.0279419090772544, -7.2048687705076523, 1.46}}};

static inline kr_motion open_run(const kr_method *method, const problem *p, double step, double tol)
{
    kr_motion run = {.inertia = p->inertia, .lever = p->lever, .step = step, .tol = tol};
    run.work = calloc(method->work, sizeof(double));
    IS(run.work && method->reset(&run, &p->start) == KR_OK);
    return run;
}
static inline void close_run(const kr_method *method, kr_motion *run)
{
    if (method->done) method->done(run);
    free(run->work);
}
static inline kr_state to(const kr_method *method, kr_motion *run, double until)
{
    kr_state s = {0};
    int left = 200000;
    kr_status status = KR_OK;
    while (status == KR_OK && run->clock != until && left-- > 0) status = method->step(run, until);
    IS(status == KR_OK && run->clock == until);
    method->read(run, &s);
    return s;
}
static inline kr_state solve(const kr_method *method, const problem *p, double tol, double until,
                             kr_stats *stats)
{
    kr_motion run = open_run(method, p, until < 0.0 ? -0.01 : 0.01, tol);
    const kr_state s = to(method, &run, until);
    if (stats) *stats = run.stats;
    close_run(method, &run);
    return s;
}

/* of -a and a the one that came along continuously is meant */
static inline double apart(kr_quat a, kr_quat b)
{
    const kr_quat d = q_mul(q_conj(a), b);
    return 2.0 * atan2(v_length(q_vec(d)), d.w);
}
static inline double off(kr_vec3 a, kr_vec3 b) { return v_length(v_sub(a, b)); }
static inline int same(const kr_state *a, const kr_state *b)
{
    return memcmp(&a->q, &b->q, sizeof a->q) == 0 && memcmp(&a->m, &b->m, sizeof a->m) == 0;
}
#endif
