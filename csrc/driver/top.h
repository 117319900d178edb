/* A top in motion, as the driver sees it. Shared by top.c (the user's side) and steps.c
 * (the methods' side). */
#ifndef KR_TOP_H
#define KR_TOP_H
#include "method.h"

struct kr_top {
    kr_scene scene;
    const kr_method *method;
    kr_config config;
    kr_quat axes;                    /* working axes -> frame of description */
    int turned;                      /* whether they differ */
    double time_unit, momentum_unit; /* the own units in the user's: [T], [M L^2 T^-1] */
    double forward;                  /* 1, or -1 back in time */
    /* kept: main as it was when last looked at; dense methods need main alone */
    kr_motion main, side, kept;
    /* main's steps, which are its point on the grid; then; when to look again */
    int64_t k, kept_k, look_at;
    /* adaptive: the state, own units, from which main's last step began, */
    kr_state before;
    double before_clock; /* and when */
    double asked;        /* the time that was asked for last, */
    /* and the state there, the user's; and what its doubles leave out */
    kr_state now, low;
    kr_event *events; /* what is watched, the user's memory */
    size_t watched;
    kr_vec3 apex; /* towards the centre of mass, working axes; for these */
    double memory[];
};

/* With more digits than a double has: main's lever, in units of `moment`; */
void kr_deep_lever(kr_top *top, double moment);
/* a start into own units, with main's `low`; and a state out of them, with the top's `low`. */
kr_state kr_deep_in(kr_top *top, const kr_state *start);
void kr_deep_out(kr_top *top, kr_state *s);

/* After a failure on the way to t: main's own state, where it is further than what was asked for
 * last. */
void kr_top_come_up(kr_top *top, double t);
/* Main failed, or is not finite, since it was kept: back there, and on as far as all is well. Says
 * what failed. */
kr_status kr_steps_recover(kr_top *top);
/* Main, on to grid point `goal`, and its state there. */
kr_status kr_steps_walk(kr_top *top, int64_t goal, kr_state *s);
/* Main, on by one step of an adaptive method. */
kr_status kr_steps_adaptive(kr_top *top);
/* Main, on by one step of a dense method, which may pass `until`. */
kr_status kr_steps_dense(kr_top *top, double until);
/* The state `span` after `from`, by a run of its own; own units. */
kr_status kr_steps_detour(kr_top *top, const kr_state *from, double span, kr_state *end);
/* Whether the user wants to stop. */
int kr_steps_stopped(kr_top *top);
/* Keep main as it is. */
void kr_steps_keep(kr_top *top);
#endif
