"""First guesses of a fit from the records."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._results.path import Error
from .._solve.solve import solve
from .._utils.arguments import Array
from .parameters import (
    FitPoint,
    FreeParameters,
    compute_rotation_quaternions,
    compute_rotation_vectors,
    compute_rotations_from_vertical,
    conjugate_quaternions,
    convert_matrix_to_quaternion,
    convert_scene_to_fit_point,
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

    def select_first_samples(self, count: int) -> MotionSamples:
        """Return the first `count` samples of the motion."""
        t, attitude, rate = self.t[:count], self.attitude[:count], self.rate[:count]
        return self._replace(t=t, attitude=attitude, rate=rate)


class ApexSamples(NamedTuple):
    """The directions of the apex at n evenly spaced times, as an array of shape (n, 3)."""

    t: Array
    apex: Array


def reconstruct_motions(records: Sequence[Record], point: FitPoint) -> list[MotionSamples]:
    """Return the motions reconstructed from the records, those with known attitudes first."""
    rotation = rotation_matrix(point.axes)
    motions: list[MotionSamples] = []
    for record in records:
        table = {s.quantity: s for s in record.series if s.part is None}
        if "q" in table:
            t, q = _select_longest_gapless_samples(record.t, table["q"])
            motions += _reconstruct_motion_from_attitudes(
                t, multiply_quaternions(q, point.axes[None])
            )
        for name in ("body_velocity", "inertial_velocity"):
            if name not in table:
                continue
            t, w = _select_longest_gapless_samples(record.t, table[name])
            vertical = table.get("body_vertical")
            first = (
                _find_measured_vertical_near_time(record.t, vertical, t)
                if vertical is not None and len(t)
                else None
            )
            reconstructions = _reconstruct_motion_from_gyroscope(
                t, w @ rotation, None if first is None else first @ rotation
            )
            is_at_rest = name == "inertial_velocity" and point.is_support_turning
            motions += [motion._replace(is_at_rest=is_at_rest) for motion in reconstructions]
        if "velocity" in table:
            t, w = _select_longest_gapless_samples(record.t, table["velocity"])
            motions += _reconstruct_motion_from_velocity(t, w)
    order = ("attitude", "vertical", "space", "gyroscope")
    return sorted(motions, key=lambda motion: order.index(motion.source))


def compute_momentum_samples(records: Sequence[Record]) -> list[tuple[Array, Array]]:
    """Return evenly spaced times and momenta of each record that contains enough momenta."""
    samples = []
    for record in records:
        for series in record.series:
            t, m = _select_longest_gapless_samples(record.t, series)
            if series.name == "m" and len(t) > FEWEST:
                grid = np.linspace(t[0], t[-1], len(t))
                samples.append((grid, np.stack([np.interp(grid, t, x) for x in m.T], axis=1)))
    return samples


def compute_apex_samples(records: Sequence[Record], point: FitPoint) -> list[ApexSamples]:
    """Extract the trace of the apex from each record that contains apex directions."""
    samples = []
    for record in records:
        directions = _compute_measured_apex_directions(record, point)
        if directions is not None:
            t, apex = directions
            grid = np.linspace(t[0], t[-1], len(t))
            apex = np.stack([np.interp(grid, t, apex[:, k]) for k in range(3)], axis=1)
            samples.append(ApexSamples(grid, apex / np.linalg.norm(apex, axis=1)[:, None]))
    return samples


def _compute_measured_apex_directions(
    record: Record, point: FitPoint
) -> tuple[Array, Array] | None:
    table = {s.name: s for s in record.series}
    if "apex" in table:
        t, e = _select_longest_gapless_samples(record.t, table["apex"])
    elif {"apex_x", "apex_y"} <= table.keys():
        is_measured = table["apex_x"].measured & table["apex_y"].measured
        t = record.t[is_measured[:, 0]]
        x, y = (table[name].values[is_measured[:, 0], 0] for name in ("apex_x", "apex_y"))
        side = np.sign((rotation_matrix(point.attitude) @ point.com)[2]) or 1.0
        e = np.stack((x, y, side * np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))), axis=1)
    elif {"nutation", "precession_angle"} <= table.keys():
        is_measured = table["nutation"].measured & table["precession_angle"].measured
        t = record.t[is_measured[:, 0]]
        tilt, turn = (
            table[n].values[is_measured[:, 0], 0] for n in ("nutation", "precession_angle")
        )
        e = np.stack(
            (np.sin(tilt) * np.sin(turn), -np.sin(tilt) * np.cos(turn), np.cos(tilt)), axis=1
        )
    else:
        return None
    t, first = np.unique(t, return_index=True)
    e = e[first]
    if len(t) >= FEWEST:
        regular = _compute_inlier_mask(e, is_attitude=False)
        t, e = t[regular], e[regular]
    return (t, e) if len(t) >= FEWEST else None


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


def _reconstruct_motion_from_attitudes(t: Array, q: Array) -> list[MotionSamples]:
    """Reconstruct a motion, computing each angular velocity from two well-separated attitudes."""
    if len(t) < FEWEST:
        return []
    angle = np.median(
        np.linalg.norm(compute_rotation_vectors(_compute_relative_rotations(q, 1)), axis=1)
    )
    stride = min(max(round(_TURN / max(float(angle), 1e-9)), 1), len(t) // 4)
    turns = compute_rotation_vectors(_compute_relative_rotations(q, stride))
    rate = turns / (t[stride:] - t[:-stride])[:, None]
    middle = 0.5 * (t[stride:] + t[:-stride])
    halfway = multiply_quaternions(q[:-stride], compute_rotation_quaternions(0.5 * turns))
    return [MotionSamples(middle, halfway, rate, "attitude")]


def _compute_relative_rotations(q: Array, stride: int) -> Array:
    """Return the rotation from each attitude to the attitude `stride` rows later."""
    return multiply_quaternions(conjugate_quaternions(q[:-stride]), q[stride:])


def _reconstruct_motion_from_gyroscope(
    t: Array, rate: Array, vertical: Array | None
) -> list[MotionSamples]:
    if len(t) < FEWEST:
        return []
    first = np.array([1.0, 0.0, 0.0, 0.0])
    if vertical is not None:
        first = conjugate_quaternions(
            compute_rotations_from_vertical(vertical / np.linalg.norm(vertical))
        )
    attitude = _integrate_angular_velocity(t, rate, first, False)
    source = "gyroscope" if vertical is None else "vertical"
    return [MotionSamples(t, attitude, rate, source)]


def _find_measured_vertical_near_time(t: Array, series: Series, times: Array) -> Array | None:
    """Return the measured vertical nearest in time to `times[0]`, or None if there is none."""
    indices = np.flatnonzero(series.measured.all(axis=1))
    if not indices.size:
        return None
    index = indices[np.abs(t[indices] - times[0]).argmin()]
    vertical: Array = series.values[index]
    return vertical if np.linalg.norm(vertical) > 0.0 else None


def _reconstruct_motion_from_velocity(t: Array, velocity: Array) -> list[MotionSamples]:
    if len(t) < FEWEST:
        return []
    attitude = _integrate_angular_velocity(t, velocity, np.array([1.0, 0.0, 0.0, 0.0]), True)
    rate = (velocity[:, None, :] @ rotation_matrix(attitude))[:, 0]
    return [MotionSamples(t, attitude, rate, "space")]


def _integrate_angular_velocity(t: Array, rate: Array, first: Array, is_in_space: bool) -> Array:
    """Integrate angular velocities to obtain attitudes, starting from the attitude `first`."""
    attitudes = np.empty((len(t), 4))
    attitudes[0] = first
    attitudes[1:] = compute_rotation_quaternions(0.5 * np.diff(t)[:, None] * (rate[1:] + rate[:-1]))
    shift = 1
    while shift < len(t):  # products of 2, 4, 8, ... neighbours
        ends = (
            (attitudes[shift:], attitudes[:-shift])
            if is_in_space
            else (attitudes[:-shift], attitudes[shift:])
        )
        attitudes[shift:] = multiply_quaternions(*ends)
        shift *= 2
    return attitudes


def interpolate_motion(motion: MotionSamples, t: float) -> tuple[Array, Array]:
    """Return the attitude and the angular velocity of a motion at the time t."""
    k = min(max(int(np.searchsorted(motion.t, t)), 1), len(motion.t) - 1)
    k -= int(t - motion.t[k - 1] < motion.t[k] - t)
    window = slice(max(k - 2, 0), k + 3)
    rate = motion.rate[window].mean(axis=0)
    turn = compute_rotation_quaternions((t - motion.t[k]) * rate)
    return multiply_quaternions(motion.attitude[k], turn), rate


_LEAST = 1e-3  # least density of a guess, relative to its largest moment
_SMOOTHING = 9  # samples of the local cubic that smooths a trace
_PADDING = 4  # length of a Fourier transform, relative to the data
_LINES = 3  # frequencies of nutation that are tried
_STOPPED = 0.05  # spin that friction has nearly stopped, relative to the largest
_SHORT = 4  # number of samples, relative to that of the shorter guess
_EPSILON = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _EPSILON[_i, _j, _k], _EPSILON[_i, _k, _j] = 1.0, -1.0


class Guess(NamedTuple):
    """An initial guess of the parameters, and the measured motion from which it was computed.

    motion   its attitudes are from the principal axes of the point to space
    allowed  (size, size) projection on the changes to which a first search is confined, or None
    """

    point: FitPoint
    motion: MotionSamples | None
    allowed: Array | None = None


class _LinearBodyEstimates(NamedTuple):
    """Solution of the momentum equation; all fields but `vertical` share one unknown factor."""

    inertia: Array
    lever: Array  # mass gravity com
    vertical: Array
    damping: float
    friction: float


class _EnergyLossFlags(NamedTuple):
    """The types of energy loss that are included in the momentum equation."""

    is_damped: bool
    is_rubbed: bool


def guess_parameters_from_records(
    parameters: FreeParameters, records: Sequence[Record]
) -> list[Guess]:
    """Compute initial guesses of the free parameters from the measurements in the records.

    Returns an empty list if the motion cannot be reconstructed from the records.
    """
    base = parameters.start
    guesses: list[Guess] = []
    for motion in reconstruct_motions(records, base)[:2]:
        for count in {len(motion.t), max(len(motion.t) // _SHORT, min(len(motion.t), 40))}:
            guesses += _guess_parameters_from_motion(
                parameters, motion, motion.select_first_samples(count)
            )
    if not guesses:
        for trace in compute_apex_samples(records, base)[:1]:
            guesses += _guess_parameters_from_apex(parameters, trace)
    return guesses


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
    lever = base.gravity_force * base.com
    first = _SMOOTHING // 2
    for times, momenta in compute_momentum_samples(records) if lever.any() else []:
        m, change = (values[first] for values in _smooth_by_local_cubics(times, momenta))
        t = float(times[first])
        weight = base.mass * float(base.compute_effective_gravity(np.array(t)))
        torque = change + np.cross(base.turning, m)
        flat = np.array((torque[1], -torque[0], 0.0)) / weight / np.linalg.norm(base.com)
        height = np.sqrt(max(1.0 - float(flat @ flat), 0.0))
        tops = [flat + np.array((0.0, 0.0, sign * height)) for sign in (1.0, -1.0)]
        return [(t, top / np.linalg.norm(top), np.zeros(3), m) for top in tops]
    for trace in compute_apex_samples(records, base)[:1] if base.com.any() else []:
        e, change = (values[first] for values in _smooth_by_local_cubics(*trace))
        return [(float(trace.t[first]), e / np.linalg.norm(e), change, None)]
    return []


def _guess_parameters_from_motion(
    parameters: FreeParameters, motion: MotionSamples, part: MotionSamples
) -> list[Guess]:
    base = parameters.start
    is_heavy = base.gravity_force != 0.0 and bool(base.com.any() or parameters.can_vary("com"))
    axis = _compute_friction_axis(base)
    is_rubbed = part.source != "space" and (parameters.can_vary("friction") or base.friction > 0.0)
    if is_rubbed:
        part = _select_samples_before_spin_stops(part, axis)
    is_damped = bool(parameters.can_vary("damping") or base.damping.any())
    losses = _EnergyLossFlags(is_damped, is_rubbed)
    solution = _fit_momentum_equation(part, base, is_heavy, losses)
    if solution is None:
        return []
    twins = [solution]
    if part.source == "gyroscope" and is_heavy:
        twins.append(solution._replace(lever=-solution.lever, vertical=-solution.vertical))
        if (solution.lever @ base.com) * base.gravity_force < 0.0:
            twins.reverse()
        if base.com.any():
            twins = twins[:1]
    return [_make_guess_from_linear_solution(parameters, motion, one) for one in twins]


def _make_guess_from_linear_solution(
    parameters: FreeParameters, motion: MotionSamples, solution: _LinearBodyEstimates
) -> Guess:
    turn = np.array([1.0, 0.0, 0.0, 0.0])  # from the axes of the motion to the principal axes
    if motion.source == "space":
        turn = convert_matrix_to_quaternion(
            _orient_principal_axes_like_scene(solution, parameters.start)
        )
    rotation = rotation_matrix(turn)
    moments = np.diag(rotation.T @ solution.inertia @ rotation).copy()
    lever = rotation.T @ solution.lever
    first = np.array([1.0, 0.0, 0.0, 0.0])
    if motion.source == "gyroscope":
        first = convert_matrix_to_quaternion(_build_frame_from_vertical(solution.vertical))
    attitude = multiply_quaternions(multiply_quaternions(first, motion.attitude), turn)
    samples = motion._replace(attitude=attitude, rate=motion.rate @ rotation)
    if motion.is_at_rest:
        samples = _transform_motion_to_support_frame(samples, parameters.start.turning)
    point = _set_free_body_parameters(parameters, moments, lever, solution)
    rate = samples.rate[:3].mean(axis=0)
    return Guess(
        _find_parameters_through_state(parameters, point, samples.t[0], samples.attitude[0], rate),
        samples,
    )


def _transform_motion_to_support_frame(motion: MotionSamples, turning: Array) -> MotionSamples:
    """Return the motion relative to a support that initially coincides with the inertial frame."""
    rotations = compute_rotation_quaternions((motion.t[0] - motion.t)[:, None] * turning)
    attitude = multiply_quaternions(rotations, motion.attitude)
    rate = motion.rate - turning @ rotation_matrix(attitude)
    return motion._replace(attitude=attitude, rate=rate, is_at_rest=False)


def _compute_friction_axis(base: FitPoint) -> Array:
    length = float(np.linalg.norm(base.com))
    axis: Array = base.com / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    return axis


def _select_samples_before_spin_stops(motion: MotionSamples, axis: Array) -> MotionSamples:
    """Return the samples of a motion up to the time at which its spin about `axis` nearly stops."""
    spin = np.abs(motion.rate @ axis)
    indices = np.flatnonzero(spin < _STOPPED * spin.max())
    return (
        motion.select_first_samples(int(indices[0]))
        if indices.size and indices[0] >= FEWEST
        else motion
    )


def _set_free_body_parameters(
    parameters: FreeParameters, moments: Array, lever: Array, losses: _LinearBodyEstimates | None
) -> FitPoint:
    """Return the scene's parameters, with the free parameters of the body replaced by estimates."""
    base = parameters.start
    densities = 0.5 * moments.sum() - moments
    densities = np.maximum(densities, _LEAST * np.abs(moments).max())
    size, lever_size = float(np.linalg.norm(base.com)), float(np.linalg.norm(lever))
    is_size_known = (
        lever_size > 0.0 and base.gravity_force != 0.0 and not parameters.can_vary("com")
    )
    factor = base.moments.sum() / (2.0 * densities.sum())
    if is_size_known and size > 0.0:
        factor = abs(base.gravity_force) * size / lever_size
    changes: dict[str, Array | float] = {}
    if parameters.can_vary("moments"):
        groups = parameters.columns["moments"]
        mean = groups @ (groups.T @ densities / groups.sum(axis=0))
        changes["densities"] = factor * mean
    else:
        factor = base.moments.sum() / (2.0 * densities.sum())
    if base.gravity_force and lever_size > 0.0 and parameters.can_vary("com"):
        changes["com"] = factor * lever / base.gravity_force
    if parameters.can_vary("damping"):
        drag = 0.0 if losses is None else losses.damping
        changes["damping"] = np.full(3, max(factor * drag, 0.0))
    if parameters.can_vary("friction") and losses is not None:
        changes["friction"] = max(factor * losses.friction, 0.0)
    return replace(base, **changes)  # type: ignore[arg-type]


