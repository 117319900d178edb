/* Calls without a top: constructors of bodies, tables, functions of a state. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "calls.h"
#include "random_values.h"
#include "claims.h"
#include "math/su2.h"
#include "model/body.h"
#include "model/quantities.h"
#include "scenes.h"

static kr_vec3 spoiled_vector(double low, double high)
{
    const kr_vec3 v = vector_between(low, high);
    return v3(maybe_arbitrary(v.x, 8), maybe_arbitrary(v.y, 8), maybe_arbitrary(v.z, 8));
}
static void any_tensor(double j[9])
{
    const double off[3] = {between(-0.3, 0.3), between(-0.3, 0.3), between(-0.3, 0.3)};
    const double size = odds(80) ? 1.0 : spread(1e-300, 1e300);
    for (int i = 0; i < 9; i++) j[i] = i % 4 ? off[i / 3 + i % 3 - 1] : between(0.5, 2.0);
    if (odds(30)) j[1] = j[2] = j[3] = j[5] = j[6] = j[7] = 0.0;
    if (odds(30)) j[0] = j[4] = j[8];
    for (int i = 0; i < 9; i++) j[i] = maybe_arbitrary(size * j[i], 2);
}
void call_bodies(void)
{
    double j[9];
    kr_body body;
    kr_status status;
    const double mass = maybe_arbitrary(spread(0.1, 10.0), 10),
                 one = maybe_arbitrary(spread(0.1, 10.0), 10),
                 other = maybe_arbitrary(spread(0.1, 10.0), 10),
                 height = maybe_arbitrary(between(-2.0, 2.0), 10);
    const kr_vec3 com = spoiled_vector(-2.0, 2.0), pivot = spoiled_vector(-2.0, 2.0);
    any_tensor(j);
    fill_with_mark(&body, sizeof body);
    const int maker = (int)choose(4);
    if (odds(50)) kr_inertia_add_point(j, mass, com);
    print_call("make body %d", maker);
    if (maker == 0)
        status =
            kr_body_shape((kr_shape)choose(6), v3(one, other, fabs(height)), mass, pivot, &body);
    else if (maker == 1)
        status = kr_body_symmetric(mass, one, other, height, &body);
    else
        status = kr_body_from_tensor(
            mass, j, com, maker == 2 ? 0.0 : maybe_arbitrary(spread(1e-16, 2.0), 10), &body);
    const enum error_kind wrong = error_category(status);
    CLAIM(wrong == NONE || wrong == INPUT);
    CLAIM(status != KR_OK || kr_body_check(&body) == KR_OK);
    CLAIM(status == KR_OK || is_marked(&body, sizeof body));
    if (status == KR_OK) CLAIM(kr_body_is_physical(&body) == 0 || kr_body_is_physical(&body) == 1);
    if (status != KR_OK) return;
    CLAIM(kr_kind_name(kr_body_kind(&body, maybe_arbitrary(1e-12, 5))) != NULL);
    const kr_vec3 rotor = vector_between(-2.0, 2.0);
    kr_body_set_rotor(&body, rotor);
    CLAIM(kr_body_check(&body) == KR_OK);
    CLAIM(v_largest(v_sub(q_turn(body.axes, body.rotor), rotor)) <= 1e-14);
}

static void check_quantity(const kr_quantity *quantity)
{
    static const size_t most = 9;
    const size_t doubles = quantity->doubles;
    CLAIM(kr_quantity_find(quantity->name) == quantity);
    CLAIM(quantity->text && quantity->dimension);
    CLAIM(doubles >= 1 && doubles <= most);
    for (size_t i = 0; i < doubles; i++) {
        char name[64];
        snprintf(name, sizeof name, "%s%s", quantity->name, quantity->suffixes[i]);
        CLAIM((kr_component_find(name) >= 0) == !!(quantity->flags & KR_QUANTITY_IN_EVENTS));
    }
}
static void check_method(const kr_method *method)
{
    kr_scene scene = any_scene();
    const kr_method_info info = kr_method_describe(method);
    CLAIM(kr_method_find(info.name) == method);
    CLAIM(info.text && info.conserves && info.reference && info.order >= 0);
    if (kr_method_applies(method, &scene.body)) CLAIM(kr_body_check(&scene.body) == KR_OK);
    if (kr_method_suits(method, &scene)) CLAIM(kr_scene_check(&scene) == KR_OK);
}
void call_names(void)
{
    char name[12] = {0};
    print_call("read tables");
    for (size_t i = 0; i + 1 < sizeof name; i++) name[i] = i ? (char)choose(256) : '?';
    CLAIM(!kr_quantity_find(name) && !kr_quantity_find(NULL));
    CLAIM(!kr_method_find(name) && !kr_method_find(NULL));
    CLAIM(kr_component_find(name) == -1);
    CLAIM(kr_component_find("1") == KR_COMPONENT_ONE);
    const kr_config none = kr_config_default();
    CLAIM(none.step == 0.0 && none.tol == 0.0 && none.max_steps == 0 && !none.poll);
    CLAIM(strcmp(kr_version(), KR_VERSION) == 0);
    CLAIM(!kr_quantity_at(KR_QUANTITIES + choose(9)) && !kr_method_at(SIZE_MAX));
    check_quantity(any_quantity());
    check_method(any_method());
}

/* Claims that a quantity writes exactly its number of doubles. */
static void value_of(const kr_quantity *quantity, const kr_scene *scene, const kr_state *state)
{
    const size_t doubles = quantity->doubles;
    const kr_state two[2] = {*state, scene->start};
    double out[20], one[10];
    fill_with_mark(out, sizeof out);
    print_call("values of %s", quantity->name);
    kr_quantity_values(quantity, scene, 2, two, out);
    kr_quantity_values(quantity, scene, 1, &two[1], one);
    CLAIM(is_marked(out + 2 * doubles, (20 - 2 * doubles) * sizeof *out));
    CLAIM(same_bits(one, out + doubles, doubles * sizeof *out));
}
/* Claims that the derivatives of a quantity by the start fill exactly their place, and are linear:
 * tangents twice as large give derivatives twice as large. */
