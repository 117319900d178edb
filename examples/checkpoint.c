/* Saves a moving top to a file, loads it again, and continues bitwise as without the interruption.
 *
 *     checkpoint FILE */
#include <kreisel.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Creates a top whose three moments differ. Such a top has no closed form. */
static kr_status create_top(kr_top **top)
{
    const double inertia[9] = {0.010, 0.0, 0.0, 0.0, 0.008, 0.0, 0.0, 0.0, 0.003};
    kr_scene scene = {.gravity = 9.81, .start.q = {0.8660254037844387, 0.5, 0.0, 0.0}};
    scene.start.m = (kr_vec3){0.0, -0.3, 0.2};
    const kr_status status =
        kr_body_from_tensor(1.0, inertia, (kr_vec3){0.0, 0.0, 0.1}, 0.0, &scene.body);
    return status == KR_OK ? kr_top_create(&scene, &kr_method_taylor, kr_config_default(), top)
                           : status;
}
static int save_top(const kr_top *top, const char *name)
{
    const size_t size = kr_top_save_size(top);
    void *memory = malloc(size);
    FILE *file = fopen(name, "wb");
    const int is_saved = memory && file && kr_top_save(top, size, memory) == KR_OK &&
                         fwrite(memory, 1, size, file) == size;
    const int is_closed = file && fclose(file) == 0;
    free(memory);
    return is_saved && is_closed;
}
/* Loads the checkpoint. Byte number `damaged` is inverted first; -1: none. */
static kr_status load_top(kr_top *top, const char *name, long damaged)
{
    const size_t size = kr_top_save_size(top);
    unsigned char *memory = malloc(size);
    FILE *file = fopen(name, "rb");
    kr_status status = memory && file ? KR_OK : KR_ERR_MEMORY;
    if (status == KR_OK && fread(memory, 1, size, file) != size) status = KR_ERR_CHECKPOINT;
    if (status == KR_OK && damaged >= 0) memory[damaged] ^= 0xff;
    if (status == KR_OK) status = kr_top_load(top, size, memory);
    if (file) fclose(file);
    free(memory);
    return status;
}
static int run_example(const char *name, kr_top *first, kr_top *second)
{
    if (kr_top_advance(first, 1.0) != KR_OK || !save_top(first, name)) return 1;
    printf("damaged: %s\n", kr_status_text(load_top(second, name, 100)));
    if (load_top(second, name, -1) != KR_OK) return 1;
    printf("loaded at t = %.1f\n", kr_top_describe(second).time);
    if (kr_top_advance(first, 5.0) != KR_OK || kr_top_advance(second, 5.0) != KR_OK) return 1;
    const kr_state a = kr_top_state(first), b = kr_top_state(second);
    printf("t = %.1f: m = %.10f %.10f %.10f\n", b.t, b.m.x, b.m.y, b.m.z);
    printf("%s\n", memcmp(&a, &b, sizeof a) == 0 ? "bitwise equal" : "different");
    return 0;
}
int main(int count, char **words)
{
    if (count != 2) {
        fprintf(stderr, "usage: checkpoint FILE\n");
        return 2;
    }
    kr_top *first = NULL, *second = NULL;
    int failed = create_top(&first) != KR_OK || create_top(&second) != KR_OK;
    if (!failed) failed = run_example(words[1], first, second);
    kr_top_free(first);
    kr_top_free(second);
    return failed;
}
