"""Tests of films of paths: what each frame shows, how fast they run, and the files."""

import base64
import io
import itertools
import re
import tempfile
from typing import NamedTuple

import kreisel as kr
import numpy as np
import pytest
from tops import GENERAL

pytest.importorskip("matplotlib")
from matplotlib import rc_context
from matplotlib.animation import FFMpegWriter
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from PIL import Image

TOP = kr.scenes.thesis
PATH = kr.solve(TOP, [0.0, 255.0])
CUSPS = kr.solve(kr.scenes.cusps, np.linspace(0, 6, 301))
HALF, PIVOT = np.array((0.1, 0.2, 0.3)), np.array((0.5, 0.0, -0.4))
BLOCK = kr.Body.cuboid(HALF, pivot=PIVOT)
LEANING = kr.solve(
    kr.Scene(BLOCK, attitude=(0.8, 0.6, 0, 0), momentum=(0, 0.02, 0.1), gravity=1), 2.0
)
E20 = np.radians(20.0)


class Frame(NamedTuple):
    """The time, the tip of the apex, its trace and the corners of faces in a frame of a film."""

    clock: str
    tip: np.ndarray
    trace: np.ndarray
    is_joined: bool
    faces: np.ndarray


def record_frames(film, folder, monkeypatch):
    """Return what matplotlib draws for each frame of a film."""
    frames, save = [], Figure.savefig

    def record(figure, *args, **words):
        (axes,) = figure.axes
        (tip,) = [
            line.get_xydata()[0]
            for line in axes.lines
            if line.get_marker() == "o" and line.get_xydata().any()
        ]
        line = max((line for line in axes.lines if ends_at(line, tip)), key=count_points)
        (solid,) = [part for part in axes.collections if isinstance(part, PolyCollection)]
        faces = np.array([path.vertices[:4] for path in solid.get_paths()])
        trace, is_joined = line.get_xydata(), line.get_linestyle() == "-"
        frames.append(Frame(axes.texts[-1].get_text(), tip, trace, is_joined, faces))
        return save(figure, *args, **words)

    with monkeypatch.context() as patch:
        patch.setattr(Figure, "savefig", record)
        film.save(folder / "film.gif")
    return frames


def count_points(line):
    return len(line.get_xdata())


def ends_at(line, tip):
    """Return whether a line ends at the tip, on either side of the sphere."""
    points = line.get_xydata()
    return len(points) > 0 and points[-1, 0] == tip[0] and line.get_marker() != "o"


def rotate_to_side(path, t):
    """Return the attitudes at the times t as matrices, turned as a film is.

    The first apex that leans clearly points to the right, 30 degrees towards the eye.
    """
    states = path(np.linspace(t[0], t[-1], 8 * (len(t) - 1) + 1))
    lean = np.hypot(*states.apex[:, :2].T)
    x, y, _ = states.apex[np.argmax(lean >= min(0.2, lean.max()))]
    angle = np.radians(-30.0) - np.arctan2(y, x)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    return turn, turn @ path(t).rotation.as_matrix()


def project(points):
    """Return points of space as seen from 20 degrees above the horizon, along the y axis."""
    x, y, z = np.moveaxis(np.asarray(points), -1, 0)
    return np.stack([x, z * np.cos(E20) + y * np.sin(E20)], axis=-1)


# What is shown


@pytest.mark.parametrize("path", [LEANING, CUSPS, kr.solve(GENERAL, np.linspace(0, -2, 21))])
def test_each_frame_shows_the_state_at_its_time(path, tmp_path, monkeypatch):
    film = path.animate(fps=1, size=16)
    frames = record_frames(film, tmp_path, monkeypatch)
    turn, _ = rotate_to_side(path, film.t)
    assert len(frames) == len(film) == 9
    for frame, t, apex in zip(frames, film.t, path(film.t).apex, strict=True):
        assert frame.clock == f"t = {t:.4g}"
        assert frame.tip == pytest.approx(project(turn @ apex), abs=1e-9)
    x = frames[-1].trace[:, 0]
    passed = path(np.linspace(film.t[0], film.t[-1], len(x))).apex @ turn.T
    assert len(x) > 64 and x == pytest.approx(passed[:, 0], abs=1e-9)


