/* A sum of products of two quantities, as a polynomial over a step by Cauchy products of the
 * series' own coefficients. Seen from the body all quantities are linear in (q, P, W). In space,
 * with e a unit vector there and v in the body,
 *     <e, q v q*> = <e q, q v>,   m' = e3 x (q lever q*)
 * Kept in the units of the step, powers of two in which every quantity is at most one. */
#include "terms.h"

enum { PAD = 8, ROOM = KR_TERMS_ROOM }; /* zeros before and after what is multiplied */
typedef double series[PAD + ROOM];

typedef struct view {
    const kr_top *top;
    double rate;
    int order;
    const double (*x)[8], (*w)[4];
    void (*product)(const double *a, const double *b, int order, double *c);
} view;

/* of a component's: components come in threes from KR_Q_X on */
static kr_vec3 unit_vector(kr_quantity id)
{
    const int i = ((int)id - KR_Q_X) % 3;
    return v3(i == 0, i == 1, i == 2);
}
static int is_body_momentum(kr_quantity id)
{
    return id >= KR_BODY_MOMENTUM_X && id <= KR_BODY_MOMENTUM_Z;
}
static double unit_of(const kr_top *top, double rate, kr_quantity id)
{
    if ((id >= KR_M_X && id <= KR_M_Z) || is_body_momentum(id)) return top->momentum_unit * rate;
    return id >= KR_BODY_VELOCITY_X ? rate / top->time_unit : 1.0;
}
static double dot4(kr_quat a, const double b[4])
{
    return (a.w * b[0] + a.x * b[1]) + (a.y * b[2] + a.z * b[3]);
}
static kr_quat attitude(const view *v, int n)
{
    return q4(v->x[n][0], v3(v->x[n][1], v->x[n][2], v->x[n][3]));
}
static kr_quat pure(kr_vec3 a) { return q4(0.0, a); }
static double factor_of(const kr_top *top, double rate, const kr_term *t)
{
    return t->factor * unit_of(top, rate, t->of) * unit_of(top, rate, t->times);
}
static void multiply(const view *v, const double *a, const double *b, double *c)
{
    if (v->order > 1)
        v->product(a, b, v->order, c);
    else
        c[0] += a[0] * b[0], c[1] += a[0] * b[1] + a[1] * b[0];
}

/* What is seen from the body; the attitude. */
static void add_linear(const view *v, double factor, kr_quantity id, double *c)
{
    const kr_quat axes = v->top->axes;
    kr_quat weight;
    if (id == KR_Q_W)
        weight = axes;
    else if (id <= KR_Q_Z)
        weight = q_mul(pure(unit_vector(id)), axes);
    else if (id == KR_APEX_Z || id == KR_SPIN)
        weight = pure(v->top->apex);
    else
        weight = pure(q_turn_back(axes, unit_vector(id)));
    if (is_body_momentum(id)) weight = pure(v_times(v->top->main.inertia, q_vec(weight)));
    weight = q_scale(factor, weight);
    if (id >= KR_BODY_VELOCITY_X)
        for (int n = 0; n <= v->order; n++) c[n] += dot4(weight, v->w[n]);
    else
        for (int n = 0; n <= v->order; n++) c[n] += dot4(weight, v->x[n] + (id <= KR_Q_Z ? 0 : 4));
}
static void clear(const view *v, series s)
{
    memset(s, 0, PAD * sizeof *s);
    memset(s + PAD + v->order + 1, 0, (size_t)(ROOM - v->order - 1) * sizeof *s);
}
/* The component of a vector that is fixed in the body along axis 0, 1 or 2 of space. */
static void add_turned(const view *v, int axis, kr_vec3 body, double *c)
{
    series left[4], right[4];
    for (int i = 0; i < 4; i++) clear(v, left[i]), clear(v, right[i]);
    for (int n = 0; n <= v->order; n++) {
        const kr_quat q = attitude(v, n), r = q_mul(q, pure(body));
        const kr_quat by_axis[3] = {
            {-q.x, q.w, -q.z, q.y}, {-q.y, q.z, q.w, -q.x}, {-q.z, -q.y, q.x, q.w}};
        const kr_quat l = by_axis[axis];
        left[0][PAD + n] = l.w, left[1][PAD + n] = l.x, left[2][PAD + n] = l.y,
                      left[3][PAD + n] = l.z;
        right[0][PAD + n] = r.w, right[1][PAD + n] = r.x, right[2][PAD + n] = r.y,
                       right[3][PAD + n] = r.z;
    }
    for (int i = 0; i < 4; i++) multiply(v, left[i] + PAD, right[i] + PAD, c);
}
static void add_momentum(const view *v, double factor, kr_quantity id, double *c)
{
    const kr_motion *motion = &v->top->main;
    const kr_vec3 e = unit_vector(id), P = v3(v->x[0][5], v->x[0][6], v->x[0][7]);
    const kr_vec3 M = v_times(motion->inertia, v3(v->w[0][1], v->w[0][2], v->w[0][3]));
    const kr_quat q = attitude(v, 0);
    double torque[ROOM];
    c[0] += factor * (id == KR_M_Z ? v_dot(P, M) : q_dot(q_mul(pure(e), q), q_mul(q, pure(M))));
    if (id == KR_M_Z) return;
    memset(torque, 0, sizeof torque);
    factor *= (id == KR_M_X ? -1.0 : 1.0) / (v->rate * v->rate);
    add_turned(v, id == KR_M_X ? 1 : 0, v_scale(factor, motion->lever), torque);
    for (int n = 0; n < v->order; n++) c[n + 1] += torque[n] / (n + 1);
}
static void add(const view *v, double factor, kr_quantity id, double *c)
{
    if (id == KR_ONE)
        c[0] += factor;
    else if (id == KR_APEX_X || id == KR_APEX_Y)
        add_turned(v, (int)(id - KR_APEX_X), v_scale(factor, v->top->apex), c);
    else if (id >= KR_M_X && id <= KR_M_Z)
        add_momentum(v, factor, id, c);
    else
        add_linear(v, factor, id, c);
}

