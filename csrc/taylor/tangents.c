/* Tangents along a path of the Taylor method: initial values, propagation, and evaluation within a
 * step. If the truncation error of a tangent is too large, the step is divided into substeps. Each
 * substep works on a copy of the Taylor series of the path, so tangents do not affect the
 * motion. */
#include "support_setup.h"
#include "tangents.h"

static const kr_support_ops *const supports = FOR_SUPPORTS(&kr_supports);
/* Maximum number of substeps in a step, and maximum number of attempts to shorten a substep. */
enum { MAX_SUBSTEPS = 64, MAX_SHORTENINGS = 32 };
/* Largest admissible relative truncation error of a tangent, divided by the tolerance of the path.
 * For most motions, the truncation errors of the tangents remain below this limit, so no substeps
 * are needed. */
static const double rest_over_tolerance = 0x1p9;

/* Header of the memory block for tangents, which contains the Taylor series of the motion on one
 * substep. The tangents are stored in the memory block after this header. */
typedef struct {
    kr_series path[2];
    double substeps;         /* number of substeps of the last step */
    double from, to;         /* start and end of the last step */
    double substep;          /* number of the substep whose series are in memory, from 1 */
    double until;            /* end of this substep */
    double moving;           /* nonzero if the terms of support_deviation.h are needed */
    double from_low, to_low; /* low words of `from` and `to` */
} tangent_work;
static tangent_work *tangent_work_of(double *memory) { return (tangent_work *)memory; }

static size_t words_of(int digits) { return digits > 16 ? 2 : 1; }
static kr_tangent *tangent(const kr_motion *motion, double *memory, size_t i)
{
    return (kr_tangent *)(tangent_work_of(memory) + 1) + i * words_of(motion->digits);
}
/* Returns the number of batches of tangents, which precede the remaining single tangents in memory.
 * Tangents are bitwise equal whether computed in batches or one by one, so a small build can omit
 * batches. Tangents of tops with friction or on moving supports are never combined in batches. */
static size_t count_batches(double *memory, size_t n)
{
#ifdef KR_NO_BATCHES
    (void)memory, (void)n;
    return 0;
#else
    if (memory && tangent_work_of(memory)->moving != 0.0) return 0;
    return n / KR_DEVIATION_BATCH + (n % KR_DEVIATION_BATCH >= KR_DEVIATION_BATCH_MIN);
#endif
}
/* Returns the number of tangents that are propagated singly instead of in batches. */
static size_t count_single(double *memory, size_t n)
{
    const size_t batched = KR_DEVIATION_BATCH * count_batches(memory, n);
    return n > batched ? n - batched : 0;
}
/* Returns the number of kr_tangent structs needed to store n tangents in batches and singly. */
static size_t count_structs(double *memory, size_t n)
{
    return KR_DEVIATION_BATCH_STRUCTS * count_batches(memory, n) + count_single(memory, n);
}

/* Memory address of a tangent: its first struct `from`, its lane if it belongs to a batch, and the
 * distance `apart` between its components. The member `apart` is a number of doubles, and is 0 for
 * a tangent that does not belong to a batch. */
typedef struct {
    kr_tangent *from;
    size_t lane, apart;
} deviation_address;
static deviation_address address_of(const kr_motion *motion, double *memory, size_t n, size_t i)
{
    const size_t batched = KR_DEVIATION_BATCH * count_batches(memory, n);
    if (i >= batched) {
        const size_t behind = KR_DEVIATION_BATCH_STRUCTS * count_batches(memory, n) + (i - batched);
        return (deviation_address){tangent(motion, memory, behind), 0, 0};
    }
    return (deviation_address){
        tangent(motion, memory, i / KR_DEVIATION_BATCH * KR_DEVIATION_BATCH_STRUCTS),
        i % KR_DEVIATION_BATCH, words_of(motion->digits) * sizeof(kr_tangent) / sizeof(double)};
}
/* Returns the address of component k of a tangent in the array `numbers` of its struct. */
static double *component_address(const deviation_address *at, double *numbers, size_t k)
{
    return numbers + (at->apart > 0 ? at->lane + k * at->apart : 1 + k + k / 3);
}
/* Returns the baseline instruction set, which is the last one in the table. */
static const kr_isa *base_isa(void)
{
    int i = 0;
    while (kr_taylor_isa(i + 1)) i++;
    return kr_taylor_isa(i);
}
static const kr_tangents_kernel *tangent_kernel(const kr_motion *motion)
{
    const kr_isa *known = kr_taylor_isa_of(motion), *isa = known ? known : base_isa();
    return motion->digits > 16 ? isa->deep_tangents : isa->tangents;
}
static int order_of(const kr_motion *motion) { return ((const kr_kernel *)motion->aux)->order; }