def _find_parameters_through_state(
    parameters: FreeParameters, point: FitPoint, time: float, attitude: Array, rate: Array
) -> FitPoint:
    """Return the parameters for which the motion passes through a given state at `time`."""
    trial = replace(
        point,
        attitude=attitude if parameters.can_vary("attitude") else point.attitude,
        rate=rate if parameters.can_vary("velocity") else point.rate,
    )
    if time == 0.0:
        return trial
    try:
        path = solve(trial.to_scene(time), [-time], "taylor", max_steps=10000)
    except (Error, ValueError):
        return trial
    start = convert_scene_to_fit_point(
        trial.to_scene().replace(momentum=path.m[0], attitude=path.q[0])
    )
    return replace(
        trial,
        attitude=start.attitude if parameters.can_vary("attitude") else trial.attitude,
        rate=start.rate if parameters.can_vary("velocity") else trial.rate,
    )


def _fit_momentum_equation(
    motion: MotionSamples, base: FitPoint, is_heavy: bool, losses: _EnergyLossFlags
) -> _LinearBodyEstimates | None:
    """Solve the momentum equation using the singular vector of the smallest singular value.

    Returns None if there are too few samples, or if the body has a rotor and its principal axes are
    unknown.
    """
    rotor, is_full = base.rotor, motion.source == "space"
    if rotor.any() and is_full:
        return None
    columns = _list_momentum_equation_columns(motion, base, is_heavy, losses)
    matrix = np.concatenate(columns, axis=2).reshape(3 * len(motion.t), -1)
    sizes = np.linalg.norm(matrix, axis=0)
    sizes[sizes == 0.0] = 1.0
    if len(matrix) < matrix.shape[1] or not np.isfinite(matrix).all():
        return None
    normal = (matrix / sizes).T @ (matrix / sizes)
    solution = np.linalg.eigh(normal)[1][:, 0] / sizes
    if rotor.any():
        solution = np.delete(solution, 3)  # the size of the rotor, after three moments
    return _unpack_linear_solution(solution, motion, is_heavy, losses)


