/* kreisel: motion of a rigid body that turns about a fixed point under gravity.
 *     kr_scene scene = kr_scene_default();
 *     kr_top *top = NULL;
 *     kr_body_symmetric(1.0, 1.3, 0.3, 1.0, &scene.body);
 *     kr_scene_set_spinning(&scene, 10.0, 0.5, 0.0);
 *     kr_status status = kr_top_create(&scene, &kr_method_taylor, kr_config_default(), &top);
 *     for (int i = 1; i <= 100 && status == KR_OK; i++) {
 *         status = kr_top_advance(top, 0.1 * i);
 *         const kr_state state = kr_top_state(top);
 *         printf("%4.1f  %.15f\n", state.t, kr_state_nutation(&scene, &state));
 *     }
 *     if (status != KR_OK) puts(kr_status_text(status));
 *     kr_top_free(top);
 * The functions of this example are those that every program needs.
 *
 * Motion:  dm/dt = mass g e3 x a - D (w - turning) - turning x m + dry friction,   a = q com q*
 *          dq/dt = (w - turning) q / 2,   m = J w + rotor,   g = gravity - A r^2 cos(r t + phase)
 *          with inertial angular velocity w, inertia J and damping D (tensors in space), and A, r
 *          and phase of kr_shaking; a gravity gradient adds gradient * e3 x J e3 to dm/dt.
 * Frames:  The space axes e1, e2 and e3 rotate with the support; gravity acts along -e3. The body
 *          has two frames: the frame of description, in which the user describes it, and the
 *          principal axes at the fixed point (N, B, T). The attitude q rotates vectors from the
 *          frame of description into space: v_space = q v q*. The angular momentum m has components
 *          along e1, e2, e3. The apex is the direction from the fixed point to the centre of mass
 *          (com), or T if these points coincide.
 * Units:   Any consistent units can be used. Dimensions are given in brackets, as powers of mass M,
 *          length L and time T.
 * Memory:  Only kr_top_create, kr_worker_create and the methods in gsl/gsl.c allocate memory.
 * Errors:  A function that can fail returns a kr_status and writes its results through its last
 *          arguments. On failure, it writes no results, unless its comment says otherwise.
 * Threads: There is no global state. Only one thread at a time can use a given top.
 * SPDX-License-Identifier: MIT */
#ifndef KREISEL_H
#define KREISEL_H
#include <stddef.h>
#include <stdint.h>

/* The version, as a string and as numbers for #if. */
#define KR_VERSION "0.1.0"
#define KR_VERSION_MAJOR 0
#define KR_VERSION_MINOR 1
#define KR_VERSION_PATCH 0
#define KR_VERSION_NUMBER (10000 * KR_VERSION_MAJOR + 100 * KR_VERSION_MINOR + KR_VERSION_PATCH)

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

/* Statuses: X(name, category, text). INPUT: invalid arguments. FAILURE: a run failed. */
/* clang-format off */
#define KR_STATUS_LIST(X)                                                                         \
    X(OK,              NONE,      "success")                                                      \
    X(ERR_ARGUMENT,    INPUT,     "an argument is missing, not finite, or out of range")          \
    X(ERR_BODY,        INPUT,     "the body is not physical: its principal moments must "         \
                                  "be positive, none larger than the other two together")         \
    X(ERR_ATTITUDE,    INPUT,     "the attitude is not a unit quaternion")                        \
    X(ERR_TIME,        INPUT,     "a time lies before the previous one in the direction of time") \
    X(ERR_RESOLUTION,  INPUT,     "up to this time the top makes more turns than a double can "   \
                                  "resolve")                                                      \
    X(ERR_METHOD,      INPUT,     "the method does not apply to this body")                       \
    X(ERR_STEP_SIZE,   INPUT,     "the step is too large for this method on this top")            \
    X(ERR_CHECKPOINT,  INPUT,     "the checkpoint is damaged, or belongs to another version, "    \
                                  "machine, scene or method")                                     \
    X(ERR_MEMORY,      MEMORY,    "out of memory")                                                \
    X(ERR_STEP,        FAILURE,   "the step fell below the resolution of time")                   \
    X(ERR_LIMIT,       FAILURE,   "the largest number of steps was reached")                      \
    X(ERR_CONVERGENCE, FAILURE,   "a step did not converge, or was too large for its state")      \
    X(ERR_NOT_FINITE,  FAILURE,   "the state is no longer finite")                                \
    X(ERR_EVENT,       FAILURE,   "the event did not occur within the time limit")                \
    X(ERR_TANGENT,     FAILURE,   "a tangent exceeded the range of doubles, or grew too fast for " \
                                  "its series")                                                   \
    X(ERR_INTERRUPTED, INTERRUPT, "interrupted")                                                  \
    X(ERR_NO_METHOD,   INPUT,     "the method is NULL, which is what kr_method_find returns "     \
                                  "for an unknown name")                                          \
    X(ERR_NO_STEP,     INPUT,     "there is no step: a fixed-step method needs one")              \
    X(ERR_NOT_BUILT,   INPUT,     "this build does not include the method, more than 16 digits, " \
                                  "tangents, or moving supports and friction")                    \
    X(ERR_DAMPING,     INPUT,     "the method does not apply to damped tops")                     \
    X(ERR_OPTION,      INPUT,     "the method does not support the requested digits, tangents or " \
                                  "skip_heading, or not in this combination")                     \
    X(ERR_NO_EVENTS,   INPUT,     "the method does not find events; taylor does")                 \
    X(ERR_ROTOR,       INPUT,     "the method does not apply to this body with a rotor")          \
    X(ERR_TURNING,     INPUT,     "the method does not apply to a support that turns in this way") \
    X(ERR_SHAKING,     INPUT,     "the method does not apply to shaken supports")                 \
    X(ERR_FRICTION,    INPUT,     "the method does not apply to tops with dry friction")          \
    X(ERR_STOPPED,     FAILURE,   "the motion before dry friction stopped the spin is not unique") \
    X(ERR_WHEEL,       INPUT,     "damping or friction acts on a body in which nothing but a "    \
                                  "free wheel turns about its axle")                              \
    X(ERR_GRADIENT,    INPUT,     "the method does not apply to bodies in a gravity gradient")    \
    X(ERR_COMBINATION, INPUT,     "a gravity gradient excludes a shaken support, and wheels on "  \
                                  "free axles")
