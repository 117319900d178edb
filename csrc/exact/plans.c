/* The closed forms of many tops: of heavy tops as many at a time as there are lanes, each lane with
 * the bits of a top alone (setup.h). Tops that are not of that kind, that rest at a pole, or that
 * are refused go one by one. This file is compiled once per instruction set. */
#define KR_EXACT_LANES
#include "dispatch.h"
#include "frame.h"
#include "lagrange.h"
#include "numbers/binary.h"

/* At more times than these a top's states are read one top at a time. */
enum { FEW_TIMES = 16 };
/* A closed form without its frame is so many doubles, and begins as kr_exact does. */
enum { FORM = sizeof(exact_lanes) / sizeof(wide) };
typedef char form_is_laid_out[FORM * sizeof(double) == offsetof(kr_exact, frame) ? 1 : -1];

/* What all tops of one body have in common. */
typedef struct known_body {
    kr_body body;
    int fits; /* it is one for lanes */
    kr_working working;
    double mass, reach; /* fractions of mass and |com| */
    int power;          /* the sum of their exponents */
    int framed[2];      /* whether tops seen from above, and from below, have a frame */
    kr_quat frame[2][4];
} known_body;

/* The numbers that a lane is given: moments, attitude, momentum, the axes of the body and of the
 * work, what the lever is a product of, units, and when the motion begins. */
enum {
    INERTIA,
    Q = 3,
    M = 7,
    AXES = 10,
    MASS = 18,
    GRAVITY,
    REACH,
    SCALE,
    MOMENT,
    TIME,
    BEGIN,
    NUMBERS
};
/* Tops that wait until all lanes have one. */
typedef struct waiting {
    int count, turned[2]; /* how many; whether any of these axes are not one */
    size_t index[LANES];
    int framed[LANES];
    kr_quat frame[LANES][4];
    double in[NUMBERS][LANES];
} waiting;

/* Finds out what tops of this body have in common. */
static void know(const kr_body *body, known_body *known)
{
    const kr_scene scene = {.body = *body};
    memcpy(&known->body, body, sizeof *body);
    known->fits = kr_body_check(body) == KR_OK && kr_body_kind(body, KR_KIND_RTOL) == KR_LAGRANGE;
    if (!known->fits) return;
    known->working = kr_body_working(body);
    known->fits = !known->working.tilted;
    const kr_pull pull = kr_scene_pull(&scene, body->com);
    const kr_quat axes = q_unit(q_mul(body->axes, known->working.axes));
    known->mass = pull.mass;
    known->reach = q_turn_back(known->working.axes, pull.com).z;
    known->power = pull.power;
    fill_frame_below(known->frame[1]);
    for (int below = 0; below < 2; below++) {
        known->framed[below] = below || !is_one(axes);
        if (!is_one(axes)) fill_frame_axes(known->frame[below], below, axes);
    }
}
static void put(double in[][LANES], int to, int from, const double numbers[], int count)
{
    for (int i = 0; i < count; i++) in[from + i][to] = numbers[i];
}
/* Writes the numbers of a scene into its lane. */
static void put_scene(waiting *w, const kr_scene *scene, const known_body *known, kr_units units)
{
    const kr_quat q = scene->start.q, body = scene->body.axes, work = known->working.axes;
    const kr_vec3 m = scene->start.m, i = known->working.inertia;
    const double numbers[] = {i.x, i.y, i.z, q.w, q.x, q.y, q.z, m.x, m.y, m.z};
    const double axes[] = {body.w, body.x, body.y, body.z, work.w, work.x, work.y, work.z};
    const double others[] = {units.moment, units.time, scene->start.t};
    put(w->in, w->count, INERTIA, numbers, 10);
    put(w->in, w->count, AXES, axes, 8);
    put(w->in, w->count, MOMENT, others, 3);
    w->turned[0] |= !is_one(body);
    w->turned[1] |= !is_one(work);
}
/* Lets a top wait for its lane, and says whether it may. */
static int enter(waiting *w, const kr_scene *scene, size_t index, const known_body *known)
{
    kr_units units;
    int exponent;
    if (scene->gravity == 0.0 || v_largest(scene->damping) > 0.0) return 0;
    if (kr_scene_check_start(scene) != KR_OK) return 0;
    if (kr_scene_units(scene, &known->working, &units) != KR_OK) return 0;
    const double gravity = fraction_of(scene->gravity, &exponent);
    const int power =
        known->power + exponent - exponent_of(units.moment) + 2 * exponent_of(units.time);
    if (power < -1000 || power > 1000) return 0; /* It has no power of two. */
    const double pull[] = {known->mass, gravity, known->reach, power_of_2(power)};
    const int below = gravity * known->reach < 0.0;
    put_scene(w, scene, known, units);
    put(w->in, w->count, MASS, pull, 4);
    w->framed[w->count] = known->framed[below];
    if (known->framed[below])
        memcpy(w->frame[w->count], known->frame[below], sizeof known->frame[below]);
    w->index[w->count++] = index;
    return 1;
}
INLINE wide in_lanes(const waiting *w, int number) { return wide_load(w->in[number]); }