static void derivatives_of(const kr_quantity *quantity, const kr_scene *scene, const kr_state *s)
{
    enum { MOST = 9 * KR_TANGENT_COLUMNS_MAX, NUMBERS = 6 * KR_TANGENT_COLUMNS_MAX };
    const uint64_t by = odds(50) ? KR_TANGENT_START : choose(2 * KR_TANGENT_FRICTION);
    const size_t columns = kr_tangent_columns(by), doubles = quantity->doubles,
                 n = columns * (doubles == 4 ? 3 : doubles);
    const kr_state two[2] = {*s, scene->start};
    double tangents[2 * NUMBERS], out[2 * MOST + 1], more[MOST];
    for (size_t i = 0; i < 12 * columns; i++) tangents[i] = between(-1.0, 1.0);
    fill_with_mark(out, sizeof out);
    print_call("derivatives of %s by %llu", quantity->name, (unsigned long long)by);
    kr_quantity_tangents(quantity, scene, 2, two, by, tangents, out);
    CLAIM(is_marked(out + 2 * n, (2 * MOST + 1 - 2 * n) * sizeof *out));
    for (size_t i = 0; i < 12 * columns; i++) tangents[i] *= 2.0;
    kr_quantity_tangents(quantity, scene, 1, &two[1], by, tangents + 6 * columns, more);
    for (size_t i = 0; by == KR_TANGENT_START && i < n; i++) {
        const double twice = 2.0 * out[n + i], size = fabs(twice);
        if (size > 1e-290 && size < 1e290) CLAIM(more[i] == twice);
    }
}
/* Tolerance for the unit length of two attitudes, whose squares enter the rotation of a vector. */
static const double slack = 3.0 * KR_INPUT_RTOL;
static void check_values(const kr_scene *scene, const kr_state *s)
{
    const kr_vec3 apex = kr_state_apex(scene, s);
    const double nutation = kr_state_nutation(scene, s);
    kr_vec3 frame[3];
    kr_state_frame(scene, s, frame);
    CLAIM(fabs(v_length(apex) - 1.0) <= slack);
    CLAIM(nutation >= 0.0 && nutation <= 3.1415926535897936);
    for (int i = 0; i < 3; i++) CLAIM(fabs(v_length(frame[i]) - 1.0) <= slack);
    CLAIM(kr_attitude_error(s->q, scene->start.q) <= 3.1415926535897936);
}
void call_values(void)
{
    const kr_scene scene = any_scene();
    kr_state s = {maybe_arbitrary(between(-9.0, 9.0), 5), any_attitude(),
                  vector_between(-3.0, 3.0)};
    kr_scene body_alone = scene;
    const kr_term terms[2] = {{between(-1.0, 1.0), 0, (int)choose(8)},
                              {between(-1.0, 1.0), (int)choose(8), 0}};
    tell_scene(&scene);
    body_alone.start = s;
    const int sound = kr_scene_check(&scene) == KR_OK && kr_scene_check(&body_alone) == KR_OK;
    value_of(any_quantity(), &scene, &s);
    derivatives_of(any_quantity(), &scene, &s);
    if (sound) check_values(&scene, &s);
    if (odds(20)) s.q = q4(any_double(), spoiled_vector(-1.0, 1.0));
    (void)kr_state_velocity(&scene, &s);
    (void)kr_state_torque(&scene, &s);
    const double kinetic = kr_state_kinetic(&scene, &s), potential = kr_state_potential(&scene, &s),
                 energy = kr_state_energy(&scene, &s);
    CLAIM(energy == kinetic + potential || isnan(kinetic + potential));
    (void)kr_state_vertical_momentum(&scene, &s);
    (void)kr_state_axial_momentum(&scene, &s);
    (void)kr_state_kowalewski(&scene, &s);
    (void)kr_state_goryachev_chaplygin(&scene, &s);
    (void)kr_state_modified_energy(&scene, &s, any_double(), 1);
    (void)kr_state_modified_energy(&scene, &s, any_double(), 4);
    if (sound) (void)kr_terms_value(&scene, &s, 2, terms);
}