def _list_momentum_equation_columns(
    motion: MotionSamples, base: FitPoint, is_heavy: bool, losses: _EnergyLossFlags
) -> list[Array]:
    """Return the columns of the matrix of the momentum equation as arrays of shape (n, 3, k)."""
    t, rotation, rotor = motion.t, rotation_matrix(motion.attitude), base.rotor
    turning = _get_turning_in_momentum_equation(motion, base)
    rate = motion.rate + turning @ rotation
    momenta = [rotation @ _build_inertia_to_momentum_matrices(rate, motion.source == "space")]
    momenta += [(rotation @ rotor)[:, :, None]] if rotor.any() else []
    columns = [one + cross_matrix(turning) @ _integrate_by_trapezoids(t, one) for one in momenta]
    columns.append(-np.broadcast_to(np.eye(3), rotation.shape))
    if is_heavy:
        weight = base.compute_effective_gravity(t) / base.gravity
        integral = _integrate_by_trapezoids(t, weight[:, None, None] * rotation)
        columns.append(
            -cross_matrix(np.array([0.0, 0.0, 1.0])) @ integral
            if motion.source != "gyroscope"
            else -np.einsum("ikj,njl->nikl", _EPSILON, integral).reshape(len(t), 3, 9)
        )
    if losses.is_damped:
        space_rate = (rotation @ motion.rate[:, :, None])[:, :, 0]
        columns.append(_integrate_by_trapezoids(t, space_rate)[:, :, None])
    if losses.is_rubbed:
        axis = _compute_friction_axis(base)
        sense = np.sign(motion.rate @ axis)[:, None]
        columns.append(_integrate_by_trapezoids(t, sense * (rotation @ axis))[:, :, None])
    return columns


