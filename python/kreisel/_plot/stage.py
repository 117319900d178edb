"""The scenery around a moving body: a floor, the unit sphere, a stand and a soft shadow.

The colours match those of the interactive viewer.
"""

from __future__ import annotations

import numpy as np

from .._utils.optional import optional_dependency
from .._utils.validation import Array
from .solids import FAINT, project_to_view

with optional_dependency("'kreisel[plot]'"):
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection, PathCollection
    from matplotlib.colors import to_rgba
    from matplotlib.path import Path as Outline

GRID, SHADOW, STAND, STEEL = "#808894", "#0c1018", "#9a9389", "#aab2bd"
_RADIUS = 1.5  # of the floor, which fades out
_RINGS, _SPOKES = 6, 24
_STRENGTH = 0.3  # opacity of the shadow
_LAMP = np.array((-0.25, -0.3))  # horizontal parts of the direction to the lamp, for height 1
_WIDTH = 0.05  # radius of the lamp, for height 1
_POINTS = 7  # of the lamp; each casts a shadow of its own
_MARGIN = 1.08  # half width of the picture


def draw_floor_sphere_and_stand(axes: Axes, floor: float) -> None:
    """Draw the floor, the unit sphere and the stand that supports the body."""
    _set_square_axis_limits(axes, floor)
    _draw_floor(axes, floor)
    _draw_part_of_sphere_above_floor(axes, floor)
    _draw_stand(axes, floor)


def _set_square_axis_limits(axes: Axes, floor: float) -> None:
    """Set the axis limits of a square picture that shows the sphere and part of the floor."""
    _, y, _ = project_to_view(np.array([[0.0, -0.9, floor], [0.0, 0.0, 1.3]]))
    low = min(float(y[0]), -_MARGIN if floor < -0.5 else 0.0)
    middle = 0.5 * (low + float(y[1]))
    axes.set(xlim=(-_MARGIN, _MARGIN), ylim=(middle - _MARGIN, middle + _MARGIN))
    axes.set_autoscale_on(False)


def _draw_floor(axes: Axes, height: float) -> None:
    """Draw concentric circles and spokes that fade towards the edge of the floor."""
    turn = np.linspace(0.0, 2.0 * np.pi, 121)
    radii = np.linspace(0.0, _RADIUS, 31)
    lines = [
        r * _convert_azimuths_to_directions(turn) for r in np.linspace(0.0, _RADIUS, _RINGS + 1)[1:]
    ]
    lines += list(
        _convert_azimuths_to_directions(turn[:: 120 // _SPOKES][:-1])[:, None] * radii[:, None]
    )
    pieces = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    distance = np.linalg.norm(pieces.mean(axis=1), axis=-1) / _RADIUS
    colours = np.tile(to_rgba(GRID), (len(pieces), 1))
    colours[:, 3] = 0.35 * np.clip(1.0 - distance, 0.0, 1.0) ** 0.5
    segments = _project_horizontal_points(pieces, height)
    axes.add_collection(LineCollection(list(segments), colors=colours, linewidths=0.6, zorder=0.1))


def _draw_part_of_sphere_above_floor(axes: Axes, floor: float) -> None:
    """Draw the outline of the unit sphere above the floor, and the circle where they intersect."""
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    x, y = _convert_azimuths_to_directions(turn).T
    height = y * np.cos(np.radians(20.0))  # of the points of the outline
    axes.plot(x, np.where(height >= floor, y, np.nan), color=FAINT, linewidth=0.8, zorder=0.6)
    if floor > -1.0:
        rim = _project_horizontal_points(
            (1.0 - floor * floor) ** 0.5 * _convert_azimuths_to_directions(turn), floor
        )
        axes.plot(*rim.T, color=FAINT, linewidth=0.7, alpha=0.7, zorder=0.6)
    base, tip = (tuple(_project_horizontal_points(np.zeros(2), z).tolist()) for z in (1.0, 1.22))
    axes.annotate("", tip, base, arrowprops={"arrowstyle": "->", "color": FAINT})


def _draw_stand(axes: Axes, floor: float) -> None:
    """Draw the fixed point and a needle that supports it above the floor."""
    axes.plot(*np.stack([_project_horizontal_points(np.zeros(2), z) for z in (0.0, floor)]).T,
              color=STAND, linewidth=2.0, solid_capstyle="round", zorder=1.5)  # fmt: skip
    axes.plot([0.0], [0.0], "o", color=STAND, markersize=4.5, zorder=1.6)


def draw_body_shadow(axes: Axes, corners: Array, floor: float) -> PathCollection:
    """Draw the shadow of a body on the floor, given the corners of its faces.

    Because the light source has a finite size, the shadow is sharp only where the body is close to
    the floor.
    """
    height = corners[..., 2:] - floor
    outlines = []
    for k in range(_POINTS):  # the points of the lamp lie on a spiral
        radius, turn = _WIDTH * np.sqrt((k + 0.5) / _POINTS), 2.39996 * k
        lamp = _LAMP + radius * np.array((np.cos(turn), np.sin(turn)))
        outlines.append(
            _join_faces_to_outline(
                _project_horizontal_points(corners[..., :2] - height * lamp, floor)
            )
        )
    opacity = 1.0 - (1.0 - _STRENGTH) ** (1.0 / _POINTS)
    shadow = PathCollection(
        outlines, facecolors=[to_rgba(SHADOW, opacity)], linewidths=0.0, zorder=0.4
    )
    axes.add_collection(shadow)
    return shadow


def _join_faces_to_outline(faces: Array) -> Outline:
    """Combine the faces into a single path that encloses their union."""
    x, y = np.moveaxis(faces, -1, 0)
    area = (x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0])
    faces = faces[area > 0.0]  # faces away from the lamp cover the same area
    corners = np.concatenate([faces, faces[:, :1]], axis=1).reshape(-1, 2)
    codes = np.tile([Outline.MOVETO, *[Outline.LINETO] * 3, Outline.CLOSEPOLY], len(faces))
    return Outline(corners, codes.astype(np.uint8))


def _convert_azimuths_to_directions(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _project_horizontal_points(places: Array, height: float) -> Array:
    """Project points in a horizontal plane onto the picture."""
    points = np.concatenate([places, np.full_like(places[..., :1], height)], axis=-1)
    return np.stack(project_to_view(points)[:2], axis=-1)
