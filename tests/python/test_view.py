"""Tests of the arguments, time steps and files of kreisel.view, without a browser."""

import base64
import hashlib
import os
import re
import sys
import tempfile
import types
import warnings
import webbrowser
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from internals import view

TOP = kr.scenes.thesis


def test_the_viewer_may_run_only_its_own_script():
    """Check that the viewer's security policy forbids external scripts and network requests."""
    page = kr.view(TOP, open=False).html
    (content,) = re.findall(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page)
    policy = dict(part.split(" ", 1) for part in content.split("; "))
    assert policy["default-src"] == policy["form-action"] == policy["base-uri"] == "'none'"
    assert not {"connect-src", "frame-src", "object-src"} & set(policy)
    (script,) = re.findall(r'<script type="module">(.*?)</script>', page, re.DOTALL)
    own = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy["script-src"] == f"'sha256-{own}' 'wasm-unsafe-eval'"
    assert "unsafe" not in policy["style-src-elem"]


@pytest.mark.parametrize("step", [0.5e-6, 0.99e-6, 2148.0, 1.5e-6, 0.0100005])
def test_steps_other_than_whole_millionths_are_refused(step):
    with pytest.raises(ValueError, match="whole millionths"):
        kr.view(TOP, step=step, open=False)


@pytest.mark.parametrize("step", [1e-6, 2147.0, 0.3, 2e-6])
def test_steps_of_whole_millionths_are_accepted(step):
    assert kr.view(TOP, step=step, open=False).scene["step"] == [step]


@pytest.mark.parametrize("name", ["auto", "gsl_rk8pd"])
def test_methods_missing_in_the_viewer_are_refused(name):
    if name not in ("auto", *kr.methods):
        pytest.skip("needs GSL")
    with pytest.raises(ValueError, match=f"the viewer has no '{name}'"):
        kr.view(TOP, methods=name, open=False)


def test_zero_and_four_methods_are_refused():
    for names in ([], ["strang"] * 4):
        with pytest.raises(ValueError, match="one to three methods"):
            kr.view(TOP, methods=names, open=False)


def test_defaults_depend_on_the_scene():
    assert kr.view(TOP, open=False).scene["methods"] == ["bobenko_suris"]
    general = kr.view(kr.scenes.asymmetric, open=False).scene
    assert (general["methods"], general["step"], general["speed"]) == (["strang"], [0.01], 1.0)
    assert general["version"] == 1 and general["tracks"] == []
    assert general["name"] == "asymmetric" and general["about"]
    unnamed = kr.view(TOP.replace(gravity=0.3), open=False).scene
    assert unnamed["name"] == "a scene from Python" and unnamed["about"] == ""
    assert np.asarray(general["body"]["inertia"]).shape == (9,)


@pytest.mark.parametrize(
    ("path", "step"),
    [
        (kr.solve(TOP, 1.0, "rk4", step=0.02, every=10), 0.02),
        (kr.solve(TOP, np.arange(5) * 0.25), 0.25),  # because the closed form has no step
        # a step that is too short for the viewer
        (kr.solve(TOP, np.arange(5) * 0.25, "rk4", step=2.5e-7), 0.25),
    ],
)
def test_the_step_of_a_path_is_used(path, step):
    scene = kr.view(path, open=False).scene
    assert scene["step"] == [step]
    assert scene["tracks"][0]["step"] == pytest.approx(float(path.t[1]), rel=1e-12)


@pytest.mark.parametrize("times", [[], [0.0], [0.0, 0.1, 0.3], [0.1, 0.2], [0.0, 0.1, 0.2 + 2e-7]])
def test_a_path_that_cannot_be_played_is_refused(times):
    with pytest.raises(ValueError, match="equal intervals"):
        kr.view(kr.solve(TOP, times), open=False)


@pytest.mark.parametrize(
    ("words", "tol"),
    [
        ({}, 1e-5),
        ({"damping": 0.1}, 1e-15),
        ({"friction": 0.1}, 1e-15),
        ({"turning": (0, 0, 1)}, 1e-15),
    ],
)
def test_disturbed_tops_are_integrated_with_a_small_tolerance(words, tol):
    scene = kr.view(TOP.replace(**words), open=False).scene
    assert scene["tol"] == tol and scene["methods"] == (["taylor"] if words else ["bobenko_suris"])
    assert scene["damping"] == words.get("damping", 0.0) and scene["speed"] == 1.0


def test_the_data_of_a_viewer_are_those_of_its_scene():
    body = kr.Body(2.0, (1.0, 1.5, 2.0), (0.1, 0.2, 0.3), rotor=(0.0, 0.0, 0.5))
    top = kr.Scene(body, momentum=(1, 2, 3), attitude=(0.6, 0.8, 0, 0), gravity=-2.0)
    scene = kr.view(top, speed=2.5, step=0.5, open=False).scene
    assert scene["body"]["inertia"] == [1.0, 0, 0, 0, 1.5, 0, 0, 0, 2.0]
    assert (scene["body"]["mass"], scene["body"]["com"]) == (2.0, (0.1, 0.2, 0.3))
    assert (scene["momentum"], scene["attitude"]) == ((1, 2, 3), (0.6, 0.8, 0, 0))
    assert (scene["gravity"], scene["speed"], scene["step"]) == (-2.0, 2.5, [0.5])
    assert scene["rotor"] == (0.0, 0.0, 0.5) and scene["methods"] == ["taylor"]
    tilted = kr.Body(1.0, [[2.0, 0.1, 0.2], [0.1, 2.5, 0.3], [0.2, 0.3, 3.0]], (0, 0, 0.1))
    inertia = kr.view(kr.Scene(tilted, momentum=(1, 2, 3), gravity=1), open=False).scene["body"][
        "inertia"
    ]
    assert inertia == pytest.approx([2.0, 0.1, 0.2, 0.1, 2.5, 0.3, 0.2, 0.3, 3.0])


