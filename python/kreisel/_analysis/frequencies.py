"""Frequencies of motions: mean rates, and the strongest spectral lines of the apex."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._model.parameters import refuse_disturbances
from .._model.scene import Scene
from .._options.methods import EXACT, has_torus_closed_form, methods
from .._results.path import Path, check_is_one
from .._solve.exact import ExactTorus, exact
from .._solve.solve import solve
from .._utils.arguments import Array, ReadOnlyArrays, as_int, as_unit_name, freeze_arrays
from .._utils.html import format_picture_as_html
from ..quaternion import multiply, turn

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Waves = npt.NDArray[np.complex128]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int64]
Rates = tuple[float, float, float]  # of precession, nutation and spin [rad/T]


# Rates from the states of a path: the turns of a body axis about a direction in space, and of the
# body about this axis, are counted between successive states.

_THROUGH = 1e-11  # a pass at a smaller distance from a pole [rad] counts as a pass through it
_HALVINGS = 24  # of the time between states, enough for a pass at the distance _THROUGH
_SAFETY = 4.0  # a pole must be this many times as far from a chord as the arc can be
_STRAIGHT = 0.1  # largest distance of arc and chord, per length, if an end is a pole


class _Axes(NamedTuple):
    """A direction in space, and a body axis by its components along the principal axes.

    The projection of the body axis perpendicular to `space` is a complex number, which is real if
    the body axis lies in the plane of `space` and `east`.
    """

    space: Array
    body: Array
    east: Array

    def project(self, path: Path) -> tuple[Waves, Waves]:
        """Return the projections of the body axis and their time derivatives."""
        axis, velocity = self.body @ path.frame, path.velocity
        north, change = np.cross(self.space, self.east), np.cross(velocity, axis)
        return axis @ self.east + 1j * (axis @ north), change @ self.east + 1j * (change @ north)


class _Arcs(NamedTuple):
    """Arcs of the projection; `begin` and `end` are times since the state with index `parent`."""

    parent: Indices
    begin: Array
    end: Array
    z0: Waves
    rate0: Waves
    z1: Waves
    rate1: Waves


def _measure_precession(
    path: Path, axes: _Axes, z: Waves, rate: Waves
) -> tuple[Array, Indices, Flags]:
    """Return the angles by which the body axis turns about a direction from state to state.

    Also return the number of passes through a pole, whose half turns are not counted, and flags
    that are True if the turns between two states cannot be counted.
    """
    n = len(z) - 1
    arcs = _Arcs(np.arange(n), np.zeros(n), np.diff(path.t), z[:-1], rate[:-1], z[1:], rate[1:])
    angle, passes = np.zeros(n), np.zeros(n, dtype=np.int64)
    min_distance, gap = np.full(n, np.inf), np.zeros(n)
    for k in range(_HALVINGS):
        angles, is_known, through, distance = _measure_angles_of_arcs(arcs)
        indices = arcs.parent[is_known]
        np.add.at(angle, indices, angles[is_known])
        np.add.at(passes, indices, through[is_known])
        np.minimum.at(min_distance, indices, distance[is_known])
        columns: Any = (column[~is_known] for column in arcs)
        arcs = _Arcs(*columns)
        i = arcs.parent
        if not i.size:
            break
        middle = 0.5 * (arcs.begin + arcs.end)
        tops = path.scene.vary(attitude=path.q[i], momentum=path.m[i])
        result = solve(tops, np.stack([middle, arcs.end], axis=1))
        new_z, new_rate = axes.project(result)
        new_z[result.status != "OK"] = np.nan
        if k == 0:
            end = new_z[:, 1], new_rate[:, 1]
            angle[i], passes[i], gap[i] = _compare_with_integration(arcs, *end)
            arcs = arcs._replace(z1=end[0], rate1=end[1])
        first = arcs._replace(end=middle, z1=new_z[:, 0], rate1=new_rate[:, 0])
        second = arcs._replace(begin=middle, z0=new_z[:, 0], rate0=new_rate[:, 0])
        columns = map(np.concatenate, zip(first, second, strict=True))
        arcs = _Arcs(*columns)
    # The errors of a path add up, so a pass is uncertain if its distance from the pole is less than
    # n gaps. But a pass through a pole to within _THROUGH is no coincidence, and is trusted.
    is_beside = np.convolve(passes > 0, np.ones(3), "same") < 0.5
    is_unknown = (is_beside & (min_distance < n * gap)) | ~np.isfinite(gap)
    is_unknown[arcs.parent] = True
    return angle, passes, is_unknown


def _compare_with_integration(arcs: _Arcs, z: Waves, rate: Waves) -> tuple[Array, Flags, Array]:
    """Compare the ends of arcs, which are states of a path, with integrations from their starts.

    Return the angles between the two projections, flags that are True if a pole lies between them,
    and their distances, which are inf if it is uncertain in which direction they turn about 0.
    """
    incoming = -(arcs.end - arcs.begin) * arcs.rate1
    z1 = np.where(np.abs(arcs.z1) < _THROUGH, incoming, arcs.z1)
    distances = []  # of the lines through the ends from the pole
    for point, change in ((arcs.z1, arcs.rate1), (z, rate)):
        size, area = np.abs(change), np.abs((point * change.conj()).imag)
        distances.append(np.divide(area, size, out=np.abs(point), where=size > 0.0))
    is_on_line = np.maximum(*distances) < _THROUGH
    product, gap = z1 * z.conj(), np.abs(arcs.z1 - z)
    is_between = is_on_line & (product.real < 0.0)
    is_wide = ~is_on_line & (_SAFETY * gap > np.abs(arcs.z1))
    angle = np.angle(np.where(is_between, -product, product))
    return angle, is_between, np.where(is_wide, np.inf, gap)


def _measure_angles_of_arcs(arcs: _Arcs) -> tuple[Array, Flags, Flags, Array]:
    """Compute each arc's angle about the origin from its chord in a fixed or rotating frame.

    Also return flags that are True if the angle is certain, flags that are True if the arc begins
    at 0 or passes through 0, and the smallest distances of the chords from 0.
    """
    angle, distance, bend = _measure_chords(arcs)
    is_safe_at_rest = distance > _SAFETY * bend
    length = arcs.end - arcs.begin
    paces = []
    for z, rate in ((arcs.z0, arcs.rate0), (arcs.z1, arcs.rate1)):
        size = np.abs(z) ** 2
        turning, still = (rate * z.conj()).imag, np.zeros(len(size))
        paces.append(np.divide(turning, size, out=still, where=size > _THROUGH**2))
    pace = 0.5 * (paces[0] + paces[1])
    pace = np.where(np.abs(pace * length) < np.pi, pace, 0.0)
    half = np.exp(0.5j * pace * length)  # the frames coincide at the midpoint in time
    turned = arcs._replace(
        z0=arcs.z0 * half,
        rate0=(arcs.rate0 - 1j * pace * arcs.z0) * half,
        z1=arcs.z1 * half.conj(),
        rate1=(arcs.rate1 - 1j * pace * arcs.z1) * half.conj(),
    )
    angle_in_frame, distance_in_frame, bend_in_frame = _measure_chords(turned)
    is_safe_in_frame = distance_in_frame > _SAFETY * bend_in_frame
    is_from_pole, is_to_pole = np.abs(arcs.z0) < _THROUGH, np.abs(arcs.z1) < _THROUGH
    is_pass = (distance < _THROUGH) & (bend < _THROUGH) & ~is_safe_at_rest
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
    is_through = is_pass | is_departure
    return angle, is_known, is_through, np.where(is_safe_at_rest, distance, distance_in_frame)


def _measure_chords(arcs: _Arcs) -> tuple[Array, Array, Array]:
    """Return the angles that chords subtend at 0, their distances from 0 and (bound) the arcs."""
    chord, length = arcs.z1 - arcs.z0, arcs.end - arcs.begin
    size = np.abs(chord) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        foot = np.clip(-(arcs.z0 * chord.conj()).real / size, 0.0, 1.0)
    foot = np.where(size > 0.0, foot, 0.0)
    bend = 0.125 * np.abs((arcs.rate1 - arcs.rate0) * length)
    bend += np.abs(chord - 0.5 * length * (arcs.rate0 + arcs.rate1))
    return np.angle(arcs.z1 * arcs.z0.conj()), np.abs(arcs.z0 + foot * chord), bend


_LEVEL = 1e-12  # smaller variations of the axis are ignored
_SMOOTH = 1e-3  # allowed error of a mean rate, as an angle over the whole path [rad]
_WINDOW_PART = 0.75  # of the states, for means that show whether a mean rate has settled
_SPREAD = 0.02  # allowed differences of these means if a line confirms the rate, as an angle [rad]
_NEAR = 0.1  # allowed difference between mean rate and line, as an angle over the whole path [rad]


def _compute_mean_euler_rates(path: Path) -> Rates:
    """Compute the precession, nutation and spin rates from the states of a path."""
    t, (space_axis, body_axis) = path.t, _choose_space_and_body_axes(path)
    axes = _Axes(space_axis, body_axis, _perpendicular_unit_vector(space_axis))
    axis, first = body_axis @ path.frame, _perpendicular_unit_vector(body_axis) @ path.frame
    spin_signal = np.cross(axis, first) @ space_axis + 1j * (first @ space_axis)
    z, rate = axes.project(path)
    height = axis @ space_axis
    level = height - float(_kaiser_window(len(t)) @ height)
    nutation = 0.0
    if np.abs(level).max() > _LEVEL:
        nutation = abs(_find_peak_frequency(t, level))
    if not np.abs(z).max() > _LEVEL:
        return math.nan, nutation, math.nan
    precession, passes, is_unknown = _measure_precession(path, axes, z, rate)
    window, span = _kaiser_window(len(t) - 1), len(t) - 1
    if not math.tau * span * float(window[is_unknown].sum()) < _SMOOTH:
        return math.nan, nutation, math.nan
    # Near a pole, the spin and precession rates each have a peak, but their sum (or difference) is
    # smooth. The complete turns of the spin are counted by the sum if the axis points upwards, and
    # by the difference otherwise.
    turning, own = path.velocity @ space_axis, (path.velocity * axis).sum(axis=-1)
    side = np.where(height[:-1] + height[1:] >= 0.0, 1.0, -1.0)
    rates = [
        (own[part] + side * turning[part]) / (1.0 + side * height[part])
        for part in (slice(None, -1), slice(1, None))
    ]
    estimate: Array = 0.5 * np.diff(t) * (rates[0] + rates[1]) - side * precession
    spin = np.angle(spin_signal[1:] * spin_signal[:-1].conj()) + np.pi * passes
    spin = spin + 2.0 * np.pi * np.rint((estimate - spin) / (2.0 * np.pi))
    is_seen = np.minimum(np.abs(spin_signal[1:]), np.abs(spin_signal[:-1])) > _THROUGH
    signals = (z, precession), (spin_signal, np.where(is_seen, spin, estimate))
    if _is_free(path.scene) or path.scene.body.kind == "lagrange":
        is_through = span * float(window[passes > 0].sum()) > _SMOOTH
        part = 0.5 * nutation if is_through else nutation
        mean, own_mean = (_find_rate_from_line(t, wave, angle, part) for wave, angle in signals)
        return mean, nutation, math.nan if math.isnan(mean) else own_mean
    mean, own_mean = (_compute_settled_mean_rate(t, wave, angle) for wave, angle in signals)
    is_known = not math.isnan(mean + own_mean)
    return (mean, nutation, own_mean) if is_known else (math.nan, nutation, math.nan)


def _is_free(scene: Scene) -> bool:
    return not (scene.gravity and any(scene.body.com))


def _compute_settled_mean_rate(t: Array, signal: Waves, increments: Array) -> float:
    """Compute the mean rate of an angle from its `increments` between successive states.

    If the strongest spectral line of `signal` confirms the mean rate, the frequency of this line is
    returned. Otherwise, the angle must vary smoothly from state to state. Returns NaN if it does
    not, or if means over parts of the path differ from the mean over the whole path, because the
    motion has frequencies that are too low for the length of the path.
    """
    span, rate = abs(float(t[-1] - t[0])), increments / float(t[1] - t[0])
    mean, n = float(_kaiser_window(len(rate)) @ rate), round(_WINDOW_PART * len(rate))
    window = _kaiser_window(n)
    parts = [float(window @ rate[i : i + n]) for i in (0, (len(rate) - n) // 2, len(rate) - n)]
    spread = span * max(abs(part - mean) for part in parts)
    line = _find_peak_frequency(t, signal)
    if span * abs(line - mean) < _SMOOTH and spread < _SPREAD:
        return line
    is_smooth = span * _bound_aliasing_error_of_mean(rate) < _SMOOTH
    return mean if is_smooth and spread < _SMOOTH else math.nan


def _find_rate_from_line(t: Array, signal: Waves, increments: Array, part: float) -> float:
    """Compute the mean rate of an angle from the strongest spectral line of `signal`.

    For Lagrange tops and free bodies, the two differ by an integer multiple of `part`, which is the
    nutation frequency or half of it. If the multiple is uncertain but the angle varies smoothly,
    the mean rate is computed from the increments; otherwise it is NaN.
    """
    span, step = abs(float(t[-1] - t[0])), float(t[1] - t[0])
    mean = float(_kaiser_window(len(increments)) @ increments) / step
    is_smooth = span * _bound_aliasing_error_of_mean(increments / step) < _SMOOTH
    line = _find_peak_frequency(t, signal)
    rate = line - (round((line - mean) / part) * part if part else 0.0)
    if span * abs(rate - mean) < (_NEAR if is_smooth else math.pi):
        return rate
    return mean if is_smooth else math.nan


def _bound_aliasing_error_of_mean(rate: Array) -> float:
    """Return the largest amplitude in the upper half of the frequency spectrum of a rate."""
    strengths = np.abs(np.fft.rfft(_kaiser_window(len(rate)) * rate))
    return float(strengths[len(strengths) // 2 :].max())


def _choose_space_and_body_axes(path: Path) -> tuple[Array, Array]:
    """Return the direction in space, and the principal components of the axis that moves about it.

    A free body turns about its momentum; its axis is that of its rotor or of symmetry, or, if the
    moments differ, the one of the largest and smallest that stays closest to the momentum.
    """
    body, momentum, vertical = path.scene.body, path.m[0], np.array((0.0, 0.0, 1.0))
    if not _is_free(path.scene):
        com = np.array(body.principal_com)
        return vertical, com / np.linalg.norm(com)
    if not momentum.any():
        return vertical, vertical
    momenta, direction = path.frame @ momentum, momentum / np.linalg.norm(momentum)
    rotor, moments = np.array(body.principal_rotor), np.array(body.moments)
    if rotor.any():
        unit = rotor / np.linalg.norm(rotor)
        return direction, -unit if momenta[0] @ unit < 0.0 else unit
    middle = int(np.argsort(moments)[1])
    odd = int(np.argmax(np.abs(moments - moments[middle])))
    if len(set(moments.tolist())) == 3:
        least = np.abs(momenta).min(axis=0)
        least[middle] = -1.0
        odd = int(least.argmax())
    axis = np.zeros(3)
    axis[odd] = 1.0 if momenta[0, odd] >= 0.0 else -1.0
    return direction, axis


def _perpendicular_unit_vector(v: Array) -> Array:
    """Return a unit vector perpendicular to the unit vector `v`."""
    normal: Array = np.cross(v, np.eye(3)[np.abs(v).argmin()])
    return normal / float(np.linalg.norm(normal))


# Rates from a closed form on a torus: the mean winding numbers of the axis along the two angles of
# the torus, and the strongest harmonic of its height.

_GRIDS = 64, 128, 256, 512  # points in each angle, until two grids have as many zeros
_OFFSET = 0.3  # of the grid [intervals]; motions are symmetric about multiples of a quarter turn
_NEWTON_STEPS = 30  # largest number of Newton steps
_STEP = 1e-6  # of differences of z [turns]
_SETTLED = 1e-13  # size of the last Newton step [turns]


def _compute_torus_rates(form: ExactTorus) -> Rates | None:
    """Compute mean rates, or return None if the motion is too close to a separatrix."""
    rates, cell_count = np.array(form.frequencies), -1
    for n in _GRIDS:
        turns = (np.arange(n) + _OFFSET) / n
        grid = np.stack(np.meshgrid(turns, turns, indexing="ij"), axis=-1)
        z, about, height = _compute_body_axis_at_torus_angles(form, grid)
        one, two = _compute_phase_steps(z, 0), _compute_phase_steps(z, 1)
        circulation = one + np.roll(two, -1, axis=0) - np.roll(one, -1, axis=1) - two
        index = np.rint(circulation / math.tau)  # not zero around zeros of z
        cells = np.argwhere(index)
        if len(cells) == cell_count:
            break
        cell_count = len(cells)
    else:
        return None
    index = index[tuple(cells.T)]
    zeros = [_refine_zero_by_newton(form, (cell + _OFFSET + 0.5) / n, n) for cell in cells]
    places = np.array(zeros).reshape(-1, 2)
    if not np.isfinite(places).all():
        return None
    offsets = places - _OFFSET / n
    # Only the sum of precession and spin is smooth at the upper pole, only the difference at the
    # lower one.
    side = -np.sign(_compute_body_axis_at_torus_angles(form, places)[2])
    precession = _compute_mean_windings(z, offsets, index) @ rates[:2]
    spin = _compute_mean_windings(about, offsets, side * index) @ rates[:2]
    strengths = np.abs(np.fft.fft2(height))
    strengths[0, 0] = 0.0
    orders = np.array(np.unravel_index(int(strengths.argmax()), strengths.shape))
    orders = np.where(2 * orders > n, orders - n, orders)
    return float(rates[2] + precession), abs(float(orders @ rates[:2])), float(spin)


def _compute_body_axis_at_torus_angles(
    form: ExactTorus, turns: Array
) -> tuple[Waves, Waves, Array]:
    """Compute the direction of the body axis at pairs of torus angles [turns].

    Return its horizontal projection without the heading, sin(nutation) exp(i spin_angle), and the
    cosine of the nutation.
    """
    states, shape = form._compute_states_at_angles(turns.reshape(-1, 2)), turns.shape[:-1]
    w, x, y, z = states[:, 1:5].T
    axis = np.array(form.scene.body.com)
    axis /= np.linalg.norm(axis)
    first = _perpendicular_unit_vector(axis)
    apex, one, two = (
        turn((w, x, y, z), (v[0], v[1], v[2])) for v in (axis, first, np.cross(axis, first))
    )
    level = apex[0] + 1j * apex[1]
    if form.scene.body.kind == "goryachev_chaplygin":  # the heading is that of the momentum
        level = level * np.exp(-1j * np.arctan2(states[:, 6], states[:, 5]))
    about = two[2] + 1j * one[2]
    return level.reshape(shape), about.reshape(shape), apex[2].reshape(shape)


def _compute_phase_steps(z: Waves, axis: int) -> Array:
    """Return the phase differences between adjacent points of a complex grid along one axis."""
    steps: Array = np.angle(np.roll(z, -1, axis=axis) * z.conj())
    return steps


def _refine_zero_by_newton(form: ExactTorus, guess: Array, n: int) -> Array:
    """Refine a guess of the torus angles [turns] at a zero of z; return NaN if no zero is found."""
    angles = guess
    offsets = _STEP * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])
    for _ in range(_NEWTON_STEPS):
        z = _compute_body_axis_at_torus_angles(form, angles + offsets)[0]
        one, two = (z[1] - z[2]) / (2.0 * _STEP), (z[3] - z[4]) / (2.0 * _STEP)
        area = float((one.conjugate() * two).imag)
        if area == 0.0:
            break
        # The steps a and b solve one * a + two * b = -z.
        step = np.array([(two.conjugate() * z[0]).imag, -(one.conjugate() * z[0]).imag]) / area
        angles = angles + np.clip(step, -0.5 / n, 0.5 / n)
        if np.abs(angles - guess).max() > 1.5 / n:
            break
        if np.abs(step).max() <= _SETTLED:
            return angles
    return np.full(2, np.nan)


def _compute_mean_windings(z: Waves, offsets: Array, index: Array) -> Array:
    """Return the mean winding numbers of z along the two angles of the torus.

    `offsets` are the torus angles of the zeros of z [turns], measured from the first grid point.
    """
    first = round(float(_compute_phase_steps(z, 0)[:, 0].sum()) / math.tau)
    second = round(float(_compute_phase_steps(z, 1)[0].sum()) / math.tau)
    one = first - float((index * (1.0 - offsets[:, 1])).sum())
    two = second + float((index * (1.0 - offsets[:, 0])).sum())
    return np.array([one, two])


# Spectral lines

_SHARPNESS = 11.0  # shape parameter of the window, whose side lobes are below 2e-14
_ROUNDS = 12  # largest number of Newton steps for a line


@lru_cache(maxsize=4)
def _kaiser_window(n: int) -> Array:
    window = np.kaiser(n, math.pi * _SHARPNESS)
    weights: Array = window / window.sum()
    return weights


def _find_peak_frequency(t: Array, signal: Array | Waves) -> float:
    """Return the frequency of the strongest line of a signal, through the Kaiser window.

    The maximum of the FFT is refined by Newton's method.
    """
    seen = _kaiser_window(len(t)) * signal.astype(np.complex128)
    size = 1 << (4 * len(t) - 1).bit_length()  # numpy is slow for lengths with large factors
    step = float(t[-1] - t[0]) / (len(t) - 1)
    best = int(np.abs(np.fft.fft(seen, size)).argmax())
    frequency = math.tau * (best - size if 2 * best > size else best) / (size * step)
    offsets = t - 0.5 * (t[0] + t[-1])
    for _ in range(_ROUNDS):
        wave = seen * np.exp(-1j * frequency * offsets)
        sum0, sum1, sum2 = wave.sum(), (wave * offsets).sum(), (wave * offsets * offsets).sum()
        slope = float((sum0.conjugate() * -1j * sum1).real)
        bend = float(abs(sum1) ** 2 - (sum0.conjugate() * sum2).real)
        if not bend < 0.0 or frequency - slope / bend == frequency:
            break
        frequency -= slope / bend
    return frequency


_FEWEST = 64  # least number of states
_EVEN = 1e-9  # allowed deviation of a time from even spacing, relative to the spacing


@dataclass(frozen=True, eq=False)
class Frequencies(ReadOnlyArrays):
    """The angular frequencies of a motion. Arrays are read-only.

    precession_rate  mean rate of the axis about the vertical [rad/T]. If the axis passes a pole
                     (the vertical or its opposite) within 1e-11 rad, the half turn of this pass is
                     not counted. NaN if the axis stays at a pole, or passes it at a distance below
                     the errors of the path, or if the path is too short or has too few states
    nutation         frequency of the strongest line of the height of the axis [rad/T]; for Lagrange
                     tops and free bodies, 2 pi divided by the time from one lowest point to the
                     next. 0 if the height is constant
    spin_angle_rate  mean rate of the body about the axis, in addition to the precession [rad/T];
                     NaN if the precession rate is NaN, or if the path has too few states
    lines            (n,) frequencies of apex_x + i apex_y, the strongest first [rad/T]
    amplitudes       (n,) complex amplitudes: apex_x + i apex_y is approximately the sum of
                     amplitudes * exp(i * lines * t)
    rest             root mean square of the difference between apex_x + i apex_y and this sum,
                     divided by that of apex_x + i apex_y: at rounding level if the motion is
                     regular and the path is long, large if it is chaotic. It does not measure the
                     errors of the three mean rates
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

        A dot marks the amplitude of each line, which is labelled k if its offset from the
        precession rate, a dashed line, is k times the nutation frequency.

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
        return format_picture_as_html(self.plot, repr(self))


