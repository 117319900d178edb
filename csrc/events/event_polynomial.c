/* Event functions expressed as polynomials in time over one step. An event function is a sum of
 * products of two state components (kr_term, kreisel.h). Each product is the Cauchy product of the
 * power series of its two factors. These are series in the time since the beginning of the step, in
 * units of 1 / `rate` internal units (method.h). Components of the attitude are linear in its
 * quaternion q. In the body frame, the upward vertical e3 is P, the angular velocity is W, and the
 * momentum is linear in W. A vector v in the body frame has the component <e, q v q*> = <e q, q v>
 * along a unit vector e in space. Without damping, on a support at rest, the momentum m in space
 * has the derivative e3 x (q lever q*), where lever = mass * gravity * com. All numbers are scaled
 * by powers of two, so that all components are about one or less. */
#include "model/quantities.h"
#include "model/scene.h"
#include "event_polynomial.h"

/* A power series: element PAD + n is the coefficient of the n-th power, n <= step_view.order. All
 * others are zero, as step_view.product requires. Its arguments a and b point to element PAD. */
enum { PAD = 8, ROOM = KR_TERMS_ROOM };
typedef double padded_series[PAD + ROOM];

/* The Taylor polynomials of the state over a step, up to the power `order`: x, w, rate and product
 * are those of kr_step_polynomial (method.h). Functions whose names begin with add_ add a power
 * series to the array c: the coefficient of the n-th power to c[n], for each n. */
typedef struct step_view {
    const kr_top *top;
    double rate;
    int order;
    const double (*x)[8], (*w)[4];
    void (*product)(const double *a, const double *b, int order, double *c);
} step_view;

/* Returns the unit of the state component with index `number` (kr_term), a power of two, in the
 * user's units. The first letter of the component's dimension is M for a momentum [M L^2 T^-1] and
 * r for a rate [rad/T]. Other components are dimensionless. */
static double component_unit(const kr_top *top, double rate, int number)
{
    if (number == KR_COMPONENT_ONE) return 1.0;
    const char letter = kr_quantity_rows[kr_component_of(number).quantity].dimension;
    return letter == 'M' ? top->momentum_unit * rate : letter == 'r' ? rate / top->time_unit : 1.0;
}
static kr_quat attitude_coefficient(const step_view *v, int n)
{
    return q4(v->x[n][0], v_of(v->x[n] + 1));
}
/* Returns the factor of the term t for components in their units (component_unit). */
static double convert_term_factor(const kr_top *top, double rate, const kr_term *t)
{
    return t->factor * component_unit(top, rate, t->first) * component_unit(top, rate, t->second);
}
/* Adds the product of the power series a and b, truncated at v->order, to c. */
static void add_series_product(const step_view *v, const double *a, const double *b, double *c)
{
    if (v->order > 1)
        v->product(a, b, v->order, c);
    else
        c[0] += a[0] * b[0], c[1] += a[0] * b[1] + a[1] * b[0];
}

static double dot_with_array(kr_vec3 a, const double b[3])
{
    return a.x * b[0] + (a.y * b[1] + a.z * b[2]);
}
/* Add to c the component of the vertical, or of the angular velocity, along a body-fixed vector. */
static void add_vertical_component(const step_view *v, kr_vec3 along, double *c)
{
    for (int n = 0; n <= v->order; n++) c[n] += dot_with_array(along, v->x[n] + 5);
}
static void add_velocity_component(const step_view *v, kr_vec3 along, double *c)
{
    for (int n = 0; n <= v->order; n++) c[n] += dot_with_array(along, v->w[n] + 1);
}
static kr_vec3 momentum_coefficient(const step_view *v, int n)
{
    const kr_motion *motion = &v->top->main;
    const kr_vec3 M = v_times(motion->inertia, v_of(v->w[n] + 1));
    return n == 0 && kr_body_has_rotor(&v->top->scene.body)
               ? v_axpy(1.0 / v->rate, motion->rotor, M)
               : M;
}
static void clear_padding(const step_view *v, padded_series s)
{
    memset(s, 0, PAD * sizeof *s);
    memset(s + PAD + v->order + 1, 0, (size_t)(ROOM - v->order - 1) * sizeof *s);
}
static void set_quaternion_coefficients(padded_series s[4], int n, kr_quat q)
{
    s[0][PAD + n] = q.w;
    s[1][PAD + n] = q.x;
    s[2][PAD + n] = q.y;
    s[3][PAD + n] = q.z;
}
/* Returns the product e q, where e is the unit vector along the space axis with index `axis`. */
static kr_quat multiply_by_axis(int axis, kr_quat q)
{
    const kr_quat products[3] = {
        {-q.x, q.w, -q.z, q.y}, {-q.y, q.z, q.w, -q.x}, {-q.z, -q.y, q.x, q.w}};
    return products[axis];
}
/* Adds to c the component, along the space axis 0, 1 or 2, of the body-fixed vector `body`. */
static void add_space_component(const step_view *v, int axis, kr_vec3 body, double *c)
{
    padded_series left[4], right[4];
    for (int i = 0; i < 4; i++) clear_padding(v, left[i]), clear_padding(v, right[i]);
    for (int n = 0; n <= v->order; n++) {
        const kr_quat q = attitude_coefficient(v, n);
        set_quaternion_coefficients(left, n, multiply_by_axis(axis, q));
        set_quaternion_coefficients(right, n, q_mul(q, q4(0.0, body)));
    }
    for (int i = 0; i < 4; i++) add_series_product(v, left[i] + PAD, right[i] + PAD, c);
}
/* Adds to c `factor` times <e q, q M>, the component of the angular momentum along the space axis e
 * with index `axis`. M is the momentum in the body frame. Valid for any damping and support. */
