"""Drawings of shaded solids, viewed from slightly above."""

from __future__ import annotations

import numpy as np

from .._utils.optional import optional_dependency
from .._utils.validation import Array, short_repr

with optional_dependency("'kreisel[plot]'"):
    import matplotlib
    from matplotlib.axes import Axes
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

BLUE, ORANGE, FAINT = "#2f7de1", "#e8710a", "#8c8c8c"
RED, CREAM = "#c73237", "#f7ecd2"  # colours of a body, as in the interactive viewer
_LIGHT = np.array((-0.4, -0.5, 0.77))
_SLICES = 96
_PIECES = 4  # straight pieces that approximate each piece of a profile
_ROUND = 24  # flat sides that approximate a round tube


def project_to_view(
    points: Array, elevation: float = 20.0, azimuth: float = 0.0
) -> tuple[Array, Array, Array]:
    """Project points onto three directions: right, up, and towards the viewer.

    The viewing direction is given by its elevation above the horizontal plane and its azimuth
    [degrees].
    """
    e, a = np.radians((elevation, azimuth))
    x, y, z = np.moveaxis(np.asarray(points), -1, 0)
    horizontal, distance = x * np.cos(a) + y * np.sin(a), y * np.cos(a) - x * np.sin(a)
    return horizontal, z * np.cos(e) + distance * np.sin(e), z * np.sin(e) - distance * np.cos(e)


def validate_axes_type(axes: object) -> Axes:
    """Return `axes` if it is a matplotlib Axes; raise TypeError otherwise."""
    if not isinstance(axes, Axes):
        raise TypeError(
            "axes must be axes of matplotlib, as returned by figure.add_subplot(), not "
            f"{short_repr(axes)}"
        )
    return axes