/* Turns the attitude first by the axes that begin here, where they are not one; read_top does so for
 * one top. */
INLINE void turn_lanes(exact_top *top, const waiting *w, int axes)
{
    const quat_lanes by = {in_lanes(w, axes), in_lanes(w, axes + 1), in_lanes(w, axes + 2),
                           in_lanes(w, axes + 3)};
    const wide zero = wide_splat(0.0);
    const mask one = mask_and(mask_and(wide_equal(by.x, zero), wide_equal(by.y, zero)),
                              wide_equal(by.z, zero));
    dd turned[4];
    memcpy(turned, top->q, sizeof turned);
    turn_first(turned, by);
    take_lanes(top->q, turned, sizeof turned, mask_not(one));
}
/* Brings those who wait into working axes and own units. */
INLINE exact_top read_lanes(const waiting *w)
{
    const wide inverse = 1.0 / in_lanes(w, MOMENT), time = in_lanes(w, TIME),
               scale = in_lanes(w, SCALE);
    const dd lever = dd_times(in_lanes(w, MASS),
                              dd_times(in_lanes(w, GRAVITY), dd_of(in_lanes(w, REACH))));
    exact_top top;
    for (int i = 0; i < 4; i++) top.q[i] = dd_of(in_lanes(w, Q + i));
    if (w->turned[0]) turn_lanes(&top, w, AXES);
    if (w->turned[1]) turn_lanes(&top, w, AXES + 4);
    top.inertia.x = inverse * in_lanes(w, INERTIA);
    top.inertia.y = inverse * in_lanes(w, INERTIA + 1);
    top.inertia.z = inverse * in_lanes(w, INERTIA + 2);
    top.m.x = time * (inverse * in_lanes(w, M));
    top.m.y = time * (inverse * in_lanes(w, M + 1));
    top.m.z = time * (inverse * in_lanes(w, M + 2));
    top.lever = dd_make(scale * lever.hi, scale * lever.lo);
    return top;
}
/* Says in which lanes the axis leans or moves by so much that it neither stands nor fails
 * kr_exact_resolves, and is pulled. */
INLINE mask moves(const exact_top *top)
{
    const wide least = wide_splat(1e-10);
    const wide side = wide_max(wide_abs(top->q[1].hi), wide_abs(top->q[2].hi)),
               up = wide_max(wide_abs(top->q[0].hi), wide_abs(top->q[3].hi)),
               push = wide_max(wide_abs(top->m.x), wide_abs(top->m.y));
    return mask_and(wide_less(wide_splat(0.0), wide_abs(top->lever.hi)),
                    wide_less(least, wide_max(wide_min(side, up), push)));
}
/* What became of those who waited, as bits of lanes. */
typedef struct became {
    unsigned alone, refused; /* they have to be planned alone; a rate is beyond all numbers */
} became;

/* Sets up the closed forms of those who wait, without their frames. */
APART became set_up_lanes(const waiting *w, exact_lanes *exact)
{
    const wide time = in_lanes(w, TIME);
    exact_top top = read_lanes(w);
    const mask below = is_negative(top.lever.hi);
    if (mask_any(below)) {
        const exact_top seen = seen_from_below(&top);
        take_lanes(&top, &seen, sizeof top, below);
    }
    const dd i1 = equal_moment(&top);
    const initial s = initial_of(&top, i1);
    lagrange_moving(exact, &top, &s, i1, half_spin_of(&top, &s, i1));
    if (mask_any(below)) {
        exact_lanes turned = *exact;
        turn_over(&turned);
        take_lanes(exact, &turned, sizeof turned, below);
    }
    to_user(exact, in_lanes(w, BEGIN), time, in_lanes(w, MOMENT) / time);
    const wide rates = exact->nutation.fast + exact->first.fast + exact->second.fast;
    const became r = {mask_bits(mask_not(moves(&top))),
                      mask_bits(mask_not(wide_less(wide_abs(rates), wide_splat(INFINITY))))};
    return r;
}

/* The closed forms of all lanes, as doubles. */
typedef struct forms {
    double form[FORM][LANES];
} forms;