typedef enum kr_status {
#define KR_X_(name, what, text) KR_##name,
    KR_STATUS_LIST(KR_X_)
#undef KR_X_
    KR_STATUS_COUNT
} kr_status;
/* clang-format on */

typedef struct kr_vec3 {
    double x, y, z;
} kr_vec3;
typedef struct kr_quat { /* w + x i + y j + z k */
    double w, x, y, z;
} kr_quat;

/* The arguments of kr_body_from_tensor (for tensors that are not diagonal) and kr_body_set_rotor,
 * in the frame of description; else zero. Motions with more than 16 digits use them instead of the
 * rounded numbers of kr_body, unless a program has since changed numbers of kr_body. */
typedef struct kr_given {
    double inertia[9]; /* three rows [M L^2] */
    kr_vec3 com, rotor;
} kr_given;
typedef struct kr_body {
    double mass;     /* [M] */
    kr_vec3 inertia; /* principal moments at the fixed point [M L^2] */
    kr_vec3 com;     /* centre of mass relative to the fixed point, along the principal axes [L] */
    kr_quat axes;    /* principal axes -> frame of description: v_described = axes v axes* */
    /* A tolerance in [0, 1) for rounded values from the literature: the largest moment may exceed
     * the sum of the other two by the fraction max(rounded, 1e-12) of this sum. */
    double rounded;
    /* Momentum of rotors relative to the body (a gyrostat), kept constant by motors, along the
     * principal axes [M L^2 T^-1]. The momentum m of a state includes it. `inertia` includes the
     * rotors as if they were locked. For a wheel without a motor, see kr_scene_release_wheel. */
    kr_vec3 rotor;
    kr_given given;
} kr_body;

typedef struct kr_state {
    double t;  /* [T] */
    kr_quat q; /* attitude: frame of description -> space, a unit quaternion */
    kr_vec3 m; /* angular momentum in the inertial frame, along e1, e2, e3 [M L^2 T^-1] */
} kr_state;
/* The fixed point moves along e3 by amplitude * cos(rate * t + phase). */
typedef struct kr_shaking {
    double amplitude, rate, phase; /* [L], of any sign; [T^-1], positive if it shakes; [rad] */
} kr_shaking;
/* A wheel on a free axle (kr_scene_release_wheel). Unless `axis` is 0, its momentum about the axle,
 * in the inertial frame, is constant and a part of kr_body.rotor, and its moment is no part of
 * kr_body.inertia. kr_wheel affects only quantities such as wheel_rate. All zero: no wheel. */
typedef struct kr_wheel {
    kr_vec3 axis; /* unit vector along the principal axes; 0: `rate` is relative to the body */
    double rate;  /* angular velocity in the inertial frame, about the axis [T^-1] */
} kr_wheel;
enum { KR_WHEELS_MAX = 3 };

typedef struct kr_scene {
    kr_body body;
    double gravity; /* acceleration along -e3, of either sign [L T^-2] */
    kr_state start;
    /* Linear damping, not negative, as by air that turns with the support [M L^2 T^-1]: the torque
     * along each principal axis is -damping * angular velocity relative to the support. With strong
     * damping, steps do not resolve its decay times, except if tangents are computed. */
    kr_vec3 damping;
    /* Constant angular velocity of the support, along e1, e2, e3 [T^-1]. All states and quantities
     * are relative to the support, except for the momentum m (kr_state). */
    kr_vec3 turning;
    kr_shaking shaking;
    /* Dry friction, not negative: a torque of this constant size about the apex, against the spin
     * about it [M L^2 T^-2]. A spin of 0 remains 0 while the torque needed to hold it is less. */
    double friction;
    kr_wheel wheels[KR_WHEELS_MAX];
    /* Gravity gradient, of either sign [T^-2], which causes the torque gradient * e3 x J e3: 3 mu /
     * R^3 at the distance R along e3 from a body with gravitational parameter mu. On a circular
     * orbit, `turning` is the orbital rate. KR_ERR_COMBINATION with shaking or with a wheel whose
     * kr_wheel.axis is not 0. */
    double gradient;
} kr_scene;

/* Methods. A program linked statically contains the methods that it names, or all methods if it
 * calls kr_method_at or kr_method_find. */
typedef struct kr_method kr_method;
extern KR_API const kr_method kr_method_exact, kr_method_bobenko_suris, kr_method_bobenko_suris2,
    kr_method_bobenko_suris4, kr_method_strang, kr_method_takahashi_imada4, kr_method_suzuki4,
    kr_method_blanes_moan6, kr_method_kahan_li6, kr_method_kahan_li8, kr_method_veselov2,
    kr_method_veselov4, kr_method_hirota_kimura, kr_method_implicit_midpoint, kr_method_rk4,
    kr_method_extrap, kr_method_taylor, kr_method_extrap_kirchhoff;

/* A moving top. A fixed-step method computes states at the grid points start.t + k * step, and
 * states at other times by a separate step from the previous grid point. An adaptive method chooses
 * its steps regardless of the requested times. No state depends on the other requested times. */
