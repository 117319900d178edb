/* Batches of closed forms: the result of each top is bitwise equal to that of the top alone, on
 * every instruction set, in any order and beside any neighbours. A refused top changes nothing but
 * its status. */
#include <float.h>
#include <stdlib.h>
#include <string.h>
#include "check.h"
#include "exact/exact.h"
#include "random.h"

enum { TOPS = 6000, MOST_TIMES = 40, ALIKE = 20 };

static double of_any_size(double least, double most) { return pow(10.0, uniform(least, most)); }
static kr_body symmetric(void)
{
    kr_body b = {1.0, {1.0, 1.0, 1.0},   {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0},
                 0.0, .rotor = {0, 0, 0}};
    b.inertia.z = uniform(0.05, 1.99);
    b.com.z = uniform(0.1, 1.0);
    return b;
}
/* Returns an attitude whose axis leans by this angle from the upward vertical, or from the downward
 * vertical if the angle is negative. */
static kr_quat leaning(double angle)
{
    const double way = uniform(0.0, 6.3), s = sin(0.5 * fabs(angle)), c = cos(0.5 * angle);
    const kr_quat tilt = q4(c, v3(s * cos(way), s * sin(way), 0.0));
    const kr_quat up = angle < 0.0 ? q_mul(tilt, q4(0.0, v3(1.0, 0.0, 0.0))) : tilt;
    return q_mul(up, q4(cos(way), v3(0.0, 0.0, sin(way))));
}
/* Sets a start for one of several types of motion of a top with moment 1 and a lever up to 1. */
static void choose_course(kr_scene *s, int number)
{
    const kr_vec3 axis = q_turn_e3(s->start.q);
    switch (number % 10) {
    case 0: /* cusps: the axis starts at rest */
        s->start.m = v_scale(uniform(-3, 3), axis);
        break;
    case 1: /* pendulum, or at rest */
        s->start.m = v_scale(uniform(-2, 2), v_cross(axis, v3(0, 0, 1)));
        if (number % 20 == 1) s->start.m = v3(0, 0, 0);
        break;
    case 2: /* sleeping, stable or not, or hanging */
        s->start.q = leaning(number % 20 == 2 ? 0.0 : -1e-300);
        s->start.m = v3(0, 0, uniform(-4, 4));
        break;
    case 3: /* near a pole, and near a separatrix */
        s->start.q = leaning((number % 20 == 3 ? 1.0 : -1.0) * of_any_size(-90, 0));
        s->start.m = v_scale(uniform(-4, 4), q_turn_e3(s->start.q));
        break;
    case 4: /* fast */
        s->start.m = random_vec(of_any_size(1, 8));
        break;
    case 5: /* slow */
        s->start.m = random_vec(of_any_size(-200, 0));
        break;
    case 6: /* through the vertical */
        s->start.m = random_vec(1.0);
        s->start.m.z = v_dot(s->start.m, axis);
        break;
    default:
        s->start.m = random_vec(3.0);
    }
}
static void choose_body(kr_scene *s, int number)
{
    const kr_vec3 i = s->body.inertia;
    switch (number % 9) {
    case 0: /* with another axis of symmetry */
        s->body.inertia = v3(i.z, i.x, i.y);
        s->body.com = v3(number % 2 ? -0.4 : 0.4, 0.0, 0.0);
        break;
    case 1: /* described in other axes */
        s->body.axes = random_quat();
        break;
    case 2:
        s->body.com.z = -s->body.com.z;
        break;
    case 3:
        s->body.inertia = v3(i.x, i.x * (1.0 + 3e-15), i.z);
        break;
    case 4: /* spherical, its centre of mass anywhere */
        s->body.inertia = v3(1, 1, 1);
        s->body.com = random_vec(1.0);
        break;
    case 5: { /* in other units */
        const double mass = of_any_size(-60, 60), reach = of_any_size(-40, 40);
        s->body.mass *= mass;
        s->body.com = v_scale(reach, s->body.com);
        s->body.inertia = v_scale(mass * reach * reach, i);
        s->start.m = v_scale(mass * reach * reach, s->start.m);
        break;
    }
    case 6: /* so fast or so slow that products of powers of two could overflow */
        s->gravity = number % 2 ? 1e152 : 1e-304;
        s->body.com.z *= number % 2 ? 1e152 : 1e-300;
        s->start.m = v_scale(number % 2 ? 1e302 : 1e-304, s->start.m);
        break;
    default:
        break;
    }
}
/* Changes a scene so that it has no closed form, has the one of a free body, or is invalid. */
static void spoil(kr_scene *s, int number)
{
    switch (number % 10) {
    case 0:
        s->start.m.y = NAN;
        break;
    case 1:
        s->body.inertia.z = 5.0 * s->body.inertia.x;
        break;
    case 2:
        s->body.inertia = v3(1.0, 1.2, 1.4);
        break;
    case 3: /* free: this has another closed form */
        s->gravity = 0.0;
        s->body.inertia = v3(1.0, 1.2, 1.4);
        break;
    case 4:
        *(number % 2 ? &s->damping.z : &s->damping.y) = 1e-3;
        break;
    case 5:
        s->start.q.w += 0.1;
        break;
    case 6:
        s->gravity = INFINITY;
        break;
    case 7: /* supported at the centre of mass */
        s->body.com = v3(0, 0, 0);
        break;
    case 8:
        s->start.t = -INFINITY;
        break;
    default: /* rates beyond the range of doubles */
        s->body.inertia = v_scale(1e-305, s->body.inertia);
        s->start.m = v3(1e200, 0, 0);
    }
}
static kr_scene any_scene(int number)
{
    kr_scene s = {.body = symmetric(), .gravity = 1.0, .start = {0.0, random_quat(), {0, 0, 0}}};
    choose_course(&s, number);
    if (number % 3 == 0) choose_body(&s, number / 3);
    if (number % 7 == 0) s.gravity = -of_any_size(-3, 3);
    if (number % 11 == 0) s.gravity = of_any_size(-320, 100);
    if (number % 5 == 0) s.start.t = uniform(-1e3, 1e3);
    if (number % 13 == 0) spoil(&s, number / 13);
    return s;
}

