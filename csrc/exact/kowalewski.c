/* Set-up of the closed-form solution for a Kowalewski top. This file is compiled once for each
 * instruction set, because double-double products are three times as fast with fused
 * multiply-add. */
#include "across.h"
#include "kowalewski_plan.h"

/* Numbers of points on the torus at which a solution is tested: always, and if an error exceeds
 * KR_TORUS_ROUNDING. */
enum { FEW_POINTS = 16, MANY_POINTS = 64 };

/* A closed-form solution and the intermediate results of its set-up. */
typedef struct kowalewski_memory {
    kr_kowalewski_torus plan;
    kowalewski_work work;
} kowalewski_memory;

/* Converts a validated scene to the axes and units of kowalewski_curve.h. */
static kr_status read_kowalewski(const kr_scene *scene, kowalewski_top *top, across_way *way)
{
    across_start start;
    const kr_status status = read_across(scene, -1.0, 1.0, &start, way);
    if (status != KR_OK) return status;
    for (int i = 0; i < 3; i++) {
        top->state[i] = dd_scale(i < 2 ? 0.5 : 1.0, start.momentum[i]);
        top->state[3 + i] = start.up[i];
    }
    top->l = start.vertical;
    return KR_OK;
}
/* Sets the initial phase of the heading from the initial attitude `q`. */
static void set_phase(kr_kowalewski_torus *plan, kr_quat q)
{
    const kr_quat at = kowalewski_kernel(plan, 0.0, dd_of(0.0)).q;
    const cx alpha = cx_mul(cx_of(q.w, q.z), cx_of(at.w, -at.z)),
             beta = cx_mul(cx_of(q.x, q.y), cx_of(at.x, -at.y)), both = cx_add(alpha, beta);
    phase_start(&plan->torus.turn[2], turns_of(both.im, both.re));
}
/* Converts the solution to the user's units, or to internal units if `own` is nonzero
 * (across.h). */
static void bring_back(kr_kowalewski_torus *plan, const across_way *way, double start, int own)
{
    torus_to_user(&plan->torus, way, start, own);
    plan->head.first = two_pi * plan->torus.turn[0].fast;
    plan->head.second = two_pi * plan->torus.turn[1].fast;
    plan->head.heading = two_pi * plan->torus.turn[2].fast;
}
enum { TAYLOR_ORDER = 12 };
/* Moves a state and the axes e1, e2 and e3 = g, all in the body frame, by the time `span`. Adds up
 * the Taylor series, whose remainder is negligible if span * (1 + |omega|) is below 1/30. */
static void move_frame(frame_state *f, double span)
{
    double w[3][TAYLOR_ORDER + 1], e[3][3][TAYLOR_ORDER + 1];
    w[0][0] = f->p, w[1][0] = f->q, w[2][0] = f->r;
    for (int a = 0; a < 3; a++)
        for (int i = 0; i < 3; i++) e[a][i][0] = f->row[a][i];
    for (int n = 0; n < TAYLOR_ORDER; n++) {
        double d[3] = {0.0, -0.5 * e[2][2][n], e[2][1][n]};
        for (int i = 0; i <= n; i++) {
            d[0] += 0.5 * (w[1][i] * w[2][n - i]);
            d[1] -= 0.5 * (w[0][i] * w[2][n - i]);
        }
        for (int i = 0; i < 3; i++) w[i][n + 1] = d[i] / (n + 1.0);
        for (int a = 0; a < 3; a++)
            for (int i = 0; i < 3; i++) {
                const int j = (i + 1) % 3, k = (i + 2) % 3;
                double turn = 0.0;
                for (int m = 0; m <= n; m++)
                    turn += e[a][j][m] * w[k][n - m] - e[a][k][m] * w[j][n - m];
                e[a][i][n + 1] = turn / (n + 1.0);
            }
    }
    frame_state sum = {.p = 0.0};
    for (int n = TAYLOR_ORDER; n >= 0; n--) {
        sum.p = w[0][n] + span * sum.p;
        sum.q = w[1][n] + span * sum.q;
        sum.r = w[2][n] + span * sum.r;
        for (int a = 0; a < 3; a++)
            for (int i = 0; i < 3; i++) sum.row[a][i] = e[a][i][n] + span * sum.row[a][i];
    }
    *f = sum;
}
/* Returns the axes of space and the angular velocity in the body frame, for three phases. */
static frame_state seen_from_top(const kr_kowalewski_torus *plan, const dd phase[3])
{
    const kr_state s = kowalewski_kernel_at(plan, 0.0, phase);
    const kr_vec3 m = q_turn_back(s.q, s.m);
    frame_state f = {.p = 0.5 * m.x, .q = 0.5 * m.y, .r = m.z};
    for (int i = 0; i < 3; i++) {
        const kr_vec3 e = q_turn_back(s.q, v3(i == 0, i == 1, i == 2));
        f.row[i][0] = e.x, f.row[i][1] = e.y, f.row[i][2] = e.z;
    }
    return f;
}
static double distance_of_frames(const frame_state *one, const frame_state *other)
{
    const kr_vec3 w = v3(one->p, one->q, one->r), off = v_sub(w, v3(other->p, other->q, other->r));
    double square = 0.0;
    for (int i = 0; i < 9; i++) {
        const double d = one->row[i / 3][i % 3] - other->row[i / 3][i % 3];
        square += 0.5 * d * d;
    }
    return fmax(sqrt(square), v_length(off) / (1.0 + v_length(w)));
}
/* Returns the largest error of the closed form at `points` points of the torus: the difference
 * between its state a little later and the Taylor series that starts at its state. */
