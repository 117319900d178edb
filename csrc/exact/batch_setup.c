/* Closed forms (kr_exact_form, exact.h) of many Lagrange tops at once, with one top in each lane of
 * SIMD vectors (the type `wide`). Tops wait in a queue; a group consists of LANES consecutive tops
 * of a queue. Other bodies, and tops whose axis stays vertical, are computed one by one. Internal
 * axes and units: method.h. Frame of description: kreisel.h. The lever is mass * gravity * com with
 * com along the third internal axis; e3 points up. The results for a top are bitwise equal to those
 * of kr_exact_run_top. This file is compiled once for each instruction set. */
#define KR_EXACT_LANES
#include "lagrange.h"
#include "math/exponent.h"

/* If more than FEW_TIMES times are requested, the states of each top are computed separately, in
 * loops over the times (batch_eval.c). GROUPS is the number of groups that are set up together. */
enum { FEW_TIMES = 16, GROUPS = 4, MANY = GROUPS * LANES };
/* Number of doubles in a kr_exact_form before the members `framed` and `frame`. */
enum { FORM = sizeof(exact_lanes) / sizeof(wide) };
KR_CHECK_LAYOUT(form_is_laid_out, FORM * sizeof(double) == offsetof(kr_exact_form, framed));

typedef struct body_data {
    kr_body body;
    int fits; /* 1 if lanes can handle the body */
    kr_working working;
    kr_vec3 apex;       /* the apex in the frame of description, up to its sign */
    double per_inertia; /* 1 / I1 */
    double mass, reach; /* mass and com, divided by powers of two */
    int power;          /* sum of the exponents of these powers */
    int turned;         /* 1 if `axes` (internal axes -> frame of description) is not 1 */
    kr_quat axes;
    int framed[2]; /* 1 if frame[0], or frame[1] with up and down exchanged, is set */
    kr_quat frame[2][4];
    double gravity, gravity_fraction;
    int gravity_power; /* exponent of gravity minus exponent of the unit of moment */
    kr_swing swing;
} body_data;

/* The rows of batch_queue.in, which has a column for each top: 3 rows from INERTIA, 4 from
 * ATTITUDE, 3 from MOMENTUM, 4 from AXES (kr_body.axes), 4 from AXES + 4 (kr_working.axes), and 7
 * single rows: MASS, GRAVITY, REACH (each divided by a power of two), SCALE (a power of two; times
 * these three, the internal lever), MOMENT and TIME (internal units), BEGIN (initial time). */
enum { INERTIA = 0, ATTITUDE = 3, MOMENTUM = 7, AXES = 10 };
enum { MASS = 18, GRAVITY, REACH, SCALE, MOMENT, TIME, BEGIN, NUMBERS };
/* A queue collects tops until their closed-form solutions can be computed together. */
typedef struct batch_queue {
    int count, turned[2]; /* number of tops; 1 if any rotation at AXES, AXES + 4 is needed */
    size_t index[MANY];
    int framed[MANY];
    kr_quat frame[MANY][4];
    double in[NUMBERS][MANY];
} batch_queue;

/* Sets known->fits to 1 if vector lanes can process the body: a Lagrange top without rotors, with
 * kr_working.tilted = 0 (body.h). Then also sets the other members that depend only on the body. */
static void set_body_data(const kr_body *body, body_data *known)
{
    const kr_scene scene = {.body = *body};
    memcpy(&known->body, body, sizeof *body);
    known->fits =
        kr_body_check(body) == KR_OK && kr_body_kind(body, KR_KIND_RTOL) == KR_KIND_LAGRANGE;
    if (!known->fits) return;
    known->working = kr_body_working(body);
    known->fits = !known->working.tilted && !kr_body_has_rotor(body);
    const kr_pull pull = kr_scene_pull(&scene, body->com);
    const kr_quat axes = q_unit(q_mul(body->axes, known->working.axes));
    known->mass = pull.mass;
    known->reach = q_turn_back(known->working.axes, pull.com).z;
    known->power = pull.power;
    known->apex = q_turn(axes, v3(0.0, 0.0, 1.0));
    known->per_inertia = 1.0 / known->working.inertia.x;
    known->gravity = 0.0;
    known->axes = axes;
    known->turned = !is_identity(axes);
    known->framed[0] = known->framed[1] = 0;
}
/* Writes the linear map (apply_quaternion_map) from attitudes of a closed form to attitudes of the
 * frame of description, and returns 1. If this map is the identity, writes nothing and returns 0.
 * If `exchanged` is nonzero, the map also undoes exchange_up_and_down (kernel.h). */
