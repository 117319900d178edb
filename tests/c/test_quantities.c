/* Quantities: their table, Euler angles at the poles, components, and integrals that do not exist.
 * The tests in Python compare all quantities and their derivatives with formulas. */
#include "model/quantities.h"
#include "tops.h"

static const double pi = 3.14159265358979323846;
/* Returns a random top in a random state. */
static kr_scene random_top(void)
{
    const double inertia[9] = {2.0, 0.1, -0.2, 0.1, 2.6, 0.3, -0.2, 0.3, 3.1};
    kr_scene s = kr_scene_default();
    IS(kr_body_from_tensor(1.3, inertia, random_vec(1.0), 0.0, &s.body) == KR_OK);
    s.start.q = random_quat();
    s.start.m = random_vec(1.0);
    s.gravity = uniform(-3, 3);
    return s;
}
static double value(const char *name, const kr_scene *s)
{
    double out = NAN;
    IS(kr_quantity_find(name)->doubles == 1);
    kr_quantity_values(kr_quantity_find(name), s, 1, &s->start, &out);
    return out;
}
static kr_vec3 vector(const char *name, const kr_scene *s)
{
    kr_vec3 out = v3(NAN, NAN, NAN);
    IS(kr_quantity_find(name)->doubles == 3);
    kr_quantity_values(kr_quantity_find(name), s, 1, &s->start, &out.x);
    return out;
}
static double angle_apart(double a, double b) { return fabs(remainder(a - b, 2.0 * pi)); }
static kr_quat about(kr_vec3 axis, double angle) { return q_exp(v_scale(angle, axis)); }

static void test_table(void)
{
    for (size_t i = 0; kr_quantity_at(i); i++) {
        const kr_quantity *q = kr_quantity_at(i);
        const size_t n = q->doubles;
        IS(kr_quantity_find(q->name) == q && n >= 1 && n <= KR_QUANTITY_DOUBLES_MAX);
        IS(strlen(q->text) > 10 && strlen(q->dimension) < 12);
        for (size_t k = 0; k < n; k++) IS(strlen(q->suffixes[k]) == (n == 1 ? 0 : n == 9 ? 3 : 2));
    }
    IS(kr_quantity_find("vertical") == NULL && kr_quantity_find(NULL) == NULL);
}
/* The values for many states are bitwise equal to those for single states. */
static void test_rows(void)
{
    enum { STATES = 5 };
    const kr_scene s = random_top();
    kr_state states[STATES];
    for (int k = 0; k < STATES; k++) {
        const kr_state state = {k, random_quat(), random_vec(1.0)};
        states[k] = state;
    }
    for (size_t i = 0; kr_quantity_at(i); i++) {
        const size_t n = kr_quantity_at(i)->doubles;
        double all[STATES * KR_QUANTITY_DOUBLES_MAX], one[KR_QUANTITY_DOUBLES_MAX];
        kr_quantity_values(kr_quantity_at(i), &s, STATES, states, all);
        for (size_t k = 0; k < STATES; k++) {
            kr_quantity_values(kr_quantity_at(i), &s, 1, &states[k], one);
            IS(memcmp(one, all + k * n, n * sizeof *one) == 0);
        }
    }
}
/* The flag KR_QUANTITY_TURNS agrees with the behaviour under rotations about the vertical. */
static void test_flags(void)
{
    for (size_t i = 0; kr_quantity_at(i); i++) {
        const kr_quantity *quantity = kr_quantity_at(i);
        const size_t n = quantity->doubles;
        kr_scene s = random_top();
        double before[KR_QUANTITY_DOUBLES_MAX], after[KR_QUANTITY_DOUBLES_MAX], change = 0.0;
        kr_quantity_values(quantity, &s, 1, &s.start, before);
        const kr_quat turn = about(v3(0, 0, 1), 0.9);
        s.start.q = q_mul(turn, s.start.q);
        s.start.m = q_turn(turn, s.start.m);
        kr_quantity_values(quantity, &s, 1, &s.start, after);
        for (size_t k = 0; k < n; k++) change = fmax(change, fabs(after[k] - before[k]));
        IS(quantity->flags & KR_QUANTITY_TURNS ? change > 1e-3 : change < 1e-14);
    }
}

