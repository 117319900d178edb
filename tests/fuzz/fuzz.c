/* Random calls of the whole C API, held to the words of its header. `fuzz SEED CALLS` makes rounds
 * by the seeds SEED, SEED + 1, ... until so many calls are made; a round that fails is made once
 * more and told. */
#define _XOPEN_SOURCE 700
#include <inttypes.h>
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <unistd.h>
#include "calls.h"
#include "choice.h"
#include "claims.h"

enum { PLACES = 64, PATIENCE = 10 /* seconds of work that a call may take */ };
static struct {
    uint64_t seed, calls, at_last_tick;
    int telling, ticks, is_owed;
    jmp_buf leave;
    int failed_line[PLACES], failed_times[PLACES], places;
    const char *failed_file[PLACES], *left_out[PLACES];
    int times_left_out[PLACES], names;
} now;

static void tell_list(const char *format, va_list list)
{
    if (!now.telling) return;
    printf("  ");
    vprintf(format, list);
    printf("\n");
    fflush(stdout);
}
void tell(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    tell_list(format, list);
    va_end(list);
}
void call(const char *format, ...)
{
    va_list list;
    now.calls++;
    va_start(list, format);
    tell_list(format, list);
    va_end(list);
}
/* Says whether it is the first time that the claim at this place fails. */
static int is_new(const char *file, int line)
{
    int i = 0;
    while (i < now.places && !(now.failed_line[i] == line && now.failed_file[i] == file)) i++;
    if (i == PLACES) return 0;
    now.failed_file[i] = file;
    now.failed_line[i] = line;
    now.places += i == now.places;
    return ++now.failed_times[i] == 1;
}
static void end_round(void) { longjmp(now.leave, 1); }
void claim_failed(const char *file, int line, const char *what)
{
    if (now.telling || is_new(file, line))
        printf("%s:%d  not so: %s\n  seed %" PRIu64 ", call %" PRIu64 "\n", file, line, what,
               now.seed, now.calls);
    fflush(stdout);
    end_round();
}
void leave_out(const char *name)
{
    int i = 0;
    while (i < now.names && now.left_out[i] != name) i++;
    if (i == PLACES) return;
    now.left_out[i] = name;
    now.names += i == now.names;
    now.times_left_out[i]++;
}
void claim_owed(const char *name)
{
    leave_out(name);
    tell("owed: %s", name);
    now.is_owed = 1;
    end_round();
}

static void one_of_all(void)
{
    switch (choose(24)) {
    case 0:
        call_bodies();
        break;
    case 1:
        call_names();
        break;
    case 2:
        call_values();
        break;
    case 3:
    case 4:
        call_closed();
        break;
    case 5:
    case 6:
        call_stage();
        break;
    default:
        call_top();
        break;
    }
}
static void make_round(void)
{
    const uint64_t most = 4 + choose(60);
    for (uint64_t i = 0; i < most; i++) one_of_all();
    clear_tops();
    clear_stage();
}

/* Makes the round of a seed; says whether all its claims held. */
static int round_holds(uint64_t seed, int telling)
{
    now.seed = seed;
    now.is_owed = 0;
    now.telling = telling;
    choose_by_seed(seed);
    if (setjmp(now.leave)) {
        clear_tops();
        clear_stage();
        return now.is_owed;
    }
    make_round();
    return 1;
}
/* A second of work has gone: a call that has been at it for long will not end. */
static void tick(int signal_number)
{
    (void)signal_number;
    now.ticks = now.calls == now.at_last_tick ? now.ticks + 1 : 0;
    now.at_last_tick = now.calls;
    if (now.ticks < PATIENCE) return;
    printf("no end: seed %" PRIu64 ", call %" PRIu64 "\n", now.seed, now.calls);
    fflush(stdout);
    _exit(2);
}
/* What ends the program by itself, as a sanitizer does, says where. */
static void say_where(void)
{
    printf("stopped: seed %" PRIu64 ", call %" PRIu64 "\n", now.seed, now.calls);
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
                   most = count > 2 ? strtoull(word[2], NULL, 10) : 100000;
    const int telling = count > 2 && most == 1;
    uint64_t seed = first, failed = 0;
    keep_watch();
    for (; now.calls < most; seed++) {
        const int places = now.places;
        if (round_holds(seed, telling)) continue;
        failed++;
        if (now.places == places || telling) continue;
        const uint64_t calls = now.calls;
        round_holds(seed, 1);
        now.calls = calls;
    }
    printf("%" PRIu64 " calls in %" PRIu64 " rounds, seeds from %" PRIu64 "; %" PRIu64
           " rounds failed\n",
           now.calls, seed - first, first, failed);
    for (int i = 0; i < now.places; i++)
        printf("%s:%d  %d times\n", now.failed_file[i], now.failed_line[i], now.failed_times[i]);
    for (int i = 0; i < now.names; i++)
        printf("left out %d times: %s\n", now.times_left_out[i], now.left_out[i]);
    return failed != 0;
}
