"""Pictures of rotating cuboids and of elastic rods.

The pictures imitate those of Top Visualization, the program that accompanies the thesis.
"""

from dataclasses import dataclass

import kreisel as kr
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from ..drawing import sphere_plots
from ..drawing.style import STYLE, figure_to_svg
from .line_charts import BLUE, GREEN, TOPS

ELEVATION, AZIMUTH = 16.0, 25.0
APART, REACH = 4.6, 2.3  # distance of the two origins; length of the longest vectors
THICK, THIN, GLASS = 2.0, 0.8, 0.45  # widths of edges [pt]; opacity of translucent cuboids
STILL_WIDTH, LINE = 7.6, 0.3  # width of pictures of several tops, height of a line of text [inch]
LIGHT = np.array((-0.4, -0.5, 0.77))


@dataclass(frozen=True)
class Top:
    """A cuboid at one instant of its motion, with the style in which it is drawn."""

    path: kr.Path
    i: int
    colour: str
    width: float = THICK
    opacity: float = 1.0


def project(points):
    return sphere_plots.project(points, ELEVATION, AZIMUTH)


def project_to_plane(points):
    return np.stack(project(points)[:2], axis=-1)


def hide_frame(axes):
    """Hide the axes of a picture, and set equal scales."""
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")


def cuboid_faces(half, centre):
    """Return the corners of all faces, counterclockwise as seen from outside."""
    faces = np.zeros((6, 4, 3))
    for i, face in enumerate(faces):
        axis, sign = i // 2, 1.0 - 2.0 * (i % 2)
        face[:, axis] = sign
        face[:, (axis + 1) % 3] = np.array((-1, 1, 1, -1)) * sign
        face[:, (axis + 2) % 3] = (-1, -1, 1, 1)
    return faces * half + centre


def draw_cuboid(axes, corners, top):
    """Draw a cuboid, including the hidden faces if it is translucent."""
    base = np.array(to_rgb(top.colour))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    facing = project(normals)[2]
    for i in np.argsort(facing):
        if top.opacity == 1.0 and facing[i] <= 0.0:
            continue
        shade = 0.5 + 0.5 * np.clip(0.5 + 0.6 * normals[i] @ LIGHT, 0, 1)
        fill = (*(shade * base), top.opacity if facing[i] > 0.0 else 0.0)
        axes.add_collection(
            PolyCollection(
                [project_to_plane(corners[i])],
                facecolors=[fill],
                edgecolors=[0.45 * base + 0.1],
                linewidths=top.width,
                joinstyle="round",
            )
        )


def draw_vectors(axes, top, origin, is_behind):
    """Draw the momentum in green and the angular velocity in blue.

    If `is_behind` is true, only vectors that point away from the viewer are drawn; otherwise, only
    vectors that point towards the viewer are drawn.
    """
    for values, colour in ((top.path.m, GREEN), (top.path.velocity, BLUE)):
        tip = REACH * values[top.i] / np.linalg.norm(values, axis=1).max()
        if (project(tip)[2] < 0.0) == is_behind:
            x, y = project_to_plane(np.array((origin, origin + tip))).T
            line = {"linewidth": 0.7 * top.width + 0.8, "solid_capstyle": "round"}
            axes.plot(x, y, color=colour, **line)
            axes.plot(x[1:], y[1:], "o", color=colour, markersize=top.width + 2.5)


def draw_tops(axes, tops, half, pivot, origin):
    """Draw several tops with the same fixed point."""
    body = cuboid_faces(np.array(half), -np.array(pivot))
    for top in tops:
        draw_vectors(axes, top, origin, is_behind=True)
    for top in tops:
        draw_cuboid(axes, body @ top.path.frame[top.i] + origin, top)
    for top in tops:
        draw_vectors(axes, top, origin, is_behind=False)


def origin_of(side):
    """Return the position of the fixed point in the left or right half of the picture.

    The argument `side` is -0.5 for the left half and 0.5 for the right half of the picture.
    """
    angle = np.radians(AZIMUTH)
    return side * APART * np.array((np.cos(angle), np.sin(angle), 0.0))


def top_at_time(course, t, colour, width, opacity):
    return Top(course.path, int(np.argmin(np.abs(course.t - t))), colour, width, opacity)


def draw_four_tops(courses, t, half, pivot):
    """Draw a picture like figures 6.1 to 6.4 in the thesis.

    The dictionary `courses` contains the trajectories of the red, blue, yellow and green tops. Two
    of the four tops are translucent.
    """
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(layout="constrained")
        for side, solid, glass in ((-0.5, "red", "blue"), (0.5, "yellow", "green")):
            tops = [
                top_at_time(courses[solid], t, TOPS[solid], THICK, 1.0),
                top_at_time(courses[glass], t, TOPS[glass], THIN, GLASS),
            ]
            draw_tops(axes, tops, half, pivot, origin_of(side))
        hide_frame(axes)
        low = axes.get_ylim()[0]
        for side, method in ((-0.5, "Bobenko-Suris"), (0.5, "Extrap")):
            axes.annotate(method, (side * APART, low), ha="center", va="top", annotation_clip=False)
        fit_height(figure, axes)
        return figure_to_svg(figure)


def fit_height(figure, axes, width=STILL_WIDTH):
    """Adjust the height [inch] of a picture to its content."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    figure.set_size_inches(width, width * (high - low) / (right - left) + LINE)


def tops_at_start(scene, colour):
    return [Top(kr.solve(scene, [0.0]), 0, colour)]


def draw_one_top(scene, half, pivot, colour):
    """Draw the body in its initial state, with its momentum and angular velocity."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(3.6, 2.6), layout="constrained")
        draw_tops(axes, tops_at_start(scene, colour), half, pivot, np.zeros(3))
        hide_frame(axes)
        return figure_to_svg(figure)


def draw_two_tops(scene, half, pivot, colours):
    """Draw figure 5.10, which shows two identical tops side by side."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(layout="constrained")
        for side, colour in zip((-0.5, 0.5), colours, strict=True):
            draw_tops(axes, tops_at_start(scene, colour), half, pivot, origin_of(side))
        hide_frame(axes)
        fit_height(figure, axes)
        return figure_to_svg(figure)


def draw_rod(rod, colour, azimuth=AZIMUTH):
    """Draw a rod whose thickness is determined by the moments of inertia."""
    thickness = 0.045 * np.ptp(rod.centre, axis=0).max()
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(3.4, 4.2), layout="constrained")
        rod.plot(axes, thickness=thickness, colour=colour, azimuth=azimuth)
        return figure_to_svg(figure)


def draw_trace(path):
    """Draw the path of the symmetry axis."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(3.2, 3.2), layout="constrained")
        sphere_plots.draw_globe(axes)
        sphere_plots.draw_trace(axes, path.apex, BLUE)
        return figure_to_svg(figure)