/* Gives the closed form of a lane. */
static void put_form(const forms *f, const waiting *w, int lane, kr_exact *out)
{
    const int curve = (int)f->form[offsetof(exact_lanes, curve) / sizeof(wide)][lane];
    double row[FORM];
    for (int i = 0; i < FORM; i++) row[i] = f->form[i][lane];
    memcpy(out, row, sizeof row);
    out->curve = curve;
    out->framed = w->framed[lane];
    if (out->framed)
        memcpy(out->frame, w->frame[lane], sizeof out->frame);
    else
        memset(out->frame, 0, sizeof out->frame);
}
static const double *times_of(const kr_exact_asked *asked, size_t index)
{
    return asked->own_times ? asked->t + index * asked->times : asked->t;
}
/* Returns the states of all lanes at a time each, without the frames around them. */
APART state_lanes states_in_lanes(const exact_lanes *exact, wide time)
{
    const dd span = two_sum(time, -exact->begin);
    const mask dual = is_dual(exact);
    if (mask_all(dual)) return kernel(exact, 1, 0, time, span);
    state_lanes r = kernel(exact, 0, 0, time, span);
    if (mask_any(dual)) {
        const state_lanes some = kernel(exact, 1, 0, time, span);
        take_lanes(&r, &some, sizeof r, dual);
    }
    return r;
}
/* Reads the k-th state of the lanes that are good. */
static void read_states(const kr_exact_asked *asked, const waiting *w, const exact_lanes *exact,
                        unsigned good, size_t k)
{
    double t[LANES], s[8][LANES];
    for (int i = 0; i < LANES; i++)
        t[i] = times_of(asked, w->index[i < w->count ? i : 0])[k];
    const wide time = wide_load(t);
    const unsigned within = mask_bits(is_within(exact, two_sum(time, -exact->begin).hi));
    const state_lanes states = states_in_lanes(exact, time);
    memcpy(s, &states, sizeof s);
    for (int i = 0; i < w->count; i++) {
        if (!(good >> i & 1)) continue;
        kr_state *out = &asked->states[w->index[i] * asked->times + k];
        if (within >> i & 1) {
            const kr_quat q = q4(s[1][i], v3(s[2][i], s[3][i], s[4][i]));
            out->t = s[0][i];
            out->q = w->framed[i] ? framed(w->frame[i], q) : q;
            out->m = v3(s[5][i], s[6][i], s[7][i]);
        } else {
            kr_exact one;
            forms f;
            memcpy(&f, exact, sizeof f);
            put_form(&f, w, i, &one);
            *out = kr_exact_state(&one, t[i]);
        }
    }
}
static void plan_alone(const kr_exact_asked *asked, size_t index)
{
    kr_exact one;
    asked->status[index] = kr_exact_plan(&asked->scenes[index], &one);
    if (asked->status[index] != KR_OK) return;
    if (asked->plans) asked->plans[index] = one;
    if (asked->times > 0)
        KR_NAME(kr_exact_many)(&one, asked->times, times_of(asked, index),
                               asked->states + index * asked->times);
}
/* Writes what was asked of the lanes that are good. */
static void write_lanes(const kr_exact_asked *asked, const waiting *w, const exact_lanes *exact,
                        unsigned good)
{
    const int many = asked->times > FEW_TIMES;
    forms f;
    memcpy(&f, exact, sizeof f);
    for (int i = 0; i < w->count && (many || asked->plans); i++) {
        const size_t index = w->index[i];
        kr_exact one, *out = asked->plans ? &asked->plans[index] : &one;
        if (!(good >> i & 1)) continue;
        put_form(&f, w, i, out);
        if (many)
            KR_NAME(kr_exact_many)(out, asked->times, times_of(asked, index),
                                   asked->states + index * asked->times);
    }
    for (size_t k = 0; k < asked->times && !many; k++) read_states(asked, w, exact, good, k);
}
/* Does what is asked for those who wait. Lanes without a top do what the first does. */
static void flush(const kr_exact_asked *asked, waiting *w)
{
    exact_lanes exact;
    if (w->count == 0) return;
    for (int lane = w->count; lane < LANES; lane++)
        for (int i = 0; i < NUMBERS; i++) w->in[i][lane] = w->in[i][0];
    const became b = set_up_lanes(w, &exact);
    for (int i = 0; i < w->count; i++) {
        asked->status[w->index[i]] = b.refused >> i & 1 ? KR_ERR_ARGUMENT : KR_OK;
        if (b.alone >> i & 1) plan_alone(asked, w->index[i]);
    }
    write_lanes(asked, w, &exact, ~(b.alone | b.refused));
    w->count = w->turned[0] = w->turned[1] = 0;
}
void KR_NAME(kr_exact_all)(const kr_exact_asked *asked)
{
    known_body known;
    waiting w;
    w.count = w.turned[0] = w.turned[1] = 0;
    for (size_t i = 0; i < asked->n; i++) {
        const kr_scene *scene = &asked->scenes[i];
        if (i == 0 || memcmp(&known.body, &scene->body, sizeof known.body) != 0)
            know(&scene->body, &known);
        if (!known.fits || !enter(&w, scene, i, &known)) plan_alone(asked, i);
        if (w.count == LANES) flush(asked, &w);
    }
    flush(asked, &w);
}