def _get_turning_in_momentum_equation(motion: MotionSamples, base: FitPoint) -> Array:
    """Return the part of the support's angular velocity that is used in the momentum equation.

    The returned vector is zero if the motion is described relative to the inertial frame.
    """
    if motion.is_at_rest or motion.source == "gyroscope":
        return np.zeros(3)
    is_upright = motion.source == "vertical"
    return base.turning * np.array([0.0, 0.0, 1.0]) if is_upright else base.turning


def _unpack_linear_solution(
    solution: Array, motion: MotionSamples, is_heavy: bool, losses: _EnergyLossFlags
) -> _LinearBodyEstimates | None:
    is_full = motion.source == "space"
    count = 6 if is_full else 3
    inertia = np.diag(solution[:3])
    if is_full:
        inertia[(1, 2, 0), (2, 0, 1)] = inertia[(2, 0, 1), (1, 2, 0)] = solution[3:6]
    sign = np.sign(np.trace(inertia))
    if not sign:
        return None
    solution, inertia = sign * solution, sign * inertia
    rest = solution[count + 3 :]
    lever, vertical = np.zeros(3), np.array([0.0, 0.0, 1.0])
    if is_heavy and motion.source != "gyroscope":
        lever = rest[:3]
    elif is_heavy:
        left, sizes, right = np.linalg.svd(rest[:9].reshape(3, 3))
        lever, vertical = sizes[0] * right[0], left[:, 0]
    coefficients = rest[len(rest) - sum(losses) :].tolist()
    damping = coefficients.pop(0) if losses.is_damped else 0.0
    return _LinearBodyEstimates(
        inertia, lever, vertical, damping, coefficients[0] if losses.is_rubbed else 0.0
    )


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
    """Integrate sampled values cumulatively by the trapezoidal rule."""
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
    best, best_frame = -np.inf, frame
    for signs in itertools.product((1.0, -1.0), repeat=3):
        candidate = frame * np.array(signs)
        if np.linalg.det(candidate) < 0.0:
            continue
        agreement = float((candidate.T @ solution.lever) @ base.com) * np.sign(base.gravity_force)
        if agreement > best:
            best, best_frame = agreement, candidate
    return best_frame