def draw_solid_faces(
    axes: Axes,
    corners: Array,
    colour: str | Array,
    elevation: float = 20.0,
    azimuth: float = 0.0,
    edge: float = 0.0,
) -> PolyCollection:
    """Draw the faces of a solid, given their corners in an array of shape (n, 4, 3).

    The corners of each face are listed counterclockwise as seen from outside. Only the faces
    visible to the viewer are drawn, in order of decreasing distance. Faces that are turned towards
    the light are brighter. `colour` is either one colour for all faces or an array of colours.
    `edge` is the line width of the outlines [pt].
    """
    x, y, depth = project_to_view(corners, elevation, azimuth)
    is_visible = (x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (
        y[:, 2] - y[:, 0]
    ) > 0.0
    base = np.broadcast_to(to_rgb(colour) if isinstance(colour, str) else colour, (len(x), 3))
    order = np.flatnonzero(is_visible)[np.argsort(depth[is_visible].mean(axis=-1))]
    x, y, corners, base = x[order], y[order], corners[order], base[order]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    facing = normal @ _LIGHT / np.linalg.norm(normal, axis=-1)  # a visible face has area > 0
    shade = 0.45 + 0.55 * np.clip(0.5 + 0.6 * facing, 0.0, 1.0)
    colours = shade[:, None] * base
    outline = {"edgecolors": 0.55 * base, "linewidths": edge} if edge else {"edgecolors": colours}
    solid = PolyCollection(list(np.stack([x, y], axis=-1)), facecolors=colours, **outline)
    axes.add_collection(solid)
    return solid


def set_equal_scale_and_hide_frame(axes: Axes) -> None:
    """Hide the frame and the ticks, and set an equal scale on both axes."""
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")


def draw_tube(
    centre: Array,
    normals: Array,
    section: tuple[float, float],
    axes: Axes,
    thickness: float | None = None,
    colour: str = ORANGE,
    elevation: float = 20.0,
    azimuth: float = 0.0,
) -> None:
    """Draw a tube of elliptical cross-section along a curve through n points.

    The axes of the ellipse are parallel to the unit vectors in `normals`, an array of
    shape (n, 2, 3). The axes of the ellipse have the ratio `section`, and the major axis has the
    length `thickness`.
    """
    angle = 2.0 * np.pi * np.arange(_ROUND) / _ROUND
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * np.array(section)
    ring *= 0.5 * _choose_tube_thickness(centre, thickness)
    rims = centre[:, None] + np.einsum("cj,njk->nck", ring, normals)
    pieces = np.arange(0, _ROUND, 2)[:, None] + np.arange(3)  # rim points of the end faces
    first, last = (rims[k, pieces % _ROUND] for k in (0, -1))
    middle = np.broadcast_to(centre[[0, -1], None, None], (2, len(pieces), 1, 3))
    ends = [
        np.concatenate([middle[0], first[:, ::-1]], axis=1),
        np.concatenate([middle[1], last], axis=1),
    ]
    draw_solid_faces(
        axes, np.concatenate([_connect_rings(rims), *ends]), colour, elevation, azimuth
    )
    set_equal_scale_and_hide_frame(axes)


def draw_start_and_scale_bar(
    centre: Array, axes: Axes, unit: str, elevation: float = 20.0, azimuth: float = 0.0
) -> None:
    """Mark the first point of a curve, and draw a scale bar below the curve.

    The length of the scale bar is 1, 2 or 5 times a power of ten.
    """
    ink = matplotlib.rcParams["text.color"]
    x, y, _ = project_to_view(centre, elevation, azimuth)
    axes.plot(x[:1], y[:1], "o", color=ink, markersize=4, zorder=4)
    style = {"textcoords": "offset points", "fontsize": 8, "color": ink}
    extent = float(max(np.ptp(x), np.ptp(y)))
    dx, dy = _find_direction_away_from_curve(x, y, 0.3 * extent)
    axes.annotate(
        "start", (x[0], y[0]), xytext=(9 * dx, 9 * dy),
        ha=("center", "left", "right")[round(dx)],
        va=("center", "bottom", "top")[round(dy)], **style,
    )  # fmt: skip
    if not extent > 0.0:
        return
    power = 10.0 ** np.floor(np.log10(0.25 * extent))
    # The logarithm of a number just below a power of ten may be rounded up.
    length = float(max(k for k in (0.5, 1.0, 2.0, 5.0) if k * power <= 0.25 * extent) * power)
    left, bottom = float(x.max()) - length, float(y.min()) - 0.08 * extent
    axes.plot(
        [left, left + length], [bottom, bottom], color=ink, linewidth=2.0, solid_capstyle="butt"
    )
    axes.annotate(
        f"{length:.12g} {unit}", (left + 0.5 * length, bottom), xytext=(0, -4), va="top",
        ha="center", **style,
    )  # fmt: skip


def _find_direction_away_from_curve(x: Array, y: Array, reach: float) -> tuple[float, float]:
    is_near = np.hypot(x - x[0], y - y[0]) <= reach
    direction = complex(x[0] - x[is_near].mean(), y[0] - y[is_near].mean())
    if not abs(direction) > 0.0:
        return (-1.0, 0.0)
    return (direction.real / abs(direction), direction.imag / abs(direction))


def _choose_tube_thickness(centre: Array, thickness: float | None) -> float:
    """Return the thickness of a tube, by default a thirtieth of the size of its centre line."""
    return float(np.ptp(centre, axis=0).max()) / 30.0 if thickness is None else thickness


def _connect_rings(rims: Array) -> Array:
    """Return the faces that connect each ring of points with the next."""
    shifted = np.roll(rims, -1, axis=1)
    return np.stack([rims[:-1], shifted[:-1], shifted[1:], rims[1:]], axis=2).reshape(-1, 4, 3)


def compute_twist_free_normals(tangent: Array) -> Array:
    """Return two unit normals at each point of a curve; they do not twist about the curve."""
    normals = np.empty_like(tangent)
    normal = np.eye(3)[np.argmin(np.abs(tangent[0]))]
    for k, direction in enumerate(tangent):
        normal = normal - (normal @ direction) * direction
        normal = normal / np.linalg.norm(normal)
        normals[k] = normal
    return np.stack([normals, np.cross(tangent, normals)], axis=1)


def cuboid(mass: float, moments: Array, com: Array) -> tuple[Array, Array, Array]:
    """Return the half-edge lengths, centre and axes of a homogeneous cuboid.

    The cuboid has the given principal moments of inertia about the fixed point. If no cuboid of the
    given mass has these moments of inertia, the mass is increased while mass * com is kept
    constant. The increased mass is chosen to make the cuboid as large as possible. If no increased
    mass suffices, the half-edge lengths are proportional to the square roots of the moments.
    """
    best = _find_cuboid_of_same_inertia(mass, moments, mass * com)
    if best is None:
        candidates = (
            _find_cuboid_of_same_inertia(mass * 1.05**k, moments, mass * com)
            for k in range(1, 1200)
        )
        best = max((c for c in candidates if c), key=lambda c: float(np.prod(c[0])), default=None)
    return best or (np.sqrt(moments / moments.max()), np.zeros(3), np.eye(3))


def _find_cuboid_of_same_inertia(
    mass: float, moments: Array, lever: Array
) -> tuple[Array, Array, Array] | None:
    centre = lever / mass
    central_inertia = np.diag(moments) - mass * (
        centre @ centre * np.eye(3) - np.outer(centre, centre)
    )
    off_diagonal = np.abs(central_inertia - np.diag(np.diag(central_inertia))).max()
    central_moments, axes = (
        np.linalg.eigh(central_inertia)
        if off_diagonal > 1e-12 * moments.max()
        else (np.diag(central_inertia), np.eye(3))
    )
    squares = 1.5 / mass * (central_moments.sum() - 2.0 * central_moments)
    min_square = 1e-4 * squares.max()
    if squares.min() < -1e-9 * squares.max() or not min_square > 0.0:
        return None
    if np.linalg.det(axes) < 0.0:
        axes = -axes
    return np.sqrt(np.maximum(squares, min_square)), centre, axes.T


def build_cuboid_faces(half: Array, centre: Array, axes: Array) -> tuple[Array, Array]:
    """Return the faces of a cuboid and their colours; one face is brighter than the others."""
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=np.float64)
    corners = []
    for k in range(3):
        for side in -1.0, 1.0:
            face = np.empty((4, 3))
            face[:, k] = side
            face[:, [(k + 1) % 3, (k + 2) % 3]] = square[:: int(side)]
            corners.append(face)
    shades = [RED, RED, "#d8575b", "#d8575b", "#a8262b", CREAM]
    return centre + (np.array(corners) * half) @ axes, np.array([to_rgb(c) for c in shades])


