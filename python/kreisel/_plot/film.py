"""Animations of a moving body, as GIF, MP4 or HTML.

Each file is written only after the animation is complete.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Iterator
from decimal import ROUND_UP, Decimal
from functools import cached_property
from io import BytesIO
from itertools import chain
from pathlib import Path as File
from typing import Protocol

import numpy as np

from .._model.body import Body
from .._model.scene import Scene
from .._utils.atomic_io import atomic_write, check_file_is_writable
from .._utils.errors import make_frozen_class_decorator
from .._utils.optional import optional_dependency
from .._utils.validation import Array, as_int, as_positive, as_unit_name
from .dense_motion import MOST_POINTS, POINTS_PER_TURN, compute_duration_of_turn
from .solids import (
    CREAM,
    FAINT,
    RED,
    build_solid_faces,
    draw_solid_faces,
    project_to_view,
    set_equal_scale_and_hide_frame,
)
from .stage import STAND, STEEL, draw_body_shadow, draw_floor_sphere_and_stand

with optional_dependency("'kreisel[plot]'"):
    import matplotlib
    from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, HTMLWriter
    from matplotlib.colors import to_rgb
    from matplotlib.figure import Figure
    from PIL import Image

MOST_PIXELS = 2**28  # largest number of pixels of all frames; a GIF needs a byte of memory for each
BETWEEN = 8  # fewest points of the trace per frame
SECONDS = 8.0
_DPI = 100
_MOST_COLOURS = 128  # of a GIF
_REACH = 0.8  # size of the drawn body, as a fraction of the radius of the sphere
_LEAN = 0.2  # sine of the smallest angle with the vertical that counts as a lean
_LEVEL = 0.02  # depth below the fixed point that is drawn as if the body stood on the floor
_ASIDE = 30.0  # angle by which the lean is turned towards the eye [degrees]


class AnimatablePath(Protocol):
    """A path that can be animated."""

    @property
    def scene(self) -> Scene: ...
    @property
    def t(self) -> Array: ...
    @property
    def q(self) -> Array: ...
    @property
    def apex(self) -> Array: ...
    def __call__(self, t: Array, /) -> AnimatablePath: ...


@make_frozen_class_decorator("path.animate({}=...) returns a new film")
class Film:
    """An animation of a path, to be saved to a file or displayed in a notebook.

    t    (n,) evenly spaced times of the frames [T]
    fps  number of frames per second
    """

    t: Array
    fps: int
    _body: Body
    _q: Array
    _apex: Array
    _size: int
    _time_unit: str | None
    _between: int  # points of _apex per frame
    _is_joined: bool  # False: the points are too far apart to be joined by a line

    def __init__(
        self,
        body: Body,
        t: Array,
        q: Array,
        apex: Array,
        fps: int,
        size: int,
        time_unit: str | None = None,
        is_joined: bool = True,
    ) -> None:
        self.__dict__.update(t=t, fps=fps, _body=body, _q=q, _apex=apex, _size=size)
        self.__dict__.update(_time_unit=time_unit, _is_joined=is_joined)
        self.__dict__["_between"] = (len(apex) - 1) // (len(t) - 1)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        span = f"t = {self.t[0]:g} .. {self.t[-1]:g}"
        return f"<Film: {len(self)} frames, {self.fps} a second, {span}>"

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the animation atomically to a .gif, .mp4 (needs ffmpeg) or .html file.

        Raises ValueError for an unknown suffix, and OSError if the file cannot be written.
        """
        make = select_film_encoder(file)
        atomic_write(file, make(self))

    def _repr_html_(self) -> str:
        return self._html_animation

    @cached_property
    def _html_animation(self) -> str:
        return _encode_html(self).decode()

    def _draw_frames(self) -> Iterator[Figure]:
        """Yield the figure once for each frame, after redrawing it."""
        figure = Figure(figsize=(self._size / _DPI,) * 2, dpi=_DPI)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        quads, colours, edge = _build_body_faces(self._body)
        floor = _find_floor_height(quads, self._q, self._apex)
        set_equal_scale_and_hide_frame(axes)
        draw_floor_sphere_and_stand(axes, floor)
        style = "-" if self._is_joined else ","
        (back_trace,) = axes.plot([], [], style, color=RED, linewidth=0.7, alpha=0.45)
        (trace,) = axes.plot([], [], style, color=RED, linewidth=1.2, alpha=0.85, zorder=3)
        (needle,) = axes.plot([], [], color=STEEL, linewidth=2.0)
        (tip,) = axes.plot([], [], "o", color=RED, markersize=4)
        (lever,) = axes.plot([], [], color=STEEL, linewidth=2.6)
        clock = axes.text(0.03, 0.03, "", transform=axes.transAxes, fontsize=9)
        x, y, depth = project_to_view(self._apex)
        begin, end = _measure_extent_along_apex(
            quads @ _rotation_matrix(self._q[0]).T, self._apex[0]
        )
        for i, (t, q) in enumerate(zip(self.t, self._q, strict=True)):
            index = i * self._between
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
            corners = quads @ _rotation_matrix(q).T
            solid = draw_solid_faces(axes, corners, colours, edge=edge)
            solid.set_zorder(2.0)
            shadow = draw_body_shadow(axes, corners, floor)
            clock.set_text(f"t = {t:.4g}" + (f" {self._time_unit}" if self._time_unit else ""))
            yield figure
            solid.remove()
            shadow.remove()