def test_the_states_of_a_path_are_part_of_its_viewer():
    path = kr.solve(TOP, np.arange(4) * 0.25)
    track = kr.view(path, open=False).scene["tracks"][0]
    assert np.frombuffer(base64.b64decode(track["states"])).tolist() == path.states.ravel().tolist()
    assert (track["name"], track["step"]) == (path.method, 0.25)


@pytest.mark.parametrize(
    ("step", "is_whole"),
    [
        (0.5e-6, False),
        (1e-6, True),
        (1.0000005e-6, True),
        (1.000002e-6, False),
        (7.00001e-6, False),
        (2147.483647, True),
        (2**31 * 1e-6, False),
        (2**32 * 1e-6, False),
        (0.0, False),
        (-1e-6, False),
    ],
)
def test_a_step_of_the_viewer_is_a_whole_number_of_millionths(step, is_whole):
    assert view._is_whole_millionths(step) is is_whole


@pytest.fixture
def browser_addresses(tmp_path, monkeypatch):
    """Replace the browser and the cache folder, and return the addresses that are opened."""
    addresses = []
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(webbrowser, "open", lambda address: addresses.append(address) or True)
    return addresses


def test_a_page_opens_in_a_browser(browser_addresses, tmp_path):
    kr.view(TOP)
    (page,) = tmp_path.glob("kreisel/*.html")
    assert browser_addresses == [page.as_uri()] and browser_addresses[0].startswith("file:///")


class ZMQInteractiveShell:
    pass


class TerminalInteractiveShell:
    pass


@pytest.mark.parametrize(
    ("shell", "pages"), [(ZMQInteractiveShell(), 0), (TerminalInteractiveShell(), 1), (None, 1)]
)
def test_a_notebook_embeds_the_viewer(browser_addresses, monkeypatch, shell, pages):
    module = types.SimpleNamespace(get_ipython=lambda: shell)
    monkeypatch.setitem(sys.modules, "IPython", module)
    kr.view(TOP)
    assert len(browser_addresses) == pages


# Boundary values


@pytest.fixture
def empty_home(tmp_path, monkeypatch):
    """Replace the home directory, the viewer and the browser by test doubles."""
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
def test_the_viewer_plays_times_with_even_spacing(t, plays):
    path = kr.solve(TOP, np.array(t, dtype=float), method="taylor")
    if plays:
        track = view.view(path, open=False).scene["tracks"][0]
        assert track["step"] == round(t[-1] / (len(t) - 1), 9) and track["name"] == "taylor"
        return
    with pytest.raises(ValueError, match="the viewer plays states at equal intervals"):
        view.view(path, open=False)


@pytest.mark.parametrize("n", [1, 3])
def test_a_page_shows_up_to_three_methods(n):
    names = ["strang", "rk4", "taylor"][:n]
    assert view.view(TOP, methods=names, open=False).scene["methods"] == names


def test_without_a_browser_the_warning_names_the_calling_line(empty_home):
    page = view.view(TOP, open=False)
    with pytest.warns(UserWarning, match="no browser was found") as caught_warnings:
        file = page.open()
    assert (
        file == empty_home / ".cache/kreisel/thesis.html"
        and caught_warnings[0].filename == __file__
    )
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


def test_text_in_a_scene_cannot_end_the_script(empty_home):
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
def test_viewers_are_saved_in_the_cache_folder_of_the_system(
    empty_home, monkeypatch, system, words, place
):
    for name, value in words.items():
        monkeypatch.setenv(name, value.format(empty_home))
    monkeypatch.setattr(sys, "platform", system)
    folder = view._create_viewer_folder()
    monkeypatch.setattr(sys, "platform", "linux")
    assert folder == empty_home / place and folder.is_dir()


def test_viewers_are_saved_in_a_temporary_folder_without_a_cache_folder(empty_home, monkeypatch):
    (empty_home / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(empty_home / "file"))
    monkeypatch.setattr(tempfile, "tempdir", str(empty_home))
    folder = view._create_viewer_folder()
    assert folder.parent == empty_home and folder.name.startswith("kreisel-") and folder.is_dir()


def test_an_installation_without_viewer_raises_an_error(empty_home):
    os.unlink(empty_home / "viewer.html")
    with pytest.raises(
        FileNotFoundError, match=r"without its viewer, .*viewer\.html: run `make viewer`"
    ):
        view.view(TOP, open=False).html  # noqa: B018  reading the attribute raises
    assert not Path(empty_home / ".cache").exists()