static void add_general_space_momentum(const step_view *v, double factor, int axis, double *c)
{
    /* Row i lists three products with sum (q M)_i: index in q, index in M, and 1 for a minus. */
    static const int terms[4][3][3] = {{{1, 0, 1}, {2, 1, 1}, {3, 2, 1}},
                                       {{0, 0, 0}, {2, 2, 0}, {3, 1, 1}},
                                       {{0, 1, 0}, {3, 0, 0}, {1, 2, 1}},
                                       {{0, 2, 0}, {1, 1, 0}, {2, 0, 1}}};
    padded_series q[4], left[4], right[4], M[2][4];
    for (int i = 0; i < 4; i++) {
        clear_padding(v, q[i]), clear_padding(v, left[i]), clear_padding(v, M[0][i]),
            clear_padding(v, M[1][i]);
        memset(right[i], 0, sizeof right[i]);
    }
    for (int n = 0; n <= v->order; n++) {
        const kr_vec3 m = v_scale(factor, momentum_coefficient(v, n));
        set_quaternion_coefficients(q, n, attitude_coefficient(v, n));
        set_quaternion_coefficients(left, n, multiply_by_axis(axis, attitude_coefficient(v, n)));
        set_quaternion_coefficients(M[0], n, q4(m.x, v3(m.y, m.z, 0.0)));
        set_quaternion_coefficients(M[1], n, q4(-m.x, v3(-m.y, -m.z, 0.0)));
    }
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 3; k++) {
            const int *t = terms[i][k];
            add_series_product(v, q[t[0]] + PAD, M[t[2]][t[1]] + PAD, right[i] + PAD);
        }
        clear_padding(v, right[i]);
        add_series_product(v, left[i] + PAD, right[i] + PAD, c);
    }
}
static void add_vertical_momentum(const step_view *v, double factor, double *c)
{
    padded_series P[4], M[4];
    for (int i = 0; i < 4; i++) clear_padding(v, P[i]), clear_padding(v, M[i]);
    for (int n = 0; n <= v->order; n++) {
        set_quaternion_coefficients(P, n, q4(0.0, v_of(v->x[n] + 5)));
        set_quaternion_coefficients(M, n, q4(0.0, v_scale(factor, momentum_coefficient(v, n))));
    }
    for (int i = 1; i < 4; i++) add_series_product(v, P[i] + PAD, M[i] + PAD, c);
}

