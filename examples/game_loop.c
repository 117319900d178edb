/* A game or a simulator with 100 tops and 1000 frames a second.
 *
 *     game_loop [FRAMES]      3000 by default
 *
 * All memory is allocated before the loop: one block for each top. In the loop, one top is pushed,
 * and another one changes its body. A change that the method cannot follow is refused, and leaves
 * the top as it was. */
#include <kreisel.h>
#include <stdio.h>
#include <stdlib.h>

enum { TOPS = 100, RATE = 1000 };
static kr_scene scenes[TOPS];
static kr_top *tops[TOPS];

/* Describes a top of 1 kg that is tilted by 60 degrees and turns about its axis [kg, m, s]. */
static kr_status describe_top(double spin, kr_scene *scene)
{
    const double moment = 0.002;
    *scene = (kr_scene){.gravity = 9.81, .start.q = {0.8660254037844387, 0.5, 0.0, 0.0}};
    const kr_status status = kr_body_symmetric(1.0, 0.01, moment, 0.1, &scene->body);
    if (status != KR_OK) return status;
    const kr_vec3 apex = kr_state_apex(scene, &scene->start);
    const double m = spin * moment;
    scene->start.m = (kr_vec3){m * apex.x, m * apex.y, m * apex.z};
    return KR_OK;
}
static kr_status create_tops(void)
{
    kr_config config = kr_config_default();
    config.step = 1.0 / RATE; /* a state between two steps costs a step more */
    kr_status status = KR_OK;
    for (int i = 0; i < TOPS && status == KR_OK; i++) {
        status = describe_top(100.0 + i, &scenes[i]);
        if (status == KR_OK)
            status = kr_top_create(&scenes[i], &kr_method_bobenko_suris2, config, &tops[i]);
    }
    return status;
}
/* Adds an impulse, a force times a short time [N s], at the centre of mass. */
static kr_status push(int i, kr_vec3 impulse)
{
    kr_state s = kr_top_state(tops[i]);
    const kr_vec3 a = kr_state_apex(&scenes[i], &s);
    const double lever = scenes[i].body.com.z;
    s.m.x += lever * (a.y * impulse.z - a.z * impulse.y);
    s.m.y += lever * (a.z * impulse.x - a.x * impulse.z);
    s.m.z += lever * (a.x * impulse.y - a.y * impulse.x);
    return kr_top_reset(tops[i], &s);
}
/* Replaces the body of a top, at its present attitude, angular momentum and time. */
static kr_status change_body(int i, const kr_body *body)
{
    kr_scene changed = scenes[i];
    changed.body = *body;
    changed.start = kr_top_state(tops[i]);
    const kr_status status = kr_top_set_scene(tops[i], &changed, NULL);
    if (status == KR_OK) scenes[i] = changed;
    return status;
}
static void print_top(const char *what, int i)
{
    const kr_state s = kr_top_state(tops[i]);
    printf("%s: t = %.3f, tilt %.6f, energy %.6f, vertical momentum %.6f\n", what, s.t,
           kr_state_nutation(&scenes[i], &s), kr_state_energy(&scenes[i], &s), s.m.z);
}
static kr_status run_frame(long frame)
{
    for (int i = 0; i < TOPS; i++) {
        const kr_status status = kr_top_advance(tops[i], (double)frame / RATE);
        if (status != KR_OK) return status;
    }
    if (frame == RATE / 2) { /* here, an answer to a key */
        print_top("before the push", 0);
        const kr_status status = push(0, (kr_vec3){0.0, 0.2, 0.0});
        if (status != KR_OK) return status;
        print_top("after the push", 0);
    }
    if (frame == RATE) {
        kr_body heavier, flat = scenes[2].body;
        kr_status status = kr_body_symmetric(2.0, 0.02, 0.004, 0.1, &heavier);
        if (status == KR_OK) status = change_body(1, &heavier);
        if (status != KR_OK) return status;
        print_top("heavier", 1);
        flat.inertia.x *= 0.9; /* no longer symmetric: bobenko_suris2 cannot move such a body */
        status = change_body(2, &flat);
        printf("refused: %s\n", kr_status_text(status));
    }
    return KR_OK; /* here, draw the tops and wait for the next frame */
}
int main(int count, char **words)
{
    const long frames = count > 1 ? strtol(words[1], NULL, 10) : 3000;
    kr_status status = create_tops();
    for (long frame = 1; frame <= frames && status == KR_OK; frame++) status = run_frame(frame);
    if (status == KR_OK)
        for (int i = 0; i < 3; i++) print_top("end", i);
    else
        fprintf(stderr, "%s\n", kr_status_text(status));
    for (int i = 0; i < TOPS; i++) kr_top_free(tops[i]);
    return status != KR_OK;
}
