"""Actions and tangents of motions on tori."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from .._model.scene import Scene
from .._results.quantities import TangentData
from .._utils.arguments import Array
from ..quaternion import conjugate, multiply, turn

_FEWEST_STATES, _MOST_STATES = 64, 16384  # on a loop, doubled until the action settles
_SETTLED_ACTION = 1e-13  # allowed change, relative to the mean modulus of the integrand
_ASIDE = 0.1  # value of the other angle on a loop [turns]; no motion is special there
_AXES: Final = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def compute_torus_action(states_at: Callable[[Array], Array], angle: int, is_level: bool) -> float:
    """Compute the action of the loop along which one torus angle makes a full turn.

    `angle` is the index of the torus angle that makes a full turn. `states_at` computes one state
    for each pair of torus angles [turns]. If `is_level` is True, <m, e3> is zero and the rotation
    about the vertical is arbitrary. Raises ValueError if the trapezoidal rule does not converge.
    """
    n, last = _FEWEST_STATES, np.inf
    while n <= _MOST_STATES:
        turns = np.full((n, 2), _ASIDE)
        turns[:, angle] = np.arange(n) / n
        action, size = _integrate_action_one_form(states_at(turns), is_level)
        if abs(action - last) <= _SETTLED_ACTION * size:
            return action
        n, last = 2 * n, action
    raise ValueError(
        "the actions of this motion are not known, because it is too near to a separatrix: "
        f"{_MOST_STATES} states on a loop of the torus are not enough"
    )


def _integrate_action_one_form(states: Array, is_level: bool) -> tuple[float, float]:
    """Return the action integral over a closed loop, and the mean absolute value of its integrand.

    Let e_j be the columns of R; then <m, dR R^T> is the sum of (m x e_j) de_j / 2. The derivative
    of the rotation matrix R along the loop is computed by trigonometric interpolation.
    """
    w, x, y, z = states[:, 1:5].T
    momentum = states[:, 5:8]
    columns = np.array([turn((w, x, y, z), axis) for axis in _AXES]).transpose(0, 2, 1)
    if is_level:
        columns, momentum = _resolve_in_momentum_frame(columns, momentum)
    n = len(states)
    order = np.fft.rfftfreq(n, 1.0 / n)
    order[-1] = 0.0  # the derivative of the highest cosine is zero at all states
    change = np.fft.irfft(1j * order[:, None] * np.fft.rfft(columns, axis=1), n, axis=1)
    integrand = 0.5 * (np.cross(momentum, columns) * change).sum(axis=(0, 2))
    return float(integrand.mean()), float(np.abs(integrand).mean())


def _resolve_in_momentum_frame(columns: Array, momentum: Array) -> tuple[Array, Array]:
    """Return the components of vectors along m/|m|, e3 x m/|m| and e3 for a horizontal vector m."""
    size = np.hypot(momentum[:, 0], momentum[:, 1])
    c, s = momentum[:, 0] / size, momentum[:, 1] / size
    x, y, z = columns[..., 0], columns[..., 1], columns[..., 2]
    heading_momentum = np.zeros_like(momentum)
    heading_momentum[:, 0] = size
    return np.stack([c * x + s * y, c * y - s * x, z], axis=-1), heading_momentum


ComputeStates = Callable[[Scene, Array], Array]

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


@dataclass(frozen=True)
class _ParameterPerturbation:
    """Columns of the tangent matrix that belong to the same parameter.

    size      the change of the parameter that changes the motion by about itself
    largest   the largest step
    columns   the number of components that change
    change    returns the scene in which a component is changed by a number
    subtract  returns the exact difference of the parameter between two scenes
    """

    size: float
    largest: float
    columns: int
    change: Callable[[Scene, int, float], Scene]
    subtract: Callable[[Scene, Scene], Array]


def compute_closed_form_tangents(
    scene: Scene, states: Array, names: tuple[str, ...], compute_states: ComputeStates
) -> TangentData:
    """Compute tangents with respect to parameters by finite differences of closed-form solutions.

    `compute_states` evaluates the closed-form solution for a given scene at given times. The column
    of the vertical momentum of a Goryachev-Chaplygin top is NaN, because changes of it destroy the
    closed form. Raises ValueError if a neighbouring motion has no closed-form solution, or differs
    too much from the motion of `scene`.
    """
    blocks, rest = [], 0.0
    for name in names:
        for group in _list_parameter_perturbations(scene, name):
            block, miss = _compute_tangent_matrix_columns(scene, states, group, compute_states)
            blocks.append(block)
            rest = max(rest, miss)
        if name == "start" and scene.body.kind == "goryachev_chaplygin":
            blocks.append(np.full((len(states), 6, 1), np.nan))
        if name == "mass":  # the motion depends on the product of mass and gravity
            blocks[-1] = blocks[-1] * (scene.gravity / scene.body.mass)
    high = np.concatenate(blocks, axis=2)
    return TangentData.from_flat_arrays(high, np.zeros_like(high), rest, names)


def check_tangent_times(scene: Scene, times: Array) -> None:
    """Raise ValueError if the times are too large for computing tangents by finite differences."""
    end = float(np.abs(times).max(initial=0.0))
    if scene._rotation_rate * end > _LATEST:
        raise ValueError(
            f"t must be at most {_LATEST / scene._rotation_rate:.3g} in size for the tangents of a "
            f"closed form, not {end!r}: they grow, and so do rounding errors of the start"
        )


def _list_parameter_perturbations(scene: Scene, name: str) -> list[_ParameterPerturbation]:
    """Return perturbations of one parameter, each of which yields columns of the tangent matrix."""
    body = scene.body
    if name != "start":
        arm = body.mass * math.hypot(*body.com)
        size = scene._rotation_rate**2 * max(body.moments) / arm
        # All neighbours have gravity of the same sign, because a free body is of another kind.
        largest = 0.125 * abs(scene.gravity)
        return [
            _ParameterPerturbation(
                size,
                largest,
                1,
                lambda scene, _, size: scene.replace(gravity=scene.gravity + size),
                lambda one, other: np.array([other.gravity - one.gravity]),
            )
        ]
    columns = 2 if body.kind == "goryachev_chaplygin" else 3
    size = scene._rotation_rate * max(body.moments)
    return [
        _ParameterPerturbation(
            1.0,
            math.inf,
            3,
            _change_attitude,
            lambda one, other: _compute_rotation_between(
                np.array([one.attitude]), np.array([other.attitude])
            )[0],
        ),
        _ParameterPerturbation(
            size,
            math.inf,
            columns,
            _change_momentum,
            lambda one, other: np.subtract(other.momentum, one.momentum),
        ),
    ]


def _change_attitude(scene: Scene, axis: int, angle: float) -> Scene:
    turn = [math.cos(0.5 * angle), 0.0, 0.0, 0.0]
    turn[1 + axis] = math.sin(0.5 * angle)
    w, x, y, z = turn
    return scene.replace(attitude=multiply(scene.attitude, (w, x, y, z)))


def _change_momentum(scene: Scene, axis: int, size: float) -> Scene:
    momentum = list(scene.momentum)
    momentum[axis] += size
    return scene.replace(momentum=momentum)


def _compute_rotation_between(one: Array, other: Array) -> Array:
    """Return the small rotations, in the body frame, between corresponding attitudes in two arrays.

    The result is twice the vector part of the quotient of the two quaternions. For small rotations,
    the result is approximately the rotation vector. The difference of the quaternions is used
    because it is exact for nearby quaternions.
    """
    sign = np.where((one * other).sum(axis=1) < 0.0, -1.0, 1.0)
    change = sign[:, None] * other - one
    w, x, y, z = conjugate(tuple(one.T))
    return 2.0 * np.array(multiply((w, x, y, z), tuple(change.T)))[1:].T


def _compute_tangent_matrix_columns(
    scene: Scene, states: Array, group: _ParameterPerturbation, compute_states: ComputeStates
) -> tuple[Array, float]:
    """Return one group of columns of the tangent matrix, and their largest relative error."""
    angles = np.maximum(1.0, scene._rotation_rate * np.abs(states[:, 0]))
    ranges = np.ceil(np.log(angles) / math.log(_RANGE))
    result, rest = np.empty((len(states), 6, group.columns)), np.zeros(len(states))
    for number in np.unique(ranges):
        step = _STEP * _RANGE**-number
        rows = np.flatnonzero(ranges == number)
        for block in np.split(rows, range(_BLOCK, len(rows), _BLOCK)):
            result[block], rest[block] = _differentiate_with_best_steps(
                scene, states[block], group, step, compute_states
            )
    return result, float(rest.max(initial=0.0)) + _ROUNDING


def _differentiate_with_best_steps(
    scene: Scene,
    states: Array,
    group: _ParameterPerturbation,
    step: float,
    compute_states: ComputeStates,
) -> tuple[Array, Array]:
    """Compute tangents with several difference steps, and return the most accurate ones.

    The difference step is reduced as long as the estimated error decreases.
    """
    result, rest = np.full((len(states), 6, group.columns), np.nan), np.full(len(states), np.inf)
    rows = np.arange(len(states))
    refusal: ValueError | None = None
    for number in range(_STEPS):
        try:
            one, miss = _compute_central_differences(
                scene, states[rows], group, step * _SHRINK**number, compute_states
            )
        except ValueError as error:
            refusal = error
            continue
        is_better = miss < rest[rows]
        rows, one, miss = rows[is_better], one[is_better], miss[is_better]
        result[rows], rest[rows] = one, miss
        rows = rows[miss > _SETTLED_ROW]
        if not len(rows):
            break
    if not (rest <= _LARGEST).all():
        reason = str(refusal or "they do not change smoothly from one to the next")
        raise ValueError(
            "the tangents are differences of the closed forms of neighbouring tops, which fail "
            f"here: use kr.solve(scene, t, tangents=...). The reason is: {reason}"
        )
    return result, rest


def _compute_central_differences(
    scene: Scene,
    states: Array,
    group: _ParameterPerturbation,
    step: float,
    compute_states: ComputeStates,
) -> tuple[Array, Array]:
    """Return eighth-order central differences, and their relative deviation from sixth-order ones.

    The deviation is divided by the dimensionless norm of the tangent, or by 1 if the norm is
    smaller.
    """
    h = 2.0 ** math.floor(math.log2(min(step * group.size, group.largest)))
    times = np.ascontiguousarray(states[:, 0])  # the only layout that the core accepts
    quotients = []
    for k in range(1, 5):
        changes = np.empty((len(states), 6, group.columns))
        distances = np.empty((group.columns, group.columns))
        for j in range(group.columns):
            lower, upper = (group.change(scene, j, sign * k * h) for sign in (-1.0, 1.0))
            distances[:, j] = group.subtract(lower, upper)[: group.columns]
            ends = compute_states(lower, times), compute_states(upper, times)
            turn = [_compute_rotation_between(states[:, 1:5], end[:, 1:5]) for end in ends]
            changes[:, :3, j] = turn[1] - turn[0]
            changes[:, 3:, j] = ends[1][:, 5:8] - ends[0][:, 5:8]
        quotients.append(changes @ np.linalg.inv(distances))
    best, other = (
        sum((w * quotient for w, quotient in zip(weights, quotients, strict=True)), np.zeros(1))
        for weights in (_ORDER_8, _ORDER_6)
    )
    units = (
        np.repeat((1.0, scene._rotation_rate * max(scene.body.moments)), 3)[:, None] / group.size
    )
    sizes = np.maximum(np.linalg.norm(best / units, axis=1), 1.0)
    return best, (np.linalg.norm((best - other) / units, axis=1) / sizes).max(axis=1)