static void add_momentum_along_space_axis(const step_view *v, double factor, int axis, double *c)
{
    const kr_motion *motion = &v->top->main;
    if (kr_scene_is_disturbed(&v->top->scene)) {
        if (axis == 2)
            add_vertical_momentum(v, factor, c);
        else
            add_general_space_momentum(v, factor, axis, c);
        return;
    }
    const kr_vec3 e = v_axis(axis), P = v_of(v->x[0] + 5), M = momentum_coefficient(v, 0);
    const kr_quat q = attitude_coefficient(v, 0);
    double torque[ROOM];
    c[0] += factor * (axis == 2 ? v_dot(P, M) : q_dot(q_mul(q4(0.0, e), q), q_mul(q, q4(0.0, M))));
    if (axis == 2) return;
    memset(torque, 0, sizeof torque);
    factor *= (axis == 0 ? -1.0 : 1.0) / (v->rate * v->rate);
    add_space_component(v, axis == 0 ? 1 : 0, v_scale(factor, motion->lever), torque);
    for (int n = 0; n < v->order; n++) c[n + 1] += torque[n] / (n + 1);
}
/* Adds to c `factor` times <along, U>, where U is the angular velocity of the top relative to the
 * support, and `along` a body-fixed vector. */
static void add_support_relative_velocity(const step_view *v, double factor, kr_vec3 along,
                                          double *c)
{
    double turning[3];
    add_velocity_component(v, v_scale(factor, along), c);
    v_put(turning, v_scale(-factor * v->top->time_unit / v->rate, v->top->scene.turning));
    for (int i = 0; i < 3; i++)
        if (turning[i] != 0.0) add_space_component(v, i, v_scale(turning[i], along), c);
}
/* Returns an axis of the frame of description (kreisel.h), along the internal axes (method.h). */
static kr_vec3 find_description_axis(const step_view *v, int axis)
{
    return q_turn_back(v->top->axes, v_axis(axis));
}
/* Adds to c `factor` times a state component, of any quantity with KR_QUANTITY_IN_EVENTS. */
static void add_component(const step_view *v, double factor, int number, double *c)
{
    const kr_motion *motion = &v->top->main;
    const kr_quat axes = v->top->axes;
    const kr_vec3 apex = v->top->apex;
    const int axis = kr_component_of(number).axis;
    if (number == KR_COMPONENT_ONE) {
        c[0] += factor;
        return;
    }
    switch (kr_component_of(number).quantity) {
    case KR_QUANTITY_q: {
        const kr_quat a =
            q_scale(factor, axis == 0 ? axes : q_mul(q4(0.0, v_axis(axis - 1)), axes));
        for (int n = 0; n <= v->order; n++)
            c[n] += (a.w * v->x[n][0] + a.x * v->x[n][1]) + (a.y * v->x[n][2] + a.z * v->x[n][3]);
        break;
    }
    case KR_QUANTITY_m:
        add_momentum_along_space_axis(v, factor, axis, c);
        break;
    case KR_QUANTITY_apex:
        if (axis == 2)
            add_vertical_component(v, v_scale(factor, apex), c);
        else
            add_space_component(v, axis, v_scale(factor, apex), c);
        break;
    case KR_QUANTITY_body_velocity:
        add_support_relative_velocity(v, factor, find_description_axis(v, axis), c);
        break;
    case KR_QUANTITY_spin:
        add_support_relative_velocity(v, factor, apex, c);
        break;
    case KR_QUANTITY_inertial_velocity:
        add_velocity_component(v, v_scale(factor, find_description_axis(v, axis)), c);
        break;
    case KR_QUANTITY_body_vertical:
        add_vertical_component(v, v_scale(factor, find_description_axis(v, axis)), c);
        break;
    case KR_QUANTITY_body_momentum:
        add_velocity_component(
            v, v_scale(factor, v_times(motion->inertia, find_description_axis(v, axis))), c);
        if (kr_body_has_rotor(&v->top->scene.body))
            c[0] += factor / v->rate * v_dot(find_description_axis(v, axis), motion->rotor);
        break;
    }
}

/* Returns an upper bound on the magnitude of a state component in its unit (component_unit). `rate`
 * is so large that |W| <= 1. If the support is at rest and gravity has no gradient, the energy also
 * bounds the sum of A_i W_i^2, with the moments of inertia A_i, by the least of these moments. */