typedef struct kr_top kr_top;
typedef struct kr_config {
    /* The step size [T]; its sign is the direction of time. For an adaptive method, it is the first
     * step, or 0: automatic. Fixed-step methods refuse |t| >= 2^50 * |step| (KR_ERR_STEP). */
    double step;
    /* Tolerance below 1, or 0 for the default. Bounds the local error (adaptive methods), the
     * residual (implicit methods) or kr_exact_info.certificate (exact: at most KR_EXACT_BOUND). */
    double tol;
    /* Maximum number of steps since start.t (in all calls), or 0: no limit. Not counted: up to 1024
     * (max_steps, if > 0 and less) per requested time in adaptive methods without dense output. */
    int64_t max_steps;
    /* NULL, or a function called at least every 256 steps and 1024 states (workers: 2^16 states),
     * and in every step of adaptive methods without dense output. It returns nonzero to stop. */
    int (*poll)(void *context);
    void *context;
    /* Number of digits, for methods with KR_METHOD_DIGITS: 0 (accuracy `tol`), or 1 to 30, rounded
     * up to 16, 20 or 30. With 16 or 20, tol must be 0. With 30, tol may be up to 2^-100; a smaller
     * tol shortens steps, and comparing two runs shows how many digits are correct. */
    int digits;
    /* For methods with KR_METHOD_SKIPS_HEADING and up to 16 digits: if nonzero, states are computed
     * only up to a rotation about e3, at lower cost. On rotating supports, kr_top_create returns
     * KR_ERR_OPTION, and workers ignore this member. */
    int skip_heading;
    /* For methods with KR_METHOD_TANGENTS, if skip_heading is 0: the sum of the KR_TANGENT_...
     * flags of the derivatives to compute. KR_ERR_OPTION if a derivative does not exist: by
     * friction if friction is 0, and by com if com is 0 and friction is not. */
    uint64_t tangents;
} kr_config;

KR_API const char *kr_status_text(kr_status status);
/* Returns the default scene: the cuboid of chapter 6 of the thesis (Bodack 2008), gravity 1. */
KR_API kr_scene kr_scene_default(void);
/* Makes a body with the symmetry axis T. The moments [M L^2] at the fixed point are i3 about T and
 * i1 about axes normal to T. `height` is the coordinate of the centre of mass along T [L]. */
KR_API kr_status kr_body_symmetric(double mass, double i1, double i3, double height, kr_body *body);
/* Sets attitude and momentum of a symmetric top from its spin about the apex [T^-1], the angle
 * `tilt` (0 .. pi) by which the apex is turned from e3 about e1, and the initial rate of precession
 * about e3 [T^-1]. Returns KR_ERR_ARGUMENT for other tilts, and for bodies without symmetry. */
KR_API kr_status kr_scene_set_spinning(kr_scene *scene, double spin, double tilt,
                                       double precession);
/* Returns the default configuration (all zeros). Fixed-step methods require a nonzero step. */
KR_API kr_config kr_config_default(void);
/* Allocates a top in the initial state of the scene. Free it with kr_top_free. */
KR_API kr_status kr_top_create(const kr_scene *scene, const kr_method *method, kr_config config,
                               kr_top **top);
/* Advances the top to time t [T]. On failure, the top keeps the last valid state before t. */
KR_API kr_status kr_top_advance(kr_top *top, double t);
/* Returns the current state. */
KR_API kr_state kr_top_state(const kr_top *top);
/* Returns the angle between the apex and e3 [rad], one of the quantities below. */
KR_API double kr_state_nutation(const kr_scene *scene, const kr_state *s);
/* Frees a top; NULL is ignored. */
KR_API void kr_top_free(kr_top *top);

/* Advances the top to the end of the next step. On failure, the top keeps its last valid state. */
KR_API kr_status kr_top_step(kr_top *top);
/* Advances the top to the times t[0], t[1], ... in the direction of the step. Writes the states to
 * `out` and their digits beyond double precision to `low`: out[i] + low[i] has the requested digits
 * (low[i].t is 0). Writes the number of valid states to `done`; later elements of `out` and `low`
 * are unchanged. `low` and `done` may be NULL. On failure, the top keeps its last valid state. */
KR_API kr_status kr_top_record(kr_top *top, size_t n, const double t[], kr_state out[],
                               kr_state low[], size_t *done);
/* Restarts the top, as if kr_top_create had been called with this initial state, but keeps the
 * events set by kr_top_watch. On failure, the top is unchanged. */
KR_API kr_status kr_top_reset(kr_top *top, const kr_state *state);
/* Restarts the top with another scene, and resets the time grid and the tangents. To push a moving
 * top, set scene->start to kr_top_state(top) with another momentum. `low` is NULL, or holds the
 * digits of scene->start beyond double precision (start + low rounds to start, low->t is 0). For
 * the method exact, returns KR_ERR_MEMORY if kr_top_create did not allocate enough. */
KR_API kr_status kr_top_set_scene(kr_top *top, const kr_scene *scene, const kr_state *low);
typedef struct kr_stats {
    int64_t steps, rejected, evaluations, iterations;
} kr_stats;
typedef struct kr_top_info {
    kr_state low;   /* digits of the current state beyond double precision; low.t is 0 */
    kr_stats stats; /* since the initial state */
    double time;    /* the time that the steps have reached [T] */
    /* An estimate of the relative truncation error of the tangents: the largest ratio so far of the
     * last Taylor term to the norm of a tangent; 0 without tangents. */
    double truncation;
    const char *kernel; /* the instruction set, for the method taylor; else "" */
    int order;          /* of the method */
} kr_top_info;
/* Returns the numbers above for the current state. kr_config.poll may call this function. */
KR_API kr_top_info kr_top_describe(const kr_top *top);
/* Returns KR_OK if the scene is valid, else the status that describes the error. */
KR_API kr_status kr_scene_check(const kr_scene *scene);
/* Returns the horizon [T], an upper bound on |t| for which doubles resolve the attitude: 2^53 rad
 * divided by the largest of these rates: the components of the initial angular velocity, (|m| +
 * |rotor|) / I, sqrt(mass |gravity| |com| / I) with the largest moment I, and the rates of the
 * support. INFINITY if all are 0; 0 for an invalid scene. Greater |t| are refused
 * (KR_ERR_RESOLUTION). Backward in time, damping accelerates the top and may lower the bound. */
KR_API double kr_scene_horizon(const kr_scene *scene);
KR_API const char *kr_version(void);

/* Bodies. The constructors return KR_ERR_ARGUMENT or KR_ERR_BODY for invalid arguments. If the
 * inertia tensor is diagonal, the principal axes are the axes of the frame of description. Else,
 * they are right-handed and nearest to that frame, but T is the symmetry axis of a Lagrange top. */

