"""Reference: a second run that is better than the first, and how far roundings move either.

The Taylor series with 20 digits errs by far less than any run in doubles, however much the motion
magnifies roundings. A closed form is cheaper on fast tops, but it is one of a body of its kind, in
doubles: it counts where the body is of this kind to the bit, and where what it says is far above
its roundings.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from .._core import KIND_RTOL, Work, start
from .._core import tangents as TANGENTS
from .._ground.arguments import Array, Quaternion
from .._ground.names import MethodName
from .._model.scene import Scene
from .._request.methods import ELSE, EXACT, is_kowalewski, methods
from .._request.request import Progress, Request
from ..quaternion import conjugate, multiply, turn
from .rows import Rows

CLOSED_FORM = Request(methods[EXACT], asked=EXACT)
SERIES = Request(methods[ELSE], asked=ELSE)
LONGER_SERIES = Request(methods[ELSE], digits=20, asked=ELSE)
LONGEST_SERIES = Request(methods[ELSE], digits=30, asked=ELSE)
# Shorter steps of 30 digits make other roundings.
SHORTER_STEPS = [
    Request(methods[ELSE], tol=2.0**-n, digits=30, asked=ELSE) for n in (108, 109, 110)
]

ROUNDING = 2.0**-53
_LOOKS = 1024  # at the tangents of a path, at most
ROUNDINGS = 128  # of the start come to more than those of a closed form by far


def closed_form_holds(scene: Scene) -> bool:
    """Whether the scene has a closed form, and nothing of its body was rounded for it to have
    one."""
    if not CLOSED_FORM.method.suits(scene) or is_kowalewski(scene):
        return False
    near = 2.0 * KIND_RTOL
    pairs = combinations(scene.body.moments, 2)
    if any(a != b and abs(a - b) <= near * max(a, b) for a, b in pairs):
        return False
    com = scene.body.principal_com
    reach = max(map(abs, com))
    return not scene.gravity or not any(0.0 < abs(c) <= near * reach for c in com)


def told_error(
    scene: Scene,
    method: MethodName,
    digits: int | None,
    apart: Callable[[Request], float],
    grown: Callable[[], float],
) -> float:
    """The attitude error of a path of this method and these digits, by how far second runs are
    apart from it, and how far a rounding of the start has grown."""
    if not digits and method != EXACT and closed_form_holds(scene):
        error = apart(CLOSED_FORM)
        if error >= ROUNDINGS * ROUNDING * grown():
            return error
    if digits == 30:
        errors = sorted(apart(other) for other in SHORTER_STEPS)
        return max(errors[len(errors) // 2], ROUNDING**2 * grown())
    error = 0.0 if digits else apart(LONGER_SERIES)
    # A closed form makes its roundings once: the series may magnify its own to more than these.
    is_unsure = method == EXACT and error > ROUNDINGS * ROUNDING
    return apart(LONGEST_SERIES) if digits or is_unsure else error


def rounded(scene: Scene, digits: int = 16) -> Array:
    """How a rounding of the state may move attitude and momentum, over the rounding, as columns.
    Doubles hold either in the top's own units. A series of more digits keeps the momentum as the
    body sees it: the attitude takes it along, and each number is rounded by its own size."""
    if digits <= 16:
        return np.diag([1.0] * 3 + [max(scene.body.moments) * scene._fastest] * 3)
    to_space, principal = _matrix(scene.attitude), _matrix(scene.body.axes)
    seen = to_space.T @ np.array(scene.momentum)
    turns = _rounded_turns(scene)
    taken = to_space @ np.cross(turns.T, seen).T
    own = to_space @ (principal * (principal.T @ seen))
    return np.block([[turns, np.zeros((3, 3))], [taken, own]])


def _rounded_turns(scene: Scene) -> Array:
    """How a rounding of each number of the principal axes' attitude turns the body, seen from it.
    The number is a sum of products, each rounded by its own size."""
    axes = scene.body.axes
    each: Any = np.diag(scene.attitude)
    sizes: Any = np.diag(np.linalg.norm(multiply(each, axes), axis=1))
    moved = multiply(sizes, conjugate(axes))
    return 2.0 * np.array(multiply(conjugate(scene.attitude), moved))[1:]


def _matrix(q: Quaternion) -> Array:
    axes = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    return np.array([turn(q, axis) for axis in axes]).T


def grown_roundings(
    scene: Scene,
    times: Array,
    digits: int = 16,
    max_steps: int = 0,
    progress: Progress | Work | None = None,
) -> tuple[Rows, float]:
    """How far one rounding of the start moves the attitude on the way at most [rad], over the
    rounding, by tangents of the series, whatever method moves the top; of more digits, how far
    those of all its numbers do, as they add up by chance. Infinite where a tangent outgrows
    doubles. Before it the states that were looked at, of which some are missing where that
    run fails."""
    directions, most = rounded(scene, digits), 1.0
    came: Rows = "OK", np.empty((0, 8)), None, (0, 0, 0, 0), 0.0
    series = replace(SERIES, max_steps=max_steps)
    for side in (times[times < 0.0], times[times > 0.0]):
        if not side.size:
            continue
        _, top = start(scene._block, *series.core, bool(side[0] < 0.0), [], TANGENTS["start"][0])
        assert top is not None
        each = -(-side.size // _LOOKS)
        on_the_way = side[np.argsort(np.abs(side))][::-each][::-1]  # the end is looked at, too
        came, high, *_ = top.record_tangents(on_the_way, False, progress)
        if came[0] == "ERR_TANGENT":
            return ("OK", *came[1:]), math.inf
        if came[0] != "OK":
            states = came[1] if len(came[1]) else scene._start.copy()
            return (came[0], states, *came[2:]), most
        turns = np.linalg.norm(high.reshape(-1, 6, 6)[:, :3] @ directions, axis=1)
        grown = turns.max(axis=1) if digits <= 16 else np.linalg.norm(turns, axis=1)
        most = max(most, float(grown.max()))
    return came, most


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
