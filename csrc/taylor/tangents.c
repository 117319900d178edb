/* Tangents (tangents.h) along the motion of a top by the Taylor method: initial values,
 * propagation, and evaluation within a step. The Taylor series of the motion is called the path. A
 * tangent consists of a rotation vector theta and a momentum change N. The truncation error of a
 * tangent is the ratio of its last Taylor term to its norm. If the truncation error is too large at
 * the end of a step, the step is divided into substeps. Each substep works on a copy of the path,
 * so tangents do not affect the motion. */
#include "support_setup.h"
#include "tangents.h"

static const kr_support_ops *const supports = FOR_SUPPORTS(&kr_supports);
/* Maximum number of substeps in a step, and maximum number of attempts to shorten a substep. */
enum { MAX_SUBSTEPS = 64, MAX_SHORTENINGS = 32 };
/* Largest permitted truncation error of a tangent, divided by the tolerance of the motion,
 * 2^kr_taylor.log2_tol. In most motions, the errors are smaller, so no substeps are needed. */
static const double rest_over_tolerance = 0x1p9;

/* Header of the memory block for tangents, with the path on one substep. The tangents follow. */
typedef struct {
    kr_series path[2];
    double substeps;         /* number of substeps of the last step */
    double from, to;         /* start and end of the last step */
    double substep;          /* number of the substep whose series are in memory, from 1 */
    double until;            /* end of this substep */
    double moving;           /* nonzero if the terms of support_deviation.h are needed */
    double from_low, to_low; /* low words of `from` and `to` */
} tangent_work;
/* The tangents of a motion. In memory, batches of tangents (tangents.h) precede single tangents. A
 * tangent in a batch is bitwise equal to the same tangent stored singly, so a small build can omit
 * batches. Tangents of tops with friction or on moving supports are never in batches. With more
 * than 16 digits, each struct of high words is followed by a struct of low words. */
typedef struct {
    const kr_motion *motion;
    const kr_tangents_kernel *kernel;
    int order; /* of the Taylor series */
    tangent_work *work;
    kr_tangent *first;
    size_t n, batches, structs; /* numbers of tangents, batches and structs of high words */
    size_t words;               /* structs per number: 1, or 2 for high and low words */
} tangent_set;

static size_t count_words_per_number(int digits) { return digits > 16 ? 2 : 1; }
static size_t count_batches(size_t n)
{
#ifdef KR_NO_BATCHES
    (void)n;
    return 0;
#else
    return n / KR_DEVIATION_BATCH + (n % KR_DEVIATION_BATCH >= KR_DEVIATION_BATCH_MIN);
#endif
}
/* Returns the number of structs of high words of n tangents, the first in `batches` batches. */
static size_t count_structs(size_t n, size_t batches)
{
    const size_t batched = KR_DEVIATION_BATCH * batches;
    return KR_DEVIATION_BATCH_STRUCTS * batches + (n > batched ? n - batched : 0);
}
static size_t count_doubles(int digits, size_t n)
{
    const size_t structs = count_structs(n, count_batches(n)), most = structs > n ? structs : n;
    return (sizeof(tangent_work) + most * count_words_per_number(digits) * sizeof(kr_tangent)) /
           sizeof(double);
}
/* Returns the baseline instruction set, which is the last one in the table. */
static const kr_isa *find_base_isa(void)
{
    int i = 0;
    while (kr_taylor_isa(i + 1)) i++;
    return kr_taylor_isa(i);
}
static tangent_set make_tangent_set(const kr_motion *motion, double *memory, size_t n)
{
    tangent_work *work = (tangent_work *)memory;
    const kr_isa *known = kr_taylor_isa_of(motion), *isa = known ? known : find_base_isa();
    const size_t batches = work->moving != 0.0 ? 0 : count_batches(n);
    return (tangent_set){.motion = motion,
                         .kernel = motion->digits > 16 ? isa->deep_tangents : isa->tangents,
                         .order = ((const kr_kernel *)motion->aux)->order,
                         .work = work,
                         .first = (kr_tangent *)(work + 1),
                         .n = n,
                         .batches = batches,
                         .structs = count_structs(n, batches),
                         .words = count_words_per_number(motion->digits)};
}