/* Homogeneous shapes and their sizes [L], none negative. Tubes and cones have the axis (0, 0, 1). A
 * tube {0, r, h} is a cylinder, {0, r, 0} a disk, {r, r, 0} a hoop, and {0, 0, h} a rod. */
typedef enum kr_shape {
    KR_SHAPE_CUBOID,    /* three half-edges */
    KR_SHAPE_ELLIPSOID, /* three semi-axes */
    KR_SHAPE_TUBE,      /* inner radius, outer radius, height */
    KR_SHAPE_SHELL,     /* radius of a thin sphere */
    KR_SHAPE_CONE       /* radius, height of the base above the tip */
} kr_shape;
/* Makes a homogeneous body whose fixed point is `pivot`, relative to the centre of the shape or to
 * the tip of a cone [L]. Returns KR_ERR_BODY for a rod if `pivot` lies on its line. */
KR_API kr_status kr_body_shape(kr_shape shape, kr_vec3 size, double mass, kr_vec3 pivot,
                               kr_body *body);
/* Returns the mass of a shape with this density [M L^-3], which is 0 for thin shapes. */
KR_API double kr_shape_mass(kr_shape shape, kr_vec3 size, double density);
/* Returns the principal moments about the centre of mass [M L^2]. Writes the height of the centre
 * of mass above the tip of a cone [L], or 0 for another shape. */
KR_API kr_vec3 kr_shape_inertia(kr_shape shape, kr_vec3 size, double mass, double *height);
/* Smallest permitted ratio of the smallest to the largest principal moment of a tensor that is not
 * diagonal. With a smaller ratio, the smallest moment would have too few correct digits. */
#define KR_TENSOR_MIN_RATIO 2e-10
/* Makes a body from its inertia tensor at the fixed point (three rows [M L^2]) and com [L] in the
 * frame of description. Returns KR_ERR_BODY if the tensor violates KR_TENSOR_MIN_RATIO. */
KR_API kr_status kr_body_from_tensor(double mass, const double inertia[9], kr_vec3 com,
                                     double rounded, kr_body *body);
/* Adds the inertia of a point mass to a tensor stored by rows. With the mass and com of a body,
 * this changes the tensor about com to the tensor about the fixed point (Steiner's theorem). */
KR_API void kr_inertia_add_point(double inertia[9], double mass, kr_vec3 position);
/* Sets kr_body.rotor from a momentum in the frame of description [M L^2 T^-1]. */
KR_API void kr_body_set_rotor(kr_body *body, kr_vec3 rotor);
/* Returns 1 if some distribution of mass has this inertia, mass and com up to the relative error
 * 1e-6 + kr_body.rounded, else 0. Other functions require only valid moments (kr_body.rounded). */
KR_API int kr_body_is_physical(const kr_body *body);

/* The kinds (integrable cases) of tops, listed as X(kind, name). */
/* clang-format off */
#define KR_KIND_LIST(X)                                                                           \
    X(GENERAL,             "general")             /* also rotors off the axis of symmetry */      \
    X(EULER,               "euler")               /* supported at its centre of mass */           \
    X(LAGRANGE,            "lagrange")            /* symmetric, com on the axis */                \
    X(KOWALEWSKI,          "kowalewski")          /* moments 2 : 2 : 1, com normal to the axis */ \
    X(GORYACHEV_CHAPLYGIN, "goryachev_chaplygin") /* moments 4 : 4 : 1, com normal to the axis */ \
    X(GYROSTAT,            "gyrostat")            /* like euler, rotor off the axis of symmetry */
typedef enum kr_kind {
#define KR_X_(kind, name) KR_KIND_##kind,
    KR_KIND_LIST(KR_X_)
#undef KR_X_
    KR_KIND_COUNT
} kr_kind;
/* clang-format on */
KR_API const char *kr_kind_name(kr_kind kind);
/* Relative tolerance for integrable cases: 32 units in the last place, for rounded moments. */
#define KR_KIND_RTOL 7.2e-15
#define KR_INPUT_RTOL 1e-12 /* tolerance for unit quaternions, symmetric tensors and moments */
/* Returns the integrable case of a body; `rtol` is the relative tolerance of comparisons. */
KR_API kr_kind kr_body_kind(const kr_body *body, double rtol);
/* Returns 1 if the body is symmetric about its apex, up to KR_KIND_RTOL, else 0. Writes its moments
 * normal to the apex and about it [M L^2], which are meaningful if the result is 1. */
KR_API int kr_body_symmetry(const kr_body *body, double *across, double *along);

/* The next functions set the initial state of a scene. Set its body and support before, and for the
 * first three functions also its attitude. NaN and infinity give an invalid scene. */

/* Set the momentum from the angular velocity relative to the support, in space or in the body. */
KR_API void kr_scene_set_velocity(kr_scene *scene, kr_vec3 velocity);
KR_API void kr_scene_set_body_velocity(kr_scene *scene, kr_vec3 velocity);
/* Sets the momentum from its components in the frame of description (a body frame). */
KR_API void kr_scene_set_body_momentum(kr_scene *scene, kr_vec3 momentum);
/* Sets attitude and momentum from the Euler angles precession_angle, nutation and spin_angle [rad]
 * (see kr_quantity) and their rates relative to the support [T^-1], each in this order. */
KR_API void kr_scene_set_euler(kr_scene *scene, kr_vec3 angles, kr_vec3 rates);
/* Lets a wheel with the moment `inertia` [M L^2] about its axle turn freely from the initial time
 * on. `rate` [T^-1] is relative to the body. Before, the wheel's momentum inertia * rate along
 * `axis` (in the frame of description, of any length) must be part of body.rotor, and its moment
 * part of body.inertia. Changes the inertia, its principal axes and the rotor of the body. If the
 * wheel has all the moment of the body about the axle, it keeps its rate relative to the body, and
 * damping and friction give KR_ERR_WHEEL. Returns KR_ERR_BODY if the body cannot contain the wheel,
 * and KR_ERR_ARGUMENT for other invalid arguments or more than KR_WHEELS_MAX wheels. */
