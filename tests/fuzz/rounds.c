/* Rounds: see rounds.h. */
#include "rounds.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include "calls.h"
#include "random_values.h"
#include "claims.h"

uint64_t calls_made;
static int told;
static failed_claim failed;
static jmp_buf leave;

static void tell_list(const char *format, va_list list)
{
    if (!told) return;
    printf("  ");
    vprintf(format, list);
    printf("\n");
    fflush(stdout);
}
void print_detail(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    tell_list(format, list);
    va_end(list);
}
void print_call(const char *format, ...)
{
    va_list list;
    calls_made++;
    va_start(list, format);
    tell_list(format, list);
    va_end(list);
}
void claim_failed(const char *file, int line, const char *what)
{
    failed = (failed_claim){file, what, line};
    longjmp(leave, 1);
}

static void one_of_all(void)
{
    switch (choose(25)) {
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
        call_closed_forms();
        break;
    case 5:
    case 6:
        call_simulation();
        break;
    case 8:
        call_axes();
        break;
    case 7:
        call_ensembles();
        break;
    default:
        call_top();
        break;
    }
}
static void make_calls(void)
{
    const uint64_t most = 4 + choose(60);
    allow_long_runs(odds(3));
    for (uint64_t i = 0; i < most; i++) one_of_all();
}
const failed_claim *make_round(int telling)
{
    told = telling;
    failed.what = NULL;
    if (!setjmp(leave)) make_calls();
    clear_tops();
    clear_simulation();
    return failed.what ? &failed : NULL;
}
