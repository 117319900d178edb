/* Random calls of most of the C API, checked against the comments of its header. `fuzz SEED CALLS`
 * makes rounds with the seeds SEED, SEED + 1, ... until it has made this number of calls, without
 * those of the checks. The first round in which a given claim fails is repeated and printed. */
#define _XOPEN_SOURCE 700
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/time.h>
#include <unistd.h>
#include "random_values.h"
#include "rounds.h"

enum { PLACES = 64, PATIENCE = 600 /* longest CPU time of a call in seconds */ };
static struct {
    uint64_t seed, at_last_tick;
    int ticks, failed_times[PLACES], places;
    failed_claim failed[PLACES];
} now;

/* Returns 1 if this claim has not failed before. */
static int is_new(const failed_claim *claim)
{
    int i = 0;
    while (i < now.places &&
           !(now.failed[i].line == claim->line && now.failed[i].file == claim->file))
        i++;
    if (i == PLACES) return 0;
    now.failed[i] = *claim;
    now.places += i == now.places;
    return ++now.failed_times[i] == 1;
}
static void say(const failed_claim *claim)
{
    printf("%s:%d  not so: %s\n  seed %" PRIu64 "\n", claim->file, claim->line, claim->what,
           now.seed);
    fflush(stdout);
}
/* Makes the round of a seed. Returns 1 if all its claims held. */
static int round_holds(uint64_t seed, int telling)
{
    now.seed = seed;
    choose_by_seed(seed);
    const failed_claim *claim = make_round(telling);
    if (!claim) return 1;
    if (is_new(claim) || telling) {
        say(claim);
        choose_by_seed(seed);
        if (!telling) make_round(1);
    }
    return 0;
}
/* Counts the seconds of CPU time of a call, and ends the program after too many. */
static void tick(int signal_number)
{
    (void)signal_number;
    now.ticks = calls_made == now.at_last_tick ? now.ticks + 1 : 0;
    now.at_last_tick = calls_made;
    if (now.ticks < PATIENCE) return;
    printf("no end: seed %" PRIu64 "\n", now.seed);
    fflush(stdout);
    _exit(2);
}
/* Prints the seed if a sanitizer ends the program. */
static void say_where(void)
{
    printf("stopped: seed %" PRIu64 "\n", now.seed);
    fflush(stdout);
}
static void say_and_end(int signal_number)
{
    say_where();
    _exit(128 + signal_number);
}
#ifdef KR_SANITIZED
void __sanitizer_set_death_callback(void (*callback)(void));
#endif
static void keep_watch(void)
{
    const struct itimerval second = {{1, 0}, {1, 0}};
    const struct sigaction ticking = {.sa_handler = tick, .sa_flags = SA_RESTART};
    sigaction(SIGPROF, &ticking, NULL);
    setitimer(ITIMER_PROF, &second, NULL);
#ifdef KR_SANITIZED
    __sanitizer_set_death_callback(say_where);
#else
    signal(SIGSEGV, say_and_end);
#endif
    signal(SIGABRT, say_and_end);
}
int main(int count, char *word[])
{
    const uint64_t first = count > 1 ? strtoull(word[1], NULL, 10) : 1,
                   most = count > 2 ? strtoull(word[2], NULL, 10) : 1000000;
    uint64_t seed = first, failed = 0;
    keep_watch();
    for (; calls_made < most; seed++) failed += !round_holds(seed, most == 1);
    printf("%" PRIu64 " calls in %" PRIu64 " rounds, seeds from %" PRIu64 "; %" PRIu64
           " rounds failed\n",
           calls_made, seed - first, first, failed);
    for (int i = 0; i < now.places; i++)
        printf("%s:%d  %d times\n", now.failed[i].file, now.failed[i].line, now.failed_times[i]);
    return failed != 0;
}
