"""Curves that belong to a path: the trace of the apex, the elastic rod, and pictures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from .._core import KIND_RTOL
from .._model.parameters import refuse_disturbances
from .._model.scene import Scene
from .._results.calls import compute_angles_between_attitudes
from .._results.path import Path, check_is_one, list_drawn_paths
from .._solve.exact import exact
from .._utils import arguments
from .._utils.arguments import Array, Vector, format_count
from .._utils.html import format_picture_as_html

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .._plot.charts import AngleBetweenPaths, FigureAxes

_LEVEL = 1e-9  # approximate error of the height in a solution with a tolerance of 1e-10
_ROUND = 24  # flat sides of a rod that approximate a round one
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

        After each passage through the vertical, it is known only up to multiples of 2 pi.
        """
        return np.unwrap(np.arctan2(self.trace[:, 1], self.trace[:, 0]))

    def nutation(self) -> Nutation:
        """Return the nutation and precession of a Lagrange top, averaged over complete periods.

        The averages extend from the first to the last minimum of the height, which are found by
        cubic interpolation between the states: four digits are correct with 50 states per nutation,
        and seven with 400, unless the apex comes close to the vertical. kreisel.exact computes the
        same values from a scene. If the height varies by less than 1e-9, the precession counts as
        steady, and the period is NaN.

        Near the vertical, the states do not determine the turns of the azimuth, and at the vertical
        it jumps by half a turn. So the number of half turns in each nutation is taken from the
        closed form, in which the jumps do not count as precession. If the apex stays within 4e-5 of
        the vertical, the whole precession is taken from the closed form. With damping or friction,
        there is none, and the precession is that of the azimuth of the states.

        Raises ValueError for a moving support, for bodies other than Lagrange tops, and if the path
        contains no complete nutation, or fewer than four states per nutation.
        """
        body = self.scene.body
        refuse_disturbances(
            self.scene,
            "nutations are not defined for tops",
            ("damping", "friction"),
            "kr.events.nutation() finds the times at which the apex is highest and lowest",
        )
        if body.kind != "lagrange":
            raise ValueError(f"nutations are defined for Lagrange tops, not for kind {body.kind!r}")
        if not len(self.t):
            raise ValueError("a path without states has no nutation: call solve with times")
        if self.t[-1] < self.t[0]:
            return Apex(self.t[::-1], self.trace[::-1], self.rate[::-1], self.scene).nutation()
        t, height, square = self.t, self.height, self.trace[:, 0] ** 2 + self.trace[:, 1] ** 2
        top = exact(self.scene.replace(damping=None, friction=None))
        is_conservative = not (any(self.scene.damping) or self.scene.friction > 0.0)
        if np.ptp(height) < _LEVEL:
            radius = np.hypot(*self.trace[:, :2].T)
            angle, duration = self.azimuth[-1] - self.azimuth[0], t[-1] - t[0]
            rate = float(angle / duration) if duration else math.nan
            # Near the vertical, a nutation may be hidden.
            if float(radius.max()) ** 2 < 2.0 * _LEVEL and is_conservative:
                rate = top.precession_rate
            nutation = np.arctan2(radius, height)
            return Nutation(float(nutation.min()), float(nutation.max()), math.nan, rate)
        period, spacing = 2.0 * abs(top.t_least - top.t_greatest), float(np.abs(np.diff(t)).max())
        if period and _FEWEST * spacing > period * (1.0 + 1e-9):
            raise ValueError(
                f"the states are up to {spacing:g} apart, and a nutation takes {period:g}: request "
                f"at least {_FEWEST} states per nutation, or use kr.exact(path.scene)"
            )
        low, high = _find_zeros(t, self.rate[:, 2]), _find_zeros(t, -self.rate[:, 2])
        if len(low) < 2:
            raise ValueError(
                f"the apex has {len(low)} lowest points in this path, but two are needed to "
                "measure a nutation: solve for a longer time"
            )
        # The height and its complement, `square`, are smooth even if the apex is near the vertical.
        means = []
        for times in (low, high):
            pairs = zip(_interpolate(t, square, times), _interpolate(t, height, times), strict=True)
            angles = [math.atan2(math.sqrt(max(s, 0.0)), h) for s, h in pairs]
            means.append(float(np.mean(angles)))
        greatest, least = means
        if is_conservative:
            # At a lowest point, the velocity is perpendicular to the position, so both turn alike.
            # The position vanishes at the vertical, and the velocity at a cusp. Their turns are
            # known up to half turns, of which those nearest to the closed form are chosen.
            position, velocity = (
                _interpolate(t, vectors[:, 0], low) + 1j * _interpolate(t, vectors[:, 1], low)
                for vectors in (self.trace, self.rate)
            )
            lengths = np.diff(low)
            is_far = np.abs(position).min() > np.abs(velocity).min() * lengths.mean() / math.tau
            direction = position if is_far else velocity
            turns = np.angle(direction[1:] * direction[:-1].conj())
            rest = (top.precession_rate * lengths - turns) / math.pi
            angle = float(np.sum(turns + math.pi * np.round(rest)))
        else:
            first, last = _interpolate(t, self.azimuth, [low[0], low[-1]]).tolist()
            angle = last - first
        span = low[-1] - low[0]
        return Nutation(least, greatest, span / (len(low) - 1), angle / span)


