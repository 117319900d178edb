"""The number of turns of a body axis about a fixed direction between successive states.

Let z = sin(nutation) exp(i precession_angle) be the projection of a body axis onto the plane
perpendicular to a fixed direction. At a pole, z = 0 and the axis is parallel or antiparallel to the
fixed direction. Between two states, the projection z moves along an arc in the complex plane. An
arc subtends the same angle at 0 as its chord, unless 0 lies between the arc and the chord. The
distance between an arc and its chord is bounded using the velocities at both endpoints. If the
point 0 may lie between an arc and its chord, the arc is divided at the midpoint of its time
interval.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._results.path import Path
from .._solve.solve import solve
from .._utils.validation import Array

Waves = npt.NDArray[np.complex128]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int64]

THROUGH = 1e-11  # a pass at a smaller distance from a pole [rad] counts as a pass through it
_ROUNDS = 24  # halvings of the time between states, enough for a pass at the distance THROUGH
_SAFETY = 4.0  # a pole must be this many times as far from a chord as the arc can be
_STRAIGHT = 0.1  # largest distance of arc and chord, per length, if an end is a pole


class BodyAxisMotion(NamedTuple):
    """The motion of a body axis relative to a fixed direction.

    z        projection of the axis onto the plane perpendicular to the direction
    rate     time derivative of z
    height   cosine of the angle between axis and direction
    turning  angular velocity of the body about the direction
    own      angular velocity of the body about the axis
    """

    z: Waves
    rate: Waves
    height: Array
    turning: Array
    own: Array


class AngleIncrements(NamedTuple):
    """The angles by which a body turns between n consecutive states.

    precession  (n - 1,) angle by which the axis turns about the direction [rad]
    spin        (n - 1,) angle by which the body turns about the axis [rad]
    through     (n - 1,) number of passes through a pole; the half turn of a pass is not counted
    unknown     (n - 1,) True if the turns between two states cannot be counted
    """

    precession: Array
    spin: Array
    through: Indices
    unknown: Flags


class _ArcsBetweenStates(NamedTuple):
    """Arcs between states.

    `begin` and `end` are measured from the time of the state with index `parent`.
    """

    parent: Indices
    begin: Array
    end: Array
    z0: Waves
    rate0: Waves
    z1: Waves
    rate1: Waves

    def select_arcs(self, mask: Flags) -> _ArcsBetweenStates:
        columns: Any = (column[mask] for column in self)
        return _ArcsBetweenStates(*columns)

    def halve_arcs(self, z: Waves, rate: Waves) -> _ArcsBetweenStates:
        """Split each arc between two states into two arcs at its midpoint in time."""
        middle = 0.5 * (self.begin + self.end)
        first = self._replace(end=middle, z1=z, rate1=rate)
        second = self._replace(begin=middle, z0=z, rate0=rate)
        halves: Any = zip(first, second, strict=True)
        return _ArcsBetweenStates(*map(np.concatenate, halves))


class _ArcAnglesAndChordDistances(NamedTuple):
    """Angles that arcs subtend at the origin, and distances of their chords from the origin.

    `is_known` is True if the number of turns about 0 is certain, so that the angle is unambiguous.
    `through` is 1 if the arc starts at 0 or passes through 0, and 0 otherwise. `distance` is the
    smallest distance of the chord from the origin.
    """

    angle: Array
    is_known: Flags
    through: Indices
    distance: Array


def compute_axis_motion_about_direction(
    path: Path, space_axis: Array, body_axis: Array, east: Array
) -> BodyAxisMotion:
    """Compute the motion of a body axis about a fixed direction.

    `body_axis` contains the components of the body axis along the principal axes, and `space_axis`
    is the fixed direction. The projection of the body axis perpendicular to `space_axis` is a
    complex number, which is real if the body axis lies in the plane of `space_axis` and `east`.
    """
    axis, velocity = body_axis @ path.frame, path.velocity
    return BodyAxisMotion(
        *_project_axis_horizontally(axis, velocity, space_axis, east),
        axis @ space_axis,
        velocity @ space_axis,
        np.asarray((velocity * axis).sum(axis=-1)),
    )


def measure_angle_increments(
    path: Path,
    motion: BodyAxisMotion,
    spin_signal: Waves,
    space_axis: Array,
    body_axis: Array,
    east: Array,
) -> AngleIncrements:
    """Count the turns about the body axis and about a fixed direction between successive states."""
    z, rate, n = motion.z, motion.rate, len(motion.z) - 1
    intervals = np.diff(path.t)
    arcs = _ArcsBetweenStates(
        np.arange(n), np.zeros(n), intervals, z[:-1], rate[:-1], z[1:], rate[1:]
    )
    angle, passes = np.zeros(n), np.zeros(n, dtype=np.int64)
    min_distance, gap = np.full(n, np.inf), np.zeros(n)
    for k in range(_ROUNDS):
        chords = _measure_angles_subtended_at_origin(arcs)
        indices = arcs.parent[chords.is_known]
        np.add.at(angle, indices, chords.angle[chords.is_known])
        np.add.at(passes, indices, chords.through[chords.is_known])
        np.minimum.at(min_distance, indices, chords.distance[chords.is_known])
        arcs = arcs.select_arcs(~chords.is_known)
        if not arcs.parent.size:
            break
        times = np.stack([0.5 * (arcs.begin + arcs.end), arcs.end], axis=1)
        middle, end = _compute_projected_axis_at_times(
            path, arcs.parent, times, space_axis, body_axis, east
        )
        if k == 0:
            i = arcs.parent
            angle[i], passes[i], gap[i] = _compare_with_integration(arcs, end)
            arcs = arcs._replace(z1=end[0], rate1=end[1])
        arcs = arcs.halve_arcs(*middle)
    # The errors of a path add up, so a pass is uncertain if its distance from the pole is less than
    # n gaps. But a pass through a pole to within THROUGH is no coincidence, and is trusted.
    is_beside = np.convolve(passes > 0, np.ones(3), "same") < 0.5
    is_unsure = (is_beside & (min_distance < n * gap)) | ~np.isfinite(gap)
    is_unsure[arcs.parent] = True
    spin_angle = _compute_spin_angle_increments(motion, spin_signal, intervals, angle, passes)
    return AngleIncrements(angle, spin_angle, passes, is_unsure)


def _compare_with_integration(
    arcs: _ArcsBetweenStates, end: tuple[Waves, Waves]
) -> tuple[Array, Indices, Array]:
    """Compare each state of a path with the state obtained by integrating from the previous one.

    For each pair of states, return the angle and the distance between the projections z of the body
    axis onto the complex plane. The second item returned is 1 if the origin (a pole) lies between
    the two projections, and 0 otherwise. The distance is inf if the direction in which the
    projection turns about 0 is uncertain.
    """
    incoming = -(arcs.end - arcs.begin) * arcs.rate1
    z1 = np.where(np.abs(arcs.z1) < THROUGH, incoming, arcs.z1)
    is_on_line = (
        np.maximum(
            _distance_from_origin_to_line(arcs.z1, arcs.rate1),
            _distance_from_origin_to_line(*end),
        )
        < THROUGH
    )
    product, gap = z1 * end[0].conj(), np.abs(arcs.z1 - end[0])
    is_between = is_on_line & (product.real < 0.0)
    is_wide = ~is_on_line & (_SAFETY * gap > np.abs(arcs.z1))
    angle = np.angle(np.where(is_between, -product, product))
    return angle, is_between.astype(np.int64), np.where(is_wide, np.inf, gap)


def _distance_from_origin_to_line(z: Waves, rate: Waves) -> Array:
    """Return the distance of a line in the complex plane from the origin."""
    size = np.abs(rate)
    area: Array = np.abs((z * rate.conj()).imag)
    start: Array = np.abs(z)
    return np.divide(area, size, out=start, where=size > 0.0)


def _compute_spin_angle_increments(
    motion: BodyAxisMotion, spin_signal: Waves, intervals: Array, precession: Array, passes: Indices
) -> Array:
    """Return the angles by which the body turns about the given axis between successive states.

    Near a pole, the spin and precession rates each have a peak, but their sum (or difference) is
    smooth. The number of complete turns is computed from the sum of these rates if the axis points
    upwards, and from their difference otherwise.
    """
    height, turning, own = motion.height, motion.turning, motion.own
    side = np.where(height[:-1] + height[1:] >= 0.0, 1.0, -1.0)
    rates = [
        (own[part] + side * turning[part]) / (1.0 + side * height[part])
        for part in (slice(None, -1), slice(1, None))
    ]
    estimate: Array = 0.5 * intervals * (rates[0] + rates[1]) - side * precession
    measurement = np.angle(spin_signal[1:] * spin_signal[:-1].conj()) + np.pi * passes
    exact = measurement + 2.0 * np.pi * np.rint((estimate - measurement) / (2.0 * np.pi))
    is_seen = np.minimum(np.abs(spin_signal[1:]), np.abs(spin_signal[:-1])) > THROUGH
    return np.where(is_seen, exact, estimate)


def _measure_angles_subtended_at_origin(arcs: _ArcsBetweenStates) -> _ArcAnglesAndChordDistances:
    """Compute each arc's angle about the origin from its chord in a fixed or rotating frame."""
    angle, distance, bend = _measure_chord_angles_and_distances(arcs)
    is_safe_at_rest = distance > _SAFETY * bend
    length = arcs.end - arcs.begin
    pace = 0.5 * (
        _compute_angular_rate_about_origin(arcs.z0, arcs.rate0)
        + _compute_angular_rate_about_origin(arcs.z1, arcs.rate1)
    )
    pace = np.where(np.abs(pace * length) < np.pi, pace, 0.0)
    angle_in_frame, distance_in_frame, bend_in_frame = _measure_chord_angles_and_distances(
        _transform_arcs_to_rotating_frame(arcs, pace)
    )
    is_safe_in_frame = distance_in_frame > _SAFETY * bend_in_frame
    is_pass = (distance < THROUGH) & (bend < THROUGH) & ~is_safe_at_rest
    is_from_pole, is_to_pole = np.abs(arcs.z0) < THROUGH, np.abs(arcs.z1) < THROUGH
    is_pass &= ~is_from_pole & ~is_to_pole
    is_departure = is_from_pole & ~is_to_pole & (bend < _STRAIGHT * np.abs(arcs.z1))
    is_arrival = is_to_pole & ~is_from_pole & (bend < _STRAIGHT * np.abs(arcs.z0))
    angle = np.where(is_safe_in_frame & ~is_safe_at_rest, pace * length + angle_in_frame, angle)
    angle = np.where(is_pass, np.angle(-arcs.z1 * arcs.z0.conj()), angle)
    angle = np.where(is_departure, np.angle(arcs.z1 * (length * arcs.rate0).conj()), angle)
    angle = np.where(is_arrival, np.angle(-length * arcs.rate1 * arcs.z0.conj()), angle)
    is_known = is_safe_at_rest | is_safe_in_frame | is_pass | is_departure | is_arrival
    is_known &= (is_departure | is_arrival) | ~(is_from_pole | is_to_pole)
    # A pass through a pole at a state is counted for the arc that starts there.
    passes = np.asarray(is_pass | is_departure, dtype=np.int64)
    return _ArcAnglesAndChordDistances(
        angle, is_known, passes, np.where(is_safe_at_rest, distance, distance_in_frame)
    )