static double miss_on_torus(const kr_kowalewski_torus *plan, int points)
{
    double miss = 0.0;
    for (int i = 1; i <= points; i++) {
        /* The points are multiples of two irrational numbers, so that they fill the torus
         * evenly. */
        dd phase[3] = {dd_of(fraction_of_turns(0.7548776662466927 * i)),
                       dd_of(fraction_of_turns(0.5698402909980532 * i)), dd_of(0.0)};
        frame_state moved = seen_from_top(plan, phase);
        const double span = 0.03125 / (1.0 + v_length(v3(moved.p, moved.q, moved.r)));
        for (int j = 0; j < 3; j++) {
            const kr_phase *p = &plan->torus.turn[j];
            phase[j] = dd_add(phase[j], dd_times(span, dd_make(p->fast, p->slow)));
        }
        const frame_state later = seen_from_top(plan, phase);
        move_frame(&moved, span);
        const double here = distance_of_frames(&moved, &later);
        miss = fmax(miss, isfinite(here) ? here : INFINITY);
    }
    return miss;
}
/* Returns the error at the initial time. */
static double miss_at_start(const kr_kowalewski_torus *plan, const kowalewski_top *top,
                            kr_quat attitude)
{
    const kr_state s = kowalewski_kernel(plan, 0.0, dd_of(0.0));
    const kr_vec3 m = q_turn_back(s.q, s.m),
                  want = v3(2.0 * top->state[0].hi, 2.0 * top->state[1].hi, top->state[2].hi);
    const double miss =
        fmax(kr_attitude_error(s.q, attitude), v_length(v_sub(m, want)) / (1.0 + v_length(want)));
    return isfinite(miss) ? miss : INFINITY;
}
/* Computes the closed-form solution in internal units. Returns KR_KOWALEWSKI_PLANNED, or the reason
 * for the failure. */
static kr_kowalewski_refusal make_plan(kowalewski_memory *memory, const kowalewski_top *top,
                                       kr_quat attitude)
{
    kr_kowalewski_torus *plan = &memory->plan;
    const kr_kowalewski_refusal refusal = analyse_curve(top, &memory->work);
    if (refusal != KR_KOWALEWSKI_PLANNED) return refusal;
    if (!(fill_plan(&memory->work, plan) > 0.25)) return KR_KOWALEWSKI_SEPARATRIX;
    set_phase(plan, attitude);
    double error = fmax(miss_at_start(plan, top, attitude), miss_on_torus(plan, FEW_POINTS));
    if (error > KR_TORUS_ROUNDING) error = fmax(error, miss_on_torus(plan, MANY_POINTS));
    /* The last argument of fmax is the effect of the frequency errors after 1000 radians. It
     * matters only near separatrices, where a rounding error of the start changes the motion far
     * more. */
    plan->head.certificate = fmax(fmax(error, KR_TORUS_ROUNDING), 1e3 * memory->work.separatrix);
    return KR_KOWALEWSKI_PLANNED;
}
static kr_status plan_scene(const kr_scene *scene, int own, double bound, void *space)
{
    kowalewski_memory *memory = space;
    kr_kowalewski_torus *plan = &memory->plan;
    kr_kowalewski *head = &plan->head;
    kowalewski_top top;
    across_way way;
    memset(head, 0, sizeof *head);
    head->refusal = KR_KOWALEWSKI_OTHER;
    kr_status status = check_torus_scene(scene, KR_KIND_KOWALEWSKI, own);
    if (status != KR_OK) return status;
    head->refusal = KR_KOWALEWSKI_ROUNDED;
    if (!is_integrable(&scene->body, 2.0)) return KR_ERR_METHOD;
    head->refusal = KR_KOWALEWSKI_WEIGHTLESS;
    status = read_kowalewski(scene, &top, &way);
    if (status != KR_OK) return status;
    begin_torus(&plan->torus);
    head->refusal = (int)make_plan(memory, &top, way.attitude);
    if (head->refusal != KR_KOWALEWSKI_PLANNED) {
        head->refusal = (int)name_motion(&top, (kr_kowalewski_refusal)head->refusal);
        return KR_ERR_METHOD;
    }
    bring_back(plan, &way, scene->start.t, own);
    head->used = kr_kowalewski_form.used_size(plan);
    if (head->certificate <= (bound > 0.0 ? bound : KR_KOWALEWSKI_BOUND)) return KR_OK;
    head->refusal = (int)name_motion(&top, KR_KOWALEWSKI_CERTIFICATE);
    return KR_ERR_METHOD;
}
static kr_state kowalewski_state(const void *memory, double t)
{
    const kr_kowalewski_torus *plan = memory;
    const kr_state none = {t, {NAN, NAN, NAN, NAN}, {NAN, NAN, NAN}};
    return isfinite(t) ? kowalewski_kernel(plan, t, torus_span(&plan->torus, t)) : none;
}
static kr_state kowalewski_state_at(const void *memory, double first, double second)
{
    const kr_kowalewski_torus *plan = memory;
    const kr_torus *torus = &plan->torus;
    const dd phase[3] = {dd_of(fraction_of_turns(first)), dd_of(fraction_of_turns(second)),
                         torus_phase_at(torus, 2, dd_of(0.0))};
    return kowalewski_kernel_at(plan, torus->begin, phase);
}
const kr_torus_scalar KR_NAME(kr_kowalewski_scalar) = {sizeof(kowalewski_memory), plan_scene,
                                                       kowalewski_state, kowalewski_state_at};
