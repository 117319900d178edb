/* Set-up and states of the closed-form Bobenko-Suris map. This file is compiled once for each
 * instruction set. The map has its own file, so programs that do not use it, such as the viewer, do
 * not link its code. */
#include "dispatch.h"
#include "map.h"

const kr_exact_maps KR_NAME(kr_exact_maps) = {map_plan, map_state};