static size_t count_doubles(int digits, size_t n)
{
    const size_t structs = count_structs(NULL, n), most = structs > n ? structs : n;
    return (sizeof(tangent_work) + most * words_of(digits) * sizeof(kr_tangent)) / sizeof(double);
}

/* Writes a number. The low word is written only if more than 16 digits are requested. */
static void put_number(const kr_motion *motion, double *high, dd a)
{
    *high = a.hi;
    if (motion->digits > 16) high[sizeof(kr_tangent) / sizeof(double)] = a.lo;
}
/* Reads a number. Negative zeros are replaced by positive zeros, because the sign of a zero may
 * depend on other tangents in the batch. */
static dd get_number(const kr_motion *motion, const double *high)
{
    return (dd){*high + 0.0,
                motion->digits > 16 ? high[sizeof(kr_tangent) / sizeof(double)] + 0.0 : 0.0};
}
/* Stores the three components of a vector in the elements 1 to 3 of an array of four numbers. */
static void put_padded_vector(const kr_motion *motion, double *high, vec_dd v)
{
    put_number(motion, high + 1, v.x);
    put_number(motion, high + 2, v.y);
    put_number(motion, high + 3, v.z);
}
/* Stores a vector as components k to k + 2 of a tangent. */
static void put_components(const kr_motion *motion, const deviation_address *at, double *numbers,
                           size_t k, vec_dd v)
{
    put_number(motion, component_address(at, numbers, k), v.x);
    put_number(motion, component_address(at, numbers, k + 1), v.y);
    put_number(motion, component_address(at, numbers, k + 2), v.z);
}
static vec_dd get_components(const kr_motion *motion, const deviation_address *at, double *numbers,
                             size_t k)
{
    return (vec_dd){get_number(motion, component_address(at, numbers, k)),
                    get_number(motion, component_address(at, numbers, k + 1)),
                    get_number(motion, component_address(at, numbers, k + 2))};
}
static void set_tangent_constants(kr_tangent *g, const kr_motion *motion)
{
    const kr_vec3 none = {0.0, 0.0, 0.0}, one = {1.0, 1.0, 1.0};
    const double rate = taylor_of(motion)->rate;
    const vec_dd A = motion->body->inertia,
                 ahead = {dd_sub(A.x, A.z), dd_sub(A.y, A.x), dd_sub(A.z, A.y)},
                 behind = {ahead.y, ahead.z, ahead.x},
                 c = vdd_scale_exactly(1.0 / (rate * rate), motion->body->lever),
                 up = {c.y, c.z, c.x}, down = {dd_neg(c.z), dd_neg(c.x), dd_neg(c.y)};
    put_padded_vector(motion, g->ahead, vdd_over(ahead, A));
    put_padded_vector(motion, g->behind, vdd_over(behind, A));
    put_padded_vector(motion, g->per, vdd_over(v_dd(one, none), A));
    put_padded_vector(motion, g->drag, vdd_scale_exactly(1.0 / rate, v_dd(motion->damping, none)));
    put_padded_vector(motion, g->up, up);
    put_padded_vector(motion, g->down, down);
    put_padded_vector(motion, g->rotor, vdd_scale_exactly(1.0 / rate, motion->body->rotor));
    g->damped = v_largest(motion->damping);
    g->gyrostat = v_largest(motion->rotor);
}
/* Sets the derivatives of the lever arm, the moments of inertia and the damping with respect to
 * the parameter that belongs to the tangent. */
static void set_changes(const deviation_address *at, const kr_motion *motion, const kr_seed *seed)
{
    const double rate = taylor_of(motion)->rate;
    const kr_vec3 none = {0.0, 0.0, 0.0};
    kr_tangent *g = at->from;
    put_components(motion, at, g->moments, 0, v_dd(seed->moments, none));
    put_components(motion, at, g->drags, 0,
                   vdd_scale_exactly(1.0 / rate, v_dd(seed->damping, none)));
    put_components(motion, at, g->lever, 0, vdd_scale_exactly(1.0 / (rate * rate), seed->lever));
    put_components(motion, at, g->rotor_of, 0, vdd_scale_exactly(1.0 / rate, seed->rotor));
    g->rotor_changes = fmax(g->rotor_changes, v_largest(vdd_high(seed->rotor)));
    if (at->apart == 0) {
        put_padded_vector(motion, g->pull, vdd_scale_exactly(1.0 / (rate * rate), seed->pull));
        v_put(g->turning_of + 1, seed->turning);
        g->timing = seed->timing;
        put_padded_vector(motion, g->apex_of, seed->apex);
        g->friction_of = seed->friction / (rate * rate);
        g->gradient_of = seed->gradient / (rate * rate);
    }
    g->changes = fmax(g->changes, fmax(v_largest(seed->moments), v_largest(vdd_high(seed->lever))));
    g->drag_changes = fmax(g->drag_changes, v_largest(seed->damping));
}
/* Updates the tangents if the friction torque jumps at the end of the last step. */
static void pass_stop(const kr_motion *motion, double *memory, size_t n)
{
    const kr_taylor *p = taylor_of(motion);
    dd factor;
    if (supports && motion->scene->friction > 0.0 &&
        supports->jumps(motion, order_of(motion), &factor))
        supports->jump_tangents(motion, p->rate, p->series, tangent(motion, memory, 0), n, factor);
}
/* Returns 1 if there is dry friction, if the support moves, or if a tangent is a derivative with
 * respect to a parameter of the support motion. */