def _build_frame_from_vertical(vertical: Array) -> Array:
    """Return a rotation matrix whose last row is the unit vector `vertical`."""
    first = np.cross(np.eye(3)[np.abs(vertical).argmin()], vertical)
    first /= np.linalg.norm(first)
    return np.stack((first, np.cross(vertical, first), vertical))


def _guess_parameters_from_apex(parameters: FreeParameters, trace: ApexSamples) -> list[Guess]:
    """Compute guesses from apex directions, assuming that the body is symmetric about its apex."""
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
    slowing = float(solution[5]) if len(solution) > 5 else 0.0
    triples = [(float(solution[0]), float(solution[1]), slowing)]
    triples += [(*pair, 0.0) for pair in _estimate_spin_and_torque_ratios(trace, float(turning[2]))]
    return [
        _guess_from_apex_and_spin(parameters, trace, (apex, change), triple) for triple in triples
    ]


def _estimate_mean_precession_rate(trace: ApexSamples) -> float:
    angle = np.unwrap(np.arctan2(trace.apex[:, 0], -trace.apex[:, 1]))
    return float(np.polyfit(trace.t, angle, 1)[0])


def _estimate_spin_and_torque_ratios(
    trace: ApexSamples, turning: float
) -> list[tuple[float, float]]:
    """Estimate a and k = M g |c| / I1 from the strongest spectral lines of the apex height.

    A small nutation about the steady precession at the rate w and the angle n has the frequency
    sqrt((w sin n)^2 + (a - 2 w cos n)^2), and k = a w - w^2 cos n. The precession rate w is
    measured in the inertial frame.
    """
    height, n, rate = (
        trace.apex[:, 2],
        len(trace.t),
        _estimate_mean_precession_rate(trace) + turning,
    )
    mean = min(max(float(height.mean()), -1.0), 1.0)
    lines = np.abs(np.fft.rfft((height - mean) * np.hanning(n), _PADDING * n))
    lines[: 2 * _PADDING] = 0.0  # slower lines are trends
    is_peak = (lines[1:-1] > lines[:-2]) & (lines[1:-1] >= lines[2:])
    peaks = np.flatnonzero(is_peak) + 1
    peaks = peaks[np.argsort(-lines[peaks])][:_LINES]
    unit = 2.0 * np.pi * (n - 1) / (trace.t[-1] - trace.t[0]) / (_PADDING * n)
    pairs = []
    for frequency in peaks * unit:
        root = np.sqrt(max(frequency**2 - rate**2 * (1.0 - mean**2), 0.0))
        for a in (2.0 * rate * mean + root, 2.0 * rate * mean - root):
            pairs.append((float(a), float(a * rate - rate**2 * mean)))
    return pairs