static int get_attitude_map_to_user(body_data *known, int exchanged, kr_quat out[4])
{
    kr_quat *frame = known->frame[exchanged];
    if (!exchanged && !known->turned) return 0;
    if (!known->framed[exchanged]) {
        if (exchanged) set_up_down_map(frame);
        if (known->turned) multiply_map_by_inverse_axes(frame, exchanged, known->axes);
        known->framed[exchanged] = 1;
    }
    memcpy(out, frame, sizeof known->frame[exchanged]);
    return 1;
}
static void store_top_numbers(double in[][MANY], int top, int row, const double numbers[],
                              int count)
{
    for (int i = 0; i < count; i++) in[row + i][top] = numbers[i];
}
static void set_gravity_data(const kr_scene *scene, body_data *known)
{
    known->gravity = scene->gravity;
    known->gravity_fraction = fraction_of(scene->gravity, &known->gravity_power);
    known->swing = kr_scene_swing(scene, &known->working);
    known->gravity_power -= exponent_of(known->swing.moment);
}
static double larger(double a, double b) { return a > b ? a : b; }

/* Returns 1 if the root with the largest g u of the cubic polynomial
 *     (du/dt)^2 = (e - g u)(1 - u^2) - (l - n u)^2,   l = W.e3, n = W.a, e = |W|^2 - n^2 + g u0,
 * is farthest from the other two: then the polynomial is at most 0 at its point of inflection. For
 * a, u, u0, W and g, see lagrange.h; but g may be negative here, and W and g are in the internal
 * unit of time. `m` is the initial momentum times this unit, `lever` is in internal units, and `q`
 * is the initial attitude. Tops with equal results share a queue, so that most vectors compute one
 * branch of find_turning_point_distances. A wrong result, by rounding errors, costs only time. */
static int is_largest_root_isolated(const body_data *known, kr_quat q, kr_vec3 m, double lever)
{
    const kr_vec3 a = q_turn(q, known->apex);
    const double part = known->per_inertia, n = part * v_dot(m, a), l = part * m.z,
                 g = 2.0 * known->swing.moment * part * lever;
    const double square = part * part * v_dot(m, m), e = square - n * n + g * a.z;
    const double c2 = -(square + g * a.z), c1 = g * (2.0 * l * n - g), c0 = g * g * (e - l * l);
    return c2 * (9.0 * c1 - 2.0 * c2 * c2) - 27.0 * c0 >= 0.0;
}
/* Appends a top to one of two queues, chosen by is_largest_root_isolated. `index` is the index of
 * the top among all tops. Returns 0 if vector lanes cannot process the top, else 1. */
