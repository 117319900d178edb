/* Tangents in a worker: they do not change the states, each depends on its own top alone, and all
 * instruction sets with fused multiply-add give bitwise equal results. */
#include <stdlib.h>
#include "ensemble/slots.h"
#include "tops.h"

enum { TOPS = 19, TIMES = 5 };
static const double times[TIMES] = {0.0, 0.3, 4.0, 4.1, 25.0};
typedef struct {
    kr_state states[TOPS * TIMES];
    kr_outcome outcomes[TOPS];
    double rows[TOPS * TIMES][KR_GROWTH_COUNT];
} came;

static kr_worker *worker_with(uint64_t tangents, int64_t max_steps)
{
    const kr_config config = {.tangents = tangents, .skip_heading = 1, .max_steps = max_steps};
    return make_worker(taylor(), config);
}
static void run(kr_worker *worker, const kr_scene *scenes, size_t n, came *to)
{
    const kr_tops tops = {.n = n,
                          .scenes = scenes,
                          .times = TIMES,
                          .t = times,
                          .states = to->states,
                          .outcomes = to->outcomes,
                          .growth = to->rows[0]};
    IS(kr_worker_run(worker, &tops) == KR_OK);
}
static void some(kr_scene scenes[TOPS])
{
    for (int i = 0; i < TOPS; i++) {
        scenes[i] = asymmetric();
        scenes[i].gravity = 0.2 + 0.07 * i;
        if (i % 3 == 1) scenes[i].body.rotor = v3(0.5, -0.1 * i, 0.0);
    }
    /* The steps of the path are too long for the series of the tangent of this top. */
    IS(kr_body_symmetric(2.0, 3.0, 1.5, 0.75, &scenes[3].body) == KR_OK);
    scenes[3].start.q = q_one();
    scenes[3].start.m = v3(0.0, 0.0, 9.0);
}
static void test_instruction_sets(void)
{
    static came first, other;
    kr_scene scenes[TOPS];
    const kr_lanes_isa *isa, *widest = NULL;
    some(scenes);
    for (int i = 0; (isa = kr_lanes_isa_at(i)) != NULL; i++) {
        if (!isa->runs_here()) continue;
        kr_worker *worker = worker_with(KR_TANGENT_GROWTH, 0);
        kr_scheduler_set_kernel(worker, isa, 20, -53.0);
        run(worker, scenes, TOPS, &other);
        kr_worker_free(worker);
        if (!widest) widest = isa, first = other;
        if (strcmp(isa->name, "base") != 0)
            IS(memcmp(first.rows, other.rows, sizeof first.rows) == 0);
        for (int k = 0; k < TOPS * TIMES; k++)
            NEAR(other.rows[k][KR_GROWTH_LOG], first.rows[k][KR_GROWTH_LOG], 1e-11);
    }
}
static void test_failures(void)
{
    static came got;
    kr_scene scenes[TOPS];
    kr_worker *worker = worker_with(KR_TANGENT_GROWTH, 9), *none = NULL;
    some(scenes);
    scenes[1].damping.x = 0.1;
    scenes[2].body.mass = -1.0;
    run(worker, scenes, 3, &got);
    IS(got.outcomes[0].status == KR_ERR_LIMIT && got.outcomes[1].status == KR_ERR_DAMPING);
    IS(got.outcomes[2].status != KR_OK && got.outcomes[2].stats.steps == 0);
    for (int i = 0; i < 3; i++) IS(isnan(got.rows[i * TIMES + TIMES - 1][KR_GROWTH_LOG]));
    kr_worker_free(worker);
    kr_config config = {.tangents = KR_TANGENT_START};
    IS(kr_worker_create(taylor(), config, 0, NULL, &none) == KR_ERR_OPTION);
    config.tangents = KR_TANGENT_GROWTH;
    IS(kr_worker_create(NULL, config, 0, NULL, &none) == KR_ERR_OPTION);
    config.digits = 20;
    IS(kr_worker_create(taylor(), config, 0, NULL, &none) == KR_ERR_OPTION && !none);
}
/* A direction whose size is zero or not finite is refused. The size of any other direction does not
 * affect the growth. */
static void test_directions(void)
{
    static came got;
    const kr_scene scene = asymmetric();
    const double sizes[] = {0.0, NAN, INFINITY, 1.0, 0x1p-900, 0x1p900};
    double first = 0.0;
    kr_worker *worker = worker_with(KR_TANGENT_GROWTH, 0);
    for (int i = 0; i < 6; i++) {
        double direction[6] = {0};
        direction[0] = sizes[i];
        direction[4] = 0.5 * sizes[i];
        const kr_tops tops = {.n = 1,
                              .scenes = &scene,
                              .times = TIMES,
                              .t = times,
                              .outcomes = got.outcomes,
                              .growth = got.rows[0],
                              .direction = direction};
        IS(kr_worker_run(worker, &tops) == KR_OK);
        IS(got.outcomes->status == (i < 3 ? KR_ERR_ARGUMENT : KR_OK));
        IS(isnan(got.rows[0][KR_GROWTH_LOG]) == (i < 3));
        if (i == 3) first = got.rows[TIMES - 1][KR_GROWTH_LOG];
        IS(i < 3 || got.rows[TIMES - 1][KR_GROWTH_LOG] == first);
    }
    kr_worker_free(worker);
}
static void grow(const kr_scene *scene, size_t n, const double *t, double (*rows)[KR_GROWTH_COUNT])
{
    kr_outcome outcome;
    const kr_tops tops = {
        .n = 1, .scenes = scene, .times = n, .t = t, .outcomes = &outcome, .growth = rows[0]};
    kr_worker *worker = worker_with(KR_TANGENT_GROWTH, 0);
    IS(kr_worker_run(worker, &tops) == KR_OK && outcome.status == KR_OK);
    kr_worker_free(worker);
}
/* The mean and the largest value include the growth within steps. They agree with values computed
 * from the logarithms at many times. The mean is 2/T times the integral of ln|delta| (1 +
 * ln(t/T)). */
