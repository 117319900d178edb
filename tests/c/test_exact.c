/* The closed form of Lagrange tops and free bodies at and near rest and steady rotations, far from
 * the start, and for many states at once. test_closed_forms.c has the laws of all closed forms. */
#include "exact_tops.h"

/* A free body that rotates exactly about one of three different principal axes continues to do
 * so. */
static void test_principal_axis(void)
{
    const double moment[3] = {2.0, 3.0, 4.5};
    for (int i = 0; i < 6; i++) {
        const double size = i % 2 ? -1.7 : 1.7, part[3] = {i / 2 == 0, i / 2 == 1, i / 2 == 2};
        const kr_vec3 axis = v3(part[0], part[1], part[2]);
        kr_scene s = lagrange_top(2.0, 2.0, 0.0, q_one(), v_scale(size, axis));
        s.body.inertia = v3(moment[0], moment[1], moment[2]);
        const kr_exact *closed = closed_form(&s);
        for (double t = -7.0; t < 1e4; t += 1234.5) {
            const kr_quat turned = q_exp(v_scale(size / moment[i / 2] * t, axis));
            NEAR(kr_attitude_error(kr_exact_state(closed, t).q, turned), 0.0, 2e-12);
        }
        IS(kr_exact_describe(closed).period == INFINITY &&
           kr_exact_describe(closed).precession_rate == 0.0);
        NEAR(kr_exact_describe(closed).spin_angle_rate, 1.7 / moment[i / 2], 1e-15);
    }
}
/* Components of the momentum that are too small to move a body off its axis do not affect the
 * choice of the axis. On the separatrix, a free body may start far from the middle axis. */
static void test_near_principal_axis(void)
{
    kr_scene s = lagrange_top(2.0, 2.0, 0.0, q_one(), v3(1.0, 1e-75, 1e-75));
    s.body.inertia = v3(2.0, 3.0, 4.5);
    const kr_exact *closed = closed_form(&s);
    NEAR(kr_attitude_error(kr_exact_state(closed, 8.0).q, q_exp(v3(4.0, 0.0, 0.0))), 0.0, 1e-14);
    s = lagrange_top(3.0, 6.0, 0.0, q_one(), v3(1.0, 0.0, 1.0));
    s.body.inertia.y = 4.0;
    const kr_exact *away = closed_form(&s);
    const kr_config deep = {.digits = 30};
    for (double t = 1.0; t < 200.0; t *= 2.0)
        NEAR(distance(kr_exact_state(away, t), state_at(t, &s, taylor(), deep)), 0.0, 5e-14);
}
/* The limit below which the closed form refuses a motion of the axis does not depend on units. */
static void test_smallest_motion(void)
{
    for (double unit = 0x1p-60; unit < 0x1p61; unit *= 0x1p60)
        for (int i = 0; i < 2; i++) {
            const double push = i ? 1e-75 : 1e-60;
            kr_scene s = lagrange_top(2.0, 1.0, 1.0, q_one(), v3(push * unit, 0.0, 3.0 * unit));
            const kr_exact *closed;
            s.body.inertia = v_scale(unit, s.body.inertia);
            s.body.mass *= unit;
            IS(plan_closed_form(&s, &closed) == (i ? KR_ERR_METHOD : KR_OK));
        }
}
/* Sleeping (stable, critical, unstable) and hanging tops only rotate about the vertical, a ball
 * rotates about m, and a body at rest stays at rest. */
