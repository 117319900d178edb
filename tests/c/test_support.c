/* Damping, dry friction, and supports that turn or shake: paths against truths, laws that need no
 * integrator, refusals. */
#include "kreisel.h"
#include "event_helpers.h"
#include "truth.h"

enum { TURNING = 1, SHAKING = 2, OTHERS = 4 /* damping, a rotor, and a start at t = 0.25 */ };
static const kr_config back = {.step = -0.1};

static kr_scene moved(int kind)
{
    kr_scene s = {
        .body = {1.0, {1.25, 1.75, 2.25}, {0.125, -0.25, 0.5}, {1, 0, 0, 0}, 0, {0, 0, 0}},
        .gravity = 1.0,
        .start = {0.0, {0.5, 0.5, -0.5, 0.5}, {0.5, -0.25, 1.5}}};
    if (kind & TURNING) s.turning = v3(0.5, -0.25, 0.75);
    if (kind & SHAKING) s.shaking = (kr_shaking){0.25, 4.0, 0.5};
    if (!(kind & OTHERS)) return s;
    s.damping = v3(0.125, 0.25, 0.0625);
    s.body.rotor = v3(0.25, -0.5, 0.375);
    s.start.t = 0.25;
    return s;
}
/* Returns a symmetric top with this moment about its axis, its other moments being 1.25. */
static kr_scene symmetric_top(double i3, double gravity, double friction, kr_vec3 m)
{
    const kr_scene s = {
        .body = {1.0, {1.25, 1.25, i3}, {0.0, 0.0, 0.5}, {1, 0, 0, 0}, 0, {0, 0, 0}},
        .gravity = gravity,
        .start = {0.0, {1.0, 0.0, 0.0, 0.0}, m},
        .friction = friction};
    return s;
}
/* The core rounds the axes of a tensor to doubles, so that more digits are of no use. A motion that
 * begins later is the same if the phase of the shaking is the same. */
static void test_truth(const char *family, int digits, double begin, double most)
{
    int count = 0;
    for (int i = 0; i < TRUTHS; i++) {
        const truth *row = &truths[i];
        if (!belongs_to(row, family) || (is_tensor(row) && digits > 16)) continue;
        kr_scene s = scene_of_truth(row);
        s.start.t = begin;
        s.shaking.phase -= s.shaking.rate * begin;
        const kr_config config = {.digits = digits, .step = row->end.t < 0.0 ? -0.1 : 0.0};
        kr_top *top = make(&s, taylor(), config);
        IS(kr_top_advance(top, begin + row->end.t) == KR_OK);
        const double size = fmax(1.0, fmax(v_length(s.start.m), v_length(row->end.m))),
                     miss = error_of_truth(row, kr_top_state(top), kr_top_low(top), size);
        if (!(miss <= most)) printf("%s, %d digits:\n", row->name, digits);
        NEAR(miss, 0.0, most);
        kr_top_free(top);
        count++;
    }
    IS(count > 10);
}
/* Returns a state of the inertial frame as seen from a turning support whose axes agree with the
 * inertial ones at t = 0. */
static kr_state seen_from(kr_vec3 turning, kr_state s)
{
    const kr_quat turn = q_exp(v_scale(-s.t, turning));
    s.q = q_mul(turn, s.q);
    s.m = q_turn(turn, s.m);
    return s;
}
/* A free top, and every top on a support that turns about e3, moves as in the inertial frame. All
 * methods follow such supports. */
