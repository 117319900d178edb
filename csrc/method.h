/* The interface of an integration method. Each method has one line in methods.def and one source
 * file, usually in methods/. A method advances a motion (see kr_motion) step by step. The driver
 * handles everything else, such as unit conversion, requested times, step limits and recovery from
 * failures. */
#ifndef KR_METHOD_H
#define KR_METHOD_H
#include "math/su2_dd.h"

/* The body of a motion in double-double numbers. With up to 16 digits, the low words are zero. */
typedef struct body_dd {
    vec_dd inertia, lever, rotor;
    vec_dd differences; /* of `inertia`, more accurate than these: y - z, z - x, x - y */
    vec_dd com;         /* centre of mass, divided by a power of two (kr_scene_pull) */
    quat_dd rest;       /* internal axes -> kr_body.axes, which are rounded */
} body_dd;
/* The state of motion of a top, in the axes and units that the methods use. These internal axes are
 * the principal axes, in the order that the methods need. Methods with KR_METHOD_DIGITS use the
 * principal axes as given. For other methods, the third axis T is the symmetry axis of a symmetric
 * body; otherwise, the second axis B has the intermediate moment of inertia. The
 * internal units are powers of two times the user's units. In internal units, the largest moment of
 * inertia and the rate of rotation are about one. Methods with KR_METHOD_ABSOLUTE use the user's
 * time unit. */
typedef struct kr_motion {
    kr_vec3 inertia;
    kr_vec3 lever;    /* mass * gravity * centre of mass: the torque is e3 x (q lever q*) */
    kr_vec3 damping;  /* the torque in the body is -damping * W; 0 unless KR_METHOD_DAMPED */
    kr_vec3 rotor;    /* momentum of rotors relative to the body; 0 unless KR_METHOD_ROTORS */
    double step, tol; /* from the config; tol = 0: the method's default */
    double clock;     /* time since the start, in internal units; used by adaptive methods only */
    kr_stats stats;
    /* The work array of the method consists of method->work doubles, and contains no pointers. The
     * work array of the main motion is aligned to 64 bytes. */
    double *work;
    /* Additional data of the method, such as its kernel or memory allocated by another library.
     * Freed by `release`. */
    void *aux;
    /* If skip_heading is set, states are determined only up to a rotation about the vertical.
     * Always 0 for methods without KR_METHOD_SKIPS_HEADING. */
    int skip_heading;
    /* The number of requested digits (for methods with KR_METHOD_DIGITS), or 0 if `tol` is used.
     * With more than 16 digits, on entry to `reset`, `low` holds the low words of the initial state,
     * and the initial momentum has components along the body axes. Later, `low` holds the low words
     * of the time and of the state that `at` writes. */
    int digits;
    kr_state low;
    body_dd *body; /* set by the method, or with more than 16 digits by the driver */
    /* The user's scene; its initial state is the one that was set most recently. Closed-form
     * solutions use this scene to avoid the rounding errors of a conversion to internal units. */
    const kr_scene *scene;
    /* The internal units of time and momentum, in the user's units. The method taylor uses them to
     * convert the motion of the support and the friction. */
    double time_unit, momentum_unit;
    /* The gravity gradient k: the torque is e3 x (q (lever + k J P) q*) by the vertical P in the
     * body. 0 unless KR_METHOD_GRADIENT. */
    double gradient;
} kr_motion;
/* Returns the body of a motion with up to 16 digits. */
static inline body_dd body_dd_of(const kr_motion *motion, kr_vec3 com)
{
    const kr_vec3 I = motion->inertia;
    const vec_dd differences = {two_sum(I.y, -I.z), two_sum(I.z, -I.x), two_sum(I.x, -I.y)};
    return (body_dd){vdd_of(I),   vdd_of(motion->lever), vdd_of(motion->rotor),
                     differences, vdd_of(com),           qdd_of(q_one())};
}

/* The last step of a dense method, in powers of tau = (time - begin) * rate, 0 <= tau <= span. */
enum { KR_POLYNOMIAL_ORDER_MAX = 40 };
typedef struct kr_step_polynomial {
    int order; /* at most KR_POLYNOMIAL_ORDER_MAX */
    /* The Taylor coefficients of the attitude, vertical and angular velocity, as (q, 0, P) and (0,
     * W). P is the vertical in the body frame. W is the angular velocity in the body frame, divided
     * by `rate`; |W| is less than 1. */
    const double (*x)[8], (*w)[4];
    double end_x[8], end_w[4]; /* values at the end of the step */
    double rate, span;
    double begin, end; /* times of the step since the start, in internal units */
    /* If `is_disturbed`, the derivatives at the end of the step, computed from the forces in this
     * step. `is_disturbed` is set for a top with dry friction, or on a support that turns or
     * shakes. */
    int is_disturbed;
    double slope_x[8], slope_w[4];
    /* The sign of the spin before the top stopped, while friction holds the top; else 0. */
    double held;
    /* With dry friction: the sign of the spin in this step, or 0 while friction holds the top. */
    double sliding;
    /* Adds the product of the series a and b to c, up to coefficient `order` or a few coefficients
     * more. The array elements before the start of b and beyond the ends of a and b must be
     * zero. */
    void (*product)(const double *a, const double *b, int order, double *c);
} kr_step_polynomial;