static int add_top_to_queue(batch_queue queues[2], const kr_scene *scene, size_t index,
                            body_data *known)
{
    const kr_vec3 m = scene->start.m;
    if (kr_scene_is_disturbed(scene)) return 0;
    if (scene->gravity == 0.0 || kr_scene_check_start(scene) != KR_OK) return 0;
    const double most = larger(larger(fabs(m.x), fabs(m.y)), fabs(m.z));
    int unit;
    if (!kr_find_time_unit(&known->swing, most, &unit)) return 0;
    const int power = known->power + known->gravity_power + 2 * unit;
    /* `scale` and `time` must lie between 2^-1000 and 2^1000. `scale` is at most about 8, because
     * |scale * lever| <= about 1, and |lever| (a product of three fractions) >= about 1/8. */
    if (power < -1000 || unit < -1000 || unit > 1000) return 0;
    const double gravity = known->gravity_fraction, scale = power_of_2(power),
                 time = power_of_2(unit), lever = known->mass * (gravity * known->reach);
    const kr_quat q = scene->start.q, body = scene->body.axes, work = known->working.axes;
    const kr_vec3 i = known->working.inertia;
    batch_queue *w = &queues[is_largest_root_isolated(known, q, v_scale(time, m), scale * lever)];
    const double start[] = {i.x, i.y, i.z, q.w, q.x, q.y, q.z, m.x, m.y, m.z},
                 axes[] = {body.w, body.x, body.y, body.z, work.w, work.x, work.y, work.z},
                 units[] = {known->mass,         gravity, known->reach,  scale,
                            known->swing.moment, time,    scene->start.t};
    store_top_numbers(w->in, w->count, INERTIA, start, 10);
    store_top_numbers(w->in, w->count, AXES, axes, 8);
    store_top_numbers(w->in, w->count, MASS, units, 7);
    w->turned[0] |= !is_identity(body);
    w->turned[1] |= !is_identity(work);
    w->framed[w->count] = get_attitude_map_to_user(known, lever < 0.0, w->frame[w->count]);
    w->index[w->count++] = index;
    return 1;
}
typedef struct group {
    const batch_queue *all;
    int first; /* index of the group's first top in the queue */
} group;

INLINE wide load_quantity(group w, int row) { return wide_load(&w.all->in[row][w.first]); }

/* Multiplies the attitude of each top of a group from the right by the unit quaternion in the rows
 * `row` to `row + 3` of the queue. If this is the identity, the attitude keeps its bits. */
INLINE void multiply_attitudes_by_axes(exact_top *top, group w, int row)
{
    const quat_lanes by = {load_quantity(w, row), load_quantity(w, row + 1),
                           load_quantity(w, row + 2), load_quantity(w, row + 3)};
    const wide zero = wide_splat(0.0);
    const mask one =
        mask_and(mask_and(wide_equal(by.x, zero), wide_equal(by.y, zero)), wide_equal(by.z, zero));
    dd turned[4];
    memcpy(turned, top->q, sizeof turned);
    multiply_from_right(turned, by);
    copy_selected_lanes(top->q, turned, sizeof turned, mask_not(one));
}
INLINE exact_top convert_group_to_internal(group w)
{
    const wide inverse = 1.0 / load_quantity(w, MOMENT), time = load_quantity(w, TIME),
               scale = load_quantity(w, SCALE);
    const dd lever = dd_times(load_quantity(w, MASS),
                              dd_times(load_quantity(w, GRAVITY), dd_of(load_quantity(w, REACH))));
    exact_top top;
    for (int i = 0; i < 4; i++) top.q[i] = dd_of(load_quantity(w, ATTITUDE + i));
    if (w.all->turned[0]) multiply_attitudes_by_axes(&top, w, AXES);
    if (w.all->turned[1]) multiply_attitudes_by_axes(&top, w, AXES + 4);
    top.inertia.x = inverse * load_quantity(w, INERTIA);
    top.inertia.y = inverse * load_quantity(w, INERTIA + 1);
    top.inertia.z = inverse * load_quantity(w, INERTIA + 2);
    top.m.x = drop_tiny_momentum(time * (inverse * load_quantity(w, MOMENTUM)));
    top.m.y = drop_tiny_momentum(time * (inverse * load_quantity(w, MOMENTUM + 1)));
    top.m.z = drop_tiny_momentum(time * (inverse * load_quantity(w, MOMENTUM + 2)));
    top.lever = dd_make(scale * lever.hi, scale * lever.lo);
    return top;
}
/* Returns a mask of the tops that vectors can compute: |lever| is above LEAST_LEVER (kernel.h), and
 * the horizontal momentum [internal units] or half the tilt [rad] exceeds 1e-10. The others
 * (torque-free or nearly vertical; some have no closed form) are computed one by one. */