def _measure_extent_along_apex(corners: Array, apex: Array) -> tuple[float, float]:
    """Return the smallest (at least 0) and largest coordinate of a body along its apex axis."""
    heights = corners @ apex
    return max(float(heights.min()), 0.0), float(heights.max())


def _find_floor_height(quads: Array, q: Array, apex: Array) -> float:
    """Return the height of a floor that lies below the body and the trace of its apex.

    If the body always stays above the fixed point, the floor is at height 0.
    """
    corners = np.unique(quads.reshape(-1, 3), axis=0)
    lowest = min(float((corners @ _rotation_matrix(one)[2]).min()) for one in q)
    return max(min(lowest, float(apex[:, 2].min())), -1.0) if lowest < -_LEVEL else 0.0


def make_film(
    path: AnimatablePath,
    file: str | os.PathLike[str] | None,
    speed: float | None,
    fps: int,
    size: int,
    time_unit: str | None = None,
) -> Film:
    """Return an animation of a path, and save it if `file` is given.

    All arguments are validated before any state is computed.
    """
    make = None if file is None else select_film_encoder(file)
    rate, wide = as_int("fps", fps, 1), as_int("size", size, 16)
    unit = None if time_unit is None else as_unit_name("time_unit", time_unit)
    begin, end = _get_first_and_last_time(path.t)
    pace = abs(end - begin) / SECONDS if speed is None else as_positive("speed", speed)
    steps = _count_steps_between_frames(abs(end - begin) * rate, pace, wide)
    turns = abs(end - begin) / compute_duration_of_turn(path.scene)
    is_joined = turns * POINTS_PER_TURN <= MOST_POINTS
    between = max(BETWEEN, math.ceil(turns * POINTS_PER_TURN / steps) if is_joined else 0)
    t = np.linspace(begin, end, steps * between + 1)
    states = path(t)
    q, apex = _rotate_lean_to_side(states.q, states.apex)
    film = Film(path.scene.body, t[::between], q[::between], apex, rate, wide, unit, is_joined)
    if file is not None and make is not None:
        atomic_write(file, make(film))
    return film


def _rotate_lean_to_side(q: Array, apex: Array) -> tuple[Array, Array]:
    """Rotate all states about the vertical so that the body leans to the side in the picture.

    After the rotation, the apex of the first clearly tilted state points to the right of the
    picture and slightly towards the viewer. If no state is clearly tilted, the most tilted state is
    used instead.
    """
    lean = np.hypot(apex[:, 0], apex[:, 1])
    index = int(np.argmax(lean >= min(_LEAN, float(lean.max()))))
    if not lean[index] > 0.0:
        return q, apex
    angle = -np.radians(_ASIDE) - np.arctan2(apex[index, 1], apex[index, 0])
    rotation = np.array([np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)])
    w, x, y, z = q.T
    first, _, _, last = rotation
    components = [
        first * w - last * z,
        first * x - last * y,
        first * y + last * x,
        first * z + last * w,
    ]
    return np.stack(components, axis=-1), apex @ _rotation_matrix(rotation).T


def _get_first_and_last_time(t: Array) -> tuple[float, float]:
    """Return the first and the last time of a path, which may run backwards in time."""
    low, high = float(t.min(initial=np.inf)), float(t.max(initial=-np.inf))
    if not low < high:
        raise ValueError("a film needs a path of positive duration: solve to a later time")
    return (low, high) if t[-1] >= t[0] else (high, low)


