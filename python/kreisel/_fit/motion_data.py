"""Attitudes and angular velocities along a motion, computed from the measurements alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._utils.validation import Array
from .parameters import FitPoint
from .records import Record, Series
from .rotations import (
    compute_rotation_quaternions,
    compute_rotation_vectors,
    compute_rotations_from_vertical,
    conjugate_quaternions,
    multiply_quaternions,
    rotation_matrix,
)

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