KR_API kr_status kr_scene_release_wheel(kr_scene *scene, double inertia, kr_vec3 axis, double rate);
/* Writes the slower rate of steady precession about e3 [T^-1] or, if `fast` is nonzero, the faster;
 * 0 for a vertical apex. The top is symmetric, with spin and tilt as in kr_scene_set_spinning.
 * Rotor, damping, friction and support motion are ignored. If there is no steady precession,
 * returns KR_ERR_ARGUMENT, and *least_spin is the least |spin| that permits one, or 0 if none. */
KR_API kr_status kr_scene_steady_precession(const kr_scene *scene, double spin, double tilt,
                                            int fast, double *precession, double *least_spin);

/* The flags of methods, listed as X(flag, bit, name, description). */
/* clang-format off */
#define KR_FLAG_LIST(X)                                                                           \
    X(SYMPLECTIC,        1, "symplectic",     "conserves the symplectic form")                    \
    X(REVERSIBLE,        2, "reversible",     "a step backwards undoes a step")                   \
    X(ADAPTIVE,          4, "adaptive",       "adapts its steps to a tolerance")                  \
    X(IMPLICIT,          8, "implicit",       "solves an equation in each step")                  \
    X(ALGEBRAIC,        16, "algebraic",      "uses + - * / sqrt only: the same bits everywhere") \
    X(ABSOLUTE,         32, "absolute",       "its tolerance is absolute in the user's time")     \
    X(DENSE,            64, "dense",          "evaluates the state anywhere in its last step")    \
    X(LAGRANGE_ONLY,   128, "lagrange_only",  "for symmetric bodies, com on the axis")            \
    X(INTEGRABLE,      256, "integrable",     "for the integrable tops and free bodies")          \
    X(SYMMETRIC_ONLY,  512, "symmetric_only", "for bodies with two equal moments")                \
    X(EULER_ONLY,     1024, "euler_only",     "for bodies supported at their centre of mass")     \
    X(DIGITS,         2048, "digits",         "can compute more digits than a double has")        \
    X(SKIPS_HEADING,  4096, "skips_heading",  "can skip the rotation about the vertical")         \
    X(SPLITTING,      8192, "splitting",      "alternates kicks and drifts")                      \
    X(DAMPED,        16384, "damped",         "applies to damped tops")                           \
    X(TANGENTS,      32768, "tangents",       "computes derivatives of the state")                \
    X(ROTORS,        65536, "rotors",         "applies to bodies with rotors")                    \
    X(TURNING,      131072, "turning",        "applies to supports that turn about any axis")     \
    X(SHAKING,      262144, "shaking",        "applies to shaken supports")                       \
    X(FRICTION,     524288, "friction",       "applies to tops with dry friction")                \
    X(GRADIENT,    1048576, "gradient",       "applies to bodies in a gravity gradient")
/* clang-format on */
enum {
#define KR_X_(flag, bit, name, text) KR_METHOD_##flag = bit,
    KR_FLAG_LIST(KR_X_)
#undef KR_X_
};

/* Return the method with an index or a name, or NULL. This build may omit it (KR_ERR_NOT_BUILT). */
KR_API const kr_method *kr_method_at(size_t i);
KR_API const kr_method *kr_method_find(const char *name);
typedef struct kr_method_info {
    /* Its name, what it is, the integrals that it conserves up to rounding, and its source. */
    const char *name, *text, *conserves, *reference;
    int order;      /* 0: the method has no fixed order */
    unsigned flags; /* the sum of its KR_METHOD_... flags */
} kr_method_info;
KR_API kr_method_info kr_method_describe(const kr_method *method);
/* Return 1 if a method applies to a body for all values of gravity, or to a scene, else 0. */
KR_API int kr_method_applies(const kr_method *method, const kr_body *body);
KR_API int kr_method_suits(const kr_method *method, const kr_scene *scene);

/* Physical quantities of a state. Vectors refer to the space frame, or to the frame of description
 * if their name begins with body_. Euler angles (z-x-z) rotate the space axes into a body-fixed
 * frame: by precession_angle about e3, by nutation about the line of nodes e3 x apex, and by
 * spin_angle about the apex. This frame is the frame of description, turned by 180 degrees about
 * axis 1 if axis 3 is over 120 degrees from the apex, then by the smallest angle that takes axis 3
 * to the apex. At a vertical apex, precession_angle and spin_angle are equal up to sign. */
enum {
    KR_QUANTITY_TURNS = 1,     /* changes when the top is rotated about the vertical */
    KR_QUANTITY_CONSERVED = 2, /* an integral of the motion, for all tops or for one kind */
    KR_QUANTITY_IN_EVENTS = 4  /* its components can appear in events */
};
typedef struct kr_quantity {
    const char *name, *text; /* such as "nutation"; a description */
    const char *dimension;   /* "rad", "rad/T" or "rad/T^2" for angles, else such as "M L^2 T^-1" */
    const char *const *suffixes; /* of the names of its numbers, such as "" or "_x": [doubles] */
    size_t doubles;              /* in a value: 1, 3, 4 or 9 */
    unsigned flags;              /* a sum of KR_QUANTITY_... */
} kr_quantity;
/* Return the quantity with an index or a name, or NULL. */
KR_API const kr_quantity *kr_quantity_at(size_t i);
KR_API const kr_quantity *kr_quantity_find(const char *name);
/* Writes the values of a quantity at n states: n * quantity->doubles numbers. */
KR_API void kr_quantity_values(const kr_quantity *quantity, const kr_scene *scene, size_t n,
                               const kr_state states[], double out[]);
/* Return quantities of one state: angular velocity relative to the support [T^-1], apex, and
 * kinetic plus potential energy [M L^2 T^-2]. On a rotating support, this energy is the Jacobi
 * integral: the energy in space minus <turning, m>. */