def test_tops_move_side_by_side_over_the_time_that_their_paths_share(monkeypatch, tmp_path):
    tops = kr.scenes.cusps.vary(gravity=[0.5, 1.0, 2.0])
    many = kr.solve(tops, np.outer([1.5, 3.0, 2.0], [0.0, 0.5, 1.0]))
    film, tips, save = many.animate(fps=1, size=16), [], Figure.savefig

    def record(figure, *args, **words):
        places = [axes.get_position().bounds for axes in figure.axes]
        assert places == [(0.0, 0.5, 0.5, 0.5), (0.5, 0.5, 0.5, 0.5), (0.0, 0.0, 0.5, 0.5)]
        tips.append([axes.lines[-2].get_xydata()[0] for axes in figure.axes])
        return save(figure, *args, **words)

    with monkeypatch.context() as patch:
        patch.setattr(Figure, "savefig", record)
        film.save(tmp_path / "tops.gif")
    assert film.t[-1] == 1.5 and len(tips) == 9
    with Image.open(tmp_path / "tops.gif") as image:
        assert image.size == (32, 32)
    for k in range(3):
        own = record_frames(many[k]([0.0, 1.5]).animate(fps=1, size=16), tmp_path, monkeypatch)
        assert np.array([tip[k] for tip in tips]) == pytest.approx(np.array([f.tip for f in own]))
    with pytest.raises(ValueError, match="8"):
        kr.solve(tops[[0] * 9], 1.0).animate()


def test_a_block_is_drawn_as_itself(tmp_path, monkeypatch):
    """Check that the faces of a frame are those of the block that the eye sees."""
    film = LEANING.animate(fps=1, size=16)
    frames = record_frames(film, tmp_path, monkeypatch)
    _, attitudes = rotate_to_side(LEANING, film.t)
    corners = np.array(list(itertools.product((-1, 1), repeat=3))) * HALF - PIVOT
    corners *= 0.8 / np.linalg.norm(corners, axis=1).max()
    eye = np.array([0.0, -np.cos(E20), np.sin(E20)])
    for frame, attitude in zip(frames, attitudes, strict=True):
        expected = set()
        for axis, side in itertools.product(range(3), (-1, 1)):
            if side * (attitude[:, axis] @ eye) > 0.0:
                face = corners[np.sign(corners[:, axis] - corners[:, axis].mean()) == side]
                expected.add(frozenset(map(tuple, project(face @ attitude.T).round(6) + 0.0)))
        assert {frozenset(map(tuple, face.round(6) + 0.0)) for face in frame.faces} == expected


@pytest.mark.parametrize("height", [0.9, -0.9])
def test_a_top_is_drawn_towards_its_centre_of_mass(height, tmp_path, monkeypatch):
    body = kr.Body.symmetric(1.0, 1.1, 0.5, height)
    path = kr.solve(kr.Scene(body, attitude=(0.8, 0.6, 0, 0), momentum=(0, 0, 3), gravity=1), 1.0)
    film = path.animate(fps=1, size=16)
    _, attitudes = rotate_to_side(path, film.t)
    for frame, attitude in zip(record_frames(film, tmp_path, monkeypatch), attitudes, strict=True):
        middle = frame.faces.mean(axis=(0, 1))
        assert middle @ project(np.sign(height) * attitude[:, 2]) > 0.0


IMPOSSIBLE = {
    "moments too small": kr.Body(1.0, (1.0, 1.0, 0.1), (0, 0, 1), unphysical=True),
    "plate": kr.Body(1.0, (0.5, 0.5, 1.0), (0, 0, 0)),
    "wheel": kr.Body.disk(0.1, (0, 0, -0.15), mass=0.5),
}