static int needs_support_terms(const kr_motion *motion, size_t n, const kr_seed seeds[])
{
    if (!supports) return 0;
    for (size_t i = 0; i < n; i++)
        if (seeds[i].timing >= KR_TIMING_AMPLITUDE || v_largest(seeds[i].turning) > 0.0 ||
            seeds[i].gradient != 0.0)
            return 1;
    return kr_support_moves(motion->scene);
}
/* Initializes n tangents at the end of the last step of the motion. */
static void tangents_begin(const kr_motion *motion, double *memory, size_t n, const kr_seed seeds[])
{
    const size_t words = words_of(motion->digits);
    const kr_series *s = taylor_of(motion)->series;
    const quat_dd to_body = qdd_conj(qdd_unit(qdd_load(s[0].end_x, s[1].end_x)));
    memset(memory, 0, count_doubles(motion->digits, n) * sizeof(double));
    taylor_of(motion)->has_tangents = 1.0;
    tangent_work_of(memory)->moving = needs_support_terms(motion, n, seeds);
    tangent_work_of(memory)->from = tangent_work_of(memory)->to = s->end;
    for (size_t i = 0; i < count_structs(memory, n); i++)
        set_tangent_constants(tangent(motion, memory, i), motion);
    for (size_t i = 0; i < n; i++) {
        const deviation_address to = address_of(motion, memory, n, i);
        const kr_deviation *start = &seeds[i].at_start;
        set_changes(&to, motion, &seeds[i]);
        put_components(motion, &to, to.from->end, 0, start->turn);
        put_components(
            motion, &to, to.from->end, 3,
            vdd_scale_exactly(1.0 / taylor_of(motion)->rate, qdd_turn(to_body, start->push)));
    }
    pass_stop(motion, memory, n);
    for (size_t i = 0; i < count_structs(memory, n) * words; i++) {
        kr_tangent *g = tangent(motion, memory, 0) + i;
        g->t = s[i % words].end;
        memcpy(g->x[0], g->end, sizeof g->end);
        memcpy(g->begin, g->end, sizeof g->end);
    }
}

static double square_of(const deviation_address *at, double *numbers)
{
    double sum = 0.0;
    for (size_t k = 0; k < 6; k++) {
        const double x = *component_address(at, numbers, k);
        sum += x * x;
    }
    return sum;
}
/* Evaluates all tangents at the time path->at, and stores the values in `substep_end`. Returns the
 * largest relative truncation error, or INFINITY if a tangent is not finite. */
