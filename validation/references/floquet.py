"""Derivatives of closed-form solutions with respect to the initial state.

In the body frame, the vertical P and the momentum M are periodic with the period tau. For a
symmetric body, these two vectors are periodic up to a rotation S about the symmetry axis. A tangent
consists of a rotation vector theta and a change N of the momentum. Let Phi(t) be the matrix that
maps theta and N at time 0 to theta and N at time t. By Floquet's theorem,
    Phi(k tau + s) = S^k Phi(s) (S^-1 Phi(tau))^k.
The motion over one period is computed in 30-digit arithmetic. Matrix powers are computed with 50
decimal digits, so that all 30 digits remain correct.
"""

from __future__ import annotations

import math
from decimal import Decimal, InvalidOperation, Overflow, localcontext
from typing import Any, NamedTuple

import kreisel as kr
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Decimals = npt.NDArray[np.object_]  # an array of decimals
_PRECISION = 50
_LATE = 1e-9  # relative error allowed for the period in doubles
_STEADY = 1e-12  # relative rates of change below this value count as zero
_AXES = np.eye(3)


def _add_as_decimals(high: Array, low: Array | None = None) -> Decimals:
    """Return the elementwise sums of `high` and `low` as decimal numbers."""
    return _to_decimals(high) if low is None else _to_decimals(high) + _to_decimals(low)


def _to_decimals(numbers: Array) -> Decimals:
    array = np.asarray(numbers, dtype=float)
    decimals = np.empty(array.shape, dtype=object)
    decimals.ravel()[:] = [Decimal(number) for number in array.ravel().tolist()]
    return decimals


def _rotation_matrix(q: Decimals) -> Decimals:
    """Return the rotation matrix of a quaternion of any length."""
    w, x, y, z = q
    n = w * w + x * x + y * y + z * z
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    turn: Decimals = np.array(rows, dtype=object) / n
    return turn


def _cross(a: Decimals, b: Decimals) -> Decimals:
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def _cross_matrix(a: Decimals) -> Decimals:
    """Return the matrix of the cross product with the vector a."""
    zero = Decimal(0)
    rows = [[zero, -a[2], a[1]], [a[2], zero, -a[0]], [-a[1], a[0], zero]]
    return np.array(rows, dtype=object)


def _block_matrix(block: Decimals, other: Decimals | None = None) -> Decimals:
    """Return a block-diagonal matrix of two blocks, which are equal by default."""
    zero = _to_decimals(np.zeros((3, 3)))
    return np.block([[block, zero], [zero, block if other is None else other]])


class _Body(NamedTuple):
    """A rigid body whose parameters are decimal numbers.

    The moments of inertia, the lever arm and the symmetry axis refer to the principal axes. The
    matrix `frame` rotates the principal axes to the axes of the user.
    """

    moments: Decimals
    lever: Decimals
    axis: Decimals | None
    frame: Decimals

    @classmethod
    def of(cls, scene: kr.Scene) -> _Body:
        body = scene.body
        moments, com = np.array(body.moments), _to_decimals(np.array(body.principal_com))
        lever = com * (Decimal(body.mass) * Decimal(scene.gravity))
        is_equal = [
            np.isclose(np.roll(moments, -i - 1)[0], np.roll(moments, -i - 2)[0], 1e-14, 0.0)
            for i in range(3)
        ]
        axis = None
        if all(is_equal):
            reach = (com @ com).sqrt()
            axis = com / reach if reach else _to_decimals(_AXES[2])
        elif any(is_equal):
            axis = _to_decimals(_AXES[is_equal.index(True)])
        return cls(
            _to_decimals(moments), lever, axis, _rotation_matrix(_to_decimals(np.array(body.axes)))
        )


class _Point(NamedTuple):
    """A state of motion; its vertical and momentum are given in the principal-axis frame."""

    vertical: Decimals
    momentum: Decimals
    turn: Decimals

    @classmethod
    def of(cls, body: _Body, path: kr.Path, i: int) -> _Point:
        turn = _rotation_matrix(_add_as_decimals(path.q[i], path.q_low[i])) @ body.frame
        momentum = turn.T @ _add_as_decimals(path.m[i], path.m_low[i])
        heavy = any(body.lever)
        return cls(turn[2] if heavy else turn[2] * 0, momentum, turn)

    def rates(self, body: _Body) -> tuple[Decimals, Decimals]:
        """Return the time derivatives of the vertical and of the momentum in the body frame."""
        w = self.momentum / body.moments
        return _cross(self.vertical, w), _cross(self.momentum, w) + _cross(
            self.vertical, body.lever
        )

    def generator(self, body: _Body) -> Decimals:
        """Return the matrix A of the linearized equations (theta, N)' = A (theta, N)."""
        per, hat = np.diag(Decimal(1) / body.moments), _cross_matrix(self.momentum / body.moments)
        turn = per @ _cross_matrix(self.momentum) - hat
        return np.block(
            [[turn, per], [_cross_matrix(self.vertical) @ -_cross_matrix(body.lever), -hat]]
        )

    def phase(self, body: _Body, axis: Decimals | None) -> Decimals:
        """Return functions of the state that are periodic in time.

        For a symmetric body, these functions are invariant under rotations of the body about its
        symmetry axis.
        """
        if axis is None:
            return self.momentum
        return np.array(
            [axis @ self.vertical, axis @ _cross(self.vertical, self.momentum)], dtype=object
        )

    def phase_rate(self, body: _Body, axis: Decimals | None) -> Decimals:
        """Return the time derivatives of the values returned by the method `phase`."""
        vertical, momentum = self.rates(body)
        if axis is None:
            return momentum
        product = _cross(vertical, self.momentum) + _cross(self.vertical, momentum)
        return np.array([axis @ vertical, axis @ product], dtype=object)