INLINE mask can_lanes_compute_top(const exact_top *top)
{
    const wide least = wide_splat(1e-10);
    const wide side = wide_max(wide_abs(top->q[1].hi), wide_abs(top->q[2].hi)),
               up = wide_max(wide_abs(top->q[0].hi), wide_abs(top->q[3].hi)),
               push = wide_max(wide_abs(top->m.x), wide_abs(top->m.y));
    return mask_and(wide_less(wide_splat(LEAST_LEVER), wide_abs(top->lever.hi)),
                    wide_less(least, wide_max(wide_min(side, up), push)));
}
static void convert_and_prepare_group(group w, lagrange_setup *s)
{
    s->top = convert_group_to_internal(w);
    const mask below = is_negative(s->top.lever.hi);
    if (mask_any(below)) {
        const exact_top seen = exchange_up_and_down(&s->top);
        copy_selected_lanes(&s->top, &seen, sizeof seen, below);
    }
    set_initial_quantities(s);
}
/* Extracts the closed form of the top at the index `place` of the queue from the vectors. */
static void extract_form(const exact_lanes *exact, const batch_queue *w, int place,
                         kr_exact_form *out)
{
    const char *from = (const char *)exact + (size_t)(place % LANES) * sizeof(double);
    double row[FORM];
    for (int i = 0; i < FORM; i++) memcpy(&row[i], from + (size_t)i * sizeof(wide), sizeof row[i]);
    memcpy(out, row, sizeof row);
    out->framed = w->framed[place];
    if (w->framed[place])
        memcpy(out->frame, w->frame[place], sizeof out->frame);
    else
        memset(out->frame, 0, sizeof out->frame);
}
/* Returns the states of a group, each at the time in its lane, without the linear maps `frame`. */
static state_lanes evaluate_lanes(const exact_lanes *exact, wide time)
{
    const dd span = two_sum(time, -exact->begin);
    const mask dual = uses_dual_nome(exact);
    if (mask_all(dual)) return evaluate_state(exact, 1, 0, time, span);
    state_lanes r = evaluate_state(exact, 0, 0, time, span);
    if (mask_any(dual)) {
        const state_lanes some = evaluate_state(exact, 1, 0, time, span);
        copy_selected_lanes(&r, &some, sizeof r, dual);
    }
    return r;
}
/* Writes the k-th requested state of each top of the group g whose bit in `lanes` is set. */
static void write_states(const kr_exact_request *request, group g, const exact_lanes *exact,
                         unsigned lanes, size_t k)
{
    const batch_queue *w = g.all;
    double t[LANES], s[8][LANES];
    for (int i = 0; i < LANES; i++)
        t[i] = kr_exact_times_of(request, w->index[g.first + i < w->count ? g.first + i : 0])[k];
    const wide time = wide_load(t);
    const unsigned within = mask_bits(is_span_computable(exact, two_sum(time, -exact->begin).hi));
    const state_lanes states = evaluate_lanes(exact, time);
    memcpy(s, &states, sizeof s);
    for (int i = 0; i < LANES; i++) {
        const int place = g.first + i;
        if (!(lanes >> i & 1)) continue;
        kr_state *out = &request->states[w->index[place] * request->times + k];
        if (within >> i & 1) {
            const kr_quat q = q4(s[1][i], v3(s[2][i], s[3][i], s[4][i]));
            out->t = s[0][i];
            out->q = w->framed[place] ? apply_quaternion_map(w->frame[place], q) : q;
            out->m = v3(s[5][i], s[6][i], s[7][i]);
        } else {
            kr_exact_form one;
            extract_form(exact, w, place, &one);
            *out = request->isa->scalar->state(&one, t[i]);
        }
    }
}
/* Writes the closed form and all states of each top whose bit in `lanes` is set. */
static void write_group_results(const kr_exact_request *request, group g, const exact_lanes *exact,
                                unsigned lanes)
{
    const int many = request->times > FEW_TIMES;
    for (int i = 0; i < LANES && (many || request->plans); i++) {
        if (!(lanes >> i & 1)) continue;
        const size_t index = g.all->index[g.first + i];
        kr_exact_form one, *out = request->plans ? &request->plans[index] : &one;
        extract_form(exact, g.all, g.first + i, out);
        if (many)
            KR_NAME(kr_exact_evaluate)(out, request->times, kr_exact_times_of(request, index),
                                       request->states + index * request->times);
    }
    for (size_t k = 0; k < request->times && !many; k++) write_states(request, g, exact, lanes, k);
}
/* Converts the closed forms of a group to the user's units, and writes the requested results. */
static void write_group_or_single_tops(const kr_exact_request *request, group g, lagrange_setup *s)
{
    const wide time = load_quantity(g, TIME), reach = load_quantity(g, REACH);
    const mask below = is_negative(load_quantity(g, GRAVITY) * reach);
    exact_lanes *exact = &s->exact;
    if (mask_any(below)) {
        exact_lanes turned = *exact;
        undo_exchange_up_and_down(&turned);
        copy_selected_lanes(exact, &turned, sizeof turned, below);
    }
    exact->spin_angle_rate = wide_choose(is_negative(reach), 0.0 - exact->spin_angle_rate,
                                         exact->spin_angle_rate); /* never -0 */
    convert_form_to_user(exact, load_quantity(g, BEGIN), time, load_quantity(g, MOMENT) / time);
    const wide rates = exact->nutation.fast + exact->first.fast + exact->second.fast;
    const unsigned alone = mask_bits(mask_not(can_lanes_compute_top(&s->top))),
                   finite = mask_bits(wide_less(wide_abs(rates), wide_splat(INFINITY)));
    const int rest = g.all->count - g.first, count = rest < LANES ? rest : LANES;
    for (int i = 0; i < count; i++) {
        const size_t index = g.all->index[g.first + i];
        request->status[index] = finite >> i & 1 ? KR_OK : KR_ERR_ARGUMENT;
        if (alone >> i & 1) kr_exact_run_top(request, index);
    }
    write_group_results(request, g, exact, finite & ~alone & ((1u << count) - 1));
}
/* Computes and removes all tops of a queue. Unused SIMD lanes contain copies of the first top. */
APART void compute_and_empty_queue(const kr_exact_request *request, batch_queue *w)
{
    lagrange_setup s[GROUPS];
    const int groups = (w->count + LANES - 1) / LANES;
    for (int lane = w->count; lane < groups * LANES; lane++)
        for (int i = 0; i < NUMBERS; i++) w->in[i][lane] = w->in[i][0];
    for (int i = 0; i < groups; i++) convert_and_prepare_group((group){w, i * LANES}, &s[i]);
    set_up_tops_with_moving_axis(s, groups);
    for (int i = 0; i < groups; i++)
        write_group_or_single_tops(request, (group){w, i * LANES}, &s[i]);
    w->count = w->turned[0] = w->turned[1] = 0;
    wide_zero_upper();
}
void KR_NAME(kr_exact_batch)(const kr_exact_request *request)
{
    body_data known;
    batch_queue queues[2];
    for (int i = 0; i < 2; i++) queues[i].count = queues[i].turned[0] = queues[i].turned[1] = 0;
    for (size_t i = 0; i < request->n; i++) {
        const kr_scene *scene = &request->scenes[i];
        if (i == 0 || memcmp(&known.body, &scene->body, sizeof known.body) != 0)
            set_body_data(&scene->body, &known);
        if (known.fits && known.gravity != scene->gravity) set_gravity_data(scene, &known);
        if (!known.fits || !add_top_to_queue(queues, scene, i, &known))
            kr_exact_run_top(request, i);
        for (int top = 0; top < 2; top++)
            if (queues[top].count == MANY) compute_and_empty_queue(request, &queues[top]);
    }
    for (int top = 0; top < 2; top++) compute_and_empty_queue(request, &queues[top]);
}
