/* Closed forms of degenerate motions: turning points that coincide, and axes that rest at a pole or
 * reach it. */
#include <float.h>
#include "model/scene.h"
#include "tops.h"

static const kr_quat level = {0.5, 0.5, 0.5, 0.5}; /* the axis along e1, without rounding errors */
/* Tops with exactly the energy of the separatrix, from the lowest point and from half the height,
 * rising and falling. They follow tan(nutation / 4) = exp(-rate |t|), with t counted from the
 * lowest point. */
static void test_separatrix(void)
{
    const kr_scene tops[] = {
        lagrange_top(1.0, 0.5, 1.0, q4(0.0, v3(1.0, 0.0, 0.0)), v3(2.0, 0.0, 0.0)),
        lagrange_top(1.0, 0.5, 2.0, level, v3(0.0, -2.0, 0.0)),
        lagrange_top(1.0, 0.5, 2.0, level, v3(0.0, 2.0, 0.0))};
    for (int i = 0; i < 3; i++) {
        const kr_nutation r = limits_of_nutation(&tops[i]);
        const double rate = i == 0 ? 1.0 : sqrt(2.0), aside = log(1.0 + sqrt(2.0)) / rate,
                     lowest = i == 0   ? 0.0
                              : i == 1 ? -aside
                                       : aside;
        IS(strcmp(r.motion_type, "separatrix") == 0 && r.t_least == INFINITY);
        if (i == 1) IS(r.t_greatest == INFINITY);
        if (i != 1) NEAR(r.t_greatest, lowest, 1e-9);
        const kr_exact *exact = closed_form(&tops[i]);
        for (double t = 0.0; t < 6.0; t += 0.5) {
            const kr_state there = kr_exact_state(exact, t);
            const double angle = kr_state_nutation(&tops[i], &there),
                         want = 4.0 * atan(exp(-rate * fabs(t - lowest)));
            NEAR(angle, want, 1e-9);
        }
    }
}
/* Axes that start at a pole, or so near it that the motion counts as hanging, sleeping or a
 * rosette. */
static void test_courses_at_poles(void)
{
    const kr_quat low = q4(1e-13, v3(1.0, 0.0, 0.0));
    const kr_scene hanging = lagrange_top(1.0, 0.5, 1.0, low, v3(0.0, 0.0, 0.0)),
                   through =
                       lagrange_top(1.0, 0.5, 1.0, q4(0.0, v3(1.0, 0.0, 0.0)), v3(0.5, -0.25, 1.0)),
                   over = lagrange_top(1.0, 0.5, 1.0, q_one(), v3(0.5, -0.25, 1.0)),
                   sleeping =
                       lagrange_top(1.0, 0.5, 1.0, q4(1.0, v3(1e-13, 0.0, 0.0)), v3(0.0, 0.0, 5.0));
    IS(strcmp(limits_of_nutation(&sleeping).motion_type, "sleeping") == 0);
    IS(strcmp(limits_of_nutation(&hanging).motion_type, "hanging") == 0);
    IS(strcmp(limits_of_nutation(&through).motion_type, "rosette") == 0);
    IS(strcmp(limits_of_nutation(&over).motion_type, "rosette") == 0);
}
/* A Lagrange top is also recognized if the tensor is not diagonal, even with the centre of mass at
 * the fixed point. */
static void test_tensor_in_any_order(void)
{
    for (int k = 0; k < 3; k++)
        for (int reach = 0; reach < 2; reach++) {
            const kr_quat turn = q_exp(v3(0.1, -0.2, 0.15));
            const kr_vec3 a = q_turn(turn, v3(k == 0, k == 1, k == 2));
            const double e[3] = {a.x, a.y, a.z};
            double j[9];
            kr_body b = {0};
            for (int i = 0; i < 9; i++) j[i] = (i % 4 == 0) - 0.5 * e[i / 3] * e[i % 3];
            IS(kr_body_from_tensor(1.0, j, v_scale(reach, a), 0.0, &b) == KR_OK);
            const kr_working w = kr_body_working(&b);
            NEAR(w.inertia.x, 1.0, 1e-15);
            IS(w.inertia.x == w.inertia.y && w.com.x == 0.0 && w.com.y == 0.0);
            NEAR(w.inertia.z, 0.5, 1e-15);
            NEAR(fabs(w.com.z), reach, 1e-15);
            const kr_vec3 axis = q_turn(q_mul(b.axes, w.axes), v3(0.0, 0.0, 1.0));
            NEAR(fabs(v_dot(axis, a)), 1.0, 1e-15);
        }
}
/* If the odd moment is near the two equal ones, it determines its axis only roughly, so the centre
 * of mass may lie slightly beside this axis. */
static void test_axis_beside_the_centre(void)
{
    const kr_quat turn = q_exp(v3(0.1, -0.2, 0.15));
    const kr_vec3 a = q_turn(turn, v3(0.0, 0.0, 1.0)), beside = q_turn(turn, v3(1.0, 0.0, 0.0));
    const double e[3] = {a.x, a.y, a.z};
    for (int i = 0; i < 2; i++) {
        double j[9];
        kr_body b = {0};
        for (int k = 0; k < 9; k++) j[k] = (k % 4 == 0) + (i ? 1e-6 : -1e-6) * e[k / 3] * e[k % 3];
        IS(kr_body_from_tensor(1.0, j, v_axpy(5e-9, beside, a), 0.0, &b) == KR_OK);
        IS(kr_body_kind(&b, KR_KIND_RTOL) == KR_KIND_LAGRANGE);
        IS(kr_body_from_tensor(1.0, j, v_axpy(2e-8, beside, a), 0.0, &b) == KR_OK);
        IS(kr_body_kind(&b, KR_KIND_RTOL) != KR_KIND_LAGRANGE);
    }
}
/* Three moments that differ only by rounding errors are replaced by their mean, because the axes
 * are rotated. */
static void test_sphere_up_to_rounding(void)
{
    const double ulp = DBL_EPSILON;
    kr_body b = kr_scene_default().body;
    b.inertia = v3(1.0, 1.0 + 3.0 * ulp, 1.0 + 6.0 * ulp);
    const kr_working w = kr_body_working(&b);
    IS(w.inertia.x == 1.0 + 3.0 * ulp && w.inertia.y == w.inertia.x && w.inertia.z == w.inertia.x);
}
int main(void)
{
    test_courses_at_poles();
    test_tensor_in_any_order();
    test_axis_beside_the_centre();
    test_sphere_up_to_rounding();
    test_separatrix();
    return check_result();
}