static void test_space_at_rest(void)
{
    for (int heavy = 0; heavy < 2; heavy++) {
        kr_scene s = moved(0);
        s.gravity = heavy;
        const kr_state rest = state_at(3.0, &s, taylor(), kr_config_default());
        s.turning = v3(heavy ? 0.0 : 0.3, heavy ? 0.0 : -0.5, 0.75);
        const kr_state seen = seen_from(s.turning, rest),
                       own = state_at(3.0, &s, taylor(), kr_config_default());
        NEAR(distance(own, seen), 0.0, 1e-14);
    }
    kr_scene s = symmetric_top(0.75, 1.0, 0.0, v3(0.5, -0.25, 1.5));
    for (size_t i = 0; kr_method_at(i); i++) {
        const kr_config config = {.step = 0.125};
        s.turning = v3(0, 0, 0);
        if (!kr_method_suits(kr_method_at(i), &s)) continue;
        const kr_state rest = state_at(1.05, &s, kr_method_at(i), config);
        s.turning = v3(0, 0, 0.75);
        const kr_state own = state_at(1.05, &s, kr_method_at(i), config);
        NEAR(distance(own, seen_from(s.turning, rest)), 0.0, 1e-6);
        IS(kr_method_suits(kr_method_at(i), &s));
    }
}
/* The momentum about the axis of a free symmetric top decreases linearly to zero, and the rest of
 * the momentum stays. The time of the stop is an event. Friction holds the top from then on. */
static void test_stop(double spin, int digits)
{
    const kr_scene s = symmetric_top(0.75, 0.0, 0.125, v3(0.5, -0.25, spin));
    const kr_term terms[] = {term(1.0, "spin", "1")};
    kr_event event = {.terms = terms, .count = 1};
    const kr_config config = {.digits = digits};
    kr_top *top = watched(&s, config, &event, 1);
    kr_event_hit hit = {-1, 0};
    for (int i = 1; i <= 2; i++) {
        IS(kr_top_seek(top, 0.5 * i, &hit) == KR_OK && hit.index < 0);
        const kr_state now = kr_top_state(top);
        NEAR(kr_state_axial_momentum(&s, &now), spin - copysign(0.0625 * i, spin), 1e-15);
    }
    IS(kr_top_seek(top, 100.0, &hit) == KR_OK && hit.index == 0);
    IS(hit.direction == (spin > 0.0 ? -1 : 1));
    kr_state now = kr_top_state(top);
    NEAR(now.t, 8.0 * fabs(spin), 1e-14);
    NEAR(kr_state_axial_momentum(&s, &now), 0.0, 1e-15);
    IS(kr_top_seek(top, 100.0, &hit) == KR_OK && hit.index < 0);
    now = kr_top_state(top);
    NEAR(kr_state_axial_momentum(&s, &now), 0.0, 1e-14);
    NEAR(v_length(now.m), sqrt(0.3125), 1e-14);
    /* A top that starts without spin is held, too, and has no unique past. */
    kr_scene held = s;
    held.start = now;
    IS(kr_top_set_scene(top, &held, NULL) == KR_OK && kr_top_seek(top, 200.0, &hit) == KR_OK);
    IS(hit.index < 0);
    kr_top_free(top);
    top = make(&held, taylor(), back);
    IS(kr_top_advance(top, 50.0) == KR_ERR_STOPPED && kr_top_time(top) == 100.0);
    kr_top_free(top);
}
/* Returns a free top whose friction stops its spin after 8 * `spin`. */
static kr_scene stopping_top(double spin)
{
    return symmetric_top(0.75, 0.0, 0.125, v3(0.5, -0.25, spin));
}
/* A spin that vanishes at the end of a step, or up to some rounding errors before it or after it,
 * stops the top at that time. */
