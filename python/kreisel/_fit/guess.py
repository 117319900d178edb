"""First guesses of a fit from the records."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._results.results import Error
from .._solve.solve import solve
from .._utils.arguments import Array
from .parameters import (
    BLOCKS,
    UNTURNED,
    FitPoint,
    FreeParameters,
    compute_rotation_quaternions,
    compute_rotation_vectors,
    compute_rotations_from_vertical,
    conjugate_quaternions,
    convert_matrix_to_quaternion,
    cross_matrix,
    multiply_quaternions,
    normalize_quaternion,
    rotation_matrix,
)
from .records import Record, Series

FEWEST = 8  # samples that a guess needs
_OUTLIER = 8.0  # deviation from neighbours that is an outlier, relative to the usual one
_OUTLIERS_MOST = 0.2  # share of outliers above which the deviations are the motion itself
_NEIGHBOURS = 5  # samples of which the middle one is compared with the median of the others
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


class Trace(NamedTuple):
    """Vectors of shape (n, 3) at n evenly spaced times, as directions of the apex."""

    t: Array
    vectors: Array


def reconstruct_motions(records: Sequence[Record], point: FitPoint) -> list[MotionSamples]:
    """Return the motions reconstructed from the records, those with known attitudes first."""
    rotation = rotation_matrix(point.axes)
    motions: list[MotionSamples] = []
    for record in records:
        table = {s.quantity: s for s in record.series if s.part is None}
        for name in ("q", "body_velocity", "inertial_velocity", "velocity"):
            if name not in table:
                continue
            t, values = _select_longest_gapless_samples(record.t, table[name])
            if len(t) < FEWEST:
                continue
            if name == "q":
                attitudes = multiply_quaternions(values, point.axes[None])
                motions.append(_reconstruct_motion_from_attitudes(t, attitudes))
            elif name == "velocity":
                attitudes = _integrate_angular_velocity(t, values, UNTURNED, is_in_space=True)
                rate = (values[:, None, :] @ rotation_matrix(attitudes))[:, 0]
                motions.append(MotionSamples(t, attitudes, rate, "space"))
            else:
                first, source, rate = UNTURNED, "gyroscope", values @ rotation
                if "body_vertical" in table:
                    series = table["body_vertical"]
                    rows = np.flatnonzero(series.measured.all(axis=1) & series.values.any(axis=1))
                    if rows.size:
                        near = series.values[rows[np.abs(record.t[rows] - t[0]).argmin()]]
                        vertical = near @ rotation / np.linalg.norm(near @ rotation)
                        first = conjugate_quaternions(compute_rotations_from_vertical(vertical))
                        source = "vertical"
                attitudes = _integrate_angular_velocity(t, rate, first, is_in_space=False)
                is_at_rest = name == "inertial_velocity" and point.is_support_turning
                motions.append(MotionSamples(t, attitudes, rate, source, is_at_rest))
    order = ("attitude", "vertical", "space", "gyroscope")
    return sorted(motions, key=lambda motion: order.index(motion.source))


def _find_momentum_trace(records: Sequence[Record]) -> Trace | None:
    """Return the trace of the momentum in the first record that contains enough momenta."""
    for record in records:
        for series in record.series:
            if series.name == "m":
                t, m = _select_longest_gapless_samples(record.t, series)
                if len(t) > FEWEST:
                    return _resample_evenly(t, m)
    return None


def _find_apex_trace(records: Sequence[Record], point: FitPoint) -> Trace | None:
    """Return the trace of the apex in the first record that contains enough directions."""
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
                side = np.sign((rotation_matrix(point.attitude) @ point.com)[2]) or 1.0
                e = np.stack((u, v, side * np.sqrt(np.maximum(1.0 - u * u - v * v, 0.0))), axis=1)
            else:
                e = np.stack((np.sin(u) * np.sin(v), -np.sin(u) * np.cos(v), np.cos(u)), axis=1)
        t, first = np.unique(t, return_index=True)
        regular = _compute_inlier_mask(e[first], is_attitude=False)
        if regular.sum() >= FEWEST:
            grid, apex = _resample_evenly(t[regular], e[first][regular])
            return Trace(grid, apex / np.linalg.norm(apex, axis=1)[:, None])
    return None


def _resample_evenly(t: Array, vectors: Array) -> Trace:
    grid = np.linspace(t[0], t[-1], len(t))
    return Trace(grid, np.stack([np.interp(grid, t, x) for x in vectors.T], axis=1))


def _select_longest_gapless_samples(t: Array, series: Series) -> tuple[Array, Array]:
    """Return the longest sequence of complete rows with distinct times and no gap in time."""
    is_measured = series.measured.all(axis=1)
    times, first = np.unique(t[is_measured], return_index=True)
    values = series.values[is_measured][first]
    regular = _compute_inlier_mask(values, series.is_attitude)
    times, values = times[regular], values[regular]
    if len(times) < FEWEST:
        return times[:0], values[:0]
    pauses = np.diff(times)
    ends = np.flatnonzero(pauses > _GAP * np.median(pauses)) + 1
    edges = np.concatenate(([0], ends, [len(times)]))
    k = int(np.argmax(np.diff(edges)))
    part = slice(edges[k], edges[k + 1])
    return times[part], values[part]


def _compute_inlier_mask(values: Array, is_attitude: bool) -> NDArray[np.bool_]:
    """Return a mask that is True for each row close to the median of its neighbours.

    Source: Hampel, Journal of the American Statistical Association 69 (1974) 383.
    """
    if len(values) < FEWEST:
        return np.ones(len(values), dtype=np.bool_)
    if is_attitude:  # q and -q are the same attitude
        steps = (values[1:] * values[:-1]).sum(axis=1)
        signs = np.concatenate(([1.0], np.where(steps < 0.0, -1.0, 1.0)))
        values = values * np.cumprod(signs)[:, None]
    half = _NEIGHBOURS // 2
    # Reflections about the second and the last but one value show whether those at the ends fit.
    head, tail = values[half + 2 : 2 : -1], values[-4 : -4 - half : -1]
    padded = np.concatenate((2.0 * values[1] - head, values, 2.0 * values[-2] - tail))
    windows = np.lib.stride_tricks.sliding_window_view(padded, _NEIGHBOURS, axis=0)
    others = np.delete(windows, half, axis=-1)
    deviation = np.abs(values - np.median(others, axis=-1))
    median_deviation = np.maximum(np.median(deviation, axis=0), 1e-9 * np.abs(values).max(axis=0))
    regular: NDArray[np.bool_] = (deviation <= _OUTLIER * median_deviation).all(axis=1)
    if regular.mean() < 1.0 - _OUTLIERS_MOST:
        return np.ones(len(values), dtype=np.bool_)
    return regular


def _reconstruct_motion_from_attitudes(t: Array, q: Array) -> MotionSamples:
    """Reconstruct a motion, computing each angular velocity from two well-separated attitudes."""

    def find_turns(stride: int) -> Array:
        return compute_rotation_vectors(
            multiply_quaternions(conjugate_quaternions(q[:-stride]), q[stride:])
        )

    angle = float(np.median(np.linalg.norm(find_turns(1), axis=1)))
    stride = min(max(round(_TURN / max(angle, 1e-9)), 1), len(t) // 4)
    turns = find_turns(stride)
    rate = turns / (t[stride:] - t[:-stride])[:, None]
    halfway = multiply_quaternions(q[:-stride], compute_rotation_quaternions(0.5 * turns))
    return MotionSamples(0.5 * (t[stride:] + t[:-stride]), halfway, rate, "attitude")


def _integrate_angular_velocity(t: Array, rate: Array, first: Array, is_in_space: bool) -> Array:
    """Integrate angular velocities to obtain attitudes, starting from the attitude `first`."""
    attitudes = np.empty((len(t), 4))
    attitudes[0] = first
    attitudes[1:] = compute_rotation_quaternions(0.5 * np.diff(t)[:, None] * (rate[1:] + rate[:-1]))
    shift = 1
    while shift < len(t):  # products of 2, 4, 8, ... neighbours
        ends = attitudes[:-shift], attitudes[shift:]
        attitudes[shift:] = multiply_quaternions(*(ends[::-1] if is_in_space else ends))
        shift *= 2
    return attitudes


def interpolate_motion(motion: MotionSamples, t: float) -> tuple[Array, Array]:
    k = min(max(int(np.searchsorted(motion.t, t)), 1), len(motion.t) - 1)
    k -= int(t - motion.t[k - 1] < motion.t[k] - t)
    window = slice(max(k - 2, 0), k + 3)
    rate = motion.rate[window].mean(axis=0)
    turn = compute_rotation_quaternions((t - motion.t[k]) * rate)
    return multiply_quaternions(motion.attitude[k], turn), rate


_LEAST = 1e-3  # least density of a guess, relative to its largest moment
_SMOOTHING = 9  # samples of the local cubic that smooths a trace
_STOPPED = 0.05  # spin that friction has nearly stopped, relative to the largest
_EPSILON = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _EPSILON[_i, _j, _k], _EPSILON[_i, _k, _j] = 1.0, -1.0


class Guess(NamedTuple):
    """An initial guess of the parameters, and the measured motion from which it was computed.

    The attitudes of the motion are from the principal axes of the point to space.
    """

    point: FitPoint
    motion: MotionSamples | None


class _LinearBodyEstimates(NamedTuple):
    """Solution of the momentum equation; all fields but `vertical` share one unknown factor."""

    inertia: Array
    lever: Array  # mass gravity com
    vertical: Array
    damping: float
    friction: float


def guess_parameters_from_records(
    parameters: FreeParameters, records: Sequence[Record]
) -> list[Guess]:
    """Compute initial guesses of the free parameters from the measurements in the records.

    Returns an empty list if the motion cannot be reconstructed from the records.
    """
    base = parameters.start
    guesses: list[Guess] = []
    for motion in reconstruct_motions(records, base)[:2]:
        guesses += _guess_parameters_from_motion(parameters, motion)
    trace = None if guesses else _find_apex_trace(records, base)
    return guesses if trace is None else _guess_parameters_from_apex(parameters, trace)


def yield_random_starts(
    parameters: FreeParameters, records: Sequence[Record]
) -> Iterator[FitPoint]:
    """Yield random initial states of the given body that agree with the first measured values.

    If the momentum m is measured, its rate M g e3 x a gives the horizontal part of a, the vector to
    the centre of mass. If the apex is measured, its velocity gives the angular velocity across the
    apex. All else is random.
    """
    base, generator = parameters.start, np.random.default_rng(0)
    torque = abs(base.gravity_force) * float(np.linalg.norm(base.com))
    size = float(np.linalg.norm(base.rate)) + np.sqrt(torque / float(base.moments.max()))
    axis = _compute_friction_axis(base)
    back = conjugate_quaternions(compute_rotations_from_vertical(axis))
    known = _find_first_measured_states(records, base)
    while True:
        turn = normalize_quaternion(generator.normal(size=4))
        rate, t = size * generator.normal(size=3), 0.0
        if known:
            t, apex, change, momentum = known[int(generator.integers(len(known)))]
            about_axis = compute_rotation_quaternions(generator.uniform(0.0, 2.0 * np.pi) * axis)
            tilt = multiply_quaternions(compute_rotations_from_vertical(apex), back)
            turn = multiply_quaternions(tilt, about_axis)
            rotation = rotation_matrix(turn)
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
    lever, first = base.gravity_force * base.com, _SMOOTHING // 2
    momenta = _find_momentum_trace(records) if lever.any() else None
    if momenta is not None:
        m, change = (values[first] for values in _smooth_by_local_cubics(*momenta))
        t = float(momenta.t[first])
        weight = base.mass * float(base.compute_effective_gravity(np.array(t)))
        torque = change + np.cross(base.turning, m)
        flat = np.array((torque[1], -torque[0], 0.0)) / weight / np.linalg.norm(base.com)
        height = np.sqrt(max(1.0 - float(flat @ flat), 0.0))
        tops = [flat + np.array((0.0, 0.0, sign * height)) for sign in (1.0, -1.0)]
        return [(t, top / np.linalg.norm(top), np.zeros(3), m) for top in tops]
    trace = _find_apex_trace(records, base) if base.com.any() else None
    if trace is not None:
        e, change = (values[first] for values in _smooth_by_local_cubics(*trace))
        return [(float(trace.t[first]), e / np.linalg.norm(e), change, None)]
    return []


def _guess_parameters_from_motion(parameters: FreeParameters, motion: MotionSamples) -> list[Guess]:
    """Compute a guess from the momentum equation, or none if it cannot be solved."""
    base, part = parameters.start, motion
    is_heavy = base.gravity_force != 0.0 and bool(base.com.any() or parameters.can_vary("com"))
    is_rubbed = part.source != "space" and (parameters.can_vary("friction") or base.friction > 0.0)
    if is_rubbed:
        spin = np.abs(part.rate @ _compute_friction_axis(base))
        stopped = np.flatnonzero(spin < _STOPPED * spin.max())
        if stopped.size and stopped[0] >= FEWEST:
            t, attitude, rate = (x[: stopped[0]] for x in motion[:3])
            part = MotionSamples(t, attitude, rate, motion.source, motion.is_at_rest)
    is_damped = bool(parameters.can_vary("damping") or base.damping.any())
    solution = _fit_momentum_equation(part, base, is_heavy, is_damped, is_rubbed)
    if solution is None:
        return []
    turn, first, v = UNTURNED, UNTURNED, solution.vertical
    if motion.source == "space":  # the axes of the motion are not the principal axes
        turn = convert_matrix_to_quaternion(_orient_principal_axes_like_scene(solution, base))
    if motion.source == "gyroscope":  # which does not tell (com, vertical) from (-com, -vertical)
        if (solution.lever @ base.com) * base.gravity_force < 0.0:
            solution, v = solution._replace(lever=-solution.lever), -v
        east = np.cross(np.eye(3)[np.abs(v).argmin()], v)
        east /= np.linalg.norm(east)
        first = convert_matrix_to_quaternion(np.stack((east, np.cross(v, east), v)))
    rotation = rotation_matrix(turn)
    moments = np.diag(rotation.T @ solution.inertia @ rotation).copy()
    t, rate = motion.t, motion.rate @ rotation
    attitude = multiply_quaternions(multiply_quaternions(first, motion.attitude), turn)
    if motion.is_at_rest:  # the support coincides with the inertial frame at the first sample
        rotations = compute_rotation_quaternions((t[0] - t)[:, None] * base.turning)
        attitude = multiply_quaternions(rotations, attitude)
        rate = rate - base.turning @ rotation_matrix(attitude)
    point = _set_free_body_parameters(parameters, moments, rotation.T @ solution.lever, solution)
    mean = rate[:3].mean(axis=0)
    start = _find_parameters_through_state(parameters, point, t[0], attitude[0], mean)
    return [Guess(start, MotionSamples(t, attitude, rate, motion.source))]


def _compute_friction_axis(base: FitPoint) -> Array:
    length = float(np.linalg.norm(base.com))
    axis: Array = base.com / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    return axis


def _set_free_body_parameters(
    parameters: FreeParameters, moments: Array, lever: Array, losses: _LinearBodyEstimates | None
) -> FitPoint:
    """Return the scene's parameters, with the free parameters of the body replaced by estimates."""
    base, can_vary = parameters.start, parameters.can_vary
    densities = 0.5 * moments.sum() - moments
    densities = np.maximum(densities, _LEAST * np.abs(moments).max())
    factor = base.moments.sum() / (2.0 * densities.sum())
    torque = base.gravity_force * float(np.linalg.norm(base.com))
    lever_size = float(np.linalg.norm(lever))
    fields: dict[str, Any] = {}
    if can_vary("moments"):
        if lever_size > 0.0 and torque and not can_vary("com"):  # the torque gives the scale
            factor = abs(torque) / lever_size
        mean = parameters.columns["moments"] @ parameters.average_tied("moments", densities)
        fields["densities"] = factor * mean
    if base.gravity_force and lever_size > 0.0 and can_vary("com"):
        fields["com"] = factor * lever / base.gravity_force
    if can_vary("damping"):
        drag = 0.0 if losses is None else losses.damping
        fields["damping"] = np.full(3, max(factor * drag, 0.0))
    if can_vary("friction") and losses is not None:
        fields["friction"] = max(factor * losses.friction, 0.0)
    return replace(base, **fields)


