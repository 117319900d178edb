/* Changes of sign of a polynomial, none missed: in Bernstein's basis its coefficients enclose it
 * and their differences enclose its slope, so that an interval in which all are of one sign holds
 * no root, or no turning point; any other is halved (de Casteljau; Lane and Riesenfeld 1981), until
 * its values cannot be told from zero. Signs count only where rounding cannot have made them: two
 * roots between which the polynomial stays below its noise are a touching and no change of sign,
 * and a zero at the border of two pieces is seen once, from the sign before to the sign after. */
#include "roots.h"

typedef enum outcome { NONE, FOUND, UNDECIDED } outcome;
enum { MOST_STEPS = 60 };
static const double RESOLUTION = 0x1p-54; /* of a root */
static const double NARROWEST = 0x1p-48;  /* interval that is halved */
static const double NARROW = 0x1p-5;      /* the narrowest while the last terms are left out */
static const double TAIL = 0x1p-10;       /* the part of all slopes that these terms may have */

static double value(const double *c, int degree, double s)
{
    double p = c[degree];
    for (int n = degree - 1; n >= 0; n--) p = p * s + c[n];
    return p;
}
static double value_and_slope(const double *c, int degree, double s, double *slope)
{
    double p = c[degree], d = 0.0;
    for (int n = degree - 1; n >= 0; n--) {
        d = d * s + p;
        p = p * s + c[n];
    }
    *slope = d;
    return p;
}
/* Finds a root by Newton's steps where they stay inside, else by halves. The sign at the lower end
 * is `side`. */
static double polish(const kr_search *r, double low, double high)
{
    double s = 0.5 * (low + high);
    if (!(r->side * value(r->c, r->degree, low) > 0.0)) return low;
    for (int i = 0; i < MOST_STEPS; i++) {
        double slope;
        const double p = value_and_slope(r->c, r->degree, s, &slope), step = p / slope;
        if (r->side * p > 0.0)
            low = s;
        else
            high = s;
        if (p == 0.0 || fabs(step) <= RESOLUTION) break;
        s = s - step > low && s - step < high ? s - step : 0.5 * (low + high);
    }
    return s;
}
/* Takes note of the value at a point; true if the sign is surely another there than at the mark. */
static int take(kr_search *r, double p, double s)
{
    if (!(fabs(p) > (r->side ? r->noise : r->start_noise))) return 0;
    const int sign = p > 0.0 ? 1 : -1, changed = r->side == -sign;
    if (changed && r->sought * sign >= 0) r->root = polish(r, r->mark, s);
    r->side = sign;
    r->mark = s;
    return changed;
}
/* Whether the polynomial on an interval is of one sign, as surely as at its end; or has no turning
 * point; or is zero as far as can be told. Each way its end tells all that there is to know. */
static int is_plain(const kr_search *r, const double *b, double width)
{
    const double slack = r->used > 0 ? r->tail_slope * width / r->used : 0.0;
    const double end = b[r->used], sure = r->tail + r->noise;
    int above = end > sure, below = end < -sure, rising = 1, falling = 1, flat = r->tail == 0.0;
    for (int i = 0; i <= r->used; i++) {
        above &= b[i] > r->tail;
        below &= b[i] < -r->tail;
        flat &= fabs(b[i]) <= r->noise;
    }
    if (above | below | flat) return 1;
    for (int i = 1; i <= r->used; i++) {
        rising &= b[i] - b[i - 1] >= slack;
        falling &= b[i - 1] - b[i] >= slack;
    }
    return rising | falling;
}
/* Searches [low, high], where b holds the coefficients in Bernstein's basis and is used up. */
static outcome search(kr_search *r, double *b, double low, double high)
{
    const int n = r->used;
    double left[KR_PIECE_MOST + 1];
    if (high <= r->mark) return NONE;
    if (is_plain(r, b, high - low) || (r->tail == 0.0 && high - low <= NARROWEST)) {
        const double p = fabs(b[n]) > r->tail + r->noise ? b[n] : value(r->c, r->degree, high);
        return take(r, p, high) ? FOUND : NONE;
    }
    if (r->tail > 0.0 && high - low <= NARROW) return UNDECIDED;
    for (int k = 0; k <= n; k++) {
        left[k] = b[0];
        for (int i = 0; i < n - k; i++) b[i] = 0.5 * (b[i] + b[i + 1]);
    }
    const double middle = 0.5 * (low + high);
    const outcome first = search(r, left, low, middle);
    return first == NONE ? search(r, b, middle, high) : first;
}
static outcome search_terms(kr_search *r)
{
    const int n = r->used;
    double b[KR_PIECE_MOST + 1], binomial = 1.0;
    for (int i = 0; i <= n; i++) {
        b[i] = r->c[i] / binomial;
        binomial = binomial * (n - i) / (i + 1);
    }
    for (int k = 1; k <= n; k++)
        for (int i = n; i >= k; i--) b[i] += b[i - 1];
    return search(r, b, 0.0, 1.0);
}
/* Leaves out the last terms, as many as do not matter at first. Their sum bounds the error. Where
 * that decides nothing the search is repeated with all terms: a wrong choice costs time alone. */
static void cut(kr_search *r)
{
    double slopes = 0.0;
    for (int i = 1; i <= r->degree; i++) slopes += i * fabs(r->c[i]);
    r->tail = r->tail_slope = 0.0;
    for (r->used = r->degree; r->used > 0; r->used--) {
        const double last = fabs(r->c[r->used]);
        if (r->tail_slope + r->used * last > TAIL * slopes) break;
        r->tail += last, r->tail_slope += r->used * last;
    }
}
int kr_roots_next(kr_search *r)
{
    double rest[4] = {0.0, 0.0, 0.0, 0.0};
    for (int i = 1; i <= r->degree; i++) rest[i % 4] += fabs(r->c[i]);
    const double others = (rest[0] + rest[1]) + (rest[2] + rest[3]);
    if (!isfinite(fabs(r->c[0]) + r->degree * others)) return 0;
    if (take(r, r->mark > 0.0 ? value(r->c, r->degree, r->mark) : r->c[0], r->mark)) return 1;
    if (r->side * r->c[0] > others) return 0;
    cut(r);
    outcome found = search_terms(r);
    if (found == UNDECIDED) {
        r->used = r->degree;
        r->tail = r->tail_slope = 0.0;
        found = search_terms(r);
    }
    return found == FOUND;
}