static void test_top_at_rest(void)
{
    const double i1 = 7.9, i3 = 2.2, critical = 2.0 * sqrt(5.0 * i1);
    for (int i = 0; i < 8; i++) {
        const double m = critical * (i % 4) * 0.5, lever = i < 4 ? 5.0 : -5.0;
        const kr_quat q = i % 2 ? q4(0.6, v3(0, 0, 0.8)) : q4(0.0, v3(0.6, -0.8, 0.0));
        const kr_scene s = lagrange_top(i1, i3, lever, q, v3(0, 0, m));
        const kr_exact *closed = closed_form(&s);
        const kr_state e = kr_exact_state(closed, 7.0);
        NEAR(kr_attitude_error(e.q, q_mul(q_exp(v3(0, 0, m / i3 * 7.0)), q)), 0.0, 1e-14);
        IS(e.m.x == 0.0 && e.m.y == 0.0 && e.m.z == m &&
           kr_exact_describe(closed).period == INFINITY &&
           kr_exact_describe(closed).precession_rate == 0.0);
        NEAR(kr_exact_describe(closed).spin_angle_rate, (i % 2 ? m : -m) / i3, 1e-15 * m);
    }
    kr_scene s = lagrange_top(2.0, 2.0, 0.0, q4(0.6, v3(0.8, 0, 0)), v3(0, 0, 0));
    const kr_exact *closed = closed_form(&s);
    NEAR(distance(kr_exact_state(closed, 1e6), s.start), 0.0, 1e-15);
    s.start.m = v3(0.0, 3.0, 0.0), closed = closed_form(&s);
    NEAR(kr_attitude_error(kr_exact_state(closed, 10.0).q, q_mul(q_exp(v3(0, 15.0, 0)), s.start.q)),
         0.0, 2e-15);
    NEAR(kr_exact_describe(closed).precession_rate, 1.5, 1e-15);
    /* hangs at rest */
    s = lagrange_top(1.0, 1.0, 1.0, q4(0.0, v3(0, 1, 0)), v3(0, 0, 0)), closed = closed_form(&s);
    NEAR(distance(kr_exact_state(closed, 1e6), s.start), 0.0, 0.0);
    IS(isnan(kr_exact_state(closed, NAN).q.w) && isnan(kr_exact_state(closed, INFINITY).q.w));
}
/* The rotation of a spherical body to the axis of its lever needs more digits than doubles have.
 * With the digits of doubles only, the error of this rotation would grow with time. */
static void test_far_frames_of_a_ball(void)
{
    const kr_quat cycle = q4(0.5, v3(0.5, 0.5, 0.5));
    const kr_scene upright = lagrange_top(2.0, 2.0, 3.0, q4(0.5, v3(-0.5, 0.5, 0.5)), v3(1, 2, 3));
    kr_scene lying = upright;
    lying.body.com = v3(3.0, 0.0, 0.0);
    lying.start.q = q_mul(upright.start.q, q_conj(cycle));
    const kr_exact *a = closed_form(&upright), *b = closed_form(&lying);
    kr_state end = kr_exact_state(b, 1e6);
    end.q = q_mul(end.q, cycle);
    NEAR(error_of(&upright, kr_exact_state(a, 1e6), end), 0.0, 1e-14);
}
enum { MANY = 20000 };
static double many_times[MANY];
static kr_state memory[MANY + 1];
static void as_one_by_one(const kr_scene *scene, kr_state *out)
{
    const kr_exact *closed = closed_form(scene);
    kr_exact_states(closed, MANY, many_times, out);
    for (int k = 0; k < MANY; k++)
        IS(k == 77 ? isnan(out[k].q.w) : same(out[k], kr_exact_state(closed, many_times[k])));
}
/* So many states are written past the cache, if the alignment of their address permits. */
static void test_batch_of_tops(void)
{
    kr_state *const odd = (kr_state *)(void *)((double *)(void *)memory + 1);
    kr_scene scene = kr_scene_default();
    for (int k = 0; k < MANY; k++) many_times[k] = 0.37 * (k - 5000);
    many_times[77] = NAN;
    for (int i = -1; i <= 1; i++) {
        scene.gravity = i;
        as_one_by_one(&scene, memory);
        as_one_by_one(&scene, odd);
    }
}
int main(void)
{
    random_seed = 7;
    test_principal_axis();
    test_near_principal_axis();
    test_smallest_motion();
    test_top_at_rest();
    test_far_frames_of_a_ball();
    test_batch_of_tops();
    return check_result();
}