def _guess_from_apex_and_spin(
    parameters: FreeParameters,
    trace: ApexSamples,
    smoothed: tuple[Array, Array],
    ratios: tuple[float, float, float],
) -> Guess:
    base, (a, k, slowing) = parameters.start, ratios
    axis = base.com / np.linalg.norm(base.com)
    i3 = float(axis @ (base.moments * axis))
    i1 = 0.5 * (base.moments.sum() - i3)
    torque = base.gravity_force * float(np.linalg.norm(base.com))
    if parameters.can_vary("moments") and torque * k > 0.0:
        i1 = torque / k
        i3 = min(i3, 1.9 * i1)
    moments = i3 * axis**2 + i1 * (1.0 - axis**2)
    point = _set_free_body_parameters(parameters, moments, base.gravity_force * base.com, None)
    apex, change = smoothed
    i3, i1 = (float(m) for m in (axis @ (point.moments * axis), i1))
    turn = compute_rotations_from_vertical(axis)
    tilts = compute_rotations_from_vertical(apex / np.linalg.norm(apex, axis=1)[:, None])
    attitude = multiply_quaternions(tilts, conjugate_quaternions(turn)[None])
    spin = (a * i1 - float(axis @ base.rotor)) / i3 - float(base.turning @ apex[0])
    if parameters.can_vary("friction"):
        point = replace(point, friction=max(i1 * slowing * np.sign(spin), 0.0))
    spin_loss = point.friction / i3 * (trace.t - trace.t[0])
    spins = np.copysign(np.maximum(abs(spin) - spin_loss, 0.0), spin)
    velocity = np.cross(apex, change) + spins[:, None] * apex
    rate = (velocity[:, None, :] @ rotation_matrix(attitude))[:, 0]
    motion = MotionSamples(trace.t, attitude, rate, "apex")
    start = _find_parameters_through_state(parameters, point, trace.t[0], attitude[0], rate[0])
    return Guess(start, motion, _build_spin_preserving_projection(parameters, axis))


def _build_spin_preserving_projection(parameters: FreeParameters, axis: Array) -> Array:
    """Return the projection onto changes in initial state and instrument parameters at fixed spin.

    The nutation frequency is known accurately, so it is held fixed while the phase is fitted.
    """
    projection = np.eye(parameters.size)
    for name in parameters.free:
        if name not in ("attitude", "velocity"):
            projection[:, parameters.get_parameter_slice(name)] = 0.0
    if parameters.can_vary("velocity"):
        part = parameters.get_parameter_slice("velocity")
        projection[part, part] -= np.outer(axis, axis)
    return projection


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