/* Location of a tangent: `from` is the struct of a single tangent, or the first struct of a batch.
 * In array members of *from, component 0 of theta has the index `first`. The next components follow
 * at distances of `stride` doubles, except for a gap before N (component_address). */
typedef struct {
    kr_tangent *from;
    size_t first, stride;
} deviation_address;
static deviation_address find_tangent_address(const tangent_set *t, size_t i)
{
    const size_t batched = KR_DEVIATION_BATCH * t->batches, structs = KR_DEVIATION_BATCH_STRUCTS;
    if (i >= batched)
        return (deviation_address){t->first + (structs * t->batches + i - batched) * t->words, 1,
                                   1};
    return (deviation_address){t->first + i / KR_DEVIATION_BATCH * structs * t->words,
                               i % KR_DEVIATION_BATCH,
                               t->words * sizeof(kr_tangent) / sizeof(double)};
}
static int is_single(const deviation_address *at) { return at->stride == 1; }
/* Returns the address of component k, 0 <= k < 6, of (theta, N) in the array `numbers`, a member of
 * the struct at->from. In a single tangent, a zero precedes the components of N. */
static double *component_address(const deviation_address *at, double *numbers, size_t k)
{
    return numbers + at->first + k * at->stride + (is_single(at) ? k / 3 : 0);
}

/* Writes v to high[0], high[stride] and high[2 * stride] and, if more than 16 digits are requested,
 * the low words to the same places in the next struct. */
static void store_strided_vector(const tangent_set *t, double *high, size_t stride, vec_dd v)
{
    const double words[2][3] = {{v.x.hi, v.y.hi, v.z.hi}, {v.x.lo, v.y.lo, v.z.lo}};
    for (size_t word = 0; word < t->words; word++)
        for (size_t i = 0; i < 3; i++)
            high[word * sizeof(kr_tangent) / sizeof(double) + i * stride] = words[word][i];
}
static void store_components(const tangent_set *t, const deviation_address *at, double *numbers,
                             size_t k, vec_dd v)
{
    store_strided_vector(t, component_address(at, numbers, k), at->stride, v);
}
/* Reads the number at `high` and, with more than 16 digits, its low word from the next struct.
 * Replaces -0 by 0, because in a batch the sign of a zero may depend on other tangents. */
