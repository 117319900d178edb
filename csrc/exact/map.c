/* Set-up and states of the closed-form Bobenko-Suris map. This file is compiled once for each
 * instruction set. The code of the Bobenko-Suris map is in a separate source file, so that programs
 * that do not use the map, such as the viewer, do not link it. */
#include "dispatch.h"
#include "map.h"

const kr_exact_maps KR_NAME(kr_exact_maps) = {map_plan, map_state};