def _interpolate(t: Array, values: Array, times: list[float]) -> Array:
    """Return values between samples, each by the cubic through the four nearest samples."""
    found = []
    for time in times:
        first = min(max(int(np.searchsorted(t, time)) - 2, 0), max(len(t) - 4, 0))
        found.append(_evaluate_cubic(t[first : first + 4], values[first : first + 4], time))
    return np.array(found)


def _evaluate_cubic(t: Array, values: Array, time: float) -> float:
    """Return the value at `time` of the polynomial that interpolates the points (t, values)."""
    total = 0.0
    for i, value in enumerate(values.tolist()):
        others = np.delete(t, i)
        total += value * float(np.prod((time - others) / (t[i] - others)))
    return total


def _find_zeros(t: Array, rise: Array) -> list[float]:
    """Return the times at which interpolated values change from negative to positive."""
    zeros = []
    for i in (np.flatnonzero((rise[:-1] < 0.0) & (rise[1:] >= 0.0)) + 1).tolist():
        first = min(max(i - 2, 0), max(len(t) - 4, 0))
        near, values = t[first : first + 4], rise[first : first + 4]
        k = int(np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))[0])
        low, high = float(near[k]), float(near[k + 1])
        for _ in range(60):
            middle = 0.5 * (low + high)
            if _evaluate_cubic(near, values, middle) < 0.0:
                low = middle
            else:
                high = middle
        zeros.append(0.5 * (low + high))
    return zeros


def apex(path: Path) -> Apex:
    """Return the curve traced on the unit sphere by the direction of the centre of mass.

    If the centre of mass coincides with the fixed point, return the curve traced by the third
    principal axis.
    """
    check_is_one("kreisel.apex needs", path)
    return Apex(path.t, path.apex, np.cross(path.velocity, path.apex), path.scene)


