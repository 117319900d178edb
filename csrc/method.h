/* The interface of an integration method. Each method has a line in methods.def and a source file,
 * usually in methods/. It advances a motion (kr_motion) by steps. The driver (driver/) converts
 * units, computes states at requested times, limits steps and recovers from failures. The principal
 * axes N, B, T and the space axes e1, e2, e3 are defined in kreisel.h. */
#ifndef KR_METHOD_H
#define KR_METHOD_H
#include "math/su2_dd.h"

/* The body of a motion, along the internal axes and in internal units (kr_motion), in double-double
 * numbers (high and low words). With up to 16 digits, only `differences` has nonzero low words. */
typedef struct body_dd {
    vec_dd inertia, lever, rotor;
    vec_dd differences; /* of the moments, more accurate than from `inertia`: y - z, z - x, x - y */
    vec_dd com;         /* centre of mass, divided by a power of two (kr_scene_pull) */
    quat_dd rest;       /* rotation from the internal axes to kr_body.axes, which are rounded */
} body_dd;
/* The state of motion of a top, in internal axes and units. The internal axes of methods with
 * KR_METHOD_DIGITS are the principal axes N, B, T. For other methods, the axes are permuted so that
 * T is the symmetry axis or, if all moments differ, B has the intermediate moment. The internal
 * units are powers of two times the user's units, chosen so that the largest moment of inertia and
 * the rate of rotation are about 1. Methods with KR_METHOD_ABSOLUTE use the user's unit of time. */
typedef struct kr_motion {
    kr_vec3 inertia;
    kr_vec3 lever;    /* mass * gravity * centre of mass: the torque is e3 x (q lever q*) */
    kr_vec3 damping;  /* torque / -(angular velocity) along each axis; 0 unless KR_METHOD_DAMPED */
    kr_vec3 rotor;    /* momentum of rotors relative to the body; 0 unless KR_METHOD_ROTORS */
    double step, tol; /* from the config; tol = 0: the method's default */
    double clock;     /* time since the start, in internal units; used by adaptive methods only */
    kr_stats stats;
    /* The work array of the method, whose length is kr_method.work. Checkpoints copy it, so it must
     * not contain pointers. The work array of kr_top.main is aligned to 64 bytes. */
    double *work;
    /* Further data of the method, such as its kernel. `release` frees it. */
    void *aux;
    /* Nonzero: states are determined only up to a rotation about e3 (kr_config). */
    int skip_heading;
    /* The number of requested digits, or 0 if `tol` is used. */
    int digits;
    /* Low words of a state. Before kr_method.reset, the driver sets q and, with over 16 digits, m.
     * Then, m here and in `start` of reset are along the internal axes, not e1, e2, e3. Before
     * kr_method.at, it sets t, the low word of `clock`; with over 16 digits, `at` sets q and m. */
    kr_state low;
    body_dd *body; /* set by the method, or with more than 16 digits by the driver */
    /* The user's scene, with the initial state that was set last. Closed forms use the scene,
     * because the conversion to internal units causes rounding errors. */
    const kr_scene *scene;
    /* The internal units of time and momentum, in the user's units. */
    double time_unit, momentum_unit;
    /* The gravity gradient k, which adds e3 x (q (k J P) q*) to the torque in space, with the
     * inertia J and the vertical P along the internal axes. */
    double gradient;
} kr_motion;
/* Returns the double-double body of a motion with up to 16 digits. `com` is body_dd.com. */
static inline body_dd make_body_dd(const kr_motion *motion, kr_vec3 com)
{
    const kr_vec3 I = motion->inertia;
    const vec_dd differences = {two_sum(I.y, -I.z), two_sum(I.z, -I.x), two_sum(I.x, -I.y)};
    return (body_dd){vdd_of(I),   vdd_of(motion->lever), vdd_of(motion->rotor),
                     differences, vdd_of(com),           qdd_of(q_one())};
}

