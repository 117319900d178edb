/* Moves a checkpoint between machines. `machine save FILE` writes a checkpoint. `machine load FILE`
 * loads it and prints its time, or prints why it is refused and exits with status 3. */
#include <stdio.h>
#include <stdlib.h>
#include "kreisel.h"

int main(int argc, char **argv)
{
    const kr_scene scene = kr_scene_default();
    const kr_config config = {.step = 0.01};
    kr_top *top = NULL;
    if (argc != 3 || kr_top_create(&scene, kr_method_find("strang"), config, &top) != KR_OK)
        return 2;
    const int saves = argv[1][0] == 's';
    const size_t size = kr_top_save_size(top);
    unsigned char *memory = calloc(size + 1, 1);
    FILE *file = fopen(argv[2], saves ? "wb" : "rb");
    kr_status status = memory && file ? KR_OK : KR_ERR_MEMORY;
    if (status == KR_OK && saves) {
        status = kr_top_advance(top, 5.0);
        if (status == KR_OK) status = kr_top_save(top, size, memory);
        if (fwrite(memory, 1, size, file) != size) status = KR_ERR_MEMORY;
    } else if (status == KR_OK) {
        status = kr_top_load(top, fread(memory, 1, size + 1, file), memory);
    }
    const double t = kr_top_state(top).t;
    printf("%s at t = %g\n", kr_status_text(status), t);
    if (file) fclose(file);
    free(memory);
    kr_top_free(top);
    return status == KR_OK ? 0 : 3;
}
