"""Tests of GIF and HTML animations of paths."""

import contextlib
import errno
import os
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest

pytest.importorskip("matplotlib")
from cli_helpers import make_raiser
from kreisel._plot import film as made
from kreisel._plot import stage
from matplotlib import rcParams
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

TOP = kr.scenes.thesis
PATH = kr.solve(TOP, [0.0, 255.0])


def test_a_film_can_be_saved(tmp_path):
    film = kr.solve(kr.scenes.asymmetric, 0.5).animate(speed=0.5, fps=2, size=32)
    film.save(tmp_path / "top.gif")
    assert (tmp_path / "top.gif").read_bytes().startswith(b"GIF89a")
    with pytest.raises(ValueError, match="file must end in one of"):
        film.save(tmp_path / "top.txt")


def test_an_unwritable_file_is_refused_before_anything_runs(tmp_path, monkeypatch):
    film = kr.solve(kr.scenes.asymmetric, 0.5).animate(speed=0.5, fps=2, size=32)
    with monkeypatch.context() as patch:
        patch.setattr(os, "open", make_raiser(PermissionError(errno.EACCES, "Permission denied")))
        with pytest.raises(PermissionError, match=r"top\.gif cannot be written: Permission denied"):
            film.save(tmp_path / "top.gif")
    assert os.listdir(tmp_path) == []


def test_the_total_size_of_a_film_is_limited():
    assert len(PATH.animate(speed=1, fps=1, size=1024)) == 256
    with pytest.raises(ValueError, match=r"^257 frames of 1024 x 1024 .*: 256 are .* = 1\.26,"):
        kr.solve(TOP, [0.0, 320.0]).animate(speed=1.25, fps=1, size=1024)
    assert len(kr.solve(TOP, [0.0, 320.0]).animate(speed=1.26, fps=1, size=1024)) == 255
    with pytest.raises(ValueError, match=r"^512 frames .*: 256 are possible, with speed = 2,"):
        kr.solve(TOP, [0.0, 510.0]).animate(speed=2 * 510 / 1022, fps=1, size=1024)
    with pytest.raises(ValueError, match=r"^1e\+300 frames .*: 256 are possible, with speed = "):
        PATH.animate(speed=PATH.t[-1] / 1e300, fps=1, size=1024)
    with pytest.raises(ValueError, match=r"too many: the size must be at most 11585$"):
        PATH.animate(speed=100, fps=3, size=20000)
    assert len(PATH.animate(speed=1e300, fps=3, size=11585)) == 2


@pytest.mark.parametrize(("fps", "pause"), [(100, 20), (30, 30), (7, 140), (1, 1000)])
def test_a_gif_pauses_in_hundredths_of_a_second(tmp_path, fps, pause):
    PATH.animate(tmp_path / "top.gif", speed=255 * fps / 2, fps=fps, size=16)
    with Image.open(tmp_path / "top.gif") as image:
        assert image.n_frames == 3 and image.info["duration"] == pause


def test_a_gif_has_at_most_128_colours(tmp_path):
    PATH.animate(tmp_path / "top.gif", speed=255, fps=1, size=200)
    with Image.open(tmp_path / "top.gif") as image:
        first = image.convert("RGB").getcolors()
        assert 50 < len(first) <= 128


def test_a_gif_shows_the_colours_of_its_film(tmp_path):
    film = PATH.animate(tmp_path / "top.gif", speed=255, fps=1, size=200)
    frame = np.asarray(next(made._render_film_images(film)).convert("RGB")).astype(int)
    with Image.open(tmp_path / "top.gif") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert np.abs(pixels - frame).max() <= 80 and np.abs(pixels - frame).mean() < 0.5


def test_an_html_film_has_the_requested_frame_rate():
    assert "new Animation(frames, img_id, slider_id, 250," in (
        PATH.animate(speed=255, fps=4, size=16)._repr_html_()
    )


@pytest.mark.parametrize("endings", [("TOP.GIF", b"GIF"), ("Top.Html", b"<!doctype html>\n<html>")])
def test_suffixes_of_films_may_be_upper_case(tmp_path, endings):
    name, begin = endings
    PATH.animate(tmp_path / name, speed=255, fps=1, size=16)
    assert (tmp_path / name).read_bytes().startswith(begin)


