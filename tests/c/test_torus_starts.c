/* Starts of Kowalewski and Goryachev-Chaplygin tops as users write them: the vertical and the
 * angular velocity have components 0, 1 and -1, times a simple number. Many of these motions are
 * degenerate. Each is right, or it is refused by name. */
#include <stdlib.h>
#include "torus_tops.h"

enum { DIRECTIONS = 27, MOTIONLESS = 13, RATES = 3 };

static void *memory;

/* Returns the vector number i of those with the components -1, 0 and 1. */
static kr_vec3 direction(int i) { return v3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1); }
static kr_scene kowalewski_start(kr_vec3 up, kr_vec3 velocity)
{
    return kowalewski_top_of(up, velocity);
}
static kr_scene chaplygin_start(kr_vec3 up, kr_vec3 velocity)
{
    const kr_vec3 L = v_times(v3(1.0, 1.0, 0.25), velocity), e = v_unit(up);
    return chaplygin_top_of(up, v_sub(L, v_scale(v_dot(L, e), e)));
}
/* Checks one start. Returns 1 if it is planned. */
static int check_kowalewski(const kr_scene *s, double t)
{
    const kr_kowalewski *top = NULL;
    if (kr_kowalewski_plan(s, 0.0, memory, &top) == KR_OK) {
        NEAR(error_of(s, kr_kowalewski_state(top, t), by_series(s, t)), 0.0,
             2e-14 + 10.0 * top->certificate);
        return 1;
    }
    const int refusal = ((const kr_kowalewski *)memory)->refusal;
    IS(refusal == KR_KOWALEWSKI_REST || refusal == KR_KOWALEWSKI_ROTATION ||
       refusal == KR_KOWALEWSKI_PLANAR || refusal == KR_KOWALEWSKI_COINCIDENT ||
       refusal == KR_KOWALEWSKI_SEPARATRIX || refusal == KR_KOWALEWSKI_SUMS);
    return 0;
}
static int check_chaplygin(const kr_scene *s, double t)
{
    const kr_goryachev_chaplygin *top = NULL;
    if (kr_goryachev_chaplygin_plan(s, 0.0, memory, &top) == KR_OK) {
        NEAR(error_of(s, kr_goryachev_chaplygin_state(top, t), by_series(s, t)), 0.0,
             3e-14 + 10.0 * top->certificate);
        return 1;
    }
    const int refusal = ((const kr_goryachev_chaplygin *)memory)->refusal;
    IS(refusal == KR_CHAPLYGIN_REST || refusal == KR_CHAPLYGIN_PLANAR ||
       refusal == KR_CHAPLYGIN_ZERO || refusal == KR_CHAPLYGIN_COINCIDENT ||
       refusal == KR_CHAPLYGIN_SEPARATRIX);
    return 0;
}
/* Checks all starts of one kind of top. More than the fraction `share` of them are planned. */
static void check_starts(kr_scene (*start)(kr_vec3 up, kr_vec3 velocity),
                         int (*check)(const kr_scene *s, double t), double share)
{
    const double rates[RATES] = {0.5, 1.0, 1.3}, times[2] = {7.0, -20.0};
    int planned = 0, all = 0;
    for (int i = 0; i < DIRECTIONS; i++)
        for (int j = 0; j < DIRECTIONS; j++) {
            const double rate = rates[(i + j) % RATES];
            if (i == MOTIONLESS) continue;
            const kr_scene s = start(direction(i), v_scale(rate, direction(j)));
            planned += check(&s, times[(i + 2 * j) % 2]);
            all++;
        }
    IS(planned > share * all);
}

int main(void)
{
    const size_t one = kr_kowalewski_size(), other = kr_goryachev_chaplygin_size();
    memory = malloc(one > other ? one : other);
    check_starts(kowalewski_start, check_kowalewski, 0.8);
    check_starts(chaplygin_start, check_chaplygin, 0.75);
    free(memory);
    return check_result();
}
