"""Curves on the unit sphere, seen from slightly above."""

import numpy as np

from .style import COLOURS, FAINT, INK, as_svg, plt

ELEVATION = 20.0  # elevation of the eye above the horizontal plane [degrees]


def project(points, elevation=ELEVATION, azimuth=0.0):
    """Return the coordinates of points along three directions: right, up and towards the viewer.

    The direction of view is given by an elevation and an azimuth in degrees.
    """
    e, a = np.radians((elevation, azimuth))
    x, y, z = np.moveaxis(np.asarray(points), -1, 0)
    horizontal, depth = x * np.cos(a) + y * np.sin(a), y * np.cos(a) - x * np.sin(a)
    return horizontal, z * np.cos(e) + depth * np.sin(e), z * np.sin(e) - depth * np.cos(e)


@as_svg
def draw_apex_path(apex, size=2.6):
    """Draw a path on the sphere, with the hidden part in a faint colour and a dot at its start."""
    figure, axes = plt.subplots(figsize=(size, size), layout="constrained")
    angle = np.linspace(0, 2 * np.pi, 200)
    axes.plot(np.cos(angle), np.sin(angle), color=FAINT, linewidth=0.8)
    x, y, depth = project(np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1))
    axes.plot(x, np.where(depth > 0, y, np.nan), color=FAINT, linewidth=0.6)
    x, y, _ = project(np.array([[0, 0, 1], [0, 0, 1.25]]))
    arrow = {"arrowstyle": "->", "color": FAINT}
    axes.annotate("", (x[1], y[1]), (x[0], y[0]), arrowprops=arrow, annotation_clip=False)
    axes.annotate("up", (x[1], y[1]), ha="center", va="bottom", color=FAINT, annotation_clip=False)
    x, y, depth = project(apex)
    axes.plot(x, y, color=COLOURS[0], linewidth=0.5, alpha=0.4)
    axes.plot(x, np.where(depth > 0, y, np.nan), color=COLOURS[0], linewidth=1)
    axes.plot(x[:1], y[:1], "o", color=INK)
    axes.set_aspect("equal")
    axes.axis("off")
    return figure