def _transform_arcs_to_rotating_frame(arcs: _ArcsBetweenStates, pace: Array) -> _ArcsBetweenStates:
    """Transform the arcs to a frame that rotates about the origin with the angular velocity `pace`.

    For each arc, the rotating frame coincides with the fixed frame at the midpoint in time.
    """
    half = np.exp(0.5j * pace * (arcs.end - arcs.begin))
    return arcs._replace(
        z0=arcs.z0 * half,
        rate0=(arcs.rate0 - 1j * pace * arcs.z0) * half,
        z1=arcs.z1 * half.conj(),
        rate1=(arcs.rate1 - 1j * pace * arcs.z1) * half.conj(),
    )


def _measure_chord_angles_and_distances(arcs: _ArcsBetweenStates) -> tuple[Array, Array, Array]:
    """Return the angle that each chord subtends at 0, and its distances from 0 and from its arc.

    The returned distance between a chord and its arc is an upper bound.
    """
    chord, length = arcs.z1 - arcs.z0, arcs.end - arcs.begin
    size = np.abs(chord) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        foot = np.clip(-(arcs.z0 * chord.conj()).real / size, 0.0, 1.0)
    foot = np.where(size > 0.0, foot, 0.0)
    bend = 0.125 * np.abs((arcs.rate1 - arcs.rate0) * length)
    bend += np.abs(chord - 0.5 * length * (arcs.rate0 + arcs.rate1))
    return np.angle(arcs.z1 * arcs.z0.conj()), np.abs(arcs.z0 + foot * chord), bend


