"""The trace of a top's axis on the unit sphere, and its nutation and precession."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .._model.scene import Scene
from .._results.path import Path
from .._solve.exact import exact
from .._utils.validation import Array, check_type

_LEVEL = 1e-9  # solutions by a tolerance of 1e-10 differ in height by about as much
_FEWEST = 4  # states in a nutation: of three the period can be a hundredth off, of two a half


class Nutation(NamedTuple):
    """The nutation and precession of a Lagrange top.

    `least` and `greatest` nutation are angles 0 .. pi [rad], `period` is that of the nutation [T],
    and `precession` is the mean rate about the vertical [T^-1].
    """

    least: float
    greatest: float
    period: float
    precession: float


@dataclass(frozen=True, eq=False)
class Apex:
    """n points of the trace.

    t      (n,) times [T]
    trace  (n, 3) unit vectors from the fixed point to the centre of mass
    rate   (n, 3) their change [T^-1]
    scene  whose path it is
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
        return f"<kreisel.Apex: {len(self.t)} points, {span}; {heights}; kind {kind!r}>"

    @property
    def height(self) -> Array:
        """(n,) <apex, e3>, from -1 to 1."""
        return self.trace[:, 2]

    @cached_property
    def azimuth(self) -> Array:
        """(n,) angle about the vertical from e1 on, without jumps of whole turns [rad].

        It is undefined where the trace goes through the vertical, and known beyond that point up to
        whole turns only.
        """
        return np.unwrap(np.arctan2(self.trace[:, 1], self.trace[:, 0]))

    def nutation(self) -> Nutation:
        """Means of a Lagrange top over the complete nutations of the path.

        They extend from its first to its last lowest point. kreisel.exact gives the same numbers of
        a scene; this property reads them from the path of any method. Turning points lie between
        the states and are found by cubics: with fifty states in a nutation they are right to four
        digits, with four hundred to seven. A level trace, whose heights differ by less than 1e-9,
        is steady precession, and its period is NaN. Raises ValueError for other tops, whose rise
        and fall have no period, for less than one nutation, and if states are farther apart than a
        quarter of one.
        """
        body = self.scene.body
        if body.kind != "lagrange":
            raise ValueError(
                "nutation and precession belong to Lagrange tops, not to a body of kind "
                f"{body.kind!r}"
            )
        if not len(self.t):
            raise ValueError("a path without states has no nutation: solve for times")
        if np.ptp(self.height) < _LEVEL:
            return self._level_nutation()
        self._check_sampling()
        low, high = self._turning_times(1.0), self._turning_times(-1.0)
        if len(low) < 2:
            raise ValueError(
                f"the axis has {len(low)} lowest points in this path, and two make a nutation: "
                "solve for longer times"
            )
        first, last = low[0], low[-1]
        period = (last - first) / (len(low) - 1)
        turned = self._interpolate_at(self.azimuth, last) - self._interpolate_at(
            self.azimuth, first
        )
        greatest, least = (
            float(np.mean([self._nutation_at(t) for t in times])) for times in (low, high)
        )
        return Nutation(least, greatest, period, turned / (last - first))

    def _level_nutation(self) -> Nutation:
        nutation = np.arctan2(np.hypot(*self.trace[:, :2].T), self.height)
        turned, took = self.azimuth[-1] - self.azimuth[0], self.t[-1] - self.t[0]
        rate = float(turned / took) if took else math.nan
        return Nutation(float(nutation.min()), float(nutation.max()), math.nan, rate)

    def _check_sampling(self) -> None:
        """Raise ValueError if the states are too far apart to resolve the turning points."""
        top = exact(self.scene.replace(damping=(0, 0, 0)))
        period, apart = (
            2.0 * abs(top.t_least - top.t_greatest),
            float(np.abs(np.diff(self.t)).max()),
        )
        if period and _FEWEST * apart > period * (1.0 + 1e-9):
            raise ValueError(
                f"the states are up to {apart:g} apart, and a nutation takes {period:g}: ask for "
                f"{_FEWEST} states in each or more, or kr.exact(path.scene)"
            )

    def _turning_times(self, sign: float) -> list[float]:
        """Return the times at which the height is lowest (1) or highest (-1)."""
        rise = sign * self.rate[:, 2]
        after = np.flatnonzero((rise[:-1] < 0.0) & (rise[1:] >= 0.0)) + 1
        return [_find_zero(*self._neighbours(i, rise)) for i in after.tolist()]

    def _neighbours(self, i: int, values: Array) -> tuple[Array, Array]:
        """Return the four states about t[i - 1] .. t[i], or all if the path has fewer."""
        first = min(max(i - 2, 0), max(len(self.t) - 4, 0))
        return self.t[first : first + 4], values[first : first + 4]

    def _nutation_at(self, t: float) -> float:
        """Return the nutation between states.

        It follows from two smooth functions that lose no digit at a pole.
        """
        square = self._interpolate_at(self.trace[:, 0] ** 2 + self.trace[:, 1] ** 2, t)
        return math.atan2(math.sqrt(max(square, 0.0)), self._interpolate_at(self.height, t))

    def _interpolate_at(self, values: Array, t: float) -> float:
        return _interpolate(*self._neighbours(int(np.searchsorted(self.t, t)), values), t)


def apex(path: Path) -> Apex:
    """Return the trace of the centre of mass on the unit sphere.

    If the centre of mass is the fixed point, it is the trace of T.
    """
    check_type("path", path, Path)
    return Apex(path.t, path.apex, np.cross(path.velocity, path.apex), path.scene)


def _interpolate(t: Array, values: Array, at: float) -> float:
    """Evaluate the polynomial through these points at `at`."""
    total = 0.0
    for i, value in enumerate(values.tolist()):
        others = np.delete(t, i)
        total += value * float(np.prod((at - others) / (t[i] - others)))
    return total


def _find_zero(t: Array, values: Array) -> float:
    """Find the rising zero of the polynomial through these points by bisection."""
    inside = int(np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))[0])
    low, high = float(t[inside]), float(t[inside + 1])
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _interpolate(t, values, middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)