@pytest.mark.parametrize(
    ("scene", "low", "high"),
    [(kr.scenes.sleeping, 0.0, 0.0), (kr.scenes.steady_precession, -0.2, -0.1), (TOP, -1.0, -0.9)],
)
def test_the_floor_is_below_the_body_and_its_trace(scene, low, high):
    film = kr.solve(scene, 10.0).animate(fps=2, size=16)
    quads, _, _ = made._build_body_faces(film._body)
    floor = made._find_floor_height(quads, film._q, film._apex)
    assert low <= floor <= high
    assert film._apex[:, 2].min() >= floor - 1e-12
    for q in film._q:
        corners = quads @ made._rotation_matrix(q).T
        assert corners[..., 2].min() >= floor - made._LEVEL


def test_a_shadow_is_the_body_projected_onto_the_floor():
    axes = Figure().add_subplot()
    plate = np.array([[(-1, -1, 0.5), (1, -1, 0.5), (1, 1, 0.5), (-1, 1, 0.5)]]) * (0.1, 0.1, 1.0)
    shadow = stage.draw_body_shadow(axes, plate, -0.5)
    assert len(shadow.get_paths()) == stage._POINTS
    sides = []
    for path in shadow.get_paths():
        x, up = path.vertices[:4].T
        depth = (up + 0.5 * np.cos(np.radians(20.0))) / np.sin(np.radians(20.0))
        assert np.ptp(x) == pytest.approx(0.2) and np.ptp(depth) == pytest.approx(0.2)
        sides.append((x.mean(), depth.mean()))
    assert np.mean(sides, axis=0) == pytest.approx(-stage._LAMP, abs=0.02)
    assert np.ptp(sides, axis=0).max() > 0.02, "of a wide lamp"
    opacity = shadow.get_facecolors()[0, 3]
    assert 1 - (1 - opacity) ** stage._POINTS == pytest.approx(0.3)


def test_the_displayed_time_of_a_film_has_a_unit():
    for words, end in ({}, "t = 0"), ({"time_unit": "s"}, "t = 0 s"):
        figure = next(PATH.animate(fps=1, size=16, **words)._draw_frames())
        assert figure.axes[0].texts[-1].get_text() == end
    with pytest.raises(TypeError, match="time_unit must be the name of a unit"):
        PATH.animate(time_unit=1)


@pytest.mark.parametrize("floor, circles", [(-0.5, 1), (-1.0, 0), (-1.5, 0)])
def test_a_floor_below_the_sphere_does_not_cut_it(floor, circles):
    axes = Figure().add_subplot()
    stage._draw_part_of_sphere_above_floor(axes, floor)
    outline, *rims = axes.lines
    assert len(rims) == circles
    assert np.isfinite(outline.get_ydata()).all() == (circles == 0)


# Geometry of the frames

E20 = np.radians(20.0)
BLOCK = kr.Body.cuboid((0.1, 0.2, 0.3), pivot=(0.5, 0, -0.4))
LEANING = kr.solve(
    kr.Scene(BLOCK, attitude=(0.8, 0.6, 0, 0), momentum=(0, 0.02, 0.1), gravity=1), 2.0
)


def rotate(angle, axis):
    """Return the unit quaternion and the matrix of a rotation, by the formula of Rodrigues."""
    n = np.array(axis) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), n)  # the matrix of the map v -> n x v
    matrix = (
        np.cos(angle) * np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * np.outer(n, n)
    )
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * n)]), matrix


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, -2, 3), (-0.3, 0.5, 0.1)])
@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5])
def test_the_matrix_of_a_quaternion_is_its_rotation(angle, axis):
    q, matrix = rotate(angle, axis)
    assert made._rotation_matrix(q) == pytest.approx(matrix, abs=1e-14)