/* An infinitesimal perturbation of a motion: a rotation vector in the body frame, and a change in
 * the momentum in the space frame. The components of a deviation refer to the axes and units that
 * the integration method uses. A seed contains the initial deviation, and the derivatives of the
 * coefficients of the equations of motion with respect to a parameter. The derivatives of the
 * moments of inertia and of the damping are symmetric matrices, stored as (xx, yy, zz, yz, zx, xy).
 * Computing deviations does not change the computed motion, except that a strongly damped motion is
 * then computed with short steps. */
typedef struct kr_deviation {
    vec_dd turn, push;
} kr_deviation;
/* Time dependence, at a fixed attitude, of the change in torque that results from changing a
 * parameter. For KR_TIMING_STRENGTH, the change in torque is proportional to the acceleration g(t);
 * for KR_TIMING_UNIFORM, it is constant. For KR_TIMING_AMPLITUDE, KR_TIMING_RATE and
 * KR_TIMING_PHASE, the change in torque is proportional to the derivative of g(t) with respect to
 * the amplitude, rate or phase of the shaking. */
typedef enum kr_timing {
    KR_TIMING_NONE,
    KR_TIMING_STRENGTH,
    KR_TIMING_UNIFORM,
    KR_TIMING_AMPLITUDE,
    KR_TIMING_RATE,
    KR_TIMING_PHASE
} kr_timing;
/* On a shaken support, the derivative of the lever is `pull` times the function of time that
 * `timing` selects. `timing` determines the time dependence of the change in torque. `turning`,
 * `apex`, `friction` and `gradient` are the derivatives of the support's angular velocity, of the
 * apex, of the dry friction and of the gravity gradient. All vectors except `push` and `turning`
 * have components along the principal axes, which all methods with tangents use as their axes. */
typedef struct kr_seed {
    kr_deviation at_start;
    vec_dd lever, rotor, pull;
    kr_vec3 moments, damping, turning;
    kr_timing timing;
    vec_dd apex;
    double friction, gradient;
} kr_seed;
/* The functions with which a method propagates tangents. */
typedef struct kr_tangent_ops {
    /* Initializes the tangent vectors of a top, which are derivatives of its state. All methods use
     * kr_tangents_start. */
    void (*start)(struct kr_top *top);
    /* Returns the doubles that n deviations need, a multiple of 64 bytes. */
    size_t (*doubles)(int digits, size_t n);
    /* Initializes n deviations (tangent vectors) of a motion at its current state. On entry,
     * `memory` is filled with zeros. */
    void (*begin)(const kr_motion *motion, double *memory, size_t n, const kr_seed seeds[]);
    /* Propagates the n infinitesimal deviations from the motion over its last step. Returns
     * KR_ERR_TANGENT if a deviation exceeds the range of doubles. */
    kr_status (*advance)(const kr_motion *motion, double *memory, size_t n);
    /* Writes the deviations at the time for which kr_method.at was called last. `q` is the attitude
     * at this time, and motion->low.q holds its low words. */
    void (*evaluate)(const kr_motion *motion, kr_quat q, double *memory, size_t n,
                     kr_deviation out[]);
    /* Returns the largest last term of a deviation's series so far, relative to its size. */
    double (*truncation)(const kr_motion *motion, double *memory);
} kr_tangent_ops;

/* Driver functions that only some methods need. A program links the functions declared below only
 * if a method needs them. */
typedef struct kr_extended_ops kr_extended_ops;
extern const kr_extended_ops kr_extended;
void kr_tangents_start(struct kr_top *top);

/* Returns KR_OK if `method` supports the damping, friction and support motion of a scene, else an
 * error code. */
kr_status kr_refusal_by_method(const struct kr_method *method, const kr_scene *scene);

/* A text outside functions that a linker leaves out with what refers to it. The linker keeps all
 * string literals of a file. */
#define KR_TEXT(text) ((const char[]){text})
#define KR_METHOD_TEXTS(its_name, its_text, its_integrals, its_source)                             \
    .name = KR_TEXT(its_name), .text = KR_TEXT(its_text), .conserves = KR_TEXT(its_integrals),     \
    .reference = KR_TEXT(its_source)