static double sum_tangents(const kr_motion *motion, double *memory, size_t n)
{
    const int order = order_of(motion);
    const double *to = &tangent_work_of(memory)->path->at;
    const double power = pow(*to - tangent(motion, memory, 0)->t, order);
    double worst = 0.0;
    for (size_t i = 0; i < count_structs(memory, n); i++) {
        kr_tangent *g = tangent(motion, memory, i);
        tangent_kernel(motion)->sum(g, order, to, g->substep_end);
    }
    for (size_t i = 0; i < n; i++) {
        const deviation_address at = address_of(motion, memory, n, i);
        const double size = square_of(&at, at.from->substep_end),
                     last = power * power * square_of(&at, at.from->x[order]);
        if (!isfinite(size)) return INFINITY;
        if (last > worst * worst * size) worst = sqrt(last / size);
    }
    return worst;
}
static void expand_tangents(const kr_motion *motion, double *memory, size_t n)
{
    const kr_tangents_kernel *kernel = tangent_kernel(motion);
    const kr_series *path = tangent_work_of(memory)->path;
    kr_tangent *first = tangent(motion, memory, 0),
               *rest_of_them =
                   tangent(motion, memory, KR_DEVIATION_BATCH_STRUCTS * count_batches(memory, n));
    if (tangent_work_of(memory)->moving != 0.0) {
        supports->expand_tangents(motion, taylor_of(motion)->rate, path, first, n,
                                  order_of(motion));
        return;
    }
    if (count_batches(memory, n) > 0)
        kernel->expand_batches(path, first, count_batches(memory, n), order_of(motion));
    if (count_single(memory, n) > 0)
        kernel->expand(path, rest_of_them, count_single(memory, n), order_of(motion));
}
/* Starts new Taylor series of the path and of the tangents at the time `at`. */
static void restart_series(const kr_motion *motion, double *memory, size_t n)
{
    const kr_kernel *kernel = motion->aux;
    kr_series *path = tangent_work_of(memory)->path;
    const size_t words = words_of(motion->digits);
    kr_taylor_end_at(path, kernel);
    for (size_t word = 0; word < words; word++) path[word].t = path[word].end;
    if (path->linear > 1.0) supports->place(path, motion, taylor_of(motion)->rate);
    kernel->advance(path, taylor_of(motion)->log2_tol, 1.0);
    for (size_t i = 0; i < count_structs(memory, n) * words; i++) {
        kr_tangent *g = tangent(motion, memory, 0) + i;
        g->t = path[i % words].t;
        memcpy(g->x[0], g->substep_end, sizeof g->substep_end);
    }
}
/* Shortens a substep until its relative truncation error does not exceed the limit `most`. The
 * argument `worst` is the relative truncation error of the tangents at the time `to`. Returns the
 * relative truncation error of the tangents at the end of the shortened substep. */
static double shorten(const kr_motion *motion, double *memory, size_t n, double to, double worst,
                      double most)
{
    tangent_work *c = tangent_work_of(memory);
    const double from = tangent(motion, memory, 0)->t;
    const int order = order_of(motion);
    double h = to - from;
    c->path[1].at = 0.0;
    for (int i = 0; i < MAX_SHORTENINGS && !(worst <= most); i++) {
        const double share = pow(most / worst, 1.0 / order);
        h = share > 0.01 ? h * 0.9 * share : 0.01 * h;
        c->path[0].at = from + h;
        worst = sum_tangents(motion, memory, n);
    }
    return worst;
}
/* Returns the largest admissible relative truncation error of a tangent. */
static double truncation_tolerance(const kr_motion *motion)
{
    return rest_over_tolerance * exp2(taylor_of(motion)->log2_tol);
}
/* Computes the Taylor series of the tangents for one substep. The substep ends at the end of the
 * step, or earlier if the truncation error of a tangent would be too large. Returns the largest
 * relative truncation error of the tangents at the end of the substep. */
static double expand_substep(const kr_motion *motion, double *memory, size_t n)
{
    const double most = truncation_tolerance(motion);
    tangent_work *c = tangent_work_of(memory);
    expand_tangents(motion, memory, n);
    c->path[0].at = c->to;
    c->path[1].at = c->to_low;
    double worst = sum_tangents(motion, memory, n);
    if (!(worst <= most)) worst = shorten(motion, memory, n, c->to, worst, most);
    c->until = c->path[0].at;
    return worst;
}
/* Computes the Taylor series of the tangents for the first substep of the last step. Returns the
 * largest relative truncation error of the tangents at the end of this substep. */
static double expand_first_substep(const kr_motion *motion, double *memory, size_t n)
{
    const size_t words = words_of(motion->digits);
    tangent_work *c = tangent_work_of(memory);
    for (size_t i = 0; i < count_structs(memory, n) * words; i++) {
        kr_tangent *g = tangent(motion, memory, 0) + i;
        g->t = i % words ? c->from_low : c->from;
        memcpy(g->x[0], g->begin, sizeof g->begin);
    }
    memcpy(c->path, taylor_of(motion)->series, words * sizeof(kr_series));
    c->substep = 1.0;
    return expand_substep(motion, memory, n);
}
/* Computes the Taylor series of the tangents for the next substep. Returns the largest relative
 * truncation error of the tangents at the end of the next substep. */
static double expand_next_substep(const kr_motion *motion, double *memory, size_t n)
{
    restart_series(motion, memory, n);
    tangent_work_of(memory)->substep += 1.0;
    return expand_substep(motion, memory, n);
}
/* Propagates all tangents over the last step of the path. Returns the largest relative truncation
 * error of all substeps. Returns INFINITY if a tangent overflows, if a substep cannot be made short
 * enough, or if MAX_SUBSTEPS substeps do not suffice. */