@pytest.mark.parametrize("path", [LEANING, kr.solve(kr.scenes.asymmetric, 2.0)])
def test_each_frame_shows_its_state(path):
    """Check the positions and drawing order of all moving parts in each frame of an animation."""
    film = path.animate(speed=0.5, fps=1, size=50)
    quads, _, edge = made._build_body_faces(path.scene.body)
    x, y, z = film._apex.T
    up, depth = z * np.cos(E20) + y * np.sin(E20), z * np.sin(E20) - y * np.cos(E20)
    heights = quads @ made._rotation_matrix(film._q[0]).T @ film._apex[0]
    begin, end = max(heights.min(), 0.0), heights.max()
    between = (len(x) - 1) // 4
    assert len(film) == 5 and len(x) == 4 * between + 1
    for i, figure in enumerate(film._draw_frames()):
        axes, k, points = figure.axes[0], between * i, np.stack([x, up], -1)
        back, front, needle, tip, lever = axes.lines[-5:]
        for line, is_shown in (back, depth <= 0.0), (front, depth > 0.0):
            assert line.get_xdata() == pytest.approx(x[: k + 1])
            shown = np.where(is_shown, up, np.nan)[: k + 1]
            assert line.get_ydata() == pytest.approx(shown, nan_ok=True)
        assert needle.get_xydata() == pytest.approx(np.stack([end * points[k], points[k]]))
        assert tip.get_xydata() == pytest.approx(points[k : k + 1])
        if begin > 0.0:
            assert lever.get_xydata() == pytest.approx(
                np.stack([0.0 * points[k], begin * points[k]])
            )
        else:
            assert not len(lever.get_xydata())
        is_near = depth[k] > 0.0
        assert needle.get_zorder() == tip.get_zorder() == (4.0 if is_near else 1.0)
        assert lever.get_zorder() == (1.7 if is_near else 2.5)
        zorders = [part.get_zorder() for part in axes.collections]
        assert zorders == [0.1, 2.0, 0.4], "the floor, the solid and its shadow"
        assert axes.texts[-1].get_text() == f"t = {film.t[i]:.4g}"
    assert edge == 0.8 and (begin > 0.0) == (path is LEANING)
    assert len(axes.collections) == 1, "the solid and its shadow are removed after each frame"


def test_an_apex_at_the_edge_of_the_sphere_belongs_to_the_far_side():
    apex = np.tile([1.0, 0.0, 0.0], (9, 1))
    q = np.array([[1.0, 0.0, 0.0, 0.0]] * 2)
    film = made.Film(BLOCK, np.arange(2.0), q, apex, 1, 50)
    back, front, needle, tip, lever = next(film._draw_frames()).axes[0].lines[-5:]
    assert back.get_ydata().tolist() == [0.0] and np.isnan(front.get_ydata()).all()
    assert (needle.get_zorder(), tip.get_zorder(), lever.get_zorder()) == (1.0, 1.0, 2.5)


def test_a_frame_fills_its_figure_in_thin_lines():
    figure = next(LEANING.animate(speed=1, fps=1, size=80)._draw_frames())
    assert figure.dpi == 100 and tuple(figure.get_size_inches()) == (0.8, 0.8)
    (axes,) = figure.axes
    assert axes.get_position().bounds == (0.0, 0.0, 1.0, 1.0) and not axes.axison
    assert axes.get_aspect() == 1.0 and axes.get_xlim() == (-1.08, 1.08)
    styles = [
        (line.get_color(), line.get_linewidth(), line.get_alpha()) for line in axes.lines[-5:]
    ]
    red, width = "#c73237", rcParams["lines.linewidth"]
    assert styles == [
        *((red, 0.7, 0.45), (red, 1.2, 0.85), (stage.STEEL, 2.0, None)),
        *((red, width, None), (stage.STEEL, 2.6, None)),
    ]
    assert axes.lines[-4].get_zorder() == 3
    assert (axes.lines[-2].get_marker(), axes.lines[-2].get_markersize()) == ("o", 4)
    clock = axes.texts[-1]
    assert clock.get_position() == (0.03, 0.03) and clock.get_fontsize() == 9
    assert clock.get_transform() == axes.transAxes


