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
int main(void)
{
    test_instruction_sets();
    test_failures();
    test_directions();
    const kr_scene scenes[] = {kr_scene_default(), tilted(), asymmetric()};
    for (int i = 0; i < 3; i++) test_means(&scenes[i], 20.0);
    return check_result();
}
