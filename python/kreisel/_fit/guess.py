"""First guesses of a fit from the records."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from .._results.results import Error
from .._solve.solve import solve
from .._utils.arguments import Array
from . import rotations
from .parameters import FitPoint, FreeParameters
from .records import Record, Series

_FEWEST = 8  # samples that a guess needs
_GAP = 6.0  # a longer pause between two samples, relative to the median, ends a stretch
_TURN = 0.5  # angle between attitudes whose difference gives an angular velocity [rad]


class MotionSamples(NamedTuple):
    """Attitudes and angular velocities of the principal axes at n times.

    attitude     quaternions from the principal axes to space; only relative to the first one, or
                 only up to the axes of the body, depending on the source
    rate         angular velocities
    source       "attitude": the attitudes are known. "vertical": all but the heading is known.
                 "gyroscope": the first attitude is unknown. "space": seen from space, the principal
                 axes are unknown
    is_at_rest   True if they are seen from the inertial frame instead of a turning support
    """

    t: Array
    attitude: Array
    rate: Array
    source: str
    is_at_rest: bool = False


def reconstruct_motions(records: Sequence[Record], point: FitPoint) -> list[MotionSamples]:
    """Return the motions reconstructed from the records, those with known attitudes first."""
    rotation = rotations.to_matrix(point.axes)
    motions: list[MotionSamples] = []
    for record in records:
        table = {s.quantity: s for s in record.series if s.part is None}
        for name in ("q", "body_velocity", "inertial_velocity", "velocity"):
            if name not in table:
                continue
            t, values = _select_longest_gapless_samples(record.t, table[name])
            if len(t) < _FEWEST:
                continue
            if name == "q":
                attitudes = rotations.multiply(values, point.axes[None])
                motions.append(_reconstruct_motion_from_attitudes(t, attitudes))
            elif name == "velocity":
                attitudes = _integrate_angular_velocity(
                    t, values, rotations.UNTURNED, is_in_space=True
                )
                rate = (values[:, None, :] @ rotations.to_matrix(attitudes))[:, 0]
                motions.append(MotionSamples(t, attitudes, rate, "space"))
            else:
                first, source, rate = rotations.UNTURNED, "gyroscope", values @ rotation
                if "body_vertical" in table:
                    series = table["body_vertical"]
                    rows = np.flatnonzero(series.measured.all(axis=1) & series.values.any(axis=1))
                    if rows.size:
                        near = series.values[rows[np.abs(record.t[rows] - t[0]).argmin()]]
                        vertical = rotations.normalize(near @ rotation)
                        first = rotations.conjugate(rotations.from_vertical(vertical))
                        source = "vertical"
                attitudes = _integrate_angular_velocity(t, rate, first, is_in_space=False)
                is_at_rest = name == "inertial_velocity" and bool(point.turning.any())
                motions.append(MotionSamples(t, attitudes, rate, source, is_at_rest))
    order = ("attitude", "vertical", "space", "gyroscope")
    return sorted(motions, key=lambda motion: order.index(motion.source))


def _find_apex_directions(records: Sequence[Record], point: FitPoint) -> tuple[Array, Array] | None:
    """Return the times and directions of the first record that contains enough of the apex."""
    for record in records:
        table = {s.name: s for s in record.series}
        if "apex" in table:
            t, e = _select_longest_gapless_samples(record.t, table["apex"])
        else:
            pairs = [("apex_x", "apex_y"), ("nutation", "precession_angle")]
            pair = next((p for p in pairs if table.keys() >= set(p)), None)
            if pair is None:
                continue
            rows = np.logical_and(*(table[name].measured[:, 0] for name in pair))
            t, (u, v) = record.t[rows], (table[name].values[rows, 0] for name in pair)
            if pair[0] == "apex_x":
                side = np.sign((rotations.to_matrix(point.attitude) @ point.com)[2]) or 1.0
                e = np.stack((u, v, side * np.sqrt(np.maximum(1.0 - u * u - v * v, 0.0))), axis=1)
            else:
                e = np.stack((np.sin(u) * np.sin(v), -np.sin(u) * np.cos(v), np.cos(u)), axis=1)
        t, first = np.unique(t, return_index=True)
        if len(t) >= _FEWEST:
            return t, rotations.normalize(e[first])
    return None


def _select_longest_gapless_samples(t: Array, series: Series) -> tuple[Array, Array]:
    """Return the longest sequence of complete rows with distinct times and no gap in time."""
    is_measured = series.measured.all(axis=1)
    times, first = np.unique(t[is_measured], return_index=True)
    values = series.values[is_measured][first]
    if len(times) < _FEWEST:
        return times[:0], values[:0]
    pauses = np.diff(times)
    ends = np.flatnonzero(pauses > _GAP * np.median(pauses)) + 1
    edges = np.concatenate(([0], ends, [len(times)]))
    k = int(np.argmax(np.diff(edges)))
    part = slice(edges[k], edges[k + 1])
    return times[part], values[part]


def _reconstruct_motion_from_attitudes(t: Array, q: Array) -> MotionSamples:
    """Reconstruct a motion, computing each angular velocity from two well-separated attitudes."""

    def find_turns(stride: int) -> Array:
        return rotations.to_vector(rotations.multiply(rotations.conjugate(q[:-stride]), q[stride:]))

    angle = float(np.median(np.linalg.norm(find_turns(1), axis=1)))
    stride = min(max(round(_TURN / max(angle, 1e-9)), 1), len(t) // 4)
    turns = find_turns(stride)
    rate = turns / (t[stride:] - t[:-stride])[:, None]
    halfway = rotations.multiply(q[:-stride], rotations.from_vector(0.5 * turns))
    return MotionSamples(0.5 * (t[stride:] + t[:-stride]), halfway, rate, "attitude")


def _integrate_angular_velocity(t: Array, rate: Array, first: Array, is_in_space: bool) -> Array:
    """Integrate angular velocities to obtain attitudes, starting from the attitude `first`."""
    attitudes = np.empty((len(t), 4))
    attitudes[0] = first
    attitudes[1:] = rotations.from_vector(0.5 * np.diff(t)[:, None] * (rate[1:] + rate[:-1]))
    shift = 1
    while shift < len(t):  # products of 2, 4, 8, ... neighbours
        ends = attitudes[:-shift], attitudes[shift:]
        attitudes[shift:] = rotations.multiply(*(ends[::-1] if is_in_space else ends))
        shift *= 2
    return attitudes


def interpolate_motion(motion: MotionSamples, t: float) -> tuple[Array, Array]:
    k = min(max(int(np.searchsorted(motion.t, t)), 1), len(motion.t) - 1)
    k -= int(t - motion.t[k - 1] < motion.t[k] - t)
    window = slice(max(k - 2, 0), k + 3)
    rate = motion.rate[window].mean(axis=0)
    turn = rotations.from_vector((t - motion.t[k]) * rate)
    return rotations.multiply(motion.attitude[k], turn), rate


_LEAST = 1e-3  # least density of a guess, relative to its largest moment
_SMOOTHING = 9  # samples of the cubic that smooths the first ones
_STOPPED = 0.05  # spin that friction has nearly stopped, relative to the largest
_INERTIA = np.zeros((6, 3, 3))  # a basis of symmetric matrices, the diagonal ones first
for _k, _place in enumerate(((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))):
    _INERTIA[_k][_place] = _INERTIA[_k].T[_place] = 1.0


class Guess(NamedTuple):
    """An initial guess of the parameters, and the measured motion from which it was computed.

    The attitudes of the motion are from the principal axes of the point to space.
    """

    point: FitPoint
    motion: MotionSamples | None


def guess_parameters(parameters: FreeParameters, records: Sequence[Record]) -> list[Guess]:
    """Compute initial guesses from the measurements, none if they do not show the motion."""
    motions = reconstruct_motions(records, parameters.start)[:2]
    return [x for motion in motions for x in _guess_parameters_from_motion(parameters, motion)]


def yield_random_starts(
    parameters: FreeParameters, records: Sequence[Record]
) -> Iterator[FitPoint]:
    """Yield random initial states of the given body that agree with the first measured values.

    If the momentum m is measured, its rate M g e3 x a gives the horizontal part of a, the vector to
    the centre of mass. If the apex is measured, its velocity gives the angular velocity across the
    apex. All else is random.
    """
    base, generator = parameters.start, np.random.default_rng(0)
    size = float(np.linalg.norm(base.rate)) + np.sqrt(abs(base.torque) / float(base.moments.max()))
    axis = _compute_friction_axis(base)
    back = rotations.conjugate(rotations.from_vertical(axis))
    known = _find_first_measured_states(records, base)
    while True:
        turn = rotations.normalize(generator.normal(size=4))
        rate, t = size * generator.normal(size=3), 0.0
        if known:
            t, apex, change, momentum = known[int(generator.integers(len(known)))]
            about_axis = rotations.from_vector(generator.uniform(0.0, 2.0 * np.pi) * axis)
            tilt = rotations.multiply(rotations.from_vertical(apex), back)
            turn = rotations.multiply(tilt, about_axis)
            rotation = rotations.to_matrix(turn)
            if momentum is not None:
                rate = base.relative_angular_velocity(turn, momentum)
            else:
                rate = rotation.T @ np.cross(apex, change) + float(rate @ axis) * axis
        yield _find_parameters_through_state(parameters, base, t, turn, rate)


def _find_first_measured_states(
    records: Sequence[Record], base: FitPoint
) -> list[tuple[float, Array, Array, Array | None]]:
    """Return (time, apex, its velocity, momentum or None) as far as the records determine them.

    The momentum leaves two directions of the apex, one above and one below the horizontal plane.
    """
    momenta = [(r.t, series) for r in records for series in r.series if series.name == "m"]
    for times, series in momenta if base.torque else []:
        times, values = _select_longest_gapless_samples(times, series)
        if len(times):
            t, m, change = _fit_first_samples(times, values)
            weight = base.mass * float(base.compute_effective_gravity(np.array(t)))
            torque = change + np.cross(base.turning, m)
            flat = np.array((torque[1], -torque[0], 0.0)) / weight / np.linalg.norm(base.com)
            height = np.sqrt(max(1.0 - float(flat @ flat), 0.0))
            tops = [flat + np.array((0.0, 0.0, sign * height)) for sign in (1.0, -1.0)]
            return [(t, rotations.normalize(top), np.zeros(3), m) for top in tops]
    directions = _find_apex_directions(records, base) if base.com.any() else None
    if directions is None:
        return []
    t, apex, change = _fit_first_samples(*directions)
    return [(t, rotations.normalize(apex), change, None)]


def _fit_first_samples(t: Array, vectors: Array) -> tuple[float, Array, Array]:
    """Return a time among the first samples, the vector and its derivative there, by a cubic."""
    middle = float(t[_SMOOTHING // 2])
    cubic = np.polynomial.polynomial.polyfit(t[:_SMOOTHING] - middle, vectors[:_SMOOTHING], 3)
    return middle, cubic[0], cubic[1]


def _guess_parameters_from_motion(parameters: FreeParameters, motion: MotionSamples) -> list[Guess]:
    """Compute a guess from the momentum equation, or none if it cannot be solved."""
    base, free, part = parameters.start, parameters.places, motion
    is_heavy = base.gravity_force != 0.0 and ("com" in free or bool(base.com.any()))
    is_rubbed = part.source != "space" and ("friction" in free or base.friction > 0.0)
    if is_rubbed:
        spin = np.abs(part.rate @ _compute_friction_axis(base))
        stopped = np.flatnonzero(spin < _STOPPED * spin.max())
        if stopped.size and stopped[0] >= _FEWEST:
            t, attitude, rate = (x[: stopped[0]] for x in motion[:3])
            part = MotionSamples(t, attitude, rate, motion.source, motion.is_at_rest)
    is_damped = "damping" in free or bool(base.damping.any())
    solution = _fit_momentum_equation(part, base, is_heavy, is_damped, is_rubbed)
    if solution is None:
        return []
    inertia, lever, v, damping, friction = solution
    turn, first = rotations.UNTURNED, rotations.UNTURNED
    if motion.source == "space":  # the axes of the motion are not the principal axes
        turn = rotations.from_matrix(_orient_principal_axes_like_scene(inertia, lever, base))
    if motion.source == "gyroscope":  # which does not tell (com, vertical) from (-com, -vertical)
        if (lever @ base.com) * base.gravity_force < 0.0:
            lever, v = -lever, -v
        first = rotations.conjugate(rotations.from_vertical(v))
    rotation = rotations.to_matrix(turn)
    moments = np.diag(rotation.T @ inertia @ rotation).copy()
    t, rate = motion.t, motion.rate @ rotation
    attitude = rotations.multiply(rotations.multiply(first, motion.attitude), turn)
    if motion.is_at_rest:  # the support coincides with the inertial frame at the first sample
        turned = rotations.from_vector((t[0] - t)[:, None] * base.turning)
        attitude = rotations.multiply(turned, attitude)
        rate = rate - base.turning @ rotations.to_matrix(attitude)
    densities = 0.5 * moments.sum() - moments
    densities = np.maximum(densities, _LEAST * np.abs(moments).max())
    # the moments of the scene or the torque of gravity give the unknown factor
    factor, length = base.moments.sum() / (2.0 * densities.sum()), float(np.linalg.norm(lever))
    fields: dict[str, Any] = {}
    if "moments" in free:
        if length > 0.0 and base.torque and "com" not in free:
            factor = abs(base.torque) / length
        mean = parameters.columns["moments"] @ parameters.average_tied("moments", densities)
        fields["densities"] = factor * mean
    if base.gravity_force and length > 0.0 and "com" in free:
        fields["com"] = factor * (lever @ rotation) / base.gravity_force
    if "damping" in free:
        fields["damping"] = np.full(3, max(factor * damping, 0.0))
    if "friction" in free:
        fields["friction"] = max(factor * friction, 0.0)
    point = replace(base, **fields)
    mean = rate[:3].mean(axis=0)
    start = _find_parameters_through_state(parameters, point, t[0], attitude[0], mean)
    return [Guess(start, MotionSamples(t, attitude, rate, motion.source))]


def _compute_friction_axis(base: FitPoint) -> Array:
    length = float(np.linalg.norm(base.com))
    axis: Array = base.com / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    return axis


def _find_parameters_through_state(
    parameters: FreeParameters, point: FitPoint, time: float, attitude: Array, rate: Array
) -> FitPoint:
    """Return the parameters for which the motion passes through a given state at `time`."""

    def start_at(attitude: Array, rate: Array) -> FitPoint:
        free, start = parameters.places, point.start_at(attitude, rate)
        start = start if "attitude" in free else replace(start, attitude=point.attitude)
        return start if "velocity" in free else replace(start, rate=point.rate)

    trial = start_at(attitude, rate)
    if time != 0.0:
        with suppress(Error, ValueError):
            path = solve(trial.to_scene(time), [-time], "taylor", max_steps=10000)
            q, m = path.q[0], path.m[0]
            return start_at(q, trial.relative_angular_velocity(q, m))
    return trial


def _fit_momentum_equation(
    motion: MotionSamples, base: FitPoint, is_heavy: bool, is_damped: bool, is_rubbed: bool
) -> tuple[Array, Array, Array, float, float] | None:
    """Return inertia, mass gravity com, vertical, damping and friction, with an unknown factor.

    The momentum minus the integrals of the torques is constant; this equation is solved using the
    singular vector of the smallest singular value. Returns None if there are too few samples, or if
    the body has a rotor and its principal axes are unknown.
    """
    rotor, is_full, is_free = base.rotor, motion.source == "space", motion.source == "gyroscope"
    if rotor.any() and is_full:
        return None
    t, rotation, turning = motion.t, rotations.to_matrix(motion.attitude), base.turning
    if motion.is_at_rest or is_free:
        turning = np.zeros(3)
    elif motion.source == "vertical":
        turning = turning * np.array([0.0, 0.0, 1.0])
    rate = motion.rate + turning @ rotation
    basis = _INERTIA[: 6 if is_full else 3]
    momenta = [rotation @ np.einsum("kij,nj->nik", basis, rate)]
    momenta += [(rotation @ rotor)[:, :, None]] if rotor.any() else []
    columns = [one + rotations.cross(turning) @ _integrate_by_trapezoids(t, one) for one in momenta]
    columns.append(-np.broadcast_to(np.eye(3), rotation.shape))
    if is_heavy:
        weight = base.compute_effective_gravity(t) / base.gravity
        integral = _integrate_by_trapezoids(t, weight[:, None, None] * rotation)
        columns.append(
            -np.einsum("kij,njl->nikl", rotations.cross(np.eye(3)), integral).reshape(len(t), 3, 9)
            if is_free
            else -rotations.cross(np.array([0.0, 0.0, 1.0])) @ integral
        )
    if is_damped:
        space_rate = (rotation @ motion.rate[:, :, None])[:, :, 0]
        columns.append(_integrate_by_trapezoids(t, space_rate)[:, :, None])
    if is_rubbed:
        axis = _compute_friction_axis(base)
        sense = np.sign(motion.rate @ axis)[:, None]
        columns.append(_integrate_by_trapezoids(t, sense * (rotation @ axis))[:, :, None])
    matrix = np.concatenate(columns, axis=2).reshape(3 * len(t), -1)
    sizes = np.linalg.norm(matrix, axis=0)
    sizes[sizes == 0.0] = 1.0
    if len(matrix) < matrix.shape[1] or not np.isfinite(matrix).all():
        return None
    normal = (matrix / sizes).T @ (matrix / sizes)
    solution = np.linalg.eigh(normal)[1][:, 0] / sizes
    if rotor.any():
        solution = np.delete(solution, 3)  # the size of the rotor, after three moments
    inertia = np.einsum("k,kij->ij", solution[: len(basis)], basis)
    sign = np.sign(np.trace(inertia))
    if not sign:
        return None
    rest = sign * solution[len(basis) + 3 :]  # after the constant momentum
    lever, vertical = np.zeros(3), np.array([0.0, 0.0, 1.0])
    if is_heavy and is_free:
        left, products, right = np.linalg.svd(rest[:9].reshape(3, 3))
        lever, vertical = products[0] * right[0], left[:, 0]
    elif is_heavy:
        lever = rest[:3]
    friction = float(rest[-1]) if is_rubbed else 0.0
    damping = float(rest[-1 - is_rubbed]) if is_damped else 0.0
    return sign * inertia, lever, vertical, damping, friction


def _integrate_by_trapezoids(t: Array, values: Array) -> Array:
    steps = np.diff(t).reshape(-1, *[1] * (values.ndim - 1))
    integrals = np.zeros_like(values)
    np.cumsum(0.5 * steps * (values[1:] + values[:-1]), axis=0, out=integrals[1:])
    return integrals


def _orient_principal_axes_like_scene(inertia: Array, lever: Array, base: FitPoint) -> Array:
    """Return the principal axes as columns, in the order of the scene's moments.

    Their signs are those for which the centre of mass agrees best with that of the scene.
    """
    frame = np.empty((3, 3))
    frame[:, np.argsort(base.moments, kind="stable")] = np.linalg.eigh(inertia)[1]
    lever = lever * np.sign(base.gravity_force)
    frames = [frame * np.array(signs) for signs in itertools.product((1.0, -1.0), repeat=3)]
    right_handed = [one for one in frames if np.linalg.det(one) > 0.0]
    return max(right_handed, key=lambda one: lever @ one @ base.com)
