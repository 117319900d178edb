/* The closed form, compared with quadrature and with stepping: integrals, scaling, frames, batches
 * of any size, and bitwise equal results on every instruction set. */
#include "exact/exact.h"
#include "truth.h"

static kr_scene random_top(int number)
{
    const double i1 = pow(10.0, uniform(-1, 1)), size = pow(10.0, uniform(-3, 3)),
                 near = pow(10.0, uniform(-9, 0));
    kr_quat q = random_quat();
    if (number % 2)
        q = q_mul(number % 4 == 1 ? q_one() : q4(0.0, v3(1, 0, 0)),
                  q_exp(v_scale(near, random_vec(1))));
    return lagrange_top(i1, i1 * pow(10.0, uniform(-2, 0.3)),
                        (number % 3 ? 1.0 : -1.0) * pow(10.0, uniform(-4, 3)), q, random_vec(size));
}
static kr_state extrapolated(const kr_scene *s, double t)
{
    return state_at(t, s, kr_method_find("extrap"), (kr_config){.tol = 1e-13});
}
static double relative_distance(kr_state a, kr_state b)
{
    return kr_attitude_error(a.q, b.q) + off(a.m, b.m) / (1.0 + v_length(b.m));
}

/* Returns the unit for errors of m: an upper bound of |m| for the top's energy. */
static double scale_of(const kr_scene *s)
{
    const double lever = fabs(s->gravity) * s->body.mass * v_length(s->body.com),
                 largest = v_largest(s->body.inertia);
    return sqrt(2.0 * largest * (kr_state_kinetic(s, &s->start) + 2.0 * lever));
}

static void test_truths(void)
{
    int count = 0;
    for (int i = 0; i < TRUTHS; i++) {
        const truth *c = &truths[i];
        if (!belongs_to(c, "closed form")) continue;
        const kr_exact *closed = closed_form(&c->scene);
        const kr_state end = kr_exact_state(closed, c->end.t);
        const kr_quat d = q_mul(q_conj(c->end.q), end.q);
        const double turn = 2.0 * v_length(q_vec(d)), push = off(end.m, c->end.m);
        if (!(turn <= 4e-15 && push <= 3e-15 * scale_of(&c->scene))) printf("%s:\n", c->name);
        /* of which 1e-15 is the rounding of the truth to doubles */
        NEAR(turn, 0.0, 4e-15);
        IS(d.w > 0.0);
        NEAR(push / scale_of(&c->scene), 0.0, 3e-15);
        count++;
    }
    IS(count > 80);
}
/* Returns the energy of a symmetric top, in long double, because rounding errors in double would be
 * as large as those of the closed form. */