@dataclass(frozen=True, eq=False)
class Rod:
    """An elastic rod in equilibrium.

    The arc length s along the rod corresponds to time in the motion of the top. The tangent T of
    the rod corresponds to the direction from the fixed point to the centre of mass.

    s          (n,) arc length [T]
    centre     (n, 3) centre line, beginning at the origin [T]: the integral over s of T,
               interpolated by a cubic polynomial in each interval
    frame      (n, 3, 3) N, B, T in space
    curvature  (n, 2) kappa1 = <T', N>, kappa2 = <T', B> [T^-1]
    torsion    (n,) tau = <N', B> [T^-1]
    stiffness  alpha1, alpha2 against bending in the directions N and B, and alpha against twist;
               they equal I_B, I_N, I_T [M L^2]
    load       vector b = -mass * gravity * |com| * e3, along which a force acts on the ends
               [M L^2 T^-2]

    Source: Bodack 2008, theorems 3.8 and 3.9, with alpha1 and alpha2 interchanged, and the opposite
    sign of the load.
    """

    s: Array
    centre: Array
    frame: Array
    curvature: Array
    torsion: Array
    stiffness: Vector
    load: Vector

    def __repr__(self) -> str:
        kind = "isotropic" if self.isotropic else "anisotropic"
        return f"<kreisel.Rod: {kind}, {len(self.s)} frames, stiffness {self.stiffness}>"

    @property
    def isotropic(self) -> bool:
        """True if the bending stiffness is the same in all directions, as for a Lagrange top."""
        alpha1, alpha2, _ = self.stiffness
        return abs(alpha1 - alpha2) <= KIND_RTOL * max(alpha1, alpha2)

    @property
    def elastic_energy_density(self) -> Array:
        """(n,) energy of bending and twist per length, the kinetic energy of the top [M L^2 T^-2].

        (alpha1 kappa1^2 + alpha2 kappa2^2 + alpha tau^2) / 2
        """
        alpha1, alpha2, alpha = self.stiffness
        bending = self.curvature**2 @ np.array((alpha1, alpha2))
        density: Array = (bending + alpha * self.torsion**2) / 2.0
        return density

    @property
    def lagrangian_density(self) -> Array:
        """(n,) elastic_energy_density + <load, T> [M L^2 T^-2].

        It is the Lagrangian of the top; in equilibrium, its integral along the rod is stationary.
        """
        total: Array = self.elastic_energy_density + self.frame[:, 2] @ np.array(self.load)
        return total

    @property
    def section(self) -> tuple[float, float]:
        """The thicknesses of the cross-section along its axes N and B, relative to the larger one.

        They are proportional to the square roots of the bending stiffnesses alpha1 and alpha2, as
        for elliptical and rectangular cross-sections.
        """
        alpha1, alpha2, _ = self.stiffness
        largest = max(alpha1, alpha2)
        return (alpha1 / largest) ** 0.5, (alpha2 / largest) ** 0.5

    def plot(
        self,
        axes: Axes | None = None,
        *,
        thickness: float | None = None,
        colour: str | None = None,
        elevation: float = 20.0,
        azimuth: float = 0.0,
        length_unit: str = "T of the top",
    ) -> Axes:
        """Draw the rod as a solid body with matplotlib, and return the axes.

        The cross-section is a circle if the rod is isotropic, and an ellipse otherwise. A dot marks
        the start of the rod, and a bar shows the scale.

        axes                the axes to draw in; default: a new figure
        thickness           the larger diameter [T]; default: a thirtieth of the rod's extent
        colour              a colour of matplotlib
        elevation, azimuth  direction of view [degrees]
        length_unit         the unit of length for the label of the scale. The arc length is the
                            time of the top

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.cusps, [0.1 * k for k in range(201)])
            >>> [text.get_text() for text in kr.rod(path).plot(length_unit="m").texts]
            ['start', '2 m']

        The rod should bend only slightly between neighbouring points. Raises ValueError if the rod
        has fewer than two states, and ImportError if matplotlib is not installed.
        """
        from .._plot import charts
        from .._plot.film import draw_solid_faces

        target = charts.open_chart(axes)
        side = None if thickness is None else arguments.as_positive("thickness", thickness)
        view = arguments.as_float("elevation", elevation), arguments.as_float("azimuth", azimuth)
        unit = arguments.as_unit_name("length_unit", length_unit)
        if len(self.s) < 2:
            states = format_count(len(self.s), "state")
            raise ValueError(f"a rod of {states} cannot be drawn: solve for more times")
        side = float(np.ptp(self.centre, axis=0).max()) / 30.0 if side is None else side
        draw_solid_faces(target, self._build_faces(side), colour or charts.ORANGE, *view)
        charts.set_equal_scale_and_hide_frame(target)
        charts.draw_start_and_scale_bar(self.centre, target, unit, *view)
        return target

    def _build_faces(self, thickness: float) -> Array:
        """Return the faces (n, 4, 3) of a tube, round or with an elliptical cross-section."""
        section, normals = self.section, self.frame[:, :2]
        if self.isotropic:  # the normals do not twist about the curve
            section, tangent, first = (1.0, 1.0), self.frame[:, 2], np.empty_like(self.centre)
            normal = np.eye(3)[np.argmin(np.abs(tangent[0]))]
            for k, direction in enumerate(tangent):
                normal = normal - (normal @ direction) * direction
                normal = normal / np.linalg.norm(normal)
                first[k] = normal
            normals = np.stack([first, np.cross(tangent, first)], axis=1)
        # The points of a path back in time are reversed, so that they follow the tangents.
        order = slice(None, None, -1 if self.s[-1] < self.s[0] else 1)
        centre, normals = self.centre[order], normals[order]
        angle = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * np.array(section)
        ring *= 0.5 * thickness
        rims = centre[:, None] + np.einsum("cj,njk->nck", ring, normals)
        pieces = np.arange(0, _ROUND, 2)[:, None] + np.arange(3)  # rim points of the end faces
        ends = []
        for k, corners in (0, pieces[:, ::-1]), (-1, pieces):
            middle = np.broadcast_to(centre[k], (len(pieces), 1, 3))
            ends.append(np.concatenate([middle, rims[k, corners % _ROUND]], axis=1))
        shifted = np.roll(rims, -1, axis=1)
        sides = np.stack([rims[:-1], shifted[:-1], shifted[1:], rims[1:]], axis=2)
        return np.concatenate([sides.reshape(-1, 4, 3), *ends])

    def _repr_html_(self) -> str | None:
        """Return an image of the rod, or None if the rod has fewer than two states."""
        return format_picture_as_html(self.plot, repr(self)) if len(self.s) > 1 else None