def _find_symmetry(axis: Decimals | None, one: _Point, other: _Point) -> Decimals:
    """Return the rotation about the symmetry axis that maps the first state to the second."""
    if axis is None:
        return _to_decimals(_AXES)
    pairs = [(one.vertical, other.vertical), (one.momentum, other.momentum)]
    products = [(_cross(axis, a), _cross(axis, b)) for a, b in pairs]
    sizes = [
        float((a @ a) / (v @ v)) if v @ v else 0.0
        for (a, _), (v, _) in zip(products, pairs, strict=True)
    ]
    a, b = products[int(np.argmax(sizes))]
    if max(sizes) < 1e-28:
        return _to_decimals(_AXES)
    size = ((a @ a) * (b @ b)).sqrt()
    cosine, sine = (a @ b) / size, (axis @ _cross(a, b)) / size
    projection = np.outer(axis, axis)
    turn: Decimals = (
        projection + (_to_decimals(_AXES) - projection) * cosine + _cross_matrix(axis) * sine
    )
    return turn


class Floquet(NamedTuple):
    """The monodromy matrix, the period and the symmetry of a periodic motion."""

    body: _Body
    tau: Decimal
    symmetry: Decimals
    period: Decimals  # S^-1 Phi(tau)
    start: _Point


def _tangents_in_body(point: _Point, start: _Point, body: _Body, path: kr.Path, i: int) -> Decimals:
    """Return the derivatives of a state with respect to the initial state, in principal axes."""
    phi = _add_as_decimals(path.tangents[i], path.tangents_low[i])
    tangents: Decimals = (
        _block_matrix(body.frame.T, point.turn.T) @ phi @ _block_matrix(body.frame, start.turn)
    )
    return tangents


def _find_steady_rate(point: _Point, body: _Body) -> float | None:
    """Return the angular velocity of a steady motion about the symmetry axis.

    Returns None if the motion is not steady.
    """
    rates = [np.array(rate, dtype=float) for rate in point.rates(body)]
    rate = 0.0
    if body.axis is not None:
        places = point.vertical, point.momentum
        rounds = [np.array(_cross(body.axis, place), dtype=float) for place in places]
        size = sum(float(a @ a) for a in rounds)
        both = sum(float(a @ b) for a, b in zip(rounds, rates, strict=True))
        rate = both / size if size else 0.0
        rates = [a - rate * b for a, b in zip(rates, rounds, strict=True)]
    largest = float(max(body.moments))
    spin = float(np.abs(np.array(point.momentum / body.moments, dtype=float)).max())
    fastest = max(spin, math.sqrt(math.sqrt(float(body.lever @ body.lever)) / largest))
    change = max(np.abs(rates[0]).max() / fastest, np.abs(rates[1]).max() / (largest * fastest**2))
    return rate if change <= _STEADY else None


def _oscillation_period(point: _Point, body: _Body, rate: float, fastest: float) -> float:
    """Return the period of small oscillations about a steady motion.

    If there are no oscillations, return a typical time scale of the motion.
    """
    axis = _to_decimals(_AXES[2]) if body.axis is None else body.axis
    turning = rate * np.array(_block_matrix(_cross_matrix(axis)), dtype=float)
    swing = np.abs(np.linalg.eigvals(np.array(point.generator(body), dtype=float) - turning).imag)
    return float(2.0 * math.pi / swing.max()) if swing.max() > 1e-3 * fastest else 1.0 / fastest


def _make_separatrix_error(scene: kr.Scene) -> ValueError:
    return ValueError(
        f"{scene!r} lies on a separatrix, or too near to it to have a period that can be told: its "
        "tangents are those of kreisel.solve(scene, t, tangents='start')"
    )


def _estimate_period(scene: kr.Scene, body: _Body, start: _Point, period: float) -> float:
    """Return the period of the motion, or of small oscillations about a steady motion.

    Raises ValueError if the motion lies on a separatrix.
    """
    turning = _find_steady_rate(start, body)
    if turning is not None:
        estimate = _oscillation_period(start, body, turning, scene._rotation_rate)
    else:
        estimate = period * (1.0 if body.axis is not None else 2.0)
    if not math.isfinite(estimate):
        raise _make_separatrix_error(scene)
    return estimate