static long double energy_of(const kr_scene *s, const kr_state *at)
{
    const long double w = at->q.w, x = at->q.x, y = at->q.y, z = at->q.z, up = w * w + z * z,
                      side = x * x + y * y, per_norm = 1.0L / (up + side);
    const long double p = at->m.x, q = at->m.y, r = at->m.z, height = (up - side) * per_norm,
                      axial = 2.0L * per_norm * (p * (x * z + w * y) + q * (y * z - w * x)) +
                              r * height;
    const long double across = p * p + q * q + r * r - axial * axial;
    return across / (2.0L * s->body.inertia.x) + axial * axial / (2.0L * s->body.inertia.z) +
           (long double)s->gravity * s->body.com.z * height;
}
static void test_integrals(void)
{
    double worst = 0.0, worst_energy = 0.0, worst_norm = 0.0, worst_start = 0.0, worst_m = 0.0;
    for (int i = 0; i < 20000; i++) {
        const kr_scene s = random_top(i);
        const kr_exact *closed = closed_form(&s);
        const long double energy = energy_of(&s, &s.start);
        const double scale = scale_of(&s);
        const double most = kr_state_kinetic(&s, &s.start) + 2.0 * s.body.com.z;
        const kr_state first = kr_exact_state(closed, 0.0);
        worst_start = fmax(worst_start, kr_attitude_error(first.q, s.start.q));
        worst_m = fmax(worst_m, off(first.m, s.start.m) / scale);
        for (int k = 0; k < 3; k++) {
            const kr_state e = kr_exact_state(closed, pow(10.0, uniform(-2, 6)));
            worst = fmax(worst, fabs(kr_state_axial_momentum(&s, &e) -
                                     kr_state_axial_momentum(&s, &s.start)) /
                                    scale);
            worst_energy = fmax(worst_energy, (double)fabsl(energy_of(&s, &e) - energy) / most);
            worst_norm = fmax(worst_norm, fabs(q_dot(e.q, e.q) - 1.0));
            IS(e.m.z == s.start.m.z);
        }
    }
    NEAR(worst, 0.0, 1e-14);
    NEAR(worst_energy, 0.0, 8e-15);
    NEAR(worst_norm, 0.0, 2e-15);
    NEAR(worst_start, 0.0, 5e-15);
    NEAR(worst_m, 0.0, 5e-15);
}
/* Without torque m and the kinetic energy are constant. */
static void test_free_bodies(void)
{
    double worst = 0.0;
    for (int i = 0; i < 4000; i++) {
        const double small = pow(10, uniform(-3, 0));
        const kr_vec3 part = v3(small, pow(10, uniform(-3, 0)), i % 3 ? 1.0 : small);
        kr_scene s = {.body = {.mass = 2.0,
                               .inertia = {part.y + part.z, part.z + part.x, part.x + part.y},
                               .com = {0.1, 0.2, -0.3},
                               .axes = {1, 0, 0, 0}},
                      .start = {0.0, {1, 0, 0, 0}, {0, 0, 0}}};
        s.start.q = random_quat(), s.start.m = random_vec(3.0);
        if (i % 5 == 0) s.body.com = v3(0, 0, 0), s.gravity = 2.0;
        /* about a principal axis */
        if (i % 7 == 0) s.start.m = q_turn(s.start.q, v3(0, i % 14 ? 1.0 : -1.0, 0));
        const kr_exact *closed = closed_form(&s);
        const kr_state e = kr_exact_state(closed, pow(10.0, uniform(-2, 6)));
        IS(memcmp(&e.m, &s.start.m, sizeof e.m) == 0);
        worst = fmax(worst, fabs(kr_state_kinetic(&s, &e) / kr_state_kinetic(&s, &s.start) - 1.0));
        if (i < 200 && fmin(part.x, part.y) > 0.1)
            NEAR(relative_distance(kr_exact_state(closed, 3.0), extrapolated(&s, 3.0)), 0.0, 1e-9);
    }
    NEAR(worst, 0.0, 3e-14);
}
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
    NEAR(relative_distance(kr_exact_state(closed, 1e6), s.start), 0.0, 1e-15);
    s.start.m = v3(0.0, 3.0, 0.0), closed = closed_form(&s);
    NEAR(kr_attitude_error(kr_exact_state(closed, 10.0).q, q_mul(q_exp(v3(0, 15.0, 0)), s.start.q)),
         0.0, 2e-15);
    NEAR(kr_exact_describe(closed).precession_rate, 1.5, 1e-15);
    /* hangs at rest */
    s = lagrange_top(1.0, 1.0, 1.0, q4(0.0, v3(0, 1, 0)), v3(0, 0, 0)), closed = closed_form(&s);
    NEAR(relative_distance(kr_exact_state(closed, 1e6), s.start), 0.0, 0.0);
    IS(isnan(kr_exact_state(closed, NAN).q.w) && isnan(kr_exact_state(closed, INFINITY).q.w));
}
static void test_scaling(void)
{
    for (int i = 0; i < 2000; i++) {
        const int mass = (int)uniform(-60, 60), length = (int)uniform(-60, 60),
                  time = (int)uniform(-60, 60);
        const kr_scene s = random_top(i);
        kr_scene big = s;
        big.body.mass = ldexp(s.body.mass, mass);
        big.body.inertia = v_scale(ldexp(1.0, mass + 2 * length), s.body.inertia);
        big.body.com = v_scale(ldexp(1.0, length), s.body.com);
        big.gravity = i % 9 ? ldexp(s.gravity, length - 2 * time) : 0.0;
        big.start.m = v_scale(ldexp(1.0, mass + 2 * length - time), s.start.m);
        kr_scene small = s;
        small.gravity = i % 9 ? s.gravity : 0.0;
        const kr_exact *a = closed_form(&small), *b = closed_form(&big);
        const double t = pow(10.0, uniform(-2, 6));
        kr_state y = kr_exact_state(b, ldexp(t, time)), x = kr_exact_state(a, t);
        y.t = x.t, y.m = v_scale(ldexp(1.0, time - mass - 2 * length), y.m);
        IS(same(x, y) && kr_exact_describe(a).period == ldexp(kr_exact_describe(b).period, -time) &&
           kr_exact_describe(a).spin_angle_rate ==
               ldexp(kr_exact_describe(b).spin_angle_rate, time));
    }
}
/* The axis may lie along N or B, the frame of description may be rotated, the centre of mass of a
 * spherical body may lie anywhere, and the start may have any time. */
