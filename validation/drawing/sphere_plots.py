"""A drawing of a curve on the unit sphere, seen from slightly above."""

import numpy as np

from .style import COLOURS, FAINT, INK, STYLE, figure_to_svg, plt

ELEVATION = 20.0  # elevation of the eye above the horizontal plane [degrees]


def project(points, elevation=ELEVATION, azimuth=0.0):
    """Return the coordinates of points along three directions: right, up and towards the viewer.

    The direction of view is given by an elevation and an azimuth in degrees.
    """
    e, a = np.radians((elevation, azimuth))
    x, y, z = np.moveaxis(np.asarray(points), -1, 0)
    horizontal, depth = x * np.cos(a) + y * np.sin(a), y * np.cos(a) - x * np.sin(a)
    return horizontal, z * np.cos(e) + depth * np.sin(e), z * np.sin(e) - depth * np.cos(e)


def draw_outline(axes):
    angle = np.linspace(0, 2 * np.pi, 200)
    axes.plot(np.cos(angle), np.sin(angle), color=FAINT, linewidth=0.8)


def draw_globe(axes):
    """Draw the sphere with its equator and an upward arrow."""
    draw_outline(axes)
    angle = np.linspace(0, 2 * np.pi, 200)
    x, y, depth = project(np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1))
    axes.plot(x, np.where(depth > 0, y, np.nan), color=FAINT, linewidth=0.6)
    x, y, _ = project(np.array([[0, 0, 1], [0, 0, 1.25]]))
    arrow = {"arrowstyle": "->", "color": FAINT}
    axes.annotate("", (x[1], y[1]), (x[0], y[0]), arrowprops=arrow, annotation_clip=False)
    return x[1], y[1]


def draw_trace(axes, apex, colour=COLOURS[0]):
    """Draw a curve on the sphere, with the hidden part in a faint colour.

    A dot marks the first point of the curve.
    """
    x, y, depth = project(apex)
    axes.plot(x, y, color=colour, linewidth=0.5, alpha=0.4)
    axes.plot(x, np.where(depth > 0, y, np.nan), color=colour, linewidth=1)
    axes.plot(x[:1], y[:1], "o", color=INK, markersize=4)
    axes.set_aspect("equal")
    axes.axis("off")


def draw_apex_path(apex):
    """Draw the path of the centre of mass about the fixed point."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(2.6, 2.6))
        top = draw_globe(axes)
        axes.annotate("up", top, ha="center", va="bottom", color=FAINT, annotation_clip=False)
        draw_trace(axes, apex)
        return figure_to_svg(figure, bbox_inches="tight")