static dd read_number(const tangent_set *t, const double *high)
{
    return (dd){*high + 0.0, t->words > 1 ? high[sizeof(kr_tangent) / sizeof(double)] + 0.0 : 0.0};
}
static vec_dd read_components(const tangent_set *t, const deviation_address *at, double *numbers,
                              size_t k)
{
    const double *high = component_address(at, numbers, k);
    return (vec_dd){read_number(t, high), read_number(t, high + at->stride),
                    read_number(t, high + 2 * at->stride)};
}
static void set_motion_constants(const tangent_set *t, kr_tangent *g)
{
    const kr_motion *motion = t->motion;
    const double rate = taylor_of(motion)->rate;
    const vec_dd A = motion->body->inertia,
                 ahead = {dd_sub(A.x, A.z), dd_sub(A.y, A.x), dd_sub(A.z, A.y)},
                 behind = {ahead.y, ahead.z, ahead.x},
                 c = vdd_scale_exactly(1.0 / (rate * rate), motion->body->lever),
                 up = {c.y, c.z, c.x}, down = {dd_neg(c.z), dd_neg(c.x), dd_neg(c.y)};
    store_strided_vector(t, g->ahead + 1, 1, vdd_over(ahead, A));
    store_strided_vector(t, g->behind + 1, 1, vdd_over(behind, A));
    store_strided_vector(t, g->per + 1, 1, vdd_over(vdd_of(v3(1.0, 1.0, 1.0)), A));
    store_strided_vector(t, g->drag + 1, 1, vdd_scale_exactly(1.0 / rate, vdd_of(motion->damping)));
    store_strided_vector(t, g->up + 1, 1, up);
    store_strided_vector(t, g->down + 1, 1, down);
    store_strided_vector(t, g->rotor + 1, 1, vdd_scale_exactly(1.0 / rate, motion->body->rotor));
    g->damped = v_largest(motion->damping);
    g->gyrostat = v_largest(motion->rotor);
}
/* Sets the derivatives of the constants, in the units of the series, by the tangent's parameter. */
static void set_parameter_derivatives(const tangent_set *t, const deviation_address *at,
                                      const kr_seed *seed)
{
    const double rate = taylor_of(t->motion)->rate, square = rate * rate;
    kr_tangent *g = at->from;
    store_components(t, at, g->moments, 0, vdd_of(seed->moments));
    store_components(t, at, g->drags, 0, vdd_scale_exactly(1.0 / rate, vdd_of(seed->damping)));
    store_components(t, at, g->lever, 0, vdd_scale_exactly(1.0 / square, seed->lever));
    store_components(t, at, g->rotor_of, 0, vdd_scale_exactly(1.0 / rate, seed->rotor));
    g->rotor_changes = fmax(g->rotor_changes, v_largest(vdd_high(seed->rotor)));
    if (is_single(at)) {
        store_strided_vector(t, g->pull + 1, 1, vdd_scale_exactly(1.0 / square, seed->pull));
        v_put(g->turning_of + 1, seed->turning);
        g->timing = seed->timing;
        store_strided_vector(t, g->apex_of + 1, 1, seed->apex);
        g->friction_of = seed->friction / square;
        g->gradient_of = seed->gradient / square;
    }
    g->changes = fmax(g->changes, fmax(v_largest(seed->moments), v_largest(vdd_high(seed->lever))));
    g->drag_changes = fmax(g->drag_changes, v_largest(seed->damping));
}
static void apply_friction_jump(const tangent_set *t)
{
    const kr_taylor *p = taylor_of(t->motion);
    dd factor;
    if (supports && t->motion->scene->friction > 0.0 &&
        supports->jumps(t->motion, t->order, &factor))
        supports->jump_tangents(t->motion, p->rate, p->series, t->first, t->n, factor);
}
/* Returns 1 if the motion or a tangent requires the terms of support_deviation.h. */
static int needs_support_terms(const kr_motion *motion, size_t n, const kr_seed seeds[])
{
    if (!supports) return 0;
    for (size_t i = 0; i < n; i++)
        if (seeds[i].timing >= KR_TIMING_AMPLITUDE || v_largest(seeds[i].turning) > 0.0 ||
            seeds[i].gradient != 0.0)
            return 1;
    return kr_support_is_needed(motion->scene);
}
static void start_tangents(const kr_motion *motion, double *memory, size_t n, const kr_seed seeds[])
{
    kr_taylor *p = taylor_of(motion);
    const kr_series *s = p->series;
    const quat_dd to_body = qdd_conj(qdd_unit(qdd_load(s[0].end_x, s[1].end_x)));
    memset(memory, 0, count_doubles(motion->digits, n) * sizeof(double));
    p->has_tangents = 1.0;
    ((tangent_work *)memory)->moving = needs_support_terms(motion, n, seeds);
    const tangent_set t = make_tangent_set(motion, memory, n);
    t.work->from = t.work->to = s->end;
    for (size_t i = 0; i < t.structs; i++) set_motion_constants(&t, t.first + i * t.words);
    for (size_t i = 0; i < n; i++) {
        const deviation_address to = find_tangent_address(&t, i);
        const kr_deviation *start = &seeds[i].at_start;
        set_parameter_derivatives(&t, &to, &seeds[i]);
        store_components(&t, &to, to.from->end, 0, start->turn);
        store_components(&t, &to, to.from->end, 3,
                         vdd_scale_exactly(1.0 / p->rate, qdd_turn(to_body, start->push)));
    }
    apply_friction_jump(&t);
    for (size_t i = 0; i < t.structs * t.words; i++) {
        kr_tangent *g = t.first + i;
        g->t = s[i % t.words].end;
        memcpy(g->x[0], g->end, sizeof g->end);
        memcpy(g->begin, g->end, sizeof g->end);
    }
}

static double sum_component_squares(const deviation_address *at, double *numbers)
{
    double sum = 0.0;
    for (size_t k = 0; k < 6; k++) {
        const double x = *component_address(at, numbers, k);
        sum += x * x;
    }
    return sum;
}
/* Evaluates all tangents at the time path->at, and stores the values in `substep_end`. Returns the
 * largest truncation error, or INFINITY if a tangent is not finite. */