static double component_bound(const kr_top *top, double rate, int number)
{
    const double rotor = v_length(top->main.rotor) / rate;
    const kr_vec3 A = top->main.inertia;
    const double least = fmin(A.x, fmin(A.y, A.z));
    const int is_moving = kr_support_turns(&top->scene) || kr_support_shakes(&top->scene) ||
                          top->scene.gradient != 0.0;
    const kr_vec3 root =
        is_moving ? v3(1.0, 1.0, 1.0) : v3(sqrt(least / A.x), sqrt(least / A.y), sqrt(least / A.z));
    const kr_component component = kr_component_of(number);
    kr_vec3 most = root, along = top->apex;
    if (number == KR_COMPONENT_ONE) return 1.0;
    if (component.quantity == KR_QUANTITY_m)
        return sqrt((is_moving ? v_largest(A) : least) * v_largest(A)) + rotor;
    if (component.quantity == KR_QUANTITY_body_momentum)
        most = v_times(A, root);
    else if (component.quantity != KR_QUANTITY_body_velocity &&
             component.quantity != KR_QUANTITY_inertial_velocity &&
             component.quantity != KR_QUANTITY_spin)
        return 1.0;
    if (component.quantity != KR_QUANTITY_spin)
        along = q_turn_back(top->axes, v_axis(component.axis));
    const double size = fmin(1.0, v_dot(most, v3(fabs(along.x), fabs(along.y), fabs(along.z))));
    return component.quantity == KR_QUANTITY_body_momentum ? size + rotor : size;
}
double kr_terms_bound(const kr_top *top, const kr_step_polynomial *piece, size_t n,
                      const kr_term terms[])
{
    double size = 0.0;
    for (size_t i = 0; i < n; i++)
        size += fabs(convert_term_factor(top, piece->rate, &terms[i])) *
                component_bound(top, piece->rate, terms[i].first) *
                component_bound(top, piece->rate, terms[i].second);
    return size;
}
/* Adds to c the terms t[0], ..., end[-1], which have the same first component. */
static void add_term_products(const step_view *v, const kr_term *t, const kr_term *end, double *c)
{
    padded_series of, times;
    memset(of, 0, sizeof of);
    memset(times, 0, sizeof times);
    add_component(v, 1.0, t->first, of + PAD);
    for (; t < end; t++)
        add_component(v, convert_term_factor(v->top, v->rate, t), t->second, times + PAD);
    add_series_product(v, of + PAD, times + PAD, c);
}
/* Writes the power series of an event function over a step to c. Consecutive terms with the same
 * first component are combined into a single product of two power series. */
static void expand_event_in_step(const step_view *v, const kr_event *e, double *c)
{
    const kr_term *t = e->terms, *last = t + e->count, *end;
    memset(c, 0, ROOM * sizeof *c);
    for (; t < last; t = end) {
        int varies = 0;
        for (end = t; end < last && end->first == t->first; end++)
            varies |= end->second != KR_COMPONENT_ONE;
        if (varies && t->first != KR_COMPONENT_ONE) {
            add_term_products(v, t, end, c);
            continue;
        }
        for (const kr_term *i = t; i < end; i++)
            add_component(v, convert_term_factor(v->top, v->rate, i),
                          i->first == KR_COMPONENT_ONE ? i->second : i->first, c);
    }
}
/* Writes the value of an event function at the end of the step p to c[0] and, for an extremum
 * event, its derivative with respect to tau (kr_step_polynomial) to c[1]. */
