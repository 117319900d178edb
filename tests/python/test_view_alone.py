"""kreisel.view without a browser: what it refuses, where it shows itself, which steps it takes."""

import base64
import hashlib
import re
import sys
import types
import webbrowser

import kreisel as kr
import numpy as np
import pytest

TOP = kr.scenes.thesis


def test_the_page_may_run_its_own_script_and_ask_nobody():
    """By its content policy, whatever a scene's text or a link may say."""
    page = kr.view(TOP, open=False).html
    (told,) = re.findall(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page)
    policy = dict(part.split(" ", 1) for part in told.split("; "))
    assert policy["default-src"] == policy["form-action"] == policy["base-uri"] == "'none'"
    assert not {"connect-src", "frame-src", "object-src"} & set(policy)
    (script,) = re.findall(r'<script type="module">(.*?)</script>', page, re.DOTALL)
    own = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy["script-src"] == f"'sha256-{own}' 'wasm-unsafe-eval'"
    assert "unsafe" not in policy["style-src-elem"]


@pytest.mark.parametrize("step", [0.5e-6, 0.99e-6, 2148.0, 1.5e-6, 0.0100005])
def test_steps_that_are_no_whole_millionths_are_refused(step):
    with pytest.raises(ValueError, match="whole millionths"):
        kr.view(TOP, step=step, open=False)


@pytest.mark.parametrize("step", [1e-6, 2147.0, 0.3, 2e-6])
def test_steps_of_whole_millionths_are_taken(step):
    assert kr.view(TOP, step=step, open=False).scene["step"] == [step]


@pytest.mark.parametrize("name", ["auto", "gsl_rk8pd"])
def test_methods_that_the_page_has_not_are_refused(name):
    if name not in ("auto", *kr.methods):
        pytest.skip("needs GSL")
    with pytest.raises(ValueError, match=f"the page has no '{name}'"):
        kr.view(TOP, methods=name, open=False)


def test_no_method_and_four_are_refused():
    for names in ([], ["strang"] * 4):
        with pytest.raises(ValueError, match="one to three methods"):
            kr.view(TOP, methods=names, open=False)


def test_what_is_left_out_is_by_the_scene():
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
        (kr.solve(TOP, np.arange(5) * 0.25), 0.25),  # taylor has no step of its own
        (kr.solve(TOP, np.arange(5) * 0.25, "rk4", step=2.5e-7), 0.25),  # nor is this one
    ],
)
def test_a_path_gives_its_step(path, step):
    shown = kr.view(path, open=False).scene
    assert shown["step"] == [step]
    assert shown["tracks"][0]["step"] == pytest.approx(float(path.t[1]), rel=1e-12)


@pytest.mark.parametrize("times", [[0.0], [0.0, 0.1, 0.3], [0.1, 0.2], [0.0, 0.1, 0.2 + 2e-7]])
def test_a_path_that_cannot_be_played_is_refused(times):
    with pytest.raises(ValueError, match="equal intervals"):
        kr.view(kr.solve(TOP, times), open=False)


@pytest.fixture
def opened(monkeypatch):
    """The addresses that were shown in a browser, instead of the browser."""
    found = []
    monkeypatch.setattr(webbrowser, "open", lambda address: found.append(address) or True)
    return found


def test_a_page_opens_in_a_browser(opened):
    kr.view(TOP)
    assert len(opened) == 1 and opened[0].startswith("file:///") and opened[0].endswith(".html")


class ZMQInteractiveShell:
    pass


class TerminalInteractiveShell:
    pass


@pytest.mark.parametrize(
    ("shell", "pages"), [(ZMQInteractiveShell(), 0), (TerminalInteractiveShell(), 1), (None, 1)]
)
def test_a_notebook_shows_the_page_itself(opened, monkeypatch, shell, pages):
    told = types.SimpleNamespace(get_ipython=lambda: shell)
    monkeypatch.setitem(sys.modules, "IPython", told)
    kr.view(TOP)
    assert len(opened) == pages
