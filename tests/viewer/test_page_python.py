"""Tests of kr.view in Python, in notebooks and on the command line."""

import base64

import kreisel as kr
import numpy as np
import pytest
from browser import advance, drag, load, open_viewer, read_record, read_scene, read_states, wait_for
from click.testing import CliRunner
from internals import cli, view
from toolbox import open_context


def test_a_scene_from_python(window, tmp_path):
    kr.view(kr.scenes.asymmetric, open=False).save(tmp_path / "a.html")
    page = open_viewer(window, tmp_path / "a.html")
    advance(page, 5)
    expected = kr.solve(kr.scenes.asymmetric, 5, "strang", step=0.01, every=500).states[-1]
    assert read_states(page)[0] == expected.tolist()


def test_bodies_without_given_density_are_drawn_with_density_1(window, tmp_path):
    kr.view(kr.scenes.thesis, open=False).save(tmp_path / "a.html")
    page = open_viewer(window, tmp_path / "a.html")
    assert page.evaluate("kreisel.view.body.half") == pytest.approx((0.8, 0.8, 1), rel=1e-6)
    page.evaluate("kreisel.page.setValue('show.solid', 'box')")  # a box has corners
    drag(page, "corner", (10, -10), number=5)
    assert (
        read_scene(page)["body"]["density"] == pytest.approx(1, rel=1e-12) and page.troubles == []
    )


def test_a_path_plays_beside_a_live_top(window, tmp_path):
    path = kr.solve(kr.scenes.thesis, np.arange(201) * 0.05, "extrap", tol=1e-12)
    kr.view(path, methods="rk4", open=False).save(tmp_path / "a.html")
    page = open_viewer(window, tmp_path / "a.html")
    advance(page, 10)
    assert read_states(page)[1] == path.states[-1].tolist()
    assert 0 < read_record(page, 1, "error").max() < 1e-4
    page.evaluate(
        "kreisel.page.beginChange(); kreisel.page.editScene((s) => (s.momentum[0] += 0.1))"
    )
    assert read_scene(page)["tracks"] == []  # the trace belonged to another motion


def test_three_methods_from_python_are_shown_side_by_side(window, tmp_path):
    names = ["strang", "rk4", "taylor"]
    kr.view(kr.scenes.thesis, methods=names, open=False).save(tmp_path / "a.html")
    page = open_viewer(window, tmp_path / "a.html")
    assert page.evaluate("kreisel.page.tops.map(({method}) => method)") == names
    assert page.troubles == []


def test_python_and_the_viewer_use_the_same_ticks(window, tmp_path):
    kr.view(kr.scenes.thesis, step=3e-6, open=False).save(tmp_path / "a.html")
    page = open_viewer(window, tmp_path / "a.html")
    assert page.evaluate("kreisel.page.tops[0].ticks") == 3


def test_view_in_a_notebook_and_on_the_command_line(tmp_path):
    viewer = kr.view(kr.scenes.cusps, methods=["strang", "rk4"], step=0.02, speed=2, open=False)
    assert viewer.scene["methods"] == ["strang", "rk4"] and viewer.scene["step"] == [0.02]
    assert "cusps" in viewer.html
    assert viewer._repr_html_().startswith('<iframe srcdoc="&lt;!doctype html&gt;')
    result = CliRunner().invoke(
        cli.main, ["view", "dzhanibekov", "--save", str(tmp_path / "a.html")]
    )
    assert result.exit_code == 0 and "flips over" in (tmp_path / "a.html").read_text()


FORBIDDEN = """async () => {
    const tried = [];
    const script = document.createElement("script");
    script.textContent = "window.foreign = true";
    document.body.append(script);
    const button = document.createElement("button");
    button.setAttribute("onclick", "window.foreign = true");
    document.body.append(button);
    button.click();
    const link = document.createElement("a");
    link.href = "javascript:window.foreign = true";
    document.body.append(link);
    link.click();
    for (const ask of [() => fetch("data:text/plain,a"), () => import("data:text/javascript,0")])
        await ask().then(() => tried.push("came"), () => tried.push("refused"));
    await new Promise((done) => setTimeout(done, 0));
    return [window.foreign ?? false, ...tried];
}"""