@pytest.mark.parametrize("body", IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_any_body_is_drawn_within_the_sphere(body, tmp_path, monkeypatch):
    scene = kr.Scene(body, momentum=(0.1, 0.2, 0.3), gravity=1)
    frames = record_frames(kr.solve(scene, 1.0).animate(fps=1, size=16), tmp_path, monkeypatch)
    for frame in frames:
        size = np.hypot(*frame.faces.reshape(-1, 2).T).max()
        assert 0.2 < size < 0.8 + 1e-9


@pytest.mark.parametrize("end, is_joined", [(5.0, True), (1e5, False)])
def test_points_of_the_trace_are_joined_only_within_a_turn(end, is_joined, tmp_path, monkeypatch):
    film = kr.solve(TOP, [0.0, end]).animate(speed=end, fps=3, size=16)
    frame = record_frames(film, tmp_path, monkeypatch)[-1]
    steps = np.abs(np.diff(frame.trace[:, 0]))
    assert frame.is_joined == is_joined == (steps.max() < 0.3)


def test_the_displayed_time_has_a_unit(tmp_path, monkeypatch):
    film = PATH.animate(speed=255, fps=1, size=16, time_unit="s")
    assert [frame.clock for frame in record_frames(film, tmp_path, monkeypatch)] == [
        *("t = 0 s", "t = 255 s")
    ]


# Speed


@pytest.mark.parametrize("speed, fps, frames", [(2.0, 3, 7), (100.0, 1, 2), (1.6, 1, 4)])
def test_a_film_has_a_frame_at_each_tick(speed, fps, frames):
    film = kr.solve(TOP, [1.0, 5.0]).animate(speed=speed, fps=fps, size=16)
    assert len(film) == frames and film.fps == fps
    assert film.t == pytest.approx(np.linspace(1.0, 5.0, frames))
    assert repr(film) == f"<Film: {frames} frames, {fps} a second, t = 1 .. 5>"


def test_the_default_speed_shows_the_path_in_8_seconds():
    film = CUSPS.animate(fps=10)
    assert len(film) == 81 and film.t[-1] == 6


def test_a_film_runs_in_the_direction_of_its_path():
    back = kr.solve(GENERAL, [-1.0, -4.0]).animate(fps=1, size=16)
    assert back.t == pytest.approx(np.linspace(-1, -4, 9), abs=1e-15)
    film = kr.exact(kr.scenes.cusps)([1.0, 5.0]).animate(fps=1, size=16)
    assert film.t == pytest.approx(np.linspace(1, 5, 9), abs=1e-15)


@pytest.mark.parametrize(("fps", "pause"), [(100, 20), (30, 30), (7, 140), (5, 200), (1, 1000)])
def test_a_gif_pauses_in_hundredths_of_a_second(tmp_path, fps, pause):
    PATH.animate(tmp_path / "top.gif", speed=255 * fps / 2, fps=fps, size=16)
    with Image.open(tmp_path / "top.gif") as image:
        assert image.n_frames == 3 and image.info["duration"] == pause and image.info["loop"] == 0


def test_mp4_films_receive_every_frame_at_the_requested_rate(tmp_path):
    """Check the arguments and the raw frames that an executable in place of ffmpeg receives."""
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\nfor file; do :; done\n{ echo "$@"; cat; } > "$file"\n')
    program.chmod(0o755)
    with rc_context({"animation.ffmpeg_path": str(program)}):
        LEANING.animate(tmp_path / "top.mp4", speed=2, fps=3, size=16)
    words, frames = (tmp_path / "top.mp4").read_bytes().split(b"\n", 1)
    assert re.search(rb"-(r|framerate) 3 ", words) and b"16x16" in words
    assert len(frames) == 4 * 16 * 16 * 4


def test_mp4_films_need_ffmpeg(tmp_path):
    file = tmp_path / "top.mp4"
    if FFMpegWriter.isAvailable():
        CUSPS.animate(file, fps=5, size=101)
        assert b"ftyp" in file.read_bytes()[:16]
    else:
        with pytest.raises(OSError, match="needs ffmpeg"):
            CUSPS.animate(file)


# Files


def images_of(file):
    with Image.open(file) as film:
        for i in range(film.n_frames):
            film.seek(i)
            yield np.asarray(film.convert("RGB")).astype(int)


def test_gif_and_html_films_show_the_same_frames(tmp_path):
    """Check that the few colours of a GIF are those of the film, and that every frame differs."""
    film = LEANING.animate(tmp_path / "top.gif", fps=1, size=100)
    film.save(tmp_path / "top.html")
    text = (tmp_path / "top.html").read_text()
    codes = re.findall(r'data:image/png;base64,([^"]+)"', text)
    assert len(codes) == len(film) == 9 and text.startswith("<!doctype html>\n<html>")
    pngs = [Image.open(io.BytesIO(base64.b64decode(code.replace("\\", "")))) for code in codes]
    gifs = list(images_of(tmp_path / "top.gif"))
    for gif, png in zip(gifs, pngs, strict=True):
        pixels = np.asarray(png.convert("RGB")).astype(int)
        assert gif.shape == (100, 100, 3) and (gif[0, 0] == 255).all()
        difference = np.abs(gif - pixels)
        assert difference.mean() < 2.0 and difference.max() < 128
    assert all((one != other).any() for one, other in itertools.pairwise(gifs))


@pytest.mark.parametrize("scene", [GENERAL, TOP])
def test_uneven_times_are_resampled_evenly(scene, tmp_path):
    times = {"uneven": [0.0, 0.01, 0.02, 1.5, 4.0], "even": np.linspace(0, 4, 41)}
    for name, t in times.items():
        kr.solve(scene, t, method="taylor").animate(tmp_path / f"{name}.gif", fps=1, size=50)
    assert (tmp_path / "uneven.gif").read_bytes() == (tmp_path / "even.gif").read_bytes()


@pytest.mark.parametrize("name", ["top.gif", "top.html"])
@pytest.mark.parametrize("old", [None, b"an older film"])
def test_ctrl_c_leaves_the_old_file(name, old, tmp_path, monkeypatch):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    file = tmp_path / name
    if old:
        file.write_bytes(old)
    draw, frames = Figure.savefig, []

    def stop(figure, *args, **words):
        frames.append(1)
        if len(frames) == 3:
            raise KeyboardInterrupt
        return draw(figure, *args, **words)

    monkeypatch.setattr(Figure, "savefig", stop)
    with pytest.raises(KeyboardInterrupt):
        CUSPS.animate(file, fps=1, size=50)
    assert len(frames) == 3 and list(scratch.iterdir()) == []
    assert file.read_bytes() == old if old else not file.exists()
    assert len(list(tmp_path.iterdir())) == (2 if old else 1)


# Refusals


@pytest.mark.parametrize(
    ("words", "error", "word"),
    [
        ({"file": "top.avi"}, ValueError, "must end in one of .gif, .mp4, .html"),
        ({"file": "nowhere/top.gif"}, FileNotFoundError, "there is no folder"),
        ({"speed": 0}, ValueError, "speed must be positive"),
        ({"speed": "fast"}, TypeError, "speed must be a number"),
        ({"speed": 1e-4}, ValueError, "too many: 1165"),
        ({"speed": 1e-300}, ValueError, "too many: 1165"),
        ({"fps": 0}, ValueError, "fps must be at least 1"),
        ({"fps": 2.5}, TypeError, "fps must be a whole number"),
        ({"size": 15}, ValueError, "size must be at least 16"),
        ({"size": 20000}, ValueError, "size must be at most 11585"),
        ({"time_unit": 1}, TypeError, "time_unit must be"),
    ],
)
def test_invalid_arguments_are_refused_before_anything_is_drawn(words, error, word, monkeypatch):
    monkeypatch.setattr(Figure, "savefig", None)
    with pytest.raises(error, match=word):
        CUSPS.animate(**words)


@pytest.mark.parametrize("t", [[], [1.0], [2.0, 2.0]])
def test_a_film_needs_a_positive_duration(t):
    with pytest.raises(ValueError, match="positive duration"):
        kr.solve(GENERAL, t).animate()
