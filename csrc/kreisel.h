/* kreisel: the motion of a rigid body that turns about a fixed point under gravity.
 *
 *     dm/dt = mass gravity e3 x a - D w,    dq/dt = w q / 2,    a = q com q*,    w = q J^-1 q* m
 *
 * Frames   Space has the axes e1, e2, e3, with gravity along -e3. The body has the frame in which
 *          the user described it, and the principal axes of inertia at the fixed point (N, B, T).
 *          An attitude q turns vectors of the described frame into space: v_space = q v q*. The
 *          angular momentum m is seen from space. The apex is the direction of the centre of mass
 *          from the fixed point, or T if the two are one point.
 * Units    are any consistent set; each number names its dimension in [M L T].
 * Memory   is allocated in kr_top_create and kr_worker_create only (the GSL methods, where built,
 *          let GSL allocate).
 * Errors   What can fail returns a kr_status and writes through its last argument, which stays
 *          untouched on failure.
 * Threads  There is no global state: any number of threads, one at a time on one top.
 * SPDX-License-Identifier: MIT */
#ifndef KREISEL_H
#define KREISEL_H
#include <stddef.h>
#include <stdint.h>

#define KR_VERSION "0.1.0"

#if defined KR_SHARED && defined _WIN32
#  define KR_API __declspec(dllexport)
#elif defined __GNUC__
#  define KR_API __attribute__((visibility("default")))
#else
#  define KR_API
#endif
#ifdef __cplusplus
extern "C" {
#endif

/* Statuses: X(name, what went wrong, what it says). INPUT means that nothing was run, FAILURE that
 * a run failed on its way. */
/* clang-format off */
#define KR_STATUS_LIST(X)                                                                         \
    X(OK,              NONE,      "success")                                                      \
    X(ERR_ARGUMENT,    INPUT,     "an argument is missing, not finite, or out of range")          \
    X(ERR_BODY,        INPUT,     "the body is not physical: its principal moments must "         \
                                  "be positive, none larger than the other two together")         \
    X(ERR_ATTITUDE,    INPUT,     "the attitude is not a unit quaternion")                        \
    X(ERR_TIME,        INPUT,     "a time lies behind the one before it")                         \
    X(ERR_RESOLUTION,  INPUT,     "by such a time the top turns more often than a double can "    \
                                  "tell")                                                         \
    X(ERR_METHOD,      INPUT,     "the method does not apply to this body")                       \
    X(ERR_STEP_SIZE,   INPUT,     "the step is too large for this method on this top")            \
    X(ERR_CHECKPOINT,  INPUT,     "no checkpoint of such a top: damaged, or of another version, " \
                                  "machine, scene or method")                                     \
    X(ERR_MEMORY,      MEMORY,    "out of memory")                                                \
    X(ERR_STEP,        FAILURE,   "the step fell below the resolution of time")                   \
    X(ERR_LIMIT,       FAILURE,   "the largest number of steps was reached")                      \
    X(ERR_CONVERGENCE, FAILURE,   "a step did not converge, or was too large where it began")     \
    X(ERR_NOT_FINITE,  FAILURE,   "the state stopped being finite")                               \
    X(ERR_EVENT,       FAILURE,   "the event did not come again in the time that it was given")   \
    X(ERR_TANGENT,     FAILURE,   "a tangent grew beyond what doubles hold")                      \
    X(ERR_INTERRUPTED, INTERRUPT, "interrupted")
typedef enum kr_status {
#define X(name, what, text) KR_##name,
    KR_STATUS_LIST(X)
#undef X
    KR_STATUS_COUNT
} kr_status;
/* clang-format on */
KR_API const char *kr_status_text(kr_status status);
KR_API const char *kr_version(void);

typedef struct kr_vec3 {
    double x, y, z;
} kr_vec3;
typedef struct kr_quat { /* w + x i + y j + z k */
    double w, x, y, z;
} kr_quat;

typedef struct kr_body {
    double mass;     /* [M] */
    kr_vec3 inertia; /* principal moments at the fixed point [M L^2] */
    kr_vec3 com;     /* centre of mass seen from the fixed point, along the principal axes [L] */
    kr_quat axes;    /* principal axes -> frame of description: v_described = axes v axes* */
    /* By how much, relatively, the largest moment may exceed the other two together: moments of the
     * literature are rounded, and no equation of motion minds. They are used as they are. 0 or a
     * little more, less than 1; what is less than 1e-12 counts as 1e-12. */
    double rounded;
} kr_body;

typedef struct kr_state {
    double t;  /* [T] */
    kr_quat q; /* attitude: frame of description -> space, a unit quaternion */
    kr_vec3 m; /* angular momentum about the fixed point, in space [M L^2 T^-1] */
} kr_state;

typedef struct kr_scene {
    kr_body body;
    double gravity; /* acceleration along -e3, of either sign [L T^-2] */
    kr_state start;
    /* Linear damping, as by air: the torque is -damping times the angular velocity, axis by axis
     * along the principal axes; none of them negative, 0 for none [M L^2 T^-1]. Strong damping takes
     * no more steps than the slow motion that it leaves, except back in time and with tangents. */
    kr_vec3 damping;
} kr_scene;

/* Bodies. The makers check what they are given. A diagonal inertia is its own principal frame; else
 * the principal axes nearest the frame of description are taken, right-handed, T along the symmetry
 * axis of a Lagrange top. */
/* A cuboid by its density [M L^-3], its half edges and the fixed point seen from its centre [L]. */
KR_API kr_status kr_body_cuboid(double density, kr_vec3 half, kr_vec3 pivot, kr_body *body);
/* A symmetric body with the axis T: its moments across and along it, and com's height on it. */
KR_API kr_status kr_body_symmetric(double mass, double i1, double i3, double height, kr_body *body);
/* Any body by its tensor of inertia at the fixed point, row by row [M L^2]. KR_ERR_BODY for one
 * that is not diagonal and whose least moment, below this part of the largest, is lost in
 * roundings. */
#define KR_TENSOR_LEAST 2e-10
KR_API kr_status kr_body_from_tensor(double mass, const double inertia[9], kr_vec3 com,
                                     kr_body *body);
/* Any body by its tensor of inertia about the centre of mass; pivot is the fixed point. */
KR_API kr_status kr_body_from_com(double mass, const double inertia[9], kr_vec3 com, kr_vec3 pivot,
                                  kr_body *body);
/* The same by the tensor at the fixed point, of moments that are rounded: kr_body.rounded. */
KR_API kr_status kr_body_from_rounded_tensor(double mass, const double inertia[9], kr_vec3 com,
                                             double rounded, kr_body *body);
KR_API kr_status kr_body_check(const kr_body *body);
/* Whether any body has this inertia about the fixed point, of whatever shape: less mass times lever
 * squared it is an inertia about the centre of mass, up to 1e-6 relative and what is rounded. The
 * made-up tops of the literature are none. The library moves those too and does not ask. */
KR_API int kr_body_can_be(const kr_body *body);

/* Kinds of tops: X(kind, its name). */
/* clang-format off */
#define KR_KIND_LIST(X)                                                                           \
    X(GENERAL,             "general")              /* none of these */                            \
    X(EULER,               "euler")                /* supported at its centre of mass */          \
    X(LAGRANGE,            "lagrange")             /* symmetric, com on the axis */               \
    X(KOWALEWSKI,          "kowalewski")           /* moments 2 : 2 : 1, com across the axis */   \
    X(GORYACHEV_CHAPLYGIN, "goryachev_chaplygin")  /* moments 4 : 4 : 1, com across the axis */
typedef enum kr_kind {
#define X(kind, name) KR_##kind,
    KR_KIND_LIST(X)
#undef X
    KR_KIND_COUNT
} kr_kind;
/* clang-format on */
KR_API const char *kr_kind_name(kr_kind kind);
/* What the library takes for equal when it asks itself for the kind: 32 units of the last place, as
 * much as roundings in a description make. */
#define KR_KIND_RTOL 7.2e-15
#define KR_INPUT_RTOL 1e-12 /* slack for unit quaternions, symmetric tensors, physical moments */
KR_API kr_kind kr_body_kind(const kr_body *body, double rtol);

/* The cuboid of chapter 6 of the thesis (Bodack 2008). */
KR_API kr_scene kr_scene_default(void);
KR_API kr_status kr_scene_check(const kr_scene *scene);

/* Quantities of a state: a table to read. Vectors are seen from space, those named body_... from
 * the frame in which the body was described. Euler's angles are z-x-z: turns by precession_angle
 * about e3, by nutation about the line of nodes e3 x apex, and by spin_angle about the apex carry
 * the axes of space to those of a frame that stays in the body and has the apex for its third. That
 * is the frame of description, turned to the apex the shortest way; where the apex is more than 120
 * degrees from its third axis, turned by half a turn about its first axis and from there the
 * shortest way. With the apex at a pole the turn about it is shared equally between the two angles
 * that are about one axis there. */
enum {
    KR_TURNS = 1, /* changes when the top is turned about the vertical */
    KR_KEPT = 2,  /* an integral under gravity, of every top or of one kind */
    KR_SERIES = 4 /* its components are known to events */
};
typedef struct kr_quantity kr_quantity;
KR_API size_t kr_quantity_count(void);
KR_API const kr_quantity *kr_quantity_at(size_t i);
KR_API const kr_quantity *kr_quantity_find(const char *name); /* NULL if unknown */
KR_API const char *kr_quantity_name(const kr_quantity *quantity);
KR_API const char *kr_quantity_text(const kr_quantity *quantity);      /* what it is */
KR_API const char *kr_quantity_dimension(const kr_quantity *quantity); /* "M L^2 T^-1" */
KR_API size_t kr_quantity_doubles(const kr_quantity *quantity);        /* 1, 3, 4 or 9 */
KR_API unsigned kr_quantity_flags(const kr_quantity *quantity);
/* Its values at n states, n times its doubles. */
KR_API void kr_quantity_values(const kr_quantity *quantity, const kr_scene *scene, size_t n,
                               const kr_state states[], double out[]);
/* Component i of a quantity is called by its name with this behind it: "" or "_x" and the like;
 * NULL beyond the last. */
KR_API const char *kr_quantity_axis(const kr_quantity *quantity, size_t i);
/* The number of a component of what has KR_SERIES, as "apex_z", "q_w", "spin"; KR_ONE for "1", the
 * constant; -1 if there is none. */
enum { KR_ONE = 0 };
KR_API int kr_component_find(const char *name);

/* The quantities that C programs ask for most, by functions of their own: the angular velocity
 * [T^-1], the torque of gravity [M L^2 T^-2], the apex, the principal axes N, B, T in space, the
 * apex's angle with e3 [rad], kinetic and potential energy and their sum [M L^2 T^-2], <m, e3> and
 * <m, apex> [M L^2 T^-1]. */
KR_API kr_vec3 kr_state_velocity(const kr_scene *scene, const kr_state *s);
KR_API kr_vec3 kr_state_torque(const kr_scene *scene, const kr_state *s);
KR_API kr_vec3 kr_state_apex(const kr_scene *scene, const kr_state *s);
KR_API void kr_state_frame(const kr_scene *scene, const kr_state *s, kr_vec3 frame[3]);
KR_API double kr_state_nutation(const kr_scene *scene, const kr_state *s);
KR_API double kr_state_kinetic(const kr_scene *scene, const kr_state *s);
KR_API double kr_state_potential(const kr_scene *scene, const kr_state *s);
KR_API double kr_state_energy(const kr_scene *scene, const kr_state *s);
KR_API double kr_state_vertical_momentum(const kr_scene *scene, const kr_state *s);
KR_API double kr_state_axial_momentum(const kr_scene *scene, const kr_state *s);
/* The fourth integrals (thesis 5.1, 5.2), in units of M/I1 and mass gravity |com| / I1, axis 1
 * along -com: K [T^-4], G [T^-3]. NaN for a body that has none; G is constant only while
 * <m, e3> = 0. */
KR_API double kr_state_kowalewski(const kr_scene *scene, const kr_state *s);
KR_API double kr_state_goryachev_chaplygin(const kr_scene *scene, const kr_state *s);
/* The energy that bobenko_suris keeps at this step: E + step <p x a, m> mass / 2 I1. NaN unless the
 * body is a Lagrange top. */
KR_API double kr_state_modified_energy(const kr_scene *scene, const kr_state *s, double step);
/* The energy that bobenko_suris4 keeps at this step: E up to a constant and O(step^4). NaN for
 * other bodies, and where the step is too large for the method. */
KR_API double kr_state_modified_energy4(const kr_scene *scene, const kr_state *s, double step);
/* The angle of the rotation between two attitudes, 0 .. pi [rad]. */
KR_API double kr_attitude_error(kr_quat a, kr_quat b);

/* Flags of methods: X(flag, its bit, its name, what it says of a method). */
/* clang-format off */
#define KR_FLAG_LIST(X)                                                                           \
    X(SYMPLECTIC,        1, "symplectic",     "keeps the symplectic form")                        \
    X(REVERSIBLE,        2, "reversible",     "a step back undoes a step")                        \
    X(ADAPTIVE,          4, "adaptive",       "chooses its steps by a tolerance")                 \
    X(IMPLICIT,          8, "implicit",       "solves an equation in each step")                  \
    X(ALGEBRAIC,        16, "algebraic",      "is + - * / sqrt alone: the same bits everywhere")   \
    X(ABSOLUTE,         32, "absolute",       "its tolerance is absolute in the user's time")     \
    X(DENSE,            64, "dense",          "gives the state anywhere inside its last step")    \
    X(LAGRANGE_ONLY,   128, "lagrange_only",  "for symmetric bodies, com on the axis")            \
    X(INTEGRABLE,      256, "integrable",     "for Lagrange tops, and where no torque acts")      \
    X(SYMMETRIC_ONLY,  512, "symmetric_only", "for bodies with two equal moments")                \
    X(EULER_ONLY,     1024, "euler_only",     "for bodies supported at their centre of mass")     \
    X(DIGITS,         2048, "digits",         "can give more digits than a double has")           \
    X(HEADLESS,       4096, "headless",       "can leave out the turn about the vertical")        \
    X(SPLITTING,      8192, "splitting",      "kicks and drifts in turn")                         \
    X(DAMPED,        16384, "damped",         "moves tops that are damped, too")              \
    X(TANGENTS,      32768, "tangents",       "carries derivatives of the state along")
/* clang-format on */
enum {
#define X(flag, bit, name, text) KR_##flag = bit,
    KR_FLAG_LIST(X)
#undef X
};
KR_API unsigned kr_flag_find(const char *name); /* 0 if unknown */
KR_API const char *kr_flag_name(unsigned flag); /* of one flag; NULL if there is none */
KR_API const char *kr_flag_text(unsigned flag);

/* Methods: a table to read. */
typedef struct kr_method kr_method;
KR_API size_t kr_method_count(void);
KR_API const kr_method *kr_method_at(size_t i);
KR_API const kr_method *kr_method_find(const char *name); /* NULL if unknown */
KR_API const char *kr_method_name(const kr_method *method);
KR_API const char *kr_method_text(const kr_method *method);
KR_API const char *kr_method_conserves(const kr_method *method); /* what it keeps to rounding */
KR_API const char *kr_method_reference(const kr_method *method);
KR_API int kr_method_order(const kr_method *method); /* 0: chosen on the way */
KR_API unsigned kr_method_flags(const kr_method *method);
/* Whether it can move this body under any gravity; and this scene, whose gravity may be zero. */
KR_API int kr_method_applies(const kr_method *method, const kr_body *body);
KR_API int kr_method_suits(const kr_method *method, const kr_scene *scene);

/* The time from which on, before and after 0, a double does not tell where the top is: there it has
 * turned by 2^53 rad since, at the rate of its momentum or of a pendulum, whichever is faster. No
 * top is moved there (KR_ERR_RESOLUTION). INFINITY for one at rest on which nothing pulls; 0 for
 * what is no scene [T]. */
KR_API double kr_scene_horizon(const kr_scene *scene);

/* A top in motion. A fixed-step method has one step and the grid start.t + k step; a time off the
 * grid is read by a motion of its own from the grid point before it. An adaptive method likewise
 * takes the steps that it would take anyway. So a state depends neither on what else was asked for
 * nor on how the way there was divided. */
typedef struct kr_config {
    /* An adaptive method takes it for its first step, and chooses that itself where it is 0. A
     * negative one leads back in time. The points of a grid have to be told apart: from 2^50 steps
     * before and after 0 on they are not (KR_ERR_STEP) [T]. */
    double step;
    /* Below 1. Adaptive: local error of a step; implicit: residual; 0: the method's own. */
    double tol;
    /* 0: no limit. Those that an adaptive method takes aside, to a time inside one of its steps,
     * are limited likewise, and to 1024. */
    int64_t max_steps;
    /* This is called at least every 256 steps and 1024 states, by an adaptive method in every step
     * if it is not dense; not 0 stops the top. May be NULL. */
    int (*poll)(void *context);
    void *context;
    /* For KR_DIGITS, instead of tol: 16, 20 or 30, or what these include; 0: by tol. Beside 30 a
     * tol of at most 2^-100 shortens the steps: other roundings, which tell how many digits are
     * right. */
    int digits;
    /* For KR_HEADLESS with up to 16 digits: not 0 gives states that are right up to some turn about
     * the vertical, and sooner. */
    int leave_heading;
    /* For KR_TANGENTS, with the heading: the sum of the bits of what is to be derived by. */
    uint64_t tangents;
} kr_config;
typedef struct kr_stats {
    int64_t steps, rejected, evaluations, iterations;
} kr_stats;
typedef struct kr_top kr_top;

KR_API kr_status kr_top_create(const kr_scene *scene, const kr_method *method, kr_config config,
                               kr_top **top);
KR_API void kr_top_free(kr_top *top);
/* The next four move the top; on failure it stays at the last good state, not before where it was.
 * They go to the end of the method's next step; to t; and to each of t[0], t[1], ... in the
 * direction of the step, where `done` (may be NULL) counts the states that are good, those behind
 * them stay as they were, and `low` gets what doubles leave out: out + low has as many digits as
 * were asked for, and low.t is 0. */
KR_API kr_status kr_top_step(kr_top *top);
KR_API kr_status kr_top_advance(kr_top *top, double t);
KR_API kr_status kr_top_record(kr_top *top, size_t n, const double t[], kr_state out[],
                               size_t *done);
KR_API kr_status kr_top_record_low(kr_top *top, size_t n, const double t[], kr_state out[],
                                   kr_state low[], size_t *done);
/* Makes the top the one that kr_top_create would make with this start: in units of its own, and
 * with nothing counted yet. Its events are watched on. Where it is refused, for whatever
 * kr_top_create would refuse, the top stays as it was to the last bit. */
KR_API kr_status kr_top_reset(kr_top *top, const kr_state *state);
KR_API kr_state kr_top_state(const kr_top *top);
KR_API kr_state kr_top_low(const kr_top *top); /* what kr_top_state leaves out */
KR_API kr_stats kr_top_stats(const kr_top *top);
KR_API double kr_top_time(const kr_top *top); /* how far it has come; `poll` may ask for it */
/* The instruction set in use, "" where there is no choice; and the order in use. */
KR_API const char *kr_top_kernel(const kr_top *top, int *order);

/* Tangents: the derivatives of the state, which ride along and leave it as it is to the last bit.
 * X(by, its bit, its columns, its name). A row or column of the start is a component of the
 * rotation vector by which the attitude is turned, seen from the frame of description [rad], then
 * of the momentum in space. Moments and com are those along the principal axes; the momentum stays
 * what it is, whatever parameter changes. */
/* clang-format off */
#define KR_TANGENT_LIST(X)                                                                        \
    X(START,    1, 6, "start")                                                                    \
    X(MOMENTS,  2, 3, "moments")                                                                  \
    X(COM,      4, 3, "com")                                                                      \
    X(GRAVITY,  8, 1, "gravity")                                                                  \
    X(MASS,    16, 1, "mass")
enum {
#define X(by, bit, columns, name) KR_TANGENT_##by = bit,
    KR_TANGENT_LIST(X)
#undef X
    KR_TANGENT_MOST = 14,   /* columns */
    KR_TANGENT_GROWTH = 32 /* of a worker only: one tangent a top, whose growth is told */
};
/* clang-format on */
KR_API size_t kr_tangent_columns(uint64_t tangents);
/* Gives the tangents where kr_top_state stands, 6 rows by kr_tangent_columns, and in `low`, which
 * may be NULL, what their doubles leave out. KR_ERR_ARGUMENT for a top that has none, and
 * KR_ERR_TANGENT where one has outgrown doubles. */
KR_API kr_status kr_top_tangents(kr_top *top, double out[], double low[]);
/* How far their series may be trusted: the largest last term so far, over the size of its tangent.
 * Steps are those of the path alone. */
KR_API double kr_top_tangent_rest(const kr_top *top);

/* A checkpoint: the top as it stands, in kr_top_save_size bytes. Loaded into a top that was made of
 * the same body, gravity, damping, method and config (max_steps and poll may be others), and
 * watches for the same events, it goes on from there with the same bits, to the same events; with
 * those of rounding where taylor finds another kernel (all that have fused multiply-add give the
 * same). KR_ERR_CHECKPOINT, and a top as it was, for anything else: what is damaged, of another
 * version, or of another kind of machine. */
KR_API size_t kr_top_save_size(const kr_top *top);
KR_API kr_status kr_top_save(const kr_top *top, size_t size, void *memory);
KR_API kr_status kr_top_load(kr_top *top, size_t size, const void *memory);

/* Events: where, on taylor's way, a function g of the state passes zero. It is a sum of terms,
 * factor * of * times, of components as kr_component_find numbers them. */
typedef struct kr_term {
    double factor;
    int of, times;
} kr_term;
KR_API double kr_terms_value(const kr_scene *scene, const kr_state *s, size_t n,
                             const kr_term terms[]);
/* Where the search for an event stands: memory of the top's, which its user lends. */
typedef struct kr_event_search {
    int64_t searched;  /* the step that was searched last; -1: none */
    double mark, next; /* in it the search goes on from here; the place found, as a clock */
    int side, sign;    /* of g at the mark, 0: not sure; of the change at that place, 0: none */
} kr_event_search;
/* Changes of sign count. What is below 2^-50 of the size of its terms, in the start 2^-40, cannot
 * be told from zero. */
typedef struct kr_event {
    const kr_term *terms; /* g, `count` of them */
    const kr_term *where; /* it counts only where this is positive; where_count 0: everywhere */
    size_t count, where_count;
    int extremum;        /* not 0: where g is largest or smallest, by dg/dt in place of g */
    int direction;       /* 1: where g grows with time, or is smallest; -1: otherwise; 0: both */
    kr_event_search own; /* not the user's */
} kr_event;
typedef struct kr_hit {
    ptrdiff_t which; /* index of the event; -1: none */
    int direction;   /* 1 or -1 */
} kr_hit;
/* Watches for these events, which must outlive the top or the next call; the path is the same to
 * the last bit. KR_ERR_METHOD for methods other than taylor; without the heading only for what does
 * not turn about the vertical. */
KR_API kr_status kr_top_watch(kr_top *top, size_t n, kr_event events[]);
/* Moves to the next event, or to t if that comes first. KR_ERR_STEP where an event lies in a step
 * so short that no double tells a time in it. */
KR_API kr_status kr_top_seek(kr_top *top, double t, kr_hit *hit);

/* Many tops. A worker moves any number of them by one method, one after the other or as many at
 * once as a vector has lanes, and keeps the memory for it: a thread needs one of its own. The
 * method NULL takes the closed form for the tops that have one, and taylor for all others. A top's
 * numbers depend on that top and its times alone, to the last bit: not on what else is moved, in
 * which order, in how many calls, or what of it fails. They are those of kr_exact_state, or of a
 * kr_top; only the undamped tops that taylor moves with up to 16 digits go in lanes, and have bits
 * of their own, the same on all instruction sets with fused multiply-add. */
typedef struct kr_worker kr_worker;
/* What can be kept of a number over a top's times: X(kind, its name). The variance is that of the
 * numbers there are; where_ is the first time at which the number is so. What is not a number among
 * them makes the result none. */
/* clang-format off */
#define KR_REDUCE_LIST(X)                                                                         \
    X(MIN,       "min")                                                                           \
    X(MAX,       "max")                                                                           \
    X(MEAN,      "mean")                                                                          \
    X(VARIANCE,  "variance")                                                                      \
    X(LAST,      "last")                                                                          \
    X(WHERE_MIN, "where_min")                                                                     \
    X(WHERE_MAX, "where_max")
typedef enum kr_reduce {
#define X(kind, name) KR_REDUCE_##kind,
    KR_REDUCE_LIST(X)
#undef X
    KR_REDUCE_COUNT
} kr_reduce;
/* clang-format on */
KR_API const char *kr_reduce_name(kr_reduce kind);
typedef struct kr_reduction {
    const kr_quantity *quantity;
    size_t component; /* which of its doubles */
    kr_reduce kind;
} kr_reduction;
/* How one tangent of an undamped top grows, by taylor with up to 16 digits. Its size is that in the
 * top's own units, at the start 1; the flow and the turn about the vertical, which are tangents for
 * ever, are taken out of it. All are of the way from the start: its logarithm, over the time the
 * Lyapunov exponent; the mean of MEGNO; the largest logarithm, the orthogonal indicator; and how
 * far the changes of energy and <m, e3> by it are from constant, over their sizes. */
enum {
    KR_GROWTH_LOG,
    KR_GROWTH_MEGNO,
    KR_GROWTH_MOST,
    KR_GROWTH_ENERGY,
    KR_GROWTH_MOMENTUM,
    KR_GROWTH_COUNT
};
typedef struct kr_outcome {
    kr_status status; /* what kr_top_create or kr_top_record would say */
    size_t done;      /* states that are good */
    kr_state last;    /* the last good one, which may lie behind those that were asked for */
    kr_stats stats;
} kr_outcome;
/* What is asked of a worker, and where it goes. A top moves to the side of its start on which its
 * last time lies, whatever the sign of the step. */
typedef struct kr_tops {
    size_t n;
    const kr_scene *scenes;
    size_t times;    /* of each top */
    const double *t; /* [times], or [n][times] where each has its own */
    int own_times;
    kr_state *states;     /* [n][times]; those behind `done` get NaN; may be NULL */
    double *reduced;      /* [n][reductions], NaN for a top that failed; may be NULL */
    kr_outcome *outcomes; /* [n] */
    /* With KR_TANGENT_GROWTH: [n][times][KR_GROWTH_COUNT], NaN behind `done`; may be NULL. And the
     * direction of the tangent at every start, as kr_top_tangents has a column; NULL: one along no
     * axis of anything. */
    double *growth;
    const double *direction;
} kr_tops;
/* The reductions are copied. */
KR_API kr_status kr_worker_create(const kr_method *method, kr_config config, size_t reductions,
                                  const kr_reduction reduction[], kr_worker **worker);
/* KR_OK whatever becomes of single tops, which their outcomes tell. KR_ERR_INTERRUPTED where
 * config.poll says so: tops that were not done by then have that outcome. */
KR_API kr_status kr_worker_run(kr_worker *worker, const kr_tops *tops);
/* Sections: the states in which each top meets an event (kr_top_watch), `times` of them, the first
 * ones after its start. Here t tells how long each may take to come, since the start and then since
 * the one before: a number for all tops, or [n] of them where own_times says so; negative ones lead
 * back in time. KR_ERR_EVENT is the outcome of a top whose event comes later than that. As
 * kr_worker_run otherwise, and KR_ERR_METHOD for workers of other methods than taylor. */
KR_API kr_status kr_worker_section(kr_worker *worker, const kr_event *event, const kr_tops *tops);
/* As kr_top_kernel: the instruction set of its lanes, "" where it has none, with their order. */
KR_API const char *kr_worker_kernel(const kr_worker *worker, int *order);
KR_API void kr_worker_free(kr_worker *worker);

/* The closed form: the state at any time, at once and as exact at 1e6 as at 1, of a Lagrange top
 * and of any body on which no torque acts (KR_ERR_METHOD for others, and for a heavy top whose axis
 * neither stands nor leans or moves by 1e-70 at least). It is a value, made once; to read it needs
 * no memory and cannot fail: a time that is not finite gives a state of NaN. What follows `spin` is
 * its own. */
enum { KR_THETA_TERMS = 5 };
typedef struct kr_theta {
    double even[KR_THETA_TERMS], odd[KR_THETA_TERMS];
} kr_theta;
typedef struct kr_phase {
    double fast, slow, start, more;
} kr_phase;
typedef struct kr_exact {
    double period; /* of the nutation, from lowest to lowest; INFINITY if there is none [T] */
    /* Mean rates of Euler's angles [T^-1]: of the axis about the vertical, and of the body about
     * the axis. Without torque: of the axis that circulates (the odd one of a symmetric body),
     * taken on the momentum's side, about the momentum. At a pole that the axis passes it turns by
     * half a turn either way, which counts as none. */
    double precession, spin;
    double begin;
    int curve, framed;
    kr_phase nutation, first, second;
    double stretch, stretch_rest, slope[2];
    kr_theta alpha, beta, horizontal;
    double momentum, side;
    kr_vec3 constant;
    kr_quat frame[4];
} kr_exact;
KR_API kr_status kr_exact_plan(const kr_scene *scene, kr_exact *exact);
/* From kr_scene_horizon on it is still a state with every integral, but of any attitude; or all of
 * it is NaN, where its rates are near the largest doubles, which a top of the method exact is not.
 * What leans and moves by less than 1e-75 counts as upright, and as turning about a principal
 * axis. */
KR_API kr_state kr_exact_state(const kr_exact *exact, double t);
/* Many states at once have the same bits, and come faster. */
KR_API void kr_exact_states(const kr_exact *exact, size_t n, const double t[], kr_state out[]);

/* The turning points of the apex, of Lagrange tops and of free bodies symmetric about the apex
 * (KR_ERR_METHOD for others). The course is "resting", "circle" (both free), "sleeping", "hanging",
 * "steady", "separatrix", "pendulum", "rosette" (through the vertical), "loops", "cusps", "waves".
 * The potential is what I1/2 (d nutation/dt)^2 leaves of the energy [M L^2 T^-2]. */
typedef struct kr_turning {
    double least, greatest, t_least, t_greatest; /* nutation [rad], first so, or INFINITY [T] */
    double critical_spin; /* 2 sqrt(I1 mass gravity |com|) / I3: a top sleeps beyond it [T^-1] */
    const char *course;
    double sum, difference, inertia, axial_energy, lever; /* its own */
} kr_turning;
KR_API kr_status kr_exact_turning(const kr_scene *scene, kr_turning *turning);
KR_API double kr_turning_potential(const kr_turning *turning, double nutation);

/* The k-th state of bobenko_suris, at start.t + k step, at once, k of either sign; the map's own
 * period, precession and spin are in `curve`. For Lagrange tops; KR_ERR_STEP_SIZE for starts nearer
 * than k'^2 = 1e-26 to a separatrix of the map at this step, or where a tiny step leaves
 * double-double too few digits, and KR_ERR_ARGUMENT for steps that are not within 2^-100 and 2^40
 * of the time in which the top turns by a radian. From some 2^50 turns on the state is one of any
 * attitude. */
typedef struct kr_exact_map {
    kr_exact curve;
    double step;
    kr_theta pole;
} kr_exact_map;
KR_API kr_status kr_exact_map_plan(const kr_scene *scene, double step, kr_exact_map *map);
KR_API kr_state kr_exact_map_state(const kr_exact_map *map, int64_t k);

#ifdef __cplusplus
}
#endif
#endif
