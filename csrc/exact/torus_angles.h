/* The state of a top at chosen angles of its torus. The Python package computes the actions of the
 * top from such states. */
#ifndef KR_EXACT_TORUS_ANGLES_H
#define KR_EXACT_TORUS_ANGLES_H
#include "kreisel.h"

#ifdef __cplusplus
extern "C" {
#endif
/* Returns the state at two angles [turns], which grow with time at the frequencies `first` and
 * `second` of the plan. The heading of a Kowalewski top is the one of the start; the heading of a
 * Goryachev-Chaplygin top is arbitrary. Overwrites the phases of the plan. `kind` is the kind of
 * the plan's body. */
kr_state kr_torus_state_at(kr_kind kind, void *plan, const double angle[2]);
#ifdef __cplusplus
}
#endif
#endif