/* For upright and hanging tops, the angles of precession and spin are each half of the total
 * rotation up to sign, whatever the signs of zeros. Close to a pole their sum or difference is the
 * total rotation. */
static void test_poles(void)
{
    for (int side = -1; side <= 1; side += 2) {
        for (double angle = -3.0; angle <= 3.0; angle += 0.5) {
            kr_scene s = kr_scene_default();
            s.body.com = v3(0.0, 0.0, -side);
            s.start.q = about(v3(0, 0, 1), angle);
            NEAR(value("nutation", &s), side < 0 ? 0.0 : pi, 1e-15);
            NEAR(value("precession_angle", &s), 0.5 * angle, 1e-15);
            NEAR(value("spin_angle", &s), -side * 0.5 * angle, 1e-15);
            s.start.q = q4(s.start.q.w, v3(-0.0, -0.0, s.start.q.z));
            NEAR(value("precession_angle", &s), 0.5 * angle, 1e-15);
            for (int i = 0; i < 10; i++) {
                s.body.com = v3(uniform(-1e-16, 1e-16), uniform(-1e-16, 1e-16), -side);
                const double turn = value("precession_angle", &s) - side * value("spin_angle", &s);
                NEAR(angle_apart(turn, angle), 0.0, 2e-15);
            }
        }
    }
    /* half a turn is +pi, whichever the sign of zero */
    kr_scene s = kr_scene_default();
    for (int i = 0; i < 4; i++) {
        const kr_quat half = q4(i % 2 ? -0.0 : 0.0, v3(0, 0, i / 2 ? -1 : 1));
        s.start.q = q_mul(half, about(v3(1, 0, 0), 0.5));
        NEAR(value("precession_angle", &s), pi, 1e-15);
        NEAR(value("spin_angle", &s), 0.0, 1e-15);
    }
}

static void test_components(void)
{
    static const char *const none[] = {"",         "q",       "q_v",        "apex_w",
                                       "spin_x",   "energy",  "vertical_x", "velocity_x",
                                       "frame_Nx", "apex_zz", "11"};
    const kr_scene s = random_top();
    IS(kr_component_find("1") == KR_COMPONENT_ONE &&
       kr_component_value(KR_COMPONENT_ONE, &s, &s.start) == 1.0);
    for (size_t i = 0; i < sizeof none / sizeof *none; i++) IS(kr_component_find(none[i]) == -1);
    IS(kr_component_find(NULL) == -1 && !kr_component_is_valid(-1) &&
       !kr_component_is_valid(INT32_MIN) && !kr_component_is_valid(INT32_MAX));
    IS(kr_component_value(kr_component_find("q_w"), &s, &s.start) == s.start.q.w);
    IS(kr_component_value(kr_component_find("q_z"), &s, &s.start) == s.start.q.z);
    IS(kr_component_value(kr_component_find("m_y"), &s, &s.start) == s.start.m.y);
    IS(kr_component_value(kr_component_find("spin"), &s, &s.start) == value("spin", &s));
    IS(kr_component_value(kr_component_find("body_vertical_x"), &s, &s.start) ==
       vector("body_vertical", &s).x);
    IS(kr_component_is_turned(kr_component_find("apex_x")) &&
       kr_component_is_turned(kr_component_find("q_z")));
    IS(!kr_component_is_turned(kr_component_find("apex_z")) &&
       !kr_component_is_turned(kr_component_find("m_z")));
    IS(!kr_component_is_turned(kr_component_find("body_vertical_x")) &&
       !kr_component_is_turned(KR_COMPONENT_ONE));
}

/* For steps of zero, or nearly zero, the modified energies equal the energy. For small steps, those
 * of bobenko_suris and bobenko_suris4 differ from it by terms of the orders step and step^2. Units
 * that are powers of two scale them exactly. */