static void test_frames(void)
{
    const kr_quat cycles[3] = {q4(0.5, v3(0.5, 0.5, 0.5)), q4(0.5, v3(-0.5, -0.5, -0.5)),
                               q4(0.6, v3(0.0, 0.8, 0.0))};
    const kr_scene s = lagrange_top(2.0, 1.5, 3.0, q4(0.5, v3(-0.5, 0.5, 0.5)), v3(1, 2, 3));
    const kr_exact *plain = closed_form(&s);
    for (int i = 0; i < 5; i++) {
        kr_scene other = s;
        const kr_quat turn = cycles[i % 3];
        other.start.q = q_mul(s.start.q, q_conj(turn));
        other.start.t = 0.25;
        if (i > 2)
            other.body.axes = turn;
        else if (i == 0)
            other.body.inertia = v3(1.5, 2, 2), other.body.com = v3(3, 0, 0);
        else if (i == 1)
            other.body.inertia = v3(2, 1.5, 2), other.body.com = v3(0, 3, 0);
        else
            other.body.axes = turn;
        const kr_exact *closed = closed_form(&other);
        kr_state a = kr_exact_state(plain, 1e5), b = kr_exact_state(closed, 1e5 + 0.25);
        b.q = q_mul(b.q, turn);
        NEAR(relative_distance(a, b), 0.0, i == 2 ? 1e-10 : 3e-15); /* i = 2: its q is rounded */
    }
    kr_scene ball = lagrange_top(2.0, 2.0, 13.0, q_one(), v3(1, 2, 3)), tilted = ball;
    tilted.body.com = v3(3, 4, 12);
    tilted.start.q = q_conj(q_tilt(v3(3.0 / 13, 4.0 / 13, 12.0 / 13)));
    const kr_exact *a = closed_form(&ball), *b = closed_form(&tilted);
    const kr_quat there = q_mul(kr_exact_state(b, 100.0).q, q_conj(tilted.start.q));
    NEAR(kr_attitude_error(kr_exact_state(a, 100.0).q, there), 0.0, 1e-13);
    NEAR(relative_distance(kr_exact_state(b, 5.0), extrapolated(&tilted, 5.0)), 0.0, 1e-9);
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
    NEAR(relative_distance(kr_exact_state(a, 1e6), end), 0.0, 1e-14);
}
static void test_batches(void)
{
    enum { N = 150 };
    double t[N];
    kr_state out[N + 1], guard = {-1.0, {0, 0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < 300; i++) {
        kr_scene s = random_top(i);
        if (i % 4 == 0) s.gravity = 0.0, s.body.inertia = v3(1.0, 1.2, 1.5);
        if (i % 5 == 0) s.body.axes = random_quat(), s.start.t = 1.1;
        const kr_exact *closed = closed_form(&s);
        const size_t n = (size_t)(i % N);
        for (int k = 0; k < N; k++) t[k] = (k % 2 ? -1.0 : 1.0) * pow(10.0, uniform(-2, 9));
        out[n] = guard;
        kr_exact_states(closed, n, t, out);
        for (size_t k = 0; k < n; k++) IS(same(out[k], kr_exact_state(closed, t[k])));
        IS(same(out[n], guard));
    }
}
/* Every instruction set gives bitwise equal closed forms, single states and batches. */
static void test_instruction_sets(void)
{
    enum { N = 70 };
    double t[N];
    kr_state base[N], out[N];
    for (int i = 0; i < 2000; i++) {
        kr_scene s = random_top(i);
        if (i % 4 == 0) s.gravity = 0.0, s.body.inertia = v3(1.0, 1.2, 1.5);
        for (int k = 0; k < N; k++) t[k] = (k % 2 ? -1.0 : 1.0) * pow(10.0, uniform(-2, 9));
        kr_exact_form a = {0}, b = {0};
        kr_exact_info info;
        const kr_status made = kr_exact_scalar_base.plan(&s, 0, 0.0, &a, &info);
        kr_exact_evaluate_base(&a, N, t, base);
        for (const kr_exact_isa *isa = kr_symmetric_form; isa->name; isa++) {
            if (!isa->runs_here()) continue;
            IS(made == KR_OK && isa->scalar->plan(&s, 0, 0.0, &b, &info) == KR_OK &&
               memcmp(&b, &a, sizeof a) == 0);
            isa->evaluate(&a, N, t, out);
            for (int k = 0; k < N; k++)
                IS(same(out[k], base[k]) && same(isa->scalar->state(&a, t[k]), base[k]));
        }
    }
}
enum { MANY = 20000 };
static double many_times[MANY];
static kr_state memory[MANY + 1];
static void as_one_by_one(const kr_scene *scene, kr_state *out)
{
    const kr_exact *closed = closed_form(scene);
    kr_exact_form form;
    kr_exact_info info;
    IS(kr_exact_widest_isa(kr_symmetric_form)->scalar->plan(scene, 0, 0.0, &form, &info) == KR_OK);
    kr_exact_states(closed, MANY, many_times, out);
    for (int k = 0; k < MANY; k++)
        IS(k == 77 ? isnan(out[k].q.w) : same(out[k], kr_exact_state(closed, many_times[k])));
    for (const kr_exact_isa *isa = kr_symmetric_form; isa->name; isa++) {
        const kr_state last = out[MANY - 1];
        if (!isa->runs_here()) continue;
        memset(out, 0, MANY * sizeof *out);
        isa->evaluate(&form, MANY, many_times, out);
        IS(same(out[MANY - 1], last) && same(out[0], kr_exact_state(closed, many_times[0])));
    }
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
    test_truths();
    test_integrals();
    test_free_bodies();
    test_principal_axis();
    test_near_principal_axis();
    test_smallest_motion();
    test_top_at_rest();
    test_scaling();
    test_frames();
    test_far_frames_of_a_ball();
    test_batches();
    test_instruction_sets();
    test_batch_of_tops();
    return check_result();
}
