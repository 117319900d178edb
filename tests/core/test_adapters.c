/* The adaptive methods by themselves, without the driver: extrap, and GSL's where it is there. How
 * right they are. */
#include "adapters.h"
#ifdef KREISEL_GSL
#  include "gsl/gsl.h"
#endif

static double energy(const problem *p, const kr_state *s)
{
    const kr_vec3 M = q_turn_back(s->q, s->m), I = p->inertia;
    return 0.5 * (M.x * M.x / I.x + M.y * M.y / I.y + M.z * M.z / I.z) + q_turn(s->q, p->lever).z;
}

/* A free symmetric top: m stays, q = exp(t m / I1) q0 exp(t <m, a> (1/I3 - 1/I1) e3). */
static void free_top(const kr_method *method)
{
    problem p = thesis;
    p.lever = v3(0.0, 0.0, 0.0);
    p.start.q = q_exp(v3(0.3, -0.7, 0.4));
    for (double t = -10.0; t <= 10.0; t += 20.0) {
        const kr_state s = solve(method, &p, 1e-12, t, NULL);
        const double spin =
            t * v_dot(p.start.m, q_axis(p.start.q)) * (1.0 / p.inertia.z - 1.0 / p.inertia.x);
        const kr_quat turn = q_exp(v_scale(t / p.inertia.x, p.start.m));
        NEAR(apart(s.q, q_mul(q_mul(turn, p.start.q), q_exp(v3(0.0, 0.0, spin)))), 0.0, 1e-10);
        NEAR(off(s.m, p.start.m), 0.0, 1e-10);
    }
}
/* Steady precession: turn = rate e3 + spin a with rate (I3 (spin + rate cos) - I1 rate cos) =
 * lever. */
static problem precession(double rate, double tilt, double *spin)
{
    problem p = thesis;
    const double c = cos(tilt), along = (p.lever.z / rate + p.inertia.x * rate * c) / p.inertia.z;
    *spin = along - rate * c;
    p.start.q = q_exp(v3(tilt, 0.0, 0.0));
    p.start.m = q_turn(p.start.q, v3(0.0, p.inertia.y * rate * sin(tilt), p.inertia.z * along));
    return p;
}
static void steady_precession(const kr_method *method)
{
    double spin;
    const problem p = precession(0.5, 0.8, &spin);
    for (double t = -8.0; t <= 8.0; t += 16.0) {
        const kr_state s = solve(method, &p, 1e-12, t, NULL);
        const kr_quat turn = q_exp(v3(0.0, 0.0, 0.5 * t));
        NEAR(apart(s.q, q_mul(q_mul(turn, p.start.q), q_exp(v3(0.0, 0.0, spin * t)))), 0.0, 1e-9);
        NEAR(off(s.m, q_turn(turn, p.start.m)), 0.0, 1e-9);
    }
}
/* At this tol steps pass half a turn; the sign of q must still be that of the continuous path. */
static void long_steps(const kr_method *method)
{
    problem p = thesis;
    double longest = 0.0;
    p.inertia = v3(1.0, 1.0, 1.0);
    p.lever = v3(0.0, 0.0, 0.0);
    p.start.m = v3(0.0, 0.0, 1.0);
    kr_motion run = open_run(method, &p, 0.0, 1e-2);
    for (int left = 200; run.clock < 50.0 && left > 0; left--) {
        const double before = run.clock;
        kr_state s;
        IS(method->step(&run, INFINITY) == KR_OK);
        method->read(&run, &s);
        NEAR(apart(s.q, q_exp(v3(0.0, 0.0, run.clock))), 0.0, 1.0);
        longest = fmax(longest, run.clock - before);
    }
    IS(run.clock >= 50.0 && longest > 3.2);
    close_run(method, &run);
}

/* 0.05 and 500: what the methods make of a tolerance here, between tol / 20 and 500 tol. */
static void errors_follow_tol(const kr_method *method, const problem *p)
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
        NEAR(energy(p, &s), energy(p, &p->start), 1000.0 * tol);
        NEAR(s.m.z, p->start.m.z, 1000.0 * tol);
        NEAR((double)stats.evaluations, digits * 200.0, digits * 190.0);
        if (digits == 6) at_six = error;
        if (digits == 9) at_nine = error;
        if (digits == 12) at_twelve = error;
    }
    IS(at_nine < at_six / 20.0);
    IS(at_twelve < at_nine / 20.0);
}
static void there_and_back(const kr_method *method, const problem *p)
{
    problem back = *p;
    back.start = solve(method, p, 1e-12, 10.0, NULL);
    const kr_state s = solve(method, &back, 1e-12, -10.0, NULL);
    NEAR(apart(s.q, p->start.q), 0.0, 1e-9);
    NEAR(off(s.m, p->start.m), 0.0, 1e-9);
}

#ifdef KREISEL_GSL
static void jacobian_is_the_derivative(void)
{
    static const double y[GSL_SIZE] = {0.31, -0.72, 0.45, 0.58, 0.9, -1.7, 2.3};
    const double h = 1e-5;
    kr_motion run = {.inertia = {1.3, 2.9, 3.7}, .lever = {0.4, -1.1, 2.2}};
    double jacobian[GSL_SIZE * GSL_SIZE], rate_t[GSL_SIZE], plus[GSL_SIZE], minus[GSL_SIZE],
        at[GSL_SIZE];
    IS(kr_gsl_jacobian(0.0, y, jacobian, rate_t, &run) == 0);
    for (int j = 0; j < GSL_SIZE; j++) {
        memcpy(at, y, sizeof at);
        at[j] = y[j] + h;
        kr_gsl_rates(0.0, at, plus, &run);
        at[j] = y[j] - h;
        kr_gsl_rates(0.0, at, minus, &run);
        for (int i = 0; i < GSL_SIZE; i++)
            NEAR(jacobian[GSL_SIZE * i + j], (plus[i] - minus[i]) / (2.0 * h), 1e-10);
        IS(rate_t[j] == 0.0);
    }
}
static void libraries_agree(void)
{
    const kr_state ours = solve(&kr_method_extrap, &asymmetric, 1e-13, 10.0, NULL);
    const kr_state gsl = solve(&kr_method_gsl_rk8pd, &asymmetric, 1e-13, 10.0, NULL);
    NEAR(apart(ours.q, gsl.q), 0.0, 1e-10);
    NEAR(off(ours.m, gsl.m), 0.0, 1e-10);
}
#endif

int main(void)
{
    for (size_t i = 0; i < METHODS; i++) {
        const kr_method *method = methods[i];
        IS(method->flags & KR_ADAPTIVE && method->flags & KR_ABSOLUTE);
        free_top(method);
        steady_precession(method);
        long_steps(method);
        errors_follow_tol(method, &thesis);
        errors_follow_tol(method, &asymmetric);
        there_and_back(method, &asymmetric);
    }
#ifdef KREISEL_GSL
    jacobian_is_the_derivative();
    libraries_agree();
#endif
    return check_result();
}