/* The last step of a dense method: polynomials in tau = (time - begin) * rate, 0 <= tau <= span. */
enum { KR_POLYNOMIAL_ORDER_MAX = 40 };
typedef struct kr_step_polynomial {
    int order; /* at most KR_POLYNOMIAL_ORDER_MAX */
    /* Taylor coefficients in tau = (time - begin) * rate: x[k] of (q, 0, P), and w[k] of (0, W). In
     * the body frame, P is the vertical, W the angular velocity divided by `rate`; |W| < 1. */
    const double (*x)[8], (*w)[4];
    double end_x[8], end_w[4]; /* values at the end of the step */
    double rate, span;
    double begin, end; /* times of the step since the start, in internal units */
    /* Nonzero for a top with dry friction, a gravity gradient or a moving support. In this case,
     * slope_x and slope_w are the derivatives of x and w by tau at the end of the step. They are
     * computed from the forces in this step, which may differ in the next step. */
    int is_disturbed;
    double slope_x[8], slope_w[4];
    /* The sign of the spin before the top stopped, while friction holds the top; else 0. */
    double held;
    /* With dry friction: the sign of the spin in this step, or 0 while friction holds the top. */
    double sliding;
    /* Adds the product of the power series a and b to c[0], ..., c[N]; N + 1 is the least multiple
     * of 8 above `order`. b[-7] to b[-1], and elements of a and b after `order`, must be 0. */
    void (*product)(const double *a, const double *b, int order, double *c);
} kr_step_polynomial;

/* An infinitesimal perturbation of a motion, in internal units: the rotation vector `turn` along
 * the internal axes, and the change `push` of the momentum in space. */
typedef struct kr_deviation {
    vec_dd turn, push;
} kr_deviation;
/* The function of time k in the derivative of the lever by a parameter. NONE: the lever does not
 * depend on it. STRENGTH: k = g(t) = gravity - A r^2 cos(r t + phase) (kreisel.h). UNIFORM: k = 1.
 * AMPLITUDE, RATE, PHASE: k is the derivative of g(t) by A, r or phase. */
typedef enum kr_timing {
    KR_TIMING_NONE,
    KR_TIMING_STRENGTH,
    KR_TIMING_UNIFORM,
    KR_TIMING_AMPLITUDE,
    KR_TIMING_RATE,
    KR_TIMING_PHASE
} kr_timing;
/* The input for one tangent: an initial perturbation, and the derivatives of the coefficients of
 * the equations of motion by a parameter. On a shaken support, the derivative of the lever is
 * `pull` times the function `timing`. `apex` is the derivative of the unit vector to the centre of
 * mass. Vectors are along the principal axes, but at_start.push and `turning` along e1, e2, e3. */
typedef struct kr_seed {
    kr_deviation at_start;
    vec_dd lever, rotor, pull;
    kr_vec3 moments, damping, turning;
    kr_timing timing;
    vec_dd apex;
    double friction, gradient;
} kr_seed;
typedef struct kr_tangent_ops {
    /* Begins the tangents of a top: kr_tangents_start for all methods. */
    void (*start)(struct kr_top *top);
    /* Returns the size of the memory for n deviations, in numbers. It is a multiple of 8. */
    size_t (*doubles)(int digits, size_t n);
    /* Begins n deviations at the current state of a motion. `memory` contains zeros. */
    void (*begin)(const kr_motion *motion, double *memory, size_t n, const kr_seed seeds[]);
    /* Propagates n deviations over the last step of a motion. Returns KR_ERR_TANGENT if a result
     * exceeds the range of doubles. */
    kr_status (*advance)(const kr_motion *motion, double *memory, size_t n);
    /* Writes the n deviations at the time of the last call of kr_method.at. The attitude at this
     * time is q + motion->low.q. */
    void (*evaluate)(const kr_motion *motion, kr_quat q, double *memory, size_t n,
                     kr_deviation out[]);
    /* Returns the largest ratio so far of the last Taylor term of a deviation to its norm. */
    double (*truncation)(const kr_motion *motion, double *memory);
} kr_tangent_ops;

/* Functions of the driver for more than 16 digits and for tangents. Only methods that need these
 * functions refer to them, so that programs without these methods do not link them. */
typedef struct kr_extended_ops kr_extended_ops;
extern const kr_extended_ops kr_extended;
void kr_tangents_start(struct kr_top *top);

/* Returns KR_OK if `method` supports the damping, friction, gravity gradient and support motion of
 * a scene, else the error code of the first that it does not support. */
kr_status kr_refusal_by_method(const struct kr_method *method, const kr_scene *scene);

/* A string that a linker omits together with the objects that refer to it. String literals of a
 * file, in contrast, are all kept. */
#define KR_TEXT(text) ((const char[]){text})
#define KR_METHOD_TEXTS(its_name, its_text, its_integrals, its_source)                             \
    .name = KR_TEXT(its_name), .text = KR_TEXT(its_text), .conserves = KR_TEXT(its_integrals),     \
    .reference = KR_TEXT(its_source)
