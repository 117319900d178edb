"""Starts with a given energy and vertical momentum, as sections of the phase space ask for.

With the vertical P seen from the body, the momentum M = m_v J P / (P J P) + w, w across P, has the
vertical part m_v and the energy U(P) + w J^-1 w / 2, where
    U(P) = mass gravity <com, P> + m_v^2 / (2 P J P)
is the amended potential (Smale 1970). So a start exists for each P with U <= energy and for each
direction of w, of which the length alone is sought, without cancellation. The volume of the energy
surface is dP dalpha / sqrt(P J P), alpha the angle of J^-1/2 w: random starts are drawn from that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._ground.arguments import Array, instance, number, row, shown, whole
from ..quaternion import turn_back
from .body import Body
from .scene import Scene

_DRAWS, _BLOCKS = 256, 4096  # rows of random numbers at once, and at most so often for a start
_GRID = 48  # heights at which the least energy is looked for, and twice as many angles
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class _Surface(NamedTuple):
    """A body in principal axes, with lever = mass gravity com, and the two integrals."""

    moments: Array
    lever: Array
    energy: float
    vertical: float

    def potential(self, P: Array) -> Array:
        """U, of verticals (n, 3)."""
        made: Array = P @ self.lever + 0.5 * self.vertical**2 / (P * P @ self.moments)
        return made

    def momentum(self, P: Array, alpha: float) -> Array:
        """M at the angle alpha, from the vertical P (3,)."""
        across = self.moments * P
        root = np.sqrt(self.moments)
        # In y = J^-1/2 w the energy is y^2 / 2, and w across P is y across J^1/2 P.
        first, second = _across(root * P / np.linalg.norm(root * P))
        left = max(self.energy - float(self.potential(P[None])[0]), 0.0)
        y = math.cos(alpha) * first + math.sin(alpha) * second
        made: Array = self.vertical / (P @ across) * across + math.sqrt(2.0 * left) * root * y
        return made

    def least(self) -> float:
        """The least of U: the best points of a grid, led downhill."""
        P = _verticals(*_middles((_GRID, 2 * _GRID)))
        best = P[np.argsort(self.potential(P))[:8]]
        return min(self._downhill(at) for at in best)

    def _downhill(self, P: Array) -> float:
        """The least of U near P, by Newton's method on the sphere; where U is not convex it goes
        the other way, and as far as U falls."""
        lowest = float(self.potential(P[None])[0])
        for _ in range(100):
            JP = self.moments * P
            k = (self.vertical / (P @ JP)) ** 2
            slope, sides = self.lever - k * JP, np.array(_across(P))
            bend = 4.0 * k / (P @ JP) * np.outer(JP, JP) - k * np.diag(self.moments)
            values, vectors = np.linalg.eigh(sides @ (bend - P @ slope * np.eye(3)) @ sides.T)
            steepest = np.abs(values).max()
            if not steepest > 0.0:
                break
            step = vectors.T @ sides @ slope / np.maximum(np.abs(values), 1e-9 * steepest)
            way = -vectors @ step @ sides / max(1.0, 2.0 * float(np.linalg.norm(step)))
            tried = P + np.multiply.outer(0.5 ** np.arange(40.0), way)
            tried /= np.linalg.norm(tried, axis=1)[:, None]
            potential = self.potential(tried)
            at = int(potential.argmin())
            if not potential[at] < lowest:
                break
            P, lowest = tried[at], float(potential[at])
        return lowest


def starts(
    body: Body,
    *,
    energy: float,
    vertical: float,
    n: int | None = None,
    grid: ArrayLike | None = None,
    seed: int = 0,
    gravity: float = 1.0,
) -> list[Scene]:
    """Scenes that all have this energy and this vertical momentum, for sections and for chaos.

    energy    kinetic and potential, path.energy [M L^2 T^-2]
    vertical  <m, e3>, path.vertical_momentum [M L^2 T^-1]
    n         how many at random, even in the volume of the energy surface; start number i depends
              on seed and i alone
    grid      in place of n: three whole numbers, how many heights of the vertical in the body along
              its third axis, angles of it about that axis, and directions of the momentum left. All
              are in the middle of cells of equal size; those that no start has are left out

    The heading, which changes neither, is that of the shortest turn from upright. Raises ValueError
    where no start exists, with the least energy that has one.

    >>> import kreisel as kr
    >>> tops = kr.starts(kr.scenes.asymmetric.body, energy=2.0, vertical=1.0, n=3, seed=7)
    >>> [round(float(kr.solve(top, [0.0]).energy[0]), 12) for top in tops]
    [2.0, 2.0, 2.0]
    """
    instance("body", body, Body)
    g = number("gravity", gravity)
    surface = _Surface(
        np.array(body.moments),
        body.mass * g * np.array(body.principal_com),
        number("energy", energy),
        number("vertical", vertical),
    )
    if (n is None) == (grid is None):
        raise ValueError(f"give exactly one of n and grid, not {'none' if n is None else 'both'}")
    least = surface.least()
    if surface.energy < least:
        raise ValueError(
            f"no start has energy = {surface.energy!r} with vertical = {surface.vertical!r}: the "
            f"least energy there is {least!r}"
        )
    to_principal = np.array([turn_back(body.axes, e) for e in _AXES])
    found = (
        _on_grid(surface, grid, to_principal)
        if n is None
        else _at_random(surface, whole("n", n, 0), whole("seed", seed, 0), least)
    )
    return [
        _scene(body, to_principal @ P, to_principal @ surface.momentum(P, alpha), g)
        for P, alpha in found
    ]


def _on_grid(surface: _Surface, grid: object, to_principal: Array) -> Iterator[tuple[Array, float]]:
    """Verticals in principal axes, and angles of the momentum."""
    sizes = row("grid", grid, 3, "3 whole numbers")
    heights, angles, directions = (whole("grid", int(k) if k.is_integer() else k, 1) for k in sizes)
    P = _verticals(*_middles((heights, angles))) @ to_principal
    P = P[surface.potential(P) <= surface.energy]
    if not len(P):
        raise ValueError(
            f"no middle of a cell of grid = {shown(grid)} has so little energy: make it finer, or "
            "take n starts at random"
        )
    return ((at, math.tau * (k + 0.5) / directions) for at in P for k in range(directions))


def _at_random(surface: _Surface, n: int, seed: int, least: float) -> Iterator[tuple[Array, float]]:
    """Verticals in principal axes, and angles of the momentum."""
    for index in range(n):
        random = np.random.default_rng([seed, index])
        for _ in range(_BLOCKS):
            height, angle, chance, alpha = random.random((4, _DRAWS))
            P = _verticals(2.0 * height - 1.0, math.tau * angle)
            even = chance**2 * (P * P @ surface.moments) <= surface.moments.min()
            taken = even & (surface.potential(P) <= surface.energy)
            if taken.any():
                at = int(taken.argmax())
                yield P[at], math.tau * float(alpha[at])
                break
        else:
            raise ValueError(
                f"energy = {surface.energy!r} lies so near the least, {least!r}, that none of "
                f"{_DRAWS * _BLOCKS} random verticals can have it"
            )


def _scene(body: Body, P: Array, M: Array, gravity: float) -> Scene:
    """The scene that sees the vertical P and the momentum M, in the frame of description."""
    x, y, z = P.tolist()
    up = 1.0 + z if z > 0.0 else (x * x + y * y) / (1.0 - z)  # 1 + z, without cancellation
    size = math.hypot(up, x, y)
    q = (up / size, y / size, -x / size, 0.0) if size > 0.0 else (0.0, 1.0, 0.0, 0.0)
    return Scene(body, body_momentum=M, attitude=q, gravity=gravity)


def _middles(counts: tuple[int, int]) -> tuple[Array, Array]:
    """Heights and angles of the middles of cells of equal size on the sphere."""
    heights, angles = ((np.arange(k) + 0.5) / k for k in counts)
    height, angle = np.meshgrid(2.0 * heights - 1.0, math.tau * angles, indexing="ij")
    return height.ravel(), angle.ravel()


def _verticals(height: Array, angle: Array) -> Array:
    across = np.sqrt((1.0 - height) * (1.0 + height))
    return np.stack((across * np.cos(angle), across * np.sin(angle), height), axis=-1)


def _across(normal: Array) -> tuple[Array, Array]:
    """Two unit vectors at right angles to this one and to each other."""
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    first /= np.linalg.norm(first)
    return first, np.cross(normal, first)