static void test_stop_at_the_end_of_a_step(void)
{
    double low = 1e-3, high = 8.0; /* spins that vanish within and after the first step */
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        const kr_scene s = stopping_top(middle);
        kr_top *top = make(&s, taylor(), kr_config_default());
        IS(kr_top_step(top) == KR_OK);
        *(kr_top_time(top) > 8.0 * middle - 1e-13 ? &low : &high) = middle;
        kr_top_free(top);
    }
    for (int i = -300; i <= 300; i++) {
        const double spin = low * (1.0 + i * 0x1p-50);
        const kr_scene s = stopping_top(spin);
        const kr_term terms[] = {term(1.0, "spin", "1")};
        kr_event event = {.terms = terms, .count = 1};
        double t[MANY];
        kr_top *top = watched(&s, kr_config_default(), &event, 1);
        IS(seek_all(top, 16.0 * spin, t, NULL) == 1);
        NEAR(t[0], 8.0 * spin, 1e-13);
        const kr_state end = kr_top_state(top);
        NEAR(kr_state_axial_momentum(&s, &end), 0.0, 1e-14);
        NEAR(v_length(end.m), sqrt(0.3125), 1e-14);
        kr_top_free(top);
    }
}
/* A friction that is zero in internal units changes neither the path nor the tangents. */
static void test_least_friction(void)
{
    double phi[2][36];
    kr_state end[2];
    for (int i = 0; i < 2; i++) {
        kr_scene s = stopping_top(0.5);
        s.body.mass *= 1024.0;
        s.body.inertia = v_scale(1024.0, s.body.inertia);
        s.start.m = v_scale(1024.0, s.start.m);
        s.friction = i ? 5e-324 : 0.0;
        kr_top *top = make(&s, taylor(), (kr_config){.tangents = KR_TANGENT_START});
        IS(kr_top_advance(top, 3.0) == KR_OK && kr_top_tangents(top, phi[i], NULL) == KR_OK);
        end[i] = kr_top_state(top);
        kr_top_free(top);
    }
    NEAR(off(end[0].m, end[1].m), 0.0, 1e-11);
    NEAR(kr_attitude_error(end[0].q, end[1].q), 0.0, 1e-14);
    for (int k = 0; k < 36; k++) NEAR(phi[0][k], phi[1][k], 1e-14 * (1.0 + fabs(phi[0][k])));
}
/* Events of a top that friction stops at t = 4 occur at the same times with more digits. Only a
 * multiple of the spin has an event at the stop. */
static void test_events_of_a_stopping_top(void)
{
    const kr_scene s = stopping_top(0.5);
    const kr_term turned = term(-2.0, "1", "spin"), square = term(1.0, "spin", "spin"),
                  tilt = term(1.0, "apex_z", "1"), constant = term(1.0, "1", "1"),
                  sum[2] = {term(1.0, "spin", "1"), term(-1.0, "1", "1")};
    const kr_event events[] = {
        {.terms = &turned, .count = 1}, {.terms = sum, .count = 2},
        {.terms = &square, .count = 1}, {.terms = &constant, .count = 1},
        {.terms = &tilt, .count = 1},   {.terms = &tilt, .count = 1, .extremum = 1}};
    const int count[] = {1, 0, 0, 0, 3, 2};
    for (int i = 0; i < 6; i++) {
        double t[2][MANY];
        int n[2];
        for (int k = 0; k < 2; k++) {
            kr_event event = events[i];
            kr_top *top = watched(&s, (kr_config){.digits = k ? 30 : 16}, &event, 1);
            n[k] = seek_all(top, 20.0, t[k], NULL);
            kr_top_free(top);
        }
        IS(n[0] == count[i] && n[1] == count[i]);
        for (int k = 0; k < n[0]; k++) NEAR(t[0][k], t[1][k], 1e-12);
        if (i == 0) NEAR(t[0][0], 4.0, 1e-13);
    }
}
/* Friction that is too weak to hold the top lets it slide. While the top slides, a motion backward
 * in time undoes the motion forward. */