static double find_error_at_substep_end(const tangent_set *t)
{
    const double *to = &t->work->path->at;
    const double power = pow(*to - t->first->t, t->order);
    double worst = 0.0;
    for (size_t i = 0; i < t->structs; i++) {
        kr_tangent *g = t->first + i * t->words;
        t->kernel->sum(g, t->order, to, g->substep_end);
    }
    for (size_t i = 0; i < t->n; i++) {
        const deviation_address at = find_tangent_address(t, i);
        const double size = sum_component_squares(&at, at.from->substep_end),
                     last = power * power * sum_component_squares(&at, at.from->x[t->order]);
        if (!isfinite(size)) return INFINITY;
        if (last > worst * worst * size) worst = sqrt(last / size);
    }
    return worst;
}
static void expand_tangents(const tangent_set *t)
{
    const kr_series *path = t->work->path;
    const size_t batched = KR_DEVIATION_BATCH_STRUCTS * t->batches;
    if (t->work->moving != 0.0) {
        supports->expand_tangents(t->motion, taylor_of(t->motion)->rate, path, t->first, t->n,
                                  t->order);
        return;
    }
    if (t->batches > 0) t->kernel->expand_batches(path, t->first, t->batches, t->order);
    if (t->structs > batched)
        t->kernel->expand(path, t->first + batched * t->words, t->structs - batched, t->order);
}
static double truncation_tolerance(const tangent_set *t)
{
    return rest_over_tolerance * exp2(taylor_of(t->motion)->log2_tol);
}
/* Computes the Taylor series of the tangents for one substep, given their values at its beginning.
 * The substep ends before the end of the step if a truncation error at the end of the step would be
 * too large. Returns the largest truncation error at the end of the substep. */
static double expand_shortened_substep(const tangent_set *t)
{
    const double most = truncation_tolerance(t), from = t->first->t;
    tangent_work *c = t->work;
    double h = c->to - from;
    expand_tangents(t);
    c->path[0].at = c->to;
    c->path[1].at = c->to_low;
    double worst = find_error_at_substep_end(t);
    for (int i = 0; i < MAX_SHORTENINGS && !(worst <= most); i++) {
        const double share = pow(most / worst, 1.0 / t->order);
        h = share > 0.01 ? h * 0.9 * share : 0.01 * h;
        c->path[0].at = from + h;
        c->path[1].at = 0.0;
        worst = find_error_at_substep_end(t);
    }
    c->until = c->path[0].at;
    return worst;
}
/* Calls expand_shortened_substep for the first substep of the last step, and returns its result. */
static double expand_first_substep(const tangent_set *t)
{
    tangent_work *c = t->work;
    for (size_t i = 0; i < t->structs * t->words; i++) {
        kr_tangent *g = t->first + i;
        g->t = i % t->words ? c->from_low : c->from;
        memcpy(g->x[0], g->begin, sizeof g->begin);
    }
    memcpy(c->path, taylor_of(t->motion)->series, t->words * sizeof(kr_series));
    c->substep = 1.0;
    return expand_shortened_substep(t);
}
/* Computes the path in the next substep. Then returns the result of expand_shortened_substep. */
static double expand_next_substep(const tangent_set *t)
{
    const kr_kernel *kernel = t->motion->aux;
    const kr_taylor *p = taylor_of(t->motion);
    kr_series *path = t->work->path;
    kr_taylor_end_at(path, kernel);
    for (size_t word = 0; word < t->words; word++) path[word].t = path[word].end;
    if (path->linear > 1.0) supports->place(path, t->motion, p->rate);
    kernel->advance(path, p->log2_tol, 1.0);
    for (size_t i = 0; i < t->structs * t->words; i++) {
        kr_tangent *g = t->first + i;
        g->t = path[i % t->words].t;
        memcpy(g->x[0], g->substep_end, sizeof g->substep_end);
    }
    t->work->substep += 1.0;
    return expand_shortened_substep(t);
}
/* Propagates all tangents over the last step of the path. Returns the largest truncation error of
 * all substeps. Returns INFINITY on overflow, if a substep would be too short, or if MAX_SUBSTEPS
 * substeps do not suffice. */
