"""Starts at a given energy, and turning points of the nutation."""

from __future__ import annotations

import math
from typing import NamedTuple, cast

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from .._core import cosine, exact_turning, sine, statuses
from .._utils.arguments import Array, as_float, as_int, freeze_array, short_repr, validate_type
from .._utils.arguments import as_finite_array as array_of
from ..quaternion import turn_back
from .body import Body
from .parameters import list_disturbances, resolve_gravity
from .scene import Scene, Scenes

_TRIALS = 1 << 14  # largest number of draws for one start
_ROWS, _WORDS = 1 << 12, 8  # starts drawn in one batch; random 64-bit words per draw
_GRID = 48  # heights in the grid that is searched for the minimum of U; twice as many angles
_LARGEST = 1e150  # energies below this can be squared without overflow
_CELLS, _HALVINGS = 1024, 120  # cells at which splitting ends; largest number of splittings
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class _EnergySurface(NamedTuple):
    """The energy surface of a body in principal axes, with lever = mass * gravity * com."""

    moments: Array
    lever: Array
    energy: float
    vertical: float

    def potential(self, P: Array) -> Array:
        """Return the potential U for vertical directions P, an array of shape (n, 3)."""
        values: Array = P @ self.lever + 0.5 * self.vertical**2 / (P * P @ self.moments)
        return values

    def momentum(self, P: Array, alpha: Array) -> Array:
        """Return the angular momenta for the vertical directions P and velocity angles alpha."""
        JP, root = self.moments * P, np.sqrt(self.moments)
        first, second = self._build_scaled_velocity_basis(P)
        kinetic = np.maximum(self.energy - self.potential(P), 0.0)
        y = cosine(alpha)[:, None] * first + sine(alpha)[:, None] * second
        rate = self.vertical / (P * JP).sum(axis=1)
        momenta: Array = rate[:, None] * JP + np.sqrt(2.0 * kinetic)[:, None] * root * y
        return momenta

    def _build_scaled_velocity_basis(self, P: Array) -> tuple[Array, Array]:
        """Return an orthonormal basis of y = J^(-1/2) w, orthogonal to J^(1/2) P."""
        normal = np.sqrt(self.moments) * P
        return _build_perpendicular_basis(normal / np.linalg.norm(normal, axis=1)[:, None])

    def find_angle_of_level_apex_motion(self, P: Array, apex: Array) -> Array:
        """Return one of the two angles alpha of w for which the apex moves horizontally."""
        first, second = self._build_scaled_velocity_basis(P)
        velocity = np.cross(apex, P) / np.sqrt(self.moments)
        angles: Array = np.arctan2(-(velocity * first).sum(axis=1), (velocity * second).sum(axis=1))
        return angles

    def potential_lower_bound(self, P: Array, reach: Array) -> Array:
        """Return a lower bound on U within the angle `reach` of P, from its slope and curvature."""
        vertical_moment = P * P @ self.moments
        k = (self.vertical / vertical_moment) ** 2
        slope = self.lever - k[:, None] * self.moments * P
        slope_size = np.linalg.norm(slope - (slope * P).sum(axis=1)[:, None] * P, axis=1)
        least, spread = self.moments.min(), np.ptp(self.moments)
        bend = float(np.linalg.norm(self.lever)) + (self.vertical / least) ** 2 * spread * (
            1.0 + spread / least
        )
        bounds: Array = self.potential(P) - reach * (slope_size + 0.5 * bend * reach)
        return bounds

    def find_min_potential(self) -> float:
        """Return the minimum of U, found by refining the best grid points with Newton's method."""
        P = _convert_to_sphere_points(*_list_sphere_cell_centres((_GRID, 2 * _GRID)))
        best = P[np.argsort(self.potential(P))[:8]]
        return min(self._find_potential_min_by_newton(point) for point in best)

    def _find_potential_min_by_newton(self, P: Array) -> float:
        """Return a local minimum of U near P by Newton's method on the sphere.

        A step uses the absolute curvatures, so U decreases along it. It is halved until U is least.
        """
        lowest = float(self.potential(P[None])[0])
        for _ in range(100):
            JP = self.moments * P
            k = (self.vertical / (P @ JP)) ** 2
            slope, sides = self.lever - k * JP, np.concatenate(_build_perpendicular_basis(P[None]))
            bend = 4.0 * k / (P @ JP) * np.outer(JP, JP) - k * np.diag(self.moments)
            values, vectors = np.linalg.eigh(sides @ (bend - P @ slope * np.eye(3)) @ sides.T)
            steepest = np.abs(values).max()
            if not steepest > 0.0:
                break
            step = vectors.T @ sides @ slope / np.maximum(np.abs(values), 1e-9 * steepest)
            direction = -vectors @ step @ sides / max(1.0, 2.0 * float(np.linalg.norm(step)))
            trials = P + np.multiply.outer(0.5 ** np.arange(40.0), direction)
            trials /= np.linalg.norm(trials, axis=1)[:, None]
            potential = self.potential(trials)
            index = int(potential.argmin())
            if not potential[index] < lowest:
                break
            P, lowest = trials[index], float(potential[index])
        return lowest