def build_faces_of_revolution(
    radius: float, half: float, height: float, tip: bool
) -> tuple[Array, Array]:
    """Return the faces of a body of revolution about the third axis, together with their colours.

    `radius`, `half` and `height` are the radius, half-length and centre height of a cylinder. If
    `tip` is True, the cylinder is replaced by a spinning top of similar size that stands on the
    origin. One sector of the surface is brighter, which makes the spin visible.
    """
    low = height - half
    if tip:
        foot = [(0.0, 0.0), (0.05, 0.02 * half)] if low > 0.3 * half else []
        start = [(0.05, low)] if foot else [(0.0, min(low, 0.0))]
        body = [(0.62, 0.55), (0.93, 0.9), (1.0, 1.1), (0.95, 1.3), (0.7, 1.5), (0.2, 1.62)]
        stem = [(0.1, 1.68), (0.1, 2.15), (0.16, 2.2), (0.16, 2.35), (0.0, 2.4)]
        profile = (
            foot + start + [(r, low + z * half) for r, z in [*_compute_spline_points(body), *stem]]
        )
    else:
        profile = [(0.0, low), (1.0, low), (1.0, low + 2 * half), (0.0, low + 2 * half)]
    r, z = np.array(profile).T
    angle = 2.0 * np.pi * np.arange(_SLICES + 1) / _SLICES
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    rings = np.empty((len(r), _SLICES + 1, 3))
    rings[..., :2] = radius * r[:, None, None] * ring
    rings[..., 2] = z[:, None]
    quads = np.stack([rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]], axis=2)
    is_marked = np.arange(_SLICES) < _SLICES // 6
    colours = np.where(is_marked[:, None], to_rgb(CREAM), to_rgb(RED))
    return quads.reshape(-1, 4, 3), np.tile(colours, (len(r) - 1, 1))


def _compute_spline_points(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return points on a smooth curve (a Catmull-Rom spline) through points (r, z) with r <= 1."""
    knots = np.array(points)
    slopes = np.gradient(knots, axis=0)
    u = np.linspace(0.0, 1.0, _PIECES, endpoint=False)[:, None]
    parts = [
        (1 + 2 * u) * (1 - u) ** 2 * p + u**2 * (3 - 2 * u) * q
        + u * (1 - u) ** 2 * a - u**2 * (1 - u) * b
        for p, q, a, b in zip(knots[:-1], knots[1:], slopes[:-1], slopes[1:], strict=True)
    ]  # fmt: skip
    curve = np.concatenate([*parts, knots[-1:]])
    curve[:, 0] = np.minimum(curve[:, 0], 1.0)
    return [(float(r), float(z)) for r, z in curve]


def build_solid_faces(mass: float, moments: Array, com: Array) -> tuple[Array, Array]:
    """Return the faces of a solid that represents a body, and their colours.

    A body that is symmetric about its apex is drawn as a spinning top or, if its centre of mass is
    the fixed point, as a cylinder. Any other body is drawn as a cuboid. The corners of the faces
    are given in principal axes.
    """
    half, centre, axes = cuboid(mass, moments, com)
    apex = int(np.argmax(np.abs(com))) if com.any() else 2
    i, j = (apex + 1) % 3, (apex + 2) % 3
    level = np.abs(com[[i, j]]).max() <= 1e-9 * np.abs(com).max(initial=0.0)
    if not (level and abs(moments[i] - moments[j]) <= 1e-9 * moments.max()):
        return build_cuboid_faces(half, centre, axes)
    quads, colours = build_faces_of_revolution(
        2.0 * half[i] / 3**0.5, half[apex], abs(centre[apex]), bool(com.any())
    )
    frame = np.eye(3)[[i, j, apex]]
    if com[apex] < 0.0:
        frame[1:] *= -1.0
    return quads @ frame, colours