static void test_sliding(void)
{
    kr_scene s = moved(TURNING);
    const kr_term terms[] = {term(1.0, "spin", "1")};
    kr_event event = {.terms = terms, .count = 1};
    kr_event_hit hit;
    s.friction = 0.3;
    kr_top *top = watched(&s, kr_config_default(), &event, 1);
    double stops = 0.0, held = 0.0;
    while (kr_top_seek(top, 12.0, &hit) == KR_OK && hit.index == 0) {
        const kr_state now = kr_top_state(top);
        double spin;
        kr_quantity_values(kr_quantity_find("spin"), &s, 1, &now, &spin);
        NEAR(spin, 0.0, 1e-14);
        IS(now.t > stops);
        stops = now.t;
        IS(kr_top_advance(top, now.t + 0x1p-8) == KR_OK);
        const kr_state later = kr_top_state(top);
        kr_quantity_values(kr_quantity_find("spin"), &s, 1, &later, &spin);
        held += fabs(spin) < 1e-14;
    }
    IS(stops > 0.0 && held > 0.0);
    kr_top_free(top);
    const kr_state end = state_at(0.5, &s, taylor(), kr_config_default());
    kr_scene reversed = s;
    reversed.start = end;
    NEAR(distance(state_at(0.0, &reversed, taylor(), back), s.start), 0.0, 1e-14);
}
/* Returns a top that friction stops three times until t = 20. It then slides backward, in the same
 * direction as before the stop, and stays held. */
static kr_scene slipping_top(void)
{
    const kr_scene s = {.body = {1.0, {3.0, 2.0, 4.0}, {0.5, 0.0, 0.6}, {1, 0, 0, 0}, 0, {0, 0, 0}},
                        .gravity = 2.0,
                        .friction = 1.0,
                        .start = {0.0, {1, 0, 0, 0}, {0.8, -2.0, 1.5}}};
    return s;
}
/* Writes the stops after t = `begin` that a dense sequence of states shows, each to within `width`,
 * and their directions. Returns their number. */
static int sample_stops(const kr_scene *s, double begin, double width, double *t, int *direction)
{
    kr_top *top = make(s, taylor(), kr_config_default());
    int n = 0, last = 0;
    for (double at = begin; at < 20.0; at += width) {
        double spin;
        IS(kr_top_advance(top, at) == KR_OK);
        const kr_state now = kr_top_state(top);
        kr_quantity_values(kr_quantity_find("spin"), s, 1, &now, &spin);
        const int sign = fabs(spin) < 1e-13 ? 0 : spin > 0.0 ? 1 : -1;
        if (last != 0 && sign != last) {
            t[n] = at - 0.5 * width;
            direction[n++] = -last;
        }
        last = sign;
    }
    kr_top_free(top);
    return n;
}
/* A top that friction releases has no event, in whichever direction it slides, and wherever the
 * search begins: while the top slides, while friction holds it, or at the release. */
static void test_release(void)
{
    static const double begins[] = {0.0, 2.0, 7.0, 7.8, 9.5, 11.0, 12.19617518, 12.5};
    const kr_scene s = slipping_top();
    const kr_term turned = term(-2.0, "1", "spin"), spin = term(1.0, "spin", "1");
    double found[MANY], stops[MANY];
    int direction[MANY];
    for (int i = 0; i < 3 * 8; i++) {
        const double begin = begins[i / 3];
        const int n = sample_stops(&s, begin, 1.0 / 512.0, stops, direction);
        kr_event event = {.terms = i % 2 ? &turned : &spin, .count = 1};
        kr_event_hit hits[MANY];
        kr_top *top = make(&s, taylor(), (kr_config){.digits = i % 3 * 8});
        IS(kr_top_advance(top, begin) == KR_OK && kr_top_watch(top, 1, &event) == KR_OK);
        IS(seek_all(top, 20.0, found, hits) == n && n > 0);
        for (int k = 0; k < n; k++) {
            NEAR(found[k], stops[k], 1.0 / 1024.0);
            IS(hits[k].direction == (i % 2 ? -1 : 1) * direction[k]);
        }
        kr_top_free(top);
    }
}
/* With a loose tolerance, the torque at which friction releases the top differs from the torque
 * that the state needs. The top still slides soon after. */