def rod(path: Path) -> Rod:
    """Return the elastic rod that corresponds to a path under Kirchhoff's analogy.

    The rod carries no load if the centre of mass coincides with the fixed point.

    Raises ValueError if there is damping, friction, a rotor or a moving support, or if the centre
    of mass lies on no principal axis.

        >>> import kreisel as kr
        >>> rod = kr.rod(kr.solve(kr.scenes.thesis, [0.1 * k for k in range(101)]))
        >>> rod.centre.shape, bool(rod.stiffness[0] == rod.stiffness[1])
        ((101, 3), True)
    """
    check_is_one("kreisel.rod needs", path)
    body = path.scene.body
    if path.scene._has_damping:
        raise ValueError("Kirchhoff's analogy has no rod for a damped top")
    refuse_disturbances(path.scene, "Kirchhoff's analogy has no rod for a top")
    if any(body.rotor):
        raise ValueError("Kirchhoff's analogy has no rod for a body with a rotor")
    com, moments = np.array(body.principal_com), np.array(body.moments)
    reach = float(np.linalg.norm(com))
    tangent = com / reach if reach > 0.0 else np.array((0.0, 0.0, 1.0))
    moment = (moments * tangent) @ tangent
    if np.linalg.norm(moments * tangent - moment * tangent) > KIND_RTOL * moments.max():
        raise ValueError(
            "Kirchhoff's analogy has no rod for this top, because its centre of mass, "
            f"{body.principal_com} along the principal axes, lies on none of them"
        )
    k = int(np.argmin(np.abs(tangent)))
    normal = np.eye(3)[k] - tangent[k] * tangent
    normal /= np.linalg.norm(normal)
    axes = np.stack([normal, np.cross(tangent, normal), tangent])  # along the principal axes
    frame = np.einsum("ij,njk->nik", axes, path.frame)
    i_n, i_b, i_t = ((axes**2) @ moments).tolist()
    rate_n, rate_b, rate_t = np.einsum("nij,nj->in", frame, path.velocity)
    # The integral of the cubic Hermite interpolant of the tangent over each interval.
    slopes, h = np.cross(path.velocity, frame[:, 2]), np.diff(path.t)[:, None]
    pieces = h / 2.0 * (frame[1:, 2] + frame[:-1, 2]) - h**2 / 12.0 * (slopes[1:] - slopes[:-1])
    return Rod(
        s=path.t,
        centre=np.concatenate([np.zeros((1, 3)), np.cumsum(pieces, axis=0)]),
        frame=frame,
        # Bending towards N rotates the frame about B, and bending towards B about -N.
        curvature=np.stack([rate_b, -rate_n], axis=-1),
        torsion=rate_t,
        stiffness=(i_b, i_n, i_t),
        load=(0.0, 0.0, -(body.mass * path.scene.gravity * math.hypot(*body.com))),
    )