KR_API kr_vec3 kr_state_velocity(const kr_scene *scene, const kr_state *s);
KR_API kr_vec3 kr_state_apex(const kr_scene *scene, const kr_state *s);
KR_API double kr_state_energy(const kr_scene *scene, const kr_state *s);
/* Returns the modified energy [M L^2 T^-2] that a map conserves. With the energy E and the moment
 * I1 normal to the apex, it is E + step * <torque, m> / (2 I1) for bobenko_suris (order 1), and E +
 * O(step^4) up to a constant for bobenko_suris4 (order 4). NaN if the step is too large (order 4),
 * or the body is not a Lagrange top, or has rotor, shaking or gradient. */
KR_API double kr_state_modified_energy(const kr_scene *scene, const kr_state *s, double step,
                                       int order);
/* Returns the angle of the rotation between two attitudes, 0 .. pi [rad]. */
KR_API double kr_attitude_error(kr_quat a, kr_quat b);

/* Events, for the method taylor: times at which a function g of the state crosses zero. g is a sum
 * of terms factor * first * second, where first and second are components of quantities. */
enum { KR_COMPONENT_ONE = 0 }; /* the constant component "1" */
/* Returns the index of a component, such as "apex_z", "q_w" or "spin"; -1: not for events. */
KR_API int kr_component_find(const char *name);
typedef struct kr_term {
    double factor;
    int first, second;
} kr_term;
/* Returns the sum of n terms at a state. */
KR_API double kr_terms_value(const kr_scene *scene, const kr_state *s, size_t n,
                             const kr_term terms[]);
/* g is the sum of `terms`. If it is a multiple of the spin, an event also occurs when friction
 * stops the spin, but none when the top slides again. Let B be an upper bound of |g| in a step. |g|
 * < 2^-50 B (before a first sign of g is known, 2^-40 B) counts as zero. */
typedef struct kr_event {
    const kr_term *terms;     /* the `count` terms of g */
    const kr_term *condition; /* must be positive at the event; condition_count 0: no condition */
    size_t count, condition_count;
    int extremum;       /* nonzero: extrema of g (zeros of dg/dt) instead of zeros of g */
    int direction;      /* 1: g rises, or has a minimum; -1: falls, or has a maximum; 0: both */
    double private_[4]; /* the state of the search */
} kr_event;
typedef struct kr_event_hit {
    ptrdiff_t index; /* index of the event; -1: none */
    int direction;   /* 1 or -1 */
} kr_event_hit;
/* Sets the events at which kr_top_seek stops. Events do not affect the states. `events` must stay
 * valid until the next kr_top_watch or kr_top_free. Returns KR_ERR_NO_EVENTS unless the method is
 * taylor, and KR_ERR_ARGUMENT if skip_heading is set and a term depends on the heading. */
KR_API kr_status kr_top_watch(kr_top *top, size_t n, kr_event events[]);
/* Advances the top to the next event, or to t if t comes first (hit->index is then -1). Returns
 * KR_ERR_STEP if an event lies in a step that is shorter than doubles can resolve. */
KR_API kr_status kr_top_seek(kr_top *top, double t, kr_event_hit *hit);

/* Groups of tangents (derivatives of the state), listed as X(parameter, bit, columns, name).
 * Computing tangents changes no state, unless damping is strong. Rows 1 to 3 are the rotation
 * vector of the attitude in the frame of description [rad], rows 4 to 6 the momentum in space.
 * Columns of START are derivatives by the same six numbers of the initial state, others by
 * parameters at a fixed initial state. Moments, com, damping, rotor: along the principal axes. */
/* clang-format off */
#define KR_TANGENT_LIST(X)                                                                        \
    X(START,    1, 6, "start")                                                                    \
    X(MOMENTS,  2, 3, "moments")                                                                  \
    X(COM,      4, 3, "com")                                                                      \
    X(GRAVITY,  8, 1, "gravity")                                                                  \
    X(MASS,    16, 1, "mass")                                                                     \
    X(DAMPING, 32, 3, "damping")                                                                  \
    X(ROTOR,   128, 3, "rotor")                                                                   \
    X(TURNING, 256, 3, "turning")                                                                 \
    X(SHAKING, 512, 3, "shaking")  /* amplitude, rate, phase */                                   \
    X(FRICTION, 1024, 1, "friction")                                                              \
    X(GRADIENT, 2048, 1, "gradient")
enum {
#define KR_X_(by, bit, columns, name) KR_TANGENT_##by = bit,
    KR_TANGENT_LIST(KR_X_)
#undef KR_X_
    KR_TANGENT_COLUMNS_MAX = 28,
    KR_TANGENT_GROWTH = 64 /* workers only: the growth of one tangent for each top */
};
/* clang-format on */
/* Returns the number of columns of the tangent matrix for a sum of KR_TANGENT_... flags. */
KR_API size_t kr_tangent_columns(uint64_t tangents);
/* Writes the tangents at the current state: 6 rows of kr_tangent_columns numbers. Writes their
 * digits beyond double precision to `low`, which may be NULL. Returns KR_ERR_ARGUMENT without
 * tangents, and KR_ERR_TANGENT if a tangent exceeds the range of doubles. */
KR_API kr_status kr_top_tangents(kr_top *top, double out[], double low[]);
/* Writes the derivatives of a quantity at n states, from tangents[n][6][columns] to
 * out[n][rows][columns]; `by` has the flags of the columns. rows is quantity->doubles, or 3 for q
 * (a rotation vector). Derivatives that do not exist are NaN: of Euler angles if the apex is
 * vertical, of the apex by com if com is 0, of body_acceleration by friction if it is 0. */
KR_API void kr_quantity_tangents(const kr_quantity *quantity, const kr_scene *scene, size_t n,
                                 const kr_state states[], uint64_t by, const double tangents[],
                                 double out[]);

/* kr_top_save writes a checkpoint of kr_top_save_size bytes. A top with the same method, events,
 * scene (except `start`) and configuration (except max_steps, poll and context) that loads it
 * reaches bitwise equal states and the same events, except if it uses a taylor kernel without fused
 * multiply-add, and the saved top used one with fused multiply-add. Damage, or another version,
 * machine, scene or method, gives KR_ERR_CHECKPOINT and leaves the top unchanged. */