def _find_parameters_through_state(
    parameters: FreeParameters, point: FitPoint, time: float, attitude: Array, rate: Array
) -> FitPoint:
    """Return the parameters for which the motion passes through a given state at `time`."""
    names = [name for name in ("attitude", "velocity") if parameters.can_vary(name)]

    def start_at(attitude: Array, rate: Array) -> FitPoint:
        fields: dict[str, Any] = {"attitude": attitude, "rate": rate}
        return replace(point, **{BLOCKS[name].field: fields[BLOCKS[name].field] for name in names})

    trial = start_at(attitude, rate)
    if time != 0.0:
        with suppress(Error, ValueError):
            path = solve(trial.to_scene(time), [-time], "taylor", max_steps=10000)
            q, m = path.q[0], path.m[0]
            return start_at(q, trial.relative_angular_velocity(q, m))
    return trial


def _fit_momentum_equation(
    motion: MotionSamples, base: FitPoint, is_heavy: bool, is_damped: bool, is_rubbed: bool
) -> _LinearBodyEstimates | None:
    """Solve the momentum equation using the singular vector of the smallest singular value.

    The momentum minus the integrals of the torques is constant. Returns None if there are too few
    samples, or if the body has a rotor and its principal axes are unknown.
    """
    rotor, is_full, is_free = base.rotor, motion.source == "space", motion.source == "gyroscope"
    if rotor.any() and is_full:
        return None
    t, rotation, turning = motion.t, rotation_matrix(motion.attitude), base.turning
    if motion.is_at_rest or is_free:
        turning = np.zeros(3)
    elif motion.source == "vertical":
        turning = turning * np.array([0.0, 0.0, 1.0])
    rate = motion.rate + turning @ rotation
    momenta = [rotation @ _build_inertia_to_momentum_matrices(rate, is_full)]
    momenta += [(rotation @ rotor)[:, :, None]] if rotor.any() else []
    columns = [one + cross_matrix(turning) @ _integrate_by_trapezoids(t, one) for one in momenta]
    columns.append(-np.broadcast_to(np.eye(3), rotation.shape))
    if is_heavy:
        weight = base.compute_effective_gravity(t) / base.gravity
        integral = _integrate_by_trapezoids(t, weight[:, None, None] * rotation)
        columns.append(
            -np.einsum("ikj,njl->nikl", _EPSILON, integral).reshape(len(t), 3, 9)
            if is_free
            else -cross_matrix(np.array([0.0, 0.0, 1.0])) @ integral
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
    inertia = np.diag(solution[:3])
    if is_full:
        inertia[(1, 2, 0), (2, 0, 1)] = inertia[(2, 0, 1), (1, 2, 0)] = solution[3:6]
    sign = np.sign(np.trace(inertia))
    if not sign:
        return None
    rest = sign * solution[9 if is_full else 6 :]  # after the constant momentum
    lever, vertical = np.zeros(3), np.array([0.0, 0.0, 1.0])
    if is_heavy and is_free:
        left, products, right = np.linalg.svd(rest[:9].reshape(3, 3))
        lever, vertical = products[0] * right[0], left[:, 0]
    elif is_heavy:
        lever = rest[:3]
    friction = float(rest[-1]) if is_rubbed else 0.0
    damping = float(rest[-1 - is_rubbed]) if is_damped else 0.0
    return _LinearBodyEstimates(sign * inertia, lever, vertical, damping, friction)


def _build_inertia_to_momentum_matrices(rate: Array, is_full: bool) -> Array:
    """Return (n, 3, k) matrices that map the k independent elements of the tensor J to J W."""
    matrices = np.zeros((len(rate), 3, 6 if is_full else 3))
    for k in range(3):
        matrices[:, k, k] = rate[:, k]
    if is_full:
        for column, (a, b) in zip((3, 4, 5), ((1, 2), (2, 0), (0, 1)), strict=True):
            matrices[:, a, column], matrices[:, b, column] = rate[:, b], rate[:, a]
    return matrices


def _integrate_by_trapezoids(t: Array, values: Array) -> Array:
    steps = np.diff(t).reshape(-1, *[1] * (values.ndim - 1))
    integrals = np.zeros_like(values)
    np.cumsum(0.5 * steps * (values[1:] + values[:-1]), axis=0, out=integrals[1:])
    return integrals


def _orient_principal_axes_like_scene(solution: _LinearBodyEstimates, base: FitPoint) -> Array:
    """Return the principal axes of a solution as columns, in the order of the scene's moments.

    The signs of the axes are chosen so that the estimated centre of mass agrees best with that of
    the scene.
    """
    _, axes = np.linalg.eigh(solution.inertia)
    frame = np.empty((3, 3))
    frame[:, np.argsort(base.moments, kind="stable")] = axes
    frames = [frame * np.array(signs) for signs in itertools.product((1.0, -1.0), repeat=3)]
    lever = solution.lever * np.sign(base.gravity_force)
    return max(
        (one for one in frames if np.linalg.det(one) > 0.0), key=lambda one: lever @ one @ base.com
    )


def _guess_parameters_from_apex(parameters: FreeParameters, trace: Trace) -> list[Guess]:
    """Compute guesses from apex directions, assuming that the body is symmetric about its apex.

    The momentum equation is linear in a = I3 s / I1 for the spin s, in k = M g |c| / I1, in the
    initial momentum, and in the loss of a by friction.
    """
    base = parameters.start
    if not base.com.any() or len(trace.t) <= _SMOOTHING:
        return []
    apex, change = _smooth_by_local_cubics(*trace)
    t, turning = trace.t, base.turning
    transverse_rate = np.cross(apex, change + np.cross(turning, apex))
    rhs = transverse_rate + np.cross(turning, _integrate_by_trapezoids(t, transverse_rate))
    apex_integral = _integrate_by_trapezoids(t, apex)
    axial_column = apex + np.cross(turning, apex_integral)
    weight = base.compute_effective_gravity(t) / base.gravity if base.gravity else np.ones(len(t))
    integral = _integrate_by_trapezoids(t, weight[:, None] * np.cross([0.0, 0.0, 1.0], apex))
    identity = np.broadcast_to(np.eye(3), (len(apex), 3, 3))
    columns = [-axial_column[:, :, None], integral[:, :, None], identity]
    if parameters.can_vary("friction") or base.friction:
        weighted = (t - t[0])[:, None] * apex
        weighted += np.cross(turning, _integrate_by_trapezoids(t, weighted))
        columns.append((weighted - apex_integral)[:, :, None])
    matrix = np.concatenate(columns, axis=2)
    solution = np.linalg.lstsq(matrix.reshape(-1, matrix.shape[2]), rhs.ravel(), rcond=None)[0]
    a, k, slowing = float(solution[0]), float(solution[1]), float([*solution, 0.0][5])
    axis = base.com / np.linalg.norm(base.com)
    i3 = float(axis @ (base.moments * axis))
    i1 = 0.5 * (base.moments.sum() - i3)
    torque = base.gravity_force * float(np.linalg.norm(base.com))
    if parameters.can_vary("moments") and torque * k > 0.0:
        i1 = torque / k
        i3 = min(i3, 1.9 * i1)
    moments = i3 * axis**2 + i1 * (1.0 - axis**2)
    point = _set_free_body_parameters(parameters, moments, base.gravity_force * base.com, None)
    i3, i1 = float(axis @ (point.moments * axis)), float(i1)
    turn = compute_rotations_from_vertical(axis)
    tilts = compute_rotations_from_vertical(apex / np.linalg.norm(apex, axis=1)[:, None])
    attitude = multiply_quaternions(tilts, conjugate_quaternions(turn)[None])
    spin = (a * i1 - float(axis @ base.rotor)) / i3 - float(base.turning @ apex[0])
    if parameters.can_vary("friction"):
        point = replace(point, friction=max(i1 * slowing * np.sign(spin), 0.0))
    spin_loss = point.friction / i3 * (t - t[0])
    spins = np.copysign(np.maximum(abs(spin) - spin_loss, 0.0), spin)
    velocity = np.cross(apex, change) + spins[:, None] * apex
    rate = (velocity[:, None, :] @ rotation_matrix(attitude))[:, 0]
    motion = MotionSamples(t, attitude, rate, "apex")
    start = _find_parameters_through_state(parameters, point, t[0], attitude[0], rate[0])
    return [Guess(start, motion)]


def _smooth_by_local_cubics(t: Array, values: Array) -> tuple[Array, Array]:
    """Smooth vectors at evenly spaced times by local cubic fits; return values and derivatives.

    Source: Savitzky and Golay, Analytical Chemistry 36 (1964) 1627.
    """
    half = _SMOOTHING // 2
    offsets = np.arange(-half, half + 1.0)
    weights = np.linalg.pinv(np.vander(offsets, 4, increasing=True))
    padded = np.concatenate(
        (
            2.0 * values[:1] - values[half:0:-1],
            values,
            2.0 * values[-1:] - values[-2 : -half - 2 : -1],
        )
    )
    windows = np.lib.stride_tricks.sliding_window_view(padded, _SMOOTHING, axis=0)
    step = (t[-1] - t[0]) / (len(t) - 1)
    return windows @ weights[0], windows @ weights[1] / step
