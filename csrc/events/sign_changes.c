/* Search for all sign changes of a polynomial p(s) on the interval [0, 1]. The coefficients of p in
 * the Bernstein basis of an interval bound the values of p there, and their differences bound the
 * slope. Coefficients of one sign exclude roots, and differences of one sign exclude extrema. An
 * interval where neither holds is bisected (de Casteljau; Lane and Riesenfeld 1981) until |p| is
 * below the rounding noise or the width is NARROWEST. A sign is known only above the noise. Two
 * roots between which |p| is below the noise count as a double root without a sign change. The last
 * sign is passed on to the next step, so that a root between two steps is found once. */
#include "sign_changes.h"

typedef enum search_outcome { NO_ROOT, ROOT_FOUND, UNDECIDED } search_outcome;
enum { MAX_NEWTON_STEPS = 60 };
static const double RESOLUTION = 0x1p-54; /* absolute error of a root */
static const double NARROWEST = 0x1p-48;  /* shortest interval that is halved */
static const double NARROW = 0x1p-5;      /* as NARROWEST, while the last terms are omitted */
static const double TAIL_SHARE = 0x1p-10; /* largest omitted part of the sum of all slopes */

static double evaluate_polynomial(const double *c, int degree, double s)
{
    double p = c[degree];
    for (int n = degree - 1; n >= 0; n--) p = p * s + c[n];
    return p;
}
static double evaluate_with_slope(const double *c, int degree, double s, double *slope)
{
    double p = c[degree], d = 0.0;
    for (int n = degree - 1; n >= 0; n--) {
        d = d * s + p;
        p = p * s + c[n];
    }
    *slope = d;
    return p;
}
/* Returns a root between `low` and `high` by Newton's method, or by bisection where a Newton step
 * leaves the interval. Returns `low` if p(low) does not have the last known sign, r->side. */
static double refine_root_between(const kr_sign_search *r, double low, double high)
{
    double s = 0.5 * (low + high);
    if (!(r->side * evaluate_polynomial(r->c, r->degree, low) > 0.0)) return low;
    for (int i = 0; i < MAX_NEWTON_STEPS; i++) {
        double slope;
        const double p = evaluate_with_slope(r->c, r->degree, s, &slope), step = p / slope;
        if (r->side * p > 0.0)
            low = s;
        else
            high = s;
        if (p == 0.0 || fabs(step) <= RESOLUTION) break;
        s = s - step > low && s - step < high ? s - step : 0.5 * (low + high);
    }
    return s;
}
/* Stores the sign and the position s of the value p in r, unless |p| is below the noise. Returns 1
 * if the previous sign was opposite. Then writes the root to r->root if the new sign is sought. */
static int record_sign(kr_sign_search *r, double p, double s)
{
    if (!(fabs(p) > (r->side ? r->noise : r->start_noise))) return 0;
    const int sign = p > 0.0 ? 1 : -1, changed = r->side == -sign;
    if (changed && r->sought * sign >= 0) r->root = refine_root_between(r, r->mark, s);
    r->side = sign;
    r->mark = s;
    return changed;
}
/* Returns 1 if the sign at the end of an interval of length `width` tells whether the sign changes
 * inside: if the polynomial has constant sign, is monotonic, or is zero up to noise. `bernstein`
 * has the Bernstein coefficients of the truncated polynomial (truncate_polynomial). */
static int is_sign_at_end_enough(const kr_sign_search *r, const double *bernstein, double width)
{
    const double slack = r->used > 0 ? r->tail_slope * width / r->used : 0.0;
    const double end = bernstein[r->used], sure = r->tail + r->noise;
    int above = end > sure, below = end < -sure, rising = 1, falling = 1, flat = r->tail == 0.0;
    for (int i = 0; i <= r->used; i++) {
        above &= bernstein[i] > r->tail;
        below &= bernstein[i] < -r->tail;
        flat &= fabs(bernstein[i]) <= r->noise;
    }
    if (above | below | flat) return 1;
    for (int i = 1; i <= r->used; i++) {
        rising &= bernstein[i] - bernstein[i - 1] >= slack;
        falling &= bernstein[i - 1] - bernstein[i] >= slack;
    }
    return rising | falling;
}
/* Searches the part of [low, high] after r->mark for the first sign change. `bernstein` has the
 * Bernstein coefficients of the truncated polynomial on [low, high], and is overwritten. Returns
 * UNDECIDED if the omitted terms (truncate_polynomial) are needed. */
