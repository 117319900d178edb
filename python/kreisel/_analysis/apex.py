"""The trace of the apex on the unit sphere, and the nutation and precession of a Lagrange top."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .._model.environment import refuse_disturbances
from .._model.scene import Scene
from .._results.path import Path
from .._solve.exact import Exact, exact
from .._utils.counts import format_count
from .._utils.validation import Array, validate_type
from .turns import Waves

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

    def _measure_steady_nutation(self, top: Exact) -> Nutation:
        radius = np.hypot(*self.trace[:, :2].T)
        nutation = np.arctan2(radius, self.height)
        angle, duration = self.azimuth[-1] - self.azimuth[0], self.t[-1] - self.t[0]
        rate = float(angle / duration) if duration else math.nan
        # Near the vertical, a nutation may be hidden.
        if float(radius.max()) ** 2 < 2.0 * _LEVEL and not self._loses_energy:
            rate = top.precession_rate
        return Nutation(float(nutation.min()), float(nutation.max()), math.nan, rate)

    def _refuse_coarse_sampling(self, top: Exact) -> None:
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
    validate_type("path", path, Path)
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
