/* The internal data of a top, shared by the driver and the event search. */
#ifndef KR_TOP_H
#define KR_TOP_H
#include "method.h"
#include "model/body.h"
#include "math/su2_dd.h"

enum { KR_CHECK = 256 /* number of steps between two inspections of a fixed-step motion */ };

struct kr_top {
    /* Fields that checkpoints store, with zeros in place of pointers. Reordering these fields, or
     * the members of kr_config or kr_motion, would change the format of checkpoints. */
    kr_scene scene; /* the user's scene, with the start that was set last */
    const kr_method *method;
    kr_config config;
    kr_quat axes;         /* internal axes -> frame of description */
    int is_turned;        /* nonzero unless `axes` is the identity */
    double time_unit;     /* unit of time of the motions [T] */
    double momentum_unit; /* unit of momentum of the motions [M L^2 T^-1] */
    double forward;       /* 1, or -1 backward in time */
    kr_motion main;       /* the main motion */
    kr_motion side;       /* a motion from a point of the main motion to a requested time */
    kr_motion saved;      /* the main motion at its last inspection; not used by dense methods */
    int64_t steps;        /* steps made: the grid point of the main motion */
    int64_t saved_steps;  /* steps made when `saved` was written */
    int64_t inspect_at;   /* value of `steps` at which the main motion is inspected next */
    kr_state before;      /* adaptive, not dense: state before the last step, in internal units */
    double before_clock;  /* adaptive methods: time since the start, before the last step */
    double requested;     /* the last requested time */
    kr_state now;         /* the state at the last requested time, in the user's units */
    kr_state low;         /* the part of `now` that doubles cannot store */
    body_dd body;         /* the body in internal axes and units */
    /* Fields that checkpoints do not store. */
    double horizon;     /* requested times must be below this limit */
    kr_event *events;   /* the watched events, in the user's memory */
    size_t event_count; /* number of `events` */
    double *tangents;   /* memory of the tangents; NULL: no tangents */
    kr_vec3 apex;       /* unit vector to the centre of mass in internal axes, for events */
    int is_carried;     /* nonzero: the driver turns the states with the support */
    size_t extra;       /* number of doubles after the method's work and the tangents */
    double memory[];    /* work of the motions and tangents */
};

/* The state of the search for an event, stored in kr_event.private_. */
typedef struct kr_event_search {
    int64_t searched; /* index of the last step that was searched; -1: none */
    double mark;      /* position in this step (0 to 1) from which the search continues */
    double next;      /* time of the event found, in internal units */
    int side, sign;   /* sign of the event function at `mark`, 0: unknown; of the event, 0: none */
} kr_event_search;
typedef char kr_event_search_fits[sizeof(kr_event_search) == sizeof(double[4]) ? 1 : -1];
static inline kr_event_search kr_event_load_search(const kr_event *event)
{
    kr_event_search search;
    memcpy(&search, event->private_, sizeof search);
    return search;
}
static inline void kr_event_store_search(kr_event *event, kr_event_search search)
{
    memcpy(event->private_, &search, sizeof search);
}
/* Resets the state of an event search, as if no step had been searched yet. */
static inline void kr_event_reset_search(kr_event *event)
{
    const kr_event_search none = {.searched = -1};
    kr_event_store_search(event, none);
}

/* Returns the rotation from the internal axes (method.h) to the frame of description. */
quat_dd kr_extended_axes(const kr_top *top);
/* Conversions for more than 16 digits, from and to internal axes and units (method.h). */
struct kr_extended_ops {
    /* Sets top->body: the internal axes, and the moments, centre of mass, rotor and lever along
     * them, in double-double numbers. inertia_unit is the internal unit of moments of inertia. */
    void (*set_body)(kr_top *top, double inertia_unit);
    /* Returns the initial state `start` in internal units, with the attitude of the internal axes
     * and the momentum along these axes. `low` has the low words of `start`, or is NULL. Writes the
     * low words of the returned state to main.low. */
    kr_state (*from_user)(kr_top *top, const kr_state *start, const kr_state *low);
    /* Converts a state in place to the user's frame and units. Sets top->low to its low words. */
    void (*to_user)(kr_top *top, kr_state *state);
};