struct kr_method {
    const char *name, *text, *conserves, *reference;
    int order;
    unsigned flags; /* KR_METHOD_DENSE is not stored, because it follows from `at` */
    /* `applies` returns 1 if the method applies to a valid body of the given kind under any
     * gravity, `suits` returns 1 if it applies to a valid scene. If `suits` is NULL, `applies`
     * decides; if both are NULL, the flags decide. */
    int (*applies)(const kr_body *body, kr_kind kind);
    int (*suits)(const kr_scene *scene);
    size_t work;
    /* Returns the number of doubles that the method needs for a scene beyond the work array.
     * Checkpoints do not contain them, because `reset` computes them again. NULL: none. */
    size_t (*extra_doubles)(const kr_scene *scene);
    /* Begins the motion in the initial state `start`. On failure, a method with dense output leaves
     * `work` and `aux` unchanged. */
    kr_status (*reset)(kr_motion *motion, const kr_state *start);
    /* Advances the motion by one step: of the size motion->step or, for an adaptive method, of a
     * size that it chooses. Only methods with dense output may step beyond `until`. Such methods
     * check that their state is finite, and leave the motion unchanged on failure. */
    kr_status (*step)(kr_motion *motion, double until);
    /* Writes the attitude, with unit norm, and the momentum at the end of the last step. */
    void (*read)(const kr_motion *motion, kr_state *s);
    /* Writes the attitude and momentum at the time `clock`, in the last step. NULL: not dense. */
    void (*at)(kr_motion *motion, double clock, kr_state *s);
    /* A faster `at` for n times, even beyond the last step (closed forms). The motion is unchanged:
     * the caller advances it. May be NULL. */
    void (*at_times)(const kr_motion *motion, size_t n, const double clock[], kr_state out[]);
    /* Returns the Taylor polynomials of the last step. May be NULL. */
    kr_step_polynomial (*polynomial)(const kr_motion *motion);
    /* Further functions, each NULL if the method or the build has none: `tangents` for methods with
     * KR_METHOD_TANGENTS; `supports` for dry friction, gravity gradient and moving support (taylor
     * only); `extended` for more than 16 digits (kr_extended). */
    const kr_tangent_ops *tangents;
    const struct kr_support_ops *supports;
    const kr_extended_ops *extended;
    /* Returns 1 if all counts, indices and loop bounds in `work` are within range, which may be
     * false in a damaged checkpoint. NULL: `work` contains none. */
    int (*is_valid)(const void *work);
    /* Frees `aux`. May be NULL. */
    void (*release)(kr_motion *motion);
    /* Returns the name of the kernel in use, and writes the order. May be NULL. */
    const char *(*kernel)(const kr_motion *motion, int *order);
};

/* Returns M plus the momentum of the rotor, both along the internal axes. A zero rotor is not
 * added, because this could change the sign of a negative zero. */
static inline kr_vec3 motion_add_rotor(const kr_motion *motion, kr_vec3 M)
{
    const kr_vec3 h = motion->rotor;
    return h.x != 0.0 || h.y != 0.0 || h.z != 0.0 ? v_add(M, h) : M;
}
/* Returns the angular velocity in the body frame, given the momentum M in the body frame. */
static inline kr_vec3 motion_body_velocity(const kr_motion *motion, kr_vec3 M)
{
    return v_over(v_sub(M, motion->rotor), motion->inertia);
}
/* Returns lever + k J P, with the vertical P in the body frame, the inertia J and the gravity
 * gradient k. The torque in the body frame is P x (lever + k J P). */
static inline kr_vec3 find_effective_lever(const kr_motion *motion, kr_vec3 P)
{
    if (motion->gradient == 0.0) return motion->lever;
    return v_axpy(motion->gradient, v_times(motion->inertia, P), motion->lever);
}
/* Returns the angular velocity of the support, along e1, e2, e3, in internal units. Returns 0 for a
 * support that turns about e3, because the driver then turns the states. */
static inline kr_vec3 motion_support_velocity(const kr_motion *motion)
{
    const kr_vec3 turning = motion->scene->turning;
    return v_scale(turning.x != 0.0 || turning.y != 0.0 ? motion->time_unit : 0.0, turning);
}
/* Returns the torque of the weight and of the gravity gradient in space, at the attitude q. */
static inline kr_vec3 motion_torque(const kr_motion *motion, kr_quat q)
{
    const kr_vec3 a = q_turn(q, find_effective_lever(motion, q_turn_e3_back(q)));
    return v3(-a.y, a.x, 0.0);
}
#endif