static search_outcome search_interval(kr_sign_search *r, double *bernstein, double low, double high)
{
    const int n = r->used;
    double left[KR_POLYNOMIAL_ORDER_MAX + 1];
    if (high <= r->mark) return NO_ROOT;
    if (is_sign_at_end_enough(r, bernstein, high - low) ||
        (r->tail == 0.0 && high - low <= NARROWEST)) {
        const double p = fabs(bernstein[n]) > r->tail + r->noise
                             ? bernstein[n]
                             : evaluate_polynomial(r->c, r->degree, high);
        return record_sign(r, p, high) ? ROOT_FOUND : NO_ROOT;
    }
    if (r->tail > 0.0 && high - low <= NARROW) return UNDECIDED;
    for (int k = 0; k <= n; k++) {
        left[k] = bernstein[0];
        for (int i = 0; i < n - k; i++) bernstein[i] = 0.5 * (bernstein[i] + bernstein[i + 1]);
    }
    const double middle = 0.5 * (low + high);
    const search_outcome first = search_interval(r, left, low, middle);
    return first == NO_ROOT ? search_interval(r, bernstein, middle, high) : first;
}
static search_outcome search_unit_interval(kr_sign_search *r)
{
    const int n = r->used;
    double b[KR_POLYNOMIAL_ORDER_MAX + 1], binomial = 1.0;
    for (int i = 0; i <= n; i++) {
        b[i] = r->c[i] / binomial;
        binomial = binomial * (n - i) / (i + 1);
    }
    for (int k = 1; k <= n; k++)
        for (int i = n; i >= k; i--) b[i] += b[i - 1];
    return search_interval(r, b, 0.0, 1.0);
}
/* Sets r->used to a degree above which the terms contribute negligibly to the slope, and can be
 * omitted. Sets r->tail and r->tail_slope to bounds on the sum and on the slope of these terms. If
 * the search without these terms is UNDECIDED, the caller repeats the search with all terms. */
static void truncate_polynomial(kr_sign_search *r)
{
    double slopes = 0.0;
    for (int i = 1; i <= r->degree; i++) slopes += i * fabs(r->c[i]);
    r->tail = r->tail_slope = 0.0;
    for (r->used = r->degree; r->used > 0; r->used--) {
        const double last = fabs(r->c[r->used]);
        if (r->tail_slope + r->used * last > TAIL_SHARE * slopes) break;
        r->tail += last, r->tail_slope += r->used * last;
    }
}
int kr_search_next_sign_change(kr_sign_search *r)
{
    double rest[4] = {0.0, 0.0, 0.0, 0.0};
    for (int i = 1; i <= r->degree; i++) rest[i % 4] += fabs(r->c[i]);
    const double others = (rest[0] + rest[1]) + (rest[2] + rest[3]);
    if (!isfinite(fabs(r->c[0]) + r->degree * others)) return 0;
    if (record_sign(r, r->mark > 0.0 ? evaluate_polynomial(r->c, r->degree, r->mark) : r->c[0],
                    r->mark))
        return 1;
    if (r->side * r->c[0] > others) return 0;
    truncate_polynomial(r);
    search_outcome found = search_unit_interval(r);
    if (found == UNDECIDED) {
        r->used = r->degree;
        r->tail = r->tail_slope = 0.0;
        found = search_unit_interval(r);
    }
    return found == ROOT_FOUND;
}