KR_API size_t kr_top_save_size(const kr_top *top);
KR_API kr_status kr_top_save(const kr_top *top, size_t size, void *memory);
KR_API kr_status kr_top_load(kr_top *top, size_t size, const void *memory);

/* Many tops. A worker integrates tops with one method, one by one or in SIMD lanes. Each thread
 * needs its own worker. With method NULL, closed forms are used where they exist, also on supports
 * turning about e3, and taylor otherwise. The result for a top depends only on this top and its
 * times. It is bitwise equal to kr_exact_state or kr_top, except in the SIMD lanes of taylor (at
 * most 16 digits), where all instruction sets with fused multiply-add give equal bits. */
typedef struct kr_worker kr_worker;
/* Reductions over time of one component of a quantity, listed as X(kind, name). WHERE_MIN and
 * WHERE_MAX are the first times of MIN and MAX. If a value is NaN, all except LAST are NaN. */
/* clang-format off */
#define KR_REDUCE_LIST(X)                                                                         \
    X(MIN,       "min")                                                                           \
    X(MAX,       "max")                                                                           \
    X(MEAN,      "mean")                                                                          \
    X(VARIANCE,  "variance") /* of the population */                                              \
    X(LAST,      "last")                                                                          \
    X(WHERE_MIN, "where_min")                                                                     \
    X(WHERE_MAX, "where_max")
typedef enum kr_reduce {
#define KR_X_(kind, name) KR_REDUCE_##kind,
    KR_REDUCE_LIST(KR_X_)
#undef KR_X_
    KR_REDUCE_COUNT
} kr_reduce;
/* clang-format on */
typedef struct kr_reduction {
    const kr_quantity *quantity;
    size_t component; /* index among the doubles of the quantity */
    kr_reduce kind;
} kr_reduction;
/* Indicators of the growth of a tangent since the initial time (taylor with 16 digits, no damping,
 * friction or moving support). The tangent has the initial norm 1 in the internal units of the top.
 * Its components along the flow and the rotation about e3, which never grow, are projected out. */
enum {
    KR_GROWTH_LOG,      /* ln |tangent|; LOG / time is the Lyapunov exponent */
    KR_GROWTH_MEGNO,    /* the time average of the MEGNO indicator */
    KR_GROWTH_MAX,      /* the largest LOG at a few times in each step: may fall slightly */
    KR_GROWTH_ENERGY,   /* relative error of the energy's derivative along the tangent, and */
    KR_GROWTH_MOMENTUM, /* of that of <m, e3>: both derivatives are constant in exact arithmetic */
    KR_GROWTH_TRUNCATION, /* kr_top_info.truncation; KR_ERR_TANGENT if no step makes it small */
    KR_GROWTH_COUNT
};
typedef struct kr_outcome {
    kr_status status; /* the status of kr_top_create or kr_top_record */
    size_t done;      /* number of valid states */
    kr_state last;    /* the last valid state, perhaps later than the last of `states` */
    kr_stats stats;
} kr_outcome;
/* Input and output of workers. Each top moves towards its last time, whatever the sign of step. */
typedef struct kr_tops {
    size_t n;
    const kr_scene *scenes;
    size_t times;         /* number of times of each top */
    const double *t;      /* [times], or [n][times] with own_times */
    int own_times;        /* nonzero: each top has its own times */
    kr_state *states;     /* [n][times]; NaN after the first `done`; may be NULL */
    double *reduced;      /* [n][reductions]; NaN for a failed top; may be NULL */
    kr_outcome *outcomes; /* [n] */
    /* Growth indicators, [n][times][KR_GROWTH_COUNT], NaN after the first `done` ones; may be NULL.
     * `direction`: initial tangent, like a column of kr_top_tangents; NULL: a fixed default. */
    double *growth;
    const double *direction;
} kr_tops;
/* Allocates a worker, which keeps a copy of the array `reduction`. Free it with kr_worker_free. */
KR_API kr_status kr_worker_create(const kr_method *method, kr_config config, size_t reductions,
                                  const kr_reduction reduction[], kr_worker **worker);
/* Computes the states of all tops at the requested times. Returns KR_OK even if tops fail. If
 * config.poll stops the run, this call and unfinished tops (`outcomes`) get KR_ERR_INTERRUPTED. */
KR_API kr_status kr_worker_run(kr_worker *worker, const kr_tops *tops);
/* Like kr_worker_run, but computes sections: for each top, the first `times` states at which the
 * event occurs (see kr_top_watch). `t` holds the longest wait for each event: one number or, with
 * own_times, one per top; negative backward in time. If no event occurs in this time, the top gets
 * KR_ERR_EVENT. Returns KR_ERR_NO_EVENTS for methods other than taylor. */
KR_API kr_status kr_worker_section(kr_worker *worker, const kr_event *event, const kr_tops *tops);
/* Returns the instruction set of the SIMD lanes, or "" without. Writes the order of the method. */
KR_API const char *kr_worker_kernel(const kr_worker *worker, int *order);
/* Frees a worker; NULL is ignored. */
KR_API void kr_worker_free(kr_worker *worker);

/* Closed forms of free bodies and most free gyrostats, Lagrange tops, most Kowalewski tops, and
 * most Goryachev-Chaplygin tops with <m, e3> = 0, without damping, friction or moving support. Late
 * states are as accurate and as cheap as early ones. Reasons to refuse a top: X(name, message). */

