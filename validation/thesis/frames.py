"""Pictures of rotating cuboids and of elastic rods."""

from dataclasses import dataclass

import kreisel as kr
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from ..drawing import spheres
from ..drawing.style import as_svg, plt
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
    return spheres.project(points, ELEVATION, AZIMUTH)


def project_to_plane(points):
    return np.stack(project(points)[:2], axis=-1)


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
    edges = {"linewidths": top.width, "joinstyle": "round", "edgecolors": [0.45 * base + 0.1]}
    for i in np.argsort(facing):
        if top.opacity < 1.0 or facing[i] > 0.0:
            shade = 0.5 + 0.5 * np.clip(0.5 + 0.6 * normals[i] @ LIGHT, 0, 1)
            fill = (*(shade * base), top.opacity if facing[i] > 0.0 else 0.0)
            corner = project_to_plane(corners[i])
            axes.add_collection(PolyCollection([corner], facecolors=[fill], **edges))


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


@as_svg
def draw_tops(sides, half, pivot, size=None):
    """Draw cuboids at one or two places, each with the label below it.

    `sides` maps labels to the tops at one place, which have the same fixed point. Without `size`,
    the height of the picture is adjusted to its content.
    """
    figure, axes = plt.subplots(figsize=size, layout="constrained")
    body, angle = cuboid_faces(np.array(half), -np.array(pivot)), np.radians(AZIMUTH)
    places = np.arange(len(sides)) - 0.5 * (len(sides) - 1)
    for place, tops in zip(places, sides.values(), strict=True):
        origin = place * APART * np.array((np.cos(angle), np.sin(angle), 0.0))
        for top in tops:
            draw_vectors(axes, top, origin, is_behind=True)
        for top in tops:
            draw_cuboid(axes, body @ top.path.frame[top.i] + origin, top)
        for top in tops:
            draw_vectors(axes, top, origin, is_behind=False)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    for place, label in zip(places, sides, strict=True):
        words = {"ha": "center", "va": "top", "annotation_clip": False}
        axes.annotate(label.strip(), (place * APART, low), **words)
    if not size:
        height = STILL_WIDTH * (high - low) / (right - left) + LINE
        figure.set_size_inches(STILL_WIDTH, height)
    return figure


def draw_four_tops(courses, t, half, pivot):
    """Draw a picture like figures 6.1 to 6.4 in the thesis."""

    def top(name, *look):
        i = int(np.argmin(np.abs(courses[name].t - t)))
        return Top(courses[name].path, i, TOPS[name], *look)

    sides = {"Bobenko-Suris": ("red", "blue"), "Extrap": ("yellow", "green")}
    tops = {name: [top(one), top(two, THIN, GLASS)] for name, (one, two) in sides.items()}
    return draw_tops(tops, half, pivot)


def draw_starts(scene, half, pivot, colours):
    """Draw the body in its initial state, once in each colour."""
    tops = {" " * i: [Top(kr.solve(scene, [0.0]), 0, colour)] for i, colour in enumerate(colours)}
    return draw_tops(tops, half, pivot, size=(3.6, 2.6) if len(colours) == 1 else None)


@as_svg
def draw_rod(rod, colour):
    """Draw a rod whose thickness is determined by the moments of inertia."""
    thickness = 0.045 * np.ptp(rod.centre, axis=0).max()
    figure, axes = plt.subplots(figsize=(3.4, 4.2), layout="constrained")
    rod.plot(axes, thickness=thickness, colour=colour, azimuth=AZIMUTH)
    return figure
