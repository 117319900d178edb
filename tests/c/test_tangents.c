/* Computing tangents changes no bit of the path. Tangents conserve the symplectic form, and do not
 * depend on the times of output. The laws in tests/python compare them with differences of runs. */
#include <stdlib.h>
#include "tops.h"

enum {
    ALL = 63 | KR_TANGENT_ROTOR,
    COLUMNS = 20,
    SUPPORT = KR_TANGENT_TURNING | KR_TANGENT_SHAKING | KR_TANGENT_FRICTION
};

static kr_scene general(void)
{
    kr_scene s = tilted();
    s.body = general_body();
    s.start.m = v3(0.6, -0.8, 2.2);
    return s;
}
/* Returns a symmetric top that stands upright and rotates about its axis. */
static kr_scene upright(double spin)
{
    kr_scene s = general();
    IS(kr_body_symmetric(2.0, 3.0, 1.5, 0.75, &s.body) == KR_OK);
    s.start.q = q_one();
    s.start.m = v3(0.0, 0.0, spin);
    return s;
}
/* Returns a symmetric top in steady precession, whose steps are divided into parts. */
static kr_scene precessing(void)
{
    kr_scene s = upright(0.0);
    IS(kr_body_symmetric(1.0, 1.0, 0.5, 1.0, &s.body) == KR_OK);
    s.gravity = 1.0;
    s.start.q = q_unit(q4(2.0, v3(1.0, 0.0, 0.0)));
    s.start.m = v3(0.0, -0.8, 1.6);
    return s;
}
/* Returns a spherical top with its centre of mass off the principal axes. Methods without tangents
 * use other axes for such a body, with the third axis through the centre of mass. */
static kr_scene spherical(void)
{
    kr_scene s = general();
    s.body = (kr_body){
        .mass = 1.0, .inertia = {2.0, 2.0, 2.0}, .com = {0.3, -0.2, 0.5}, .axes = q_one()};
    return s;
}
static kr_top *top_with(const kr_scene *s, uint64_t tangents, int digits, double step)
{
    const kr_config config = {.step = step, .digits = digits, .tangents = tangents};
    return make(s, taylor(), config);
}
static void test_unchanged_path(const kr_scene *s, int digits, double t)
{
    for (uint64_t by = 1; by <= ALL; by++) {
        if (by & KR_TANGENT_GROWTH) continue;
        kr_top *plain = top_with(s, 0, digits, t < 0.0 ? -0.1 : 0.0),
               *top = top_with(s, by, digits, t < 0.0 ? -0.1 : 0.0);
        IS(kr_top_advance(plain, t) == KR_OK && kr_top_advance(top, t) == KR_OK);
        const kr_state a = kr_top_state(plain), b = kr_top_state(top);
        const kr_state low = kr_top_describe(plain).low, its = kr_top_describe(top).low;
        IS(memcmp(&a, &b, sizeof a) == 0 && memcmp(&low, &its, sizeof low) == 0);
        IS(kr_top_describe(plain).stats.steps == kr_top_describe(top).stats.steps);
        kr_top_free(plain);
        kr_top_free(top);
    }
}
/* Each column of the tangents is bitwise independent of which other columns are computed. */
static void test_single_columns(const kr_scene *s)
{
    static const uint64_t bits[] = {1, 2, 4, 8, 16, 32, 128};
    double all[6 * COLUMNS], own[6 * COLUMNS];
    kr_top *every = top_with(s, ALL, 16, 0.0);
    size_t first = 0;
    IS(kr_tangent_columns(ALL) == COLUMNS && kr_tangent_columns(0) == 0);
    IS(kr_top_advance(every, 7.3) == KR_OK && kr_top_tangents(every, all, NULL) == KR_OK);
    for (int i = 0; i < 7; i++) {
        const size_t n = kr_tangent_columns(bits[i]);
        kr_top *top = top_with(s, bits[i], 16, 0.0);
        IS(kr_top_advance(top, 7.3) == KR_OK && kr_top_tangents(top, own, NULL) == KR_OK);
        for (size_t row = 0; row < 6; row++)
            IS(memcmp(own + row * n, all + row * COLUMNS + first, n * sizeof *own) == 0);
        first += n;
        kr_top_free(top);
    }
    kr_top_free(every);
}
/* Returns the symplectic form of two columns of the derivatives by the state. */
static double symplectic_form(const kr_state *at, double phi[6][6], int i, int j)
{
    const kr_vec3 a = q_turn(at->q, v3(phi[0][i], phi[1][i], phi[2][i])),
                  b = q_turn(at->q, v3(phi[0][j], phi[1][j], phi[2][j])),
                  p = v3(phi[3][i], phi[4][i], phi[5][i]), q = v3(phi[3][j], phi[4][j], phi[5][j]);
    return v_dot(a, q) - v_dot(b, p) - v_dot(at->m, v_cross(a, b));
}
/* Without damping and friction, the symplectic form of neighbouring motions is constant, also on
 * moving supports. */
