"""Estimates of the attitude error of a path.

A Taylor series in 20-digit arithmetic is far more accurate than any run in double precision, even
if the motion strongly amplifies rounding errors. For rapidly rotating tops, a closed form is a
cheaper reference solution than a Taylor series. However, closed forms are evaluated in double
precision, and they treat a nearly integrable body as exactly integrable. A closed form is used as
reference only if the body is exactly integrable and the estimated error far exceeds the rounding
errors of the closed form.
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
from .._model.environment import refuse_disturbances
from .._model.scene import Scene
from .._options.methods import EXACT, FALLBACK, has_torus_closed_form, methods
from .._options.solve_options import Progress, SolveOptions
from .._utils.quantity_attributes import MethodName
from .._utils.validation import Array, Quaternion
from ..quaternion import conjugate, multiply, turn
from .core_calls import ORIGIN, CoreResult, RunStart

CLOSED_FORM = SolveOptions(methods[EXACT], requested_method=EXACT)
SERIES = SolveOptions(methods[FALLBACK], requested_method=FALLBACK)
LONGER_SERIES = SolveOptions(methods[FALLBACK], digits=20, requested_method=FALLBACK)
LONGEST_SERIES = SolveOptions(methods[FALLBACK], digits=30, requested_method=FALLBACK)
# Runs with 30 digits and shorter steps, whose rounding errors differ from those of LONGEST_SERIES.
SHORTER_STEPS = [
    SolveOptions(methods[FALLBACK], tol=2.0**-n, digits=30, requested_method=FALLBACK)
    for n in (108, 109, 110)
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
    if not CLOSED_FORM.method.suits(scene) or has_torus_closed_form(scene):
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


def estimate_attitude_error(
    scene: Scene,
    method: MethodName,
    digits: int | None,
    angle_to: Callable[[SolveOptions], float],
    growth: Callable[[], float],
) -> float:
    """Estimate the attitude error [rad] of a path that `method` computed with `digits` digits.

    `angle_to(options)` returns the largest angle between the path and a second run with these
    options. `growth()` returns the factor by which the motion amplifies rounding errors in the
    initial state. The returned error is pi if nothing is known about the accuracy of the attitude.
    """
    if not digits and method != EXACT and has_cheap_exact_form(scene):
        error = angle_to(CLOSED_FORM)
        if error >= ROUNDINGS * ROUNDING * growth():
            return error
    if digits == 30:
        # No other run is more accurate than the path, whose error may therefore exceed its distance
        # from each of them. All runs have the error by rounding the start in common.
        errors = [*map(angle_to, SHORTER_STEPS), ROUNDING**2 * growth()]
        return min(FACTOR_30 * max(errors), math.pi)
    error = 0.0 if digits else angle_to(LONGER_SERIES)
    # A closed form rounds only once, but the motion can magnify the rounding errors of a series.
    # A large difference may therefore be an error of the series with 20 digits: use 30 digits.
    is_unsure = method == EXACT and error > ROUNDINGS * ROUNDING
    return angle_to(LONGEST_SERIES) if digits or is_unsure else error


def compute_state_changes_by_rounding(scene: Scene, digits: int = 16) -> Array:
    """Return a matrix whose columns are changes of attitude and momentum caused by rounding.

    Each column is the change of the state per unit of relative rounding error. For at most 16
    digits, the rounding error of the momentum is proportional to the largest moment of inertia and
    the estimated angular velocity. If more than 16 digits are requested, the C library stores the
    momentum in the body frame. If the momentum is stored in the body frame, rounding the attitude
    also rotates the momentum in space, and each of its components has its own rounding error.
    """
    if digits <= 16:
        return np.diag([1.0] * 3 + [max(scene.body.moments) * scene._rotation_rate] * 3)
    rotation, principal = _rotation_matrix(scene.attitude), _rotation_matrix(scene.body.axes)
    body_momentum = rotation.T @ np.array(scene.momentum)
    turns = _compute_rounding_rotations(scene)
    momentum_changes = rotation @ np.cross(turns.T, body_momentum).T
    momentum_roundings = rotation @ (principal * (principal.T @ body_momentum))
    return np.block([[turns, np.zeros((3, 3))], [momentum_changes, momentum_roundings]])


def _compute_rounding_rotations(scene: Scene) -> Array:
    """Return the rotation vectors [rad], in the body frame, that result from rounding the attitude.

    The C library stores the attitude of the principal axes as a quaternion. Each component of the
    quaternion is a sum of products, each of which has a relative rounding error.
    """
    axes = scene.body.axes
    each: Any = np.diag(scene.attitude)
    sizes: Any = np.diag(np.linalg.norm(multiply(each, axes), axis=1))
    products = multiply(sizes, conjugate(axes))
    return 2.0 * np.array(multiply(conjugate(scene.attitude), products))[1:]


def _rotation_matrix(q: Quaternion) -> Array:
    axes = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    return np.array([turn(q, axis) for axis in axes]).T


def estimate_rounding_growth(
    scene: Scene,
    times: Array,
    digits: int = 16,
    max_steps: int = 0,
    progress: Progress | Work | None = None,
    origin: RunStart = ORIGIN,
) -> tuple[CoreResult, float]:
    """Estimate how much a motion amplifies rounding errors of its initial state.

    The amplification is the change of attitude [rad] divided by the relative rounding error. The
    estimate is based on tangents from the Taylor series, regardless of the method that computed the
    path. If at most 16 digits are requested, the largest amplification of a single rounding error
    is returned. For more than 16 digits, all rounding errors are combined as if they were
    independent. The amplification is infinite if a tangent overflows. Returns the result of the
    Taylor-series run that provides the tangents, and the amplification. If the run fails, the
    states after the failure are missing.
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


def compute_max_angle_between_attitudes(
    one: tuple[Array, Array], other: tuple[Array, Array]
) -> float:
    """Return the largest angle [rad] between corresponding attitudes in two arrays."""
    return float(compute_angles_between_attitudes(one, other).max())


def compute_angles_between_attitudes(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Return the angles [rad] between corresponding attitudes in two arrays.

    Each argument is a pair of arrays: n attitude quaternions, and their low-order parts (beyond
    double precision). The quaternions are subtracted before they are multiplied, so that small
    angles keep their relative accuracy.
    """
    (p, p_low), (q, q_low) = one, other
    dot = (p * q).sum(axis=1)
    sign = np.where(dot < 0.0, -1.0, 1.0)[:, None]
    d = (sign * q - p) + (sign * q_low - p_low)
    # The vector part of conjugate(p) * (q - p), in terms of d = q - p.
    vec = p[:, :1] * d[:, 1:] - d[:, :1] * p[:, 1:] - np.cross(p[:, 1:], d[:, 1:])
    angles: Array = 2.0 * np.arctan2(np.sqrt((vec**2).sum(axis=1)), np.abs(dot))
    return angles
