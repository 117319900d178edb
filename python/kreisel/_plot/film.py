"""Films of moving tops."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from decimal import ROUND_UP, Decimal
from functools import cached_property
from io import BytesIO
from itertools import chain
from pathlib import Path as File
from typing import Any, NamedTuple

import numpy as np

from .._model.body import Body
from .._utils.arguments import (
    Array,
    as_int,
    as_positive,
    as_unit_name,
    make_frozen_class_decorator,
    optional_dependency,
)
from .._utils.files import atomic_write, check_file_is_writable
from ..quaternion import multiply, turn
from .charts import (
    FAINT,
    MOST_POINTS,
    POINTS_PER_TURN,
    compute_duration_of_turn,
    project_to_view,
    set_equal_scale_and_hide_frame,
)

with optional_dependency("'kreisel[plot]'"):
    import matplotlib
    from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, HTMLWriter
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection, PathCollection, PolyCollection
    from matplotlib.colors import to_rgb, to_rgba
    from matplotlib.figure import Figure
    from matplotlib.path import Path as Outline
    from PIL import Image


RED, CREAM = "#c73237", "#f7ecd2"  # colours of a body, as in the interactive viewer
_LIGHT = np.array((-0.4, -0.5, 0.77))
_SLICES = 96
_PROFILE = (  # the radii and heights of the outline of a spinning top and its stem
    (0.62, 0.55), (0.7, 0.64), (0.79, 0.73), (0.87, 0.82), (0.93, 0.9), (0.97, 0.96), (0.99, 1.01),
    (1.0, 1.05), (1.0, 1.1), (1.0, 1.15), (1.0, 1.2), (0.98, 1.25), (0.95, 1.3), (0.91, 1.35),
    (0.85, 1.4), (0.78, 1.46), (0.7, 1.5), (0.59, 1.54), (0.47, 1.57), (0.33, 1.59), (0.2, 1.62),
    (0.1, 1.68), (0.1, 2.15), (0.16, 2.2), (0.16, 2.35), (0.0, 2.4),
)  # fmt: skip


def _rotate(q: Array, points: Array) -> Array:
    return np.stack(turn(tuple(q), tuple(np.moveaxis(points, -1, 0))), axis=-1)


def _compute_signed_areas(x: Array, y: Array) -> Array:
    """Return twice the area of each face, positive if its corners run counterclockwise."""
    area: Array = (x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1])
    return area - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0])


def draw_solid_faces(
    axes: Axes,
    corners: Array,
    colour: str | Array,
    elevation: float = 20.0,
    azimuth: float = 0.0,
    edge: float = 0.0,
) -> PolyCollection:
    """Draw the visible faces of a solid, from the farthest to the nearest.

    corners  (n, 4, 3) counterclockwise as seen from outside
    colour   of all faces, or an array; faces that are turned towards the light are brighter
    edge     the line width of the outlines [pt]
    """
    x, y, depth = project_to_view(corners, elevation, azimuth)
    is_visible = _compute_signed_areas(x, y) > 0.0
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


def cuboid(mass: float, moments: Array, com: Array) -> tuple[Array, Array, Array]:
    """Return the half-edge lengths, centre and axes of a homogeneous cuboid.

    The cuboid has the given principal moments of inertia about the fixed point. If no cuboid of the
    given mass has them, the mass is increased at constant mass * com so that the cuboid is as large
    as possible. If that does not suffice, the half-edges are proportional to the square roots of
    the moments.
    """
    solids = []
    for k in range(1200):
        trial = mass * 1.05**k
        centre = mass * com / trial
        square = centre @ centre * np.eye(3) - np.outer(centre, centre)
        inertia = np.diag(moments) - trial * square
        diagonal = np.diag(inertia)
        central, axes = diagonal, np.eye(3)
        if np.abs(inertia - np.diag(diagonal)).max() > 1e-12 * moments.max():
            central, axes = np.linalg.eigh(inertia)
        squares = 1.5 / trial * (central.sum() - 2.0 * central)
        least = 1e-4 * squares.max()
        if squares.min() >= -1e-9 * squares.max() and least > 0.0:
            axes = -axes if np.linalg.det(axes) < 0.0 else axes
            solids.append((np.sqrt(np.maximum(squares, least)), centre, axes.T))
            if k == 0:
                break
    other = np.sqrt(moments / moments.max()), np.zeros(3), np.eye(3)
    return max(solids, key=lambda solid: float(np.prod(solid[0])), default=other)


def build_cuboid_faces(half: Array, centre: Array, axes: Array) -> tuple[Array, Array]:
    """Return the faces of a cuboid and their colours; one face is brighter than the others."""
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=np.float64)
    corners = np.empty((6, 4, 3))
    for k, side in enumerate((-1, 1) * 3):
        axis = k // 2
        corners[k, :, axis] = side
        corners[k][:, [(axis + 1) % 3, (axis + 2) % 3]] = square[::side]
    shades = [RED, RED, "#d8575b", "#d8575b", "#a8262b", CREAM]
    return centre + (corners * half) @ axes, np.array([to_rgb(c) for c in shades])


def build_faces_of_revolution(
    radius: float, half: float, height: float, tip: bool
) -> tuple[Array, Array]:
    """Return the faces of a body of revolution about the third axis, and their colours.

    `radius`, `half` and `height` are the radius, half-length and centre height of a cylinder, or,
    if `tip` is True, of a spinning top of similar size that stands on the origin. One sector is
    brighter, which makes the spin visible.
    """
    low = height - half
    if tip:
        foot = [(0.0, 0.0), (0.05, 0.02 * half)] if low > 0.3 * half else []
        start = [(0.05, low)] if foot else [(0.0, min(low, 0.0))]
        profile = foot + start + [(r, low + z * half) for r, z in _PROFILE]
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


def build_solid_faces(body: Body) -> tuple[Array, Array]:
    """Return the faces of a solid that represents a body, and their colours.

    A body that is symmetric about its apex is drawn as a spinning top or, if its centre of mass is
    the fixed point, as a cylinder, any other as a cuboid. The corners are in the user's body frame,
    and scaled to fit into the unit sphere.
    """
    moments, com = np.array(body.moments), np.array(body.principal_com)
    half, centre, axes = cuboid(body.mass, moments, com)
    apex = int(np.argmax(np.abs(com))) if com.any() else 2
    i, j = (apex + 1) % 3, (apex + 2) % 3
    level = np.abs(com[[i, j]]).max() <= 1e-9 * np.abs(com).max(initial=0.0)
    if level and abs(moments[i] - moments[j]) <= 1e-9 * moments.max():
        quads, colours = build_faces_of_revolution(
            2.0 * half[i] / 3**0.5, half[apex], abs(centre[apex]), bool(com.any())
        )
        frame = np.eye(3)[[i, j, apex]]
        if com[apex] < 0.0:
            frame[1:] *= -1.0
        quads = quads @ frame
    else:
        quads, colours = build_cuboid_faces(half, centre, axes)
    quads = _rotate(np.array(body.axes), quads)
    return quads * (_REACH / np.linalg.norm(quads, axis=-1).max()), colours


GRID, SHADOW, STAND, STEEL = "#808894", "#0c1018", "#9a9389", "#aab2bd"
_RADIUS = 1.5  # of the floor, which fades out
_RINGS, _SPOKES = 6, 24
_STRENGTH = 0.3  # opacity of the shadow
_LAMP = np.array((-0.25, -0.3))  # horizontal parts of the direction to the lamp, for height 1
_WIDTH = 0.05  # radius of the lamp, for height 1
_POINTS = 7  # of the lamp; each casts a shadow of its own
_MARGIN = 1.08  # half width of the picture


def _project_horizontal_points(places: Array, height: float) -> Array:
    points = np.concatenate([places, np.full_like(places[..., :1], height)], axis=-1)
    return np.stack(project_to_view(points)[:2], axis=-1)


def draw_floor_sphere_and_stand(axes: Axes, floor: float) -> None:
    """Draw the floor, the unit sphere above it, and the needle that supports the body.

    The floor has concentric circles and spokes that fade towards its edge. The limits of the axes
    are those of a square picture that shows the sphere and part of the floor.
    """
    _, y, _ = project_to_view(np.array([[0.0, -0.9, floor], [0.0, 0.0, 1.3]]))
    low = min(float(y[0]), -_MARGIN if floor < -0.5 else 0.0)
    middle = 0.5 * (low + float(y[1]))
    axes.set(xlim=(-_MARGIN, _MARGIN), ylim=(middle - _MARGIN, middle + _MARGIN))
    axes.set_autoscale_on(False)

    turn_angle = np.linspace(0.0, 2.0 * np.pi, 121)
    circle = np.stack([np.cos(turn_angle), np.sin(turn_angle)], axis=-1)
    lines = [r * circle for r in np.linspace(0.0, _RADIUS, _RINGS + 1)[1:]]
    radii = np.linspace(0.0, _RADIUS, 31)
    lines += list(circle[:: 120 // _SPOKES][:-1][:, None] * radii[:, None])
    pieces = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    distance = np.linalg.norm(pieces.mean(axis=1), axis=-1) / _RADIUS
    colours = np.tile(to_rgba(GRID), (len(pieces), 1))
    colours[:, 3] = 0.35 * np.clip(1.0 - distance, 0.0, 1.0) ** 0.5
    segments = list(_project_horizontal_points(pieces, floor))
    axes.add_collection(LineCollection(segments, colors=colours, linewidths=0.6, zorder=0.1))

    turn_angle = np.linspace(0.0, 2.0 * np.pi, 361)
    x, y = np.cos(turn_angle), np.sin(turn_angle)
    height = y * np.cos(np.radians(20.0))  # of the points of the outline of the sphere
    axes.plot(x, np.where(height >= floor, y, np.nan), color=FAINT, linewidth=0.8, zorder=0.6)
    if floor > -1.0:
        rim = (1.0 - floor * floor) ** 0.5 * np.stack([x, y], axis=-1)
        places = _project_horizontal_points(rim, floor)
        axes.plot(*places.T, color=FAINT, linewidth=0.7, alpha=0.7, zorder=0.6)
    tip, base, origin, foot = (
        _project_horizontal_points(np.zeros(2), z) for z in (1.22, 1.0, 0.0, floor)
    )
    arrow = {"arrowstyle": "->", "color": FAINT}
    axes.annotate("", tuple(tip.tolist()), tuple(base.tolist()), arrowprops=arrow)
    needle = np.stack([origin, foot]).T
    axes.plot(*needle, color=STAND, linewidth=2.0, solid_capstyle="round", zorder=1.5)
    axes.plot([0.0], [0.0], "o", color=STAND, markersize=4.5, zorder=1.6)


def draw_body_shadow(axes: Axes, corners: Array, floor: float) -> PathCollection:
    """Draw the shadow, which is sharp only near the floor, as the lamp has a finite size."""
    height = corners[..., 2:] - floor
    outlines = []
    for k in range(_POINTS):  # the points of the lamp lie on a spiral
        radius, turn = _WIDTH * np.sqrt((k + 0.5) / _POINTS), 2.39996 * k
        lamp = _LAMP + radius * np.array((np.cos(turn), np.sin(turn)))
        faces = _project_horizontal_points(corners[..., :2] - height * lamp, floor)
        # The faces that are turned away from the lamp cover the same area.
        faces = faces[_compute_signed_areas(*np.moveaxis(faces, -1, 0)) > 0.0]
        codes = np.tile([Outline.MOVETO, *[Outline.LINETO] * 3, Outline.CLOSEPOLY], len(faces))
        closed = np.concatenate([faces, faces[:, :1]], axis=1).reshape(-1, 2)
        outlines.append(Outline(closed, codes.astype(np.uint8)))
    opacity = 1.0 - (1.0 - _STRENGTH) ** (1.0 / _POINTS)
    shadow = PathCollection(
        outlines, facecolors=[to_rgba(SHADOW, opacity)], linewidths=0.0, zorder=0.4
    )
    axes.add_collection(shadow)
    return shadow


MOST_PIXELS = 2**28  # largest number of pixels of all frames; a GIF needs a byte of memory for each
BETWEEN = 8  # fewest points of the trace per frame
SECONDS = 8.0
_DPI = 100
_MOST_COLOURS = 128  # of a GIF
_REACH = 0.8  # size of the drawn body, as a fraction of the radius of the sphere
_LEAN = 0.2  # sine of the smallest angle with the vertical that counts as a lean
_LEVEL = 0.02  # depth below the fixed point that is drawn as if the body stood on the floor
_ASIDE = 30.0  # angle by which the lean is turned towards the eye [degrees]


class FilmedTop(NamedTuple):
    """The body of a top, its attitudes (n, 4) in the frames, and the trace of its apex.

    apex       ((n - 1) * between + 1, 3) directions
    is_joined  False: the directions are too far apart to be joined by a line
    """

    body: Body
    q: Array
    apex: Array
    is_joined: bool

    def draw_frames(self, axes: Axes, captions: list[str]) -> Iterator[None]:
        """Draw the top as it is in each of the frames in turn, with a caption."""
        quads, colours = build_solid_faces(self.body)
        edge = 0.8 if len(quads) == 6 else 0.0  # outlines of a cuboid
        extent = np.unique(quads.reshape(-1, 3), axis=0)
        lowest = min(float(_rotate(one, extent)[:, 2].min()) for one in self.q)
        floor = max(min(lowest, float(self.apex[:, 2].min())), -1.0) if lowest < -_LEVEL else 0.0
        set_equal_scale_and_hide_frame(axes)
        draw_floor_sphere_and_stand(axes, floor)
        style = "-" if self.is_joined else ","
        (back_trace,) = axes.plot([], [], style, color=RED, linewidth=0.7, alpha=0.45)
        (trace,) = axes.plot([], [], style, color=RED, linewidth=1.2, alpha=0.85, zorder=3)
        (needle,) = axes.plot([], [], color=STEEL, linewidth=2.0)
        (tip,) = axes.plot([], [], "o", color=RED, markersize=4)
        (lever,) = axes.plot([], [], color=STEEL, linewidth=2.6)
        text = axes.text(0.03, 0.03, "", transform=axes.transAxes, fontsize=9)
        x, y, depth = project_to_view(self.apex)
        between = (len(self.apex) - 1) // (len(self.q) - 1)
        heights = _rotate(self.q[0], quads) @ self.apex[0]  # extent of the body along its apex
        begin, end = max(float(heights.min()), 0.0), float(heights.max())
        frames = zip(range(0, len(x), between), self.q, captions, strict=True)
        for index, q, caption in frames:
            span = slice(0, index + 1)
            back_trace.set_data(x[span], np.where(depth[span] <= 0.0, y[span], np.nan))
            trace.set_data(x[span], np.where(depth[span] > 0.0, y[span], np.nan))
            needle.set_data([end * x[index], x[index]], [end * y[index], y[index]])
            tip.set_data([x[index]], [y[index]])
            if begin > 0.0:
                lever.set_data([0.0, begin * x[index]], [0.0, begin * y[index]])
            for part in needle, tip:
                part.set_zorder(4.0 if depth[index] > 0.0 else 1.0)
            lever.set_zorder(1.7 if depth[index] > 0.0 else 2.5)  # the body has zorder 2.0
            corners = _rotate(q, quads)
            solid = draw_solid_faces(axes, corners, colours, edge=edge)
            solid.set_zorder(2.0)
            shadow = draw_body_shadow(axes, corners, floor)
            text.set_text(caption)
            yield
            solid.remove()
            shadow.remove()


@make_frozen_class_decorator("path.animate({}=...) returns a new film")
@dataclass(frozen=True, eq=False, repr=False)
class Film:
    """An animation of a path, to be saved to a file or displayed in a notebook.

    t    (n,) evenly spaced times of the frames [T]
    fps  number of frames per second
    """

    t: Array
    fps: int
    _tops: list[FilmedTop]
    _size: int  # height and width of the picture of one top
    _time_unit: str | None

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        span = f"t = {self.t[0]:g} .. {self.t[-1]:g}"
        return f"<Film: {len(self)} frames, {self.fps} a second, {span}>"

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the animation atomically to a .gif, .mp4 (needs ffmpeg) or .html file.

        Raises ValueError for an unknown suffix, and OSError if the file cannot be written.
        """
        atomic_write(file, select_film_encoder(file)(self))

    def _repr_html_(self) -> str:
        return self._html_animation

    @cached_property
    def _html_animation(self) -> str:
        return _encode_html(self).decode()

    def _draw_frames(self) -> Iterator[Figure]:
        rows, columns = arrange_pictures(len(self._tops))
        inches = self._size / _DPI
        figure = Figure(figsize=(columns * inches, rows * inches), dpi=_DPI)
        pictures, unit = [], f" {self._time_unit}" if self._time_unit else ""
        clock = [f"t = {t:.4g}{unit}" for t in self.t]
        for k, top in enumerate(self._tops):
            place = (k % columns) / columns, 1.0 - (k // columns + 1) / rows
            axes = figure.add_axes((*place, 1.0 / columns, 1.0 / rows))
            has_clock = k == (rows - 1) * columns  # in the lower left corner
            pictures.append(top.draw_frames(axes, clock if has_clock else [""] * len(self)))
        for _ in zip(*pictures, strict=True):
            yield figure


def arrange_pictures(n: int) -> tuple[int, int]:
    """Return the numbers of rows and columns in which n square pictures are arranged."""
    columns = math.ceil(math.sqrt(n))
    return -(-n // columns), columns


def make_film(
    paths: Sequence[Any],
    file: str | os.PathLike[str] | None,
    speed: float | None,
    fps: int,
    size: int,
    time_unit: str | None = None,
) -> Film:
    """Return an animation of the paths of tops, side by side, over the time that they share.

    All arguments are validated before any state is computed.
    """
    make = None if file is None else select_film_encoder(file)
    rate, wide = as_int("fps", fps, 1), as_int("size", size, 16)
    unit = None if time_unit is None else as_unit_name("time_unit", time_unit)
    low = max(float(path.t.min(initial=np.inf)) for path in paths)
    high = min(float(path.t.max(initial=-np.inf)) for path in paths)
    if not low < high:
        raise ValueError("a film needs a path of positive duration: solve to a later time")
    begin, end = (low, high) if paths[0].t[-1] >= paths[0].t[0] else (high, low)
    duration, pictures = high - low, math.prod(arrange_pictures(len(paths)))
    pace = duration / SECONDS if speed is None else as_positive("speed", speed)
    steps = _count_steps_between_frames(duration * rate, pace, wide, pictures)
    turns = [duration / compute_duration_of_turn(path.scene) * POINTS_PER_TURN for path in paths]
    joined = [number <= MOST_POINTS for number in turns]
    drawn = [math.ceil(n / steps) for n, is_joined in zip(turns, joined, strict=True) if is_joined]
    between = max([BETWEEN, *drawn])
    t = np.linspace(begin, end, steps * between + 1)
    tops = []
    for path, is_joined in zip(paths, joined, strict=True):
        states = path(t)
        q, apex = states.q[::between], states.apex
        lean = np.hypot(apex[:, 0], apex[:, 1])
        i = int(np.argmax(lean >= min(_LEAN, float(lean.max()))))
        if lean[i] > 0.0:  # the first clear tilt is turned until it is seen from the side
            half = -0.5 * (np.radians(_ASIDE) + np.arctan2(apex[i, 1], apex[i, 0]))
            aside = np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
            q = np.stack(multiply(tuple(aside), tuple(q.T)), axis=-1)
            apex = _rotate(aside, apex)
        tops.append(FilmedTop(path.scene.body, q, apex, is_joined))
    film = Film(t[::between], rate, tops, wide, unit)
    if file is not None and make is not None:
        atomic_write(file, make(film))
    return film


def _count_steps_between_frames(length: float, speed: float, size: int, pictures: int) -> int:
    """Return the number of frames minus one, for a path of `length` frames at the speed 1."""
    area = size**2 * pictures
    frames, most = max(length / speed + 1.0, 2.0), MOST_PIXELS // area
    if frames <= MOST_PIXELS and round(frames) <= most:
        return round(frames) - 1
    tops = f" for {pictures} tops" if pictures > 1 else ""
    problem = f"{frames:.7g} frames of {size} x {size} pixels{tops} are too many"
    if most < 2:
        largest = math.isqrt(MOST_PIXELS // (2 * pictures))
        raise ValueError(f"{problem}: the size must be at most {largest}")
    slowest = Decimal(length / (most - 1))
    digits = Decimal((0, (1,), slowest.adjusted() - 2))
    raise ValueError(
        f"{problem}: {most} are possible, with speed = "
        f"{float(slowest.quantize(digits, ROUND_UP)):.3g}, or use fewer or smaller frames"
    )


def select_film_encoder(file: str | os.PathLike[str]) -> Callable[[Film], bytes]:
    """Return the encoder for the suffix of a file, which must be writable."""
    suffix = File(file).suffix.lower()
    if suffix not in _MAKERS:
        raise ValueError(f"file must end in one of {', '.join(_MAKERS)}, not {os.fspath(file)!r}")
    if suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise OSError("a film as .mp4 needs ffmpeg, which was not found: use .gif or .html")
    check_file_is_writable(file)
    return _MAKERS[suffix]


def _encode_gif(film: Film) -> bytes:
    """Encode an animation as a GIF with one byte per pixel and the palette of the first frame."""

    def render(figure: Figure) -> Image.Image:
        raw = BytesIO()
        figure.savefig(raw, format="rgba", dpi=_DPI)
        size = figure.canvas.get_width_height()
        return Image.frombytes("RGBA", size, raw.getvalue()).convert("RGB")

    images = map(render, film._draw_frames())
    first = next(images)
    palette, none = _choose_gif_palette(first), Image.Dither.NONE
    frames = (one.quantize(palette=palette, dither=none) for one in chain([first], images))
    file = BytesIO()
    pause = 10 * max(2, round(100.0 / film.fps))  # a GIF has whole hundredths of a second
    next(frames).save(file, "GIF", save_all=True, append_images=frames, duration=pause, loop=0)
    return file.getvalue()


def _choose_gif_palette(image: Image.Image) -> Image.Image:
    """Return the palette of the first frame, with the rare colours of thin lines and text."""
    ground = np.array(image.getpixel((0, 0)))
    ink = matplotlib.rcParams["text.color"]
    shades = [(colour, part) for colour in (ink, RED, FAINT) for part in (1.0, 0.75, 0.5, 0.25)]
    strokes = [
        ground + part * (255.0 * np.array(to_rgb(colour)) - ground)
        for colour, part in [*shades, (STEEL, 1.0), (STEEL, 0.5), (STAND, 1.0), (CREAM, 1.0)]
    ]
    palette_image = image.quantize(_MOST_COLOURS - len(strokes))
    colours = np.array(palette_image.getpalette()).reshape(-1, 3)[: _MOST_COLOURS - len(strokes)]
    colours[np.abs(colours - ground).max(axis=1) <= 8] = ground  # an exact background
    palette_image.putpalette(
        np.concatenate([colours, np.rint(strokes)]).astype(int).ravel().tolist()
    )
    return palette_image


def _encode_html(film: Film) -> bytes:
    with matplotlib.rc_context({"animation.embed_limit": 500.0}):
        return _encode_frames(film, HTMLWriter(fps=film.fps, embed_frames=True), ".html")


def _encode_frames(film: Film, writer: AbstractMovieWriter, suffix: str) -> bytes:
    frames = film._draw_frames()
    with tempfile.TemporaryDirectory() as folder:
        file = File(folder, f"film{suffix}")
        with writer.saving(next(frames), file, _DPI):
            writer.grab_frame()
            for _ in frames:
                writer.grab_frame()
        return file.read_bytes()


_DOCUMENT = b'<!doctype html>\n<html><head><meta charset="utf-8"></head>\n%b</html>\n'
_MAKERS: dict[str, Callable[[Film], bytes]] = {
    ".gif": _encode_gif,
    ".mp4": lambda film: _encode_frames(film, FFMpegWriter(fps=film.fps, codec="h264"), ".mp4"),
    ".html": lambda film: _DOCUMENT % _encode_html(film),
}
