"""Pictures with matplotlib, which is imported only here: a path, a rod, and solids seen from a
little above."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .arguments import Array
from .optional import installed

with installed("'kreisel[plot]'"):
    import matplotlib
    import matplotlib.pyplot as plt
    from matplotlib.axes import Axes
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

BLUE, ORANGE, FAINT = "#2f7de1", "#e8710a", "#8c8c8c"
_LIGHT = np.array((-0.4, -0.5, 0.77))


def view(
    points: Array, elevation: float = 20.0, azimuth: float = 0.0
) -> tuple[Array, Array, Array]:
    """Across, up, and towards the eye, of points (..., 3) seen from these angles above the plane
    and about the vertical [degrees]."""
    e, a = np.radians((elevation, azimuth))
    x, y, z = np.moveaxis(np.asarray(points), -1, 0)
    across, away = x * np.cos(a) + y * np.sin(a), y * np.cos(a) - x * np.sin(a)
    return across, z * np.cos(e) + away * np.sin(e), z * np.sin(e) - away * np.cos(e)


def faces(
    axes: Axes,
    corners: Array,
    colour: str,
    elevation: float = 20.0,
    azimuth: float = 0.0,
    edge: float = 0.0,
) -> None:
    """Faces (n, 4, 3) of a solid, each counterclockwise from outside: those that face the eye,
    farthest first, the brighter the more they face the light. `edge`: width of their outline
    [pt]."""
    x, y, depth = view(corners, elevation, azimuth)
    towards = (x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (
        y[:, 2] - y[:, 0]
    ) > 0.0
    x, y, depth, corners = x[towards], y[towards], depth[towards], corners[towards]
    order = np.argsort(depth.mean(axis=-1))
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    size = np.linalg.norm(normal, axis=-1, keepdims=True)
    facing = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0.0) @ _LIGHT
    shade = 0.45 + 0.55 * np.clip(0.5 + 0.6 * facing, 0.0, 1.0)
    colours = np.clip(shade[:, None] * np.array(to_rgb(colour)), 0.0, 1.0)
    outline = (
        {"edgecolors": 0.55 * np.array(to_rgb(colour)), "linewidths": edge}
        if edge
        else {"edgecolors": colours[order]}
    )
    axes.add_collection(
        PolyCollection(list(np.stack([x, y], axis=-1)[order]), facecolors=colours[order], **outline)
    )


def bare(axes: Axes) -> None:
    """Without frame and ticks, as wide as high."""
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")


def globe(axes: Axes, trace: Array, colour: str = BLUE, elevation: float = 20.0) -> None:
    """A trace (n, 3) on the unit sphere: faint where it is behind; the dot is the start, the arrow
    points up."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(np.cos(angle), np.sin(angle), color=FAINT, linewidth=0.8)
    x, y, depth = view(np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1), elevation)
    axes.plot(x, np.where(depth > 0.0, y, np.nan), color=FAINT, linewidth=0.6)
    x, y, _ = view(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.25]]), elevation)
    axes.annotate("", (x[1], y[1]), (x[0], y[0]), arrowprops={"arrowstyle": "->", "color": FAINT})
    x, y, depth = view(trace, elevation)
    axes.plot(x, y, color=colour, linewidth=0.5, alpha=0.4)
    axes.plot(x, np.where(depth > 0.0, y, np.nan), color=colour, linewidth=1.0)
    axes.plot(x[:1], y[:1], "o", color=matplotlib.rcParams["text.color"], markersize=4)
    bare(axes)


def trace(t: Array, apex: Array, title: str, axes: Iterable[Axes] | None = None) -> Iterable[Axes]:
    """The trace of an axis (n, 3) on the sphere, and beside it its height over the time (n,)."""
    if axes is None:
        figure = plt.figure(figsize=(8.0, 3.2), layout="constrained")
        axes = figure.subplots(1, 2, width_ratios=(3, 5))
    sphere, chart = axes
    globe(sphere, apex)
    sphere.set_title("path of the axis", fontsize=10)
    chart.plot(t, apex[:, 2], color=BLUE)
    chart.set(xlabel="time", ylabel="height of the axis", title=title)
    chart.title.set_fontsize(10)
    chart.grid(True, alpha=0.25)
    return axes


def bar(
    centre: Array,
    frame: Array,
    section: tuple[float, float],
    axes: Axes | None = None,
    thickness: float | None = None,
    colour: str = ORANGE,
    elevation: float = 20.0,
    azimuth: float = 0.0,
) -> Axes:
    """A bar along a curve (n, 3), of rectangular section along the first two axes of its frame
    (n, 3, 3), the larger side `thickness` (else a thirtieth of the curve's extent)."""
    if axes is None:
        _, axes = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
    extent = float(np.ptp(centre, axis=0).max())
    half = 0.5 * (extent / 30.0 if thickness is None else thickness) * np.array(section)
    signs = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) * half
    rims = centre[:, None] + np.einsum("cj,njk->nck", signs, frame[:, :2])  # (n, 4, 3)
    after = np.roll(rims, -1, axis=1)
    sides = np.stack([rims[:-1], after[:-1], after[1:], rims[1:]], axis=2).reshape(-1, 4, 3)
    ends = np.stack([rims[0, ::-1], rims[-1]])
    faces(axes, np.concatenate([sides, ends]), colour, elevation, azimuth)
    bare(axes)
    return axes