def starts(
    body: Body,
    *,
    energy: float,
    vertical: float,
    n: int | None = None,
    grid: ArrayLike | None = None,
    seed: int = 0,
    gravity: float | None = None,
) -> Scenes:
    """Return tops that all have the same energy and vertical momentum.

    energy    kinetic plus potential energy, as path.energy [M L^2 T^-2]
    vertical  vertical momentum <m, e3>, as path.vertical_momentum [M L^2 T^-1]
    n         number of random starts, uniformly distributed in the (Liouville) volume of the energy
              surface; start i depends only on `seed` and i
    grid      alternative to n: two or three integers. Two integers are the numbers of heights of
              the apex and of angles about the apex. Each top then starts at a highest or lowest
              point of its apex, as in kreisel.section, once with each of the two possible momenta.
              Three integers are the numbers of heights of the vertical along the body's third axis,
              of angles about that axis, and of directions of the momentum. Starts lie at the
              centres of cells of equal size. A cell is omitted if no start exists at its centre
    gravity   as in kreisel.Scene

    The heading of a top affects neither its energy nor its vertical momentum, so each attitude is
    the smallest rotation from the upright position. Raises ValueError if no initial state has the
    given energy and vertical momentum; the message states the least possible energy. Raises
    ValueError also if the body has a rotor.

    >>> import kreisel as kr
    >>> tops = kr.starts(kr.scenes.asymmetric.body, energy=2, vertical=1, gravity=1, n=3)
    >>> [round(float(kr.solve(top, [0.0]).energy[0]), 12) for top in tops]
    [2.0, 2.0, 2.0]
    """
    _ = validate_type("body", body, Body)._block  # refuses many bodies
    if any(body.rotor) or body._has_wheels:
        raise ValueError(
            "starts does not support a body with a rotor: the energy surface depends on the rotor"
        )
    g = as_float("gravity", resolve_gravity(gravity, body))
    surface = _EnergySurface(
        np.array(body.moments),
        body.mass * g * np.array(body.principal_com),
        as_float("energy", energy),
        as_float("vertical", vertical),
    )
    _refuse_overflow(surface)
    if (n is None) == (grid is None):
        raise ValueError(f"give exactly one of n and grid, not {'none' if n is None else 'both'}")
    least = surface.find_min_potential()
    if surface.energy < least:
        raise ValueError(
            f"no start has energy = {surface.energy!r} with vertical = {surface.vertical!r}: the "
            f"smallest energy with this value is {least!r}"
        )
    principal_axes = np.array([turn_back(body.axes, e) for e in _AXES])
    if n is None:
        P, alpha = _place_starts_on_grid(surface, grid, principal_axes, body)
    else:
        P, alpha = _sample_directions(surface, as_int("n", n, 0), as_int("seed", seed, 0), least)
    M = surface.momentum(P, alpha) @ principal_axes.T
    q = compute_rotations_to_vertical(P @ principal_axes.T)
    tops = Scene(body, body_momentum=M, attitude=q, gravity=g)._note_varying_parameters([])
    return cast(Scenes, tops)


def _refuse_overflow(surface: _EnergySurface) -> None:
    """Raise ValueError if values of the calculation would exceed the range of doubles."""
    vertical, energy, lever = surface.vertical, surface.energy, np.abs(surface.lever).max()
    rotation_energy = vertical * vertical / float(surface.moments.min())
    if not rotation_energy < _LARGEST:
        raise ValueError(f"vertical = {vertical!r} is too large for the moments of this body")
    if not lever < _LARGEST:
        raise ValueError("mass gravity |com| of this body is too large")
    if not 4.0 * abs(energy) * max(1.0, float(surface.moments.max())) < math.inf:
        raise ValueError(f"energy = {energy!r} is too large for the moments of this body")