def floquet(scene: kr.Scene, period: float, back: bool, longest: float) -> Floquet:
    """Return the monodromy matrix and the period of a motion.

    The argument `longest` is the latest time at which derivatives are needed. If `longest` is less
    than the period, the monodromy matrix is not computed. Raises ValueError if the motion lies on a
    separatrix.
    """
    body = _Body.of(scene)
    start = _Point.of(body, kr.solve(scene, [0.0], digits=30), 0)
    turning = _find_steady_rate(start, body)
    estimate = _estimate_period(scene, body, start, period)
    if longest < estimate:
        return Floquet(
            body,
            Decimal(-estimate if back else estimate),
            _to_decimals(_AXES),
            _to_decimals(np.eye(6)),
            start,
        )
    tau = -estimate if back else estimate
    path = _solve(scene, [0.0, tau])
    end = _Point.of(body, path, 1)
    phi, late = _tangents_in_body(end, start, body, path, 1), Decimal(0)
    if turning is None:
        rate, phase = end.phase_rate(body, body.axis), end.phase(body, body.axis)
        speed = rate @ rate or Decimal(1)
        late = -(rate @ (phase - start.phase(body, body.axis))) / speed
        if not abs(late) <= _LATE * abs(tau):
            raise _make_separatrix_error(scene)
        phi = phi + late * (end.generator(body) @ phi)
        vertical, momentum = end.rates(body)
        end = _Point(end.vertical + late * vertical, end.momentum + late * momentum, end.turn)
    turn = _find_symmetry(body.axis, start, end)
    difference = turn @ start.momentum - end.momentum
    size = end.momentum @ end.momentum + max(body.moments) * (body.lever @ body.lever).sqrt()
    if not float(difference @ difference) <= _LATE**2 * float(size):
        raise _make_separatrix_error(scene)
    return Floquet(body, Decimal(tau) + late, turn, _block_matrix(turn.T) @ phi, start)


def floquet_tangents(scene: kr.Scene, times: object) -> Array:
    """Return the derivatives of the state at arbitrary times with respect to the initial state.

    Raises ValueError if the motion lies on a separatrix, or if a derivative overflows. The result
    has the shape (n, 6, 6), like path.tangents. The computation takes about one millisecond per
    requested time.
    """
    closed = kr.exact(scene)
    path = closed(times)
    period, t, q = closed.period, path.t, path.q
    tangents = np.empty((t.size, 6, 6))
    with localcontext() as context:
        context.prec = _PRECISION
        context.traps[Overflow] = context.traps[InvalidOperation] = False
        for back in (False, True):
            indices = np.flatnonzero(t < 0.0 if back else t >= 0.0)
            if indices.size:
                longest = float(np.abs(t[indices]).max())
                _fill_tangents(
                    scene, floquet(scene, period, back, longest), t, q, indices, tangents
                )
    endless = ~np.isfinite(tangents).all(axis=(1, 2))
    if endless.any():
        raise _make_range_error(float(t[endless][0]))
    return tangents


def _make_range_error(t: float) -> ValueError:
    return ValueError(f"by t = {t!r} a tangent has grown beyond what doubles hold")


def _solve(scene: kr.Scene, times: list[float]) -> kr.Path:
    """Solve the equations of motion and their linearization in 30-digit arithmetic.

    Raises ValueError if a derivative overflows.
    """
    try:
        return kr.solve(scene, times, digits=30, tangents="start")
    except kr.Error as error:
        if error.status != "ERR_TANGENT":
            raise
        raise _make_range_error(times[-1]) from None


def _fill_tangents(
    scene: kr.Scene,
    solution: Floquet,
    t: Array,
    q: Array,
    indices: npt.NDArray[np.intp],
    out: Array,
) -> None:
    times = [Decimal(float(t[i])) for i in indices]
    counts = [int(time / solution.tau) for time in times]
    rests = [time - count * solution.tau for time, count in zip(times, counts, strict=True)]
    order = np.argsort([abs(float(rest)) for rest in rests], kind="stable")
    path = _solve(scene, [float(rests[j]) for j in order])
    powers: dict[int, tuple[Any, Any]] = {}
    for k, j in enumerate(order.tolist()):
        count, point = counts[j], _Point.of(solution.body, path, k)
        if count not in powers:
            turn_power = np.linalg.matrix_power(solution.symmetry, count)
            powers[count] = (
                _block_matrix(turn_power),
                np.linalg.matrix_power(solution.period, count),
            )
        turn_power, period_power = powers[count]
        phi = _tangents_in_body(point, solution.start, solution.body, path, k)
        late = rests[j] - Decimal(float(rests[j]))
        phi = turn_power @ (phi + late * (point.generator(solution.body) @ phi)) @ period_power
        frame = _rotation_matrix(_to_decimals(q[indices[j]])) @ solution.body.frame
        tangents = (
            _block_matrix(solution.body.frame, frame)
            @ phi
            @ _block_matrix(solution.body.frame.T, solution.start.turn.T)
        )
        out[indices[j]] = tangents.astype(float)
