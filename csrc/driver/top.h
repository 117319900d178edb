/* A top in motion, as the driver sees it. Shared by top.c (the user's side), steps.c (the methods'
 * side), extended.c (more digits than a double has), checkpoint.c and events/. */
#ifndef KR_TOP_H
#define KR_TOP_H
#include "method.h"
#include "model/body.h"
#include "math/su2_dd.h"

enum { KR_CHECK = 256 /* steps after which a motion is inspected and kept */ };

struct kr_top {
    /* Here a checkpoint begins. */
    kr_scene scene; /* the user's, with the start that was last set */
    const kr_method *method;
    kr_config config;
    kr_quat axes;         /* working axes -> frame of description */
    int is_turned;        /* whether these two differ */
    double time_unit;     /* the top's own, in the user's [T] */
    double momentum_unit; /* the top's own, in the user's [M L^2 T^-1] */
    double forward;       /* 1, or -1 back in time */
    kr_motion main;       /* the top under way */
    kr_motion side;       /* a motion from one of main's points to a time between them */
    kr_motion saved;      /* main as it was inspected last; dense methods need main alone */
    int64_t steps;        /* done by main, which are its point on the grid */
    int64_t saved_steps;  /* done when main was kept */
    int64_t inspect_at;   /* the number of steps at which main is inspected again */
    kr_state before;      /* adaptive: where main's last step began, own units */
    double before_clock;  /* adaptive: main's clock before its last step */
    double requested;     /* the time that was asked for last */
    kr_state now;         /* the state at that time, the user's */
    kr_state low;         /* what the doubles of `now` leave out */
    /* Here a checkpoint ends. */
    double horizon;     /* the time from which on nothing can be told, or no grid be kept */
    kr_event *events;   /* what is watched: the user's memory */
    size_t event_count; /* how many events these are */
    double *tangents;   /* the memory of what rides along; NULL: nothing does */
    kr_vec3 apex;       /* unit vector towards the centre of mass, working axes; for the events */
    double memory[];    /* the motions' work, and the tangents' */
};

/* The format of a checkpoint: the fields above as they lie in memory, at these bytes where pointers
 * have eight, and with zeros for pointers; then the work of main, and of kept where it is needed.
 * To move a field is to change the format, and takes a change of these numbers. */
/* clang-format off */
#define KR_SAVED_TOP(X)                                                                           \
    X(scene, 0)            X(method, 192)         X(config, 200)         X(axes, 256)             \
    X(is_turned, 288)         X(time_unit, 296)      X(momentum_unit, 304)  X(forward, 312)          \
    X(main, 320)           X(side, 568)           X(saved, 816)           X(steps, 1064)           \
    X(saved_steps, 1072)    X(inspect_at, 1080)    X(before, 1088)        X(before_clock, 1152)    \
    X(requested, 1160)         X(now, 1168)           X(low, 1232)
#define KR_SAVED_CONFIG(X)                                                                        \
    X(step, 0)             X(tol, 8)              X(max_steps, 16)       X(poll, 24)              \
    X(context, 32)         X(digits, 40)          X(leave_heading, 44)     \
    X(tangents, 48)
#define KR_SAVED_MOTION(X)                                                                        \
    X(inertia, 0)          X(lever, 24)           X(damping, 48)         X(step, 72)              \
    X(tol, 80)             X(clock, 88)           X(stats, 96)           X(work, 128)             \
    X(aux, 136)            X(skip_heading, 144)  X(digits, 148)         X(lever_low, 152)        \
    X(low, 176)            X(scene, 240)
/* clang-format on */

/* Returns the axes that the method of `top` works in, with all data along them. */
kr_working kr_top_working_axes(const kr_top *top);
/* Returns a start in working axes and own units. */
kr_state kr_top_start_in_own_units(kr_top *top, const kr_state *start);
/* The turn from working axes to the frame of description, with all digits. */
quat_dd kr_extended_axes(const kr_top *top);
/* The ways in and out for more digits than a double has. This one sets main's lever, in
 * units of `moment`. */
void kr_extended_set_lever(kr_top *top, double moment);
/* Takes a start into own units, its momentum as seen from the body, and what doubles leave out of
 * it into main's `low`. */
kr_state kr_extended_from_user(kr_top *top, const kr_state *start);
/* Takes a state of main's out of own units, and what doubles leave out into the top's `low`. */
void kr_extended_to_user(kr_top *top, kr_state *state);

/* Whether a state is one: finite, and with an attitude of unit length, which what overflows on its
 * way to a unit quaternion loses. */
static inline int kr_state_is_good(kr_quat q, kr_vec3 m)
{
    return fabs(q_dot(q, q) - 1.0) < 1e-6 && isfinite(fabs(m.x) + fabs(m.y) + fabs(m.z));
}
/* The horizon of such a top with this scene. */
double kr_top_horizon_of(const kr_top *top, const kr_scene *scene);
/* Allocates a top with `more` doubles behind the method's work, for this method and the tangents of
 * this config, which is that of no scene yet. */
kr_status kr_top_alloc(const kr_method *method, const kr_config *config, size_t more, kr_top **top);
/* Whether a method has the tangents that a config asks for. */
int kr_tangents_are_available(const kr_method *method, const kr_config *config);
/* The doubles that the tangents of a config take: 0 for none. */
size_t kr_tangents_size(const kr_method *method, const kr_config *config);
/* Begins the tangents, where there are any, at main's start. */
void kr_tangents_begin(kr_top *top);
/* Takes them over the step that main has just made. */
kr_status kr_tangents_advance(kr_top *top);
/* Gives them, in working axes and own units, at the time that was asked for last. */
void kr_tangents_evaluate(kr_top *top, kr_deviation out[]);
/* Makes a top that watches for nothing the one that kr_top_create would make of this scene and
 * config. Where that is refused, the top stays as it was. */
kr_status kr_top_init(kr_top *top, const kr_scene *scene, const kr_config *config);
/* The step of a config that leads back in time, or forward. A method's own choice is 0, which only
 * leads forward: back, it begins with this. */
static inline double kr_step_directed(double step, int back)
{
    const double size = fabs(step);
    return !back ? size : size > 0.0 ? -size : -0.1;
}
/* After a failure on the way to t this makes main's own state the top's, where it is further than
 * what was asked for last, unless it is not finite in the user's units. */
kr_status kr_top_sync(kr_top *top, double t);
/* Main failed, or is not finite, since it was kept: this goes back there, and on as far as all is
 * well. It says what failed. */
kr_status kr_steps_recover(kr_top *top);
/* Moves main to grid point `goal` and gives its state there. */
kr_status kr_steps_to_grid(kr_top *top, int64_t goal, kr_state *state);
/* Moves main by one step of an adaptive method. */
kr_status kr_steps_adaptive(kr_top *top);
/* Moves main by one step of a dense method, which may pass `until`. */
kr_status kr_steps_dense(kr_top *top, double until);
/* Gives the state `span` after `from`, by a motion of its own; all in own units. */
kr_status kr_steps_off_grid(kr_top *top, const kr_state *from, double span, kr_state *end);
/* Says whether the user wants to stop. */
int kr_steps_poll(kr_top *top);
/* Keeps main as it is. */
void kr_steps_save(kr_top *top);
#endif
