/* The closed form of the Bobenko-Suris map, and its states. This file is compiled once for each
 * instruction set. The map has its own file, so that programs without the map, such as the viewer,
 * do not link it. */
#include "dispatch.h"
#include "map.h"

const kr_exact_maps KR_NAME(kr_exact_maps) = {map_plan, map_state};