def _place_starts_on_grid(
    surface: _EnergySurface, grid: object, principal_axes: Array, body: Body
) -> tuple[Array, Array]:
    """Return a grid of vertical directions P and angles alpha on the energy surface."""
    sizes = array_of("grid", grid, "2 or 3 whole numbers")
    if sizes.shape not in {(2,), (3,)}:
        raise ValueError(f"grid must be 2 or 3 whole numbers, not {short_repr(grid)}")
    counts = [as_int("grid", int(k) if k.is_integer() else k, 1) for k in sizes.tolist()]
    apex = np.array(body.principal_com)
    apex = apex / np.linalg.norm(apex) if apex.any() else np.array(_AXES[2])
    frame = np.stack([*np.concatenate(_build_perpendicular_basis(apex[None])), apex])
    if len(counts) == 3:
        frame = principal_axes
    P = _convert_to_sphere_points(*_list_sphere_cell_centres((counts[0], counts[1]))) @ frame
    P = P[surface.potential(P) <= surface.energy]
    if not len(P):
        raise ValueError(
            f"no cell of grid = {short_repr(grid)} has its centre on the energy surface: use a "
            "finer grid, or n random starts"
        )
    directions = counts[2] if len(counts) == 3 else 2
    begin = np.full(len(P), math.pi / directions)
    if len(counts) == 2:
        begin = surface.find_angle_of_level_apex_motion(P, apex)
    alpha = begin[:, None] + math.tau * np.arange(directions) / directions
    return np.repeat(P, directions, axis=0), alpha.reshape(-1)


def _sample_directions(
    surface: _EnergySurface, n: int, seed: int, least: float
) -> tuple[Array, Array]:
    """Return random vertical directions, in principal axes, and random angles alpha."""
    cover = _cover_allowed_directions(surface)
    P, alpha = np.empty((n, 3)), np.empty(n)
    for begin in range(0, n, _ROWS):
        rows = np.arange(begin, min(begin + _ROWS, n))
        for trial in range(_TRIALS):
            # Philox counts, so that the numbers of a row depend only on the seed, trial and row.
            counter = [begin * _WORDS // 4, 0, trial + 1, 0]
            raw = np.random.Philox(key=seed, counter=counter).random_raw(
                (int(rows[-1]) + 1 - begin) * _WORDS
            )
            uniform = (raw >> np.uint64(11)).astype(np.float64).reshape(-1, _WORDS) * 2.0**-53
            samples = uniform[rows - begin]
            points, chance = cover.draw_points(samples), samples[:, 3] ** 2
            is_uniform = chance * (points * points @ surface.moments) <= surface.moments.min()
            is_accepted = is_uniform & (surface.potential(points) <= surface.energy)
            P[rows[is_accepted]] = points[is_accepted]
            alpha[rows[is_accepted]] = math.tau * samples[is_accepted, 4]
            rows = rows[~is_accepted]
            if not rows.size:
                break
        else:
            raise ValueError(
                f"none of {_TRIALS} random verticals allows a start: energy = {surface.energy!r} "
                f"lies near the least energy {least!r}, or the body is nearly a line"
            )
    return P, alpha


class _SphereCells(NamedTuple):
    """Cells on the unit sphere, each bounded by two heights and two azimuths."""

    height: Array
    angle: Array
    tall: Array
    wide: Array

    def draw_points(self, samples: Array) -> Array:
        """Return uniformly distributed points in the cells, from three random numbers for each."""
        parts = np.cumsum(self.tall * self.wide)
        cell = np.searchsorted(parts / parts[-1], samples[:, 0], side="right")
        height = self.height[cell] + self.tall[cell] * samples[:, 1]
        return _convert_to_sphere_points(height, self.angle[cell] + self.wide[cell] * samples[:, 2])

    def find_centres_and_radii(self) -> tuple[Array, Array]:
        """Return each cell's centre, and a bound on its angular distance to points in the cell."""
        middle = self.height + 0.5 * self.tall
        polar = np.arccos(np.clip([self.height, middle, self.height + self.tall], -1.0, 1.0))
        rise = np.maximum(polar[0] - polar[1], polar[1] - polar[2])
        side = 0.5 * self.wide * np.sin(polar[1])
        return _convert_to_sphere_points(middle, self.angle + 0.5 * self.wide), rise + side

    def halve(self) -> _SphereCells:
        """Divide each cell into two halves across its longer side."""
        height = self.height + 0.5 * self.tall
        level = np.sqrt(np.maximum((1.0 - height) * (1.0 + height), self.tall))
        lower = self.tall / level > self.wide * level
        tall, wide = np.where(lower, 0.5, 1.0) * self.tall, np.where(lower, 1.0, 0.5) * self.wide
        heights = np.concatenate((self.height, self.height + self.tall - tall))
        angles = np.concatenate((self.angle, self.angle + self.wide - wide))
        return _SphereCells(heights, angles, np.tile(tall, 2), np.tile(wide, 2))


def _cover_allowed_directions(surface: _EnergySurface) -> _SphereCells:
    """Return small cells that cover all directions P with U(P) <= energy."""
    height, angle = (x.ravel() for x in np.meshgrid([-1.0, 0.0], 0.5 * math.pi * np.arange(4)))
    cover = _SphereCells(height, angle, np.ones(8), np.full(8, 0.5 * math.pi))
    for _ in range(_HALVINGS):
        P, reach = cover.find_centres_and_radii()
        is_allowed = surface.potential_lower_bound(P, reach) <= surface.energy
        if is_allowed.any():
            cover = _SphereCells(*(column[is_allowed] for column in cover))
        if len(cover.height) >= _CELLS:
            break
        cover = cover.halve()
    return cover


def compute_rotations_to_vertical(P: Array) -> Array:
    """Return the smallest rotations that take the body-frame vector P to e3."""
    x, y, z = P.T
    with np.errstate(invalid="ignore", divide="ignore"):
        w = np.where(z > 0.0, 1.0 + z, (x * x + y * y) / (1.0 - z))  # 1 + z, without cancellation
        q = np.stack((w, y, -x, np.zeros_like(x)), axis=1)
        q /= np.linalg.norm(q, axis=1)[:, None]
    q[~np.isfinite(q).all(axis=1)] = (0.0, 1.0, 0.0, 0.0)
    return q


def _list_sphere_cell_centres(counts: tuple[int, int]) -> tuple[Array, Array]:
    """Return the heights and azimuths of the centres of cells of equal area on the sphere."""
    heights, angles = ((np.arange(k) + 0.5) / k for k in counts)
    height, angle = np.meshgrid(2.0 * heights - 1.0, math.tau * angles, indexing="ij")
    return height.ravel(), angle.ravel()


def _convert_to_sphere_points(height: Array, angle: Array) -> Array:
    """Return points on the unit sphere, given their heights and azimuths."""
    radius = np.sqrt(np.maximum((1.0 - height) * (1.0 + height), 0.0))
    return np.stack((radius * cosine(angle), radius * sine(angle), height), axis=-1)


def _build_perpendicular_basis(normals: Array) -> tuple[Array, Array]:
    """Return, for each row, two unit vectors orthogonal to the row and to each other."""
    first = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1)[:, None]
    return first, np.cross(normals, first)


