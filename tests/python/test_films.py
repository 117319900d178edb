"""Tests of GIF and HTML animations of paths."""

import errno
import os

import kreisel as kr
import numpy as np
import pytest

pytest.importorskip("matplotlib")
from cli_helpers import make_raiser
from kreisel._plot import film as made
from kreisel._plot import stage
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
    with pytest.raises(ValueError, match=r"^257 frames of 1024 x 1024 .*: 256 are .* = 1\.25,"):
        kr.solve(TOP, [0.0, 320.0]).animate(speed=1.25, fps=1, size=1024)
    with pytest.raises(ValueError, match=r"^512 frames .*: 256 are possible, with speed = 2,"):
        kr.solve(TOP, [0.0, 510.0]).animate(speed=2 * 510 / 1022, fps=1, size=1024)
    with pytest.raises(ValueError, match=r": 2 are possible, with speed = 765, "):
        PATH.animate(speed=100, fps=3, size=20000)


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
