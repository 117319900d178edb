/* The map's plans and states. Compiled once per instruction set, as plans.c, but apart from it: who
 * does without the map, as the page, links nothing of it. */
#include "dispatch.h"
#include "map.h"

const kr_exact_maps KR_NAME(kr_exact_maps) = {map_plan, map_state};
