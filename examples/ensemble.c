/* Many tops on threads of your own, with one worker for each thread.
 *
 *     ensemble [THREADS]      4 by default
 *
 * The tops differ by their tilt. For each one, the program computes the largest tilt within a
 * second. The results are bitwise equal for any number of threads. */
#include <kreisel.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

enum { TOPS = 1000, TIMES = 501, MOST_THREADS = 64 };
static kr_scene scenes[TOPS];
static double times[TIMES], largest[TOPS];
static kr_outcome outcomes[TOPS];

typedef struct job {
    pthread_t thread;
    size_t begin, end;
    kr_status status;
} job;

static kr_status describe_top(double tilt, kr_scene *scene)
{
    const double m = 314.159 * 6.25e-4; /* spin times moment */
    *scene = (kr_scene){.gravity = 9.81, .start.q = {cos(tilt / 2), sin(tilt / 2), 0.0, 0.0}};
    scene->start.m = (kr_vec3){0.0, -m * sin(tilt), m * cos(tilt)};
    return kr_body_symmetric(0.5, 7.5125e-3, 6.25e-4, 0.12, &scene->body);
}
static void *run_job(void *memory)
{
    job *mine = memory;
    const kr_reduction reduction = {kr_quantity_find("nutation"), 0, KR_REDUCE_MAX};
    kr_worker *worker = NULL;
    /* No method: the closed form where there is one, else the Taylor series. */
    mine->status = kr_worker_create(NULL, kr_config_default(), 1, &reduction, &worker);
    const kr_tops tops = {.n = mine->end - mine->begin,
                          .scenes = scenes + mine->begin,
                          .times = TIMES,
                          .t = times,
                          .reduced = largest + mine->begin,
                          .outcomes = outcomes + mine->begin};
    if (mine->status == KR_OK) mine->status = kr_worker_run(worker, &tops);
    kr_worker_free(worker);
    return NULL;
}
static kr_status run_threads(size_t threads)
{
    static job jobs[MOST_THREADS];
    kr_status status = KR_OK;
    size_t begun = 0;
    for (size_t i = 0; i < threads; i++, begun++) {
        jobs[i].begin = TOPS * i / threads;
        jobs[i].end = TOPS * (i + 1) / threads;
        if (pthread_create(&jobs[i].thread, NULL, run_job, &jobs[i]) != 0) break;
    }
    if (begun < threads) status = KR_ERR_MEMORY;
    for (size_t i = 0; i < begun; i++) {
        pthread_join(jobs[i].thread, NULL);
        if (status == KR_OK) status = jobs[i].status;
    }
    return status;
}
int main(int count, char **words)
{
    const long threads = count > 1 ? strtol(words[1], NULL, 10) : 4;
    if (threads < 1 || threads > MOST_THREADS) return 2;
    kr_status status = KR_OK;
    for (int i = 0; i < TIMES; i++) times[i] = i / (TIMES - 1.0);
    for (int i = 0; i < TOPS && status == KR_OK; i++)
        status = describe_top(0.1 + 1.4 * i / TOPS, &scenes[i]);
    if (status == KR_OK) status = run_threads((size_t)threads);
    if (status != KR_OK) {
        fprintf(stderr, "%s\n", kr_status_text(status));
        return 1;
    }
    int failed = 0;
    for (int i = 0; i < TOPS; i++) failed += outcomes[i].status != KR_OK;
    for (int i = 0; i < TOPS; i += 100)
        printf("tilt at the start %.2f, largest tilt %.17g\n", 0.1 + 1.4 * i / TOPS, largest[i]);
    printf("%d of %d tops failed\n", failed, (int)TOPS);
    return failed > 0;
}
