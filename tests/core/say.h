/* How results are printed so that they depend neither on the compiler nor on the processor: numbers
 * as shares of the largest beside them, in units of 1e-9, counts whole. A headline is followed by a
 * hash of what is said below it; in full by that too. */
#ifndef KR_SAY_H
#define KR_SAY_H
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include "bits.h"

static int in_full = 0;
static uint64_t said =
    0; /* the hash of what has been said since the headline; 0: no headline yet */

static inline void must(int holds, const char *what)
{
    if (holds) return;
    fprintf(stderr, "results: %s\n", what);
    exit(1);
}
static inline void put(const char *format, ...)
{
    char text[256];
    va_list words;
    va_start(words, format);
    vsnprintf(text, sizeof text, format, words);
    va_end(words);
    for (const char *c = text; *c; c++) said = (said ^ (unsigned char)*c) * 1099511628211u;
    if (in_full) fputs(text, stdout);
}
static inline void headline(const char *what, const char *name)
{
    if (said) printf("%08" PRIx32 "\n", (uint32_t)(said ^ (said >> 32)));
    said = 14695981039346656037u;
    if (name) printf("%s %s%s", what, name, in_full ? "\n" : " ");
}
/* Ends the last one. */
static inline void all_is_said(void) { headline(NULL, NULL); }

static inline void say_shares(size_t n, const double x[], double whole)
{
    for (size_t i = 0; i < n; i++)
        if (isfinite(x[i]))
            put(" %lld", llround(x[i] / whole));
        else
            put(isnan(x[i]) ? " nan" : " inf");
}
/* Numbers as shares of the largest of them, and how large that is; roundings are none. */
static inline void say(size_t n, const double x[])
{
    double most = 0.0;
    for (size_t i = 0; i < n; i++) most = isfinite(x[i]) ? fmax(most, fabs(x[i])) : most;
    const int is_none = most < 1e-13;
    say_shares(n, x, is_none ? 1.0 : 1e-9 * most);
    put(" of %.7e\n", is_none ? 0.0 : most);
}
static inline void say_one(double x) { say(1, &x); }
/* What the low words add to numbers, in units of the last place of the largest. */
static inline void say_low(size_t n, const double x[], const double low[], int digits)
{
    double most = 0.0;
    for (size_t i = 0; i < n; i++) most = fmax(most, fabs(x[i]));
    if (most < 1e-13 || digits <= 16) return;
    put(" low");
    say_shares(n, low, (digits > 20 ? 1e-9 : 1e-2) * 0x1p-52 * most);
    put("\n");
}
/* Many numbers as what they come to together, and how large they are. */
static inline void say_sum(size_t n, const double x[])
{
    double both[2] = {0.0, 0.0};
    for (size_t i = 0; i < n; i++) {
        both[0] += (double)(i * 37 % 101 + 1) / 101.0 * x[i];
        both[1] += fabs(x[i]);
    }
    say(2, both);
}
static inline void say_counts(kr_stats c)
{
    put(" counts %lld %lld %lld %lld\n", (long long)c.steps, (long long)c.rejected,
        (long long)c.evaluations, (long long)c.iterations);
}
static inline void say_state(const kr_state *s)
{
    say(4, &s->q.w);
    say(3, &s->m.x);
}
#endif
