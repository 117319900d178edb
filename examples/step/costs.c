/* Prints the time of a step, and the error of a cuboid that tumbles for 10 s at 60 steps a second.
 *
 * The step `implicit` is one that many engines use: one Newton iteration of the implicit Euler
 * method for the velocity in the body (Catto, Numerical Methods, GDC 2015). The rounds of all steps
 * are interleaved; the time is the median of the rounds. */
#define _POSIX_C_SOURCE 199309L
#include <kreisel_step.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { ROUNDS = 15, BODIES = 64, FRAMES = 600 };
typedef struct {
    double moments[3], q[4], m[3];
    float momentsf[3], qf[4], mf[3], w[3]; /* w: the angular velocity in space */
} body;

static void step_double2(body *b) { kr_step(b->moments, b->q, b->m, NULL, 1.0 / 60, 2); }
static void step_double4(body *b) { kr_step(b->moments, b->q, b->m, NULL, 1.0 / 60, 4); }
static void step_float2(body *b) { kr_stepf(b->momentsf, b->qf, b->mf, NULL, 1.0f / 60, 2); }
static void step_velocity(body *b)
{
    kr_step_momentumf(b->momentsf, b->qf, b->w, b->mf);
    kr_stepf(b->momentsf, b->qf, b->mf, NULL, 1.0f / 60, 2);
    kr_step_velocityf(b->momentsf, b->qf, b->mf, b->w);
}
static void cross(const float a[3], const float b[3], float out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}
static float dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
/* Solves A (v' - v) = -h v x J v, with the derivative A of J v + h v x J v, by Cramer's rule. */
static void step_implicit(body *b)
{
    const float h = 1.0f / 60, *J = b->momentsf, *w = b->w;
    const float x = h * (J[2] - J[1]), y = h * (J[0] - J[2]), z = h * (J[1] - J[0]);
    float v[3], yz[3], zx[3], xy[3];
    kr_step_rotatef(b->qf, -1.0f, w, v);
    const float f[3] = {x * v[1] * v[2], y * v[2] * v[0], z * v[0] * v[1]};
    const float A[3][3] = {{J[0], y * v[2], z * v[1]}, /* columns */
                           {x * v[2], J[1], z * v[0]},
                           {x * v[1], y * v[0], J[2]}};
    cross(A[1], A[2], yz), cross(A[2], A[0], zx), cross(A[0], A[1], xy);
    const float scale = 1.0f / dot(A[0], yz);
    v[0] -= scale * dot(f, yz), v[1] -= scale * dot(f, zx), v[2] -= scale * dot(f, xy);
    kr_step_rotatef(b->qf, 1.0f, v, b->w);
    const float half[4] = {0, 0.5f * h * w[0], 0.5f * h * w[1], 0.5f * h * w[2]};
    float change[4] = {0}, square = 0;
    kr_step_add_productf(half, b->qf, change);
    for (int i = 0; i < 4; i++) b->qf[i] += change[i], square += b->qf[i] * b->qf[i];
    for (int i = 0; i < 4; i++) b->qf[i] /= sqrtf(square);
}

static const struct {
    const char *name;
    void (*step)(body *);
    int is_double;
} steps[] = {{"implicit, float", step_implicit, 0},
             {"order 2, float", step_float2, 0},
             {"order 2, float, with velocities", step_velocity, 0},
             {"order 2, double", step_double2, 1},
             {"order 4, double", step_double4, 1}};
enum { STEPS = sizeof steps / sizeof steps[0] };

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
int main(void)
{
    static double times[STEPS][ROUNDS];
    const double truth[] = {-0.0710009187614268, 0.42939487137885635, 0.866475553493763,
                            0.24453840018746675}; /* the closed form */
    double errors[STEPS] = {0};
    body start = {
        {0.1 / 3, 0.26 / 3, 0.34 / 3}, {1, 0, 0, 0}, {0}, {0}, {1, 0, 0, 0}, {0}, {3, 1, 2}};
    for (int i = 0; i < 3; i++) start.momentsf[i] = (float)start.moments[i];
    kr_step_momentum(start.moments, start.q, (const double[]){3, 1, 2}, start.m);
    kr_step_momentumf(start.momentsf, start.qf, start.w, start.mf);
    for (int i = 0; i < ROUNDS * STEPS; i++) {
        const int k = i % STEPS;
        static body bodies[BODIES];
        struct timespec from, to;
        for (int j = 0; j < BODIES; j++) bodies[j] = start;
        clock_gettime(CLOCK_MONOTONIC, &from);
        for (int frame = 0; frame < FRAMES; frame++)
            for (int j = 0; j < BODIES; j++) steps[k].step(&bodies[j]);
        clock_gettime(CLOCK_MONOTONIC, &to);
        const double passed =
            1e9 * (double)(to.tv_sec - from.tv_sec) + (double)(to.tv_nsec - from.tv_nsec);
        times[k][i / STEPS] = passed / (FRAMES * BODIES);
        errors[k] = 0.0;
        for (int j = 0; j < 4; j++) {
            const double q = steps[k].is_double ? bodies[0].q[j] : (double)bodies[0].qf[j];
            errors[k] += (q - truth[j]) * (q - truth[j]);
        }
    }
    for (int k = 0; k < STEPS; k++) {
        qsort(times[k], ROUNDS, sizeof(double), compare);
        printf("%-32s %6.1f ns  %.1e rad\n", steps[k].name, times[k][ROUNDS / 2],
               2.0 * sqrt(errors[k]));
    }
    return 0;
}