def test_the_extent_of_a_body_is_measured_along_its_apex():
    corners = np.array([[(3, 0, 0.5), (0, 4, 2.0)], [(1, 1, 1.0), (0, 0, 0.75)]])
    assert made._measure_extent_along_apex(corners, np.array([0.0, 0.0, 1.0])) == (0.5, 2.0)
    assert made._measure_extent_along_apex(corners, np.array([0.0, 1.0, 0.0])) == (0.0, 4.0)
    assert made._measure_extent_along_apex(corners, np.array([0.0, 0.0, -1.0])) == (0.0, -0.5)


@pytest.mark.parametrize(
    ("lowest", "apex", "floor"),
    [
        (-0.5, -0.7, -0.7),
        (-0.5, -0.2, -0.5),
        (-0.5, 0.2, -0.5),
        (-0.02, -0.7, 0.0),
        (-0.021, 0.5, -0.021),
        (0.3, -0.7, 0.0),
        (-1.5, -0.7, -1.0),
    ],
)
def test_the_floor_has_a_height(lowest, apex, floor):
    """Check the floor below a body that lies on its side in the second of two states."""
    quads = np.array([[(1, 2, 3), (0, 0, 4), (0, lowest, 5), (1, 3, 9)]], dtype=float)
    q = np.array([rotate(0.0, (1, 0, 0))[0], rotate(np.pi / 2, (1, 0, 0))[0]])
    trace = np.array([(0.0, 0.0, 1.0), (0.0, 0.0, apex)])
    assert made._find_floor_height(quads, q, trace) == pytest.approx(floor, abs=1e-12)
    upright = quads[..., [2, 0, 1]]
    assert made._find_floor_height(upright, q[:1], trace) == floor


@pytest.mark.parametrize(
    ("leans", "index"),
    [
        ([0.0, 0.1, 0.3, 0.5], 2),
        ([0.15, 0.19, 0.2, 0.5], 2),
        ([0.0, 0.05, 0.1, 0.05], 2),  # of small leans, the largest
        ([0.5, 0.9, 0.1, 0.0], 0),
    ],
)
def test_the_first_clear_lean_points_to_the_right(leans, index):
    azimuths = np.array([0.3, 1.9, -2.4, 2.9])
    height = np.sqrt(1.0 - np.array(leans) ** 2)
    apex = np.stack([leans * np.cos(azimuths), leans * np.sin(azimuths), height], axis=-1)
    q = np.array([rotate(0.5 + k, (1, 2 - k, 3))[0] for k in range(4)])
    new_q, new_apex = made._rotate_lean_to_side(q, apex)
    angle = np.radians(-30.0) - azimuths[index]
    _, turn = rotate(angle, (0, 0, 1))
    assert new_apex == pytest.approx(apex @ turn.T)
    right = leans[index] * np.array([np.cos(np.radians(30)), -0.5])
    assert new_apex[index, :2] == pytest.approx(right)
    for one, other in zip(q, new_q, strict=True):
        expected = turn @ made._rotation_matrix(one)
        assert made._rotation_matrix(other) == pytest.approx(expected)


def test_an_upright_top_is_not_rotated():
    q, apex = np.array([[0.6, 0.0, 0.0, 0.8]]), np.array([[0.0, 0.0, 1.0]])
    assert made._rotate_lean_to_side(q, apex) == (q, apex)


@pytest.mark.parametrize("scene", [LEANING.scene, TOP])
def test_the_faces_of_a_body_fit_into_the_sphere(scene):
    rotation = rotate(0.9, (1, 2, -1))[1]
    inertia = rotation @ np.diag(scene.body.moments) @ rotation.T
    com = rotation @ np.array(scene.body.principal_com)
    body = kr.Body(scene.body.mass, 0.5 * (inertia + inertia.T), com, unphysical=True)
    quads, colours, edge = made._build_body_faces(body)
    is_cuboid = scene is not TOP
    assert edge == (0.8 if is_cuboid else 0.0) and len(colours) == len(quads)
    assert np.linalg.norm(quads, axis=-1).max() == pytest.approx(0.8)
    if is_cuboid:
        middle = quads.mean(axis=(0, 1))
        assert middle / np.linalg.norm(middle) == pytest.approx(com / np.linalg.norm(com))