def _compute_angular_rate_about_origin(z: Waves, rate: Waves) -> Array:
    """Return the angular velocity of the point z about the origin, or 0 if z is nearly zero."""
    size: Array = np.abs(z) ** 2
    turning: Array = (rate * z.conj()).imag
    return np.divide(turning, size, out=np.zeros(len(size)), where=size > THROUGH**2)


def _compute_projected_axis_at_times(
    path: Path, parent: Indices, times: Array, space_axis: Array, body_axis: Array, east: Array
) -> list[tuple[Waves, Waves]]:
    """Compute the projection of the body axis, and its time derivative, at the given times.

    The times in row i of `times` are relative to the time of the state with index `parent[i]`. If
    the integration from a state fails, the projections in its row are NaN.
    """
    tops = path.scene.vary(attitude=path.q[parent], momentum=path.m[parent])
    result = solve(tops, times)
    axis = body_axis @ result.frame
    z, rate = _project_axis_horizontally(axis, result.velocity, space_axis, east)
    z[result.status != 0] = np.nan
    return [(z[:, k], rate[:, k]) for k in range(times.shape[1])]


def _project_axis_horizontally(
    axis: Array, velocity: Array, space_axis: Array, east: Array
) -> tuple[Waves, Waves]:
    """Return the horizontal projection of an axis and its time derivative as complex numbers."""
    north, change = np.cross(space_axis, east), np.cross(velocity, axis)
    return axis @ east + 1j * (axis @ north), change @ east + 1j * (change @ north)
