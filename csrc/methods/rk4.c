/* The classical Runge-Kutta method for the twelve equations of motion in the inertial frame (Bodack
 * 2008, 3.9; space_frame.h), for comparison. The method does not conserve the integrals of motion,
 * and the body axes are orthonormal only up to the error of the method. */
#include "space_frame.h"

typedef struct {
    double y[SPACE_FRAME];
    kr_quat q;
} rk4_state;

static kr_status rk4_reset(kr_motion *motion, const kr_state *start)
{
    rk4_state *p = (rk4_state *)motion->work;
    space_frame_begin(motion, start, p->y);
    p->q = start->q;
    return KR_OK;
}
static void add_scaled(const double y[SPACE_FRAME], double h, const double k[SPACE_FRAME],
                       double out[SPACE_FRAME])
{
    for (int i = 0; i < SPACE_FRAME; i++) out[i] = y[i] + h * k[i];
}
static kr_status rk4_step(kr_motion *motion, double until)
{
    rk4_state *p = (rk4_state *)motion->work;
    const double h = motion->step;
    double k1[SPACE_FRAME], k2[SPACE_FRAME], k3[SPACE_FRAME], k4[SPACE_FRAME], y[SPACE_FRAME];
    (void)until;
    space_frame_rates(motion, p->y, k1);
    add_scaled(p->y, 0.5 * h, k1, y);
    space_frame_rates(motion, y, k2);
    add_scaled(p->y, 0.5 * h, k2, y);
    space_frame_rates(motion, y, k3);
    add_scaled(p->y, h, k3, y);
    space_frame_rates(motion, y, k4);
    for (int i = 0; i < SPACE_FRAME; i++)
        p->y[i] += h * ((k1[i] + 2.0 * (k2[i] + k3[i])) + k4[i]) / 6.0;
    p->q = space_frame_attitude(p->y, p->q);
    return KR_OK;
}
static void rk4_read(const kr_motion *motion, kr_state *s)
{
    const rk4_state *p = (const rk4_state *)motion->work;
    s->q = p->q;
    s->m = space_frame_momentum(motion, p->y);
}

const kr_method kr_method_rk4 = {
    KR_METHOD_TEXTS("rk4", "classical Runge-Kutta method for the twelve space-frame equations",
                    "nothing", "Kutta 1901; thesis 3.9"),
    .order = 4,
    .flags = KR_METHOD_ALGEBRAIC | KR_METHOD_ROTORS | KR_METHOD_TURNING | KR_METHOD_GRADIENT,
    .work = sizeof(rk4_state) / sizeof(double),
    .reset = rk4_reset,
    .step = rk4_step,
    .read = rk4_read,
};
