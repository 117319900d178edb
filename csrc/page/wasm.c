/* What the page calls: one stage, and what it shows, as numbers and places of numbers; and of
 * kreisel.h. Built for WebAssembly only, hence one stage to a page: the only global state
 * there is. */
#include "picture.h"
#include "stage.h"
#include "taylor/taylor.h"

/* The stage asks for no more digits than a double has: the page does without the kernels for 20 and
 * 30. */
#ifdef __wasm__
const kr_kernel kr_kernel_dd_base[KR_DEPTHS];
#endif

#define EXPORT(type, name, parameters)                                                             \
    KR_API type name parameters;                                                                   \
    KR_API type name parameters

static kr_stage stage;
static kr_measure measured;
static kr_vec3 velocity;
static double reach[2];
static kr_box box;
static float points[KR_PICTURE_RINGS * KR_PICTURE_SIDES][3];

EXPORT(void, kr_page_clear, (void)) { kr_stage_clear(&stage); }
EXPORT(kr_status, kr_page_add,
       (const kr_scene *scene, const kr_method *method, double eps, double tol, int against))
{
    return kr_stage_add(&stage, scene, method, (int64_t)eps, tol, against);
}
EXPORT(kr_status, kr_page_add_track,
       (const kr_scene *scene, const kr_state *track, int length, double eps, int against))
{
    return kr_stage_add_track(&stage, scene, track, length, (int64_t)eps, against);
}
EXPORT(double, kr_page_advance, (double target, int most))
{
    return (double)kr_stage_advance(&stage, (int64_t)target, most);
}
EXPORT(double, kr_page_common, (void)) { return (double)stage.common; }

EXPORT(const kr_state *, kr_page_state, (int i)) { return &stage.actor[i].now; }
EXPORT(kr_status, kr_page_status, (int i)) { return stage.actor[i].status; }
EXPORT(const kr_vec3 *, kr_page_velocity, (int i))
{
    velocity = kr_state_velocity(&stage.actor[i].scene, &stage.actor[i].now);
    return &velocity;
}
EXPORT(const kr_measure *, kr_page_measure, (int i))
{
    measured = kr_stage_measure(&stage, i);
    return &measured;
}
EXPORT(int, kr_page_rows, (void)) { return (int)stage.rows; }
EXPORT(const kr_row *, kr_page_row, (int k)) { return &stage.row[k]; }

EXPORT(const double *, kr_page_reach, (int i))
{
    kr_picture_reach(&stage.actor[i].scene, &reach[0], &reach[1]);
    return reach;
}
EXPORT(const kr_box *, kr_page_box, (const kr_body *body))
{
    box = kr_picture_box(body);
    return &box;
}
static kr_trail trail(const kr_actor *a)
{
    const kr_trail t = {a->trace, KR_STAGE_TRACE, a->steps, (double)a->eps / KR_STAGE_TICKS};
    return t;
}
EXPORT(const float *, kr_page_points, (void)) { return points[0]; }
EXPORT(int, kr_page_way, (int i, double radius))
{
    const kr_trail t = trail(&stage.actor[i]);
    return kr_picture_way(&stage.actor[i].scene.body, &t, radius, points);
}
EXPORT(int, kr_page_rod, (int i, double scale, double radius))
{
    const kr_trail t = trail(&stage.actor[i]);
    return KR_PICTURE_SIDES * kr_picture_rod(&stage.actor[i].scene.body, &t, scale, radius, points);
}
