/* Adaptive methods without the driver: extrap, and the methods of GSL if it is built in. Tests of
 * accuracy, landing, first steps, tolerances and failures. */
#include <float.h>
#include <stdlib.h>
#include "method.h"
#include "tops.h"
#ifdef KREISEL_GSL
#  include "gsl/gsl.h"
#endif
#ifdef __GLIBC__
#  include <malloc.h>
#endif

#define X(id) extern const kr_method kr_method_##id;
#include "methods.def"
#undef X
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
    kr_state start, at_10; /* at_10: by a Taylor series of order 40 with 45 digits */
} problem;
static problem thesis, general; /* set by main */
static problem problem_of(kr_body body, kr_state start, kr_quat q_at_10, kr_vec3 m_at_10)
{
    const problem p = {body.inertia, body.com, start, {10.0, q_at_10, m_at_10}};
    return p;
}
static void set_problems(void)
{
    const kr_quat thesis_q = {0.95778047096818769, 0.20792894694422817, -0.1964128488164547,
                              -0.02905366197961001},
                  general_q = {0.1611762213863433, 0.26546751270182839, 0.46221260169745422,
                               0.83060745011804197};
    const kr_vec3 thesis_m = {2.5647341391753806, -3.1917221901811318, 1.46},
                  general_m = {-4.0279419090772544, -7.2048687705076523, 1.46};
    const kr_scene s = asymmetric();
    thesis = problem_of(thesis_body(), s.start, thesis_q, thesis_m);
    thesis.start.q = q_one();
    general = problem_of(s.body, s.start, general_q, general_m);
}

static const kr_scene at_rest; /* no support turns */
static kr_motion open_motion(const kr_method *method, const problem *p, double step, double tol)
{
    kr_motion motion = {
        .inertia = p->inertia, .lever = p->lever, .step = step, .tol = tol, .scene = &at_rest};
    motion.work = calloc(method->work, sizeof(double));
    IS(motion.work && method->reset(&motion, &p->start) == KR_OK);
    return motion;
}
static void close_motion(const kr_method *method, kr_motion *motion)
{
    if (method->release) method->release(motion);
    free(motion->work);
}
static kr_state to(const kr_method *method, kr_motion *motion, double until)
{
    kr_state s = {0};
    int left = 200000;
    kr_status status = KR_OK;
    while (status == KR_OK && motion->clock != until && left-- > 0)
        status = method->step(motion, until);
    IS(status == KR_OK && motion->clock == until);
    method->read(motion, &s);
    return s;
}
static kr_state solve(const kr_method *method, const problem *p, double tol, double until,
                      kr_stats *stats)
{
    kr_motion motion = open_motion(method, p, until < 0.0 ? -0.01 : 0.01, tol);
    const kr_state s = to(method, &motion, until);
    if (stats) *stats = motion.stats;
    close_motion(method, &motion);
    return s;
}

/* Returns the angle between two attitudes, from 0 to 2 pi. The quaternions q and -q differ by 2 pi,
 * because the sign follows from the continuous path. */
static double apart(kr_quat a, kr_quat b)
{
    const kr_quat d = q_mul(q_conj(a), b);
    return 2.0 * atan2(v_length(q_vec(d)), d.w);
}

/* With this tolerance, the top turns by more than half a turn in a step. The sign of q must still
 * be that of the continuous path. */
static void test_long_steps(const kr_method *method)
{
    problem p = thesis;
    double longest = 0.0;
    p.inertia = v3(1.0, 1.0, 1.0);
    p.lever = v3(0.0, 0.0, 0.0);
    p.start.m = v3(0.0, 0.0, 1.0);
    kr_motion motion = open_motion(method, &p, 0.0, 1e-2);
    for (int left = 200; motion.clock < 50.0 && left > 0; left--) {
        const double before = motion.clock;
        kr_state s;
        IS(method->step(&motion, INFINITY) == KR_OK);
        method->read(&motion, &s);
        NEAR(apart(s.q, q_exp(v3(0.0, 0.0, motion.clock))), 0.0, 1.0);
        longest = fmax(longest, motion.clock - before);
    }
    IS(motion.clock >= 50.0 && longest > 3.2);
    close_motion(method, &motion);
}

