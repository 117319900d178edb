/* The closed form of a scene's Kowalewski top. This file is compiled once per instruction set,
 * because products in double-double are three times as fast where a fused product gives what the
 * rounded one leaves out. */
#include "kowalewski_plan.h"
#include "kowalewski_state.h"
#include "model/scene.h"
#include "single.h"

/* The plan, and what it is made with. */
typedef struct kowalewski_memory {
    kr_theta_sums plan;
    kowalewski_work work;
} kowalewski_memory;

/* The odd axis of a body whose moments are 2 : 2 : 1, and the distance of its centre of mass. */
typedef struct kowalewski_body {
    int odd;
    double com[2];  /* along the axes after the odd one, over a power of two */
    dd reach, c, s; /* |com| likewise, and the direction of axis 1 there */
} kowalewski_body;

static double component(kr_vec3 v, int i) { return i == 0 ? v.x : i == 1 ? v.y : v.z; }

static kowalewski_body body_of(const kr_body *b, kr_vec3 com, double gravity)
{
    const kr_vec3 i = b->inertia;
    kowalewski_body r;
    r.odd = i.x < i.y ? (i.x < i.z ? 0 : 2) : i.y < i.z ? 1 : 2;
    for (int j = 0; j < 2; j++) r.com[j] = component(com, (r.odd + 1 + j) % 3);
    const dd square = dd_add(dd_square(dd_of(r.com[0])), dd_square(dd_of(r.com[1])));
    r.reach = dd_sqrt(square);
    const double up = gravity < 0.0 ? 1.0 : -1.0;
    r.c = dd_div(dd_of(up * r.com[0]), r.reach);
    r.s = dd_div(dd_of(up * r.com[1]), r.reach);
    return r;
}
/* What leads from the own units of kowalewski_curve.h back to the scene. */
typedef struct kowalewski_way {
    dd time;                       /* the unit of time, in units of the power of two `units.time` */
    double momentum, own_momentum; /* the unit of momentum, in the user's units and in `units` */
    kr_units units;
    kr_quat attitude; /* the start's, of the working axes */
    kr_quat turn;     /* these axes -> working axes */
    kr_quat axes;     /* these axes -> frame of description */
} kowalewski_way;

/* Returns the turn about the third axis by an angle with this cosine and sine. */
static kr_quat turn_about_third(double c, double s)
{
    const double half = sqrt(0.5 * (1.0 + fabs(c))), other = 0.5 * s / half;
    return c >= 0.0 ? q4(half, v3(0.0, 0.0, other))
                    : q4(fabs(other), v3(0.0, 0.0, s < 0.0 ? -half : half));
}
/* Returns the components of q* v q along axes that are turned about the third. */
static void seen_from_body(const dd q[4], const dd v[3], const kowalewski_body *b, dd out[3])
{
    dd r[3];
    turned_back(q, v, r);
    out[0] = dd_add(dd_mul(b->c, r[0]), dd_mul(b->s, r[1]));
    out[1] = dd_sub(dd_mul(b->c, r[1]), dd_mul(b->s, r[0]));
    out[2] = r[2];
}
/* Brings a checked scene into the axes and units of kowalewski_curve.h. */
static kr_status read_kowalewski(const kr_scene *scene, kowalewski_top *top, kowalewski_way *way)
{
    const kr_pull pull = kr_scene_pull(scene, scene->body.com);
    const kr_working working = kr_body_working(&scene->body);
    const kr_status status = kr_scene_units(scene, &working, &way->units);
    if (status != KR_OK) return status;
    const kowalewski_body b = body_of(&scene->body, pull.com, scene->gravity);
    const kr_units *u = &way->units;
    const int power = pull.power - exponent_of(u->moment) + 2 * exponent_of(u->time);
    const dd lever = dd_times(pull.mass, dd_times(fabs(pull.gravity), b.reach)),
             own = dd_make(times_power_of_2(lever.hi, power), times_power_of_2(lever.lo, power)),
             moment = dd_of(component(scene->body.inertia, b.odd) / u->moment);
    if (!(own.hi > LEAST_LEVER)) return KR_ERR_METHOD;
    way->time = dd_sqrt(dd_div(moment, own));
    const dd unit = dd_div(moment, way->time);
    way->own_momentum = unit.hi;
    way->momentum = unit.hi * (u->moment / u->time);
    const kr_quat q = scene->start.q;
    const kr_vec3 m = v_scale(u->time, v_scale(1.0 / u->moment, scene->start.m));
    dd turn[4] = {dd_of(q.w), dd_of(q.x), dd_of(q.y), dd_of(q.z)}, seen[3];
    turn_first(turn, scene->body.axes);
    turn_first(turn, working.axes);
    const dd momentum[3] = {dd_of(m.x), dd_of(m.y), dd_of(m.z)},
             up[3] = {dd_of(0.0), dd_of(0.0), dd_of(1.0)};
    seen_from_body(turn, momentum, &b, seen);
    for (int i = 0; i < 3; i++) top->state[i] = dd_scale(i < 2 ? 0.5 : 1.0, dd_div(seen[i], unit));
    seen_from_body(turn, up, &b, top->state + 3);
    top->l = dd_div(dd_of(m.z), unit);
    way->turn = turn_about_third(b.c.hi, b.s.hi);
    way->axes = q_unit(q_mul(q_mul(scene->body.axes, working.axes), way->turn));
    way->attitude = q_unit(q_mul(q, way->axes));
    return KR_OK;
}
/* Sets the phase of e by the attitude at the start, in a plan that has no frame yet. */
static void set_phase(kr_theta_sums *plan, kr_quat q)
{
    const kr_quat at = kowalewski_kernel(plan, 0.0, dd_of(0.0)).q;
    const cx alpha = cx_mul(cx_of(q.w, q.z), cx_of(at.w, -at.z)),
             beta = cx_mul(cx_of(q.x, q.y), cx_of(at.x, -at.y)), both = cx_add(alpha, beta);
    phase_start(&plan->turn[2], turns_of(both.im, both.re));
}
/* Brings the plan to the user's units, and to the frame of description. With `own` it goes to the
 * units and the working axes of the method `exact`, and begins at time 0. */