static void test_symplectic_form(kr_scene s)
{
    const int digits[] = {16, 20, 30};
    for (int k = 0; k < 6; k++) {
        double phi[6][6], first[6][6];
        s.turning = v_scale(k % 2, v3(0.2, -0.1, 0.3));
        s.shaking = (kr_shaking){.amplitude = 0.05 * (k % 2), .rate = 4.0, .phase = 0.7};
        kr_top *top = top_with(&s, KR_TANGENT_START, digits[k / 2], k < 4 ? 0.0 : -0.1);
        for (int late = 0; late < 2; late++) {
            IS(kr_top_advance(top, (k < 4 ? 3.0 : -3.0) * late) == KR_OK);
            IS(kr_top_tangents(top, phi[0], NULL) == KR_OK);
            const kr_state now = kr_top_state(top);
            for (int i = 0; i < 36; i++) {
                const double form = symplectic_form(&now, phi, i / 6, i % 6);
                if (late) NEAR(form, first[i / 6][i % 6], 1e-12);
                first[i / 6][i % 6] = form;
            }
        }
        kr_top_free(top);
    }
}
/* Neither the intermediate times, nor the number of calls, nor a checkpoint changes the results. */
static void test_times_between(const kr_scene *s, int digits)
{
    double once[6 * COLUMNS], often[6 * COLUMNS];
    kr_top *one = top_with(s, ALL, digits, 0.0), *other = top_with(s, ALL, digits, 0.0);
    IS(kr_top_advance(one, 9.0) == KR_OK && kr_top_tangents(one, once, NULL) == KR_OK);
    for (int i = 1; i <= 64; i++) {
        IS(kr_top_advance(other, 9.0 * i / 64.0) == KR_OK);
        if (i % 3 == 0) IS(kr_top_tangents(other, often, NULL) == KR_OK);
        if (i != 40) continue;
        const size_t size = kr_top_save_size(other);
        void *saved = malloc(size);
        IS(kr_top_save(other, size, saved) == KR_OK);
        kr_top_free(other);
        other = top_with(s, ALL, digits, 0.0);
        IS(kr_top_load(other, size, saved) == KR_OK);
        free(saved);
    }
    IS(kr_top_tangents(other, often, NULL) == KR_OK);
    IS(memcmp(once, often, sizeof once) == 0);
    kr_top_free(one);
    kr_top_free(other);
}
/* At the start, and again after a reset, the tangents are the unit matrix. Impossible requests are
 * refused. */
static void test_start_and_refusals(const kr_scene *s)
{
    double phi[36], low[36];
    kr_top *top = top_with(s, KR_TANGENT_START, 16, 0.0), *none = top_with(s, 0, 16, 0.0);
    for (int turn = 0; turn < 2; turn++) {
        IS(kr_top_tangents(top, phi, low) == KR_OK);
        for (int i = 0; i < 36; i++) NEAR(phi[i], i % 7 == 0 ? 1.0 : 0.0, 4e-16);
        IS(kr_top_advance(top, 3.0) == KR_OK && kr_top_reset(top, &s->start) == KR_OK);
    }
    IS(kr_top_tangents(none, phi, low) == KR_ERR_ARGUMENT &&
       kr_top_describe(none).truncation == 0.0);
    IS(kr_top_tangents(top, NULL, low) == KR_ERR_ARGUMENT);
    kr_top_free(top);
    kr_top_free(none);
    top = NULL;
    kr_config config = {.step = 0.1, .tangents = KR_TANGENT_START};
    IS(kr_top_create(s, kr_method_find("strang"), config, &top) == KR_ERR_OPTION);
    config.skip_heading = 1;
    IS(kr_top_create(s, taylor(), config, &top) == KR_ERR_OPTION);
    config.skip_heading = 0;
    config.tangents = 2 * KR_TANGENT_GRADIENT;
    IS(kr_top_create(s, taylor(), config, &top) == KR_ERR_ARGUMENT && !top);
}
/* A tangent that exceeds the range of doubles ends the run with its own status. */
static void test_overflow(void)
{
    const kr_scene s = upright(0.0);
    kr_top *top = top_with(&s, KR_TANGENT_START, 16, 0.0);
    IS(kr_top_advance(top, 2000.0) == KR_ERR_TANGENT);
    IS(kr_top_describe(top).time > 300.0 && kr_top_describe(top).time < 2000.0);
    double phi[36] = {7.0};
    for (int i = 0; i < 150; i++) IS(kr_top_step(top) == KR_ERR_TANGENT);
    IS(kr_top_tangents(top, phi, NULL) == KR_ERR_TANGENT && phi[0] == 7.0);
    kr_top_free(top);
}
/* If momenta are tiny in the user's units, derivatives with respect to them exceed the range of
 * doubles first. Such values are not returned. */
static void test_overflow_in_user_units(void)
{
    kr_scene s = upright(0.0);
    s.body.mass *= 0x1p-600;
    s.body.inertia = v_scale(0x1p-600, s.body.inertia);
    kr_top *top = top_with(&s, KR_TANGENT_START, 16, 0.0);
    kr_status status = KR_OK;
    double t = 0.0, phi[36] = {0.0}, last = 0.0;
    while (status == KR_OK && kr_top_advance(top, t += 1.0) == KR_OK) {
        last = phi[0];
        status = kr_top_tangents(top, phi, NULL);
        for (int i = 0; i < 36; i++) IS(isfinite(phi[i]));
    }
    IS(status == KR_ERR_TANGENT && fabs(last) > 1e100);
    kr_top_free(top);
}
int main(void)
{
    kr_scene s = general();
    for (int damped = 0; damped < 2; damped++) {
        s.damping = v_scale(0.01 * damped, v3(1.0, 2.0, 3.0));
        test_unchanged_path(&s, 16, 5.0);
        test_unchanged_path(&s, 30, damped ? 0.5 : -0.5);
        test_single_columns(&s);
        test_times_between(&s, 16);
        if (!damped) test_symplectic_form(s);
    }
    test_times_between(&s, 20);
    const kr_scene ball = spherical();
    test_single_columns(&ball);
    const kr_scene steady = precessing();
    test_times_between(&steady, 16);
    test_start_and_refusals(&s);
    test_overflow();
    test_overflow_in_user_units();
    return check_result();
}