@pytest.mark.parametrize(
    "t, ends", [([1, 2, 3], (1, 3)), ([3, 2, 1], (3, 1)), ([-1, -4], (-1, -4))]
)
def test_a_film_runs_from_the_first_to_the_last_time(t, ends):
    assert made._get_first_and_last_time(np.array(t, float)) == ends


@pytest.mark.parametrize("speed, fps, frames", [(2.0, 3, 7), (100.0, 1, 2), (1.6, 1, 4)])
def test_a_film_has_a_frame_at_each_tick(speed, fps, frames):
    path = kr.solve(TOP, [1.0, 5.0])
    film = path.animate(speed=speed, fps=fps, size=16)
    assert len(film) == frames and film.t == pytest.approx(np.linspace(1.0, 5.0, frames))
    assert film._q.shape == (frames, 4)


@pytest.mark.parametrize("end, is_joined", [(5.0, True), (1e5, False)])
def test_a_film_joins_points_of_the_trace_only_within_a_turn(tmp_path, end, is_joined):
    film = kr.solve(TOP, [0.0, end]).animate(speed=end, fps=3, size=50)
    figures = [*film._draw_frames()]
    whole = figures[-1].axes[0].lines[-5:-3]
    assert {line.get_linestyle() for line in whole} == {"-" if is_joined else "None"}
    points = np.stack([whole[0].get_xdata(), film._apex[:, 2]], -1)
    assert len(film) == 4 and (np.abs(np.diff(points, axis=0)).max() < 0.3) == is_joined


# Encoders


def test_the_palette_of_a_gif_contains_the_colours_of_lines_and_text():
    image = Image.new("RGB", (32, 32), (255, 255, 255))
    for k, grey in enumerate((250, 247, 246, 100)):
        image.paste((grey,) * 3, (0, 4 * k + 4, 32, 4 * k + 8))
    colours = np.array(made._choose_gif_palette(image).getpalette()).reshape(-1, 3)
    strokes = [(c, part) for c in ("black", "#c73237", "#8c8c8c") for part in (1, 0.75, 0.5, 0.25)]
    strokes += [("#aab2bd", 1), ("#aab2bd", 0.5), ("#9a9389", 1), ("#f7ecd2", 1)]
    expected = [np.rint((1 - part) * 255 + part * 255 * np.array(to_rgb(c))) for c, part in strokes]
    assert np.array_equal(colours[-16:], expected)
    greys = set(colours[:-16, 0])
    assert {255, 246, 100} <= greys and not {250, 247} & greys
    noise = np.random.default_rng(1).integers(0, 200, (64, 64, 3), dtype=np.uint8)
    assert len(made._choose_gif_palette(Image.fromarray(noise)).getpalette()) == 3 * 128


class StubWriter:
    """A stand-in for the film writer, which writes only the number of frames."""

    def __init__(self, fps, embed_frames=None, codec=None):
        self.words = fps, embed_frames, codec
        self.limit = rcParams["animation.embed_limit"]
        self.frames, self.dpi = 0, None

    @contextlib.contextmanager
    def saving(self, figure, file, dpi):
        assert isinstance(figure, Figure)
        self.dpi, self.suffix = dpi, Path(file).suffix
        yield
        Path(file).write_text(f"{self.frames} frames")

    def grab_frame(self):
        self.frames += 1


@pytest.mark.parametrize(
    ("name", "suffix", "words"),
    [("HTMLWriter", ".html", (3, True, None)), ("FFMpegWriter", ".mp4", (3, None, "h264"))],
)
def test_writers_receive_every_frame(name, suffix, words, monkeypatch):
    writers = []
    monkeypatch.setattr(made, name, lambda **w: writers.append(StubWriter(**w)) or writers[-1])
    film = LEANING.animate(speed=2, fps=3, size=16)
    data = (made._encode_html if suffix == ".html" else made._encode_mp4)(film)
    (writer,) = writers
    assert data == b"4 frames" and len(film) == 4 and writer.words == words
    assert (writer.dpi, writer.suffix) == (100, suffix)
    assert writer.limit == (500.0 if suffix == ".html" else 20.0)
