"""Closed forms of one top, and actions and tangents of motions on tori."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from .._core import ExactPlan, exact_states, plan_exact, statuses
from .._model.scene import Scene
from .._options.methods import EXACT, explain_no_closed_form, methods
from .._results.calls import TangentData
from .._utils.arguments import Array
from ..quaternion import conjugate, multiply, turn

_FEWEST_STATES, _MOST_STATES = 64, 16384  # on a loop, doubled until the action settles
_SETTLED_ACTION = 1e-13  # allowed change, relative to the mean modulus of the integrand
_ASIDE = 0.1  # value of the other angle on a loop [turns]; no motion is special there
_AXES: Final = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def plan_closed_form(scene: Scene) -> tuple[bool, ExactPlan]:
    """Return whether the motion of a top is on a torus, and its closed form.

    Raises ValueError if there is none.
    """
    status, _, is_on_torus, plan = plan_exact(scene._block, 0.0)
    if plan is None:
        raise make_no_closed_form_error(status, scene)
    return is_on_torus, plan


def make_no_closed_form_error(status: str, scene: Scene, prefix: str = "") -> ValueError:
    """Return the exception for a scene without a closed form."""
    if status != "ERR_METHOD":
        return ValueError(f"{prefix}{statuses[status][1]}: {scene!r}")
    form, reason = methods[EXACT], explain_no_closed_form(scene)
    if form.applies_to(scene.body) or any(scene.body.rotor):
        return ValueError(f"{prefix}{reason}: {scene!r}")
    return ValueError(f"{prefix}{reason}: closed forms are known for {form.tops}")


def compute_torus_action(states_at: Callable[[Array], Array], angle: int, is_level: bool) -> float:
    """Compute the action of the loop along which the torus angle with this index makes a full turn.

    `states_at` computes one state for each pair of torus angles [turns]. If `is_level` is True,
    <m, e3> is zero and the rotation about the vertical is arbitrary. Raises ValueError if the
    trapezoidal rule does not converge.

    Let e_j be the columns of the rotation matrix R; then <m, dR R^T> is the sum of (m x e_j) de_j
    / 2. The derivative of R along the loop is computed by trigonometric interpolation.
    """
    n, last = _FEWEST_STATES, np.inf
    while n <= _MOST_STATES:
        turns = np.full((n, 2), _ASIDE)
        turns[:, angle] = np.arange(n) / n
        states = states_at(turns)
        w, x, y, z = states[:, 1:5].T
        momentum = states[:, 5:8]
        columns = np.array([turn((w, x, y, z), axis) for axis in _AXES]).transpose(0, 2, 1)
        if is_level:  # use components along m/|m|, e3 x m/|m| and e3
            size = np.hypot(momentum[:, 0], momentum[:, 1])
            c, s = momentum[:, 0] / size, momentum[:, 1] / size
            x, y, z = columns[..., 0], columns[..., 1], columns[..., 2]
            columns = np.stack([c * x + s * y, c * y - s * x, z], axis=-1)
            momentum = np.zeros_like(momentum)
            momentum[:, 0] = size
        order = np.fft.rfftfreq(n, 1.0 / n)
        order[-1] = 0.0  # the derivative of the highest cosine is zero at all states
        change = np.fft.irfft(1j * order[:, None] * np.fft.rfft(columns, axis=1), n, axis=1)
        integrand = 0.5 * (np.cross(momentum, columns) * change).sum(axis=(0, 2))
        action = float(integrand.mean())
        if abs(action - last) <= _SETTLED_ACTION * float(np.abs(integrand).mean()):
            return action
        n, last = 2 * n, action
    raise ValueError(
        "the actions of this motion are not known, because it is too near to a separatrix: "
        f"{_MOST_STATES} states on a loop of the torus are not enough"
    )


# Weights of the quotients (f(k h) - f(-k h)) / (2 k h), k = 1 .. 4, of order 8 and of order 6.
_ORDER_8: Final = np.array((8.0 / 5.0, -4.0 / 5.0, 8.0 / 35.0, -1.0 / 35.0))
_ORDER_6: Final = np.array((3.0 / 2.0, -3.0 / 5.0, 1.0 / 10.0, 0.0))
_STEP: Final = 2.0**-3.5  # the step at early times, relative to the size of the start
_RANGE: Final = 8.0  # times of one step differ at most by this factor, unless they are early
_SHRINK: Final = 0.25  # factor between two steps, if the larger one is not small enough
_STEPS: Final = 4  # number of steps that are tried
_SETTLED_ROW: Final = 1e-11  # relative difference of the two orders below which no step is refined
_LARGEST: Final = 1e-4  # relative difference of the two orders above which nothing is returned
# The largest effect of the rounding errors of states, relative to the tangents. It is the same at
# all times, because the steps are inversely proportional to time.
_ROUNDING: Final = 5e-11
_LATEST: Final = 1e9  # latest time, as the angle by which the top turns
_BLOCK: Final = 1 << 14  # number of times that are computed together, which bounds the memory


def check_tangent_times(scene: Scene, times: Array) -> None:
    """Raise ValueError if the times are too large for computing tangents by finite differences."""
    end = float(np.abs(times).max(initial=0.0))
    if scene._rotation_rate * end > _LATEST:
        raise ValueError(
            f"t must be at most {_LATEST / scene._rotation_rate:.3g} in size for the tangents of a "
            f"closed form, not {end!r}: they grow, and so do rounding errors of the start"
        )


def compute_closed_form_tangents(
    scene: Scene, states: Array, names: tuple[str, ...]
) -> TangentData:
    """Compute tangents with respect to parameters by finite differences of closed-form solutions.

    The column of the vertical momentum of a Goryachev-Chaplygin top is NaN, because changes of it
    destroy the closed form. Raises ValueError if a neighbouring motion has no closed-form solution,
    or differs too much from the motion of `scene`.
    """
    angles = np.maximum(1.0, scene._rotation_rate * np.abs(states[:, 0]))
    ranges = np.ceil(np.log(angles) / math.log(_RANGE))
    blocks, rest = [], 0.0
    for name in names:
        for part in ("attitude", "momentum") if name == "start" else ("gravity",):
            group = _ChangedParameter(scene, part)
            block, miss = np.empty((len(states), 6, group.columns)), np.zeros(len(states))
            for number in np.unique(ranges):
                rows = np.flatnonzero(ranges == number)
                for some in np.split(rows, range(_BLOCK, len(rows), _BLOCK)):
                    step = _STEP * _RANGE**-number
                    block[some], miss[some] = group.differentiate(states[some], step)
            blocks.append(block)
            rest = max(rest, float(miss.max(initial=0.0)) + _ROUNDING)
        if name == "start" and scene.body.kind == "goryachev_chaplygin":
            blocks.append(np.full((len(states), 6, 1), np.nan))
        if name == "mass":  # the motion depends on the product of mass and gravity
            blocks[-1] = blocks[-1] * (scene.gravity / scene.body.mass)
    high = np.concatenate(blocks, axis=2)
    return TangentData.from_flat_arrays(high, np.zeros_like(high), rest, names)


def _compute_rotation_between(one: Array, other: Array) -> Array:
    """Return the small rotations, in the body frame, between corresponding attitudes."""
    # Twice the vector part of the quotient; the difference of nearby quaternions is exact.
    sign = np.where((one * other).sum(axis=1) < 0.0, -1.0, 1.0)
    change = sign[:, None] * other - one
    w, x, y, z = conjugate(tuple(one.T))
    return 2.0 * np.array(multiply((w, x, y, z), tuple(change.T)))[1:].T


class _ChangedParameter:
    """Columns of the matrix of tangents that belong to a parameter of the scene.

    size     the change of the parameter that changes the motion by about itself
    largest  the largest step
    columns  the number of components that change
    """

    def __init__(self, scene: Scene, name: str) -> None:
        self.scene, self.name, body = scene, name, scene.body
        self.momentum = scene._rotation_rate * max(body.moments)
        self.size, self.largest, self.columns = 1.0, math.inf, 3
        if name == "momentum":
            self.size = self.momentum
            self.columns = 2 if body.kind == "goryachev_chaplygin" else 3
        elif name == "gravity":
            arm = body.mass * math.hypot(*body.com)
            self.size, self.columns = scene._rotation_rate**2 * max(body.moments) / arm, 1
            # All neighbours have gravity of the same sign, because a free body is of another kind.
            self.largest = 0.125 * abs(scene.gravity)

    def _change(self, i: int, size: float) -> Scene:
        """Return the scene in which the i-th component of the parameter is changed."""
        scene = self.scene
        if self.name == "gravity":
            return scene.replace(gravity=scene.gravity + size)
        if self.name == "momentum":
            momentum = list(scene.momentum)
            momentum[i] += size
            return scene.replace(momentum=momentum)
        x, y, z = (math.sin(0.5 * size) if j == i else 0.0 for j in range(3))
        return scene.replace(attitude=multiply(scene.attitude, (math.cos(0.5 * size), x, y, z)))

    def _subtract(self, one: Scene, other: Scene) -> Array:
        """Return the exact difference of the parameter between two scenes."""
        lower: Array = np.array(getattr(one, self.name), ndmin=1)
        upper: Array = np.array(getattr(other, self.name), ndmin=1)
        if self.name == "attitude":
            return np.ravel(_compute_rotation_between(lower[None], upper[None]))
        return np.subtract(upper, lower)

    def differentiate(self, states: Array, step: float) -> tuple[Array, Array]:
        """Return the tangents and their errors, with steps that shrink while the errors do."""
        result = np.full((len(states), 6, self.columns), np.nan)
        rest, rows = np.full(len(states), np.inf), np.arange(len(states))
        reason = "they do not change smoothly from one to the next"
        for number in range(_STEPS):
            try:
                one, miss = self._compute_differences(states[rows], step * _SHRINK**number)
            except ValueError as error:
                reason = str(error)
                continue
            is_better = miss < rest[rows]
            rows, one, miss = rows[is_better], one[is_better], miss[is_better]
            result[rows], rest[rows] = one, miss
            rows = rows[miss > _SETTLED_ROW]
            if not len(rows):
                break
        if not (rest <= _LARGEST).all():
            raise ValueError(
                "the tangents are differences of the closed forms of neighbouring tops, which fail "
                f"here: use kr.solve(scene, t, tangents=...). The reason is: {reason}"
            )
        return result, rest

    def _compute_differences(self, states: Array, step: float) -> tuple[Array, Array]:
        """Return central differences of order 8, and their deviation from those of order 6.

        The deviation is relative to the dimensionless norm of the tangent, or to 1 if it is larger.
        """
        h = 2.0 ** math.floor(math.log2(min(step * self.size, self.largest)))
        times = np.ascontiguousarray(states[:, 0])  # the only layout that the core accepts
        quotients = []
        for k in range(1, 5):
            changes = np.empty((len(states), 6, self.columns))
            distances = np.empty((self.columns, self.columns))
            for j in range(self.columns):
                scenes = [self._change(j, sign * k * h) for sign in (-1.0, 1.0)]
                distances[:, j] = self._subtract(*scenes)[: self.columns]
                ends: Any = [
                    exact_states(plan_closed_form(one)[1], times, math.inf) for one in scenes
                ]
                turns = [_compute_rotation_between(states[:, 1:5], end[:, 1:5]) for end in ends]
                changes[:, :3, j] = turns[1] - turns[0]
                changes[:, 3:, j] = ends[1][:, 5:8] - ends[0][:, 5:8]
            quotients.append(changes @ np.linalg.inv(distances))
        best, other = (
            sum((w * quotient for w, quotient in zip(weights, quotients, strict=True)), np.zeros(1))
            for weights in (_ORDER_8, _ORDER_6)
        )
        units = np.repeat((1.0, self.momentum), 3)[:, None] / self.size
        sizes = np.maximum(np.linalg.norm(best / units, axis=1), 1.0)
        return best, (np.linalg.norm((best - other) / units, axis=1) / sizes).max(axis=1)
