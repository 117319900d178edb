"""Stills: cuboids with their momentum and velocity, rods and traces, as the program Top Visualization showed them."""

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np
from kreisel._ground import drawing as plot
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from ..report.figures import FAINT, STYLE, as_svg
from .charts import BLUE, GREEN, TOPS

ELEVATION, AZIMUTH = 16.0, 25.0
APART, REACH = 4.6, 2.3  # of the two origins; of the longest vectors [length]
THICK, THIN, GLASS = 2.0, 0.8, 0.45  # edges [pt]; how much of what is behind a thin one hides
LIGHT = np.array((-0.4, -0.5, 0.77))


def faces(half, centre):
    """(6, 4, 3) corners of a cuboid, each face counterclockwise from outside."""
    found = np.zeros((6, 4, 3))
    for i, face in enumerate(found):
        axis, sign = i // 2, 1.0 - 2.0 * (i % 2)
        face[:, axis] = sign
        face[:, (axis + 1) % 3] = np.array((-1, 1, 1, -1)) * sign
        face[:, (axis + 2) % 3] = (-1, -1, 1, 1)
    return found * half + centre


def on_paper(points):
    return np.stack(plot.view(points, ELEVATION, AZIMUTH)[:2], axis=-1)


def cuboid(axes, corners, colour, width, opacity):
    """Its faces; of glass also those behind."""
    base = np.array(to_rgb(colour))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    towards = plot.view(normals, ELEVATION, AZIMUTH)[2]
    for i in np.argsort(towards):
        if opacity == 1.0 and towards[i] <= 0.0:
            continue
        shade = 0.5 + 0.5 * np.clip(0.5 + 0.6 * normals[i] @ LIGHT, 0, 1)
        fill = (*(shade * base), opacity if towards[i] > 0.0 else 0.0)
        axes.add_collection(
            PolyCollection(
                [on_paper(corners[i])],
                facecolors=[fill],
                edgecolors=[0.45 * base + 0.1],
                linewidths=width,
                joinstyle="round",
            )
        )


def vectors(axes, path, i, origin, width, behind):
    """Momentum in green and velocity in blue, the longest of the path of one length; those that point away, or the others."""
    for values, colour in ((path.m, GREEN), (path.velocity, BLUE)):
        tip = REACH * values[i] / np.linalg.norm(values, axis=1).max()
        if (plot.view(tip, ELEVATION, AZIMUTH)[2] < 0.0) == behind:
            x, y = on_paper(np.array((origin, origin + tip))).T
            axes.plot(x, y, color=colour, linewidth=0.7 * width + 0.8, solid_capstyle="round")
            axes.plot(x[1:], y[1:], "o", color=colour, markersize=width + 2.5)


def tops(axes, states, half, pivot, origin):
    """Several at one place: (path, state, colour, width, opacity)."""
    for path, i, _, width, _ in states:
        vectors(axes, path, i, origin, width, behind=True)
    for path, i, colour, width, opacity in states:
        body = faces(np.array(half), -np.array(pivot))
        cuboid(axes, body @ path.frame[i] + origin, colour, width, opacity)
    for path, i, _, width, _ in states:
        vectors(axes, path, i, origin, width, behind=False)


def four_tops(runs, t, half, pivot):
    """`runs`: red, blue, yellow, green. Figures 6.1 to 6.4 and their like; the two of eps2 are of glass."""
    angle = np.radians(AZIMUTH)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(5.4, 3.3), layout="constrained")
        for side, pair in ((-0.5, ("red", "blue")), (0.5, ("yellow", "green"))):
            states = []
            for name, width, opacity in zip(pair, (THICK, THIN), (1.0, GLASS)):
                at = int(np.argmin(np.abs(runs[name].t - t)))
                states.append((runs[name].path, at, TOPS[name], width, opacity))
            tops(
                axes,
                states,
                half,
                pivot,
                side * APART * np.array((np.cos(angle), np.sin(angle), 0.0)),
            )
            axes.annotate(
                "Bobenko-Suris" if side < 0 else "Extrap",
                (side * APART, -2.6),
                ha="center",
                color=FAINT,
            )
        plot.bare(axes)
        axes.set(xlim=(-4.7, 4.7), ylim=(-2.7, 2.6))
        return as_svg(figure)


def one_top(scene, half, pivot, colour):
    """The body at the start, with its vectors."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(3.6, 2.6), layout="constrained")
        tops(axes, [(kr.solve(scene, [0.0]), 0, colour, THICK, 1.0)], half, pivot, np.zeros(3))
        plot.bare(axes)
        return as_svg(figure)


def two_tops(scene, half, pivot, colours):
    """Figure 5.10: a top and its duplicate."""
    angle = np.radians(AZIMUTH)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(5.4, 3.0), layout="constrained")
        for side, colour in zip((-0.5, 0.5), colours):
            origin = side * APART * np.array((np.cos(angle), np.sin(angle), 0.0))
            tops(axes, [(kr.solve(scene, [0.0]), 0, colour, THICK, 1.0)], half, pivot, origin)
        plot.bare(axes)
        return as_svg(figure)


def rod(rod, colour, azimuth=AZIMUTH):
    """A rod as thick as the moments say."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(3.4, 4.2), layout="constrained")
        rod.plot(
            axes,
            thickness=0.045 * np.ptp(rod.centre, axis=0).max(),
            colour=colour,
            azimuth=azimuth,
        )
        return as_svg(figure)


def trace(path):
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(3.2, 3.2), layout="constrained")
        plot.globe(axes, path.apex, BLUE)
        return as_svg(figure)
