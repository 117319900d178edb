/* Bodies with rotors: kinds, refusals, and bodies at rest. The Python tests compare paths with other
 * integrators. */
#include <float.h>
#include "kreisel.h"
#include "model/body.h"
#include "tops.h"

static kr_scene with_rotor(const kr_scene *s, kr_vec3 rotor)
{
    kr_scene other = *s;
    kr_body_set_rotor(&other.body, rotor);
    return other;
}
static int is_axis_kept(kr_vec3 moments, kr_vec3 com, kr_vec3 rotor)
{
    const kr_body b = {1.0, moments, com, {1, 0, 0, 0}, 0, .rotor = rotor};
    return kr_body_is_rotor_axial(&b, KR_KIND_RTOL);
}
/* A rotor is axial if the body is symmetric about its direction. */
static void test_kinds(void)
{
    const kr_vec3 none = {0, 0, 0}, com = {0.3, 0.0, 0.4};
    IS(is_axis_kept(v3(3, 2, 2), v3(1, 0, 0), v3(-5, 0, 0)));
    IS(is_axis_kept(v3(2, 3, 2), none, v3(0, 1e-300, 0)));
    IS(!is_axis_kept(v3(2, 2, 3), none, v3(0, 1e-9, 1)) && is_axis_kept(v3(1, 2, 3), com, none));
    IS(!is_axis_kept(v3(1.5, 2, 3), none, v3(0, 0, 1)));
    IS(is_axis_kept(v3(2, 2, 2), com, v3(-0.6, 0, -0.8)) && is_axis_kept(v3(2, 2, 2), none, com));
    IS(!is_axis_kept(v3(2, 2, 2), com, v3(0.8, 0, -0.6)));
    kr_body top = {1.0, {2, 2, 1}, {1, 0, 0}, {1, 0, 0, 0}, 0, .rotor = {0, 0, 0}};
    IS(kr_body_kind(&top, KR_KIND_RTOL) == KR_KIND_KOWALEWSKI);
    top.rotor.z = 0.1;
    IS(kr_body_kind(&top, KR_KIND_RTOL) == KR_KIND_GENERAL);
}
/* Each method takes a rotor, or returns KR_ERR_ROTOR. */
static void test_refusals(void)
{
    const kr_scene s = tilted(), along = with_rotor(&s, v3(0, 0, 0.5)),
                   off = with_rotor(&s, v3(0.1, 0, 0.5));
    const kr_exact *plan;
    for (size_t i = 0; kr_method_at(i); i++) {
        const kr_method *method = kr_method_at(i);
        const int takes = (kr_method_describe(method).flags & KR_METHOD_ROTORS) != 0,
                  is_exact = method == &kr_method_exact || method == &kr_method_blanes_moan6;
        const kr_config config = {.step = 0.01};
        if (!kr_method_suits(method, &s)) continue;
        kr_top *top = NULL;
        IS(kr_top_create(&along, method, config, &top) == (takes ? KR_OK : KR_ERR_ROTOR));
        IS(kr_method_suits(method, &along) == takes);
        kr_top_free(top);
        top = NULL;
        IS(kr_top_create(&off, method, config, &top) ==
           (takes && !is_exact ? KR_OK : KR_ERR_ROTOR));
        IS(kr_method_suits(method, &off) == (takes && !is_exact));
        kr_top_free(top);
    }
    IS(plan_closed_form(&off, &plan) == KR_ERR_METHOD && plan_closed_form(&along, &plan) == KR_OK);
    IS(isnan(kr_state_modified_energy(&along, &s.start, 0.01, 1)));
}
/* A body whose momentum is that of its rotor alone does not turn if no torque acts. */
static void test_rest(void)
{
    kr_scene s = {.body = general_body(), .gravity = 0.0, .start.q = q_exp(v3(0.6, -0.4, 0.3))};
    const kr_vec3 rotor = {0.5, -2.0, 1.0};
    s = with_rotor(&s, rotor);
    s.start.m = q_turn(s.start.q, rotor);
    const kr_method *const methods[] = {&kr_method_taylor, &kr_method_suzuki4, &kr_method_extrap,
                                        &kr_method_implicit_midpoint, &kr_method_rk4};
    for (int i = 0; i < 5; i++) {
        kr_top *top = make(&s, methods[i], (kr_config){.step = 0.01});
        IS(kr_top_advance(top, 1.0) == KR_OK);
        const kr_state end = kr_top_state(top);
        NEAR(kr_attitude_error(end.q, s.start.q), 0.0, i == 1 ? 1e-7 : 1e-13);
        IS(v_largest(v_sub(end.m, s.start.m)) <= 1e-13 && kr_state_kinetic(&s, &end) < 1e-14);
        kr_top_free(top);
    }
}
/* The closed form of a free body that only its rotor turns has attitudes of unit length, and its
 * turning points lie within a half circle, however small its momentum is. */
static void test_closed_form_of_a_tiny_momentum(void)
{
    kr_scene s = {
        .body = {.mass = 1.0, .inertia = {2, 2, 0.5}, .axes = {1, 0, 0, 0}, .rotor = {0, 0, 1.5}},
        .start.q = q_unit(q4(0.7, v3(-0.1, -0.6, 0.2)))};
    for (int power = 0; power <= 1060; power += 20) {
        s.start.m = v_scale(ldexp(1.0, -power), v3(-0.3, 0.8, -0.6));
        const kr_exact *plan = closed_form(&s);
        const kr_state end = kr_exact_state(plan, 3.0),
                       truth = state_at(3.0, &s, &kr_method_taylor, (kr_config){0});
        const kr_nutation turning = limits_of_nutation(&s);
        IS(turning.least <= turning.greatest);
        IS(turning.least > 0.0 && turning.greatest < 3.1416);
        NEAR(q_dot(end.q, end.q), 1.0, 1e-14);
        NEAR(kr_attitude_error(end.q, truth.q), 0.0, 1e-13);
    }
}
/* A free body whose moments differ by a few rounding errors rotates like a sphere. */
static void test_nearly_a_sphere(void)
{
    static const char *const names[] = {"strang", "suzuki4", "kahan_li6"};
    const kr_vec3 m = {0.5, -1.0, 2.0};
    const kr_scene s = {.body = {.mass = 1.0,
                                 .inertia = {1.0, 1.0 + 6.0 * DBL_EPSILON, 1.0 + 6.0 * DBL_EPSILON},
                                 .axes = {1, 0, 0, 0}},
                        .start = {0.0, {1, 0, 0, 0}, m}};
    for (int i = 0; i < 3; i++) {
        const kr_state end =
            state_at(2.0, &s, kr_method_find(names[i]), (kr_config){.step = 0.125});
        NEAR(kr_attitude_error(end.q, q_exp(v_scale(2.0, m))), 0.0, 1e-12);
        NEAR(off(end.m, m), 0.0, 1e-13);
    }
}

int main(void)
{
    test_closed_form_of_a_tiny_momentum();
    test_nearly_a_sphere();
    test_kinds();
    test_refusals();
    test_rest();
    return check_result();
}