/* The errors of all methods lie between tol / 20 and 500 * tol in these cases. */
static void test_error_follows_tolerance(const kr_method *method, const problem *p)
{
    double at_six = 0.0, at_nine = 0.0, at_twelve = 0.0;
    for (int digits = 6; digits <= 13; digits++) {
        const double tol = pow(10.0, -digits);
        kr_stats stats;
        const kr_state s = solve(method, p, tol, 10.0, &stats);
        const double error = apart(s.q, p->at_10.q);
        NEAR(error, 0.0, 500.0 * tol);
        IS(error > 0.05 * tol);
        NEAR(off(s.m, p->at_10.m), 0.0, 5000.0 * tol);
        NEAR(s.m.z, p->start.m.z, 1000.0 * tol);
        NEAR((double)stats.evaluations, digits * 200.0, digits * 190.0);
        if (digits == 6) at_six = error;
        if (digits == 9) at_nine = error;
        if (digits == 12) at_twelve = error;
    }
    IS(at_nine < at_six / 20.0);
    IS(at_twelve < at_nine / 20.0);
}

#ifdef KREISEL_GSL
static void test_jacobian(void)
{
    static const double y[GSL_SIZE] = {0.31, -0.72, 0.45, 0.58, 0.9, -1.7, 2.3};
    const double h = 1e-5;
    const kr_scene scene = {.turning = {0.5, -0.3, 0.2}};
    kr_motion motion = {
        .inertia = {1.3, 2.9, 3.7}, .lever = {0.4, -1.1, 2.2}, .scene = &scene, .time_unit = 1.0};
    double jacobian[GSL_SIZE * GSL_SIZE], rate_t[GSL_SIZE], plus[GSL_SIZE], minus[GSL_SIZE],
        at[GSL_SIZE];
    IS(kr_gsl_jacobian(0.0, y, jacobian, rate_t, &motion) == 0);
    for (int j = 0; j < GSL_SIZE; j++) {
        memcpy(at, y, sizeof at);
        at[j] = y[j] + h;
        kr_gsl_rates(0.0, at, plus, &motion);
        at[j] = y[j] - h;
        kr_gsl_rates(0.0, at, minus, &motion);
        for (int i = 0; i < GSL_SIZE; i++)
            NEAR(jacobian[GSL_SIZE * i + j], (plus[i] - minus[i]) / (2.0 * h), 1e-10);
        IS(rate_t[j] == 0.0);
    }
}
/* The lever is so large that the 1 in 1 - h J is lost to rounding. M_PERTURB sets the content of
 * memory before its first use. */
static void test_independence_of_memory(void)
{
    const problem p = {
        .inertia = {0.1551879969177678, 0.38848897148880102, 0.5428925953724012},
        .lever = {2.2513378408360591e45, 3.2933465906061637e44, -1.8924426287983347e45},
        .start = {0.0, {-0.5, 0.5, -0.5, 0.5}, {1e-120, -1e-120, 3e-120}}};
    double rejected[2] = {0.0}, clock[2] = {0.0};
    for (int i = 0; i < 2; i++) {
#  ifdef __GLIBC__
        mallopt(M_PERTURB, i ? 0x80 : 0xff);
#  endif
        kr_motion motion = open_motion(&kr_method_gsl_bsimp, &p, -0.1, 1e-10);
        kr_method_gsl_bsimp.step(&motion, -0.1);
        rejected[i] = (double)motion.stats.rejected;
        clock[i] = motion.clock;
        close_motion(&kr_method_gsl_bsimp, &motion);
    }
#  ifdef __GLIBC__
    mallopt(M_PERTURB, 0);
#  endif
    IS(rejected[0] == rejected[1] && clock[0] == clock[1]);
}
#endif

/* A step that is shortened in order to land at a time does not shorten the next step. */
static void test_landing_keeps_the_error(const kr_method *method)
{
    kr_motion motion = open_motion(method, &thesis, 0.0, 1e-8);
    double natural;
    for (int i = 0; i < 20; i++) IS(method->step(&motion, INFINITY) == KR_OK);
    natural = motion.clock;
    IS(method->step(&motion, INFINITY) == KR_OK);
    natural = motion.clock - natural;
    to(method, &motion, motion.clock + 1e-6);
    const double landed = motion.clock;
    IS(method->step(&motion, INFINITY) == KR_OK);
    IS(motion.clock - landed > 0.2 * natural && motion.clock - landed < 5.0 * natural);
    close_motion(method, &motion);
}
/* Checks that the reset or the first step fails with the status `want` after a limited number of
 * evaluations. The failure leaves q, m and the internal time unchanged. */