def plot(
    path: Path | Sequence[Path],
    *more: Path | Iterable[Axes] | None,
    axes: Iterable[Axes] | None = None,
    degrees: bool = True,
    time_unit: str = "T",
) -> FigureAxes:
    """Plot the apex trace on a sphere, and nutation and precession over time, using matplotlib.

    Returns three matplotlib axes for each path. A notebook displays the returned axes as an image.

    path       one path or several paths, as a list or as separate arguments, of up to 8 tops in
               total, which are drawn side by side
    axes       the axes to draw in instead of a new figure: three for each path, and for two paths
               optionally a seventh for their difference. It may also be given as the second
               argument without its name
    degrees    False: angles in radians instead of degrees
    time_unit  the unit of time in which the scene is described, for the labels: "s" for seconds

    For two paths, an additional chart shows the angle between their attitudes, or, if a path does
    not store its attitude, between their apexes, on a logarithmic scale. If their times differ, one
    path is recomputed at the times of the other.

    Dashed lines mark the least and greatest nutation angles of the motion if they are known in
    closed form. Dots mark the initial state and the events of a path. The precession curve is
    interrupted where the angle jumps because the apex passes close to the vertical. The figure is
    not registered with pyplot; to save it, call `kr.plot(path).figure.savefig("top.png")`.

    If the states are sparser than the motion, the motion between them is computed by calling
    `path(t)`, and the states are marked. Only the states are drawn if the motion has hundreds of
    turns.

        >>> import kreisel as kr
        >>> path = kr.solve(kr.scenes.cusps, [0.1 * i for i in range(100)])
        >>> sphere, nutation, precession = kr.plot(path, time_unit="s")
        >>> nutation.get_ylabel(), precession.get_xlabel()
        ('nutation [°]', 'time [s]')
        >>> rough = kr.solve(kr.scenes.cusps, path.t, "rk4", step=0.1)
        >>> kr.plot(path, rough)[-1].get_ylabel()
        'difference [°]'

    Raises ValueError for a path without states, and ImportError if matplotlib is not installed.
    """
    paths: Any = [path] if isinstance(path, Path) else path
    if isinstance(path, Path) and more and all(isinstance(one, Path) for one in more):
        paths = [path, *more]
    elif len(more) > 1 or (more and axes is not None):
        raise TypeError("pass the paths as arguments or as one list, and axes as a keyword")
    elif more:
        axes = cast(Any, more[0])
    if not isinstance(paths, (list, tuple)):
        given = arguments.short_repr(path)
        raise TypeError(f"path must be a kreisel.Path or a list of them, not {given}")
    for i, one in enumerate(paths):
        arguments.validate_type(f"path[{i}]", one, Path)
    drawn = list_drawn_paths(*paths)
    from .._plot.charts import plot_paths

    paths_with_events = [(one, one.events.path if len(one.events) else None) for one in drawn]
    pair = partial(_compute_angle_between_motions, *drawn) if len(drawn) == 2 else None
    return plot_paths(paths_with_events, axes, degrees, time_unit, pair)


def _compute_angle_between_motions(a: Path, b: Path) -> AngleBetweenPaths:
    """Return the angle between attitudes, or else apexes, at the times of drawn motions."""
    from .._plot.charts import AngleBetweenPaths, evaluate_densely

    lines = [evaluate_densely(path) for path in (a, b)]
    if lines[0] is not None and lines[1] is not None:
        a, b = lines[0], lines[1]
    a, b = _restrict_to_common_times(a, b)
    if any(path.want is not None and "q" not in path.want for path in (a, b)):
        sines = np.linalg.norm(np.cross(a.apex, b.apex), axis=1)
        return AngleBetweenPaths(a.t, np.arctan2(sines, (a.apex * b.apex).sum(axis=1)), "apexes")
    one, other = (
        (path.q, path.q_low if path.want is None or "q_low" in path.want else np.zeros_like(path.q))
        for path in (a, b)
    )
    return AngleBetweenPaths(a.t, compute_angles_between_attitudes(one, other), "attitudes")


def _restrict_to_common_times(a: Path, b: Path) -> tuple[Path, Path]:
    """Return both paths at common times, or empty paths if their time intervals are disjoint."""
    if np.array_equal(a.t, b.t):
        return a, b
    low, high = max(a.t.min(), b.t.min()), min(a.t.max(), b.t.max())
    part_a, part_b = (path[(path.t >= low) & (path.t <= high)] for path in (a, b))
    if len(part_a) >= len(part_b):
        return part_a, b(part_a.t)
    return a(part_b.t), part_b