static void bring_back(kr_theta_sums *plan, const kowalewski_way *way, double start, int own)
{
    const double unit = own ? 1.0 : way->units.time;
    double rate[3];
    for (int i = 0; i < 3; i++) {
        kr_phase *p = &plan->turn[i];
        const dd turns = dd_div(dd_make(p->fast, p->slow), way->time);
        p->fast = turns.hi / unit;
        p->slow = turns.lo / unit;
        rate[i] = two_pi * p->fast;
    }
    plan->head.first = rate[0];
    plan->head.second = rate[1];
    plan->head.heading = rate[2];
    plan->begin = own ? 0.0 : start;
    plan->momentum = own ? way->own_momentum : way->momentum;
    plan->frame = q_conj(own ? way->turn : way->axes);
}
/* Returns by how much a body's moments and centre of mass miss those of a Kowalewski top. */
static double mismatch_of(const kr_body *body)
{
    const kr_vec3 i = body->inertia, c = body->com;
    const int odd_axis = i.x < i.y ? (i.x < i.z ? 0 : 2) : i.y < i.z ? 1 : 2;
    const double lone = 2.0 * component(i, odd_axis), one = component(i, (odd_axis + 1) % 3),
                 other = component(i, (odd_axis + 2) % 3);
    return fmax(fmax(fabs(one - lone), fabs(other - lone)) / lone,
                fabs(component(c, odd_axis)) / v_largest(c));
}
/* Returns by how much a plan in own units misses the top at the start, and e3 and the angular
 * velocity a moment later. */
static double miss_of_plan(const kr_theta_sums *plan, const kowalewski_top *top, double moment,
                           kr_quat attitude)
{
    dd series[6][ORDER + 1], y[6];
    double miss = kr_attitude_error(kowalewski_kernel(plan, 0.0, dd_of(0.0)).q, attitude);
    expand(top->state, series);
    for (int i = 0; i < 2; i++) {
        const double t = i * moment;
        const kr_state s = kowalewski_kernel(plan, t, dd_of(t));
        const kr_vec3 up = q_vertical(s.q), m = q_turn_back(s.q, s.m);
        sum_series(series, t, y);
        const kr_vec3 want = v3(2.0 * y[0].hi, 2.0 * y[1].hi, y[2].hi);
        miss = fmax(miss, v_length(v_sub(up, v3(y[3].hi, y[4].hi, y[5].hi))));
        miss = fmax(miss, v_length(v_sub(m, want)) / (1.0 + v_length(want)));
    }
    return miss;
}
static kr_status plan_scene(const kr_scene *scene, int own, double bound, kowalewski_memory *memory)
{
    kr_theta_sums *plan = &memory->plan;
    kr_kowalewski *head = &plan->head;
    kowalewski_top top;
    kowalewski_way way;
    memset(head, 0, sizeof *head);
    kr_status status = kr_scene_check(scene);
    if (status != KR_OK) return status;
    if (scene->gravity == 0.0 || kr_body_kind(&scene->body, KR_KIND_RTOL) != KR_KIND_KOWALEWSKI ||
        v_largest(scene->damping) > 0.0)
        return KR_ERR_METHOD;
    head->mismatch = mismatch_of(&scene->body);
    status = read_kowalewski(scene, &top, &way);
    if (status != KR_OK) return status;
    plan->momentum = 1.0;
    plan->frame = q_one();
    head->refusal = (int)make_plan(&top, &memory->work, plan);
    if (head->refusal != KR_KOWALEWSKI_PLANNED) return KR_ERR_METHOD;
    set_phase(plan, way.attitude);
    const double moment = 0.03125 / (1.0 + sqrt(fabs(memory->work.curve.h.hi)));
    head->certificate = fmax(head->certificate, miss_of_plan(plan, &top, moment, way.attitude));
    bring_back(plan, &way, scene->start.t, own);
    if (!(head->certificate <= (bound > 0.0 ? bound : KR_KOWALEWSKI_BOUND)))
        head->refusal = KR_KOWALEWSKI_CERTIFICATE;
    return head->refusal == KR_KOWALEWSKI_PLANNED ? KR_OK : KR_ERR_METHOD;
}
static kr_status plan_one(const kr_scene *scene, int own, double bound, void *memory)
{
    return plan_scene(scene, own, bound, memory);
}
static size_t size_of_memory(void) { return sizeof(kowalewski_memory); }
/* Returns the state at a time; that of the start, which has every integral, where the time is too
 * late for its phases to be known, and NaN at a time that is not finite. */
static kr_state kowalewski_state(const kr_theta_sums *plan, double t)
{
    const dd span = two_sum(t, -plan->begin);
    const kr_state none = {t, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    if (kowalewski_is_within(plan, span.hi)) return kowalewski_kernel(plan, t, span);
    return isfinite(t) ? kowalewski_kernel(plan, t, dd_of(0.0)) : none;
}
const kr_kowalewski_one KR_NAME(kr_kowalewski_one) = {size_of_memory, plan_one, kowalewski_state};
