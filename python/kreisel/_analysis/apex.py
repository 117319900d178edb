"""The apex: its trace, turning points and turns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._model.parameters import refuse_disturbances
from .._model.scene import Scene
from .._results.path import Path, check_is_one
from .._solve.exact import Exact, exact
from .._solve.solve import solve
from .._utils.arguments import Array, format_count

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
    z[result.status != "OK"] = np.nan
    return [(z[:, k], rate[:, k]) for k in range(times.shape[1])]


def _project_axis_horizontally(
    axis: Array, velocity: Array, space_axis: Array, east: Array
) -> tuple[Waves, Waves]:
    """Return the horizontal projection of an axis and its time derivative as complex numbers."""
    north, change = np.cross(space_axis, east), np.cross(velocity, axis)
    return axis @ east + 1j * (axis @ north), change @ east + 1j * (change @ north)


_LEVEL = 1e-9  # approximate error of the height in a solution with a tolerance of 1e-10
_FEWEST = 4  # states per nutation: with 3 the period can be wrong by 1 %, with 2 by 50 %


class Nutation(NamedTuple):
    """The nutation and precession of a Lagrange top.

    least, greatest  least and greatest nutation, 0 .. pi [rad]
    period           period of the nutation [T]
    precession_rate  mean rate of the apex about the vertical [rad/T]
    """

    least: float
    greatest: float
    period: float
    precession_rate: float


@dataclass(frozen=True, eq=False)
class Apex:
    """The trace of the apex on the unit sphere, sampled at n times.

    t      (n,) times [T]
    trace  (n, 3) unit vectors from the fixed point towards the centre of mass
    rate   (n, 3) time derivatives of these vectors [T^-1]
    scene  the scene of the path
    """

    t: Array
    trace: Array
    rate: Array
    scene: Scene

    def __repr__(self) -> str:
        kind = self.scene.body.kind
        if not len(self.t):
            return f"<kreisel.Apex: no points; kind {kind!r}>"
        span = f"t = {self.t[0]:g} .. {self.t[-1]:g}"
        heights = f"heights {self.height.min():.3g} .. {self.height.max():.3g}"
        points = format_count(len(self.t), "point")
        return f"<kreisel.Apex: {points}, {span}; {heights}; kind {kind!r}>"

    @property
    def height(self) -> Array:
        """(n,) heights <apex, e3>, from -1 to 1."""
        return self.trace[:, 2]

    @cached_property
    def azimuth(self) -> Array:
        """(n,) angles about the vertical, measured from e1, without jumps by whole turns [rad].

        The azimuth of the apex is undefined where the trace passes through the vertical. After each
        passage of the apex through the vertical, the azimuth is known only up to multiples of 2 pi.
        """
        return np.unwrap(np.arctan2(self.trace[:, 1], self.trace[:, 0]))

    def nutation(self) -> Nutation:
        """Return the nutation and precession of a Lagrange top, averaged over complete periods.

        The averages are taken over the interval from the first to the last minimum of the apex
        height. The function kreisel.exact computes the same values directly from a scene. The
        minima and maxima of the apex height are found by cubic interpolation between the states of
        the path. Unless the apex comes close to the vertical, the averages are accurate to four
        digits for 50 states per nutation period, and to seven digits for 400 states. If the apex
        height varies by less than 1e-9, the motion counts as a steady precession, and the nutation
        period is NaN.

        Where the apex comes close to the vertical, the states do not determine the turns of the
        azimuth. Where the apex passes exactly through the vertical, the azimuth jumps by half a
        turn. So for each nutation, the number of half turns is taken from the closed form, in which
        the jumps do not count as precession. If the apex stays within 4e-5 of the vertical, the
        whole precession is taken from the closed form. With damping or dry friction, there is no
        closed form, and the precession is that of the azimuth of the states.

        Raises ValueError for a moving support, and for any body other than a Lagrange top. Also
        raises ValueError if the path contains no complete nutation period, or fewer than four
        states per period.
        """
        body = self.scene.body
        refuse_disturbances(
            self.scene,
            "nutations are not defined for tops",
            ("damping", "friction"),
            "kr.events.nutation() finds the times at which the apex is highest and lowest",
        )
        if body.kind != "lagrange":
            raise ValueError(
                "nutation and precession are defined for Lagrange tops, not for a body of kind "
                f"{body.kind!r}"
            )
        if not len(self.t):
            raise ValueError("a path without states has no nutation: call solve with times")
        if self.t[-1] < self.t[0]:
            backward = slice(None, None, -1)
            arrays = self.t[backward], self.trace[backward], self.rate[backward]
            return Apex(*arrays, self.scene)._measure_nutation()
        return self._measure_nutation()

    @property
    def _loses_energy(self) -> bool:
        """True for a top with damping or dry friction, whose motion has no closed form."""
        return any(self.scene.damping) or self.scene.friction > 0.0

    def _measure_nutation(self) -> Nutation:
        """Return the nutation and precession of a trace whose times increase."""
        top = exact(self.scene.replace(damping=None, friction=None))
        if np.ptp(self.height) < _LEVEL:
            return self._measure_steady_nutation(top)
        self._refuse_coarse_sampling(top)
        low, high = (
            self._find_times_of_height_extrema(1.0),
            self._find_times_of_height_extrema(-1.0),
        )
        if len(low) < 2:
            raise ValueError(
                f"the apex has {len(low)} lowest points in this path, but two are needed to "
                "measure a nutation: solve for a longer time"
            )
        span = low[-1] - low[0]
        greatest, least = (
            float(np.mean([self._interpolate_nutation(t) for t in times])) for times in (low, high)
        )
        if self._loses_energy:
            first, last = (self._interpolate_values_at_time(self.azimuth, low[i]) for i in (0, -1))
            angle = last - first
        else:
            angle = self._measure_azimuth_change(low, top.precession_rate)
        return Nutation(least, greatest, span / (len(low) - 1), angle / span)

    def _measure_steady_nutation(self, top: Exact[float, Path]) -> Nutation:
        radius = np.hypot(*self.trace[:, :2].T)
        nutation = np.arctan2(radius, self.height)
        angle, duration = self.azimuth[-1] - self.azimuth[0], self.t[-1] - self.t[0]
        rate = float(angle / duration) if duration else math.nan
        # Near the vertical, a nutation may be hidden.
        if float(radius.max()) ** 2 < 2.0 * _LEVEL and not self._loses_energy:
            rate = top.precession_rate
        return Nutation(float(nutation.min()), float(nutation.max()), math.nan, rate)

    def _refuse_coarse_sampling(self, top: Exact[float, Path]) -> None:
        """Raise ValueError if the states are too far apart to resolve the turning points."""
        period, spacing = (
            2.0 * abs(top.t_least - top.t_greatest),
            float(np.abs(np.diff(self.t)).max()),
        )
        if period and _FEWEST * spacing > period * (1.0 + 1e-9):
            raise ValueError(
                f"the states are up to {spacing:g} apart, and a nutation takes {period:g}: request "
                f"at least {_FEWEST} states per nutation, or use kr.exact(path.scene)"
            )

    def _measure_azimuth_change(self, low: list[float], rate: float) -> float:
        """Return the change of the azimuth from the first to the last lowest point.

        In each nutation, the change is measured up to half turns. Of the possible values, the one
        closest to the mean rate of the closed form is chosen.
        """
        position, velocity = (
            self._interpolate_horizontal_part(vectors, low) for vectors in (self.trace, self.rate)
        )
        # At a lowest point, the velocity is perpendicular to the position, so both turn alike. The
        # position vanishes at the vertical, and the velocity at a cusp.
        times = np.diff(low)
        is_far = np.abs(position).min() > np.abs(velocity).min() * times.mean() / math.tau
        direction = position if is_far else velocity
        angles = np.angle(direction[1:] * direction[:-1].conj())
        return float(np.sum(angles + math.pi * np.round((rate * times - angles) / math.pi)))

    def _find_times_of_height_extrema(self, sign: float) -> list[float]:
        """Return the times of the minima (`sign` = 1) or maxima (`sign` = -1) of the height."""
        rise = sign * self.rate[:, 2]
        indices = np.flatnonzero((rise[:-1] < 0.0) & (rise[1:] >= 0.0)) + 1
        return [
            _find_zero_of_interpolant(*self._select_four_nearest_samples(i, rise))
            for i in indices.tolist()
        ]

    def _select_four_nearest_samples(self, i: int, values: Array) -> tuple[Array, Array]:
        """Return four consecutive times around t[i], and the values at these times."""
        first = min(max(i - 2, 0), max(len(self.t) - 4, 0))
        return self.t[first : first + 4], values[first : first + 4]

    def _interpolate_nutation(self, t: float) -> float:
        """Return the nutation angle at a time between two states, by interpolation.

        The nutation angle is computed from the height of the apex and its squared distance from the
        vertical. Both the height and the squared distance are smooth functions of time, so the
        interpolation is accurate even if the apex is close to the vertical.
        """
        square = self._interpolate_values_at_time(self.trace[:, 0] ** 2 + self.trace[:, 1] ** 2, t)
        return math.atan2(
            math.sqrt(max(square, 0.0)), self._interpolate_values_at_time(self.height, t)
        )

    def _interpolate_horizontal_part(self, vectors: Array, times: list[float]) -> Waves:
        """Return x + i y of the vectors at times between the states, by interpolation."""
        x, y = (
            np.array([self._interpolate_values_at_time(values, t) for t in times])
            for values in vectors.T[:2]
        )
        return x + 1j * y

    def _interpolate_values_at_time(self, values: Array, t: float) -> float:
        return _interpolate_polynomial(
            *self._select_four_nearest_samples(int(np.searchsorted(self.t, t)), values), t
        )


def apex(path: Path) -> Apex:
    """Return the curve traced on the unit sphere by the direction of the centre of mass.

    If the centre of mass coincides with the fixed point, return the curve traced by the third
    principal axis.
    """
    check_is_one("kreisel.apex needs", path)
    return Apex(path.t, path.apex, np.cross(path.velocity, path.apex), path.scene)


def _interpolate_polynomial(t: Array, values: Array, time: float) -> float:
    """Return the value at `time` of the polynomial that interpolates the points (t, values)."""
    total = 0.0
    for i, value in enumerate(values.tolist()):
        others = np.delete(t, i)
        total += value * float(np.prod((time - others) / (t[i] - others)))
    return total


def _find_zero_of_interpolant(t: Array, values: Array) -> float:
    """Return the time at which an interpolating polynomial changes from negative to positive."""
    i = int(np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))[0])
    low, high = float(t[i]), float(t[i + 1])
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if _interpolate_polynomial(t, values, middle) < 0.0 else (low, middle)
        )
    return 0.5 * (low + high)