double kr_terms_size(const kr_top *top, const kr_piece *piece, size_t n, const kr_term terms[])
{
    double size = 0.0;
    for (size_t i = 0; i < n; i++) size += fabs(factor_of(top, piece->rate, &terms[i]));
    return size;
}
/* The terms from `t` on that share their first quantity, which varies with some of the others. */
static void add_products(const view *v, const kr_term *t, const kr_term *end, double *c)
{
    series of, times;
    memset(of, 0, sizeof of);
    memset(times, 0, sizeof times);
    add(v, 1.0, t->of, of + PAD);
    for (; t < end; t++) add(v, factor_of(v->top, v->rate, t), t->times, times + PAD);
    multiply(v, of + PAD, times + PAD, c);
}
/* g as a series in tau. */
static void sum(const view *v, const kr_event *e, double *c)
{
    const kr_term *t = e->terms, *last = t + e->count, *end;
    memset(c, 0, ROOM * sizeof *c);
    for (; t < last; t = end) {
        int varies = 0;
        for (end = t; end < last && end->of == t->of; end++) varies |= end->times != KR_ONE;
        if (varies && t->of != KR_ONE) {
            add_products(v, t, end, c);
            continue;
        }
        for (const kr_term *i = t; i < end; i++)
            add(v, factor_of(v->top, v->rate, i), i->of == KR_ONE ? i->times : i->of, c);
    }
}
/* What the next step begins with: the first coefficients at the end of this one. */
static void sum_at_end(const kr_top *top, const kr_piece *p, const kr_event *e, double *c)
{
    const kr_vec3 A = top->main.inertia,
                  lever = v_scale(1.0 / (p->rate * p->rate), top->main.lever);
    const kr_vec3 P = v3(p->end_x[5], p->end_x[6], p->end_x[7]),
                  W = v3(p->end_w[1], p->end_w[2], p->end_w[3]);
    const kr_quat q = q4(p->end_x[0], v3(p->end_x[1], p->end_x[2], p->end_x[3])),
                  dq = q_scale(0.5, q_mul(q, pure(W)));
    const kr_vec3 dP = v_cross(P, W), torque = v_add(v_cross(v_times(A, W), W), v_cross(P, lever));
    const double x[2][8] = {{q.w, q.x, q.y, q.z, 0.0, P.x, P.y, P.z},
                            {dq.w, dq.x, dq.y, dq.z, 0.0, dP.x, dP.y, dP.z}};
    const double w[2][4] = {{0.0, W.x, W.y, W.z},
                            {0.0, torque.x / A.x, torque.y / A.y, torque.z / A.z}};
    const view v = {top, p->rate, e->extremum ? 1 : 0, x, w, NULL};
    sum(&v, e, c);
}
int kr_terms_polynomial(const kr_top *top, const kr_piece *p, const kr_event *e, double c[])
{
    const view v = {top, p->rate, p->order, p->x, p->w, p->product};
    const int first = e->extremum ? 1 : 0, degree = p->order - first;
    double power[2] = {1.0, p->span}, reached[2] = {0.0, 0.0}, end[ROOM];
    sum(&v, e, c);
    for (int n = 0; n <= p->order; n++) {
        c[n] *= power[n % 2];
        power[n % 2] *= p->span * p->span;
    }
    for (int n = 0; n <= degree; n++) {
        if (first) c[n] = (n + 1) * c[n + 1];
        reached[n % 2] += c[n];
    }
    sum_at_end(top, p, e, end);
    c[degree] += (first ? end[1] * p->span : end[0]) - (reached[0] + reached[1]);
    return degree;
}

/* The values, of a state of the user's. */
static double component(kr_vec3 v, kr_quantity id) { return v_dot(v, unit_vector(id)); }
static double value_of(const kr_scene *scene, const kr_state *s, kr_quantity id)
{
    if (id == KR_ONE) return 1.0;
    if (id == KR_Q_W) return s->q.w;
    if (id <= KR_Q_Z) return component(q_vec(s->q), id);
    if (id <= KR_APEX_Z) return component(kr_state_apex(scene, s), id);
    if (id <= KR_M_Z) return component(s->m, id);
    if (id <= KR_VERTICAL_Z) return component(q_vertical(s->q), id);
    if (id <= KR_BODY_VELOCITY_Z)
        return component(q_turn_back(s->q, kr_state_velocity(scene, s)), id);
    if (id <= KR_BODY_MOMENTUM_Z) return component(q_turn_back(s->q, s->m), id);
    return v_dot(kr_state_velocity(scene, s), kr_state_apex(scene, s));
}
double kr_terms_value(const kr_scene *scene, const kr_state *s, size_t n, const kr_term terms[])
{
    double value = 0.0;
    for (size_t i = 0; i < n; i++)
        value +=
            terms[i].factor * value_of(scene, s, terms[i].of) * value_of(scene, s, terms[i].times);
    return value;
}
