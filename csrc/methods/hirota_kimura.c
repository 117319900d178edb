/* The discrete Euler top of Hirota and Kimura, which is Kahan's discretization of the free rigid
 * body. The map is explicit, birational and integrable. With the step size h and, in the body
 * frame, the angular velocity W and the momentum M, a step is
 *     M' - M = (h/2) (M x W' + M' x W),    q' = q Cay(h (W + W') / 2)
 * where Cay(v) is the unit quaternion parallel to (1, v/2) (Hirota and Kimura, Journal of the
 * Physical Society of Japan 69, 2000; Kahan 1993). The map conserves two rational integrals, which
 * differ by O(h^2) from functions of the energy and |M|. The angular momentum vector in space is
 * not conserved. The Hirota-Kimura map applies only to torque-free bodies. An analogous map exists
 * for the Lagrange top, but it does not conserve the length of the body-frame vertical P, and P
 * alone does not determine the attitude. */
#include "method.h"

typedef struct {
    kr_quat q;
    kr_vec3 M, W;
} hirota_kimura_state;

static kr_status hirota_kimura_reset(kr_motion *motion, const kr_state *start)
{
    hirota_kimura_state *p = (hirota_kimura_state *)motion->work;
    p->q = start->q;
    p->M = q_turn_back(start->q, start->m);
    p->W = v_over(p->M, motion->inertia);
    return KR_OK;
}
static kr_status hirota_kimura_step(kr_motion *motion, double until)
{
    hirota_kimura_state *p = (hirota_kimura_state *)motion->work;
    const double half = 0.5 * motion->step;
    kr_vec3 columns[3];
    (void)until;
    for (int i = 0; i < 3; i++) {
        const kr_vec3 e = v_axis(i), change = v_over(e, motion->inertia);
        columns[i] = v_axpy(-half, v_add(v_cross(p->M, change), v_cross(e, p->W)), e);
    }
    p->M = v_solve(columns, p->M);
    const kr_vec3 before = p->W;
    p->W = v_over(p->M, motion->inertia);
    p->q = q_unit(q_mul(p->q, q4(1.0, v_scale(0.5 * half, v_add(before, p->W)))));
    motion->stats.evaluations++;
    return KR_OK;
}
static void hirota_kimura_read(const kr_motion *motion, kr_state *s)
{
    const hirota_kimura_state *p = (const hirota_kimura_state *)motion->work;
    s->q = p->q;
    s->m = q_turn(p->q, p->M);
}

const kr_method kr_method_hirota_kimura = {
    KR_METHOD_TEXTS("hirota_kimura",
                    "integrable discretization of free tops; with gravity it would violate |P| = 1",
                    "two rational integrals", "Hirota and Kimura 2000; Kahan 1993"),
    .order = 2,
    .flags = KR_METHOD_REVERSIBLE | KR_METHOD_ALGEBRAIC | KR_METHOD_EULER_ONLY,
    .work = sizeof(hirota_kimura_state) / sizeof(double),
    .reset = hirota_kimura_reset,
    .step = hirota_kimura_step,
    .read = hirota_kimura_read,
};
