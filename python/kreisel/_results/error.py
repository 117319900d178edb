"""Calls of the core with failures as exceptions, and estimates of the error of a path."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from .._core import KIND_RTOL, Work, record, start
from .._core import tangents as TANGENTS
from .._model.parameters import refuse_disturbances
from .._model.scene import Scene
from .._options.methods import EXACT, FALLBACK, has_torus_closed_form
from .._options.options import Options
from .._utils.arguments import Array, as_finite_array, as_float, freeze_array
from .._utils.processes import Progress
from ..quaternion import conjugate, multiply, turn

# The name of the status; the states reached (n, 8), as t, q, m; the low words of these states or
# None; the numbers of steps, rejected steps, evaluations and iterations; the last requested time.
CoreResult = tuple[str, Array, Array | None, tuple[int, int, int, int], float]


NO_STATES = np.empty((0, 8))
STATE_COLUMNS = {"t": slice(0, 1), "q": slice(1, 5), "m": slice(5, 8)}


class Stats(NamedTuple):
    """The numbers of steps, rejected steps, torque evaluations and solver iterations in a run."""

    steps: int
    rejected: int
    evaluations: int
    iterations: int


class TangentData(NamedTuple):
    """(n, 6, columns) tangents, their low words and their truncation error.

    The truncation error is the largest magnitude among the last retained terms of the Taylor
    series. `by` lists the parameters with respect to which the derivatives are taken, in the order
    of the C library.
    """

    high: Array
    low: Array
    truncation: float | Any  # an array (*shape) for many tops
    by: tuple[str, ...]

    @classmethod
    def from_flat_arrays(
        cls, high: Array, low: Array, truncation: float, names: tuple[str, ...]
    ) -> TangentData:
        shape = len(high), 6, sum(TANGENTS[name][1] for name in names)
        high, low = freeze_array(high.reshape(shape)), freeze_array(low.reshape(shape))
        return cls(high, low, truncation, names)


class RunStart(NamedTuple):
    """The time [T] of a run's initial state, and the low-order words of that state, if any.

    The time is nonzero only after a `push`, a `reset` or a change of the scene.
    """

    begin: float = 0.0
    low: Array | None = None

    def to_json(self) -> list[object] | None:
        if not self.begin and self.low is None:
            return None
        return [self.begin, None if self.low is None else self.low.tolist()]

    @classmethod
    def from_json(cls, value: object) -> RunStart:
        if value is None:
            return ORIGIN
        if not isinstance(value, list) or len(value) != 2:
            raise TypeError("the start must be a time and low words")
        low = None if value[1] is None else as_finite_array("low", value[1], "8 numbers")
        if low is not None and low.shape != (8,):
            raise ValueError(f"the low words of the start must be 8 numbers, not {low.size}")
        return cls(as_float("the time of the start", value[0]), low)


ORIGIN = RunStart()


def compute_states_at_times(
    scene: Scene,
    options: Options,
    times: Array,
    progress: Progress | Work | None = None,
    origin: RunStart = ORIGIN,
) -> CoreResult:
    begin, low = origin
    return record(
        scene._block, *options.core_arguments, times, progress=progress, begin=begin, low=low
    )


def compute_states_at_unordered_times(
    scene: Scene, options: Options, times: Array, origin: RunStart = ORIGIN
) -> CoreResult:
    """Compute the states at times of any sign and order, up to the first failure of a run."""
    states = np.empty((times.size, 8))
    low = np.empty((times.size, 8)) if options.has_extended_precision else None
    counts, end = np.zeros(4, dtype=np.int64), 0.0
    for side in (times < 0.0, times >= 0.0):
        indices = np.flatnonzero(side)
        indices = indices[np.argsort(np.abs(times[indices]), kind="stable")]
        if not indices.size:
            continue
        result = compute_states_at_times(scene, options, times[indices], None, origin)
        if result[0] != "OK":
            return result
        states[indices], end, counts = result[1], result[-1], counts + result[3]
        if low is not None:
            low[indices] = result[2]
    steps, rejected, evaluations, iterations = counts.tolist()
    return "OK", states, low, (steps, rejected, evaluations, iterations), end


CLOSED_FORM = Options(EXACT, requested_method=EXACT)
SERIES = Options(FALLBACK, requested_method=FALLBACK)
LONGER_SERIES = Options(FALLBACK, digits=20, requested_method=FALLBACK)
LONGEST_SERIES = Options(FALLBACK, digits=30, requested_method=FALLBACK)
# Runs with 30 digits and shorter steps, whose rounding errors differ from those of LONGEST_SERIES.
SHORTER_STEPS = [
    Options(FALLBACK, tol=2.0**-n, digits=30, requested_method=FALLBACK) for n in (108, 109, 110)
]

# No error of 200 runs with 30 digits is beyond this multiple of the largest difference.
FACTOR_30 = 3.0

ROUNDING = 2.0**-53
_MAX_POINTS = 1024  # maximal number of times of a path at which tangents are computed
# The error of a closed form is far below this multiple of the error caused by rounding the start.
ROUNDINGS = 128


def has_cheap_exact_form(scene: Scene) -> bool:
    """Return True if the scene has a cheap closed form that is exact for its body.

    A closed form is inexact if it treats nearly equal moments of inertia as equal, or if it moves
    the centre of mass or the rotor to a nearby principal axis. Closed forms of Kowalewski and
    Goryachev-Chaplygin tops are not cheap, because they take long to set up.
    """
    if not CLOSED_FORM.integrator.suits(scene) or has_torus_closed_form(scene):
        return False
    tolerance = 2.0 * KIND_RTOL
    pairs = combinations(scene.body.moments, 2)
    if any(a != b and abs(a - b) <= tolerance * max(a, b) for a, b in pairs):
        return False
    com, rotor = scene.body.principal_com, scene.body.principal_rotor
    reach, most = max(map(abs, com)), max(map(abs, rotor))
    if any(0.0 < abs(h) <= tolerance * most for h in rotor):
        return False
    return not scene.gravity or not any(0.0 < abs(c) <= tolerance * reach for c in com)


def compute_state_changes_by_rounding(scene: Scene, digits: int = 16) -> Array:
    """Return a matrix whose columns are changes of the state per unit of relative rounding error.

    Up to 16 digits, the rounding error of the momentum is proportional to the largest moment and
    the estimated rate. Beyond, the C library stores the momentum in the body frame, so that
    rounding the attitude also rotates the momentum in space.
    """
    if digits <= 16:
        return np.diag([1.0] * 3 + [max(scene.body.moments) * scene._rotation_rate] * 3)
    basis: Any = tuple(np.eye(3))
    rotation, principal = (np.array(turn(q, basis)) for q in (scene.attitude, scene.body.axes))
    # Each component of the stored quaternion of the principal axes is a sum of rounded products.
    each: Any = np.diag(scene.attitude)
    sizes: Any = np.diag(np.linalg.norm(multiply(each, scene.body.axes), axis=1))
    products = multiply(sizes, conjugate(scene.body.axes))
    turns = 2.0 * np.array(multiply(conjugate(scene.attitude), products))[1:]
    body_momentum = rotation.T @ np.array(scene.momentum)
    momentum_changes = rotation @ np.cross(turns.T, body_momentum).T
    momentum_roundings = rotation @ (principal * (principal.T @ body_momentum))
    return np.block([[turns, np.zeros((3, 3))], [momentum_changes, momentum_roundings]])


def estimate_rounding_growth(
    scene: Scene,
    times: Array,
    digits: int = 16,
    max_steps: int = 0,
    progress: Progress | Work | None = None,
    origin: RunStart = ORIGIN,
) -> tuple[CoreResult, float]:
    """Return a run of the Taylor series, and how much it amplifies rounding errors of the start.

    The amplification is the change of attitude [rad] per relative rounding error: up to 16 digits
    of the worst single error, beyond of all errors as if they were independent. It is infinite if a
    tangent overflows. If the run fails, the states after the failure are missing.
    """
    directions, most = compute_state_changes_by_rounding(scene, digits), 1.0
    result: CoreResult = "OK", np.empty((0, 8)), None, (0, 0, 0, 0), 0.0
    series = replace(SERIES, max_steps=max_steps)
    for side in (times[times < 0.0], times[times > 0.0]):
        if not side.size:
            continue
        is_back, columns = bool(side[0] < 0.0), TANGENTS["start"][0]
        _, top = start(
            scene._block, *series.core_arguments, is_back, [], columns, begin=origin.begin
        )
        if top is None:
            refuse_disturbances(scene, "the growth of rounding errors is not known for tops")
        assert top is not None
        each = -(-side.size // _MAX_POINTS)
        # Every `each`-th time, counted back from the last time, which is thus included.
        check_times = side[np.argsort(np.abs(side))][::-each][::-1]
        result, high, *_ = top.record_tangents(check_times, False, progress)
        if result[0] == "ERR_TANGENT":
            return ("OK", *result[1:]), math.inf
        if result[0] != "OK":
            states = result[1] if len(result[1]) else scene._start_state.copy()
            return (result[0], states, *result[2:]), most
        turns = np.linalg.norm(high.reshape(-1, 6, 6)[:, :3] @ directions, axis=1)
        growths = turns.max(axis=1) if digits <= 16 else np.linalg.norm(turns, axis=1)
        most = max(most, float(growths.max()))
    return result, most


def compute_angles_between_attitudes(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Return the angles [rad] between attitudes, given as pairs of arrays (q, low words of q).

    The quaternions are subtracted before they are multiplied, so that small angles keep their
    relative accuracy.
    """
    (p, p_low), (q, q_low) = one, other
    dot = (p * q).sum(axis=1)
    sign = np.where(dot < 0.0, -1.0, 1.0)[:, None]
    d = (sign * q - p) + (sign * q_low - p_low)
    # The vector part of conjugate(p) * (q - p), in terms of d = q - p.
    vec = p[:, :1] * d[:, 1:] - d[:, :1] * p[:, 1:] - np.cross(p[:, 1:], d[:, 1:])
    angles: Array = 2.0 * np.arctan2(np.sqrt((vec**2).sum(axis=1)), np.abs(dot))
    return angles
