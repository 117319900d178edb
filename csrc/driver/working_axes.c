/* Conversion of the initial state to the axes that the method uses, for up to 16 requested digits.
 * For more digits, see extended.c. */
#include "model/body.h"
#include "top.h"

/* Methods that do not depend on the order of the axes use the principal axes as given. The initial
 * state is converted to the principal axes exactly, which preserves small tilt angles. */
kr_working kr_top_working_axes(const kr_top *top)
{
    const kr_scene *scene = &top->scene;
    return top->method->flags & KR_METHOD_DIGITS
               ? kr_body_principal(&scene->body, scene->damping)
               : kr_body_working_damped(&scene->body, scene->damping);
}
/* Converts the attitude `q` to axes that are a permutation of the principal axes. If the top is
 * nearly upright, its small tilt angle is the difference of two nearly equal quaternion components.
 * Double-double arithmetic is used to preserve the digits of small tilt angles. Stores the digits
 * of the result beyond double precision in top->main.low. */
static kr_quat rename_attitude(kr_top *top, kr_quat axes, kr_quat q)
{
    const quat_dd principal = qdd_mul(qdd_of(q), qdd_of(top->scene.body.axes)),
                  own = qdd_unit(qdd_mul(principal, qdd_of(axes)));
    top->main.low.q = qdd_low(own);
    return qdd_high(own);
}
kr_state kr_top_start_in_own_units(kr_top *top, const kr_state *state)
{
    const kr_working working = kr_top_working_axes(top);
    const int is_renamed = !working.tilted && kr_body_last_axis(&top->scene.body) != 2;
    return (kr_state){0.0,
                      is_renamed ? rename_attitude(top, working.axes, state->q)
                                 : q_unit(q_mul(state->q, top->axes)),
                      v_scale(1.0 / top->momentum_unit, state->m)};
}