static void check_first_step_fails(const kr_method *method, const problem *p, double tol,
                                   kr_status want)
{
    kr_motion motion = {
        .inertia = p->inertia, .lever = p->lever, .step = 0.01, .tol = tol, .scene = &at_rest};
    kr_state before = {0}, after = {0};
    motion.work = calloc(method->work, sizeof(double));
    kr_status status = method->reset(&motion, &p->start);
    if (status == KR_OK) {
        method->read(&motion, &before);
        status = method->step(&motion, INFINITY);
        method->read(&motion, &after);
        IS(same(before, after));
    }
    IS(status == want);
    IS(motion.clock == 0.0);
    IS(motion.stats.evaluations < 100000);
    close_motion(method, &motion);
}
static void test_failures(const kr_method *method)
{
    problem p = thesis;
    p.start.m.y = NAN;
    check_first_step_fails(method, &p, 1e-10, KR_ERR_NOT_FINITE);
    p = thesis;
    p.start.q.x = INFINITY;
    check_first_step_fails(method, &p, 1e-10, KR_ERR_NOT_FINITE);
    p = thesis;
    p.lever.z = NAN;
    check_first_step_fails(method, &p, 1e-10, KR_ERR_NOT_FINITE);
    check_first_step_fails(method, &thesis, 1e-20, KR_ERR_STEP);
    check_first_step_fails(method, &thesis, 1e-300, KR_ERR_STEP);
}
/* If the time is so late that doubles do not resolve a step of the necessary length, the step
 * fails. */
static void test_step_below_resolution(const kr_method *method)
{
    kr_motion motion = open_motion(method, &thesis, 0.01, 1e-10);
    motion.clock = 0x1p60;
    IS(method->step(&motion, INFINITY) == KR_ERR_STEP);
    IS(motion.clock == 0x1p60);
    close_motion(method, &motion);
}
/* With tolerances near the rounding error a run succeeds or fails, but never takes excessive
 * work. */
static void test_limit_of_tol(const kr_method *method, const problem *p)
{
    for (double tol = 8.0 * DBL_EPSILON; tol >= DBL_EPSILON; tol *= 0.5) {
        kr_motion motion = open_motion(method, p, 0.0, tol);
        kr_status status = KR_OK;
        while (status == KR_OK && motion.clock != 1.0 && motion.stats.evaluations < 10000)
            status = method->step(&motion, 1.0);
        IS(status == KR_ERR_STEP || motion.clock == 1.0);
        close_motion(method, &motion);
    }
}
/* A first step that is far too long is shortened, and one that is far too short grows. */
static void test_first_steps(const kr_method *method)
{
    static const double steps[] = {1e-12, 1e3, 1e9};
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        kr_motion motion = open_motion(method, &thesis, steps[i], 1e-10);
        const kr_state s = to(method, &motion, 10.0);
        NEAR(apart(s.q, thesis.at_10.q), 0.0, 1e-7);
        IS(motion.stats.evaluations < 6000);
        close_motion(method, &motion);
    }
}
/* At rest the error is zero and the step grows, without gravity up to the limits of time. */
static void test_top_at_rest(const kr_method *method, double lever, double least)
{
    problem p = thesis;
    p.start.m = v3(0.0, 0.0, 0.0);
    p.lever = v_scale(lever, p.lever);
    kr_motion motion = open_motion(method, &p, 0.0, 1e-10);
    kr_state s = {0};
    kr_status status = KR_OK;
    for (int i = 0; i < 500 && status == KR_OK; i++) status = method->step(&motion, INFINITY);
    method->read(&motion, &s);
    IS(status == KR_OK || status == KR_ERR_STEP);
    IS(motion.clock > least && isfinite(motion.clock));
    IS(s.q.w == 1.0 && v_length(s.m) == 0.0);
    close_motion(method, &motion);
}

int main(void)
{
    set_problems();
    for (size_t i = 0; i < METHODS; i++) {
        const kr_method *method = methods[i];
        IS(method->flags & KR_METHOD_ADAPTIVE && method->flags & KR_METHOD_ABSOLUTE);
        test_long_steps(method);
        test_error_follows_tolerance(method, &thesis);
        test_error_follows_tolerance(method, &general);
        test_landing_keeps_the_error(method);
        test_failures(method);
        test_step_below_resolution(method);
        test_limit_of_tol(method, &general);
        test_first_steps(method);
        test_top_at_rest(method, 0.0, 1e15);
        test_top_at_rest(method, 1.0, 100.0);
    }
#ifdef KREISEL_GSL
    test_independence_of_memory();
    test_jacobian();
#endif
    return check_result();
}