static double propagate_over_substeps(const tangent_set *t)
{
    const double most = truncation_tolerance(t);
    tangent_work *c = t->work;
    double rest = 0.0, last = expand_first_substep(t);
    while (last <= most) {
        rest = fmax(rest, last);
        c->substeps = c->substep;
        if (c->until == c->to) return rest;
        if (c->substep >= MAX_SUBSTEPS) return INFINITY;
        last = expand_next_substep(t);
    }
    return INFINITY;
}
/* Propagates n tangents over the last step of the path. Sets the tangents to NaN on failure. */
static kr_status advance_tangents(const kr_motion *motion, double *memory, size_t n)
{
    const kr_series *s = taylor_of(motion)->series;
    const tangent_set t = make_tangent_set(motion, memory, n);
    const size_t all = t.structs * t.words;
    kr_tangent *first = t.first;
    for (size_t i = 0; i < all; i++) memcpy(first[i].begin, first[i].end, sizeof first->end);
    t.work->from = s->t;
    t.work->to = s->end;
    t.work->from_low = t.words > 1 ? s[1].t : 0.0;
    t.work->to_low = t.words > 1 ? s[1].end : 0.0;
    const double last = propagate_over_substeps(&t);
    for (size_t i = 0; i < all; i++)
        for (int k = 0; k < 8; k++)
            first[i].end[k] = last < INFINITY ? first[i].substep_end[k] : NAN;
    if (last < INFINITY) apply_friction_jump(&t);
    if (last > first->truncation) first->truncation = last;
    return last < INFINITY ? KR_OK : KR_ERR_TANGENT;
}

/* Computes the Taylor series of the substep that contains `time`, if they are not in memory. For a
 * `time` before the substep in memory, begins again with the first substep. */
static void expand_substep_containing(const tangent_set *t, double time)
{
    const tangent_work *c = t->work;
    const double forward = c->to < c->from ? -1.0 : 1.0;
    if (forward * (time - t->first->t) < 0.0) expand_first_substep(t);
    while (c->substep < fmin(c->substeps, MAX_SUBSTEPS) && forward * (time - c->until) > 0.0)
        expand_next_substep(t);
}
/* Converts the momentum change `push` from the body frame and the units of the series to the space
 * frame and internal units. q is the attitude. With up to 16 digits, the rotation is computed in
 * double precision to save time. */
static vec_dd convert_push_to_space(const tangent_set *t, quat_dd q, vec_dd push)
{
    return vdd_scale_exactly(taylor_of(t->motion)->rate,
                             t->words > 1 ? qdd_turn(q, push)
                                          : vdd_of(q_turn(qdd_high(q), vdd_high(push))));
}
/* Evaluates n tangents at the time of the last call of kr_method.at, in the last step. The attitude
 * at this time is `attitude` + motion->low.q. */
static void evaluate_tangents(const kr_motion *motion, kr_quat attitude, double *memory, size_t n,
                              kr_deviation out[])
{
    const quat_dd q = q_dd(attitude, motion->low.q);
    const kr_series *s = taylor_of(motion)->series;
    const tangent_set t = make_tangent_set(motion, memory, n);
    const int is_end = s->at == t.work->to && (t.words == 1 || s[1].at == t.work->to_low);
    if (!is_end) {
        expand_substep_containing(&t, s->at);
        for (size_t i = 0; i < t.structs; i++) {
            kr_tangent *g = t.first + i * t.words;
            t.kernel->sum(g, t.order, &s->at, g->at);
        }
    }
    for (size_t i = 0; i < n; i++) {
        const deviation_address from = find_tangent_address(&t, i);
        double *numbers = is_end ? from.from->end : from.from->at;
        out[i].turn = read_components(&t, &from, numbers, 0);
        out[i].push = convert_push_to_space(&t, q, read_components(&t, &from, numbers, 3));
    }
}
static double get_truncation_error(const kr_motion *motion, double *memory)
{
    return make_tangent_set(motion, memory, 1).first->truncation;
}

const kr_tangent_ops kr_taylor_tangents = {kr_tangents_start, count_doubles,
                                           start_tangents,    advance_tangents,
                                           evaluate_tangents, get_truncation_error};
