/* So many states of the closed form at once that they go past the cache, to places that suit that
 * and to others. */
#include <string.h>
#include "check.h"
#include "kreisel.h"

enum { N = 20000 };
static double times[N];
static kr_state memory[N + 1];

static void same_as_one_by_one(const kr_scene *scene, kr_state *out)
{
    kr_exact plan;
    IS(kr_exact_plan(scene, &plan) == KR_OK);
    kr_exact_states(&plan, N, times, out);
    for (int k = 0; k < N; k++) {
        const kr_state one = kr_exact_state(&plan, times[k]);
        IS(k == 77 ? isnan(out[k].q.w) : memcmp(&out[k], &one, sizeof one) == 0);
    }
}
int main(void)
{
    kr_state *const odd = (kr_state *)(void *)((double *)(void *)memory + 1);
    kr_scene scene = kr_scene_default();
    for (int k = 0; k < N; k++) times[k] = 0.37 * (k - 5000);
    times[77] = NAN;
    for (int i = -1; i <= 1; i++) {
        scene.gravity = i;
        same_as_one_by_one(&scene, memory);
        same_as_one_by_one(&scene, odd);
    }
    return check_result();
}
