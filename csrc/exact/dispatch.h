/* What is compiled once per instruction set, and chosen when it runs (exact.c). Every set
 * gives the same bits: none fuses a product and a sum but in two_product, which is exact either
 * way. */
#ifndef KR_EXACT_SET_H
#define KR_EXACT_SET_H
#include "kreisel.h"
#include "numbers/isa.h"

typedef struct kr_exact_one { /* plans.c */
    /* own: in working axes and own units, from 0 */
    kr_status (*plan)(const kr_scene *scene, int own, kr_exact *plan);
    kr_state (*state)(const kr_exact *plan, double t);
} kr_exact_one;
typedef struct kr_exact_maps { /* maps.c */
    kr_status (*plan)(const kr_scene *scene, double step, kr_exact_map *map);
    kr_state (*state)(const kr_exact_map *map, int64_t k);
} kr_exact_maps;
/* states.c */
typedef void kr_exact_many(const kr_exact *plan, size_t n, const double t[], kr_state out[]);

extern const kr_exact_one kr_exact_one_base, kr_exact_one_avx2;
extern const kr_exact_maps kr_exact_maps_base, kr_exact_maps_avx2;
kr_exact_many kr_exact_many_base, kr_exact_many_avx2, kr_exact_many_avx512;

typedef struct kr_exact_isa {
    const char *name;
    int (*runs_here)(void);
    const kr_exact_one *one;
    kr_exact_many *many;
} kr_exact_isa;
const kr_exact_isa *kr_exact_isa_at(int i); /* as kr_taylor_isa */
/* see kr_exact_one's plan */
kr_status kr_exact_own(const kr_scene *scene, kr_exact *plan);
#endif
