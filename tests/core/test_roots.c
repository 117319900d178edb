/* The search for the places inside a step where a polynomial changes its sign. */
#include "events/roots.h"
#include "random.h"
#include "tops.h"

enum { MANY = 64 };

/* Finds where scale * prod (s - root) changes its sign, and returns how often that is. */
static int roots_of(int n, const double *root, double scale, double *found)
{
    double c[KR_PIECE_MOST + 1] = {scale};
    for (int k = 0; k < n; k++)
        for (int i = k + 1; i >= 0; i--) c[i] = (i > 0 ? c[i - 1] : 0.0) - root[k] * c[i];
    kr_search r = {
        .c = c, .degree = n, .noise = fabs(scale) * 0x1p-48, .start_noise = fabs(scale) * 0x1p-40};
    int count = 0;
    while (count < MANY && kr_roots_next(&r)) found[count++] = r.root;
    return count;
}
static void named_roots(void)
{
    const double near[] = {0.3, 0.3 + 1e-6, -2.0, 3.0}, twice[] = {0.37, 0.37},
                 thrice[] = {0.37, 0.37, 0.37};
    const double ends[] = {0.0, 1.0, 0.5}, outside[] = {-0.1, 1.1}, near_end[] = {1.0 - 1e-9, 2.0};
    double found[MANY], scaled[MANY];
    IS(roots_of(4, near, 1.0, found) == 2);
    NEAR(found[0], near[0], 1e-9);
    NEAR(found[1], near[1], 1e-9);
    IS(roots_of(4, near, -0x1p-300, scaled) == 2 && scaled[0] == found[0] && scaled[1] == found[1]);
    IS(roots_of(2, twice, 1.0, found) == 0);
    IS(roots_of(3, thrice, 1.0, found) == 1);
    NEAR(found[0], 0.37, 1e-4); /* the cube root of rounding */
    /* neither the start nor the end */
    IS(roots_of(3, ends, 1.0, found) == 1 && fabs(found[0] - 0.5) < 1e-15);
    IS(roots_of(2, outside, 1.0, found) == 0);
    IS(roots_of(2, near_end, 1.0, found) == 1);
    NEAR(found[0], near_end[0], 1e-15);
    IS(roots_of(1, outside, 0.0, found) == 0);
    IS(roots_of(2, twice, INFINITY, found) == 0 && roots_of(2, twice, NAN, found) == 0);
}
/* Twelve roots, of which four may lie outside; roots closer than 0.01 may be told apart or not. */
static void random_roots(void)
{
    double found[MANY];
    int tried = 0;
    for (int i = 0; i < 20000; i++) {
        double root[12];
        int inside = 0;
        for (int k = 0; k < 12; k++)
            root[k] = k % 3 ? uniform(-1.5, 2.5) : 0.04 * k + uniform(0.0, 0.03);
        for (int k = 0; k < 12; k++) inside += root[k] > 0.0 && root[k] < 1.0;
        for (int k = 0; k < 144; k++)
            if (k / 12 != k % 12 && fabs(root[k / 12] - root[k % 12]) < 0.01) inside = -1;
        if (inside < 0) continue;
        IS(roots_of(12, root, 1.0, found) == inside);
        tried++;
    }
    IS(tried > 1000);
}

int main(void)
{
    named_roots();
    random_roots();
    return check_result();
}
