/* One top on a microcontroller, without an operating system and without a heap.
 *
 * The top is moved by kr_method_strang, which is the only method that is linked. All its steps cost
 * the same, so tick() can run in the interrupt of a timer. */
#include "bare.h"

enum { POOL_DOUBLES = 384 };
static double pool[POOL_DOUBLES];
static size_t used;

/* kr_top_create calls calloc once, kr_top_free calls free. Here calloc takes zeros from the pool,
 * and nothing is given back. */
void *calloc(size_t count, size_t size)
{
    const size_t doubles = (count * size + sizeof(double) - 1) / sizeof(double);
    if (doubles > POOL_DOUBLES - used) return NULL; /* kr_top_create returns KR_ERR_MEMORY */
    used += doubles;
    return pool + used - doubles;
}
void free(void *memory) { (void)memory; }

static kr_scene scene;
static kr_top *top;

kr_status begin(double step)
{
    scene = kr_scene_default();
    kr_status status = kr_body_symmetric(0.5, 7.5125e-3, 6.25e-4, 0.12, &scene.body);
    scene.gravity = 9.81;
    scene.start.q = (kr_quat){0.8660254037844387, 0.5, 0.0, 0.0}; /* tilted by 60 degrees */
    const kr_vec3 apex = kr_state_apex(&scene, &scene.start);
    const double m = 314.159 * 6.25e-4; /* spin times moment */
    scene.start.m = (kr_vec3){m * apex.x, m * apex.y, m * apex.z};
    kr_config config = kr_config_default();
    config.step = step;
    if (status == KR_OK) status = kr_top_create(&scene, &kr_method_strang, config, &top);
    return status;
}
kr_status tick(void) { return kr_top_step(top); }
double height(void)
{
    const kr_state s = kr_top_state(top);
    return kr_state_apex(&scene, &s).z;
}
size_t memory_used(void) { return used * sizeof(double); }