static void test_modified_energies(void)
{
    kr_scene s = random_top();
    IS(kr_body_symmetric(1.3, 2.1, 0.9, 0.7, &s.body) == KR_OK);
    s.gravity = 2.0;
    s.start.m = v3(0.7, -0.4, 0.5);
    const double energy = kr_state_energy(&s, &s.start), h = 1e-3;
    const double first = kr_state_modified_energy(&s, &s.start, h, 1) - energy,
                 fourth = kr_state_modified_energy(&s, &s.start, h, 4) - energy;
    NEAR(kr_state_modified_energy(&s, &s.start, 0.0, 1), energy, 1e-14);
    NEAR(kr_state_modified_energy(&s, &s.start, 1e-9, 4), energy, 1e-14);
    IS(fabs(first) > 1e-6 && fabs(fourth) > 1e-9);
    NEAR((kr_state_modified_energy(&s, &s.start, 2.0 * h, 1) - energy) / first, 2.0, 1e-9);
    NEAR((kr_state_modified_energy(&s, &s.start, 2.0 * h, 4) - energy) / fourth, 4.0, 1e-3);
    const double mass = 0x1p7, length = 0x1p-3, time = 0x1p9, moment = mass * length * length;
    kr_scene scaled = s;
    scaled.body.mass *= mass;
    scaled.body.inertia = v_scale(moment, s.body.inertia);
    scaled.body.com = v_scale(length, s.body.com);
    scaled.gravity *= length / (time * time);
    scaled.start.m = v_scale(moment / time, s.start.m);
    const double unit = moment / (time * time);
    IS(kr_state_modified_energy(&scaled, &scaled.start, time * h, 1) ==
       unit * kr_state_modified_energy(&s, &s.start, h, 1));
    IS(kr_state_modified_energy(&scaled, &scaled.start, time * h, 4) ==
       unit * kr_state_modified_energy(&s, &s.start, h, 4));
}

/* Integrals do not exist on a shaken support, and modified energies do not exist with a rotor
 * either. Their derivatives do not exist then, nor by parameters that leave the integrable case. */
static void test_missing_integrals(void)
{
    static const char *const names[] = {"kowalewski", "goryachev_chaplygin"};
    const uint64_t by = KR_TANGENT_START | KR_TANGENT_COM | KR_TANGENT_ROTOR | KR_TANGENT_SHAKING;
    enum { COLUMNS = 15, OUT_OF_PLANE = 8 }; /* the column of the third coordinate of com */
    for (int i = 0; i < 2; i++) {
        double column[6][COLUMNS] = {{0.0}}, out[COLUMNS];
        const kr_quantity *quantity = kr_quantity_find(names[i]);
        kr_scene s = random_top();
        s.body.inertia = i ? v3(4.0, 4.0, 1.0) : v3(2.0, 2.0, 1.0);
        s.body.com = v3(0.25, 0.0, 0.0);
        for (int k = 0; k < 6; k++) column[k][k] = 1.0;
        IS(isfinite(value(names[i], &s)));
        kr_quantity_tangents(quantity, &s, 1, &s.start, by, column[0], out);
        for (int k = 0; k < COLUMNS; k++) IS(isnan(out[k]) == (k >= OUT_OF_PLANE));
        s.shaking = (kr_shaking){0.1, 2.0, 0.3};
        IS(isnan(value(names[i], &s)));
        kr_quantity_tangents(quantity, &s, 1, &s.start, by, column[0], out);
        for (int k = 0; k < COLUMNS; k++) IS(isnan(out[k]));
    }
    kr_scene s = random_top();
    IS(kr_body_symmetric(1.3, 2.1, 0.9, 0.7, &s.body) == KR_OK);
    IS(isfinite(kr_state_modified_energy(&s, &s.start, 0.1, 1)));
    IS(isfinite(kr_state_modified_energy(&s, &s.start, 0.1, 4)));
    for (int i = 0; i < 2; i++) {
        kr_scene other = s;
        if (i)
            other.shaking = (kr_shaking){0.1, 2.0, 0.3};
        else
            other.body.rotor = v3(0.0, 0.0, 0.5);
        IS(isnan(kr_state_modified_energy(&other, &s.start, 0.1, 1)));
        IS(isnan(kr_state_modified_energy(&other, &s.start, 0.1, 4)));
    }
}

int main(void)
{
    test_table();
    test_rows();
    test_flags();
    test_poles();
    test_components();
    test_modified_energies();
    test_missing_integrals();
    return check_result();
}
