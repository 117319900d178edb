"""The choice between a closed-form solution and the Taylor series for method='auto'."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from .._core import torus_plan, values
from .._model.scene import Scene
from .._utils.validation import Array, as_finite_array
from .methods import EXACT, TORUS_KINDS, explain_no_closed_form, methods
from .times import TIMES_FORM

_ROUNDING: Final = 2.0**-53
_LARGEST_CERTIFICATE: Final = 1e-11  # the core refuses closed forms with a larger one
_ERROR_PER_CERTIFICATE: Final = 10.0  # see kreisel.ExactTorus


class _TorusFormCosts(NamedTuple):
    """The cost of a closed-form solution, in units of the cost of one Taylor-series step.

    With these parameters, the Taylor series was slower for all random tops for which the
    closed-form solution is chosen (docs/theory/closed_form.md).

    ratio   the ratio of each equal moment to the third one
    set_up  the time of the set-up [steps]
    state   the time of a state [steps]
    """

    ratio: float
    set_up: float
    state: float


_FORMS: Final = {
    "kowalewski": _TorusFormCosts(ratio=2.0, set_up=1e3, state=0.5),
    "goryachev_chaplygin": _TorusFormCosts(ratio=4.0, set_up=3e4, state=20.0),
}


def prefers_closed_form(scene: Scene, t: object) -> bool:
    """Return True if method='auto' uses the closed-form solution on a torus.

    Raises TypeError or ValueError if the times `t` are invalid.
    """
    error_limit = compute_closed_form_error_limit(scene, t)
    return error_limit > 0.0 and torus_plan(scene._block, error_limit)[0] == "OK"


def compute_closed_form_error_limit(scene: Scene, t: object) -> float:
    """Return the largest certificate for which method='auto' accepts a closed-form solution.

    Returns 0.0 if method='auto' uses the Taylor series regardless of the certificate. Raises
    TypeError or ValueError if the times `t` are invalid.
    """
    if _is_too_short_for_closed_form(scene, t):
        return 0.0
    return _decide_on_closed_form(scene, as_finite_array("t", t, TIMES_FORM))[1]


def _is_too_short_for_closed_form(scene: Scene, t: object) -> bool:
    """Return True if the Taylor series is certainly faster than the closed-form solution.

    Checking only the last time is much faster than validating all times.
    """
    last = t
    if (isinstance(t, list) or (isinstance(t, np.ndarray) and t.ndim == 1)) and len(t) > 0:
        last = t[-1]
    form = _FORMS[scene.body.kind]
    # The angular velocity is at most `ratio` times the rate.
    most_steps = (0.5 * form.ratio + 1.0) * scene._rotation_rate
    return isinstance(last, (int, float)) and most_steps * abs(last) < form.set_up


def explain_taylor_choice(scene: Scene, times: Array | None) -> str | None:
    """Return the reason why method='auto' does not use the closed form, or None if it does.

    The closed-form solution is used if it is neither slower nor less accurate than the Taylor
    series. The choice of method depends only on the arguments, not on the speed of the machine.
    `times` is None if the requested times are unknown.

    The costs of the two methods are compared only for single scenes. In an ensemble, the method
    chosen for each top depends only on its scene. See "Ensembles" in docs/theory/closed_form.md.
    """
    reason, error_limit = _decide_on_closed_form(scene, times)
    if reason:
        return reason
    status, refusal = torus_plan(scene._block, error_limit)[:2]
    top = TORUS_KINDS[scene.body.kind]
    return None if status == "OK" else f"the closed form of a {top} top does not apply: {refusal}"


def _decide_on_closed_form(scene: Scene, times: Array | None) -> tuple[str, float]:
    """Return the reason for rejecting the closed form, and the largest acceptable certificate.

    The returned reason is an empty string if the closed-form solution may be used.
    """
    top, form = TORUS_KINDS[scene.body.kind], _FORMS[scene.body.kind]
    if not methods[EXACT].suits(scene):
        return explain_no_closed_form(scene), 0.0
    if scene._has_disturbances:  # a support that turns about e3
        reason = (
            f"'auto' integrates {top} tops on turning supports; "
            "the method 'exact' takes the closed form"
        )
        return reason, 0.0
    if times is None:
        reason = (
            f"'auto' integrates {top} tops in runs, streams, ensembles and without times; "
            "the method 'exact' takes the closed form"
        )
        return reason, 0.0
    steps = _estimate_taylor_steps(scene, float(np.abs(times).max(initial=0.0)))
    cost = form.set_up + form.state * times.size
    if not steps >= cost:  # NaN if the rates of the top exceed the range of doubles
        reason = (
            f"the closed form of a {top} top takes as long as {cost:.2g} steps of the series, "
            f"and about {steps:.2g} suffice"
        )
        return reason, 0.0
    return "", min(_ROUNDING * steps / _ERROR_PER_CERTIFICATE, _LARGEST_CERTIFICATE)


def _estimate_taylor_steps(scene: Scene, end: float) -> float:
    """Estimate the number of steps that the Taylor series needs to reach the time `end`.

    The estimate is `end` times the sum of half the angular velocity and the pendulum frequency. For
    random tops, the actual number of steps is between 0.8 and 4 times the estimate.
    """
    body = scene.body
    velocity = math.hypot(*values("velocity", scene._block, scene._start_state).ravel())
    torque = body.mass * abs(scene.gravity) * math.hypot(*body.com)
    return end * (0.5 * velocity + math.sqrt(torque / max(body.moments)))
