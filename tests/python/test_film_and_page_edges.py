"""Films and pages on the edge of what they can be: the most points, the shortest pause."""

import os
import sys
import tempfile
import warnings
import webbrowser
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from inside import view

pytest.importorskip("matplotlib")
from kreisel._drawing import film as made
from PIL import Image

TOP = kr.scenes.thesis
PATH = kr.solve(TOP, [0.0, 255.0])


def test_a_film_has_at_most_so_many_points():
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
        assert 100 < len(first) <= 128


def test_a_gif_shows_the_colours_of_its_film(tmp_path):
    film = PATH.animate(tmp_path / "top.gif", speed=255, fps=1, size=200)
    drawn = np.asarray(next(made._images(film)).convert("RGB")).astype(int)
    with Image.open(tmp_path / "top.gif") as image:
        shown = np.asarray(image.convert("RGB")).astype(int)
    assert np.abs(shown - drawn).max() <= 80 and np.abs(shown - drawn).mean() < 0.5


def test_a_page_of_a_film_plays_as_many_frames_a_second():
    assert "new Animation(frames, img_id, slider_id, 250," in (
        PATH.animate(speed=255, fps=4, size=16)._repr_html_()
    )


@pytest.mark.parametrize("endings", [("TOP.GIF", b"GIF"), ("Top.Html", b"<!doctype html>\n<html>")])
def test_endings_of_films_may_be_in_capitals(tmp_path, endings):
    name, begin = endings
    PATH.animate(tmp_path / name, speed=255, fps=1, size=16)
    assert (tmp_path / name).read_bytes().startswith(begin)


@pytest.mark.parametrize(
    ("t", "plays"),
    [
        ([0, 0.1 + 5e-9, 0.2], True),
        ([0, 0.1 + 2e-8, 0.2], False),
        ([0, 0.1 - 2e-8, 0.2], False),
        ([0, 1.0], True),
        ([0, 1e-6, 2e-6], True),
        ([0, 0.5e-6, 1e-6], False),
        ([0, -0.1], False),
    ],
)
def test_a_page_plays_even_times_to_a_hundredth_of_a_tick(t, plays):
    path = kr.solve(TOP, np.array(t, dtype=float), method="taylor")
    if plays:
        track = view.view(path, open=False).scene["tracks"][0]
        assert track["step"] == round(t[-1] / (len(t) - 1), 9) and track["name"] == "taylor"
        return
    with pytest.raises(ValueError, match="the page plays states at equal intervals"):
        view.view(path, open=False)


@pytest.mark.parametrize("n", [1, 3])
def test_a_page_shows_up_to_three_methods(n):
    names = ["strang", "rk4", "taylor"][:n]
    assert view.view(TOP, methods=names, open=False).scene["methods"] == names


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A home of its own, a page, and no browser."""
    monkeypatch.setattr(view, "_PAGE", tmp_path / "viewer.html")
    (tmp_path / "viewer.html").write_text(
        2 * '<script type="application/json" id="scene">null</script>', encoding="utf-8"
    )
    monkeypatch.setattr(webbrowser, "open", lambda _: False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


def test_a_page_without_a_browser_is_told_of_where_it_was_asked_for(home):
    page = view.view(TOP, open=False)
    with pytest.warns(UserWarning, match="no browser was found") as told:
        file = page.open()
    assert file == home / ".cache/kreisel/thesis.html" and told[0].filename == __file__
    text = file.read_text()
    assert text.count("null</script>") == 1 and text.endswith("null</script>")
    assert page._repr_html_().startswith('<iframe srcdoc="&lt;script')
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert view.view(TOP.replace(gravity=0.3), open=False).open().name == "top.html"
        again = view.view(TOP, open=False).open()
    assert again == file and sorted(each.name for each in file.parent.iterdir()) == [
        "thesis.html",
        "top.html",
    ]


def test_text_of_a_scene_does_not_end_the_script(home):
    page = view.View({**view.view(TOP, open=False).scene, "name": "</script>"})
    assert page.html.count("</script>") == 2 and "\\u003c/script>" in page.html


@pytest.mark.parametrize(
    ("system", "words", "place"),
    [
        ("linux", {"XDG_CACHE_HOME": "{}/cache"}, "cache/kreisel"),
        ("linux", {"LOCALAPPDATA": "{}/local"}, ".cache/kreisel"),
        ("darwin", {"XDG_CACHE_HOME": "{}/cache"}, "Library/Caches/kreisel"),
        ("win32", {"LOCALAPPDATA": "{}/local"}, "local/kreisel"),
        ("win32", {}, "kreisel"),
    ],
)
def test_pages_stand_where_the_system_keeps_what_can_be_made_again(
    home, monkeypatch, system, words, place
):
    for name, value in words.items():
        monkeypatch.setenv(name, value.format(home))
    monkeypatch.setattr(sys, "platform", system)
    found = view._folder()
    monkeypatch.setattr(sys, "platform", "linux")
    assert found == home / place and found.is_dir()


def test_pages_stand_in_a_temporary_folder_where_there_is_no_other(home, monkeypatch):
    (home / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / "file"))
    monkeypatch.setattr(tempfile, "tempdir", str(home))
    found = view._folder()
    assert found.parent == home and found.name.startswith("kreisel-") and found.is_dir()


def test_an_installation_without_a_page_says_so(home):
    os.unlink(home / "viewer.html")
    with pytest.raises(
        FileNotFoundError, match=r"without its page, .*viewer\.html: run `make page`"
    ):
        view.view(TOP, open=False).html  # noqa: B018  a look at it is what is refused
    assert not Path(home / ".cache").exists()
