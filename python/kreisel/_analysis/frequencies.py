"""Frequencies of motions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .._model.parameters import refuse_disturbances
from .._model.scene import Scene
from .._options.methods import EXACT, methods
from .._results.path import Path, check_is_one
from .._solve.exact import Exact, ExactTorus, exact
from .._utils.arguments import Array, ReadOnlyArrays, as_int, as_unit_name, freeze_arrays
from .._utils.html import format_picture_as_html
from ..quaternion import multiply, turn

if TYPE_CHECKING:
    from matplotlib.axes import Axes


from typing import Any

import numpy.typing as npt

from .._solve.solve import solve

Waves = npt.NDArray[np.complex128]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int64]

THROUGH = 1e-11  # a pass at a smaller distance from a pole [rad] counts as a pass through it
_HALVINGS = 24  # halvings of the time between states, enough for a pass at the distance THROUGH
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
    for k in range(_HALVINGS):
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


_GRIDS = 64, 128, 256, 512  # points in each angle, until two grids have as many zeros
_OFFSET = 0.3  # of the grid [intervals]; motions are symmetric about multiples of a quarter turn
_NEWTON_STEPS = 30  # largest number of Newton steps
_STEP = 1e-6  # of differences of z [turns]
_SETTLED = 1e-13  # size of the last Newton step [turns]


class TorusRates(NamedTuple):
    """Mean rates of precession and spin, and the nutation frequency."""

    precession_rate: float
    nutation: float
    spin_angle_rate: float


class _BodyAxisAtTorusAngles(NamedTuple):
    """The direction of a body axis, as a function of the two angles on the torus.

    z       projection of the axis onto the horizontal plane, without the heading
    about   sin(nutation) exp(i spin_angle)
    height  cosine of the nutation
    """

    z: Waves
    about: Waves
    height: Array


def compute_torus_rates(form: ExactTorus) -> TorusRates | None:
    """Compute the mean precession and spin rates and the nutation frequency.

    Returns None if the motion is too close to a separatrix.
    """
    rates, cell_count = np.array(form.frequencies), -1
    for n in _GRIDS:
        turns = (np.arange(n) + _OFFSET) / n
        grid = np.stack(np.meshgrid(turns, turns, indexing="ij"), axis=-1)
        signals = _compute_body_axis_at_torus_angles(form, grid)
        cells, index = _find_grid_cells_with_zeros(signals.z)
        if len(cells) == cell_count:
            break
        cell_count = len(cells)
    else:
        return None
    zeros = np.array(
        [_refine_zero_by_newton(form, (cell + _OFFSET + 0.5) / n, n) for cell in cells]
    )
    zeros = zeros.reshape(-1, 2)
    if not np.isfinite(zeros).all():
        return None
    offsets = zeros - _OFFSET / n
    # Only the sum of precession and spin is smooth at the upper pole, only the difference at the
    # lower one.
    side = -np.sign(_compute_body_axis_at_torus_angles(form, zeros).height)
    precession = _compute_mean_windings(signals.z, offsets, index) @ rates[:2]
    spin = _compute_mean_windings(signals.about, offsets, side * index) @ rates[:2]
    return TorusRates(
        float(rates[2] + precession), _find_rate_of_strongest_harmonic(signals, rates), float(spin)
    )


def _compute_body_axis_at_torus_angles(form: ExactTorus, turns: Array) -> _BodyAxisAtTorusAngles:
    """Compute the direction of the body axis at given pairs of torus angles [turns]."""
    states = form._compute_states_at_angles(turns.reshape(-1, 2))
    w, x, y, z = states[:, 1:5].T
    axis = np.array(form.scene.body.com)
    axis /= np.linalg.norm(axis)
    first = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    first /= np.linalg.norm(first)
    apex, one, two = (
        turn((w, x, y, z), (v[0], v[1], v[2])) for v in (axis, first, np.cross(axis, first))
    )
    level = apex[0] + 1j * apex[1]
    if form.scene.body.kind == "goryachev_chaplygin":  # the heading is that of the momentum
        level = level * np.exp(-1j * np.arctan2(states[:, 6], states[:, 5]))
    shape = turns.shape[:-1]
    spin_signal = two[2] + 1j * one[2]
    return _BodyAxisAtTorusAngles(
        level.reshape(shape), spin_signal.reshape(shape), apex[2].reshape(shape)
    )


def _find_grid_cells_with_zeros(z: Waves) -> tuple[Indices, Array]:
    """Find the grid cells around which a complex function has a nonzero winding number."""
    one, two = _compute_grid_phase_differences(z, 0), _compute_grid_phase_differences(z, 1)
    circulation = one + np.roll(two, -1, axis=0) - np.roll(one, -1, axis=1) - two
    index = np.rint(circulation / math.tau)
    cells = np.argwhere(index)
    return cells, index[tuple(cells.T)]


def _compute_grid_phase_differences(z: Waves, axis: int) -> Array:
    """Return the phase differences between adjacent points of a complex grid along one axis."""
    steps: Array = np.angle(np.roll(z, -1, axis=axis) * z.conj())
    return steps


def _refine_zero_by_newton(form: ExactTorus, guess: Array, n: int) -> Array:
    """Refine a guess of the torus angles [turns] at a zero of z; return NaN if no zero is found."""
    angles = guess
    offsets = _STEP * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])
    for _ in range(_NEWTON_STEPS):
        z = _compute_body_axis_at_torus_angles(form, angles + offsets).z
        one, two = (z[1] - z[2]) / (2.0 * _STEP), (z[3] - z[4]) / (2.0 * _STEP)
        area = float((one.conjugate() * two).imag)
        if area == 0.0:
            break
        # The steps a and b solve one * a + two * b = -z.
        step = np.array([(two.conjugate() * z[0]).imag, -(one.conjugate() * z[0]).imag]) / area
        angles = angles + step
        if np.abs(angles - guess).max() > 1.5 / n:
            break
        if np.abs(step).max() <= _SETTLED:
            return angles
    return np.full(2, np.nan)


def _compute_mean_windings(z: Waves, offsets: Array, index: Array) -> Array:
    """Return the mean winding numbers of z along the two angles of the torus.

    `offsets` contains the torus angles of the zeros of z [turns], measured from the first grid
    point.
    """
    first = round(float(_compute_grid_phase_differences(z, 0)[:, 0].sum()) / math.tau)
    second = round(float(_compute_grid_phase_differences(z, 1)[0].sum()) / math.tau)
    one = first - float((index * (1.0 - offsets[:, 1])).sum())
    two = second + float((index * (1.0 - offsets[:, 0])).sum())
    return np.array([one, two])


def _find_rate_of_strongest_harmonic(signals: _BodyAxisAtTorusAngles, rates: Array) -> float:
    strengths = np.abs(np.fft.fft2(signals.height))
    strengths[0, 0] = 0.0
    n = len(strengths)
    orders = np.array(np.unravel_index(int(strengths.argmax()), strengths.shape))
    orders = np.where(2 * orders > n, orders - n, orders)
    return abs(float(orders @ rates[:2]))


_SHARPNESS = 11.0  # shape parameter of the window, whose side lobes are below 2e-14
_FEWEST = 64  # least number of states
_EVEN = 1e-9  # allowed deviation of a time from even spacing, relative to the spacing
_ROUNDS = 12  # largest number of Newton steps for a line
_LEVEL = 1e-12  # smaller variations of the axis are ignored
_SMOOTH = 1e-3  # allowed error of a mean rate, as an angle over the whole path [rad]
_WINDOW_PART = 0.75  # of the states, for means that show whether a mean rate has settled
_SPREAD = 0.02  # allowed differences of these means if a line confirms the rate, as an angle [rad]
_NEAR = 0.1  # allowed difference between mean rate and line, as an angle over the whole path [rad]


@dataclass(frozen=True, eq=False)
class Frequencies(ReadOnlyArrays):
    """The angular frequencies of a motion. Arrays are read-only.

    precession_rate  mean rate of the axis about the vertical [rad/T]. The poles are the vertical
                     and its opposite. If the axis passes a pole within 1e-11 rad, the half turn of
                     this pass is not counted. NaN if the axis stays at a pole, or passes a pole at
                     a distance below the errors of the path. NaN if the path is too short or has
                     too few states
    nutation         frequency of the strongest line of the height of the axis [rad/T]; for Lagrange
                     tops and free bodies, 2 pi divided by the time from one lowest point to the
                     next. 0 if the height is constant
    spin_angle_rate  mean rate of the body about the axis, in addition to the precession [rad/T];
                     NaN if the precession rate is NaN, or if the path has too few states
    lines            (n,) frequencies of apex_x + i apex_y, the strongest first [rad/T]
    amplitudes       (n,) complex amplitudes: apex_x + i apex_y is approximately the sum of
                     amplitudes * exp(i * lines * t)
    rest             root mean square of the difference between apex_x + i apex_y and this sum,
                     divided by the root mean square of apex_x + i apex_y. `rest` is at rounding
                     level if the motion is regular and the path is long, and large if the motion is
                     chaotic. `rest` does not measure the errors of the three mean rates
    exact            True if the three mean rates come from the closed form
    """

    precession_rate: float
    nutation: float
    spin_angle_rate: float
    lines: Array
    amplitudes: Waves
    rest: float
    exact: bool

    def __repr__(self) -> str:
        names = "precession_rate", "nutation", "spin_angle_rate"
        rates = ", ".join(f"{name} {getattr(self, name):.6g}" for name in names)
        return f"<kreisel.Frequencies: {rates}; {len(self.lines)} lines, rest {self.rest:.1e}>"

    def plot(self, axes: Axes | None = None, *, time_unit: str = "T") -> Axes:
        """Draw the spectrum of the apex motion with matplotlib, and return the axes.

        A dot marks the amplitude of each spectral line. A spectral line is labelled k if its offset
        from the precession rate is an integer multiple k of the nutation frequency. A dashed line
        marks the mean precession rate.

        axes       the axes to draw in; default: a new figure
        time_unit  the unit of time in which the scene is described, for the labels

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.cusps, [0.1 * i for i in range(1000)])
            >>> kr.frequencies(path).plot(time_unit="s").get_xlabel()
            'angular frequency [s⁻¹]'

        Raises ImportError if matplotlib is not installed.
        """
        from .._plot.charts import draw_spectral_lines

        return draw_spectral_lines(self, axes, as_unit_name("time_unit", time_unit))

    def _repr_html_(self) -> str | None:
        """Return an image of the spectrum for display in notebooks."""
        return format_picture_as_html(self.plot, repr(self))


def frequencies(path: Path, n: int = 12) -> Frequencies:
    """Compute the frequencies and the `n` strongest spectral lines of an evenly sampled path.

    If the path was computed with method='exact', the rates are derived from the closed-form
    solution. Two spectral lines are resolved if their phase difference changes by more than 23
    turns over the path. The path should span many nutation periods, with more than two states per
    turn of the fastest-changing Euler angle. For a regular motion, the computed rates are as
    accurate as the states of the path, or NaN if the path does not determine them. Except for
    Lagrange tops and free bodies, frequencies too low for the length of the path limit the
    accuracy. Additional states are computed where the body axis is close
    to the direction about which it precesses.

    Under gravity, the precession, nutation and spin rates refer to the motion of the apex about the
    vertical. Without torque, the rates describe the motion of a body axis about the angular
    momentum, as in kreisel.exact. If the support turns about e3, the precession rate and the
    spectral lines are measured relative to the support.

        >>> import kreisel as kr
        >>> import numpy as np
        >>> t = np.linspace(0.0, 200.0, 4001)
        >>> found = kr.frequencies(kr.solve(kr.scenes.cusps, t, "taylor"))
        >>> truth = kr.exact(kr.scenes.cusps)
        >>> abs(found.precession_rate / truth.precession_rate - 1.0) < 1e-12
        True

    Raises TypeError if `path` is not a Path object. Raises ValueError if there are fewer than 64
    states, or if the times are not evenly spaced. Raises ValueError for damping, friction, or a
    support that shakes or turns about an axis other than e3. For a torque-free body, the support
    must not turn, and the rotor must be aligned with the axis of symmetry.
    """
    check_is_one("kreisel.frequencies needs", path)
    count, t = as_int("n", n, 1), path.t
    if count > len(t) >= _FEWEST:
        raise ValueError(f"n must be at most the number of states, {len(t)}, not {count}")
    if path.scene._has_damping:
        raise ValueError("a damped top has no frequencies, because its motion decays")
    _refuse_varying_rates(path.scene)
    _refuse_free_body_with_tilted_rotor(path)
    if len(t) < _FEWEST:
        raise ValueError(f"the path must have at least {_FEWEST} states, not {len(t)}")
    grid = np.linspace(t[0], t[-1], len(t))
    if not np.abs(t - grid).max() <= _EVEN * abs(grid[1] - grid[0]) or t[0] == t[-1]:
        raise ValueError(
            "the states of the path must be equally spaced in time: call solve with "
            "numpy.linspace(0.0, t, n), or use a method of fixed step"
        )
    signal = path.apex[:, 0] + 1j * path.apex[:, 1]
    lines, amplitudes, rest = _find_strongest_spectral_lines(t, signal, count)
    spectrum = lines, amplitudes, rest
    freeze_arrays(spectrum)
    turning = path.scene.turning[2]
    path = _transform_path_to_inertial_frame(path, turning) if turning else path
    rates = _compute_closed_form_rates(exact(path.scene)) if path.method == EXACT else None
    precession, nutation, spin = _compute_mean_euler_rates(path) if rates is None else rates
    return Frequencies(precession - turning, nutation, spin, *spectrum, rates is not None)


def _refuse_varying_rates(scene: Scene) -> None:
    """Raise ValueError if damping, friction or a moving support makes the mean Euler rates vary."""
    is_free = not (scene.gravity and any(scene.body.com))
    is_upright = not (any(scene.turning[:2]) or is_free)
    refuse_disturbances(
        scene,
        "frequencies are not defined for a top",
        ("a turning support",) if is_upright else (),
        "the motion decays" if scene.friction else "its rates about the vertical are not constant",
    )


def _transform_path_to_inertial_frame(path: Path, turning: float) -> Path:
    """Transform a path from the frame of a support that turns about e3 to the inertial frame."""
    zero, half = np.zeros(len(path.t)), 0.5 * turning * path.t
    rotation = np.cos(half), zero, zero, np.sin(half)
    w, x, y, z = path.q.T
    q, m = (
        multiply(rotation, (w, x, y, z)),
        turn(rotation, (path.m[:, 0], path.m[:, 1], path.m[:, 2])),
    )
    states = np.stack((path.t, *q, *m), axis=-1)
    scene = path.scene.replace(turning=None)
    return Path(scene, states, path.stats, path._options, path._is_back)


def _compute_closed_form_rates(form: Exact[float, Path]) -> tuple[float, float, float] | None:
    """Return precession, nutation and spin rates of a closed form, or None near a separatrix."""
    if isinstance(form, ExactTorus):
        return compute_torus_rates(form)
    return form.precession_rate, math.tau / form.period, form.spin_angle_rate


def _compute_mean_euler_rates(path: Path) -> tuple[float, float, float]:
    """Compute the precession, nutation and spin rates from the states of a path."""
    t, (space_axis, body_axis) = path.t, _choose_space_and_body_axes(path)
    principal, east = path.frame, _perpendicular_unit_vector(space_axis)
    axis, first = body_axis @ principal, _perpendicular_unit_vector(body_axis) @ principal
    spin_signal = np.cross(axis, first) @ space_axis + 1j * (first @ space_axis)
    motion = compute_axis_motion_about_direction(path, space_axis, body_axis, east)
    level = motion.height - float(_kaiser_window(len(t)) @ motion.height)
    nutation = 0.0
    if np.abs(level).max() > _LEVEL:
        [line], _, _ = _find_strongest_spectral_lines(t, level.astype(np.complex128), 1)
        nutation = abs(float(line))
    if not np.abs(motion.z).max() > _LEVEL:
        return math.nan, nutation, math.nan
    turns = measure_angle_increments(path, motion, spin_signal, space_axis, body_axis, east)
    window, span = _kaiser_window(len(t) - 1), len(t) - 1
    if not math.tau * span * float(window[turns.unknown].sum()) < _SMOOTH:
        return math.nan, nutation, math.nan
    is_through = span * float(window[turns.through > 0].sum()) > _SMOOTH
    part = 0.5 * nutation if is_through else nutation
    signals = (motion.z, turns.precession), (spin_signal, turns.spin)
    if _is_free_or_lagrange(path.scene):
        precession, spin = (_find_rate_from_line(t, z, angle, part) for z, angle in signals)
        return precession, nutation, math.nan if math.isnan(precession) else spin
    precession, spin = (_compute_settled_mean_rate(t, z, angle) for z, angle in signals)
    is_known = not math.isnan(precession + spin)
    return (precession, nutation, spin) if is_known else (math.nan, nutation, math.nan)


def _is_free_or_lagrange(scene: Scene) -> bool:
    """Return True for a Lagrange top or free body.

    The spectral lines of their angles differ by multiples of the nutation frequency.
    """
    return not (scene.gravity and any(scene.body.com)) or scene.body.kind == "lagrange"


def _compute_settled_mean_rate(t: Array, signal: Waves, increments: Array) -> float:
    """Compute the mean rate of an angle from its `increments` between successive states.

    If the strongest spectral line of `signal` confirms the mean rate, the frequency of this line is
    returned. Otherwise, the angle must vary smoothly from state to state. Returns NaN if it does
    not, or if means over parts of the path differ from the mean over the whole path. These means
    differ if the motion has frequencies that are too low for the length of the path.
    """
    span, rate = abs(float(t[-1] - t[0])), increments / float(t[1] - t[0])
    mean, n = float(_kaiser_window(len(rate)) @ rate), round(_WINDOW_PART * len(rate))
    window = _kaiser_window(n)
    parts = [float(window @ rate[i : i + n]) for i in (0, (len(rate) - n) // 2, len(rate) - n)]
    spread = span * max(abs(part - mean) for part in parts)
    [line], _, _ = _find_strongest_spectral_lines(t, signal, 1)
    if span * abs(float(line) - mean) < _SMOOTH and spread < _SPREAD:
        return float(line)
    is_smooth = span * _bound_aliasing_error_of_mean(rate) < _SMOOTH
    return mean if is_smooth and spread < _SMOOTH else math.nan


def _find_rate_from_line(t: Array, signal: Waves, increments: Array, part: float) -> float:
    """Compute the mean rate of an angle from the strongest spectral line of `signal`.

    For Lagrange tops and free bodies, the mean rate differs from the frequency of the strongest
    spectral line by an integer multiple of `part`, which is the nutation frequency or half of it.
    If the integer multiple can be determined with certainty, the mean rate is computed from the
    frequency of the strongest line. If the integer multiple is uncertain but the angle varies
    smoothly, the mean rate is computed from the increments. In all other cases, the result is NaN.
    `increments` contains the changes of the angle between successive states.
    """
    span, step = abs(float(t[-1] - t[0])), float(t[1] - t[0])
    mean = float(_kaiser_window(len(increments)) @ increments) / step
    is_smooth = span * _bound_aliasing_error_of_mean(increments / step) < _SMOOTH
    [line], _, _ = _find_strongest_spectral_lines(t, signal, 1)
    rate = float(line) - (round((float(line) - mean) / part) * part if part else 0.0)
    if span * abs(rate - mean) < (_NEAR if is_smooth else math.pi):
        return rate
    return mean if is_smooth else math.nan


def _bound_aliasing_error_of_mean(rate: Array) -> float:
    """Return an upper bound on the aliasing error of the average of a sampled rate.

    The returned bound is the largest amplitude in the upper half of the frequency spectrum.
    """
    strengths = np.abs(np.fft.rfft(_kaiser_window(len(rate)) * rate))
    return float(strengths[len(strengths) // 2 :].max())


def _refuse_free_body_with_tilted_rotor(path: Path) -> None:
    """Raise ValueError for a torque-free body whose rotor is not aligned with a symmetry axis."""
    scene = path.scene
    is_free = not (scene.gravity and any(scene.body.com))
    if is_free and any(scene.body.rotor) and not methods[EXACT].suits(scene):
        raise ValueError(
            "a body without torque has no mean precession and spin if its rotor is not along its "
            "axis of symmetry"
        )


def _choose_space_and_body_axes(path: Path) -> tuple[Array, Array]:
    """Return the reference direction in space, and the body axis that moves about this direction.

    The body axis is given by its components along the principal axes.
    """
    com = np.array(path.scene.body.principal_com)
    if not path.m[0].any() and not (path.scene.gravity and com.any()):
        return np.array((0.0, 0.0, 1.0)), np.array((0.0, 0.0, 1.0))  # at rest
    if path.scene.gravity and com.any():
        return np.array((0.0, 0.0, 1.0)), com / np.linalg.norm(com)
    momentum = path.frame @ path.m[0]
    rotor = np.array(path.scene.body.principal_rotor)
    if rotor.any():
        unit = rotor / np.linalg.norm(rotor)
        return path.m[0] / np.linalg.norm(path.m[0]), -unit if momentum[0] @ unit < 0.0 else unit
    moments = np.array(path.scene.body.moments)
    middle = int(np.argsort(moments)[1])
    odd = int(np.argmax(np.abs(moments - moments[middle])))
    if len(set(moments.tolist())) == 3:
        least = np.abs(momentum).min(axis=0)
        least[middle] = -1.0
        odd = int(least.argmax())
    axis = np.zeros(3)
    axis[odd] = 1.0 if momentum[0, odd] >= 0.0 else -1.0
    return path.m[0] / (np.linalg.norm(path.m[0]) or 1.0), axis


def _perpendicular_unit_vector(v: Array) -> Array:
    """Return a unit vector perpendicular to the unit vector `v`."""
    normal: Array = np.cross(v, np.eye(3)[np.abs(v).argmin()])
    return normal / float(np.linalg.norm(normal))


def _kaiser_window(n: int) -> Array:
    window = np.kaiser(n, math.pi * _SHARPNESS)
    weights: Array = window / window.sum()
    return weights


def _find_strongest_spectral_lines(t: Array, signal: Waves, n: int) -> tuple[Array, Waves, float]:
    """Return the frequencies, amplitudes and relative residual of the strongest spectral lines."""
    window, remainder = _kaiser_window(len(t)), signal.astype(np.complex128)
    frequency, amplitude = np.empty(n), np.empty(n, dtype=np.complex128)
    for k in range(n):
        frequency[k] = _find_peak_frequency(t, window * remainder)
        wave = np.exp(1j * frequency[k] * t)
        amplitude[k] = (window * remainder) @ wave.conj()
        remainder = remainder - amplitude[k] * wave
    size = math.sqrt(float(window @ np.abs(signal) ** 2))
    rest = math.sqrt(float(window @ np.abs(remainder) ** 2)) / size if size > 0.0 else 0.0
    return frequency, amplitude, rest


def _find_peak_frequency(t: Array, signal: Waves) -> float:
    """Return the frequency at which the Fourier transform of a signal is largest in magnitude.

    The maximum of the FFT is refined by Newton's method.
    """
    size = 1 << (4 * len(t) - 1).bit_length()  # numpy is slow for lengths with large factors
    step = float(t[-1] - t[0]) / (len(t) - 1)
    best = int(np.abs(np.fft.fft(signal, size)).argmax())
    frequency = math.tau * (best - size if 2 * best > size else best) / (size * step)
    offsets = t - 0.5 * (t[0] + t[-1])
    for _ in range(_ROUNDS):
        wave = signal * np.exp(-1j * frequency * offsets)
        sum0, sum1, sum2 = wave.sum(), (wave * offsets).sum(), (wave * offsets * offsets).sum()
        slope = float((sum0.conjugate() * -1j * sum1).real)
        bend = float(abs(sum1) ** 2 - (sum0.conjugate() * sum2).real)
        if not bend < 0.0 or frequency - slope / bend == frequency:
            break
        frequency -= slope / bend
    return frequency
