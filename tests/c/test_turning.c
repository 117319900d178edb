/* Turning points: scaling by powers of two, bitwise equal results on every instruction set, and
 * refusals. */
#include "exact/exact.h"
#include "tops.h"

static kr_scene top_of(double height, double gravity, kr_quat q, kr_vec3 m)
{
    const kr_scene s = {.body = {.mass = 1.0,
                                 .inertia = {1.0, 1.0, 0.5},
                                 .com = {0.0, 0.0, height},
                                 .axes = {1, 0, 0, 0}},
                        .gravity = gravity,
                        .start = {2.0, q, m}};
    return s;
}
static kr_scene random_top(int number)
{
    const double size = pow(10.0, uniform(-2, 2));
    const kr_quat q = random_quat();
    return top_of(number % 2 ? 1.0 : -1.0, number % 3 ? number % 3 == 1 ? 2.0 : -0.5 : 0.0, q,
                  random_vec(size));
}

static void test_repeated_bits(void)
{
    for (int i = 0; i < 300; i++) {
        const kr_scene s = random_top(i);
        kr_scene scaled = s;
        scaled.body.mass *= 0x1p-30;
        scaled.body.inertia = v_scale(0x1p-30, s.body.inertia);
        scaled.gravity *= 0x1p20;
        scaled.start.m = v_scale(0x1p-20, s.start.m);
        scaled.start.t *= 0x1p-10;
        const kr_nutation one = limits_of_nutation(&s), other = limits_of_nutation(&scaled);
        IS(one.least == other.least && one.greatest == other.greatest);
        IS(one.t_least == 0x1p10 * other.t_least &&
           one.critical_spin == 0x1p-10 * other.critical_spin);
        IS(one.motion_type == other.motion_type);
        kr_nutation base = {0};
        IS(kr_exact_limits_base(&s, &base) == KR_OK);
        IS(strcmp(base.motion_type, one.motion_type) == 0);
        base.motion_type = one.motion_type; /* each has its own copy of the names */
        IS(memcmp(&base, &one, sizeof one) == 0);
    }
}
static void test_refusals(void)
{
    const kr_scene top = tilted();
    kr_scene bad = top;
    kr_nutation r = {.least = 5.0};
    IS(kr_exact_nutation(NULL, &r) == KR_ERR_ARGUMENT && kr_exact_nutation(&top, NULL) != KR_OK);
    bad.start.q.w += 1.0;
    IS(kr_exact_nutation(&bad, &r) == KR_ERR_ATTITUDE);
    bad = top;
    bad.damping.z = 1e-9;
    IS(kr_exact_nutation(&bad, &r) == KR_ERR_METHOD);
    bad = asymmetric();
    IS(kr_exact_nutation(&bad, &r) == KR_ERR_METHOD);
    bad.gravity = 0.0;
    IS(kr_exact_nutation(&bad, &r) == KR_ERR_METHOD && r.least == 5.0);
}
/* The apex of a free body moves on a circle about the momentum if the body is symmetric about the
 * apex. Other free bodies have no turning points. */
static void test_free_bodies(void)
{
    kr_scene s = top_of(0.0, 1.0, q_exp(v3(0.75, 0.0, 0.0)), v3(0.0, 0.0, 2.0));
    const kr_nutation r = limits_of_nutation(&s);
    NEAR(r.least, 0.75, 1e-15);
    NEAR(r.greatest, 0.75, 1e-15);
    s.body.inertia.x = 0.75;
    kr_nutation none = {.least = 5.0};
    IS(kr_exact_nutation(&s, &none) == KR_ERR_METHOD && none.least == 5.0);
    s.body.inertia = v3(1.0, 1.0, 1.0);
    IS(kr_exact_nutation(&s, &none) == KR_OK);
    s.body.rotor = v3(0.0, 0.0, 0.5);
    IS(kr_exact_nutation(&s, &none) == KR_OK);
    s.body.rotor = v3(0.5, 0.0, 0.0);
    IS(kr_exact_nutation(&s, &none) == KR_ERR_METHOD);
}

/* Levers and transverse momenta whose squares underflow have no effect. */
static void test_irrelevant_inputs(void)
{
    const double fast = 0x1p930, half = sqrt(0.5);
    for (int power = -1060; power < -900; power++) {
        const double little = ldexp(1.0, power);
        const kr_vec3 along = v3(0.0, 0.0, 97.0), across = v3(little, little * fast, fast);
        const kr_scene pulled = top_of(1.0, little, q4(0.0, v3(0.0, 1.0, 0x1p-40)), along),
                       free = top_of(1.0, 0.0, q4(half, v3(half, 0.0, 0.0)), across);
        const kr_nutation r = limits_of_nutation(&pulled), f = limits_of_nutation(&free);
        NEAR(r.greatest - r.least, 0.0, 1e-14);
        NEAR(f.greatest - f.least, 0.0, 1e-14);
        IS(r.t_least == 2.0 && f.t_greatest == 2.0 &&
           kr_exact_describe(closed_form(&pulled)).period > 0.0);
    }
}
int main(void)
{
    test_irrelevant_inputs();
    test_repeated_bits();
    test_refusals();
    test_free_bodies();
    return check_result();
}