static void test_release_with_loose_tolerance(void)
{
    kr_scene s[2] = {
        {.body =
             {0.731, {0.857, 0.857, 1.713}, {-0.315, -0.436, -0.763}, {1, 0, 0, 0}, 0, {0, 0, 0}},
         .gravity = 1.15,
         .shaking = {0.05, 1.22, -0.482},
         .friction = 0.173,
         .start = {0.0, {-0.113, -0.589, -0.789, 0.133}, {0.196, 0.512, 0.315}}},
        {.body = {0.286, {2, 2, 1}, {-0.263, 0.826, 0}, {1, 0, 0, 0}, 0, {-0.124, -0.456, -0.938}},
         .gravity = 1.409,
         .friction = 1.304,
         .start = {0.0, {0.453, 0.089, 0.686, 0.563}, {0.723, -0.26, -0.328}}}};
    for (int i = 0; i < 2; i++) {
        s[i].start.q = q_unit(s[i].start.q);
        const kr_state end = state_at(8.0, &s[i], taylor(), kr_config_default());
        for (double tol = 1e-6; tol < 1e-3; tol *= 1.01) {
            kr_top *top = make(&s[i], taylor(), (kr_config){.tol = tol});
            IS(kr_top_advance(top, 8.0) == KR_OK);
            NEAR(kr_attitude_error(kr_top_state(top).q, end.q), 0.0, 50.0 * tol);
            kr_top_free(top);
        }
    }
}
/* Checkpoints and new starts continue the shaking and the friction. */
static void test_continuation(void)
{
    static unsigned char saved[1 << 16];
    kr_scene s = moved(TURNING | SHAKING | OTHERS);
    s.friction = 0.5;
    const kr_state want = state_at(6.0, &s, taylor(), kr_config_default());
    kr_top *top = make(&s, taylor(), kr_config_default()),
           *other = make(&s, taylor(), kr_config_default());
    IS(kr_top_advance(top, 2.6) == KR_OK);
    const size_t size = kr_top_save_size(top);
    IS(size < sizeof saved && kr_top_save(top, size, saved) == KR_OK);
    IS(kr_top_load(other, size, saved) == KR_OK && kr_top_advance(other, 6.0) == KR_OK);
    IS(same(kr_top_state(other), want));
    kr_scene later = s;
    later.start = kr_top_state(top);
    IS(kr_top_set_scene(top, &later, NULL) == KR_OK && kr_top_advance(top, 6.0) == KR_OK);
    NEAR(distance(kr_top_state(top), want), 0.0, 1e-13);
    s.shaking.phase += 0.5;
    IS(kr_top_set_scene(other, &s, NULL) == KR_OK &&
       kr_top_load(other, size, saved) == KR_ERR_CHECKPOINT);
    kr_top_free(top);
    kr_top_free(other);
}
static double sum_at(const kr_scene *s, const kr_state *at, const kr_event *event)
{
    return kr_terms_value(s, at, event->count, event->terms);
}
/* At an event g is zero, or stationary: near it, g changes by the square of the time. Returns the
 * number of events. */
