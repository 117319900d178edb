"""The data, files and pages of kreisel.view and `kreisel view`, without a browser."""

import base64
import hashlib
import html
import re
import sys
import types
import webbrowser
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, join_lines
from kreisel.types import View

TOP = kr.scenes.thesis
MOVED = {"shaking": (0.1, 2, 1)}, {"gradient": 0.1}


@pytest.fixture
def home(tmp_path, monkeypatch):
    """Replace the home directory, and the browser by a list of opened addresses."""
    addresses = []
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(webbrowser, "open", lambda address: addresses.append(address) or True)
    return types.SimpleNamespace(folder=tmp_path, addresses=addresses)


# The data


def test_defaults_depend_on_the_scene():
    assert kr.view(TOP, open=False).scene["methods"] == ["bobenko_suris"]
    general = kr.view(kr.scenes.asymmetric, open=False).scene
    assert (general["methods"], general["step"], general["speed"]) == (["strang"], [0.01], 1.0)
    assert general["version"] == 1 and general["tracks"] == []
    assert general["name"] == "asymmetric" and general["about"]
    for step in (1e-6, 2147.483647, 0.3, 1.0000005e-6):
        assert kr.view(TOP, step=step, open=False).scene["step"] == [round(step, 6)]
    unnamed = kr.view(TOP.replace(gravity=0.3), open=False).scene
    assert unnamed["name"] == "a scene from Python" and unnamed["about"] == ""
    for words in ({"damping": 0.1}, {"friction": 0.1}, {"turning": (0, 0, 1)}, *MOVED):
        scene = kr.view(TOP.replace(**words), open=False).scene
        assert scene["tol"] == 1e-15 and scene["methods"] == ["taylor"]
        assert all(scene[name] == value for name, value in words.items())


def test_the_data_of_a_viewer_are_those_of_its_scene():
    body = kr.Body(2.0, (1.0, 1.5, 2.0), (0.1, 0.2, 0.3), rotor=(0.0, 0.0, 0.5))
    top = kr.Scene(body, momentum=(1, 2, 3), attitude=(0.6, 0.8, 0, 0), gravity=-2.0)
    scene = kr.view(top, speed=2.5, step=0.5, open=False).scene
    assert scene["body"]["inertia"] == [1.0, 0, 0, 0, 1.5, 0, 0, 0, 2.0]
    assert (scene["body"]["mass"], scene["body"]["com"]) == (2.0, (0.1, 0.2, 0.3))
    assert (scene["momentum"], scene["attitude"]) == ((1, 2, 3), (0.6, 0.8, 0, 0))
    assert (scene["gravity"], scene["speed"], scene["step"]) == (-2.0, 2.5, [0.5])
    assert scene["rotor"] == (0.0, 0.0, 0.5) and scene["methods"] == ["taylor"]
    rows = [[2.0, 0.1, 0.2], [0.1, 2.5, 0.3], [0.2, 0.3, 3.0]]
    tilted = kr.Scene(kr.Body(1.0, rows, (0, 0, 0.1)), momentum=(1, 2, 3), gravity=1)
    inertia = kr.view(tilted, open=False).scene["body"]["inertia"]
    assert inertia == pytest.approx(np.ravel(rows).tolist())


@pytest.mark.parametrize(
    ("words", "step"),
    [
        ({"t": 1.0, "method": "rk4", "step": 0.02, "every": 10}, 0.02),
        ({"t": np.arange(5) * 0.25}, 0.25),  # because the closed form has no step
        # a step that is too short for the viewer
        ({"t": np.arange(5) * 0.25, "method": "rk4", "step": 2.5e-7}, 0.25),
        ({"t": [0, 0.1 + 5e-9, 0.2], "method": "taylor"}, 0.1),
        ({"t": [0, 1e-6, 2e-6], "method": "taylor"}, 1e-6),
    ],
)
def test_a_path_plays_with_its_states_and_its_step(words, step):
    path = kr.solve(TOP, **words)
    scene = kr.view(path, open=False).scene
    [track] = scene["tracks"]
    assert scene["step"] == [step] and track["name"] == path.method
    assert track["step"] == pytest.approx(float(path.t[1]), abs=1e-8)
    assert np.frombuffer(base64.b64decode(track["states"])).tolist() == path.states.ravel().tolist()


REFUSALS = [  # (what, arguments, exception, a word of the message)
    *((TOP, {"step": step}, "whole millionths") for step in (0.5e-6, 2148.0, 1.5e-6, 0.0100005)),
    (TOP, {"step": 1.000002e-6}, "whole millionths"),
    (TOP, {"step": 0.0}, "step"),
    (TOP, {"speed": -1.0}, "speed"),
    (TOP, {"methods": "auto"}, "has no 'auto'"),
    (TOP, {"methods": []}, "one to three methods"),
    (TOP, {"methods": ["strang"] * 4}, "one to three methods"),
    (TOP.replace(damping=(0.1, 0.2, 0.1)), {}, "one damping"),
    *(
        (kr.solve(TOP, t, "taylor"), {}, "equal intervals")
        for t in (
            [],
            [0.0],
            [0, 0.1, 0.3],
            [0.1, 0.2],
            [0, 0.1 + 2e-8, 0.2],
            [0, 5e-7, 1e-6],
            [0, -1],
        )
    ),
]


