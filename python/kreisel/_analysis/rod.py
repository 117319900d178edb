"""Elastic rods by Kirchhoff's kinetic analogy, which maps attitudes of a top to frames of a rod."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import TYPE_CHECKING

import numpy as np

from .._core import KIND_RTOL
from .._model.body import Body
from .._model.parameters import refuse_disturbances
from .._results.path import Path, check_is_one
from .._utils.arguments import Array, Vector, as_float, as_positive, as_unit_name, format_count
from .._utils.html import format_picture_as_html

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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

    Source: Bodack 2008, theorems 3.8 and 3.9. Compared with Bodack (2008), the bending stiffnesses
    alpha1 and alpha2 are interchanged, and the load has the opposite sign.
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
        """True if the bending stiffness is the same in all directions, up to rounding errors.

        The rod that corresponds to a Lagrange top is isotropic.
        """
        alpha1, alpha2, _ = self.stiffness
        return abs(alpha1 - alpha2) <= KIND_RTOL * max(alpha1, alpha2)

    @property
    def elastic_energy_density(self) -> Array:
        """(n,) energy of bending and twist per length [M L^2 T^-2].

        This is the kinetic energy of the top:
        (alpha1 kappa1^2 + alpha2 kappa2^2 + alpha tau^2) / 2.
        """
        alpha1, alpha2, alpha = self.stiffness
        bending = self.curvature**2 @ np.array((alpha1, alpha2))
        density: Array = (bending + alpha * self.torsion**2) / 2.0
        return density

    @property
    def lagrangian_density(self) -> Array:
        """(n,) elastic_energy_density + <load, T> [M L^2 T^-2].

        The Lagrangian density of the rod is the Lagrangian of the top, with time replaced by arc
        length. In equilibrium, the integral of the Lagrangian density along the rod is stationary.
        """
        total: Array = self.elastic_energy_density + self.frame[:, 2] @ np.array(self.load)
        return total

    @property
    def section(self) -> tuple[float, float]:
        """The thicknesses of the cross-section along its axes N and B, relative to the larger one.

        For elliptical and rectangular cross-sections, the bending stiffness in a direction is
        proportional to the squared thickness in this direction. The thicknesses are therefore
        proportional to the square roots of the bending stiffnesses alpha1 and alpha2.
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
        length_unit: str = "T",
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
        from .._plot.charts import open_chart
        from .._plot.film import (
            ORANGE,
            compute_twist_free_normals,
            draw_start_and_scale_bar,
            draw_tube,
        )

        target = open_chart(axes)
        side = None if thickness is None else as_positive("thickness", thickness)
        view = as_float("elevation", elevation), as_float("azimuth", azimuth)
        unit = as_unit_name("length_unit", length_unit)
        if len(self.s) < 2:
            states = format_count(len(self.s), "state")
            raise ValueError(f"a rod of {states} cannot be drawn: solve for more times")
        normals = (
            compute_twist_free_normals(self.frame[:, 2]) if self.isotropic else self.frame[:, :2]
        )
        section = (1.0, 1.0) if self.isotropic else self.section
        # The points of a path back in time are reversed, so that they follow the tangents.
        order = slice(None, None, -1 if self.s[-1] < self.s[0] else 1)
        draw_tube(
            self.centre[order], normals[order], section, target, side, colour or ORANGE, *view
        )
        draw_start_and_scale_bar(self.centre, target, unit, *view)
        return target

    def _repr_html_(self) -> str | None:
        """Return an image of the rod, or None if the rod has fewer than two states."""
        return format_picture_as_html(self.plot, repr(self)) if len(self.s) > 1 else None


def rod(path: Path) -> Rod:
    """Return the elastic rod that corresponds to a path under Kirchhoff's analogy.

    The rod is isotropic if the moments about both axes normal to its tangent are equal, as for a
    Lagrange top. The rod carries no load if the centre of mass coincides with the fixed
    point.

    Raises ValueError if there is damping, friction, a rotor or a moving support. Also raises
    ValueError if the centre of mass lies on no principal axis.

        >>> import kreisel as kr
        >>> rod = kr.rod(kr.solve(kr.scenes.thesis, [0.1 * k for k in range(101)]))
        >>> rod.centre.shape, bool(rod.stiffness[0] == rod.stiffness[1])
        ((101, 3), True)
    """
    check_is_one("kreisel.rod needs", path)
    if path.scene._has_damping:
        raise ValueError("Kirchhoff's analogy has no rod for a damped top")
    refuse_disturbances(path.scene, "Kirchhoff's analogy has no rod for a top")
    body = path.scene.body
    if any(body.rotor):
        raise ValueError("Kirchhoff's analogy has no rod for a body with a rotor")
    axes = _choose_elastic_rod_frame(body)
    frame = np.einsum("ij,njk->nik", axes, path.frame)
    i_n, i_b, i_t = ((axes**2) @ np.array(body.moments)).tolist()
    rate_n, rate_b, rate_t = np.einsum("nij,nj->in", frame, path.velocity)
    tangent_rate = np.cross(path.velocity, frame[:, 2])
    weight = body.mass * path.scene.gravity * hypot(*body.com)
    return Rod(
        s=path.t,
        centre=_integrate_cubic_interpolant(path.t, frame[:, 2], tangent_rate),
        frame=frame,
        # Bending towards N rotates the frame about B, and bending towards B about -N.
        curvature=np.stack([rate_b, -rate_n], axis=-1),
        torsion=rate_t,
        stiffness=(i_b, i_n, i_t),
        load=(0.0, 0.0, -weight),
    )


def _choose_elastic_rod_frame(body: Body) -> Array:
    """Return the principal-axis components of the rod's two cross-section axes and of its tangent.

    Raises ValueError if the centre of mass lies on no principal axis.
    """
    com, moments = np.array(body.principal_com), np.array(body.moments)
    reach = float(np.linalg.norm(com))
    t = com / reach if reach > 0.0 else np.array((0.0, 0.0, 1.0))
    moment = (moments * t) @ t
    if np.linalg.norm(moments * t - moment * t) > KIND_RTOL * moments.max():
        raise ValueError(
            "Kirchhoff's analogy has no rod for this top, because its centre of mass, "
            f"{body.principal_com} along the principal axes, lies on none of them"
        )
    k = int(np.argmin(np.abs(t)))
    n = np.eye(3)[k] - t[k] * t
    n /= np.linalg.norm(n)
    return np.stack([n, np.cross(t, n), t])


def _integrate_cubic_interpolant(t: Array, values: Array, slopes: Array) -> Array:
    """Return the integrals of a cubic Hermite interpolant from the first time to each time.

    The integral over an interval is the trapezoidal rule with a correction by the slopes.
    """
    h = np.diff(t)[:, None]
    pieces = h / 2.0 * (values[1:] + values[:-1]) - h**2 / 12.0 * (slopes[1:] - slopes[:-1])
    return np.concatenate([np.zeros((1, 3)), np.cumsum(pieces, axis=0)])