def frequencies(path: Path, n: int = 12) -> Frequencies:
    """Compute the frequencies and the `n` strongest spectral lines of an evenly sampled path.

    If the path was computed with method='exact', the rates are those of the closed form. Two lines
    are resolved if their phase difference changes by more than 23 turns over the path, which should
    span many nutations, with more than two states per turn of the fastest Euler angle. For a
    regular motion, the rates are as accurate as the states, or NaN if the path does not determine
    them. Except for Lagrange tops and free bodies, frequencies too low for the length of the path
    limit the accuracy. Further states are computed where the body axis is close to the direction
    about which it precesses.

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

    Raises ValueError if there are fewer than 64 states or their times are not evenly spaced, and
    for damping, friction, or a support that shakes or turns about an axis other than e3. For a body
    without torque, the support must not turn, and the rotor must be along the axis of symmetry.
    """
    check_is_one("kreisel.frequencies needs", path)
    scene, count, t = path.scene, as_int("n", n, 1), path.t
    if count > len(t) >= _FEWEST:
        raise ValueError(f"n must be at most the number of states, {len(t)}, not {count}")
    if scene._has_damping:
        raise ValueError("a damped top has no frequencies, because its motion decays")
    refuse_disturbances(
        scene,
        "frequencies are not defined for a top",
        () if any(scene.turning[:2]) or _is_free(scene) else ("a turning support",),
        "the motion decays" if scene.friction else "its rates about the vertical are not constant",
    )
    if (
        _is_free(scene)
        and any(scene.body.rotor)
        and (has_torus_closed_form(scene) or not methods[EXACT].suits(scene))
    ):
        raise ValueError("without torque, the rotor must be along the axis of symmetry")
    if len(t) < _FEWEST:
        raise ValueError(f"the path must have at least {_FEWEST} states, not {len(t)}")
    grid = np.linspace(t[0], t[-1], len(t))
    if not np.abs(t - grid).max() <= _EVEN * abs(grid[1] - grid[0]) or t[0] == t[-1]:
        raise ValueError("the states must be equally spaced, as for t=numpy.linspace(0, 9, 901)")
    signal = path.apex[:, 0] + 1j * path.apex[:, 1]
    window, remainder = _kaiser_window(len(t)), signal.astype(np.complex128)
    lines, amplitudes = np.empty(count), np.empty(count, dtype=np.complex128)
    for k in range(count):
        lines[k] = _find_peak_frequency(t, remainder)
        wave = np.exp(1j * lines[k] * t)
        amplitudes[k] = (window * remainder) @ wave.conj()
        remainder = remainder - amplitudes[k] * wave
    size = math.sqrt(float(window @ np.abs(signal) ** 2))
    rest = math.sqrt(float(window @ np.abs(remainder) ** 2)) / size if size > 0.0 else 0.0
    freeze_arrays((lines, amplitudes))
    turning = scene.turning[2]
    if turning:  # seen from the inertial frame
        zero, half = np.zeros(len(t)), 0.5 * turning * t
        rotation, (w, x, y, z) = (np.cos(half), zero, zero, np.sin(half)), path.q.T
        q, m = multiply(rotation, (w, x, y, z)), turn(rotation, tuple(path.m.T))
        states = np.stack((t, *q, *m), axis=-1)
        at_rest = scene.replace(turning=None)
        path = Path(at_rest, states, path.stats, path._options, path._is_back)
    rates: Rates | None = None
    if path.method == EXACT:
        form = exact(path.scene)
        if isinstance(form, ExactTorus):
            rates = _compute_torus_rates(form)
        else:
            rates = form.precession_rate, math.tau / form.period, form.spin_angle_rate
    precession, nutation, spin = rates or _compute_mean_euler_rates(path)
    is_exact = rates is not None
    return Frequencies(precession - turning, nutation, spin, lines, amplitudes, rest, is_exact)