static int test_events(const kr_scene *s)
{
    int found = 0;
    static const char *const names[] = {
        "m_x", "m_y", "m_z", "spin", "body_velocity_y", "q_w", "apex_x", "body_momentum_x"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        for (int extremum = 0; extremum < 2; extremum++) {
            const kr_term terms[] = {term(1.0, names[i], "1"), term(0.25, "spin", names[i])};
            kr_event event = {.terms = terms, .count = 2, .extremum = extremum};
            kr_top *top = watched(s, kr_config_default(), &event, 1);
            kr_event_hit hit;
            for (int k = 0; k < 4 && kr_top_seek(top, 9.0, &hit) == KR_OK && hit.index == 0; k++) {
                found++;
                const kr_state at = kr_top_state(top);
                const kr_state ahead = state_at(at.t + 0x1p-13, s, taylor(), kr_config_default()),
                               behind = state_at(at.t - 0x1p-13, s, taylor(), kr_config_default());
                const double g = sum_at(s, &at, &event),
                             slope = sum_at(s, &ahead, &event) - sum_at(s, &behind, &event);
                NEAR(extremum ? slope * 0x1p12 : g, 0.0, extremum ? 2e-6 : 1e-14);
            }
            kr_top_free(top);
        }
    return found;
}
static kr_scene damped(kr_vec3 inertia, kr_vec3 damping, kr_vec3 m)
{
    const kr_scene s = {.body = {1.0, inertia, {0.0, 0.0, 0.0}, {1, 0, 0, 0}, 0, {0.0, 0.0, 0.0}},
                        .start = {0.0, {1, 0, 0, 0}, m},
                        .damping = damping};
    return s;
}
/* Each component of the momentum of a sphere decays to one half at the time (I / D) log 2, where an
 * event is found. */
static void test_half_momentum(void)
{
    const double I = 1.75, D = 0.3;
    const kr_scene s = damped(v3(I, I, I), v3(D, D, D), v3(0.5, -0.25, 1.0));
    static const char *const names[] = {"m_x", "m_y", "m_z"};
    const double half[] = {0.25, -0.125, 0.5};
    for (int i = 0; i < 3; i++) {
        const kr_term terms[] = {{1.0, kr_component_find(names[i]), kr_component_find("1")},
                                 {-half[i], kr_component_find("1"), kr_component_find("1")}};
        kr_event event = {.terms = terms, .count = 2};
        kr_event_hit hit = {0};
        kr_top *top = make(&s, taylor(), kr_config_default());
        IS(kr_top_watch(top, 1, &event) == KR_OK && kr_top_seek(top, 20.0, &hit) == KR_OK);
        IS(hit.index == 0 && hit.direction == (i == 1 ? 1 : -1));
        NEAR(kr_top_state(top).t, I / D * log(2.0), 1e-13);
        kr_top_free(top);
    }
}
/* A damping beyond the range of doubles in the internal units of the top is refused. */
static void test_overflow(void)
{
    kr_scene s = damped(v3(1e-200, 1e-200, 1e-200), v3(1e300, 1e300, 1e300), v3(0, 0, 1e-200));
    kr_top *top = NULL;
    IS(kr_top_create(&s, taylor(), kr_config_default(), &top) == KR_ERR_ARGUMENT && !top);
}
/* Backward in time, the velocity of a free body about a principal axis grows until it exceeds the
 * range that the series allows. The run then ends, and the last state is still accurate. */
static void test_growth_backward(void)
{
    const kr_vec3 I = {1.0, 2.0, 2.5}, D = {0.125, 0.125, 0.25};
    const kr_scene s = damped(I, D, v3(0.0, 0.0, 1.0));
    kr_top *top = make(&s, taylor(), (kr_config){.step = -1.0, .skip_heading = 1});
    kr_status status = KR_OK;
    int steps = 0;
    for (; steps < 1000 && status == KR_OK; steps++) status = kr_top_step(top);
    const kr_state end = kr_top_state(top);
    IS(status == KR_ERR_NOT_FINITE && end.m.z > 1e7);
    NEAR(log(end.m.z) / (-0.1 * end.t), 1.0, 1e-9);
    kr_top_free(top);
}
/* Rotation about an axis without damping continues unchanged backward in time, although damping
 * about the other axes, if it also acted about this one, would let the velocity grow without
 * bound. */
static void test_rotation_about_the_undamped_axis(void)
{
    for (int axis = 0; axis < 3; axis++) {
        const kr_vec3 along = v3(axis == 0, axis == 1, axis == 2);
        const kr_scene s =
            damped(v3(1.0, 1.25, 1.5), v3(along.x < 1.0, along.y < 1.0, along.z < 1.0), along);
        const kr_state end = state_at(-900.0, &s, taylor(), (kr_config){.step = -0.1});
        IS(memcmp(&end.m, &s.start.m, sizeof end.m) == 0);
    }
}
static void test_refusals(void)
{
    const kr_config config = {.step = 0.01};
    kr_scene plain = symmetric_top(0.75, 1.0, 0.0, v3(0.5, -0.25, 1.5)),
             tops[4] = {plain, plain, plain, plain};
    const kr_status status[] = {KR_ERR_TURNING, KR_ERR_SHAKING, KR_ERR_FRICTION, KR_ERR_DAMPING};
    const unsigned flags[] = {KR_METHOD_TURNING, KR_METHOD_SHAKING, KR_METHOD_FRICTION,
                              KR_METHOD_DAMPED};
    tops[0].turning = v3(0.0, 0.1, 0.2);
    tops[1].shaking = (kr_shaking){0.1, 1.0, 0.0};
    tops[2].friction = 0.1;
    tops[3].damping.z = 0x1p-1074;
    for (size_t i = 0; kr_method_at(i); i++) {
        const kr_method *method = kr_method_at(i);
        for (int k = 0; k < 4 && kr_method_suits(method, &plain); k++) {
            kr_top *top = NULL;
            const int moves = (kr_method_describe(method).flags & flags[k]) != 0;
            IS(kr_method_suits(method, &tops[k]) == moves);
            IS(kr_top_create(&tops[k], method, config, &top) == (moves ? KR_OK : status[k]));
            kr_top_free(top);
        }
    }
    const kr_exact *plan;
    kr_nutation turning;
    for (int k = 0; k < 4; k++) {
        IS(plan_closed_form(&tops[k], &plan) == KR_ERR_METHOD);
        IS(kr_exact_nutation(&tops[k], &turning) == KR_ERR_METHOD);
    }
    kr_top *top = NULL;
    kr_config tangents = {.tangents = KR_TANGENT_FRICTION}, headless = {.skip_heading = 1};
    IS(kr_top_create(&tops[0], taylor(), headless, &top) == KR_ERR_OPTION);
    IS(kr_top_create(&plain, taylor(), tangents, &top) == KR_ERR_OPTION);
    tangents.tangents = KR_TANGENT_COM;
    tops[2].body.com = v3(0.0, 0.0, 0.0);
    IS(kr_top_create(&tops[2], taylor(), tangents, &top) == KR_ERR_OPTION);
}
static void test_bad_numbers(void)
{
    const double bad[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        kr_scene s[11];
        for (int k = 0; k < 11; k++) s[k] = moved(TURNING | SHAKING);
        s[0].turning.x = s[1].turning.z = bad[i];
        s[2].shaking.amplitude = s[3].shaking.rate = s[4].shaking.phase = bad[i];
        s[5].friction = bad[i];
        s[6].friction = -1e-300;
        s[7].shaking.rate = i == 0 ? 0.0 : i == 1 ? -1.0 : 1e200;
        s[8].damping.x = s[9].damping.y = bad[i];
        s[10].damping.z = -0x1p-1074;
        for (int k = 0; k < 11; k++) IS(kr_scene_check(&s[k]) == KR_ERR_ARGUMENT);
    }
    kr_scene still = moved(0);
    still.shaking.phase = 1.0;
    IS(kr_scene_check(&still) == KR_OK);
}
int main(void)
{
    test_truth("support", 0, 0.0, 2e-14);
    test_truth("support", 16, 0.25, 2e-14);
    test_truth("support", 20, 0.0, 1e-19);
    test_truth("support", 30, 0.0, 1e-28);
    test_truth("stiff", 0, 0.0, 1e-13);
    test_space_at_rest();
    test_stop(0.75, 0);
    test_stop(-0.75, 16);
    test_stop(0.5, 30);
    test_sliding();
    test_stop_at_the_end_of_a_step();
    test_events_of_a_stopping_top();
    test_release();
    test_release_with_loose_tolerance();
    test_least_friction();
    test_continuation();
    const kr_scene moving = moved(TURNING | SHAKING);
    kr_scene rubbed = moved(TURNING);
    rubbed.friction = 0.01;
    IS(test_events(&moving) + test_events(&rubbed) > 60);
    test_refusals();
    test_bad_numbers();
    test_half_momentum();
    test_overflow();
    test_growth_backward();
    test_rotation_about_the_undamped_axis();
    return check_result();
}
