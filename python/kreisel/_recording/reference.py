"""Reference: a second run that is better than the first, and how far roundings move either.

The Taylor series with 20 digits errs by far less than any run in doubles, however much the motion
magnifies roundings. A closed form is cheaper on fast tops, but it is one of a body of its kind, in
doubles: it counts where the body is of this kind to the bit, and where what it says is far above
its roundings.
"""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from .._core import KIND_RTOL, start
from .._core import tangents as TANGENTS
from .._ground.arguments import Array
from .._model.scene import Scene
from .._request.methods import ELSE, EXACT, methods
from .._request.request import Request
from ..quaternion import attitude_error, multiply
from .rows import rows_in_any_order

CLOSED_FORM = Request(methods[EXACT], asked=EXACT)
SERIES = Request(methods[ELSE], asked=ELSE)
LONGER_SERIES = Request(methods[ELSE], digits=20, asked=ELSE)
LONGEST_SERIES = Request(methods[ELSE], digits=30, asked=ELSE)
SHORTER_STEPS = Request(methods[ELSE], tol=2.0**-108, digits=30, asked=ELSE)  # other roundings

ROUNDING = 2.0**-53
NUDGE = 2.0**-36  # by which the start is moved to see how far the attitude moves
_TURN = 0.48, -0.6, 0.64  # unit vectors along no axis of anything, about and along which it is
_PUSH = -0.64, 0.48, 0.6
ROUNDINGS = 128  # of the start come to more than those of a closed form by far


def closed_form_holds(scene: Scene) -> bool:
    """Whether the scene has a closed form, and nothing of its body was rounded for it to have
    one."""
    if not CLOSED_FORM.method.suits(scene):
        return False
    near = 2.0 * KIND_RTOL
    pairs = combinations(scene.body.moments, 2)
    if any(a != b and abs(a - b) <= near * max(a, b) for a, b in pairs):
        return False
    com = scene.body.principal_com
    reach = max(map(abs, com))
    return not scene.gravity or not any(0.0 < abs(c) <= near * reach for c in com)


def nudged(scene: Scene) -> Scene:
    """A neighbour of the scene: turned and pushed by a little, in the top's own units."""
    x, y, z = (0.5 * NUDGE * along for along in _TURN)
    turned = multiply((1.0, x, y, z), scene.attitude)
    norm = math.hypot(*turned)
    unit = NUDGE * max(scene.body.moments) * scene._fastest
    push = zip(scene.momentum, _PUSH, strict=True)
    return scene.replace(
        attitude=tuple(c / norm for c in turned),
        momentum=tuple(m + unit * along for m, along in push),
    )


def conditioning(scene: Scene, request: Request, times: Array, q: Array) -> float:
    """About how far one rounding of the state moves the attitude on the way [rad], of a motion
    whose attitudes at these times are q; by a neighbour's motion, which is of the request."""
    status, states, *_ = rows_in_any_order(nudged(scene), request, times)
    reached = attitude_error(states[: len(q), 1:5], q[: len(states)]).max(initial=0.0)
    return float(reached) * ROUNDING / NUDGE if status == "OK" else math.inf


def roundings(scene: Scene, request: Request, times: Array) -> float:
    """How far one rounding of the state moves the attitude on the way [rad], by two runs of a
    request."""
    return conditioning(scene, request, times, rows_in_any_order(scene, request, times)[1][:, 1:5])


def grown_roundings(scene: Scene, times: Array) -> float:
    """How far one rounding of the state moves the attitude on the way [rad] over the rounding, by
    tangents: of the start's directions, each in the top's own units, that which moves it most."""
    unit = max(scene.body.moments) * scene._fastest
    most = 1.0
    for side in (times[times < 0.0], times[times > 0.0]):
        if not side.size:
            continue
        _, top = start(scene._block, *SERIES.core, bool(side[0] < 0.0), [], TANGENTS["start"][0])
        assert top is not None
        came, high, *_ = top.record_tangents(side[np.argsort(np.abs(side))], False)
        if came[0] != "OK":
            return math.inf
        turns = high.reshape(-1, 6, 6)[:, :3] * ([1.0] * 3 + [unit] * 3)
        most = max(most, float(np.linalg.norm(turns, axis=1).max()))
    return most


def apart(one: tuple[Array, Array], other: tuple[Array, Array]) -> float:
    """The largest angle between attitudes, each with what its doubles leave out: their difference
    loses no digit."""
    (p, p_low), (q, q_low) = one, other
    dot = (p * q).sum(axis=1)
    sign = np.where(dot < 0.0, -1.0, 1.0)[:, None]
    d = (sign * q - p) + (sign * q_low - p_low)
    # the vector of p* (q - p)
    vec = p[:, :1] * d[:, 1:] - d[:, :1] * p[:, 1:] - np.cross(p[:, 1:], d[:, 1:])
    return float(2.0 * np.arctan2(np.sqrt((vec**2).sum(axis=1)), np.abs(dot)).max())