/* The results of each top alone, and of all tops together. */
static kr_scene scenes[TOPS];
static kr_exact_form alone[TOPS], together[TOPS];
static kr_status status_alone[TOPS], status[TOPS];
static kr_state states_alone[TOPS * 3], states[TOPS * 3];
static double times[TOPS * 3];

static int curve_of(const kr_scene *s)
{
    kr_exact_form form;
    kr_exact_info info;
    const kr_exact_scalar *scalar = kr_exact_widest_isa(kr_symmetric_form)->scalar;
    return scalar->plan(s, 1, 0.0, &form, &info) == KR_OK ? (int)form.curve : -1;
}
/* Fills n scenes with tops at the boundary between the theta series and its dual. Rounding errors
 * decide which is used, so lanes of one group need both. */
static void at_the_change(kr_scene *out, int n)
{
    kr_scene s = {.body = symmetric(), .gravity = 1.0, .start = {0.0, random_quat(), {0, 0, 0}}};
    const kr_vec3 from = random_vec(3.0);
    double least = 1.0, most;
    int curve;
    s.start.m = from;
    curve = curve_of(&s);
    while (curve_of(&s) == curve && least > 1e-3) s.start.m = v_scale(least *= 0.9, from);
    most = least / 0.9;
    while (least < 0.5 * (least + most) && 0.5 * (least + most) < most) {
        s.start.m = v_scale(0.5 * (least + most), from);
        *(curve_of(&s) == curve ? &most : &least) = 0.5 * (least + most);
    }
    for (int i = 0; i < n; i++) {
        s.start.m = v_scale(least * (1.0 + (i - n / 2) * DBL_EPSILON), from);
        out[i] = s;
    }
}
static void make_scenes(void)
{
    for (int i = 0; i < TOPS; i++) {
        const int same_body = i > 0 && i % 4 > 1;
        scenes[i] = any_scene(i);
        if (same_body) scenes[i].body = scenes[i - 1].body;
    }
    for (int i = 0; i < TOPS / 20; i += ALIKE) at_the_change(scenes + i, ALIKE);
}
static void shuffle(void)
{
    for (int i = TOPS - 1; i > 0; i--) {
        const int j = (int)(random_bits() % (unsigned)(i + 1));
        const kr_scene s = scenes[i];
        scenes[i] = scenes[j];
        scenes[j] = s;
    }
}
/* Returns any time; some are too late for the series, and some are not finite. */
static double any_time(int number)
{
    if (number % 50 == 0) return of_any_size(0, 308);
    if (number % 97 == 0) return NAN;
    return uniform(-1, 1) * of_any_size(-3, 6);
}
static void plan_alone(const kr_exact_scalar *one)
{
    for (int i = 0; i < TOPS; i++) {
        memset(&alone[i], 0xa5, sizeof alone[i]);
        memset(&states_alone[3 * i], 0xa5, 3 * sizeof states_alone[0]);
        kr_exact_info info;
        status_alone[i] = one->plan(&scenes[i], 0, 0.0, &alone[i], &info);
        for (int k = 0; k < 3; k++) {
            times[3 * i + k] = any_time(3 * i + k);
            if (status_alone[i] == KR_OK)
                states_alone[3 * i + k] = one->state(&alone[i], times[3 * i + k]);
        }
    }
}
/* Returns nonzero if any bit differs. */
static int differ(const void *a, const void *b, size_t size) { return memcmp(a, b, size) != 0; }