def test_the_viewer_runs_only_its_own_script(window, tmp_path):
    kr.view(kr.scenes.asymmetric, open=False).save(tmp_path / "a.html")
    page = open_viewer(window, tmp_path / "a.html")
    assert page.troubles == []
    assert page.evaluate(FORBIDDEN) == [False, "refused", "refused"]
    assert all("Content Security Policy" in trouble for trouble in page.troubles)


def test_the_page_runs_in_a_notebook(browser):
    page = open_context(browser, offline=True).new_page()
    page.set_content(kr.view(kr.scenes.dzhanibekov, open=False)._repr_html_())
    frame = page.frames[1]
    wait_for(frame, "!!window.kreisel")
    assert frame.evaluate("kreisel.page.tops.length") == 1
    page.context.close()


def test_view_refuses_invalid_arguments(tmp_path, monkeypatch):
    with pytest.raises(TypeError, match=r"Scene or a kreisel\.Path"):
        kr.view("thesis", open=False)
    with pytest.raises(ValueError, match="one to three methods"):
        kr.view(kr.scenes.thesis, methods=["strang", "rk4", "extrap", "taylor"], open=False)
    with pytest.raises(ValueError, match="does not apply"):
        kr.view(kr.scenes.kowalewski, methods="bobenko_suris", open=False)
    with pytest.raises(ValueError, match="millionths"):
        kr.view(kr.scenes.thesis, step=1e-7, open=False)
    with pytest.raises(ValueError, match="equal intervals"):
        kr.view(kr.solve(kr.scenes.thesis, [0.1, 0.3], "rk4", step=0.01), open=False)
    monkeypatch.setattr(view, "_PAGE", tmp_path / "none.html")
    with pytest.raises(FileNotFoundError, match="make viewer"):
        _ = kr.view(kr.scenes.thesis, open=False).html


def test_states_are_transferred_exactly():
    path = kr.solve(kr.scenes.thesis, 1, "rk4", step=0.01, every=1)
    (track,) = kr.view(path, open=False).scene["tracks"]
    assert (
        np.frombuffer(base64.b64decode(track["states"]), "<f8").tolist()
        == path.states.ravel().tolist()
    )


# The equivalent Python program


@pytest.mark.parametrize(
    "preset, changes",
    [
        ("Sleeping top", {}),
        ("Compare four", {}),
        ("Equal work", {}),
        ("Kowalewski", {"methods": ["taylor", "strang", "rk4"], "step": [0.03, 0.07]}),
    ],
)
def test_the_program_gives_the_states_of_the_viewer(page, preset, changes):
    load(page, preset, **changes)
    program, names = page.get_by_label("Equivalent Python program").input_value(), {}
    exec(program, names)
    advance(page, 100)
    states = np.array(read_states(page))[:, 1:]
    ends = np.array([[*end.attitude, *end.momentum] for end in names["ends"]])
    restarts = "def solve_in_steps" in program
    assert ends == pytest.approx(states, abs=1e-7 if restarts else 1e-11)
    exact = [
        top["method"] not in {"extrap", "taylor"} for top in page.evaluate("kreisel.page.tops")
    ]
    assert ends[exact].tolist() == states[exact].tolist()


def test_the_program_contains_a_body_given_by_numbers(page):
    page.evaluate("s => kreisel.page.load(s)", kr.view(kr.scenes.asymmetric, open=False).scene)
    program, names = page.get_by_label("Equivalent Python program").input_value(), {}
    exec(program, names)
    advance(page, 100)
    (end,) = names["ends"]
    assert [*end.attitude, *end.momentum] == read_states(page)[0][1:]