struct kr_method {
    const char *name, *text, *conserves, *reference;
    int order;
    unsigned flags; /* KR_METHOD_DENSE is not stored, because it follows from `at` */
    /* `applies` returns 1 if the method applies to a valid body of the given kind under any
     * gravity. `suits` returns 1 if the method applies to the given scene, which must be valid. If
     * NULL, only the flags are checked. */
    int (*applies)(const kr_body *body, kr_kind kind);
    int (*suits)(const kr_scene *scene);
    size_t work;
    /* Returns the size, in doubles, of the additional memory that the method needs for a scene.
     * Checkpoints omit these doubles, because `reset` recomputes them from the initial state. NULL:
     * none. */
    size_t (*extra_doubles)(const kr_scene *scene);
    /* Starts the motion from the attitude and momentum of `start`; the time is ignored. On failure,
     * a method with dense output leaves `work` and `aux` unchanged. */
    kr_status (*reset)(kr_motion *motion, const kr_state *start);
    /* Advances the motion by one step of size motion->step. An adaptive method chooses the step
     * size so that the step does not end after the time `until`. Only a method with dense output
     * may step beyond `until`. Such a method also checks that its state is finite, and leaves the
     * motion unchanged on failure. */
    kr_status (*step)(kr_motion *motion, double until);
    /* Writes the attitude q and momentum m at the end of the last step; q has unit norm. Leaves the
     * motion unchanged. */
    void (*read)(const kr_motion *motion, kr_state *s);
    /* Writes the attitude and momentum at the time `clock` within the last step. NULL: the method
     * has no dense output. */
    void (*at)(kr_motion *motion, double clock, kr_state *s);
    /* Writes the attitude and momentum at n times, which need not lie within the last step. The
     * states are bitwise equal to those of `at`, but are computed faster. NULL: not available. */
    void (*at_times)(const kr_motion *motion, size_t n, const double clock[], kr_state out[]);
    /* Returns the Taylor polynomials of the last step. NULL: not available. */
    kr_step_polynomial (*polynomial)(const kr_motion *motion);
    /* Functions that propagate tangents, for methods with KR_METHOD_TANGENTS. `tangents` is NULL if
     * the build omits tangents. */
    const kr_tangent_ops *tangents;
    /* The functions of taylor for dry friction and moving supports. `supports` is NULL for other
     * methods, and if the build omits supports. */
    const struct kr_support_ops *supports;
    /* The conversion of states with more than 16 digits, for methods with KR_METHOD_DIGITS:
     * &kr_extended. `extended` is NULL if the build omits extended precision. */
    const kr_extended_ops *extended;
    /* Returns 1 if all counts, indices and loop bounds in `work` are within range. They may be out
     * of range in a damaged checkpoint. `is_valid` is NULL if the work array contains no counts,
     * indices or bounds. */
    int (*is_valid)(const void *work);
    /* Frees `aux`. May be NULL. */
    void (*release)(kr_motion *motion);
    /* Returns the name of the kernel in use, and writes the order. May be NULL. */
    const char *(*kernel)(const kr_motion *motion, int *order);
};

/* Returns the sum of the momentum M and the momentum of the rotor. */
static inline kr_vec3 motion_add_rotor(const kr_motion *motion, kr_vec3 M)
{
    const kr_vec3 h = motion->rotor;
    /* A zero rotor is not added, because the addition could change the sign of a negative zero. */
    return h.x != 0.0 || h.y != 0.0 || h.z != 0.0 ? v_add(M, h) : M;
}
/* Returns the angular velocity in the body frame, given the momentum M in the body frame. */
static inline kr_vec3 motion_velocity(const kr_motion *motion, kr_vec3 M)
{
    return v_over(v_sub(M, motion->rotor), motion->inertia);
}
/* Returns lever + k J P for the vertical P in the body, with the gravity gradient k. */
static inline kr_vec3 motion_lever(const kr_motion *motion, kr_vec3 P)
{
    return v_axpy(motion->gradient, v_times(motion->inertia, P), motion->lever);
}
/* Returns the angular velocity of the support, along e1, e2, e3, in the units of the motion. It is
 * 0 for a support that turns about the vertical, with which the driver turns the states, unless the
 * method has `supports`. */
static inline kr_vec3 motion_turning(const kr_motion *motion)
{
    const kr_vec3 turning = motion->scene->turning;
    return v_scale(turning.x != 0.0 || turning.y != 0.0 ? motion->time_unit : 0.0, turning);
}
/* Returns the torque at attitude q: e3 x (q lever q*), with that of the gravity gradient. */
static inline kr_vec3 motion_torque(const kr_motion *motion, kr_quat q)
{
    const kr_vec3 lever =
        motion->gradient != 0.0 ? motion_lever(motion, q_vertical(q)) : motion->lever;
    const kr_vec3 a = q_turn(q, lever);
    return v3(-a.y, a.x, 0.0);
}
#endif