static double propagate_over_substeps(const kr_motion *motion, double *memory, size_t n)
{
    const double most = truncation_tolerance(motion);
    tangent_work *c = tangent_work_of(memory);
    double rest = 0.0, last = expand_first_substep(motion, memory, n);
    while (last <= most) {
        rest = fmax(rest, last);
        c->substeps = c->substep;
        if (c->until == c->to) return rest;
        if (c->substep >= MAX_SUBSTEPS) return INFINITY;
        last = expand_next_substep(motion, memory, n);
    }
    return INFINITY;
}
/* Propagates n tangents over the last step of the path. Sets the tangents to NaN on failure. */
static kr_status tangents_follow(const kr_motion *motion, double *memory, size_t n)
{
    const kr_series *s = taylor_of(motion)->series;
    const size_t all = count_structs(memory, n) * words_of(motion->digits);
    tangent_work *c = tangent_work_of(memory);
    kr_tangent *first = tangent(motion, memory, 0);
    for (size_t i = 0; i < all; i++) memcpy(first[i].begin, first[i].end, sizeof first->end);
    c->from = s->t;
    c->to = s->end;
    c->from_low = motion->digits > 16 ? s[1].t : 0.0;
    c->to_low = motion->digits > 16 ? s[1].end : 0.0;
    const double last = propagate_over_substeps(motion, memory, n);
    for (size_t i = 0; i < all; i++)
        for (int k = 0; k < 8; k++)
            first[i].end[k] = last < INFINITY ? first[i].substep_end[k] : NAN;
    if (last < INFINITY) pass_stop(motion, memory, n);
    if (last > first->truncation) first->truncation = last;
    return last < INFINITY ? KR_OK : KR_ERR_TANGENT;
}

/* Computes the Taylor series of the tangents for the substep that contains the time `to`, unless
 * these series are already in memory. Substeps are rarely recomputed, because the requested times
 * usually increase from call to call. */
static void find_substep(const kr_motion *motion, double *memory, size_t n, double to)
{
    tangent_work *c = tangent_work_of(memory);
    const double forward = c->to < c->from ? -1.0 : 1.0;
    if (forward * (to - tangent(motion, memory, 0)->t) < 0.0)
        expand_first_substep(motion, memory, n);
    while (c->substep < fmin(c->substeps, MAX_SUBSTEPS) && forward * (to - c->until) > 0.0)
        expand_next_substep(motion, memory, n);
}
/* Evaluates all tangents at the sampled time in the last step, and stores them in `at`. */
static void evaluate_tangents(const kr_motion *motion, double *memory, size_t n)
{
    const kr_series *s = taylor_of(motion)->series;
    const size_t words = words_of(motion->digits);
    const tangent_work *c = tangent_work_of(memory);
    kr_tangent *first = tangent(motion, memory, 0);
    if (s->at == c->to && (words == 1 || s[1].at == c->to_low)) {
        for (size_t i = 0; i < count_structs(memory, n) * words; i++)
            memcpy(first[i].at, first[i].end, sizeof first->end);
        return;
    }
    find_substep(motion, memory, n, s->at);
    for (size_t i = 0; i < count_structs(memory, n); i++)
        tangent_kernel(motion)->sum(first + i * words, order_of(motion), &s->at,
                                    first[i * words].at);
}
/* Converts a momentum change from the body frame to the space frame. If at most 16 digits are
 * requested, the vector is rotated in double precision, because double-double arithmetic would
 * dominate the run time. */
static vec_dd push_in_space(const kr_motion *motion, quat_dd q, vec_dd push)
{
    const kr_vec3 none = {0.0, 0.0, 0.0};
    return vdd_scale_exactly(taylor_of(motion)->rate,
                             motion->digits > 16 ? qdd_turn(q, push)
                                                 : v_dd(q_turn(qdd_high(q), vdd_high(push)), none));
}
static void tangents_at(const kr_motion *motion, kr_quat attitude, double *memory, size_t n,
                        kr_deviation out[])
{
    const quat_dd q = q_dd(attitude, motion->low.q);
    evaluate_tangents(motion, memory, n);
    for (size_t i = 0; i < n; i++) {
        const deviation_address from = address_of(motion, memory, n, i);
        out[i].turn = get_components(motion, &from, from.from->at, 0);
        out[i].push = push_in_space(motion, q, get_components(motion, &from, from.from->at, 3));
    }
}
static double tangents_truncation(const kr_motion *motion, double *memory)
{
    return tangent(motion, memory, 0)->truncation;
}

const kr_tangent_ops kr_taylor_tangents = {kr_tangents_start, count_doubles, tangents_begin,
                                           tangents_follow,   tangents_at,   tangents_truncation};
