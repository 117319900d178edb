"""The choice by the method 'auto' between a closed form on a torus and the Taylor series."""

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
    """The costs of a closed form, in units of one step of the Taylor series.

    The values were chosen by validation/studies/set_up_times.py. With these values, the closed form
    is slower for about 1 % of the random tops for which 'auto' chooses it.

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
    """Return True if 'auto' uses the closed form of a Kowalewski or Goryachev-Chaplygin top.

    `t` is the argument of kreisel.solve. Raises TypeError or ValueError if `t` contains no valid
    times.
    """
    allowed = compute_largest_certificate(scene, t)
    return allowed > 0.0 and torus_plan(scene._block, allowed)[0] == "OK"


def compute_largest_certificate(scene: Scene, t: object) -> float:
    """Return the largest certificate of a closed form that 'auto' uses for a top on a torus.

    Returns 0.0 if 'auto' uses the Taylor series for any certificate. `t` is the argument of
    kreisel.solve. Raises TypeError or ValueError if it contains no times.
    """
    if _is_too_short_for_closed_form(scene, t):
        return 0.0
    return _decide_on_closed_form(scene, as_finite_array("t", t, TIMES_FORM))[1]


def _is_too_short_for_closed_form(scene: Scene, t: object) -> bool:
    """Return True if the last time of `t` is certainly too early for the closed form.

    This check takes far less time than a short solve, unlike the validation of `t`.
    """
    last = t
    if (isinstance(t, list) or (isinstance(t, np.ndarray) and t.ndim == 1)) and len(t) > 0:
        last = t[-1]
    form = _FORMS[scene.body.kind]
    # The angular velocity is at most `ratio` times the rate.
    most_steps = (0.5 * form.ratio + 1.0) * scene._rotation_rate
    return isinstance(last, (int, float)) and most_steps * abs(last) < form.set_up


def explain_taylor_choice(scene: Scene, times: Array | None) -> str | None:
    """Return the reason why 'auto' integrates a Kowalewski or Goryachev-Chaplygin top numerically.

    Returns None if 'auto' uses the closed form. The closed form is used if it is at least as fast
    as the Taylor series, and at least as accurate at all `times`. The result depends only on the
    arguments, not on the speed of the machine. `times` is None if the times are not known.

    The rule applies to single scenes. In an ensemble, the method of a top depends only on its
    scene, because the threads of the core do not plan closed forms. See "Ensembles" in
    docs/theory/closed_form.md.
    """
    reason, allowed = _decide_on_closed_form(scene, times)
    if reason:
        return reason
    status, refusal = torus_plan(scene._block, allowed)[:2]
    top = TORUS_KINDS[scene.body.kind]
    return None if status == "OK" else f"the closed form of a {top} top does not apply: {refusal}"


def _decide_on_closed_form(scene: Scene, times: Array | None) -> tuple[str, float]:
    """Return the reason for the series before a plan is set up, or "", and the certificate allowed.

    The certificate is 0.0 if there is a reason.
    """
    top, form = TORUS_KINDS[scene.body.kind], _FORMS[scene.body.kind]
    if scene._has_disturbances or not methods[EXACT].suits(scene):
        return explain_no_closed_form(scene), 0.0
    if _is_only_nearly_integrable(scene, form.ratio):
        return f"the closed form of a {top} top would neglect rounding errors of this scene", 0.0
    if times is None:
        reason = (
            f"'auto' integrates {top} tops in runs, streams, ensembles and without times; "
            "the method 'exact' takes the closed form"
        )
        return reason, 0.0
    steps = _estimate_steps(scene, float(np.abs(times).max(initial=0.0)))
    cost = form.set_up + form.state * times.size
    if not steps >= cost:  # NaN if the rates of the top exceed the range of doubles
        reason = (
            f"the closed form of a {top} top takes as long as {cost:.2g} steps of the series, "
            f"and about {steps:.2g} suffice"
        )
        return reason, 0.0
    return "", min(_ROUNDING * steps / _ERROR_PER_CERTIFICATE, _LARGEST_CERTIFICATE)


def _is_only_nearly_integrable(scene: Scene, ratio: float) -> bool:
    """Return True if the body only approximately satisfies the conditions of the closed form."""
    moments, com = scene.body.moments, scene.body.principal_com
    odd = moments.index(min(moments))
    pair = ratio * moments[odd]
    is_exact = all(moment in (pair, moments[odd]) for moment in moments) and com[odd] == 0.0
    is_level = scene.body.kind == "kowalewski" or scene.momentum[2] == 0.0
    return not (is_exact and is_level)


def _estimate_steps(scene: Scene, end: float) -> float:
    """Return an estimate of the number of steps of the Taylor series up to the time `end`.

    The number is proportional to the angular velocity or, for slow tops, to the rate of a pendulum.
    For random tops, the number is between 0.8 and 4 times the estimate.
    """
    body = scene.body
    velocity = math.hypot(*values("velocity", scene._block, scene._start).ravel())
    torque = body.mass * abs(scene.gravity) * math.hypot(*body.com)
    return end * (0.5 * velocity + math.sqrt(torque / max(body.moments)))