class TurningPoints(NamedTuple):
    """Turning points of the apex in n motions. All fields except `rows` have the shape (n,).

    least, greatest      least and greatest nutation [rad]
    t_least, t_greatest  first times at which they occur [T]
    critical_spin        spin above which an upright top is a sleeping top [rad/T]; a rotor along
                         the apex reduces it
    motion_type          the type of motion, as text
    rows                 (n, 10) rows of the core: the numbers above, and coefficients of the
                         potential
    """

    least: Array
    greatest: Array
    t_least: Array
    t_greatest: Array
    critical_spin: Array
    motion_type: npt.NDArray[np.str_]
    rows: Array


def build_turning_points_from_rows(rows: Array, motion_type: npt.NDArray[np.str_]) -> TurningPoints:
    least, greatest, t_least, t_greatest, spin = (freeze_array(x.copy()) for x in rows.T[:5])
    motion_type.flags.writeable = False
    return TurningPoints(least, greatest, t_least, t_greatest, spin, motion_type, rows)


def compute_turning_points(scene: Scene) -> TurningPoints:
    """Compute the turning points of the motion of a scene; raise ValueError if there are none."""
    status, row, motion_type = exact_turning(scene._block)
    if status != "OK":
        raise ValueError(explain_no_turning_points(status, scene))
    return build_turning_points_from_rows(row[None], np.array([motion_type]))


def explain_no_turning_points(status: str, scene: Scene) -> str:
    """Explain why the turning points of a motion are not defined."""
    if status != "ERR_METHOD":
        return f"{statuses[status][1]}: {scene!r}"
    others = list_disturbances(scene)
    text = "a damped top" if "damping" in others else f"this one, of kind {scene.body.kind!r},"
    words = ["a rotor"] * any(scene.body.rotor) + [name for name in others if name != "damping"]
    text += "".join(f" with {word}" for word in words)
    return (
        "turning points exist for a Lagrange top, and for a body that is symmetric about its apex "
        f"and free of torque; the nutation of {text} is not periodic"
    )