/* clang-format off */
#define KR_REFUSAL_LIST(X)                                                                        \
    X(NONE,        "there is a closed form")                                                      \
    X(KIND,        "it is another kind of top, or is not moved by its weight alone")              \
    X(ROUNDED,     "its moments or centre of mass are those of its kind only up to rounding")     \
    X(VERTICAL,    "the angular momentum has a vertical component")                               \
    X(WEIGHTLESS,  "the torque of its weight is negligible")                                      \
    X(REST,        "the top is in equilibrium, or nearly")                                        \
    X(ROTATION,    "the top rotates uniformly")                                                   \
    X(PLANAR,      "the top swings or circles in a plane, like a pendulum")                       \
    X(ZERO,        "the integral G is near zero: the motion is near a separatrix")                \
    X(COINCIDENT,  "two branch points of its curve coincide: the motion is degenerate")           \
    X(SEPARATRIX,  "the motion is too near to a separatrix for its frequencies to be known")      \
    X(INTEGRALS,   "an integral or series of its curve does not converge")                        \
    X(START,       "the start does not lie on the arcs of its curve")                             \
    X(HEADING,     "the series of its heading has too many terms: it is near a separatrix")       \
    X(CERTIFICATE, "the error of its closed form exceeds the limit")
typedef enum kr_refusal {
#define KR_X_(name, text) KR_REFUSAL_##name,
    KR_REFUSAL_LIST(KR_X_)
#undef KR_X_
    KR_REFUSAL_COUNT
} kr_refusal;
/* clang-format on */
/* Returns the message for a refusal, or NULL if `refusal` is not a kr_refusal. */
KR_API const char *kr_refusal_text(kr_refusal refusal);
typedef struct kr_exact_info {
    kr_kind kind;
    kr_refusal refusal; /* why kr_exact_plan returned KR_ERR_METHOD */
    size_t used;        /* used bytes of the kr_exact, of which a copy is a closed form as well */
    /* Period of the nutation [T], INFINITY if it is constant; on a torus, see `frequency`. */
    double period;
    /* For Lagrange tops, mean rates of the apex about the vertical and of the body about the apex
     * [T^-1], without the jumps of Euler angles at the poles. For free bodies, m replaces the
     * vertical, and the apex is replaced by the principal axis about which m circulates in the body
     * (the symmetry axis, if there is one), in the direction at an acute angle to m. */
    double precession_rate, spin_angle_rate;
    /* For Kowalewski and Goryachev-Chaplygin tops, two angular frequencies of the body on its torus
     * (the first is pi / period), and the mean rate of precession [T^-1]. Sums of integer multiples
     * of the three are the angular frequencies of the attitude. For free gyrostats, the angular
     * frequency of m in the body (2 pi / period), the mean rate of the rotation about m, and 0. */
    double frequency[3];
    /* For tops with `frequency` (above), the largest relative error found by checks of the closed
     * form. The attitude error is at most about ten times as large, plus a rounding error for each
     * radian about the vertical if the integral G of a Goryachev-Chaplygin top is near 0. */
    double certificate;
} kr_exact_info;
#define KR_EXACT_BOUND 1e-11
typedef struct kr_exact kr_exact;
/* Returns the size of a kr_exact: at most KR_EXACT_SIZE bytes for Lagrange tops and free bodies. */
#define KR_EXACT_SIZE 704
KR_API size_t kr_exact_size(const kr_scene *scene);
/* Computes the closed form in memory of kr_exact_size(scene) bytes, which the caller owns and
 * aligns for doubles. Returns KR_ERR_METHOD if there is none, or if kr_exact_info.certificate is
 * above `bound` (0: KR_EXACT_BOUND); only kr_exact_describe may then be called. Kowalewski and
 * Goryachev-Chaplygin tops must satisfy the conditions of their kind exactly: near a separatrix, a
 * rounding error can change the attitude completely. Lagrange tops are refused if almost but not
 * exactly vertical (tilt and horizontal momentum below 1e-70). */
KR_API kr_status kr_exact_plan(const kr_scene *scene, double bound, kr_exact *exact);
/* Returns the numbers that describe the motion, or its refusal. */
KR_API kr_exact_info kr_exact_describe(const kr_exact *exact);
/* Returns the state at time t, or NaN if t is not finite or a frequency is close to the largest
 * double. After about 2^50 turns, the integrals of motion are correct, but the attitude is
 * arbitrary. Components of the momentum below 1e-75 |m| are treated as zero. */
KR_API kr_state kr_exact_state(const kr_exact *exact, double t);
/* Writes n states faster than kr_exact_state would, with bitwise equal results. */
KR_API void kr_exact_states(const kr_exact *exact, size_t n, const double t[], kr_state out[]);
/* Returns the state at two angles [turns] on the torus, with the initial time and an arbitrary
 * heading (angle about e3). In a motion, these angles grow by frequency[0] / (2 pi) and
 * frequency[1] / (2 pi) turns per unit of time. For motions without a torus, returns NaN. */
KR_API kr_state kr_exact_state_at(const kr_exact *exact, double first, double second);

/* Turning points of the apex of a Lagrange top, or of a free body with the apex on its axis. */
typedef struct kr_nutation {
    double least, greatest;     /* nutation [rad] */
    double t_least, t_greatest; /* first times of these values, or INFINITY [T] */
    /* (2 * sqrt(I1 * mass * gravity * |com|) - rotor along the apex) / I3 [T^-1]: the least spin of
     * a stable upright (sleeping) top, with the moments I1 normal to the apex and I3 about it. */
    double critical_spin;
    /* "sleeping", "hanging", "steady", "separatrix", "pendulum", "rosette" (through the vertical),
     * "loops", "cusps" or "waves"; for a free body, "resting" or "circle". */
    const char *motion_type;
    /* sum = <m, e3> + <m, apex>, difference = <m, e3> - <m, apex>, inertia = I1, lever = mass *
     * gravity * <com, apex>; axial_energy of rotation about the apex. If h = nutation / 2, energy =
     * 2 I1 (dh/dt)^2 + (sum tan h + difference cot h)^2 / (8 I1) + axial_energy + lever cos 2h. */
    double sum, difference, inertia, axial_energy, lever;
} kr_nutation;
/* Computes the turning points. Returns KR_ERR_METHOD unless kr_nutation applies. */
KR_API kr_status kr_exact_nutation(const kr_scene *scene, kr_nutation *out);

#ifdef __cplusplus
}
#endif
#endif
