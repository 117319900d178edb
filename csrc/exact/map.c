/* The closed form of the Bobenko-Suris map, and its states. This file is compiled once per
 * instruction set. It stands apart from closed_form.c, so that who does without the map, as the
 * page does, links nothing of it. */
#include "dispatch.h"
#include "map.h"

const kr_exact_maps KR_NAME(kr_exact_maps) = {map_plan, map_state};
