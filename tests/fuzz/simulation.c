/* Calls of the simulation and the mesh functions of the viewer. */
#include "viewer/simulation.h"
#include <math.h>
#include "calls.h"
#include "random_values.h"
#include "claims.h"
#include "math/su2.h"
#include "viewer/mesh.h"
#include "scenes.h"

static kr_simulation stage;

void clear_simulation(void) { kr_simulation_clear(&stage); }

static void add(void)
{
    kr_scene scene = any_scene();
    const kr_method *method = odds(5) ? NULL : any_method();
    const int64_t step = odds(90) ? 1 + (int64_t)choose(60000) : (int64_t)choose(UINT64_MAX);
    const double tol = maybe_arbitrary(spread(1e-12, 0.1), 5);
    const int against = (int)choose(10) - 1, tops = stage.count;
    if (odds(90)) scene.start.t = 0.0;
    tell_scene(&scene);
    print_call("stage: add %s, step %lld, tol %a, against %d",
               method ? kr_method_describe(method).name : "none", (long long)step, tol, against);
    const kr_status status = kr_simulation_add(&stage, &scene, method, step, tol, against);
    error_category(status);
    CLAIM(stage.count == tops + (status == KR_OK));
    if (status != KR_OK) return;
    CLAIM(kr_scene_check(&scene) == KR_OK && stage.slots[tops].status == KR_OK);
}
/* Adds a track of states computed elsewhere. */
static void add_track(void)
{
    static kr_state track[64];
    static int is_filled;
    kr_scene scene = any_scene();
    const int tops = stage.count, against = (int)choose(10) - 1;
    const int64_t length = odds(90) ? (int64_t)choose(65) : (int64_t)choose(UINT64_MAX) - INT32_MAX,
                  step = odds(90) ? 1 + (int64_t)choose(60000) : (int64_t)choose(UINT64_MAX);
    if (odds(90)) scene.start.t = 0.0;
    for (int i = 0; i < 64 && (tops == 0 || !is_filled); i++)
        track[i] = (kr_state){i, any_attitude(), {1, 2, i}};
    is_filled = 1;
    print_call("stage: add a track of %lld, step %lld, against %d", (long long)length,
               (long long)step, against);
    const kr_status status = kr_simulation_add_track(&stage, &scene, odds(98) ? track : NULL,
                                                     length > 64 ? 64 : length, step, against);
    error_category(status);
    CLAIM(stage.count == tops + (status == KR_OK));
    if (status == KR_OK) CLAIM(length > 0 && kr_scene_check(&scene) == KR_OK);
}
static void measure(void)
{
    double measures[KR_SIMULATION_MEASURES + 1];
    for (int i = 0; i < stage.count; i++) {
        fill_with_mark(measures, sizeof measures);
        print_call("stage: measure %d", i);
        kr_simulation_measure(&stage, i, measures);
        CLAIM(is_marked(&measures[KR_SIMULATION_MEASURES], sizeof *measures));
    }
}
static void advance(void)
{
    const int64_t clock = stage.clock,
                  target = clock + (int64_t)choose(odds(90) ? 3000000 : UINT64_MAX / 4),
                  most = (int64_t)choose(12);
    print_call("stage: advance to %lld, %lld steps at most", (long long)target, (long long)most);
    const int64_t got = kr_simulation_advance(&stage, target, most);
    CLAIM(got == stage.clock && got >= clock && got <= target);
    CLAIM(stage.rows <= KR_SIMULATION_ROWS);
    for (int i = 0; i < stage.count; i++) {
        const kr_simulation_slot *actor = &stage.slots[i];
        error_category(actor->status);
        CLAIM(is_good(actor->now));
    }
}
static void picture(void)
{
    static float points[KR_MESH_RINGS * KR_MESH_SIDES + KR_MESH_POINTS][3];
    double momentum, velocity;
    if (stage.count == 0) return;
    const kr_simulation_slot *actor = &stage.slots[choose((uint64_t)stage.count)];
    const kr_trail trail = {actor->attitudes, actor->momenta, KR_SIMULATION_TRACE, actor->steps,
                            (double)actor->step / KR_SIMULATION_TICKS};
    print_call("stage: picture");
    (void)kr_mesh_box(&actor->scene.body);
    kr_mesh_limits(&actor->scene, &momentum, &velocity);
    const int way = kr_mesh_trail(&actor->scene.body, &trail, 1.0, points);
    CLAIM(way >= 0 && way <= KR_MESH_POINTS);
    const int rings = kr_mesh_rod(&actor->scene.body, &trail, 1.0, 0.1, 0.5, points);
    CLAIM(rings >= 0 && rings <= KR_MESH_RINGS);
}
void call_simulation(void)
{
    switch (choose(9)) {
    case 0:
        print_call("stage: clear");
        kr_simulation_clear(&stage);
        break;
    case 1:
    case 2:
        add();
        break;
    case 3:
        add_track();
        break;
    case 4:
        measure();
        break;
    case 5:
        picture();
        break;
    default:
        advance();
        break;
    }
}
