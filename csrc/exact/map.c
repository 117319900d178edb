/* The closed form of the Bobenko-Suris map, and its states. This file is compiled once for each
 * instruction set. It is separate from closed_form.c, so that programs without the map, such as the
 * page, do not link it. */
#include "dispatch.h"
#include "map.h"

const kr_exact_maps KR_NAME(kr_exact_maps) = {map_plan, map_state};