/* Returns 1 if m is finite and | |q|^2 - 1 | < 1e-6, which excludes NaN and infinity; else 0. */
static inline int kr_state_is_good(kr_quat q, kr_vec3 m)
{
    return fabs(q_dot(q, q) - 1.0) < 1e-6 && isfinite(fabs(m.x) + fabs(m.y) + fabs(m.z));
}
/* Returns the horizon for `scene`: the magnitude of requested times must be smaller. */
double kr_top_horizon_of(const kr_top *top, const kr_scene *scene);
/* Allocates a top, and memory for its motions, the tangents of `config`, and `extra` numbers. */
kr_status kr_top_alloc(const kr_method *method, const kr_config *config, size_t extra,
                       kr_top **top);
/* Stores the apex (kreisel.h) along the internal axes, for the event search. */
void kr_top_set_apex(kr_top *top);
/* Returns how many numbers of memory the tangents that `config` requests need. */
size_t kr_tangents_size(const kr_method *method, const kr_config *config);
static inline void kr_tangents_begin(kr_top *top)
{
    if (top->config.tangents) top->method->tangents->start(top);
}
/* Propagates the tangents over the last step. */
kr_status kr_tangents_advance(kr_top *top);
/* Restarts a top as if kr_top_create had made it with `scene` and `config`, but keeps its events.
 * `low` has the low words of the initial state, or is NULL. On failure, the top is unchanged. */
kr_status kr_top_init(kr_top *top, const kr_scene *scene, const kr_state *low,
                      const kr_config *config);
/* Returns |step| or, if `back` is nonzero, -|step|; -0.1 replaces -0, which has no direction. */
static inline double kr_step_directed(double step, int back)
{
    const double size = fabs(step);
    return !back ? size : size > 0.0 ? -size : -0.1;
}
/* Advances the current state to the end of the last step. Does nothing unless this end lies after
 * top->requested and not after t (in the direction of the step). */
kr_status kr_top_sync(kr_top *top, double t);
/* After a failure, sets the main motion to its last valid state, by repeating the steps from the
 * saved motion. Returns the error of the failed step, or KR_ERR_NOT_FINITE if it reported none. */
kr_status kr_steps_recover(kr_top *top);
/* Advances a top to grid point `goal`, and writes the state there to `state`. */
kr_status kr_steps_to_grid(kr_top *top, int64_t goal, kr_state *state);
/* Advances a top by one step of an adaptive method. */
kr_status kr_steps_adaptive(kr_top *top);
/* Advances a top by one step of a method with dense output, which may end after `until`. */
kr_status kr_steps_dense(kr_top *top, double until);
/* Writes to `end` the state that follows `from` after a time `span`, all in internal units. */
kr_status kr_steps_off_grid(kr_top *top, const kr_state *from, double span, kr_state *end);
/* Calls the user's `poll`, if any. Returns nonzero if the computation must stop. */
int kr_steps_poll(kr_top *top);
/* Saves the motion for recovery after a failure. */
void kr_steps_save(kr_top *top);
/* Returns the time from the start to the user's time t, in internal units. */
static inline double internal_time(const kr_top *top, double t)
{
    return (t - top->scene.start.t) / top->time_unit;
}
/* Writes the state at the user's time t, in internal axes and units, by dense output. The time t
 * lies within the last step. With more than 16 digits, main.low receives the low words. */
static inline void kr_top_evaluate(kr_top *top, double t, kr_state *state)
{
    top->main.low.t = two_sum(t, -top->scene.start.t).lo / top->time_unit;
    top->method->at(&top->main, internal_time(top, t), state);
}
#endif