static void evaluate_event_at_step_end(const kr_top *top, const kr_step_polynomial *p,
                                       const kr_event *e, double *c)
{
    const kr_vec3 A = top->main.inertia,
                  lever = v_scale(1.0 / (p->rate * p->rate), top->main.lever);
    const kr_vec3 P = v_of(p->end_x + 5), W = v_of(p->end_w + 1);
    const kr_quat q = q4(p->end_x[0], v_of(p->end_x + 1)), dq = q_scale(0.5, q_mul(q, q4(0.0, W)));
    const kr_vec3 drag = v_scale(-1.0 / p->rate, v_times(top->main.damping, W));
    const kr_vec3 rotor = v_scale(1.0 / p->rate, top->main.rotor),
                  M = kr_body_has_rotor(&top->scene.body) ? v_add(v_times(A, W), rotor)
                                                          : v_times(A, W);
    const kr_vec3 dP = v_cross(P, W), gravity = v_cross(P, lever),
                  torque = v_add(v_add(v_cross(M, W), gravity), drag);
    double x[2][8] = {{q.w, q.x, q.y, q.z, 0.0, P.x, P.y, P.z},
                      {dq.w, dq.x, dq.y, dq.z, 0.0, dP.x, dP.y, dP.z}};
    double w[2][4] = {{0.0, W.x, W.y, W.z}, {0.0, torque.x / A.x, torque.y / A.y, torque.z / A.z}};
    if (p->is_disturbed) {
        memcpy(x[1], p->slope_x, sizeof x[1]);
        memcpy(w[1], p->slope_w, sizeof w[1]);
    }
    const step_view v = {
        top, p->rate, e->extremum ? 1 : 0, (const double (*)[8])x, (const double (*)[4])w, NULL};
    expand_event_in_step(&v, e, c);
}
static int is_spin_event(const kr_event *e)
{
    const kr_term *t = e->terms;
    if (e->extremum || e->count != 1) return 0;
    const int one = t->first == KR_COMPONENT_ONE ? t->second : t->first;
    return (t->first == KR_COMPONENT_ONE || t->second == KR_COMPONENT_ONE) &&
           one != KR_COMPONENT_ONE && kr_component_of(one).quantity == KR_QUANTITY_spin;
}
int kr_event_is_held(const kr_step_polynomial *piece, const kr_event *event)
{
    return piece->held != 0.0 && is_spin_event(event);
}
int kr_event_side_by_friction(const kr_step_polynomial *piece, const kr_event *event)
{
    if (piece->sliding == 0.0 || !is_spin_event(event)) return 0;
    return (piece->sliding > 0.0) == (event->terms->factor > 0.0) ? 1 : -1;
}
int kr_terms_polynomial(const kr_top *top, const kr_step_polynomial *p, const kr_event *e,
                        double c[])
{
    /* Even and odd terms are summed separately: two independent sums run in parallel. */
    const step_view v = {top, p->rate, p->order, p->x, p->w, p->product};
    const int first = e->extremum ? 1 : 0, degree = p->order - first;
    double power[2] = {1.0, p->span}, reached[2] = {0.0, 0.0}, end[ROOM];
    if (kr_event_is_held(p, e)) {
        /* While friction holds the top, the spin is zero. p->held is the sign of the spin before
         * the stop. c[0] gets the opposite sign, so that the stop counts as a sign change. */
        c[0] = -p->held * convert_term_factor(top, p->rate, e->terms);
        return 0;
    }
    expand_event_in_step(&v, e, c);
    for (int n = 0; n <= p->order; n++) {
        c[n] *= power[n % 2];
        power[n % 2] *= p->span * p->span;
    }
    for (int n = 0; n <= degree; n++) {
        if (first) c[n] = (n + 1) * c[n + 1];
        reached[n % 2] += c[n];
    }
    evaluate_event_at_step_end(top, p, e, end);
    c[degree] += (first ? end[1] * p->span : end[0]) - (reached[0] + reached[1]);
    return degree;
}

int kr_terms_are_linear(size_t n, const kr_term terms[])
{
    int are = 1;
    for (size_t i = 0; i < n; i++) {
        const int of = terms[i].first, times = terms[i].second,
                  one = of == KR_COMPONENT_ONE ? times : of;
        if (!kr_component_is_valid(of) || !kr_component_is_valid(times)) return 0;
        are &= of == KR_COMPONENT_ONE || times == KR_COMPONENT_ONE;
        are &= one == KR_COMPONENT_ONE ||
               (!kr_component_is_turned(one) && kr_component_of(one).quantity != KR_QUANTITY_m);
    }
    return are;
}
kr_linear kr_terms_linear_form(const kr_top *top, double rate, const kr_event *event)
{
    /* The coefficients follow from the values of the event function at seven points (P, W): in six
     * of them, one vector is a unit vector and the other 0; in the last, both are 0. */
    static const double x[7][8] = {{[5] = 1.0}, {[6] = 1.0}, {[7] = 1.0}},
                        w[7][4] = {[3] = {[1] = 1.0}, [4] = {[2] = 1.0}, [5] = {[3] = 1.0}};
    double value[7], c[ROOM];
    for (int i = 0; i < 7; i++) {
        const step_view v = {top, rate, 0, x + i, w + i, NULL};
        expand_event_in_step(&v, event, c);
        value[i] = c[0];
    }
    const double rest = value[6];
    return (kr_linear){v3(value[0] - rest, value[1] - rest, value[2] - rest),
                       v3(value[3] - rest, value[4] - rest, value[5] - rest), rest};
}

double kr_terms_value(const kr_scene *scene, const kr_state *s, size_t n, const kr_term terms[])
{
    double value = 0.0;
    for (size_t i = 0; i < n; i++)
        value += terms[i].factor * kr_component_value(terms[i].first, scene, s) *
                 kr_component_value(terms[i].second, scene, s);
    return value;
}