static void test_means(const kr_scene *scene, double end)
{
    enum { MANY = 4000 };
    static double t[MANY], rows[MANY][KR_GROWTH_COUNT];
    double sum = 0.0, most = 0.0;
    for (int i = 0; i < MANY; i++) t[i] = end * (i + 1) / MANY;
    grow(scene, MANY, t, rows);
    for (int i = 0; i < MANY; i++) {
        const double own = rows[i][KR_GROWTH_LOG], part = i < MANY - 1 ? 1.0 : 0.5;
        sum += part * own * (1.0 + log(t[i] / end));
        most = fmax(most, own);
    }
    NEAR(rows[MANY - 1][KR_GROWTH_MEGNO], 2.0 * sum / MANY, 1e-4);
    NEAR(rows[MANY - 1][KR_GROWTH_MAX], most, 2e-3);
}
/* Computes the growth of a tangent of a top at rest with its axis upright, where the flow vanishes.
 * The squares of both rates are torque / moment, which is 1 or -1. */
enum { LOOKS = 3 };
static void at_rest(double gravity, const double t[LOOKS], double rows[LOOKS][KR_GROWTH_COUNT])
{
    kr_scene scene = kr_scene_default();
    IS(kr_body_symmetric(2.0, 3.0, 1.5, 0.75, &scene.body) == KR_OK);
    scene.gravity = gravity;
    scene.start.q = q_one();
    scene.start.m = v3(0.0, 0.0, 0.0);
    grow(&scene, LOOKS, t, rows);
}
/* If the top stands upright, the tangent grows as exp(t), far beyond the range of doubles, and
 * MEGNO as t / 2. If it hangs, the tangent is periodic. */
static void test_equilibria(void)
{
    const double pi = 3.14159265358979323846;
    const double late[LOOKS] = {30.0, 100.0, 900.0}, turns[LOOKS] = {pi, 2.0 * pi, 20.0 * pi};
    double rows[LOOKS][KR_GROWTH_COUNT];
    at_rest(2.0, late, rows);
    NEAR(rows[0][KR_GROWTH_LOG], 30.0, 2.0);
    for (int i = 1; i < LOOKS; i++) {
        NEAR(rows[i][KR_GROWTH_LOG] - rows[0][KR_GROWTH_LOG], late[i] - 30.0, 1e-9);
        NEAR(rows[i][KR_GROWTH_MEGNO] / late[i], 0.5, 1.0 / late[i]);
        IS(rows[i][KR_GROWTH_MAX] == rows[i][KR_GROWTH_LOG]);
    }
    at_rest(-2.0, turns, rows);
    for (int i = 0; i < LOOKS; i++) {
        NEAR(rows[i][KR_GROWTH_LOG], 0.0, 1e-12);
        IS(rows[i][KR_GROWTH_MAX] >= 0.0 && rows[i][KR_GROWTH_MAX] < 2.0);
        NEAR(rows[i][KR_GROWTH_MEGNO], 0.0, 2.0);
    }
}
/* Rotations about the vertical, and of free bodies about principal axes, are constant in the body
 * frame. The path then has longer steps than the series of the tangent permits. */
static void test_steady_rotations(void)
{
    const double t[LOOKS] = {1.0, -1.0, 40.0};
    double row[1][KR_GROWTH_COUNT];
    for (int i = 0; i < 12; i++) {
        const int axis = i % 3;
        kr_scene s = kr_scene_default();
        s.start.q = q_one();
        if (i < 6) {
            IS(kr_body_symmetric(1.0, 1.0, 0.5, 0.5, &s.body) == KR_OK);
            s.gravity = i % 2 ? -1.0 : 1.0;
            s.start.m = v3(0.0, 0.0, i < 2 ? 25.0 : i < 4 ? 500.0 : -900.0);
        } else {
            const double tensor[9] = {1.0, 0.0, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0, 2.0};
            IS(kr_body_from_tensor(1.0, tensor, v3(0.0, 0.0, 0.0), &s.body) == KR_OK);
            const double size = i < 9 ? 10.0 : -100.0;
            s.start.m = v3(axis == 0 ? size : 0.0, axis == 1 ? size : 0.0, axis == 2 ? size : 0.0);
        }
        const int is_unstable = i >= 6 && axis == 1;
        for (int k = 0; k < LOOKS; k++) {
            const double rate = is_unstable ? v_length(s.start.m) / 1.5 / sqrt(8.0) : 0.0;
            grow(&s, 1, &t[k], row);
            NEAR(row[0][KR_GROWTH_LOG], rate * fabs(t[k]), 10.0);
            IS(row[0][KR_GROWTH_TRUNCATION] > 0.0 && row[0][KR_GROWTH_TRUNCATION] < 1e-13);
        }
    }
}
int main(void)
{
    test_instruction_sets();
    test_failures();
    test_directions();
    test_equilibria();
    test_steady_rotations();
    const kr_scene scenes[] = {kr_scene_default(), tilted(), asymmetric()};
    for (int i = 0; i < 3; i++) test_means(&scenes[i], 20.0);
    return check_result();
}