def _build_body_faces(body: Body) -> tuple[Array, Array, float]:
    """Return the faces of a body, their colours, and the line width of their outlines [pt].

    The corners are given in the user's body frame, after scaling the body to fit into the unit
    sphere. For a body of revolution, the line width is 0, so that no outlines are drawn.
    """
    quads, colours = build_solid_faces(
        body.mass, np.array(body.moments), np.array(body.principal_com)
    )
    quads = quads @ _rotation_matrix(np.array(body.axes)).T
    edge = 0.8 if len(quads) == 6 else 0.0
    return quads * (_REACH / np.linalg.norm(quads, axis=-1).max()), colours, edge


def _rotation_matrix(q: Array) -> Array:
    """Return the rotation matrix of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (z * x + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (z * z + x * x), 2 * (y * z - w * x)],
            [2 * (z * x - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _count_steps_between_frames(length: float, speed: float, size: int) -> int:
    """Return the number of frames minus one, for a path of `length` frames at the speed 1.

    Raises ValueError if all frames together have too many pixels.
    """
    frames, most = max(length / speed + 1.0, 2.0), MOST_PIXELS // size**2
    if frames <= MOST_PIXELS and round(frames) <= most:
        return round(frames) - 1
    problem = f"{frames:.7g} frames of {size} x {size} pixels are too many"
    if most < 2:
        raise ValueError(f"{problem}: the size must be at most {math.isqrt(MOST_PIXELS // 2)}")
    slowest = Decimal(length / (most - 1))
    digits = Decimal((0, (1,), slowest.adjusted() - 2))
    raise ValueError(
        f"{problem}: {most} are possible, with speed = "
        f"{float(slowest.quantize(digits, ROUND_UP)):.3g}, or use fewer or smaller frames"
    )


def select_film_encoder(file: str | os.PathLike[str]) -> Callable[[Film], bytes]:
    """Return the function that encodes animations in the format of the given file.

    Raises ValueError for an unknown suffix, and OSError if the file cannot be written.
    """
    suffix = File(file).suffix.lower()
    if suffix not in _MAKERS:
        raise ValueError(f"file must end in one of {', '.join(_MAKERS)}, not {os.fspath(file)!r}")
    if suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise OSError("a film as .mp4 needs ffmpeg, which was not found: use .gif or .html")
    check_file_is_writable(file)
    return _MAKERS[suffix]


def _encode_gif(film: Film) -> bytes:
    """Encode an animation as a GIF with one byte per pixel and the palette of the first frame."""
    images = _render_film_images(film)
    first_image = next(images)
    palette = _choose_gif_palette(first_image)
    frames = (
        image.quantize(palette=palette, dither=Image.Dither.NONE)
        for image in chain([first_image], images)
    )
    file = BytesIO()
    pause = 10 * max(2, round(100.0 / film.fps))  # a GIF has whole hundredths of a second
    next(frames).save(file, "GIF", save_all=True, append_images=frames, duration=pause, loop=0)
    return file.getvalue()


def _choose_gif_palette(image: Image.Image) -> Image.Image:
    """Return an image that contains the palette of an animation.

    The palette contains the most frequent colours of the first frame. The colours of thin lines and
    of text are added to the palette, because they are rare in the first frame.
    """
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


def _render_film_images(film: Film) -> Iterator[Image.Image]:
    for figure in film._draw_frames():
        raw = BytesIO()
        figure.savefig(raw, format="rgba", dpi=_DPI)
        size = figure.canvas.get_width_height()
        yield Image.frombytes("RGBA", size, raw.getvalue()).convert("RGB")


def _encode_html(film: Film) -> bytes:
    with matplotlib.rc_context({"animation.embed_limit": 500.0}):
        return _encode_frames_to_bytes(film, HTMLWriter(fps=film.fps, embed_frames=True), ".html")


def _encode_html_document(film: Film) -> bytes:
    return (
        b'<!doctype html>\n<html><head><meta charset="utf-8"></head>\n'
        + _encode_html(film)
        + b"</html>\n"
    )


def _encode_mp4(film: Film) -> bytes:
    return _encode_frames_to_bytes(film, FFMpegWriter(fps=film.fps, codec="h264"), ".mp4")


def _encode_frames_to_bytes(film: Film, writer: AbstractMovieWriter, suffix: str) -> bytes:
    """Write the frames to a temporary file, and return its contents."""
    frames = film._draw_frames()
    with tempfile.TemporaryDirectory() as folder:
        file = File(folder, f"film{suffix}")
        with writer.saving(next(frames), file, _DPI):
            writer.grab_frame()
            for _ in frames:
                writer.grab_frame()
        return file.read_bytes()


_MAKERS = {".gif": _encode_gif, ".mp4": _encode_mp4, ".html": _encode_html_document}