@pytest.mark.parametrize(("what", "words", "word"), REFUSALS)
def test_bad_arguments_are_refused(what, words, word):
    with pytest.raises(ValueError, match=word):
        kr.view(what, **words, open=False)


# The page


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


def test_text_in_a_scene_cannot_end_the_script():
    page = kr.view(TOP, open=False)
    named = View({**page.scene, "name": "</script>"})
    assert named.html.count("</script>") == page.html.count("</script>")
    assert "\\u003c/script>" in named.html


def test_a_page_is_saved_and_printed(tmp_path):
    kr.view(kr.scenes.cusps, open=False).save(tmp_path / "a.html")
    call("view cusps --save", tmp_path / "b.html")
    page = call("view cusps --save -")
    assert (tmp_path / "a.html").read_text() == (tmp_path / "b.html").read_text() == page
    assert page.startswith("<!") and page.endswith("\n") and not page.endswith("\n\n")


# Opening


@pytest.mark.parametrize(
    ("shell", "pages"), [("ZMQInteractiveShell", 0), ("TerminalInteractiveShell", 1)]
)
def test_a_page_opens_in_a_browser_except_in_a_notebook(home, monkeypatch, shell, pages):
    module = types.SimpleNamespace(get_ipython=type(shell, (), {}))
    monkeypatch.setitem(sys.modules, "IPython", module)
    kr.view(TOP)
    files = [*home.folder.glob(".cache/kreisel/*.html")]
    assert home.addresses == [file.as_uri() for file in files] and len(files) == pages


def test_without_a_browser_a_warning_names_the_calling_line(home, monkeypatch):
    monkeypatch.setattr(webbrowser, "open", lambda _: False)
    for top, name in {TOP: "thesis.html", TOP.replace(gravity=0.3): "top.html"}.items():
        with pytest.warns(UserWarning, match="no browser was found") as caught_warnings:
            file = kr.view(top, open=False).open()
        assert file == home.folder / ".cache/kreisel" / name and file.is_file()
        assert caught_warnings[0].filename == __file__
    for is_found in True, False:
        monkeypatch.setattr(webbrowser, "open", lambda _, is_found=is_found: is_found)
        told = call("view thesis")
        assert f"wrote {file.with_name('thesis.html')}" in told
        assert ("no browser" in told) is not is_found
    assert {each.name for each in file.parent.iterdir()} == {"thesis.html", "top.html"}


@pytest.mark.parametrize(
    ("system", "words", "place"),
    [
        ("linux", {"XDG_CACHE_HOME": "{}/cache"}, "cache/kreisel"),
        ("linux", {"LOCALAPPDATA": "{}/local"}, ".cache/kreisel"),
        ("darwin", {"XDG_CACHE_HOME": "{}/cache"}, "Library/Caches/kreisel"),
        ("win32", {"LOCALAPPDATA": "{}/local"}, "local/kreisel"),
        ("win32", {}, "kreisel"),
        ("linux", {"XDG_CACHE_HOME": "{}/file"}, "kreisel-*"),  # a temporary folder
    ],
)
def test_viewers_are_saved_in_the_cache_folder_of_the_system(
    home, monkeypatch, system, words, place
):
    (home.folder / "file").write_text("")
    monkeypatch.setattr("tempfile.tempdir", str(home.folder))
    for name, value in words.items():
        monkeypatch.setenv(name, value.format(home.folder))
    page = kr.view(TOP, open=False)
    monkeypatch.setattr(sys, "platform", system)
    file = page.open()
    monkeypatch.setattr(sys, "platform", "linux")
    assert [file] == [*home.folder.glob(f"{place}/thesis.html")]


def test_an_installation_without_viewer_says_how_to_get_it(home, monkeypatch):
    exists = Path.exists
    monkeypatch.setattr(Path, "exists", lambda file: file.name != "viewer.html" and exists(file))
    with pytest.raises(FileNotFoundError, match="make viewer"):
        kr.view(TOP, open=False).html  # noqa: B018  reading the attribute raises
    for more in ("", f" --save {home.folder}/top.html"):
        told = join_lines(call(f"view cusps{more}", code=1))
        assert told.startswith("Error: ") and "make viewer" in told
    assert not [*home.folder.iterdir()]


def test_notebooks_show_the_page_in_a_frame():
    view = kr.view(kr.scenes.cusps, open=False)
    shown = re.search(r'<iframe srcdoc="(.*?)" style=', view._repr_html_(), re.S)[1]
    assert html.unescape(shown) == view.html