/* Plans the n tops from `first` on together, and compares the results with those of each top
 * alone. */
static void hold_to_alone(const kr_exact_isa *isa, size_t first, size_t n)
{
    const kr_exact_request asked = {isa, n,      scenes + first, together, 3, times + 3 * first,
                                    1,   states, status};
    int wrong = 0;
    memset(together, 0xa5, sizeof together);
    memset(states, 0xa5, sizeof states);
    kr_exact_run(&asked);
    for (size_t i = 0; i < n; i++)
        wrong += status[i] != status_alone[first + i] ||
                 differ(&together[i], &alone[first + i], sizeof alone[0]) ||
                 differ(&states[3 * i], &states_alone[3 * (first + i)], 3 * sizeof states[0]);
    if (wrong) printf("%s: %d of %zu from %zu on\n", isa->name, wrong, n, first);
    IS(wrong == 0);
}
static void test_independence_of_neighbours(const kr_exact_isa *isa)
{
    hold_to_alone(isa, 0, TOPS);
    for (size_t n = 0; n <= 70; n++) hold_to_alone(isa, n * n, n);
    for (size_t first = 0; first < 300; first++) hold_to_alone(isa, first, 1);
}
/* Evaluates the tops at common times, few and many, without storing their plans. */
static void test_common_times(const kr_exact_isa *isa)
{
    enum { FEW = 50 };
    static kr_state rows[FEW * MOST_TIMES], row[MOST_TIMES];
    double t[MOST_TIMES];
    for (int k = 0; k < MOST_TIMES; k++) t[k] = any_time(k);
    for (size_t count = 0; count <= MOST_TIMES; count += count < 2 ? 1 : 7) {
        const kr_exact_request asked = {isa, FEW, scenes, NULL, count, t, 0, rows, status};
        kr_exact_run(&asked);
        for (size_t i = 0; i < FEW; i++) {
            IS(status[i] == status_alone[i]);
            if (status[i] != KR_OK) continue;
            for (size_t k = 0; k < count; k++) row[k] = isa->scalar->state(&alone[i], t[k]);
            IS(!differ(row, rows + i * count, count * sizeof row[0]));
        }
    }
}
int main(void)
{
    make_scenes();
    for (int order = 0; order < 3; order++) {
        for (const kr_exact_isa *isa = kr_symmetric_form; isa->name; isa++) {
            if (!isa->runs_here()) continue;
            plan_alone(isa->scalar);
            test_independence_of_neighbours(isa);
            test_common_times(isa);
        }
        shuffle();
    }
    const kr_exact_request none = {
        kr_exact_widest_isa(kr_symmetric_form), 0, NULL, NULL, 0, NULL, 0, NULL, NULL};
    kr_exact_run(&none);
    return check_result();
}
