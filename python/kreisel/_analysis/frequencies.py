"""The frequencies of a path: numerical analysis of fundamental frequencies (NAFF).

Of an axis of the body, the apex, let z = sin(nutation) exp(i precession_angle) - as it is seen in
space, a quarter turn behind -, u = sin(nutation) exp(i spin_angle) and h = cos(nutation). On a
regular motion each is a sum of lines a exp(i f t); h has multiples of the nutation's frequency v, z
and u those added to the mean rates of the two angles. A line is where the transform of the signal
under a window is largest; what is found is taken away, and the next one is sought.

Sources: J. Laskar, Frequency map analysis and quasiperiodic decompositions, 2003
(arXiv:math/0305364). The window is Kaiser's, whose side lobes are as small as roundings are. Mean
rates by windows: S. Das and others, Nonlinearity 30 (2017) 4111.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .._options.methods import EXACT, has_torus
from .._results.path import Path
from .._solve.exact import exact
from .._utils.validation import Array, ReadOnlyArrays, as_int, check_type, freeze_arrays
from .turns import Waves, compute_motion, count_turns

_SHARPNESS = 11.0  # of the window, whose side lobes are below exp(-pi times this)
_FEWEST = 64  # states
_EVEN = 1e-9  # by which part of the time between them the states may be off
_ROUNDS = 12  # of Newton's method for a line
_LEVEL = 1e-12  # an axis that moves less keeps its height
_SMOOTH = 1e-3  # turns over the path [rad] that a mean rate may be off by
_NEAR = 0.1  # turns over the path [rad] between the mean and the line that replaces it


@dataclass(frozen=True, eq=False)
class Frequencies(ReadOnlyArrays):
    """The frequencies of a motion, as angles in time. Arrays are read-only.

    precession  mean rate of the axis about the vertical [T^-1]. A pass within 1e-11 rad of a pole
                goes through the pole; half a turn there counts as none. NaN if the axis stays at
                a pole, or passes a pole at a distance below the errors of the path
    nutation    2 pi over the time from lowest point to lowest point, of the strongest line of the
                axis' height [T^-1]; 0 for an axis that keeps its height
    spin        mean rate of the body about the axis, beside the precession [T^-1]; NaN if the
                precession is
    lines       (n,) the frequencies of the apex' way round the vertical, the strongest first [T^-1]
    amplitudes  (n,) theirs, complex: apex_x + i apex_y is the sum of amplitudes exp(i lines t)
    rest        what this sum leaves of that, as a part of its root mean square: roundings where
                the motion is regular and the path long, and much where it is chaotic. It measures
                the lines, and no error of precession, nutation and spin
    exact       whether precession, nutation and spin are those of the closed form
    """

    precession: float
    nutation: float
    spin: float
    lines: Array
    amplitudes: Waves
    rest: float
    exact: bool

    def __repr__(self) -> str:
        told = ", ".join(f"{w} {getattr(self, w):.6g}" for w in ("precession", "nutation", "spin"))
        return f"<kreisel.Frequencies: {told}; {len(self.lines)} lines, rest {self.rest:.1e}>"


def frequencies(path: Path, n: int = 12) -> Frequencies:
    """Compute the frequencies of a path with evenly spaced times, and its `n` strongest lines.

    For a path in closed form, method='exact', the rates are those of kreisel.exact. For other
    methods, lines are separated if they are more than 23 / T turns apart, where T is the length of
    the path. The path should have many nutations, and more than two states in each turn of the
    fastest angle. A rate is as exact as the path if the motion is regular. Near a pole, states
    between those of the path are computed until the turns can be counted. Without torque the rates
    are about the angular momentum, of the axis that circulates, as in kreisel.exact; otherwise of
    the apex.

        >>> import kreisel as kr
        >>> import numpy as np
        >>> t = np.linspace(0.0, 200.0, 4001)
        >>> found = kr.frequencies(kr.solve(kr.scenes.cusps, t, "taylor"))
        >>> truth = kr.exact(kr.scenes.cusps)
        >>> abs(found.precession / truth.precession - 1.0) < 1e-12
        True

    Raises TypeError if `path` is not a path; ValueError for fewer than 64 states, for times that
    are not even, and for a damped top.
    """
    check_type("path", path, Path)
    count, t = as_int("n", n, 1), path.t
    if count > len(t) >= _FEWEST:
        raise ValueError(f"n must be at most the number of states, {len(t)}, not {count}")
    if path.scene._is_damped:
        raise ValueError("a damped top has no frequencies, because its motion decays")
    if len(t) < _FEWEST:
        raise ValueError(f"the path must have at least {_FEWEST} states, not {len(t)}")
    even = np.linspace(t[0], t[-1], len(t))
    if not np.abs(t - even).max() <= _EVEN * abs(even[1] - even[0]) or t[0] == t[-1]:
        raise ValueError(
            "the states of the path must be equally far apart in time: solve for "
            "numpy.linspace(0.0, t, n), or record every step of a fixed one"
        )
    seen = path.apex[:, 0] + 1j * path.apex[:, 1]
    lines, amplitudes, rest = _lines(t, seen, count)
    told = lines, amplitudes, rest
    freeze_arrays(told)
    if path.method == EXACT and not has_torus(path.scene):
        form = exact(path.scene)
        return Frequencies(form.precession, math.tau / form.period, form.spin, *told, True)
    return Frequencies(*_rates(path), *told, False)


def _rates(path: Path) -> tuple[float, float, float]:
    """Compute precession, nutation and spin."""
    t, (up, along) = path.t, _axes(path)
    principal, east = path.frame, _perpendicular(up)
    axis, first = along @ principal, _perpendicular(along) @ principal
    about = np.cross(axis, first) @ up + 1j * (first @ up)
    motion = compute_motion(path, up, along, east)
    level = motion.height - float(_window(len(t)) @ motion.height)
    nutation = 0.0
    if np.abs(level).max() > _LEVEL:
        [line], _, _ = _lines(t, level.astype(np.complex128), 1)
        nutation = abs(float(line))
    if not np.abs(motion.z).max() > _LEVEL:
        return math.nan, nutation, math.nan
    turns = count_turns(path, motion, about, up, along, east)
    window, span = _window(len(t) - 1), len(t) - 1
    if not math.tau * span * float(window[turns.unknown].sum()) < _SMOOTH:
        return math.nan, nutation, math.nan
    is_through = span * float(window[turns.through > 0].sum()) > _SMOOTH
    part = 0.5 * nutation if is_through else nutation
    precession = _mean_rate(t, motion.z, turns.precession, part)
    return precession, nutation, _mean_rate(t, about, turns.spin, part)


def _mean_rate(t: Array, signal: Waves, turned: Array, part: float) -> float:
    """Compute the mean rate of an angle from `turned`, the angles between states.

    The strongest line of `signal`, less a multiple of `part`, is more exact if it lies so near the
    mean that the multiple is certain. The rate is NaN if the multiple is uncertain and the angle
    does not grow evenly.
    """
    span, step = abs(float(t[-1] - t[0])), float(t[1] - t[0])
    mean = float(_window(len(turned)) @ turned) / step
    is_smooth = span * _alias_bound(turned / step) < _SMOOTH
    [line], _, _ = _lines(t, signal, 1)
    found = float(line) - (round((float(line) - mean) / part) * part if part else 0.0)
    if span * abs(found - mean) < (_NEAR if is_smooth else math.pi):
        return found
    return mean if is_smooth else math.nan


def _alias_bound(rate: Array) -> float:
    """Return a bound of the contribution of unresolved frequencies to the mean of `rate`.

    It is the strongest line in the upper half of the frequencies that the values resolve.
    """
    strengths = np.abs(np.fft.rfft(_window(len(rate)) * rate))
    return float(strengths[len(strengths) // 2 :].max())


def _axes(path: Path) -> tuple[Array, Array]:
    """Return the axis of rotation in space, and the axis of the body in its principal axes."""
    com = np.array(path.scene.body.principal_com)
    if not path.m[0].any() and not (path.scene.gravity and com.any()):
        return np.array((0.0, 0.0, 1.0)), np.array((0.0, 0.0, 1.0))  # at rest
    if path.scene.gravity and com.any():
        side = -1.0 if path.scene.body.kind == "lagrange" and com.sum() < 0.0 else 1.0
        return np.array((0.0, 0.0, 1.0)), side * com / np.linalg.norm(com)
    momentum = path.frame @ path.m[0]
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


def _perpendicular(v: Array) -> Array:
    """Return a unit vector at right angles to the unit vector `v`."""
    made: Array = np.cross(v, np.eye(3)[np.abs(v).argmin()])
    return made / float(np.linalg.norm(made))


def _window(n: int) -> Array:
    window = np.kaiser(n, math.pi * _SHARPNESS)
    made: Array = window / window.sum()
    return made


def _lines(t: Array, signal: Waves, n: int) -> tuple[Array, Waves, float]:
    """Return the n strongest lines of a signal: frequencies, amplitudes, and the remainder."""
    window, left = _window(len(t)), signal.astype(np.complex128)
    frequency, amplitude = np.empty(n), np.empty(n, dtype=np.complex128)
    for k in range(n):
        frequency[k] = _peak(t, window * left)
        wave = np.exp(1j * frequency[k] * t)
        amplitude[k] = (window * left) @ wave.conj()
        left = left - amplitude[k] * wave
    size = math.sqrt(float(window @ np.abs(signal) ** 2))
    rest = math.sqrt(float(window @ np.abs(left) ** 2)) / size if size > 0.0 else 0.0
    return frequency, amplitude, rest


def _peak(t: Array, signal: Waves) -> float:
    """Find the largest value of the transform of a signal: the best of an FFT, refined."""
    size = 4 * len(t)
    step = float(t[-1] - t[0]) / (len(t) - 1)
    best = int(np.abs(np.fft.fft(signal, size)).argmax())
    found = math.tau * (best - size if 2 * best > size else best) / (size * step)
    since = t - 0.5 * (t[0] + t[-1])
    for _ in range(_ROUNDS):
        wave = signal * np.exp(-1j * found * since)
        sum0, sum1, sum2 = wave.sum(), (wave * since).sum(), (wave * since * since).sum()
        slope = float((sum0.conjugate() * -1j * sum1).real)
        bend = float(abs(sum1) ** 2 - (sum0.conjugate() * sum2).real)
        if not bend < 0.0:
            break
        found -= slope / bend
    return found
